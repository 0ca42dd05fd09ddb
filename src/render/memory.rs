//! How much memory K will take, estimated before it is put together; how much there is; and the refusal where it would
//! not do: what needs it, and what would fit.
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
//! Of rows that several processes share, each keeps about its share, and no more than a quarter above.
//!
//! The number of terms follows from the spectral radius, which the same rows estimate: where r is the share of light
//! that a patch passes on, its mean over the rows weighted by r itself, for light stays where much of it is passed on.
//! The tail bound `r^n / (1 - r)` then ends the series.
//!
//! Fewer patches have rows no longer, which bounds from below the number that fits. Not handled: the pictures (some
//! hundred bytes a pixel), guiding densities of patches (at most 230 MB), and the scene itself, which is already loaded
//! when this is asked.

use halflight_team::part_of_machine;

use crate::form_factors::{FormFactors, Rows, Sampling, Variant, cast};
use crate::light::Transport;
use crate::operator::PatchMaterials;
use crate::pictures::Size;
use crate::render::assembly::Discretization;
use crate::solve::Settings;

/// A row while it is apart: two lists with their allocations, its sum, and its place in the list of variants.
const ROW: f64 = 56.0 + 24.0 + 2.0 * 16.0 + 8.0;
/// Both halves of one term, RGB in single precision.
const TERM: f64 = 24.0;
/// Other lists over patches: materials, areas, received light, the vectors that the bounds iterate on.
const PATCH: f64 = 200.0;
/// Rows cast to measure their length, and rays for them in all, about.
const PILOTS: usize = 64;
const PILOT_RAYS: usize = 1 << 20;
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
        let Settings { tolerance, max_terms } = Settings::default();
        match self.bounces {
            Some(n) => n as f64 + 1.0,
            // Series that diverge are refused before the first term.
            None if radius <= 0.0 || radius >= 1.0 => 2.0,
            None => (2.0 + (tolerance * (1.0 - radius)).ln() / radius.ln()).min(max_terms as f64),
        }
    }
}

/// What a few rows of F show of all.
struct Pilot {
    /// Mean entries of a row.
    entries: f64,
    /// Choices of tau that need rows.
    variants: usize,
    /// About the largest spectral radius of the modes.
    radius: f64,
}

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
        if self.knows(modes, sampling) {
            return Ok(());
        }
        check_held(self, modes, sampling, Held { casts: 1, solutions, bounces: None }, limit)
    }
}

/// Checks that what is `held` of all `modes` fits in `limit` bytes.
fn check_held(
    p: &Discretization,
    modes: &[Transport],
    sampling: &Sampling,
    held: Held,
    limit: f64,
) -> Result<(), Unfit> {
    if limit.is_infinite() {
        return Ok(());
    }
    let Pilot { entries, variants, radius } = pilot(p, modes, sampling);
    let needs = |n: f64| {
        // Fewer patches have rows no longer, and no row has more entries than there are patches.
        let e = entries.min(n);
        let (v, earlier) = (variants as f64, held.casts.saturating_sub(1) as f64);
        let rows = p.rows.kept_share() * v * (16.0 * e + ROW + earlier * (8.0 * e + 16.0));
        let terms = held.solutions as f64 * TERM * held.terms(radius);
        let own = rows + terms + PATCH * modes.len() as f64;
        let threads = rayon::current_num_threads() as f64;
        let shared = 8.0 * threads * v + 5.0 * p.luminaires.list.len() as f64;
        n * (own + shared) + 16.0 * f64::from(sampling.rays)
    };
    check_fit(p.patches.len(), Stored::Rows(entries), limit, needs)
}

/// Checks that so many patches fit in `limit` bytes where n of them need `needs(n)`, which grows with n.
pub(crate) fn check_fit(patches: usize, stored: Stored, limit: f64, needs: impl Fn(f64) -> f64) -> Result<(), Unfit> {
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

/// Fewer patches, where what is `held` of a mode would not fit in `limit` bytes; none where it does.
pub(crate) fn fewer(
    p: &Discretization,
    mode: Transport,
    sampling: &Sampling,
    held: Held,
    limit: f64,
) -> Option<Discretization> {
    let mut fewer: Option<Discretization> = None;
    // The count that is cut is that requested within about a quarter only.
    for share in [1.0, 0.75, 0.5] {
        let own = fewer.as_ref().unwrap_or(p);
        let Err(unfit) = check_held(own, &[mode], sampling, held, limit) else { break };
        fewer = Some(own.cut((share * unfit.fitting as f64).max(1.0) as usize));
    }
    fewer
}

/// The rows that are cast to estimate all n, spread over them.
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
    /// Rows of F, of so many entries for each choice of tau; the number of patches was requested.
    Rows(f64),
    /// The same for the patches that verdicts rest on, whose number the time chooses.
    Verdicts(f64),
    /// The same for patches that the command chooses for its ladders.
    Ladders(f64),
    /// Every crossing of every ray, so many for each patch.
    Crossings(f64),
    /// I - K as a dense matrix.
    Dense,
}

