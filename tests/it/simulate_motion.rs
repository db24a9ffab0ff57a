//! The structure in motion against solutions found another way: closed forms, elliptic integrals,
//! Runge and Kutta, energy.

use std::f64::consts::{PI, TAU};

use crate::shared::steel_strip;
use tapjoint::simulate::{
    JointMoment, Motion, Pulse, PulseShape, ReducedMode, ReducedStructure, Sensed, Slider, Strike,
    StruckPlace,
};
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::{Assembly, JointStiffness, mode_shapes};

/// Ky of the test structure's joint, and where it is struck and watched, as parts of its length.
const KY: f64 = 5.0;
const PLACES: (f64, f64) = (0.9, 0.7);

/// A cantilever on a joint, its first `count` modes moving, the rest following.
fn cantilever(count: usize, damping: f64) -> (ReducedStructure, StruckPlace, f64) {
    const ALL: usize = 40;
    let beam = steel_strip();
    let joint = JointStiffness::two_parameter(2000.0, KY);
    let shapes = mode_shapes(&beam, Assembly::Cantilever, &joint, ALL).unwrap();
    let stiffness = KY * StiffnessUnits::of(&beam).kr;
    let (tap, sensor) = (PLACES.0 * beam.length, PLACES.1 * beam.length);
    // Slope at the joint by differences to the fourth order: right to some 1e-10.
    let h = 1e-4 * beam.length;
    let rotations: Vec<f64> = shapes
        .iter()
        .map(|shape| {
            let w: Vec<f64> = (0..5)
                .map(|n| shape.displacement(f64::from(n) * h))
                .collect();
            (-25.0 * w[0] + 48.0 * w[1] - 36.0 * w[2] + 16.0 * w[3] - 3.0 * w[4]) / (12.0 * h)
        })
        .collect();
    let omega = |n: usize| TAU * shapes[n].frequency;
    let beyond = |f: &dyn Fn(usize) -> f64| (count..ALL).map(|n| f(n) / omega(n).powi(2)).sum();
    let moving: f64 = (0..count).map(|n| (rotations[n] / omega(n)).powi(2)).sum();
    let structure = ReducedStructure {
        modes: (0..count)
            .map(|n| ReducedMode {
                frequency: shapes[n].frequency,
                damping_ratio: damping,
                at_sensors: vec![shapes[n].displacement(sensor)],
                at_joint: rotations[n],
            })
            .collect(),
        joint_compliance: 1.0 / stiffness - moving,
        joint_to_sensors: vec![beyond(&|n| rotations[n] * shapes[n].displacement(sensor))],
    };
    let place = StruckPlace {
        at_modes: (0..count).map(|n| shapes[n].displacement(tap)).collect(),
        to_sensors: vec![beyond(&|n| {
            shapes[n].displacement(tap) * shapes[n].displacement(sensor)
        })],
        to_joint: beyond(&|n| rotations[n] * shapes[n].displacement(tap)),
    };
    (structure, place, stiffness)
}

fn pulse(peak: f64) -> Pulse {
    Pulse {
        start: 1.3e-4,
        length: 2e-3,
        peak,
        shape: PulseShape::SineSquared,
    }
}

fn struck(
    (structure, place): (&ReducedStructure, &StruckPlace),
    sensed: Sensed,
    step: f64,
    joint: Option<JointMoment>,
    pulse: Pulse,
) -> Motion {
    let mut motion = Motion::new(structure.clone(), &[sensed], 0.0, step, joint);
    motion.strike(Strike {
        pulse,
        place: place.clone(),
    });
    motion
}

/// The largest rotation of the joint in half a second.
fn largest_rotation(motion: &Motion) -> f64 {
    let mut motion = motion.clone();
    let mut largest: f64 = 0.0;
    for _ in 0..(0.5 / motion.step()) as usize {
        motion.advance();
        largest = largest.max(motion.joint_rotation().abs());
    }
    largest
}

/// One mode with a cubic joint, x'' + omega^2 x + k x^3 = 0: its period by the complete elliptic
/// integral, through the arithmetic-geometric mean.
fn duffing_period(omega: f64, k: f64, amplitude: f64) -> f64 {
    let square = omega * omega + k * amplitude * amplitude;
    let modulus = 0.5 * k * amplitude * amplitude / square;
    let (mut a, mut g) = (1.0, (1.0 - modulus).sqrt());
    for _ in 0..8 {
        (a, g) = (0.5 * (a + g), (a * g).sqrt());
    }
    2.0 * PI / (a * square.sqrt())
}

