//! Keys of a test description, and suggestions for unknown keys.

use std::str::SplitWhitespace;

/// A table and its keys.
pub(super) struct KnownTable {
    /// Name in messages.
    pub(super) header: &'static str,
    /// Keys in the usual order, with blanks between them.
    keys: &'static str,
}

impl KnownTable {
    const fn new(header: &'static str, keys: &'static str) -> Self {
        Self { header, keys }
    }

    fn keys(&self) -> SplitWhitespace<'static> {
        self.keys.split_whitespace()
    }

    /// Returns true if the table has this key.
    pub(super) fn has(&self, key: &str) -> bool {
        self.keys().any(|known| known == key)
    }

    /// Returns the keys for a message.
    pub(super) fn listed(&self) -> String {
        self.keys.replace(' ', ", ")
    }
}

pub(super) const TOP: KnownTable = KnownTable::new(
    "the top level",
    "name beam joint hammer sensor recording measured analysis effect sheet",
);
pub(super) const BEAM: KnownTable = KnownTable::new(
    "[beam]",
    "length width thickness modulus density poisson tolerance position_tolerance mass bar_length \
     free_test free_frequencies free_std right",
);
pub(super) const TOLERANCE: KnownTable = KnownTable::new(
    "beam.tolerance",
    "length width thickness modulus density poisson masses",
);
pub(super) const RIGHT: KnownTable =
    KnownTable::new("[beam.right]", "width thickness modulus density poisson");
pub(super) const JOINT: KnownTable =
    KnownTable::new("[joint]", "kind model kt kr ktr beam position overlap");
pub(super) const OVERLAP: KnownTable = KnownTable::new("joint.overlap", "length mass");
pub(super) const HAMMER: KnownTable =
    KnownTable::new("[hammer]", "channel scale sensitivity instrument");
pub(super) const SENSOR: KnownTable = KnownTable::new(
    "[[sensor]]",
    "name channel scale sensitivity position mass kind instrument",
);
pub(super) const RECORDING: KnownTable = KnownTable::new(
    "[[recording]]",
    "file files length tap level band block at mass sample_rate time_unit form values variables sensor overload accept_taps reject_taps torque temperature date poles",
);
pub(super) const FASTENED: KnownTable = KnownTable::new("[[recording.mass]]", "name position mass");
pub(super) const MEASURED: KnownTable = KnownTable::new(
    "[measured]",
    "frequencies file first_node modes half_line std scatter",
);
pub(super) const FIRST_NODE: KnownTable = KnownTable::new("measured.first_node", "number position");
pub(super) const ANALYSIS: KnownTable = KnownTable::new(
    "[analysis]",
    "window reading select fit_modes weights sensor_mass fit poles",
);

pub(super) const SHEET: KnownTable = KnownTable::new(
    "[sheet]",
    "number date operator specimen laboratory remarks",
);

/// Not in [`ALL`], because many of its keys also belong to other tables.
pub(super) const EFFECT: KnownTable = KnownTable::new(
    "[[effect]]",
    "id mass inertia position stiffness coupling ratio exponent loss_factor std frequency relative compliance force \
     factor offset",
);

const ALL: [&KnownTable; 14] = [
    &TOP,
    &BEAM,
    &TOLERANCE,
    &RIGHT,
    &JOINT,
    &OVERLAP,
    &HAMMER,
    &SENSOR,
    &RECORDING,
    &FASTENED,
    &MEASURED,
    &FIRST_NODE,
    &ANALYSIS,
    &SHEET,
];

/// Other usual names of keys, which differ too much to be found by spelling.
const SYNONYMS: [(&str, &str); 20] = [
    ("l", "length"),
    ("b", "width"),
    ("breadth", "width"),
    ("h", "thickness"),
    ("t", "thickness"),
    ("height", "thickness"),
    ("depth", "thickness"),
    ("e", "modulus"),
    ("youngs_modulus", "modulus"),
    ("rho", "density"),
    ("nu", "poisson"),
    ("fs", "sample_rate"),
    ("rate", "sample_rate"),
    ("path", "file"),
    ("type", "kind"),
    ("location", "position"),
    ("weight", "mass"),
    ("location", "tap"),
    ("effect", "id"),
    ("name", "id"),
];

/// Suggests a key for an unknown `key` of `table`: a similar key of that table, else the same or a similar
/// key of another table. Returns a part of a message; nothing where no key is similar.
pub(super) fn suggest(key: &str, table: &KnownTable) -> String {
    let lower = key.to_lowercase().replace('-', "_");
    let synonyms = SYNONYMS.iter().filter(|(word, _)| *word == lower);
    let mut meant = synonyms.map(|(_, meant)| *meant);
    let same = table.keys().find(|known| *known == lower);
    if let Some(found) = same.or_else(|| meant.find(|meant| table.has(meant))) {
        return format!("did you mean `{found}`? ");
    }
    if let Some(found) = elsewhere(&lower) {
        return found;
    }
    if let Some(found) = nearest(&lower, table.keys()) {
        return format!("did you mean `{found}`? ");
    }
    nearest(&lower, ALL.iter().flat_map(|table| table.keys()))
        .and_then(elsewhere)
        .unwrap_or_default()
}

/// Names the tables that have this key, if any has.
fn elsewhere(key: &str) -> Option<String> {
    let holders = ALL.iter().filter(|table| table.has(key));
    let tables: Vec<_> = holders.map(|table| table.header).collect();
    (!tables.is_empty()).then(|| format!("`{key}` belongs into {}; ", tables.join(" or ")))
}

/// Returns the known word that is most similar to `word`, if one is similar.
///
/// There are two measures. A typing error is one or two Damerau-Levenshtein edits, at most a third of the
/// word. An abbreviation has the same beginning, which Jaro-Winkler rewards: 0.88 accepts "freq" for
/// "frequencies" and refuses unrelated short words.
pub(super) fn nearest<'w>(word: &str, known: impl Iterator<Item = &'w str>) -> Option<&'w str> {
    // The comparison is quadratic, and no key is this long.
    if word.chars().count() > 64 {
        return None;
    }
    let mut best: Option<(f64, &str)> = None;
    for candidate in known {
        let edits = strsim::damerau_levenshtein(word, candidate);
        let likeness = strsim::jaro_winkler(word, candidate);
        if (edits > 2 || 3 * edits > candidate.chars().count()) && likeness < 0.88 {
            continue;
        }
        let score = strsim::normalized_damerau_levenshtein(word, candidate) + likeness;
        if best.is_none_or(|(highest, _)| score >= highest) {
            best = Some((score, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}
