//! The model of one pair of tests: which change of the frequencies a cause makes.
//!
//! The joint is fitted to the frequencies before. They are as wrong as the model is: each by an unexplained factor, which
//! both tests share, so that it cancels in their ratio. What is left of it is the uncertainty of the joint.

use crate::cause::{Cause, CauseKind};
use crate::test::{CompareError, Item, Pair, Test};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use tapjoint_beam::StructureError;
use tapjoint_beam::specimen::{BeamModes, Joint, Mesh, PointMass, Specimen};
use tapjoint_numerics::least_squares::{Linearised, Problem, Settings as SearchSettings, minimise};

/// Elements of a structure. Errors of the mesh cancel in ratios of frequencies.
const MESH: Mesh = Mesh { elements: 30 };

/// Usual size of what a described beam misses of each frequency (1), and the number of modes that it counts for.
const USUAL_MISFIT: f64 = 0.01;
const USUAL_WEIGHT: f64 = 2.0;
/// Spread of a joint's stiffness about its start (logarithm).
const JOINT_SPREAD: f64 = 1.5;
/// Largest standard uncertainty of a joint's stiffness (logarithm): beyond it the modes hardly feel it.
const MOST_JOINT_STD: f64 = 0.5;
/// Relative error of a predicted change over the unexplained factor of the frequencies: an error of a shape is some times
/// larger than that of its frequency.
const SHAPE_ERROR: f64 = 6.0;
/// Error of a place over that of a predicted change (1, lengths of the beam): where shapes are off by e, a point of the third
/// mode with the same displacement lies about L/10 e aside.
const PLACE_ERROR: f64 = 0.1;
/// Largest relative error of a predicted change (1).
const MOST_SHAPE_ERROR: f64 = 0.15;
/// Step of differences with respect to logarithms.
const STEP: f64 = 0.01;

/// Structures before and after, and their frequencies.
#[derive(Debug, Clone)]
struct Structures {
    before: Specimen,
    after: Specimen,
    modes_before: BeamModes,
    modes_after: BeamModes,
    log_before: Vec<f64>,
    log_after: Vec<f64>,
}

impl Structures {
    /// Returns the described change of each frequency (logarithm).
    fn described(&self) -> Vec<f64> {
        difference(&self.log_after, &self.log_before)
    }
}

/// One pair of tests with its model.
#[derive(Debug, Clone)]
pub(crate) struct PairModel {
    /// Numbers of the compared modes, ascending.
    pub(crate) modes: Vec<usize>,
    /// Measured change of each frequency (logarithm) beyond the described one.
    pub(crate) measured: Vec<f64>,
    /// Its variance by the readings.
    pub(crate) reading: Vec<f64>,
    /// Its variance by taking modes to another level.
    pub(crate) moved: Vec<f64>,
    /// Variance of the change over that of a difference of two tests: less where there are repeats.
    pub(crate) scatter_share: f64,
    /// Sum of squares of the scatter between repeats, each against the mean of its side (logarithm).
    pub(crate) repeat_squares: f64,
    /// Degrees of freedom of that sum; 0 without repeats.
    pub(crate) repeat_freedom: f64,
    /// Mean frequency before and after (Hz).
    pub(crate) frequencies: Vec<[f64; 2]>,
    /// Described change of each frequency (logarithm).
    pub(crate) described: Vec<f64>,
    /// The same less that, with the joint one standard deviation aside, once along each principal axis.
    pub(crate) described_aside: Vec<Vec<f64>>,
    /// Relative error of predicted changes (1).
    pub(crate) shape_error: f64,
    centre: Structures,
    /// With the joint moved by one standard deviation, once along each principal axis.
    aside: Vec<Structures>,
    /// Items before and after.
    items: [Vec<Item>; 2],
    is_symmetric: bool,
    knows_joint: [bool; 2],
}

/// Change of the frequencies by a cause.
#[derive(Debug, Clone)]
pub(crate) struct Predicted {
    /// Change of each mode (logarithm).
    pub(crate) change: Vec<f64>,
    /// The same less the change, with the joint one standard deviation aside.
    pub(crate) aside: Vec<Vec<f64>>,
}

impl Predicted {
    /// No change.
    pub(crate) fn nothing(pair: &PairModel) -> Self {
        Self {
            change: vec![0.0; pair.modes.len()],
            aside: Vec::new(),
        }
    }
}

/// Returns the differences of two lists, value by value.
fn difference(one: &[f64], other: &[f64]) -> Vec<f64> {
    let pairs = one.iter().zip(other);
    pairs.map(|(one, other)| one - other).collect()
}

