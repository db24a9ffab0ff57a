//! What a point means: stiffnesses in both units, the coupling, the beam.

use super::model::{PARAMETERS, Parameter, Point, log_nondimensional};
use tapjoint_beam::JointStiffness;

/// A number that an estimate reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Kx (1).
    Kx,
    /// Ky (1).
    Ky,
    /// Kz (1).
    Kz,
    /// sqrt(Kx Ky)/Kz (1).
    Coupling,
    /// Kt (N/m).
    Kt,
    /// Kr (N m/rad).
    Kr,
    /// Ktr (N/rad).
    Ktr,
    /// Modulus (Pa).
    Modulus,
    /// Density (kg/m3).
    Density,
    /// Length (m).
    Length,
    /// Width (m).
    Width,
    /// Thickness (m).
    Thickness,
}

impl Quantity {
    /// Name as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kx => "kx",
            Self::Ky => "ky",
            Self::Kz => "kz",
            Self::Coupling => "coupling",
            Self::Kt => "kt",
            Self::Kr => "kr",
            Self::Ktr => "ktr",
            Self::Modulus => "modulus",
            Self::Density => "density",
            Self::Length => "length",
            Self::Width => "width",
            Self::Thickness => "thickness",
        }
    }

    /// What follows from one estimated parameter.
    pub(super) fn of(parameter: Parameter) -> &'static [Self] {
        match parameter {
            Parameter::Kt => &[Self::Kx, Self::Kt],
            Parameter::Kr => &[Self::Ky, Self::Kr],
            Parameter::Coupling => &[Self::Coupling, Self::Kz, Self::Ktr],
            Parameter::Modulus => &[Self::Modulus],
            Parameter::Density => &[Self::Density],
            Parameter::Length => &[Self::Length],
            Parameter::Width => &[Self::Width],
            Parameter::Thickness => &[Self::Thickness],
        }
    }

    /// The coordinate of a point that it is first of all about.
    pub(super) fn lead(self) -> Parameter {
        match self {
            Self::Kx | Self::Kt => Parameter::Kt,
            Self::Ky | Self::Kr => Parameter::Kr,
            Self::Coupling | Self::Kz | Self::Ktr => Parameter::Coupling,
            Self::Modulus => Parameter::Modulus,
            Self::Density => Parameter::Density,
            Self::Length => Parameter::Length,
            Self::Width => Parameter::Width,
            Self::Thickness => Parameter::Thickness,
        }
    }

    /// Gradient of its logarithm (of the coupling: of its atanh), which is constant; of Kz and Ktr
    /// without the part of the coupling.
    pub(super) fn gradient(self) -> Point {
        let mut gradient = [0.0; PARAMETERS];
        let mut set = |parameter: Parameter, value: f64| gradient[parameter.index()] = value;
        match self {
            // Kx = 12 Kt L^3/(E b h^3) and Ky = 12 Kr L/(E b h^3); Kz of half of either.
            Self::Kx | Self::Ky | Self::Kz => {
                set(Parameter::Modulus, -1.0);
                set(Parameter::Width, -1.0);
                set(Parameter::Thickness, -3.0);
                let (kt, kr) = match self {
                    Self::Kx => (1.0, 0.0),
                    Self::Ky => (0.0, 1.0),
                    _ => (0.5, 0.5),
                };
                set(Parameter::Kt, kt);
                set(Parameter::Kr, kr);
                set(Parameter::Length, 3.0 * kt + kr);
            }
            Self::Ktr => {
                set(Parameter::Kt, 0.5);
                set(Parameter::Kr, 0.5);
            }
            other => set(other.lead(), 1.0),
        }
        gradient
    }

    /// Its value at a point; `None` where it is infinite.
    pub(super) fn value(self, point: &Point) -> Option<f64> {
        let at = |parameter: Parameter| point[parameter.index()];
        let [log_kx, log_ky] = log_nondimensional(point);
        let coupling = at(Parameter::Coupling).tanh();
        let value = match self {
            Self::Kx => log_kx.exp(),
            Self::Ky => log_ky.exp(),
            Self::Kz => (0.5 * (log_kx + log_ky)).exp() / coupling,
            Self::Ktr => (0.5 * (at(Parameter::Kt) + at(Parameter::Kr))).exp() / coupling,
            Self::Coupling => coupling,
            other => at(other.lead()).exp(),
        };
        value.is_finite().then_some(value)
    }
}

/// The non-dimensional joint at a point.
pub(super) fn joint_at(point: &Point) -> JointStiffness {
    let [kx, ky] = log_nondimensional(point).map(f64::exp);
    let coupling = point[Parameter::Coupling.index()].tanh();
    let cross = coupling / (kx.sqrt() * ky.sqrt());
    JointStiffness {
        kx,
        ky,
        cross_compliance: if cross.is_finite() { cross } else { 0.0 },
    }
}
