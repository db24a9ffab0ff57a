//! A second hit within one tap's record.
//!
//! Two rules look at the unwindowed force. A second excursion above a tenth of the peak is one,
//! whatever its exact form, unless it is ringing or far wider or narrower than a blow. Below that, a
//! weaker copy of the tap's own pulse is looked for. In the force spectrum such a copy is a ripple of period
//! 1/delay and depth (1 + r)/(1 - r), for |1 + r e^{-j omega d}| swings between 1 + r and 1 - r. The
//! spectrum cannot distinguish a ripple of long period from the pulse's own fall; the search in time can.

use super::search::{Force, half_width};
use super::{Event, TapSettings};
use tapjoint_numerics::stats::median;

/// Candidates are looked at from this share of the limit: what smoothing and noise may take away.
const CANDIDATE: f64 = 0.7;
/// Candidates stand out of the channel's disturbances by this factor: noise reaches 4.5 standard
/// deviations in 65,536 samples, a steady hum 1.4.
const OVER_NOISE: f64 = 6.0;
/// A hammer never pulls: pulses that point downwards are disturbance, and upward ones that are not
/// larger by this factor are disturbance too.
const OVER_DOWNWARD: f64 = 1.5;
/// Least distance of the two crests, in widths at half height: nearer, their flanks overlap.
const LEAST_DELAY: f64 = 3.0;
/// A pulse narrower at half height than this (samples) does not show its height.
const FORM_SHOWS: f64 = 3.0;
/// Most candidates that are compared with the pulse; the rest of a noisy channel is no hit.
const MOST_CANDIDATES: usize = 24;
/// An excursion that is wider or narrower than the pulse by this factor is no blow of the same
/// hammer: a moved hand, a cable, a spike.
const OTHER_WIDTH: f64 = 3.0;

/// A second hit as the force shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondHit {
    /// Time between the two crests (s).
    pub delay: f64,
    /// The smaller peak over the larger; of pulses too short to show their height, the smaller impulse over the
    /// larger. From 0 to 1.
    pub ratio: f64,
}

/// Deepest ripple that is reported, as a ratio (1): 60 dB. Two equal hits cancel to nothing between their crests, and
/// only noise is left there.
const DEEPEST_RIPPLE: f64 = 1000.0;

impl SecondHit {
    /// Spacing of the ripple it leaves in the force spectrum, 1/delay (Hz).
    pub fn ripple_period(&self) -> f64 {
        1.0 / self.delay
    }

    /// Largest over smallest force within a ripple, (1 + r)/(1 - r); for two nearly equal hits
    /// ([`SecondHit::is_deepest`]) the 1000 (60 dB) that noise lets one see.
    pub fn ripple_depth(&self) -> f64 {
        match self.is_deepest() {
            true => DEEPEST_RIPPLE,
            false => (1.0 + self.ratio) / (1.0 - self.ratio),
        }
    }

    /// Returns `true` where both hits are so equal that the force vanishes within a ripple.
    pub fn is_deepest(&self) -> bool {
        1.0 + self.ratio >= DEEPEST_RIPPLE * (1.0 - self.ratio)
    }
}

/// Least height of a candidate for a second hit, over the tap's peak.
pub(super) fn least_candidate(settings: &TapSettings) -> f64 {
    CANDIDATE * settings.double_hit_warning
}

/// The largest second hit in the force about an event, from `double_hit_warning` of the peak up.
///
/// `own` ends where the next event may begin; only there an excursion counts whatever its form.
pub(super) fn second_hit(
    force: &Force,
    event: &Event,
    own: usize,
    settings: &TapSettings,
) -> Option<SecondHit> {
    let start = force.index(event.trigger);
    let samples = &force.samples;
    let near = samples.get(start..own)?;
    // The first of equal samples, where the pulse is clipped.
    let (offset, _) = near
        .iter()
        .enumerate()
        .rev()
        .max_by(|a, b| a.1.total_cmp(b.1))?;
    let main = Pulse::new(samples, start + offset);
    let mut found = copies(&main, settings.double_hit_warning);
    // A copy has been fitted where an excursion has only been looked at.
    let excursion = excursion(&main, force.noise, own, settings).filter(|other| {
        let mut places = found.iter().map(|copy| copy.place);
        !places.any(|place| (place - other.place).abs() <= main.width + 1.0)
    });
    found.extend(excursion);
    let largest = found
        .into_iter()
        .max_by(|a, b| a.ratio.total_cmp(&b.ratio))
        .filter(|copy| copy.ratio >= settings.double_hit_warning)?;
    let mut size = largest.ratio;
    // The height of a pulse two samples wide between them is not known (a narrower and higher copy fits as well), but
    // an anti-alias filter keeps its impulse, which is also what the spectrum ripples by.
    if main.width < FORM_SHOWS {
        let place = largest.place.round().max(0.0) as usize;
        // An anti-alias filter rings for some samples about each pulse; half the way to the other is its own.
        let reach = (3 * main.reach).min(main.crest.abs_diff(place) / 2);
        let ratio = main.impulse(place, reach) / main.impulse(main.crest, reach);
        // Beyond that something else lies beside one of the two.
        if (0.5..=2.0).contains(&(ratio / size)) {
            size = ratio;
        }
    }
    Some(SecondHit {
        delay: (largest.place - main.crest as f64).abs() / force.rate,
        // The crest that is read higher may have the smaller impulse.
        ratio: size.min(size.recip()),
    })
}

