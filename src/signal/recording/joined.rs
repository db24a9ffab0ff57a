//! Several files of one set-up as one recording: a tap in each, or repeats.
//!
//! The samples follow one another as if they had been recorded in one go. Nothing may be read across the places where a
//! file begins ([`Recording::seams`]).

use super::{Cursor, Recording, RecordingError, SAME_RATE, SAME_SCALE, Source};
use std::sync::Arc;

/// Most files of one recording: every one of them is read at once.
pub const MOST_FILES: usize = 1000;

/// Files one after the other.
#[derive(Debug)]
struct Joined {
    parts: Vec<Recording>,
    /// First frame of every part.
    starts: Vec<u64>,
}

impl Recording {
    /// Joins recordings of one set-up, in their order, under a name.
    ///
    /// # Errors
    /// No recording, or too many; recordings with other channels, units or sample rates than the first.
    pub fn joined(name: impl Into<String>, parts: Vec<Recording>) -> Result<Self, RecordingError> {
        let name = name.into();
        if parts.is_empty() || parts.len() > MOST_FILES {
            let problem = format!(
                "{} files for one recording; allowed: 1 to {MOST_FILES}; write several [[recording]] tables",
                parts.len()
            );
            return Err(RecordingError::new(&name, problem));
        }
        let mut whole = parts[0].clone();
        let mut starts = vec![0];
        for part in &parts[1..] {
            part.check_like(&parts[0])?;
            starts.push(whole.frames);
            for (own, other) in whole.channels.iter_mut().zip(&part.channels) {
                own.health = own
                    .health
                    .followed_by(whole.frames, &other.health, part.frames);
            }
            for warning in &part.warnings {
                if !whole.warnings.contains(warning) {
                    whole.warnings.push(warning.clone());
                }
            }
            whole.frames += part.frames;
        }
        whole.name = name;
        whole.source = Arc::new(Joined { parts, starts });
        Ok(whole)
    }

    /// First frames of the files after the first, where several were joined.
    pub fn seams(&self) -> &[u64] {
        self.source.seams()
    }

    /// Checks that a recording can follow another one.
    fn check_like(&self, first: &Recording) -> Result<(), RecordingError> {
        let (rate, other_rate) = (self.sample_rate, first.sample_rate);
        let names = |of: &Recording| {
            of.channels
                .iter()
                .map(|one| one.name.clone())
                .collect::<Vec<_>>()
        };
        let same_scale = self
            .channels
            .iter()
            .zip(&first.channels)
            .all(|(own, other)| {
                own.unit == other.unit && (own.scale / other.scale - 1.0).abs() <= SAME_SCALE
            });
        let problem = if self.channels.len() != first.channels.len() {
            format!(
                "{} channels where {} has {}",
                self.channels.len(),
                first.name,
                first.channels.len()
            )
        } else if names(self) != names(first) {
            format!("other names of its channels than {}", first.name)
        } else if (rate - other_rate).abs() > SAME_RATE * other_rate {
            format!("{rate} Hz where {} has {other_rate} Hz", first.name)
        } else if !same_scale {
            format!("other units than {}", first.name)
        } else {
            return Ok(());
        };
        let remedy = "files of one recording must be alike; give it a [[recording]] of its own";
        Err(RecordingError::new(
            &self.name,
            format!("it has {problem}; {remedy}"),
        ))
    }
}

impl Source for Joined {
    fn cursor(&self, frame: u64) -> Result<Box<dyn Cursor + '_>, RecordingError> {
        let part = self.starts.partition_point(|start| *start <= frame) - 1;
        let inner = self.parts[part].source.cursor(frame - self.starts[part])?;
        let left = self.parts[part].frames - (frame - self.starts[part]);
        Ok(Box::new(JoinedCursor {
            joined: self,
            part,
            left,
            inner,
        }))
    }

    fn seams(&self) -> &[u64] {
        &self.starts[1..]
    }
}

/// A reader somewhere in one of the files.
#[derive(Debug)]
struct JoinedCursor<'a> {
    joined: &'a Joined,
    part: usize,
    /// Frames that are left of the part.
    left: u64,
    inner: Box<dyn Cursor + 'a>,
}

impl Cursor for JoinedCursor<'_> {
    fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let mut wanted = limit;
        while wanted > 0 {
            if self.left == 0 {
                let Some(next) = self.joined.parts.get(self.part + 1) else {
                    break;
                };
                self.part += 1;
                self.left = next.frames;
                self.inner = next.source.cursor(0)?;
            }
            let now = wanted.min(self.left);
            self.inner.read(channels, now, into)?;
            self.left -= now;
            wanted -= now;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Channel;

    fn part(name: &str, samples: &[f64]) -> Recording {
        let channel = Channel {
            samples: samples.to_vec(),
            ..Channel::default()
        };
        Recording::from_samples(name, 1000.0, vec![channel]).unwrap()
    }

    #[test]
    fn prop_joined_files_are_the_samples_one_after_the_other() {
        let all: Vec<f64> = (0..100).map(|n| f64::from(n * n % 17)).collect();
        let parts = [&all[..30], &all[30..31], &all[31..]];
        let parts = parts.iter().map(|samples| part("a", samples));
        let joined = Recording::joined("all", parts.collect()).unwrap();
        let whole = part("all", &all);
        assert_eq!(joined.seams(), [30, 31]);
        assert_eq!(joined.frames(), 100);
        for range in [0..100, 5..40, 30..31, 29..33, 90..200] {
            let (a, b) = (joined.read(0, range.clone()), whole.read(0, range));
            assert_eq!(a.unwrap(), b.unwrap());
        }
        let blocks: Vec<f64> = (joined.blocks(&[0], 7))
            .flat_map(|block| block.unwrap().samples.concat())
            .collect();
        assert_eq!(blocks, all);
        let (a, b) = (&joined.channels()[0].health, &whole.channels()[0].health);
        assert!((a.mean - b.mean).abs() < 1e-12 && (a.rms - b.rms).abs() < 1e-12);
        assert_eq!(
            (a.peak, a.minimum, a.maximum),
            (b.peak, b.minimum, b.maximum)
        );
    }

    #[test]
    fn limit_unlike_files_are_refused_by_name() {
        let channels = vec![
            Channel {
                samples: vec![0.0, 1.0],
                ..Channel::default()
            };
            2
        ];
        let two = Recording::from_samples("two.wav", 1000.0, channels).unwrap();
        let error = Recording::joined("all", vec![part("one.wav", &[1.0, 2.0]), two]);
        let text = error.unwrap_err().to_string();
        assert!(
            text.contains("two.wav") && text.contains("2 channels"),
            "{text}"
        );
        assert!(Recording::joined("none", Vec::new()).is_err());
    }
}
