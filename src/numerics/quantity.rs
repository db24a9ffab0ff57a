//! Quantities with units, as text: "423 mm" becomes 0.423.
//!
//! Units exist only at the edge of the program, where people write numbers; inside, every value
//! is SI and `f64`. A quantity is read for a [`Dimension`], so "423 kg" is no length, and "g" is a
//! gram where a mass is wanted and 9.80665 m/s2 where an acceleration is.

/// Standard acceleration of free fall (m/s2), the "g" of accelerometers (exact by definition).
pub const STANDARD_GRAVITY: f64 = 9.80665;
/// Kind of quantity that a text is read as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// Length or displacement (m).
    Length,
    /// Young's modulus or sound pressure (Pa).
    Pressure,
    /// Density (kg/m3).
    Density,
    /// Mass (kg).
    Mass,
    /// Force (N).
    Force,
    /// Frequency (Hz).
    Frequency,
    /// Sample rate (samples per second, Hz).
    Rate,
    /// Translational stiffness (N/m).
    TranslationalStiffness,
    /// Torque (N m).
    Torque,
    /// Rotational stiffness (N m/rad).
    RotationalStiffness,
    /// Cross-coupling stiffness (N/rad).
    CouplingStiffness,
    /// A pure ratio (1); "2 %" is 0.02.
    Ratio,
    /// Temperature (degrees Celsius).
    Temperature,
    /// Acceleration (m/s2).
    Acceleration,
    /// Velocity (m/s).
    Velocity,
    /// Sensitivity of an accelerometer (V per m/s2).
    AccelerationSensitivity,
    /// Sensitivity of a velocity sensor (V per m/s).
    VelocitySensitivity,
    /// Sensitivity of a displacement sensor (V/m).
    DisplacementSensitivity,
    /// Sensitivity of a microphone (V/Pa).
    PressureSensitivity,
    /// Sensitivity of a force sensor (V/N).
    ForceSensitivity,
    /// Time (s).
    Time,
}

impl Dimension {
    /// Returns the quantity in words, with its article: "a length".
    pub fn in_words(self) -> &'static str {
        DIMENSIONS[self as usize].1
    }

    fn units(self) -> &'static [Unit] {
        DIMENSIONS[self as usize].2
    }

    /// Returns the SI unit as messages write it; empty for a ratio.
    pub fn si_unit(self) -> &'static str {
        match self {
            Self::Ratio => "",
            Self::RotationalStiffness => "N m/rad",
            Self::Torque => "N m",
            other => other.units().first().map_or("", |unit| unit.symbol),
        }
    }

    /// Returns the symbols this dimension accepts, SI unit first (a ratio has none).
    pub fn allowed_units(self) -> impl Iterator<Item = &'static str> {
        self.units().iter().map(|unit| unit.symbol)
    }

    /// Returns how many SI units one of `symbol` is, or `None` when it is no unit of this dimension or a
    /// temperature scale with another zero.
    pub fn factor(self, symbol: &str) -> Option<f64> {
        self.find(&normalise(symbol))
            .filter(|unit| unit.offset == 0.0)
            .map(|unit| unit.factor)
    }

    fn find(self, normalised: &str) -> Option<&'static Unit> {
        self.units().iter().find(|unit| unit.symbol == normalised)
    }
}

/// One inch (m), exact by definition.
const INCH: f64 = 0.0254;
/// One avoirdupois pound (kg), exact by definition.
const POUND: f64 = 0.453_592_37;
/// One pound-force (N): a pound under standard gravity.
const POUND_FORCE: f64 = POUND * STANDARD_GRAVITY;
/// One degree of arc (rad).
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// A unit: SI value = `factor` times number plus `offset`.
struct Unit {
    symbol: &'static str,
    factor: f64,
    offset: f64,
}

/// A unit without an offset, as all are but temperatures.
const fn unit(symbol: &'static str, factor: f64) -> Unit {
    shifted(symbol, factor, 0.0)
}

