//! The tests that are weighed against each other, as configurations that the model can predict.

use super::super::catalogue::Candidate;
use super::super::frame::{Frame, Row};
use super::super::nominal::COUPLING;
use super::super::settings::GapSettings;
use super::super::setup::Setup;
use super::super::small_unknowns::Small;
use super::accuracy::{FINER, observed_modes, std_of, without_bias};
use super::step::Step;
use tapjoint_beam::effects::EffectId;
use tapjoint_beam::specimen::{Body, PointInertia, PointMass, SpecimenJoint};

/// A test with the readings that it would bring.
#[derive(Debug, Clone)]
pub(super) struct Proposal {
    pub(super) step: Step,
    pub(super) readings: Readings,
}

/// What a test would read.
#[derive(Debug, Clone)]
pub(super) enum Readings {
    /// Frequencies of modes (logarithms) with their standard uncertainties.
    Frequencies(Structure, Vec<(Row, f64)>),
    /// Something that is read without the beam's vibration.
    Direct,
}

/// Of what frequencies are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Structure {
    /// The tested structure.
    Whole,
    /// The same, its frequencies read without bias.
    Unbiased,
    /// The beam by itself.
    Bare,
}

impl Structure {
    /// Whether an effect shows there.
    pub(super) fn shows(self, effect: &Candidate) -> bool {
        match self {
            Structure::Whole => true,
            Structure::Unbiased => effect.effect != EffectId::Resolution,
            Structure::Bare => matches!(
                effect.effect,
                EffectId::Modulus
                    | EffectId::Length
                    | EffectId::Timebase
                    | EffectId::AddedMass
                    | EffectId::LocalCrack
                    | EffectId::ShearRotary
            ),
        }
    }
}

/// All tests that could be made of this structure.
pub(super) struct Proposals {
    pub(super) all: Vec<Proposal>,
    /// Configurations at hand and planned ones.
    pub(super) whole: Frame,
    /// How well each small unknown is known that was added for a planned test.
    pub(super) added: Vec<Added>,
    /// How much warmer or colder a new visit may be, as a factor on its frequencies (1).
    temperature_std: f64,
    /// The beam by itself.
    pub(super) bare: Option<Frame>,
    /// The configuration in which gravity is turned over.
    pub(super) turned: Option<usize>,
}

/// How well a small unknown of a planned test is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Added {
    /// The joint's drift, as between the visits at hand and with this standard deviation at least (1).
    Drift(f64),
    /// What a scale or a ruler reads, with this standard deviation (unit of the unknown).
    Stated(f64),
}

/// Configurations at hand that are kept for reading them again.
const KEPT: usize = 4;
/// How many modes more might be read.
pub(crate) const MORE_MODES: usize = 2;
/// Places to which a sensor might be moved, over the length.
const PLACES: [f64; 5] = [0.3, 0.45, 0.6, 0.75, 0.95];
/// A sensor counts as moved from this share of the length on.
const MOVED: f64 = 0.08;
/// The known mass over the beam's: 2 % moves frequencies by up to 4 %, a hundred times what is read.
const KNOWN_MASS: f64 = 0.02;
/// Standard deviation of a joint that was tightened again (1).
const RETIGHTENED: f64 = 0.02;

impl Proposals {
    /// What could be done next, given the readings at hand.
    pub(super) fn new(frame: &Frame, settings: &GapSettings) -> Self {
        let mut whole = frame.clone();
        whole.setups.truncate(KEPT);
        // What other taps scattered in common says nothing of planned ones.
        whole.scatter.retain(|one| one.0.0 < KEPT);
        whole.modes += MORE_MODES;
        whole.rows.clear();
        whole.readings.clear();
        whole.shape_slopes = None;
        let mut planned = Proposals {
            all: Vec::new(),
            whole,
            added: Vec::new(),
            temperature_std: settings.temperature_std,
            bare: None,
            turned: None,
        };
        if frame.modes + MORE_MODES <= settings.highest_mode {
            planned.read_higher(frame);
        }
        planned.read_finer(frame);
        planned.tap_again(frame);
        planned.change(frame, settings);
        planned.take_apart(frame);
        for step in [Step::WeighSensor, Step::Calipers, Step::ReferenceTone] {
            let readings = Readings::Direct;
            planned.all.push(Proposal { step, readings });
        }
        planned
    }

    fn propose(&mut self, step: Step, structure: Structure, rows: Vec<(Row, f64)>) {
        let readings = Readings::Frequencies(structure, rows);
        self.all.push(Proposal { step, readings });
    }

