//! Several files of one set-up as one recording: a tap in each, or repeats.
//!
//! The samples follow one another as if they had been recorded in one go. What must not be read across the place where
//! a file begins is done part by part ([`Recording::parts`]): the search for taps, their records, and means.

use super::{Cursor, Format, Recording, RecordingError, SAME_RATE, SAME_SCALE, Source};
use std::sync::Arc;

/// Most files of one recording.
pub const MOST_FILES: usize = 200;

/// Files one after the other.
#[derive(Debug)]
struct Joined {
    sources: Vec<Arc<dyn Source>>,
    /// Frames of each, and in the last place of all.
    ends: Vec<u64>,
}

impl Recording {
    /// Joins recordings of one set-up, in their order, under a name.
    ///
    /// # Errors
    /// No recording, or more than [`MOST_FILES`]; recordings with other channels, units or sample rates than the first.
    pub fn joined(name: impl Into<String>, parts: Vec<Recording>) -> Result<Self, RecordingError> {
        let name = name.into();
        let Some(first) = parts.first().filter(|_| parts.len() <= MOST_FILES) else {
            let problem = format!(
                "{} files for one recording; allowed: 1 to {MOST_FILES}; write several [[recording]] tables",
                parts.len()
            );
            return Err(RecordingError::new(&name, problem));
        };
        let mut whole = first.clone();
        let mut ends = vec![whole.frames];
        for part in &parts[1..] {
            part.check_like(first)?;
            for (own, other) in whole.channels.iter_mut().zip(&part.channels) {
                own.health = own
                    .health
                    .followed_by(whole.frames, &other.health, part.frames);
            }
            whole.frames += part.frames;
            ends.push(whole.frames);
        }
        whole.name = name;
        whole.source = Arc::new(Joined {
            sources: parts.iter().map(|part| part.source.clone()).collect(),
            ends,
        });
        whole.parts = parts;
        Ok(whole)
    }

    /// The files of a joined recording, each with its first frame; none of a recording of one file.
    pub fn parts(&self) -> impl Iterator<Item = (u64, &Recording)> {
        let mut start = 0;
        self.parts.iter().map(move |part| {
            let own = start;
            start += part.frames;
            (own, part)
        })
    }

    /// Mean of a channel (its unit) in the file that holds a frame; 0 for an unknown channel.
    pub fn mean_at(&self, channel: usize, frame: u64) -> f64 {
        let part = self.parts().take_while(|(start, _)| *start <= frame).last();
        part.map_or(self, |(_, part)| part).mean(channel)
    }

    /// Checks that a recording can follow another one.
    fn check_like(&self, first: &Recording) -> Result<(), RecordingError> {
        let difference = self.difference(first);
        match difference {
            None => Ok(()),
            Some(problem) => Err(RecordingError::new(
                &self.name,
                format!(
                    "{problem}; files of one recording have the same channels, units and sample rate: give this one a [[recording]] of its own"
                ),
            )),
        }
    }

    /// What keeps this recording from following another one, in words.
    fn difference(&self, first: &Recording) -> Option<String> {
        let other = &first.name;
        let (own_count, count) = (self.channels.len(), first.channels.len());
        if own_count != count {
            let channels = if own_count == 1 {
                "channel"
            } else {
                "channels"
            };
            return Some(format!("{own_count} {channels}, and {other} has {count}"));
        }
        let (own_rate, rate) = (self.sample_rate, first.sample_rate);
        if (own_rate - rate).abs() > SAME_RATE * rate {
            return Some(format!("{own_rate} Hz, and {other} has {rate} Hz"));
        }
        for (number, (own, theirs)) in (1..).zip(self.channels.iter().zip(&first.channels)) {
            let words = |text: &Option<String>| {
                text.as_ref()
                    .map_or("none".to_owned(), |text| format!("\"{text}\""))
            };
            if own.name != theirs.name {
                let (own, theirs) = (words(&own.name), words(&theirs.name));
                return Some(format!(
                    "the name of channel {number} is {own}, and in {other} {theirs}"
                ));
            }
            let of_full_scale = [self, first]
                .map(|one| matches!(one.format, Format::WavInteger { .. } | Format::Flac { .. }));
            if own.unit.is_none() && of_full_scale[0] != of_full_scale[1] {
                let (own, theirs) = (self.format, first.format);
                return Some(format!(
                    "the values of channel {number} have no unit and are {own}, and in {other} {theirs}"
                ));
            }
            if own.unit != theirs.unit || (own.scale / theirs.scale - 1.0).abs() > SAME_SCALE {
                let (own, theirs) = (words(&own.header_unit), words(&theirs.header_unit));
                return Some(format!(
                    "the unit of channel {number} is {own}, and in {other} {theirs}"
                ));
            }
        }
        None
    }
}