/// Returns the modes of a structure up to the highest of these.
fn solved(structure: &Specimen, modes: &[usize]) -> Result<BeamModes, StructureError> {
    structure.beam_modes(modes.last().copied().unwrap_or(0), MESH)
}

/// Returns logarithms of the frequencies of these modes (Hz).
fn logs_of(solved: &BeamModes, modes: &[usize]) -> Vec<f64> {
    let frequencies = solved.modes.frequencies();
    modes
        .iter()
        .map(|mode| frequencies[solved.numbers[mode - 1]].ln())
        .collect()
}

/// Returns logarithms of the frequencies of these modes (Hz) of a structure near to one whose modes are known.
fn logs_near(near: &BeamModes, structure: &Specimen, modes: &[usize]) -> Option<Vec<f64>> {
    let moved = match near.perturbed(structure).ok()? {
        Some(moved) => moved,
        None => solved(structure, modes).ok()?,
    };
    let logs = logs_of(&moved, modes);
    // A beam that a load buckles has no lowest frequency.
    logs.iter().all(|log| log.is_finite()).then_some(logs)
}

/// Returns logarithms of the frequencies of these modes (Hz).
///
/// # Errors
/// The structure has no modes.
pub(crate) fn log_frequencies(
    structure: &Specimen,
    modes: &[usize],
) -> Result<Vec<f64>, StructureError> {
    Ok(logs_of(&solved(structure, modes)?, modes))
}

/// Returns the structure with its fitted stiffnesses multiplied by the exponentials of `steps`; a rigid one gives by a
/// compliance of `step` beams.
pub(crate) fn with_joint(structure: &Specimen, directions: &[usize], steps: &[f64]) -> Specimen {
    let mut moved = structure.clone();
    let beam = structure.body.beams()[0];
    let length = structure.body.length();
    let units = [
        beam.bending_stiffness() / length.powi(3),
        beam.bending_stiffness() / length,
    ];
    if let Some(Joint { kt, kr, coupling }) = &mut moved.joint {
        for (&direction, step) in directions.iter().zip(steps) {
            match direction {
                0 if kt.is_infinite() => *kt = units[0] / step,
                1 if kr.is_infinite() => *kr = units[1] / step,
                0 => *kt *= step.exp(),
                1 => *kr *= step.exp(),
                _ => *coupling = (*coupling + step).clamp(-0.99, 0.99),
            }
        }
    }
    moved
}

/// Returns the described structure of a test on this joint. A stiffness that the test states is described, too.
fn described_with(test: &Test, joint: Option<Joint>) -> Specimen {
    let mut described = test.structure.clone();
    described.joint = joint;
    if let (Some(joint), Some(stated)) = (&mut described.joint, test.structure.joint) {
        if test.knows_joint[0] {
            joint.kt = stated.kt;
        }
        if test.knows_joint[1] {
            joint.kr = stated.kr;
        }
    }
    described
}

/// Fit of the joint to the frequencies of one test. Its parameters are logarithms of stiffnesses, the coupling, and the
/// common factor of all frequencies.
struct FirstFit<'a> {
    start: &'a Specimen,
    directions: &'a [usize],
    modes: &'a [usize],
    measured: &'a [f64],
    common_std: f64,
}

impl FirstFit<'_> {
    /// Returns measured less predicted frequencies (logarithms), and the parameters over their spread.
    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let count = self.directions.len();
        let moved = with_joint(self.start, self.directions, &parameters[..count]);
        let predicted = log_frequencies(&moved, self.modes).ok()?;
        let pairs = self.measured.iter().zip(&predicted);
        let mut residuals: Vec<f64> = pairs
            .map(|(measured, predicted)| (measured - predicted - parameters[count]) / USUAL_MISFIT)
            .collect();
        residuals.extend(parameters[..count].iter().map(|step| step / JOINT_SPREAD));
        residuals.push(parameters[count] / self.common_std);
        Some(residuals)
    }

    fn slopes(&self, parameters: &[f64], residuals: &[f64]) -> Option<DMatrix<f64>> {
        let mut slopes = DMatrix::zeros(residuals.len(), parameters.len());
        for column in 0..parameters.len() {
            let mut moved = parameters.to_vec();
            moved[column] += STEP;
            for (row, value) in self.residuals(&moved)?.into_iter().enumerate() {
                slopes[(row, column)] = (value - residuals[row]) / STEP;
            }
        }
        Some(slopes)
    }
}

