//! Spectra: transforms, zoom bands, windows, averages, decay.

use std::f64::consts::TAU;

use crate::shared::baseband;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint_signal::spectral::{
    BandLimiter, DecayCheck, Lines, SpectralAverager, SpectralError, Window, apply_force_window,
    choose_window, largest_smooth_block, line_and_noise, measure_decay, noise_power,
    smallest_smooth_block, transform_block,
};

fn noise(length: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..length)
        .map(|_| StandardNormal.sample(&mut random))
        .collect()
}

/// The defining sum (1/rate) sum x e^{-j 2 pi f n/rate}: the independent route.
fn direct(samples: &[f64], rate: f64, frequency: f64) -> Complex64 {
    samples
        .iter()
        .enumerate()
        .map(|(n, &x)| Complex64::from_polar(x / rate, -TAU * frequency * n as f64 / rate))
        .sum()
}

#[test]
fn val_2048_samples_show_800_lines() {
    // Ingole & Chatterjee section 3.3: 2048 -> 800 lines, 4096 -> 1600, half a line is 0.0625 % and
    // 0.03125 % of the band.
    for (block, displayed, percent) in [(2048, 800, 0.0625), (4096, 1600, 0.03125)] {
        let lines = Lines::zoom((0.0, 1000.0), 5120.0, block, 1e3).unwrap();
        assert_eq!(lines.displayed(), displayed);
        let found = 100.0 * lines.half_line() / 1000.0;
        // The printed percentages are exact decimals.
        assert!((found - percent).abs() < 1e-12, "{block}: {found} %");
    }
}

#[test]
fn prop_padding_adds_lines_but_no_resolution() {
    let long = Lines::zoom((0.0, 200.0), 5120.0, 2048, 10.0).unwrap();
    let padded = Lines::zoom((0.0, 200.0), 5120.0, 8192, 4.0).unwrap();
    assert_eq!(padded.spacing, long.spacing / 4.0);
    assert_eq!(padded.half_line(), 0.5 * padded.resolution());
    assert_eq!(
        padded.half_line(),
        long.half_line(),
        "both have 4 s of signal"
    );
}

#[test]
fn limit_bands_and_blocks_that_do_not_fit_are_refused() {
    for band in [
        (100.0, 100.0),
        (200.0, 100.0),
        (0.0, 2561.0),
        (-1.0, 5.0),
        (f64::NAN, 5.0),
    ] {
        let error = Lines::zoom(band, 5120.0, 2048, 1.0).unwrap_err();
        assert!(
            matches!(error, SpectralError::Band { .. }),
            "{band:?}: {error}"
        );
    }
    assert!(matches!(
        baseband(5120.0, 8, 1.0),
        Err(SpectralError::Block { .. })
    ));
    // Sixteen seconds of which one is signal, and one sample more.
    assert!(baseband(5120.0, 16 * 5120, 1.0).is_ok());
    assert!(matches!(
        baseband(5120.0, 16 * 5120 + 1, 1.0),
        Err(SpectralError::Padded { .. })
    ));
}

#[test]
fn prop_transforms_equal_the_defining_sum() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for case in 0..20 {
        let rate = random.random_range(500.0..50_000.0);
        let length = random.random_range(50..3000);
        let samples = noise(length, case);
        let available = length as f64 / rate;
        // So wide that nothing can be decimated: no filter, hence no ripple.
        let low = random.random_range(0.0..0.05) * rate;
        let band = (low, low + random.random_range(0.41..0.45) * rate);
        for lines in [
            baseband(rate, length.max(16), available).unwrap(),
            Lines::zoom(band, rate, 500, available).unwrap(),
        ] {
            let values = transform_block(&samples, rate, &lines);
            let scale = values.iter().map(|v| v.norm()).fold(0.0, f64::max);
            for index in (0..lines.points()).step_by(37) {
                let expected = direct(&samples, rate, lines.frequency(index));
                // Rounding of sums of up to 3000 terms, far below any filter's ripple.
                let error = (values[index] - expected).norm() / scale;
                assert!(error < 1e-9, "case {case}, line {index}: {error:e}");
            }
        }
    }
}

