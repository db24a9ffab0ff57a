//! tapjoint: from hammer taps to joint stiffness.
//!
//! ```text
//!   measurement                                   theory
//!   recording -> taps -> spectral -> modal        structure (beam, joint, specimen), effects
//!                                      \            /
//!                                       identify  (pair regression, consistent estimate)
//!                                          |
//!                                       pipeline -> gap (diagnosis) -> report
//! ```
//!
//! Each stage is a module that takes plain data and returns plain data. Measurement and theory never
//! import each other; they meet in [`description`] and [`pipeline`]. The names below are the usual entry
//! points, and the modules hold the rest. Symbols and sign conventions: [`notation`]. Sources: [`references`].
//!
//! # Example
//!
//! A beam was tapped in two recordings with different bands. The example estimates the stiffness of the
//! clamp that holds it.
//!
//! ```
//! use std::path::Path;
//! use tapjoint::{
//!     Beam, MeasureSettings, MeasuredMode, PairsModel, ReadSettings, Recording, TapSource,
//!     estimate_joint, measure,
//! };
//!
//! // Taps are found on the hammer's channel; two accelerometers follow.
//! let source = TapSource::Hammer { channel: 0, responses: vec![1, 2] };
//! let mut modes = Vec::new();
//! for (file, band) in [("low.wav", (0.0, 200.0)), ("high.wav", (200.0, 1000.0))] {
//!     let path = Path::new("recordings/cantilever").join(file);
//!     let recording = Recording::open(&path, &ReadSettings::default())?;
//!     // `measure` finds the taps, averages their spectra and reads the natural frequencies.
//!     let mut settings = MeasureSettings::new(source.clone());
//!     settings.band = Some(band);
//!     let measured = measure(&recording, &settings)?;
//!     println!("{file}: {} taps", measured.taps.accepted().count());
//!     let readings = measured.spectra.map_or(Vec::new(), |spectra| spectra.readings);
//!     // A label marks a peak that is no mode, such as mains hum.
//!     for reading in readings.iter().filter(|reading| reading.label.is_none()) {
//!         modes.push(MeasuredMode {
//!             mode: modes.len() + 1,
//!             frequency: reading.frequency,
//!             std: reading.std,
//!         });
//!     }
//! }
//! let beam = Beam {
//!     length: 0.423,
//!     width: 0.05,
//!     thickness: 0.005,
//!     modulus: 207e9,
//!     density: 7850.0,
//!     poisson: 0.3,
//! };
//! let joint = estimate_joint(PairsModel::TwoParameter, &beam, &modes)?;
//! let kr = joint.kr.ok_or("the frequencies do not determine the rotational stiffness")?;
//! println!("Kr = {:.0} N m/rad", kr.value);
//! # assert_eq!(modes.len(), 5);
//! # assert!((kr.value - 954.4).abs() < 5.0, "{}", kr.value);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The true value is 1223 N m/rad. An accelerometer of 24 g, which the model lacks, lowers the frequencies.
//! [`run_test`] analyses a test that a `test.toml` describes, with the uncertainties of the estimate.
//! [`diagnose_test`] then finds such a missing mass.

pub mod cli;
pub mod notation;
pub mod references;

pub use tapjoint_analysis as pipeline;
pub use tapjoint_batch as batch;
pub use tapjoint_beam as structure;
pub use tapjoint_beam::effects;
pub use tapjoint_compare as compare;
pub use tapjoint_description as description;
pub use tapjoint_diagnosis as gap;
pub use tapjoint_identify as identify;
pub use tapjoint_listen as listen;
pub use tapjoint_numerics::{quantity, stats};
pub use tapjoint_report as report;
pub use tapjoint_signal::{modal, quality, recording, spectral, taps};
pub use tapjoint_simulate as simulate;
pub use tapjoint_study as study;

// Measurement.
pub use modal::{ModeReading, ReadBy, find_peaks, read_peaks};
pub use pipeline::{MeasureSettings, Measurement, measure};
pub use recording::{ReadSettings, Recording, RecordingError};
pub use spectral::SpectralAverager;
pub use taps::{TapSettings, TapSource, Taps, find_taps};

// Theory and identification.
pub use identify::{MeasuredMode, PairsModel, estimate_joint};
pub use structure::{Assembly, Beam, BeamTheory, JointStiffness};

// A described test from recordings to report.
pub use description::TestDescription;
pub use gap::{Diagnosis, GapSettings, Verdict};
pub use pipeline::{Analysis, IdentifySettings, diagnose_test, run_test};
pub use report::{document_of, render_run, render_text};

/// The README's code, compiled so that it stays true.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
