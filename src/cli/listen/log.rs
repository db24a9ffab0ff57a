//! The log of the decisions, beside the recording: a line of JSON for each.

use crate::listen::{Hit, News};
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

    /// Notes what was told once so many seconds were heard.
    ///
    /// # Errors
    /// The disk refuses.
    pub(super) fn note(&mut self, heard: f64, news: &[News]) -> anyhow::Result<()> {
        for one in news {
            let written = self.write(&format!("{}\n", line(heard, one)));
            written.with_context(|| format!("{}: could not be written", self.path.display()))?;
        }
        Ok(())
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

/// Returns a line of the log: times in s, frequencies in Hz, the rest as the report has it.
fn line(heard: f64, news: &News) -> Value {
    let of_hit = |kind: &str, hit: &Hit| {
        json!({
            "heard": heard,
            "news": kind,
            "time": hit.time,
            "accepted": hit.rejection.is_none(),
            "reason": hit.rejection.as_ref().map(ToString::to_string),
            "overruled": hit.overruled.as_ref().map(ToString::to_string),
            "peak": hit.peak,
            "unit": hit.unit,
            "pulse_width": hit.pulse.map(|pulse| pulse.width),
            "usable_to": hit.pulse.map(|pulse| pulse.usable_to),
            "remaining": hit.remaining,
        })
    };
    match news {
        News::Hit(hit) => of_hit("hit", hit),
        News::Revised(hit) => of_hit("revised", hit),
        News::Gone { time } => json!({ "heard": heard, "news": "gone", "time": time }),
        News::Doubt(text) => json!({ "heard": heard, "news": "doubt", "text": text }),
    }
}
