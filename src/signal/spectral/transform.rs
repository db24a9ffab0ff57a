//! The Fourier transform of tap records on given lines: a real FFT where they are lines of one; else an analyser's zoom
//! (mix, low-pass, decimate) and a chirp z-transform (Bluestein) on lines of any start and spacing.

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::sync::Arc;

use num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};
use tapjoint_numerics::bessel_i0;

use super::{DISPLAY_RATIO, Lines, smallest_smooth_block};

/// The Fourier transform X(f) = (1/rate) sum x(n) e^{-j 2 pi f n/rate} of windowed records (unit of
/// the samples times s) on given lines; time zero is a record's first sample.
///
/// Lines of a real FFT, as those of the full band, come from one. Into another band
/// a record is mixed down, low-pass filtered, decimated and transformed on the band's own lines, as an analyser does.
/// Everything that does not depend on the samples is computed once, here.
#[derive(Debug)]
pub struct Transformer {
    /// The lines on which it transforms.
    pub(super) lines: Lines,
    sample_rate: f64,
    plan: Plan,
}

enum Plan {
    /// A real FFT of n samples, where the lines are its own. On its lines samples n apart turn by the same angle, so a longer
    /// record is wrapped: they are added.
    Real {
        fft: Arc<dyn RealToComplex<f64>>,
        /// Number of the first line.
        first: usize,
    },
    /// Lines anywhere, without decimation.
    Lines(Chirp),
    /// A zoom band.
    Zoom {
        decimator: Decimator,
        chirp: Chirp,
        /// On each line: what undoes the filter's delay, times the decimation.
        turns: Vec<Complex64>,
    },
}

/// Room that one transform after the other may use.
#[derive(Debug, Default)]
pub struct Workspace {
    samples: Vec<f64>,
    scratch: Vec<Complex64>,
}

impl Transformer {
    /// Plans the transform of records of at most `length` samples at `sample_rate` (Hz) on `lines`.
    pub fn new(sample_rate: f64, lines: Lines, length: usize) -> Self {
        // Numbers of samples and of lines before the first; both are whole where the lines are those of an FFT. 1e-9 is far
        // above their rounding, and moves a line by no more than that part of its frequency.
        let samples = sample_rate / lines.spacing;
        let before = lines.low / lines.spacing;
        let are_whole = (samples - samples.round()).abs() < 1e-9 * samples
            && (before - before.round()).abs() < 1e-9 * samples;
        let (samples, before) = (samples.round() as usize, before.round() as usize);
        let plan = if are_whole {
            Plan::Real {
                fft: RealFftPlanner::new().plan_fft_forward(samples),
                first: before,
            }
        } else {
            Plan::zoomed(sample_rate, lines, length.max(1))
        };
        Transformer {
            lines,
            sample_rate,
            plan,
        }
    }

    /// The transform of a record; of one longer than planned the rest is left out.
    pub fn transform(&self, samples: &[f64]) -> Vec<Complex64> {
        let mut values = Vec::new();
        self.transform_into(samples, &mut Workspace::default(), &mut values);
        values
    }

    /// [`transform`](Self::transform) into `values`, whose room is used again.
    pub fn transform_into(
        &self,
        samples: &[f64],
        workspace: &mut Workspace,
        values: &mut Vec<Complex64>,
    ) {
        let Workspace {
            samples: copy,
            scratch,
        } = workspace;
        let scale = 1.0 / self.sample_rate;
        copy.clear();
        copy.extend(samples.iter().map(|x| scale * x));
        self.transform_scaled(copy, scratch, values);
    }

    /// [`transform`](Self::transform) of samples that are not needed any more; what they hold afterwards means nothing.
    pub fn transform_in_place(
        &self,
        samples: &mut Vec<f64>,
        scratch: &mut Vec<Complex64>,
        values: &mut Vec<Complex64>,
    ) {
        let scale = 1.0 / self.sample_rate;
        samples.iter_mut().for_each(|x| *x *= scale);
        self.transform_scaled(samples, scratch, values);
    }

