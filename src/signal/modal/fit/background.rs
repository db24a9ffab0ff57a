//! How much background the data ask for in a band.

use num_complex::Complex64;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::Unfit;
use super::local::{GroupFit, Local};

/// Most terms of the background: constant, slope, curvature.
const MOST_TERMS: usize = 3;
/// A term of background is taken when the residual or the pole asks for it on this level. 5 %: the
/// price of a term not needed is a standard deviation some percent larger, that of one left out a bias.
const TERM_LEVEL: f64 = 0.05;

/// Weights by a sensor's noise that is off by more than this (of its power) are set anew. 20 %: that
/// costs less than a percent of the precision, and is what a short band knows of its noise.
const NOISE_CHANGE: f64 = 0.2;

/// From poles and noise of the sweep before: background as the data ask for it, noise from the residual.
pub(super) fn settled_fit(
    local: &Local,
    poles: &[Complex64],
    noise: &[f64],
) -> Result<GroupFit, Unfit> {
    let mut fit = local.fit(poles, 0, noise)?;
    for terms in 1..=MOST_TERMS {
        if !local.has_room(poles, terms) {
            break;
        }
        match local.fit(&fit.at.poles, terms, noise) {
            Ok(more) if asked_for(&fit, &more) => fit = more,
            Ok(_) | Err(_) => break,
        }
    }
    let found = local.noise_of(&fit);
    // Columns off by one common factor are weighted as before; the residual variance knows that factor.
    let variance = fit.variance.max(f64::MIN_POSITIVE);
    let changed =
        |(new, old): (&f64, &f64)| ((new / old).powi(2) / variance - 1.0).abs() > NOISE_CHANGE;
    if found.iter().zip(noise).any(changed) {
        return local.fit(&fit.at.poles, fit.terms, &found);
    }
    Ok(fit)
}

/// Whether the data ask for the background of `more`: by the residual (F test), or because the poles
/// move by more than what the term costs in precision explains (Hausman 1978).
fn asked_for(fewer: &GroupFit, more: &GroupFit) -> bool {
    let terms = fewer.freedom - more.freedom;
    let gain = (fewer.at.square_sum - more.at.square_sum) / terms / more.variance;
    let by_residual = FisherSnedecor::new(terms, more.freedom)
        .is_ok_and(|f| gain > 0.0 && f.sf(gain) < TERM_LEVEL);
    by_residual || poles_differ(fewer, more)
}

fn poles_differ(fewer: &GroupFit, more: &GroupFit) -> bool {
    let covariance = |fit: &GroupFit| fit.slopes.information.clone().try_inverse();
    let (Some(efficient), Some(robust)) = (covariance(fewer), covariance(more)) else {
        return false;
    };
    let parameters = efficient.nrows();
    let level = TERM_LEVEL / parameters as f64;
    let Ok(chi_squared) = ChiSquared::new(1.0) else {
        return false;
    };
    (0..parameters).any(|i| {
        let change = more.at.poles[i / 2] - fewer.at.poles[i / 2];
        let change = if i % 2 == 0 { change.im } else { change.re };
        let explained = (robust[(i, i)] - efficient[(i, i)]) * more.variance;
        explained > 0.0 && chi_squared.sf(change * change / explained) < level
    })
}
