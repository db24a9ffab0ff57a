//! Taps with exact decays, and what the whole chain says of them.
//!
//! Each case draws modes, hammer pulses, channels, a sample rate and a noise. Modes are poles of a discrete
//! recursion that the sampled force drives, so that every decay after a pulse is exact. The noise is white, coloured,
//! of heavy tails, or cut from real recordings. Each case has a seed of its own: the same seed gives the same numbers
//! whatever the number of threads.

use std::f64::consts::TAU;
use std::path::Path;

use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};
use tapjoint::description::{ChannelRef, WindowKind};
use tapjoint::modal::fit::UncertaintySource;
use tapjoint::modal::{FittedReading, ModeReading, ReadBy};
use tapjoint::pipeline::run_recording;
use tapjoint::recording::{Channel, ReadSettings, Recording, RecordingError, WavFormat, write_wav};
use tapjoint::stats::{NORMAL_95, student};

#[path = "functions.rs"]
pub mod functions;

/// Circumstances under which intervals are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cell {
    /// Records that ring down, damping 0.1 to 1 %, 35 to 70 dB.
    Clean,
    /// Pairs 0.3 % apart, damping 0.1 to 1.25 %, 60 dB.
    CloseModes,
    /// Frequencies that change with the amplitude by 10^-5 to 6 % along the decay.
    Drift,
    /// Two taps whose frequencies scatter by 10^-5 to 0.3 %.
    TwoTaps,
    /// Damping of 2 to 6 %.
    HeavyDamping,
    /// Mains hum 0.3 to 5 Hz beside a mode.
    Hum,
    /// Responses that end at 0.8 of their peak.
    Rails80,
    /// Responses that end at 0.5 of their peak.
    Rails50,
    /// Records that end where the slowest mode keeps 10 to 75 % of its amplitude, but not before 0.45 s.
    Undecayed,
    /// WAV files of 16 bits of which the peak uses 1 to 90 %.
    SixteenBit,
    /// The exponential window, asked for.
    ExponentialWindow,
    /// Frequency response functions instead of taps: damping 0.05 to 5 %, white noise, 40 to 60 dB.
    Functions,
}

impl Cell {
    pub const ALL: [Self; 12] = [
        Self::Clean,
        Self::CloseModes,
        Self::Drift,
        Self::TwoTaps,
        Self::HeavyDamping,
        Self::Hum,
        Self::Rails80,
        Self::Rails50,
        Self::Undecayed,
        Self::SixteenBit,
        Self::ExponentialWindow,
        Self::Functions,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::CloseModes => "close",
            Self::Drift => "drift",
            Self::TwoTaps => "two-taps",
            Self::HeavyDamping => "damped",
            Self::Hum => "hum",
            Self::Rails80 => "rails-80",
            Self::Rails50 => "rails-50",
            Self::Undecayed => "undecayed",
            Self::SixteenBit => "16-bit",
            Self::ExponentialWindow => "exponential",
            Self::Functions => "functions",
        }
    }
}

/// Noise of the responses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Noise {
    White,
    /// White noise through a pole at 0.9: 26 dB more at the lowest than at the highest frequencies.
    Red,
    /// Differences of white noise.
    Blue,
    /// Student's t of three degrees of freedom.
    HeavyTailed,
    /// Cut from a recording.
    Real,
}

/// Stretches of real recordings.
#[derive(Debug, Default)]
pub struct RealSignals {
    /// Noise before taps (any unit).
    pub noises: Vec<Vec<f64>>,
    /// Force pulses, their peaks 1.
    pub pulses: Vec<Vec<f64>>,
}

