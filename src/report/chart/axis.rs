//! An axis: its range, its scale, and the ticks that it has.

use serde::Serialize;

/// Equal distances are equal differences or equal ratios.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Logarithmic,
}

/// One axis of a panel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    /// The quantity: "frequency".
    pub label: String,
    /// Its unit: "Hz"; empty for a count or a name, "1" for a ratio.
    pub unit: String,
    /// Scale.
    pub scale: Scale,
    /// Value at the start.
    pub low: f64,
    /// Value at the end.
    pub high: f64,
    /// Ticks with names; empty where the axis has numbers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<Tick>,
    /// Length of a turn where values come round again, as 360 degrees do.
    pub period: Option<f64>,
}

/// A tick and its words; small ticks have none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tick {
    /// Value at which it stands.
    pub value: f64,
    /// Its number or name. Lines after the first are further facts, for pictures alone.
    pub label: Option<String>,
}

/// Decades below which a logarithmic axis has 1, 2 and 5 times each power of ten.
const FEW_DECADES: f64 = 2.6;

impl Axis {
    /// A linear axis from `low` to `high`; an empty or broken range is widened.
    pub fn linear(low: f64, high: f64) -> Axis {
        let (low, high) = usable(low, high);
        Axis {
            label: String::new(),
            unit: String::new(),
            scale: Scale::Linear,
            low,
            high,
            names: Vec::new(),
            period: None,
        }
    }

    /// A logarithmic axis; an end that is not positive is replaced.
    pub fn logarithmic(low: f64, high: f64) -> Axis {
        let high = if high.is_finite() && high > 0.0 {
            high
        } else {
            1.0
        };
        let low = if low > 0.0 && low < high {
            low
        } else {
            high * 1e-3
        };
        Axis {
            scale: Scale::Logarithmic,
            low,
            high,
            ..Axis::linear(0.0, 1.0)
        }
    }

    /// The axis with a quantity and its unit.
    pub fn of(mut self, label: impl Into<String>, unit: impl Into<String>) -> Axis {
        self.label = label.into();
        self.unit = unit.into();
        self
    }

    /// The axis with names at some values instead of numbers.
    pub fn named(mut self, names: impl IntoIterator<Item = (f64, String)>) -> Axis {
        for (value, name) in names {
            let label = Some(name);
            self.names.push(Tick { value, label });
        }
        self
    }

    /// "frequency (Hz)".
    pub fn title(&self) -> String {
        match self.unit.as_str() {
            "" => self.label.clone(),
            unit => format!("{} ({unit})", self.label),
        }
    }

    /// Place of a value as a share of the axis, 0 at its start. Values beyond an end lie on it, and what is
    /// no number lies at the start.
    pub fn share(&self, value: f64) -> f64 {
        let share = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic => {
                (value.max(self.low) / self.low).ln() / (self.high / self.low).ln()
            }
        };
        if share.is_nan() {
            0.0
        } else {
            share.clamp(0.0, 1.0)
        }
    }

    /// True for a value on the axis.
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Ticks with room for about so many labels: names, or round numbers.
    pub fn ticks(&self, room: f64) -> Vec<Tick> {
        let room = room.max(1.0);
        let decades = (self.high / self.low).log10();
        if !self.names.is_empty() {
            self.names.clone()
        } else if self.scale == Scale::Linear || decades < 0.5 {
            self.linear_ticks(room)
        } else if decades < FEW_DECADES && self.low > 1e-3 && self.high < 1e5 {
            self.digit_ticks()
        } else if decades < 1.2 {
            self.linear_ticks(room)
        } else {
            self.decade_ticks(room)
        }
    }

    fn linear_ticks(&self, room: f64) -> Vec<Tick> {
        let step = nice_step((self.high - self.low) / room);
        // A hair of slack keeps a tick that rounding puts outside the end.
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        let mut ticks = Vec::new();
        for number in first..=last.min(first.saturating_add(100)) {
            let value = number as f64 * step;
            ticks.push(Tick {
                value,
                label: Some(written(value, step)),
            });
        }
        ticks
    }

    /// 1, 2 and 5 times each power of ten.
    fn digit_ticks(&self) -> Vec<Tick> {
        let mut ticks = Vec::new();
        for exponent in self.low.log10().floor() as i32..=self.high.log10().ceil() as i32 {
            for digit in [1.0, 2.0, 5.0] {
                let value = digit * 10f64.powi(exponent);
                let decimals = usize::try_from(-exponent).unwrap_or(0);
                if self.holds(value) {
                    ticks.push(Tick {
                        value,
                        label: Some(format!("{value:.decimals$}")),
                    });
                }
            }
        }
        ticks
    }

    fn decade_ticks(&self, room: f64) -> Vec<Tick> {
        let (first, last) = (self.low.log10(), self.high.log10());
        let stride = ((last - first) / room).ceil().max(1.0) as i32;
        let digits = if stride == 1 { 9 } else { 1 };
        let mut ticks = Vec::new();
        for exponent in first.floor() as i32..=last.ceil() as i32 {
            for digit in 1..=digits {
                let value = f64::from(digit) * 10f64.powi(exponent);
                let labelled = digit == 1 && exponent.rem_euclid(stride) == 0;
                if self.holds(value) {
                    ticks.push(Tick {
                        value,
                        label: labelled.then(|| power_of_ten(exponent)),
                    });
                }
            }
        }
        ticks
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`.
pub fn nice_step(least: f64) -> f64 {
    if !(least.is_finite() && least > 0.0) {
        return 1.0;
    }
    let decade = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|digit| digit * decade)
        .find(|step| *step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

/// A tick's number; large and small ones with a power of ten.
fn written(value: f64, step: f64) -> String {
    let value = if value.abs() < step * 1e-6 {
        0.0
    } else {
        value
    };
    let powers = !(1e-4..1e5).contains(&step);
    let text = if powers && value == 0.0 {
        "0".to_owned()
    } else if powers {
        let exponent = value.abs().log10().floor();
        let mantissa = value / 10f64.powf(exponent);
        let digits = (exponent - step.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{mantissa:.digits$}\u{b7}{}", power_of_ten(exponent as i32))
    } else {
        let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        format!("{value:.decimals$}")
    };
    text.replace('-', "\u{2212}")
}

/// "10⁻³".
fn power_of_ten(exponent: i32) -> String {
    let digits = exponent.to_string();
    let raised = digits.chars().map(|letter| match letter {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    });
    format!("10{}", raised.collect::<String>())
}

/// A range with some length and finite ends.
fn usable(low: f64, high: f64) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) {
        return (0.0, 1.0);
    }
    let least = 1e-9 * low.abs().max(high.abs()).max(1e-300);
    if high - low > least {
        (low, high)
    } else {
        let widen = (0.01 * low.abs()).max(1e-12);
        (low - widen, low + widen)
    }
}

/// Smallest and largest of the finite values; `None` if there is none.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(None, |range, value| match range {
        None => Some((value, value)),
        Some((low, high)) => Some((value.min(low), value.max(high))),
    })
}

/// A linear axis over a range with `share` of its length added at both ends.
pub fn padded(range: (f64, f64), share: f64) -> Axis {
    let (low, high) = usable(range.0, range.1);
    let margin = share * (high - low);
    Axis::linear(low - margin, high + margin)
}
