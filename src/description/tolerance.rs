//! How well the described beam is known: standard uncertainties of its properties, stated or assumed, its weight, and its
//! free frequencies.

use super::keys;
use super::property::{LENGTH, Property};
use super::reader::{DescriptionError, Entry, Limits, Table, number, with_unit};
use super::recordings::read_free_frequencies;
use tapjoint_numerics::quantity::Dimension;

/// One standard uncertainty.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StandardUncertainty {
    /// One standard deviation, in the unit of its value; 0 = exact.
    pub std: f64,
    /// False where the file is silent and a usual one is assumed.
    pub stated: bool,
}

/// Standard uncertainties of what the file says of the beam. Those that it does not state are assumed, unless the file says
/// "exact".
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BeamTolerance {
    /// Length (m).
    pub length: StandardUncertainty,
    /// Width (m).
    pub width: StandardUncertainty,
    /// Thickness (m).
    pub thickness: StandardUncertainty,
    /// Young's modulus (Pa).
    pub modulus: StandardUncertainty,
    /// Density (kg/m3).
    pub density: StandardUncertainty,
    /// Poisson's ratio (1).
    pub poisson: StandardUncertainty,
    /// Masses of sensors and of what is fastened (1, relative).
    pub masses: StandardUncertainty,
    /// Positions of sensors and of what is fastened (m).
    pub positions: StandardUncertainty,
}

/// The bare bar on a balance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeighedMass {
    /// Mass (kg); of a lap joint that of both halves.
    pub mass: f64,
    /// Standard uncertainty (kg).
    pub std: f64,
}

/// Frequencies of the same beam without its joint.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeFrequencies {
    /// Frequencies of modes 1, 2, ... of the free beam (Hz).
    pub frequencies: Vec<f64>,
    /// Their standard uncertainties (Hz).
    pub stds: Vec<f64>,
}

/// Assumed standard uncertainty of a value: the larger of a share of it and an absolute one.
struct Assumed {
    share: f64,
    least: f64,
}

impl Assumed {
    const fn new(share: f64, least: f64) -> Self {
        Self { share, least }
    }

    fn of(&self, value: f64) -> StandardUncertainty {
        StandardUncertainty {
            // A thin strip is not known worse than by a tenth.
            std: (self.share * value).max(self.least.min(0.1 * value)),
            stated: false,
        }
    }
}

// What data sheets, calipers and rules leave open.
const ASSUMED_LENGTH: Assumed = Assumed::new(1e-3, 0.5e-3);
const ASSUMED_WIDTH: Assumed = Assumed::new(2e-3, 0.05e-3);
const ASSUMED_THICKNESS: Assumed = Assumed::new(5e-3, 0.02e-3);
const ASSUMED_MODULUS: Assumed = Assumed::new(1e-2, 0.0);
const ASSUMED_DENSITY: Assumed = Assumed::new(5e-3, 0.0);
const ASSUMED_POISSON: f64 = 0.02;
const ASSUMED_MASSES: f64 = 0.02;
const ASSUMED_POSITIONS: f64 = 1e-3;
/// A balance is right to this share of the mass, or to half a gram.
const BALANCE: Assumed = Assumed::new(1e-3, 0.5e-3);

/// No property of a beam is known better than this (relative).
const INCREDIBLY_EXACT: f64 = 1e-7;

const REMEDY: &str = "give one standard deviation, absolute (\"1 mm\") or relative (\"2 %\")";

/// Values of the beam in the order of its properties, with what is assumed of each.
pub(super) struct Described<'a> {
    pub(super) property: &'a Property,
    pub(super) value: f64,
}

