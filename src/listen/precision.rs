//! How narrow the intervals are, and what the next tap would make of them.

use tapjoint_report::document::{Document, EstimatedValue};

/// A tap that makes no interval narrower than by this share brings nothing. 1 %: far below what the width of an interval is
/// known to.
const LEAST_GAIN: f64 = 0.01;
/// Fewest taps whose scatter is known well enough to say what one more brings. 4: of three, it is known to a factor of two.
const LEAST_TAPS: usize = 4;
/// "readings" of a budget: the only input that taps make smaller.
const READINGS: &str = "readings";
/// Half the width of a 95 % interval over its standard deviation.
const PER_STD: f64 = 1.96;

/// How narrow the intervals of a result are.
#[derive(Debug, Clone, PartialEq)]
pub struct Precision {
    /// The value with the widest interval: "Kt", "mode 2" or "118 Hz".
    pub widest: String,
    /// Half of that interval over the value (1); `None` where it has no end.
    pub half_width: Option<f64>,
    /// The same after very many taps; `None` where it has no end.
    pub floor: Option<f64>,
    /// Share (1) by which one more tap makes that interval narrower in the mean; `None` of few taps, whose scatter is hardly
    /// known.
    pub gain: Option<f64>,
    /// The largest such share of all intervals (1).
    largest_gain: Option<f64>,
}

/// One interval.
struct Width {
    name: String,
    /// Half the interval over the value (1); infinite where it has no end.
    half: f64,
    /// Share of its variance (1) that more taps make smaller.
    random: f64,
}

impl Precision {
    /// Returns how narrow the intervals are by so many taps: those of the joint, without a joint those of the frequencies.
    /// `None` without any.
    ///
    /// The scatter of a mean over n taps falls as 1/sqrt(n). A further tap takes the variance from `random + rest` to
    /// `random n/(n + 1) + rest`. All of a frequency's uncertainty counts as random.
    pub fn of(document: &Document, taps: usize) -> Option<Self> {
        let mut widths = of_joint(document);
        if widths.is_empty() {
            widths = of_frequencies(document);
        }
        let widest = widths
            .iter()
            .max_by(|one, other| one.half.total_cmp(&other.half))?;
        let gain = |width: &Width| {
            let left = 1.0 - width.random / (taps as f64 + 1.0);
            (taps >= LEAST_TAPS).then(|| 1.0 - left.sqrt())
        };
        let finite = |half: f64| Some(half).filter(|half| half.is_finite());
        let gains = widths.iter().map(gain).collect::<Option<Vec<f64>>>();
        Some(Self {
            widest: widest.name.clone(),
            half_width: finite(widest.half),
            floor: finite(widest.half * (1.0 - widest.random).sqrt()),
            gain: gain(widest),
            largest_gain: gains.map(|gains| gains.into_iter().fold(0.0, f64::max)),
        })
    }

    /// Returns true where every interval is within this share (1) of its value on either side.
    pub fn reaches(&self, accuracy: f64) -> bool {
        self.half_width.is_some_and(|half| half <= accuracy)
    }

    /// Returns true where taps alone can make every interval as narrow as this share (1) of its value.
    pub fn can_reach(&self, accuracy: f64) -> bool {
        self.floor.is_some_and(|floor| floor < accuracy)
    }

    /// Returns true where the next tap makes no interval narrower by a hundredth.
    pub fn is_exhausted(&self) -> bool {
        self.largest_gain.is_some_and(|gain| gain < LEAST_GAIN)
    }
}

/// Widths of the joint to go by, or of the beam's modulus.
fn of_joint(document: &Document) -> Vec<Width> {
    let Some(Some(estimate)) = &document.estimate else {
        return Vec::new();
    };
    let headline = document.headline.as_ref();
    let [kt, kr] = [
        headline.and_then(|found| found.kt),
        headline.and_then(|found| found.kr),
    ];
    let mut widths = Vec::new();
    let own = [
        ("Kt", &estimate.kt, kt),
        ("Kr", &estimate.kr, kr),
        ("E", &estimate.modulus, None),
    ];
    for (name, estimated, headline) in own {
        let Some(estimated) = estimated else {
            continue;
        };
        let found = &estimated.uncertain;
        let (value, ends) = match headline {
            Some(found) => (found.value, found.low.zip(found.high)),
            None => (Some(found.value), found.low.zip(found.high)),
        };
        let half = value.zip(ends).map(|(value, (low, high))| {
            let half = (high - low) / 2.0;
            (half / value).abs()
        });
        let half = half
            .filter(|half| half.is_finite())
            .unwrap_or(f64::INFINITY);
        widths.push(Width {
            name: name.to_owned(),
            half,
            random: random_share(estimated, half),
        });
    }
    widths
}

