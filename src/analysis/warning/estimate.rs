//! Doubts about the estimate and its prediction, in words.

use std::fmt;

use super::Warning;
use tapjoint_numerics::stats::times;

impl Warning {
    pub(super) fn write_estimate_doubt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Misfit {
                mode,
                error_percent,
                deviations,
            } => write_misfit(f, *mode, *error_percent, *deviations),
            Warning::Closure { closure } => write!(
                f,
                "the pair regression does not satisfy its own frequency equation: the product it \
                 implies differs from the product of its estimates by {:+.0} %; the eliminated product \
                 is left free by the method, and an error of this size means that the stiffnesses are \
                 not to be trusted singly",
                100.0 * closure
            ),
            Warning::CouplingNotEstablished => f.write_str(
                "the interval of the cross coupling contains zero: these frequencies do not show one, \
                 and Kz has no interval; the two-parameter model may do",
            ),
            Warning::UnphysicalEstimate { what } => write!(
                f,
                "the regression's answer is not a joint that can exist: {what}; a missing or an extra \
                 mode, a wrong model or readings too coarse for it are the usual causes"
            ),
            _ => f.write_str(
                "no peak lies near a natural frequency of the described free beam, so the peaks were \
                 numbered in ascending order; check the beam's dimensions and modulus",
            ),
        }
    }
}

fn write_misfit(
    f: &mut fmt::Formatter<'_>,
    mode: usize,
    error_percent: f64,
    deviations: Option<f64>,
) -> fmt::Result {
    write!(
        f,
        "with the estimated joint the model misses mode {mode} by {error_percent:+.2} %"
    )?;
    if let Some(deviations) = deviations {
        write!(
            f,
            " ({} standard deviations of its frequency)",
            times(deviations)
        )?;
    }
    f.write_str(
        "; the estimator, a mode numbered wrongly, or something the model lacks may be the cause",
    )
}
