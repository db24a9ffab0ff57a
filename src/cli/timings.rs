//! The stopwatch of `--timings`: what each stage of a command took.

use crate::pipeline::{Stage, Watch};
use crate::report::document::{StageTiming, Timing, TimingsSection};
use clap::Args;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The option of commands that compute from data.
#[derive(Debug, Args)]
pub(super) struct TimingsArguments {
    /// Print on standard error what each stage took, and add it to the JSON as `timings`: wall time, processor time of all
    /// threads, and peak memory of the process from its start to the end of the stage. Recordings are measured side by side:
    /// stages that run at the same time share it equally. JSON has what was done before it was written. A dash (JSON:
    /// null) is a figure that this system does not tell
    #[arg(long, help_heading = "Common options")]
    pub(super) timings: bool,
}

/// Measures the stages of a command. What is measured between two announcements belongs to the stages that are under way.
#[derive(Debug)]
pub(super) struct Stopwatch(Mutex<State>);

#[derive(Debug)]
struct State {
    start: Reading,
    last: Reading,
    stages: [StageState; Stage::ALL.len()],
}

/// A stage so far.
#[derive(Debug, Clone, Copy, Default)]
struct StageState {
    /// Pieces of work that are in it.
    works: u32,
    has_begun: bool,
    /// Shares of the wall time and of the processor time (s).
    wall: f64,
    processor: Option<f64>,
    /// Peak memory when a piece of work last left it (bytes).
    peak: Option<u64>,
}

/// The clocks and the memory at one moment.
#[derive(Debug, Clone, Copy)]
struct Reading {
    wall: Instant,
    /// Processor time of all threads since the process began; `None` where the system does not tell.
    processor: Option<Duration>,
    /// Peak memory since the process began (bytes); `None` where the system does not tell.
    peak: Option<u64>,
}

impl Stopwatch {
    /// Starts now.
    pub(super) fn start() -> Self {
        let start = Reading::now();
        Self(Mutex::new(State {
            start,
            last: start,
            stages: Default::default(),
        }))
    }

    /// Returns what was measured until now.
    pub(super) fn timings(&self) -> TimingsSection {
        let mut state = self.state();
        state.share(Reading::now());
        state.timings()
    }

    /// A panic elsewhere is no reason to lose the figures.
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watch for Stopwatch {
    fn pass(&self, from: Option<Stage>, to: Option<Stage>) {
        let mut state = self.state();
        // Read under the lock: moments of several threads come in their order.
        let now = Reading::now();
        state.share(now);
        if let Some(from) = from {
            let left = state.of(from);
            left.works = left.works.saturating_sub(1);
            left.peak = now.peak;
        }
        if let Some(to) = to {
            let entered = state.of(to);
            entered.works += 1;
            entered.has_begun = true;
        }
    }
}

impl State {
    fn of(&mut self, stage: Stage) -> &mut StageState {
        // The stages are listed in the order of the type.
        &mut self.stages[stage as usize]
    }

    /// Deals out what was used since the last reading, evenly to the pieces of work that are under way.
    fn share(&mut self, now: Reading) {
        let used = now.since(&self.last);
        self.last = now;
        let works: u32 = self.stages.iter().map(|stage| stage.works).sum();
        for stage in self.stages.iter_mut().filter(|stage| stage.works > 0) {
            let share = f64::from(stage.works) / f64::from(works);
            stage.wall += share * used.wall_seconds;
            let before = stage.processor.unwrap_or(0.0);
            stage.processor = used.processor_seconds.map(|used| before + share * used);
        }
    }

    fn timings(&self) -> TimingsSection {
        let total = self.last.since(&self.start);
        let begun = Stage::ALL.into_iter().zip(&self.stages);
        let begun = begun.filter(|(_, stage)| stage.has_begun);
        let stages: Vec<StageTiming> = begun
            .map(|(name, stage)| StageTiming {
                stage: name,
                timing: Timing {
                    wall_seconds: stage.wall,
                    processor_seconds: stage.processor,
                    // A stage that is under way has used as much as the process.
                    peak_bytes: match stage.works {
                        0 => stage.peak,
                        _ => self.last.peak,
                    },
                },
            })
            .collect();
        let of_stages = stages.iter().map(|stage| stage.timing.wall_seconds);
        let wall: f64 = of_stages.sum();
        let of_stages = stages.iter().map(|stage| stage.timing.processor_seconds);
        let processor = total.processor_seconds.zip(of_stages.sum::<Option<f64>>());
        TimingsSection {
            stages,
            other: Timing {
                wall_seconds: (total.wall_seconds - wall).max(0.0),
                processor_seconds: processor.map(|(total, stages)| (total - stages).max(0.0)),
                peak_bytes: None,
            },
            total,
        }
    }
}

impl Reading {
    fn now() -> Self {
        Reading {
            wall: Instant::now(),
            processor: processor_time(),
            peak: peak_memory(),
        }
    }

