//! What a listener reports, and its words.

use std::fmt;
use tapjoint_report::format::significant;
use tapjoint_signal::spectral::RUNG_DOWN;
use tapjoint_signal::taps::{Pulse, Rejection};

/// Digits of a number: who taps wants a glance.
const DIGITS: i32 = 3;

/// One tap as it was judged.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedTap {
    /// Time of its trigger (s from the start of the recording; files follow one another).
    pub time: f64,
    /// Peak of the force (N), or of the response on which it was found (its unit).
    pub peak: f64,
    /// Unit of the peak; `None` where it is not known.
    pub unit: Option<String>,
    /// Its force pulse; `None` without a hammer.
    pub pulse: Option<Pulse>,
    /// True where the sample rate limits the band that it excites, and not the pulse.
    pub excites_all: bool,
    /// Length of its record so far (s).
    pub seconds: f64,
    /// True where the next tap, or the end of the recording, has ended its record.
    pub has_ended: bool,
    /// Amplitude at the end of its record over the largest one (1), of the response that keeps most. `None` of a tap that is
    /// rejected, or sinks into the noise.
    pub remaining: Option<f64>,
    /// Why it does not count; `None` = it counts.
    pub rejection: Option<Rejection>,
    /// Why it would not have counted, had it not been accepted by hand.
    pub overruled: Option<Rejection>,
    /// What can be done against the fault.
    pub remedy: Option<&'static str>,
}

/// Something that a listener reports.
#[derive(Debug, Clone, PartialEq)]
pub enum News {
    /// A tap was judged for the first time.
    Tap(JudgedTap),
    /// Later samples change the decision on a tap.
    Revised(JudgedTap),
    /// What was reported as a tap is none, as later samples show.
    Gone {
        /// Its time (s).
        time: f64,
    },
    /// A doubt about the recording.
    Doubt(String),
}

impl fmt::Display for JudgedTap {
    /// Writes "accepted: peak 18.2 N, pulse 1.21 ms, excites up to 830 Hz, decays to 0.4 % in 5.0 s".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(rejection) = &self.rejection {
            write!(f, "REJECTED: {rejection}")?;
            return self.remedy.map_or(Ok(()), |remedy| write!(f, ". {remedy}"));
        }
        f.write_str("accepted")?;
        if let Some(fault) = &self.overruled {
            write!(f, " by hand in spite of a fault: {fault}")?;
        }
        write!(f, ": peak {}", significant(self.peak, DIGITS))?;
        if let Some(unit) = &self.unit {
            write!(f, " {unit}")?;
        }
        if let Some(pulse) = &self.pulse {
            let (width, end) = (1e3 * pulse.width, pulse.usable_to);
            let (width, end) = (significant(width, DIGITS), significant(end, DIGITS));
            match self.excites_all {
                true => write!(f, ", pulse {width} ms, excites the whole band ({end} Hz)")?,
                false => write!(f, ", pulse {width} ms, excites up to {end} Hz")?,
            }
        }
        let Some(remaining) = self.remaining else {
            return Ok(());
        };
        let (percent, seconds) = (significant(100.0 * remaining, 2), self.seconds);
        if !self.has_ended {
            return write!(f, ", still {percent} % after {seconds:.1} s");
        }
        write!(f, ", decays to {percent} % in {seconds:.1} s")?;
        match remaining > RUNG_DOWN {
            true => f.write_str(". Wait longer before the next tap."),
            false => Ok(()),
        }
    }
}

impl fmt::Display for News {
    /// Writes one or two sentences.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            News::Tap(tap) => write!(f, "tap at {:.2} s {tap}", tap.time),
            News::Revised(tap) => write!(f, "tap at {:.2} s is now {tap}", tap.time),
            News::Gone { time } => write!(
                f,
                "tap at {time:.2} s withdrawn: later samples show that it was none"
            ),
            News::Doubt(text) => write!(f, "doubt: {text}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged() -> JudgedTap {
        JudgedTap {
            time: 4.9051,
            peak: 18.24,
            unit: Some("N".to_owned()),
            pulse: Some(Pulse {
                width: 1.2149e-3,
                fall_10_db: None,
                fall_20_db: None,
                usable_to: 832.0,
            }),
            excites_all: false,
            seconds: 4.96,
            has_ended: true,
            remaining: Some(0.0042),
            rejection: None,
            overruled: None,
            remedy: None,
        }
    }

    #[test]
    fn regress_words_of_the_news() {
        let double = Rejection::DoubleHit {
            delay: 0.0312,
            ratio: 0.341,
            limit: 0.1,
        };
        let rejected = JudgedTap {
            rejection: Some(double.clone()),
            remedy: Some("Hit shorter."),
            ..judged()
        };
        let by_hand = JudgedTap {
            overruled: Some(double),
            pulse: None,
            unit: None,
            remaining: None,
            ..judged()
        };
        let ringing = JudgedTap {
            remaining: Some(0.1234),
            ..judged()
        };
        let whole = JudgedTap {
            excites_all: true,
            remaining: None,
            ..judged()
        };
        let going_on = JudgedTap {
            has_ended: false,
            ..ringing.clone()
        };
        let words = [
            News::Tap(judged()),
            News::Tap(whole),
            News::Tap(ringing),
            News::Tap(going_on),
            News::Tap(rejected.clone()),
            News::Revised(rejected),
            News::Revised(by_hand),
            News::Gone { time: 4.9051 },
            News::Doubt("channel 2: every sample is 0".to_owned()),
        ];
        let words = words.map(|news| news.to_string()).join("\n");
        assert_eq!(
            words,
            "tap at 4.91 s accepted: peak 18.2 N, pulse 1.21 ms, excites up to 832 Hz, decays to 0.42 % in 5.0 s\n\
             tap at 4.91 s accepted: peak 18.2 N, pulse 1.21 ms, excites the whole band (832 Hz)\n\
             tap at 4.91 s accepted: peak 18.2 N, pulse 1.21 ms, excites up to 832 Hz, decays to 12 % in 5.0 s. Wait \
             longer before the next tap.\n\
             tap at 4.91 s accepted: peak 18.2 N, pulse 1.21 ms, excites up to 832 Hz, still 12 % after 5.0 s\n\
             tap at 4.91 s REJECTED: double hit: a second excursion of 34 % after 31.2 ms (limit 10 %). Hit shorter.\n\
             tap at 4.91 s is now REJECTED: double hit: a second excursion of 34 % after 31.2 ms (limit 10 %). Hit \
             shorter.\n\
             tap at 4.91 s is now accepted by hand in spite of a fault: double hit: a second excursion of 34 % after 31.2 \
             ms (limit 10 %): peak 18.2\n\
             tap at 4.91 s withdrawn: later samples show that it was none\n\
             doubt: channel 2: every sample is 0"
        );
    }
}
