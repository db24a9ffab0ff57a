//! The whole chain on virtual tests whose answer is known.

use crate::shared::steel_strip;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tapjoint::description::{ChannelRef, FitParameter, TestDescription, WindowKind};
use tapjoint::identify::consistent::{FrequencyModel, JointedStructure, LapLayout, Quantity};
use tapjoint::identify::{PairsModel, Stiffnesses};
use tapjoint::pipeline::{
    Analysis, Estimate, EstimateMethod, Identification, IdentifySettings, KnownJoint, ModeResult,
    StructureDetails, TestedStructure, Warning, identify, measure_bare, modes_of_recordings,
    run_test,
};
use tapjoint::recording::{Channel, Recording};
use tapjoint::simulate::{TapTestSettings, observed_modes, simulate_tap_test};
use tapjoint::spectral::MOST_BLOCK;
use tapjoint::structure::specimen::{LapOverlap, PointMass};
use tapjoint::structure::{Assembly, Beam, BeamTheory, JointStiffness, mode_shapes};

const KX: f64 = 1400.0;
const KY: f64 = 4.8;

/// A virtual test of the sample cantilever: its own frequencies, and what the chain finds.
struct VirtualTest {
    truth: Vec<f64>,
    modes: Vec<ModeResult>,
    found: Identification,
}

/// The cantilever of the sample, a little longer or shorter by seed, so that its frequencies fall
/// anywhere between two lines; two bands of 2048 samples, five taps each, 60 dB.
fn virtual_test(seed: u64) -> VirtualTest {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let beam = Beam {
        length: 0.423 * (1.0 + random.random_range(-0.02..0.02)),
        ..steel_strip()
    };
    let joint = JointStiffness::two_parameter(KX, KY);
    let shapes = mode_shapes(&beam, Assembly::Cantilever, &joint, 8).unwrap();
    let damping = [0.012, 0.009, 0.005, 0.004];
    let positions = (0.385, [0.338, 0.205]);
    let bands = [
        (2560.0, 3e-3, (0.0, 200.0)),
        (5120.0, 1e-3, (200.0, 1050.0)),
    ];
    let mut recordings: Vec<_> = bands
        .iter()
        .zip(0u64..)
        .map(|(&(sample_rate, pulse, band), number)| {
            let settings = TapTestSettings {
                sample_rate,
                pulse,
                ..Default::default()
            };
            let seen = observed_modes(
                &shapes,
                &damping,
                positions.0,
                &positions.1,
                0.45 * sample_rate,
            );
            let test = simulate_tap_test(&seen, &settings, 2 * seed + number);
            let channels = test.channels(1.0, 1.0);
            let channel = |samples| Channel {
                samples,
                ..Default::default()
            };
            let channels = channels.into_iter().map(channel).collect();
            let recording = Recording::from_samples("virtual", sample_rate, channels).unwrap();
            let hammer = ChannelRef::Number(1);
            measure_bare(recording, Some(&hammer), |settings| {
                settings.band = Some(band);
                settings.block = Some(2048);
            })
            .unwrap()
        })
        .collect();
    let structure = TestedStructure {
        beam,
        assembly: Assembly::Cantilever,
        theory: BeamTheory::Euler,
        regression: Some(PairsModel::TwoParameter),
        known: KnownJoint::default(),
    };
    let (modes, _) = modes_of_recordings(
        &mut recordings,
        &[0, 1],
        &structure,
        &StructureDetails::default(),
    );
    let (found, _) = identify(&structure, &modes, &IdentifySettings::default());
    let truth = shapes.iter().map(|shape| shape.frequency).collect();
    VirtualTest {
        truth,
        modes,
        found,
    }
}

