//! The Fourier transform of one tap record on given lines.

use num_complex::Complex64;
use rustfft::FftPlanner;

use super::lines::Lines;
use super::zoom::{chirp_z, decimation_factor, mix_and_decimate};

/// Fourier transform X(f) = (1/rate) sum x(n) e^{-j 2 pi f n/rate} of a windowed record (unit of the
/// samples times s), on `lines`; time zero is the record's first sample.
///
/// Over the full band of a block that is one FFT; over a zoom band the record is mixed down,
/// low-pass filtered, decimated and transformed on the band's own lines, as an analyser does.
pub fn transform_block(samples: &[f64], sample_rate: f64, lines: &Lines) -> Vec<Complex64> {
    let full_band = lines.low == 0.0
        && (lines.spacing * lines.block as f64 - sample_rate).abs() < 1e-9 * sample_rate;
    let values = if full_band && samples.len() <= lines.block {
        full_transform(samples, lines)
    } else {
        zoom_transform(samples, sample_rate, lines)
    };
    values
        .into_iter()
        .map(|value| value / sample_rate)
        .collect()
}

fn full_transform(samples: &[f64], lines: &Lines) -> Vec<Complex64> {
    let mut buffer: Vec<Complex64> = samples.iter().map(|&x| Complex64::from(x)).collect();
    buffer.resize(lines.block, Complex64::ZERO);
    FftPlanner::new()
        .plan_fft_forward(lines.block)
        .process(&mut buffer);
    buffer.truncate(lines.points());
    buffer
}

fn zoom_transform(samples: &[f64], sample_rate: f64, lines: &Lines) -> Vec<Complex64> {
    let width = lines.high - lines.low;
    let centre = 0.5 * (lines.low + lines.high);
    let factor = decimation_factor(sample_rate, width);
    if factor < 2 {
        let record: Vec<Complex64> = samples.iter().map(|&x| Complex64::from(x)).collect();
        let start = lines.low / sample_rate;
        return chirp_z(&record, start, lines.spacing / sample_rate, lines.points());
    }
    let zoomed = mix_and_decimate(samples, sample_rate, (centre, width), factor);
    let rate = sample_rate / factor as f64;
    let start = (lines.low - centre) / rate;
    let values = chirp_z(&zoomed.samples, start, lines.spacing / rate, lines.points());
    let scale = zoomed.factor as f64;
    (0..lines.points())
        .zip(values)
        .map(|(index, value)| {
            // The first decimated sample lies `delay` samples before the record's start.
            let offset = lines.frequency(index) - centre;
            let turn = std::f64::consts::TAU * offset * zoomed.delay as f64 / sample_rate;
            value * scale * Complex64::from_polar(1.0, turn)
        })
        .collect()
}
