//! Poles of every order, and which of them the order before had already.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::eigenvalues::inverse_roots;
use super::normal_equations::{CircleMap, Denominators};
use super::{PolyreferenceError, PolyreferenceSettings, ResponseMatrix, StabilityTolerances};
use crate::modal::projection::conjugate_product;

/// What of a pole the order before had already, in the classes of the usual diagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PoleStability {
    /// Nothing near it.
    New,
    /// The frequency.
    Frequency,
    /// Frequency and participation vector; not given for a single input, whose vectors are all
    /// alike.
    FrequencyAndVector,
    /// Frequency and damping; with several inputs, not the participation vector.
    FrequencyAndDamping,
    /// Frequency, damping and, with several inputs, the participation vector.
    All,
}

/// A pole of the stabilisation diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilisationPole {
    /// Order of the denominator it was found at.
    pub order: usize,
    /// The pole (1/s), imaginary part positive, decay of an exponential window taken out.
    pub pole: Complex64,
    /// Natural frequency (Hz), |p|/(2 pi).
    pub frequency: f64,
    /// Damping ratio, -Re p/|p|.
    pub damping_ratio: f64,
    /// Participation of each input, of unit length, its largest entry real; (1) for one input.
    pub participation: Vec<Complex64>,
    /// What the order before had of it.
    pub stability: PoleStability,
}

/// Poles of all orders from `least_order` to `order`, ascending in order and frequency.
///
/// Shown are poles within the band that decay, with a damping ratio below `most_damping`: with the
/// lowest coefficient fixed the others belong to no structure (see the module's text).
///
/// # Errors
/// [`PolyreferenceError::TooFewLines`] where the band holds fewer lines than unknowns,
/// [`PolyreferenceError::Weights`] where the weights do not fit, [`PolyreferenceError::Singular`]
/// where the responses are all zero.
pub fn stabilise_poles(
    matrix: &ResponseMatrix,
    settings: &PolyreferenceSettings,
) -> Result<Vec<StabilisationPole>, PolyreferenceError> {
    let weights = settings.weights_for(matrix)?;
    settings.check_lines(matrix)?;
    let map = CircleMap::new(matrix);
    let (low, high) = matrix.ends();
    let singular = PolyreferenceError::Singular { low, high };
    let denominators = Denominators::new(matrix, &map, settings.order, &weights).ok_or(singular)?;
    let mut diagram: Vec<StabilisationPole> = Vec::new();
    let mut before: Vec<StabilisationPole> = Vec::new();
    for order in settings.least_order.max(1)..=settings.order {
        let mut poles = poles_of_order(matrix, &map, &denominators, (order, settings));
        for pole in &mut poles {
            pole.stability = stability(pole, &before, &settings.tolerances, matrix.spacing());
        }
        diagram.extend(poles.iter().cloned());
        before = poles;
    }
    Ok(diagram)
}

fn poles_of_order(
    matrix: &ResponseMatrix,
    map: &CircleMap,
    denominators: &Denominators,
    (order, settings): (usize, &PolyreferenceSettings),
) -> Vec<StabilisationPole> {
    let Some(coefficients) = denominators.coefficients(order) else {
        return Vec::new();
    };
    let (low, high) = matrix.ends();
    let mut poles: Vec<StabilisationPole> = inverse_roots(&coefficients)
        .into_iter()
        .filter(|root| root.norm_sqr() > 0.0)
        .filter_map(|root| {
            let seen = map.pole(root);
            let pole = seen + settings.added_decay;
            let frequency = pole.norm() / TAU;
            let damping_ratio = -pole.re / pole.norm();
            let inside = (low..=high).contains(&(pole.im / TAU));
            let physical = pole.re < 0.0 && pole.im > 0.0 && damping_ratio < settings.most_damping;
            (inside && physical).then(|| StabilisationPole {
                order,
                pole,
                frequency,
                damping_ratio,
                participation: participation(&coefficients, map.inverse_root(seen)),
                stability: PoleStability::New,
            })
        })
        .collect();
    poles.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    poles
}

/// The left null vector of A(z) at a pole: near it H = B A^{-1} is (B v) w^H/(s - p) with A v = 0 and
/// w^H A = 0, so that conj(w) says how much each input takes part.
fn participation(coefficients: &DMatrix<Complex64>, inverse_root: Complex64) -> Vec<Complex64> {
    let (size, inputs) = coefficients.shape();
    if inputs == 1 {
        return vec![Complex64::ONE];
    }
    // A(z) w^n = I w^n + A_1 w^{n-1} + ... + A_n, by Horner.
    let mut value = DMatrix::<Complex64>::identity(inputs, inputs);
    for block in 0..size / inputs {
        value *= inverse_root;
        value += coefficients.rows(block * inputs, inputs);
    }
    let svd = value.svd(true, false);
    let smallest = svd.singular_values.imin();
    let vector: Vec<Complex64> = svd.u.map_or_else(Vec::new, |u| {
        u.column(smallest).iter().map(Complex64::conj).collect()
    });
    turned(vector)
}

/// The vector with its largest entry real and positive.
fn turned(vector: Vec<Complex64>) -> Vec<Complex64> {
    let largest =
        vector.iter().copied().fold(
            Complex64::ZERO,
            |a, b| if b.norm() > a.norm() { b } else { a },
        );
    let phase = largest.conj() / largest.norm().max(f64::MIN_POSITIVE);
    vector.into_iter().map(|value| value * phase).collect()
}

/// Least frequency tolerance (lines): what noise moves a pole narrower than a line.
const LEAST_TOLERANCE: f64 = 0.1;

fn stability(
    pole: &StabilisationPole,
    before: &[StabilisationPole],
    tolerances: &StabilityTolerances,
    spacing: f64,
) -> PoleStability {
    let Some(nearest) = before.iter().min_by(|a, b| {
        let distance = |other: &StabilisationPole| (other.pole - pole.pole).norm();
        distance(a).total_cmp(&distance(b))
    }) else {
        return PoleStability::New;
    };
    let half_power = 2.0 * pole.damping_ratio * pole.frequency;
    let allowed = (tolerances.frequency * pole.frequency)
        .min((tolerances.half_power_share * half_power).max(LEAST_TOLERANCE * spacing));
    if (pole.frequency - nearest.frequency).abs() > allowed {
        return PoleStability::New;
    }
    let damping = (pole.damping_ratio - nearest.damping_ratio).abs()
        <= tolerances.damping * pole.damping_ratio;
    // 1 - MAC of the participation vectors, both of unit length.
    let likeness = conjugate_product(&pole.participation, &nearest.participation).norm_sqr();
    let vector = 1.0 - likeness <= tolerances.participation;
    let several = pole.participation.len() > 1;
    match (damping, vector) {
        (true, true) => PoleStability::All,
        (true, false) => PoleStability::FrequencyAndDamping,
        (false, true) if several => PoleStability::FrequencyAndVector,
        (false, _) => PoleStability::Frequency,
    }
}
