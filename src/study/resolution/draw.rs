//! One virtual test: its truth, its recording, its readings and estimates.

use std::f64::consts::TAU;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::estimate::{Estimators, ParameterErrors};
use super::plan::{BlockPlan, readings_of};
use super::reading::{Read, read_band};
use super::{ResolutionError, ResolutionSettings, StudiedTest};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, JointStiffness, ModeShape, mode_shapes};
use tapjoint_identify::consistent::{FrequencyModel, Parameter, Point};
use tapjoint_simulate::{SimulatedMode, TapTestSettings, seen_modes, simulate_tap_test};

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
pub(super) struct Truths {
    model: FrequencyModel,
    nominal: Point,
    shapes: Vec<ModeShape>,
    /// Nominal frequencies (Hz), mode 1 first.
    pub frequencies: Vec<f64>,
    /// Derivatives of ln frequency with ln stiffness, summed over the joint's stiffnesses.
    pub joint_shares: Vec<f64>,
}

/// What is true in one draw.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Truth {
    /// Natural frequencies (Hz), mode 1 first.
    pub frequencies: Vec<f64>,
    /// Factor on all frequencies: the root of that on the modulus, with the joint's stiffnesses (N/m,
    /// N m/rad) by the same factor, so that the non-dimensional ones stay.
    pub scale: f64,
    /// The joint (1).
    pub joint: JointStiffness,
    /// The same where the model is asked, without the scale.
    pub point: Point,
}

impl Truths {
    pub fn new(test: &StudiedTest) -> Result<Self, ResolutionError> {
        let structure = super::estimate::jointed(test);
        let assembly = test.structure.assembly;
        let model = FrequencyModel::new(&structure, MOST_MODES)?;
        let shapes = mode_shapes(&test.structure.beam, assembly, &test.joint, MOST_MODES)?;
        let mut truths = Truths {
            nominal: model.nominal(),
            model,
            shapes,
            frequencies: Vec::new(),
            joint_shares: Vec::new(),
        };
        truths.nominal = truths.point_of(test, &test.joint);
        for mode in 1..=MOST_MODES {
            let guess = truths
                .shapes
                .get(mode - 1)
                .map_or(mode as f64, |s| s.lambda);
            let found = truths.model.response(&truths.nominal, mode, guess);
            let share = |parameter: Parameter| found.sensitivity[parameter as usize].abs();
            truths.frequencies.push(found.frequency);
            truths
                .joint_shares
                .push(share(Parameter::Kt) + share(Parameter::Kr));
        }
        Ok(truths)
    }

    /// Where the model is asked for this joint.
    fn point_of(&self, test: &StudiedTest, joint: &JointStiffness) -> Point {
        let mut point = self.model.nominal();
        if test.structure.assembly != Assembly::Free {
            let units = StiffnessUnits::of(&test.structure.beam);
            point[Parameter::Kt as usize] = (joint.kx * units.kt).ln();
            point[Parameter::Kr as usize] = (joint.ky * units.kr).ln();
            let coupling = joint.coupling();
            let coupling = if coupling.is_finite() { coupling } else { 0.0 };
            point[Parameter::Coupling as usize] = coupling.atanh();
        }
        point
    }

    /// The nominal test.
    pub fn nominal(&self, test: &StudiedTest) -> Truth {
        Truth {
            frequencies: self.frequencies.clone(),
            scale: 1.0,
            joint: test.joint,
            point: self.nominal,
        }
    }

