//! What must hold before there is anything to diagnose.

use super::common_modes::{highest_mode, up_to};
use super::error::GapError;
use super::nominal::Nominal;
use tapjoint_beam::specimen::Mesh;
use tapjoint_identify::observation::{Configuration, Observations, UNPAIRED};

/// Ratio of frequencies of one mode between configurations beyond which they are of two structures: a
/// heavy sensor or a re-tightened joint moves a frequency by up to 15 %.
const APART: f64 = 1.3;

/// Displacement at a sensor over the mode's largest, below which nothing is seen (1).
const NODE: f64 = 0.01;

/// Refuses observations that answer nothing.
pub(super) fn check(observations: &Observations, nominal: &Nominal) -> Result<(), GapError> {
    nominal.specimen.check()?;
    let tested = up_to(highest_mode(observations), observations);
    enough_modes(&tested, nominal)?;
    let known = tested
        .configurations
        .iter()
        .flat_map(|c| &c.modes)
        .any(|mode| mode.std.is_some_and(|std| std > 0.0));
    if !known {
        return Err(GapError::NoUncertainty);
    }
    one_structure(observations)?;
    same_peaks(observations)?;
    sensors_see(observations, nominal)
}

fn enough_modes(observations: &Observations, nominal: &Nominal) -> Result<(), GapError> {
    let mut modes: Vec<usize> = observations
        .configurations
        .iter()
        .flat_map(|c| c.modes.iter().map(|mode| mode.mode))
        .collect();
    modes.sort_unstable();
    modes.dedup();
    let needed = nominal.sought().len();
    let least = needed + 1;
    if modes.len() < least.max(2) {
        return Err(GapError::TooFewModes {
            modes: modes.len(),
            needed,
            least: least.max(2),
        });
    }
    Ok(())
}

/// How a configuration is called.
fn name_of(observations: &Observations, k: usize) -> String {
    let file = observations.configurations[k].file.clone();
    file.unwrap_or_else(|| format!("configuration {}", k + 1))
}

/// Peaks from which on a configuration shows a structure of its own.
const LEAST_PEAKS: usize = 4;
/// What moved sensors and another level move a frequency by at most (1, relative).
const MOVED: f64 = 0.05;
/// What a mass that nobody spoke of, or a joint that was tightened again, moves one by.
const CHANGED: f64 = 0.15;

/// Refuses configurations of which each has fewer than half of its peaks in common with the other, where the bands of
/// both reach: peaks may be missing in one, where a sensor sits on nodes, or stray, but then most of the other's are
/// found. Where the peaks follow each other in order, if farther apart, something was changed on one structure, and
/// where most modes are the same what else there is (harmonics of a contact that rattles, say) belongs to it: that is
/// for the diagnosis.
fn same_peaks(observations: &Observations) -> Result<(), GapError> {
    let all = &observations.configurations;
    let peaks: Vec<Vec<f64>> = all.iter().map(peaks_of).collect();
    for second in 0..all.len() {
        for first in (0..second).filter(|&first| all[first].masses == all[second].masses) {
            let within = overlap(&all[second], &all[first]);
            let one = Peaks::new(&peaks[second], &peaks[first], within);
            let other = Peaks::new(&peaks[first], &peaks[second], within);
            let known = are_in_order(&other.shared, &one.shared)
                || share_modes([&all[first], &all[second]], within);
            if !known && one.are_most_strange() && other.are_most_strange() {
                return Err(GapError::AnotherStructure {
                    first: name_of(observations, first),
                    second: name_of(observations, second),
                    strangers: one.strangers,
                    peaks: one.shared.len(),
                    percent: 100.0 * MOVED,
                });
            }
        }
    }
    Ok(())
}

/// Modes that two configurations have in common, from which on they show one structure: two may agree by chance.
const LEAST_MODES: usize = 3;

/// Whether most modes with a number of either, between these frequencies (Hz), lie where the other has them.
fn share_modes([one, other]: [&Configuration; 2], (low, high): (f64, f64)) -> bool {
    let inside = |frequency: f64| low <= frequency && frequency <= high;
    let count = |all: &Configuration| {
        let modes = all.modes.iter();
        modes.filter(|mode| inside(mode.frequency)).count()
    };
    let modes = one.modes.iter().filter(|mode| inside(mode.frequency));
    let pairs = modes.filter_map(|mode| Some((mode.frequency, other.mode(mode.mode)?.frequency)));
    let alike = pairs.filter(|&(a, b)| is_near(a, b)).count();
    alike >= LEAST_MODES && 2 * alike > count(one).max(count(other))
}

