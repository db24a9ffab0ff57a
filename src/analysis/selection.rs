//! Choosing the taps of a recording that agree with each other.
//!
//! All taps of a recording show the same frequency response, unless one hits another place, hits obliquely or moves a sensor.
//! [`choose`] compares the response of each tap with the median of the others, takes the worst out, and begins again.

use super::tap_responses::{Octave, TapResponse};
use num_complex::Complex64;
use tapjoint_numerics::stats::median;

/// Fewest taps among which one can be chosen. 4: of three, two that agree by chance would make the third a fault.
pub(super) const LEAST_TAPS: usize = 4;
/// At most one tap in so many is taken out. 3: two thirds that agree are a clear majority, and of four taps three are left.
const ONE_IN: usize = 3;
/// A departure up to this (1) rejects no tap. 12 %, chosen: small scatter of the places is then no fault.
const FLOOR: f64 = 0.12;
/// Limit of a departure over the median departure of the others, where there are many taps. 5: of many normal values 1 in
/// 1000 is that far from their median; of 20, 4 in 1000 are beyond the limit for 20.
const TIMES: f64 = 5.0;
/// Added to [`TIMES`] over the number of taps less two. 12: the median departure of few taps is itself uncertain. The
/// study `examples/tap_selection` then sees no right tap rejected among four or six, at any scatter up to 5 mm.
const TIMES_OF_FEW: f64 = 12.0;
/// Least distance of two groups over the distances within them, where there are many taps. Among n taps it is n/(n - 3) times
/// that. 4: of four or more normal values, fewer than 1 % of all draws have such a gap in their middle.
const TIMES_OF_GROUPS: f64 = 4.0;
/// Times the disturbance before a tap that its departure may have (1). 1.5: what rings on is less than what came before it,
/// and noise differs from one stretch to the next.
const OF_DISTURBANCE: f64 = 1.5;
/// Weight of the disturbance beside the scatter in the weights of cells (1). 10: lines where the last tap still rings say
/// little about the place.
const AGAINST_DISTURBANCE: f64 = 10.0;
/// Lines where the force has less than this share of its largest power are left out. 1 %, or 20 dB, as is usual.
const EXCITED: f64 = 0.01;
/// Most shift of the frequencies in an octave that is no departure, as a share of the frequency. 1 %: joints that depend on
/// amplitude shift by less between taps of one recording.
const MOST_SHIFT: f64 = 0.01;
/// Most change of the damping ratio in an octave that is no departure. 0.5 %, for the same reason.
const MOST_DAMPING: f64 = 0.005;
/// A tap is kept if its peak is so many times above or below those of all taps that agree. 1.25: hands scatter by some 10 %.
pub(super) const OTHER_LEVEL: f64 = 1.25;

/// Choice among the taps of a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Choice {
    /// The taps that depart, each by its place in the list; ascending.
    pub departing: Vec<Departing>,
    /// Taps that depart and are kept, because they differ in level from all others.
    pub of_other_level: usize,
    /// The reason for which all taps are kept although some depart.
    pub disagreement: Option<Disagreement>,
}

/// A tap that departs from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Departing {
    /// Place in the list of taps.
    pub tap: usize,
    /// Departure from the median of the taps that are kept, relative to their response (1).
    pub departure: f64,
    /// Median departure of those (1).
    pub others: f64,
    /// Limit of the departure (1).
    pub limit: f64,
}

/// Disagreement of the taps in which none is right by majority.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Disagreement {
    /// More taps depart than may be taken out.
    TooMany {
        /// Number of taps that depart, at least.
        departing: usize,
    },
    /// The taps fall into two groups.
    Groups {
        /// Taps of either group, the larger first.
        sizes: [usize; 2],
        /// Least difference between taps of the two groups, relative to the response (1).
        apart: f64,
        /// Median peak of the stronger group over that of the weaker one (1).
        level: f64,
    },
}

/// Departures of taps from a common response.
struct Departures {
    /// Departure of each tap from the median of the other ones that are kept (1).
    departure: Vec<f64>,
    /// What the responses did before each tap, relative to those after it (1).
    disturbance: Vec<f64>,
    /// What the median does not explain of each tap, by lines and sensors. Its norm is the departure. Empty for
    /// [`Reference::OfOthers`].
    rest: Vec<Vec<Complex64>>,
}