impl Problem for FirstFit<'_> {
    type State = Vec<f64>;

    fn evaluate(&self, parameters: &[f64], _: Option<&Vec<f64>>) -> Option<Vec<f64>> {
        self.residuals(parameters)
    }

    fn cost(&self, residuals: &Vec<f64>) -> f64 {
        0.5 * residuals.iter().map(|r| r * r).sum::<f64>()
    }

    fn linearise(&self, parameters: &[f64], residuals: &mut Vec<f64>) -> Option<Linearised> {
        let slopes = self.slopes(parameters, residuals)?;
        Some(Linearised::of_rows(slopes, residuals))
    }
}

/// Directions of the joint that have a finite stiffness, and the coupling where there is one.
fn finite_directions(structure: &Specimen) -> Vec<usize> {
    let Some(joint) = structure.joint else {
        return Vec::new();
    };
    let stiffnesses = [joint.kt, joint.kr].into_iter().enumerate();
    let mut directions: Vec<usize> = stiffnesses
        .filter(|(_, k)| *k > 0.0 && k.is_finite())
        .map(|one| one.0)
        .collect();
    if joint.coupling != 0.0 {
        directions.push(2);
    }
    directions
}

impl PairModel {
    /// Fits the joint to the first test before, and takes the difference of the tests.
    ///
    /// # Errors
    /// [`CompareError::Structure`].
    pub(crate) fn new(pair: &Pair, modes: &[usize]) -> Result<Self, CompareError> {
        let (first, last) = (&pair.before[0], &pair.after[0]);
        let mut directions = finite_directions(&first.structure);
        directions.retain(|one| !first.knows_joint.get(*one).copied().unwrap_or(false));
        let measured: Vec<f64> = modes
            .iter()
            .map(|mode| log_frequency(first, *mode))
            .collect();
        let first_fit = FirstFit {
            start: &first.structure,
            directions: &directions,
            modes,
            measured: &measured,
            common_std: first.common_std.max(1e-4),
        };
        let start = vec![0.0; directions.len() + 1];
        // A structure without modes has its reason here.
        log_frequencies(&first.structure, modes)?;
        let found = minimise(&first_fit, &start, &SearchSettings::default());
        let parameters = found.map_or(start, |found| found.parameters);
        let residuals = first_fit.residuals(&parameters).unwrap_or_default();
        let squares = residuals
            .iter()
            .take(modes.len())
            .map(|r| r * r)
            .sum::<f64>();
        let freedom = (modes.len() as f64 - directions.len() as f64).max(0.0);
        let misfit = ((USUAL_WEIGHT + squares) / (USUAL_WEIGHT + freedom)).sqrt() * USUAL_MISFIT;
        let covariance = first_fit
            .slopes(&parameters, &residuals)
            .and_then(|mut slopes| {
                slopes
                    .rows_mut(0, modes.len())
                    .scale_mut(USUAL_MISFIT / misfit);
                (slopes.transpose() * slopes).try_inverse()
            });
        let structures = |steps: &[f64]| -> Result<Structures, StructureError> {
            let before = with_joint(&first.structure, &directions, steps);
            let after = described_with(last, before.joint);
            let (modes_before, modes_after) = (solved(&before, modes)?, solved(&after, modes)?);
            Ok(Structures {
                log_before: logs_of(&modes_before, modes),
                log_after: logs_of(&modes_after, modes),
                modes_before,
                modes_after,
                before,
                after,
            })
        };
        let centre = structures(&parameters[..directions.len()])?;
        let mut aside = Vec::new();
        // A free beam has no joint.
        if let Some(covariance) = covariance.filter(|_| !directions.is_empty()) {
            let count = directions.len();
            let of_joint = covariance.view((0, 0), (count, count)).into_owned();
            let axes = SymmetricEigen::new(of_joint);
            for (value, axis) in axes.eigenvalues.iter().zip(axes.eigenvectors.column_iter()) {
                let std = value.max(0.0).sqrt().min(MOST_JOINT_STD);
                let moved = parameters.iter().zip(axis.iter());
                let moved: Vec<f64> = moved.map(|(one, along)| one + std * along).collect();
                aside.extend(structures(&moved));
            }
        }
        let differences = Differences::new(pair, modes, &centre)?;
        Ok(Self {
            modes: modes.to_vec(),
            described_aside: aside
                .iter()
                .map(|moved| difference(&moved.described(), &centre.described()))
                .collect(),
            described: centre.described(),
            measured: differences.measured,
            reading: differences.reading,
            moved: differences.moved,
            scatter_share: differences.scatter_share,
            repeat_squares: differences.repeat_squares,
            repeat_freedom: differences.repeat_freedom,
            frequencies: differences.frequencies,
            shape_error: (SHAPE_ERROR * misfit).min(MOST_SHAPE_ERROR),
            is_symmetric: centre.before == centre.after,
            items: [first.items.clone(), last.items.clone()],
            knows_joint: first.knows_joint,
            centre,
            aside,
        })
    }