/// Whether a frequency may be another one that has moved (both in Hz).
fn is_near(frequency: f64, other: f64) -> bool {
    (frequency / other - 1.0).abs() <= MOVED
}

/// The peaks of one configuration where another looked too.
struct Peaks {
    /// Their frequencies (Hz), ascending.
    shared: Vec<f64>,
    /// How many of them the other does not have.
    strangers: usize,
}

impl Peaks {
    fn new(own: &[f64], other: &[f64], (low, high): (f64, f64)) -> Self {
        let shared = own.iter().filter(|&&own| low <= own && own <= high);
        let shared: Vec<f64> = shared.copied().collect();
        let strange = |own: &&f64| !other.iter().any(|other| is_near(**own, *other));
        let strangers = shared.iter().filter(strange).count();
        Peaks { shared, strangers }
    }

    fn are_most_strange(&self) -> bool {
        self.shared.len() >= LEAST_PEAKS && 2 * self.strangers > self.shared.len()
    }
}

/// Frequencies that both bands reach (Hz), less what a peak near an end may have moved across it by.
fn overlap(one: &Configuration, other: &Configuration) -> (f64, f64) {
    let bands = [one, other].map(|one| one.band.unwrap_or((0.0, f64::INFINITY)));
    let low = bands[0].0.max(bands[1].0);
    let high = bands[0].1.min(bands[1].1);
    (low * (1.0 + MOVED), high * (1.0 - MOVED))
}

/// Whether most frequencies of two ascending lists lie in pairs beside each other.
fn are_in_order(one: &[f64], other: &[f64]) -> bool {
    let pairs = one.iter().zip(other);
    let near = pairs
        .filter(|(a, b)| (*a / *b - 1.0).abs() <= CHANGED)
        .count();
    2 * near > one.len().min(other.len())
}

/// Frequencies of all its resonances (Hz), with a number or without, ascending.
fn peaks_of(configuration: &Configuration) -> Vec<f64> {
    let resonances = configuration.extra_peaks.iter();
    let extra = resonances.filter(|peak| peak.label == UNPAIRED);
    let modes = configuration.modes.iter().map(|mode| mode.frequency);
    let mut all: Vec<f64> = modes.chain(extra.map(|peak| peak.frequency)).collect();
    all.sort_by(f64::total_cmp);
    all
}

fn one_structure(observations: &Observations) -> Result<(), GapError> {
    let name = |k: usize| name_of(observations, k);
    for (second, configuration) in observations.configurations.iter().enumerate() {
        for mode in &configuration.modes {
            for first in 0..second {
                let other = &observations.configurations[first];
                // What is fastened moves frequencies further.
                let Some(other) = other
                    .mode(mode.mode)
                    .filter(|_| other.masses == configuration.masses)
                else {
                    continue;
                };
                let ratio = mode.frequency / other.frequency;
                if !(1.0 / APART..APART).contains(&ratio) {
                    return Err(GapError::Contradictory {
                        first: name(first),
                        second: name(second),
                        mode: mode.mode,
                        low: other.frequency,
                        high: mode.frequency,
                    });
                }
            }
        }
    }
    Ok(())
}

/// Sensors at the joint, or all at the nodes of all modes.
fn sensors_see(observations: &Observations, nominal: &Nominal) -> Result<(), GapError> {
    let highest = observations
        .configurations
        .iter()
        .flat_map(|c| c.modes.iter().map(|mode| mode.mode))
        .max()
        .unwrap_or(1);
    let modes = nominal.specimen.modes(highest, Mesh::DIAGNOSIS)?;
    let length = nominal.specimen.body.length();
    let mut largest: f64 = 0.0;
    let mut placed = false;
    for configuration in &observations.configurations {
        for position in configuration
            .sensors
            .iter()
            .filter_map(|sensor| sensor.position)
        {
            placed = true;
            for mode in &configuration.modes {
                let at = |x: f64| modes.displacement(mode.mode - 1, x).abs();
                let top = (0..=100)
                    .map(|k| at(length * f64::from(k) / 100.0))
                    .fold(0.0, f64::max);
                largest = largest.max(at(position) / top);
            }
        }
    }
    if placed && largest < NODE {
        return Err(GapError::SensorsAtNodes {
            percent: 100.0 * NODE,
            distance: 0.1 * length,
        });
    }
    Ok(())
}
