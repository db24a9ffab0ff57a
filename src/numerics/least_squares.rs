//! Damped least squares: the one solver behind every nonlinear fit of the program.
//!
//! The cost is half of a sum of squares, the negative logarithm of a normal density. Near a point it is
//! cost + g.d + d'A d/2 with the gradient g = J'r and the Gauss-Newton curvature A = J'J, both possibly
//! weighted for a robust loss and extended by priors. Each step solves (A + mu D) d = -g on the parameters
//! that are not pressed against a bound. D holds the largest diagonal of A so far (Moré 1978), so that the
//! units of the parameters do not matter. The first trial has mu = 0, which is Gauss-Newton's step; a step
//! that does not lower the cost is tried again with ten times the damping (Levenberg 1944, Marquardt 1963).

use nalgebra::{Cholesky, DMatrix, DVector};

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

    /// Limits of each parameter, low and high; empty for none.
    fn bounds(&self) -> &[[f64; 2]] {
        &[]
    }

    /// Returns the point one step on; `None` where a step leaves the model's domain.
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
    /// Jacobian and residuals themselves: keeps all digits where the curvature would square a large
    /// condition number.
    Rows {
        /// Derivative of each residual (row) with respect to each parameter (column).
        jacobian: DMatrix<f64>,
        /// The residuals.
        residuals: DVector<f64>,
    },
}

/// When a search ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// At most so many accepted steps.
    pub steps: usize,
    /// The search ends where the linear model promises a smaller decrease of the cost than this.
    pub gain: f64,
    /// It ends, too, where the promised decrease is smaller than this share of the cost.
    pub relative_gain: f64,
    /// It ends after a step that moved no parameter by more than this.
    pub step: f64,
    /// It ends after so many steps in a row that lowered the cost by less than the share [`Self::idle`].
    pub idle_steps: usize,
    /// Share of the cost below which a decrease counts as idle.
    pub idle: f64,
    /// Damping of the first trial, as a share of the curvature's diagonal. Above 0 the first steps stay short
    /// where parameters are nearly dependent.
    pub first_damping: f64,
    /// Weakest damping that is not none.
    pub least_damping: f64,
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
            least_damping: 1e-3,
            damping: 1e9,
            polish: true,
        }
    }
}

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The linear model promises no noticeable decrease of the cost.
    Minimum,
    /// The last step moved no parameter noticeably.
    SmallStep,
    /// The last steps hardly lowered the cost.
    Idle,
    /// No step lowers the cost, however damped.
    NoBetterStep,
    /// The limit of steps was reached.
    StepLimit,
    /// No parameter was free.
    NothingFree,
}

/// The end of a search.
#[derive(Debug, Clone)]
pub struct Minimum<S> {
    /// The parameters.
    pub parameters: Vec<f64>,
    /// The state at the parameters.
    pub state: S,
    /// Why the search ended here.
    pub stop: StopReason,
}

/// Factor from one damping to the next.
const FACTOR: f64 = 10.0;
/// Share of the promised decrease from which on the next step is damped less.
const KEPT: f64 = 0.75;
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
    let mut scales = vec![0.0; start.len()];
    let mut damping = settings.first_damping;
    let mut idle_steps = 0;
    for _ in 0..settings.steps {
        for (k, scale) in scales.iter_mut().enumerate() {
            *scale = f64::max(*scale, at.linearised.diagonal(k));
        }
        let tolerance = settings.gain.max(settings.relative_gain * at.cost);
        let full = at.step(problem.bounds(), &scales, 0.0);
        let near = match &full {
            Step::NothingFree => return Some(at.ended(StopReason::NothingFree)),
            Step::Singular => false,
            Step::To(step) => at.linearised.promise(step) <= tolerance,
        };
        if near {
            let last = full.move_from(problem, &at).filter(|_| settings.polish);
            return Some(last.unwrap_or(at).ended(StopReason::Minimum));
        }
        let (next, promised) = loop {
            let step = at.step(problem.bounds(), &scales, damping);
            let promised = step.promise(&at.linearised);
            if promised.is_some_and(|gain| gain <= tolerance) {
                return Some(at.ended(StopReason::Minimum));
            }
            if let Some((next, promised)) = step.move_from(problem, &at).zip(promised) {
                break (next, promised);
            }
            if damping >= settings.damping {
                return Some(at.ended(StopReason::NoBetterStep));
            }
            damping = f64::max(settings.least_damping, FACTOR * damping);
        };
        let gain = at.cost - next.cost;
        let longest = (next.parameters.iter().zip(&at.parameters))
            .map(|(new, old)| (new - old).abs())
            .fold(0.0, f64::max);
        at = next;
        if longest <= settings.step {
            return Some(at.ended(StopReason::SmallStep));
        }
        idle_steps = if gain > settings.idle * at.cost {
            0
        } else {
            idle_steps + 1
        };
        if idle_steps >= settings.idle_steps {
            return Some(at.ended(StopReason::Idle));
        }
        if gain > KEPT * promised {
            damping = if damping > settings.least_damping {
                damping / FACTOR
            } else {
                0.0
            };
        }
    }
    Some(at.ended(StopReason::StepLimit))
}

/// A point with its cost and derivatives.
struct Point<S> {
    parameters: Vec<f64>,
    state: S,
    cost: f64,
    linearised: Linearised,
}

impl<S> Point<S> {
    fn new<P: Problem<State = S>>(problem: &P, parameters: Vec<f64>, mut state: S) -> Option<Self> {
        let linearised = problem.linearise(&parameters, &mut state)?;
        Some(Self {
            cost: problem.cost(&state),
            parameters,
            state,
            linearised,
        })
    }

    fn ended(self, stop: StopReason) -> Minimum<S> {
        Minimum {
            parameters: self.parameters,
            state: self.state,
            stop,
        }
    }