    /// Returns the standard uncertainty of a place by errors of the shapes (m).
    pub(crate) fn place_std(&self) -> f64 {
        PLACE_ERROR * self.shape_error * self.structure().body.length()
    }

    /// The structure before, with its fitted joint.
    pub(crate) fn structure(&self) -> &Specimen {
        &self.centre.before
    }

    /// Returns the change that a cause makes; `None` where there is no such structure.
    pub(crate) fn predict(&self, cause: &Cause, size: f64, place: f64) -> Option<Predicted> {
        let near = self.near(cause, size, place);
        let change = self.shifted(&self.centre, near.as_ref(), cause, size, place)?;
        let mut aside = Vec::with_capacity(self.aside.len());
        for structures in &self.aside {
            let moved = self.shifted(structures, near.as_ref(), cause, size, place)?;
            aside.push(difference(&moved, &change));
        }
        if cause.kind == CauseKind::SensorPosition {
            // A point that moves like the sensor's lies elsewhere where shapes are off. Near an end it lies on one side only.
            let moved = |size: f64| self.shifted(&self.centre, near.as_ref(), cause, size, place);
            let from = [self.place_std(), -self.place_std()];
            let elsewhere = from
                .iter()
                .find_map(|from| Some([moved(*from)?, moved(from + size)?]));
            if let Some([start, end]) = elsewhere {
                aside.push(difference(&difference(&end, &start), &change));
            }
        }
        Some(Predicted { change, aside })
    }

    /// Returns the changes that a cause makes at several sizes of one sign; the uncertainty of the first alone.
    pub(crate) fn predict_sizes(
        &self,
        cause: &Cause,
        sizes: &[f64],
        place: f64,
    ) -> Option<Vec<Predicted>> {
        let near = self.near(cause, sizes[0], place);
        let mut all = vec![self.predict(cause, sizes[0], place)?];
        for &size in &sizes[1..] {
            let Some(change) = self.shifted(&self.centre, near.as_ref(), cause, size, place) else {
                break;
            };
            all.push(Predicted {
                change,
                aside: Vec::new(),
            });
        }
        Some(all)
    }

    /// Returns the modes of a structure with a hinge at this place, which those with other hinges there are near to.
    fn near(&self, cause: &Cause, size: f64, place: f64) -> Option<BeamModes> {
        if cause.kind != CauseKind::LocalCrack {
            return None;
        }
        let structure = if size < 0.0 {
            &self.centre.before
        } else {
            &self.centre.after
        };
        let place = place * structure.body.length();
        solved(
            &cause.applied(structure, None, size.abs(), place)?,
            &self.modes,
        )
        .ok()
    }

    /// Returns place (m) and mass (kg) of the item that a cause is about, before (0) or after (1).
    pub(crate) fn item(&self, cause: &Cause, side: usize) -> Option<&PointMass> {
        let name = cause.item.as_ref()?;
        let mut items = self.items[side].iter();
        items.find(|one| one.name == *name).map(|one| &one.point)
    }

    /// Returns true where a change of the opposite sign has the opposite effect.
    pub(crate) fn is_odd(&self, cause: &Cause) -> bool {
        cause.is_mirrored() && self.is_symmetric
    }

    fn shifted(
        &self,
        structures: &Structures,
        near: Option<&BeamModes>,
        cause: &Cause,
        size: f64,
        place: f64,
    ) -> Option<Vec<f64>> {
        let backwards = cause.is_mirrored() && size < 0.0;
        let item = self.item(cause, usize::from(!backwards));
        let place = place * structures.after.body.length();
        let (structure, own, without, size) = match backwards {
            true => (
                &structures.before,
                &structures.modes_before,
                &structures.log_before,
                -size,
            ),
            false => (
                &structures.after,
                &structures.modes_after,
                &structures.log_after,
                size,
            ),
        };
        let near = near.unwrap_or(own);
        let mut without = without.clone();
        if cause.kind == CauseKind::LostMass {
            let gone = cause.applied(structure, item, 0.0, place)?;
            without = logs_near(near, &gone, &self.modes)?;
        }
        let with = cause.applied(structure, item, size, place)?;
        let with = logs_near(near, &with, &self.modes)?;
        Some(match backwards || cause.kind == CauseKind::LostMass {
            true => difference(&without, &with),
            false => difference(&with, &without),
        })
    }

