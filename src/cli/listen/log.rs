//! The log of the decisions, beside the recording: a line of JSON for each.

use crate::listen::{JudgedTap, News};
use anyhow::Context;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A log that is written line by line. A process that is killed leaves all lines but perhaps the last.
#[derive(Debug)]
pub(super) struct Log {
    path: PathBuf,
    /// `None` before the first line.
    file: Option<File>,
}

impl Log {
    /// The log of a recording: that of taps.wav is taps.listen.jsonl. An earlier one goes on.
    pub(super) fn beside(recording: &Path) -> Self {
        Self {
            path: recording.with_extension("listen.jsonl"),
            file: None,
        }
    }

    /// Notes a line.
    ///
    /// # Errors
    /// The disk refuses.
    pub(super) fn note(&mut self, line: &Value) -> anyhow::Result<()> {
        let written = self.write(&format!("{line}\n"));
        written.with_context(|| format!("{}: could not be written", self.path.display()))
    }

    fn write(&mut self, line: &str) -> io::Result<()> {
        let file = match &mut self.file {
            Some(file) => file,
            None => {
                let opened = File::options().create(true).append(true).open(&self.path)?;
                self.file.insert(opened)
            }
        };
        file.write_all(line.as_bytes())
    }
}

/// Returns the line of what was reported once so many seconds were heard: times in s, frequencies in Hz, the rest as the
/// report has it.
pub(super) fn line_of(heard: f64, news: &News) -> Value {
    match news {
        News::Tap(tap) => tap_line(heard, "tap", tap),
        News::Revised(tap) => tap_line(heard, "revised", tap),
        News::Gone { time } => json!({ "heard": heard, "news": "gone", "time": time }),
        News::Doubt(text) => json!({ "heard": heard, "news": "doubt", "text": text }),
    }
}

fn tap_line(heard: f64, news: &str, tap: &JudgedTap) -> Value {
    json!({
        "heard": heard,
        "news": news,
        "time": tap.time,
        "accepted": tap.rejection.is_none(),
        "reason": tap.rejection.as_ref().map(ToString::to_string),
        "overruled": tap.overruled.as_ref().map(ToString::to_string),
        "peak": tap.peak,
        "unit": tap.unit,
        "pulse_width": tap.pulse.map(|pulse| pulse.width),
        "usable_to": tap.pulse.map(|pulse| pulse.usable_to),
        "seconds": tap.seconds,
        "remaining": tap.remaining,
    })
}

/// Returns the line of a decision by hand on the tap at this time (s): `what` is "accept", "reject" or "undo".
pub(super) fn line_by_hand(heard: f64, what: &str, time: Option<f64>) -> Value {
    json!({ "heard": heard, "news": "by-hand", "decision": what, "time": time })
}
