//! Peaks, readings between the lines, mains, merging.

use std::f64::consts::TAU;

use crate::shared::baseband;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tapjoint_signal::modal::{
    BandReadings, CompositeLevel, GRIDS, GridFrequency, LineAmplitudes, MainsSettings, ModeReading,
    PeakLabel, PeakSettings, find_peaks, interpolate_pole, merge_modes, near_mains, read_peaks,
};
use tapjoint_signal::spectral::{Lines, Window, transform_block};

/// Sampled free decay, cut off at the block's end.
fn ring_down(
    rate: f64,
    samples: usize,
    frequency: f64,
    damping_ratio: f64,
    phase: f64,
) -> Vec<f64> {
    let omega = TAU * frequency;
    let damped = omega * (1.0 - damping_ratio * damping_ratio).sqrt();
    (0..samples)
        .map(|n| {
            let t = n as f64 / rate;
            (-damping_ratio * omega * t).exp() * (damped * t + phase).cos()
        })
        .collect()
}

fn level_of(lines: Lines, spectrum: &[Complex64]) -> CompositeLevel {
    let power = spectrum.iter().map(Complex64::norm_sqr).collect();
    CompositeLevel::new(lines, &[power], None)
}

#[test]
fn prop_one_pole_is_read_far_below_the_line_spacing_truncated_or_not() {
    let (rate, block) = (2048.0, 2048);
    let lines = baseband(rate, block, 1.0).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(11);
    for case in 0..200 {
        let frequency = random.random_range(60.0..600.0);
        let damping = random.random_range(2e-4..0.01);
        let phase = random.random_range(0.0..TAU);
        let spectrum = transform_block(
            &ring_down(rate, block, frequency, damping, phase),
            rate,
            &lines,
        );
        let level = level_of(lines, &spectrum);
        let peak = (30..700)
            .max_by(|&a, &b| level.level_db[a].total_cmp(&level.level_db[b]))
            .unwrap();
        let found = interpolate_pole(&lines, &[&spectrum], peak, 50, 0.0).unwrap();
        // What remains is the image at the negative frequency, whose curvature over the fitted lines
        // is not part of the model: below a hundredth of a line from 60 lines up.
        let error = (found.frequency - frequency).abs();
        assert!(
            error < 0.01,
            "case {case}: {frequency} Hz, damping {damping}: {error} Hz"
        );
        let ratio = found.damping_ratio.unwrap() * frequency;
        assert!(
            (ratio - damping * frequency).abs() < 0.01,
            "case {case}: damping"
        );
    }
}

#[test]
fn prop_the_windows_decay_is_taken_out_of_the_damping() {
    let (rate, block) = (2048.0, 4096);
    let lines = baseband(rate, block, 2.0).unwrap();
    let mut samples = ring_down(rate, block, 211.3, 0.002, 0.3);
    let window = Window::Exponential { decay: 2.3 };
    window.apply(&mut samples, rate);
    let spectrum = transform_block(&samples, rate, &lines);
    let level = level_of(lines, &spectrum);
    let peaks = find_peaks(
        &level,
        &PeakSettings {
            most: 1,
            ..Default::default()
        },
    );
    let reading = &read_peaks(&level, &[&spectrum], &peaks, window)[0];
    // The image at the negative frequency again: 0.5 % of this damping.
    let damping = reading.damping_ratio.unwrap();
    assert!((damping / 0.002 - 1.0).abs() < 0.01, "{damping}");
}

#[test]
fn limit_hum_and_noise_speckle_are_no_resonance() {
    let (rate, block) = (2048.0, 2048);
    let lines = baseband(rate, block, 1.0).unwrap();
    let growing: Vec<f64> = ring_down(rate, block, 211.3, 0.002, 0.3)
        .into_iter()
        .rev()
        .collect();
    let spectrum = transform_block(&growing, rate, &lines);
    let level = level_of(lines, &spectrum);
    let peaks = find_peaks(
        &level,
        &PeakSettings {
            most: 1,
            ..Default::default()
        },
    );
    let reading = &read_peaks(&level, &[&spectrum], &peaks, Window::Rectangular)[0];
    assert_eq!(
        reading.label,
        Some(PeakLabel::NoResonance),
        "a rising oscillation does not decay"
    );
}

