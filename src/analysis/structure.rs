//! The tested structure: from its description, for the consistent estimate and for predictions.

use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::{Joint, PointMass, Specimen};
use tapjoint_beam::{Assembly, Beam, BeamTheory, JointStiffness, MODE_LIMIT, StructureError};
use tapjoint_description::{
    FitParameter, FreeFrequencies, JointModel, RecordingDescription, SensorKind,
    StandardUncertainty, TestDescription, Weights,
};
use tapjoint_description::{described_beam, lap_layout};
use tapjoint_identify::consistent::{
    AttachmentTolerance, BeamTolerances, ConsistentEstimator, ConsistentSettings, FrequencyModel,
    JointedStructure, LapLayout, MovedClamp, Parameter, ResidualWeights, WeighedBeam,
};
use tapjoint_identify::predict::compare;
use tapjoint_identify::{IdentifyError, MeasuredMode, PairsModel, PredictedMode};

/// The described structure in the theory's terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestedStructure {
    /// The beam.
    pub beam: Beam,
    /// Kind of structure.
    pub assembly: Assembly,
    /// Beam theory of the prediction.
    pub theory: BeamTheory,
    /// Form of the pair regression; `None` for a free beam.
    pub regression: Option<PairsModel>,
    /// Known stiffnesses (1), which are compared instead of fitted.
    pub known: KnownJoint,
}

/// Stiffnesses that the description gives, non-dimensional; infinite = rigid.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct KnownJoint {
    /// Kx (1).
    pub kx: Option<f64>,
    /// Ky (1).
    pub ky: Option<f64>,
    /// 1/Kz (1).
    pub cross_compliance: Option<f64>,
}

impl KnownJoint {
    /// Returns true if any stiffness is known.
    pub fn any(&self) -> bool {
        self.kx.is_some() || self.ky.is_some() || self.cross_compliance.is_some()
    }

    /// `joint`, with what is known in the place of its stiffnesses.
    pub fn over(&self, joint: Option<JointStiffness>) -> Option<JointStiffness> {
        Some(JointStiffness {
            kx: self.kx.or(joint.map(|joint| joint.kx))?,
            ky: self.ky.or(joint.map(|joint| joint.ky))?,
            cross_compliance: self
                .cross_compliance
                .or(joint.map(|joint| joint.cross_compliance))
                .unwrap_or(0.0),
        })
    }
}

/// The structure that a test description describes.
pub fn tested_structure(test: &TestDescription) -> TestedStructure {
    let beam = described_beam(test);
    let units = StiffnessUnits::of(&beam);
    TestedStructure {
        beam,
        assembly: test.joint.kind,
        theory: test.joint.beam,
        regression: match (test.joint.kind, test.joint.model) {
            (Assembly::Free, _) => None,
            (Assembly::Lap, _) => Some(PairsModel::Lap),
            (Assembly::Cantilever, JointModel::TwoParameter) => Some(PairsModel::TwoParameter),
            (Assembly::Cantilever, JointModel::ThreeParameter) => Some(PairsModel::ThreeParameter),
        },
        known: KnownJoint {
            kx: test.joint.kt.map(|kt| kt / units.kt),
            ky: test.joint.kr.map(|kr| kr / units.kr),
            cross_compliance: test.joint.ktr.map(|ktr| units.ktr / ktr),
        },
    }
}

/// A spring stated as absent (1): below every stiffness that a frequency feels, and with a logarithm.
pub(super) const NO_SPRING: f64 = 1e-9;

/// Relative standard uncertainty of a density that only the bar's weight tells: as good as none.
const UNKNOWN_DENSITY: f64 = 1.0;

/// Details of the structure beyond the plain beam with its joint.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StructureDetails {
    /// Differences of a lap joint's halves from two equal pieces.
    pub lap: LapLayout,
    /// Masses (kg) of the sensors, where they sit in the reference configuration, and what is fastened there.
    pub masses: Vec<PointMass>,
    /// Relative standard uncertainties of the beam's properties.
    pub tolerances: BeamTolerances,
    /// Standard uncertainties of the masses, in their order.
    pub attachments: Vec<AttachmentTolerance>,
    /// The bare bar on a balance.
    pub weighed: Option<WeighedBeam>,
    /// True where the bar is longer than the beam: the clamp holds a part of it.
    pub is_longer: bool,
    /// The bar without its joint, with its frequencies.
    pub free: Option<MovedClamp>,
    /// True where the model itself may miss the frequencies.
    pub discrepancy: bool,
    /// Standard uncertainties that the description does not state: name and value in words.
    pub assumed: Vec<(&'static str, String)>,
    /// Parameters that are estimated; `None` = the joint's stiffnesses that are not known, free beam: modulus.
    pub fit: Option<Vec<FitParameter>>,
    /// Weights; `None` = measured where every uncertainty is known.
    pub weights: Option<Weights>,
}

