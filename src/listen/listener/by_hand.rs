//! Taps that are accepted or rejected by hand while the recording goes on.

use super::{ListenError, Listener};
use crate::news::News;
use tapjoint_signal::taps::{REACH, TapsByHand};

/// Decisions by hand that can be taken back. 1000: more than anybody takes, and a bound on memory.
const MOST_UNDONE: usize = 1000;
/// Times by hand are rounded to this many steps in a second. 1e4: a tenth of a millisecond is far less than [`REACH`].
const PER_SECOND: f64 = 1e4;

impl Listener<'_> {
    /// Accepts or rejects by hand the tap at this time (s). Returns what is new; `None` where no tap is.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    pub fn decide(&mut self, time: f64, accept: bool) -> Result<Option<Vec<News>>, ListenError> {
        let taps = self.reported.iter();
        let Some(tap) = taps.min_by(|one, other| {
            let [one, other] = [one, other].map(|tap| (tap.time - time).abs());
            one.total_cmp(&other)
        }) else {
            return Ok(None);
        };
        if (tap.time - time).abs() > REACH {
            return Ok(None);
        }
        let mut by_hand = self.by_hand.clone();
        for times in [&mut by_hand.accept, &mut by_hand.reject] {
            times.retain(|other| (other - tap.time).abs() > 2.0 * REACH);
        }
        let times = match accept {
            true => &mut by_hand.accept,
            false => &mut by_hand.reject,
        };
        // Where the rules say the same now, later taps may still change what they say.
        times.push((tap.time * PER_SECOND).round() / PER_SECOND);
        times.sort_by(f64::total_cmp);
        if by_hand == self.by_hand {
            return Ok(Some(Vec::new()));
        }
        self.earlier_by_hand.push(self.by_hand.clone());
        if self.earlier_by_hand.len() > MOST_UNDONE {
            self.earlier_by_hand.remove(0);
        }
        self.look_by(by_hand).map(Some)
    }

    /// Takes the last decision by hand back. Returns what is new; `None` where there is none.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    pub fn undo(&mut self) -> Result<Option<Vec<News>>, ListenError> {
        let earlier = self.earlier_by_hand.pop();
        earlier.map(|by_hand| self.look_by(by_hand)).transpose()
    }

    /// Looks again with other decisions by hand.
    fn look_by(&mut self, by_hand: TapsByHand) -> Result<Vec<News>, ListenError> {
        self.by_hand = by_hand;
        self.look(true)
    }

    /// The taps that are accepted or rejected by hand.
    pub fn by_hand(&self) -> &TapsByHand {
        &self.by_hand
    }
}