fn share(flags: impl Iterator<Item = bool>) -> f64 {
    let flags: Vec<bool> = flags.collect();
    flags.iter().filter(|&&flag| flag).count() as f64 / flags.len() as f64
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn recover_frequencies_and_joint_over_200_virtual_tests() {
    let tests: Vec<VirtualTest> = (0..200u64).into_par_iter().map(virtual_test).collect();
    // (error on the line in half lines, error between the lines in bounds)
    let mut readings = Vec::new();
    for (seed, test) in tests.iter().enumerate() {
        let numbered: Vec<&ModeResult> = test
            .modes
            .iter()
            .filter(|mode| mode.mode.is_some())
            .collect();
        assert_eq!(numbered.len(), 5, "seed {seed}: {:?}", test.modes);
        for (mode, truth) in numbered.iter().zip(&test.truth) {
            let reading = mode.reading.as_ref().unwrap();
            // The claim is for peaks at least 40 dB above the noise; here all are.
            assert!(
                reading.above_noise_db.unwrap() >= 40.0,
                "seed {seed}: {truth} Hz"
            );
            let line = (reading.line_frequency - truth).abs() / reading.half_line;
            let between = reading.between.unwrap();
            let between = (between.frequency - truth).abs() / between.bound;
            readings.push((line, between));
        }
    }
    let within = share(readings.iter().map(|(line, _)| *line <= 1.0));
    let worst = readings.iter().map(|(line, _)| *line).fold(0.0, f64::max);
    assert!(
        within >= 0.98,
        "{:.1} % within the half line",
        100.0 * within
    );
    assert!(
        worst <= 1.5,
        "the worst reading is off by {:.2} lines",
        worst / 2.0
    );
    let covered = share(readings.iter().map(|(_, between)| *between <= 1.0));
    let estimates: Vec<Stiffnesses> = tests.iter().map(stiffnesses).collect();
    let error = |pick: fn(&Stiffnesses) -> f64, truth: f64| {
        median(
            estimates
                .iter()
                .map(|e| (pick(e) / truth - 1.0).abs())
                .collect(),
        )
    };
    let (kx, ky) = (error(|e| e.kx, KX), error(|e| e.ky, KY));
    assert!(kx < 0.05 && ky < 0.05, "median errors: Kx {kx}, Ky {ky}");
    let spanned = share(tests.iter().map(span_holds_the_truth));
    println!(
        "{} readings: {:.1} % within the half line, the worst off by {:.2} lines, {:.1} % within \
         the bound between the lines; median error of Kx {kx:.1e}, of Ky {ky:.1e}; {:.1} % of the \
         spans hold the truth",
        readings.len(),
        100.0 * within,
        worst / 2.0,
        100.0 * covered,
        100.0 * spanned
    );
    assert!(
        spanned >= 0.98,
        "{:.1} % of the spans hold the truth",
        100.0 * spanned
    );
    // A bound of about 95 %: of 1000 readings 93 % is three standard deviations below that.
    assert!(covered >= 0.93, "{:.1} % within the bound", 100.0 * covered);
}

fn stiffnesses(test: &VirtualTest) -> Stiffnesses {
    match &test.found.estimate {
        Some(Estimate::Joint(joint)) => joint.pairs.stiffnesses().unwrap(),
        other => panic!("no joint: {other:?}, {:?}", test.found.reason),
    }
}

fn span_holds_the_truth(test: &VirtualTest) -> bool {
    let mut spans = test.found.perturbations.spans.iter();
    let spans = spans.find(|spans| spans.method == EstimateMethod::Pairs);
    let spans = spans.unwrap();
    let ([kx_low, kx_high], [ky_low, ky_high]) = (spans.kx.unwrap(), spans.ky.unwrap());
    (kx_low..=kx_high).contains(&KX) && (ky_low..=ky_high).contains(&KY)
}

#[test]
fn prop_a_sensitivity_is_per_volt_whatever_the_header_says() {
    let folder = tempfile::tempdir().unwrap();
    let shapes = mode_shapes(
        &steel_strip(),
        Assembly::Cantilever,
        &JointStiffness::two_parameter(KX, KY),
        4,
    )
    .unwrap();
    let seen = observed_modes(&shapes, &[0.02], 0.385, &[0.338], 900.0);
    let settings = TapTestSettings {
        sample_rate: 2048.0,
        taps: 2,
        interval: 2.0,
        pulse: 3e-3,
        ..Default::default()
    };
    let test = simulate_tap_test(&seen, &settings, 5);
    // 100 mV/g: one m/s2 is 10.197 mV.
    let level = |header: &str, factor: f64| {
        let mut text = format!("time (s),force (N),a ({header})\n");
        for (n, (force, a)) in test.force.iter().zip(&test.responses[0]).enumerate() {
            let volts = a * 0.1 / 9.80665;
            text += &format!(
                "{:.9},{force:.9},{:.9}\n",
                n as f64 / 2048.0,
                volts * factor
            );
        }
        std::fs::write(folder.path().join("taps.csv"), text).unwrap();
        let description = "
            [beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850
            [joint]\nkind = \"cantilever\"
            [hammer]\nchannel = \"force\"
            [[sensor]]\nname = \"A\"\nchannel = \"a\"\nsensitivity = \"100 mV/g\"\nposition = 0.338
            [[recording]]\nfile = \"taps.csv\"";
        let test = TestDescription::parse(description, "test.toml").unwrap();
        let found = run_test(&test, (folder.path(), "test.toml"), &Default::default()).unwrap();
        let spectra = found.recordings[0].measurement.spectra.clone().unwrap();
        let h1 = spectra.averages.h1.unwrap();
        h1[0].iter().map(|h| h.norm()).fold(0.0, f64::max)
    };
    let (volts, millivolts) = (level("V", 1.0), level("mV", 1000.0));
    // This signal, printed to nine decimals of volts.
    assert!(
        (volts / millivolts - 1.0).abs() < 1e-4,
        "{volts} and {millivolts}"
    );
    let mode = &seen[1];
    let expected = mode.shape_at_tap * mode.shape_at_sensors[0] / (2.0 * mode.damping_ratio);
    // The highest peak stands near a single mode's phi phi/(2 zeta), give or take its neighbours.
    assert!(
        volts > 0.3 * expected.abs() && volts < 10.0 * expected.abs(),
        "{volts}, {expected}"
    );
}

/// One tap of a 40 Hz structure at 2 kHz with so many seconds of ringing after it.
fn one_tap(seconds: f64) -> Recording {
    let mode = tapjoint::simulate::SimulatedMode {
        frequency: 40.0,
        damping_ratio: 0.01,
        shape_at_tap: 1.0,
        shape_at_sensors: vec![1.0],
    };
    let settings = TapTestSettings {
        sample_rate: 2000.0,
        taps: 1,
        interval: seconds,
        pulse: 4e-3,
        ..Default::default()
    };
    let test = simulate_tap_test(&[mode], &settings, 3);
    let channel = |samples| Channel {
        samples,
        ..Default::default()
    };
    let channels = test.channels(1.0, 1.0).into_iter().map(channel).collect();
    Recording::from_samples("one tap", 2000.0, channels).unwrap()
}

#[test]
fn limit_a_band_too_narrow_for_the_signal_is_refused() {
    let hammer = ChannelRef::Number(1);
    for width in [1e-6, 1e-3, 0.5] {
        let error = measure_bare(one_tap(5.0), Some(&hammer), |settings| {
            settings.band = Some((0.0, width));
        })
        .unwrap_err()
        .to_string();
        assert!(error.contains("too narrow"), "{width} Hz: {error}");
    }
    // Sixteen samples at the zoomed rate of 2.56 widths: 5 s resolve a band of 1.3 Hz.
    let found = measure_bare(one_tap(5.0), Some(&hammer), |settings| {
        settings.band = Some((39.0, 41.0));
    });
    assert!(found.unwrap().measurement.spectra.is_some());
}

#[test]
fn regress_a_block_of_zeros_for_the_most_part_is_refused() {
    let hammer = ChannelRef::Number(1);
    // 10,000 samples at 2 kHz; without a band the block is for 2.56/2.56 of them.
    let error = measure_bare(one_tap(5.0), Some(&hammer), |settings| {
        settings.block = Some(200_000);
    });
    let error = error.unwrap_err().to_string();
    assert!(error.contains("the rest would be zeros"), "{error}");
    let found = measure_bare(one_tap(5.0), Some(&hammer), |settings| {
        settings.block = Some(10_000);
    });
    assert!(found.unwrap().measurement.spectra.is_some());
}

#[test]
fn limit_one_tap_in_a_long_recording_takes_the_largest_block() {
    // 700 s at 2 kHz are 1.4 million samples, more than a block may have.
    let hammer = ChannelRef::Number(1);
    let found = measure_bare(one_tap(700.0), Some(&hammer), |_| {}).unwrap();
    let lines = found.measurement.spectra.unwrap().averages.lines;
    assert!(
        lines.block <= MOST_BLOCK && lines.block > MOST_BLOCK / 10 * 9,
        "{}",
        lines.block
    );
}

#[test]
fn recover_the_change_of_h1_by_the_force_window() {
    let clean = one_tap(5.0);
    let channels = |share: f64| {
        let [mut force, response] =
            [0, 1].map(|channel| clean.read(channel, 0..clean.frames()).unwrap());
        let first = (0..force.len()).find(|&n| force[n] > 0.2).unwrap() - 4;
        // A weaker copy of the pulse after half a second: far outside the window, and too weak for a second hit.
        for n in 0..20 {
            force[first + 1000 + n] += share * force[first + n];
        }
        [force, response].map(|samples| Channel {
            samples,
            ..Default::default()
        })
    };
    // H1 with the window is (1 + share e^(-i w t)) times that without it.
    for share in [0.0, 0.01, 0.03] {
        let recording = Recording::from_samples("copy", 2000.0, channels(share).into()).unwrap();
        let hammer = ChannelRef::Number(1);
        let found = measure_bare(recording, Some(&hammer), |settings| {
            settings.window = Some(WindowKind::Rectangular);
        });
        let window = found.unwrap().measurement.spectra.unwrap().force_window;
        let window = window.expect("there is a hammer");
        let change = window.h1_change.expect("there is a mode");
        assert!((change - share).abs() < 5e-3, "{share}: {window:?}");
        assert!((4e-3..20e-3).contains(&window.length), "{window:?}");
    }
}

#[test]
fn limit_there_is_no_force_window_without_a_hammer() {
    let found = measure_bare(one_tap(5.0), None, |_| {}).unwrap();
    assert_eq!(found.measurement.taps.mean_pulse(), None);
    assert_eq!(found.measurement.spectra.unwrap().force_window, None);
}

/// Frequencies (Hz) of the first modes of a structure with this joint, Kt (N/m) and Kr (N m/rad).
fn frequencies_of(structure: &JointedStructure, (kt, kr): (f64, f64), count: usize) -> Vec<f64> {
    let model = FrequencyModel::new(structure, count).unwrap();
    let mut point = model.nominal();
    point[0] = f64::ln(kt);
    point[1] = f64::ln(kr);
    (1..=count)
        .map(|mode| model.response(&point, mode, mode as f64).frequency)
        .collect()
}

/// What the chain makes of a description with these frequencies at its end.
fn identified(description: &str, frequencies: &[f64], more: &str) -> Analysis {
    let list: Vec<String> = frequencies.iter().map(f64::to_string).collect();
    let text = format!(
        "{description}\n[measured]\nfrequencies = [{}]\n{more}",
        list.join(",")
    );
    let test = TestDescription::parse(&text, "test.toml").unwrap();
    let place = (std::path::Path::new("."), "test.toml");
    run_test(&test, place, &IdentifySettings::default()).unwrap()
}

fn assert_recovered(analysis: &Analysis, wanted: &[(Quantity, f64)]) {
    let found = analysis.identification.as_ref().unwrap();
    let consistent = found.consistent.as_ref().unwrap();
    for &(quantity, truth) in wanted {
        let value = consistent.quantity(quantity).unwrap().value.unwrap();
        // Exact frequencies of the same model: rounding and the search's last step are left.
        assert!(
            (value / truth - 1.0).abs() < 1e-5,
            "{quantity:?}: {value} for {truth}"
        );
    }
    for mode in found
        .prediction
        .iter()
        .filter(|mode| mode.measured.is_some())
    {
        let error = mode.error_percent.unwrap();
        // The same model predicts, with as fine elements for one mode more: 1e-6 of a frequency.
        assert!(error.abs() < 1e-3, "{mode:?}");
    }
}

const SENSORS: &str = "
[[sensor]]
name = \"A\"
channel = 2
position = 0.338
mass = \"24 g\"
[[sensor]]
name = \"B\"
channel = 3
position = 0.2
mass = \"24 g\"
[[sensor]]
name = \"microphone\"
channel = 4
position = 0.1
mass = \"1 kg\"
kind = \"sound\"
";

#[test]
fn recover_a_joint_under_the_masses_of_its_sensors() {
    let beam = steel_strip();
    let mut structure = JointedStructure::new(BeamTheory::Timoshenko, beam, Assembly::Cantilever);
    structure.masses = [0.338, 0.2]
        .map(|position| PointMass {
            position,
            mass: 0.024,
            inertia: 0.0,
        })
        .to_vec();
    let (kt, kr) = (2.0e6, 1230.0);
    let frequencies = frequencies_of(&structure, (kt, kr), 5);
    let test = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9
        density = 7850\n[joint]\nkind = \"cantilever\"\n";
    let wanted = [(Quantity::Kt, kt), (Quantity::Kr, kr)];
    assert_recovered(
        &identified(&format!("{test}{SENSORS}"), &frequencies, ""),
        &wanted,
    );
    // Left out, 48 g on a beam of 830 g make the joint look much softer.
    let without = format!("{test}{SENSORS}[analysis]\nsensor_mass = false\n");
    let without = identified(&without, &frequencies, "");
    let found = without.identification.unwrap().consistent.unwrap();
    assert!(
        found.goodness.relative_misfit > 1e-3,
        "{:?}",
        found.goodness
    );
    // A known rotation and an unknown modulus.
    let known = format!("{test}kr = 1230\n{SENSORS}[analysis]\nfit = [\"kt\", \"modulus\"]\n");
    let wanted = [(Quantity::Kt, kt), (Quantity::Modulus, 207e9)];
    assert_recovered(&identified(&known, &frequencies, ""), &wanted);
}

#[test]
fn recover_an_uneven_lap_joint() {
    let beam = steel_strip();
    let mut structure = JointedStructure::new(BeamTheory::Timoshenko, beam, Assembly::Lap);
    structure.lap = LapLayout {
        position: Some(0.17),
        right: Some(Beam {
            thickness: 0.007,
            density: 2700.0,
            modulus: 70e9,
            ..beam
        }),
        overlap: Some(LapOverlap {
            length: 0.04,
            mass: 0.05,
        }),
    };
    let (kt, kr) = (5.0e5, 900.0);
    let frequencies = frequencies_of(&structure, (kt, kr), 5);
    let test = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9
        density = 7850\n[beam.right]\nthickness = 0.007\ndensity = 2700\nmodulus = 70e9
        [joint]\nkind = \"lap\"\nposition = 0.17\noverlap = { length = 0.04, mass = 0.05 }\n";
    let wanted = [(Quantity::Kt, kt), (Quantity::Kr, kr)];
    assert_recovered(&identified(test, &frequencies, ""), &wanted);
}

#[test]
fn regress_a_coarse_reading_does_not_hide_the_misfit_of_a_sharp_one() {
    let beam = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9
        density = 7850\n[joint]\nkind = \"cantilever\"\nkt = 2e6\nkr = 1230\n";
    let structure =
        JointedStructure::new(BeamTheory::Timoshenko, steel_strip(), Assembly::Cantilever);
    let mut frequencies = frequencies_of(&structure, (2e6, 1230.0), 4);
    let mut stds = frequencies.iter().map(|f| 1e-4 * f).collect::<Vec<f64>>();
    // Mode 2 misses by more, and well within what its reading allows.
    frequencies[1] *= 0.96;
    stds[1] = 0.03 * frequencies[1];
    frequencies[2] *= 0.97;
    let analysis = identified(beam, &frequencies, &format!("std = {stds:?}\n"));
    let mut misfits = analysis.warnings.iter();
    let misfit = misfits.find(|warning| warning.code == "prediction-error");
    let misfit = misfit.map(ToString::to_string).unwrap_or_default();
    assert!(misfit.contains("the model misses mode 3 by"), "{misfit}");
    assert!(misfits.all(|warning| warning.code != "prediction-error"));
}

/// The numbers of the peaks, and what is said of mode 1 (Hz), where only modes 2 to 4 were in the band of
/// a cantilever's recording.
fn without_mode_1(
    joint: &JointStiffness,
    known: [(PairsModel, KnownJoint, Option<Vec<FitParameter>>); 2],
) -> [(Vec<usize>, Option<f64>); 2] {
    let beam = steel_strip();
    let shapes = mode_shapes(&beam, Assembly::Cantilever, joint, 5).unwrap();
    let settings = TapTestSettings {
        sample_rate: 2560.0,
        pulse: 1e-3,
        taps: 2,
        ..Default::default()
    };
    let seen = observed_modes(&shapes, &[0.004], 0.4, &[0.42], 0.45 * 2560.0);
    let test = simulate_tap_test(&seen, &settings, 3);
    let channels = test.channels(1.0, 1.0).into_iter();
    let channels = channels.map(|samples| Channel {
        samples,
        ..Default::default()
    });
    let recording = Recording::from_samples("band", 2560.0, channels.collect()).unwrap();
    let middle = |mode: usize| 0.5 * (shapes[mode - 1].frequency + shapes[mode].frequency);
    let found = measure_bare(recording, Some(&ChannelRef::Number(1)), |settings| {
        settings.band = Some((middle(1), middle(4)));
    });
    let mut found = [found.unwrap()];
    known.map(|(model, known, fit)| {
        let structure = TestedStructure {
            beam,
            assembly: Assembly::Cantilever,
            theory: BeamTheory::Euler,
            regression: Some(model),
            known,
        };
        let details = StructureDetails {
            fit,
            ..StructureDetails::default()
        };
        let (modes, warnings) = modes_of_recordings(&mut found, &[0], &structure, &details);
        let numbers: Vec<usize> = modes.iter().filter_map(|mode| mode.mode).collect();
        let about = |warning: &Warning| {
            let text = warning.to_string();
            let rest = text.split_once("mode 1 (about ")?.1;
            rest.split_once(" Hz")?.0.parse().ok()
        };
        (numbers, warnings.iter().find_map(about))
    })
}

#[test]
fn regress_modes_are_numbered_with_the_joint_that_is_estimated() {
    // The best joint of the numbering predicts the mode that was not measured: right only if it is searched for where
    // the estimate will be.
    let error = |about: f64, joint: &JointStiffness| {
        let first = &mode_shapes(&steel_strip(), Assembly::Cantilever, joint, 1).unwrap()[0];
        (about / first.frequency - 1.0).abs()
    };
    let cross = 0.9 / f64::sqrt(300.0 * 50.0);
    let coupled = JointStiffness {
        kx: 300.0,
        ky: 50.0,
        cross_compliance: cross,
    };
    let known = KnownJoint {
        cross_compliance: Some(cross),
        ..KnownJoint::default()
    };
    let three = PairsModel::ThreeParameter;
    let without = (PairsModel::TwoParameter, KnownJoint::default(), None);
    let [held, ignored] = without_mode_1(&coupled, [(three, known, None), without.clone()]);
    assert_eq!(
        (&held.0[..], &ignored.0[..]),
        (&[2, 3, 4][..], &[2, 3, 4][..])
    );
    let [held, ignored] = [held, ignored].map(|found| error(found.1.unwrap(), &coupled));
    // The frequency is said to a tenth of a hertz, 0.2 % of it.
    assert!(held < 0.003, "{held}");
    assert!(ignored > 0.006, "{ignored}");
    // A spring that is neither fitted nor stated is rigid, and no rotation alone has these frequencies.
    let soft = JointStiffness::two_parameter(150.0, 20.0);
    let only = vec![FitParameter::Kr];
    let only = (PairsModel::TwoParameter, KnownJoint::default(), Some(only));
    let [rigid, both] = without_mode_1(&soft, [only, without]);
    assert_eq!(both.0, [2, 3, 4]);
    assert!(error(both.1.unwrap(), &soft) < 0.01, "{both:?}");
    assert_ne!(rigid.0, both.0);
}
