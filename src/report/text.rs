//! All tables and findings for a terminal, without colours.

use std::collections::BTreeSet;

use crate::document::{Document, EstimateSection, ReadBy, Timing, TimingsSection, method_name};
use crate::format::{capital, or_missing, signed_percent, significant, trimmed};
use crate::screen::Screen;
use crate::tables::{self, Table, listed, number, words};
use crate::words::diagnosis::gap_story;
use crate::words::findings::no_estimate;
use tapjoint_analysis::Stage;
use tapjoint_compare::DampingVerdict;
use tapjoint_study::publication::{Agreement, Reproduction};

/// Most taps listed one by one.
const MOST_TAPS: usize = 10;

/// Everything the document holds.
pub fn render_text(document: &Document, screen: Screen) -> String {
    if document.compare.is_some() || document.series.is_some() {
        return comparison(document, screen);
    }
    // Channels are shown where recordings were only looked at.
    let inspected = document.modes.is_none();
    let channels = tables::channels(document).filter(|_| inspected);
    let recordings = document.recordings.iter().flatten();
    let taps: usize = recordings.map(|recording| recording.taps.len()).sum();
    // Many taps are not listed: only the rejected ones are, and how many were used.
    let taps = match taps > MOST_TAPS {
        true => [tables::taps_used(document), tables::rejected_taps(document)],
        false => [tables::taps(document), None],
    };
    joined([
        screen.plain(tables::datasets(document)),
        joined([
            screen.plain(tables::recordings(document)),
            screen.plain(channels),
        ]),
        joined(taps.map(|table| screen.plain(table))),
        screen.noted(tables::hammer(document)),
        modes(document, screen),
        screen.noted(tables::frfs(document)),
        estimate(document, screen),
        screen.plain(tables::prediction(document)),
        screen.noted(tables::lengths(document)),
        screen.noted(tables::free_test(document)),
        gap(document, screen),
        joined([
            screen.plain(tables::perturbation(document)),
            screen.plain(tables::averages(document)),
            screen.noted(tables::spans(document)),
            screen.noted(tables::sensitivity(document)),
            screen.noted(tables::monte_carlo(document)),
        ]),
        screen.plain(tables::quality_doubts(document)),
        warnings(document, screen),
    ])
}

/// The modes; empty without any, and where their frequency response functions are listed.
fn modes(document: &Document, screen: Screen) -> String {
    let listed = document.frfs.as_ref().is_some_and(|frfs| !frfs.is_empty());
    let Some(table) = tables::modes(document).filter(|_| !listed) else {
        return String::new();
    };
    let mut text = screen.table(&table);
    let modes = document.modes.as_deref().unwrap_or_default();
    if modes.iter().any(|mode| mode.method == Some(ReadBy::Fit)) {
        // The numbered modes without a fit: " (mode 3: interpolated; mode 4: line)".
        let others = modes.iter().filter(|mode| mode.method != Some(ReadBy::Fit));
        let others = others
            .filter_map(|mode| Some(format!("mode {}: {}", mode.mode?, method_name(mode.method))));
        let others: Vec<String> = others.collect();
        let others = match others.is_empty() {
            true => String::new(),
            false => format!(" ({})", others.join("; ")),
        };
        let note = format!(
            "Frequency: fit of {}, \u{b1} half the 95 % interval{others}; line: the highest spectral line \
             \u{b1} half line; damping \u{b1} half the 95 % interval.",
            tables::fitted_to(document),
        );
        text.push_str(&screen.wrapped(&note, 0));
    }
    let more = [tables::left_out(document), tables::modes_from(document)];
    for sentence in more.into_iter().flatten() {
        text.push_str(&screen.wrapped(&sentence, 0));
    }
    text
}

/// The estimate and how far its regression closes, or why there is none; empty where it was not
/// asked for.
fn estimate(document: &Document, screen: Screen) -> String {
    let found = match &document.estimate {
        None => return String::new(),
        Some(None) => {
            let words = no_estimate(document).unwrap_or_default();
            return screen.wrapped(&format!("{}.", capital(&words)), 0);
        }
        Some(Some(found)) => found,
    };
    let mut text = screen.plain(tables::parameters(document));
    text.push_str(&strong_correlations(found, screen));
    if let Some(words) = tables::set_up_words(found) {
        text.push_str(&screen.wrapped(words.trim(), 0));
    }
    let beside = [tables::budget(document), tables::methods(document)];
    for table in beside.into_iter().flatten() {
        text.push('\n');
        text.push_str(&screen.table(&table));
    }
    if let Some(closure) = found.pairs.as_ref().and_then(|pairs| pairs.closure) {
        let percent = signed_percent(Some(100.0 * closure));
        let words = format!(
            "From modes {}. Self-check of the pair regression (closure): {percent} %; 0 is perfect.",
            listed(&found.modes_used)
        );
        text.push_str(&screen.wrapped(&words, 0));
    }
    for warning in document.warnings_beside() {
        let note = format!("note ({}): {}", warning.code, warning.text);
        text.push_str(&screen.wrapped(&note, 2));
    }
    text
}

