//! Multi-linear regression over mode pairs (Ingole & Chatterjee, eqs. 13 to 19).
//!
//! Each natural frequency gives one equation that is linear in the joint's unknowns but for one
//! term, a product of them. Subtracting the equations of every two modes removes that product;
//! the differences are solved by least squares with the pseudo-inverse.
//!
//! The normal equations of all pair differences are n times those of the equations less their mean. The estimate is
//! therefore computed from n rows instead of n(n-1)/2: ordinary least squares with the product as a free intercept.
//! That the product is left free is also the method's weakness: an estimate need not satisfy its own frequency
//! equation, and `closure` is the relative error left there.

use super::IdentifyError;
use super::perturbation::Stiffnesses;
use nalgebra::{DMatrix, DVector, SVD};
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;
use tapjoint_beam::interface::{Coefficients, JointedBody};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Beam, JointStiffness, Slenderness};
use tapjoint_numerics::stats::NORMAL_95;

/// A singular value below this part of the largest is taken for zero. Frequencies are never
/// known to ten digits, so that nothing measurable is lost.
const RANK_THRESHOLD: f64 = 1e-10;

/// From this closure on (1) an estimate does not satisfy its own frequency equation: 5 %
/// in the product is about what a whole line of 800 does to the first mode.
const CLOSURE_LIMIT: f64 = 0.05;

/// Frequency equation that the regression uses. All are those of an Euler beam without added
/// masses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PairsModel {
    /// Cantilever with Kx and Ky, in stiffness form:
    /// Kx Ky = lambda^4 F3/F4 + Ky lambda^3 F6/F4 - Kx lambda F5/F4.
    TwoParameter,
    /// Cantilever with Kx, Ky and Kz, in compliance form with a = 1/Kx, b = 1/Ky, c = 1/Kz:
    /// ab - c^2 = F4/(lambda^4 F3) - a F6/(lambda F3) + b F5/(lambda^3 F3) + 2c F1/(lambda^2 F3).
    ThreeParameter,
    /// Lap joint in the middle with Kx and Ky, with h = lambda/2, A = eta11(h)/4, B = eta22(h):
    /// Kx Ky = -1/(AB) - Kx/B - Ky/A.
    Lap,
}

impl PairsModel {
    fn words(self) -> &'static str {
        match self {
            Self::TwoParameter => "two-parameter joint",
            Self::ThreeParameter => "three-parameter joint",
            Self::Lap => "lap joint",
        }
    }

    /// Number of unknown stiffnesses.
    pub fn unknowns(self) -> usize {
        match self {
            Self::TwoParameter | Self::Lap => 2,
            Self::ThreeParameter => 3,
        }
    }

    /// Number of modes it needs: n modes have n - 1 independent differences.
    fn modes_needed(self) -> usize {
        self.unknowns() + 1
    }

    fn undetermined(self, rank: usize) -> IdentifyError {
        IdentifyError::Undetermined {
            model: self.words(),
            unknowns: self.unknowns(),
            rank,
            remedy: match self {
                Self::Lap => {
                    "it needs a symmetric mode, which sees ky, and an antisymmetric one, which sees kx"
                }
                _ => {
                    "add modes, or leave out those that coincide or sit on a clamped beam's frequency"
                }
            },
        }
    }

    fn body(self) -> JointedBody {
        match self {
            Self::TwoParameter | Self::ThreeParameter => JointedBody::Rooted(Slenderness::EULER),
            Self::Lap => JointedBody::halves(&Slenderness::EULER),
        }
    }
}

/// A measured mode, non-dimensional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeLambda {
    /// The mode's number in the model, from 1.
    pub mode: usize,
    /// Non-dimensional frequency lambda (1).
    pub lambda: f64,
}

impl ModeLambda {
    /// Modes 1, 2, ... of a list of lambdas (1).
    pub fn numbered(lambdas: &[f64]) -> Vec<Self> {
        let numbered = (1..).zip(lambdas);
        numbered
            .map(|(mode, &lambda)| Self { mode, lambda })
            .collect()
    }
}

