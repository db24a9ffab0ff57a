//! How often the diagnosis is right on drawn observations (not recordings): the table of rates.
//!
//!     cargo run --release --example gap_study -- [cases per class] [seed] [set]
//!
//! `set` is `five` (five recordings: two sensor places, three tap places, two tap levels, six modes),
//! `one` (one recording, five frequencies, nothing else) or `both`.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use tapjoint::effects::{Effect, EffectId, Group};
use tapjoint::gap::{
    DescriptionUncertainty, Diagnosis, GapSettings, Hypothesis, Nominal, NominalSensor,
    PlannedConfiguration, TestPlan, Verdict, diagnose, observe,
};
use tapjoint::identify::consistent::BeamTolerances;
use tapjoint::identify::observation::Observations;
use tapjoint::structure::Beam;
use tapjoint::structure::specimen::{Body, Joint, PointMass, PointSpring, Specimen};

/// What was planted.
#[derive(Debug, Clone, PartialEq)]
enum Truth {
    Nothing,
    Effects(Vec<Effect>),
    /// Physics that no hypothesis contains, by number.
    Outside(usize),
}

struct Case {
    truth: Truth,
    answer: Diagnosis,
}

fn beam() -> Beam {
    Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let per_class = arguments
        .get(1)
        .and_then(|text| text.parse().ok())
        .unwrap_or(4);
    let seed = arguments
        .get(2)
        .and_then(|text| text.parse().ok())
        .unwrap_or(1);
    let set = arguments.get(3).map_or("both", String::as_str);
    for (name, five) in [("five", true), ("one", false)] {
        if set == name || set == "both" {
            study(name, five, per_class, seed);
        }
    }
}

fn study(name: &str, five: bool, per_class: usize, seed: u64) {
    let mut tasks: Vec<(u64, Kind)> = Vec::new();
    let kinds = EFFECTS.iter().map(|id| (Kind::Single(*id), per_class));
    let kinds = kinds.chain([
        (Kind::Nothing, 5 * per_class),
        (Kind::Outside, 5 * per_class),
        (Kind::Pair, 5 * per_class),
    ]);
    for (kind, count) in kinds {
        for _ in 0..count {
            tasks.push((seed * 1_000_003 + tasks.len() as u64, kind));
        }
    }
    let begin = std::time::Instant::now();
    let cases: Vec<Case> = tasks
        .par_iter()
        .filter_map(|(seed, kind)| case(five, *kind, *seed))
        .collect();
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "\n== {name}: {} cases, {:.0} ms each on {} threads",
        cases.len(),
        1e3 * seconds / cases.len() as f64,
        rayon::current_num_threads()
    );
    report(&cases);
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Nothing,
    Single(EffectId),
    Pair,
    Outside,
}

const EFFECTS: [EffectId; 12] = [
    EffectId::SensorMass,
    EffectId::SensorCable,
    EffectId::CrossCoupling,
    EffectId::JointMass,
    EffectId::JointNonlinearity,
    EffectId::Fixture,
    EffectId::Modulus,
    EffectId::AddedMass,
    EffectId::LocalCrack,
    EffectId::AxialLoad,
    EffectId::ShearRotary,
    EffectId::JointDamping,
];

fn log_uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    (low.ln() + (high / low).ln() * random.random::<f64>()).exp()
}

