//! Which peak is which mode: random joints with a mode dropped or a peak added.

use crate::shared::steel_strip;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use tapjoint::identify::consistent::JointedStructure;
use tapjoint::identify::pair_modes;
use tapjoint::identify::pairing::{MeasuredPeak, Pairing, PairingSettings, ShapeAt};
use tapjoint::modal::strengths_of;
use tapjoint::structure::{
    Assembly, BeamTheory, JointStiffness, ModeShape, mode_shapes, natural_frequencies,
};

/// What was done to the peaks of modes 1 to 6.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    Nothing,
    Dropped,
    Added,
    BandAbove,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Seen {
    /// No shape: one response, no hammer.
    Frequencies,
    /// A hammer and two sensors.
    Shapes,
}

struct Case {
    truth: Vec<Option<usize>>,
    peaks: Vec<MeasuredPeak>,
    settings: PairingSettings,
    structure: JointedStructure,
    /// Place (m) of the sensor whose sign is inverted.
    inverted: Option<f64>,
    note: String,
}

fn uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    random.random_range(low..high)
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

fn at(shape: &ModeShape, random: &mut ChaCha8Rng) -> Vec<ShapeAt> {
    let tap = 0.06;
    [0.33, 0.21]
        .into_iter()
        .map(|sensor| {
            let value = shape.displacement(sensor) * shape.displacement(tap);
            // 5 % of calibration and place, and a little noise.
            let value = value * (1.0 + 0.05 * normal(random)) + 0.02 * normal(random);
            ShapeAt {
                sensor,
                tap: Some(tap),
                value,
                std: 0.02,
                group: 0,
            }
        })
        .collect()
}

/// A joint between soft and nearly rigid; a beam whose frequencies differ from the described one's by a
/// common 1 % and 0.3 % each.
fn case(assembly: Assembly, change: Change, seen: Seen, seed: u64) -> Case {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let beam = steel_strip();
    let joint = JointStiffness::two_parameter(
        10f64.powf(uniform(&mut random, 1.5, 4.5)),
        10f64.powf(uniform(&mut random, -0.3, 2.7)),
    );
    let theory = BeamTheory::Timoshenko;
    let frequencies = natural_frequencies(theory, &beam, assembly, &joint, 6).unwrap();
    let shapes = mode_shapes(&beam, assembly, &joint, 6).unwrap();
    let common = 0.01 * normal(&mut random);
    let mut found: Vec<(Option<usize>, MeasuredPeak)> = Vec::new();
    for (index, (&frequency, shape)) in frequencies.iter().zip(&shapes).enumerate() {
        let frequency = frequency * (1.0 + common + 0.003 * normal(&mut random));
        let shape = match seen {
            Seen::Frequencies => Vec::new(),
            Seen::Shapes => at(shape, &mut random),
        };
        let peak = MeasuredPeak {
            frequency,
            std: Some(1e-4 * frequency),
            shape,
            strength: None,
        };
        found.push((Some(index + 1), peak));
    }
    let mut settings = PairingSettings::default();
    match change {
        Change::Nothing => {}
        Change::Dropped => {
            found.remove(random.random_range(0..5));
        }
        Change::BandAbove => {
            let low = 0.5 * (frequencies[0] + frequencies[1]);
            settings.bands = vec![(low, 1.2 * frequencies[5])];
            found.remove(0);
        }
        Change::Added => {
            // Anywhere, but 3 % from every mode: nearer ones merge with it, or are named as ambiguous.
            let place = loop {
                let place = uniform(
                    &mut random,
                    (0.7 * frequencies[0]).ln(),
                    frequencies[5].ln(),
                );
                let apart = |f: &f64| (place.exp() / f - 1.0).abs() > 0.03;
                if frequencies.iter().all(apart) {
                    break place.exp();
                }
            };
            let shape = match seen {
                Seen::Frequencies => Vec::new(),
                Seen::Shapes => [0.33, 0.21]
                    .map(|sensor| ShapeAt {
                        sensor,
                        tap: Some(0.06),
                        value: normal(&mut random),
                        std: 0.02,
                        group: 0,
                    })
                    .to_vec(),
            };
            let peak = MeasuredPeak {
                frequency: place,
                std: Some(1e-4 * place),
                shape,
                strength: None,
            };
            found.push((None, peak));
        }
    }
    found.sort_by(|a, b| a.1.frequency.total_cmp(&b.1.frequency));
    let note = format!("{joint:?} {frequencies:.1?}");
    // Modes nearer than what perturbs them may change places; numbers ascend all the same.
    let mut numbers: Vec<usize> = found.iter().filter_map(|one| one.0).collect();
    numbers.sort_unstable();
    let mut numbers = numbers.into_iter();
    let (truth, peaks): (Vec<_>, Vec<_>) = found
        .into_iter()
        .map(|(number, peak)| (number.and_then(|_| numbers.next()), peak))
        .unzip();
    Case {
        truth,
        peaks,
        settings,
        structure: JointedStructure::new(theory, beam, assembly),
        inverted: None,
        note,
    }
}

