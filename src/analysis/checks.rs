//! Doubts about a measurement: checks of good practice, modes that change with amplitude, and doubts of several
//! recordings as one.

use super::amplitude::{AmplitudeChange, Way};
use super::analysis::RecordingResult;
use super::frf::form_of;
use super::measure::MeasuredSpectra;
use super::warning::Warning;
use std::f64::consts::TAU;
use std::mem::{discriminant, swap};
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

/// Doubts of one check as one warning: the worst in full, the others by their places. What the taps' own
/// reasons and the warnings of the spectra say already is left out.
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
    let warnings = checks
        .iter()
        .filter_map(|(check, doubts)| Some(Warning::new(check.code(), words(doubts)?)));
    warnings.collect()
}

/// "rec2.wav, 15.50 Hz: ... (The worst of 3; also 15.51 Hz in rec1.wav, rec3.wav. ...)"; `None` of nothing.
fn words(doubts: &[&Verdict]) -> Option<String> {
    // The first of equally bad ones.
    let worst = *doubts.iter().rev().max_by(|a, b| {
        let by_size = a.severity().total_cmp(&b.severity());
        a.outcome.cmp(&b.outcome).then(by_size)
    })?;
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

/// Returns one warning for each way in which modes change, with the recording in which they change most.
pub(crate) fn of_amplitude(recordings: &[RecordingResult]) -> Vec<Warning> {
    let mut all = Vec::new();
    for recording in recordings {
        let numbered = recording.readings().iter().zip(&recording.mode_numbers);
        let changes: Changes = numbered
            .filter_map(|(reading, &mode)| Some((mode?, recording.amplitude_change(reading)?)))
            .collect();
        all.push((recording.file.clone(), changes));
    }
    by_way(all)
}

/// Numbers of modes, and how each changes.
type Changes = Vec<(usize, AmplitudeChange)>;

/// Groups the changes of all recordings by their way.
fn by_way(all: Vec<(String, Changes)>) -> Vec<Warning> {
    let mut groups: Vec<(Way, Vec<(String, Changes)>)> = Vec::new();
    for (file, changes) in all {
        for (mode, change) in changes {
            let way = change.way();
            let place = groups.iter().position(|group| group.0 == way);
            let place = place.unwrap_or_else(|| {
                groups.push((way, Vec::new()));
                groups.len() - 1
            });
            let own = &mut groups[place].1;
            match own.last_mut().filter(|one| one.0 == file) {
                Some(one) => one.1.push((mode, change)),
                None => own.push((file.clone(), vec![(mode, change)])),
            }
        }
    }
    let warnings = groups.into_iter().map(|(_, group)| one_warning(group));
    warnings.collect()
}

/// The warning about recordings, at least one, whose modes change in one way.
fn one_warning(mut group: Vec<(String, Changes)>) -> Warning {
    let (mut worst, mut most) = (0, (0.0, 0.0));
    for (place, (_, changes)) in group.iter().enumerate() {
        for (_, change) in changes {
            if change.size() > most {
                (worst, most) = (place, change.size());
            }
        }
    }
    let (file, changes) = group.remove(worst);
    let others = group.into_iter().map(|(file, changes)| {
        let modes = changes.into_iter().map(|(mode, _)| mode);
        (file, modes.collect())
    });
    Warning::AmplitudeDependent {
        file,
        changes,
        others: others.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_signal::modal::PeakLabel;
    use tapjoint_signal::spectral::Window;

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
        let alone = Warning::single_tap("a.wav");
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

#[cfg(test)]
mod amplitude_tests {
    use super::*;

    #[test]
    fn regress_a_change_in_words() {
        let change = AmplitudeChange {
            amplitude: [33.2, 2.31],
            unit: Some("m/s2".into()),
            frequency: [80.281, 80.543],
            frequency_bound: [0.01, 0.02],
            damping_ratio: [0.00283, 0.00149],
            damping_bound: [0.0001, 0.0001],
        };
        let plain = |change: &AmplitudeChange| change.to_string().replace('\u{a0}', " ");
        assert_eq!(
            plain(&change),
            "rises from 80.28 to 80.54 Hz and its damping falls from 0.28 to 0.15 % as the amplitude \
             falls from 33 to 2.3 m/s\u{b2}"
        );
        let steady = AmplitudeChange {
            damping_bound: [0.001, 0.001],
            ..change
        };
        assert!(plain(&steady).contains("its damping stays near 0.2 %"));
        let undamped = AmplitudeChange {
            damping_ratio: [-0.000_12, -0.000_05],
            damping_bound: [0.0002, 0.0002],
            ..steady
        };
        assert!(plain(&undamped).contains("its damping stays below 0.020 %"));
    }

    /// A change of frequency and damping as the amplitude falls.
    fn change(frequency: [f64; 2], damping_ratio: [f64; 2]) -> AmplitudeChange {
        AmplitudeChange {
            amplitude: [10.0, 1.0],
            unit: None,
            frequency,
            frequency_bound: [0.01, 0.01],
            damping_ratio,
            damping_bound: [0.0001, 0.0001],
        }
    }

    #[test]
    fn regress_the_cause_follows_the_sign_of_the_change() {
        let steady = [0.002, 0.002];
        let cases = [
            ([80.0, 80.5], steady, "softens and damps more"),
            ([80.0, 80.0], [0.004, 0.002], "softens and damps more"),
            ([80.5, 80.0], steady, "stiffens the harder"),
            ([80.0, 80.0], [0.002, 0.004], "damped less the harder"),
            ([80.0, 80.5], [0.002, 0.004], "softens but is damped less"),
        ];
        for (frequency, damping, cause) in cases {
            let warning = Warning::AmplitudeDependent {
                file: "a.wav".into(),
                changes: vec![(1, change(frequency, damping))],
                others: Vec::new(),
            };
            let text = warning.to_string();
            assert!(text.contains(cause), "{frequency:?} {damping:?}: {text}");
        }
    }

    #[test]
    fn regress_a_cause_is_said_of_the_modes_that_go_its_way_alone() {
        let softer = change([80.0, 80.5], [0.002, 0.002]);
        let stiffer = change([500.5, 500.0], [0.002, 0.002]);
        let text = |changes: Vec<(usize, AmplitudeChange)>| {
            by_way(vec![("a.wav".into(), changes)])[0].to_string()
        };
        let alike = text(vec![(1, softer.clone()), (2, softer.clone())]);
        assert!(
            alike.contains("1 more mode changes with it; a joint"),
            "{alike}"
        );
        let mixed = by_way(vec![(
            "a.wav".into(),
            vec![(1, softer.clone()), (2, softer), (3, stiffer)],
        )]);
        let texts: Vec<String> = mixed.iter().map(ToString::to_string).collect();
        assert_eq!(texts.len(), 2, "{texts:?}");
        let told = "1 more mode changes with it; a joint";
        assert!(texts[0].contains(told), "{texts:?}");
        let other = texts[1].starts_with("a.wav: mode 3 falls");
        assert!(
            other && texts[1].contains("stiffens the harder"),
            "{texts:?}"
        );
    }

    #[test]
    fn regress_recordings_that_change_alike_are_one_warning() {
        let softer = change([80.0, 80.5], [0.002, 0.002]);
        let softest = change([79.0, 80.5], [0.002, 0.002]);
        let stiffer = change([500.5, 500.0], [0.002, 0.002]);
        let one = |file: &str, changes: &[(usize, &AmplitudeChange)]| {
            let own = changes.iter().map(|&(mode, one)| (mode, one.clone()));
            (file.to_owned(), own.collect())
        };
        let found = by_way(vec![
            one("a.wav", &[(1, &softer), (2, &softer)]),
            one("b.wav", &[(3, &stiffer)]),
            one("c.wav", &[(1, &softest)]),
            one("d.wav", &[(2, &softer), (3, &stiffer)]),
        ]);
        let texts: Vec<String> = found.iter().map(ToString::to_string).collect();
        assert_eq!(texts.len(), 2, "{texts:?}");
        assert!(texts[0].starts_with("c.wav: mode 1 rises"), "{}", texts[0]);
        let also = "; the same in a.wav: modes 1, 2; d.wav: mode 2";
        assert!(texts[0].ends_with(also), "{}", texts[0]);
        assert!(texts[1].starts_with("b.wav: mode 3 falls"), "{}", texts[1]);
        assert!(
            texts[1].ends_with("; the same in d.wav: mode 3"),
            "{}",
            texts[1]
        );
    }

    /// Whose frequency stays within its bounds is ranked by its damping, and not by noise.
    #[test]
    fn regress_modes_that_rub_are_ranked_by_their_damping() {
        let little = change([80.0, 80.015], [0.002, 0.003]);
        let much = change([80.0, 80.001], [0.002, 0.006]);
        let found = by_way(vec![
            ("a.wav".to_owned(), vec![(1, little)]),
            ("b.wav".to_owned(), vec![(1, much)]),
        ]);
        assert_eq!(found.len(), 1);
        assert!(found[0].to_string().starts_with("b.wav"), "{found:?}");
    }
}