/// An effect of a size between the catalogue's small and large; `from` cuts the lower part off.
fn draw(id: EffectId, random: &mut ChaCha8Rng, from: f64) -> Effect {
    let beam = beam();
    let unit = beam.bending_stiffness();
    let sign = if random.random::<bool>() { 1.0 } else { -1.0 };
    let mut size = |low: f64, high: f64| log_uniform(random, low * (high / low).powf(from), high);
    let pairs: Vec<(&str, f64)> = match id {
        EffectId::SensorMass => vec![("mass", size(0.002, 0.024))],
        EffectId::SensorCable => vec![("stiffness", size(0.01, 0.3) * unit / beam.length.powi(3))],
        EffectId::CrossCoupling => vec![("coupling", sign * size(0.03, 0.35))],
        EffectId::JointMass => {
            let mass = size(0.010, 0.100);
            let radius = size(0.005, 0.025);
            vec![("mass", mass), ("inertia", mass * radius * radius)]
        }
        EffectId::JointNonlinearity => {
            let ratio = sign * size(0.012, 0.16);
            vec![
                ("ratio", ratio),
                ("exponent", 0.5 + 1.5 * random.random::<f64>()),
            ]
        }
        EffectId::Fixture => vec![
            ("ratio", size(0.005, 0.08)),
            ("frequency", size(65.0, 800.0)),
        ],
        EffectId::Modulus => vec![("relative", sign * size(0.003, 0.03))],
        EffectId::Length => vec![("relative", sign * size(0.0012, 0.0071))],
        EffectId::Timebase => vec![("relative", sign * size(2e-5, 1e-3))],
        EffectId::AddedMass => {
            let mass = size(0.002, 0.024);
            vec![
                ("mass", mass),
                (
                    "position",
                    beam.length * (0.15 + 0.85 * random.random::<f64>()),
                ),
            ]
        }
        EffectId::LocalCrack => {
            let compliance = size(0.003, 0.04);
            vec![
                ("compliance", compliance),
                (
                    "position",
                    beam.length * (0.05 + 0.85 * random.random::<f64>()),
                ),
            ]
        }
        EffectId::AxialLoad => vec![("force", sign * size(0.02, 0.5) * unit / beam.length.powi(2))],
        EffectId::ShearRotary => vec![("factor", size(0.5, 3.0))],
        EffectId::JointDamping => vec![("loss_factor", size(0.01, 0.1))],
        _ => vec![],
    };
    Effect::from_pairs(id, &pairs).expect("drawn values are valid")
}

fn case(five: bool, kind: Kind, seed: u64) -> Option<Case> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let drift = 0.02 * random.random::<f64>();
    let noise = log_uniform(&mut random, 2e-4, 6e-4);
    let plan = plan(five, drift, noise);
    let unknown_mass = matches!(kind, Kind::Single(EffectId::SensorMass));
    let mut truth = nominal(&mut random);
    if !unknown_mass {
        truth.sensors[0].mass = Some(0.004);
    }
    let planted = match kind {
        Kind::Nothing => Truth::Nothing,
        Kind::Single(EffectId::Modulus) => {
            let id = [EffectId::Modulus, EffectId::Length, EffectId::Timebase][(seed % 3) as usize];
            Truth::Effects(vec![draw(id, &mut random, 0.0)])
        }
        Kind::Single(id) => Truth::Effects(vec![draw(id, &mut random, 0.0)]),
        Kind::Pair => {
            let pick =
                |random: &mut ChaCha8Rng| EFFECTS[1 + (random.random::<f64>() * 10.0) as usize];
            let first = pick(&mut random);
            let mut second = pick(&mut random);
            while second == first {
                second = pick(&mut random);
            }
            Truth::Effects(vec![
                draw(first, &mut random, 0.5),
                draw(second, &mut random, 0.5),
            ])
        }
        Kind::Outside => Truth::Outside((seed % 5) as usize),
    };
    let observed = observed(&plan, &truth, &planted, &mut random, seed)?;
    let mut described = truth.clone();
    described.specimen =
        Specimen::new(Body::One(beam()), start_joint(&truth.specimen, &mut random));
    described.specimen.shear_rotary = truth.specimen.shear_rotary;
    match diagnose(&observed, &described, &GapSettings::default()) {
        Ok(answer) => Some(Case {
            truth: planted,
            answer,
        }),
        Err(error) => {
            eprintln!("{kind:?} {planted:?}: {error}");
            None
        }
    }
}

