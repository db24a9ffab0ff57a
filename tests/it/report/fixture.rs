//! A plausible finished analysis: a cantilever with five modes, two recordings, two sensors.

use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tapjoint::description::{JointModel, SensorKind};
use tapjoint::modal::polyreference::{
    BandSearch, PoleStability, PolyreferenceMode, StabilisationPole, SubBand,
};
use tapjoint::modal::{self, ModeReading, PeakLabel};
use tapjoint::pipeline::{
    CloseUp, Conditions, MeasuredSpectra, Measurement, Overview, RecordingResult, Response,
};
use tapjoint::quality::{Check, Outcome, QualityVerdict, Subject};
use tapjoint::recording::Format;
use tapjoint::report::document::*;
use tapjoint::spectral::{AveragedSpectra, Lines, SpectralAverager, Window};
use tapjoint::structure::{Assembly, BeamTheory};
use tapjoint::taps::{Overload, Rejection, Tap, Taps};

/// Frequencies of the five modes (Hz).
pub const FREQUENCIES: [f64; 5] = [17.003, 118.04, 335.71, 628.9, 994.2];
/// Their predictions (Hz).
const PREDICTED: [f64; 5] = [17.01, 117.9, 335.9, 628.2, 991.0];
/// Non-dimensional.
const LAMBDAS: [f64; 5] = [1.6061, 4.2318, 7.1372, 9.7680, 12.2817];

/// A whole run with two recordings.
pub fn document() -> Document {
    Document {
        mode_shapes: None,
        measured_shapes: None,
        sheet: None,
        shape_agreement: None,
        lengths: None,
        free_test: None,
        frfs: None,
        monte_carlo: None,
        perturbation_averages: None,
        version: VERSION,
        test: Some(test()),
        recordings: Some(vec![
            recording("low.wav", [0.0, 200.0], 0..2),
            recording("full.wav", [0.0, 2000.0], 0..5),
        ]),
        datasets: None,
        modes: Some(modes()),
        headline: None,
        estimate: Some(Some(estimate())),
        estimate_reason: None,
        prediction: Some(prediction()),
        perturbation: Some(perturbation()),
        resolution_span: Some(vec![span()]),
        gap: None,
        compare: None,
        series: None,
        quality: Some(quality()),
        exported: None,
        timings: None,
        warnings: vec![
            WarningSection {
                code: "closure".into(),
                text: "the pair regression does not close: its product is 8.2 % off its own estimates; a mode may be misnumbered or the joint needs the third stiffness; try model = \"3p\"".into(),
                ..WarningSection::default()
            },
            WarningSection {
                code: "force-bandwidth".into(),
                text: "full.wav: the force falls by 24 dB over the band; a harder hammer tip reaches higher".into(),
                ..WarningSection::default()
            },
        ],
    }
}

/// The two recordings as measured.
pub fn recordings() -> Vec<RecordingResult> {
    vec![
        measured("low.wav", [0.0, 200.0], 0..2),
        measured("full.wav", [0.0, 2000.0], 0..5),
    ]
}

/// One good check and one doubt.
fn quality() -> Vec<QualityVerdict> {
    let verdict = |outcome: Outcome, tap: usize, value: f64| QualityVerdict {
        check: Check::ForceRipple,
        subject: Subject::Tap {
            file: "full.wav".into(),
            tap,
        },
        value: Some(value),
        limit: 1.7,
        unit: "dB",
        outcome,
        happened: format!("The force spectrum ripples by {value} dB."),
        cause: None,
        remedy: None,
    };
    vec![
        verdict(Outcome::Good, 1, 0.4),
        verdict(Outcome::Doubtful, 2, 2.9),
    ]
}

fn test() -> TestSection {
    TestSection {
        name: "Cantilever, one-bolt clamp".into(),
        file: Some("test.toml".into()),
        kind: Some(Assembly::Cantilever),
        model: Some(JointModel::TwoParameter),
        beam_theory: Some(BeamTheory::Timoshenko),
        length: Some(0.423),
        bending_stiffness: Some(107.8),
        mass_per_length: Some(1.9625),
    }
}

/// The lines of a band, 2048 samples.
pub fn lines(band: [f64; 2]) -> Lines {
    Lines::zoom((band[0], band[1]), 5120.0, 2048, 3.2).expect("the band fits")
}