impl StructureDetails {
    /// Returns the same structure, known exactly, with a model that misses nothing: what the readings say alone.
    #[must_use]
    pub fn exact(&self) -> Self {
        Self {
            tolerances: BeamTolerances::default(),
            attachments: Vec::new(),
            weighed: None,
            free: None,
            discrepancy: false,
            assumed: Vec::new(),
            ..self.clone()
        }
    }

    /// Returns the relative standard uncertainty of all frequencies by that of the beam; `None` of an exact description.
    ///
    /// f is proportional to h/L^2 sqrt(E/rho). A density that the weight m tells is m/(L b h), so that f goes with
    /// h^1.5 L^-1.5 sqrt(E b/m). Where a longer bar was weighed, L^-2 stays.
    pub fn scale_std(&self) -> Option<f64> {
        let known = &self.tolerances;
        let weighed = self
            .weighed
            .filter(|_| known.density == Some(UNKNOWN_DENSITY));
        let shares = match weighed {
            None => [
                (known.modulus, 0.5),
                (known.density, 0.5),
                (known.thickness, 1.0),
                (known.length, 2.0),
                (None, 0.0),
            ],
            Some(weighed) => [
                (known.modulus, 0.5),
                (Some(weighed.std / weighed.mass), 0.5),
                (known.thickness, 1.5),
                (known.length, if self.is_longer { 2.0 } else { 1.5 }),
                (known.width, 0.5),
            ],
        };
        let shares = shares.map(|(share, power)| (power * share.unwrap_or(0.0)).powi(2));
        let std = shares.iter().sum::<f64>().sqrt();
        (std > 0.0).then_some(std)
    }
}

/// The details of a described test.
pub fn structure_details(test: &TestDescription, beam: &Beam) -> StructureDetails {
    let tolerance = &test.beam.tolerance;
    let share = |known: StandardUncertainty, value: f64| {
        Some(known.std / value).filter(|share| *share > 0.0)
    };
    let density = match test.beam.density_stated {
        true => share(tolerance.density, beam.density),
        // The weight alone says it.
        false => Some(UNKNOWN_DENSITY),
    };
    let loads = loads_in(test, test.reference_recording());
    let bar_length = test.beam.bar_length.unwrap_or(beam.length);
    StructureDetails {
        lap: lap_layout(test),
        attachments: loads
            .iter()
            .map(|(name, load)| AttachmentTolerance {
                name: name.clone(),
                mass: tolerance.masses.std * load.mass,
                position: tolerance.positions.std,
            })
            .collect(),
        masses: loads.into_iter().map(|(_, load)| load).collect(),
        tolerances: BeamTolerances {
            length: share(tolerance.length, beam.length),
            width: share(tolerance.width, beam.width),
            thickness: share(tolerance.thickness, beam.thickness),
            modulus: share(tolerance.modulus, beam.modulus),
            density,
            poisson: share(tolerance.poisson, 1.0),
        },
        weighed: test.beam.weighed.map(|weighed| WeighedBeam {
            mass: weighed.mass,
            std: weighed.std,
            length: bar_length,
        }),
        is_longer: test.beam.bar_length.is_some(),
        free: test
            .beam
            .free
            .as_ref()
            .map(|free| free_bar(test, beam, free, bar_length)),
        discrepancy: true,
        assumed: tolerance.assumed(&test.beam),
        fit: test.analysis.fit.clone(),
        weights: test.analysis.weights,
    }
}

/// The bare bar without its joint, of this length (m), with its frequencies.
fn free_bar(
    test: &TestDescription,
    beam: &Beam,
    free: &FreeFrequencies,
    length: f64,
) -> MovedClamp {
    let bar = Beam { length, ..*beam };
    let modes = (1..).zip(free.frequencies.iter().zip(&free.stds));
    MovedClamp {
        structure: JointedStructure::new(test.joint.beam, bar, Assembly::Free),
        modes: modes
            .map(|(mode, (frequency, std))| MeasuredMode {
                mode,
                frequency: *frequency,
                std: Some(*std),
            })
            .collect(),
        attachments: Vec::new(),
    }
}

/// Masses on the beam in a recording: sensors whose mass and place are known, and what is
/// fastened. A microphone loads nothing.
pub(super) fn masses_in(
    test: &TestDescription,
    recording: Option<&RecordingDescription>,
) -> Vec<PointMass> {
    let loads = loads_in(test, recording).into_iter();
    loads.map(|(_, load)| load).collect()
}

