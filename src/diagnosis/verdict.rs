//! Verdict on a test: tests of one explanation, probabilities of all, and an answer, or the reason why there is none.

use crate::dataset::Dataset;
use crate::evidence::{Fit, log_sum};
use crate::fixture;
use crate::parameters::CandidateEffect;
use crate::result::{Block, Closure, Hypothesis, LocationProbabilities, Verdict};
use crate::settings::SMALLEST_P_VALUE;
use crate::structure::Arrangement;
use crate::thresholds::Thresholds;
use crate::validate::{Residuals, holdout_goodness};
use std::f64::consts::E;
use tapjoint_beam::effects::{EffectId, Group, Place};

// Tests of one explanation: how well it fits the data, block by block, how well it predicts the hold-out data, and
// whether enough data are left to test it.

/// Returns whether a misfit of hold-out data, of probability `p`, refutes an explanation. They are few, and linearised
/// about the fit: the limit is that of one block among many.
fn refutes_by_holdout(p: f64, thresholds: &Thresholds) -> bool {
    p < thresholds.block_misfit
}

/// Tests of one explanation.
#[derive(Debug, Clone)]
pub struct GoodnessOfFit {
    /// Goodness of fit, all data together.
    pub overall: Option<f64>,
    /// Goodness of fit of its blocks, the worst first.
    pub blocks: Vec<Block>,
    /// Goodness of its prediction of hold-out data; `None` without any.
    holdout: Option<f64>,
    /// Probability of a strength as far from the predicted one, for the peak that states the fixture's frequency (1).
    /// `None` without a fixture, or with one above the band.
    peak: Option<f64>,
    /// Numbers of data and parameters; `None` where they are not tested.
    pub freedom: Option<DegreesOfFreedom>,
    /// Its closure on hold-out data; `None` where the nominal model has no gap there.
    pub closure: Option<Closure>,
    /// The size of each effect differs from zero by two standard deviations.
    is_sized: bool,
    /// Whether all effects are errors of the set-up.
    is_of_set_up: bool,
    /// The gap on hold-out data exceeds what the prediction leaves open, so that the closure can be certain.
    pub is_decisive: bool,
    /// Thresholds of the tests.
    thresholds: Thresholds,
}

/// Numbers of data and parameters of a hypothesis.
#[derive(Debug, Clone, Copy)]
pub struct DegreesOfFreedom {
    /// Frequencies of different modes and arrangements. Slopes along decays count for a nonlinear joint, damping
    /// ratios for a lossy one, shapes for an error of the set-up.
    pub data: usize,
    /// Parameters of joint and effects.
    pub parameters: usize,
}

impl DegreesOfFreedom {
    /// Counts each fitted mode once for every set of sensor positions and added
    /// masses, since these see other shapes and load other positions; slopes along decays, other levels, damping
    /// ratios and shapes count for the effects that make them.
    pub fn of(dataset: &Dataset, fit: &Fit) -> Self {
        let another_level = dataset.settings.thresholds.another_level;
        let [slips, damps] = [EffectId::JointNonlinearity, EffectId::JointDamping]
            .map(|wanted| fit.effects.iter().any(|one| one.is(wanted)));
        let misplaces = fit.effects.iter().any(CandidateEffect::is_of_set_up);
        let mut seen: Vec<(usize, &Arrangement)> = Vec::new();
        let mut others = 0;
        for observable in &dataset.observables {
            if observable.is_frequency() {
                let one = &dataset.arrangements[observable.configuration];
                let mut known = seen.iter().filter(|old| old.0 == observable.mode);
                if known.all(|old| differ(old.1, one, slips.then_some(another_level))) {
                    seen.push((observable.mode, one));
                }
            }
            others += usize::from(slips && observable.is_slope());
            others += usize::from(damps && observable.is_damping());
            others += usize::from(misplaces && observable.is_shape());
        }
        DegreesOfFreedom {
            data: seen.len() + others,
            parameters: dataset.layout(&fit.effects).first_nuisance(),
        }
    }

    /// Returns whether too few data are left to test a name with.
    fn are_too_few(self, thresholds: &Thresholds) -> bool {
        self.data < self.parameters + thresholds.spare_data
    }
}

