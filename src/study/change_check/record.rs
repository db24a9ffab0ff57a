//! Pairs of virtual tests with a withheld change: drawn, described, and recorded.

use super::draw::{ChangeClass, ChangedStructure, VISIBLE, chi_square, draw_repeatability};
use super::truth::PairTruth;
use crate::blind_check::{DrawError, RecordedTest, log_uniform, record_channels};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use tapjoint_beam::specimen::{Body, Specimen};
use tapjoint_compare::ItemKind;
use tapjoint_description::TestDescription;
use tapjoint_simulate::{
    Damping, Laboratory, ScatterTails, SetUpScatter, TestPlan, nominal_description, plan_test,
};

/// A check to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct PairCampaign {
    /// Number of pairs. In a quarter of them nothing changes; the others are dealt out evenly over the classes.
    pub pairs: usize,
    /// Noise of the responses below their root mean square (dB).
    pub noise_db: f64,
    /// Seed of everything.
    pub seed: u64,
}

/// A pair drawn but not yet recorded.
#[derive(Debug, Clone)]
pub struct DrawnPair {
    /// Structure, description and change.
    pub structure: ChangedStructure,
    /// What changed.
    pub truth: PairTruth,
    /// The description of both tests, with the joint's stiffnesses, which no analysis sees.
    text: String,
    description: TestDescription,
    laboratory: Laboratory,
    /// Factor on each natural frequency in the test before and in the test after.
    factors: [Vec<f64>; 2],
    noise_db: f64,
    seeds: [u64; 2],
}

/// Structures drawn for one pair until one of them can be.
const ATTEMPTS: usize = 200;
/// Fewest and most modes in the band.
const MODES: [usize; 2] = [4, 8];
/// Highest frequency that a hammer with a steel tip excites (Hz).
const HAMMER_REACH: f64 = 3000.0;
/// Modes that scatter from test to test, more than lie in any band.
const SCATTERED: usize = 30;

impl PairCampaign {
    /// Draws pair number `index`, from 0. Classes follow each other in a shuffled order, so that a pair's number says
    /// nothing.
    ///
    /// # Errors
    /// [`DrawError`]: a defect of the drawing.
    pub fn draw(&self, index: usize) -> Result<DrawnPair, DrawError> {
        let class = self.classes()[index];
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        // Stream 0 shuffles the classes.
        random.set_stream(index as u64 + 1);
        for _ in 0..ATTEMPTS {
            if let Some(structure) = ChangedStructure::draw(class, &mut random)
                && let Some(modes) = modes_in_reach(&structure, &mut random)
            {
                return self.describe(index, structure, modes, &mut random);
            }
        }
        Err(DrawError::NoStructure)
    }

    fn classes(&self) -> Vec<ChangeClass> {
        let nothing = (self.pairs + 2) / 4;
        let mut classes = vec![ChangeClass::Nothing; nothing];
        let changes = ChangeClass::ALL[1..].iter().cycle();
        classes.extend(changes.take(self.pairs - nothing));
        classes.shuffle(&mut ChaCha8Rng::seed_from_u64(self.seed));
        classes
    }

    fn describe(
        &self,
        index: usize,
        structure: ChangedStructure,
        modes: ModesInReach,
        random: &mut ChaCha8Rng,
    ) -> Result<DrawnPair, DrawError> {
        let name = format!("pair-{index:04}");
        let scatter = SetUpScatter {
            repeatability: draw_repeatability(random),
            share: 0.5 * random.random::<f64>(),
            tails: ScatterTails::Long,
        };
        let is_stated = random.random::<bool>();
        let chi_square = chi_square(&modes.frequencies, scatter.repeatability);
        let text = described(&structure, &name, random);
        let mut laboratory = Laboratory::default();
        laboratory.recorder.sample_rate = Some((2.56 * modes.band_end).round() as u32);
        // White noise is added to the recording instead, so that its level is known.
        laboratory.sensors.noise = 0.0;
        let ratios = (0..MODES[1]).map(|_| log_uniform(0.0015, 0.006, random));
        laboratory.specimen.damping = Damping::Modal(ratios.collect());
        Ok(DrawnPair {
            truth: PairTruth {
                name: name.clone(),
                changes: structure.changes.clone(),
                visible: (!structure.changes.is_empty()).then_some(chi_square >= VISIBLE),
                repeatability: is_stated.then_some(scatter.repeatability),
            },
            description: TestDescription::parse(&text, &name)?,
            text,
            laboratory,
            factors: [
                scatter.factors(SCATTERED, random),
                scatter.factors(SCATTERED, random),
            ],
            noise_db: self.noise_db,
            seeds: [random.random(), random.random()],
            structure,
        })
    }
}

/// The modes that a test measures.
struct ModesInReach {
    /// True frequencies before and after (Hz), without the scatter between set-ups.
    frequencies: [Vec<f64>; 2],
    /// End of the band (Hz).
    band_end: f64,
}

