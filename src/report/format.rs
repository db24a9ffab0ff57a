//! Numbers as readers want them: the digits follow the uncertainty.

pub use tapjoint_numerics::quantity::prefix;

/// Shown where a value does not exist.
pub const MISSING: &str = "\u{2013}";
/// Shown for a stiffness without bound.
pub const RIGID: &str = "\u{221e} (rigid)";
/// Digits of a value whose uncertainty is unknown.
const DIGITS: i32 = 4;
/// Largest magnitude written without a power of ten.
const PLAIN_LARGEST: f64 = 1e7;
/// Smallest step of the last digit written without a power of ten.
const PLAIN_SMALLEST: f64 = 1e-7;

/// A value and its uncertainty, rounded to the same digit.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounded {
    /// The value.
    pub value: String,
    /// The uncertainty with two significant digits; `None` where unknown.
    pub uncertainty: Option<String>,
}

impl Rounded {
    /// "17.0030 ± 0.0041", or the value alone.
    pub fn joined(&self) -> String {
        match &self.uncertainty {
            Some(uncertainty) => format!("{} \u{b1} {uncertainty}", self.value),
            None => self.value.clone(),
        }
    }
}

/// Rounds `value` to the second significant digit of `uncertainty` (same unit).
///
/// An uncertainty that is unknown, zero or not finite leaves four significant digits of the value.
pub fn rounded(value: f64, uncertainty: Option<f64>) -> Rounded {
    let known = uncertainty.filter(|u| u.is_finite() && *u > 0.0);
    match known {
        Some(uncertainty) if value.is_finite() => {
            let place = last_place(uncertainty, 2);
            let (value, uncertainty) = at_place_together(value, uncertainty, place);
            Rounded {
                value,
                uncertainty: Some(uncertainty),
            }
        }
        _ => Rounded {
            value: significant(value, DIGITS),
            uncertainty: None,
        },
    }
}

/// Like [`rounded`], but nothing finer than the digit 10^`finest`: more digits than a reader can
/// use hide the ones that count.
///
/// An uncertainty that would need finer digits is rounded up, so that it stays a bound.
pub fn rounded_to(value: f64, uncertainty: Option<f64>, finest: i32) -> Rounded {
    let known = uncertainty.filter(|u| u.is_finite() && *u > 0.0);
    match known {
        Some(uncertainty) if value.is_finite() && last_place(uncertainty, 2) < finest => {
            let step = 10f64.powi(finest);
            // A hair less than the quotient, so that 0.0003 does not become 0.0004 by rounding.
            let up = (uncertainty / step * (1.0 - 1e-12)).ceil() * step;
            let (value, uncertainty) = at_place_together(value, up, finest);
            Rounded {
                value,
                uncertainty: Some(uncertainty),
            }
        }
        _ => rounded(value, uncertainty),
    }
}

/// [`rounded_to`] with at most `digits` significant digits of the value.
pub fn rounded_digits(value: f64, uncertainty: Option<f64>, digits: i32) -> Rounded {
    let finest = if value == 0.0 || !value.is_finite() {
        i32::MIN
    } else {
        last_place(value, digits)
    };
    rounded_to(value, uncertainty, finest)
}

/// A frequency and its bound (Hz): at most four decimals, seven where the spectral lines (`half_line`
/// their half distance, Hz) lie closer than 0.001 Hz.
pub fn frequency_reading(frequency: f64, bound: f64, half_line: Option<f64>) -> Rounded {
    let fine = half_line.is_some_and(|half| 2.0 * half < 0.001);
    rounded_to(frequency, Some(bound), if fine { -7 } else { -4 })
}

/// A bound in percent with its sign and at most three decimals: "±0.11".
pub fn bound_percent(percent: f64) -> String {
    let written = rounded_to(0.0, Some(percent), -3).uncertainty;
    written.map_or_else(|| MISSING.to_owned(), |bound| format!("\u{b1}{bound}"))
}

/// A probability in percent to a tenth; one that would read as certain or impossible is written as a bound.
pub fn probability(value: f64) -> String {
    if value >= 0.9995 {
        ">99.9 %".to_owned()
    } else if value < 0.0005 {
        "<0.1 %".to_owned()
    } else {
        format!("{:.1} %", 100.0 * value)
    }
}

