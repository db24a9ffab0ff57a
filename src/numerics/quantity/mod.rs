//! Quantities with units, as text: "423 mm" becomes 0.423.
//!
//! Units exist only at the edge of the program, where people write numbers; inside, every value
//! is SI and `f64`. A quantity is read for a [`Dimension`], so "423 kg" is no length, and "g" is a
//! gram where a mass is wanted and 9.80665 m/s2 where an acceleration is.

mod units;

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

    /// Returns the quantity in words, with its article: "a length".
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

    /// Returns the SI unit as messages write it; empty for a ratio.
    pub fn si_unit(self) -> &'static str {
        match self {
            Self::Ratio => "",
            Self::RotationalStiffness => "N m/rad",
            Self::Torque => "N m",
            other => units::units_of(other)
                .first()
                .map_or("", |unit| unit.symbol),
        }
    }

    /// Returns the symbols this dimension accepts, SI unit first (a ratio has none).
    pub fn allowed_units(self) -> impl Iterator<Item = &'static str> {
        units::units_of(self).iter().map(|unit| unit.symbol)
    }

    /// Returns how many SI units one of `symbol` is, or `None` when it is no unit of this dimension or a
    /// temperature scale with another zero.
    pub fn factor(self, symbol: &str) -> Option<f64> {
        self.find(&normalise(symbol))
            .filter(|unit| unit.offset == 0.0)
            .map(|unit| unit.factor)
    }

    fn find(self, normalised: &str) -> Option<&'static units::Unit> {
        units::units_of(self)
            .iter()
            .find(|unit| unit.symbol == normalised)
    }
}

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
    } else {
        let Some(known) = dimension.find(&symbol) else {
            let mut others = Dimension::ALL.into_iter();
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
        value * known.factor + known.offset
    };
    if si.is_finite() {
        Ok(si)
    } else {
        Err(QuantityError::TooLarge {
            text: trimmed.into(),
        })
    }
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
