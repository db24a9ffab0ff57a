//! The fit of poles against virtual decays with a known answer.

use std::f64::consts::TAU;

use num_complex::Complex64;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint_signal::modal::fit::{
    Accepted, Basis, Column, ExtraMode, FitError, FitSettings, FreeDecayCollector, ModalData,
    ModeFit, PoleStart, SteadyLine, UncertaintySource, Unfit, fit_modes, modal_constants_of_frf,
};
use tapjoint_signal::recording::ResponseForm;

/// A mode: natural frequency (Hz), damping ratio.
type Mode = (f64, f64);

fn pole((frequency, ratio): Mode) -> Complex64 {
    let omega = TAU * frequency;
    Complex64::new(-ratio * omega, omega * (1.0 - ratio * ratio).sqrt())
}

fn start((frequency, ratio): Mode, off: f64) -> PoleStart {
    PoleStart {
        frequency: frequency + off,
        damping_ratio: Some(ratio),
    }
}

/// One sensor's decay: sum of Re(a e^{p t}) over the modes, and noise.
fn decay(
    modes: &[(Mode, Complex64)],
    (rate, samples): (f64, usize),
    noise: f64,
    random: &mut ChaCha8Rng,
) -> Vec<f64> {
    (0..samples)
        .map(|n| {
            let time = n as f64 / rate;
            let clean: f64 = modes
                .iter()
                .map(|(mode, a)| (a * (pole(*mode) * time).exp()).re)
                .sum();
            let one: f64 = StandardNormal.sample(random);
            clean + noise * one
        })
        .collect()
}

/// Lines of all taps: `taps[i][s]` is the decay of sensor s after tap i.
fn collect(taps: &[Vec<Vec<f64>>], rate: f64, bands: &[(f64, f64)]) -> ModalData {
    let samples = taps[0][0].len();
    let mut collector = FreeDecayCollector::new(rate, samples, bands).unwrap();
    for tap in taps {
        collector.add_tap(tap).unwrap();
    }
    collector.finish().unwrap()
}

fn all_fitted(data: &ModalData, starts: &[PoleStart]) -> Vec<ModeFit> {
    fit_modes(data, starts, &FitSettings::default())
        .into_iter()
        .map(|fit| fit.unwrap_or_else(|reason| panic!("{reason}")))
        .collect()
}

fn covers(fit: &ModeFit, (frequency, ratio): Mode) -> (bool, bool) {
    let within = |low: f64, high: f64, x: f64| low <= x && x <= high;
    let (f, z) = (&fit.frequency, &fit.damping_ratio);
    (
        within(f.low, f.high, frequency),
        within(z.low, z.high, ratio),
    )
}

#[test]
fn limit_without_noise_a_record_cut_off_early_is_read_exactly() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    // The first decays by 4 % over the record, the second is seen for a third of a line's inverse.
    let modes = [(41.37, 0.0002), (88.8, 0.004), (97.3, 0.01)];
    let amplitudes = [
        Complex64::new(1.0, 0.3),
        Complex64::new(-0.4, 2.0),
        Complex64::new(0.1, -0.5),
    ];
    let parts: Vec<(Mode, Complex64)> = modes.into_iter().zip(amplitudes).collect();
    let record = decay(&parts, (512.0, 512), 0.0, &mut random);
    let data = collect(&[vec![record]], 512.0, &[(1.0, 255.0)]);
    let starts: Vec<PoleStart> = modes.iter().map(|&mode| start(mode, 0.3)).collect();
    for (fit, (mode, amplitude)) in all_fitted(&data, &starts).iter().zip(&parts) {
        // Rounding of the transform, 10^-15 of the largest line, over the weakest mode's slope.
        let error = (fit.frequency.value / mode.0 - 1.0).abs();
        assert!(error < 1e-10, "{mode:?}: {error:e}");
        let error = (fit.damping_ratio.value / mode.1 - 1.0).abs();
        assert!(error < 1e-7, "{mode:?}: {error:e}");
        let found = fit.amplitudes[0].value;
        assert!((found - amplitude).norm() < 1e-7, "{mode:?}: {found}");
    }
}