fn recording(file: &str, band: [f64; 2], modes: std::ops::Range<usize>) -> RecordingSection {
    let lines = lines(band);
    RecordingSection {
        pole_bands: Vec::new(),
        fitted_functions: Vec::new(),
        files: Vec::new(),
        hammer: None,
        aside: None,
        conditions: Conditions {
            tap: Some(0.04),
            sensor_positions: [("A".to_owned(), 0.338)].into(),
            torque: Some(12.0),
            ..Conditions::default()
        },
        channel_details: Vec::new(),
        file: file.into(),
        format: "WAV, 24-bit integer".into(),
        has_hammer: true,
        responses: vec!["A".into(), "B".into()],
        tap_unit: Some("N".into()),
        sample_rate: Some(5120.0),
        channels: 3,
        seconds: Some(20.5),
        taps: taps(),
        line_spacing: Some(lines.spacing),
        resolution: Some(lines.resolution()),
        half_line: Some(lines.half_line()),
        block: Some(lines.block),
        lines: Some(lines.displayed()),
        averages: 4,
        taps_together: None,
        band: Some(band),
        window: Some("exponential".into()),
        window_decay: Some(1.27),
        remaining_at_end: Some(0.013),
        modes: modes.map(|index| mode(index, file, &lines)).collect(),
    }
}

fn taps() -> Vec<TapSection> {
    let reasons = [
        None,
        Some("double hit: second excursion of 31 % after 14 ms"),
        None,
        None,
        Some("overload: 12 samples at full scale"),
        None,
    ];
    reasons
        .iter()
        .enumerate()
        .map(|(index, reason)| TapSection {
            file: None,
            pulse: None,
            time: 0.31 + 3.4 * index as f64,
            peak_force: Some(41.2 - 2.9 * index as f64),
            peak_response: None,
            accepted: reason.is_none(),
            reason: reason.map(str::to_owned),
        })
        .collect()
}

fn mode(index: usize, file: &str, lines: &Lines) -> ModeSection {
    let frequency = FREQUENCIES[index];
    ModeSection {
        coherence: Some(0.998),
        random_error: Some(0.016),
        mode: Some(index + 1),
        frequency,
        method: Some(ReadBy::Interpolated),
        line_frequency: Some((frequency / lines.spacing).round() * lines.spacing),
        half_line: Some(lines.half_line()),
        interpolated_frequency: Some(frequency),
        interpolated_bound: Some(0.06 * lines.half_line()),
        std: Some(0.03 * lines.half_line()),
        low: Some(frequency - 0.06 * lines.half_line()),
        high: Some(frequency + 0.06 * lines.half_line()),
        at_amplitude: None,
        fit: None,
        damping: Some(0.0031),
        damping_std: Some(0.00012),
        lambda: Some(LAMBDAS[index]),
        prominence_db: Some(38.2),
        above_noise_db: Some(52.0),
        recording: Some(file.into()),
        label: None,
        is_unclear: false,
        is_weak: false,
        is_combination: false,
    }
}

fn modes() -> Vec<ModeSection> {
    let mut modes: Vec<ModeSection> = (0..5)
        .map(|index| {
            let (file, band) = if index < 2 {
                ("low.wav", [0.0, 200.0])
            } else {
                ("full.wav", [0.0, 2000.0])
            };
            mode(index, file, &lines(band))
        })
        .collect();
    modes.push(ModeSection {
        mode: None,
        frequency: 50.0,
        method: Some(ReadBy::Line),
        line_frequency: Some(50.0),
        half_line: Some(0.125),
        recording: Some("low.wav".into()),
        label: Some("mains 50 Hz".into()),
        ..ModeSection::default()
    });
    modes
}

fn value(value: f64, relative: f64) -> Option<EstimatedValue> {
    let std = relative * value;
    Some(EstimatedValue::of(Uncertain {
        value,
        std: Some(std),
        low: Some(value - 1.96 * std),
        high: Some(value + 1.96 * std),
        ..Uncertain::default()
    }))
}

fn estimate() -> EstimateSection {
    EstimateSection {
        method: EstimateMethod::Pairs,
        modes_used: vec![1, 2, 3, 4],
        reason: None,
        kx: value(970.5, 0.041),
        ky: value(1.251, 0.0032),
        kt: value(1_382_000.0, 0.041),
        kr: value(318.9, 0.0032),
        pairs: Some(PairsSection {
            condition: Some(31.0),
            kx: Some(970.5),
            ky: Some(1.251),
            kz: None,
            closure: Some(0.0021),
            ..PairsSection::default()
        }),
        ..EstimateSection::default()
    }
}

fn prediction() -> Vec<PredictionSection> {
    (0..5)
        .map(|index| {
            let (measured, predicted) = (FREQUENCIES[index], PREDICTED[index]);
            PredictionSection {
                mode: index + 1,
                measured: Some(measured),
                predicted: Some(predicted),
                lambda: Some(LAMBDAS[index]),
                error_percent: Some(100.0 * (predicted - measured) / measured),
                used: index < 4,
            }
        })
        .collect()
}

