//! Checks that need several recordings, and the FRF at the place of the tap itself.

use num_complex::Complex64;

use super::{
    Check, Outcome, QualityVerdict, RecordingEvidence, ResonanceEvidence, SensorEvidence, Subject,
    limits,
};
use crate::recording::ResponseForm;
use tapjoint_numerics::stats::times;

/// Largest probability that scatter, independent from recording to recording, brings the frequencies into the order
/// of the levels: 0.34, which three levels just keep. It is no proof, and enough for a doubt; each further recording
/// makes it smaller.
const LARGEST_CHANCE: f64 = 0.34;

/// Two FRFs that swap the places of tap and sensor are equal (Maxwell).
pub(super) fn check_reciprocity(recordings: &[RecordingEvidence]) -> Vec<QualityVerdict> {
    let mut verdicts = Vec::new();
    for (first, second) in pairs(recordings) {
        // A driving point is no pair of places.
        let one_place = is_near(first.tap_position, second.tap_position);
        if one_place || first.fastened != second.fastened {
            continue;
        }
        for a in sensors_near(first, second.tap_position) {
            for b in sensors_near(second, first.tap_position) {
                if a.form == b.form {
                    verdicts.extend(compare_swapped(first, a, second, b));
                }
            }
        }
    }
    let why = "Not applicable: no two recordings swap the places of tap and sensor; tap once where the sensor was, with the sensor where the tap was.";
    or_missing(verdicts, Check::Reciprocity, limits::RECIPROCITY, why)
}

/// Returns the verdicts. Without any it returns one on the test, with the reason why the check does not apply.
fn or_missing(
    mut verdicts: Vec<QualityVerdict>,
    check: Check,
    limit: f64,
    why: &str,
) -> Vec<QualityVerdict> {
    if verdicts.is_empty() {
        verdicts.push(QualityVerdict::new(check, Subject::Test, limit).missing(why));
    }
    verdicts
}

/// Every two recordings of one free length, in the order of the test.
fn pairs(
    recordings: &[RecordingEvidence],
) -> impl Iterator<Item = (&RecordingEvidence, &RecordingEvidence)> {
    let firsts = recordings.iter().enumerate();
    firsts.flat_map(|(index, first)| {
        let later = recordings[index + 1..].iter();
        let later = later.filter(|one| one.free_length == first.free_length);
        later.map(move |one| (first, one))
    })
}

/// Returns `true` for two known positions (m) that count as the same place.
fn is_near(a: Option<f64>, b: Option<f64>) -> bool {
    a.zip(b)
        .is_some_and(|(a, b)| (a - b).abs() <= limits::SAME_POSITION)
}

/// Returns `true` also where neither position is known.
fn is_unmoved(a: Option<f64>, b: Option<f64>) -> bool {
    is_near(a, b) || (a.is_none() && b.is_none())
}

/// Sensors of a recording at a position (m).
fn sensors_near(
    recording: &RecordingEvidence,
    position: Option<f64>,
) -> impl Iterator<Item = &SensorEvidence> {
    let sensors = recording.sensors.iter();
    sensors.filter(move |sensor| is_near(sensor.position, position))
}

