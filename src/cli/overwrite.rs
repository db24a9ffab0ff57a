//! Files that a command may replace: none of its inputs, none twice, and without `--force` none that tapjoint
//! did not make.
//!
//! All files that a command reads and writes are collected from its arguments and from the test description,
//! and checked before any work. Every path among the arguments is an input, unless its option stands in
//! [`OUTPUTS`]. A new option therefore counts as an input until it is added there.
//!
//! A file that tapjoint made has a mark: in the file, or in a list of checksums beside it.

use super::arguments::JsonDestination;
use super::place::{Place, folder_of, is_description};
use crate::batch::JOURNAL_HEAD;
use crate::description::TestDescription;
use crate::report::VERSION_HEAD;
use anyhow::bail;
use clap::ArgMatches;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Options that name an output; all other paths are inputs.
const OUTPUTS: [&str; 8] = [
    "json", "out", "png", "csv", "uff58", "uff58b", "model", "keep",
];

/// Arguments of `compare` that name tests.
const COMPARED: [&str; 6] = ["first", "second", "before", "after", "pair", "series"];

/// An option with all files that it writes.
pub(super) type Expanded = (&'static str, Vec<PathBuf>);

/// Files that a command reads, and files that it writes.
#[derive(Debug, Clone, Default)]
pub(super) struct Files {
    inputs: Vec<Place>,
    /// Options with their files.
    outputs: Vec<(String, PathBuf)>,
    /// Replace files that the program did not make, too.
    pub(super) force: bool,
}

impl Files {
    /// Collects the files of a command: the paths among its arguments, and the recordings that its test
    /// description names. `expanded` holds the options that write other files than the one they name.
    pub(super) fn of(
        matches: &ArgMatches,
        test: Option<(&Path, &TestDescription)>,
        expanded: Vec<Expanded>,
    ) -> Self {
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for id in matches.ids().map(clap::Id::as_str) {
            let paths = paths(matches, id);
            if !OUTPUTS.contains(&id) {
                inputs.extend(paths);
            } else if expanded.iter().all(|(option, _)| *option != id) {
                outputs.extend(paths.into_iter().map(|path| (id, path)));
            }
        }
        for (id, paths) in expanded {
            outputs.extend(paths.into_iter().map(|path| (id, path)));
        }
        // Descriptions and recordings of all tests in a folder of tests.
        let folders = inputs.iter().filter(|path| path.is_dir());
        let entries = folders.filter_map(|folder| fs::read_dir(folder).ok());
        let tests = entries.flatten().flatten();
        // A pair of tests has two folders of its own.
        let names = ["test.toml", "before/test.toml", "after/test.toml"];
        let tests = tests.flat_map(|entry| names.map(|name| entry.path().join(name)));
        let tests: Vec<PathBuf> = tests.filter(|path| path.is_file()).collect();
        for path in tests {
            let test = described(&path);
            inputs.extend(test.iter().flat_map(|test| files_of(&path, test)));
            inputs.push(path);
        }
        if let Some((path, test)) = test {
            inputs.extend(files_of(path, test));
        }
        // A comparison reads several descriptions. `simulate` writes the recordings that one names.
        let compared = matches.ids().map(clap::Id::as_str);
        let compared = compared.filter(|id| COMPARED.contains(id));
        let compared: Vec<PathBuf> = compared.flat_map(|id| paths(matches, id)).collect();
        for path in compared.into_iter().filter(|path| is_description(path)) {
            inputs.extend(
                described(&path)
                    .iter()
                    .flat_map(|test| files_of(&path, test)),
            );
        }
        Self {
            inputs: inputs.iter().filter_map(|path| Place::of(path)).collect(),
            outputs: outputs
                .into_iter()
                .map(|(id, path)| (format!("--{id}"), path))
                .collect(),
            force: matches.get_flag("force"),
        }
    }

    /// Adds files that the command reads beside those of its arguments.
    pub(super) fn add_inputs(&mut self, paths: &[PathBuf]) {
        self.inputs
            .extend(paths.iter().filter_map(|path| Place::of(path)));
    }

    /// Returns the folders of all outputs.
    pub(super) fn folders(&self) -> BTreeSet<&Path> {
        let outputs = self.outputs.iter();
        outputs.map(|(_, path)| folder_of(path)).collect()
    }

    /// Checks all inputs against all outputs.
    ///
    /// # Errors
    /// An output is an input, two outputs are one file, or an existing file was not made by the program.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        for (option, path) in &self.outputs {
            self.check_output(path, option)?;
        }
        self.check_distinct()
    }

    /// Checks all outputs against each other.
    ///
    /// # Errors
    /// Two outputs are one file.
    pub(super) fn check_distinct(&self) -> anyhow::Result<()> {
        let mut before: Vec<(Place, &str)> = Vec::new();
        for (option, path) in &self.outputs {
            let Some(place) = Place::of(path) else {
                continue;
            };
            if let Some((_, first)) = before.iter().find(|(other, _)| other.is(&place)) {
                bail!(
                    "{}: is the output of both {first} and {option}; give each a name of its own",
                    path.display()
                );
            }
            before.push((place, option));
        }
        Ok(())
    }

    /// Checks inputs that other files name against all outputs.
    ///
    /// # Errors
    /// One of them is an output.
    pub(super) fn check_inputs(&self, paths: impl Iterator<Item = PathBuf>) -> anyhow::Result<()> {
        let outputs = self.outputs.iter();
        let outputs: Vec<(Place, &str, &Path)> = outputs
            .filter_map(|(option, path)| Some((Place::of(path)?, option.as_str(), path.as_path())))
            .collect();
        for path in paths {
            let Some(input) = Place::of(&path) else {
                continue;
            };
            let mut same = outputs.iter().filter(|(output, ..)| output.is(&input));
            if let Some((_, option, output)) = same.next() {
                bail!(is_input(output, option));
            }
        }
        Ok(())
    }

    /// Checks that one output is no input, and no existing file that the program did not make.
    ///
    /// # Errors
    /// The output is `-`, an input, a folder, or a file that the program did not make.
    fn check_output(&self, path: &Path, option: &str) -> anyhow::Result<()> {
        let shown = path.display();
        if path == Path::new("-") {
            bail!(
                "{option} -: only --json - writes to standard output; give the name of a file, or /dev/stdout"
            );
        }
        if path.is_dir() {
            bail!(
                "{shown}: is a folder, but a file is needed ({option}); move it away, or give another name"
            );
        }
        if self.reads(path) {
            bail!(is_input(path, option));
        }
        if !self.force && !is_free(path) {
            bail!(
                "{shown}: is there already and was not made by tapjoint, or was changed since; give another name ({option}), or replace it with --force"
            );
        }
        Ok(())
    }

    /// Checks an output again just before it is replaced, for files that were not known before the work.
    ///
    /// # Errors
    /// Those of [`check_output`](Self::check_output).
    pub(super) fn check_again(&self, path: &Path) -> anyhow::Result<()> {
        let known = self.outputs.iter().find(|(_, output)| output == path);
        self.check_output(path, known.map_or("--out", |(option, _)| option))
    }

    /// Returns true for a file of an earlier run that is no input, and may be removed.
    pub(super) fn may_remove(&self, path: &Path) -> bool {
        !self.reads(path) && is_free(path)
    }

    fn reads(&self, path: &Path) -> bool {
        Place::of(path).is_some_and(|place| self.inputs.iter().any(|input| input.is(&place)))
    }
}

