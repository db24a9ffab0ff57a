//! Strengths of the modes of one recording, and poles that are too weak for a mode.

use crate::combinations::{Mode, readings};
use tapjoint::modal::{ModeReading, PeakLabel, set_strengths};
use tapjoint::recording::ResponseForm;

/// Readings of modes with these frequencies (Hz) and velocities (any unit); the recording is an acceleration.
fn seen(velocities: &[(f64, f64)]) -> Vec<ModeReading> {
    let modes = velocities.iter().map(|(frequency, velocity)| Mode {
        frequency: *frequency,
        damping_ratio: 0.002,
        amplitude: velocity * frequency / 100.0,
        softening: 0.0,
    });
    let found = readings(&modes.collect::<Vec<_>>(), 0.0, 1, 1);
    let frequencies: Vec<f64> = found.iter().map(|one| one.frequency).collect();
    assert_eq!(found.len(), velocities.len(), "{frequencies:?}");
    found
}

fn assert_strengths(found: &[ModeReading], expected: &[f64]) {
    for (own, expected) in found.iter().zip(expected) {
        let strength = own.strength.unwrap();
        // The decay is fitted from some milliseconds after the tap on, when higher modes have lost up to 4 % more.
        assert!(
            (strength / expected - 1.0).abs() < 0.05,
            "{strength} for {expected} at {} Hz",
            own.frequency
        );
    }
}

#[test]
fn val_strengths_compare_velocities_with_the_strongest_above() {
    let found = seen(&[(110.0, 0.2), (307.0, 1.0), (571.0, 0.3), (903.0, 0.01)]);
    // Above the strongest 0.3 is itself the strongest, and 0.01 is compared with 3 % of the strongest.
    assert_strengths(&found, &[0.2, 1.0, 1.0, 0.01 / 0.03]);
    // The same samples of a displacement: velocities grow with the square of the frequency.
    let mut displacements = found;
    set_strengths(&mut displacements, &[Some(ResponseForm::Receptance)]);
    // 0.3 at 571 Hz is the strongest then: 0.2 x 110^2 and 307^2 over 0.3 x 571^2.
    assert_strengths(&displacements, &[0.02474, 0.96356, 1.0, 1.0]);
}

#[test]
fn limit_a_weak_mode_that_makes_a_peak_stays_a_mode() {
    let found = seen(&[(110.0, 1.0), (307.0, 2e-3), (571.0, 1.0)]);
    assert_strengths(&found, &[1.0, 2e-3, 1.0]);
    assert!(found.iter().all(|one| one.label.is_none()), "{found:?}");
}

#[test]
fn prop_poles_without_a_peak_are_weak_below_a_hundredth() {
    for (velocity, label) in [(0.02, None), (0.005, Some(PeakLabel::Weak))] {
        let mut found = seen(&[(110.0, 1.0), (307.0, velocity), (571.0, 1.0)]);
        found[1].prominence_db = None;
        set_strengths(&mut found, &[]);
        assert_eq!(found[1].label, label);
        // A pole that makes no peak counts a tenth.
        assert_strengths(&found, &[1.0, 0.1 * velocity, 1.0]);
    }
}