fn perturbation() -> Vec<PerturbationSection> {
    [-0.1, -0.05, 0.0, 0.05, 0.1]
        .iter()
        .map(|percent| PerturbationSection {
            percent: *percent,
            method: EstimateMethod::Pairs,
            kx: (*percent < 0.1).then_some(970.5 * (1.0 + 0.9 * percent)),
            ky: (*percent < 0.1).then_some(1.251 * (1.0 + 0.06 * percent)),
            kz: None,
        })
        .collect()
}

fn span() -> ResolutionSpanSection {
    let cloud = (0..16)
        .map(|pattern| {
            let sign = |bit: i32| if pattern >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let kx = 970.5 * (1.0 + 0.08 * sign(3) + 0.03 * sign(2) - 0.01 * sign(1));
            [kx, 1.251 * (1.0 + 0.006 * sign(0) + 0.002 * sign(1))]
        })
        .collect();
    ResolutionSpanSection {
        method: EstimateMethod::Pairs,
        patterns: 16,
        sampled: false,
        failed: 0,
        kx: Some([860.0, 1090.0]),
        ky: Some([1.241, 1.261]),
        kz: None,
        cloud,
        sensitivity: (0..4)
            .map(|index| SensitivitySection {
                mode: index + 1,
                half_line: if index < 2 { 0.125 } else { 1.25 },
                kx_percent: Some([0.02, -1.0, 3.1, 8.2][index]),
                ky_percent: Some([0.61, 0.2, -0.05, 0.01][index]),
                kz_percent: None,
                ..SensitivitySection::default()
            })
            .collect(),
        common_scale: Some(CommonScaleSection {
            scale_percent: 0.8,
            kx_percent: Some(3.2),
            ky_percent: Some(-5.2),
            ..CommonScaleSection::default()
        }),
    }
}

fn measured(file: &str, band: [f64; 2], modes: std::ops::Range<usize>) -> RecordingResult {
    let lines = lines(band);
    let mut readings: Vec<ModeReading> = modes
        .clone()
        .map(|index| ModeReading {
            line_frequency: (FREQUENCIES[index] / lines.spacing).round() * lines.spacing,
            ..mode_reading(FREQUENCIES[index], lines.half_line(), 38.2)
        })
        .collect();
    readings.push(ModeReading {
        label: Some(PeakLabel::Mains(50.0)),
        ..mode_reading(50.0, lines.half_line(), 12.0)
    });
    let mut spectra = MeasuredSpectra {
        averages: averages(lines),
        window: Window::Rectangular,
        decay: None,
        readings,
        unlisted: Vec::new(),
        fitted: None,
        force_noise: None,
        force_window: None,
        stabilisation: Default::default(),
        taps_together: None,
    };
    spectra.stabilisation.searches = vec![band_search(band)];
    let response = |name: &str| Response {
        name: name.into(),
        kind: Some(SensorKind::Acceleration),
        unit: Some("m/s2".into()),
    };
    RecordingResult {
        file: file.into(),
        files: Vec::new(),
        format: Format::Memory,
        sample_rate: Some(5120.0),
        seconds: Some(20.5),
        channels: Vec::new(),
        has_hammer: true,
        tap_unit: Some("N".into()),
        responses: vec![response("A"), response("B")],
        band: Some((band[0], band[1])),
        conditions: Conditions::default(),
        mode_numbers: modes.map(|index| Some(index + 1)).chain([None]).collect(),
        overview: Some(overview()),
        measurement: Measurement {
            taps: Taps {
                taps: measured_taps(),
                noise: 0.01,
                quiet: 0..0,
                remarks: Vec::new(),
            },
            spectra: Some(spectra),
            warnings: Vec::new(),
        },
    }
}

/// A resonance that stands on its line.
pub fn mode_reading(frequency: f64, half_line: f64, prominence_db: f64) -> ModeReading {
    ModeReading {
        source: modal::ReadBy::Interpolated,
        prominence_db: Some(prominence_db),
        ..ModeReading::on_line(frequency, half_line)
    }
}