/// Chooses among `taps`. Those that are `protected` are kept whatever their departure; `peaks` are the peaks of their
/// forces.
pub(super) fn choose(
    octaves: &[Octave],
    taps: &[TapResponse],
    protected: &[bool],
    peaks: &[f64],
) -> Choice {
    if taps.len() < LEAST_TAPS {
        return Choice::default();
    }
    let comparison = Comparison::new(octaves, taps);
    let mut is_kept = vec![true; taps.len()];
    let mut is_protected = protected.to_vec();
    let mut is_of_other_level = vec![false; taps.len()];
    let most = taps.len() / ONE_IN;
    let mut rejected = 0;
    loop {
        let found = comparison.departures(&is_kept, Reference::OfOthers);
        let limits: Vec<Limit> = (0..taps.len())
            .map(|tap| found.limit(tap, &is_kept))
            .collect();
        let mut worst: Option<(f64, usize)> = None;
        for tap in (0..taps.len()).filter(|tap| is_kept[*tap] && !is_protected[*tap]) {
            let excess = found.departure[tap] / limits[tap].limit;
            if excess > worst.map_or(1.0, |(excess, _)| excess) {
                worst = Some((excess, tap));
            }
        }
        let Some((_, worst)) = worst else {
            break;
        };
        let agrees: Vec<bool> = (0..taps.len())
            .map(|tap| is_kept[tap] && found.departure[tap] <= limits[tap].limit)
            .collect();
        let agreeing = (0..taps.len()).filter(|tap| agrees[*tap]);
        let is_of_level = lies_beyond(peaks[worst], agreeing.map(|tap| peaks[tap])) || {
            let common = comparison.departures(&is_kept, Reference::OfAll);
            common.beside_level(worst, &is_kept, peaks) <= limits[worst].limit
        };
        if is_of_level {
            is_protected[worst] = true;
            is_of_other_level[worst] = true;
            continue;
        }
        rejected += 1;
        if rejected > most {
            return Choice {
                disagreement: Some(Disagreement::TooMany {
                    departing: rejected,
                }),
                ..Choice::default()
            };
        }
        is_kept[worst] = false;
    }
    // Beside the taps that are left, one that was judged early may agree after all.
    let found = comparison.departures(&is_kept, Reference::OfOthers);
    let departing = (0..taps.len()).filter(|tap| !is_kept[*tap] || protected[*tap]);
    let departing = departing.filter_map(|tap| {
        let Limit { others, limit } = found.limit(tap, &is_kept);
        let departure = found.departure[tap];
        (departure > limit).then_some(Departing {
            tap,
            departure,
            others,
            limit,
        })
    });
    Choice {
        departing: departing.collect(),
        of_other_level: (0..taps.len())
            .filter(|tap| is_of_other_level[*tap])
            .filter(|tap| found.departure[*tap] > found.limit(*tap, &is_kept).limit)
            .count(),
        disagreement: comparison
            .departures(&is_kept, Reference::OfAll)
            .groups(&is_kept, peaks),
    }
}

/// Returns true if a peak lies far above or below all others.
fn lies_beyond(peak: f64, others: impl Iterator<Item = f64>) -> bool {
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for other in others {
        low = low.min(other);
        high = high.max(other);
    }
    low <= high && (peak > OTHER_LEVEL * high || OTHER_LEVEL * peak < low)
}

/// Times the median departure of the others at which one of `taps` taps departs.
fn times(taps: usize) -> f64 {
    TIMES + TIMES_OF_FEW / (taps as f64 - 2.0)
}

/// Taps over which the medians are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reference {
    /// The kept ones but the one that is judged, so that it does not judge itself.
    OfOthers,
    /// All kept ones, so that what is left of two taps can be compared.
    OfAll,
}

/// Limit of one tap's departure.
struct Limit {
    /// Median departure of the other kept taps (1).
    others: f64,
    /// A tap departs beyond it (1).
    limit: f64,
}