    /// The transform of samples over the sample rate.
    fn transform_scaled(
        &self,
        samples: &mut Vec<f64>,
        scratch: &mut Vec<Complex64>,
        values: &mut Vec<Complex64>,
    ) {
        match &self.plan {
            Plan::Real { fft, first } => {
                // A shorter record is padded with zeros.
                let length = fft.len().min(samples.len());
                let (kept, wrapped) = samples.split_at_mut(length);
                for part in wrapped.chunks(fft.len()) {
                    kept.iter_mut().zip(part).for_each(|(sum, x)| *sum += x);
                }
                samples.resize(fft.len(), 0.0);
                values.resize(fft.complex_len(), Complex64::ZERO);
                scratch.resize(fft.get_scratch_len(), Complex64::ZERO);
                // It refuses buffers of a wrong length alone, and these have just been given theirs.
                let done = fft.process_with_scratch(samples, values, scratch);
                debug_assert!(done.is_ok(), "{done:?}");
                values.drain(..first);
                values.truncate(self.lines.points());
            }
            Plan::Lines(chirp) => {
                values.clear();
                values.extend(chirp.transform(samples.iter().map(|&x| x.into())));
            }
            Plan::Zoom {
                decimator,
                chirp,
                turns,
            } => {
                let transformed = chirp.transform(decimator.run(samples).into_iter());
                values.clear();
                values.extend(transformed.iter().zip(turns).map(|(x, t)| x * t));
            }
        }
    }
}

impl Plan {
    fn zoomed(sample_rate: f64, lines: Lines, length: usize) -> Plan {
        let width = lines.high - lines.low;
        let centre = 0.5 * (lines.low + lines.high);
        let factor = decimation_factor(sample_rate, width);
        let points = lines.points();
        if factor < 2 {
            let step = lines.spacing / sample_rate;
            return Plan::Lines(Chirp::new(length, lines.low / sample_rate, step, points));
        }
        let decimator = Decimator::new(sample_rate, centre, width, factor, length);
        let rate = sample_rate / factor as f64;
        let start = (lines.low - centre) / rate;
        let outputs = decimator.outputs(length);
        let mut turns = Vec::with_capacity(points);
        for index in 0..points {
            // The first decimated sample lies `delay` samples before the record's start.
            let offset = lines.frequency(index) - centre;
            let angle = TAU * offset * decimator.delay() as f64 / sample_rate;
            turns.push(Complex64::from_polar(factor as f64, angle));
        }
        Plan::Zoom {
            chirp: Chirp::new(outputs, start, lines.spacing / rate, points),
            turns,
            decimator,
        }
    }
}

impl fmt::Debug for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Plan::Real { fft, first } => write!(f, "Real({}, {first})", fft.len()),
            Plan::Lines(chirp) => f.debug_tuple("Lines").field(chirp).finish(),
            Plan::Zoom { chirp, .. } => f.debug_tuple("Zoom").field(chirp).finish(),
        }
    }
}

/// One record's transform on `lines`, planned for it alone: see [`Transformer`], which saves the
/// planning where there are several records.
pub fn transform_block(samples: &[f64], sample_rate: f64, lines: &Lines) -> Vec<Complex64> {
    Transformer::new(sample_rate, *lines, samples.len()).transform(samples)
}

/// Stop-band attenuation of the zoom's low-pass filter (dB): below the 24-bit noise of good
/// recorders once the decimated lines add up.
const STOP_BAND_DB: f64 = 100.0;

/// Kaiser's relation between attenuation (dB) and the shape parameter beta, above 50 dB
/// (Oppenheim & Schafer).
pub(crate) fn kaiser_beta(attenuation: f64) -> f64 {
    0.1102 * (attenuation - 8.7)
}

/// By how much a band of this width (Hz) can be decimated: to the next whole divisor above the complex
/// rate of 1.28 widths that an analyser would use. Large ones are multiples of four, which two stages can share.
fn decimation_factor(sample_rate: f64, width: f64) -> usize {
    let most = (sample_rate / (DISPLAY_RATIO / 2.0 * width)).floor() as usize;
    if most < 16 { most } else { most / 4 * 4 }
}