impl RealSignals {
    /// Cuts the noise before the taps on a spruce bar and on a guitar, and the pulses of two hammers, out of the
    /// files in a folder of real recordings.
    ///
    /// # Errors
    /// Files that are missing or cannot be read.
    pub fn open(folder: &Path) -> Result<Self, RecordingError> {
        let read = |file: &str, channel: usize, range: std::ops::Range<u64>| {
            let recording = Recording::open(&folder.join(file), &ReadSettings::default())?;
            let last = range.end.min(recording.frames());
            recording.read(channel, range.start..last)
        };
        let bar = "guitar_tap_wav/brace-umik-1-swift-mac-1778816093.wav";
        // The taps come at 2.924 and 2.371 s; both files have 48 kHz.
        let noises = vec![
            read(bar, 0, 9_600..134_400)?,
            read("guitar_tap_wav/Recording.wav", 0, 9_600..110_400)?,
            read("guitar_tap_wav/Recording.wav", 1, 9_600..110_400)?,
        ];
        let mut pulses = Vec::new();
        for (file, channel) in [
            ("ufffiles_jl_uff/dataset58_time.unv", 0),
            ("slater_cantilever/DERIVED_case1_time.csv", 0),
        ] {
            let force = read(file, channel, 0..4096)?;
            let rest = force.iter().sum::<f64>() / force.len() as f64;
            let peak = (0..force.len()).max_by(|&a, &b| force[a].total_cmp(&force[b]));
            let peak = peak.unwrap_or(0);
            let height = force[peak] - rest;
            // The pulse as far as it stands above 2 % of its peak: beyond lie noise and drift.
            let above = |&index: &usize| (force[index] - rest) > 0.02 * height;
            let first = (0..=peak).rev().take_while(above).last().unwrap_or(peak);
            let last = (peak..force.len()).take_while(above).last().unwrap_or(peak);
            let pulse = force[first..=last].iter();
            pulses.push(pulse.map(|x| (x - rest) / height).collect());
        }
        Ok(RealSignals { noises, pulses })
    }
}

/// What the program says of one mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    pub frequency: f64,
    pub std: f64,
    pub low: f64,
    pub high: f64,
    pub source: ReadBy,
    /// Degrees of freedom of Student's t behind the interval, where it comes from the scatter of the taps.
    pub freedom: Option<f64>,
    /// Damping ratio with its 95 % interval, of a fit.
    pub damping: Option<[f64; 3]>,
}

/// One mode of a case, and what the program says of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    pub case: usize,
    pub noise: Noise,
    /// What else was drawn, in words.
    pub about: String,
    /// True frequency (Hz): that at the amplitude that the program states. A drifting frequency without a stated
    /// amplitude has all from the largest amplitude to a tenth of it.
    pub truth: (f64, f64),
    pub damping_ratio: f64,
    /// Cramer-Rao bound of the frequency's standard deviation (Hz); of white noise.
    pub bound: Option<f64>,
    /// True where the reading stands for both modes of a close pair, which its interval must hold.
    pub shared: bool,
    /// `None` = missed.
    pub found: Option<Found>,
}

impl Answer {
    /// True where the interval holds the truth; `None` where the mode was missed.
    pub fn is_inside(&self) -> Option<bool> {
        let found = self.found?;
        Some(found.low <= self.truth.1 && self.truth.0 <= found.high)
    }

    /// Distance from the truth in standard deviations.
    ///
    /// The standard deviation of taps that scatter is the half length over 1.96. It belongs to Student's t, which with
    /// two taps lies beyond three of them in 3.3 % of all cases. There the distance counts as the normal one that is
    /// as improbable.
    pub fn deviations(&self) -> Option<f64> {
        let found = self.found?;
        let nearest = found.frequency.clamp(self.truth.0, self.truth.1);
        let normal = (found.frequency - nearest).abs() / found.std;
        let Some(freedom) = found.freedom else {
            return Some(normal);
        };
        let t = normal * student::quantile(0.05, freedom) / NORMAL_95;
        let standard = Normal::standard();
        Some(-standard.inverse_cdf(0.5 * student::two_sided(t, freedom)))
    }
}

/// One drawn mode.
#[derive(Debug, Clone)]
struct Mode {
    frequency: f64,
    damping_ratio: f64,
    /// Amplitude in each response.
    residues: Vec<f64>,
    /// Relative change of the frequency at the largest amplitude.
    drift: f64,
    /// Mode of which the intervals are counted.
    counts: bool,
}

/// One drawn test.
struct Case {
    cell: Cell,
    noise: Noise,
    rate: f64,
    modes: Vec<Mode>,
    taps: usize,
    /// Samples from one tap to the next.
    samples: usize,
    /// Quiet samples before the first tap.
    lead: usize,
    /// Frequency of the grid (Hz).
    grid: f64,
    responses: usize,
    has_hammer: bool,
    /// Height of the noise below the peak of the responses (dB).
    level: f64,
    /// Standard deviation of the taps' frequencies (1, relative).
    scatter: f64,
}

