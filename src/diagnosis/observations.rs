//! Facts that the observations of a test show before any model is fitted: up to which mode, which peaks belong to no
//! mode, and whether they show one structure at all.

use crate::settings::GapError;
use crate::structure::Nominal;
use crate::thresholds::Thresholds;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;
use tapjoint_identify::observation::{
    Configuration, DecayVerdict, ExtraPeak, Observations, ObservedMode, UNCLEAR, UNPAIRED,
};

/// Returns the highest mode that is shown by at least half of the recordings whose band reaches it; 0 without
/// any. A mode that one of many shows may be a stray peak at the end of its band, and is not used.
pub fn highest_mode(observations: &Observations) -> usize {
    let all = &observations.configurations;
    let mut highest = 0;
    for mode in all.iter().flat_map(|one| &one.modes) {
        let showing = all.iter().filter(|one| one.mode(mode.mode).is_some());
        let able = all
            .iter()
            .filter(|one| one.reaches(mode.frequency) || one.mode(mode.mode).is_some());
        if 2 * count_recordings(showing) >= count_recordings(able) {
            highest = highest.max(mode.mode);
        }
    }
    highest
}

/// Counts the recordings of some configurations: levels of one recording count once, given frequencies
/// for themselves.
fn count_recordings<'a>(configurations: impl Iterator<Item = &'a Configuration>) -> usize {
    let all: Vec<Option<usize>> = configurations.map(|one| one.recording).collect();
    let given = all.iter().filter(|recording| recording.is_none()).count();
    given + all.iter().flatten().collect::<BTreeSet<_>>().len()
}

/// Returns the observations without modes above this one.
pub fn up_to(highest: usize, observations: &Observations) -> Observations {
    let mut kept = observations.clone();
    for one in &mut kept.configurations {
        one.modes.retain(|mode| mode.mode <= highest);
    }
    kept
}

/// Returns the relative distance of the farthest peak that belongs to no mode and is so near that the fit has split
/// one decay between the two: what is then measured of the mode alone is unreliable. A joint whose
/// stiffness changes with the amplitude makes such pairs.
pub fn split_pole(
    configuration: &Configuration,
    mode: &ObservedMode,
    thresholds: &Thresholds,
) -> Option<f64> {
    let peaks = configuration.extra_peaks.iter();
    peaks
        .filter(|peak| peak.label == UNPAIRED)
        .map(|peak| (peak.frequency / mode.frequency - 1.0).abs())
        .filter(|distance| *distance < thresholds.split_pole)
        .max_by(f64::total_cmp)
}

/// Share of a change along the decay that remains uncertain in the frequency fitted to all of it (1): the average is
/// that of a small change, off by 15 % for one as large as the half-power width.
const AVERAGE_ERROR: f64 = 0.15;
/// Relative error of a modal constant per half-power width by which the frequency changes along the decay: the
/// exponential that extrapolates to the blow does not hold.
const CONSTANT_ERROR: f64 = 0.5;

/// Returns the relative standard uncertainty that a change along the decay adds to the frequency fitted to all of it.
pub fn average_std(mode: &ObservedMode) -> f64 {
    AVERAGE_ERROR * change_along_decay(mode).unwrap_or(0.0)
}

/// Returns the relative standard uncertainty that a change along the decay adds to a modal constant.
pub fn constant_model_std(mode: &ObservedMode) -> f64 {
    let damping = mode.damping.map(|damping| damping.value);
    let sweep_in_bandwidths = match (change_along_decay(mode), damping) {
        (Some(change), Some(damping)) if damping > 0.0 => 0.5 * change / damping,
        _ => 0.0,
    };
    CONSTANT_ERROR * sweep_in_bandwidths
}

/// Returns the change of the logarithm of the frequency along the followed decay; `None` where it is steady.
fn change_along_decay(mode: &ObservedMode) -> Option<f64> {
    let decay = mode.decay?;
    let (early, late) = (decay.early.frequency.value, decay.late.frequency.value);
    (decay.verdict != DecayVerdict::Steady).then(|| (early / late).ln().abs())
}

