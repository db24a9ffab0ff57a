//! What the person at the bench sees, in whatever way it is shown.

use crate::listen::{JudgedTap, News, Precision};
use crate::taps::REACH;
use std::collections::VecDeque;

/// Doubts that are shown. The log has all.
const MOST_NOTES: usize = 100;
/// Swings of a channel that are shown: 10 s of steps of 50 ms.
const MOST_SWINGS: usize = 200;

/// What is asked for by a key, or on the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Action {
    /// The tap at this time (s) is to count; `None` = the last one.
    Accept(Option<f64>),
    /// The tap at this time (s) is not to count; `None` = the last one.
    Reject(Option<f64>),
    /// Take the last decision back.
    Undo,
    /// Go on with the next recording of the description.
    Next,
    /// End the recording.
    Stop,
}

/// How strongly a channel moves.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Level {
    /// Name of the sensor.
    pub(super) name: String,
    /// Swings of the last steps of 50 ms, the newest last (unit of the file).
    pub(super) recent: VecDeque<f64>,
}

/// One recording as it is shown.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Bench {
    /// "recording low.wav, tap at 0.385 m".
    pub(super) title: String,
    /// Address of the page; `None` where none is served.
    pub(super) address: Option<String>,
    /// Length of what was heard (s).
    pub(super) seconds: f64,
    /// The taps so far, by their last decisions, in order of time.
    pub(super) taps: Vec<JudgedTap>,
    /// The channels, the hammer first.
    pub(super) levels: Vec<Level>,
    /// How many taps count, and what is missing.
    pub(super) advice: String,
    /// True once the taps are enough.
    pub(super) is_enough: bool,
    /// What all taps give so far, in sentences.
    pub(super) result: Vec<String>,
    /// How narrow the intervals are; empty where there are none.
    pub(super) precision: String,
    /// The first screen of the report on them; `None` where no page is served.
    pub(super) first_screen: Option<String>,
    /// Doubts and warnings, the newest last.
    pub(super) notes: VecDeque<String>,
    /// The recording that the key for it begins: "high.wav, tap at 0.4 m".
    pub(super) next: Option<String>,
    /// What became of it, once it has ended.
    pub(super) ended: Option<String>,
}

impl Bench {
    /// Takes what is new.
    pub(super) fn take(&mut self, news: &News) {
        match news {
            News::Tap(tap) | News::Revised(tap) => {
                self.forget(tap.time);
                let place = self.taps.partition_point(|other| other.time < tap.time);
                self.taps.insert(place, tap.clone());
            }
            News::Gone { time } => self.forget(*time),
            News::Doubt(text) => self.note(text),
        }
    }

    fn forget(&mut self, time: f64) {
        self.taps.retain(|other| (other.time - time).abs() > REACH);
    }

    /// Notes a doubt or warning.
    pub(super) fn note(&mut self, text: &str) {
        self.notes.push_back(text.to_owned());
        if self.notes.len() > MOST_NOTES {
            self.notes.pop_front();
        }
    }

    /// Takes how strongly the channels move, where something more was heard.
    pub(super) fn hear(&mut self, seconds: f64, levels: &[(&str, f64)]) {
        if seconds == self.seconds {
            return;
        }
        self.seconds = seconds;
        self.levels.resize_with(levels.len(), Level::default);
        for (level, (name, swing)) in self.levels.iter_mut().zip(levels) {
            level.name = (*name).to_owned();
            level.recent.push_back(*swing);
            if level.recent.len() > MOST_SWINGS {
                level.recent.pop_front();
            }
        }
    }
}

/// Whether the taps are enough, and why.
pub(super) struct Progress<'a> {
    /// Taps that count.
    pub(super) accepted: usize,
    /// Taps that are wanted at least.
    pub(super) wanted: usize,
    /// Half width of the intervals that is wanted (1).
    pub(super) accuracy: Option<f64>,
    /// How narrow the intervals are; `None` where it is not known.
    pub(super) precision: Option<&'a Precision>,
}

