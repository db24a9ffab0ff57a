//! What the hammer's noise leaves in modal constants.

use crate::measure::MeasuredSpectra;
use tapjoint_signal::modal::ModeReading;

/// What the hammer's noise leaves in a ratio to its force (1, relative).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ForceNoise {
    /// At random: it shows in the scatter of the taps as well.
    random: f64,
    /// In common.
    common: f64,
}

impl ForceNoise {
    pub(super) const NONE: ForceNoise = ForceNoise {
        random: 0.0,
        common: 0.0,
    };

    /// Of n taps: r/sqrt(2 n), the half of the noise's power that is in phase, and r^2, by which the mean square of a
    /// noisy force is too large. r is the noise over the force without it, whose root mean squares are given (N s).
    ///
    /// `None` where there is no more than noise.
    fn of(noise: f64, measured: f64, taps: usize) -> Option<Self> {
        let squared = noise * noise / (measured * measured - noise * noise);
        let taps = taps.max(1) as f64;
        (measured > noise).then(|| ForceNoise {
            random: (squared / (2.0 * taps)).sqrt(),
            common: squared,
        })
    }

    /// The standard uncertainty of a value with that of its taps.
    pub(super) fn added_to(self, std: f64, value: f64) -> f64 {
        std.max(self.random * value.abs())
            .hypot(self.common * value)
    }
}

/// The same at a mode's line; none without a hammer or a quiet stretch.
pub(super) fn noise_of_force(
    spectra: &MeasuredSpectra,
    reading: &ModeReading,
) -> Option<ForceNoise> {
    let averages = &spectra.averages;
    let line = averages.lines.nearest(reading.frequency);
    let at_line = |values: &Option<Vec<f64>>| values.as_ref()?.get(line).copied();
    match at_line(&spectra.force_noise).zip(at_line(&averages.force)) {
        Some((noise, force)) => ForceNoise::of(noise, force, averages.taps),
        None => Some(ForceNoise::NONE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_the_force_is_as_certain_as_it_is_clear_of_noise() {
        assert_eq!(ForceNoise::of(0.0, 1.0, 5), Some(ForceNoise::NONE));
        assert_eq!(ForceNoise::of(1.0, 1.0, 5), None);
        assert_eq!(ForceNoise::NONE.added_to(0.3, 2.0), 0.3);
        // r^2 = 1/9: noise of 1 beside a force of 3, in a measured root mean square of sqrt(10).
        let found = ForceNoise::of(1.0, 10.0_f64.sqrt(), 2).unwrap();
        let random = (1.0 / 36.0_f64).sqrt();
        assert!((found.random - random).abs() < 1e-12, "{found:?}");
        assert!((found.common - 1.0 / 9.0).abs() < 1e-12, "{found:?}");
        // The taps' scatter holds the random part already.
        let added = found.added_to(0.5, -2.0);
        assert!((added - 0.5_f64.hypot(2.0 / 9.0)).abs() < 1e-12, "{added}");
    }
}