/// Refuses observations that cannot be diagnosed.
pub fn check(
    observations: &Observations,
    nominal: &Nominal,
    thresholds: &Thresholds,
) -> Result<(), GapError> {
    nominal.specimen.check()?;
    let tested = up_to(highest_mode(observations), observations);
    let mut tested = tested.configurations.iter().flat_map(|one| &one.modes);
    let modes = tested.clone().map(|mode| mode.mode);
    let modes = modes.collect::<BTreeSet<_>>().len();
    let needed = nominal.joint_parameters().len();
    let least = (needed + 1).max(2);
    if modes < least {
        return Err(GapError::TooFewModes {
            modes,
            needed,
            least,
        });
    }
    if !tested.any(|mode| mode.std.is_some_and(|std| std > 0.0)) {
        return Err(GapError::NoUncertainty);
    }
    check_same_modes(observations, thresholds.same_mode_ratio)?;
    check_same_peaks(observations, thresholds)?;
    check_sensors(observations, nominal, thresholds.node_displacement)
}

/// Returns the name of a configuration.
fn name_of(observations: &Observations, k: usize) -> String {
    let file = observations.configurations[k].file.clone();
    file.unwrap_or_else(|| format!("configuration {}", k + 1))
}

/// Refuses configurations with the same added masses that have a mode at very different frequencies.
fn check_same_modes(observations: &Observations, largest_ratio: f64) -> Result<(), GapError> {
    let all = &observations.configurations;
    for (second, configuration) in all.iter().enumerate() {
        for mode in &configuration.modes {
            for (first, other) in all[..second].iter().enumerate() {
                if let Some(known) = other.mode(mode.mode)
                    && other.masses == configuration.masses
                    && !(1.0 / largest_ratio..largest_ratio)
                        .contains(&(mode.frequency / known.frequency))
                {
                    return Err(GapError::Contradictory {
                        first: name_of(observations, first),
                        second: name_of(observations, second),
                        mode: mode.mode,
                        low: known.frequency,
                        high: mode.frequency,
                    });
                }
            }
        }
    }
    Ok(())
}

/// Refuses two configurations if each shares fewer than half of its peaks with the other, where the bands of
/// both reach. Peaks may be missing in one, where a sensor sits on nodes, or stray, but then most of the other's are
/// found. If the peaks follow each other in order, though farther apart, one structure was changed. If
/// most modes are the same, the other peaks (harmonics of a contact that rattles, say) belong to the structure. Both
/// are left to the diagnosis.
fn check_same_peaks(observations: &Observations, thresholds: &Thresholds) -> Result<(), GapError> {
    let moved = thresholds.moved_frequency;
    let all = &observations.configurations;
    for second in 0..all.len() {
        for first in (0..second).filter(|&first| all[first].masses == all[second].masses) {
            // The frequencies that both bands reach, less the shift of a peak across an end.
            let [(a, b), (c, d)] =
                [second, first].map(|k| all[k].band.unwrap_or((0.0, f64::INFINITY)));
            let band = a.max(c) * (1.0 + moved)..=b.min(d) * (1.0 - moved);
            let one = resonances(&all[second], &band);
            let other = resonances(&all[first], &band);
            // Most frequencies of both lie in pairs beside each other.
            let pairs = other.iter().zip(&one);
            let near = pairs.filter(|(a, b)| are_near(**a, **b, thresholds.changed_frequency));
            let are_in_order = 2 * near.count() > one.len().min(other.len());
            // Most modes with a number of either lie where the other has them.
            let counts = [first, second].map(|k| {
                let modes = all[k].modes.iter();
                modes.filter(|mode| band.contains(&mode.frequency)).count()
            });
            let alike = all[first].modes.iter().filter(|mode| {
                let known = all[second].mode(mode.mode);
                let is_alike =
                    known.is_some_and(|known| are_near(mode.frequency, known.frequency, moved));
                band.contains(&mode.frequency) && is_alike
            });
            let alike = alike.count();
            let share_modes =
                alike >= thresholds.least_shared_modes && 2 * alike > counts[0].max(counts[1]);
            let known = are_in_order || share_modes;
            let least = thresholds.least_peaks;
            let strangers = count_new(&one, &all[first], moved);
            if !known
                && one.len().min(other.len()) >= least
                && 2 * strangers > one.len()
                && 2 * count_new(&other, &all[second], moved) > other.len()
            {
                return Err(GapError::AnotherStructure {
                    first: name_of(observations, first),
                    second: name_of(observations, second),
                    strangers,
                    peaks: one.len(),
                    percent: 100.0 * moved,
                });
            }
        }
    }
    Ok(())
}

