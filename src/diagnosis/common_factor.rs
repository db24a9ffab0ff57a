//! The common factor that the frequencies ask for, beside the one that the description's tolerances allow.

use crate::compare::{fit_exact, is_geometry};
use crate::dataset::{Dataset, ObservableKind};
use crate::description::{PROPERTIES, free_slope, mass_slope};
use crate::parameters::NuisanceParameter;
use crate::result::CommonFactor;
use nalgebra::{DMatrix, DVector};
use tapjoint_identify::consistent::Parameter;

/// Standard deviation of the factor's logarithm before the data (1): anything.
const ANY_FACTOR: f64 = 0.3;

/// Returns the common factor of the frequencies (%). `None` if the data leave its standard deviation above 3 %, or a
/// property is estimated.
pub fn common_factor(dataset: &Dataset) -> Option<CommonFactor> {
    let [allowed, allowed_std] = by_description(dataset)?;
    let mut free = dataset.clone();
    free.add_nuisance(NuisanceParameter::CommonFactor, 0.0, ANY_FACTOR);
    // The factor stands for the properties that differ from the described ones.
    let fit = fit_exact(&free, |nuisance| {
        is_geometry(nuisance) && !matches!(nuisance, NuisanceParameter::Discrepancy { .. })
    })?;
    let at = fit.parameters().len() - 1;
    let std = fit.best.std(at)?;
    let asked = fit.parameters()[at];
    (std < 0.1 * ANY_FACTOR).then(|| CommonFactor {
        percent: 100.0 * asked,
        std_percent: 100.0 * std,
        tolerance_percent: 100.0 * allowed_std,
        deviation: (asked - allowed) / std.hypot(allowed_std),
    })
}

/// Returns the logarithm of the common factor that the description leaves open, with its standard uncertainty: its tolerances,
/// what a balance says, and what a free test says.
fn by_description(dataset: &Dataset) -> Option<[f64; 2]> {
    let known = &dataset.nominal.uncertainty;
    let stds = PROPERTIES.map(|property| known.beam.of(property).unwrap_or(0.0));
    // A property that is estimated has no tolerance.
    if stds.iter().any(|std| *std >= ANY_FACTOR) {
        return None;
    }
    let mut covariance = DMatrix::from_diagonal(&DVector::from_iterator(
        PROPERTIES.len(),
        stds.iter().map(|std| std * std),
    ));
    let mut mean = DVector::zeros(PROPERTIES.len());
    for (observable, datum) in dataset.observables.iter().zip(&dataset.data) {
        let slope = match observable.kind {
            ObservableKind::BeamMass => mass_slope,
            ObservableKind::FreeScale => free_slope,
            _ => continue,
        };
        let own = PROPERTIES.map(|property| match property {
            // A longer bar has a length of its own.
            Parameter::Length if known.is_longer => 0.0,
            other => slope(other),
        });
        let row = DVector::from_iterator(PROPERTIES.len(), own);
        let towards = &covariance * &row;
        let variance = row.dot(&towards) + datum.std * datum.std;
        mean += &towards * ((datum.value - row.dot(&mean)) / variance);
        covariance -= &towards * towards.transpose() / variance;
    }
    let slopes = PROPERTIES.map(|property| match property {
        Parameter::Length => -2.0,
        other => free_slope(other),
    });
    let slopes = DVector::from_iterator(PROPERTIES.len(), slopes);
    let variance = slopes.dot(&(&covariance * &slopes)).max(0.0);
    Some([slopes.dot(&mean), variance.sqrt()])
}
