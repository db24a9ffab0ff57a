//! The free decays after the taps, gathered while the taps are transformed.
//!
//! Up to a hundred taps are kept one by one. Of more taps, or of records that memory does not hold, groups are kept.
//! With a hammer a group is the mean of its taps weighted by their peaks. The sum of free decays is a free decay: its poles
//! are those of the taps. Without a hammer the taps differ in phase, and a group is its strongest tap.

use super::pulse_window::{PulseWindow, offset_stretch, remove_offset};
use tapjoint_signal::modal::amplitude::Decay;
use tapjoint_signal::modal::fit::TapForce;
use tapjoint_signal::spectral::{DISPLAY_RATIO, Lines, Thinning, largest_smooth_block};
use tapjoint_signal::taps::Tap;

/// Most taps that are kept one by one.
pub(super) const MOST_SINGLE: usize = 100;
/// Most values that are kept of taps one by one, of 8 or 16 bytes each.
pub(super) const MOST_KEPT: usize = 1 << 24;
/// Most values that are kept of groups.
const MOST_OF_GROUPS: usize = 1 << 20;
/// Most groups. 16: their scatter is known to a fifth.
const MOST_GROUPS: usize = 16;
/// Fewest groups, whatever their length.
const FEWEST_GROUPS: usize = 2;
/// The highest peak lies so far below the highest frequency that groups keep.
const MARGIN: f64 = 1.5;

/// Without a hammer a decay begins this long after its trigger (s): hammer pulses are shorter.
const AFTER_TRIGGER: f64 = 5e-3;
/// Fewest samples of a decay that is fitted: some 16 lines for a mode and its surroundings.
const LEAST_SAMPLES: u64 = 64;

/// Decays, and the forces before them, of one recording.
pub(super) struct DecayCollector {
    sample_rate: f64,
    /// Samples of a decay.
    samples: usize,
    has_force: bool,
    responses: usize,
    groups: Option<Groups>,
    decays: Vec<Decay>,
    forces: Vec<TapForce>,
}

/// How taps are put together.
struct Groups {
    taps: usize,
    /// Samples from the trigger to the beginning of a decay.
    delay: u64,
    /// Taps of a group; of the first one until the content of the decays is known.
    size: usize,
    thinning: Option<Thinning>,
    is_settled: bool,
    /// The group that is being summed: its decays times their weights, and the weights' sum.
    sum: Vec<Vec<f64>>,
    force: Vec<f64>,
    weight: f64,
    count: usize,
}

/// First frame of the decay after a tap.
fn begin(tap: &Tap, sample_rate: f64) -> u64 {
    let after = (AFTER_TRIGGER * sample_rate).ceil();
    let trigger = (tap.time * sample_rate).round();
    let begin = tap.pulse_end.unwrap_or((trigger + after) as u64);
    // Samples that were cut off are no decay.
    begin.max(tap.usable_from())
}

fn trigger(tap: &Tap, sample_rate: f64) -> u64 {
    (tap.time * sample_rate).round() as u64
}

impl DecayCollector {
    /// Plans for taps of `gate` frames each; `None` where their decays are too short for a fit.
    pub fn new(
        taps: &[&Tap],
        sample_rate: f64,
        gate: u64,
        has_force: bool,
        responses: usize,
    ) -> Option<Self> {
        let begins = taps.iter().map(|tap| begin(tap, sample_rate));
        let delays = begins.clone().zip(taps);
        let delays = delays.map(|(begin, tap)| begin.saturating_sub(trigger(tap, sample_rate)));
        let delay = delays.max()?;
        let length = |begins: &mut dyn Iterator<Item = u64>| {
            let ends = taps.iter().map(|tap| tap.usable_from() + gate);
            let lengths = begins
                .zip(ends)
                .map(|(begin, end)| end.saturating_sub(begin));
            let shortest = largest_smooth_block(lengths.min().unwrap_or(0) as usize);
            shortest.filter(|samples| *samples as u64 >= LEAST_SAMPLES)
        };
        let mut samples = length(&mut begins.clone())?;
        let are_many = taps.len() > MOST_SINGLE || taps.len() * samples * responses > MOST_KEPT;
        if are_many {
            samples = length(&mut taps.iter().map(|tap| trigger(tap, sample_rate) + delay))?;
        }
        Some(DecayCollector {
            sample_rate,
            samples,
            has_force,
            responses,
            groups: are_many.then(|| Groups {
                taps: taps.len(),
                delay,
                size: taps.len().div_ceil(MOST_GROUPS),
                thinning: None,
                is_settled: MOST_GROUPS * samples * responses <= MOST_OF_GROUPS,
                sum: vec![Vec::new(); responses],
                force: Vec::new(),
                weight: 0.0,
                count: 0,
            }),
            decays: Vec::new(),
            forces: Vec::new(),
        })
    }

