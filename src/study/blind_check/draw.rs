//! Draws virtual tests (a structure, a plan of recordings, and an effect that its description leaves out)
//! and records them.
//!
//! All tests of a campaign look alike from outside: a cantilever, described as an Euler beam with two springs and
//! sensors without mass. The description thus does not give the effect away. Sizes are drawn from small to large as a
//! test engineer meets them, positions off any grid.

use super::case::{CaseKind, Extent, Planted, Truth};
use super::planted_effects::{
    Fastened, GROUPS, OutOfCatalogueKind, draw_effect, log_uniform, normal,
};
use crate::plan::{PlanError, PlanSettings, plan_of};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tapjoint_analysis::nominal_with;
use tapjoint_beam::effects::{Effect, EffectError, EffectId};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{
    Assembly, Beam, BeamTheory, JointStiffness, StructureError, natural_frequencies,
};
use tapjoint_description::{DescriptionError, TestDescription};
use tapjoint_diagnosis::{
    DETECTABLE, GapError, GapSettings, Hypothesis, diagnose, nominal_chi_square, observe,
};
use tapjoint_identify::consistent::Parameter;
use tapjoint_numerics::stats::{chi_square_quantile, root_mean_square};
use tapjoint_simulate::{
    Damping, Laboratory, SimulateError, TestPlan, VirtualRecording, add_noise, below,
    nominal_description, plan_test,
};

/// A blind check to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// Tests with one effect of the catalogue, dealt out evenly over its groups.
    pub singles: usize,
    /// Tests with nothing.
    pub nulls: usize,
    /// Tests with something outside the catalogue.
    pub outside: usize,
    /// Tests with two effects.
    pub pairs: usize,
    /// Recordings of each test.
    pub extent: Extent,
    /// Noise of the responses below their root mean square (dB). 60.
    pub noise_db: f64,
    /// Largest standard deviation of the joint's drift between recordings (1). Each test draws its own up to it, and
    /// its description does not state it. 0.01.
    pub drift: f64,
    /// Seed of everything.
    pub seed: u64,
}

impl Default for Campaign {
    fn default() -> Self {
        Self {
            singles: 300,
            nulls: 150,
            outside: 60,
            pairs: 60,
            extent: Extent::FiveRecordings,
            noise_db: 60.0,
            drift: 0.01,
            seed: 1,
        }
    }
}

/// Content of a test of a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Plant {
    Single(usize),
    Nothing,
    OutOfCatalogue(usize),
    Pair,
}

/// A test drawn but not yet recorded.
#[derive(Debug, Clone)]
pub struct DrawnTest {
    /// Its description with the joint's stiffnesses, which the diagnosis does not see.
    pub text: String,
    /// The description, read.
    pub description: TestDescription,
    /// The effects, the joint's drift among them.
    pub effects: Vec<Effect>,
    /// Faults that no effect of the catalogue describes.
    pub fastened: Fastened,
    /// The laboratory that records it.
    pub laboratory: Laboratory,
    /// Noise of the responses below their root mean square (dB).
    pub noise_db: f64,
    /// Modes in its band.
    pub modes: usize,
    /// The planted effects.
    pub truth: Truth,
    /// Seed of the recording.
    pub seed: u64,
}

/// The input of the diagnosis: recordings, and the description without the truth.
#[derive(Debug, Clone)]
pub struct RecordedTest {
    /// The description's text.
    pub description: String,
    /// The recordings.
    pub recordings: Vec<Recorded>,
}

/// One recording.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// Its file's name.
    pub file: String,
    /// Sample rate (Hz).
    pub sample_rate: u32,
    /// The channels, in units of the file.
    pub channels: Vec<Vec<f64>>,
}

/// Noise of the hammer's channel lies so far below that of the responses, seen from the peak (dB).
const FORCE_MARGIN_DB: f64 = 20.0;

