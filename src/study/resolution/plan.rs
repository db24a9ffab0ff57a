//! The bands, the band of each mode, and the lines, windows and record of each block size.

use super::result::Omitted;
use super::virtual_test::{Truths, VirtualRecord};
use super::{ResolutionError, ResolutionSettings, StudiedTest};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tapjoint_signal::spectral::{DISPLAY_RATIO, Lines, Transformer, Window};

/// Room between a mode and the upper end of its band, as a share of the band's end: truths vary by some
/// lines, and a peak on the last line is none.
const ROOM: f64 = 0.05;
/// Longest record (samples): a bound on memory, of which a virtual test takes some twenty times as much in each
/// thread.
const MOST_SAMPLES: usize = 1 << 21;
/// Highest end of a band (Hz): no tap excites more. The sample rate follows it, and a virtual tap lasts 0.05 s.
const HIGHEST: f64 = 1e6;
/// Widest variation of the natural frequencies (1): beyond it the drawn beam is another one.
const WIDEST: f64 = 0.2;

/// Bands and modes, which all block sizes share.
#[derive(Debug)]
pub(super) struct Layout {
    /// Sample rate of the recordings (Hz): 2.56 times the highest band's end, as an analyser takes it.
    pub sample_rate: f64,
    /// Bands (Hz), the narrowest first.
    pub bands: Vec<(f64, f64)>,
    /// Modes, ascending.
    pub modes: Vec<ModePlan>,
    /// Modes left out.
    pub omitted: Vec<Omitted>,
}

/// A mode of the study.
#[derive(Debug)]
pub(super) struct ModePlan {
    /// Number.
    pub number: usize,
    /// Nominal frequency (Hz).
    pub frequency: f64,
    /// Band from which estimates take it.
    pub band: usize,
    /// True where they take it.
    pub used: bool,
}

impl Layout {
    pub fn new(test: &StudiedTest, truths: &Truths) -> Result<Self, ResolutionError> {
        let frequencies = &truths.nominal.frequencies;
        let mut bands = test.bands.clone();
        if bands.is_empty() {
            // One to a quarter above the highest mode wanted.
            let last = test.modes.clamp(1, frequencies.len().max(1)) - 1;
            let top = 1.25 * frequencies.get(last).copied().unwrap_or(1000.0);
            // Two digits, upwards: what one would set on an analyser.
            let step = 10f64.powf(top.log10().floor() - 1.0);
            bands.push((0.0, (top / step).ceil() * step));
        }
        bands.sort_by(|a, b| {
            let by_width = (a.1 - a.0).total_cmp(&(b.1 - b.0));
            by_width.then(a.0.total_cmp(&b.0))
        });
        bands.dedup();
        let highest = bands.iter().map(|band| band.1).fold(0.0, f64::max);
        if highest > HIGHEST {
            return Err(ResolutionError::TooHigh {
                high: highest,
                most: HIGHEST,
            });
        }
        let mut modes: Vec<ModePlan> = Vec::new();
        let mut omitted = Vec::new();
        for (index, &frequency) in frequencies.iter().enumerate() {
            if frequency >= highest {
                break;
            }
            let number = index + 1;
            match bands.iter().position(|band| holds(band, frequency)) {
                Some(band) => modes.push(ModePlan {
                    number,
                    frequency,
                    band,
                    used: test.fit_modes.is_none_or(|most| modes.len() < most),
                }),
                None => omitted.push(Omitted {
                    mode: number,
                    frequency,
                    reason: format!(
                        "{frequency:.1} Hz lies in no band, or within {:.0} % of its end",
                        100.0 * ROOM
                    ),
                }),
            }
        }
        if modes.is_empty() {
            let lowest = frequencies.iter().take(3);
            let lowest: Vec<String> = lowest.map(|f| format!("{f:.1}")).collect();
            return Err(ResolutionError::NoModes {
                lowest: lowest.join(", "),
                room: 100.0 * ROOM,
            });
        }
        Ok(Layout {
            sample_rate: DISPLAY_RATIO * highest,
            bands,
            modes,
            omitted,
        })
    }

    /// The modes that enter an estimate.
    pub fn used(&self) -> impl Iterator<Item = (usize, &ModePlan)> {
        self.modes.iter().enumerate().filter(|(_, mode)| mode.used)
    }
}

