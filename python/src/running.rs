//! Long work: without the interpreter's lock, on threads of its own, with progress and an ear for Ctrl-C.
//!
//! The work runs on another thread; this one wakes up some twenty times a second, lets Python handle its signals and
//! calls the progress function. An exception in either ends the work and is raised when it has ended.
//!
//! Nothing runs on the threads that rayon starts by itself: a process that is forked has none of them, and would wait for
//! them forever.
//!
//! Not handled: signals while another thread than Python's main one waits, which Python itself handles there.

use std::panic::resume_unwind;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::scope;
use std::time::Duration;

use halflight::Interrupt;
use halflight::render::Watch;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Between two looks at signals.
const WAKES: Duration = Duration::from_millis(50);

/// What Python is shown of the work: the step, and how far it is.
#[derive(Default)]
pub struct Steps {
    name: Mutex<String>,
    length: AtomicU64,
    done: AtomicU64,
}

impl Watch for Steps {
    fn begin(&self, step: &str, length: u64) {
        *self.name.lock().unwrap_or_else(|error| error.into_inner()) = step.to_owned();
        self.done.store(0, Ordering::Relaxed);
        self.length.store(length, Ordering::Relaxed);
    }

    fn tick(&self, done: u64) {
        self.done.fetch_add(done, Ordering::Relaxed);
    }
}

impl Steps {
    /// Lets Python handle its signals, and shows it the progress.
    fn look(&self, py: Python, progress: Option<&Py<PyAny>>) -> PyResult<()> {
        py.check_signals()?;
        let Some(progress) = progress else { return Ok(()) };
        let name = self.name.lock().unwrap_or_else(|error| error.into_inner()).clone();
        let length = self.length.load(Ordering::Relaxed);
        if length > 0 {
            progress.call1(py, (name, self.done.load(Ordering::Relaxed).min(length), length))?;
        }
        Ok(())
    }
}

/// Runs work that `progress`, a function of step, done and length, is called about.
///
/// # Errors
/// What a signal or the progress function raises.
pub fn run<T: Send>(py: Python, progress: Option<&Py<PyAny>>, work: impl FnOnce(&Steps) -> T + Send) -> PyResult<T> {
    let (interrupt, steps) = (Interrupt::new(), Steps::default());
    let (sender, receiver) = channel();
    let (own, shared) = (&interrupt, &steps);
    py.detach(move || {
        scope(|scope| {
            let worker = scope.spawn(move || {
                // Dropped when the work ends, however it does.
                let _sender = sender;
                own.run(|| work(shared))
            });
            let mut raised = None;
            loop {
                match receiver.recv_timeout(WAKES) {
                    Ok(()) | Err(RecvTimeoutError::Disconnected) => break,
                    Err(RecvTimeoutError::Timeout) if raised.is_some() => (),
                    Err(RecvTimeoutError::Timeout) => {
                        raised = Python::attach(|py| shared.look(py, progress)).err();
                        if raised.is_some() {
                            own.request();
                        }
                    }
                }
            }
            let ended = worker.join().unwrap_or_else(|panic| resume_unwind(panic));
            match (raised, ended) {
                (Some(error), _) => Err(error),
                (None, Ok(Some(done))) => Ok(done),
                (None, Ok(None)) => Err(PyKeyboardInterrupt::new_err(())),
                (None, Err(error)) => Err(PyRuntimeError::new_err(format!("no threads can be started: {error}"))),
            }
        })
    })
}

/// Threads for short work, and the process that they belong to: a fork has none of them.
static THREADS: Mutex<Option<(u32, std::sync::Arc<ThreadPool>)>> = Mutex::new(None);

/// Runs short work, such as one product, on threads that are kept.
///
/// # Errors
/// The system starts no threads.
pub fn briefly<T: Send>(py: Python, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| {
        let pool = {
            let mut held = THREADS.lock().unwrap_or_else(|error| error.into_inner());
            let process = std::process::id();
            match &*held {
                Some((own, pool)) if *own == process => pool.clone(),
                other => {
                    // Threads of the process before the fork are not there to be ended.
                    if let Some((_, pool)) = other {
                        std::mem::forget(pool.clone());
                    }
                    let pool = ThreadPoolBuilder::new().build();
                    let pool =
                        pool.map_err(|error| PyRuntimeError::new_err(format!("no threads can be started: {error}")))?;
                    let pool = std::sync::Arc::new(pool);
                    *held = Some((process, pool.clone()));
                    pool
                }
            }
        };
        Ok(pool.install(work))
    })
}
