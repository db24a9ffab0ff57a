//! `tapjoint listen`: a stream is recorded, and each tap is judged while it is recorded.

mod arrival;
mod bench;
mod decisions;
mod hearing;
mod log;
mod recorder;
#[cfg(feature = "screen")]
mod screen;
#[cfg(feature = "serve")]
mod server;
#[cfg(feature = "sound")]
mod sound;
mod state;
mod stream;
mod target;
mod views;

use super::Outcome;
use super::arguments::{CommonArguments, accuracy};
use super::input::{TestFile, file_name, read_test};
use super::overwrite::Files;
use super::place::is_description;
use super::run::RunArguments;
use super::staging::ledger;
use super::terminal::Terminal;
use crate::listen::ListenSettings;
use crate::pipeline::{BareSettings, RecordingPlan, described_reading};
use crate::quantity::{Dimension, parse_quantity};
use crate::recording::{Format, MAX_CHANNELS, PcmLayout, ReadSettings, Recording, SampleForm};
use crate::taps::TapsByHand;
use anyhow::{Context, bail, ensure};
use clap::Args;
use clap::builder::{PossibleValuesParser, RangedU64ValueParser, TypedValueParser};
use hearing::{Heard, Hearing};
use log::Log;
use recorder::Names;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use stream::{End, Running, Source};
use target::{Target, asked_for, bare_target, described_target};
use tempfile::TempDir;
use views::Views;

