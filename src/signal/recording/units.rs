//! Units of channels, as recorders write them into headers.

/// Standard acceleration of free fall (m/s2), by definition: what "g" means for an acceleration.
pub const STANDARD_GRAVITY: f64 = 9.806_65;

/// One kind of quantity: its SI unit and the spellings that lead to it.
struct Quantity {
    si: &'static str,
    spellings: &'static [(&'static str, f64)],
}

/// Case counts: mN is a thousandth of a newton, MN a million.
const QUANTITIES: &[Quantity] = &[
    Quantity {
        si: "N",
        spellings: &[
            ("N", 1.0),
            ("mN", 1e-3),
            ("kN", 1e3),
            ("MN", 1e6),
            ("newton", 1.0),
            // Pound-force: 0.45359237 kg times standard gravity.
            ("lbf", 4.448_221_615_260_5),
        ],
    },
    Quantity {
        si: "V",
        spellings: &[
            ("V", 1.0),
            ("mV", 1e-3),
            ("uV", 1e-6),
            ("kV", 1e3),
            ("volt", 1.0),
            ("volts", 1.0),
        ],
    },
    Quantity {
        si: "m/s2",
        spellings: &[
            ("m/s2", 1.0),
            ("mm/s2", 1e-3),
            ("um/s2", 1e-6),
            ("m/s/s", 1.0),
            ("ms-2", 1.0),
            ("m/(s2)", 1.0),
            ("g", STANDARD_GRAVITY),
            ("gn", STANDARD_GRAVITY),
            ("mg", 1e-3 * STANDARD_GRAVITY),
        ],
    },
    Quantity {
        si: "m/s",
        spellings: &[("m/s", 1.0), ("mm/s", 1e-3), ("um/s", 1e-6), ("ms-1", 1.0)],
    },
    Quantity {
        si: "m",
        spellings: &[
            ("m", 1.0),
            ("cm", 1e-2),
            ("mm", 1e-3),
            ("um", 1e-6),
            ("nm", 1e-9),
        ],
    },
    Quantity {
        si: "Pa",
        spellings: &[
            ("Pa", 1.0),
            ("mPa", 1e-3),
            ("uPa", 1e-6),
            ("hPa", 1e2),
            ("kPa", 1e3),
        ],
    },
    Quantity {
        si: "s",
        spellings: &[
            ("s", 1.0),
            ("sec", 1.0),
            ("seconds", 1.0),
            ("ms", 1e-3),
            ("us", 1e-6),
            ("ns", 1e-9),
            ("min", 60.0),
            ("h", 3600.0),
        ],
    },
    Quantity {
        si: "1",
        spellings: &[("1", 1.0), ("-", 1.0)],
    },
];

/// Factor to SI and the SI unit's name of a channel's unit, `None` for an unknown one.
///
/// Case counts. Micro may be written u or as either micro sign, powers with or without a caret,
/// as superscript or after `**`; blanks and multiplication dots do not count. "g" is an
/// acceleration here (9.80665 m/s2): channels carry signals, and no signal is a mass.
///
/// ```
/// use tapjoint::recording::channel_unit;
/// assert_eq!(channel_unit("mm/s^2"), Some((1e-3, "m/s2")));
/// assert_eq!(channel_unit("furlong"), None);
/// ```
pub fn channel_unit(text: &str) -> Option<(f64, &'static str)> {
    let plain = plain_spelling(text);
    QUANTITIES.iter().find_map(|quantity| {
        let spelling = quantity.spellings.iter().find(|(name, _)| *name == plain);
        spelling.map(|(_, factor)| (*factor, quantity.si))
    })
}

/// One spelling for the many ways to type a power, a micro sign or a product.
fn plain_spelling(text: &str) -> String {
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
    plain
}

/// Splits a header cell such as "force (N)" into its name and the text in the closing brackets.
pub(super) fn split_unit(cell: &str) -> (&str, Option<&str>) {
    let cell = cell.trim();
    for (open, close) in [('(', ')'), ('[', ']')] {
        let Some(inner) = cell.strip_suffix(close) else {
            continue;
        };
        let Some(at) = matching_bracket(inner, open, close) else {
            continue;
        };
        let (name, unit) = inner.split_at(at);
        return (name.trim(), unit.get(1..).map(str::trim));
    }
    (cell, None)
}

/// Where the bracket opens that a closing one after `inner` would close.
fn matching_bracket(inner: &str, open: char, close: char) -> Option<usize> {
    let mut depth = 0_usize;
    for (at, character) in inner.char_indices().rev() {
        if character == close {
            depth += 1;
        } else if character == open {
            if depth == 0 {
                return Some(at);
            }
            depth -= 1;
        }
    }
    None
}