/// Returns the words on an input that is an output as well.
fn is_input(path: &Path, option: &str) -> String {
    format!(
        "{}: is an input of this command and cannot be its output ({option}); give another name",
        path.display()
    )
}

/// Returns true if there is no file, an empty one, or one that the program made.
pub(super) fn is_free(path: &Path) -> bool {
    match fs::metadata(path) {
        Ok(found) => !found.is_file() || found.len() == 0 || is_made_here(path),
        Err(_) => true,
    }
}

/// Returns the paths of an argument; empty for an argument of another type. `init` takes names of recordings.
fn paths(matches: &ArgMatches, id: &str) -> Vec<PathBuf> {
    if let Ok(Some(found)) = matches.try_get_many::<PathBuf>(id) {
        return found.cloned().collect();
    }
    if let Ok(Some(JsonDestination::File(path))) = matches.try_get_one(id) {
        return vec![path.clone()];
    }
    match matches.try_get_many::<String>(id) {
        Ok(Some(names)) if id == "recordings" => names.map(PathBuf::from).collect(),
        _ => Vec::new(),
    }
}

/// Returns the files that a description names: recordings, modes, and the free bar's test with its own.
pub(super) fn files_of(path: &Path, test: &TestDescription) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let recordings = test.recordings.iter();
    let modes = test.measured.iter().filter_map(|one| one.file.as_ref());
    let named = recordings
        .flat_map(|recording| recording.files())
        .chain(modes.map(|file| &file.path))
        .chain(test.beam.free_test.iter().map(|free| &free.path));
    let mut files: Vec<PathBuf> = named.map(|file| folder.join(file)).collect();
    if let Some(free) = &test.beam.free_test {
        let path = folder.join(&free.path);
        // A free bar has no free test of its own.
        let free = described(&path).filter(|free| free.beam.free_test.is_none());
        files.extend(free.iter().flat_map(|free| files_of(&path, free)));
    }
    files
}

