//! Modes of a universal file: data at nodes (dataset 55) and the places of the nodes (datasets 15 and 2411).
//!
//! A dataset 55 of a normal mode or of a complex eigenvalue states the frequency and the damping of one mode. Its values
//! at the nodes are the mode's shape where they are displacements, velocities or accelerations. Source: the
//! descriptions of universal datasets 15, 55, 164 and 2411 by the Structural Dynamics Research Laboratory, University of
//! Cincinnati.
//!
//! Important conventions:
//! - Eigenvalues are in rad/s. The natural frequency of s is |s|/2 pi, its damping ratio -Re(s)/|s|.
//! - Datasets of the same load case, mode number and frequency are one mode: programs write one for each quantity or part.
//!   Its shape is of the first quantity.
//! - Places are in metres by the file's unit system (dataset 164), and without one as they stand.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

use num_complex::Complex64;

use super::list::{Dataset, Scanner, UniversalFile, line_number, list_datasets};
use super::{ACCELERATION, DISPLACEMENT, Record, VELOCITY};
use crate::recording::error::{RecordingError, RecordingWarning};
use crate::recording::text::{parse_line, shown};
use crate::recording::{FileType, recognise, refuse_pipe};

/// Type of a dataset of data at nodes.
const DATA_AT_NODES: u32 = 55;
/// Header records of a dataset 55.
const HEADER_LINES: usize = 8;
/// Largest number of nodes and nodal values in one file. Measured grids have hundreds of nodes; the limit keeps a mesh of
/// finite elements out of memory.
const MOST_VALUES: usize = 1_000_000;
/// Values as which a mode counts against that limit: its header takes about as long to read as 100 values.
const VALUES_OF_MODE: usize = 100;
/// Below this share of the highest frequency a mode is a rigid-body mode. Solvers in single precision leave it some 1e-5
/// of the highest instead of 0; the lowest bending mode of a measured beam lies above 1e-3.
const RIGID: f64 = 1e-4;
/// Highest frequency that is accepted (Hz).
const LARGEST_FREQUENCY: f64 = 1e9;

/// Modes and nodes of a universal file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShapes {
    /// The file as the caller named it.
    pub file: String,
    /// Modes, ascending in frequency.
    pub modes: Vec<NodalMode>,
    /// Nodes by their numbers.
    pub nodes: BTreeMap<i64, Node>,
    /// True if the file defines coordinate systems (dataset 18 or 2420).
    pub defines_systems: bool,
    /// Doubts about the file.
    pub warnings: Vec<RecordingWarning>,
}

/// A mode, as its datasets 55 state it.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalMode {
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Damping ratio (1); `None` where the file states none.
    pub damping: Option<f64>,
    /// Translation along X, Y and Z of each node by its number, in any unit; empty where the file has none.
    pub shape: BTreeMap<i64, [Complex64; 3]>,
}

/// Place of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Coordinates (m).
    pub place: [f64; 3],
    /// Number of the coordinate system in which they are stated.
    pub system: i64,
    /// Number of the coordinate system in which the displacements are stated.
    pub displacement_system: i64,
}

