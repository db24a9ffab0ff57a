//! What the header of a dataset 58 or 58b says.

use std::fmt;

use super::axis::{Axis, TIME};

/// What a function is (record 6, field 1).
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

/// How a dataset's values are stored.
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

/// Whether values are real or complex.
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

/// Where the points lie along the abscissa.
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
        (self.node != 0).then(|| format!("{}{}", self.node, self.direction_words()))
    }

    fn direction_words(&self) -> String {
        let axis = match self.direction.unsigned_abs() {
            1 => "X",
            2 => "Y",
            3 => "Z",
            4 => "RX",
            5 => "RY",
            6 => "RZ",
            _ => return String::new(),
        };
        let sign = if self.direction < 0 { '-' } else { '+' };
        format!(":{sign}{axis}")
    }

    /// Whether the direction is one of rotation.
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

/// A function, as its header describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    /// What it is.
    pub function_type: FunctionType,
    /// The five lines of free text, `None` for "NONE": description, run, date and time, two more.
    pub id_lines: [Option<String>; 5],
    /// Where the response was measured.
    pub response: Point,
    /// Where the excitation acted.
    pub reference: Point,
    /// Text or binary.
    pub coding: UffCoding,
    /// Real or complex.
    pub ordinate: Ordinate,
    /// Single or double precision.
    pub precision: Precision,
    /// Points that the header promises.
    pub points: u64,
    /// Where they lie.
    pub abscissa: Abscissa,
    /// The abscissa's axis: time or frequency.
    pub abscissa_axis: Axis,
    /// The ordinate's axis, or that of its numerator.
    pub numerator: Axis,
    /// The axis of the ordinate's denominator: the excitation of a frequency response.
    pub denominator: Axis,
}

impl Function {
    /// Whether it is a signal over time: a time response, or a general function over time.
    pub fn is_time_series(&self) -> bool {
        let general = self.function_type == FunctionType(0);
        self.function_type == FunctionType::TIME_RESPONSE
            || (general && self.abscissa_axis.quantity == TIME)
    }

    /// Numbers stored for each point, the abscissa included.
    pub(super) fn numbers(&self) -> usize {
        let ordinate = match self.ordinate {
            Ordinate::Real => 1,
            Ordinate::Complex => 2,
        };
        ordinate + self.abscissa_numbers()
    }

    /// 1 where the abscissa is stored with every point, else 0.
    pub(super) fn abscissa_numbers(&self) -> usize {
        match self.abscissa {
            Abscissa::Even { .. } => 0,
            Abscissa::Uneven => 1,
        }
    }
}
