//! Curves reduced to what a picture can show, without losing a peak.

use super::drawing::Point;

/// Reduces a curve, ascending in x (pixels), to at most four points for each column of pixels: the
/// first, the lowest, the highest and the last, in their order.
///
/// What is drawn is the same; a peak of one sample stays. Points that are not finite are left out.
pub fn decimate(points: impl IntoIterator<Item = Point>) -> Vec<Point> {
    let mut reduced = Vec::new();
    let mut column: Option<Column> = None;
    let finite = points
        .into_iter()
        .filter(|(x, y)| x.is_finite() && y.is_finite());
    for point in finite {
        match &mut column {
            Some(open) if open.number == point.0.floor() => open.take(point),
            _ => {
                if let Some(full) = column.replace(Column::new(point)) {
                    full.write(&mut reduced);
                }
            }
        }
    }
    if let Some(last) = column {
        last.write(&mut reduced);
    }
    reduced
}

/// One column of pixels; the counts say which of the extremes came first.
struct Column {
    number: f64,
    count: usize,
    first: Point,
    last: Point,
    low: (usize, Point),
    high: (usize, Point),
}

impl Column {
    fn new(point: Point) -> Column {
        Column {
            number: point.0.floor(),
            count: 0,
            first: point,
            last: point,
            low: (0, point),
            high: (0, point),
        }
    }

    fn take(&mut self, point: Point) {
        self.count += 1;
        self.last = point;
        if point.1 < self.low.1.1 {
            self.low = (self.count, point);
        }
        if point.1 > self.high.1.1 {
            self.high = (self.count, point);
        }
    }

    fn write(&self, into: &mut Vec<Point>) {
        let (earlier, later) = if self.low.0 <= self.high.0 {
            (self.low, self.high)
        } else {
            (self.high, self.low)
        };
        into.push(self.first);
        for (index, point) in [earlier, later] {
            let is_new = index > 0 && index < self.count && into.last() != Some(&point);
            if is_new {
                into.push(point);
            }
        }
        if self.count > 0 {
            into.push(self.last);
        }
    }
}