#[test]
fn val_one_mode_on_a_cubic_joint_has_the_period_of_duffings_oscillator() {
    for (cubic, peak) in [(3e3, 20.0), (3e3, 200.0), (-400.0, 100.0)] {
        let (mut structure, mut place, stiffness) = cantilever(1, 0.0);
        structure.joint_compliance = 0.0;
        structure.joint_to_sensors = vec![0.0];
        (place.to_sensors, place.to_joint) = (vec![0.0], 0.0);
        let law = JointMoment::elastic(stiffness, cubic, 2.0);
        let mut motion = struck(
            (&structure, &place),
            Sensed::Displacement,
            1e-4,
            Some(law),
            pulse(peak),
        );
        let mode = &structure.modes[0];
        let (mut crossings, mut before) = (Vec::new(), 0.0);
        let (mut amplitude, mut last): (f64, _) = (0.0, [0.0]);
        while crossings.len() < 41 {
            motion.advance();
            motion.responses(&mut last);
            let q = last[0] / mode.at_sensors[0];
            if motion.time() > 3e-3 && before < 0.0 && q >= 0.0 {
                crossings.push(motion.time() - motion.step() * q / (q - before));
            }
            amplitude = amplitude.max(q.abs());
            before = q;
        }
        let period = (crossings[40] - crossings[0]) / 40.0;
        let omega = TAU * mode.frequency;
        let k = stiffness * cubic * mode.at_joint.powi(4);
        let expected = duffing_period(omega, k, amplitude);
        // The largest sample lies up to (omega step/2)^2/2 = 1.4e-5 below the amplitude, which the
        // shift of at most 30 % passes on.
        let shift = expected * omega / TAU - 1.0;
        assert!(
            (period / expected - 1.0).abs() < 1e-7 + 6e-5 * shift.abs(),
            "cubic {cubic}, {peak} N: {period} for {expected} s (shift {shift:.4})"
        );
        // Harmonic balance: omega' = omega (1 + 3 k A^2/(8 omega^2)), to the square of the shift.
        let balance = 0.375 * k * (amplitude / omega).powi(2);
        let measured = TAU / (omega * period) - 1.0;
        assert!(
            (measured - balance).abs() < 2.0 * balance * balance + 1e-8,
            "{measured} for {balance}"
        );
    }
}

#[test]
fn val_energy_stays_through_a_thousand_periods_of_a_cubic_joint() {
    // The last one goes beyond its crest, on the straight line.
    for ratio in [0.3, -0.15, -0.4] {
        let (structure, place, stiffness) = cantilever(5, 0.0);
        let quiet = struck(
            (&structure, &place),
            Sensed::Displacement,
            1e-4,
            None,
            pulse(50.0),
        );
        let largest = largest_rotation(&quiet);
        let cubic = 4.0 * ratio / (3.0 * largest * largest);
        let law = JointMoment::elastic(stiffness, cubic, 2.0);
        let mut motion = struck(
            (&structure, &place),
            Sensed::Displacement,
            1e-4,
            Some(law),
            pulse(50.0),
        );
        for _ in 0..30 {
            motion.advance();
        }
        let begin = motion.energy();
        let steps = (1000.0 / structure.modes[0].frequency / motion.step()) as usize;
        let mut worst: f64 = 0.0;
        for step in 0..steps {
            motion.advance();
            if step % 1000 == 0 {
                worst = worst.max((motion.energy() / begin - 1.0).abs());
            }
        }
        println!(
            "ratio {ratio}: {worst:.2e}, forced {}",
            motion.forced_steps()
        );
        // A step errs by less than 1e-8 of the moment over omega h = 1e-2 of a radian; 6e5 of them,
        // with errors of both signs, add up to less than 1e-7.
        assert!(worst < 1e-6, "ratio {ratio}: energy strays by {worst}");
    }
}

/// Sliders whose backbone is k theta (1 + ratio theta/hardest) up to the hardest rotation.
fn sliders(stiffness: f64, ratio: f64, hardest: f64) -> JointMoment {
    const COUNT: usize = 20;
    let sliders = (1..=COUNT)
        .map(|n| {
            // The slope falls from k by 2 k |ratio| at the hardest rotation, in equal parts.
            let part = 2.0 * stiffness * -ratio / COUNT as f64;
            let yields = hardest * (n as f64 - 0.5) / COUNT as f64;
            Slider {
                stiffness: part,
                slip: part * yields,
            }
        })
        .collect();
    JointMoment::MicroSlip { stiffness, sliders }
}

