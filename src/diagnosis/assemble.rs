//! From the competition to the answer: every number that is shown.

use super::advisor::advise;
use super::catalogue::PlaceKind;
use super::decay_finding::decay_finding;
use super::doubt::best;
use super::evidence::log_likelihood;
use super::forward::Layout;
use super::frame::Frame;
use super::left_out::LeftOutErrors;
use super::nominal::COUPLING;
use super::place_map::place_map;
use super::posterior::{APART, Entry, confounded, lead, places, spreads};
use super::quality::{Residuals, noise_floor, pulls};
use super::result::{
    Closure, DecidedBy, Diagnosis, Hypothesis, HypothesisResult, JointShift, LeftOutRecordings,
    ParameterValue, Verdict,
};
use super::search::Competition;
use super::settings::GapSettings;
use super::small_unknowns::Small;
use super::trial::{Room, Trial};
use super::unplaced::Unplaced;
use super::verdict::verdict;
use super::withheld::{WithheldErrors, closure};
use tapjoint_beam::effects::{Effect, EffectId};
use tapjoint_numerics::stats::NORMAL_95;

/// The answer to a competition.
pub(super) fn diagnosis(
    competition: &Competition,
    unplaced: Option<Unplaced>,
    settings: &GapSettings,
) -> Diagnosis {
    let frame = &competition.frame;
    let entries = &competition.entries;
    let context = Context::new(competition, settings);
    let hypotheses: Vec<HypothesisResult> = (0..entries.len()).map(|k| context.result(k)).collect();
    let best = best(entries).unwrap_or(0);
    let fit = &entries[best].fit;
    let after = Residuals::new(frame, fit);
    let mut trial = Trial::new(frame, fit).map(|trial| trial.with_withheld(frame, fit));
    if let Some(trial) = &mut trial {
        trial.room = Some(Room::of(frame, &entries[best]));
        trial.closure = hypotheses[best].closure;
        trial.decides = context.decides(best);
    }
    let none = entries
        .iter()
        .find(|entry| entry.hypothesis == Hypothesis::None)
        .and_then(|none| Some(Trial::new(frame, &none.fit)?.with_withheld(frame, &none.fit)));
    let verdict = match verdict(entries, trial.as_ref(), none.as_ref()) {
        // Masses at places of their choice explain much that has other causes.
        Verdict::NoGap if unplaced.as_ref().is_some_and(Unplaced::is_gap) => {
            Verdict::NotEnoughData(
                "sensors whose place nobody said explain them, and so would other causes; state the places"
                    .to_owned(),
            )
        }
        answer => answer,
    };
    let joint_shift = match verdict {
        Verdict::Named(_) | Verdict::Group(_) | Verdict::Set(_) => hypotheses[best].joint_shift,
        Verdict::NoGap | Verdict::Unknown | Verdict::NotEnoughData(_) => JointShift::default(),
    };
    let pulls = match (&context.before, &after) {
        (Some(before), Some(after)) => pulls(frame, before, after),
        _ => Vec::new(),
    };
    Diagnosis {
        next_tests: advise(competition, &verdict, settings),
        verdict,
        places: places(entries),
        pulls,
        goodness_of_fit: trial.as_ref().and_then(|trial| trial.goodness),
        blocks: trial.map_or_else(Vec::new, |trial| trial.blocks),
        noise_floor: noise_floor(frame),
        misfit: after.as_ref().map(Residuals::misfit),
        joint_shift,
        hypotheses,
        map: place_map(frame, &competition.baseline),
        decided_by: decided_by(frame, entries),
        along_decays: decay_finding(frame, &competition.baseline),
        fitted_modes: frame.fitted_modes,
        unplaced,
    }
}

/// By the likelihood ratio of the two best hypotheses at their optima, and whether one had to give way. What is unknown has readings of another
/// uncertainty; its likelihood cannot be held against the others'.
fn decided_by(frame: &Frame, entries: &[Entry]) -> DecidedBy {
    let mut named = entries
        .iter()
        .filter(|entry| entry.hypothesis != Hypothesis::Unknown);
    let likelihood = |entry: &Entry| log_likelihood(&frame.readings, &entry.fit.branch.optimum);
    let most = named
        .clone()
        .map(Entry::log_weight)
        .fold(f64::NEG_INFINITY, f64::max);
    match (named.next(), named.next()) {
        // What speaks against a better one as such has brought it to the top.
        (Some(first), Some(_)) if first.log_weight() < most => DecidedBy::Readings,
        (Some(first), Some(rival)) if likelihood(first) - likelihood(rival) < 3.0_f64.ln() => {
            DecidedBy::Priors
        }
        _ => DecidedBy::Readings,
    }
}

/// Probability from which on recordings are left out to test a hypothesis.
const LEFT_OUT: f64 = 0.02;