/// Five modes and five taps, 2048 samples at 2048 Hz, as a small structure gives them.
const FIVE: [Mode; 5] = [
    (42.7, 0.004),
    (118.3, 0.003),
    (231.9, 0.0035),
    (383.4, 0.005),
    (572.6, 0.006),
];
/// Amplitudes of their decays over the records' peak.
const LEVELS: [f64; 5] = [0.021, 0.154, 0.134, 0.407, 0.596];

/// Covered, all; squared relative errors of the damping; squared errors of the frequency over the stated
/// standard deviation, per mode.
#[derive(Default)]
struct Tally {
    covered: [usize; 2],
    all: usize,
    damping: [f64; 5],
    normalised: f64,
    stated: [f64; 5],
}

/// Bands (Hz) about these modes (frequency in Hz, damping ratio), twice as wide as a fit from there asks for: a fitted
/// mode may turn out wider. Lines are 1 Hz apart.
fn bands_for(modes: &[Mode]) -> Vec<(f64, f64)> {
    let bands = modes.iter().map(|&(frequency, damping_ratio)| {
        let half = 2.0 * (10.0 * (damping_ratio * frequency).hypot(0.5)).max(12.0);
        (frequency - half, frequency + half)
    });
    bands.collect()
}

fn five_modes(noise: f64, seeds: u64) -> Tally {
    let mut tally = Tally::default();
    for seed in 0..seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let modes = FIVE.map(|(f, z)| (f * (1.0 + random.random_range(-0.02..0.02)), z));
        let taps: Vec<Vec<Vec<f64>>> = (0..5)
            .map(|_| {
                let parts: Vec<(Mode, Complex64)> = modes
                    .iter()
                    .zip(LEVELS)
                    .map(|(&mode, level)| (mode, Complex64::from_polar(level, 1.0 + mode.0)))
                    .collect();
                vec![decay(&parts, (2048.0, 2048), noise, &mut random)]
            })
            .collect();
        let starts = modes.map(|mode| start(mode, random.random_range(-0.4..0.4)));
        let places = modes.map(|mode| (mode.0, 0.005));
        let data = collect(&taps, 2048.0, &bands_for(&places));
        for (k, fit) in all_fitted(&data, &starts).iter().enumerate() {
            let (f, z) = covers(fit, modes[k]);
            tally.covered[0] += usize::from(f);
            tally.covered[1] += usize::from(z);
            tally.all += 1;
            tally.damping[k] += (fit.damping_ratio.value / modes[k].1 - 1.0).powi(2);
            tally.normalised += ((fit.frequency.value - modes[k].0) / fit.frequency.std).powi(2);
            tally.stated[k] = fit.frequency.std;
        }
    }
    tally
}

#[test]
fn recover_five_modes_within_their_intervals() {
    // Least standard deviations possible (Hz) at 60 dB, from the information that the samples of the
    // five decays hold on each pole when all poles and amplitudes are unknown.
    let bounds = [6.4e-4, 1.56e-4, 5.4e-4, 6.4e-4, 1.06e-3];
    for noise in [1e-3, 1e-2] {
        let seeds = 40;
        let tally = five_modes(noise, seeds);
        for covered in tally.covered {
            // 200 intervals of 95 %: 190 +-3.1; three standard deviations to either side.
            assert!((180..=199).contains(&covered), "{covered} of {}", tally.all);
        }
        // Mean square of errors in their standard deviation: 1 +-0.1 for 200; three deviations.
        let ratio = tally.normalised / tally.all as f64;
        assert!((0.7..1.3).contains(&ratio), "{noise}: {ratio}");
        for (k, bound) in bounds.iter().enumerate() {
            // Frequencies differ by 2 % from seed to seed, the stated deviation by some percent.
            let over = tally.stated[k] / (bound * noise / 1e-3);
            assert!(
                (0.85..1.25).contains(&over),
                "mode {k}: {over} of the bound"
            );
            let rms = (tally.damping[k] / seeds as f64).sqrt();
            assert!(noise > 1e-3 || rms < 0.02, "mode {k}: damping {rms}");
        }
    }
}

