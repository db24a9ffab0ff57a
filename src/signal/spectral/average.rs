//! Averages over taps: power spectra, cross spectra and H1; estimators of a frequency response function from them, and
//! its accuracy.
//!
//! All estimators take the averaged spectra of one force and one response on one line: Gff = mean |F|^2,
//! Gxx = mean |X|^2 and Gfx = mean conj(F) X, in the convention e^{+j omega t}.

use num_complex::Complex64;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::Lines;
use super::transform::{Transformer, Workspace};

/// Sums of spectra over taps, one tap at a time, so that only one record is in memory.
#[derive(Debug, Clone)]
pub struct SpectralAverager {
    lines: Lines,
    taps: usize,
    force_power: Vec<f64>,
    cross: Vec<Vec<Complex64>>,
    response_power: Vec<Vec<f64>>,
}

/// Averages over taps, on one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AveragedSpectra {
    /// The axis.
    pub lines: Lines,
    /// Number of taps averaged.
    pub taps: usize,
    /// Root mean square of the force's transforms (N s); `None` without a hammer.
    pub force: Option<Vec<f64>>,
    /// Root mean square of each response's transforms (unit of the response times s).
    pub responses: Vec<Vec<f64>>,
    /// Gff = mean |F|^2 (N2 s2); `None` without a hammer.
    pub force_power: Option<Vec<f64>>,
    /// Gxx = mean |X|^2 of each response (its unit squared times s2).
    pub response_power: Vec<Vec<f64>>,
    /// Gfx = mean conj(F) X of each response (N times its unit times s2), in the convention
    /// e^{+j omega t}; `None` without a hammer.
    pub cross: Option<Vec<Vec<Complex64>>>,
    /// H1 = Gfx/Gff of each response (unit of the response per N), 0 where the force has no power at
    /// all; `None` without a hammer.
    pub h1: Option<Vec<Vec<Complex64>>>,
}

impl SpectralAverager {
    /// Begins averages for so many responses.
    pub fn new(lines: Lines, responses: usize) -> Self {
        let points = lines.points();
        SpectralAverager {
            lines,
            taps: 0,
            force_power: vec![0.0; points],
            cross: vec![Vec::new(); responses],
            response_power: vec![vec![0.0; points]; responses],
        }
    }

    /// Number of taps so far.
    pub fn taps(&self) -> usize {
        self.taps
    }

    /// Number of responses.
    pub fn responses(&self) -> usize {
        self.response_power.len()
    }

    /// H1 = Gfx/Gff of a response on a line so far (unit of the response per N); 0 where the force has no power.
    pub fn h1(&self, response: usize, line: usize) -> Complex64 {
        let cross = self.cross.get(response).and_then(|cross| cross.get(line));
        match (cross, self.force_power.get(line)) {
            (Some(cross), Some(&power)) if power > 0.0 => cross / power,
            _ => Complex64::ZERO,
        }
    }

    /// Adds one tap: the force's transform (if there is a hammer) and each response's.
    pub fn add(&mut self, force: Option<&[Complex64]>, responses: &[impl AsRef<[Complex64]>]) {
        self.taps += 1;
        let Some(force) = force else {
            for (power, response) in self.response_power.iter_mut().zip(responses) {
                add_power(power, response.as_ref());
            }
            return;
        };
        add_power(&mut self.force_power, force);
        let powers = self.response_power.iter_mut();
        for ((power, cross), response) in powers.zip(&mut self.cross).zip(responses) {
            // Nothing was in memory for it before the first force.
            cross.resize(force.len(), Complex64::ZERO);
            let values = force.iter().zip(response.as_ref());
            // Both sums at once: each value is read once.
            for ((power, cross), (f, x)) in power.iter_mut().zip(cross).zip(values) {
                *power += x.norm_sqr();
                *cross += f.conj() * x;
            }
        }
    }

    /// Adds what another averager of the same lines and responses has summed.
    pub fn merge(&mut self, other: &SpectralAverager) {
        self.taps += other.taps;
        add_all(&mut self.force_power, &other.force_power);
        for (sum, values) in self.response_power.iter_mut().zip(&other.response_power) {
            add_all(sum, values);
        }
        for (sum, values) in self.cross.iter_mut().zip(&other.cross) {
            sum.resize(values.len().max(sum.len()), Complex64::ZERO);
            add_all(sum, values);
        }
    }

    /// The averages of the responses so far, as if there were no hammer.
    pub fn responses_so_far(&self) -> AveragedSpectra {
        let share = 1.0 / self.taps.max(1) as f64;
        let powers = self.response_power.iter();
        let response_power: Vec<Vec<f64>> = powers
            .map(|powers| powers.iter().map(|power| share * power).collect())
            .collect();
        AveragedSpectra {
            taps: self.taps,
            responses: response_power.iter().map(|g| roots(g)).collect(),
            response_power,
            ..AveragedSpectra::empty(self.lines)
        }
    }

