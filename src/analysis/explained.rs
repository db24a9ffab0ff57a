//! What the modes of a recording explain, and what is left: curves of the fitted modes over the frequency response
//! functions, and strong peaks that nothing explains.

use num_complex::Complex64;
use std::ops::Range;
use tapjoint_signal::modal::fit::ModeFit;
use tapjoint_signal::modal::synthesis::{Synthesis, SynthesisLines};
use tapjoint_signal::modal::{CompositeLevel, ModeReading, PeakLabel, PeakSettings, find_peaks};
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::spectral::{AveragedSpectra, Lines};

/// Curves of the fitted modes over the functions (H1, or those of a file) of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedCurves {
    /// Number of fitted modes. Fitted combinations of others have poles of their own, and are no modes.
    pub modes: usize,
    /// Band of the curves (Hz).
    pub band: (f64, f64),
    /// Index of the spectra's line on which the curves begin.
    pub first: usize,
    /// The curve of each response. `None` where its function is zero throughout, has a value that is no number, or
    /// where the lines are too few for the unknowns.
    pub functions: Vec<Option<Synthesis>>,
}

/// Returns the curves of a recording's fitted modes, and takes out of the strong peaks those that they explain.
/// `forms` are those of the responses; `None` without functions or fitted modes.
pub(super) fn explain(
    averages: &AveragedSpectra,
    added_decay: f64,
    readings: &[ModeReading],
    forms: &[Option<ResponseForm>],
    unlisted: &mut Vec<UnlistedPeak>,
) -> Option<FittedCurves> {
    let functions = averages.h1.as_deref()?;
    let lines = &averages.lines;
    let curves = fitted_curves(functions, lines, added_decay, readings, forms)?;
    unlisted.retain(|peak| !curves.follow(functions, &peak.lines));
    Some(curves)
}

/// Most power that curves leave of a peak that they explain, as a share of its own: an error of a tenth. A mode that makes
/// a peak of 2 dB changes the function by more than a quarter.
const MOST_LEFT: f64 = 0.01;

impl FittedCurves {
    /// Returns true if the curves follow the functions on these lines. Between two antiresonances even a mode far away
    /// makes a maximum. Each function counts by its power in the band.
    fn follow(&self, functions: &[Vec<Complex64>], lines: &Range<usize>) -> bool {
        let (mut left, mut all) = (0.0, 0.0);
        for (function, own) in functions.iter().zip(&self.functions) {
            let Some(own) = own else { continue };
            let total: f64 = own.values.iter().map(Complex64::norm_sqr).sum();
            for line in lines.clone() {
                let place = line.checked_sub(self.first);
                let Some(value) = place.and_then(|place| own.values.get(place)) else {
                    return false;
                };
                left += (function[line] - value).norm_sqr() / total;
                all += function[line].norm_sqr() / total;
            }
        }
        all > 0.0 && left <= MOST_LEFT * all
    }
}

