//! The walls between the stages, read from the source itself: who may import whom, and who may
//! print, read a clock or touch a file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Module and what it may import. The stages of measurement stand first, then theory, then where
/// the two meet.
const TABLE: &[(&str, &[&str])] = &[
    ("notation", &[]),
    ("references", &[]),
    ("quantity", &[]),
    ("description", &["quantity"]),
    ("recording", &["quantity"]),
    ("stats", &[]),
    ("taps", &["recording", "stats"]),
    ("spectral", &["recording", "taps", "stats"]),
    ("modal", &["recording", "taps", "spectral", "stats"]),
    (
        "quality",
        &["recording", "taps", "spectral", "modal", "stats"],
    ),
    ("structure", &["quantity"]),
    ("effects", &["structure", "quantity", "stats"]),
    ("identify", &["modal", "stats", "structure"]),
    ("described", &["description", "structure"]),
    (
        "gap",
        &["identify", "modal", "stats", "structure", "effects"],
    ),
    (
        "simulate",
        &[
            "quantity",
            "described",
            "description",
            "recording",
            "structure",
            "effects",
            "stats",
        ],
    ),
    (
        "pipeline",
        &[
            "quantity",
            "described",
            "description",
            "recording",
            "taps",
            "spectral",
            "modal",
            "quality",
            "structure",
            "identify",
            "gap",
            "stats",
        ],
    ),
    (
        "study",
        &[
            "description",
            "effects",
            "gap",
            "identify",
            "modal",
            "pipeline",
            "simulate",
            "spectral",
            "stats",
            "structure",
        ],
    ),
    (
        "report",
        &[
            "quantity",
            "description",
            "recording",
            "taps",
            "spectral",
            "modal",
            "quality",
            "structure",
            "effects",
            "identify",
            "gap",
            "pipeline",
            "study",
            "stats",
        ],
    ),
];

const MEASUREMENT: &[&str] = &["recording", "taps", "spectral", "modal", "quality"];
const THEORY: &[&str] = &["structure"];

/// Modules above the library, which may do everything.
const COMMAND_LINE: &[&str] = &["cli", "main", "lib"];

/// Words that must not occur below the command line, why, and which module may use them.
const FORBIDDEN: &[(&[&str], &str, Option<&str>)] = &[
    (
        &["println!", "eprintln!", "print!", "eprint!", "dbg!"],
        "prints: return the text, a warning or an error, and let the command line print it",
        None,
    ),
    (
        &["stdin", "stdout", "stderr"],
        "uses a standard stream: only the command line does",
        None,
    ),
    (
        &["std::time", "Instant", "SystemTime"],
        "reads a clock: the same input must give the same output",
        None,
    ),
    (
        &["std::env", "std::process"],
        "reads the environment or ends the process: make it an argument or an error",
        None,
    ),
    (
        &["thread_rng", "from_os_rng", "ThreadRng"],
        "draws unseeded random numbers: take a seed",
        None,
    ),
    (
        &["std::fs", "File", "OpenOptions"],
        "touches files: take text or a Recording, and return text",
        Some("recording"),
    ),
];

/// Lines of a source file before its tests.
const MOST_LINES: usize = 400;

// ---------------------------------------------------------------------------------------------
// The source as tokens

/// A word or a punctuation mark of the code, with its line.
#[derive(Debug, Clone, PartialEq)]
struct Token {
    text: String,
    line: usize,
}

/// A source file of the library.
struct Source {
    /// Path below `src`.
    path: PathBuf,
    /// Its modules from the crate's root, "taps", "hammer".
    modules: Vec<String>,
    tokens: Vec<Token>,
}

impl Source {
    fn new(path: &str, text: &str) -> Self {
        let path = PathBuf::from(path);
        let mut modules: Vec<String> = path
            .with_extension("")
            .iter()
            .map(|part| part.to_string_lossy().into_owned())
            .collect();
        if modules.last().is_some_and(|last| last == "mod") {
            modules.pop();
        }
        Source {
            path,
            modules,
            tokens: without_tests(&tokens(&code_only(text))),
        }
    }

    fn stage(&self) -> &str {
        &self.modules[0]
    }

