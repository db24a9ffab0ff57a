//! Tests of random structures whose description is not exact, and what the fit makes of them.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint::identify::MeasuredMode;
use tapjoint::identify::consistent::{
    AttachmentTolerance, BeamTolerances, ConsistentEstimate, ConsistentEstimator,
    ConsistentSettings, FrequencyModel, JointedStructure, LeftOutAnswer, Parameter, Quantity,
};
use tapjoint::structure::specimen::{Mesh, PointMass};
use tapjoint::structure::{Assembly, Beam, BeamTheory, Joint};

/// Structure and unknowns of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Cantilever, Kt and Kr.
    TwoParameter,
    /// Cantilever, Kt, Kr and the coupling.
    ThreeParameter,
    /// Lap joint, Kt and Kr.
    Lap,
    /// Free beam, its modulus.
    Free,
}

impl Kind {
    pub const ALL: [Self; 4] = [
        Self::TwoParameter,
        Self::ThreeParameter,
        Self::Lap,
        Self::Free,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::TwoParameter => "2p",
            Self::ThreeParameter => "3p",
            Self::Lap => "lap",
            Self::Free => "free",
        }
    }

    fn assembly(self) -> Assembly {
        match self {
            Self::TwoParameter | Self::ThreeParameter => Assembly::Cantilever,
            Self::Lap => Assembly::Lap,
            Self::Free => Assembly::Free,
        }
    }

    fn settings(self) -> ConsistentSettings {
        match self {
            Self::TwoParameter | Self::Lap => ConsistentSettings::two_parameter(),
            Self::ThreeParameter => ConsistentSettings::three_parameter(),
            Self::Free => ConsistentSettings::fitting(&[Parameter::Modulus]),
        }
    }

    /// Quantities whose intervals are counted.
    pub fn quantities(self) -> &'static [Quantity] {
        match self {
            Self::TwoParameter | Self::Lap => &[Quantity::Kt, Quantity::Kr],
            Self::ThreeParameter => &[Quantity::Kt, Quantity::Kr, Quantity::Coupling],
            Self::Free => &[Quantity::Modulus],
        }
    }
}

/// Theory of the beam and its width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Section {
    /// Euler's beam, for which the width is of no effect.
    Euler,
    /// Timoshenko's beam, 2 to 8 % of its length wide.
    Timoshenko,
    /// Timoshenko's beam, 8 to 15 % of its length wide.
    Wide,
}

impl Section {
    pub const ALL: [Self; 3] = [Self::Euler, Self::Timoshenko, Self::Wide];

    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::Timoshenko => "timoshenko",
            Self::Wide => "wide",
        }
    }

    fn theory(self) -> BeamTheory {
        match self {
            Self::Euler => BeamTheory::Euler,
            Self::Timoshenko | Self::Wide => BeamTheory::Timoshenko,
        }
    }

    /// Least and largest width over the length (1).
    fn widths(self) -> (f64, f64) {
        match self {
            Self::Euler => (0.03, 0.15),
            Self::Timoshenko => (0.02, 0.08),
            Self::Wide => (0.08, 0.15),
        }
    }
}

/// Distribution of the errors of the description and of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum World {
    /// Normal errors of the description, discrepancies with a standard deviation of 0.05 %.
    Normal,
    /// Rectangular errors of the description of the same standard deviations, and the same discrepancies.
    Rectangular,
    /// Normal errors of the description, and a model without any discrepancy.
    Exact,
    /// Normal errors of the description, discrepancies of 0.05 to 1 % (log-uniform) with tails of Student's t, 4 degrees.
    Missing,
    /// As `Normal`, and one mode is off by 0.3 to 5 % (log-uniform).
    Outlier,
}

impl World {
    pub const ALL: [Self; 5] = [
        Self::Normal,
        Self::Rectangular,
        Self::Exact,
        Self::Missing,
        Self::Outlier,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Rectangular => "rectangular",
            Self::Exact => "exact",
            Self::Missing => "missing",
            Self::Outlier => "outlier",
        }
    }
}

