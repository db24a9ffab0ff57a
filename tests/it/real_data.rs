//! The whole chain on recordings made by others, in the folder that TAPJOINT_DATA names.
//!
//! Expected values were published with the recordings, or computed from the files by other programs.

use crate::shared::data;
use std::fs;
use std::path::Path;

use crate::amplitude::at_time;
use tapjoint::description::{ChannelRef, TestDescription};
use tapjoint::modal::amplitude::{AmplitudeVerdict, Decay, KnownMode, follow_amplitude};
use tapjoint::pipeline::{
    Analysis, Estimate, IdentifySettings, measured_shapes, run_recording, run_test, sampled_shapes,
    shape_agreement,
};
use tapjoint::recording::{ReadSettings, Recording};
use tapjoint::taps::{Rejection, Tap};

fn analyse(path: &Path, hammer: Option<ChannelRef>) -> Analysis {
    let recording =
        Recording::open(path, &ReadSettings::default()).unwrap_or_else(|error| panic!("{error}"));
    run_recording(recording, hammer.as_ref(), |_| {}).unwrap_or_else(|error| panic!("{error}"))
}

fn describe(text: &str, folder: &Path) -> Analysis {
    let test = TestDescription::parse(text, "test.toml").unwrap_or_else(|error| panic!("{error}"));
    run_test(&test, (folder, "test.toml"), &IdentifySettings::default())
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Frequencies of everything taken for a mode (Hz).
fn modes(analysis: &Analysis) -> Vec<f64> {
    analysis
        .modes
        .iter()
        .filter(|mode| mode.mode.is_some())
        .map(|mode| mode.frequency)
        .collect()
}

/// The mode nearest to each expected frequency lies within `tolerance` (Hz).
fn assert_has(analysis: &Analysis, expected: &[f64], tolerance: f64) {
    let found = modes(analysis);
    for &frequency in expected {
        let nearest = found
            .iter()
            .copied()
            .min_by(|a, b| (a - frequency).abs().total_cmp(&(b - frequency).abs()));
        assert!(
            nearest.is_some_and(|nearest| (nearest - frequency).abs() <= tolerance),
            "{}: {frequency} Hz expected within {tolerance} Hz, the modes are {found:?}",
            analysis.name
        );
    }
}

fn codes(analysis: &Analysis) -> Vec<&str> {
    analysis.warnings.iter().map(|w| w.code).collect()
}

const SPRUCE: &str = "guitar_tap_wav/brace-umik-1-swift-mac-1778816093.wav";

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_spruce_bar_rings_at_its_published_frequency() {
    let path = data(SPRUCE);
    let analysis = analyse(&path, None);
    let taps: Vec<&Tap> = analysis.recordings[0].measurement.taps.accepted().collect();
    assert_eq!(taps.len(), 1, "{taps:?}");
    // The file's own description has the tap at 2.924 s; 20 ms are a fiftieth of the ringing.
    assert!((taps[0].time - 2.924).abs() < 0.02, "{} s", taps[0].time);
    // Published 512.69 Hz within 1 Hz; our own reading by other programs 512.70 Hz.
    assert_has(&analysis, &[512.7], 0.5);
    let mode = analysis
        .modes
        .iter()
        .find(|mode| mode.mode.is_some() && (mode.frequency - 512.7).abs() < 0.5)
        .expect("asserted above");
    let damping = mode.reading.as_ref().and_then(|r| r.damping_ratio);
    let damping = damping.expect("a damping ratio of a clear resonance");
    // 0.0040 by another method; two methods agree to 15 % at best.
    assert!((damping / 0.0040 - 1.0).abs() < 0.15, "damping {damping}");
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_spruce_bar_has_its_published_modulus() {
    let path = data(SPRUCE);
    let text = format!(
        r#"name = "spruce bar"
[beam]
length = "556 mm"
width = "20.4 mm"
thickness = "29.4 mm"
modulus = "10 GPa"
density = {}
[joint]
kind = "free"
beam = "euler"
[[sensor]]
name = "microphone"
channel = 1
kind = "sound"
position = "278 mm"
[[recording]]
file = '{}'
[analysis]
fit_modes = 1
"#,
        0.128 / (0.556 * 0.0204 * 0.0294),
        path.display()
    );
    let analysis = describe(&text, Path::new("."));
    let identification = analysis.identification.expect("a described test");
    let Some(Estimate::FreeBeam(found)) = identification.estimate else {
        panic!("no estimate: {:?}", identification.reason);
    };
    let modulus = found.modulus.value / 1e9;
    // Published 10.541 +-0.05 GPa (Euler), 10.557 by other programs from the same file.
    assert!((modulus / 10.55 - 1.0).abs() < 0.005, "E = {modulus} GPa");
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_eight_taps_on_a_guitar() {
    let path = data("guitar_tap_wav/Recording.wav");
    let analysis = analyse(&path, None);
    let onsets = [2.371, 4.284, 6.075, 7.916, 9.717, 11.432, 13.176, 14.969];
    let taps = &analysis.recordings[0].measurement.taps.taps;
    assert_eq!(taps.len(), onsets.len(), "{taps:?}");
    for (tap, onset) in taps.iter().zip(onsets) {
        assert!(tap.accepted(), "{tap:?}");
        // What the onsets themselves are good for.
        assert!(
            (tap.time - onset).abs() < 0.02,
            "{} s for {onset} s",
            tap.time
        );
    }
    // Published per tap: air resonance 87.20 to 87.26 Hz, top plate 163.99 to 164.16 Hz.
    assert_has(&analysis, &[87.2, 164.0], 0.4);
    // What a fit says of a peak lies at that peak: two half lines and the half-power width away at most.
    let readings = analysis
        .recordings
        .iter()
        .flat_map(|r| &r.measurement.spectra);
    for reading in readings.flat_map(|spectra| &spectra.readings) {
        let Some(fit) = reading
            .fit
            .as_ref()
            .filter(|_| reading.prominence_db.is_some())
        else {
            continue;
        };
        let (frequency, damping) = (fit.mode.frequency.value, fit.mode.damping_ratio.value);
        let off = (frequency - reading.line_frequency).abs();
        let allowed = 2.0 * reading.half_line + 2.0 * damping * frequency;
        assert!(
            off <= allowed,
            "{frequency} Hz on {} Hz",
            reading.line_frequency
        );
    }
}

const BOLTED: &str = "brb_bolted_beam/DERIVED_HammerImpact_3acc_float32.wav";

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_bolted_beam_rings_at_its_four_bending_modes() {
    let path = data(BOLTED);
    let analysis = analyse(&path, None);
    let taps = &analysis.recordings[0].measurement.taps.taps;
    assert_eq!(taps.len(), 1, "{taps:?}");
    // By other programs; the first softens with amplitude by 0.25 Hz over the record.
    assert_has(&analysis, &[80.5, 297.7, 580.7, 845.7], 0.4);
}

/// The description of the bolted beam, its left sensor with a scale of this sign.
fn bolted_beam(left: f64) -> String {
    let path = data(BOLTED);
    format!(
        r#"name = "Brake-Reuss beam"
[beam]
length = 0.72
width = "25.4 mm"
thickness = "12.7 mm"
modulus = "192 GPa"
density = 7861
[joint]
kind = "lap"
beam = "euler"
[[sensor]]
name = "left"
channel = 1
scale = {left:?}
position = "25.4 mm"
[[sensor]]
name = "right"
channel = 2
position = "554.9 mm"
[[sensor]]
name = "end"
channel = 3
position = "643.8 mm"
[[recording]]
file = '{}'
[analysis]
fit_modes = 4
"#,
        path.display()
    )
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_shapes_of_the_bolted_beam_show_how_its_sensors_are_mounted() {
    // Signs of sensors are not stated. With the left one mounted the other way all four shapes are those of the model,
    // though its frequencies are 5 % off; as they stand none is.
    for (left, least, most) in [(-1.0, 0.98, 1.0), (1.0, 0.0, 0.2)] {
        let analysis = describe(&bolted_beam(left), Path::new("."));
        let predicted = sampled_shapes(&analysis);
        let measured = measured_shapes(&analysis, &predicted);
        let agreement = shape_agreement(&measured, &predicted).unwrap();
        assert_eq!(
            (agreement.places, &agreement.measured[..4]),
            (3, &[1, 2, 3, 4][..])
        );
        for (row, values) in agreement.values.iter().take(4).enumerate() {
            let own = values[row];
            assert!(
                (least..=most).contains(&own),
                "left {left}, mode {}: {own}",
                row + 1
            );
        }
    }
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_bolted_beam_is_no_pair_of_springs() {
    let analysis = describe(&bolted_beam(1.0), Path::new("."));
    // No two springs at mid-span have these frequencies (the best miss them by 5 %): the regression
    // leaves them outside what a spring can be, and a user must be told.
    let codes = codes(&analysis);
    for code in ["unphysical", "closure"] {
        assert!(codes.contains(&code), "{code}: {:?}", analysis.warnings);
    }
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_bolted_beam_softens_with_amplitude() {
    let path = data(BOLTED);
    let recording = Recording::open(&path, &ReadSettings::default()).unwrap();
    let all = 0..recording.frames();
    let decay = Decay {
        start: 0.0,
        sample_rate: recording.sample_rate(),
        responses: (0..3)
            .map(|channel| recording.read(channel, all.clone()).unwrap())
            .collect(),
    };
    let peaks = [80.47, 297.66, 458.4, 580.66, 845.7, 1526.8];
    let modes = peaks.map(|frequency| KnownMode {
        frequency,
        damping_ratio: 0.0015,
        amplitude_part: None,
    });
    let curves = follow_amplitude(&[decay], &modes, &[]).curves;
    let change = |mode: usize| {
        assert_eq!(curves[mode].verdict, AmplitudeVerdict::Changes);
        let early = at_time(&curves[mode], 0, 0.1).expect("the decay's start");
        let late = at_time(&curves[mode], 0, 3.0).expect("visible for 3 s");
        let rise = late.frequency - early.frequency;
        let bound = early.frequency_bound.hypot(late.frequency_bound);
        (rise, bound, late.damping_ratio / early.damping_ratio)
    };
    // By other programs from the same file: 80.29 Hz, 0.0025 at 0.1 s, 80.54 Hz, 0.0015 at 3 s.
    let (rise, bound, damping) = change(0);
    assert!((0.20..0.30).contains(&rise) && bound < 0.03, "{rise} Hz");
    assert!((0.45..0.75).contains(&damping), "{damping}");
    // Least squares of 0.15 s each by another program: 297.45 Hz about 0.1 s, 297.74 Hz about 3 s.
    let (rise, bound, _) = change(1);
    assert!((0.15..0.33).contains(&rise) && bound < 0.06, "{rise} Hz");
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_laboratory_cantilever_with_its_hammer_and_without() {
    let path = data("slater_cantilever/DERIVED_case1_time.csv");
    for hammer in [None, Some(ChannelRef::Number(1))] {
        let with_hammer = hammer.is_some();
        let analysis = analyse(&path, hammer);
        // Published 212.0925 Hz; 34.05 Hz by other programs.
        assert_has(&analysis, &[34.05, 212.09], 0.2);
        let found = modes(&analysis);
        assert_eq!(found.len(), 2, "hammer {with_hammer}: {found:?}");
        if with_hammer {
            // Its drifting baseline is no second hit.
            let taps = &analysis.recordings[0].measurement.taps.taps;
            assert!(taps.iter().all(|tap| tap.second_hit.is_none()), "{taps:?}");
            // One record: nothing shows how well it repeats.
            let codes = codes(&analysis);
            assert!(codes.contains(&"single-tap"), "{codes:?}");
        }
    }
}

/// Rows of the README's table: the recording and its true frequencies (Hz).
fn truth(readme: &str) -> Vec<(String, Vec<f64>)> {
    readme
        .lines()
        .filter_map(|line| {
            let mut cells = line.trim_matches('|').split('|').map(str::trim);
            let file = cells.next().filter(|file| file.ends_with(".wav"))?;
            let row: Option<Vec<f64>> = cells.map(|cell| cell.parse().ok()).collect();
            Some((file.to_string(), row?))
        })
        .collect()
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn recover_everything_about_a_cantilever_simulated_elsewhere() {
    let folder = data("independent_cantilever");
    let text = fs::read_to_string(folder.join("test.toml")).unwrap();
    let readme = fs::read_to_string(folder.join("README.md")).unwrap();
    let analysis = describe(&text, &folder);
    let rows = truth(&readme);
    assert_eq!(rows.len(), 5, "{readme}");
    let dampings = [0.00508, 0.00584, 0.00184, 0.00153, 0.00412, 0.00450];
    for (recording, (file, frequencies)) in analysis.recordings.iter().zip(&rows) {
        assert_eq!(&recording.file, file);
        let spectra = recording.measurement.spectra.as_ref();
        let spectra = spectra.unwrap_or_else(|| panic!("{file}: no taps"));
        for (mode, (&frequency, damping)) in frequencies.iter().zip(dampings).enumerate() {
            let number = Some(mode + 1);
            let place = recording.mode_numbers.iter().position(|&n| n == number);
            let reading = place.map(|place| &spectra.readings[place]);
            let reading = reading.unwrap_or_else(|| panic!("{file}: mode {} is missing", mode + 1));
            // The table has four decimals; mode 1 lasts 90 periods, so 0.002 Hz are the least bound.
            let bound = reading
                .between
                .map_or(0.0, |between| between.bound)
                .max(0.002);
            assert!(
                (reading.frequency - frequency).abs() <= bound,
                "{file}, mode {}: {} Hz for {frequency} Hz, bound {bound} Hz",
                mode + 1,
                reading.frequency
            );
            let found = reading.damping_ratio.unwrap_or(f64::NAN);
            // The truth has three digits, 0.3 %; the records ring down to 0.1 %.
            assert!(
                (found / damping - 1.0).abs() < 0.02,
                "{file}, mode {}: damping {found} for {damping}",
                mode + 1
            );
        }
        for (index, tap) in recording.measurement.taps.taps.iter().enumerate() {
            let twice = matches!((file.as_str(), index), ("r4.wav", 1) | ("r5.wav", 3));
            assert_eq!(
                tap.second_hit.is_some(),
                twice,
                "{file}, tap {}: {tap:?}",
                index + 1
            );
            match &tap.rejection {
                Some(Rejection::DoubleHit { .. }) if twice => {}
                None if !twice => {}
                other => panic!("{file}, tap {}: {other:?}", index + 1),
            }
        }
        assert_eq!(recording.measurement.taps.taps.len(), 5, "{file}");
    }
    let identification = analysis.identification.expect("a described test");
    let Some(Estimate::Joint(joint)) = identification.estimate else {
        panic!("no estimate: {:?}", identification.reason);
    };
    let found = joint.pairs.stiffnesses().expect("finite stiffnesses");
    let (kx, ky) = (found.kx, found.ky);
    // True frequencies with errors of 1e-5 move Kx and Ky by some 1e-4 at most.
    assert!((kx / 822.560 - 1.0).abs() < 1e-3, "Kx {kx}");
    assert!((ky / 5.4840 - 1.0).abs() < 2e-3, "Ky {ky}");
    let consistent = identification.consistent.expect("the main estimate");
    assert!((consistent.joint.kx / 822.560 - 1.0).abs() < 1e-3);
    assert!((consistent.joint.ky / 5.4840 - 1.0).abs() < 1e-3);
}
