//! One mode as the taps of one level saw it: frequency, damping, covariance, shape, amplitude.

use super::RecordingResult;
use super::analysis::Response;
use super::frf::form_of;
use super::measure::MeasuredSpectra;
use num_complex::Complex64;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;
use tapjoint_description::SensorKind;
use tapjoint_identify::observation::{
    AlongDecay, DecayEnd, DecayVerdict, Observed, ObservedMode, ShapeValue,
};
use tapjoint_numerics::stats::{median, root_mean_square};
use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudeVerdict, Trend};
use tapjoint_signal::modal::fit::{
    ColumnAmplitude, FittedValue, UncertaintySource, scatter_about_mean, weighted_mean,
};
use tapjoint_signal::modal::{FittedReading, ModeReading, ReadBy};
use tapjoint_signal::recording::ResponseForm;

/// A 95 % bound over the standard uncertainty of a normal distribution.
const BOUND: f64 = 1.96;

/// Amplitude at which a decay's late end is read, over the largest (1), where it was followed further: a
/// change with any power of the amplitude from 1/2 on is over there by two thirds, and beyond it
/// noise and neighbours bend the curve.
const LATE_SHARE: f64 = 0.1;

/// A mode, and the taps that count.
pub(super) struct ModeSeen<'a> {
    number: usize,
    reading: &'a ModeReading,
    recording: &'a RecordingResult,
    /// The taps of this level.
    taps: &'a [usize],
    pub(super) frequency: Repeats,
    damping: Option<Repeats>,
}

impl<'a> ModeSeen<'a> {
    /// From a reading; `only`: whether these are all taps of the recording.
    pub fn new(
        number: usize,
        reading: &'a ModeReading,
        (recording, taps, only): (&'a RecordingResult, &'a [usize], bool),
    ) -> Self {
        let fit = reading.fit.as_deref().map(|fit| &fit.mode);
        let fit = fit.filter(|_| reading.source == ReadBy::Fit);
        let of_taps = |of: fn(&tapjoint_signal::modal::fit::TapFit) -> (f64, f64)| {
            let fits = fit.map_or(&[][..], |fit| fit.taps.as_slice());
            let counted = fits.iter().filter(|tap| taps.contains(&tap.tap));
            counted.map(|tap| (tap.tap, of(tap).0, of(tap).1)).collect()
        };
        let inflation = fit.map_or(1.0, |fit| fit.inflation);
        let frequency = Repeats::new(
            of_taps(|tap| (tap.frequency, tap.frequency_std)),
            fit.map(|fit| &fit.frequency).filter(|_| only),
            inflation,
        );
        let damping = Repeats::new(
            of_taps(|tap| (tap.damping_ratio, tap.damping_std)),
            fit.map(|fit| &fit.damping_ratio).filter(|_| only),
            inflation,
        );
        // Without a fit the reading is what there is.
        let read = Repeats {
            taps: Vec::new(),
            by_noise: Observed {
                value: reading.frequency,
                std: reading.std.unwrap_or(f64::NAN),
                freedom: None,
            },
            scattered: false,
        };
        ModeSeen {
            number,
            reading,
            recording,
            taps,
            frequency: frequency.unwrap_or(read),
            damping,
        }
    }

    /// Whether its frequency is that of these taps, and not of the whole recording.
    pub fn is_of_taps(&self) -> bool {
        !self.frequency.taps.is_empty()
    }

    /// Natural frequency (Hz).
    pub fn frequency(&self) -> Observed {
        self.frequency.observed()
    }

    /// The plain data; `hardest`: whether what belongs to all taps of the recording stands here.
    pub fn observed(&self, hardest: bool) -> ObservedMode {
        let frequency = self.frequency();
        let shape = self.shape();
        let reference = reference(&shape);
        ObservedMode {
            mode: self.number,
            frequency: frequency.value,
            std: Some(frequency.std).filter(|std| std.is_finite()),
            freedom: frequency.freedom,
            repeats: self.frequency.taps.len(),
            damping: self.damping(),
            constant: reference
                .filter(|_| hardest)
                .and_then(|sensor| self.constant(sensor)),
            amplitude: reference.and_then(|sensor| self.amplitude(sensor)),
            decay: self
                .fit()
                .filter(|_| hardest)
                .and_then(|fit| self.along_decay(fit.amplitude.as_ref()?, &shape)),
            shape,
            reference,
        }
    }