/// The masses of [`masses_in`] with their names in the budget.
fn loads_in(
    test: &TestDescription,
    recording: Option<&RecordingDescription>,
) -> Vec<(String, PointMass)> {
    let sensors = test.sensors.iter().filter(|sensor| {
        test.analysis.sensor_mass && sensor.kind != SensorKind::Sound && sensor.mass > Some(0.0)
    });
    let sensors = sensors.filter_map(|sensor| {
        let load = PointMass {
            position: recording.map_or(sensor.position, |one| one.place_of(sensor))?,
            mass: sensor.mass?,
            inertia: 0.0,
        };
        Some((sensor.name.clone(), load))
    });
    let fastened = recording.into_iter().flat_map(|one| &one.masses);
    let fastened = (1..).zip(fastened);
    let fastened = fastened.map(|(number, load)| (format!("fastened mass {number}"), *load));
    sensors.chain(fastened).collect()
}

/// The structure that the estimator takes.
pub fn jointed(structure: &TestedStructure, details: &StructureDetails) -> JointedStructure {
    let mut jointed = JointedStructure::new(structure.theory, structure.beam, structure.assembly);
    if structure.assembly == Assembly::Lap {
        jointed.lap = details.lap;
    }
    jointed.masses = details.masses.clone();
    jointed
}

/// Parameters that are estimated: those the description names, else all of the joint that are not known.
pub(super) fn fitted(structure: &TestedStructure, details: &StructureDetails) -> Vec<Parameter> {
    if let Some(fit) = &details.fit {
        let named = fit.iter().map(|parameter| match parameter {
            FitParameter::Kt => Parameter::Kt,
            FitParameter::Kr => Parameter::Kr,
            FitParameter::Ktr => Parameter::Coupling,
            FitParameter::Modulus => Parameter::Modulus,
            FitParameter::Density => Parameter::Density,
        });
        return named.collect();
    }
    let Some(model) = structure.regression else {
        return vec![Parameter::Modulus];
    };
    let known = &structure.known;
    let mut fit = Vec::new();
    fit.extend(known.kx.is_none().then_some(Parameter::Kt));
    fit.extend(known.ky.is_none().then_some(Parameter::Kr));
    if model == PairsModel::ThreeParameter && known.cross_compliance.is_none() {
        fit.push(Parameter::Coupling);
    }
    fit
}

fn settings(
    structure: &TestedStructure,
    details: &StructureDetails,
    used: &[MeasuredMode],
    moved: &[MovedClamp],
) -> ConsistentSettings {
    let fit = fitted(structure, details);
    let units = StiffnessUnits::of(&structure.beam);
    let known = &structure.known;
    let of_lengths = moved.iter().flat_map(|moved| &moved.modes);
    let all_known = used
        .iter()
        .chain(of_lengths)
        .all(|mode| mode.std.is_some_and(|std| std > 0.0));
    ConsistentSettings {
        held: Joint {
            kt: (known.kx).map_or(f64::INFINITY, |kx| kx.max(NO_SPRING) * units.kt),
            kr: (known.ky).map_or(f64::INFINITY, |ky| ky.max(NO_SPRING) * units.kr),
            coupling: known
                .over(None)
                .map(|joint| joint.coupling())
                .filter(|coupling| coupling.is_finite())
                .unwrap_or(0.0),
        },
        weights: match details.weights {
            Some(Weights::Relative) => ResidualWeights::Relative,
            _ if !all_known => ResidualWeights::Relative,
            _ => ResidualWeights::Measured,
        },
        tolerances: details.tolerances,
        attachments: details.attachments.clone(),
        weighed: details.weighed,
        discrepancy: details.discrepancy,
        ..ConsistentSettings::fitting(&fit)
    }
}

/// The estimator by least squares on the frequencies of these modes.
pub(super) fn estimator(
    structure: &TestedStructure,
    details: &StructureDetails,
    used: &[MeasuredMode],
) -> Result<ConsistentEstimator, IdentifyError> {
    estimator_of_lengths(structure, details, used, &[])
}

