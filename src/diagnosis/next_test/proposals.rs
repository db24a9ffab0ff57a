//! Tests that are compared, as configurations that the model can predict, and their description in words.

use crate::dataset::{Dataset, MORE_MODES, Observable};
use crate::description::SectionSlopes;
use crate::parameters::{CandidateEffect, NuisanceParameter};
use crate::result::Proposal;
use crate::structure::{Arrangement, ROTATION};
use tapjoint_beam::effects::EffectId;
use tapjoint_numerics::stats::median;

/// Test with the data that it would bring.
#[derive(Debug, Clone)]
pub struct PlannedTest {
    /// The test.
    pub proposal: Proposal,
    /// Structure whose frequencies it measures.
    pub structure: TestedStructure,
    /// Logarithms of the frequencies; none for quantities that are measured without the beam's vibration.
    pub frequencies: Planned,
}

/// Observables with the standard uncertainties of their planned data.
pub type Planned = Vec<(Observable, f64)>;

/// Structure whose frequencies are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestedStructure {
    /// The tested structure.
    Whole,
    /// The tested structure, its frequencies read without bias.
    Unbiased,
    /// The beam alone.
    Bare,
}

impl TestedStructure {
    /// All of them, in their order.
    pub const ALL: [Self; 3] = [Self::Whole, Self::Unbiased, Self::Bare];

    /// Returns whether an effect changes its frequencies.
    pub fn shows(self, effect: &CandidateEffect) -> bool {
        match self {
            TestedStructure::Whole => true,
            TestedStructure::Unbiased => !effect.is(EffectId::Resolution),
            TestedStructure::Bare => {
                use EffectId::{AddedMass, Length, LocalCrack, Modulus, ShearRotary, Timebase};
                let shown = [
                    Modulus,
                    Length,
                    Timebase,
                    AddedMass,
                    LocalCrack,
                    ShearRotary,
                ];
                effect.effect().is_some_and(|id| shown.contains(&id))
            }
        }
    }
}

impl PlannedTest {
    /// Returns its frequencies if they are those of this structure.
    pub fn frequencies_of(&self, wanted: TestedStructure) -> &[(Observable, f64)] {
        if self.structure == wanted {
            &self.frequencies
        } else {
            &[]
        }
    }
}

/// All tests that could be made with this structure.
pub struct PlannedTests {
    /// The tests.
    pub all: Vec<PlannedTest>,
    /// Existing and planned configurations.
    pub whole: Dataset,
    /// Index of the first nuisance parameter that was added for a planned test. The spread of a drift is its least one.
    pub first_added: usize,
    /// The beam alone.
    pub bare: Option<Dataset>,
    /// Configuration in which gravity is turned over.
    pub turned: Option<usize>,
}

/// Existing configurations that are kept to be read again.
const KEPT_CONFIGURATIONS: usize = 4;
/// Positions to which a sensor might be moved, over the length.
const SENSOR_POSITIONS: [f64; 5] = [0.3, 0.45, 0.6, 0.75, 0.95];
/// Known mass over the beam's: 2 % moves frequencies by up to 4 %, a hundred times their uncertainty.
const KNOWN_MASS: f64 = 0.02;
/// Standard deviation of a joint that was tightened again (1).
const RETIGHTENED: f64 = 0.02;
/// Tap levels over that of the hardest recording.
const TAP_LEVELS: [f64; 2] = [0.25, 3.0];
/// Fits have this share of the bias that reading on lines may have.
const FIT_BIAS: f64 = 0.1;