/// One test.
pub struct Case {
    described: JointedStructure,
    modes: Vec<MeasuredMode>,
    settings: ConsistentSettings,
    /// True values of the quantities of its kind.
    truth: Vec<f64>,
    /// Standard deviation of the discrepancies (1, relative).
    discrepancy: f64,
    /// Number of the mode that is off.
    outlier: Option<usize>,
    /// Range of the logarithms of Kt and Kr, and of the coupling's atanh, of what is estimated.
    range: Vec<(f64, f64)>,
}

impl Case {
    /// Settings of a fit that has to find the size of the discrepancies itself.
    fn unknown_discrepancy(&self) -> ConsistentSettings {
        ConsistentSettings {
            discrepancy: true,
            ..self.settings.clone()
        }
    }

    /// The modes with the size of the discrepancies in their standard deviations.
    fn informed(&self) -> Vec<MeasuredMode> {
        let modes = self.modes.iter().map(|mode| MeasuredMode {
            std: mode
                .std
                .map(|std| std.hypot(self.discrepancy * mode.frequency)),
            ..*mode
        });
        modes.collect()
    }

    /// Share of an estimate's normal distribution in the range of this world's joints.
    fn share_in_range(&self, found: &ConsistentEstimate) -> f64 {
        const DRAWS: usize = 400;
        let count = self.range.len();
        let mut centre = Vec::new();
        let mut stds = Vec::new();
        for quantity in [Quantity::Kt, Quantity::Kr, Quantity::Coupling]
            .into_iter()
            .take(count)
        {
            let own = found.quantity(quantity);
            let Some((value, std)) = own.and_then(|own| own.value.zip(own.std)) else {
                return LEAST_SHARE;
            };
            let (coordinate, slope) = match quantity {
                Quantity::Coupling => (value.atanh(), 1.0 - value * value),
                _ => (value.ln(), value),
            };
            centre.push(coordinate);
            stds.push(std / slope);
        }
        let covariance = DMatrix::from_fn(count, count, |row, column| {
            let pair = [row, column].map(|index| Parameter::JOINT[index]);
            let known = found
                .correlations
                .iter()
                .find(|one| [one.first, one.second] == pair || [one.second, one.first] == pair);
            let correlation = known.map_or(1.0, |one| one.value);
            correlation * stds[row] * stds[column] * if row == column { 1.0 + 1e-9 } else { 1.0 }
        });
        let Some(factor) = covariance.cholesky() else {
            return LEAST_SHARE;
        };
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut inside = 0;
        for _ in 0..DRAWS {
            let draw = DVector::from_fn(count, |_, _| normal(&mut random));
            let point = DVector::from_column_slice(&centre) + factor.l() * draw;
            let mut sides = point.iter().zip(&self.range);
            inside += usize::from(sides.all(|(x, (low, high))| low < x && x < high));
        }
        (inside as f64 / DRAWS as f64).max(LEAST_SHARE)
    }
}

/// Interval of one quantity.
pub struct Answer {
    pub quantity: Quantity,
    /// True where the interval holds the truth.
    pub holds: bool,
    /// Length of the interval over that of a fit that knows the size of the discrepancies; `None` where either is open.
    pub length: Option<f64>,
}

/// What was said of outlying modes in one test.
pub struct OutlierAnswer {
    /// The mode that is off, and by how many standard deviations of what the others predict.
    pub planted: Option<(usize, f64)>,
    /// The modes that were named, one of which is said to be off.
    pub named: Vec<usize>,
    /// The mode that an observer who knows the world holds for the one that is off.
    pub ideal: Option<usize>,
    /// The limits that are stated without what was named.
    pub answers: Vec<Answer>,
}