fn log_uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    random.random_range(low.ln()..high.ln()).exp()
}

impl Case {
    fn draw(cell: Cell, noises: &[Noise], random: &mut ChaCha8Rng) -> Self {
        const MOST_SAMPLES: f64 = 16_384.0;
        let rates = match cell {
            Cell::Hum => &[1024.0, 2560.0][..],
            _ => &[1024.0, 2560.0, 5120.0, 12_800.0],
        };
        let rate: f64 = rates[random.random_range(0..rates.len())];
        let responses = random.random_range(1..=3);
        // Decay of the slowest mode over a record.
        let decay = match cell {
            Cell::Undecayed => random.random_range(0.3..2.3),
            _ => random.random_range(5.0..12.0),
        };
        let (count, ratio, dampings) = match cell {
            Cell::HeavyDamping => (3, 1.9, (0.02, 0.06)),
            _ => (random.random_range(2..=5), 1.35, (0.001, 0.01)),
        };
        let mut modes = Vec::new();
        let mut frequency = rate * log_uniform(random, 0.02, 0.06);
        while modes.len() < count && frequency < 0.33 * rate {
            let least = decay * rate / (TAU * frequency * MOST_SAMPLES);
            let damping_ratio = log_uniform(random, dampings.0, dampings.1).max(least);
            modes.push(Mode {
                frequency,
                damping_ratio,
                residues: (0..responses)
                    .map(|_| {
                        let normal: f64 = StandardNormal.sample(random);
                        let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
                        sign * (0.7 * normal).exp()
                    })
                    .collect(),
                drift: 0.0,
                counts: true,
            });
            frequency *= ratio + random.random_range(0.0..0.3);
        }
        match cell {
            Cell::CloseModes => Self::pair(&mut modes, random),
            Cell::Hum => Self::beside_hum(&mut modes, decay * rate / MOST_SAMPLES, random),
            Cell::Drift => {
                for mode in &mut modes {
                    let sign = if random.random_bool(0.7) { -1.0 } else { 1.0 };
                    mode.drift = sign * log_uniform(random, 1e-5, 6e-2);
                }
            }
            _ => {}
        }
        let slowest = modes.iter().map(|m| TAU * m.frequency * m.damping_ratio);
        let slowest = slowest.fold(f64::INFINITY, f64::min);
        // Hands need some time between two taps.
        let seconds = (decay / slowest).max(0.45);
        Case {
            cell,
            noise: noises[random.random_range(0..noises.len())],
            rate,
            modes,
            taps: match cell {
                Cell::TwoTaps => 2,
                _ => random.random_range(2..=6),
            },
            samples: (seconds * rate) as usize,
            lead: (random.random_range(0.3..0.8) * rate) as usize,
            responses,
            has_hammer: random.random_bool(0.7),
            level: match cell {
                Cell::CloseModes => 60.0,
                _ => random.random_range(35.0..70.0),
            },
            scatter: match cell {
                Cell::TwoTaps => log_uniform(random, 1e-5, 3e-3),
                _ => 0.0,
            },
            grid: match cell {
                // Large grids keep to 0.02 Hz mostly, and to 0.2 Hz always.
                Cell::Hum => 50.0 + random.random_range(-0.1..0.1),
                _ => 50.0,
            },
        }
    }

    /// Puts a second mode 0.3 % above one of the modes.
    fn pair(modes: &mut Vec<Mode>, random: &mut ChaCha8Rng) {
        let first = random.random_range(0..modes.len());
        modes.iter_mut().for_each(|mode| mode.counts = false);
        modes[first].counts = true;
        let mut second = modes[first].clone();
        second.frequency *= 1.003;
        second.damping_ratio *= random.random_range(0.8..1.25);
        for residue in &mut second.residues {
            let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
            *residue = sign * log_uniform(random, 0.3, 3.0);
        }
        modes.insert(first + 1, second);
    }

