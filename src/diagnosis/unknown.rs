//! Something unknown: the evidence that the frequencies differ from the nominal model in a way that no effect of the
//! catalogue has.
//!
//! An unknown cause has no model, but the ways in which a beam can differ from its description do. Each is a set of changes
//! whose sizes are normal with a common spread, and whose influence on the frequencies is linear:
//!
//! - every mode's frequency is off by an amount of its own, in all configurations alike;
//! - bending stiffness, mass, or both by the thickness, differ along the beam by sum a_k cos(k pi x/L), smoothly
//!   (the spread of a_k falls with k) or roughly (it does not);
//! - springs along the beam hold it to the ground, or take a support away that the description has;
//! - all frequencies of one set-up are off by a factor of its own.
//!
//! Beside these stand causes with one size and one place ([`foreign_fits`](crate::foreign_fits)), and two masses. They are sought only
//! where an effect has odds of 20 to 1, or the readings refute the nominal model.
//!
//! By Rayleigh's quotient a relative change e(x) of E I moves ln f by (1/2) int e E I w''^2 dx/omega^2, of the mass by
//! -(1/2) int e rho A w^2 dx, and springs k(x) by (1/2) int k w^2 dx/omega^2, for a shape w of unit modal mass.
//!
//! Changes are grouped into kinds ([`Kind`]). All kinds are equally probable, all ways of a kind, and all spreads of a way.
//! Factors of set-ups need several set-ups. Slopes are exact for small changes only. Two assumptions about their error are
//! equally probable. In one there is no error. In the other each frequency is uncertain by a tenth of its change, and
//! shapes and damping in proportion to the spread.

use crate::dataset::{Dataset, ObservableKind};
use crate::evidence::{Fit, LocalOptimum, evaluate, log_mean, over_drifts};
use crate::foreign::Kind;
use crate::foreign_fits::ForeignFit;
use crate::forward::Forward;
use crate::location_map::{PIECES, local_slopes};
use crate::modal_model::ModalModel;
use crate::optimum::{Linearised, Optimum};
use crate::parameters::{NuisanceParameter, Prior};
use nalgebra::DMatrix;
use std::f64::consts::PI;
use std::sync::Arc;
use tapjoint_numerics::stats::root_mean_square;

/// Spreads of a mode's own discrepancy (1): 0.05 to 3 %, equally spaced in their logarithm.
const OF_MODES: [f64; 7] = [5e-4, 1e-3, 2e-3, 4e-3, 8e-3, 1.6e-2, 3e-2];
/// Spreads of stiffness, mass and thickness along the beam (1): a coat of paint to a glued strip.
const ALONG_BEAM: [f64; 5] = [0.003, 0.01, 0.03, 0.1, 0.3];
/// Spreads of the springs along the beam, over E I/L^4: foam to a second support.
const OF_SPRINGS: [f64; 4] = [0.1, 1.0, 10.0, 100.0];
/// Spreads of a factor of one set-up (1): several kelvins to a re-clamped beam of another length.
const OF_SET_UPS: [f64; 3] = [5e-4, 2e-3, 8e-3];
/// Changes along the beam, up to three waves of it: as fine as six modes resolve.
const ORDERS: usize = 6;

/// One way in which a structure may differ from its description.
struct Way {
    kind: Kind,
    /// Change of each datum (row) for a unit of each size (column).
    slopes: DMatrix<f64>,
    /// Spreads of the sizes.
    spreads: &'static [f64],
    /// Relative uncertainty of shapes and damping for a unit of the spread (1).
    loosened: f64,
}

