//! Taps that a person accepts or rejects, whatever the rules say of them.

use super::{Rejection, Tap, TapRemark};

/// Distance within which a time names a tap (s). 50 ms: far less than between two taps, and more than the digits of a table
/// leave open.
pub(super) const REACH: f64 = 0.05;

/// Taps that are accepted or rejected by hand, named by the times of their triggers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TapsByHand {
    /// Accepted whatever their faults (s from the start of the recording).
    pub accept: Vec<f64>,
    /// Rejected (s from the start of the recording).
    pub reject: Vec<f64>,
}

impl TapsByHand {
    /// Judges the taps that are named. Returns a remark for each time without a tap.
    ///
    /// A tap that drove a channel to its limit gives its decay, as [`TapSettings::keep_overload`](super::TapSettings) has
    /// it. A tap that is named twice is rejected.
    pub(super) fn judge(&self, taps: &mut [Tap]) -> Vec<TapRemark> {
        let mut remarks = Vec::new();
        for (place, &time) in self.accept.iter().chain(&self.reject).enumerate() {
            let nearest = nearest(taps, time);
            let Some(tap) = nearest.filter(|&tap| is_at(&taps[tap], time)) else {
                let nearest = nearest.map(|tap| taps[tap].time);
                remarks.push(TapRemark::NoTapThere { time, nearest });
                continue;
            };
            let tap = &mut taps[tap];
            if place < self.accept.len() {
                tap.overruled = tap.rejection.take();
            } else if tap.accepted() {
                tap.rejection = Some(Rejection::ByHand);
            }
        }
        remarks
    }

    /// Returns a remark for each tap that was accepted by hand, and is rejected all the same: its record is too short.
    pub(super) fn still_rejected(&self, taps: &[Tap]) -> Vec<TapRemark> {
        let mut remarks = Vec::new();
        for &time in &self.accept {
            let named = nearest(taps, time).map(|tap| &taps[tap]);
            if let Some(tap) = named.filter(|tap| is_at(tap, time))
                && let Some(rejection) = tap.rejection.clone()
                && rejection != Rejection::ByHand
            {
                let time = tap.time;
                remarks.push(TapRemark::StillRejected { time, rejection });
            }
        }
        remarks
    }
}

/// Returns the index of the tap nearest to a time (s).
fn nearest(taps: &[Tap], time: f64) -> Option<usize> {
    let distance = |tap: &usize| (taps[*tap].time - time).abs();
    (0..taps.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

fn is_at(tap: &Tap, time: f64) -> bool {
    (tap.time - time).abs() <= REACH
}