/// Taps that are compared, and where.
struct Comparison<'a> {
    octaves: &'a [Octave],
    taps: &'a [TapResponse],
    /// Lines that the force excites, by octave.
    lines: Vec<Vec<usize>>,
    /// Number of responses.
    sensors: usize,
}

impl<'a> Comparison<'a> {
    fn new(octaves: &'a [Octave], taps: &'a [TapResponse]) -> Self {
        let mut powers = Vec::with_capacity(octaves.len());
        let mut largest = 0.0_f64;
        for (number, octave) in octaves.iter().enumerate() {
            let power: Vec<f64> = (0..octave.points)
                .map(|line| {
                    let of_taps = taps.iter().map(|tap| tap.force[number][line].norm_sqr());
                    median(&mut of_taps.collect::<Vec<f64>>())
                })
                .collect();
            largest = power.iter().copied().fold(largest, f64::max);
            powers.push(power);
        }
        let excited = |power: &Vec<f64>| {
            let lines = (0..power.len()).filter(|line| power[*line] > EXCITED * largest);
            lines.collect()
        };
        Comparison {
            octaves,
            taps,
            lines: powers.iter().map(excited).collect(),
            sensors: taps[0].responses.len(),
        }
    }

    /// Departures of all taps from the medians of the kept ones.
    fn departures(&self, is_kept: &[bool], reference: Reference) -> Departures {
        let mut cells: Vec<Vec<Cell>> = self.taps.iter().map(|_| Vec::new()).collect();
        for (number, octave) in self.octaves.iter().enumerate() {
            let references: Vec<Vec<Vec<Complex64>>> = (0..self.sensors)
                .map(|sensor| self.references(number, sensor, is_kept, reference))
                .collect();
            let root = octave.spacing.sqrt();
            for (index, tap) in self.taps.iter().enumerate() {
                let own: Vec<&[Complex64]> = references
                    .iter()
                    .map(|of_taps| of_taps[index].as_slice())
                    .collect();
                for (sensor, part) in self.parts(number, tap, &own).into_iter().enumerate() {
                    let before = &tap.before[number][sensor];
                    let before = self.lines[number].iter().map(|line| before[*line]);
                    cells[index].push(Cell {
                        sensor,
                        whole: octave.spacing * power(&part.expected),
                        left: octave.spacing * power(&part.left),
                        disturbed: octave.spacing * before.sum::<f64>(),
                        rest: match reference {
                            Reference::OfAll => part.left.iter().map(|x| x * root).collect(),
                            Reference::OfOthers => Vec::new(),
                        },
                    });
                }
            }
        }
        let kept: Vec<usize> = (0..is_kept.len()).filter(|tap| is_kept[*tap]).collect();
        let weights = self.weights(&cells, &kept);
        let join = |cells: &[Cell], part: fn(&Cell) -> f64| -> f64 {
            let pairs = cells.iter().zip(&weights);
            let sum: f64 = pairs
                .map(|(cell, weight)| weight * cell.share(part(cell)))
                .sum();
            sum.sqrt()
        };
        Departures {
            departure: cells
                .iter()
                .map(|own| join(own, |cell| cell.left))
                .collect(),
            disturbance: cells
                .iter()
                .map(|own| join(own, |cell| cell.disturbed))
                .collect(),
            rest: cells
                .iter()
                .filter(|_| reference == Reference::OfAll)
                .map(|own| {
                    let pairs = own.iter().zip(&weights);
                    let parts = pairs.flat_map(|(cell, weight)| {
                        let factor = cell.share(*weight).sqrt();
                        cell.rest.iter().map(move |x| x * factor)
                    });
                    parts.collect()
                })
                .collect(),
        }
    }

