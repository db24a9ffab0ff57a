//! Taps on signals made here: where they are, which are rejected and why, and which are not.

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint_signal::recording::{Channel, ReadSettings, Recording, WavFormat, write_wav};
use tapjoint_signal::taps::{
    Rejection, Tap, TapRemark, TapSettings, TapSource, Taps, TapsByHand, find_taps,
};

/// Form of a hammer pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    /// sin^2: begins and ends without a corner.
    SineSquared,
    /// Half a sine: begins with a corner.
    HalfSine,
}

const SHAPES: [Shape; 2] = [Shape::SineSquared, Shape::HalfSine];

/// One pulse of force: begin (s), length (s), peak.
#[derive(Debug, Clone, Copy)]
struct Pulse {
    time: f64,
    width: f64,
    peak: f64,
}

fn pulse(time: f64, width: f64, peak: f64) -> Pulse {
    Pulse { time, width, peak }
}

impl Shape {
    fn at(self, pulse: &Pulse, time: f64) -> f64 {
        let phase = (time - pulse.time) / pulse.width;
        if !(0.0..=1.0).contains(&phase) {
            return 0.0;
        }
        let sine = (PI * phase).sin();
        pulse.peak
            * match self {
                Shape::SineSquared => sine * sine,
                Shape::HalfSine => sine,
            }
    }
}

fn force(rate: f64, seconds: f64, pulses: &[Pulse], shape: Shape) -> Vec<f64> {
    let mut samples = vec![0.0; (rate * seconds).round() as usize];
    for pulse in pulses {
        let first = (pulse.time * rate).floor().max(0.0) as usize;
        let last = ((pulse.time + pulse.width) * rate).ceil().max(0.0) as usize;
        for (index, sample) in samples.iter_mut().enumerate().take(last + 1).skip(first) {
            *sample += shape.at(pulse, index as f64 / rate);
        }
    }
    samples
}

fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Adds normal noise of this standard deviation.
fn add_noise(samples: &mut [f64], deviation: f64, random: &mut ChaCha8Rng) {
    for sample in samples {
        let noise: f64 = StandardNormal.sample(random);
        *sample += deviation * noise;
    }
}

fn recording(rate: f64, channels: Vec<Vec<f64>>) -> Recording {
    let channels = channels
        .into_iter()
        .map(|samples| Channel {
            samples,
            ..Channel::default()
        })
        .collect();
    Recording::from_samples("made here", rate, channels).expect("finite samples")
}

fn hammer_alone() -> TapSource {
    TapSource::Hammer {
        channel: 0,
        responses: Vec::new(),
    }
}

/// Taps of a force signal without responses.
fn hammer_taps(rate: f64, samples: Vec<f64>) -> Taps {
    let recording = recording(rate, vec![samples]);
    find_taps(&recording, &hammer_alone(), &TapSettings::default()).expect("readable")
}

/// Free vibration from each pulse's begin, modes as (frequency (Hz), damping ratio, amplitude).
fn ringing(rate: f64, seconds: f64, times: &[f64], modes: &[(f64, f64, f64)]) -> Vec<f64> {
    let mut samples = vec![0.0; (rate * seconds).round() as usize];
    for &time in times {
        let first = (time * rate).ceil() as usize;
        for (index, sample) in samples.iter_mut().enumerate().skip(first) {
            let t = index as f64 / rate - time;
            for &(frequency, damping, amplitude) in modes {
                let omega = TAU * frequency;
                *sample += amplitude * (-damping * omega * t).exp() * (omega * t).sin();
            }
        }
    }
    samples
}

/// Low-passes by a windowed sinc and keeps every `factor`-th sample, as a converter does.
/// `cutoff` is a share of the new sample rate.
fn decimate(samples: &[f64], factor: usize, cutoff: f64) -> Vec<f64> {
    // 64 zero crossings to either side: a transition band of some percent, as converters have.
    let reach = (64.0 * factor as f64 / (2.0 * cutoff)) as i64;
    let share = cutoff / factor as f64;
    let kernel: Vec<f64> = (-reach..=reach)
        .map(|n| {
            let x = TAU * share * n as f64;
            let sinc = if n == 0 { 1.0 } else { x.sin() / x };
            let taper = 0.5 + 0.5 * (PI * n as f64 / (reach as f64 + 1.0)).cos();
            2.0 * share * sinc * taper
        })
        .collect();
    // The signal is zero nearly everywhere: what is not is spread onto the samples kept.
    let mut kept = vec![0.0; samples.len() / factor];
    for (at, &x) in samples.iter().enumerate().filter(|(_, x)| **x != 0.0) {
        let at = at as i64;
        let first = (at - reach).max(0).div_euclid(factor as i64);
        let last = (at + reach).div_euclid(factor as i64) + 1;
        for index in first..last.min(kept.len() as i64) {
            let place = index * factor as i64 - at + reach;
            if let Some(weight) = usize::try_from(place).ok().and_then(|p| kernel.get(p)) {
                kept[index as usize] += weight * x;
            }
        }
    }
    kept
}

fn reasons(taps: &Taps) -> Vec<String> {
    taps.taps
        .iter()
        .map(|tap| match &tap.rejection {
            None => "accepted".to_string(),
            Some(rejection) => rejection.to_string(),
        })
        .collect()
}

fn assert_all_accepted(taps: &Taps, count: usize, case: &str) {
    assert_eq!(taps.taps.len(), count, "{case}: {:?}", reasons(taps));
    assert!(
        taps.taps.iter().all(Tap::accepted),
        "{case}: {:?}",
        reasons(taps)
    );
}

/// Only this tap is rejected; returns why.
fn only_rejected<'a>(taps: &'a Taps, count: usize, which: usize, case: &str) -> &'a Rejection {
    assert_eq!(taps.taps.len(), count, "{case}: {:?}", reasons(taps));
    for (index, tap) in taps.taps.iter().enumerate() {
        assert_eq!(
            tap.accepted(),
            index != which,
            "{case}, tap {index}: {:?}",
            reasons(taps)
        );
    }
    taps.taps[which].rejection.as_ref().expect("checked above")
}

/// Rates and widths that a hammer test may have, where the pulse covers two samples at least.
fn rates_and_widths() -> Vec<(f64, f64)> {
    let rates = [1000.0, 2560.0, 5120.0, 12_800.0, 51_200.0];
    let widths = [0.2e-3, 0.5e-3, 1e-3, 2e-3, 4e-3];
    rates
        .iter()
        .flat_map(|&rate| widths.iter().map(move |&width| (rate, width)))
        .filter(|(rate, width)| rate * width >= 2.0)
        .collect()
}

// ---------------------------------------------------------------- where taps are

