//! A bare recording of which the caller says what its channels are.

use super::analysis::{Analysis, RecordingResult, Response};
use super::error::PipelineError;
use super::evidence;
use super::measure::MeasureSettings;
use super::modes::modes_of_bare;
use super::recordings::finish;
use super::warning::together;
use tapjoint_signal::recording::Recording;
use tapjoint_signal::taps::TapSource;

/// What the channels of a bare recording are; the recording carries their scales already.
#[derive(Debug, Clone, PartialEq)]
pub struct Wiring {
    /// Channel of the hammer (0-based).
    pub hammer: usize,
    /// Unit of the force; `None` = the file's, whatever that is.
    pub hammer_unit: Option<String>,
    /// Channels of the responses (0-based), each with what is known of it.
    pub responses: Vec<(usize, Response)>,
}

/// Takes a bare recording with a hammer as far as it goes: taps, spectra, readings. `adjust` may
/// change the defaults of the measurement.
///
/// # Errors
/// An unreadable recording, a band or block that does not fit.
pub fn run_wired(
    recording: Recording,
    wiring: &Wiring,
    adjust: impl FnOnce(&mut MeasureSettings),
) -> Result<Analysis, PipelineError> {
    let (channels, responses): (Vec<usize>, Vec<Response>) =
        wiring.responses.iter().cloned().unzip();
    let mut settings = MeasureSettings::new(TapSource::Hammer {
        channel: wiring.hammer,
        responses: channels.clone(),
    });
    adjust(&mut settings);
    let units = responses.iter().map(|response| response.unit.clone());
    let units: Vec<Option<String>> = units.collect();
    let named = (wiring.hammer_unit.clone(), responses);
    let mut result = finish(recording, settings, named)?;
    let stated = channels.into_iter().zip(units);
    for (channel, unit) in stated.chain([(wiring.hammer, wiring.hammer_unit.clone())]) {
        if let Some(info) = result.channels.get_mut(channel) {
            info.unit = unit;
        }
    }
    Ok(analysis_of(result))
}

/// The analysis of a recording about which nothing is described.
pub(super) fn analysis_of(mut recording: RecordingResult) -> Analysis {
    let modes = modes_of_bare(&mut recording);
    let (verdicts, doubts) = evidence::judge(std::slice::from_ref(&recording));
    let mut warnings = recording.measurement.warnings.clone();
    warnings.extend(super::warning::of_amplitude(std::slice::from_ref(
        &recording,
    )));
    warnings.extend(doubts);
    Analysis {
        name: recording.file.clone(),
        structure: None,
        aside: vec![None],
        verdicts,
        warnings: together(warnings),
        modes,
        identification: None,
        recordings: vec![recording],
    }
}
