//! Time series of a universal file as a recording.
//!
//! The channels are the file's time series in their order. They must have been sampled together:
//! the same step, number of points and start. Where some were not (a slow tacho beside vibration,
//! a second run), the largest set that was is the recording, the first of equally large ones, and a
//! warning names each dataset that is left out. Where the file ends early, all channels end with
//! the shortest that has a value at all.

use std::path::Path;

use super::axis::{UnitSystem, channel_si};
use super::error::UffError;
use super::header::{Function, FunctionType, Ordinate};
use super::list::{Dataset, UniversalFile, describe, list_datasets};
use super::source::{KEPT_SAMPLES, Measured, UffSource, cut_to_shortest, pass};
use super::timing::{AbscissaUnit, EvenPoints, even_points, largest_group};
use super::values::Values;
use crate::recording::health::HealthMeter;
use crate::recording::open::{check_rate, ignored_rate};
use crate::recording::riff::MAX_CHANNELS;
use crate::recording::text::short;
use crate::recording::{
    ChannelInfo, ChannelLabel, Format, ReadSettings, Recording, RecordingError, RecordingWarning,
    Source,
};

/// A time series and when it was sampled.
type Series<'a> = (&'a Dataset, &'a Function);

/// Opens the time series of a universal file.
pub(in crate::recording) fn open_uff(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let listed = list_datasets(path)?;
    let (channels, points, mut warnings) = choose(&listed)?;
    let sample_rate = 1.0 / points.step;
    check_rate(&file, sample_rate)?;
    warnings.extend(ignored_rate(settings, sample_rate));
    let mut read = Vec::with_capacity(channels.len());
    let mut room = KEPT_SAMPLES;
    for (at, series) in channels.into_iter().enumerate() {
        let mut values = Values::new(&listed, series.0, series.1)?;
        let (count, meter) = pass(&file, sample_rate, (at, &mut values), u64::MAX, &mut room)?;
        if count > 0 {
            read.push(Measured {
                series,
                values,
                count,
                meter,
            });
        } else {
            let reason = "the file ends before its first value".to_owned();
            warnings.push(left_out(series, reason));
        }
    }
    if read.is_empty() {
        return Err(RecordingError::NoSamples { file });
    }
    let frames = cut_to_shortest(&file, sample_rate, &mut read)?;
    if frames < points.points {
        warnings.push(RecordingWarning::Truncated {
            present: frames,
            promised: points.points,
        });
    }
    let (channels, (values, healths)): (Vec<Series<'_>>, (Vec<_>, Vec<_>)) = read
        .into_iter()
        .map(|read| (read.series, (read.values, read.meter)))
        .unzip();
    let names = channel_names(&channels);
    let mut infos = Vec::with_capacity(channels.len());
    for (at, ((series, health), name)) in channels.iter().zip(healths).zip(names).enumerate() {
        let (info, doubts) = channel_info(listed.units, (at, name), series.1, health);
        infos.push(info);
        warnings.extend(doubts);
    }
    warnings.extend(repeated_places(&channels, &infos));
    let coding = channels.first().map(|(_, function)| function.coding);
    Ok(Recording {
        name: file,
        path: Some(path.to_owned()),
        format: Format::Uff58 {
            coding: coding.unwrap_or(super::UffCoding::Ascii),
        },
        sample_rate,
        frames,
        channels: infos,
        warnings,
        source: Source::Uff(Box::new(UffSource { values, frames })),
    })
}

/// A channel, its values in SI where its unit is known, and the doubts about its unit.
fn channel_info(
    system: Option<UnitSystem>,
    (at, name): (usize, Option<String>),
    function: &Function,
    health: HealthMeter,
) -> (ChannelInfo, Vec<RecordingWarning>) {
    let unit = channel_si(
        &function.numerator,
        system,
        function.response.is_rotational(),
    );
    let channel = ChannelLabel {
        number: at + 1,
        name: name.clone(),
    };
    let header_unit = function.numerator.unit.clone();
    let label = header_unit.clone().unwrap_or_default();
    let mut warnings = Vec::new();
    if let Some(by_system) = unit.contradiction {
        warnings.push(RecordingWarning::UnitsDisagree {
            channel,
            unit: label,
            used: unit.factor,
            by_system,
        });
    } else if !unit.known {
        let unit = label;
        warnings.push(RecordingWarning::UnknownUnit { channel, unit });
    }
    let info = ChannelInfo {
        name,
        unit: unit.unit,
        header_unit,
        scale: unit.factor,
        health: health.finish().scaled(unit.factor),
    };
    (info, warnings)
}

/// The time series that become channels, their timing, and what there is to say about the others.
fn choose(
    file: &UniversalFile,
) -> Result<(Vec<Series<'_>>, EvenPoints, Vec<RecordingWarning>), RecordingError> {
    let mut warnings: Vec<RecordingWarning> = file
        .cut_header
        .map(|dataset| RecordingWarning::HeaderCut { dataset })
        .into_iter()
        .collect();
    let (mut usable, mut unusable) = (Vec::new(), Vec::new());
    for (dataset, function) in file.functions().filter(|(_, f)| f.is_time_series()) {
        let timing = match function.ordinate {
            Ordinate::Complex => Err("its values are complex".to_owned()),
            Ordinate::Real => even_points(file, (dataset, function), AbscissaUnit::Seconds)?,
        };
        match timing {
            Ok(timing) => usable.push(((dataset, function), timing)),
            Err(problem) => unusable.push(((dataset, function), problem)),
        }
    }
    let (kept, others) = largest_group(usable);
    let Some(points) = kept.first().map(|(_, points)| *points) else {
        return Err(no_time_series(file, unusable.first()).into());
    };
    let kept: Vec<Series<'_>> = kept.into_iter().map(|(series, _)| series).collect();
    if kept.len() > MAX_CHANNELS {
        return Err(RecordingError::TooManyChannels {
            file: file.name.clone(),
            channels: kept.len(),
            limit: MAX_CHANNELS,
        });
    }
    let first = kept.first().map_or(0, |(dataset, _)| dataset.number);
    let others = others.into_iter().map(|(series, other)| {
        let reason = format!(
            "{}, where dataset {first} has {}",
            timing_words(&other),
            timing_words(&points)
        );
        (series, reason)
    });
    let mut unused: Vec<(Series<'_>, String)> = unusable.into_iter().chain(others).collect();
    unused.sort_by_key(|((dataset, _), _)| dataset.number);
    warnings.extend(
        unused
            .into_iter()
            .map(|(series, reason)| left_out(series, reason)),
    );
    Ok((kept, points, warnings))
}

fn left_out((dataset, function): Series<'_>, reason: String) -> RecordingWarning {
    RecordingWarning::DatasetLeftOut {
        dataset: dataset.number,
        name: describe(function),
        reason,
    }
}

fn timing_words(points: &EvenPoints) -> String {
    format!(
        "{} points at {} Hz from {} s",
        points.points,
        short(1.0 / points.step),
        short(points.start)
    )
}

/// Why there is no time series, and what to do.
fn no_time_series(file: &UniversalFile, unusable: Option<&(Series<'_>, String)>) -> UffError {
    let name = || file.name.clone();
    if let Some(((dataset, function), problem)) = unusable {
        return UffError::BadTimeSeries {
            file: name(),
            dataset: dataset.number,
            name: describe(function),
            problem: problem.clone(),
            remedy: "export real values at an even step",
        };
    }
    let found = file.contents();
    if file.functions().next().is_none() {
        return UffError::NoFunctions {
            file: name(),
            found,
        };
    }
    let responses = file
        .functions()
        .any(|(_, f)| f.function_type == FunctionType::FREQUENCY_RESPONSE);
    let remedy = match responses {
        true => {
            "its frequency response functions are read in a test description: give the file's [[recording]] form = \"accelerance\" (or \"mobility\", \"receptance\"), or without one by `tapjoint run FILE` and `tapjoint spectrum FILE`"
        }
        false => "export the time series of hammer and sensors",
    };
    UffError::NoTimeSeries {
        file: name(),
        found,
        remedy,
    }
}

/// Names of the channels: the first of entity name, degree of freedom, axis label and description
/// that every channel has and that tells all of them apart; else whatever a channel has.
fn channel_names(channels: &[Series<'_>]) -> Vec<Option<String>> {
    let sources: [fn(&Function) -> Option<String>; 4] = [
        |function| function.response.name.clone(),
        |function| function.response.degree_of_freedom(),
        |function| function.numerator.label.clone(),
        |function| function.id_lines[0].clone(),
    ];
    let by = |source: &fn(&Function) -> Option<String>| -> Vec<Option<String>> {
        channels
            .iter()
            .map(|(_, function)| source(function))
            .collect()
    };
    let telling = sources.iter().map(by).find(|names| {
        let mut sorted: Vec<&String> = names.iter().flatten().collect();
        sorted.sort();
        sorted.dedup();
        sorted.len() == channels.len()
    });
    telling.unwrap_or_else(|| {
        let any = |function: &Function| sources.iter().find_map(|source| source(function));
        channels.iter().map(|(_, function)| any(function)).collect()
    })
}

/// Channels that claim the place and the quantity of an earlier one: several runs in one file.
fn repeated_places(channels: &[Series<'_>], infos: &[ChannelInfo]) -> Option<RecordingWarning> {
    let place = |function: &Function| {
        let of = &function.response;
        let known = of.node != 0;
        known.then(|| (of.clone(), function.numerator.quantity))
    };
    let places: Vec<_> = channels
        .iter()
        .map(|(_, function)| place(function))
        .collect();
    let label = |at: usize| ChannelLabel {
        number: at + 1,
        name: infos.get(at).and_then(|info| info.name.clone()),
    };
    places.iter().enumerate().find_map(|(at, place)| {
        let place = place.as_ref()?;
        let earlier = places
            .iter()
            .take(at)
            .position(|other| other.as_ref() == Some(place))?;
        Some(RecordingWarning::RepeatedPlace {
            channel: label(at),
            earlier: label(earlier),
            place: place.0.to_string(),
        })
    })
}
