//! Tables and findings for a terminal of 80 columns, without colours.

use std::collections::BTreeSet;

use crate::document::{Document, EstimateSection, ReadBy, Timing, TimingsSection, method_name};
use crate::format::{MISSING, capital, or_missing, signed_percent, significant, trimmed};
use crate::short_names::ways;
use crate::tables::{self, Column, Place, Table, listed, number, words};
use crate::words::comparison::answer;
use crate::words::diagnosis::gap_story;
use crate::words::findings::{brief, no_estimate};
use crate::words::series;
use tapjoint_analysis::Stage;
use tapjoint_compare::DampingVerdict;
use tapjoint_study::publication::{Agreement, Reproduction};

/// Most taps listed one by one.
const MOST_TAPS: usize = 10;

/// Everything the document holds.
pub fn render_text(document: &Document) -> String {
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
        plain(tables::datasets(document)),
        joined([plain(tables::recordings(document)), plain(channels)]),
        joined(taps.map(plain)),
        noted(tables::hammer(document)),
        modes(document),
        noted(tables::frfs(document)),
        estimate(document),
        plain(tables::prediction(document)),
        noted(tables::lengths(document)),
        noted(tables::free_test(document)),
        gap(document),
        joined([
            plain(tables::perturbation(document)),
            plain(tables::averages(document)),
            noted(tables::spans(document)),
            noted(tables::sensitivity(document)),
            noted(tables::monte_carlo(document)),
        ]),
        // The ending counts all checks.
        plain(tables::quality_doubts(document)),
        warnings(document),
        ending(document),
    ])
}

/// The modes; empty without any, and where their frequency response functions are listed.
fn modes(document: &Document) -> String {
    let listed = document.frfs.as_ref().is_some_and(|frfs| !frfs.is_empty());
    let Some(table) = tables::modes(document).filter(|_| !listed) else {
        return String::new();
    };
    let mut text = render_table(&table);
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
             \u{b1} half line; damping \u{b1} one standard deviation.",
            tables::fitted_to(document),
        );
        text.push_str(&wrapped(&note, 0));
    }
    let more = [tables::left_out(document), tables::modes_from(document)];
    for sentence in more.into_iter().flatten() {
        text.push_str(&wrapped(&sentence, 0));
    }
    text
}

/// The estimate and how far its regression closes, or why there is none; empty where it was not
/// asked for.
fn estimate(document: &Document) -> String {
    let found = match &document.estimate {
        None => return String::new(),
        Some(None) => {
            let words = no_estimate(document).unwrap_or_default();
            return wrapped(&format!("{}.", capital(&words)), 0);
        }
        Some(Some(found)) => found,
    };
    let mut text = plain(tables::parameters(document));
    text.push_str(&strong_correlations(found));
    if let Some(words) = tables::set_up_words(found) {
        text.push_str(&wrapped(words.trim(), 0));
    }
    let beside = [tables::budget(document), tables::methods(document)];
    for table in beside.into_iter().flatten() {
        text.push('\n');
        text.push_str(&render_table(&table));
    }
    if let Some(closure) = found.pairs.as_ref().and_then(|pairs| pairs.closure) {
        let percent = signed_percent(Some(100.0 * closure));
        let words = format!(
            "From modes {}. Self-check of the pair regression (closure): {percent} %; 0 is perfect.",
            listed(&found.modes_used)
        );
        text.push_str(&wrapped(&words, 0));
    }
    for warning in document.warnings_beside() {
        let note = format!("note ({}): {}", warning.code, warning.text);
        text.push_str(&wrapped(&note, 2));
    }
    text
}

/// Correlations from here on are said: the data fix one combination of the two five times as well as the other.
const STRONG: f64 = 0.92;