const fn shifted(symbol: &'static str, factor: f64, offset: f64) -> Unit {
    Unit {
        symbol,
        factor,
        offset,
    }
}

// The first unit of each list is the SI unit, which messages quote. Symbols stand here in the
// form that `normalise` makes of what people write: no blanks, no dots, plain digits.
const LENGTH: &[Unit] = &[
    unit("m", 1.0),
    unit("mm", 1e-3),
    unit("cm", 1e-2),
    unit("um", 1e-6),
    unit("nm", 1e-9),
    unit("km", 1e3),
    unit("in", INCH),
    unit("ft", 12.0 * INCH),
];
const TIME: &[Unit] = &[unit("s", 1.0), unit("ms", 1e-3), unit("min", 60.0)];
const PRESSURE: &[Unit] = &[
    unit("Pa", 1.0),
    unit("GPa", 1e9),
    unit("MPa", 1e6),
    unit("kPa", 1e3),
    unit("mPa", 1e-3),
    unit("N/m2", 1.0),
    unit("N/mm2", 1e6),
    unit("kN/mm2", 1e9),
    unit("bar", 1e5),
    unit("psi", POUND_FORCE / (INCH * INCH)),
    unit("ksi", 1e3 * POUND_FORCE / (INCH * INCH)),
    unit("Msi", 1e6 * POUND_FORCE / (INCH * INCH)),
];
const DENSITY: &[Unit] = &[
    unit("kg/m3", 1.0),
    unit("g/cm3", 1e3),
    unit("kg/dm3", 1e3),
    unit("t/m3", 1e3),
    unit("g/m3", 1e-3),
    unit("kg/l", 1e3),
    unit("lb/in3", POUND / (INCH * INCH * INCH)),
    unit("lb/ft3", POUND / (1728.0 * INCH * INCH * INCH)),
];
const MASS: &[Unit] = &[
    unit("kg", 1.0),
    unit("g", 1e-3),
    unit("mg", 1e-6),
    unit("t", 1e3),
    unit("lb", POUND),
    unit("oz", POUND / 16.0),
];
const FORCE: &[Unit] = &[
    unit("N", 1.0),
    unit("kN", 1e3),
    unit("mN", 1e-3),
    unit("MN", 1e6),
    unit("lbf", POUND_FORCE),
];
const FREQUENCY: &[Unit] = &[
    unit("Hz", 1.0),
    unit("kHz", 1e3),
    unit("mHz", 1e-3),
    unit("MHz", 1e6),
    unit("1/s", 1.0),
];
const RATE: &[Unit] = &[
    unit("Hz", 1.0),
    unit("kHz", 1e3),
    unit("MHz", 1e6),
    unit("S/s", 1.0),
    unit("kS/s", 1e3),
    unit("samples/s", 1.0),
    unit("1/s", 1.0),
];
const TRANSLATIONAL_STIFFNESS: &[Unit] = &[
    unit("N/m", 1.0),
    unit("kN/m", 1e3),
    unit("MN/m", 1e6),
    unit("GN/m", 1e9),
    unit("N/mm", 1e3),
    unit("kN/mm", 1e6),
    unit("N/um", 1e6),
    unit("lbf/in", POUND_FORCE / INCH),
];
const ROTATIONAL_STIFFNESS: &[Unit] = &[
    unit("Nm/rad", 1.0),
    unit("kNm/rad", 1e3),
    unit("MNm/rad", 1e6),
    unit("Nmm/rad", 1e-3),
    unit("Nm/deg", 1.0 / DEGREE),
    unit("Nm", 1.0),
    unit("kNm", 1e3),
    unit("lbfin/rad", POUND_FORCE * INCH),
];
const COUPLING_STIFFNESS: &[Unit] = &[
    unit("N/rad", 1.0),
    unit("kN/rad", 1e3),
    unit("MN/rad", 1e6),
    unit("N", 1.0),
    unit("kN", 1e3),
    unit("lbf/rad", POUND_FORCE),
];
const RATIO: &[Unit] = &[unit("%", 1e-2), unit("ppm", 1e-6)];
const TORQUE: &[Unit] = &[
    unit("Nm", 1.0),
    unit("kNm", 1e3),
    unit("mNm", 1e-3),
    unit("Nmm", 1e-3),
    unit("Ncm", 1e-2),
    unit("lbfin", POUND_FORCE * INCH),
    unit("lbfft", POUND_FORCE * 12.0 * INCH),
];
const TEMPERATURE: &[Unit] = &[
    unit("degC", 1.0),
    unit("C", 1.0),
    shifted("K", 1.0, -273.15),
    shifted("degF", 5.0 / 9.0, -160.0 / 9.0),
    shifted("F", 5.0 / 9.0, -160.0 / 9.0),
];
const ACCELERATION: &[Unit] = &[
    unit("m/s2", 1.0),
    unit("g", STANDARD_GRAVITY),
    unit("mg", 1e-3 * STANDARD_GRAVITY),
    unit("mm/s2", 1e-3),
    unit("cm/s2", 1e-2),
    unit("ft/s2", 12.0 * INCH),
];
const VELOCITY: &[Unit] = &[
    unit("m/s", 1.0),
    unit("mm/s", 1e-3),
    unit("cm/s", 1e-2),
    unit("um/s", 1e-6),
    unit("km/h", 1.0 / 3.6),
    unit("in/s", INCH),
];
const ACCELEROMETER: &[Unit] = &[
    unit("V/(m/s2)", 1.0),
    unit("mV/g", 1e-3 / STANDARD_GRAVITY),
    unit("V/g", 1.0 / STANDARD_GRAVITY),
    unit("mV/(m/s2)", 1e-3),
    unit("mVs2/m", 1e-3),
    unit("Vs2/m", 1.0),
];
const VELOCITY_SENSOR: &[Unit] = &[
    unit("V/(m/s)", 1.0),
    unit("mV/(m/s)", 1e-3),
    unit("mV/(mm/s)", 1.0),
    unit("V/(mm/s)", 1e3),
    unit("mVs/m", 1e-3),
    unit("Vs/m", 1.0),
];
const DISPLACEMENT_SENSOR: &[Unit] = &[
    unit("V/m", 1.0),
    unit("V/mm", 1e3),
    unit("mV/mm", 1.0),
    unit("mV/um", 1e3),
    unit("V/um", 1e6),
];
const MICROPHONE: &[Unit] = &[unit("V/Pa", 1.0), unit("mV/Pa", 1e-3)];
const FORCE_SENSOR: &[Unit] = &[
    unit("V/N", 1.0),
    unit("mV/N", 1e-3),
    unit("uV/N", 1e-6),
    unit("mV/lbf", 1e-3 / POUND_FORCE),
];

