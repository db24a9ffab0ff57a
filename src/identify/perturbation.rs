//! Effect of errors in the frequencies on an estimate.
//!
//! Generic over the estimator, a function from frequencies (Hz) to stiffnesses that may have no
//! answer; what is asked of it: all frequencies off by one percentage, one mode off by its own
//! resolution bound, and sign patterns of all bounds.

use super::IdentifyError;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Perturbations of Ingole & Chatterjee's table 9 (%).
pub const PAPER_PERCENTS: [f64; 2] = [0.05, 0.1];

/// Up to so many modes all sign patterns are tried: every further mode has twice as many.
pub const SIGN_PATTERN_MODES: usize = 10;

/// Of more modes so many patterns are drawn. One more draw lies outside their span with a probability of 2/257.
pub const DRAWN_PATTERNS: usize = 256;

/// Stiffnesses of one estimate (1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffnesses {
    /// Kx (1).
    pub kx: f64,
    /// Ky (1).
    pub ky: f64,
    /// Kz (1), where the model has it.
    pub kz: Option<f64>,
}

impl Stiffnesses {
    /// 100 (self - nominal)/nominal (%) of each.
    pub fn percent_of(&self, nominal: &Self) -> Self {
        self.combined(nominal, |value, nominal| {
            100.0 * (value - nominal) / nominal
        })
    }

    fn combined(&self, other: &Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            kx: combine(self.kx, other.kx),
            ky: combine(self.ky, other.ky),
            kz: (self.kz.zip(other.kz)).map(|(own, other)| combine(own, other)),
        }
    }
}

/// The estimate with every frequency off by the same percentage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UniformPerturbation {
    /// Change of all frequencies (%).
    pub percent: f64,
    /// The estimate, where there is one.
    pub estimate: Option<Stiffnesses>,
}

/// Average errors of a perturbation and its opposite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AverageError {
    /// Size of the change of all frequencies (%).
    pub percent: f64,
    /// Mean of the two errors' magnitudes (%), as in table 9.
    pub mean_magnitude: Stiffnesses,
    /// Magnitude of the error of the two estimates' mean (%), as in table 14: smaller, because
    /// opposite errors cancel.
    pub of_mean: Stiffnesses,
}

/// Estimates with all frequencies raised and lowered by each percentage, in the order +p1, -p1,
/// +p2, ...
pub fn perturb_uniformly(
    frequencies: &[f64],
    percents: &[f64],
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses>,
) -> Vec<UniformPerturbation> {
    let both = percents.iter().flat_map(|&percent| [percent, -percent]);
    both.map(|percent| {
        let factor = 1.0 + percent / 100.0;
        let shifted: Vec<f64> = frequencies.iter().map(|f| factor * f).collect();
        UniformPerturbation {
            percent,
            estimate: estimator(&shifted),
        }
    })
    .collect()
}

/// Average errors of the pairs +p, -p among uniform perturbations; a pair without both estimates
/// has none.
pub fn average_errors(nominal: &Stiffnesses, rows: &[UniformPerturbation]) -> Vec<AverageError> {
    let rising = rows.iter().filter(|row| row.percent > 0.0);
    rising
        .filter_map(|plus| {
            let minus = rows.iter().find(|row| row.percent == -plus.percent)?;
            let above = plus.estimate?.percent_of(nominal);
            let below = minus.estimate?.percent_of(nominal);
            Some(AverageError {
                percent: plus.percent,
                mean_magnitude: above.combined(&below, |p, m| 0.5 * (p.abs() + m.abs())),
                of_mean: above.combined(&below, |p, m| (0.5 * (p + m)).abs()),
            })
        })
        .collect()
}

/// Effect of one mode alone on the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeSensitivity {
    /// Position of the mode in the list of frequencies, from 0.
    pub index: usize,
    /// Half of the difference (%) between the estimates with this mode one bound high and low.
    pub percent_per_bound: Option<Stiffnesses>,
    /// Change of the estimate (%) per change of this frequency (%), for small changes.
    pub percent_per_percent: Option<Stiffnesses>,
}

