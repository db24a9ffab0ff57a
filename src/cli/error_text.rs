//! The words of an error, as a terminal and other programs show them.

use super::staging::ledger;

/// Returns the text of an error, with the causes that the message does not contain yet, and the results that are written
/// all the same.
pub(super) fn error_text(error: &anyhow::Error) -> String {
    let mut text = chained(error);
    let ledger = ledger();
    let names = ledger.written.iter().map(|path| path.display().to_string());
    let names: Vec<String> = names.collect();
    if !names.is_empty() {
        text.push_str("; written all the same: ");
        text.push_str(&listed(&names));
    }
    shortened(&text)
}

/// Returns the text of an error, with the causes that the message does not contain yet.
pub(super) fn chained(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1) {
        let cause = cause.to_string();
        if !text.contains(&cause) {
            text.push_str(": ");
            text.push_str(&cause);
        }
    }
    text
}

/// Most names that a message lists.
pub(super) const MOST_NAMES: usize = 10;

/// Returns the first names in one text.
pub(super) fn listed(names: &[String]) -> String {
    let mut text = names[..names.len().min(MOST_NAMES)].join(", ");
    if names.len() > MOST_NAMES {
        text.push_str(", ...");
    }
    text
}

/// Returns the text of the error of a wrong command line, without "error: " and without the hints of a terminal.
pub(super) fn usage_text(usage: &clap::Error) -> String {
    let text = usage.render().to_string();
    let end = text
        .find("\n\nUsage:")
        .or(text.find("\n\nFor more"))
        .unwrap_or(text.len());
    let text = text[..end].trim();
    shortened(text.strip_prefix("error: ").unwrap_or(text))
}

/// Replaces numbers of more than 40 digits by their beginning and the count of their digits.
pub(super) fn shortened(text: &str) -> String {
    const MOST_DIGITS: usize = 40;
    const KEPT: usize = 8;
    let mut short = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let tail = &rest[start..];
        let digits = tail.bytes().take_while(u8::is_ascii_digit).count();
        let kept = if digits > MOST_DIGITS { KEPT } else { digits };
        short.push_str(&rest[..start + kept]);
        if kept < digits {
            short.push_str(&format!("... ({digits} digits)"));
        }
        rest = &tail[digits..];
    }
    short + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_long_numbers_are_shortened() {
        let nines = "9".repeat(309);
        let text = format!("a {nines} b 1{} c 12", "0".repeat(39));
        let short = format!("a 99999999... (309 digits) b 1{} c 12", "0".repeat(39));
        assert_eq!(shortened(&text), short);
        assert_eq!(shortened("no number"), "no number");
    }
}
