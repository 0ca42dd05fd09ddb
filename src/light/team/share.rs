//! Who does what of a loop.
//!
//! A loop is cut into [`STRIPES`] that are expected to cost alike, and each stripe into a range for every process, in
//! proportion to how fast it was in the loops before: the slow ones get less, and a place that costs more than expected
//! is no one's alone. What is to be kept is one range for each, as products want it.
//!
//! How fast processes are relative to each other is a running mean over loops, weighted by the time that they took.
//!
//! Not handled: loops that become cheaper or dearer while they run.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::light::team::exchange::Team;
use crate::light::team::members::{decode, encode, is_alone, rank, size, team};
use crate::light::team::owners::Owners;

/// Parts of a loop in each of which every process has a range: so many that a place which costs ten times as much as
/// others does not show.
const STRIPES: usize = 1024;
/// Things of a range in the mean, at least: of fewer, some ranks would get more than others by rounding.
const FEWEST: usize = 4;
/// A loop of so many seconds says more of how fast processes are than all before; shorter ones count in proportion.
const TELLING: f64 = 1.0;
/// The fastest and the slowest of two processes differ by no more than this factor.
const APART: f64 = 8.0;
/// The longest range of what is kept over the mean.
const LONGEST: f64 = 1.25;

/// The share of each process of all that they do in a time; empty until they are known.
static SPEEDS: Mutex<Vec<f64>> = Mutex::new(Vec::new());

/// This process's part of a loop.
#[must_use]
pub struct Share {
    count: usize,
    /// Where the ranges begin, stripe by stripe that of each rank, and the end; empty where one process is alone.
    starts: Vec<usize>,
    /// What the own part is expected to cost.
    cost: f64,
    began: Instant,
}

/// This process's part of a loop over `count` things of which each is expected to `cost` something.
pub fn share(count: usize, cost: impl Fn(usize) -> f64) -> Share {
    Share::new(count, cost, stripes(count, size()), |speeds| speeds)
}

/// How often a loop over so many things is cut, for so many processes.
fn stripes(count: usize, size: usize) -> usize {
    (count / (FEWEST * size)).clamp(1, STRIPES)
}

/// What `work` finds for each thing of one range of a loop, kept by this process, and who keeps the others; `memory` is
/// what a thread uses again. No range is much longer than others, as what is kept takes memory.
pub fn keep<M, T: Send>(
    count: usize,
    cost: impl Fn(usize) -> f64,
    memory: impl Fn() -> M + Sync + Send,
    work: impl Fn(&mut M, usize) -> T + Sync + Send,
) -> (Owners, Vec<T>) {
    let (starts, own) = Share::new(count, cost, 1, evened).kept(memory, work);
    (Owners::new(starts, rank()), own)
}

/// The same for each thing of this process's part of a loop, stripe by stripe; and where the ranges of all processes
/// begin, range k being that of rank k modulo their number.
pub fn keep_in_stripes<M, T: Send>(
    count: usize,
    cost: impl Fn(usize) -> f64,
    memory: impl Fn() -> M + Sync + Send,
    work: impl Fn(&mut M, usize) -> T + Sync + Send,
) -> (Vec<usize>, Vec<T>) {
    share(count, cost).kept(memory, work)
}

/// The largest share that one process keeps of what all keep.
pub fn kept_share() -> f64 {
    if is_alone() { 1.0 } else { LONGEST / size() as f64 }
}

impl Share {
    fn new(count: usize, cost: impl Fn(usize) -> f64, stripes: usize, adapted: impl Fn(Vec<f64>) -> Vec<f64>) -> Share {
        let mut share = Share { count, starts: Vec::new(), cost: 0.0, began: Instant::now() };
        let Some(team) = team() else { return share };
        let known = SPEEDS.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let speeds = if known.len() == team.size() { known } else { vec![1.0 / team.size() as f64; team.size()] };
        let until: Vec<f64> = (0..count).scan(0.0, |sum, k| Some(add(sum, cost(k)))).collect();
        share.starts = starts(&until, &adapted(speeds), stripes);
        let before = |k: usize| if k == 0 { 0.0 } else { until[k - 1] };
        share.cost = share.ranges(team.rank(), team.size()).map(|own| before(own.end) - before(own.start)).sum();
        share
    }

