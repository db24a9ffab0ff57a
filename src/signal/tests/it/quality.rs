//! Verdicts: each check where it passes, where it does not, and where it does not apply.

use std::f64::consts::TAU;

use crate::shared::baseband;
use num_complex::Complex64;
use tapjoint_signal::quality::*;
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::spectral::{DecayCheck, Lines, Window};
use tapjoint_signal::taps::{Overload, Rejection, SecondHit};

const FREQUENCIES: [f64; 3] = [40.0, 110.0, 210.0];
const DAMPING: f64 = 0.01;

fn lines() -> Lines {
    // 2048 samples at 640 Hz: 800 lines of 0.3125 Hz up to 250 Hz.
    baseband(640.0, 2048, 3.2).expect("fits")
}

/// Accelerance of three modes with these residues phi_a phi_b.
fn accelerance(residues: [f64; 3]) -> Vec<Complex64> {
    let of_line = |frequency: f64| {
        let omega = TAU * frequency;
        FREQUENCIES
            .iter()
            .zip(residues)
            .map(|(own, residue)| {
                let own = TAU * own;
                let below = Complex64::new(own * own - omega * omega, 2.0 * DAMPING * own * omega);
                -omega * omega * residue / below
            })
            .sum()
    };
    lines().frequencies().into_iter().map(of_line).collect()
}

fn tap(peak: f64) -> TapEvidence {
    TapEvidence {
        peak,
        second_hit: None,
        overload: None,
        rejection: None,
        overruled: None,
    }
}

fn sensor(name: &str, position: f64, residues: [f64; 3]) -> SensorEvidence {
    SensorEvidence {
        name: name.to_owned(),
        position: Some(position),
        form: Some(ResponseForm::Accelerance),
        frf: Some(accelerance(residues)),
        coherence: Some(vec![0.99; lines().points()]),
    }
}

/// Value and limit to 1 %, as the sentence rounds them, in the unit.
fn assert_shown(verdict: &QualityVerdict, [value, limit]: [f64; 2], unit: &str) {
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-2;
    assert!(
        verdict.value.is_some_and(|own| near(own, value)),
        "{verdict:?}"
    );
    assert!(near(verdict.limit, limit), "{verdict:?}");
    assert_eq!(verdict.unit, unit, "{verdict:?}");
}

fn resonance(frequency: f64) -> ResonanceEvidence {
    let scatter = [-1.0, 0.5, 0.0, -0.5, 1.0];
    ResonanceEvidence {
        frequency,
        is_mode: true,
        std: Some(1e-5 * frequency),
        apparent_damping_ratio: Some(DAMPING),
        damping_from: DampingSource::Spectra,
        tap_frequencies: scatter.map(|s| frequency * (1.0 + 2e-5 * s)).to_vec(),
        tap_std: Some(2e-5 * frequency),
    }
}

/// Five good taps at 0.1 m, sensor A right there and B at 0.3 m.
fn good() -> RecordingEvidence {
    let points = lines().points();
    RecordingEvidence {
        file: "a.wav".to_owned(),
        tap_position: Some(0.1),
        free_length: None,
        fastened: Vec::new(),
        taps: [40.0, 44.0, 38.0, 41.0, 42.0].map(tap).to_vec(),
        lines: lines(),
        force: Some(ForceEvidence {
            spectrum: (0..points)
                .map(|i| 1.0 - 0.5 * i as f64 / points as f64)
                .collect(),
            noise: Some(vec![1e-3; points]),
        }),
        sensors: vec![
            sensor("A", 0.1, [1.0, 0.8, 0.5]),
            sensor("B", 0.3, [0.7, -0.6, 0.4]),
        ],
        resonances: FREQUENCIES.map(resonance).to_vec(),
        decay: Some(DecayCheck {
            remaining: 0.004,
            noise: 1e-4,
        }),
        window: Window::Rectangular,
    }
}

fn changed(change: impl FnOnce(&mut RecordingEvidence)) -> RecordingEvidence {
    let mut recording = good();
    change(&mut recording);
    recording
}

