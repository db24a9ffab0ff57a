//! What a test observed: levels, frequencies with their uncertainty, shapes, changes along the decay,
//! from virtual tests whose answer is known.

use statrs::distribution::{ContinuousCDF, StudentsT};
use tapjoint::description::{ChannelRef, SensorKind, TestDescription};
use tapjoint::identify::observation::{Configuration, Observations, UNCLEAR};
use tapjoint::modal::PeakLabel;
use tapjoint::pipeline::{
    Analysis, IdentifySettings, RecordingResult, measure_bare, observations, run_test,
    tested_structure,
};
use tapjoint::recording::{Channel, Recording, ResponseForm};
use tapjoint::simulate::{SimulatedMode, TapTest, TapTestSettings, simulate_tap_test};

const MODES: [(f64, f64, f64, [f64; 2]); 3] = [
    (42.7, 0.012, 0.7, [0.8, 0.5]),
    (118.3, 0.006, -0.9, [0.5, -0.7]),
    (231.9, 0.006, 0.6, [-0.35, 0.6]),
];

fn modes(factors: [f64; 3]) -> Vec<SimulatedMode> {
    let mode = |((frequency, damping_ratio, tap, sensors), factor): (_, f64)| {
        let (frequency, sensors): (f64, [f64; 2]) = (frequency, sensors);
        SimulatedMode {
            frequency: frequency * factor,
            damping_ratio,
            shape_at_tap: tap,
            shape_at_sensors: sensors.to_vec(),
        }
    };
    MODES.into_iter().zip(factors).map(mode).collect()
}

fn settings(taps: usize, peak_force: f64) -> TapTestSettings {
    TapTestSettings {
        sample_rate: 1024.0,
        taps,
        interval: 2.5,
        peak_force,
        pulse: 3e-3,
        signal_to_noise_db: 30.0,
        ..Default::default()
    }
}

/// One test after the other, in one recording.
fn joined(tests: &[TapTest]) -> TapTest {
    let mut all = tests[0].clone();
    for test in &tests[1..] {
        all.force.extend(&test.force);
        for (response, more) in all.responses.iter_mut().zip(&test.responses) {
            response.extend(more);
        }
    }
    all
}

/// The recording of a test, every reading numbered by the nearest true mode.
fn measured(test: &TapTest, file: &str) -> RecordingResult {
    let channel = |samples| Channel {
        samples,
        ..Default::default()
    };
    let channels = test.channels(1.0, 1.0).into_iter().map(channel).collect();
    let recording = Recording::from_samples(file, test.sample_rate, channels).unwrap();
    let hammer = ChannelRef::Number(1);
    let kinds = vec![Some(ResponseForm::Accelerance); 2];
    let mut found = measure_bare(recording, Some(&hammer), |s| s.kinds = kinds).unwrap();
    for response in &mut found.responses {
        response.kind = Some(SensorKind::Acceleration);
    }
    let readings = &found.measurement.spectra.as_ref().unwrap().readings;
    found.mode_numbers = readings
        .iter()
        .map(|reading| {
            let near = |mode: &(f64, f64, f64, [f64; 2])| {
                (reading.frequency / mode.0 - 1.0).abs() < 0.03 && reading.label.is_none()
            };
            MODES.iter().position(near).map(|index| index + 1)
        })
        .collect();
    found
}

const CANTILEVER: &str = r#"
[beam]
length = 0.4
width = 0.05
thickness = 0.005
modulus = "207 GPa"
density = 7850
[joint]
kind = "cantilever"
"#;

fn observed(recordings: Vec<RecordingResult>) -> Observations {
    let text = format!("{CANTILEVER}[measured]\nfrequencies = [17]\n");
    let description = TestDescription::parse(&text, "test.toml").unwrap();
    observations(&Analysis {
        name: "virtual".to_string(),
        file: None,
        structure: Some(tested_structure(&description)),
        aside: vec![None; recordings.len()],
        recordings,
        modes: Vec::new(),
        lengths: Vec::new(),
        free_test: None,
        identification: None,
        verdicts: Vec::new(),
        warnings: Vec::new(),
    })
}

/// Five taps, the structure's frequencies differing from tap to tap by these factors.
fn five_taps(factors: impl Fn(u64) -> [f64; 3], seed: u64) -> Configuration {
    let tests: Vec<TapTest> = (0..5)
        .map(|tap| simulate_tap_test(&modes(factors(tap)), &settings(1, 50.0), 10 * seed + tap))
        .collect();
    let found = observed(vec![measured(&joined(&tests), "virtual")]);
    assert_eq!(found.configurations.len(), 1);
    found.configurations.into_iter().next().unwrap()
}

/// Errors over their stated standard uncertainties.
#[derive(Default)]
struct Score {
    errors: Vec<f64>,
    stds: Vec<f64>,
    held: usize,
}

