//! From a virtual recording to readings of each mode (on the line, between the lines and by a fit), from these to
//! stiffnesses by both estimators, and the errors of these against the draw's truth.

use super::plan::{BandPlan, BlockPlan, Layout};
use super::result::StudiedStiffness;
use super::virtual_test::{Truth, VirtualRecord};
use super::{ResolutionError, StudiedTest};
use num_complex::Complex64;
use tapjoint_analysis::{EstimateMethod, jointed_structure};
use tapjoint_beam::{Assembly, JointStiffness};
use tapjoint_identify::consistent::{
    ConsistentEstimator, ConsistentSettings, JointedStructure, Neighbourhood, Parameter,
};
use tapjoint_identify::{
    IdentifyError, MeasuredMode, PairsModel, estimate_modulus, pairs_estimator,
};
use tapjoint_signal::modal::fit::{FitSettings, FreeDecayCollector, PoleStart, fit_modes};
use tapjoint_signal::modal::{
    CompositeLevel, FittedReading, ModeReading, PeakSettings, ReadBy, find_peaks, read_peaks,
};
use tapjoint_signal::spectral::{SpectralAverager, Window, largest_smooth_block};

/// Fewest samples of a decay that is fitted.
const LEAST_SAMPLES: usize = 64;

/// One frequency as read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Read {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its stated standard uncertainty (Hz).
    pub std: f64,
    /// The way of reading: the wanted one, or the next best.
    pub source: ReadBy,
}

/// Readings of every mode of the study, in the order of [`ReadBy::ALL`]; none where a mode is not in the band.
pub(super) type BandReadings = Vec<[Option<Read>; 3]>;

/// Index of a way of reading in [`ReadBy::ALL`].
pub(super) fn index_of(reading: ReadBy) -> usize {
    match reading {
        ReadBy::Line => 0,
        ReadBy::Interpolated => 1,
        ReadBy::Fit => 2,
    }
}

/// Reads every mode of a band in every wanted way.
pub(super) fn read_band(
    band: &BandPlan,
    window: Window,
    record: &VirtualRecord,
    layout: &Layout,
    truth: &Truth,
    wanted: &[ReadBy],
) -> BandReadings {
    let mut readings = peak_readings(band, window, record);
    let mut places = vec![None; layout.modes.len()];
    for &mode in &band.modes {
        let frequency = truth.frequencies[layout.modes[mode].number - 1];
        // The nearest reading within the mode's line, a line more, or its half-power width.
        let mut least = f64::INFINITY;
        for (place, reading) in readings.iter().enumerate() {
            let distance = (reading.line_frequency - frequency).abs();
            let width = reading.damping_ratio.unwrap_or(0.0) * frequency;
            if distance <= 3.0 * band.lines.half_line() + width && distance < least {
                least = distance;
                places[mode] = Some(place);
            }
        }
    }
    if wanted.contains(&ReadBy::Fit) {
        fit(band, record, &mut readings, &places);
    }
    places
        .into_iter()
        .map(|place| {
            ReadBy::ALL.map(|name| {
                let reading = readings.get(place?).filter(|_| wanted.contains(&name))?;
                let mut reading = reading.clone();
                reading.select_estimate(name);
                Some(Read {
                    frequency: reading.frequency,
                    std: reading.std.unwrap_or(reading.half_line),
                    source: reading.source,
                })
            })
        })
        .collect()
}