#[test]
fn val_micro_slip_loses_the_energy_that_the_structure_loses() {
    let (structure, place, stiffness) = cantilever(5, 0.0);
    let quiet = struck(
        (&structure, &place),
        Sensed::Displacement,
        1e-4,
        None,
        pulse(50.0),
    );
    let law = sliders(stiffness, -0.2, largest_rotation(&quiet));
    let mut motion = struck(
        (&structure, &place),
        Sensed::Displacement,
        5e-5,
        Some(law),
        pulse(50.0),
    );
    for _ in 0..50 {
        motion.advance();
    }
    let (begin, lost_before) = (motion.energy(), motion.joint_loss());
    for _ in 0..40_000 {
        motion.advance();
    }
    let lost = motion.joint_loss() - lost_before;
    let missing = begin - motion.energy();
    println!(
        "lost {lost:.6e} J, missing {missing:.6e} J: {:.2e}; of {begin:.3e}; forced {}",
        missing / lost - 1.0,
        motion.forced_steps()
    );
    assert!(lost > 0.2 * begin, "{lost} J of {begin} J is hardly a loss");
    // Steps meet their moment to 1e-6 of it, where sliders make kinks, and errors of both signs
    // cancel: 3e-8 was found.
    assert!(
        (missing / lost - 1.0).abs() < 1e-6,
        "{missing} J for {lost} J"
    );
}

#[test]
fn val_the_non_linear_joint_agrees_with_runge_and_kutta() {
    let (structure, place, stiffness) = cantilever(3, 0.003);
    let cubic = 2e4;
    let law = JointMoment::elastic(stiffness, cubic, 2.0);
    let step = 1e-4;
    let strike = pulse(100.0);
    let mut motion = struck(
        (&structure, &place),
        Sensed::Displacement,
        step,
        Some(law),
        strike,
    );
    let mut state = vec![[0.0; 2]; 3];
    // u = -k c theta^3, theta = sum psi q + R_t F + R u, solved by Newton's method.
    let extra = |state: &[[f64; 2]], time: f64| {
        let modes = structure.modes.iter().zip(state);
        let free: f64 = modes.map(|(mode, q)| mode.at_joint * q[0]).sum::<f64>()
            + place.to_joint * strike.force(time)[0];
        let mut theta: f64 = free;
        for _ in 0..30 {
            let r = structure.joint_compliance * stiffness * cubic;
            theta -= (theta + r * theta.powi(3) - free) / (1.0 + 3.0 * r * theta * theta);
        }
        -stiffness * cubic * theta.powi(3)
    };
    let slope = |state: &[[f64; 2]], time: f64| -> Vec<[f64; 2]> {
        let u = extra(state, time);
        let force = strike.force(time)[0];
        let modes = structure.modes.iter().zip(&place.at_modes).zip(state);
        modes
            .map(|((mode, at), [q, v])| {
                let omega = TAU * mode.frequency;
                let drive = at * force + mode.at_joint * u;
                [
                    *v,
                    drive - 2.0 * mode.damping_ratio * omega * v - omega * omega * q,
                ]
            })
            .collect()
    };
    let add = |a: &[[f64; 2]], b: &[[f64; 2]], h: f64| -> Vec<[f64; 2]> {
        a.iter()
            .zip(b)
            .map(|(a, b)| [a[0] + h * b[0], a[1] + h * b[1]])
            .collect()
    };
    const PARTS: usize = 40;
    let h = step / PARTS as f64;
    let mut out = [0.0];
    let (mut worst, mut largest): (f64, f64) = (0.0, 0.0);
    for n in 0..1000 {
        for part in 0..PARTS {
            let time = n as f64 * step + part as f64 * h;
            let k1 = slope(&state, time);
            let k2 = slope(&add(&state, &k1, 0.5 * h), time + 0.5 * h);
            let k3 = slope(&add(&state, &k2, 0.5 * h), time + 0.5 * h);
            let k4 = slope(&add(&state, &k3, h), time + h);
            for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                state = add(&state, &k, weight * h / 6.0);
            }
        }
        motion.advance();
        motion.responses(&mut out);
        let time = motion.time();
        let modes = structure.modes.iter().zip(&state);
        let expected: f64 = modes
            .map(|(mode, q)| mode.at_sensors[0] * q[0])
            .sum::<f64>()
            + structure.joint_to_sensors[0] * extra(&state, time)
            + place.to_sensors[0] * strike.force(time)[0];
        worst = worst.max((out[0] - expected).abs());
        largest = largest.max(expected.abs());
    }
    println!(
        "{worst:.2e} of {largest:.2e}, forced {}",
        motion.forced_steps()
    );
    // Runge and Kutta err by omega t (omega h)^4/120 = 1e-9 of the third mode, which has a small share.
    assert!(worst < 1e-9 * largest, "{worst} m of {largest} m");
}

