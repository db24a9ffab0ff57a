//! Damped least squares: the one solver behind every nonlinear fit of the program.
//!
//! The cost is half of a sum of squares, the negative logarithm of a normal density. Near a point it is
//! cost + g.d + d'A d/2 with the gradient g = J'r and the Gauss-Newton curvature A = J'J, both possibly
//! weighted for a robust loss and extended by priors. Each step solves (A + mu D) d = -g on the parameters
//! that are not pressed against a bound. D holds the largest diagonal of A so far (Moré 1978), so that the
//! units of the parameters do not matter. The first trial has the damping of the settings, by default
//! mu = 0, which is Gauss-Newton's step. A step that does not lower the cost is tried again with ten times
//! the damping (Levenberg 1944, Marquardt 1963), and the damping follows how much of its promise each step
//! keeps. Along a bent valley the first trial raises the cost. Where a problem offers it, a second step by the same
//! slopes leads back to it, before the damping shortens the way.

use crate::cholesky::Cholesky;
use nalgebra::{DMatrix, DVector};

/// A fit: a cost of some parameters and its derivatives.
pub trait Problem {
    /// Everything that one evaluation leaves behind, the cost among it.
    type State;

    /// Evaluates the cost at a point; `None` where the model does not exist. `from` is the state that the
    /// step started from, as a first guess for inner solutions.
    fn evaluate(&self, parameters: &[f64], from: Option<&Self::State>) -> Option<Self::State>;

    /// Returns the cost of a state: half of the sum of squares.
    fn cost(&self, state: &Self::State) -> f64;

    /// Returns gradient and curvature at a state. It is called once for each accepted state.
    fn linearise(&self, parameters: &[f64], state: &mut Self::State) -> Option<Linearised>;

    /// Returns gradient and curvature at a state by the slopes of `at`, a linearised state next to it. `None` where a
    /// problem does not offer that.
    fn linearise_by(
        &self,
        _at: &Self::State,
        _parameters: &[f64],
        _state: &Self::State,
    ) -> Option<Linearised> {
        None
    }

    /// Limits of each parameter, low and high; empty for none.
    fn bounds(&self) -> &[[f64; 2]] {
        &[]
    }

    /// Returns the point one step on; `None` where a step leaves the model's domain. A problem that writes
    /// its own may move more parameters than the linearised problem has columns.
    fn moved(&self, parameters: &[f64], step: &DVector<f64>) -> Option<Vec<f64>> {
        let bounds = self.bounds();
        let mut moved = parameters.to_vec();
        for (k, value) in moved.iter_mut().enumerate() {
            *value += step[k];
            if let Some([low, high]) = bounds.get(k) {
                *value = value.clamp(*low, *high);
            }
        }
        Some(moved)
    }
}

/// The cost near a point, in one of two forms.
#[derive(Debug, Clone)]
pub enum Linearised {
    /// Gradient J'r and curvature J'J: enough where no parameter is nearly undetermined.
    Normal {
        /// Gauss-Newton curvature of the cost.
        curvature: DMatrix<f64>,
        /// Gradient of the cost.
        gradient: DVector<f64>,
    },
    /// R and, as the last column, Q'r of J = QR, by [`Linearised::of_rows`]: keeps all digits where the
    /// curvature would square a large condition number. Below them are zeros and what no step changes.
    Triangle(DMatrix<f64>),
}

/// Limits at which a search ends, and its damping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// At most so many accepted steps.
    pub steps: usize,
    /// The search ends where the linear model promises a smaller decrease of the cost than this.
    pub gain: f64,
    /// It ends, too, where the promised decrease is smaller than this share of the cost.
    pub relative_gain: f64,
    /// It ends after a step that moved no parameter by more than this, or would have without success.
    pub step: f64,
    /// It ends after so many steps in a row that lowered the cost by less than the share [`Self::idle`].
    pub idle_steps: usize,
    /// Share of the cost below which a decrease counts as idle.
    pub idle: f64,
    /// Damping of the first trial, as a share of the curvature's diagonal. Above 0 the first steps stay short
    /// where parameters are nearly dependent.
    pub first_damping: f64,
    /// Largest damping, as a share of the curvature's diagonal.
    pub damping: f64,
    /// One more step is taken after the promise has become small: for digits beyond the tolerance.
    pub polish: bool,
}

