//! Finding resonances: prominence, height over the noise, separation, number.

use std::f64::consts::LN_2;

use num_complex::Complex64;

use crate::spectral::Lines;
use tapjoint_numerics::stats::{Sorted, median};

/// Level of a spectrum over all sensors, and of its noise, line by line.
#[derive(Debug, Clone, PartialEq)]
pub struct CompositeLevel {
    /// The axis.
    pub lines: Lines,
    /// Level (dB, arbitrary reference).
    pub level_db: Vec<f64>,
    /// Level that noise alone would have (dB, same reference); `None` where nothing is known.
    pub noise_db: Option<Vec<f64>>,
}

impl CompositeLevel {
    /// Combines the powers of several sensors. Each is scaled by its own median over the lines, so
    /// that sensors of different kind or sensitivity count alike.
    ///
    /// `noise` are the powers that noise alone would leave, per sensor, where known.
    pub fn new(lines: Lines, powers: &[Vec<f64>], noise: Option<&[Vec<f64>]>) -> Self {
        let mut weights = Vec::with_capacity(powers.len());
        for power in powers {
            let mut positive: Vec<f64> = power.iter().copied().filter(|&v| v > 0.0).collect();
            let scale = median(&mut positive).max(f64::MIN_POSITIVE);
            weights.push(1.0 / scale / powers.len() as f64);
        }
        CompositeLevel {
            lines,
            level_db: weighted_db(powers, &weights, lines.points()),
            noise_db: noise.map(|noise| weighted_db(noise, &weights, lines.points())),
        }
    }
}

/// Lines to either side over which the noise of a function is taken. 50: a resonance some lines wide among them
/// does not move their median.
const NOISE_REACH: usize = 50;
/// Lines between the values of a difference. 2: neighbours share a part of their noise under a Hann window.
const NOISE_STEP: usize = 2;

/// Returns the noise power of a frequency response function, line by line (its unit squared).
///
/// Modes are smooth over the lines, noise is not. The third difference H(k) - 3 H(k+2) + 3 H(k+4) - H(k+6) has
/// 1 + 9 + 9 + 1 = 20 times the power of white noise. The median of an exponential distribution is ln 2 of its mean.
/// Under a Hann window the result is 1.2 dB too low: noise on lines two apart has a correlation of 1/6.
/// A function without any noise gets the little that its curvature leaves.
pub fn noise_of_function(values: &[Complex64]) -> Vec<f64> {
    let rough: Vec<f64> = values
        .windows(3 * NOISE_STEP + 1)
        .map(|line| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|place| line[place * NOISE_STEP]);
            (a - d + 3.0 * (c - b)).norm_sqr()
        })
        .collect();
    let mut noise = Vec::with_capacity(values.len());
    let (mut about, mut taken) = (Sorted::default(), 0..0);
    for line in 0..values.len() {
        let end = (line + NOISE_REACH).min(rough.len());
        let first = line.saturating_sub(NOISE_REACH).min(end.saturating_sub(1));
        rough[taken.end..end].iter().for_each(|x| about.insert(*x));
        rough[taken.start..first]
            .iter()
            .for_each(|x| about.remove(*x));
        taken = first..end;
        noise.push(about.median() / (20.0 * LN_2));
    }
    noise
}

fn weighted_db(powers: &[Vec<f64>], weights: &[f64], points: usize) -> Vec<f64> {
    let mut levels = vec![0.0; points];
    for (power, weight) in powers.iter().zip(weights) {
        for (sum, power) in levels.iter_mut().zip(power) {
            *sum += weight * power;
        }
    }
    for level in &mut levels {
        // A power of exactly zero has no level; -400 dB keeps it out of every comparison.
        *level = match *level > 0.0 {
            true => 10.0 * level.log10(),
            false => -400.0,
        };
    }
    levels
}

/// Settings of the search for resonances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakSettings {
    /// Least prominence (dB): how far the level falls on both sides before it rises above the peak.
    /// 2 dB, where noise allows it: two equal resonances two half-power widths apart still have it; of
    /// nearer or unequal ones only the higher is seen. The ripple that noise puts on a level comes on top.
    pub prominence_db: f64,
    /// Least prominence where nothing is known of the noise (dB). 8 dB.
    pub blind_prominence_db: f64,
    /// Least height above the noise (dB). 15 dB: noise alone passes it on one line in 10^13.
    pub above_noise_db: f64,
    /// Least distance of two peaks (lines, or resolution widths 1/T where those are wider). 3: two
    /// peaks nearer than that share their flanks.
    pub separation: usize,
    /// At most so many peaks, the most prominent ones. 60.
    pub most: usize,
}

impl Default for PeakSettings {
    fn default() -> Self {
        PeakSettings {
            prominence_db: 2.0,
            blind_prominence_db: 8.0,
            above_noise_db: 15.0,
            separation: 3,
            most: 60,
        }
    }
}

/// A local maximum that counts as a resonance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Index of its line.
    pub index: usize,
    /// Prominence (dB).
    pub prominence_db: f64,
    /// Height above the noise (dB), where the noise is known.
    pub above_noise_db: Option<f64>,
}