#[test]
fn val_triggers_are_the_first_samples_above_three_percent() {
    for (rate, width) in rates_and_widths() {
        for shape in SHAPES {
            let times = [0.2037, 0.7141, 1.3309];
            let pulses = times.map(|time| pulse(time, width, 40.0));
            let samples = force(rate, 2.0, &pulses, shape);
            let largest = samples.iter().copied().fold(0.0, f64::max);
            // The rule itself, on samples without noise: 3 % of the largest excursion.
            let expected: Vec<usize> = (1..samples.len())
                .filter(|&n| samples[n] > 0.03 * largest && samples[n - 1] <= 0.03 * largest)
                .collect();
            let offset: Vec<f64> = samples.iter().map(|x| x - 7.5).collect();
            let taps = hammer_taps(rate, offset);
            let case = format!("{shape:?} of {width} s at {rate} Hz");
            assert_all_accepted(&taps, 3, &case);
            let found: Vec<usize> = taps
                .taps
                .iter()
                .map(|tap| (tap.time * rate).round() as usize)
                .collect();
            assert_eq!(found, expected, "{case}");
            for (tap, &frame) in taps.taps.iter().zip(&expected) {
                let end = frame + (width * rate) as usize + 2;
                let peak = samples[frame..end.min(samples.len())]
                    .iter()
                    .copied()
                    .fold(0.0, f64::max);
                // Only the offset's rounding separates the two.
                assert!((tap.peak - peak).abs() < 1e-9, "{case}: {}", tap.peak);
            }
        }
    }
}

#[test]
fn regress_clean_taps_are_all_found_and_none_is_rejected() {
    for seed in 0..60 {
        let mut random = random(seed);
        let grid = rates_and_widths();
        let (rate, width) = grid[random.random_range(0..grid.len())];
        let shape = SHAPES[random.random_range(0..2)];
        // 50 to 80 dB below the peak, what hammers and their amplifiers leave.
        let deviation = 40.0 * 10f64.powf(-random.random_range(50.0..80.0) / 20.0);
        let pulses: Vec<Pulse> = (0..4)
            .map(|tap| {
                let time = 0.3 + tap as f64 + random.random_range(0.0..0.02);
                pulse(time, width, 40.0 * random.random_range(0.5..1.5))
            })
            .collect();
        let mut samples = force(rate, 4.4, &pulses, shape);
        add_noise(&mut samples, deviation, &mut random);
        let drift: f64 = if seed % 2 == 0 {
            0.0
        } else {
            random.random_range(-2.0..2.0)
        };
        let offset = random.random_range(-100.0..100.0);
        for (index, sample) in samples.iter_mut().enumerate() {
            // A slow swing of up to 5 % of the peak on an offset above it.
            *sample += offset + drift * (TAU * 0.3 * index as f64 / rate).sin();
        }
        let taps = hammer_taps(rate, samples);
        let case = format!("seed {seed}: {shape:?} of {width} s at {rate} Hz, noise {deviation}");
        assert_all_accepted(&taps, 4, &case);
        for (tap, pulse) in taps.taps.iter().zip(&pulses) {
            let late = tap.time - pulse.time;
            // Somewhere on the rising flank, or on the sample before, where noise did it.
            assert!(
                late > -1.5 / rate && late < 0.5 * width + 1.5 / rate,
                "{case}: trigger {late} s after the pulse begins"
            );
            // The crest lies between samples (2 samples per pulse at worst), noise on top.
            assert!(
                tap.peak < pulse.peak + 0.1 + 5.0 * deviation
                    && tap.peak > 0.45 * pulse.peak - 5.0 * deviation,
                "{case}: peak {} of {}",
                tap.peak,
                pulse.peak
            );
        }
        // The standard deviation from medians over 0.1 s: a few percent at 100 samples and more.
        // Drift within 0.1 s counts as noise: its slope is drift 2 pi 0.3 Hz.
        let most = 1.15 * deviation + 0.1 * drift.abs();
        assert!(
            taps.noise > 0.85 * deviation && taps.noise < most,
            "{case}: noise read as {}",
            taps.noise
        );
    }
}

#[test]
fn prop_records_end_where_the_next_tap_begins() {
    for seed in 0..20 {
        let mut random = random(seed);
        let rate = 5120.0;
        let mut time = 0.4;
        let mut pulses = Vec::new();
        for _ in 0..6 {
            pulses.push(pulse(time, 1.5e-3, 30.0));
            time += random.random_range(0.9..1.2);
        }
        let mut samples = force(rate, time, &pulses, Shape::SineSquared);
        add_noise(&mut samples, 0.01, &mut random);
        let taps = hammer_taps(rate, samples.clone());
        assert_eq!(taps.taps.len(), 6, "seed {seed}");
        for pair in taps.taps.windows(2) {
            assert_eq!(pair[0].record.end, pair[1].record.start, "seed {seed}");
        }
        for tap in &taps.taps {
            // 10 ms are kept before the trigger: 51 whole samples.
            let trigger = (tap.time * rate).round() as u64;
            assert_eq!(trigger - tap.record.start, 51, "seed {seed}");
            let end = tap.pulse_end.expect("a hammer");
            assert!(
                end > trigger && end < trigger + (4e-3 * rate) as u64,
                "seed {seed}: the pulse of 1.5 ms ends {} samples after its trigger",
                end - trigger
            );
        }
        let last = taps.taps.last().expect("six taps");
        assert_eq!(last.record.end, samples.len() as u64, "seed {seed}");
        assert_eq!(taps.quiet, 0..taps.taps[0].record.start, "seed {seed}");
        let shortest = taps.accepted().map(Tap::frames).min();
        assert_eq!(taps.shortest(), shortest, "seed {seed}");
    }
}

#[test]
fn regress_digital_silence_between_taps() {
    // A gated recorder: exact zeros wherever nothing happens, on hammer and response.
    let rate = 5120.0;
    let times = [0.5, 1.5, 2.5, 3.5];
    let pulses = times.map(|time| pulse(time, 2e-3, 20.0));
    for shape in SHAPES {
        let taps = hammer_taps(rate, force(rate, 4.5, &pulses, shape));
        assert_all_accepted(&taps, 4, &format!("{shape:?}"));
        assert_eq!(taps.noise, 0.0, "{shape:?}");
        assert!(taps.remarks.is_empty(), "{shape:?}: {:?}", taps.remarks);
    }
    let mut response = ringing(rate, 4.5, &times, &[(120.0, 0.01, 5.0)]);
    for sample in &mut response {
        // Rounded to steps of 1 %, so that the tail is exactly zero.
        *sample = (*sample / 0.05).round() * 0.05;
    }
    let recording = recording(rate, vec![response]);
    let source = TapSource::Responses(vec![0]);
    let taps = find_taps(&recording, &source, &TapSettings::default()).unwrap();
    assert_all_accepted(&taps, 4, "response");
}

/// Hammer and two responses, four taps 1 s apart from 0.5 s on.
fn with_two_responses(seed: u64) -> [Vec<f64>; 3] {
    let rate = 5120.0;
    let times = [0.5, 1.5, 2.5, 3.5];
    let pulses = times.map(|time| pulse(time, 2e-3, 20.0));
    let mut random = random(seed);
    let response = || ringing(rate, 4.5, &times, &[(120.0, 0.01, 5.0)]);
    let mut channels = [force(rate, 4.5, &pulses, SHAPES[0]), response(), response()];
    for samples in &mut channels {
        add_noise(samples, 1e-2, &mut random);
    }
    channels
}

