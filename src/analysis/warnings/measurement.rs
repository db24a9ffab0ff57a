//! Doubts about the description, the files, the taps, the spectra, the checks of good practice, the numbers of the
//! modes, and what changes with the amplitude.

use super::Warning;
use crate::amplitude::{AmplitudeChanges, Way};
use crate::explained::UnlistedPeak;
use crate::found::hammer_doubt;
use crate::selection::{Choice, Disagreement, LEAST_TAPS, OTHER_LEVEL};
use std::collections::BTreeMap;
use std::fmt;
use tapjoint_description::DescriptionError;
use tapjoint_identify::pairing::{MeasuredPeak, MissingCause, MissingMode, Pairing};
use tapjoint_numerics::stats::times;
use tapjoint_signal::modal::{ModeReading, PeakLabel};
use tapjoint_signal::quality::{Check, Outcome, QualityVerdict, Subject, limits};
use tapjoint_signal::recording::{Recording, RecordingWarning};
use tapjoint_signal::spectral::Window;
use tapjoint_signal::taps::{Rejection, TapSource, Taps};

impl Warning {
    /// A doubt about a key or value of the description.
    pub(crate) fn of_description(doubt: &DescriptionError) -> Self {
        Warning::new("description", doubt.to_string())
    }

    /// What the reader of a file doubts, under the reader's own code.
    pub(crate) fn of_file(file: &str, doubt: &RecordingWarning) -> Self {
        Warning::about(file, doubt.code(), doubt)
    }

    /// A response of a bare recording bears the name of a hammer.
    pub(crate) fn hammer_channel(file: &str, name: &str) -> Self {
        let argument = match name.contains(char::is_whitespace) {
            true => format!("\"{name}\""),
            false => name.to_owned(),
        };
        let text = format!(
            "channel \"{name}\" is taken for a response, but by its name it may be the hammer's; if so, \
             say --hammer {argument}: taps are then judged by their force, and there are frequency \
             response functions"
        );
        Warning::about(file, "hammer-channel", text)
    }

    /// A sensor gives no signal in some taps: one doubt for each such sensor.
    fn stopped_channels(file: &str, taps: &Taps) -> Vec<Self> {
        let mut stopped: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for tap in &taps.taps {
            if let Some(Rejection::Stopped { channel }) = tap.rejection {
                stopped.entry(channel).or_default().push(tap.time);
            }
        }
        let total = taps.taps.len();
        let doubts = stopped.into_iter().map(|(channel, times)| {
            let text = format!(
                "channel {channel} gives no signal in {} of {total} taps, first at {:.2} s; its sensor or cable has probably \
                 failed; check both, and record again",
                times.len(),
                times[0]
            );
            Warning::about(file, "stopped-channel", text)
        });
        doubts.collect()
    }

    /// One tap alone stands for a recording with a hammer.
    fn single_tap(file: &str) -> Self {
        let text = "only one tap was averaged, so nothing shows how well it repeats and a \
                    coherence would mean nothing; record three to five taps";
        Warning::about(file, "single-tap", text)
    }

    /// Taps were to be chosen by their responses, and no force was measured.
    pub(crate) fn select_without_force(file: &str) -> Self {
        let text = "select = \"consistent\" needs the force: without it a weak tap looks like one at another place; all taps \
                    are kept; name the hammer's channel ([hammer] or --hammer)";
        Warning::about(file, "not-selected", text)
    }

    /// Taps were to be chosen by their responses, and a tap has no pulse, or nothing answers.
    pub(crate) fn select_without_response(file: &str) -> Self {
        let text = "select = \"consistent\" compares the responses to the force, and a tap has no pulse or no sensor; all taps \
                    are kept; look at the channels of the taps";
        Warning::about(file, "not-selected", text)
    }

    /// Taps were to be chosen by their responses, and there are too few.
    pub(crate) fn select_of_few(file: &str, taps: usize) -> Self {
        let text = format!(
            "select = \"consistent\" needs at least {LEAST_TAPS} taps that count, and there are {taps}; all are kept; \
             record more taps"
        );
        Warning::about(file, "not-selected", text)
    }

