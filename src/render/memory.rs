//! How much memory K takes, from what a few rows of F show of all; how much there is; and the refusal where it would
//! not do: what needs it, and what would fit.
//!
//! Rows of F are nearly all of it; their length is measured ([`crate::render::pilot`]). With n patches, e entries a
//! row, v choices of tau and c casts held at once,
//!
//! ```text
//! n (16 e + ROW) v          rows while they are joined: once apart, once together, 8 bytes an entry
//! n (8 e + 16) v c          and the joined rows of the casts before
//! n (TERM terms + PATCH) v  E, KE, K²E, ... and what else a patch carries
//! 8 n threads + 16 rays     sums of one row in each thread, the table of sample points
//! 5 n luminaires            what lies between, where it is known
//! ```
//!
//! Of rows that several processes share, each keeps about its share, and no more than a quarter above.
//!
//! Fewer patches have rows no longer, which bounds from below the number that fits. Not handled: the pictures (some
//! hundred bytes a pixel), guiding densities of patches (at most 230 MB), and the scene itself, which is already loaded
//! when this is asked.

use halflight_team::part_of_machine;

use crate::pictures::Size;
use crate::solve::Settings;

/// A row while it is apart: two lists with their allocations, its sum, and its place in the list of variants.
const ROW: f64 = 56.0 + 24.0 + 2.0 * 16.0 + 8.0;
/// Both halves of one term, RGB in single precision.
const TERM: f64 = 24.0;
/// Other lists over patches: materials, areas, received light, the vectors that the bounds iterate on.
const PATCH: f64 = 200.0;
/// Share of the memory there is that is used at most: estimates are off by some tenths, and others need memory too.
const USABLE: f64 = 0.8;

/// What is held in memory at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    /// Casts of K.
    pub casts: usize,
    /// Solutions over it.
    pub solutions: usize,
    /// Bounces of each solution; where there is no number, as many as the default tolerance takes.
    pub bounces: Option<usize>,
}

impl Held {
    /// Terms of a solution, E among them, where the spectral radius is about `radius`.
    fn terms(&self, radius: f64) -> f64 {
        let Settings { tolerance, max_terms, .. } = Settings::default();
        match self.bounces {
            Some(n) => n as f64 + 1.0,
            // Series that diverge are refused before the first term.
            None if radius <= 0.0 || radius >= 1.0 => 2.0,
            None => (2.0 + (tolerance * (1.0 - radius)).ln() / radius.ln()).min(max_terms as f64),
        }
    }
}

/// What a few rows of F show of all, for some modes.
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    /// Patches, and rays of each.
    pub(crate) patches: usize,
    pub(crate) rays: u32,
    /// Modes, and the choices of tau that need rows.
    pub(crate) modes: usize,
    pub(crate) variants: usize,
    /// Mean entries of a row.
    pub(crate) entries: f64,
    /// About the largest spectral radius of the modes.
    pub(crate) radius: f64,
    /// Share of the rows that this process keeps.
    pub(crate) kept: f64,
    /// Luminaires by closed form.
    pub(crate) luminaires: usize,
}

impl Pilot {
    /// No less than what would be seen with other patches and rays: rows grow no faster than either.
    pub(crate) fn at_most(self, patches: usize, rays: u32) -> Pilot {
        let more = |now: f64, before: f64| (now / before).max(1.0);
        let more = more(patches as f64, self.patches as f64) * more(rays.into(), self.rays.into());
        Pilot { patches, rays, entries: more * self.entries, ..self }
    }

    /// Checks that what is `held` fits in `limit` bytes.
    pub(crate) fn check(&self, held: Held, limit: f64) -> Result<(), Unfit> {
        let needs = |n: f64| {
            // Fewer patches have rows no longer, and no row has more entries than there are patches.
            let e = self.entries.min(n);
            let (v, earlier) = (self.variants as f64, held.casts.saturating_sub(1) as f64);
            let rows = self.kept * v * (16.0 * e + ROW + earlier * (8.0 * e + 16.0));
            let terms = held.solutions as f64 * TERM * held.terms(self.radius);
            let own = rows + terms + PATCH * self.modes as f64;
            let threads = rayon::current_num_threads() as f64;
            let shared = 8.0 * threads * v + 5.0 * self.luminaires as f64;
            n * (own + shared) + 16.0 * f64::from(self.rays)
        };
        check_fit(self.patches, Stored::Rows(self.entries), limit, needs)
    }
}

/// Bytes that K may take, and what a few rows showed of a mode, where any were cast.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MemoryLimit {
    pub bytes: f64,
    pub pilot: Option<Pilot>,
}

impl From<f64> for MemoryLimit {
    /// So many bytes, and no rows cast.
    fn from(bytes: f64) -> MemoryLimit {
        MemoryLimit { bytes, pilot: None }
    }
}

