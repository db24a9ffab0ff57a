//! Frequency and damping against log amplitude.

use super::polynomial::Polynomial;
use super::student;
use super::{AmplitudeCurve, AmplitudePoint};

/// Highest degree of the curve through the points: a joint's curve bends once, or levels off at
/// either end.
const MOST_DEGREE: usize = 4;
/// Degrees of freedom that the curve leaves at least.
const LEAST_FREEDOM: usize = 2;
/// Probability outside the stated bounds.
const OUTSIDE: f64 = 0.05;
/// How far beyond the outermost points the curve is read (shares of half their range): the first and
/// last segments reach that far.
const BEYOND: f64 = 0.15;

/// One quantity (frequency in Hz, or damping ratio) against log amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct Trend {
    /// Change per e-fold of the amplitude (unit of the quantity): slope of the weighted straight line.
    pub slope: f64,
    /// Its standard uncertainty, scatter of the points about the line included.
    pub slope_std: f64,
    /// Probability of a slope at least as large without any change (Student's test).
    pub p_value: f64,
    /// Scatter of the points about the curve over their own uncertainties; above 1 they differ by more
    /// than noise (between taps: the structure changed).
    pub scatter: f64,
    /// Value at the first point of the loudest tap, at the largest amplitude.
    pub first: f64,
    /// Value at the smallest amplitude.
    pub last: f64,
    /// Last less first.
    pub change: f64,
    /// 95 % bound of the change.
    pub change_bound: f64,
    curve: Polynomial,
}

/// Frequency and damping at one amplitude or time, with 95 % bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeReading {
    /// Amplitude (unit of the strongest sensor).
    pub amplitude: f64,
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Its 95 % bound (Hz).
    pub frequency_bound: f64,
    /// Damping ratio (1).
    pub damping_ratio: f64,
    /// Its 95 % bound (1).
    pub damping_bound: f64,
}

/// Trend of the frequency (Hz).
pub(super) fn frequency_trend(points: &[AmplitudePoint]) -> Option<Trend> {
    trend(points, |p| (p.frequency, p.frequency_std))
}

/// Trend of the damping ratio.
pub(super) fn damping_trend(points: &[AmplitudePoint]) -> Option<Trend> {
    trend(points, |p| (p.damping_ratio, p.damping_std))
}

fn trend(points: &[AmplitudePoint], of: fn(&AmplitudePoint) -> (f64, f64)) -> Option<Trend> {
    let values: Vec<(f64, f64, f64)> = points
        .iter()
        .map(|point| {
            let (value, std) = of(point);
            (point.amplitude.ln(), value, std)
        })
        .collect();
    let low = values.iter().map(|v| v.0).fold(f64::INFINITY, f64::min);
    let high = values.iter().map(|v| v.0).fold(f64::NEG_INFINITY, f64::max);
    let line = Polynomial::fit(&values, 1)?;
    let (slope, slope_std) = line.between(0.0, 1.0);
    let most = MOST_DEGREE.min(values.len().saturating_sub(1 + LEAST_FREEDOM));
    let curve = Polynomial::best(&values, most)?;
    let (change, change_std) = curve.between(high, low);
    Some(Trend {
        slope,
        slope_std,
        p_value: student::two_sided(slope / slope_std, line.freedom),
        scatter: (curve.chi_squared / curve.freedom).sqrt(),
        first: curve.at(high).0,
        last: curve.at(low).0,
        change,
        change_bound: student::quantile(OUTSIDE, curve.freedom) * change_std,
        curve,
    })
}

impl Trend {
    /// Value and 95 % bound at an amplitude; `None` outside the points' range and a little beyond.
    pub fn at_amplitude(&self, amplitude: f64) -> Option<(f64, f64)> {
        let x = amplitude.ln();
        if !self.curve.reaches(x, BEYOND) {
            return None;
        }
        let (value, std) = self.curve.at(x);
        let bound = student::quantile(OUTSIDE, self.curve.freedom) * std;
        Some((value, bound))
    }
}

pub(super) fn reading_at(curve: &AmplitudeCurve, amplitude: f64) -> Option<AmplitudeReading> {
    let (frequency, frequency_bound) = curve.frequency.as_ref()?.at_amplitude(amplitude)?;
    let (damping_ratio, damping_bound) = curve.damping.as_ref()?.at_amplitude(amplitude)?;
    Some(AmplitudeReading {
        amplitude,
        frequency,
        frequency_bound,
        damping_ratio,
        damping_bound,
    })
}

/// The amplitude at a time lies on the line of log amplitude over time through the two points beside
/// it; beyond the ends through the two outermost.
pub(super) fn reading_at_time(
    curve: &AmplitudeCurve,
    tap: usize,
    time: f64,
) -> Option<AmplitudeReading> {
    let points: Vec<&AmplitudePoint> = curve.points.iter().filter(|p| p.tap == tap).collect();
    let later = points.partition_point(|p| p.time < time);
    let from = later.saturating_sub(1).min(points.len().checked_sub(2)?);
    let (a, b) = (points[from], points[from + 1]);
    let share = (time - a.time) / (b.time - a.time);
    let log = a.amplitude.ln() + share * (b.amplitude / a.amplitude).ln();
    reading_at(curve, log.exp())
}