impl Default for Settings {
    /// To the last digits that matter: a thousandth of a standard deviation is a gain of 5e-7.
    fn default() -> Self {
        Self {
            steps: 100,
            gain: 1e-9,
            relative_gain: 1e-15,
            step: 0.0,
            idle_steps: usize::MAX,
            idle: 0.0,
            first_damping: 0.0,
            damping: 1e9,
            polish: true,
        }
    }
}

/// Reason for which a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The linear model promises no noticeable decrease of the cost.
    Minimum,
    /// The last step moved no parameter noticeably.
    SmallStep,
    /// The last steps hardly lowered the cost.
    Idle,
    /// No step lowers the cost up to the largest damping, or none that moves a parameter noticeably.
    NoBetterStep,
    /// The limit of steps was reached.
    StepLimit,
    /// No parameter was free.
    NothingFree,
}

impl StopReason {
    /// Returns true where the search came to an end by itself.
    pub fn converged(self) -> bool {
        self != Self::StepLimit
    }
}

/// The end of a search.
#[derive(Debug, Clone)]
pub struct Minimum<S> {
    /// The parameters.
    pub parameters: Vec<f64>,
    /// The state at the parameters.
    pub state: S,
    /// Reason for which the search ended here.
    pub stop: StopReason,
}

/// Factor from one damping to the next. A rejected step raises the damping by it and an accepted one lowers
/// it at most by it, so that a search has at most three trials for each step and some 15 more.
const FACTOR: f64 = 10.0;
/// Weakest damping that is not none. It shortens a step by 1e-4 of itself, along the stiff directions. From a weaker one a
/// search at a bend needs more rejected trials until a step is short enough.
const WEAKEST: f64 = 1e-4;
/// Share of the promised decrease from which on the next step is damped less.
const KEPT: f64 = 0.75;
/// Share of the promised decrease below which the next step is damped more: with large residuals the curvature
/// is larger than J'J, and Gauss-Newton's steps go too far.
const POOR: f64 = 0.5;
/// Share of the promised decrease that a step and its way back to the valley have to keep.
const BENT: f64 = 0.25;
/// Least damping after a poor step.
const FIRM: f64 = 0.1;
/// Smallest diagonal of the damping matrix, relative to its largest: a parameter that nothing feels stays.
const FLOOR: f64 = 1e-24;