/// Joint stiffness by regression over mode pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct PairsEstimate {
    /// The frequency equation used.
    pub model: PairsModel,
    /// Numbers of the modes used.
    pub modes: Vec<usize>,
    /// Kx (1); `None` where it is not finite.
    pub kx: Option<f64>,
    /// Ky (1); `None` where it is not finite.
    pub ky: Option<f64>,
    /// Kz (1); `None` without cross coupling or where it is not finite.
    pub kz: Option<f64>,
    /// Coupling sqrt(Kx Ky)/Kz (1), for the three-parameter joint where it exists.
    pub coupling: Option<f64>,
    /// Product implied by the regression / product of its own estimates - 1 (1). 0 where the
    /// frequencies are exactly those of such a joint.
    pub closure: Option<f64>,
    /// Largest over smallest singular value of the regression, its columns scaled to 1.
    pub condition: f64,
    /// Doubts about the estimate.
    pub doubts: Vec<Doubt>,
}

impl PairsEstimate {
    /// The stiffnesses where all of the model's are finite.
    pub fn stiffnesses(&self) -> Option<Stiffnesses> {
        let complete = self.model != PairsModel::ThreeParameter || self.kz.is_some();
        let (kx, ky, kz) = (self.kx?, self.ky?, self.kz);
        complete.then_some(Stiffnesses { kx, ky, kz })
    }

    /// As a joint of the theory, which may refuse it; `None` where a stiffness is not finite.
    pub fn joint(&self) -> Option<JointStiffness> {
        let Stiffnesses { kx, ky, kz } = self.stiffnesses()?;
        Some(match kz {
            Some(kz) => JointStiffness::three_parameter(kx, ky, kz),
            None => JointStiffness::two_parameter(kx, ky),
        })
    }
}

/// The joint's stiffness by the given frequency equation, from any subset of modes: at least three for Kx and
/// Ky, of a lap joint of both symmetries, and four with Kz.
///
/// # Errors
/// [`IdentifyError::TooFewModes`], [`IdentifyError::Frequency`] or
/// [`IdentifyError::Undetermined`].
pub fn estimate_pairs(
    model: PairsModel,
    modes: &[ModeLambda],
) -> Result<PairsEstimate, IdentifyError> {
    if modes.len() < model.modes_needed() {
        return Err(IdentifyError::TooFewModes {
            model: model.words(),
            unknowns: model.unknowns(),
            needed: model.modes_needed(),
            found: modes.len(),
            simpler: match model {
                PairsModel::ThreeParameter => ", or take model 2p, which needs 3",
                _ => "",
            },
        });
    }
    for &ModeLambda { mode, lambda } in modes {
        check_frequency(mode, lambda)?;
    }
    Ok(PairsEstimate {
        modes: modes.iter().map(|mode| mode.mode).collect(),
        ..interpret(model, &solve(model, modes)?)
    })
}

fn check_frequency(mode: usize, value: f64) -> Result<(), IdentifyError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(IdentifyError::Frequency { mode, value })
    }
}

struct Solution {
    unknowns: DVector<f64>,
    product: f64,
    condition: f64,
}