/// Two modes 0.4 Hz apart near 125 Hz, 0.2 % damping, 4 s, two sensors, five taps.
fn close_pair(random: &mut ChaCha8Rng, second: f64) -> ([Mode; 2], ModalData) {
    let modes = [(125.1, 0.002), (125.5, 0.002)];
    let shapes = [[1.0, 0.8], [0.7, -0.9]];
    let taps: Vec<Vec<Vec<f64>>> = (0..5)
        .map(|_| {
            let strength: f64 = random.random_range(0.7..1.3);
            (0..2)
                .map(|sensor| {
                    let phase = Complex64::from_polar(strength, 0.4);
                    let parts = [
                        (modes[0], phase * shapes[0][sensor]),
                        (modes[1], phase * shapes[1][sensor] * second),
                    ];
                    decay(&parts, (512.0, 2048), 1e-3, random)
                })
                .collect()
        })
        .collect();
    (modes, collect(&taps, 512.0, &[(100.0, 150.0)]))
}

#[test]
fn recover_two_modes_within_one_peak() {
    let (mut covered, mut all) = (0, 0);
    for seed in 0..40 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (modes, data) = close_pair(&mut random, 1.0);
        let starts = [start(modes[0], -0.1), start(modes[1], 0.1)];
        for (fit, mode) in all_fitted(&data, &starts).iter().zip(modes) {
            assert_eq!(fit.joint_with, [0, 1]);
            // Some ten times the standard deviation.
            assert!((fit.frequency.value - mode.0).abs() < 2e-3, "{fit:?}");
            let (f, z) = covers(fit, mode);
            covered += usize::from(f) + usize::from(z);
            all += 2;
        }
    }
    // 160 intervals of 95 %: 152 +-2.8; three standard deviations.
    assert!((143..=160).contains(&covered), "{covered} of {all}");
}

/// The test of one more mode beside others.
fn beside(
    data: &ModalData,
    accepted: &[PoleStart],
    extra: PoleStart,
    settings: &FitSettings,
) -> ExtraMode {
    Accepted::new(data, accepted, settings).0.test(&extra).0
}

#[test]
fn prop_a_mode_is_tested_as_it_would_be_fitted() {
    let settings = FitSettings::default();
    for seed in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (modes, data) = close_pair(&mut random, 0.05);
        let starts = modes.map(|mode| start(mode, 0.05));
        let fits = fit_modes(&data, &starts, &settings);
        let tested = beside(&data, &starts[..1], starts[1], &settings);
        let (one, other) = (tested.fit.unwrap(), fits[1].clone().unwrap());
        let apart = (one.frequency.value - other.frequency.value).abs();
        // Both stop within a fiftieth of a standard deviation.
        assert!(apart < 0.05 * other.frequency.std, "seed {seed}: {apart}");
    }
}

#[test]
fn recover_a_second_mode_only_where_there_is_one() {
    let mut mistaken = 0;
    for seed in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let settings = FitSettings::default();
        let (modes, data) = close_pair(&mut random, 0.05);
        let accepted = [start(modes[0], 0.05)];
        let found = beside(&data, &accepted, start(modes[1], 0.05), &settings);
        assert!(found.needed, "seed {seed}: {found:?}");
        assert!(found.likeness.unwrap() < 0.9, "{found:?}");
        let (modes, data) = close_pair(&mut random, 0.0);
        let found = beside(&data, &accepted, start(modes[1], 0.05), &settings);
        mistaken += usize::from(found.needed);
    }
    // On the level of 10^-4 for each of some ten places one mistake in 1000 is to be expected.
    assert_eq!(mistaken, 0);
}

