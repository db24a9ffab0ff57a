//! From file to modes: 20 s of three channels at 12.8 kHz, 24 bit, five taps. Each step stands
//! beside what one would use without this crate.

#![allow(clippy::unwrap_used, reason = "in a bench a panic is the message")]

use std::fs::File;
use std::hint::black_box;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rustfft::{FftPlanner, num_complex::Complex64};
use tapjoint::description::TestDescription;
use tapjoint::pipeline::{IdentifySettings, MeasureSettings, measure, run_test};
use tapjoint::recording::{ReadSettings, Recording, WavFormat, write_wav};
use tapjoint::report::{document_of, render_run};
use tapjoint::simulate::{SimulatedMode, TapTestSettings, simulate_tap_test};
use tapjoint::spectral::{DISPLAY_RATIO, Lines, transform_block};
use tapjoint::taps::TapSource;

const RATE: f64 = 12_800.0;
const TAPS: usize = 5;
/// Length of one tap's record (s), and of the recording.
const RECORD: f64 = 3.9;
const LENGTH: f64 = 20.0;
/// Full scale of the recorder: a hammer of 100 N, sensors of 5000 m/s2.
const FORCE_RANGE: f64 = 100.0;
const SENSOR_RANGE: f64 = 5000.0;

const TEST: &str = r#"
name = "bench"
[beam]
length = 0.423
width = 0.05
thickness = 0.005
modulus = 207e9
density = 7850
[joint]
kind = "cantilever"
[hammer]
channel = 1
scale = 100.0
[[sensor]]
name = "A"
channel = 2
scale = 5000.0
position = 0.338
[[sensor]]
name = "B"
channel = 3
scale = 5000.0
position = 0.2
[[recording]]
file = "taps.wav"
"#;

/// Five modes near those of a steel strip of 0.423 m in a clamp.
fn modes() -> Vec<SimulatedMode> {
    let frequencies = [17.1, 118.4, 337.2, 631.1, 996.3];
    let shapes = [(0.1, [1.7, 0.9]), (0.5, [0.8, 1.6])];
    frequencies
        .iter()
        .enumerate()
        .map(|(index, &frequency)| {
            let (shape_at_tap, shape_at_sensors) = shapes[index % 2];
            SimulatedMode {
                frequency,
                damping_ratio: if index == 0 { 0.012 } else { 0.004 },
                shape_at_tap,
                shape_at_sensors: shape_at_sensors.to_vec(),
            }
        })
        .collect()
}

/// Writes the virtual recording and returns its path.
fn virtual_recording(folder: &Path) -> PathBuf {
    let lead = 0.5;
    let settings = TapTestSettings {
        sample_rate: RATE,
        taps: TAPS,
        interval: (LENGTH - lead) / TAPS as f64,
        lead,
        ..TapTestSettings::default()
    };
    let test = simulate_tap_test(&modes(), &settings, 1);
    let to_file = |samples: &[f64], range: f64| samples.iter().map(|x| x / range).collect();
    let mut channels: Vec<Vec<f64>> = vec![to_file(&test.force, FORCE_RANGE)];
    channels.extend(test.responses.iter().map(|x| to_file(x, SENSOR_RANGE)));
    let path = folder.join("taps.wav");
    let clipped = write_wav(&path, RATE as u32, &channels, WavFormat::Pcm24).unwrap();
    assert_eq!(clipped, 0, "the virtual recording is clipped");
    path
}

fn open(path: &Path) -> Recording {
    Recording::open(path, &ReadSettings::default()).unwrap()
}

/// Reading every sample of the file.
fn reading(criterion: &mut Criterion, path: &Path) {
    let mut group = criterion.benchmark_group("reading 20 s of 3 channels, 24 bit");
    group.throughput(Throughput::Bytes(std::fs::metadata(path).unwrap().len()));
    group.bench_function("tapjoint: open, with the health of every channel", |b| {
        b.iter(|| open(black_box(path)));
    });
    let recording = open(path);
    group.bench_function("tapjoint: all samples of an open recording", |b| {
        b.iter(|| {
            recording
                .read_channels(&[0, 1, 2], 0..recording.frames())
                .unwrap()
        });
    });
    group.bench_function("hound: decode the file", |b| {
        b.iter(|| {
            let file = BufReader::new(File::open(black_box(path)).unwrap());
            let mut reader = hound::WavReader::new(file).unwrap();
            let scale = 1.0 / f64::from(1 << 23);
            let mut channels = vec![Vec::new(); 3];
            for (index, sample) in reader.samples::<i32>().enumerate() {
                channels[index % 3].push(f64::from(sample.unwrap()) * scale);
            }
            channels
        });
    });
    group.finish();
}

