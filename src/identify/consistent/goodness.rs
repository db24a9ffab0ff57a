//! Whether the model can explain the frequencies at all.

/// Below this probability the stated uncertainties and the model do not go together.
pub const DOUBTFUL: f64 = 0.01;

/// Chi-squared from which only its power of ten is of interest.
const MOST_IN_FULL: f64 = 1e4;

/// A smaller probability is told as "below" this: so far out a distribution's tail is no measurement, and the
/// smallest of all are written as 0.
const LEAST_PROBABILITY: f64 = 1e-12;

/// Below this one no usual slip in the uncertainties saves the model: with three degrees of
/// freedom it asks for misfits of more than three standard deviations in every direction.
pub const HOPELESS: f64 = 1e-6;
/// Root-mean-square misfit (1, relative, per degree of freedom) beyond which a model is in doubt
/// where no uncertainty is stated: a beam's dimensions usually leave 1 % open.
pub const NOTABLE_MISFIT: f64 = 0.01;
/// The same beyond which it explains nothing: twice that, and ten times what tap tests repeat to.
pub const LARGE_MISFIT: f64 = 0.02;

/// What the misfit says of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The misfit is no larger than the uncertainties allow.
    Explains,
    /// The misfit is larger than the uncertainties allow: they are too small, or the model lacks
    /// something.
    Doubtful,
    /// This model cannot explain these frequencies.
    CannotExplain,
    /// As many unknowns as frequencies: nothing is left to test with.
    Untestable,
}

/// The test of the model by its misfit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goodness {
    /// Sum of squared residuals over their standard deviations (1); without stated uncertainties
    /// `None`.
    pub chi_squared: Option<f64>,
    /// Frequencies and priors less parameters.
    pub degrees_of_freedom: usize,
    /// Probability of a larger chi-squared if the model is right.
    pub probability: Option<f64>,
    /// Root-mean-square relative misfit of the frequencies (1).
    pub relative_misfit: f64,
    /// The same per degree of freedom instead of per frequency; `None` without any.
    pub misfit_per_freedom: Option<f64>,
    /// What follows.
    pub verdict: Verdict,
}

impl Goodness {
    /// From the relative misfits of the frequencies (1), chi-squared where uncertainties are
    /// stated, and the degrees of freedom.
    pub(super) fn new(misfits: &[f64], chi_squared: Option<f64>, freedom: usize) -> Self {
        let squares: f64 = misfits.iter().map(|misfit| misfit * misfit).sum();
        let misfit_per_freedom = (freedom > 0).then(|| (squares / freedom as f64).sqrt());
        let probability = chi_squared
            .filter(|_| freedom > 0)
            .map(|chi_squared| exceedance(chi_squared, freedom));
        let verdict = match (probability, misfit_per_freedom) {
            (_, None) => Verdict::Untestable,
            (Some(p), _) if p < HOPELESS => Verdict::CannotExplain,
            (Some(p), _) if p < DOUBTFUL => Verdict::Doubtful,
            (None, Some(misfit)) if misfit > LARGE_MISFIT => Verdict::CannotExplain,
            (None, Some(misfit)) if misfit > NOTABLE_MISFIT => Verdict::Doubtful,
            _ => Verdict::Explains,
        };
        Self {
            chi_squared,
            degrees_of_freedom: freedom,
            probability,
            relative_misfit: (squares / misfits.len().max(1) as f64).sqrt(),
            misfit_per_freedom,
            verdict,
        }
    }

    /// Factor on every standard uncertainty under which the misfit would be as expected:
    /// sqrt(chi^2/degrees of freedom); `None` where there is no reason for one.
    pub fn uncertainty_factor(&self) -> Option<f64> {
        let too_large = self.probability.is_some_and(|p| p < DOUBTFUL);
        let chi_squared = self.chi_squared.filter(|_| too_large)?;
        Some((chi_squared / self.degrees_of_freedom as f64).sqrt())
    }

    /// The verdict in a sentence.
    pub fn words(&self) -> String {
        let misfit = 100.0 * self.relative_misfit;
        let test = match (self.chi_squared, self.probability) {
            (Some(chi_squared), Some(p)) => format!(
                "chi-squared {} with {} of freedom, probability {}, rms misfit {misfit:.2} %",
                if chi_squared < MOST_IN_FULL {
                    format!("{chi_squared:.1}")
                } else {
                    format!("{chi_squared:.1e}")
                },
                match self.degrees_of_freedom {
                    1 => "1 degree".to_owned(),
                    more => format!("{more} degrees"),
                },
                if p < LEAST_PROBABILITY {
                    format!("below {LEAST_PROBABILITY:e}")
                } else {
                    format!("{p:.1e}")
                }
            ),
            _ => format!("rms misfit {misfit:.2} %"),
        };
        match self.verdict {
            Verdict::Explains => format!("this model explains the frequencies ({test})"),
            Verdict::Doubtful if self.chi_squared.is_none() => {
                format!("the misfit is larger than a beam's dimensions usually leave open ({test})")
            }
            Verdict::Doubtful => format!(
                "the misfit is larger than the stated uncertainties allow: they are too small, or \
                 the model lacks something ({test})"
            ),
            Verdict::CannotExplain => {
                format!("this model cannot explain the frequencies ({test})")
            }
            Verdict::Untestable => format!(
                "as many unknowns as frequencies: the model cannot be tested ({test}); \
                 measure one more mode"
            ),
        }
    }
}

/// Probability that chi-squared with so many degrees of freedom exceeds a value: with x half of
/// it, e^-x sum x^k/k! over k < freedom/2 for even ones; for odd ones the half-integer powers and
/// erfc(sqrt x) in the place of the rest of the sum.
pub fn exceedance(chi_squared: f64, freedom: usize) -> f64 {
    let x = 0.5 * chi_squared.max(0.0);
    let (mut sum, mut term, mut order) = if freedom.is_multiple_of(2) {
        (0.0, (-x).exp(), 1.0)
    } else {
        // x^(1/2) e^-x / Gamma(3/2) begins the half-integer powers.
        let first = 2.0 * (x / std::f64::consts::PI).sqrt() * (-x).exp();
        (complementary_error_function(x.sqrt()), first, 1.5)
    };
    for _ in 0..freedom / 2 {
        sum += term;
        term *= x / order;
        order += 1.0;
    }
    sum.min(1.0)
}

/// erfc(x) for x >= 0: the series of erf below 2, the continued fraction above.
fn complementary_error_function(x: f64) -> f64 {
    let root_pi = std::f64::consts::PI.sqrt();
    if x < 2.0 {
        // erf x = 2/sqrt(pi) sum (-1)^n x^(2n+1)/(n! (2n+1)); e^-x^2 taken out keeps every term
        // positive: erf x = 2/sqrt(pi) e^-x^2 sum 2^n x^(2n+1)/(2n+1)!!.
        let (mut term, mut sum) = (x, x);
        for n in 1..60 {
            term *= 2.0 * x * x / f64::from(2 * n + 1);
            sum += term;
        }
        return 1.0 - 2.0 / root_pi * (-x * x).exp() * sum;
    }
    // erfc x = e^-x^2/sqrt(pi) / (x + (1/2)/(x + 1/(x + (3/2)/(x + ...)))).
    let fraction = (1..=60)
        .rev()
        .fold(x, |tail, k| x + 0.5 * f64::from(k) / tail);
    (-x * x).exp() / (root_pi * fraction)
}