#[test]
fn prop_zoom_equals_the_defining_sum_within_the_filters_ripple() {
    let rate = 12_800.0;
    let samples = noise(12_000, 5);
    for band in [
        (0.0, 200.0),
        (40.0, 90.0),
        (1000.0, 1500.0),
        (5000.0, 6400.0),
    ] {
        let lines = Lines::zoom(band, rate, 1024, 12_000.0 / rate).unwrap();
        let values = transform_block(&samples, rate, &lines);
        let scale = (12_000f64).sqrt() / rate;
        for index in (0..lines.points()).step_by(13) {
            let expected = direct(&samples, rate, lines.frequency(index));
            let error = (values[index] - expected).norm() / scale;
            // The low-pass has 100 dB; what aliases adds up over the decimation factor (up to 200
            // bands of 1e-5 each, in random phase: 1.4e-4).
            assert!(error < 3e-4, "{band:?}, line {index}: {error:e}");
        }
    }
}

#[test]
fn prop_a_delayed_copy_has_the_phase_minus_omega_d() {
    let (rate, delay) = (4096.0, 24);
    let mut force = vec![0.0; 4096];
    force[100] = 1.0;
    force[101] = 0.5;
    let mut response = vec![0.0; 4096];
    response[100 + delay] = 1.0;
    response[101 + delay] = 0.5;
    let lines = baseband(rate, 4096, 1.0).unwrap();
    let mut averager = SpectralAverager::new(lines, 1);
    averager.add(
        Some(&transform_block(&force, rate, &lines)),
        &[transform_block(&response, rate, &lines)],
    );
    let h1 = averager.finish().unwrap().h1.unwrap();
    for index in [1, 10, 100, 1000] {
        let omega = TAU * lines.frequency(index);
        let expected = Complex64::from_polar(1.0, -omega * delay as f64 / rate);
        // Rounding of the transform only.
        assert!(
            (h1[0][index] - expected).norm() < 1e-9,
            "line {index}: {}",
            h1[0][index]
        );
    }
}

#[test]
fn limit_h1_of_nothing_is_nothing() {
    let lines = baseband(1000.0, 100, 0.1).unwrap();
    assert!(SpectralAverager::new(lines, 1).finish().is_none());
    let mut averager = SpectralAverager::new(lines, 1);
    averager.add(None, &[vec![Complex64::ONE; lines.points()]]);
    let averages = averager.finish().unwrap();
    assert!(averages.h1.is_none() && averages.force.is_none());
    assert_eq!(averages.responses[0][3], 1.0);
}

#[test]
fn prop_the_exponential_window_moves_a_pole_by_its_decay() {
    let rate = 1000.0;
    let ring = |decay: f64| -> Vec<f64> {
        (0..1000)
            .map(|n| (-decay * n as f64 / rate).exp() * (0.3 * n as f64).sin())
            .collect()
    };
    let mut windowed = ring(2.0);
    let window = Window::Exponential { decay: 3.5 };
    window.apply(&mut windowed, rate);
    let expected = ring(2.0 + window.added_decay());
    for (n, (found, expected)) in windowed.iter().zip(&expected).enumerate() {
        assert!((found - expected).abs() < 1e-12, "sample {n}");
    }
}

#[test]
fn prop_the_force_window_is_one_then_falls_to_exact_zero() {
    let mut force = vec![1.0; 50];
    apply_force_window(&mut force, 20, 10);
    assert!(force[..20].iter().all(|&x| x == 1.0));
    assert!(force[20..].windows(2).all(|pair| pair[1] <= pair[0]));
    assert!(force[30..].iter().all(|&x| x == 0.0));
}

#[test]
fn prop_hann_keeps_the_amplitude_of_a_steady_line() {
    let rate = 1024.0;
    let mut samples: Vec<f64> = (0..1024)
        .map(|n| 3.0 * (TAU * 50.0 * n as f64 / rate).cos())
        .collect();
    Window::Hann.apply(&mut samples, rate);
    let lines = baseband(rate, 1024, 1.0).unwrap();
    let amplitude = 2.0 * transform_block(&samples, rate, &lines)[50].norm();
    assert!((amplitude - 3.0).abs() < 1e-9, "{amplitude}");
}

#[test]
fn recover_white_noise_keeps_its_level_whatever_the_quiet_stretch() {
    let rate = 2000.0;
    let lines = baseband(rate, 4000, 2.0).unwrap();
    for quiet in [400, 2000, 4000] {
        let power = &noise_power(&[&noise(quiet, 3)], rate, &lines).unwrap()[0];
        let mean = power.iter().sum::<f64>() / power.len() as f64 * rate * rate;
        // 400 samples hold 160 independent lines; a median of 17 of them scatters by some 20 %, and
        // the mean over all by some 8 %: 1.5 dB is four times that.
        assert!((10.0 * mean.log10()).abs() < 1.5, "{quiet} samples: {mean}");
    }
    assert!(noise_power(&[&noise(10, 1)], rate, &lines).is_none());
}