    /// Doubts about the choice among `taps` of `all` taps, which were compared together.
    pub(crate) fn of_selection(file: &str, choice: &Choice, taps: usize, all: usize) -> Vec<Self> {
        let advice = "look at the taps; leave wrong ones out by reject_taps or --reject-taps, or measure again";
        let compared = match taps < all {
            true => format!("{taps} taps that were compared, of {all}"),
            false => format!("{taps} taps"),
        };
        let mut warnings = Vec::new();
        match choice.disagreement {
            Some(Disagreement::TooMany { departing }) => {
                let text = format!(
                    "the taps do not agree: at least {departing} of {compared} depart from the others, more than a third; \
                     all are kept; {advice}"
                );
                warnings.push(Warning::about(file, "taps-disagree", text));
            }
            Some(Disagreement::Groups {
                sizes: [larger, smaller],
                apart,
                level,
            }) => {
                let percent = 100.0 * apart;
                let cause = match level > OTHER_LEVEL {
                    true => format!(
                        "one group is {} times stronger than the other, and a joint may respond to that",
                        times(level)
                    ),
                    false => "the place of the hits or a sensor has probably moved".to_owned(),
                };
                let text = format!(
                    "{compared} fall into groups of {larger} and {smaller}, whose responses differ by {percent:.0} %; \
                     {cause}; no group is preferred; {advice}"
                );
                warnings.push(Warning::about(file, "taps-disagree", text));
            }
            None => {}
        }
        if choice.of_other_level > 0 {
            let count = choice.of_other_level;
            let text = format!(
                "{count} of {compared} depart from the others; they are kept because they differ in level, and a joint may \
                 respond to that; tap at one level, or leave them out by reject_taps or --reject-taps"
            );
            warnings.push(Warning::about(file, "taps-disagree", text));
        }
        warnings
    }

    /// The taps follow one another too soon for the band.
    pub(crate) fn taps_too_short(file: &str, problem: &impl fmt::Display) -> Self {
        let text = format!("the taps leave no spectrum: {problem}");
        Warning::about(file, "taps-too-short", text)
    }

    /// A Hann window was chosen for taps.
    pub(crate) fn hann_on_taps(file: &str) -> Self {
        let text = "a Hann window suppresses the start of every record, where a tap has its \
                    signal; it is meant for steady signals";
        Warning::about(file, "hann-on-taps", text)
    }

    /// Taps of a recording were rejected.
    fn rejected_taps(file: &str, rejected: usize, total: usize) -> Self {
        let were = if rejected == 1 { "was" } else { "were" };
        let text = format!("{rejected} of {total} taps {were} rejected; the list of taps says why");
        Warning::about(file, "rejected-taps", text)
    }

    /// The response does not ring down in the record: a level relative to the start remains at its end.
    pub(crate) fn not_rung_down(file: &str, remaining: f64, window: Window) -> Self {
        let percent = 100.0 * remaining;
        let advice = match window {
            Window::Exponential { decay } => format!(
                "an exponential window with a decay of {decay:.3} 1/s was applied to force and response, \
                 and taken out of every damping read from the spectra (fits take the decays without it); a longer \
                 block, or taps farther apart where the block reaches to the next tap, need no window"
            ),
            _ => "readings on lines suffer from it; leave the window to the program, or give a longer block"
                .to_owned(),
        };
        let text = format!(
            "at the end of the block the response still has {percent:.1} % of its level (1.0 % is wanted); {advice}"
        );
        Warning {
            shared: Some(window.name()),
            severity: remaining,
            about: format!("{file}: {percent:.1} %"),
            ..Warning::about(file, "not-rung-down", text)
        }
    }

    /// A peak was taken for mains hum.
    pub(crate) fn mains(file: &str, frequency: f64, label: PeakLabel) -> Self {
        let text = format!(
            "the peak at {frequency:.2} Hz was there before the tap and is taken for {label}, not for a mode; check \
             the grounding of the sensor cables"
        );
        Warning {
            shared: Some("hum"),
            about: format!("{file}: {frequency:.2} Hz"),
            ..Warning::about(file, "mains", text)
        }
    }

    /// Peaks that are sums and differences of others; `None` where there are none.
    pub(crate) fn combinations(file: &str, readings: &[ModeReading]) -> Option<Self> {
        const MOST_NAMED: usize = 3;
        let mut named = Vec::new();
        let (mut count, mut fundamental) = (0, 0.0);
        for reading in readings {
            let Some(PeakLabel::Combination(sum)) = reading.label else {
                continue;
            };
            count += 1;
            fundamental = sum.of;
            if count <= MOST_NAMED {
                named.push(format!("{:.1} = {sum}", reading.frequency));
            }
        }
        let more = count - named.len();
        if more > 0 {
            named.push(format!("and {more} more"));
        }
        let text = format!(
            "{count} peaks lie at sums and differences of stronger ones and the mode at {fundamental:.1} Hz ({}); a joint \
             that slips makes such combinations while that mode rings, and so does a contact that opens and closes; they \
             are listed with this label and are no modes; softer taps make them weaker",
            named.join(", ")
        );
        (count > 0).then(|| Warning {
            about: format!("{file}: {count} peaks"),
            ..Warning::about(file, "combinations", text)
        })
    }