/// Mixing, filtering and decimating as an analyser's zoom does it: what every record shares. Output m
/// is at time (m * factor - delay)/sample_rate from the record's start.
#[derive(Debug)]
pub(crate) struct Decimator {
    /// e^{-j 2 pi centre t} at every sample.
    oscillator: Vec<Complex64>,
    stages: Vec<Stage>,
}

/// A symmetric low-pass filter, of whose outputs one in `factor` is kept.
#[derive(Debug)]
struct Stage {
    filter: Vec<f64>,
    factor: usize,
}

impl Stage {
    /// Passes `width` (Hz) about 0 Hz. What it does not stop lies outside this width after decimation, too.
    fn new(sample_rate: f64, width: f64, factor: usize) -> Self {
        let pass = width / 2.0;
        Stage {
            filter: low_pass(pass, sample_rate / factor as f64 - pass, sample_rate),
            factor,
        }
    }

    /// Samples by which the first output lies before the first sample.
    fn delay(&self) -> usize {
        self.filter.len() / 2
    }

    fn outputs(&self, length: usize) -> usize {
        (length + 2 * self.delay()).div_ceil(self.factor)
    }

    fn run(&self, samples: &[Complex64]) -> Vec<Complex64> {
        let outputs = 0..self.outputs(samples.len());
        let outputs = outputs.map(|m| {
            let centre_index = (m * self.factor) as i64 - self.delay() as i64;
            filtered(samples, &self.filter, centre_index)
        });
        outputs.collect()
    }
}

/// Returns the stages that decimate by `factor` with the fewest multiplications: one, or a short filter whose wide transition
/// leaves the narrow one to a second filter at a lower rate (Crochiere & Rabiner 1975).
fn cheapest_stages(sample_rate: f64, width: f64, factor: usize) -> Vec<Stage> {
    // Multiplications for each sample that comes in.
    let cost = |rate: f64, factor: usize| {
        let stop = rate / factor as f64 - width / 2.0;
        half_length(width / 2.0, stop, rate) / factor as f64
    };
    let mut least = cost(sample_rate, factor);
    let mut best = vec![(sample_rate, factor)];
    for first in (2..factor).filter(|first| factor.is_multiple_of(*first)) {
        let rate = sample_rate / first as f64;
        let both = cost(sample_rate, first) + cost(rate, factor / first) / first as f64;
        if both < least {
            least = both;
            best = vec![(sample_rate, first), (rate, factor / first)];
        }
    }
    let stages = best.into_iter();
    stages
        .map(|(rate, factor)| Stage::new(rate, width, factor))
        .collect()
}

impl Decimator {
    /// Mixes records of at most `length` samples down by `centre` (Hz) and decimates by `factor`, so
    /// that `width` (Hz) around it survives.
    pub(crate) fn new(
        sample_rate: f64,
        centre: f64,
        width: f64,
        factor: usize,
        length: usize,
    ) -> Self {
        Decimator {
            oscillator: (0..length)
                .map(|n| Complex64::from_polar(1.0, phase(centre / sample_rate, n as f64)))
                .collect(),
            stages: cheapest_stages(sample_rate, width, factor),
        }
    }

    /// Samples from one output to the next.
    fn factor(&self) -> usize {
        self.stages.iter().map(|stage| stage.factor).product()
    }

    /// Samples by which the first output lies before the record's start.
    pub(crate) fn delay(&self) -> usize {
        // A stage counts in outputs of those before it.
        let stages = self.stages.iter().rev();
        stages.fold(0, |delay, stage| delay * stage.factor + stage.delay())
    }

    /// Outputs of a record of `length` samples.
    fn outputs(&self, length: usize) -> usize {
        let stages = self.stages.iter();
        stages.fold(length, |length, stage| stage.outputs(length))
    }

