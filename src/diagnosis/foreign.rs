//! Causes outside the catalogue that a model can follow, as a part of the hypothesis `unknown`.
//!
//! The linear ways of [`unknown`](crate::unknown) have many sizes, and miss a part of what large changes do. A wrong name with one size
//! and one place then wins by its simplicity. Each cause here is as simple as an effect of the catalogue: it has one size, and one
//! place or none. The structure is solved anew with it. It is never named.

use crate::candidates::candidate_effect;
use crate::dataset::Dataset;
use crate::evidence::Fit;
use crate::fit::Search;
use crate::parameters::{CandidateEffect, Cause, LocationKind, LocationRange, Size, Target};
use crate::unknown::Kind;
use crate::verdict::Candidate;
use rayon::prelude::*;
use tapjoint_beam::effects::EffectId;
use tapjoint_beam::specimen::{BeamSection, PointMass, PointSpring, Specimen};

/// A cause outside the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForeignCause {
    /// The beam touches something at a place.
    Support,
    /// A third of the beam, about a place, lies on something soft.
    Bed,
    /// All of the beam lies on something soft.
    WholeBed,
    /// Something at a place that turns more than it weighs.
    RotaryLump,
    /// A quarter of the beam, about a place, is softer or stiffer.
    SoftPart,
    /// A quarter of the beam, about a place, is heavier.
    HeavyPart,
    /// A strip of the beam's own material covers a quarter of it, about a place.
    Strip,
    /// The thickness changes linearly along the beam.
    Taper,
}

/// Evidence of one of these causes, or of two masses.
pub struct ForeignFit {
    pub kind: Kind,
    pub log_evidence: f64,
}

/// Half of a bed over the length (1).
const HALF_BED: f64 = 1.0 / 6.0;
/// Half of a part over the length (1).
const HALF_PART: f64 = 1.0 / 8.0;
/// Springs into which a bed is divided: four to the shortest wave of interest.
const SPRINGS: usize = 20;
/// Steps of a taper: one for each element.
const STEPS: usize = 60;
/// Places at which a search begins: twice as many as half waves of the sixth mode.
const NODES: usize = 12;

impl ForeignCause {
    const ALL: [Self; 8] = [
        Self::Support,
        Self::Bed,
        Self::WholeBed,
        Self::RotaryLump,
        Self::SoftPart,
        Self::HeavyPart,
        Self::Strip,
        Self::Taper,
    ];

    fn kind(self) -> Kind {
        match self {
            Self::Support | Self::Bed | Self::WholeBed => Kind::Springs,
            Self::RotaryLump => Kind::Things,
            Self::SoftPart | Self::HeavyPart | Self::Strip | Self::Taper => Kind::AlongBeam,
        }
    }

    /// Returns the cause with the priors of its size and place.
    fn candidate(self, dataset: &Dataset) -> CandidateEffect {
        let nominal = &dataset.nominal;
        let length = nominal.length();
        let spring = nominal.bending_stiffness() / length.powi(3);
        let inertia = nominal.beam_mass() * length * length;
        let mut size = match self {
            // From a thread to a stop: the tip of a cantilever has 3.
            Self::Support | Self::Bed | Self::WholeBed => {
                Size::positive("stiffness", spring, 1e3 * spring)
            }
            // One percent of the beam's mass, at a tenth of its length from the axis.
            Self::RotaryLump => Size::positive("inertia", 1e-4 * inertia, 0.03 * inertia),
            Self::SoftPart => Size {
                high: 2.0,
                ..Size::signed("stiffness", 0.05, 0.9)
            },
            // Paint and tape to a clamped plate.
            Self::HeavyPart => Size::positive("mass", 0.05, 3.0),
            Self::Strip => Size::positive("thickness", 0.02, 1.0),
            // Rolled strip to ground and worn ones.
            Self::Taper => Size::signed("taper", 0.02, 0.8),
        };
        size.scale *= dataset.settings.thresholds.prior_scale;
        let is_placed = !matches!(self, Self::WholeBed | Self::Taper);
        CandidateEffect {
            cause: Cause::Foreign(self),
            target: Target::All,
            size,
            location: is_placed.then_some(LocationRange {
                kind: LocationKind::Position,
                low: 0.01 * length,
                high: length,
                nodes: NODES,
            }),
            variants: 1,
        }
    }