/// Least squares of the modes' equations less their mean, by singular values. A row has the coefficients of the
/// unknowns, from the frequency equation of [`tapjoint_beam::interface`], and the right-hand side; the product, with
/// coefficient 1, stands on the left as well.
fn solve(model: PairsModel, modes: &[ModeLambda]) -> Result<Solution, IdentifyError> {
    let (rows, columns) = (modes.len(), model.unknowns());
    let mut matrix = DMatrix::zeros(rows, columns);
    let mut right = DVector::zeros(rows);
    for (row, mode) in modes.iter().enumerate() {
        let Coefficients { p, x, y, z, q } = model.body().coefficients(mode.lambda);
        let own;
        (own, right[row]) = match model {
            // Divided by ab Q: product + Kx X/Q + Ky Y/Q = -P/Q.
            PairsModel::TwoParameter | PairsModel::Lap => ([x / q, y / q, 0.0], -p / q),
            // Divided by P: product + a Y/P + b X/P - 2c Z/P = -Q/P.
            PairsModel::ThreeParameter => ([y / p, x / p, -2.0 * z / p], -q / p),
        };
        matrix.row_mut(row).copy_from_slice(&own[..columns]);
    }
    // Scaled before the means are taken out: a column that is constant but for rounding must
    // stay as small as that rounding.
    let scales: Vec<f64> = matrix.column_iter().map(|column| column.amax()).collect();
    let finite = matrix.iter().chain(right.iter()).all(|x| x.is_finite());
    if !finite || scales.contains(&0.0) {
        return Err(model.undetermined(0));
    }
    for (mut column, scale) in matrix.column_iter_mut().zip(&scales) {
        column /= *scale;
    }
    let means: Vec<f64> = matrix.column_iter().map(|column| column.mean()).collect();
    let right_mean = right.mean();
    for (mut column, mean) in matrix.column_iter_mut().zip(&means) {
        column.add_scalar_mut(-mean);
    }
    right.add_scalar_mut(-right_mean);
    // The iteration limit guards against a decomposition that never settles.
    let svd = SVD::try_new(matrix, true, true, f64::EPSILON, 1000).ok_or(model.undetermined(0))?;
    let largest = svd.singular_values.max();
    let threshold = RANK_THRESHOLD * largest;
    let rank = svd.rank(threshold);
    if rank < columns {
        return Err(model.undetermined(rank));
    }
    let scaled = svd
        .solve(&right, threshold)
        .map_err(|_| model.undetermined(rank))?;
    let explained: f64 = scaled.iter().zip(&means).map(|(x, mean)| x * mean).sum();
    Ok(Solution {
        unknowns: DVector::from_fn(columns, |row, _| scaled[row] / scales[row]),
        product: right_mean - explained,
        condition: largest / svd.singular_values.min(),
    })
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Stiffnesses, closure and doubts of a solution.
fn interpret(model: PairsModel, solution: &Solution) -> PairsEstimate {
    let unknowns = &solution.unknowns;
    let (kx, ky, kz, own) = match model {
        PairsModel::TwoParameter | PairsModel::Lap => {
            let (kx, ky) = (unknowns[0], unknowns[1]);
            (kx, ky, None, kx * ky)
        }
        PairsModel::ThreeParameter => {
            let (a, b, c) = (unknowns[0], unknowns[1], unknowns[2]);
            (1.0 / a, 1.0 / b, Some(1.0 / c), a * b - c * c)
        }
    };
    let mut doubts = Vec::new();
    for (parameter, value) in [("kx", Some(kx)), ("ky", Some(ky)), ("kz", kz)] {
        match value {
            Some(value) if !value.is_finite() => doubts.push(Doubt::NotFinite { parameter }),
            Some(value) if value < 0.0 && parameter != "kz" => {
                doubts.push(Doubt::Negative { parameter, value });
            }
            _ => {}
        }
    }
    let positive = kx > 0.0 && ky > 0.0;
    let limit = (kx * ky).sqrt();
    if let Some(kz) = kz.filter(|kz| positive && kz.abs() <= limit) {
        doubts.push(Doubt::NotPhysical { kz, limit });
    }
    let closure = finite(solution.product / own - 1.0);
    if let Some(closure) = closure.filter(|closure| closure.abs() > CLOSURE_LIMIT) {
        doubts.push(Doubt::Closure { closure });
    }
    PairsEstimate {
        model,
        modes: Vec::new(),
        kx: finite(kx),
        ky: finite(ky),
        kz: kz.and_then(finite),
        coupling: kz.filter(|_| positive).and_then(|kz| finite(limit / kz)),
        closure,
        condition: solution.condition,
        doubts,
    }
}

/// Estimate from one mode alone; a value that the mode cannot give is null.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct SingleMode {
    /// Mode number.
    pub mode: usize,
    /// Kx = -1/A (1) of a lap joint, if the mode is antisymmetric; null where it is negative or infinite, so
    /// that the mode cannot be antisymmetric.
    pub kx: Option<f64>,
    /// Ky = -1/B (1) of a lap joint, if the mode is symmetric; null where the mode cannot be.
    pub ky: Option<f64>,
    /// Young's modulus (Pa) of a free beam.
    pub modulus: Option<f64>,
}