/// The tap's main pulse in its surroundings; its samples about the crest are the template of its copies.
struct Pulse<'a> {
    samples: &'a [f64],
    crest: usize,
    peak: f64,
    /// Width at half height (samples).
    width: f64,
    /// Samples to either side of the crest that belong to it. A pulse of 1.3 times the width has ended there too:
    /// half a sine ends 0.75 half widths from its crest, sin^2 one.
    reach: usize,
    /// Variance of the channel's noise from sample to sample.
    noise_power: f64,
}

impl<'a> Pulse<'a> {
    fn new(samples: &'a [f64], crest: usize) -> Self {
        let width = half_width(samples, crest).max(1.0);
        Pulse {
            samples,
            crest,
            peak: samples.get(crest).copied().unwrap_or(0.0),
            width,
            reach: (2.0 * width).ceil() as usize + 1,
            noise_power: noise_power(samples),
        }
    }

    /// Sum of the samples within the reach of a crest, above the median of as many beyond it; those at its ends
    /// count half, so that a ringing from sample to sample leaves nothing.
    fn impulse(&self, crest: usize, reach: usize) -> f64 {
        let mut beyond = Vec::with_capacity(2 * reach);
        for step in reach + 1..=2 * reach {
            beyond.extend(self.beside(crest, step));
        }
        let base = median(&mut beyond);
        let (mut inside, mut ends) = (0.0, 0.0);
        for step in 1..=reach {
            inside += ends;
            let [before, after] = self.beside(crest, step);
            ends = (before - base) + (after - base);
        }
        clamped(self.samples, crest as i64) - base + inside + 0.5 * ends
    }

    /// The samples so many steps before and after a crest, the outermost ones beyond the ends.
    fn beside(&self, crest: usize, step: usize) -> [f64; 2] {
        let (crest, step) = (crest as i64, step as i64);
        [crest - step, crest + step].map(|index| clamped(self.samples, index))
    }

    fn is_clear(&self, index: usize) -> bool {
        self.crest.abs_diff(index) as f64 >= LEAST_DELAY * self.width
    }

    /// Returns `true` for a crest that is ringing, `peak` above `base`.
    ///
    /// An anti-alias filter rings around a short pulse, and a hammer's own resonance after a long one,
    /// swinging as far down as up; a hammer never pulls. A crest right beside a comparable downward swing is
    /// such ringing: within twice its own width, or three samples, on either side.
    fn is_ringing(&self, place: usize, peak: f64, base: f64) -> bool {
        let samples = self.samples;
        let (before, after) = samples.split_at(place.min(samples.len()));
        let right = after.iter().take_while(|x| **x - base > 0.5 * peak);
        let left = before.iter().rev().take_while(|x| **x - base > 0.5 * peak);
        let width = right.count() + left.count();
        // Not beyond the crest of the pulse itself.
        let reach = (2 * width).max(3).min(self.crest.abs_diff(place));
        let beside = before
            .iter()
            .rev()
            .take(reach)
            .chain(after.iter().take(reach));
        let lowest = beside.map(|x| x - base).fold(0.0, f64::min);
        -lowest > 0.5 * peak
    }
}

/// Copies of the pulse, at least `least` of its height.
fn copies(main: &Pulse, least: f64) -> Vec<PulseCopy> {
    let crests = crests(main);
    let own = crests.get(main.crest).copied().unwrap_or(0.0);
    let limit = (CANDIDATE * least * own).max(OVER_NOISE * disturbance(main, &crests));
    let mut upward = fitted(main, &crests, 1.0, limit);
    if upward.is_empty() {
        return upward;
    }
    let downward = fitted(main, &crests, -1.0, limit);
    let deepest = downward.iter().map(|copy| -copy.ratio).fold(0.0, f64::max);
    upward.retain(|copy| {
        let place = (copy.place.round().max(0.0) as usize).min(main.samples.len() - 1);
        copy.ratio >= OVER_DOWNWARD * deepest
            && !main.is_ringing(place, copy.ratio * main.peak, copy.base)
    });
    upward
}

