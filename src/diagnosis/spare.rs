//! Data that take no part in anything but the closure: what a name would close of the gap elsewhere is an honest figure only
//! where it did not help to choose the name.

use crate::observations::up_to;
use crate::settings::{ANOTHER_LEVEL, GapSettings};
use tapjoint_identify::observation::{Configuration, Observations};

/// Number of modes or of recordings that are spared. One alone says little about a root mean square.
const SPARED: usize = 2;

/// What is spared of a test: the highest modes, else recordings that others repeat.
pub struct SpareData {
    /// Number of the highest modes that are spared.
    pub modes: usize,
    /// The highest mode that is not.
    pub highest: usize,
    /// The recordings that are spared.
    pub recordings: Vec<Option<usize>>,
}

impl SpareData {
    /// Chooses what to spare of observations with this highest mode.
    pub fn new(observations: &Observations, highest: usize, settings: &GapSettings) -> Self {
        let mut spare = SpareData {
            modes: 0,
            highest,
            recordings: Vec::new(),
        };
        if highest >= settings.spare_modes_from {
            spare.modes = SPARED;
            spare.highest -= SPARED;
            return spare;
        }
        let mut kept: Vec<&Configuration> = Vec::new();
        let mut repeated: Vec<Option<usize>> = Vec::new();
        let recordings = observations.configurations.iter();
        for one in recordings.filter(|one| one.recording.is_some()) {
            if kept.iter().any(|other| are_alike(one, other)) {
                repeated.push(one.recording);
            } else {
                kept.push(one);
            }
        }
        // A recording whose other level is not repeated stays.
        repeated.retain(|recording| kept.iter().all(|one| one.recording != *recording));
        repeated.dedup();
        let mut all: Vec<Option<usize>> = observations
            .configurations
            .iter()
            .map(|one| one.recording)
            .collect();
        all.dedup();
        if all.len() >= settings.spare_recordings_from && repeated.len() >= SPARED {
            spare.recordings = repeated.split_off(repeated.len() - SPARED);
        }
        spare
    }

    /// Returns the observations without what is spared.
    pub fn without(&self, observations: &Observations) -> Observations {
        let mut kept = up_to(self.highest, observations);
        for one in &mut kept.configurations {
            if self.recordings.contains(&one.recording) {
                one.modes.clear();
                one.extra_peaks.clear();
                // It counts for no recording that could show a peak.
                one.recording = None;
                one.band = None;
            }
        }
        kept
    }
}

/// Returns whether two configurations load the structure alike, at the same level: only the hammer may strike elsewhere.
fn are_alike(one: &Configuration, other: &Configuration) -> bool {
    let levels = one.level.zip(other.level);
    let ratio = levels.map_or(0.0, |(a, b)| (a / b).ln().abs());
    one.sensors == other.sensors && one.masses == other.masses && ratio < ANOTHER_LEVEL.ln()
}
