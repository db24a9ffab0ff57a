//! Ranges of values, and what to do when a value lies outside.

use super::error::{number, with_unit};
use std::ops::{Bound, RangeBounds};

/// The values a quantity may take, and what to do when it does not.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) low: Bound<f64>,
    pub(super) high: Bound<f64>,
    pub(super) remedy: &'static str,
}

impl Limits {
    /// From `low` to `high`, both included.
    pub(super) const fn between(low: f64, high: f64, remedy: &'static str) -> Self {
        Self {
            low: Bound::Included(low),
            high: Bound::Included(high),
            remedy,
        }
    }

    /// Greater than zero, up to `high`.
    pub(super) const fn positive(high: f64, remedy: &'static str) -> Self {
        Self {
            low: Bound::Excluded(0.0),
            high: Bound::Included(high),
            remedy,
        }
    }

    /// Whether a value is within them.
    pub(super) fn contain(&self, value: f64) -> bool {
        (self.low, self.high).contains(&value)
    }

    /// The range as messages name it.
    pub(super) fn in_words(&self, unit: &str) -> String {
        if let (Bound::Included(low), Bound::Included(high)) = (self.low, self.high) {
            return format!("{} to {}", number(low), with_unit(high, unit));
        }
        let low = match self.low {
            Bound::Included(low) => format!("from {}", with_unit(low, unit)),
            Bound::Excluded(low) => format!("more than {}", with_unit(low, unit)),
            Bound::Unbounded => String::new(),
        };
        let high = match self.high {
            Bound::Included(high) => format!("up to {}", with_unit(high, unit)),
            Bound::Excluded(high) => format!("less than {}", with_unit(high, unit)),
            Bound::Unbounded => String::new(),
        };
        [low, high]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(", ")
    }
}
