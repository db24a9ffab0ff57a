//! Tests of universal files: each format from bytes the tests write themselves, and the files of
//! other programs where the folder of TAPJOINT_DATA has them.

mod files;
mod listing;
mod responses;
mod synthetic;

use crate::shared::data;

use tapjoint::recording::{
    FunctionValues, ReadSettings, Recording, RecordingError, list_datasets, read_function,
};

use crate::recording::{TestFile, file};

fn open(path: &std::path::Path) -> Result<Recording, RecordingError> {
    Recording::open(path, &ReadSettings::default())
}

/// All channels of a recording.
fn samples(recording: &Recording) -> Vec<Vec<f64>> {
    let channels: Vec<usize> = (0..recording.channels().len()).collect();
    let read = recording.read_channels(&channels, 0..u64::MAX);
    read.unwrap_or_else(|error| panic!("{error}"))
}

/// The function at a place (1-based) of a file.
fn function(path: &std::path::Path, number: usize) -> FunctionValues {
    let listed = list_datasets(path).unwrap_or_else(|error| panic!("{error}"));
    read_function(&listed, number).unwrap_or_else(|error| panic!("{error}"))
}

/// How a dataset of the tests is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Store {
    Ascii,
    Little,
    Big,
}

/// A dataset 58 of the tests' own making.
#[derive(Debug, Clone)]
struct Made {
    function_type: u32,
    /// 2, 4, 5 or 6.
    data_type: u32,
    even: bool,
    /// Promised points; `None` for as many as there are.
    points: Option<u64>,
    start: String,
    step: String,
    response: (&'static str, i64, i32),
    reference: (&'static str, i64, i32),
    id: &'static str,
    axis: (u32, &'static str),
    numerator: (u32, &'static str, &'static str),
    denominator: (u32, &'static str),
    /// Numbers in their order in the file: abscissa where uneven, then ordinate.
    numbers: Vec<f64>,
    store: Store,
}

/// A time series of 1 kHz in newtons at node 1.
fn series(numbers: Vec<f64>) -> Made {
    Made {
        function_type: 1,
        data_type: 4,
        even: true,
        points: None,
        start: "0.00000E+00".to_owned(),
        step: "1.00000E-03".to_owned(),
        response: ("NONE", 1, 3),
        reference: ("NONE", 0, 0),
        id: "NONE",
        axis: (17, "s"),
        numerator: (13, "Force", "N"),
        denominator: (0, "NONE"),
        numbers,
        store: Store::Ascii,
    }
}

/// An accelerance of 0.5 Hz spacing from point 1 to point 3.
fn response(values: &[(f64, f64)]) -> Made {
    Made {
        function_type: 4,
        data_type: 6,
        step: "5.00000E-01".to_owned(),
        response: ("NONE", 3, 3),
        reference: ("NONE", 1, -3),
        axis: (18, "Hz"),
        numerator: (12, "Acceleration", "m/s2"),
        denominator: (13, "N"),
        ..series(values.iter().flat_map(|(re, im)| [*re, *im]).collect())
    }
}

impl Made {
    fn width(&self) -> usize {
        let ordinate = if self.data_type > 4 { 2 } else { 1 };
        ordinate + usize::from(!self.even)
    }

    fn single(&self, place: usize) -> bool {
        let abscissa = !self.even && place.is_multiple_of(self.width());
        matches!(self.data_type, 2 | 5) || abscissa
    }

    fn bytes(&self) -> Vec<u8> {
        let data = match self.store {
            Store::Ascii => self.text(),
            Store::Little | Store::Big => self.binary(),
        };
        let mut bytes = self.header(data.len()).into_bytes();
        bytes.extend(data);
        bytes.extend(b"    -1\n");
        bytes
    }

    fn header(&self, length: usize) -> String {
        let kind = match self.store {
            Store::Ascii => "    58".to_owned(),
            Store::Little => format!("    58b{:6}{:6}{:12}{length:12}", 1, 2, 11),
            Store::Big => format!("    58b{:6}{:6}{:12}{length:12}", 2, 2, 11),
        };
        let points = self
            .points
            .unwrap_or((self.numbers.len() / self.width()) as u64);
        let point = |(name, node, direction): (&str, i64, i32)| {
            format!(" {name:<10}{node:10}{direction:4}")
        };
        let axis = |kind: u32, label: &str, unit: &str| {
            format!("{kind:10}{:5}{:5}{:5} {label:<20} {unit:<20}\n", 0, 0, 0)
        };
        format!(
            "    -1\n{kind}\n{}\nNONE\n01-Jan-24 10:00:00\nNONE\nNONE\n{:5}{:10}{:5}{:10}{}{}\n{:10}{points:10}{:10}{:>13}{:>13}{:>13}\n{}{}{}{}",
            self.id,
            self.function_type,
            0,
            0,
            0,
            point(self.response),
            point(self.reference),
            self.data_type,
            u8::from(self.even),
            self.start,
            self.step,
            "0.00000E+00",
            axis(self.axis.0, "NONE", self.axis.1),
            axis(self.numerator.0, self.numerator.1, self.numerator.2),
            axis(self.denominator.0, "NONE", self.denominator.1),
            axis(0, "NONE", "NONE"),
        )
    }

    fn text(&self) -> Vec<u8> {
        // 6E13.5, 4E20.12, 2(E13.5,E20.12), E13.5,2E20.12
        let per_line = match (self.data_type, self.even) {
            (2 | 5, _) => 6,
            (6, false) => 3,
            _ => 4,
        };
        let mut text = String::new();
        for (place, value) in self.numbers.iter().enumerate() {
            text += &match self.single(place) {
                true => format!("{:>13}", format!("{value:.5e}")),
                false => format!("{:>20}", format!("{value:.12e}")),
            };
            if place % per_line == per_line - 1 || place + 1 == self.numbers.len() {
                text.push('\n');
            }
        }
        text.into_bytes()
    }

    fn binary(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (place, value) in self.numbers.iter().enumerate() {
            match (self.single(place), self.store) {
                (true, Store::Big) => bytes.extend((*value as f32).to_be_bytes()),
                (true, _) => bytes.extend((*value as f32).to_le_bytes()),
                (false, Store::Big) => bytes.extend(value.to_be_bytes()),
                (false, _) => bytes.extend(value.to_le_bytes()),
            }
        }
        bytes
    }
}

/// A file of several datasets.
fn file_of(datasets: &[Made]) -> TestFile {
    let bytes: Vec<u8> = datasets.iter().flat_map(Made::bytes).collect();
    file("tested.uff", bytes)
}
