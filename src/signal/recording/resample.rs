//! Samples at slightly uneven times, brought to even ones by band-limited interpolation.
//!
//! A clock that wanders or jitters by up to 2 % of the step still samples a band-limited signal uniquely. The signal is
//! first interpolated at the even times as if the samples between were even. What it then lacks at the true times is
//! interpolated back and added, in a few passes (Marvasti, Nonuniform Sampling, 2001, chapter 4). The effect is not a
//! formula but measured: sines at the band's end, sampled at the same times, go the same way.

use std::f64::consts::{PI, TAU};

use super::error::{RecordingWarning, short};

/// Samples to each side of a point that take part in its interpolation. With the window below, signals up to rate/2.56
/// change by less than -90 dB where the times are even already.
const REACH: usize = 32;

/// Shape of the Kaiser window: side lobes of -90 dB, over a transition that ends at half the rate.
const KAISER: f64 = 9.0;

/// Steps between two entries of the table of the kernel; linear interpolation between them errs by 1e-6.
const TABLE_STEPS: usize = 1024;

/// Passes that add what is missing. Steps of 2 % leave 5 % of a sine at the band's end, so each pass takes some 26 dB.
const PASSES: usize = 4;

/// Most samples on which the effect is measured: those about the step that deviates most.
const MEASURED: usize = 1 << 16;

/// Highest frequency shown of a rate: the analysers' 2.56.
const BAND: f64 = 2.56;

/// Samples at even times, and what that did to them.
#[derive(Debug)]
pub(super) struct Resampled {
    /// Mean rate over the whole recording (Hz).
    pub sample_rate: f64,
    /// The channels.
    pub samples: Vec<Vec<f64>>,
    /// Largest deviation of a step, as a part of the step.
    deviation: f64,
    /// Largest error of a sine at the band's end (dB of its amplitude).
    error_db: f64,
}

impl Resampled {
    /// The doubt that says what was done, and what it did.
    pub(super) fn warning(&self) -> RecordingWarning {
        let message = format!(
            "uneven sampling: steps deviate by up to {:.2} % from {} s, the mean; the samples were resampled to even times by band-limited interpolation, which changes a sine at {:.0} Hz, the band's end, by at most {:.0} dB of its amplitude",
            100.0 * self.deviation,
            short(1.0 / self.sample_rate),
            self.sample_rate / BAND,
            self.error_db
        );
        RecordingWarning::new("resampled", message)
    }
}

/// Resamples channels at ascending `times` (s) to even times from the first to the last. `deviation` is the largest
/// deviation of a step, as a part of it.
pub(super) fn resample(times: &[f64], channels: &[Vec<f64>], deviation: f64) -> Resampled {
    let count = times.len();
    let (first, last) = (times.first().copied().unwrap_or(0.0), times.last().copied());
    let span = (last.unwrap_or(0.0) - first).max(f64::MIN_POSITIVE);
    let sample_rate = (count.max(2) - 1) as f64 / span;
    // Places of the samples on the even grid (steps).
    let places: Vec<f64> = times
        .iter()
        .map(|time| (time - first) * sample_rate)
        .collect();
    let kernel = Kernel::new();
    let grid = Grid::new(&places, &kernel);
    let samples = channels.iter().map(|samples| grid.resample(samples));
    Resampled {
        sample_rate,
        samples: samples.collect(),
        deviation,
        error_db: error_at_band_end(&places, &kernel),
    }
}

/// Returns the largest error of sine and cosine at the band's end (dB of their amplitude), away from the ends.
fn error_at_band_end(places: &[f64], kernel: &Kernel) -> f64 {
    let steps = places
        .windows(2)
        .map(|pair| (pair[1] - pair[0] - 1.0).abs());
    let worst = steps.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    let worst = worst.map_or(0, |(at, _)| at);
    let count = places.len().min(MEASURED);
    let start = worst.saturating_sub(MEASURED / 2).min(places.len() - count);
    let places = &places[start..];
    let origin = places.first().copied().unwrap_or(0.0);
    let last = places[..count].last().copied().unwrap_or(0.0);
    // Part of the grid of its own, so that its points are as many as the samples.
    let stretch = (count.max(2) - 1) as f64 / (last - origin).max(f64::MIN_POSITIVE);
    let places: Vec<f64> = places[..count]
        .iter()
        .map(|at| (at - origin) * stretch)
        .collect();
    let grid = Grid::new(&places, kernel);
    let omega = TAU / BAND;
    let margin = if count > 4 * REACH { REACH } else { 0 };
    let mut largest: f64 = 1e-15;
    for phase in [0.0, 0.5 * PI] {
        let wave = places.iter().map(|at| (omega * at + phase).cos());
        let even = grid.resample(&wave.collect::<Vec<f64>>());
        for (at, value) in even.iter().enumerate().take(count - margin).skip(margin) {
            largest = largest.max((value - (omega * at as f64 + phase).cos()).abs());
        }
    }
    20.0 * largest.log10()
}

