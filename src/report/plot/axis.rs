//! From a value to a pixel, and where the ticks go.

/// Whether equal distances are equal differences or equal ratios.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Logarithmic,
}

/// One axis of a panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Scale.
    pub scale: Scale,
    /// Value at the start.
    pub low: f64,
    /// Value at the end.
    pub high: f64,
    /// Pixel at the start.
    pub from: f64,
    /// Pixel at the end.
    pub to: f64,
}

/// A tick and its words; small ticks have none.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Where.
    pub value: f64,
    /// What it says.
    pub label: Option<String>,
}

impl Axis {
    /// A linear axis over `values` = (low, high); an empty or broken range is widened.
    pub fn linear(values: (f64, f64), pixels: (f64, f64)) -> Axis {
        let (low, high) = usable(values);
        Axis {
            scale: Scale::Linear,
            low,
            high,
            from: pixels.0,
            to: pixels.1,
        }
    }

    /// A logarithmic axis; values that are not positive become its lower end.
    pub fn logarithmic(values: (f64, f64), pixels: (f64, f64)) -> Axis {
        let (low, high) = values;
        let high = if high.is_finite() && high > 0.0 {
            high
        } else {
            1.0
        };
        let low = if low.is_finite() && low > 0.0 && low < high {
            low
        } else {
            high * 1e-3
        };
        Axis {
            scale: Scale::Logarithmic,
            low,
            high,
            from: pixels.0,
            to: pixels.1,
        }
    }

    /// Pixel of a value, kept inside the axis; what is no number lies at its start.
    pub fn place(&self, value: f64) -> f64 {
        let share = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic => {
                (value.max(self.low) / self.low).ln() / (self.high / self.low).ln()
            }
        };
        let share = if share.is_nan() { 0.0 } else { share };
        self.from + share.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// Whether a value lies on the axis.
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Ticks, about one label for every `spacing` pixels.
    pub fn ticks(&self, spacing: f64) -> Vec<Tick> {
        let room = ((self.to - self.from).abs() / spacing).max(1.0);
        match self.scale {
            Scale::Linear => self.linear_ticks(room),
            Scale::Logarithmic => self.decade_ticks(room),
        }
    }

    fn linear_ticks(&self, room: f64) -> Vec<Tick> {
        let step = nice_step((self.high - self.low) / room);
        let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        // A hair of slack keeps a tick that rounding puts outside the end.
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        (first..=last.min(first.saturating_add(100)))
            .map(|number| Tick {
                value: number as f64 * step,
                label: Some(written(number as f64 * step, step, decimals)),
            })
            .collect()
    }

    fn decade_ticks(&self, room: f64) -> Vec<Tick> {
        let (first, last) = (self.low.log10(), self.high.log10());
        let decades = last - first;
        if decades < 1.2 {
            return self.linear_ticks(room);
        }
        let stride = (decades / room).ceil().max(1.0) as i32;
        let mut ticks = Vec::new();
        for exponent in first.floor() as i32..=last.ceil() as i32 {
            let small = if stride == 1 { 1..=9 } else { 1..=1 };
            for digit in small {
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
fn written(value: f64, step: f64, decimals: usize) -> String {
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
        '0' => '\u{2070}',
        other => other
            .to_digit(10)
            .and_then(|digit| char::from_u32(0x2070 + digit))
            .unwrap_or(other),
    });
    format!("10{}", raised.collect::<String>())
}

/// A range with some length and finite ends.
fn usable((low, high): (f64, f64)) -> (f64, f64) {
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
    values
        .into_iter()
        .filter(|value| value.is_finite())
        .fold(None, |range, value| match range {
            None => Some((value, value)),
            Some((low, high)) => Some((value.min(low), value.max(high))),
        })
}

/// A range with `share` of its length added at both ends.
pub fn padded((low, high): (f64, f64), share: f64) -> (f64, f64) {
    let (low, high) = usable((low, high));
    let margin = share * (high - low);
    (low - margin, high + margin)
}
