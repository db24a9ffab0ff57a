//! Map along the beam: stiffness or mass that the residual calls for, whatever the cause.
//!
//! The beam is cut into pieces. A relative change e_j of the bending stiffness of piece j moves ln f of
//! a mode by half of that piece's share of its bending energy, a change of its mass by minus half of its
//! share of the kinetic energy. The changes that explain the residual of the nominal model are found by
//! regularised least squares, beside the joint and all nuisance parameters.

use crate::dataset::Dataset;
use crate::evidence::Fit;
use crate::forward::Forward;
use crate::optimum::{LinearModel, Optimum, maximise};
use crate::parameters::Prior;
use crate::result::LocationMap;
use crate::structure::{ModalModel, Property};
use crate::thresholds::LEAST_MAP_DATA;
use nalgebra::DMatrix;

/// Pieces of the beam: twice as many as half waves of the sixth mode.
const PIECES: usize = 12;
/// Points in each piece for its share of the energies.
const PIECE_POINTS: usize = 8;
/// Standard deviation of a piece's change before the data, if all pieces change (1).
const CHANGE_STD: f64 = 0.1;
/// Standard deviation of the change of a single piece (1): wide, since its place counts and not its size.
const SINGLE_CHANGE_STD: f64 = 3.0;

/// Returns the map of the nominal fit's residual; `None` with fewer than four frequencies.
pub fn location_map(dataset: &Dataset, nominal: &Fit) -> Option<LocationMap> {
    if dataset.frequencies().count() < LEAST_MAP_DATA {
        return None;
    }
    let length = dataset.nominal.length();
    let models = Forward::new(dataset, &[]).solve(nominal.parameters())?;
    let of_stiffness = slopes(dataset, &models, Property::Stiffness);
    let of_mass = slopes(dataset, &models, Property::Mass);
    let (stiffness, stiffness_std) = changes(dataset, nominal, &of_stiffness)?;
    let (mass, mass_std) = changes(dataset, nominal, &of_mass)?;
    let piece = length / PIECES as f64;
    // All that the described model leaves.
    let misfit = 2.0 * nominal.best.optimum.objective;
    Some(LocationMap {
        positions: (0..PIECES).map(|j| piece * (j as f64 + 0.5)).collect(),
        stiffness,
        stiffness_std,
        mass,
        mass_std,
        stiffness_explains: explained(alone(dataset, nominal, &of_stiffness)?, misfit),
        mass_explains: explained(alone(dataset, nominal, &of_mass)?, misfit),
        // The energy of the highest mode resolves half its wave.
        resolution: length / dataset.fitted_modes as f64,
    })
}

/// Returns shares of the misfit from decreases of chi square.
fn explained(decreases: Vec<f64>, misfit: f64) -> Vec<f64> {
    let shares = decreases.into_iter();
    shares
        .map(|decrease| if misfit > 0.0 { decrease / misfit } else { 0.0 })
        .collect()
}

/// Returns the slope of each observable with respect to the change of each piece.
fn slopes(dataset: &Dataset, models: &[ModalModel], property: Property) -> DMatrix<f64> {
    let mut slopes = DMatrix::zeros(dataset.observables.len(), PIECES);
    let step = dataset.nominal.length() / (PIECES * PIECE_POINTS) as f64;
    for (row, observable) in dataset.observables.iter().enumerate() {
        let model = &models[observable.configuration];
        let index = model.index(observable.mode);
        if let Some(index) = index.filter(|_| observable.is_frequency()) {
            for piece in 0..PIECES {
                let first = piece * PIECE_POINTS;
                slopes[(row, piece)] =
                    model.local_slope(index, property, first, PIECE_POINTS, step);
            }
        }
    }
    slopes
}

/// Returns the changes of all pieces together and their standard uncertainties.
fn changes(
    dataset: &Dataset,
    nominal: &Fit,
    slopes: &DMatrix<f64>,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let first = nominal.parameters().len();
    let (priors, found) = with_pieces(dataset, nominal, slopes, CHANGE_STD)?;
    let variances = found.covariance(&priors)?.diagonal();
    let stds = variances.iter().skip(first).map(|v| v.max(0.0).sqrt());
    Some((found.parameters[first..].to_vec(), stds.collect()))
}

/// Returns by how much chi square falls if one piece alone changes, for each piece.
fn alone(dataset: &Dataset, nominal: &Fit, slopes: &DMatrix<f64>) -> Option<Vec<f64>> {
    (0..PIECES)
        .map(|piece| {
            let own = slopes.columns(piece, 1).into_owned();
            let (_, found) = with_pieces(dataset, nominal, &own, SINGLE_CHANGE_STD)?;
            Some(2.0 * (nominal.best.optimum.objective - found.objective).max(0.0))
        })
        .collect()
}

/// Returns the optimum of the nominal fit, linearised, with changes of pieces after its parameters; and the priors.
fn with_pieces(
    dataset: &Dataset,
    nominal: &Fit,
    slopes: &DMatrix<f64>,
    std: f64,
) -> Option<(Vec<Prior>, Optimum)> {
    let optimum = &nominal.best.optimum;
    let first = optimum.parameters.len();
    let count = first + slopes.ncols();
    let mut all = optimum.model.slopes.clone().resize_horizontally(count, 0.0);
    all.columns_mut(first, slopes.ncols()).copy_from(slopes);
    let mut start = optimum.parameters.clone();
    start.resize(count, 0.0);
    let mut priors = nominal.best.priors.clone();
    priors.resize(count, Prior::normal(0.0, std));
    let model = LinearModel {
        origin: &start,
        there: &optimum.model.predicted,
        slopes: &all,
    };
    let found = maximise(&dataset.data, &priors, &start, &model)?;
    Some((priors, found))
}
