//! What is filed with a test: who tested what, with which instruments, and the files.

use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_description::{SheetDescription, TestDescription};

/// The sheet of a test. Texts are those of the description.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct SheetSection {
    /// Texts of the description. The date is that of the recordings, where the description has none and all of them agree.
    #[serde(flatten)]
    pub texts: SheetDescription,
    /// Hammer and sensors.
    pub instruments: Vec<InstrumentSection>,
    /// The description and the recordings; empty unless a sheet was asked for.
    pub files: Vec<FileSection>,
}

/// An instrument.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct InstrumentSection {
    /// "hammer", or the name of the sensor.
    pub name: String,
    /// Make, type and serial number.
    pub instrument: Option<String>,
    /// Position along the beam (m).
    pub position: Option<f64>,
    /// Mass (kg).
    pub mass: Option<f64>,
}

/// A file that the results rest on.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct FileSection {
    /// Its name as the description has it.
    pub file: String,
    /// Its length (bytes).
    pub bytes: u64,
    /// SHA-256 of its content, in hexadecimal digits.
    pub sha256: String,
}

impl SheetSection {
    /// Returns the sheet of a description, without files.
    pub fn of(test: &TestDescription) -> Self {
        let mut texts = test.sheet.clone();
        let hammer = test.hammer.iter().map(|hammer| InstrumentSection {
            name: "hammer".to_owned(),
            instrument: hammer.instrument.clone(),
            ..InstrumentSection::default()
        });
        let sensors = test.sensors.iter().map(|sensor| InstrumentSection {
            name: sensor.name.clone(),
            instrument: sensor.instrument.clone(),
            position: sensor.position,
            mass: sensor.mass,
        });
        let mut dates = test.recordings.iter().map(|one| one.date.clone());
        let date = dates.next().flatten();
        let date = date.filter(|first| dates.all(|other| other.as_ref() == Some(first)));
        texts.date = texts.date.or(date);
        SheetSection {
            texts,
            instruments: hammer.chain(sensors).collect(),
            files: Vec::new(),
        }
    }

    /// Returns number, date, operator, laboratory and specimen with their names; those that are not known are empty.
    pub fn facts(&self) -> [(&'static str, &str); 5] {
        [
            ("Number", &self.texts.number),
            ("Date", &self.texts.date),
            ("Operator", &self.texts.operator),
            ("Laboratory", &self.texts.laboratory),
            ("Specimen", &self.texts.specimen),
        ]
        .map(|(name, text)| (name, text.as_deref().unwrap_or_default()))
    }
}