/// Share (1) of the variance of a value, half of whose interval is this wide (1), that the readings have. 1 where the budget
/// does not say.
fn random_share(estimated: &EstimatedValue, half: f64) -> f64 {
    let rows = estimated.budget.iter();
    let readings = rows.clone().find(|row| row.input == READINGS);
    let all: f64 = rows.map(|row| row.std_percent.powi(2)).sum();
    let Some(readings) = readings else {
        return 1.0;
    };
    // The interval may hold more than the budget: the doubt which model is the right one.
    let whole = all.max((100.0 * half / PER_STD).powi(2));
    let share = readings.std_percent.powi(2) / whole;
    match share.is_finite() {
        true => share.clamp(0.0, 1.0),
        false => 1.0,
    }
}

/// Widths of the frequencies: those of the modes, or of all peaks where none is numbered.
fn of_frequencies(document: &Document) -> Vec<Width> {
    let modes = document.modes.iter().flatten();
    let is_numbered = modes.clone().any(|mode| mode.mode.is_some());
    let modes = modes.filter(|mode| !is_numbered || mode.mode.is_some());
    let widths = modes.filter_map(|mode| {
        let (low, high) = mode.low.zip(mode.high)?;
        Some(Width {
            name: match mode.mode {
                Some(number) => format!("mode {number}"),
                None => format!("{:.0} Hz", mode.frequency),
            },
            half: (high - low) / 2.0 / mode.frequency,
            random: 1.0,
        })
    });
    widths.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_report::document::{BudgetRow, EstimateSection, ModeSection, Uncertain};

    fn frequencies(halves: &[f64]) -> Document {
        let modes = halves.iter().zip(1..).map(|(half, number)| ModeSection {
            mode: Some(number),
            frequency: 100.0,
            low: Some(100.0 - 100.0 * half),
            high: Some(100.0 + 100.0 * half),
            ..ModeSection::default()
        });
        Document {
            modes: Some(modes.collect()),
            ..Document::default()
        }
    }

    /// A stiffness known within 1.96 times the root of the sum of both parts (%), the first by the readings.
    fn joint(readings: f64, rest: f64) -> Document {
        let std = f64::hypot(readings, rest) / 100.0;
        let row = |input: &str, std_percent| BudgetRow {
            input: input.to_owned(),
            std_percent,
        };
        let kt = EstimatedValue {
            uncertain: Uncertain::symmetric(1e6, Some(1e6 * std)),
            budget: vec![row(READINGS, readings), row("modulus", rest)],
            ..EstimatedValue::default()
        };
        Document {
            estimate: Some(Some(EstimateSection {
                kt: Some(kt),
                ..EstimateSection::default()
            })),
            ..frequencies(&[0.4])
        }
    }

    #[test]
    fn val_the_gain_of_a_tap_where_all_is_scatter() {
        // 1 - sqrt(n/(n + 1)).
        for (taps, wanted) in [(4, 0.105_573), (24, 0.020_204)] {
            let found = Precision::of(&frequencies(&[0.001, 0.003]), taps).unwrap();
            assert!(
                (found.gain.unwrap() - wanted).abs() < 1e-6,
                "{taps}: {found:?}"
            );
            assert_eq!(found.widest, "mode 2");
            assert!((found.half_width.unwrap() - 0.003).abs() < 1e-12);
            assert!(found.can_reach(1e-6));
        }
        let of = |taps| Precision::of(&frequencies(&[0.001]), taps).unwrap();
        assert!(!of(48).is_exhausted());
        assert!(of(50).is_exhausted());
        // Of few taps nothing is said.
        assert_eq!(of(3).gain, None);
        assert!(!of(3).is_exhausted());
    }

    #[test]
    fn limit_a_certain_reading_gains_nothing_and_joints_come_before_frequencies() {
        let found = Precision::of(&joint(0.0, 3.0), 5).unwrap();
        assert_eq!((found.widest.as_str(), found.gain), ("Kt", Some(0.0)));
        assert!(
            (found.half_width.unwrap() - 0.0588).abs() < 1e-5,
            "{found:?}"
        );
        assert!(found.is_exhausted() && found.reaches(0.06) && !found.reaches(0.05));
        assert!(!found.can_reach(0.05));
        // Readings as large as the rest: taps alone take the variance to its half.
        let found = Precision::of(&joint(2.0, 2.0), 4).unwrap();
        let wanted = 1.0 - 0.9_f64.sqrt();
        // 1.96 has three digits.
        assert!((found.gain.unwrap() - wanted).abs() < 1e-4, "{found:?}");
        let floor = found.floor.unwrap() / found.half_width.unwrap();
        assert!((floor - 0.5_f64.sqrt()).abs() < 1e-4, "{found:?}");
        // An interval without an end is never narrow enough.
        let mut open = joint(0.0, 3.0);
        let kt = open
            .estimate
            .iter_mut()
            .flatten()
            .flat_map(|one| &mut one.kt);
        kt.for_each(|kt| kt.uncertain.high = None);
        let found = Precision::of(&open, 100).unwrap();
        assert!(!found.reaches(1.0) && !found.can_reach(1.0));
        assert_eq!(Precision::of(&Document::default(), 5), None);
    }
}
