//! Peaks that belong to no mode, as all recordings show them.

use super::setup::TWIN;
use tapjoint_identify::observation::{Configuration, Observations, UNCLEAR, UNPAIRED};

/// The peaks of a test that belong to no mode, and where such peaks can be told.
#[derive(Debug, Clone, Default)]
pub(super) struct Peaks {
    /// Those that at least half of the recordings show, of which the band reaches to them.
    pub(super) all: Vec<Peak>,
    /// Logarithms of the frequencies of peaks that fewer show, be they clear resonances or not.
    pub(super) hints: Vec<f64>,
    /// Logarithms of the lowest and the highest frequency of a mode; `None` where nobody looked for peaks.
    pub(super) band: Option<(f64, f64)>,
    /// The configurations that were looked at, with the logarithm of the modal constant (1/kg) from which peaks
    /// are read where a weak one was.
    pub(super) looked: Vec<(usize, Option<f64>)>,
}

/// A peak that several recordings show.
#[derive(Debug, Clone)]
pub(super) struct Peak {
    /// Logarithm of its frequency, the mean of the recordings.
    pub(super) log: f64,
    /// Standard uncertainty of that for what it states of the fixture (1).
    pub(super) std: f64,
    /// Configurations with the logarithm of its modal constant (1/kg).
    pub(super) constants: Vec<(usize, f64)>,
}

/// A peak in one recording.
struct Sighting {
    configuration: usize,
    log: f64,
    /// Relative uncertainty of its frequency (1).
    std: f64,
    /// Logarithm of its modal constant (1/kg).
    constant: Option<f64>,
}

/// Relative distance within which two recordings show the same peak: sensors that move load a fixture's
/// mode and a joint that drifts turns it by less.
const SAME: f64 = 0.005;
/// Least relative uncertainty with which a peak states a fixture's frequency: a rocking fixture has more
/// than one way to move, and what the size leaves open comes to as much.
pub(super) const STATED: f64 = 0.001;

impl Peaks {
    pub(super) fn new(observations: &Observations) -> Self {
        // Of several levels of one recording the first stands for it.
        let mut looked: Vec<(usize, &Configuration)> = Vec::new();
        for (index, one) in observations.configurations.iter().enumerate() {
            let known = |other: &(usize, &Configuration)| other.1.recording == one.recording;
            if one.recording.is_some() && !looked.iter().any(known) {
                looked.push((index, one));
            }
        }
        let modes = looked.iter().flat_map(|one| &one.1.modes);
        let logs = modes.map(|mode| mode.frequency.ln());
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), log| {
            (low.min(log), high.max(log))
        });
        let all = common(&looked);
        let weakest = looked.iter().map(|(index, one)| (*index, weakest_of(one)));
        Peaks {
            hints: hints(&looked, &all),
            all,
            band: (low < high).then_some((low, high)),
            looked: weakest.collect(),
        }
    }

    /// Whether some recording shows a peak about as far from here as the frequency of a fixture is open that no peak
    /// states.
    pub(super) fn is_hinted(&self, log: f64) -> bool {
        self.hints.iter().any(|hint| (hint - log).abs() < OPEN)
    }

    pub(super) fn contains(&self, log: f64) -> bool {
        self.band.is_some_and(|(low, high)| log > low && log < high)
    }
}

/// Relative distance up to which a peak may be that of a fixture whose frequency the modes of the beam alone tell: to
/// about one percent, so that this is two standard deviations.
const OPEN: f64 = 0.02;

/// Peaks that a recording shows beside its modes and those that most of them show; mains and the like are none.
fn hints(looked: &[(usize, &Configuration)], common: &[Peak]) -> Vec<f64> {
    let peaks = looked.iter().flat_map(|(_, one)| &one.extra_peaks);
    let nobodys = peaks.filter(|peak| [UNPAIRED, UNCLEAR].contains(&peak.label.as_str()));
    let logs = nobodys.map(|peak| peak.frequency.ln());
    let is_common = |log: f64| common.iter().any(|one| (one.log - log).abs() < SAME);
    logs.filter(|log| !is_common(*log)).collect()
}

/// Level over the noise (dB) that a peak needs to be read, as the search for resonances asks for unless told
/// otherwise. Where the level is a peak's height over its surroundings, which is less, it is on the safe side.
const NEEDED: f64 = 15.0;

/// Logarithm of the modal constant from which peaks are read: one that was read far over the noise would
/// have been read had it been weaker by as much.
fn weakest_of(one: &Configuration) -> Option<f64> {
    let peaks = one.extra_peaks.iter().filter(|peak| peak.label == UNPAIRED);
    peaks
        .filter_map(|peak| {
            let spare = (peak.level_db? - NEEDED).max(0.0);
            Some(peak.constant?.abs().ln() - spare / DECIBEL)
        })
        .filter(|log| log.is_finite())
        .min_by(f64::total_cmp)
}

/// Decibels of a factor of e: 20/ln 10.
pub(super) const DECIBEL: f64 = 8.685_889_638_065_036;

