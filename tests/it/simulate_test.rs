//! Virtual tests as a whole: what the recordings say against closed forms, and what may not change them.

use crate::joint_law::LawInClosedForm;
use crate::shared::{described, tapped_strip};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use std::f64::consts::TAU;
use tapjoint::description::TestDescription;
use tapjoint::effects::{Effect, EffectId, JointLaw};
use tapjoint::recording::{ReadSettings, Recording, WavFormat, WavLayout, WavStream, write_wav};
use tapjoint::simulate::{
    AntiAlias, Damping, JointMoment, Laboratory, Motion, Pulse, PulseShape, RecordingRun,
    ReducedMode, ReducedStructure, Sensed, SimulateError, SpecimenSettings, Strike, StruckPlace,
    TapKind, TestPlan, Tip, VirtualTest, plan_test, truth_of,
};

const CANTILEVER: &str = tapped_strip!(
    r#"[[recording]]
file = "taps.csv"
tap = 0.3
"#
);

fn plan<'a>(
    description: &'a TestDescription,
    effects: &'a [Effect],
    laboratory: &'a Laboratory,
    seed: u64,
) -> TestPlan<'a> {
    TestPlan {
        description,
        effects,
        laboratory,
        changes: &[],
        repeatability: 0.0,
        joint: None,
        seed,
    }
}

/// All samples in SI units, channel by channel.
fn samples(mut run: RecordingRun, scales: &[f64]) -> Vec<Vec<f64>> {
    let mut channels = vec![Vec::new(); scales.len()];
    let mut frame = vec![0.0; scales.len()];
    while run.next_frame(&mut frame) {
        for ((channel, value), scale) in channels.iter_mut().zip(&frame).zip(scales) {
            channel.push(value * scale);
        }
    }
    channels
}

fn recorded(test: &VirtualTest, laboratory: &Laboratory) -> Vec<Vec<f64>> {
    let recording = &test.recordings[0];
    let scales = recording.plan.channels.iter();
    let scales: Vec<f64> = scales.map(|(_, scale)| *scale).collect();
    samples(recording.begin(laboratory), &scales)
}

// ---------------------------------------------------------------- closed forms

/// Receptance of an Euler beam on springs, w(x)/F(a), by its general solution left and right of the
/// force. Damping in proportion to mass and stiffness makes both complex.
pub struct ClosedForm {
    pub stiffness: f64,
    pub mass: f64,
    pub length: f64,
    pub springs: (f64, f64),
    pub damping: (f64, f64),
    /// Of the force and of the answer.
    pub places: (f64, f64),
}

impl ClosedForm {
    pub fn receptance(&self, omega: f64) -> Complex64 {
        let soft = Complex64::new(1.0, omega * self.damping.1);
        let heavy = Complex64::new(1.0, -self.damping.0 / omega);
        let bending = self.stiffness * soft;
        let k = (omega * omega * self.mass * heavy / bending).powf(0.25);
        let (tap, sensor) = self.places;
        // Derivative n of cos, sin, e^{-kx}, e^{-k(end-x)} at x on a piece that ends at `end`.
        let basis = |x: f64, end: f64, n: i32| -> [Complex64; 4] {
            let turn = Complex64::I.powi(n);
            let (plus, minus) = ((Complex64::I * k * x).exp(), (-Complex64::I * k * x).exp());
            let back = if n % 2 == 0 { 1.0 } else { -1.0 };
            let scale = k.powi(n);
            [
                scale * 0.5 * (turn * plus + turn.conj() * minus),
                scale * (turn * plus - turn.conj() * minus) / (2.0 * Complex64::I),
                scale * back * (-k * x).exp(),
                scale * (-k * (end - x)).exp(),
            ]
        };
        let mut matrix = DMatrix::<Complex64>::zeros(8, 8);
        let mut set = |row: usize, piece: usize, values: [Complex64; 4], factor: Complex64| {
            for (column, value) in values.into_iter().enumerate() {
                matrix[(row, 4 * piece + column)] += factor * value;
            }
        };
        let one = Complex64::ONE;
        let (kt, kr) = (self.springs.0 * soft, self.springs.1 * soft);
        // EI w''' + Kt w = 0 and EI w'' = Kr w' at the joint, w'' = w''' = 0 at the tip.
        set(0, 0, basis(0.0, tap, 3), bending);
        set(0, 0, basis(0.0, tap, 0), kt);
        set(1, 0, basis(0.0, tap, 2), bending);
        set(1, 0, basis(0.0, tap, 1), -kr);
        set(2, 1, basis(self.length, self.length, 2), one);
        set(3, 1, basis(self.length, self.length, 3), one);
        for n in 0..4 {
            set(4 + n as usize, 0, basis(tap, tap, n), -one);
            set(4 + n as usize, 1, basis(tap, self.length, n), one);
        }
        // The force is a step of EI w'''.
        let mut load = DVector::<Complex64>::zeros(8);
        load[7] = one / bending;
        let constants = matrix.lu().solve(&load).unwrap();
        let (piece, end) = if sensor < tap {
            (0, tap)
        } else {
            (1, self.length)
        };
        let values = basis(sensor, end, 0).into_iter().enumerate();
        values
            .map(|(n, value)| value * constants[4 * piece + n])
            .sum()
    }
}

