//! `tapjoint listen`: a stream is recorded, and each tap is judged while it is recorded.

mod log;
mod recorder;
mod state;
mod stream;
mod target;

use super::Outcome;
use super::arguments::CommonArguments;
use super::input::{TestFile, file_name, read_test};
use super::overwrite::Files;
use super::place::is_description;
use super::run::RunArguments;
use super::staging::ledger;
use super::terminal::Terminal;
use crate::listen::{ListenError, ListenSettings, Listener, News};
use crate::pipeline::{BareSettings, RecordingPlan, described_reading};
use crate::quantity::{Dimension, parse_quantity};
use crate::recording::{
    Format, GrowingRecording, MAX_CHANNELS, PcmLayout, ReadSettings, Recording, SampleForm,
};
use anyhow::{Context, bail, ensure};
use clap::Args;
use clap::builder::{PossibleValuesParser, RangedU64ValueParser, TypedValueParser};
use log::Log;
use recorder::Destination;
use state::{States, Subject};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;
use stream::{End, Event, Source};
use target::{Target, bare_target, described_target};

/// Record a stream of samples, and judge each tap while you go on tapping.
///
/// Reads WAV from standard input, or raw samples with --rate, --channels and --format. FILE is the WAV file to be written, or a
/// test description (.toml). Of a description the first [[recording]] without a file is written. Says after each tap
/// whether it counts and why, then what all taps give so far. Ctrl-C ends the recording (on Windows: end the recorder). Once no recording is missing, the
/// test is run as by `tapjoint run`, with the options of `run`; --json is written then.
#[derive(Debug, Args)]
#[command(
    mut_arg("file", |file| file.help("Test description (.toml), or the WAV file to be written").long_help(None)),
    after_help = "Examples:\n  arecord -f S16_LE -r 48000 -c 2 -t raw | tapjoint listen test.toml --rate 48000 --channels 2 --format s16le\n  rec -q -t wav - | tapjoint listen taps.wav --hammer 1\n  tapjoint listen test.toml --replay low.wav"
)]
pub(super) struct ListenArguments {
    #[command(flatten)]
    pub(super) run: RunArguments,
    /// Sample rate of raw samples, 100 to 1e8, such as 51200 or "51.2 kHz" (Hz)
    #[arg(long, value_name = "HZ", requires_all = ["channels", "format"], value_parser = rate)]
    rate: Option<u32>,
    /// Channels of raw samples
    #[arg(long, value_name = "N", requires_all = ["rate", "format"], value_parser = RangedU64ValueParser::<u16>::new().range(1..=MOST_CHANNELS))]
    channels: Option<u16>,
    /// Form of raw samples, as sox and ffmpeg name it
    #[arg(long, value_name = "F", requires_all = ["rate", "channels"], value_parser = sample_form())]
    format: Option<SampleForm>,
    /// Play a recording instead of a stream, or with --rate a file of raw samples. A recording of the test is played and not
    /// written again
    #[arg(long, value_name = "FILE")]
    replay: Option<PathBuf>,
    /// Speed of --replay, 0.1 to 1000, 1 = as it was recorded; or `max`: as fast as possible, without the results between
    /// the taps
    #[arg(long, value_name = "X", default_value = "1", requires = "replay", value_parser = speed)]
    speed: Speed,
    /// Continue the last recording, in a new file beside it
    #[arg(long, conflicts_with = "replay")]
    resume: bool,
    /// Taps that are wanted in each recording
    #[arg(long, value_name = "N", default_value = "5", value_parser = RangedU64ValueParser::<usize>::new().range(1..=10_000))]
    taps: usize,
    /// Time from a tap to its verdict (s). The next tap shortens it, and a described `block` may lengthen it
    #[arg(long, value_name = "S", default_value = "2", value_parser = record)]
    record: f64,
}

/// As many as a recording may have.
const MOST_CHANNELS: u64 = MAX_CHANNELS as u64;

/// Speed of a replay: seconds of the recording in a second; `None` = as fast as possible.
type Speed = Option<f64>;

fn sample_form() -> impl TypedValueParser<Value = SampleForm> {
    PossibleValuesParser::new(SampleForm::WORDS.map(|(word, _)| word)).map(|word| {
        let found = SampleForm::WORDS.iter().find(|(known, _)| *known == word);
        found.map_or(SampleForm::S16, |(_, form)| *form)
    })
}