/// Outlying modes of `count` tests of a kind, planted and named; the same for the same seed.
pub fn outlier_answers(
    kind: Kind,
    section: Section,
    world: World,
    count: usize,
    seed: u64,
) -> Vec<OutlierAnswer> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut all = Vec::new();
    for _ in 0..count {
        let case = draw(kind, section, world, &mut random);
        let settings = case.unknown_discrepancy();
        let estimator = ConsistentEstimator::new(&case.described, &case.modes, &settings);
        let Ok(estimator) = estimator.map(ConsistentEstimator::settled) else {
            continue;
        };
        let named = estimator.outlying_modes();
        let left_out = named.iter().filter_map(|mode| {
            let without = estimator.without(mode.mode).settled();
            Some(LeftOutAnswer {
                mode: *mode,
                estimate: without.estimate().ok()?,
            })
        });
        let left_out: Vec<LeftOutAnswer> = left_out.collect();
        let found = LeftOutAnswer::joined(&left_out).or_else(|| estimator.estimate().ok());
        let Some(found) = found else { continue };
        let quantities = kind.quantities().iter().zip(&case.truth);
        let answers = quantities.filter_map(|(quantity, truth)| {
            Some(Answer {
                quantity: *quantity,
                holds: holds(&found, *quantity, *truth)?,
                length: None,
            })
        });
        let planted = case.outlier.and_then(|mode| {
            let deviations = estimator.deviations();
            let own = deviations.iter().find(|one| one.mode == mode)?;
            Some((mode, own.deviations.abs()))
        });
        all.push(OutlierAnswer {
            planted,
            named: named.iter().map(|mode| mode.mode).collect(),
            ideal: case.outlier.and_then(|_| ideal_observer(&case)),
            answers: answers.collect(),
        });
    }
    all
}

/// Returns the mode that is off most probably, for an observer who knows the distributions of the world.
///
/// To first order the data are exp(t^2/2) s q(x) times as probable where a mode is off as where none is. Here x is its
/// deviation from what the others predict, s the standard deviation of that prediction, t = x/s, and q the density of
/// outliers. This is the marginal likelihood of the other modes times the density of the one that is off. The joint
/// lies where joints of this world lie: the share of the posterior in that range multiplies it.
fn ideal_observer(case: &Case) -> Option<usize> {
    let estimator = ConsistentEstimator::new(&case.described, &case.informed(), &case.settings);
    let estimator = estimator.ok()?.settled();
    let mut logs = Vec::new();
    for mode in estimator.deviations() {
        let (x, t) = (0.01 * mode.percent.abs(), mode.deviations.abs().max(1e-3));
        let std = x / t;
        logs.push((
            mode.mode,
            0.5 * t * t + (std * outlier_density(x, std)).ln(),
        ));
    }
    let most = logs
        .iter()
        .fold(f64::NEG_INFINITY, |most, (_, log)| most.max(*log));
    // The range changes no ratio by more than its least share.
    logs.retain(|(_, log)| *log > most + LEAST_SHARE.ln());
    if logs.len() > 1 {
        for (mode, log) in &mut logs {
            let without = estimator.without(*mode).settled().estimate().ok()?;
            *log += case.share_in_range(&without).ln();
        }
    }
    let best = logs.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(mode, _)| mode)
}

/// Least share of an estimate's distribution in the range of joints: what is left of one that knows nothing.
const LEAST_SHARE: f64 = 1e-3;
/// Sizes of outliers (1, relative).
const OUTLIERS: (f64, f64) = (3e-3, 5e-2);

/// Density of a deviation of this size, where the prediction has this standard deviation.
fn outlier_density(deviation: f64, std: f64) -> f64 {
    const STEPS: usize = 1000;
    let (low, high) = OUTLIERS;
    let sizes = (0..STEPS).map(|step| {
        let part = (step as f64 + 0.5) / STEPS as f64;
        low * (high / low).powf(part)
    });
    let densities = sizes.map(|size| {
        let ends = [size, -size].map(|size| (-0.5 * ((deviation - size) / std).powi(2)).exp());
        0.5 * (ends[0] + ends[1]) / std
    });
    // What no outlier can be is not quite impossible: the model is linear to first order only.
    densities.sum::<f64>() / STEPS as f64 + 1e-12
}

/// Returns whether the limits of a quantity hold this value; `None` where it is not estimated.
fn holds(found: &ConsistentEstimate, quantity: Quantity, truth: f64) -> Option<bool> {
    let found = found.quantity(quantity)?;
    let above = found.low.is_none_or(|low| low <= truth);
    Some(above && found.high.is_none_or(|high| truth <= high))
}

