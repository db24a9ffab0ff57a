//! What all taps give so far, worked out beside the recording.

use super::super::input::TestFile;
use super::target::Target;
use crate::description::TestDescription;
use crate::gap::GapSettings;
use crate::listen::Precision;
use crate::pipeline::{
    BareSettings, IdentifySettings, analysis_of_bare, diagnose_test, measure_bare_file,
};
use crate::report::{document_of, gap_section, render_first_screen, render_progress};
use crate::taps::{REACH, Rejection, TapsByHand};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

/// Up to so many taps each gives a new state. 9: tests with more are rare.
const EACH: usize = 9;
/// Of more taps, share by which their number has to change for a new state. A third: all states together then take three
/// times the work of the last one.
const CHANGE: f64 = 1.0 / 3.0;
/// Added to the nice value of the thread that works states out: the taps are judged first.
#[cfg(target_os = "linux")]
const NICE: i32 = 10;

/// What is analysed.
pub(super) enum Subject {
    /// A described test, of which one recording goes on.
    Described {
        /// The test, with the recordings that are there.
        file: Box<TestFile>,
        /// Place of the recording that goes on.
        table: usize,
        /// Its name.
        name: String,
    },
    /// A recording about which nothing is described.
    Bare(BareSettings),
}

impl Subject {
    pub(super) fn of(described: Option<&TestFile>, target: &Target, bare: &BareSettings) -> Self {
        let Some((file, table)) = described.zip(target.table) else {
            return Self::Bare(bare.clone());
        };
        // Recordings that are still missing are no part of it.
        let recordings = file.test.recordings.iter().enumerate();
        let there = recordings.filter(|(place, recording)| {
            let mut files = recording.files();
            *place == table || files.all(|name| file.path_of(name).exists())
        });
        let there: Vec<_> = there.collect();
        let own = there.iter().position(|(place, _)| *place == table);
        let name = file.test.recordings[table].name();
        let test = TestDescription {
            recordings: there
                .iter()
                .map(|(_, recording)| (*recording).clone())
                .collect(),
            ..file.test.clone()
        };
        Self::Described {
            file: Box::new(TestFile {
                test,
                name: file.name.clone(),
                folder: file.folder.clone(),
            }),
            table: own.unwrap_or(0),
            name,
        }
    }

    /// Analyses the recording that a question is about, with what else there is.
    fn answer(&mut self, question: &Question) -> anyhow::Result<SoFar> {
        let (document, recording) = match self {
            Self::Described { file, table, name } => {
                let recording = &mut file.test.recordings[*table];
                // Names in the description are seen from its folder; others are whole.
                let mut files = question.files.iter().map(std::path::absolute);
                if let Some(first) = files.next() {
                    recording.file = first?;
                }
                recording.more_files = files.collect::<Result<_, _>>()?;
                recording.shown_as = Some(name.clone());
                recording.by_hand = question.by_hand.clone();
                recording.frames = Some(question.frames);
                let analysis = file.analyse(&IdentifySettings::unperturbed(), &())?;
                let diagnosis = diagnose_test(&file.test, &analysis, &GapSettings::default());
                let mut document = document_of(&analysis);
                document.add_gap(gap_section(diagnosis.as_ref()));
                (document, analysis.recordings.into_iter().nth(*table))
            }
            Self::Bare(settings) => {
                settings.by_hand = question.by_hand.clone();
                let mut measured = Vec::new();
                for (number, file) in (1..).zip(&question.files) {
                    // Only the last one goes on growing.
                    let is_last = number == question.files.len();
                    settings.read.frames = Some(question.frames).filter(|_| is_last);
                    measured.push(measure_bare_file(file, settings, &())?);
                }
                let analysis = analysis_of_bare(measured[0].file.clone(), measured);
                (
                    document_of(&analysis),
                    analysis.recordings.into_iter().next(),
                )
            }
        };
        let mut apart = Vec::new();
        for tap in recording.iter().flat_map(|own| &own.measurement.taps.taps) {
            if let Some(why @ Rejection::Inconsistent { .. }) = &tap.rejection {
                apart.push((tap.time, why.clone()));
            }
        }
        // With the picture of the recording that goes on.
        let recording = recording.filter(|_| question.wants_page);
        let first_screen = recording.map(|own| render_first_screen(&document, &[own]));
        let taps = question.counting.len().saturating_sub(apart.len());
        Ok(SoFar {
            lines: render_progress(&document),
            counting: question.counting.clone(),
            precision: Precision::of(&document, taps),
            apart,
            first_screen: first_screen.transpose()?,
        })
    }
}

