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
use mpi::datatype::PartitionMut;
use mpi::environment::{Universe, initialize_with_threading};
use mpi::topology::{Communicator, SimpleCommunicator};

use crate::light::team::exchange::Team;

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

    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        let world = SimpleCommunicator::world();
        wait_for_all(&world);
        let mut sizes = vec![0u64; self.size];
        world.all_gather_into(&(own.len() as u64), &mut sizes[..]);
        let mut found: Vec<Vec<u8>> = sizes.iter().map(|&size| Vec::with_capacity(size as usize)).collect();
        let most = PIECE / self.size;
        let longest = sizes.iter().copied().max().unwrap_or(0) as usize;
        for start in (0..longest).step_by(most) {
            let part = |size: usize| start.min(size)..(start + most).min(size);
            let counts: Vec<i32> = sizes.iter().map(|&size| part(size as usize).len() as i32).collect();
            let starts: Vec<i32> =
                counts.iter().scan(0, |sum, count| Some(std::mem::replace(sum, *sum + count))).collect();
            let mut all = vec![0u8; counts.iter().sum::<i32>() as usize];
            let mut parts = PartitionMut::new(&mut all[..], &counts[..], &starts[..]);
            world.all_gather_varcount_into(&own[part(own.len())], &mut parts);
            for ((found, &start), &count) in found.iter_mut().zip(&starts).zip(&counts) {
                found.extend_from_slice(&all[start as usize..(start + count) as usize]);
            }
        }
        found
    }

    fn abort(&self, code: i32) -> ! {
        SimpleCommunicator::world().abort(code)
    }
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
