//! How often samples are read: a long recording is read once when it is opened, and hardly again to find its taps.

use super::health::HealthMeter;
use super::{ChannelInfo, Cursor, Format, Recording, RecordingError, Source};
use crate::taps::{TapSettings, TapSource, find_taps};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Samples in memory that are counted when they are read.
#[derive(Debug)]
struct Counted {
    samples: Vec<Vec<f64>>,
    read: Arc<AtomicU64>,
}

#[derive(Debug)]
struct CountedCursor<'a> {
    inner: Box<dyn Cursor + 'a>,
    read: &'a AtomicU64,
}

impl Source for Counted {
    fn cursor(&self, frame: u64) -> Result<Box<dyn Cursor + '_>, RecordingError> {
        Ok(Box::new(CountedCursor {
            inner: self.samples.cursor(frame)?,
            read: &self.read,
        }))
    }
}

impl Cursor for CountedCursor<'_> {
    fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let before: usize = into.iter().map(Vec::len).sum();
        self.inner.read(channels, limit, into)?;
        let after: usize = into.iter().map(Vec::len).sum();
        self.read
            .fetch_add((after - before) as u64, Ordering::Relaxed);
        Ok(())
    }
}

/// A force and a response at 2048 Hz, with a tap every four seconds from 1 s on.
fn tapped(seconds: usize) -> (Recording, Arc<AtomicU64>) {
    const RATE: usize = 2048;
    // A linear congruence is noise enough.
    let mut state = 1_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state) / f64::from(u32::MAX) - 0.5
    };
    let mut samples = vec![Vec::new(), Vec::new()];
    for n in 0..seconds * RATE {
        let since = ((n + 3 * RATE) % (4 * RATE)) as f64 / RATE as f64;
        let pulse = if since < 3e-3 {
            (PI * since / 3e-3).sin()
        } else {
            0.0
        };
        let ring = match n < RATE {
            true => 0.0,
            false => (-2.0 * since).exp() * (TAU * 60.0 * since).sin(),
        };
        samples[0].push(100.0 * pulse * f64::from(u8::from(n >= RATE)) + 0.1 * noise());
        samples[1].push(ring + 1e-3 * noise());
    }
    let read = Arc::new(AtomicU64::new(0));
    let channels = samples.iter().map(|samples| {
        let mut meter = HealthMeter::new(None);
        meter.add(samples);
        ChannelInfo::unscaled(None, None, meter)
    });
    let recording = Recording {
        name: "counted".to_owned(),
        format: Format::Memory,
        sample_rate: RATE as f64,
        frames: samples[0].len() as u64,
        channels: channels.collect(),
        warnings: Vec::new(),
        source: Arc::new(Counted {
            samples,
            read: read.clone(),
        }),
        parts: Vec::new(),
    };
    (recording, read)
}

#[test]
fn limit_taps_of_a_long_recording_are_found_in_few_of_its_samples() {
    let sources = [
        TapSource::Hammer {
            channel: 0,
            responses: vec![1],
        },
        TapSource::Responses(vec![1]),
    ];
    for source in sources {
        let shares = [200, 800].map(|seconds| {
            let (recording, read) = tapped(seconds);
            let taps = find_taps(&recording, &source, &TapSettings::default()).unwrap();
            // The file ends a second before the last record does.
            assert_eq!(taps.accepted().count(), seconds / 4 - 1, "{source:?}");
            for (number, tap) in taps.taps.iter().enumerate() {
                assert!(
                    (tap.time - 1.0 - 4.0 * number as f64).abs() < 3e-3,
                    "{}",
                    tap.time
                );
            }
            read.load(Ordering::Relaxed) as f64 / (2 * recording.frames()) as f64
        });
        // The surroundings of a tap are a second of four on one or two channels; besides, a bounded number of pieces is
        // read for noise and drift.
        assert!(
            shares[1] < shares[0] && shares[1] < 0.5,
            "{source:?} {shares:?}"
        );
    }
}
