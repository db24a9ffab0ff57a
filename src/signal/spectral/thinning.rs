//! Fewer samples of a signal of which only low frequencies matter.

use super::DISPLAY_RATIO;
use super::transform::low_pass;

/// A low-pass filter that keeps one sample in `factor`.
///
/// It is laid over samples that exist, so that a sum of exponentials stays one: every pole keeps its place, and its
/// amplitude is multiplied by the filter's gain there, 1 up to [`highest`](Self::highest).
#[derive(Debug, Clone)]
pub struct Thinning {
    filter: Vec<f64>,
    factor: usize,
    sample_rate: f64,
}

impl Thinning {
    /// Keeps one sample in `factor` of those at `sample_rate` (Hz).
    pub fn new(sample_rate: f64, factor: usize) -> Self {
        let rate = sample_rate / factor as f64;
        let pass = rate / DISPLAY_RATIO;
        Thinning {
            filter: low_pass(pass, rate - pass, sample_rate),
            factor,
            sample_rate,
        }
    }

    /// Samples per second that are left (Hz).
    pub fn rate(&self) -> f64 {
        self.sample_rate / self.factor as f64
    }

    /// Highest frequency that keeps its amplitude (Hz).
    pub fn highest(&self) -> f64 {
        self.rate() / DISPLAY_RATIO
    }

    /// First sample about which the whole filter finds samples.
    pub fn first(&self) -> usize {
        (self.filter.len() / 2).next_multiple_of(self.factor)
    }

    /// The samples that are left, the first of them at [`first`](Self::first).
    pub fn thin(&self, samples: &[f64]) -> Vec<f64> {
        let half = self.filter.len() / 2;
        let last = samples.len().saturating_sub(half);
        let kept = (self.first()..last).step_by(self.factor);
        kept.map(|place| self.value(&samples[place - half..=place + half]))
            .collect()
    }

    /// The last `count` samples that are left before the first one of [`thin`](Self::thin), of a signal that ends at
    /// time zero and is zero outside `samples`.
    pub fn thin_before(&self, samples: &[f64], count: usize) -> Vec<f64> {
        let half = self.filter.len() / 2;
        let mut around = vec![0.0; count * self.factor + half];
        around.extend_from_slice(samples);
        around.resize(around.len() + self.first() + half, 0.0);
        let zero = count * self.factor + half + samples.len();
        let end = zero + self.first();
        let kept = (1..=count).rev().map(|steps| end - steps * self.factor);
        kept.map(|place| self.value(&around[place - half..=place + half]))
            .collect()
    }

    fn value(&self, samples: &[f64]) -> f64 {
        let products = samples.iter().zip(&self.filter);
        products.map(|(x, weight)| x * weight).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;
    use std::f64::consts::TAU;

    #[test]
    fn prop_a_pole_keeps_its_place_and_its_amplitude() {
        let thinning = Thinning::new(51_200.0, 16);
        let pole = Complex64::new(-20.0, TAU * 800.0);
        let of = |time: f64| (pole * time).exp().re;
        let samples: Vec<f64> = (0..20_000).map(|n| of(f64::from(n) / 51_200.0)).collect();
        let thinned = thinning.thin(&samples);
        for (place, value) in thinned.iter().enumerate() {
            let time = (thinning.first() + 16 * place) as f64 / 51_200.0;
            // The filter's ripple is 100 dB below.
            let expected = of(time);
            let scale = (-20.0 * time).exp();
            assert!((value - expected).abs() < 3e-5 * scale, "{place}");
        }
        assert!(thinned.len() > 1200);
    }

    #[test]
    fn prop_the_force_before_keeps_its_impulse() {
        let thinning = Thinning::new(51_200.0, 16);
        let pulse: Vec<f64> = (0..100)
            .map(|n| (std::f64::consts::PI * f64::from(n) / 100.0).sin())
            .collect();
        let thinned = thinning.thin_before(&pulse, 200);
        let [before, after] = [&pulse, &thinned].map(|values| values.iter().sum::<f64>());
        // Half a sine falls off as 1/f^2: what folds back is below a thousandth.
        assert!(
            (16.0 * after / before - 1.0).abs() < 1e-3,
            "{before} {after}"
        );
    }

    #[test]
    fn limit_high_frequencies_do_not_fold_back() {
        let thinning = Thinning::new(51_200.0, 16);
        let high: Vec<f64> = (0..20_000)
            .map(|n| (TAU * 2500.0 * f64::from(n) / 51_200.0).sin())
            .collect();
        // 2500 Hz folds to 700 Hz at 3200 Hz.
        let most = thinning
            .thin(&high)
            .iter()
            .fold(0.0_f64, |most, x| x.abs().max(most));
        assert!(most < 3e-5, "{most}");
    }
}