    /// Returns the damped step on the parameters that no bound holds back.
    fn step(&self, bounds: &[[f64; 2]], scales: &[f64], damping: f64) -> Step {
        let count = self.parameters.len();
        let mut free: Vec<usize> = (0..count)
            .filter(|&k| bounds.get(k).is_none_or(|[low, high]| low < high))
            .collect();
        while !free.is_empty() {
            let Some(lengths) = self.linearised.solve(&free, scales, damping) else {
                return Step::Singular;
            };
            let mut step = DVector::zeros(count);
            let mut kept = Vec::with_capacity(free.len());
            for (&k, &length) in free.iter().zip(lengths.iter()) {
                let value = self.parameters[k];
                let [low, high] = bounds
                    .get(k)
                    .copied()
                    .unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                let outward = value <= low && length < 0.0 || value >= high && length > 0.0;
                if !outward {
                    kept.push(k);
                }
                step[k] = length;
            }
            if kept.len() == free.len() {
                return Step::To(step);
            }
            free = kept;
        }
        Step::NothingFree
    }
}

/// A step of the linearised problem.
enum Step {
    To(DVector<f64>),
    /// The parameters are not independent at this damping.
    Singular,
    /// Every parameter is held or pressed against a bound.
    NothingFree,
}

impl Step {
    /// Returns the decrease of the cost that the linear model promises.
    fn promise(&self, linearised: &Linearised) -> Option<f64> {
        match self {
            Step::To(step) => Some(linearised.promise(step)),
            Step::Singular | Step::NothingFree => None,
        }
    }

    /// Takes the step; `None` where it does not lower the cost.
    fn move_from<P: Problem>(&self, problem: &P, at: &Point<P::State>) -> Option<Point<P::State>> {
        let Step::To(step) = self else {
            return None;
        };
        let parameters = problem.moved(&at.parameters, step)?;
        let state = problem.evaluate(&parameters, Some(&at.state))?;
        if problem.cost(&state) < at.cost {
            Point::new(problem, parameters, state)
        } else {
            None
        }
    }
}

impl Linearised {
    /// Returns the curvature along one parameter.
    fn diagonal(&self, k: usize) -> f64 {
        match self {
            Self::Normal { curvature, .. } => curvature[(k, k)],
            Self::Rows { jacobian, .. } => jacobian.column(k).norm_squared(),
        }
    }

    /// Returns the decrease of the cost that a step promises, -g.d - d'A d/2.
    fn promise(&self, step: &DVector<f64>) -> f64 {
        match self {
            Self::Normal {
                curvature,
                gradient,
            } => -step.dot(gradient) - 0.5 * step.dot(&(curvature * step)),
            Self::Rows {
                jacobian,
                residuals,
            } => {
                let moved = jacobian * step;
                -moved.dot(residuals) - 0.5 * moved.norm_squared()
            }
        }
    }

    /// Solves (A + damping D) d = -g on the parameters `free`; `None` where these are not independent.
    fn solve(&self, free: &[usize], scales: &[f64], damping: f64) -> Option<DVector<f64>> {
        let largest = scales.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let weights = free
            .iter()
            .map(|&k| damping * scales[k].max(FLOOR * largest));
        let solution = match self {
            Self::Normal {
                curvature,
                gradient,
            } => {
                let mut matrix = curvature.select_rows(free).select_columns(free);
                for (k, weight) in weights.enumerate() {
                    matrix[(k, k)] += weight;
                }
                Cholesky::new(matrix)?.solve(&-gradient.select_rows(free))
            }
            Self::Rows {
                jacobian,
                residuals,
            } => {
                let (rows, columns) = (jacobian.nrows(), free.len());
                let mut matrix = jacobian
                    .select_columns(free)
                    .resize_vertically(rows + columns, 0.0);
                for (k, weight) in weights.enumerate() {
                    matrix[(rows + k, k)] = weight.sqrt();
                }
                let mut right = -residuals.clone().resize_vertically(rows + columns, 0.0);
                let factors = matrix.qr();
                factors.q_tr_mul(&mut right);
                factors
                    .r()
                    .solve_upper_triangular(&right.rows(0, columns).into_owned())?
            }
        };
        solution.iter().all(|x| x.is_finite()).then_some(solution)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley, 10 (y - x^2) and 1 - x, in either form.
    struct Valley {
        rows: bool,
        bounds: Vec<[f64; 2]>,
    }

    impl Problem for Valley {
        type State = DVector<f64>;

        fn evaluate(&self, at: &[f64], _: Option<&Self::State>) -> Option<Self::State> {
            Some(DVector::from_vec(vec![
                10.0 * (at[1] - at[0] * at[0]),
                1.0 - at[0],
            ]))
        }

        fn cost(&self, residuals: &Self::State) -> f64 {
            0.5 * residuals.norm_squared()
        }

        fn linearise(&self, at: &[f64], residuals: &mut Self::State) -> Option<Linearised> {
            let jacobian = DMatrix::from_row_slice(2, 2, &[-20.0 * at[0], 10.0, -1.0, 0.0]);
            let residuals = residuals.clone();
            Some(if self.rows {
                Linearised::Rows {
                    jacobian,
                    residuals,
                }
            } else {
                Linearised::Normal {
                    curvature: jacobian.tr_mul(&jacobian),
                    gradient: jacobian.tr_mul(&residuals),
                }
            })
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
                bounds: vec![],
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
            let found =
                minimise(&Valley { rows, bounds }, &[-1.2, 1.0], &Settings::default()).unwrap();
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
        };
        let found = minimise(&none, &[0.0, 0.0], &Settings::default()).unwrap();
        assert_eq!(found.stop, StopReason::NothingFree);
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
