//! The workers of a batch: threads that analyse tests, while the first thread waits for what they find.
//!
//! A test may hang, in a pipe or on a dead disk, and no thread can be ended from outside. With a limit the first thread
//! gives such a test up: it leaves the thread behind, and starts another in its place. Threads that were left behind end at
//! their next stage, or with the process. They write nothing: files are written by the first thread alone.

use super::inputs::{Loaded, Tests};
use super::journal_file::{Known, Place};
use super::reports::{Prepared, Reports};
use crate::batch::{Key, answer_watched};
use crate::pipeline::{Stage, Watch};
use anyhow::{Context, anyhow, bail};
use std::any::Any;
use std::collections::BTreeMap;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Stack of a worker (bytes), that of a program's first thread.
const STACK: usize = 8 << 20;
/// Most threads that are left behind at the same time.
const MOST_LEFT: usize = 64;
/// Time that another program waits for the workers of a call that it ends.
const PATIENCE: Duration = Duration::from_secs(5);

/// What the workers work on.
pub(super) struct Work {
    /// All tests.
    pub(super) tests: Arc<Tests>,
    /// Indices of those that are to be analysed.
    pub(super) own: Vec<usize>,
    /// What is finished already.
    pub(super) known: Known,
    /// Where reports go, if there are any.
    pub(super) reports: Option<Reports>,
    /// Receives the stages of all tests.
    pub(super) watch: Arc<dyn Watch + Send + Sync>,
    /// True inside another program, which ends a call by a panic in `watch`.
    pub(super) is_embedded: bool,
}

/// What came of a test.
#[derive(Debug)]
pub(super) enum Found {
    /// The journal has its record.
    Known {
        /// Its key.
        key: Key,
        /// Place of its record.
        place: Place,
    },
    /// It was analysed now.
    Analysed {
        /// Its key.
        key: Key,
        /// Its record, and its report.
        prepared: Box<Prepared>,
    },
    /// It was not analysed to its end, for this reason.
    Unfinished(String),
}

/// A test that is finished.
#[derive(Debug)]
pub(super) struct Finished {
    /// Its place among those that are to be analysed.
    pub(super) slot: usize,
    /// What came of it.
    pub(super) found: Found,
}

/// What a worker says.
enum Message {
    Finished(Finished),
    /// The program around this one ends the call, by this panic.
    Unwound(Box<dyn Any + Send>),
    /// The worker ends, and why if there are tests left. `was_left` is true of one that was left behind.
    Ended {
        was_left: bool,
        problem: Option<anyhow::Error>,
    },
}

/// Which tests are under way.
#[derive(Debug, Default)]
struct Queue {
    /// Place of the next test.
    next: usize,
    /// The test of each worker.
    running: BTreeMap<u64, Running>,
}

#[derive(Debug)]
struct Running {
    slot: usize,
    since: Instant,
    is_left: Arc<AtomicBool>,
}

struct Shared {
    work: Work,
    queue: Mutex<Queue>,
    is_stopped: AtomicBool,
}

impl Shared {
    /// A panic elsewhere leaves the queue as it is.
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the place of the next test for a worker; `None` where all are begun.
    fn begin(&self, worker: u64, is_left: &Arc<AtomicBool>) -> Option<usize> {
        let mut queue = self.queue();
        let slot = queue.next;
        if slot >= self.work.own.len() || self.is_stopped.load(Ordering::Relaxed) {
            return None;
        }
        queue.next += 1;
        let running = Running {
            slot,
            since: Instant::now(),
            is_left: is_left.clone(),
        };
        queue.running.insert(worker, running);
        Some(slot)
    }

    /// Ends the test of a worker. Returns false where it was given up meanwhile.
    fn end(&self, worker: u64) -> bool {
        self.queue().running.remove(&worker).is_some()
    }
}

/// Passes stages on, and ends the work of a thread that was left behind or stopped.
struct Stoppable<'a> {
    shared: &'a Shared,
    is_left: &'a AtomicBool,
}

/// What unwinds the work of such a thread.
struct Stopped;