/// The search begins off the truth, as an estimate without the effect would.
fn start_joint(truth: &Specimen, random: &mut ChaCha8Rng) -> Option<Joint> {
    let [kt, kr] = truth.joint_stiffnesses();
    let mut off = || (0.2 * random.sample::<f64, _>(StandardNormal)).exp();
    Some(Joint {
        kt: kt * off(),
        kr: kr * off(),
        coupling: 0.0,
    })
}

fn nominal(random: &mut ChaCha8Rng) -> Nominal {
    let beam = beam();
    let unit = beam.bending_stiffness() / beam.length;
    let kx = 1400.0 * (0.4 * random.sample::<f64, _>(StandardNormal)).exp();
    let ky = 1.25 * (0.3 * random.sample::<f64, _>(StandardNormal)).exp();
    let joint = Some(Joint {
        kt: kx * unit / beam.length.powi(2),
        kr: ky * unit,
        coupling: 0.0,
    });
    Nominal {
        specimen: Specimen::new(Body::One(beam), joint),
        sensors: vec![NominalSensor {
            name: "A".to_string(),
            mass: None,
            position: None,
        }],
        joint_before: None,
        uncertainty: well_known(),
        reading_bias: None,
    }
}

/// How well a carefully measured bar is known: its properties together to 0.2 % of the frequencies.
fn well_known() -> DescriptionUncertainty {
    DescriptionUncertainty {
        beam: BeamTolerances {
            length: Some(5e-4),
            width: Some(1e-3),
            thickness: Some(1e-3),
            modulus: Some(2e-3),
            density: Some(1e-3),
            poisson: Some(0.02),
        },
        masses: 0.02,
        positions: 1e-3,
        ..DescriptionUncertainty::default()
    }
}
fn plan(five: bool, drift: f64, noise: f64) -> TestPlan {
    let length = beam().length;
    let one = |sensor: f64, tap: f64, level: f64| PlannedConfiguration {
        sensors: vec![("A".to_string(), sensor * length)],
        masses: Vec::new(),
        tap: tap * length,
        level,
    };
    let configurations = if five {
        vec![
            one(0.8, 0.95, 1.0),
            one(0.8, 0.95, 0.25),
            one(0.8, 0.55, 1.0),
            one(0.45, 0.95, 1.0),
            one(0.45, 0.3, 1.0),
        ]
    } else {
        vec![one(0.8, 0.95, 1.0)]
    };
    TestPlan {
        configurations,
        modes: if five { 6 } else { 5 },
        taps: 5,
        frequency_std: noise,
        shape_std: five.then_some(0.03),
        damping_std: five.then_some(0.03),
        slope_std: five.then_some(1e-4),
        drift: if five { drift } else { 0.0 },
        damping: 0.003,
        scatter: 1.0,
    }
}

fn observed(
    plan: &TestPlan,
    truth: &Nominal,
    planted: &Truth,
    random: &mut ChaCha8Rng,
    seed: u64,
) -> Option<Observations> {
    let mut truth = truth.clone();
    let length = beam().length;
    let place = length * (0.1 + 0.8 * random.random::<f64>());
    let strength = log_uniform(random, 0.2, 2.0);
    let effects: &[Effect] = match planted {
        Truth::Effects(effects) => effects,
        _ => &[],
    };
    if let Truth::Outside(kind) = planted {
        let specimen = &mut truth.specimen;
        match kind {
            // The beam touches something.
            0 => specimen.springs.push(PointSpring {
                position: place,
                stiffness: 0.3 * strength * beam().bending_stiffness() / length.powi(3),
            }),
            // Something that turns more than it weighs.
            1 => specimen.masses.push(PointMass {
                position: place,
                mass: 0.0,
                inertia: 1.5e-5 * strength,
            }),
            _ => {}
        }
    }
    let mut observed = observe(plan, &truth, effects, seed ^ 0x5EED).ok()?;
    if let Truth::Outside(kind) = planted {
        let offsets: Vec<f64> = (0..8).map(|_| random.sample(StandardNormal)).collect();
        for (index, configuration) in observed.configurations.iter_mut().enumerate() {
            for mode in &mut configuration.modes {
                mode.frequency *= match kind {
                    // A modulus that rises with frequency.
                    2 => (mode.frequency / 300.0).powf(0.003 * strength),
                    // A temperature of its own for each recording.
                    3 => 1.0 + 0.001 * strength * offsets[index],
                    // A neighbour structure that couples to every mode as it likes.
                    4 => 1.0 + 0.002 * strength * offsets[mode.mode],
                    _ => 1.0,
                };
            }
        }
    }
    Some(observed)
}

