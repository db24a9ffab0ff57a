//! Universal files: the functions (datasets 58 and 58b) of analysers and recorders, and modes (dataset 55).
//!
//! A universal file is a row of datasets between lines of their own that hold `    -1`. A dataset 58
//! has eleven header records in fixed columns and then its values, as text in fixed columns or, as
//! 58b, as IEEE numbers. Source: the descriptions of universal datasets by the Structural Dynamics
//! Research Laboratory, University of Cincinnati (dataset 58, with addendum on units, and 164).
//!
//! Important conventions:
//! - The number of values is what record 7 says; what stands behind them is padding. A record 7 that
//!   promises more than the file holds is not believed: values are read as far as they go.
//! - The abscissa of uneven 58b data is single precision whatever the ordinate is (12 bytes a point
//!   in case 6, 20 in case 8). Files with a double precision abscissa exist; their length tells.
//! - Axis labels win over the file's unit system (dataset 164), which wins over no unit.
//! - Dataset numbers are 1-based and count every dataset of the file, whatever its type.
//!
//! [`list_datasets`] reads headers only and jumps over the values. Values are read in blocks. Of text
//! the first 16 million samples are kept in memory; beyond, it is parsed again whenever it is asked
//! for, from places remembered every 64 kB. No file has to fit into memory.

mod list;
mod mode_shapes;
mod node_line;
mod time_series;
mod values;

use std::fmt;

use super::text::{decode_text, parse_fortran, shown};

pub use list::{Dataset, UniversalFile, list_datasets};
pub use mode_shapes::{ModeShapes, NodalMode, Node, read_mode_shapes};
pub use node_line::{NoLine, NodeLine, PlacedNode, ShapeAtNode};
pub use values::{FunctionValues, read_function};

pub(super) use list::Entry;
pub(super) use time_series::{
    AbscissaUnit, EvenPoints, FunctionGroup, even_points, left_out, open_uff,
};

// ---- Header of a dataset 58 or 58b: eleven records of fields in fixed columns.

/// Type of a function (record 6, field 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FunctionType(pub u32);

/// Function types in the order of their numbers.
const FUNCTION_TYPES: [&str; 28] = [
    "general function",
    "time response",
    "auto spectrum",
    "cross spectrum",
    "frequency response function",
    "transmissibility",
    "coherence",
    "auto correlation",
    "cross correlation",
    "power spectral density",
    "energy spectral density",
    "probability density function",
    "spectrum",
    "cumulative frequency distribution",
    "peaks valley",
    "stress/cycles",
    "strain/cycles",
    "orbit",
    "mode indicator function",
    "force pattern",
    "partial power",
    "partial coherence",
    "eigenvalue",
    "eigenvector",
    "shock response spectrum",
    "finite impulse response filter",
    "multiple coherence",
    "order function",
];

impl FunctionType {
    /// Time response.
    pub const TIME_RESPONSE: Self = Self(1);
    /// Frequency response function.
    pub const FREQUENCY_RESPONSE: Self = Self(4);
    /// Coherence.
    pub const COHERENCE: Self = Self(6);

    /// The type in words.
    pub fn name(self) -> &'static str {
        let at = usize::try_from(self.0).unwrap_or(usize::MAX);
        FUNCTION_TYPES
            .get(at)
            .copied()
            .unwrap_or("unknown function")
    }
}

/// Coding of a dataset's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UffCoding {
    /// Dataset 58: text.
    Ascii,
    /// Dataset 58b: binary, its byte order and floating-point format as the header numbers them.
    Binary {
        /// 1 little endian, 2 big endian.
        order: u32,
        /// 1 DEC VMS, 2 IEEE 754, 3 IBM 5/370.
        format: u32,
    },
}

/// Kind of values: real or complex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ordinate {
    /// One number a point.
    Real,
    /// Two numbers a point.
    Complex,
}

/// Precision of the values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits, or six digits.
    Single,
    /// 64 bits, or thirteen digits.
    Double,
}

/// Spacing of the points along the abscissa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Abscissa {
    /// Evenly spaced; nothing stored.
    Even {
        /// First abscissa (file units: s or Hz as a rule).
        start: f64,
        /// Distance of two points (file units).
        step: f64,
        /// One unit of the last digit that the step was printed with (file units).
        step_digit: f64,
    },
    /// Stored with every point.
    Uneven,
}

/// A place and direction on the structure (half of record 6).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Point {
    /// Name, where there is one.
    pub name: Option<String>,
    /// Node number; 0 where nodes are not used.
    pub node: i64,
    /// 0 scalar; 1, 2, 3 along +X, +Y, +Z; 4, 5, 6 about them; negative against them.
    pub direction: i32,
}