impl PlannedTests {
    /// Returns the tests that could be made next.
    pub fn new(dataset: &Dataset) -> Self {
        let mut whole = dataset.clone();
        whole.arrangements.truncate(KEPT_CONFIGURATIONS);
        // The common scatter of other taps does not hold for planned ones.
        whole.scatter.retain(|of, _| of.0 < KEPT_CONFIGURATIONS);
        whole.modes += MORE_MODES;
        whole.observables.clear();
        whole.data.clear();
        whole.shape_slopes = None;
        let mut planned = PlannedTests {
            all: Vec::new(),
            whole,
            first_added: dataset.nuisances.len(),
            bare: None,
            turned: None,
        };
        planned.read_again(dataset);
        planned.tap_again(dataset);
        planned.move_sensor(dataset);
        planned.fasten_mass(dataset);
        planned.turn_and_take_apart(dataset);
        for proposal in [
            Proposal::WeighSensor,
            Proposal::Calipers,
            Proposal::ReferenceTone,
        ] {
            planned.propose(proposal, TestedStructure::Whole, Vec::new());
        }
        planned
    }

    fn propose(&mut self, proposal: Proposal, structure: TestedStructure, frequencies: Planned) {
        self.all.push(PlannedTest {
            proposal,
            structure,
            frequencies,
        });
    }

    /// Plans to read the recordings again: higher modes, and on finer lines.
    fn read_again(&mut self, dataset: &Dataset) {
        let (first, last) = (dataset.modes + 1, dataset.modes + MORE_MODES);
        if last <= dataset.settings.highest_mode {
            let configurations = 0..self.whole.arrangements.len();
            let planned = configurations.flat_map(|one| frequencies_of(dataset, one, first..=last));
            let proposal = Proposal::HigherModes {
                first,
                last,
                is_recorded: dataset.arrangements.iter().any(|one| one.is_recorded),
            };
            self.propose(proposal, TestedStructure::Whole, planned.collect());
        }
        if let Some(bias) = dataset.nominal.reading_bias {
            let modes = observed_modes(dataset);
            let planned = modes.map(|mode| {
                let mut std = std_of(dataset, mode);
                let mut frequencies = dataset.frequencies();
                let own = frequencies.find(|&row| dataset.observables[row].mode == mode);
                // Without the part of reading on lines, b/sqrt 3.
                if let Some(own) = own {
                    let line = bias / 3.0_f64.sqrt() / dataset.data[own].value.exp();
                    let rest = (std * std - line * line).max(0.0);
                    std = (rest + (FIT_BIAS * line).powi(2)).sqrt();
                }
                (Observable::frequency(0, mode), std)
            });
            let spacing = 2.0 * FIT_BIAS * bias;
            let proposal = Proposal::FinerLines { spacing };
            self.propose(proposal, TestedStructure::Unbiased, planned.collect());
        }
    }

    /// Plans to repeat the first recording: more taps, other levels, a joint that was opened.
    fn tap_again(&mut self, dataset: &Dataset) {
        let again = dataset.arrangements[0].clone();
        let mut planned = self.new_setup(dataset, again.clone(), 0.0);
        for (_, std) in &mut planned {
            *std *= 0.5;
        }
        let more = Proposal::MoreTaps { factor: 4 };
        self.propose(more, TestedStructure::Whole, planned);
        let all = dataset.arrangements.iter();
        let hardest = all.max_by(|a, b| a.level.total_cmp(&b.level));
        if dataset.nominal.fits(ROTATION) {
            for level in TAP_LEVELS {
                let mut other = hardest.unwrap_or(&again).clone();
                other.level *= level;
                other.joint_motion = other.joint_motion.map(|motion| motion.over(1.0 / level));
                let planned = self.new_setup(dataset, other, 0.0);
                let proposal = Proposal::TapLevel { level };
                self.propose(proposal, TestedStructure::Whole, planned);
            }
        }
        if !dataset.nominal.joint_parameters().is_empty() {
            let planned = self.new_setup(dataset, again, RETIGHTENED);
            self.propose(Proposal::Retighten, TestedStructure::Whole, planned);
        }
    }