/// The worst verdict of a check.
fn worst(verdicts: &[QualityVerdict], check: Check) -> QualityVerdict {
    let of_check = verdicts.iter().filter(|verdict| verdict.check == check);
    of_check
        .max_by_key(|verdict| verdict.outcome)
        .unwrap_or_else(|| panic!("no verdict on {check:?}"))
        .clone()
}

fn judged(recording: &RecordingEvidence, check: Check) -> QualityVerdict {
    worst(&judge_recording(recording), check)
}

/// A doubt names its numbers, a cause and a remedy; returns its text.
fn assert_doubt(verdict: &QualityVerdict, outcome: Outcome, numbers: &[&str]) {
    let text = verdict.to_string();
    assert_eq!(verdict.outcome, outcome, "{text}");
    assert!(verdict.value.is_some(), "{text}");
    for number in numbers {
        assert!(text.contains(number), "{number} is missing: {text}");
    }
    assert!(text.contains(verdict.check.cause()), "{text}");
    assert!(text.ends_with(verdict.check.remedy()), "{text}");
}

fn assert_missing(verdict: &QualityVerdict, why: &str) {
    let text = verdict.to_string();
    assert_eq!(verdict.outcome, Outcome::NotApplicable, "{text}");
    assert_eq!(verdict.value, None, "{text}");
    assert!(text.contains(why), "{why} is missing: {text}");
}

#[test]
fn limit_a_good_recording_has_no_doubts() {
    let verdicts = judge_recording(&good());
    for verdict in &verdicts {
        assert!(!verdict.is_doubt(), "{verdict}");
        let applies = verdict.outcome == Outcome::Good;
        let window = [Check::ExponentialWindow, Check::WindowDamping].contains(&verdict.check);
        assert_eq!(applies, !window, "{verdict}");
        assert!(
            !verdict.to_string().contains(verdict.check.remedy()),
            "{verdict}"
        );
    }
    // Four checks of five taps, five of three modes, six of the recording, two of a sensor.
    assert_eq!(verdicts.len(), 20 + 12 + 6 + 2, "{verdicts:?}");
}

#[test]
fn limit_every_check_has_its_own_code() {
    let verdicts = judge_test(&[good()]);
    let mut codes: Vec<&str> = verdicts.iter().map(|v| v.check.code()).collect();
    codes.sort_unstable();
    codes.dedup();
    assert_eq!(codes.len(), 19, "{codes:?}");
}

#[test]
fn val_second_hits_in_time_and_as_ripple() {
    let hit = |ratio| {
        changed(|r| {
            r.taps[2].second_hit = Some(SecondHit {
                delay: 0.0125,
                ratio,
            })
        })
    };
    let weak = judged(&hit(0.06), Check::DoubleHit);
    assert_doubt(
        &weak,
        Outcome::Doubtful,
        &["tap 3", "6.0 %", "12.50 ms", "limit 10 %"],
    );
    let strong = judged(&hit(0.3), Check::DoubleHit);
    assert_doubt(&strong, Outcome::Bad, &["30.0 %", "12.50 ms"]);
    // 20 log10(1.3/0.7) = 5.4 dB, every 80 Hz; the limit 20 log10(1.1/0.9) = 1.7 dB.
    let ripple = judged(&hit(0.3), Check::ForceRipple);
    assert_doubt(
        &ripple,
        Outcome::Bad,
        &["5.4 dB", "80.0 Hz", "limit 1.7 dB"],
    );
    // Two equal hits cancel within the ripple.
    let equal = judged(&hit(1.0), Check::ForceRipple);
    assert_doubt(&equal, Outcome::Bad, &["more than 60.0 dB", "80.0 Hz"]);
    let blind = changed(|r| r.force = None);
    for check in [Check::DoubleHit, Check::ForceRipple] {
        assert_missing(&judged(&blind, check), "beat in the responses");
    }
}

