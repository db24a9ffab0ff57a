//! Units of frequency response functions: motion over force.

use super::ResponseForm;
use crate::recording::uff::label_unit;

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
    let (motion, force) = split_quotient(&text)?;
    quotient(motion, force)
}

/// Factor and form of a motion over a force, each with a unit of its own.
pub(super) fn quotient(motion: &str, force: &str) -> Option<(f64, ResponseForm)> {
    let (motion, motion_si) = label_unit(motion)?;
    let (force, force_si) = label_unit(force)?;
    let form = match (motion_si, force_si) {
        ("m/s2", "N") => ResponseForm::Accelerance,
        ("m/s", "N") => ResponseForm::Mobility,
        ("m", "N") => ResponseForm::Receptance,
        _ => return None,
    };
    Some((motion / force, form))
}

/// Numerator and denominator of a quotient.
fn split_quotient(text: &str) -> Option<(&str, &str)> {
    let outside = outside_brackets(text);
    let at = |wanted: &[char]| {
        let places = outside.iter().rev();
        places.copied().find(|(_, c)| wanted.contains(c))
    };
    // "(1/N)*(m/s2)": a product with a reciprocal, in either order.
    if let Some((place, mark)) = at(&['*', '\u{b7}']) {
        let (first, second) = (text.get(..place)?, text.get(place + mark.len_utf8()..)?);
        return match (reciprocal(first), reciprocal(second)) {
            (Some(force), None) => Some((second, force)),
            (None, Some(force)) => Some((first, force)),
            _ => None,
        };
    }
    if let Some((place, _)) = at(&['/']) {
        return Some((text.get(..place)?, text.get(place + 1..)?));
    }
    // "(m/s2)(N)": two brackets side by side.
    let place = text.find(")(")?;
    Some((text.get(..=place)?, text.get(place + 1..)?))
}

/// What "1/N" or "(1/N)" is the reciprocal of.
fn reciprocal(text: &str) -> Option<&str> {
    let inner = text.strip_prefix('(').and_then(|t| t.strip_suffix(')'));
    inner.unwrap_or(text).strip_prefix("1/")
}

/// Characters outside all brackets, with their places.
fn outside_brackets(text: &str) -> Vec<(usize, char)> {
    let mut depth = 0_i32;
    let mut outside = Vec::new();
    for (place, character) in text.char_indices() {
        match character {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ if depth == 0 => outside.push((place, character)),
            _ => {}
        }
    }
    outside
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
