//! Points of a function along time or frequency, and functions that lie on the same points.

use super::list::{Dataset, Entry, UniversalFile};
use super::values::Values;
use super::{Abscissa, Function, Ordinate};
use crate::recording::error::{RecordingError, UffError, short};
use crate::recording::spacing::TimeCheck;
use crate::recording::units::label_unit;

/// Points that settle the reference step of an uneven abscissa.
const HEAD_POINTS: usize = 4096;

/// Steps nearer than this, relatively, are the same: headers print them with six digits.
const SAME_STEP: f64 = 2e-6;

/// Evenly spaced points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::recording) struct EvenPoints {
    /// First abscissa (s or Hz).
    pub start: f64,
    /// Distance (s or Hz).
    pub step: f64,
    /// Number that the header promises.
    pub points: u64,
}

impl EvenPoints {
    /// Returns `true` where values on these and on other points belong together: equal in number and distance,
    /// beginning within half a step, as channels of one converter do.
    pub(in crate::recording) fn matches(&self, other: &Self) -> bool {
        let step = (self.step / other.step - 1.0).abs() <= SAME_STEP;
        step && self.points == other.points && (self.start - other.start).abs() <= 0.5 * self.step
    }
}

/// Unit that an abscissa has inside this program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::recording) enum AbscissaUnit {
    /// Unit of time series.
    Seconds,
    /// Unit of frequency responses.
    Hertz,
}

impl AbscissaUnit {
    fn name(self) -> &'static str {
        match self {
            Self::Seconds => "s",
            Self::Hertz => "Hz",
        }
    }

    /// Factor from the axis's unit; 1 where it has none that is known.
    fn factor(self, function: &Function) -> f64 {
        let Some(label) = &function.abscissa_axis.unit else {
            return 1.0;
        };
        let plain = label.trim_matches(['(', ')', '[', ']', ' ']);
        match self {
            Self::Seconds => [plain.to_owned(), plain.to_ascii_lowercase()]
                .iter()
                .find_map(|text| label_unit(text).filter(|(_, si)| *si == "s"))
                .map_or(1.0, |(factor, _)| factor),
            Self::Hertz if plain.eq_ignore_ascii_case("kHz") => 1e3,
            // 2 pi rad are one cycle.
            Self::Hertz if plain.eq_ignore_ascii_case("rad/s") => 0.5 / std::f64::consts::PI,
            Self::Hertz => 1.0,
        }
    }

    /// Returns why values of this kind cannot be used: time series are real, frequency responses complex.
    fn problem(self, ordinate: Ordinate) -> Option<&'static str> {
        match (self, ordinate) {
            (Self::Seconds, Ordinate::Complex) => Some("its values are complex"),
            (Self::Hertz, Ordinate::Real) => {
                Some("its values are real and say nothing of the phase")
            }
            _ => None,
        }
    }

    fn describe(self, points: &EvenPoints) -> String {
        let EvenPoints {
            start,
            step,
            points,
        } = *points;
        let start = short(start);
        match self {
            Self::Seconds => format!("{points} points at {} Hz from {start} s", short(1.0 / step)),
            Self::Hertz => format!("{points} lines from {start} Hz, {} Hz apart", short(step)),
        }
    }
}

/// Functions on the same points, and the others with the reason why they are left out.
pub(in crate::recording) struct FunctionGroup<'a> {
    pub functions: Vec<Entry<'a>>,
    /// Their points; `None` where no function can be used.
    pub points: Option<EvenPoints>,
    /// First those that cannot be used, then those on other points.
    pub left_out: Vec<(Entry<'a>, String)>,
}

