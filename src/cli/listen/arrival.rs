//! Whether samples arrive as fast as the stated rate says.

use std::collections::VecDeque;
use std::time::Duration;

/// Pieces before this time (s) may hold what a recorder has kept. 2 s: no usual buffer is longer.
const BACKLOG: f64 = 2.0;
/// The rate is judged each time after so long (s). 10 s: a tap or two, and a recorder's buffer of 0.1 s is then 1 %.
const JUDGED_EACH: f64 = 10.0;
/// A rate that is off by less is that of the stated clock (1). 2 %: usual rates lie 2.4 % apart at least, and the clocks of two
/// devices differ by far less.
const RATE_TOLERANCE: f64 = 0.02;
/// What arrives this much faster than stated is a file, and no clock drives it. 8: beyond any pair of usual rates by mistake.
const FILE_SPEED: f64 = 8.0;
/// Samples that are missing for less than this are in a buffer (s). 0.5 s: beyond what recorders hold back.
const LEAST_LOSS: f64 = 0.5;
/// A loss is measured against the best state within this time (s). 60 s: a clock that is off by less than 0.8 % is then no loss.
const WITHIN: f64 = 60.0;
/// A loss has to last so long (s), or the samples are only late.
const LATE: f64 = 5.0;

/// Usual rates (Hz), of sound and of vibration.
const USUAL_RATES: [f64; 31] = [
    1000.0, 1024.0, 2000.0, 2048.0, 2560.0, 4096.0, 5120.0, 8000.0, 8192.0, 10_000.0, 10_240.0,
    11_025.0, 12_000.0, 12_800.0, 16_000.0, 20_000.0, 20_480.0, 22_050.0, 24_000.0, 25_000.0,
    25_600.0, 32_000.0, 44_100.0, 48_000.0, 50_000.0, 51_200.0, 65_536.0, 96_000.0, 100_000.0,
    102_400.0, 192_000.0,
];
/// A measured rate this near to a usual one is taken for it (1). 1 %: less than half of the least distance.
const NEAR_USUAL: f64 = 0.01;

/// What the arrival of a stream shows, in sentences.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shown {
    /// Samples come at another rate than stated.
    WrongRate(String),
    /// Samples come at the stated rate after all.
    RightRate(String),
    /// Samples are missing.
    Loss(String),
}

/// A stretch of the stream.
#[derive(Debug, Clone)]
struct Window {
    /// Its beginning since the first piece (s).
    start: f64,
    /// Frames at its beginning.
    frames: f64,
    /// Longest time between two of its pieces (s).
    longest_gap: f64,
    /// Time at which it is judged (s).
    next: f64,
}

/// Watches the arrival of a stream.
#[derive(Debug, Clone)]
pub(super) struct Arrival {
    /// Samples a second in each channel, as stated.
    rate: f64,
    /// Time of the first piece, and of the last one (s).
    times: Option<(f64, f64)>,
    /// Frames after the first piece.
    frames: f64,
    /// The stretch by which the rate is judged; `None` before it begins.
    window: Option<Window>,
    /// Times of the last minute, a second apart at least, and how far samples were behind the clock then (s).
    behind: VecDeque<[f64; 2]>,
    /// Time since which more of them are behind (s).
    behind_since: Option<f64>,
    verdict: Verdict,
}

/// What is known of the rate.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Verdict {
    /// It is not known yet. A wrong rate looks like a loss.
    Open,
    Right,
    /// Losses cannot be told.
    Wrong,
    /// No clock drives the stream.
    File,
}

impl Arrival {
    pub(super) fn new(rate: f64) -> Self {
        Self {
            rate,
            times: None,
            frames: 0.0,
            window: None,
            behind: VecDeque::new(),
            behind_since: None,
            verdict: Verdict::Open,
        }
    }

    /// Takes the arrival of so many frames at this time. Returns what is new.
    pub(super) fn takes(&mut self, now: Duration, frames: f64) -> Option<Shown> {
        let now = now.as_secs_f64();
        let Some((first, last)) = &mut self.times else {
            self.times = Some((now, now));
            return None;
        };
        self.frames += frames;
        let (elapsed, gap) = (now - *first, now - *last);
        *last = now;
        if elapsed < BACKLOG || self.verdict == Verdict::File {
            return None;
        }
        // A window begins with what a pause before it has held back.
        let Some(window) = &mut self.window else {
            self.window = Some(Window {
                start: elapsed,
                frames: self.frames,
                longest_gap: 0.0,
                // The first time so that ten seconds of a recording are enough.
                next: match self.verdict {
                    Verdict::Open => JUDGED_EACH,
                    _ => elapsed + JUDGED_EACH,
                },
            });
            return None;
        };
        window.longest_gap = window.longest_gap.max(gap);
        if elapsed >= window.next {
            window.next = elapsed + JUDGED_EACH;
            return self.judge_rate(elapsed);
        }
        match self.verdict {
            Verdict::Wrong => None,
            _ => self.judge_loss(elapsed),
        }
    }

