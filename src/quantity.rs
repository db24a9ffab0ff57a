//! Quantities with units, as text: "423 mm" becomes 0.423.
//!
//! Units exist only at the edge of the program, where people write numbers; inside, every value
//! is SI and `f64`. A quantity is read for a [`Dimension`], so "423 kg" is no length, and "g" is a
//! gram where a mass is wanted and 9.80665 m/s2 where an acceleration is.

/// Standard acceleration of free fall (m/s2), the "g" of accelerometers (exact by definition).
pub const STANDARD_GRAVITY: f64 = 9.80665;
/// One inch (m), exact by definition.
const INCH: f64 = 0.0254;
/// One avoirdupois pound (kg), exact by definition.
const POUND: f64 = 0.453_592_37;
/// One pound-force (N): a pound under standard gravity.
const POUND_FORCE: f64 = POUND * STANDARD_GRAVITY;
/// One degree of arc (rad).
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// What kind of quantity a text is read as.
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
    /// Rotational stiffness (N m/rad).
    RotationalStiffness,
    /// Cross-coupling stiffness (N/rad).
    CouplingStiffness,
    /// A pure ratio (1); "2 %" is 0.02.
    Ratio,
    /// Torque (N m).
    Torque,
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
}

/// A unit: SI value = `factor` times number plus `offset`.
struct Unit {
    symbol: &'static str,
    factor: f64,
    offset: f64,
}

/// A unit without an offset, as all are but temperatures.
const fn unit(symbol: &'static str, factor: f64) -> Unit {
    Unit {
        symbol,
        factor,
        offset: 0.0,
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
    Unit {
        symbol: "K",
        factor: 1.0,
        offset: -273.15,
    },
    Unit {
        symbol: "degF",
        factor: 5.0 / 9.0,
        offset: -160.0 / 9.0,
    },
    Unit {
        symbol: "F",
        factor: 5.0 / 9.0,
        offset: -160.0 / 9.0,
    },
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
const ACCELERATION_SENSITIVITY: &[Unit] = &[
    unit("V/(m/s2)", 1.0),
    unit("mV/g", 1e-3 / STANDARD_GRAVITY),
    unit("V/g", 1.0 / STANDARD_GRAVITY),
    unit("mV/(m/s2)", 1e-3),
    unit("mVs2/m", 1e-3),
    unit("Vs2/m", 1.0),
];
const VELOCITY_SENSITIVITY: &[Unit] = &[
    unit("V/(m/s)", 1.0),
    unit("mV/(m/s)", 1e-3),
    unit("mV/(mm/s)", 1.0),
    unit("V/(mm/s)", 1e3),
    unit("mVs/m", 1e-3),
    unit("Vs/m", 1.0),
];
const DISPLACEMENT_SENSITIVITY: &[Unit] = &[
    unit("V/m", 1.0),
    unit("V/mm", 1e3),
    unit("mV/mm", 1.0),
    unit("mV/um", 1e3),
    unit("V/um", 1e6),
];
const PRESSURE_SENSITIVITY: &[Unit] = &[unit("V/Pa", 1.0), unit("mV/Pa", 1e-3)];
const FORCE_SENSITIVITY: &[Unit] = &[
    unit("V/N", 1.0),
    unit("mV/N", 1e-3),
    unit("uV/N", 1e-6),
    unit("mV/lbf", 1e-3 / POUND_FORCE),
];

impl Dimension {
    /// Every dimension, in the order in which a stray unit is looked for.
    const ALL: [Self; 20] = [
        Self::Length,
        Self::Pressure,
        Self::Density,
        Self::Mass,
        Self::Force,
        Self::Frequency,
        Self::Rate,
        Self::TranslationalStiffness,
        Self::Torque,
        Self::RotationalStiffness,
        Self::CouplingStiffness,
        Self::Ratio,
        Self::Temperature,
        Self::Acceleration,
        Self::Velocity,
        Self::AccelerationSensitivity,
        Self::VelocitySensitivity,
        Self::DisplacementSensitivity,
        Self::PressureSensitivity,
        Self::ForceSensitivity,
    ];

    fn units(self) -> &'static [Unit] {
        match self {
            Self::Length => LENGTH,
            Self::Pressure => PRESSURE,
            Self::Density => DENSITY,
            Self::Mass => MASS,
            Self::Force => FORCE,
            Self::Frequency => FREQUENCY,
            Self::Rate => RATE,
            Self::TranslationalStiffness => TRANSLATIONAL_STIFFNESS,
            Self::RotationalStiffness => ROTATIONAL_STIFFNESS,
            Self::CouplingStiffness => COUPLING_STIFFNESS,
            Self::Ratio => RATIO,
            Self::Torque => TORQUE,
            Self::Temperature => TEMPERATURE,
            Self::Acceleration => ACCELERATION,
            Self::Velocity => VELOCITY,
            Self::AccelerationSensitivity => ACCELERATION_SENSITIVITY,
            Self::VelocitySensitivity => VELOCITY_SENSITIVITY,
            Self::DisplacementSensitivity => DISPLACEMENT_SENSITIVITY,
            Self::PressureSensitivity => PRESSURE_SENSITIVITY,
            Self::ForceSensitivity => FORCE_SENSITIVITY,
        }
    }

    /// The quantity in words, with its article: "a length".
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Length => "a length",
            Self::Pressure => "a pressure",
            Self::Density => "a density",
            Self::Mass => "a mass",
            Self::Force => "a force",
            Self::Frequency => "a frequency",
            Self::Rate => "a sample rate",
            Self::TranslationalStiffness => "a translational stiffness",
            Self::RotationalStiffness => "a rotational stiffness",
            Self::CouplingStiffness => "a coupling stiffness",
            Self::Ratio => "a ratio",
            Self::Torque => "a torque",
            Self::Temperature => "a temperature",
            Self::Acceleration => "an acceleration",
            Self::Velocity => "a velocity",
            Self::AccelerationSensitivity => "the sensitivity of an accelerometer",
            Self::VelocitySensitivity => "the sensitivity of a velocity sensor",
            Self::DisplacementSensitivity => "the sensitivity of a displacement sensor",
            Self::PressureSensitivity => "the sensitivity of a microphone",
            Self::ForceSensitivity => "the sensitivity of a force sensor",
        }
    }

    /// The SI unit as messages write it; empty for a ratio.
    pub fn si_unit(self) -> &'static str {
        match self {
            Self::Ratio => "",
            Self::RotationalStiffness => "N m/rad",
            Self::Torque => "N m",
            other => other.units().first().map_or("", |unit| unit.symbol),
        }
    }

    /// The symbols this dimension accepts, SI unit first (a ratio has none).
    pub fn allowed_units(self) -> impl Iterator<Item = &'static str> {
        self.units().iter().map(|unit| unit.symbol)
    }

    /// How many SI units one of `symbol` is, or `None` when it is no unit of this dimension or a
    /// temperature scale with another zero.
    pub fn factor(self, symbol: &str) -> Option<f64> {
        self.find(&normalise(symbol))
            .filter(|unit| unit.offset == 0.0)
            .map(|unit| unit.factor)
    }

    fn find(self, normalised: &str) -> Option<&'static Unit> {
        self.units().iter().find(|unit| unit.symbol == normalised)
    }

    fn of_unit(normalised: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|dimension| dimension.find(normalised).is_some())
    }
}

