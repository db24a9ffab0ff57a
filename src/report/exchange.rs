//! Mode shapes and functions for other programs: universal files, and the same as CSV.
//!
//! The beam lies along X. Hammer and sensors act along Z, in the sense that is positive in the recordings.

use super::data_files::{functions_of, number, render_frf_csv, write};
use super::{ReportError, ReportFile};
use num_complex::Complex64;
use std::collections::BTreeMap;
use tapjoint_analysis::{
    Analysis, Frf, FrfSettings, NumberedPoints, PointShapes, frfs_of, point_shapes,
};
use tapjoint_description::SensorKind;
use tapjoint_signal::recording::{
    NodalMode, Node, Point, UffFormat, encode_frequency_responses_uff, encode_mode_shapes_uff,
    encode_nodes_uff,
};

/// Names of the files.
pub const EXCHANGED: [&str; 4] = ["modes.uff", "shapes.csv", "frfs.uff", "frfs.csv"];
/// Heads of `shapes.csv`.
const SHAPES: &str = "mode,frequency_Hz,frequency_std_Hz,damping_ratio,node,position_m,sensor,recording,displacement,displacement_std";
/// Direction of a point along +Z.
const ALONG_Z: i32 = 3;

/// Files for other programs, and what is not in them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExchangeFiles {
    /// `modes.uff` and `shapes.csv` where there are shapes, `frfs.uff` and `frfs.csv` where there are functions.
    pub files: Vec<ReportFile>,
    /// Sentences about what is left out.
    pub doubts: Vec<String>,
}

/// Returns the files for other programs. Universal files have nodes (dataset 15), mode shapes at the sensors (55) and
/// frequency response functions (58). Their units are SI (164), where the channels are calibrated. Tables hold the same.
///
/// # Errors
/// Values that are not finite; a table that cannot be written.
pub fn exchange_files(analysis: &Analysis) -> Result<ExchangeFiles, ReportError> {
    let shapes = point_shapes(analysis);
    let nodes = nodes_of(&shapes.points);
    let mut found = ExchangeFiles {
        files: Vec::new(),
        doubts: doubts(analysis, &shapes),
    };
    if !shapes.modes.is_empty() {
        let modes = shapes.modes.iter().map(|shape| {
            let values = shape.values.iter().map(|(point, own)| {
                let along = Complex64::new(own.value, 0.0);
                (*point as i64, [Complex64::ZERO, Complex64::ZERO, along])
            });
            let mode = NodalMode {
                frequency: shape.frequency,
                damping: shape.damping,
                shape: values.collect(),
            };
            (shape.mode as i64, mode)
        });
        let mut bytes = encode_nodes_uff(&nodes);
        bytes.extend(encode_mode_shapes_uff(
            &analysis.name,
            &modes.collect::<Vec<_>>(),
        )?);
        found.files.push(ReportFile {
            name: "modes.uff".to_owned(),
            bytes,
        });
        let table = render_shapes_csv(&shapes)?;
        found.files.push(ReportFile::of("shapes.csv", table));
    }
    let mut bytes = encode_nodes_uff(&nodes);
    let mut all: Vec<Frf> = Vec::new();
    for (index, recording) in analysis.recordings.iter().enumerate() {
        // Without a hammer there are none; the doubts say so.
        let frfs = frfs_of(recording, &FrfSettings::default()).unwrap_or_default();
        let Some(tap) = shapes.points.taps[index].filter(|_| !frfs.is_empty()) else {
            continue;
        };
        let sensed = recording
            .responses
            .iter()
            .zip(&shapes.points.responses[index]);
        let sensed = sensed.map(|(response, node)| Point {
            name: Some(response.name.clone()),
            node: *node as i64,
            // Sound has no direction.
            direction: if response.kind == Some(SensorKind::Sound) {
                0
            } else {
                ALONG_Z
            },
        });
        let hammer = Point {
            name: Some("hammer".to_owned()),
            node: tap as i64,
            direction: ALONG_Z,
        };
        let mut functions = functions_of(&frfs, sensed.collect(), &hammer);
        // The first line of text of each dataset.
        for one in &mut functions.responses {
            one.name = format!("{}, {}", one.name, recording.file);
        }
        bytes.extend(encode_frequency_responses_uff(
            &functions,
            UffFormat::Ascii,
        )?);
        all.extend(frfs);
    }
    if !all.is_empty() {
        found.files.push(ReportFile {
            name: "frfs.uff".to_owned(),
            bytes,
        });
        let table = render_frf_csv(&all)?;
        found.files.push(ReportFile::of("frfs.csv", table));
    } else {
        let reason = match shapes.points.taps.iter().any(Option::is_some) {
            true => "no tap was accepted, or each was overloaded",
            false => "without a hammer there is no function",
        };
        let doubt = format!("frfs.uff and frfs.csv are not written: {reason}");
        found.doubts.push(doubt);
    }
    Ok(found)
}

