//! An effect with the values of its parameters.

use super::{EffectError, nearest_name};
use super::{EffectId, ParameterInfo};

/// An effect of a certain size.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Which.
    pub id: EffectId,
    /// In the order of [`EffectId::parameters`].
    values: Vec<f64>,
}

impl Effect {
    /// With named values (SI); the others are typical ones.
    ///
    /// # Errors
    /// [`EffectError`] for an unknown name, a value twice or outside its range, or a missing value
    /// that nothing is typical of.
    pub fn from_pairs(id: EffectId, pairs: &[(&str, f64)]) -> Result<Self, EffectError> {
        let mut values = vec![None; id.parameters().len()];
        for (name, value) in pairs {
            let index = index_of(id, name)?;
            let info = &id.parameters()[index];
            if values[index].replace(in_range(id, info, *value)?).is_some() {
                return Err(EffectError::Twice {
                    effect: id.name(),
                    name: info.name,
                });
            }
        }
        let filled = id.parameters().iter().zip(values).map(|(info, value)| {
            value.or(info.typical).ok_or(EffectError::Missing {
                effect: id.name(),
                name: info.name,
                meaning: info.meaning,
            })
        });
        Ok(Self {
            id,
            values: filled.collect::<Result<_, _>>()?,
        })
    }

    /// With all values (SI), in the order of [`EffectId::parameters`]; missing ones are typical.
    ///
    /// # Errors
    /// As [`Self::from_pairs`].
    pub fn from_values(id: EffectId, values: &[f64]) -> Result<Self, EffectError> {
        let names = id.parameters().iter().map(|info| info.name);
        let pairs: Vec<(&str, f64)> = names.zip(values.iter().copied()).collect();
        Self::from_pairs(id, &pairs)
    }

    /// The same effect with another value (SI) of one parameter.
    ///
    /// # Errors
    /// [`EffectError`] for an unknown name or a value outside its range.
    pub fn with(&self, name: &str, value: f64) -> Result<Self, EffectError> {
        let index = index_of(self.id, name)?;
        let mut changed = self.clone();
        changed.values[index] = in_range(self.id, &self.id.parameters()[index], value)?;
        Ok(changed)
    }

    /// Value (SI) of a parameter; `None` where the effect has none of that name.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.values()
            .find(|(info, _)| info.name == name)
            .map(|(_, value)| value)
    }

    /// Its parameters with their values (SI).
    pub fn values(&self) -> impl Iterator<Item = (&'static ParameterInfo, f64)> + '_ {
        self.id.parameters().iter().zip(self.values.iter().copied())
    }

    /// First and second value; every effect has one, 0 stands for a second that does not exist.
    pub(super) fn pair(&self) -> (f64, f64) {
        (self.values[0], self.values.get(1).copied().unwrap_or(0.0))
    }
}

impl EffectId {
    /// Its parameter of that name.
    ///
    /// # Errors
    /// [`EffectError::UnknownParameter`], with the name that comes nearest.
    pub fn parameter(self, name: &str) -> Result<&'static ParameterInfo, EffectError> {
        Ok(&self.parameters()[index_of(self, name)?])
    }
}

fn index_of(id: EffectId, name: &str) -> Result<usize, EffectError> {
    let known = || id.parameters().iter().map(|info| info.name);
    known()
        .position(|known| known == name)
        .ok_or_else(|| EffectError::UnknownParameter {
            effect: id.name(),
            name: name.to_owned(),
            nearest: nearest_name(name, known()),
            known: known().collect::<Vec<_>>().join(", "),
        })
}

fn in_range(id: EffectId, info: &ParameterInfo, value: f64) -> Result<f64, EffectError> {
    // A position may not be infinite either.
    if value.is_finite() && (info.lowest..=info.highest).contains(&value) {
        return Ok(value);
    }
    Err(EffectError::OutOfRange {
        effect: id.name(),
        name: info.name,
        value,
        lowest: info.lowest,
        highest: info.highest,
        unit: info.dimension.unit(),
    })
}