impl Point {
    /// Node and direction such as "12:+Z"; `None` without a node.
    pub fn degree_of_freedom(&self) -> Option<String> {
        if self.node == 0 {
            return None;
        }
        let axis = match self.direction.unsigned_abs() {
            1 => "X",
            2 => "Y",
            3 => "Z",
            4 => "RX",
            5 => "RY",
            6 => "RZ",
            _ => return Some(self.node.to_string()),
        };
        let sign = if self.direction < 0 { '-' } else { '+' };
        Some(format!("{}:{sign}{axis}", self.node))
    }

    /// Returns `true` for a direction of rotation.
    pub fn is_rotational(&self) -> bool {
        (4..=6).contains(&self.direction.unsigned_abs())
    }
}

impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.name, self.degree_of_freedom()) {
            (Some(name), Some(place)) => write!(f, "{name} {place}"),
            (Some(name), None) => write!(f, "{name}"),
            (None, Some(place)) => write!(f, "{place}"),
            (None, None) => write!(f, "-"),
        }
    }
}

/// One axis of a function (records 8 to 11).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Axis {
    /// Specific data type: 8 displacement, 11 velocity, 12 acceleration, 13 excitation force, 15
    /// pressure, 17 time, 18 frequency, 0 unknown.
    pub quantity: u32,
    /// Label, where there is one.
    pub label: Option<String>,
    /// Unit as written, where there is one.
    pub unit: Option<String>,
}

/// Specific data types, in words.
const QUANTITIES: [(u32, &str); 16] = [
    (1, "general"),
    (2, "stress"),
    (3, "strain"),
    (5, "temperature"),
    (6, "heat flux"),
    (8, "displacement"),
    (9, "reaction force"),
    (11, "velocity"),
    (12, "acceleration"),
    (13, "excitation force"),
    (15, "pressure"),
    (16, "mass"),
    (17, "time"),
    (18, "frequency"),
    (19, "rpm"),
    (20, "order"),
];

/// Type numbers of quantities that are used here.
pub(super) const UNKNOWN: u32 = 0;
pub(super) const DISPLACEMENT: u32 = 8;
pub(super) const REACTION_FORCE: u32 = 9;
pub(super) const VELOCITY: u32 = 11;
pub(super) const ACCELERATION: u32 = 12;
pub(super) const EXCITATION_FORCE: u32 = 13;
pub(super) const PRESSURE: u32 = 15;
pub(super) const TIME: u32 = 17;
pub(super) const FREQUENCY: u32 = 18;

impl Axis {
    /// Quantity of the axis in words; `None` where the file does not say.
    pub fn quantity_name(&self) -> Option<&'static str> {
        let known = QUANTITIES
            .iter()
            .find(|(number, _)| *number == self.quantity);
        known.map(|(_, name)| *name)
    }
}

/// The unit system of a file (dataset 164): file units divided by these are SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UnitSystem {
    pub length: f64,
    pub force: f64,
}

impl UnitSystem {
    /// Factor to SI and the SI unit of a quantity along a direction of translation; `None` for
    /// quantities that no sensor here measures.
    pub(super) fn si(&self, quantity: u32) -> Option<(f64, &'static str)> {
        // Addendum A of dataset 58: the exponents of length and force of each quantity.
        let (length, force, unit) = match quantity {
            DISPLACEMENT => (1, 0, "m"),
            VELOCITY => (1, 0, "m/s"),
            ACCELERATION => (1, 0, "m/s2"),
            EXCITATION_FORCE | REACTION_FORCE => (0, 1, "N"),
            PRESSURE => (-2, 1, "Pa"),
            _ => return None,
        };
        // SI = value / (length^l force^f), since file units are SI units times the factor.
        let factor = self.length.powi(-length) * self.force.powi(-force);
        Some((factor, unit))
    }
}

/// A function, as its header describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    /// Type of the function.
    pub function_type: FunctionType,
    /// The five lines of free text, `None` for "NONE": description, run, date and time, two more.
    pub id_lines: [Option<String>; 5],
    /// Point of the response.
    pub response: Point,
    /// Point of the excitation.
    pub reference: Point,
    /// Text or binary.
    pub coding: UffCoding,
    /// Real or complex.
    pub ordinate: Ordinate,
    /// Single or double precision.
    pub precision: Precision,
    /// Points that the header promises.
    pub points: u64,
    /// Their spacing.
    pub abscissa: Abscissa,
    /// The abscissa's axis: time or frequency.
    pub abscissa_axis: Axis,
    /// The ordinate's axis, or that of its numerator.
    pub numerator: Axis,
    /// The axis of the ordinate's denominator: the excitation of a frequency response.
    pub denominator: Axis,
}

