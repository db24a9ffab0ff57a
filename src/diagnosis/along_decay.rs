//! Damping, and what a joint whose stiffness depends on the amplitude does to frequencies.

use super::forward::Forward;
use super::frame::Frame;
use super::hypothesis::Fit;
use super::joint_energy::joint_shares;
use super::joint_path::{Changes, JointPath};
use super::setup::Setup;
use super::small_unknowns::Small;
use super::solved::Solved;
use tapjoint_beam::effects::{EffectId, JointLaw};
use tapjoint_identify::observation::{Observations, effective_share};

/// Least stiffness that is left of a joint that softens (1).
const LEAST_STIFFNESS: f64 = 0.05;

impl Frame {
    /// Sets how the joint moves in each configuration, over the largest rotation of all. Only where the
    /// amplitudes of all of them are known.
    pub(super) fn set_paths(&mut self, observations: &Observations, nominal: &Fit) {
        let forward = Forward::new(self, &[]);
        let Some(solved) = forward.solve(&nominal.branch.optimum.parameters) else {
            return;
        };
        self.find_paths(observations, &solved);
        self.widen_changes(&solved);
    }

    fn find_paths(&mut self, observations: &Observations, solved: &[Solved]) {
        let paths: Option<Vec<JointPath>> = observations
            .configurations
            .iter()
            .zip(&self.setups)
            .zip(solved)
            .map(|((observed, setup), one)| JointPath::new(observed, setup, one))
            .collect();
        let Some(paths) = paths else { return };
        let most = paths.iter().map(JointPath::peak).fold(0.0, f64::max);
        if most > 0.0 {
            for (setup, path) in self.setups.iter_mut().zip(paths) {
                setup.path = Some(path.over(most));
            }
        }
    }
}

