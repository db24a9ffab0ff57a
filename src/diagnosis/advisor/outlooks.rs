//! What each hypothesis expects of a planned test.

use super::super::catalogue::Candidate;
use super::super::evidence::covariance;
use super::super::forward::{Forward, Layout};
use super::super::frame::{Frame, Row};
use super::super::least_squares::{Knowledge, Model, Optimum};
use super::super::posterior::Entry;
use super::super::result::Hypothesis;
use super::super::small_unknowns::Small;
use super::information::Outlook;
use super::proposals::{Added, Proposals, Structure};
use nalgebra::{DMatrix, DVector};
use tapjoint_beam::effects::EffectId;

/// A hypothesis as the readings left it.
pub(super) struct State {
    pub(super) effects: Vec<Candidate>,
    pub(super) parameters: Vec<f64>,
    pub(super) covariance: DMatrix<f64>,
    known: Vec<Knowledge>,
    /// Small unknowns of its own: what no effect explains in each mode.
    discrepancies: Vec<Small>,
    /// Spread of these (1); 0 where there are none.
    spread: f64,
    /// Spread of the joint between visits (1).
    drift: f64,
    /// Beam's weight (N), half of which pulls on the average section.
    pub(super) weight: f64,
}

/// A drift that no fit says (1): usual.
const USUAL_DRIFT: f64 = 0.01;

/// Second moment of the prior of a size over the square of its scale: half of it each with 1 and 0.4.
const PRIOR_MOMENT: f64 = 0.58;

impl State {
    pub(super) fn new(frame: &Frame, entry: &Entry, weight: f64) -> Option<Self> {
        let branch = &entry.fit.branch;
        let layout = Layout::new(frame, &entry.fit.effects);
        let known = branch.knowledge.clone();
        let own = layout.smalls() + frame.smalls.len();
        let discrepancies: Vec<Small> = (1..=known.len().saturating_sub(own))
            .map(|mode| Small::Discrepancy { mode })
            .collect();
        let (parameters, covariance) = sharpened(&layout, &known, &branch.optimum)?;
        let drifts = frame
            .smalls
            .iter()
            .position(|small| matches!(small, Small::Drift { .. }));
        let fitted = drifts.map(|index| known[layout.smalls() + index].std);
        Some(State {
            effects: entry.fit.effects.clone(),
            spread: if entry.hypothesis == Hypothesis::Unknown {
                known.get(own).map_or(0.0, |known| known.std)
            } else {
                0.0
            },
            // One visit alone has its own joint: the next one differs from it by two drifts.
            drift: entry
                .drift
                .or(fitted)
                .unwrap_or(std::f64::consts::SQRT_2 * USUAL_DRIFT),
            parameters,
            covariance,
            known,
            discrepancies,
            weight,
        })
    }

    /// A size of one of its effects: its column.
    pub(super) fn size(&self, frame: &Frame, wanted: EffectId) -> Option<usize> {
        let layout = Layout::new(frame, &self.effects);
        let index = self.effects.iter().position(|one| one.effect == wanted)?;
        Some(layout.size(index))
    }

    /// The parameters with those of the planned tests, and their covariance.
    fn extended(&self, planned: &Proposals) -> (Vec<f64>, Vec<Knowledge>, DMatrix<f64>) {
        let (old, new) = (self.parameters.len(), planned.added.len());
        let mut parameters = self.parameters.clone();
        parameters.resize(old + new, 0.0);
        let mut known = self.known.clone();
        let mut covariance = self.covariance.clone().resize(old + new, old + new, 0.0);
        for (k, added) in planned.added.iter().enumerate() {
            let std = match *added {
                Added::Drift(least) => self.drift.max(least),
                Added::Stated(std) => std,
            };
            known.push(Knowledge::normal(0.0, std));
            covariance[(old + k, old + k)] = std * std;
        }
        (parameters, known, covariance)
    }

    /// The frame with the small unknowns of this hypothesis.
    fn frame(&self, planned: &Proposals, structure: Structure) -> Option<Frame> {
        let mut frame = match structure {
            Structure::Bare => planned.bare.clone()?,
            _ => planned.whole.clone(),
        };
        let at = planned.whole.smalls.len() - planned.added.len();
        // Those of the planned tests come last.
        for (k, small) in self.discrepancies.iter().enumerate() {
            frame.smalls.insert(at + k, *small);
            frame.small_stds.insert(at + k, self.spread);
            frame.small_centres.insert(at + k, 0.0);
        }
        if let (Some(turned), Structure::Whole) = (planned.turned, structure) {
            let pulled = self.pulled(&planned.whole);
            frame.setups[turned].specimen.axial_force += pulled.1 - pulled.0;
        }
        Some(frame)
    }

    /// The axial force as it is and with the set-up turned over (N). As much of it as half the weight may
    /// be gravity; a force that is mostly something else stays.
    fn pulled(&self, frame: &Frame) -> (f64, f64) {
        let Some(column) = self.size(frame, EffectId::AxialLoad) else {
            return (0.0, 0.0);
        };
        let force = self.parameters[column];
        (force, force * self.turning(column))
    }