    /// Adds the cause to a specimen. `place` (m) is without meaning where it has none.
    pub fn add(self, size: f64, place: f64, specimen: &mut Specimen) {
        let length = specimen.body.length();
        let part = |half: f64| {
            [place - half * length, place + half * length].map(|x| x.clamp(0.0, length))
        };
        match self {
            Self::Support => specimen.springs.push(PointSpring {
                position: place,
                stiffness: size,
            }),
            Self::Bed => add_bed(part(HALF_BED), size, specimen),
            Self::WholeBed => add_bed([0.0, length], size, specimen),
            Self::RotaryLump => specimen.masses.push(PointMass {
                position: place,
                mass: 0.0,
                inertia: size,
            }),
            Self::SoftPart => add_section(part(HALF_PART), [1.0 + size, 1.0], specimen),
            Self::HeavyPart => add_section(part(HALF_PART), [1.0, 1.0 + size], specimen),
            // On one side: both bend about one neutral axis, by (1 + t)^3 together.
            Self::Strip => {
                let factors = [(1.0 + size).powi(3), 1.0 + size];
                add_section(part(HALF_PART), factors, specimen);
            }
            Self::Taper => {
                let ends = [1.0 - 0.5 * size, 1.0 + 0.5 * size];
                let steps = BeamSection::taper(length, ends[0], ends[1], STEPS);
                specimen.sections.extend(steps);
            }
        }
    }
}

/// Adds springs of a total stiffness (N/m) between two places (m).
fn add_bed([start, end]: [f64; 2], stiffness: f64, specimen: &mut Specimen) {
    let step = (end - start) / SPRINGS as f64;
    let springs = (0..SPRINGS).map(|k| PointSpring {
        position: start + (k as f64 + 0.5) * step,
        stiffness: stiffness / SPRINGS as f64,
    });
    specimen.springs.extend(springs);
}

/// Adds factors on bending stiffness and mass between two places (m).
fn add_section([start, end]: [f64; 2], [stiffness, mass]: [f64; 2], specimen: &mut Specimen) {
    specimen.sections.push(BeamSection {
        start,
        end,
        stiffness,
        mass,
    });
}