/// Wherever a test finds that a second pole is needed, there is room for it; where there is one mode, seldom.
#[test]
fn recover_room_where_a_second_pole_is_needed() {
    let settings = FitSettings::default();
    let (mut needed, mut missed, mut alone, mut passed) = (0, 0, 0, 0);
    for seed in 0..240 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let first: Mode = (125.1, 0.002 * 2f64.powf(random.random_range(-1.0..1.0)));
        let half_width = first.0 * first.1;
        let away = random.random_range(0.3..3.5) * half_width;
        let second = (
            first.0 + away,
            first.1 * 3f64.powf(random.random_range(-1.0..1.0)),
        );
        let is_alone = seed % 4 == 0;
        let size = match is_alone {
            true => 0.0,
            false => 10f64.powf(random.random_range(-2.0..-0.3)),
        };
        let (taps, sensors) = (random.random_range(1..5), random.random_range(1..4));
        let shapes: Vec<f64> = (0..2 * sensors)
            .map(|_| random.random_range(-1.0..1.0))
            .collect();
        let taps: Vec<Vec<Vec<f64>>> = (0..taps)
            .map(|_| {
                let phase = Complex64::from_polar(random.random_range(0.7..1.3), 0.4);
                let shapes = shapes.chunks_exact(2);
                let parts = shapes
                    .map(|shape| [(first, phase * shape[0]), (second, phase * shape[1] * size)]);
                let sensors = parts.map(|parts| decay(&parts, (512.0, 2048), 1e-3, &mut random));
                sensors.collect()
            })
            .collect();
        let data = collect(&taps, 512.0, &[(100.0, 150.0)]);
        let (accepted, fits) = Accepted::new(&data, &[start(first, 0.05)], &settings);
        let Ok(fit) = &fits[0] else { continue };
        let room = accepted.has_room_beside(0, fit);
        let (frequency, ratio) = (fit.frequency.value, fit.damping_ratio.value);
        let asks = [-0.5, 0.5].map(|side| {
            let beside = start((frequency, ratio), side * frequency * ratio);
            accepted.test(&beside).0.needed
        });
        let is_needed = asks.contains(&true);
        needed += usize::from(is_needed);
        missed += usize::from(is_needed && !room);
        alone += usize::from(is_alone);
        passed += usize::from(is_alone && room);
    }
    assert!(needed > 100, "{needed}");
    // Only second poles at the limit of what the data show, one in fifty.
    assert!(50 * missed <= needed, "{missed} of {needed}");
    assert!(10 * passed <= alone, "{passed} of {alone}");
}

/// A mode whose frequency falls by a tenth of its half-power width at the hardest of taps of very different strength,
/// seen by two sensors: two poles mend its line, and share each tap as its strength has it, but have one shape.
#[test]
fn regress_a_mode_that_changes_with_the_taps_strength_is_no_second_shape() {
    let (rate, samples, frequency, damping) = (512.0, 2048usize, 125.0, 0.002);
    let changing = |strength: f64, shape: f64, random: &mut ChaCha8Rng| -> Vec<f64> {
        let mut phase = 0.4;
        let level = |time: f64| strength * (-TAU * frequency * damping * time).exp();
        (0..samples)
            .map(|n| {
                let now = level(n as f64 / rate);
                let noise: f64 = StandardNormal.sample(random);
                let value = shape * now * f64::cos(phase) + 1e-4 * noise;
                phase += TAU * (frequency - 0.1 * now) / rate;
                value
            })
            .collect()
    };
    let mut tried = 0;
    for seed in 0..5 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let taps: Vec<Vec<Vec<f64>>> = [1.0, 0.2, 0.5, 0.1, 0.7]
            .map(|strength| {
                let sensors = [1.0, -0.6];
                sensors
                    .map(|shape| changing(strength, shape, &mut random))
                    .to_vec()
            })
            .to_vec();
        let data = collect(&taps, rate, &[(100.0, 150.0)]);
        let accepted = [start((frequency, damping), 0.0)];
        let extra = start((frequency - 0.1, 2.0 * damping), 0.0);
        let found = beside(&data, &accepted, extra, &FitSettings::default());
        if found.needed {
            let likeness = found.likeness.expect("two sensors");
            assert!(likeness > 0.99, "seed {seed}: {found:?}");
            tried += 1;
        }
    }
    // Else nothing was tested.
    assert!(tried > 0);
}