/// Says which estimates the frequencies hardly tell apart; empty where they do.
fn strong_correlations(found: &EstimateSection) -> String {
    let strong = found
        .correlations
        .iter()
        .filter(|pair| pair.value.abs() >= STRONG);
    let words = strong.map(|one| {
        let (pair, value) = tables::correlation_words(one);
        let words = format!(
            "Correlation of {pair}: {value}; the frequencies tell a combination of the two rather than each."
        );
        wrapped(&words, 0)
    });
    words.collect()
}

/// The warnings that concern the result; empty without any. Those of the pair regression stand with it.
fn warnings(document: &Document) -> String {
    document
        .main_warnings()
        .map(|warning| wrapped(&format!("warning ({}): {}", warning.code, warning.text), 2))
        .collect()
}

/// The findings, in five lines at most (longer where a reason is given).
fn ending(document: &Document) -> String {
    let lines = brief(document);
    if lines.is_empty() {
        return String::new();
    }
    let lines = lines
        .iter()
        .map(|(about, words)| wrapped(&format!("{:\u{a0}<8}{words}", about), 8));
    format!("What was found\n{}", lines.collect::<String>())
}

/// A table without what its columns mean; empty without one.
fn plain(table: Option<Table>) -> String {
    table.as_ref().map_or_else(String::new, render_table)
}

/// A table with what its columns mean; empty without one.
fn noted(table: Option<Table>) -> String {
    table.map_or_else(String::new, |table| {
        render_table(&table) + &wrapped(&table.note, 0)
    })
}

/// Those of the parts that are not empty, with an empty line between them.
fn joined<const N: usize>(parts: [String; N]) -> String {
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join("\n")
}

/// The errors of the nominal model, the story of the gap, and the hypotheses.
pub fn render_gap_text(document: &Document) -> String {
    let prediction = plain(tables::prediction(document));
    joined([prediction, gap(document), warnings(document)])
}

/// Returns the control charts of a series with its answer, and what changed between two tests: the answer, the frequencies, and
/// the causes.
pub fn render_comparison(document: &Document) -> String {
    let lines = |sentences: Vec<String>| -> String {
        let wrapped = sentences.iter().map(|sentence| wrapped(sentence, 2));
        wrapped.collect()
    };
    let series = document.series.iter().flat_map(series::answer);
    let heading = match (&document.series, &document.compare) {
        (Some(_), Some(_)) => "Before and after:\n",
        _ => "",
    };
    let compared = document.compare.as_ref();
    let damping = compared.and_then(|compared| compared.found.damping.as_ref());
    let is_damped = damping.is_some_and(|found| found.verdict != DampingVerdict::NoChange);
    let tables = [
        tables::changed_modes(document),
        tables::changed_dampings(document).filter(|_| is_damped),
        tables::changes(document),
    ];
    joined([
        lines(series.collect()),
        noted(tables::control_charts(document)),
        format!("{heading}{}", lines(answer(document))),
        joined(tables.map(noted)),
        doubts(document),
    ])
}

/// Returns a line with the doubts about the readings; empty without any.
fn doubts(document: &Document) -> String {
    let codes: BTreeSet<&str> = document
        .warnings
        .iter()
        .map(|one| one.code.as_str())
        .collect();
    let codes: Vec<&str> = codes.into_iter().collect();
    match codes.as_slice() {
        [] => String::new(),
        codes => wrapped(
            &format!(
                "Doubts about the readings: {}. `tapjoint run` on each test explains them.",
                codes.join(", ")
            ),
            2,
        ),
    }
}

