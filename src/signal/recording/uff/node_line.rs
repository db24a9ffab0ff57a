//! The nodes of mode shapes along a straight beam: their places on it, and the shapes across it.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use num_complex::Complex64;

use super::mode_shapes::{ModeShapes, NodalMode};

/// Nodes lie on one straight line where none is farther from it than this share of its length (1).
const STRAIGHT: f64 = 0.01;
/// Smallest share of a mode's squared motion in the common direction (1). Motion of a sensor's cross axis is far less than
/// the other half.
const OWN_DIRECTION: f64 = 0.5;
/// Largest angle between a direction and the axis that names it (degrees).
const NEAR_AXIS: f64 = 10.0;

/// Nodes on one straight line, and the shapes of the modes there.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeLine {
    /// The nodes in their order along the line.
    pub nodes: Vec<PlacedNode>,
    /// Direction of the modes' motion: "X", "Y" or "Z" within 10 degrees of that axis, else its three components.
    pub direction: String,
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
    /// Displacements in several coordinate systems.
    #[error(
        "the displacements at its nodes are stated in several coordinate systems; export them in the global one"
    )]
    SeveralDisplacementSystems,
    /// A coordinate system that the file defines.
    #[error(
        "its nodes or their displacements are stated in coordinate system {0}, which the file defines; export them in the global one, number 0"
    )]
    DefinedSystem(i64),
    /// Nodes at one place.
    #[error("its nodes have all the same place; export the nodes with their coordinates")]
    SamePlace,
    /// A node beside the line.
    #[error(
        "its nodes lie on no straight line: node {node} is off the line from node {from} to node {to} by {share:.1} % of its length; allowed: up to 1 %; export the nodes of one line along the beam"
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
    #[error("node {number} is not at an end of the line of nodes; allowed: {from} or {to}")]
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
        let (mut systems, mut displacement_systems) = (BTreeSet::new(), BTreeSet::new());
        for number in shaped {
            if let Some(node) = self.nodes.get(&number) {
                systems.insert(node.system);
                displacement_systems.insert(node.displacement_system);
                placed.push((number, Vector3::from(node.place)));
            }
        }
        // The two ends: the node farthest from any, and the node farthest from that.
        let [(_, some), _, ..] = placed[..] else {
            return Err(NoLine::NoPlaces);
        };
        let one = farthest(&placed, some);
        let other = farthest(&placed, one.1);
        let length = (other.1 - one.1).norm();
        if length <= 0.0 || !length.is_finite() {
            return Err(NoLine::SamePlace);
        }
        if systems.len() > 1 {
            return Err(NoLine::SeveralSystems);
        }
        if displacement_systems.len() > 1 {
            return Err(NoLine::SeveralDisplacementSystems);
        }
        let mut stated = systems.union(&displacement_systems);
        if let Some(&system) = stated.find(|system| **system != 0 && self.defines_systems) {
            return Err(NoLine::DefinedSystem(system));
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

    /// Takes the shapes in the direction across the line in which the modes move most.
    fn shapes_across(&self, nodes: Vec<PlacedNode>, axis: Vector3<f64>) -> NodeLine {
        let real: Vec<Vec<MotionAtNode>> = self
            .modes
            .iter()
            .map(|mode| real_shape(mode, &nodes))
            .collect();
        let mut sum = Matrix3::zeros();
        for shape in &real {
            let whole = squared_motion(shape);
            for at in shape {
                let across = at.motion - axis.dot(&at.motion) * axis;
                sum += across * across.transpose() / whole;
            }
        }
        let eigen = SymmetricEigen::new(sum);
        let mut direction = eigen
            .eigenvectors
            .column(eigen.eigenvalues.imax())
            .into_owned();
        if direction[direction.iamax()] < 0.0 {
            direction.neg_mut();
        }
        let mut line = NodeLine {
            nodes,
            direction: direction_words(direction),
            shapes: Vec::with_capacity(real.len()),
            other_direction: Vec::new(),
        };
        for (index, shape) in real.iter().enumerate() {
            let projected: Vec<f64> = shape.iter().map(|at| direction.dot(&at.motion)).collect();
            let squares: f64 = projected.iter().map(|value| value * value).sum();
            let largest = projected
                .iter()
                .fold(0.0_f64, |largest, value| largest.max(value.abs()));
            let mut values = Vec::new();
            if largest > 0.0 && squares >= OWN_DIRECTION * squared_motion(shape) {
                for (at, value) in shape.iter().zip(projected) {
                    let (node, value) = (at.node, value / largest);
                    values.push(ShapeAtNode { node, value });
                }
            } else if !shape.is_empty() {
                line.other_direction.push(index);
            }
            line.shapes.push(values);
        }
        line
    }
}

/// Real motion of a mode at one node.
struct MotionAtNode {
    /// Place of the node in the line.
    node: usize,
    /// Along X, Y and Z.
    motion: Vector3<f64>,
}

/// Real mode shape. A complex one is rotated in phase until its imaginary part is smallest. Values are over the largest,
/// so that their squares stay finite.
fn real_shape(mode: &NodalMode, nodes: &[PlacedNode]) -> Vec<MotionAtNode> {
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
    let real = values.into_iter().map(|(node, value)| MotionAtNode {
        node,
        motion: Vector3::from(value.map(|part| (part * turn).re)),
    });
    real.collect()
}

/// Sum of the squared motion of a shape.
fn squared_motion(shape: &[MotionAtNode]) -> f64 {
    shape.iter().map(|at| at.motion.norm_squared()).sum()
}

/// The axis that a unit vector is near, else its components.
fn direction_words(direction: Vector3<f64>) -> String {
    let nearest = direction.iamax();
    if direction[nearest].abs() >= NEAR_AXIS.to_radians().cos() {
        return ["X", "Y", "Z"][nearest].to_owned();
    }
    // Adding 0 removes the sign of a component that is rounded to 0.
    let [x, y, z] = [0, 1, 2].map(|axis| (10.0 * direction[axis]).round() / 10.0 + 0.0);
    format!("({x:.1}, {y:.1}, {z:.1})")
}

/// The node farthest from a place.
fn farthest(nodes: &[(i64, Vector3<f64>)], place: Vector3<f64>) -> (i64, Vector3<f64>) {
    let far = nodes
        .iter()
        .max_by(|a, b| (a.1 - place).norm().total_cmp(&(b.1 - place).norm()));
    far.copied().unwrap_or((0, place))
}