/// Compares the FRF of sensor `a` in `first` with that of sensor `b` in `second`, tap and sensor swapped.
fn compare_swapped(
    first: &RecordingEvidence,
    a: &SensorEvidence,
    second: &RecordingEvidence,
    b: &SensorEvidence,
) -> Option<QualityVerdict> {
    let (h1, h2) = (a.frf.as_ref()?, b.frf.as_ref()?);
    let (mut cross, mut power1, mut power2) = (Complex64::ZERO, 0.0, 0.0);
    for (line, x) in h1.iter().enumerate() {
        // The other FRF at that frequency, linear between its lines; none outside its band.
        let place = (first.lines.frequency(line) - second.lines.low) / second.lines.spacing;
        let index = (place + 1e-9).floor();
        let share = (place - index).max(0.0);
        if index < 0.0 {
            continue;
        }
        let y = match (h2.get(index as usize), h2.get(index as usize + 1)) {
            (Some(one), Some(next)) => one * (1.0 - share) + next * share,
            (Some(one), None) if share < 1e-6 => *one,
            _ => continue,
        };
        cross += x * y.conj();
        power1 += x.norm_sqr();
        power2 += y.norm_sqr();
    }
    if power1 <= 0.0 || power2 <= 0.0 {
        return None;
    }
    let agreement = cross.norm_sqr() / (power1 * power2);
    let gain = (power1 / power2).sqrt();
    let level = (gain - 1.0).abs().max((1.0 / gain - 1.0).abs());
    let opposite = cross.re < 0.0;
    let outcome = match agreement {
        g if opposite || g < 0.5 => Outcome::Bad,
        g if g < limits::RECIPROCITY || level > limits::RECIPROCITY_GAIN => Outcome::Doubtful,
        _ => Outcome::Good,
    };
    let happened = format!(
        "Sensor {} here and sensor {} in {}, tap and sensor swapped, agree to {agreement:.3}{}, at a level ratio of {gain:.2} (limits {:.2} and 1 \u{b1} {:.1}).",
        a.name,
        b.name,
        second.file,
        if opposite {
            ", but of opposite sign"
        } else {
            ""
        },
        limits::RECIPROCITY,
        limits::RECIPROCITY_GAIN
    );
    let verdict = first.sensor_verdict(Check::Reciprocity, a, limits::RECIPROCITY);
    Some(verdict.found(agreement, outcome, happened))
}

/// Frequencies at two tap levels in one arrangement agree within their uncertainty.
pub(super) fn check_linearity(recordings: &[RecordingEvidence]) -> Vec<QualityVerdict> {
    let mut verdicts = Vec::new();
    for (first, second) in pairs(recordings) {
        let (Some(a), Some(b)) = (first.tap_level(), second.tap_level()) else {
            continue;
        };
        let ratio = b / a;
        let differ = a > 0.0 && b > 0.0 && ratio.max(1.0 / ratio) >= limits::TWO_LEVELS;
        if differ && same_arrangement(first, second) {
            let (check, change) = (
                Check::Linearity,
                format!("at {ratio:.2} times the tap level"),
            );
            verdicts.extend(shifts(check, first, second, &change, recordings));
        }
    }
    let why = "Not applicable: no two recordings differ in the tap level alone; record once more with softer or harder taps.";
    or_missing(verdicts, Check::Linearity, limits::DEVIATIONS, why)
}

/// Frequencies with the sensors elsewhere agree within their uncertainty.
pub(super) fn check_mass_loading(recordings: &[RecordingEvidence]) -> Vec<QualityVerdict> {
    let mut verdicts = Vec::new();
    // Each arrangement once, beside the first recording.
    if let Some((first, later)) = recordings.split_first() {
        let mut seen = vec![first];
        for second in later {
            let is_known = seen.iter().any(|one| same_sensors(one, second));
            // A mass that is fastened moves frequencies by itself, and so does a moved clamp.
            let is_alike =
                second.fastened == first.fastened && second.free_length == first.free_length;
            if is_alike && !is_known {
                seen.push(second);
                let (check, change) = (Check::MassLoading, "with the sensors elsewhere");
                verdicts.extend(shifts(check, first, second, change, &[]));
            }
        }
    }
    let why = "Not applicable: the sensors are at the same places in all recordings; move or remove one and record again.";
    or_missing(verdicts, Check::MassLoading, limits::DEVIATIONS, why)
}

fn same_sensors(first: &RecordingEvidence, second: &RecordingEvidence) -> bool {
    let mut pairs = first.sensors.iter().zip(&second.sensors);
    first.sensors.len() == second.sensors.len()
        && pairs.all(|(a, b)| is_unmoved(a.position, b.position))
}

fn same_arrangement(first: &RecordingEvidence, second: &RecordingEvidence) -> bool {
    is_unmoved(first.tap_position, second.tap_position)
        && first.fastened == second.fastened
        && same_sensors(first, second)
}

