//! The estimator: what is free, what is known, and the fit as plain data.

use super::covariance::Covariance;
use super::estimate::limit_of;
use super::layout::JointedStructure;
use super::least_squares::{Minimum, StopReason};
use super::model::{FrequencyModel, PARAMETERS, Parameter, Point};
use super::problem::{Datum, Prior, Problem, along};
use super::quantities::Quantity;
use super::result::Limit;
use super::settings::{ConsistentSettings, ResidualWeights};
use crate::{IdentifyError, MeasuredMode, Stiffnesses};
use tapjoint_beam::interface::LAST_STEP;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, Beam, JointStiffness};

/// A joint to be estimated from the frequencies of these modes, as often as wanted.
#[derive(Debug, Clone)]
pub struct ConsistentEstimator {
    pub(super) model: FrequencyModel,
    pub(super) settings: ConsistentSettings,
    pub(super) modes: Vec<MeasuredMode>,
    pub(super) base: Point,
    /// Parameters estimated along with the joint, with their prior.
    pub(super) nuisances: Vec<(Parameter, f64)>,
}

/// A fit without its intervals: what the repetitions of a Monte Carlo need.
#[derive(Debug, Clone, PartialEq)]
pub struct PointFit {
    /// Where the misfit is least.
    pub point: Point,
    /// Sum of the loss over all residuals there.
    pub misfit: f64,
    /// Standard deviations of the estimated coordinates (1, logarithms and atanh), in the order of
    /// the fit; `None` where nothing is known.
    pub stds: Vec<Option<f64>>,
    /// Predicted frequencies (Hz).
    pub frequencies: Vec<f64>,
    /// Why it stopped.
    pub stop: StopReason,
}

/// Where repetitions of an estimate start: the valleys of a first one, and the body as it belongs to
/// the deepest of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbourhood {
    pub(super) model: Option<FrequencyModel>,
    pub(super) starts: Vec<Point>,
}

impl Neighbourhood {
    /// These places, with the body of the beam as described.
    pub fn at(starts: &[Point]) -> Self {
        Self {
            model: None,
            starts: starts.to_vec(),
        }
    }
}

impl PointFit {
    /// Non-dimensional joint; a direction that is held rigid is infinite.
    pub fn joint(&self) -> JointStiffness {
        super::quantities::joint_at(&self.point)
    }
}

impl ConsistentEstimator {
    /// For these modes of a structure.
    ///
    /// # Errors
    /// [`IdentifyError::Frequency`], [`IdentifyError::TooFewFrequencies`],
    /// [`IdentifyError::NoUncertainty`] where measured weights are asked for and a mode has none,
    /// [`IdentifyError::NothingToEstimate`] and [`IdentifyError::Structure`].
    pub fn new(
        structure: &JointedStructure,
        modes: &[MeasuredMode],
        settings: &ConsistentSettings,
    ) -> Result<Self, IdentifyError> {
        check(structure, modes, settings)?;
        // One mode above the highest is asked about in the report on identifiability.
        let highest = modes.iter().map(|mode| mode.mode).max().unwrap_or(0) + 1;
        let model = FrequencyModel::new(structure, highest)?;
        let mut base = model.nominal();
        if structure.assembly != Assembly::Free {
            let held = settings.held;
            base[Parameter::Kt.index()] = held.kt.map_or(f64::INFINITY, f64::ln);
            base[Parameter::Kr.index()] = held.kr.map_or(f64::INFINITY, f64::ln);
            base[Parameter::Coupling.index()] = held.coupling.unwrap_or(0.0).atanh();
        }
        let units = StiffnessUnits::of(&structure.beam);
        for (parameter, unit) in [(Parameter::Kt, units.kt), (Parameter::Kr, units.kr)] {
            if settings.fit.contains(&parameter) {
                base[parameter.index()] = unit.ln();
            }
        }
        Ok(Self {
            nuisances: nuisances(settings),
            model,
            settings: settings.clone(),
            modes: modes.to_vec(),
            base,
        })
    }

    /// Whether a stiffness of the joint is estimated.
    pub fn estimates_a_spring(&self) -> bool {
        let springs = [Parameter::Kt, Parameter::Kr];
        springs
            .iter()
            .any(|spring| self.settings.fit.contains(spring))
    }

