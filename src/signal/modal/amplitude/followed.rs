//! One mode followed along the decays after all taps.

use std::f64::consts::TAU;

use num_complex::Complex64;
use tapjoint_numerics::stats::median;

use super::band::{self, Band};
use super::decay::DecayModel;
use super::segments::follow_decay;
use super::stated::WholeDecays;
use super::trend::Trend;
use super::{
    AmplitudeCurve, AmplitudePoint, AmplitudeVerdict, Companion, Decay, KnownMode, LEAST_POINTS,
    LEVEL, is_far,
};

/// Distance from which a neighbour that drifts is subtracted (half-power widths of both together). 5: nearer ones are one
/// with the mode in the model of either.
const APART: f64 = 5.0;

/// Relative change of the damping with which a mode that drifts is followed again. A tenth: the terms of the drift fit to
/// its decay.
const OTHER_DAMPING: f64 = 0.1;
/// Least share of the listed damping that is believed.
const LEAST_SHARE: f64 = 0.1;

/// A mode in the decays after all taps.
pub(super) struct FollowedMode {
    /// Place in the list of the modes.
    pub index: usize,
    /// As it is listed.
    mode: KnownMode,
    /// Sensor whose amplitude is given.
    sensor: usize,
    /// Distance from the mode (Hz) beyond which nothing passes.
    reach: f64,
    /// Length of the longest filter (s).
    filter: Option<f64>,
    /// Decays that were followed.
    decays: Vec<(Band, DecayModel)>,
    points: Vec<AmplitudePoint>,
    companions: Vec<Companion>,
    doubts: Vec<AmplitudeVerdict>,
    /// True where the decays show that the mode's frequency or damping changes.
    pub drifts: bool,
}

impl FollowedMode {
    /// Follows the mode `index` of the list. The modes `taken` have been subtracted. `None` where no sensor has it.
    pub fn new(
        decays: &[Decay],
        modes: &[KnownMode],
        index: usize,
        taken: &[usize],
    ) -> Option<Self> {
        let taps = decays.iter().enumerate();
        let bands: Vec<Band> = taps
            .filter_map(|(tap, decay)| band::extract_band(decay, tap, modes, index, taken))
            .collect();
        let sensor = band::strongest(&bands)?;
        let mut followed = FollowedMode {
            index,
            mode: modes[index],
            sensor,
            reach: bands.iter().map(Band::stop_edge).fold(0.0, f64::max),
            filter: bands.iter().map(|band| band.filter).max_by(f64::total_cmp),
            decays: Vec::new(),
            points: Vec::new(),
            companions: Vec::new(),
            doubts: Vec::new(),
            drifts: false,
        };
        let mut all_series = Vec::new();
        for band in bands {
            let Some(series) = band::combine(&band, sensor) else {
                continue;
            };
            let model = DecayModel::fit(&series, &band);
            let mut points = follow_decay(&series, &band, &model);
            let found = !points.is_empty();
            points.retain(|point| !is_far(point.frequency, modes[index].frequency));
            if found && points.is_empty() {
                // The decay that was followed is not the mode's.
                continue;
            }
            if !model.is_sound(&band) {
                continue;
            }
            followed.companions.extend(model.companions(&band));
            followed.points.extend(points);
            followed.doubts.extend(model.doubt(&band));
            followed.decays.push((band, model));
            all_series.push(series);
        }
        let whole = WholeDecays::new(&followed.decays, &followed.mode);
        followed.drifts = whole.is_some_and(|whole| whole.changes());
        // A mode that does not change has its frequency at every amplitude.
        if followed.drifts {
            for ((band, model), series) in followed.decays.iter_mut().zip(&all_series) {
                model.add_ways(series, band);
            }
        }
        Some(followed)
    }

    /// Returns true where another mode lies in the band of this one, and is not one with it.
    pub fn is_disturbed_by(&self, other: &FollowedMode) -> bool {
        let distance = (other.mode.frequency - self.mode.frequency).abs();
        self.index != other.index && distance < self.reach && self.is_apart_from(other)
    }

    /// Returns true where the frequencies of the two stay apart along all decays. One mode that moves far may be listed as
    /// several.
    pub fn is_apart_from(&self, other: &FollowedMode) -> bool {
        let widths = [self, other].map(|one| one.mode.frequency * one.mode.damping_ratio);
        let least = APART * (widths[0] + widths[1]);
        let [own, theirs] = [self, other].map(FollowedMode::frequencies);
        own.0 - theirs.1 > least || theirs.0 - own.1 > least
    }