fn taps_with_two_responses(channels: &[Vec<f64>; 3]) -> Taps {
    let source = TapSource::Hammer {
        channel: 0,
        responses: vec![1, 2],
    };
    let recording = recording(5120.0, channels.to_vec());
    find_taps(&recording, &source, &TapSettings::default()).unwrap()
}

#[test]
fn recover_taps_after_a_sensor_has_failed_are_rejected() {
    for (seed, value) in [(1, 0.0), (2, -0.7)] {
        let mut channels = with_two_responses(seed);
        assert_all_accepted(&taps_with_two_responses(&channels), 4, "whole");
        // In the last third of the second record.
        channels[2][(2.2 * 5120.0) as usize..].fill(value);
        let dead = Some(Rejection::Stopped { channel: 3 });
        let rejections = |channels: &[Vec<f64>; 3]| {
            let taps = taps_with_two_responses(channels).taps.into_iter();
            taps.map(|tap| tap.rejection).collect::<Vec<_>>()
        };
        let late = [None, None, dead.clone(), dead.clone()];
        assert_eq!(rejections(&channels), late, "{value}");
        // Once more a single sample, zeros before, and a file that is filled up.
        let mut more = channels.clone();
        more[2][..300].fill(value);
        let end = more[2].len();
        more[2][end - 5] = 0.01;
        assert_eq!(rejections(&more), late, "{value}");
        for samples in &mut more {
            samples.extend([0.0; 50]);
        }
        assert_eq!(rejections(&more), late, "{value}");
        // In its first third: this record holds the failure.
        channels[2][(1.8 * 5120.0) as usize..].fill(value);
        let early = [None, dead.clone(), dead.clone(), dead];
        assert_eq!(rejections(&channels), early, "{value}");
        // The only responses: not a hammer that was laid down.
        channels[1] = channels[2].clone();
        let dead = Some(Rejection::Stopped { channel: 2 });
        assert_eq!(
            rejections(&channels),
            [None, dead.clone(), dead.clone(), dead],
            "{value}"
        );
    }
}

#[test]
fn recover_a_sensor_that_is_stuck_at_its_limit() {
    let mut channels = with_two_responses(8);
    channels[2][(2.2 * 5120.0) as usize..].fill(30.0);
    let taps = taps_with_two_responses(&channels).taps;
    let dead = Some(Rejection::Stopped { channel: 3 });
    assert!(matches!(taps[1].rejection, Some(Rejection::Overload(_))));
    assert_eq!([&taps[2].rejection, &taps[3].rejection], [&dead, &dead]);
}

#[test]
fn limit_a_channel_at_rest_has_not_failed() {
    // Steps of 0.05: the responses rest at 0 before each tap and soon after it.
    let mut channels = with_two_responses(6);
    for samples in &mut channels[1..] {
        for sample in samples {
            *sample = (*sample / 0.05).round() * 0.05;
        }
    }
    // The hammer is laid down at 1.0 s.
    for (at, sample) in channels[0][5120..5130].iter_mut().enumerate() {
        *sample += 10.0 * (PI * at as f64 / 10.0).sin();
    }
    let taps = taps_with_two_responses(&channels);
    let rejections: Vec<_> = taps.taps.iter().map(|tap| &tap.rejection).collect();
    let laid = &Some(Rejection::NoResponse);
    assert_eq!(rejections, [&None, laid, &None, &None, &None]);
    // A channel that answers no tap, but moved once: an unused input, or one for marks.
    let mut more = channels.clone();
    more[2].fill(0.0);
    for place in [100, 20_000] {
        more[2][place..place + 200].fill(3.0);
    }
    assert_eq!(taps_with_two_responses(&more).accepted().count(), 4);
    // The recording ends with a tap, and the responses still rest.
    for samples in &mut more {
        samples.truncate((3.504 * 5120.0) as usize);
    }
    more[1][(3.49 * 5120.0) as usize..].fill(0.0);
    let last = taps_with_two_responses(&more).taps.pop().unwrap();
    assert!(!matches!(last.rejection, Some(Rejection::Stopped { .. })));
    // A sensor of which hardly anything is seen.
    for sample in &mut channels[2] {
        *sample = (*sample / 4.0).round();
    }
    assert_eq!(taps_with_two_responses(&channels).accepted().count(), 4);
}

#[test]
fn recover_taps_that_a_dead_hammer_does_not_show() {
    let mut channels = with_two_responses(7);
    channels[0][(1.8 * 5120.0) as usize..].fill(0.0);
    let taps = taps_with_two_responses(&channels);
    assert_all_accepted(&taps, 2, "seen");
    // The record of the last tap that is seen ends before the next one.
    let end = taps.taps[1].record.end as f64 / 5120.0;
    assert!((2.45..2.5).contains(&end), "{end}");
    let [remark] = &taps.remarks[..] else {
        panic!("{:?}", taps.remarks)
    };
    assert_eq!(
        remark.to_string(),
        "the hammer gives no signal from 1.80 s of its file on. The responses rise 2 times after that. These may be taps that it \
         does not show. Check the hammer and its cable, and record again"
    );
    // A hammer without noise rests after its last pulse.
    let pulses = [0.5, 1.5, 2.5, 3.5].map(|time| pulse(time, 2e-3, 20.0));
    channels[0] = force(5120.0, 4.5, &pulses, SHAPES[0]);
    channels[0].resize(7 * 5120, 0.0);
    // The table is knocked twice.
    let knocks = ringing(5120.0, 7.0, &[5.0, 6.0], &[(120.0, 0.01, 5.0)]);
    for samples in &mut channels[1..] {
        samples.resize(7 * 5120, 0.0);
        for (sample, knock) in samples.iter_mut().zip(&knocks) {
            *sample += knock;
        }
    }
    let taps = taps_with_two_responses(&channels);
    assert_all_accepted(&taps, 4, "noise-free");
    assert_eq!(taps.remarks, []);
}

#[test]
fn recover_a_sensor_that_has_failed_in_an_earlier_file() {
    let (first, mut second) = (with_two_responses(4), with_two_responses(5));
    second[2].fill(0.3);
    let source = TapSource::Hammer {
        channel: 0,
        responses: vec![1, 2],
    };
    let parts = [&first, &second].map(|channels| recording(5120.0, channels.to_vec()));
    let joined = Recording::joined("both", parts.to_vec()).unwrap();
    let taps = find_taps(&joined, &source, &TapSettings::default()).unwrap();
    let accepted: Vec<bool> = taps.taps.iter().map(Tap::accepted).collect();
    assert_eq!(
        accepted,
        [true, true, true, true, false, false, false, false]
    );
    // Alone it was never connected, and the other response is used.
    assert_all_accepted(&taps_with_two_responses(&second), 4, "alone");
}

#[test]
fn limit_a_file_that_is_filled_up_rejects_no_tap() {
    let mut channels = with_two_responses(3);
    for samples in &mut channels {
        samples[(3.8 * 5120.0) as usize..].fill(0.0);
        samples.resize(8 * 5120, 0.0);
    }
    assert_all_accepted(&taps_with_two_responses(&channels), 4, "filled up");
}

