//! One list of numbered modes from several recordings, or from frequencies read elsewhere.

use super::analysis::{ModeResult, RecordingResult};
use super::between::{BetweenRecordings, between};
use super::consistent::StructureDetails;
use super::model::TestedStructure;
use super::numbering::number_jointed;
use super::warning::Warning;
use tapjoint_beam::{Assembly, JointStiffness, natural_frequencies};
use tapjoint_description::{MeasuredFrequencies, TestDescription};
use tapjoint_identify::observation::UNPAIRED;
use tapjoint_identify::{WeightedPeak, pair_by_ratio};
use tapjoint_numerics::stats::times;
use tapjoint_signal::modal::{BandReadings, ModeReading, merge_modes};

/// Recordings count as tapped at the same level when their median peak forces differ by less than
/// this factor.
const SAME_LEVEL: f64 = 2.0;

/// A free beam's frequencies may all differ from the nominal ones by this common factor: a modulus
/// wrong by 40 % is still recognised.
const FREE_BEAM_RANGE: f64 = 0.2;

/// Beside that factor a mode may be off by this much: what the lack of shear does to the fourth mode
/// of a usual bar.
const FREE_BEAM_TOLERANCE: f64 = 0.04;

/// What another sensor position or tap level moves a frequency at most, relative: 24 g at the end of a
/// usual bar are 3 %, a joint that softens by 15 % at the hardest tap 4 %. Bending modes are farther
/// apart.
const OTHER_CONFIGURATION: f64 = 0.05;

/// So many modes of a free beam are looked for.
const FREE_BEAM_MODES: usize = 30;

/// Indices of the recordings of the reference configuration: the first, and all others with its
/// sensor positions, fastened masses and tap level.
pub(super) fn reference_configuration(aside: &[Option<String>]) -> Vec<usize> {
    (0..aside.len())
        .filter(|&index| aside[index].is_none())
        .collect()
}

/// Of each recording how it differs from the first, so that it is left out of the list of modes; `None` where it does
/// not.
pub(super) fn set_aside(
    test: &TestDescription,
    recordings: &[RecordingResult],
) -> Vec<Option<String>> {
    let Some(first) = recordings.first() else {
        return Vec::new();
    };
    let described = test.recordings.first();
    let differs = |(index, own): (usize, &RecordingResult)| {
        let both = described.zip(test.recordings.get(index));
        let level = median_force(own)
            .zip(median_force(first))
            .map(|(own, first)| own / first)
            .filter(|ratio| ratio.max(1.0 / ratio) >= SAME_LEVEL);
        let words = [
            level.map(|ratio| format!("{} times its tap level", times(ratio))),
            both.filter(|(a, b)| a.at != b.at)
                .map(|_| "sensors elsewhere".to_owned()),
            both.filter(|(a, b)| a.masses != b.masses)
                .map(|_| "other masses fastened".to_owned()),
        ];
        let words: Vec<String> = words.into_iter().flatten().collect();
        (!words.is_empty()).then(|| words.join(", "))
    };
    recordings.iter().enumerate().map(differs).collect()
}

/// Median peak force of the accepted taps; `None` without a hammer or tap.
fn median_force(recording: &RecordingResult) -> Option<f64> {
    if !recording.has_hammer {
        return None;
    }
    let mut peaks: Vec<f64> = recording
        .measurement
        .taps
        .accepted()
        .map(|tap| tap.peak)
        .collect();
    peaks.sort_by(f64::total_cmp);
    peaks.get(peaks.len() / 2).copied()
}

/// Merges the readings of the `reference` recordings and numbers them; every recording's own
/// readings get the number of the mode they belong to.
pub fn modes_of_recordings(
    recordings: &mut [RecordingResult],
    reference: &[usize],
    (structure, details): (&TestedStructure, &StructureDetails),
) -> (Vec<ModeResult>, Vec<Warning>) {
    let merged = merge_modes(&readings_of(recordings, reference));
    let mut modes: Vec<ModeResult> = merged
        .into_iter()
        .map(|mode| {
            let file = reference
                .get(mode.recording)
                .map(|&index| recordings[index].file.clone());
            let lambda = Some(structure.beam.lambda_of(mode.reading.frequency));
            ModeResult {
                lambda,
                ..from_reading(mode.reading, file)
            }
        })
        .collect();
    let warnings = match structure.assembly {
        Assembly::Free => number_free(&mut modes, structure),
        Assembly::Cantilever | Assembly::Lap => {
            let seen: Vec<&RecordingResult> =
                reference.iter().map(|&index| &recordings[index]).collect();
            number_jointed(&mut modes, (structure, details), &seen)
        }
    };
    for recording in recordings.iter_mut() {
        recording.mode_numbers = own_numbers(&modes, &own_readings(recording));
    }
    for mode in &mut modes {
        mode.between = between_recordings(mode, recordings, reference);
    }
    (modes, warnings)
}

