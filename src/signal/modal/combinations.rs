//! Combination tones: peaks at sums and differences of a mode's frequency and that of a stronger line.
//!
//! A joint that slips is not linear, nor is a contact that opens and closes. A mode of frequency f_b changes such a joint in
//! its own rhythm. Every other line f_a then gets neighbours at f_a + n f_b and f_a - n f_b (Nayfeh & Mook 1979, chapter 4).
//! n is 1 where the joint is not symmetric, and 2 where it is (a cubic spring). The neighbours get neighbours in turn.
//!
//! Such a peak decays like a mode and is none. A mode may lie at such a place by chance. So peaks are only labelled where
//! there are far more of them than chance explains. Multiples of f_b are no evidence: strings and rods have modes there.

use num_complex::Complex64;
use statrs::distribution::{DiscreteCDF, Poisson};

use super::amplitude::AmplitudeVerdict;
use super::{Combination, ModeReading, PeakLabel};

/// Distance from the exact place, relative to the fundamental. 0.75 %: combinations arise while the amplitude is largest.
/// A bolted joint lowers the frequency there by up to this share.
const REACH: f64 = 0.0075;
/// Least ratio of the powers of a line and its neighbour at the beginning of the decay. 6 dB: a modulation by half of the
/// amplitude would be a strong one.
const WEAKER: f64 = 4.0;
/// Least ratio of a combination's decay to the faster one of its line and its fundamental. A product decays with the sum
/// of both. 0.7: the fits are means over decays along which the damping falls by half in a bolted joint.
const LEAST_DECAY: f64 = 0.7;
/// Least number of combinations.
const LEAST_NUMBER: u64 = 3;
/// Largest probability of so many by chance, over all fundamentals that are tried. It holds where the fundamental changes
/// with its amplitude: the structure is known to be nonlinear.
const LEVEL: f64 = 0.01;
/// The same where no change was seen.
const LEVEL_UNSEEN: f64 = 1e-4;

/// A fitted line.
struct Tone {
    /// Index of its reading.
    index: usize,
    /// Frequency (Hz).
    frequency: f64,
    /// Half the 95 % interval (Hz).
    bound: f64,
    /// Half-power half width (Hz).
    half_width: f64,
    /// Power over all taps and sensors at the beginning of the decay.
    power: f64,
    /// True where frequency or damping change with the amplitude.
    changes: bool,
}

/// A tone at the sum or the difference of a stronger line and the fundamental.
struct Candidate {
    /// Index of its reading.
    index: usize,
    sum: Combination,
    /// True for a multiple of the fundamental, which is labelled along with others.
    is_multiple: bool,
}

/// Labels fitted peaks as combinations, where more lie at such places than chance explains.
pub fn label_combinations(readings: &mut [ModeReading]) {
    let tones = tones_of(readings);
    let (Some(low), Some(high)) = (
        tones.iter().map(|tone| tone.frequency).reduce(f64::min),
        tones.iter().map(|tone| tone.frequency).reduce(f64::max),
    ) else {
        return;
    };
    let mut best: Option<(f64, Vec<Candidate>)> = None;
    for (fundamental, number) in tones.iter().flat_map(|tone| [(tone, 1), (tone, 2)]) {
        // Of a string's modes the second would have the others at its sums and differences.
        let mut lower = tones
            .iter()
            .filter(|tone| tone.frequency < fundamental.frequency);
        if lower.any(|tone| is_multiple(fundamental, tone)) {
            continue;
        }
        let found = combinations(&tones, fundamental, number);
        let expected = expected_by_chance(&tones, fundamental, high - low);
        let evidence = found.iter().filter(|one| !one.is_multiple);
        let count = evidence.count() as u64;
        let Ok(chance) = Poisson::new(expected.max(f64::MIN_POSITIVE)) else {
            continue;
        };
        if count < LEAST_NUMBER {
            continue;
        }
        let probability = chance.sf(count - 1) * 2.0 * tones.len() as f64;
        let level = match fundamental.changes {
            true => LEVEL,
            false => LEVEL_UNSEEN,
        };
        if probability < level && best.as_ref().is_none_or(|(least, _)| probability < *least) {
            best = Some((probability, found));
        }
    }
    for one in best.into_iter().flat_map(|(_, found)| found) {
        readings[one.index].label = Some(PeakLabel::Combination(one.sum));
    }
}