#[derive(Debug, Default, Clone, Copy)]
struct Rates {
    right: f64,
    ambiguous: f64,
    wrong: f64,
}

fn pair(case: &Case) -> Pairing {
    pair_modes(&case.structure, &case.peaks, &case.settings).unwrap()
}

fn rates(assembly: Assembly, change: Change, seen: Seen, count: u64) -> Rates {
    let outcome = |seed: u64| {
        let case = case(assembly, change, seen, seed);
        let pairing = pair(&case);
        let all = std::iter::once(&pairing.chosen).chain(&pairing.others);
        let held = all.into_iter().any(|one| one.numbers == case.truth);
        let one = 1.0 / count as f64;
        if !held {
            eprintln!(
                "wrong {assembly:?} {change:?} {seen:?} {seed}: {} truth {:?} found {:?} peaks {:.1?}",
                case.note,
                case.truth,
                pairing.chosen.numbers,
                case.peaks.iter().map(|p| p.frequency).collect::<Vec<_>>()
            );
        }
        match (held, pairing.others.is_empty()) {
            (true, true) => [one, 0.0, 0.0],
            (true, false) => [0.0, one, 0.0],
            (false, _) => [0.0, 0.0, one],
        }
    };
    let all: Vec<[f64; 3]> = (0..count).into_par_iter().map(outcome).collect();
    let sum = |index: usize| all.iter().map(|one| one[index]).sum::<f64>();
    let rates = Rates {
        right: sum(0),
        ambiguous: sum(1),
        wrong: sum(2),
    };
    eprintln!("{assembly:?} {change:?} {seen:?}: {rates:.3?}");
    rates
}

#[test]
fn recover_numbers_over_random_joints() {
    const COUNT: u64 = 30;
    let changes = [
        (Change::Nothing, Seen::Frequencies),
        (Change::Dropped, Seen::Frequencies),
        (Change::Dropped, Seen::Shapes),
        (Change::BandAbove, Seen::Frequencies),
        (Change::Added, Seen::Frequencies),
        (Change::Added, Seen::Shapes),
    ];
    // Cantilevers' modes are far apart; those of the two families of a lap joint come in pairs, and which
    // of two is missing only a shape can tell.
    for (assembly, least) in [(Assembly::Cantilever, 0.9), (Assembly::Lap, 0.7)] {
        let all = changes.map(|(change, seen)| rates(assembly, change, seen, COUNT));
        let mean = |of: fn(&Rates) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
        let (right, wrong) = (mean(|r| r.right), mean(|r| r.wrong));
        assert!(right > least, "{assembly:?}: {all:?}");
        // Not found, and not said to be uncertain.
        assert!(wrong < 0.02, "{assembly:?}: {all:?}");
        assert!(
            all.iter().all(|r| r.ambiguous < 0.4),
            "{assembly:?}: {all:?}"
        );
    }
}