/// Returns the fit of something unknown. Its parameters are those of the best discrepancy of each mode.
pub fn fit_unknown(dataset: &Dataset, nominal: &Fit, foreign: &[ForeignFit]) -> Option<Fit> {
    let models = Forward::new(dataset, &[]).solve(nominal.parameters())?;
    let mut all: Vec<(Kind, f64)> = Vec::new();
    let mut modes: Option<LocalOptimum> = None;
    let factor = dataset.settings.thresholds.unknown_spread;
    for way in ways(dataset, &models) {
        // With and without the error of linear slopes, so that small changes keep their full evidence.
        let mut logs: Vec<f64> = Vec::new();
        for share in [0.0, 1.0] {
            for &spread in way.spreads {
                logs.push(log_evidence(dataset, nominal, &way, factor * spread, share));
            }
        }
        if way.kind == Kind::Modes {
            // The model solved anew in the place of the linearised one, at the most probable spread.
            let (exact, _) = logs.split_at(way.spreads.len());
            let best = (0..exact.len()).max_by(|&a, &b| exact[a].total_cmp(&exact[b]))?;
            let fitted = discrepancies(dataset, nominal, factor * way.spreads[best])?;
            logs[best] = fitted.log_evidence;
            modes = Some(fitted);
        }
        all.push((way.kind, log_mean(&logs)));
    }
    all.extend(foreign.iter().map(|one| (one.kind, one.log_evidence)));
    let mut kinds: Vec<f64> = Vec::new();
    for kind in Kind::ALL {
        let ways = all.iter().filter(|way| way.0 == kind);
        let logs: Vec<f64> = ways.map(|way| way.1).collect();
        if !logs.is_empty() {
            kinds.push(log_mean(&logs));
        }
    }
    Some(Fit {
        log_evidence: log_mean(&kinds),
        ..Fit::of_variants(vec![modes?])?
    })
}

/// Returns all ways, the discrepancies of the modes first.
fn ways(dataset: &Dataset, models: &[ModalModel]) -> Vec<Way> {
    let rows = dataset.observables.len();
    let mut of_modes = DMatrix::zeros(rows, dataset.fitted_modes);
    let setups = dataset.setups();
    let mut of_setups = DMatrix::zeros(rows, setups.len());
    let (mut stiffness, mut mass, mut springs) = (
        DMatrix::zeros(rows, PIECES),
        DMatrix::zeros(rows, PIECES),
        DMatrix::zeros(rows, PIECES),
    );
    let length = dataset.nominal.length();
    let unit = dataset.nominal.bending_stiffness() / length.powi(4);
    for row in dataset.frequencies() {
        let observable = &dataset.observables[row];
        let model = &models[observable.configuration];
        let setup = dataset.arrangements[observable.configuration].setup;
        of_modes[(row, observable.mode - 1)] = 1.0;
        if let Some(column) = setups.iter().position(|one| *one == setup) {
            of_setups[(row, column)] = 1.0;
        }
        let Some(index) = model.index(observable.mode) else {
            continue;
        };
        for piece in 0..PIECES {
            let [by_stiffness, by_mass] = local_slopes(model, index, piece, length);
            stiffness[(row, piece)] = by_stiffness;
            mass[(row, piece)] = by_mass;
            // The integral of w^2 is that of the mass over the mass per length.
            let square = -2.0 * by_mass / mass_per_length(dataset, piece);
            springs[(row, piece)] = 0.5 * unit * square / model.omega(index).powi(2);
        }
    }
    let thickness = 3.0 * &stiffness + &mass;
    let mut all = vec![Way {
        kind: Kind::Modes,
        slopes: of_modes,
        spreads: &OF_MODES,
        loosened: 2.0,
    }];
    // Order 0 is left out: a uniform change is a common factor, which the catalogue has.
    for field in [&stiffness, &mass, &thickness] {
        for falls in [true, false] {
            all.push(Way {
                kind: Kind::AlongBeam,
                slopes: (field * waves(falls)).columns(1, ORDERS).into_owned(),
                spreads: &ALONG_BEAM,
                loosened: 0.3,
            });
        }
    }
    // Uniform springs, then springs that vary along the beam. The first stand beside a whole bed: foam is the commonest support.
    for orders in [1, ORDERS + 1] {
        all.push(Way {
            kind: Kind::Springs,
            slopes: (&springs * waves(true)).columns(0, orders).into_owned(),
            spreads: &OF_SPRINGS,
            loosened: 0.01,
        });
    }
    if setups.len() > 1 {
        all.push(Way {
            kind: Kind::SetUps,
            slopes: of_setups,
            spreads: &OF_SET_UPS,
            loosened: 0.0,
        });
    }
    all
}

/// Returns the mass per length (kg/m) of the beam that a piece belongs to.
fn mass_per_length(dataset: &Dataset, piece: usize) -> f64 {
    let beams = dataset.nominal.specimen.body.beams();
    let x = (piece as f64 + 0.5) / PIECES as f64 * dataset.nominal.length();
    match beams[..] {
        [left, right] if x > left.length => right.mass_per_length(),
        _ => beams[0].mass_per_length(),
    }
}

