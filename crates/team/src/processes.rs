//! A team of processes that MPI started.
//!
//! Who comes first to an exchange waits for the others asleep, looking once in a while: MPI libraries wait by asking
//! without a pause, which takes a core away from a process that has work to do.
//!
//! Not handled: threads that exchange at the same time; one of a process does at a time.

use std::thread::sleep;
use std::time::Duration;

use mpi::Threading;
use mpi::collective::CommunicatorCollectives;
use mpi::datatype::{Equivalence, Partition, PartitionMut};
use mpi::environment::{Universe, initialize_with_threading};
use mpi::topology::{Communicator, SimpleCommunicator};

use crate::exchange::{Gathered, Team};

/// Bytes of all processes that are passed at once: MPI counts with 31 bits.
const PIECE: usize = 1 << 30;
/// Pauses of one who waits, at first and at most.
const PAUSE: (Duration, Duration) = (Duration::from_micros(20), Duration::from_millis(1));

/// All processes that one `mpirun` started.
struct Processes {
    size: usize,
    rank: usize,
}

/// Connects this process with those that MPI started beside it; the connection ends where the returned value is
/// dropped. `None` where the library cannot have one thread after the other use it.
pub fn connect() -> Option<(Universe, Box<dyn Team>)> {
    let (universe, threading) = initialize_with_threading(Threading::Serialized)?;
    if threading < Threading::Serialized {
        return None;
    }
    let world = universe.world();
    let team = Processes { size: world.size() as usize, rank: world.rank() as usize };
    Some((universe, Box::new(team)))
}

impl Team for Processes {
    fn size(&self) -> usize {
        self.size
    }

    fn rank(&self) -> usize {
        self.rank
    }

    fn gather(&self, own: &[u8]) -> Gathered {
        let world = SimpleCommunicator::world();
        wait_for_all(&world);
        let mut sizes = vec![0u64; self.size];
        world.all_gather_into(&(own.len() as u64), &mut sizes[..]);
        let sizes: Vec<usize> = sizes.into_iter().map(|size| size as usize).collect();
        Gathered { bytes: join(&world, own, &sizes), sizes }
    }

    fn join(&self, own: &[f32], counts: &[usize]) -> Vec<f32> {
        let world = SimpleCommunicator::world();
        wait_for_all(&world);
        join(&world, own, counts)
    }

    fn hand_out(&self, own: &[Vec<u8>]) -> Vec<Vec<u8>> {
        let world = SimpleCommunicator::world();
        wait_for_all(&world);
        let to: Vec<u64> = own.iter().map(|part| part.len() as u64).collect();
        let mut from = vec![0u64; self.size];
        world.all_to_all_into(&to[..], &mut from[..]);
        let mut longest = vec![0u64; self.size];
        world.all_gather_into(&to.iter().chain(&from).copied().max().unwrap_or(0), &mut longest[..]);
        let longest = longest.into_iter().max().unwrap_or(0) as usize;
        let mut found: Vec<Vec<u8>> = from.iter().map(|&size| Vec::with_capacity(size as usize)).collect();
        let most = PIECE / self.size;
        for start in (0..longest).step_by(most) {
            let part = |size: usize| start.min(size)..(start + most).min(size);
            let piece: Vec<u8> = own.iter().flat_map(|own| &own[part(own.len())]).copied().collect();
            let (counts, starts) = layout(to.iter().map(|&size| part(size as usize).len()));
            let (counts_in, starts_in) = layout(from.iter().map(|&size| part(size as usize).len()));
            let mut all = vec![0u8; counts_in.iter().sum::<i32>() as usize];
            let parts = Partition::new(&piece[..], &counts[..], &starts[..]);
            let mut parts_in = PartitionMut::new(&mut all[..], &counts_in[..], &starts_in[..]);
            world.all_to_all_varcount_into(&parts, &mut parts_in);
            for ((found, &start), &count) in found.iter_mut().zip(&starts_in).zip(&counts_in) {
                found.extend_from_slice(&all[start as usize..(start + count) as usize]);
            }
        }
        found
    }

    fn abort(&self, code: i32) -> ! {
        SimpleCommunicator::world().abort(code)
    }
}

/// How many items each has of a piece, and where they begin.
fn layout(lengths: impl Iterator<Item = usize>) -> (Vec<i32>, Vec<i32>) {
    let counts: Vec<i32> = lengths.map(|n| n as i32).collect();
    let starts = counts.iter().scan(0, |sum, count| Some(std::mem::replace(sum, *sum + count))).collect();
    (counts, starts)
}

/// What all hand in, one after the other.
fn join<T: Equivalence + Copy + Default>(world: &SimpleCommunicator, own: &[T], sizes: &[usize]) -> Vec<T> {
    let mut joined = vec![T::default(); sizes.iter().sum()];
    let most = PIECE / size_of::<T>() / sizes.len();
    let longest = sizes.iter().copied().max().unwrap_or(0);
    for start in (0..longest).step_by(most) {
        let part = |size: usize| start.min(size)..(start + most).min(size);
        let (counts, starts) = layout(sizes.iter().map(|&size| part(size).len()));
        if longest <= most {
            world.all_gather_varcount_into(own, &mut PartitionMut::new(&mut joined[..], &counts[..], &starts[..]));
            break;
        }
        let mut all = vec![T::default(); counts.iter().sum::<i32>() as usize];
        let mut parts = PartitionMut::new(&mut all[..], &counts[..], &starts[..]);
        world.all_gather_varcount_into(&own[part(own.len())], &mut parts);
        let mut first = 0;
        for ((&size, &from), &count) in sizes.iter().zip(&starts).zip(&counts) {
            let place = first + part(size).start;
            joined[place..place + count as usize].copy_from_slice(&all[from as usize..(from + count) as usize]);
            first += size;
        }
    }
    joined
}

/// Returns when all processes are here.
fn wait_for_all(world: &SimpleCommunicator) {
    let mut barrier = world.immediate_barrier();
    let mut pause = PAUSE.0;
    while let Err(request) = barrier.test() {
        barrier = request;
        sleep(pause);
        pause = (pause * 2).min(PAUSE.1);
    }
}