    /// Plans to move a sensor to positions where none was.
    fn move_sensor(&mut self, dataset: &Dataset) {
        let length = dataset.nominal.length();
        let moved = dataset.settings.thresholds.moved_sensor * length;
        if dataset.arrangements[0].carried.is_empty() {
            return;
        }
        let name = match &dataset.nominal.sensors[..] {
            [one] => format!("sensor {}", one.name),
            _ => "one sensor".to_owned(),
        };
        for position in SENSOR_POSITIONS.map(|share| share * length) {
            let mut sensors = dataset.arrangements.iter().flat_map(|one| &one.carried);
            if sensors.any(|sensor| (sensor.position - position).abs() < moved) {
                continue;
            }
            // Its new position is another parameter.
            let used = self.highest(dataset, |one| one.positions.iter().copied().max());
            let index = used.map_or(0, |most| most + 1);
            let parameter = NuisanceParameter::SensorPosition { position: index };
            self.whole
                .add_nuisance(parameter, 0.0, dataset.nominal.uncertainty.positions);
            let mut moved = dataset.arrangements[0].clone();
            moved.move_sensor(position, index);
            let planned = self.new_setup(dataset, moved, 0.0);
            let name = name.clone();
            let proposal = Proposal::MoveSensor { name, position };
            self.propose(proposal, TestedStructure::Whole, planned);
        }
    }

    /// Plans to fasten a known mass at the tip and in the middle.
    fn fasten_mass(&mut self, dataset: &Dataset) {
        let length = dataset.nominal.length();
        let mass = round_mass(KNOWN_MASS * dataset.nominal.beam_mass());
        for position in [length, 0.5 * length] {
            let used = self.highest(dataset, |one| one.fastened.iter().map(|one| one.0).max());
            let fastened = used.map_or(0, |most| most + 1);
            self.whole.add_fastened(fastened);
            let mut heavier = dataset.arrangements[0].clone();
            heavier.fasten(mass, position, fastened);
            let planned = self.new_setup(dataset, heavier, 0.0);
            let proposal = Proposal::KnownMass { mass, position };
            self.propose(proposal, TestedStructure::Whole, planned);
        }
    }

    /// Plans to turn one beam on a joint over, and to test the beam alone.
    fn turn_and_take_apart(&mut self, dataset: &Dataset) {
        if !(dataset.nominal.is_one_beam() && dataset.nominal.has_joint()) {
            return;
        }
        let first = &dataset.arrangements[0];
        self.turned = Some(self.whole.arrangements.len());
        let planned = self.new_setup(dataset, first.clone(), 0.0);
        self.propose(Proposal::TurnOver, TestedStructure::Whole, planned);
        let nominal = self.whole.nominal.bare();
        let mut bare = Dataset {
            arrangements: vec![first.bare(&nominal)],
            nominal,
            // These are of the modes in the joint.
            section: SectionSlopes::default(),
            ..self.whole.clone()
        };
        // The model misses the free beam's modes independently. No mode has the number 0.
        for nuisance in &mut bare.nuisances {
            if let NuisanceParameter::Discrepancy { mode } = &mut nuisance.parameter {
                *mode = 0;
            }
        }
        let planned = planned_frequencies(dataset, 0);
        self.propose(Proposal::BareBeam, TestedStructure::Bare, planned);
        self.bare = Some(bare);
    }

    /// Returns the highest index that an existing or planned configuration has.
    fn highest(
        &self,
        dataset: &Dataset,
        index_of: impl Fn(&Arrangement) -> Option<usize>,
    ) -> Option<usize> {
        let all = self.whole.arrangements.iter().chain(&dataset.arrangements);
        all.filter_map(index_of).max()
    }