#[test]
fn regress_an_inverted_hammer_is_read_all_the_same() {
    let rate = 5120.0;
    let pulses = [0.3, 1.3, 2.3].map(|time| pulse(time, 1.5e-3, 25.0));
    let mut upright = force(rate, 3.3, &pulses, Shape::HalfSine);
    add_noise(&mut upright, 0.01, &mut random(5));
    let inverted: Vec<f64> = upright.iter().map(|x| -x).collect();
    let upright = hammer_taps(rate, upright);
    let inverted = hammer_taps(rate, inverted);
    assert!(upright.remarks.is_empty(), "{:?}", upright.remarks);
    assert_eq!(inverted.remarks, [TapRemark::InvertedForce]);
    assert_eq!(inverted.taps.len(), 3);
    for (a, b) in upright.taps.iter().zip(&inverted.taps) {
        assert_eq!((a.time, &a.record), (b.time, &b.record));
        // Medians of an even count are not quite symmetric: a share of the noise.
        assert!((a.peak - b.peak).abs() < 0.01, "{} {}", a.peak, b.peak);
    }
}

#[test]
fn regress_a_recording_that_starts_within_a_tap_says_so() {
    let rate = 5120.0;
    let pulses = [-0.75e-3, 1.0, 2.0].map(|time| pulse(time, 1.5e-3, 25.0));
    let mut samples = force(rate, 3.0, &pulses, Shape::SineSquared);
    add_noise(&mut samples, 0.01, &mut random(9));
    let taps = hammer_taps(rate, samples);
    assert_eq!(taps.remarks, [TapRemark::StartsWithinTap]);
    assert_all_accepted(&taps, 3, "starts within");
    assert_eq!((taps.taps[0].time, taps.taps[0].record.start), (0.0, 0));
    assert_eq!(taps.quiet, 0..0);

    let ringing = ringing(rate, 3.0, &[0.0], &[(80.0, 0.005, 3.0)]);
    let late = ringing[400..].to_vec();
    let recording = recording(rate, vec![late]);
    let source = TapSource::Responses(vec![0]);
    let taps = find_taps(&recording, &source, &TapSettings::default()).unwrap();
    assert_eq!(taps.remarks, [TapRemark::StartsWithinTap], "response");
    assert_eq!(taps.taps.len(), 1, "response: {:?}", reasons(&taps));
}

// ---------------------------------------------------------------- which are rejected

/// Five taps a second apart, with what `change` adds to their pulses.
fn five_taps(
    (rate, seed): (f64, u64),
    shape: Shape,
    change: impl FnOnce(&mut Vec<Pulse>),
) -> (Vec<Pulse>, Vec<f64>) {
    let mut random = random(seed);
    let mut pulses: Vec<Pulse> = (0..5)
        .map(|tap| {
            let time = 0.3 + tap as f64 + random.random_range(0.0..0.01);
            pulse(time, 1.5e-3, 40.0 * random.random_range(0.8..1.2))
        })
        .collect();
    change(&mut pulses);
    let mut samples = force(rate, 5.3, &pulses, shape);
    add_noise(&mut samples, 0.01, &mut random);
    (pulses, samples)
}

#[test]
fn recover_every_second_hit_of_twelve_percent_and_none_of_eight() {
    for seed in 0..40 {
        let mut draw = random(1000 + seed);
        let shape = SHAPES[draw.random_range(0..2)];
        let rate = [5120.0, 12_800.0, 51_200.0][draw.random_range(0..3)];
        let delay = draw.random_range(5e-3..0.1);
        let ratio = draw.random_range(0.12..0.7);
        // The weaker hit comes after the main one, or before it.
        let sign = if seed % 2 == 0 { 1.0 } else { -1.0 };
        let second = |ratio: f64| {
            move |pulses: &mut Vec<Pulse>| {
                let main = pulses[2];
                pulses.push(pulse(
                    main.time + sign * delay,
                    main.width,
                    ratio * main.peak,
                ));
            }
        };
        let (_, samples) = five_taps((rate, seed), shape, second(ratio));
        let taps = hammer_taps(rate, samples);
        let case = format!("seed {seed}: {ratio:.3} after {sign} x {delay:.4} s at {rate} Hz");
        match only_rejected(&taps, 5, 2, &case) {
            Rejection::DoubleHit {
                delay: found,
                ratio: share,
                limit,
            } => {
                // One sample from each crest; at 8 samples per pulse a crest is missed by 4 %.
                assert!(
                    (found - delay).abs() < 2.0 / rate,
                    "{case}: delay {found} s"
                );
                assert!((share / ratio - 1.0).abs() < 0.05, "{case}: ratio {share}");
                assert_eq!(*limit, 0.1, "{case}");
            }
            other => panic!("{case}: {other}"),
        }
        let (_, samples) = five_taps((rate, seed), shape, second(0.08));
        assert_all_accepted(&hammer_taps(rate, samples), 5, &format!("{case}, but 8 %"));
    }
}

#[test]
fn prop_taps_by_hand_change_no_other_tap() {
    let (pulses, samples) = five_taps((5120.0, 3), Shape::SineSquared, |pulses| {
        let main = pulses[1];
        pulses.push(pulse(main.time + 0.05, main.width, 0.3 * main.peak));
    });
    let recording = recording(5120.0, vec![samples]);
    let by_hand = |accept: Vec<f64>, reject: Vec<f64>| {
        let settings = TapSettings {
            by_hand: TapsByHand { accept, reject },
            ..TapSettings::default()
        };
        find_taps(&recording, &hammer_alone(), &settings).unwrap()
    };
    let rules = by_hand(vec![], vec![]);
    assert!(!rules.taps[1].accepted());
    // Half the reach away from the trigger.
    let found = by_hand(vec![pulses[1].time + 0.025], vec![pulses[3].time - 0.025]);
    assert_eq!(found.remarks, rules.remarks);
    for (index, (tap, before)) in found.taps.iter().zip(&rules.taps).enumerate() {
        let expected = match index {
            1 => Tap {
                rejection: None,
                overruled: before.rejection.clone(),
                ..before.clone()
            },
            3 => Tap {
                rejection: Some(Rejection::ByHand),
                ..before.clone()
            },
            _ => before.clone(),
        };
        assert_eq!(*tap, expected, "tap {index}");
    }
    // Who rejects and accepts one tap does not want it.
    let both = by_hand(vec![pulses[1].time], vec![pulses[1].time]);
    assert_eq!(both.taps[1].rejection, Some(Rejection::ByHand));
}