/// One record of one channel, over the full band and zoomed.
fn transforms(criterion: &mut Criterion, path: &Path) {
    let block = (RECORD * RATE) as usize / 2 * 2;
    let samples = open(path).read(1, 6400..6400 + block as u64).unwrap();
    let mut group = criterion.benchmark_group("one record of 3.9 s");
    let plain = |samples: &[f64], length: usize| {
        let mut buffer: Vec<Complex64> = samples.iter().map(|&x| Complex64::from(x)).collect();
        buffer.resize(length, Complex64::ZERO);
        FftPlanner::new()
            .plan_fft_forward(length)
            .process(&mut buffer);
        buffer
    };
    let full = Lines::zoom((0.0, RATE / DISPLAY_RATIO), RATE, block, RECORD).unwrap();
    group.bench_function("tapjoint: full band", |b| {
        b.iter(|| transform_block(black_box(&samples), RATE, &full));
    });
    group.bench_function("rustfft: the same record, planned each time", |b| {
        b.iter(|| plain(black_box(&samples), black_box(block)));
    });
    for high in [200.0, 1000.0] {
        let band = Lines::zoom((0.0, high), RATE, 2048, RECORD).unwrap();
        // The band's block may need less than the record.
        let gated = &samples[..block.min((band.duration * RATE) as usize)];
        group.bench_function(format!("tapjoint: zoom 0 to {high} Hz, 800 lines"), |b| {
            b.iter(|| transform_block(black_box(gated), RATE, &band));
        });
        // The same lines by padding with zeros; one transform holds only if the spacing divides.
        let length = (RATE / band.spacing).round() as usize;
        group.bench_function(
            format!("rustfft: one FFT of {length} with the lines of 0 to {high} Hz"),
            |b| b.iter(|| plain(black_box(gated), black_box(length))),
        );
    }
    group.finish();
}

/// From an open recording to frequencies, and from a description to all files of the report.
fn whole(criterion: &mut Criterion, path: &Path) {
    let recording = open(path);
    let source = TapSource::Hammer {
        channel: 0,
        responses: vec![1, 2],
    };
    let settings = MeasureSettings::new(source);
    let mut zoomed = settings.clone();
    zoomed.band = Some((0.0, 200.0));
    let found = measure(&recording, &settings).unwrap();
    let readings = found.spectra.map_or(0, |spectra| spectra.readings.len());
    assert!(readings >= 5, "only {readings} of 5 resonances were read");
    let mut group = criterion.benchmark_group("whole recording");
    group.sample_size(10);
    group.bench_function("measure: taps, spectra, readings", |b| {
        b.iter(|| measure(black_box(&recording), &settings).unwrap());
    });
    group.bench_function("measure: the same in a band of 0 to 200 Hz", |b| {
        b.iter(|| measure(black_box(&recording), &zoomed).unwrap());
    });
    let test = TestDescription::parse(TEST, "test.toml").unwrap();
    let place = (path.parent().unwrap(), "test.toml");
    group.bench_function("run: description to JSON, CSV, HTML and PNG", |b| {
        b.iter(|| {
            let analysis = run_test(&test, place, &IdentifySettings::default()).unwrap();
            render_run(&document_of(&analysis), &analysis.recordings).unwrap()
        });
    });
    group.finish();
}

fn benches(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    let path = virtual_recording(folder.path());
    reading(criterion, &path);
    transforms(criterion, &path);
    whole(criterion, &path);
}

criterion_group! {
    name = pipeline;
    config = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = benches
}
criterion_main!(pipeline);
