//! Results of the estimate: modes, the scatter between their recordings, the joint, perturbations. Plain data, for the
//! report and for callers.

use super::structure::TestedStructure;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use tapjoint_beam::specimen::Specimen;
use tapjoint_beam::{Beam, JointStiffness};
use tapjoint_identify::consistent::{
    AttachmentTolerance, ConsistentEstimate, JointedStructure, LeftOutAnswer, OutlyingMode,
};
use tapjoint_identify::observation::UNPAIRED;
use tapjoint_identify::{FreeBeamEstimate, JointEstimate, MeasuredMode, PredictedMode, Uncertain};
use tapjoint_numerics::stats::chi_square_quantile;
use tapjoint_signal::modal::{ModeReading, ReadBy};

/// Method by which a joint or a beam is estimated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EstimateMethod {
    /// Least squares on the frequencies themselves, the closed form beside it.
    #[default]
    Consistent,
    /// The closed form alone: the regression over pairs of modes, or a free beam's.
    Pairs,
    /// The closed form of a free beam, which stands in results where a joint has the pair regression.
    FreeBeam,
}

impl EstimateMethod {
    /// The methods that can be asked for.
    pub const ALL: [Self; 2] = [Self::Consistent, Self::Pairs];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Pairs => "pairs",
            Self::FreeBeam => "free-beam",
        }
    }
}

/// One resonance.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeResult {
    /// The model's number; `None` for a peak that belongs to no mode.
    pub mode: Option<usize>,
    /// Best frequency (Hz).
    pub frequency: f64,
    /// Bound of a line reading (Hz), where known.
    pub half_line: Option<f64>,
    /// Standard uncertainty of the best frequency (Hz), where known.
    pub std: Option<f64>,
    /// Scatter between the recordings that were merged; `None` with one recording.
    pub between: Option<BetweenRecordings>,
    /// Its frequency (Hz) in each set-up, by the index of the set-up's first recording. Bands of one file are one set-up.
    pub repeats: BTreeMap<usize, f64>,
    /// Damping ratio (1) that a file of modes states; `None` for a mode that was read here.
    pub damping: Option<f64>,
    /// The reading behind it; `None` for frequencies read elsewhere.
    pub reading: Option<ModeReading>,
    /// File of the recording it was read from.
    pub recording: Option<String>,
    /// Non-dimensional frequency of an Euler beam (1), where there is a beam.
    pub lambda: Option<f64>,
}

impl ModeResult {
    /// A resonance as this recording reads it, without a number.
    pub(super) fn of(reading: ModeReading, recording: &str) -> Self {
        ModeResult {
            mode: None,
            frequency: reading.frequency,
            half_line: Some(reading.half_line),
            std: reading.std,
            between: None,
            repeats: BTreeMap::new(),
            damping: None,
            recording: Some(recording.to_owned()),
            lambda: None,
            reading: Some(reading),
        }
    }

    /// Returns the half width (Hz) of the uniform part of its error: half a line where it was read on one, 0 where its errors
    /// are normal.
    pub(super) fn half_width(&self) -> f64 {
        match &self.reading {
            Some(reading) if reading.source == ReadBy::Line => {
                0.5 * (reading.interval.1 - reading.interval.0)
            }
            Some(_) => 0.0,
            None => self.half_line.unwrap_or(0.0),
        }
    }

    /// Returns true unless its reading says that it is no mode.
    pub(super) fn may_be_mode(&self) -> bool {
        let reading = self.reading.as_ref();
        reading.is_none_or(|reading| reading.label.is_none())
    }

    /// Returns true for a resonance that got no number.
    pub(super) fn is_unpaired(&self) -> bool {
        self.mode.is_none() && self.may_be_mode()
    }

    /// Its mean frequency (Hz) over the set-ups; `None` in fewer than two.
    pub(super) fn mean_of_repeats(&self) -> Option<f64> {
        let count = self.repeats.len();
        (count > 1).then(|| self.repeats.values().sum::<f64>() / count as f64)
    }

