//! From a virtual recording to readings, by the measurement stage.

use num_complex::Complex64;

use super::draw::{Truth, VirtualRecord};
use super::plan::BandPlan;
use super::result::{ReadingName, WindowName};
use tapjoint_signal::modal::fit::{FitSettings, FreeDecayCollector, PoleStart, fit_modes};
use tapjoint_signal::modal::{
    CompositeLevel, FittedReading, ModeReading, PeakSettings, ReadBy, find_peaks, read_peaks,
};
use tapjoint_signal::spectral::{
    AveragedSpectra, DecayCheck, Lines, SpectralAverager, Window, band_limited, choose_window,
    exponential_to, largest_smooth_block, measure_decay,
};

/// Fewest samples of a decay that is worth a fit.
const LEAST_SAMPLES: usize = 64;

/// One frequency as read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Read {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its stated standard uncertainty (Hz).
    pub std: f64,
    /// How it was read: what was wanted, or the next best.
    pub source: ReadBy,
}

impl ReadingName {
    pub(super) fn source(self) -> ReadBy {
        match self {
            ReadingName::Line => ReadBy::Line,
            ReadingName::Interpolated => ReadBy::Interpolated,
            ReadingName::Fit => ReadBy::Fit,
        }
    }
}

/// The window as applied over a block of these lines.
pub(super) fn window_of(name: WindowName, lines: &Lines, record: &VirtualRecord) -> Window {
    let checks = || -> Vec<DecayCheck> {
        let gate = (lines.duration * record.sample_rate).round() as usize;
        let band = (lines.low, lines.high);
        // White noise keeps its density: in the band it has this share of its rms.
        let share = (2.0 * (band.1 - band.0) / record.sample_rate)
            .min(1.0)
            .sqrt();
        let check = |(samples, noise): (&Vec<f64>, &f64)| {
            let samples = &samples[..gate.min(samples.len())];
            measure_decay(
                &band_limited(samples, record.sample_rate, band),
                share * noise,
            )
        };
        record
            .responses
            .iter()
            .zip(&record.noise)
            .map(check)
            .collect()
    };
    match name {
        WindowName::Rectangular => Window::Rectangular,
        WindowName::Hann => Window::Hann,
        WindowName::Automatic => choose_window(&checks(), lines.duration),
        WindowName::Exponential => {
            let remaining = checks()
                .iter()
                .map(|check| check.remaining)
                .fold(0.0, f64::max);
            exponential_to(remaining, lines.duration)
        }
    }
}

/// Reads every mode of a band in every wanted way.
pub(super) fn read_band(
    band: &BandPlan,
    window: usize,
    record: &VirtualRecord,
    (truth, numbers, wanted): (&Truth, &[usize], &[ReadingName]),
) -> Vec<[Option<Read>; 3]> {
    let window = band
        .windows
        .get(window)
        .copied()
        .unwrap_or(Window::Rectangular);
    let mut readings = peak_readings(band, window, record);
    let places: Vec<Option<usize>> = band
        .modes
        .iter()
        .map(|&mode| {
            let number = numbers.get(mode).copied().unwrap_or(1);
            place_of(truth.frequencies[number - 1], &readings, &band.lines)
        })
        .collect();
    if wanted.contains(&ReadingName::Fit) {
        fit(band, record, &mut readings, &places);
    }
    let read = |place: &Option<usize>| {
        ReadingName::ALL.map(|name| {
            let reading = readings.get((*place)?).filter(|_| wanted.contains(&name))?;
            Some(read_as(reading, name))
        })
    };
    places.iter().map(read).collect()
}

fn read_as(reading: &ModeReading, name: ReadingName) -> Read {
    let mut reading = reading.clone();
    reading.prefer(name.source());
    Read {
        frequency: reading.frequency,
        std: reading.std.unwrap_or(reading.half_line),
        source: reading.source,
    }
}

