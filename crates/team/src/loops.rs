//! A loop, and who does what of it.

use std::ops::Range;
use std::time::Instant;

use rayon::prelude::*;

use crate::exchange::{Gathered, Team};
use crate::members::{self, team};
use crate::speeds::{LONGEST, evened, note_times, speeds, starts, stripes};
use crate::travel::{Travels, message, read, write};

/// A loop over things by all threads of all processes: which of the things are each process's. What one process keeps
/// of it stays where the loop says.
#[derive(Clone, Debug, PartialEq)]
pub struct Loop {
    /// Where the ranges of the processes begin, one of each after the other, and the end of the last; one range where
    /// every process does all.
    starts: Vec<usize>,
    /// The first range of this process.
    own: Range<usize>,
    /// What the things of this process are expected to cost.
    cost: f64,
}

impl Loop {
    /// A loop over `count` things that are expected to cost alike.
    pub fn each(count: usize) -> Loop {
        Loop::weighed(count, |_| 1.0)
    }

    /// A loop over `count` things of which each is expected to `cost` something.
    pub fn weighed(count: usize, cost: impl Fn(usize) -> f64) -> Loop {
        Loop::shared(count, cost, stripes(count, members::size()), |speeds| speeds)
    }

    /// A loop of which each process has one range; no range is much longer than others, as what is kept takes memory.
    pub fn in_ranges(count: usize, cost: impl Fn(usize) -> f64) -> Loop {
        Loop::shared(count, cost, 1, evened)
    }

    /// A loop that every process does by itself.
    pub fn everyone(count: usize) -> Loop {
        Loop { starts: vec![0, count], own: 0..count, cost: 0.0 }
    }

    fn shared(count: usize, cost: impl Fn(usize) -> f64, stripes: usize, adapted: fn(Vec<f64>) -> Vec<f64>) -> Loop {
        let Some(team) = team() else { return Loop::everyone(count) };
        let mut sum = 0.0;
        let mut until = vec![0.0];
        until.extend((0..count).map(|k| {
            sum += cost(k);
            sum
        }));
        let starts = starts(&until[1..], &adapted(speeds(team.size())), stripes);
        let rank = team.rank();
        let mut shared = Loop { own: starts[rank]..starts[rank + 1], starts, cost: 0.0 };
        shared.cost = shared.ranges_of(team).map(|own| until[own.end] - until[own.start]).sum();
        shared
    }

