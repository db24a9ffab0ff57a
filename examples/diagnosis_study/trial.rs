//! One test: drawn, observed, diagnosed.

use super::draws::ErrorShape;
use super::ideal;
use super::outside::OutsideKind;
use super::plans::{PlanKind, PlannedTest};
use super::plants::{Class, draw_effects, is_within_tolerance, plan_needs, structure_needs};
use super::structures::{Structure, Support, Tolerances};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;
use tapjoint::effects::{Effect, EffectId, Group, Place};
use tapjoint::gap::{
    Comparison, DETECTABLE, Diagnosis, GapError, GapSettings, Hypothesis, Nominal, ParameterValue,
    SingleFits, TestPlan, Thresholds, Verdict, nominal_chi_square, observe,
};
use tapjoint::identify::observation::Observations;

/// What is true of a test.
#[derive(Debug, Clone)]
pub struct Truth {
    pub class: Class,
    pub effects: Vec<Effect>,
    /// Kind and size of a fault outside the catalogue.
    pub outside: Option<(OutsideKind, f64)>,
    /// All frequencies are off by less than two standard uncertainties of their common factor, and nothing else is: the
    /// description is as good as it says.
    pub within_tolerance: bool,
    /// Such a test shows the fault, or each of two effects.
    pub is_visible: bool,
}

/// What is explained: the classes between which probabilities are shared out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Explained {
    Nothing,
    /// Groups of the effects, in order.
    Groups(Vec<Group>),
    Unknown,
}

impl Truth {
    pub fn is_null(&self) -> bool {
        self.explained() == Explained::Nothing
    }

    pub fn is_single(&self) -> bool {
        self.effects.len() == 1 && !self.within_tolerance
    }

    pub fn explained(&self) -> Explained {
        if self.outside.is_some() {
            Explained::Unknown
        } else if self.effects.is_empty() || self.within_tolerance {
            Explained::Nothing
        } else {
            Explained::of(self.effects.iter().map(|effect| effect.id.group()))
        }
    }

    /// Returns what is planted in a few words.
    pub fn describe(&self) -> String {
        let mut parts = Vec::new();
        for effect in &self.effects {
            let values = effect.values();
            let values: Vec<String> = values
                .map(|(info, value)| format!("{}={value:.3e}", info.name))
                .collect();
            parts.push(format!("{}({})", effect.id.name(), values.join(" ")));
        }
        if let Some((kind, size)) = self.outside {
            parts.push(format!("{}({size:.3e})", kind.name()));
        }
        if self.within_tolerance {
            parts.push("within tolerance".to_owned());
        } else if !parts.is_empty() && !self.is_visible {
            parts.push("not visible".to_owned());
        }
        match parts.is_empty() {
            true => "nothing".to_owned(),
            false => parts.join(" + "),
        }
    }
}

impl Explained {
    /// Returns these groups, each once.
    fn of(groups: impl Iterator<Item = Group>) -> Self {
        let mut groups: Vec<Group> = groups.collect();
        groups.sort();
        groups.dedup();
        Self::Groups(groups)
    }

    pub fn by(hypothesis: &Hypothesis) -> Self {
        match hypothesis {
            Hypothesis::None => Self::Nothing,
            Hypothesis::Unknown => Self::Unknown,
            Hypothesis::Effects(effects) => Self::of(effects.iter().map(|effect| effect.group())),
        }
    }

    pub fn name(&self) -> String {
        match self {
            Self::Nothing => "none".to_owned(),
            Self::Unknown => "unknown".to_owned(),
            Self::Groups(groups) => {
                let names: Vec<&str> = groups.iter().map(|group| group.name()).collect();
                names.join("+")
            }
        }
    }
}

/// What the diagnosis made of a test.
#[derive(Debug, Clone)]
pub struct Answer {
    pub verdict: Verdict,
    /// Probability of every class, the most probable first.
    pub classes: Vec<(Explained, f64)>,
    /// The most probable place.
    pub place: Option<Place>,
    /// Parameters of the most probable hypothesis of effects.
    pub parameters: Vec<ParameterValue>,
    /// Effects of that hypothesis.
    pub first: Vec<EffectId>,
    /// Closure on hold-out data by that hypothesis.
    pub closure: Option<f64>,
}