    /// Adds a tap. `record` has the samples of the force, where there is one, and of the responses, from the start of the
    /// tap's record on.
    pub fn add(&mut self, tap: &Tap, record: &[Vec<f64>]) {
        let rate = self.sample_rate;
        let (force, responses) = record.split_at(usize::from(self.has_force));
        let start = tap.record.start;
        let begin = match &self.groups {
            Some(groups) => trigger(tap, rate) + groups.delay,
            None => begin(tap, rate),
        };
        let before = begin.saturating_sub(start) as usize;
        let force = force.first().filter(|_| tap.is_whole()).map(|force| {
            // The offset is looked for beyond the pulse.
            let wanted = before.max(offset_stretch(rate)).min(force.len());
            let mut force = force[..wanted].to_vec();
            remove_offset(&mut force, rate);
            if let Some(window) = PulseWindow::of(tap, rate) {
                window.apply(&mut force);
            }
            force.truncate(before);
            force
        });
        let decays = responses.iter().map(|samples| {
            let end = samples.len().min(before + self.samples);
            samples.get(before..end).unwrap_or_default()
        });
        let Some(groups) = &mut self.groups else {
            self.decays.push(Decay {
                start: begin as f64 / rate - tap.time,
                sample_rate: rate,
                responses: decays.map(<[f64]>::to_vec).collect(),
            });
            self.forces.extend(force.map(|samples| TapForce {
                tap: self.decays.len() - 1,
                start: -(samples.len() as f64) / rate,
                samples,
                sample_rate: rate,
            }));
            return;
        };
        // Taps that were cut off have no force to be weighted by.
        if self.has_force && force.is_none() {
            groups.taps -= 1;
            return;
        }
        groups.count += 1;
        let is_weaker = tap.peak <= groups.weight;
        if !self.has_force && !is_weaker {
            groups.sum.iter_mut().for_each(Vec::clear);
            groups.weight = 0.0;
        }
        if self.has_force || !is_weaker {
            for (sum, decay) in groups.sum.iter_mut().zip(decays) {
                add_weighted(sum, decay, tap.peak);
            }
            groups.weight += tap.peak;
        }
        if let Some(mut force) = force {
            // Both end where the decay begins.
            force.reverse();
            add_weighted(&mut groups.force, &force, tap.peak);
        }
        if groups.count >= groups.size && groups.is_settled {
            self.finish_group();
        }
    }

    /// Returns true where the content of the decays must be known before they are kept.
    pub fn needs_highest_peak(&self) -> bool {
        let groups = self.groups.as_ref();
        groups.is_some_and(|groups| !groups.is_settled && groups.count >= groups.size)
    }