/// Finds the resonances of a composite level, ascending in frequency.
///
/// The first two resolution widths are left out: drift and offsets live there.
pub fn find_peaks(level: &CompositeLevel, settings: &PeakSettings) -> Vec<Peak> {
    let lines = &level.lines;
    let first = lines.frequency(0);
    let db = &level.level_db;
    let mut peaks: Vec<Peak> = Vec::new();
    for index in 1..db.len().saturating_sub(1) {
        // The first line of a plateau stands for it.
        let is_maximum = db[index] > db[index - 1] && db[index] >= db[index + 1];
        let is_drift = first <= 0.0 && lines.frequency(index) <= 2.0 * lines.resolution();
        if !is_maximum || is_drift {
            continue;
        }
        let above_noise_db = (level.noise_db.as_ref()).map(|noise| db[index] - noise[index]);
        let least = match above_noise_db {
            // Noise s dB below a level makes it ripple by 8.7 10^(-s/20) dB; six times that is out of its
            // reach on any line.
            Some(above) => settings.prominence_db + 6.0 * 8.7 * 10f64.powf(-above / 20.0),
            None => settings.blind_prominence_db,
        };
        let Some(prominence_db) = prominence(db, index, least) else {
            continue;
        };
        let peak = Peak {
            index,
            prominence_db,
            above_noise_db,
        };
        // Where no noise is known, the height is that over the median of the surroundings: 25 lines or a tenth of
        // the position to either side, whichever is more. A peak of noise stands at most some 12 dB above it.
        let height = peak.above_noise_db.unwrap_or_else(|| {
            let reach = (index / 10).max(25);
            let last = (index + reach + 1).min(db.len());
            db[index] - median(&mut db[index.saturating_sub(reach)..last].to_vec())
        });
        if height >= settings.above_noise_db {
            peaks.push(peak);
        }
    }
    peaks.sort_by(|a, b| b.prominence_db.total_cmp(&a.prominence_db));
    let width = (lines.resolution() / lines.spacing).ceil().max(1.0) as usize;
    let separation = settings.separation.saturating_mul(width);
    let mut kept: Vec<Peak> = Vec::new();
    for peak in peaks {
        let mut others = kept.iter();
        let clear = others.all(|other| peak.index.abs_diff(other.index) >= separation);
        if clear && kept.len() < settings.most {
            kept.push(peak);
        }
    }
    kept.sort_by_key(|peak| peak.index);
    kept
}

/// Returns the height over the higher of the two lowest points between the peak and the next higher ground; `None` where
/// that is less than `least`. A side that meets the end of the axis before higher ground says nothing: the band just ends
/// there, perhaps on the flank. The highest peak of all stands over the lower of its two sides.
fn prominence(level: &[f64], index: usize, least: f64) -> Option<f64> {
    let height = level[index];
    let [mut left, mut right] = [Valley::Open(height); 2];
    let mut distance = 1;
    // Both sides at once: the nearer higher ground decides about most peaks.
    let prominence = loop {
        left.widen(
            index.checked_sub(distance).map(|place| level[place]),
            height,
        );
        right.widen(level.get(index + distance).copied(), height);
        distance += 1;
        match (left, right) {
            (Valley::Closed(low), _) | (_, Valley::Closed(low)) if height - low < least => {
                return None;
            }
            (Valley::Closed(left), Valley::Closed(right)) => break height - left.max(right),
            (Valley::Ended(left), Valley::Ended(right)) => break height - left.min(right),
            (Valley::Closed(low), Valley::Ended(_)) | (Valley::Ended(_), Valley::Closed(low)) => {
                break height - low;
            }
            (Valley::Open(_), _) | (_, Valley::Open(_)) => {}
        }
    };
    (prominence >= least).then_some(prominence)
}

/// The lowest level on one side of a peak.
#[derive(Clone, Copy)]
enum Valley {
    /// Higher ground may still come.
    Open(f64),
    /// Up to higher ground.
    Closed(f64),
    /// Up to the end of the axis.
    Ended(f64),
}

impl Valley {
    /// Takes the next level, if there is one; `height` is the peak's.
    fn widen(&mut self, next: Option<f64>, height: f64) {
        if let Valley::Open(low) = *self {
            *self = match next {
                None => Valley::Ended(low),
                Some(level) if level > height => Valley::Closed(low),
                Some(level) => Valley::Open(low.min(level)),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A mode of ten lines' half width with noise of power 2 on its lines.
    #[test]
    fn prop_the_noise_of_a_function_is_that_of_its_lines() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let values: Vec<Complex64> = (0..1000)
            .map(|line| {
                let [re, im]: [f64; 2] = [(); 2].map(|()| StandardNormal.sample(&mut random));
                Complex64::new(re, im) + 1e3 / Complex64::new(10.0, f64::from(line) - 500.0)
            })
            .collect();
        let noise = noise_of_function(&values);
        let mean = noise[50..400].iter().sum::<f64>() / 350.0;
        // Medians of 350 lines, whose differences share values: some 10 % for one standard deviation.
        assert!((1.4..2.6).contains(&mean), "{mean}");
        // The mode's level is 10^4 at its peak: it does not hide itself.
        assert!(noise[500] < 10.0, "{}", noise[500]);
    }

    #[test]
    fn limit_the_noise_of_few_lines() {
        assert_eq!(noise_of_function(&[Complex64::ONE; 3]), vec![0.0; 3]);
        assert_eq!(noise_of_function(&[]), Vec::<f64>::new());
    }
}