/// Follows the cost downhill from `start` to the nearest minimum; `None` where the model does not exist at the
/// start.
pub fn minimise<P: Problem>(
    problem: &P,
    start: &[f64],
    settings: &Settings,
) -> Option<Minimum<P::State>> {
    let mut parameters = start.to_vec();
    for (value, [low, high]) in parameters.iter_mut().zip(problem.bounds()) {
        *value = value.clamp(*low, *high);
    }
    let state = problem.evaluate(&parameters, None)?;
    let mut at = Point::new(problem, parameters, state)?;
    let mut scales = vec![0.0; at.local.columns()];
    let mut damping = settings.first_damping;
    let mut idle_steps = 0;
    for _ in 0..settings.steps {
        for (k, scale) in scales.iter_mut().enumerate() {
            *scale = f64::max(*scale, at.local.diagonal(k));
        }
        let tolerance = settings.gain.max(settings.relative_gain * at.cost);
        let mut step = at.step(problem.bounds(), &scales, 0.0);
        if let Step::NothingFree = step {
            return Some(at.ended(StopReason::NothingFree));
        }
        if step.promises_at_most(tolerance) {
            let last = match settings.polish {
                true => step.trial(problem, &at),
                false => None,
            };
            let lower = last.filter(|last| last.cost < at.cost);
            let last = lower.and_then(|lower| lower.point(problem));
            return Some(last.unwrap_or(at).ended(StopReason::Minimum));
        }
        if damping > 0.0 {
            let damped = at.step(problem.bounds(), &scales, damping);
            // A promise that only the damping makes small is no minimum.
            if damped.promises_at_most(tolerance) {
                damping = 0.0;
            } else {
                step = damped;
            }
        }
        let mut is_first = true;
        let next = loop {
            if step.promises_at_most(tolerance) {
                return Some(at.ended(StopReason::Minimum));
            }
            let mut trial = step.trial(problem, &at);
            if is_first && let Some(above) = trial.take_if(|trial| trial.cost >= at.cost) {
                let back = at.way_back(problem, above, &scales, damping);
                trial = back.filter(|back| step.promises_at_most((at.cost - back.cost) / BENT));
            }
            let lower = trial.filter(|trial| trial.cost < at.cost);
            if let Some(next) = lower.and_then(|lower| lower.point(problem)) {
                break next;
            }
            is_first = false;
            let is_short = matches!(&step, Step::To { step, .. } if step.amax() <= settings.step);
            if damping >= settings.damping || is_short {
                return Some(at.ended(StopReason::NoBetterStep));
            }
            damping = f64::max(WEAKEST, FACTOR * damping);
            step = at.step(problem.bounds(), &scales, damping);
        };
        let gain = at.cost - next.cost;
        let longest = (next.parameters.iter().zip(&at.parameters))
            .map(|(new, old)| (new - old).abs())
            .fold(0.0, f64::max);
        at = next;
        if longest <= settings.step {
            return Some(at.ended(StopReason::SmallStep));
        }
        idle_steps += 1;
        if gain > settings.idle * at.cost {
            idle_steps = 0;
        }
        if idle_steps >= settings.idle_steps {
            return Some(at.ended(StopReason::Idle));
        }
        if step.promises_at_most(gain / KEPT) {
            damping = if damping <= WEAKEST && is_first {
                0.0
            } else {
                f64::max(WEAKEST, damping / FACTOR)
            };
        } else if !step.promises_at_most(gain / POOR) {
            damping = f64::max(FIRM, FACTOR * damping).min(settings.damping);
        }
    }
    Some(at.ended(StopReason::StepLimit))
}

/// A point with its cost and derivatives.
struct Point<S> {
    parameters: Vec<f64>,
    state: S,
    cost: f64,
    local: Linearised,
}

impl<S> Point<S> {
    fn new<P: Problem<State = S>>(problem: &P, parameters: Vec<f64>, mut state: S) -> Option<Self> {
        let linearised = problem.linearise(&parameters, &mut state)?;
        Some(Self {
            cost: problem.cost(&state),
            parameters,
            state,
            local: linearised,
        })
    }

    fn ended(self, stop: StopReason) -> Minimum<S> {
        Minimum {
            parameters: self.parameters,
            state: self.state,
            stop,
        }
    }

    /// Returns the point that a second step by the slopes of this point reaches from one above; `None` where the problem
    /// does not offer that.
    fn way_back<P: Problem<State = S>>(
        &self,
        problem: &P,
        above: Trial<S>,
        scales: &[f64],
        damping: f64,
    ) -> Option<Trial<S>> {
        let local = problem.linearise_by(&self.state, &above.parameters, &above.state)?;
        let above = Self {
            parameters: above.parameters,
            state: above.state,
            cost: above.cost,
            local,
        };
        let step = above.step(problem.bounds(), scales, damping);
        step.trial(problem, &above)
    }

    /// Returns the damped step on the parameters that no bound holds back.
    fn step(&self, bounds: &[[f64; 2]], scales: &[f64], damping: f64) -> Step {
        let mut held: Vec<bool> = bounds.iter().map(|[low, high]| low >= high).collect();
        while held.iter().filter(|held| **held).count() < scales.len() {
            let Some(step) = self.local.solve(&held, scales, damping) else {
                return Step::Singular;
            };
            let mut is_pressed = false;
            for (k, [low, high]) in bounds.iter().enumerate() {
                let value = self.parameters[k];
                let outward = value <= *low && step[k] < 0.0 || value >= *high && step[k] > 0.0;
                if outward && !held[k] {
                    held[k] = true;
                    is_pressed = true;
                }
            }
            if !is_pressed {
                let promise = self.local.promise(&step);
                return Step::To { step, promise };
            }
        }
        Step::NothingFree
    }
}