#[test]
fn limit_few_modes_with_their_springs_move_as_many_modes_do() {
    // A hardening joint shifts the frequency of a structure of 3 modes and 37 springs as that of 12 modes.
    let mut seen = Vec::new();
    for count in [3, 12] {
        let (structure, place, stiffness) = cantilever(count, 0.0);
        let law = JointMoment::elastic(stiffness, 2e4, 2.0);
        let slow = Pulse {
            length: 2e-2,
            shape: PulseShape::SineFourth,
            ..pulse(20.0)
        };
        let mut motion = struck(
            (&structure, &place),
            Sensed::Displacement,
            1e-4,
            Some(law),
            slow,
        );
        let mut out = [0.0];
        let mut samples = Vec::new();
        for _ in 0..3000 {
            motion.advance();
            motion.responses(&mut out);
            samples.push(out[0]);
        }
        seen.push(samples);
    }
    let largest = seen[0].iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let worst = seen[0]
        .iter()
        .zip(&seen[1])
        .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    println!("{worst:.2e} of {largest:.2e}");
    // The modes from the fourth on follow but for (f1/f4)^2 = 2e-3 of their share of the joint's
    // rotation, itself a few hundredths: 3.4e-5 was found.
    assert!(worst < 1e-4 * largest, "{worst} m of {largest} m");
}

#[test]
fn limit_a_joint_without_extra_moment_moves_as_the_linear_structure() {
    let (structure, place, stiffness) = cantilever(6, 0.004);
    let laws = [
        JointMoment::elastic(stiffness, 0.0, 2.0),
        JointMoment::MicroSlip {
            stiffness,
            sliders: vec![Slider {
                stiffness: 0.3 * stiffness,
                slip: 1e6,
            }],
        },
    ];
    for law in laws {
        let view = (&structure, &place);
        let mut linear = struck(view, Sensed::Acceleration, 1e-4, None, pulse(50.0));
        let mut other = struck(view, Sensed::Acceleration, 1e-4, Some(law), pulse(50.0));
        let (mut a, mut b) = ([0.0], [0.0]);
        for _ in 0..2000 {
            linear.advance();
            other.advance();
            linear.responses(&mut a);
            other.responses(&mut b);
            // Rounding, of some 1e2 m/s2.
            assert!((a[0] - b[0]).abs() < 1e-8, "{} for {}", b[0], a[0]);
        }
    }
}

#[test]
fn val_a_pulse_moves_one_mode_as_runge_and_kutta_say() {
    for shape in [PulseShape::SineSquared, PulseShape::SineFourth] {
        for (frequency, damping) in [(3.0, 0.0), (500.0, 0.02), (1000.0, 0.0), (9000.0, 0.3)] {
            let structure = ReducedStructure {
                modes: vec![ReducedMode {
                    frequency,
                    damping_ratio: damping,
                    at_sensors: vec![1.0],
                    at_joint: 0.0,
                }],
                joint_compliance: 0.0,
                joint_to_sensors: vec![0.0],
            };
            let place = StruckPlace {
                at_modes: vec![1.0],
                to_sensors: vec![0.0],
                to_joint: 0.0,
            };
            let strike = Pulse {
                shape,
                ..pulse(30.0)
            };
            let step = 3.7e-4;
            let mut motion = struck((&structure, &place), Sensed::Velocity, step, None, strike);
            let omega = TAU * frequency;
            let f = |t: f64, [q, v]: [f64; 2]| {
                [
                    v,
                    strike.force(t)[0] - 2.0 * damping * omega * v - omega * omega * q,
                ]
            };
            let mut state = [0.0; 2];
            let h = step / 2000.0;
            for n in 0..8 {
                for part in 0..2000 {
                    let t = f64::from(n) * step + f64::from(part) * h;
                    let go = |s: [f64; 2], k: [f64; 2], h: f64| [s[0] + h * k[0], s[1] + h * k[1]];
                    let k1 = f(t, state);
                    let k2 = f(t + 0.5 * h, go(state, k1, 0.5 * h));
                    let k3 = f(t + 0.5 * h, go(state, k2, 0.5 * h));
                    let k4 = f(t + h, go(state, k3, h));
                    for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                        state = go(state, k, weight * h / 6.0);
                    }
                }
                motion.advance();
                let mut out = [0.0];
                motion.responses(&mut out);
                // The pulse's momentum is some 0.03 N s; Runge and Kutta err by less than 1e-9 of it.
                assert!(
                    (out[0] - state[1]).abs() < 1e-10,
                    "{shape:?}, {frequency} Hz: {} for {}",
                    out[0],
                    state[1]
                );
            }
        }
    }
}