/// What every hypothesis is held against.
struct Context<'a> {
    competition: &'a Competition,
    settings: &'a GapSettings,
    before: Option<Residuals>,
    withheld_before: Option<WithheldErrors>,
    left_out_before: Option<LeftOutErrors>,
}

impl<'a> Context<'a> {
    fn new(competition: &'a Competition, settings: &'a GapSettings) -> Self {
        Context {
            competition,
            settings,
            before: Residuals::new(&competition.frame, &competition.described),
            withheld_before: WithheldErrors::new(&competition.frame, &competition.drifting),
            left_out_before: LeftOutErrors::new(&competition.frame, &competition.drifting),
        }
    }

    fn frame(&self) -> &Frame {
        &self.competition.frame
    }

    fn result(&self, index: usize) -> HypothesisResult {
        let entries = &self.competition.entries;
        let entry = &entries[index];
        let predicts = entry.hypothesis != Hypothesis::Unknown;
        let residuals = predicts
            .then(|| Residuals::new(self.frame(), &entry.fit))
            .flatten();
        let withheld = predicts
            .then(|| WithheldErrors::new(self.frame(), &entry.fit))
            .flatten();
        let none = entries
            .iter()
            .find(|entry| entry.hypothesis == Hypothesis::None);
        let reference = none.map_or(f64::NAN, |none| none.fit.log_evidence);
        HypothesisResult {
            hypothesis: entry.hypothesis.clone(),
            groups: entry.groups(),
            probability: entry.probability,
            log_bayes_factor: entry.fit.log_evidence - reference,
            confounded_with: confounded(self.frame(), entries, index),
            parameters: self.parameters(index),
            gap_before: self
                .before
                .as_ref()
                .map_or(f64::NAN, |r| r.frequency_rms(self.frame())),
            gap_after: residuals.as_ref().map(|r| r.frequency_rms(self.frame())),
            left_out_after: residuals
                .as_ref()
                .and_then(|r| r.left_out_rms(self.frame())),
            withheld_before: self.withheld_before.as_ref().map(WithheldErrors::rms),
            withheld_after: withheld.as_ref().map(WithheldErrors::rms),
            withheld_floor: withheld.as_ref().map(WithheldErrors::floor),
            closure: self.closure(withheld.as_ref()),
            left_out_recordings: self.left_out(entry),
            goodness_of_fit: residuals.as_ref().and_then(Residuals::goodness),
            misfit: residuals.as_ref().map(Residuals::misfit),
            joint_shift: if predicts {
                self.joint_shift(entry)
            } else {
                JointShift::default()
            },
            effects: self.effects(entry),
            joint: self.joint(entry),
            joint_intervals: self.joint_intervals(entry),
            coupling: self.coupling(entry),
            scale: self.scale(entry),
        }
    }

    /// Whether the withheld readings could tell this hypothesis from the nominal model.
    fn decides(&self, index: usize) -> bool {
        let fit = &self.competition.entries[index].fit;
        let after = WithheldErrors::new(self.frame(), fit);
        after
            .zip(self.withheld_before.as_ref())
            .is_some_and(|(after, before)| after.decides(before))
    }

    fn closure(&self, after: Option<&WithheldErrors>) -> Option<Closure> {
        closure(self.withheld_before.as_ref()?, after?, self.settings.seed)
    }

    /// Of hypotheses that are in the running, and of none.
    fn left_out(&self, entry: &Entry) -> Option<LeftOutRecordings> {
        let weighed = entry.probability > LEFT_OUT || entry.hypothesis == Hypothesis::None;
        if !weighed || entry.hypothesis == Hypothesis::Unknown {
            return None;
        }
        let after = LeftOutErrors::new(self.frame(), &entry.fit)?;
        after.against(self.left_out_before.as_ref()?, self.settings.seed)
    }

    fn effects(&self, entry: &Entry) -> Vec<Effect> {
        let layout = Layout::new(self.frame(), &entry.fit.effects);
        layout
            .effects_at(&entry.fit.branch.optimum.parameters)
            .unwrap_or_default()
    }

    fn joint(&self, entry: &Entry) -> Option<[f64; 2]> {
        let mut joint = self.frame().nominal.specimen.joint.stiffnesses();
        let sought = self.frame().nominal.sought();
        if joint == [0.0; 2] || entry.hypothesis == Hypothesis::Unknown {
            return None;
        }
        for (k, (direction, _)) in sought.iter().enumerate() {
            if *direction != COUPLING {
                joint[*direction] = entry.fit.branch.optimum.parameters[k].exp();
            }
        }
        Some(joint)
    }

