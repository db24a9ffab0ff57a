//! Spectral resolution error: from block size, band, window and reading to the error of each natural
//! frequency and of each joint stiffness.
//!
//! Every draw is a virtual test of one tap. Its beam and joint differ a little from the nominal ones, so that natural
//! frequencies fall anywhere between two lines; its recording is transformed and read by the measurement stage, and
//! its joint estimated by the estimators that a real test meets. Each draw is judged by its own truth, so that its
//! errors stem from the reading alone.

mod estimate;
mod plan;
mod result;
mod virtual_test;

pub use result::{
    Answer, BandLines, BlockLines, FrequencyError, Omitted, ResolutionStudy, StiffnessError,
    StudiedMode, StudiedStiffness, WindowName, formula_percent,
};
pub use tapjoint_analysis::EstimateMethod;
pub use tapjoint_description::ReadBy;

use estimate::{BandReadings, Estimators, ParameterErrors, Read, index_of, name_of, read_band};
use plan::{BlockPlan, Layout, ModePlan};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use tapjoint_analysis::{StructureDetails, TestedStructure, structure_details};
use tapjoint_beam::{Assembly, JointStiffness, StructureError};
use tapjoint_description::TestDescription;
use tapjoint_identify::IdentifyError;
use tapjoint_numerics::stats::root_mean_square;
use tapjoint_signal::spectral::SpectralError;
use virtual_test::{Truth, Truths, VirtualRecord};

/// A test that is studied virtually.
#[derive(Debug, Clone, PartialEq)]
pub struct StudiedTest {
    /// The structure as described.
    pub structure: TestedStructure,
    /// Other known details: sensors' masses, a lap joint's layout.
    pub details: StructureDetails,
    /// The joint about which draws vary.
    pub joint: JointStiffness,
    /// Position of the hammer's taps (m).
    pub tap: f64,
    /// Positions of the sensors (m).
    pub sensors: Vec<f64>,
    /// Bands (Hz) in which modes are read, each mode in the narrowest that holds it; empty = one from 0
    /// to a quarter above the highest mode.
    pub bands: Vec<(f64, f64)>,
    /// Modes wanted where no band is given.
    pub modes: usize,
    /// The first so many modes enter the estimate; `None` = all.
    pub fit_modes: Option<usize>,
}

/// Modes studied where the description says nothing: those of Ingole & Chatterjee.
const USUAL_MODES: usize = 5;

impl StudiedTest {
    /// Returns the described test about this joint (1), in `bands` (Hz) or, where there are none, in those of
    /// its recordings. Tap and sensors are those of the first recording. Where they are not given, both are
    /// at the free right end, where no mode has a node.
    pub fn of_description(
        test: &TestDescription,
        structure: &TestedStructure,
        joint: JointStiffness,
        bands: &[(f64, f64)],
    ) -> Self {
        let first = test.reference_recording();
        let end = structure.beam.length;
        let placed = test
            .sensors
            .iter()
            .filter_map(|sensor| test.place_of(sensor));
        let mut sensors: Vec<f64> = placed.collect();
        if sensors.is_empty() {
            sensors.push(end);
        }
        let described = test
            .recordings
            .iter()
            .filter(|recording| recording.length.is_none())
            .filter_map(|recording| recording.band);
        let measured = test.measured.as_ref();
        StudiedTest {
            structure: *structure,
            details: structure_details(test, &structure.beam),
            joint: match structure.assembly {
                Assembly::Free => JointStiffness::FREE,
                Assembly::Cantilever | Assembly::Lap => joint,
            },
            tap: first.and_then(|recording| recording.tap).unwrap_or(end),
            sensors,
            bands: match bands {
                [] => described.collect(),
                _ => bands.to_vec(),
            },
            modes: measured
                .and_then(|measured| measured.modes.iter().copied().max())
                .or(test.analysis.fit_modes)
                .unwrap_or(USUAL_MODES),
            fit_modes: test.analysis.fit_modes,
        }
    }
}

