//! One virtual test: its truth, its recording, and the reading of each mode on the line, between the lines and by a fit.

use super::plan::{BandPlan, Layout};
use super::result::WindowName;
use super::{ResolutionError, ResolutionSettings, StudiedTest};
use num_complex::Complex64;
use rand::{Rng, RngExt};
use std::f64::consts::TAU;
use tapjoint_analysis::jointed_structure;
use tapjoint_beam::{Assembly, JointStiffness, ModeShape, mode_shapes};
use tapjoint_identify::consistent::{FrequencyModel, Parameter, Point};
use tapjoint_signal::modal::fit::{FitSettings, FreeDecayCollector, PoleStart, fit_modes};
use tapjoint_signal::modal::{
    CompositeLevel, FittedReading, ModeReading, PeakSettings, ReadBy, find_peaks, read_peaks,
};
use tapjoint_signal::spectral::{
    DecayCheck, Lines, SpectralAverager, Window, band_limited, choose_window, exponential_to,
    largest_smooth_block, measure_decay,
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
        let sensors = self.responses.iter().zip(&self.noise);
        sensors
            .map(|(samples, noise)| {
                let samples = &samples[..gate.min(samples.len())];
                let limited = band_limited(samples, self.sample_rate, band);
                measure_decay(&limited, share * noise)
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

/// Fewest samples of a decay that is worth a fit.
const LEAST_SAMPLES: usize = 64;

/// One frequency as read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Read {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its stated standard uncertainty (Hz).
    pub std: f64,
    /// The way of reading: the wanted one, or the next best.
    pub source: ReadBy,
}

/// Readings of every mode of the study, in the order of [`ReadBy::ALL`]; none where a mode is not in the band.
pub(super) type BandReadings = Vec<[Option<Read>; 3]>;

/// Index of a way of reading in [`ReadBy::ALL`].
pub(super) fn index_of(reading: ReadBy) -> usize {
    match reading {
        ReadBy::Line => 0,
        ReadBy::Interpolated => 1,
        ReadBy::Fit => 2,
    }
}

/// Reads every mode of a band in every wanted way.
pub(super) fn read_band(
    band: &BandPlan,
    window: Window,
    record: &VirtualRecord,
    layout: &Layout,
    truth: &Truth,
    wanted: &[ReadBy],
) -> BandReadings {
    let mut readings = peak_readings(band, window, record);
    let mut places = vec![None; layout.modes.len()];
    for &mode in &band.modes {
        let frequency = truth.frequencies[layout.modes[mode].number - 1];
        // The nearest reading within the mode's line, a line more, or its half-power width.
        let mut least = f64::INFINITY;
        for (place, reading) in readings.iter().enumerate() {
            let distance = (reading.line_frequency - frequency).abs();
            let width = reading.damping_ratio.unwrap_or(0.0) * frequency;
            if distance <= 3.0 * band.lines.half_line() + width && distance < least {
                least = distance;
                places[mode] = Some(place);
            }
        }
    }
    if wanted.contains(&ReadBy::Fit) {
        fit(band, record, &mut readings, &places);
    }
    places
        .into_iter()
        .map(|place| {
            ReadBy::ALL.map(|name| {
                let reading = readings.get(place?).filter(|_| wanted.contains(&name))?;
                let mut reading = reading.clone();
                reading.select_estimate(name);
                Some(Read {
                    frequency: reading.frequency,
                    std: reading.std.unwrap_or(reading.half_line),
                    source: reading.source,
                })
            })
        })
        .collect()
}

/// Peaks of H1 over all sensors, read on their lines and between them.
fn peak_readings(band: &BandPlan, window: Window, record: &VirtualRecord) -> Vec<ModeReading> {
    let rate = record.sample_rate;
    let force = transformed(band, window, rate, &record.force, record.pulse_end);
    let responses = record.responses.iter();
    let responses: Vec<Vec<Complex64>> = responses
        .map(|x| transformed(band, window, rate, x, band.gate))
        .collect();
    let mut averager = SpectralAverager::new(band.lines, responses.len());
    averager.add(Some(&force), &responses);
    let Some(averages) = averager.finish() else {
        return Vec::new();
    };
    let Some(h1) = &averages.h1 else {
        return Vec::new();
    };
    let powers: Vec<Vec<f64>> = h1
        .iter()
        .map(|h| h.iter().map(Complex64::norm_sqr).collect())
        .collect();
    // The part of H1 that noise alone would leave. White noise of rms s has E|X|^2 = s^2 sum w^2/rate^2 under a
    // window w, which a quiet stretch before the tap would show.
    let mut weights = vec![1.0; band.gate];
    window.apply(&mut weights, rate);
    let energy: f64 = weights.iter().map(|w| w * w).sum();
    let force = averages.force_power.as_deref().unwrap_or_default();
    let mut noise: Vec<Vec<f64>> = Vec::with_capacity(record.noise.len());
    for level in &record.noise {
        let power = (level / rate).powi(2) * energy;
        let quotients = force.iter().map(|f| power / f.max(f64::MIN_POSITIVE));
        noise.push(quotients.collect());
    }
    let level = CompositeLevel::new(band.lines, &powers, Some(&noise));
    let peaks = find_peaks(&level, &PeakSettings::default());
    let spectra: Vec<&[Complex64]> = h1.iter().map(Vec::as_slice).collect();
    read_peaks(&level, &spectra, &peaks, window)
}

/// The spectrum of the samples up to `end` under the window.
fn transformed(
    band: &BandPlan,
    window: Window,
    sample_rate: f64,
    samples: &[f64],
    end: usize,
) -> Vec<Complex64> {
    let mut windowed = samples[..end.min(samples.len())].to_vec();
    // A Hann window is over the whole block, however much of it is zero.
    if window == Window::Hann {
        windowed.resize(band.gate, 0.0);
    }
    window.apply(&mut windowed, sample_rate);
    band.transformer.transform(&windowed)
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
    let Some(samples) = band
        .gate
        .checked_sub(record.pulse_end)
        .and_then(largest_smooth_block)
        .filter(|&samples| samples >= LEAST_SAMPLES)
    else {
        return;
    };
    let range = [(band.lines.low, band.lines.high)];
    let decays: Vec<Vec<f64>> = record
        .responses
        .iter()
        .map(|response| response[record.pulse_end..].to_vec())
        .collect();
    let decay = FreeDecayCollector::new(record.sample_rate, samples, &range).and_then(|mut all| {
        all.add_tap(&decays)?;
        all.finish()
    });
    let Ok(decay) = decay else {
        return;
    };
    let fits = fit_modes(&decay, &starts, &FitSettings::default());
    for (place, fit) in chosen.into_iter().zip(fits) {
        readings[place].fit = fit.ok().map(|mode| Box::new(FittedReading::new(mode)));
    }
}
