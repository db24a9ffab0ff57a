//! The consistent estimate under errors of the frequencies and of the beam.

use super::shared::{estimate_consistently, steel_strip};
use tapjoint::identify::consistent::{
    BeamTolerances, ConsistentEstimate, ConsistentEstimator, ConsistentSettings, FrequencyModel,
    JointedStructure, Parameter, Point, Quantity,
};
use tapjoint::identify::perturbation::{
    PAPER_PERCENTS, ReadingError, average_errors, common_sensitivity, mode_sensitivities,
    perturb_uniformly, sign_pattern_spans,
};
use tapjoint::identify::{
    MeasuredMode, PairsModel, Spread, Stiffnesses, monte_carlo, pairs_estimator,
};
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::PointMass;
use tapjoint::structure::{Assembly, Beam, BeamTheory};

const KX: f64 = 1415.0;
const KY: f64 = 4.83;

fn cantilever() -> JointedStructure {
    JointedStructure::new(BeamTheory::Euler, steel_strip(), Assembly::Cantilever)
}

/// A sensor at the very tip, where a mass weighs most.
fn with_tip_sensor(beam: &Beam) -> JointedStructure {
    JointedStructure {
        beam: *beam,
        masses: vec![PointMass {
            position: beam.length,
            mass: 0.024,
            inertia: 0.0,
        }],
        ..cantilever()
    }
}

/// Frequencies of this structure on the joint, whose stiffness in N/m is that on the strip.
fn frequencies(structure: &JointedStructure, count: usize) -> Vec<f64> {
    let model = FrequencyModel::new(structure, count + 1).unwrap();
    let units = StiffnessUnits::of(&steel_strip());
    let mut point: Point = model.nominal();
    point[0] = (KX * units.kt).ln();
    point[1] = (KY * units.kr).ln();
    let frequency = |mode: usize| model.response(&point, mode, mode as f64).frequency;
    (1..=count).map(frequency).collect()
}

fn modes_of(frequencies: &[f64], std: f64) -> Vec<MeasuredMode> {
    let numbered = frequencies.iter().zip(1..);
    numbered
        .map(|(&frequency, mode)| MeasuredMode {
            mode,
            frequency,
            std: Some(std * frequency),
        })
        .collect()
}

fn close(found: f64, expected: f64, relative: f64, what: &str) {
    let off = (found / expected - 1.0).abs();
    assert!(off <= relative, "{what}: {found} against {expected}");
}

fn std_of(estimate: &ConsistentEstimate, quantity: Quantity) -> f64 {
    let found = estimate.quantity(quantity).unwrap();
    found.std.unwrap() / found.value.unwrap()
}

#[test]
fn recover_a_length_tolerance_carried_along_with_a_tip_sensor() {
    let strip = steel_strip();
    // As many frequencies as stiffnesses: they say nothing of the length, whose tolerance then adds
    // what moving the length does to the estimate, found here by moving it.
    let measured = frequencies(&with_tip_sensor(&strip), 2);
    let modes = modes_of(&measured, 1e-4);
    let plain = ConsistentSettings::two_parameter();
    let at = |length: f64, settings: &ConsistentSettings| {
        let beam = Beam { length, ..strip };
        estimate_consistently(&with_tip_sensor(&beam), &modes, settings).unwrap()
    };
    let tolerance = 2e-3;
    let mut uncertain = plain.clone();
    uncertain.tolerances = BeamTolerances {
        length: Some(tolerance),
        ..BeamTolerances::default()
    };
    let (without, with) = (at(strip.length, &plain), at(strip.length, &uncertain));
    let step = 1e-4;
    let (long, short) = (
        at(strip.length * (1.0 + step), &plain),
        at(strip.length * (1.0 - step), &plain),
    );
    for quantity in [Quantity::Kt, Quantity::Kr, Quantity::Kx, Quantity::Ky] {
        let log =
            |found: &ConsistentEstimate| found.quantity(quantity).unwrap().value.unwrap().ln();
        let slope = (log(&long) - log(&short)) / (2.0 * step);
        let expected = std_of(&without, quantity).hypot(slope * tolerance);
        // The difference quotient leaves the square of its step; elements divide alike.
        close(std_of(&with, quantity), expected, 1e-4, quantity.name());
    }
}

#[test]
fn recover_refits_where_the_body_was_renewed() {
    // The modulus described is a tenth too high, and a sensor at the tip makes the body depend on it.
    let described = Beam {
        modulus: 1.1 * steel_strip().modulus,
        ..steel_strip()
    };
    let modes = modes_of(&frequencies(&with_tip_sensor(&steel_strip()), 5), 1e-4);
    let fit = [Parameter::Kt, Parameter::Kr, Parameter::Modulus];
    let settings = ConsistentSettings::fitting(&fit);
    let structure = with_tip_sensor(&described);
    let estimator = ConsistentEstimator::new(&structure, &modes, &settings).unwrap();
    let near = estimator.neighbourhood();
    let (fit, again) = (
        estimator.fit(),
        estimator.refit(&estimator.frequencies(), &near),
    );
    for (first, second) in fit.point.iter().zip(&again.point) {
        // Both find one minimum of one model.
        assert!((first - second).abs() < 1e-8, "{fit:?} against {again:?}");
    }
    // Elements are right to a millionth, and the body follows the modulus to 1e-4 squared.
    close(again.joint().kx, KX, 1e-4, "kx");
    close(again.point[3].exp(), steel_strip().modulus, 1e-4, "modulus");
}