impl Watch for Stoppable<'_> {
    fn pass(&self, from: Option<Stage>, to: Option<Stage>) {
        self.shared.work.watch.pass(from, to);
        let is_stopped = |flag: &AtomicBool| flag.load(Ordering::Relaxed);
        // Values that are dropped meanwhile announce the end of their stages.
        if (is_stopped(self.is_left) || is_stopped(&self.shared.is_stopped)) && !thread::panicking()
        {
            resume_unwind(Box::new(Stopped));
        }
    }
}

/// All workers. Dropped, they begin no further test.
pub(super) struct Workers {
    shared: Arc<Shared>,
    sender: SyncSender<Message>,
    receiver: Receiver<Message>,
    limit: Option<Duration>,
    /// Number of the next worker.
    next: u64,
    /// Workers that are there, those left behind excepted.
    alive: usize,
    /// Threads that were left behind and have not ended yet.
    left: usize,
}

impl fmt::Debug for Workers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Workers").finish_non_exhaustive()
    }
}

impl Workers {
    /// Starts so many workers, or as many as the system allows. A test may take as long as `limit` says.
    ///
    /// # Errors
    /// The system starts none.
    pub(super) fn start(work: Work, jobs: usize, limit: Option<Duration>) -> anyhow::Result<Self> {
        // No more than that wait for the first thread with what they have found.
        let (sender, receiver) = sync_channel(jobs);
        let count = jobs.min(work.own.len());
        let mut workers = Self {
            shared: Arc::new(Shared {
                work,
                queue: Mutex::default(),
                is_stopped: AtomicBool::new(false),
            }),
            sender,
            receiver,
            limit,
            next: 0,
            alive: 0,
            left: 0,
        };
        for _ in 0..count {
            match workers.add() {
                Ok(()) => {}
                Err(_) if workers.alive > 0 => break,
                Err(cause) => return Err(cause),
            }
        }
        Ok(workers)
    }

    /// Returns the number of workers.
    pub(super) fn count(&self) -> usize {
        self.alive
    }

    fn add(&mut self) -> anyhow::Result<()> {
        let (shared, sender, worker) = (self.shared.clone(), self.sender.clone(), self.next);
        let thread = thread::Builder::new().stack_size(STACK);
        thread
            .spawn(move || serve(&shared, worker, &sender))
            .context("the system cannot start a thread; give fewer --jobs")?;
        self.next += 1;
        self.alive += 1;
        Ok(())
    }