/// Returns the effect of each mode alone under its own bound (Hz).
///
/// # Errors
/// [`IdentifyError::Bounds`] unless there is one bound for each frequency.
pub fn mode_sensitivities(
    frequencies: &[f64],
    bounds: &[f64],
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses>,
) -> Result<Vec<ModeSensitivity>, IdentifyError> {
    check_bounds(frequencies, bounds)?;
    let nominal = estimator(frequencies);
    let mut sensitivities = Vec::with_capacity(frequencies.len());
    for (index, (frequency, &bound)) in frequencies.iter().zip(bounds).enumerate() {
        let small = SMALL_PERCENT / 100.0 * frequency;
        let [by_small, by_bound] = [small, bound].map(|step| {
            let mut steps = vec![0.0; frequencies.len()];
            steps[index] = step;
            half_difference(frequencies, &steps, nominal.as_ref(), &estimator)
        });
        sensitivities.push(ModeSensitivity {
            index,
            percent_per_bound: by_bound,
            percent_per_percent: by_small.map(per_percent),
        });
    }
    Ok(sensitivities)
}

/// Step of a derivative (%): 1e-5 of a frequency. What it neglects is some 1e-10 of the derivative. A search that ends
/// within 1e-11 of its goal leaves six digits. The closed form leaves ten.
const SMALL_PERCENT: f64 = 1e-3;

/// Change per percent from that by [`SMALL_PERCENT`].
fn per_percent(change: Stiffnesses) -> Stiffnesses {
    change.combined(&change, |change, _| change / SMALL_PERCENT)
}

/// Returns half of the difference (%) between the estimates with the frequencies these steps (Hz) higher and lower.
fn half_difference(
    frequencies: &[f64],
    steps: &[f64],
    nominal: Option<&Stiffnesses>,
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses>,
) -> Option<Stiffnesses> {
    let [high, low] = [1.0, -1.0].map(|sign| {
        let moved = frequencies.iter().zip(steps);
        let moved: Vec<f64> = moved
            .map(|(frequency, step)| frequency + sign * step)
            .collect();
        estimator(&moved)
    });
    let change = high?.combined(&low?, |high, low| 0.5 * (high - low));
    Some(change.combined(nominal?, |change, nominal| 100.0 * change / nominal))
}

/// Effect of one factor on all frequencies, as of a bar that is not as described.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommonSensitivity {
    /// Half of the difference (%) between the estimates with the factor one bound high and low.
    pub percent_per_bound: Option<Stiffnesses>,
    /// Change of the estimate (%) per change of all frequencies (%), for small changes.
    pub percent_per_percent: Option<Stiffnesses>,
}

/// Returns the effect of one factor on all frequencies, known to `percent` (%).
pub fn common_sensitivity(
    frequencies: &[f64],
    percent: f64,
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses>,
) -> CommonSensitivity {
    let nominal = estimator(frequencies);
    let [by_small, by_bound] = [SMALL_PERCENT, percent].map(|percent| {
        let steps: Vec<f64> = frequencies.iter().map(|f| percent / 100.0 * f).collect();
        half_difference(frequencies, &steps, nominal.as_ref(), &estimator)
    });
    CommonSensitivity {
        percent_per_bound: by_bound,
        percent_per_percent: by_small.map(per_percent),
    }
}

/// Smallest and largest value of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Smallest value (1).
    pub low: f64,
    /// Largest value (1).
    pub high: f64,
}

/// Spans of the estimate over all sign patterns of the bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignPatternSpans {
    /// Span of Kx; `None` where no pattern has an estimate.
    pub kx: Option<Span>,
    /// Span of Ky.
    pub ky: Option<Span>,
    /// Span of Kz; `None` as well where its sign changes, for then it passes through infinity.
    pub kz: Option<Span>,
    /// Number of patterns tried.
    pub patterns: usize,
    /// Number of those without an estimate.
    pub failed: usize,
}