    /// What becomes of an axial force when the set-up is turned over, over what it was.
    fn turning(&self, column: usize) -> f64 {
        let likely = self.parameters[column]
            .abs()
            .max(self.covariance[(column, column)].sqrt());
        1.0 - 2.0 * (0.5 * self.weight / likely.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// What it expects of these rows, with their standard uncertainties, one after the other.
    pub(super) fn expect(
        &self,
        planned: &Proposals,
        structure: Structure,
        rows: &[(Row, f64)],
    ) -> Option<Expected> {
        let frame = self.frame(planned, structure)?;
        let (parameters, known, covariance) = self.extended(planned);
        let full = Layout::new(&planned.whole, &self.effects);
        let kept: Vec<usize> = (0..self.effects.len())
            .filter(|&k| structure.shows(&self.effects[k]))
            .collect();
        let effects: Vec<Candidate> = kept.iter().map(|&k| self.effects[k]).collect();
        let layout = Layout::new(&frame, &effects);
        let mut columns: Vec<usize> = (0..layout.joint.len()).collect();
        for &k in &kept {
            columns.push(full.size(k));
            columns.extend(full.place(k));
        }
        columns.extend(full.smalls()..parameters.len());
        let kinds: Vec<Row> = rows.iter().map(|(row, _)| *row).collect();
        let forward = Forward {
            frame: &frame,
            layout,
            rows: &kinds,
        };
        let own: Vec<f64> = columns.iter().map(|&column| parameters[column]).collect();
        let own_known: Vec<Knowledge> = columns.iter().map(|&column| known[column]).collect();
        let model = forward.linearise(&own, &own_known)?;
        let mut slopes = DMatrix::zeros(rows.len(), parameters.len());
        for (k, &column) in columns.iter().enumerate() {
            slopes.set_column(column, &model.slopes.column(k));
        }
        if let (Some(turned), Some(column)) = (
            planned.turned,
            self.size(&planned.whole, EffectId::AxialLoad),
        ) {
            let factor = self.turning(column);
            for (row, kind) in kinds.iter().enumerate() {
                if matches!(kind, Row::Frequency { configuration, .. } if *configuration == turned)
                {
                    slopes[(row, column)] *= factor;
                }
            }
        }
        let mut expected = Expected {
            mean: DVector::from_vec(model.predicted),
            spread: &slopes * covariance * slopes.transpose(),
        };
        self.add_what_nobody_knows(structure, &kinds, &mut expected.spread);
        Some(expected)
    }

    /// Of something unknown nobody can say what it does to a mode that was not observed, or to the beam by
    /// itself; and each reading has a tenth of it of its own.
    fn add_what_nobody_knows(&self, structure: Structure, rows: &[Row], spread: &mut DMatrix<f64>) {
        let mode_of = |row: &Row| match *row {
            Row::Frequency { mode, .. } => mode,
            _ => 0,
        };
        let variance = self.spread * self.spread;
        for (i, one) in rows.iter().enumerate() {
            for (j, other) in rows.iter().enumerate() {
                let new = structure == Structure::Bare || mode_of(one) > self.discrepancies.len();
                if new && mode_of(one) == mode_of(other) {
                    spread[(i, j)] += variance;
                }
            }
            spread[(i, i)] += 0.01 * variance;
        }
    }
}

/// What a hypothesis expects of readings, without their own uncertainty.
pub(super) struct Expected {
    pub(super) mean: DVector<f64>,
    pub(super) spread: DMatrix<f64>,
}

impl Expected {
    /// Some of the readings, in units of their standard uncertainties.
    pub(super) fn outlook(&self, from: usize, stds: &[f64]) -> Outlook {
        let count = stds.len();
        let mean = DVector::from_fn(count, |i, _| self.mean[from + i] / stds[i]);
        let spread = DMatrix::from_fn(count, count, |i, j| {
            let own = if i == j { 1.0 } else { 0.0 };
            own + self.spread[(from + i, from + j)] / (stds[i] * stds[j])
        });
        Outlook { mean, spread }
    }
}

/// The optimum and its covariance with the priors of sizes and places as Gaussians of the same second
/// moment: the search has only a wide one on sizes, and none on places.
fn sharpened(
    layout: &Layout,
    known: &[Knowledge],
    optimum: &Optimum,
) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let mut better = optimum.clone();
    let mut pull: DVector<f64> = DVector::zeros(known.len());
    for (k, candidate) in layout.effects.iter().enumerate() {
        let (column, size) = (layout.size(k), &candidate.size);
        if known[column].is_held() {
            continue;
        }
        let more = 1.0 / (PRIOR_MOMENT * size.scale * size.scale) - known[column].std.powi(-2);
        better.curvature[(column, column)] += more;
        pull[column] = more * (optimum.parameters[column] - size.nothing);
        // Pressed against its bound the size is spread as exp(-g t): a second moment of 2/g^2.
        let value = optimum.parameters[column];
        if value <= size.low || value >= size.high {
            better.curvature[(column, column)] += 0.5 * optimum.gradient[column].powi(2);
        }
        if let (Some(place), Some(range)) = (layout.place(k), &candidate.place) {
            // Uniform over a range r: a variance of r^2/12.
            let reach = range.inward(range.high) - range.inward(range.low);
            better.curvature[(place, place)] += 12.0 / (reach * reach);
        }
    }
    let covariance = covariance(known, &better)?;
    let step = -&covariance * pull;
    let parameters = optimum.parameters.iter().zip(step.iter()).zip(known);
    let parameters = parameters
        .map(|((value, step), known)| (value + step).clamp(known.low, known.high))
        .collect();
    Some((parameters, covariance))
}
