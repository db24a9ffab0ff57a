//! All hypotheses against each other.

use super::catalogue::{Candidate, Scales, candidate};
use super::catch_all::{fit_drift, fit_unknown};
use super::error::GapError;
use super::evidence::log_mean;
use super::forward::Forward;
use super::frame::Frame;
use super::hypothesis::{Fit, Search, fit_nominal};
use super::joint_path::joint_amplitude;
use super::nominal::{COUPLING, Nominal};
use super::pairs::{add_pairs, stands};
use super::posterior::{Entry, set_probabilities};
use super::result::Hypothesis;
use super::settings::GapSettings;
use super::setup::Setup;
use super::small_unknowns::Small;
use super::solved::Solved;
use rayon::prelude::*;
use tapjoint_beam::effects::EffectId;
use tapjoint_identify::observation::Observations;

/// What the hypotheses made of the readings.
pub(super) struct Competition {
    pub(super) frame: Frame,
    /// The nominal model as described, only its joint refitted, one and the same in all visits: where the gap is
    /// measured from.
    pub(super) described: Fit,
    /// The same with a joint and a warmth that may differ between visits, as they may under every hypothesis: what
    /// these explain no effect is credited with on readings that took no part.
    pub(super) drifting: Fit,
    /// The same, and masses that may differ from what was said: where a cause is looked for along the beam.
    pub(super) baseline: Fit,
    /// The most probable first.
    pub(super) entries: Vec<Entry>,
}