impl Source for Joined {
    fn cursor(&self, frame: u64) -> Result<Box<dyn Cursor + '_>, RecordingError> {
        let last = self.sources.len().saturating_sub(1);
        let part = self.ends.partition_point(|end| *end <= frame).min(last);
        let before = part.checked_sub(1).map_or(0, |before| self.ends[before]);
        Ok(Box::new(JoinedCursor {
            joined: self,
            part,
            left: self.ends[part].saturating_sub(frame),
            inner: self.sources[part].cursor(frame - before)?,
        }))
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
                let Some(next) = self.joined.sources.get(self.part + 1) else {
                    break;
                };
                self.left = self.joined.ends[self.part + 1] - self.joined.ends[self.part];
                self.part += 1;
                self.inner = next.cursor(0)?;
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

    fn part(name: &str, rate: f64, samples: &[f64]) -> Recording {
        let channel = Channel {
            samples: samples.to_vec(),
            ..Channel::default()
        };
        Recording::from_samples(name, rate, vec![channel]).unwrap()
    }

    #[test]
    fn prop_joined_files_are_the_samples_one_after_the_other() {
        let all: Vec<f64> = (0..100).map(|n| f64::from(n * n % 17)).collect();
        let parts = [&all[..30], &all[30..31], &all[31..]];
        let parts = parts.iter().map(|samples| part("a", 1000.0, samples));
        let mut joined = Recording::joined("all", parts.collect()).unwrap();
        let mut whole = part("all", 1000.0, &all);
        for recording in [&mut joined, &mut whole] {
            recording.set_scale(0, -2.0).unwrap();
        }
        let starts: Vec<u64> = joined.parts().map(|(start, _)| start).collect();
        assert_eq!(starts, [0, 30, 31]);
        assert_eq!(joined.frames(), 100);
        assert_eq!(joined.mean_at(0, 30), -2.0 * all[30]);
        let mean = -2.0 * all[..30].iter().sum::<f64>() / 30.0;
        assert!((joined.mean_at(0, 0) - mean).abs() < 1e-12);
        for range in [0..100, 5..40, 30..31, 29..33, 90..200] {
            let (a, b) = (joined.read(0, range.clone()), whole.read(0, range));
            assert_eq!(a.unwrap(), b.unwrap());
        }
        let blocks: Vec<f64> = (joined.blocks(&[0], 7))
            .flat_map(|block| block.unwrap().samples.concat())
            .collect();
        let doubled: Vec<f64> = all.iter().map(|x| -2.0 * x).collect();
        assert_eq!(blocks, doubled);
        let (a, b) = (&joined.channels()[0].health, &whole.channels()[0].health);
        assert!((a.mean - b.mean).abs() < 1e-12 && (a.rms - b.rms).abs() < 1e-12);
        assert_eq!(
            (a.peak, a.minimum, a.maximum),
            (b.peak, b.minimum, b.maximum)
        );
    }

    #[test]
    fn limit_unlike_files_are_refused_by_name() {
        let one = part("one.wav", 1000.0, &[1.0, 2.0]);
        let channels = vec![
            Channel {
                samples: vec![0.0, 1.0],
                ..Channel::default()
            };
            2
        ];
        let two = Recording::from_samples("two.wav", 1000.0, channels).unwrap();
        let fast = part("fast.wav", 2000.0, &[1.0, 2.0]);
        let mut named = part("named.wav", 1000.0, &[1.0, 2.0]);
        named.channels[0].name = Some("A".to_owned());
        for (other, words) in [(two, "2 channel"), (fast, "2000 Hz"), (named, "\"A\"")] {
            let name = other.name().to_owned();
            let text = Recording::joined("all", vec![one.clone(), other])
                .unwrap_err()
                .to_string();
            for part in [&name, "one.wav", words] {
                assert!(text.contains(part), "{text}");
            }
        }
        assert!(Recording::joined("none", Vec::new()).is_err());
        assert!(Recording::joined("many", vec![one; MOST_FILES + 1]).is_err());
    }
}