/// Reads a test description for the names in it; `None` if it is not one. The command reads it again and
/// reports its errors. A pipe is not read, because it can be read only once.
pub(super) fn described(path: &Path) -> Option<TestDescription> {
    let is_file = fs::metadata(path).is_ok_and(|found| found.is_file());
    if !is_file || path.starts_with("/dev") {
        return None;
    }
    let text = fs::read_to_string(path).ok()?;
    TestDescription::parse(&text, &path.display().to_string()).ok()
}

/// Name of the list of checksums, in the format of `sha256sum`.
pub(super) const CHECKSUMS: &str = "made-by-tapjoint.sha256";

/// PNG files begin with these bytes and a header of 25 bytes.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
/// The chunk after the header of a PNG file: length, type, keyword and text, CRC-32.
const PNG_SOFTWARE: &[u8] = b"\0\0\0\x11tEXtSoftware\0tapjoint\x7d\x96\x82\xb7";
/// Place of this chunk (bytes).
const PNG_HEADER_END: usize = 33;
/// The last line of an SVG file.
const SVG_COMMENT: &[u8] = b"<!-- Made by tapjoint -->\n";
/// Universal files begin with this line.
const UFF: &[u8] = b"    -1\n";
/// The last dataset of a universal file: a header (151) that names the program. Its dates are left blank.
const UFF_HEADER: &[u8] = b"    -1\n   151\nNONE\nNONE\ntapjoint\n\
    NONE                         0         0         0\nNONE                \ntapjoint\n\
    NONE                         0         0         0\n    -1\n";

/// Parquet files begin with these bytes, and name the program in their footer.
const PARQUET: &[u8] = b"PAR1";
const PARQUET_WRITER: &[u8] = b"tapjoint batch";

/// First words of the CSV files that the program writes.
const CSV_HEADS: [&str; 14] = [
    "parameter,method,unit,value,std,low,high,",
    "mode,label,recording,method,frequency_Hz,std_Hz,",
    "mode,frequency_Hz,frequency_std_Hz,damping_ratio,node,",
    "method,kind,percent,mode,statistic,kx,ky,kz\n",
    "test,file,quantity,change_percent,score,",
    "pair,mode,before_Hz,after_Hz,change_percent,",
    "recording,response,form,unit,frequency_Hz,h1_real,",
    "spectral_line,frequency_Hz,",
    "quantity,name,method,unit,block,lines,window,reading,",
    "name,planted,detectable,refutable,verdict,named,",
    "name,changed,item,visible,repeatability,verdict,named,",
    "number,test,outcome,error,name,kind,recordings,",
    "number,test,mode,label,recording,method,frequency_Hz,",
    "number,test,rank,hypothesis,group,probability,",
];
/// First words of the test descriptions that the program writes.
const DESCRIPTION_HEADS: [&str; 3] = [
    "# The model with what the diagnosis found (verdict:",
    "# The model with the most probable hypothesis, which the diagnosis does not establish (verdict:",
    "# Recordings of a virtual test, made by `tapjoint simulate`.",
];
/// First words of the manual pages that the program writes.
const PAGE_HEAD: &str = ".ie \\n(.g .ds Aq \\(aq\n.el .ds Aq '\n.TH tapjoint";
/// End of the title of a report's page.
const PAGE_TITLE: &str = " – tapjoint report</title>";
/// Words in the comment at the head of a deck.
const DECK_HEAD: &str = ": beam with its joint, written by tapjoint";

/// Bytes that are read at the beginning and at the end of a file.
const LOOKED_AT: u64 = 4096;

/// Returns the file's content with a mark of the program, for PNG, SVG and universal files. The other formats
/// have no place for a mark, or name the program already.
pub(super) fn signed(bytes: &[u8]) -> Cow<'_, [u8]> {
    let (place, mark) = if bytes.starts_with(PNG) && bytes.len() > PNG_HEADER_END {
        (PNG_HEADER_END, PNG_SOFTWARE)
    } else if bytes.starts_with(b"<svg") {
        (bytes.len(), SVG_COMMENT)
    } else if bytes.starts_with(UFF) {
        (bytes.len(), UFF_HEADER)
    } else {
        return Cow::Borrowed(bytes);
    };
    let (before, after) = bytes.split_at(place);
    Cow::Owned([before, mark, after].concat())
}