impl BeamTolerance {
    /// Reads `tolerance` and `position_tolerance` of `[beam]`.
    pub(super) fn read(
        table: &Table<'_>,
        described: [Described<'_>; 5],
        poisson: f64,
    ) -> Result<Self, DescriptionError> {
        let entry = table.get("tolerance");
        let is_exact = entry
            .as_ref()
            .is_some_and(|entry| entry.as_text() == Some("exact"));
        let stated = match entry.filter(|_| !is_exact) {
            Some(entry) => Some(entry.table(&keys::TOLERANCE)?),
            None => None,
        };
        let exact = StandardUncertainty {
            std: 0.0,
            stated: true,
        };
        let of = |key: &str, value: f64, dimension: Dimension, assumed: StandardUncertainty| {
            let entry = stated.as_ref().and_then(|table| table.get(key));
            match entry {
                Some(entry) => read_std(&entry, dimension, value),
                None if is_exact => Ok(exact),
                None => Ok(assumed),
            }
        };
        let usual = [
            ASSUMED_LENGTH,
            ASSUMED_WIDTH,
            ASSUMED_THICKNESS,
            ASSUMED_MODULUS,
            ASSUMED_DENSITY,
        ];
        let mut found = [exact; 5];
        for ((found, described), assumed) in found.iter_mut().zip(&described).zip(&usual) {
            let Described { property, value } = described;
            *found = of(property.key, *value, property.dimension, assumed.of(*value))?;
        }
        let [length, width, thickness, modulus, density] = found;
        let assumed = |std: f64| StandardUncertainty { std, stated: false };
        let positions = match table.get("position_tolerance") {
            Some(entry) => {
                let limits = Limits::inside(0.0, described[0].value, REMEDY);
                StandardUncertainty {
                    std: entry.within(LENGTH.dimension, &limits)?,
                    stated: true,
                }
            }
            None if is_exact => exact,
            None => assumed(ASSUMED_POSITIONS),
        };
        Ok(Self {
            length,
            width,
            thickness,
            modulus,
            density,
            poisson: of(
                "poisson",
                poisson.abs(),
                Dimension::Ratio,
                assumed(ASSUMED_POISSON),
            )?,
            masses: of("masses", 1.0, Dimension::Ratio, assumed(ASSUMED_MASSES))?,
            positions,
        })
    }

    /// Names and values of what is assumed, in words: ("modulus", "1 %"), ("density", "0.5 %"). Empty where all is stated.
    pub fn assumed(&self, values: &super::BeamDescription) -> Vec<(&'static str, String)> {
        let percent = |std: f64, value: f64| format!("{} %", number(1e2 * rounded(std / value)));
        let millimetres = |std: f64| with_unit(1e3 * rounded(std), "mm");
        let all = [
            (
                "modulus",
                self.modulus,
                percent(self.modulus.std, values.modulus),
            ),
            (
                "density",
                self.density,
                percent(self.density.std, values.density),
            ),
            ("thickness", self.thickness, millimetres(self.thickness.std)),
            ("width", self.width, millimetres(self.width.std)),
            ("length", self.length, millimetres(self.length.std)),
            ("poisson", self.poisson, number(rounded(self.poisson.std))),
            ("masses", self.masses, percent(self.masses.std, 1.0)),
            ("positions", self.positions, millimetres(self.positions.std)),
        ];
        // A density that the weight alone tells has no tolerance of its own.
        let assumed = all.into_iter().filter(|(name, found, _)| {
            !found.stated && (*name != "density" || values.density_stated)
        });
        assumed.map(|(name, _, std)| (name, std)).collect()
    }
}

/// Rounds to two significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// Reads a standard uncertainty: absolute ("1 mm") or a share of the value ("2 %").
fn read_std(
    entry: &Entry<'_>,
    dimension: Dimension,
    value: f64,
) -> Result<StandardUncertainty, DescriptionError> {
    let relative = entry.as_text().is_some_and(|text| {
        let text = text.trim_end();
        text.ends_with('%') || text.ends_with("ppm")
    });
    let std = if relative {
        value * entry.within(Dimension::Ratio, &Limits::inside(0.0, 1.0, REMEDY))?
    } else {
        entry.within(dimension, &Limits::inside(0.0, value, REMEDY))?
    };
    if std < INCREDIBLY_EXACT * value {
        let usual = "0.01 % to 10 % of the value";
        let question = "did you mean percent? Write \"2 %\"";
        entry.unusual(std, dimension.si_unit(), usual, question);
    }
    Ok(StandardUncertainty { std, stated: true })
}

/// Limits of a beam's mass (kg).
const MASS: Limits = Limits::between(
    1e-6,
    1e6,
    "give the mass of the bare beam in kg, or with its unit: \"830 g\"",
);

/// Reads the mass by a balance.
pub(super) fn read_weighed(table: &Table<'_>) -> Result<Option<WeighedMass>, DescriptionError> {
    let mass = table.within("mass", Dimension::Mass, &MASS)?;
    Ok(mass.map(|mass| WeighedMass {
        mass,
        std: BALANCE.of(mass).std,
    }))
}

/// Reads the frequencies of the free bar.
pub(super) fn read_free(table: &Table<'_>) -> Result<Option<FreeFrequencies>, DescriptionError> {
    let Some(entry) = table.get("free_frequencies") else {
        return match table.get("free_std") {
            Some(entry) => Err(entry.error(
                "there are no `free_frequencies`; state those of the free bar, or remove this key",
            )),
            None => Ok(None),
        };
    };
    let (frequencies, stds) = read_free_frequencies(table, &entry)?;
    Ok(Some(FreeFrequencies { frequencies, stds }))
}