/// Places of samples and of grid points, each seen from the other.
struct Grid<'a> {
    kernel: &'a Kernel,
    /// Places of the samples on the grid (steps).
    places: &'a [f64],
    /// Places of the grid points among the samples (their index, between two by their distances).
    inverse: Vec<f64>,
}

impl<'a> Grid<'a> {
    fn new(places: &'a [f64], kernel: &'a Kernel) -> Self {
        let mut after = 1;
        let mut inverse = Vec::with_capacity(places.len());
        for point in 0..places.len() {
            let point = point as f64;
            while after + 1 < places.len() && places[after] < point {
                after += 1;
            }
            let before = after.saturating_sub(1);
            let next = after.min(places.len() - 1);
            let step = places[next] - places[before];
            let part = if step > 0.0 {
                (point - places[before]) / step
            } else {
                0.0
            };
            inverse.push(before as f64 + part);
        }
        Self {
            kernel,
            places,
            inverse,
        }
    }

    /// The samples at the grid points.
    fn resample(&self, samples: &[f64]) -> Vec<f64> {
        // A mean would end at the ends of the recording.
        let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
        let samples: Vec<f64> = samples.iter().map(|sample| sample - mean).collect();
        let mut even = self.kernel.at(&samples, &self.inverse);
        for _ in 0..PASSES {
            let read = self.kernel.at(&even, self.places);
            let missing = samples
                .iter()
                .zip(&read)
                .map(|(sample, read)| sample - read);
            let correction = self
                .kernel
                .at(&missing.collect::<Vec<f64>>(), &self.inverse);
            even.iter_mut()
                .zip(&correction)
                .for_each(|(value, more)| *value += more);
        }
        even.iter_mut().for_each(|value| *value += mean);
        even
    }
}

/// Windowed sinc, tabulated from 0 to [`REACH`].
struct Kernel {
    table: Vec<f64>,
}

impl Kernel {
    fn new() -> Self {
        let reach = REACH as f64;
        let values = (0..=REACH * TABLE_STEPS + 1).map(|at| {
            let x = at as f64 / TABLE_STEPS as f64;
            let sinc = if at == 0 {
                1.0
            } else {
                (PI * x).sin() / (PI * x)
            };
            let inside = (1.0 - (x / reach).powi(2)).max(0.0).sqrt();
            sinc * bessel_i0(KAISER * inside) / bessel_i0(KAISER)
        });
        Self {
            table: values.collect(),
        }
    }

    /// Interpolates even samples at places (their index).
    fn at(&self, samples: &[f64], places: &[f64]) -> Vec<f64> {
        let interpolated = places.iter().map(|place| {
            let first = (place - REACH as f64).ceil().max(0.0) as usize;
            let last = ((place + REACH as f64).floor().max(0.0) as usize + 1).min(samples.len());
            let mut sum = 0.0;
            for (at, sample) in samples.iter().enumerate().take(last).skip(first) {
                let distance = (at as f64 - place).abs() * TABLE_STEPS as f64;
                let entry = (distance as usize).min(self.table.len() - 2);
                let part = distance - entry as f64;
                sum += sample * (self.table[entry] * (1.0 - part) + self.table[entry + 1] * part);
            }
            sum
        });
        interpolated.collect()
    }
}

/// Modified Bessel function of the first kind and order 0, by its power series.
fn bessel_i0(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut sum, mut term) = (1.0, 1.0);
    for order in 1..60 {
        term *= quarter / f64::from(order * order);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stated error is that of any sine in the band, for a clock that jitters and one that wanders.
    #[test]
    fn prop_the_stated_error_bounds_sines_in_the_band() {
        let jitter = |at: usize| 0.009 * ((at * at) as f64 * 0.7).sin();
        let wander = |at: usize| 12.0 * (at as f64 / 900.0).sin();
        for (name, shift) in [
            ("jitter", &jitter as &dyn Fn(usize) -> f64),
            ("wander", &wander),
        ] {
            let times: Vec<f64> = (0..6000).map(|at| at as f64 + shift(at)).collect();
            let steps = times.windows(2).map(|pair| (pair[1] - pair[0] - 1.0).abs());
            let deviation = steps.fold(0.0, f64::max);
            assert!((0.01..0.02).contains(&deviation), "{name}: {deviation}");
            for frequency in [0.01, 0.11, 0.27, 0.39] {
                let wave = |time: f64| (TAU * frequency * time + 0.3).sin();
                let samples = vec![times.iter().map(|time| wave(*time)).collect()];
                let found = resample(&times, &samples, deviation);
                let first = times[0];
                let errors = found.samples[0].iter().enumerate().take(5900).skip(100);
                let errors = errors
                    .map(|(at, value)| (value - wave(first + at as f64 / found.sample_rate)).abs());
                let worst = 20.0 * errors.fold(1e-15, f64::max).log10();
                // 3 dB: the worst phase lies between sine and cosine.
                assert!(
                    worst <= found.error_db + 3.0,
                    "{name} {frequency}: {worst} {found:?}"
                );
                assert!(found.error_db < -60.0, "{name}: {}", found.error_db);
            }
        }
    }
}
