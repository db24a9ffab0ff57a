//! Universal files that analysers and other programs wrote.

use tapjoint_signal::recording::{
    Abscissa, FunctionType, ReadSettings, ResponseForm, list_datasets, open_frequency_responses,
};

use super::{data, function, open, samples};
use crate::recording::assert_message;

fn message(name: &str) -> String {
    let path = data(name);
    let message = open(&path).expect_err(name).to_string();
    let file = path.file_name().unwrap().to_string_lossy().into_owned();
    message[message.find(&file).unwrap()..].to_owned()
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_each_case_is_the_same_as_text_and_in_binary() {
    for case in 1..=8 {
        let name = |form: &str| format!("ufffiles_jl_uff/dataset58_case{case}_{form}.unv");
        let text = function(&data(&name("ascii")), 1);
        let binary = function(&data(&name("binary")), 1);
        let points = if [1, 2, 5, 6].contains(&case) {
            1602
        } else {
            801
        };
        assert_eq!(
            (text.real.len(), binary.real.len()),
            (points, points),
            "case {case}"
        );
        assert_eq!(text.abscissa.is_some(), case % 2 == 0, "case {case}");
        // Six digits of single, thirteen of double precision; the abscissa has six in every case.
        let digits = if case > 4 { 5.1e-13 } else { 5.1e-6 };
        let near = |a: &[f64], b: &[f64], digits: f64| {
            a.len() == b.len()
                && a.iter()
                    .zip(b)
                    .all(|(a, b)| (a - b).abs() <= digits * b.abs().max(1e-30))
        };
        assert!(near(&text.real, &binary.real, digits), "case {case}");
        let columns = [
            (&text.imaginary, &binary.imaginary, digits),
            (&text.abscissa, &binary.abscissa, 5.1e-6),
        ];
        for (a, b, digits) in columns {
            let (a, b) = (
                a.as_deref().unwrap_or_default(),
                b.as_deref().unwrap_or_default(),
            );
            assert!(near(a, b, digits), "case {case}");
        }
    }
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_a_microphone_as_text_and_in_binary() {
    let names = [
        "pyuff_uff/Sample_UFF58_ascii.uff",
        "pyuff_uff/Sample_UFF58b_bin.uff",
    ];
    let [text, binary] =
        names.map(|name| open(&data(name)).unwrap_or_else(|error| panic!("{error}")));
    for recording in [&text, &binary] {
        assert_eq!(
            (recording.frames(), recording.sample_rate()),
            (79_292, 65_536.0)
        );
        let channel = &recording.channels()[0];
        assert_eq!(
            (channel.name.as_deref(), channel.unit.as_deref()),
            (Some("Mic 01"), Some("Pa"))
        );
    }
    let (a, b) = (samples(&text), samples(&binary));
    let worst = a[0]
        .iter()
        .zip(&b[0])
        .fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
    // Published for this pair: 4.96e-7.
    assert!((worst - 4.96e-7).abs() < 0.005e-7, "{worst}");
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_four_accelerometers() {
    let path = data("pyuff_uff/MPSTD#Set001_2024_10_08_10_27_07.uff");
    let recording = open(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        (recording.frames(), recording.sample_rate()),
        (222_400, 3200.0)
    );
    let names: Vec<_> = recording
        .channels()
        .iter()
        .filter_map(|c| c.name.as_deref())
        .collect();
    assert_eq!(
        names,
        [
            "MPS set1 Dof1",
            "MPS set1 Dof2",
            "MPS set1 Dof3",
            "MPS set1 Dof4"
        ]
    );
    assert!(
        recording
            .channels()
            .iter()
            .all(|c| c.unit.as_deref() == Some("m/s2"))
    );
    // The fourth has the place of the first.
    assert!(
        recording
            .warnings()
            .iter()
            .any(|warning| warning.code() == "repeated-place")
    );
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_truncated_padded_and_run_together() {
    let path = data("pyuff_uff/dataset_milestone_in_header.uff");
    let recording = open(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(recording.frames(), 42);
    assert!(
        recording.warnings()[0]
            .to_string()
            .contains("42 of the promised 2508876")
    );
    let cases = [
        // Name, samples, rate (Hz), channel's name, unit.
        ("pyuff_uff/binary8byte.uff", 250, 100.0, "sine 5 Hz", "m/s2"),
        (
            "pyuff_uff/time-history-not-all-columns-filled.uff",
            13,
            20_000.0,
            "1x",
            "m/s2",
        ),
        (
            "ufffiles_jl_uff/dataset58_time.unv",
            4096,
            2048.0,
            ".1.Z-",
            "N",
        ),
        (
            "ufffiles_jl_uff/dataset58_nospacing.uff",
            66,
            1.0 / 4.99942e-4,
            "1:+RZ",
            "(V^2)",
        ),
    ];
    for (name, frames, rate, channel, unit) in cases {
        let path = data(name);
        let recording = open(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(
            (recording.frames(), recording.sample_rate()),
            (frames, rate),
            "{name}"
        );
        let info = &recording.channels()[0];
        assert_eq!(
            (info.name.as_deref(), info.unit.as_deref()),
            (Some(channel), Some(unit)),
            "{name}"
        );
    }
    let force = open(&data("ufffiles_jl_uff/dataset58_time.unv")).unwrap();
    // Published: 114.833 N, six digits.
    assert!((force.channels()[0].health.peak - 114.833).abs() < 5e-4);
    let together = open(&data("ufffiles_jl_uff/dataset58_nospacing.uff")).unwrap();
    assert_eq!(
        samples(&together)[0][..3],
        [-3.09944e-4, -2.74181e-4, -0.001_156_33]
    );
    let acceleration = open(&data("pyuff_uff/time-history-not-all-columns-filled.uff")).unwrap();
    assert_eq!(samples(&acceleration)[0][12], -5.84096);
    let sine = open(&data("pyuff_uff/binary8byte.uff")).unwrap();
    assert_eq!(sine.channels()[0].scale, 9.806_65);
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_files_without_time_series_say_what_they_hold() {
    let text = message("pyuff_uff/TestLab 161 164 18 15 82.uff");
    assert_message(
        &text,
        "TestLab 161 164 18 15 82.uff: holds no function (dataset 58), only",
        &["units (dataset 164)", "3 x trace lines", "nodes"],
    );
    let cases = [
        (
            "pyuff_uff/non_ascii_header.uff",
            "1 x frequency response function",
        ),
        (
            "pyuff_uff/sample_dataset58_psd.uff",
            "power spectral density",
        ),
        ("ufffiles_jl_uff/dataset58_coh.unv", "coherence"),
        ("ufffiles_jl_uff/dataset58_spectrum.unv", "spectrum"),
        ("ufffiles_jl_uff/dataset151&164.unv", "header (dataset 151)"),
        ("ufffiles_jl_uff/dataset151.unv", "header"),
        ("ufffiles_jl_uff/dataset164.unv", "units"),
        (
            "modelab_freefree_beam/Hxysv00001.txt",
            "form = \"accelerance\"",
        ),
    ];
    for (name, part) in cases {
        let text = message(name);
        assert!(text.contains(part), "{text}");
    }
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_functions_that_are_only_listed() {
    let path = data("pyuff_uff/sample_dataset58_psd.uff");
    let listed = list_datasets(&path).unwrap_or_else(|error| panic!("{error}"));
    let (_, header) = listed.functions().next().expect("a function");
    assert_eq!(
        (header.function_type, header.points),
        (FunctionType(9), 3201)
    );
    assert_eq!(header.abscissa, Abscissa::Uneven);
    assert_eq!(header.numerator.unit.as_deref(), Some("g\u{b2}/Hz"));
    let values = function(&path, 1);
    let abscissa = values.abscissa.expect("a stored abscissa");
    assert_eq!((abscissa[3200], values.real[1]), (3200.0, 1.255_863e-6));
    let path = data("ufffiles_jl_uff/dataset58_coh.unv");
    assert_eq!(function(&path, 1).real.len(), 1600);
}

/// Local maxima of an impact test's response, each beside its published frequency (Hz).
const PEAKS: [f64; 6] = [81.4, 140.67, 175.06, 239.27, 376.2, 463.9];

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_a_hammer_test_and_its_resonances() {
    let path = data("ufffiles_jl_uff/dataset58_FRF.unv");
    let utf = data("ufffiles_jl_uff/dataset58_FRF_UTF.unv");
    for path in [path, utf] {
        let found = open_frequency_responses(&path, &ReadSettings::default())
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(
            (found.spacing, found.lines, found.responses.len()),
            (0.5, 1600, 1)
        );
        let only = &found.responses[0];
        assert_eq!(only.name, ".1.Z- / .56.Z");
        for frequency in PEAKS {
            let line = (frequency / found.spacing).round() as usize;
            let near = line - 2..=line + 2;
            let top = near
                .clone()
                .max_by(|a, b| only.values[*a].norm().total_cmp(&only.values[*b].norm()));
            let top = top.unwrap();
            // A maximum, not an edge of what was looked at; within a line of a frequency between lines.
            assert!(
                (found.frequency(top) - frequency).abs() <= 0.75,
                "{frequency}: {top}"
            );
            assert!(top != line - 2 && top != line + 2, "{frequency}");
        }
    }
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_other_responses() {
    let path = data("pyuff_uff/non_ascii_header.uff");
    let found = open_frequency_responses(&path, &ReadSettings::default())
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((found.lines, found.spacing), (6, 25.0 / 128.0));
    let only = &found.responses[0];
    assert_eq!(
        (only.form, only.unit.as_deref()),
        (Some(ResponseForm::Accelerance), Some("(1/N)*(m/s\u{b2})"))
    );
    assert_eq!(
        only.values[5],
        num_complex::Complex64::new(3.75037, 2.93363)
    );
    let path = data("ufffiles_jl_uff/dataset58_ufb.ufb");
    let found = open_frequency_responses(&path, &ReadSettings::default())
        .unwrap_or_else(|error| panic!("{error}"));
    let names: Vec<_> = found.responses.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(names, ["1:+X / 22:+X", "1:+Y / 22:+X"]);
    assert!(
        found
            .responses
            .iter()
            .all(|r| r.form == Some(ResponseForm::Accelerance))
    );
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_an_analysers_text_and_its_resonances() {
    for name in ["Hxysv00001", "Hxysv00005"] {
        let path = data(&format!("modelab_freefree_beam/{name}.txt"));
        let found = open_frequency_responses(&path, &ReadSettings::default())
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((found.lines, found.first_frequency), (51_201, 0.0));
        assert!(
            (found.spacing - 0.019_531_25).abs() < 1e-12,
            "{}",
            found.spacing
        );
        let only = &found.responses[0];
        assert_eq!(
            only.form,
            Some(ResponseForm::Accelerance),
            "{:?}",
            only.unit
        );
        // By other programs: 111.995 Hz; its half-power width is 0.03 Hz, a line and a half.
        let lines = (100.0 / found.spacing) as usize..(125.0 / found.spacing) as usize;
        let top = lines.max_by(|a, b| only.values[*a].norm().total_cmp(&only.values[*b].norm()));
        let top = found.frequency(top.unwrap());
        assert!((top - 111.995).abs() < 0.02, "{name}: {top}");
    }
}
