//! The two-node beam element, with the displacement that a beam takes under end loads (cubic; with
//! shear, the factor phi = 12 E I/(k G A h^2) enters), consistent mass and rotary inertia
//! (Przemieniecki, "Theory of Matrix Structural Analysis", 5.6 and 11.5).

/// One beam element, in the model's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Element {
    pub(super) length: f64,
    pub(super) bending_stiffness: f64,
    pub(super) mass_per_length: f64,
    pub(super) rotary_inertia: f64,
    /// phi = 12 E I / (k G A h^2); 0 without shear.
    pub(super) shear: f64,
}

impl Element {
    /// Stiffness for (w, theta) at either node.
    pub(super) fn stiffness(&self) -> [[f64; 4]; 4] {
        let (h, phi) = (self.length, self.shear);
        let scale = self.bending_stiffness / (h.powi(3) * (1.0 + phi));
        let terms = EndTerms {
            ww: 12.0,
            wt: 6.0 * h,
            ww_far: -12.0,
            wt_far: 6.0 * h,
            tt: (4.0 + phi) * h * h,
            tt_far: (2.0 - phi) * h * h,
        };
        terms.matrix(scale)
    }

    /// Twice the energy of one bent and one sheared shape: a difference of rotations gives the
    /// first, their mean against the chord the second.
    pub(super) fn strain_energy(&self, [w0, t0, w1, t1]: &[f64; 4]) -> f64 {
        let bend = t1 - t0;
        let shear = 0.5 * (t0 + t1) - (w1 - w0) / self.length;
        self.bending_stiffness / self.length
            * (bend * bend + 12.0 / (1.0 + self.shear) * shear * shear)
    }

    /// Consistent mass: translation of the element's displacement, rotation of its sections.
    pub(super) fn mass(&self) -> [[f64; 4]; 4] {
        let (h, phi) = (self.length, self.shear);
        let scale = (1.0 + phi).powi(-2);
        let translation = EndTerms {
            ww: 13.0 / 35.0 + 7.0 * phi / 10.0 + phi * phi / 3.0,
            wt: (11.0 / 210.0 + 11.0 * phi / 120.0 + phi * phi / 24.0) * h,
            ww_far: 9.0 / 70.0 + 3.0 * phi / 10.0 + phi * phi / 6.0,
            wt_far: -(13.0 / 420.0 + 3.0 * phi / 40.0 + phi * phi / 24.0) * h,
            tt: (1.0 / 105.0 + phi / 60.0 + phi * phi / 120.0) * h * h,
            tt_far: -(1.0 / 140.0 + phi / 60.0 + phi * phi / 120.0) * h * h,
        };
        let rotation = EndTerms {
            ww: 6.0 / 5.0,
            wt: (0.1 - 0.5 * phi) * h,
            ww_far: -6.0 / 5.0,
            wt_far: (0.1 - 0.5 * phi) * h,
            tt: (2.0 / 15.0 + phi / 6.0 + phi * phi / 3.0) * h * h,
            tt_far: (-1.0 / 30.0 - phi / 6.0 + phi * phi / 6.0) * h * h,
        };
        let of_mass = translation.matrix(scale * self.mass_per_length * h);
        let of_inertia = rotation.matrix(scale * self.rotary_inertia / h);
        std::array::from_fn(|i| std::array::from_fn(|j| of_mass[i][j] + of_inertia[i][j]))
    }

    /// Displacement at x, from 0 to 1, for a unit of each of the four end motions.
    pub(super) fn displacement(&self, x: f64) -> [f64; 4] {
        let (h, phi) = (self.length, self.shear);
        let (x2, x3) = (x * x, x * x * x);
        let scale = 1.0 / (1.0 + phi);
        [
            scale * (1.0 - 3.0 * x2 + 2.0 * x3 + phi * (1.0 - x)),
            scale * h * (x - 2.0 * x2 + x3 + 0.5 * phi * (x - x2)),
            scale * (3.0 * x2 - 2.0 * x3 + phi * x),
            scale * h * (x3 - x2 - 0.5 * phi * (x - x2)),
        ]
    }
}

/// The six different entries of a uniform element's symmetric matrix; near and far node alike.
struct EndTerms {
    ww: f64,
    wt: f64,
    ww_far: f64,
    wt_far: f64,
    tt: f64,
    tt_far: f64,
}

impl EndTerms {
    /// The matrix for (w, theta) near and (w, theta) far; seen from the far end x runs backwards,
    /// which turns the sign of every rotation.
    fn matrix(&self, scale: f64) -> [[f64; 4]; 4] {
        let rows = [
            [self.ww, self.wt, self.ww_far, self.wt_far],
            [self.wt, self.tt, -self.wt_far, self.tt_far],
            [self.ww_far, -self.wt_far, self.ww, -self.wt],
            [self.wt_far, self.tt_far, -self.wt, self.tt],
        ];
        rows.map(|row| row.map(|entry| scale * entry))
    }
}