/// sum x e^{-j 2 pi f n/rate}.
fn transform(samples: &[f64], rate: f64, frequency: f64) -> Complex64 {
    let turn = Complex64::from_polar(1.0, -TAU * frequency / rate);
    // Restarted now and then, so that rounding does not add up.
    samples
        .chunks(1000)
        .enumerate()
        .map(|(chunk, samples)| {
            let angle = -TAU * frequency * (1000 * chunk) as f64 / rate;
            let mut phasor = Complex64::from_polar(1.0, angle);
            let mut sum = Complex64::ZERO;
            for x in samples {
                sum += *x * phasor;
                phasor *= turn;
            }
            sum
        })
        .sum()
}

#[test]
fn val_frequency_response_of_the_recording_is_the_closed_form() {
    let (mass, stiffness) = (3.0, 2e-6);
    let description = described(CANTILEVER);
    for tip in [Tip::Nylon, Tip::Rubber] {
        let mut laboratory = Laboratory::ideal();
        laboratory.hammer.tip = Some(tip);
        laboratory.recorder.anti_alias = AntiAlias::Off;
        laboratory.hammer.taps = 1;
        // e^{-mass t/2} = 1e-5 after 7.7 s; higher modes are damped more.
        laboratory.hammer.interval = Some(8.0);
        laboratory.recorder.sample_rate = Some(12_800);
        laboratory.specimen.damping = Damping::Rayleigh { mass, stiffness };
        let test = plan_test(&plan(&description, &[], &laboratory, 1)).unwrap();
        let channels = recorded(&test, &laboratory);
        let beam = test.nominal.body.beams()[0];
        let closed = ClosedForm {
            stiffness: beam.bending_stiffness(),
            mass: beam.mass_per_length(),
            length: beam.length,
            springs: (1.994e6, 1223.0),
            damping: (mass, stiffness),
            places: (0.3, 0.338),
        };
        // Where the tip excites: to half of its spectrum's amplitude and a little beyond.
        let highest = if tip == Tip::Nylon { 1000.0 } else { 400.0 };
        let mut worst: f64 = 0.0;
        let mut frequency = 5.0;
        while frequency < highest {
            let omega = TAU * frequency;
            let measured = transform(&channels[1], 12_800.0, frequency)
                / transform(&channels[0], 12_800.0, frequency);
            let expected = -omega * omega * closed.receptance(omega);
            // Size of the modes' shares, which cancel at an antiresonance.
            let shares: f64 = test.recordings[0]
                .structure
                .reduced()
                .modes
                .iter()
                .zip(&test.recordings[0].structure.struck(0.3).at_modes)
                .map(|(mode, at)| {
                    let natural = TAU * mode.frequency;
                    let gap = (natural * natural - omega * omega).abs();
                    (omega * omega * at * mode.at_sensors[0] / gap).abs()
                })
                .sum();
            if expected.norm() > 0.1 * shares {
                let error = (measured - expected).norm() / expected.norm();
                worst = worst.max(error);
                assert!(
                    error < 1e-3,
                    "{tip:?}, {frequency} Hz: {measured} for {expected}"
                );
            }
            frequency += 6.7;
        }
        println!("{tip:?}: {worst:.2e}");
    }
}