/// Spans of the estimate under the combinations of +bound and -bound (Hz), and unperturbed.
///
/// # Errors
/// As [`sign_pattern_estimates`].
pub fn sign_pattern_spans(
    frequencies: &[f64],
    bounds: &[f64],
    seed: u64,
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses> + Sync,
) -> Result<SignPatternSpans, IdentifyError> {
    let patterns = sign_pattern_estimates(frequencies, bounds, seed, &estimator)?;
    Ok(spans_of(estimator(frequencies), &patterns))
}

/// The estimate under each of the 2^n combinations of +bound and -bound (Hz). Beyond [`SIGN_PATTERN_MODES`] modes
/// [`DRAWN_PATTERNS`] combinations are drawn at random instead. The same seed gives the same ones.
///
/// # Errors
/// [`IdentifyError::Bounds`] unless there is one bound for each frequency.
pub fn sign_pattern_estimates(
    frequencies: &[f64],
    bounds: &[f64],
    seed: u64,
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses> + Sync,
) -> Result<Vec<Option<Stiffnesses>>, IdentifyError> {
    check_bounds(frequencies, bounds)?;
    let all = frequencies.len() <= SIGN_PATTERN_MODES;
    let patterns = match all {
        true => 1 << frequencies.len(),
        false => DRAWN_PATTERNS,
    };
    let estimates = (0..patterns).into_par_iter().map(|pattern| {
        // A stream for each pattern: the thread that draws it does not matter.
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(pattern as u64);
        let mut shifted = frequencies.to_vec();
        for (index, bound) in bounds.iter().enumerate() {
            let up = match all {
                true => pattern >> index & 1 == 1,
                false => random.random(),
            };
            shifted[index] += if up { *bound } else { -bound };
        }
        estimator(&shifted)
    });
    Ok(estimates.collect())
}

/// Smallest and largest values of the unperturbed estimate and those of all patterns.
pub fn spans_of(
    nominal: Option<Stiffnesses>,
    patterns: &[Option<Stiffnesses>],
) -> SignPatternSpans {
    let mut spans = SignPatternSpans {
        kx: None,
        ky: None,
        kz: None,
        patterns: patterns.len(),
        failed: patterns.iter().filter(|found| found.is_none()).count(),
    };
    let mut kz_signs = [false, false];
    for estimate in patterns.iter().flatten().chain(&nominal) {
        widen(&mut spans.kx, estimate.kx);
        widen(&mut spans.ky, estimate.ky);
        if let Some(kz) = estimate.kz {
            widen(&mut spans.kz, kz);
            kz_signs[usize::from(kz < 0.0)] = true;
        }
    }
    if kz_signs == [true, true] {
        spans.kz = None;
    }
    spans
}

fn widen(span: &mut Option<Span>, value: f64) {
    let (low, high) = span.map_or((value, value), |span| (span.low, span.high));
    *span = Some(Span {
        low: low.min(value),
        high: high.max(value),
    });
}

fn check_bounds<T>(frequencies: &[f64], bounds: &[T]) -> Result<(), IdentifyError> {
    if frequencies.len() == bounds.len() {
        Ok(())
    } else {
        Err(IdentifyError::Bounds {
            frequencies: frequencies.len(),
            bounds: bounds.len(),
        })
    }
}

// Random errors of the frequencies, carried through an estimator by repetition.

/// Random error of a frequency: the sum of a uniform and of a normal part.
///
/// A frequency that was read on a spectral line lies anywhere within half a line. Its scatter is normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadingError {
    /// Half width of the uniform part (Hz); 0 without one.
    half_width: f64,
    /// Standard deviation of the normal part (Hz).
    normal: f64,
}