    /// Higher modes.
    fn read_higher(&mut self, frame: &Frame) {
        let (first, last) = (frame.modes + 1, frame.modes + MORE_MODES);
        let kept = self.whole.setups.len();
        let higher = |configuration: usize| {
            (first..=last).map(move |mode| {
                let row = Row::Frequency {
                    configuration,
                    mode,
                };
                (row, std_of(frame, mode))
            })
        };
        let rows = (0..kept).flat_map(higher).collect();
        let step = Step::HigherModes {
            first,
            last,
            is_recorded: frame.setups.iter().any(|setup| setup.is_recorded),
        };
        self.propose(step, Structure::Whole, rows);
    }

    /// Finer lines.
    fn read_finer(&mut self, frame: &Frame) {
        if let Some(bias) = frame.nominal.reading_bias {
            let rows = observed_modes(frame).map(|mode| {
                let configuration = 0;
                let row = Row::Frequency {
                    configuration,
                    mode,
                };
                (row, without_bias(frame, mode, bias))
            });
            let spacing = 2.0 * FINER * bias;
            self.propose(
                Step::FinerLines { spacing },
                Structure::Unbiased,
                rows.collect(),
            );
        }
    }

    /// The first recording once more: more taps, other levels, a joint that was opened.
    fn tap_again(&mut self, frame: &Frame) {
        let again = frame.setups[0].clone();
        let more = Step::MoreTaps { factor: 4 };
        let rows = self.visit(frame, again.clone(), 0.0);
        let rows = rows.into_iter().map(|(row, std)| (row, 0.5 * std));
        let rows = rows.collect();
        self.propose(more, Structure::Whole, rows);
        let sought = frame.nominal.sought();
        let by_level = |a: &&Setup, b: &&Setup| a.level.total_cmp(&b.level);
        let hardest = frame.setups.iter().max_by(by_level).unwrap_or(&again);
        if sought.iter().any(|(direction, _)| *direction == 1) {
            for level in [0.25, 3.0] {
                let mut other = hardest.clone();
                other.level *= level;
                other.path = other.path.map(|path| path.over(1.0 / level));
                let rows = self.visit(frame, other, 0.0);
                self.propose(Step::TapLevel { level }, Structure::Whole, rows);
            }
        }
        if !sought.is_empty() {
            let rows = self.visit(frame, again, RETIGHTENED);
            self.propose(Step::Retighten, Structure::Whole, rows);
        }
    }

    /// Sensors moved, masses fastened, the set-up turned over.
    fn change(&mut self, frame: &Frame, settings: &GapSettings) {
        let length = frame.nominal.specimen.body.length();
        let first = &frame.setups[0];
        let sat = |place: f64| {
            let sensors = frame.setups.iter().flat_map(|setup| &setup.carried);
            let mut near = sensors.map(|sensor| (sensor.position - place).abs());
            near.any(|distance| distance < MOVED * length)
        };
        let places: Vec<f64> = PLACES.iter().map(|share| share * length).collect();
        if !first.carried.is_empty() {
            for position in places.into_iter().filter(|place| !sat(*place)) {
                let step = Step::MoveSensor {
                    name: name_of(frame),
                    position,
                };
                // Where it sits then is another unknown.
                let place = self.unused(frame, |setup| setup.places.iter().copied().max());
                self.add(
                    Small::SensorPlace { place },
                    Added::Stated(settings.position_std),
                );
                let rows = self.visit(frame, moved(frame, position, place), 0.0);
                self.propose(step, Structure::Whole, rows);
            }
        }
        let mass = round_mass(KNOWN_MASS * beam_mass(frame));
        for position in [length, 0.5 * length] {
            let mass = PointMass {
                position,
                mass,
                inertia: 0.0,
            };
            let fastened = self.unused(frame, |setup| setup.fastened.iter().map(|one| one.0).max());
            let (scale, ruler) = (settings.fastened_mass_std, settings.position_std);
            self.add(Small::FastenedMass { fastened }, Added::Stated(scale));
            self.add(Small::FastenedPlace { fastened }, Added::Stated(ruler));
            let mut heavier = first.clone();
            heavier.specimen.masses.push(mass);
            heavier.fastened.push((fastened, mass));
            let rows = self.visit(frame, heavier, 0.0);
            let step = Step::KnownMass {
                mass: mass.mass,
                position,
            };
            self.propose(step, Structure::Whole, rows);
        }
        if held_at_one_end(frame) {
            self.turned = Some(self.whole.setups.len());
            let rows = self.visit(frame, first.clone(), 0.0);
            self.propose(Step::TurnOver, Structure::Whole, rows);
        }
    }