#[test]
fn prop_an_accepted_tap_ends_the_record_before_it() {
    // A hit of 6 % of the others is too weak, and its neighbour's record goes over it.
    let (pulses, samples) = five_taps((5120.0, 3), Shape::SineSquared, |pulses| {
        let (first, second) = (pulses[1], pulses[2]);
        let between = 0.5 * (first.time + second.time);
        pulses.push(pulse(between, first.width, 0.06 * first.peak));
    });
    let weak = pulses[pulses.len() - 1].time;
    let recording = recording(5120.0, vec![samples]);
    let found = |accept: Vec<f64>| {
        let by_hand = TapsByHand {
            accept,
            reject: vec![],
        };
        let settings = TapSettings {
            by_hand,
            ..TapSettings::default()
        };
        find_taps(&recording, &hammer_alone(), &settings).unwrap()
    };
    let rules = found(vec![]);
    assert!(matches!(
        rules.taps[2].rejection,
        Some(Rejection::TooWeak { .. })
    ));
    assert!(
        rules.taps[1].record.end > rules.taps[2].record.end.min(rules.taps[3].record.start - 1)
    );
    let accepted = found(vec![weak]);
    assert!(accepted.taps[2].accepted());
    assert!(matches!(
        accepted.taps[2].overruled,
        Some(Rejection::TooWeak { .. })
    ));
    // Records meet a little before the trigger.
    assert_eq!(accepted.taps[1].record.end, accepted.taps[2].record.start);
    assert_eq!(accepted.taps[2].record.end, accepted.taps[3].record.start);
}

#[test]
fn regress_an_accepted_double_hit_is_looked_at_for_overload() {
    let rate = 5120.0;
    let (pulses, force) = five_taps((rate, 3), Shape::SineSquared, |pulses| {
        let main = pulses[1];
        pulses.push(pulse(main.time + 0.05, main.width, 0.3 * main.peak));
    });
    let taps: Vec<f64> = pulses[..5].iter().map(|pulse| pulse.time).collect();
    let mut response = ringing(rate, force.len() as f64 / rate, &taps, &[(60.4, 0.01, 1.0)]);
    response.truncate(force.len());
    // The second tap alone drives the converter to its limit.
    let from = (taps[1] * rate) as usize;
    for sample in &mut response[from..from + 400] {
        *sample = (3.0 * *sample).clamp(-1.5, 1.5);
    }
    let recording = recording(rate, vec![force, response]);
    let source = TapSource::Hammer {
        channel: 0,
        responses: vec![1],
    };
    let settings = TapSettings {
        by_hand: TapsByHand {
            accept: vec![taps[1]],
            reject: vec![],
        },
        ..TapSettings::default()
    };
    let rules = find_taps(&recording, &source, &TapSettings::default()).unwrap();
    assert!(matches!(
        rules.taps[1].rejection,
        Some(Rejection::DoubleHit { .. })
    ));
    let tap = &find_taps(&recording, &source, &settings).unwrap().taps[1];
    assert!(tap.accepted());
    assert!(matches!(tap.overruled, Some(Rejection::DoubleHit { .. })));
    let overload = tap.overload.expect("its response is cut off");
    assert_eq!(overload.channel, 2);
    // Only its decay is used.
    assert!(tap.usable_from() > tap.record.start);
}

#[test]
fn limit_a_time_without_a_tap_is_a_remark() {
    let (pulses, samples) = five_taps((5120.0, 3), Shape::SineSquared, |_| {});
    let recording = recording(5120.0, vec![samples]);
    let remarks = |recording: &Recording, time: f64| {
        let settings = TapSettings {
            by_hand: TapsByHand {
                accept: vec![],
                reject: vec![time],
            },
            ..TapSettings::default()
        };
        let found = find_taps(recording, &hammer_alone(), &settings).unwrap();
        assert!(found.taps.iter().all(Tap::accepted));
        found.remarks
    };
    let time = pulses[2].time + 0.08;
    match &remarks(&recording, time)[..] {
        [
            TapRemark::NoTapThere {
                time: told,
                accept: false,
                nearest: Some(nearest),
            },
        ] => {
            assert_eq!(*told, time);
            assert!((nearest - pulses[2].time).abs() < 2e-3, "{nearest}");
        }
        other => panic!("{other:?}"),
    }
    let silent = self::recording(5120.0, vec![vec![0.0; 5120]]);
    let expected = TapRemark::NoTapThere {
        time,
        accept: false,
        nearest: None,
    };
    assert_eq!(remarks(&silent, time), [expected]);
}

/// Of two taps the last has a fifth of the other's record.
#[test]
fn limit_no_hand_makes_a_short_record_longer() {
    let mut samples = ringing(2048.0, 6.0, &[0.5, 5.0], &[(300.3, 0.01, 1.0)]);
    add_noise(&mut samples, 1e-4, &mut random(5));
    let recording = recording(2048.0, vec![samples]);
    let settings = TapSettings {
        by_hand: TapsByHand {
            accept: vec![5.0],
            reject: vec![],
        },
        ..TapSettings::default()
    };
    let found = find_taps(&recording, &TapSource::Responses(vec![0]), &settings).unwrap();
    let rejection = found.taps[1].rejection.clone().expect("rejected");
    assert!(matches!(rejection, Rejection::CutOff { .. }), "{rejection}");
    let time = found.taps[1].time;
    assert_eq!(
        found.remarks,
        [TapRemark::StillRejected { time, rejection }]
    );
}

#[test]
fn limit_the_end_of_a_growing_recording_cuts_off_no_tap() {
    let mut samples = ringing(2048.0, 6.0, &[0.5, 5.0], &[(300.3, 0.01, 1.0)]);
    add_noise(&mut samples, 1e-4, &mut random(5));
    let recording = recording(2048.0, vec![samples]);
    let found = |is_growing: bool| {
        let settings = TapSettings {
            is_growing,
            ..TapSettings::default()
        };
        find_taps(&recording, &TapSource::Responses(vec![0]), &settings).unwrap()
    };
    let (ended, growing) = (found(false), found(true));
    assert!(matches!(
        ended.taps[1].rejection,
        Some(Rejection::CutOff { .. })
    ));
    assert!(growing.taps.iter().all(Tap::accepted));
    assert_eq!(growing.taps[0], ended.taps[0]);
}

#[test]
fn regress_a_record_begins_with_the_first_of_two_hits() {
    let (pulses, samples) = five_taps((5120.0, 3), Shape::SineSquared, |pulses| {
        let main = pulses[1];
        pulses.push(pulse(main.time - 0.05, main.width, 0.3 * main.peak));
    });
    let taps = hammer_taps(5120.0, samples);
    only_rejected(&taps, 5, 1, "a weak hit ahead");
    let first = pulses.last().expect("the one ahead");
    let late = taps.taps[1].time - first.time;
    assert!((0.0..1e-3).contains(&late), "{late} s after the first hit");
    // The stronger one's peak, whichever came first.
    let ratio = taps.taps[1].peak / pulses[1].peak;
    assert!((ratio - 1.0).abs() < 0.05, "{ratio} of the main peak");
}