    /// The averages; `None` before the first tap.
    pub fn finish(mut self) -> Option<AveragedSpectra> {
        if self.taps == 0 {
            return None;
        }
        let share = 1.0 / self.taps as f64;
        let powers = self
            .response_power
            .iter_mut()
            .chain([&mut self.force_power]);
        powers.flatten().for_each(|power| *power *= share);
        self.cross.iter_mut().flatten().for_each(|x| *x *= share);
        let has_force = self.force_power.iter().any(|&power| power > 0.0);
        let points = self.force_power.len();
        let h1 = (0..self.responses()).map(|response| {
            let values = (0..points).map(|line| self.h1(response, line));
            values.collect()
        });
        let h1 = has_force.then(|| h1.collect());
        Some(AveragedSpectra {
            lines: self.lines,
            taps: self.taps,
            force: has_force.then(|| roots(&self.force_power)),
            responses: self.response_power.iter().map(|g| roots(g)).collect(),
            h1,
            response_power: self.response_power,
            cross: has_force.then_some(self.cross),
            force_power: has_force.then_some(self.force_power),
        })
    }
}

fn add_power(sums: &mut [f64], values: &[Complex64]) {
    for (sum, x) in sums.iter_mut().zip(values) {
        *sum += x.norm_sqr();
    }
}

fn add_all<T: std::ops::AddAssign + Copy>(sums: &mut [T], values: &[T]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += *value;
    }
}

fn roots(powers: &[f64]) -> Vec<f64> {
    powers.iter().map(|power| power.sqrt()).collect()
}

impl AveragedSpectra {
    /// Averages over nothing, on an axis.
    pub fn empty(lines: Lines) -> Self {
        AveragedSpectra {
            lines,
            taps: 0,
            force: None,
            responses: Vec::new(),
            force_power: None,
            response_power: Vec::new(),
            cross: None,
            h1: None,
        }
    }
}

/// One tap's windowed samples: the force, where there is a hammer, and every response.
#[derive(Debug, Clone, PartialEq)]
pub struct TapRecord<'a> {
    /// Force (N).
    pub force: Option<&'a [f64]>,
    /// Responses, each in its unit.
    pub responses: Vec<&'a [f64]>,
}

/// Fewest records that one thread takes at a time.
const LEAST_SHARE: usize = 8;
/// Most partial sums that are in memory at a time.
const MOST_SHARES: usize = 64;

/// Averages over records that are all in memory, in parallel; `None` without records.
///
/// The records are shared out by their number alone and the partial sums are added in order, so that
/// the result is the same to the last bit whatever the number of threads.
pub fn average_records(
    transformer: &Transformer,
    records: &[TapRecord<'_>],
) -> Option<AveragedSpectra> {
    let responses = records.first()?.responses.len();
    let share = records.len().div_ceil(MOST_SHARES).max(LEAST_SHARE);
    let parts: Vec<SpectralAverager> = records
        .par_chunks(share)
        .map(|records| {
            let mut sum = SpectralAverager::new(transformer.lines, responses);
            let mut workspace = Workspace::default();
            let mut of_force = Vec::new();
            let mut of_responses = vec![Vec::new(); responses];
            for record in records {
                for (samples, values) in record.responses.iter().zip(&mut of_responses) {
                    transformer.transform_into(samples, &mut workspace, values);
                }
                let force = record.force.map(|samples| {
                    transformer.transform_into(samples, &mut workspace, &mut of_force);
                    of_force.as_slice()
                });
                sum.add(force, &of_responses);
            }
            sum
        })
        .collect();
    let mut sum = SpectralAverager::new(transformer.lines, responses);
    parts.iter().for_each(|part| sum.merge(part));
    sum.finish()
}

/// Estimator of a frequency response function, by the noise that it assumes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FrfEstimator {
    /// Gfx/Gff: right where noise is on the response alone; of noise on the force it reads low. The
    /// default: the force window leaves little noise on a hammer's force.
    #[default]
    H1,
    /// Gxx/Gxf: right where noise is on the force alone; of noise on the response it reads high.
    H2,
    /// Total least squares: the same noise power on both, each in its unit.
    Hv,
}

impl FrfEstimator {
    /// All estimators.
    pub const ALL: [FrfEstimator; 3] = [FrfEstimator::H1, FrfEstimator::H2, FrfEstimator::Hv];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            FrfEstimator::H1 => "H1",
            FrfEstimator::H2 => "H2",
            FrfEstimator::Hv => "Hv",
        }
    }
}

/// Averaged spectra of force and response on one line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinePowers {
    /// Gff, mean |F|^2 (N2 s2).
    pub force: f64,
    /// Gxx, mean |X|^2 (square of the response's unit times s2).
    pub response: f64,
    /// Gfx, mean conj(F) X (N times the response's unit times s2).
    pub cross: Complex64,
}

