//! How fast processes are relative to each other, and who does what of a loop because of that.
//!
//! A loop is cut into [`STRIPES`] that are expected to cost alike, and each stripe into a range for every process, in
//! proportion to how fast it was in the loops before: the slow ones get less, and a place that costs more than expected
//! is no one's alone. What is to be kept is one range for each, as products want it. Speeds are a running mean over
//! loops, weighted by the time that they took.
//!
//! Not handled: loops that become cheaper or dearer while they run.

use std::sync::{Mutex, PoisonError};

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
pub(crate) const LONGEST: f64 = 1.25;

/// The share of each process of all that they do in a time; empty until they are known.
static SPEEDS: Mutex<Vec<f64>> = Mutex::new(Vec::new());

/// How often a loop over so many things is cut, for so many processes.
pub(crate) fn stripes(count: usize, size: usize) -> usize {
    (count / (FEWEST * size)).clamp(1, STRIPES)
}

/// The speeds of so many processes, each its share of all that they do in a time.
pub(crate) fn speeds(size: usize) -> Vec<f64> {
    let known = SPEEDS.lock().unwrap_or_else(PoisonError::into_inner).clone();
    if known.len() == size { known } else { vec![1.0 / size as f64; size] }
}

/// Takes in the seconds that each process took in a loop, and what they were expected to cost.
pub(crate) fn note_times(times: &[(f64, f64)]) {
    learn(&mut SPEEDS.lock().unwrap_or_else(PoisonError::into_inner), times);
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
pub(crate) fn evened(speeds: Vec<f64>) -> Vec<f64> {
    let mean = 1.0 / speeds.len() as f64;
    let most = speeds.iter().copied().fold(mean, f64::max);
    let kept = (((LONGEST - 1.0) * mean) / (most - mean)).min(1.0);
    speeds.iter().map(|speed| mean + kept * (speed - mean)).collect()
}

/// Where the ranges of all ranks begin, stripe by stripe, among things with costs added up to `until`, and the end.
pub(crate) fn starts(until: &[f64], speeds: &[f64], stripes: usize) -> Vec<usize> {
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
}