/// Peaks of H1 over all sensors, read on their lines and between them.
fn peak_readings(band: &BandPlan, window: Window, record: &VirtualRecord) -> Vec<ModeReading> {
    let averages = averages(band, window, record);
    let Some(h1) = &averages.h1 else {
        return Vec::new();
    };
    let powers: Vec<Vec<f64>> = h1
        .iter()
        .map(|h| h.iter().map(Complex64::norm_sqr).collect())
        .collect();
    let noise = noise_powers(&averages, window, (band.gate, record));
    let level = CompositeLevel::new(band.lines, &powers, Some(&noise));
    let peaks = find_peaks(&level, &PeakSettings::default());
    let spectra: Vec<&[Complex64]> = h1.iter().map(Vec::as_slice).collect();
    read_peaks(&level, &spectra, &peaks, window)
}

fn averages(band: &BandPlan, window: Window, record: &VirtualRecord) -> AveragedSpectra {
    let transformed = |samples: &Vec<f64>, end: usize| {
        let mut windowed = samples[..end.min(samples.len())].to_vec();
        // A Hann window is over the whole block, whatever of it is not zero.
        match window {
            Window::Hann => {
                windowed.resize(band.gate, 0.0);
                window.apply(&mut windowed, record.sample_rate);
            }
            _ => window.apply(&mut windowed, record.sample_rate),
        }
        band.transformer.transform(&windowed)
    };
    let force = transformed(&record.force, record.pulse_end);
    let responses: Vec<Vec<Complex64>> = record
        .responses
        .iter()
        .map(|x| transformed(x, band.gate))
        .collect();
    let mut averager = SpectralAverager::new(band.lines, responses.len());
    averager.add(Some(&force), &responses);
    averager
        .finish()
        .unwrap_or_else(|| AveragedSpectra::empty(band.lines))
}

/// What noise alone would leave of H1. White noise of rms s has E|X|^2 = s^2 sum w^2/rate^2 under a
/// window w: what a quiet stretch before the tap would tell.
fn noise_powers(
    averages: &AveragedSpectra,
    window: Window,
    (gate, record): (usize, &VirtualRecord),
) -> Vec<Vec<f64>> {
    let mut weights = vec![1.0; gate];
    window.apply(&mut weights, record.sample_rate);
    let energy: f64 = weights.iter().map(|w| w * w).sum();
    let force = averages.force_power.as_deref().unwrap_or_default();
    let of = |level: &f64| {
        let power = (level / record.sample_rate).powi(2) * energy;
        force
            .iter()
            .map(|f| power / f.max(f64::MIN_POSITIVE))
            .collect()
    };
    record.noise.iter().map(of).collect()
}

/// The reading of a mode: the nearest one within its line, a line more, or its half-power width.
fn place_of(frequency: f64, readings: &[ModeReading], lines: &Lines) -> Option<usize> {
    let distance = |reading: &ModeReading| (reading.line_frequency - frequency).abs();
    let width = |reading: &ModeReading| reading.damping_ratio.unwrap_or(0.0) * frequency;
    let near =
        |reading: &&ModeReading| distance(reading) <= 3.0 * lines.half_line() + width(reading);
    let places = readings
        .iter()
        .enumerate()
        .filter(|(_, reading)| near(reading));
    places
        .min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)))
        .map(|(place, _)| place)
}

/// Fits the free decay from every resonance, and from whatever was read near a mode.
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
    let Some(fits) = fits(band, record, &starts) else {
        return;
    };
    for (place, fit) in chosen.into_iter().zip(fits) {
        readings[place].fit = fit.ok().map(|mode| Box::new(FittedReading::new(mode)));
    }
}

type Fits = Vec<Result<tapjoint_signal::modal::fit::ModeFit, tapjoint_signal::modal::fit::Unfit>>;

fn fits(band: &BandPlan, record: &VirtualRecord, starts: &[PoleStart]) -> Option<Fits> {
    let decay = band.gate.checked_sub(record.pulse_end)?;
    let samples = largest_smooth_block(decay).filter(|&samples| samples >= LEAST_SAMPLES)?;
    let range = [(band.lines.low, band.lines.high)];
    let mut collector = FreeDecayCollector::new(record.sample_rate, samples, &range).ok()?;
    let free = |x: &Vec<f64>| x[record.pulse_end..].to_vec();
    let responses: Vec<Vec<f64>> = record.responses.iter().map(free).collect();
    collector.add_tap(&responses).ok()?;
    Some(fit_modes(
        &collector.finish().ok()?,
        starts,
        &FitSettings::default(),
    ))
}
