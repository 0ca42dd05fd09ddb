//! A few rows of F, cast to see how much memory all of them take before K is put together.
//!
//! They are cast as all will be, with every column kept. The number of terms follows from the spectral radius, which
//! the same rows estimate: where r is the share of light that a patch passes on, its mean over the rows weighted by r
//! itself, for light stays where much of it is passed on. The tail bound `r^n / (1 - r)` then ends the series.
//!
//! A search for a tolerance casts them once, for the patches that it begins with: what they show bounds what other
//! patches and more rays take, and only where that bound does not fit are those measured themselves.
//!
//! Not handled: crossings of rays, of which the rows of every tau are made.

use crate::form_factors::{FormFactors, Rows, Sampling, Variant, cast};
use crate::light::Transport;
use crate::operator::PatchMaterials;
use crate::render::assembly::Discretization;
use crate::render::memory::{Held, MemoryLimit, Pilot, Unfit};

/// Rows cast to measure their length, and rays for them in all, about.
const PILOTS: usize = 64;
const PILOT_RAYS: usize = 1 << 20;

impl Discretization {
    /// Checks that K of all `modes` together, with so many solutions, fits in `limit` bytes; infinity checks nothing,
    /// and what is known already fits.
    ///
    /// # Errors
    /// [`Unfit`], with the bytes needed, the mean entries of a row and the number of patches that would fit.
    pub fn check_memory(
        &self,
        modes: &[Transport],
        sampling: &Sampling,
        solutions: usize,
        limit: f64,
    ) -> Result<(), Unfit> {
        self.checked(modes, sampling, solutions, limit).map(|_| ())
    }

    /// What a few rows showed, where any were cast; an error where memory would not do.
    pub(crate) fn checked(
        &self,
        modes: &[Transport],
        sampling: &Sampling,
        solutions: usize,
        limit: f64,
    ) -> Result<Option<Pilot>, Unfit> {
        if limit.is_infinite() || self.knows(modes, sampling) {
            return Ok(None);
        }
        let pilot = pilot(self, modes, sampling);
        pilot.check(Held { casts: 1, solutions, bounces: None }, limit)?;
        Ok(Some(pilot))
    }
}

/// Fewer patches, where what is `held` of a mode would not fit in memory; none where it does.
pub(crate) fn fewer(
    p: &Discretization,
    mode: Transport,
    sampling: &Sampling,
    held: Held,
    limit: MemoryLimit,
) -> Option<Discretization> {
    let fits = |pilot: Pilot| pilot.at_most(p.patches.len(), sampling.rays).check(held, limit.bytes).is_ok();
    if limit.bytes.is_infinite() || limit.pilot.is_some_and(fits) || p.knows(&[mode], sampling) {
        return None;
    }
    let mut fewer: Option<Discretization> = None;
    // The count that is cut is that requested within about a quarter only.
    for share in [1.0, 0.75, 0.5] {
        let own = fewer.as_ref().unwrap_or(p);
        let Err(unfit) = pilot(own, &[mode], sampling).check(held, limit.bytes) else { break };
        fewer = Some(own.cut((share * unfit.fitting as f64).max(1.0) as usize));
    }
    fewer
}

/// The rows that are cast to estimate all n, spread over them.
pub fn pilots(n: usize, sampling: &Sampling) -> Vec<usize> {
    let count = (PILOT_RAYS / sampling.rays.max(1) as usize).clamp(4, PILOTS).min(n);
    (0..count).map(|k| (2 * k + 1) * n / (2 * count)).collect()
}

/// Casts a few rows of every choice of tau that needs any.
fn pilot(p: &Discretization, modes: &[Transport], sampling: &Sampling) -> Pilot {
    let n = p.patches.len();
    let chosen = pilots(n, sampling);
    let mut passed = Vec::new();
    let variants: Vec<Variant> = modes
        .iter()
        .filter_map(|&mode| {
            let transports = p.transports(mode);
            let m = PatchMaterials::new(&p.geometry.scene, &p.patches, &p.luminaires, &transports);
            let receives = m.receives();
            let mut rows = vec![false; n];
            for &i in &chosen {
                rows[i] = receives[i];
            }
            m.sends().contains(&true).then(|| {
                passed.push(m.passed_on());
                Variant { tau: transports.iter().map(|t| t.tau).collect(), rows, columns: vec![true; n] }
            })
        })
        .collect();
    let (factors, _) = cast(&p.geometry.rays, &p.patches, &variants, sampling, &|_| ());
    let entries: usize = factors.iter().map(|f| Rows::entries(&f.rows)).sum();
    let rows = chosen.len() * variants.len();
    let radius = |(f, passed): (&FormFactors, &Vec<f32>)| {
        let share = |&i: &usize| f64::from(f.row_sums[i].unwrap_or(0.0) * passed[i]);
        let sum: f64 = chosen.iter().map(share).sum();
        let squares: f64 = chosen.iter().map(|i| share(i).powi(2)).sum();
        if sum > 0.0 { squares / sum } else { 0.0 }
    };
    Pilot {
        patches: n,
        rays: sampling.rays,
        modes: modes.len(),
        variants: variants.len(),
        entries: entries as f64 / rows.max(1) as f64,
        radius: factors.iter().zip(&passed).map(radius).fold(0.0, f64::max),
        kept: p.rows.kept_share(),
        luminaires: p.luminaires.list.len(),
    }
}