/// Draws the number of modes, as far as the hammer reaches; `None` where it reaches too few.
fn modes_in_reach(structure: &ChangedStructure, random: &mut ChaCha8Rng) -> Option<ModesInReach> {
    let wanted = random.random_range(MODES[0]..=MODES[1]);
    let [mut before, mut after] = structure.frequencies(wanted + 1)?;
    let reached = before.iter().filter(|frequency| **frequency < HAMMER_REACH);
    let count = wanted.min(reached.count());
    if count < MODES[0] {
        return None;
    }
    // The band ends between the last mode that is wanted and the next.
    let band_end = (before[count - 1] * before[count]).sqrt();
    before.truncate(count);
    after.truncate(count);
    Some(ModesInReach {
        frequencies: [before, after],
        band_end,
    })
}

/// Returns the description of both tests.
fn described(structure: &ChangedStructure, name: &str, random: &mut ChaCha8Rng) -> String {
    let specimen = &structure.described;
    let beam = specimen.body.beams()[0];
    let length = specimen.body.length();
    let (kind, is_lap) = match (&specimen.body, specimen.joint) {
        (Body::Joined(_), _) => ("lap", true),
        (Body::One(_), Some(_)) => ("cantilever", false),
        (Body::One(_), None) => ("free", false),
    };
    let theory = match specimen.shear_rotary {
        0.0 => "euler",
        _ => "timoshenko",
    };
    let mut text = format!(
        "name = \"{name}\"\n\n[beam]\nlength = {length}\nwidth = {}\nthickness = {}\nmodulus = {:e}\ndensity = {:.1}\n\
         poisson = {}\n\n[joint]\nkind = \"{kind}\"\nbeam = \"{theory}\"\n",
        beam.width, beam.thickness, beam.modulus, beam.density, beam.poisson
    );
    // Writing to a string cannot fail.
    if let Some(joint) = specimen.joint {
        let _ = writeln!(text, "kt = {:e}\nkr = {:e}", joint.kt, joint.kr);
    }
    if let Some(overlap) = specimen.overlap.filter(|_| is_lap) {
        let _ = writeln!(
            text,
            "overlap = {{ length = {}, mass = {} }}",
            overlap.length, overlap.mass
        );
    }
    text += "\n[hammer]\nchannel = 1\n";
    let mut channel = 1;
    let sensors = structure.items.iter();
    for sensor in sensors.filter(|item| item.kind == ItemKind::Sensor) {
        channel += 1;
        let _ = write!(
            text,
            "\n[[sensor]]\nname = \"{}\"\nchannel = {channel}\nposition = {}\nmass = {}\n",
            sensor.name, sensor.point.position, sensor.point.mass
        );
    }
    // Close to the free end, where every mode moves.
    let tap = length * random.random_range(0.95..0.99);
    let _ = write!(text, "\n[[recording]]\nfile = \"taps.wav\"\ntap = {tap}\n");
    let masses = structure.items.iter();
    for mass in masses.filter(|item| item.kind == ItemKind::Mass) {
        let _ = write!(
            text,
            "\n[[recording.mass]]\nname = \"{}\"\nposition = {}\nmass = {}\n",
            mass.name, mass.point.position, mass.point.mass
        );
    }
    text
}

impl DrawnPair {
    /// Records the test before the change and the one after it.
    ///
    /// # Errors
    /// [`DrawError`]: a defect of the drawing.
    pub fn record(&self) -> Result<[RecordedTest; 2], DrawError> {
        let structure = &self.structure;
        Ok([
            self.record_one(&structure.before, 0)?,
            self.record_one(&structure.after, 1)?,
        ])
    }

    fn record_one(&self, truth: &Specimen, side: usize) -> Result<RecordedTest, DrawError> {
        let plan = TestPlan {
            description: &self.description,
            effects: &[],
            changes: &[],
            repeatability: 0.0,
            laboratory: &self.laboratory,
            joint: None,
            seed: self.seeds[side],
        };
        let mut test = plan_test(&plan)?;
        // Items and the masses of the true structure have one order.
        let items = self.structure.items.iter().zip(&truth.masses);
        let sensors = items.filter(|(item, _)| item.kind == ItemKind::Sensor);
        let places: Vec<f64> = sensors.map(|(_, mass)| mass.position).collect();
        let mut recordings = Vec::with_capacity(test.recordings.len());
        for recording in &mut test.recordings {
            recording.replace_structure(truth.clone(), &places, &self.laboratory)?;
            recording.structure.scale_frequencies(&self.factors[side]);
        }
        for (number, recording) in test.recordings.iter().enumerate() {
            recordings.push(record_channels(
                recording,
                &self.laboratory,
                self.noise_db,
                self.seeds[side],
                number as u64,
            ));
        }
        Ok(RecordedTest {
            description: nominal_description(&self.text, &self.description, &test)?,
            recordings,
        })
    }
}
