//! The answer of a specimen to static forces, rigid motions left out.

use super::band::{Band, Factor};
use super::modes::SHIFT;
use crate::structure::StructureError;

/// What static answers need.
#[derive(Debug, Clone)]
pub(super) struct Statics {
    factor: Factor,
    /// Rigid motions of unit modal mass, with their inertia loads; empty where there are none.
    rigid: Vec<(Vec<f64>, Vec<f64>)>,
    mass: Band,
    shift: f64,
}

impl Statics {
    pub(super) fn new(
        stiffness: &Band,
        mass: Band,
        rigid: Vec<Vec<f64>>,
    ) -> Result<Self, StructureError> {
        // A hundredth of the first elastic eigenvalue: each step of `solve` gains two digits.
        let shift = if rigid.is_empty() { 0.0 } else { 0.01 * SHIFT };
        let factor = stiffness.plus(shift, &mass).cholesky().ok_or_else(|| {
            StructureError::FiniteElements {
                reason: "it is not stable: the axial force buckles it".to_owned(),
            }
        })?;
        let with_load = |vector: Vec<f64>| {
            let load = mass.times(&vector);
            (vector, load)
        };
        Ok(Self {
            factor,
            rigid: rigid.into_iter().map(with_load).collect(),
            mass,
            shift,
        })
    }

    /// Elastic answer to a load: with rigid motions, to the load less the inertia forces with which
    /// they balance it.
    pub(super) fn solve(&self, mut load: Vec<f64>) -> Vec<f64> {
        for (motion, inertia) in &self.rigid {
            let share: f64 = motion.iter().zip(&load).map(|(a, b)| a * b).sum();
            load.iter_mut()
                .zip(inertia)
                .for_each(|(f, i)| *f -= share * i);
        }
        let mut answer = self.solved(load.clone());
        if self.rigid.is_empty() {
            return answer;
        }
        // (K + s M) x = f + s M x: what the shift takes away is given back step by step.
        const STEPS: usize = 8;
        for _ in 0..STEPS {
            self.remove_rigid(&mut answer);
            let mut corrected = self.mass.times(&answer);
            for (value, force) in corrected.iter_mut().zip(&load) {
                *value = self.shift * *value + force;
            }
            answer = self.solved(corrected);
        }
        self.remove_rigid(&mut answer);
        answer
    }

    fn solved(&self, mut load: Vec<f64>) -> Vec<f64> {
        self.factor.solve_lower(&mut load);
        self.factor.solve_upper(&mut load);
        load
    }

    fn remove_rigid(&self, vector: &mut [f64]) {
        for (motion, inertia) in &self.rigid {
            let share: f64 = inertia.iter().zip(vector.iter()).map(|(a, b)| a * b).sum();
            vector
                .iter_mut()
                .zip(motion)
                .for_each(|(x, m)| *x -= share * m);
        }
    }
}
