//! What a frequency response function is: acceleration, velocity or displacement per force.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// Form of a frequency response function: what is measured per force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResponseForm {
    /// Acceleration per force, (m/s2)/N.
    Accelerance,
    /// Velocity per force, (m/s)/N.
    Mobility,
    /// Displacement per force, m/N.
    Receptance,
}

impl ResponseForm {
    /// All forms.
    pub const ALL: [ResponseForm; 3] = [
        ResponseForm::Accelerance,
        ResponseForm::Mobility,
        ResponseForm::Receptance,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            ResponseForm::Accelerance => "accelerance",
            ResponseForm::Mobility => "mobility",
            ResponseForm::Receptance => "receptance",
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            ResponseForm::Accelerance => "(m/s2)/N",
            ResponseForm::Mobility => "(m/s)/N",
            ResponseForm::Receptance => "m/N",
        }
    }

    /// Unit of the response alone.
    pub fn response_unit(self) -> &'static str {
        match self {
            ResponseForm::Accelerance => "m/s2",
            ResponseForm::Mobility => "m/s",
            ResponseForm::Receptance => "m",
        }
    }

    /// How often displacement was differentiated in time.
    fn derivatives(self) -> i32 {
        match self {
            ResponseForm::Receptance => 0,
            ResponseForm::Mobility => 1,
            ResponseForm::Accelerance => 2,
        }
    }

    /// A value of this form at `frequency` (Hz) as a value of another form.
    ///
    /// At 0 Hz there is nothing to integrate from: an acceleration says nothing about where the
    /// structure rests, so that the result does not exist (`None`); derivatives are 0 there.
    pub fn convert(self, to: ResponseForm, value: Complex64, frequency: f64) -> Option<Complex64> {
        let order = to.derivatives() - self.derivatives();
        if order < 0 && frequency == 0.0 {
            return None;
        }
        // In the convention e^{+j omega t}, d/dt is a factor j omega.
        let j_omega = Complex64::new(0.0, TAU * frequency);
        Some(value * j_omega.powi(order))
    }
}