/// Returns true if the program made this file.
///
/// If a list of checksums ([`CHECKSUMS`]) in the file's folder, or in the two folders above, names the file, the
/// checksum decides: a file that has changed since counts as foreign. `simulate` and `blind-check` write such
/// a list, because their recordings cannot carry a mark. Otherwise the content decides:
///
/// | Format | Mark |
/// |---|---|
/// | PNG | chunk tEXt "Software" after the header |
/// | SVG | comment in the last line |
/// | UFF | dataset 151 at the end |
/// | HTML | end of the title |
/// | JSON | an object with a whole `version` and a list `warnings` |
/// | CSV | names of the first columns |
/// | Journal of a batch | first line |
/// | Parquet | writer in the footer |
/// | TOML, manual page, deck, version of a page | first comment |
/// | list of checksums | its name, and the form of its lines |
///
/// A file of any other format, and a file that cannot be read, counts as foreign.
pub(super) fn is_made_here(path: &Path) -> bool {
    // A folder of kept pairs has its list two folders above the recordings.
    let listed = path.ancestors().skip(1).take(3).find_map(|folder| {
        let list = fs::read_to_string(folder.join(CHECKSUMS)).ok()?;
        let name = name_in_list(path.strip_prefix(folder).ok()?);
        let expected = checksums(&list).remove(&name)?;
        Some(checksum(path).is_ok_and(|found| found == expected))
    });
    listed.unwrap_or_else(|| carries_mark(path).unwrap_or(false))
}

/// Returns true if the file's content shows that the program made it.
///
/// # Errors
/// The file cannot be read.
pub(super) fn carries_mark(path: &Path) -> io::Result<bool> {
    let mut file = File::open(path)?;
    let mut head = Vec::new();
    file.by_ref().take(LOOKED_AT).read_to_end(&mut head)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LOOKED_AT)))?;
    let mut tail = Vec::new();
    file.take(LOOKED_AT).read_to_end(&mut tail)?;
    if head.starts_with(PNG) {
        return Ok(head
            .get(PNG_HEADER_END..)
            .unwrap_or_default()
            .starts_with(PNG_SOFTWARE));
    }
    if head.starts_with(UFF) {
        return Ok(tail.ends_with(UFF_HEADER));
    }
    // The head of a journal may be all that a killed process has written of it. Any other JSON may begin alike.
    let journal = JOURNAL_HEAD.as_bytes();
    let is_begun = !head.is_empty() && journal.starts_with(&head);
    let is_named = path.extension().is_some_and(|ending| ending == "jsonl");
    if head.starts_with(journal) || is_begun && is_named {
        return Ok(true);
    }
    if head.starts_with(PARQUET) {
        return Ok(tail
            .windows(PARQUET_WRITER.len())
            .any(|part| part == PARQUET_WRITER));
    }
    // The last character of the head may be cut.
    let text = String::from_utf8_lossy(&head);
    Ok(match text.chars().next() {
        // The documents of `--json` and report.json have `version` and `warnings`.
        Some('{') => serde_json::from_slice::<Value>(&fs::read(path)?)
            .is_ok_and(|found| found["version"].is_u64() && found["warnings"].is_array()),
        Some('<') if text.starts_with("<svg") => tail.ends_with(SVG_COMMENT),
        Some('<') => text.contains(PAGE_TITLE),
        Some('$' | '*') => {
            // The first comment names the program; a long name of the test wraps its lines.
            let lines = text.lines().take_while(|line| line.starts_with(['$', '*']));
            let words =
                lines.flat_map(|line| line.trim_start_matches(['$', '*']).split_whitespace());
            words.collect::<Vec<_>>().join(" ").contains(DECK_HEAD)
        }
        _ if text.starts_with(PAGE_HEAD) || text.starts_with(VERSION_HEAD) => true,
        // A list of many files is longer than what was looked at.
        _ if path.ends_with(CHECKSUMS) => !checksums(&fs::read_to_string(path)?).is_empty(),
        _ => CSV_HEADS
            .iter()
            .chain(&DESCRIPTION_HEADS)
            .any(|begins| text.starts_with(begins)),
    })
}

/// Returns the earlier list of checksums of a folder, updated for the new files.
///
/// `new` holds each file's name in the folder and the present place of its content.
///
/// # Errors
/// A file cannot be read.
pub(super) fn checksum_list(earlier: &str, new: &[(PathBuf, PathBuf)]) -> io::Result<String> {
    let mut sums = checksums(earlier);
    for (name, content) in new {
        sums.insert(name_in_list(name), checksum(content)?);
    }
    Ok(sums
        .iter()
        .map(|(name, sum)| format!("{sum}  {name}\n"))
        .collect())
}

