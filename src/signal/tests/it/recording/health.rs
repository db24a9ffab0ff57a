//! Health of channels and its warnings, on signals whose faults are known.

use std::f64::consts::TAU;

use approx::assert_relative_eq;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tapjoint_signal::recording::{
    Channel, ChannelHealth, ReadSettings, Recording, RecordingWarning, WavFormat, write_wav,
};

use super::file;

const RATE: f64 = 1000.0;

fn record(samples: Vec<f64>) -> Recording {
    let channel = Channel {
        samples,
        ..Channel::default()
    };
    Recording::from_samples("virtual", RATE, vec![channel]).expect("a valid recording")
}

fn health(samples: Vec<f64>) -> ChannelHealth {
    record(samples).channels()[0].health.clone()
}

fn codes(recording: &Recording) -> Vec<&'static str> {
    let warnings = recording.warnings();
    warnings.iter().map(RecordingWarning::code).collect()
}

/// A ring-down at 47 Hz over noise, 4 s.
fn ring_down() -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let sample = |at: usize| {
        let t = at as f64 / RATE;
        let noise = 1e-3 * random.random_range(-1.0..1.0);
        noise + (-t).exp() * (TAU * 47.0 * t).sin()
    };
    (0..4000).map(sample).collect()
}

#[test]
fn val_moments_are_those_of_the_definition() {
    // Four numbers: mean 4, deviations -2, -1, 0, 3, squares 14.
    let four = health(vec![2.0, 3.0, 4.0, 7.0]);
    assert_eq!(four.mean, 4.0);
    assert_relative_eq!(four.rms, (14.0_f64 / 4.0).sqrt(), max_relative = 1e-15);
    assert_eq!((four.peak, four.minimum, four.maximum), (7.0, 2.0, 7.0));
    let negative = health(vec![-9.0, 1.0]);
    assert_eq!(negative.peak, 9.0);
}

#[test]
fn limit_a_large_offset_does_not_spoil_the_rms() {
    // The sum of squares minus the square of the sum would lose all 16 digits here.
    let samples = (0..300_000).map(|at| 1e9 + f64::from(at % 2)).collect();
    let health = health(samples);
    // Halves about the mean; the mean itself is rounded to 1e-7.
    assert_relative_eq!(health.rms, 0.5, max_relative = 1e-6);
}

#[test]
fn prop_a_clean_ring_down_gives_no_warning() {
    let recording = record(ring_down());
    assert!(codes(&recording).is_empty(), "{:?}", recording.warnings());
    let health = &recording.channels()[0].health;
    assert_eq!(health.flat_top_count + health.dropout_count, 0);
}

#[test]
fn prop_clipping_is_found_with_place_and_count() {
    let mut samples = ring_down();
    for sample in &mut samples {
        *sample = sample.clamp(-0.8, 2.0);
    }
    // An independent count of what was made.
    let runs = |samples: &[f64]| {
        samples
            .chunk_by(|a, b| a == b)
            .filter(|run| run.len() >= 3 && run[0] == -0.8)
            .count() as u64
    };
    let made = runs(&samples);
    assert!(made > 3, "{made} crests are cut");
    let start = samples.windows(3).position(|w| w == [-0.8; 3]).unwrap();
    let recording = record(samples);
    let health = &recording.channels()[0].health;
    assert_eq!(health.flat_top_count, made);
    assert_eq!(health.flat_tops.len() as u64, made);
    assert_eq!(health.flat_tops[0].start, start as u64);
    assert_eq!(health.flat_tops[0].value, -0.8);
    assert_eq!(codes(&recording), ["flat-tops"]);
    let text = recording.warnings()[0].to_string();
    let place = format!("the first at {:.6} s", start as f64 / RATE);
    assert!(
        text.contains("channel 1") && text.contains(&place),
        "{text}"
    );
}

#[test]
fn limit_the_list_of_places_is_capped_and_the_count_is_not() {
    let samples = (0..40_300).map(|at| (TAU * at as f64 / 40.3).sin().clamp(-0.9, 0.9));
    let health = health(samples.collect());
    // A thousand periods with a crest and a trough each. A few may be missed at the beginning, as
    // long as the smallest step between samples has not been seen.
    assert!(
        (1960..=2000).contains(&health.flat_top_count),
        "{}",
        health.flat_top_count
    );
    assert_eq!(health.flat_tops.len(), 64);
    let starts: Vec<u64> = health.flat_tops.iter().map(|f| f.start).collect();
    assert!(starts.is_sorted(), "{starts:?}");
}

