//! Tables of the joint: parameters, the pair regression.

use super::super::document::{Document, EstimateSection, Method, ValueSection};
use super::super::format::{
    MISSING, RIGID, Rounded, capital, last_place, optional, or_missing, prefix, rounded_to,
    signed_percent, significant, unit_words,
};
use super::uncertainty::stiffness;
use super::{Table, number, words};

/// Most significant digits of an estimate.
const MOST_DIGITS: i32 = 5;

/// One estimated quantity.
pub struct Parameter<'a> {
    /// Name in data files: "kt".
    pub name: &'static str,
    /// "Kt".
    pub symbol: &'static str,
    /// In words.
    pub meaning: &'static str,
    /// SI unit; "1" for a number.
    pub unit: &'static str,
    /// The value.
    pub value: &'a ValueSection,
}

/// Returns the estimated quantities, those with SI units first.
pub fn estimated(estimate: &EstimateSection) -> Vec<Parameter<'_>> {
    let all = [
        ("kt", "Kt", "translational stiffness", "N/m", &estimate.kt),
        ("kr", "Kr", "rotational stiffness", "N m/rad", &estimate.kr),
        ("ktr", "Ktr", "cross stiffness", "N/rad", &estimate.ktr),
        ("kx", "Kx", "Kt L\u{b3}/(EI)", "1", &estimate.kx),
        ("ky", "Ky", "Kr L/(EI)", "1", &estimate.ky),
        ("kz", "Kz", "Ktr L\u{b2}/(EI)", "1", &estimate.kz),
        (
            "coupling",
            "coupling",
            "\u{221a}(Kx Ky)/Kz",
            "1",
            &estimate.coupling,
        ),
        ("modulus", "E", "Young's modulus", "Pa", &estimate.modulus),
        ("density", "\u{3c1}", "density", "kg/m3", &estimate.density),
    ];
    let all = all.into_iter();
    all.filter_map(|(name, symbol, meaning, unit, value)| {
        Some(Parameter {
            name,
            symbol,
            meaning,
            unit,
            value: value.as_ref()?,
        })
    })
    .collect()
}

impl Parameter<'_> {
    /// Value, standard deviation, lower and upper limit and their common unit, in words.
    pub fn written(&self) -> [String; 5] {
        let (factor, letter) = self.scale();
        let value = factor * self.value.value;
        let std = self.value.std.map(|std| factor * std);
        let ends = self.value.low.zip(self.value.high);
        let spread = ends.map(|(low, high)| factor * (high - low) / 4.0);
        let finest = self.finest_place(value);
        let [low, high] = [self.value.low, self.value.high].map(|limit| {
            or_missing(limit.map(|limit| rounded_to(factor * limit, std.or(spread), finest).value))
        });
        let shown = if value.is_infinite() {
            RIGID.to_owned()
        } else {
            rounded_to(value, std.or(spread), finest).value
        };
        let std = std.and_then(|std| rounded_to(value, Some(std), finest).uncertainty);
        let unit = format!("{letter}{}", unit_words(self.unit));
        [shown, or_missing(std), low, high, unit]
    }

    /// Standard deviation scaled by the misfit, in the unit of the value.
    pub fn written_scaled(&self) -> String {
        let scaled = self.value.std_scaled;
        let scaled = scaled.filter(|std| std.is_finite() && *std > 0.0);
        or_missing(scaled.and_then(|_| self.written_together().uncertainty))
    }

    /// Value and standard deviation, the scaled one where there are two, rounded together.
    pub fn written_together(&self) -> Rounded {
        let (factor, _) = self.scale();
        let value = factor * self.value.value;
        let std = self.value.std_scaled.or(self.value.std);
        rounded_to(value, std.map(|std| factor * std), self.finest_place(value))
    }

    /// The 95 % limits scaled by the misfit, in the unit of the value; `None` where there are none.
    pub fn written_scaled_limits(&self) -> Option<[String; 2]> {
        let (factor, _) = self.scale();
        let value = factor * self.value.value;
        let (low, high) = self.value.low_scaled.zip(self.value.high_scaled)?;
        let std = self.value.std_scaled.map(|std| factor * std);
        // Ends farther apart than the value is large share no digit: each has its own two.
        let wide = factor * (high - low) > value.abs();
        Some([low, high].map(|limit| match wide {
            true => significant(factor * limit, 2),
            false => rounded_to(factor * limit, std, self.finest_place(value)).value,
        }))
    }

    /// Place of the last digit that is shown: no stiffness is known to more than five digits.
    fn finest_place(&self, value: f64) -> i32 {
        if value.is_finite() {
            last_place(value, MOST_DIGITS)
        } else {
            i32::MIN
        }
    }

    /// Factor and prefix that suit the value; numbers without unit stay as they are.
    fn scale(&self) -> (f64, &'static str) {
        match self.unit {
            "N/m" | "N m/rad" | "N/rad" | "Pa" => prefix(self.value.value),
            _ => (1.0, ""),
        }
    }
}