/// Reads the modes of a universal file and the places of its nodes.
///
/// # Errors
/// A file that cannot be read or is no universal file; one without modes; headers and numbers that make no sense; more
/// values than a measured grid has.
pub fn read_mode_shapes(path: &Path) -> Result<ModeShapes, RecordingError> {
    let name = path.display().to_string();
    refuse_pipe(path, &name)?;
    let remedy = "export the modes as a universal file with datasets 55 and 15 or 2411";
    if recognise(path, &name)? != FileType::Universal {
        let problem = format!("is no universal file; {remedy}");
        return Err(RecordingError::new(&name, problem));
    }
    let file = list_datasets(path)?;
    let mut reader = ModeReader {
        scanner: Scanner::new(path, &name)?,
        file: &file,
        values: 0,
    };
    let mut nodes = BTreeMap::new();
    let (mut forward, mut conjugate) = (ModeSet::default(), ModeSet::default());
    let mut warnings = Vec::from_iter(file.cut_header_doubt());
    let mut still = 0;
    for dataset in &file.datasets {
        if dataset.place.cut && [15, DATA_AT_NODES, 2411].contains(&dataset.kind) {
            let message = format!(
                "the file ends within dataset {}; its complete nodes are used; export or copy the file again",
                dataset.number
            );
            warnings.push(RecordingWarning::new("truncated", message));
        }
        match dataset.kind {
            15 => reader.nodes_in_one_line(dataset, &mut nodes)?,
            2411 => reader.nodes_in_two_lines(dataset, &mut nodes)?,
            DATA_AT_NODES => {
                let Some(read) = reader.mode(dataset)? else {
                    continue;
                };
                match read.turn {
                    Turn::Still => still += 1,
                    Turn::Forward => forward.add(read),
                    Turn::Conjugate => conjugate.add(read),
                }
            }
            _ => {}
        }
    }
    // Some programs write the conjugates alone.
    let (found, conjugates) = match forward.datasets {
        0 => (conjugate, 0),
        _ => (forward, conjugate.datasets),
    };
    if found.datasets == 0 {
        let problem = format!(
            "holds no mode (dataset 55 of analysis type 2, 3 or 7 with a frequency above 0), only {}; {remedy}",
            file.contents()
        );
        return Err(RecordingError::new(&name, problem));
    }
    let other_load_cases = found.other_load_cases;
    let groups = found.groups.into_values();
    let mut modes: Vec<NodalMode> = groups
        .flat_map(|group| group.modes.into_values())
        .map(|read| read.mode)
        .collect();
    let highest = modes.last().map_or(0.0, |mode| mode.frequency);
    let before = modes.len();
    modes.retain(|mode| mode.frequency > RIGID * highest);
    still += before - modes.len();
    let left_out = [
        (still, "rigid-body or overdamped modes"),
        (
            conjugates,
            "eigenvalues with a negative imaginary part, the conjugates of the others",
        ),
        (
            other_load_cases,
            "modes with a frequency of an earlier load case",
        ),
    ];
    for (count, reason) in left_out {
        if count > 0 {
            let message = format!("{count} datasets are left out: {reason}");
            warnings.push(RecordingWarning::new("dataset-left-out", message));
        }
    }
    let highest_damping = modes.iter().filter_map(|mode| mode.damping);
    let highest_damping = highest_damping.fold(0.0, f64::max);
    if highest_damping >= 1.0 {
        for mode in &mut modes {
            mode.damping = None;
        }
        let message = format!(
            "damping ratios are left out: one is {highest_damping}, and an oscillation has less than 1; they are probably in per cent; export them as ratios"
        );
        warnings.push(RecordingWarning::new("damping-left-out", message));
    }
    // File units are SI units times the factor.
    let factor = file.units.map_or(1.0, |units| units.length);
    for node in nodes.values_mut() {
        node.place = node.place.map(|coordinate| coordinate / factor);
    }
    Ok(ModeShapes {
        file: name,
        modes,
        nodes,
        defines_systems: file
            .datasets
            .iter()
            .any(|dataset| [18, 2420].contains(&dataset.kind)),
        warnings,
    })
}

/// A dataset 55 of a mode.
struct ReadMode {
    load_case: i64,
    number: i64,
    /// Quantity of the shape, as its record 6 states it.
    quantity: i64,
    mode: NodalMode,
    turn: Turn,
}

/// Modes of a file.
#[derive(Default)]
struct ModeSet {
    /// By the bits of the frequency, which ascend with it.
    groups: BTreeMap<u64, FrequencyGroup>,
    /// Number of datasets added.
    datasets: usize,
    /// Number of datasets that are left out, because an earlier load case has the same frequency.
    other_load_cases: usize,
}

/// Modes of one frequency.
struct FrequencyGroup {
    load_case: i64,
    /// By the mode number.
    modes: BTreeMap<i64, ReadMode>,
}

