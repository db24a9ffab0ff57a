//! Tests of random structures whose description is not exact, and what the fit makes of them.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint::identify::MeasuredMode;
use tapjoint::identify::consistent::{
    AttachmentTolerance, BeamTolerances, ConsistentEstimate, ConsistentEstimator,
    ConsistentSettings, FrequencyModel, JointedStructure, Parameter, Quantity,
};
use tapjoint::structure::specimen::PointMass;
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
}

impl Case {
    /// Settings of a fit that has to find the size of the discrepancies itself.
    fn unknown_discrepancy(&self) -> ConsistentSettings {
        ConsistentSettings {
            discrepancy: true,
            ..self.settings.clone()
        }
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
    /// The mode that was named.
    pub named: Option<usize>,
}

/// Outlying modes of `count` tests of a kind, planted and named; the same for the same seed.
pub fn outlier_answers(
    kind: Kind,
    theory: BeamTheory,
    world: World,
    count: usize,
    seed: u64,
) -> Vec<OutlierAnswer> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut all = Vec::new();
    for _ in 0..count {
        let case = draw(kind, theory, world, &mut random);
        let settings = case.unknown_discrepancy();
        let estimator = ConsistentEstimator::new(&case.described, &case.modes, &settings);
        let Ok(estimator) = estimator.map(ConsistentEstimator::settled) else {
            continue;
        };
        let chi_squared = |estimator: &ConsistentEstimator| {
            estimator
                .estimate()
                .ok()
                .and_then(|found| found.goodness.chi_squared)
        };
        let planted = case.outlier.and_then(|mode| {
            let without = estimator.without(mode - 1).settled();
            let fall = chi_squared(&estimator)? - chi_squared(&without)?;
            Some((mode, fall.max(0.0).sqrt()))
        });
        all.push(OutlierAnswer {
            planted,
            named: estimator.outlying_mode().map(|found| found.mode),
        });
    }
    all
}

/// Answers of `count` tests of a kind; the same for the same seed.
pub fn answers(
    kind: Kind,
    theory: BeamTheory,
    world: World,
    count: usize,
    seed: u64,
) -> Vec<Answer> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut all = Vec::new();
    for _ in 0..count {
        let case = draw(kind, theory, world, &mut random);
        let settings = case.unknown_discrepancy();
        let Some(own) = estimate(&case.described, &case.modes, &settings) else {
            continue;
        };
        let informed: Vec<MeasuredMode> = case
            .modes
            .iter()
            .map(|mode| MeasuredMode {
                std: mode
                    .std
                    .map(|std| std.hypot(case.discrepancy * mode.frequency)),
                ..*mode
            })
            .collect();
        let best = estimate(&case.described, &informed, &case.settings);
        for (quantity, truth) in kind.quantities().iter().zip(&case.truth) {
            let Some(found) = own.quantity(*quantity) else {
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
                holds: found.low.is_none_or(|low| low <= *truth)
                    && found.high.is_none_or(|high| *truth <= high),
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

fn draw(kind: Kind, theory: BeamTheory, world: World, random: &mut ChaCha8Rng) -> Case {
    let materials = [(207e9, 7850.0), (70e9, 2700.0), (110e9, 4430.0)];
    let (modulus, density) = materials[random.random_range(0..materials.len())];
    let length = log_uniform(random, 0.2, 1.0);
    let beam = Beam {
        length,
        width: length * log_uniform(random, 0.03, 0.15),
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
    let joint = Joint {
        kt: log_uniform(random, 30.0, 3000.0) * stiffness / beam.length.powi(3),
        kr: log_uniform(random, 1.0, 30.0) * stiffness / beam.length,
        coupling: match kind {
            Kind::ThreeParameter => 1.4 * random.random::<f64>() - 0.7,
            _ => 0.0,
        },
    };
    let count = random.random_range(5..9);
    let discrepancy = match world {
        World::Normal | World::Rectangular | World::Outlier => 5e-4,
        World::Exact => 0.0,
        World::Missing => log_uniform(random, 5e-4, 1e-2),
    };
    let reading = log_uniform(random, 2e-5, 1e-3);
    let mut modes: Vec<MeasuredMode> = frequencies(&actual, &joint, count)
        .into_iter()
        .zip(1..)
        .map(|(frequency, mode)| {
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
        let size = log_uniform(random, 3e-3, 5e-2);
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
    }
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
