//! Decisions by hand, written into the description of the test.

use super::super::output::failed;
use super::super::staging::TemporaryFile;
use crate::taps::{REACH, TapsByHand};
use anyhow::{Context, bail, ensure};
use std::fs;
use std::path::Path;
use toml_edit::{Array, DocumentMut, Item, TableLike, Value};

/// Writes what was decided by hand into the `[[recording]]` with this file: what was taken out of `accept_taps` and
/// `reject_taps`, and what was added. Other text of the description stays as it is, also what somebody has written there
/// meanwhile.
///
/// # Errors
/// The description cannot be read or written, or has no such table any more.
pub(super) fn write_by_hand(
    path: &Path,
    file: &str,
    before: &TapsByHand,
    after: &TapsByHand,
) -> anyhow::Result<()> {
    if before == after {
        return Ok(());
    }
    let shown = path.display();
    // A link stays a link.
    let path = fs::canonicalize(path).with_context(|| format!("{shown}: cannot be read"))?;
    let text = fs::read_to_string(&path).with_context(|| format!("{shown}: cannot be read"))?;
    let permissions = fs::metadata(&path)?.permissions();
    ensure!(!permissions.readonly(), "{shown}: is read-only");
    let text = with_by_hand(&text, file, before, after).with_context(|| shown.to_string())?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let temporary = TemporaryFile::make_in(folder).map_err(|cause| failed(&path, &cause))?;
    let written = temporary.write(text.as_bytes(), &path);
    written.map_err(|cause| failed(&path, &cause))?;
    fs::set_permissions(&path, permissions).map_err(|cause| failed(&path, &cause))
}

/// Returns the text of a description with other decisions by hand.
///
/// # Errors
/// It is no TOML, or has no such table.
fn with_by_hand(
    text: &str,
    file: &str,
    before: &TapsByHand,
    after: &TapsByHand,
) -> anyhow::Result<String> {
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
    change(keys, "accept_taps", &before.accept, &after.accept)?;
    change(keys, "reject_taps", &before.reject, &after.reject)?;
    let changed = document.to_string();
    // The library writes the line ends of Unix.
    let windows = text.matches("\r\n").count();
    Ok(match windows > 0 && windows == text.matches('\n').count() {
        true => changed.replace("\r\n", "\n").replace('\n', "\r\n"),
        false => changed,
    })
}

/// Takes times (s) out of a list that are no longer in it, and adds those that are new, in order.
///
/// # Errors
/// There is something else than a list.
fn change(
    keys: &mut dyn TableLike,
    key: &str,
    before: &[f64],
    after: &[f64],
) -> anyhow::Result<()> {
    let removed = before.iter().filter(|time| !after.contains(time));
    let added = after.iter().filter(|time| !before.contains(time));
    let (removed, added): (Vec<f64>, Vec<f64>) =
        (removed.copied().collect(), added.copied().collect());
    if removed.is_empty() && added.is_empty() {
        return Ok(());
    }
    let list = keys.entry(key).or_insert(Item::Value(Array::new().into()));
    let Some(list) = list.as_array_mut() else {
        bail!("`{key}` is no list");
    };
    let seconds = |item: &Value| {
        item.as_float()
            .or_else(|| item.as_integer().map(|n| n as f64))
    };
    let is_near =
        |item: &Value, time: &f64| seconds(item).is_some_and(|own| (own - time).abs() < REACH);
    list.retain(|item| !removed.iter().any(|time| is_near(item, time)));
    for time in added {
        let items = list.iter();
        let place = items.filter(|item| seconds(item).is_some_and(|own| own < time));
        let place = place.count();
        list.insert(place, time);
        // The library puts a space before what is added behind others alone.
        if let Some(second) = list.get_mut(1).filter(|_| place == 0) {
            second.decor_mut().set_prefix(" ");
        }
    }
    if list.is_empty() {
        keys.remove(key);
    }
    Ok(())
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
                        [[recording]]\nfile = \"b.wav\"\nreject_taps = [1.50] # a knock\ntap = 0.2\n";

    fn by_hand(accept: &[f64], reject: &[f64]) -> TapsByHand {
        TapsByHand {
            accept: accept.to_vec(),
            reject: reject.to_vec(),
        }
    }

    fn changed(text: &str, file: &str, before: &TapsByHand, after: &TapsByHand) -> String {
        with_by_hand(text, file, before, after).unwrap()
    }

    #[test]
    fn prop_other_text_stays_as_it_is() {
        let (none, two) = (by_hand(&[], &[]), by_hand(&[], &[4.905, 12.0]));
        let first = changed(TEXT, "a.wav", &none, &two);
        let wanted = TEXT.replace("# first\n", "# first\nreject_taps = [4.905, 12.0]\n");
        assert_eq!(first, wanted);
        // Taken back.
        assert_eq!(changed(&first, "a.wav", &two, &none), TEXT);
        let (old, new) = (by_hand(&[], &[1.5]), by_hand(&[2.5], &[0.5, 1.5]));
        let second = changed(TEXT, "b.wav", &old, &new);
        let wanted = TEXT.replace("[1.50]", "[0.5, 1.50]");
        let wanted = wanted.replace("tap = 0.2\n", "tap = 0.2\naccept_taps = [2.5]\n");
        assert_eq!(second, wanted);
        // Line ends of Windows.
        let windows = TEXT.replace('\n', "\r\n");
        assert_eq!(
            changed(&windows, "b.wav", &old, &new),
            wanted.replace('\n', "\r\n")
        );
    }

    #[test]
    fn prop_what_somebody_has_written_meanwhile_stays() {
        let meanwhile = TEXT.replace("[1.50]", "[1.50, 2.76]");
        let (old, new) = (by_hand(&[], &[1.5]), by_hand(&[], &[1.5, 20.5]));
        let both = changed(&meanwhile, "b.wav", &old, &new);
        assert_eq!(both, TEXT.replace("[1.50]", "[1.50, 2.76, 20.5]"));
        assert_eq!(changed(&both, "b.wav", &new, &old), meanwhile);
    }

    #[test]
    fn limit_a_table_that_is_gone_and_inline_tables() {
        let (none, one) = (by_hand(&[], &[]), by_hand(&[1.0], &[]));
        let error = with_by_hand(TEXT, "c.wav", &none, &one).unwrap_err();
        assert_eq!(
            error.to_string(),
            "has no [[recording]] with the file \"c.wav\" any more"
        );
        let inline = "recording = [{ files = [\"a.wav\", \"b.wav\"] }]\n";
        assert_eq!(
            changed(inline, "a.wav", &none, &one),
            "recording = [{ files = [\"a.wav\", \"b.wav\"] , accept_taps = [1.0] }]\n"
        );
        let other = "[[recording]]\nfile = \"a.wav\"\naccept_taps = 1.0\n";
        let error = with_by_hand(other, "a.wav", &none, &one).unwrap_err();
        assert_eq!(error.to_string(), "`accept_taps` is no list");
    }

    #[test]
    fn prop_a_written_description_says_what_was_decided() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("test.toml");
        fs::write(&path, TEXT).unwrap();
        let (none, one) = (by_hand(&[], &[]), by_hand(&[], &[4.905]));
        write_by_hand(&path, "a.wav", &none, &one).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains("reject_taps = [4.905]\n"), "{text}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        let error = write_by_hand(&path, "a.wav", &one, &none).unwrap_err();
        assert!(
            error.to_string().ends_with("test.toml: is read-only"),
            "{error}"
        );
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }
}
