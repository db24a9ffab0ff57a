//! Whether a stretch of force is a weaker copy of the tap's own pulse.

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
pub(super) struct PulseCopy {
    /// Where its crest is (samples from the start, with a fraction).
    pub place: f64,
    /// Its height over the pulse's; negative where it points downwards.
    pub ratio: f64,
    /// The force on which it stands.
    pub base: f64,
}

/// The tap's pulse as a template: its samples about the crest.
pub(super) struct Template<'a> {
    samples: &'a [f64],
    crest: usize,
    /// Samples to either side of the crest that belong to it.
    reach: usize,
    /// Width at half height (samples).
    width: f64,
    /// Variance of the channel's noise from sample to sample.
    noise_power: f64,
}

impl<'a> Template<'a> {
    /// The pulse with this crest; `width` is its width at half height (samples).
    pub(super) fn new(samples: &'a [f64], crest: usize, width: f64) -> Self {
        Template {
            samples,
            crest,
            reach: reach(width),
            width,
            noise_power: noise_power(samples),
        }
    }

    /// The pulse at `offset` samples from its crest; 0 beyond its reach.
    fn at(&self, offset: f64) -> f64 {
        if offset.abs() > self.reach as f64 {
            return 0.0;
        }
        interpolate(self.samples, self.crest as f64 + offset)
    }

    /// The copy near `place`; `None` where the force there has another shape or width.
    pub(super) fn fit(&self, place: usize) -> Option<PulseCopy> {
        // The first search runs over all widths with a coarse delay, the second over the best alone.
        let coarse = (self.width / 8.0).max(0.25);
        let mut best: Option<(Fit, f64)> = None;
        for width in WIDTHS {
            for step in -STEPS..=STEPS {
                let fit = self.compare(place, coarse * f64::from(step), width);
                if best.is_none_or(|(best, _)| fit.left < best.left) {
                    best = Some((fit, width));
                }
            }
        }
        let (best, width) = best?;
        let fit = self.refine(place, best, (width, coarse));
        let is_copy = LIKE_THE_FIRST.contains(&width) && self.explains(&fit);
        is_copy.then_some(PulseCopy {
            place: place as f64 + fit.offset,
            ratio: fit.ratio,
            base: fit.base,
        })
    }

    /// Halves the step of the delay about the best fit, down to a hundredth of a sample.
    fn refine(&self, place: usize, mut best: Fit, (width, mut step): (f64, f64)) -> Fit {
        while step > 0.01 {
            step *= 0.5;
            for side in [-step, step] {
                let fit = self.compare(place, best.offset + side, width);
                if fit.left < best.left {
                    best = fit;
                }
            }
        }
        best
    }

    /// Whether what the copy leaves is little, the noise taken out of both.
    fn explains(&self, fit: &Fit) -> bool {
        let noise = self.noise_power * (2 * self.reach + 1) as f64;
        fit.left - noise <= (1.0 - EXPLAINED) * (fit.all - noise).max(0.0)
    }

    /// Least squares of y(t) = r p((t - offset)/width) + a + b t over the reach about `place`.
    ///
    /// The constant and the slope are what drift and hum leave; over a symmetric stretch they are
    /// orthogonal to each other, so that they come out of y and p one by one, and r = <p, y>/<p, p>.
    fn compare(&self, place: usize, offset: f64, width: f64) -> Fit {
        let reach = self.reach as i64;
        let times = || (-reach..=reach).map(|t| t as f64);
        let count = (2 * reach + 1) as f64;
        let spread: f64 = times().map(|t| t * t).sum();
        let (mut p_sum, mut p_slope, mut y_sum, mut y_slope) = (0.0, 0.0, 0.0, 0.0);
        let (mut pp, mut py, mut yy) = (0.0, 0.0, 0.0);
        for t in times() {
            let p = self.at((t - offset) / width);
            let y = clamped(self.samples, place as i64 + t as i64);
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
    /// Where the crest is, from the place looked at (samples).
    offset: f64,
    ratio: f64,
    /// The constant a.
    base: f64,
    /// Sum of squares that is left, and of all.
    left: f64,
    all: f64,
}

/// Samples to either side of a crest within which its pulse has ended, one of 1.3 times the width too:
/// half a sine ends 0.75 half widths from its crest, sin^2 one.
pub(super) fn reach(width: f64) -> usize {
    (2.0 * width).ceil() as usize + 1
}

fn clamped(samples: &[f64], index: i64) -> f64 {
    let last = samples.len().saturating_sub(1) as i64;
    samples
        .get(index.clamp(0, last.max(0)) as usize)
        .copied()
        .unwrap_or(0.0)
}

/// Value between samples, by the cubic through the four about it (Catmull and Rom).
fn interpolate(samples: &[f64], place: f64) -> f64 {
    let index = place.floor();
    let u = place - index;
    let x = |step: i64| clamped(samples, index as i64 + step);
    let (a, b, c, d) = (x(-1), x(0), x(1), x(2));
    let slope = c - a;
    let second = 2.0 * a - 5.0 * b + 4.0 * c - d;
    let third = 3.0 * (b - c) + d - a;
    b + 0.5 * u * (slope + u * (second + u * third))
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
    let deviation = 1.4826 * tapjoint_numerics::stats::median(&mut steps);
    0.5 * deviation * deviation
}