/// Returns the stiffness that each mode of a lap joint gives alone, for either symmetry.
///
/// # Errors
/// [`IdentifyError::Frequency`].
pub fn single_mode_stiffness(modes: &[ModeLambda]) -> Result<Vec<SingleMode>, IdentifyError> {
    let modes = modes.iter().map(|&ModeLambda { mode, lambda }| {
        check_frequency(mode, lambda)?;
        let Coefficients { p, x, y, .. } = PairsModel::Lap.body().coefficients(lambda);
        let [kx, ky] = [-p / x, -p / y].map(|k| (k > 0.0 && k.is_finite()).then_some(k));
        Ok(SingleMode {
            mode,
            kx,
            ky,
            modulus: None,
        })
    });
    modes.collect()
}

/// A doubt about an estimate that exists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doubt {
    /// A stiffness came out negative: no spring does that.
    Negative {
        /// Name of the stiffness ("kx" or "ky").
        parameter: &'static str,
        /// Its value (1).
        value: f64,
    },
    /// A stiffness came out infinite or not a number.
    NotFinite {
        /// Name of the stiffness.
        parameter: &'static str,
    },
    /// The three stiffnesses belong to no joint: Kz^2 <= Kx Ky.
    NotPhysical {
        /// Kz (1).
        kz: f64,
        /// sqrt(Kx Ky) (1), which |Kz| must exceed.
        limit: f64,
    },
    /// The estimate does not satisfy its own frequency equation.
    Closure {
        /// Product implied by the regression / product of its own estimates - 1.
        closure: f64,
    },
    /// The interval of the coupling contains zero: Kz may be infinite, of either sign.
    CouplingNotEstablished,
}

impl Doubt {
    /// Short name, for reports.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Negative { .. } => "negative-stiffness",
            Self::NotFinite { .. } => "no-finite-stiffness",
            Self::NotPhysical { .. } => "not-physical",
            Self::Closure { .. } => "closure",
            Self::CouplingNotEstablished => "coupling-not-established",
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Negative { parameter, value } => write!(
                f,
                "{parameter} came out negative ({value:.4}): no spring does that, so the frequencies \
                 or the model are wrong"
            ),
            Self::NotFinite { parameter } => write!(
                f,
                "{parameter} has no finite value: the frequencies do not feel that spring"
            ),
            Self::NotPhysical { kz, limit } => write!(
                f,
                "no joint has these three stiffnesses: |kz| = {:.4} should exceed \
                 sqrt(kx ky) = {limit:.4}",
                kz.abs()
            ),
            Self::Closure { closure } => write!(
                f,
                "the pair regression does not satisfy its own frequency equation: the product it \
                 implies differs by {:.1} % from that of its estimates",
                100.0 * closure
            ),
            Self::CouplingNotEstablished => write!(
                f,
                "the interval of the coupling contains zero: kz may be infinite, of either sign"
            ),
        }
    }
}

// A joint estimate with its uncertainty and in SI units.

/// Relative standard uncertainty of any frequency that no repetition within a recording shows (1): 0.005 %, a steel beam's change
/// over a third of a kelvin.
pub const FREQUENCY_FLOOR: f64 = 5e-5;

/// A measured natural frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredMode {
    /// The mode's number in the model, from 1; rigid-body modes do not count.
    pub mode: usize,
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Its standard uncertainty (Hz), where known.
    pub std: Option<f64>,
}

/// A value with its uncertainty.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Uncertain {
    /// The value; null where it is infinite: rigid.
    #[schemars(with = "Option<f64>")]
    pub value: f64,
    /// Standard deviation.
    pub std: Option<f64>,
    /// Lower 95 % limit; null where it is unknown or unbounded.
    pub low: Option<f64>,
    /// Upper 95 % limit; null where it is unknown or unbounded.
    pub high: Option<f64>,
    /// Standard deviation scaled by the misfit: where the model misses the frequencies by more than
    /// their uncertainties, and where none are stated.
    pub std_scaled: Option<f64>,
    /// Lower 95 % limit by the scaled standard deviation and Student's distribution.
    pub low_scaled: Option<f64>,
    /// Upper 95 % limit likewise.
    pub high_scaled: Option<f64>,
    /// Where there is no upper limit: at least this much, with 95 % confidence.
    pub at_least: Option<f64>,
    /// Where there is no lower limit: at most this much, likewise.
    pub at_most: Option<f64>,
}

