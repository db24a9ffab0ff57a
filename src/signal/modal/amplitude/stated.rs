//! The amplitude at which a frequency holds, and the frequency there of a mode that changes with it.

use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_numerics::stats::chi_square_tail;

use super::band::Band;
use super::decay::DecayModel;
use super::{AmplitudePoint, KnownMode};
use crate::modal::fit::{FittedValue, SCATTERS, UncertaintySource, scatter_about_mean};

/// Probability below which a frequency changes beyond noise. 1 %: a recording has many modes to be tested.
const LEVEL: f64 = 0.01;
/// Probability of the taps' scatter below which one law of the amplitude does not explain them all.
const ONE_LAW: f64 = 1e-3;
/// Fall of chi-squared that shows that the amplitude decides and not the time after the tap: odds of 150 to one.
const DECIDES: f64 = 10.0;
/// Share of the largest amplitude down to which an interval holds every frequency where no model explains the decays.
const LEAST_PART: f64 = 0.1;

/// The frequency of a mode that changes with the amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Natural frequency (Hz) at the reference amplitude.
    pub frequency: FittedValue,
    /// True where decays of different strength show that the amplitude decides and not the time after the tap, as it
    /// would with two modes that beat.
    pub by_amplitude: bool,
}

/// Amplitude at which a frequency holds.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FrequencyAtAmplitude {
    /// Peak amplitude (unit of the sensor).
    pub value: f64,
    /// Sensor, from 0; in outputs from 1.
    #[serde(serialize_with = "crate::modal::from_one")]
    pub sensor: usize,
}

/// Models of the decays of one mode after all taps.
pub(super) struct WholeDecays<'a> {
    models: &'a [(Band, DecayModel)],
    /// Amplitude at the start of each decay.
    starts: Vec<f64>,
    /// Part of it at which a pole that does not change has the frequency of one that does.
    part: f64,
}

impl<'a> WholeDecays<'a> {
    /// Takes the models of a mode; `None` without one that has an amplitude.
    pub fn new(models: &'a [(Band, DecayModel)], mode: &KnownMode) -> Option<Self> {
        let starts = models
            .iter()
            .map(|(band, model)| model.amplitude(-0.5 * band.filter, band));
        let starts: Vec<f64> = starts.collect();
        let are_finite = starts.iter().all(|start| start.is_finite());
        let usable = are_finite && starts.iter().any(|start| *start > 0.0);
        let (band, _) = models.first()?;
        let whole = || part(-band.decay * band.length);
        usable.then(|| WholeDecays {
            models,
            starts,
            part: mode.amplitude_part.unwrap_or_else(whole),
        })
    }

    /// Returns the amplitude at which a mode has the frequency that the fit of a pole that does not change finds.
    ///
    /// A tap counts by its power.
    pub fn reference(&self) -> f64 {
        let largest = self.starts.iter().copied().fold(0.0, f64::max);
        let (mut power, mut sum) = (0.0, 0.0);
        for start in &self.starts {
            let relative: f64 = start / largest;
            power += relative.powi(2);
            sum += relative.powi(3);
        }
        self.part * largest * sum / power
    }

    /// Returns true where poles that drift explain the decays better than noise makes them.
    pub fn changes(&self) -> bool {
        let (mut fall, mut unknowns) = (0.0, 0.0);
        for (_, model) in self.models {
            fall += model.evidence.fall;
            unknowns += model.evidence.unknowns;
        }
        unknowns > 0.0 && chi_square_tail(fall, unknowns) <= LEVEL
    }

    /// Returns the frequency at the reference amplitude; `None` where the decays do not show that it changes.
    ///
    /// The decays that reach the amplitude have a frequency there. Their mean is weighted by the uncertainties. If they scatter beyond noise, the
    /// interval rests on the scatter, with Student's t. If they scatter so much that no law of the amplitude explains
    /// them, the interval holds all frequencies of the curve's `points` down to a tenth of the largest amplitude.
    pub fn drift(&self, points: &[AmplitudePoint]) -> Option<Drift> {
        if !self.changes() {
            return None;
        }
        let reference = self.reference();
        let (mut there, mut at_one_time, mut freedom) = (Vec::new(), Vec::new(), 0.0);
        for ((band, model), start) in self.models.iter().zip(&self.starts) {
            let own = self.part * start;
            // A decay that does not reach the amplitude says nothing of it.
            if let (Some(one), Some(other)) = (
                model.frequency_at(reference, band),
                model.frequency_at(own, band),
            ) {
                there.push(one);
                freedom += model.evidence.freedom;
                at_one_time.push(other);
            }
        }
        let (mut total, mut sum) = (0.0, 0.0);
        for (frequency, std) in &there {
            total += 1.0 / (std * std);
            sum += frequency / (std * std);
        }
        let mean = sum / total;
        if !mean.is_finite() {
            return None;
        }
        let mut frequency = FittedValue::new(mean, total.sqrt().recip(), freedom, &there);
        frequency.source = UncertaintySource::Decays;
        let scatter = frequency.scatter_probability.unwrap_or(1.0);
        if scatter < SCATTERS {
            frequency.take_scatter(&there, false);
        }
        if scatter < ONE_LAW {
            let largest = points.iter().map(|p| p.amplitude).fold(0.0, f64::max);
            let counted = points
                .iter()
                .filter(|p| p.amplitude >= LEAST_PART * largest);
            frequency.widen_to_all(counted.map(|point| point.frequency));
            frequency.source = UncertaintySource::Decays;
            frequency.freedom = freedom;
        }
        let by_amplitude = there.len() > 1
            && scatter_about_mean(&at_one_time) - scatter_about_mean(&there) > DECIDES;
        Some(Drift {
            frequency,
            by_amplitude,
        })
    }
}

/// Part of its first amplitude at which a decay has the frequency that the fit of a steady pole finds.
///
/// For a frequency linear in the amplitude the phase deviates by g(u) = 1 - e^{-u}, u = sigma t. The fit takes a straight
/// line through it with the weights w = e^{-2u} over the record, 0 to U: the part is cov(u, g)/var(u). Long records
/// have 4/9, short ones e^{-U/2}. With the root and the square of the amplitude the long ones have 0.41 and 0.5.
fn part(decay_in_record: f64) -> f64 {
    const STEPS: usize = 1000;
    // Beyond e^{-2u} = 10^-9 the weights say nothing.
    let last = decay_in_record.clamp(1e-3, 10.0);
    let (mut sum, mut of_u, mut of_g, mut of_uu, mut of_ug) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for step in 0..STEPS {
        let u = last * (step as f64 + 0.5) / STEPS as f64;
        let (weight, g) = ((-2.0 * u).exp(), -(-u).exp_m1());
        sum += weight;
        of_u += weight * u;
        of_g += weight * g;
        of_uu += weight * u * u;
        of_ug += weight * u * g;
    }
    (of_ug - of_u * of_g / sum) / (of_uu - of_u * of_u / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_the_part_of_a_long_record_is_four_ninths() {
        assert!((part(1e3) - 4.0 / 9.0).abs() < 1e-4, "{}", part(1e3));
        // The middle of a short record.
        assert!((part(0.02) - 0.99).abs() < 1e-4, "{}", part(0.02));
    }
}
