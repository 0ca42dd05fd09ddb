//! Who keeps which of some things that several processes share, one after the other.

use std::ops::Range;

use crate::light::team::members;

/// The range of each process; all is everyone's where there is one range.
#[derive(Clone, Debug, PartialEq)]
pub struct Owners {
    /// Where the range of each begins, and the end of the last.
    starts: Vec<usize>,
    own: Range<usize>,
}

impl Owners {
    /// So many things, which every process has.
    pub fn everyone(count: usize) -> Owners {
        Owners { starts: vec![0, count], own: 0..count }
    }

    /// Ranges that begin where `starts` says, of processes of which this one is number `rank`.
    pub(super) fn new(starts: Vec<usize>, rank: usize) -> Owners {
        Owners { own: starts[rank]..starts[rank + 1], starts }
    }

    /// Number of things.
    pub fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }

    /// Whether every process has all of them.
    pub fn is_everyone(&self) -> bool {
        self.starts.len() == 2
    }

    /// The things of this process.
    pub fn own(&self) -> Range<usize> {
        self.own.clone()
    }

    /// The things of each process, by rank.
    pub fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        self.starts.windows(2).map(|pair| pair[0]..pair[1])
    }

    /// What all things come to, where those of this process come to `own`.
    pub fn sum(&self, own: u64) -> u64 {
        if self.is_everyone() { own } else { members::sum(own) }
    }

    /// The largest of all things, where that of this process is `own`.
    pub fn largest(&self, own: u32) -> u32 {
        if self.is_everyone() { own } else { members::all(own).into_iter().max().unwrap_or(own) }
    }

    /// Something of each thing, where this process has that of its own.
    pub fn join<T: Copy>(&self, own: Vec<T>, numbers: fn(&T) -> [f32; 4], of: fn([f32; 4]) -> T) -> Vec<T> {
        if self.is_everyone() {
            return own;
        }
        let all = self.join_numbers(own.iter().flat_map(numbers).collect(), 4);
        all.as_chunks().0.iter().map(|&numbers| of(numbers)).collect()
    }

    /// `width` numbers of each thing, where this process has those of its own.
    pub fn join_numbers(&self, own: Vec<f32>, width: usize) -> Vec<f32> {
        let Some(team) = members::team().filter(|_| !self.is_everyone()) else { return own };
        let counts: Vec<usize> = self.ranges().map(|range| width * range.len()).collect();
        team.join(&own, &counts)
    }
}
