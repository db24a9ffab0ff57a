//! Map along the beam: stiffness or mass that the residual calls for, whatever the cause.
//!
//! The beam is cut into pieces. A relative change e_j of the bending stiffness of piece j moves ln f of
//! a mode by half of that piece's share of its bending energy, a change of its mass by minus half of its
//! share of the kinetic energy. The changes that explain the residual of the nominal model are found by
//! regularised least squares, beside the joint and all nuisance parameters.

use crate::dataset::Dataset;
use crate::evidence::Fit;
use crate::forward::Forward;
use crate::modal_model::ModalModel;
use crate::optimum::{Linearised, Optimum, linear_optimum};
use crate::parameters::Prior;
use crate::result::LocationMap;
use nalgebra::DMatrix;
use std::sync::Arc;
use tapjoint_beam::specimen::Body;

/// Pieces of the beam: twice as many as half waves of the sixth mode.
pub const PIECES: usize = 12;
/// Points in each piece for its share of the energies.
const PIECE_POINTS: usize = 8;
/// Standard deviation of a piece's change before the data, if all pieces change (1).
const CHANGE_STD: f64 = 0.1;
/// Standard deviation of the change of a single piece (1): wide, since its place counts and not its size.
const SINGLE_CHANGE_STD: f64 = 3.0;

/// Returns the map of the nominal fit's residual; `None` with fewer than four frequencies.
pub fn location_map(dataset: &Dataset, nominal: &Fit) -> Option<LocationMap> {
    if dataset.frequencies().count() < dataset.settings.thresholds.least_map_data {
        return None;
    }
    let length = dataset.nominal.length();
    let models = Forward::new(dataset, &[]).solve(nominal.parameters())?;
    let mut slopes = [0, 1].map(|_| DMatrix::zeros(dataset.observables.len(), PIECES));
    for row in dataset.frequencies() {
        let observable = &dataset.observables[row];
        let model = &models[observable.configuration];
        if let Some(index) = model.index(observable.mode) {
            for piece in 0..PIECES {
                let own = local_slopes(model, index, piece, length);
                for (slopes, own) in slopes.iter_mut().zip(own) {
                    slopes[(row, piece)] = own;
                }
            }
        }
    }
    let (stiffness, stiffness_std) = changes(dataset, nominal, &slopes[0])?;
    let (mass, mass_std) = changes(dataset, nominal, &slopes[1])?;
    let piece = length / PIECES as f64;
    Some(LocationMap {
        positions: (0..PIECES).map(|j| piece * (j as f64 + 0.5)).collect(),
        stiffness,
        stiffness_std,
        mass,
        mass_std,
        stiffness_explains: explained(dataset, nominal, &slopes[0])?,
        mass_explains: explained(dataset, nominal, &slopes[1])?,
        // The energy of the highest mode resolves half its wave.
        resolution: length / dataset.fitted_modes as f64,
    })
}

/// Returns d ln f = (1/2) int EI w''^2 dx / omega^2 for the stiffness of a piece of the beam, and
/// -(1/2) int rho A w^2 dx for its mass, with w of unit modal mass, by the midpoint rule. `length` is that of the
/// structure (m).
pub fn local_slopes(model: &ModalModel, index: usize, piece: usize, length: f64) -> [f64; 2] {
    let (body, modes) = (&model.seen.specimen.body, model.modes());
    let (step, omega) = (length / (PIECES * PIECE_POINTS) as f64, model.omega(index));
    let (mut by_stiffness, mut by_mass) = (0.0, 0.0);
    for point in 0..PIECE_POINTS {
        let from = step * (piece * PIECE_POINTS + point) as f64;
        let x = from + 0.5 * step;
        let beam = match body {
            Body::One(beam) => beam,
            Body::Joined([left, _]) if x < left.length => left,
            Body::Joined([_, right]) => right,
        };
        let bend = (modes.slope(index, from + step) - modes.slope(index, from)) / step;
        by_stiffness += 0.5 * beam.bending_stiffness() * bend * bend * step / (omega * omega);
        by_mass += -0.5 * beam.mass_per_length() * modes.displacement(index, x).powi(2) * step;
    }
    [by_stiffness, by_mass]
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

/// Returns the share of the misfit by which chi square falls if one piece alone changes, for each piece.
fn explained(dataset: &Dataset, nominal: &Fit, slopes: &DMatrix<f64>) -> Option<Vec<f64>> {
    // All that the described model leaves.
    let objective = nominal.best.optimum.objective;
    let misfit = 2.0 * objective;
    (0..PIECES)
        .map(|piece| {
            let own = slopes.columns(piece, 1).into_owned();
            let (_, found) = with_pieces(dataset, nominal, &own, SINGLE_CHANGE_STD)?;
            let decrease = 2.0 * (objective - found.objective).max(0.0);
            Some(if misfit > 0.0 { decrease / misfit } else { 0.0 })
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
    let mut all = (*optimum.model.slopes)
        .clone()
        .resize_horizontally(count, 0.0);
    all.columns_mut(first, slopes.ncols()).copy_from(slopes);
    let mut start = optimum.parameters.clone();
    start.resize(count, 0.0);
    let mut priors = nominal.best.priors.clone();
    priors.resize(count, Prior::normal(0.0, std));
    let model = Linearised {
        predicted: optimum.model.predicted.clone(),
        slopes: Arc::new(all),
    };
    let here = Optimum::new(&dataset.data, &priors, start, model);
    let found = linear_optimum(&dataset.data, &priors, &here)?;
    Some((priors, found))
}
