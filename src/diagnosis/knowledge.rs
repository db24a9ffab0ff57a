//! What is known of all parameters of a hypothesis before the data.

use super::forward::Layout;
use super::frame::Frame;
use super::least_squares::Knowledge;
use super::nominal::COUPLING;
use super::settings::GapSettings;
use super::small_unknowns::Small;

/// Spread of the coupling of a joint that has one: anything between -1 and 1 (2 standard deviations).
const COUPLING_STD: f64 = 0.5;

/// What is known of a stiffness before the data.
fn stiffness_knowledge(start: f64, joint_std: f64) -> Knowledge {
    Knowledge {
        // Beyond these a beam's frequencies no longer feel the joint.
        low: start.ln() - 8.0 * joint_std,
        high: start.ln() + 8.0 * joint_std,
        ..Knowledge::normal(start.ln(), joint_std)
    }
}

/// What is known of all parameters of a hypothesis before the data, the joint's drift the middle one of those
/// that are tried: with that a search begins.
pub(super) fn knowledge(frame: &Frame, layout: &Layout, settings: &GapSettings) -> Vec<Knowledge> {
    let drift = settings.drift_stds[settings.drift_stds.len() / 2];
    let mut all: Vec<Knowledge> = frame
        .nominal
        .sought()
        .into_iter()
        .map(|(direction, start)| match direction {
            COUPLING => Knowledge {
                low: -0.95,
                high: 0.95,
                ..Knowledge::normal(0.0, COUPLING_STD)
            },
            _ => stiffness_knowledge(start, settings.joint_std),
        })
        .collect();
    for effect in &layout.effects {
        all.push(Knowledge {
            low: effect.size.low,
            high: effect.size.high,
            ..Knowledge::normal(effect.size.nothing, 3.0 * effect.size.scale)
        });
        if let Some(range) = &effect.place {
            all.push(Knowledge {
                centre: 0.0,
                std: f64::INFINITY,
                low: range.inward(range.low),
                high: range.inward(range.high),
            });
        }
    }
    for ((small, std), centre) in frame
        .smalls
        .iter()
        .zip(&frame.small_stds)
        .zip(&frame.small_centres)
    {
        let std = if matches!(small, Small::Drift { .. }) {
            drift
        } else {
            *std
        };
        all.push(Knowledge::normal(*centre, std));
    }
    all
}

/// The same with another spread of the drift.
pub(super) fn with_drift(
    frame: &Frame,
    layout: &Layout,
    known: &[Knowledge],
    drift: f64,
) -> Vec<Knowledge> {
    let first = layout.smalls();
    let mut known = known.to_vec();
    for (k, small) in frame.smalls.iter().enumerate() {
        if matches!(small, Small::Drift { .. }) {
            known[first + k].std = drift;
        }
    }
    known
}