#[test]
fn recover_numbers_beside_an_unknown_modulus() {
    // All frequencies are off by a factor in common, with a standard deviation of 10 %.
    let (mut right, mut wrong) = (0, 0);
    for seed in 0..40 {
        let mut case = case(Assembly::Cantilever, Change::Added, Seen::Frequencies, seed);
        let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
        let factor = (0.1 * normal(&mut random)).exp();
        for peak in &mut case.peaks {
            peak.frequency *= factor;
        }
        case.settings.common_factor = true;
        let pairing = pair(&case);
        let mut all = std::iter::once(&pairing.chosen).chain(&pairing.others);
        right += usize::from(pairing.chosen.numbers == case.truth);
        wrong += usize::from(!all.any(|one| one.numbers == case.truth));
    }
    assert!(right >= 38 && wrong <= 1, "{right} right, {wrong} wrong");
}

#[test]
fn regress_a_tuned_fork_of_two_peaks_is_named_with_both_numberings() {
    // Two peaks 3 % apart where mode 2 is: either may be it.
    let mut case = case(Assembly::Cantilever, Change::Nothing, Seen::Frequencies, 5);
    let mut double = case.peaks[1].clone();
    double.frequency *= 1.03;
    case.peaks.insert(2, double);
    let pairing = pair(&case);
    assert!(!pairing.others.is_empty(), "{pairing:?}");
    let second = |numbers: &[Option<usize>]| numbers.iter().position(|n| *n == Some(2));
    let places: Vec<Option<usize>> = std::iter::once(&pairing.chosen)
        .chain(&pairing.others)
        .map(|one| second(&one.numbers))
        .collect();
    assert!(
        places.contains(&Some(1)) && places.contains(&Some(2)),
        "{pairing:?}"
    );
}

#[test]
fn limit_few_peaks_stay_in_order() {
    let whole = case(Assembly::Cantilever, Change::Nothing, Seen::Frequencies, 1);
    for count in 0..=2 {
        let case = Case {
            peaks: whole.peaks[..count].to_vec(),
            ..case(Assembly::Cantilever, Change::Nothing, Seen::Frequencies, 1)
        };
        let expected: Vec<Option<usize>> = (1..=count).map(Some).collect();
        assert_eq!(pair(&case).chosen.numbers, expected);
    }
}

#[test]
fn limit_a_shape_within_three_standard_deviations_says_nothing() {
    // Two peaks 3 % apart where mode 2 is, of which a shape could tell which it is.
    let shaped = |size: f64| {
        let mut case = case(Assembly::Cantilever, Change::Nothing, Seen::Frequencies, 5);
        let mut double = case.peaks[1].clone();
        double.frequency *= 1.03;
        case.peaks.insert(2, double);
        // In free units, so that there is no sign to compare; of a length of `size` standard deviations.
        for (peak, along) in [(1, [1.0, 0.0]), (2, [0.0, 1.0])] {
            let of = |(sensor, value): (f64, f64)| ShapeAt {
                sensor,
                tap: None,
                value: size * value,
                std: 0.5f64.sqrt(),
                group: 1,
            };
            case.peaks[peak].shape = [0.33, 0.21].into_iter().zip(along).map(of).collect();
        }
        pair(&case)
    };
    let (nothing, within, beyond) = (shaped(0.0), shaped(2.5), shaped(3.5));
    assert!(!nothing.others.is_empty(), "{nothing:?}");
    assert_eq!(nothing, within);
    assert_ne!(nothing, beyond);
}

/// A cantilever whose modes are all seen, equally strong.
fn strong_case(seed: u64) -> Case {
    let mut case = case(Assembly::Cantilever, Change::Nothing, Seen::Shapes, seed);
    for peak in &mut case.peaks {
        peak.strength = Some(1.0);
    }
    case
}