    /// The measured frequencies (Hz).
    pub fn frequencies(&self) -> Vec<f64> {
        self.modes.iter().map(|mode| mode.frequency).collect()
    }

    /// What is free: first what is estimated, then the beam's uncertain properties.
    pub(super) fn directions(&self) -> Vec<Point> {
        let nuisances = self.nuisances.iter().map(|(parameter, _)| *parameter);
        let free = self.settings.fit.iter().copied().chain(nuisances);
        free.map(along).collect()
    }

    pub(super) fn problem<'a>(
        &'a self,
        model: &'a FrequencyModel,
        frequencies: &[f64],
    ) -> Problem<'a> {
        let datum = |(mode, &frequency): (&MeasuredMode, &f64)| Datum {
            mode: mode.mode,
            frequency,
            std: match self.settings.weights {
                ResidualWeights::Measured => mode.std.unwrap_or(frequency),
                ResidualWeights::Relative => frequency,
            },
        };
        Problem {
            model,
            data: self.modes.iter().zip(frequencies).map(datum).collect(),
            priors: self.priors(),
            loss: self.settings.loss,
            last_step: LAST_STEP,
        }
    }

    fn priors(&self) -> Vec<Prior> {
        let nominal = self.model.nominal();
        let mut priors: Vec<Prior> = self
            .nuisances
            .iter()
            .map(|&(parameter, std)| Prior {
                gradient: along(parameter),
                value: nominal[parameter.index()],
                std,
            })
            .collect();
        if let Some((mass, std)) = self.settings.weighed_mass {
            let mut gradient = [0.0; PARAMETERS];
            for part in [
                Parameter::Density,
                Parameter::Length,
                Parameter::Width,
                Parameter::Thickness,
            ] {
                gradient[part.index()] = 1.0;
            }
            // Every piece's mass rises by the same factor as rho L b h of the described beam, of which
            // unequal halves together are another multiple.
            let pieces = self.model.structure().pieces().unwrap_or_default();
            let described: f64 = pieces.iter().map(Beam::mass).sum();
            let terms = gradient.iter().zip(&nominal);
            let product: f64 = terms
                .map(|(g, x)| if *g == 0.0 { 0.0 } else { g * x })
                .sum();
            priors.push(Prior {
                gradient,
                value: product + (mass / described).ln(),
                std: std / mass,
            });
        }
        priors
    }

    /// The least misfit over all joints, from the pair regression's estimate and from wherever the
    /// frequency equation nearly holds.
    pub fn fit(&self) -> PointFit {
        self.fit_frequencies(&self.frequencies())
    }

    /// The same for other frequencies (Hz) of the same modes.
    pub fn fit_frequencies(&self, frequencies: &[f64]) -> PointFit {
        let (model, minima) = self.solve(frequencies);
        let model = model.as_ref().unwrap_or(&self.model);
        self.summary(&self.problem(model, frequencies), minima)
    }

    /// The places from which repetitions of the estimate start: all valleys of this one.
    pub fn neighbourhood(&self) -> Neighbourhood {
        let (model, minima) = self.solve(&self.frequencies());
        Neighbourhood {
            model,
            starts: minima.iter().map(|minimum| minimum.at.point).collect(),
        }
    }

    /// The least misfit downhill of known places, for other frequencies (Hz) of the same modes.
    /// The body is that of the neighbourhood, renewed where the beam moves far from it.
    pub fn refit(&self, frequencies: &[f64], near: &Neighbourhood) -> PointFit {
        let model = near.model.as_ref().unwrap_or(&self.model);
        let minima = self.refit_in(model, frequencies, &near.starts);
        let (renewed, minima) = self.renew(model, frequencies, minima);
        let model = renewed.as_ref().unwrap_or(model);
        self.summary(&self.problem(model, frequencies), minima)
    }

    pub(super) fn refit_in(
        &self,
        model: &FrequencyModel,
        frequencies: &[f64],
        starts: &[Point],
    ) -> Vec<Minimum> {
        let mut problem = self.problem(model, frequencies);
        self.rescale(&mut problem, starts);
        self.valleys(&problem, starts)
    }

    /// The non-dimensional stiffnesses as a function of the frequencies (Hz), for
    /// [`crate::perturbation`]; `None` where the search does not come to an end.
    pub fn stiffnesses_near<'a>(
        &'a self,
        near: &'a Neighbourhood,
    ) -> impl Fn(&[f64]) -> Option<Stiffnesses> + 'a {
        move |frequencies: &[f64]| {
            let positive = |frequency: &f64| *frequency > 0.0 && frequency.is_finite();
            if !frequencies.iter().all(positive) {
                return None;
            }
            let fit = self.refit(frequencies, near);
            let ended = fit.stop.converged() && fit.stop != StopReason::NothingFree;
            ended.then(|| self.stiffnesses_at(&fit.point))
        }
    }

    /// Kx and Ky at a point, infinite where rigid, and Kz where the coupling is estimated.
    pub(super) fn stiffnesses_at(&self, point: &Point) -> Stiffnesses {
        let joint = super::quantities::joint_at(point);
        let finite = |quantity: Quantity, value: f64| match limit_of(quantity, point) {
            Some(Limit::Rigid) => f64::INFINITY,
            _ => value,
        };
        let coupled = self.settings.fit.contains(&Parameter::Coupling);
        Stiffnesses {
            kx: finite(Quantity::Kx, joint.kx),
            ky: finite(Quantity::Ky, joint.ky),
            kz: coupled.then(|| joint.cross_compliance.recip()),
        }
    }

    fn summary(&self, problem: &Problem<'_>, minima: Vec<Minimum>) -> PointFit {
        let Some(best) = minima.into_iter().next() else {
            return self.nothing(problem);
        };
        let directions = self.directions();
        let covariance = Covariance::of(&best.at, &directions);
        PointFit {
            point: best.at.point,
            misfit: best.at.cost,
            stds: directions
                .iter()
                .take(self.settings.fit.len())
                .map(|direction| covariance.std(direction))
                .collect(),
            frequencies: best.at.frequencies,
            stop: best.stop,
        }
    }

    /// Without a single start there is the nominal point.
    fn nothing(&self, problem: &Problem<'_>) -> PointFit {
        let at = problem.evaluate(&self.base, &problem.measured_lambdas(&self.base));
        PointFit {
            point: at.point,
            misfit: at.cost,
            stds: Vec::new(),
            frequencies: at.frequencies,
            stop: StopReason::NothingFree,
        }
    }
}

