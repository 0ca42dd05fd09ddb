//! How much memory K will take, told before it is put together, and how much there is.
//!
//! Rows of F are nearly all of it. Their length is measured: a few rows are cast as they will be, with every column
//! kept. With n patches, e entries a row, v choices of tau and c casts held at once,
//!
//! ```text
//! n (16 e + ROW) v          rows while they are joined: once apart, once together, 8 bytes an entry
//! n (8 e + 16) v c          and the joined rows of the casts before
//! n (TERM terms + PATCH) v  E, KE, K²E, ... and what else a patch carries
//! 8 n threads + 16 rays     sums of one row in each thread, the table of sample points
//! 5 n luminaires            what lies between, where it is known
//! ```
//!
//! The number of terms follows from the spectral radius, which the same rows tell about: where r is the share of light
//! that a patch passes on, its mean over the rows weighted by r itself, for light stays where much of it is passed on.
//! The tail bound `r^n / (1 - r)` then ends the series.
//!
//! Fewer patches have rows no longer, which bounds from below the number that fits. Not handled: the pictures (some
//! hundred bytes a pixel), and the scene itself, which is already loaded.

use crate::form_factors::{FormFactors, Rows, Sampling, Variant, cast};
use crate::light::Transport;
use crate::operator::PatchMaterials;
use crate::render::assembly::Discretization;
use crate::render::unfit::{Stored, Unfit};
use crate::solve::Settings;

/// A row while it is apart: two lists with their allocations, its sum, and its place in the list of variants.
const ROW: f64 = 56.0 + 24.0 + 2.0 * 16.0 + 8.0;
/// Both halves of one term, RGB in single precision.
const TERM: f64 = 24.0;
/// Other lists over patches: materials, areas, received light, the vectors that the bounds iterate on.
const PATCH: f64 = 200.0;
/// Rows cast to learn their length, and rays for them in all, about.
const PILOTS: usize = 64;
const PILOT_RAYS: usize = 1 << 20;
/// Share of the memory there is that is used at most: estimates are off by some tenths, and others need memory too.
const USABLE: f64 = 0.8;

/// What assembly will need.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Patches that were counted.
    pub patches: usize,
    /// Mean entries of a row of F over all choices of tau, measured.
    pub entries: f64,
    /// Choices of tau that need rows.
    pub variants: usize,
    /// Bytes at the peak.
    pub bytes: f64,
    /// Patches that would fit in the memory given.
    pub fitting: usize,
}

/// What is held at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    /// Casts of K.
    pub casts: usize,
    /// Solutions over it.
    pub solutions: usize,
    /// Terms of each solution.
    pub terms: Kept,
}

impl Held {
    /// So many casts of K of all modes, which are solved one after the other.
    pub fn of_modes(modes: &[Transport], casts: usize) -> Held {
        Held { casts, solutions: modes.len().min(casts.max(1)), terms: Kept::Enough }
    }
}

/// Which terms of a series are kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kept {
    /// As many as the default tolerance takes.
    Enough,
    /// E and so many bounces.
    First(usize),
}

/// What a few rows of F tell of all.
struct Pilot {
    /// Mean entries of a row.
    entries: f64,
    /// Choices of tau that need rows.
    variants: usize,
    /// About the largest spectral radius of the modes.
    radius: f64,
}

impl Pilot {
    /// Terms of a series, E among them.
    fn terms(&self, kept: Kept) -> f64 {
        let Settings { tolerance, max_terms } = Settings::default();
        match kept {
            Kept::First(n) => n as f64 + 1.0,
            // Series that diverge are refused before the first term.
            Kept::Enough if self.radius <= 0.0 || self.radius >= 1.0 => 2.0,
            Kept::Enough => {
                let rest = tolerance * (1.0 - self.radius);
                (2.0 + rest.ln() / self.radius.ln()).min(max_terms as f64)
            }
        }
    }
}

impl Discretization {
    /// What K of all `modes` takes when `casts` of it are held at once, and the patches that fit in `limit` bytes.
    pub fn estimate_memory(&self, modes: &[Transport], sampling: &Sampling, casts: usize, limit: f64) -> Estimate {
        estimate(self, modes, sampling, Held::of_modes(modes, casts), limit)
    }