    /// The record decimated.
    ///
    /// It is taken as zero outside its ends and the filter's tails are kept, so that the result has
    /// exactly the spectrum of the record times the filter's pass band.
    pub(crate) fn run(&self, samples: &[f64]) -> Vec<Complex64> {
        let mixed = samples
            .iter()
            .zip(&self.oscillator)
            .map(|(&x, turn)| turn * x)
            .collect();
        let stages = self.stages.iter();
        stages.fold(mixed, |signal: Vec<Complex64>, stage| stage.run(&signal))
    }
}

/// Returns half of Kaiser's length (A - 7.95)/(2.285 transition) of a low-pass filter (samples).
fn half_length(pass: f64, stop: f64, sample_rate: f64) -> f64 {
    let transition = TAU * (stop - pass) / sample_rate;
    ((STOP_BAND_DB - 7.95) / (2.285 * transition) / 2.0).ceil()
}

/// A low-pass filter with Kaiser's window, which passes up to `pass` and stops from `stop` (Hz) on: of odd length,
/// symmetric, unity at 0 Hz.
pub(super) fn low_pass(pass: f64, stop: f64, sample_rate: f64) -> Vec<f64> {
    let half = half_length(pass, stop, sample_rate) as i64;
    let cut_off = PI * (pass + stop) / sample_rate;
    let beta = kaiser_beta(STOP_BAND_DB);
    let mut filter: Vec<f64> = (-half..=half)
        .map(|n| {
            let sinc = if n == 0 {
                cut_off / PI
            } else {
                (cut_off * n as f64).sin() / (PI * n as f64)
            };
            let edge = n as f64 / (half as f64 + 1.0);
            sinc * bessel_i0(beta * (1.0 - edge * edge).sqrt()) / bessel_i0(beta)
        })
        .collect();
    let sum: f64 = filter.iter().sum();
    filter.iter_mut().for_each(|tap| *tap /= sum);
    filter
}

/// Takes a band out of records: mixed down, filtered and decimated.
#[derive(Debug)]
pub struct BandLimiter {
    /// `None` where the band is most of what there is.
    decimator: Option<Decimator>,
}

impl BandLimiter {
    /// For the band (Hz) of records of at most `length` samples.
    pub fn new(sample_rate: f64, band: (f64, f64), length: usize) -> Self {
        let (low, high) = band;
        let (centre, width) = (0.5 * (low + high), high - low);
        let factor = decimation_factor(sample_rate, width);
        BandLimiter {
            decimator: (factor >= 3)
                .then(|| Decimator::new(sample_rate, centre, width, factor, length)),
        }
    }

    /// Magnitude over time of what the samples have in the band, the filter's tails cut off; the samples themselves where
    /// the band is most of what there is.
    pub fn magnitude(&self, samples: &[f64]) -> Vec<f64> {
        let Some(decimator) = &self.decimator else {
            return samples.to_vec();
        };
        let factor = decimator.factor();
        let (skip, keep) = (decimator.delay() / factor, samples.len() / factor);
        let decimated = decimator.run(samples).into_iter().skip(skip).take(keep);
        // A real oscillation of amplitude a leaves a magnitude of a/2.
        decimated.map(|z| 2.0 * z.norm()).collect()
    }
}

/// One output of the symmetric filter, centred on `index`.
fn filtered(mixed: &[Complex64], filter: &[f64], index: i64) -> Complex64 {
    let half = (filter.len() / 2) as i64;
    let first = (index - half).max(0);
    let last = (index + half).min(mixed.len() as i64 - 1);
    if last < first {
        return Complex64::ZERO;
    }
    let samples = &mixed[first as usize..=last as usize];
    let weights = &filter[(first - index + half) as usize..];
    // Four sums side by side: one would wait for each addition before the next.
    let mut sums = [Complex64::ZERO; 4];
    let mut quarters = samples.chunks_exact(4).zip(weights.chunks_exact(4));
    for (samples, weights) in &mut quarters {
        for ((sum, x), weight) in sums.iter_mut().zip(samples).zip(weights) {
            *sum += x * weight;
        }
    }
    let done = samples.len() / 4 * 4;
    let rest = samples[done..].iter().zip(&weights[done..]);
    sums.iter().sum::<Complex64>() + rest.map(|(x, weight)| x * weight).sum::<Complex64>()
}

