//! One mode as the taps of one level saw it: frequency, damping, covariance, shape, amplitude.

use super::frf::{form_of, form_of_kind};
use super::recording_result::RecordingResult;
use num_complex::Complex64;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use tapjoint_description::SensorKind;
use tapjoint_identify::observation::{
    AlongDecay, DecayEnd, DecayVerdict, Observed, ObservedMode, ShapeValue,
};
use tapjoint_numerics::stats::{chi_square_tail, median, root_mean_square};
use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudeVerdict};
use tapjoint_signal::modal::fit::{
    FittedValue, UncertaintySource, scatter_about_mean, weighted_mean,
};
use tapjoint_signal::modal::{FittedReading, ModeReading, ReadBy};
use tapjoint_signal::recording::ResponseForm;

/// A 95 % bound over the standard uncertainty of a normal distribution.
const BOUND: f64 = 1.96;

/// Amplitude at which a decay's late end is read, over the largest (1), where it was followed further. A change with
/// a power of the amplitude of 1/2 or more is then over by two thirds. At smaller amplitudes noise and neighbours
/// bend the curve.
const LATE_SHARE: f64 = 0.1;

/// Taps of one level in a recording.
#[derive(Clone, Copy)]
pub(super) struct SeenTaps<'a> {
    /// The recording.
    pub recording: &'a RecordingResult,
    /// Numbers of the taps, from 0.
    pub taps: &'a [usize],
    /// True if these are all taps of the recording.
    pub all: bool,
}

/// A mode as the taps of one level show it.
pub(super) struct ModeSeen<'a> {
    number: usize,
    reading: &'a ModeReading,
    recording: &'a RecordingResult,
    taps: &'a [usize],
    pub(super) frequency: Repeats,
    damping: Option<Repeats>,
}

impl<'a> ModeSeen<'a> {
    pub fn new(number: usize, reading: &'a ModeReading, seen: SeenTaps<'a>) -> Self {
        let fit = reading.fit.as_deref().map(|fit| &fit.mode);
        let fit = fit.filter(|_| reading.source == ReadBy::Fit);
        let (mut frequencies, mut dampings) = (Vec::new(), Vec::new());
        let fits = fit.map_or(&[][..], |fit| fit.taps.as_slice());
        for tap in fits.iter().filter(|tap| seen.taps.contains(&tap.tap)) {
            frequencies.push((tap.tap, tap.frequency, tap.frequency_std));
            dampings.push((tap.tap, tap.damping_ratio, tap.damping_std));
        }
        let inflation = fit.map_or(1.0, |fit| fit.inflation);
        let whole = fit.filter(|_| seen.all);
        let frequency = Repeats::new(frequencies, whole.map(|fit| &fit.frequency), inflation);
        let damping = Repeats::new(dampings, whole.map(|fit| &fit.damping_ratio), inflation);
        // Without a fit the reading is what there is.
        let read = Repeats {
            taps: Vec::new(),
            by_noise: normal(reading.frequency, reading.std.unwrap_or(f64::NAN)),
            scattered: false,
        };
        ModeSeen {
            number,
            reading,
            recording: seen.recording,
            taps: seen.taps,
            frequency: frequency.unwrap_or(read),
            damping,
        }
    }

    /// Returns true if its frequency is that of these taps, and not of the whole recording.
    pub fn is_of_taps(&self) -> bool {
        !self.frequency.taps.is_empty()
    }

    /// Natural frequency (Hz).
    pub fn frequency(&self) -> Observed {
        self.frequency.observed()
    }

    /// The plain data. With the `hardest` taps stands what belongs to all taps of the recording.
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

