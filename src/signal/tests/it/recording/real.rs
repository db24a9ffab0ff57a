//! Recordings by others, in the folder that TAPJOINT_DATA names.

use crate::shared::data;
use tapjoint_signal::recording::{
    Format, ReadSettings, Recording, Separator, Timing, VariableRole, open_frequency_responses,
};

/// Opens a file of the data folder.
fn open(name: &str) -> Recording {
    let recording = Recording::open(&data(name), &ReadSettings::default());
    recording.unwrap_or_else(|error| panic!("{error}"))
}

/// Checks that blocks join to the whole and that the largest sample is the health's peak.
fn assert_readable(recording: &Recording) {
    for (channel, info) in recording.channels().iter().enumerate() {
        let whole = recording
            .read(channel, 0..u64::MAX)
            .expect("a readable file");
        let blocks = recording.blocks(&[channel], 10_007);
        let joined: Vec<f64> = blocks
            .flat_map(|b| b.expect("a readable file").samples.remove(0))
            .collect();
        assert_eq!(joined, whole, "{} {channel}", recording.name());
        let peak = whole.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
        assert_eq!(peak, info.health.peak, "{} {channel}", recording.name());
    }
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_spruce_bar_is_one_channel_of_float() {
    let name = "guitar_tap_wav/brace-umik-1-swift-mac-1778816093.wav";
    let recording = open(name);
    assert_eq!(recording.format(), Format::WavFloat { bits: 32 });
    assert_eq!(recording.sample_rate(), 48_000.0);
    assert_eq!(recording.frames(), 201_600);
    assert_eq!(recording.channels().len(), 1);
    assert!(
        recording.warnings().is_empty(),
        "{:?}",
        recording.warnings()
    );
    assert_readable(&recording);
    // The tap is at 2.924 s by its publisher: the largest sample comes at most 50 ms later.
    let samples = recording.read(0, 0..u64::MAX).unwrap();
    let largest = (0..samples.len()).max_by(|a, b| samples[*a].abs().total_cmp(&samples[*b].abs()));
    let time = largest.unwrap() as f64 / 48_000.0;
    assert!((2.92..2.98).contains(&time), "{time} s");
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_guitar_is_two_channels_of_integers() {
    let recording = open("guitar_tap_wav/Recording.wav");
    assert_eq!(recording.format(), Format::WavInteger { bits: 16 });
    assert_eq!(recording.sample_rate(), 48_000.0);
    assert_eq!(recording.channels().len(), 2);
    assert!(
        recording.warnings().is_empty(),
        "{:?}",
        recording.warnings()
    );
    assert_readable(&recording);
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_bolted_beam_is_in_physical_units() {
    let name = "brb_bolted_beam/DERIVED_HammerImpact_3acc_float32.wav";
    let recording = open(name);
    assert_eq!(recording.sample_rate(), 12_800.0);
    assert_eq!(recording.duration(), 5.12);
    assert_eq!(recording.channels().len(), 3);
    // Values far above 1: no clipping in a float file.
    let peaks = recording.channels().iter().map(|c| c.health.peak);
    assert!(
        peaks.clone().all(|peak| peak > 100.0),
        "{:?}",
        peaks.collect::<Vec<_>>()
    );
    assert!(
        recording.warnings().is_empty(),
        "{:?}",
        recording.warnings()
    );
    assert_readable(&recording);
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_the_slater_cantilever_opens_at_1280_hz() {
    let recording = open("slater_cantilever/DERIVED_case1_time.csv");
    let format = Format::Csv {
        separator: Separator::Comma,
        decimal: '.',
        timed: Timing::TimeColumn,
    };
    assert_eq!(recording.format(), format);
    // Its time was summed in single precision: the mean step gives 1279.95 Hz.
    assert_eq!(recording.sample_rate(), 1280.0);
    assert_eq!(recording.frames(), 4096);
    assert_eq!(recording.channel_by_name("ch2_response_V").unwrap(), 1);
    let codes: Vec<_> = recording.warnings().iter().map(|w| w.code()).collect();
    assert_eq!(codes, ["rate-rounded", "offset"]);
    assert_readable(&recording);
    let first = recording.read_channels(&[0, 1], 1..2).unwrap();
    assert_eq!(first, [[0.0704776347], [-1.94204402]]);
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_an_analysers_frequency_table_is_not_taken_for_time() {
    let path = data("modelab_freefree_beam/Hxysv00001.txt");
    let error = Recording::open(&path, &ReadSettings::default()).expect_err("no time series");
    let message = error.to_string();
    assert!(
        message.contains(".txt:10: the first column is a frequency"),
        "{message}"
    );
}

/// Every function of the cantilever with masses, as the analyser wrote it: dB and degrees.
#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_functions_of_the_beam_with_masses_are_read_as_they_are() {
    let mut count = 0;
    for folder in ["healthy", "removed_1", "removed_2", "removed_3"] {
        for entry in std::fs::read_dir(data("masses_beam").join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let found = open_frequency_responses(&path, &ReadSettings::default());
            let found = found.unwrap_or_else(|error| panic!("{error}"));
            assert!(found.has_phase && found.warnings.is_empty(), "{path:?}");
            assert_eq!(
                (found.first_frequency, found.spacing, found.lines),
                (0.3125, 0.3125, 6400)
            );
            count += 1;
        }
    }
    assert_eq!(count, 48);
    // The first lines of one of them: -67.90392 dB and -4.414915 degrees.
    let path = data("masses_beam/healthy/P-1.txt");
    let found = open_frequency_responses(&path, &ReadSettings::default()).unwrap();
    let value = found.responses[0].values[0];
    assert!((20.0 * value.norm().log10() + 67.903_92).abs() < 1e-9);
    assert!((value.arg().to_degrees() + 4.414_915).abs() < 1e-9);
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_a_spectrum_by_labview_is_read_as_it_is() {
    let path = data("usc_cantilever/FFT_data.lvm");
    let found = open_frequency_responses(&path, &ReadSettings::default());
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    assert!(!found.has_phase);
    assert_eq!(found.lines, 150_000);
    // Delta_X is printed as 0.085333; the column of X has 0.0853333.
    assert!(
        (found.spacing - 0.256 / 3.0).abs() < 1e-8,
        "{}",
        found.spacing
    );
    let highest = found.responses[0]
        .values
        .iter()
        .map(|value| value.norm())
        .fold(0.0, f64::max);
    assert!(
        (20.0 * highest.log10() + 52.883_209).abs() < 1e-6,
        "{highest}"
    );
    let error = Recording::open(&path, &ReadSettings::default()).expect_err("no time series");
    assert!(error.to_string().contains("FFT"), "{error}");
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_a_matlab_file_of_a_laboratory() {
    let path = data("matlab/transfer_function_clean.mat");
    let names = [
        (VariableRole::Frf, vec!["yspec".to_owned()]),
        (VariableRole::Rate, vec!["freq".to_owned()]),
    ];
    let settings = ReadSettings {
        variables: names.into_iter().collect(),
        ..ReadSettings::default()
    };
    let found =
        open_frequency_responses(&path, &settings).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((found.lines, found.has_phase), (4501, true));
    assert!((found.spacing - 0.333_37).abs() < 1e-5, "{}", found.spacing);
    let error = Recording::open(&path, &ReadSettings::default()).expect_err("no names");
    assert!(
        error
            .to_string()
            .contains("frf = \"yspec\", rate = \"freq\""),
        "{error}"
    );
}
