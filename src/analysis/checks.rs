//! Checks of good practice: the evidence of each recording, the verdicts, and the warnings that follow from them.

use super::frf::form_of;
use super::measurement::MeasuredSpectra;
use super::recording_result::RecordingResult;
use super::warnings::Warning;
use std::f64::consts::TAU;
use tapjoint_numerics::stats::median;
use tapjoint_signal::modal::ModeReading;
use tapjoint_signal::quality::{
    Check, DampingSource, ForceEvidence, Outcome, RecordingEvidence, ResonanceEvidence,
    SensorEvidence, Subject, TapEvidence, Verdict, judge_test, limits,
};
use tapjoint_signal::recording::Format;

/// The verdicts on all recordings of a test, and the warnings that follow from them.
pub(super) fn judge(recordings: &[RecordingResult]) -> (Vec<Verdict>, Vec<Warning>) {
    let evidence: Vec<RecordingEvidence> = recordings.iter().filter_map(evidence).collect();
    let verdicts = judge_test(&evidence);
    let warnings = of_quality(&verdicts);
    (verdicts, warnings)
}

/// `None` for a recording without spectra: what is wrong with it its taps say; and for functions from
/// a file, of whose taps nothing is known.
fn evidence(recording: &RecordingResult) -> Option<RecordingEvidence> {
    let spectra = recording.measurement.spectra.as_ref()?;
    if recording.format == Format::FrequencyResponses {
        return None;
    }
    let averages = &spectra.averages;
    let force = averages.force.as_ref().map(|spectrum| ForceEvidence {
        spectrum: spectrum.clone(),
        noise: spectra.force_noise.clone(),
    });
    let resonances = spectra
        .readings
        .iter()
        .enumerate()
        .filter(|(_, reading)| reading.label.is_none())
        .map(|(index, reading)| resonance(reading, spectra, is_mode(recording, index)))
        .collect();
    let masses = recording.conditions.masses.iter();
    let fastened = masses.map(|mass| (mass.position, mass.mass));
    Some(RecordingEvidence {
        file: recording.file.clone(),
        tap_position: recording.conditions.tap,
        fastened: fastened.collect(),
        taps: recording
            .measurement
            .taps
            .taps
            .iter()
            .map(TapEvidence::from)
            .collect(),
        lines: averages.lines,
        force,
        sensors: sensors(recording, spectra),
        resonances,
        decay: spectra.decay,
        window: spectra.window,
    })
}

/// Returns true if a reading is a mode: it has a number, or no reading has one.
fn is_mode(recording: &RecordingResult, index: usize) -> bool {
    let numbers = &recording.mode_numbers;
    let own = numbers.get(index).copied().flatten();
    own.is_some() || numbers.iter().all(Option::is_none)
}

fn sensors(recording: &RecordingResult, spectra: &MeasuredSpectra) -> Vec<SensorEvidence> {
    let averages = &spectra.averages;
    let positions = &recording.conditions.sensor_positions;
    let functions = averages.h1.as_deref().unwrap_or_default();
    let mut sensors = Vec::with_capacity(recording.responses.len());
    for (index, response) in recording.responses.iter().enumerate() {
        let coherence = averages.coherence(index);
        sensors.push(SensorEvidence {
            name: response.name.clone(),
            position: positions.get(&response.name).copied(),
            form: form_of(response, recording.tap_unit.as_deref()),
            frf: functions.get(index).cloned(),
            coherence: coherence.map(|lines| lines.iter().map(|c| c.unwrap_or(0.0)).collect()),
        });
    }
    sensors
}

/// The window widens every resonance of the spectra, also where the damping was fitted without it.
fn resonance(reading: &ModeReading, spectra: &MeasuredSpectra, is_mode: bool) -> ResonanceEvidence {
    let added = spectra.window.added_decay() / (TAU * reading.frequency);
    let taps = reading
        .fit
        .as_deref()
        .map_or(&[][..], |fit| fit.mode.taps.as_slice());
    let mut stds: Vec<f64> = taps.iter().map(|tap| tap.frequency_std).collect();
    ResonanceEvidence {
        frequency: reading.frequency,
        is_mode,
        std: reading.std,
        apparent_damping_ratio: reading.damping_ratio.map(|own| own + added),
        damping_from: match reading.fit {
            Some(_) => DampingSource::Decays,
            None => DampingSource::Spectra,
        },
        tap_frequencies: taps.iter().map(|tap| tap.frequency).collect(),
        tap_std: (!stds.is_empty()).then(|| median(&mut stds)),
    }
}