/// Poles of each mode from its order on, new first and stable after.
fn band_search(band: [f64; 2]) -> BandSearch {
    let within = |frequency: &&f64| (band[0]..band[1]).contains(*frequency);
    let mut diagram = Vec::new();
    for order in 2..20 {
        for (index, frequency) in FREQUENCIES.iter().filter(within).enumerate() {
            let stability = match order.cmp(&(2 * index + 3)) {
                std::cmp::Ordering::Less => continue,
                std::cmp::Ordering::Equal => PoleStability::New,
                std::cmp::Ordering::Greater => PoleStability::All,
            };
            diagram.push(StabilisationPole {
                order,
                pole: Complex64::ZERO,
                frequency: *frequency,
                damping_ratio: 0.004,
                participation: Vec::new(),
                stability,
            });
        }
    }
    let selected = FREQUENCIES.iter().filter(within);
    BandSearch {
        band: SubBand {
            low: band[0],
            high: band[1],
            core: (band[0], band[1]),
        },
        order: 20,
        diagram,
        modes: selected
            .map(|frequency| PolyreferenceMode {
                pole: Complex64::ZERO,
                frequency: *frequency,
                damping_ratio: 0.004,
                participation: Vec::new(),
                shape: Vec::new(),
                above_noise_db: 40.0,
            })
            .collect(),
    }
}

/// Averages of four taps: accelerances of five modes with 0.3 % damping, and a little noise.
fn averages(lines: Lines) -> AveragedSpectra {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let shapes = [[1.0, 0.7, 0.6, 0.9, 0.8], [0.4, -0.8, 0.5, -0.3, 0.6]];
    let frequencies = lines.frequencies();
    let force: Vec<Complex64> = frequencies
        .iter()
        .map(|f| Complex64::from(0.021 * (-(f / 1300.0).powi(2)).exp() + 1e-6))
        .collect();
    let mut sum = SpectralAverager::new(lines, shapes.len());
    for _ in 0..4 {
        let responses = shapes.map(|shape| {
            let response = frequencies.iter().zip(&force).map(|(f, force)| {
                let mut accelerance = Complex64::ZERO;
                for (frequency, amplitude) in FREQUENCIES.iter().zip(shape) {
                    let ratio = f / frequency;
                    let below = Complex64::new(1.0 - ratio * ratio, 0.006 * ratio);
                    accelerance -= amplitude * ratio * ratio / below;
                }
                let mut noise = || 0.04 * (random.random::<f64>() - 0.5);
                (accelerance + Complex64::new(noise(), noise())) * force + 2e-5
            });
            response.collect::<Vec<Complex64>>()
        });
        sum.add(Some(&force), &responses);
    }
    sum.finish().expect("taps were averaged")
}

fn measured_taps() -> Vec<Tap> {
    let mut taps: Vec<Tap> = taps()
        .iter()
        .map(|tap| Tap {
            file: None,
            time: tap.time,
            peak: tap.peak_force.unwrap_or(1.0),
            pulse_end: None,
            pulse: None,
            record: 0..0,
            second_hit: None,
            overload: None,
            rejection: None,
            overruled: None,
        })
        .collect();
    taps[1].rejection = Some(Rejection::DoubleHit {
        delay: 0.014,
        ratio: 0.31,
        limit: 0.1,
    });
    taps[4].rejection = Some(Rejection::Overload(Overload {
        channel: 1,
        samples: 12,
        whole_from: 0,
        is_force: true,
    }));
    taps
}

/// A half sine of 1 ms and the response that it leaves.
fn close_up(peak: f64) -> CloseUp {
    let rate = 20_000.0;
    let pulse = |time: f64| {
        let inside = (0.0..0.001).contains(&time);
        if inside {
            peak * (std::f64::consts::PI * time / 0.001).sin()
        } else {
            0.0
        }
    };
    let ringing = |time: f64| {
        let rings = 12.0 * (600.0 * time).sin() * (-40.0 * time).exp();
        if time < 0.0 { 0.0 } else { rings }
    };
    let times = (0..640).map(|k| f64::from(k) / rate - 0.002);
    CloseUp {
        start: -0.002,
        step: 1.0 / rate,
        force: Some(times.clone().map(pulse).collect()),
        response: Some(times.map(ringing).collect()),
    }
}

fn overview() -> Overview {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let pieces = 4096;
    let step = 20.5 / pieces as f64;
    let taps = measured_taps();
    let mut low = vec![0.0; pieces];
    let mut high = vec![0.0; pieces];
    for piece in 0..pieces {
        let noise = 0.3 * random.random::<f64>();
        low[piece] = -noise;
        high[piece] = noise;
    }
    for tap in &taps {
        let piece = (tap.time / step) as usize;
        high[piece] = tap.peak;
        low[piece + 1] = -0.04 * tap.peak;
    }
    Overview {
        step,
        low,
        high,
        close_ups: taps.iter().map(|tap| close_up(tap.peak)).collect(),
    }
}