// ---------------------------------------------------------------------------------------------
// Scores

fn groups_of(truth: &Truth) -> Vec<Group> {
    match truth {
        Truth::Effects(effects) => effects.iter().map(|effect| effect.id.group()).collect(),
        _ => Vec::new(),
    }
}

/// Probability of each single group, `none` and `unknown`, the largest first.
fn ranking(answer: &Diagnosis) -> Vec<(Vec<Group>, Hypothesis, f64)> {
    let mut ranking: Vec<(Vec<Group>, Hypothesis, f64)> = Vec::new();
    for one in &answer.hypotheses {
        let key = |other: &&mut (Vec<Group>, Hypothesis, f64)| {
            other.0 == one.groups && (!one.groups.is_empty() || other.1 == one.hypothesis)
        };
        match ranking.iter_mut().find(key) {
            Some(found) => found.2 += one.probability,
            None => ranking.push((one.groups.clone(), one.hypothesis.clone(), one.probability)),
        }
    }
    ranking.sort_by(|a, b| b.2.total_cmp(&a.2));
    ranking
}

struct Rate(usize, usize);

impl Rate {
    fn of<'a>(cases: impl Iterator<Item = &'a Case>, right: impl Fn(&Case) -> bool) -> Self {
        let (mut hits, mut all) = (0, 0);
        for case in cases {
            all += 1;
            hits += usize::from(right(case));
        }
        Rate(hits, all)
    }
}

impl std::fmt::Display for Rate {
    /// With the 95 % interval of Wilson.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (hits, all) = (self.0 as f64, self.1 as f64);
        let z = 1.96_f64;
        let share = hits / all;
        let middle = (share + z * z / (2.0 * all)) / (1.0 + z * z / all);
        let half = z / (1.0 + z * z / all)
            * (share * (1.0 - share) / all + z * z / (4.0 * all * all)).sqrt();
        write!(
            f,
            "{share:.3} [{:.3}, {:.3}] of {}",
            middle - half,
            middle + half,
            self.1
        )
    }
}

fn named(case: &Case) -> bool {
    matches!(case.answer.verdict, Verdict::Named(_))
        || matches!(&case.answer.verdict, Verdict::Group(effects) if effects.iter().all(|e| e.group() == effects[0].group()))
}

fn name_groups(case: &Case) -> Vec<Group> {
    match &case.answer.verdict {
        Verdict::Named(effects) => effects.iter().map(|effect| effect.group()).collect(),
        Verdict::Group(effects) => vec![effects[0].group()],
        _ => Vec::new(),
    }
}

fn right_name(case: &Case) -> bool {
    let truth = groups_of(&case.truth);
    let answer = name_groups(case);
    truth.len() == answer.len() && answer.iter().all(|group| truth.contains(group))
}