    /// Moves the first mode beside a mains frequency.
    fn beside_hum(modes: &mut Vec<Mode>, least_decay: f64, random: &mut ChaCha8Rng) {
        let side = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        let frequency = 50.0 + side * log_uniform(random, 0.3, 5.0);
        let mut first = modes[0].clone();
        modes.retain(|mode| mode.frequency > 1.3 * frequency);
        modes.iter_mut().for_each(|mode| mode.counts = false);
        let damping_ratio = log_uniform(random, 0.001, 0.01);
        first.frequency = frequency;
        first.damping_ratio = damping_ratio.max(least_decay / (TAU * frequency));
        first.counts = true;
        modes.insert(0, first);
    }

    /// Samples of the force, and of one tap alone: the pulse of each tap with its place.
    fn pulses(&self, real: &RealSignals, random: &mut ChaCha8Rng) -> Vec<(usize, Vec<f64>)> {
        let highest = self.modes.iter().fold(0.0, |a: f64, m| a.max(m.frequency));
        let widest = (0.8 * self.rate / highest).max(3.0);
        let width = random.random_range(2.5..=widest);
        let shape = random.random_range(0..4);
        (0..self.taps)
            .map(|tap| {
                let start = self.lead + tap * self.samples + random.random_range(0..8);
                let peak = random.random_range(0.6..1.4);
                let width = width * random.random_range(0.9..1.1);
                if self.noise == Noise::Real && !real.pulses.is_empty() {
                    let one = &real.pulses[random.random_range(0..real.pulses.len())];
                    return (start, one.iter().map(|x| peak * x).collect());
                }
                let offset = random.random_range(0.0..1.0);
                let count = width.ceil() as usize + 1;
                let pulse = (0..count).map(|n| {
                    let x = (n as f64 + offset) / (width + 1.0);
                    let sine = (0.5 * TAU * x).sin().max(0.0);
                    peak * match shape {
                        0 => sine,
                        1 => sine.powi(2),
                        2 => sine.powi(3),
                        // A steep rise and a slow fall.
                        _ => sine * (1.0 - 0.8 * x),
                    }
                });
                (start, pulse.collect())
            })
            .collect()
    }

    fn about(&self, used: usize) -> String {
        format!(
            "{} modes, {used} of {} taps used, each of {:.2} s at {} Hz, {} responses, {} hammer, {:.0} dB",
            self.modes.len(),
            self.taps,
            self.samples as f64 / self.rate,
            self.rate,
            self.responses,
            if self.has_hammer { "a" } else { "no" },
            self.level
        )
    }

    /// Frames of the whole recording.
    fn frames(&self) -> usize {
        self.lead + self.taps * self.samples + 8
    }

    fn noise_samples(&self, real: &RealSignals, random: &mut ChaCha8Rng) -> Vec<f64> {
        let frames = self.frames();
        let mut samples: Vec<f64> = match self.noise {
            Noise::HeavyTailed => {
                let tails = StudentT::new(3.0).expect("a positive number of degrees of freedom");
                (0..frames).map(|_| tails.sample(random)).collect()
            }
            Noise::Real => {
                let source = &real.noises[random.random_range(0..real.noises.len())];
                let from = random.random_range(0..source.len());
                // There and back again: no step where the stretch ends.
                let turn = 2 * source.len() - 1;
                let places = (from..from + frames).map(|n| n % turn);
                places.map(|n| source[n.min(turn - n)]).collect()
            }
            _ => (0..frames).map(|_| StandardNormal.sample(random)).collect(),
        };
        let mut before = 0.0;
        for x in &mut samples {
            let white = *x;
            match self.noise {
                Noise::Red => *x += 0.9 * before,
                Noise::Blue => *x -= before,
                _ => {}
            }
            before = if self.noise == Noise::Red { *x } else { white };
        }
        let mean = samples.iter().sum::<f64>() / frames as f64;
        samples.iter_mut().for_each(|x| *x -= mean);
        let power = samples.iter().map(|x| x * x).sum::<f64>() / frames as f64;
        samples.iter_mut().for_each(|x| *x /= power.sqrt());
        samples
    }