/// Returns one verdict for each mode of both recordings on its shift in standard deviations. `change` words how
/// `second` differs from `first`. `levels` are the recordings among which a shift may follow the tap levels.
fn shifts(
    check: Check,
    first: &RecordingEvidence,
    second: &RecordingEvidence,
    change: &str,
    levels: &[RecordingEvidence],
) -> Vec<QualityVerdict> {
    let mut verdicts = Vec::new();
    for mode in &first.resonances {
        let Some(other) = partner(mode, first, second) else {
            continue;
        };
        let verdict = first.mode_verdict(check, mode, limits::DEVIATIONS);
        let shift = 100.0 * (other.frequency / mode.frequency - 1.0);
        let (Some(a), Some(b)) = (mode.std, other.std) else {
            verdicts.push(verdict.missing(&format!(
                "Not applicable: {change} ({}) it moves by {} %, and its uncertainty is not known.",
                second.file,
                signed(shift)
            )));
            continue;
        };
        let deviations =
            (other.frequency - mode.frequency).abs() / a.hypot(b).max(f64::MIN_POSITIVE);
        let mut happened = format!(
            "It moves by {} % {change} ({}), {} standard deviations (limit {:.0}).",
            signed(shift),
            second.file,
            times(deviations),
            limits::DEVIATIONS
        );
        verdicts.push(if deviations <= limits::DEVIATIONS {
            verdict.found(deviations, Outcome::Good, happened)
        } else if let Some(order) = in_order(mode, first, levels) {
            verdict.found(deviations, Outcome::Doubtful, happened + &order)
        } else {
            // Time, and mounting a sensor anew, move a frequency too, but seldom in the order of the levels.
            let moved = 0.01 * shift.abs();
            let is_usual = moved <= limits::DRIFT;
            if is_usual {
                happened += &format!(
                    " A joint's usual drift between recordings leaves up to {:.1} %.",
                    100.0 * limits::DRIFT
                );
            }
            // The limit that decides is shown: the usual drift.
            let verdict = verdict.against(limits::DRIFT, "1");
            verdict.found(moved, Outcome::doubtful_unless(is_usual), happened)
        });
    }
    verdicts
}

/// A change (%) with its sign, a minus sign for a hyphen.
fn signed(percent: f64) -> String {
    format!("{percent:+.3}").replace('-', "\u{2212}")
}

/// A mode's frequency (Hz) in one recording, and the level that it was tapped at.
struct Seen {
    level: f64,
    frequency: f64,
    std: f64,
}

impl Seen {
    /// Returns `true` for a frequency that lies below another one by more than chance explains.
    fn is_clearly_below(&self, other: &Seen) -> bool {
        other.frequency - self.frequency > limits::DEVIATIONS * self.std.hypot(other.std)
    }
}

/// Returns a sentence where a mode's frequency follows the order of the tap levels.
///
/// All recordings in `first`'s arrangement that read the mode take part. From each level to the next every frequency
/// must clearly rise, or every one clearly fall. Two levels differ where their ratio is [`limits::TWO_LEVELS`] or more.
/// `None` where the frequency does not follow, or where the order is too likely by chance ([`LARGEST_CHANCE`]).
fn in_order(
    mode: &ResonanceEvidence,
    first: &RecordingEvidence,
    recordings: &[RecordingEvidence],
) -> Option<String> {
    let mut seen = Vec::new();
    for one in recordings {
        if same_arrangement(first, one)
            && let Some(own) = partner(mode, first, one)
            && let (Some(level), Some(std)) = (one.tap_level(), own.std)
        {
            let frequency = own.frequency;
            seen.push(Seen {
                level,
                frequency,
                std,
            });
        }
    }
    // A joint that settles moves the frequencies in the order of time.
    let ratio = limits::TWO_LEVELS;
    let in_time = seen.is_sorted_by(|a, b| a.level < ratio * b.level)
        || seen.is_sorted_by(|a, b| b.level < ratio * a.level);
    seen.sort_by(|a, b| a.level.total_cmp(&b.level));
    let levels: Vec<&[Seen]> = seen.chunk_by(|a, b| b.level < ratio * a.level).collect();
    let (mut rises, mut falls) = (levels.len() > 1, levels.len() > 1);
    for two in levels.windows(2) {
        for low in two[0] {
            rises &= two[1].iter().all(|high| low.is_clearly_below(high));
            falls &= two[1].iter().all(|high| high.is_clearly_below(low));
        }
    }
    let sizes: Vec<usize> = levels.iter().map(|level| level.len()).collect();
    ((rises || falls) && chance_of_order(&sizes) <= LARGEST_CHANCE).then(|| {
        format!(
            " Over {} recordings it follows the order of their levels.{}",
            seen.len(),
            if in_time {
                " So it would with a joint that settles from one to the next: record the first level once more."
            } else {
                ""
            }
        )
    })
}