impl Function {
    /// Returns `true` for a signal over time: a time response, or a general function over time.
    pub fn is_time_series(&self) -> bool {
        let general = self.function_type == FunctionType(0);
        self.function_type == FunctionType::TIME_RESPONSE
            || (general && self.abscissa_axis.quantity == TIME)
    }

    /// Numbers stored for each point: the abscissa where it is uneven, then the ordinate.
    fn numbers_per_point(&self) -> usize {
        let ordinate = match self.ordinate {
            Ordinate::Real => 1,
            Ordinate::Complex => 2,
        };
        ordinate + self.abscissa_numbers()
    }

    /// 1 where the abscissa is stored with every point, else 0.
    fn abscissa_numbers(&self) -> usize {
        usize::from(self.abscissa == Abscissa::Uneven)
    }

    /// Bytes of one number of the ordinate in binary data.
    fn ordinate_bytes(&self) -> usize {
        match self.precision {
            Precision::Single => 4,
            Precision::Double => 8,
        }
    }

    /// Bytes of one point of binary data.
    fn point_bytes(&self, abscissa_bytes: u64) -> u64 {
        let ordinates = (self.numbers_per_point() - self.abscissa_numbers()) as u64;
        ordinates * self.ordinate_bytes() as u64 + self.abscissa_numbers() as u64 * abscissa_bytes
    }
}

/// Remedy for a file of modes where samples or functions are wanted.
const MODES_REMEDY: &str = "its datasets 55 may hold modes, whose frequencies a test description reads: write file = \"modes.unv\" into its [measured]";

/// Header records of a dataset 58.
pub(super) const HEADER_LINES: usize = 11;

/// The line with a dataset's type, such as "    58" or "    58b     1     2          11        6408".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TypeLine {
    pub number: u32,
    pub coding: UffCoding,
    /// Bytes of binary data by the header.
    pub bytes: Option<u64>,
}

/// Reads the line that follows the opening -1.
fn parse_type_line(line: &[u8]) -> Option<TypeLine> {
    let text = decode_text(line.get(..line.len().min(200)).unwrap_or_default());
    let mut words = text.split_ascii_whitespace();
    let first = words.next()?;
    let digits = first.trim_end_matches(['b', 'B']);
    let number = digits.parse().ok()?;
    if digits.len() == first.len() {
        return Some(TypeLine {
            number,
            coding: UffCoding::Ascii,
            bytes: None,
        });
    }
    // Format(I6,1A1,I6,I6,I12,I12,..): byte order, floating-point format, header lines, bytes.
    let order = words.next().and_then(|word| word.parse().ok());
    let format = words.next().and_then(|word| word.parse().ok());
    Some(TypeLine {
        number,
        coding: UffCoding::Binary {
            order: order.unwrap_or(0),
            format: format.unwrap_or(0),
        },
        bytes: words.nth(1).and_then(|word| word.parse().ok()),
    })
}

/// Reads the eleven records behind the type line. `Err` holds the record (1-based) and what is wrong with it.
fn parse_header(
    lines: &[Vec<u8>; HEADER_LINES],
    coding: UffCoding,
) -> Result<Function, (usize, String)> {
    let records = lines.each_ref().map(|line| Record::of(line));
    let [
        id @ ..,
        degrees,
        form,
        abscissa_axis,
        numerator,
        denominator,
        _,
    ] = &records;
    // Record 6: Format(2(I5,I10),2(1X,10A1,I10,I4)).
    let function_type = degrees
        .integer(0, 5)
        .or_else(|| degrees.word(0)?.parse().ok())
        .and_then(|number| u32::try_from(number).ok())
        .ok_or_else(|| {
            (
                6,
                degrees.bad(0, 5, "the function type", "a number such as 1 or 4"),
            )
        })?;
    let (ordinate, precision, points, abscissa) = form.form().map_err(|problem| (7, problem))?;
    Ok(Function {
        function_type: FunctionType(function_type),
        id_lines: id.each_ref().map(|line| line.text(0, 80)),
        response: degrees.point(31),
        reference: degrees.point(56),
        coding,
        ordinate,
        precision,
        points,
        abscissa,
        abscissa_axis: abscissa_axis.axis(),
        numerator: numerator.axis(),
        denominator: denominator.axis(),
    })
}

/// A header line as characters: columns count characters, whatever bytes they take.
#[derive(Debug, Clone, Default)]
struct Record {
    characters: Vec<char>,
}