impl Uncertain {
    /// A value with a symmetric 95 % interval, value +- 1.96 std.
    pub fn symmetric(value: f64, std: Option<f64>) -> Self {
        Self {
            value,
            std,
            low: std.map(|std| value - NORMAL_95 * std),
            high: std.map(|std| value + NORMAL_95 * std),
            ..Self::default()
        }
    }

    /// In another unit, `factor` (positive) times the number.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = *self;
        scaled.value *= factor;
        let known = [&mut scaled.std, &mut scaled.low, &mut scaled.high];
        let of_misfit = [
            &mut scaled.std_scaled,
            &mut scaled.low_scaled,
            &mut scaled.high_scaled,
        ];
        let limits = [&mut scaled.at_least, &mut scaled.at_most];
        for number in known.into_iter().chain(of_misfit).chain(limits).flatten() {
            *number *= factor;
        }
        scaled
    }
}

/// Joint stiffness with uncertainty, non-dimensional and in SI units. What does not exist is
/// `None`.
#[derive(Debug, Clone, PartialEq)]
pub struct JointEstimate {
    /// Numbers of the modes used.
    pub modes_used: Vec<usize>,
    /// Kx (1).
    pub kx: Option<Uncertain>,
    /// Ky (1).
    pub ky: Option<Uncertain>,
    /// Kz (1); without interval where the coupling's contains 0.
    pub kz: Option<Uncertain>,
    /// Coupling sqrt(Kx Ky)/Kz (1).
    pub coupling: Option<Uncertain>,
    /// Kt (N/m).
    pub kt: Option<Uncertain>,
    /// Kr (N m/rad).
    pub kr: Option<Uncertain>,
    /// Ktr (N/rad).
    pub ktr: Option<Uncertain>,
    /// The regression behind it.
    pub pairs: PairsEstimate,
    /// For a lap joint: what each mode says alone; else empty.
    pub single_modes: Vec<SingleMode>,
    /// Doubts about it.
    pub doubts: Vec<Doubt>,
}

/// Estimates a joint by the pair regression and carries the frequencies' standard uncertainties
/// through it, to first order and as independent. All modes given are used. Without the standard
/// uncertainty of every mode the estimate has none.
///
/// # Errors
/// As [`estimate_pairs`], and [`IdentifyError::Structure`] where the beam cannot exist.
pub fn estimate_joint(
    model: PairsModel,
    beam: &Beam,
    modes: &[MeasuredMode],
) -> Result<JointEstimate, IdentifyError> {
    beam.check()?;
    for mode in modes {
        check_frequency(mode.mode, mode.frequency)?;
    }
    let frequencies: Vec<f64> = modes.iter().map(|mode| mode.frequency).collect();
    let lambdas = lambdas_of(beam, modes.iter().map(|mode| mode.mode), &frequencies);
    let pairs = estimate_pairs(model, &lambdas)?;
    let nearby = nearby(model, beam, modes, frequencies);
    let [kx, ky, kz, coupling] = PICKED.map(|pick| {
        let std = nearby.as_ref().and_then(|nearby| std_of(nearby, pick));
        pick(&pairs).map(|value| Uncertain::symmetric(value, std))
    });
    // Kz has its interval by way of 1/Kz, which is what the frequencies determine. Where that interval contains
    // zero, Kz is unbounded on both sides.
    let std = nearby.and_then(|nearby| std_of(&nearby, |pairs| pairs.kz.map(f64::recip)));
    let kz = kz.map(|kz| {
        let compliance = Uncertain::symmetric(1.0 / kz.value, std);
        let ends = compliance.low.zip(compliance.high);
        let ends = ends.filter(|(low, high)| low * high > 0.0);
        Uncertain {
            low: ends.map(|ends| 1.0 / ends.1),
            high: ends.map(|ends| 1.0 / ends.0),
            ..kz
        }
    });
    let mut doubts = pairs.doubts.clone();
    if kz.is_some_and(|kz| kz.std.is_some() && kz.low.is_none()) {
        doubts.push(Doubt::CouplingNotEstablished);
    }
    let units = StiffnessUnits::of(beam);
    let single_modes = match model {
        PairsModel::Lap => single_mode_stiffness(&lambdas)?,
        PairsModel::TwoParameter | PairsModel::ThreeParameter => Vec::new(),
    };
    Ok(JointEstimate {
        modes_used: pairs.modes.clone(),
        kt: kx.map(|kx| kx.scaled(units.kt)),
        kr: ky.map(|ky| ky.scaled(units.kr)),
        ktr: kz.map(|kz| kz.scaled(units.ktr)),
        kx,
        ky,
        kz,
        coupling,
        pairs,
        single_modes,
        doubts,
    })
}