/// Peaks of H1 over all sensors, read on their lines and between them.
fn peak_readings(band: &BandPlan, window: Window, record: &VirtualRecord) -> Vec<ModeReading> {
    let rate = record.sample_rate;
    let force = transformed(band, window, rate, &record.force, record.pulse_end);
    let responses = record.responses.iter();
    let responses: Vec<Vec<Complex64>> = responses
        .map(|x| transformed(band, window, rate, x, band.gate))
        .collect();
    let mut averager = SpectralAverager::new(band.lines, responses.len());
    averager.add(Some(&force), &responses);
    let Some(averages) = averager.finish() else {
        return Vec::new();
    };
    let Some(h1) = &averages.h1 else {
        return Vec::new();
    };
    let powers: Vec<Vec<f64>> = h1
        .iter()
        .map(|h| h.iter().map(Complex64::norm_sqr).collect())
        .collect();
    // The part of H1 that noise alone would leave. White noise of rms s has E|X|^2 = s^2 sum w^2/rate^2 under a
    // window w, which a quiet stretch before the tap would show.
    let mut weights = vec![1.0; band.gate];
    window.apply(&mut weights, rate);
    let energy: f64 = weights.iter().map(|w| w * w).sum();
    let force = averages.force_power.as_deref().unwrap_or_default();
    let mut noise: Vec<Vec<f64>> = Vec::with_capacity(record.noise.len());
    for level in &record.noise {
        let power = (level / rate).powi(2) * energy;
        let quotients = force.iter().map(|f| power / f.max(f64::MIN_POSITIVE));
        noise.push(quotients.collect());
    }
    let level = CompositeLevel::new(band.lines, &powers, Some(&noise));
    let peaks = find_peaks(&level, &PeakSettings::default());
    let spectra: Vec<&[Complex64]> = h1.iter().map(Vec::as_slice).collect();
    read_peaks(&level, &spectra, &peaks, window)
}

/// The spectrum of the samples up to `end` under the window.
fn transformed(
    band: &BandPlan,
    window: Window,
    sample_rate: f64,
    samples: &[f64],
    end: usize,
) -> Vec<Complex64> {
    let mut windowed = samples[..end.min(samples.len())].to_vec();
    // A Hann window is over the whole block, however much of it is zero.
    if window == Window::Hann {
        windowed.resize(band.gate, 0.0);
    }
    window.apply(&mut windowed, sample_rate);
    band.transformer.transform(&windowed)
}

/// Fits the free decay from every resonance, and from every reading near a mode.
fn fit(
    band: &BandPlan,
    record: &VirtualRecord,
    readings: &mut [ModeReading],
    places: &[Option<usize>],
) {
    let chosen: Vec<usize> = (0..readings.len())
        .filter(|place| readings[*place].label.is_none() || places.contains(&Some(*place)))
        .collect();
    let starts: Vec<PoleStart> = chosen
        .iter()
        .map(|&place| PoleStart {
            frequency: readings[place].frequency,
            damping_ratio: readings[place].damping_ratio,
        })
        .collect();
    let Some(samples) = band
        .gate
        .checked_sub(record.pulse_end)
        .and_then(largest_smooth_block)
        .filter(|&samples| samples >= LEAST_SAMPLES)
    else {
        return;
    };
    let range = [(band.lines.low, band.lines.high)];
    let decays: Vec<Vec<f64>> = record
        .responses
        .iter()
        .map(|response| response[record.pulse_end..].to_vec())
        .collect();
    let decay = FreeDecayCollector::new(record.sample_rate, samples, &range).and_then(|mut all| {
        all.add_tap(&decays)?;
        all.finish()
    });
    let Ok(decay) = decay else {
        return;
    };
    let fits = fit_modes(&decay, &starts, &FitSettings::default());
    for (place, fit) in chosen.into_iter().zip(fits) {
        readings[place].fit = fit.ok().map(|mode| Box::new(FittedReading::new(mode)));
    }
}

/// Errors (1) of the stiffnesses in one draw, in the order of [`Estimators::parameters`]; `None` where
/// there is no estimate.
pub(super) type ParameterErrors = Vec<Option<f64>>;

/// First-order errors of one stiffness (1) due to the line spacing.
#[derive(Debug, Clone, Copy)]
pub(super) struct LineErrors {
    /// rms for frequency errors uniform over a line, of rms spacing/sqrt 12.
    pub rms: f64,
    /// Largest for frequency errors of half a line each.
    pub bound: f64,
}

/// Returns the name of a stiffness that is estimated.
pub(super) fn name_of(parameter: Parameter) -> &'static str {
    match parameter {
        Parameter::Kt => "kx",
        Parameter::Kr => "ky",
        Parameter::Coupling => "kz",
        _ => "modulus",
    }
}

/// Both estimators, for the modes of the study.
#[derive(Debug)]
pub(super) struct Estimators<'a> {
    /// The stiffnesses that are estimated: Kx, Ky, Kz, or of a free beam the modulus.
    pub parameters: Vec<Parameter>,
    pub layout: &'a Layout,
    structure: JointedStructure,
    settings: ConsistentSettings,
    regression: Option<PairsModel>,
    nominal: Truth,
}