/// Every dimension with its words and units, SI unit first. They stand in the order of their declaration,
/// in which a stray unit is looked for.
const DIMENSIONS: [(Dimension, &str, &[Unit]); 21] = [
    (Dimension::Length, "a length", LENGTH),
    (Dimension::Pressure, "a pressure", PRESSURE),
    (Dimension::Density, "a density", DENSITY),
    (Dimension::Mass, "a mass", MASS),
    (Dimension::Force, "a force", FORCE),
    (Dimension::Frequency, "a frequency", FREQUENCY),
    (Dimension::Rate, "a sample rate", RATE),
    (
        Dimension::TranslationalStiffness,
        "a translational stiffness",
        TRANSLATIONAL_STIFFNESS,
    ),
    (Dimension::Torque, "a torque", TORQUE),
    (
        Dimension::RotationalStiffness,
        "a rotational stiffness",
        ROTATIONAL_STIFFNESS,
    ),
    (
        Dimension::CouplingStiffness,
        "a coupling stiffness",
        COUPLING_STIFFNESS,
    ),
    (Dimension::Ratio, "a ratio", RATIO),
    (Dimension::Temperature, "a temperature", TEMPERATURE),
    (Dimension::Acceleration, "an acceleration", ACCELERATION),
    (Dimension::Velocity, "a velocity", VELOCITY),
    (
        Dimension::AccelerationSensitivity,
        "the sensitivity of an accelerometer",
        ACCELEROMETER,
    ),
    (
        Dimension::VelocitySensitivity,
        "the sensitivity of a velocity sensor",
        VELOCITY_SENSOR,
    ),
    (
        Dimension::DisplacementSensitivity,
        "the sensitivity of a displacement sensor",
        DISPLACEMENT_SENSOR,
    ),
    (
        Dimension::PressureSensitivity,
        "the sensitivity of a microphone",
        MICROPHONE,
    ),
    (
        Dimension::ForceSensitivity,
        "the sensitivity of a force sensor",
        FORCE_SENSOR,
    ),
    (Dimension::Time, "a time", TIME),
];