    /// Words for a peak that is no mode: "mains 50 Hz", "unpaired"; `None` for a mode.
    pub fn label(&self) -> Option<String> {
        let label = self.reading.as_ref().and_then(|reading| reading.label);
        match self.mode {
            Some(_) => None,
            None => Some(label.map_or(UNPAIRED.to_owned(), |label| label.to_string())),
        }
    }
}

/// The beam where its clamp was moved, and its modes.
#[derive(Debug, Clone, PartialEq)]
pub struct MovedLength {
    /// Free length (m).
    pub length: f64,
    /// Files of the recordings that give its modes.
    pub recordings: Vec<String>,
    /// The structure of this length, with the masses of its first recording.
    pub structure: JointedStructure,
    /// Uncertainties of its masses, in their order.
    pub attachments: Vec<AttachmentTolerance>,
    /// Its modes, ascending.
    pub modes: Vec<ModeResult>,
}

/// One mode in the recordings of one configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BetweenRecordings {
    /// Variance of its frequency between the recordings, sum (f - mean)^2/(n - 1), over the mean's square (1).
    pub variance: f64,
    /// Variance by the readings' own standard uncertainties, over the mean's square (1).
    pub own: f64,
    /// Recordings less one.
    pub freedom: usize,
}

/// From the frequencies of one mode and their standard uncertainties; `None` below two.
pub(super) fn between(readings: &[(f64, f64)]) -> Option<BetweenRecordings> {
    let freedom = readings
        .len()
        .checked_sub(1)
        .filter(|freedom| *freedom > 0)?;
    let count = readings.len() as f64;
    let mean = readings.iter().map(|one| one.0).sum::<f64>() / count;
    let squares: f64 = readings.iter().map(|one| (one.0 - mean).powi(2)).sum();
    let own: f64 = readings.iter().map(|one| one.1 * one.1).sum();
    Some(BetweenRecordings {
        variance: squares / freedom as f64 / (mean * mean),
        own: own / count / (mean * mean),
        freedom,
    })
}

/// [`common_share`] of the modes with a scatter of their own.
pub(super) fn scatter_of<'a>(modes: impl Iterator<Item = &'a ModeResult>) -> f64 {
    let between: Vec<BetweenRecordings> = modes.filter_map(|mode| mode.between).collect();
    common_share(&between)
}

/// The modes with a number, ascending. Modes of one list may come from recordings between which the joint
/// drifted, or the room's temperature or the mounting: no joint has them all, and how far they are apart is part
/// of each one's uncertainty. All get the same share of their frequency, `scatter` (1): weighed by its own scatter, a
/// mode that feels the joint most would count least. What no repetition shows, `floor` (1), is added to every one that
/// was read here.
pub(super) fn measured_modes(modes: &[ModeResult], scatter: f64, floor: f64) -> Vec<MeasuredMode> {
    let mut measured = Vec::with_capacity(modes.len());
    for mode in modes {
        let Some(number) = mode.mode else { continue };
        let share = match mode.reading {
            Some(_) => scatter.hypot(floor),
            None => scatter,
        };
        measured.push(MeasuredMode {
            mode: number,
            frequency: mode.frequency,
            std: mode.std.map(|std| std.hypot(share * mode.frequency)),
        });
    }
    measured
}

/// The modes of each set-up alone, ascending, each with its own frequency; none where the set-ups agree within their
/// readings' uncertainty. `floor` (1) is added to every uncertainty.
pub(super) fn set_ups(modes: &[ModeResult], floor: f64) -> Vec<Vec<MeasuredMode>> {
    let between: Vec<BetweenRecordings> = modes.iter().filter_map(|mode| mode.between).collect();
    if !exceeds_noise(&between) {
        return Vec::new();
    }
    let all = modes.iter().flat_map(|mode| mode.repeats.keys().copied());
    let mut set_ups = Vec::new();
    for set_up in BTreeSet::from_iter(all) {
        let own = modes
            .iter()
            .filter(|mode| mode.repeats.contains_key(&set_up));
        let own = own.map(|mode| ModeResult {
            frequency: mode.repeats[&set_up],
            ..mode.clone()
        });
        set_ups.push(measured_modes(&own.collect::<Vec<_>>(), 0.0, floor));
    }
    set_ups
}

