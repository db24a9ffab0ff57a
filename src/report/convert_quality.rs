//! Checks of good practice into the document.

use super::document_quality::VerdictSection;
use tapjoint_signal::quality::{Subject, Verdict};

/// One check.
pub(super) fn verdict_section(verdict: &Verdict) -> VerdictSection {
    let (mut tap, mut frequency, mut sensor) = (None, None, None);
    match &verdict.subject {
        Subject::Tap { tap: number, .. } => tap = Some(*number),
        Subject::Mode { frequency: own, .. } => frequency = Some(*own),
        Subject::Sensor { sensor: name, .. } => sensor = Some(name.clone()),
        Subject::Recording { .. } | Subject::Test => {}
    }
    let of_doubt = |words: &str| verdict.is_doubt().then(|| words.to_owned());
    VerdictSection {
        check: verdict.check.code().to_owned(),
        subject: verdict.subject.to_string(),
        recording: verdict.subject.file().map(str::to_owned),
        tap,
        frequency,
        sensor,
        value: verdict.value,
        limit: verdict.limit,
        unit: verdict.unit.to_owned(),
        outcome: verdict.outcome.name().to_owned(),
        text: verdict.happened.clone(),
        cause: of_doubt(verdict.check.cause()),
        remedy: of_doubt(verdict.check.remedy()),
        severity: verdict.severity(),
    }
}
