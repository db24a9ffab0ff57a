//! The truth of one virtual test and its recording.

use super::result::WindowName;
use super::{ResolutionError, ResolutionSettings, StudiedTest};
use rand::{Rng, RngExt};
use std::f64::consts::TAU;
use tapjoint_analysis::jointed_structure;
use tapjoint_beam::{Assembly, JointStiffness, ModeShape, mode_shapes};
use tapjoint_identify::consistent::{FrequencyModel, Parameter, Point};
use tapjoint_signal::spectral::{
    BandLimiter, DecayCheck, Lines, Window, choose_window, exponential_to, measure_decay,
};
use tapjoint_simulate::{
    SimulatedMode, TapTestSettings, add_noise, below, observed_modes, simulate_tap_test,
};

/// Most modes that are simulated: more than a joint needs, and than a band of a tap test holds.
const MOST_MODES: usize = 12;
/// Modes above this share of the sample rate are left out of a recording, as its filter would.
const PASSED: f64 = 0.48;
/// A mode is silent when it has decayed by e to this power: 2e-22 is left.
const SILENT: f64 = 50.0;
/// Samples before the tap in each record.
const AHEAD: usize = 4;

/// Natural frequencies of the virtual beam on any joint near the nominal one.
#[derive(Debug)]
pub(super) struct Truths<'a> {
    test: &'a StudiedTest,
    model: FrequencyModel,
    shapes: Vec<ModeShape>,
    /// The nominal test.
    pub nominal: Truth,
    /// Derivatives of ln frequency with ln stiffness, summed over the joint's stiffnesses.
    pub joint_shares: Vec<f64>,
}

/// The true values of one draw.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Truth {
    /// Natural frequencies (Hz), mode 1 first.
    pub frequencies: Vec<f64>,
    /// Factor on all frequencies: the root of that on the modulus. The joint's stiffnesses (N/m, N m/rad)
    /// change with the modulus, so that the non-dimensional ones stay.
    pub scale: f64,
    /// The joint (1).
    pub joint: JointStiffness,
    /// The joint as a point of the frequency model, without the scale.
    pub point: Point,
}

impl<'a> Truths<'a> {
    pub fn new(test: &'a StudiedTest) -> Result<Self, ResolutionError> {
        let model = FrequencyModel::new(
            &jointed_structure(&test.structure, &test.details),
            MOST_MODES,
        )?;
        let assembly = test.structure.assembly;
        let shapes = mode_shapes(&test.structure.beam, assembly, &test.joint, MOST_MODES)?;
        let point = point_of(&model, test, &test.joint);
        let (mut frequencies, mut joint_shares) = (Vec::new(), Vec::new());
        for mode in 1..=MOST_MODES {
            let shape = shapes.get(mode - 1);
            let guess = shape.map_or(mode as f64, |shape| shape.lambda);
            let found = model.response(&point, mode, guess);
            let [kt, kr] = [Parameter::Kt, Parameter::Kr].map(|p| found.sensitivity[p as usize]);
            frequencies.push(found.frequency);
            joint_shares.push(kt.abs() + kr.abs());
        }
        Ok(Truths {
            test,
            model,
            shapes,
            nominal: Truth {
                frequencies,
                scale: 1.0,
                joint: test.joint,
                point,
            },
            joint_shares,
        })
    }

    /// Draws a truth near the nominal one: one factor on all frequencies, and each stiffness of the joint by
    /// another.
    pub fn draw(&self, width: f64, random: &mut impl Rng) -> Truth {
        let joint = &self.test.joint;
        let scale = variation(width, random).exp();
        let by_kx = variation(2.0 * width, random).exp();
        let by_ky = variation(2.0 * width, random).exp();
        // The coupling sqrt(Kx Ky)/Kz stays the same.
        let joint = JointStiffness {
            kx: joint.kx * by_kx,
            ky: joint.ky * by_ky,
            cross_compliance: joint.cross_compliance / (by_kx * by_ky).sqrt(),
        };
        let point = point_of(&self.model, self.test, &joint);
        let mut frequencies = Vec::new();
        for (index, shape) in self.shapes.iter().enumerate() {
            let found = self.model.response(&point, index + 1, shape.lambda);
            frequencies.push(scale * found.frequency);
        }
        Truth {
            frequencies,
            scale,
            joint,
            point,
        }
    }
}

/// The point of the frequency model at which the joint has these stiffnesses.
fn point_of(model: &FrequencyModel, test: &StudiedTest, joint: &JointStiffness) -> Point {
    let mut point = model.nominal();
    if test.structure.assembly != Assembly::Free {
        let joint = joint.in_si(&test.structure.beam);
        point[Parameter::Kt as usize] = joint.kt.ln();
        point[Parameter::Kr as usize] = joint.kr.ln();
        point[Parameter::Coupling as usize] = joint.coupling.atanh();
    }
    point
}

/// The sum of three uniform variations of one width each. It is as good as uniform between the lines (its
/// density there ripples by less than 2 % for any width beyond a line), and bounded.
fn variation(width: f64, random: &mut impl Rng) -> f64 {
    (0..3).map(|_| width * (random.random::<f64>() - 0.5)).sum()
}