fn rate(text: &str) -> Result<u32, String> {
    let rate = parse_quantity(text, Dimension::Rate).map_err(|error| error.to_string())?;
    match rate.fract() == 0.0 && (100.0..=1e8).contains(&rate) {
        true => Ok(rate as u32),
        false => Err(format!("{rate} Hz; give a whole number from 100 to 1e8 Hz")),
    }
}

fn speed(text: &str) -> Result<Speed, String> {
    let number: Option<f64> = text.trim().parse().ok();
    match number.filter(|speed| (0.1..=1000.0).contains(speed)) {
        Some(speed) => Ok(Some(speed)),
        None if text.trim() == "max" => Ok(None),
        None => Err(format!(
            "\"{}\" is no speed; give 0.1 to 1000, or max",
            text.trim()
        )),
    }
}

fn record(text: &str) -> Result<f64, String> {
    let seconds = parse_quantity(text, Dimension::Time).map_err(|error| error.to_string())?;
    match (0.05..=600.0).contains(&seconds) {
        true => Ok(seconds),
        false => Err(format!("{seconds} s; give 0.05 to 600 s")),
    }
}

impl ListenArguments {
    /// Returns where the samples come from. A recording that is played is read as `read` says.
    fn source(&self, read: &ReadSettings) -> anyhow::Result<Source> {
        let layout = match (self.rate, self.channels, self.format) {
            (Some(rate), Some(channels), Some(form)) => Some(PcmLayout::new(rate, channels, form)?),
            _ => None,
        };
        let Some(path) = &self.replay else {
            return Ok(Source::Standard(layout));
        };
        let recording = match &layout {
            Some(_) => None,
            None => Some(Recording::open(path, read)?),
        };
        Ok(Source::Replay {
            path: path.clone(),
            recording,
            layout,
            speed: self.speed,
        })
    }
}

/// Records a stream, and then runs the test `once`, unless other recordings are missing.
///
/// # Errors
/// A stream or a file that cannot be used; the errors of the run.
pub(super) fn run(
    arguments: &ListenArguments,
    common: &CommonArguments,
    once: impl Fn() -> anyhow::Result<Outcome>,
) -> anyhow::Result<Outcome> {
    let terminal = Terminal::new(&common.for_words(), Files::default(), None, None)?;
    let path = &arguments.run.file;
    ensure!(
        !path.is_dir(),
        "{}: is a folder; name a description, or the WAV file to be written",
        path.display()
    );
    let described = match is_description(path) {
        true => Some(read_test(path, &terminal)?),
        false => None,
    };
    let replayed = arguments.replay.as_deref();
    let target = match &described {
        Some(file) => described_target(file, replayed, arguments.resume)?,
        None => bare_target(path, replayed, arguments.resume)?,
    };
    let heard = listen(arguments, described.as_ref(), &target, &terminal)?;
    let end = heard.ended?;
    if end.rest > 0 {
        terminal.warn(&format!(
            "the stream ended within a frame; its last {} bytes are left out",
            end.rest
        ));
    }
    if end.missing > 0.0 {
        terminal.warn(&format!(
            "the stream ended {:.2} s before the length that its header promises; check the recorder's messages",
            end.missing
        ));
    }
    let name = file_name(&target.file);
    if heard.files.len() == target.earlier.len() {
        bail!("{name}: nothing was recorded");
    }
    let known = described.as_ref().map(described_files).unwrap_or_default();
    let has_more = heard.files.iter().any(|file| !known.contains(file));
    if heard.files.len() > 1 && has_more && !target.is_played {
        let names = heard.files.iter();
        let folder = described.as_ref().map(|file| file.folder.clone());
        let folder = folder.unwrap_or_default();
        let names = names.map(|file| {
            let name = file.strip_prefix(&folder).unwrap_or(file);
            format!("\"{}\"", name.display())
        });
        let names = names.collect::<Vec<_>>().join(", ");
        let place = match &described {
            Some(_) => "the description",
            None => "a description (`tapjoint init` prints one)",
        };
        terminal.say(&format!(
            "one recording in {} files, no report yet: write files = [{names}] in {place}, then run the test\n",
            heard.files.len()
        ))?;
        return Ok(Outcome::of(heard.accepted > 0));
    }
    if let Some(file) = &described
        && let Ok(next) = described_target(file, None, false)
    {
        terminal.say(&match heard.accepted {
            0 => format!("no tap of {name} counts: remove the file and record it again\n"),
            _ => format!("next: {}; start `listen` again\n", asked_for(file, &next)),
        })?;
        return Ok(Outcome::of(heard.accepted > 0));
    }
    terminal.say("")?;
    once()
}

