//! The taps of a recording that still goes on.

use super::bare::{BareSettings, channel_of};
use super::measurement::{MeasureError, MeasureSettings, lines_for};
use super::wiring::{PipelineError, bare_wiring, described_settings, described_wiring};
use tapjoint_description::{RecordingDescription, TestDescription};
use tapjoint_signal::recording::Recording;
use tapjoint_signal::taps::{TapMemo, TapSource, Taps, TapsByHand, find_taps_again};

/// What is known of a recording before it begins.
#[derive(Debug, Clone, Copy)]
pub enum RecordingPlan<'a> {
    /// A recording of a described test.
    Described {
        /// The test.
        test: &'a TestDescription,
        /// One of its recordings.
        recording: &'a RecordingDescription,
        /// The description's name, for messages.
        test_file: &'a str,
    },
    /// A recording about which nothing is described.
    Bare(&'a BareSettings),
}

impl RecordingPlan<'_> {
    /// The taps that are accepted or rejected by hand before the recording begins.
    pub fn by_hand(&self) -> TapsByHand {
        match self {
            Self::Described { recording, .. } => recording.by_hand.clone(),
            Self::Bare(bare) => bare.by_hand.clone(),
        }
    }
}

/// The taps of a recording so far.
#[derive(Debug, Clone)]
pub struct TapsSoFar {
    /// The recording, its channels scaled.
    pub recording: Recording,
    /// Channels on which taps were looked for.
    pub source: TapSource,
    /// The same channels with the names of their sensors, the hammer first.
    pub names: Vec<(usize, String)>,
    /// The taps. The record of the last one may not have ended.
    pub taps: Taps,
    /// Unit of their peaks; `None` where it is not known.
    pub peak_unit: Option<String>,
    /// End of the band (Hz), where one is stated.
    pub band_end: Option<f64>,
    /// Length of signal that the wanted block needs (s), where a block is given.
    pub wanted: Option<f64>,
}

/// Finds the taps of a recording as the whole chain does, with these decisions `by_hand` in place of those of the plan. The
/// end of a recording that `is_growing` cuts off no tap. `memo` holds what was found in it before; the
/// decisions may have changed since.
///
/// # Errors
/// An unknown channel, an unreadable recording, a band or block that does not fit.
pub fn taps_so_far(
    mut recording: Recording,
    plan: &RecordingPlan<'_>,
    by_hand: &TapsByHand,
    is_growing: bool,
    memo: &mut TapMemo,
) -> Result<TapsSoFar, PipelineError> {
    /// Longer than any block (s): what the recording does not hold yet may still come.
    const ENOUGH: f64 = 1e7;
    let (wiring, settings) = match *plan {
        RecordingPlan::Described {
            test,
            recording: described,
            test_file,
        } => {
            let wiring = described_wiring(test, &mut recording, test_file)?;
            let settings = described_settings(test, described, &wiring);
            (wiring, settings)
        }
        RecordingPlan::Bare(bare) => {
            if let Some(hammer) = &bare.hammer {
                channel_of(&recording, "--hammer", hammer)?;
            }
            let wiring = bare_wiring(&recording, bare.hammer.as_ref())?;
            let mut settings = MeasureSettings::new(wiring.source());
            bare.adjust(&mut settings);
            (wiring, settings)
        }
    };
    let lines = lines_for(&settings, recording.sample_rate(), ENOUGH);
    let lines = lines.map_err(|problem| MeasureError::Spectral {
        file: recording.name().to_owned(),
        problem,
    })?;
    let mut limits = settings.tap_settings(&lines);
    limits.is_growing = is_growing;
    limits.by_hand = by_hand.clone();
    let taps = find_taps_again(&recording, &settings.source, &limits, memo)?;
    Ok(TapsSoFar {
        names: wiring.names(),
        peak_unit: wiring.tap_unit(),
        source: settings.source,
        taps,
        band_end: settings.band.map(|(_, high)| high),
        wanted: limits.wanted,
        recording,
    })
}