/// One tap, from just before it on.
#[derive(Debug)]
pub(super) struct VirtualRecord {
    /// Sample rate (Hz).
    pub sample_rate: f64,
    /// Force (N).
    pub force: Vec<f64>,
    /// First sample after the pulse.
    pub pulse_end: usize,
    /// Acceleration of each sensor (m/s2).
    pub responses: Vec<Vec<f64>>,
    /// rms of each sensor's noise (m/s2).
    pub noise: Vec<f64>,
}

impl VirtualRecord {
    /// Records one tap of `samples` at `sample_rate` (Hz): the one place where the study meets the simulator.
    /// Shapes are the nominal Euler beam's; the frequencies are the draw's own.
    pub fn new(
        truths: &Truths,
        truth: &Truth,
        sample_rate: f64,
        samples: usize,
        settings: &ResolutionSettings,
        random: &mut impl Rng,
    ) -> Self {
        let mut shapes = truths.shapes.clone();
        for (shape, frequency) in shapes.iter_mut().zip(&truth.frequencies) {
            shape.frequency = *frequency;
        }
        let (test, damping) = (truths.test, [settings.damping_ratio]);
        let highest = PASSED * sample_rate;
        let modes = observed_modes(&shapes, &damping, test.tap, &test.sensors, highest);
        let tap = TapTestSettings {
            sample_rate,
            taps: 1,
            interval: samples as f64 / sample_rate + 0.05,
            lead: (AHEAD + 1) as f64 / sample_rate,
            // A tip whose pulse excites the whole band: 10 dB less at its upper end.
            pulse: 3.0 / sample_rate,
            signal_to_noise_db: f64::INFINITY,
            force_to_noise_db: f64::INFINITY,
            ..TapTestSettings::default()
        };
        let (force, mut responses) = struck(&modes, &tap, random.random(), samples);
        let mut noise = Vec::new();
        for response in &mut responses {
            let peak = response.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            let rms = below(peak, settings.noise_db);
            add_noise(response, rms, random);
            noise.push(rms);
        }
        let last = force.iter().rposition(|&f| f != 0.0);
        VirtualRecord {
            sample_rate,
            pulse_end: last.map_or(0, |last| last + 1),
            noise,
            force,
            responses,
        }
    }

    /// Returns the window as applied over a block of these lines.
    pub fn window(&self, name: WindowName, lines: &Lines) -> Window {
        match name {
            WindowName::Rectangular => Window::Rectangular,
            WindowName::Hann => Window::Hann,
            WindowName::Automatic => choose_window(&self.decays(lines), lines.duration),
            WindowName::Exponential => {
                let decays = self.decays(lines);
                let remaining = decays.iter().map(|check| check.remaining);
                exponential_to(remaining.fold(0.0, f64::max), lines.duration)
            }
        }
    }

    /// The decay of each sensor within a block of these lines.
    fn decays(&self, lines: &Lines) -> Vec<DecayCheck> {
        let gate = (lines.duration * self.sample_rate).round() as usize;
        let band = (lines.low, lines.high);
        // White noise keeps its density: in the band it has this share of its rms.
        let share = (2.0 * (band.1 - band.0) / self.sample_rate).min(1.0).sqrt();
        let limiter = BandLimiter::new(self.sample_rate, band, gate);
        let sensors = self.responses.iter().zip(&self.noise);
        sensors
            .map(|(samples, noise)| {
                let samples = &samples[..gate.min(samples.len())];
                measure_decay(&limiter.magnitude(samples), share * noise)
            })
            .collect()
    }
}

/// Force and responses of one tap, from just before it on. Each mode is simulated for as long as
/// anything is left of it: beyond that its numbers become so small that processors take a hundred times
/// as long for them. The seed makes it the same tap for all modes.
fn struck(
    modes: &[SimulatedMode],
    settings: &TapTestSettings,
    seed: u64,
    samples: usize,
) -> (Vec<f64>, Vec<Vec<f64>>) {
    let rate = settings.sample_rate;
    let sensors = modes.first().map_or(0, |mode| mode.shape_at_sensors.len());
    let mut force = vec![0.0; samples];
    let mut responses = vec![vec![0.0; samples]; sensors];
    for mode in modes {
        let decay = TAU * mode.frequency * mode.damping_ratio;
        let alone = TapTestSettings {
            interval: settings.interval.min(SILENT / decay + 0.1),
            ..settings.clone()
        };
        let recorded = simulate_tap_test(std::slice::from_ref(mode), &alone, seed);
        let time = recorded.tap_times.first().copied().unwrap_or(0.0);
        let begin = ((time * rate) as usize).saturating_sub(AHEAD);
        let pulse = recorded.force.iter().skip(begin);
        force.iter_mut().zip(pulse).for_each(|(f, new)| *f = *new);
        for (sum, response) in responses.iter_mut().zip(&recorded.responses) {
            let added = sum.iter_mut().zip(response.iter().skip(begin));
            added.for_each(|(sum, x)| *sum += x);
        }
    }
    (force, responses)
}