#[test]
fn regress_averages_leave_out_overloaded_taps_where_there_is_a_force() {
    let kept = Overload {
        channel: 1,
        samples: 3,
        whole_from: 100,
        is_force: true,
    };
    let all = changed(|_| {});
    let one = changed(|r| r.taps[1].overload = Some(kept));
    assert_eq!(one.averages(), all.averages() - 1);
    let blind = changed(|r| {
        r.taps[1].overload = Some(kept);
        r.force = None;
    });
    assert_eq!(blind.averages(), all.averages());
}

#[test]
fn val_overloaded_weak_and_uneven_taps() {
    let reject = |rejection| changed(|r| r.taps[1].rejection = Some(rejection));
    let overload = Overload {
        channel: 2,
        samples: 7,
        whole_from: 100,
        is_force: false,
    };
    let over = reject(Rejection::Overload(overload));
    assert_doubt(
        &judged(&over, Check::Overload),
        Outcome::Bad,
        &["tap 2", "7 samples", "limit 0"],
    );
    let weak = reject(Rejection::TooWeak {
        peak: 2.0,
        limit: 4.0,
    });
    assert_doubt(
        &judged(&weak, Check::WeakTap),
        Outcome::Doubtful,
        &["2.000", "0.50", "4.000"],
    );
    // An overload is not known of a tap that was rejected for something else.
    let mut verdicts = judge_recording(&weak);
    verdicts.retain(|verdict| verdict.check == Check::Overload);
    assert_missing(&verdicts[1], "another reason");
    let uneven = changed(|r| r.taps[0].peak = 160.0);
    let levels = judged(&uneven, Check::TapLevels);
    assert_doubt(&levels, Outcome::Doubtful, &["4.2 times", "limit 3.0"]);
    let one = changed(|r| r.taps.truncate(1));
    assert_missing(&judged(&one, Check::TapLevels), "fewer than two");
    assert_missing(
        &judged(&changed(|r| r.taps.clear()), Check::Overload),
        "no tap",
    );
}

#[test]
fn val_the_force_over_the_band() {
    let points = lines().points();
    let falling = changed(|r| {
        let force = r.force.as_mut().expect("a hammer");
        // 30 dB over the band, on a noise 35 dB below its start.
        force.spectrum = (0..points)
            .map(|i| 10f64.powf(-1.5 * i as f64 / points as f64))
            .collect();
        force.noise = Some(vec![10f64.powf(-35.0 / 20.0); points]);
    });
    let fall = judged(&falling, Check::ForceFall);
    assert_doubt(&fall, Outcome::Doubtful, &["29.9 dB", "limit 20 dB"]);
    // 10 dB above the noise at 25 of 30 dB, five sixths of 250 Hz.
    let noise = judged(&falling, Check::ForceNoise);
    assert_doubt(&noise, Outcome::Doubtful, &["within 10 dB", "250.0 Hz"]);
    let at = noise.value.expect("found");
    assert!((at - 250.0 * 5.0 / 6.0).abs() < 1.0, "{at} Hz");
    let blind = changed(|r| r.force = None);
    assert_missing(&judged(&blind, Check::ForceFall), "without a hammer");
    let unknown = changed(|r| r.force.as_mut().expect("a hammer").noise = None);
    assert_missing(&judged(&unknown, Check::ForceNoise), "quiet stretch");
}

