//! How a laboratory carries out a test. The defaults are those of a decent one: calibrated sensors
//! glued or screwed on, a 24-bit recorder with an anti-alias filter, a practised hand.

use serde::Serialize;

use super::pulse::PulseShape;

/// Everything about the laboratory.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Laboratory {
    /// The hammer and the hand that swings it.
    pub hammer: HammerSettings,
    /// The sensors and how they are fastened.
    pub sensors: SensorSettings,
    /// The recorder.
    pub recorder: RecorderSettings,
    /// What the structure dissipates and how it hangs.
    pub specimen: SpecimenSettings,
}

impl Laboratory {
    /// Nothing that disturbs: no noise, errors or scatter, and no filter but the one against aliasing,
    /// without which modes beyond half the rate would appear below it.
    pub fn ideal() -> Self {
        Self {
            hammer: HammerSettings {
                level_scatter: 0.0,
                length_scatter: 0.0,
                place_scatter: 0.0,
                ..HammerSettings::default()
            },
            sensors: SensorSettings {
                noise: 0.0,
                sensitivity_error: 0.0,
                ac_coupling: 0.0,
                mounting_resonance: 0.0,
            },
            recorder: RecorderSettings {
                hum: 0.0,
                drift: 0.0,
                offset: 0.0,
                clock_error: 0.0,
                ..RecorderSettings::default()
            },
            specimen: SpecimenSettings::default(),
        }
    }
}

/// Tip of the hammer, which makes the pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tip {
    /// 0.3 ms, excites to 3.3 kHz.
    Steel,
    /// 1.4 ms, excites to 1 kHz.
    Nylon,
    /// 5 ms, excites to 290 Hz.
    Rubber,
}

impl Tip {
    /// From the softest to the hardest.
    pub const ALL: [Self; 3] = [Self::Rubber, Self::Nylon, Self::Steel];

    /// Length (s) and shape of its pulse on a beam of some hundred grams.
    pub fn pulse(self) -> (f64, PulseShape) {
        match self {
            Self::Steel => (0.3e-3, PulseShape::SineSquared),
            Self::Nylon => (1.4e-3, PulseShape::SineFourth),
            Self::Rubber => (5e-3, PulseShape::SineFourth),
        }
    }

    /// The softest that excites to this frequency (Hz): what good practice takes.
    pub fn softest_for(frequency: f64) -> Self {
        let reaches = |tip: &Self| {
            let (length, shape) = tip.pulse();
            shape.half_amplitude_frequency(length) >= frequency
        };
        Self::ALL.into_iter().find(reaches).unwrap_or(Self::Steel)
    }
}

/// The hammer and the hand that swings it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HammerSettings {
    /// Tip; `None` = the softest that excites the whole band.
    pub tip: Option<Tip>,
    /// Peak force at level 1 (N). 20: a light tap, so that recorders do not clip.
    pub peak_force: f64,
    /// Number of taps in each recording. 5, what good practice asks for.
    pub taps: usize,
    /// Time from tap to tap (s); `None` = until the slowest mode has rung down to 0.1 % and a described
    /// block fits, at least 1 s and at most 10 s.
    pub interval: Option<f64>,
    /// Quiet time before the first tap (s). 0.5: room for the pre-trigger.
    pub lead: f64,
    /// How much the taps' peaks differ (1, standard deviation). 0.1: a practised hand.
    pub level_scatter: f64,
    /// How much the pulses' lengths differ (1, standard deviation). 0.03.
    pub length_scatter: f64,
    /// How far from the marked place the taps strike (m, standard deviation). 0.5 mm: a marked place.
    pub place_scatter: f64,
    /// Part of the taps that strike twice (1). 0.
    pub double_hits: f64,
    /// Part of the taps that are far too weak (1). 0.
    pub weak_hits: f64,
}

impl Default for HammerSettings {
    fn default() -> Self {
        Self {
            tip: None,
            peak_force: 20.0,
            taps: 5,
            interval: None,
            lead: 0.5,
            level_scatter: 0.1,
            length_scatter: 0.03,
            place_scatter: 0.5e-3,
            double_hits: 0.0,
            weak_hits: 0.0,
        }
    }
}