    /// Judges the rate by what came in the window. A rate that was right once stays so: what is missing later is lost.
    fn judge_rate(&mut self, elapsed: f64) -> Option<Shown> {
        let window = self.window.as_ref()?;
        let seconds = elapsed - window.start;
        let speed = (self.frames - window.frames) / seconds / self.rate;
        // A piece may hold the samples of the pause before it, at either end of the window.
        let uncertain = window.longest_gap / seconds;
        let off = (speed - 1.0).abs();
        let now = match off {
            _ if speed > FILE_SPEED => Verdict::File,
            off if off > RATE_TOLERANCE + uncertain => Verdict::Wrong,
            off if off <= RATE_TOLERANCE - uncertain => Verdict::Right,
            // A longer window decides.
            _ => return None,
        };
        let before = self.verdict;
        if before == Verdict::Right {
            return None;
        }
        (self.verdict, self.window) = (now, None);
        match (before, now) {
            (Verdict::Open, Verdict::Wrong) => {}
            (Verdict::Wrong, Verdict::Right) => {
                self.behind.clear();
                self.behind_since = None;
                let text = "samples arrive at the stated rate now. Earlier ones did not";
                return Some(Shown::RightRate(text.to_owned()));
            }
            _ => return None,
        }
        let (found, stated) = (speed * self.rate, self.rate);
        let is_near = |usual: &&f64| (found / *usual - 1.0).abs() <= NEAR_USUAL;
        let (likely, rate) = match USUAL_RATES.iter().find(is_near) {
            Some(usual) => (*usual, format!("the rate {usual:.0} Hz")),
            None => (found, "the recorder's rate".to_owned()),
        };
        let (word, factor) = match stated > likely {
            true => ("high", stated / likely),
            false => ("low", likely / stated),
        };
        Some(Shown::WrongRate(format!(
            "{found:.0} samples a second arrive, and {stated:.0} Hz is stated. Every frequency would be too {word} by a factor of \
             {factor:.3}. Remove the file, and record it again with {rate}. If {stated:.0} Hz is right, the recorder loses samples, or \
             the number of channels or the sample format is wrong"
        )))
    }