/// Returns the points with a place as nodes along X.
fn nodes_of(points: &NumberedPoints) -> BTreeMap<i64, Node> {
    let placed = (1..).zip(&points.places);
    let placed = placed.filter_map(|(number, place)| Some((number, (*place)?)));
    placed
        .map(|(number, place)| {
            let node = Node {
                place: [place, 0.0, 0.0],
                system: 0,
                displacement_system: 0,
            };
            (number, node)
        })
        .collect()
}

/// Returns one row for each mode and point.
fn render_shapes_csv(shapes: &PointShapes) -> Result<String, ReportError> {
    let mut rows = Vec::new();
    for shape in &shapes.modes {
        for (point, own) in &shape.values {
            rows.push(vec![
                shape.mode.to_string(),
                number(Some(shape.frequency)),
                number(shape.std),
                number(shape.damping),
                point.to_string(),
                number(shapes.points.places.get(point - 1).copied().flatten()),
                own.sensor.clone(),
                own.recording.clone(),
                number(Some(own.value)),
                number(Some(own.std)),
            ]);
        }
    }
    write(SHAPES, rows)
}

/// Says what `modes.uff` lacks, and why.
fn doubts(analysis: &Analysis, shapes: &PointShapes) -> Vec<String> {
    let mut doubts = Vec::new();
    let without: Vec<String> = shapes.without.iter().map(usize::to_string).collect();
    match (shapes.modes.is_empty(), &without[..]) {
        (true, _) => doubts.push(
            "modes.uff and shapes.csv are not written: no mode has a fit that gives its shape"
                .to_owned(),
        ),
        (false, []) => {}
        (false, numbers) => doubts.push(format!(
            "modes.uff lacks mode {}: no fit gives its shape",
            numbers.join(", ")
        )),
    }
    for (file, modes) in &shapes.apart {
        let modes: Vec<String> = modes.iter().map(usize::to_string).collect();
        doubts.push(format!(
            "modes.uff lacks what {file} shows of mode {}: it shares no sensor place away from a node and no tap place with the others; state `position` and `tap`",
            modes.join(", ")
        ));
    }
    for file in &shapes.loaded {
        doubts.push(format!(
            "modes.uff lacks the shapes of {file}: it has other fastened masses than the first recording"
        ));
    }
    let unknown = analysis.recordings.iter().filter(|one| {
        one.has_hammer && (one.tap_unit.is_none() || one.responses.iter().any(|r| r.unit.is_none()))
    });
    for recording in unknown {
        doubts.push(format!(
            "frfs.uff has the functions of {} in units of the file, not in SI units: state `scale` or `sensitivity`",
            recording.file
        ));
    }
    if !analysis.lengths.is_empty() {
        doubts.push("modes.uff lacks the shapes at the other free lengths".to_owned());
    }
    let sensed = shapes.points.responses.concat();
    let has_no_place = |point: &usize| {
        shapes
            .points
            .places
            .get(point - 1)
            .is_none_or(Option::is_none)
    };
    if sensed.iter().any(has_no_place) && !shapes.modes.is_empty() {
        doubts.push(
            "modes.uff has no place for some nodes: their sensors have no `position`".to_owned(),
        );
    }
    doubts
}