    fn place(&self, token: &Token) -> String {
        format!("src/{}:{}", self.path.display(), token.line)
    }

    fn word(&self, index: usize) -> &str {
        self.tokens.get(index).map_or("", |token| &token.text)
    }

    /// The names that follow `root::` at `index` (the place after the root): one, or those of a
    /// group in braces.
    fn names_after(&self, index: usize) -> Vec<Token> {
        if self.word(index) != "::" {
            return Vec::new();
        }
        if self.word(index + 1) != "{" {
            return self.tokens.get(index + 1).cloned().into_iter().collect();
        }
        let mut names = Vec::new();
        let mut depth = 1;
        let mut begins = true;
        for token in &self.tokens[index + 2..] {
            match token.text.as_str() {
                "{" => depth += 1,
                "}" => depth -= 1,
                _ if begins && depth == 1 => names.push(token.clone()),
                _ => {}
            }
            begins = depth == 1 && token.text == ",";
            if depth == 0 {
                break;
            }
        }
        names
    }

    /// Names taken from the crate's root: `crate::name`, and `super::super::name` that climbs there.
    fn names_from_root(&self) -> Vec<Token> {
        let mut names = Vec::new();
        for index in 0..self.tokens.len() {
            match self.word(index) {
                "crate" => names.extend(self.names_after(index + 1)),
                "super" if index < 2 || self.word(index - 2) != "super" => {
                    let climbs = (0..)
                        .take_while(|k| self.word(index + 2 * k) == "super")
                        .count();
                    if climbs >= self.modules.len() {
                        names.extend(self.names_after(index + 2 * climbs - 1));
                    }
                }
                _ => {}
            }
        }
        names
    }

    /// Whether `pattern` begins at `index`: a word, a macro's name with its mark, or a path, which
    /// also matches inside a group.
    fn uses(&self, index: usize, pattern: &str) -> bool {
        if let Some(name) = pattern.strip_suffix('!') {
            return self.word(index) == name && self.word(index + 1) == "!";
        }
        match pattern.split_once("::") {
            None => self.word(index) == pattern,
            Some((root, name)) => {
                self.word(index) == root
                    && self
                        .names_after(index + 1)
                        .iter()
                        .any(|token| token.text == name)
            }
        }
    }
}

/// The text with comments, strings and characters blanked, line breaks kept.
fn code_only(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let mut code = String::with_capacity(text.len());
    let mut at = 0;
    while at < chars.len() {
        let end = skipped(&chars, at);
        if end > at {
            code.push(' ');
            code.extend(chars[at..end].iter().filter(|&&c| c == '\n'));
            at = end;
        } else {
            code.push(chars[at]);
            at += 1;
        }
    }
    code
}