/// How far a mode's frequency scatters between the `reference` recordings.
fn between_recordings(
    mode: &ModeResult,
    recordings: &[RecordingResult],
    reference: &[usize],
) -> Option<BetweenRecordings> {
    let number = mode.mode?;
    let readings: Vec<ModeReading> = reference
        .iter()
        .filter_map(|&index| {
            let of_mode = |own: &Option<usize>| *own == Some(number);
            let place = recordings[index].mode_numbers.iter().position(of_mode)?;
            own_readings(&recordings[index]).into_iter().nth(place)
        })
        .collect();
    between(&readings)
}

/// The readings of a bare recording, numbered as they come.
pub(super) fn modes_of_bare(recording: &mut RecordingResult) -> Vec<ModeResult> {
    let file = Some(recording.file.clone());
    let mut modes: Vec<ModeResult> = own_readings(recording)
        .into_iter()
        .map(|reading| from_reading(reading, file.clone()))
        .collect();
    number_in_order(&mut modes);
    recording.mode_numbers = modes.iter().map(|mode| mode.mode).collect();
    modes
}

/// The frequencies that the description gives.
pub fn modes_of_measured(
    measured: &MeasuredFrequencies,
    structure: &TestedStructure,
) -> Vec<ModeResult> {
    measured
        .frequencies
        .iter()
        .enumerate()
        .map(|(index, &frequency)| {
            let of =
                |values: &Option<Vec<f64>>| values.as_ref().and_then(|v| v.get(index)).copied();
            let half_line = of(&measured.half_line);
            ModeResult {
                mode: measured.modes.get(index).copied(),
                frequency,
                half_line,
                std: standard_uncertainty(
                    frequency,
                    half_line,
                    of(&measured.std),
                    measured.scatter,
                ),
                between: None,
                reading: None,
                recording: None,
                label: None,
                lambda: Some(structure.beam.lambda_of(frequency)),
            }
        })
        .collect()
}

/// std^2 = half_line^2/3 + (scatter f)^2, or the stated std with the scatter added; `None` when
/// nothing is stated. A uniform distribution of half width h has the variance h^2/3.
fn standard_uncertainty(
    frequency: f64,
    half_line: Option<f64>,
    std: Option<f64>,
    scatter: Option<f64>,
) -> Option<f64> {
    let reading = std
        .map(|std| std * std)
        .or(half_line.map(|half| half * half / 3.0));
    let repeat = scatter.map(|scatter| (scatter * frequency).powi(2));
    if reading.is_none() && repeat.is_none() {
        return None;
    }
    Some((reading.unwrap_or(0.0) + repeat.unwrap_or(0.0)).sqrt())
}

pub(super) fn own_readings(recording: &RecordingResult) -> Vec<ModeReading> {
    recording
        .measurement
        .spectra
        .as_ref()
        .map_or(Vec::new(), |spectra| spectra.readings.clone())
}

fn readings_of(recordings: &[RecordingResult], which: &[usize]) -> Vec<BandReadings> {
    let shown = |recording: &RecordingResult| BandReadings {
        band: looked_at(recording).unwrap_or((0.0, f64::INFINITY)),
        readings: own_readings(recording),
    };
    which
        .iter()
        .map(|&index| shown(&recordings[index]))
        .collect()
}

/// Frequencies at which a recording was looked for resonances (Hz); `None` without spectra.
pub(super) fn looked_at(recording: &RecordingResult) -> Option<(f64, f64)> {
    let lines = recording.measurement.spectra.as_ref()?.averages.lines;
    Some((lines.low, lines.high))
}

fn from_reading(reading: ModeReading, recording: Option<String>) -> ModeResult {
    ModeResult {
        mode: None,
        frequency: reading.frequency,
        half_line: Some(reading.half_line),
        std: reading.std,
        between: None,
        label: reading.label.map(|label| label.to_string()),
        recording,
        lambda: None,
        reading: Some(reading),
    }
}

/// Numbers a free beam's modes by their nominal frequencies, where any is near one; else in ascending
/// order.
fn number_free(modes: &mut [ModeResult], structure: &TestedStructure) -> Vec<Warning> {
    let free: Vec<usize> = (0..modes.len())
        .filter(|&i| modes[i].label.is_none())
        .collect();
    let peaks: Vec<WeightedPeak> = free.iter().map(|&i| weighted(&modes[i])).collect();
    let nominal = natural_frequencies(
        structure.theory,
        &structure.beam,
        Assembly::Free,
        &JointStiffness::FREE,
        FREE_BEAM_MODES,
    )
    .unwrap_or_default();
    let numbers = pair_by_ratio(&peaks, &nominal, FREE_BEAM_RANGE, FREE_BEAM_TOLERANCE);
    if numbers.iter().any(Option::is_some) {
        let text = "none of the free beam's natural frequencies lies near them; another direction \
                    of bending, torsion, the supports or the room are the usual causes";
        return apply_numbers(modes, (&free, &numbers), text.to_string());
    }
    number_in_order(modes);
    if free.is_empty() {
        Vec::new()
    } else {
        vec![Warning::NumberedInOrder]
    }
}

