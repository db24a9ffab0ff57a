//! Axes of a function: what they measure, and in which unit.

use crate::recording::units::channel_unit;

/// One axis of a function (records 8 to 11).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Axis {
    /// Specific data type: 8 displacement, 11 velocity, 12 acceleration, 13 excitation force, 15
    /// pressure, 17 time, 18 frequency, 0 unknown.
    pub quantity: u32,
    /// Exponents of length, force and temperature in the unit; meant for quantity 1 (general) only.
    pub exponents: [i32; 3],
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
pub(in crate::recording) const DISPLACEMENT: u32 = 8;
pub(in crate::recording) const REACTION_FORCE: u32 = 9;
pub(in crate::recording) const VELOCITY: u32 = 11;
pub(in crate::recording) const ACCELERATION: u32 = 12;
pub(in crate::recording) const EXCITATION_FORCE: u32 = 13;
pub(in crate::recording) const PRESSURE: u32 = 15;
pub(in crate::recording) const TIME: u32 = 17;

impl Axis {
    /// What the axis measures, in words; `None` where the file does not say.
    pub fn quantity_name(&self) -> Option<&'static str> {
        let known = QUANTITIES
            .iter()
            .find(|(number, _)| *number == self.quantity);
        known.map(|(_, name)| *name)
    }
}

/// The unit system of a file (dataset 164): file units divided by these are SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::recording) struct UnitSystem {
    pub length: f64,
    pub force: f64,
}

impl UnitSystem {
    /// From the second record's numbers; `None` where they cannot be factors.
    pub(in crate::recording) fn new(length: f64, force: f64) -> Option<Self> {
        let usable = |factor: f64| factor.is_finite() && (1e-12..1e12).contains(&factor);
        (usable(length) && usable(force)).then_some(Self { length, force })
    }

    /// Factor to SI and the SI unit of a quantity along a direction of translation; `None` for
    /// quantities that no sensor here measures.
    pub(in crate::recording) fn si(&self, quantity: u32) -> Option<(f64, &'static str)> {
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

/// How values of a channel become SI values.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::recording) struct ChannelUnit {
    /// What values are multiplied by.
    pub factor: f64,
    /// Unit after that; `None` where nothing says.
    pub unit: Option<String>,
    /// Whether the label has a unit that is not known.
    pub known: bool,
    /// Factor by the file's unit system where it contradicts the label's.
    pub contradiction: Option<f64>,
}

/// The unit of a channel: by its label, else by the file's unit system.
pub(in crate::recording) fn channel_si(
    axis: &Axis,
    system: Option<UnitSystem>,
    rotational: bool,
) -> ChannelUnit {
    // Rotations have other exponents, and no sensor here measures them.
    let by_system = match rotational {
        true => None,
        false => system.and_then(|system| system.si(axis.quantity)),
    };
    let Some(label) = &axis.unit else {
        return ChannelUnit {
            factor: by_system.map_or(1.0, |(factor, _)| factor),
            unit: by_system.map(|(_, unit)| unit.to_owned()),
            known: true,
            contradiction: None,
        };
    };
    let by_label = label_unit(label);
    // Beyond rounding of printed factors two factors are two units.
    let differs = |a: f64, b: f64| (a / b - 1.0).abs() > 1e-4;
    let contradiction = match (by_label, by_system) {
        (Some((label, _)), Some((system, _))) if differs(label, system) => Some(system),
        _ => None,
    };
    ChannelUnit {
        factor: by_label.map_or(1.0, |(factor, _)| factor),
        unit: Some(by_label.map_or_else(|| label.clone(), |(_, unit)| unit.to_owned())),
        known: by_label.is_some(),
        contradiction,
    }
}

/// Factor to SI and SI unit of a unit label, whose brackets mean nothing.
pub(in crate::recording) fn label_unit(label: &str) -> Option<(f64, &'static str)> {
    let label = label.trim();
    let inner = [('(', ')'), ('[', ']')]
        .into_iter()
        .find_map(|(open, close)| label.strip_prefix(open)?.strip_suffix(close));
    channel_unit(label).or_else(|| channel_unit(inner?))
}
