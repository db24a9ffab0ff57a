//! Doubts about a recording, each once.

use super::Listener;
use crate::news::News;
use std::mem::discriminant;
use tapjoint_analysis::{TapsSoFar, hammer_doubt};
use tapjoint_signal::taps::{Rejection, TapRemark, TapSource};

/// Time without a tap after which that is said (s). 20 s: longer than an engineer who has started the recorder waits.
const NO_TAP: f64 = 20.0;
/// Taps after which the channels are doubted if they are rejected. 3: the first ones may be bad by themselves.
const FIRST_TAPS: usize = 3;
/// Share of double hits and of taps without an answer from which on the channels are doubted. 80 %: who taps badly also has
/// good taps.
const MIXED: f64 = 0.8;

impl Listener<'_> {
    /// Returns a doubt where the responses rise and the hammer shows nothing.
    pub(super) fn silent_hammer(&mut self, now: u64) -> Vec<News> {
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

    /// Returns a doubt, once, where no tap comes.
    pub(super) fn no_tap(&mut self) -> Option<News> {
        let is_quiet = self.reported.is_empty() && self.due.is_none();
        if self.is_silence_said || !is_quiet || self.seconds() < NO_TAP {
            return None;
        }
        self.is_silence_said = true;
        let whose = match self.latest.as_ref().map(|found| &found.source) {
            Some(TapSource::Hammer { channel, .. }) => {
                format!("the hammer's channel (number {})", channel + 1)
            }
            _ => "any channel".to_owned(),
        };
        Some(News::Doubt(format!(
            "no tap in the first {NO_TAP:.0} s on {whose}. If you have tapped, check the cables, the gain and the numbers of \
             the channels."
        )))
    }

    /// Returns a doubt, once, where most taps are rejected: channels may be mixed up.
    pub(super) fn mixed_channels(&mut self, found: &TapsSoFar) -> Option<News> {
        let taps = &found.taps;
        let total = taps.taps.len();
        if self.are_mixed || total < FIRST_TAPS.max(2 * self.checked_taps) {
            return None;
        }
        // The whole recording is read for it.
        self.checked_taps = total;
        let doubt = hammer_doubt(&found.recording, &found.source, taps);
        // Who has only double hits hits too long.
        let mut rejections = taps.taps.iter().map(|tap| &tap.rejection);
        let are_mixed = taps.odd() as f64 >= MIXED * total as f64
            && rejections.any(|why| *why == Some(Rejection::NoResponse));
        if doubt.is_none() && !are_mixed {
            return None;
        }
        self.are_mixed = true;
        Some(News::Doubt(doubt.unwrap_or_else(|| {
            "most taps are rejected. Check the number of channels, the sample format and the hammer's channel"
                .to_owned()
        })))
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
            // Its numbers move from look to look, and are said again at the end.
            let text = warning.to_string();
            let kind = (warning.code(), warning.channel());
            let earlier = self.doubts.iter_mut().find(|(other, _)| *other == kind);
            match earlier {
                None => self.doubts.push((kind, text.clone())),
                Some((_, said)) if !is_growing && *said != text => said.clone_from(&text),
                Some(_) => continue,
            }
            news.push(News::Doubt(text));
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