/// A problem would not fit in memory.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
#[error(
    "{} of {patches} patches {} about {} of memory, and {} can be used",
    .stored.name(), .stored.need(), amount(*.bytes), amount(*.limit)
)]
#[diagnostic(
    code(halflight::memory),
    help("{}. About {fitting} patches would fit: {}", .stored.why(), self.remedy())
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
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
#[error(
    "pictures of {}x{} pixels need about {} of memory, and {} can be used",
    .size.width, .size.height, amount(*.bytes), amount(*.limit)
)]
#[diagnostic(
    code(halflight::memory::pictures),
    help(
        "this command keeps about {each:.0} bytes for each pixel: sums, their errors and what is seen there. About \
         {fitting} pixels would fit: pass a smaller --size, or --memory GIB if there is more memory than it seems"
    )
)]
pub struct PictureUnfit {
    /// Width and height requested.
    pub size: Size,
    /// Bytes a pixel.
    pub each: f64,
    /// Bytes needed, about.
    pub bytes: f64,
    /// Bytes that can be used.
    pub limit: f64,
    /// Pixels that would fit.
    pub fitting: u64,
}

/// Bytes a pixel, measured as what a run grows by with its pictures (`within`: made to a tolerance).
pub mod pixel {
    /// `render`.
    pub const RENDER: f64 = 260.0;
    /// `render` and `bounces` to a tolerance.
    pub const WITHIN: f64 = 1800.0;
    /// `trace`.
    pub const TRACE: f64 = 310.0;
    /// `bounces`, and for each term.
    pub const BOUNCES: (f64, f64) = (2000.0, 100.0);
    /// `compare`: five methods' orders, repeated.
    pub const COMPARE: f64 = 9000.0;
    /// `chart`.
    pub const CHART: f64 = 2500.0;
}

/// Checks that pictures of a size fit in `limit` bytes where a command keeps `each` bytes a pixel.
///
/// # Errors
/// [`PictureUnfit`], with the number of pixels that would.
pub fn check_pictures(size: Size, each: f64, limit: f64) -> Result<(), PictureUnfit> {
    let bytes = size.width as f64 * size.height as f64 * each;
    if bytes <= limit { Ok(()) } else { Err(PictureUnfit { size, each, bytes, limit, fitting: (limit / each) as u64 }) }
}

impl Unfit {
    /// The same where rows of so many entries are those of something else than patches requested.
    pub(crate) fn of(self, stored: fn(f64) -> Stored) -> Unfit {
        match self.stored {
            Stored::Rows(entries) => Unfit { stored: stored(entries), ..self },
            _ => self,
        }
    }
}

impl Stored {
    fn name(self) -> &'static str {
        match self {
            Stored::Rows(_) | Stored::Verdicts(_) | Stored::Ladders(_) => "K",
            Stored::Crossings(_) => "the crossings of the rays",
            Stored::Dense => "the dense matrix I - K",
        }
    }

    fn need(self) -> &'static str {
        match self {
            Stored::Crossings(_) => "need",
            _ => "needs",
        }
    }

    /// Why it takes as much.
    fn why(self) -> String {
        let rows = |entries: f64| {
            format!(
                "K stores one row of F for each patch, here of {entries:.0} entries for each choice of tau, so memory grows \
                 with the patches times the patches that each of them sees"
            )
        };
        match self {
            Stored::Rows(entries) | Stored::Verdicts(entries) | Stored::Ladders(entries) => rows(entries),
            Stored::Crossings(each) => format!(
                "F^tau for every tau comes from one cast of rays, all of whose crossings are kept, here {each:.0} for \
                 each patch, so memory grows with the patches times the rays of each times the surfaces one behind another"
            ),
            Stored::Dense => {
                "True tails come from (I - K) L = E solved by LU, and memory grows with the patches squared".into()
            }
        }
    }
}

impl Unfit {
    /// What to try.
    fn remedy(&self) -> String {
        // A requested count is met within about a third.
        let fewer = (self.fitting * 2 / 3).max(1);
        let asked = format!("pass --patches {fewer} (a count asked for is met within about a third)");
        let more = "--memory GIB if there is more memory than it seems";
        match self.stored {
            Stored::Rows(_) => format!("{asked}, fewer --rays, one --mode at a time, or {more}"),
            Stored::Verdicts(_) => {
                format!("pass a --time below 2, whose verdicts rest on a quarter of the patches, or {more}")
            }
            Stored::Ladders(_) => {
                format!("pass one --mode at a time, a scene of fewer faces, or {more}")
            }
            Stored::Crossings(_) => format!("{asked}, fewer --rays, or {more}"),
            Stored::Dense => format!("{asked}, or {more}"),
        }
    }
}

fn amount(bytes: f64) -> String {
    let mib = bytes / f64::from(1 << 20);
    if mib < 1000.0 { format!("{mib:.1} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}