#[test]
fn val_averages_and_coherence() {
    let of = |count| changed(|r| r.taps.truncate(count));
    assert_eq!(judged(&of(3), Check::Averages).outcome, Outcome::Good);
    assert_doubt(
        &judged(&of(2), Check::Averages),
        Outcome::Doubtful,
        &["2 of 2", "at least 3"],
    );
    assert_doubt(
        &judged(&of(1), Check::Averages),
        Outcome::Bad,
        &["1 of 1", "means nothing"],
    );
    for check in [Check::Coherence, Check::RandomError] {
        assert_missing(&judged(&of(1), check), "one tap is 1");
        assert_missing(&judged(&of(2), check), "up to 0.95");
        assert_missing(
            &judged(&changed(|r| r.force = None), check),
            "without a hammer",
        );
    }
    // The best sensor speaks for a line: a resonance is unclear only where all are.
    let low = |value| {
        changed(|r| {
            for sensor in &mut r.sensors {
                sensor.coherence = Some(vec![value; lines().points()]);
            }
        })
    };
    // sqrt(0.3/(10 x 0.7)) = 0.207.
    assert_doubt(
        &judged(&low(0.7), Check::Coherence),
        Outcome::Doubtful,
        &["0.700", "limit 0.90"],
    );
    assert_doubt(
        &judged(&low(0.7), Check::RandomError),
        Outcome::Bad,
        &["20.7 %", "limit 5 %"],
    );
    assert_doubt(
        &judged(&low(0.4), Check::Coherence),
        Outcome::Bad,
        &["0.400"],
    );
    // A sensor at a node does not count where another sees the mode.
    let node = changed(|r| {
        r.sensors[1].frf = Some(accelerance([0.01, 0.01, 0.01]));
        r.sensors[1].coherence = Some(vec![0.1; lines().points()]);
    });
    assert_eq!(judged(&node, Check::Coherence).outcome, Outcome::Good);
}

#[test]
fn val_scatter_beside_what_noise_explains() {
    let spread = |relative: f64| {
        changed(|r| {
            // The mode at 110 Hz alone.
            r.resonances = vec![r.resonances[1].clone()];
            let mode = &mut r.resonances[0];
            let at = [-1.0, 1.0, -1.0, 1.0, 0.0].map(|s| mode.frequency * (1.0 + relative * s));
            mode.tap_frequencies = at.to_vec();
        })
    };
    // Its standard deviation is exactly the step; noise explains 2e-5; chance reaches
    // sqrt(13.28/4) = 1.82 times that (chi2 of 4 at 99 %).
    let real = judged(&spread(2e-4), Check::FrequencyScatter);
    assert_doubt(
        &real,
        Outcome::Doubtful,
        &[
            "110.00 Hz",
            "0.0200 %",
            "10 times",
            "chance reaches 1.8",
            "bad from 1 %",
        ],
    );
    assert_eq!(
        judged(&spread(3e-5), Check::FrequencyScatter).outcome,
        Outcome::Good
    );
    // 2.25 and 2.75 times what noise explains, below and above what a little warmth does.
    let warm = judged(&spread(4.5e-5), Check::FrequencyScatter);
    assert_eq!(warm.outcome, Outcome::Good, "{warm}");
    assert!(warm.happened.contains("up to 0.005 %"), "{warm}");
    let more = judged(&spread(5.5e-5), Check::FrequencyScatter);
    assert_eq!(more.outcome, Outcome::Doubtful, "{more}");
    let chance = (13.277 / 4.0_f64).sqrt();
    assert_shown(&more, [2.75, chance], "times noise");
    assert_doubt(
        &judged(&spread(0.02), Check::FrequencyScatter),
        Outcome::Bad,
        &["2.0000 %"],
    );
    let single = changed(|r| {
        r.resonances
            .iter_mut()
            .for_each(|m| m.tap_frequencies.clear())
    });
    assert_missing(&judged(&single, Check::FrequencyScatter), "fewer than two");
}