fn report(cases: &[Case]) {
    let single = || {
        cases
            .iter()
            .filter(|case| groups_of(&case.truth).len() == 1)
    };
    let nothing = || cases.iter().filter(|case| case.truth == Truth::Nothing);
    let outside = || {
        cases
            .iter()
            .filter(|case| matches!(case.truth, Truth::Outside(_)))
    };
    let pairs = || {
        cases
            .iter()
            .filter(|case| groups_of(&case.truth).len() == 2)
    };
    let top = |case: &Case, places: usize| {
        let truth = groups_of(&case.truth);
        ranking(&case.answer)
            .iter()
            .take(places)
            .any(|one| one.0 == truth)
    };
    // Top of the effects alone, as a table of rates counts them: none and unknown left out.
    let top_effect = |case: &Case, places: usize| {
        let truth = groups_of(&case.truth);
        ranking(&case.answer)
            .iter()
            .filter(|one| one.0.len() == 1)
            .take(places)
            .any(|one| one.0 == truth)
    };
    println!(
        "top-1 group (none, unknown compete)   {}",
        Rate::of(single(), |case| top(case, 1))
    );
    println!(
        "top-1 group (effects alone)           {}",
        Rate::of(single(), |case| top_effect(case, 1))
    );
    println!(
        "top-3 group (effects alone)           {}",
        Rate::of(single(), |case| top_effect(case, 3))
    );
    println!(
        "where                                 {}",
        Rate::of(single(), |case| {
            let places = case.answer.locations;
            let Truth::Effects(effects) = &case.truth else {
                return false;
            };
            let all = [
                ("joint", places.joint),
                ("fixture", places.fixture),
                ("sensor", places.sensor),
                ("body", places.body),
                ("acquisition", places.acquisition),
            ];
            let best = all
                .iter()
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .map_or("", |best| best.0);
            best == effects[0].id.place().name()
                || (effects[0].id.group() == Group::Scale
                    && (best == "body" || best == "acquisition"))
        })
    );
    println!(
        "named: coverage                       {}",
        Rate::of(single(), named)
    );
    println!(
        "named: right                          {}",
        Rate::of(single().filter(|c| named(c)), right_name)
    );
    println!(
        "null called an effect                 {}",
        Rate::of(nothing(), named)
    );
    println!(
        "null: none not first                  {}",
        Rate::of(nothing(), |case| ranking(&case.answer)[0].1
            != Hypothesis::None)
    );
    println!(
        "outside: named                        {}",
        Rate::of(outside(), named)
    );
    println!(
        "outside: unknown                      {}",
        Rate::of(outside(), |case| case.answer.verdict == Verdict::Unknown)
    );
    println!(
        "outside: refutable ones refused       {}",
        Rate::of(
            outside().filter(|case| case
                .answer
                .hypotheses
                .iter()
                .find(|h| h.hypothesis == Hypothesis::None)
                .is_some_and(|h| h.goodness_of_fit.is_some_and(|p| p < 0.01))),
            |case| !named(case),
        )
    );
    println!(
        "pairs: both found                     {}",
        Rate::of(pairs(), |case| named(case) && right_name(case))
    );
    println!(
        "pairs: both found or not named        {}",
        Rate::of(pairs(), |case| !named(case) || right_name(case))
    );
    sets(single());
    closures(single());
    calibration(cases);
    by_effect(cases);
}

fn sets<'a>(cases: impl Iterator<Item = &'a Case>) {
    let (mut covered, mut size, mut count) = (0, 0, 0);
    for case in cases {
        let truth = groups_of(&case.truth);
        let mut held = 0.0;
        let mut found = false;
        for (groups, _, probability) in ranking(&case.answer) {
            size += 1;
            held += probability;
            found |= groups == truth;
            if held >= 0.9 {
                break;
            }
        }
        covered += usize::from(found);
        count += 1;
    }
    println!(
        "90 % set: coverage {}, mean size {:.2}",
        Rate(covered, count),
        size as f64 / count as f64
    );
}

