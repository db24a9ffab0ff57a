//! Work beside the interpreter: threads, and Ctrl-C during long calls.

use crate::errors::refused;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::any::Any;
use std::mem;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use tapjoint::pipeline::{Stage, Watch};

/// Time between two looks for signals.
const BEAT: Duration = Duration::from_millis(50);
/// Stack of each thread (bytes): that of a main thread.
const STACK: usize = 8 << 20;
/// Most threads: no machine has more processors.
const MOST_THREADS: usize = 1024;

/// Ends work at its next stage once the caller has given up.
#[derive(Debug, Default)]
pub struct Cancel(AtomicBool);

/// What unwinds work that was given up.
struct GivenUp;

impl Watch for Cancel {
    fn pass(&self, _: Option<Stage>, _: Option<Stage>) {
        // Values that are dropped meanwhile announce the end of their stages.
        if self.0.load(Ordering::Relaxed) && !thread::panicking() {
            resume_unwind(Box::new(GivenUp));
        }
    }
}

/// The pool of the last number of threads. Threads do not live on in a forked process, so it belongs to one.
struct KeptPool {
    process: u32,
    threads: Option<usize>,
    pool: Arc<ThreadPool>,
}

static KEPT: Mutex<Option<KeptPool>> = Mutex::new(None);

/// Checks a number of threads.
fn check(py: Python<'_>, threads: Option<usize>) -> PyResult<()> {
    match threads.filter(|count| !(1..=MOST_THREADS).contains(count)) {
        Some(count) => {
            let text = format!(
                "threads: {count} is not allowed; give 1 to {MOST_THREADS}, or None for one to each processor"
            );
            Err(refused(py, &text))
        }
        None => Ok(()),
    }
}

/// Returns a pool with so many threads; `None` = one for each processor, or as RAYON_NUM_THREADS says.
fn pool_of(py: Python<'_>, threads: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    check(py, threads)?;
    // Python may let other threads run while it makes an exception: the pool is free again by then.
    kept_pool(threads).map_err(|cause| {
        let text = format!("threads: the system cannot start them: {cause}; give fewer");
        refused(py, &text)
    })
}

/// Returns the kept pool if it fits, else a new one, which is kept in its place.
fn kept_pool(threads: Option<usize>) -> Result<Arc<ThreadPool>, ThreadPoolBuildError> {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let process = process::id();
    if let Some(known) = kept.as_ref()
        && (known.process, known.threads) == (process, threads)
    {
        return Ok(known.pool.clone());
    }
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .stack_size(STACK)
        .build()?;
    let pool = Arc::new(pool);
    let before = kept.replace(KeptPool {
        process,
        threads,
        pool: pool.clone(),
    });
    // The threads of another process cannot be ended from here.
    if before
        .as_ref()
        .is_some_and(|before| before.process != process)
    {
        mem::forget(before);
    }
    Ok(pool)
}

/// Leaves a pool to the work that was given up, so that later calls do not wait for its threads.
fn give_up(pool: &Arc<ThreadPool>) {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.take_if(|kept| Arc::ptr_eq(&kept.pool, pool));
}

/// Runs short work on borrowed data, without Python's lock. Small work stays on the thread of the caller.
///
/// # Errors
/// A number of threads that is not allowed.
pub fn compute<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    is_small: bool,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    if is_small {
        check(py, threads)?;
        return Ok(py.detach(work));
    }
    let pool = pool_of(py, threads)?;
    Ok(py.detach(|| pool.install(work)))
}

/// Runs long work without Python's lock, and looks for signals meanwhile. After Ctrl-C the call returns at once, and the work
/// ends at its next stage.
///
/// # Errors
/// The exception of a signal's handler; a number of threads that is not allowed.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&Arc<Cancel>) -> T + Send + 'static,
) -> PyResult<T> {
    let cancel = Arc::new(Cancel::default());
    let (sender, receiver) = channel::<Result<T, Box<dyn Any + Send>>>();
    let watched = cancel.clone();
    let pool = pool_of(py, threads)?;
    pool.spawn(move || {
        let result = catch_unwind(AssertUnwindSafe(|| work(&watched)));
        // A caller that has given up takes no result.
        let _ = sender.send(result);
    });
    let mut receiver = receiver;
    loop {
        let received;
        (received, receiver) = py.detach(move || (receiver.recv_timeout(BEAT), receiver));
        match received {
            Ok(Ok(value)) => return Ok(value),
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let text = "the work has ended without a result";
                return Err(refused(py, text));
            }
        }
        if let Err(signal) = py.check_signals() {
            cancel.0.store(true, Ordering::Relaxed);
            give_up(&pool);
            return Err(signal);
        }
    }
}
