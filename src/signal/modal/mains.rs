//! Mains hum: 50 and 60 Hz and their multiples, steady and there before the tap, as a line over the noise.

/// What counts as a mains line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MainsSettings {
    /// Largest distance from a multiple, relative: 0.2 %, the deviation large grids allow themselves.
    pub tolerance: f64,
    /// Least share of the line's amplitude in the record that was there before the tap: 0.5. A
    /// resonance that happens to lie at 50 Hz is still before the tap.
    pub share_before: f64,
    /// Least height of the line over the noise beside it before the tap, in amplitude: 4. Noise alone is as
    /// high in one line of some ten thousand: the noise is that of twelve lines, and itself uncertain.
    /// Multiples of 50 and 60 Hz are so close at high orders that every other peak lies near one, and a peak
    /// of mere noise was there before the tap as well.
    pub over_noise: f64,
}

impl Default for MainsSettings {
    fn default() -> Self {
        MainsSettings {
            tolerance: 0.002,
            share_before: 0.5,
            over_noise: 4.0,
        }
    }
}

/// Amplitudes of a steady line at one frequency (same unit).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineAmplitudes {
    /// Before the tap.
    pub before: f64,
    /// In the tap record, as if steady.
    pub within: f64,
    /// What noise alone has before the tap, root mean square over the frequencies beside the line.
    pub noise: f64,
}

/// The multiple of 50 or 60 Hz (Hz) that a peak at `frequency` is, or `None`.
///
/// `half_line` is the bound of the reading (Hz).
pub fn mains_harmonic(
    frequency: f64,
    half_line: f64,
    amplitudes: LineAmplitudes,
    settings: &MainsSettings,
) -> Option<f64> {
    let steady = amplitudes.before >= settings.share_before * amplitudes.within;
    let is_line = amplitudes.before > settings.over_noise * amplitudes.noise;
    if !(steady && is_line) {
        return None;
    }
    near_mains(frequency, half_line, settings)
}

/// The multiple of 50 or 60 Hz (Hz) near which `frequency` lies, hum or not.
pub fn near_mains(frequency: f64, half_line: f64, settings: &MainsSettings) -> Option<f64> {
    [50.0, 60.0].into_iter().find_map(|mains| {
        let harmonic = mains * (frequency / mains).round();
        let near = (frequency - harmonic).abs() <= half_line + settings.tolerance * harmonic;
        (harmonic > 0.0 && near).then_some(harmonic)
    })
}