/// Returns cos(k pi x/L) at the pieces of the beam (rows) for k from 0 (columns), over k where it falls.
fn waves(falls: bool) -> DMatrix<f64> {
    DMatrix::from_fn(PIECES, ORDERS + 1, |piece, order| {
        let x = (piece as f64 + 0.5) / PIECES as f64;
        let weight = if falls {
            1.0 / order.max(1) as f64
        } else {
            1.0
        };
        weight * (order as f64 * PI * x).cos()
    })
}

/// Returns the evidence of one way with this spread, by the nominal model linearised at its optimum. `share` (1) of what the
/// slopes may miss counts as uncertain.
fn log_evidence(dataset: &Dataset, nominal: &Fit, way: &Way, spread: f64, share: f64) -> f64 {
    let of_frequencies = share * 0.1 * frequency_spread(way, spread);
    let loose = loosened(dataset, share * way.loosened * spread, of_frequencies);
    let optimum = &nominal.best.optimum;
    let (first, added) = (optimum.parameters.len(), way.slopes.ncols());
    let slopes = (*optimum.model.slopes).clone();
    let mut slopes = slopes.resize_horizontally(first + added, 0.0);
    slopes.columns_mut(first, added).copy_from(&way.slopes);
    let mut parameters = optimum.parameters.clone();
    parameters.resize(first + added, 0.0);
    let mut priors = nominal.best.priors.clone();
    priors.resize(first + added, Prior::normal(0.0, spread));
    let model = Linearised {
        predicted: optimum.model.predicted.clone(),
        slopes: Arc::new(slopes),
    };
    let here = Optimum::new(&loose.data, &priors, parameters, model);
    let layout = loose.layout(&[]);
    let drifts = &loose.settings.drift_stds;
    over_drifts(&loose, &layout, &priors, &here, drifts).log_evidence
}

/// Returns the root mean square change of the frequencies by one way with this spread (1).
fn frequency_spread(way: &Way, spread: f64) -> f64 {
    let sums = way.slopes.row_iter().map(|row| row.norm());
    let moved: Vec<f64> = sums.filter(|sum| *sum > 0.0).collect();
    spread * root_mean_square(&moved)
}

/// Returns the data with more uncertainty: `of_shapes` (1, relative) for shapes, 25 times that for damping ratios,
/// `of_frequencies` (1, relative) for each frequency.
fn loosened(dataset: &Dataset, of_shapes: f64, of_frequencies: f64) -> Dataset {
    let pairs = dataset.observables.iter().zip(&dataset.data);
    let shapes = pairs.filter(|(observable, _)| observable.is_shape());
    let values: Vec<f64> = shapes.map(|(_, datum)| datum.value).collect();
    let size = root_mean_square(&values);
    let mut loose = dataset.clone();
    for (observable, datum) in loose.observables.iter().zip(&mut loose.data) {
        let extra = match observable.kind {
            ObservableKind::Constant { .. } | ObservableKind::Ratio { .. } => of_shapes * size,
            ObservableKind::Damping => 25.0 * of_shapes,
            ObservableKind::Frequency => of_frequencies,
            // What does not depend on the amplitude changes nothing along a decay.
            ObservableKind::Slope | ObservableKind::BeamMass | ObservableKind::FreeScale => 0.0,
        };
        datum.std = datum.std.hypot(extra);
    }
    loose
}

/// Fits a discrepancy of each mode with this spread (1) by the model solved anew. `None` if the fit fails.
fn discrepancies(dataset: &Dataset, nominal: &Fit, spread: f64) -> Option<LocalOptimum> {
    let mut loose = loosened(dataset, 0.0, 0.0);
    for mode in 1..=dataset.fitted_modes {
        loose.add_nuisance(NuisanceParameter::Discrepancy { mode }, 0.0, spread);
    }
    let forward = Forward::new(&loose, &[]);
    let priors = forward.priors();
    let mut start = nominal.parameters().to_vec();
    start.resize(priors.len(), 0.0);
    evaluate(&forward, &priors, &start)
}