/// Probability that values in random order rise, or fall, from level to level: 2 prod(n_k!)/n! with n_k of the n
/// values at each level.
fn chance_of_order(sizes: &[usize]) -> f64 {
    let within: f64 = sizes.iter().map(|&n| ln_factorial(n)).sum();
    2.0 * (within - ln_factorial(sizes.iter().sum())).exp()
}

fn ln_factorial(n: usize) -> f64 {
    (2..=n).map(|k| (k as f64).ln()).sum()
}

/// The nearest resonance of the other recording, where each is the other's nearest and both are within
/// the limit of the same mode.
fn partner<'a>(
    mode: &ResonanceEvidence,
    first: &RecordingEvidence,
    second: &'a RecordingEvidence,
) -> Option<&'a ResonanceEvidence> {
    let other = nearest(&second.resonances, mode.frequency)?;
    let back = nearest(&first.resonances, other.frequency)?;
    let near = (other.frequency / mode.frequency - 1.0).abs() <= limits::SAME_MODE;
    (near && back.frequency == mode.frequency).then_some(other)
}

fn nearest(modes: &[ResonanceEvidence], frequency: f64) -> Option<&ResonanceEvidence> {
    modes.iter().min_by(|a, b| {
        let [a, b] = [a, b].map(|mode| (mode.frequency - frequency).abs());
        a.total_cmp(&b)
    })
}

/// Lines to either side of a resonance over which its sign is taken.
const ABOUT: usize = 2;

/// The imaginary part of accelerance and receptance (the real part of mobility) keeps one sign at all
/// resonances: every mode answers there in phase with itself.
pub(super) fn check_driving_point(recording: &RecordingEvidence) -> Vec<QualityVerdict> {
    of_driving_points(recording, Check::DrivingPoint, 1, |receptance| {
        let (mut all, mut wrong) = (0, 0);
        for mode in &recording.resonances {
            let line = recording.lines.nearest(mode.frequency);
            let end = (line + ABOUT + 1).min(receptance.len());
            if let Some(about) = receptance.get(line.saturating_sub(ABOUT)..end) {
                all += 1;
                // x = phi^2 F/(k (1 - s^2 + 2 j zeta s)): at resonance -j times something positive.
                wrong += usize::from(-about.iter().map(|x| x.im).sum::<f64>() <= 0.0);
            }
        }
        let (outcome, what) = match wrong {
            0 => (Outcome::Good, "in the direction of the blow at all"),
            n if n == all => (Outcome::Bad, "against the direction of the blow at all"),
            _ => (Outcome::Bad, "against the direction of the blow at some"),
        };
        let happened =
            format!("The driving point answers {what} resonances: {wrong} of {all} (limit 0).");
        (wrong, outcome, happened)
    })
}