/// Record a stream of samples, and judge each tap at once.
///
/// Reads WAV from standard input, or raw samples with --rate, --channels and --format. FILE is the WAV file to be written, or a
/// test description (.toml). Of a description the first [[recording]] without a file is written. Says after each tap
/// whether it counts and why, then what all taps give so far.
///
/// Keys of the live screen: up and down choose a tap, at first the last one. a accepts it, r rejects it, u undoes. n goes on
/// with the next recording, s stops. Ctrl-C ends the recording (on Windows: end the recorder). Once no recording is missing,
/// the test is run as by `tapjoint run`. `listen` takes the options of `run`, such as --json.
#[derive(Debug, Args)]
#[command(
    mut_arg("file", |file| file.help("Test description (.toml), or the WAV file to be written").long_help(None)),
    // A stream has neither a time column nor variables.
    mut_arg("sample_rate", |own| own.hide(true)),
    mut_arg("time_unit", |own| own.hide(true)),
    mut_arg("values", |own| own.hide(true)),
    mut_arg("variable", |own| own.hide(true)),
    after_help = "Examples:\n  arecord -f S16_LE -r 48000 -c 2 -t raw | tapjoint listen test.toml --rate 48000 --channels 2 --format s16le\n  rec -q -t wav - | tapjoint listen taps.wav --hammer 1\n  tapjoint listen test.toml --replay low.wav"
)]
pub(super) struct ListenArguments {
    #[command(flatten)]
    pub(super) run: RunArguments,
    /// Sample rate of raw samples or of the sound device, 100 to 1e8, such as 51200 or "51.2 kHz" (Hz)
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<u32>,
    /// Channels of raw samples or of the sound device
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<u16>::new().range(1..=MOST_CHANNELS))]
    channels: Option<u16>,
    /// Form of raw samples, as sox and ffmpeg name it
    #[arg(long, value_name = "F", value_parser = sample_form())]
    format: Option<SampleForm>,
    /// Record from a sound device instead of standard input: `default`, or a part of its name. For programs that were built
    /// with the feature `sound`
    #[arg(long, value_name = "DEVICE", conflicts_with_all = ["replay", "format"])]
    sound: Option<String>,
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
    /// Wanted half width of the 95 % intervals as a share of the value, such as "5 %". It is that of the joint. Without a
    /// joint it is that of the frequencies, which are known far better ("0.01 %"). Default: only the number of taps is wanted
    #[arg(long, value_name = "P", value_parser = accuracy)]
    accuracy: Option<f64>,
    /// Print lines, and show no live screen. Lines are printed anyhow where standard output is no terminal
    #[arg(long)]
    plain: bool,
    /// Serve a live page to this machine alone, on this port; 0 = any free one. Its address is printed, with a token that the
    /// page needs
    #[arg(long, value_name = "PORT")]
    serve: Option<u16>,
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
    /// Returns the views that were asked for.
    ///
    /// # Errors
    /// The page cannot be served.
    fn views<'a>(&self, terminal: &'a Terminal) -> anyhow::Result<Views<'a>> {
        #[cfg_attr(
            not(any(feature = "screen", feature = "serve")),
            expect(unused_mut, reason = "there are lines alone")
        )]
        let mut views = Views::new(terminal);
        if let Some(port) = self.serve {
            #[cfg(feature = "serve")]
            {
                let page = server::Page::serve(port)?;
                // Its address is needed where nothing else is printed, too.
                let _ = terminal.seal(&format!("page: {}\n", page.address()));
                views.bench.address = Some(page.address().to_owned());
                views.add(Box::new(page));
            }
            #[cfg(not(feature = "serve"))]
            bail!(
                "--serve {port}: this program was built without the page; build it with `--features serve`"
            );
        }
        #[cfg(feature = "screen")]
        if !self.plain
            && terminal.may_be_filled()
            && let Ok(screen) = screen::LiveScreen::begin()
        {
            ledger().restore = Some(screen::restore);
            views.add(Box::new(screen));
        }
        Ok(views)
    }

    /// Returns where the samples come from. A recording that is played is read as `read` says.
    fn source(&self, read: &ReadSettings) -> anyhow::Result<Source> {
        if let Some(name) = &self.sound {
            #[cfg(feature = "sound")]
            return Ok(Source::Sound(sound::SoundDevice {
                name: name.clone(),
                rate: self.rate,
                channels: self.channels,
            }));
            #[cfg(not(feature = "sound"))]
            bail!(
                "--sound {name}: this program was built without sound devices; build it with `--features sound`, or pipe a \
                 recorder into standard input"
            );
        }
        let layout = match (self.rate, self.channels, self.format) {
            (Some(rate), Some(channels), Some(form)) => Some(PcmLayout::new(rate, channels, form)?),
            (None, None, None) => None,
            _ => bail!(
                "raw samples need all of --rate, --channels and --format; WAV needs none of them"
            ),
        };
        let Some(path) = &self.replay else {
            ensure!(
                !io::stdin().is_terminal(),
                "standard input is a terminal, and no samples come from it; start a recorder before it, such as \
                 `arecord -f S16_LE -r 48000 -c 2 | tapjoint listen ...`, or play a recording by --replay"
            );
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
    let mut described = match is_description(path) {
        true => Some(read_test(path, &terminal)?),
        false => None,
    };
    if described.is_some() {
        arguments.run.check_for_description()?;
    }
    ensure!(
        arguments.accuracy.is_none() || arguments.speed.is_some(),
        "--accuracy needs the results between the taps, and --speed max works none out; give a number"
    );
    let replayed = arguments.replay.as_deref();
    let mut target = match &described {
        Some(file) => described_target(file, replayed, arguments.resume, None)?,
        None => bare_target(path, replayed, arguments.resume)?,
    };
    let begun = Begun::new(arguments, described.as_ref(), &target)?;
    let mut views = arguments.views(&terminal)?;
    let stream = Running::begin(begun.source, begun.names);
    // A user who has read the first line may send a signal: it ends the recording.
    ledger().stop = Some(stream.stopper());
    views.say(&introduction(arguments, described.as_ref(), &target));
    let (mut headers, mut first, mut split) = (begun.headers, None, None);
    let (mut failed, mut stream_doubts) = (None, Vec::new());
    // Recordings of the same stream, and those of them with a wrong rate.
    let (mut names, mut wrong, mut is_rate_wrong) = (Vec::new(), Vec::new(), false);
    let (heard, end) = loop {
        let bare = arguments.run.bare();
        let plan = plan_of(described.as_ref(), &target, &bare);
        let settings = ListenSettings {
            name: file_name(&target.file),
            record: arguments.record,
            headers: headers.take(),
            earlier: opened(&target.earlier)?,
        };
        views.begin(title(described.as_ref(), &target));
        let file = described.as_ref();
        let mut hearing = Hearing::new(arguments, file, &target, plan, settings, &mut views);
        if begun.aside.is_none() {
            hearing.log = Some(Log::beside(&target.file));
        }
        hearing.begin_at(is_rate_wrong);
        if begun.has_states && !is_rate_wrong {
            hearing.with_states();
        }
        let mut heard = hearing.listen(&stream, first.take());
        let file = file_name(&target.file);
        for doubt in std::mem::take(&mut heard.stream_doubts) {
            stream_doubts.push(format!("{file}, while it was recorded: {doubt}"));
        }
        names.push(file_name(&target.file));
        // The rate is judged once some of it is there.
        if heard.has_wrong_rate {
            wrong.clone_from(&names);
        }
        is_rate_wrong = heard.is_rate_wrong;
        split = split.or_else(|| files_beside(described.as_ref(), &target, &heard));
        let ended = std::mem::replace(&mut heard.ended, Ok(End::default()));
        let Some((next, file)) = heard.turned.take() else {
            break (heard, ended);
        };
        failed = failed.or(ended.err());
        // The description is read again by the run alone: it may be half written now.
        if let Some((described, table)) = described.as_mut().zip(target.table)
            && let Some(by_hand) = heard.by_hand
        {
            described.test.recordings[table].by_hand = by_hand;
        }
        (target, first) = (next, Some(file));
        // They are about the last recording.
        views.bench.notes.clear();
        views.say(&introduction(arguments, described.as_ref(), &target));
    };
    views.end_screen();
    ledger().restore = None;
    let end = failed.map_or(end, Err).inspect_err(|cause| {
        repeat(&terminal, &stream_doubts);
        views.finish(&format!("The recording has ended with a fault: {cause:#}"));
    })?;
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
        let words = format!("{name}: nothing was recorded");
        views.finish(&words);
        bail!(words);
    }
    let next = described.as_ref().and_then(|file| {
        let next = described_target(file, None, false, None).ok()?;
        Some(match heard.accepted {
            0 => format!(
                "no tap of {name} counts, for the reasons above: remove the file and record it again\n"
            ),
            _ => format!("next: {}; start listen again\n", asked_for(file, &next)),
        })
    });
    // Every frequency would be wrong.
    let refused = (!wrong.is_empty()).then(|| {
        format!(
            "no report: samples came at another rate than stated. Remove {} and record again. If the stated rate is right, \
             `tapjoint run` gives the report\n",
            wrong.join(", ")
        )
    });
    if let Some(words) = refused.or(split).or(next) {
        // A file of JSON that was asked for does not come, or standard output is for JSON alone.
        match common.json {
            Some(_) => terminal.seal(words.trim_end())?,
            None => terminal.say(&words)?,
        }
        repeat(&terminal, &stream_doubts);
        views.finish(&words);
        return Ok(Outcome::of(heard.accepted > 0 && wrong.is_empty()));
    }
    if let Some(by_hand) = heard.by_hand {
        terminal.say(&by_hand_words(
            described.is_some(),
            heard.is_unwritten,
            &by_hand,
        ))?;
        // `run` reads those of a description from its file.
        if described.is_none() {
            let _ = arguments.run.taps.decided.set(by_hand);
        }
    }
    terminal.say("")?;
    views.finish("The recording has ended, and the test is run.");
    let outcome = once();
    repeat(&terminal, &stream_doubts);
    views.finish(match outcome {
        Ok(_) => "The recording has ended. The report is written; the terminal names its folder.",
        Err(_) => "The recording has ended. The run has failed; the terminal says why.",
    });
    outcome
}