/// Height of the force, smoothed over half a width, above its mean at the reach to either side,
/// c(t) = s(t) - (s(t - k) + s(t + k))/2: offset and slope drop out, a pulse keeps its height.
fn crests(main: &Pulse) -> Vec<f64> {
    let mut sums = vec![0.0];
    for x in main.samples {
        sums.push(sums[sums.len() - 1] + x);
    }
    let reach = (main.width / 4.0).round() as usize;
    let smooth: Vec<f64> = (0..main.samples.len())
        .map(|index| {
            let first = index.saturating_sub(reach);
            let end = (index + reach + 1).min(main.samples.len());
            (sums[end] - sums[first]) / (end - first) as f64
        })
        .collect();
    let last = smooth.len().saturating_sub(1);
    let mut crests = Vec::with_capacity(smooth.len());
    for (index, x) in smooth.iter().enumerate() {
        let before = smooth[index.saturating_sub(main.reach)];
        let after = smooth[(index + main.reach).min(last)];
        crests.push(x - 0.5 * (before + after));
    }
    crests
}

/// Standard deviation of the crests away from the pulse, by their median magnitude: noise, hum, and
/// whatever else goes on for most of the record.
fn disturbance(main: &Pulse, crests: &[f64]) -> f64 {
    let stride = (crests.len() / 4096).max(1);
    let mut magnitudes: Vec<f64> = (0..crests.len())
        .step_by(stride)
        .filter(|&index| main.is_clear(index))
        .map(|index| crests[index].abs())
        .collect();
    1.4826 * median(&mut magnitudes)
}

/// Copies at the highest crests above `limit`; with `sign` -1 at the deepest below, pointing down.
fn fitted(main: &Pulse, crests: &[f64], sign: f64, limit: f64) -> Vec<PulseCopy> {
    let width = main.width.ceil() as usize;
    let mut places: Vec<usize> = Vec::new();
    for (index, crest) in crests.iter().enumerate() {
        if sign * crest <= limit || !main.is_clear(index) {
            continue;
        }
        match places.last_mut() {
            // Within one width there is one crest, the highest.
            Some(last) if index - *last <= width => {
                if sign * crest > sign * crests[*last] {
                    *last = index;
                }
            }
            _ => places.push(index),
        }
    }
    places.sort_by(|&a, &b| (sign * crests[b]).total_cmp(&(sign * crests[a])));
    places.truncate(MOST_CANDIDATES);
    let mut copies: Vec<PulseCopy> = places
        .into_iter()
        .filter_map(|place| main.fit(place))
        .collect();
    copies.retain(|copy| copy.ratio * sign > 0.0);
    copies
}

/// The largest second excursion above `double_hit` of the peak after the force has fallen below
/// `rearm` of it.
fn excursion(main: &Pulse, noise: f64, own: usize, settings: &TapSettings) -> Option<PulseCopy> {
    let limit = (settings.double_hit * main.peak).max(OVER_NOISE * noise);
    let rearm = (settings.rearm * main.peak).max(3.0 * noise);
    let samples = main.samples.get(..own)?;
    let mut found: Vec<(usize, f64)> = Vec::new();
    let mut armed = true;
    for (place, &force) in samples.iter().enumerate() {
        if armed && force > limit {
            found.push((place, force));
            armed = false;
        } else if !armed && force < rearm {
            armed = true;
        } else if let Some(open) = found.last_mut().filter(|open| !armed && force > open.1) {
            *open = (place, force);
        }
    }
    found.retain(|(place, peak)| {
        let width = half_width(samples, *place);
        main.crest.abs_diff(*place) as f64 > main.width
            && !main.is_ringing(*place, *peak, 0.0)
            && width <= OTHER_WIDTH * main.width + 2.0
            && OTHER_WIDTH * width + 2.0 >= main.width
    });
    let (place, peak) = found.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(PulseCopy {
        place: place as f64,
        ratio: peak / main.peak,
        base: 0.0,
    })
}

/// Widths of a second pulse that are tried, as multiples of the first one's. A weaker blow lasts a
/// little longer (Hertz: as the speed to the power -1/5, 1.6 times at a tenth of the speed), and hits
/// another spot; the widths beyond are there to be recognised as something else.
const WIDTHS: [f64; 15] = [
    0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.45, 1.6, 1.9, 2.3, 2.8,
];
/// Widths within which a pulse is the hammer's.
const LIKE_THE_FIRST: std::ops::RangeInclusive<f64> = 0.55..=1.7;
/// Least share of the local variance that a copy explains. Half a sine explains 98 % of sin^2; an
/// oscillation with lobes as wide as the pulse is explained to some 60 %.
const EXPLAINED: f64 = 0.8;
/// Steps of the delay to either side in the first search.
const STEPS: i32 = 4;

