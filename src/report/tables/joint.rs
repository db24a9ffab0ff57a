//! Tables of the joint: parameters, the pair regression, predicted frequencies.

use super::super::document::{Document, EstimateSection, ValueSection};
use super::super::format::{
    MISSING, RIGID, like, optional, prefix, rounded, signed_percent, significant,
};
use super::{Table, number, reading_bound, words};

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
        let uncertainty = std.or(spread);
        let value = if self.value.value.is_infinite() {
            RIGID.to_owned()
        } else {
            rounded(scaled(self.value.value), uncertainty).value
        };
        let std = std
            .and_then(|std| rounded(scaled(self.value.value), Some(std)).uncertainty)
            .unwrap_or_else(|| MISSING.into());
        [
            value,
            std,
            like(self.value.low.map(scaled), uncertainty),
            like(self.value.high.map(scaled), uncertainty),
            format!("{letter}{}", self.unit),
        ]
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
    let rows: Vec<Vec<String>> = estimated(estimate)
        .iter()
        .map(|parameter| {
            let [value, std, low, high, unit] = parameter.written();
            let name = parameter.symbol.to_owned();
            let meaning = parameter.meaning.to_owned();
            vec![name, meaning, value, unit, std, low, high]
        })
        .collect();
    let modes: Vec<String> = estimate.modes_used.iter().map(usize::to_string).collect();
    Some(Table {
        caption: format!("Estimated parameters, method: {}", estimate.method),
        columns: vec![
            words("Parameter"),
            words("Meaning"),
            number("Value"),
            words("Unit"),
            number("Std"),
            number("95 % low"),
            number("95 % high"),
        ],
        rows,
        note: format!(
            "From modes {}. Std and limits are in the value's unit; \u{2013} means unknown or \
             unbounded.",
            modes.join(", ")
        ),
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
        note:
            "Closure: the product of stiffnesses that the regression implies against the product \
               of its own estimates; far from 0 the model does not fit."
                .to_owned(),
    })
}

/// Measured beside predicted frequencies; `None` where nothing was predicted.
pub fn prediction(document: &Document) -> Option<Table> {
    let rows = document.prediction.as_deref().filter(|p| !p.is_empty())?;
    let rows = rows
        .iter()
        .map(|row| {
            let bound = reading_bound(document, row.mode);
            let percent = bound
                .zip(row.measured)
                .map(|(bound, hz)| 100.0 * bound / hz);
            let hertz = |value: Option<f64>| match bound {
                Some(_) => like(value, bound),
                None => optional(value, 6),
            };
            vec![
                row.mode.to_string(),
                hertz(row.measured),
                hertz(row.predicted),
                signed_percent(row.error_percent),
                percent.map_or(MISSING.into(), |p| format!("\u{b1}{}", significant(p, 2))),
                optional(row.lambda, 5),
                if row.used { "yes" } else { "no" }.to_owned(),
            ]
        })
        .collect();
    Some(Table {
        caption: "Measured and predicted frequencies".to_owned(),
        columns: vec![
            number("Mode"),
            number("Measured (Hz)"),
            number("Predicted (Hz)"),
            number("Error (%)"),
            number("Reading (%)"),
            number("\u{3bb} (1)"),
            words("Used"),
        ],
        rows,
        note: "Error = 100 (predicted \u{2212} measured)/measured. Reading: bound of the measured \
               frequency. Used: the mode entered the estimate; the others are true predictions."
            .to_owned(),
    })
}
