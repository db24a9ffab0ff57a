//! Even spacing of printed times or frequencies: the check of each step, and the rate.

/// Largest deviation of a step from the step elsewhere, as a part of it.
const TOLERANCE: f64 = 1e-3;

/// A rate this near to a whole number, relatively, may be that whole number: a tenth of the
/// tolerance, far below any resolution of frequency.
const WHOLE_RATE: f64 = 1e-4;

/// Roundings of binary arithmetic in the comparisons.
const SLACK: f64 = 1.0 + 1e-9;

/// A step that is not the step elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UnevenStep {
    /// Line it leads to.
    pub line: u64,
    /// Time there (the column's unit).
    pub time: f64,
    /// The step (the column's unit).
    pub step: f64,
}

/// Checks the steps of a time column one after the other.
///
/// A step may deviate from the reference by 0.1 %, or by what rounding explains: times that were
/// evenly spaced before they were printed have steps that differ among themselves by at most one
/// unit of the last digit. Rounding never explains half of a step or more, for then a lost row
/// could pass for it.
#[derive(Debug, Clone)]
pub(super) struct TimeCheck {
    reference: f64,
    /// Steps behind the reference.
    reference_steps: f64,
    digits: Digits,
    first: f64,
    last: f64,
    count: u64,
    shortest: Option<UnevenStep>,
    longest: Option<UnevenStep>,
}

impl TimeCheck {
    /// Takes the reference from the first times of the file, robustly: the mean of the steps within
    /// a half of their median, so that a gap among them does not count.
    pub(super) fn new<'a>(head: impl Iterator<Item = (f64, &'a [u8])>) -> Self {
        let mut digits = Digits::default();
        let mut times = Vec::new();
        for (time, cell) in head {
            digits.include(time, cell);
            times.push(time);
        }
        let mut steps: Vec<f64> = times
            .windows(2)
            .filter_map(|pair| Some(pair.last()? - pair.first()?))
            .collect();
        steps.sort_by(f64::total_cmp);
        let median = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        steps.retain(|step| (step - median).abs() <= 0.5 * median);
        let count = steps.len().max(1) as f64;
        Self {
            reference: steps.iter().sum::<f64>() / count,
            reference_steps: count,
            digits,
            first: 0.0,
            last: 0.0,
            count: 0,
            shortest: None,
            longest: None,
        }
    }

    /// The step elsewhere (the column's unit).
    pub(super) fn reference(&self) -> f64 {
        self.reference
    }

    /// Takes the next time, printed as `cell` in line `line`.
    pub(super) fn add(&mut self, time: f64, cell: &[u8], line: u64) -> Result<(), UnevenStep> {
        if self.count == 0 {
            self.first = time;
        } else {
            let step = time - self.last;
            self.check(UnevenStep { line, time, step }, cell)?;
        }
        self.last = time;
        self.count += 1;
        Ok(())
    }

    fn check(&mut self, new: UnevenStep, cell: &[u8]) -> Result<(), UnevenStep> {
        let deviation = (new.step - self.reference).abs();
        let allowed = TOLERANCE * self.reference;
        let shortest = self.shortest.get_or_insert(new);
        if new.step < shortest.step {
            *shortest = new;
        }
        let longest = self.longest.get_or_insert(new);
        if new.step > longest.step {
            *longest = new;
        }
        let (shortest, longest) = (*shortest, *longest);
        if new.step > 0.0 && deviation <= allowed * SLACK {
            return Ok(());
        }
        self.digits.include(new.time, cell);
        let unit = self.digits.unit_at(new.time);
        // The reference itself is known to a unit over the number of its steps.
        let by_rounding = unit * (1.0 + 1.0 / self.reference_steps);
        let limit = by_rounding.min(0.5 * self.reference) * SLACK;
        let spread = longest.step - shortest.step;
        if new.step > 0.0 && deviation <= limit && spread <= (unit + allowed) * SLACK {
            return Ok(());
        }
        // The step that deviates most is the one to blame; it may have come before.
        let blame = [shortest, longest]
            .into_iter()
            .filter(|other| other.line < new.line)
            .find(|other| (other.step - self.reference).abs() >= deviation / SLACK);
        Err(blame.filter(|_| new.step > 0.0).unwrap_or(new))
    }

    /// The sample rate by first and last time, and the one to use (Hz); `None` without two rows.
    ///
    /// They differ where the whole number nearest to the mean lies within the scatter of the steps
    /// or within the rounding of the last time: the clock was exact and its printing was not.
    /// `factor` turns the column's unit into seconds.
    pub(super) fn sample_rate(&self, factor: f64) -> Option<(f64, f64)> {
        let (shortest, longest) = (self.shortest?.step, self.longest?.step);
        let span = self.last - self.first;
        let mean = (self.count - 1) as f64 / (span * factor);
        let whole = mean.round();
        let whole_step = 1.0 / (whole * factor);
        let in_scatter = shortest <= whole_step * SLACK && whole_step <= longest * SLACK;
        let deviation = (whole - mean).abs() / mean;
        let by_rounding = self.digits.unit_at(self.last) / span;
        let is_whole = deviation <= WHOLE_RATE && (in_scatter || deviation <= by_rounding);
        Some((mean, if is_whole { whole } else { mean }))
    }
}

/// Number of digits of the times, over all cells looked at: fixed decimals or fixed significant
/// digits, zeros at the end possibly left out, or the 24 binary digits of single precision.
#[derive(Debug, Clone, Copy)]
struct Digits {
    /// Largest number of significant digits.
    significant: i32,
    /// Power of ten of the finest last digit.
    finest: i32,
    /// `true` where every cell may be a single-precision number.
    single: bool,
}

impl Default for Digits {
    fn default() -> Self {
        Self {
            significant: 1,
            finest: 0,
            single: true,
        }
    }
}

impl Digits {
    fn include(&mut self, time: f64, cell: &[u8]) {
        let (mut significant, mut decimals, mut after_mark) = (0, 0, false);
        let mut bytes = cell.iter();
        for byte in bytes.by_ref() {
            match byte {
                b'0'..=b'9' => {
                    // Zeros in front are not significant.
                    significant += i32::from(significant > 0 || *byte != b'0');
                    decimals += i32::from(after_mark);
                }
                b'.' | b',' => after_mark = true,
                b'e' | b'E' | b'd' | b'D' => break,
                _ => {}
            }
        }
        let exponent = str::from_utf8(bytes.as_slice()).unwrap_or_default();
        let exponent: i32 = exponent.parse().unwrap_or(0);
        let last_digit = exponent.saturating_sub(decimals);
        self.significant = self.significant.max(significant);
        if significant > 0 {
            self.finest = self.finest.min(last_digit);
        }
        let from_single = (time - f64::from(time as f32)).abs();
        self.single &= from_single <= 0.5 * SLACK * 10_f64.powi(last_digit);
    }

    /// One unit of the last digit of a time: the coarsest of what fixed decimals, fixed significant
    /// digits and single precision make of it.
    fn unit_at(&self, time: f64) -> f64 {
        // Rounded to single precision and then printed with just enough digits to tell it from its
        // neighbours, a time moves by up to one of its spacings; two steps differ by four.
        let single = match self.single {
            true => 4.0 * f64::from(f32::EPSILON) * time.abs(),
            false => 0.0,
        };
        let fixed = single.max(10_f64.powi(self.finest));
        let leading = match time {
            0.0 => return fixed,
            time => time.abs().log10().floor() as i32,
        };
        fixed.max(10_f64.powi(leading.saturating_add(1).saturating_sub(self.significant)))
    }
}
