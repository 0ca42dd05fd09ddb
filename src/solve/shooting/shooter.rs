//! What a form of shooting provides: the patches, and columns of F on demand.
//!
//! Light travels alike whatever its channel and generation, so all a shot needs is the column `F_ij` of its sender j:
//! receiver i then gets `F_ij L_j`, and `rho_i F_ij L_j` of it is seen and `alpha_i rho_i F_ij L_j` shot again.

use std::borrow::Cow;

use crate::light::{Light, Rgb};
use crate::solve::neumann::Diverges;

/// The patches as the solver sees them, one entry a patch.
#[derive(Clone, Copy, Debug)]
pub struct Surfaces<'a> {
    /// Areas, the file's units squared.
    pub areas: &'a [f64],
    /// Reflectance.
    pub rho: &'a [Rgb],
    /// Interreflection.
    pub alpha: &'a [f32],
    /// `E`, W/(m² sr).
    pub emission: &'a [Light],
}

/// A patch that shoots.
#[derive(Clone, Copy, Debug)]
pub struct Sender {
    /// Its number.
    pub patch: u32,
    /// How many shots went before: chooses the rays.
    pub shot: u64,
    /// The power it shoots as a share of the power emitted.
    pub share: f64,
}

/// A column of F, or one summand of it.
#[derive(Clone, Debug)]
pub struct Column<'a> {
    /// Which of the batch sends.
    pub sender: usize,
    /// Receiving patches, ascending.
    pub receivers: Cow<'a, [u32]>,
    /// `F_ij` of each receiver i.
    pub factors: Cow<'a, [f32]>,
    /// What became of the rest; `None` where the form cannot tell.
    pub fate: Option<Fate>,
    /// Rays it took.
    pub rays: u64,
}

/// Shares of the sender's power that do not land on a patch, or land beyond what was sent.
///
/// A ray meets its crossings with weight w, the product of tau before. At each, a reflecting side receives w and passes
/// on tau w: it makes tau w. A black back keeps (1 - tau) w. So `1 + created = landed + black + escaped`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fate {
    /// Left the scene.
    pub escaped: f64,
    /// Kept by black backs.
    pub black: f64,
    /// Passed on by reflecting sides on top of what they received.
    pub created: f64,
}

/// What is known of convergence before the first shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreknowledge {
    /// Spectral radius proved below 1.
    Converges,
    /// Nothing: the run has to be watched.
    Unknown,
}

/// A form of shooting.
pub trait Shooter: Sync {
    /// The patches.
    fn surfaces(&self) -> Surfaces<'_>;

    /// `F E` of the emitters that do not shoot their emission themselves, lights without area included, W/(m² sr), and
    /// how many rays it took.
    fn received(&self) -> (&[Rgb], u64);

    /// Power that lights without area bring to the patches, W over all channels.
    fn punctual(&self) -> f64;

    /// Whether patch i's emission comes by [`Shooter::received`].
    fn emits_by_closed_form(&self, i: usize) -> bool;

    /// The columns of F of a batch of senders; several for one sender are to be added.
    fn columns(&self, senders: &[Sender]) -> Vec<Column<'_>>;

    /// What can be said of convergence beforehand.
    ///
    /// # Errors
    /// [`Diverges`] where the form knows that its series does not converge, or can bound it but not below 1.
    fn foreknowledge(&self) -> Result<Foreknowledge, Diverges>;
}