impl<'a> Estimators<'a> {
    pub fn new(
        test: &StudiedTest,
        layout: &'a Layout,
        nominal: &Truth,
    ) -> Result<Self, ResolutionError> {
        // Finite stiffnesses are estimated, rigid and absent ones are held.
        let three = test.structure.regression == Some(PairsModel::ThreeParameter);
        let mut parameters = Vec::new();
        if test.structure.assembly == Assembly::Free {
            parameters.push(Parameter::Modulus);
        } else {
            let springs = [
                (Parameter::Kt, test.joint.kx),
                (Parameter::Kr, test.joint.ky),
            ];
            let finite = springs.iter().filter(|(_, k)| *k > 0.0 && k.is_finite());
            parameters.extend(finite.map(|(parameter, _)| *parameter));
            if three && test.joint.kz().is_some() {
                parameters.push(Parameter::Coupling);
            }
        }
        if parameters.is_empty() {
            return Err(IdentifyError::NothingToEstimate.into());
        }
        let used = layout.used().count();
        if used < parameters.len() {
            return Err(IdentifyError::TooFewFrequencies {
                unknowns: parameters.len(),
                found: used,
            }
            .into());
        }
        Ok(Estimators {
            settings: ConsistentSettings {
                held: test.joint.in_si(&test.structure.beam),
                ..ConsistentSettings::fitting(&parameters)
            },
            parameters,
            layout,
            structure: jointed_structure(&test.structure, &test.details),
            regression: test.structure.regression,
            nominal: nominal.clone(),
        })
    }

    /// Returns the errors of the stiffnesses that follow from one way of reading the bands, for each of
    /// [`EstimateMethod::ALL`].
    pub fn errors(
        &self,
        truth: &Truth,
        bands: &[BandReadings],
        reading: ReadBy,
    ) -> [ParameterErrors; 2] {
        let modes: Option<Vec<MeasuredMode>> = self
            .layout
            .used()
            .map(|(index, mode)| {
                let read = bands[mode.band][index][index_of(reading)]?;
                Some(MeasuredMode {
                    mode: mode.number,
                    // The draw's beam is the nominal one but for a factor on its modulus, which is
                    // known: without that factor one model serves all draws.
                    frequency: read.frequency / truth.scale,
                    std: Some(read.std / truth.scale),
                })
            })
            .collect();
        EstimateMethod::ALL.map(|method| {
            let both = modes.as_deref().and_then(|modes| match method {
                EstimateMethod::Consistent => {
                    let found = self.consistent(modes, truth)?;
                    Some((
                        found,
                        self.values(&truth.joint, self.structure.beam.modulus),
                    ))
                }
                // The regression's own error on exact frequencies is not due to the reading.
                EstimateMethod::Pairs | EstimateMethod::FreeBeam => {
                    Some((self.pairs(modes)?, self.pairs(&self.exact(truth))?))
                }
            });
            let Some((found, exact)) = both else {
                return vec![None; self.parameters.len()];
            };
            let pairs = found.iter().zip(exact);
            pairs
                .map(|(found, exact)| {
                    let error = found / exact - 1.0;
                    (error.is_finite() && exact != 0.0).then_some(error)
                })
                .collect()
        })
    }

    /// Returns the modes that enter, with their true frequencies (the factor on the modulus taken out).
    fn exact(&self, truth: &Truth) -> Vec<MeasuredMode> {
        let used = self.layout.used();
        used.map(|(_, mode)| MeasuredMode {
            mode: mode.number,
            frequency: truth.frequencies[mode.number - 1] / truth.scale,
            std: None,
        })
        .collect()
    }

    /// The values of the estimated stiffnesses.
    fn values(&self, joint: &JointStiffness, modulus: f64) -> Vec<f64> {
        let parameters = self.parameters.iter();
        parameters
            .map(|parameter| match parameter {
                Parameter::Kt => joint.kx,
                Parameter::Kr => joint.ky,
                Parameter::Coupling => joint.kz().unwrap_or(f64::INFINITY),
                _ => modulus,
            })
            .collect()
    }

    fn consistent(&self, modes: &[MeasuredMode], truth: &Truth) -> Option<Vec<f64>> {
        let estimator = ConsistentEstimator::new(&self.structure, modes, &self.settings).ok()?;
        let fit = estimator.refit(&estimator.frequencies(), &Neighbourhood::at(&[truth.point]));
        fit.stop.converged().then(|| {
            let modulus = fit.point[Parameter::Modulus as usize].exp();
            self.values(&fit.joint(), modulus)
        })
    }

