//! Work that can be ended from outside: a solve that a person waits for, and then no longer does.
//!
//! What work consists of, such as rays, products with F and quadratures, looks whether it is still wanted
//! ([`heed_interrupt`]), which takes a load from memory that no one writes to. Where it is not, the stack is unwound,
//! through the threads that work on it, to [`Interrupt::run`].
//!
//! Work runs on threads of its own, and other work goes on: two solves at once are interrupted one by one. Worth: ends
//! within some milliseconds where the time goes into rays. Not handled: reading files and building the hierarchy of
//! rays, which end by themselves.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::{ThreadPoolBuildError, ThreadPoolBuilder};

/// How many requests there are that may still have to be heard.
static REQUESTS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// Of the work that this thread takes part in.
    static OWN: RefCell<Option<Arc<Request>>> = const { RefCell::new(None) };
}

/// Whether the end of some work is requested.
#[derive(Debug, Default)]
struct Request(AtomicBool);

impl Drop for Request {
    fn drop(&mut self) {
        if self.0.load(Ordering::Relaxed) {
            REQUESTS.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

/// A way to end work before it is done.
///
/// ```
/// use halflight_team::{Interrupt, heed_interrupt};
///
/// let interrupt = Interrupt::new();
/// let other = interrupt.clone(); // for another thread
/// other.request();
/// let done = interrupt.run(|| loop {
///     heed_interrupt();
/// })?;
/// assert_eq!(done, None::<()>);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<Request>);

/// What is thrown through the stack.
struct Interrupted;

impl Interrupt {
    /// Work goes on until [`request`](Interrupt::request).
    pub fn new() -> Interrupt {
        Interrupt::default()
    }

    /// Ends all work that this runs now and later.
    pub fn request(&self) {
        if !self.0.0.swap(true, Ordering::Relaxed) {
            REQUESTS.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Runs work on threads of its own, as many as there are where it is called; none where it was interrupted.
    ///
    /// # Errors
    /// The system starts no threads.
    ///
    /// # Panics
    /// Where the work does.
    pub fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> Result<Option<T>, ThreadPoolBuildError> {
        let own = Arc::clone(&self.0);
        let mut threads = ThreadPoolBuilder::new().start_handler(move |_| OWN.set(Some(Arc::clone(&own))));
        if rayon::current_thread_index().is_some() {
            threads = threads.num_threads(rayon::current_num_threads());
        }
        let pool = threads.build()?;
        match catch_unwind(AssertUnwindSafe(|| pool.install(work))) {
            Ok(done) => Ok(Some(done)),
            Err(thrown) if thrown.is::<Interrupted>() => Ok(None),
            Err(thrown) => resume_unwind(thrown),
        }
    }
}

/// Ends the work that this is called in, if that is requested.
#[inline]
pub fn heed_interrupt() {
    if REQUESTS.load(Ordering::Relaxed) != 0 {
        end_own();
    }
}

#[cold]
fn end_own() {
    let is_requested = OWN.with_borrow(|own| own.as_ref().is_some_and(|own| own.0.load(Ordering::Relaxed)));
    if is_requested {
        // No hook is called: nothing is wrong.
        resume_unwind(Box::new(Interrupted));
    }
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    fn count(to: u32) -> u32 {
        (0..to).into_par_iter().map(|_| heed_interrupt()).count() as u32
    }

    #[test]
    fn one_work_is_ended_and_another_goes_on() {
        let [ended, other] = [Interrupt::new(), Interrupt::new()];
        ended.request();
        ended.request();
        assert_eq!(ended.run(|| count(100)).expect("threads"), None);
        assert_eq!(other.run(|| count(100)).expect("threads"), Some(100));
        assert_eq!(count(100), 100);
        let inside = other.run(|| ended.run(|| count(100)).expect("threads")).expect("threads");
        assert_eq!(inside, Some(None));
    }

    #[test]
    fn another_thread_ends_work_that_has_begun() {
        let interrupt = Interrupt::new();
        let other = interrupt.clone();
        let begun = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let run = scope.spawn(|| {
                interrupt.run(|| {
                    begun.store(true, Ordering::Relaxed);
                    loop {
                        count(100);
                    }
                })
            });
            while !begun.load(Ordering::Relaxed) {
                std::thread::yield_now();
            }
            other.request();
            let ended: Option<()> = run.join().expect("no panic").expect("threads");
            assert_eq!(ended, None);
        });
    }
}