    /// The ranges of a rank.
    fn ranges(&self, rank: usize, size: usize) -> impl Iterator<Item = Range<usize>> {
        let stripes = 0..self.starts.len().saturating_sub(1) / size;
        stripes.map(move |stripe| self.starts[stripe * size + rank]..self.starts[stripe * size + rank + 1])
    }

    /// The things of this process.
    fn own(&self) -> Vec<usize> {
        match team() {
            None => (0..self.count).collect(),
            Some(team) => self.ranges(team.rank(), team.size()).flatten().collect(),
        }
    }

    /// What `work` finds for each own thing, and where the ranges of all begin.
    fn kept<M, T: Send>(
        self,
        memory: impl Fn() -> M + Sync + Send,
        work: impl Fn(&mut M, usize) -> T + Sync + Send,
    ) -> (Vec<usize>, Vec<T>) {
        let own = self.own().into_par_iter().map_init(memory, work).collect();
        let Some(team) = team() else { return (vec![0, self.count], own) };
        let starts = self.starts.clone();
        let _ = self.exchange::<Vec<()>, _>(team, &Vec::<()>::new());
        (starts, own)
    }

    /// What `work` finds for each thing of the loop, in its order, by all threads of all processes; `memory` is what a
    /// thread uses again.
    pub fn map<M, T: Serialize + DeserializeOwned + Send>(
        self,
        memory: impl Fn() -> M + Sync + Send,
        work: impl Fn(&mut M, usize) -> T + Sync + Send,
    ) -> Vec<T> {
        let Some(team) = team() else { return (0..self.count).into_par_iter().map_init(memory, work).collect() };
        let own: Vec<T> = self.own().into_par_iter().map_init(memory, work).collect();
        self.in_order(team, own)
    }

    /// Has `work` change item `at(k)` for each thing k of the loop, no item twice, and returns what it finds there.
    pub fn change<M, T: Serialize + DeserializeOwned + Send, U: Serialize + DeserializeOwned + Send>(
        self,
        items: &mut [T],
        at: impl Fn(usize) -> usize,
        memory: impl Fn() -> M + Sync + Send,
        work: impl Fn(&mut M, usize, &mut T) -> U + Sync + Send,
    ) -> Vec<U> {
        let own = self.own();
        let mut places: Vec<(usize, usize)> = own.iter().enumerate().map(|(n, &k)| (at(k), n)).collect();
        places.sort_unstable();
        let mut rest = items.iter_mut().enumerate();
        // Those of the loop, in the order of the items.
        let chosen = places.iter().filter_map(|&(i, n)| rest.find(|(j, _)| *j == i).map(|(_, item)| (n, item)));
        let mut chosen: Vec<(usize, &mut T)> = chosen.collect();
        chosen.sort_unstable_by_key(|(n, _)| *n);
        let changed = chosen.into_par_iter().map_init(memory, |memory, (n, item)| (work(memory, own[n], item), item));
        let Some(team) = team() else { return changed.map(|(found, _)| found).collect() };
        let changed: Vec<(U, &mut T)> = changed.collect();
        let (order, count) = (self.order(team), self.count);
        let mut of_others = self.exchange::<Vec<(U, T)>, _>(team, &changed);
        let mut found: Vec<U> = Vec::with_capacity(count);
        let mut own = changed.into_iter().map(|(found, _)| found).collect::<Vec<U>>().into_iter();
        for (k, rank) in order.enumerate() {
            match &mut of_others[rank] {
                None => found.extend(own.next()),
                Some(others) => found.extend(others.next().map(|(found, item)| {
                    items[at(k)] = item;
                    found
                })),
            }
        }
        found
    }