/// Band of frequencies (Hz).
type Band = RangeInclusive<f64>;

/// Returns whether two frequencies (Hz) differ by no more than a relative change.
fn are_near(frequency: f64, other: f64, change: f64) -> bool {
    (frequency / other - 1.0).abs() <= change
}

/// Counts the resonances (Hz) that a configuration does not have, not even `moved` by this relative change.
fn count_new(frequencies: &[f64], other: &Configuration, moved: f64) -> usize {
    let known = resonances(other, &(f64::NEG_INFINITY..=f64::INFINITY));
    let new = frequencies
        .iter()
        .filter(|own| known.iter().all(|other| !are_near(**own, *other, moved)));
    new.count()
}

/// Returns the frequencies of all resonances in a band (Hz), with a mode number or without, ascending.
fn resonances(configuration: &Configuration, band: &Band) -> Vec<f64> {
    let peaks = configuration.extra_peaks.iter();
    let unpaired = peaks.filter(|peak| peak.label == UNPAIRED);
    let modes = configuration.modes.iter().map(|mode| mode.frequency);
    let all = modes.chain(unpaired.map(|peak| peak.frequency));
    let mut all: Vec<f64> = all.filter(|frequency| band.contains(frequency)).collect();
    all.sort_by(f64::total_cmp);
    all
}

/// Refuses sensors that all sit at nodes of all modes: where the displacement is `least` of the largest or less.
fn check_sensors(
    observations: &Observations,
    nominal: &Nominal,
    least: f64,
) -> Result<(), GapError> {
    let configurations = observations.configurations.iter();
    let numbers = configurations.flat_map(|one| one.modes.iter().map(|mode| mode.mode));
    let highest = numbers.max().unwrap_or(1);
    let modes = nominal.modes(highest)?;
    let length = nominal.length();
    let mut largest: Option<f64> = None;
    for configuration in &observations.configurations {
        let sensors = configuration.sensors.iter();
        for position in sensors.filter_map(|sensor| sensor.position) {
            let seen = largest.get_or_insert(0.0);
            for mode in &configuration.modes {
                let top = (0..=100)
                    .map(|k| length * f64::from(k) / 100.0)
                    .map(|x| modes.displacement(mode.mode - 1, x).abs())
                    .fold(0.0, f64::max);
                *seen = seen.max(modes.displacement(mode.mode - 1, position).abs() / top);
            }
        }
    }
    if largest.is_some_and(|largest| largest < least) {
        return Err(GapError::SensorsAtNodes {
            percent: 100.0 * least,
            distance: 0.1 * length,
        });
    }
    Ok(())
}

/// Peaks of a test that belong to no mode.
#[derive(Debug, Clone, Default)]
pub struct UnpairedPeaks {
    /// Peaks that at least half of the recordings show whose band reaches them.
    pub all: Vec<UnpairedPeak>,
    /// Logarithms of the frequencies of peaks that fewer recordings show, clear resonances or not.
    pub doubtful: Vec<f64>,
    /// Logarithms of the lowest and the highest frequency of a mode; `None` where no peaks were searched.
    pub band: Option<(f64, f64)>,
    /// The highest frequency (Hz) that was looked at.
    pub end: f64,
    /// Configurations whose peaks were searched, with the logarithm of the least modal constant (1/kg) that is read;
    /// `None` where no peak shows it.
    pub searched: BTreeMap<usize, Option<f64>>,
}