impl ModeSet {
    /// Adds a dataset: a new mode, or a part of one.
    fn add(&mut self, read: ReadMode) {
        self.datasets += 1;
        let group = self.groups.entry(read.mode.frequency.to_bits());
        let group = group.or_insert_with(|| FrequencyGroup {
            load_case: read.load_case,
            modes: BTreeMap::new(),
        });
        if group.load_case != read.load_case {
            self.other_load_cases += 1;
            return;
        }
        let Some(first) = group.modes.get_mut(&read.number) else {
            group.modes.insert(read.number, read);
            return;
        };
        let mode = &mut first.mode;
        mode.damping = mode.damping.or(read.mode.damping);
        if mode.shape.is_empty() {
            first.quantity = read.quantity;
        }
        // Displacements and accelerations have other units.
        if first.quantity == read.quantity {
            for (node, value) in read.mode.shape {
                mode.shape.entry(node).or_insert(value);
            }
        }
    }
}

/// Sign of the imaginary part of an eigenvalue.
enum Turn {
    Forward,
    /// Not at all.
    Still,
    Conjugate,
}

/// A line and its place in the file.
struct Line {
    place: u64,
    text: Vec<u8>,
}

/// Reads datasets line by line.
struct ModeReader<'a> {
    scanner: Scanner,
    file: &'a UniversalFile,
    /// Values at nodes read so far.
    values: usize,
}

