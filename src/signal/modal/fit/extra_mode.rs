//! Tests whether the data ask for one more mode.

use num_complex::Complex64;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use tapjoint_numerics::stats::root_mean_square;

use super::group::{Accepted, BandData, Group};
use super::mode_fit::ModeFit;
use super::variable_projection::half_width;
use super::{PoleStart, Unfit};

/// Test result for one more mode.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtraMode {
    /// True where the data need the mode: noise alone does not explain it, and it decays.
    pub needed: bool,
    /// Probability of a larger fall of the residual by noise alone at one given place.
    pub probability: f64,
    /// Modal assurance criterion between its shape and that of the nearest other mode of its group.
    ///
    /// For free decays it is taken over the sensors, as the mean of all taps weighted by their power; for
    /// frequency response functions over all columns. `None` without such a mode, with one sensor, and where noise alone
    /// explains the mode. Near 1
    /// the second pole may only correct a decay that is not straight: one mode whose frequency changes while
    /// it rings. The two poles' shares of a tap then depend on the tap's strength, which is no other shape.
    pub likeness: Option<f64>,
    /// Fit of the mode together with the others, where noise alone does not explain it.
    pub fit: Result<ModeFit, Unfit>,
    /// Fit of the nearest other mode of its group beside it.
    pub neighbour: Option<ModeFit>,
}

/// Largest probability of the residual's fall by chance. 10^-4: the place of the pole was chosen to suit
/// the data, out of some tens of lines.
const LEVEL: f64 = 1e-4;
/// The probability beyond which an added mode is given up after any sweep. 1 %: a hundred times the level, for the next
/// sweeps lower the residual a little more.
const HOPELESS: f64 = 0.01;
/// Least amplitude in standard deviations.
const LEAST_AMPLITUDE: f64 = 4.0;
/// Terms beyond the background that stand for a broad pole. 4: with the background's own they follow a maximum at any
/// place of the band, and two turning points.
const BROAD_TERMS: usize = 4;
/// Half widths to either side within which a second pole is looked for. 4: a pair is one where it lies within three half
/// widths of both poles.
const SCANNED: i32 = 4;
/// Dampings of such a pole, as shares of the mode's own. A narrower one makes a dent that no derivative follows.
const NARROWER: [f64; 2] = [0.3, 1.0];
/// Lines of its band on which a mode is tried first. In a record much longer than its decay a mode has ten
/// thousand of them, too many to fit for every chance proposal. On one line in s an amplitude has sqrt(s)
/// times its standard deviation, so that a mode that only all lines together show is not found.
const SCREENED: usize = 1000;

