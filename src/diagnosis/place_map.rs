//! Where along the beam the residual asks for stiffness or mass, whatever the cause.
//!
//! The beam is cut into pieces. A relative change e_j of the bending stiffness of piece j moves ln f of
//! a mode by half of that piece's share of its bending energy, a change of its mass by minus half of its
//! share of the kinetic energy. The changes that explain the residual of the nominal model are found by
//! regularised least squares, beside the joint and all small unknowns.

use super::evidence::covariance;
use super::forward::Forward;
use super::frame::{Frame, Row};
use super::hypothesis::Fit;
use super::least_squares::{Knowledge, Optimum, maximise_linear};
use super::result::PlaceMap;
use super::solved::Solved;
use nalgebra::DMatrix;
use std::f64::consts::TAU;
use tapjoint_beam::specimen::Body;

/// Pieces of the beam: twice as many as half waves of the sixth mode.
const PIECES: usize = 12;
/// Points in each piece for its share of the energies.
const POINTS: usize = 8;
/// Standard deviation of a piece's change before the data (1).
const PRIOR: f64 = 0.1;

/// Which property changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Property {
    Stiffness,
    Mass,
}

/// The map of the nominal fit's residual; `None` with fewer than four frequencies.
pub(super) fn place_map(frame: &Frame, nominal: &Fit) -> Option<PlaceMap> {
    let frequencies = frame
        .rows
        .iter()
        .filter(|row| matches!(row, Row::Frequency { .. }))
        .count();
    if frequencies < 4 {
        return None;
    }
    let length = frame.nominal.specimen.body.length();
    let forward = Forward::new(frame, &[]);
    let solved = forward.solve(&nominal.branch.optimum.parameters)?;
    let of_stiffness = shares(frame, &solved, Property::Stiffness);
    let of_mass = shares(frame, &solved, Property::Mass);
    let (stiffness, stiffness_std) = changes(frame, nominal, &of_stiffness)?;
    let (mass, mass_std) = changes(frame, nominal, &of_mass)?;
    let piece = length / PIECES as f64;
    // All that the described model leaves.
    let misfit = 2.0 * nominal.branch.optimum.objective;
    Some(PlaceMap {
        positions: (0..PIECES).map(|j| piece * (j as f64 + 0.5)).collect(),
        stiffness,
        stiffness_std,
        mass,
        mass_std,
        stiffness_explains: explained(alone(frame, nominal, &of_stiffness)?, misfit),
        mass_explains: explained(alone(frame, nominal, &of_mass)?, misfit),
        // Half a wave of the highest mode is what its energy resolves.
        resolution: length / frame.fitted_modes as f64,
    })
}

/// Shares of the misfit, from the falls of chi square.
fn explained(falls: Vec<f64>, misfit: f64) -> Vec<f64> {
    let share = |fall: f64| if misfit > 0.0 { fall / misfit } else { 0.0 };
    falls.into_iter().map(share).collect()
}

/// Slope of each row with respect to the change of each piece.
fn shares(frame: &Frame, solved: &[Solved], property: Property) -> DMatrix<f64> {
    let mut shares = DMatrix::zeros(frame.rows.len(), PIECES);
    for (row, kind) in frame.rows.iter().enumerate() {
        let Row::Frequency {
            configuration,
            mode,
        } = *kind
        else {
            continue;
        };
        let one = &solved[configuration];
        let Some(index) = one.index(mode) else {
            continue;
        };
        for piece in 0..PIECES {
            shares[(row, piece)] = share(one, index, (piece, property));
        }
    }
    shares
}

/// d ln f = (1/2) int EI w''^2 dx / omega^2 for the stiffness of a piece, -(1/2) int rho A w^2 dx for
/// its mass, with w of unit modal mass.
fn share(one: &Solved, index: usize, (piece, property): (usize, Property)) -> f64 {
    let body = &one.seen.specimen.body;
    let step = body.length() / (PIECES * POINTS) as f64;
    let omega = TAU * one.modes().frequencies()[index];
    (0..POINTS)
        .map(|point| {
            let from = step * (piece * POINTS + point) as f64;
            let x = from + 0.5 * step;
            let beam = match body {
                Body::One(beam) => beam,
                Body::Joined([left, _]) if x < left.length => left,
                Body::Joined([_, right]) => right,
            };
            match property {
                Property::Stiffness => {
                    let bend = (one.modes().slope(index, from + step)
                        - one.modes().slope(index, from))
                        / step;
                    0.5 * beam.bending_stiffness() * bend * bend * step / (omega * omega)
                }
                Property::Mass => {
                    -0.5 * beam.mass_per_length()
                        * one.modes().displacement(index, x).powi(2)
                        * step
                }
            }
        })
        .sum()
}

/// Changes of all pieces together and their standard uncertainties.
fn changes(frame: &Frame, nominal: &Fit, shares: &DMatrix<f64>) -> Option<(Vec<f64>, Vec<f64>)> {
    let first = nominal.branch.optimum.parameters.len();
    let (known, found) = with_pieces(frame, nominal, (shares, PRIOR))?;
    let spread = covariance(&known, &found)?;
    let last = first + shares.ncols();
    let std = (first..last)
        .map(|k| spread[(k, k)].max(0.0).sqrt())
        .collect();
    Some((found.parameters[first..].to_vec(), std))
}

/// By how much chi square falls if one piece alone changes, for each piece.
fn alone(frame: &Frame, nominal: &Fit, shares: &DMatrix<f64>) -> Option<Vec<f64>> {
    // Nothing holds a single piece back: what counts is where, not how much.
    const FREE: f64 = 3.0;
    (0..PIECES)
        .map(|piece| {
            let own = shares.columns(piece, 1).into_owned();
            let (_, found) = with_pieces(frame, nominal, (&own, FREE))?;
            Some(2.0 * (nominal.branch.optimum.objective - found.objective).max(0.0))
        })
        .collect()
}

/// The nominal fit, linearised, with changes of pieces beside its parameters.
fn with_pieces(
    frame: &Frame,
    nominal: &Fit,
    (shares, prior): (&DMatrix<f64>, f64),
) -> Option<(Vec<Knowledge>, Optimum)> {
    let optimum = &nominal.branch.optimum;
    let first = optimum.parameters.len();
    let count = first + shares.ncols();
    let mut slopes = optimum.model.slopes.clone().resize_horizontally(count, 0.0);
    slopes.columns_mut(first, shares.ncols()).copy_from(shares);
    let mut start = optimum.parameters.clone();
    start.resize(count, 0.0);
    let mut known = nominal.branch.knowledge.clone();
    known.resize(count, Knowledge::normal(0.0, prior));
    let found = maximise_linear(
        &frame.readings,
        &known,
        (&start, &optimum.model.predicted),
        &slopes,
    )?;
    Some((known, found))
}