    /// Settles what is kept of a group, by the frequency of the highest peak (Hz).
    pub fn settle(&mut self, highest_peak: f64) {
        let Some(groups) = &mut self.groups else {
            return;
        };
        let rate = DISPLAY_RATIO * MARGIN * highest_peak;
        let factor = (self.sample_rate / rate) as usize;
        let mut values = self.samples * self.responses;
        if factor >= 2 {
            groups.thinning = Some(Thinning::new(self.sample_rate, factor));
            values /= factor;
        }
        let most = (MOST_OF_GROUPS / values.max(1)).clamp(FEWEST_GROUPS, MOST_GROUPS);
        groups.size = groups.taps.div_ceil(most);
        groups.is_settled = true;
        if groups.count >= groups.size {
            self.finish_group();
        }
    }

    fn finish_group(&mut self) {
        let Some(groups) = self.groups.as_mut().filter(|groups| groups.weight > 0.0) else {
            return;
        };
        let share = 1.0 / groups.weight;
        let all = groups.sum.iter_mut().chain([&mut groups.force]);
        all.flatten().for_each(|x| *x *= share);
        groups.force.reverse();
        let first = groups.thinning.as_ref().map_or(0, Thinning::first);
        let rate = groups
            .thinning
            .as_ref()
            .map_or(self.sample_rate, Thinning::rate);
        let force = match &groups.thinning {
            // A filter's length more than the force is long.
            Some(thinning) => {
                let frames = groups.force.len() + 2 * first;
                let steps = frames as f64 * rate / self.sample_rate;
                thinning.thin_before(&groups.force, steps.ceil() as usize)
            }
            None => groups.force.clone(),
        };
        self.decays.push(Decay {
            start: (groups.delay + first as u64) as f64 / self.sample_rate,
            sample_rate: rate,
            responses: match &groups.thinning {
                Some(thinning) => groups.sum.iter().map(|sum| thinning.thin(sum)).collect(),
                None => groups.sum.clone(),
            },
        });
        if self.has_force {
            self.forces.push(TapForce {
                tap: self.decays.len() - 1,
                start: -(force.len() as f64) / rate,
                samples: force,
                sample_rate: rate,
            });
        }
        groups.sum.iter_mut().for_each(Vec::clear);
        groups.force.clear();
        (groups.weight, groups.count) = (0.0, 0);
    }

    /// Returns what was gathered.
    pub fn finish(mut self, lines: &Lines) -> Option<CollectedDecays> {
        if let Some(groups) = &self.groups {
            // The rest makes a group where it is most of one.
            if 2 * groups.count >= groups.size || self.decays.is_empty() {
                self.finish_group();
            }
        }
        let taps_together = self.groups.as_ref().map(|groups| groups.size);
        let taps_together = taps_together.filter(|size| *size > 1);
        let thinning = self.groups.and_then(|groups| groups.thinning);
        let high = thinning.map_or(lines.high, |thinning| thinning.highest());
        let lengths = self
            .decays
            .iter()
            .flat_map(|decay| &decay.responses)
            .map(Vec::len);
        let samples = largest_smooth_block(lengths.min()?.min(self.samples))?;
        Some(CollectedDecays {
            taps_together,
            samples,
            band: (lines.low, lines.high.min(high)),
            decays: self.decays,
            forces: self.forces,
        })
    }
}

/// Adds the values times a weight; the sum is as long as the shortest of them.
fn add_weighted(sum: &mut Vec<f64>, values: &[f64], weight: f64) {
    match sum.is_empty() {
        true => sum.extend(values.iter().map(|x| weight * x)),
        false => {
            sum.truncate(values.len());
            sum.iter_mut()
                .zip(values)
                .for_each(|(sum, x)| *sum += weight * x);
        }
    }
}

/// Decays of taps, or of groups of them.
pub(super) struct CollectedDecays {
    /// Taps of a group, of which the last may have fewer; `None` where each tap is by itself.
    pub taps_together: Option<usize>,
    /// Samples of each that are fitted.
    pub samples: usize,
    /// Lowest and highest frequency that they have (Hz).
    pub band: (f64, f64),
    /// The decays.
    pub decays: Vec<Decay>,
    /// The forces before them; fewer than decays where some were cut off, none without a hammer.
    pub forces: Vec<TapForce>,
}