/// Peak of no mode that several recordings show.
#[derive(Debug, Clone)]
pub struct UnpairedPeak {
    /// Logarithm of its frequency, the mean of the recordings.
    pub log: f64,
    /// Standard uncertainty of the logarithm as the frequency of a fixture (1).
    pub std: f64,
    /// Configurations, with the logarithm of its modal constant (1/kg).
    pub constants: Vec<(usize, f64)>,
}

/// Least relative uncertainty of a fixture's frequency from its peak: a rocking fixture has more
/// than one way to move, and its open size adds as much.
pub const FIXTURE_FREQUENCY_STD: f64 = 0.001;
/// Decibels of a factor of e: 20/ln 10.
pub const DECIBEL: f64 = 8.685_889_638_065_036;

impl UnpairedPeaks {
    /// Collects the peaks of all recordings; the first of several levels of one recording stands for it.
    pub fn new(observations: &Observations, thresholds: &Thresholds) -> Self {
        let mut searched: Vec<(usize, &Configuration)> = Vec::new();
        for (index, one) in observations.configurations.iter().enumerate() {
            let mut known = searched.iter();
            if one.recording.is_some() && known.all(|known| known.1.recording != one.recording) {
                searched.push((index, one));
            }
        }
        let modes = searched.iter().flat_map(|one| &one.1.modes);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for log in modes.map(|mode| mode.frequency.ln()) {
            (low, high) = (low.min(log), high.max(log));
        }
        let all = common_peaks(&searched, thresholds);
        // Peaks of single recordings beside their modes and the common peaks, without mains and the like.
        let peaks = searched.iter().flat_map(|(_, one)| &one.extra_peaks);
        let peaks = peaks.filter(|peak| [UNPAIRED, UNCLEAR].contains(&peak.label.as_str()));
        let doubtful = peaks.map(|peak| peak.frequency.ln()).filter(|log| {
            let mut common = all.iter();
            common.all(|one| (one.log - log).abs() >= thresholds.same_peak)
        });
        // A peak far over the noise would still be read if it were weaker by its distance to the readable level.
        let least = searched.iter().map(|(index, one)| {
            let peaks = one.extra_peaks.iter().filter(|peak| peak.label == UNPAIRED);
            let logs = peaks.filter_map(|peak| {
                let spare = (peak.level_db? - thresholds.readable_level).max(0.0);
                Some(peak.constant?.abs().ln() - spare / DECIBEL)
            });
            let logs = logs.filter(|log| log.is_finite());
            (*index, logs.min_by(f64::total_cmp))
        });
        // Frequencies read elsewhere show nothing above the highest.
        let ends = observations.configurations.iter().flat_map(|one| {
            let modes = one.modes.iter().map(|mode| mode.frequency);
            modes.chain(one.band.map(|band| band.1))
        });
        UnpairedPeaks {
            end: ends.fold(0.0, f64::max),
            doubtful: doubtful.collect(),
            searched: least.collect(),
            all,
            band: (low < high).then_some((low, high)),
        }
    }

    /// Returns whether a recording shows a peak within `distance` (1, relative) of this logarithm of a frequency. It may be
    /// the fixture's.
    pub fn is_doubtful(&self, log: f64, distance: f64) -> bool {
        self.doubtful
            .iter()
            .any(|peak| (peak - log).abs() < distance)
    }

    /// Returns whether this logarithm of a frequency lies between the lowest and the highest mode.
    pub fn contains(&self, log: f64) -> bool {
        self.band.is_some_and(|(low, high)| log > low && log < high)
    }
}

