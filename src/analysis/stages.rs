//! Announcements of the stages of the work, for whoever measures what each of them takes. Nothing here has a clock.

use schemars::JsonSchema;
use serde::Serialize;

// The chain announces those up to the perturbation, its callers the others.
/// Stages of the work, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// Files are opened, taps are found and judged; the shown stretches of the recordings are read.
    Taps,
    /// Spectra are averaged, and their peaks are read.
    Spectra,
    /// Modes are fitted.
    Fits,
    /// Readings of all recordings are merged, and get the numbers of the model's modes.
    Numbers,
    /// The joint is estimated, and frequencies are predicted.
    Joint,
    /// The estimate is repeated with other frequencies.
    Perturbation,
    /// The cause of the gap between model and measurement is sought.
    Diagnosis,
    /// Tests are compared.
    Comparison,
    /// Tests of a study, most of them virtual, are made and analysed.
    Study,
    /// Pictures are drawn.
    Pictures,
    /// Texts and tables are composed, and files are written.
    Files,
}

impl Stage {
    /// All stages.
    pub const ALL: [Stage; 11] = [
        Stage::Taps,
        Stage::Spectra,
        Stage::Fits,
        Stage::Numbers,
        Stage::Joint,
        Stage::Perturbation,
        Stage::Diagnosis,
        Stage::Comparison,
        Stage::Study,
        Stage::Pictures,
        Stage::Files,
    ];
}

/// Receives the announcements. Recordings are measured side by side, so several pieces of work can be in stages at once.
pub trait Watch: Sync {
    /// A piece of work goes from one stage to another; `None` = it begins or ends.
    fn pass(&self, from: Option<Stage>, to: Option<Stage>);
}

/// Nobody watches.
impl Watch for () {
    fn pass(&self, _: Option<Stage>, _: Option<Stage>) {}
}

/// A piece of work that is in a stage until this value is dropped.
pub struct Work<'a> {
    watch: &'a dyn Watch,
    stage: Stage,
}

impl<'a> Work<'a> {
    /// Begins a piece of work.
    pub fn begin(watch: &'a dyn Watch, stage: Stage) -> Self {
        watch.pass(None, Some(stage));
        Work { watch, stage }
    }

    /// Goes on to another stage.
    pub fn go_on(&mut self, stage: Stage) {
        self.watch.pass(Some(self.stage), Some(stage));
        self.stage = stage;
    }
}

impl Drop for Work<'_> {
    fn drop(&mut self) {
        self.watch.pass(Some(self.stage), None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn prop_every_stage_that_begins_ends() {
        struct Log(Mutex<Vec<[Option<Stage>; 2]>>);
        impl Watch for Log {
            fn pass(&self, from: Option<Stage>, to: Option<Stage>) {
                self.0.lock().unwrap().push([from, to]);
            }
        }
        let log = Log(Mutex::default());
        {
            let mut work = Work::begin(&log, Stage::Taps);
            work.go_on(Stage::Spectra);
        }
        let (taps, spectra) = (Some(Stage::Taps), Some(Stage::Spectra));
        let expected = [[None, taps], [taps, spectra], [spectra, None]];
        assert_eq!(*log.0.lock().unwrap(), expected);
    }

    #[test]
    fn limit_all_stages_are_listed_in_their_order() {
        assert!(Stage::ALL.is_sorted());
        assert_eq!(Stage::ALL.last(), Some(&Stage::Files));
        for (place, stage) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage as usize, place);
        }
    }
}