    /// The processes that share it; none where every process does all.
    fn team(&self) -> Option<&'static dyn Team> {
        team().filter(|_| !self.is_everyone())
    }

    /// Number of things.
    pub fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }

    /// Whether there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether every process does all of it, as where one is alone.
    pub fn is_everyone(&self) -> bool {
        self.starts.len() == 2
    }

    /// The things of this process, of a loop [in ranges](Loop::in_ranges).
    #[inline]
    pub fn own(&self) -> Range<usize> {
        self.own.clone()
    }

    /// The ranges of all processes, one after the other.
    pub fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        self.starts.windows(2).map(|pair| pair[0]..pair[1])
    }

    /// The ranges of this process.
    fn ranges_of(&self, team: &dyn Team) -> impl Iterator<Item = Range<usize>> {
        self.ranges().skip(team.rank()).step_by(team.size())
    }

    /// The rank of each thing.
    fn ranks(&self, team: &dyn Team) -> impl Iterator<Item = usize> {
        let size = team.size();
        self.ranges().enumerate().flat_map(move |(k, range)| range.map(move |_| k % size))
    }

    /// The largest share of all things that one process has of a loop [in ranges](Loop::in_ranges).
    pub fn largest_share() -> f64 {
        if members::is_alone() { 1.0 } else { LONGEST / members::size() as f64 }
    }

    /// What `work` finds for each thing, in order.
    pub fn map<T: Travels>(&self, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        self.map_init(|| (), |(), k| work(k))
    }

    /// What `work` finds for each thing, in order; `memory` is what a thread uses again.
    pub fn map_init<M, T: Travels>(
        &self,
        memory: impl Fn() -> M + Sync + Send,
        work: impl Fn(&mut M, usize) -> T + Sync + Send,
    ) -> Vec<T> {
        let began = Instant::now();
        let own = self.found(memory, work);
        let Some(team) = self.team() else { return own };
        let mut message = self.opening(began);
        own.iter().for_each(|found| write(found, &mut message));
        drop(own);
        let all = team.gather(&message);
        let mut messages = noted(&all);
        self.ranks(team).map(|rank| read(&mut messages[rank])).collect()
    }

    /// Has `work` change the item of each thing, and returns what it finds there, in order.
    ///
    /// # Panics
    /// If there is not one item for each thing.
    pub fn change<M, T: Travels, U: Travels>(
        &self,
        items: &mut [T],
        memory: impl Fn() -> M + Sync + Send,
        work: impl Fn(&mut M, usize, &mut T) -> U + Sync + Send,
    ) -> Vec<U> {
        assert_eq!(items.len(), self.len());
        let Some(team) = self.team() else {
            let all = items.par_iter_mut().enumerate();
            return all.map_init(memory, |memory, (k, item)| work(memory, k, item)).collect();
        };
        let began = Instant::now();
        let all = items.iter_mut().enumerate().zip(self.ranks(team));
        let own: Vec<(usize, &mut T)> = all.filter(|(_, rank)| *rank == team.rank()).map(|(item, _)| item).collect();
        let changed = own.into_par_iter().map_init(memory, |memory, (k, item)| (work(memory, k, item), item));
        let changed: Vec<(U, &mut T)> = changed.collect();
        let mut message = self.opening(began);
        for (found, item) in changed {
            write(&found, &mut message);
            write(item, &mut message);
        }
        let all = team.gather(&message);
        let mut messages = noted(&all);
        let take = |(rank, item): (usize, &mut T)| {
            let found = read(&mut messages[rank]);
            *item = read(&mut messages[rank]);
            found
        };
        self.ranks(team).zip(items).map(take).collect()
    }

    /// What `work` finds for each thing of this process, which keeps it; `memory` is what a thread uses again.
    pub fn keep<M, T: Send>(
        &self,
        memory: impl Fn() -> M + Sync + Send,
        work: impl Fn(&mut M, usize) -> T + Sync + Send,
    ) -> Vec<T> {
        let began = Instant::now();
        let own = self.found(memory, work);
        if let Some(team) = self.team() {
            noted(&team.gather(&self.opening(began)));
        }
        own
    }

    /// What `work` finds for each thing of this process.
    fn found<M, T: Send>(
        &self,
        memory: impl Fn() -> M + Sync + Send,
        work: impl Fn(&mut M, usize) -> T + Sync + Send,
    ) -> Vec<T> {
        match self.team() {
            None => (0..self.len()).into_par_iter().map_init(memory, work).collect(),
            Some(team) => {
                let own: Vec<usize> = self.ranges_of(team).flatten().collect();
                own.into_par_iter().map_init(memory, work).collect()
            }
        }
    }

    /// The seconds since this process began with the loop, and what its things were expected to cost.
    fn opening(&self, began: Instant) -> Vec<u8> {
        message(&(began.elapsed().as_secs_f64(), self.cost))
    }

    /// Something of each thing, in order, where this process has that of its own.
    pub fn join<T: Travels>(&self, own: Vec<T>) -> Vec<T> {
        let Some(team) = self.team() else { return own };
        let mut message = Vec::new();
        own.iter().for_each(|own| write(own, &mut message));
        drop(own);
        let all = team.gather(&message);
        let mut messages: Vec<&[u8]> = all.of_ranks().collect();
        self.ranks(team).map(|rank| read(&mut messages[rank])).collect()
    }

    /// Something of each thing of a loop [in ranges](Loop::in_ranges) that is made of so many numbers.
    pub fn join_numbers<const N: usize, T>(
        &self,
        own: Vec<T>,
        numbers: fn(&T) -> [f32; N],
        of: fn([f32; N]) -> T,
    ) -> Vec<T> {
        let Some(team) = self.team() else { return own };
        let counts: Vec<usize> = self.ranges().map(|range| N * range.len()).collect();
        let own: Vec<f32> = own.iter().flat_map(numbers).collect();
        team.join(&own, &counts).as_chunks().0.iter().map(|&numbers| of(numbers)).collect()
    }

    /// What every process has that shares the loop, by rank.
    pub fn all<T: Travels>(&self, own: T) -> Vec<T> {
        if self.is_everyone() { vec![own] } else { members::all(own) }
    }

    /// The sum of what every process has that shares the loop.
    pub fn sum(&self, own: u64) -> u64 {
        self.all(own).into_iter().sum()
    }

    /// Hands part k to the process that has range k of a loop [in ranges](Loop::in_ranges); returns what each has for
    /// this one, by rank.
    pub fn hand_out<T: Travels>(&self, parts: Vec<T>) -> Vec<T> {
        let Some(team) = self.team() else { return parts };
        let own: Vec<Vec<u8>> = parts.into_iter().map(|part| message(&part)).collect();
        team.hand_out(&own).iter().map(|message| read(&mut &message[..])).collect()
    }
}

/// The messages of all processes after their openings, by rank; notes the times that those say.
fn noted(all: &Gathered) -> Vec<&[u8]> {
    let mut messages: Vec<&[u8]> = all.of_ranks().collect();
    note_times(&messages.iter_mut().map(read).collect::<Vec<(f64, f64)>>());
    messages
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alone_a_loop_is_done_in_order() {
        assert_eq!(Loop::each(3).map(|k| 2 * k), [0, 2, 4]);
        let mut items = [10, 20, 30];
        let add = |(): &mut (), k: usize, item: &mut usize| {
            *item += k;
            *item
        };
        assert_eq!(Loop::each(3).change(&mut items, || (), add), [10, 21, 32]);
        assert_eq!(items, [10, 21, 32]);
    }

    #[test]
    fn alone_a_process_keeps_all() {
        let all = Loop::in_ranges(2, |_| 1.0);
        assert_eq!((all.len(), all.own(), Loop::largest_share()), (2, 0..2, 1.0));
        assert!(all.is_everyone() && all.ranges().count() == 1 && all == Loop::everyone(2));
        assert_eq!(all.keep(|| (), |(), k| k), [0, 1]);
        assert_eq!((all.join(vec!['a', 'b']), all.hand_out(vec!['c']), all.sum(4)), (vec!['a', 'b'], vec!['c'], 4));
    }
}