impl<'a> FunctionGroup<'a> {
    /// Finds the largest set of functions on the same points, the first of several equally large ones.
    pub(in crate::recording) fn largest(
        file: &UniversalFile,
        candidates: impl Iterator<Item = Entry<'a>>,
        unit: AbscissaUnit,
    ) -> Result<Self, RecordingError> {
        let (mut usable, mut left_out) = (Vec::new(), Vec::new());
        for (dataset, function) in candidates {
            let points = match unit.problem(function.ordinate) {
                Some(problem) => Err(problem.to_owned()),
                None => even_points(file, dataset, function, unit)?,
            };
            match points {
                Ok(points) => usable.push(((dataset, function), points)),
                Err(problem) => left_out.push(((dataset, function), problem)),
            }
        }
        let mut largest: Option<(usize, Entry<'a>, EvenPoints)> = None;
        for (entry, points) in &usable {
            let size = usable
                .iter()
                .filter(|(_, other)| points.matches(other))
                .count();
            if largest.is_none_or(|(most, ..)| size > most) {
                largest = Some((size, *entry, *points));
            }
        }
        let mut functions = Vec::new();
        if let Some((_, (first, _), chosen)) = largest {
            for (entry, points) in &usable {
                if chosen.matches(points) {
                    functions.push(*entry);
                } else {
                    let (own, chosen) = (unit.describe(points), unit.describe(&chosen));
                    let reason = format!("{own}, where dataset {} has {chosen}", first.number);
                    left_out.push((*entry, reason));
                }
            }
        }
        Ok(Self {
            functions,
            points: largest.map(|(.., points)| points),
            left_out,
        })
    }
}

/// Settles where the points of a function lie; `Err` inside says why that is not known. A stored abscissa is read and must be even.
///
/// The header prints the step with six digits. Where a simpler number lies within that rounding, it
/// is used: for time a whole sample rate, for frequency a whole number of 2^-12 Hz.
pub(in crate::recording) fn even_points(
    file: &UniversalFile,
    dataset: &Dataset,
    function: &Function,
    unit: AbscissaUnit,
) -> Result<Result<EvenPoints, String>, RecordingError> {
    let factor = unit.factor(function);
    let (start, step) = match function.abscissa {
        Abscissa::Even {
            start,
            step,
            step_digit,
        } => {
            let (step, digit) = (step * factor, step_digit * factor);
            let simple = match unit {
                AbscissaUnit::Seconds => whole_rate(step, digit),
                AbscissaUnit::Hertz => dyadic(step, digit),
            };
            (start * factor, simple.unwrap_or(step))
        }
        Abscissa::Uneven => match stored_abscissa(file, dataset, function, unit)? {
            Some((start, step)) => (start * factor, step * factor),
            None => return Ok(Err("it has fewer than two points and no step".to_owned())),
        },
    };
    if !(step > 0.0 && step.is_finite() && start.is_finite()) {
        return Ok(Err(format!("its step is {step} {}", unit.name())));
    }
    Ok(Ok(EvenPoints {
        start,
        step,
        points: function.points,
    }))
}

/// The step of the whole sample rate that was printed as `step`.
fn whole_rate(step: f64, digit: f64) -> Option<f64> {
    let whole = (1.0 / step).round();
    // A digit, and not half of one: some writers cut off instead of rounding.
    let near = (1.0 / whole - step).abs() <= digit * (1.0 + 1e-9);
    (near && digit <= 1e-4 * step).then_some(1.0 / whole)
}

/// The coarsest multiple of a power of 1/2 that was printed as `step`, where all six digits show
/// that it was rounded. Sample rate over a block of 2^n samples is such a number.
fn dyadic(step: f64, digit: f64) -> Option<f64> {
    let digits = step / digit;
    if digit > 1e-4 * step || (digits / 10.0).fract().abs() < 1e-6 {
        return None;
    }
    (0..=12).map(|power| 2_f64.powi(power)).find_map(|scale| {
        let multiple = (step * scale).round() / scale;
        let near = (multiple - step).abs() <= 0.5 * digit * (1.0 + 1e-6);
        (near && multiple > 0.0).then_some(multiple)
    })
}

/// Returns start and step of an abscissa that is stored with every point (file units); `None` for fewer than two points.
fn stored_abscissa(
    file: &UniversalFile,
    dataset: &Dataset,
    function: &Function,
    unit: AbscissaUnit,
) -> Result<Option<(f64, f64)>, RecordingError> {
    let values = Values::new(file, dataset, function)?;
    let mut opened = values.open()?;
    let mut reader = values.reader(0, &mut opened)?;
    let mut check: Option<TimeCheck> = None;
    let (mut point, mut start) = (0_u64, 0.0);
    loop {
        // The reference step is taken from a full head.
        let mut abscissas: Vec<(f64, String)> = Vec::new();
        while abscissas.len() < HEAD_POINTS {
            let missing = (HEAD_POINTS - abscissas.len()) as u64;
            let points = reader.next(&mut opened, missing)?;
            if points.is_empty() {
                break;
            }
            let first_numbers = points.iter().step_by(values.numbers);
            abscissas.extend(first_numbers.map(|x| (*x, printed(*x))));
        }
        if abscissas.is_empty() {
            break;
        }
        let cells = abscissas.iter().map(|(x, cell)| (*x, cell.as_bytes()));
        let check = check.get_or_insert_with(|| TimeCheck::new(cells.clone()));
        for (x, cell) in cells {
            point += 1;
            start = if point == 1 { x } else { start };
            if let Err(found) = check.add(x, cell, point) {
                let factor = unit.factor(function);
                return Err(UffError::Uneven {
                    file: file.name.clone(),
                    dataset: dataset.number,
                    point: found.line,
                    value: found.time * factor,
                    step: found.step * factor,
                    expected: check.reference() * factor,
                    unit: unit.name(),
                }
                .into());
            }
        }
    }
    let rate = check.and_then(|check| check.sample_rate(1.0));
    Ok(rate.map(|(_, used)| (start, 1.0 / used)))
}

/// An abscissa as it may have been printed: with the digits of single precision, which is what the
/// format gives it, text or binary.
fn printed(abscissa: f64) -> String {
    let single = abscissa as f32;
    match f64::from(single) == abscissa {
        true => format!("{single:e}"),
        false => format!("{abscissa:e}"),
    }
}