impl ModeReader<'_> {
    /// Returns the next line of a dataset that is not blank; `None` at its end, and for a line that the end of a
    /// truncated file may have cut.
    fn line(&mut self, dataset: &Dataset) -> Result<Option<Line>, RecordingError> {
        while self.scanner.position() < dataset.place.end {
            let place = self.scanner.position();
            match self.scanner.line()? {
                Some(text) if text.trim_ascii().is_empty() => {}
                // The last number of a truncated file may be incomplete.
                Some(_) if self.is_at_cut(dataset) => return Ok(None),
                Some(text) => return Ok(Some(Line { place, text })),
                None => break,
            }
        }
        Ok(None)
    }

    /// Returns `true` behind the last line of a truncated file.
    fn is_at_cut(&self, dataset: &Dataset) -> bool {
        dataset.place.cut && self.scanner.position() >= dataset.place.end
    }

    /// Returns the error of a line.
    fn error(&self, dataset: &Dataset, place: u64, problem: &str) -> RecordingError {
        let line = line_number(&self.file.path, place);
        let problem = format!(
            "dataset {} (type {}) has {problem}; export the file again",
            dataset.number, dataset.kind
        );
        RecordingError::at_line(&self.file.name, line, problem)
    }

    /// Appends the numbers of a line, at most `room`.
    fn numbers(
        &self,
        dataset: &Dataset,
        line: &Line,
        widths: &[usize],
        room: usize,
        into: &mut Vec<f64>,
    ) -> Result<(), RecordingError> {
        let before = into.len();
        let read = parse_line(&line.text, widths, room, into);
        let bad = match read {
            Err(text) => Some(shown(text)),
            Ok(()) => {
                let added = into[before..].iter();
                let mut damaged = added.filter(|value| !value.is_finite());
                damaged.next().map(|value| value.to_string())
            }
        };
        match bad {
            None => Ok(()),
            Some(bad) => {
                let problem = format!(
                    "\"{bad}\"; allowed: finite numbers in columns of 13 or 20, or between blanks"
                );
                Err(self.error(dataset, line.place, &problem))
            }
        }
    }

    /// Reads the number of a node, the first word of a line.
    fn node_number(&self, dataset: &Dataset, line: &Line) -> Result<i64, RecordingError> {
        integer_field(line, 0).ok_or_else(|| {
            let value = shown(line.text.trim_ascii());
            let problem = format!("the node number \"{value}\"; allowed: a whole number");
            self.error(dataset, line.place, &problem)
        })
    }

    /// Counts so many values against the limit.
    fn count(
        &mut self,
        dataset: &Dataset,
        place: u64,
        values: usize,
    ) -> Result<(), RecordingError> {
        self.values += values;
        if self.values <= MOST_VALUES {
            return Ok(());
        }
        let line = line_number(&self.file.path, place);
        let problem = format!(
            "with dataset {} the file holds more than {MOST_VALUES} nodes and values at nodes, where a mode counts as {VALUES_OF_MODE}; allowed: up to {MOST_VALUES}; export the measured points and modes alone",
            dataset.number
        );
        Err(RecordingError::at_line(&self.file.name, line, problem))
    }

    /// Reads nodes of dataset 15, Format(4I10,3E13.5).
    fn nodes_in_one_line(
        &mut self,
        dataset: &Dataset,
        nodes: &mut BTreeMap<i64, Node>,
    ) -> Result<(), RecordingError> {
        self.scanner.jump(dataset.place.start)?;
        while let Some(line) = self.line(dataset)? {
            let mut numbers = Vec::new();
            let widths = [10, 10, 10, 10, 13, 13, 13];
            self.numbers(dataset, &line, &widths, widths.len(), &mut numbers)?;
            let [_, system, displacement_system, _, x, y, z] = numbers[..] else {
                let problem = format!(
                    "{} numbers for a node; allowed: 7, its number, three more whole numbers, X, Y and Z",
                    numbers.len()
                );
                return Err(self.error(dataset, line.place, &problem));
            };
            let number = self.node_number(dataset, &line)?;
            self.count(dataset, line.place, 1)?;
            nodes.insert(
                number,
                Node {
                    place: [x, y, z],
                    system: system as i64,
                    displacement_system: displacement_system as i64,
                },
            );
        }
        Ok(())
    }

    /// Reads nodes of dataset 2411, Format(4I10), then Format(1P3D25.16).
    fn nodes_in_two_lines(
        &mut self,
        dataset: &Dataset,
        nodes: &mut BTreeMap<i64, Node>,
    ) -> Result<(), RecordingError> {
        self.scanner.jump(dataset.place.start)?;
        while let Some(line) = self.line(dataset)? {
            let number = self.node_number(dataset, &line)?;
            let [system, displacement_system] =
                [1, 2].map(|field| integer_field(&line, field).unwrap_or(0));
            let mut place = Vec::new();
            let behind = match self.line(dataset)? {
                Some(line) => {
                    self.numbers(dataset, &line, &[25; 3], 3, &mut place)?;
                    line.place
                }
                None if dataset.place.cut => break,
                None => line.place,
            };
            let [x, y, z] = place[..] else {
                let problem = format!(
                    "{} coordinates for node {number}; allowed: 3, X, Y and Z, in the line behind its number",
                    place.len()
                );
                return Err(self.error(dataset, behind, &problem));
            };
            self.count(dataset, line.place, 1)?;
            nodes.insert(
                number,
                Node {
                    place: [x, y, z],
                    system,
                    displacement_system,
                },
            );
        }
        Ok(())
    }

    /// Reads a dataset 55; `None` where it holds no mode, or ends within its header with the file.
    fn mode(&mut self, dataset: &Dataset) -> Result<Option<ReadMode>, RecordingError> {
        self.scanner.jump(dataset.place.start)?;
        let mut header = Vec::with_capacity(HEADER_LINES);
        // The five lines of text may be blank.
        while header.len() < HEADER_LINES && self.scanner.position() < dataset.place.end {
            let place = self.scanner.position();
            let Some(text) = self.scanner.line()? else {
                break;
            };
            header.push(Line { place, text });
        }
        let [.., kind, integers, reals] = &header[..] else {
            return self.short_header(dataset);
        };
        if header.len() < HEADER_LINES || self.is_at_cut(dataset) {
            return self.short_header(dataset);
        }
        let layout = Layout::read(&Record::of(&kind.text))
            .map_err(|problem| self.error(dataset, kind.place, &problem))?;
        if layout.analysis == Analysis::Other {
            return Ok(None);
        }
        let mut numbers = Vec::new();
        self.numbers(dataset, reals, &[13; 6], 6, &mut numbers)?;
        let (frequency, damping, turn) = match layout.analysis {
            Analysis::NormalMode => normal_mode(&numbers),
            Analysis::Eigenvalue | Analysis::Other => eigenvalue(&numbers),
        }
        .map_err(|problem| self.error(dataset, reals.place, &problem))?;
        self.count(dataset, reals.place, VALUES_OF_MODE)?;
        let [load_case, number] = [2, 3].map(|field| integer_field(integers, field).unwrap_or(0));
        let mut read = ReadMode {
            load_case,
            number,
            quantity: layout.quantity,
            mode: NodalMode {
                frequency,
                damping,
                shape: BTreeMap::new(),
            },
            turn,
        };
        if layout.moves {
            self.shape(dataset, &layout, &mut read.mode.shape)?;
        }
        Ok(Some(read))
    }

    fn short_header(&self, dataset: &Dataset) -> Result<Option<ReadMode>, RecordingError> {
        if dataset.place.cut {
            return Ok(None);
        }
        let problem = format!("fewer than {HEADER_LINES} header records");
        Err(self.error(dataset, dataset.place.start, &problem))
    }

    /// Reads the values at the nodes: the node's number, then its values in lines of six.
    fn shape(
        &mut self,
        dataset: &Dataset,
        layout: &Layout,
        shape: &mut BTreeMap<i64, [Complex64; 3]>,
    ) -> Result<(), RecordingError> {
        let count = layout.values * if layout.is_complex { 2 } else { 1 };
        let widths: &[usize] = if layout.is_double { &[20; 4] } else { &[13; 6] };
        while let Some(line) = self.line(dataset)? {
            let node = self.node_number(dataset, &line)?;
            let mut numbers = Vec::with_capacity(count);
            while numbers.len() < count {
                let Some(values) = self.line(dataset)? else {
                    break;
                };
                let room = count - numbers.len();
                self.numbers(dataset, &values, widths, room, &mut numbers)?;
            }
            if numbers.len() < count {
                if dataset.place.cut {
                    break;
                }
                let problem = format!(
                    "{} values at node {node}; allowed: {count}, as its record 6 states",
                    numbers.len()
                );
                return Err(self.error(dataset, line.place, &problem));
            }
            self.count(dataset, line.place, 1)?;
            let part = |axis: usize| match layout.is_complex {
                true => Complex64::new(numbers[2 * axis], numbers[2 * axis + 1]),
                false => Complex64::new(numbers[axis], 0.0),
            };
            shape.insert(node, [part(0), part(1), part(2)]);
        }
        Ok(())
    }
}