    /// The shape, and the modal constant (1/kg) where it is 1.
    pub fn shape_and_constant(&self) -> (Vec<ShapeValue>, Option<Observed>) {
        let shape = self.shape();
        let constant = reference(&shape).and_then(|sensor| self.constant(sensor));
        (shape, constant)
    }

    fn fit(&self) -> Option<&'a FittedReading> {
        self.reading.fit.as_deref()
    }

    fn damping(&self) -> Option<Observed> {
        if let Some(damping) = &self.damping {
            return Some(damping.observed());
        }
        Some(Observed {
            value: self.reading.damping_ratio?,
            std: self.reading.damping_std?,
            freedom: None,
        })
    }

    /// Time derivatives of the displacement that a sensor senses; `None` where nobody said.
    fn derivatives(&self, sensor: usize) -> Option<i32> {
        let response = self.recording.responses.get(sensor)?;
        derivatives(response, self.recording.tap_unit.as_deref())
    }

    /// The sensor's amplitudes of the taps that count, as displacements where its quantity is known.
    fn displacements(&self, sensor: usize) -> Vec<(usize, Complex64, f64)> {
        let Some(fit) = self.fit().filter(|_| !self.hears_sound(sensor)) else {
            return Vec::new();
        };
        // x_k = p^k x of a free decay with k time derivatives; without a known quantity all are alike.
        let factor = fit.mode.pole.powi(-self.derivatives(sensor).unwrap_or(0));
        let counts = |amplitude: &&ColumnAmplitude| {
            amplitude.sensor == sensor
                && (self.taps.is_empty() || self.taps.contains(&amplitude.tap))
        };
        let amplitudes = fit.mode.amplitudes.iter().filter(counts);
        amplitudes
            .map(|a| (a.tap, a.value * factor, a.std * factor.norm()))
            .collect()
    }

    fn hears_sound(&self, sensor: usize) -> bool {
        let response = self.recording.responses.get(sensor);
        response.is_some_and(|response| response.kind == Some(SensorKind::Sound))
    }

    /// Displacements over those at the strongest sensor, tap by tap and then as the taps repeat.
    fn shape(&self) -> Vec<ShapeValue> {
        let sensors = self.recording.responses.len();
        let all: Vec<Vec<(usize, Complex64, f64)>> = (0..sensors)
            .map(|sensor| self.displacements(sensor))
            .collect();
        let size = |sensor: usize| {
            let sizes: Vec<f64> = all[sensor].iter().map(|one| one.1.norm()).collect();
            root_mean_square(&sizes)
        };
        let seen = (0..sensors).filter(|&sensor| !all[sensor].is_empty());
        let Some(reference) = seen.max_by(|&a, &b| size(a).total_cmp(&size(b))) else {
            return Vec::new();
        };
        let value = |sensor: usize| {
            let ratios = ratios(&all[sensor], &all[reference]);
            let observed = Repeats::new(ratios, None, 1.0)?.observed();
            Some(ShapeValue {
                sensor,
                value: observed.value,
                std: observed.std,
            })
        };
        let one = ShapeValue {
            sensor: reference,
            value: 1.0,
            std: 0.0,
        };
        (0..sensors)
            .filter_map(|sensor| {
                if sensor == reference {
                    Some(one)
                } else {
                    value(sensor)
                }
            })
            .collect()
    }

    /// Modal constant of the recording at a sensor (1/kg): over all its taps, the shape is linear.
    fn constant(&self, sensor: usize) -> Option<Observed> {
        let constants = &self.fit()?.constants;
        let found = constants
            .iter()
            .find(|constant| constant.sensor == sensor)?;
        let spectra = self.recording.measurement.spectra.as_ref();
        let of_force = spectra.map(|spectra| noise_of_force(spectra, self.reading));
        let of_force = of_force.unwrap_or(Some(ForceNoise::NONE))?;
        Some(Observed {
            value: found.value,
            std: of_force.added_to(found.std, found.value),
            freedom: None,
        })
    }

    /// Median displacement amplitude at the decays' begin (m).
    fn amplitude(&self, sensor: usize) -> Option<f64> {
        self.derivatives(sensor)?;
        let amplitudes = self.displacements(sensor);
        let mut sizes: Vec<f64> = amplitudes.iter().map(|one| one.1.norm()).collect();
        (!sizes.is_empty() && self.is_of_decays()).then(|| median(&mut sizes))
    }

    /// Functions from a file have residues, which are no amplitudes.
    fn is_of_decays(&self) -> bool {
        self.recording.sample_rate.is_some()
    }

    fn along_decay(&self, curve: &AmplitudeCurve, shape: &[ShapeValue]) -> Option<AlongDecay> {
        let (frequency, damping) = (curve.frequency.as_ref()?, curve.damping.as_ref()?);
        let freedom = Some(curve.points.len() as f64 - 2.0);
        let slope = |trend: &Trend| Observed {
            value: trend.slope,
            std: trend.slope_std,
            freedom,
        };
        let amplitudes = || curve.points.iter().map(|point| point.amplitude);
        let end = |amplitude: f64| self.decay_end(curve, amplitude, shape);
        let most = amplitudes().fold(0.0, f64::max);
        let least = amplitudes().fold(f64::INFINITY, f64::min);
        let late = least.max(most * LATE_SHARE);
        let change = frequency.between(late, most);
        Some(AlongDecay {
            frequency_slope: slope(frequency),
            frequency_change: change.map(|(value, std)| Observed {
                value,
                std,
                freedom: Some(frequency.freedom()),
            }),
            damping_slope: slope(damping),
            early: end(most)?,
            late: end(late)?,
            verdict: match curve.verdict {
                AmplitudeVerdict::Changes => DecayVerdict::Changes,
                AmplitudeVerdict::Steady => DecayVerdict::Steady,
                AmplitudeVerdict::Beating { .. } | AmplitudeVerdict::Unresolved { .. } => {
                    DecayVerdict::Doubtful
                }
                AmplitudeVerdict::TooFewPoints => return None,
            },
        })
    }

    fn decay_end(
        &self,
        curve: &AmplitudeCurve,
        amplitude: f64,
        shape: &[ShapeValue],
    ) -> Option<DecayEnd> {
        let reading = curve.at_amplitude(amplitude)?;
        // The curve's sensor may be another than the one of the shape; |x_k| = omega^k |x|.
        let displacement = curve.sensor.and_then(|sensor| {
            let omega = TAU * reading.frequency;
            let own = amplitude / omega.powi(self.derivatives(sensor)?);
            let share = shape
                .iter()
                .find(|value| value.sensor == sensor)?
                .value
                .abs();
            (share > 0.0).then(|| own / share)
        });
        let observed = |value: f64, bound: f64| Observed {
            value,
            std: bound / BOUND,
            freedom: None,
        };
        Some(DecayEnd {
            amplitude: displacement,
            frequency: observed(reading.frequency, reading.frequency_bound),
            damping: observed(reading.damping_ratio, reading.damping_bound),
        })
    }
}