/// A reason for which a test cannot be drawn or recorded: a defect of this module.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// The drawn description cannot be read.
    #[error("a drawn description cannot be read: {0}")]
    Description(#[from] DescriptionError),
    /// A drawn effect is out of its range.
    #[error("a drawn effect cannot be: {0}")]
    Effect(#[from] EffectError),
    /// A drawn structure cannot be.
    #[error("a drawn structure cannot be: {0}")]
    Structure(#[from] StructureError),
    /// The test cannot be simulated.
    #[error("a drawn test cannot be simulated: {0}")]
    Simulate(#[from] SimulateError),
    /// A drawn test is no plan.
    #[error("the drawn test cannot be planned: {0}")]
    Plan(#[from] PlanError),
    /// The limits of a drawn test cannot be computed.
    #[error("the limits of a drawn test cannot be computed: {0}")]
    Limits(#[from] GapError),
    /// No drawn structure has enough modes within reach of the hammer.
    #[error("no structure could be drawn whose modes the hammer excites")]
    NoStructure,
    /// The nominal description cannot be written.
    #[error("a drawn description cannot be written: {0}")]
    Nominal(#[from] toml::de::Error),
}

impl Campaign {
    /// Number of tests.
    pub fn len(&self) -> usize {
        self.singles + self.nulls + self.outside + self.pairs
    }

    /// Returns true where there is no test.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Draws test number `index`, from 0. Kinds follow each other in a shuffled order, so that a
    /// test's number says nothing.
    ///
    /// # Errors
    /// [`DrawError`]: a defect of the drawing.
    pub fn draw(&self, index: usize) -> Result<DrawnTest, DrawError> {
        let plant = self.plants()[index];
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        // Stream 0 shuffles the kinds.
        random.set_stream(index as u64 + 1);
        let subject = Subject::draw(&mut random);
        let name = format!("test-{index:04}");
        let text = subject.describe(&name, self.extent, &mut random);
        let description = TestDescription::parse(&text, &name)?;
        // Errors of the set-up are drawn of the described one.
        let plan = plan_of(&description, &PlanSettings::default())?;
        let set_ups = plan.set_ups(subject.beam.length);
        let mut planted = Vec::new();
        let mut effects = Vec::new();
        let mut fastened = Fastened::default();
        let groups = match plant {
            Plant::Single(number) => vec![number % GROUPS.len()],
            Plant::Nothing | Plant::OutOfCatalogue(_) => Vec::new(),
            Plant::Pair => rand::seq::index::sample(&mut random, GROUPS.len(), 2).into_vec(),
        };
        for group in groups {
            let effect = draw_effect(&subject.beam, &set_ups, GROUPS[group], &mut random)?;
            planted.push(Planted::of(&effect));
            effects.push(effect);
        }
        if let Plant::OutOfCatalogue(number) = plant {
            let kind = OutOfCatalogueKind::ALL[number % OutOfCatalogueKind::ALL.len()];
            fastened = kind.draw(&subject.beam, &mut random);
            planted.push(Planted::OutOfCatalogue(kind.name().to_owned()));
        }
        let drift = random.random_range(0.0..=self.drift);
        effects.push(Effect::from_pairs(EffectId::JointDrift, &[("std", drift)])?);
        Ok(DrawnTest {
            laboratory: subject.laboratory(self.extent, &mut random)?,
            noise_db: self.noise_db,
            modes: self.extent.modes(),
            seed: random.random(),
            truth: Truth {
                name,
                effects: planted,
                detectable: None,
                refutable: None,
                within_tolerance: within_tolerance(&effects, &description),
            },
            text,
            description,
            effects,
            fastened,
        })
    }

    fn plants(&self) -> Vec<Plant> {
        let mut plants: Vec<Plant> = (0..self.singles).map(Plant::Single).collect();
        plants.extend(std::iter::repeat_n(Plant::Nothing, self.nulls));
        plants.extend((0..self.outside).map(Plant::OutOfCatalogue));
        plants.extend(std::iter::repeat_n(Plant::Pair, self.pairs));
        use rand::seq::SliceRandom;
        plants.shuffle(&mut ChaCha8Rng::seed_from_u64(self.seed));
        plants
    }
}

/// Standard deviations of what the tolerances leave open up to which a common factor on all frequencies is no effect.
const COVERED: f64 = 2.0;

/// Power with which the quantity that an effect changes enters all frequencies, the clock's among them; 0 where it is no
/// common factor.
fn power_of(effect: EffectId) -> f64 {
    match effect {
        EffectId::Timebase => 1.0,
        _ => Parameter::of_effect(effect).map_or(0.0, Parameter::frequency_power),
    }
}

/// Returns true where a planted common factor on all frequencies lies within the tolerances of the description; `None`
/// where there is none.
fn within_tolerance(effects: &[Effect], description: &TestDescription) -> Option<bool> {
    let factors = effects.iter().filter(|effect| power_of(effect.id) != 0.0);
    let changes: Vec<f64> = factors
        .filter_map(|effect| Some(power_of(effect.id) * effect.value("relative")?.ln_1p()))
        .collect();
    let (beam, tolerance) = (&description.beam, &description.beam.tolerance);
    let variances = [
        (Parameter::Modulus, tolerance.modulus.std / beam.modulus),
        (
            Parameter::Thickness,
            tolerance.thickness.std / beam.thickness,
        ),
        (Parameter::Density, tolerance.density.std / beam.density),
        (Parameter::Length, tolerance.length.std / beam.length),
    ]
    .map(|(property, relative)| (property.frequency_power() * relative).powi(2));
    let std = variances.iter().sum::<f64>().sqrt();
    (!changes.is_empty()).then(|| changes.iter().sum::<f64>().abs() < COVERED * std)
}

/// A random factor whose logarithm is normal, with this standard deviation.
fn log_normal(spread: f64, random: &mut ChaCha8Rng) -> f64 {
    (spread * normal(random)).exp()
}

fn sensor_table(name: &str, channel: usize, position: f64) -> String {
    format!("\n[[sensor]]\nname = \"{name}\"\nchannel = {channel}\nposition = {position}\n")
}

fn recording_table(number: usize, tap: f64, more: &str) -> String {
    format!("\n[[recording]]\nfile = \"r{number}.wav\"\ntap = {tap}\n{more}")
}

/// Tolerances of a well-measured bar: together 0.2 % of its frequencies.
const WELL_KNOWN: &str = "tolerance = { length = \"0.05 %\", width = \"0.1 %\", thickness = \"0.1 %\", \
    modulus = \"0.2 %\", density = \"0.1 %\" }\n";

/// The structure of one test.
struct Subject {
    beam: Beam,
    kx: f64,
    ky: f64,
}

impl Subject {
    fn draw(random: &mut ChaCha8Rng) -> Self {
        // Strips of steel or aluminium, as long as a forearm, about a hundred times longer than thick.
        let length = random.random_range(0.32..0.60);
        let steel = random.random_bool(0.6);
        let (modulus, density, poisson) = if steel {
            (207e9, 7850.0, 0.29)
        } else {
            (70e9, 2700.0, 0.33)
        };
        Self {
            beam: Beam {
                length,
                width: random.random_range(0.022..0.055),
                thickness: length * random.random_range(0.0070..0.0125),
                modulus,
                density,
                poisson,
            },
            // About the joint of Ingole & Chatterjee.
            kx: 1400.0 * log_normal(0.5, random),
            ky: 4.8 * log_normal(0.3, random),
        }
    }

    fn describe(&self, name: &str, extent: Extent, random: &mut ChaCha8Rng) -> String {
        let Beam {
            length,
            width,
            thickness,
            modulus,
            density,
            poisson,
        } = self.beam;
        let units = StiffnessUnits::of(&self.beam);
        let (kt, kr) = (self.kx * units.kt, self.ky * units.kr);
        let mut text = format!(
            "name = \"{name}\"\n\n[beam]\nlength = {length}\nwidth = {width}\nthickness = {thickness}\n\
             modulus = {modulus:e}\ndensity = {density:.1}\npoisson = {poisson}\n{WELL_KNOWN}\n[joint]\n\
             kind = \"cantilever\"\nmodel = \"2p\"\nbeam = \"euler\"\nkt = {kt:e}\nkr = {kr:e}\n\n\
             [hammer]\nchannel = 1\n"
        );
        let [a, b, moved, near, middle, far] = [0.81, 0.46, 0.43, 0.12, 0.50, 0.96]
            .map(|share| length * share * random.random_range(0.98..1.0));
        text += &sensor_table("A", 2, a);
        if extent == Extent::OneRecording {
            return text + &recording_table(1, far, "");
        }
        text += &sensor_table("B", 3, b);
        text += &recording_table(1, near, "");
        text += &recording_table(2, middle, "");
        text += &recording_table(3, far, "");
        text += &recording_table(4, far, &format!("at = {{ A = {moved} }}\n"));
        text + &recording_table(5, far, "level = 4\n")
    }

    /// A rate whose band ends between the last mode that is wanted and the next.
    fn laboratory(
        &self,
        extent: Extent,
        random: &mut ChaCha8Rng,
    ) -> Result<Laboratory, StructureError> {
        let modes = extent.modes();
        let joint = JointStiffness::two_parameter(self.kx, self.ky);
        let frequencies = natural_frequencies(
            BeamTheory::Euler,
            &self.beam,
            Assembly::Cantilever,
            &joint,
            modes + 1,
        )?;
        let mut laboratory = Laboratory::default();
        let between = (frequencies[modes - 1] * frequencies[modes]).sqrt();
        laboratory.recorder.sample_rate = Some((2.56 * between).round() as u32);
        // White noise is added to the recording instead, so that its level is known.
        laboratory.sensors.noise = 0.0;
        laboratory.hammer.interval = Some(4.5);
        let ratios = (0..8).map(|_| log_uniform(0.0015, 0.006, random));
        laboratory.specimen.damping = Damping::Modal(ratios.collect());
        Ok(laboratory)
    }
}

/// Relative standard uncertainty of a frequency, mean of five taps at 60 dB: what a steel beam's
/// temperature leaves, since the noise is smaller.
const FREQUENCY_STD: f64 = 5e-5;

impl DrawnTest {
    /// Returns the truth with the limits that readings without scatter set. One effect is detectable where the
    /// nominal model misses these readings by an amount that is noticed nine times out of ten. Two effects are
    /// detectable where each of them alone is. A fault outside the catalogue is refutable where the best hypothesis
    /// of the catalogue misses these readings clearly. With the usual scatter, chi square would then exceed its 1 %
    /// limit.
    ///
    /// # Errors
    /// [`DrawError`]: a defect of the drawing.
    pub fn with_limits(&self) -> Result<Truth, DrawError> {
        let mut truth = self.truth.clone();
        let kind = truth.kind();
        if kind == CaseKind::Null {
            return Ok(truth);
        }
        // Readings without scatter, on a mesh and by a code that the diagnosis does not use.
        let planned = PlanSettings {
            modes: self.modes,
            frequency_std: FREQUENCY_STD,
            drift: 0.0,
            ..PlanSettings::default()
        };
        let mut plan = plan_of(&self.description, &planned)?;
        plan.scatter = 0.0;
        let nominal = nominal_with(&self.description, None);
        let mut true_one = nominal.clone();
        self.fastened.add_to(&mut true_one.specimen);
        let readings = observe(&plan, &true_one, &self.effects, 0)?;
        let settings = GapSettings::default();
        if let CaseKind::Single(_) = kind {
            let chi_square = nominal_chi_square(&readings, &nominal, &settings)?;
            truth.detectable = Some(chi_square > DETECTABLE);
            return Ok(truth);
        }
        let found = diagnose(&readings, &nominal, &settings)?;
        if kind == CaseKind::OutOfCatalogue {
            // Scatter adds one for each degree of freedom.
            truth.refutable = found.misfit.and_then(|misfit| {
                let limit = chi_square_quantile(0.99, misfit.freedom)?;
                Some(misfit.chi_square + misfit.freedom > limit)
            });
            return Ok(truth);
        }
        // The misfit of each effect without the others; none where one is no hypothesis of such a test.
        let misfits = truth.catalogue().map(|(id, _)| {
            let own = Hypothesis::Effects(vec![id]);
            let mut all = found.hypotheses.iter();
            all.find(|one| one.hypothesis == own)?.misfit
        });
        let misfits: Option<Vec<_>> = misfits.collect();
        truth.detectable =
            misfits.map(|all| all.iter().all(|misfit| misfit.chi_square > DETECTABLE));
        Ok(truth)
    }

    /// Records the test.
    ///
    /// # Errors
    /// [`DrawError`]: a defect of the drawing.
    pub fn record(&self) -> Result<RecordedTest, DrawError> {
        let plan = TestPlan {
            description: &self.description,
            effects: &self.effects,
            changes: &[],
            repeatability: 0.0,
            laboratory: &self.laboratory,
            joint: None,
            seed: self.seed,
        };
        let mut test = plan_test(&plan)?;
        let recordings = test.recordings.iter_mut();
        for recording in recordings.filter(|_| !self.fastened.is_empty()) {
            // Adds what no effect describes.
            let mut specimen = recording.seen.specimen.clone();
            self.fastened.add_to(&mut specimen);
            let sensors = recording.structure.sensors().to_vec();
            recording.replace_structure(specimen, &sensors, &self.laboratory)?;
        }
        let recordings = test.recordings.iter().enumerate();
        Ok(RecordedTest {
            description: nominal_description(&self.text, &self.description, &test)?,
            recordings: recordings
                .map(|(number, recording)| {
                    record_channels(
                        recording,
                        &self.laboratory,
                        self.noise_db,
                        self.seed,
                        number as u64,
                    )
                })
                .collect(),
        })
    }
}

/// Makes a recording with white noise on every channel: `noise_db` below the root mean square of a response, and further below
/// the peak of the hammer.
pub(crate) fn record_channels(
    recording: &VirtualRecording,
    laboratory: &Laboratory,
    noise_db: f64,
    seed: u64,
    number: u64,
) -> Recorded {
    let mut run = recording.begin(laboratory);
    let count = recording.plan.channels.len();
    let mut channels = vec![Vec::with_capacity(recording.plan.frames as usize); count];
    let mut frame = vec![0.0; count];
    while run.next_frame(&mut frame) {
        for (channel, value) in channels.iter_mut().zip(&frame) {
            channel.push(*value);
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // Beyond the streams of the recording itself.
    random.set_stream(1 << 50 | number);
    for (index, channel) in channels.iter_mut().enumerate() {
        let rms = if index == 0 {
            let peak = channel.iter().fold(0.0, |peak: f64, x| peak.max(x.abs()));
            below(peak, noise_db + FORCE_MARGIN_DB)
        } else {
            below(root_mean_square(channel), noise_db)
        };
        add_noise(channel, rms, &mut random);
    }
    Recorded {
        file: recording.file.clone(),
        sample_rate: recording.plan.sample_rate,
        channels,
    }
}
