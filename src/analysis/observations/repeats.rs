//! Several taps: their mean, and whether they scatter more than the noise of each explains.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::mode::ModeSeen;
use tapjoint_identify::observation::Observed;
use tapjoint_signal::modal::fit::{
    FittedValue, UncertaintySource, scatter_about_mean, weighted_mean,
};

/// A scatter less probable than this is not noise alone. 5 %, more lenient than for one mode of a report:
/// an uncertainty that is too small makes effects out of nothing, one that is a little too large costs
/// little.
const SCATTER_LEVEL: f64 = 0.05;
/// Fewer taps say nothing of their scatter.
pub(super) const LEAST_TAPS: usize = 3;
/// With more degrees of freedom than this Student's t is as good as normal: 2 % wider at 100.
const KNOWN: f64 = 100.0;

/// What repeated taps say of one quantity.
#[derive(Debug, Clone)]
pub(super) struct Repeats {
    /// Number of the tap, its value and that value's standard uncertainty from noise.
    pub taps: Vec<(usize, f64, f64)>,
    /// What the noise alone says of all of them.
    pub by_noise: Observed,
    /// Whether they scatter more than that.
    pub scattered: bool,
}

impl Repeats {
    /// From the taps' own values; `joint` is what a fit of all taps together says, where these are all
    /// of them, and `inflation` what else its noise is known to be larger by.
    pub fn new(
        taps: Vec<(usize, f64, f64)>,
        joint: Option<&FittedValue>,
        inflation: f64,
    ) -> Option<Self> {
        let by_noise = match joint {
            Some(joint) if joint.source == UncertaintySource::Residual => Observed {
                value: joint.value,
                std: joint.std,
                freedom: freedom(joint.freedom),
            },
            _ => mean_by_noise(&taps, inflation)?,
        };
        let mut repeats = Repeats {
            taps,
            by_noise,
            scattered: false,
        };
        repeats.scattered = repeats.probability().is_some_and(|p| p < SCATTER_LEVEL);
        Some(repeats)
    }

    fn pairs(&self) -> Vec<(f64, f64)> {
        self.taps.iter().map(|tap| (tap.1, tap.2)).collect()
    }

    /// Chi-squared of the scatter, and its degrees of freedom; `None` with too few taps.
    fn chi_squared(&self) -> Option<(f64, f64)> {
        let taps = self.pairs();
        (taps.len() >= LEAST_TAPS)
            .then(|| (scatter_about_mean(&taps), taps.len() as f64 - 1.0))
            .filter(|(chi_squared, _)| chi_squared.is_finite())
    }

    /// Probability that noise alone scatters as much; `None` with too few taps.
    fn probability(&self) -> Option<f64> {
        let (chi_squared, freedom) = self.chi_squared()?;
        Some(ChiSquared::new(freedom).ok()?.sf(chi_squared))
    }

    /// The value, from the noise or from the scatter.
    pub fn observed(&self) -> Observed {
        let taps = self.pairs();
        if let [(a, _), (b, _)] = taps[..] {
            // Of two, the half difference is a bound worth keeping and no more.
            let std = self.by_noise.std.max(0.5 * (a - b).abs());
            return Observed {
                std,
                freedom: None,
                ..self.by_noise
            };
        }
        if !self.scattered {
            return self.by_noise;
        }
        let (value, std) = weighted_mean(&taps);
        Observed {
            value,
            // Scatter cannot make a value better than the noise lets it be.
            std: std.max(self.by_noise.std),
            freedom: Some(taps.len() as f64 - 1.0),
        }
    }
}

fn freedom(value: f64) -> Option<f64> {
    (value < KNOWN).then_some(value)
}

/// Weighted mean with the weights 1/std^2, and its standard uncertainty.
fn mean_by_noise(taps: &[(usize, f64, f64)], inflation: f64) -> Option<Observed> {
    let total: f64 = taps.iter().map(|tap| tap.2.powi(-2)).sum();
    let mean = taps.iter().map(|tap| tap.1 * tap.2.powi(-2)).sum::<f64>() / total;
    (total > 0.0 && mean.is_finite()).then(|| Observed {
        value: mean,
        std: inflation / total.sqrt(),
        freedom: None,
    })
}

/// Judges the frequencies' scatter over all modes together: what makes the structure differ between
/// taps moves several modes a little, and is seen in their sum where it is not in each. Then every mode
/// that scatters beyond its noise at all counts as scattered.
pub(super) fn judge_scatter(modes: &mut [ModeSeen<'_>]) {
    let sums = modes.iter().filter_map(|mode| mode.frequency.chi_squared());
    let (chi_squared, freedom) = sums.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    let probability = ChiSquared::new(freedom).map_or(1.0, |d| d.sf(chi_squared));
    if probability >= SCATTER_LEVEL {
        return;
    }
    for mode in modes {
        let own = mode.frequency.chi_squared();
        mode.frequency.scattered |= own.is_some_and(|(chi_squared, freedom)| chi_squared > freedom);
    }
}