    /// Frequencies of `poles` (Hz) at which no mode was found; `None` where there are none.
    pub(crate) fn poles_without_mode(file: &str, without: &[f64]) -> Option<Self> {
        let listed = frequencies(without)?;
        let text = format!(
            "`poles` names {listed} Hz, and no mode could be fitted there; choose poles that return at order after order \
             in the stabilisation diagram"
        );
        Some(Warning::about(file, "pole-without-mode", text))
    }

    /// Frequencies of `poles` (Hz) that no recording was analysed at; `None` where there are none.
    pub(crate) fn poles_outside(outside: &[f64]) -> Option<Self> {
        let listed = frequencies(outside)?;
        let text = format!(
            "`poles` in [analysis] names {listed} Hz, which the band of no recording holds; widen a `band`, or leave the \
             frequency out"
        );
        Some(Warning::new("pole-without-mode", text))
    }

    /// Strong peaks, the strongest first, that are no listed modes; `None` where there are none. `band` was analysed (Hz);
    /// `has_curves` says that charts show curves of the fitted modes.
    pub(crate) fn unlisted_peaks(
        file: &str,
        peaks: &[UnlistedPeak],
        band: (f64, f64),
        has_curves: bool,
    ) -> Option<Self> {
        let strongest = peaks.first()?;
        let named = |peak: &UnlistedPeak| {
            let (frequency, height) = (frequency_words(peak.frequency), peak.above_noise_db);
            format!("{frequency} Hz, {height:.0} dB over the noise")
        };
        let what = match peaks {
            [one] => format!("a peak at {}, is no listed mode", named(one)),
            _ => {
                let mut list: Vec<String> = peaks.iter().take(MOST_PEAKS).map(named).collect();
                let more = peaks.len() - list.len();
                if more > 0 {
                    list.push(format!("and {more} more"));
                }
                format!(
                    "{} peaks are no listed modes: {}",
                    peaks.len(),
                    list.join("; ")
                )
            }
        };
        let [low, high] = [1.0 - ABOUT_PEAK, 1.0 + ABOUT_PEAK].map(|by| by * strongest.frequency);
        let advice = if band.1 - band.0 > 1.5 * (high - low) {
            let [low, high] = [low, high].map(frequency_words);
            format!(
                "zoom there (spectrum --zoom {low}:{high}, or band = [{low}, {high}] in a description)"
            )
        } else {
            "measure at other points, or longer".to_owned()
        };
        let look = match has_curves {
            true => ", and see in the chart whether the fitted curve follows the measured one",
            false => "",
        };
        let text = format!("{what}; {advice}{look}");
        Some(Warning {
            shared: Some("unlisted"),
            severity: strongest.above_noise_db,
            about: format!("{file}: {}", named(strongest)),
            ..Warning::about(file, "unlisted-peak", text)
        })
    }

    /// Peaks to which no mode of the jointed beam belongs; `None` where there are none.
    pub(crate) fn unpaired(count: usize) -> Option<Self> {
        let text = "as modes they would make every joint fit worse; torsion, another direction of bending, the \
                    fixture or the suspension are the usual causes";
        Warning::of_peaks(count, text)
    }

    /// Peaks to which no mode of the free beam belongs; `None` where there are none.
    pub(crate) fn unpaired_of_free_beam(count: usize) -> Option<Self> {
        let text = "none of the free beam's natural frequencies lies near them; another direction \
                    of bending, torsion, the supports or the room are the usual causes";
        Warning::of_peaks(count, text)
    }

    /// Peaks were left without a mode; `text` says why.
    fn of_peaks(count: usize, text: &str) -> Option<Self> {
        let belong = match count {
            1 => "peak belongs",
            _ => "peaks belong",
        };
        let text = format!("{count} {belong} to no mode: {text}");
        (count > 0).then(|| Warning::new("unpaired", text))
    }

    /// No peak of a free beam lies where one is expected.
    pub(crate) fn numbered_in_order() -> Self {
        let text = "no peak lies near a natural frequency of the described free beam, so the peaks were \
                    numbered in ascending order; check the beam's dimensions and modulus";
        Warning::new("numbered-in-order", text)
    }