/// The files of all recordings of a description.
fn described_files(file: &TestFile) -> Vec<PathBuf> {
    let recordings = file.test.recordings.iter();
    let files = recordings.flat_map(|recording| recording.files());
    files.map(|name| file.path_of(name)).collect()
}

/// What was heard.
struct Heard {
    /// Files of the recording.
    files: Vec<PathBuf>,
    /// Taps that count.
    accepted: usize,
    /// How the stream ended.
    ended: anyhow::Result<End>,
}

/// Records the stream and reports each tap.
fn listen(
    arguments: &ListenArguments,
    described: Option<&TestFile>,
    target: &Target,
    terminal: &Terminal,
) -> anyhow::Result<Heard> {
    let bare = arguments.run.bare();
    let plan = plan_of(described, target, &bare);
    let read = match plan {
        RecordingPlan::Described { recording, .. } if target.is_played => {
            described_reading(recording)
        }
        _ => bare.read.clone(),
    };
    let source = arguments.source(&read)?;
    // What is written anew has numbers of channels alone, as a stream has.
    let headers = match &source {
        Source::Replay { recording, .. } if target.is_played => recording.clone(),
        _ => None,
    };
    // Results between the taps are worked out from the file, which may lack names and units.
    let is_whole = headers
        .as_ref()
        .is_none_or(|recording| is_plain(recording.format()));
    let states = (arguments.speed.is_some() && is_whole)
        .then(|| States::begin(Subject::of(described, target, &bare)));
    // A recording that is there already is played into a folder that is removed.
    let aside = target.is_played.then(|| {
        let folder = tempfile::Builder::new().prefix("tapjoint-").tempdir();
        folder.context("no temporary folder can be made")
    });
    let aside = aside.transpose()?;
    let first = match &aside {
        Some(folder) => folder
            .path()
            .join(file_name(&target.file))
            .with_extension("wav"),
        None => target.file.clone(),
    };
    let mut hearing = Hearing {
        plan,
        settings: ListenSettings {
            name: file_name(&target.file),
            record: arguments.record,
            headers,
            earlier: opened(&target.earlier)?,
        },
        listener: None,
        log: aside.is_none().then(|| Log::beside(&first)),
        states,
        wanted: arguments.taps,
        files: target.earlier.clone(),
        fault: None,
        terminal,
    };
    terminal.say(&introduction(arguments, described, target))?;
    let stop = Arc::new(AtomicBool::new(false));
    ledger().stop = Some(stop.clone());
    let destination = Destination {
        first,
        reserved: target.reserved.clone(),
        stop: stop.clone(),
    };
    let events = stream::record(source, destination);
    let mut ended = None;
    while ended.is_none() && !stop.load(Ordering::Relaxed) {
        match events.recv_timeout(PAUSE) {
            Ok(Event::File(path)) => hearing.go_on_in(path),
            Ok(Event::Ended(how)) => ended = Some(how),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => ended = Some(Ok(End::default())),
        }
        hearing.catch_up(&stop)?;
        // A description that does not fit is to be corrected before the first tap.
        if hearing.is_refused() {
            stop.store(true, Ordering::Relaxed);
        }
    }
    // A piece that is being written is waited for. One that comes after that is not written.
    while ended.is_none()
        && let Ok(event) = events.recv_timeout(LAST_PIECE)
    {
        match event {
            Event::File(path) => hearing.go_on_in(path),
            Event::Ended(how) => ended = Some(how),
        }
    }
    ledger().stop = None;
    hearing.end(ended.unwrap_or(Ok(End::default())))
}

/// Time for which the last piece of a stream is waited for, once it was stopped.
const LAST_PIECE: Duration = Duration::from_secs(1);

