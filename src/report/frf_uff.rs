//! Frequency response functions as a universal file.

use num_complex::Complex64;
use tapjoint_analysis::Frf;
use tapjoint_signal::recording::{
    FrequencyResponse, FrequencyResponses, Point, UffError, UffFormat,
    encode_frequency_responses_uff,
};
use tapjoint_signal::spectral::FrfEstimator;

/// The functions, by the estimator that each is shown by, with their coherences: datasets 58 or 58b, of
/// several recordings one after the other. Sensors are nodes 1, 2, ... of a recording, the tap of the
/// n-th recording is node 1000 + n; directions are not known and given as scalar. A line on which a
/// function does not exist (receptance at 0 Hz) is written as 0.
///
/// # Errors
/// Values that are not finite.
pub fn render_frf_uff(frfs: &[Frf], format: UffFormat) -> Result<Vec<u8>, UffError> {
    let mut bytes = Vec::new();
    for (number, group) in (1..).zip(frfs.chunk_by(|a, b| a.recording == b.recording)) {
        let Some(first) = group.first() else { continue };
        let responses = FrequencyResponses {
            file: first.recording.clone(),
            first_frequency: first.lines.low,
            spacing: first.lines.spacing,
            lines: first.lines.points(),
            responses: (1..)
                .zip(group)
                .map(|(node, frf)| response(frf, node, 1000 + number))
                .collect(),
            warnings: Vec::new(),
        };
        bytes.extend(encode_frequency_responses_uff(&responses, format)?);
    }
    Ok(bytes)
}

fn response(frf: &Frf, node: i64, tap: i64) -> FrequencyResponse {
    let values = match frf.estimator {
        FrfEstimator::H1 => &frf.h1,
        FrfEstimator::H2 => &frf.h2,
        FrfEstimator::Hv => &frf.hv,
    };
    let place = |name: &str, node: i64| Point {
        name: Some(name.to_string()),
        node,
        direction: 0,
    };
    FrequencyResponse {
        name: frf.response.clone(),
        response: place(&frf.response, node),
        reference: place("hammer", tap),
        unit: Some(frf.unit.clone()),
        form: frf.form,
        values: values
            .iter()
            .map(|value| value.unwrap_or(Complex64::ZERO))
            .collect(),
        coherence: frf.coherence.as_ref().map(|values| {
            let of = |value: &Option<f64>| value.unwrap_or(0.0);
            values.iter().map(of).collect()
        }),
    }
}