#[test]
fn val_decay_and_the_window() {
    let left = |remaining: f64, window| {
        changed(|r| {
            r.decay = Some(DecayCheck {
                remaining,
                noise: 1e-4,
            });
            r.window = window;
        })
    };
    let plain = Window::Rectangular;
    assert_doubt(
        &judged(&left(0.05, plain), Check::Decay),
        Outcome::Doubtful,
        &["5.0 %", "limit 1 %", "3.20 s"],
    );
    assert_doubt(
        &judged(&left(0.2, plain), Check::Decay),
        Outcome::Bad,
        &["20.0 %"],
    );
    let none = changed(|r| r.decay = None);
    assert_missing(&judged(&none, Check::Decay), "no tap was accepted");
    assert_missing(
        &judged(&none, Check::ExponentialWindow),
        "no exponential window",
    );
    assert_missing(
        &judged(&left(0.2, plain), Check::WindowDamping),
        "no exponential window",
    );

    // e^{-aT} = 0.05: 20 % come down to 1 %.
    let decay = -(0.05f64).ln() / lines().duration;
    let window = Window::Exponential { decay };
    let windowed = left(0.2, window);
    assert_eq!(judged(&windowed, Check::Decay).outcome, Outcome::Good);
    assert_eq!(
        judged(&windowed, Check::ExponentialWindow).outcome,
        Outcome::Good
    );
    let early = judged(&left(0.4, window), Check::ExponentialWindow);
    assert_doubt(&early, Outcome::Bad, &["40.0 %", "limit 25 %", "0.94 1/s"]);
}

#[test]
fn val_damping_that_only_the_window_has_is_refused() {
    // a = 0.936 1/s at 40 Hz: a/omega = 0.003725.
    let decay = -(0.05f64).ln() / lines().duration;
    let share = decay / (TAU * 40.0);
    let read = |apparent| {
        changed(|r| {
            r.window = Window::Exponential { decay };
            r.resonances[0].apparent_damping_ratio = Some(apparent);
        })
    };
    let verdict = judged(&read(0.006), Check::WindowDamping);
    assert_doubt(
        &verdict,
        Outcome::Doubtful,
        &["40.00 Hz", "62 %", "limit 50 %", "0.00228"],
    );
    let refused = judged(&read(share), Check::WindowDamping);
    assert_doubt(&refused, Outcome::Bad, &["100 %", "not stated"]);
    assert_eq!(
        judged(&read(0.01), Check::WindowDamping).outcome,
        Outcome::Good
    );
    let fitted = changed(|r| {
        r.window = Window::Exponential { decay };
        r.resonances[0].damping_from = DampingSource::Decays;
    });
    assert!(
        judge_recording(&fitted).iter().any(|verdict| {
            verdict.check == Check::WindowDamping && verdict.outcome == Outcome::NotApplicable
        }),
        "a damping fitted to the decays has no share of the window"
    );
}

#[test]
fn val_the_driving_point() {
    let turned = changed(|r| r.sensors[0].frf = Some(accelerance([-1.0, -0.8, -0.5])));
    let verdict = judged(&turned, Check::DrivingPoint);
    assert_doubt(
        &verdict,
        Outcome::Bad,
        &["sensor A", "against the direction", "3 of 3", "limit 0"],
    );
    // Turned altogether, the antiresonances stay.
    assert_eq!(
        judged(&turned, Check::Antiresonances).outcome,
        Outcome::Good
    );
    let elsewhere = changed(|r| r.sensors[0].frf = Some(accelerance([0.7, -0.6, 0.4])));
    assert_doubt(
        &judged(&elsewhere, Check::DrivingPoint),
        Outcome::Bad,
        &["1 of 3", "at some"],
    );
    let gaps = judged(&elsewhere, Check::Antiresonances);
    assert_doubt(&gaps, Outcome::Bad, &["2 of 2 gaps", "limit 0"]);
    for check in [Check::DrivingPoint, Check::Antiresonances] {
        assert_missing(
            &judged(&changed(|r| r.tap_position = None), check),
            "tap position",
        );
        assert_missing(
            &judged(&changed(|r| r.tap_position = Some(0.2)), check),
            "no FRF",
        );
        assert_missing(
            &judged(&changed(|r| r.resonances.clear()), check),
            "too few",
        );
    }
}