/// A recording that is listened to.
struct Hearing<'a> {
    plan: RecordingPlan<'a>,
    settings: ListenSettings,
    /// `None` before the first samples.
    listener: Option<Listener<'a>>,
    /// `None` of a recording that is only played, and once it could not be written.
    log: Option<Log>,
    /// `None` where no results are wanted between the taps.
    states: Option<States>,
    /// Taps that are wanted.
    wanted: usize,
    files: Vec<PathBuf>,
    /// Why taps are no longer judged.
    fault: Option<ListenError>,
    terminal: &'a Terminal,
}

impl Hearing<'_> {
    /// Listens to the next file of the recording.
    fn go_on_in(&mut self, path: PathBuf) {
        let opened = GrowingRecording::open(&path);
        self.files.push(path);
        if self.fault.is_some() {
            return;
        }
        let news = match (opened, &mut self.listener) {
            (Err(fault), _) => Err(fault.into()),
            (Ok(growing), Some(listener)) => listener.go_on_in(growing),
            (Ok(growing), None) => {
                let settings = self.settings.clone();
                self.listener = Some(Listener::new(growing, self.plan, settings));
                return;
            }
        };
        self.take(news);
    }

    /// Judges what the file holds by now.
    fn catch_up(&mut self, stop: &AtomicBool) -> anyhow::Result<()> {
        while let Some(listener) = self.listener.as_mut().filter(|_| self.fault.is_none())
            && !stop.load(Ordering::Relaxed)
        {
            let Some(news) = listener.step().transpose() else {
                break;
            };
            self.take(news);
        }
        match &mut self.states {
            Some(states) => states.report(self.terminal),
            None => Ok(()),
        }
    }

    /// Prints and logs what is new. A fault ends the judging, and not the recording.
    fn take(&mut self, news: Result<Vec<News>, ListenError>) {
        let news = match news {
            Ok(news) => news,
            Err(fault) => {
                let words = "taps are not judged any more, and the recording goes on";
                let warning = format!("{fault}; {words}");
                self.fault = Some(fault);
                if !self.is_refused() {
                    self.terminal.warn(&warning);
                }
                return;
            }
        };
        let Some(listener) = &self.listener else {
            return;
        };
        if let Some(log) = &mut self.log
            && let Err(cause) = log.note(listener.seconds(), &news)
        {
            self.terminal
                .warn(&format!("{cause:#}; the recording goes on without a log"));
            self.log = None;
        }
        let screen = self.terminal.screen();
        let mut text = String::new();
        for one in &news {
            text.push_str(&screen.wrapped(&one.to_string(), 2));
        }
        if news.iter().any(|one| !matches!(one, News::Doubt(_))) {
            let (accepted, wanted) = (listener.accepted(), self.wanted);
            let what = match wanted.saturating_sub(accepted) {
                0 => "enough; Ctrl-C ends the recording".to_owned(),
                1 => "1 more is wanted".to_owned(),
                missing => format!("{missing} more are wanted"),
            };
            let reach = listener.reach().map_or(String::new(), |(reach, end)| {
                format!("; take a harder tip: the taps excite up to {reach:.0} Hz of a band to {end:.0} Hz")
            });
            let count = match accepted {
                1 => "1 tap counts".to_owned(),
                count => format!("{count} taps count"),
            };
            text.push_str(&screen.wrapped(&format!("{count}; {what}{reach}"), 2));
            if let Some(states) = &mut self.states {
                states.ask(accepted, &self.files);
            }
        }
        if !text.is_empty() {
            // The recording goes on where standard output was closed.
            let _ = self.terminal.say(&text);
        }
    }

    /// Returns true where the recording does not fit its description or the options, which its first samples show.
    fn is_refused(&self) -> bool {
        let has_looked = self.listener.as_ref().is_none_or(Listener::has_looked);
        // Files of another rate or with other channels do not follow one another.
        let is_described = match self.fault {
            Some(ListenError::Pipeline(_)) => true,
            Some(ListenError::Recording(_)) => !self.settings.earlier.is_empty(),
            None => false,
        };
        is_described && !has_looked
    }

    /// Judges all taps for good.
    fn end(mut self, ended: anyhow::Result<End>) -> anyhow::Result<Heard> {
        self.states = None;
        if self.fault.is_none()
            && let Some(listener) = &mut self.listener
        {
            let news = listener.finish();
            self.take(news);
        }
        if self.is_refused() {
            // The next call is to find the place as this one did.
            for file in &self.files[self.settings.earlier.len()..] {
                let _ = std::fs::remove_file(file);
            }
        }
        let mut accepted = 0;
        if let Some(listener) = self.listener.as_ref().filter(|_| !self.is_refused()) {
            accepted = listener.accepted();
            self.terminal.say(&format!(
                "{}: {:.1} s, {accepted} of {} taps count\n",
                self.settings.name,
                listener.seconds(),
                listener.taps(),
            ))?;
        }
        Ok(Heard {
            files: self.files,
            accepted,
            ended: match self.fault {
                Some(fault) => Err(fault.into()),
                None => ended,
            },
        })
    }
}