impl Accepted<'_> {
    /// Tests whether the data ask for a mode that begins at `extra`. Returns the test, and all modes together.
    ///
    /// The models with and without it are fitted to the same lines with the same background. The extra pole
    /// must lower the residual by far more than its unknowns explain, decay, and exceed its own uncertainty.
    /// Modes that are not fitted jointly with it do not change. A start that fails on thinned lines is not
    /// tried on all lines.
    pub fn test(&self, extra: &PoleStart) -> (ExtraMode, Self) {
        let (test, mut together, stride) = self.test_on(extra, SCREENED);
        if test.needed && stride > 1 {
            // From the pole of the thinned lines it is not far; it may move as far again as from a proposal.
            let start = test.fit.as_ref().map_or(*extra, |fit| PoleStart {
                frequency: fit.frequency.value,
                damping_ratio: Some(fit.damping_ratio.value),
            });
            let (test, together, _) = self.test_on(&start, usize::MAX);
            return (test, together);
        }
        together.most_lines = usize::MAX;
        (test, together)
    }

    /// Tests on at most so many lines of the band. Returns also the step between the lines taken.
    fn test_on(&self, extra: &PoleStart, most_lines: usize) -> (ExtraMode, Self, usize) {
        let mut beside = self.clone();
        beside.most_lines = most_lines;
        let last = self.modes.len();
        let mut test = ExtraMode {
            needed: false,
            probability: 1.0,
            likeness: None,
            fit: Err(Unfit::NotIndependent),
            neighbour: None,
        };
        let Some(group) = beside.add(extra) else {
            test.fit = Err(beside.modes[last].reason());
            return (test, beside, 1);
        };
        let stride = group.fit.problem.lines.stride;
        let place = group.members.iter().position(|&index| index == last);
        let gain = place.and_then(|place| Some((place, beside.gain_of(&group, place)?)));
        if let Some((place, (probability, information_gain))) = gain {
            test.probability = probability;
            test.fit = Err(Unfit::Unneeded);
            // Reading the modes takes long: only those that may be needed are read.
            if probability < LEVEL && information_gain > 0.0 {
                let nearest = group.fit.nearest(place);
                test.likeness =
                    nearest.and_then(|nearest| group.fit.likeness(self.data, place, nearest));
                let mut fits = beside.read(std::slice::from_ref(&group));
                test.fit = fits.swap_remove(last);
                let neighbour = nearest.map(|nearest| fits.swap_remove(group.members[nearest]));
                test.neighbour = neighbour.and_then(Result::ok);
                test.needed = (test.fit.as_ref()).is_ok_and(is_clear);
            }
        }
        (test, beside, stride)
    }

    /// Compares the fits with and without the pole at `place`, as [`gain`]; `None` where one of them fails.
    fn gain_of(&self, group: &Group, place: usize) -> Option<(f64, f64)> {
        let fit = &group.fit;
        let band = BandData::new(self, &group.members).ok()?;
        let mut fewer: Vec<Complex64> = fit.at.poles.clone();
        fewer.remove(place);
        // Both fits are made anew on the same lines: the lines of the last sweep came from earlier poles.
        let with = band.fit(&fit.at.poles, fit.terms, &fit.noise).ok()?;
        let without = match fewer.is_empty() {
            true => with.problem.columns.norm_squared(),
            false => band.fit(&fewer, fit.terms, &fit.noise).ok()?.at.square_sum,
        };
        gain(&band, with.at.square_sum, with.freedom, without)
    }

    /// Returns false where the data would hardly ask for a second pole beside the fitted mode of start `index`:
    /// [`test`](Self::test) takes some fifty times as long.
    ///
    /// A second pole within about two half widths adds the derivatives of the first one's function, and a broad pole is a
    /// polynomial over the band. There is room where these with free amplitudes are needed, or a pole at one of some places
    /// up to four half widths away. Second poles at the limit of what the data show may be missed.
    pub fn has_room_beside(&self, index: usize, mode: &ModeFit) -> bool {
        let thinned = Accepted {
            most_lines: SCREENED,
            ..self.clone()
        };
        // Where the data cannot tell, the test decides.
        let Ok(band) = BandData::new(&thinned, &mode.joint_with) else {
            return true;
        };
        let Some(noise) = self.noise(&mode.joint_with, &band.used) else {
            return true;
        };
        let poles = self.poles(&mode.joint_with);
        let own = self.poles(&[index])[0];
        let terms = mode.background_terms..mode.background_terms + BROAD_TERMS;
        let problem = band.problem(mode.background_terms, &noise);
        let beside = problem.beside(&band.lines.model(&poles));
        let mut wide = beside.beside(&band.lines.polynomial(terms));
        for columns in band.lines.derivatives(own) {
            wide = wide.beside(&columns);
        }
        let freedom = band.freedom(&problem.fixed, poles.len() + 1);
        let (Ok(freedom), Ok(left)) = (freedom, band.freedom(&wide.fixed, 0)) else {
            return true;
        };
        let without = beside.columns.norm_squared();
        let asks = |with: f64| {
            let gain = gain(&band, with, freedom, without);
            gain.is_none_or(|(probability, gain)| probability < LEVEL && gain > 0.0)
        };
        // The wide fit explains noise as well, which a pole would leave: what it leaves is scaled by the freedom.
        if asks(wide.columns.norm_squared() * freedom / left) {
            return true;
        }
        let steps = -2 * SCANNED..=2 * SCANNED;
        let mut places =
            steps.flat_map(|step| NARROWER.map(|share| (0.5 * f64::from(step), share)));
        places.any(|(half_widths, share)| {
            let place = own.im + half_widths * half_width(own);
            let pole = Complex64::new(own.re * share, place);
            let squares = beside.squares_at(&[pole]);
            squares.is_some_and(|squares| asks(squares.iter().sum()))
        })
    }

    /// Returns true where the data ask for the fitted mode of start `index`, all other poles being as they are.
    ///
    /// [`test`](Self::test) lets the others move, and takes much longer.
    pub fn needs(&self, index: usize, mode: &ModeFit) -> bool {
        let members = &mode.joint_with;
        let Some(place) = members.iter().position(|&member| member == index) else {
            return false;
        };
        let gain = BandData::new(self, members).ok().and_then(|band| {
            let noise = self.noise(members, &band.used)?;
            self.gain_at(&band, members, place, mode.background_terms, &noise)
        });
        gain.is_some_and(|(probability, gain)| probability < LEVEL && gain > 0.0 && is_clear(mode))
    }

    /// Compares the fits with and without the pole at `place` of a group, all poles being as they are, as [`gain`].
    fn gain_at(
        &self,
        band: &BandData,
        members: &[usize],
        place: usize,
        terms: usize,
        noise: &[f64],
    ) -> Option<(f64, f64)> {
        let poles = self.poles(members);
        let mut fewer = poles.clone();
        fewer.remove(place);
        let problem = band.problem(terms, noise);
        let freedom = band.freedom(&problem.fixed, poles.len()).ok()?;
        let with = problem.amplitudes_at(&poles)?.square_sum;
        let without = match fewer.is_empty() {
            true => problem.columns.norm_squared(),
            false => problem.amplitudes_at(&fewer)?.square_sum,
        };
        gain(band, with, freedom, without)
    }

    /// Returns false where a mode that has just been added will not be needed, so that more sweeps are vain.
    ///
    /// Without it the others have not moved: the residual falls by more than it will between two settled fits.
    pub(super) fn may_be_needed(&self, group: &Group, start: usize) -> bool {
        let (members, fit) = (&group.members, &group.fit);
        let Some(place) = members.iter().position(|&index| index == start) else {
            return true;
        };
        let gain = (BandData::new(self, members).ok())
            .and_then(|band| self.gain_at(&band, members, place, fit.terms, &fit.noise));
        gain.is_none_or(|(probability, _)| probability < HOPELESS)
    }
}