/// Returns whether two arrangements have different sensor positions or added masses, or tap levels of this ratio if
/// these count.
fn differ(one: &Arrangement, other: &Arrangement, level_ratio: Option<f64>) -> bool {
    let sensors = one.sensors.iter().map(|sensor| sensor.position);
    let fastened = one.fastened.iter().map(|fastened| fastened.0);
    let levels = one.known_level.zip(other.known_level);
    let ratio = levels.map_or(0.0, |(a, b)| (a / b).ln().abs());
    sensors.ne(other.sensors.iter().map(|sensor| sensor.position))
        || fastened.ne(other.fastened.iter().map(|fastened| fastened.0))
        || level_ratio.is_some_and(|least| ratio >= least.ln())
}

impl GoodnessOfFit {
    /// Tests a fit by its own data and by the hold-out data; `None` where the fit has no covariance.
    pub fn new(dataset: &Dataset, fit: &Fit) -> Option<Self> {
        let residuals = Residuals::new(dataset, fit)?;
        let thresholds = &dataset.settings.thresholds;
        Some(GoodnessOfFit {
            overall: residuals.goodness(),
            blocks: residuals.blocks(dataset),
            holdout: holdout_goodness(dataset, fit, |p| refutes_by_holdout(p, thresholds)),
            peak: fixture::goodness(dataset, fit),
            freedom: None,
            closure: None,
            is_sized: is_sized(dataset, fit),
            is_of_set_up: !fit.effects.is_empty()
                && fit.effects.iter().all(CandidateEffect::is_of_set_up),
            is_decisive: false,
            thresholds: thresholds.clone(),
        })
    }

    /// Returns the p-value of the misfit that refutes the hypothesis, the smallest where several do; for one
    /// block among many that of any.
    pub fn refuting_p_value(&self) -> Option<f64> {
        let Thresholds {
            misfit,
            block_misfit,
            ..
        } = self.thresholds;
        let worst = self.blocks.first().map(|block| block.goodness_of_fit);
        let worst = worst.filter(|p| *p < block_misfit);
        let all = [
            self.overall.filter(|p| *p < misfit),
            self.holdout
                .filter(|p| refutes_by_holdout(*p, &self.thresholds)),
            worst.map(|p| (p * self.blocks.len() as f64).min(misfit)),
            self.peak.filter(|p| *p < misfit),
        ];
        all.into_iter().flatten().min_by(f64::total_cmp)
    }

    /// Returns whether hold-out data are predicted no worse than by the nominal model. Two effects at once
    /// must fulfil it: they have the freedom to imitate a change outside the catalogue.
    fn improves_holdout(&self) -> bool {
        self.closure.is_none_or(|closure| closure.value > 0.0)
    }

    /// Returns whether the hold-out data leave the hypothesis its name: it closes half of the gap, and some of it for
    /// certain or predicts them within its uncertainty. If they cannot decide, closing some suffices, or predicting
    /// without making their errors much worse. These data are frequencies, which an error of the set-up hardly moves:
    /// predicting them suffices for it.
    fn passes_holdout(&self) -> bool {
        let Some(closure) = self.closure else {
            return true;
        };
        let predicts = self.holdout.is_some_and(|p| p > self.thresholds.predicted);
        if self.is_decisive {
            closure.value >= self.thresholds.closed_share && (closure.low > 0.0 || predicts)
        } else {
            let is_no_worse = closure.value > self.thresholds.doubled_errors;
            closure.value > 0.0 || predicts && (self.is_of_set_up || is_no_worse)
        }
    }
}

/// Returns whether the size of each effect of a fit differs from zero by two standard deviations. An effect that is there or not has no size, and a
/// joint that gives may do so in either direction.
fn is_sized(dataset: &Dataset, fit: &Fit) -> bool {
    let (layout, sized) = (
        dataset.layout(&fit.effects),
        dataset.settings.thresholds.sized,
    );
    fit.effects.iter().enumerate().all(|(k, effect)| {
        let at = layout.size(k);
        let away = (fit.parameters()[at] - effect.size.neutral).abs();
        effect.size.is_fixed()
            || effect.is(EffectId::JointCompliance) && effect.location.is_some()
            || fit.best.std(at).is_some_and(|std| away >= sized * std)
    })
}