    /// A truth near the nominal one: one factor on all frequencies, and each stiffness of the joint by
    /// another. The sum of three uniform variations of one line each is as good as uniform between the
    /// lines (its density there ripples by less than 2 % for any width beyond a line), and bounded.
    fn draw(&self, test: &StudiedTest, width: f64, random: &mut impl Rng) -> Truth {
        let mut three =
            |width: f64| -> f64 { (0..3).map(|_| width * (random.random::<f64>() - 0.5)).sum() };
        let scale = three(width).exp();
        let (by_kx, by_ky) = (three(2.0 * width).exp(), three(2.0 * width).exp());
        // The coupling sqrt(Kx Ky)/Kz stays what it is.
        let joint = JointStiffness {
            kx: test.joint.kx * by_kx,
            ky: test.joint.ky * by_ky,
            cross_compliance: test.joint.cross_compliance / (by_kx * by_ky).sqrt(),
        };
        let point = self.point_of(test, &joint);
        let frequency = |(index, shape): (usize, &ModeShape)| {
            scale
                * self
                    .model
                    .response(&point, index + 1, shape.lambda)
                    .frequency
        };
        Truth {
            frequencies: self.shapes.iter().enumerate().map(frequency).collect(),
            scale,
            joint,
            point,
        }
    }
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

/// The recording of one tap of `samples` at `sample_rate` (Hz): the one place where the study meets
/// the simulator. Shapes are the nominal Euler beam's; the frequencies are the draw's own.
fn virtual_record(
    (truths, truth): (&Truths, &Truth),
    (sample_rate, samples): (f64, usize),
    test: &StudiedTest,
    settings: &ResolutionSettings,
    random: &mut impl Rng,
) -> VirtualRecord {
    let mut shapes = truths.shapes.clone();
    for (shape, frequency) in shapes.iter_mut().zip(&truth.frequencies) {
        shape.frequency = *frequency;
    }
    let places = (test.tap, &test.sensors[..]);
    let modes = seen_modes(
        &shapes,
        &[settings.damping_ratio],
        places,
        PASSED * sample_rate,
    );
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
    let (force, mut responses) = struck(&modes, &tap, (random.random(), samples));
    let noise = responses
        .iter_mut()
        .map(|x| add_noise(x, settings.noise_db, random));
    let last = force.iter().rposition(|&f| f != 0.0);
    VirtualRecord {
        sample_rate,
        pulse_end: last.map_or(0, |last| last + 1),
        noise: noise.collect(),
        force,
        responses,
    }
}

/// Force and responses of one tap, from just before it on. Each mode is simulated for as long as
/// anything is left of it: beyond that its numbers become so small that processors take a hundred times
/// as long for them. The seed makes it the same tap for all modes.
fn struck(
    modes: &[SimulatedMode],
    settings: &TapTestSettings,
    (seed, samples): (u64, usize),
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

/// Adds white noise so many dB below the peak; its rms.
fn add_noise(samples: &mut [f64], below_peak: f64, random: &mut impl Rng) -> f64 {
    let peak = samples.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let level = peak * 10f64.powf(-below_peak / 20.0);
    for x in samples {
        let noise: f64 = StandardNormal.sample(random);
        *x += level * noise;
    }
    level
}

/// A record of the nominal test.
pub(super) fn sample_draw(
    plan: &BlockPlan,
    sample_rate: f64,
    settings: &ResolutionSettings,
    (test, truths): (&StudiedTest, &Truths),
) -> VirtualRecord {
    let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
    let truth = truths.nominal(test);
    let length = (sample_rate, plan.samples);
    virtual_record((truths, &truth), length, test, settings, &mut random)
}

/// What one virtual test gave.
#[derive(Debug)]
pub(super) struct Outcome {
    /// What is true.
    pub truth: Truth,
    /// For each window, for each band, for each of its modes: what each reading of
    /// [`super::ReadingName::ALL`] says.
    pub readings: Vec<Vec<Vec<[Option<Read>; 3]>>>,
    /// For each window, for each of the study's readings, for each estimator: errors of the
    /// stiffnesses; `None` where the draw was not read that way.
    pub estimates: Vec<Vec<Option<[ParameterErrors; 2]>>>,
}

/// Makes one virtual test, reads it and estimates its joint.
pub(super) fn drawn(
    plan: &BlockPlan,
    (block, index): (usize, usize),
    settings: &ResolutionSettings,
    (test, truths, estimators): (&StudiedTest, &Truths, &Estimators),
) -> Outcome {
    // A stream for each draw: who computes it does not matter.
    let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
    random.set_stream(((block as u64) << 32) + index as u64 + 1);
    let truth = truths.draw(test, plan.variation, &mut random);
    let length = (estimators.sample_rate, plan.samples);
    let record = virtual_record((truths, &truth), length, test, settings, &mut random);
    let wanted = readings_of(settings, index);
    let numbers = &estimators.numbers;
    let readings: Vec<Vec<Vec<_>>> = (0..settings.windows.len())
        .map(|window| {
            let band = |band| read_band(band, window, &record, (&truth, numbers, &wanted));
            plan.bands.iter().map(band).collect()
        })
        .collect();
    let estimates = readings
        .iter()
        .map(|bands| {
            let one = |reading| {
                let asked = wanted.contains(reading);
                asked.then(|| estimators.errors(&truth, (plan, bands), *reading))
            };
            settings.readings.iter().map(one).collect()
        })
        .collect();
    Outcome {
        truth,
        readings,
        estimates,
    }
}