/// The share of its frequency (1) by which every mode scatters between recordings beyond its own uncertainty.
///
/// It makes the squares as large as expected: sum f variance/(own + share^2) = sum f, with f degrees of freedom of
/// each mode (after Paule & Mandel 1982, "Consensus values and weighting factors"). Coarsely read modes count little.
/// One mode that stands still while others move decides nothing by itself. 0 where there is no more than noise.
pub(super) fn common_share(all: &[BetweenRecordings]) -> f64 {
    let freedom: f64 = all.iter().map(|one| one.freedom as f64).sum();
    if all.is_empty() || squares(all, 0.0) <= freedom {
        return 0.0;
    }
    // Without uncertainties of their own the mean variance would be the square: it is no larger.
    let mean = all
        .iter()
        .map(|one| one.freedom as f64 * one.variance)
        .sum::<f64>()
        / freedom;
    let (mut low, mut high) = (0.0, mean);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if squares(all, middle) > freedom {
            low = middle;
        } else {
            high = middle;
        }
    }
    high.sqrt()
}

/// Halvings of the interval in which the square lies: it is known to 1e-15 of its largest possible value.
const HALVINGS: usize = 50;

/// Sum of the squares over their variances, a common one included.
fn squares(all: &[BetweenRecordings], common: f64) -> f64 {
    let modes = all.iter();
    modes
        .map(|one| one.freedom as f64 * one.variance / (one.own + common))
        .sum()
}

/// Returns true if the recordings differ by more than their readings' uncertainty explains.
///
/// One test in a hundred does so by chance where the uncertainty is known and alike in all recordings; of a few taps,
/// several.
pub(super) fn exceeds_noise(all: &[BetweenRecordings]) -> bool {
    let freedom: usize = all.iter().map(|one| one.freedom).sum();
    chi_square_quantile(0.99, freedom as f64).is_some_and(|most| squares(all, 0.0) > most)
}

/// The joint, or the material of a free beam, by the modes.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The main estimate: the joint whose frequencies are nearest; `None` where it was not asked for
    /// or could not be had.
    pub consistent: Option<Box<ConsistentEstimate>>,
    /// The same by the readings alone: the description exact, and a model that misses nothing.
    pub from_readings: Option<Box<ConsistentEstimate>>,
    /// The mode that is left out because it does not belong to the others. The diagnosis leaves it out unless an effect explains it.
    pub left_out: Option<LeftOutMode>,
    /// Several modes, one of which does not belong to the others. The diagnosis takes them all: an effect that the model lacks
    /// may be the cause.
    pub one_of_several: Option<LeftOutMode>,
    /// Numbers of the modes under which the model would explain them, where it does not as they are numbered.
    pub better_numbers: Option<Vec<usize>>,
    /// Standard uncertainties of the description that it does not state, in words; empty without any.
    pub assumed: String,
    /// The estimate in closed form, which stands beside the main one or in its place.
    pub estimate: Option<Estimate>,
    /// The reason for which there is no estimate, or not the one that was asked for.
    pub reason: Option<String>,
    /// Predicted beside measured frequencies; empty where no joint can be predicted with.
    pub prediction: Vec<PredictedMode>,
    /// The structure that the prediction is of; `None` without a joint to predict with.
    pub predicted: Option<Specimen>,
    /// Estimates under errors of the frequencies, by each method that has one.
    pub perturbations: Perturbations,
}

impl Identification {
    /// The mode that the estimate is without, alone or as the most probable of several.
    pub fn without_mode(&self) -> Option<&LeftOutMode> {
        self.left_out.as_ref().or(self.one_of_several.as_ref())
    }