/// Correlations from here on are said: the data fix one combination of the two five times as well as the other.
const STRONG: f64 = 0.92;

/// Says which estimates the frequencies hardly tell apart; empty where they do.
fn strong_correlations(found: &EstimateSection, screen: Screen) -> String {
    let strong = found
        .correlations
        .iter()
        .filter(|pair| pair.value.abs() >= STRONG);
    let words = strong.map(|one| {
        let (pair, value) = tables::correlation_words(one);
        let words = format!(
            "Correlation of {pair}: {value}; the frequencies tell a combination of the two rather than each."
        );
        screen.wrapped(&words, 0)
    });
    words.collect()
}

/// The warnings that concern the result; empty without any. Those of the pair regression stand with it.
fn warnings(document: &Document, screen: Screen) -> String {
    document
        .main_warnings()
        .map(|warning| screen.wrapped(&format!("warning ({}): {}", warning.code, warning.text), 2))
        .collect()
}

/// Those of the parts that are not empty, with an empty line between them.
fn joined<const N: usize>(parts: [String; N]) -> String {
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join("\n")
}

/// Returns the control charts of a series, and what changed between two tests: the frequencies and the causes.
fn comparison(document: &Document, screen: Screen) -> String {
    let compared = document.compare.as_ref();
    let damping = compared.and_then(|compared| compared.found.damping.as_ref());
    let is_damped = damping.is_some_and(|found| found.verdict != DampingVerdict::NoChange);
    let tables = [
        tables::changed_modes(document),
        tables::changed_dampings(document).filter(|_| is_damped),
        tables::changes(document),
    ];
    joined([
        screen.noted(tables::control_charts(document)),
        joined(tables.map(|table| screen.noted(table))),
        doubts(document, screen),
    ])
}

/// Returns a line with the doubts about the readings; empty without any.
fn doubts(document: &Document, screen: Screen) -> String {
    let codes: BTreeSet<&str> = document
        .warnings
        .iter()
        .map(|one| one.code.as_str())
        .collect();
    let codes: Vec<&str> = codes.into_iter().collect();
    match codes.as_slice() {
        [] => String::new(),
        codes => screen.wrapped(
            &format!(
                "Doubts about the readings: {}. `tapjoint run` on each test explains them.",
                codes.join(", ")
            ),
            2,
        ),
    }
}

/// The story of the gap and the hypotheses; empty without a diagnosis.
fn gap(document: &Document, screen: Screen) -> String {
    let story = gap_story(document);
    let story: Vec<String> = story
        .iter()
        .map(|sentence| screen.wrapped(sentence, 2))
        .collect();
    let tables = [tables::hypotheses(document), tables::next_tests(document)];
    joined([
        story.join("\n"),
        joined(tables.map(|table| screen.noted(table))),
    ])
}