#[test]
fn val_a_clock_error_is_a_pure_scaling_of_time() {
    // A clock whose seconds are a quarter too long takes the samples of one of four fifths the rate.
    let description = described(CANTILEVER);
    // With all filters and disturbances: they too go by true time, or by samples.
    let mut laboratory = Laboratory::default();
    laboratory.hammer.taps = 1;
    laboratory.hammer.interval = Some(0.3);
    laboratory.recorder.sample_rate = Some(5120);
    laboratory.recorder.hum = 1e-3;
    let test = plan_test(&plan(&description, &[], &laboratory, 1)).unwrap();
    let recording = &test.recordings[0];
    let mut fast = recording.plan.clone();
    fast.frames = 3000;
    fast.frequency_scale = 1.25;
    let mut slow = fast.clone();
    slow.frequency_scale = 1.0;
    slow.sample_rate = 4096;
    let [a, b] = [fast, slow].map(|plan| {
        samples(
            RecordingRun::new(recording.structure.clone(), &plan, &laboratory),
            &[1.0, 1.0],
        )
    });
    let largest = b[1].iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert!(largest > 0.01);
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        // Rounding of some thousand steps.
        assert!((a - b).abs() < 1e-8 * largest, "{a} for {b}");
    }
}

#[test]
fn val_sliders_lose_what_masings_loop_encloses() {
    let law = JointLaw {
        ratio: -0.2,
        exponent: 0.8,
    };
    let (stiffness, hardest) = (1000.0, 1e-3);
    let structure = ReducedStructure {
        modes: vec![ReducedMode {
            frequency: 20.0,
            damping_ratio: 0.0,
            at_sensors: vec![1.0],
            at_joint: 3.0,
        }],
        joint_compliance: 0.0,
        joint_to_sensors: vec![0.0],
    };
    let place = StruckPlace {
        at_modes: vec![1.0],
        to_sensors: vec![0.0],
        to_joint: 0.0,
    };
    let joint = JointMoment::of_law(&law, stiffness, hardest);
    let mut motion = Motion::new(structure, &[Sensed::Displacement], 0.0, 1e-4, Some(joint));
    let pulse = Pulse {
        start: 1e-5,
        length: 2e-3,
        peak: 45.0,
        shape: PulseShape::SineSquared,
    };
    motion.strike(Strike { pulse, place });
    // From one crest on the positive side to the next.
    let (mut before, mut rising, mut crests) = (0.0, false, Vec::new());
    while crests.len() < 3 {
        motion.advance();
        let rotation = motion.joint_rotation();
        if rising && rotation < before && rotation > 0.0 {
            crests.push((before, motion.joint_loss()));
        }
        (rising, before) = (rotation > before, rotation);
    }
    for pair in crests.windows(2) {
        let amplitude = 0.5 * (pair[0].0 + pair[1].0);
        let lost = pair[1].1 - pair[0].1;
        let expected = stiffness * law.loss_per_cycle(amplitude, law.coefficient(hardest));
        // The loop does not quite close, and forty sliders stand for all: two per cent.
        assert!(
            (lost / expected - 1.0).abs() < 0.02,
            "{lost} for {expected} J at {amplitude} rad"
        );
    }
}

#[test]
fn prop_a_wrong_clock_changes_what_the_file_says_of_time_alone() {
    let description = described(CANTILEVER);
    let mut laboratory = Laboratory::ideal();
    laboratory.hammer.taps = 4;
    laboratory.hammer.interval = Some(0.25);
    laboratory.recorder.sample_rate = Some(5120);
    let run = |relative: f64| {
        let effects = [Effect::from_pairs(EffectId::Timebase, &[("relative", relative)]).unwrap()];
        let plan = plan(&description, &effects, &laboratory, 1);
        let test = plan_test(&plan).unwrap();
        let truth = truth_of(&plan, &test).recordings.remove(0);
        (recorded(&test, &laboratory), truth)
    };
    let (_, right) = run(0.0);
    for relative in [-0.2, -0.03, 0.2] {
        let (channels, truth) = run(relative);
        assert_eq!(truth.taps, right.taps);
        assert_eq!(truth.gains, right.gains);
        // How far modes are followed goes by the rate; those that both follow are the same.
        let both = truth.modes.iter().zip(&right.modes);
        assert!(both.len() > 3);
        for (mode, same) in both {
            // The number of modes computed with them differs, and with it their rounding.
            assert!((mode.frequency / same.frequency - 1.0).abs() < 1e-12);
            assert_eq!((mode.mode, mode.damping), (same.mode, same.damping));
        }
        let scale = 1.0 + relative;
        assert_eq!(truth.frequency_scale, scale);
        // A whole number of samples.
        assert!((truth.seconds - right.seconds).abs() <= 1.0 / 5120.0);
        let seconds = channels[0].len() as f64 / 5120.0;
        assert!((seconds * scale - truth.seconds).abs() < 1e-12);
        let largest = channels[0]
            .iter()
            .fold(0.0, |most: f64, x| most.max(x.abs()));
        for tap in &truth.taps {
            // In the file's seconds all times are shorter where frequencies are higher.
            let centre = (tap.time + 0.5 * tap.length) / scale;
            let crest = channels[0][(centre * 5120.0).round() as usize];
            assert!(
                crest > 0.5 * largest,
                "{relative}: {crest} N of {largest} N"
            );
        }
    }
}

