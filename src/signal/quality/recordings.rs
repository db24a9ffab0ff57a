//! Checks that need several recordings.
//!
//! The FRF at the place of the tap itself.

use num_complex::Complex64;

use super::averages::of_mode;
use super::{
    Check, Outcome, QualitySettings, RecordingEvidence, ResonanceEvidence, SensorEvidence, Subject,
    Verdict,
};
use crate::recording::ResponseForm;
use tapjoint_numerics::stats::times;

/// Largest probability that scatter, independent from recording to recording, brings the frequencies into the order
/// of the levels: 0.34, which three levels just keep. It is no proof, and enough for a doubt; each further recording
/// makes it smaller.
const LARGEST_CHANCE: f64 = 0.34;

/// Two FRFs that swap the places of tap and sensor are equal (Maxwell).
pub fn check_reciprocity(
    recordings: &[RecordingEvidence],
    settings: &QualitySettings,
) -> Vec<Verdict> {
    let mut verdicts = Vec::new();
    for (index, first) in recordings.iter().enumerate() {
        for second in &recordings[index + 1..] {
            for pair in swapped(first, second, settings) {
                verdicts.extend(compare((first, second), pair, settings));
            }
        }
    }
    if verdicts.is_empty() {
        let verdict = Verdict::new(Check::Reciprocity, Subject::Test, settings.reciprocity);
        verdicts.push(verdict.missing(
            "Not applicable: no two recordings swap the places of tap and sensor; tap once where the sensor was, with the sensor where the tap was.",
        ));
    }
    verdicts
}

/// Sensors of two recordings, each where the other recording is tapped; a driving point is no pair.
fn swapped<'a>(
    first: &'a RecordingEvidence,
    second: &'a RecordingEvidence,
    settings: &QualitySettings,
) -> Vec<(&'a SensorEvidence, &'a SensorEvidence)> {
    let near = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() <= settings.same_position,
        _ => false,
    };
    if near(first.tap_position, second.tap_position) || first.fastened != second.fastened {
        return Vec::new();
    }
    let at = |recording: &'a RecordingEvidence, place: Option<f64>| {
        let sensors = recording.sensors.iter();
        sensors.filter(move |sensor| near(sensor.position, place))
    };
    at(first, second.tap_position)
        .flat_map(|a| at(second, first.tap_position).map(move |b| (a, b)))
        .filter(|(a, b)| a.form == b.form)
        .collect()
}