/// A step of the linearised problem.
enum Step {
    /// The step, and the decrease of the cost that the linear model promises.
    To { step: DVector<f64>, promise: f64 },
    /// The parameters are not independent at this damping.
    Singular,
    /// Every parameter is held or pressed against a bound.
    NothingFree,
}

impl Step {
    /// Returns true for a step that promises no larger decrease of the cost.
    fn promises_at_most(&self, gain: f64) -> bool {
        matches!(self, Self::To { promise, .. } if *promise <= gain)
    }

    /// Returns the point behind the step; `None` where the model does not exist there.
    fn trial<P: Problem>(&self, problem: &P, at: &Point<P::State>) -> Option<Trial<P::State>> {
        let Self::To { step, .. } = self else {
            return None;
        };
        let parameters = problem.moved(&at.parameters, step)?;
        let state = problem.evaluate(&parameters, Some(&at.state))?;
        Some(Trial {
            cost: problem.cost(&state),
            parameters,
            state,
        })
    }
}

/// A point behind a step, before its derivatives are computed.
struct Trial<S> {
    parameters: Vec<f64>,
    state: S,
    cost: f64,
}

impl<S> Trial<S> {
    fn point<P: Problem<State = S>>(self, problem: &P) -> Option<Point<S>> {
        Point::new(problem, self.parameters, self.state)
    }
}

impl Linearised {
    /// Returns the triangle of a Jacobian, the derivative of each residual (row) with respect to each parameter
    /// (column), and of the residuals.
    pub fn of_rows(mut jacobian: DMatrix<f64>, residuals: &[f64]) -> Self {
        let (rows, columns) = jacobian.shape();
        assert_eq!(rows, residuals.len(), "one residual for each row");
        jacobian = jacobian.resize(rows.max(columns), columns + 1, 0.0);
        for (row, residual) in residuals.iter().enumerate() {
            jacobian[(row, columns)] = *residual;
        }
        triangularise(&mut jacobian);
        Self::Triangle(jacobian)
    }

    /// Returns the number of directions in which a step may go: one for each parameter, unless
    /// [`Problem::moved`] has it otherwise.
    fn columns(&self) -> usize {
        match self {
            Self::Normal { gradient, .. } => gradient.len(),
            Self::Triangle(triangle) => triangle.ncols() - 1,
        }
    }

    /// Returns the curvature along one parameter.
    fn diagonal(&self, k: usize) -> f64 {
        match self {
            Self::Normal { curvature, .. } => curvature[(k, k)],
            Self::Triangle(triangle) => (0..=k).map(|row| triangle[(row, k)].powi(2)).sum(),
        }
    }

    /// Returns the decrease of the cost that a step promises, -g.d - d'A d/2.
    fn promise(&self, step: &DVector<f64>) -> f64 {
        match self {
            Self::Normal {
                curvature,
                gradient,
            } => -step.dot(gradient) - 0.5 * step.dot(&(curvature * step)),
            Self::Triangle(triangle) => {
                let columns = step.len();
                let mut gain = 0.0;
                for row in 0..columns {
                    let moved: f64 = (row..columns).map(|k| triangle[(row, k)] * step[k]).sum();
                    gain -= moved * (triangle[(row, columns)] + 0.5 * moved);
                }
                gain
            }
        }
    }

    /// Solves (A + damping D) d = -g, with d = 0 for the parameters that are held (none where the list is
    /// empty); `None` where the others are not independent.
    fn solve(&self, held: &[bool], scales: &[f64], damping: f64) -> Option<DVector<f64>> {
        let largest = scales.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let solution = match self {
            Self::Normal {
                curvature,
                gradient,
            } => {
                let (mut matrix, mut solution) = (curvature.clone(), -gradient);
                for (k, scale) in scales.iter().enumerate() {
                    matrix[(k, k)] += damping * scale.max(FLOOR * largest);
                    if held.get(k) == Some(&true) {
                        matrix.row_mut(k).fill(0.0);
                        matrix.column_mut(k).fill(0.0);
                        matrix[(k, k)] = 1.0;
                        solution[k] = 0.0;
                    }
                }
                Cholesky::new(&matrix)?.solve(solution.as_mut_slice());
                solution
            }
            Self::Triangle(triangle) if damping == 0.0 && !held.contains(&true) => {
                solve_triangle(triangle)
            }
            Self::Triangle(triangle) => {
                let columns = scales.len();
                let mut damped = DMatrix::zeros(2 * columns, columns + 1);
                let mut top = damped.rows_mut(0, columns);
                top.copy_from(&triangle.rows(0, columns));
                for (k, scale) in scales.iter().enumerate() {
                    damped[(columns + k, k)] = (damping * scale.max(FLOOR * largest)).sqrt();
                    if held.get(k) == Some(&true) {
                        damped.column_mut(k).fill(0.0);
                        damped[(columns + k, k)] = 1.0;
                    }
                }
                triangularise(&mut damped);
                solve_triangle(&damped)
            }
        };
        solution.iter().all(|x| x.is_finite()).then_some(solution)
    }
}