    /// Weights of the cells, which add up to one. Cells where the sensor responds much count more, those with
    /// much scatter or disturbance less.
    fn weights(&self, cells: &[Vec<Cell>], kept: &[usize]) -> Vec<f64> {
        let count = cells[0].len();
        let of_kept = |cell: usize, part: &dyn Fn(&Cell) -> f64| -> f64 {
            median(
                &mut kept
                    .iter()
                    .map(|tap| part(&cells[*tap][cell]))
                    .collect::<Vec<f64>>(),
            )
        };
        let powers: Vec<f64> = (0..count)
            .map(|cell| of_kept(cell, &|one| one.whole))
            .collect();
        let mut of_sensors = vec![0.0; self.sensors];
        for (cell, power) in cells[0].iter().zip(&powers) {
            of_sensors[cell.sensor] += power;
        }
        let mut weights = Vec::with_capacity(count);
        for (number, cell) in cells[0].iter().enumerate() {
            let scatter = of_kept(number, &|one| one.share(one.left));
            let disturbed = of_kept(number, &|one| one.share(one.disturbed));
            let whole = of_sensors[cell.sensor];
            weights.push(match whole > 0.0 {
                true => {
                    powers[number]
                        / whole
                        / (FLOOR * FLOOR + scatter + AGAINST_DISTURBANCE * disturbed)
                }
                false => 0.0,
            });
        }
        let total: f64 = weights.iter().sum();
        if total > 0.0 {
            weights.iter_mut().for_each(|weight| *weight /= total);
        }
        weights
    }

    /// Frequency response by which each tap is judged: medians of real and imaginary parts over kept taps, on the excited
    /// lines of an octave.
    fn references(
        &self,
        octave: usize,
        sensor: usize,
        is_kept: &[bool],
        reference: Reference,
    ) -> Vec<Vec<Complex64>> {
        let mut references = vec![Vec::new(); self.taps.len()];
        let mut parts = [Vec::new(), Vec::new()];
        for &line in &self.lines[octave] {
            parts.iter_mut().for_each(Vec::clear);
            for (tap, _) in self.taps.iter().zip(is_kept).filter(|(_, kept)| **kept) {
                let value = tap.responses[sensor][octave][line] / tap.force[octave][line];
                parts[0].push(value.re);
                parts[1].push(value.im);
            }
            let [re, im] = [&parts[0], &parts[1]].map(|values| Sorted::of(values));
            let mut place = 0;
            for (one, &kept) in references.iter_mut().zip(is_kept) {
                let left_out = (kept && reference == Reference::OfOthers).then_some(place);
                place += usize::from(kept);
                one.push(Complex64::new(re.median(left_out), im.median(left_out)));
            }
        }
        references
    }

    /// What is expected of each sensor after a tap in one octave, and what is left when a small common change of frequency
    /// and damping is taken out.
    fn parts(&self, octave: usize, tap: &TapResponse, references: &[&[Complex64]]) -> Vec<Part> {
        let lines = &self.lines[octave];
        let force: Vec<Complex64> = lines.iter().map(|line| tap.force[octave][*line]).collect();
        let mut parts = Vec::with_capacity(references.len());
        let mut slopes = Vec::with_capacity(references.len());
        let (mut product, mut square) = (Complex64::ZERO, 0.0);
        for (sensor, reference) in references.iter().enumerate() {
            let pairs = reference.iter().zip(&force);
            let expected: Vec<Complex64> = pairs.map(|(h, f)| h * f).collect();
            let measured = lines
                .iter()
                .map(|line| tap.responses[sensor][octave][*line]);
            let left: Vec<Complex64> = measured.zip(&expected).map(|(x, m)| x - m).collect();
            // Slope of the reference over frequency, where the neighbouring lines are excited as well.
            let mut slope = vec![Complex64::ZERO; lines.len()];
            for at in 1..lines.len().saturating_sub(1) {
                if lines[at + 1] - lines[at - 1] == 2 {
                    let step = 2.0 * self.octaves[octave].spacing;
                    slope[at] = force[at] * (reference[at + 1] - reference[at - 1]) / step;
                }
            }
            let power = power(&expected);
            if power > 0.0 {
                for (slope, left) in slope.iter().zip(&left) {
                    product += slope.conj() * left / power;
                    square += slope.norm_sqr() / power;
                }
            }
            parts.push(Part { expected, left });
            slopes.push(slope);
        }
        if square > 0.0 {
            let change = product / square;
            // A shift by d changes H(f) to H(f - d); more damping moves f along the imaginary axis.
            let middle = self.octaves[octave].middle();
            let (shift, damping) = (MOST_SHIFT * middle, MOST_DAMPING * middle);
            let change = Complex64::new(
                change.re.clamp(-shift, shift),
                change.im.clamp(-damping, damping),
            );
            for (part, slope) in parts.iter_mut().zip(&slopes) {
                for (left, slope) in part.left.iter_mut().zip(slope) {
                    *left -= change * slope;
                }
            }
        }
        parts
    }
}

