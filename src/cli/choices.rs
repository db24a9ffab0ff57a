//! Choices that the command line names, and what they stand for in the library.

use clap::ValueEnum;
use tapjoint::description::{JointKind, ReadBy, SensorKind, WindowKind};
use tapjoint::pipeline::{EstimateMethod, IdentifySettings};
use tapjoint::recording::ResponseForm;
use tapjoint::spectral::FrfEstimator;

/// Kinds of structure, as the command line names them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum KindArgument {
    /// A beam held at one end
    Cantilever,
    /// Two beams joined end to end, free otherwise
    Lap,
    /// A free beam
    Free,
}

impl From<KindArgument> for JointKind {
    fn from(kind: KindArgument) -> Self {
        match kind {
            KindArgument::Cantilever => Self::Cantilever,
            KindArgument::Lap => Self::Lap,
            KindArgument::Free => Self::Free,
        }
    }
}

/// Windows, as the command line names them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum WindowArgument {
    /// None
    Rectangular,
    /// For steady signals, not for taps
    Hann,
    /// Decaying, for taps that ring longer than the block
    Exponential,
}

impl From<WindowArgument> for WindowKind {
    fn from(window: WindowArgument) -> Self {
        match window {
            WindowArgument::Rectangular => Self::Rectangular,
            WindowArgument::Hann => Self::Hann,
            WindowArgument::Exponential => Self::Exponential,
        }
    }
}

/// Estimators of frequency response functions, as the command line names them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum EstimatorArgument {
    /// Gfx/Gff: right where only the response is noisy
    #[default]
    H1,
    /// Gxx/Gxf: right where only the force is noisy
    H2,
    /// Total least squares: between the two
    Hv,
}

impl From<EstimatorArgument> for FrfEstimator {
    fn from(estimator: EstimatorArgument) -> Self {
        match estimator {
            EstimatorArgument::H1 => Self::H1,
            EstimatorArgument::H2 => Self::H2,
            EstimatorArgument::Hv => Self::Hv,
        }
    }
}

/// Forms of frequency response functions, as the command line names them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum FormArgument {
    /// Acceleration per force, (m/s2)/N
    Accelerance,
    /// Velocity per force, (m/s)/N
    Mobility,
    /// Displacement per force, m/N
    Receptance,
}

impl From<FormArgument> for ResponseForm {
    fn from(form: FormArgument) -> Self {
        match form {
            FormArgument::Accelerance => Self::Accelerance,
            FormArgument::Mobility => Self::Mobility,
            FormArgument::Receptance => Self::Receptance,
        }
    }
}

/// Kinds of sensor, as the command line names them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum SensorArgument {
    /// Accelerometer, m/s2
    Acceleration,
    /// Velocity, m/s
    Velocity,
    /// Displacement, m
    Displacement,
    /// Microphone, Pa
    Sound,
}

impl From<SensorArgument> for SensorKind {
    fn from(kind: SensorArgument) -> Self {
        match kind {
            SensorArgument::Acceleration => Self::Acceleration,
            SensorArgument::Velocity => Self::Velocity,
            SensorArgument::Displacement => Self::Displacement,
            SensorArgument::Sound => Self::Sound,
        }
    }
}

/// How frequencies are read, as the command line names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum ReadingArgument {
    /// By a fit of the decays, with a standard deviation
    #[default]
    Fit,
    /// Between the lines about each peak
    Interpolated,
    /// On the spectral line, with the half-line bound
    Line,
}

impl From<ReadingArgument> for ReadBy {
    fn from(reading: ReadingArgument) -> Self {
        match reading {
            ReadingArgument::Fit => Self::Fit,
            ReadingArgument::Interpolated => Self::Interpolated,
            ReadingArgument::Line => Self::Line,
        }
    }
}

/// How the joint is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum MethodArgument {
    /// Least squares on the frequencies themselves, the pair regression beside it
    #[default]
    Consistent,
    /// The multi-linear regression over pairs of modes alone (Euler beam, sensor masses neglected)
    Pairs,
}

/// Which estimates are perturbed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum MethodsArgument {
    /// Both methods, side by side
    #[default]
    Both,
    /// Least squares on the frequencies themselves
    Consistent,
    /// The multi-linear regression over pairs of modes alone (Euler beam, sensor masses neglected)
    Pairs,
}

impl MethodsArgument {
    /// The main estimate, and the methods to perturb.
    pub(super) fn settings(self) -> IdentifySettings {
        let (consistent, pairs) = (EstimateMethod::Consistent, EstimateMethod::Pairs);
        let (method, perturbed) = match self {
            Self::Both => (consistent, vec![pairs, consistent]),
            Self::Consistent => (consistent, vec![consistent]),
            Self::Pairs => (pairs, vec![pairs]),
        };
        IdentifySettings {
            method,
            perturbed,
            ..IdentifySettings::default()
        }
    }
}

impl MethodArgument {
    /// In the analysis's terms.
    pub(super) fn method(self) -> EstimateMethod {
        match self {
            MethodArgument::Consistent => EstimateMethod::Consistent,
            MethodArgument::Pairs => EstimateMethod::Pairs,
        }
    }
}