#[test]
fn recover_amplitude_of_a_steady_line() {
    let rate = 5000.0;
    let hum: Vec<f64> = (0..3000)
        .map(|n| 0.02 * (TAU * 50.0 * n as f64 / rate + 0.4).sin())
        .collect();
    let (found, _) = line_and_noise(&hum, rate, 50.0).unwrap();
    // Thirty whole periods: the image at -50 Hz cancels to rounding.
    assert!((found - 0.02).abs() < 1e-6, "{found}");
    assert!(
        line_and_noise(&hum[..200], rate, 50.0).is_none(),
        "two periods are too few"
    );
}

#[test]
fn recover_noise_beside_a_line() {
    let (rate, count) = (4096.0, 4096);
    let ratio = |hum: f64, seed: u64| {
        let mut samples = noise(count, seed);
        for (n, x) in samples.iter_mut().enumerate() {
            *x += hum * (TAU * 1800.0 * n as f64 / rate).sin();
        }
        let (line, noise) = line_and_noise(&samples, rate, 1800.0).unwrap();
        line / noise
    };
    // White noise of unit variance leaves amplitudes of 2/sqrt(n) = 0.03 root mean square: a line of 0.5 is
    // 16 times as high, give or take the scatter of a median of twelve (a third).
    for seed in 0..20 {
        assert!(ratio(0.0, seed) < 4.0, "{}", ratio(0.0, seed));
        let found = ratio(0.5, seed);
        assert!((8.0..32.0).contains(&found), "{found}");
    }
}

#[test]
fn recover_decay_at_the_end_of_a_record() {
    let rate = 4000.0;
    let ring = |end: f64| -> Vec<f64> {
        (0..8000)
            .map(|n| (end.ln() * n as f64 / 8000.0).exp() * (TAU * 300.0 * n as f64 / rate).sin())
            .collect()
    };
    for end in [0.5, 0.1, 0.003] {
        let found = measure_decay(&ring(end), 0.0).remaining;
        // First and last twentieth are averages over their length: the exact ratio is end^{19/20}.
        let expected = end.powf(0.95);
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{end}: {found} for {expected}"
        );
    }
}

#[test]
fn limit_window_is_rectangular_once_rung_down_and_else_reaches_one_percent() {
    let check = |remaining| DecayCheck {
        remaining,
        noise: 0.0,
    };
    assert_eq!(
        choose_window(&[check(0.009), check(0.0)], 2.0),
        Window::Rectangular
    );
    let Window::Exponential { decay } = choose_window(&[check(0.009), check(0.2)], 2.0) else {
        panic!("a record that keeps 20 % needs a window");
    };
    assert!((0.2 * (-decay * 2.0).exp() - 0.01).abs() < 1e-12);
    let buried = DecayCheck {
        remaining: 0.03,
        noise: 0.05,
    };
    assert_eq!(
        choose_window(&[buried], 2.0),
        Window::Rectangular,
        "only noise remains"
    );
}

#[test]
fn prop_band_limited_keeps_what_is_in_the_band() {
    let rate = 8000.0;
    let tone = |f: f64| {
        (0..8000)
            .map(|n| (TAU * f * n as f64 / rate).sin())
            .collect::<Vec<_>>()
    };
    let level = |samples: &[f64]| {
        let inner = &samples[samples.len() / 4..3 * samples.len() / 4];
        inner.iter().sum::<f64>() / inner.len() as f64
    };
    let limiter = BandLimiter::new(rate, (100.0, 200.0), 8000);
    let inside = level(&limiter.magnitude(&tone(150.0)));
    let outside = level(&limiter.magnitude(&tone(900.0)));
    assert!((inside - 1.0).abs() < 1e-3, "{inside}");
    assert!(outside < 1e-4, "{outside}");
}

#[test]
fn prop_smooth_blocks_have_only_small_factors_and_waste_little() {
    for most in [2usize, 17, 997, 25_545, 1 << 20] {
        let block = largest_smooth_block(most).unwrap();
        let mut rest = block;
        for factor in [2usize, 3, 5] {
            while rest.is_multiple_of(factor) {
                rest /= factor;
            }
        }
        assert_eq!(rest, 1, "{block}");
        // Even 5-smooth numbers are never farther apart than 12.5 % from 16 on.
        assert!(
            block.is_multiple_of(2)
                && block <= most
                && (most < 16 || block as f64 > 0.87 * most as f64)
        );
    }
    assert_eq!(largest_smooth_block(1), None);
    assert_eq!(smallest_smooth_block(7), 8);
}