#[test]
fn val_velocity_and_displacement_at_the_driving_point() {
    for (form, power) in [(ResponseForm::Mobility, 1), (ResponseForm::Receptance, 2)] {
        let recording = changed(|r| {
            let frf = r.sensors[0].frf.as_mut().expect("a hammer");
            for (h, frequency) in frf.iter_mut().zip(lines().frequencies()).skip(1) {
                // Integrated once or twice: divided by j omega.
                *h /= Complex64::new(0.0, TAU * frequency).powi(power);
            }
            r.sensors[0].form = Some(form);
        });
        for check in [Check::DrivingPoint, Check::Antiresonances] {
            assert_eq!(judged(&recording, check).outcome, Outcome::Good, "{form:?}");
        }
    }
    let sound = changed(|r| r.sensors[0].form = None);
    assert_missing(&judged(&sound, Check::DrivingPoint), "no FRF");
}

/// Tapped where B is, with A still at 0.1 m.
fn swapped(factor: f64) -> RecordingEvidence {
    changed(|r| {
        r.file = "b.wav".to_owned();
        r.tap_position = Some(0.3);
        r.sensors[0].frf = Some(accelerance([0.7, -0.6, 0.4].map(|x| factor * x)));
        r.sensors[1].frf = Some(accelerance([0.49, 0.45, 0.32]));
    })
}

#[test]
fn val_reciprocity() {
    let judge = |second| worst(&judge_test(&[good(), second]), Check::Reciprocity);
    let fine = judge(swapped(1.0));
    assert_eq!(fine.outcome, Outcome::Good, "{fine}");
    assert!((fine.value.expect("a value") - 1.0).abs() < 1e-9, "{fine}");
    let turned = judge(swapped(-1.0));
    assert_doubt(
        &turned,
        Outcome::Bad,
        &["opposite sign", "b.wav", "limits 0.90"],
    );
    let scaled = judge(swapped(0.5));
    assert_doubt(
        &scaled,
        Outcome::Doubtful,
        &["1.000", "level ratio of 2.00"],
    );
    let mut wrong = swapped(1.0);
    wrong.sensors[0].frf = Some(accelerance([0.1, -0.6, -0.9]));
    assert_eq!(judge(wrong).outcome, Outcome::Bad);
    let alone = worst(&judge_test(&[good(), good()]), Check::Reciprocity);
    assert_missing(&alone, "swap the places");
}

#[test]
fn val_two_levels_and_a_moved_sensor() {
    let shifted = |relative: f64, change: fn(&mut RecordingEvidence)| {
        changed(|r| {
            r.file = "c.wav".to_owned();
            r.resonances[0].frequency *= 1.0 + relative;
            change(r);
        })
    };
    let judge = |second, check| worst(&judge_test(&[good(), second]), check);
    let harder = |r: &mut RecordingEvidence| r.taps.iter_mut().for_each(|t| t.peak *= 3.0);
    // 1e-5 each: sqrt(2) 1e-5 of the difference, which is 1e-2: 707.
    let soft = judge(shifted(-1e-2, harder), Check::Linearity);
    assert_doubt(
        &soft,
        Outcome::Doubtful,
        &[
            "40.00 Hz",
            "\u{2212}1.000 %",
            "3.00 times",
            "707 standard",
            "limit 3",
        ],
    );
    // No order of levels to follow: what decides is the drift, 0.5 %.
    assert_shown(&soft, [1e-2, 5e-3], "1");
    let moved_mode =
        |v: &&QualityVerdict| v.check == Check::Linearity && v.to_string().contains("40.00 Hz");
    let same = judge(shifted(2e-5, harder), Check::Linearity);
    assert_eq!(same.outcome, Outcome::Good, "{same}");
    let verdicts = judge_test(&[good(), shifted(2e-5, harder)]);
    let same = verdicts.iter().find(moved_mode).expect("the mode");
    assert_shown(same, [2.0 / f64::sqrt(2.0), 3.0], "standard deviations");
    let verdicts = judge_test(&[good(), shifted(-1e-3, harder)]);
    let drifted = verdicts
        .iter()
        .find(moved_mode)
        .expect("the mode that moves");
    assert_eq!(drifted.outcome, Outcome::Good, "{drifted}");
    assert!(drifted.happened.contains("usual drift"), "{drifted}");
    assert_shown(drifted, [1e-3, 5e-3], "1");
    assert_missing(
        &judge(shifted(1e-4, |_| {}), Check::Linearity),
        "tap level alone",
    );

    let moved = |r: &mut RecordingEvidence| r.sensors[1].position = Some(0.2);
    let loaded = judge(shifted(-8e-3, moved), Check::MassLoading);
    assert_doubt(
        &loaded,
        Outcome::Doubtful,
        &["\u{2212}0.800 %", "c.wav", "limit 3", "sensor's mass"],
    );
    assert_eq!(
        judge(shifted(-2e-3, moved), Check::MassLoading).outcome,
        Outcome::Good
    );
    assert_missing(
        &judge(shifted(1e-3, |_| {}), Check::MassLoading),
        "same places",
    );
    // Harder and elsewhere at once shows neither level nor mass alone; the level says nothing.
    let both = |r: &mut RecordingEvidence| {
        r.sensors[1].position = Some(0.2);
        r.taps.iter_mut().for_each(|t| t.peak *= 3.0);
    };
    assert_missing(
        &judge(shifted(1e-3, both), Check::Linearity),
        "tap level alone",
    );
    let unknown = |r: &mut RecordingEvidence| {
        r.taps.iter_mut().for_each(|t| t.peak *= 3.0);
        r.resonances.iter_mut().for_each(|m| m.std = None);
    };
    assert_missing(
        &judge(shifted(1e-3, unknown), Check::Linearity),
        "not known",
    );
}

