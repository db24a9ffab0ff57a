//! Fits as the whole measurement makes them, on virtual tests whose answer is known.

use num_complex::Complex64;
use std::f64::consts::TAU;
use tapjoint::description::{ChannelRef, ReadBy, TestDescription};
use tapjoint::modal::ModeReading;
use tapjoint::pipeline::{IdentifySettings, MeasureSettings, measure_bare, run_test};
use tapjoint::recording::{
    Channel, FrequencyResponse, FrequencyResponses, Point, Recording, ResponseForm, UffFormat,
    encode_frequency_responses_uff,
};
use tapjoint::simulate::{SimulatedMode, TapTestSettings, simulate_tap_test};

/// Five modes, the taps 10 s apart so that each record has rung down when the next begins.
fn five_modes(shift: f64) -> Vec<SimulatedMode> {
    let modes = [
        (42.7, 0.004, 0.7, 0.8),
        (118.3, 0.003, -0.9, 0.5),
        (231.9, 0.0035, 0.6, -0.7),
        (383.4, 0.005, 0.8, 0.6),
        (572.6, 0.006, -0.5, 0.7),
    ];
    modes
        .into_iter()
        .map(|(frequency, damping_ratio, tap, sensor)| SimulatedMode {
            frequency: frequency * (1.0 + shift),
            damping_ratio,
            shape_at_tap: tap,
            shape_at_sensors: vec![sensor],
        })
        .collect()
}

fn readings(
    modes: &[SimulatedMode],
    settings: &TapTestSettings,
    seed: u64,
    adjust: impl FnOnce(&mut MeasureSettings),
) -> Vec<ModeReading> {
    let test = simulate_tap_test(modes, settings, seed);
    let channel = |samples| Channel {
        samples,
        ..Default::default()
    };
    let channels = test.channels(1.0, 1.0).into_iter().map(channel).collect();
    let recording = Recording::from_samples("virtual", settings.sample_rate, channels).unwrap();
    let hammer = ChannelRef::Number(1);
    let found = measure_bare(recording, Some(&hammer), adjust).unwrap();
    let readings = found.measurement.spectra.unwrap().readings;
    readings.into_iter().filter(|r| r.label.is_none()).collect()
}

fn nearest(readings: &[ModeReading], frequency: f64) -> &ModeReading {
    let distance = |r: &&ModeReading| (r.frequency - frequency).abs();
    let by = |a: &&ModeReading, b: &&ModeReading| distance(a).total_cmp(&distance(b));
    readings.iter().min_by(by).expect("no mode was found")
}

fn blocks_of_2048(noise_db: f64) -> TapTestSettings {
    TapTestSettings {
        sample_rate: 2048.0,
        interval: 10.0,
        // The simulator counts from the rms of the record, which is 33 dB below its peak here.
        signal_to_noise_db: noise_db - 33.0,
        ..Default::default()
    }
}

#[test]
fn recover_modes_by_fits_at_three_noise_levels() {
    // Four times the Cramer-Rao bound of this set-up at 60 dB (scripts/compare_accuracy.py prints such
    // bounds); it grows with the noise amplitude.
    let at_60_db = [0.0024, 0.0006, 0.0021, 0.0027, 0.0052];
    let (mut held, mut all) = (0, 0);
    for (noise_db, seeds) in [(60.0, 8), (40.0, 8), (30.0, 8)] {
        for seed in 0..seeds {
            let shift = 0.02 * (f64::from(seed) / 4.0 - 1.0);
            let modes = five_modes(shift);
            let found = readings(
                &modes,
                &blocks_of_2048(noise_db),
                u64::from(seed as u32),
                |s| {
                    s.block = Some(2048);
                },
            );
            assert_eq!(found.len(), 5, "{noise_db} dB, seed {seed}: {found:?}");
            for (mode, limit) in modes.iter().zip(at_60_db) {
                let reading = nearest(&found, mode.frequency);
                assert_eq!(
                    reading.source,
                    ReadBy::Fit,
                    "{noise_db} dB {}",
                    mode.frequency
                );
                let error = (reading.frequency - mode.frequency).abs();
                let limit = limit * 10f64.powf((60.0 - noise_db) / 20.0);
                assert!(
                    error < limit,
                    "{noise_db} dB, seed {seed}: {} Hz read as {} Hz, allowed {limit} Hz",
                    mode.frequency,
                    reading.frequency
                );
                let (low, high) = reading.interval;
                held += i32::from((low..=high).contains(&mode.frequency));
                all += 1;
            }
        }
    }
    // 95 % of 120, less three standard deviations of a binomial count (2.4).
    assert!(held >= 107, "{held} of {all} intervals hold the truth");
}