    /// The method that estimate and prediction go by, if `wanted` is asked for: the consistent estimate where there is
    /// one, or where all stiffnesses are known.
    pub(super) fn method(
        &self,
        structure: &TestedStructure,
        wanted: EstimateMethod,
    ) -> EstimateMethod {
        if wanted == EstimateMethod::Consistent && self.predicts_with_details(structure) {
            EstimateMethod::Consistent
        } else {
            EstimateMethod::Pairs
        }
    }

    /// Returns true if there is an estimate by any method.
    pub fn is_answered(&self) -> bool {
        self.consistent.is_some() || self.estimate.is_some()
    }

    /// The beam and the joint (non-dimensional by that beam) that predictions are made with: those of
    /// the main estimate, else of the closed form with known stiffnesses in the place of its own, else
    /// the known ones; `None` where no joint is known.
    pub fn beam_and_joint(&self, structure: &TestedStructure) -> Option<(Beam, JointStiffness)> {
        match (&self.consistent, &self.estimate) {
            (Some(found), _) => Some((found.beam, found.joint)),
            (None, Some(Estimate::FreeBeam(found))) => {
                let modulus = found.modulus.value;
                let beam = Beam {
                    modulus,
                    ..structure.beam
                };
                Some((beam, JointStiffness::FREE))
            }
            (None, Some(Estimate::Joint(found))) => {
                let joint = structure.known.over(found.pairs.joint())?;
                Some((structure.beam, joint))
            }
            (None, None) => Some((structure.beam, structure.known.over(None)?)),
        }
    }

    /// Returns true if predictions take in what is fastened to the beam and a lap joint's unequal halves: a
    /// closed form that was estimated without them has their effect in its stiffnesses already.
    pub fn predicts_with_details(&self, structure: &TestedStructure) -> bool {
        self.consistent.is_some() || structure.known.over(None).is_some()
    }
}

/// An estimate in closed form.
#[derive(Debug, Clone, PartialEq)]
pub enum Estimate {
    /// A joint, by the pair regression.
    Joint(Box<JointEstimate>),
    /// A free beam's material.
    FreeBeam(Box<FreeBeamEstimate>),
}

/// A mode that is left out of the estimate, and the estimates with it and without others.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOutMode {
    /// How it deviates. Of several modes that may be the outlying one it is the most probable.
    pub found: OutlyingMode,
    /// The estimates without each of the modes that may be the outlying one, the most probable first.
    pub answers: Vec<LeftOutAnswer>,
    /// The estimate from all modes.
    pub with_all: Box<ConsistentEstimate>,
}

/// Estimates under changed frequencies, by each method that has one: first the pair regression, then the consistent
/// estimate.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Perturbations {
    /// All frequencies up and down by a percentage.
    pub uniform: Vec<PerturbationSection>,
    /// Average errors of the percentages.
    pub averages: Vec<AverageSection>,
    /// Under random errors; empty where no standard deviations are known, or none was asked for.
    pub random: Vec<MonteCarloSection>,
    /// Under each mode's own bound; empty where no bounds are known.
    pub spans: Vec<ResolutionSpanSection>,
}

impl Perturbations {
    /// Returns true if no estimate was perturbed.
    pub fn is_empty(&self) -> bool {
        self.uniform.is_empty() && self.random.is_empty() && self.spans.is_empty()
    }
}

/// An estimate from frequencies changed by the same percentage.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct PerturbationSection {
    /// Change of all frequencies (%), signed.
    pub percent: f64,
    /// "pairs" or "consistent".
    pub method: EstimateMethod,
    /// Kx.
    pub kx: Option<f64>,
    /// Ky.
    pub ky: Option<f64>,
    /// Kz.
    pub kz: Option<f64>,
}