    fn judge_loss(&mut self, elapsed: f64) -> Option<Shown> {
        let behind = elapsed - self.frames / self.rate;
        self.behind.retain(|[then, _]| *then > elapsed - WITHIN);
        let earlier = self.behind.iter().map(|[_, behind]| *behind);
        let least = earlier.fold(behind, f64::min);
        if self
            .behind
            .back()
            .is_none_or(|[then, _]| elapsed - then >= 1.0)
        {
            self.behind.push_back([elapsed, behind]);
        }
        let lost = behind - least;
        if lost <= LEAST_LOSS {
            self.behind_since = None;
            return None;
        }
        let since = *self.behind_since.get_or_insert(elapsed);
        if elapsed - since < LATE || self.verdict != Verdict::Right {
            return None;
        }
        self.behind_since = None;
        self.behind.clear();
        Some(Shown::Loss(format!(
            "{lost:.1} s of samples are missing within the last minute: the recorder drops them. The taps of this minute may be \
             wrong"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(shown: Shown) -> String {
        match shown {
            Shown::WrongRate(text) | Shown::RightRate(text) | Shown::Loss(text) => text,
        }
    }

    /// What is said of pieces of `piece` seconds of samples that come at `speed` of the stated rate. The pieces from
    /// `lost` on, given in seconds, do not come.
    fn said(speed: f64, piece: f64, seconds: f64, lost: std::ops::Range<f64>) -> Vec<String> {
        let mut arrival = Arrival::new(1000.0);
        let pieces = (seconds / piece) as usize;
        let said = (1..=pieces).filter_map(|number| {
            let now = number as f64 * piece;
            let is_lost = lost.contains(&now);
            let frames = 1000.0 * piece * speed;
            (!is_lost).then(|| arrival.takes(Duration::from_secs_f64(now), frames))?
        });
        said.map(words).collect()
    }

    #[test]
    fn limit_a_true_rate_is_not_doubted() {
        for piece in [0.01, 0.1, 1.0, 2.5] {
            assert_eq!(said(1.0, piece, 3600.0, 0.0..0.0), [""; 0], "{piece}");
            assert_eq!(said(1.005, piece, 3600.0, 0.0..0.0), [""; 0], "{piece}");
            assert_eq!(said(0.995, piece, 3600.0, 0.0..0.0), [""; 0], "{piece}");
        }
        // A file that is piped.
        assert_eq!(said(200.0, 0.01, 60.0, 0.0..0.0), [""; 0]);
    }

    #[test]
    fn recover_a_wrong_rate_and_a_loss() {
        let wrong = |found: &str, factor: &str, rate: &str| {
            format!(
                "{found} samples a second arrive, and 1000 Hz is stated. Every frequency would be too {factor}. Remove the file, and \
                 record it again with {rate}. If 1000 Hz is right, the recorder loses samples, or the number of channels or the \
                 sample format is wrong"
            )
        };
        let slow = wrong("919", "high by a factor of 1.088", "the recorder's rate");
        assert_eq!(said(0.919, 0.1, 60.0, 0.0..0.0), [slow]);
        // The nearest two of the usual rates.
        let near = said(1024.0 / 1000.0, 0.1, 120.0, 0.0..0.0);
        assert_eq!(
            near,
            [wrong(
                "1024",
                "low by a factor of 1.024",
                "the rate 1024 Hz"
            )]
        );
        assert_eq!(said(1000.0 / 1024.0, 0.1, 120.0, 0.0..0.0).len(), 1);
        // Near a usual rate.
        let twice = wrong("2010", "low by a factor of 2.000", "the rate 2000 Hz");
        assert_eq!(said(2.01, 0.1, 60.0, 0.0..0.0), [twice]);
        // Half of the channels that are stated, in pieces as long as the time after which it is judged.
        let half = wrong("500", "high by a factor of 2.000", "the recorder's rate");
        assert_eq!(said(0.5, 0.1, 60.0, 0.0..0.0), std::slice::from_ref(&half));
        assert_eq!(said(0.5, 11.0, 120.0, 0.0..0.0), [half]);
        // A pause at the beginning.
        let paused = said(0.919, 0.1, 60.0, 0.3..3.3);
        assert_eq!(paused.len(), 1, "{paused:?}");
        // Soon, or after an hour.
        for lost in [29.95, 3599.95] {
            assert_eq!(
                said(1.0, 0.1, 3700.0, lost..lost + 1.5),
                [
                    "1.5 s of samples are missing within the last minute: the recorder drops them. The taps of this minute may \
                  be wrong"
                ]
            );
        }
    }

    #[test]
    fn limit_a_backlog_at_the_beginning_is_no_wrong_rate() {
        let mut arrival = Arrival::new(1000.0);
        for piece in 0..600 {
            let now = f64::from(piece) * 0.1;
            // A recorder that has kept 1 s, and gives it with its second piece.
            let frames = if piece == 1 { 1100.0 } else { 100.0 };
            let now = Duration::from_secs_f64(now);
            assert_eq!(arrival.takes(now, frames), None, "{piece}");
        }
    }

    #[test]
    fn recover_a_rate_that_becomes_right() {
        let mut arrival = Arrival::new(1000.0);
        let mut said = Vec::new();
        for piece in 1..600 {
            let now = Duration::from_secs_f64(f64::from(piece) * 0.1);
            let frames = if piece < 150 { 80.0 } else { 100.0 };
            said.extend(arrival.takes(now, frames));
        }
        let kinds = said.iter().map(|shown| match shown {
            Shown::WrongRate(_) => "wrong",
            Shown::RightRate(_) => "right",
            Shown::Loss(_) => "loss",
        });
        assert_eq!(kinds.collect::<Vec<_>>(), ["wrong", "right"]);
    }

    #[test]
    fn limit_samples_that_come_late_are_not_lost() {
        let mut arrival = Arrival::new(1000.0);
        let mut takes = |now: f64, frames| arrival.takes(Duration::from_secs_f64(now), frames);
        for second in 0..30 {
            assert_eq!(takes(f64::from(second), 1000.0), None);
        }
        // Two seconds without a piece, and then all at once.
        assert_eq!(takes(32.0, 3000.0), None);
        for second in 33..60 {
            assert_eq!(takes(f64::from(second), 1000.0), None);
        }
    }
}
