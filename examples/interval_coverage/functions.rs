//! Frequency response functions of known modes with noise on every line, and what the program says of them.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use tapjoint::pipeline::{FunctionSettings, run_functions};
use tapjoint::recording::{FrequencyResponse, FrequencyResponses, ResponseForm};

use super::{Answer, Noise, found, log_uniform};

/// Answers of some functions, and the modes that nothing drawn stands for.
#[derive(Debug, Default)]
pub struct FunctionAnswers {
    pub answers: Vec<Answer>,
    /// Number of listed modes without a drawn mode within a line and half of its half-power width. A second mode listed
    /// for one drawn mode counts too.
    pub invented: usize,
}

/// A drawn mode.
struct Mode {
    frequency: f64,
    damping_ratio: f64,
    /// Height of its peak in each function.
    heights: Vec<f64>,
    /// False for a mode beyond the lines.
    counts: bool,
}

/// A drawn set of functions.
struct Case {
    modes: Vec<Mode>,
    form: ResponseForm,
    first: f64,
    spacing: f64,
    lines: usize,
    /// Height of the noise below the highest line of each function (dB).
    level: f64,
}

impl Case {
    /// Draws 3 to 8 modes with damping from 0.05 to 5 % and 1 to 6 functions, and a mode beyond each end of the lines.
    fn draw(random: &mut ChaCha8Rng) -> Self {
        let responses = random.random_range(1..=6);
        let lines = [400, 800, 1600, 3200][random.random_range(0..4)];
        let spacing = log_uniform(random, 0.05, 2.0);
        let first = if random.random_bool(0.5) {
            0.0
        } else {
            spacing * random.random_range(0.02..0.1) * lines as f64
        };
        let last = first + spacing * (lines - 1) as f64;
        let count = random.random_range(3..=8);
        let mut frequency = first + spacing * random.random_range(0.06..0.15) * lines as f64;
        let mut modes = Vec::new();
        let mode = |frequency: f64, counts: bool, random: &mut ChaCha8Rng| Mode {
            frequency,
            damping_ratio: log_uniform(random, 5e-4, 0.05),
            heights: (0..responses)
                .map(|_| {
                    let normal: f64 = StandardNormal.sample(random);
                    let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
                    sign * (0.7 * normal).exp()
                })
                .collect(),
            counts,
        };
        modes.push(mode(0.6 * frequency, 0.6 * frequency > first, random));
        while modes.len() <= count && frequency < last - 0.05 * (last - first) {
            modes.push(mode(frequency, true, random));
            frequency *= random.random_range(1.08..1.6);
        }
        modes.push(mode(1.2 * last, false, random));
        Case {
            modes,
            form: [ResponseForm::Accelerance, ResponseForm::Mobility][random.random_range(0..2)],
            first,
            spacing,
            lines,
            level: random.random_range(40.0..60.0),
        }
    }

    /// Value of a mode of height 1 on a line: (j omega)^k/(omega_0^2 - omega^2 + 2 j zeta omega_0 omega) over its size at
    /// omega_0.
    fn value(&self, mode: &Mode, frequency: f64) -> Complex64 {
        let (own, at) = (TAU * mode.frequency, TAU * frequency);
        let order = match self.form {
            ResponseForm::Receptance => 0,
            ResponseForm::Mobility => 1,
            ResponseForm::Accelerance => 2,
        };
        let size = own.powi(order) / (2.0 * mode.damping_ratio * own * own);
        let denominator = Complex64::new(own * own - at * at, 2.0 * mode.damping_ratio * own * at);
        Complex64::new(0.0, at).powi(order) / denominator / size
    }

    fn functions(&self, random: &mut ChaCha8Rng) -> FrequencyResponses {
        let count = self.modes.first().map_or(0, |mode| mode.heights.len());
        let responses = (0..count).map(|response| {
            let mut values: Vec<Complex64> = (0..self.lines)
                .map(|line| {
                    let frequency = self.first + line as f64 * self.spacing;
                    let modes = self.modes.iter();
                    modes
                        .map(|mode| self.value(mode, frequency) * mode.heights[response])
                        .sum()
                })
                .collect();
            let highest = values
                .iter()
                .fold(0.0, |most: f64, value| most.max(value.norm()));
            // The level is that of the noise's root mean square, both parts together.
            let part = highest * 10f64.powf(-self.level / 20.0) / 2f64.sqrt();
            for value in &mut values {
                let [re, im]: [f64; 2] = [(); 2].map(|()| StandardNormal.sample(random));
                *value += Complex64::new(re, im) * part;
            }
            FrequencyResponse {
                name: format!("H{}", response + 1),
                form: Some(self.form),
                values,
                ..FrequencyResponse::default()
            }
        });
        FrequencyResponses {
            file: "functions".to_string(),
            first_frequency: self.first,
            spacing: self.spacing,
            lines: self.lines,
            has_phase: true,
            responses: responses.collect(),
            warnings: Vec::new(),
        }
    }

    fn answers(&self, case: usize, random: &mut ChaCha8Rng) -> FunctionAnswers {
        let functions = self.functions(random);
        let analysis = run_functions(&functions, &FunctionSettings::default());
        let modes = analysis.map_or(Vec::new(), |analysis| analysis.modes);
        let listed = modes.into_iter().filter(|mode| mode.mode.is_some());
        let readings: Vec<_> = listed.filter_map(|mode| mode.reading).collect();
        let mut free: Vec<Option<_>> = readings.iter().map(Some).collect();
        let mut all = FunctionAnswers::default();
        for mode in &self.modes {
            let reach = self.spacing + mode.damping_ratio * mode.frequency;
            let near = free.iter().enumerate().filter_map(|(place, reading)| {
                let distance = (reading.as_ref()?.frequency - mode.frequency).abs();
                (distance <= reach).then_some((place, distance))
            });
            let nearest = near.min_by(|a, b| a.1.total_cmp(&b.1));
            let own = nearest.and_then(|(place, _)| free[place].take());
            if !mode.counts {
                continue;
            }
            all.answers.push(Answer {
                case,
                noise: Noise::White,
                about: format!(
                    "{} modes, {} functions of {} lines, {:.0} dB",
                    self.modes.len(),
                    functions.responses.len(),
                    self.lines,
                    self.level
                ),
                truth: (mode.frequency, mode.frequency),
                damping_ratio: mode.damping_ratio,
                bound: None,
                shared: false,
                found: own.map(found),
            });
        }
        all.invented = free.into_iter().flatten().count();
        all
    }
}

/// Draws functions until they have `modes` modes, and analyses them.
pub fn run(modes: usize, seed: u64) -> FunctionAnswers {
    let mut all = FunctionAnswers::default();
    let mut first = 0;
    while all.answers.len() < modes {
        let rest = modes - all.answers.len();
        let batch: Vec<FunctionAnswers> = (first..first + rest.div_ceil(5).max(8))
            .into_par_iter()
            .map(|index| {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                random.set_stream((1 << 40) + index as u64);
                Case::draw(&mut random).answers(index, &mut random)
            })
            .collect();
        first += batch.len();
        for one in batch {
            all.answers.extend(one.answers);
            all.invented += one.invented;
        }
    }
    all
}