/// Compares two fits of a group's band. They leave the sums of squares S0, `without` a pole, and S1, `with` it. `freedom`
/// are the degrees of freedom of the fit with the pole. Returns the probability of a larger fall by noise alone at one
/// given place, and the fall of Schwarz's criterion.
///
/// The pole has k unknowns (two of its own, two amplitudes a column), and there are n real values. Then
/// F = (S0 - S1)/k/(S1/freedom), and the criterion is n ln S + k ln n.
fn gain(band: &BandData, with: f64, freedom: f64, without: f64) -> Option<(f64, f64)> {
    let columns = band.used.len() as f64;
    let unknowns = 2.0 + 2.0 * columns;
    let values = 2.0 * band.lines.count() as f64 * columns;
    let chance = FisherSnedecor::new(unknowns, freedom).ok()?;
    let fall = (without - with) / unknowns / (with / freedom);
    let probability = if fall > 0.0 { chance.sf(fall) } else { 1.0 };
    let criterion = values * (without / with).ln() - unknowns * values.ln();
    Some((probability, criterion))
}

/// Returns true where the amplitudes of a mode stand out of the noise, and it is certain to decay.
fn is_clear(mode: &ModeFit) -> bool {
    let amplitudes = mode.amplitudes.iter();
    let ratios: Vec<f64> = amplitudes.map(|a| a.value.norm() / a.std).collect();
    root_mean_square(&ratios) > LEAST_AMPLITUDE
        && mode.damping_ratio.value > 2.0 * mode.damping_ratio.std
}
