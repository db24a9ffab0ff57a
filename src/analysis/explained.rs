//! What the modes of a recording explain, and what is left: curves of the fitted modes over the frequency response
//! functions, and strong peaks that nothing explains.

use super::measurement::MeasuredSpectra;
use num_complex::Complex64;
use tapjoint_signal::modal::fit::ModeFit;
use tapjoint_signal::modal::synthesis::{Synthesis, SynthesisLines};
use tapjoint_signal::modal::{CompositeLevel, ModeReading, PeakLabel, PeakSettings, find_peaks};
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::spectral::Lines;

/// Curves of the fitted modes over the functions (H1, or those of a file) of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedCurves {
    /// Number of fitted modes.
    pub modes: usize,
    /// Band of the curves (Hz).
    pub band: (f64, f64),
    /// Index of the spectra's line on which the curves begin.
    pub first: usize,
    /// The curve of each response; `None` where its function is zero or no number on some line.
    pub functions: Vec<Option<Synthesis>>,
}

/// Fits the functions of a recording by its fitted modes; `None` without functions or fitted modes.
///
/// The poles are those of the fits. Residues, and a term each for the modes below and above the band, are fitted to the
/// functions themselves. `forms` are those of the responses. The band begins and ends where the bands of the fits do:
/// beyond, nothing was looked for, or noise alone decides.
pub(super) fn fitted_curves(
    spectra: &MeasuredSpectra,
    forms: &[Option<ResponseForm>],
) -> Option<FittedCurves> {
    let functions = spectra.averages.h1.as_deref()?;
    let fits = spectra.readings.iter();
    let fits = fits.filter_map(|reading| Some(&reading.fit.as_deref()?.mode));
    let fits: Vec<&ModeFit> = fits.collect();
    let (first, last) = range(&spectra.averages.lines, &fits)?;
    let lines = &spectra.averages.lines;
    let frequencies: Vec<f64> = (first..=last).map(|line| lines.frequency(line)).collect();
    let poles: Vec<Complex64> = fits.iter().map(|fit| fit.pole).collect();
    let wanted = SynthesisLines {
        frequencies: &frequencies,
        poles: &poles,
        added_decay: spectra.window.added_decay(),
    };
    let columns: Vec<&[Complex64]> = functions
        .iter()
        .map(|values| values.get(first..=last).unwrap_or_default())
        .collect();
    Some(FittedCurves {
        modes: fits.len(),
        band: (lines.frequency(first), lines.frequency(last)),
        first,
        functions: wanted.synthesise(&columns, forms),
    })
}

/// Returns the first and the last line of the bands of all fits, without a line at 0 Hz; `None` without fits.
fn range(lines: &Lines, fits: &[&ModeFit]) -> Option<(usize, usize)> {
    let lowest = fits.iter().map(|fit| fit.band.0).min_by(f64::total_cmp)?;
    let highest = fits.iter().map(|fit| fit.band.1).max_by(f64::total_cmp)?;
    let first = lines.nearest(lowest).max(usize::from(lines.low <= 0.0));
    let last = lines.nearest(highest);
    (first < last).then_some((first, last))
}

/// Height over the noise (dB) from which a peak is no noise. The power of noise is exponentially distributed, and exceeds
/// its mean by 20 dB with the probability e^-100.
pub const STRONG_PEAK: f64 = 20.0;
/// Share of the band at either end in which a peak may belong to a mode beyond the band.
const AT_ENDS: f64 = 0.02;

/// A strong peak that is neither a listed mode nor explained otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnlistedPeak {
    /// Frequency of its line (Hz).
    pub frequency: f64,
    /// Height over the noise (dB).
    pub above_noise_db: f64,
}

/// Returns the strong peaks of a level that none of the `readings` explains, the strongest first; none where the noise is
/// not known.
///
/// A mode explains peaks within its half-power width, or within a line. So does hum or a gap of the force, within a line.
/// That no decay explains a peak ([`PeakLabel::NoResonance`]) is no explanation.
pub(super) fn unlisted_peaks(
    level: &CompositeLevel,
    settings: &PeakSettings,
    readings: &[ModeReading],
) -> Vec<UnlistedPeak> {
    let lines = &level.lines;
    let margin = AT_ENDS * (lines.high - lines.low);
    let inside = lines.low + margin..lines.high - margin;
    let all = PeakSettings {
        most: usize::MAX,
        ..*settings
    };
    let mut unlisted = Vec::new();
    for peak in find_peaks(level, &all) {
        let frequency = lines.frequency(peak.index);
        let strong = peak.above_noise_db.filter(|height| *height >= STRONG_PEAK);
        let Some(above_noise_db) = strong.filter(|_| inside.contains(&frequency)) else {
            continue;
        };
        let is_explained = readings.iter().any(|reading| {
            let width = 2.0 * reading.damping_ratio.unwrap_or(0.0) * reading.frequency;
            let reach = width.max(2.0 * lines.half_line());
            let places = [reading.frequency, reading.line_frequency];
            reading.label != Some(PeakLabel::NoResonance)
                && places
                    .iter()
                    .any(|place| (frequency - place).abs() <= reach)
        });
        if !is_explained {
            unlisted.push(UnlistedPeak {
                frequency,
                above_noise_db,
            });
        }
    }
    unlisted.sort_by(|a, b| b.above_noise_db.total_cmp(&a.above_noise_db));
    unlisted
}
