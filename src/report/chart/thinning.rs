//! Curves with as many points as pixels can show, without losing a peak.

use std::ops::Range;

use super::drawing::Point;

/// Most points of a curve beside those about modes: two for each pixel of the page's width, so that zooming finds
/// more than the whole view shows, while five long recordings stay below the page's limit of 3 MB.
const MOST_POINTS: usize = 2000;
/// Lines kept on either side of a mode: what zooming to it shows.
const ABOUT_MODES: usize = 40;
/// Most points of a curve behind single points: it is faint, and the spectra have all of it.
const BEHIND: usize = 400;

/// Reduces a curve, ascending in x (pixels), to at most four points for each column of pixels: the
/// first, the lowest, the highest and the last, in their order.
///
/// The picture is the same; a peak of one sample stays. Points that are not finite are left out.
pub fn decimate(points: impl IntoIterator<Item = Point>) -> Vec<Point> {
    let finite = points
        .into_iter()
        .filter(|(x, y)| x.is_finite() && y.is_finite());
    let finite: Vec<Point> = finite.collect();
    let mut reduced = Vec::new();
    for column in finite.chunk_by(|before, after| before.0.floor() == after.0.floor()) {
        let (mut low, mut high) = (0, 0);
        for (index, point) in column.iter().enumerate() {
            if point.1 < column[low].1 {
                low = index;
            }
            if point.1 > column[high].1 {
                high = index;
            }
        }
        let mut kept = [0, low.min(high), low.max(high), column.len() - 1].to_vec();
        kept.dedup();
        reduced.extend(kept.into_iter().map(|index| column[index]));
    }
    reduced
}

/// At most [`BEHIND`] points: of every few the highest and the lowest, in their order.
pub(super) fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= BEHIND {
        return points;
    }
    let stride = (2 * points.len()).div_ceil(BEHIND);
    let mut kept = Vec::new();
    for some in points.chunks(stride) {
        let low = some.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = some.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let mut both: Vec<(f64, f64)> = low.into_iter().chain(high).copied().collect();
        both.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept.extend(both);
    }
    kept
}

/// Lines that are drawn in the same way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stretch {
    /// The lines.
    pub(super) lines: Range<usize>,
    /// 1: every line is a point; else so many lines become two points, the smallest and the largest value.
    pub(super) stride: usize,
}

/// All lines in their order: every one about the lines `modes`, the others thinned where they are too many.
pub(super) fn stretches(lines: usize, modes: &[usize]) -> Vec<Stretch> {
    if lines <= MOST_POINTS {
        return vec![Stretch {
            lines: 0..lines,
            stride: 1,
        }];
    }
    let stride = (2 * lines).div_ceil(MOST_POINTS);
    let mut modes = modes.to_vec();
    modes.sort_unstable();
    let mut all = Vec::new();
    let mut done = 0;
    for line in modes {
        let first = line.saturating_sub(ABOUT_MODES) / stride * stride;
        let end = (line + ABOUT_MODES + 1).div_ceil(stride) * stride;
        let (first, end) = (first.min(lines).max(done), end.min(lines).max(done));
        all.push((done..first, stride));
        all.push((first..end.max(first), 1));
        done = end.max(first);
    }
    all.push((done..lines, stride));
    let some = all.into_iter().filter(|(lines, _)| !lines.is_empty());
    some.map(|(lines, stride)| Stretch { lines, stride })
        .collect()
}

impl Stretch {
    /// First point, distance of points and their number, in lines. The two points of some lines stand at their
    /// quarters.
    pub(super) fn points(&self) -> (f64, f64, usize) {
        let first = self.lines.start as f64;
        if self.stride == 1 {
            return (first, 1.0, self.lines.len());
        }
        let half = 0.5 * self.stride as f64;
        let count = 2 * self.lines.len().div_ceil(self.stride);
        (first + 0.5 * half - 0.5, half, count)
    }

    /// The values of the points.
    pub(super) fn thinned(&self, values: &[f64]) -> Vec<f64> {
        let lines = self.lines.start.min(values.len())..self.lines.end.min(values.len());
        if self.stride == 1 {
            return values[lines].to_vec();
        }
        values[lines].chunks(self.stride).flat_map(ends).collect()
    }
}

/// Smallest and largest of some values, in the order in which they stand; none where no value is a number.
fn ends(values: &[f64]) -> [f64; 2] {
    let known = values
        .iter()
        .enumerate()
        .filter(|(_, value)| !value.is_nan());
    let low = known.clone().min_by(|a, b| a.1.total_cmp(b.1));
    let high = known.max_by(|a, b| a.1.total_cmp(b.1));
    match (low, high) {
        (Some(low), Some(high)) if low.0 <= high.0 => [*low.1, *high.1],
        (Some(low), Some(high)) => [*high.1, *low.1],
        _ => [f64::NAN; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn limit_few_lines_are_all_kept() {
        let all = stretches(MOST_POINTS, &[7]);
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].points(), (0.0, 1.0, MOST_POINTS));
    }

    #[test]
    fn limit_what_is_no_number_leaves_a_hole() {
        assert!(ends(&[f64::NAN, f64::NAN]).iter().all(|end| end.is_nan()));
        assert_eq!(ends(&[2.0, f64::NAN, 1.0]), [2.0, 1.0]);
    }

    proptest! {
        /// Every line lies in one stretch, those about modes are points at their own places, and each stretch has
        /// as many values as points.
        #[test]
        fn prop_lines_about_modes_stay_where_they_are(
            lines in 2001_usize..60_000,
            places in proptest::collection::vec(0.0_f64..1.0, 0..8),
        ) {
            let modes: Vec<usize> = places.iter().map(|x| (x * lines as f64) as usize).collect();
            let all = stretches(lines, &modes);
            prop_assert_eq!(all[0].lines.start, 0);
            prop_assert_eq!(all[all.len() - 1].lines.end, lines);
            prop_assert!(all.windows(2).all(|two| two[0].lines.end == two[1].lines.start));
            let values: Vec<f64> = (0..lines).map(|line| line as f64).collect();
            for stretch in &all {
                let (first, step, count) = stretch.points();
                let found = stretch.thinned(&values);
                prop_assert_eq!(found.len(), count);
                if stretch.stride == 1 {
                    prop_assert_eq!(found[0], first);
                    prop_assert_eq!(step, 1.0);
                }
                // The smallest and largest of some lines are their ends, half a distance from the points.
                for (point, value) in found.iter().enumerate() {
                    let at = first + step * point as f64;
                    prop_assert!((at - value).abs() <= stretch.stride as f64);
                }
            }
            for mode in modes {
                for line in mode.saturating_sub(ABOUT_MODES)..(mode + ABOUT_MODES).min(lines) {
                    let own = all.iter().find(|one| one.lines.contains(&line)).unwrap();
                    prop_assert_eq!(own.stride, 1);
                }
            }
            // Two points a stride, all lines about modes, and what rounding adds.
            let points: usize = all.iter().map(|one| one.points().2).sum();
            prop_assert!(points <= MOST_POINTS + 8 * (2 * ABOUT_MODES + 2 * 61));
        }
    }
}