/// The sensor where a shape is 1 by definition.
fn reference(shape: &[ShapeValue]) -> Option<usize> {
    let one = shape.iter().find(|value| value.std == 0.0);
    one.map(|value| value.sensor)
}

/// Real part of each tap's ratio and its standard uncertainty, sqrt(s^2 + |r|^2 s_ref^2)/|a_ref|.
fn ratios(
    sensor: &[(usize, Complex64, f64)],
    reference: &[(usize, Complex64, f64)],
) -> Vec<(usize, f64, f64)> {
    let ratio = |&(tap, value, std): &(usize, Complex64, f64)| {
        let &(_, other, other_std) = reference.iter().find(|one| one.0 == tap)?;
        let ratio = value / other;
        let std = std.hypot(ratio.norm() * other_std) / other.norm();
        (ratio.is_finite() && std > 0.0).then_some((tap, ratio.re, std))
    };
    sensor.iter().filter_map(ratio).collect()
}

/// By what the description says the sensor senses, else by its unit.
fn derivatives(response: &Response, force_unit: Option<&str>) -> Option<i32> {
    let form = match response.kind {
        Some(SensorKind::Acceleration) => Some(ResponseForm::Accelerance),
        Some(SensorKind::Velocity) => Some(ResponseForm::Mobility),
        Some(SensorKind::Displacement) => Some(ResponseForm::Receptance),
        Some(SensorKind::Sound) => None,
        None => form_of(response, force_unit),
    };
    form.map(|form| match form {
        ResponseForm::Receptance => 0,
        ResponseForm::Mobility => 1,
        ResponseForm::Accelerance => 2,
    })
}

