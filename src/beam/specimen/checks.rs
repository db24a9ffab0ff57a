//! Whether a specimen can exist.

use super::{Body, Specimen, SpecimenJoint};
use crate::StructureError;

impl Specimen {
    /// Checks that every part can exist and lies on the beam.
    ///
    /// # Errors
    /// [`StructureError`], naming what is wrong.
    pub fn check(&self) -> Result<(), StructureError> {
        for beam in self.body.beams() {
            beam.check()?;
        }
        not_negative("shear and rotary inertia", self.shear_rotary)?;
        not_negative("joint mass", self.joint_mass.mass)?;
        not_negative("joint inertia", self.joint_mass.inertia)?;
        if !self.axial_force.is_finite() {
            return Err(unphysical(
                "axial force",
                self.axial_force,
                "give a finite force in N",
            ));
        }
        self.check_attachments()?;
        self.check_joint()?;
        self.check_base()
    }

    fn check_attachments(&self) -> Result<(), StructureError> {
        for mass in &self.masses {
            self.on_beam(mass.position)?;
            not_negative("point mass", mass.mass)?;
            not_negative("inertia of a point mass", mass.inertia)?;
        }
        for spring in &self.springs {
            self.on_beam(spring.position)?;
            not_negative("spring to the ground", spring.stiffness)?;
        }
        for hinge in &self.hinges {
            self.on_beam(hinge.position)?;
            not_negative("compliance of a hinge", hinge.compliance)?;
        }
        if let Some(overlap) = &self.overlap {
            not_negative("length of the overlap", overlap.length)?;
            not_negative("mass of the overlap", overlap.mass)?;
            let shorter = self.body.beams().iter().map(|beam| beam.length);
            if 0.5 * overlap.length > shorter.fold(f64::INFINITY, f64::min) {
                let remedy = "half of it must fit on either side of the joint";
                return Err(unphysical("length of the overlap", overlap.length, remedy));
            }
        }
        Ok(())
    }

    fn on_beam(&self, position: f64) -> Result<(), StructureError> {
        let length = self.body.length();
        // A sensor at the very end may have been rounded beyond it.
        if (0.0..=length * (1.0 + 1e-9)).contains(&position) {
            Ok(())
        } else {
            Err(StructureError::OffBeam { position, length })
        }
    }

    fn check_joint(&self) -> Result<(), StructureError> {
        let SpecimenJoint::Springs { kt, kr, coupling } = self.joint else {
            return Ok(());
        };
        for (quantity, value) in [("kt", kt), ("kr", kr)] {
            if value.is_nan() || value < 0.0 {
                return Err(StructureError::Stiffness { quantity, value });
            }
        }
        if coupling == 0.0 {
            return Ok(());
        }
        if coupling.is_nan() || coupling.abs() >= 1.0 {
            let remedy = "it must lie between -1 and 1, or the joint releases energy";
            return Err(unphysical("coupling of the joint", coupling, remedy));
        }
        if matches!(self.body, Body::Joined(_)) {
            return Err(StructureError::NoCoupling {
                assembly: "lap joint",
                cross_compliance: coupling,
            });
        }
        Ok(())
    }

    fn check_base(&self) -> Result<(), StructureError> {
        let Some(base) = &self.base else {
            return Ok(());
        };
        if !(base.frequency > 0.0 && base.frequency.is_finite()) {
            let remedy = "it must be positive and finite";
            return Err(unphysical("frequency of the base", base.frequency, remedy));
        }
        not_negative("stiffness ratio of the base", base.ratio)?;
        let [_, kr] = self.joint.stiffnesses();
        if base.ratio == 0.0 {
            return Ok(());
        }
        if matches!(self.body, Body::Joined(_)) || !(kr > 0.0 && kr.is_finite()) {
            let remedy = "a flexible base needs a cantilever whose joint has a finite kr above 0";
            return Err(unphysical(
                "stiffness ratio of the base",
                base.ratio,
                remedy,
            ));
        }
        Ok(())
    }
}

fn unphysical(quantity: &'static str, value: f64, remedy: &'static str) -> StructureError {
    StructureError::Unphysical {
        quantity,
        value,
        remedy,
    }
}

fn not_negative(quantity: &'static str, value: f64) -> Result<(), StructureError> {
    if value >= 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(unphysical(
            quantity,
            value,
            "it must be finite and at least 0",
        ))
    }
}