    /// Returns the measured differences from the first test before to another test.
    ///
    /// # Errors
    /// The described structure of the other test has no modes.
    pub(crate) fn beyond(&self, first: &Test, other: &Test) -> Result<Differences, StructureError> {
        let pair = Pair {
            before: vec![first.clone()],
            after: vec![other.clone()],
        };
        Differences::new(&pair, &self.modes, &self.centre)
    }

    /// Returns the directions in which the joint may change.
    pub(crate) fn joint_directions(&self) -> Vec<usize> {
        let mut directions = finite_directions(&self.centre.after);
        if let Some(joint) = self.centre.after.joint {
            let rigid = [joint.kt, joint.kr].into_iter().enumerate();
            directions.extend(rigid.filter(|(_, k)| k.is_infinite()).map(|one| one.0));
        }
        directions.sort_unstable();
        directions
    }

    /// Returns the change that a change of the joint makes; in a rigid direction a negative one is a joint that gave before.
    pub(crate) fn predict_joint(&self, directions: &[usize], steps: &[f64]) -> Option<Predicted> {
        let change = self.joint_change(directions, steps)?;
        let mut aside = Vec::with_capacity(self.aside.len());
        for structures in &self.aside {
            let moved = self.joint_shifted(structures, directions, steps)?;
            aside.push(difference(&moved, &change));
        }
        Some(Predicted { change, aside })
    }

    /// Returns the change that a change of the joint makes, without its uncertainty.
    pub(crate) fn joint_change(&self, directions: &[usize], steps: &[f64]) -> Option<Vec<f64>> {
        self.joint_shifted(&self.centre, directions, steps)
    }

    /// Returns the slopes of the frequencies with respect to stiffnesses (all logarithms) near a change, a column for each
    /// direction; `None` where the structure has no modes.
    pub(crate) fn joint_slopes(&self, directions: &[usize], at: &[f64]) -> Option<DMatrix<f64>> {
        let mut slopes = DMatrix::zeros(self.modes.len(), directions.len());
        for column in 0..directions.len() {
            let mut sides = Vec::new();
            for step in [STEP, -STEP] {
                let mut steps = at.to_vec();
                steps[column] += step;
                sides.push(self.joint_change(directions, &steps)?);
            }
            for row in 0..self.modes.len() {
                slopes[(row, column)] = (sides[0][row] - sides[1][row]) / (2.0 * STEP);
            }
        }
        Some(slopes)
    }

    /// Returns half of the joint's share of the strain energy of each mode (1): its damping ratio over the joint's loss factor.
    /// `None` where there is no elastic joint, or a spring is rigid in one description alone.
    pub(crate) fn joint_levers(&self) -> Option<Vec<f64>> {
        let rigid = self
            .joints()?
            .map(|joint| [joint.kt, joint.kr].map(f64::is_infinite));
        if rigid[0] != rigid[1] || rigid[0] == [true; 2] {
            return None;
        }
        let BeamModes { modes, numbers, .. } = &self.centre.modes_after;
        let levers = self.modes.iter();
        let levers = levers.map(|mode| 0.5 * modes.joint_energy_share(numbers[mode - 1]));
        Some(levers.collect())
    }

    fn joint_shifted(
        &self,
        structures: &Structures,
        directions: &[usize],
        steps: &[f64],
    ) -> Option<Vec<f64>> {
        let (mut forward, mut backward) = (steps.to_vec(), vec![0.0; steps.len()]);
        if let Some(joint) = structures.after.joint {
            for (k, &direction) in directions.iter().enumerate() {
                let rigid = direction < 2 && [joint.kt, joint.kr][direction].is_infinite();
                if rigid && steps[k] < 0.0 {
                    (forward[k], backward[k]) = (0.0, -steps[k]);
                }
            }
        }
        let after = with_joint(&structures.after, directions, &forward);
        let after = logs_near(&structures.modes_after, &after, &self.modes)?;
        let mut before = structures.log_before.clone();
        if backward.iter().any(|step| *step != 0.0) {
            let held = with_joint(&structures.before, directions, &backward);
            before = log_frequencies(&held, &self.modes).ok()?;
        }
        let softer_before = difference(&before, &structures.log_before);
        Some(difference(
            &difference(&after, &structures.log_after),
            &softer_before,
        ))
    }

