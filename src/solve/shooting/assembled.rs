//! Shooting over an assembled K: columns of F as stored, so that generation n is the Neumann term `KⁿE` of the same K.
//!
//! F as cast from the receivers is reciprocal only within the noise of its rays: the power that a column delivers is
//! not exactly the power sent, and [`Balance::undelivered`](crate::solve::shooting::report::Balance) shows the
//! difference.

use std::borrow::Cow;

use crate::light::Rgb;
use crate::operator::{Bounds, Operator};
use crate::solve::neumann::{Diverges, Verdict, refuse, verdict};
use crate::solve::shooting::shooter::{Column, Foreknowledge, Sender, Shooter, Surfaces};

/// Shoots over an [`Operator`].
#[derive(Clone, Copy, Debug)]
pub struct AssembledShooter<'a> {
    k: &'a Operator,
}

impl<'a> AssembledShooter<'a> {
    /// Shoots over this K. F is transposed on its first use, which doubles its memory.
    pub fn new(k: &'a Operator) -> Self {
        AssembledShooter { k }
    }
}

impl Shooter for AssembledShooter<'_> {
    fn surfaces(&self) -> Surfaces<'_> {
        Surfaces {
            areas: self.k.areas(),
            rho: self.k.reflectances(),
            alpha: self.k.alphas(),
            emission: self.k.emission(),
        }
    }

    fn received(&self) -> (&[Rgb], u64) {
        (self.k.received(), 0)
    }

    fn punctual(&self) -> f64 {
        self.k.punctual()
    }

    fn emits_by_closed_form(&self, i: usize) -> bool {
        !self.k.glows()[i]
    }

    fn columns(&self, senders: &[Sender]) -> Vec<Column<'_>> {
        let transposed = self.k.transposed();
        let column = |(sender, s): (usize, &Sender)| {
            let (receivers, factors) = transposed.row(s.patch as usize);
            Column { sender, receivers: Cow::Borrowed(receivers), factors: Cow::Borrowed(factors), fate: None, rays: 0 }
        };
        senders.iter().enumerate().map(column).collect()
    }

    fn foreknowledge(&self) -> Result<Foreknowledge, Diverges> {
        let (verdict, spectrum) = verdict(self.k);
        let zero = Bounds { lower: 0.0, upper: 0.0 };
        match verdict {
            Verdict::Converges | Verdict::Ends => Ok(Foreknowledge::Converges),
            _ => Err(refuse(self.k, verdict, spectrum.map_or(zero, |s| s.worst()))),
        }
    }
}