    /// Adds a set-up with its own drift and temperature; returns its frequencies.
    fn new_setup(&mut self, dataset: &Dataset, mut one: Arrangement, drift: f64) -> Planned {
        let setup = 1 + self.highest(dataset, |one| Some(one.setup)).unwrap_or(0);
        one.setup = setup;
        for direction in dataset.nominal.fitted_springs() {
            let parameter = NuisanceParameter::Drift { setup, direction };
            self.whole.add_nuisance(parameter, 0.0, drift);
        }
        let temperature = NuisanceParameter::Temperature { setup };
        let std = dataset.settings.temperature_std;
        self.whole.add_nuisance(temperature, 0.0, std);
        self.whole.arrangements.push(one);
        planned_frequencies(dataset, self.whole.arrangements.len() - 1)
    }
}

/// Returns the frequencies of all observed modes in a configuration, as uncertain as so far.
fn planned_frequencies(dataset: &Dataset, configuration: usize) -> Planned {
    frequencies_of(dataset, configuration, observed_modes(dataset)).collect()
}

/// Returns the frequencies of some modes in a configuration, as uncertain as so far.
fn frequencies_of(
    dataset: &Dataset,
    configuration: usize,
    modes: impl Iterator<Item = usize>,
) -> impl Iterator<Item = (Observable, f64)> {
    modes.map(move |mode| {
        let frequency = Observable::frequency(configuration, mode);
        (frequency, std_of(dataset, mode))
    })
}

/// Returns the numbers of the modes that take part in the fit.
fn observed_modes(dataset: &Dataset) -> impl Iterator<Item = usize> + '_ {
    (1..=dataset.fitted_modes).filter(|mode| !stds_of(dataset, *mode).is_empty())
}

/// Returns the standard uncertainties of the frequencies of a mode (1).
fn stds_of(dataset: &Dataset, wanted: usize) -> Vec<f64> {
    let fitted = dataset.observables.iter().zip(&dataset.data);
    let held_out = dataset.holdout.iter().map(|(one, datum)| (one, datum));
    let all = fitted.chain(held_out);
    let own = all.filter(|(one, _)| one.is_frequency() && one.mode == wanted);
    own.map(|(_, datum)| datum.std).collect()
}

/// Returns the standard uncertainty with which a mode's frequency will be measured (1): as so far, higher modes as the
/// highest.
fn std_of(dataset: &Dataset, mode: usize) -> f64 {
    let mut all = (1..=mode).rev().map(|mode| stds_of(dataset, mode));
    let known = all.find(|stds| !stds.is_empty());
    known.map_or(1e-3, |mut stds| median(&mut stds))
}

/// Returns 1, 1.5, 2, 3, 5 or 7 times a power of ten, the nearest to a mass (kg).
fn round_mass(mass: f64) -> f64 {
    let decade = 10.0_f64.powf(mass.log10().floor());
    let steps = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0];
    let distances = steps.map(|step| ((step * decade / mass).ln().abs(), step));
    let nearest = distances.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or(1.0, |(_, step)| step) * decade
}

