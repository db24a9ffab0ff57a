//! Room on a picture: labels that cover nothing, and curves with as many points as pixels can show.

use super::drawing::Point;

/// Moves label centres as little as possible so that none overlaps and all stay between `low` and `high`.
///
/// `centers` are ascending wishes and `widths` the labels' widths (pixels), `gap` the least space
/// between two. Minimises the sum of squared moves (isotonic regression by pooling neighbours).
/// Returns `None` when the labels do not fit.
pub fn spread(centers: &[f64], widths: &[f64], gap: f64, low: f64, high: f64) -> Option<Vec<f64>> {
    // Measured from where each label would be if all stood side by side, "no overlap" means "not
    // descending".
    let mut offsets = Vec::new();
    let mut total = 0.0;
    for width in widths.iter().take(centers.len()) {
        offsets.push(total + width / 2.0);
        total += width + gap;
    }
    total -= gap.min(total);
    if total > high - low {
        return None;
    }
    // Neighbours out of order share their mean.
    let mut groups: Vec<(f64, usize)> = Vec::new();
    for (center, offset) in centers.iter().zip(&offsets) {
        let mut group = (center - offset, 1);
        while let Some(before) = groups.pop_if(|before| before.0 > group.0) {
            let count = before.1 + group.1;
            let sum = before.0 * before.1 as f64 + group.0 * group.1 as f64;
            group = (sum / count as f64, count);
        }
        groups.push(group);
    }
    let shifts = groups
        .into_iter()
        .flat_map(|(mean, count)| std::iter::repeat_n(mean, count));
    let places = shifts
        .zip(&offsets)
        .map(|(shift, offset)| shift.clamp(low, high - total) + offset);
    Some(places.collect())
}

/// A rectangle that is taken (pixels).
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
}

/// Places of words beside a point: shares of their half width across and of a line down.
const SIDES: [Point; 8] = [
    (0.0, -1.0),
    (1.0, 0.0),
    (-1.0, 0.0),
    (0.0, 1.0),
    (0.8, -1.0),
    (-0.8, -1.0),
    (0.8, 1.0),
    (-0.8, 1.0),
];

impl Patch {
    pub(super) fn around(middle: Point, across: f64, down: f64) -> Patch {
        Patch {
            left: middle.0 - across,
            right: middle.0 + across,
            top: middle.1 - down,
            bottom: middle.1 + down,
        }
    }

    fn overlaps(&self, other: &Patch) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }

    /// The middle of words of this half width beside a point, inside this patch and clear of all others, which
    /// it joins; `None` without such a place.
    pub(super) fn beside(&self, at: Point, half: f64, taken: &mut Vec<Patch>) -> Option<Point> {
        for (across, down) in SIDES {
            let middle = (at.0 + across * (half + 11.0), at.1 + down * 17.0);
            let patch = Patch::around(middle, half + 1.0, 7.0);
            let inside = patch.left > self.left
                && patch.right < self.right
                && patch.top > self.top
                && patch.bottom < self.bottom;
            if inside && !taken.iter().any(|other| other.overlaps(&patch)) {
                taken.push(patch);
                return Some(middle);
            }
        }
        None
    }
}

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
