//! What the person at the bench sees, in whatever way it is shown.

use crate::listen::{JudgedTap, News, Precision};
use crate::taps::REACH;
use std::collections::VecDeque;

/// Doubts and warnings that are shown. The log has all doubts.
const MOST_NOTES: usize = 100;
/// Swings of a channel that are shown: 10 s of steps of 50 ms.
const MOST_SWINGS: usize = 200;

/// What is asked for by a key, or on the page.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    not(any(feature = "screen", feature = "serve")),
    expect(dead_code, reason = "lines ask for nothing")
)]
pub(super) enum Action {
    /// The tap at this time (s) is to count; `None` where none is there to be meant.
    Accept(Option<f64>),
    /// The tap at this time (s) is not to count, likewise.
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
#[derive(Debug, Clone, Default, PartialEq)]
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
    /// True where the taps that count have changed since the result.
    pub(super) is_result_old: bool,
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

impl Level {
    /// The swings in thousandths of the largest one.
    #[cfg_attr(
        not(any(feature = "screen", feature = "serve")),
        expect(dead_code, reason = "lines show no movement")
    )]
    pub(super) fn heights(&self) -> Vec<u64> {
        let swings = self.recent.iter().copied();
        let largest = swings.clone().fold(f64::MIN_POSITIVE, f64::max);
        swings
            .map(|swing| (1000.0 * swing / largest) as u64)
            .collect()
    }
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
    /// Taps that count by themselves.
    pub(super) accepted: usize,
    /// Those of them that do not agree with the others, by the last result.
    pub(super) apart: usize,
    /// Taps that are wanted at least.
    pub(super) wanted: usize,
    /// Time for which the recording has to go on for the last tap to count in the end (s).
    pub(super) missing: f64,
    /// The recording that can follow.
    pub(super) next: Option<&'a str>,
    /// Half width of the intervals that is wanted (1).
    pub(super) accuracy: Option<f64>,
    /// How narrow the intervals are; `None` where it is not known.
    pub(super) precision: Option<&'a Precision>,
    /// True where results are worked out before the end.
    pub(super) has_results: bool,
}

impl Progress<'_> {
    /// Returns whether the taps are enough, and says how many count and what is missing.
    pub(super) fn words(&self) -> (bool, String) {
        let mut count = match self.accepted {
            1 => "1 tap counts".to_owned(),
            count => format!("{count} taps count"),
        };
        match self.apart {
            0 => {}
            1 => count.push_str(", 1 of them does not agree with the others"),
            more => count.push_str(&format!(", {more} of them do not agree with the others")),
        }
        let (is_enough, why) = match (self.wanted + self.apart).saturating_sub(self.accepted) {
            0 if self.missing > 0.0 => (
                false,
                format!(
                    "do not end yet: the last record needs {:.0} s more",
                    self.missing.ceil()
                ),
            ),
            0 => self.why(),
            1 => (false, "1 more is wanted".to_owned()),
            missing => (false, format!("{missing} more are wanted")),
        };
        (is_enough, format!("{count}; {why}"))
    }

    /// The same where no tap is missing.
    fn why(&self) -> (bool, String) {
        let Some(accuracy) = self.accuracy else {
            let is_exhausted = self.precision.is_some_and(Precision::is_exhausted);
            let why = match is_exhausted {
                true => "enough, and the next tap would bring nothing",
                false => "enough",
            };
            return (true, why.to_owned());
        };
        let wanted = percent(accuracy);
        if !self.has_results {
            let why = format!("enough; the end shows whether {wanted} is reached");
            return (true, why);
        }
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
        let now = match precision.half_width {
            Some(half) => format!("{name} is known within {}", percent(half)),
            None => format!("the interval of {name} has no end"),
        };
        match precision.can_reach(accuracy) {
            true => (false, format!("go on: {now}, and {wanted} is wanted")),
            false => {
                let what = match self.next {
                    Some(next) => format!("go on with {next}"),
                    None => "the report says what does".to_owned(),
                };
                let why = format!("more taps do not help: {now}, and {wanted} is wanted; {what}");
                (false, why)
            }
        }
    }
}

/// Says how narrow the intervals are, and what the next tap brings.
pub(super) fn precision_words(precision: &Precision) -> String {
    let name = &precision.widest;
    let gain = match precision.gain {
        _ if precision.is_exhausted() => "; the next tap would bring nothing".to_owned(),
        Some(gain) => format!("; the next tap makes it about {} narrower", percent(gain)),
        None => String::new(),
    };
    match precision.half_width {
        Some(half) => format!("least certain: {name}, within {}{gain}", percent(half)),
        None => format!("least certain: {name}, whose interval has no end"),
    }
}