/// The pair regression as a function of the frequencies (Hz) of these modes, for
/// [`super::perturbation`]; `None` where it has no finite answer.
///
/// # Errors
/// [`IdentifyError::Structure`] where the beam cannot exist.
pub fn pairs_estimator<'a>(
    model: PairsModel,
    beam: &'a Beam,
    mode_numbers: &'a [usize],
) -> Result<impl Fn(&[f64]) -> Option<Stiffnesses> + 'a, IdentifyError> {
    beam.check()?;
    Ok(move |frequencies: &[f64]| {
        let lambdas = lambdas_of(beam, mode_numbers.iter().copied(), frequencies);
        estimate_pairs(model, &lambdas).ok()?.stiffnesses()
    })
}

fn lambdas_of(
    beam: &Beam,
    numbers: impl Iterator<Item = usize>,
    frequencies: &[f64],
) -> Vec<ModeLambda> {
    let lambdas = frequencies.iter().map(|f| beam.lambda_of(*f));
    let modes = numbers.zip(lambdas);
    modes
        .map(|(mode, lambda)| ModeLambda { mode, lambda })
        .collect()
}

/// Returns one number of a regression.
type Pick = fn(&PairsEstimate) -> Option<f64>;
const PICKED: [Pick; 4] = [
    |pairs| pairs.kx,
    |pairs| pairs.ky,
    |pairs| pairs.kz,
    |pairs| pairs.coupling,
];

/// The regressions with one frequency a little higher and lower, and its standard uncertainty over their distance.
type Nearby = ([PairsEstimate; 2], f64);

/// Returns the regressions near each frequency, by which uncertainties are propagated; `None` where a mode has no
/// standard uncertainty, or where a regression has no answer.
fn nearby(
    model: PairsModel,
    beam: &Beam,
    modes: &[MeasuredMode],
    mut frequencies: Vec<f64>,
) -> Option<Vec<Nearby>> {
    // Relative step: truncation of the order 1e-12, rounding of the order 1e-10.
    const STEP: f64 = 1e-6;
    let mut regressions = Vec::with_capacity(modes.len());
    for (index, mode) in modes.iter().enumerate() {
        let (std, step) = (mode.std?, STEP * mode.frequency);
        let [above, below] = [step, -step].map(|step| {
            frequencies[index] = mode.frequency + step;
            let numbers = modes.iter().map(|mode| mode.mode);
            estimate_pairs(model, &lambdas_of(beam, numbers, &frequencies)).ok()
        });
        frequencies[index] = mode.frequency;
        regressions.push(([above?, below?], std / (2.0 * step)));
    }
    Some(regressions)
}

/// Returns the standard uncertainty of one number, from independent ones of the frequencies: the root of
/// the sum of (derivative times std)^2, derivatives by central differences. `None` where the number
/// does not exist nearby.
fn std_of(nearby: &[Nearby], pick: Pick) -> Option<f64> {
    let mut variance = 0.0;
    for ([above, below], weight) in nearby {
        variance += ((pick(above)? - pick(below)?) * weight).powi(2);
    }
    variance.is_finite().then(|| variance.sqrt())
}