/// Settings of the study.
#[derive(Debug, Clone, PartialEq)]
pub struct ResolutionSettings {
    /// Block sizes (samples). 512 to 65536 in octaves: 200 to 25600 displayed lines.
    pub blocks: Vec<usize>,
    /// Windows. Chosen by the decay, as in a test that asks for none.
    pub windows: Vec<WindowName>,
    /// Readings. All three.
    pub readings: Vec<ReadBy>,
    /// Virtual tests for each block size. 1000: an rms error then has a standard error of 1 to 2 %.
    pub draws: usize,
    /// Number of them that are fitted too. 100: a fit takes longer than all else, and its errors of some
    /// hundredths of a line need no more digits.
    pub fit_draws: usize,
    /// Damping ratio of every mode. 0.003: a bolted steel beam.
    pub damping_ratio: f64,
    /// Peak of each response over the rms of its noise (dB). 60: a decent laboratory.
    pub noise_db: f64,
    /// Wanted relative accuracy (rms) of every stiffness. 0.05.
    pub accuracy: f64,
    /// Seed of all draws.
    pub seed: u64,
}

impl Default for ResolutionSettings {
    fn default() -> Self {
        ResolutionSettings {
            blocks: (9..=16).map(|power| 1 << power).collect(),
            windows: vec![WindowName::Automatic],
            readings: ReadBy::ALL.to_vec(),
            draws: 1000,
            fit_draws: 100,
            damping_ratio: 0.003,
            noise_db: 60.0,
            accuracy: 0.05,
            seed: 1,
        }
    }
}