fn closures<'a>(cases: impl Iterator<Item = &'a Case>) {
    let (mut closures, mut errors) = (Vec::new(), Vec::new());
    for case in cases.filter(|case| named(case)) {
        let first = &case.answer.hypotheses[0];
        closures.extend(first.closure.map(|closure| closure.value));
        if let (Truth::Effects(effects), Some(size)) = (&case.truth, first.parameters.first())
            && right_name(case)
            && effects[0].id == size.effect
            && let Some(truth) = effects[0].value(size.name)
        {
            errors.push((size.value / truth).ln().abs());
        }
    }
    closures.sort_by(f64::total_cmp);
    errors.sort_by(|a, b| a.total_cmp(b));
    let at = |values: &[f64], share: f64| {
        values
            .get((share * values.len() as f64) as usize)
            .copied()
            .unwrap_or(f64::NAN)
    };
    println!(
        "closure on withheld, named: median {:.3}, 10th percentile {:.3} (of {}); size error median {:.3} (of {})",
        at(&closures, 0.5),
        at(&closures, 0.1),
        closures.len(),
        at(&errors, 0.5),
        errors.len()
    );
}

/// Expected calibration error over ten bins and Brier's score over all classes.
fn calibration(cases: &[Case]) {
    let mut bins = [(0.0, 0.0, 0.0); 10];
    let (mut brier, mut count) = (0.0, 0.0);
    for case in cases.iter().filter(|case| groups_of(&case.truth).len() < 2) {
        let truth = groups_of(&case.truth);
        let right = |groups: &[Group], hypothesis: &Hypothesis| match case.truth {
            Truth::Nothing => *hypothesis == Hypothesis::None,
            Truth::Outside(_) => *hypothesis == Hypothesis::Unknown,
            Truth::Effects(_) => groups == truth,
        };
        let ranking = ranking(&case.answer);
        let mut held = false;
        for (groups, hypothesis, probability) in &ranking {
            let hit = right(groups, hypothesis);
            held |= hit;
            brier += (probability - f64::from(u8::from(hit))).powi(2);
        }
        brier += if held { 0.0 } else { 1.0 };
        count += 1.0;
        if let Some((groups, hypothesis, probability)) = ranking.first() {
            let bin = &mut bins[((probability * 10.0) as usize).min(9)];
            bin.0 += 1.0;
            bin.1 += probability;
            bin.2 += f64::from(u8::from(right(groups, hypothesis)));
        }
    }
    let error: f64 = bins.iter().map(|bin| (bin.1 - bin.2).abs()).sum::<f64>() / count;
    println!("calibration: ECE {error:.3}, Brier {:.3}", brier / count);
}

fn by_effect(cases: &[Case]) {
    println!(
        "{:<20} {:>5} {:>6} {:>6} {:>6}  most often instead",
        "effect", "cases", "top-1", "named", "right"
    );
    let mut names: Vec<String> = Vec::new();
    let name = |case: &Case| match &case.truth {
        Truth::Nothing => "none".to_string(),
        Truth::Effects(effects) if effects.len() == 1 => effects[0].id.name().to_string(),
        Truth::Effects(_) => "pair".to_string(),
        Truth::Outside(kind) => format!("outside {kind}"),
    };
    for case in cases {
        if !names.contains(&name(case)) {
            names.push(name(case));
        }
    }
    for one in names {
        let own: Vec<&Case> = cases.iter().filter(|case| name(case) == one).collect();
        let mut others: Vec<(String, usize)> = Vec::new();
        for case in &own {
            let first = &case.answer.hypotheses[0];
            let label = format!("{}/{}", first.hypothesis.name(), case.answer.verdict.kind());
            match others.iter_mut().find(|other| other.0 == label) {
                Some(other) => other.1 += 1,
                None => others.push((label, 1)),
            }
        }
        others.sort_by_key(|other| std::cmp::Reverse(other.1));
        let list: Vec<String> = others
            .iter()
            .take(5)
            .map(|(label, count)| format!("{label} {count}"))
            .collect();
        let count = |right: &dyn Fn(&Case) -> bool| {
            own.iter().filter(|case| right(case)).count() as f64 / own.len() as f64
        };
        println!(
            "{one:<20} {:>5} {:>6.2} {:>6.2} {:>6.2}  {}",
            own.len(),
            count(&|case| ranking(&case.answer)[0].0 == groups_of(&case.truth)),
            count(&named),
            count(&|case| named(case) && right_name(case)),
            list.join(", ")
        );
    }
}