/// Average errors of +percent and -percent: the mean of their magnitudes, as in table 9 of Ingole &
/// Chatterjee, and the error of their mean, as in table 14.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct AverageSection {
    /// "pairs" or "consistent".
    pub method: EstimateMethod,
    /// Change of all frequencies (%), its size.
    pub percent: f64,
    /// Mean of the magnitudes, of Kx (%).
    pub kx_percent: Option<f64>,
    /// Mean of the magnitudes, of Ky (%).
    pub ky_percent: Option<f64>,
    /// Mean of the magnitudes, of Kz (%).
    pub kz_percent: Option<f64>,
    /// Magnitude of the error of the mean of Kx (%), as in table 14. It is smaller, because opposite errors cancel.
    pub kx_of_mean_percent: Option<f64>,
    /// Magnitude of the error of the mean of Ky (%).
    pub ky_of_mean_percent: Option<f64>,
    /// Magnitude of the error of the mean of Kz (%).
    pub kz_of_mean_percent: Option<f64>,
}

/// Estimates under random errors of the frequencies: median and 95 % interval.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct MonteCarloSection {
    /// "pairs" or "consistent".
    pub method: EstimateMethod,
    /// Repetitions.
    pub samples: usize,
    /// Number of repetitions without an estimate.
    pub failed: usize,
    /// Kx.
    pub kx: Option<Uncertain>,
    /// Ky.
    pub ky: Option<Uncertain>,
    /// Kz.
    pub kz: Option<Uncertain>,
    /// The first repetitions' estimates, for a picture: (Kx, Ky).
    #[serde(skip)]
    pub cloud: Vec<[f64; 2]>,
}

/// Spans of the estimate over the bounds of the readings.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct ResolutionSpanSection {
    /// "pairs" or "consistent".
    pub method: EstimateMethod,
    /// Number of sign patterns tried.
    pub patterns: usize,
    /// True where the patterns were drawn at random, because there are too many to try all.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub sampled: bool,
    /// Patterns that left no estimate.
    pub failed: usize,
    /// Smallest and largest Kx.
    pub kx: Option<[f64; 2]>,
    /// Smallest and largest Ky.
    pub ky: Option<[f64; 2]>,
    /// Smallest and largest Kz.
    pub kz: Option<[f64; 2]>,
    /// All estimates over the patterns, for a picture: (Kx, Ky).
    #[serde(skip)]
    pub cloud: Vec<[f64; 2]>,
    /// Change of each parameter (%) when one mode moves by its own bound.
    pub sensitivity: Vec<SensitivitySection>,
    /// Change of each parameter when all modes move by one factor; null of an exact description.
    pub common_scale: Option<CommonScaleSection>,
}

/// Change of the estimate when all frequencies are off by one factor, as where modulus, density, thickness or length of the
/// bar are not as stated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct CommonScaleSection {
    /// Standard uncertainty of this factor by the description (%): that of h/L^2 sqrt(E/rho).
    pub scale_percent: f64,
    /// Change of Kx (%) by it.
    pub kx_percent: Option<f64>,
    /// Change of Ky (%).
    pub ky_percent: Option<f64>,
    /// Change of Kz (%).
    pub kz_percent: Option<f64>,
    /// Change of Kx (%) per change of all frequencies (%), for small changes.
    pub kx_percent_per_percent: Option<f64>,
    /// Change of Ky (%) per change of all frequencies (%).
    pub ky_percent_per_percent: Option<f64>,
    /// Change of Kz (%) per change of all frequencies (%).
    pub kz_percent_per_percent: Option<f64>,
}