// Probabilities of the hypotheses, and which of them the data cannot separate.

/// Hypothesis that takes part in the comparison, with its fit.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The hypothesis.
    pub hypothesis: Hypothesis,
    /// Its fit.
    pub fit: Fit,
    /// Probability (1).
    pub probability: f64,
    /// Prior probability, in units of one group of effects (1).
    pub prior: f64,
    /// Standard deviation of the joint's drift, where that is the hypothesis.
    pub drift: Option<f64>,
}

impl Candidate {
    /// Returns a candidate that has no probability yet.
    pub fn new(hypothesis: Hypothesis, fit: Fit) -> Self {
        Candidate {
            hypothesis,
            fit,
            probability: 0.0,
            prior: 1.0,
            drift: None,
        }
    }

    /// Logarithm of evidence times prior.
    pub fn log_weight(&self) -> f64 {
        self.fit.log_evidence + self.prior.ln()
    }

    /// Its effects; none for `none` and `unknown`.
    pub fn effects(&self) -> &[EffectId] {
        match &self.hypothesis {
            Hypothesis::Effects(effects) => effects,
            _ => &[],
        }
    }

    /// Groups of its effects, in order.
    pub fn groups(&self) -> Vec<Group> {
        self.effects().iter().map(|effect| effect.group()).collect()
    }

    /// Returns whether it is something outside the catalogue.
    pub fn is_unknown(&self) -> bool {
        self.hypothesis == Hypothesis::Unknown
    }

    /// Standard deviations of all parameters.
    pub fn stds(&self) -> Vec<f64> {
        let count = self.fit.best.priors.len();
        let stds = self.fit.best.covariance().map(|covariance| {
            let variances = covariance.diagonal();
            variances.iter().map(|v| v.max(0.0).sqrt()).collect()
        });
        stds.unwrap_or_else(|| vec![f64::INFINITY; count])
    }
}

/// Returns the candidate of the nominal model.
pub fn none_of(candidates: &[Candidate]) -> Option<&Candidate> {
    let mut all = candidates.iter();
    all.find(|one| one.hypothesis == Hypothesis::None)
}

/// Sets the prior of each group to 1, split evenly inside. Exceptions are `none` (`no_gap_prior`), `unknown`
/// (`unknown_prior`) and a rigid joint that gives (`rigid_prior`). All `tried` pairs share 1. Beside each single effect a second
/// cause may stand that the data do not show. Its share (`hidden_second`) counts as `unknown`. Sorts the most probable first.
pub fn set_probabilities(candidates: &mut [Candidate], tried: usize, thresholds: &Thresholds) {
    for k in 0..candidates.len() {
        let one = &candidates[k];
        candidates[k].prior = if one.effects().len() > 1 {
            1.0 / tried.max(1) as f64
        } else {
            let same = candidates.iter().filter(|other| {
                let is_single = one.effects().len() == 1 && other.effects().len() == 1;
                is_single && other.groups() == one.groups() || one.hypothesis == other.hypothesis
            });
            let weight = match one.effects() {
                _ if one.hypothesis == Hypothesis::None => thresholds.no_gap_prior,
                _ if one.is_unknown() => thresholds.unknown_prior,
                [EffectId::JointCompliance] => thresholds.rigid_prior,
                _ => 1.0,
            };
            weight / same.count() as f64
        };
    }
    let mut logs: Vec<f64> = candidates.iter().map(Candidate::log_weight).collect();
    let pairs = candidates.iter().zip(&logs);
    let singles = pairs.filter(|(one, _)| one.effects().len() == 1);
    let singles: Vec<f64> = singles.map(|(_, log)| *log).collect();
    if let Some(unknown) = candidates.iter().position(Candidate::is_unknown) {
        let hidden = log_sum(&singles) + hidden_weight(candidates, thresholds).ln();
        logs[unknown] = log_sum(&[logs[unknown], hidden]);
    }
    let total = log_sum(&logs);
    for (candidate, log) in candidates.iter_mut().zip(&logs) {
        candidate.probability = (log - total).exp();
    }
    sort(candidates);
}

