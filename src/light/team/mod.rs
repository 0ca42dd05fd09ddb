//! The processes that share one solve, on one machine or on many.
//!
//! All of them run the same program on the same scene, and go through the same loops in the same order. A loop over
//! rays is shared out: each process takes a range of it (`share`), works on that with its threads, and either keeps
//! what it found or gathers that of all (`Share::gather`), in the order of the loop. What follows is done by every
//! process alike, so what each thing of a loop finds must not depend on the others, and the bytes of a result do not
//! depend on the number of processes.
//!
//! Ranges cost alike by what a loop expects of each of its things, times what each process took for its last range: the
//! slow ones get less. Alone, which is what a process is without [`connect`], a loop is one range and nothing
//! is copied.
//!
//! Not handled: a process that is lost, which ends all; loops within loops.

use std::ops::Range;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::light::team::exchange::Team;
pub(crate) use crate::light::team::owners::Owners;

mod exchange;
mod owners;
#[cfg(feature = "mpi")]
mod processes;

static TEAM: OnceLock<Box<dyn Team>> = OnceLock::new();

/// What each process took for its last range, over what that was expected to cost: seconds.
static PACE: Mutex<Vec<f64>> = Mutex::new(Vec::new());

/// A process's connection with the others, which ends with it.
#[must_use]
pub struct Connection {
    #[cfg(feature = "mpi")]
    _universe: Option<mpi::environment::Universe>,
}

/// What those who start processes tell each of them: OpenMPI and Slurm, MPICH and Intel, older versions of the former.
#[cfg(feature = "mpi")]
const STARTED: [&str; 3] = ["PMIX_RANK", "PMI_RANK", "OMPI_COMM_WORLD_RANK"];

/// The exit code of a fault of the program.
#[cfg(feature = "mpi")]
const FAULT: u8 = 101;

/// Has a fault of one process end all of them: the others would wait for it.
#[cfg(feature = "mpi")]
fn end_all_on_panic() {
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |fault| {
        before(fault);
        abort_others(FAULT);
    }));
}

/// Connects this process with those that `mpirun` started beside it, for as long as the returned value lives; alone, or
/// without the feature `mpi`, nothing happens.
pub fn connect() -> Connection {
    #[cfg(feature = "mpi")]
    {
        let is_started = STARTED.iter().any(|name| std::env::var_os(name).is_some());
        let (universe, team) = is_started.then(processes::connect).flatten().unzip();
        let _ = team.map(|team| TEAM.set(team));
        if universe.is_some() {
            end_all_on_panic();
        }
        Connection { _universe: universe }
    }
    #[cfg(not(feature = "mpi"))]
    Connection {}
}

/// The processes that share the work; none where this one is alone.
fn team() -> Option<&'static dyn Team> {
    TEAM.get().map(|team| &**team).filter(|team| team.size() > 1)
}

/// Whether there are no other processes.
pub fn is_alone() -> bool {
    team().is_none()
}

/// Which of the processes this one is, from 0 on.
pub fn rank() -> usize {
    team().map_or(0, |team| team.rank())
}

/// Whether this process writes files and tells what there is to tell: one of all does.
pub fn speaks() -> bool {
    rank() == 0
}

/// Ends all other processes, if there are some, with an exit code; returns where there are none.
pub fn abort_others(code: u8) {
    if let Some(team) = team() {
        team.abort(i32::from(code));
    }
}

/// A value that every process is to go on with: what the first of them has. For what they may see differently, such as
/// clocks.
pub(crate) fn agree<T: Serialize + DeserializeOwned>(own: T) -> T {
    match team() {
        None => own,
        Some(team) => decode(&team.gather(&encode(&own))[0]),
    }
}

/// What every process has, in the order of their ranks.
pub(crate) fn all<T: Serialize + DeserializeOwned>(own: T) -> Vec<T> {
    match team() {
        None => vec![own],
        Some(team) => team.gather(&encode(&own)).iter().map(|bytes| decode(bytes)).collect(),
    }
}

/// A value that the first process finds, for all of them.
pub(crate) fn by_first<T: Serialize + DeserializeOwned>(find: impl FnOnce() -> T) -> T {
    match team() {
        None => find(),
        Some(team) => {
            let own = if team.rank() == 0 { encode(&find()) } else { Vec::new() };
            decode(&team.gather(&own)[0])
        }
    }
}

/// The largest share that one process keeps of what all keep.
pub(crate) fn kept_share() -> f64 {
    team().map_or(1.0, |team| LONGEST / team.size() as f64)
}

