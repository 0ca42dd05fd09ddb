//! The processes there are, and what each of them has, handed to all.
//!
//! Not handled: who works on what of a loop ([`Loop`](crate::Loop)).

use std::sync::OnceLock;

use crate::exchange::Team;
#[cfg(feature = "mpi")]
use crate::processes;
use crate::travel::{Travels, message, read};

static TEAM: OnceLock<Box<dyn Team>> = OnceLock::new();

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
pub(super) fn team() -> Option<&'static dyn Team> {
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

/// A value that every process is to go on with: what the first of them finds. For what they may see differently, such
/// as clocks and files.
pub fn agree<T: Travels>(find: impl FnOnce() -> T) -> T {
    let Some(team) = team() else { return find() };
    let own = if team.rank() == 0 { message(&find()) } else { Vec::new() };
    read(&mut &team.gather(&own).bytes[..])
}

/// What every process has, in the order of their ranks.
pub fn all<T: Travels>(own: T) -> Vec<T> {
    let Some(team) = team() else { return vec![own] };
    team.gather(&message(&own)).of_ranks().map(|mut message| read(&mut message)).collect()
}

/// What this process may use of so much that its machine has, in the units of that; the least of all processes, of
/// which those of one machine have the same share.
pub fn part_of_machine(has: f64) -> f64 {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let all = all((name, has));
    let beside = |name: &str| all.iter().filter(|(other, _)| other == name).count() as f64;
    all.iter().map(|(name, has)| has / beside(name)).fold(f64::INFINITY, f64::min)
}

/// How many processes there are.
pub fn size() -> usize {
    team().map_or(1, Team::size)
}

/// How many processes Slurm started that do not know of each other, so that each does all the work; none where this one
/// is alone or not the first, or they are a team.
pub fn strangers() -> Option<usize> {
    let number = |name: &str| std::env::var(name).ok()?.parse::<usize>().ok();
    let is_first = is_alone() && number("SLURM_PROCID") == Some(0);
    number("SLURM_STEP_NUM_TASKS").filter(|&count| is_first && count > 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alone_a_process_speaks_for_itself() {
        assert!(is_alone() && speaks() && agree(|| true) && all(5) == [5]);
        assert_eq!((rank(), size(), part_of_machine(2.0)), (0, 1, 2.0));
    }
}