/// A scatter less probable than this is not noise alone. 5 %, more lenient than for one mode of a report:
/// an uncertainty that is too small makes effects out of nothing, one that is a little too large costs
/// little.
const SCATTER_LEVEL: f64 = 0.05;
/// Fewer taps say nothing of their scatter.
pub(super) const LEAST_TAPS: usize = 3;
/// With more degrees of freedom than this Student's t is as good as normal: 2 % wider at 100.
const KNOWN: f64 = 100.0;

/// What repeated taps say of one quantity.
#[derive(Debug, Clone)]
pub(super) struct Repeats {
    /// Number of the tap, its value and that value's standard uncertainty from noise.
    pub taps: Vec<(usize, f64, f64)>,
    /// What the noise alone says of all of them.
    pub by_noise: Observed,
    /// Whether they scatter more than that.
    pub scattered: bool,
}

impl Repeats {
    /// From the taps' own values; `joint` is what a fit of all taps together says, where these are all
    /// of them, and `inflation` what else its noise is known to be larger by.
    pub fn new(
        taps: Vec<(usize, f64, f64)>,
        joint: Option<&FittedValue>,
        inflation: f64,
    ) -> Option<Self> {
        let by_noise = match joint {
            Some(joint) if joint.source == UncertaintySource::Residual => Observed {
                value: joint.value,
                std: joint.std,
                freedom: freedom(joint.freedom),
            },
            _ => mean_by_noise(&taps, inflation)?,
        };
        let mut repeats = Repeats {
            taps,
            by_noise,
            scattered: false,
        };
        repeats.scattered = repeats.probability().is_some_and(|p| p < SCATTER_LEVEL);
        Some(repeats)
    }

    fn pairs(&self) -> Vec<(f64, f64)> {
        self.taps.iter().map(|tap| (tap.1, tap.2)).collect()
    }

    /// Chi-squared of the scatter, and its degrees of freedom; `None` with too few taps.
    fn chi_squared(&self) -> Option<(f64, f64)> {
        let taps = self.pairs();
        (taps.len() >= LEAST_TAPS)
            .then(|| (scatter_about_mean(&taps), taps.len() as f64 - 1.0))
            .filter(|(chi_squared, _)| chi_squared.is_finite())
    }

    /// Probability that noise alone scatters as much; `None` with too few taps.
    fn probability(&self) -> Option<f64> {
        let (chi_squared, freedom) = self.chi_squared()?;
        Some(ChiSquared::new(freedom).ok()?.sf(chi_squared))
    }

    /// The value, from the noise or from the scatter.
    pub fn observed(&self) -> Observed {
        let taps = self.pairs();
        if let [(a, _), (b, _)] = taps[..] {
            // Of two, the half difference is a bound worth keeping and no more.
            let std = self.by_noise.std.max(0.5 * (a - b).abs());
            return Observed {
                std,
                freedom: None,
                ..self.by_noise
            };
        }
        if !self.scattered {
            return self.by_noise;
        }
        let (value, std) = weighted_mean(&taps);
        Observed {
            value,
            // Scatter cannot make a value better than the noise lets it be.
            std: std.max(self.by_noise.std),
            freedom: Some(taps.len() as f64 - 1.0),
        }
    }
}

fn freedom(value: f64) -> Option<f64> {
    (value < KNOWN).then_some(value)
}

/// Weighted mean with the weights 1/std^2, and its standard uncertainty.
fn mean_by_noise(taps: &[(usize, f64, f64)], inflation: f64) -> Option<Observed> {
    let total: f64 = taps.iter().map(|tap| tap.2.powi(-2)).sum();
    let mean = taps.iter().map(|tap| tap.1 * tap.2.powi(-2)).sum::<f64>() / total;
    (total > 0.0 && mean.is_finite()).then(|| Observed {
        value: mean,
        std: inflation / total.sqrt(),
        freedom: None,
    })
}