/// Checks that so many patches fit in `limit` bytes where n of them need `needs(n)`, which grows with n.
pub fn check_fit(patches: usize, stored: Stored, limit: f64, needs: impl Fn(f64) -> f64) -> Result<(), Unfit> {
    let bytes = needs(patches as f64);
    if bytes <= limit {
        return Ok(());
    }
    let (mut fitting, mut high) = (1, patches);
    while fitting < high {
        let middle = (fitting + high).div_ceil(2);
        if needs(middle as f64) <= limit { fitting = middle } else { high = middle - 1 }
    }
    Err(Unfit { patches, stored, bytes, limit, fitting })
}

/// Bytes that may be used: a share of what the machine, or the control group this runs in, has left. Infinite where
/// the system does not say. Processes that share the work share what their machines have, and all go by the least.
pub fn usable_memory() -> f64 {
    part_of_machine(USABLE * machine().min(control_group()))
}

/// `MemAvailable` of Linux's `/proc/meminfo`.
fn machine() -> f64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let kib = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"));
    let kib = kib.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok());
    kib.map_or(f64::INFINITY, |kib| 1024.0 * kib)
}

/// What the strictest of the control groups (version 2) above this process leaves; their file cache can be given back.
fn control_group() -> f64 {
    let text = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let own = text.lines().find_map(|l| l.strip_prefix("0::/"));
    let mut folder = std::path::Path::new("/sys/fs/cgroup").join(own.unwrap_or_default());
    let mut least = f64::INFINITY;
    while folder.starts_with("/sys/fs/cgroup") {
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
        let number = |name: &str| read(name).trim().parse::<f64>().ok();
        if let (Some(most), Some(used)) = (number("memory.max"), number("memory.current")) {
            let stat = read("memory.stat");
            let cache = stat.lines().find_map(|l| l.strip_prefix("inactive_file "));
            let cache = cache.and_then(|c| c.parse::<f64>().ok()).unwrap_or(0.0);
            least = least.min((most - used + cache).max(0.0));
        }
        folder.pop();
    }
    least
}

/// What memory is needed for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stored {
    /// Rows of F, of so many entries for each choice of tau.
    Rows(f64),
    /// Every crossing of every ray, so many for each patch.
    Crossings(f64),
}

/// A problem would not fit in memory.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "{} of {patches} patches {} about {} of memory, and {} can be used",
    .stored.name(), .stored.need(), amount(*.bytes), amount(*.limit)
)]
pub struct Unfit {
    /// Patches requested, or that the scene needs at least.
    pub patches: usize,
    /// What takes the memory.
    pub stored: Stored,
    /// Bytes needed, about.
    pub bytes: f64,
    /// Bytes that can be used.
    pub limit: f64,
    /// Patches that would fit; at least 1.
    pub fitting: usize,
}

/// Pictures would not fit in memory.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "pictures of {}x{} pixels need about {} of memory, and {} can be used",
    .size.width, .size.height, amount(*.bytes), amount(*.limit)
)]
pub struct PictureUnfit {
    /// Width and height requested.
    pub size: Size,
    /// Bytes a pixel: sums, their errors and what is seen there.
    pub each: f64,
    /// Bytes needed, about.
    pub bytes: f64,
    /// Bytes that can be used.
    pub limit: f64,
    /// Pixels that would fit.
    pub fitting: u64,
}

/// Bytes a pixel, measured as what a run grows by with its pictures.
pub mod pixel {
    /// A picture of given effort.
    pub const RENDER: f64 = 260.0;
    /// One to a tolerance.
    pub const WITHIN: f64 = 1800.0;
    /// One by path tracing.
    pub const TRACE: f64 = 310.0;
    /// Terms of the bounce series, and for each of them.
    pub const BOUNCES: (f64, f64) = (2000.0, 100.0);
}

/// Checks that pictures of a size fit in `limit` bytes where `each` bytes are kept for a pixel.
///
/// # Errors
/// [`PictureUnfit`], with the number of pixels that would.
pub fn check_pictures(size: Size, each: f64, limit: f64) -> Result<(), PictureUnfit> {
    let bytes = size.width as f64 * size.height as f64 * each;
    if bytes <= limit { Ok(()) } else { Err(PictureUnfit { size, each, bytes, limit, fitting: (limit / each) as u64 }) }
}

impl Stored {
    fn name(self) -> &'static str {
        match self {
            Stored::Rows(_) => "K",
            Stored::Crossings(_) => "the crossings of the rays",
        }
    }

    fn need(self) -> &'static str {
        match self {
            Stored::Crossings(_) => "need",
            Stored::Rows(_) => "needs",
        }
    }
}

fn amount(bytes: f64) -> String {
    let mib = bytes / f64::from(1 << 20);
    if mib < 1000.0 { format!("{mib:.1} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}
