//! Motions of a specimen that is divided into elements, and the numbers of their equations.

use super::element::Ends;
use super::{Body, Specimen};
use crate::WidthStiffening;

/// Equation of a motion that does not exist; larger than the number of any that does.
pub(super) const HELD: usize = usize::MAX;

/// Index of the curvature across the width among a node's motions, and among the joint's.
pub(crate) const ACROSS: usize = 2;

/// Equations of a specimen's motions.
///
/// About a lap joint the order is chosen so that merged motions stay within the half-bandwidth of an
/// element: left end's own, shared, right end's own.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Numbering {
    /// For each node displacement, rotation, and curvature across the width.
    pub(super) nodes: Vec<[usize; 3]>,
    /// Whether nodes have a curvature across the width.
    pub(super) stiffened: bool,
    /// Rotation of the base.
    pub(super) base: Option<usize>,
    /// Displacement of each resonator.
    pub(super) resonators: Vec<usize>,
    /// Number of equations.
    pub(super) size: usize,
}

impl Numbering {
    /// `elements` of each beam; `has_base` where the fixture has a motion of its own; `resonators` are the near nodes of
    /// the elements on which they stand.
    pub(super) fn new(
        specimen: &Specimen,
        elements: &[usize],
        has_base: bool,
        resonators: &[usize],
    ) -> Self {
        let [kt, kr] = specimen.joint_stiffnesses().map(f64::is_infinite);
        let held = match specimen.width_stiffening {
            WidthStiffening::HeldAtJoint => specimen.joint.is_some(),
            WidthStiffening::SprungAtJoint => kt,
            WidthStiffening::FreeAtJoint | WidthStiffening::Ignored => false,
        };
        let rigid = [kt, kr, held];
        let mut numbering = Self {
            stiffened: specimen.is_stiffened(),
            nodes: Vec::new(),
            base: None,
            resonators: vec![HELD; resonators.len()],
            size: 0,
        };
        if has_base {
            numbering.base = Some(numbering.next());
        }
        match specimen.body {
            Body::One(_) => {
                let mut first = [HELD; 3];
                for motion in numbering.motions().filter(|&motion| !rigid[motion]) {
                    first[motion] = numbering.next();
                }
                numbering.add_node(first, resonators);
                numbering.add_nodes(elements[0], resonators);
            }
            Body::Joined(_) => {
                numbering.add_nodes(elements[0], resonators);
                // The two nodes of the joint.
                let mut left = [HELD; 3];
                for shared in [false, true] {
                    for motion in numbering
                        .motions()
                        .filter(|&motion| rigid[motion] == shared)
                    {
                        left[motion] = numbering.next();
                    }
                }
                let mut right = left;
                for motion in numbering.motions().filter(|&motion| !rigid[motion]) {
                    right[motion] = numbering.next();
                }
                numbering.add_node(left, resonators);
                numbering.add_node(right, resonators);
                numbering.add_nodes(elements[1], resonators);
            }
        }
        numbering
    }

    fn next(&mut self) -> usize {
        self.size += 1;
        self.size - 1
    }

    /// Motions of a node that exist.
    fn motions(&self) -> std::ops::Range<usize> {
        0..if self.stiffened { 3 } else { 2 }
    }

    fn add_nodes(&mut self, count: usize, resonators: &[usize]) {
        for _ in 0..count {
            let mut node = [HELD; 3];
            for motion in self.motions() {
                node[motion] = self.next();
            }
            self.add_node(node, resonators);
        }
    }

    /// Adds a node, and the motion of a resonator on the element behind it.
    fn add_node(&mut self, node: [usize; 3], resonators: &[usize]) {
        let number = self.nodes.len();
        self.nodes.push(node);
        for (index, _) in resonators.iter().enumerate().filter(|one| *one.1 == number) {
            self.resonators[index] = self.next();
        }
    }

    /// Equations of the ends of the element behind a node, as [`Motion::ends`].
    pub(super) fn equations_behind(&self, node: usize) -> [usize; 4] {
        let [near, far] = [self.nodes[node], self.nodes[node + 1]];
        [near[0], near[1], far[0], far[1]]
    }

    /// A vector of the equations as motions of the nodes.
    pub(crate) fn motion(&self, vector: &[f64]) -> Motion {
        // The equation of a motion that does not exist is behind the last one.
        let nodes = self.nodes.iter();
        Motion {
            nodes: nodes
                .map(|node| node.map(|row| vector.get(row).copied().unwrap_or(0.0)))
                .collect(),
            base: self.base.map(|row| vector[row]),
            resonators: self.resonators.iter().map(|row| vector[*row]).collect(),
        }
    }

    /// The equations' vector of a motion.
    pub(super) fn vector(&self, motion: &Motion) -> Vec<f64> {
        let mut vector = vec![0.0; self.size];
        let nodes = self.nodes.iter().zip(&motion.nodes);
        let moved = nodes.flat_map(|(rows, values)| rows.iter().copied().zip(*values));
        let base = self.base.zip(motion.base);
        let resonators = self.resonators.iter().copied();
        let resonators = resonators.zip(motion.resonators.iter().copied());
        for (row, value) in moved.chain(base).chain(resonators) {
            if row != HELD {
                vector[row] = value;
            }
        }
        vector
    }
}

/// Displacement, rotation and curvature across the width of every node, and the rotation of the base.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Motion {
    pub(super) nodes: Vec<[f64; 3]>,
    /// `None` where the base does not move on its own.
    pub(super) base: Option<f64>,
    /// Displacement of each resonator.
    pub(super) resonators: Vec<f64>,
}

impl Motion {
    /// Returns self + factor other.
    pub(super) fn plus(&self, factor: f64, other: &Self) -> Self {
        let mut sum = self.clone();
        for (node, other) in sum.nodes.iter_mut().zip(&other.nodes) {
            *node = std::array::from_fn(|i| node[i] + factor * other[i]);
        }
        if let Some(turn) = &mut sum.base {
            *turn += factor * other.base.unwrap_or(0.0);
        }
        for (own, other) in sum.resonators.iter_mut().zip(&other.resonators) {
            *own += factor * other;
        }
        sum
    }

    pub(super) fn scaled(mut self, factor: f64) -> Self {
        let values = self.nodes.as_flattened_mut().iter_mut();
        values
            .chain(&mut self.base)
            .chain(&mut self.resonators)
            .for_each(|value| *value *= factor);
        self
    }

    /// Motions of both ends of the element behind a node.
    pub(crate) fn ends(&self, node: usize) -> [f64; 4] {
        let ([w0, t0, _], [w1, t1, _]) = (self.nodes[node], self.nodes[node + 1]);
        [w0, t0, w1, t1]
    }

    /// The same, with the curvatures across the width.
    pub(super) fn all_ends(&self, node: usize) -> Ends {
        let ([w0, t0, a0], [w1, t1, a1]) = (self.nodes[node], self.nodes[node + 1]);
        [w0, t0, w1, t1, a0, a1]
    }
}
