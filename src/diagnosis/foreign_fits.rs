//! Fits of causes outside the catalogue, as a part of the hypothesis `unknown`.
//!
//! The linear ways of `unknown` have many sizes, and are inexact for large changes. A wrong name with one size and one
//! place then wins because it is simpler. Each cause here is as simple as an effect of the catalogue: it has one size, and
//! one place or none. The structure is solved anew with it. It is never named.

use crate::dataset::Dataset;
use crate::evidence::Fit;
use crate::fit::Search;
use crate::foreign::{ForeignCause, Kind};
use crate::parameters::{CandidateEffect, Cause, LocationKind, LocationRange, Size, Target};
use rayon::prelude::*;
use std::f64::consts::LN_2;

/// Places at which a search begins: twice as many as half waves of the sixth mode.
const NODES: usize = 12;

/// Evidence of one of these causes, or of two masses.
pub struct ForeignFit {
    /// Kind of ways that it belongs to.
    pub kind: Kind,
    /// Logarithm of its evidence.
    pub log_evidence: f64,
}

/// Returns a cause with the priors of its size and place.
fn candidate(cause: ForeignCause, dataset: &Dataset) -> CandidateEffect {
    let nominal = &dataset.nominal;
    let length = nominal.length();
    let spring = nominal.bending_stiffness() / length.powi(3);
    let inertia = nominal.beam_mass() * length * length;
    let mut size = match cause {
        // From a thread to a stop. A cantilever itself has 3 at its tip, in this unit.
        ForeignCause::Support | ForeignCause::Bed | ForeignCause::WholeBed => {
            Size::positive("stiffness", spring, 1e3 * spring)
        }
        // One percent of the beam's mass, at a tenth of its length from the axis.
        ForeignCause::RotaryLump => Size::positive("inertia", 1e-4 * inertia, 0.03 * inertia),
        // A delamination or worn part: some percent.
        ForeignCause::SoftPart => Size {
            high: 2.0,
            ..Size::signed("stiffness", 0.05, 0.9)
        },
        // Paint and tape to a clamped plate.
        ForeignCause::HeavyPart => Size::positive("mass", 0.05, 3.0),
        // Tape to a doubler of sheet.
        ForeignCause::Strip => Size::positive("thickness", 0.02, 1.0),
        // Rolled strip to ground and worn ones.
        ForeignCause::Taper => Size::signed("taper", 0.02, 0.8),
    };
    size.scale *= dataset.settings.thresholds.prior_scale;
    let is_placed = !matches!(cause, ForeignCause::WholeBed | ForeignCause::Taper);
    CandidateEffect {
        cause: Cause::Foreign(cause),
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

/// Fits all causes beside the nominal model, and a second mass beside one. A fit that fails has no evidence.
pub fn fit_foreign(dataset: &Dataset, nominal: &Fit, one_mass: Option<&Fit>) -> Vec<ForeignFit> {
    let beside = |without| Search {
        dataset,
        without,
        by_frequencies: None,
    };
    let causes = ForeignCause::ALL.par_iter().map(|cause| {
        let fit = beside(nominal).add(candidate(*cause, dataset));
        ForeignFit {
            kind: cause.kind(),
            log_evidence: fit.map_or(f64::NEG_INFINITY, |fit| fit.log_evidence),
        }
    });
    let mut all: Vec<ForeignFit> = causes.collect();
    if let Some(one) = one_mass {
        let two = beside(one).add(one.effects[0]);
        all.push(ForeignFit {
            kind: Kind::Things,
            // Both orders of the two masses are the same structure.
            log_evidence: two.map_or(f64::NEG_INFINITY, |fit| fit.log_evidence + LN_2),
        });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose;
    use crate::fit::fit_nominal;
    use crate::result::{Hypothesis, Verdict};
    use crate::settings::GapSettings;
    use crate::synthetic::observe;
    use crate::tests::{plan, strip};
    use tapjoint_beam::specimen::PointMass;

    /// Each planted cause is detected by its own model, and no other kind explains it better.
    #[test]
    fn recover_the_kind_of_each_cause() {
        let nominal = strip(0.005);
        let [unit, length] = [
            nominal.bending_stiffness() / nominal.length().powi(3),
            nominal.length(),
        ];
        let inertia = nominal.beam_mass() * length * length;
        for cause in ForeignCause::ALL {
            let size = match cause {
                ForeignCause::Support | ForeignCause::Bed | ForeignCause::WholeBed => 3.0 * unit,
                ForeignCause::RotaryLump => 1e-3 * inertia,
                _ => 0.1,
            };
            let mut truth = nominal.clone();
            cause.add(size, 0.6 * length, &mut truth.specimen);
            let observed = observe(&plan(&[0.2, 0.35]), &truth, &[], 1).unwrap();
            let settings = GapSettings::default();
            let dataset = Dataset::new(&observed, &nominal, &settings);
            let none = fit_nominal(&dataset).unwrap();
            let found = fit_foreign(&dataset, &none, None);
            let index = ForeignCause::ALL
                .iter()
                .position(|one| *one == cause)
                .unwrap();
            let own = found[index].log_evidence;
            let gain = own - none.log_evidence;
            assert!(gain > settings.thresholds.detected, "{cause:?}: {gain}");
            let others = found.iter().filter(|one| one.kind != cause.kind());
            let other = others
                .map(|one| one.log_evidence)
                .fold(f64::NEG_INFINITY, f64::max);
            assert!(own > other, "{cause:?}: {own} {other}");
        }
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
                let is_refused = match verdict {
                    Verdict::Unknown => true,
                    Verdict::Set(list) => list.contains(&Hypothesis::Unknown),
                    _ => false,
                };
                assert!(is_refused, "{verdict:?}");
            }
        }
    }
}
