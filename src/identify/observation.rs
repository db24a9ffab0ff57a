//! Observations of a test, as plain data that a diagnosis compares with predictions.
//!
//! One [`Configuration`] for each recording and tap level: where sensors and hammer were, how hard the
//! taps were, and what each natural frequency, damping ratio and shape was, with the uncertainty that
//! the measurement gives it (scatter of the repeated taps, noise that the fits leave). No number here
//! knows of a hypothesis or of its residual.

use tapjoint_beam::specimen::PointMass;

/// All configurations of a test.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Observations {
    /// In the order of the recordings; of one recording the hardest taps first.
    pub configurations: Vec<Configuration>,
}

/// Observations with sensors and tap in one place, at one tap level.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// File of the recording; `None` of frequencies read elsewhere.
    pub file: Option<String>,
    /// Index of the recording in the description; `None` of frequencies read elsewhere.
    pub recording: Option<usize>,
    /// The sensors, in the order of the description; empty of frequencies read elsewhere.
    pub sensors: Vec<ObservedSensor>,
    /// Known masses that were fastened to the beam; sensors are no part of them.
    pub masses: Vec<PointMass>,
    /// Position of the taps (m); `None` where it is not given.
    pub tap: Option<f64>,
    /// Median peak force of the taps (N); `None` without a hammer.
    pub peak_force: Option<f64>,
    /// That force over the one of the hardest configuration (1, at most 1); `None` without a hammer.
    pub level: Option<f64>,
    /// Taps that entered; 0 of frequencies read elsewhere and of functions from a file.
    pub taps: usize,
    /// Length of the decays that were fitted (s); `None` where nothing was recorded.
    pub decay_seconds: Option<f64>,
    /// Frequencies at which resonances were looked for (Hz); `None` where they are not given.
    pub band: Option<(f64, f64)>,
    /// The modes with a number, ascending.
    pub modes: Vec<ObservedMode>,
    /// Covariance of the frequencies (Hz^2), row by row in the order of `modes`, without `common`;
    /// `None` where a frequency has no uncertainty.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// Relative standard uncertainty (1) that all frequencies of the configuration share and no
    /// repetition within a recording can show.
    pub common: f64,
    /// Peaks that belong to no mode, ascending.
    pub extra_peaks: Vec<ExtraPeak>,
}

/// A sensor and its place.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedSensor {
    /// Its name.
    pub name: String,
    /// Position in this configuration (m); `None` where it is not given.
    pub position: Option<f64>,
}

/// A number with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observed {
    /// The value.
    pub value: f64,
    /// Its standard uncertainty (unit of the value).
    pub std: f64,
    /// Degrees of freedom of that uncertainty, for Student's t; `None` where it was stated or rests on
    /// so many values that it counts as known.
    pub freedom: Option<f64>,
}

/// One mode as one configuration saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedMode {
    /// The model's number.
    pub mode: usize,
    /// Natural frequency (Hz): the average along the decay, see [`effective_share`].
    pub frequency: f64,
    /// Its standard uncertainty (Hz), the root of its place in the covariance; `None` where nothing is
    /// known of it.
    pub std: Option<f64>,
    /// Degrees of freedom of that uncertainty, for Student's t; `None` where it counts as known, was
    /// stated, or rests on a single tap, whose scatter is unknown (see `repeats`).
    pub freedom: Option<f64>,
    /// Taps whose frequencies were compared; below 3 the scatter between taps is no estimate, and the
    /// uncertainty is that of the noise alone.
    pub repeats: usize,
    /// Damping ratio (1); `None` where it could not be had.
    pub damping: Option<Observed>,
    /// Real mode shape at the sensors, displacements over that at the strongest sensor.
    pub shape: Vec<ShapeValue>,
    /// Index of the strongest sensor, where the shape is 1; `None` without a shape.
    pub reference: Option<usize>,
    /// Modal constant at the strongest sensor (1/kg): product of the mass-normalised shapes at sensor
    /// and tap, with its sign; `None` without a calibrated hammer and sensor.
    pub constant: Option<Observed>,
    /// Displacement amplitude at the strongest sensor when the fitted decay begins (m), median of the taps;
    /// `None` without a calibrated sensor.
    pub amplitude: Option<f64>,
    /// Frequency and damping along the decay; `None` where they could not be followed.
    pub decay: Option<AlongDecay>,
}

/// A mode shape at one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeValue {
    /// Index of the sensor.
    pub sensor: usize,
    /// Displacement over that at the reference sensor (1), real part.
    pub value: f64,
    /// Its standard uncertainty (1); 0 of the reference itself.
    pub std: f64,
    /// Degrees of freedom of that uncertainty, for Student's t; `None` where it counts as known.
    pub freedom: Option<f64>,
}