impl ReadingError {
    /// Returns the error of this standard deviation (Hz) whose uniform part has this half width (Hz). A uniform part that
    /// is larger than the whole is cut to it.
    pub fn new(std: f64, half_width: f64) -> Self {
        let half_width = half_width.clamp(0.0, 3f64.sqrt() * std);
        let normal = std * std - half_width * half_width / 3.0;
        Self {
            half_width,
            normal: normal.max(0.0).sqrt(),
        }
    }

    /// Returns the error with another normal part (Hz) in addition.
    #[must_use]
    pub fn with_normal(self, std: f64) -> Self {
        Self {
            normal: self.normal.hypot(std),
            ..self
        }
    }

    /// Returns a draw (Hz).
    pub fn draw(&self, random: &mut impl Rng) -> f64 {
        let normal: f64 = StandardNormal.sample(random);
        // An error without a uniform part takes no further number.
        let uniform = match self.half_width > 0.0 {
            true => random.random_range(-1.0..=1.0),
            false => 0.0,
        };
        self.normal * normal + self.half_width * uniform
    }
}

/// Middle and 95 % interval of a parameter over the repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Median (1).
    pub median: f64,
    /// 2.5 % point (1).
    pub low: f64,
    /// 97.5 % point (1).
    pub high: f64,
}

impl Spread {
    /// Returns the spread of these values; an infinite one, a rigid joint, counts as the largest there is.
    pub(crate) fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)? as f64;
        let [median, low, high] =
            [0.5, 0.025, 0.975].map(|share: f64| sorted[(share * last).round() as usize]);
        Some(Self { median, low, high })
    }
}

/// So many of the estimates are kept one by one: enough for a picture.
pub const KEPT: usize = 1000;

/// Estimates from randomly disturbed frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct MonteCarlo {
    /// Repetitions.
    pub samples: usize,
    /// Number of those without an estimate.
    pub failed: usize,
    /// Kx; `None` where no repetition has an estimate.
    pub kx: Option<Spread>,
    /// Ky.
    pub ky: Option<Spread>,
    /// Kz; of 1/Kz, turned back, so that a Kz near infinity of either sign does no harm; `None`
    /// where the interval of 1/Kz contains 0.
    pub kz: Option<Spread>,
    /// The first [`KEPT`] estimates.
    pub cloud: Vec<Stiffnesses>,
}

impl MonteCarlo {
    /// From the estimates of `samples` repetitions, those without one left out.
    pub fn of(samples: usize, found: &[Stiffnesses]) -> Self {
        let compliance = Spread::of(found.iter().filter_map(|e| e.kz).map(f64::recip));
        Self {
            samples,
            failed: samples - found.len(),
            kx: Spread::of(found.iter().map(|estimate| estimate.kx)),
            ky: Spread::of(found.iter().map(|estimate| estimate.ky)),
            kz: compliance.filter(|c| c.low * c.high > 0.0).map(|c| Spread {
                median: 1.0 / c.median,
                low: 1.0 / c.high,
                high: 1.0 / c.low,
            }),
            cloud: found.iter().take(KEPT).copied().collect(),
        }
    }
}

/// Repeats the estimate `samples` times with independent errors of the frequencies (Hz). The same seed gives the same
/// answer.
///
/// # Errors
/// [`IdentifyError::Bounds`] unless there is one error for each frequency.
pub fn monte_carlo(
    frequencies: &[f64],
    errors: &[ReadingError],
    samples: usize,
    seed: u64,
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses>,
) -> Result<MonteCarlo, IdentifyError> {
    check_bounds(frequencies, errors)?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Vec::with_capacity(samples);
    for _ in 0..samples {
        let disturbed: Vec<f64> = frequencies
            .iter()
            .zip(errors)
            .map(|(frequency, error)| frequency + error.draw(&mut random))
            .collect();
        found.extend(estimator(&disturbed));
    }
    Ok(MonteCarlo::of(samples, &found))
}