/// A level made of given heights on a 1 Hz axis from 100 Hz.
fn level_from(heights: &[(usize, f64)], noise: Option<f64>) -> CompositeLevel {
    let lines = Lines::zoom((100.0, 300.0), 1000.0, 512, 1.0).unwrap();
    let mut level_db = vec![0.0; lines.points()];
    for &(index, height) in heights {
        level_db[index] = height;
    }
    let noise_db = noise.map(|noise| vec![noise; lines.points()]);
    CompositeLevel {
        lines,
        level_db,
        noise_db,
    }
}

fn places(level: &CompositeLevel, settings: &PeakSettings) -> Vec<usize> {
    find_peaks(level, settings)
        .iter()
        .map(|peak| peak.index)
        .collect()
}

#[test]
fn prop_peaks_need_prominence_height_and_distance() {
    let settings = PeakSettings::default();
    let plain = level_from(&[(20, 30.0), (40, 9.0), (60, 1.9)], Some(-60.0));
    assert_eq!(places(&plain, &settings), [20, 40], "2 dB is the least");
    let blind = level_from(&[(20, 30.0), (40, 19.0), (60, 7.0)], None);
    assert_eq!(
        places(&blind, &settings),
        [20, 40],
        "without knowing the noise 8 dB is the least"
    );
    // At 20 dB over the noise its ripple asks for 6 * 0.87 dB on top.
    let rippled = level_from(&[(20, 7.5), (40, 6.5)], Some(-12.5));
    assert_eq!(places(&rippled, &settings), [20]);
    let noisy = level_from(&[(20, 30.0), (40, 14.0)], Some(0.0));
    assert_eq!(
        places(&noisy, &settings),
        [20],
        "14 dB is too near the noise"
    );
    let close = level_from(&[(20, 30.0), (22, 28.0), (23, 20.0)], Some(-20.0));
    assert_eq!(
        places(&close, &settings),
        [20],
        "two lines apart: one resonance"
    );
    let apart = level_from(&[(20, 30.0), (23, 28.0)], Some(-20.0));
    assert_eq!(places(&apart, &settings), [20, 23]);
    let few = PeakSettings {
        most: 1,
        ..settings
    };
    assert_eq!(
        places(&level_from(&[(20, 20.0), (50, 40.0)], None), &few),
        [50]
    );
}

#[test]
fn limit_prominence_on_a_flank_counts_from_the_saddle() {
    let mut level = level_from(&[], Some(-60.0));
    for (index, height) in level.level_db.iter_mut().enumerate() {
        *height = 60.0 - index as f64;
    }
    // A bump of 10 dB on a flank that falls 1 dB a line: the saddle lies on its upper side.
    level.level_db[30] += 10.0;
    let peaks = find_peaks(&level, &PeakSettings::default());
    assert_eq!(peaks.len(), 1);
    assert!(
        (peaks[0].prominence_db - 9.0).abs() < 1e-12,
        "{}",
        peaks[0].prominence_db
    );
}

#[test]
fn limit_mains_must_be_near_a_multiple_and_there_before_the_tap() {
    let settings = MainsSettings::default();
    let unseen = GRIDS.map(|nominal| GridFrequency::unseen(nominal, &settings));
    let seen = [
        GridFrequency {
            frequency: 49.88,
            bound: 0.02,
            is_seen: true,
            ..unseen[0]
        },
        unseen[1],
    ];
    for (frequency, grids, expected, why) in [
        (50.05, unseen, Some((50.0, 1)), "a line of 50 Hz"),
        (180.1, unseen, Some((60.0, 3)), "a multiple of 60 Hz"),
        (52.0, unseen, None, "not near a multiple"),
        (349.2, seen, Some((50.0, 7)), "seven times 49.88 Hz"),
        (350.0, seen, None, "the grid is not there"),
        (
            299.3,
            seen,
            Some((50.0, 6)),
            "the grid that was seen, not five times 60 Hz",
        ),
        (20.0, unseen, None, "below the grid"),
    ] {
        let found = near_mains(frequency, 0.1, &grids);
        let found = found.map(|(grid, number)| (grid.nominal, number));
        assert_eq!(found, expected, "{frequency} Hz: {why}");
    }
    for (before, noise, expected, why) in [
        (0.9, 0.01, true, "steady"),
        (0.01, 0.001, false, "it came with the tap"),
        (0.9, 0.3, false, "as high as the noise beside it"),
    ] {
        let line = LineAmplitudes {
            before,
            within: 1.0,
            noise,
        };
        assert_eq!(line.is_steady(&settings), expected, "{why}");
    }
}