#[test]
fn recover_double_hits_behind_a_ringing_filter_and_no_others() {
    // Short pulses through a linear-phase low-pass, sampled where they happen to fall: the ringing
    // reaches 20 % of the peak on either side and is no second hit; a bounce of the hammer is.
    let factor = 8;
    for seed in 0..40 {
        let mut draw = random(seed);
        let rate = [1024.0, 2560.0, 5120.0][draw.random_range(0..3)];
        let fast = rate * factor as f64;
        // Every fourth time the file has more samples than the filter leaves room for.
        let cutoff = if seed % 4 == 0 {
            draw.random_range(0.1..0.2)
        } else {
            draw.random_range(0.39..0.49)
        };
        let width = draw.random_range(0.5..1.5) / rate;
        let mut pulses: Vec<Pulse> = (0..4)
            .map(|tap| {
                let time = 0.4 + tap as f64 * 0.8 + draw.random_range(0.0..0.02);
                pulse(time, width, 30.0 * draw.random_range(0.8..1.2))
            })
            .collect();
        let sampled = |pulses: &[Pulse], seed: u64| {
            let fine = force(fast, 3.7, pulses, Shape::HalfSine);
            let mut samples = decimate(&fine, factor, cutoff);
            add_noise(&mut samples, 2e-3, &mut random(seed));
            samples
        };
        let case = format!("seed {seed}: {width:.5} s at {rate} Hz, cut-off {cutoff:.3}");
        let taps = hammer_taps(rate, sampled(&pulses, seed));
        assert_all_accepted(&taps, 4, &case);

        let main = pulses[1];
        let delay = draw.random_range(0.02..0.08);
        let ratio = draw.random_range(0.2..0.6);
        pulses.push(pulse(main.time + delay, width, ratio * main.peak));
        let taps = hammer_taps(rate, sampled(&pulses, seed));
        let case = format!("{case}, {ratio:.2} after {delay:.3} s");
        let rejection = only_rejected(&taps, 4, 1, &case);
        assert!(
            matches!(rejection, Rejection::DoubleHit { delay: found, .. } if (found - delay).abs() < 2.5 / rate),
            "{case}: {rejection}"
        );
    }
}

#[test]
fn regress_overload_of_an_integer_file_rejects_its_tap_alone() {
    let rate = 5120.0;
    let times: Vec<f64> = (0..5).map(|tap| 0.3 + f64::from(tap)).collect();
    for (format, channel) in [
        (WavFormat::Pcm16, 0),
        (WavFormat::Pcm16, 1),
        (WavFormat::Pcm24, 0),
        (WavFormat::Pcm24, 1),
    ] {
        // File units: full scale is 1; the fourth tap goes to 1.3 on one of the channels.
        let peak = |tap: usize, of: usize| {
            if tap == 3 && of == channel { 1.3 } else { 0.7 }
        };
        let pulses: Vec<Pulse> = times
            .iter()
            .enumerate()
            .map(|(tap, &time)| pulse(time, 2e-3, peak(tap, 0)))
            .collect();
        let mut hammer = force(rate, 5.3, &pulses, Shape::SineSquared);
        let mut response = vec![0.0; hammer.len()];
        for (tap, &time) in times.iter().enumerate() {
            let amplitude = peak(tap, 1);
            let one = ringing(rate, 5.3, &[time], &[(90.0, 0.02, amplitude)]);
            response.iter_mut().zip(one).for_each(|(sum, x)| *sum += x);
        }
        let mut noise = random(11);
        add_noise(&mut hammer, 1e-4, &mut noise);
        add_noise(&mut response, 1e-4, &mut noise);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clipped.wav");
        let clipped = write_wav(&path, 5120, &[hammer, response], format).unwrap();
        assert!(clipped > 0, "{format:?}: nothing was clipped");
        let mut opened = Recording::open(&path, &ReadSettings::default()).unwrap();
        // A negative scale must not hide the limit.
        opened.set_scale(channel, -50.0).unwrap();
        let source = TapSource::Hammer {
            channel: 0,
            responses: vec![1],
        };
        let taps = find_taps(&opened, &source, &TapSettings::default()).unwrap();
        let case = format!("{format:?}, channel {channel}");
        match only_rejected(&taps, 5, 3, &case) {
            Rejection::Overload(overload) => {
                assert_eq!(overload.channel, channel + 1, "{case}");
                assert_eq!(overload.samples as u64, clipped, "{case}");
            }
            other => panic!("{case}: {other}"),
        }
    }
}

#[test]
fn regress_flat_tops_of_a_float_recording_are_an_overload() {
    let rate = 12_800.0;
    for channel in [0, 1] {
        let times = [0.3, 1.3, 2.3, 3.3];
        let pulses = times.map(|time| {
            let peak = if time == 1.3 && channel == 0 {
                60.0
            } else {
                30.0
            };
            pulse(time, 2e-3, peak)
        });
        let mut hammer = force(rate, 4.3, &pulses, Shape::HalfSine);
        add_noise(&mut hammer, 0.01, &mut random(21));
        let mut response = vec![0.0; hammer.len()];
        for time in times {
            let amplitude = if time == 1.3 && channel == 1 {
                90.0
            } else {
                50.0
            };
            let one = ringing(rate, 4.3, &[time], &[(75.0, 0.02, amplitude)]);
            response.iter_mut().zip(one).for_each(|(sum, x)| *sum += x);
        }
        add_noise(&mut response, 0.01, &mut random(22));
        // The amplifier's supply ends here, the file's numbers do not.
        let (high, low) = (45.0, 60.0);
        hammer.iter_mut().for_each(|x| *x = x.clamp(-high, high));
        response.iter_mut().for_each(|x| *x = x.clamp(-low, low));
        let recording = recording(rate, vec![hammer, response]);
        let source = TapSource::Hammer {
            channel: 0,
            responses: vec![1],
        };
        let taps = find_taps(&recording, &source, &TapSettings::default()).unwrap();
        let case = format!("channel {channel}");
        let rejection = only_rejected(&taps, 4, 1, &case);
        assert!(
            matches!(rejection, Rejection::Overload(found) if found.channel == channel + 1 && found.samples >= 3),
            "{case}: {rejection}"
        );
    }
}

/// Decays of 300 Hz at 2048 Hz, cut off: seven samples a period, so that each crest has one or two.
fn cut_off(limit: f64) -> Recording {
    let rate = 2048.0;
    let mut samples = ringing(rate, 6.0, &[0.5, 3.0], &[(300.3, 0.002, 1.0)]);
    add_noise(&mut samples, 1e-4, &mut random(5));
    samples.iter_mut().for_each(|x| *x = x.clamp(-limit, limit));
    recording(rate, vec![samples])
}

fn keep() -> TapSettings {
    TapSettings {
        keep_overload: true,
        ..TapSettings::default()
    }
}

#[test]
fn recover_overloaded_taps_from_where_they_are_whole() {
    let recording = cut_off(0.8);
    assert_eq!(
        recording.channels()[0].health.rails,
        [Some(-0.8), Some(0.8)]
    );
    let source = TapSource::Responses(vec![0]);
    let taps = find_taps(&recording, &source, &TapSettings::default()).unwrap();
    assert_eq!(taps.accepted().count(), 0);
    assert_eq!(taps.remarks, [TapRemark::AllOverloaded { count: 2 }]);
    let taps = find_taps(&recording, &source, &keep()).unwrap();
    assert_eq!(taps.remarks, [TapRemark::OverloadKept { count: 2 }]);
    assert_eq!(taps.accepted().count(), 2);
    for tap in taps.accepted() {
        // No sample that is used lies on a rail.
        let used = recording
            .read(0, tap.usable_from()..tap.record.end)
            .unwrap();
        let most = used.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        assert!(most < 0.8 && most > 0.7, "{most}");
        assert_eq!(used.len() as u64, tap.frames());
    }
}