impl LinePowers {
    /// Response per force (unit of the response per N); `None` where the estimator divides by
    /// nothing.
    pub fn frf(&self, estimator: FrfEstimator) -> Option<Complex64> {
        let value = match estimator {
            // H1 = Gfx/Gff.
            FrfEstimator::H1 => self.cross / self.force,
            // H2 = Gxx/Gxf, Gxf = conj(Gfx).
            FrfEstimator::H2 => self.response / self.cross.conj(),
            // Hv = (Gxx - Gff + sqrt((Gff - Gxx)^2 + 4 |Gfx|^2)) / (2 Gxf): Shin & Hammond, "Fundamentals of
            // Signal Processing for Sound and Vibration Engineers", page 293, with equal noise powers, as in
            // pyFRF 1.5.0 (`get_Hv`). (1, Hv) is the eigenvector of [[Gff, Gfx], [Gxf, Gxx]] transposed that
            // belongs to its largest eigenvalue. |H1| <= |Hv| <= |H2|. Equal powers of N and m/s2 are a
            // matter of units: where |H| is much above 1 Hv goes towards H2, much below towards H1.
            FrfEstimator::Hv => {
                let difference = self.force - self.response;
                let root = difference.hypot(2.0 * self.cross.norm());
                if difference > 0.0 {
                    // The same number without the difference of two nearly equal ones:
                    // (root - difference)(root + difference) = 4 |Gfx|^2.
                    2.0 * self.cross / (root + difference)
                } else {
                    (root - difference) / (2.0 * self.cross.conj())
                }
            }
        };
        value.is_finite().then_some(value)
    }

    /// Coherence g2 = |Gfx|^2/(Gff Gxx), the share of the response's power that follows the force.
    ///
    /// One average always gives 1, whatever the noise, so that there is none below two; from few
    /// averages it reads high (of pure noise 1/averages on the mean). `None` also without power.
    pub fn coherence(&self, averages: usize) -> Option<f64> {
        let power = self.force * self.response;
        let value = self.cross.norm_sqr() / power;
        // Rounding alone can take a perfect one above 1.
        (averages >= 2 && value.is_finite()).then_some(value.min(1.0))
    }
}

/// Relative random error (standard deviation) of an FRF's magnitude, sqrt((1 - g2)/(2 n g2)) (Bendat &
/// Piersol, "Random Data", 9.3); `None` without coherence.
pub fn random_error(coherence: f64, averages: usize) -> Option<f64> {
    let error = ((1.0 - coherence) / (2.0 * averages as f64 * coherence)).sqrt();
    (averages >= 2 && error.is_finite()).then_some(error)
}

/// Quality of a frequency response function on a line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct LineQuality {
    /// Coherence; null below two averages and without a hammer.
    pub coherence: Option<f64>,
    /// Relative random error (standard deviation) of the magnitude; null without coherence.
    pub random_error: Option<f64>,
}

impl AveragedSpectra {
    /// Averaged spectra of the force and one response on a line; `None` without a hammer, and for a
    /// response or a line that does not exist.
    pub fn powers(&self, response: usize, line: usize) -> Option<LinePowers> {
        Some(LinePowers {
            force: *self.force_power.as_ref()?.get(line)?,
            response: *self.response_power.get(response)?.get(line)?,
            cross: *self.cross.as_ref()?.get(response)?.get(line)?,
        })
    }

    /// Frequency response function of one response (its unit per N), `None` on lines where it does not
    /// exist; `None` without a hammer. Of functions that an analyser has averaged only its own estimate is there,
    /// taken as H1.
    pub fn frf(&self, response: usize, estimator: FrfEstimator) -> Option<Vec<Option<Complex64>>> {
        if self.powers(response, 0).is_none() {
            let stated = self.h1.as_ref().filter(|_| estimator == FrfEstimator::H1);
            return Some(stated?.get(response)?.iter().copied().map(Some).collect());
        }
        let lines = 0..self.lines.points();
        let values = lines.map(|line| self.powers(response, line)?.frf(estimator));
        Some(values.collect())
    }

    /// Coherence of one response with the force on each line; `None` below two averages and without a
    /// hammer.
    pub fn coherence(&self, response: usize) -> Option<Vec<Option<f64>>> {
        self.powers(response, 0).filter(|_| self.taps >= 2)?;
        let lines = 0..self.lines.points();
        let values = lines.map(|line| self.powers(response, line)?.coherence(self.taps));
        Some(values.collect())
    }

    /// Coherence and random error of one response on the line nearest to `frequency` (Hz).
    pub fn quality(&self, response: usize, frequency: f64) -> LineQuality {
        let powers = self.powers(response, self.lines.nearest(frequency));
        let coherence = powers.and_then(|powers| powers.coherence(self.taps));
        LineQuality {
            coherence,
            random_error: coherence.and_then(|g2| random_error(g2, self.taps)),
        }
    }

    /// Quality of the response with the highest coherence: a sensor on a node tells nothing of a mode.
    pub fn best_quality(&self, frequency: f64) -> LineQuality {
        (0..self.response_power.len())
            .map(|response| self.quality(response, frequency))
            .max_by(|a, b| {
                let [a, b] = [a, b].map(|quality| quality.coherence.unwrap_or(-1.0));
                a.total_cmp(&b)
            })
            .unwrap_or_default()
    }
}
