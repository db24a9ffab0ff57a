//! Samples of a short recording, kept in memory while its file is read for the first time.

use super::Source;
use std::sync::Arc;

/// Most samples that are kept, over all channels (8 MB). A longer recording is read again from its file.
const MOST_KEPT: usize = 1 << 20;

/// Samples kept so far; none once they were too many.
#[derive(Debug)]
pub(super) struct KeptSamples {
    channels: Option<Vec<Vec<f64>>>,
    most: usize,
}

impl KeptSamples {
    /// Begins, for so many channels.
    pub fn new(channels: usize) -> Self {
        KeptSamples {
            channels: Some(vec![Vec::new(); channels]),
            most: MOST_KEPT / channels.max(1),
        }
    }

    /// Adds the next samples of a channel (0-based), in file units.
    pub fn add(&mut self, channel: usize, samples: &[f64]) {
        if let Some(own) = self.channels.as_mut().and_then(|all| all.get_mut(channel)) {
            match own.len() + samples.len() <= self.most {
                true => own.extend_from_slice(samples),
                false => self.channels = None,
            }
        }
    }

    /// The samples as a source of a recording, where all were kept; else the file they came from.
    pub fn or_file(self, file: impl Source + 'static) -> Arc<dyn Source> {
        match self.channels {
            Some(channels) => Arc::new(channels),
            None => Arc::new(file),
        }
    }
}
