//! The joint to go by: of the described model, or with what the diagnosis names or lists.

use super::gap::GapSection;
use super::model::{EstimateSection, EstimatedValue};
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_diagnosis::{Hypothesis, HypothesisResult};

/// The joint to go by.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct HeadlineSection {
    /// "described"; "with sensor-mass": the model with what the diagnosis names, if that is confirmed; "with modulus or
    /// length": the models with each of what it lists, whose limits hold those of all.
    pub model: String,
    /// Translational stiffness (N/m); null where it is not estimated.
    pub kt: Option<HeadlineValue>,
    /// Rotational stiffness (N m/rad); null where it is not estimated.
    pub kr: Option<HeadlineValue>,
}

/// A value of the headline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct HeadlineValue {
    /// The value; null where it is infinite: rigid.
    pub value: Option<f64>,
    /// Lower 95 % limit; null where it is unknown or unbounded.
    pub low: Option<f64>,
    /// Upper 95 % limit, likewise.
    pub high: Option<f64>,
}

impl HeadlineSection {
    /// The joint of the described model. `None` where no stiffness was estimated, or one that no spring can have: the pair
    /// regression may find such a joint, and it is none to go by.
    pub(super) fn described(estimate: &EstimateSection) -> Option<Self> {
        let value = |found: &Option<EstimatedValue>| {
            let found = &found.as_ref()?.uncertain;
            Some(HeadlineValue {
                value: Some(found.value).filter(|value| value.is_finite()),
                low: found.low,
                high: found.high,
            })
        };
        let found = [&estimate.kt, &estimate.kr];
        let mut found = found.into_iter().flatten();
        if found.any(|found| found.uncertain.value <= 0.0) {
            return None;
        }
        let (kt, kr) = (value(&estimate.kt), value(&estimate.kr));
        (kt.is_some() || kr.is_some()).then(|| Self {
            model: DESCRIBED.to_owned(),
            kt,
            kr,
        })
    }

    /// Returns whether it is the joint of the described model.
    pub fn is_described(&self) -> bool {
        self.model == DESCRIBED
    }

    /// The joint of the model with what the diagnosis names or lists; `None` where that is nothing. `described` is the joint of
    /// the described model.
    pub(super) fn with(gap: &GapSection, described: Option<&Self>) -> Option<Self> {
        let listed = gap.verdict.hypotheses();
        let mut found: Option<Self> = None;
        let mut names = Vec::with_capacity(listed.len());
        for hypothesis in &listed {
            names.push(match hypothesis {
                Hypothesis::None => "nothing".to_owned(),
                Hypothesis::Unknown => "something unknown".to_owned(),
                _ => hypothesis.name(),
            });
            let own = match hypothesis {
                Hypothesis::None | Hypothesis::Unknown => described.cloned(),
                _ => gap.result(hypothesis).and_then(Self::of_hypothesis),
            };
            // Without one of the joints no limits hold all.
            let own = own?;
            found = Some(match found {
                Some(first) => first.spanning(&own),
                None => own,
            });
        }
        let model = format!("with {}", names.join(" or ").replace('+', " and "));
        Some(Self { model, ..found? })
    }

    /// The joint of one hypothesis; `None` where there is none.
    fn of_hypothesis(found: &HypothesisResult) -> Option<Self> {
        let values = found.joint?.into_iter().zip(found.joint_intervals);
        let mut values = values.map(|(value, interval)| HeadlineValue {
            value: Some(value).filter(|value| value.is_finite()),
            low: interval.map(|ends| ends[0]).filter(|end| end.is_finite()),
            high: interval.map(|ends| ends[1]).filter(|end| end.is_finite()),
        });
        Some(Self {
            model: String::new(),
            kt: values.next(),
            kr: values.next(),
        })
    }

    /// Returns these values with limits that hold those of another joint too.
    fn spanning(self, other: &Self) -> Self {
        let value = |own: Option<HeadlineValue>, other: Option<HeadlineValue>| {
            let (own, other) = own.zip(other)?;
            Some(HeadlineValue {
                low: own.low.zip(other.low).map(|(a, b)| a.min(b)),
                high: own.high.zip(other.high).map(|(a, b)| a.max(b)),
                ..own
            })
        };
        Self {
            kt: value(self.kt, other.kt),
            kr: value(self.kr, other.kr),
            model: self.model,
        }
    }
}

/// Model of a headline that is not the diagnosis' own.
const DESCRIBED: &str = "described";