/// Fits the functions of a recording by its fitted modes; `None` without fitted modes.
///
/// The poles are those of the fits. Residues, and a term each for the modes below and above the band, are fitted to the
/// functions themselves. `forms` are those of the responses. The band begins and ends where the bands of the fits do:
/// beyond, nothing was looked for, or noise alone decides.
fn fitted_curves(
    functions: &[Vec<Complex64>],
    lines: &Lines,
    added_decay: f64,
    readings: &[ModeReading],
    forms: &[Option<ResponseForm>],
) -> Option<FittedCurves> {
    let fits = readings.iter();
    let fits = fits.filter_map(|reading| Some(&reading.fit.as_deref()?.mode));
    let fits: Vec<&ModeFit> = fits.collect();
    let listed = readings.iter();
    let listed = listed.filter(|reading| reading.fit.is_some() && reading.label.is_none());
    let (first, last) = range(lines, &fits)?;
    let frequencies: Vec<f64> = (first..=last).map(|line| lines.frequency(line)).collect();
    let poles: Vec<Complex64> = fits.iter().map(|fit| fit.pole).collect();
    let wanted = SynthesisLines {
        frequencies: &frequencies,
        poles: &poles,
        added_decay,
    };
    let columns: Vec<&[Complex64]> = functions
        .iter()
        .map(|values| values.get(first..=last).unwrap_or_default())
        .collect();
    Some(FittedCurves {
        modes: listed.count(),
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
/// Fall of the level (dB) from a peak to where its lines end.
const FALL: f64 = 2.0;

/// A strong peak that is neither a listed mode nor explained otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct UnlistedPeak {
    /// Frequency of its line (Hz).
    pub frequency: f64,
    /// Lines about it on which the level is at most 2 dB lower.
    pub lines: Range<usize>,
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
            let foot = level.level_db[peak.index] - FALL;
            let (before, after) = level.level_db.split_at(peak.index);
            let left = before.iter().rposition(|level| *level < foot);
            let right = after.iter().position(|level| *level < foot);
            let end = right.map_or(level.level_db.len(), |right| peak.index + right);
            unlisted.push(UnlistedPeak {
                frequency,
                lines: left.map_or(0, |left| left + 1)..end,
                above_noise_db,
            });
        }
    }
    unlisted.sort_by(|a, b| b.above_noise_db.total_cmp(&a.above_noise_db));
    unlisted
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Level of 1000 lines, 1 Hz apart, over noise of 0 dB.
    fn level(peaks: &[(f64, f64)]) -> CompositeLevel {
        let lines = Lines {
            low: 0.0,
            high: 1000.0,
            spacing: 1.0,
            block: 2560,
            duration: 1.0,
        };
        let db = lines.frequencies().into_iter().map(|line| {
            let hills = peaks
                .iter()
                .map(|(at, height)| height - 2.0 * (line - at).abs());
            hills.fold(1.0, f64::max)
        });
        CompositeLevel {
            lines,
            level_db: db.collect(),
            noise_db: Some(vec![0.0; lines.points()]),
        }
    }

    /// A reading on a line with a half-power width of 4 Hz.
    fn reading(frequency: f64, label: Option<PeakLabel>) -> ModeReading {
        ModeReading {
            damping_ratio: label.is_none().then_some(2.0 / frequency),
            label,
            ..ModeReading::on_line(frequency, 0.5)
        }
    }

    fn found(peaks: &[(f64, f64)], readings: &[ModeReading]) -> Vec<f64> {
        let found = unlisted_peaks(&level(peaks), &PeakSettings::default(), readings);
        found.iter().map(|peak| peak.frequency).collect()
    }

    #[test]
    fn limit_only_strong_peaks_within_the_band_are_unlisted() {
        let peaks = [
            (10.0, 50.0),
            (300.0, 30.0),
            (500.0, 40.0),
            (700.0, 18.0),
            (985.0, 50.0),
        ];
        assert_eq!(found(&peaks, &[]), [500.0, 300.0]);
    }

    #[test]
    fn limit_modes_and_hum_explain_a_peak_and_no_resonance_does_not() {
        let peaks = [(300.0, 30.0)];
        let of = |at: f64, label| found(&peaks, &[reading(at, label)]).len();
        assert_eq!(of(303.9, None), 0);
        assert_eq!(of(304.1, None), 1);
        assert_eq!(of(300.0, Some(PeakLabel::Mains(300.0))), 0);
        assert_eq!(of(300.0, Some(PeakLabel::ForceGap)), 0);
        assert_eq!(of(300.0, Some(PeakLabel::NoResonance)), 1);
    }

    #[test]
    fn limit_without_known_noise_no_peak_is_unlisted() {
        let level = CompositeLevel {
            noise_db: None,
            ..level(&[(300.0, 60.0)])
        };
        assert!(unlisted_peaks(&level, &PeakSettings::default(), &[]).is_empty());
    }

    #[test]
    fn limit_a_curve_explains_the_maxima_that_it_has_too() {
        let lines = level(&[(300.0, 30.0)]);
        let unlisted = unlisted_peaks(&lines, &PeakSettings::default(), &[]);
        // 2 dB to either side: one line each.
        assert_eq!(unlisted[0].lines, 299..302);
        let function: Vec<Complex64> = (0..=1000)
            .map(|line| Complex64::from(f64::from(line)))
            .collect();
        let of = |first: usize, factor: f64| FittedCurves {
            modes: 1,
            band: (200.0, 400.0),
            first,
            functions: vec![Some(Synthesis {
                form: ResponseForm::Receptance,
                residues: Vec::new(),
                upper: Complex64::ZERO,
                lower: Complex64::ZERO,
                values: function[first..=400].iter().map(|h| h * factor).collect(),
                left: 0.0,
            })],
        };
        let functions = [function.clone()];
        assert!(of(200, 1.09).follow(&functions, &unlisted[0].lines));
        assert!(!of(200, 1.11).follow(&functions, &unlisted[0].lines));
        // The curve begins on the peak.
        assert!(!of(300, 1.0).follow(&functions, &unlisted[0].lines));
    }
}
