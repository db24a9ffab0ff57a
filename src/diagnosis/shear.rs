//! What frequencies owe to shear and rotary inertia, which no beam's description knows exactly.

use super::advisor::MORE_MODES;
use super::forward::Forward;
use super::frame::Frame;
use super::hypothesis::Fit;
use super::solved::Solved;

/// Relative step of the difference.
const STEP: f64 = 1e-3;

impl Frame {
    /// Sets the slopes at an optimum of the nominal model, by Rayleigh's quotient of a beam that has a little less
    /// shear and rotary inertia; none of Euler's beam.
    ///
    /// `None` where the model has no solution.
    pub(super) fn set_shear_slopes(&mut self, nominal: &Fit) -> Option<()> {
        let whole = self.nominal.specimen.shear_rotary;
        if whole > 0.0 {
            let mut planned = self.clone();
            planned.modes += MORE_MODES;
            let forward = Forward::new(&planned, &[]);
            let solved = forward.solve(&nominal.branch.optimum.parameters)?;
            self.shear_slopes = slopes(solved.first()?, planned.modes, whole)?;
        }
        Some(())
    }
}

fn slopes(one: &Solved, modes: usize, whole: f64) -> Option<Vec<f64>> {
    let mut less = one.seen.specimen.clone();
    less.shear_rotary -= STEP * whole;
    let moved = one.modes().rayleigh_frequencies(&less).ok()?;
    let slope = |mode: usize| {
        let index = one.index(mode)?;
        Some((one.modes().frequencies()[index] / moved[index]).ln() / STEP)
    };
    Some((1..=modes).map_while(slope).collect())
}

#[cfg(test)]
mod tests {
    use super::super::example::{plan, strip};
    use super::super::hypothesis::fit_nominal;
    use super::super::knowledge::knowledge;
    use super::super::least_squares::Model;
    use super::super::settings::GapSettings;
    use super::super::small_unknowns::Small;
    use super::super::synthetic::{TestPlan, observe};
    use super::*;

    /// A strip thick enough for shear to matter, in two recordings with damping ratios, and its fit.
    fn thick(shear_rotary: f64) -> (Frame, Fit) {
        let mut nominal = strip(0.004);
        nominal.specimen.shear_rotary = shear_rotary;
        nominal.specimen.body.beams_mut()[0].thickness = 0.015;
        let plan = TestPlan {
            damping_std: Some(0.03),
            ..plan(&[0.34, 0.19])
        };
        let observations = observe(&plan, &nominal, &[], 3).unwrap();
        let mut frame = Frame::new(&observations, &nominal, &GapSettings::default());
        let fit = fit_nominal(&frame, &GapSettings::default()).unwrap();
        frame.set_shear_slopes(&fit).unwrap();
        (frame, fit)
    }

    #[test]
    fn limit_slopes_are_those_of_beams_solved_anew() {
        let (frame, fit) = thick(1.0);
        let at = &fit.branch.optimum.parameters;
        let solved_with = |shear_rotary: f64| {
            let mut other = frame.clone();
            for setup in &mut other.setups {
                setup.specimen.shear_rotary = shear_rotary;
            }
            Forward::new(&other, &[]).solve(at).unwrap()
        };
        let (more, less) = (solved_with(1.01), solved_with(0.99));
        for mode in 1..=frame.modes {
            let ratio = more[0].frequency(mode).unwrap() / less[0].frequency(mode).unwrap();
            let exact = ratio.ln() / 0.02;
            let found = frame.shear_slope(mode);
            // More of it is softer and heavier; the one-sided step bends by a thousandth or so.
            assert!(
                found < 0.0 && (found / exact - 1.0).abs() < 0.01,
                "{mode}: {found} {exact}"
            );
        }
        assert_eq!(frame.shear_slopes.len(), frame.modes + MORE_MODES);
    }

    #[test]
    fn limit_an_euler_beam_has_none() {
        let (frame, _) = thick(0.0);
        assert!(frame.small_index(Small::Shear).is_none());
        assert_eq!(frame.shear_slope(3), 0.0);
    }

    /// The power of the frequency that damping ratios follow enters the solution, so that its slope is a formula of
    /// its own.
    #[test]
    fn limit_the_damping_tilts_slope_is_that_of_predictions() {
        let (frame, fit) = thick(1.0);
        let forward = Forward::new(&frame, &[]);
        let known = knowledge(&frame, &forward.layout, &GapSettings::default());
        let at = fit.branch.optimum.parameters.clone();
        let column = forward.layout.smalls() + frame.small_index(Small::DampingTilt).unwrap();
        let slopes = forward.linearise(&at, &known).unwrap().slopes;
        let predicted = |step: f64| {
            let mut moved = at.clone();
            moved[column] += step;
            forward.predict(&moved).unwrap().0
        };
        let (above, below) = (predicted(1e-4), predicted(-1e-4));
        let mut steepest = 0.0_f64;
        for (row, (above, below)) in above.iter().zip(&below).enumerate() {
            let exact = (above - below) / 2e-4;
            steepest = steepest.max(exact.abs());
            // Central differences over 1e-4: their error is of 1e-8, rounding 1e-11.
            assert!((slopes[(row, column)] - exact).abs() < 1e-6, "row {row}");
        }
        // The lowest mode's frequency is a good part of a decade below the mean.
        assert!(steepest > 1.0, "{steepest}");
    }
}