/// Solves R d = -b for an upper triangle R with b as its last column. A pivot of zero gives no finite number.
fn solve_triangle(triangle: &DMatrix<f64>) -> DVector<f64> {
    let columns = triangle.ncols() - 1;
    let mut solution = -triangle.view((0, columns), (columns, 1)).column(0);
    for k in (0..columns).rev() {
        solution[k] /= triangle[(k, k)];
        for row in 0..k {
            solution[row] -= triangle[(row, k)] * solution[k];
        }
    }
    solution
}

/// Turns a matrix into an upper triangle by Householder's reflections from the left.
fn triangularise(matrix: &mut DMatrix<f64>) {
    let (rows, columns) = matrix.shape();
    for k in 0..columns.min(rows) {
        let (done, others) = matrix.as_mut_slice().split_at_mut((k + 1) * rows);
        let own = &mut done[k * rows + k..];
        let norm = own.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm == 0.0 {
            continue;
        }
        let diagonal = if own[0] > 0.0 { -norm } else { norm };
        // The reflection's vector is the column with this head; 2/(v.v) = -1/(diagonal head).
        own[0] -= diagonal;
        let scale = 1.0 / (diagonal * own[0]);
        for other in others.chunks_exact_mut(rows) {
            let other = &mut other[k..];
            let product: f64 = own.iter().zip(&*other).map(|(a, b)| a * b).sum();
            for (entry, part) in other.iter_mut().zip(&*own) {
                *entry += scale * product * part;
            }
        }
        own.fill(0.0);
        own[0] = diagonal;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley, 10 (y - x^2) and 1 - x, in either form.
    #[derive(Default)]
    struct Valley {
        rows: bool,
        bounds: Vec<[f64; 2]>,
        has_way_back: bool,
    }

    impl Valley {
        fn jacobian(at: &[f64]) -> DMatrix<f64> {
            DMatrix::from_row_slice(2, 2, &[-20.0 * at[0], 10.0, -1.0, 0.0])
        }

        fn normal(jacobian: &DMatrix<f64>, residuals: &DVector<f64>) -> Linearised {
            Linearised::Normal {
                curvature: jacobian.tr_mul(jacobian),
                gradient: jacobian.tr_mul(residuals),
            }
        }
    }

    impl Problem for Valley {
        /// Residuals, the place where they were computed, and the number of slopes computed on the way.
        type State = (DVector<f64>, Vec<f64>, usize);

        fn evaluate(&self, at: &[f64], from: Option<&Self::State>) -> Option<Self::State> {
            let residuals = DVector::from_vec(vec![10.0 * (at[1] - at[0] * at[0]), 1.0 - at[0]]);
            Some((residuals, at.to_vec(), from.map_or(0, |from| from.2)))
        }

        fn cost(&self, state: &Self::State) -> f64 {
            0.5 * state.0.norm_squared()
        }

        fn linearise(&self, at: &[f64], state: &mut Self::State) -> Option<Linearised> {
            let (residuals, _, slopes) = state;
            *slopes += 1;
            let jacobian = Self::jacobian(at);
            Some(match self.rows {
                true => Linearised::of_rows(jacobian, residuals.as_slice()),
                false => Self::normal(&jacobian, residuals),
            })
        }

        fn linearise_by(
            &self,
            at: &Self::State,
            _: &[f64],
            state: &Self::State,
        ) -> Option<Linearised> {
            self.has_way_back
                .then(|| Self::normal(&Self::jacobian(&at.1), &state.0))
        }

        fn bounds(&self) -> &[[f64; 2]] {
            &self.bounds
        }
    }

    /// More, Garbow & Hillstrom (1981), problem 1: from (-1.2, 1) to the minimum 0 at (1, 1).
    #[test]
    fn val_rosenbrock_is_solved_in_either_form() {
        for rows in [false, true] {
            let valley = Valley {
                rows,
                ..Valley::default()
            };
            let found = minimise(&valley, &[-1.2, 1.0], &Settings::default()).unwrap();
            assert!(
                found.parameters.iter().all(|x| (x - 1.0).abs() < 1e-7),
                "{:?}",
                found.parameters
            );
        }
    }

    /// On x <= 0.5 the best is x = 0.5, y = 0.25: the gradient then points out of the bound.
    #[test]
    fn val_a_bound_is_kept_and_the_rest_is_minimal() {
        for rows in [false, true] {
            let bounds = vec![[-2.0, 0.5], [-2.0, 2.0]];
            let valley = Valley {
                rows,
                bounds,
                ..Valley::default()
            };
            let found = minimise(&valley, &[-1.2, 1.0], &Settings::default()).unwrap();
            assert!(
                (found.parameters[0] - 0.5).abs() < 1e-12,
                "{:?}",
                found.parameters
            );
            assert!(
                (found.parameters[1] - 0.25).abs() < 1e-7,
                "{:?}",
                found.parameters
            );
        }
    }

    #[test]
    fn limit_held_parameters_stay_and_none_free_is_an_end() {
        let held = Valley {
            rows: true,
            bounds: vec![[0.3, 0.3], [-2.0, 2.0]],
            ..Valley::default()
        };
        let found = minimise(&held, &[0.0, 0.0], &Settings::default()).unwrap();
        assert_eq!(found.parameters[0], 0.3);
        assert!(
            (found.parameters[1] - 0.09).abs() < 1e-9,
            "{:?}",
            found.parameters
        );
        let none = Valley {
            rows: true,
            bounds: vec![[0.3, 0.3], [0.2, 0.2]],
            ..Valley::default()
        };
        let found = minimise(&none, &[0.0, 0.0], &Settings::default()).unwrap();
        assert_eq!(found.stop, StopReason::NothingFree);
    }

    /// From (-1.2, 1) Gauss-Newton's step leads to x = 1 at once, and the way back to y = 1. Damped steps alone follow the
    /// bend.
    #[test]
    fn prop_the_way_back_spares_slopes_in_a_bent_valley() {
        let slopes = [false, true].map(|has_way_back| {
            let valley = Valley {
                has_way_back,
                ..Valley::default()
            };
            let found = minimise(&valley, &[-1.2, 1.0], &Settings::default()).unwrap();
            assert!(found.parameters.iter().all(|x| (x - 1.0).abs() < 1e-7));
            found.state.2
        });
        assert!(slopes[1] <= 4 && slopes[1] < slopes[0], "{slopes:?}");
    }

    /// Two parameters whose sum alone matters: the damped step is defined where Gauss-Newton's is not.
    #[test]
    fn limit_a_direction_that_nothing_feels_does_not_stop_the_search() {
        struct Sum;
        impl Problem for Sum {
            type State = f64;
            fn evaluate(&self, at: &[f64], _: Option<&f64>) -> Option<f64> {
                Some((at[0] + at[1]).exp() - 2.0)
            }
            fn cost(&self, residual: &f64) -> f64 {
                0.5 * residual * residual
            }
            fn linearise(&self, at: &[f64], residual: &mut f64) -> Option<Linearised> {
                let slope = (at[0] + at[1]).exp();
                Some(Linearised::Normal {
                    curvature: DMatrix::from_element(2, 2, slope * slope),
                    gradient: DVector::from_element(2, slope * *residual),
                })
            }
        }
        let found = minimise(&Sum, &[0.0, 0.0], &Settings::default()).unwrap();
        let sum = found.parameters[0] + found.parameters[1];
        assert!((sum - 2f64.ln()).abs() < 1e-5, "{sum}");
    }
}
