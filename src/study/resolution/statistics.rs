//! Errors over all draws of one block size.

use super::ResolutionSettings;
use super::draw::Outcome;
use super::estimate::Estimators;
use super::plan::{BlockPlan, Layout};
use super::result::{EstimateMethod, FrequencyError, ReadingName, ResolutionStudy, StiffnessError};
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
fn draws(settings: &ResolutionSettings, reading: ReadingName) -> usize {
    match reading {
        ReadingName::Fit => settings.draws.min(settings.fit_draws),
        ReadingName::Line | ReadingName::Interpolated => settings.draws,
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
    (settings, reading): (&ResolutionSettings, ReadingName),
) -> FrequencyError {
    let lines = &plan.bands[band].lines;
    let mode = &layout.modes[plan.bands[band].modes[position]];
    let truth = |outcome: &Outcome| outcome.truth.frequencies[mode.number - 1];
    let reads: Vec<_> = outcomes
        .iter()
        .filter_map(|outcome| {
            let read = outcome.readings[window][band][position][reading as usize]?;
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
            .filter(|(read, _)| read.source == reading.source())
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