#[test]
fn recover_repetitions_draw_the_beams_tolerances_too() {
    let modes = modes_of(&frequencies(&cantilever(), 5), 1e-4);
    let mut settings = ConsistentSettings::two_parameter();
    settings.tolerances = BeamTolerances {
        thickness: Some(5e-3),
        ..BeamTolerances::default()
    };
    let estimator = ConsistentEstimator::new(&cantilever(), &modes, &settings).unwrap();
    let near = estimator.neighbourhood();
    let found = estimator.monte_carlo(&near, &[], 2000, 3).unwrap();
    let estimate = estimator.estimate().unwrap();
    for (quantity, spread) in [(Quantity::Kx, found.kx), (Quantity::Ky, found.ky)] {
        let spread = spread.unwrap();
        let half = (spread.high / spread.low).ln() / (2.0 * 1.959_964);
        // 2000 repetitions know the ends of a 95 % interval to about 3 %.
        close(half, std_of(&estimate, quantity), 0.1, quantity.name());
    }
    // Without the tolerance the frequencies seem to say far more.
    let plain = ConsistentSettings::two_parameter();
    let plain = estimate_consistently(&cantilever(), &modes, &plain).unwrap();
    assert!(std_of(&estimate, Quantity::Kt) > 2.0 * std_of(&plain, Quantity::Kt));
}

#[test]
fn prop_small_perturbations_are_the_covariances() {
    let modes = modes_of(&frequencies(&cantilever(), 5), 1e-3);
    let settings = ConsistentSettings::two_parameter();
    let estimator = ConsistentEstimator::new(&cantilever(), &modes, &settings).unwrap();
    let near = estimator.neighbourhood();
    let moved = estimator.stiffnesses_near(&near);
    let stds: Vec<f64> = modes.iter().map(|mode| mode.std.unwrap()).collect();
    let rows = mode_sensitivities(&estimator.frequencies(), &stds, &moved).unwrap();
    let [[xx, xy], [_, yy]] = estimator.estimate().unwrap().stiffness_covariance.unwrap();
    // Independent errors: the covariance is the sum over the modes of what each does alone.
    let sum = |pick: fn(Stiffnesses) -> f64| -> f64 {
        let each = rows
            .iter()
            .map(|row| pick(row.percent_per_percent.unwrap()));
        each.sum::<f64>() * 1e-6
    };
    // Percent per percent is the derivative of the logarithms, by differences of a thousandth percent.
    close(sum(|k| k.kx * k.kx), xx, 1e-4, "Kx");
    close(sum(|k| k.ky * k.ky), yy, 1e-4, "Ky");
    close(sum(|k| k.kx * k.ky), xy, 1e-3, "both");
}

#[test]
fn limit_uniform_changes_of_a_free_modulus_leave_the_joint_alone() {
    // All frequencies up by p: the modulus by 2p, and with it both springs, so that Kx and Ky stay.
    let modes = modes_of(&frequencies(&cantilever(), 5), 1e-3);
    let settings = ConsistentSettings::fitting(&[Parameter::Kt, Parameter::Kr, Parameter::Modulus]);
    let estimator = ConsistentEstimator::new(&cantilever(), &modes, &settings).unwrap();
    let near = estimator.neighbourhood();
    let moved = estimator.stiffnesses_near(&near);
    let nominal = moved(&estimator.frequencies()).unwrap();
    let rows = perturb_uniformly(&estimator.frequencies(), &PAPER_PERCENTS, &moved);
    let averages = average_errors(&nominal, &rows);
    assert_eq!(averages.len(), 2);
    for row in averages {
        // Percent; what the minimum's own tolerance leaves.
        assert!(row.mean_magnitude.kx < 1e-5, "{row:?}");
        assert!(row.mean_magnitude.ky < 1e-5, "{row:?}");
    }
}

#[test]
fn limit_a_rigid_joint_is_infinite_under_any_change() {
    let mut clamped = cantilever();
    clamped.theory = BeamTheory::Euler;
    let model = FrequencyModel::new(&clamped, 6).unwrap();
    let mut point = model.nominal();
    (point[0], point[1]) = (
        f64::INFINITY,
        (KY * StiffnessUnits::of(&steel_strip()).kr).ln(),
    );
    let frequency = |mode: usize| model.response(&point, mode, mode as f64).frequency;
    let exact: Vec<f64> = (1..=5).map(frequency).collect();
    let modes = modes_of(&exact, 1e-3);
    let settings = ConsistentSettings::two_parameter();
    let estimator = ConsistentEstimator::new(&clamped, &modes, &settings).unwrap();
    let near = estimator.neighbourhood();
    let found = estimator.monte_carlo(&near, &[], 500, 1).unwrap();
    // Half of the draws ask for more than rigid: the interval has no upper end, and does not lose them.
    assert_eq!(found.failed, 0);
    assert_eq!(found.kx.unwrap().high, f64::INFINITY);
    assert!(found.kx.unwrap().low.is_finite());
}

