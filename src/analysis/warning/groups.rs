//! What holds of several recordings or modes is said once, with the places and the worst of them.

use std::mem::{discriminant, swap};

use super::Warning;
use tapjoint_signal::quality::{Check, Outcome, QualitySettings, Subject, Verdict};

/// Places that are listed after the worst one.
const MOST_PLACES: usize = 6;

/// Doubts of one check as one warning: the worst in full, the others by their places. What the taps' own
/// reasons and the warnings of the spectra say already is left out.
pub(crate) fn of_quality(verdicts: &[Verdict]) -> Vec<Warning> {
    let mut checks: Vec<(Check, Vec<&Verdict>)> = Vec::new();
    for verdict in verdicts.iter().filter(|v| v.is_doubt() && !is_said(v)) {
        match checks.iter_mut().find(|(check, _)| *check == verdict.check) {
            Some((_, doubts)) => doubts.push(verdict),
            None => checks.push((verdict.check, vec![verdict])),
        }
    }
    let warnings = checks.iter().filter_map(|(check, doubts)| {
        Some(Warning::Quality {
            code: check.code(),
            text: words(doubts)?,
        })
    });
    warnings.collect()
}

fn is_said(verdict: &Verdict) -> bool {
    match verdict.check {
        Check::DoubleHit | Check::Overload | Check::WeakTap | Check::Averages | Check::Decay => {
            true
        }
        // The tap was rejected for it.
        Check::ForceRipple => verdict.outcome == Outcome::Bad,
        _ => false,
    }
}

/// "rec2.wav, 15.50 Hz: ... (The worst of 3; also 15.51 Hz in rec1.wav, rec3.wav. ...)"; `None` of nothing.
fn words(doubts: &[&Verdict]) -> Option<String> {
    // The first of equally bad ones.
    let worse = |a: &&Verdict, b: &&Verdict| {
        let by_size = a.severity().total_cmp(&b.severity());
        a.outcome.cmp(&b.outcome).then(by_size)
    };
    let worst = *doubts.iter().rev().max_by(|a, b| worse(a, b))?;
    if doubts.len() == 1 {
        return Some(worst.to_string());
    }
    let mut places = places(doubts, worst);
    let more = places.len().saturating_sub(MOST_PLACES);
    places.truncate(MOST_PLACES);
    if more > 0 {
        places.push(format!("{more} more"));
    }
    let also = match places.is_empty() {
        true => String::new(),
        false => format!("; also {}", places.join("; ")),
    };
    Some(format!(
        "{worst} (The worst of {}{also}. The table of checks has them all.)",
        doubts.len()
    ))
}

/// Where the others are: modes with their recordings, recordings that share their modes together.
fn places(doubts: &[&Verdict], worst: &Verdict) -> Vec<String> {
    let mut modes: Vec<Place<'_>> = Vec::new();
    let mut others: Vec<String> = Vec::new();
    for doubt in doubts.iter().filter(|doubt| doubt.subject != worst.subject) {
        let Subject::Mode {
            file,
            frequency,
            is_mode,
        } = &doubt.subject
        else {
            others.push(doubt.subject.to_string());
            continue;
        };
        // Two peaks of one recording are two, however near.
        let same = modes
            .iter_mut()
            .filter(|place| place.is_mode == *is_mode && is_same(place.frequency, *frequency))
            .find(|place| !place.files.contains(&file.as_str()));
        match same {
            Some(place) => place.files.push(file),
            None => modes.push(Place {
                frequency: *frequency,
                is_mode: *is_mode,
                files: vec![file],
            }),
        }
    }
    modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    let mut listed: Vec<(Vec<&str>, bool, Vec<String>)> = Vec::new();
    for place in modes {
        let frequency = format!("{:.2}", place.frequency);
        let same = |one: &&mut (Vec<&str>, bool, Vec<String>)| {
            one.0 == place.files && one.1 == place.is_mode
        };
        match listed.iter_mut().find(same) {
            Some((_, _, frequencies)) => frequencies.push(frequency),
            None => listed.push((place.files, place.is_mode, vec![frequency])),
        }
    }
    let modes = listed.into_iter().map(|(files, is_mode, frequencies)| {
        let what = if is_mode { "" } else { " (no mode)" };
        format!(
            "{} Hz{what} in {}",
            frequencies.join(", "),
            files.join(", ")
        )
    });
    others.dedup();
    modes.chain(others).collect()
}

/// A mode, or a peak that is none, and the recordings that have it.
struct Place<'a> {
    frequency: f64,
    is_mode: bool,
    files: Vec<&'a str>,
}

fn is_same(first: f64, second: f64) -> bool {
    (second / first - 1.0).abs() <= QualitySettings::default().same_mode
}

/// Warnings that differ in their recording and a number alone become one, in the place of the first.
pub fn together(warnings: Vec<Warning>) -> Vec<Warning> {
    let mut kept: Vec<Warning> = Vec::new();
    for warning in warnings {
        let joined = kept.iter_mut().any(|earlier| is_joined(earlier, &warning));
        if !joined {
            kept.push(warning);
        }
    }
    kept
}