/// Returns a line for each recording, the peaks and the estimate; empty where nothing was computed.
pub fn render_stages(document: &Document) -> String {
    let mut lines = Vec::new();
    for found in document.recordings.iter().flatten() {
        let accepted = found.taps.iter().filter(|tap| tap.accepted).count();
        let mut parts = vec![format!("{} channels", found.channels)];
        if let Some((rate, seconds)) = found.sample_rate.zip(found.seconds) {
            parts.push(format!("{} Hz, {seconds:.2} s", trimmed(rate, 6)));
            parts.push(format!("{accepted} of {} taps accepted", found.taps.len()));
        }
        if let Some([low, high]) = found.band {
            parts.push(format!("{} to {} Hz", trimmed(low, 6), trimmed(high, 6)));
        }
        if let Some((block, spacing)) = found.block.zip(found.line_spacing) {
            let spacing = significant(spacing, 4);
            parts.push(format!(
                "blocks of {block} samples, lines {spacing} Hz apart"
            ));
        }
        parts.extend(found.window.iter().map(|window| format!("{window} window")));
        lines.push(format!("{}: {}", found.file, parts.join("; ")));
    }
    if let Some(modes) = &document.modes {
        let numbered = modes.iter().filter(|mode| mode.mode.is_some()).count();
        let peaks = modes.len();
        lines.push(format!("modes: {peaks} peaks, {numbered} with a number"));
    }
    if let Some(found) = document.estimate.as_ref().and_then(Option::as_ref) {
        let misfit = found.misfit.as_ref();
        lines.push(format!(
            "estimate: {} from modes {}{}",
            found.method.name(),
            listed(&found.modes_used),
            misfit.map_or_else(String::new, |misfit| format!("; {}", misfit.verdict))
        ));
        let statements = found.identifiability.iter().flat_map(|can| &can.statements);
        lines.extend(statements.map(|words| format!("estimate: {words}")));
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

/// Returns what each stage of a command took, as a table.
pub fn render_timings(timings: &TimingsSection, screen: Screen) -> String {
    let stages = timings.stages.iter();
    let mut rows: Vec<(&str, &Timing)> = stages
        .map(|row| (stage_words(row.stage), &row.timing))
        .collect();
    // Without stages everything is the total.
    if !rows.is_empty() {
        rows.push(("other", &timings.other));
    }
    rows.push(("total", &timings.total));
    let rows = rows.into_iter().map(|(name, timing)| {
        let seconds = |seconds: f64| format!("{seconds:.3}");
        let megabytes = timing
            .peak_bytes
            .map(|bytes| format!("{:.1}", bytes as f64 / 1e6));
        [
            words("Stage", name),
            number("Wall time (s)", seconds(timing.wall_seconds)),
            number(
                "Processor time (s)",
                or_missing(timing.processor_seconds.map(seconds)),
            ),
            number("Peak memory so far (MB)", or_missing(megabytes)),
        ]
    });
    screen.table(&Table::of("Timings", rows, ""))
}

/// Returns the name of a stage in a table.
fn stage_words(stage: Stage) -> &'static str {
    match stage {
        Stage::Taps => "reading and taps",
        Stage::Spectra => "spectra",
        Stage::Fits => "fits of modes",
        Stage::Numbers => "numbers of modes",
        Stage::Joint => "joint",
        Stage::Perturbation => "perturbation",
        Stage::Diagnosis => "diagnosis",
        Stage::Comparison => "comparison",
        Stage::Study => "tests of the study",
        Stage::Pictures => "pictures",
        Stage::Files => "files",
    }
}

/// Returns every tap and every peak of every recording; empty without recordings.
pub fn render_readings(document: &Document) -> String {
    let mut text = String::new();
    for recording in document.recordings.iter().flatten() {
        let file = &recording.file;
        for tap in &recording.taps {
            let fate = match (&tap.reason, tap.accepted) {
                (Some(reason), _) => reason.as_str(),
                (None, true) => "accepted",
                (None, false) => "rejected",
            };
            text.push_str(&format!("{file}: tap at {:.3} s, {fate}\n", tap.time));
        }
        for mode in &recording.modes {
            let name = match (mode.mode, &mode.label) {
                (Some(number), _) => format!("mode {number}"),
                (None, Some(label)) => label.clone(),
                (None, None) => "no number".to_owned(),
            };
            let (frequency, method) = (significant(mode.frequency, 7), method_name(mode.method));
            text.push_str(&format!(
                "{file}: peak at {frequency} Hz ({method}), {name}\n"
            ));
        }
    }
    text
}

/// Renders all tables, each with its remarks, and a count of the verdicts.
pub fn render_reproduction(reproduction: &Reproduction, screen: Screen) -> String {
    let mut text = String::from(
        "The tables of Ingole & Chatterjee beside our numbers\n\n\
         reproduces: yes = equal within the row's tolerance (one unit in the last\n\
         printed digit, unless the rounding of the input is known to leave more);\n\
         rounding = different, but not beyond what that rounding does; NO (n) = see\n\
         remark n; given = measured or chosen, nothing to compute.\n",
    );
    for table in &reproduction.tables {
        text.push_str(&format!("\nTable {}: {}\n", table.number, table.title));
        text.push_str(&line("", "printed", "ours", "diff %", "reproduces"));
        let mut remarks: Vec<&str> = Vec::new();
        for row in &table.rows {
            let mut verdict = match row.verdict {
                Agreement::Reproduces => "yes",
                Agreement::WithinRounding => "rounding",
                Agreement::DoesNotReproduce => "NO",
                Agreement::Given => "given",
            }
            .to_owned();
            if let Some(remark) = row.remark {
                let known = remarks.iter().position(|known| *known == remark);
                let place = known.unwrap_or(remarks.len());
                if known.is_none() {
                    remarks.push(remark);
                }
                verdict = format!("{verdict} ({})", place + 1);
            }
            let ours = row.ours.map(|ours| row.printed.format_like(ours));
            let difference = match row.difference_percent() {
                None => String::new(),
                Some(percent) if percent.abs() >= 1000.0 => "> 1000".to_owned(),
                Some(percent) if percent.abs() >= 10.0 => format!("{percent:+.1}"),
                Some(percent) => format!("{percent:+.3}"),
            };
            let ours = ours.unwrap_or_default();
            text.push_str(&line(
                &row.label,
                &row.printed.text,
                &ours,
                &difference,
                &verdict,
            ));
        }
        for (index, remark) in remarks.iter().enumerate() {
            let number = format!("({})", index + 1);
            text.push_str(&screen.wrapped(&format!("{number} {remark}"), number.len() + 1));
        }
    }
    text.push_str(&format!(
        "\n{} rows reproduce, {} within the rounding of their input, {} do not,\n{} are given.\n",
        reproduction.count(Agreement::Reproduces),
        reproduction.count(Agreement::WithinRounding),
        reproduction.count(Agreement::DoesNotReproduce),
        reproduction.count(Agreement::Given),
    ));
    text
}

fn line(label: &str, printed: &str, ours: &str, difference: &str, verdict: &str) -> String {
    let line = format!("{label:<37}{printed:>10} {ours:>10} {difference:>8} {verdict}");
    format!("{}\n", line.trim_end())
}
