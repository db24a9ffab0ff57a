//! Labels in one row above a panel, none over another.

/// Moves label centres as little as possible so that none overlaps and all stay between `bounds`.
///
/// `centers` are ascending wishes and `widths` the labels' widths (pixels), `gap` the least space
/// between two. Minimises the sum of squared moves (isotonic regression by pooling neighbours).
/// Returns `None` when the labels do not fit.
pub fn spread(centers: &[f64], widths: &[f64], gap: f64, bounds: (f64, f64)) -> Option<Vec<f64>> {
    let count = centers.len().min(widths.len());
    let total: f64 = widths.iter().take(count).sum::<f64>() + gap * (count.max(1) - 1) as f64;
    if total > bounds.1 - bounds.0 {
        return None;
    }
    // Measured from where each label would be if all stood side by side, "no overlap" means "not
    // descending".
    let offsets = side_by_side(widths, gap, count);
    let wishes: Vec<f64> = centers.iter().zip(&offsets).map(|(c, o)| c - o).collect();
    let highest = bounds.1 - total;
    let pooled = pool(&wishes);
    Some(
        pooled
            .iter()
            .zip(&offsets)
            .map(|(shift, offset)| shift.clamp(bounds.0, highest) + offset)
            .collect(),
    )
}

/// Centres of labels standing side by side from 0.
fn side_by_side(widths: &[f64], gap: f64, count: usize) -> Vec<f64> {
    let mut left = 0.0;
    widths
        .iter()
        .take(count)
        .map(|width| {
            let center = left + width / 2.0;
            left += width + gap;
            center
        })
        .collect()
}

/// The ascending sequence nearest to `wishes`: neighbours out of order share their mean.
fn pool(wishes: &[f64]) -> Vec<f64> {
    let mut groups: Vec<(f64, usize)> = Vec::new();
    for wish in wishes {
        let mut group = (*wish, 1);
        while let Some(before) = groups.last().copied().filter(|before| before.0 > group.0) {
            groups.pop();
            let count = before.1 + group.1;
            let sum = before.0 * before.1 as f64 + group.0 * group.1 as f64;
            group = (sum / count as f64, count);
        }
        groups.push(group);
    }
    groups
        .into_iter()
        .flat_map(|(mean, count)| std::iter::repeat_n(mean, count))
        .collect()
}