/// End of the comment, string or character that begins at `at`; `at` itself where none does.
fn skipped(chars: &[char], at: usize) -> usize {
    let next = |k: usize| chars.get(at + k).copied().unwrap_or('\0');
    let after_word = at > 0 && is_word(chars[at - 1]);
    match chars[at] {
        '/' if next(1) == '/' => find(chars, at, |k| chars[k] == '\n'),
        '/' if next(1) == '*' => end_of_block_comment(chars, at),
        '"' => end_of_string(chars, at),
        'r' if !after_word || chars[at - 1] == 'b' => end_of_raw_string(chars, at),
        '\'' if next(1) == '\\' => find(chars, at + 3, |k| chars[k] == '\'') + 1,
        // 'x' is a character, 'x without the second quote a lifetime.
        '\'' if next(2) == '\'' => at + 3,
        _ => at,
    }
    .min(chars.len())
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn find(chars: &[char], from: usize, found: impl Fn(usize) -> bool) -> usize {
    (from..chars.len())
        .find(|&k| found(k))
        .unwrap_or(chars.len())
}

fn end_of_string(chars: &[char], at: usize) -> usize {
    let mut k = at + 1;
    while k < chars.len() && chars[k] != '"' {
        k += if chars[k] == '\\' { 2 } else { 1 };
    }
    k + 1
}

fn end_of_raw_string(chars: &[char], at: usize) -> usize {
    let hashes = chars[at + 1..].iter().take_while(|&&c| c == '#').count();
    if chars.get(at + 1 + hashes) != Some(&'"') {
        return at;
    }
    let closes = |k: usize| {
        chars[k] == '"' && chars[k + 1..].iter().take_while(|&&c| c == '#').count() >= hashes
    };
    find(chars, at + 2 + hashes, closes) + 1 + hashes
}

/// Block comments nest.
fn end_of_block_comment(chars: &[char], at: usize) -> usize {
    let mut depth = 0;
    let mut k = at;
    while k + 1 < chars.len() {
        match (chars[k], chars[k + 1]) {
            ('/', '*') => (depth, k) = (depth + 1, k + 2),
            ('*', '/') => (depth, k) = (depth - 1, k + 2),
            _ => k += 1,
        }
        if depth == 0 {
            return k;
        }
    }
    chars.len()
}

fn tokens(code: &str) -> Vec<Token> {
    let mut tokens: Vec<Token> = Vec::new();
    for (index, line) in code.lines().enumerate() {
        let mut rest = line.trim_start();
        while let Some(first) = rest.chars().next() {
            let length = if is_word(first) {
                rest.find(|c| !is_word(c)).unwrap_or(rest.len())
            } else if rest.starts_with("::") {
                2
            } else {
                first.len_utf8()
            };
            tokens.push(Token {
                text: rest[..length].to_string(),
                line: index + 1,
            });
            rest = rest[length..].trim_start();
        }
    }
    tokens
}

/// The tokens without items that exist in tests only: `#[cfg(test)]` or `#[test]`, and what follows
/// up to its closing brace or semicolon.
fn without_tests(tokens: &[Token]) -> Vec<Token> {
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        match attribute_end(tokens, at) {
            Some(end) if is_test_attribute(&tokens[at..end]) => at = item_end(tokens, end),
            Some(end) => {
                kept.extend_from_slice(&tokens[at..end]);
                at = end;
            }
            None => {
                kept.push(tokens[at].clone());
                at += 1;
            }
        }
    }
    kept
}

/// End of the attribute `#[...]` that begins at `at`.
fn attribute_end(tokens: &[Token], at: usize) -> Option<usize> {
    let is = |k: usize, text: &str| tokens.get(k).is_some_and(|token| token.text == text);
    (is(at, "#") && is(at + 1, "[")).then(|| balanced_end(tokens, at + 1, "[", "]"))
}

fn is_test_attribute(attribute: &[Token]) -> bool {
    let has = |text: &str| attribute.iter().any(|token| token.text == text);
    let starts = |text: &str| attribute.get(2).is_some_and(|token| token.text == text);
    starts("test") || (starts("cfg") && has("test") && !has("not"))
}

fn item_end(tokens: &[Token], from: usize) -> usize {
    for at in from..tokens.len() {
        match tokens[at].text.as_str() {
            "{" => return balanced_end(tokens, at, "{", "}"),
            ";" => return at + 1,
            _ => {}
        }
    }
    tokens.len()
}

/// Place after the bracket that closes the one at `from`.
fn balanced_end(tokens: &[Token], from: usize, open: &str, close: &str) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(from) {
        if token.text == open {
            depth += 1;
        } else if token.text == close {
            depth -= 1;
        }
        if depth == 0 {
            return at + 1;
        }
    }
    tokens.len()
}

// ---------------------------------------------------------------------------------------------
// What is checked

/// Violations of the import table.
fn import_violations(sources: &[Source]) -> Vec<String> {
    let modules: BTreeSet<&str> = sources.iter().map(Source::stage).collect();
    let mut violations = Vec::new();
    for source in sources {
        let stage = source.stage();
        if COMMAND_LINE.contains(&stage) {
            continue;
        }
        let Some((_, allowed)) = TABLE.iter().find(|(name, _)| *name == stage) else {
            violations.push(format!(
                "src/{}: the module `{stage}` is not in the import table: add a row to TABLE in \
                 tests/it/layers.rs that names what it may import, and a line to ARCHITECTURE.md",
                source.path.display()
            ));
            continue;
        };
        for name in source.names_from_root() {
            let imported = name.text.as_str();
            if imported == stage || allowed.contains(&imported) {
                continue;
            }
            violations.push(if modules.contains(imported) {
                format!(
                    "{}: `{stage}` imports `{imported}`, and may import only {allowed:?}: move the \
                     code to where both are known, or pass plain data",
                    source.place(&name)
                )
            } else {
                format!(
                    "{}: `{imported}` is taken from the crate's root: name its module, so that the \
                     import table sees it",
                    source.place(&name)
                )
            });
        }
    }
    violations
}