/// Fits everything.
pub(super) fn compete(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Result<Competition, GapError> {
    let all: Vec<Competition> = placements(observations, nominal, settings)
        .into_iter()
        .filter_map(|placed| compete_once(&placed, nominal, settings))
        .collect();
    let mut all = all.into_iter();
    let first = all.next().ok_or(GapError::NoFit)?;
    let rest: Vec<Competition> = all.collect();
    let mut competition = if rest.is_empty() {
        first
    } else {
        over_placements(first, rest)
    };
    set_probabilities(&mut competition.entries, 0);
    add_pairs(&mut competition, settings);
    Ok(competition)
}

/// The observations with the sensors that were described where they name none: frequencies read elsewhere were
/// read with all of them somewhere.
pub(super) fn filled(observations: &Observations, nominal: &Nominal) -> Observations {
    let mut filled = observations.clone();
    for configuration in &mut filled.configurations {
        if configuration.sensors.is_empty() && configuration.recording.is_none() {
            configuration.sensors = nominal
                .sensors
                .iter()
                .map(super::nominal::NominalSensor::observed)
                .collect();
        }
    }
    filled
}

/// The observations with every place that nobody said filled in: once each for a row of places along
/// the structure.
fn placements(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Vec<Observations> {
    let filled = filled(observations, nominal);
    // A sensor without a place and without a mass says nothing and weighs nothing.
    let mut sensors = filled.configurations.iter().flat_map(|c| &c.sensors);
    if !sensors.any(|s| s.position.is_none() && nominal.mass_of(&s.name) > 0.0) {
        return vec![filled];
    }
    let length = nominal.specimen.body.length();
    (0..settings.unknown_positions)
        .map(|k| {
            let place = length * (k as f64 + 0.5) / settings.unknown_positions as f64;
            let mut placed = filled.clone();
            for sensor in placed
                .configurations
                .iter_mut()
                .flat_map(|c| &mut c.sensors)
            {
                sensor.position.get_or_insert(place);
            }
            placed
        })
        .collect()
}

/// Evidence averaged over the places; fits and residuals are those of the place that explains most.
fn over_placements(mut first: Competition, rest: Vec<Competition>) -> Competition {
    let best_frame = |entries: &[Entry]| {
        let evidences = entries.iter().map(|entry| entry.fit.log_evidence);
        evidences.fold(f64::NEG_INFINITY, f64::max)
    };
    let mut most = best_frame(&first.entries);
    let places = rest.len() + 1;
    for index in 0..first.entries.len() {
        let name = first.entries[index].hypothesis.clone();
        let same = |other: &Competition| -> Option<f64> {
            let found = other.entries.iter().find(|entry| entry.hypothesis == name);
            found.map(|entry| entry.fit.log_evidence)
        };
        let mut all = vec![first.entries[index].fit.log_evidence];
        all.extend(rest.iter().filter_map(same));
        // Where a fit failed there is no evidence.
        all.resize(places, f64::NEG_INFINITY);
        first.entries[index].fit.log_evidence = log_mean(&all);
    }
    // Residuals are shown where the readings are explained best.
    let evidences: Vec<f64> = first
        .entries
        .iter()
        .map(|entry| entry.fit.log_evidence)
        .collect();
    let names: Vec<Hypothesis> = first
        .entries
        .iter()
        .map(|entry| entry.hypothesis.clone())
        .collect();
    let mut best = first;
    for other in rest {
        let own = best_frame(&other.entries);
        if own > most {
            most = own;
            best = other;
        }
    }
    for entry in &mut best.entries {
        if let Some(k) = names.iter().position(|name| *name == entry.hypothesis) {
            entry.fit.log_evidence = evidences[k];
        }
    }
    best
}

/// The least chi square of the nominal model over the places that nobody said.
pub(super) fn nominal_chi_square(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Option<f64> {
    placements(observations, nominal, settings)
        .iter()
        .filter_map(|placed| Some(nominal_of(placed, nominal, settings)?.1))
        .map(|none| 2.0 * none.branch.optimum.objective)
        .min_by(f64::total_cmp)
}

/// The readings, with amplitudes and slopes as the nominal model has them, and its fit.
pub(super) fn nominal_of(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Option<(Frame, Fit)> {
    let mut frame = Frame::new(observations, nominal, settings);
    let first = fit_nominal(&frame, settings)?;
    set_amplitudes(&mut frame, &first);
    frame.set_paths(observations, &first);
    frame.set_shear_slopes(&first)?;
    let forward = Forward::new(&frame, &[]);
    let shapes = forward.joint_differences(&first.branch.optimum.parameters)?;
    frame.shape_slopes = Some(shapes);
    let none = fit_nominal(&frame, settings)?;
    Some((frame, none))
}

fn compete_once(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Option<Competition> {
    let (frame, none) = nominal_of(observations, nominal, settings)?;
    let candidates = candidates(&frame);
    let search = Search {
        frame: &frame,
        settings,
        without: &none,
    };
    let mut entries: Vec<Entry> = candidates
        .par_iter()
        .map(|candidate| {
            let fit = search.add(*candidate)?;
            Some(Entry::new(Hypothesis::Effects(vec![candidate.effect]), fit))
        })
        .collect::<Vec<Option<Entry>>>()
        .into_iter()
        .flatten()
        .collect();
    let fits = entries.iter().map(|entry| &entry.fit).chain([&none]);
    if fits.into_iter().all(|fit| !stands(&frame, fit)) {
        seek_from_afar(&search, &candidates, &mut entries);
    }
    if let Some((fit, drift)) = fit_drift(&frame, &none) {
        let mut entry = Entry::new(Hypothesis::Effects(vec![EffectId::JointDrift]), fit);
        entry.drift = Some(drift);
        entries.push(entry);
    }
    if let Some(fit) = fit_unknown(&frame, settings, &none) {
        entries.push(Entry::new(Hypothesis::Unknown, fit));
    }
    let baseline = fit_baseline(&frame, settings).unwrap_or_else(|| none.clone());
    let drifting = fit_drifting(&frame, settings).unwrap_or_else(|| baseline.clone());
    let described = fit_described(&frame, settings).unwrap_or_else(|| drifting.clone());
    entries.push(Entry::new(Hypothesis::None, none));
    Some(Competition {
        frame,
        described,
        drifting,
        baseline,
        entries,
    })
}

/// Where nothing suffices: every effect once more from afar, in case it is larger than a search from without
/// it can reach.
fn seek_from_afar(search: &Search<'_>, candidates: &[Candidate], entries: &mut Vec<Entry>) {
    let so_far = |candidate: &Candidate| {
        let own = |entry: &&Entry| entry.effects() == [candidate.effect];
        entries.iter().find(own).map(|entry| &entry.fit)
    };
    let found: Vec<Option<Fit>> = candidates
        .par_iter()
        .map(|candidate| search.add_from_afar(*candidate, so_far(candidate)))
        .collect();
    for (candidate, fit) in candidates.iter().zip(found) {
        let Some(fit) = fit else { continue };
        let own = |entry: &&mut Entry| entry.effects() == [candidate.effect];
        match entries.iter_mut().find(own) {
            Some(entry) if fit.log_evidence > entry.fit.log_evidence => entry.fit = fit,
            Some(_) => {}
            None => {
                let hypothesis = Hypothesis::Effects(vec![candidate.effect]);
                entries.push(Entry::new(hypothesis, fit));
            }
        }
    }
}

/// The nominal model whose geometry is taken at its word.
fn fit_baseline(frame: &Frame, settings: &GapSettings) -> Option<Fit> {
    fit_nominal(&at_their_word(frame, is_geometry), settings)
}

/// The same with sensors and fastened masses that weigh what was said.
fn fit_drifting(frame: &Frame, settings: &GapSettings) -> Option<Fit> {
    fit_nominal(&at_their_word(frame, is_described), settings)
}

/// The same with a joint and a warmth that are one and the same in all visits.
fn fit_described(frame: &Frame, settings: &GapSettings) -> Option<Fit> {
    let stays = |small: &Small| is_described(small) || matches!(small, Small::Temperature { .. });
    let settings = GapSettings {
        drift_stds: vec![EXACT],
        ..settings.clone()
    };
    fit_nominal(&at_their_word(frame, stays), &settings)
}

/// Whether a small unknown is of what a description states.
fn is_described(small: &Small) -> bool {
    is_geometry(small)
        || matches!(
            small,
            Small::SensorMass { .. } | Small::SensorInertia { .. } | Small::FastenedMass { .. }
        )
}

fn is_geometry(small: &Small) -> bool {
    matches!(small, Small::Scale | Small::Shear)
}

/// The frame with these small unknowns taken at their word.
fn at_their_word(frame: &Frame, stays: impl Fn(&Small) -> bool) -> Frame {
    let mut exact = frame.clone();
    for (small, std) in exact.smalls.iter().zip(&mut exact.small_stds) {
        if stays(small) {
            *std = EXACT;
        }
    }
    exact
}

/// Standard deviation (1) of what is taken at its word: far below what any reading shows.
const EXACT: f64 = 1e-8;

/// The effects that can be hypotheses of these readings.
fn candidates(frame: &Frame) -> Vec<Candidate> {
    let scales = Scales::of(&frame.nominal.specimen);
    EffectId::ALL
        .iter()
        .copied()
        .filter(|effect| possible(frame, *effect))
        .filter_map(|effect| candidate(effect, &scales))
        .map(|mut candidate| {
            if let (EffectId::Resolution, Some(bias)) =
                (candidate.effect, frame.nominal.reading_bias)
            {
                candidate.size.scale = bias;
            }
            candidate
        })
        .collect()
}

/// Whether the test has what the effect acts on.
fn possible(frame: &Frame, effect: EffectId) -> bool {
    let sensors = || frame.setups.iter().flat_map(|setup| &setup.carried);
    let sought = frame.nominal.sought();
    let joint = !matches!(
        frame.nominal.specimen.joint,
        tapjoint_beam::specimen::SpecimenJoint::Free
    );
    let coupled = sought.iter().any(|(direction, _)| *direction == COUPLING);
    let one_beam = frame.nominal.specimen.body.beams().len() == 1;
    match effect {
        EffectId::SensorMass => sensors().any(|sensor| sensor.mass == 0.0),
        EffectId::SensorCable => sensors().count() > 0,
        EffectId::CrossCoupling => joint && one_beam && !coupled,
        EffectId::Fixture => joint && one_beam,
        EffectId::JointMass | EffectId::JointDamping => joint,
        // Nothing pulls on a free end, nor on beams that overlap.
        EffectId::AxialLoad => joint && one_beam,
        EffectId::JointNonlinearity => sought.iter().any(|(direction, _)| *direction == 1),
        EffectId::Resolution => frame.nominal.reading_bias.is_some(),
        _ => true,
    }
}

/// Amplitude of the joint's rotation in each configuration over that of the hardest. Where a tap has no
/// place, the force alone.
fn set_amplitudes(frame: &mut Frame, nominal: &Fit) {
    let forward = Forward::new(frame, &[]);
    let Some(solved) = forward.solve(&nominal.branch.optimum.parameters) else {
        return;
    };
    let amplitude = |(setup, one): (&Setup, &Solved)| -> Option<f64> {
        let tap = setup.tap?;
        let modes = (1..=frame.fitted_modes).filter_map(|mode| one.index(mode));
        Some(joint_amplitude(one.modes(), (tap, setup.level), modes))
    };
    let all: Option<Vec<f64>> = frame.setups.iter().zip(&solved).map(amplitude).collect();
    let Some(all) = all else { return };
    let most = all.iter().copied().fold(0.0, f64::max);
    if most > 0.0 {
        for (setup, amplitude) in frame.setups.iter_mut().zip(&all) {
            setup.level = amplitude / most;
        }
    }
}