    /// Analyses the case and compares each mode with its truth.
    fn answers(&self, case: usize, real: &RealSignals, random: &mut ChaCha8Rng) -> Vec<Answer> {
        let pulses = self.pulses(real, random);
        let frames = self.frames();
        let mut responses = vec![vec![0.0; frames]; self.responses];
        // Amplitude of each mode just after each pulse (without its residue).
        let mut heights = vec![Vec::new(); self.modes.len()];
        for (start, pulse) in &pulses {
            let normal: f64 = StandardNormal.sample(random);
            let moved = 1.0 + self.scatter * normal;
            for (mode, heights) in self.modes.iter().zip(&mut heights) {
                let slope = mode.drift / mode.largest(&pulses, self.rate);
                let states = mode.ring(pulse, frames - start, self.rate, moved, slope);
                heights.push(states[pulse.len().min(states.len() - 1)].norm());
                for (response, residue) in responses.iter_mut().zip(&mode.residues) {
                    for (x, state) in response[*start..].iter_mut().zip(&states) {
                        *x += residue * state.im;
                    }
                }
            }
        }
        let peak = |x: &[f64]| x.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let largest = responses.iter().fold(0.0, |a: f64, x| a.max(peak(x)));
        let noise_std = largest * 10f64.powf(-self.level / 20.0);
        for response in &mut responses {
            let noise = self.noise_samples(real, random);
            let phase = random.random_range(0.0..TAU);
            let hum = match self.cell {
                Cell::Hum => largest * log_uniform(random, 1e-3, 3e-2),
                _ => 0.0,
            };
            for (n, (x, noise)) in response.iter_mut().zip(noise).enumerate() {
                let turn = TAU * self.grid * n as f64 / self.rate + phase;
                *x += noise_std * noise + hum * (turn.sin() + 0.3 * (3.0 * turn).sin());
            }
            let rail = match self.cell {
                Cell::Rails80 => 0.8 * peak(response),
                Cell::Rails50 => 0.5 * peak(response),
                _ => f64::INFINITY,
            };
            response.iter_mut().for_each(|x| *x = x.clamp(-rail, rail));
        }
        let mut channels = Vec::new();
        if self.has_hammer {
            let mut force: Vec<f64> = (0..frames)
                .map(|_| {
                    let normal: f64 = StandardNormal.sample(random);
                    1e-3 * normal
                })
                .collect();
            for (start, pulse) in &pulses {
                for (x, value) in force[*start..].iter_mut().zip(pulse) {
                    *x += value;
                }
            }
            channels.push(force);
        }
        channels.extend(responses);
        let (readings, used) = self.readings(channels, random);
        let bounds = self.modes.iter().zip(&heights).map(|(mode, heights)| {
            (self.noise == Noise::White).then(|| mode.bound(heights, self, noise_std))
        });
        let bounds: Vec<Option<f64>> = bounds.collect();
        let largest = self.modes.iter();
        let largest: Vec<f64> = largest
            .map(|mode| mode.largest(&pulses, self.rate))
            .collect();
        self.compare(case, &readings, used, &bounds, &largest)
    }

    /// What the program reads from these channels, and how many taps it accepts.
    fn readings(
        &self,
        mut channels: Vec<Vec<f64>>,
        random: &mut ChaCha8Rng,
    ) -> (Vec<ModeReading>, usize) {
        // The file goes when the analysis has been made.
        let folder = tempfile::tempdir().expect("a folder for temporary files");
        let recording = if self.cell == Cell::SixteenBit {
            let part = log_uniform(random, 0.01, 0.9);
            for channel in &mut channels {
                let peak = channel.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
                channel.iter_mut().for_each(|x| *x *= part / peak);
            }
            let path = folder.path().join("taps.wav");
            write_wav(&path, self.rate as u32, &channels, WavFormat::Pcm16).expect("a WAV file");
            Recording::open(&path, &ReadSettings::default())
        } else {
            let channels = channels.into_iter().map(|samples| Channel {
                samples,
                ..Channel::default()
            });
            Recording::from_samples("taps", self.rate, channels.collect())
        };
        let hammer = self.has_hammer.then_some(ChannelRef::Number(1));
        let window = self.cell == Cell::ExponentialWindow;
        let recording = recording.expect("finite samples");
        let analysis = run_recording(recording, hammer.as_ref(), |settings| {
            settings.taps.keep_overload = matches!(self.cell, Cell::Rails80 | Cell::Rails50);
            if window {
                settings.window = Some(WindowKind::Exponential);
            }
        });
        let Ok(analysis) = analysis else {
            return (Vec::new(), 0);
        };
        let used = analysis.recordings[0].measurement.taps.accepted().count();
        let modes = analysis.modes.into_iter();
        let modes = modes.filter(|mode| mode.mode.is_some());
        (modes.filter_map(|mode| mode.reading).collect(), used)
    }