/// Squared norms of one sensor's response to one tap in an octave.
struct Cell {
    /// Its place among the responses.
    sensor: usize,
    /// Of the expected response.
    whole: f64,
    /// Of what the reference does not explain.
    left: f64,
    /// Of what the sensor did before the tap.
    disturbed: f64,
    /// What the reference does not explain, by lines; empty for [`Reference::OfOthers`].
    rest: Vec<Complex64>,
}

impl Cell {
    /// A squared norm relative to that of the expected response.
    fn share(&self, part: f64) -> f64 {
        match self.whole > 0.0 {
            true => part / self.whole,
            false => 0.0,
        }
    }
}

fn power(values: &[Complex64]) -> f64 {
    values.iter().map(Complex64::norm_sqr).sum()
}

/// Response of one sensor to one tap in an octave.
struct Part {
    /// By the reference.
    expected: Vec<Complex64>,
    /// What the reference does not explain.
    left: Vec<Complex64>,
}

/// Sorted values, and the rank of each.
struct Sorted {
    values: Vec<f64>,
    ranks: Vec<usize>,
}

impl Sorted {
    fn of(values: &[f64]) -> Self {
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        let mut ranks = vec![0; values.len()];
        for (rank, &place) in order.iter().enumerate() {
            ranks[place] = rank;
        }
        Sorted {
            values: order.iter().map(|place| values[*place]).collect(),
            ranks,
        }
    }

    /// Median of all values, or of those without one, given by its place.
    fn median(&self, left_out: Option<usize>) -> f64 {
        let rank = left_out.map_or(usize::MAX, |place| self.ranks[place]);
        let count = self.values.len() - usize::from(left_out.is_some());
        let value = |place: usize| self.values[place + usize::from(place >= rank)];
        match count % 2 {
            1 => value(count / 2),
            _ => 0.5 * (value(count / 2 - 1) + value(count / 2)),
        }
    }
}

impl Departures {
    /// Limit for a tap, by the departures of the other kept ones.
    fn limit(&self, tap: usize, is_kept: &[bool]) -> Limit {
        let others = (0..is_kept.len()).filter(|other| is_kept[*other] && *other != tap);
        let mut others: Vec<f64> = others.map(|other| self.departure[other]).collect();
        let count = others.len() + 1;
        let others = median(&mut others);
        let limit = FLOOR.max(times(count) * others);
        let disturbance = self.disturbance[tap].hypot(self.usual_disturbance(is_kept));
        Limit {
            others,
            limit: limit.hypot(OF_DISTURBANCE * disturbance),
        }
    }

    /// Departure of a tap beside what changes in proportion to the logarithm of the level, as the other kept taps show it.
    fn beside_level(&self, tap: usize, is_kept: &[bool], peaks: &[f64]) -> f64 {
        let others: Vec<usize> = (0..is_kept.len())
            .filter(|other| is_kept[*other] && *other != tap)
            .collect();
        let logs = others.iter().map(|other| peaks[*other].ln());
        let middle = median(&mut logs.collect::<Vec<f64>>());
        let mut slope = vec![Complex64::ZERO; self.rest[tap].len()];
        let mut square = 0.0;
        for &other in &others {
            let level = peaks[other].ln() - middle;
            square += level * level;
            for (slope, x) in slope.iter_mut().zip(&self.rest[other]) {
                *slope += level * x;
            }
        }
        let factor = match square > 0.0 {
            true => (peaks[tap].ln() - middle) / square,
            false => 0.0,
        };
        let pairs = self.rest[tap].iter().zip(&slope);
        let left: Vec<Complex64> = pairs.map(|(x, slope)| x - factor * slope).collect();
        power(&left).sqrt()
    }

    /// Median disturbance of the kept taps, which is in what each of them is compared with.
    fn usual_disturbance(&self, is_kept: &[bool]) -> f64 {
        let kept = self
            .disturbance
            .iter()
            .zip(is_kept)
            .filter(|(_, kept)| **kept);
        median(&mut kept.map(|(one, _)| *one).collect::<Vec<f64>>())
    }

