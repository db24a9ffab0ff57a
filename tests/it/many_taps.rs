//! Recordings of more than a hundred taps: groups of them are fitted, and the intervals still hold the truth.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::{PI, TAU};
use tapjoint::description::ChannelRef;
use tapjoint::listen::Precision;
use tapjoint::pipeline::run_recording;
use tapjoint::recording::Channel;
use tapjoint::report::document::Document;
use tapjoint::report::document_of;
use tapjoint::taps::TapSource;
use tapjoint::{MeasureSettings, Measurement, Recording, measure};

/// Natural frequency (Hz), damping ratio and amplitude of each mode.
const MODES: [(f64, f64, f64); 2] = [(61.7, 0.012, 1.0), (148.3, 0.009, 0.7)];

/// A force and a response with a tap every `seconds`, each as strong as it happens to be. The structure rings on from
/// tap to tap.
fn tapped(seed: u64, rate: f64, taps: usize, seconds: f64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let record = (rate * seconds) as usize;
    let (before, pulse) = ((0.05 * rate) as usize, (4e-3 * rate) as usize);
    let mut force = Vec::with_capacity(taps * record);
    let mut response = Vec::with_capacity(taps * record);
    let mut states = [num_complex::Complex64::ZERO; 2];
    for _ in 0..taps {
        let peak = random.random_range(50.0..150.0);
        for n in 0..record {
            let into = n.checked_sub(before).filter(|n| *n < pulse);
            let f = into.map_or(0.0, |n| peak * (PI * n as f64 / pulse as f64).sin());
            let mut x = 0.0;
            for (state, (frequency, ratio, amplitude)) in states.iter_mut().zip(MODES) {
                let omega = TAU * frequency;
                let pole = num_complex::Complex64::new(
                    -ratio * omega,
                    omega * (1.0 - ratio * ratio).sqrt(),
                );
                *state *= (pole / rate).exp();
                *state += amplitude * f / rate;
                x += state.im;
            }
            let mut noise = || -> f64 { random.sample(StandardNormal) };
            force.push(f + 0.05 * noise());
            response.push(x + 5e-4 * noise());
        }
    }
    let channels = [force, response].map(|samples| Channel {
        samples,
        ..Channel::default()
    });
    Recording::from_samples("many", rate, channels.into()).expect("a recording")
}

fn measured(recording: &Recording) -> Measurement {
    measured_by(
        recording,
        TapSource::Hammer {
            channel: 0,
            responses: vec![1],
        },
    )
}

fn measured_by(recording: &Recording, source: TapSource) -> Measurement {
    measure(recording, &MeasureSettings::new(source)).expect("a measurement")
}

/// Number of modes whose interval holds the truth; every mode must have been fitted.
fn held(measurement: &Measurement) -> usize {
    let spectra = measurement.spectra.as_ref().expect("spectra");
    let mut held = 0;
    for (frequency, ratio, _) in MODES {
        let near = spectra.readings.iter().filter(|one| one.fit.is_some());
        let distance = |one: &tapjoint::ModeReading| (one.frequency - frequency).abs();
        let nearest = near.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let nearest = nearest.expect("a fitted mode");
        let fit = &nearest.fit.as_ref().expect("a fit").mode;
        assert!(distance(nearest) < 0.05, "{}", nearest.frequency);
        assert!((fit.damping_ratio.value / ratio - 1.0).abs() < 0.05);
        held += usize::from((fit.frequency.low..=fit.frequency.high).contains(&frequency));
    }
    held
}

#[test]
fn recover_frequencies_of_many_taps_lie_in_their_intervals() {
    let mut inside = 0;
    for seed in 0..20 {
        let measurement = measured(&tapped(seed, 1024.0, 130, 1.0));
        let spectra = measurement.spectra.as_ref().expect("spectra");
        // 130 taps in 16 groups.
        assert_eq!(spectra.taps_together, Some(9));
        inside += held(&measurement);
    }
    // 95 % of 40 are 38; fewer than 34 have a probability below 1 %.
    assert!(inside >= 34, "{inside} of 40");
}

#[test]
fn recover_frequencies_of_long_records_that_are_thinned() {
    let mut inside = 0;
    for seed in 0..3 {
        let measurement = measured(&tapped(seed, 16_384.0, 104, 5.0));
        let spectra = measurement.spectra.as_ref().expect("spectra");
        assert_eq!(spectra.taps_together, Some(7));
        inside += held(&measurement);
    }
    // Fewer than 4 of 6 have a probability of 2 in 1000.
    assert!(inside >= 4, "{inside} of 6");
}

#[test]
fn limit_a_hundred_taps_are_fitted_one_by_one() {
    let measurement = measured(&tapped(1, 1024.0, 100, 1.0));
    let spectra = measurement.spectra.as_ref().expect("spectra");
    assert_eq!(spectra.taps_together, None);
    let reading = spectra.readings.iter().find_map(|one| one.fit.as_ref());
    assert_eq!(reading.expect("a fit").mode.taps.len(), 100);
}

#[test]
fn recover_frequencies_of_many_taps_without_a_hammer() {
    let mut inside = 0;
    for seed in 0..4 {
        let recording = tapped(seed, 1024.0, 130, 1.0);
        let measurement = measured_by(&recording, TapSource::Responses(vec![1]));
        let spectra = measurement.spectra.as_ref().expect("spectra");
        assert!(spectra.taps_together.is_some_and(|taps| taps > 1));
        inside += held(&measurement);
    }
    // Fewer than 5 of 8 have a probability of 4 in 10,000.
    assert!(inside >= 5, "{inside} of 8");
}

#[test]
fn recover_what_further_taps_bring() {
    /// Pairs of recordings. The intervals scatter by a quarter from one to the next.
    const SEEDS: u64 = 24;
    let hammer = ChannelRef::Number(1);
    let (mut ratios, mut promised) = (Vec::new(), 0.0);
    for seed in 0..SEEDS {
        let [few, many] = [4, 8].map(|count| {
            let recording = tapped(100 + seed, 1024.0, count, 2.0);
            let analysis = run_recording(recording, Some(&hammer), |_| {}).unwrap();
            document_of(&analysis)
        });
        // The gains of four taps, one after the other.
        let gains = (4..8).map(|taps| Precision::of(&few, taps).unwrap().gain.unwrap());
        promised = gains.map(|gain| (1.0 - gain).ln()).sum();
        let width = |document: &Document, frequency: f64| {
            let mut modes = document.modes.iter().flatten();
            let mode = modes.find(|mode| (mode.frequency - frequency).abs() < 0.5)?;
            Some(mode.high? - mode.low?)
        };
        for (frequency, _, _) in MODES {
            let widths = width(&many, frequency).zip(width(&few, frequency));
            ratios.extend(widths.map(|(many, few)| (many / few).ln()));
        }
    }
    let count = ratios.len() as f64;
    assert!(count >= 1.5 * SEEDS as f64, "{count}");
    let mean = ratios.iter().sum::<f64>() / count;
    let square: f64 = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum();
    let error = (square / (count - 1.0) / count).sqrt();
    assert!(
        (mean - promised).abs() < 3.0 * error,
        "{mean:.3} \u{b1} {error:.3} for {promised:.3}"
    );
    // The test can tell this gain from none, and from twice as much.
    assert!(3.0 * error < -promised, "{error} for {promised}");
}