#[test]
fn regress_a_mode_that_moved_between_two_taps_is_one_mode() {
    // By five half widths: the mean spectrum has two peaks, and from either no search finds the other.
    let modes = [(100.0, 0.001), (100.5, 0.001)];
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let taps = modes.map(|mode| {
        [1.0, -0.6]
            .map(|shape| decay(&[(mode, shape.into())], (512.0, 4096), 1e-3, &mut random))
            .to_vec()
    });
    let data = collect(&taps, 512.0, &[(60.0, 140.0)]);
    let starts = modes.map(|mode| start(mode, 0.0));
    let fits = fit_modes(&data, &starts, &FitSettings::default());
    let kept: Vec<&ModeFit> = fits.iter().flatten().collect();
    let [fit] = kept[..] else {
        panic!("{fits:?}");
    };
    let own: Vec<f64> = fit.taps.iter().map(|tap| tap.frequency).collect();
    for (own, (frequency, _)) in own.iter().zip(&modes) {
        assert!((own - frequency).abs() < 1e-3, "{fit:?}");
    }
    assert_eq!((own.len(), fit.frequency.freedom), (2, 1.0));
    assert!((fit.frequency.value - 100.25).abs() < 1e-3, "{fit:?}");
    // Student's t of one degree of freedom: 12.706 times half the distance.
    let half = 0.5 * (fit.frequency.high - fit.frequency.low);
    assert!((half / (12.706 * 0.25) - 1.0).abs() < 0.01, "{half}");

    // Two modes that every tap excites stay two.
    let both = modes.map(|mode| (mode, Complex64::ONE));
    let taps = [1.0, 0.7].map(|strength| {
        [1.0, -0.6]
            .map(|shape| {
                let parts = both.map(|(mode, amplitude)| (mode, amplitude * strength * shape));
                decay(&parts, (512.0, 4096), 1e-3, &mut random)
            })
            .to_vec()
    });
    let data = collect(&taps, 512.0, &[(60.0, 140.0)]);
    let fits = fit_modes(&data, &starts, &FitSettings::default());
    assert!(fits.iter().all(Result::is_ok), "{fits:?}");
}

#[test]
fn recover_intervals_of_two_taps_that_scatter() {
    // Scatter from far below the noise of a tap, 10^-3 Hz, to far above it.
    let (mut covered, seeds) = (0, 400);
    for seed in 0..seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let scatter = 10f64.powf(random.random_range(-4.0..-1.5));
        let taps: Vec<Vec<Vec<f64>>> = (0..2)
            .map(|_| {
                let shift: f64 = StandardNormal.sample(&mut random);
                let part = ((100.0 + scatter * shift, 0.004), Complex64::ONE);
                vec![decay(&[part], (512.0, 1024), 1e-2, &mut random)]
            })
            .collect();
        let data = collect(&taps, 512.0, &[(60.0, 140.0)]);
        let fit = &all_fitted(&data, &[start((100.0, 0.004), 0.1)])[0];
        covered += usize::from(covers(fit, (100.0, 0.004)).0);
    }
    // One mode decides alone: 365, or 91 %. With a level of 1 % for the scatter they are 339. The standard deviation of
    // the count is 5.7; the limit lies half way in between.
    assert!(covered >= 352, "{covered} of {seeds}");
}