/// Answers of `count` tests of a kind; the same for the same seed.
pub fn answers(kind: Kind, section: Section, world: World, count: usize, seed: u64) -> Vec<Answer> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut all = Vec::new();
    for _ in 0..count {
        let case = draw(kind, section, world, &mut random);
        let settings = case.unknown_discrepancy();
        let Some(own) = estimate(&case.described, &case.modes, &settings) else {
            continue;
        };
        let best = estimate(&case.described, &case.informed(), &case.settings);
        for (quantity, truth) in kind.quantities().iter().zip(&case.truth) {
            let Some(holds) = holds(&own, *quantity, *truth) else {
                continue;
            };
            let log_length = |estimate: &ConsistentEstimate| {
                let found = estimate.quantity(*quantity)?;
                let (low, high) = found.low.zip(found.high)?;
                Some(match quantity {
                    Quantity::Coupling => high - low,
                    _ => (high / low).ln(),
                })
            };
            let lengths = log_length(&own).zip(best.as_ref().and_then(log_length));
            all.push(Answer {
                quantity: *quantity,
                holds,
                length: lengths.map(|(own, best)| own / best),
            });
        }
    }
    all
}

fn estimate(
    structure: &JointedStructure,
    modes: &[MeasuredMode],
    settings: &ConsistentSettings,
) -> Option<ConsistentEstimate> {
    let estimator = ConsistentEstimator::new(structure, modes, settings).ok()?;
    estimator.settled().estimate().ok()
}

pub fn log_uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    (low.ln() + random.random::<f64>() * (high / low).ln()).exp()
}

pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Draws an error of unit variance of the description.
fn error(world: World, random: &mut ChaCha8Rng) -> f64 {
    match world {
        World::Rectangular => 3f64.sqrt() * (2.0 * random.random::<f64>() - 1.0),
        _ => normal(random),
    }
}

fn draw(kind: Kind, section: Section, world: World, random: &mut ChaCha8Rng) -> Case {
    let (theory, (narrow, wide)) = (section.theory(), section.widths());
    let materials = [(207e9, 7850.0), (70e9, 2700.0), (110e9, 4430.0)];
    let (modulus, density) = materials[random.random_range(0..materials.len())];
    let length = log_uniform(random, 0.2, 1.0);
    let beam = Beam {
        length,
        width: length * log_uniform(random, narrow, wide),
        thickness: length * log_uniform(random, 0.006, 0.02),
        modulus,
        density,
        poisson: 0.3,
    };
    // The defaults of a description.
    let relative = |share: f64, least: f64, value: f64| share.max(least / value);
    let tolerances = BeamTolerances {
        length: Some(relative(0.001, 0.5e-3, beam.length)),
        width: Some(relative(0.002, 0.05e-3, beam.width)),
        thickness: Some(relative(0.005, 0.02e-3, beam.thickness)),
        modulus: Some(0.01),
        density: Some(0.005),
        poisson: Some(0.02),
    };
    let mut described = JointedStructure::new(theory, beam, kind.assembly());
    let mut settings = kind.settings();
    settings.tolerances = tolerances;
    let mut moved = |value: f64, tolerance: Option<f64>| {
        value * (1.0 + tolerance.unwrap_or(0.0) * error(world, random))
    };
    // What is estimated of a beam has no prior: its described value is only a start.
    let true_beam = Beam {
        length: moved(beam.length, tolerances.length),
        width: moved(beam.width, tolerances.width),
        thickness: moved(beam.thickness, tolerances.thickness),
        modulus: moved(beam.modulus, tolerances.modulus),
        density: moved(beam.density, tolerances.density),
        poisson: beam.poisson + 0.02 * error(world, random),
    };
    let mut actual = JointedStructure::new(theory, true_beam, kind.assembly());
    for sensor in 0..random.random_range(0..3) {
        let mass = beam.mass() * log_uniform(random, 1e-3, 0.03);
        let position = beam.length * (0.2 + 0.75 * random.random::<f64>());
        let tolerance = AttachmentTolerance {
            name: format!("sensor {sensor}"),
            mass: 0.02 * mass,
            position: 1e-3,
        };
        described.masses.push(PointMass::new(position, mass));
        actual.masses.push(PointMass::new(
            position + tolerance.position * error(world, random),
            mass + tolerance.mass * error(world, random),
        ));
        settings.attachments.push(tolerance);
    }
    let stiffness = beam.modulus * beam.width * beam.thickness.powi(3) / 12.0;
    let units = [stiffness / beam.length.powi(3), stiffness / beam.length];
    let joint = Joint {
        kt: log_uniform(random, 30.0, 3000.0) * units[0],
        kr: log_uniform(random, 1.0, 30.0) * units[1],
        coupling: match kind {
            Kind::ThreeParameter => 1.4 * random.random::<f64>() - 0.7,
            _ => 0.0,
        },
    };
    let of_springs = [(30.0, 3000.0, units[0]), (1.0, 30.0, units[1])];
    let of_springs = of_springs
        .map(|(low, high, unit): (f64, f64, f64)| ((low * unit).ln(), (high * unit).ln()));
    let range = match kind {
        Kind::TwoParameter | Kind::Lap => of_springs.to_vec(),
        Kind::ThreeParameter => {
            let end = 0.7f64.atanh();
            [&of_springs[..], &[(-end, end)]].concat()
        }
        Kind::Free => Vec::new(),
    };
    let count = random.random_range(5..9);
    let discrepancy = match world {
        World::Normal | World::Rectangular | World::Outlier => 5e-4,
        World::Exact => 0.0,
        World::Missing => log_uniform(random, 5e-4, 1e-2),
    };
    let reading = log_uniform(random, 2e-5, 1e-3);
    let held = hold_of_the_width(&actual, joint, count, random);
    let mut modes: Vec<MeasuredMode> = frequencies(&actual, &joint, count)
        .into_iter()
        .zip(held)
        .zip(1..)
        .map(|((frequency, held), mode)| {
            let frequency = frequency * (1.0 + held);
            let missed = match world {
                World::Missing => student_4(random),
                _ => normal(random),
            };
            MeasuredMode {
                mode,
                frequency: frequency * (1.0 + reading * normal(random) + discrepancy * missed),
                std: Some(reading * frequency),
            }
        })
        .collect();
    let outlier = (world == World::Outlier).then(|| random.random_range(0..count));
    if let Some(index) = outlier {
        let size = log_uniform(random, OUTLIERS.0, OUTLIERS.1);
        modes[index].frequency *= if random.random() {
            1.0 + size
        } else {
            1.0 - size
        };
    }
    let truth = match kind {
        Kind::Free => vec![true_beam.modulus],
        _ => vec![joint.kt, joint.kr, joint.coupling],
    };
    Case {
        described,
        modes,
        settings,
        truth,
        discrepancy,
        outlier: outlier.map(|index| index + 1),
        range,
    }
}