/// Returns the weight of a second cause that the data do not show, over that of the single effect beside it (1). It is a part of
/// `unknown`, and 0 without that.
fn hidden_weight(candidates: &[Candidate], thresholds: &Thresholds) -> f64 {
    match candidates.iter().any(Candidate::is_unknown) {
        true => thresholds.hidden_second.max(0.0),
        false => 0.0,
    }
}

/// Returns the probability (1) of a second cause beside a single effect, which the data do not show: a part of that of `unknown`.
fn hidden_probability(candidates: &[Candidate], thresholds: &Thresholds) -> f64 {
    let singles = candidates.iter().filter(|one| one.effects().len() == 1);
    let singles: f64 = singles.map(|one| one.probability).sum();
    hidden_weight(candidates, thresholds) * singles
}

/// Returns the probability of a candidate (1). For `unknown` it is that of a cause in place of the catalogue's effects, without a second one beside
/// them.
pub fn shown_probability(
    candidate: &Candidate,
    candidates: &[Candidate],
    thresholds: &Thresholds,
) -> f64 {
    match candidate.is_unknown() {
        true => candidate.probability - hidden_probability(candidates, thresholds),
        false => candidate.probability,
    }
}

fn sort(candidates: &mut [Candidate]) {
    candidates.sort_by(|a, b| b.probability.total_cmp(&a.probability));
}

/// Returns the best explanation that can be shown, which is tested and may be named: the most probable member of the most
/// probable group. `unknown` has no residual.
pub fn best_known(candidates: &[Candidate]) -> Option<usize> {
    let groups = by_group(candidates).into_iter();
    let mut leaders = groups.map(|group| group.members[0]);
    leaders.find(|&leader| !candidates[leader].is_unknown())
}

/// Returns the highest odds against an explanation whose misfit has the probability `p`.
fn odds_by_p_value(p: f64) -> f64 {
    let p = p.clamp(SMALLEST_P_VALUE, 1.0 / E);
    -1.0 / (E * p * p.ln())
}

/// Candidates of one group of effects; pairs, `none` and `unknown` are groups of their own.
struct CandidateGroup {
    /// Indices of the candidates, the most probable first.
    members: Vec<usize>,
    /// Probability of the group (1).
    probability: f64,
}

/// Returns all groups, the most probable first.
fn by_group(candidates: &[Candidate]) -> Vec<CandidateGroup> {
    let mut groups: Vec<CandidateGroup> = Vec::new();
    for (index, candidate) in candidates.iter().enumerate() {
        let same = groups.iter_mut().find(|group| {
            let other = &candidates[group.members[0]];
            let is_alike = other.groups() == candidate.groups();
            is_alike
                && (!candidate.effects().is_empty() || other.hypothesis == candidate.hypothesis)
        });
        match same {
            Some(group) => {
                group.members.push(index);
                group.probability += candidate.probability;
            }
            None => groups.push(CandidateGroup {
                members: vec![index],
                probability: candidate.probability,
            }),
        }
    }
    groups.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    groups
}

/// Returns the probability of each location, given that there is a gap. Of two causes each has half, and so has a second cause
/// that the data do not show.
pub fn location_probabilities(
    candidates: &[Candidate],
    thresholds: &Thresholds,
) -> LocationProbabilities {
    let mut all = LocationProbabilities::default();
    let gaps = candidates
        .iter()
        .filter(|one| one.hypothesis != Hypothesis::None);
    let total: f64 = gaps.map(|one| one.probability).sum();
    if total <= 0.0 {
        return all;
    }
    let hidden = hidden_weight(candidates, thresholds);
    for candidate in candidates {
        let probability = candidate.probability / total;
        let share = match candidate.effects().len() {
            1 => probability * (1.0 + 0.5 * hidden),
            count => probability / count.max(1) as f64,
        };
        if candidate.is_unknown() {
            all.unknown += probability - 0.5 * hidden_probability(candidates, thresholds) / total;
        }
        for effect in candidate.effects() {
            *match effect.place() {
                Place::Joint => &mut all.joint,
                Place::Fixture => &mut all.fixture,
                Place::Sensor => &mut all.sensor,
                Place::Body => &mut all.body,
                Place::Acquisition => &mut all.acquisition,
            } += share;
        }
    }
    all
}

