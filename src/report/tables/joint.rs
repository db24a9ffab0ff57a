//! Tables of the joint: parameters, the pair regression, and how far the estimate moves when the frequencies do.

use super::{Cell, Table, listed, mode_of, number, page_number, words};
use crate::document::{
    BudgetRow, Document, EstimateMethod, EstimateSection, FromReadings, ResolutionSpanSection,
    SensitivitySection, Uncertain,
};
use crate::format::{
    MISSING, RIGID, Rounded, bound_percent, capital, last_place, optional, or_missing, prefix,
    rounded_to, signed, signed_percent, significant, trimmed, unit_words,
};
use tapjoint_identify::consistent::{Correlation, Measure, Parameter as Fitted};

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
    /// The value, with all that is uncertain.
    pub value: &'a Uncertain,
    /// The value by the readings alone.
    pub from_readings: Option<&'a FromReadings>,
    /// What each input contributes.
    pub budget: &'a [BudgetRow],
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
        let value = value.as_ref()?;
        Some(Parameter {
            name,
            symbol,
            meaning,
            unit,
            value: &value.uncertain,
            from_readings: value.from_readings.as_ref(),
            budget: &value.budget,
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

    /// Value and standard deviation, rounded together.
    pub fn written_together(&self) -> Rounded {
        let (factor, _) = self.scale();
        let value = factor * self.value.value;
        let std = self.value.std.map(|std| factor * std);
        rounded_to(value, std, self.finest_place(value))
    }

    /// The 95 % limits by the readings alone, in the unit of the value; a dash where there is none.
    pub fn written_from_readings(&self) -> [String; 2] {
        let (factor, _) = self.scale();
        let Some(found) = self.from_readings else {
            return [MISSING, MISSING].map(str::to_owned);
        };
        let std = found.std.map(|std| factor * std);
        let ends = found.low.zip(found.high);
        let spread = ends.map(|(low, high)| factor * (high - low) / 4.0);
        [found.low, found.high].map(|limit| {
            or_missing(limit.map(|limit| {
                let limit = factor * limit;
                rounded_to(limit, std.or(spread), self.finest_place(limit)).value
            }))
        })
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
    let both = list.iter().any(|p| p.from_readings.is_some());
    let mut rows = Vec::new();
    for parameter in &list {
        let [value, std, low, high, unit] = parameter.written();
        let name = parameter.symbol.to_owned();
        let meaning = parameter.meaning.to_owned();
        let [from, to] = parameter.written_from_readings();
        rows.push(vec![name, meaning, value, unit, std, low, high, from, to]);
    }
    let beyond = match (estimate.discrepancy_percent, estimate.method) {
        (Some(percent), _) => format!(
            " The limits hold the readings, the tolerances of the description, and {} % that the model may miss of each \
             frequency. Readings: the limits with an exact description and an exact model.",
            significant(percent, 2)
        ),
        (None, EstimateMethod::Consistent) => {
            " All frequencies weigh alike. Std and limits are those of the misfit, by \
             Student's distribution."
                .to_owned()
        }
        (None, _) => String::new(),
    };
    let heads = [
        words("Parameter", ""),
        words("Meaning", "").on_page_if(both),
        number("Value", ""),
        words("Unit", ""),
        number("Std", ""),
        number("95 % low", ""),
        number("95 % high", ""),
        page_number("Readings low", ""),
        page_number("Readings high", ""),
    ];
    let caption = format!("Estimated parameters, method: {}", estimate.method.name());
    let mut modes = format!("From modes {}", listed(&estimate.modes_used));
    for length in document.lengths.iter().flatten() {
        let numbers: Vec<usize> = length.prediction.iter().map(|row| row.mode).collect();
        if !numbers.is_empty() {
            let free = trimmed(length.length, 6);
            modes.push_str(&format!(", and {} at {free} m", listed(&numbers)));
        }
    }
    let set_ups = set_up_words(estimate).unwrap_or_default();
    let note = format!(
        "{modes}.{set_ups} Std and limits are in the value's unit; \u{2013} means unknown or unbounded.{beyond}"
    );
    let table = Table::with_heads(caption, heads, rows, note);
    Some(match both {
        true => table,
        false => table.without_columns(&["Readings low", "Readings high"]),
    })
}

/// Share of the largest contribution below which an input has no row: its square is a millionth.
const NEGLIGIBLE_SHARE: f64 = 1e-3;

/// What each input contributes to the standard deviations; `None` without a budget.
pub fn budget(document: &Document) -> Option<Table> {
    let estimate = document.estimate.as_ref()?.as_ref()?;
    let list = estimated(estimate);
    let columns: Vec<&Parameter<'_>> = list
        .iter()
        .filter(|one| !one.budget.is_empty() && !matches!(one.name, "kx" | "ky"))
        .collect();
    // The inputs of all columns, in the order of the first; what is nothing beside the rest is left out.
    let mut inputs: Vec<&str> = Vec::new();
    for column in &columns {
        let most = column.budget.first().map_or(0.0, |own| own.std_percent);
        let seen = column.budget.iter();
        for own in seen.filter(|own| own.std_percent > NEGLIGIBLE_SHARE * most) {
            if !inputs.contains(&&*own.input) {
                inputs.push(&own.input);
            }
        }
    }
    if inputs.is_empty() {
        return None;
    }
    let mut rows = Vec::new();
    for input in inputs {
        let mut row = vec![input_words(input)];
        row.extend(columns.iter().map(|column| {
            let mut budget = column.budget.iter();
            let own = budget.find(|own| own.input == input);
            or_missing(own.map(|own| significant(own.std_percent, 2)))
        }));
        rows.push(row);
    }
    let mut total = vec!["together".to_owned()];
    total.extend(columns.iter().map(|column| {
        let squares: f64 = column
            .budget
            .iter()
            .map(|own| own.std_percent.powi(2))
            .sum();
        significant(squares.sqrt(), 2)
    }));
    rows.push(total);
    for remedy in &estimate.remedies {
        let mut row = vec![remedy_words(remedy.measure).to_owned()];
        row.extend(columns.iter().map(|column| {
            let percent = match column.name {
                "kt" => remedy.kt_percent,
                "kr" => remedy.kr_percent,
                "modulus" => remedy.modulus_percent,
                _ => None,
            };
            or_missing(percent.map(|percent| significant(percent, 2)))
        }));
        rows.push(row);
    }
    let mut heads = vec![words("Input", "")];
    heads.extend(
        columns
            .iter()
            .map(|column| number(&format!("{} (%)", column.symbol), "")),
    );
    let assumed = estimate.assumed.as_ref();
    let assumed = assumed.map_or(String::new(), |assumed| {
        format!(" Assumed standard uncertainties: {assumed}.")
    });
    let note = format!(
        "Part of each input in the standard deviation; the squares add up. Below: all together after one more \
         measurement.{assumed}"
    );
    let caption = "What the uncertainty comes from";
    Some(Table::with_heads(caption, heads, rows, &note))
}

/// An input of the budget in words.
fn input_words(input: &str) -> String {
    match input {
        "readings" => "readings of the frequencies".to_owned(),
        "discrepancy" => "what the model misses".to_owned(),
        "weighing" => "mass of the bar".to_owned(),
        "set-ups" => "differences between set-ups".to_owned(),
        // "second-length" and the like.
        other if other.ends_with("-length") => {
            format!("{} (moved clamp or free bar)", other.replace('-', " "))
        }
        other => other.to_owned(),
    }
}

/// A further measurement in words.
pub fn remedy_words(measure: Measure) -> &'static str {
    match measure {
        Measure::WeighBeam => "with the bar weighed to 0.1 %",
        Measure::FreeTest => "with five modes of the free bar",
        Measure::Caliper => {
            "with thickness \u{b1}0.01 mm, width \u{b1}0.02 mm, length \u{b1}0.2 mm"
        }
        Measure::WeighMasses => "with what is attached weighed to 0.1 g",
    }
}

/// A correlation in words: "Kr and E", "\u{2212}0.97".
pub fn correlation_words(found: &Correlation) -> (String, String) {
    let [first, second] = [found.first, found.second].map(|parameter| match parameter {
        Fitted::Kt => "Kt",
        Fitted::Kr => "Kr",
        Fitted::Modulus => "E",
        Fitted::Density => "\u{3c1}",
        other => other.name(),
    });
    // Near 1 the distance from 1 is what counts: two digits of it.
    let digits = if found.value.abs() > 0.99 { 4 } else { 2 };
    (
        format!("{first} and {second}"),
        significant(found.value, digits),
    )
}

/// Correlations of the estimates; `None` where fewer than two parameters were estimated.
pub fn correlations(document: &Document) -> Option<Table> {
    let estimate = document.estimate.as_ref()?.as_ref()?;
    let rows = estimate.correlations.iter().map(|found| {
        let (pair, value) = correlation_words(found);
        [words("Parameters", pair), number("Correlation (1)", value)]
    });
    let note = "Near 1 or \u{2212}1 the frequencies tell a combination of the two rather than each; of the \
                logarithms of the values.";
    (!estimate.correlations.is_empty()).then(|| Table::of("Correlations", rows, note))
}

/// The consistent estimate beside the pair regression; `None` where there is only one of them.
pub fn methods(document: &Document) -> Option<Table> {
    let estimate = document.estimate.as_ref()?.as_ref()?;
    let pairs = estimate
        .pairs
        .as_ref()
        .filter(|_| estimate.method != EstimateMethod::Pairs)?;
    let mut rows = Vec::new();
    for (name, own, pairs) in [
        ("Kx", &estimate.kx, pairs.kx),
        ("Ky", &estimate.ky, pairs.ky),
        ("Kz", &estimate.kz, pairs.kz),
    ] {
        let own = own.as_ref().map(|value| value.uncertain.value);
        if own.is_some() || pairs.is_some() {
            rows.push(vec![
                name.to_owned(),
                stiffness(own),
                optional(pairs, 5),
                signed_percent(change(pairs, own)),
            ]);
        }
    }
    let heads = [
        words("Parameter (1)", ""),
        number("Consistent", ""),
        number("Pairs", ""),
        number("Pairs differ (%)", ""),
    ];
    let note = "The consistent estimate satisfies its own frequency equation, and takes shear, sensor \
                masses and known stiffnesses into account where they are described; the pair regression \
                does none of this.";
    Some(Table::with_heads("Methods side by side", heads, rows, note))
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
    let heads = [
        words("Quantity", ""),
        number("Value", ""),
        words("Unit", ""),
    ];
    Some(Table::with_heads("Pair regression", heads, rows, note))
}

/// Returns the non-dimensional values that changes are counted from.
fn base(document: &Document, method: EstimateMethod) -> [Option<f64>; 3] {
    let Some(estimate) = document.estimate.as_ref().and_then(Option::as_ref) else {
        return [None; 3];
    };
    match &estimate.pairs {
        Some(pairs) if method == EstimateMethod::Pairs => [pairs.kx, pairs.ky, pairs.kz],
        _ => [&estimate.kx, &estimate.ky, &estimate.kz]
            .map(|value| Some(value.as_ref()?.uncertain.value)),
    }
}

/// Returns the cell of a method, shown where there are several.
fn by_method(method: EstimateMethod, all: &[EstimateMethod]) -> Cell {
    let several = all.iter().any(|other| Some(other) != all.first());
    words("Method", method.name()).on_page_if(!several)
}

/// Rows of several methods, those about the same thing side by side: the consistent estimate first, in
/// the order of the things as they come.
fn side_by_side<T: Copy, K: PartialEq>(
    rows: impl Iterator<Item = T>,
    thing: impl Fn(T) -> K,
    method: impl Fn(T) -> EstimateMethod,
) -> Vec<T> {
    let mut things: Vec<K> = Vec::new();
    let mut placed: Vec<(usize, EstimateMethod, T)> = Vec::new();
    for row in rows {
        let key = thing(row);
        let known = things.iter().position(|other| *other == key);
        let place = known.unwrap_or(things.len());
        if known.is_none() {
            things.push(key);
        }
        placed.push((place, method(row), row));
    }
    placed.sort_by_key(|(place, method, _)| (*place, *method));
    placed.into_iter().map(|(_, _, row)| row).collect()
}

/// Returns a stiffness in five digits; "rigid" beyond all bounds.
fn stiffness(value: Option<f64>) -> String {
    match value {
        Some(value) if value.is_infinite() => RIGID.to_owned(),
        value => optional(value, 5),
    }
}

/// Returns the difference from a base (%).
fn change(value: Option<f64>, base: Option<f64>) -> Option<f64> {
    let (value, base) = value.zip(base)?;
    Some(100.0 * (value - base) / base)
}

/// Returns a note, after a blank, where set-ups differ: the estimate is that of their mean joint. It has the limits for
/// a further set-up. `None` where they do not differ.
pub fn set_up_words(estimate: &EstimateSection) -> Option<String> {
    let count = estimate.set_ups?;
    let all = [("Kt", "N/m", &estimate.kt), ("Kr", "N m/rad", &estimate.kr)];
    let further = all.into_iter().filter_map(|(name, unit, value)| {
        let [low, high] = value.as_ref()?.further_set_up?;
        let (factor, letter) = prefix(low);
        let [low, high] = [low, high].map(|end| significant(factor * end, 3));
        Some(format!(
            "{name} {low} to {high} {letter}{}",
            unit_words(unit)
        ))
    });
    let further: Vec<String> = further.collect();
    let further = match further.is_empty() {
        true => String::new(),
        false => format!(" A further set-up (95 %): {}.", further.join(", ")),
    };
    Some(format!(
        " {count} set-ups differ beyond noise. Value, std and limits are those of their mean joint.{further}"
    ))
}

/// Non-dimensional stiffnesses.
const NAMES: [&str; 3] = ["Kx", "Ky", "Kz"];

/// Estimates with all frequencies changed by the same percentage; `None` where not computed.
pub fn perturbation(document: &Document) -> Option<Table> {
    let list = document.perturbation.as_deref().filter(|p| !p.is_empty())?;
    let shown = if list.iter().any(|row| row.kz.is_some()) {
        3
    } else {
        2
    };
    let methods: Vec<EstimateMethod> = list.iter().map(|row| row.method).collect();
    let ordered = side_by_side(list.iter(), |row| row.percent.to_bits(), |row| row.method);
    let rows = ordered.into_iter().map(|row| {
        let mut cells = vec![
            number("Frequencies (%)", signed(row.percent)),
            by_method(row.method, &methods),
        ];
        let values = [row.kx, row.ky, row.kz]
            .into_iter()
            .zip(base(document, row.method));
        for ((value, base), name) in values.zip(&NAMES[..shown]) {
            cells.push(number(&format!("{name} (1)"), stiffness(value)));
            cells.push(number("change (%)", signed_percent(change(value, base))));
        }
        cells
    });
    let mut note = "Change: against the estimate by the same method. \u{2013}: the changed frequencies leave no \
                    estimate."
        .to_owned();
    if document.lengths.is_some() {
        note.push_str(" Those of the beam's other free lengths are not changed.");
    }
    let caption = "All frequencies changed by the same percentage";
    Some(Table::of(caption, rows, &note))
}

/// Average errors under changed frequencies, as the paper's tables state them; `None` where not
/// computed.
pub fn averages(document: &Document) -> Option<Table> {
    let averages = document.perturbation_averages.as_deref();
    let list = averages.filter(|list| !list.is_empty())?;
    let methods: Vec<EstimateMethod> = list.iter().map(|row| row.method).collect();
    let ordered = side_by_side(list.iter(), |row| row.percent.to_bits(), |row| row.method);
    let rows = ordered.into_iter().map(|row| {
        [
            number(
                "Frequencies (%)",
                format!("\u{b1}{}", trimmed(row.percent, 4)),
            ),
            by_method(row.method, &methods),
            number("Kx off by (%)", optional(row.kx_percent, 3)),
            number("Ky off by (%)", optional(row.ky_percent, 3)),
            number("Kz off by (%)", optional(row.kz_percent, 3)),
            number("mean Kx off by (%)", optional(row.kx_of_mean_percent, 3)),
            number("mean Ky off by (%)", optional(row.ky_of_mean_percent, 3)),
            number("mean Kz off by (%)", optional(row.kz_of_mean_percent, 3)),
        ]
    });
    let note = "Off by: mean size of the changes of the table above, up and down. Mean off by: the error of the mean of \
                the two estimates, which is less, because opposite changes cancel.";
    Some(Table::of("Average errors of the stiffnesses", rows, note).without_empty_columns())
}

/// Median and 95 % interval under random errors of the frequencies; `None` where not computed.
pub fn monte_carlo(document: &Document) -> Option<Table> {
    let list = document.monte_carlo.as_deref().filter(|l| !l.is_empty())?;
    let methods: Vec<EstimateMethod> = list.iter().map(|found| found.method).collect();
    let parameters = list.iter().flat_map(|found| {
        let values = [found.kx, found.ky, found.kz];
        (0..3).filter_map(move |index| Some((index, found, values[index]?)))
    });
    let ordered = side_by_side(parameters, |row| row.0, |row| row.1.method);
    let rows = ordered.into_iter().map(|(index, found, value)| {
        let base = base(document, found.method)[index];
        [
            words("Parameter (1)", NAMES[index]),
            by_method(found.method, &methods),
            number("Estimate", stiffness(base)),
            number("Median", stiffness(Some(value.value))),
            number("95 % low", optional(value.low, 5)),
            number("95 % high", optional(value.high, 5)),
            number("down (%)", signed_percent(change(value.low, base))),
            number("up (%)", signed_percent(change(value.high, base))),
        ]
    });
    let failed = list.iter().map(|found| (found.method, found.failed));
    let mut note = format!(
        "{} draws, each frequency with its own standard deviation. Errors are uniform within half a line for line readings, else normal.{}",
        list.first().map_or(0, |found| found.samples),
        failures(&failed.collect::<Vec<_>>(), " and are left out")
    );
    if methods.contains(&EstimateMethod::Consistent) {
        note.push_str(
            " The consistent estimate draws the beam's properties that have a tolerance as well.",
        );
    }
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    if estimate.is_some_and(|estimate| estimate.set_ups.is_some()) {
        note.push_str(" The scatter between set-ups is left out.");
    }
    let caption = "Random errors of the frequencies (Monte Carlo)";
    Some(Table::of(caption, rows, note).without_empty_columns())
}

/// Returns how many repetitions left no estimate, by each method, and what follows from that.
fn failures(failed: &[(EstimateMethod, usize)], consequence: &str) -> String {
    let mut words = String::new();
    for (method, count) in failed.iter().filter(|(_, count)| *count > 0) {
        let by = match failed.len() {
            1 => String::new(),
            _ => format!(" by the method {}", method.name()),
        };
        words.push_str(&format!(
            " {count} of them leave no estimate{by}{consequence}."
        ));
    }
    words
}

/// "16 sign patterns".
pub(crate) fn patterns_in_words(span: &ResolutionSpanSection) -> String {
    let drawn = if span.sampled {
        ", drawn at random,"
    } else {
        ""
    };
    format!("{} sign patterns{drawn}", span.patterns)
}

/// Smallest and largest estimate over the sign patterns of the bounds; `None` where not computed.
pub fn spans(document: &Document) -> Option<Table> {
    let list = document.resolution_span.as_deref()?;
    let methods: Vec<EstimateMethod> = list.iter().map(|span| span.method).collect();
    let parameters = list.iter().flat_map(|span| {
        let ranges = [span.kx, span.ky, span.kz];
        (0..3).filter_map(move |index| Some((index, span, ranges[index]?)))
    });
    let ordered = side_by_side(parameters, |row| row.0, |row| row.1.method);
    let rows = ordered.into_iter().map(|(index, span, [low, high])| {
        let base = base(document, span.method)[index];
        vec![
            NAMES[index].to_owned(),
            span.method.name().to_owned(),
            stiffness(Some(low)),
            stiffness(base),
            stiffness(Some(high)),
            signed_percent(change(Some(low), base)),
            signed_percent(change(Some(high), base)),
        ]
    });
    let heads = [
        words("Parameter (1)", ""),
        by_method(EstimateMethod::default(), &methods),
        number("Smallest", ""),
        number("Estimate", ""),
        number("Largest", ""),
        number("down (%)", ""),
        number("up (%)", ""),
    ];
    let failed = list.iter().map(|span| (span.method, span.failed));
    let note = format!(
        "{} tried.{}",
        list.first().map_or_else(String::new, patterns_in_words),
        failures(&failed.collect::<Vec<_>>(), ": the span is open")
    );
    let caption = "Every mode at one end of its bound or the other";
    Some(Table::with_heads(caption, heads, rows.collect(), note))
}

/// Change of each parameter by each mode's bound; `None` where not computed.
pub fn sensitivity(document: &Document) -> Option<Table> {
    let list = document.resolution_span.as_deref()?;
    let methods: Vec<EstimateMethod> = list.iter().map(|span| span.method).collect();
    let all = list
        .iter()
        .flat_map(|span| span.sensitivity.iter().map(move |row| (span, row)));
    let ordered = side_by_side(all, |row| row.1.mode, |row| row.0.method);
    if ordered.is_empty() {
        return None;
    }
    let with_kz = ordered.iter().any(|(_, row)| row.kz_percent.is_some());
    let names = if with_kz { &NAMES[..] } else { &NAMES[..2] };
    let mut rows: Vec<Vec<Cell>> = Vec::with_capacity(ordered.len() + list.len());
    for (span, row) in ordered {
        let mode = mode_of(document, row.mode).filter(|mode| mode.frequency > 0.0);
        let percent = mode.map(|mode| 100.0 * row.half_line / mode.frequency);
        let mut cells = vec![
            number("Mode", row.mode.to_string()),
            by_method(span.method, &methods),
            number("Bound (Hz)", significant(row.half_line, 3)),
            number("Bound (%)", or_missing(percent.map(bound_percent))),
        ];
        let moves = [row.kx_percent, row.ky_percent, row.kz_percent];
        for (name, percent) in names.iter().zip(moves) {
            cells.push(number(
                &format!("{name} moves (%)"),
                signed_percent(percent),
            ));
        }
        rows.push(cells);
    }
    let mut notes = Vec::new();
    for span in list {
        let drivers = drivers(&span.sensitivity, names);
        if !drivers.is_empty() {
            notes.push(match list.len() {
                1 => drivers.join(", ") + ".",
                _ => format!(
                    "By the method {}: {}.",
                    span.method.name(),
                    drivers.join(", ")
                ),
            });
        }
    }
    let of_scale = list
        .iter()
        .filter_map(|span| Some((span.method, span.common_scale.as_ref()?)));
    let of_scale = side_by_side(of_scale, |_| 0, |row| row.0);
    if !of_scale.is_empty() {
        notes.push(
            "All: every frequency is off by one factor, the standard uncertainty of the bar's own scale by the description, \
             h/L\u{b2} sqrt(E/\u{3c1})."
                .to_owned(),
        );
    }
    for (method, scale) in of_scale {
        let mut cells = vec![
            number("Mode", "all"),
            by_method(method, &methods),
            number("Bound (Hz)", MISSING),
            number("Bound (%)", bound_percent(scale.scale_percent)),
        ];
        let moves = [scale.kx_percent, scale.ky_percent, scale.kz_percent];
        for (name, percent) in names.iter().zip(moves) {
            cells.push(number(
                &format!("{name} moves (%)"),
                signed_percent(percent),
            ));
        }
        rows.push(cells);
    }
    Some(Table::of(
        "Which mode drives which parameter",
        rows,
        notes.join(" "),
    ))
}

/// Returns "Kx depends most on mode 4" and "Ky on mode 1"; empty where nothing depends on any.
fn drivers(list: &[SensitivitySection], names: &[&str]) -> Vec<String> {
    let mut drivers: Vec<String> = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let strengths = list.iter().map(|row| {
            let percent = [row.kx_percent, row.ky_percent, row.kz_percent][index];
            (percent.map_or(0.0, f64::abs), row.mode)
        });
        let strengths = strengths.filter(|(strength, _)| *strength > 0.0);
        if let Some((_, mode)) = strengths.max_by(|a, b| a.0.total_cmp(&b.0)) {
            let depends = match drivers.is_empty() {
                true => " depends most",
                false => "",
            };
            drivers.push(format!("{name}{depends} on mode {mode}"));
        }
    }
    drivers
}