/// Hands the value k to rank k; returns what each has for this process, by rank.
pub(crate) fn hand_out<T: Serialize + DeserializeOwned>(own: Vec<T>) -> Vec<T> {
    let Some(team) = team() else { return own };
    let bytes: Vec<Vec<u8>> = own.into_iter().map(|value| encode(&value)).collect();
    team.hand_out(&bytes).iter().map(|bytes| decode(bytes)).collect()
}

/// The sum of what every process has.
pub(crate) fn sum(own: u64) -> u64 {
    all(own).iter().sum()
}

/// The range of a loop that this process takes.
#[must_use]
pub(crate) struct Share {
    /// It, among the things of the loop.
    pub range: Range<usize>,
    owners: Owners,
    cost: f64,
    began: Instant,
}

/// This process's range of a loop over `count` things of which each is expected to `cost` something.
pub(crate) fn share(count: usize, cost: impl Fn(usize) -> f64) -> Share {
    share_by(count, cost, speeds)
}

/// The same for what each process is to keep of the loop, which takes memory: no range is much longer than others.
pub(crate) fn share_to_keep(count: usize, cost: impl Fn(usize) -> f64) -> Share {
    share_by(count, cost, |pace, size| evened(speeds(pace, size)))
}

fn share_by(count: usize, cost: impl Fn(usize) -> f64, speeds: impl Fn(&[f64], usize) -> Vec<f64>) -> Share {
    let began = Instant::now();
    let Some(team) = team() else {
        return Share { range: 0..count, owners: Owners::everyone(count), cost: 0.0, began };
    };
    let pace = PACE.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let until: Vec<f64> = (0..count).scan(0.0, |sum, k| Some(add(sum, cost(k)))).collect();
    let owners = Owners::new(starts(&until, &speeds(&pace, team.size())), team.rank());
    let range = owners.own();
    let before = |k: usize| if k == 0 { 0.0 } else { until[k - 1] };
    let cost = before(range.end) - before(range.start);
    Share { range, owners, cost, began }
}

fn add(sum: &mut f64, more: f64) -> f64 {
    *sum += more;
    *sum
}

/// Ranges shorter than this tell nothing of a process's pace.
const TOLD: Duration = Duration::from_millis(5);
/// The fastest and the slowest of two processes differ by no more than this factor.
const APART: f64 = 8.0;
/// The longest range of what is kept over the mean.
pub(crate) const LONGEST: f64 = 1.25;

/// What each process does of a loop over what all do, by the seconds that a unit of cost took it.
fn speeds(pace: &[f64], size: usize) -> Vec<f64> {
    let known = pace.len() == size && pace.iter().all(|p| p.is_finite() && *p > 0.0);
    if !known {
        return vec![1.0 / size as f64; size];
    }
    let fastest = pace.iter().copied().fold(f64::INFINITY, f64::min);
    let speeds: Vec<f64> = pace.iter().map(|p| (fastest / p).max(1.0 / APART)).collect();
    let sum: f64 = speeds.iter().sum();
    speeds.iter().map(|s| s / sum).collect()
}

/// What each process does where none is to keep more than [`LONGEST`] times the mean.
fn evened(speeds: Vec<f64>) -> Vec<f64> {
    let mean = 1.0 / speeds.len() as f64;
    let most = speeds.iter().copied().fold(mean, f64::max);
    let kept = (((LONGEST - 1.0) * mean) / (most - mean)).min(1.0);
    speeds.iter().map(|speed| mean + kept * (speed - mean)).collect()
}

/// Where the ranges of all ranks begin among things with costs added up to `until`, and the end of the last.
fn starts(until: &[f64], speeds: &[f64]) -> Vec<usize> {
    let all = until.last().copied().unwrap_or(0.0);
    let start = |rank: usize| {
        // Things without a cost at either end are someone's, too.
        match rank {
            0 => return 0,
            _ if rank == speeds.len() => return until.len(),
            _ => {}
        }
        let goal = all * speeds[..rank].iter().sum::<f64>();
        until.partition_point(|&until| until <= goal)
    };
    (0..=speeds.len()).map(start).collect()
}

impl Share {
    /// The same where each thing of the loop stands for a block of `length` items.
    pub fn of_blocks(self, length: usize) -> Share {
        Share { range: self.range.start * length..self.range.end * length, ..self }
    }

    /// What `work` finds for each thing of the loop, in its order, by all threads of all processes; `memory` is what a
    /// thread uses again.
    pub fn map<M, T: Serialize + DeserializeOwned + Send>(
        self,
        memory: impl Fn() -> M + Sync + Send,
        work: impl Fn(&mut M, usize) -> T + Sync + Send,
    ) -> Vec<T> {
        let own = self.range.clone().into_par_iter().map_init(memory, work).collect();
        self.gather(own)
    }