impl Answer {
    pub fn of(found: &Diagnosis) -> Self {
        let mut classes: Vec<(Explained, f64)> = Vec::new();
        for one in &found.hypotheses {
            let class = Explained::by(&one.hypothesis);
            match classes.iter_mut().find(|known| known.0 == class) {
                Some(known) => known.1 += one.probability,
                None => classes.push((class, one.probability)),
            }
        }
        classes.sort_by(|a, b| b.1.total_cmp(&a.1));
        let named = match &found.verdict {
            Verdict::Named(effects) => Some(Hypothesis::Effects(effects.clone())),
            _ => None,
        };
        let mut hypotheses = found.hypotheses.iter();
        // That which is named; else the most probable one that has effects.
        let first = hypotheses.find(|one| match &named {
            Some(named) => one.hypothesis == *named,
            None => matches!(one.hypothesis, Hypothesis::Effects(_)),
        });
        Self {
            verdict: found.verdict.clone(),
            classes,
            place: found.locations.ranked()[0].0,
            parameters: first.map_or_else(Vec::new, |one| one.parameters.clone()),
            first: first.map_or_else(Vec::new, |one| match &one.hypothesis {
                Hypothesis::Effects(effects) => effects.clone(),
                _ => Vec::new(),
            }),
            closure: first
                .and_then(|one| one.closure)
                .map(|closure| closure.value),
        }
    }

    /// Returns the groups that the answer names; a group of effects that data cannot separate counts as its name.
    pub fn named(&self) -> Option<Explained> {
        let effects = match &self.verdict {
            Verdict::Named(effects) | Verdict::Group(effects) => effects,
            _ => return None,
        };
        let named = Explained::of(effects.iter().map(|effect| effect.group()));
        match (&self.verdict, &named) {
            // Members of several groups are a list, not a name.
            (Verdict::Group(_), Explained::Groups(groups)) if groups.len() > 1 => None,
            _ => Some(named),
        }
    }
}

/// One test and its answer.
#[derive(Debug, Clone)]
pub struct Trial {
    pub number: usize,
    pub truth: Truth,
    pub support: Support,
    pub tolerances: Tolerances,
    pub errors: ErrorShape,
    pub plan: PlanKind,
    pub recordings: usize,
    pub modes: usize,
    /// The answer, or the reason why there is none.
    pub answer: Result<Answer, String>,
    /// That of the ideal observer, where it was asked for.
    pub ideal: Option<Answer>,
    /// Time of the diagnosis (s).
    pub seconds: f64,
}

/// What is drawn from streams of its own, so that a change of one leaves the others as they are.
#[derive(Debug, Clone, Copy)]
enum Stream {
    Class,
    Structure,
    Plan,
    Plant,
    Observation,
    Ideal,
}

fn stream(seed: u64, of: Stream) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(of as u64);
    random
}

/// A test before its diagnosis.
pub struct DrawnTest {
    seed: u64,
    truth: Truth,
    structure: Structure,
    test: PlannedTest,
    pub observed: Observations,
    pub described: Nominal,
}

impl DrawnTest {
    /// Draws a test. `None` where the structure cannot be: it buckles.
    pub fn draw(class: Class, seed: u64) -> Option<Self> {
        let ids = class.draw_ids(&mut stream(seed, Stream::Class));
        let structure =
            Structure::draw(&mut stream(seed, Stream::Structure), &structure_needs(&ids));
        let mut needs = plan_needs(&ids);
        needs.several_recordings = class == Class::Outside(OutsideKind::Temperature);
        let test = PlannedTest::draw(&mut stream(seed, Stream::Plan), &structure, &needs);
        let mut plant = stream(seed, Stream::Plant);
        let effects = draw_effects(&mut plant, &ids, &structure, &test)?;
        let without = test.nominal(&structure, false);
        let mut truth = without.clone();
        let outside = match class {
            Class::Outside(kind) => Some((kind, kind.plant(&mut plant, &mut truth.specimen))),
            _ => None,
        };
        let mut random = stream(seed, Stream::Observation);
        let mut observed = observe(&test.plan, &truth, &effects, random.random()).ok()?;
        test.state(&mut observed);
        test.drift_heavily(&mut random, &truth.specimen, &mut observed);
        if let Some((kind, size)) = outside {
            kind.change(&mut random, size, &truth.specimen, &mut observed);
        }
        let is_visible = match class {
            Class::Nothing => false,
            // The recordings differ from each other by ten times what one is known to.
            Class::Outside(OutsideKind::Temperature) => {
                outside.is_some_and(|(_, size)| size > 10.0 * test.plan.frequency_std)
            }
            Class::Outside(_) => is_visible(&test, &without, &truth, &[]),
            Class::Single(_) | Class::Pair => effects
                .iter()
                .all(|effect| is_visible(&test, &without, &truth, std::slice::from_ref(effect))),
        };
        // Two effects of which the test shows one are a single effect for any observer.
        if class == Class::Pair && !is_visible {
            return None;
        }
        Some(Self {
            seed,
            truth: Truth {
                class,
                within_tolerance: is_within_tolerance(&effects, &structure),
                effects,
                outside,
                is_visible,
            },
            described: test.nominal(&structure, true),
            structure,
            test,
            observed,
        })
    }

