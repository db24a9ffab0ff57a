//! How strongly each peak was seen, and what it costs to take a weak one for a mode while a strong one
//! beside it is left over.
//!
//! A mode whose frequency changes while it rings is fitted by several poles, and some of them carry next
//! to nothing. All lie within the model's discrepancy of the mode, so that frequencies do not tell them
//! apart, and the shape of a weak pole is as good as any direction.

use super::{MeasuredPeak, shape};

/// How strongly one recording saw a peak.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PeakStrength {
    /// Energy of its fitted oscillation (a unit that all peaks of the recording share); `None` without
    /// a fit.
    pub energy: Option<f64>,
    /// Height of its own peak over the noise (dB); `None` of a pole that makes no peak.
    pub level_db: Option<f64>,
}

/// Peaks nearer than this, relative, may be the same mode: twice what the model usually misses of a
/// frequency.
const NEAR: f64 = 0.03;
/// A pole without a peak of its own counts a tenth of its energy where the stronger one makes a peak: poles
/// that only mend the line of another have large amplitudes that cancel.
const NO_PEAK: f64 = 0.1;
/// Largest price of one weak peak: a mode may be near its node at every tap and sensor while torsion
/// beside it is seen well, once in a hundred times.
const MOST: f64 = 4.6;

/// For each peak its stronger neighbours, with the price of taking this one while that one is left over.
pub(super) struct Neighbours {
    stronger: Vec<Vec<(usize, f64)>>,
}

impl Neighbours {
    pub fn of(peaks: &[MeasuredPeak]) -> Self {
        let of_one = |index: usize| {
            let own = &peaks[index];
            let near = |other: &usize| {
                *other != index && (peaks[*other].frequency / own.frequency).ln().abs() <= NEAR
            };
            (0..peaks.len())
                .filter(near)
                .filter_map(|other| Some((other, price(own, &peaks[other])?)))
                .collect()
        };
        Neighbours {
            stronger: (0..peaks.len()).map(of_one).collect(),
        }
    }

    /// Price of one peak as a mode if none of its neighbours is one.
    pub fn alone(&self, peak: usize) -> f64 {
        let prices = self.stronger[peak].iter().map(|one| one.1);
        prices.fold(0.0, f64::max)
    }

    /// Price of an assignment: of each numbered peak beside the strongest one left over.
    pub fn cost(&self, numbers: &[Option<usize>]) -> f64 {
        let left_over = |one: &&(usize, f64)| numbers[one.0].is_none();
        let of_peak = |(peak, _): (usize, &Option<usize>)| {
            let prices = self.stronger[peak].iter().filter(left_over);
            prices.map(|one| one.1).fold(0.0, f64::max)
        };
        let numbered = numbers.iter().enumerate().filter(|one| one.1.is_some());
        numbered.map(of_peak).sum()
    }
}

/// Pairs whose shapes may be compared: without the weak peaks beside a stronger one that is left over and
/// whose own shape is lost in noise. What is known of the weaker one then speaks for neither.
pub(super) fn comparable(
    pairs: &[(usize, usize)],
    numbers: &[Option<usize>],
    (peaks, neighbours): (&[MeasuredPeak], &Neighbours),
) -> Vec<(usize, usize)> {
    let is_faint = |other: usize| {
        let shape = &peaks[other].shape;
        numbers[other].is_none() && !shape.is_empty() && !shape::is_clear(shape)
    };
    let hidden = |peak: usize| neighbours.stronger[peak].iter().any(|one| is_faint(one.0));
    let kept = pairs.iter().filter(|pair| !hidden(pair.0));
    kept.copied().collect()
}

/// ln of the ratio of two amplitudes in the recording that sees the weaker one best; `None` where no
/// recording saw both, or it is not the weaker one.
fn price(own: &MeasuredPeak, other: &MeasuredPeak) -> Option<f64> {
    let both = own.strengths.iter().zip(&other.strengths);
    let prices = both.filter_map(|(own, other)| price_in(own.as_ref()?, other.as_ref()?));
    let least = prices.reduce(f64::min)?;
    (least > 0.0).then_some(least.min(MOST))
}

fn price_in(own: &PeakStrength, other: &PeakStrength) -> Option<f64> {
    if let (Some(a), Some(b)) = (own.energy, other.energy) {
        let peakless = own.level_db.is_none() && other.level_db.is_some();
        let a = if peakless { NO_PEAK * a } else { a };
        return (a > 0.0 && b > 0.0).then(|| 0.5 * (b / a).ln());
    }
    // 20 dB are a factor of ten in amplitude.
    let (a, b) = own.level_db.zip(other.level_db)?;
    Some((b - a) / 20.0 * std::f64::consts::LN_10)
}
