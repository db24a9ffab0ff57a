//! What a listener tells, and its words.

use std::fmt;
use tapjoint_report::format::significant;
use tapjoint_signal::spectral::RUNG_DOWN;
use tapjoint_signal::taps::{Pulse, Rejection};

/// Digits of a number: who taps wants a glance.
const DIGITS: i32 = 3;

/// One hit as it was judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Hit {
    /// Time of its trigger (s from the start of the recording; files follow one another).
    pub time: f64,
    /// Peak of the force (N), or of the response on which it was found (its unit).
    pub peak: f64,
    /// Unit of the peak; `None` where it is not known.
    pub unit: Option<String>,
    /// Its force pulse; `None` without a hammer.
    pub pulse: Option<Pulse>,
    /// Amplitude at the end of its record over the largest one (1), of the response that keeps most. `None` of a hit that is
    /// rejected, or sinks into the noise.
    pub remaining: Option<f64>,
    /// Why it does not count; `None` = it counts.
    pub rejection: Option<Rejection>,
    /// Why it would not have counted, had it not been accepted by hand.
    pub overruled: Option<Rejection>,
    /// What can be done against the fault.
    pub remedy: Option<&'static str>,
}

/// Something that a listener tells.
#[derive(Debug, Clone, PartialEq)]
pub enum News {
    /// The record of a hit has ended.
    Hit(Hit),
    /// Later samples change the decision on a hit.
    Revised(Hit),
    /// What was told as a hit is none, as later samples show.
    Gone {
        /// Its time (s).
        time: f64,
    },
    /// A doubt about the recording.
    Doubt(String),
}

impl fmt::Display for Hit {
    /// Writes "accepted: peak 18.2 N, pulse 1.21 ms, excites up to 830 Hz, decays to 0.4 %".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(rejection) = &self.rejection {
            return write!(f, "REJECTED: {rejection}");
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
            write!(f, ", pulse {width} ms, excites up to {end} Hz")?;
        }
        match self.remaining.map(|remaining| 100.0 * remaining) {
            None => Ok(()),
            Some(percent) if percent < 0.1 => f.write_str(", decays to less than 0.1 %"),
            Some(percent) => write!(f, ", decays to {} %", significant(percent, DIGITS)),
        }
    }
}

impl fmt::Display for News {
    /// Writes one or two sentences.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            News::Hit(hit) => write!(f, "hit at {:.2} s {hit}", hit.time)?,
            News::Revised(hit) => write!(f, "hit at {:.2} s is now {hit}", hit.time)?,
            News::Gone { time } => write!(f, "hit at {time:.2} s was none, as later samples show")?,
            News::Doubt(text) => return write!(f, "doubt: {text}"),
        }
        let (News::Hit(hit) | News::Revised(hit)) = self else {
            return Ok(());
        };
        if let Some(remedy) = hit.remedy {
            return write!(f, ". {remedy}");
        }
        match hit.remaining {
            Some(remaining) if remaining > RUNG_DOWN => {
                f.write_str(". Wait longer before the next hit.")
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit() -> Hit {
        Hit {
            time: 4.9051,
            peak: 18.24,
            unit: Some("N".to_owned()),
            pulse: Some(Pulse {
                width: 1.2149e-3,
                fall_10_db: None,
                fall_20_db: None,
                usable_to: 832.0,
            }),
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
        let rejected = Hit {
            rejection: Some(double.clone()),
            remedy: Some("Hit shorter."),
            ..hit()
        };
        let by_hand = Hit {
            overruled: Some(double),
            pulse: None,
            unit: None,
            remaining: None,
            ..hit()
        };
        let ringing = Hit {
            remaining: Some(0.1234),
            ..hit()
        };
        let told = [
            News::Hit(hit()),
            News::Hit(ringing),
            News::Hit(rejected.clone()),
            News::Revised(rejected),
            News::Revised(by_hand),
            News::Gone { time: 4.9051 },
            News::Doubt("channel 2: every sample is 0".to_owned()),
        ];
        let told = told.map(|news| news.to_string()).join("\n");
        assert_eq!(
            told,
            "hit at 4.91 s accepted: peak 18.2 N, pulse 1.21 ms, excites up to 832 Hz, decays to 0.420 %\n\
             hit at 4.91 s accepted: peak 18.2 N, pulse 1.21 ms, excites up to 832 Hz, decays to 12.3 %. Wait longer \
             before the next hit.\n\
             hit at 4.91 s REJECTED: double hit: a second excursion of 34 % after 31.2 ms (limit 10 %). Hit shorter.\n\
             hit at 4.91 s is now REJECTED: double hit: a second excursion of 34 % after 31.2 ms (limit 10 %). Hit \
             shorter.\n\
             hit at 4.91 s is now accepted by hand in spite of a fault: double hit: a second excursion of 34 % after 31.2 \
             ms (limit 10 %): peak 18.2\n\
             hit at 4.91 s was none, as later samples show\n\
             doubt: channel 2: every sample is 0"
        );
    }
}