    /// Returns the answer of an observer who knows the study's distributions. `None` without a diagnosis.
    fn ideal(&self, diagnosis: &GapSettings) -> Option<Answer> {
        let mut random = stream(self.seed, Stream::Ideal);
        let settings = ideal::settings(&mut random, &self.structure, &self.test, diagnosis);
        answer(self, &settings).ok()
    }

    /// Returns the test with an answer, which took some seconds.
    pub fn answered(&self, number: usize, answer: Result<Answer, String>, seconds: f64) -> Trial {
        Trial {
            number,
            truth: self.truth.clone(),
            support: self.structure.support,
            tolerances: self.structure.tolerances,
            errors: self.structure.errors,
            plan: self.test.kind,
            recordings: self.test.stated.len(),
            modes: self.test.plan.modes,
            answer,
            ideal: None,
            seconds,
        }
    }
}

/// Returns what a step of the diagnosis finds, or why it does not. A panic is a defect of the diagnosis, and no reason to
/// lose all other tests.
pub fn caught<T>(step: impl FnOnce() -> Result<T, GapError>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(step)) {
        Ok(Ok(found)) => Ok(found),
        Ok(Err(error)) => Err(error.to_string()),
        Err(_) => Err("the diagnosis panicked".to_owned()),
    }
}

/// Returns the fits of a test without pairs.
pub fn fitted(drawn: &DrawnTest, settings: &GapSettings) -> Result<SingleFits, String> {
    caught(|| SingleFits::new(&drawn.observed, &drawn.described, settings))
}

/// Returns the fits with pairs.
pub fn compared(
    fits: &Result<SingleFits, String>,
    thresholds: &Thresholds,
) -> Result<Comparison, String> {
    let fits = fits.clone()?;
    caught(|| Ok(fits.with_pairs(thresholds)))
}

/// Returns the answer, without next tests.
pub fn answered(
    comparison: &Result<Comparison, String>,
    thresholds: &Thresholds,
) -> Result<Answer, String> {
    let comparison = comparison.clone()?;
    let found = caught(|| Ok(comparison.without_next_tests(thresholds)))?;
    Ok(Answer::of(&found))
}

/// Returns the answer of the diagnosis to a test, without next tests.
fn answer(drawn: &DrawnTest, settings: &GapSettings) -> Result<Answer, String> {
    let thresholds = &settings.thresholds;
    answered(&compared(&fitted(drawn, settings), thresholds), thresholds)
}

/// Returns whether such a test shows a fault at all: without noise, drift and errors of the description the model without
/// it leaves a chi square of [`DETECTABLE`].
fn is_visible(test: &PlannedTest, without: &Nominal, truth: &Nominal, effects: &[Effect]) -> bool {
    let plan = TestPlan {
        scatter: 0.0,
        ..test.plan.clone()
    };
    let Ok(observed) = observe(&plan, truth, effects, 0) else {
        return false;
    };
    let settings = GapSettings::default();
    let chi_square = caught(|| nominal_chi_square(&observed, without, &settings));
    // Without any fit the fault is plain.
    !chi_square.is_ok_and(|chi_square| chi_square < DETECTABLE)
}

impl Trial {
    /// Diagnoses a test, also as the ideal observer would if asked to.
    pub fn run(drawn: &DrawnTest, number: usize, settings: &GapSettings, ideal: bool) -> Self {
        let begin = Instant::now();
        let answer = answer(drawn, settings);
        let seconds = begin.elapsed().as_secs_f64();
        Self {
            ideal: if ideal { drawn.ideal(settings) } else { None },
            ..drawn.answered(number, answer, seconds)
        }
    }

    /// Returns one line: what is true, the verdict, the first hypotheses.
    pub fn line(&self) -> String {
        let head = format!(
            "{} {} {} {}/{} {} {} recordings, {} modes, {:.1} s: {}",
            self.truth.class.name(),
            self.number,
            self.support.name(),
            self.tolerances.name(),
            self.errors.name(),
            self.plan.name(),
            self.recordings,
            self.modes,
            self.seconds,
            self.truth.describe(),
        );
        let answer = match &self.answer {
            Err(reason) => return format!("{head} -> no diagnosis: {reason}"),
            Ok(answer) => answer,
        };
        let classes: Vec<String> = answer.classes[..answer.classes.len().min(4)]
            .iter()
            .map(|(class, probability)| format!("{} {probability:.2}", class.name()))
            .collect();
        let names: Vec<String> = answer
            .verdict
            .hypotheses()
            .iter()
            .map(Hypothesis::name)
            .collect();
        format!(
            "{head} -> {} {} [{}]{}",
            answer.verdict.kind(),
            names.join(", "),
            classes.join(", "),
            match &answer.verdict {
                Verdict::NotEnoughData(reason) => format!(" {reason}"),
                _ => String::new(),
            }
        )
    }
}