/// Why a text is not the quantity asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum QuantityError {
    /// It does not begin with a number.
    #[error("\"{text}\" does not begin with a number; {} is wanted, such as \"1.5 {}\"", expected.in_words(), example_unit(*expected))]
    NoNumber {
        /// The text.
        text: String,
        /// What was wanted.
        expected: Dimension,
    },
    /// A decimal comma.
    #[error("\"{text}\" has a decimal comma; write a point: \"{corrected}\"")]
    DecimalComma {
        /// The text.
        text: String,
        /// The same with a point.
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
        /// What the unit measures.
        found: Dimension,
        /// What was wanted.
        expected: Dimension,
    },
    /// Nobody knows this unit.
    #[error("\"{text}\" has the unknown unit \"{unit}\"; units allowed for {}: {}", expected.in_words(), unit_list(*expected))]
    UnknownUnit {
        /// The text.
        text: String,
        /// Its unit.
        unit: String,
        /// What was wanted.
        expected: Dimension,
    },
}

fn unit_list(dimension: Dimension) -> String {
    dimension.allowed_units().collect::<Vec<_>>().join(", ")
}

fn example_unit(dimension: Dimension) -> &'static str {
    dimension.units().first().map_or("", |unit| unit.symbol)
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
    } else {
        let unit = dimension
            .find(&symbol)
            .ok_or_else(|| wrong_unit(trimmed, unit, dimension))?;
        value * unit.factor + unit.offset
    };
    if si.is_finite() {
        Ok(si)
    } else {
        Err(QuantityError::TooLarge {
            text: trimmed.into(),
        })
    }
}

fn wrong_unit(text: &str, unit: &str, expected: Dimension) -> QuantityError {
    let text = text.into();
    match Dimension::of_unit(&normalise(unit)) {
        Some(found) => QuantityError::WrongDimension {
            text,
            found,
            expected,
        },
        None => QuantityError::UnknownUnit {
            text,
            unit: unit.trim().into(),
            expected,
        },
    }
}

/// Splits "-1.5e3 mm" into its number and what follows. An "e" belongs to the number only when
/// digits follow it. "inf" and "nan" are no numbers here.
fn split_number(text: &str) -> (&str, &str) {
    let bytes = text.as_bytes();
    let digits = |mut at: usize| {
        while bytes
            .get(at)
            .is_some_and(|b| b.is_ascii_digit() || *b == b'_')
        {
            at += 1;
        }
        at
    };
    let sign = |at: usize| at + usize::from(matches!(bytes.get(at), Some(b'+' | b'-')));
    let mut end = digits(sign(0));
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let exponent = sign(end + 1);
        if digits(exponent) > exponent {
            end = digits(exponent);
        }
    }
    // Only ASCII bytes were passed over, so `end` lies between characters.
    text.split_at_checked(end).unwrap_or((text, ""))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_unit_is_found_as_written_and_listed_once() {
        for dimension in Dimension::ALL {
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
