//! Which equation each motion of each node has.
//!
//! About a lap joint the order is chosen so that merged motions stay within the half-bandwidth of an
//! element: left end's own, shared, right end's own.

use super::{Body, Specimen};

/// Equation of a motion that does not exist.
pub(super) const HELD: usize = usize::MAX;

/// Equations of a specimen's motions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Numbering {
    /// For each node displacement and rotation.
    pub(super) nodes: Vec<[usize; 2]>,
    /// Rotation of the base.
    pub(super) base: Option<usize>,
    /// Number of equations.
    pub(super) size: usize,
}

impl Numbering {
    /// `elements` of each beam; `base` whether the fixture has a motion of its own.
    pub(super) fn new(specimen: &Specimen, elements: &[usize], base: Option<()>) -> Self {
        let rigid = specimen.joint.stiffnesses().map(f64::is_infinite);
        let mut numbering = Self {
            nodes: Vec::new(),
            base: None,
            size: 0,
        };
        numbering.base = base.map(|()| numbering.next());
        match specimen.body {
            Body::One(_) => {
                let first = [0, 1].map(|motion| {
                    if rigid[motion] {
                        HELD
                    } else {
                        numbering.next()
                    }
                });
                numbering.nodes.push(first);
                numbering.run(elements[0]);
            }
            Body::Joined(_) => {
                numbering.run(elements[0]);
                let (left, right) = numbering.joined(rigid);
                numbering.nodes.extend([left, right]);
                numbering.run(elements[1]);
            }
        }
        numbering
    }

    fn next(&mut self) -> usize {
        self.size += 1;
        self.size - 1
    }

    fn run(&mut self, nodes: usize) {
        for _ in 0..nodes {
            let node = [self.next(), self.next()];
            self.nodes.push(node);
        }
    }

    /// The two nodes of a lap joint.
    fn joined(&mut self, rigid: [bool; 2]) -> ([usize; 2], [usize; 2]) {
        let mut left = [HELD; 2];
        for motion in [0, 1].into_iter().filter(|&motion| !rigid[motion]) {
            left[motion] = self.next();
        }
        for motion in [0, 1].into_iter().filter(|&motion| rigid[motion]) {
            left[motion] = self.next();
        }
        let mut right = left;
        for motion in [0, 1].into_iter().filter(|&motion| !rigid[motion]) {
            right[motion] = self.next();
        }
        (left, right)
    }
}