#[test]
fn prop_an_exponential_window_of_the_spectra_leaves_the_fits_alone() {
    let modes = five_modes(0.0);
    let settings = blocks_of_2048(60.0);
    let fit = |window| {
        readings(&modes, &settings, 5, |s| {
            s.block = Some(2048);
            s.window = window;
        })
    };
    let plain = fit(Some(tapjoint::description::WindowKind::Rectangular));
    let windowed = fit(Some(tapjoint::description::WindowKind::Exponential));
    for (mode, limit) in modes.iter().zip([0.02, 0.01, 0.01, 0.01, 0.01]) {
        let (a, b) = (
            nearest(&plain, mode.frequency),
            nearest(&windowed, mode.frequency),
        );
        // Starts differ, the fitted decays do not: what is left is where the search stops.
        let change = (a.frequency - b.frequency).abs();
        assert!(
            change < 0.1 * a.std.unwrap(),
            "{} Hz moves by {change} Hz",
            mode.frequency
        );
        let damping = b.damping_ratio.unwrap();
        let error = (damping / mode.damping_ratio - 1.0).abs();
        assert!(error < limit, "{} Hz: damping {damping}", mode.frequency);
    }
}

#[test]
fn recover_two_modes_closer_than_their_width() {
    let close = |frequency, sensors: [f64; 2]| SimulatedMode {
        frequency,
        damping_ratio: 0.002,
        shape_at_tap: 1.0,
        shape_at_sensors: sensors.to_vec(),
    };
    let settings = TapTestSettings {
        sample_rate: 1024.0,
        interval: 4.1,
        signal_to_noise_db: 45.0,
        ..Default::default()
    };
    for seed in 0..6 {
        let offset = 0.03 * seed as f64;
        let modes = [
            close(124.8 + offset, [0.9, 0.6]),
            close(125.2 + offset, [0.7, -0.8]),
        ];
        let found = readings(&modes, &settings, seed, |_| {});
        assert_eq!(found.len(), 2, "seed {seed}: {found:?}");
        for (mode, reading) in modes.iter().zip(&found) {
            let error = (reading.frequency - mode.frequency).abs();
            // A tenth of their distance: confusion would cost far more.
            assert!(
                error < 0.04,
                "seed {seed}: {} Hz as {}",
                mode.frequency,
                reading.frequency
            );
        }
    }
}

#[test]
fn limit_one_mode_whose_frequency_drifts_while_it_rings_stays_one() {
    // x = e^{-s t} sin(phase), the frequency rising by 0.3 Hz as the amplitude falls: what a joint that
    // slips does. Two poles of one shape would mend the fit.
    let rate = 2000.0;
    let mut samples = vec![0.0; 1000];
    let mut phase = 0.0;
    for n in 0..16_000 {
        let amplitude = 10.0 * (-2.0 * f64::from(n) / rate).exp();
        phase += TAU * (80.5 - 0.03 * amplitude) / rate;
        samples.push(amplitude * phase.sin());
    }
    let noisy = samples
        .iter()
        .enumerate()
        .map(|(n, x)| x + 1e-3 * ((n * 7919) % 1009) as f64 / 1009.0);
    let channel = Channel {
        samples: noisy.collect(),
        ..Default::default()
    };
    let recording = Recording::from_samples("drifting", rate, vec![channel]).unwrap();
    let found = measure_bare(recording, None, |_| {}).unwrap();
    let readings = found.measurement.spectra.unwrap().readings;
    let near = readings
        .iter()
        .filter(|r| r.label.is_none() && (r.frequency - 80.4).abs() < 3.0);
    assert_eq!(near.count(), 1, "{readings:?}");
}

#[test]
fn prop_a_reading_on_the_line_is_there_when_asked_for() {
    let modes = five_modes(0.0);
    let found = readings(&modes, &blocks_of_2048(60.0), 3, |s| {
        s.block = Some(2048);
        s.reading = ReadBy::Line;
    });
    for mode in &modes {
        let reading = nearest(&found, mode.frequency);
        assert_eq!(reading.source, ReadBy::Line);
        assert_eq!(reading.frequency, reading.line_frequency);
        assert!(
            (reading.frequency - mode.frequency).abs() <= 0.5 + 1e-9,
            "{reading:?}"
        );
        assert!(reading.fit.is_some(), "the fit is shown beside");
    }
}

