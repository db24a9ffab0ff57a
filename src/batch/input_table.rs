//! The input table: a row for each recording, with what differs between the tests.

use crate::table_file::WITHOUT_PARQUET;
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;
use tapjoint_description::{DescriptionError, TestDescription};
use toml::{Table, Value};

/// Keys that a column may name alone, and the table of the description that each belongs to.
const SHORT_KEYS: [(&str, &str); 11] = [
    ("length", "beam"),
    ("width", "beam"),
    ("thickness", "beam"),
    ("modulus", "beam"),
    ("density", "beam"),
    ("poisson", "beam"),
    ("mass", "beam"),
    ("bar_length", "beam"),
    ("kt", "joint"),
    ("kr", "joint"),
    ("ktr", "joint"),
];

/// Tables of a description, with which the name of a column with dots begins.
const TABLES: [&str; 9] = [
    "beam",
    "joint",
    "hammer",
    "sensor",
    "recording",
    "measured",
    "analysis",
    "effect",
    "sheet",
];

/// First bytes of a Parquet file.
const PARQUET: &[u8] = b"PAR1";

/// Column with the names of the recordings or descriptions.
const FILE: &str = "file";

/// A problem of an input table. Displays as `FILE:LINE: problem`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableError {
    /// The table, as the caller named it.
    pub file: String,
    /// The line, counted from 1.
    pub line: u64,
    /// The problem there, what is allowed, and the remedy.
    pub problem: String,
}

impl fmt::Display for TableError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}:{}: {}", self.file, self.line, self.problem)
    }
}

impl std::error::Error for TableError {}

/// A table of what differs between tests.
#[derive(Debug, Clone)]
pub struct InputTable {
    name: String,
    file: usize,
    /// Columns that set a key of the description.
    keys: Vec<KeyColumn>,
    carried: Vec<usize>,
    heads: Vec<String>,
    rows: Vec<csv::StringRecord>,
}

/// A column that sets a key of the description.
#[derive(Debug, Clone)]
struct KeyColumn {
    column: usize,
    /// Way to the key: "beam", "length".
    path: Vec<String>,
}

impl KeyColumn {
    /// Returns the last part of the key.
    fn last(&self) -> &str {
        self.path.last().map_or("", String::as_str)
    }

    /// Returns true if a problem may belong to this key. Problems number the tables of a list: `sensor[2].name`.
    fn is_of(&self, problem: &DescriptionError) -> bool {
        let first = problem.key.split(['.', '[']).next();
        let last = problem.key.rsplit('.').next();
        first == self.path.first().map(String::as_str) && last == Some(self.last())
    }
}

impl InputTable {
    /// Reads a table of comma separated values; semicolons and tabs separate as well. Messages call it `name`.
    ///
    /// With the feature `parquet` it may be a Parquet file. Its rows then count as lines, after a line of heads.
    ///
    /// # Errors
    /// A Parquet file cannot be read. A line has another number of cells than the first. The column `file` is missing, a column
    /// stands twice, or a name is empty. There are more than `most` rows.
    pub fn parse(bytes: &[u8], name: &str, most: usize) -> Result<Self, TableError> {
        let error = |line: u64, problem: String| TableError {
            file: name.to_owned(),
            line,
            problem,
        };
        #[cfg(feature = "parquet")]
        let text = match bytes.starts_with(PARQUET) {
            true => crate::parquet_table::csv_of(bytes).map_err(|problem| error(1, problem))?,
            false => Vec::new(),
        };
        #[cfg(feature = "parquet")]
        let bytes = if text.is_empty() { bytes } else { &text };
        if bytes.starts_with(PARQUET) {
            let problem = format!("is a Parquet file; {WITHOUT_PARQUET}, or save the table as CSV");
            return Err(error(1, problem));
        }
        let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        let first = bytes
            .split(|byte| *byte == b'\n')
            .next()
            .unwrap_or_default();
        let separators = [b',', b';', b'\t'].into_iter();
        let separator = separators.max_by_key(|one| {
            // Of separators that are equally frequent the comma is taken.
            let count = first.iter().filter(|byte| *byte == one).count();
            (count, *one == b',')
        });
        let mut reader = csv::ReaderBuilder::new();
        let mut reader = reader
            .delimiter(separator.unwrap_or(b','))
            .trim(csv::Trim::All)
            .from_reader(bytes);
        let at = |problem: csv::Error| {
            let line = problem.position().map_or(1, csv::Position::line);
            let words = match problem.kind() {
                csv::ErrorKind::UnequalLengths {
                    expected_len, len, ..
                } => format!(
                    "{len} cells, but the first line names {expected_len} columns; give each row a cell for each column"
                ),
                csv::ErrorKind::Utf8 { .. } => "not UTF-8 text; save the table as UTF-8".to_owned(),
                _ => format!("cannot be read: {problem}"),
            };
            error(line, words)
        };
        let heads: Vec<String> = reader
            .headers()
            .map_err(at)?
            .iter()
            .map(str::to_owned)
            .collect();
        let mut table = Self {
            name: name.to_owned(),
            file: usize::MAX,
            keys: Vec::new(),
            carried: Vec::new(),
            heads,
            rows: Vec::new(),
        };
        table.place_columns()?;
        for row in reader.into_records() {
            let row = row.map_err(at)?;
            let line = row.position().map_or(1, csv::Position::line);
            if row.get(table.file).unwrap_or_default().is_empty() {
                let problem = "no file; name a recording or a description in the column `file`";
                return Err(error(line, problem.to_owned()));
            }
            if table.rows.len() >= most {
                let problem = format!("more than {most} rows; give fewer, or several tables");
                return Err(error(line, problem));
            }
            table.rows.push(row);
        }
        Ok(table)
    }

