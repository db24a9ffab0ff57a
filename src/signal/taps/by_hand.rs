//! Taps that a person accepts or rejects, whatever the rules say of them.

use super::{Event, Rejection, Tap, TapRemark};

/// Distance within which a time names a tap (s). 50 ms: far less than between two taps, and more than the digits of a table
/// leave open.
pub const REACH: f64 = 0.05;

/// Taps that are accepted or rejected by hand, named by the times of their triggers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TapsByHand {
    /// Accepted whatever their faults (s from the start of the recording).
    pub accept: Vec<f64>,
    /// Rejected (s from the start of the recording). A tap that is named twice is rejected.
    pub reject: Vec<f64>,
}

impl TapsByHand {
    /// Marks the events that are accepted, before their records are cut: an accepted tap ends the record before it.
    /// Returns a remark for each time without an event. `starts` are the times at which the files of the events begin (s).
    pub(super) fn mark(
        &self,
        files: &mut [&mut [Event]],
        starts: &[f64],
        rate: f64,
    ) -> Vec<TapRemark> {
        let mut remarks = Vec::new();
        for &time in &self.accept {
            let mut best: Option<(f64, &mut Event)> = None;
            for (events, start) in files.iter_mut().zip(starts) {
                for event in events.iter_mut() {
                    let own = start + event.trigger as f64 / rate;
                    if best
                        .as_ref()
                        .is_none_or(|(other, _)| is_nearer(own, *other, time))
                    {
                        best = Some((own, event));
                    }
                }
            }
            match best {
                Some((own, event)) if is_at(own, time) => event.by_hand = true,
                other => remarks.push(TapRemark::NoTapThere {
                    time,
                    accept: true,
                    nearest: other.map(|(own, _)| own),
                }),
            }
        }
        remarks
    }

    /// Rejects the taps that are named. Returns a remark for each time without a tap. A tap that is rejected for another
    /// reason keeps that reason.
    pub(super) fn reject(&self, taps: &mut [Tap]) -> Vec<TapRemark> {
        let mut remarks = Vec::new();
        for &time in &self.reject {
            let mut best: Option<&mut Tap> = None;
            for tap in taps.iter_mut() {
                if best
                    .as_ref()
                    .is_none_or(|other| is_nearer(tap.time, other.time, time))
                {
                    best = Some(tap);
                }
            }
            match best {
                Some(tap) if is_at(tap.time, time) => {
                    tap.rejection.get_or_insert(Rejection::ByHand);
                }
                other => remarks.push(TapRemark::NoTapThere {
                    time,
                    accept: false,
                    nearest: other.map(|tap| tap.time),
                }),
            }
        }
        remarks
    }

    /// Returns `true` where a tap is accepted by hand.
    pub fn accepts(&self, tap: &Tap) -> bool {
        self.accept.iter().any(|time| is_at(tap.time, *time))
    }

    /// Returns a remark for each tap that was accepted by hand, and is rejected all the same: its record is too short.
    pub(super) fn still_rejected(&self, taps: &[Tap]) -> Vec<TapRemark> {
        let mut remarks = Vec::new();
        for tap in taps.iter().filter(|tap| self.accepts(tap)) {
            if let Some(rejection) = tap.rejection.clone()
                && rejection != Rejection::ByHand
            {
                let time = tap.time;
                remarks.push(TapRemark::StillRejected { time, rejection });
            }
        }
        remarks
    }
}

/// Returns `true` where `own` is nearer to a time than the `other` one (s).
fn is_nearer(own: f64, other: f64, time: f64) -> bool {
    (own - time).abs() < (other - time).abs()
}

fn is_at(own: f64, time: f64) -> bool {
    (own - time).abs() <= REACH
}