#[test]
fn regress_weak_poles_beside_a_strong_one_are_not_the_mode() {
    for seed in 0..10 {
        let mut case = strong_case(seed);
        // A mode whose frequency changes while it rings leaves poles about it that carry a hundredth.
        let mode = case.peaks[3].clone();
        for (place, factor) in [(3, 0.994), (5, 1.005), (6, 1.017)] {
            let weak = MeasuredPeak {
                frequency: factor * mode.frequency,
                strength: Some(0.01),
                ..mode.clone()
            };
            case.peaks.insert(place, weak);
        }
        let numbers = pair(&case).chosen.numbers;
        let expected = [1, 2, 3, 0, 4, 0, 0, 5, 6].map(|n| (n > 0).then_some(n));
        assert_eq!(numbers, expected, "seed {seed}: {}", case.note);
    }
}

#[test]
fn regress_a_weak_poles_shape_says_nothing_where_the_strong_ones_is_lost() {
    let mut found = 0;
    for seed in 0..10 {
        let mut case = strong_case(seed);
        // Mode 4 near a node of both sensors; a satellite 1 % below pretends to the model's shape.
        let mut weak = case.peaks[3].clone();
        weak.frequency *= 0.99;
        weak.strength = Some(0.3);
        for at in &mut case.peaks[3].shape {
            at.value = 0.5 * at.std;
        }
        case.peaks.insert(3, weak);
        let numbers = pair(&case).chosen.numbers;
        found += usize::from(numbers[4] == Some(4) && numbers[3].is_none());
    }
    // 1 % of frequency may speak for the satellite as much as its amplitude against it.
    assert!(found >= 8, "{found} of 10");
}

#[test]
fn regress_a_strong_peak_of_another_shape_is_not_the_mode() {
    // Torsion 2 % above a bending mode, rung twice as strongly by a tap beside the axis.
    let mut found = 0;
    for seed in 0..10 {
        let mut case = strong_case(seed);
        let mut torsion = case.peaks[2].clone();
        torsion.frequency *= 1.02;
        for peak in &mut case.peaks[..3] {
            peak.strength = Some(0.5);
        }
        let [a, b] = [torsion.shape[0].value, torsion.shape[1].value];
        // At right angles to the bending mode's.
        (torsion.shape[0].value, torsion.shape[1].value) = (b, -a);
        case.peaks.insert(3, torsion);
        let numbers = pair(&case).chosen.numbers;
        found += usize::from(numbers[2] == Some(3) && numbers[3].is_none());
    }
    // The shape of a mode that moves little at both sensors is noise, and decides nothing.
    assert!(found >= 9, "{found} of 10");
}

