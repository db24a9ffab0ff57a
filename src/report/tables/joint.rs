//! Tables of the joint: parameters, the pair regression.

use super::super::document::{Document, EstimateSection, Method, ValueSection};
use super::super::format::{
    MISSING, RIGID, Rounded, capital, last_place, optional, or_missing, prefix, rounded_to,
    signed_percent, significant,
};
use super::{Table, number, words};

/// Most significant digits of an estimate.
const MOST_DIGITS: i32 = 5;

/// One estimated quantity: symbol, meaning, unit, value.
pub struct Parameter<'a> {
    /// "Kt".
    pub symbol: &'static str,
    /// In words.
    pub meaning: &'static str,
    /// SI unit; "1" for a number.
    pub unit: &'static str,
    /// The value.
    pub value: &'a ValueSection,
}

/// What was estimated, SI first.
pub fn estimated(estimate: &EstimateSection) -> Vec<Parameter<'_>> {
    let all = [
        ("Kt", "translational stiffness", "N/m", &estimate.kt),
        ("Kr", "rotational stiffness", "N m/rad", &estimate.kr),
        ("Ktr", "cross stiffness", "N/rad", &estimate.ktr),
        ("Kx", "Kt L\u{b3}/(EI)", "1", &estimate.kx),
        ("Ky", "Kr L/(EI)", "1", &estimate.ky),
        ("Kz", "Ktr L\u{b2}/(EI)", "1", &estimate.kz),
        ("coupling", "\u{221a}(Kx Ky)/Kz", "1", &estimate.coupling),
        ("E", "Young's modulus", "Pa", &estimate.modulus),
        ("\u{3c1}", "density", "kg/m\u{b3}", &estimate.density),
    ];
    all.into_iter()
        .filter_map(|(symbol, meaning, unit, value)| {
            Some(Parameter {
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
        let scaled = |value: f64| factor * value;
        let std = self.value.std.map(scaled);
        let spread = self
            .value
            .low
            .zip(self.value.high)
            .map(|(low, high)| factor * (high - low) / 4.0);
        let value = scaled(self.value.value);
        let finest = self.finest_place(value);
        let written = |number: f64| rounded_to(number, std.or(spread), finest);
        let limit =
            |limit: Option<f64>| or_missing(limit.map(|limit| written(scaled(limit)).value));
        let shown = if value.is_infinite() {
            RIGID.to_owned()
        } else {
            written(value).value
        };
        [
            shown,
            std.and_then(|std| rounded_to(value, Some(std), finest).uncertainty)
                .unwrap_or_else(|| MISSING.into()),
            limit(self.value.low),
            limit(self.value.high),
            format!("{letter}{}", self.unit),
        ]
    }

    /// Standard deviation scaled by the misfit, in the unit of the value.
    pub fn written_scaled(&self) -> String {
        let known = |std: &f64| std.is_finite() && *std > 0.0;
        let scaled = self.value.std_scaled.filter(known);
        scaled
            .and_then(|_| self.written_together().uncertainty)
            .unwrap_or_else(|| MISSING.to_owned())
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
        let written = |limit: f64| match wide {
            true => significant(factor * limit, 2),
            false => rounded_to(factor * limit, std, self.finest_place(value)).value,
        };
        Some([written(low), written(high)])
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
    let rows: Vec<Vec<String>> = list
        .iter()
        .map(|parameter| {
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
            vec![name, meaning, value, unit, std, scaled, low, high, from, to]
        })
        .collect();
    let modes: Vec<String> = estimate.modes_used.iter().map(usize::to_string).collect();
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
             unbounded.{}",
            modes.join(", "),
            scaled_note(estimate)
        ),
    };
    let limits = ["Scaled low", "Scaled high"];
    Some(match (misses, stated) {
        (false, _) => table.without_columns(|name| name == "Scaled std" || limits.contains(&name)),
        (true, false) => table.without_columns(|name| limits.contains(&name)),
        (true, true) => table,
    })
}

/// What the scaled standard deviation is, where there is one.
fn scaled_note(estimate: &EstimateSection) -> String {
    let list = estimated(estimate);
    let scaled = list.iter().any(|p| p.value.std_scaled.is_some());
    let stated = list.iter().any(|p| p.value.std.is_some());
    match (scaled, stated) {
        (false, _) => String::new(),
        (true, true) => " Std and limits stand for the frequencies' uncertainty alone; the model misses the \
                         frequencies by more than their uncertainty, and the scaled std takes the \
                         misfit for it, and so do the scaled 95 % limits, by Student's distribution."
            .to_owned(),
        (true, false) => " Not every frequency has an uncertainty, so that all weigh alike: the scaled std takes the \
                          misfit for it, and so do the 95 % limits, by Student's distribution."
            .to_owned(),
    }
}

/// How the estimates hang together; `None` where fewer than two parameters were estimated.
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
    let value = |value: &Option<ValueSection>| value.as_ref().map(|value| value.value);
    let rows = [
        ("Kx", value(&estimate.kx), pairs.kx),
        ("Ky", value(&estimate.ky), pairs.ky),
        ("Kz", value(&estimate.kz), pairs.kz),
    ];
    let rows: Vec<Vec<String>> = rows
        .into_iter()
        .filter(|(_, own, pairs)| own.is_some() || pairs.is_some())
        .map(|(name, own, pairs)| {
            let change = own
                .zip(pairs)
                .map(|(own, pairs)| 100.0 * (pairs - own) / own);
            let change = change.filter(|change| change.is_finite());
            vec![
                name.to_owned(),
                match own {
                    Some(own) if own.is_infinite() => RIGID.to_owned(),
                    own => optional(own, 5),
                },
                optional(pairs, 5),
                signed_percent(change),
            ]
        })
        .collect();
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
    let rows = [
        ("Kx", pairs.kx, 1.0, "1"),
        ("Ky", pairs.ky, 1.0, "1"),
        ("Kz", pairs.kz, 1.0, "1"),
        ("closure", pairs.closure, 100.0, "%"),
    ];
    Some(Table {
        caption: "Pair regression".to_owned(),
        columns: vec![words("Quantity"), number("Value"), words("Unit")],
        rows: rows
            .into_iter()
            .filter(|row| row.1.is_some())
            .map(|(name, value, factor, unit)| {
                let value = value.map(|value| factor * value);
                let value = if unit == "%" {
                    signed_percent(value)
                } else {
                    optional(value, 5)
                };
                vec![name.to_owned(), value, unit.to_owned()]
            })
            .collect(),
        note: std::iter::once(
            "Closure: the product of stiffnesses that the regression implies against the product \
             of its own estimates; far from 0 the model does not fit."
                .to_owned(),
        )
        .chain(
            document
                .warnings_beside()
                .map(|warning| capital(&warning.text) + "."),
        )
        .collect::<Vec<_>>()
        .join(" "),
    })
}
