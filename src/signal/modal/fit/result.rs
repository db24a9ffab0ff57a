//! From the last sweep to modes with their uncertainty.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2};
use num_complex::Complex64;

use super::data::{Basis, ModalData};
use super::kernel::StopReason;
use super::local::GroupFit;
use super::sweep::{Group, Mode, Sweeper};
use super::uncertainty::{
    FittedValue, TapFit, fit_taps, inflation, judge, pole_covariance, reading, residual_correlation,
};
use super::{FitSettings, PoleStart, Unfit};

/// Complex amplitude of a mode in one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnAmplitude {
    /// Number of the tap.
    pub tap: usize,
    /// Number of the sensor.
    pub sensor: usize,
    /// Free decay: a in x(t) = Re(a e^{p t}), t from the decay's first sample (unit of the samples).
    /// Frequency response function: its residue R (unit of the function times rad/s).
    pub value: Complex64,
    /// Standard deviation of its real and of its imaginary part from noise, the pole held fixed.
    pub std: f64,
    /// Change with the pole's angular frequency (unit of the amplitude times s).
    pub by_omega: Complex64,
    /// Change with the pole's decay (unit of the amplitude times s).
    pub by_decay: Complex64,
}

/// A fitted mode.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeFit {
    /// Natural frequency (Hz), undamped: modulus of the pole over 2 pi, a window's decay taken out.
    pub frequency: FittedValue,
    /// Damping ratio, a window's decay taken out.
    pub damping_ratio: FittedValue,
    /// Pole (rad/s), negative decay + j angular frequency, a window's decay still in it.
    pub pole: Complex64,
    /// Covariance of the pole's angular frequency and decay from the residual ((rad/s)^2).
    pub pole_covariance: [[f64; 2]; 2],
    /// Correlation of the errors of frequency and damping ratio.
    pub correlation: f64,
    /// Each tap alone; taps that could not be fitted are missing.
    pub taps: Vec<TapFit>,
    /// Correlation of the residual between neighbouring lines: near 0 for a good fit, near 1 where the
    /// model misses something.
    pub residual_correlation: f64,
    /// Factor that correlation puts on the standard deviations (1: it may be chance).
    pub inflation: f64,
    /// Band of the fit (Hz).
    pub band: (f64, f64),
    /// Lines in it.
    pub lines: usize,
    /// Complex terms of the background polynomial that the data asked for.
    pub background_terms: usize,
    /// Indices of the starts that were fitted jointly, this one among them.
    pub joint_with: Vec<usize>,
    /// Why the search ended.
    pub stop: StopReason,
    /// Amplitude in every column of the data that holds anything.
    pub amplitudes: Vec<ColumnAmplitude>,
}

/// Fits the modes that begin at `starts`; for each start a mode, or why there is none.
///
/// Modes nearer than three of their half widths together and a few lines are fitted jointly; the others
/// are subtracted with their own amplitudes, or keep free ones where they lie in the band. What else
/// lies outside is a polynomial of the frequency where the data ask for it. Where two starts turn out to
/// be one resonance, the later one fails: put those first that are surer.
pub fn fit_modes(
    data: &ModalData,
    starts: &[PoleStart],
    settings: &FitSettings,
) -> Vec<Result<ModeFit, Unfit>> {
    let mut sweeper = Sweeper::new(data, starts, &settings.steady_lines, settings.added_decay);
    let groups = sweeper.run();
    report(&mut sweeper, &groups, settings)
}

/// For each start its mode, or why there is none.
pub(super) fn report(
    sweeper: &mut Sweeper,
    groups: &[Group],
    settings: &FitSettings,
) -> Vec<Result<ModeFit, Unfit>> {
    let mut modes: Vec<Option<ModeFit>> = vec![None; sweeper.modes.len()];
    for group in groups {
        let fits = Reporter::new(sweeper.data, settings, group).modes();
        for (&index, fit) in group.members.iter().zip(fits) {
            match fit {
                Ok(fit) => modes[index] = Some(fit),
                Err(reason) => sweeper.modes[index].failed = Some(reason),
            }
        }
    }
    let outcome = |(mode, state): (Option<ModeFit>, &Mode)| {
        let reason = state.failed.clone().unwrap_or(Unfit::NotIndependent);
        mode.ok_or(reason)
    };
    modes.into_iter().zip(&sweeper.modes).map(outcome).collect()
}

/// Turns one group's fit into modes.
struct Reporter<'a> {
    data: &'a ModalData,
    group: &'a Group,
    /// Added decay (lines).
    added: f64,
    correlation: (f64, f64),
    /// Each tap's number, poles and covariance (lines).
    taps: Vec<(usize, Vec<Complex64>, nalgebra::DMatrix<f64>)>,
}

impl<'a> Reporter<'a> {
    fn new(data: &'a ModalData, settings: &FitSettings, group: &'a Group) -> Self {
        let fit = &group.fit;
        let tap_of = |&column: &usize| data.columns()[column].tap;
        let numbers: Vec<usize> = fit.used.iter().map(tap_of).collect();
        let taps = fit_taps(fit, &numbers)
            .into_iter()
            .map(|(number, at, covariance)| (number, at.poles, covariance))
            .collect();
        Reporter {
            data,
            group,
            added: settings.added_decay / TAU / data.spacing(),
            correlation: residual_correlation(fit),
            taps,
        }
    }

    fn modes(&self) -> Vec<Result<ModeFit, Unfit>> {
        (0..self.group.members.len())
            .map(|place| self.mode(place))
            .collect()
    }

    /// Lines denser than the resolution repeat each other: variances grow by that factor.
    fn repetition(&self) -> f64 {
        self.data.resolution() / self.data.spacing()
    }

