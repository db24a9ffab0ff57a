//! When the points of a function lie, and which functions lie on the same points.

use super::axis::label_unit;
use super::error::UffError;
use super::header::{Abscissa, Function};
use super::list::{Dataset, UniversalFile};
use super::values::Values;
use crate::recording::RecordingError;
use crate::recording::time::{TimeCheck, UnevenStep};

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
    /// How many the header promises.
    pub points: u64,
}

impl EvenPoints {
    /// Whether values on these and on other points belong together: equal in number and distance,
    /// beginning within half a step, as channels of one converter do.
    pub(in crate::recording) fn matches(&self, other: &Self) -> bool {
        let step = (self.step / other.step - 1.0).abs() <= SAME_STEP;
        step && self.points == other.points && (self.start - other.start).abs() <= 0.5 * self.step
    }
}

/// The unit that an abscissa is in inside this program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::recording) enum AbscissaUnit {
    Seconds,
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
}

/// Where the points of a function lie. A stored abscissa is read and must be even.
///
/// The header prints the step with six digits. Where a simpler number lies within that rounding, it
/// is used: for time a whole sample rate, for frequency a whole number of 2^-12 Hz.
pub(in crate::recording) fn even_points(
    file: &UniversalFile,
    (dataset, function): (&Dataset, &Function),
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
        Abscissa::Uneven => match stored_abscissa(file, (dataset, function))? {
            Ok((start, step)) => (start * factor, step * factor),
            Err(Some((point, uneven, expected))) => {
                return Err(UffError::Uneven {
                    file: file.name.clone(),
                    dataset: dataset.number,
                    point,
                    value: uneven.time * factor,
                    step: uneven.step * factor,
                    expected: expected * factor,
                    unit: unit.name(),
                }
                .into());
            }
            Err(None) => return Ok(Err("it has fewer than two points and no step".to_owned())),
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

/// Start and step of a stored abscissa (file units); the point, step and expected step where it is
/// uneven; `Err(None)` with fewer than two points.
type Stored = Result<(f64, f64), Option<(u64, UnevenStep, f64)>>;

fn stored_abscissa(
    file: &UniversalFile,
    (dataset, function): (&Dataset, &Function),
) -> Result<Stored, RecordingError> {
    let values = Values::new(file, dataset, function)?;
    let mut opened = values.open()?;
    let mut reader = values.reader(0, &mut opened)?;
    let width = values.numbers;
    let mut check: Option<TimeCheck> = None;
    let (mut numbers, mut point, mut start) = (Vec::new(), 0_u64, 0.0);
    loop {
        let wanted = (HEAD_POINTS * width) as u64;
        let mut got = 0;
        // The reference step is taken from a full head.
        while got < wanted {
            match reader.next(&mut opened, wanted - got, &mut numbers)? {
                0 => break,
                more => got += more,
            }
        }
        let abscissas: Vec<(f64, String)> = numbers
            .chunks_exact(width)
            .filter_map(|point| point.first().map(|x| (*x, printed(*x))))
            .collect();
        if abscissas.is_empty() {
            break;
        }
        let cells = || abscissas.iter().map(|(x, cell)| (*x, cell.as_bytes()));
        let check = check.get_or_insert_with(|| TimeCheck::new(cells()));
        for (x, cell) in cells() {
            point += 1;
            start = if point == 1 { x } else { start };
            if let Err(uneven) = check.add(x, cell, point) {
                return Ok(Err(Some((uneven.line, uneven, check.reference()))));
            }
        }
        numbers.clear();
    }
    let rate = check.and_then(|check| check.sample_rate(1.0));
    Ok(rate.map(|(_, used)| (start, 1.0 / used)).ok_or(None))
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

/// Functions, or what the caller knows them by, and where their points lie.
type Timed<T> = Vec<(T, EvenPoints)>;

/// The largest set of functions on the same points, the first of several equally large ones, and
/// the rest.
pub(in crate::recording) fn largest_group<T>(all: Timed<T>) -> (Timed<T>, Timed<T>) {
    let size = |of: &EvenPoints| all.iter().filter(|(_, other)| of.matches(other)).count();
    let sizes: Vec<usize> = all.iter().map(|(_, points)| size(points)).collect();
    let most = sizes.iter().copied().max().unwrap_or(0);
    let first = sizes.iter().position(|size| *size == most);
    let Some(chosen) = first.and_then(|at| all.get(at)).map(|(_, points)| *points) else {
        return (Vec::new(), all);
    };
    all.into_iter()
        .partition(|(_, points)| chosen.matches(points))
}