    /// What `work` finds for each thing of this process's range, kept by it, and who keeps the others.
    pub fn keep<M, T: Send>(
        self,
        memory: impl Fn() -> M + Sync + Send,
        work: impl Fn(&mut M, usize) -> T + Sync + Send,
    ) -> (Owners, Vec<T>) {
        let own = self.range.clone().into_par_iter().map_init(memory, work).collect();
        let owners = self.owners.clone();
        if let Some(team) = team() {
            let _: Vec<()> = self.exchange(team, &());
        }
        (owners, own)
    }

    /// What all processes found, in the order of the loop.
    fn gather<T: Serialize + DeserializeOwned>(self, own: Vec<T>) -> Vec<T> {
        match team() {
            None => own,
            Some(team) => self.exchange::<Vec<T>, _>(team, &own).into_iter().flatten().collect(),
        }
    }

    /// Puts what all processes made of some `items` in their places: thing k of the loop is item `at(k)`.
    pub fn gather_at<T: Serialize + DeserializeOwned>(self, items: &mut [T], at: impl Fn(usize) -> usize) {
        let Some(team) = team() else { return };
        let (range, rank) = (self.range.clone(), team.rank());
        let own: Vec<&T> = range.clone().map(|k| &items[at(k)]).collect();
        let of_all: Vec<(usize, Vec<T>)> = self.exchange(team, &(range.start, own));
        for (_, (start, of_rank)) in of_all.into_iter().enumerate().filter(|(r, _)| *r != rank) {
            for (k, item) in (start..).zip(of_rank) {
                items[at(k)] = item;
            }
        }
    }

    /// Hands each process what each has, with how fast it was.
    fn exchange<T: DeserializeOwned, U: Serialize>(self, team: &dyn Team, own: &U) -> Vec<T> {
        let took = self.began.elapsed();
        let pace = if took < TOLD || self.cost <= 0.0 { f64::NAN } else { took.as_secs_f64() / self.cost };
        let all = team.gather(&encode(&(pace, own)));
        let (paces, found): (Vec<f64>, Vec<T>) = all.iter().map(|bytes| decode::<(f64, T)>(bytes)).unzip();
        if paces.iter().all(|p| p.is_finite()) {
            *PACE.lock().unwrap_or_else(PoisonError::into_inner) = paces;
        }
        found
    }
}

#[cfg(feature = "mpi")]
fn encode<T: Serialize>(value: &T) -> Vec<u8> {
    postcard::to_stdvec(value).expect("numbers, and lists of them")
}

#[cfg(feature = "mpi")]
fn decode<T: DeserializeOwned>(bytes: &[u8]) -> T {
    postcard::from_bytes(bytes).expect("what another process of the same program made")
}

/// A process is alone without a library that connects it with others.
#[cfg(not(feature = "mpi"))]
fn encode<T: Serialize>(_: &T) -> Vec<u8> {
    Vec::new()
}

#[cfg(not(feature = "mpi"))]
fn decode<T: DeserializeOwned>(_: &[u8]) -> T {
    unreachable!("a team needs the feature mpi")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_a_loop_and_cost_what_speeds_say() {
        let until: Vec<f64> = (1..=1000).map(f64::from).collect();
        for pace in [vec![], vec![1.0, 1.0, 1.0], vec![1.0, 2.0, 4.0], vec![1.0, f64::NAN, 1.0]] {
            let speeds = speeds(&pace, 3);
            let starts = starts(&until, &speeds);
            assert!(starts[0] == 0 && starts[3] == 1000);
            for (pair, speed) in starts.windows(2).zip(&speeds) {
                assert!(((pair[1] - pair[0]) as f64 / 1000.0 - speed).abs() <= 2e-3, "{starts:?} {speeds:?}");
            }
        }
    }

    #[test]
    fn costs_of_nothing_and_loops_of_none_are_shared_out() {
        assert_eq!(starts(&[], &[0.5, 0.5]), [0, 0, 0]);
        assert_eq!(starts(&[0.0; 4], &[0.5, 0.5]), [0, 4, 4]);
    }

    #[test]
    fn what_is_kept_is_shared_out_nearly_evenly() {
        assert_eq!(evened(vec![0.25; 4]), [0.25; 4]);
        assert_eq!(evened(vec![0.55, 0.45]), [0.55, 0.45]);
        let fast = evened(vec![0.8, 0.1, 0.1]);
        assert!((fast[0] - LONGEST / 3.0).abs() < 1e-15 && (fast.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{fast:?}");
    }

    #[test]
    fn alone_a_loop_is_one_range() {
        let share = share(7, |_| 1.0);
        assert_eq!(share.range, 0..7);
        assert_eq!(share.gather(vec![3, 1, 2]), [3, 1, 2]);
        assert!(speaks() && agree(true) && all(5) == [5]);
    }
}