#[test]
fn val_half_lines_are_drawn_uniform_and_scatter_normal() {
    // The estimate is the frequency itself.
    let itself = |frequencies: &[f64]| {
        Some(Stiffnesses {
            kx: frequencies[0],
            ky: frequencies[1],
            kz: None,
        })
    };
    let half_line = 0.125;
    let scatter = 0.02;
    let std = half_line / 3f64.sqrt();
    let errors = [
        ReadingError::new(std, half_line),
        ReadingError::new(scatter, 0.0),
    ];
    let samples = 40_000;
    let drawn = monte_carlo(&[100.0, 300.0], &errors, samples, 9, itself).unwrap();
    let half = |spread: Option<Spread>| 0.5 * (spread.unwrap().high - spread.unwrap().low);
    // 95 % of a uniform distribution lie within 0.95 of its half width, of a normal one within 1.96 standard
    // deviations. 40,000 draws know such ends to 0.5 % at most.
    close(half(drawn.kx), 0.95 * half_line, 0.015, "uniform");
    close(half(drawn.ky), 1.959_964 * scatter, 0.015, "normal");
    for found in &drawn.cloud {
        // No draw is beyond half a line.
        assert!((found.kx - 100.0).abs() <= half_line, "{found:?}");
    }
    // Both together have the stated variance: half_line^2/3 + scatter^2.
    let both = ReadingError::new(std.hypot(scatter), half_line);
    let drawn = monte_carlo(&[100.0, 300.0], &[both; 2], 1000, 9, itself).unwrap();
    let squares = drawn
        .cloud
        .iter()
        .flat_map(|found| [found.kx - 100.0, found.ky - 300.0]);
    let variance = squares.map(|error| error * error).sum::<f64>() / 2000.0;
    // 2000 draws know a variance to 3 %.
    close(variance, std * std + scatter * scatter, 0.1, "variance");
}

#[test]
fn limit_uniform_draws_stay_within_the_sign_patterns() {
    // As many modes as stiffnesses, and small errors: the estimate is monotonic in each, so that the corners of the box
    // enclose all draws.
    let modes = modes_of(&frequencies(&cantilever(), 2), 1e-4);
    let half_lines: Vec<f64> = modes
        .iter()
        .map(|mode| 3f64.sqrt() * mode.std.unwrap())
        .collect();
    let settings = ConsistentSettings::two_parameter();
    let estimator = ConsistentEstimator::new(&cantilever(), &modes, &settings).unwrap();
    let near = estimator.neighbourhood();
    let moved = |frequencies: &[f64]| estimator.stiffnesses_near(&near)(frequencies);
    let corners = sign_pattern_spans(&estimator.frequencies(), &half_lines, 1, moved).unwrap();
    let found = estimator.monte_carlo(&near, &half_lines, 500, 1).unwrap();
    let (kx, ky) = (corners.kx.unwrap(), corners.ky.unwrap());
    // What the last step of a fit leaves.
    let slack = 1e-6;
    for one in &found.cloud {
        assert!(one.kx > kx.low * (1.0 - slack) && one.kx < kx.high * (1.0 + slack));
        assert!(one.ky > ky.low * (1.0 - slack) && one.ky < ky.high * (1.0 + slack));
    }
}

#[test]
fn prop_a_common_factor_is_the_sum_of_all_modes() {
    let exact = frequencies(&cantilever(), 4);
    let beam = steel_strip();
    let estimator = pairs_estimator(PairsModel::TwoParameter, &beam, &[1, 2, 3, 4]).unwrap();
    let common = common_sensitivity(&exact, 0.01, &estimator);
    let bounds: Vec<f64> = exact.iter().map(|f| 1e-4 * f).collect();
    let each = mode_sensitivities(&exact, &bounds, &estimator).unwrap();
    let sum = |pick: fn(Stiffnesses) -> f64| -> f64 {
        let all = each
            .iter()
            .map(|row| pick(row.percent_per_percent.unwrap()));
        all.sum()
    };
    let slope = common.percent_per_percent.unwrap();
    // Central differences of 1e-5: derivatives to about 1e-6.
    close(sum(|k| k.kx), slope.kx, 1e-4, "Kx");
    close(sum(|k| k.ky), slope.ky, 1e-4, "Ky");
    // By 0.01 % the estimate is still linear to 1 %.
    let change = common.percent_per_bound.unwrap();
    close(change.kx, 0.01 * slope.kx, 0.01, "Kx by its bound");
    close(change.ky, 0.01 * slope.ky, 0.01, "Ky by its bound");
}