/// Fits all causes, and two masses, beside the nominal model.
pub fn fit_foreign(dataset: &Dataset, nominal: &Fit, candidates: &[Candidate]) -> Vec<ForeignFit> {
    let beside = |without| Search {
        dataset,
        without,
        by_frequencies: None,
    };
    let found: Vec<Option<ForeignFit>> = ForeignCause::ALL
        .par_iter()
        .map(|cause| {
            let fit = beside(nominal).add(cause.candidate(dataset))?;
            Some(ForeignFit {
                kind: cause.kind(),
                log_evidence: fit.log_evidence,
            })
        })
        .collect();
    let mut all: Vec<ForeignFit> = found.into_iter().flatten().collect();
    let mut one_mass = candidates.iter();
    let one_mass = one_mass.find(|one| one.effects() == [EffectId::AddedMass]);
    let mass = candidate_effect(EffectId::AddedMass, &dataset.nominal, dataset.peaks.end);
    if let Some((one, mass)) = one_mass.zip(mass)
        && let Some(two) = beside(&one.fit).add(mass)
    {
        all.push(ForeignFit {
            kind: Kind::Things,
            log_evidence: two.log_evidence,
        });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose;
    use crate::result::Verdict;
    use crate::settings::GapSettings;
    use crate::synthetic::observe;
    use crate::tests::{fitted, plan, strip};
    use std::f64::consts::PI;
    use tapjoint_beam::specimen::Mesh;

    fn frequencies(specimen: &Specimen) -> Vec<f64> {
        let modes = specimen.beam_modes(5, Mesh::DIAGNOSIS).unwrap();
        let numbers = modes.numbers.iter();
        numbers
            .map(|number| modes.modes.frequencies()[*number])
            .collect()
    }

    #[test]
    fn limit_nothing_of_a_cause_changes_nothing() {
        let nominal = strip(0.005).specimen;
        let before = frequencies(&nominal);
        for cause in ForeignCause::ALL {
            let mut with = nominal.clone();
            cause.add(0.0, 0.3, &mut with);
            for (new, old) in frequencies(&with).iter().zip(&before) {
                // Rounding in the eigenvalues.
                assert!((new / old - 1.0).abs() < 1e-9, "{cause:?}: {new} {old}");
            }
        }
    }

    /// On a bed of k per length omega^2 grows by k L/m in every mode, since the bed has the shape of the mass.
    #[test]
    fn val_a_whole_bed_adds_the_same_to_all_squares() {
        let nominal = strip(0.0).specimen;
        let beam = nominal.body.beams()[0];
        let (before, mut with) = (frequencies(&nominal), nominal.clone());
        let stiffness = 500.0;
        ForeignCause::WholeBed.add(stiffness, 0.0, &mut with);
        let expected = stiffness / beam.mass() / (2.0 * PI).powi(2);
        for (new, old) in frequencies(&with).iter().zip(&before).take(3) {
            // 20 springs in place of a bed.
            let change = (new * new - old * old) / expected;
            assert!((change - 1.0).abs() < 0.01, "{change}");
        }
    }

    /// Two halves of the beam's own thickness are a beam of (1 + t) times it, and so are all steps of a taper in the middle.
    #[test]
    fn prop_a_strip_and_a_taper_are_of_the_beams_own_material() {
        let mut strip = strip(0.0).specimen;
        ForeignCause::Strip.add(0.1, 0.2, &mut strip);
        let [section] = strip.sections[..] else {
            panic!("one section");
        };
        assert!((section.stiffness - section.mass.powi(3)).abs() < 1e-12);
        strip.sections.clear();
        ForeignCause::Taper.add(0.1, 0.0, &mut strip);
        let sections = strip.sections.iter();
        let mean = sections.map(|one| one.mass).sum::<f64>() / STEPS as f64;
        assert!((mean - 1.0).abs() < 1e-12);
    }

    #[test]
    fn recover_each_kind_has_evidence() {
        let (dataset, nominal) = fitted();
        let found = fit_foreign(&dataset, &nominal, &[]);
        assert_eq!(found.len(), ForeignCause::ALL.len());
        assert!(found.iter().all(|one| one.log_evidence.is_finite()));
    }

    /// A spring at the sensor is the sensor's cable; anywhere else it is nothing that the catalogue has.
    #[test]
    fn regress_a_support_is_no_cable_and_two_masses_are_not_one() {
        let nominal = strip(0.005);
        let length = nominal.length();
        let plan = plan(&[0.2, 0.35]);
        let mut held = nominal.clone();
        let unit = nominal.bending_stiffness() / length.powi(3);
        ForeignCause::Support.add(3.0 * unit, 0.7 * length, &mut held.specimen);
        let mut heavy = nominal.clone();
        for place in [0.4, 0.9] {
            let mass = PointMass::new(place * length, 0.02 * nominal.beam_mass());
            heavy.specimen.masses.push(mass);
        }
        for truth in [held, heavy] {
            for seed in 0..3 {
                let observed = observe(&plan, &truth, &[], seed).unwrap();
                let found = diagnose(&observed, &nominal, &GapSettings::default()).unwrap();
                let verdict = &found.verdict;
                assert!(
                    !matches!(verdict, Verdict::Named(_) | Verdict::Group(_)),
                    "{verdict:?}"
                );
            }
        }
    }
}