/// Returns a whole number (from 0) of a line: in columns of 10, or between blanks.
fn integer_field(line: &Line, number: usize) -> Option<i64> {
    let record = Record::of(&line.text);
    record
        .integer(10 * number, 10)
        .or_else(|| record.word(number)?.parse().ok())
}

/// Kind of analysis by which data at nodes were computed or measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Analysis {
    NormalMode,
    /// Complex eigenvalue, of first or second order.
    Eigenvalue,
    /// No mode.
    Other,
}

/// Record 6 of a dataset 55, Format(6I10).
struct Layout {
    analysis: Analysis,
    /// Quantity of the values.
    quantity: i64,
    /// True where the values are motion along X, Y and Z.
    moves: bool,
    is_complex: bool,
    is_double: bool,
    /// Values of each node.
    values: usize,
}

impl Layout {
    fn read(record: &Record) -> Result<Self, String> {
        let in_columns = (0..6).all(|field| record.integer(10 * field, 10).is_some());
        let mut fields = [0; 6];
        let names = [
            "the model type",
            "the analysis type",
            "the data characteristic",
            "the specific data type",
            "the data type",
            "the number of values of each node",
        ];
        for (number, (field, name)) in fields.iter_mut().zip(names).enumerate() {
            let value = match in_columns {
                true => record.integer(10 * number, 10),
                false => record.word(number).and_then(|word| word.parse().ok()),
            };
            *field = value.ok_or_else(|| {
                let word = record.word(number).unwrap_or_default();
                let word = shown(word.as_bytes());
                format!("{name} \"{word}\" in its record 6; allowed: a whole number")
            })?;
        }
        let [_, analysis, characteristic, quantity, kind, values] = fields;
        let analysis = match analysis {
            2 => Analysis::NormalMode,
            3 | 7 => Analysis::Eigenvalue,
            _ => Analysis::Other,
        };
        // Unknown and general quantities are taken for motion, as programs write them.
        let motion = [0, 1, DISPLACEMENT, VELOCITY, ACCELERATION];
        let is_motion = motion.iter().any(|known| i64::from(*known) == quantity);
        let moves = is_motion && [0, 2, 3].contains(&characteristic);
        let mut layout = Layout {
            analysis,
            quantity,
            moves,
            is_complex: false,
            is_double: false,
            values: 0,
        };
        if !moves || analysis == Analysis::Other {
            return Ok(layout);
        }
        (layout.is_complex, layout.is_double) = match kind {
            2 => (false, false),
            4 => (false, true),
            5 => (true, false),
            6 => (true, true),
            _ => {
                return Err(format!(
                    "the data type \"{kind}\" in its record 6; allowed: 2 or 4 (real), 5 or 6 (complex)"
                ));
            }
        };
        layout.values = match values {
            3 => 3,
            6 => 6,
            _ => {
                return Err(format!(
                    "\"{values}\" values of each node in its record 6; allowed: 3 (translations) or 6 (translations and rotations)"
                ));
            }
        };
        Ok(layout)
    }
}