#[test]
fn limit_a_slow_crest_in_coarse_steps_is_no_clipping() {
    // 3 Hz at 1 kHz in steps of 1/40: the crest holds about 17 equal samples.
    let sine = |at: usize| (40.0 * (TAU * 3.0 * at as f64 / RATE).sin()).round() / 40.0;
    let samples: Vec<f64> = (0..5000).map(sine).collect();
    let longest = samples.chunk_by(|a, b| a == b).map(<[f64]>::len).max();
    assert!(longest >= Some(10), "{longest:?}");
    let recording = record(samples);
    assert!(codes(&recording).is_empty(), "{:?}", recording.warnings());
}

#[test]
fn prop_full_scale_samples_of_an_integer_file_are_counted() {
    let file = file("loud.wav", b"");
    let samples: Vec<f64> = ring_down().iter().map(|x| 1.5 * x).collect();
    let beyond = |x: &&f64| !(-32_767.5 / 32_768.0..32_766.5 / 32_768.0).contains(*x);
    let expected = samples.iter().filter(beyond).count() as u64;
    assert!(expected > 10, "{expected}");
    write_wav(&file.path, 1000, &[samples], WavFormat::Pcm16).unwrap();
    let recording = Recording::open(&file.path, &ReadSettings::default()).unwrap();
    let health = &recording.channels()[0].health;
    // -32767 counts as well: some converters stop there.
    assert_eq!(health.full_scale_samples, expected);
    assert!(health.flat_top_count > 0);
    assert_eq!(codes(&recording), ["full-scale", "flat-tops"]);
}

#[test]
fn prop_lost_samples_are_found_as_zeros_and_as_repeated_values() {
    for held in [None, Some(0.123)] {
        let mut samples = ring_down();
        let value = held.unwrap_or(0.0);
        samples[700..764].fill(value);
        samples[1500..1540].fill(value);
        let recording = record(samples);
        let health = &recording.channels()[0].health;
        assert_eq!(health.dropout_count, 2, "{held:?}: {health:?}");
        assert_eq!(health.dropped_samples, 104, "{held:?}");
        assert_eq!((health.dropped[0].start, health.dropped[0].len), (700, 64));
        assert_eq!(health.dropped[0].value, value);
        assert_eq!(codes(&recording), ["dropped-samples"]);
        let text = recording.warnings()[0].to_string();
        assert!(
            text.contains("moving signal: 2; samples in them: 104") && text.contains("0.700000 s"),
            "{text}"
        );
    }
}

#[test]
fn prop_short_losses_are_found_in_a_strong_signal_alone() {
    let lost = |scale: f64, len: usize| {
        let mut samples: Vec<f64> = ring_down()
            .iter()
            .map(|x| (scale * x).round() / scale)
            .collect();
        samples[700..700 + len].fill(0.25);
        health(samples).dropout_count
    };
    // It moves by some 0.1 from sample to sample: 4,000 steps of a converter of 16 bits, and 8 samples are too many.
    assert_eq!([7, 8, 30].map(|len| lost(32_768.0, len)), [0, 1, 1]);
    // 13 steps of one of 128 levels: by chance 8 equal samples come once in 10^8.
    assert_eq!([8, 11, 16].map(|len| lost(128.0, len)), [0, 0, 1]);
}

#[test]
fn limit_noise_behind_a_pulse_is_no_loss() {
    // The hammer of a 16-bit recorder, whose noise is half a step: it repeats values soon after each pulse.
    let noise = rand_distr::Normal::new(0.0, 0.5).unwrap();
    for seed in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let hammer = |at: usize| {
            let after = (at % 5000) as f64;
            let pulse = if after < 50.0 {
                (TAU * after / 100.0).sin()
            } else {
                0.0
            };
            (8000.0 * pulse + random.sample(noise)).round()
        };
        let health = health((0..50_000).map(hammer).collect());
        assert_eq!(health.dropout_count, 0, "seed {seed}: {:?}", health.dropped);
    }
}