fn reading(frequency: f64, half_line: f64) -> ModeReading {
    ModeReading {
        prominence_db: Some(20.0),
        ..ModeReading::on_line(frequency, half_line)
    }
}

/// Readings of one recording in a band (Hz).
fn within(band: (f64, f64), readings: Vec<ModeReading>) -> BandReadings {
    BandReadings {
        band,
        tap: None,
        readings,
    }
}

#[test]
fn prop_each_mode_comes_from_the_recording_that_resolves_it_best() {
    let low = vec![reading(17.0, 0.125), reading(118.1, 0.125)];
    let high = vec![
        reading(17.5, 0.625),
        reading(117.9, 0.625),
        reading(335.6, 0.625),
    ];
    for recordings in [[low.clone(), high.clone()], [high, low]] {
        let merged = merge_modes(&recordings.map(|readings| within((0.0, 400.0), readings)));
        let frequencies: Vec<f64> = merged.iter().map(|mode| mode.reading.frequency).collect();
        assert_eq!(frequencies, [17.0, 118.1, 335.6]);
    }
}

#[test]
fn limit_a_mode_that_drifted_is_one_and_two_modes_are_two() {
    let at = |frequencies: &[f64]| {
        let readings = frequencies.iter().map(|f| reading(*f, 0.125));
        within((0.0, 1000.0), readings.collect())
    };
    // A mode of the joint, 0.4 % apart in two recordings.
    assert_eq!(merge_modes(&[at(&[548.3]), at(&[546.3])]).len(), 1);
    // Two that one recording shows side by side.
    assert_eq!(merge_modes(&[at(&[546.3, 548.3]), at(&[546.4])]).len(), 2);
    // Farther than a joint drifts.
    assert_eq!(merge_modes(&[at(&[548.3]), at(&[519.3])]).len(), 2);
    // Three repeats of a clamp that was opened and closed.
    let repeats = [15.15, 14.71, 14.58].map(|low| at(&[low, 97.0]));
    assert_eq!(merge_modes(&repeats).len(), 2);
    // Taps elsewhere may miss one of two modes.
    let tapped = |tap, low| BandReadings {
        tap: Some(tap),
        ..at(&[low, 97.0])
    };
    assert_eq!(
        merge_modes(&[tapped(0.1, 15.15), tapped(0.1, 14.6)]).len(),
        2
    );
    assert_eq!(
        merge_modes(&[tapped(0.1, 15.15), tapped(0.2, 14.6)]).len(),
        3
    );
    // A third peak beside them leaves open which is which.
    assert_eq!(merge_modes(&[at(&[548.3, 530.0]), at(&[538.3])]).len(), 3);
    // On either side of the seam of two bands, where no recording could show both.
    let one = |band, frequency| within(band, vec![reading(frequency, 0.125)]);
    let (below, above) = (one((0.0, 200.0), 198.5), one((200.0, 1000.0), 201.0));
    assert_eq!(merge_modes(&[below.clone(), above]).len(), 2);
    // A recording of both bands would have shown the lower one, but the first not the upper one.
    assert_eq!(merge_modes(&[below, at(&[201.0])]).len(), 2);
    assert_eq!(merge_modes(&[at(&[198.5]), at(&[201.0])]).len(), 1);
}

#[test]
fn limit_close_modes_of_one_recording_are_never_merged() {
    let pair = vec![reading(125.0, 0.125), reading(125.3, 0.125)];
    let pair = within((0.0, 1000.0), pair);
    assert_eq!(merge_modes(std::slice::from_ref(&pair)).len(), 2);
    assert_eq!(merge_modes(&[pair.clone(), pair]).len(), 2);
}