/// The story of the gap and the hypotheses; empty without a diagnosis.
fn gap(document: &Document) -> String {
    let story = gap_story(document);
    let story: Vec<String> = story.iter().map(|sentence| wrapped(sentence, 2)).collect();
    let tables = [tables::hypotheses(document), tables::next_tests(document)];
    joined([story.join("\n"), joined(tables.map(noted))])
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
pub fn render_timings(timings: &TimingsSection) -> String {
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
    render_table(&Table::of("Timings", rows, ""))
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

/// Width of the terminal (characters).
pub const WIDTH: usize = 80;

/// Space between columns (characters).
const GAP: usize = 2;
/// Narrowest a column of words is cut to (characters).
const NARROWEST: usize = 8;
/// A column of words this wide reads well (characters): names of files give way for no more.
const READABLE: usize = 24;
/// So many ways to shorten names leave out only what all of them share: these come before a column goes.
const GENTLE: usize = 3;
/// Most rows printed: a terminal is no place for a thousand taps.
const MOST_ROWS: usize = 40;

/// A table as it is printed.
struct Layout {
    table: Table,
    /// Lines of each column's head.
    heads: Vec<Vec<String>>,
    shown: Vec<Shown>,
}

/// A column that is printed.
#[derive(Clone, Copy)]
struct Shown {
    index: usize,
    /// Characters.
    width: usize,
}

/// Returns a table with its caption, in 80 columns.
///
/// Where it has no room, these steps follow each other until it fits:
/// 1. Heads go to two lines.
/// 2. Names of files are shortened, and still differ from each other.
/// 3. Columns that other outputs show are left out.
/// 4. Words go on below.
/// 5. Columns go on below.
///
/// Numbers are never cut.
pub fn render_table(table: &Table) -> String {
    let Layout {
        table,
        heads,
        shown,
    } = layout(table);
    let mut text = wrapped(&table.caption, 0);
    for part in parts(&shown) {
        text.push_str(&row(&table, &part, &heads));
        text.push_str(&"-".repeat(total(&part).min(WIDTH)));
        text.push('\n');
        for cells in table.rows.iter().take(MOST_ROWS) {
            let cells: Vec<Vec<String>> = cells.iter().map(|cell| vec![cell.clone()]).collect();
            text.push_str(&row(&table, &part, &cells));
        }
    }
    let more = table.rows.len().saturating_sub(MOST_ROWS);
    if more > 0 {
        text.push_str(&format!("... and {more} more\n"));
    }
    text
}

/// Returns the width of columns with the space between them.
fn total(shown: &[Shown]) -> usize {
    let widths = shown.iter().map(|column| column.width).sum::<usize>();
    widths + GAP * shown.len().saturating_sub(1)
}

/// Returns the columns in as many parts as have room side by side, each with the first column, which names the rows.
fn parts(shown: &[Shown]) -> Vec<Vec<Shown>> {
    let mut parts: Vec<Vec<Shown>> = Vec::new();
    for &column in shown {
        match parts.last_mut() {
            Some(part) if total(part) + GAP + column.width <= WIDTH => part.push(column),
            None => parts.push(vec![column]),
            Some(_) => parts.push(vec![shown[0], column]),
        }
    }
    parts
}

/// Returns the first layout that has room, in the order of what it costs.
fn layout(table: &Table) -> Layout {
    let mut named = with_short_names(table);
    let spacious = named.iter().take(GENTLE).map(|table| (table, true));
    for (table, spacious) in spacious.chain(named.iter().map(|table| (table, false))) {
        let names = table.columns.iter().map(|column| column.name.as_str());
        let one_line = names.clone().map(|name| vec![name.to_owned()]);
        // On two lines: its unit below its name, or its last word.
        let two_lines = names.map(|name| {
            let place = name.rfind(" (").or_else(|| name.rfind(' '));
            let (first, second) = name.split_at(place.unwrap_or(0));
            vec![first.to_owned(), second.trim_start().to_owned()]
        });
        for heads in [one_line.collect(), two_lines.collect::<Vec<_>>()] {
            let mut shown = natural_widths(table, &heads, spacious);
            let least = shown.iter().map(|column| {
                let head = &table.columns[column.index];
                match head.is_number || is_name(head) {
                    true => column.width,
                    false => column.width.min(READABLE),
                }
            });
            if least.sum::<usize>() <= room(shown.len()) {
                shrink(table, &mut shown);
                let table = table.clone();
                return Layout {
                    table,
                    heads,
                    shown,
                };
            }
        }
    }
    let table = named.pop().unwrap_or_else(|| table.clone());
    // Heads no wider than the cells below them, as far as their words allow, all on as many lines.
    let mut heads = Vec::new();
    for (index, column) in table.columns.iter().enumerate() {
        let cells = table.rows.iter().filter_map(|row| row.get(index));
        let words = column.name.split(' ').map(length);
        let width = cells.map(|cell| length(cell)).chain(words).max();
        heads.push(broken(&column.name, width.unwrap_or(0)));
    }
    let lines = heads.iter().map(Vec::len).max().unwrap_or(0);
    for head in &mut heads {
        head.splice(..0, vec![String::new(); lines - head.len()]);
    }
    let mut shown = natural_widths(&table, &heads, false);
    shrink(&table, &mut shown);
    Layout {
        table,
        heads,
        shown,
    }
}

/// Returns the table with its names of files as they are, then shorter and shorter.
fn with_short_names(table: &Table) -> Vec<Table> {
    let Some(index) = table.columns.iter().position(is_name) else {
        return vec![table.clone()];
    };
    let cells = table.rows.iter().filter_map(|row| row.get(index));
    let names: BTreeSet<&String> = cells.filter(|c| !c.is_empty() && *c != MISSING).collect();
    let names: Vec<String> = names.into_iter().cloned().collect();
    let mut tables = Vec::new();
    for way in ways(&names) {
        let mut table = table.clone();
        for cell in table.rows.iter_mut().filter_map(|row| row.get_mut(index)) {
            let place = names.iter().position(|name| name == cell);
            if let Some(short) = place.and_then(|place| way.get(place)) {
                cell.clone_from(short);
            }
        }
        if way != names {
            table.columns[index].name = "File".to_owned();
        }
        tables.push(table);
    }
    tables
}

/// Returns the characters that columns share.
fn room(columns: usize) -> usize {
    WIDTH.saturating_sub(GAP * columns.saturating_sub(1))
}

fn length(text: &str) -> usize {
    text.chars().count()
}

/// Returns the columns with widths that hold every head and cell on one line; with those that are left out where
/// there is no room, or without.
fn natural_widths(table: &Table, heads: &[Vec<String>], spacious: bool) -> Vec<Shown> {
    let mut shown = Vec::new();
    for (index, column) in table.columns.iter().enumerate() {
        if column.place == Place::Everywhere || spacious && column.place == Place::Spacious {
            let head = heads.get(index).into_iter().flatten();
            let rows = table.rows.iter().take(MOST_ROWS);
            let cells = rows.filter_map(|row| row.get(index));
            let width = head.chain(cells).map(|text| length(text)).max();
            let width = width.unwrap_or(0);
            shown.push(Shown { index, width });
        }
    }
    shown
}

/// Shrinks columns of words where they pass the terminal's width, names of files last.
fn shrink(table: &Table, shown: &mut [Shown]) {
    let room = room(shown.len());
    while shown.iter().map(|column| column.width).sum::<usize>() > room {
        let words = shown
            .iter_mut()
            .filter(|column| !table.columns[column.index].is_number && column.width > NARROWEST);
        let widest =
            words.max_by_key(|column| (!is_name(&table.columns[column.index]), column.width));
        match widest {
            Some(column) => column.width -= 1,
            None => break,
        }
    }
}

/// True for a column of names of files, which are shortened before they are broken.
fn is_name(column: &Column) -> bool {
    matches!(column.name.as_str(), "Recording" | "File")
}

/// Returns one row, on as many lines as its longest cell of words needs.
fn row(table: &Table, shown: &[Shown], cells: &[Vec<String>]) -> String {
    let mut columns: Vec<Vec<String>> = Vec::new();
    for column in shown {
        let cell = cells.get(column.index).into_iter().flatten();
        columns.push(match table.columns[column.index].is_number {
            true => cell.cloned().collect(),
            false => cell.flat_map(|text| broken(text, column.width)).collect(),
        });
    }
    let lines = columns.iter().map(Vec::len).max().unwrap_or(0);
    let mut text = String::new();
    for line in 0..lines {
        let mut padded = Vec::new();
        for (column, pieces) in shown.iter().zip(&columns) {
            let piece = pieces.get(line).map_or("", String::as_str);
            let (piece, width) = (piece.replace('\u{a0}', " "), column.width);
            padded.push(match table.columns[column.index].is_number {
                true => format!("{piece:>width$}"),
                false => format!("{piece:<width$}"),
            });
        }
        text.push_str(padded.join("  ").trim_end());
        text.push('\n');
    }
    text
}

/// Returns a text in lines of at most `width` characters, broken between words where that is possible.
fn broken(text: &str, width: usize) -> Vec<String> {
    // A number stays with its unit: "mains 50 Hz".
    let text = text.replace(" Hz", "\u{a0}Hz");
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let mut rest: Vec<char> = word.chars().collect();
        let used = lines.last().map_or(0, |line| length(line));
        if used > 0 && used + 1 + rest.len() <= width {
            if let Some(line) = lines.last_mut() {
                line.push(' ');
                line.extend(rest);
            }
            continue;
        }
        while !rest.is_empty() {
            let piece: String = rest.drain(..rest.len().min(width.max(1))).collect();
            match lines.last_mut() {
                Some(line) if line.is_empty() => line.push_str(&piece),
                _ => lines.push(piece),
            }
        }
    }
    lines
}

/// Returns a text broken into lines of at most 80 characters; lines after the first are indented.
pub fn wrapped(text: &str, indent: usize) -> String {
    let lines = lines_of(text, WIDTH, indent);
    // No-break spaces have kept words together; a terminal, and who searches it, wants plain ones.
    lines.join("\n").replace('\u{a0}', " ") + "\n"
}

/// Returns a text in lines of at most `width` characters; lines after the first are indented.
pub(super) fn lines_of(text: &str, width: usize, indent: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    // Lines are not broken at no-break spaces.
    let words = text.split(|c: char| c.is_whitespace() && c != '\u{a0}');
    for word in words.filter(|word| !word.is_empty()) {
        let mut word = word.to_owned();
        let room = width.saturating_sub(indent);
        if length(&word) > room {
            word = word.chars().take(room.saturating_sub(1)).collect();
            word.push('\u{2026}');
        }
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(&word),
            Some(line) if length(line) + 1 + length(&word) <= width => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(" ".repeat(indent) + &word),
        }
    }
    lines
}

/// Renders all tables, each with its remarks, and a count of the verdicts.
pub fn render_reproduction(reproduction: &Reproduction) -> String {
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
            text.push_str(&wrapped(&format!("{number} {remark}"), number.len() + 1));
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

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn regress_numbers_are_never_cut() {
        let column = |index: usize| Column {
            name: format!("0\u{2013}10000 Hz: spacing {index} (Hz)"),
            is_number: true,
            place: Place::Everywhere,
        };
        // Few enough for narrow heads, and too many for any.
        for count in [5, 9, 14] {
            let cell = |index: usize| format!("0.123456{index}");
            let table = Table {
                caption: "Wide".into(),
                columns: (10..10 + count).map(column).collect(),
                rows: vec![(10..10 + count).map(cell).collect()],
                note: String::new(),
            };
            let text = render_table(&table);
            assert!(!text.contains('\u{2026}'), "{text}");
            for index in 10..10 + count {
                assert!(text.contains(&cell(index)), "{index} of {count}:\n{text}");
            }
            for line in text.lines() {
                assert!(line.chars().count() <= 80, "{line}");
            }
        }
    }
}