#[test]
fn prop_a_pair_of_equal_samples_at_the_extreme_is_a_rail() {
    let mut samples = ringing(2048.0, 3.0, &[0.5], &[(300.3, 0.02, 1.0)]);
    add_noise(&mut samples, 1e-4, &mut random(5));
    let largest = samples.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    // The crest and one sample beside it are set to one value that has many digits.
    let crest = samples.iter().position(|x| x.abs() == largest).unwrap();
    let beside = [crest - 1, crest + 1]
        .into_iter()
        .max_by(|a, b| (samples[*a] * samples[crest]).total_cmp(&(samples[*b] * samples[crest])))
        .unwrap();
    samples[beside] = samples[crest];
    let health = &recording(2048.0, vec![samples]).channels()[0]
        .health
        .clone();
    assert_eq!(
        health.rails.iter().flatten().count(),
        1,
        "{:?}",
        health.rails
    );
}

#[test]
fn limit_crests_are_no_rails() {
    assert_eq!(cut_off(9.0).channels()[0].health.rails, [None, None]);
    let mut decay = ringing(5120.0, 20.0, &[0.5], &[(40.3, 0.0005, 0.9)]);
    add_noise(&mut decay, 1e-5, &mut random(7));
    // A steady tone in steps of 16 bits has the same highest value again and again, and so has one that repeats itself.
    let tone = |n: u32| 0.25 * (0.1 * f64::from(n)).sin();
    let repeated = |n: u32| (std::f64::consts::TAU * f64::from(n % 8) / 8.0).sin();
    let signals: [Vec<f64>; 3] = [
        (0..200_000).map(tone).collect(),
        (0..20_000).map(repeated).collect(),
        decay,
    ];
    for signal in signals {
        // Steps of 16 and of 12 bits, and printed numbers of five and of four digits.
        let bits = |bits: i32| {
            let full = 2f64.powi(bits - 1);
            signal.iter().map(|x| (x * full).round() / full).collect()
        };
        let digits = |digits: usize| {
            let texts = signal.iter().map(|x| format!("{x:.0$e}", digits - 1));
            texts.map(|text| text.parse().unwrap()).collect()
        };
        let all: [Vec<f64>; 5] = [signal.clone(), bits(16), bits(12), digits(5), digits(4)];
        for (case, samples) in all.into_iter().enumerate() {
            let health = &recording(5120.0, vec![samples]).channels()[0]
                .health
                .clone();
            assert_eq!(health.rails, [None, None], "case {case}");
        }
    }
}

#[test]
fn prop_the_clipped_pulse_of_a_hammer_spoils_no_decay() {
    let rate = 12_800.0;
    let times = [0.3, 1.3, 2.3];
    let pulses = times.map(|time| pulse(time, 2e-3, if time == 1.3 { 60.0 } else { 30.0 }));
    let mut hammer = force(rate, 3.3, &pulses, Shape::HalfSine);
    add_noise(&mut hammer, 0.01, &mut random(21));
    hammer.iter_mut().for_each(|x| *x = x.min(45.0));
    let mut response = ringing(rate, 3.3, &times, &[(75.0, 0.02, 50.0)]);
    add_noise(&mut response, 0.01, &mut random(22));
    let recording = recording(rate, vec![hammer, response]);
    let source = TapSource::Hammer {
        channel: 0,
        responses: vec![1],
    };
    let taps = find_taps(&recording, &source, &keep()).unwrap();
    assert_eq!(taps.accepted().count(), 3);
    let whole: Vec<bool> = taps.accepted().map(Tap::is_whole).collect();
    assert_eq!(whole, [true, false, true]);
    assert_eq!(taps.taps[1].usable_from(), taps.taps[1].record.start);
}

#[test]
fn regress_a_weak_tap_is_named_as_such() {
    let (_, samples) = five_taps((5120.0, 31), Shape::SineSquared, |pulses| {
        pulses[3].peak = 3.0;
    });
    let taps = hammer_taps(5120.0, samples);
    match only_rejected(&taps, 5, 3, "3 N beside 40 N") {
        Rejection::TooWeak { peak, limit } => {
            // 8 samples per pulse miss the crest by 4 % at most, noise is 0.01 N.
            assert!((peak - 3.0).abs() < 0.2, "{peak}");
            // A tenth of the median of the five peaks drawn between 32 and 48 N.
            assert!((3.2..4.8).contains(limit), "{limit}");
        }
        other => panic!("{other}"),
    }
    let (_, samples) = five_taps((5120.0, 31), Shape::SineSquared, |pulses| {
        pulses[3].peak = 6.0;
    });
    assert_all_accepted(&hammer_taps(5120.0, samples), 5, "6 N beside 40 N");
}

#[test]
fn regress_short_records_say_what_cut_them() {
    let rate = 5120.0;
    let taps_at = |times: &[f64], seconds: f64| {
        let pulses: Vec<Pulse> = times.iter().map(|&t| pulse(t, 1.5e-3, 30.0)).collect();
        let mut samples = force(rate, seconds, &pulses, Shape::HalfSine);
        add_noise(&mut samples, 0.01, &mut random(41));
        hammer_taps(rate, samples)
    };
    let near = |value: f64, expected: f64| (value - expected).abs() < 0.02;

    let taps = taps_at(&[0.5, 2.5, 4.5, 6.5], 7.1);
    match only_rejected(&taps, 4, 3, "the file ends") {
        // 0.6 s and the 10 ms before the trigger.
        Rejection::CutOff { available, needed } => {
            assert!(
                near(*available, 0.61) && near(*needed, 1.0),
                "{available} {needed}"
            );
        }
        other => panic!("{other}"),
    }

    let taps = taps_at(&[0.5, 2.5, 3.1, 5.1, 7.1], 9.1);
    match only_rejected(&taps, 5, 1, "the next tap comes") {
        Rejection::NextTooSoon { available, needed } => {
            assert!(
                near(*available, 0.6) && near(*needed, 1.0),
                "{available} {needed}"
            );
        }
        other => panic!("{other}"),
    }

    // A last record of 90 % is worth keeping, one of 70 % would shorten all others.
    assert_all_accepted(&taps_at(&[0.5, 2.5, 4.5], 6.3), 3, "90 %");
    let taps = taps_at(&[0.5, 2.5, 4.5], 5.9);
    let rejection = only_rejected(&taps, 3, 2, "70 %");
    assert!(matches!(rejection, Rejection::CutOff { .. }), "{rejection}");

    // A block of 0.5 s asked for: 0.6 s is enough for it.
    let pulses = [0.5, 2.5, 4.5, 6.5].map(|time| pulse(time, 1.5e-3, 30.0));
    let mut samples = force(rate, 7.1, &pulses, Shape::HalfSine);
    add_noise(&mut samples, 0.01, &mut random(42));
    let recording = recording(rate, vec![samples]);
    let settings = TapSettings {
        wanted: Some(0.5),
        ..TapSettings::default()
    };
    let taps = find_taps(&recording, &hammer_alone(), &settings).unwrap();
    assert_all_accepted(&taps, 4, "a block of 0.5 s");
}

