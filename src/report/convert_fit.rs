//! Fitted modes in the document.

use super::document_fit::{
    AmplitudeEndsSection, AmplitudePointSection, AmplitudeSection, ConstantSection, FitSection,
    TapFitSection, TrendSection,
};
use tapjoint_analysis::AmplitudeChange;
use tapjoint_signal::modal::FittedReading;
use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudeVerdict, Trend};
use tapjoint_signal::modal::fit::UncertaintySource;

/// The fit of one mode.
pub(super) fn fit_section(fit: &FittedReading, change: Option<AmplitudeChange>) -> FitSection {
    let mode = &fit.mode;
    FitSection {
        damping_low: mode.damping_ratio.low,
        damping_high: mode.damping_ratio.high,
        uncertainty_from: match mode.frequency.source {
            UncertaintySource::Residual => "residual",
            UncertaintySource::TapScatter => "taps",
        }
        .to_string(),
        freedom: mode.frequency.freedom,
        scatter_probability: mode.frequency.scatter_probability,
        residual_correlation: mode.residual_correlation,
        band: [mode.band.0, mode.band.1],
        taps: mode
            .taps
            .iter()
            .map(|tap| TapFitSection {
                tap: tap.tap + 1,
                frequency: tap.frequency,
                frequency_std: tap.frequency_std,
                damping: tap.damping_ratio,
                damping_std: tap.damping_std,
            })
            .collect(),
        constants: fit
            .constants
            .iter()
            .map(|constant| ConstantSection {
                sensor: constant.sensor + 1,
                value: constant.value,
                std: constant.std,
                phase_deviation: constant.phase_deviation,
            })
            .collect(),
        amplitude: fit
            .amplitude
            .as_ref()
            .map(|curve| amplitude_section(curve, change)),
    }
}

fn amplitude_section(curve: &AmplitudeCurve, change: Option<AmplitudeChange>) -> AmplitudeSection {
    AmplitudeSection {
        verdict: match curve.verdict {
            AmplitudeVerdict::Changes => "changes",
            AmplitudeVerdict::Steady => "steady",
            AmplitudeVerdict::Beating { .. } => "beating",
            AmplitudeVerdict::Unresolved { .. } => "unresolved",
            AmplitudeVerdict::TooFewPoints => "too-few-points",
        }
        .to_string(),
        frequency: curve.frequency.as_ref().map(trend_section),
        damping: curve.damping.as_ref().map(trend_section),
        sensor: curve.sensor.map(|sensor| sensor + 1),
        ends: change.map(|change| AmplitudeEndsSection {
            amplitude: change.amplitude,
            unit: change.unit,
            frequency: change.frequency,
            frequency_bound: change.frequency_bound,
            damping: change.damping_ratio,
            damping_bound: change.damping_bound,
        }),
        points: curve
            .points
            .iter()
            .map(|point| AmplitudePointSection {
                tap: point.tap + 1,
                time: point.time,
                amplitude: point.amplitude,
                frequency: point.frequency,
                frequency_std: point.frequency_std,
                damping: point.damping_ratio,
                damping_std: point.damping_std,
            })
            .collect(),
    }
}

fn trend_section(trend: &Trend) -> TrendSection {
    TrendSection {
        change: trend.change,
        change_bound: trend.change_bound,
        p_value: trend.p_value,
    }
}