impl Score {
    fn add(&mut self, error: f64, std: f64, freedom: Option<f64>) {
        let quantile = freedom.map_or(1.96, |freedom| {
            let student = StudentsT::new(0.0, 1.0, freedom).unwrap();
            student.inverse_cdf(0.975)
        });
        self.held += usize::from(error.abs() <= quantile * std);
        self.errors.push(error);
        self.stds.push(std);
    }

    fn coverage(&self) -> f64 {
        self.held as f64 / self.errors.len() as f64
    }

    /// Root mean square of the stated over that of the true errors.
    fn ratio(&self) -> f64 {
        let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
        (square(&self.stds) / square(&self.errors)).sqrt()
    }

    fn assert_fair(&self, what: &str) {
        let (coverage, ratio) = (self.coverage(), self.ratio());
        let count = self.errors.len() as f64;
        eprintln!("{what}: {coverage:.3} held, std {ratio:.3} of the scatter, {count} values");
        // Three standard deviations of a binomial count about 95 %.
        let room = 3.0 * (0.95 * 0.05 / count).sqrt();
        assert!((coverage - 0.95).abs() < room, "{what}: {coverage} held");
        // A tenth, and what the scatter of a standard deviation from so many values is.
        let room = 0.1 + 2.0 / (2.0 * count).sqrt();
        assert!((ratio - 1.0).abs() < room, "{what}: std {ratio}");
    }
}

const SEEDS: u64 = 24;

#[test]
fn recover_frequencies_shapes_and_slopes_within_their_uncertainty() {
    let [mut frequency, mut damping, mut shape, mut slope, mut change] =
        [(); 5].map(|()| Score::default());
    for seed in 0..SEEDS {
        let found = five_taps(|_| [1.0; 3], seed);
        assert_eq!((found.modes.len(), found.taps), (3, 5), "seed {seed}");
        for (mode, truth) in found.modes.iter().zip(MODES) {
            frequency.add(
                (mode.frequency - truth.0) / truth.0,
                mode.std.unwrap() / truth.0,
                mode.freedom,
            );
            let seen = mode.damping.unwrap();
            damping.add(seen.value - truth.1, seen.std, seen.freedom);
            let reference = mode.reference.unwrap();
            for value in mode.shape.iter().filter(|v| v.sensor != reference) {
                let expected = truth.3[value.sensor] / truth.3[reference];
                shape.add(value.value - expected, value.std, None);
            }
            if let Some(decay) = &mode.decay {
                let seen = decay.frequency_slope;
                slope.add(seen.value / truth.0, seen.std / truth.0, seen.freedom);
                let seen = decay.frequency_change.unwrap();
                change.add(seen.value / truth.0, seen.std / truth.0, seen.freedom);
            }
        }
    }
    frequency.assert_fair("frequency");
    damping.assert_fair("damping");
    shape.assert_fair("shape");
    slope.assert_fair("slope");
    change.assert_fair("change");
}

#[test]
fn recover_the_scatter_of_a_structure_that_differs_from_tap_to_tap() {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let mut score = Score::default();
    let (mut together, mut apart, mut seen) = (0.0, 0.0, 0);
    for seed in 0..SEEDS {
        // Common scatter of the first two modes, 0.1 %: many times the noise; the third stands still.
        let draws: Vec<f64> = (0..5).map(|_| StandardNormal.sample(&mut random)).collect();
        let found = five_taps(
            |tap| {
                let common = 1.0 + 0.001 * draws[tap as usize];
                [common, common, 1.0]
            },
            seed,
        );
        let covariance = found.covariance.as_ref().unwrap();
        for (index, (mode, truth)) in found.modes.iter().zip(MODES).enumerate().take(2) {
            seen += usize::from(mode.freedom == Some(4.0));
            let variance = covariance[index][index];
            assert!((variance - mode.std.unwrap().powi(2)).abs() < 1e-12 * variance);
            score.add(
                (mode.frequency - truth.0) / truth.0,
                mode.std.unwrap() / truth.0,
                mode.freedom,
            );
        }
        let correlation =
            |i: usize, j: usize| covariance[i][j] / (covariance[i][i] * covariance[j][j]).sqrt();
        together += correlation(0, 1) / SEEDS as f64;
        apart += correlation(0, 2).abs() / SEEDS as f64;
    }
    score.assert_fair("scattering taps");
    // Five draws may lie together by chance: one in twenty within a third of their scatter.
    assert!(seen as f64 > 0.9 * 2.0 * SEEDS as f64, "{seen}");
    // One factor moves both; shrinkage takes a tenth at least. Five taps of a mode that stands still
    // count as scattered one time in twenty, and then correlate by chance.
    assert!(together > 0.7 && apart < 0.3, "{together} {apart}");
}