    /// The modes of a recording with other masses have no numbers.
    pub(crate) fn unnumbered(file: &str) -> Self {
        let text = "its peaks have no mode numbers: the first recording gives no estimate of the joint, so that \
                    it is not known where the masses fastened here take the modes; read more modes in the first \
                    recording, or state kt and kr in [joint]";
        Warning::about(file, "unnumbered", text)
    }

    /// The warning about modes that no peak was taken for.
    pub(crate) fn missing_modes(modes: &[MissingMode]) -> Option<Self> {
        let mut list = Vec::with_capacity(modes.len());
        for missing in modes {
            let why = match missing.cause {
                MissingCause::OutsideBand => "outside the measured band",
                MissingCause::AtNode => "near a node of its shape at every sensor or tap",
                MissingCause::Unknown => "within the band",
            };
            let frequency = missing.frequency;
            list.push(format!(
                "mode {} (about {frequency:.1} Hz, {why})",
                missing.mode
            ));
        }
        let text = format!(
            "no peak was taken for {}; higher peaks keep the mode numbers of the model; tap and measure elsewhere, or from a \
             lower frequency on, to see it",
            list.join(", ")
        );
        (!list.is_empty()).then(|| Warning::new("missing-mode", text))
    }

    /// The warning about modes of a file that move in another direction than the others.
    pub(crate) fn other_direction(file: &str, frequencies: &[f64], most: &str) -> Option<Self> {
        let words = frequencies.iter().map(|f| frequency_words(*f));
        let list: Vec<String> = words.collect();
        let text = format!(
            "the modes at {} Hz do not move mainly along {most}; they are not numbered; to number them, state modes = [...] in [measured]",
            list.join(", ")
        );
        (!list.is_empty()).then(|| Warning::about(file, "other-direction", text))
    }

    /// The warning about the most probable other numbering, with the peaks that it numbers otherwise.
    pub(crate) fn ambiguous_pairing(pairing: &Pairing, peaks: &[MeasuredPeak]) -> Option<Self> {
        let other = pairing.others.first()?;
        let chosen = &pairing.chosen;
        let times = chosen.odds / other.odds;
        let odds = if (0.95..1.05).contains(&times) {
            "as probable".to_owned()
        } else if times >= 1.0 {
            format!("{times:.1} times as probable")
        } else {
            format!("{:.1} times less probable", 1.0 / times)
        };
        let mut changes = Vec::new();
        for ((peak, now), then) in peaks.iter().zip(&chosen.numbers).zip(&other.numbers) {
            if now != then {
                let [now, then] = [now, then].map(|number| match number {
                    Some(number) => format!("mode {number}"),
                    None => "no mode".to_owned(),
                });
                changes.push(format!(
                    "{:.2} Hz as {then} instead of {now}",
                    peak.frequency
                ));
            }
        }
        let more = changes.len().saturating_sub(MOST_CHANGES);
        changes.truncate(MOST_CHANGES);
        if more > 0 {
            changes.push(format!("{more} more"));
        }
        let text = format!(
            "the mode numbers are not certain: another numbering is {odds}, with {}; another sensor or tap position, or more \
             modes, would decide",
            changes.join(", ")
        );
        Some(Warning::new("ambiguous-pairing", text))
    }
}

/// Most peaks that one warning names.
const MOST_PEAKS: usize = 5;
/// Band about a peak to be zoomed into: this share of its frequency to either side.
const ABOUT_PEAK: f64 = 0.1;

/// Returns a frequency in words: "27.13", "544.2", "1032".
pub(super) fn frequency_words(frequency: f64) -> String {
    let decimals = match frequency {
        f if f < 100.0 => 2,
        f if f < 1000.0 => 1,
        _ => 0,
    };
    format!("{frequency:.decimals$}")
}

/// Peaks that a warning about the numbering lists.
const MOST_CHANGES: usize = 4;

