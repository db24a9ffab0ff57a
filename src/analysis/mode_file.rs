//! Modes of a universal file that a description names: their frequencies, and their shapes along the beam.

use super::warnings::Warning;
use super::wiring::PipelineError;
use std::path::Path;
use tapjoint_beam::MEASURED_LIMIT;
use tapjoint_description::{Assembly, FirstNode, MeasuredFrequencies, ModeFile, TestDescription};
use tapjoint_identify::pairing::ShapeAt;
use tapjoint_signal::recording::{ModeShapes, NoLine, NodeLine, read_mode_shapes};

/// Standard uncertainty of a shape over its largest value (1). Files state none; moved sensors and taps repeat within a
/// few per cent.
const SHAPE_STD: f64 = 0.03;
/// Most nodes whose shapes are compared, evenly spread over the beam. More nodes add no information. The time grows with
/// their square.
const MOST_NODES: usize = 24;
/// Nodes may lie beyond the beam's end by this share of its length (1). This allows for the error of a tape measure.
const BEYOND_END: f64 = 0.01;
/// Ratio of motion at the joint to motion at the free end that suggests exchanged ends. On a soft joint both ends may move
/// alike.
const OTHER_END: f64 = 3.0;

/// Modes of a file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ModesOfFile {
    /// Frequencies with their bounds, as if the description listed them. Numbers only where it does.
    pub(super) measured: MeasuredFrequencies,
    /// Damping ratio (1) of each mode, where the file states it.
    pub(super) damping: Vec<Option<f64>>,
    /// Shape of each mode; empty where the places on the beam are not known.
    pub(super) shapes: Vec<Vec<ShapeAt>>,
    /// Indices of modes that do not move in the direction of the others.
    pub(super) other_direction: Vec<usize>,
    /// Names and positions (m) of the nodes of the shapes.
    pub(super) nodes: Vec<(String, f64)>,
    /// Doubts.
    pub(super) warnings: Vec<Warning>,
}

/// Reads the modes of the file that `[measured]` names. It lies in `folder`, and `test_file` is the description's name.
pub(super) fn read_modes(
    test: &TestDescription,
    measured: &MeasuredFrequencies,
    file: &ModeFile,
    folder: &Path,
    test_file: &str,
) -> Result<ModesOfFile, PipelineError> {
    let name = file.path.display().to_string();
    let mut read = read_mode_shapes(&folder.join(&file.path))?;
    let doubts = read.warnings.iter();
    let mut warnings: Vec<Warning> = doubts
        .map(|doubt| Warning::about(&name, doubt.code(), doubt))
        .collect();
    if read.modes.len() > MEASURED_LIMIT {
        let doubt = format!(
            "of its {} modes the lowest {MEASURED_LIMIT} are used; export fewer to choose among them",
            read.modes.len()
        );
        warnings.push(Warning::about(&name, "dataset-left-out", doubt));
        read.modes.truncate(MEASURED_LIMIT);
    }
    let count = read.modes.len();
    let complete = MeasuredFrequencies {
        file: None,
        frequencies: read.modes.iter().map(|mode| mode.frequency).collect(),
        modes: measured.modes.clone(),
        half_line: for_each(&measured.half_line, count),
        std: for_each(&measured.std, count),
        scatter: measured.scatter,
    };
    let lists = [
        (
            "modes",
            Some(complete.modes.len()).filter(|length| *length > 0),
        ),
        ("half_line", complete.half_line.as_ref().map(Vec::len)),
        ("std", complete.std.as_ref().map(Vec::len)),
    ];
    for (key, length) in lists {
        if let Some(length) = length.filter(|length| *length != count) {
            let plural = if length == 1 { "value" } else { "values" };
            let problem = format!(
                "{length} {plural} for {count} modes of {name}; give one for each mode, lowest first"
            );
            // The command line replaces the key.
            if key == "half_line" && !file.key_lines.contains_key(key) {
                let problem = format!("--half-line has {problem}");
                return Err(PipelineError::Description(problem));
            }
            let error = file.error(test_file, key, problem);
            return Err(PipelineError::Description(error.to_string()));
        }
    }
    let mut modes = ModesOfFile {
        measured: complete,
        damping: read.modes.iter().map(|mode| mode.damping).collect(),
        shapes: Vec::new(),
        other_direction: Vec::new(),
        nodes: Vec::new(),
        warnings,
    };
    // Stated numbers need no shapes.
    if modes.measured.modes.is_empty() {
        place_shapes(&mut modes, &read, test, file, test_file)?;
    }
    Ok(modes)
}