// ---------------------------------------------------------------- without a hammer

#[test]
fn recover_taps_of_a_response_whose_modes_beat() {
    let rate = 5120.0;
    for seed in 0..40 {
        let mut draw = random(seed);
        let times: Vec<f64> = (0..5)
            .map(|tap| 0.5 + 1.6 * f64::from(tap) + draw.random_range(0.0..0.1))
            .collect();
        // Two modes 1 to 15 Hz apart beat against each other, two more ring beside them.
        let low = draw.random_range(60.0..250.0);
        let near = low + draw.random_range(1.0..15.0);
        let modes = [
            (low, draw.random_range(0.002..0.02), 10.0),
            (
                near,
                draw.random_range(0.002..0.02),
                draw.random_range(5.0..10.0),
            ),
            (draw.random_range(300.0..700.0), 0.005, 8.0),
            (draw.random_range(900.0..1800.0), 0.003, 8.0),
        ];
        let mut first = ringing(rate, 8.6, &times, &modes);
        let weaker: Vec<(f64, f64, f64)> = modes.iter().map(|&(f, d, a)| (f, d, 0.3 * a)).collect();
        let mut second = ringing(rate, 8.6, &times, &weaker);
        add_noise(&mut first, 0.01, &mut draw);
        add_noise(&mut second, 0.01, &mut draw);
        second.iter_mut().for_each(|x| *x += 3.0);
        let recording = recording(rate, vec![first, second]);
        let source = TapSource::Responses(vec![0, 1]);
        let taps = find_taps(&recording, &source, &TapSettings::default()).unwrap();
        let case = format!("seed {seed}: {modes:?}");
        assert_all_accepted(&taps, 5, &case);
        for (tap, time) in taps.taps.iter().zip(&times) {
            // Within a few milliseconds: the response has to rise above 5 % of its peak.
            assert!(
                (tap.time - time).abs() < 5e-3,
                "{case}: {} s for {time} s",
                tap.time
            );
            assert_eq!(tap.pulse_end, None, "{case}");
        }
        for pair in taps.taps.windows(2) {
            assert_eq!(pair[0].record.end, pair[1].record.start, "{case}");
        }
    }
}

#[test]
fn regress_a_weak_response_tap_and_a_cut_off_one() {
    let rate = 5120.0;
    let modes = [(100.0, 0.01, 10.0), (350.0, 0.005, 5.0)];
    let mut samples = ringing(rate, 8.3, &[0.5, 2.5, 6.5], &modes);
    let weak: Vec<(f64, f64, f64)> = modes.iter().map(|&(f, d, a)| (f, d, 0.06 * a)).collect();
    let one = ringing(rate, 8.3, &[4.5], &weak);
    samples.iter_mut().zip(one).for_each(|(sum, x)| *sum += x);
    add_noise(&mut samples, 5e-3, &mut random(51));
    let found = |samples: Vec<f64>| {
        let recording = recording(rate, vec![samples]);
        let source = TapSource::Responses(vec![0]);
        find_taps(&recording, &source, &TapSettings::default()).unwrap()
    };
    let taps = found(samples.clone());
    let rejection = only_rejected(&taps, 4, 2, "6 % of the others");
    assert!(
        matches!(rejection, Rejection::TooWeak { .. }),
        "{rejection}"
    );
    samples.truncate((6.9 * rate) as usize);
    let taps = found(samples);
    let last = taps.taps.last().expect("four taps");
    assert!(
        matches!(last.rejection, Some(Rejection::CutOff { .. })),
        "{:?}",
        reasons(&taps)
    );
}

// ---------------------------------------------------------------- nothing to find

#[test]
fn limit_constant_and_short_channels_hold_no_taps() {
    let sources = [
        hammer_alone(),
        TapSource::Responses(vec![0]),
        TapSource::Responses(Vec::new()),
    ];
    for source in &sources {
        for (what, samples) in [
            ("zeros", vec![0.0; 5000]),
            ("an offset", vec![0.1; 5000]),
            ("a large offset", vec![-1e90; 5000]),
            ("one sample", vec![3.0]),
            ("two samples", vec![3.0, 3.0]),
        ] {
            let recording = recording(5120.0, vec![samples]);
            let taps = find_taps(&recording, source, &TapSettings::default()).unwrap();
            assert!(
                taps.taps.is_empty(),
                "{what}, {source:?}: {:?}",
                reasons(&taps)
            );
            assert!(taps.remarks.is_empty(), "{what}: {:?}", taps.remarks);
            assert_eq!(taps.shortest(), None, "{what}");
            assert_eq!(taps.quiet, 0..0, "{what}");
        }
    }
}

#[test]
fn limit_noise_alone_holds_no_taps() {
    for seed in 0..20 {
        let mut samples = vec![0.0; 50_000];
        add_noise(&mut samples, 0.3, &mut random(seed));
        let recording = recording(5120.0, vec![samples]);
        for source in [hammer_alone(), TapSource::Responses(vec![0])] {
            let taps = find_taps(&recording, &source, &TapSettings::default()).unwrap();
            assert!(
                taps.taps.is_empty(),
                "seed {seed}, {source:?}: {:?}",
                reasons(&taps)
            );
        }
    }
}

/// A sample of any size that a recording may hold, small ones and ties more often.
fn any_sample() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1.0..1.0,
        2 => Just(0.0),
        1 => Just(1.0),
        1 => -1e100..1e100,
        1 => -1e-300..1e-300,
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20244),
        ..ProptestConfig::with_cases(300)
    })]

    #[test]
    fn prop_arbitrary_samples_never_panic(
        samples in proptest::collection::vec((any_sample(), any_sample()), 1..600),
        rate in -3.0..7.0f64,
        wanted in proptest::option::of(0.0..100.0f64),
    ) {
        let (first, second): (Vec<f64>, Vec<f64>) = samples.into_iter().unzip();
        let frames = first.len() as u64;
        let recording = recording(10f64.powf(rate), vec![first, second]);
        let settings = TapSettings { wanted, ..TapSettings::default() };
        let sources = [
            TapSource::Hammer { channel: 0, responses: vec![1] },
            TapSource::Responses(vec![0, 1]),
        ];
        for source in &sources {
            let taps = find_taps(&recording, source, &settings).unwrap();
            for tap in &taps.taps {
                prop_assert!(tap.record.start <= tap.record.end && tap.record.end <= frames);
                prop_assert!(tap.time >= 0.0 && tap.time < recording.duration());
            }
            // Below some hundred samples per second the least distance is a few samples long.
            for pair in taps.taps.windows(2).filter(|_| rate > 2.5) {
                prop_assert!(pair[0].time < pair[1].time);
                prop_assert!(pair[0].record.end == pair[1].record.start);
            }
        }
    }
}
