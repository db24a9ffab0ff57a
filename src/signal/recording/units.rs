//! Units of channels and of frequency response functions, as recorders and analysers write them.

use std::f64::consts::TAU;

use num_complex::Complex64;
use tapjoint_numerics::quantity::STANDARD_GRAVITY;

/// Spellings of units, their factors to SI, and the SI units. Case counts: mN is a thousandth of a newton, MN a
/// million.
const UNITS: &[(&str, f64, &str)] = &[
    ("N", 1.0, "N"),
    ("mN", 1e-3, "N"),
    ("kN", 1e3, "N"),
    ("MN", 1e6, "N"),
    ("newton", 1.0, "N"),
    // Pound-force: 0.45359237 kg times standard gravity.
    ("lbf", 4.448_221_615_260_5, "N"),
    ("V", 1.0, "V"),
    ("mV", 1e-3, "V"),
    ("uV", 1e-6, "V"),
    ("kV", 1e3, "V"),
    ("volt", 1.0, "V"),
    ("volts", 1.0, "V"),
    ("m/s2", 1.0, "m/s2"),
    ("mm/s2", 1e-3, "m/s2"),
    ("um/s2", 1e-6, "m/s2"),
    ("m/s/s", 1.0, "m/s2"),
    ("ms-2", 1.0, "m/s2"),
    ("m/(s2)", 1.0, "m/s2"),
    ("g", STANDARD_GRAVITY, "m/s2"),
    ("gn", STANDARD_GRAVITY, "m/s2"),
    ("mg", 1e-3 * STANDARD_GRAVITY, "m/s2"),
    ("m/s", 1.0, "m/s"),
    ("mm/s", 1e-3, "m/s"),
    ("um/s", 1e-6, "m/s"),
    ("ms-1", 1.0, "m/s"),
    ("m", 1.0, "m"),
    ("cm", 1e-2, "m"),
    ("mm", 1e-3, "m"),
    ("um", 1e-6, "m"),
    ("nm", 1e-9, "m"),
    ("Pa", 1.0, "Pa"),
    ("mPa", 1e-3, "Pa"),
    ("uPa", 1e-6, "Pa"),
    ("hPa", 1e2, "Pa"),
    ("kPa", 1e3, "Pa"),
    ("s", 1.0, "s"),
    ("sec", 1.0, "s"),
    ("seconds", 1.0, "s"),
    ("ms", 1e-3, "s"),
    ("us", 1e-6, "s"),
    ("ns", 1e-9, "s"),
    ("min", 60.0, "s"),
    ("h", 3600.0, "s"),
    ("1", 1.0, "1"),
    ("-", 1.0, "1"),
];

/// Units of a time column and what they are in seconds: words of descriptions and options.
pub const TIME_UNITS: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];

/// Factor to SI and the SI unit's name of a channel's unit, `None` for an unknown one.
///
/// Case counts. Micro may be written u or as either micro sign, powers with or without a caret,
/// as superscript or after `**`; blanks and multiplication dots do not count. "g" is an
/// acceleration here (9.80665 m/s2): channels carry signals, and no signal is a mass.
///
/// ```
/// use tapjoint_signal::recording::channel_unit;
/// assert_eq!(channel_unit("mm/s^2"), Some((1e-3, "m/s2")));
/// assert_eq!(channel_unit("furlong"), None);
/// ```
pub fn channel_unit(text: &str) -> Option<(f64, &'static str)> {
    let mut plain = String::with_capacity(text.len());
    for character in text.trim().chars() {
        match character {
            '\u{b2}' => plain.push('2'),
            '\u{b5}' | '\u{3bc}' => plain.push('u'),
            '\u{2212}' | '\u{207b}' => plain.push('-'),
            '\u{b9}' => plain.push('1'),
            '^' | '*' | '\u{b7}' | ' ' | '\u{a0}' => {}
            other => plain.push(other),
        }
    }
    let unit = UNITS.iter().find(|(spelling, ..)| *spelling == plain);
    unit.map(|(_, factor, si)| (*factor, *si))
}

/// Returns factor to SI and SI unit of a label, which may stand in brackets.
pub(super) fn label_unit(label: &str) -> Option<(f64, &'static str)> {
    let label = label.trim();
    let inner = [('(', ')'), ('[', ']')]
        .into_iter()
        .find_map(|(open, close)| label.strip_prefix(open)?.strip_suffix(close));
    channel_unit(label).or_else(|| channel_unit(inner?))
}

/// Splits a header cell such as "force (N)" into its name and the text in the closing brackets.
pub(super) fn split_unit(cell: &str) -> (&str, Option<&str>) {
    let cell = cell.trim();
    for (open, close) in [('(', ')'), ('[', ']')] {
        let Some(inner) = cell.strip_suffix(close) else {
            continue;
        };
        // The bracket that the closing one closes: others may stand within.
        let mut depth = 1_usize;
        for (at, character) in inner.char_indices().rev() {
            depth += usize::from(character == close);
            depth -= usize::from(character == open);
            if depth == 0 {
                return (inner[..at].trim(), Some(inner[at + 1..].trim()));
            }
        }
    }
    (cell, None)
}

/// Form of a frequency response function: what is measured per force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResponseForm {
    /// Acceleration per force, (m/s2)/N.
    Accelerance,
    /// Velocity per force, (m/s)/N.
    Mobility,
    /// Displacement per force, m/N.
    Receptance,
}

impl ResponseForm {
    /// All forms.
    pub const ALL: [ResponseForm; 3] = [
        ResponseForm::Accelerance,
        ResponseForm::Mobility,
        ResponseForm::Receptance,
    ];