/// Time between two looks at a file that does not grow: short beside the least time to a verdict.
const PAUSE: Duration = Duration::from_millis(10);

/// True of formats whose channels have no names and units.
fn is_plain(format: Format) -> bool {
    use Format::{Flac, WavFloat, WavInteger};
    matches!(format, WavInteger { .. } | WavFloat { .. } | Flac { .. })
}

/// What is known of the recording before it begins.
fn plan_of<'a>(
    described: Option<&'a TestFile>,
    target: &Target,
    bare: &'a BareSettings,
) -> RecordingPlan<'a> {
    match described.zip(target.table) {
        Some((file, table)) => RecordingPlan::Described {
            test: &file.test,
            recording: &file.test.recordings[table],
            test_file: &file.name,
        },
        None => RecordingPlan::Bare(bare),
    }
}

/// Opens the files of the recording that are there already.
fn opened(earlier: &[PathBuf]) -> anyhow::Result<Vec<Recording>> {
    let mut recordings = Vec::new();
    for path in earlier {
        let opened = Recording::open(path, &ReadSettings::default())?;
        recordings.push(opened.renamed(file_name(path)));
    }
    Ok(recordings)
}

/// "low.wav, tap at 0.04 m".
fn asked_for(file: &TestFile, target: &Target) -> String {
    let name = file_name(&target.file);
    let recording = target.table.map(|table| &file.test.recordings[table]);
    let Some(recording) = recording else {
        return name;
    };
    let mut words = vec![name];
    if let Some(tap) = recording.tap {
        words.push(format!("tap at {tap} m"));
    }
    if let Some(level) = recording.level.filter(|level| *level != 1.0) {
        words.push(format!("{level} times as hard as level 1"));
    }
    for (sensor, place) in &recording.at {
        words.push(format!("sensor {sensor} at {place} m"));
    }
    if let Some(length) = recording.length {
        words.push(format!("free length {length} m"));
    }
    if !recording.masses.is_empty() {
        words.push(format!("with {} known masses", recording.masses.len()));
    }
    words.join(", ")
}

/// What is recorded, and how it ends.
fn introduction(
    arguments: &ListenArguments,
    described: Option<&TestFile>,
    target: &Target,
) -> String {
    let what = match described {
        Some(file) => asked_for(file, target),
        None => file_name(&target.file),
    };
    let verb = match (target.is_played, &target.earlier[..]) {
        (true, _) => "playing",
        (false, []) => "recording",
        (false, _) => "continuing",
    };
    let wanted = arguments.taps;
    format!("{verb} {what}; {wanted} taps are wanted; Ctrl-C ends\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_numbers_of_a_stream_have_bounds() {
        assert_eq!(rate("51.2 kHz"), Ok(51_200));
        assert_eq!(
            rate("0.5 Hz").unwrap_err(),
            "0.5 Hz; give a whole number from 100 to 1e8 Hz"
        );
        assert_eq!(speed("max"), Ok(None));
        assert_eq!(speed("2"), Ok(Some(2.0)));
        assert_eq!(
            speed("0").unwrap_err(),
            "\"0\" is no speed; give 0.1 to 1000, or max"
        );
        assert_eq!(record("400 ms"), Ok(0.4));
        assert_eq!(record("700 s").unwrap_err(), "700 s; give 0.05 to 600 s");
    }
}