/// Frequency and damping along the decays of all taps of a configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlongDecay {
    /// Change of the frequency per e-fold of the amplitude (Hz).
    pub frequency_slope: Observed,
    /// Frequency at `early` less that at `late` (Hz); both ends are of one curve, so that this is known
    /// better than either. `None` where the ends were not followed.
    pub frequency_change: Option<Observed>,
    /// Change of the damping ratio per e-fold of the amplitude (1).
    pub damping_slope: Observed,
    /// At the largest amplitude.
    pub early: DecayEnd,
    /// At the smallest amplitude, or at a tenth of the largest.
    pub late: DecayEnd,
    /// Verdict on the change.
    pub verdict: DecayVerdict,
}

/// One end of the followed decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayEnd {
    /// Displacement amplitude at the mode's strongest sensor, where its shape is 1 (m); `None` without
    /// a calibrated sensor.
    pub amplitude: Option<f64>,
    /// Natural frequency (Hz).
    pub frequency: Observed,
    /// Damping ratio (1).
    pub damping: Observed,
}

/// Verdict on a change along the decay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DecayVerdict {
    /// Frequency or damping changes with amplitude.
    Changes,
    /// Neither changes by more than its uncertainty.
    Steady,
    /// A close neighbour explains the change as well.
    Doubtful,
}

/// Label of a peak that belongs to no mode and is no mains line.
pub const UNPAIRED: &str = "unpaired";
/// The label of a peak that may be none.
pub const UNCLEAR: &str = "no clear resonance";

/// A peak that belongs to no mode of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtraPeak {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its standard uncertainty (Hz), where known.
    pub std: Option<f64>,
    /// Height over the noise, or where that is unknown over its surroundings (dB).
    pub level_db: Option<f64>,
    /// Modal constant at its strongest sensor (1/kg), as that of a mode; `None` without a calibrated hammer
    /// and sensor.
    pub constant: Option<f64>,
    /// Description ("mains 50 Hz", [`UNPAIRED`]).
    pub label: String,
}

impl ObservedMode {
    /// A frequency (Hz) read elsewhere, with the standard uncertainty (Hz) that was stated.
    pub fn read_elsewhere(mode: usize, frequency: f64, std: Option<f64>) -> Self {
        Self {
            mode,
            frequency,
            std,
            freedom: None,
            repeats: 0,
            damping: None,
            shape: Vec::new(),
            reference: None,
            constant: None,
            amplitude: None,
            decay: None,
        }
    }
}

impl Configuration {
    /// The mode of this number, where it was seen.
    pub fn mode(&self, number: usize) -> Option<&ObservedMode> {
        self.modes.iter().find(|mode| mode.mode == number)
    }

    /// Returns true where a resonance at this frequency (Hz) was looked for: anywhere without a band.
    pub fn reaches(&self, frequency: f64) -> bool {
        self.band
            .is_none_or(|(low, high)| low <= frequency && frequency <= high)
    }
}

/// Share of its first amplitude (1) at which a decay has the frequency that is fitted to all of it.
///
/// It is (2/(2 + p))^(2/p), where the frequency changes with this power p of the amplitude.
///
/// Least squares weigh the phase with e^{-2 sigma t}; a frequency change c e^{-p sigma t} then fits as
/// cov(t, integral of c)/var(t) = c (2/(2 + p))^2. It is 0.41 to 0.5 for powers between 1/2 and 2, so
/// that one share serves all of them. Holds where the record has rung down.
pub fn effective_share(power: f64) -> f64 {
    (2.0 / (2.0 + power)).powf(2.0 / power)
}

#[cfg(test)]
mod tests {
    use super::effective_share;

    #[test]
    fn val_the_share_is_what_a_weighted_line_through_the_phase_gives() {
        // Weighted least squares of the phase over a decay of unit rate, in 20 000 steps.
        for power in [0.5, 1.0, 2.0] {
            let (mut w, mut t1, mut p1, mut tt, mut tp) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for step in 0..20_000 {
                let t = f64::from(step) * 1e-3;
                let weight = (-2.0 * t).exp();
                let phase = (1.0 - (-power * t).exp()) / power;
                w += weight;
                t1 += weight * t;
                p1 += weight * phase;
                tt += weight * t * t;
                tp += weight * t * phase;
            }
            let slope = (tp - t1 * p1 / w) / (tt - t1 * t1 / w);
            let share = slope.powf(1.0 / power);
            // The steps of the sum leave 1e-3 of it.
            assert!(
                (share - effective_share(power)).abs() < 2e-3,
                "{power}: {share}"
            );
        }
    }
}
