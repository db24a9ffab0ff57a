//! Causes outside the catalogue that a model can follow, and what each does to a specimen.

use tapjoint_beam::specimen::{BeamSection, Mesh, PointMass, PointSpring, Specimen};

/// Kind of change by which a structure may differ from its description. All kinds are equally probable, and so are all
/// changes of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Each mode for itself.
    Modes,
    /// Stiffness, mass or thickness along the beam.
    AlongBeam,
    /// Springs along the beam.
    Springs,
    /// A rotary inertia at one place, or two masses.
    Things,
    /// Each set-up for itself.
    SetUps,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 5] = [
        Self::Modes,
        Self::AlongBeam,
        Self::Springs,
        Self::Things,
        Self::SetUps,
    ];
}

/// A cause outside the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForeignCause {
    /// The beam touches something at a place.
    Support,
    /// A third of the beam, about a place, lies on something soft. At an end the part that is on the beam has the same
    /// total stiffness.
    Bed,
    /// All of the beam lies on something soft.
    WholeBed,
    /// A rotary inertia at a place, without mass.
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

/// Half of a bed over the length (1).
const HALF_BED: f64 = 1.0 / 6.0;
/// Half of a part over the length (1).
const HALF_PART: f64 = 1.0 / 8.0;
/// Springs into which a bed is divided: four to a wave of the tenth mode.
const SPRINGS: usize = 20;
/// Steps of a taper: one for each element.
const STEPS: usize = Mesh::DIAGNOSIS.elements;

impl ForeignCause {
    /// All causes.
    pub const ALL: [Self; 8] = [
        Self::Support,
        Self::Bed,
        Self::WholeBed,
        Self::RotaryLump,
        Self::SoftPart,
        Self::HeavyPart,
        Self::Strip,
        Self::Taper,
    ];

    /// Returns the kind of ways that it belongs to.
    pub fn kind(self) -> Kind {
        match self {
            Self::Support | Self::Bed | Self::WholeBed => Kind::Springs,
            Self::RotaryLump => Kind::Things,
            Self::SoftPart | Self::HeavyPart | Self::Strip | Self::Taper => Kind::AlongBeam,
        }
    }

    /// Adds the cause to a specimen: `size` in N/m (springs), kg m2 (inertia) or relative (1), `place` in m from the left end.
    /// A whole bed and a taper have no place.
    pub fn add(self, size: f64, place: f64, specimen: &mut Specimen) {
        let length = specimen.body.length();
        match self {
            Self::Support => specimen.springs.push(PointSpring {
                position: place,
                stiffness: size,
            }),
            Self::Bed => add_bed(part(place, HALF_BED * length, length), size, specimen),
            Self::WholeBed => add_bed([0.0, length], size, specimen),
            Self::RotaryLump => specimen.masses.push(PointMass {
                position: place,
                mass: 0.0,
                inertia: size,
            }),
            Self::SoftPart => add_section(
                part(place, HALF_PART * length, length),
                [1.0 + size, 1.0],
                specimen,
            ),
            Self::HeavyPart => add_section(
                part(place, HALF_PART * length, length),
                [1.0, 1.0 + size],
                specimen,
            ),
            // Glued firmly, both are one section of thickness h (1 + t).
            Self::Strip => {
                let factors = [(1.0 + size).powi(3), 1.0 + size];
                add_section(part(place, HALF_PART * length, length), factors, specimen);
            }
            Self::Taper => {
                let ends = [1.0 - 0.5 * size, 1.0 + 0.5 * size];
                let steps = BeamSection::taper(length, ends[0], ends[1], STEPS);
                specimen.sections.extend(steps);
            }
        }
    }
}

/// Returns the ends (m) of what reaches `half` (m) to either side of a place, on a beam of this length.
fn part(place: f64, half: f64, length: f64) -> [f64; 2] {
    [place - half, place + half].map(|x| x.clamp(0.0, length))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::strip;
    use std::f64::consts::PI;

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

    /// Stiffness goes with the cube of the mass, and a taper leaves the mass of the beam as it is.
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
}
