//! Decisions by hand, written into the description of the test.

use super::super::output::failed;
use super::super::staging::TemporaryFile;
use crate::taps::TapsByHand;
use anyhow::{Context, bail};
use std::fs;
use std::path::Path;
use toml_edit::{DocumentMut, Item, TableLike, Value};

/// Writes `accept_taps` and `reject_taps` of the `[[recording]]` with this file into a description. Its other text stays as
/// it is.
///
/// # Errors
/// The description cannot be read or written, or has no such table any more.
pub(super) fn write_by_hand(path: &Path, file: &str, by_hand: &TapsByHand) -> anyhow::Result<()> {
    let shown = path.display();
    // A link stays a link.
    let path = fs::canonicalize(path).with_context(|| format!("{shown}: cannot be read"))?;
    let text = fs::read_to_string(&path).with_context(|| format!("{shown}: cannot be read"))?;
    let text = with_by_hand(&text, file, by_hand).with_context(|| shown.to_string())?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let mode = fs::metadata(&path).map(|found| found.permissions());
    let file = TemporaryFile::make_in(folder).map_err(|cause| failed(&path, &cause))?;
    let written = file.write(text.as_bytes(), &path);
    written.map_err(|cause| failed(&path, &cause))?;
    if let Ok(mode) = mode {
        let _ = fs::set_permissions(&path, mode);
    }
    Ok(())
}

/// Returns the text of a description with other decisions by hand.
///
/// # Errors
/// It is no TOML, or has no such table.
fn with_by_hand(text: &str, file: &str, by_hand: &TapsByHand) -> anyhow::Result<String> {
    let mut document: DocumentMut = text.parse()?;
    let tables: Vec<&mut dyn TableLike> = match document.get_mut("recording") {
        Some(Item::ArrayOfTables(tables)) => tables.iter_mut().map(|own| own as _).collect(),
        Some(Item::Value(Value::Array(tables))) => {
            let tables = tables.iter_mut().filter_map(Value::as_inline_table_mut);
            tables.map(|own| own as _).collect()
        }
        _ => Vec::new(),
    };
    // Somebody may have added a table while the recording went on.
    let mut own = tables
        .into_iter()
        .filter(|table| first_file(*table) == Some(file));
    let Some(keys) = own.next() else {
        bail!("has no [[recording]] with the file \"{file}\" any more");
    };
    for (key, times) in [
        ("accept_taps", &by_hand.accept),
        ("reject_taps", &by_hand.reject),
    ] {
        if times.is_empty() {
            keys.remove(key);
            continue;
        }
        let mut list = Value::Array(times.iter().copied().collect());
        // A comment behind the old list stays.
        if let Some(old) = keys.get(key).and_then(Item::as_value) {
            *list.decor_mut() = old.decor().clone();
        }
        keys.insert(key, Item::Value(list));
    }
    Ok(document.to_string())
}

/// The first file of a recording.
fn first_file(table: &dyn TableLike) -> Option<&str> {
    let files = table.get("files").and_then(Item::as_array);
    let first = files.and_then(|files| files.get(0)).and_then(Value::as_str);
    first.or_else(|| table.get("file")?.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# A test.\n[beam] # steel\nlength = 0.4\n\n[[recording]]\nfile = \"a.wav\"   # first\n\n\
                        [[recording]]\nfile = \"b.wav\"\nreject_taps = [1.5] # a knock\ntap = 0.2\n";

    fn by_hand(accept: &[f64], reject: &[f64]) -> TapsByHand {
        TapsByHand {
            accept: accept.to_vec(),
            reject: reject.to_vec(),
        }
    }

    #[test]
    fn prop_other_text_stays_as_it_is() {
        let first = with_by_hand(TEXT, "a.wav", &by_hand(&[], &[4.905, 12.0])).unwrap();
        let wanted = TEXT.replace("# first\n", "# first\nreject_taps = [4.905, 12.0]\n");
        assert_eq!(first, wanted);
        // Taken back.
        assert_eq!(
            with_by_hand(&first, "a.wav", &by_hand(&[], &[])).unwrap(),
            TEXT
        );
        let second = with_by_hand(TEXT, "b.wav", &by_hand(&[2.5], &[1.5, 7.25])).unwrap();
        let wanted = TEXT.replace("[1.5]", "[1.5, 7.25]");
        assert_eq!(
            second,
            wanted.replace("tap = 0.2\n", "tap = 0.2\naccept_taps = [2.5]\n")
        );
    }

    #[test]
    fn limit_a_table_that_is_gone_and_inline_tables() {
        let error = with_by_hand(TEXT, "c.wav", &by_hand(&[], &[])).unwrap_err();
        assert_eq!(
            error.to_string(),
            "has no [[recording]] with the file \"c.wav\" any more"
        );
        let inline = "recording = [{ file = \"a.wav\" }]\n";
        assert_eq!(
            with_by_hand(inline, "a.wav", &by_hand(&[1.0], &[])).unwrap(),
            "recording = [{ file = \"a.wav\" , accept_taps = [1.0] }]\n"
        );
    }

    #[test]
    fn prop_a_written_description_says_what_was_decided() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("test.toml");
        fs::write(&path, TEXT).unwrap();
        write_by_hand(&path, "a.wav", &by_hand(&[], &[4.905])).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains("reject_taps = [4.905]\n"), "{text}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