fn compare(
    (first, second): (&RecordingEvidence, &RecordingEvidence),
    (a, b): (&SensorEvidence, &SensorEvidence),
    settings: &QualitySettings,
) -> Option<Verdict> {
    let (h1, h2) = (a.frf.as_ref()?, b.frf.as_ref()?);
    let (mut cross, mut power1, mut power2) = (Complex64::ZERO, 0.0, 0.0);
    for (line, x) in h1.iter().enumerate() {
        let Some(y) = at_frequency(second, h2, first.lines.frequency(line)) else {
            continue;
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
        g if g < settings.reciprocity || level > settings.reciprocity_gain => Outcome::Doubtful,
        _ => Outcome::Good,
    };
    let sign = if opposite {
        ", but of opposite sign"
    } else {
        ""
    };
    let happened = format!(
        "Sensor {} here and sensor {} in {}, tap and sensor swapped, agree to {agreement:.3}{sign}, at a level ratio of {gain:.2} (limits {:.2} and 1 \u{b1} {:.1}).",
        a.name, b.name, second.file, settings.reciprocity, settings.reciprocity_gain
    );
    let subject = Subject::Sensor {
        file: first.file.clone(),
        sensor: a.name.clone(),
    };
    let verdict = Verdict::new(Check::Reciprocity, subject, settings.reciprocity);
    Some(verdict.found(agreement, outcome, happened))
}

/// An FRF at a frequency, linear between its lines; `None` outside its band.
fn at_frequency(
    recording: &RecordingEvidence,
    frf: &[Complex64],
    frequency: f64,
) -> Option<Complex64> {
    let place = (frequency - recording.lines.low) / recording.lines.spacing;
    let index = (place + 1e-9).floor();
    if index < 0.0 {
        return None;
    }
    let share = (place - index).max(0.0);
    let one = frf.get(index as usize)?;
    match frf.get(index as usize + 1) {
        Some(next) => Some(one * (1.0 - share) + next * share),
        None => (share < 1e-6).then_some(*one),
    }
}

/// Frequencies at two tap levels in one arrangement agree within their uncertainty.
pub fn check_linearity(
    recordings: &[RecordingEvidence],
    settings: &QualitySettings,
) -> Vec<Verdict> {
    let level_ratio = |first: &RecordingEvidence, second: &RecordingEvidence| {
        let (a, b) = (first.tap_level()?, second.tap_level()?);
        (a > 0.0 && b > 0.0).then(|| b / a)
    };
    let mut verdicts = Vec::new();
    for (index, first) in recordings.iter().enumerate() {
        for second in &recordings[index + 1..] {
            let Some(ratio) = level_ratio(first, second) else {
                continue;
            };
            let differ = ratio.max(1.0 / ratio) >= settings.two_levels;
            if differ && same_arrangement(first, second, settings) {
                let what = format!("at {ratio:.2} times the tap level");
                let order = |mode: &ResonanceEvidence| in_order(mode, first, recordings, settings);
                let pair = (first, second);
                verdicts.extend(shifts(Check::Linearity, pair, &what, &order, settings));
            }
        }
    }
    or_missing(
        verdicts,
        (Check::Linearity, settings),
        "Not applicable: no two recordings differ in the tap level alone; record once more with softer or harder taps.",
    )
}

/// Frequencies with the sensors elsewhere agree within their uncertainty.
pub fn check_mass_loading(
    recordings: &[RecordingEvidence],
    settings: &QualitySettings,
) -> Vec<Verdict> {
    let mut verdicts = Vec::new();
    // Each arrangement once, beside the first recording.
    if let Some((first, later)) = recordings.split_first() {
        let mut seen = vec![first];
        // A mass that is fastened moves frequencies by itself.
        for second in later.iter().filter(|one| one.fastened == first.fastened) {
            if seen
                .iter()
                .any(|known| same_sensors(known, second, settings))
            {
                continue;
            }
            seen.push(second);
            let what = "with the sensors elsewhere";
            let pair = (first, second);
            verdicts.extend(shifts(Check::MassLoading, pair, what, &|_| None, settings));
        }
    }
    or_missing(
        verdicts,
        (Check::MassLoading, settings),
        "Not applicable: the sensors are at the same places in all recordings; move or remove one and record again.",
    )
}

fn or_missing(
    mut verdicts: Vec<Verdict>,
    (check, settings): (Check, &QualitySettings),
    why: &str,
) -> Vec<Verdict> {
    if verdicts.is_empty() {
        verdicts.push(Verdict::new(check, Subject::Test, settings.deviations).missing(why));
    }
    verdicts
}

fn same_sensors(
    first: &RecordingEvidence,
    second: &RecordingEvidence,
    settings: &QualitySettings,
) -> bool {
    let near = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() <= settings.same_position,
        (a, b) => a == b,
    };
    let mut pairs = first.sensors.iter().zip(&second.sensors);
    first.sensors.len() == second.sensors.len() && pairs.all(|(a, b)| near(a.position, b.position))
}

fn same_arrangement(
    first: &RecordingEvidence,
    second: &RecordingEvidence,
    settings: &QualitySettings,
) -> bool {
    let same_tap = match (first.tap_position, second.tap_position) {
        (Some(a), Some(b)) => (a - b).abs() <= settings.same_position,
        (a, b) => a == b,
    };
    same_tap && first.fastened == second.fastened && same_sensors(first, second, settings)
}

/// One verdict for each mode of both recordings: its shift in standard deviations.
fn shifts(
    check: Check,
    (first, second): (&RecordingEvidence, &RecordingEvidence),
    what: &str,
    order: &dyn Fn(&ResonanceEvidence) -> Option<Order>,
    settings: &QualitySettings,
) -> Vec<Verdict> {
    let of_pair = |mode: &ResonanceEvidence| {
        let other = partner(mode, first, second, settings)?;
        let verdict = of_mode(first, check, (mode, settings.deviations));
        let shift = 100.0 * (other.frequency / mode.frequency - 1.0);
        let (Some(a), Some(b)) = (mode.std, other.std) else {
            return Some(verdict.missing(&format!(
                "Not applicable: {what} ({}) it moves by {} %, and its uncertainty is not known.",
                second.file,
                signed(shift)
            )));
        };
        let deviations =
            (other.frequency - mode.frequency).abs() / a.hypot(b).max(f64::MIN_POSITIVE);
        let happened = format!(
            "It moves by {} % {what} ({}), {} standard deviations (limit {:.0}).",
            signed(shift),
            second.file,
            times(deviations),
            settings.deviations
        );
        // Time, and mounting a sensor anew, move a frequency too, but seldom in the order of the levels.
        let usual = 0.01 * shift.abs() <= settings.drift;
        let follows = order(mode);
        let (outcome, more) = match &follows {
            _ if deviations <= settings.deviations => (Outcome::Good, String::new()),
            Some(order) => (Outcome::Doubtful, order.words()),
            None if usual => (
                Outcome::Good,
                format!(
                    " A joint's usual drift between recordings leaves up to {:.1} %.",
                    100.0 * settings.drift
                ),
            ),
            None => (Outcome::Doubtful, String::new()),
        };
        let happened = happened + &more;
        // What decides is shown: beyond chance the usual drift, unless the frequency follows the levels.
        let by_drift = deviations > settings.deviations && follows.is_none();
        Some(if by_drift {
            let verdict = verdict.against(settings.drift, "1");
            verdict.found(0.01 * shift.abs(), outcome, happened)
        } else {
            verdict.found(deviations, outcome, happened)
        })
    };
    first.resonances.iter().filter_map(of_pair).collect()
}

