//! One mode as the taps of one level saw it.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::force_noise::{ForceNoise, noise_of_force};
use super::repeats::Repeats;
use crate::RecordingResult;
use crate::analysis::Response;
use crate::frf::form_of;
use tapjoint_description::SensorKind;
use tapjoint_identify::observation::{
    AlongDecay, DecayEnd, DecayVerdict, Observed, ObservedMode, ShapeValue,
};
use tapjoint_numerics::stats::{median, root_mean_square};
use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudeVerdict, Trend};
use tapjoint_signal::modal::fit::ColumnAmplitude;
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
