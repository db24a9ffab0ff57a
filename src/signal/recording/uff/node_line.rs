//! The nodes of mode shapes along a straight beam: their places on it, and the shapes across it.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use num_complex::Complex64;

use super::mode_shapes::{ModeShapes, NodalMode};

/// Nodes lie on one straight line where none is farther from it than this share of its length (1).
const STRAIGHT: f64 = 0.01;
/// A mode moves across the line as the others do where at least this share of its motion squared has their direction (1):
/// a sensor's cross axis and a bar that is turned by some degrees leave most of it.
const OWN_DIRECTION: f64 = 0.5;

/// Nodes on one straight line, and the shapes of the modes there.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeLine {
    /// The nodes in their order along the line.
    pub nodes: Vec<PlacedNode>,
    /// Direction of the modes' motion, "X", "Y" or "Z".
    pub direction: &'static str,
    /// Shape of each mode at the nodes, displacements over the largest (1); empty for a mode that the file gives no shape,
    /// or that moves in another direction.
    pub shapes: Vec<Vec<ShapeAtNode>>,
    /// Indices of the modes that move in another direction.
    pub other_direction: Vec<usize>,
}

/// A node and its place along the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedNode {
    /// Number of the node.
    pub number: i64,
    /// Distance from the first node along the line (m).
    pub distance: f64,
}

/// A mode shape at one node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeAtNode {
    /// Place of the node in [`NodeLine::nodes`].
    pub node: usize,
    /// Displacement over the largest of the mode (1).
    pub value: f64,
}

/// Reasons why nodes lie on no line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoLine {
    /// The file has no shapes.
    #[error("the file has no displacements at its nodes")]
    NoShapes,
    /// Fewer than two nodes with a shape have a place.
    #[error(
        "fewer than 2 of its nodes have a shape and a place; export the nodes as well (dataset 15 or 2411)"
    )]
    NoPlaces,
    /// Nodes in several coordinate systems.
    #[error("its nodes are stated in several coordinate systems; export them in the global one")]
    SeveralSystems,
    /// A node beside the line.
    #[error(
        "its nodes lie on no straight line: node {node} is {share:.0} % of the line's length beside that from node {from} to node {to}; allowed: up to 1 %; export the nodes of one line along the beam"
    )]
    NotStraight {
        /// The node that is farthest from the line.
        node: i64,
        /// Its distance from the line over the line's length (%).
        share: f64,
        /// Node at one end.
        from: i64,
        /// Node at the other end.
        to: i64,
    },
    /// The node that was named is no end of the line.
    #[error("node {number} is no end of the line of nodes; allowed: {from} or {to}")]
    NotAtEnd {
        /// The node that was named.
        number: i64,
        /// Node at one end.
        from: i64,
        /// Node at the other end.
        to: i64,
    },
}

impl ModeShapes {
    /// Returns the nodes with a shape along their line, from the end that node `first` makes, and the shapes there.
    /// Without `first` the line begins at the end with the smaller number.
    ///
    /// # Errors
    /// [`NoLine`] where the nodes have no shape, no place or no line, or `first` is no end of it.
    pub fn along_line(&self, first: Option<i64>) -> Result<NodeLine, NoLine> {
        let shaped: BTreeSet<i64> = self
            .modes
            .iter()
            .flat_map(|mode| mode.shape.keys().copied())
            .collect();
        if shaped.is_empty() {
            return Err(NoLine::NoShapes);
        }
        let mut placed = Vec::with_capacity(shaped.len());
        let mut systems = BTreeSet::new();
        for number in shaped {
            if let Some(node) = self.nodes.get(&number) {
                systems.insert(node.system);
                placed.push((number, Vector3::from(node.place)));
            }
        }
        // The two ends: the node farthest from any, and the node farthest from that.
        let some = placed.first().ok_or(NoLine::NoPlaces)?.1;
        let one = farthest(&placed, some);
        let other = farthest(&placed, one.1);
        let length = (other.1 - one.1).norm();
        if length <= 0.0 || !length.is_finite() {
            return Err(NoLine::NoPlaces);
        }
        if systems.len() > 1 {
            return Err(NoLine::SeveralSystems);
        }
        let (from, to) = (one.0.min(other.0), one.0.max(other.0));
        let first = first.unwrap_or(from);
        let (begin, end) = match first {
            first if first == one.0 => (one.1, other.1),
            first if first == other.0 => (other.1, one.1),
            number => return Err(NoLine::NotAtEnd { number, from, to }),
        };
        let axis = (end - begin) / length;
        let mut nodes = Vec::with_capacity(placed.len());
        let mut worst = (0.0, from);
        for (number, place) in placed {
            let along = axis.dot(&(place - begin));
            let beside = (place - begin - along * axis).norm() / length;
            if beside > worst.0 {
                worst = (beside, number);
            }
            nodes.push(PlacedNode {
                number,
                distance: along,
            });
        }
        if worst.0 > STRAIGHT {
            return Err(NoLine::NotStraight {
                node: worst.1,
                share: 100.0 * worst.0,
                from,
                to,
            });
        }
        nodes.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        Ok(self.shapes_across(nodes, axis))
    }