/// Doubts about a recording and its taps.
pub(crate) fn of_recording(recording: &Recording, source: &TapSource, taps: &Taps) -> Vec<Warning> {
    let file = recording.name();
    let mut warnings = Vec::new();
    let mut files: Vec<&Recording> = recording.parts().map(|(_, part)| part).collect();
    if files.is_empty() {
        files.push(recording);
    }
    for one in files {
        for warning in one.warnings() {
            warnings.push(Warning::of_file(one.name(), &warning));
        }
    }
    warnings.extend(Warning::stopped_channels(file, taps));
    for remark in &taps.remarks {
        warnings.push(Warning::about(file, "taps", remark));
    }
    let accepted = taps.accepted().count();
    let total = taps.taps.len();
    // Taps that the user left out are no news, unless none is left.
    let by_hand = taps.taps.iter();
    let by_hand = by_hand
        .filter(|tap| tap.rejection == Some(Rejection::ByHand))
        .count();
    let rejected = total - accepted - by_hand;
    if rejected > 0 {
        warnings.push(Warning::rejected_taps(file, rejected, total));
    }
    if accepted == 0 && by_hand > 0 {
        let text = format!("no tap is left; `reject_taps` names {by_hand} of {total}");
        warnings.push(Warning::about(file, "taps", text));
    }
    if let Some(text) = hammer_doubt(recording, source, taps) {
        warnings.push(Warning::about(file, "hammer-channel", text));
    }
    if accepted == 1 && matches!(source, TapSource::Hammer { .. }) {
        warnings.push(Warning::single_tap(file));
    }
    warnings
}

/// "16.55, 500.0"; `None` of an empty list.
fn frequencies(all: &[f64]) -> Option<String> {
    let words: Vec<String> = all.iter().map(|one| frequency_words(*one)).collect();
    (!words.is_empty()).then(|| words.join(", "))
}

/// Places that are listed after the worst one.
const MOST_PLACES: usize = 6;