/// The beam's uncertain properties: only where the frequencies' uncertainties are known can the two
/// be weighed against each other.
fn nuisances(settings: &ConsistentSettings) -> Vec<(Parameter, f64)> {
    if settings.weights == ResidualWeights::Relative {
        return Vec::new();
    }
    Parameter::ALL
        .into_iter()
        .filter(|parameter| !settings.fit.contains(parameter))
        .filter_map(|parameter| Some((parameter, settings.tolerances.of(parameter)?)))
        .filter(|(_, std)| *std > 0.0)
        .collect()
}

fn check(
    structure: &JointedStructure,
    modes: &[MeasuredMode],
    settings: &ConsistentSettings,
) -> Result<(), IdentifyError> {
    let positive = |value: f64| value > 0.0 && value.is_finite();
    if let Some(mode) = modes
        .iter()
        .find(|mode| !positive(mode.frequency) || mode.mode == 0)
    {
        return Err(IdentifyError::Frequency {
            mode: mode.mode,
            value: mode.frequency,
        });
    }
    let joint = [Parameter::Kt, Parameter::Kr, Parameter::Coupling];
    let no_joint = structure.assembly == Assembly::Free;
    let stray = |parameter: &&Parameter| no_joint && joint.contains(parameter);
    if settings.fit.is_empty() || settings.fit.iter().any(|p| stray(&p)) {
        return Err(IdentifyError::NothingToEstimate);
    }
    let known = modes.len() + usize::from(settings.weighed_mass.is_some());
    if known < settings.fit.len() {
        return Err(IdentifyError::TooFewFrequencies {
            unknowns: settings.fit.len(),
            found: modes.len(),
        });
    }
    let measured = settings.weights == ResidualWeights::Measured;
    let unknown = |mode: &&MeasuredMode| !mode.std.is_some_and(positive);
    if let Some(mode) = modes.iter().find(unknown).filter(|_| measured) {
        return Err(IdentifyError::NoUncertainty { mode: mode.mode });
    }
    Ok(())
}