/// Says doubts about the stream again: the file does not show them, and the answer is only as good as the stream was.
fn repeat(terminal: &Terminal, stream_doubts: &[String]) {
    for doubt in stream_doubts {
        terminal.warn(doubt);
    }
}

/// What is known before the stream begins.
struct Begun {
    source: Source,
    names: Names,
    /// A recording with the names, units and scales of the one that is heard.
    headers: Option<Recording>,
    /// True where results are wanted between the taps.
    has_states: bool,
    /// Folder for the copy of a recording that is only played. It is removed in the end.
    aside: Option<TempDir>,
}

impl Begun {
    fn new(
        arguments: &ListenArguments,
        described: Option<&TestFile>,
        target: &Target,
    ) -> anyhow::Result<Self> {
        let bare = arguments.run.bare();
        let read = match plan_of(described, target, &bare) {
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
        // Files of a bare recording are measured one by one, and decisions hold for all of them together.
        let is_one = described.is_some() || target.earlier.is_empty();
        // A recording that is there already is played into a folder that is removed.
        let aside = target.is_played.then(|| {
            let folder = tempfile::Builder::new().prefix("tapjoint-").tempdir();
            folder.context("no temporary folder can be made")
        });
        let aside = aside.transpose()?;
        let first = match &aside {
            Some(folder) => {
                let file = folder.path().join(file_name(&target.file));
                file.with_extension("wav")
            }
            None => target.file.clone(),
        };
        Ok(Self {
            source,
            names: Names {
                first,
                reserved: target.reserved.clone(),
            },
            headers,
            has_states: arguments.speed.is_some() && is_whole && is_one,
            aside,
        })
    }
}

/// Says what to do with a recording in several files that the description does not name; `None` where there is nothing to do.
fn files_beside(described: Option<&TestFile>, target: &Target, heard: &Heard) -> Option<String> {
    let known = described.map(described_files).unwrap_or_default();
    let has_more = heard.files.iter().any(|file| !known.contains(file));
    if heard.files.len() < 2 || !has_more || target.is_played {
        return None;
    }
    let folder = described.map_or(Path::new(""), |file| &file.folder);
    let names = heard.files.iter().map(|file| {
        let name = file.strip_prefix(folder).unwrap_or(file);
        format!("\"{}\"", name.display())
    });
    let names = names.collect::<Vec<_>>().join(", ");
    let (place, others) = match described {
        Some(_) => (
            "the description in place of its file",
            ", or start listen again where recordings are missing",
        ),
        None => ("a description (`tapjoint init` prints one)", ""),
    };
    let by_hand = match (described, &heard.by_hand) {
        (None, Some(by_hand)) => by_hand_lists(by_hand)
            .map(|(name, times)| format!(" and {name}_taps = [{times}]"))
            .collect(),
        _ => String::new(),
    };
    Some(format!(
        "one recording in {} files, no report yet: write files = [{names}]{by_hand} in {place}, then run the test{others}\n",
        heard.files.len()
    ))
}

/// The files of all recordings of a description.
fn described_files(file: &TestFile) -> Vec<PathBuf> {
    let recordings = file.test.recordings.iter();
    let files = recordings.flat_map(|recording| recording.files());
    files.map(|name| file.path_of(name)).collect()
}

/// Says where decisions by hand stand.
fn by_hand_words(is_described: bool, is_unwritten: bool, by_hand: &TapsByHand) -> String {
    if is_described && is_unwritten {
        return "decided by hand: not all of it could be written into the description; copy the times from the log\n".to_owned();
    }
    if is_described {
        return "decided by hand: accept_taps and reject_taps of the description hold it\n"
            .to_owned();
    }
    let options: Vec<String> = by_hand_lists(by_hand)
        .map(|(name, times)| format!("--{name}-taps {times}"))
        .collect();
    match options.is_empty() {
        true => "decided by hand: no tap; leave --accept-taps and --reject-taps out of a `run`\n"
            .to_owned(),
        false => format!(
            "decided by hand: give {} to `run` for the same answer\n",
            options.join(" ")
        ),
    }
}

/// "accept" and "reject" with the times of their taps (s), where there are any.
fn by_hand_lists(by_hand: &TapsByHand) -> impl Iterator<Item = (&'static str, String)> {
    let lists = [("accept", &by_hand.accept), ("reject", &by_hand.reject)];
    let lists = lists.into_iter().filter(|(_, times)| !times.is_empty());
    lists.map(|(name, times)| {
        let times: Vec<String> = times.iter().map(f64::to_string).collect();
        (name, times.join(","))
    })
}

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

/// What is recorded: "recording low.wav, tap at 0.385 m".
fn title(described: Option<&TestFile>, target: &Target) -> String {
    let what = match described {
        Some(file) => asked_for(file, target),
        None => file_name(&target.file),
    };
    let verb = match (target.is_played, &target.earlier[..]) {
        (true, _) => "playing",
        (false, []) => "recording",
        (false, _) => "continuing",
    };
    format!("{verb} {what}")
}

/// What is recorded, and how it ends.
fn introduction(
    arguments: &ListenArguments,
    described: Option<&TestFile>,
    target: &Target,
) -> String {
    let (title, wanted) = (title(described, target), arguments.taps);
    format!("{title}; {wanted} taps are wanted; Ctrl-C ends\n")
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