    /// What all processes found, in the order of the loop.
    fn in_order<T: Serialize + DeserializeOwned>(self, team: &dyn Team, own: Vec<T>) -> Vec<T> {
        let (order, count) = (self.order(team), self.count);
        let mut of_others = self.exchange::<Vec<T>, _>(team, &own);
        let (mut own, mut all) = (own.into_iter(), Vec::with_capacity(count));
        for rank in order {
            all.extend(of_others[rank].as_mut().map_or_else(|| own.next(), Iterator::next));
        }
        all
    }

    /// The rank of each thing of the loop.
    fn order(&self, team: &dyn Team) -> impl Iterator<Item = usize> + use<> {
        let (starts, size) = (self.starts.clone(), team.size());
        (1..starts.len()).flat_map(move |end| std::iter::repeat_n((end - 1) % size, starts[end] - starts[end - 1]))
    }

    /// Hands each process what each has, and learns how fast they were; nothing for what is the own.
    fn exchange<T: DeserializeOwned + IntoIterator, U: Serialize>(
        self,
        team: &dyn Team,
        own: &U,
    ) -> Vec<Option<T::IntoIter>> {
        let took = self.began.elapsed().as_secs_f64();
        let all = team.gather(&encode(&((took, self.cost), own)));
        let of_rank = |(rank, bytes): (usize, &[u8])| {
            if rank == team.rank() {
                return ((took, self.cost), None);
            }
            let (times, found) = decode::<((f64, f64), T)>(bytes);
            (times, Some(found.into_iter()))
        };
        let (times, found): (Vec<(f64, f64)>, Vec<_>) = all.of_ranks().enumerate().map(of_rank).unzip();
        learn(&mut SPEEDS.lock().unwrap_or_else(PoisonError::into_inner), &times);
        found
    }
}

fn add(sum: &mut f64, more: f64) -> f64 {
    *sum += more;
    *sum
}

/// Adds to what is known of speeds the seconds of each process, and what they were expected to cost.
fn learn(speeds: &mut Vec<f64>, times: &[(f64, f64)]) {
    if times.iter().any(|(took, cost)| *took <= 0.0 || *cost <= 0.0) {
        return;
    }
    let size = times.len() as f64;
    let fastest = times.iter().map(|(took, cost)| cost / took).fold(0.0, f64::max);
    let now: Vec<f64> = times.iter().map(|(took, cost)| (cost / took / fastest).max(1.0 / APART)).collect();
    let sum: f64 = now.iter().sum();
    let weight = (times.iter().map(|(took, _)| took).sum::<f64>() / size / TELLING).min(1.0);
    if speeds.len() != times.len() {
        *speeds = vec![1.0 / size; times.len()];
    }
    for (speed, now) in speeds.iter_mut().zip(now) {
        *speed += weight * (now / sum - *speed);
    }
}

/// What each process does where none is to keep more than [`LONGEST`] times the mean.
fn evened(speeds: Vec<f64>) -> Vec<f64> {
    let mean = 1.0 / speeds.len() as f64;
    let most = speeds.iter().copied().fold(mean, f64::max);
    let kept = (((LONGEST - 1.0) * mean) / (most - mean)).min(1.0);
    speeds.iter().map(|speed| mean + kept * (speed - mean)).collect()
}