/// Receptances of two modes at three places, on 4000 lines.
fn functions(constants: [[f64; 3]; 2]) -> FrequencyResponses {
    let spacing = 0.05;
    let value = |place: usize, frequency: f64| {
        let omega = TAU * frequency;
        let mode = |(own, damping, constant): (f64, f64, f64)| {
            let own = TAU * own;
            constant / Complex64::new(own * own - omega * omega, 2.0 * damping * own * omega)
        };
        let accelerance = -omega * omega;
        accelerance
            * (mode((61.2, 0.002, constants[0][place])) + mode((143.7, 0.001, constants[1][place])))
    };
    let response = |place: usize| FrequencyResponse {
        name: format!("place {place}"),
        response: Point {
            node: 1 + place as i64,
            direction: 3,
            ..Default::default()
        },
        form: Some(ResponseForm::Accelerance),
        values: (0..4000)
            .map(|line| value(place, f64::from(line) * spacing))
            .collect(),
        ..Default::default()
    };
    FrequencyResponses {
        file: "functions.uff".into(),
        first_frequency: 0.0,
        spacing,
        lines: 4000,
        has_phase: true,
        responses: (0..3).map(response).collect(),
        warnings: Vec::new(),
    }
}

#[test]
fn recover_modes_and_constants_from_a_file_of_functions() {
    let constants = [[1.2, 0.7, -0.4], [0.8, -0.9, 1.1]];
    let folder = tempfile::tempdir().unwrap();
    let bytes = encode_frequency_responses_uff(&functions(constants), UffFormat::Binary).unwrap();
    std::fs::write(folder.path().join("functions.uff"), bytes).unwrap();
    let text = "[beam]\nlength = 1.0\nwidth = 0.05\nthickness = 0.01\nmodulus = 2e11\ndensity = 7850\n\
                [joint]\nkind = \"free\"\n[[sensor]]\nname = \"A\"\nposition = 0.1\n\
                [[recording]]\nfile = \"functions.uff\"\nform = \"accelerance\"\n";
    let test = TestDescription::parse(text, "test.toml").unwrap();
    let analysis = run_test(
        &test,
        (folder.path(), "test.toml"),
        &IdentifySettings::default(),
    )
    .unwrap();
    let recording = &analysis.recordings[0];
    assert_eq!(
        recording.sample_rate, None,
        "functions have no samples in time"
    );
    let readings = &recording.measurement.spectra.as_ref().unwrap().readings;
    let truth = [(61.2, 0.002), (143.7, 0.001)];
    for ((frequency, damping), constants) in truth.into_iter().zip(constants) {
        let reading = nearest(readings, frequency);
        // Without noise the header's seven digits of the line spacing limit the frequency.
        let error = (reading.frequency / frequency - 1.0).abs();
        assert!(error < 1e-6, "{frequency} Hz as {}", reading.frequency);
        let damping_error = (reading.damping_ratio.unwrap() / damping - 1.0).abs();
        assert!(damping_error < 1e-3, "{reading:?}");
        let found = &reading.fit.as_ref().unwrap().constants;
        assert_eq!(found.len(), 3, "one constant for each function");
        for (constant, truth) in found.iter().zip(constants) {
            // The other mode's mass line is a polynomial over the band, to about this share.
            let error = (constant.value - truth).abs();
            assert!(error < 2e-3, "{constant:?} for {truth}");
        }
    }
}

#[test]
fn recover_the_bound_of_a_line_over_a_wide_resonance() {
    // Half of the half-power width is 2.6 to 26 Hz, and a line 0.15 Hz: noise chooses among tens of lines.
    let (mut held, mut all) = (0, 0);
    for seed in 0..25 {
        let shift = 0.02 * (f64::from(seed) / 12.5 - 1.0);
        let mut modes = five_modes(shift);
        modes.retain(|mode| mode.frequency > 100.0 && mode.frequency < 400.0);
        for mode in &mut modes {
            mode.damping_ratio *= 8.0;
        }
        let seed = u64::from(seed as u32);
        let found = readings(&modes, &blocks_of_2048(35.0), seed, |s| {
            s.reading = ReadBy::Line;
        });
        for mode in &modes {
            let reading = nearest(&found, mode.frequency);
            let (low, high) = reading.interval;
            held += i32::from((low..=high).contains(&mode.frequency));
            all += 1;
            // No longer than the half-power width and a line.
            let width = 2.0 * mode.damping_ratio * mode.frequency;
            assert!(high - low < 1.3 * width + 2.0 * reading.half_line);
        }
    }
    // A bound, not an interval: it shall hold nearly always.
    assert!(held * 100 >= 97 * all, "{held} of {all}");
}
