//! Draws virtual tests: a structure, a plan of recordings, and an effect that its description leaves
//! out.
//!
//! All tests of a campaign look alike from outside: a cantilever that is described as an Euler beam
//! with two springs and sensors without mass, so that the description does not give the effect away.
//! Sizes are drawn from small to large as a test engineer meets them, positions off any grid.
//!
//! What the readings of a drawn test can show at all, by what was planted and not by what was answered.
//!
//! Records a drawn test.

use super::case::{CaseKind, Planted, Truth};
use super::planted_effects::{Fastened, GROUPS, OutsideKind, draw_effect};
use crate::plan::{NOTICED, PlanError, PlanSettings, plan_of};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use tapjoint_analysis::nominal_with;
use tapjoint_beam::effects::{Effect, EffectError, EffectId};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{
    Assembly, Beam, BeamTheory, JointStiffness, StructureError, natural_frequencies,
};
use tapjoint_description::{DescriptionError, TestDescription};
use tapjoint_diagnosis::{
    GapError, GapSettings, Hypothesis, diagnose, nominal_chi_square, observe,
};
use tapjoint_identify::observation::Observations;
use tapjoint_numerics::stats::{chi_square_quantile, root_mean_square};
use tapjoint_simulate::{
    Damping, Laboratory, SeenStructure, SimulateError, TestPlan, VirtualRecording,
    believed_description, plan_test,
};

/// How many recordings a drawn test has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Five recordings: two sensors, one of them moved once; three tap positions; two levels; six
    /// modes.
    FiveRecordings,
    /// One recording with one sensor, five modes.
    OneRecording,
}

impl Extent {
    /// Modes in the band.
    fn modes(self) -> usize {
        match self {
            Self::FiveRecordings => 6,
            Self::OneRecording => 5,
        }
    }
}

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
    /// What is recorded.
    pub extent: Extent,
    /// Noise of the responses below their root mean square (dB). 60.
    pub noise_db: f64,
    /// Largest standard deviation of the joint's drift between recordings (1); each test draws its
    /// own up to it, and is not told. 0.01.
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

/// What a test of a campaign is to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Plant {
    Single(usize),
    Nothing,
    Outside(usize),
    Pair,
}

/// A test drawn but not yet recorded.
#[derive(Debug, Clone)]
pub struct DrawnTest {
    /// Its description with the joint's stiffnesses, which the diagnosis does not see.
    pub text: String,
    /// The same, read.
    pub description: TestDescription,
    /// The effects, the joint's drift among them.
    pub effects: Vec<Effect>,
    /// What no effect of the catalogue describes.
    pub fastened: Fastened,
    /// How it is recorded.
    pub laboratory: Laboratory,
    /// Noise of the responses below their root mean square (dB).
    pub noise_db: f64,
    /// Modes in its band.
    pub modes: usize,
    /// What was planted.
    pub truth: Truth,
    /// Seed of the recording.
    pub seed: u64,
}

