//! Doubts about a recording, each once.

use super::Listener;
use crate::news::News;
use std::mem::discriminant;
use tapjoint_analysis::TapsSoFar;
use tapjoint_signal::taps::{TapRemark, TapSource};

impl Listener<'_> {
    /// Returns a doubt where the responses rise and the hammer shows nothing.
    pub(super) fn silent_hammer(&mut self, now: u64) -> Vec<News> {
        // A hammer that has struck is connected, and rests at 0 between taps.
        if !self.reported.is_empty() {
            return Vec::new();
        }
        let source = self.latest.as_ref().map(|found| &found.source);
        let Some(TapSource::Hammer { channel, responses }) = source else {
            return Vec::new();
        };
        let swings = responses.iter().map(|response| self.swings[*response]);
        let rises = self.answers.hears(&swings.collect::<Vec<_>>());
        if !rises || !self.silence.rises_without(*channel) {
            return Vec::new();
        }
        let number = channel + 1;
        let time = self.start() + now as f64 / self.growing.sample_rate();
        vec![News::Doubt(format!(
            "hammer (channel {number}): no sample changes while the structure answers, last at {time:.1} s. Check its cable and \
             the number of its channel, or do not knock beside it."
        ))]
    }

    /// Returns a doubt for each response that stands still since the last tap.
    pub(super) fn still_responses(&mut self) -> Vec<News> {
        let Some(found) = &self.latest else {
            return Vec::new();
        };
        let (TapSource::Hammer { responses, .. } | TapSource::Responses(responses)) = &found.source;
        let mut news = Vec::new();
        for channel in self.silence.still(responses) {
            let name = found.names.iter().find(|(other, _)| *other == channel);
            let name = name.map_or("", |(_, name)| name);
            news.push(News::Doubt(format!(
                "{name} (channel {}): no sample has changed since the last tap. Check the sensor and its cable.",
                channel + 1
            )));
        }
        news
    }

    /// Returns the doubts about a recording, its channels in use and its taps of a kind that was not reported yet.
    pub(super) fn new_doubts(&mut self, found: &TapsSoFar, is_growing: bool) -> Vec<News> {
        let mut news = Vec::new();
        let recording = &found.recording;
        let parts = recording.parts().map(|(_, part)| part.warnings());
        for warning in recording.warnings().into_iter().chain(parts.flatten()) {
            let is_used = |channel| found.names.iter().any(|(used, _)| used + 1 == channel);
            if !warning.channel().is_none_or(is_used) {
                continue;
            }
            // Its numbers move from look to look.
            let kind = (warning.code(), warning.channel());
            if !self.doubts.contains(&kind) {
                news.push(News::Doubt(warning.to_string()));
                self.doubts.push(kind);
            }
        }
        for remark in &found.taps.remarks {
            // What is missing so far may still come.
            let is_early = match remark {
                TapRemark::NoTapThere { time, .. } => *time > found.recording.duration(),
                TapRemark::FileWithoutTap { .. } | TapRemark::AllOverloaded { .. } => true,
                _ => false,
            };
            let is_held_back = is_growing && is_early;
            if !is_held_back && !self.remarks.iter().any(|other| is_same(remark, other)) {
                news.push(News::Doubt(remark.to_string()));
                self.remarks.push(remark.clone());
            }
        }
        news
    }
}

/// Returns true for two remarks about the same thing; their numbers move from look to look.
fn is_same(one: &TapRemark, other: &TapRemark) -> bool {
    match (one, other) {
        (TapRemark::NoTapThere { time, .. }, TapRemark::NoTapThere { time: other, .. })
        | (TapRemark::StillRejected { time, .. }, TapRemark::StillRejected { time: other, .. }) => {
            time == other
        }
        (TapRemark::FileWithoutTap { file }, TapRemark::FileWithoutTap { file: other }) => {
            file == other
        }
        _ => discriminant(one) == discriminant(other),
    }
}
