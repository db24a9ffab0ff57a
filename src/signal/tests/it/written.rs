//! Files that tests write: any bytes, and universal files of datasets of the tests' own making.

use std::path::PathBuf;

/// A file in a folder of its own that lasts as long as the value.
pub struct TestFile {
    _folder: tempfile::TempDir,
    pub path: PathBuf,
}

/// Writes `bytes` into a file called `name`.
pub fn file(name: &str, bytes: impl AsRef<[u8]>) -> TestFile {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("a test file");
    TestFile {
        _folder: folder,
        path,
    }
}

/// How a dataset of the tests is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Store {
    Ascii,
    Little,
    Big,
}

/// A dataset 58 of the tests' own making.
#[derive(Debug, Clone)]
pub struct Made {
    pub function_type: u32,
    /// 2, 4, 5 or 6.
    pub data_type: u32,
    pub even: bool,
    /// Promised points; `None` for as many as there are.
    pub points: Option<u64>,
    pub start: String,
    pub step: String,
    pub response: (&'static str, i64, i32),
    pub reference: (&'static str, i64, i32),
    pub id: &'static str,
    pub axis: (u32, &'static str),
    pub numerator: (u32, &'static str, &'static str),
    pub denominator: (u32, &'static str),
    /// Numbers in their order in the file: abscissa where uneven, then ordinate.
    pub numbers: Vec<f64>,
    pub store: Store,
}

/// A time series of 1 kHz in newtons at node 1.
pub fn series(numbers: Vec<f64>) -> Made {
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
pub fn response(values: &[(f64, f64)]) -> Made {
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
    pub fn width(&self) -> usize {
        let ordinate = if self.data_type > 4 { 2 } else { 1 };
        ordinate + usize::from(!self.even)
    }

    fn single(&self, place: usize) -> bool {
        let abscissa = !self.even && place.is_multiple_of(self.width());
        matches!(self.data_type, 2 | 5) || abscissa
    }

    pub fn bytes(&self) -> Vec<u8> {
        let data = match self.store {
            Store::Ascii => self.text(),
            Store::Little | Store::Big => self.binary(),
        };
        let mut bytes = self.header(data.len()).into_bytes();
        bytes.extend(data);
        bytes.extend(b"    -1\n");
        bytes
    }

    pub fn header(&self, length: usize) -> String {
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
pub fn file_of(datasets: &[Made]) -> TestFile {
    let bytes: Vec<u8> = datasets.iter().flat_map(Made::bytes).collect();
    file("tested.uff", bytes)
}