fn holds(band: &(f64, f64), frequency: f64) -> bool {
    let low_room = if band.0 > 0.0 { 1.0 + ROOM } else { 1.0 };
    frequency > band.0 * low_room && frequency < band.1 * (1.0 - ROOM)
}

/// Bands and record of one block size.
#[derive(Debug)]
pub(super) struct BlockPlan {
    /// Block (samples).
    pub block: usize,
    /// Each band.
    pub bands: Vec<BandPlan>,
    /// Length of a record (samples).
    pub samples: usize,
    /// Width of the uniform variation of the natural frequencies (1); the variation is the sum of three.
    pub variation: f64,
}

/// A band of one block size.
#[derive(Debug)]
pub(super) struct BandPlan {
    /// The axis.
    pub lines: Lines,
    /// The transform onto it.
    pub transformer: Transformer,
    /// The study's windows as applied.
    pub windows: Vec<Window>,
    /// Samples of a block at the recording's rate.
    pub gate: usize,
    /// Indices of the modes in the band.
    pub modes: Vec<usize>,
}

impl BlockPlan {
    pub fn new(
        block: usize,
        layout: &Layout,
        settings: &ResolutionSettings,
        truths: &Truths,
    ) -> Result<Self, ResolutionError> {
        let bands = layout
            .bands
            .iter()
            .map(|&band| BandPlan::new(block, band, layout))
            .collect::<Result<Vec<_>, _>>()?;
        let mut plan = BlockPlan {
            block,
            samples: bands.iter().map(|band| band.gate).max().unwrap_or(0),
            variation: 0.0,
            bands,
        };
        plan.variation = plan.variation(layout, truths);
        // The decay hardly differs between draws; the window is chosen on the nominal test.
        let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
        let (rate, samples) = (layout.sample_rate, plan.samples);
        let truth = &truths.nominal;
        let record = VirtualRecord::new(truths, truth, rate, samples, settings, &mut random);
        for band in &mut plan.bands {
            for &name in &settings.windows {
                band.windows.push(record.window(name, &band.lines));
            }
        }
        Ok(plan)
    }

    /// One line of the mode whose lines are coarsest beside its frequency, so that each mode's
    /// frequency is spread over one line at least; less where a mode would leave its band.
    fn variation(&self, layout: &Layout, truths: &Truths) -> f64 {
        let mut wanted = 0.0f64;
        let mut possible = WIDEST / 1.5;
        for mode in &layout.modes {
            let lines = &self.bands[mode.band].lines;
            wanted = wanted.max(lines.spacing / mode.frequency);
            // The three uniform parts reach 1.5 widths, the joint's stiffnesses twice that.
            let share = truths.joint_shares.get(mode.number - 1);
            let share = share.copied().unwrap_or(0.0);
            let reach = 1.5 + 3.0 * share;
            let top = (lines.high - lines.spacing) / mode.frequency;
            possible = possible.min(top.ln().max(0.0) / reach);
            if lines.low > 0.0 {
                let bottom = mode.frequency / (lines.low + lines.spacing);
                possible = possible.min(bottom.ln().max(0.0) / reach);
            }
        }
        wanted.min(possible)
    }
}

impl BandPlan {
    fn new(block: usize, band: (f64, f64), layout: &Layout) -> Result<Self, ResolutionError> {
        let rate = layout.sample_rate;
        let seconds = block as f64 / (DISPLAY_RATIO * (band.1 - band.0));
        let lines = Lines::zoom(band, rate, block, seconds)?;
        let gate = (lines.duration * rate).round() as usize;
        if gate > MOST_SAMPLES {
            return Err(ResolutionError::TooLong {
                block,
                low: band.0,
                high: band.1,
                seconds,
                rate,
                most: MOST_SAMPLES,
            });
        }
        let modes = layout.modes.iter().enumerate();
        Ok(BandPlan {
            transformer: Transformer::new(rate, lines, gate),
            lines,
            windows: Vec::new(),
            gate,
            modes: modes
                .filter(|(_, mode)| holds(&band, mode.frequency))
                .map(|(index, _)| index)
                .collect(),
        })
    }
}