// ---------------------------------------------------------------- seeds, switches, streams

#[test]
fn prop_effects_change_neither_taps_nor_gains_nor_noise() {
    let text = CANTILEVER
        .replace("channel = 1", "channel = 1\nscale = 100.0")
        .replace("position = 0.338", "position = 0.338\nscale = 1000.0");
    let description = described(&text);
    let mut laboratory = Laboratory::default();
    laboratory.hammer.taps = 2;
    laboratory.hammer.interval = Some(0.3);
    // The anti-alias filter looks ahead.
    laboratory.recorder.anti_alias = AntiAlias::Off;
    let run = |effects: &[Effect]| {
        let test = plan_test(&plan(&description, effects, &laboratory, 11)).unwrap();
        let run = test.recordings[0].begin(&laboratory);
        (run.taps(), run.gains(), recorded(&test, &laboratory))
    };
    let (taps, gains, bare) = run(&[]);
    let rate = 5120.0;
    let first = (taps[0].time * rate) as usize;
    assert!(first > 1000 && bare[1][..first].iter().any(|x| *x != bare[1][0]));
    for (id, pairs) in [
        (EffectId::SensorMass, [("mass", 0.02)]),
        (EffectId::SensorCable, [("stiffness", 500.0)]),
        (EffectId::CrossCoupling, [("coupling", -0.2)]),
        (EffectId::JointMass, [("mass", 0.1)]),
        (EffectId::JointNonlinearity, [("ratio", -0.1)]),
        (EffectId::JointDamping, [("loss_factor", 0.1)]),
        (EffectId::JointDrift, [("std", 0.05)]),
        (EffectId::Fixture, [("ratio", 0.1)]),
        (EffectId::Modulus, [("relative", 0.03)]),
        (EffectId::AxialLoad, [("force", 60.0)]),
        (EffectId::ShearRotary, [("factor", 1.0)]),
    ] {
        let effect = Effect::from_pairs(id, &pairs).unwrap();
        let (same_taps, same_gains, with) = run(std::slice::from_ref(&effect));
        assert_eq!(taps, same_taps, "{id:?}");
        assert_eq!(gains, same_gains, "{id:?}");
        // The hammer's channel sees no beam; the sensor's none before the first tap.
        assert_eq!(bare[0], with[0], "{id:?}");
        assert_eq!(bare[1][..first], with[1][..first], "{id:?}");
        assert_ne!(bare[1], with[1], "{id:?}");
    }
}

#[test]
fn prop_noise_and_drift_do_not_change_each_other() {
    let text = CANTILEVER
        .replace("channel = 1", "channel = 1\nscale = 100.0")
        .replace("position = 0.338", "position = 0.338\nscale = 1000.0");
    let description = described(&text);
    let run = |noise: f64, drift: f64| {
        let mut laboratory = Laboratory::ideal();
        laboratory.hammer.taps = 1;
        laboratory.hammer.interval = Some(0.3);
        laboratory.sensors.noise = noise;
        laboratory.recorder.drift = drift;
        let test = plan_test(&plan(&description, &[], &laboratory, 11)).unwrap();
        recorded(&test, &laboratory).remove(1)
    };
    let [quiet, noisy, drifting, both] =
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1e-4), (1.0, 1e-4)].map(|(n, d)| run(n, d));
    let most = quiet.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    for n in 0..quiet.len() {
        let sum = noisy[n] + drifting[n] - quiet[n];
        // Rounding of three sums.
        assert!((both[n] - sum).abs() < 1e-13 * most.max(1.0), "sample {n}");
    }
    assert_ne!(noisy, quiet);
    assert_ne!(drifting, quiet);
}