#[test]
fn recover_the_scatter_of_taps() {
    let mut covered = 0;
    let seeds = 60;
    for seed in 0..seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let taps: Vec<Vec<Vec<f64>>> = (0..5)
            .map(|_| {
                let shift: f64 = StandardNormal.sample(&mut random);
                let part = ((100.0 + 0.01 * shift, 0.004), Complex64::ONE);
                vec![decay(&[part], (512.0, 1024), 1e-3, &mut random)]
            })
            .collect();
        let data = collect(&taps, 512.0, &[(60.0, 140.0)]);
        let fits = all_fitted(&data, &[start((100.0, 0.004), 0.1)]);
        let frequency = fits[0].frequency;
        assert_eq!(
            frequency.source,
            UncertaintySource::TapScatter,
            "{frequency:?}"
        );
        assert_eq!((fits[0].taps.len(), frequency.freedom), (5, 4.0));
        covered += usize::from(frequency.low <= 100.0 && 100.0 <= frequency.high);
    }
    // 60 intervals of 95 %: 57 +-1.7; three standard deviations.
    assert!((52..=60).contains(&covered), "{covered}");
}

#[test]
fn limit_an_exponential_window_is_taken_out_or_refused() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mode = (80.0, 0.003);
    let added = 5.0;
    let record: Vec<f64> = decay(&[(mode, Complex64::ONE)], (512.0, 1024), 1e-3, &mut random)
        .iter()
        .enumerate()
        .map(|(n, x)| x * (-added * n as f64 / 512.0).exp())
        .collect();
    let data = collect(&[vec![record]], 512.0, &[(40.0, 120.0)]);
    let settings = FitSettings {
        added_decay: added,
        ..FitSettings::default()
    };
    let fit = fit_modes(&data, &[start(mode, 0.2)], &settings)
        .remove(0)
        .unwrap();
    // The window makes the noise less than white: five standard deviations instead of two.
    let (f, z) = (fit.frequency, fit.damping_ratio);
    assert!((f.value - mode.0).abs() < 5.0 * f.std, "{f:?}");
    assert!((z.value - mode.1).abs() < 5.0 * z.std, "{z:?}");
    // Without the mode's own decay nothing is left.
    let settings = FitSettings {
        added_decay: added + mode.1 * TAU * mode.0,
        ..FitSettings::default()
    };
    let refused = fit_modes(&data, &[start(mode, 0.2)], &settings).remove(0);
    assert!(
        matches!(refused, Err(Unfit::WindowDominates { .. })),
        "{refused:?}"
    );
}

#[test]
fn limit_hum_at_a_known_frequency_does_not_move_a_mode_beside_it() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mode = (51.3, 0.004);
    let hum = ((50.0, 0.0), Complex64::new(0.3, 0.5));
    let taps: Vec<Vec<Vec<f64>>> = (0..3)
        .map(|_| {
            let parts = [(mode, Complex64::ONE), hum];
            vec![decay(&parts, (256.0, 512), 1e-3, &mut random)]
        })
        .collect();
    let data = collect(&taps, 256.0, &[(20.0, 90.0)]);
    let settings = FitSettings {
        steady_lines: vec![SteadyLine {
            frequency: 50.0,
            bound: 0.1,
        }],
        ..FitSettings::default()
    };
    let fit = fit_modes(&data, &[start(mode, 0.1)], &settings)
        .remove(0)
        .unwrap();
    let error = (fit.frequency.value - mode.0).abs();
    assert!(error < 4.0 * fit.frequency.std, "{fit:?}");
    assert!(fit.frequency.std < 1e-3, "{fit:?}");
}