    /// The two groups into which the kept taps fall, if they do: where the longest edge of the shortest tree over all
    /// taps is far longer than the distances within either side, and neither side is a small minority.
    fn groups(&self, is_kept: &[bool], peaks: &[f64]) -> Option<Disagreement> {
        let kept: Vec<usize> = (0..is_kept.len()).filter(|tap| is_kept[*tap]).collect();
        let distance = |a: usize, b: usize| -> f64 {
            let pairs = self.rest[kept[a]].iter().zip(&self.rest[kept[b]]);
            pairs.map(|(a, b)| (a - b).norm_sqr()).sum::<f64>().sqrt()
        };
        // Prim's tree: each tap is joined to the nearest of those that are in the tree.
        let count = kept.len();
        let mut nearest: Vec<(f64, usize)> = (0..count).map(|tap| (distance(tap, 0), 0)).collect();
        let mut edges = Vec::with_capacity(count);
        let mut is_joined = vec![false; count];
        is_joined[0] = true;
        for _ in 1..count {
            let free = (0..count).filter(|tap| !is_joined[*tap]);
            let next = free.min_by(|a, b| nearest[*a].0.total_cmp(&nearest[*b].0))?;
            is_joined[next] = true;
            edges.push((nearest[next].0, nearest[next].1, next));
            for tap in (0..count).filter(|tap| !is_joined[*tap]) {
                let length = distance(tap, next);
                if length < nearest[tap].0 {
                    nearest[tap] = (length, next);
                }
            }
        }
        let longest = (0..edges.len()).max_by(|a, b| edges[*a].0.total_cmp(&edges[*b].0))?;
        let apart = edges[longest].0;
        // Edges stand in the order in which taps were joined, so that one pass finds all beyond the longest.
        let mut is_beyond = vec![false; count];
        for (number, &(_, from, to)) in edges.iter().enumerate() {
            is_beyond[to] = number == longest || is_beyond[from];
        }
        let mut sides = [Vec::new(), Vec::new()];
        for tap in 0..count {
            sides[usize::from(is_beyond[tap])].push(tap);
        }
        let smaller = sides[0].len().min(sides[1].len());
        if ONE_IN * smaller <= count {
            return None;
        }
        let mut within = 0.0_f64;
        for side in &sides {
            let mut own = Vec::new();
            for (place, &a) in side.iter().enumerate() {
                own.extend(side[..place].iter().map(|&b| distance(a, b)));
            }
            within = within.max(median(&mut own));
        }
        // Distances of two taps are larger than departures from a median by the square root of two.
        let times = TIMES_OF_GROUPS * count as f64 / (count as f64 - 3.0);
        let limit = (2f64.sqrt() * FLOOR).max(times * within / 2f64.sqrt());
        let disturbance = OF_DISTURBANCE * self.usual_disturbance(is_kept);
        if apart <= limit.hypot(2f64.sqrt() * disturbance) {
            return None;
        }
        let level = |side: &Vec<usize>| {
            median(
                &mut side
                    .iter()
                    .map(|&tap| peaks[kept[tap]])
                    .collect::<Vec<f64>>(),
            )
        };
        let [one, other] = [level(&sides[0]), level(&sides[1])];
        Some(Disagreement::Groups {
            sizes: [count - smaller, smaller],
            apart,
            level: one.max(other) / one.min(other),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_the_median_without_one_is_that_of_the_others() {
        let mut state = 1_u32;
        for count in 3..10 {
            let values: Vec<f64> = (0..count)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    // Five values, so that some are equal.
                    f64::from(state >> 16) % 5.0
                })
                .collect();
            let sorted = Sorted::of(&values);
            for place in 0..count {
                let mut others = values.clone();
                others.remove(place);
                others.sort_by(f64::total_cmp);
                let middle = [(others.len() - 1) / 2, others.len() / 2].map(|at| others[at]);
                let mean = 0.5 * (middle[0] + middle[1]);
                assert_eq!(sorted.median(Some(place)), mean, "{values:?}");
            }
        }
    }
}