/// Draws by how much (1) each frequency of a cantilever is higher because the joint holds the width: anywhere between
/// springs spread over it and a clamp that keeps the slope. Nothing where the width is of no effect.
fn hold_of_the_width(
    actual: &JointedStructure,
    joint: Joint,
    count: usize,
    random: &mut ChaCha8Rng,
) -> Vec<f64> {
    let specimen = actual.specimen(Some(joint));
    if actual.assembly != Assembly::Cantilever || !specimen.is_stiffened() {
        return vec![0.0; count];
    }
    let hold: f64 = random.random();
    let differences = specimen.clamp_differences(count, Mesh::DIAGNOSIS);
    let differences = differences.expect("a beam that can exist").into_iter();
    differences.map(|difference| hold * difference).collect()
}

/// Draws from Student's distribution with 4 degrees of freedom, scaled to unit variance.
fn student_4(random: &mut ChaCha8Rng) -> f64 {
    let squares: f64 = (0..4).map(|_| normal(random).powi(2)).sum();
    normal(random) / (squares / 4.0).sqrt() / 2f64.sqrt()
}

fn frequencies(structure: &JointedStructure, joint: &Joint, count: usize) -> Vec<f64> {
    let model = FrequencyModel::new(structure, count).expect("a beam that can exist");
    let mut point = model.nominal();
    point[Parameter::Kt as usize] = joint.kt.ln();
    point[Parameter::Kr as usize] = joint.kr.ln();
    point[Parameter::Coupling as usize] = joint.coupling.atanh();
    let modes = 1..=count;
    modes
        .map(|mode| model.response(&point, mode, 3.1 * mode as f64).frequency)
        .collect()
}