/// Returns one value for each of `count` modes where one for all was stated, else the list as it is.
fn for_each(stated: &Option<Vec<f64>>, count: usize) -> Option<Vec<f64>> {
    match stated.as_deref() {
        Some([one]) => Some(vec![*one; count]),
        _ => stated.clone(),
    }
}

/// Adds the shapes along the beam, or the doubt that says why they are left out.
fn place_shapes(
    modes: &mut ModesOfFile,
    read: &ModeShapes,
    test: &TestDescription,
    file: &ModeFile,
    test_file: &str,
) -> Result<(), PipelineError> {
    let name = file.path.display().to_string();
    let line = match read.along_line(file.first_node.map(|node| node.number)) {
        Ok(line) => line,
        Err(error @ NoLine::NotAtEnd { .. }) => {
            let remedy = "name the node that is nearest to the joint, or to the left end";
            let error = file.error(test_file, "first_node", format!("{error}; {remedy}"));
            return Err(PipelineError::Description(error.to_string()));
        }
        // A free beam is numbered without shapes.
        Err(_) if test.joint.kind == Assembly::Free => return Ok(()),
        Err(reason) => {
            modes
                .warnings
                .push(Warning::shapes_left_out(&name, &reason.to_string()));
            return Ok(());
        }
    };
    modes.other_direction = line.other_direction.clone();
    let others = line.other_direction.iter();
    let others: Vec<f64> = others.map(|&index| read.modes[index].frequency).collect();
    let doubt = Warning::other_direction(&name, &others, &line.direction);
    modes.warnings.extend(doubt);
    if test.joint.kind == Assembly::Free {
        return Ok(());
    }
    let Some(first) = file.first_node else {
        let [begin, .., end] = &line.nodes[..] else {
            return Ok(());
        };
        let reason = format!(
            "the file does not tell which end of its line of nodes is at the joint, or at the left end; add first_node = {{ number = {0}, position = \"... mm\" }} to [measured], or number = {1}, with the position of that node on the beam",
            begin.number, end.number
        );
        modes
            .warnings
            .push(Warning::shapes_left_out(&name, &reason));
        return Ok(());
    };
    let length = test.beam.length;
    let last = line.nodes.last().map_or(0.0, |node| node.distance);
    if first.position + last > (1.0 + BEYOND_END) * length {
        let reason = format!(
            "its nodes reach to {:.4} m, beyond the beam's end at {length} m; check the positions, the length, and the unit of the nodes (without a dataset 164 they are taken as metres)",
            first.position + last
        );
        modes
            .warnings
            .push(Warning::shapes_left_out(&name, &reason));
        return Ok(());
    }
    if let Some(free) = moves_at_joint(&line).filter(|_| test.joint.kind == Assembly::Cantilever) {
        let reason = format!(
            "in the lowest mode, node {} at the joint moves over {OTHER_END} times as far as node {free}; are the ends exchanged?",
            first.number
        );
        modes
            .warnings
            .push(Warning::shapes_left_out(&name, &reason));
        return Ok(());
    }
    take_shapes(modes, &line, first, length);
    Ok(())
}

/// Returns the last node of the line where the lowest mode moves far less there than at the first one: a cantilever's
/// lowest mode grows from the joint on.
fn moves_at_joint(line: &NodeLine) -> Option<i64> {
    let last = line.nodes.len().checked_sub(1)?;
    let lowest = line.shapes.iter().find(|shape| !shape.is_empty())?;
    let [begin, end] = [0, last].map(|node| lowest.iter().find(|at| at.node == node));
    let (begin, end) = (begin?.value.abs(), end?.value.abs());
    (begin > OTHER_END * end).then_some(line.nodes[last].number)
}

/// Takes the shapes at nodes that are evenly spread over the line.
fn take_shapes(modes: &mut ModesOfFile, line: &NodeLine, first: FirstNode, length: f64) {
    let last = line.nodes.len() - 1;
    let steps = last.min(MOST_NODES - 1);
    let mut positions = vec![None; line.nodes.len()];
    for step in 0..=steps {
        let index = step * last / steps.max(1);
        let node = &line.nodes[index];
        let position = (first.position + node.distance).min(length);
        positions[index] = Some(position);
        modes
            .nodes
            .push((format!("at node {}", node.number), position));
    }
    for shape in &line.shapes {
        let placed = shape.iter().filter_map(|at| {
            Some(ShapeAt {
                sensor: positions[at.node]?,
                tap: None,
                value: at.value,
                std: SHAPE_STD,
                group: 1,
            })
        });
        modes.shapes.push(placed.collect());
    }
}