/// Returns the names of the files in a list of checksums.
pub(super) fn listed_files(list: &str) -> Vec<String> {
    checksums(list).into_keys().collect()
}

/// Returns checksums by file name; empty if one line has another form.
fn checksums(list: &str) -> BTreeMap<String, String> {
    let lines = list.lines().map(|line| {
        let (sum, name) = line.split_once("  ")?;
        let is_sum = sum.len() == 64 && sum.bytes().all(|byte| byte.is_ascii_hexdigit());
        is_sum.then(|| (name.to_owned(), sum.to_owned()))
    });
    lines.collect::<Option<_>>().unwrap_or_default()
}

/// Returns a file's name with slashes, on every system.
fn name_in_list(name: &Path) -> String {
    let parts = name
        .components()
        .map(|part| part.as_os_str().to_string_lossy());
    parts.collect::<Vec<_>>().join("/")
}

/// Returns the SHA-256 of a file's content in hexadecimal digits.
///
/// # Errors
/// The file cannot be read.
pub(super) fn checksum(path: &Path) -> io::Result<String> {
    let sum = checksum_bytes(path)?;
    Ok(sum.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Returns the SHA-256 of a file's content.
///
/// # Errors
/// The file cannot be read.
pub(super) fn checksum_bytes(path: &Path) -> io::Result<[u8; 32]> {
    let mut sum = Sha256::new();
    io::copy(&mut File::open(path)?, &mut sum)?;
    Ok(sum.finalize().into())
}

#[cfg(test)]
mod tests {
    use super::*;
    /// A PNG file of one pixel.
    fn picture() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(png::ColorType::Grayscale);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[7]).unwrap();
        drop(writer);
        bytes
    }

    #[test]
    fn val_a_signed_picture_is_a_sound_one_that_names_the_program() {
        let bytes = signed(&picture()).into_owned();
        let mut reader = png::Decoder::new(&bytes[..]).read_info().unwrap();
        let texts = &reader.info().uncompressed_latin1_text;
        assert_eq!(
            (texts[0].keyword.as_str(), texts[0].text.as_str()),
            ("Software", "tapjoint")
        );
        let mut pixels = [0];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, [7]);
    }

    #[test]
    fn prop_what_was_signed_is_recognised_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let made = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            is_made_here(&path)
        };
        for bytes in [
            &picture()[..],
            b"<svg></svg>\n",
            b"    -1\n    58\n    -1\n",
        ] {
            assert!(!made(bytes), "{:?}", String::from_utf8_lossy(bytes));
            assert!(made(&signed(bytes)), "{:?}", String::from_utf8_lossy(bytes));
        }
        assert!(made(b"{\"version\": 1, \"warnings\": []}"));
        assert!(made(
            b"$ A beam of a very long name: beam with its\n$ joint, written by tapjoint\n"
        ));
        for other in [
            "",
            "{\"version\": 1}",
            "{",
            "time,force,a\n0,1,2\n",
            "[beam]\n",
            "$ a deck\n",
            "<html>",
        ] {
            assert!(!made(other.as_bytes()), "{other:?}");
        }
        assert!(!is_made_here(folder.path()), "a folder");
    }

    #[test]
    fn prop_a_listed_file_is_ours_until_it_changes() {
        let folder = tempfile::tempdir().unwrap();
        let [below, file] = ["below", "below/taps.wav"].map(|name| folder.path().join(name));
        fs::create_dir(&below).unwrap();
        fs::write(&file, "RIFF").unwrap();
        assert!(!is_made_here(&file));
        let new = [(PathBuf::from("below/taps.wav"), file.clone())];
        let list = checksum_list("", &new).unwrap();
        fs::write(folder.path().join(CHECKSUMS), &list).unwrap();
        assert!(is_made_here(&file));
        assert!(is_made_here(&folder.path().join(CHECKSUMS)));
        fs::write(&file, "RIFX").unwrap();
        assert!(!is_made_here(&file));
        // A file that only the earlier list names stays listed.
        assert_eq!(checksum_list(&list, &[]).unwrap(), list);
    }
    #[test]
    fn regress_a_long_list_is_ours() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(CHECKSUMS);
        let line = |number| format!("{:064x}  spectrum-{number}.png\n", number);
        let list: String = (0..200u32).map(line).collect();
        assert!(list.len() as u64 > 2 * LOOKED_AT);
        fs::write(&path, &list).unwrap();
        assert!(is_made_here(&path));
        fs::write(&path, list + "notes of mine\n").unwrap();
        assert!(!is_made_here(&path));
    }
}