/// Judges the frequencies' scatter over all modes together: what makes the structure differ between
/// taps moves several modes a little, and is seen in their sum where it is not in each. Then every mode
/// that scatters beyond its noise at all counts as scattered.
pub(super) fn judge_scatter(modes: &mut [ModeSeen<'_>]) {
    let sums = modes.iter().filter_map(|mode| mode.frequency.chi_squared());
    let (chi_squared, freedom) = sums.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    let probability = ChiSquared::new(freedom).map_or(1.0, |d| d.sf(chi_squared));
    if probability >= SCATTER_LEVEL {
        return;
    }
    for mode in modes {
        let own = mode.frequency.chi_squared();
        mode.frequency.scattered |= own.is_some_and(|(chi_squared, freedom)| chi_squared > freedom);
    }
}

/// Least shrinkage of a correlation from so few taps: it keeps the matrix well conditioned where taps
/// are fewer than modes.
const LEAST_SHRINKAGE: f64 = 0.1;

/// Modes that have nothing in common; `None` where one has no uncertainty.
pub(super) fn independent(modes: &[ObservedMode]) -> Option<Vec<Vec<f64>>> {
    let stds: Vec<f64> = modes.iter().map(|mode| mode.std).collect::<Option<_>>()?;
    Some(with_correlation(&stds, |_, _| 0.0))
}

fn with_correlation(stds: &[f64], correlation: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let entry = |i: usize, j: usize| {
        let r = if i == j { 1.0 } else { correlation(i, j) };
        r * stds[i] * stds[j]
    };
    let row = |i: usize| (0..stds.len()).map(|j| entry(i, j)).collect();
    (0..stds.len()).map(row).collect()
}

/// Variances of the modes' frequencies, and where several scatter from tap to tap more than noise does,
/// the correlation of that scatter. Noise itself is independent between modes.
pub(super) fn of_taps(modes: &[ModeSeen<'_>]) -> Option<Vec<Vec<f64>>> {
    let stds: Vec<f64> = modes.iter().map(|mode| mode.frequency().std).collect();
    if stds.iter().any(|std| !std.is_finite()) {
        return None;
    }
    let scattered: Vec<usize> = (0..modes.len())
        .filter(|&index| modes[index].frequency.scattered)
        .collect();
    let correlation = shrunk_correlation(modes, &scattered);
    Some(with_correlation(&stds, |i, j| {
        let place = |index: usize| scattered.iter().position(|&s| s == index);
        match (&correlation, place(i), place(j)) {
            (Some(correlation), Some(i), Some(j)) => correlation[i][j],
            _ => 0.0,
        }
    }))
}

/// Correlations between the taps' deviations, shrunk towards none as Schaefer & Strimmer 2005 do:
/// lambda = sum var(r)/sum r^2 with var(r) about (1 - r^2)^2/(n - 1); `None` with too few taps that
/// have all these modes.
fn shrunk_correlation(modes: &[ModeSeen<'_>], which: &[usize]) -> Option<Vec<Vec<f64>>> {
    let taps = |&index: &usize| &modes[index].frequency.taps;
    let of = |index: &usize, tap: usize| taps(index).iter().find(|t| t.0 == tap).map(|t| t.1);
    let common: Vec<usize> = taps(which.first()?)
        .iter()
        .map(|tap| tap.0)
        .filter(|&tap| which.iter().all(|index| of(index, tap).is_some()))
        .collect();
    if which.len() < 2 || common.len() < LEAST_TAPS {
        return None;
    }
    let columns: Vec<Vec<f64>> = which
        .iter()
        .map(|index| unit_deviations(common.iter().filter_map(|&tap| of(index, tap)).collect()))
        .collect();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let sample: Vec<Vec<f64>> = columns
        .iter()
        .map(|a| columns.iter().map(|b| product(a, b)).collect())
        .collect();
    let pairs = || (0..which.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let squares: f64 = pairs().map(|(i, j)| sample[i][j].powi(2)).sum();
    let spread = |r: f64| (1.0 - r * r).powi(2) / (common.len() as f64 - 1.0);
    let variances: f64 = pairs().map(|(i, j)| spread(sample[i][j])).sum();
    let shrinkage = (variances / squares.max(f64::MIN_POSITIVE)).clamp(LEAST_SHRINKAGE, 1.0);
    let shrunk = |row: Vec<f64>| row.into_iter().map(|r| (1.0 - shrinkage) * r).collect();
    Some(sample.into_iter().map(shrunk).collect())
}

/// Deviations from the mean, scaled to a unit sum of squares.
fn unit_deviations(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|value| *value -= mean);
    let size = values.iter().map(|x| x * x).sum::<f64>().sqrt();
    let size = size.max(f64::MIN_POSITIVE);
    values.iter_mut().for_each(|value| *value /= size);
    values
}

/// What the hammer's noise leaves in a ratio to its force (1, relative).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ForceNoise {
    /// At random: it shows in the scatter of the taps as well.
    random: f64,
    /// In common.
    common: f64,
}

impl ForceNoise {
    pub(super) const NONE: ForceNoise = ForceNoise {
        random: 0.0,
        common: 0.0,
    };

    /// Of n taps: r/sqrt(2 n), the half of the noise's power that is in phase, and r^2, by which the mean square of a
    /// noisy force is too large. r is the noise over the force without it, whose root mean squares are given (N s).
    ///
    /// `None` where there is no more than noise.
    fn of(noise: f64, measured: f64, taps: usize) -> Option<Self> {
        let squared = noise * noise / (measured * measured - noise * noise);
        let taps = taps.max(1) as f64;
        (measured > noise).then(|| ForceNoise {
            random: (squared / (2.0 * taps)).sqrt(),
            common: squared,
        })
    }

    /// The standard uncertainty of a value with that of its taps.
    pub(super) fn added_to(self, std: f64, value: f64) -> f64 {
        std.max(self.random * value.abs())
            .hypot(self.common * value)
    }
}

/// The same at a mode's line; none without a hammer or a quiet stretch.
pub(super) fn noise_of_force(
    spectra: &MeasuredSpectra,
    reading: &ModeReading,
) -> Option<ForceNoise> {
    let averages = &spectra.averages;
    let line = averages.lines.nearest(reading.frequency);
    let at_line = |values: &Option<Vec<f64>>| values.as_ref()?.get(line).copied();
    match at_line(&spectra.force_noise).zip(at_line(&averages.force)) {
        Some((noise, force)) => ForceNoise::of(noise, force, averages.taps),
        None => Some(ForceNoise::NONE),
    }
}

/// A reading's shape at the sensors of its recording, over all taps, and its modal constant (1/kg) at the
/// strongest sensor.
pub(super) fn shape_of(
    reading: &ModeReading,
    recording: &RecordingResult,
) -> (Vec<ShapeValue>, Option<Observed>) {
    let taps: Vec<usize> = (0..recording.measurement.taps.accepted().count()).collect();
    ModeSeen::new(0, reading, (recording, &taps, true)).shape_and_constant()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_the_force_is_as_certain_as_it_is_clear_of_noise() {
        assert_eq!(ForceNoise::of(0.0, 1.0, 5), Some(ForceNoise::NONE));
        assert_eq!(ForceNoise::of(1.0, 1.0, 5), None);
        assert_eq!(ForceNoise::NONE.added_to(0.3, 2.0), 0.3);
        // r^2 = 1/9: noise of 1 beside a force of 3, in a measured root mean square of sqrt(10).
        let found = ForceNoise::of(1.0, 10.0_f64.sqrt(), 2).unwrap();
        let random = (1.0 / 36.0_f64).sqrt();
        assert!((found.random - random).abs() < 1e-12, "{found:?}");
        assert!((found.common - 1.0 / 9.0).abs() < 1e-12, "{found:?}");
        // The taps' scatter holds the random part already.
        let added = found.added_to(0.5, -2.0);
        assert!((added - 0.5_f64.hypot(2.0 / 9.0)).abs() < 1e-12, "{added}");
    }
}