impl Progress<'_> {
    /// Returns whether the taps are enough, and says how many count and what is missing.
    pub(super) fn words(&self) -> (bool, String) {
        let count = match self.accepted {
            1 => "1 tap counts".to_owned(),
            count => format!("{count} taps count"),
        };
        let (is_enough, why) = match self.wanted.saturating_sub(self.accepted) {
            0 => self.why(),
            1 => (false, "1 more is wanted".to_owned()),
            missing => (false, format!("{missing} more are wanted")),
        };
        (is_enough, format!("{count}; {why}"))
    }

    /// The same where no tap is missing.
    fn why(&self) -> (bool, String) {
        let brings_nothing = self.precision.filter(|precision| precision.is_exhausted());
        let Some(accuracy) = self.accuracy else {
            let why = match brings_nothing {
                Some(_) => "enough, and the next tap would bring nothing",
                None => "enough",
            };
            return (true, why.to_owned());
        };
        let wanted = percent(accuracy);
        let Some(precision) = self.precision else {
            return (
                false,
                format!("go on: no interval is known yet, and {wanted} is wanted"),
            );
        };
        if precision.reaches(accuracy) {
            return (true, format!("enough: every interval is within {wanted}"));
        }
        let name = &precision.widest;
        match (precision.half_width.map(percent), brings_nothing) {
            (Some(half), Some(_)) => (
                true,
                format!(
                    "enough: the next tap would bring nothing. {name} stays within {half} and not {wanted}; the report says what \
                     makes it narrower"
                ),
            ),
            (Some(half), None) => (
                false,
                format!("go on: {name} is known within {half}, and {wanted} is wanted"),
            ),
            (None, _) => (
                false,
                format!("go on: the interval of {name} has no end yet, and {wanted} is wanted"),
            ),
        }
    }
}

/// Says how narrow the intervals are.
pub(super) fn precision_words(precision: &Precision) -> String {
    let name = &precision.widest;
    let gain = match precision.is_exhausted() {
        true => "; the next tap would bring nothing".to_owned(),
        false => format!(
            "; the next tap makes it at most {} narrower",
            percent(precision.gain)
        ),
    };
    match precision.half_width {
        Some(half) => format!("least certain: {name}, within {}{gain}", percent(half)),
        None => format!("least certain: {name}, whose interval has no end"),
    }
}

/// "2.3 %".
fn percent(share: f64) -> String {
    format!("{} %", crate::report::format::significant(100.0 * share, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn precision(half_width: Option<f64>, gain: f64) -> Precision {
        Precision {
            widest: "Kr".to_owned(),
            half_width,
            gain,
        }
    }

    #[test]
    fn regress_words_of_the_advice() {
        let words = |accepted, accuracy, precision: Option<Precision>| {
            let progress = Progress {
                accepted,
                wanted: 3,
                accuracy,
                precision: precision.as_ref(),
            };
            let (is_enough, words) = progress.words();
            format!("{is_enough}: {words}")
        };
        let wide = || Some(precision(Some(0.0312), 0.06));
        let stuck = || Some(precision(Some(0.0312), 0.002));
        let all = [
            words(0, None, None),
            words(1, None, wide()),
            words(2, Some(0.05), wide()),
            words(3, None, None),
            words(3, None, wide()),
            words(4, None, stuck()),
            words(4, Some(0.05), None),
            words(4, Some(0.05), wide()),
            words(4, Some(0.01), wide()),
            words(4, Some(0.01), stuck()),
            words(4, Some(0.01), Some(precision(None, 0.1))),
            precision_words(&precision(Some(0.0312), 0.06)),
            precision_words(&precision(Some(0.0312), 0.002)),
            precision_words(&precision(None, 0.06)),
        ];
        assert_eq!(
            all.join("\n"),
            "false: 0 taps count; 3 more are wanted\n\
             false: 1 tap counts; 2 more are wanted\n\
             false: 2 taps count; 1 more is wanted\n\
             true: 3 taps count; enough\n\
             true: 3 taps count; enough\n\
             true: 4 taps count; enough, and the next tap would bring nothing\n\
             false: 4 taps count; go on: no interval is known yet, and 5.0 % is wanted\n\
             true: 4 taps count; enough: every interval is within 5.0 %\n\
             false: 4 taps count; go on: Kr is known within 3.1 %, and 1.0 % is wanted\n\
             true: 4 taps count; enough: the next tap would bring nothing. Kr stays within 3.1 % and not 1.0 %; the report \
             says what makes it narrower\n\
             false: 4 taps count; go on: the interval of Kr has no end yet, and 1.0 % is wanted\n\
             least certain: Kr, within 3.1 %; the next tap makes it at most 6.0 % narrower\n\
             least certain: Kr, within 3.1 %; the next tap would bring nothing\n\
             least certain: Kr, whose interval has no end"
        );
    }
}