/// Describes a test in one sentence, without its full stop.
pub fn sentence(proposal: &Proposal) -> String {
    match proposal {
        Proposal::HigherModes {
            first,
            last,
            is_recorded,
        } => format!(
            "read modes {first} to {last} as well{}",
            match is_recorded {
                true => ", from the recordings at hand if their band reaches so far",
                false => "",
            }
        ),
        Proposal::FinerLines { spacing } => format!(
            "read the frequencies by a curve fit, or on lines of {spacing:.3} Hz or closer"
        ),
        Proposal::MoreTaps { factor } => format!(
            "repeat the first measurement with {factor} times as many taps, everything else untouched"
        ),
        Proposal::TapLevel { level } if *level < 1.0 => format!(
            "tap at {:.0} % of the force, everything else untouched",
            100.0 * level
        ),
        Proposal::TapLevel { level } => {
            format!("tap {level:.0} times as hard, everything else untouched")
        }
        Proposal::WeighSensor => {
            "weigh each sensor of unknown mass with its mounting and the cable that hangs on it to 0.5 g, and state it".into()
        }
        Proposal::Calipers => {
            "weigh the beam to 0.1 %, measure its thickness to 0.01 mm and its free length to 0.2 mm".into()
        }
        Proposal::ReferenceTone => {
            "record a tone of known frequency beside the taps and compare the clocks to 20 ppm".into()
        }
        Proposal::MoveSensor { name, position } => format!(
            "move {name} to {position:.3} m, leave everything else untouched, and tap again"
        ),
        Proposal::KnownMass { mass, position } => {
            // As "15 g" or "1.5 kg".
            let (size, unit) = if *mass < 1.0 { (1e3 * mass, "g") } else { (*mass, "kg") };
            let size = (1e3 * size).round() / 1e3;
            format!(
                "fasten {size} {unit} at {position:.3} m, leave everything else untouched, tap again, and \
                 describe that [[recording]] with mass = [{{ position = {position:.3}, mass = \"{size} {unit}\" }}]"
            )
        }
        Proposal::Confirm { effect } => confirming(*effect),
        Proposal::Retighten => {
            "loosen the joint, tighten it as before, and repeat the first recording".into()
        }
        Proposal::TurnOver => {
            "turn the set-up over, so that gravity pulls the other way along the beam, and tap again".into()
        }
        Proposal::BareBeam => {
            "take the beam out of its joint, lay it on soft foam without a sensor, and tap it with a \
             microphone beside it"
                .into()
        }
    }
}

/// Describes the test that shows a named cause directly, in one sentence without its full stop.
fn confirming(effect: EffectId) -> String {
    let text = match effect {
        // These tests separate causes as well.
        EffectId::SensorMass => return sentence(&Proposal::WeighSensor),
        EffectId::Modulus | EffectId::Length | EffectId::Density | EffectId::Thickness => {
            return sentence(&Proposal::Calipers);
        }
        EffectId::Timebase => return sentence(&Proposal::ReferenceTone),
        EffectId::SensorCable => {
            "lead the sensor's cable another way or take its support off, the joint untouched, and tap again"
        }
        EffectId::CrossCoupling => {
            "describe the joint with model = \"3p\", and see whether it predicts a mode that was left out"
        }
        EffectId::JointMass => {
            "weigh what moves with the joint (bolts, washers, overlap), or change it by a known mass, and tap again"
        }
        EffectId::JointNonlinearity => {
            "tap much softer and much harder with the joint untouched: the frequencies have to follow the level"
        }
        EffectId::JointDamping => {
            "tighten the joint or put a foil into it, and tap again: the damping has to follow"
        }
        EffectId::JointDrift => {
            "repeat the first recording twice, the joint untouched and then tightened again"
        }
        EffectId::Fixture => {
            "put a sensor on the base and tap the base: it has to show a mode at that frequency"
        }
        EffectId::AddedMass => {
            "look at the place that was found, take off what is fastened there, and tap again"
        }
        EffectId::LocalCrack => {
            "look at the place that was found (magnifier, dye), or tap a sound beam in the same joint"
        }
        EffectId::AxialLoad => {
            "free the beam of what pulls or presses it along its axis, or turn the set-up over, and tap again"
        }
        EffectId::ShearRotary => {
            "describe the beam with shear, rotary inertia and width (beam = \"timoshenko\" in [joint]), and diagnose again"
        }
        EffectId::Resolution => "read the frequencies by a curve fit, or on closer lines",
        EffectId::JointCompliance => {
            "leave kt and kr out of [joint], so that the joint's stiffnesses are estimated, and diagnose again"
        }
        EffectId::SensorPosition => "measure where the sensor sits, and diagnose again",
        EffectId::SensorPolarity => {
            "look which way the sensor points, turn it or give it a negative scale, and diagnose again"
        }
        EffectId::SensorSwap => "follow both cables to their channels, and diagnose again",
        EffectId::SensorScale => {
            "compare the sensor's calibration sheet with its scale, or shake it with a calibrator"
        }
        EffectId::TapPosition => "measure where the hammer strikes, and diagnose again",
    };
    text.into()
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