    /// Takes the shapes in that direction of X, Y and Z across the line in which the modes move most.
    fn shapes_across(&self, nodes: Vec<PlacedNode>, axis: Vector3<f64>) -> NodeLine {
        let real: Vec<Vec<(usize, [f64; 3])>> = self
            .modes
            .iter()
            .map(|mode| real_shape(mode, &nodes))
            .collect();
        let mut motion = [0.0; 3];
        for shape in &real {
            for (sum, share) in motion.iter_mut().zip(shares(shape)) {
                *sum += share;
            }
        }
        let along = (0..3)
            .max_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs()))
            .unwrap_or(0);
        let across = (0..3)
            .filter(|direction| *direction != along)
            .max_by(|a, b| motion[*a].total_cmp(&motion[*b]))
            .unwrap_or(0);
        let mut line = NodeLine {
            nodes,
            direction: ["X", "Y", "Z"][across],
            shapes: Vec::with_capacity(real.len()),
            other_direction: Vec::new(),
        };
        for (index, shape) in real.iter().enumerate() {
            let largest = shape.iter().fold(0.0_f64, |largest, (_, value)| {
                largest.max(value[across].abs())
            });
            if shape.is_empty() {
                line.shapes.push(Vec::new());
            } else if shares(shape)[across] < OWN_DIRECTION || largest <= 0.0 {
                line.other_direction.push(index);
                line.shapes.push(Vec::new());
            } else {
                let values = shape.iter().map(|(node, value)| ShapeAtNode {
                    node: *node,
                    value: value[across] / largest,
                });
                line.shapes.push(values.collect());
            }
        }
        line
    }
}

/// Real shape of a mode at the nodes, which it has by their places: a complex one is turned by the phase that makes its
/// imaginary part least. Values are over the largest, so that their squares stay finite.
fn real_shape(mode: &NodalMode, nodes: &[PlacedNode]) -> Vec<(usize, [f64; 3])> {
    let mut values = Vec::new();
    let mut largest = 0.0_f64;
    for (place, node) in nodes.iter().enumerate() {
        if let Some(value) = mode.shape.get(&node.number) {
            largest = value.iter().fold(largest, |most, part| {
                most.max(part.re.abs()).max(part.im.abs())
            });
            values.push((place, *value));
        }
    }
    // The inverse of less is infinite.
    if largest < f64::MIN_POSITIVE {
        return Vec::new();
    }
    let parts = values.iter().flat_map(|(_, value)| value);
    let squares: Complex64 = parts.map(|part| (part / largest).powi(2)).sum();
    let turn = Complex64::from_polar(1.0 / largest, -0.5 * squares.arg());
    let real = values.into_iter();
    real.map(|(node, value)| (node, value.map(|part| (part * turn).re)))
        .collect()
}

/// Shares (1) of the directions in the squares of a shape.
fn shares(shape: &[(usize, [f64; 3])]) -> [f64; 3] {
    let mut squares = [0.0; 3];
    for (_, value) in shape {
        for (sum, part) in squares.iter_mut().zip(value) {
            *sum += part * part;
        }
    }
    let whole: f64 = squares.iter().sum();
    squares.map(|square| if whole > 0.0 { square / whole } else { 0.0 })
}

/// The node farthest from a place.
fn farthest(nodes: &[(i64, Vector3<f64>)], place: Vector3<f64>) -> (i64, Vector3<f64>) {
    let far = nodes
        .iter()
        .max_by(|a, b| (a.1 - place).norm().total_cmp(&(b.1 - place).norm()));
    far.copied().unwrap_or((0, place))
}