#[test]
fn limit_of_two_starts_for_one_resonance_the_later_one_fails() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let mode = (60.0, 0.004);
    let one = decay(&[(mode, Complex64::ONE)], (256.0, 512), 1e-3, &mut random);
    let data = collect(&[vec![one]], 256.0, &[(30.0, 90.0)]);
    let starts = [start(mode, 0.1), start(mode, 0.1), start(mode, -0.1)];
    let fits = fit_modes(&data, &starts, &FitSettings::default());
    let first = fits[0].as_ref().unwrap_or_else(|reason| panic!("{reason}"));
    let error = (first.frequency.value - mode.0).abs();
    assert!(error < 4.0 * first.frequency.std, "{first:?}");
    assert!(first.frequency.std < 1e-3, "{first:?}");
    assert!(fits[1].is_err(), "{fits:?}");
}

/// Accelerance A (j omega)^2/(omega_n^2 - omega^2 + 2 j zeta omega_n omega) of all modes.
fn accelerance(frequency: f64, modes: &[(Mode, f64)]) -> Complex64 {
    let s = Complex64::new(0.0, TAU * frequency);
    modes
        .iter()
        .map(|&((f, zeta), constant)| {
            let omega = TAU * f;
            constant * s * s / (omega * omega + s * s + 2.0 * zeta * omega * s)
        })
        .sum()
}

#[test]
fn recover_frequency_response_functions_with_modes_beyond_the_band() {
    let modes = [
        ((60.0, 0.004), 0.5),
        ((110.0, 0.003), -0.8),
        ((180.0, 0.01), 2.0),
        ((700.0, 0.01), 3.0),
    ];
    let (mut covered, mut all) = (0, 0);
    for seed in 0..30 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let frequencies: Vec<f64> = (80..1200).map(|line| 0.25 * f64::from(line)).collect();
        let columns = (0..2)
            .map(|sensor| {
                let values = frequencies.iter().map(|&f| {
                    let mut part = || -> f64 { StandardNormal.sample(&mut random) };
                    let noise = Complex64::new(part(), part());
                    accelerance(f, &modes) * (1.0 - 0.4 * sensor as f64) + 0.02 * noise
                });
                Column {
                    tap: 0,
                    sensor,
                    values: values.collect(),
                }
            })
            .collect();
        let basis = Basis::FrequencyResponse { resolution: 0.25 };
        let data = ModalData::new(basis, frequencies, columns).unwrap();
        let starts = [0, 1, 2].map(|k| start(modes[k].0, 0.1));
        for (fit, (mode, constant)) in all_fitted(&data, &starts).iter().zip(&modes) {
            let (f, z) = covers(fit, *mode);
            covered += usize::from(f) + usize::from(z);
            all += 2;
            let found = modal_constants_of_frf(fit, &[ResponseForm::Accelerance; 2]);
            assert_eq!(found.len(), 2);
            let error = (found[0].value - constant).abs();
            // 90 constants: beyond four deviations one in 10000.
            assert!(error < 4.0 * found[0].std, "{found:?} for {constant}");
        }
    }
    // 180 intervals of 95 %: 171 +-2.9; three standard deviations, and one more below for what the
    // background polynomial leaves of the modes beyond.
    assert!((159..=180).contains(&covered), "{covered} of {all}");
}

fn column(values: Vec<Complex64>) -> Column {
    Column {
        tap: 0,
        sensor: 0,
        values,
    }
}

