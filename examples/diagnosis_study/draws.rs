//! Random draws: sizes that spread over decades, and errors of one standard deviation in three shapes.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Gamma, StandardNormal, StudentT};

/// Returns a standard normal number.
pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    random.sample(StandardNormal)
}

/// Returns a number whose logarithm is uniform.
pub fn log_uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    (low.ln() + (high / low).ln() * random.random::<f64>()).exp()
}

/// Returns a number whose logarithm is normal: `spread` is the standard deviation of the natural logarithm.
pub fn log_normal(random: &mut ChaCha8Rng, median: f64, spread: f64) -> f64 {
    median * (spread * normal(random)).exp()
}

/// Returns a number whose logarithm has a triangular distribution with this mode.
pub fn log_triangular(random: &mut ChaCha8Rng, low: f64, mode: f64, high: f64) -> f64 {
    let (a, c, b) = (low.ln(), mode.ln(), high.ln());
    let share = random.random::<f64>();
    let rising = (c - a) / (b - a);
    let log = if share < rising {
        a + (share * (b - a) * (c - a)).sqrt()
    } else {
        b - ((1.0 - share) * (b - a) * (b - c)).sqrt()
    };
    log.exp()
}

/// Returns a number with a gamma distribution. A shape below 1 piles up at 0.
pub fn gamma(random: &mut ChaCha8Rng, shape: f64, mean: f64) -> f64 {
    let distribution = Gamma::new(shape, mean / shape).expect("shape and mean are positive");
    distribution.sample(random)
}

/// Returns -1 or 1; 1 with this probability.
pub fn sign(random: &mut ChaCha8Rng, positive: f64) -> f64 {
    if random.random_bool(positive) {
        1.0
    } else {
        -1.0
    }
}

/// Returns the index of one of these weights, each drawn as often as its share of their sum.
pub fn weighted(random: &mut ChaCha8Rng, weights: &[f64]) -> usize {
    let mut rest = random.random::<f64>() * weights.iter().sum::<f64>();
    for (index, weight) in weights.iter().enumerate() {
        rest -= weight;
        if rest < 0.0 {
            return index;
        }
    }
    weights.len() - 1
}

/// Largest error with heavy tails, in standard deviations.
const MOST_STDS: f64 = 3.0;

/// Shape of a distribution of errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorShape {
    Normal,
    Uniform,
    /// Student's t with three degrees of freedom, up to three standard deviations. A larger error is a fault, which a tolerance does
    /// not cover.
    HeavyTailed,
}

impl ErrorShape {
    pub const ALL: [Self; 3] = [Self::Normal, Self::Uniform, Self::HeavyTailed];

    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Uniform => "uniform",
            Self::HeavyTailed => "heavy-tailed",
        }
    }

    /// Returns an error. Its standard deviation is 1, and 0.78 with heavy tails, because they are cut off.
    pub fn draw(self, random: &mut ChaCha8Rng) -> f64 {
        match self {
            Self::Normal => normal(random),
            Self::Uniform => 3f64.sqrt() * (2.0 * random.random::<f64>() - 1.0),
            Self::HeavyTailed => {
                let distribution = StudentT::new(3.0).expect("three degrees of freedom");
                loop {
                    // Its variance is 3.
                    let error = distribution.sample(random) / 3f64.sqrt();
                    if error.abs() < MOST_STDS {
                        break error;
                    }
                }
            }
        }
    }
}