/// Reason for which a text is not the quantity asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum QuantityError {
    /// It does not begin with a number.
    #[error("\"{text}\" does not begin with a number; {} is wanted, such as \"1.5 {}\"", expected.in_words(), expected.allowed_units().next().unwrap_or_default())]
    NoNumber {
        /// The text.
        text: String,
        /// Dimension that was wanted.
        expected: Dimension,
    },
    /// A decimal comma.
    #[error("\"{text}\" has a decimal comma; write a point: \"{corrected}\"")]
    DecimalComma {
        /// The text.
        text: String,
        /// The text with a point.
        corrected: String,
    },
    /// A number too large for 64-bit floating point.
    #[error("\"{text}\" is too large a number; write it with a larger unit or check its exponent")]
    TooLarge {
        /// The text.
        text: String,
    },
    /// The unit belongs to another dimension.
    #[error("\"{text}\" is {}, not {}; units allowed: {}", found.in_words(), expected.in_words(), unit_list(*expected))]
    WrongDimension {
        /// The text.
        text: String,
        /// Dimension of the unit.
        found: Dimension,
        /// Dimension that was wanted.
        expected: Dimension,
    },
    /// The unit is unknown.
    #[error("\"{text}\" has the unknown unit \"{unit}\"; units allowed for {}: {}", expected.in_words(), unit_list(*expected))]
    UnknownUnit {
        /// The text.
        text: String,
        /// The unknown unit.
        unit: String,
        /// Dimension that was wanted.
        expected: Dimension,
    },
}

fn unit_list(dimension: Dimension) -> String {
    dimension.allowed_units().collect::<Vec<_>>().join(", ")
}

/// Reads a number with an optional unit as the SI value of `dimension`; without a unit the number
/// is taken to be SI already. Blanks around and between are free, "µ", "·", "°" and raised digits
/// are understood.
///
/// # Errors
/// [`QuantityError`] with the text, the dimension wanted and the units allowed.
pub fn parse_quantity(text: &str, dimension: Dimension) -> Result<f64, QuantityError> {
    let trimmed = text.trim();
    let written = trimmed.replace('\u{2212}', "-");
    let (number, unit) = split_number(&written);
    let Ok(value) = number.replace('_', "").parse::<f64>() else {
        return Err(QuantityError::NoNumber {
            text: trimmed.into(),
            expected: dimension,
        });
    };
    let symbol = normalise(unit);
    if symbol.starts_with(',') {
        let corrected = trimmed.replacen(',', ".", 1);
        return Err(QuantityError::DecimalComma {
            text: trimmed.into(),
            corrected,
        });
    }
    let si = if symbol.is_empty() {
        value
    } else if let Some(known) = dimension.find(&symbol) {
        value * known.factor + known.offset
    } else {
        let mut others = DIMENSIONS.iter().map(|row| row.0);
        return Err(match others.find(|other| other.find(&symbol).is_some()) {
            Some(found) => QuantityError::WrongDimension {
                text: trimmed.into(),
                found,
                expected: dimension,
            },
            None => QuantityError::UnknownUnit {
                text: trimmed.into(),
                unit: unit.trim().into(),
                expected: dimension,
            },
        });
    };
    si.is_finite().then_some(si).ok_or(QuantityError::TooLarge {
        text: trimmed.into(),
    })
}