/// Doubts of one check as one warning: the worst in full, the others by their places. Left out is what the taps' own
/// reasons and the warnings of the spectra say already.
///
/// "rec2.wav, 15.50 Hz: ... (The worst of 3; also 15.51 Hz in rec1.wav, rec3.wav. ...)"
pub(crate) fn of_quality(verdicts: &[QualityVerdict]) -> Vec<Warning> {
    let mut checks: Vec<(Check, Vec<&QualityVerdict>)> = Vec::new();
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
fn places(doubts: &[&QualityVerdict], worst: &QualityVerdict) -> Vec<String> {
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

/// Most modes named in one warning; the findings of the report name them all.
const MOST_NAMED: usize = 1;

/// One warning for each way in which modes of the named recordings change, with the recording in which they change most.
pub(crate) fn of_amplitude(all: Vec<(String, AmplitudeChanges)>) -> Vec<Warning> {
    let mut groups: Vec<(Way, Vec<(String, AmplitudeChanges)>)> = Vec::new();
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
    let warnings = groups.into_iter().map(|(_, group)| dependence(group));
    warnings.collect()
}

/// The warning about recordings, at least one, whose modes change in one way: that in which they change most, and the
/// others.
fn dependence(mut group: Vec<(String, AmplitudeChanges)>) -> Warning {
    let (mut worst, mut most) = (0, (0.0, 0.0));
    for (place, (_, changes)) in group.iter().enumerate() {
        for (_, change) in changes {
            if change.size() > most {
                (worst, most) = (place, change.size());
            }
        }
    }
    let (file, changes) = group.remove(worst);
    let named: Vec<String> = changes
        .iter()
        .take(MOST_NAMED)
        .map(|(mode, change)| format!("mode {mode} {change}"))
        .collect();
    let mut text = named.join("; ");
    match changes.len().saturating_sub(MOST_NAMED) {
        0 => {}
        1 => text += "; 1 more mode changes with it",
        more => text += &format!("; {more} more modes change with it"),
    }
    if let Some((_, first)) = changes.first() {
        text += &format!("; {}", first.way().cause());
    }
    text += "; a recording at a second tap level would confirm it, and frequencies should be stated with their \
             amplitude, or taken from softer taps";
    for (place, (file, changes)) in group.iter().enumerate() {
        let begin = if place == 0 { "; the same in" } else { ";" };
        let numbers: Vec<String> = changes.iter().map(|(mode, _)| mode.to_string()).collect();
        let plural = if changes.len() == 1 { "" } else { "s" };
        text += &format!("{begin} {file}: mode{plural} {}", numbers.join(", "));
    }
    Warning::about(&file, "amplitude-dependent", text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::amplitude::AmplitudeChange;
    use crate::warnings::together;

    #[test]
    fn regress_one_is_not_many() {
        let rejected = |rejected: usize| Warning::rejected_taps("a.wav", rejected, 5);
        assert!(rejected(1).to_string().contains("1 of 5 taps was rejected"));
        assert!(
            rejected(2)
                .to_string()
                .contains("2 of 5 taps were rejected")
        );
        let unpaired = |count: usize| Warning::unpaired(count).unwrap();
        assert!(unpaired(1).to_string().starts_with("1 peak belongs to"));
        assert!(unpaired(4).to_string().starts_with("4 peaks belong to"));
    }

    #[test]
    fn regress_what_differs_in_recording_and_number_alone_is_one_warning() {
        let rings = |file: &str, remaining| {
            Warning::not_rung_down(file, remaining, Window::Exponential { decay: remaining })
        };
        let hum =
            |file: &str, frequency| Warning::mains(file, frequency, PeakLabel::Mains(frequency));
        let alone = Warning::about("a.wav", "single-tap", "only one tap was averaged");
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

    #[test]
    fn regress_unlisted_peaks_are_one_warning_with_the_strongest_first() {
        let peaks = |count: usize| -> Vec<UnlistedPeak> {
            let all = [544.2, 812.0, 97.25, 1203.4, 300.0, 301.0, 302.0];
            let peaks = all.iter().zip([31.2, 30.0, 28.0, 27.0, 26.0, 25.0, 24.0]);
            let peaks = peaks.map(|(frequency, above_noise_db)| UnlistedPeak {
                frequency: *frequency,
                lines: 0..1,
                above_noise_db,
            });
            peaks.take(count).collect()
        };
        let of = |file, count| Warning::unlisted_peaks(file, &peaks(count), (0.0, 2000.0), true);
        assert_eq!(of("a.uff", 0), None);
        let text = |count| of("a.uff", count).unwrap().to_string();
        assert_eq!(
            text(1),
            "a.uff: a peak at 544.2 Hz, 31 dB over the noise, is no listed mode; zoom there (spectrum --zoom 489.8:598.6, or \
             band = [489.8, 598.6] in a description), and see in the chart whether the fitted curve follows the measured one"
        );
        let two = "a.uff: 2 peaks are no listed modes: 544.2 Hz, 31 dB over the noise; 812.0 Hz, 30 dB over the noise; zoom";
        assert!(text(2).starts_with(two), "{}", text(2));
        assert!(
            text(7).contains("300.0 Hz, 26 dB over the noise; and 2 more; zoom"),
            "{}",
            text(7)
        );
        // Where the band is narrow already, there is nothing to zoom.
        let zoomed = Warning::unlisted_peaks("a.uff", &peaks(1), (490.0, 599.0), false).unwrap();
        let text = zoomed.to_string();
        assert!(
            text.ends_with("no listed mode; measure at other points, or longer"),
            "{text}"
        );
        let all = ["b.uff", "a.uff"].map(|file| of(file, 1).unwrap());
        let found = together(all.to_vec());
        assert_eq!(found.len(), 1);
        let text = found[0].to_string();
        assert!(
            text.ends_with("(the same of a.uff: 544.2 Hz, 31 dB over the noise)"),
            "{text}"
        );
    }

    fn doubt(check: Check, place: (&str, f64), value: f64) -> QualityVerdict {
        QualityVerdict {
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
            let changes = vec![(1, change(frequency, damping))];
            let text = of_amplitude(vec![("a.wav".into(), changes)])[0].to_string();
            assert!(text.contains(cause), "{frequency:?} {damping:?}: {text}");
        }
    }

    #[test]
    fn regress_a_cause_is_said_of_the_modes_that_go_its_way_alone() {
        let softer = change([80.0, 80.5], [0.002, 0.002]);
        let stiffer = change([500.5, 500.0], [0.002, 0.002]);
        let text = |changes: Vec<(usize, AmplitudeChange)>| {
            of_amplitude(vec![("a.wav".into(), changes)])[0].to_string()
        };
        let alike = text(vec![(1, softer.clone()), (2, softer.clone())]);
        assert!(
            alike.contains("1 more mode changes with it; a joint"),
            "{alike}"
        );
        let mixed = of_amplitude(vec![(
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
        let found = of_amplitude(vec![
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

    /// A mode whose frequency stays within its bounds is ranked by its damping, and not by noise.
    #[test]
    fn regress_modes_that_rub_are_ranked_by_their_damping() {
        let little = change([80.0, 80.015], [0.002, 0.003]);
        let much = change([80.0, 80.001], [0.002, 0.006]);
        let found = of_amplitude(vec![
            ("a.wav".to_owned(), vec![(1, little)]),
            ("b.wav".to_owned(), vec![(1, much)]),
        ]);
        assert_eq!(found.len(), 1);
        assert!(found[0].to_string().starts_with("b.wav"), "{found:?}");
    }
}