    /// Gives each mode the reading nearest to it; a reading belongs to the mode nearest to it.
    fn compare(
        &self,
        case: usize,
        readings: &[ModeReading],
        used: usize,
        bounds: &[Option<f64>],
        largest: &[f64],
    ) -> Vec<Answer> {
        let truths: Vec<(f64, f64)> = self.modes.iter().map(Mode::truth).collect();
        let mut own: Vec<Option<&ModeReading>> = vec![None; truths.len()];
        for reading in readings {
            let distance = |truth: &(f64, f64)| {
                (reading.frequency - reading.frequency.clamp(truth.0, truth.1)).abs()
            };
            let nearest = (0..truths.len())
                .min_by(|&a, &b| distance(&truths[a]).total_cmp(&distance(&truths[b])));
            let Some(nearest) = nearest else { continue };
            // What lies a tenth away stands for nothing that was drawn.
            let reach = 0.1 * truths[nearest].1;
            let nearer = own[nearest].is_none_or(|other| {
                let theirs = other.frequency.clamp(truths[nearest].0, truths[nearest].1);
                distance(&truths[nearest]) < (other.frequency - theirs).abs()
            });
            if distance(&truths[nearest]) < reach && nearer {
                own[nearest] = Some(reading);
            }
        }
        let mut shared = vec![false; truths.len()];
        if self.cell == Cell::CloseModes {
            let first = self.modes.iter().position(|mode| mode.counts).unwrap_or(0);
            self.settle_pair(first, readings, &truths, &mut own, &mut shared);
        }
        let mut answers = Vec::new();
        for (index, mode) in self
            .modes
            .iter()
            .enumerate()
            .filter(|(_, mode)| mode.counts)
        {
            let mut truth = truths[index];
            if let Some(at) = own[index].and_then(|reading| reading.at_amplitude.as_ref()) {
                let part = at.value / mode.residues[at.sensor].abs() / largest[index];
                truth = (mode.truth_at(part), mode.truth_at(part));
            }
            answers.push(Answer {
                case,
                noise: self.noise,
                about: self.about(used),
                truth,
                damping_ratio: mode.damping_ratio,
                bound: bounds[index],
                shared: shared[index],
                found: own[index].map(found),
            });
        }
        answers
    }

    /// Two readings near a close pair are its two modes, in order; one reading stands for both.
    fn settle_pair<'r>(
        &self,
        first: usize,
        readings: &'r [ModeReading],
        truths: &[(f64, f64)],
        own: &mut [Option<&'r ModeReading>],
        shared: &mut [bool],
    ) {
        let (low, high) = (truths[first].0, truths[first + 1].0);
        let reach = 3.0 * (high - low);
        let near = readings
            .iter()
            .filter(|reading| (low - reach..high + reach).contains(&reading.frequency));
        let near: Vec<&ModeReading> = near.collect();
        match near[..] {
            [] => {}
            [one] => {
                own[first..first + 2].fill(Some(one));
                shared[first..first + 2].fill(true);
            }
            [one, .., other] => {
                own[first] = Some(one);
                own[first + 1] = Some(other);
            }
        }
    }
}

fn found(reading: &ModeReading) -> Found {
    let damping = reading.fit.as_ref().map(|fit| {
        let ratio = fit.mode.damping_ratio;
        [ratio.value, ratio.low, ratio.high]
    });
    let fitted = reading.fit.as_deref().map(FittedReading::frequency);
    let scattering = fitted.filter(|value| value.source == UncertaintySource::TapScatter);
    Found {
        freedom: scattering.map(|value| value.freedom),
        frequency: reading.frequency,
        std: reading.std.unwrap_or(f64::NAN),
        low: reading.interval.0,
        high: reading.interval.1,
        source: reading.source,
        damping,
    }
}