    /// Returns the joint before and after as the descriptions have it, fitted where they state nothing.
    pub(crate) fn joints(&self) -> Option<[Joint; 2]> {
        self.centre
            .before
            .joint
            .zip(self.centre.after.joint)
            .map(|(before, after)| [before, after])
    }

    /// True where the description states the stiffness in this direction.
    pub(crate) fn is_stated(&self, direction: usize) -> bool {
        self.knows_joint.get(direction).copied().unwrap_or(false)
    }

    /// Returns the standard uncertainties of the fitted stiffnesses before (logarithms): translation and rotation.
    pub(crate) fn joint_stds(&self) -> [f64; 2] {
        let centre = self.centre.before.joint_stiffnesses();
        let mut variances = [0.0; 2];
        for structures in &self.aside {
            let moved = structures.before.joint_stiffnesses();
            for k in 0..2 {
                if moved[k].is_finite() && centre[k].is_finite() && centre[k] > 0.0 {
                    variances[k] += (moved[k] / centre[k]).ln().powi(2);
                }
            }
        }
        variances.map(f64::sqrt)
    }
}

/// Measured differences of a pair.
pub(crate) struct Differences {
    /// Measured change of each frequency (logarithm) beyond the described one.
    pub(crate) measured: Vec<f64>,
    /// Its variance by the readings.
    pub(crate) reading: Vec<f64>,
    /// Its variance by taking modes to another level.
    pub(crate) moved: Vec<f64>,
    scatter_share: f64,
    repeat_squares: f64,
    repeat_freedom: f64,
    frequencies: Vec<[f64; 2]>,
}

fn log_frequency(test: &Test, mode: usize) -> f64 {
    test.mode(mode).map_or(f64::NAN, |one| one.frequency.ln())
}

impl Differences {
    /// Averages the repeats of each side, each against its own description.
    fn new(pair: &Pair, modes: &[usize], centre: &Structures) -> Result<Self, StructureError> {
        let count = modes.len();
        let mut measured = vec![0.0; count];
        let (mut reading, mut moved) = (vec![0.0; count], vec![0.0; count]);
        let mut frequencies = vec![[0.0; 2]; count];
        let (mut squares, mut freedom, mut share) = (0.0, 0.0, 0.0);
        let sides = [&pair.before, &pair.after];
        for (side, tests) in sides.into_iter().enumerate() {
            let described = [&centre.before, &centre.after][side];
            let logs = [&centre.log_before, &centre.log_after][side];
            let mut beyond: DMatrix<f64> = DMatrix::zeros(tests.len(), count);
            let mut predicted_first = logs.clone();
            for (row, test) in tests.iter().enumerate() {
                let own = described_with(test, described.joint);
                let predicted = match own == *described {
                    true => logs.clone(),
                    false => log_frequencies(&own, modes)?,
                };
                if row == 0 {
                    predicted_first.clone_from(&predicted);
                }
                for (k, &mode) in modes.iter().enumerate() {
                    beyond[(row, k)] = log_frequency(test, mode) - predicted[k];
                    if let Some(own) = test.mode(mode) {
                        let all = own.frequency * tests.len() as f64;
                        reading[k] += (own.std / all).powi(2);
                        moved[k] += (own.moved.frequency / all).powi(2);
                    }
                }
            }
            let means: DVector<f64> = beyond.row_mean().transpose();
            let sign = if side == 0 { -1.0 } else { 1.0 };
            for k in 0..count {
                measured[k] += sign * means[k];
                // From the first test, so that a frequency without repeats keeps its digits.
                let first = tests[0]
                    .mode(modes[k])
                    .map_or(f64::NAN, |one| one.frequency);
                let away = means[k] - beyond[(0, k)] + logs[k] - predicted_first[k];
                frequencies[k][side] = first * away.exp();
                squares += beyond
                    .column(k)
                    .iter()
                    .map(|one| (one - means[k]).powi(2))
                    .sum::<f64>();
            }
            freedom += (count * (tests.len() - 1)) as f64;
            // A difference of two single tests has the share 1.
            share += 0.5 / tests.len() as f64;
        }
        Ok(Self {
            measured,
            reading,
            moved,
            scatter_share: share,
            repeat_squares: squares,
            repeat_freedom: freedom,
            frequencies,
        })
    }
}