/// Returns the peaks that at least half of the recordings show whose band reaches them. They belong to no mode and are
/// no halves of a split decay.
fn common_peaks(
    searched: &[(usize, &Configuration)],
    thresholds: &Thresholds,
) -> Vec<UnpairedPeak> {
    let (split, same) = (thresholds.split_pole, thresholds.same_peak);
    let mut all: Vec<(f64, usize, &ExtraPeak)> = Vec::new();
    for (index, one) in searched {
        for peak in one.extra_peaks.iter().filter(|peak| peak.label == UNPAIRED) {
            let mut modes = one.modes.iter();
            if modes.all(|mode| (peak.frequency / mode.frequency - 1.0).abs() > split) {
                all.push((peak.frequency.ln(), *index, peak));
            }
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut means = Vec::new();
    for group in all.chunk_by(|a, b| b.0 - a.0 < same) {
        let shows = searched
            .iter()
            .map(|one| group.iter().any(|peak| peak.1 == one.0));
        let able = searched.iter().zip(shows.clone());
        let able = able.filter(|(one, shows)| *shows || one.1.reaches(group[0].0.exp()));
        if 2 * shows.filter(|shows| *shows).count() < able.count() {
            continue;
        }
        let count = group.len() as f64;
        let log = group.iter().map(|one| one.0).sum::<f64>() / count;
        let scatter = group.iter().map(|one| (one.0 - log).powi(2)).sum::<f64>() / count;
        let stds = group
            .iter()
            .map(|(_, _, peak)| peak.std.unwrap_or(0.0) / peak.frequency);
        let read = stds.fold(0.0, f64::max);
        let constants = group.iter();
        let constants = constants.filter_map(|one| Some((one.1, one.2.constant?.abs().ln())));
        means.push(UnpairedPeak {
            log,
            std: scatter.sqrt().hypot(read).hypot(FIXTURE_FREQUENCY_STD),
            constants: constants.filter(|one| one.1.is_finite()).collect(),
        });
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;
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
    fn limit_peaks_count_that_half_of_the_recordings_show_and_that_belong_to_no_mode() {
        let lone = UNPAIRED;
        let configurations = vec![
            recording(0, &[(50.0, "mains 50 Hz"), (183.3, lone), (700.0, lone)]),
            // Another level of the same recording.
            recording(0, &[(183.3, lone), (700.0, lone)]),
            recording(1, &[(50.0, "mains 50 Hz"), (183.4, lone), (1390.0, lone)]),
            // Two of one recording are one sighting.
            recording(2, &[(900.0, lone), (901.0, lone), (1390.0, lone)]),
        ];
        let peaks = UnpairedPeaks::new(&Observations { configurations }, &Thresholds::DEFAULT);
        assert_eq!(peaks.all.len(), 1);
        assert!((peaks.all[0].log - 183.35_f64.ln()).abs() < 1e-6);
        assert_eq!(peaks.all[0].constants.len(), 2);
        assert!(peaks.contains(183.0_f64.ln()) && !peaks.contains(1500.0_f64.ln()));
        // A peak of one recording may still be a fixture's; a peak of most recordings states its frequency.
        let near = Thresholds::DEFAULT.near_fixture;
        let doubtful =
            [688.0, 712.0, 730.0, 183.0, 50.0].map(|f: f64| peaks.is_doubtful(f.ln(), near));
        assert_eq!(doubtful, [true, true, false, false, false]);
        // 45 dB over the noise is 30 more than it takes: a constant 31.6 times smaller would do.
        let weakest = peaks.searched[&0].unwrap();
        assert!((weakest - (0.2 / 10.0_f64.powf(1.5)).ln()).abs() < 1e-9);
    }

    #[test]
    fn limit_frequencies_read_elsewhere_say_nothing_of_peaks() {
        let mut one = recording(0, &[]);
        one.recording = None;
        let configurations = vec![one];
        let peaks = UnpairedPeaks::new(&Observations { configurations }, &Thresholds::DEFAULT);
        assert!(peaks.all.is_empty() && !peaks.contains(100.0_f64.ln()));
    }
}