/// A mode with its height over the noise, or its prominence, as weight.
fn weighted(mode: &ModeResult) -> WeightedPeak {
    let weight = mode.reading.as_ref().map_or(1.0, |reading| {
        reading
            .above_noise_db
            .or(reading.prominence_db)
            .unwrap_or(0.0)
    });
    WeightedPeak {
        frequency: mode.frequency,
        weight,
    }
}

/// Gives the peaks their numbers; those without one are labelled, and `text` says why.
pub(super) fn apply_numbers(
    modes: &mut [ModeResult],
    (which, numbers): (&[usize], &[Option<usize>]),
    text: String,
) -> Vec<Warning> {
    let mut unpaired = 0;
    for (&index, &number) in which.iter().zip(numbers) {
        modes[index].mode = number;
        if number.is_none() {
            modes[index].label = Some(UNPAIRED.to_string());
            unpaired += 1;
        }
    }
    if unpaired > 0 {
        vec![Warning::Unpaired {
            count: unpaired,
            text,
        }]
    } else {
        Vec::new()
    }
}

pub(super) fn number_in_order(modes: &mut [ModeResult]) {
    for (index, mode) in modes
        .iter_mut()
        .filter(|mode| mode.label.is_none())
        .enumerate()
    {
        mode.mode = Some(index + 1);
    }
}

/// The numbers of the modes that a recording's readings belong to. Each mode takes the reading nearest
/// to it, within their half lines together and [`OTHER_CONFIGURATION`], and no reading serves two
/// modes. A reading that lies nearer to a peak without a number is that peak's, if none is nearer to the peak: a torsion
/// mode stays one where the sensor sits on a node of the bending mode beside it, and a bending mode that moved towards
/// it stays that one.
pub(super) fn own_numbers(modes: &[ModeResult], readings: &[ModeReading]) -> Vec<Option<usize>> {
    let mut numbers = vec![None; readings.len()];
    for mode in modes.iter().filter(|mode| mode.mode.is_some()) {
        let distance = |index: &usize| (mode.frequency - readings[*index].frequency).abs();
        let nearest = (0..readings.len())
            .filter(|&index| readings[index].label.is_none() && numbers[index].is_none())
            .filter(|&index| !is_of_another(modes, mode, (readings, index)))
            .filter(|index| {
                let half_lines = mode.half_line.unwrap_or(0.0) + readings[*index].half_line;
                distance(index) <= half_lines + OTHER_CONFIGURATION * mode.frequency
            })
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(nearest) = nearest {
            numbers[nearest] = mode.mode;
        }
    }
    numbers
}

/// Peaks without a number that lie nearer than this to a mode may be a part of its line (1, relative).
const OF_ITS_LINE: f64 = 0.01;

/// Whether a reading lies nearer to a peak without a number, one apart from this mode, than to the mode, and is the one
/// that shows the peak: the nearest to it of all readings.
fn is_of_another(
    modes: &[ModeResult],
    mode: &ModeResult,
    (readings, index): (&[ModeReading], usize),
) -> bool {
    let frequency = readings[index].frequency;
    let apart =
        |peak: &&ModeResult| (peak.frequency - mode.frequency).abs() > OF_ITS_LINE * mode.frequency;
    let unpaired =
        |peak: &&ModeResult| peak.mode.is_none() && peak.label.as_deref() == Some(UNPAIRED);
    let own = (frequency - mode.frequency).abs();
    let shows = |peak: &ModeResult| {
        let distance = (frequency - peak.frequency).abs();
        let mut others = readings.iter().filter(|other| other.label.is_none());
        let nearer = others.any(|other| (other.frequency - peak.frequency).abs() < distance);
        distance < own && !nearer
    };
    let mut peaks = modes.iter().filter(unpaired).filter(apart);
    peaks.any(shows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(frequency: f64) -> ModeReading {
        ModeReading::on_line(frequency, 0.1)
    }

    fn mode(number: Option<usize>, frequency: f64) -> ModeResult {
        ModeResult {
            mode: number,
            label: number.is_none().then(|| UNPAIRED.to_owned()),
            ..from_reading(reading(frequency), None)
        }
    }

    /// A torsion mode at 1055 Hz beside a bending mode at 1090 Hz on whose node the sensor sits.
    #[test]
    fn regress_a_reading_near_a_peak_without_a_number_is_no_mode() {
        let modes = [
            mode(Some(4), 700.0),
            mode(None, 1055.1),
            mode(Some(5), 1090.0),
        ];
        let numbers = |all: &[f64]| {
            let readings: Vec<ModeReading> = all.iter().map(|f| reading(*f)).collect();
            own_numbers(&modes, &readings)
        };
        assert_eq!(numbers(&[701.0, 1055.2]), [Some(4), None]);
        assert_eq!(numbers(&[1055.2, 1085.0]), [None, Some(5)]);
        // A moved mode, nearer to the peak than to where it was: the peak has a reading of its own.
        assert_eq!(numbers(&[1055.2, 1070.0]), [None, Some(5)]);
        // A second pole of the mode's own line takes nothing from it.
        let split = [mode(None, 1089.0), mode(Some(5), 1090.0)];
        assert_eq!(own_numbers(&split, &[reading(1089.1)]), [Some(5)]);
    }
}