/// Takes a later warning into an earlier one of its kind, if it is one.
fn is_joined(earlier: &mut Warning, later: &Warning) -> bool {
    match (earlier, later) {
        (
            Warning::NotRungDown {
                file,
                remaining,
                window,
                others,
            },
            Warning::NotRungDown {
                file: place,
                remaining: level,
                window: used,
                ..
            },
        ) if discriminant(window) == discriminant(used) => {
            let mut other = (place.clone(), *level);
            // The worst stands in front.
            if other.1 > *remaining {
                swap(file, &mut other.0);
                swap(remaining, &mut other.1);
                *window = *used;
            }
            others.push(other);
            true
        }
        (
            Warning::Mains { others, .. },
            Warning::Mains {
                file, frequency, ..
            },
        ) => {
            others.push((file.clone(), *frequency));
            true
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_signal::modal::PeakLabel;
    use tapjoint_signal::spectral::Window;

    fn doubt(check: Check, (file, frequency): (&str, f64), value: f64) -> Verdict {
        Verdict {
            check,
            subject: Subject::Mode {
                file: file.to_owned(),
                frequency,
                is_mode: true,
            },
            value: Some(value),
            limit: 0.9,
            unit: check.unit(),
            outcome: Outcome::Doubtful,
            happened: format!("Value {value}."),
            cause: Some(check.cause()),
            remedy: Some(check.remedy()),
        }
    }

    #[test]
    fn regress_one_check_is_one_warning_with_the_worst_and_all_places() {
        let of = |place, value| doubt(Check::Coherence, place, value);
        let verdicts = [
            of(("a.wav", 15.5), 0.85),
            of(("a.wav", 240.0), 0.8),
            of(("b.wav", 15.52), 0.7),
            of(("c.wav", 15.49), 0.88),
            doubt(Check::RandomError, ("a.wav", 15.5), 1.0),
        ];
        let warnings = of_quality(&verdicts);
        let codes: Vec<&str> = warnings.iter().map(Warning::code).collect();
        assert_eq!(codes, ["coherence", "random-error"]);
        let text = warnings[0].to_string();
        assert!(text.starts_with("b.wav, 15.52 Hz: Value 0.7."), "{text}");
        let places = "(The worst of 4; also 15.50 Hz in a.wav, c.wav; 240.00 Hz in a.wav.";
        assert!(text.contains(places), "{text}");
        assert!(!warnings[1].to_string().contains("worst"), "{warnings:?}");
    }

    #[test]
    fn regress_neighbours_of_one_recording_are_two_places() {
        let of = |place| doubt(Check::Coherence, place, 0.8);
        let mut verdicts = [
            of(("a.wav", 15.5)),
            of(("a.wav", 400.0)),
            of(("a.wav", 408.0)),
            of(("b.wav", 400.1)),
        ];
        verdicts[0].value = Some(0.1);
        if let Subject::Mode { is_mode, .. } = &mut verdicts[2].subject {
            *is_mode = false;
        }
        let text = of_quality(&verdicts)[0].to_string();
        let places = "also 400.00 Hz in a.wav, b.wav; 408.00 Hz (no mode) in a.wav.";
        assert!(text.contains(places), "{text}");
    }

    #[test]
    fn regress_a_bad_outcome_goes_before_a_larger_number() {
        let of = |place, value| doubt(Check::RandomError, place, value);
        let mut verdicts = [of(("a.wav", 15.5), 4.0), of(("b.wav", 15.5), 3.0)];
        verdicts[1].outcome = Outcome::Bad;
        let text = of_quality(&verdicts)[0].to_string();
        assert!(text.starts_with("b.wav"), "{text}");
    }

    #[test]
    fn regress_what_differs_in_recording_and_number_alone_is_one_warning() {
        let rings = |file: &str, remaining| Warning::NotRungDown {
            file: file.to_owned(),
            remaining,
            window: Window::Exponential { decay: remaining },
            others: Vec::new(),
        };
        let hum = |file: &str, frequency| Warning::Mains {
            file: file.to_owned(),
            frequency,
            label: PeakLabel::Mains(frequency),
            others: Vec::new(),
        };
        let alone = Warning::SingleTap {
            file: "a.wav".to_owned(),
        };
        let all = vec![
            rings("a.wav", 0.04),
            hum("a.wav", 50.0),
            rings("b.wav", 0.10),
            alone.clone(),
            hum("b.wav", 150.0),
            rings("c.wav", 0.05),
        ];
        let found = together(all);
        assert_eq!(found.len(), 3, "{found:?}");
        let text = found[0].to_string();
        assert!(
            text.starts_with("b.wav: ") && text.contains("10.0 %"),
            "{text}"
        );
        assert!(text.contains("0.100 1/s"), "{text}");
        assert!(
            text.ends_with("(the same of a.wav: 4.0 %, c.wav: 5.0 %)"),
            "{text}"
        );
        let text = found[1].to_string();
        assert!(text.ends_with("(the same of b.wav: 150.00 Hz)"), "{text}");
        assert_eq!(found[2], alone);
    }
}
