//! Tests of universal files: each format from bytes the tests write themselves, and the files of
//! other programs where the folder of TAPJOINT_DATA has them.

mod files;
mod modes;
mod responses;
mod synthetic;

use crate::shared::data;

use tapjoint_signal::recording::{
    FunctionValues, ReadSettings, Recording, RecordingError, list_datasets, read_function,
};

use crate::written::{Made, Store, file_of, response, series};

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