/// Places that are listed after the worst one.
const MOST_PLACES: usize = 6;

/// Doubts of one check as one warning: the worst in full, the others by their places. Left out is what the taps' own
/// reasons and the warnings of the spectra say already.
///
/// "rec2.wav, 15.50 Hz: ... (The worst of 3; also 15.51 Hz in rec1.wav, rec3.wav. ...)"
fn of_quality(verdicts: &[Verdict]) -> Vec<Warning> {
    let mut checks: Vec<(Check, Vec<&Verdict>)> = Vec::new();
    for verdict in verdicts.iter().filter(|verdict| verdict.is_doubt()) {
        let is_said_elsewhere = match verdict.check {
            Check::DoubleHit
            | Check::Overload
            | Check::WeakTap
            | Check::Averages
            | Check::Decay => true,
            // The tap was rejected for it.
            Check::ForceRipple => verdict.outcome == Outcome::Bad,
            _ => false,
        };
        if is_said_elsewhere {
            continue;
        }
        match checks.iter_mut().find(|(check, _)| *check == verdict.check) {
            Some((_, doubts)) => doubts.push(verdict),
            None => checks.push((verdict.check, vec![verdict])),
        }
    }
    let mut warnings = Vec::with_capacity(checks.len());
    for (check, doubts) in checks {
        // The first of equally bad ones.
        let worst = doubts.iter().rev().max_by(|a, b| {
            let by_size = a.severity().total_cmp(&b.severity());
            a.outcome.cmp(&b.outcome).then(by_size)
        });
        let Some(worst) = worst else { continue };
        let mut text = worst.to_string();
        if doubts.len() > 1 {
            let mut places = places(&doubts, worst);
            let more = places.len().saturating_sub(MOST_PLACES);
            places.truncate(MOST_PLACES);
            if more > 0 {
                places.push(format!("{more} more"));
            }
            let also = match places.is_empty() {
                true => String::new(),
                false => format!("; also {}", places.join("; ")),
            };
            let count = doubts.len();
            text += &format!(" (The worst of {count}{also}. The table of checks has them all.)");
        }
        warnings.push(Warning::new(check.code(), text));
    }
    warnings
}

/// Places of the doubts other than the worst: modes with their recordings; modes of the same recordings stand together.
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
        let same = modes.iter_mut().find(|place| {
            place.is_mode == *is_mode
                && (frequency / place.frequencies[0] - 1.0).abs() <= limits::SAME_MODE
                && !place.files.contains(&file.as_str())
        });
        match same {
            Some(place) => place.files.push(file),
            None => modes.push(Place {
                frequencies: vec![*frequency],
                is_mode: *is_mode,
                files: vec![file],
            }),
        }
    }
    modes.sort_by(|a, b| a.frequencies[0].total_cmp(&b.frequencies[0]));
    let mut listed: Vec<Place<'_>> = Vec::new();
    for place in modes {
        let mut earlier = listed.iter_mut();
        match earlier.find(|one| one.files == place.files && one.is_mode == place.is_mode) {
            Some(one) => one.frequencies.extend(place.frequencies),
            None => listed.push(place),
        }
    }
    let modes = listed.into_iter().map(|place| {
        let frequencies: Vec<String> = place
            .frequencies
            .iter()
            .map(|f| format!("{f:.2}"))
            .collect();
        let what = if place.is_mode { "" } else { " (no mode)" };
        let files = place.files.join(", ");
        format!("{} Hz{what} in {files}", frequencies.join(", "))
    });
    others.dedup();
    modes.chain(others).collect()
}

/// Modes, or peaks that are none, of the same recordings.
struct Place<'a> {
    /// Frequencies (Hz), at least one.
    frequencies: Vec<f64>,
    is_mode: bool,
    files: Vec<&'a str>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubt(check: Check, place: (&str, f64), value: f64) -> Verdict {
        Verdict {
            check,
            subject: Subject::Mode {
                file: place.0.to_owned(),
                frequency: place.1,
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
        let codes: Vec<&str> = warnings.iter().map(|warning| warning.code).collect();
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
}
