//! What all taps give so far, worked out beside the recording.

use super::super::input::TestFile;
use super::super::terminal::Terminal;
use super::target::Target;
use crate::description::TestDescription;
use crate::gap::GapSettings;
use crate::pipeline::{
    BareSettings, IdentifySettings, analysis_of_bare, diagnose_test, measure_bare_file,
};
use crate::report::{Screen, document_of, gap_section, render_progress};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

/// Share of the taps by which their number has to change for a new state. A fifth: up to nine taps each gives one.
const CHANGE: f64 = 0.2;

/// What is analysed.
pub(super) enum Subject {
    /// A described test, of which one recording goes on.
    Described {
        /// The test, with the recordings that are there.
        file: Box<TestFile>,
        /// Place of the recording that goes on.
        table: usize,
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
        }
    }

    /// Analyses the recording in these files, with what else there is, and returns the answer in a few lines.
    fn answer(&mut self, files: &[PathBuf], screen: Screen) -> anyhow::Result<String> {
        let document = match self {
            Self::Described { file, table } => {
                let recording = &mut file.test.recordings[*table];
                // Names in the description are seen from its folder; others are whole.
                let mut files = files.iter().map(std::path::absolute);
                if let Some(first) = files.next() {
                    recording.file = first?;
                }
                recording.more_files = files.collect::<Result<_, _>>()?;
                let analysis = file.analyse(&IdentifySettings::unperturbed(), &())?;
                let diagnosis = diagnose_test(&file.test, &analysis, &GapSettings::default());
                let mut document = document_of(&analysis);
                document.add_gap(gap_section(diagnosis.as_ref()));
                document
            }
            Self::Bare(settings) => {
                let mut measured = Vec::new();
                for file in files {
                    measured.push(measure_bare_file(file, settings, &())?);
                }
                document_of(&analysis_of_bare(measured[0].file.clone(), measured))
            }
        };
        Ok(render_progress(&document, screen))
    }
}

/// A question for the state.
struct Question {
    files: Vec<PathBuf>,
    screen: Screen,
}

/// Works out states in a thread of its own. While one is worked out, only the newest question waits.
pub(super) struct States {
    ask: Sender<Question>,
    answers: Receiver<anyhow::Result<String>>,
    is_busy: bool,
    waiting: Option<Vec<PathBuf>>,
    /// Taps that counted at the last question.
    accepted: usize,
}

impl States {
    pub(super) fn begin(mut subject: Subject) -> Self {
        let (ask, questions) = channel::<Question>();
        let (reply, answers) = channel();
        thread::spawn(move || {
            // One thread: the other processors judge taps.
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
            for Question { files, screen } in questions {
                let answer = match &pool {
                    Ok(pool) => pool.install(|| subject.answer(&files, screen)),
                    Err(_) => subject.answer(&files, screen),
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
            accepted: 0,
        }
    }

    /// Asks for the state of the recording in these files, if the number of taps that count has changed enough.
    pub(super) fn ask(&mut self, accepted: usize, files: &[PathBuf]) {
        // The scatter of a mean falls with the square root of their number: among many one more says little.
        let change = accepted.abs_diff(self.accepted);
        if change > 0 && change >= (accepted as f64 * CHANGE) as usize {
            self.accepted = accepted;
            self.waiting = Some(files.to_vec());
        }
    }

    /// Prints a state that is ready, and begins with the next. A state that cannot be worked out is said, and the recording
    /// goes on.
    pub(super) fn report(&mut self, terminal: &Terminal) -> anyhow::Result<()> {
        if self.is_busy
            && let Ok(answer) = self.answers.try_recv()
        {
            self.is_busy = false;
            match answer {
                Ok(text) => {
                    let _ = terminal.say(&text);
                }
                Err(cause) => terminal.warn(&format!("no result so far: {cause:#}")),
            }
        }
        if !self.is_busy
            && let Some(files) = self.waiting.take()
        {
            let screen = terminal.screen();
            self.is_busy = self.ask.send(Question { files, screen }).is_ok();
        }
        Ok(())
    }
}