#[test]
fn regress_same_seed_same_samples_and_switches_leave_the_taps_alone() {
    let description = described(CANTILEVER);
    let mut laboratory = Laboratory::default();
    laboratory.hammer.taps = 2;
    laboratory.hammer.interval = Some(0.4);
    let test = |laboratory: &Laboratory, seed: u64| {
        let test = plan_test(&plan(&description, &[], laboratory, seed)).unwrap();
        (
            recorded(&test, laboratory),
            test.recordings[0].begin(laboratory).taps(),
        )
    };
    let (first, taps) = test(&laboratory, 7);
    assert_eq!(first, test(&laboratory, 7).0);
    let (other, other_taps) = test(&laboratory, 8);
    assert_ne!(first, other);
    assert_ne!(taps, other_taps);
    let mut quiet = laboratory.clone();
    quiet.sensors.noise = 0.0;
    quiet.recorder.drift = 0.0;
    let (silent, same_taps) = test(&quiet, 7);
    assert_eq!(taps, same_taps);
    // Before the first tap only noise was there.
    let early = |channels: &[Vec<f64>]| channels[1][..1000].iter().map(|x| x.abs()).sum::<f64>();
    assert!(early(&silent) < early(&first));
}

#[test]
fn regress_a_streamed_file_is_the_file_written_at_once() {
    let description = described(CANTILEVER);
    let mut laboratory = Laboratory::default();
    laboratory.hammer.taps = 1;
    laboratory.hammer.interval = Some(0.3);
    let test = plan_test(&plan(&description, &[], &laboratory, 3)).unwrap();
    let plan = &test.recordings[0].plan;
    let folder = tempfile::tempdir().unwrap();
    for format in [WavFormat::Pcm16, WavFormat::Pcm24, WavFormat::Float32] {
        let (one, other) = (folder.path().join("a.wav"), folder.path().join("b.wav"));
        // An odd number of bytes at 24 bits, so that the pad byte is tried.
        let frames = plan.frames - 1 + plan.frames % 2;
        let layout = WavLayout {
            sample_rate: plan.sample_rate,
            channels: 2,
            frames,
            format,
        };
        let mut stream = WavStream::create(&one, layout).unwrap();
        let mut making = test.recordings[0].begin(&laboratory);
        let mut frame = [0.0; 2];
        let mut channels = vec![Vec::new(); 2];
        for _ in 0..frames {
            assert!(making.next_frame(&mut frame));
            stream.write(&frame).unwrap();
            channels
                .iter_mut()
                .zip(frame)
                .for_each(|(channel, x)| channel.push(x));
        }
        let clipped = stream.finish().unwrap();
        assert_eq!(
            clipped,
            write_wav(&other, plan.sample_rate, &channels, format).unwrap()
        );
        assert_eq!(std::fs::read(&one).unwrap(), std::fs::read(&other).unwrap());
        let read = Recording::open(&one, &ReadSettings::default()).unwrap();
        assert_eq!(read.frames(), frames);
    }
}

#[test]
fn regress_a_stream_refuses_what_does_not_belong_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.wav");
    let layout = WavLayout {
        sample_rate: 1000,
        channels: 2,
        frames: 10,
        format: WavFormat::Pcm24,
    };
    let mut stream = WavStream::create(&path, layout).unwrap();
    assert!(stream.write(&[0.0]).is_err(), "one channel of two");
    assert!(stream.write(&[0.0, f64::NAN]).is_err(), "not a number");
    drop(stream);
    let empty = WavStream::create(&path, layout).unwrap();
    assert!(empty.finish().is_err(), "no samples");
    let huge = WavLayout {
        frames: 1 << 32,
        ..layout
    };
    assert!(WavStream::create(&path, huge).is_err(), "4 GiB");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

// ---------------------------------------------------------------- what is planted

#[test]
fn limit_planted_effects_reach_the_structure_and_the_truth() {
    let description = described(CANTILEVER);
    let laboratory = Laboratory::ideal();
    let first = |effects: &[Effect]| {
        let plan = plan(&description, effects, &laboratory, 1);
        let test = plan_test(&plan).unwrap();
        truth_of(&plan, &test).recordings[0].modes[0].frequency
    };
    let bare = first(&[]);
    let effect = |id, pairs: &[(&str, f64)]| Effect::from_pairs(id, pairs).unwrap();
    let modulus = first(&[effect(EffectId::Modulus, &[("relative", 0.02)])]);
    assert!(modulus > bare && modulus < bare * 1.02f64.sqrt());
    assert!(first(&[effect(EffectId::SensorMass, &[("mass", 0.024)])]) < 0.98 * bare);
    // A joint that slips is linear at rest.
    let slip = [("ratio", -0.1), ("exponent", 1.0)];
    let at_rest = first(&[effect(EffectId::JointNonlinearity, &slip)]);
    assert!((at_rest / bare - 1.0).abs() < 1e-12, "{at_rest} for {bare}");
}

