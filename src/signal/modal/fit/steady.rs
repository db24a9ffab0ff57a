//! Places of steady lines: hum that goes on through the decays, fitted beside the modes.

use num_complex::Complex64;

use super::SteadyLine;
use super::group::{Accepted, BandData, Group, half_band};
use super::variable_projection::STEADY;

/// Distance of the places at which a line is looked for (resolutions). A quarter: the peak of a line is a resolution wide.
const STEP: f64 = 0.25;
/// Most places to either side of a line. 40: ten resolutions, beyond which nothing but the samples before the first tap
/// can tell.
const MOST_STEPS: f64 = 40.0;
/// Most steps of the search for modes and line together.
const SEARCH_STEPS: usize = 20;

impl Accepted<'_> {
    /// Moves the steady lines beside fitted modes to where they explain the data best, within their bounds.
    ///
    /// The samples before a tap give the frequency of hum to a part of their own resolution. Records are longer, and an
    /// error of a tenth of their resolution disturbs the mode beside the line. Returns true where a line moved.
    pub(super) fn place_steady_lines(&mut self, groups: &[Group]) -> bool {
        let mut moved = false;
        for index in 0..self.settings.steady_lines.len() {
            let line = self.settings.steady_lines.remove(index);
            let position = line.frequency / self.data.spacing();
            let nearest = groups
                .iter()
                .flat_map(|group| group.fit.at.poles.iter().map(move |pole| (group, *pole)))
                .min_by(|a, b| {
                    let [a, b] = [a, b].map(|(_, pole)| (pole.im - position).abs());
                    a.total_cmp(&b)
                });
            let beside = nearest.filter(|(_, pole)| (pole.im - position).abs() < half_band(*pole));
            let reach = line.bound / self.data.spacing();
            let found = beside.and_then(|(group, _)| self.place_of(position, reach, group));
            moved |= found.is_some();
            let frequency = found.map_or(line.frequency, |found| found * self.data.spacing());
            self.settings
                .steady_lines
                .insert(index, SteadyLine { frequency, ..line });
        }
        moved
    }

    /// Returns the place (lines) of a steady line near `position` that leaves the least residual of a group; `None` where
    /// the data do not tell.
    fn place_of(&self, position: f64, reach: f64, group: &Group) -> Option<f64> {
        let band = BandData::new(self, &group.members).ok()?;
        let noise = self.noise(&group.members, &band.used)?;
        let problem = band.problem(group.fit.terms, &noise);
        let modes = self.poles(&group.members);
        let step = STEP * self.data.resolution() / self.data.spacing();
        let count = (reach / step).ceil().clamp(1.0, MOST_STEPS) as i32;
        let mut best: Option<(f64, Vec<Complex64>)> = None;
        for number in -count..=count {
            let place = position + f64::from(number) * step;
            let mut poles = modes.clone();
            poles.push(Complex64::new(-STEADY, place));
            let Some(at) = problem.amplitudes_at(&poles) else {
                continue;
            };
            if best
                .as_ref()
                .is_none_or(|(least, _)| at.square_sum < *least)
            {
                best = Some((at.square_sum, poles));
            }
        }
        let (least, start) = best?;
        let found = problem.search(&start, group.fit.freedom, SEARCH_STEPS)?.at;
        let place = found.poles.last()?.im;
        let near = (place - position).abs() <= reach + step;
        (near && found.square_sum <= least).then_some(place)
    }
}
