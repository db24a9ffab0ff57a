//! Keys of a test description, and suggestions for unknown keys.

use super::error::Suggestion;

/// A table and its keys.
pub(super) struct KnownTable {
    /// Name in messages.
    pub(super) header: &'static str,
    /// Keys, in the usual order.
    pub(super) keys: &'static [&'static str],
}

pub(super) const TOP: KnownTable = KnownTable {
    header: "the top level",
    keys: &[
        "name",
        "beam",
        "joint",
        "hammer",
        "sensor",
        "recording",
        "measured",
        "analysis",
        "effect",
    ],
};
pub(super) const BEAM: KnownTable = KnownTable {
    header: "[beam]",
    keys: &[
        "length",
        "width",
        "thickness",
        "modulus",
        "density",
        "poisson",
        "tolerance",
        "right",
    ],
};
pub(super) const TOLERANCE: KnownTable = KnownTable {
    header: "beam.tolerance",
    keys: &["length", "width", "thickness", "modulus", "density"],
};
pub(super) const RIGHT: KnownTable = KnownTable {
    header: "[beam.right]",
    keys: &["width", "thickness", "modulus", "density", "poisson"],
};
pub(super) const JOINT: KnownTable = KnownTable {
    header: "[joint]",
    keys: &[
        "kind", "model", "kt", "kr", "ktr", "beam", "position", "overlap",
    ],
};
pub(super) const OVERLAP: KnownTable = KnownTable {
    header: "joint.overlap",
    keys: &["length", "mass"],
};
pub(super) const HAMMER: KnownTable = KnownTable {
    header: "[hammer]",
    keys: &["channel", "scale", "sensitivity"],
};
pub(super) const SENSOR: KnownTable = KnownTable {
    header: "[[sensor]]",
    keys: &[
        "name",
        "channel",
        "scale",
        "sensitivity",
        "position",
        "mass",
        "kind",
    ],
};
pub(super) const RECORDING: KnownTable = KnownTable {
    header: "[[recording]]",
    keys: &[
        "file",
        "tap",
        "level",
        "band",
        "block",
        "at",
        "mass",
        "sample_rate",
        "form",
        "sensor",
        "torque",
        "temperature",
        "date",
    ],
};
pub(super) const FASTENED: KnownTable = KnownTable {
    header: "[[recording.mass]]",
    keys: &["position", "mass"],
};
pub(super) const MEASURED: KnownTable = KnownTable {
    header: "[measured]",
    keys: &["frequencies", "modes", "half_line", "std", "scatter"],
};
pub(super) const ANALYSIS: KnownTable = KnownTable {
    header: "[analysis]",
    keys: &[
        "window",
        "reading",
        "fit_modes",
        "weights",
        "sensor_mass",
        "fit",
    ],
};

/// Not in [`ALL`], because many of its keys also belong to other tables.
pub(super) const EFFECT: KnownTable = KnownTable {
    header: "[[effect]]",
    keys: &[
        "id",
        "mass",
        "inertia",
        "position",
        "stiffness",
        "coupling",
        "ratio",
        "exponent",
        "loss_factor",
        "std",
        "frequency",
        "relative",
        "compliance",
        "force",
        "factor",
        "offset",
    ],
};

const ALL: [&KnownTable; 12] = [
    &TOP, &BEAM, &TOLERANCE, &RIGHT, &JOINT, &OVERLAP, &HAMMER, &SENSOR, &RECORDING, &FASTENED,
    &MEASURED, &ANALYSIS,
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
/// key of another table.
pub(super) fn suggest(key: &str, table: &'static KnownTable) -> Suggestion {
    let lower = key.to_lowercase().replace('-', "_");
    if let Some(found) = table.keys.iter().find(|known| **known == lower) {
        return Suggestion::Nearest(found);
    }
    let synonym = SYNONYMS
        .iter()
        .find(|(word, meant)| *word == lower && table.keys.contains(meant));
    if let Some((_, meant)) = synonym {
        return Suggestion::Nearest(meant);
    }
    if let Some(found) = elsewhere(&lower) {
        return found;
    }
    if let Some(found) = nearest(&lower, table.keys.iter().copied()) {
        return Suggestion::Nearest(found);
    }
    let everywhere = ALL.iter().flat_map(|table| table.keys.iter().copied());
    nearest(&lower, everywhere)
        .and_then(elsewhere)
        .unwrap_or(Suggestion::Nothing)
}

fn elsewhere(key: &str) -> Option<Suggestion> {
    let holders = ALL.iter().filter(|table| table.keys.contains(&key));
    let tables: Vec<_> = holders.map(|table| table.header).collect();
    let key = ALL
        .iter()
        .flat_map(|table| table.keys)
        .find(|known| **known == key)?;
    Some(Suggestion::BelongsInto { key, tables })
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