/// What all taps give so far.
pub(super) struct SoFar {
    /// In a few sentences.
    pub(super) lines: Vec<String>,
    /// Times of the taps that counted in the recording when it was asked for (s).
    pub(super) counting: Vec<f64>,
    /// Taps of the recording that count by themselves, but do not agree with the others: times (s) and reasons.
    pub(super) apart: Vec<(f64, Rejection)>,
    /// How narrow the intervals are; `None` without any.
    pub(super) precision: Option<Precision>,
    /// The first screen of a report on it; `None` where no page is served.
    pub(super) first_screen: Option<String>,
}

/// A question for the state.
#[derive(Clone)]
pub(super) struct Question {
    /// Files of the recording.
    pub(super) files: Vec<PathBuf>,
    /// Frames of the last file that are looked at: what follows is not judged yet.
    pub(super) frames: u64,
    /// Times of the taps that count in them (s).
    pub(super) counting: Vec<f64>,
    /// Taps that are accepted or rejected by hand.
    pub(super) by_hand: TapsByHand,
    /// True where a page is served.
    pub(super) wants_page: bool,
}

/// Works out states in a thread of its own. While one is worked out, only the newest question waits.
pub(super) struct States {
    ask: Sender<Question>,
    answers: Receiver<anyhow::Result<SoFar>>,
    is_busy: bool,
    waiting: Option<Question>,
    /// Taps that counted at the last question, and what was decided by hand.
    last: (Vec<f64>, TapsByHand),
}

impl States {
    /// Begins with what was decided by hand before.
    pub(super) fn begin(mut subject: Subject, by_hand: TapsByHand) -> Self {
        let (ask, questions) = channel::<Question>();
        let (reply, answers) = channel();
        thread::spawn(move || {
            // On Linux of this thread and those that it begins; elsewhere it would be the whole process.
            #[cfg(target_os = "linux")]
            let _ = rustix::process::nice(NICE);
            // One thread: the other processors judge taps.
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
            for question in questions {
                let answer = match &pool {
                    Ok(pool) => pool.install(|| subject.answer(&question)),
                    Err(_) => subject.answer(&question),
                };
                if reply.send(answer).is_err() {
                    return;
                }
            }
        });
        Self {
            ask,
            answers,
            is_busy: false,
            waiting: None,
            last: (Vec::new(), by_hand),
        }
    }

    /// Asks for the state, if the taps that count have changed enough, or what was decided by hand.
    pub(super) fn ask(&mut self, question: Question) {
        let (counting, by_hand) = &self.last;
        let count = question.counting.len();
        let has_changed = match count {
            0..=EACH => {
                let mut pairs = question.counting.iter().zip(counting);
                count != counting.len() || pairs.any(|(one, other)| (one - other).abs() > REACH)
            }
            // The scatter of a mean falls with the square root of their number: among many one more says little.
            many => many.abs_diff(counting.len()) >= (many as f64 * CHANGE) as usize,
        };
        if has_changed || *by_hand != question.by_hand {
            self.last = (question.counting.clone(), question.by_hand.clone());
            self.waiting = Some(question);
        }
    }

    /// Returns a state that is ready, and begins with the next.
    pub(super) fn ready(&mut self) -> Option<anyhow::Result<SoFar>> {
        let mut ready = None;
        if self.is_busy
            && let Ok(answer) = self.answers.try_recv()
        {
            self.is_busy = false;
            ready = Some(answer);
        }
        if !self.is_busy
            && let Some(question) = self.waiting.take()
        {
            self.is_busy = self.ask.send(question).is_ok();
        }
        ready
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn prop_a_recording_that_is_played_elsewhere_gives_the_lines_of_the_test() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/cantilever/test.toml");
        let file = TestFile::of(&path, std::fs::read_to_string(&path).unwrap()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let (own, played) = (path.with_file_name("high.wav"), folder.path().join("a.wav"));
        std::fs::copy(&own, &played).unwrap();
        let table = file
            .test
            .recordings
            .iter()
            .position(|one| one.name() == "high.wav");
        let table = table.unwrap();
        let mut lines = Vec::new();
        for name in [own, played] {
            let file = TestFile {
                test: file.test.clone(),
                name: file.name.clone(),
                folder: file.folder.clone(),
            };
            let mut subject = Subject::Described {
                file: Box::new(file),
                table,
                name: "high.wav".to_owned(),
            };
            let question = Question {
                files: vec![name],
                // More than the file has.
                frames: u64::MAX,
                counting: Vec::new(),
                by_hand: TapsByHand::default(),
                wants_page: false,
            };
            lines.push(subject.answer(&question).unwrap().lines);
        }
        assert_eq!(lines[0], lines[1]);
        // Its fifth mode, which only this recording reaches, has the lowest coherence of the test.
        assert!(
            lines[1]
                .iter()
                .any(|line| line.contains("lowest coherence 0.572 (mode 5)")),
            "{lines:?}"
        );
    }
}