/// The estimator by least squares on the frequencies of these modes, on those of the beam where its clamp was
/// moved, and on those of the free bar.
pub(super) fn estimator_of_lengths(
    structure: &TestedStructure,
    details: &StructureDetails,
    used: &[MeasuredMode],
    moved: &[MovedClamp],
) -> Result<ConsistentEstimator, IdentifyError> {
    let jointed = jointed(structure, details);
    let mut settings = settings(structure, details, used, moved);
    // Without uncertainties nothing of the beam is fitted along, and the free bar would tell nothing.
    let free = details.free.as_slice();
    let free = match settings.weights {
        ResidualWeights::Measured => free,
        ResidualWeights::Relative => &[],
    };
    let moved = &[moved, free].concat();
    hold_cross_stiffness(structure, &jointed, used, moved, &mut settings)?;
    ConsistentEstimator::of_lengths(&jointed, used, moved, &settings)
}

/// A known Ktr beside a fitted Kt or Kr: the estimator holds couplings, sqrt(Kt Kr)/Ktr, so that
/// this one follows the fit until it stands still.
fn hold_cross_stiffness(
    structure: &TestedStructure,
    jointed: &JointedStructure,
    used: &[MeasuredMode],
    moved: &[MovedClamp],
    settings: &mut ConsistentSettings,
) -> Result<(), IdentifyError> {
    // Each round reduces the error by the coupling's small share in the frequencies.
    const ROUNDS: usize = 50;
    const STILL: f64 = 1e-10;
    // No joint has a coupling of 1 or more.
    const LARGEST: f64 = 0.999_999;
    let known = &structure.known;
    let fitted = known.kx.is_none() || known.ky.is_none();
    let Some(cross) = known.cross_compliance.filter(|c| fitted && *c != 0.0) else {
        return Ok(());
    };
    let units = StiffnessUnits::of(&structure.beam);
    let mut held = 0.0f64;
    for _ in 0..ROUNDS {
        settings.held.coupling = held;
        let fit = ConsistentEstimator::of_lengths(jointed, used, moved, settings)?.fit();
        // sqrt(Kt Kr)/Ktr in SI: a beam that is fitted too has other units than the nominal one.
        let kx = fit.point[Parameter::Kt as usize].exp() / units.kt;
        let ky = fit.point[Parameter::Kr as usize].exp() / units.kr;
        let next = (cross * (kx * ky).sqrt()).clamp(-LARGEST, LARGEST);
        let moved = (next - held).abs();
        held = next;
        if moved.is_nan() || moved <= STILL {
            break;
        }
    }
    settings.held.coupling = held;
    Ok(())
}

/// Frequencies of the described structure on this joint (non-dimensional), with everything that is
/// fastened to it.
///
/// # Errors
/// [`IdentifyError::Structure`] where structure or joint cannot exist.
pub fn predict_described(
    structure: &TestedStructure,
    details: &StructureDetails,
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<PredictedMode>, IdentifyError> {
    joint.check()?;
    let there = jointed(structure, details).with_beam(&structure.beam);
    let frequencies = frequencies_of(&there, joint, count)?;
    Ok(compare(&structure.beam, &frequencies, &[], &[]))
}

/// The first natural frequencies (Hz) of a structure on this joint, non-dimensional by its beam.
///
/// # Errors
/// [`IdentifyError::Structure`] where the structure cannot exist, and beyond [`MODE_LIMIT`] modes.
pub fn frequencies_of(
    there: &JointedStructure,
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<f64>, IdentifyError> {
    if count > MODE_LIMIT {
        return Err(StructureError::TooManyModes { count }.into());
    }
    let model = FrequencyModel::new(there, count)?;
    let units = StiffnessUnits::of(&there.beam);
    let mut point = model.nominal();
    if there.assembly != Assembly::Free {
        point[Parameter::Kt as usize] = (joint.kx.max(NO_SPRING) * units.kt).ln();
        point[Parameter::Kr as usize] = (joint.ky.max(NO_SPRING) * units.kr).ln();
        let coupling = joint.coupling();
        let coupling = if coupling.is_finite() { coupling } else { 0.0 };
        point[Parameter::Coupling as usize] = coupling.atanh();
    }
    Ok((1..=count)
        .map(|mode| model.response(&point, mode, mode as f64).frequency)
        .collect())
}

/// The structure of a prediction with this beam on this joint; `details` as for the prediction.
pub(super) fn predicted_specimen(
    structure: &TestedStructure,
    details: &StructureDetails,
    beam: &Beam,
    joint: &JointStiffness,
) -> Specimen {
    let there = jointed(structure, details).with_beam(beam);
    let units = StiffnessUnits::of(beam);
    let held = match structure.assembly {
        Assembly::Free => None,
        Assembly::Cantilever | Assembly::Lap => Some(Joint {
            kt: joint.kx * units.kt,
            kr: joint.ky * units.kr,
            coupling: joint.coupling(),
        }),
    };
    there.specimen(held)
}