/// Where the ranges of all ranks begin, stripe by stripe, among things with costs added up to `until`, and the end.
fn starts(until: &[f64], speeds: &[f64], stripes: usize) -> Vec<usize> {
    let all = until.last().copied().unwrap_or(0.0);
    let ends = (0..stripes).flat_map(|stripe| {
        let ranks = 1..=speeds.len();
        ranks.map(move |rank| (stripe as f64 + speeds[..rank].iter().sum::<f64>()) / stripes as f64)
    });
    let end = |share: f64| until.partition_point(|&until| until <= all * share);
    let mut starts: Vec<usize> = std::iter::once(0).chain(ends.map(end)).collect();
    // Things without a cost at the end are someone's, too.
    if let Some(last) = starts.last_mut() {
        *last = until.len();
    }
    starts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_cover_a_loop_and_cost_what_speeds_say() {
        let until: Vec<f64> = (1..=10_000).map(f64::from).collect();
        for speeds in [vec![1.0 / 3.0; 3], vec![0.5, 0.25, 0.25]] {
            for stripes in [1, STRIPES] {
                let starts = starts(&until, &speeds, stripes);
                assert!(starts.len() == 3 * stripes + 1 && starts[0] == 0 && starts[3 * stripes] == 10_000);
                assert!(starts.is_sorted());
                for (rank, speed) in speeds.iter().enumerate() {
                    let own: usize = (0..stripes).map(|s| starts[3 * s + rank + 1] - starts[3 * s + rank]).sum();
                    // Ends are whole numbers.
                    let bound = (2 * stripes) as f64 / 10_000.0;
                    assert!((own as f64 / 10_000.0 - speed).abs() <= bound, "{own} {speed}");
                }
            }
        }
    }

    /// Also where their number and that of stripes have a common measure.
    #[test]
    fn few_things_are_shared_out_evenly() {
        for count in 8..600 {
            let until: Vec<f64> = (1..=count).map(|k| k as f64).collect();
            let stripes = stripes(count, 2);
            let starts = starts(&until, &[0.5, 0.5], stripes);
            let first: usize = (0..stripes).map(|s| starts[2 * s + 1] - starts[2 * s]).sum();
            // Each range may lose or gain less than one, and they have four in the mean.
            assert!(first.abs_diff(count - first) <= 1 + stripes && first >= count / 3, "{count}: {first}");
        }
    }

    #[test]
    fn costs_of_nothing_and_loops_of_none_are_shared_out() {
        assert_eq!(starts(&[], &[0.5, 0.5], 1), [0, 0, 0]);
        assert_eq!(starts(&[0.0; 4], &[0.5, 0.5], 1), [0, 4, 4]);
    }

    #[test]
    fn speeds_are_learnt_from_long_loops() {
        let mut speeds = Vec::new();
        learn(&mut speeds, &[(0.0, 1.0), (1.0, 1.0)]);
        assert_eq!(speeds, [0.0; 0]);
        learn(&mut speeds, &[(2.0, 3.0), (2.0, 1.0)]);
        assert_eq!(speeds, [0.75, 0.25]);
        learn(&mut speeds, &[(0.1, 1.0), (0.1, 1.0)]);
        assert!((speeds[0] - 0.725).abs() < 1e-12, "{speeds:?}");
    }

    #[test]
    fn what_is_kept_is_shared_out_nearly_evenly() {
        assert_eq!(evened(vec![0.25; 4]), [0.25; 4]);
        let fast = evened(vec![0.8, 0.1, 0.1]);
        assert!((fast[0] - LONGEST / 3.0).abs() < 1e-15 && (fast.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{fast:?}");
    }

    #[test]
    fn alone_a_loop_is_done_in_order() {
        assert_eq!(share(3, |_| 1.0).map(|| (), |(), k| 2 * k), [0, 2, 4]);
        let mut items = [10, 20, 30, 40];
        let add = |(): &mut (), k: usize, item: &mut i32| {
            *item += 1;
            k
        };
        assert_eq!(share(2, |_| 1.0).change(&mut items, |k| 3 - 2 * k, || (), add), [0, 1]);
        assert_eq!(items, [10, 21, 30, 41]);
        let (owners, kept) = keep(2, |_| 1.0, || (), |(), k| k);
        assert!(owners.is_everyone() && kept == [0, 1] && kept_share() == 1.0);
    }
}