/// Reasons for which there is no study.
#[derive(Debug, thiserror::Error)]
pub enum ResolutionError {
    /// No band holds a mode.
    #[error(
        "no natural frequency lies in the bands: the lowest are {lowest} Hz, and a band must reach {room} % \
         beyond a mode; give --band LO:HI"
    )]
    NoModes {
        /// The lowest natural frequencies.
        lowest: String,
        /// Room that a mode needs (%).
        room: f64,
    },
    /// A band ends where no tap excites anything.
    #[error("a band ends at {high:e} Hz; {most:e} Hz is the limit; give a lower --band LO:HI")]
    TooHigh {
        /// Highest end (Hz).
        high: f64,
        /// Highest possible (Hz).
        most: f64,
    },
    /// A record would not fit into memory.
    #[error(
        "a block of {block} samples in the band {low} to {high} Hz is {seconds:.0} s at {rate:.0} samples/s, {most} \
         samples are the limit; give smaller --blocks, or a wider --band"
    )]
    TooLong {
        /// Block (samples).
        block: usize,
        /// Lower end (Hz).
        low: f64,
        /// Upper end (Hz).
        high: f64,
        /// Length of the record (s).
        seconds: f64,
        /// Sample rate (Hz).
        rate: f64,
        /// Longest record (samples).
        most: usize,
    },
    /// The joint has no frequencies.
    #[error(transparent)]
    Structure(#[from] StructureError),
    /// The joint cannot be estimated from the modes studied.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// A band or block that is none.
    #[error(transparent)]
    Spectral(#[from] SpectralError),
}

/// Makes the study. `progress` is called after each virtual test, from any thread, with the number of tests done
/// and of all.
///
/// # Errors
/// [`ResolutionError`] where bands, blocks or the joint cannot be.
pub fn study_resolution(
    test: &StudiedTest,
    settings: &ResolutionSettings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<ResolutionStudy, ResolutionError> {
    let truths = Truths::new(test)?;
    let layout = Layout::new(test, &truths)?;
    let estimators = Estimators::new(test, &layout, &truths.nominal)?;
    let plans = settings
        .blocks
        .iter()
        .map(|&block| BlockPlan::new(block, &layout, settings, &truths))
        .collect::<Result<Vec<_>, _>>()?;
    let done = AtomicUsize::new(0);
    let total = plans.len() * settings.draws;
    let modes = layout.modes.iter().map(|mode| StudiedMode {
        mode: mode.number,
        frequency: mode.frequency,
        band: layout.bands[mode.band].into(),
        used: mode.used,
    });
    let mut blocks = Vec::with_capacity(plans.len());
    for plan in &plans {
        let lines = plan.bands.first().map_or(0, |band| band.lines.displayed());
        let bands = plan.bands.iter().map(|band| BandLines {
            low: band.lines.low,
            high: band.lines.high,
            spacing: band.lines.spacing,
            half_line: band.lines.half_line(),
            seconds: band.lines.duration,
            windows: band.windows.iter().map(|window| window.name()).collect(),
        });
        blocks.push(BlockLines {
            block: plan.block,
            lines,
            half_line_percent_of_band: formula_percent(lines),
            bands: bands.collect(),
        });
    }
    let mut study = ResolutionStudy {
        draws: settings.draws,
        fit_draws: settings.fit_draws.min(settings.draws),
        seed: settings.seed,
        damping: settings.damping_ratio,
        noise_db: settings.noise_db,
        accuracy_percent: 100.0 * settings.accuracy,
        sample_rate: layout.sample_rate,
        modes: modes.collect(),
        omitted: layout.omitted.clone(),
        stiffnesses: estimators.described(),
        blocks,
        frequency_errors: Vec::new(),
        stiffness_errors: Vec::new(),
        answers: Vec::new(),
        sentence: String::new(),
    };
    for (number, plan) in plans.iter().enumerate() {
        // Collected in order, so that sums do not depend on the number of threads.
        let draws: Vec<Draw> = (0..settings.draws)
            .into_par_iter()
            .map(|index| {
                // A stream for each draw: the thread that computes it does not matter.
                let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
                random.set_stream(((number as u64) << 32) + index as u64 + 1);
                // Fits are made of the first draws only.
                let mut wanted = settings.readings.clone();
                wanted.retain(|&reading| reading != ReadBy::Fit || index < settings.fit_draws);
                let draw = Draw::new(plan, settings, &truths, &estimators, &wanted, &mut random);
                progress(1 + done.fetch_add(1, Ordering::Relaxed), total);
                draw
            })
            .collect();
        add_errors(&mut study, plan, &draws, settings, &estimators);
    }
    study.conclude(&settings.windows, &settings.readings);
    Ok(study)
}

/// One virtual test: its truth, its readings and the errors of its estimates.
#[derive(Debug)]
struct Draw {
    truth: Truth,
    /// For each window and band.
    readings: Vec<Vec<BandReadings>>,
    /// For each window, each of the study's readings and each estimator; `None` where the draw was not read
    /// that way.
    estimates: Vec<Vec<Option<[ParameterErrors; 2]>>>,
}

impl Draw {
    fn new(
        plan: &BlockPlan,
        settings: &ResolutionSettings,
        truths: &Truths,
        estimators: &Estimators,
        wanted: &[ReadBy],
        random: &mut ChaCha8Rng,
    ) -> Self {
        let layout = estimators.layout;
        let truth = truths.draw(plan.variation, random);
        let (rate, samples) = (layout.sample_rate, plan.samples);
        let record = VirtualRecord::new(truths, &truth, rate, samples, settings, random);
        let (mut readings, mut estimates) = (Vec::new(), Vec::new());
        for window in 0..settings.windows.len() {
            let bands = plan.bands.iter();
            let bands: Vec<BandReadings> = bands
                .map(|band| {
                    let window = band.windows[window];
                    read_band(band, window, &record, layout, &truth, wanted)
                })
                .collect();
            let own = settings.readings.iter().map(|reading| {
                let is_wanted = wanted.contains(reading);
                is_wanted.then(|| estimators.errors(&truth, &bands, *reading))
            });
            estimates.push(own.collect());
            readings.push(bands);
        }
        Draw {
            truth,
            readings,
            estimates,
        }
    }
}

/// Returns rms, mean, 95 % point and largest of some errors; `None` of nothing.
fn summary(errors: &[f64]) -> [Option<f64>; 4] {
    let mut sizes: Vec<f64> = errors.iter().map(|error| error.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let Some(&largest) = sizes.last() else {
        return [None; 4];
    };
    let place = (0.95 * (sizes.len() - 1) as f64).ceil() as usize;
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    [root_mean_square(errors), mean, sizes[place], largest].map(Some)
}

/// Adds the errors of one block size to the study.
fn add_errors(
    study: &mut ResolutionStudy,
    plan: &BlockPlan,
    draws: &[Draw],
    settings: &ResolutionSettings,
    estimators: &Estimators,
) {
    let lines = EstimateMethod::ALL.map(|method| estimators.line_errors(plan, method));
    for (window, &name) in settings.windows.iter().enumerate() {
        for (place, &reading) in settings.readings.iter().enumerate() {
            let draws = match reading {
                ReadBy::Fit => &draws[..settings.fit_draws.min(draws.len())],
                ReadBy::Line | ReadBy::Interpolated => draws,
            };
            for (band, planned) in plan.bands.iter().enumerate() {
                for &mode in &planned.modes {
                    let reads = draws.iter().map(|draw| {
                        let read = draw.readings[window][band][mode][index_of(reading)];
                        (read, &draw.truth)
                    });
                    let reads: Vec<_> = reads.collect();
                    let mode = &estimators.layout.modes[mode];
                    let error = frequency_error(plan, band, mode, name, reading, &reads);
                    study.frequency_errors.push(error);
                }
            }
            for method in EstimateMethod::ALL {
                let lines = lines[method as usize].as_ref();
                for (index, &parameter) in estimators.parameters.iter().enumerate() {
                    let estimates = draws.iter().filter_map(|draw| {
                        let both = draw.estimates[window][place].as_ref()?;
                        both[method as usize][index].map(|error| 100.0 * error)
                    });
                    let errors: Vec<f64> = estimates.collect();
                    let [rms_percent, mean_percent, p95_percent, largest_percent] =
                        summary(&errors);
                    study.stiffness_errors.push(StiffnessError {
                        block: plan.block,
                        window: name,
                        reading,
                        method,
                        parameter: name_of(parameter),
                        found: errors.len(),
                        draws: draws.len(),
                        rms_percent,
                        mean_percent,
                        p95_percent,
                        largest_percent,
                        line_rms_percent: lines.map(|lines| 100.0 * lines[index].rms),
                        half_line_bound_percent: lines.map(|lines| 100.0 * lines[index].bound),
                    });
                }
            }
        }
    }
}

fn frequency_error(
    plan: &BlockPlan,
    band: usize,
    mode: &ModePlan,
    window: WindowName,
    reading: ReadBy,
    reads: &[(Option<Read>, &Truth)],
) -> FrequencyError {
    let lines = &plan.bands[band].lines;
    let (mut truths, mut errors, mut own) = (Vec::new(), Vec::new(), 0);
    for (read, truth) in reads {
        let truth = truth.frequencies[mode.number - 1];
        truths.push(truth);
        if let Some(read) = read {
            errors.push(read.frequency - truth);
            own += usize::from(read.source == reading);
        }
    }
    // The standard deviation of the truths takes two.
    let count = truths.len();
    let centre = truths.iter().sum::<f64>() / count as f64;
    let squares: f64 = truths.iter().map(|truth| (truth - centre).powi(2)).sum();
    let spread = (count > 1).then(|| (squares / (count - 1) as f64).sqrt());
    let [rms, mean, p95, largest] = summary(&errors);
    FrequencyError {
        block: plan.block,
        window,
        reading,
        mode: mode.number,
        band: [lines.low, lines.high],
        used: mode.used && mode.band == band,
        spacing: lines.spacing,
        half_line: lines.half_line(),
        spread_lines: spread.map(|spread| spread / lines.spacing),
        found: errors.len(),
        own,
        draws: reads.len(),
        rms,
        mean,
        p95,
        largest,
    }
}