    /// Waits for the next test that is finished, or given up.
    ///
    /// # Errors
    /// No worker is left, or too many threads were left behind.
    ///
    /// # Panics
    /// With the panic by which the program around this one ends the call.
    pub(super) fn next(&mut self) -> anyhow::Result<Finished> {
        loop {
            let message = match self.limit {
                None => self
                    .receiver
                    .recv()
                    .map_err(|_| RecvTimeoutError::Disconnected),
                Some(limit) => self.receiver.recv_timeout(self.patience(limit)),
            };
            match message {
                Ok(Message::Finished(finished)) => return Ok(finished),
                Ok(Message::Unwound(panic)) => {
                    self.alive -= 1;
                    self.stop();
                    resume_unwind(panic)
                }
                Ok(Message::Ended { was_left: true, .. }) => self.left -= 1,
                Ok(Message::Ended { problem, .. }) => {
                    self.alive -= 1;
                    if self.alive == 0 {
                        let problem = problem.unwrap_or_else(|| anyhow!("all workers have ended"));
                        return Err(problem.context("run again, the batch goes on from here"));
                    }
                }
                Err(RecvTimeoutError::Timeout) => {
                    if let Some(given_up) = self.give_up()? {
                        return Ok(given_up);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => bail!("all workers have ended; run again"),
            }
        }
    }

    /// Returns the time until the first test may be given up.
    fn patience(&self, limit: Duration) -> Duration {
        let queue = self.shared.queue();
        let since = queue.running.values().map(|running| running.since).min();
        since.map_or(limit, |since| limit.saturating_sub(since.elapsed()))
    }

    /// Gives up a test that takes too long, leaves its thread behind, and starts another; `None` where none does.
    fn give_up(&mut self) -> anyhow::Result<Option<Finished>> {
        let Some(limit) = self.limit else {
            return Ok(None);
        };
        let given_up = {
            let mut queue = self.shared.queue();
            let mut running = queue.running.iter();
            let late = running.find(|(_, running)| running.since.elapsed() >= limit);
            let worker = late.map(|(worker, _)| *worker);
            worker.and_then(|worker| queue.running.remove(&worker))
        };
        let Some(given_up) = given_up else {
            return Ok(None);
        };
        given_up.is_left.store(true, Ordering::Relaxed);
        self.alive -= 1;
        self.left += 1;
        let seconds = limit.as_secs_f64();
        if self.left > MOST_LEFT {
            bail!(
                "{} tests still run after {seconds} s (--limit). Finished tests are kept. Find out why these hang, then run again",
                self.left
            );
        }
        let has_tests = self.shared.queue().next < self.shared.work.own.len();
        if has_tests
            && let Err(cause) = self.add()
            && self.alive == 0
        {
            return Err(cause);
        }
        Ok(Some(Finished {
            slot: given_up.slot,
            found: Found::Unfinished(format!("not analysed within {seconds} s (--limit)")),
        }))
    }

    /// Lets no worker begin another test, and ends those under way at their next stage. Another program may go on with its
    /// work, so it waits for them, but for none that hangs.
    fn stop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
        let start = Instant::now();
        while self.shared.work.is_embedded && self.alive > 0 {
            let left = PATIENCE.saturating_sub(start.elapsed());
            match self.receiver.recv_timeout(left) {
                Ok(Message::Finished(_) | Message::Ended { was_left: true, .. }) => {}
                Ok(Message::Unwound(_) | Message::Ended { .. }) => self.alive -= 1,
                Err(_) => return,
            }
        }
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Analyses one test after the other, until none is left, and says how it ended.
///
/// Each worker is a pool of one thread: a test is analysed by one thread, and several tests at the same time.
fn serve(shared: &Arc<Shared>, worker: u64, sender: &SyncSender<Message>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    let ended = match pool.use_current_thread().build() {
        Ok(_pool) => work_off(shared, worker, sender),
        Err(cause) => Message::Ended {
            was_left: false,
            problem: Some(cause.into()),
        },
    };
    // Where nobody waits any more, nobody has to know.
    let _ = sender.send(ended);
}

fn work_off(shared: &Shared, worker: u64, sender: &SyncSender<Message>) -> Message {
    let ended = |was_left| Message::Ended {
        was_left,
        problem: None,
    };
    let is_left = Arc::new(AtomicBool::new(false));
    while let Some(slot) = shared.begin(worker, &is_left) {
        let watch = Stoppable {
            shared,
            is_left: &is_left,
        };
        let found = catch_unwind(AssertUnwindSafe(|| shared.work.find(slot, &watch)));
        if !shared.end(worker) {
            return ended(true);
        }
        let found = match found {
            Ok(found) => found,
            Err(panic) if panic.is::<Stopped>() => break,
            Err(panic) if shared.work.is_embedded => return Message::Unwound(panic),
            // Our fault, and no reason to lose the other tests.
            Err(_) => {
                Found::Unfinished("internal error; please report it with this test".to_owned())
            }
        };
        let sent = sender.send(Message::Finished(Finished { slot, found }));
        if sent.is_err() {
            break;
        }
    }
    ended(false)
}

impl Work {
    /// Analyses a test, unless the journal has its record.
    fn find(&self, slot: usize, watch: &dyn Watch) -> Found {
        let index = self.own[slot];
        let Loaded { key, test } = self.tests.load(index);
        if let Some(place) = self.known.place(key) {
            // A report that was not written needs the analysis again.
            let name = self.tests.name(index);
            let has_report = |reports: &Reports| test.is_err() || reports.has(index, &name, key);
            if self.reports.as_ref().is_none_or(has_report) {
                return Found::Known { key, place };
            }
        }
        let settings = &self.tests.settings;
        let prepared = match (test, &self.reports) {
            (Err(record), _) => Prepared {
                record,
                report: None,
            },
            (Ok(test), None) => Prepared {
                record: answer_watched(&test, settings, watch),
                report: None,
            },
            (Ok(test), Some(reports)) => match reports.prepare(&test, settings, watch) {
                Ok(prepared) => prepared,
                Err(problem) => {
                    return Found::Unfinished(format!("its report cannot be made: {problem}"));
                }
            },
        };
        Found::Analysed {
            key,
            prepared: Box::new(prepared),
        }
    }
}