/// Change of the estimate by one mode's bound.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct SensitivitySection {
    /// Mode number.
    pub mode: usize,
    /// The bound (Hz).
    pub half_line: f64,
    /// Change of Kx (%).
    pub kx_percent: Option<f64>,
    /// Change of Ky (%).
    pub ky_percent: Option<f64>,
    /// Change of Kz (%).
    pub kz_percent: Option<f64>,
    /// Change of Kx (%) per change of this frequency (%), for small changes.
    pub kx_percent_per_percent: Option<f64>,
    /// Change of Ky (%) per change of this frequency (%).
    pub ky_percent_per_percent: Option<f64>,
    /// Change of Kz (%) per change of this frequency (%).
    pub kz_percent_per_percent: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Modes in three recordings, each drifting by a draw of its own of `share`, and read to its own relative standard
    /// deviation.
    fn drawn(stds: &[f64], share: f64, random: &mut ChaCha8Rng) -> Vec<BetweenRecordings> {
        let of_mode = |(mode, std): (usize, &f64)| {
            let nominal = 40.0 * (mode as f64 + 1.0).powi(2);
            let reading = |_| {
                let (own, drift): (f64, f64) =
                    (random.sample(StandardNormal), random.sample(StandardNormal));
                (nominal * (1.0 + std * own + share * drift), nominal * std)
            };
            between(&(0..3).map(reading).collect::<Vec<_>>()).unwrap()
        };
        stds.iter().enumerate().map(of_mode).collect()
    }

    const STDS: [f64; 5] = [1e-4, 5e-5, 2e-4, 1e-4, 5e-5];

    #[test]
    fn limit_one_reading_says_nothing_and_equal_ones_scatter_by_nothing() {
        assert_eq!(between(&[(40.0, 0.1)]), None);
        let still = between(&[(40.0, 0.1), (40.0, 0.1)]).unwrap();
        assert_eq!(common_share(&[still]), 0.0);
        assert_eq!(common_share(&[]), 0.0);
        assert!(!exceeds_noise(&[]) && !exceeds_noise(&[still]));
    }

    /// Over 400 tests of 10 degrees of freedom the mean square is known to sqrt(2/4000) = 2 % where the share is
    /// far above the readings' own; 8 % are four times that.
    #[test]
    fn recover_the_share_of_a_drift() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for share in [1e-3, 1e-2] {
            let squares = (0..400).map(|_| common_share(&drawn(&STDS, share, &mut random)).powi(2));
            let found = (squares.sum::<f64>() / 400.0).sqrt();
            assert!((found / share - 1.0).abs() < 0.04, "{found} for {share}");
        }
    }

    /// One in a hundred of 2000 is 20 with a standard deviation of 4.5; 40 are more than four of these.
    #[test]
    fn recover_readings_without_drift_seldom_differ_and_hardly_scatter() {
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let all: Vec<_> = (0..2000).map(|_| drawn(&STDS, 0.0, &mut random)).collect();
        let told = all.iter().filter(|one| exceeds_noise(one)).count();
        assert!((2..40).contains(&told), "{told}");
        // The finest readings are known to 5e-5 each; what ten degrees of freedom take for a share is below that.
        let mean = all.iter().map(|one| common_share(one)).sum::<f64>() / 2000.0;
        assert!(mean < 5e-5, "{mean}");
    }

    /// A mode that feels no drift, and is read best of all, does not hide that of the others.
    #[test]
    fn regress_one_mode_that_stands_still_does_not_hide_the_others() {
        let one = |variance: f64, own: f64| BetweenRecordings {
            variance,
            own,
            freedom: 2,
        };
        let found = common_share(&[one(0.5e-12, 1e-12), one(2.5e-5, 1e-8)]);
        // 4 = 2 variance/share^2, to the other mode's own variance.
        assert!(
            (found / (2.5e-5_f64 / 2.0).sqrt() - 1.0).abs() < 1e-3,
            "{found}"
        );
    }

    /// A mode read to 1 % may say that nothing drifted, with its two of twelve degrees of freedom: sqrt(12/10) is 1.1.
    #[test]
    fn limit_a_coarse_mode_says_little_beside_fine_ones() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut all = drawn(&STDS, 1e-3, &mut random);
        let without = common_share(&all);
        for off in [0.0, 0.3] {
            let coarse = between(&[(40.0 - off, 0.4), (40.0 + off, 0.4), (40.0, 0.4)]);
            all.push(coarse.unwrap());
            let with = common_share(&all);
            assert!((with / without - 1.0).abs() < 0.1, "{with} for {without}");
            all.pop();
        }
    }
}
