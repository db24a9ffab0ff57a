//! Errors of all virtual tests, and the block size that a wanted accuracy needs.

use super::ResolutionSettings;
use super::estimate::Estimators;
use super::plan::{BlockPlan, Layout};
use super::result::{
    Answer, FrequencyError, ResolutionStudy, StiffnessError, StudiedMode, WindowName,
};
use super::virtual_test::{Outcome, index_of};
use tapjoint_analysis::EstimateMethod;
use tapjoint_description::ReadBy;
use tapjoint_numerics::stats::root_mean_square;

/// rms, mean, 95 % point and largest of some errors; `None` without any.
#[derive(Debug, Clone, Copy)]
struct Summary {
    rms: f64,
    mean: f64,
    p95: f64,
    largest: f64,
}

impl Summary {
    fn of(errors: &[f64]) -> Option<Self> {
        let mut sizes: Vec<f64> = errors.iter().map(|error| error.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let largest = *sizes.last()?;
        let place = (0.95 * (sizes.len() - 1) as f64).ceil() as usize;
        Some(Summary {
            rms: root_mean_square(errors),
            mean: errors.iter().sum::<f64>() / errors.len() as f64,
            p95: sizes[place],
            largest,
        })
    }
}

/// Draws that a reading has.
fn draws(settings: &ResolutionSettings, reading: ReadBy) -> usize {
    match reading {
        ReadBy::Fit => settings.draws.min(settings.fit_draws),
        ReadBy::Line | ReadBy::Interpolated => settings.draws,
    }
}

/// Adds one block size to the study.
pub(super) fn gather(
    study: &mut ResolutionStudy,
    plan: &BlockPlan,
    outcomes: &[Outcome],
    (settings, layout, estimators): (&ResolutionSettings, &Layout, &Estimators),
) {
    for window in 0..settings.windows.len() {
        for (place, &reading) in settings.readings.iter().enumerate() {
            let outcomes = &outcomes[..draws(settings, reading)];
            for band in 0..plan.bands.len() {
                for position in 0..plan.bands[band].modes.len() {
                    let at = (window, band, position);
                    let error = frequency_error((plan, layout), outcomes, at, (settings, reading));
                    study.frequency_errors.push(error);
                }
            }
            let at = (window, place);
            study.stiffness_errors.extend(stiffness_errors(
                (plan, layout),
                outcomes,
                at,
                (settings, estimators),
            ));
        }
    }
}

fn frequency_error(
    (plan, layout): (&BlockPlan, &Layout),
    outcomes: &[Outcome],
    (window, band, position): (usize, usize, usize),
    (settings, reading): (&ResolutionSettings, ReadBy),
) -> FrequencyError {
    let lines = &plan.bands[band].lines;
    let mode = &layout.modes[plan.bands[band].modes[position]];
    let truth = |outcome: &Outcome| outcome.truth.frequencies[mode.number - 1];
    let reads: Vec<_> = outcomes
        .iter()
        .filter_map(|outcome| {
            let read = outcome.readings[window][band][position][index_of(reading)]?;
            Some((read, read.frequency - truth(outcome)))
        })
        .collect();
    let errors: Vec<f64> = reads.iter().map(|(_, error)| *error).collect();
    let summary = Summary::of(&errors);
    let truths: Vec<f64> = outcomes.iter().map(truth).collect();
    FrequencyError {
        block: plan.block,
        window: settings.windows[window],
        reading,
        mode: mode.number,
        band: [lines.low, lines.high],
        used: mode.used && mode.band == band,
        spacing: lines.spacing,
        half_line: lines.half_line(),
        spread_lines: spread(&truths).map(|spread| spread / lines.spacing),
        found: reads.len(),
        own: reads
            .iter()
            .filter(|(read, _)| read.source == reading)
            .count(),
        draws: outcomes.len(),
        rms: summary.map(|summary| summary.rms),
        mean: summary.map(|summary| summary.mean),
        p95: summary.map(|summary| summary.p95),
        largest: summary.map(|summary| summary.largest),
    }
}

/// Standard deviation; `None` of fewer than two.
fn spread(values: &[f64]) -> Option<f64> {
    let count = values.len();
    let mean = values.iter().sum::<f64>() / count as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (count > 1).then(|| (squares / (count - 1) as f64).sqrt())
}

fn stiffness_errors(
    (plan, layout): (&BlockPlan, &Layout),
    outcomes: &[Outcome],
    (window, place): (usize, usize),
    (settings, estimators): (&ResolutionSettings, &Estimators),
) -> Vec<StiffnessError> {
    let mut rows = Vec::new();
    for method in EstimateMethod::ALL {
        for (parameter, stiffness) in estimators.parameters.iter().enumerate() {
            let errors: Vec<f64> = outcomes
                .iter()
                .filter_map(|outcome| {
                    let both = outcome.estimates[window][place].as_ref()?;
                    both[method as usize][parameter].map(|error| 100.0 * error)
                })
                .collect();
            let summary = Summary::of(&errors);
            let lines = estimators.by_half_lines(plan, layout, (method, parameter));
            rows.push(StiffnessError {
                block: plan.block,
                window: settings.windows[window],
                reading: settings.readings[place],
                method,
                parameter: stiffness.name(),
                found: errors.len(),
                draws: outcomes.len(),
                rms_percent: summary.map(|summary| summary.rms),
                mean_percent: summary.map(|summary| summary.mean),
                p95_percent: summary.map(|summary| summary.p95),
                largest_percent: summary.map(|summary| summary.largest),
                line_rms_percent: lines.map(|lines| 100.0 * lines.0),
                half_line_bound_percent: lines.map(|lines| 100.0 * lines.1),
            });
        }
    }
    rows
}

/// Least share of the draws that must have an estimate.
const LEAST_SHARE: f64 = 0.95;

/// Half a line in percent of the band, 100/(2 lines): Ingole & Chatterjee, section 3.3.
pub fn formula_percent(lines: usize) -> f64 {
    100.0 / (2.0 * lines as f64)
}

/// Adds the answers and their sentence.
pub(super) fn conclude(study: &mut ResolutionStudy, settings: &ResolutionSettings) {
    for &window in &settings.windows {
        for &reading in &settings.readings {
            for method in EstimateMethod::ALL {
                let answer = answer(study, (window, reading, method));
                study.answers.push(answer);
            }
        }
    }
    study.sentence = sentence(study);
}

fn answer(
    study: &ResolutionStudy,
    (window, reading, method): (WindowName, ReadBy, EstimateMethod),
) -> Answer {
    let good = |row: &&StiffnessError| {
        let accurate = row
            .rms_percent
            .is_some_and(|rms| rms <= study.accuracy_percent);
        accurate && row.found as f64 >= LEAST_SHARE * row.draws as f64
    };
    let reaches = |block: usize| {
        let mut rows = study.stiffness_errors.iter().filter(|row| {
            (row.block, row.window, row.reading, row.method) == (block, window, reading, method)
        });
        rows.all(|row| good(&row))
    };
    let block = study
        .blocks
        .iter()
        .map(|lines| lines.block)
        .filter(|&b| reaches(b))
        .min();
    Answer {
        window,
        reading,
        method,
        block,
        seconds: block.map(|block| seconds(study, block)),
    }
}

/// The longest record that a block takes in the bands of the modes used.
fn seconds(study: &ResolutionStudy, block: usize) -> f64 {
    let used = |low: f64, high: f64| {
        study
            .modes
            .iter()
            .any(|mode| mode.used && mode.band == [low, high])
    };
    let lines = study.blocks.iter().filter(|lines| lines.block == block);
    lines
        .flat_map(|lines| &lines.bands)
        .filter(|band| used(band.low, band.high))
        .map(|band| band.seconds)
        .fold(0.0, f64::max)
}

fn sentence(study: &ResolutionStudy) -> String {
    let subject = match study.stiffnesses.len() {
        1 => "the stiffness",
        _ => "every stiffness",
    };
    let parts = EstimateMethod::ALL.map(|method| {
        let name = match method {
            EstimateMethod::Consistent => "the consistent estimate",
            EstimateMethod::Pairs | EstimateMethod::FreeBeam => "the pair regression",
        };
        format!("{name} needs {}", needs(study, method))
    });
    format!(
        "For {} % (rms) in {subject} {}.",
        study.accuracy_percent,
        parts.join("; ")
    )
}

/// "a block of 512 or less (1 s a tap) read on the line, ...": of each reading the smallest block.
fn needs(study: &ResolutionStudy, method: EstimateMethod) -> String {
    let blocks = || study.blocks.iter().map(|lines| lines.block);
    let (least, most) = (blocks().min().unwrap_or(0), blocks().max().unwrap_or(0));
    let first = study.answers.first().map(|answer| answer.window);
    let several = study
        .answers
        .iter()
        .any(|answer| Some(answer.window) != first);
    let rows = study
        .answers
        .iter()
        .filter(|answer| answer.method == method);
    let parts: Vec<String> = rows
        .map(|answer| {
            let how = match answer.reading {
                ReadBy::Line => "read on the line",
                ReadBy::Interpolated => "read between the lines",
                ReadBy::Fit => "fitted",
            };
            let window = if several {
                format!(" (window {})", answer.window.name())
            } else {
                String::new()
            };
            match (answer.block, answer.seconds) {
                (Some(block), Some(seconds)) => {
                    let less = if block == least { " or less" } else { "" };
                    let time = in_seconds(seconds);
                    format!("a block of {block}{less} ({time} a tap) {how}{window}")
                }
                _ if least == most => format!("more than a block of {most} {how}{window}"),
                _ => format!("another block than {least} to {most} {how}{window}"),
            }
        })
        .collect();
    parts.join(", ")
}

/// A length of time in three digits (s).
fn in_seconds(seconds: f64) -> String {
    let decimals = (2.0 - seconds.max(1e-3).log10().floor()).clamp(0.0, 3.0) as usize;
    let text = format!("{seconds:.decimals$}");
    let short = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    format!("{short} s")
}

/// Least spread of the truths (lines) that is as good as uniform over a line.
const LEAST_SPREAD: f64 = 0.35;

impl ResolutionStudy {
    /// What a reader of its numbers has to know: code and text.
    pub fn doubts(&self) -> Vec<(&'static str, String)> {
        let mut doubts = Vec::new();
        for mode in &self.omitted {
            doubts.push((
                "mode-not-studied",
                format!("mode {} is not studied: {}", mode.mode, mode.reason),
            ));
        }
        let used = || self.frequency_errors.iter().filter(|row| row.used);
        let missed = |row: &&FrequencyError| (row.found as f64) < LEAST_SHARE * row.draws as f64;
        let narrow = |row: &&FrequencyError| row.spread_lines.is_some_and(|s| s < LEAST_SPREAD);
        for mode in &self.modes {
            let own = || used().filter(|row| row.mode == mode.mode);
            if let Some(largest) = own().filter(missed).map(|row| row.block).max() {
                doubts.push((
                    "mode-missed",
                    format!(
                        "mode {} is missed in more than 5 % of the tests at blocks up to {largest}: those \
                         tests have no estimate",
                        mode.mode
                    ),
                ));
            }
            if let Some(largest) = own().filter(narrow).map(|row| row.block).max() {
                doubts.push((
                    "narrow-spread",
                    format!(
                        "mode {} varies by less than a line at blocks up to {largest}: its errors there \
                         depend on where it lies; a narrower band has finer lines",
                        mode.mode
                    ),
                ));
            }
        }
        doubts.extend(self.modes.iter().filter_map(|mode| self.wide_peak(mode)));
        for stiffness in self
            .stiffnesses
            .iter()
            .filter(|s| s.pairs_bias_percent.is_none())
        {
            doubts.push((
                "no-pairs",
                format!(
                    "the pair regression has no estimate of {} even from exact frequencies",
                    stiffness.parameter
                ),
            ));
        }
        doubts
    }

    /// From which block on a mode's peak is so wide that finer lines read it no better.
    fn wide_peak(&self, mode: &StudiedMode) -> Option<(&'static str, String)> {
        let width = 2.0 * self.damping * mode.frequency;
        let rows = self.frequency_errors.iter().filter(|row| {
            let of_line = (row.mode, row.reading) == (mode.mode, ReadBy::Line);
            of_line && row.band == mode.band && row.spacing < width
        });
        // Errors uniform over a line have this rms; a tenth more is beyond the draws' chance.
        let worse = rows.filter(|row| {
            row.rms
                .is_some_and(|r| r > 1.1 * row.spacing / 12f64.sqrt())
        });
        let block = worse.map(|row| row.block).min()?;
        Some((
            "wide-peak",
            format!(
                "mode {} is {width:.2} Hz wide at half power: from a block of {block} on noise moves the \
                 reading of its line, and finer lines help less than they promise",
                mode.mode
            ),
        ))
    }
}
