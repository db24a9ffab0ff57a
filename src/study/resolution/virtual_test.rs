//! One virtual test: its truth, its recording, its readings and its estimates.

use super::estimate::{Estimators, ParameterErrors};
use super::plan::{BandPlan, BlockPlan, readings_of};
use super::result::WindowName;
use super::{ResolutionError, ResolutionSettings, StudiedTest};
use num_complex::Complex64;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, JointStiffness, ModeShape, mode_shapes};
use tapjoint_identify::consistent::{FrequencyModel, Parameter, Point};
use tapjoint_signal::modal::fit::{FitSettings, FreeDecayCollector, PoleStart, fit_modes};
use tapjoint_signal::modal::{
    CompositeLevel, FittedReading, ModeReading, PeakSettings, ReadBy, find_peaks, read_peaks,
};
use tapjoint_signal::spectral::{
    AveragedSpectra, DecayCheck, Lines, SpectralAverager, Window, band_limited, choose_window,
    exponential_to, largest_smooth_block, measure_decay,
};
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

/// Index of a way of reading in [`ReadBy::ALL`].
pub(super) fn index_of(reading: ReadBy) -> usize {
    match reading {
        ReadBy::Line => 0,
        ReadBy::Interpolated => 1,
        ReadBy::Fit => 2,
    }
}

/// What one virtual test gave.
#[derive(Debug)]
pub(super) struct Outcome {
    /// What is true.
    pub truth: Truth,
    /// For each window, for each band, for each of its modes: what each reading of
    /// [`ReadBy::ALL`] says.
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

/// Fewest samples of a decay that is worth a fit.
const LEAST_SAMPLES: usize = 64;

/// One frequency as read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Read {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its stated standard uncertainty (Hz).
    pub std: f64,
    /// How it was read: what was wanted, or the next best.
    pub source: ReadBy,
}

/// The window as applied over a block of these lines.
pub(super) fn window_of(name: WindowName, lines: &Lines, record: &VirtualRecord) -> Window {
    let checks = || -> Vec<DecayCheck> {
        let gate = (lines.duration * record.sample_rate).round() as usize;
        let band = (lines.low, lines.high);
        // White noise keeps its density: in the band it has this share of its rms.
        let share = (2.0 * (band.1 - band.0) / record.sample_rate)
            .min(1.0)
            .sqrt();
        let check = |(samples, noise): (&Vec<f64>, &f64)| {
            let samples = &samples[..gate.min(samples.len())];
            measure_decay(
                &band_limited(samples, record.sample_rate, band),
                share * noise,
            )
        };
        record
            .responses
            .iter()
            .zip(&record.noise)
            .map(check)
            .collect()
    };
    match name {
        WindowName::Rectangular => Window::Rectangular,
        WindowName::Hann => Window::Hann,
        WindowName::Automatic => choose_window(&checks(), lines.duration),
        WindowName::Exponential => {
            let remaining = checks()
                .iter()
                .map(|check| check.remaining)
                .fold(0.0, f64::max);
            exponential_to(remaining, lines.duration)
        }
    }
}

/// Reads every mode of a band in every wanted way.
fn read_band(
    band: &BandPlan,
    window: usize,
    record: &VirtualRecord,
    (truth, numbers, wanted): (&Truth, &[usize], &[ReadBy]),
) -> Vec<[Option<Read>; 3]> {
    let window = band
        .windows
        .get(window)
        .copied()
        .unwrap_or(Window::Rectangular);
    let mut readings = peak_readings(band, window, record);
    let places: Vec<Option<usize>> = band
        .modes
        .iter()
        .map(|&mode| {
            let number = numbers.get(mode).copied().unwrap_or(1);
            place_of(truth.frequencies[number - 1], &readings, &band.lines)
        })
        .collect();
    if wanted.contains(&ReadBy::Fit) {
        fit(band, record, &mut readings, &places);
    }
    let read = |place: &Option<usize>| {
        ReadBy::ALL.map(|name| {
            let reading = readings.get((*place)?).filter(|_| wanted.contains(&name))?;
            Some(read_as(reading, name))
        })
    };
    places.iter().map(read).collect()
}

fn read_as(reading: &ModeReading, name: ReadBy) -> Read {
    let mut reading = reading.clone();
    reading.select_estimate(name);
    Read {
        frequency: reading.frequency,
        std: reading.std.unwrap_or(reading.half_line),
        source: reading.source,
    }
}

