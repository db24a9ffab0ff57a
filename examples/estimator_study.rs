//! How well the consistent estimate does what it says, beside the pair regression:
//! `cargo run --release --example estimator_study [joints per cell]`.
//!
//! Five frequencies of an Euler cantilever on joints drawn at random, Kx and Ky from 1 to 10^4
//! evenly in their logarithm, the coupling evenly between -0.95 and 0.95 where the model has one:
//! exact, and with normal errors of 0.01, 0.03 and 0.1 %. The region of which bias and coverage are
//! shown is where the parameter's standard uncertainty, predicted at the true joint, is below 10 %.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use tapjoint::identify::consistent::{
    ConsistentEstimate, ConsistentEstimator, ConsistentSettings, JointedStructure, Quantity,
};
use tapjoint::identify::pairs::{ModeLambda, PairsModel, estimate_pairs};
use tapjoint::identify::{IdentifyError, MeasuredMode};
use tapjoint::structure::{Assembly, Beam, BeamTheory, JointStiffness, natural_frequencies};

const MODES: usize = 5;
const NOISE: [f64; 3] = [1e-4, 3e-4, 1e-3];
const REGION: f64 = 0.1;
/// Exact frequencies carry rounding of some 1e-15 of themselves.
const ROUNDING: f64 = 3e-14;

fn strip() -> Beam {
    Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    }
}

/// One drawn joint with its frequencies.
struct Case {
    joint: JointStiffness,
    frequencies: Vec<f64>,
    random: ChaCha8Rng,
}

fn draw(model: PairsModel, seed: u64, index: usize) -> Option<Case> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(index as u64);
    let kx = 10f64.powf(random.random_range(0.0..4.0));
    let ky = 10f64.powf(random.random_range(0.0..4.0));
    let coupling = match model {
        PairsModel::ThreeParameter => random.random_range(-0.95..0.95),
        _ => 0.0,
    };
    let joint = JointStiffness {
        kx,
        ky,
        cross_compliance: coupling / (kx * ky).sqrt(),
    };
    let beam = strip();
    let assembly = Assembly::Cantilever;
    let frequencies =
        natural_frequencies(BeamTheory::Euler, &beam, assembly, &joint, MODES).ok()?;
    Some(Case {
        joint,
        frequencies,
        random,
    })
}

fn settings(model: PairsModel) -> ConsistentSettings {
    match model {
        PairsModel::ThreeParameter => ConsistentSettings::three_parameter(),
        _ => ConsistentSettings::two_parameter(),
    }
}

fn estimator(
    frequencies: &[f64],
    settings: &ConsistentSettings,
    noise: f64,
) -> Result<ConsistentEstimator, IdentifyError> {
    let structure = JointedStructure::new(BeamTheory::Euler, strip(), Assembly::Cantilever);
    let modes: Vec<MeasuredMode> = frequencies
        .iter()
        .enumerate()
        .map(|(index, &frequency)| MeasuredMode {
            mode: index + 1,
            frequency,
            std: Some(noise * frequency),
        })
        .collect();
    ConsistentEstimator::new(&structure, &modes, settings)
}

/// ln Kx, ln Ky, coupling.
fn coordinates(joint: &JointStiffness) -> [f64; 3] {
    [joint.kx.ln(), joint.ky.ln(), joint.coupling()]
}

/// Largest error of any parameter in units of what rounding may do, and in itself.
fn exact_error(model: PairsModel, index: usize) -> Option<(f64, f64, f64)> {
    let case = draw(model, 1, index)?;
    let estimator = estimator(&case.frequencies, &settings(model), 1.0).ok()?;
    let fit = estimator.fit();
    let (found, truth) = (coordinates(&fit.joint()), coordinates(&case.joint));
    let mut worst = (0.0f64, 0.0f64);
    for ((found, truth), std) in found.iter().zip(truth).zip(fit.stds()) {
        // Of unit relative errors; what rounding does to this parameter.
        let allowed = (ROUNDING * std.unwrap_or(f64::INFINITY)).max(1e-8);
        let error = (found - truth).abs();
        worst = (worst.0.max(error / allowed), worst.1.max(error));
    }
    let condition = fit.stds().iter().flatten().fold(0.0f64, |a, b| a.max(*b));
    Some((worst.0, worst.1, condition))
}