/// Forbidden words below the command line.
fn side_effects(sources: &[Source]) -> Vec<String> {
    let mut violations = Vec::new();
    let below = |source: &&Source| !COMMAND_LINE.contains(&source.stage());
    for source in sources.iter().filter(below) {
        for (patterns, reason, excepted) in FORBIDDEN {
            if *excepted == Some(source.stage()) {
                continue;
            }
            for (index, token) in source.tokens.iter().enumerate() {
                for pattern in patterns.iter().filter(|p| source.uses(index, p)) {
                    violations.push(format!("{}: `{pattern}` {reason}", source.place(token)));
                }
            }
        }
    }
    violations
}

/// Everything that each module reaches through its imports.
fn reachable(sources: &[Source]) -> BTreeMap<String, BTreeSet<String>> {
    let mut reach: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for source in sources {
        let names = source.names_from_root().into_iter().map(|name| name.text);
        reach
            .entry(source.stage().to_string())
            .or_default()
            .extend(names);
    }
    loop {
        let before = reach.clone();
        for reached in reach.values_mut() {
            let further: Vec<String> = reached
                .iter()
                .filter_map(|name| before.get(name))
                .flatten()
                .cloned()
                .collect();
            reached.extend(further);
        }
        if reach == before {
            return reach;
        }
    }
}

/// Lines of a source before its unit tests.
fn lines_before_tests(text: &str) -> usize {
    let lines: Vec<&str> = text.lines().collect();
    (0..lines.len())
        .find(|&k| {
            lines[k] == "#[cfg(test)]" && lines.get(k + 1).is_some_and(|l| l.starts_with("mod "))
        })
        .unwrap_or(lines.len())
}