    /// Returns what was used since an earlier reading, and the peak memory until this one.
    fn since(&self, earlier: &Reading) -> Timing {
        let processor = self.processor.zip(earlier.processor);
        Timing {
            wall_seconds: self.wall.duration_since(earlier.wall).as_secs_f64(),
            processor_seconds: processor
                .map(|(now, before)| now.saturating_sub(before).as_secs_f64()),
            peak_bytes: self.peak,
        }
    }
}

/// Returns the processor time of all threads of this process.
#[cfg(any(target_os = "linux", target_os = "macos"))]
fn processor_time() -> Option<Duration> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::try_from(time).ok()
}

#[cfg(not(any(target_os = "linux", target_os = "macos")))]
fn processor_time() -> Option<Duration> {
    None
}

/// Returns the most memory that this process has held at once (bytes): its resident set, which Linux tells.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    peak_in(&status)
}

/// Returns the peak of the resident set (bytes) in a text of /proc/self/status.
fn peak_in(status: &str) -> Option<u64> {
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64) -> Reading {
        // Any moment will do as the start.
        let zero = *ZERO.get_or_init(Instant::now);
        Reading {
            wall: zero + Duration::from_secs_f64(seconds),
            processor: Some(Duration::from_secs_f64(2.0 * seconds)),
            peak: Some((1e6 * seconds) as u64),
        }
    }

    static ZERO: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();

    fn state() -> State {
        State {
            start: at(0.0),
            last: at(0.0),
            stages: Default::default(),
        }
    }

    #[test]
    fn prop_stages_at_the_same_time_share_it_and_all_rows_add_up_to_the_total() {
        let mut state = state();
        state.share(at(1.0));
        for stage in [Stage::Taps, Stage::Taps, Stage::Fits] {
            state.of(stage).works += 1;
            state.of(stage).has_begun = true;
        }
        state.share(at(4.0));
        let found = state.timings();
        let of = |index: usize| found.stages[index].timing;
        let names: Vec<Stage> = found.stages.iter().map(|stage| stage.stage).collect();
        assert_eq!(names, [Stage::Taps, Stage::Fits]);
        assert!((of(0).wall_seconds - 2.0).abs() < 1e-9);
        assert!((of(1).wall_seconds - 1.0).abs() < 1e-9);
        assert!((of(0).processor_seconds.unwrap() - 4.0).abs() < 1e-9);
        assert!((found.other.wall_seconds - 1.0).abs() < 1e-9);
        assert!((found.other.processor_seconds.unwrap() - 2.0).abs() < 1e-9);
        assert!((found.total.wall_seconds - 4.0).abs() < 1e-9);
        assert_eq!(found.total.peak_bytes, Some(4_000_000));
    }

    #[test]
    fn limit_figures_that_the_system_does_not_tell_are_none() {
        let mut state = state();
        state.of(Stage::Joint).works = 1;
        state.of(Stage::Joint).has_begun = true;
        state.share(Reading {
            processor: None,
            peak: None,
            ..at(1.0)
        });
        let found = state.timings();
        let rows = [found.stages[0].timing, found.other, found.total];
        for row in rows {
            assert_eq!((row.processor_seconds, row.peak_bytes), (None, None));
        }
    }

    #[test]
    fn limit_peak_memory_is_read_only_where_it_stands() {
        let status = "Name:\ttapjoint\nVmPeak:\t  9000 kB\nVmHWM:\t    1000 kB\nVmRSS:\t 900 kB\n";
        assert_eq!(peak_in(status), Some(1_024_000));
        for text in [
            "",
            "VmHWM:",
            "VmHWM:\t12 MB",
            "VmHWM:\tx kB",
            "VmRSS:\t900 kB\n",
        ] {
            assert_eq!(peak_in(text), None, "{text:?}");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn limit_linux_tells_all_figures() {
        let now = Reading::now();
        assert!(now.processor.is_some());
        assert!(now.peak.is_some_and(|bytes| bytes > 0));
    }
}