/// A weaker copy of a pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PulseCopy {
    /// Place of its crest (samples from the start, with a fraction).
    place: f64,
    /// Its height over the pulse's; negative where it points downwards.
    ratio: f64,
    /// The force on which it stands.
    base: f64,
}

impl Pulse<'_> {
    /// The copy near `place`; `None` where the force there has another shape or width.
    fn fit(&self, place: usize) -> Option<PulseCopy> {
        // The first search runs over all widths with a coarse delay, the second over the best alone.
        let mut step = (self.width / 8.0).max(0.25);
        let mut best: Option<(Fit, f64)> = None;
        for width in WIDTHS {
            for steps in -STEPS..=STEPS {
                let fit = self.compare(place, step * f64::from(steps), width);
                if best.is_none_or(|(best, _)| fit.left < best.left) {
                    best = Some((fit, width));
                }
            }
        }
        let (mut best, width) = best?;
        // The step of the delay is halved down to a hundredth of a sample.
        while step > 0.01 {
            step *= 0.5;
            for side in [-step, step] {
                let fit = self.compare(place, best.offset + side, width);
                if fit.left < best.left {
                    best = fit;
                }
            }
        }
        // A copy leaves little, the noise taken out of both sums.
        let noise = self.noise_power * (2 * self.reach + 1) as f64;
        let explains = best.left - noise <= (1.0 - EXPLAINED) * (best.all - noise).max(0.0);
        (explains && LIKE_THE_FIRST.contains(&width)).then_some(PulseCopy {
            place: place as f64 + best.offset,
            ratio: best.ratio,
            base: best.base,
        })
    }

    /// Least squares of y(t) = r p((t - offset)/width) + a + b t over the reach about `place`.
    ///
    /// The constant and the slope are what drift and hum leave; over a symmetric stretch they are
    /// orthogonal to each other, so that they come out of y and p one by one, and r = <p, y>/<p, p>.
    fn compare(&self, place: usize, offset: f64, width: f64) -> Fit {
        let reach = self.reach as i64;
        let count = (2 * reach + 1) as f64;
        let spread: f64 = (-reach..=reach).map(|t| (t * t) as f64).sum();
        let (mut p_sum, mut p_slope, mut y_sum, mut y_slope) = (0.0, 0.0, 0.0, 0.0);
        let (mut pp, mut py, mut yy) = (0.0, 0.0, 0.0);
        for step in -reach..=reach {
            let t = step as f64;
            // The pulse about its crest, by the cubic through four samples (Catmull and Rom); 0 beyond its reach.
            let from_crest = (t - offset) / width;
            let p = if from_crest.abs() > self.reach as f64 {
                0.0
            } else {
                let at = self.crest as f64 + from_crest;
                let index = at.floor();
                let u = at - index;
                let [a, b, c, d] =
                    [-1, 0, 1, 2].map(|step| clamped(self.samples, index as i64 + step));
                let slope = c - a;
                let second = 2.0 * a - 5.0 * b + 4.0 * c - d;
                let third = 3.0 * (b - c) + d - a;
                b + 0.5 * u * (slope + u * (second + u * third))
            };
            let y = clamped(self.samples, place as i64 + step);
            p_sum += p;
            p_slope += p * t;
            y_sum += y;
            y_slope += y * t;
            pp += p * p;
            py += p * y;
            yy += y * y;
        }
        pp -= p_sum * p_sum / count + p_slope * p_slope / spread;
        py -= p_sum * y_sum / count + p_slope * y_slope / spread;
        yy -= y_sum * y_sum / count + y_slope * y_slope / spread;
        let ratio = if pp > 0.0 { py / pp } else { 0.0 };
        Fit {
            offset,
            ratio,
            base: (y_sum - ratio * p_sum) / count,
            left: yy - ratio * py,
            all: yy,
        }
    }
}

/// One comparison of the template with the force.
#[derive(Debug, Clone, Copy)]
struct Fit {
    /// Place of the crest, from the place looked at (samples).
    offset: f64,
    ratio: f64,
    /// The constant a.
    base: f64,
    /// Sum of squares that is left, and of all.
    left: f64,
    all: f64,
}

fn clamped(samples: &[f64], index: i64) -> f64 {
    let last = samples.len().saturating_sub(1) as i64;
    samples
        .get(index.clamp(0, last.max(0)) as usize)
        .copied()
        .unwrap_or(0.0)
}

/// Noise variance from the median magnitude of first differences, sqrt(2) times the noise: pulses and
/// hum hardly enter it.
fn noise_power(samples: &[f64]) -> f64 {
    let stride = (samples.len() / 4096).max(1);
    let mut steps: Vec<f64> = samples
        .windows(2)
        .step_by(stride)
        .map(|pair| (pair[1] - pair[0]).abs())
        .collect();
    let deviation = 1.4826 * median(&mut steps);
    0.5 * deviation * deviation
}