#[test]
fn val_three_levels_in_order_are_more_than_drift() {
    let at = |level: f64, relative: f64| {
        changed(|r| {
            r.file = format!("{level}.wav");
            r.resonances[0].frequency *= 1.0 + relative;
            r.taps.iter_mut().for_each(|tap| tap.peak *= level);
        })
    };
    let judge_all = |all: &[(f64, f64)]| {
        let recordings: Vec<_> = all.iter().map(|&(level, shift)| at(level, shift)).collect();
        worst(&judge_test(&recordings), Check::Linearity)
    };
    let judge = |[a, b, c]: [f64; 3]| judge_all(&[(1.0, a), (2.0, b), (4.0, c)]);
    // Far below a usual drift, and far above the uncertainty of 1e-5.
    let ordered = judge([0.0, -1e-3, -2e-3]);
    assert_doubt(
        &ordered,
        Outcome::Doubtful,
        &["Over 3 recordings", "settles", "slips or opens"],
    );
    let jumping = judge([0.0, -2e-3, -1e-3]);
    assert_eq!(jumping.outcome, Outcome::Good, "{jumping}");
    // Twice nearly the same frequency is no order.
    let equal = judge([0.0, -1e-3, -1.01e-3]);
    assert_eq!(equal.outcome, Outcome::Good, "{equal}");
    // A level that was recorded twice shows how far the joint drifts by itself.
    let repeated = judge_all(&[(1.0, 0.0), (1.0, 2e-4), (2.0, -1e-3), (4.0, -2e-3)]);
    assert_doubt(
        &repeated,
        Outcome::Doubtful,
        &["Over 4 recordings", "settles"],
    );
    let returned = judge_all(&[(1.0, 0.0), (2.0, -1e-3), (4.0, -2e-3), (1.0, 2e-4)]);
    assert!(!returned.happened.contains("settles"), "{returned}");
    assert_doubt(&returned, Outcome::Doubtful, &["Over 4 recordings"]);
    let within = judge_all(&[(1.0, 0.0), (1.0, -1.5e-3), (2.0, -1e-3), (4.0, -2e-3)]);
    assert_eq!(within.outcome, Outcome::Good, "{within}");
    // Of three on two levels, two in three are in order by chance.
    let few = judge_all(&[(1.0, 0.0), (1.0, 2e-4), (2.0, -1e-3)]);
    assert_eq!(few.outcome, Outcome::Good, "{few}");
}