/// A change (%) with its sign, a minus sign for a hyphen.
fn signed(percent: f64) -> String {
    format!("{percent:+.3}").replace('-', "\u{2212}")
}

/// A frequency that follows the order of the tap levels.
struct Order {
    /// Over so many recordings.
    recordings: usize,
    /// Whether the levels only rose, or only fell, from one recording to the next as the test lists them.
    in_time: bool,
}

impl Order {
    fn words(&self) -> String {
        let settling = if self.in_time {
            " So it would with a joint that settles from one to the next: record the first level once more."
        } else {
            ""
        };
        format!(
            " Over {} recordings it follows the order of their levels.{settling}",
            self.recordings
        )
    }
}

/// Whether a mode's frequency follows the order of the tap levels: of all recordings in `first`'s arrangement that
/// read it, every frequency at one level is clearly on the same side of every one at the level below. A level is
/// another one where it is `two_levels` times the next lower recording's. `None` where it does not, or where so few
/// would by chance.
fn in_order(
    mode: &ResonanceEvidence,
    first: &RecordingEvidence,
    recordings: &[RecordingEvidence],
    settings: &QualitySettings,
) -> Option<Order> {
    let same = recordings
        .iter()
        .filter(|one| same_arrangement(first, one, settings));
    let mut seen: Vec<Seen> = same
        .filter_map(|one| {
            let own = partner(mode, first, one, settings)?;
            Some(Seen {
                level: one.tap_level()?,
                frequency: own.frequency,
                std: own.std?,
            })
        })
        .collect();
    let not_above = |a: &Seen, b: &Seen| a.level < settings.two_levels * b.level;
    let in_time = seen.is_sorted_by(not_above) || seen.is_sorted_by(|a, b| not_above(b, a));
    seen.sort_by(|a, b| a.level.total_cmp(&b.level));
    let levels: Vec<&[Seen]> = seen
        .chunk_by(|a, b| b.level < settings.two_levels * a.level)
        .collect();
    let clearly = |low: &Seen, high: &Seen, sign: f64| {
        sign * (high.frequency - low.frequency) > settings.deviations * low.std.hypot(high.std)
    };
    let all = |sign: f64| {
        levels.windows(2).all(|two| {
            let above = |low: &Seen| two[1].iter().all(|high| clearly(low, high, sign));
            two[0].iter().all(above)
        })
    };
    let follows = levels.len() > 1 && (all(1.0) || all(-1.0));
    let sizes: Vec<usize> = levels.iter().map(|level| level.len()).collect();
    (follows && chance_of_order(&sizes) <= LARGEST_CHANCE).then_some(Order {
        recordings: seen.len(),
        in_time,
    })
}

/// A mode's frequency (Hz) in one recording, and the level that it was tapped at.
struct Seen {
    level: f64,
    frequency: f64,
    std: f64,
}

/// Probability that values in random order rise, or fall, from level to level: 2 prod(n_k!)/n! with n_k of the n
/// values at each level.
fn chance_of_order(sizes: &[usize]) -> f64 {
    let ln_factorial = |n: usize| (2..=n).map(|k| (k as f64).ln()).sum::<f64>();
    let within: f64 = sizes.iter().map(|&n| ln_factorial(n)).sum();
    2.0 * (within - ln_factorial(sizes.iter().sum())).exp()
}

/// The nearest resonance of the other recording, where each is the other's nearest and both are within
/// what counts as the same mode.
fn partner<'a>(
    mode: &ResonanceEvidence,
    first: &RecordingEvidence,
    second: &'a RecordingEvidence,
    settings: &QualitySettings,
) -> Option<&'a ResonanceEvidence> {
    let other = nearest(&second.resonances, mode.frequency)?;
    let back = nearest(&first.resonances, other.frequency)?;
    let near = (other.frequency / mode.frequency - 1.0).abs() <= settings.same_mode;
    (near && back.frequency == mode.frequency).then_some(other)
}

fn nearest(modes: &[ResonanceEvidence], frequency: f64) -> Option<&ResonanceEvidence> {
    let distance = |mode: &&ResonanceEvidence| (mode.frequency - frequency).abs();
    modes
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

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