impl Forward<'_> {
    /// Damping ratio: the nominal one, a level times a power of the frequency, and eta/2 times the joint's share
    /// of the strain energy; and the nominal one alone.
    pub(super) fn damping(
        &self,
        mode: usize,
        all: &[Solved],
        parameters: &[f64],
    ) -> Option<(f64, f64)> {
        let level = self.frame.small_index(Small::Damping)?;
        let tilt = self.frame.small_index(Small::DampingTilt)?;
        let small = |index: usize| parameters[self.layout.smalls() + index];
        let nominal = (small(level) + small(tilt) * self.frame.tilt(mode)).exp();
        let solved = all.first()?;
        let shares = joint_shares(solved, solved.index(mode)?);
        let slip = self.slip_loss(mode, all, parameters) * shares[1];
        let lost = solved.seen.joint_loss_factor * (shares[0] + shares[1]) + slip;
        Some((nominal + 0.5 * lost.max(0.0), nominal))
    }

    /// Loss factor of a joint that slips, as one mode feels it on average over the configurations: in the
    /// share of the strain energy of the spring that has softened, 1 + change.
    fn slip_loss(&self, mode: usize, all: &[Solved], parameters: &[f64]) -> f64 {
        let share = self
            .law(parameters)
            .map_or(0.0, |law| law.loss_over_change());
        let changes = all.iter().filter_map(|one| one.changes.as_ref()?.of(mode));
        let (sum, count) = changes.fold((0.0, 0), |(sum, n), one| (sum + one, n + 1));
        let change = sum / f64::from(count.max(1));
        -share * change / (1.0 + change).max(LEAST_STIFFNESS)
    }

    /// Change of the logarithm of a frequency per e-fold of its amplitude, along the followed decay.
    pub(super) fn slope_along_decay(
        &self,
        (configuration, mode): (usize, usize),
        solved: &Solved,
        parameters: &[f64],
    ) -> f64 {
        let setup = &self.frame.setups[configuration];
        self.law(parameters)
            .map_or(0.0, |law| lawful_change(setup, mode, solved, &law))
    }

    /// The joint's law at the amplitudes that the parameters give it, where that is a hypothesis.
    pub(super) fn law(&self, parameters: &[f64]) -> Option<JointLaw> {
        let (ratio, exponent) = self.softening(parameters)?;
        // The amplitude is known but for a factor, which all recordings share.
        let ratio = ratio * self.amplitude_factor(parameters).powf(exponent);
        Some(JointLaw { ratio, exponent })
    }

    /// What the modes of a configuration feel of the joint's law.
    pub(super) fn changes(&self, configuration: usize, parameters: &[f64]) -> Option<Changes> {
        let path = self.frame.setups[configuration].path.as_ref()?;
        Some(path.changes(&self.law(parameters)?))
    }

    /// Relative amplitude at which the structure of a configuration is solved: the joint then has the mean
    /// stiffness that its modes feel.
    pub(super) fn level(
        &self,
        setup: &Setup,
        changes: Option<&Changes>,
        parameters: &[f64],
    ) -> f64 {
        let Some((ratio, exponent)) = self.softening(parameters) else {
            return 1.0;
        };
        match changes {
            // ratio level^p = mean change, of the same sign.
            Some(changes) if ratio != 0.0 => (changes.mean / ratio).powf(exponent.recip()),
            Some(_) => 0.0,
            None => {
                let factor = self.amplitude_factor(parameters);
                factor * setup.level * effective_share(exponent)
            }
        }
    }

    /// What a mode's frequency differs by from that of the structure as it was solved (logarithm): it
    /// feels another stiffness than the mean of all modes.
    pub(super) fn own_change(mode: usize, solved: &Solved) -> f64 {
        let changes = solved.changes.as_ref();
        let of = changes.and_then(|changes| Some((changes.of(mode)?, changes.mean)));
        let (Some((own, mean)), Some(index)) = (of, solved.index(mode)) else {
            return 0.0;
        };
        0.5 * joint_shares(solved, index)[1] * (stiffness(own) - stiffness(mean))
    }

    fn amplitude_factor(&self, parameters: &[f64]) -> f64 {
        self.frame
            .small_index(Small::Amplitude)
            .map_or(1.0, |index| parameters[self.layout.smalls() + index].exp())
    }

    /// Relative stiffness change at the hardest tap and its exponent, where that is a hypothesis.
    pub(super) fn softening(&self, parameters: &[f64]) -> Option<(f64, f64)> {
        let index = self
            .layout
            .effects
            .iter()
            .position(|one| one.effect == EffectId::JointNonlinearity)?;
        Some((
            parameters[self.layout.size(index)],
            parameters[self.layout.place(index)?],
        ))
    }
}

/// d ln f/d ln a = S_i d ln kr/d ln a, with the mode's sensitivity S_i = d ln f_i/d ln kr, averaged over the
/// followed part of the decay.
pub(super) fn lawful_change(setup: &Setup, mode: usize, solved: &Solved, law: &JointLaw) -> f64 {
    solved.index(mode).map_or(0.0, |index| {
        0.5 * joint_shares(solved, index)[1] * stiffness_change(setup, mode, law)
    })
}

/// d ln kr/d ln a that a mode feels, averaged over the followed part of its decay.
pub(super) fn stiffness_change(setup: &Setup, mode: usize, law: &JointLaw) -> f64 {
    let span = setup.spans.iter().find(|span| span.0 == mode);
    if let (Some(&(_, early, late)), Some(path)) = (span, &setup.path)
        && let Some((first, last)) = path.between(mode, (early, late), law)
    {
        return (stiffness(first) - stiffness(last)) / (early / late).ln();
    }
    // Without amplitudes: the derivative at the effective one, 1 % to either side.
    let a = setup.level * effective_share(law.exponent);
    let at = |a: f64| stiffness(law.secant(a) - 1.0);
    (at(a * 1.01) - at(a / 1.01)) / (2.0 * 1.01_f64.ln())
}

/// Logarithm of a stiffness that has changed by this much.
fn stiffness(change: f64) -> f64 {
    (1.0 + change).max(LEAST_STIFFNESS).ln()
}