    /// Finds out what each column is for.
    fn place_columns(&mut self) -> Result<(), TableError> {
        let error = |problem: String| TableError {
            file: self.name.clone(),
            line: 1,
            problem,
        };
        for (column, head) in self.heads.iter().enumerate() {
            if self.heads[..column].contains(head) {
                return Err(error(format!(
                    "the column `{head}` stands twice; remove or rename one"
                )));
            }
            let short = SHORT_KEYS.iter().find(|(key, _)| key == head);
            let (table, _) = head.split_once('.').unwrap_or_default();
            let path = match short {
                Some((key, table)) => vec![(*table).to_owned(), (*key).to_owned()],
                None if head == "name" => vec![head.clone()],
                None if TABLES.contains(&table) => head.split('.').map(str::to_owned).collect(),
                None if head == FILE => {
                    self.file = column;
                    continue;
                }
                None => {
                    self.carried.push(column);
                    continue;
                }
            };
            self.keys.push(KeyColumn { column, path });
        }
        match self.file {
            usize::MAX => Err(error(format!(
                "no column `{FILE}`; name the recordings or descriptions in a column of this name"
            ))),
            _ => Ok(()),
        }
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Returns true if there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Returns the name of the recording or description in a row (0-based); empty beyond the last.
    pub fn file(&self, row: usize) -> &str {
        self.cell(row, self.file)
    }

    /// Returns the heads of the columns that are carried into the output.
    pub fn carried_heads(&self) -> Vec<String> {
        let carried = self.carried.iter();
        carried.map(|column| self.heads[*column].clone()).collect()
    }

    /// Returns the cells of a row that are carried into the output.
    pub fn carried(&self, row: usize) -> Vec<String> {
        let carried = self.carried.iter();
        carried
            .map(|column| self.cell(row, *column).to_owned())
            .collect()
    }

    /// Returns true if a row sets keys of the description.
    pub fn changes(&self, row: usize) -> bool {
        let mut keys = self.keys.iter();
        keys.any(|key| !self.cell(row, key.column).is_empty())
    }

    fn cell(&self, row: usize, column: usize) -> &str {
        let row = self.rows.get(row);
        row.and_then(|row| row.get(column)).unwrap_or_default()
    }

    /// Returns true if a column names files of the description.
    pub fn names_files(&self) -> bool {
        let mut keys = self.keys.iter();
        keys.any(|key| matches!(key.last(), "file" | "files" | "free_test"))
    }

    /// Refuses columns that name the recordings of a description: the column `file` does.
    ///
    /// # Errors
    /// There is such a column.
    pub fn check_sets_no_recording(&self) -> Result<(), TableError> {
        let mut keys = self.keys.iter();
        let found = keys.find(|key| {
            key.path.first().is_some_and(|table| table == "recording")
                && matches!(key.last(), "file" | "files")
        });
        match found {
            None => Ok(()),
            Some(key) => Err(TableError {
                file: self.name.clone(),
                line: 1,
                problem: format!(
                    "the column `{}` names recordings, and with --test the column `{FILE}` does; remove it",
                    self.heads[key.column]
                ),
            }),
        }
    }

    /// Returns a description with the keys that a row sets. Empty cells leave the description as it is. `text` is the valid
    /// description, `file` its name. The second value is the text of the changed description.
    ///
    /// # Errors
    /// A key that the description cannot have, or a value that is not allowed there.
    pub fn described(
        &self,
        row: usize,
        text: &str,
        file: &str,
    ) -> Result<(TestDescription, String), TableError> {
        let line = self.rows.get(row).and_then(csv::StringRecord::position);
        let error = |problem: String| TableError {
            file: self.name.clone(),
            line: line.map_or(1, csv::Position::line),
            problem,
        };
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let described: Table = text
            .parse()
            .map_err(|problem: toml::de::Error| error(format!("{file}: {}", problem.message())))?;
        // Columns whose cells are taken as text, and why: a name may look like a number, as 17 does.
        let mut texts: BTreeMap<usize, DescriptionError> = BTreeMap::new();
        loop {
            let mut table = described.clone();
            for key in &self.keys {
                let cell = self.cell(row, key.column);
                let value = match texts.contains_key(&key.column) {
                    _ if cell.is_empty() => continue,
                    true => Value::String(cell.to_owned()),
                    false => value_of(cell),
                };
                set(&mut table, &key.path, &value).map_err(|missing| {
                    error(format!(
                        "`{}`: {file} has no {missing}; add it there, or remove the column",
                        self.heads[key.column]
                    ))
                })?;
            }
            let changed = toml::to_string(&table).map_err(|problem| error(problem.to_string()))?;
            let problem = match TestDescription::parse(&changed, file) {
                Ok(test) => return Ok((test, changed)),
                Err(problem) => problem,
            };
            let mut own = self.keys.iter().filter(|key| key.is_of(&problem));
            let is_number = |key: &&KeyColumn| {
                let cell = self.cell(row, key.column);
                !texts.contains_key(&key.column) && !cell.is_empty() && !value_of(cell).is_str()
            };
            match own.clone().find(is_number) {
                Some(key) => texts.insert(key.column, problem),
                // What was wrong with the number says more than what is wrong with its text.
                None => {
                    let first = own.find_map(|key| texts.get(&key.column));
                    return Err(error(self.in_words(first.unwrap_or(&problem))));
                }
            };
        }
    }

    /// Returns an error of a changed description, with the column that it belongs to.
    fn in_words(&self, problem: &DescriptionError) -> String {
        let mut keys = self.keys.iter();
        match keys.find(|key| key.path.join(".") == problem.key) {
            Some(key) => format!("`{}`: {}", self.heads[key.column], problem.problem),
            None => format!(
                "{} with this row: `{}`: {}",
                problem.file, problem.key, problem.problem
            ),
        }
    }
}

/// Returns the value that a cell writes: a number, true or false, or a list in TOML's notation; any other text as text.
fn value_of(cell: &str) -> Value {
    // A comment of TOML is a part of the text here.
    let found = Value::from_str(cell).ok();
    let found = found.filter(|_| !cell.contains('#'));
    match found {
        Some(Value::Datetime(_)) | None => Value::String(cell.to_owned()),
        Some(value) => value,
    }
}

/// Sets a key. A list of tables takes it in the table of a name or number, else in all. Returns what is missing where
/// there is no such table.
fn set(table: &mut Table, path: &[String], value: &Value) -> Result<(), String> {
    let (first, rest) = match path {
        [] => return Ok(()),
        [only] => {
            table.insert(only.clone(), value.clone());
            return Ok(());
        }
        [first, rest @ ..] => (first, rest),
    };
    match table.get_mut(first) {
        Some(Value::Table(inner)) => set(inner, rest, value),
        Some(Value::Array(list)) => set_in_list(list, first, rest, value),
        Some(_) => Err(format!("table [{first}]")),
        None if matches!(&**first, "sensor" | "recording" | "effect") => {
            Err(format!("[[{first}]]"))
        }
        None => {
            let mut inner = Table::new();
            set(&mut inner, rest, value)?;
            table.insert(first.clone(), Value::Table(inner));
            Ok(())
        }
    }
}

fn set_in_list(
    list: &mut [Value],
    name: &str,
    path: &[String],
    value: &Value,
) -> Result<(), String> {
    let mut tables: Vec<&mut Table> = list.iter_mut().filter_map(Value::as_table_mut).collect();
    if let [wanted, rest @ ..] = path
        && !rest.is_empty()
    {
        let named = tables.iter().position(|table| {
            let own = table.get("name").and_then(Value::as_str);
            own == Some(wanted)
        });
        let number = wanted.parse::<usize>().ok();
        let place = named.or(number.and_then(|number| number.checked_sub(1)));
        if let Some(place) = place {
            return match tables.get_mut(place) {
                Some(table) => set(table, rest, value),
                None => Err(format!("[[{name}]] with the number {wanted}")),
            };
        }
        if name == "sensor" {
            return Err(format!("[[sensor]] with the name {wanted}"));
        }
    }
    match tables.is_empty() {
        true => Err(format!("[[{name}]]")),
        false => tables
            .into_iter()
            .try_for_each(|table| set(table, path, value)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRIP: &str = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n\
        [joint]\nkind = \"cantilever\"\n[hammer]\nchannel = 1\n[[sensor]]\nname = \"A\"\nchannel = 2\nposition = 0.3\n\
        [[sensor]]\nname = \"B\"\nchannel = 3\nposition = 0.2\n[[recording]]\nfile = \"a.wav\"\n";

    fn table(text: &str) -> Result<InputTable, TableError> {
        InputTable::parse(text.as_bytes(), "table.csv", 10)
    }

    #[test]
    fn val_columns_set_keys_and_others_are_carried() {
        let found = table(
            "file,length,joint.kt,sensor.B.position,recording.temperature,serial,beam.modulus\n\
             a.wav,420 mm,1.4e6,0.21,21.5,007,\nb.wav,,,,,8,210 GPa\n",
        )
        .unwrap();
        assert_eq!((found.len(), found.file(1)), (2, "b.wav"));
        assert_eq!(found.carried_heads(), ["serial"]);
        assert_eq!(found.carried(0), ["007"]);
        let (first, _) = found.described(0, STRIP, "test.toml").unwrap();
        assert_eq!((first.beam.length, first.beam.modulus), (0.42, 207e9));
        assert_eq!(first.joint.kt, Some(1.4e6));
        assert_eq!(first.sensors[1].position, Some(0.21));
        assert_eq!(first.sensors[0].position, Some(0.3));
        let (second, _) = found.described(1, STRIP, "test.toml").unwrap();
        assert_eq!((second.beam.length, second.beam.modulus), (0.423, 210e9));
    }

    #[test]
    fn regress_a_text_that_looks_like_a_number_is_a_text() {
        for name in ["17", "true", "1e5", "[1]", "1 # x", "2024-05-17", "\"17\""] {
            let quoted = name.replace('"', "\"\"");
            let found = table(&format!("file,name,sheet.number\na.wav,\"{quoted}\",17\n")).unwrap();
            let (test, _) = found.described(0, STRIP, "test.toml").unwrap();
            assert_eq!(
                (&*test.name, test.sheet.number.as_deref()),
                (name.trim_matches('"'), Some("17"))
            );
        }
        let found = table("file,length\na.wav,1 # x\n").unwrap();
        let error = found
            .described(0, STRIP, "test.toml")
            .expect_err("no length");
        assert!(error.to_string().contains("1 # x"), "{error}");
        // The message on the number, not on its text.
        let found = table("file,length\na.wav,-1\n").unwrap();
        let error = found
            .described(0, STRIP, "test.toml")
            .expect_err("negative");
        assert!(
            error.to_string().starts_with("table.csv:2: `length`: "),
            "{error}"
        );
    }

    #[test]
    fn limit_recordings_of_a_template_are_named_by_the_column_file() {
        let found = table("file,length,recording.files\na.wav,1,b.wav\n").unwrap();
        let error = found.check_sets_no_recording().expect_err("two names");
        assert!(
            error
                .to_string()
                .starts_with("table.csv:1: the column `recording.files`"),
            "{error}"
        );
        assert!(found.names_files());
        assert!(!table("file,length\na.wav,1\n").unwrap().names_files());
    }

    #[test]
    fn limit_a_bad_table_names_line_and_column() {
        let cases = [
            ("serial\n1\n", "table.csv:1: no column `file`"),
            (
                "file,file\na,b\n",
                "table.csv:1: the column `file` stands twice",
            ),
            ("file,length\na.wav,1\nb.wav\n", "table.csv:3: 1 cells"),
            ("file,length\na.wav,1\n,2\n", "table.csv:3: no file"),
        ];
        for (text, expected) in cases {
            let error = table(text).expect_err(text).to_string();
            assert!(error.starts_with(expected), "{error}");
        }
        let cases = [
            ("length", "-1 mm", "table.csv:2: `length`: "),
            (
                "beam.lenght",
                "1",
                "table.csv:2: `beam.lenght`: unknown key",
            ),
            (
                "sensor.C.mass",
                "1 g",
                "table.csv:2: `sensor.C.mass`: test.toml has no [[sensor]] with the name C",
            ),
            (
                "effect.id",
                "fixture",
                "table.csv:2: `effect.id`: test.toml has no [[effect]]",
            ),
        ];
        for (head, cell, expected) in cases {
            let found = table(&format!("file,{head}\na.wav,{cell}\n")).unwrap();
            let error = found
                .described(0, STRIP, "test.toml")
                .expect_err(head)
                .to_string();
            assert!(error.starts_with(expected), "{error}");
        }
        let rows = "a.wav\n".repeat(11);
        let error = table(&format!("file\n{rows}")).expect_err("too many");
        assert!(error.to_string().contains("more than 10 rows"), "{error}");
    }

    #[test]
    fn limit_other_separators_and_a_byte_order_mark() {
        for text in [
            "\u{feff}file;length\na.wav;1 m\n",
            "file\tlength\na.wav\t1 m\n",
        ] {
            let found = table(text).unwrap();
            let (test, _) = found.described(0, STRIP, "test.toml").unwrap();
            assert_eq!(test.beam.length, 1.0);
        }
    }
}