/// Returns the squared distance of the predictions of two fits, in standard deviations of the data.
fn separation(dataset: &Dataset, a: &Fit, b: &Fit) -> f64 {
    let a = &a.best.optimum.model.predicted;
    let b = &b.best.optimum.model.predicted;
    let data = dataset.data.iter().enumerate();
    data.map(|(row, datum)| ((a[row] - b[row]) / datum.std).powi(2))
        .sum()
}

/// Returns the chi square by which a rival fits worse, priors included.
pub fn delta_chi_square(best: &Fit, rival: &Fit) -> f64 {
    2.0 * (rival.best.optimum.objective - best.best.optimum.objective)
}

/// Returns the effects whose best fit predicts the same as that of a candidate.
pub fn confounded(dataset: &Dataset, candidates: &[Candidate], index: usize) -> Vec<EffectId> {
    let (own, separate) = (&candidates[index], dataset.settings.thresholds.separate);
    if own.is_unknown() {
        return Vec::new();
    }
    let mut all = Vec::new();
    for (k, other) in candidates.iter().enumerate() {
        if let [effect] = other.effects()
            && k != index
            && separation(dataset, &own.fit, &other.fit) < separate
            && delta_chi_square(&own.fit, &other.fit).abs() < separate
            && !own.effects().contains(effect)
        {
            all.push(*effect);
        }
    }
    all
}

// From probabilities to an answer, or to none.

/// Returns the verdict on a ranking, with the tests of its best explanation and of the nominal model.
pub fn verdict(
    candidates: &[Candidate],
    tested: Option<&GoodnessOfFit>,
    none: Option<&GoodnessOfFit>,
    thresholds: &Thresholds,
) -> Verdict {
    let (detected, named) = (thresholds.detected, thresholds.named_probability);
    // Many weak hypotheses share out the probability; together they are no effect either.
    // Neither is a misfit that speaks less against the nominal model than an effect has to speak for itself.
    let p_value = none.and_then(GoodnessOfFit::refuting_p_value);
    let is_refuted = p_value.map_or(1.0, odds_by_p_value) >= detected.exp();
    let mut all = candidates.iter();
    let is_seen = all.any(|one| evidence_over_none(candidates, one) >= detected);
    if !is_refuted && !is_seen {
        return Verdict::NoGap;
    }
    let groups = by_group(candidates);
    let first = &candidates[groups[0].members[0]];
    // No explanation is more probable than the nominal model.
    if first.hypothesis == Hypothesis::None {
        return if is_refuted {
            Verdict::Unknown
        } else {
            Verdict::NoGap
        };
    }
    let is_unknown =
        first.is_unknown() && shown_probability(first, candidates, thresholds) >= named;
    if is_unknown || tested.is_some_and(|one| one.refuting_p_value().is_some()) {
        return Verdict::Unknown;
    }
    // The tests below are those of the best explanation that has a model.
    let shown = best_known(candidates).map_or(first, |index| &candidates[index]);
    // An effect needs evidence of its own, even where the nominal model is refuted. Many weak effects of one group may
    // hold the probability together.
    let evidence = [first, shown].map(|one| evidence_over_none(candidates, one));
    if evidence.iter().all(|one| *one < detected) {
        return if is_refuted {
            Verdict::Unknown
        } else {
            Verdict::NoGap
        };
    }
    // With as many parameters as data everything fits.
    let Some(tested) = tested.filter(|tested| tested.overall.is_some()) else {
        return Verdict::NotEnoughData(
            "as many unknowns as readings: no explanation can be tested; observe more modes, or in \
             another configuration"
                .to_owned(),
        );
    };
    if let Some(freedom) = tested
        .freedom
        .filter(|freedom| freedom.are_too_few(thresholds))
    {
        return Verdict::NotEnoughData(format!(
            "{} has with the joint {} parameters for {} readings of different kind, which other causes would \
             explain as well; observe more modes, or move a sensor",
            shown.hypothesis.name(),
            freedom.parameters,
            freedom.data
        ));
    }
    // Something unknown leads, but holds less than an answer needs.
    if first.is_unknown() {
        return set_of(candidates, &groups, thresholds);
    }
    // An effect whose size may be zero is not named.
    if !tested.is_sized {
        return if is_refuted {
            Verdict::Unknown
        } else {
            Verdict::NoGap
        };
    }
    let holds = tested.passes_holdout() && (first.effects().len() < 2 || tested.improves_holdout());
    // A second cause beside a single effect leaves that effect its name.
    let with_hidden = match first.effects() {
        [_] => 1.0 + hidden_weight(candidates, thresholds),
        _ => 1.0,
    };
    if with_hidden * groups[0].probability >= named && holds {
        let members = inseparable(candidates, &groups[0].members, thresholds);
        return match members[..] {
            [one] => Verdict::Named(candidates[one].effects().to_vec()),
            _ => Verdict::Group(effects_of(candidates, &members)),
        };
    }
    let aliases = aliases_of_first(candidates, thresholds);
    let together: f64 = aliases.iter().map(|&k| candidates[k].probability).sum();
    if aliases.len() > 1 && with_hidden * together >= named && holds {
        return Verdict::Group(effects_of(candidates, &aliases));
    }
    set_of(candidates, &groups, thresholds)
}

