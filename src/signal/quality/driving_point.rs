//! The FRF at the place of the tap itself.

use num_complex::Complex64;

use super::{
    Check, Outcome, QualitySettings, RecordingEvidence, ResonanceEvidence, SensorEvidence, Subject,
    Verdict,
};
use crate::recording::ResponseForm;

/// Lines to either side of a resonance over which its sign is taken.
const ABOUT: usize = 2;

/// The imaginary part of accelerance and receptance (the real part of mobility) keeps one sign at all
/// resonances: every mode answers there in phase with itself.
pub fn check_driving_point(
    recording: &RecordingEvidence,
    settings: &QualitySettings,
) -> Vec<Verdict> {
    of_driving_points(
        recording,
        (Check::DrivingPoint, 1),
        settings,
        |receptance| {
            let sign = |mode: f64| {
                let line = recording.lines.nearest(mode);
                let end = (line + ABOUT + 1).min(receptance.len());
                let about = receptance.get(line.saturating_sub(ABOUT)..end)?;
                // x = phi^2 F/(k (1 - s^2 + 2 j zeta s)): at resonance -j times something positive.
                Some(-about.iter().map(|x| x.im).sum::<f64>())
            };
            let signs: Vec<f64> = modes(recording).filter_map(sign).collect();
            let wrong = signs.iter().filter(|sign| **sign <= 0.0).count();
            let all = signs.len();
            let what = match wrong {
                0 => "answers in the direction of the blow at all",
                n if n == all => "answers against the direction of the blow at all",
                _ => "answers against the direction of the blow at some",
            };
            let outcome = if wrong == 0 {
                Outcome::Good
            } else {
                Outcome::Bad
            };
            (
                wrong,
                outcome,
                format!("The driving point {what} resonances: {wrong} of {all} (limit 0)."),
            )
        },
    )
}

/// Between every two resonances of a driving point lies an antiresonance: the real part of the
/// receptance, negative above one resonance and positive below the next, passes zero.
pub fn check_antiresonances(
    recording: &RecordingEvidence,
    settings: &QualitySettings,
) -> Vec<Verdict> {
    // A resonance's line, and the lines of half its half-power width: there its own real part is
    // largest, where on the line itself that of the other modes decides.
    let place = |mode: &ResonanceEvidence| {
        let half = mode.apparent_damping_ratio.unwrap_or(0.0) * mode.frequency;
        let width = (half / recording.lines.spacing).round() as usize;
        (recording.lines.nearest(mode.frequency), width.max(1))
    };
    of_driving_points(
        recording,
        (Check::Antiresonances, 2),
        settings,
        |receptance| {
            let places: Vec<(usize, usize)> = recording.resonances.iter().map(place).collect();
            // A channel with the wrong sign is the other check's matter.
            let sum: f64 = places
                .iter()
                .filter_map(|&(line, _)| receptance.get(line))
                .map(|x| x.im)
                .sum();
            let upright = if sum > 0.0 { -1.0 } else { 1.0 };
            let passes = |pair: &&[(usize, usize)]| {
                let ((first, wide), (last, narrow)) = (pair[0], pair[1]);
                let between = receptance.get(first + wide..last.saturating_sub(narrow) + 1);
                let between = between.unwrap_or_default();
                let mut parts = between.iter().map(|x| upright * x.re);
                parts.any(|re| re < 0.0) && parts.any(|re| re > 0.0)
            };
            let gaps = places.len().saturating_sub(1);
            let missing = gaps - places.windows(2).filter(passes).count();
            let outcome = match missing {
                0 => Outcome::Good,
                1 => Outcome::Doubtful,
                _ => Outcome::Bad,
            };
            (
                missing,
                outcome,
                format!(
                    "{missing} of {gaps} gaps between resonances are without an antiresonance (limit 0)."
                ),
            )
        },
    )
}

fn modes(recording: &RecordingEvidence) -> impl Iterator<Item = f64> {
    recording.resonances.iter().map(|mode| mode.frequency)
}

/// One verdict for each sensor at the tap's place, or one that says why there is none.
fn of_driving_points(
    recording: &RecordingEvidence,
    (check, least_modes): (Check, usize),
    settings: &QualitySettings,
    judge: impl Fn(&[Complex64]) -> (usize, Outcome, String),
) -> Vec<Verdict> {
    let at_tap = |sensor: &&SensorEvidence| match (sensor.position, recording.tap_position) {
        (Some(sensor), Some(tap)) => (sensor - tap).abs() <= settings.same_position,
        _ => false,
    };
    let file = || recording.file.clone();
    let whole = || Verdict::new(check, Subject::Recording { file: file() }, 0.0);
    if recording.tap_position.is_none() {
        return vec![whole().missing("Not applicable: nobody said where the hammer strikes.")];
    }
    if recording.resonances.len() < least_modes {
        return vec![whole().missing("Not applicable: too few resonances.")];
    }
    let verdicts: Vec<Verdict> = recording
        .sensors
        .iter()
        .filter(at_tap)
        .filter_map(|sensor| {
            let (value, outcome, happened) = judge(&receptance(recording, sensor)?);
            let sensor = sensor.name.clone();
            let verdict = Verdict::new(
                check,
                Subject::Sensor {
                    file: file(),
                    sensor,
                },
                0.0,
            );
            Some(verdict.found(value as f64, outcome, happened))
        })
        .collect();
    if verdicts.is_empty() {
        return vec![
            whole().missing("Not applicable: no FRF of a sensor where the hammer strikes."),
        ];
    }
    verdicts
}

/// The FRF as receptance, up to a positive factor: accelerance/(-omega^2), mobility/(j omega).
fn receptance(recording: &RecordingEvidence, sensor: &SensorEvidence) -> Option<Vec<Complex64>> {
    let frf = sensor.frf.as_ref()?;
    let convert = |(line, h): (usize, &Complex64)| {
        let omega = recording.lines.frequency(line).max(f64::MIN_POSITIVE);
        match sensor.form {
            Some(ResponseForm::Accelerance) => Some(-h / (omega * omega)),
            Some(ResponseForm::Mobility) => Some(h / Complex64::new(0.0, omega)),
            Some(ResponseForm::Receptance) => Some(*h),
            None => None,
        }
    };
    frf.iter().enumerate().map(convert).collect()
}