/// Lines (from 1) that hold a path of one machine: a home folder, a work folder, or a folder beside
/// the project.
fn machine_paths(text: &str) -> Vec<usize> {
    // Put together here, so that this file passes its own test.
    let folders = ["home", "Users", "root", "work"].map(|folder| format!("/{folder}"));
    let elsewhere = [["../", "shared"].concat(), [r"C:\", "Users"].concat()];
    let is_path = |line: &str, folder: &str| {
        line.match_indices(folder).any(|(at, _)| {
            let before = line[..at].chars().next_back();
            let after = line[at + folder.len()..].chars().next();
            let starts = !before.is_some_and(|c| is_word(c) || "./-~}*)>".contains(c));
            starts && !after.is_some_and(|c| is_word(c) || c == '-')
        })
    };
    let holds = |line: &str| {
        folders.iter().any(|folder| is_path(line, folder))
            || elsewhere.iter().any(|folder| line.contains(folder))
    };
    (1..)
        .zip(text.lines())
        .filter(|(_, line)| holds(line))
        .map(|(number, _)| number)
        .collect()
}

// ---------------------------------------------------------------------------------------------
// Reading the repository

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All files below a folder, without what the tools and the program itself leave behind.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for entry in entries.map(|entry| entry.expect("a readable folder")) {
        let name = entry.file_name().to_string_lossy().into_owned();
        if ["target", ".git", "__pycache__"].contains(&name.as_str()) || name.ends_with("-report") {
            continue;
        }
        match entry.path().is_dir() {
            true => found.extend(files(&entry.path())),
            false => found.push(entry.path()),
        }
    }
    found.sort();
    found
}

fn below_root(path: &Path) -> String {
    let path = path.strip_prefix(root()).expect("a path below the root");
    path.to_string_lossy().replace('\\', "/")
}

/// Path below `src` and text of every source file.
fn source_texts() -> Vec<(String, String)> {
    let src = root().join("src");
    files(&src)
        .into_iter()
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .map(|path| {
            let name = below_root(&path).trim_start_matches("src/").to_string();
            (name, fs::read_to_string(&path).expect("a source in UTF-8"))
        })
        .collect()
}

fn sources() -> Vec<Source> {
    let sources: Vec<Source> = source_texts()
        .iter()
        .map(|(path, text)| Source::new(path, text))
        .collect();
    assert!(sources.len() > 10, "only {} sources found", sources.len());
    sources
}

fn assert_none(violations: &[String]) {
    assert!(violations.is_empty(), "\n{}\n", violations.join("\n"));
}

// ---------------------------------------------------------------------------------------------
// The tests

#[test]
fn prop_modules_import_only_what_the_table_allows() {
    assert_none(&import_violations(&sources()));
}

#[test]
fn prop_every_row_of_the_table_is_a_module() {
    let sources = sources();
    for (module, allowed) in TABLE {
        for name in std::iter::once(module).chain(*allowed) {
            assert!(
                sources.iter().any(|source| source.stage() == *name),
                "the import table names `{name}` (row `{module}`), and there is no such module"
            );
        }
    }
}

#[test]
fn prop_measurement_and_theory_never_reach_each_other() {
    let reach = reachable(&sources());
    for (from, to) in [(MEASUREMENT, THEORY), (THEORY, MEASUREMENT)] {
        for (module, other) in from.iter().flat_map(|m| to.iter().map(move |o| (m, o))) {
            assert!(
                !reach[*module].contains(*other),
                "`{module}` reaches `{other}`, perhaps through another module: {:?}",
                reach[*module]
            );
        }
    }
    // The scan sees imports at all: the two sides meet in the pipeline.
    for module in MEASUREMENT.iter().chain(THEORY) {
        let meets = reach["identify"].contains(*module) || reach["pipeline"].contains(*module);
        assert!(meets, "neither identify nor pipeline imports `{module}`");
    }
}

#[test]
fn prop_only_simulation_and_study_know_the_simulator() {
    for (module, reached) in reachable(&sources()) {
        let may = ["simulate", "study"].contains(&module.as_str())
            || COMMAND_LINE.contains(&module.as_str())
            // A report of a study reaches what the study used, and nothing else does.
            || (module == "report" && reached.contains("study"));
        assert!(
            may || !reached.contains("simulate"),
            "`{module}` reaches the simulator: an analysis must not know how its data were made"
        );
    }
}

#[test]
fn prop_nothing_below_the_command_line_prints_reads_a_clock_or_touches_files() {
    assert_none(&side_effects(&sources()));
}

#[test]
fn limit_no_source_file_is_longer_than_400_lines() {
    let long: Vec<String> = source_texts()
        .iter()
        .map(|(path, text)| (path, lines_before_tests(text)))
        .filter(|(_, lines)| *lines > MOST_LINES)
        .map(|(path, lines)| {
            format!("src/{path} has {lines} lines before its tests: split it by meaning")
        })
        .collect();
    assert_none(&long);
}

#[test]
fn prop_no_file_names_a_path_of_one_machine() {
    let mut texts = 0;
    let mut found = Vec::new();
    for path in files(root()) {
        // The one place where the folder beside the project may be written.
        let name = below_root(&path);
        if name == ".ci/run" {
            continue;
        }
        let Ok(text) = String::from_utf8(fs::read(&path).expect("a readable file")) else {
            continue;
        };
        texts += 1;
        for line in machine_paths(&text) {
            found.push(format!(
                "{name}:{line}: a path of one machine; take it from an argument or from TAPJOINT_DATA"
            ));
        }
    }
    assert!(texts > 10, "only {texts} text files found");
    assert_none(&found);
}

/// Where a text is planted, the text, and what must be said about it.
const PLANTED: &[(&str, &str, &str)] = &[
    (
        "modal/mod.rs",
        "fn f() { g(crate::structure::h()) }",
        "structure",
    ),
    ("taps/mod.rs", "use crate::structure::Beam;", "structure"),
    (
        "taps.rs",
        "use crate::{recording::Recording, modal::{A, B}};",
        "modal",
    ),
    (
        "taps/hammer.rs",
        "use super::super::structure::Beam;",
        "structure",
    ),
    (
        "spectral/mod.rs",
        "fn f() { super::identify::run() }",
        "identify",
    ),
    (
        "structure/beam.rs",
        "fn f(x: &'a crate :: spectral::Lines) {}",
        "spectral",
    ),
    ("identify/mod.rs", "use crate::Recording;", "crate's root"),
    ("vibes/mod.rs", "", "not in the import table"),
    ("modal/mod.rs", "fn f() { println!(\"\") }", "println"),
    (
        "modal/mod.rs",
        "use std::{fmt, time::Duration};",
        "std::time",
    ),
    (
        "report/html.rs",
        "fn f() { std::fs::write(a, b); }",
        "std::fs",
    ),
    (
        "pipeline/mod.rs",
        "#[cfg(not(test))] use std::env;",
        "std::env",
    ),
    (
        "structure/mod.rs",
        "fn f(c: char) { if c == '\"' { dbg!(c) } }",
        "dbg",
    ),
    (
        "structure/mod.rs",
        "#[cfg(test)] mod t { fn f() {} } use std::fs;",
        "std::fs",
    ),
    (
        "modal/mod.rs",
        "const A: &str = r#\"\"#; use crate::structure::B;",
        "structure",
    ),
];

/// Texts that break no rule.
const CLEAN: &[(&str, &str)] = &[
    (
        "taps/mod.rs",
        "// use crate::structure::Beam;\n/* println!() /* dbg!() */ */",
    ),
    (
        "taps/mod.rs",
        "/// `std::fs`\nconst A: &str = \"crate::structure \\\" println!\";",
    ),
    (
        "taps/mod.rs",
        "#[cfg(test)]\nmod tests { use crate::structure::Beam; }",
    ),
    ("taps/mod.rs", "#[test] fn f() { println!() }"),
    (
        "taps/hammer.rs",
        "use super::judge::A; pub(crate) fn f<'a>(x: &'a str) {}",
    ),
    (
        "taps/mod.rs",
        "use crate::recording::{Recording, structure}; mod structure;",
    ),
    ("recording/wav.rs", "use std::fs::File;"),
    (
        "report/mod.rs",
        "impl Page { fn print(&self) { self.print() } }",
    ),
    (
        "cli/run.rs",
        "use std::{env, fs, time}; fn f() { println!() }",
    ),
];

/// The checker must be able to fail: each planted text has exactly one violation, and the clean
/// ones have none.
#[test]
fn prop_the_checker_finds_what_is_planted() {
    for (path, text, expected) in PLANTED {
        let found = violations_with(path, text);
        assert_eq!(found.len(), 1, "{path}: {text}: {found:?}");
        assert!(found[0].contains(expected), "{path}: {text}: {found:?}");
    }
    for (path, text) in CLEAN {
        let found = violations_with(path, text);
        assert!(found.is_empty(), "{path}: {text}: {found:?}");
    }
}

/// Violations in a library of empty modules and this one source.
fn violations_with(path: &str, text: &str) -> Vec<String> {
    let mut sources: Vec<Source> = TABLE
        .iter()
        .map(|(module, _)| Source::new(&format!("{module}.rs"), ""))
        .collect();
    sources.push(Source::new(path, text));
    let mut found = import_violations(&sources);
    found.extend(side_effects(&sources));
    found
}

#[test]
fn prop_the_path_checker_finds_what_is_planted() {
    let home = ["/", "home", "/me/x.wav"].concat();
    for text in [
        format!("let d = \"{home}\";"),
        ["see /", "work/data"].concat(),
        ["`../", "shared/data`"].concat(),
    ] {
        assert_eq!(machine_paths(&format!("\n{text}")), [2], "{text}");
    }
    for text in [
        "https://example.org/home/page",
        "src/home/mod.rs and/or ./home",
        "https://example.org/~me/root",
        "the frame/work ratio",
        "/workload /rooted",
    ] {
        assert!(machine_paths(text).is_empty(), "{text}");
    }
}

#[test]
fn prop_lines_are_counted_up_to_the_tests() {
    let code = "fn f() {}\n".repeat(3);
    assert_eq!(lines_before_tests(&code), 3);
    let tested = format!("{code}#[cfg(test)]\nmod tests {{\n}}\n");
    assert_eq!(lines_before_tests(&tested), 3);
    let used = format!("#[cfg(test)]\nuse x;\n{code}");
    assert_eq!(lines_before_tests(&used), 5);
}