    /// Damping ratio that the models of a mode that drifts have, where it differs from the listed one. A pole that does not
    /// change takes the change of the frequency for damping.
    pub fn other_damping(&self) -> Option<f64> {
        if !self.drifts {
            return None;
        }
        let decays = self.decays.iter();
        let mut decays: Vec<f64> = decays.map(|(band, model)| model.mean_decay(band)).collect();
        let ratio = median(&mut decays) / TAU / self.mode.frequency;
        let change = ratio / self.mode.damping_ratio;
        let differs = (change - 1.0).abs() > OTHER_DAMPING
            && (LEAST_SHARE..1.0 / LEAST_SHARE).contains(&change);
        differs.then_some(ratio)
    }

    /// Lowest and highest frequency (Hz) along the decays.
    fn frequencies(&self) -> (f64, f64) {
        let listed = self.mode.frequency;
        let decays = self.decays.iter();
        let all = decays.map(|(band, model)| model.frequencies(band));
        all.fold((listed, listed), |(low, high), (least, most)| {
            (least.min(low), most.max(high))
        })
    }

    /// Subtracts the mode, as its models have it, from every sensor after every tap.
    pub fn subtract_from(&self, decays: &mut [Decay]) {
        for (band, model) in &self.decays {
            let Some(decay) = decays.get_mut(band.tap) else {
                continue;
            };
            let shares = model.shares(band);
            let count = decay.responses.iter().map(Vec::len).min().unwrap_or(0);
            let ring: Vec<Complex64> = model.ring(band, count);
            for (response, share) in decay.responses.iter_mut().zip(shares) {
                for (x, value) in response.iter_mut().zip(&ring) {
                    *x -= (share * value).re;
                }
            }
        }
    }

    /// Returns what the decays say of frequency and damping against amplitude.
    pub fn curve(&self, steady_lines: &[f64]) -> AmplitudeCurve {
        let mut curve = AmplitudeCurve {
            points: self.points.clone(),
            filter_length: self.filter,
            companions: self.companions.clone(),
            ..AmplitudeCurve::without_points(Some(self.sensor))
        };
        let is_unresolved = self
            .doubts
            .iter()
            .any(|doubt| matches!(doubt, AmplitudeVerdict::Unresolved { .. }));
        // Of two modes that one decay cannot separate neither amplitude is known.
        if !is_unresolved && let Some(whole) = WholeDecays::new(&self.decays, &self.mode) {
            curve.reference = Some(whole.reference());
            // Beside a mode so near, or where two poles that do not change explain the decays as well, nothing drifts. Hum
            // beats with the mode, which looks like a change.
            let frequency = self.mode.frequency;
            let mut lines = steady_lines.iter();
            let has_hum = lines.any(|line| (line - frequency).abs() < self.reach);
            if self.doubts.is_empty() && !has_hum {
                curve.drift = whole.drift(&curve.points);
            }
            // A model that goes that far says nothing of the mode, nor of its amplitude.
            let drift = curve.drift.as_ref();
            if drift.is_some_and(|drift| is_far(drift.frequency.value, frequency)) {
                (curve.drift, curve.reference) = (None, None);
            }
        }
        if curve.points.len() < LEAST_POINTS {
            return curve;
        }
        curve.frequency = Trend::fit(&curve.points, |p| (p.frequency, p.frequency_std));
        curve.damping = Trend::fit(&curve.points, |p| (p.damping_ratio, p.damping_std));
        // Two tests share the level (Bonferroni).
        let trends = [&curve.frequency, &curve.damping];
        let changes = (trends.into_iter().flatten()).any(|trend| trend.p_value < 0.5 * LEVEL);
        curve.verdict = match self.doubts.first() {
            _ if !changes => AmplitudeVerdict::Steady,
            // One decay without a doubt settles it for all.
            Some(doubt) if self.doubts.len() == self.decays.len() => *doubt,
            _ => AmplitudeVerdict::Changes,
        };
        curve
    }
}

impl AmplitudeCurve {
    /// Returns the curve of a mode that was not followed.
    pub(super) fn without_points(sensor: Option<usize>) -> Self {
        AmplitudeCurve {
            points: Vec::new(),
            sensor,
            filter_length: None,
            frequency: None,
            damping: None,
            companions: Vec::new(),
            verdict: AmplitudeVerdict::TooFewPoints,
            reference: None,
            drift: None,
        }
    }
}
