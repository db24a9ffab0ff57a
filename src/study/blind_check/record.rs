//! Records a drawn test.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::draw::{DrawError, DrawnTest};
use tapjoint_numerics::stats::root_mean_square;
use tapjoint_simulate::{
    SeenStructure, TestPlan, VirtualRecording, believed_description, plan_test,
};

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