/// A value with the given number of significant digits; "–" for NaN, "∞" beyond all bounds.
pub fn significant(value: f64, digits: i32) -> String {
    if value.is_nan() {
        return MISSING.to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 {
            "\u{221e}"
        } else {
            "\u{2212}\u{221e}"
        }
        .to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    at_place(value, last_place(value, digits))
}

/// An exact setting such as a rate or a line spacing: at most `digits` significant digits, without
/// zeros at the end.
pub fn trimmed(value: f64, digits: i32) -> String {
    let text = significant(value, digits);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Returns [`significant`] digits of a value that may not exist.
pub fn optional(value: Option<f64>, digits: i32) -> String {
    value.map_or_else(|| MISSING.to_owned(), |value| significant(value, digits))
}

/// A change that was set, with its sign: "+0.05".
pub fn signed(value: f64) -> String {
    let sign = if value > 0.0 { "+" } else { "" };
    format!("{sign}{}", trimmed(value, 4))
}

/// A percentage with its sign and two significant digits, at most three decimals: "+0.31", "−12".
pub fn signed_percent(percent: Option<f64>) -> String {
    let Some(percent) = percent.filter(|p| p.is_finite()) else {
        return MISSING.to_owned();
    };
    let place = last_place(percent, 2).clamp(-3, 0);
    let text = at_place(percent.abs(), place);
    let zero = text.chars().all(|c| matches!(c, '0' | '.'));
    match (zero, percent < 0.0) {
        (true, _) => text,
        (false, true) => format!("\u{2212}{text}"),
        (false, false) => format!("+{text}"),
    }
}

/// Returns [`signed_percent`] for a sentence: a value that would read as zero is "below 0.001".
pub fn signed_or_below(percent: f64) -> String {
    if percent.abs() < 0.0005 {
        "below 0.001".to_owned()
    } else {
        signed_percent(Some(percent))
    }
}

/// A reading on a spectral line and its half-line bound (Hz).
///
/// Lines lie at exact fractions, 335.625 ± 0.625, which rounding to two digits would spoil: where
/// four decimals hold the bound exactly, the reading keeps them.
pub fn line_reading(line: f64, half_line: f64) -> Rounded {
    match exact_decimals(half_line, 1.0) {
        Some(decimals) if line.is_finite() && line.abs() < PLAIN_LARGEST => {
            // The line itself may need one decimal more than its bound.
            let needed = exact_decimals(line, f64::NEG_INFINITY).unwrap_or(0);
            let decimals = decimals.max(1).max(needed);
            Rounded {
                value: typographic(&format!("{line:.decimals$}")),
                uncertainty: Some(format!("{half_line:.decimals$}")),
            }
        }
        _ => rounded(line, Some(half_line)),
    }
}

/// A value with as many decimals as another number was written with.
pub fn with_decimals_of(value: f64, written: &str) -> String {
    if !value.is_finite() || value.abs() >= PLAIN_LARGEST || written.contains('e') {
        return significant(value, DIGITS);
    }
    let decimals = written.split_once('.').map_or(0, |(_, tail)| tail.len());
    typographic(&format!("{value:.decimals$}"))
}

/// Decimals, at most four, that hold a value exactly and leave it at least so many units of the last; `None` where
/// four do not suffice.
fn exact_decimals(value: f64, least: f64) -> Option<usize> {
    (0..=4).find(|decimals| {
        let scaled = value * 10f64.powi(*decimals as i32);
        (scaled - scaled.round()).abs() < 1e-6 && scaled.round() >= least
    })
}

/// A unit as print has it: "m/s²" for "m/s2".
pub fn unit_words(unit: &str) -> String {
    unit.replace("m/s2", "m/s\u{b2}")
        .replace("kg/m3", "kg/m\u{b3}")
}

/// Power of ten of the last of `digits` significant digits, after rounding: 0.0996 with two digits
/// rounds to 0.10, so its last place is -2.
pub fn last_place(value: f64, digits: i32) -> i32 {
    if value == 0.0 || !value.is_finite() {
        return 0;
    }
    // The exponent of the number as it is printed, so that rounding up to the next decade counts.
    let printed = format!("{:.*e}", (digits - 1).max(0) as usize, value.abs());
    let exponent = printed
        .split_once('e')
        .and_then(|(_, exponent)| exponent.parse::<i32>().ok());
    exponent.unwrap_or(0) - digits + 1
}

/// A value rounded to the digit 10^place.
fn at_place(value: f64, place: i32) -> String {
    at_place_together(value, value, place).0
}

/// Two numbers rounded to the same digit and written in the same way.
fn at_place_together(value: f64, other: f64, place: i32) -> (String, String) {
    let largest = value.abs().max(other.abs());
    let step = 10f64.powi(place);
    let written = if largest >= PLAIN_LARGEST || step < PLAIN_SMALLEST {
        // The exponent is that of the rounded number: 9.9999e9 becomes 1.000e10, and 9.7e9 stays.
        let exponent = last_place((largest / step).round() * step, 12) + 11;
        let decimals = (exponent - place).max(0) as usize;
        [value, other].map(|number| {
            let mantissa = format!("{:.decimals$}", number / 10f64.powi(exponent));
            format!("{}e{exponent}", typographic(&mantissa))
        })
    } else {
        [value, other].map(|number| match place >= 0 {
            true => typographic(&format!("{:.0}", (number / step).round() * step)),
            false => typographic(&format!("{number:.*}", (-place) as usize)),
        })
    };
    written.into()
}

/// The hyphen of a negative number becomes a minus sign, and minus zero becomes zero.
fn typographic(number: &str) -> String {
    match number.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("\u{2212}{rest}"),
        None => number.to_owned(),
    }
}

/// A sentence in which every hyphen that begins a number is a minus sign.
pub fn with_minus_signs(text: &str) -> String {
    let mut before = ' ';
    let mut letters = text.chars().peekable();
    let mut written = String::with_capacity(text.len());
    while let Some(letter) = letters.next() {
        let begins = before.is_whitespace() || before == '(';
        let number = letters.peek().is_some_and(char::is_ascii_digit);
        let minus = letter == '-' && begins && number;
        written.push(if minus { '\u{2212}' } else { letter });
        before = letter;
    }
    written
}

/// A sentence that begins with a capital letter.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// Returns a value, or the sign for a missing one.
pub fn or_missing(value: Option<impl ToString>) -> String {
    value.map_or_else(|| MISSING.to_owned(), |value| value.to_string())
}