/// "2.3 %".
fn percent(share: f64) -> String {
    format!(
        "{}\u{a0}%",
        crate::report::format::significant(100.0 * share, 2)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::document::{
        BudgetRow, Document, EstimateSection, EstimatedValue, Uncertain,
    };

    /// Kt of a test with so many readings and so much else (%), by ten taps.
    fn precision(readings: f64, rest: f64, has_end: bool) -> Precision {
        let std = f64::hypot(readings, rest) / 100.0;
        let row = |input: &str, std_percent| BudgetRow {
            input: input.to_owned(),
            std_percent,
        };
        let mut uncertain = Uncertain::symmetric(1e6, Some(1e6 * std));
        uncertain.high = uncertain.high.filter(|_| has_end);
        let document = Document {
            estimate: Some(Some(EstimateSection {
                kt: Some(EstimatedValue {
                    uncertain,
                    budget: vec![row("readings", readings), row("modulus", rest)],
                    ..EstimatedValue::default()
                }),
                ..EstimateSection::default()
            })),
            ..Document::default()
        };
        Precision::of(&document, 10).unwrap()
    }

    #[test]
    fn regress_words_of_the_advice() {
        let with_all = |accepted, apart, missing, next, accuracy, precision: Option<Precision>| {
            let progress = Progress {
                accepted,
                apart,
                wanted: 3,
                missing,
                next,
                has_results: true,
                accuracy,
                precision: precision.as_ref(),
            };
            let (is_enough, words) = progress.words();
            format!("{is_enough}: {words}")
        };
        let words =
            |accepted, accuracy, precision| with_all(accepted, 0, 0.0, None, accuracy, precision);
        let next = Some("high.wav");
        let scattered = || precision(1.6, 0.1, true);
        let stuck = || precision(0.1, 1.6, true);
        let open = || precision(0.1, 1.6, false);
        let all = [
            words(0, None, None),
            words(1, None, Some(scattered())),
            words(2, Some(0.05), Some(scattered())),
            words(3, None, None),
            words(3, None, Some(scattered())),
            words(4, None, Some(stuck())),
            words(4, Some(0.05), None),
            words(4, Some(0.05), Some(scattered())),
            words(4, Some(0.01), Some(scattered())),
            words(4, Some(0.01), Some(stuck())),
            words(4, Some(0.01), Some(open())),
            with_all(2, 1, 0.0, None, None, None),
            with_all(4, 2, 0.0, None, None, None),
            with_all(4, 0, 2.34, None, None, None),
            with_all(2, 0, 2.34, None, None, None),
            with_all(4, 0, 0.0, next, Some(0.01), Some(stuck())),
            precision_words(&scattered()),
            precision_words(&stuck()),
            precision_words(&open()),
        ];
        let without_results = Progress {
            accepted: 4,
            apart: 0,
            wanted: 3,
            missing: 0.0,
            next: None,
            accuracy: Some(0.05),
            precision: None,
            has_results: false,
        };
        assert_eq!(
            without_results.words().1.replace('\u{a0}', " "),
            "4 taps count; enough; the end shows whether 5.0 % is reached"
        );
        assert_eq!(
            all.join("\n").replace('\u{a0}', " "),
            "false: 0 taps count; 3 more are wanted\n\
             false: 1 tap counts; 2 more are wanted\n\
             false: 2 taps count; 1 more is wanted\n\
             true: 3 taps count; enough\n\
             true: 3 taps count; enough\n\
             true: 4 taps count; enough, and the next tap would bring nothing\n\
             false: 4 taps count; go on: no interval is known yet, and 5.0 % is wanted\n\
             true: 4 taps count; enough: every interval is within 5.0 %\n\
             false: 4 taps count; go on: Kt is known within 3.1 %, and 1.0 % is wanted\n\
             false: 4 taps count; more taps do not help: Kt is known within 3.1 %, and 1.0 % is wanted; the report says what \
             does\n\
             false: 4 taps count; more taps do not help: the interval of Kt has no end, and 1.0 % is wanted; the report says \
             what does\n\
             false: 2 taps count, 1 of them does not agree with the others; 2 more are wanted\n\
             false: 4 taps count, 2 of them do not agree with the others; 1 more is wanted\n\
             false: 4 taps count; do not end yet: the last record needs 3 s more\n\
             false: 2 taps count; 1 more is wanted\n\
             false: 4 taps count; more taps do not help: Kt is known within 3.1 %, and 1.0 % is wanted; go on with high.wav\n\
             least certain: Kt, within 3.1 %; the next tap makes it about 4.6 % narrower\n\
             least certain: Kt, within 3.1 %; the next tap would bring nothing\n\
             least certain: Kt, whose interval has no end"
        );
    }
}