    fn mode(&self, place: usize) -> Result<ModeFit, Unfit> {
        let fit = &self.group.fit;
        let spacing = self.data.spacing();
        let read = |pole: Complex64| reading(pole, spacing, self.added);
        let factor = inflation(self.correlation);
        let in_lines = pole_covariance(fit, place).ok_or(Unfit::NotIndependent)?;
        let in_lines = in_lines * self.repetition() * factor * factor;
        let joint = read(fit.at.poles[place]);
        let covariance = joint.slopes * in_lines * joint.slopes.transpose();
        let taps = self.taps_of(place);
        let stds = Vector2::new(covariance[(0, 0)].sqrt(), covariance[(1, 1)].sqrt());
        let freedom = (fit.freedom / self.repetition()).max(1.0);
        let of = |tap: &TapFit| (tap.frequency, tap.frequency_std);
        let alone: Vec<(f64, f64)> = taps.iter().map(of).collect();
        let frequency = judge((joint.value[0], stds[0]), freedom, &alone);
        let of = |tap: &TapFit| (tap.damping_ratio, tap.damping_std);
        let alone: Vec<(f64, f64)> = taps.iter().map(of).collect();
        let damping_ratio = judge((joint.value[1], stds[1]), freedom, &alone);
        self.check_window(&damping_ratio)?;
        let to_rad = TAU * spacing;
        let pole_covariance = in_lines * to_rad * to_rad;
        let ends = |index: usize| fit.lines.positions[index] * spacing;
        Ok(ModeFit {
            frequency,
            damping_ratio,
            pole: fit.at.poles[place] * to_rad,
            pole_covariance: pole_covariance.into(),
            correlation: covariance[(0, 1)] / (stds[0] * stds[1]),
            taps,
            residual_correlation: self.correlation.0,
            inflation: factor,
            band: (ends(0), ends(fit.lines.count() - 1)),
            lines: fit.lines.count(),
            background_terms: fit.terms,
            joint_with: self.group.members.clone(),
            stop: fit.stop,
            amplitudes: self.amplitudes(place),
        })
    }

    /// Nothing but the window's decay is known where less than two standard deviations remain.
    fn check_window(&self, damping: &FittedValue) -> Result<(), Unfit> {
        let hidden = damping.value <= 0.0 || damping.value < 2.0 * damping.std;
        if self.added > 0.0 && hidden {
            return Err(Unfit::WindowDominates {
                remaining: damping.value,
                std: damping.std,
            });
        }
        Ok(())
    }

    fn taps_of(&self, place: usize) -> Vec<TapFit> {
        let joint = self.group.fit.at.poles[place];
        let near = |pole: Complex64| (pole - joint).norm() <= 1.0 + joint.re.abs();
        self.taps
            .iter()
            .filter(|(_, poles, _)| near(poles[place]))
            .map(|(number, poles, covariance)| {
                let own = reading(poles[place], self.data.spacing(), self.added);
                let in_lines: Matrix2<f64> = covariance
                    .fixed_view::<2, 2>(2 * place, 2 * place)
                    .into_owned();
                let spread = own.slopes * in_lines * self.repetition() * own.slopes.transpose();
                TapFit {
                    tap: *number,
                    frequency: own.value[0],
                    frequency_std: spread[(0, 0)].sqrt(),
                    damping_ratio: own.value[1],
                    damping_std: spread[(1, 1)].sqrt(),
                }
            })
            .collect()
    }

    /// From the amplitudes b of the fit to those of the decay, a = 2 b (2 pi df)/(1 - e^{pT}), or to
    /// residues, R = b (2 pi df), with their slopes.
    fn amplitudes(&self, place: usize) -> Vec<ColumnAmplitude> {
        let fit = &self.group.fit;
        let unit = TAU * self.data.spacing();
        let pole = fit.at.poles[place];
        // pT = 2 pi q of a decay; the factor's change with q relative to itself is
        // 2 pi e^{pT}/(1 - e^{pT}).
        let (factor, relative) = match self.data.basis() {
            Basis::FreeDecay { .. } => {
                let fallen = (TAU * pole).exp();
                let rest = 1.0 - fallen;
                (2.0 * unit / rest, TAU * fallen / rest)
            }
            Basis::FrequencyResponse { .. } => (Complex64::from(unit), Complex64::ZERO),
        };
        let spread = amplitude_variance(fit, place) * fit.variance * self.repetition();
        let at = |matrix: &nalgebra::DMatrix<f64>, index: usize| {
            Complex64::new(matrix[(2 * place, index)], matrix[(2 * place + 1, index)])
        };
        let slopes = &fit.slopes.amplitude_slopes;
        let one = |(index, (&column, &noise)): (usize, (&usize, &f64))| {
            let source = &self.data.columns()[column];
            let b = at(&fit.at.amplitudes, index);
            let by_position = at(&slopes[2 * place], index) + Complex64::i() * relative * b;
            let by_decay = at(&slopes[2 * place + 1], index) - relative * b;
            ColumnAmplitude {
                tap: source.tap,
                sensor: source.sensor,
                value: b * noise * factor,
                std: spread.sqrt() * noise * factor.norm(),
                by_omega: by_position * noise * factor / unit,
                by_decay: by_decay * noise * factor / unit,
            }
        };
        fit.used
            .iter()
            .zip(&fit.noise)
            .enumerate()
            .map(one)
            .collect()
    }
}

/// Mean variance of the two parts of an amplitude, for unit noise: (R'R)^-1.
fn amplitude_variance(fit: &GroupFit, place: usize) -> f64 {
    let row = |i: usize| fit.at.inverse.row(i).norm_squared();
    0.5 * (row(2 * place) + row(2 * place + 1))
}