    /// The joint's 95 % intervals: its stiffnesses' logarithms are sought.
    fn joint_intervals(&self, entry: &Entry) -> [Option<[f64; 2]>; 2] {
        let mut intervals = [None; 2];
        if entry.hypothesis == Hypothesis::Unknown {
            return intervals;
        }
        let (values, spreads) = (&entry.fit.branch.optimum.parameters, spreads(entry));
        for (k, (direction, _)) in self.frame().nominal.sought().iter().enumerate() {
            if let Some(interval) = intervals.get_mut(*direction) {
                let ends =
                    [-1.0, 1.0].map(|sign| (values[k] + sign * NORMAL_95 * spreads[k]).exp());
                *interval = Some(ends).filter(|ends| ends.iter().all(|end| end.is_finite()));
            }
        }
        intervals
    }

    fn coupling(&self, entry: &Entry) -> f64 {
        let mut sought = self.frame().nominal.sought().into_iter();
        let index = sought.position(|(direction, _)| direction == COUPLING);
        index.map_or(0.0, |k| entry.fit.branch.optimum.parameters[k])
    }

    fn scale(&self, entry: &Entry) -> f64 {
        let smalls = Layout::new(self.frame(), &entry.fit.effects).smalls();
        let index = self.frame().small_index(Small::Scale);
        index.map_or(0.0, |k| entry.fit.branch.optimum.parameters[smalls + k])
    }

    fn joint_shift(&self, entry: &Entry) -> JointShift {
        let mut shift = JointShift::default();
        let before = &self.competition.described.branch.optimum.parameters;
        let after = &entry.fit.branch.optimum.parameters;
        let nominal = &self.frame().nominal;
        for (k, (direction, _)) in nominal.sought().iter().enumerate() {
            let estimated = nominal
                .joint_before
                .and_then(|joint| joint.get(*direction).copied());
            let before = estimated.map_or(before[k], f64::ln);
            let percent = Some(100.0 * ((after[k] - before).exp() - 1.0));
            match *direction {
                COUPLING => {}
                0 => shift.kx_percent = percent,
                _ => shift.ky_percent = percent,
            }
        }
        shift
    }

    fn parameters(&self, index: usize) -> Vec<ParameterValue> {
        let entry = &self.competition.entries[index];
        if let Some(drift) = entry.drift {
            return vec![plain(EffectId::JointDrift, "std", (drift, None))];
        }
        let layout = Layout::new(self.frame(), &entry.fit.effects);
        let spreads = spreads(entry);
        let values = &entry.fit.branch.optimum.parameters;
        let mut parameters = Vec::new();
        for (k, candidate) in entry.fit.effects.iter().enumerate() {
            let size = layout.size(k);
            let mut own = plain(
                candidate.effect,
                candidate.size.name,
                (values[size], Some(spreads[size])),
            );
            // lambda = 14.9: 1 % level, 90 % power.
            own.smallest_detectable =
                Some(14.9_f64.sqrt() * spreads[size]).filter(|size| size.is_finite());
            own.smallest_isolable = self.isolable(index, values[size] - candidate.size.nothing);
            parameters.push(own);
            if let (Some(range), Some(place)) = (&candidate.place, layout.place(k)) {
                let value = range.outward(values[place]);
                let std = match range.kind {
                    PlaceKind::FixtureFrequency | PlaceKind::Gyration => value * spreads[place],
                    PlaceKind::Position | PlaceKind::Exponent => spreads[place],
                };
                let known = std < 0.5 * (range.high - range.low);
                let (name, value, std) = match range.kind {
                    PlaceKind::Position => ("position", value, std),
                    PlaceKind::FixtureFrequency => ("frequency", value, std),
                    PlaceKind::Exponent => ("exponent", value, std),
                    // J = m r^2
                    PlaceKind::Gyration => (
                        "inertia",
                        values[size] * value * value,
                        2.0 * values[size] * value * std,
                    ),
                };
                parameters.push(plain(candidate.effect, name, (value, known.then_some(std))));
            }
        }
        parameters
    }

    /// Size at which every rival would be three standard deviations worse: chi square grows with the
    /// square of the size.
    fn isolable(&self, index: usize, size: f64) -> Option<f64> {
        let entries = &self.competition.entries;
        let own = &entries[index];
        let nearest = entries
            .iter()
            .filter(|entry| entry.effects().len() <= 1 && entry.hypothesis != Hypothesis::Unknown)
            .filter(|entry| entry.hypothesis == Hypothesis::None || entry.groups() != own.groups())
            .map(|rival| lead(&own.fit, &rival.fit))
            .fold(f64::INFINITY, f64::min);
        (nearest > 0.0 && nearest.is_finite()).then(|| size.abs() * (APART / nearest).sqrt())
    }
}

fn plain(effect: EffectId, name: &'static str, (value, std): (f64, Option<f64>)) -> ParameterValue {
    ParameterValue {
        effect,
        name,
        value,
        std: std.filter(|std| std.is_finite()),
        smallest_detectable: None,
        smallest_isolable: None,
    }
}