    /// The beam by itself.
    fn take_apart(&mut self, frame: &Frame) {
        if !held_at_one_end(frame) {
            return;
        }
        let mut bare = self.whole.clone();
        let specimen = &mut bare.nominal.specimen;
        specimen.joint = SpecimenJoint::Free;
        specimen.joint_mass = PointInertia::default();
        specimen.overlap = None;
        let mut alone = frame.setups[0].clone();
        alone.specimen = specimen.clone();
        alone.sensors.clear();
        alone.carried.clear();
        alone.fastened.clear();
        alone.path = None;
        alone.names.clear();
        alone.places.clear();
        bare.setups = vec![alone];
        let configuration = 0;
        let rows = observed_modes(frame).map(|mode| {
            (
                Row::Frequency {
                    configuration,
                    mode,
                },
                std_of(frame, mode),
            )
        });
        self.propose(Step::BareBeam, Structure::Bare, rows.collect());
        self.bare = Some(bare);
    }

    /// A small unknown of planned tests.
    fn add(&mut self, small: Small, added: Added) {
        let (Added::Drift(std) | Added::Stated(std)) = added;
        self.whole.small(small, 0.0, std);
        self.added.push(added);
    }

    /// The first index that no configuration uses, given the highest that each does.
    fn unused(&self, frame: &Frame, highest: impl Fn(&Setup) -> Option<usize>) -> usize {
        let setups = self.whole.setups.iter().chain(&frame.setups);
        setups.filter_map(highest).max().map_or(0, |most| most + 1)
    }

    /// A new visit to the structure: its configuration, its own drift of the joint, its rows.
    fn visit(&mut self, frame: &Frame, mut setup: Setup, drift: f64) -> Vec<(Row, f64)> {
        let visits = self.whole.setups.iter().chain(&frame.setups);
        let visit = 1 + visits.map(|setup| setup.visit).max().unwrap_or(0);
        setup.visit = visit;
        let sought = frame.nominal.sought().into_iter();
        for (direction, _) in sought.filter(|one| one.0 != COUPLING) {
            self.add(Small::Drift { visit, direction }, Added::Drift(drift));
        }
        self.add(
            Small::Temperature { visit },
            Added::Stated(self.temperature_std),
        );
        let configuration = self.whole.setups.len();
        self.whole.setups.push(setup);
        observed_modes(frame)
            .map(|mode| {
                (
                    Row::Frequency {
                        configuration,
                        mode,
                    },
                    std_of(frame, mode),
                )
            })
            .collect()
    }
}

/// The first configuration with the first sensor that it carries elsewhere, which is the place of this index.
fn moved(frame: &Frame, position: f64, place: usize) -> Setup {
    let mut other = frame.setups[0].clone();
    let before = other.carried[0];
    other.carried[0].position = position;
    if let Some(index) = other.sensors.iter().position(|sensor| *sensor == before) {
        other.sensors[index].position = position;
        other.places[index] = place;
    }
    let masses = &mut other.specimen.masses;
    let own = |mass: &&mut PointMass| mass.position == before.position && mass.mass == before.mass;
    if let Some(mass) = masses.iter_mut().find(own) {
        mass.position = position;
    }
    other
}

fn name_of(frame: &Frame) -> String {
    match &frame.nominal.sensors[..] {
        [one] => format!("sensor {}", one.name),
        _ => "one sensor".to_owned(),
    }
}

/// Whether it is one beam on a joint.
fn held_at_one_end(frame: &Frame) -> bool {
    let specimen = &frame.nominal.specimen;
    matches!(specimen.body, Body::One(_)) && !matches!(specimen.joint, SpecimenJoint::Free)
}

/// Mass of the beam or beams (kg).
pub(super) fn beam_mass(frame: &Frame) -> f64 {
    let beams = frame.nominal.specimen.body.beams();
    beams.iter().map(tapjoint_beam::Beam::mass).sum()
}

/// To 1, 1.5, 2, 3, 5 or 7 times a power of ten (kg).
fn round_mass(mass: f64) -> f64 {
    let decade = 10.0_f64.powf(mass.log10().floor());
    let near = |a: &f64, b: &f64| {
        let away = |step: f64| (step * decade / mass).ln().abs();
        away(*a).total_cmp(&away(*b))
    };
    let steps = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0];
    steps.into_iter().min_by(near).unwrap_or(1.0) * decade
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_known_masses_are_such_as_a_laboratory_has() {
        let rounded: Vec<f64> = [0.0166, 0.0012, 0.00044, 1.3]
            .into_iter()
            .map(|mass| 1e3 * round_mass(mass))
            .collect();
        for (found, expected) in rounded.iter().zip([15.0, 1.0, 0.5, 1500.0]) {
            assert!((found / expected - 1.0_f64).abs() < 1e-12, "{rounded:?}");
        }
    }
}