/// Peaks with a fit and without a label.
fn tones_of(readings: &[ModeReading]) -> Vec<Tone> {
    let mut tones = Vec::new();
    for (index, reading) in readings.iter().enumerate() {
        let (Some(fit), None) = (&reading.fit, reading.label) else {
            continue;
        };
        let mode = &fit.mode;
        let values = mode.amplitudes.iter().map(|one| one.value);
        tones.push(Tone {
            index,
            frequency: mode.frequency.value,
            bound: 0.5 * (mode.frequency.high - mode.frequency.low),
            half_width: mode.frequency.value * mode.damping_ratio.value,
            power: values.map(|value: Complex64| value.norm_sqr()).sum(),
            changes: (fit.amplitude.as_ref())
                .is_some_and(|curve| curve.verdict == AmplitudeVerdict::Changes),
        });
    }
    tones
}

/// Distance within which a tone lies at an exact place (Hz).
fn reach(tone: &Tone, fundamental: &Tone) -> f64 {
    // A tone that is known less well than this is no evidence.
    REACH * fundamental.frequency + tone.bound.min(REACH * fundamental.frequency)
}

/// Lines beside which a tone may be a combination.
fn stronger<'a>(
    tones: &'a [Tone],
    tone: &'a Tone,
    fundamental: &'a Tone,
) -> impl Iterator<Item = &'a Tone> {
    tones.iter().filter(move |line| {
        line.index != tone.index
            && line.power >= WEAKER * tone.power
            && fundamental.power >= WEAKER * tone.power
            && tone.half_width >= LEAST_DECAY * line.half_width.max(fundamental.half_width)
    })
}

/// The tones at sums and differences of stronger lines and `number` times the fundamental.
fn combinations(tones: &[Tone], fundamental: &Tone, number: i32) -> Vec<Candidate> {
    let mut found = Vec::new();
    let of = fundamental.frequency;
    let step = of * f64::from(number);
    for tone in tones.iter().filter(|tone| tone.index != fundamental.index) {
        let mut nearest: Option<(f64, Combination)> = None;
        for line in stronger(tones, tone, fundamental) {
            let distance = tone.frequency - line.frequency;
            let off = (distance.abs() - step).abs();
            if off <= reach(tone, fundamental)
                && nearest.as_ref().is_none_or(|(least, _)| off < *least)
            {
                let times = if distance < 0.0 { -number } else { number };
                let line = line.frequency;
                nearest = Some((off, Combination { line, times, of }));
            }
        }
        if let Some((_, sum)) = nearest {
            found.push(Candidate {
                index: tone.index,
                sum,
                is_multiple: is_multiple(tone, fundamental),
            });
        }
    }
    found
}

/// Error of a multiple's frequency for each time the fundamental's is taken, relative to it. 0.2 %: how far the frequency
/// of a mode that softens is usually off.
const OFF_MULTIPLE: f64 = 0.002;

/// Returns true where a tone lies at a multiple of the fundamental, from the double on.
fn is_multiple(tone: &Tone, fundamental: &Tone) -> bool {
    let of = fundamental.frequency;
    let times = (tone.frequency / of).round();
    times >= 2.0 && (tone.frequency - times * of).abs() <= (REACH + OFF_MULTIPLE * times) * of
}

/// Number of tones, multiples left out, that lie at sums and differences by chance, each anywhere over a band of this width (Hz).
fn expected_by_chance(tones: &[Tone], fundamental: &Tone, width: f64) -> f64 {
    let mut expected = 0.0;
    for tone in tones {
        if tone.index == fundamental.index || is_multiple(tone, fundamental) {
            continue;
        }
        let lines = stronger(tones, tone, fundamental).count() as f64;
        // Two places beside each line, each with a reach to either side.
        expected += (4.0 * lines * reach(tone, fundamental) / width).min(1.0);
    }
    expected
}