    fn fit(&self) -> Option<&'a FittedReading> {
        self.reading.fit.as_deref()
    }

    fn damping(&self) -> Option<Observed> {
        match &self.damping {
            Some(damping) => Some(damping.observed()),
            None => Some(normal(
                self.reading.damping_ratio?,
                self.reading.damping_std?,
            )),
        }
    }

    /// Number of time derivatives of the displacement that a sensor senses; `None` where it is not known.
    fn derivatives(&self, sensor: usize) -> Option<i32> {
        let response = self.recording.responses.get(sensor)?;
        // By what the description says the sensor senses, else by its unit.
        let form = match response.kind {
            Some(kind) => form_of_kind(kind),
            None => form_of(response, self.recording.tap_unit.as_deref()),
        };
        form.map(|form| match form {
            ResponseForm::Receptance => 0,
            ResponseForm::Mobility => 1,
            ResponseForm::Accelerance => 2,
        })
    }

    /// The sensor's amplitudes of the taps that count, as displacements where its quantity is known.
    fn displacements(&self, sensor: usize) -> Vec<(usize, Complex64, f64)> {
        let response = self.recording.responses.get(sensor);
        let kind = response.and_then(|response| response.kind);
        let Some(fit) = self.fit().filter(|_| kind != Some(SensorKind::Sound)) else {
            return Vec::new();
        };
        // x_k = p^k x of a free decay with k time derivatives; without a known quantity all are alike.
        let factor = fit.mode.pole.powi(-self.derivatives(sensor).unwrap_or(0));
        let own = fit.mode.amplitudes.iter().filter(|a| a.sensor == sensor);
        own.filter(|a| self.taps.is_empty() || self.taps.contains(&a.tap))
            .map(|a| (a.tap, a.value * factor, a.std * factor.norm()))
            .collect()
    }

    /// Displacements over those at the strongest sensor, tap by tap and then as the taps repeat.
    fn shape(&self) -> Vec<ShapeValue> {
        let mut all = Vec::with_capacity(self.recording.responses.len());
        let mut strongest: Option<(usize, f64)> = None;
        for sensor in 0..self.recording.responses.len() {
            let amplitudes = self.displacements(sensor);
            let sizes: Vec<f64> = amplitudes.iter().map(|one| one.1.norm()).collect();
            let size = root_mean_square(&sizes);
            if !sizes.is_empty() && strongest.is_none_or(|(_, most)| size >= most) {
                strongest = Some((sensor, size));
            }
            all.push(amplitudes);
        }
        let Some((reference, _)) = strongest else {
            return Vec::new();
        };
        let mut shape = Vec::with_capacity(all.len());
        for (sensor, amplitudes) in all.iter().enumerate() {
            let ratio = match sensor == reference {
                true => Some(normal(1.0, 0.0)),
                false => Repeats::new(ratios(amplitudes, &all[reference]), None, 1.0)
                    .map(|repeats| repeats.observed()),
            };
            shape.extend(ratio.map(|ratio| ShapeValue {
                sensor,
                value: ratio.value,
                std: ratio.std,
                freedom: ratio.freedom,
            }));
        }
        shape
    }

    /// Modal constant of the recording at a sensor (1/kg): over all its taps, the shape is linear.
    fn constant(&self, sensor: usize) -> Option<Observed> {
        let constants = &self.fit()?.constants;
        let found = constants
            .iter()
            .find(|constant| constant.sensor == sensor)?;
        // Noise of the hammer at the mode's line; none without a hammer or a quiet stretch.
        let mut of_force = ForceNoise::NONE;
        if let Some(spectra) = &self.recording.measurement.spectra {
            let averages = &spectra.averages;
            let line = averages.lines.nearest(self.reading.frequency);
            let noise = spectra
                .force_noise
                .as_ref()
                .and_then(|noise| noise.get(line));
            let force = averages.force.as_ref().and_then(|force| force.get(line));
            if let Some((&noise, &force)) = noise.zip(force) {
                of_force = ForceNoise::of(noise, force, averages.taps)?;
            }
        }
        Some(normal(
            found.value,
            of_force.added_to(found.std, found.value),
        ))
    }

    /// Median displacement amplitude at the decays' begin (m).
    fn amplitude(&self, sensor: usize) -> Option<f64> {
        self.derivatives(sensor)?;
        let amplitudes = self.displacements(sensor);
        let mut sizes: Vec<f64> = amplitudes.iter().map(|one| one.1.norm()).collect();
        // Functions from a file have residues, which are no amplitudes.
        let of_decays = self.recording.sample_rate.is_some();
        (!sizes.is_empty() && of_decays).then(|| median(&mut sizes))
    }

    /// Change of the mode along its decays, from its amplitude curve.
    fn along_decay(&self, curve: &AmplitudeCurve, shape: &[ShapeValue]) -> Option<AlongDecay> {
        let (frequency, damping) = (curve.frequency.as_ref()?, curve.damping.as_ref()?);
        let [frequency_slope, damping_slope] = [frequency, damping].map(|trend| Observed {
            value: trend.slope,
            std: trend.slope_std,
            freedom: Some(curve.points.len() as f64 - 2.0),
        });
        let (mut least, mut most) = (f64::INFINITY, 0.0);
        for point in &curve.points {
            most = f64::max(most, point.amplitude);
            least = f64::min(least, point.amplitude);
        }
        let late = least.max(most * LATE_SHARE);
        let change = frequency.between(late, most);
        Some(AlongDecay {
            frequency_slope,
            frequency_change: change.map(|(value, std)| Observed {
                value,
                std,
                freedom: Some(frequency.freedom()),
            }),
            damping_slope,
            early: self.decay_end(curve, most, shape)?,
            late: self.decay_end(curve, late, shape)?,
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
        Some(DecayEnd {
            amplitude: displacement,
            frequency: normal(reading.frequency, reading.frequency_bound / BOUND),
            damping: normal(reading.damping_ratio, reading.damping_bound / BOUND),
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
    let mut ratios = Vec::with_capacity(sensor.len());
    for &(tap, value, std) in sensor {
        let Some(&(_, other, other_std)) = reference.iter().find(|one| one.0 == tap) else {
            continue;
        };
        let ratio = value / other;
        let std = std.hypot(ratio.norm() * other_std) / other.norm();
        if ratio.is_finite() && std > 0.0 {
            ratios.push((tap, ratio.re, std));
        }
    }
    ratios
}

/// A scatter less probable than this is not noise alone. 5 %, more lenient than for one mode of a report:
/// an uncertainty that is too small makes effects out of nothing, one that is a little too large costs
/// little.
const SCATTER_LEVEL: f64 = 0.05;
/// Fewer taps say nothing of their scatter.
const LEAST_TAPS: usize = 3;
/// With more degrees of freedom than this Student's t is as good as normal: 2 % wider at 100.
const KNOWN: f64 = 100.0;

/// A value with the standard uncertainty of a normal distribution.
fn normal(value: f64, std: f64) -> Observed {
    Observed {
        value,
        std,
        freedom: None,
    }
}

/// One quantity by repeated taps.
#[derive(Debug, Clone)]
pub(super) struct Repeats {
    /// Number of the tap, its value and that value's standard uncertainty from noise.
    pub taps: Vec<(usize, f64, f64)>,
    /// Value with the uncertainty by noise alone.
    pub by_noise: Observed,
    /// True if the taps scatter more than noise explains.
    pub scattered: bool,
}

impl Repeats {
    /// Returns repeats from the taps' own values (tap, value, standard uncertainty). `joint` is the value of a fit of
    /// all taps together, where these are all of them. `inflation` is a known factor (1) on the noise.
    pub fn new(
        taps: Vec<(usize, f64, f64)>,
        joint: Option<&FittedValue>,
        inflation: f64,
    ) -> Option<Self> {
        let by_noise = match joint {
            Some(joint) if joint.source == UncertaintySource::Residual => Observed {
                value: joint.value,
                std: joint.std,
                freedom: Some(joint.freedom).filter(|freedom| *freedom < KNOWN),
            },
            Some(joint) if joint.source == UncertaintySource::TwoPoles => {
                normal(joint.value, joint.std)
            }
            // Weighted mean with the weights 1/std^2.
            _ => {
                let total: f64 = taps.iter().map(|tap| tap.2.powi(-2)).sum();
                let sum: f64 = taps.iter().map(|tap| tap.1 * tap.2.powi(-2)).sum();
                let mean = sum / total;
                (total > 0.0 && mean.is_finite()).then(|| normal(mean, inflation / total.sqrt()))?
            }
        };
        let mut repeats = Repeats {
            taps,
            by_noise,
            scattered: false,
        };
        repeats.scattered = repeats.chi_squared().is_some_and(|(chi_squared, freedom)| {
            chi_square_tail(chi_squared, freedom) < SCATTER_LEVEL
        });
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

    /// The value, from the noise or from the scatter.
    pub fn observed(&self) -> Observed {
        let taps = self.pairs();
        if let [(a, _), (b, _)] = taps[..] {
            // Half the difference of two values serves as a lower bound only.
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

/// Judges the frequencies' scatter over all modes together. A structure that differs between taps moves several modes
/// a little; their sum shows it even if no single mode does. Then every mode that scatters beyond its noise at all
/// counts as scattered.
pub(super) fn judge_scatter(modes: &mut [ModeSeen<'_>]) {
    let sums = modes.iter().filter_map(|mode| mode.frequency.chi_squared());
    let (chi_squared, freedom) = sums.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    if chi_square_tail(chi_squared, freedom) >= SCATTER_LEVEL {
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

/// Covariance of the frequencies of modes that have nothing in common; `None` where one has no uncertainty.
pub(super) fn independent(modes: &[ObservedMode]) -> Option<Vec<Vec<f64>>> {
    let stds: Vec<f64> = modes.iter().map(|mode| mode.std).collect::<Option<_>>()?;
    Some(diagonal(&stds))
}

fn diagonal(stds: &[f64]) -> Vec<Vec<f64>> {
    let mut covariance = vec![vec![0.0; stds.len()]; stds.len()];
    for (index, std) in stds.iter().enumerate() {
        covariance[index][index] = std * std;
    }
    covariance
}

/// Variances of the modes' frequencies, and where several scatter from tap to tap more than noise does,
/// the correlation of that scatter. Noise itself is independent between modes.
pub(super) fn of_taps(modes: &[ModeSeen<'_>]) -> Option<Vec<Vec<f64>>> {
    let stds: Vec<f64> = modes.iter().map(|mode| mode.frequency().std).collect();
    if stds.iter().any(|std| !std.is_finite()) {
        return None;
    }
    let mut covariance = diagonal(&stds);
    let scattered: Vec<usize> = (0..modes.len())
        .filter(|&index| modes[index].frequency.scattered)
        .collect();
    if let Some(correlation) = shrunk_correlation(modes, &scattered) {
        for (row, &i) in correlation.iter().zip(&scattered) {
            for (r, &j) in row.iter().zip(&scattered).filter(|(_, j)| **j != i) {
                covariance[i][j] = r * stds[i] * stds[j];
            }
        }
    }
    Some(covariance)
}

/// Correlations between the taps' deviations, shrunk towards none as Schaefer & Strimmer 2005 do:
/// lambda = sum var(r)/sum r^2 with var(r) about (1 - r^2)^2/(n - 1); `None` with too few taps that
/// have all these modes.
fn shrunk_correlation(modes: &[ModeSeen<'_>], which: &[usize]) -> Option<Vec<Vec<f64>>> {
    let values: Vec<BTreeMap<usize, f64>> = which
        .iter()
        .map(|&index| modes[index].frequency.taps.iter())
        .map(|taps| taps.map(|(tap, value, _)| (*tap, *value)).collect())
        .collect();
    let mut common: Vec<usize> = values.first()?.keys().copied().collect();
    common.retain(|tap| values.iter().all(|mode| mode.contains_key(tap)));
    if which.len() < 2 || common.len() < LEAST_TAPS {
        return None;
    }
    // Deviations from the mean, scaled to a unit sum of squares.
    let mut columns: Vec<Vec<f64>> = Vec::with_capacity(values.len());
    for mode in &values {
        let mut column: Vec<f64> = common.iter().map(|tap| mode[tap]).collect();
        let mean = column.iter().sum::<f64>() / column.len() as f64;
        column.iter_mut().for_each(|value| *value -= mean);
        let size = column.iter().map(|x| x * x).sum::<f64>().sqrt();
        let size = size.max(f64::MIN_POSITIVE);
        column.iter_mut().for_each(|value| *value /= size);
        columns.push(column);
    }
    let mut sample = vec![vec![0.0; which.len()]; which.len()];
    let (mut squares, mut variances) = (0.0, 0.0);
    for (i, a) in columns.iter().enumerate() {
        for (j, b) in columns.iter().enumerate() {
            let r: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            if j < i {
                squares += r.powi(2);
                variances += (1.0 - r * r).powi(2) / (common.len() as f64 - 1.0);
            }
            sample[i][j] = r;
        }
    }
    let shrinkage = (variances / f64::max(squares, f64::MIN_POSITIVE)).clamp(LEAST_SHRINKAGE, 1.0);
    for r in sample.iter_mut().flatten() {
        *r *= 1.0 - shrinkage;
    }
    Some(sample)
}

/// Error of a ratio to the force by the hammer's noise (1, relative).
#[derive(Debug, Clone, Copy, PartialEq)]
struct ForceNoise {
    /// At random: it shows in the scatter of the taps as well.
    random: f64,
    /// In common.
    common: f64,
}

impl ForceNoise {
    const NONE: ForceNoise = ForceNoise {
        random: 0.0,
        common: 0.0,
    };

    /// The error for n taps: r/sqrt(2 n), the half of the noise's power that is in phase, and r^2, by which the mean square of a
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
    fn added_to(self, std: f64, value: f64) -> f64 {
        std.max(self.random * value.abs())
            .hypot(self.common * value)
    }
}

/// A reading's shape at the sensors of its recording, over all taps, and its modal constant (1/kg) at the
/// strongest sensor.
pub(super) fn shape_of(
    reading: &ModeReading,
    recording: &RecordingResult,
) -> (Vec<ShapeValue>, Option<Observed>) {
    let taps: Vec<usize> = (0..recording.measurement.taps.accepted().count()).collect();
    let all = SeenTaps {
        recording,
        taps: &taps,
        all: true,
    };
    let seen = ModeSeen::new(0, reading, all);
    let shape = seen.shape();
    let constant = reference(&shape).and_then(|sensor| seen.constant(sensor));
    (shape, constant)
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