/// Returns the logarithm of the Bayes factor of one hypothesis against the nominal model.
fn evidence_over_none(candidates: &[Candidate], candidate: &Candidate) -> f64 {
    none_of(candidates).map_or(f64::INFINITY, |none| {
        candidate.fit.log_evidence - none.fit.log_evidence
    })
}

/// Returns the members of a group that the data do not separate from its most probable one. Priors do not count.
fn inseparable(candidates: &[Candidate], members: &[usize], thresholds: &Thresholds) -> Vec<usize> {
    let first = &candidates[members[0]].fit;
    let members = members.iter().copied();
    members
        .filter(|&k| delta_chi_square(first, &candidates[k].fit) < thresholds.separate)
        .collect()
}

fn effects_of(candidates: &[Candidate], members: &[usize]) -> Vec<EffectId> {
    let members = members.iter();
    members
        .flat_map(|&k| candidates[k].effects().to_vec())
        .collect()
}

/// Returns the members that are more probable than this.
fn likely(candidates: &[Candidate], members: &[usize], least: f64) -> Vec<usize> {
    let members = members.iter().copied();
    members
        .filter(|&k| candidates[k].probability > least)
        .collect()
}

/// Returns the first single effect and those after it that fit as well.
fn aliases_of_first(candidates: &[Candidate], thresholds: &Thresholds) -> Vec<usize> {
    let singles = (0..candidates.len()).filter(|&k| candidates[k].effects().len() == 1);
    let singles: Vec<usize> = singles.collect();
    let mut aliases = likely(candidates, &singles, thresholds.listed_share);
    aliases.retain(|&k| {
        let first = &candidates[singles[0]].fit;
        delta_chi_square(first, &candidates[k].fit).abs() < thresholds.separate
    });
    aliases
}

/// Returns the shortest list of groups that holds 90 %, each with its likely members.
fn set_of(candidates: &[Candidate], groups: &[CandidateGroup], thresholds: &Thresholds) -> Verdict {
    let (mut held, mut counted) = (0.0, 0);
    let mut set = Vec::new();
    for group in groups {
        // A group is one of its members, and the data need not decide which one.
        let least = thresholds.listed_share * group.probability;
        let members = likely(candidates, &group.members, least);
        set.extend(members.iter().map(|&k| candidates[k].hypothesis.clone()));
        held += group.probability;
        counted += 1;
        if held >= thresholds.set_probability {
            break;
        }
    }
    if set.len() == 1 {
        // The only explanation fails on data that took no part in its fit.
        Verdict::Unknown
    } else if counted <= thresholds.longest_set {
        Verdict::Set(set)
    } else {
        Verdict::NotEnoughData(format!(
            "{counted} explanations are needed to hold {:.0} % of the probability; more readings of another kind \
             would separate them",
            100.0 * thresholds.set_probability
        ))
    }
}

#[cfg(test)]
mod tests;