/// Tables of a chirp z-transform that all records share.
///
/// Line k is the sum over n of x(n) e^{-j 2 pi n (start + k step)}.
struct Chirp {
    /// e^{-j 2 pi start n} times half the chirp, for each sample.
    before: Vec<Complex64>,
    /// Transform of the conjugate chirp.
    kernel: Vec<Complex64>,
    /// Half the chirp over the length of the transforms, for each line.
    after: Vec<Complex64>,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
}

impl Chirp {
    /// For at most `samples` samples and `count` lines; `start` and `step` in cycles per sample.
    fn new(samples: usize, start: f64, step: f64, count: usize) -> Self {
        let length = smallest_smooth_block(samples + count);
        let mut kernel = vec![Complex64::ZERO; length];
        for (k, value) in kernel.iter_mut().take(count).enumerate() {
            *value = half_chirp(step, k).conj();
        }
        for i in 1..samples {
            kernel[length - i] = half_chirp(step, i).conj();
        }
        let mut planner = FftPlanner::new();
        let forward = planner.plan_fft_forward(length);
        forward.process(&mut kernel);
        let scale = 1.0 / length as f64;
        Chirp {
            before: (0..samples)
                .map(|i| Complex64::from_polar(1.0, phase(start, i as f64)) * half_chirp(step, i))
                .collect(),
            kernel,
            after: (0..count).map(|k| half_chirp(step, k) * scale).collect(),
            forward,
            inverse: planner.plan_fft_inverse(length),
        }
    }

    /// The transform of a record not longer than planned; what is longer is left out.
    fn transform(&self, samples: impl Iterator<Item = Complex64>) -> Vec<Complex64> {
        let mut signal: Vec<Complex64> = samples.zip(&self.before).map(|(x, b)| x * b).collect();
        signal.resize(self.kernel.len(), Complex64::ZERO);
        self.forward.process(&mut signal);
        for (x, k) in signal.iter_mut().zip(&self.kernel) {
            *x *= k;
        }
        self.inverse.process(&mut signal);
        signal.iter().zip(&self.after).map(|(x, a)| x * a).collect()
    }
}

/// Half the chirp, e^{-j pi step k^2}, so that nk = (n^2 + k^2 - (k-n)^2)/2.
fn half_chirp(step: f64, k: usize) -> Complex64 {
    Complex64::from_polar(1.0, phase(step / 2.0, k as f64 * k as f64))
}

impl fmt::Debug for Chirp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Chirp")
            .field("samples", &self.before.len())
            .field("lines", &self.after.len())
            .finish_non_exhaustive()
    }
}

/// Phase -2 pi cycles n, reduced to one turn before it is rounded.
fn phase(cycles: f64, n: f64) -> f64 {
    let product = cycles * n;
    // The rounding error of the product, recovered exactly, keeps long records accurate.
    let error = cycles.mul_add(n, -product);
    -TAU * ((product - product.round()) + error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn prop_chirp_z_is_exact_for_long_records() {
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let normals = (0..40_000).map(|_| StandardNormal.sample(&mut random));
        let samples: Vec<Complex64> = normals.map(|x: f64| x.into()).collect();
        let (start, step) = (0.0123, 1.7e-6);
        let chirp = Chirp::new(samples.len(), start, step, 300);
        let values = chirp.transform(samples.iter().copied());
        for k in (0..300).step_by(50) {
            let cycles = start + k as f64 * step;
            let expected: Complex64 = samples
                .iter()
                .enumerate()
                .map(|(n, x)| x * Complex64::from_polar(1.0, -TAU * (cycles * n as f64).fract()))
                .sum();
            // 200 is the size of the sum of 40,000 unit normals; rounding leaves about 1e-11 of it.
            assert!((values[k] - expected).norm() < 1e-9 * 200.0, "line {k}");
        }
    }
}