/// Why a test cannot be drawn or recorded: a defect of this module.
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
    #[error("what a drawn test can show cannot be planned: {0}")]
    Plan(#[from] PlanError),
    /// What a drawn test can show cannot be said.
    #[error("what a drawn test can show cannot be said: {0}")]
    Limits(#[from] GapError),
    /// The description as the user believes it cannot be written.
    #[error("a drawn description cannot be written: {0}")]
    Believed(#[from] toml::de::Error),
}

impl Campaign {
    /// Number of tests.
    pub fn len(&self) -> usize {
        self.singles + self.nulls + self.outside + self.pairs
    }

    /// Whether there is no test.
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
        let mut planted = Vec::new();
        let mut effects = Vec::new();
        let mut fastened = Fastened::default();
        for group in groups_of(plant, &mut random) {
            let effect = draw_effect(&subject.beam, GROUPS[group], &mut random)?;
            let values = effect
                .values()
                .map(|(info, value)| (info.name.to_owned(), value));
            planted.push(Planted::Catalogue(
                effect.id,
                values.collect::<BTreeMap<_, _>>(),
            ));
            effects.push(effect);
        }
        if let Plant::Outside(number) = plant {
            let kind = OutsideKind::ALL[number % OutsideKind::ALL.len()];
            fastened = kind.draw(&subject.beam, &mut random);
            planted.push(Planted::Outside(kind.name().to_owned()));
        }
        let drift = random.random_range(0.0..=self.drift);
        effects.push(Effect::from_pairs(EffectId::JointDrift, &[("std", drift)])?);
        let name = format!("test-{index:04}");
        let text = subject.describe(&name, self.extent, &mut random);
        Ok(DrawnTest {
            description: TestDescription::parse(&text, &name)?,
            laboratory: subject.laboratory(self.extent, &mut random)?,
            noise_db: self.noise_db,
            modes: self.extent.modes(),
            seed: random.random(),
            truth: Truth {
                name,
                effects: planted,
                detectable: None,
                refutable: None,
            },
            text,
            effects,
            fastened,
        })
    }

    fn plants(&self) -> Vec<Plant> {
        let mut plants: Vec<Plant> = (0..self.singles).map(Plant::Single).collect();
        plants.extend(std::iter::repeat_n(Plant::Nothing, self.nulls));
        plants.extend((0..self.outside).map(Plant::Outside));
        plants.extend(std::iter::repeat_n(Plant::Pair, self.pairs));
        use rand::seq::SliceRandom;
        plants.shuffle(&mut ChaCha8Rng::seed_from_u64(self.seed));
        plants
    }
}

fn groups_of(plant: Plant, random: &mut ChaCha8Rng) -> Vec<usize> {
    match plant {
        Plant::Single(number) => vec![number % GROUPS.len()],
        Plant::Nothing | Plant::Outside(_) => Vec::new(),
        Plant::Pair => rand::seq::index::sample(random, GROUPS.len(), 2).into_vec(),
    }
}

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
        let normal = |spread: f64, random: &mut ChaCha8Rng| {
            let draw: f64 = StandardNormal.sample(random);
            (spread * draw).exp()
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
            kx: 1400.0 * normal(0.5, random),
            ky: 4.8 * normal(0.3, random),
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
             modulus = {modulus:e}\ndensity = {density:.1}\npoisson = {poisson}\n\n[joint]\n\
             kind = \"cantilever\"\nmodel = \"2p\"\nbeam = \"euler\"\nkt = {kt:e}\nkr = {kr:e}\n\n\
             [hammer]\nchannel = 1\n"
        );
        let mut place = |share: f64| length * share * random.random_range(0.98..1.0);
        let (a, b, moved) = (place(0.81), place(0.46), place(0.43));
        let taps = [place(0.12), place(0.50), place(0.96)];
        let sensor = |text: &mut String, name: &str, channel: usize, x: f64| {
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                "\n[[sensor]]\nname = \"{name}\"\nchannel = {channel}\nposition = {x}\n"
            );
        };
        let recording = |text: &mut String, number: usize, tap: f64, more: &str| {
            let _ = write!(
                text,
                "\n[[recording]]\nfile = \"r{number}.wav\"\ntap = {tap}\n{more}"
            );
        };
        sensor(&mut text, "A", 2, a);
        if extent == Extent::OneRecording {
            recording(&mut text, 1, taps[2], "");
            return text;
        }
        sensor(&mut text, "B", 3, b);
        for (number, tap) in taps.iter().enumerate() {
            recording(&mut text, number + 1, *tap, "");
        }
        recording(&mut text, 4, taps[2], &format!("at = {{ A = {moved} }}\n"));
        recording(&mut text, 5, taps[2], "level = 4\n");
        text
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
        let ratio = |_| random.random_range(0.0015f64.ln()..0.006f64.ln()).exp();
        laboratory.specimen.damping = Damping::Modal((0..8).map(ratio).collect());
        Ok(laboratory)
    }
}

/// Relative standard uncertainty of a frequency, mean of five taps at 60 dB: what a steel beam's
/// temperature leaves, since the noise is smaller.
const FREQUENCY_STD: f64 = 5e-5;

impl DrawnTest {
    /// The truth, with what readings without scatter show of it: whether the nominal model misses them by
    /// what is noticed nine times out of ten (one effect), whether so do both of two effects alone (two
    /// effects), and whether the best of the catalogue misses them so far that with the usual scatter chi
    /// square would exceed its 1 % limit (outside it).
    ///
    /// # Errors
    /// [`DrawError`]: a defect of the drawing.
    pub fn with_limits(&self) -> Result<Truth, DrawError> {
        let mut truth = self.truth.clone();
        match truth.kind() {
            CaseKind::Single(_) => truth.detectable = Some(self.is_detectable()?),
            CaseKind::Outside => truth.refutable = self.is_refutable()?,
            CaseKind::Several => truth.detectable = self.are_both_detectable()?,
            CaseKind::Null => {}
        }
        Ok(truth)
    }

    fn is_detectable(&self) -> Result<bool, DrawError> {
        let nominal = nominal_with(&self.description, None);
        let chi_square = nominal_chi_square(&self.exact()?, &nominal, &GapSettings::default())?;
        Ok(chi_square > NOTICED)
    }