impl Mode {
    /// Free amplitude on the samples from the beginning of a pulse: z' = p z + f with the pole
    /// p = omega(-zeta + j sqrt(1 - zeta^2)). `moved` is a factor on the frequency; `slope` is its relative change over
    /// the amplitude.
    fn ring(
        &self,
        pulse: &[f64],
        frames: usize,
        rate: f64,
        moved: f64,
        slope: f64,
    ) -> Vec<Complex64> {
        let omega = TAU * self.frequency * moved;
        let damped = (1.0 - self.damping_ratio.powi(2)).sqrt();
        let pole = Complex64::new(-self.damping_ratio, damped) * omega;
        let step = (pole / rate).exp();
        // Integral of the amplitude over a sample, relative to that at its beginning: the phase turns by it exactly.
        let lasting = -(pole.re / rate).exp_m1() / -pole.re;
        let mut state = Complex64::ZERO;
        let mut states = Vec::with_capacity(frames);
        for n in 0..frames {
            let step = match slope {
                0.0 => step,
                _ => {
                    let turn = omega * damped * slope * state.norm() * lasting;
                    step * Complex64::from_polar(1.0, turn)
                }
            };
            state = state * step + pulse.get(n).copied().unwrap_or(0.0);
            states.push(state);
        }
        states
    }

    /// Largest amplitude after any of the pulses, at a constant frequency.
    fn largest(&self, pulses: &[(usize, Vec<f64>)], rate: f64) -> f64 {
        let rings = pulses
            .iter()
            .flat_map(|(_, pulse)| self.ring(pulse, pulse.len(), rate, 1.0, 0.0));
        rings.fold(0.0, |most: f64, state| most.max(state.norm()))
    }

    /// The true frequency at a part of the largest amplitude.
    fn truth_at(&self, part: f64) -> f64 {
        self.frequency * (1.0 + self.drift * part)
    }

    /// The true frequency; of a drifting one all that it has from the largest amplitude to a tenth of it.
    fn truth(&self) -> (f64, f64) {
        let ends = [1.0, 0.1].map(|part| self.truth_at(part));
        (ends[0].min(ends[1]), ends[0].max(ends[1]))
    }

    /// Cramer-Rao bound of the frequency (Hz) in white noise, all amplitudes unknown, the mode alone.
    ///
    /// With the sums S_k = sum t^k e^{-2 sigma t} over the samples of a decay, each column of amplitude a holds
    /// |a|^2/(2 s^2) (S_2 - S_1^2/S_0) of information on the pole's angular frequency, over many cycles.
    fn bound(&self, heights: &[f64], case: &Case, noise: f64) -> f64 {
        let sigma = TAU * self.frequency * self.damping_ratio;
        let mut sums = [0.0; 3];
        for n in 0..case.samples {
            let t = n as f64 / case.rate;
            let weight = (-2.0 * sigma * t).exp();
            sums[0] += weight;
            sums[1] += t * weight;
            sums[2] += t * t * weight;
        }
        let spread = sums[2] - sums[1] * sums[1] / sums[0];
        let residues: f64 = self.residues.iter().map(|x| x * x).sum();
        let heights: f64 = heights.iter().map(|x| x * x).sum();
        let information = residues * heights / (2.0 * noise * noise) * spread;
        information.sqrt().recip() / TAU
    }
}

/// Draws cases until they have `modes` modes, and analyses them.
pub fn run_cell(
    cell: Cell,
    modes: usize,
    seed: u64,
    noises: &[Noise],
    real: &RealSignals,
) -> Vec<Answer> {
    if cell == Cell::Functions {
        return functions::run(modes, seed).answers;
    }
    // Every case has at least one mode that counts; the cases are taken in their order.
    let mut answers: Vec<Answer> = Vec::new();
    let mut first = 0;
    while answers.len() < modes {
        let rest = modes - answers.len();
        let batch: Vec<Vec<Answer>> = (first..first + rest.div_ceil(4).max(8))
            .into_par_iter()
            .map(|index| {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                random.set_stream(((cell as u64) << 32) + index as u64);
                let case = Case::draw(cell, noises, &mut random);
                case.answers(index, real, &mut random)
            })
            .collect();
        first += batch.len();
        answers.extend(batch.into_iter().flatten());
    }
    answers.truncate(modes);
    answers
}