    fn pairs(&self, modes: &[MeasuredMode]) -> Option<Vec<f64>> {
        let structure = &self.structure;
        let Some(model) = self.regression else {
            let found = estimate_modulus(structure.theory, &structure.beam, modes).ok()?;
            return Some(vec![found.modulus.value]);
        };
        let numbers: Vec<usize> = modes.iter().map(|mode| mode.mode).collect();
        let frequencies: Vec<f64> = modes.iter().map(|mode| mode.frequency).collect();
        let found = pairs_estimator(model, &structure.beam, &numbers).ok()?(&frequencies)?;
        let parameters = self.parameters.iter();
        parameters
            .map(|parameter| match parameter {
                Parameter::Kt => Some(found.kx),
                Parameter::Kr => Some(found.ky),
                Parameter::Coupling => found.kz,
                _ => None,
            })
            .collect()
    }

    /// Returns the stiffnesses of the study with their nominal values.
    pub fn described(&self) -> Vec<StudiedStiffness> {
        let pairs = self.pairs(&self.exact(&self.nominal));
        let values = self.values(&self.nominal.joint, self.structure.beam.modulus);
        let parameters = self.parameters.iter().zip(values).enumerate();
        parameters
            .map(|(index, (&parameter, value))| StudiedStiffness {
                parameter: name_of(parameter),
                value,
                pairs_bias_percent: pairs
                    .as_ref()
                    .map(|found| 100.0 * (found[index] / value - 1.0)),
            })
            .collect()
    }

    /// Returns the estimates from these frequencies of the modes used, each uncertain by its half line.
    fn estimate(
        &self,
        method: EstimateMethod,
        frequencies: &[f64],
        half_lines: &[f64],
    ) -> Option<Vec<f64>> {
        let mut modes = self.exact(&self.nominal);
        for (mode, (frequency, half)) in modes.iter_mut().zip(frequencies.iter().zip(half_lines)) {
            mode.frequency = *frequency;
            mode.std = Some(half / 3f64.sqrt());
        }
        match method {
            EstimateMethod::Consistent => self.consistent(&modes, &self.nominal),
            EstimateMethod::Pairs | EstimateMethod::FreeBeam => self.pairs(&modes),
        }
    }

    /// Returns the first-order errors that the lines of a block cause in each stiffness; `None` where the
    /// method has no estimate.
    pub fn line_errors(&self, plan: &BlockPlan, method: EstimateMethod) -> Option<Vec<LineErrors>> {
        let exact = self.exact(&self.nominal);
        let frequencies: Vec<f64> = exact.iter().map(|mode| mode.frequency).collect();
        let used = self.layout.used();
        let half_lines: Vec<f64> = used
            .map(|(_, mode)| plan.bands[mode.band].lines.half_line())
            .collect();
        let values = self.estimate(method, &frequencies, &half_lines)?;
        // One mode's error at a time, by central differences: the rms of independent errors is the root
        // of their squares' sum, the bound the sum. Truncation is of the order 1e-10, rounding of 1e-8.
        const STEP: f64 = 1e-5;
        let mut shifted = frequencies.clone();
        let mut sums = vec![
            LineErrors {
                rms: 0.0,
                bound: 0.0
            };
            values.len()
        ];
        for (index, (frequency, half)) in frequencies.iter().zip(&half_lines).enumerate() {
            let step = STEP * frequency;
            shifted[index] = frequency + step;
            let above = self.estimate(method, &shifted, &half_lines)?;
            shifted[index] = frequency - step;
            let below = self.estimate(method, &shifted, &half_lines)?;
            shifted[index] = *frequency;
            for (sum, (above, below)) in sums.iter_mut().zip(above.iter().zip(below)) {
                let moved = (half * (above - below) / (2.0 * step)).abs();
                sum.rms += moved * moved / 3.0;
                sum.bound += moved;
            }
        }
        for (sum, value) in sums.iter_mut().zip(values) {
            sum.rms = sum.rms.sqrt() / value.abs();
            sum.bound /= value.abs();
        }
        Some(sums)
    }
}