#[test]
fn limit_what_cannot_be_fitted_is_refused_with_its_reason() {
    let decays = Basis::FreeDecay {
        sample_rate: 100.0,
        samples: 100,
    };
    let axis = |count: u32| (10..10 + count).map(f64::from).collect::<Vec<f64>>();
    let ones = |count: usize| vec![Complex64::ONE; count];
    let empty = ModalData::new(decays, axis(9), Vec::new());
    assert!(matches!(empty, Err(FitError::Empty { .. })), "{empty:?}");
    let short = ModalData::new(decays, axis(9), vec![column(ones(8))]);
    assert!(matches!(short, Err(FitError::Length { .. })), "{short:?}");
    let mut values = ones(9);
    values[4] = Complex64::new(f64::NAN, 0.0);
    let nan = ModalData::new(decays, axis(9), vec![column(values)]);
    assert!(
        matches!(nan, Err(FitError::NotFinite { line: 4, .. })),
        "{nan:?}"
    );
    let off = ModalData::new(decays, vec![10.0, 11.5], vec![column(ones(2))]);
    assert!(matches!(off, Err(FitError::OffGrid { .. })), "{off:?}");
    let settings = FitSettings::default();
    let fit = |values: Vec<Complex64>, frequency: f64| {
        let count = values.len() as u32;
        let data = ModalData::new(decays, axis(count), vec![column(values)]).unwrap();
        fit_modes(&data, &[start((frequency, 0.01), 0.0)], &settings).remove(0)
    };
    let two = fit(ones(2), 10.4);
    assert!(matches!(two, Err(Unfit::TooFewLines { .. })), "{two:?}");
    assert_eq!(fit(vec![Complex64::ZERO; 30], 25.0), Err(Unfit::NoSignal));
    assert_eq!(fit(ones(30), -3.0), Err(Unfit::OutsideBand));
    assert_eq!(fit(ones(30), f64::NAN), Err(Unfit::OutsideBand));
}

#[test]
fn limit_a_sensor_without_signal_and_one_in_other_units_change_nothing() {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let mode = (60.0, 0.004);
    let one = decay(&[(mode, Complex64::ONE)], (256.0, 512), 1e-3, &mut random);
    let alone = collect(&[vec![one.clone()]], 256.0, &[(30.0, 90.0)]);
    let silent = vec![0.0; one.len()];
    let scaled: Vec<f64> = one.iter().map(|x| 1e6 * x).collect();
    let with_silent = collect(&[vec![silent, scaled]], 256.0, &[(30.0, 90.0)]);
    let starts = [start(mode, 0.1)];
    let (a, b) = (
        all_fitted(&alone, &starts),
        all_fitted(&with_silent, &starts),
    );
    let change = (a[0].frequency.value - b[0].frequency.value).abs();
    assert!(change < 1e-3 * a[0].frequency.std, "{change}");
    assert!((a[0].frequency.std / b[0].frequency.std - 1.0).abs() < 1e-3);
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20246),
        ..ProptestConfig::with_cases(60)
    })]

    /// Whatever the lines are, there is an answer or a reason, and every number in it is one.
    #[test]
    fn prop_any_lines_give_a_finite_answer_or_a_reason(
        seed in 0u64..1000,
        lines in 2u32..40,
        columns in 1usize..4,
        frequencies in prop::collection::vec(5.0f64..60.0, 1..5),
        decays in any::<bool>(),
    ) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let axis: Vec<f64> = (8..8 + lines).map(f64::from).collect();
        let columns: Vec<Column> = (0..columns)
            .map(|sensor| Column {
                tap: sensor % 2,
                sensor,
                values: axis
                    .iter()
                    .map(|_| {
                        let size = 10f64.powf(random.random_range(-12.0..12.0));
                        Complex64::from_polar(size, random.random_range(0.0..TAU))
                    })
                    .collect(),
            })
            .collect();
        let basis = if decays {
            Basis::FreeDecay { sample_rate: 200.0, samples: 200 }
        } else {
            Basis::FrequencyResponse { resolution: 2.0 }
        };
        let data = ModalData::new(basis, axis, columns).unwrap();
        let starts: Vec<PoleStart> = frequencies
            .iter()
            .map(|&frequency| PoleStart { frequency, damping_ratio: None })
            .collect();
        let fits = fit_modes(&data, &starts, &FitSettings::default());
        prop_assert_eq!(fits.len(), starts.len());
        for fit in fits.into_iter().flatten() {
            for value in [fit.frequency, fit.damping_ratio] {
                prop_assert!(value.value > 0.0 && value.std > 0.0);
                prop_assert!(value.low < value.high && value.high.is_finite());
            }
        }
        let extra = beside(&data, &starts[1..], starts[0], &FitSettings::default());
        prop_assert!((0.0..=1.0).contains(&extra.probability));
    }
}