fn exact_study(model: PairsModel, cases: usize) {
    let errors: Vec<Option<(f64, f64, f64)>> = (0..cases)
        .into_par_iter()
        .map(|index| exact_error(model, index))
        .collect();
    let found: Vec<(f64, f64, f64)> = errors.into_iter().flatten().collect();
    let failed = cases - found.iter().filter(|error| error.0 <= 1.0).count();
    let plain = found.iter().filter(|error| error.1 <= 1e-8).count();
    let worst = found.iter().fold(0.0f64, |most, error| most.max(error.0));
    let condition = found.iter().fold(0.0f64, |most, error| most.max(error.2));
    println!(
        "exact, {model:?}: {cases} joints, {failed} failures, {plain} within 1e-8; worst error \
         {worst:.2} of what is allowed, largest std per relative frequency error {condition:.1e}"
    );
}

/// What one noisy case says of one parameter.
#[derive(Clone, Copy)]
struct Sample {
    error: f64,
    pairs_error: Option<f64>,
    predicted_std: f64,
    covered: bool,
    one_sided: Option<bool>,
}

fn noisy_case(model: PairsModel, noise: f64, index: usize) -> Option<[Option<Sample>; 3]> {
    let mut case = draw(model, 2, index)?;
    let at_truth = estimator(&case.frequencies, &settings(model), noise)
        .ok()?
        .fit();
    let noisy: Vec<f64> = case
        .frequencies
        .iter()
        .map(|frequency| {
            let normal: f64 = StandardNormal.sample(&mut case.random);
            frequency * (1.0 + noise * normal)
        })
        .collect();
    let estimate = estimator(&noisy, &settings(model), noise)
        .ok()?
        .estimate()
        .ok()?;
    let lambdas: Vec<f64> = noisy.iter().map(|f| strip().lambda_of(*f)).collect();
    let pairs = estimate_pairs(model, &ModeLambda::numbered(&lambdas)).ok();
    let pairs = pairs.and_then(|pairs| pairs.joint());
    let truth = coordinates(&case.joint);
    let mut samples = [None; 3];
    let quantities = [Quantity::Kx, Quantity::Ky, Quantity::Coupling];
    for (index, quantity) in quantities.into_iter().enumerate() {
        let std = at_truth.stds().get(index).copied().flatten();
        samples[index] = std.and_then(|std| {
            let scale = if index == 2 {
                1.0 - truth[2].powi(2)
            } else {
                1.0
            };
            let pairs = pairs.as_ref().map(|joint| value(joint, index));
            sample(
                &estimate,
                quantity,
                (value(&case.joint, index), pairs),
                std * scale,
            )
        });
    }
    Some(samples)
}

fn value(joint: &JointStiffness, index: usize) -> f64 {
    [joint.kx, joint.ky, joint.coupling()][index]
}