/// Peaks of H1 over all sensors, read on their lines and between them.
fn peak_readings(band: &BandPlan, window: Window, record: &VirtualRecord) -> Vec<ModeReading> {
    let averages = averages(band, window, record);
    let Some(h1) = &averages.h1 else {
        return Vec::new();
    };
    let powers: Vec<Vec<f64>> = h1
        .iter()
        .map(|h| h.iter().map(Complex64::norm_sqr).collect())
        .collect();
    let noise = noise_powers(&averages, window, (band.gate, record));
    let level = CompositeLevel::new(band.lines, &powers, Some(&noise));
    let peaks = find_peaks(&level, &PeakSettings::default());
    let spectra: Vec<&[Complex64]> = h1.iter().map(Vec::as_slice).collect();
    read_peaks(&level, &spectra, &peaks, window)
}

fn averages(band: &BandPlan, window: Window, record: &VirtualRecord) -> AveragedSpectra {
    let transformed = |samples: &Vec<f64>, end: usize| {
        let mut windowed = samples[..end.min(samples.len())].to_vec();
        // A Hann window is over the whole block, whatever of it is not zero.
        match window {
            Window::Hann => {
                windowed.resize(band.gate, 0.0);
                window.apply(&mut windowed, record.sample_rate);
            }
            _ => window.apply(&mut windowed, record.sample_rate),
        }
        band.transformer.transform(&windowed)
    };
    let force = transformed(&record.force, record.pulse_end);
    let responses: Vec<Vec<Complex64>> = record
        .responses
        .iter()
        .map(|x| transformed(x, band.gate))
        .collect();
    let mut averager = SpectralAverager::new(band.lines, responses.len());
    averager.add(Some(&force), &responses);
    averager
        .finish()
        .unwrap_or_else(|| AveragedSpectra::empty(band.lines))
}

/// What noise alone would leave of H1. White noise of rms s has E|X|^2 = s^2 sum w^2/rate^2 under a
/// window w: what a quiet stretch before the tap would tell.
fn noise_powers(
    averages: &AveragedSpectra,
    window: Window,
    (gate, record): (usize, &VirtualRecord),
) -> Vec<Vec<f64>> {
    let mut weights = vec![1.0; gate];
    window.apply(&mut weights, record.sample_rate);
    let energy: f64 = weights.iter().map(|w| w * w).sum();
    let force = averages.force_power.as_deref().unwrap_or_default();
    let of = |level: &f64| {
        let power = (level / record.sample_rate).powi(2) * energy;
        force
            .iter()
            .map(|f| power / f.max(f64::MIN_POSITIVE))
            .collect()
    };
    record.noise.iter().map(of).collect()
}

/// The reading of a mode: the nearest one within its line, a line more, or its half-power width.
fn place_of(frequency: f64, readings: &[ModeReading], lines: &Lines) -> Option<usize> {
    let distance = |reading: &ModeReading| (reading.line_frequency - frequency).abs();
    let width = |reading: &ModeReading| reading.damping_ratio.unwrap_or(0.0) * frequency;
    let near =
        |reading: &&ModeReading| distance(reading) <= 3.0 * lines.half_line() + width(reading);
    let places = readings
        .iter()
        .enumerate()
        .filter(|(_, reading)| near(reading));
    places
        .min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)))
        .map(|(place, _)| place)
}

/// Fits the free decay from every resonance, and from whatever was read near a mode.
fn fit(
    band: &BandPlan,
    record: &VirtualRecord,
    readings: &mut [ModeReading],
    places: &[Option<usize>],
) {
    let chosen: Vec<usize> = (0..readings.len())
        .filter(|place| readings[*place].label.is_none() || places.contains(&Some(*place)))
        .collect();
    let starts: Vec<PoleStart> = chosen
        .iter()
        .map(|&place| PoleStart {
            frequency: readings[place].frequency,
            damping_ratio: readings[place].damping_ratio,
        })
        .collect();
    let Some(fits) = fits(band, record, &starts) else {
        return;
    };
    for (place, fit) in chosen.into_iter().zip(fits) {
        readings[place].fit = fit.ok().map(|mode| Box::new(FittedReading::new(mode)));
    }
}

type Fits = Vec<Result<tapjoint_signal::modal::fit::ModeFit, tapjoint_signal::modal::fit::Unfit>>;

fn fits(band: &BandPlan, record: &VirtualRecord, starts: &[PoleStart]) -> Option<Fits> {
    let decay = band.gate.checked_sub(record.pulse_end)?;
    let samples = largest_smooth_block(decay).filter(|&samples| samples >= LEAST_SAMPLES)?;
    let range = [(band.lines.low, band.lines.high)];
    let mut collector = FreeDecayCollector::new(record.sample_rate, samples, &range).ok()?;
    let free = |x: &Vec<f64>| x[record.pulse_end..].to_vec();
    let responses: Vec<Vec<f64>> = record.responses.iter().map(free).collect();
    collector.add_tap(&responses).ok()?;
    Some(fit_modes(
        &collector.finish().ok()?,
        starts,
        &FitSettings::default(),
    ))
}