/// The estimate's parameters; `None` without an estimate.
pub fn parameters(document: &Document) -> Option<Table> {
    let estimate = document.estimate.as_ref()?.as_ref()?;
    let list = estimated(estimate);
    let misses = list.iter().any(|p| p.value.std_scaled.is_some());
    let stated = !misses || list.iter().any(|p| p.value.std.is_some());
    let mut rows = Vec::new();
    for parameter in &list {
        let [value, std, mut low, mut high, unit] = parameter.written();
        let name = parameter.symbol.to_owned();
        let meaning = parameter.meaning.to_owned();
        let scaled = parameter.written_scaled();
        let limits = parameter.written_scaled_limits();
        let [from, to] = limits.unwrap_or_else(|| [MISSING.to_owned(), MISSING.to_owned()]);
        // Without any uncertainty of the frequencies these are the limits that there are.
        if !stated {
            (low, high) = (from.clone(), to.clone());
        }
        rows.push(vec![
            name, meaning, value, unit, std, scaled, low, high, from, to,
        ]);
    }
    let modes: Vec<String> = estimate.modes_used.iter().map(usize::to_string).collect();
    let scaled_note = match (misses, stated) {
        (false, _) => "",
        (true, true) => {
            " Std and limits stand for the frequencies' uncertainty alone; the model misses the \
             frequencies by more than their uncertainty, and the scaled std takes the misfit for it, and so do the \
             scaled 95 % limits, by Student's distribution."
        }
        (true, false) => {
            " Not every frequency has an uncertainty, so that all weigh alike: the scaled std takes the \
             misfit for it, and so do the 95 % limits, by Student's distribution."
        }
    };
    let table = Table {
        caption: format!("Estimated parameters, method: {}", estimate.method.name()),
        columns: vec![
            words("Parameter"),
            words("Meaning").on_page_if(misses),
            number("Value"),
            words("Unit"),
            number("Std"),
            number("Scaled std"),
            number("95 % low"),
            number("95 % high"),
            number("Scaled low").on_page(),
            number("Scaled high").on_page(),
        ],
        rows,
        note: format!(
            "From modes {}. Std and limits are in the value's unit; \u{2013} means unknown or \
             unbounded.{scaled_note}",
            modes.join(", "),
        ),
    };
    Some(match (misses, stated) {
        (false, _) => table.without_columns(&["Scaled std", "Scaled low", "Scaled high"]),
        (true, false) => table.without_columns(&["Scaled low", "Scaled high"]),
        (true, true) => table,
    })
}

/// Correlations of the estimates; `None` where fewer than two parameters were estimated.
pub fn correlations(document: &Document) -> Option<Table> {
    let estimate = document.estimate.as_ref()?.as_ref()?;
    let rows: Vec<Vec<String>> = estimate
        .correlations
        .iter()
        .map(|found| {
            let pair = format!("{} and {}", symbol(found.first), symbol(found.second));
            // Near 1 the distance from 1 is what counts: two digits of it.
            let digits = if found.value.abs() > 0.99 { 4 } else { 2 };
            vec![pair, significant(found.value, digits)]
        })
        .collect();
    (!rows.is_empty()).then(|| Table {
        caption: "Correlations".to_owned(),
        columns: vec![words("Parameters"), number("Correlation (1)")],
        rows,
        note: "Near 1 or \u{2212}1 the frequencies tell a combination of the two rather than each; of the \
               logarithms of the values."
            .to_owned(),
    })
}

/// The symbol of a parameter.
fn symbol(parameter: tapjoint_identify::consistent::Parameter) -> &'static str {
    use tapjoint_identify::consistent::Parameter as Fitted;
    match parameter {
        Fitted::Kt => "Kt",
        Fitted::Kr => "Kr",
        Fitted::Modulus => "E",
        Fitted::Density => "\u{3c1}",
        other => other.name(),
    }
}

/// The consistent estimate beside the pair regression; `None` where there is only one of them.
pub fn methods(document: &Document) -> Option<Table> {
    let estimate = document.estimate.as_ref()?.as_ref()?;
    let pairs = estimate
        .pairs
        .as_ref()
        .filter(|_| estimate.method != Method::Pairs)?;
    let mut rows = Vec::new();
    for (name, own, pairs) in [
        ("Kx", &estimate.kx, pairs.kx),
        ("Ky", &estimate.ky, pairs.ky),
        ("Kz", &estimate.kz, pairs.kz),
    ] {
        let own = own.as_ref().map(|value| value.value);
        if own.is_none() && pairs.is_none() {
            continue;
        }
        let change = own.zip(pairs);
        let change = change.map(|(own, pairs)| 100.0 * (pairs - own) / own);
        rows.push(vec![
            name.to_owned(),
            stiffness(own),
            optional(pairs, 5),
            signed_percent(change),
        ]);
    }
    Some(Table {
        caption: "Methods side by side".to_owned(),
        columns: vec![
            words("Parameter (1)"),
            number("Consistent"),
            number("Pairs"),
            number("Pairs differ (%)"),
        ],
        rows,
        note:
            "The consistent estimate satisfies its own frequency equation, and takes shear, sensor \
               masses and known stiffnesses into account where they are described; the pair regression \
               does none of this."
                .to_owned(),
    })
}

/// The pair regression's values; `None` where it was not done.
pub fn pairs(document: &Document) -> Option<Table> {
    let pairs = document.estimate.as_ref()?.as_ref()?.pairs.as_ref()?;
    let mut rows = Vec::new();
    for (name, value) in [("Kx", pairs.kx), ("Ky", pairs.ky), ("Kz", pairs.kz)] {
        if value.is_some() {
            rows.push(vec![name.to_owned(), optional(value, 5), "1".to_owned()]);
        }
    }
    if let Some(closure) = pairs.closure {
        let percent = signed_percent(Some(100.0 * closure));
        rows.push(vec!["closure".to_owned(), percent, "%".to_owned()]);
    }
    let mut note =
        "Closure: the product of stiffnesses that the regression implies against the product \
                    of its own estimates; far from 0 the model does not fit."
            .to_owned();
    for warning in document.warnings_beside() {
        note.push_str(&format!(" {}.", capital(&warning.text)));
    }
    Some(Table {
        caption: "Pair regression".to_owned(),
        columns: vec![words("Quantity"), number("Value"), words("Unit")],
        rows,
        note,
    })
}