impl Record {
    fn of(line: &[u8]) -> Self {
        Record {
            characters: decode_text(line).trim_end().chars().collect(),
        }
    }

    fn slice(&self, at: usize, width: usize) -> String {
        self.characters.iter().skip(at).take(width).collect()
    }

    /// Text of a field; `None` where it is blank or "NONE".
    fn text(&self, at: usize, width: usize) -> Option<String> {
        let text = self.slice(at, width).replace(char::is_control, " ");
        let text = text.trim();
        (!text.is_empty() && text != "NONE").then(|| text.to_owned())
    }

    /// The field as an integer; a blank field is none.
    fn integer(&self, at: usize, width: usize) -> Option<i64> {
        self.text(at, width)?.parse().ok()
    }

    /// The word of a number, 0-based.
    fn word(&self, number: usize) -> Option<String> {
        let text: String = self.characters.iter().collect();
        text.split_ascii_whitespace().nth(number).map(str::to_owned)
    }

    /// Name, node and direction from a column on.
    fn point(&self, at: usize) -> Point {
        let direction = self.integer(at + 20, 4).unwrap_or(0);
        Point {
            name: self.text(at, 10),
            node: self.integer(at + 10, 10).unwrap_or(0),
            direction: i32::try_from(direction).unwrap_or(0),
        }
    }

    /// Records 8 to 11: Format(I10,3I5,2(1X,20A1)).
    fn axis(&self) -> Axis {
        Axis {
            quantity: u32::try_from(self.integer(0, 10).unwrap_or(0)).unwrap_or(0),
            label: self.text(26, 20),
            unit: self.text(47, 20),
        }
    }

    /// Record 7, Format(3I10,3E13.5): kind and precision of the ordinate, number of points, abscissa.
    fn form(&self) -> Result<(Ordinate, Precision, u64, Abscissa), String> {
        // Writers that do not keep the columns at least separate the numbers.
        let in_columns = (0..3).all(|field| self.integer(10 * field, 10).is_some());
        let fields = match in_columns {
            true => [(0, 10), (10, 10), (20, 10), (30, 13), (43, 13)]
                .map(|(at, width)| self.text(at, width)),
            false => [0, 1, 2, 3, 4].map(|number| self.word(number)),
        };
        let [kind, points, spacing, start, step] = fields.map(Option::unwrap_or_default);
        let (ordinate, precision) = match kind.parse() {
            Ok(2) => (Ordinate::Real, Precision::Single),
            Ok(4) => (Ordinate::Real, Precision::Double),
            Ok(5) => (Ordinate::Complex, Precision::Single),
            Ok(6) => (Ordinate::Complex, Precision::Double),
            _ => return Err(self.bad(0, 10, "the ordinate data type", "2, 4, 5 or 6")),
        };
        let points = points.parse::<i64>().ok();
        let points = points
            .and_then(|points| u64::try_from(points).ok())
            .ok_or_else(|| self.bad(10, 10, "the number of points", "a whole number from 0"))?;
        let abscissa = match spacing.parse() {
            Ok(0) => Abscissa::Uneven,
            Ok(1) => Abscissa::Even {
                start: self.finite(&start, 30, "the first abscissa")?,
                step: self.finite(&step, 43, "the abscissa step")?,
                step_digit: last_digit(&step),
            },
            _ => return Err(self.bad(20, 10, "the abscissa spacing", "0 (uneven) or 1 (even)")),
        };
        Ok((ordinate, precision, points, abscissa))
    }

    fn finite(&self, text: &str, at: usize, field: &str) -> Result<f64, String> {
        parse_fortran(text.as_bytes())
            .filter(|number| number.is_finite())
            .ok_or_else(|| self.bad(at, 13, field, "a finite number"))
    }

    /// Says what is wrong with a field.
    fn bad(&self, at: usize, width: usize, field: &str, allowed: &str) -> String {
        let value = shown(self.slice(at, width).trim().as_bytes());
        format!("{field} \"{value}\"; allowed: {allowed}")
    }
}

/// One unit of the last digit of a printed number.
fn last_digit(text: &str) -> f64 {
    let (mantissa, exponent) = match text.trim().split_once(['e', 'E', 'd', 'D']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse().unwrap_or(0)),
        None => (text.trim(), 0_i32),
    };
    let decimals = mantissa
        .split_once('.')
        .map_or(0, |(_, digits)| digits.len());
    let decimals = i32::try_from(decimals).unwrap_or(0);
    10_f64.powi(exponent.saturating_sub(decimals))
}