/// Splits "-1.5e3 mm" into its number and what follows. An "e" belongs to the number only when
/// digits follow it. "inf" and "nan" are no numbers here.
fn split_number(text: &str) -> (&str, &str) {
    let bytes = text.as_bytes();
    let mut end = after_digits(bytes, after_sign(bytes, 0));
    if bytes.get(end) == Some(&b'.') {
        end = after_digits(bytes, end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let exponent = after_sign(bytes, end + 1);
        let last = after_digits(bytes, exponent);
        if last > exponent {
            end = last;
        }
    }
    // Only ASCII bytes were passed over, so `end` lies between characters.
    text.split_at_checked(end).unwrap_or((text, ""))
}

/// Returns the place behind a sign, if there is one.
fn after_sign(bytes: &[u8], at: usize) -> usize {
    at + usize::from(matches!(bytes.get(at), Some(b'+' | b'-')))
}

/// Returns the place behind digits, if there are any.
fn after_digits(bytes: &[u8], at: usize) -> usize {
    let rest = bytes.get(at..).unwrap_or_default().iter();
    at + rest
        .take_while(|b| b.is_ascii_digit() || **b == b'_')
        .count()
}

/// Brings a unit into the spelling of the tables: "N·m / rad" and "N*m/rad" become "Nm/rad",
/// "kg/m³" and "kg/m^3" become "kg/m3", "µm" becomes "um", "°C" becomes "degC".
fn normalise(unit: &str) -> String {
    let mut spelled = String::new();
    for character in unit.chars() {
        match character {
            c if c.is_whitespace() => {}
            '·' | '⋅' | '*' | '^' => {}
            'µ' | 'μ' => spelled.push('u'),
            '²' => spelled.push('2'),
            '³' => spelled.push('3'),
            '°' => spelled.push_str("deg"),
            other => spelled.push(other),
        }
    }
    spelled
}

/// A value in the unit with the decimal prefix (none, k, M or G) that suits it.
///
/// Returns the factor to multiply by and the prefix: 1.4e6 gives (1e-6, "M"). Small values keep
/// their unit: "mN/m" is not in use.
pub fn prefix(value: f64) -> (f64, &'static str) {
    match value.abs() {
        v if !v.is_finite() => (1.0, ""),
        v if v >= 1e9 => (1e-9, "G"),
        v if v >= 1e6 => (1e-6, "M"),
        v if v >= 1e3 => (1e-3, "k"),
        _ => (1.0, ""),
    }
}

/// "2.124 MN/m": a value in its unit with the prefix of [`prefix`] and four significant digits below 1000.
pub fn with_prefix(value: f64, unit: &str) -> String {
    let (factor, letter) = prefix(value);
    let scaled = factor * value;
    let digits = scaled.abs().log10().floor();
    let decimals = if digits.is_finite() {
        (3.0 - digits).clamp(0.0, 9.0)
    } else {
        0.0
    };
    format!("{scaled:.*} {letter}{unit}", decimals as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_unit_is_found_as_written_and_listed_once() {
        for (index, (dimension, ..)) in DIMENSIONS.into_iter().enumerate() {
            assert_eq!(dimension as usize, index);
            let symbols: Vec<_> = dimension.allowed_units().collect();
            for (i, symbol) in symbols.iter().enumerate() {
                assert_eq!(
                    normalise(symbol),
                    *symbol,
                    "{dimension:?} {symbol} is out of reach"
                );
                assert!(
                    !symbols[..i].contains(symbol),
                    "{dimension:?} lists {symbol} twice"
                );
            }
        }
    }
}