#[test]
fn regress_drift_differs_from_visit_to_visit_and_not_from_run_to_run() {
    let text = format!("{CANTILEVER}[[recording]]\nfile = \"again.wav\"\ntap = 0.3\n");
    let description = described(&text);
    let laboratory = Laboratory::ideal();
    let drift = [Effect::from_pairs(EffectId::JointDrift, &[("std", 0.05)]).unwrap()];
    let stiffnesses = |seed: u64| -> Vec<f64> {
        let plan = plan(&description, &drift, &laboratory, seed);
        let truth = truth_of(&plan, &plan_test(&plan).unwrap());
        let joints = truth
            .recordings
            .iter()
            .filter_map(|recording| recording.joint.as_ref());
        joints.filter_map(|joint| joint.kr).collect()
    };
    let first = stiffnesses(1);
    assert_eq!(first.len(), 2);
    assert_ne!(first[0], first[1]);
    assert_eq!(first, stiffnesses(1));
    assert_ne!(first, stiffnesses(2));
}

#[test]
fn regress_double_and_weak_hits_come_as_ordered() {
    let description = described(CANTILEVER);
    let mut laboratory = Laboratory::default();
    laboratory.hammer.taps = 40;
    laboratory.hammer.interval = Some(0.1);
    laboratory.hammer.double_hits = 0.5;
    laboratory.hammer.weak_hits = 0.5;
    let test = plan_test(&plan(&description, &[], &laboratory, 1)).unwrap();
    let taps = test.recordings[0].begin(&laboratory).taps();
    assert_eq!(taps.len(), 40);
    let share = |wanted: fn(&TapKind) -> bool| taps.iter().filter(|tap| wanted(&tap.kind)).count();
    // Half of forty, and half of the rest, with room for chance.
    assert!((12..=28).contains(&share(|kind| matches!(kind, TapKind::Double { .. }))));
    assert!((3..=17).contains(&share(|kind| *kind == TapKind::Weak)));
    for tap in taps.iter().filter(|tap| tap.kind == TapKind::Weak) {
        assert!(tap.peak_force < 2.0, "{tap:?}");
    }
}

#[test]
fn regress_what_cannot_be_simulated_is_said() {
    let laboratory = Laboratory::ideal();
    let refuse = |text: &str, effects: &[Effect], laboratory: &Laboratory| {
        let description = described(text);
        plan_test(&plan(&description, effects, laboratory, 1)).expect_err("refused")
    };
    let without = |line: &str| CANTILEVER.replace(line, "");
    let cases: [(String, &str); 4] = [
        (without("kr = 1223.0"), "kr is missing"),
        (without("tap = 0.3"), "add `tap`"),
        (without("position = 0.338"), "add `position`"),
        (CANTILEVER.replace("kr = 1223.0", "kr = \"rigid\""), ""),
    ];
    for (text, words) in &cases[..3] {
        let error = refuse(text, &[], &laboratory).to_string();
        assert!(error.contains(words), "{error}");
    }
    let resolution = Effect::from_pairs(EffectId::Resolution, &[("offset", 0.1)]).unwrap();
    let error = refuse(CANTILEVER, &[resolution], &laboratory);
    assert!(matches!(error, SimulateError::Resolution), "{error}");
    // What would change nothing is not planted either.
    let stated = CANTILEVER.replace("position = 0.338", "position = 0.338\nmass = 0.001");
    let sensor_mass = Effect::from_pairs(EffectId::SensorMass, &[("mass", 0.02)]).unwrap();
    let error = refuse(&stated, &[sensor_mass], &laboratory);
    assert!(matches!(error, SimulateError::NothingToWeigh), "{error}");
    let law = [("ratio", -0.1), ("exponent", 2.0)];
    let nonlinear = Effect::from_pairs(EffectId::JointNonlinearity, &law).unwrap();
    let error = refuse(&cases[3].0, &[nonlinear], &laboratory);
    assert!(matches!(error, SimulateError::NoRotation { .. }), "{error}");
    let mut bad = laboratory.clone();
    bad.specimen = SpecimenSettings {
        damping: Damping::Modal(vec![-0.1]),
        ..bad.specimen
    };
    let error = refuse(CANTILEVER, &[], &bad);
    assert!(
        error.to_string().contains("damping ratio is -0.1"),
        "{error}"
    );
}