    /// Whether readings without scatter are missed by each of the planted effects without the others;
    /// `None` where an effect is no hypothesis of such a test.
    fn are_both_detectable(&self) -> Result<Option<bool>, DrawError> {
        let nominal = nominal_with(&self.description, None);
        let found = diagnose(&self.exact()?, &nominal, &GapSettings::default())?;
        let alone = |effect: &Effect| {
            let own = Hypothesis::Effects(vec![effect.id]);
            let mut all = found.hypotheses.iter();
            let misfit = all.find(|one| one.hypothesis == own)?.misfit?;
            Some(misfit.chi_square)
        };
        let misses: Option<Vec<f64>> = self.effects.iter().map(alone).collect();
        Ok(misses.map(|misses| misses.iter().all(|miss| *miss > NOTICED)))
    }

    fn is_refutable(&self) -> Result<Option<bool>, DrawError> {
        let nominal = nominal_with(&self.description, None);
        let found = diagnose(&self.exact()?, &nominal, &GapSettings::default())?;
        // Scatter adds one for each degree of freedom.
        Ok(found.misfit.and_then(|misfit| {
            let limit = chi_square_quantile(0.99, misfit.freedom)?;
            Some(misfit.chi_square + misfit.freedom > limit)
        }))
    }

    /// Readings without scatter, on a mesh and by a code that the diagnosis does not use.
    fn exact(&self) -> Result<Observations, DrawError> {
        let settings = PlanSettings {
            modes: self.modes,
            frequency_std: FREQUENCY_STD,
            drift: 0.0,
            ..PlanSettings::default()
        };
        let mut plan = plan_of(&self.description, &settings)?;
        plan.scatter = 0.0;
        let mut truth = nominal_with(&self.description, None);
        self.fastened.add_to(&mut truth.specimen);
        Ok(observe(&plan, &truth, &self.effects, 0)?)
    }
}

/// What the diagnosis is given: recordings, and the description without the truth.
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

impl DrawnTest {
    /// Records the test.
    ///
    /// # Errors
    /// [`DrawError`]: a defect of the drawing.
    pub fn record(&self) -> Result<RecordedTest, DrawError> {
        let plan = TestPlan {
            description: &self.description,
            effects: &self.effects,
            laboratory: &self.laboratory,
            joint: None,
            seed: self.seed,
        };
        let mut test = plan_test(&plan)?;
        if !self.fastened.is_empty() {
            for (number, recording) in test.recordings.iter_mut().enumerate() {
                self.fasten(recording, number)?;
            }
        }
        let recordings = test.recordings.iter().enumerate();
        Ok(RecordedTest {
            description: believed_description(&self.text, &self.description, &test)?,
            recordings: recordings
                .map(|(n, recording)| self.take(recording, n))
                .collect(),
        })
    }

    /// Adds what no effect describes, and looks at the structure again.
    fn fasten(&self, recording: &mut VirtualRecording, number: usize) -> Result<(), DrawError> {
        self.fastened.add_to(&mut recording.seen.specimen);
        let moved = &self.description.recordings[number].at;
        let place = |sensor: &tapjoint_description::SensorDescription| {
            moved.get(&sensor.name).copied().or(sensor.position)
        };
        let places: Vec<f64> = self.description.sensors.iter().filter_map(place).collect();
        recording.structure = SeenStructure::new(
            &recording.seen.specimen,
            &self.laboratory.specimen,
            &places,
            (
                recording.seen.joint_loss_factor,
                recording.take.highest_mode(&self.laboratory),
            ),
        )?;
        Ok(())
    }

    fn take(&self, recording: &VirtualRecording, number: usize) -> Recorded {
        let mut session = recording.begin(&self.laboratory);
        let count = recording.take.channels.len();
        let mut channels = vec![Vec::with_capacity(recording.take.frames as usize); count];
        let mut frame = vec![0.0; count];
        while session.next_frame(&mut frame) {
            for (channel, value) in channels.iter_mut().zip(&frame) {
                channel.push(*value);
            }
        }
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        // Beyond the streams of the recording itself.
        random.set_stream(1 << 50 | number as u64);
        for (index, channel) in channels.iter_mut().enumerate() {
            let level = if index == 0 {
                let peak = channel.iter().fold(0.0, |peak: f64, x| peak.max(x.abs()));
                peak * 10f64.powf(-(self.noise_db + FORCE_MARGIN_DB) / 20.0)
            } else {
                root_mean_square(channel) * 10f64.powf(-self.noise_db / 20.0)
            };
            for value in channel {
                let noise: f64 = StandardNormal.sample(&mut random);
                *value += level * noise;
            }
        }
        Recorded {
            file: recording.file.clone(),
            sample_rate: recording.take.sample_rate,
            channels,
        }
    }
}