/// Between every two resonances of a driving point lies an antiresonance: the real part of the
/// receptance, negative above one resonance and positive below the next, passes zero.
pub(super) fn check_antiresonances(recording: &RecordingEvidence) -> Vec<QualityVerdict> {
    let lines = &recording.lines;
    let mut places = Vec::with_capacity(recording.resonances.len());
    for mode in &recording.resonances {
        let line = lines.nearest(mode.frequency);
        // A resonance's own real part is largest at half its half-power width; on the line itself that of the
        // other modes decides.
        let half = mode.apparent_damping_ratio.unwrap_or(0.0) * mode.frequency;
        let width = ((half / lines.spacing).round() as usize).max(1);
        places.push((line, width));
    }
    of_driving_points(recording, Check::Antiresonances, 2, |receptance| {
        // A channel with the wrong sign is the other check's matter.
        let at_modes = places.iter().filter_map(|&(line, _)| receptance.get(line));
        let sum: f64 = at_modes.map(|x| x.im).sum();
        let upright = if sum > 0.0 { -1.0 } else { 1.0 };
        let gaps = places.len().saturating_sub(1);
        let mut missing = gaps;
        for pair in places.windows(2) {
            let ((first, wide), (last, narrow)) = (pair[0], pair[1]);
            let between = receptance.get(first + wide..last.saturating_sub(narrow) + 1);
            let mut parts = between.unwrap_or_default().iter().map(|x| upright * x.re);
            let passes_zero = parts.any(|re| re < 0.0) && parts.any(|re| re > 0.0);
            missing -= usize::from(passes_zero);
        }
        let outcome = match missing {
            0 => Outcome::Good,
            1 => Outcome::Doubtful,
            _ => Outcome::Bad,
        };
        let happened = format!(
            "{missing} of {gaps} gaps between resonances are without an antiresonance (limit 0)."
        );
        (missing, outcome, happened)
    })
}

/// Returns one verdict for each sensor at the tap's place. Without such a sensor it returns one, with the reason.
/// `judge` takes the receptance there and returns value, outcome and sentence.
fn of_driving_points(
    recording: &RecordingEvidence,
    check: Check,
    least_modes: usize,
    judge: impl Fn(&[Complex64]) -> (usize, Outcome, String),
) -> Vec<QualityVerdict> {
    let none = recording.verdict(check, 0.0);
    if recording.tap_position.is_none() {
        return vec![none.missing("Not applicable: the tap position is not given.")];
    }
    if recording.resonances.len() < least_modes {
        return vec![none.missing("Not applicable: too few resonances.")];
    }
    let mut verdicts = Vec::new();
    for sensor in sensors_near(recording, recording.tap_position) {
        if let Some(receptance) = receptance(recording, sensor) {
            let (value, outcome, happened) = judge(&receptance);
            let verdict = recording.sensor_verdict(check, sensor, 0.0);
            verdicts.push(verdict.found(value as f64, outcome, happened));
        }
    }
    if verdicts.is_empty() {
        verdicts.push(none.missing("Not applicable: no FRF of a sensor where the hammer strikes."));
    }
    verdicts
}

/// The FRF as receptance, up to a positive factor: accelerance/(-omega^2), mobility/(j omega).
fn receptance(recording: &RecordingEvidence, sensor: &SensorEvidence) -> Option<Vec<Complex64>> {
    let (frf, form) = (sensor.frf.as_ref()?, sensor.form?);
    let mut receptance = frf.clone();
    for (line, value) in receptance.iter_mut().enumerate() {
        let omega = recording.lines.frequency(line).max(f64::MIN_POSITIVE);
        *value = match form {
            ResponseForm::Accelerance => -*value / (omega * omega),
            ResponseForm::Mobility => *value / Complex64::new(0.0, omega),
            ResponseForm::Receptance => *value,
        };
    }
    Some(receptance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 3! orders of three values two are monotonic; of 4!/(2! 2!) ways to put four on two levels, two keep them
    /// apart. To rounding of logarithms.
    #[test]
    fn limit_chance_of_an_order() {
        for (sizes, expected) in [
            (vec![1, 1], 1.0),
            (vec![1, 1, 1], 1.0 / 3.0),
            (vec![2, 2], 1.0 / 3.0),
            (vec![2, 1], 2.0 / 3.0),
            (vec![2, 1, 1], 1.0 / 6.0),
        ] {
            let chance = chance_of_order(&sizes);
            assert!((chance - expected).abs() < 1e-12, "{sizes:?}: {chance}");
        }
    }
}