#[test]
fn recover_the_levels_between_recordings_and_within_one() {
    let hard = simulate_tap_test(&modes([1.0; 3]), &settings(4, 80.0), 3);
    let soft = simulate_tap_test(&modes([1.0; 3]), &settings(4, 20.0), 3);
    let level = |found: &Observations| -> Vec<f64> {
        let levels = found.configurations.iter().map(|c| c.level.unwrap());
        levels.collect()
    };
    let two = observed(vec![measured(&hard, "hard"), measured(&soft, "soft")]);
    let one = observed(vec![measured(&joined(&[soft, hard]), "both")]);
    for found in [&two, &one] {
        // The same draws at a quarter of the force; 2 %: the noise of a peak.
        let levels = level(found);
        assert_eq!(levels.len(), 2, "{levels:?}");
        assert_eq!(levels[0], 1.0);
        assert!((levels[1] / 0.25 - 1.0).abs() < 0.02, "{levels:?}");
        for configuration in &found.configurations {
            assert_eq!((configuration.taps, configuration.modes.len()), (4, 3));
        }
        // A linear structure's amplitudes go with the level.
        for number in 1..=3 {
            let of = |index: usize| found.configurations[index].mode(number).unwrap();
            let ratio = of(1).amplitude.unwrap() / of(0).amplitude.unwrap();
            assert!((ratio / 0.25 - 1.0).abs() < 0.02, "mode {number}: {ratio}");
        }
    }
}

#[test]
fn recover_the_amplitude_in_metres() {
    // A pulse F(t) much shorter than a period leaves the displacement phi_s phi_t I/omega e^{-zeta omega t},
    // I its impulse; peak and length vary by seed, so that the force is summed. The decay that is fitted
    // begins when the pulse has surely ended.
    let test = simulate_tap_test(&modes([1.0; 3]), &settings(1, 50.0), 11);
    let impulse: f64 = test.force[..600].iter().sum::<f64>() / test.sample_rate;
    let recording = measured(&test, "one tap");
    let tap = recording.measurement.taps.taps[0].clone();
    let begin = tap.pulse_end.unwrap() as f64 / test.sample_rate - tap.time;
    let found = observed(vec![recording]);
    let configuration = &found.configurations[0];
    let mode = &configuration.modes[0];
    assert_eq!(mode.repeats, 1);
    assert_eq!(mode.reference, Some(0));
    let omega = std::f64::consts::TAU * 42.7;
    let expected = 0.8 * 0.7 * impulse / omega * (-0.012 * omega * begin).exp();
    let amplitude = mode.amplitude.unwrap();
    // The pulse is an eighth of the period long, which takes 3 % of its effect, and the trigger is good to
    // 2 ms (1 %).
    assert!(
        (amplitude / expected - 1.0).abs() < 0.06,
        "{amplitude} {expected}"
    );
    let constant = mode.constant.unwrap();
    assert!(
        (constant.value - 0.56).abs() < 5.0 * constant.std + 0.003,
        "{constant:?}"
    );
    let decay = mode.decay.unwrap();
    // The curve begins half a filter and half a segment later, 0.2 decay times and more.
    let early = decay.early.amplitude.unwrap();
    assert!(
        early < amplitude && early > 0.4 * amplitude,
        "{early} {amplitude}"
    );
    assert!(decay.late.amplitude.unwrap() < 0.5 * early);
}

#[test]
fn regress_frequencies_read_elsewhere_keep_their_stated_uncertainty() {
    let text = format!(
        "name = \"x\"\n{CANTILEVER}[measured]\nfrequencies = [17, 118, 335.625]\nmodes = [1, 2, 4]\n\
         half_line = 0.125\nscatter = \"0.3 %\"\n"
    );
    let test = TestDescription::parse(&text, "test.toml").unwrap();
    let here = (std::path::Path::new("."), "test.toml");
    let analysis = run_test(&test, here, &IdentifySettings::default()).unwrap();
    let found = observations(&analysis);
    let [configuration] = &found.configurations[..] else {
        panic!("{found:?}");
    };
    let numbers: Vec<usize> = configuration.modes.iter().map(|mode| mode.mode).collect();
    assert_eq!(numbers, [1, 2, 4]);
    let covariance = configuration.covariance.clone().unwrap();
    // half_line^2/3 + (scatter f)^2.
    let expected = 0.125f64.powi(2) / 3.0 + (0.003f64 * 118.0).powi(2);
    assert!((covariance[1][1] / expected - 1.0).abs() < 1e-12);
    assert_eq!(covariance[0][1], 0.0);
    assert_eq!(
        (configuration.taps, configuration.modes[0].freedom),
        (0, None)
    );
}

/// The diagnosis knows peaks by the words that the measurement gives them.
#[test]
fn val_an_unclear_peak_is_called_the_same_on_both_sides() {
    assert_eq!(PeakLabel::NoResonance.to_string(), UNCLEAR);
}