/// The sensors and how they are fastened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensorSettings {
    /// Noise of hammer and sensors, in multiples of that of good ones ([`crate::Signal::good_noise`]). 1.
    pub noise: f64,
    /// Error of each sensor's and the hammer's sensitivity (1, standard deviation). 0.01: as calibrated.
    pub sensitivity_error: f64,
    /// Corner (Hz) of the high-pass that couples the signals; 0 = none. 0.5.
    pub ac_coupling: f64,
    /// Resonance (Hz) of an accelerometer on its mounting; 0 = none. 18 kHz: 24 g on wax or a thin
    /// glue line.
    pub mounting_resonance: f64,
}

impl Default for SensorSettings {
    fn default() -> Self {
        Self {
            noise: 1.0,
            sensitivity_error: 0.01,
            ac_coupling: 0.5,
            mounting_resonance: 18e3,
        }
    }
}

/// Whether there is an anti-alias filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AntiAlias {
    /// As in sigma-delta converters: linear phase, flat to rate/2.56, 110 dB down beyond its mirror.
    On,
    /// Samples are taken as they are.
    Off,
}

/// The recorder. What is relative refers to a channel's full scale.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecorderSettings {
    /// Sample rate (Hz); `None` = the lowest usual one that covers the band.
    pub sample_rate: Option<u32>,
    /// Bits of a sample: 16, 24, or 32 for floating point. 24.
    pub bits: u16,
    /// Anti-alias filter. On.
    pub anti_alias: AntiAlias,
    /// Frequency of the mains (Hz). 50.
    pub mains: f64,
    /// Amplitude of mains hum (1); its third harmonic has 30 % of that. 1e-6.
    pub hum: f64,
    /// Slow drift of the zero (1, standard deviation). 1e-6.
    pub drift: f64,
    /// Offset of the zero (1, standard deviation). 1e-5.
    pub offset: f64,
    /// Relative error of the clock: positive = its seconds are too long, frequencies read high.
    /// 5e-6: a quartz.
    pub clock_error: f64,
}

impl Default for RecorderSettings {
    fn default() -> Self {
        Self {
            sample_rate: None,
            bits: 24,
            anti_alias: AntiAlias::On,
            mains: 50.0,
            hum: 1e-6,
            drift: 1e-6,
            offset: 1e-5,
            clock_error: 5e-6,
        }
    }
}

/// What the structure dissipates beside the joint's own loss, and how a free one hangs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpecimenSettings {
    /// Damping.
    pub damping: Damping,
    /// Natural frequencies (Hz) of a free or lap-jointed beam on its suspension, up and down and
    /// rocking; `None` = no rigid-body motion at all. 1.5 and 2: rubber bands.
    pub suspension: Option<[f64; 2]>,
}

impl Default for SpecimenSettings {
    fn default() -> Self {
        Self {
            damping: Damping::Modal(vec![0.004, 0.003, 0.0025, 0.002]),
            suspension: Some([1.5, 2.0]),
        }
    }
}

/// Damping of the structure.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Damping {
    /// Damping ratio of each mode, the last one for all beyond. 0.4, 0.3, 0.25, then 0.2 %: a bolted
    /// steel beam.
    Modal(Vec<f64>),
    /// In proportion to mass and stiffness: ratio = mass/(2 omega) + stiffness omega/2.
    Rayleigh {
        /// Factor of the mass matrix (1/s).
        mass: f64,
        /// Factor of the stiffness matrix (s).
        stiffness: f64,
    },
}

impl Damping {
    /// Damping ratio of the mode with this index (0-based) and natural frequency (Hz).
    pub fn ratio(&self, index: usize, frequency: f64) -> f64 {
        match self {
            Self::Modal(ratios) => {
                let ratio = ratios.get(index).or(ratios.last());
                ratio.copied().unwrap_or(0.0)
            }
            Self::Rayleigh { mass, stiffness } => {
                let omega = std::f64::consts::TAU * frequency;
                0.5 * (mass / omega + stiffness * omega)
            }
        }
    }
}