#[test]
fn prop_a_signal_that_stops_while_it_moves_is_told() {
    let mut quiet = ChaCha8Rng::seed_from_u64(5);
    // Noise of two steps each way, between taps.
    let dither: Vec<f64> = (0..4000)
        .map(|_| f64::from(quiet.random_range(-2..=2)))
        .collect();
    for mut samples in [ring_down(), dither] {
        samples[2499] = 1.5;
        for value in [0.0, 9.0] {
            samples[2500..].fill(value);
            let stopped = health(samples.clone()).stopped.unwrap();
            assert_eq!(
                (stopped.start, stopped.len, stopped.value),
                (2500, 1500, value)
            );
        }
        // It lives again.
        samples.extend(ring_down());
        assert_eq!(health(samples).stopped, None);
    }
    // A decay below one step of a converter.
    let quantised = |at: usize| {
        let t = at as f64 / RATE;
        ((-8.0 * t).exp() * (TAU * 47.0 * t).sin() * 2048.0).round()
    };
    assert_eq!(health((0..4000).map(quantised).collect()).stopped, None);
}

#[test]
fn limit_silence_is_no_loss() {
    // A decay that ends below one step of a 12-bit converter, three times.
    let quantised = |at: usize| {
        let t = (at % 4000) as f64 / RATE;
        ((-8.0 * t).exp() * (TAU * 47.0 * t).sin() * 2048.0).round() / 2048.0
    };
    let quiet: Vec<f64> = (0..12_000).map(quantised).collect();
    assert!(quiet.windows(500).any(|w| w.iter().all(|x| *x == 0.0)));
    let recording = record(quiet);
    assert!(codes(&recording).is_empty(), "{:?}", recording.warnings());
    // The hammer of a simulation without noise: at rest but for its pulses.
    let pulse = |at: usize| (TAU * (at % 2000) as f64 / 10.0).sin();
    let hammer = |at: usize| if at % 2000 < 5 { pulse(at) } else { 0.0 };
    let recording = record((0..10_000).map(hammer).collect());
    assert!(codes(&recording).is_empty(), "{:?}", recording.warnings());
}

#[test]
fn limit_a_channel_that_never_moves_is_said_to_be_dead_and_nothing_else() {
    for value in [0.0, 0.25] {
        let recording = record(vec![value; 500]);
        let health = &recording.channels()[0].health;
        assert!(health.constant);
        assert_eq!(health.dropout_count + health.flat_top_count, 0);
        assert_eq!(codes(&recording), ["constant-channel"], "{value}");
    }
}

#[test]
fn prop_an_offset_is_reported() {
    let samples: Vec<f64> = ring_down().iter().map(|x| x + 0.5).collect();
    let recording = record(samples);
    assert_eq!(codes(&recording), ["offset"]);
}

#[test]
fn prop_health_does_not_depend_on_how_the_file_is_read() {
    // The same samples from memory in one piece, from WAV in blocks, from text in other blocks.
    let mut samples: Vec<f64> = (0..20).flat_map(|_| ring_down()).collect();
    for sample in &mut samples {
        // Exact in 16 bits.
        *sample = (sample.clamp(-0.8, 2.0) * 16_384.0).round() / 32_768.0;
    }
    samples[70_000..70_100].fill(0.0);
    let memory = health(samples.clone());
    assert!(memory.flat_top_count > 0 && memory.dropout_count == 1);
    let wav = file("same.wav", b"");
    write_wav(&wav.path, 1000, &[samples.clone()], WavFormat::Pcm16).unwrap();
    let text: String = samples.iter().map(|x| format!("{x}\n")).collect();
    let csv = file("same.csv", format!("a\n{text}"));
    for file in [wav, csv] {
        let settings = ReadSettings {
            sample_rate: Some(RATE),
            ..ReadSettings::default()
        };
        let recording = Recording::open(&file.path, &settings).unwrap();
        let mut other = recording.channels()[0].health.clone();
        // Sums in another order: a few roundings.
        assert_relative_eq!(other.mean, memory.mean, epsilon = 1e-15);
        assert_relative_eq!(other.rms, memory.rms, max_relative = 1e-12);
        (other.mean, other.rms) = (memory.mean, memory.rms);
        assert_eq!(other, memory, "{:?}", recording.format());
    }
}