/// Frequency, damping ratio and sense of a normal mode: frequency, modal mass, viscous damping ratio, hysteretic one.
fn normal_mode(reals: &[f64]) -> Result<(f64, Option<f64>, Turn), String> {
    let field = |number: usize| reals.get(number).copied().unwrap_or(0.0);
    let frequency = field(0);
    if reals.is_empty() || !(0.0..LARGEST_FREQUENCY).contains(&frequency) {
        let value = reals.first().map(f64::to_string).unwrap_or_default();
        return Err(format!(
            "the frequency \"{value}\" in its record 8; allowed: 0 to {LARGEST_FREQUENCY:e} Hz"
        ));
    }
    // At resonance a loss factor equals twice the viscous damping ratio.
    let (viscous, hysteretic) = (field(2), 0.5 * field(3));
    let damping = [viscous, hysteretic].into_iter().find(|ratio| *ratio > 0.0);
    let turn = if frequency > 0.0 {
        Turn::Forward
    } else {
        Turn::Still
    };
    Ok((frequency, damping, turn))
}

/// Frequency, damping ratio and sense of an eigenvalue (rad/s): real part, imaginary part.
fn eigenvalue(reals: &[f64]) -> Result<(f64, Option<f64>, Turn), String> {
    let [real, imaginary, ..] = *reals else {
        return Err(
            "no eigenvalue in its record 8; allowed: its real and imaginary part (rad/s)"
                .to_owned(),
        );
    };
    let size = real.hypot(imaginary);
    if size > TAU * LARGEST_FREQUENCY {
        return Err(format!(
            "the eigenvalue \"{real} {imaginary}\" in its record 8; allowed: up to {LARGEST_FREQUENCY:e} Hz times 2 pi (rad/s)"
        ));
    }
    let turn = match imaginary {
        i if i > 0.0 => Turn::Forward,
        i if i < 0.0 => Turn::Conjugate,
        _ => Turn::Still,
    };
    Ok((
        size / TAU,
        // Rounding may make it 1 just below critical damping.
        Some(-real / size).filter(|ratio| *ratio > 0.0 && *ratio < 1.0),
        turn,
    ))
}