/// The peaks that at least half of the recordings show, of which the band reaches to them.
fn common(looked: &[(usize, &Configuration)]) -> Vec<Peak> {
    let mut all: Vec<Sighting> = looked.iter().flat_map(lone).collect();
    all.sort_by(|a, b| a.log.total_cmp(&b.log));
    let groups = all.chunk_by(|a, b| b.log - a.log < SAME);
    groups
        .filter(|group| {
            let could = |one: &&(usize, &Configuration)| {
                let mut own = group.iter().filter(|peak| peak.configuration == one.0);
                one.1.reaches(group[0].log.exp()) || own.next().is_some()
            };
            2 * recordings(group) >= looked.iter().filter(could).count()
        })
        .map(|group| {
            let count = group.len() as f64;
            let log = group.iter().map(|one| one.log).sum::<f64>() / count;
            let scatter = group.iter().map(|one| (one.log - log).powi(2)).sum::<f64>() / count;
            let read = group.iter().map(|one| one.std).fold(0.0, f64::max);
            let std = scatter.sqrt().hypot(read).hypot(STATED);
            let constant = |one: &Sighting| Some((one.configuration, one.constant?));
            let constants = group.iter().filter_map(constant).collect();
            Peak {
                log,
                std,
                constants,
            }
        })
        .collect()
}

/// How many recordings show it.
fn recordings(group: &[Sighting]) -> usize {
    let mut all: Vec<usize> = group.iter().map(|one| one.configuration).collect();
    all.sort_unstable();
    all.dedup();
    all.len()
}

/// The peaks of a recording that are nobody's and no halves of a split decay.
fn lone((index, one): &(usize, &Configuration)) -> Vec<Sighting> {
    let apart = |frequency: f64| {
        let mut modes = one.modes.iter();
        modes.all(|mode| (frequency / mode.frequency - 1.0).abs() > TWIN)
    };
    let peaks = one.extra_peaks.iter();
    peaks
        .filter(|peak| peak.label == UNPAIRED && apart(peak.frequency))
        .map(|peak| Sighting {
            configuration: *index,
            log: peak.frequency.ln(),
            std: peak.std.unwrap_or(0.0) / peak.frequency,
            constant: peak
                .constant
                .map(|constant| constant.abs().ln())
                .filter(|constant| constant.is_finite()),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_identify::observation::{ExtraPeak, ObservedMode};

    fn recording(index: usize, peaks: &[(f64, &str)]) -> Configuration {
        let peak = |(frequency, label): &(f64, &str)| ExtraPeak {
            frequency: *frequency,
            std: Some(0.01),
            level_db: Some(45.0),
            constant: Some(-0.2),
            label: (*label).to_owned(),
        };
        Configuration {
            file: None,
            recording: Some(index),
            sensors: Vec::new(),
            masses: Vec::new(),
            tap: None,
            peak_force: None,
            level: None,
            taps: 3,
            decay_seconds: None,
            band: None,
            modes: [16.0, 1400.0]
                .iter()
                .zip(1..)
                .map(|(f, mode)| ObservedMode::read_elsewhere(mode, *f, None))
                .collect(),
            covariance: None,
            common: 0.0,
            extra_peaks: peaks.iter().map(peak).collect(),
        }
    }

    #[test]
    fn limit_peaks_count_that_half_of_the_recordings_show_and_that_are_nobodys() {
        let lone = UNPAIRED;
        let configurations = vec![
            recording(0, &[(50.0, "mains 50 Hz"), (183.3, lone), (700.0, lone)]),
            // Another level of the same recording.
            recording(0, &[(183.3, lone), (700.0, lone)]),
            recording(1, &[(50.0, "mains 50 Hz"), (183.4, lone), (1390.0, lone)]),
            // Two of one recording are one sighting.
            recording(2, &[(900.0, lone), (901.0, lone), (1390.0, lone)]),
        ];
        let peaks = Peaks::new(&Observations { configurations });
        assert_eq!(peaks.all.len(), 1);
        assert!((peaks.all[0].log - 183.35_f64.ln()).abs() < 1e-6);
        assert_eq!(peaks.all[0].constants.len(), 2);
        assert!(peaks.contains(183.0_f64.ln()) && !peaks.contains(1500.0_f64.ln()));
        // What one recording shows may be a fixture's all the same; what most show states where it is.
        let hinted = [688.0, 712.0, 730.0, 183.0, 50.0].map(|f: f64| peaks.is_hinted(f.ln()));
        assert_eq!(hinted, [true, true, false, false, false]);
        // 45 dB over the noise is 30 more than it takes: a constant 31.6 times smaller would do.
        let weakest = peaks.looked[0].1.unwrap();
        assert!((weakest - (0.2 / 10.0_f64.powf(1.5)).ln()).abs() < 1e-9);
    }

    #[test]
    fn limit_frequencies_read_elsewhere_say_nothing_of_peaks() {
        let mut one = recording(0, &[]);
        one.recording = None;
        let configurations = vec![one];
        let peaks = Peaks::new(&Observations { configurations });
        assert!(peaks.all.is_empty() && !peaks.contains(100.0_f64.ln()));
    }
}