fn sample(
    estimate: &ConsistentEstimate,
    quantity: Quantity,
    (truth, pairs): (f64, Option<f64>),
    predicted_std: f64,
) -> Option<Sample> {
    let found = estimate.quantity(quantity)?;
    // Stiffnesses by their relative error, the coupling by its own.
    let scale = if quantity == Quantity::Coupling {
        1.0
    } else {
        truth
    };
    let above = found.low.is_none_or(|low| low <= truth);
    let below = found.high.is_none_or(|high| truth <= high);
    let at_least = found.at_least.map(|limit| truth >= limit);
    let at_most = found.at_most.map(|limit| truth <= limit);
    Some(Sample {
        error: (found.value? - truth) / scale,
        pairs_error: pairs
            .map(|pairs| (pairs - truth) / scale)
            .filter(|error| error.is_finite()),
        predicted_std,
        covered: above && below,
        one_sided: at_least.or(at_most),
    })
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn percent(part: usize, whole: usize) -> String {
    if whole == 0 {
        return "-".to_owned();
    }
    format!("{:.1}", 100.0 * part as f64 / whole as f64)
}

/// Wilson's 95 % interval of a share (%).
fn wilson(part: usize, whole: usize) -> (f64, f64) {
    let (n, z) = (whole as f64, 1.959_964f64);
    let share = part as f64 / n;
    let middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt() / (1.0 + z * z / n);
    (100.0 * (middle - half), 100.0 * (middle + half))
}

/// Prints a cell; returns how many one-sided statements were right, and how many there were.
fn noisy_study(model: PairsModel, noise: f64, cases: usize) -> (usize, usize) {
    let mut statements = (0, 0);
    let rows: Vec<[Option<Sample>; 3]> = (0..cases)
        .into_par_iter()
        .filter_map(|index| noisy_case(model, noise, index))
        .collect();
    for (index, name) in ["kx", "ky", "coupling"].into_iter().enumerate() {
        let all: Vec<Sample> = rows.iter().filter_map(|row| row[index]).collect();
        if all.is_empty() {
            continue;
        }
        let region = || all.iter().filter(|sample| sample.predicted_std < REGION);
        let count = region().count();
        let bias = region()
            .map(|sample| sample.error / sample.predicted_std)
            .sum::<f64>()
            / count as f64;
        let both = || region().filter(|sample| sample.pairs_error.is_some());
        let pairs = |sample: &Sample| sample.pairs_error.unwrap_or(f64::NAN);
        let one_sided: Vec<bool> = all.iter().filter_map(|sample| sample.one_sided).collect();
        statements.0 += one_sided.iter().filter(|right| **right).count();
        statements.1 += one_sided.len();
        println!(
            "{model:>15} {:>6.2} {name:>9} {count:>6} {bias:>+7.3} {:>6} {:>6} {:>5} {:>6} {:>10.2e} {:>10.2e} {:>8.1} {:>8.1}",
            100.0 * noise,
            percent(region().filter(|sample| sample.covered).count(), count),
            percent(
                all.iter().filter(|sample| sample.covered).count(),
                all.len()
            ),
            one_sided.len(),
            percent(
                one_sided.iter().filter(|right| **right).count(),
                one_sided.len()
            ),
            rms(both().map(|sample| sample.error)),
            rms(both().map(pairs)),
            rms(both().map(pairs)) / rms(both().map(|sample| sample.error)),
            median(both().map(|sample| (pairs(sample) / sample.error).abs())),
            model = format!("{model:?}"),
        );
    }
    statements
}

fn main() {
    let cases = std::env::args()
        .nth(1)
        .and_then(|text| text.parse().ok())
        .unwrap_or(2000);
    for model in [PairsModel::TwoParameter, PairsModel::ThreeParameter] {
        exact_study(model, 5 * cases);
    }
    println!(
        "\n{:>15} {:>6} {:>9} {:>6} {:>7} {:>6} {:>6} {:>5} {:>6} {:>10} {:>10} {:>8} {:>8}",
        "model",
        "noise%",
        "of",
        "cases",
        "bias/s",
        "cover%",
        "all%",
        "one-s",
        "right%",
        "rms",
        "rms pairs",
        "rms x",
        "median x"
    );
    let mut one_sided = Vec::new();
    for noise in NOISE {
        let models = [PairsModel::TwoParameter, PairsModel::ThreeParameter];
        let counts = models.map(|model| noisy_study(model, noise, cases));
        one_sided.push((noise, counts[0].0 + counts[1].0, counts[0].1 + counts[1].1));
    }
    for (noise, right, count) in one_sided {
        let (low, high) = wilson(right, count);
        println!(
            "one-sided statements at {:.2} %: {right} of {count} right, {} % ({low:.1} to {high:.1})",
            100.0 * noise,
            percent(right, count)
        );
    }
}