    /// Name, unit, unit of the response alone, and number of times that displacement was differentiated in time.
    fn facts(self) -> (&'static str, &'static str, &'static str, i32) {
        match self {
            ResponseForm::Accelerance => ("accelerance", "(m/s2)/N", "m/s2", 2),
            ResponseForm::Mobility => ("mobility", "(m/s)/N", "m/s", 1),
            ResponseForm::Receptance => ("receptance", "m/N", "m", 0),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.facts().0
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        self.facts().1
    }

    /// Unit of the response alone.
    pub fn response_unit(self) -> &'static str {
        self.facts().2
    }

    /// Number of times that displacement was differentiated in time.
    pub fn derivatives(self) -> i32 {
        self.facts().3
    }

    /// A value of this form at `frequency` (Hz) as a value of another form.
    ///
    /// At 0 Hz there is nothing to integrate from: an acceleration says nothing about where the
    /// structure rests, so that the result does not exist (`None`); derivatives are 0 there.
    pub fn convert(self, to: ResponseForm, value: Complex64, frequency: f64) -> Option<Complex64> {
        let order = to.derivatives() - self.derivatives();
        if order < 0 && frequency == 0.0 {
            return None;
        }
        // In the convention e^{+j omega t}, d/dt is a factor j omega.
        let j_omega = Complex64::new(0.0, TAU * frequency);
        Some(value * j_omega.powi(order))
    }
}

/// Ways to write a quotient of motion and force in one piece, blanks, carets and multiplication
/// marks left out.
const WHOLE: [(&str, ResponseForm); 9] = [
    ("1/kg", ResponseForm::Accelerance),
    ("kg-1", ResponseForm::Accelerance),
    ("m/Ns2", ResponseForm::Accelerance),
    ("m/(Ns2)", ResponseForm::Accelerance),
    ("m/N/s2", ResponseForm::Accelerance),
    ("m/Ns", ResponseForm::Mobility),
    ("m/(Ns)", ResponseForm::Mobility),
    ("m/N/s", ResponseForm::Mobility),
    ("s/kg", ResponseForm::Mobility),
];

/// Factor to SI and form of a unit such as "(m/s2)/N", "g/N", "(1/N)*(m/s2)" or "(m/s2)(N)", which
/// analysers write for the quotient of the two; `None` for anything else.
pub(super) fn response_unit(text: &str) -> Option<(f64, ResponseForm)> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let plain: String = text
        .chars()
        .filter(|c| !matches!(c, '^' | '*' | '\u{b7}'))
        .map(|c| if c == '\u{b2}' { '2' } else { c })
        .collect();
    if let Some((_, form)) = WHOLE.iter().find(|(whole, _)| *whole == plain) {
        return Some((1.0, *form));
    }
    // Characters outside of brackets.
    let mut outside = Vec::new();
    let mut depth = 0_i32;
    for (place, character) in text.char_indices() {
        match character {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ if depth == 0 => outside.push((place, character)),
            _ => {}
        }
    }
    let product = outside.iter().rfind(|(_, c)| "*\u{b7}".contains(*c));
    let (motion, force) = if let Some((place, mark)) = product {
        // "(1/N)*(m/s2)": a product with a reciprocal, in either order.
        let (first, second) = (&text[..*place], &text[place + mark.len_utf8()..]);
        match (reciprocal(first), reciprocal(second)) {
            (Some(force), None) => (second, force),
            (None, Some(force)) => (first, force),
            _ => return None,
        }
    } else if let Some((place, _)) = outside.iter().rfind(|(_, c)| *c == '/') {
        (&text[..*place], &text[place + 1..])
    } else {
        // "(m/s2)(N)": two brackets side by side.
        let place = text.find(")(")?;
        (&text[..=place], &text[place + 1..])
    };
    quotient(motion, force)
}

/// Factor and form of a motion over a force, each with a unit of its own.
pub(super) fn quotient(motion: &str, force: &str) -> Option<(f64, ResponseForm)> {
    let (motion, motion_si) = label_unit(motion)?;
    let (force, force_si) = label_unit(force)?;
    let mut forms = ResponseForm::ALL.into_iter();
    let form = forms.find(|form| form.response_unit() == motion_si && force_si == "N")?;
    Some((motion / force, form))
}

/// Returns the "N" of "1/N" or "(1/N)".
fn reciprocal(text: &str) -> Option<&str> {
    let inner = text.strip_prefix('(').and_then(|t| t.strip_suffix(')'));
    inner.unwrap_or(text).strip_prefix("1/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_units_as_analysers_write_them() {
        use ResponseForm::{Accelerance, Mobility, Receptance};
        let cases = [
            ("(m/s2)/N", 1.0, Accelerance),
            ("m/s^2/N", 1.0, Accelerance),
            ("(1/N)*(m/s\u{b2})", 1.0, Accelerance),
            ("(m/s\u{b2})*(1/kN)", 1e-3, Accelerance),
            ("(m/s\u{b2})(N)", 1.0, Accelerance),
            ("g/N", 9.806_65, Accelerance),
            ("[mm/s]/[mN]", 1.0, Mobility),
            ("m/s/N", 1.0, Mobility),
            ("um/kN", 1e-9, Receptance),
            ("1/kg", 1.0, Accelerance),
            ("m / (N s^2)", 1.0, Accelerance),
        ];
        for (text, factor, form) in cases {
            let (found, found_form) = response_unit(text).unwrap_or_else(|| panic!("{text}"));
            // Products and quotients of exact factors.
            assert!((found / factor - 1.0).abs() < 1e-14, "{text}: {found}");
            assert_eq!(found_form, form, "{text}");
        }
        for text in ["", "N", "m/s2", "N/m", "Pa/N", "V/V", "m/s)/N(", "*", "/"] {
            assert_eq!(response_unit(text), None, "{text}");
        }
    }
}