/// A lap joint or cantilever whose modes are off by up to 5 % each, with three sensors of which one is inverted, and
/// five to twelve other peaks of any strength between a third and a three-thousandth of the strongest mode.
fn crowded_case(assembly: Assembly, seed: u64) -> Case {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (beam, theory) = (steel_strip(), BeamTheory::Timoshenko);
    let joint = JointStiffness::two_parameter(
        10f64.powf(uniform(&mut random, 1.5, 4.5)),
        10f64.powf(uniform(&mut random, -0.3, 2.7)),
    );
    let frequencies = natural_frequencies(theory, &beam, assembly, &joint, 6).unwrap();
    let shapes = mode_shapes(&beam, assembly, &joint, 6).unwrap();
    let length = beam.length;
    let sensors = [0.1, 0.45, 0.8].map(|place| (place + uniform(&mut random, -0.1, 0.15)) * length);
    let tap = uniform(&mut random, 0.85, 1.0) * length;
    let inverted = random.random_range(0..3);
    let mut found: Vec<(Option<usize>, f64, Vec<f64>)> = Vec::new();
    for (index, (frequency, shape)) in frequencies.iter().zip(&shapes).enumerate() {
        let frequency = frequency * uniform(&mut random, 0.95, 1.05);
        let at_tap = shape.displacement(tap);
        let values = sensors.map(|sensor| at_tap * shape.displacement(sensor));
        found.push((Some(index + 1), frequency, values.to_vec()));
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    let size = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let strongest = found.iter().map(|one| size(&one.2)).fold(0.0, f64::max);
    for _ in 0..random.random_range(5..=12) {
        let place = uniform(
            &mut random,
            (0.5 * found[0].1).ln(),
            (1.2 * frequencies[5]).ln(),
        );
        let strength = strongest * 10f64.powf(uniform(&mut random, -3.5, -0.5));
        let values: Vec<f64> = (0..3).map(|_| normal(&mut random)).collect();
        let unit = strength / size(&values);
        found.push((None, place.exp(), values.iter().map(|v| unit * v).collect()));
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    // The force of a tap falls with frequency, by up to 20 dB at the end of the band.
    let fall = uniform(&mut random, 0.0, 2.3);
    let mut amplitudes = Vec::with_capacity(found.len());
    for (_, frequency, values) in &mut found {
        let part = (-fall * *frequency / frequencies[5]).exp();
        values.iter_mut().for_each(|value| *value *= part);
        amplitudes.push(Some(size(values)));
    }
    let strengths = strengths_of(&amplitudes, true);
    let mut numbers = 1..;
    let (mut truth, mut peaks) = (Vec::new(), Vec::new());
    for ((number, frequency, values), strength) in found.into_iter().zip(strengths) {
        truth.push(number.and_then(|_| numbers.next()));
        let mut shape = Vec::new();
        for (index, (&sensor, value)) in sensors.iter().zip(&values).enumerate() {
            let sign = if index == inverted { -1.0 } else { 1.0 };
            shape.push(ShapeAt {
                sensor,
                tap: None,
                value: sign * value * (1.0 + 0.05 * normal(&mut random)),
                std: 1e-4 * strongest,
                group: 1,
            });
        }
        peaks.push(MeasuredPeak {
            frequency,
            std: Some(1e-4 * frequency),
            shape,
            strength,
        });
    }
    Case {
        truth,
        peaks,
        settings: PairingSettings::default(),
        structure: JointedStructure::new(theory, beam, assembly),
        inverted: Some(sensors[inverted]),
        note: format!("{joint:?} {frequencies:.1?} inverted {inverted}"),
    }
}

#[test]
fn recover_numbers_among_many_other_peaks() {
    // A numbering up to 20 times less probable is said, so one in twenty, 3 of 60, may be wrong without a word.
    const COUNT: usize = 60;
    for assembly in [Assembly::Cantilever, Assembly::Lap] {
        let (mut right, mut said, mut wrong) = (0, 0, 0);
        let (mut inverted, mut misnamed) = (0, 0);
        for seed in 0..COUNT {
            let case = crowded_case(assembly, seed as u64);
            let pairing = pair(&case);
            // Of the first four modes: the highest ones may be anything beside the peaks above them.
            let first = |numbers: &[Option<usize>]| -> Vec<Option<usize>> {
                let low = numbers.iter().map(|number| number.filter(|n| *n <= 4));
                low.collect()
            };
            let truth = first(&case.truth);
            let mut all = std::iter::once(&pairing.chosen).chain(&pairing.others);
            // Two modes beside a node of two sensors do not tell which of three is inverted. None is named wrongly.
            let named = &pairing.chosen.inverted;
            if named.iter().copied().eq(case.inverted) {
                inverted += 1;
            } else if !named.is_empty() {
                misnamed += 1;
            }
            if first(&pairing.chosen.numbers) == truth {
                right += 1;
            } else if all.any(|one| first(&one.numbers) == truth) {
                said += 1;
            } else {
                wrong += 1;
                eprintln!(
                    "{assembly:?} {seed}: {}, {:?} {:?}",
                    case.note, case.truth, pairing.chosen.numbers
                );
            }
        }
        eprintln!(
            "{assembly:?}: {right} right, {said} said to be uncertain, {wrong} wrong; inverted sensor named {inverted}, another {misnamed}"
        );
        assert!(
            inverted >= 54 && misnamed == 0,
            "{assembly:?}: {inverted} named, {misnamed} others"
        );
        assert!(
            right >= 54 && wrong <= 3,
            "{assembly:?}: {right} right, {said} said, {wrong} wrong"
        );
    }
}