    /// Checks that K of all `modes` together, with so many solutions, fits in `limit` bytes; infinity asks nothing.
    ///
    /// # Errors
    /// [`Unfit`], with the number of patches that would.
    pub fn check_memory(
        &self,
        modes: &[Transport],
        sampling: &Sampling,
        solutions: usize,
        limit: f64,
    ) -> Result<(), Unfit> {
        check_held(self, modes, sampling, Held { casts: 1, solutions, terms: Kept::Enough }, limit)
    }
}

/// Checks that what is `held` of all `modes` fits in `limit` bytes.
pub(crate) fn check_held(
    p: &Discretization,
    modes: &[Transport],
    sampling: &Sampling,
    held: Held,
    limit: f64,
) -> Result<(), Unfit> {
    if limit.is_infinite() {
        return Ok(());
    }
    let Estimate { patches, entries, bytes, fitting, .. } = estimate(p, modes, sampling, held, limit);
    let unfit = Unfit { patches, stored: Stored::Rows(entries), bytes, limit, fitting: fitting.max(1) };
    if bytes <= limit { Ok(()) } else { Err(unfit) }
}

/// What is `held` of all `modes` takes, and the patches that fit in `limit` bytes.
pub(crate) fn estimate(
    p: &Discretization,
    modes: &[Transport],
    sampling: &Sampling,
    held: Held,
    limit: f64,
) -> Estimate {
    let pilot = pilot(p, modes, sampling);
    let (entries, variants) = (pilot.entries, pilot.variants);
    let n = p.patches.len();
    let needs = |n: f64| {
        // Fewer patches have rows no longer, and no row has more entries than there are patches.
        let e = entries.min(n);
        let (v, earlier) = (variants as f64, held.casts.saturating_sub(1) as f64);
        let rows = v * (16.0 * e + ROW) + v * earlier * (8.0 * e + 16.0);
        let terms = held.solutions as f64 * TERM * pilot.terms(held.terms);
        let own = rows + terms + PATCH * modes.len() as f64;
        let threads = rayon::current_num_threads() as f64;
        let shared = 8.0 * threads * v + 5.0 * p.luminaires.list.len() as f64;
        n * (own + shared) + 16.0 * f64::from(sampling.rays)
    };
    Estimate { patches: n, entries, variants, bytes: needs(n as f64), fitting: most_fitting(n, limit, needs) }
}

/// The most patches up to n whose need is within the limit: it grows with them, so halving the interval finds the last.
pub(crate) fn most_fitting(n: usize, limit: f64, needs: impl Fn(f64) -> f64) -> usize {
    let (mut low, mut high) = (0, n);
    while low < high {
        let middle = (low + high).div_ceil(2);
        if needs(middle as f64) <= limit { low = middle } else { high = middle - 1 }
    }
    low
}

/// The rows that a few tell the length of, spread over all n.
pub(crate) fn pilots(n: usize, sampling: &Sampling) -> Vec<usize> {
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
        entries: entries as f64 / rows.max(1) as f64,
        variants: variants.len(),
        radius: factors.iter().zip(&passed).map(radius).fold(0.0, f64::max),
    }
}

/// Bytes that may be used: a share of what the machine, or the control group this runs in, has left. Infinite where
/// the system does not tell.
pub fn usable_memory() -> f64 {
    USABLE * machine().min(control_group())
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

/// Fewer patches, where what is `held` of a mode would not fit in `limit` bytes; none where it does.
pub(crate) fn fewer(
    p: &Discretization,
    mode: Transport,
    sampling: &Sampling,
    held: Held,
    limit: f64,
) -> Option<Discretization> {
    let mut fewer: Option<Discretization> = None;
    // The count asked for is met within about a quarter only.
    for share in if limit.is_infinite() { &[][..] } else { &[1.0, 0.75, 0.5] } {
        let own = fewer.as_ref().unwrap_or(p);
        let e = estimate(own, &[mode], sampling, held, limit);
        if e.bytes <= limit {
            break;
        }
        fewer = Some(own.cut((share * e.fitting as f64).max(1.0) as usize));
    }
    fewer
}
