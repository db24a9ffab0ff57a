//! End functions of the uniform beam and the receptances made of them (Bishop & Johnson 1960).
//!
//! With sin, cos, sinh, cosh of lambda: F1 = sin sinh, F3 = cos cosh - 1, F4 = cos cosh + 1,
//! F5 = cos sinh - sin cosh, F6 = cos sinh + sin cosh. Here they are divided by the power of
//! lambda with which they start, so that none cancels or vanishes at low frequency, and by
//! e^lambda, so that none overflows at high frequency. Their ratios are what the theory needs.

use super::Slenderness;
use std::f64::consts::PI;

/// Below this lambda (1) power series replace products of circular and hyperbolic functions,
/// which cancel there: cos cosh - 1 = -lambda^4/6 has lost one digit at 1 and all at 1e-4.
pub(super) const SERIES_BELOW: f64 = 1.0;

/// The end functions of a beam at one frequency, all multiplied by the same positive number.
///
/// Shear and rotary inertia, where the beam has them, are included: each function belongs to a
/// beam with one free end and vanishes at the natural frequencies named.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndFunctions {
    /// Non-dimensional frequency lambda (1).
    pub lambda: f64,
    /// F1 / lambda^2 (1): no supports of its own; couples translation and rotation.
    pub f1: f64,
    /// F3 / lambda^4 (1): free at the other end too.
    pub f3: f64,
    /// F4 (1): clamped at the other end.
    pub f4: f64,
    /// F5 / lambda^3 (1): pinned at the other end.
    pub f5: f64,
    /// F6 / lambda (1): guided (no rotation) at the other end.
    pub f6: f64,
    /// Number of natural frequencies below lambda of the beam pinned at both ends.
    pub pinned_pinned_count: usize,
}

impl EndFunctions {
    /// The end functions at `lambda` (1), positive and finite, of a beam of this slenderness.
    pub fn new(lambda: f64, slenderness: &Slenderness) -> Self {
        match (slenderness.is_euler(), lambda < SERIES_BELOW) {
            (true, true) => euler_series(lambda),
            (true, false) => euler_closed_form(lambda),
            (false, true) => series(lambda, slenderness),
            (false, false) => closed_form(lambda, slenderness),
        }
    }

    /// Returns the end functions of an Euler beam.
    pub fn euler(lambda: f64) -> Self {
        Self::new(lambda, &Slenderness::EULER)
    }

    /// Number of natural frequencies below lambda of the beam clamped at the near end and free at
    /// the far end.
    ///
    /// Counted from the pinned-pinned beam, whose frequencies are known in closed form, by
    /// changing one support at a time: releasing the far end's translation adds one where its
    /// dynamic stiffness (sign of F5 over that of the pinned-pinned function) is negative;
    /// clamping the near end's rotation removes one where its dynamic stiffness lambda F5/F4 is.
    /// This is the count of Wittrick & Williams 1971 for one degree of freedom at a time.
    pub fn clamped_free_count(&self) -> usize {
        let pinned_pinned_negative = self.pinned_pinned_count % 2 == 1;
        let released = usize::from((self.f5 < 0.0) != pinned_pinned_negative);
        let pinned_free = self.pinned_pinned_count + released;
        let clamped = usize::from((self.f5 < 0.0) != (self.f4 < 0.0));
        pinned_free.saturating_sub(clamped)
    }
}

/// Closed form for an Euler beam: products of functions scaled by e^-lambda.
fn euler_closed_form(lambda: f64) -> EndFunctions {
    let (sine, cosine) = lambda.sin_cos();
    let decay = (-lambda).exp();
    let cosh = 0.5 * (1.0 + decay * decay);
    let sinh = 0.5 * (1.0 - decay * decay);
    let square = lambda * lambda;
    EndFunctions {
        lambda,
        f1: sine * sinh / square,
        f3: (cosine * cosh - decay) / (square * square),
        f4: cosine * cosh + decay,
        f5: (cosine * sinh - sine * cosh) / (square * lambda),
        f6: (cosine * sinh + sine * cosh) / lambda,
        pinned_pinned_count: (lambda / PI) as usize,
    }
}

/// Power series for an Euler beam at low frequency, with q = -4 lambda^4:
/// cos cosh = sum q^k/(4k)!, sin sinh = 2 lambda^2 sum q^k/(4k+2)!,
/// cos sinh + sin cosh = 2 lambda sum q^k/(4k+1)!,
/// cos sinh - sin cosh = -4 lambda^3 sum q^k/(4k+3)!.
fn euler_series(lambda: f64) -> EndFunctions {
    let q = -4.0 * lambda.powi(4);
    let decay = (-lambda).exp();
    // cos cosh - 1 = q (1/4! + q/8! + ...), hence the sum that starts at 4!.
    EndFunctions {
        lambda,
        f1: 2.0 * decay * sparse_series(q, 2),
        f3: -4.0 * decay * sparse_series(q, 4),
        f4: decay * (2.0 + q * sparse_series(q, 4)),
        f5: -4.0 * decay * sparse_series(q, 3),
        f6: 2.0 * decay * sparse_series(q, 1),
        pinned_pinned_count: 0,
    }
}

/// sum over k of q^k / (4k + first)!, for |q| <= 4, to the last digit.
fn sparse_series(q: f64, first: u32) -> f64 {
    // At |q| = 4 the fifth term is below 1e-17 of the first.
    const TERMS: u32 = 5;
    let mut term = 1.0 / f64::from((1..=first).product::<u32>());
    let mut sum = term;
    for k in 1..TERMS {
        let start = 4 * (k - 1) + first;
        let factors: f64 = (1..=4).map(|i| f64::from(start + i)).product();
        term *= q / factors;
        sum += term;
    }
    sum
}

// How the end functions change with frequency, in closed form.

/// Derivatives of the end functions with lambda, multiplied by the same positive number as the
/// functions themselves, whose own change with lambda is left out: it takes part in no ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndSlopes {
    /// Derivative of F1/lambda^2 (1).
    pub f1: f64,
    /// Derivative of F3/lambda^4 (1).
    pub f3: f64,
    /// Derivative of F4 (1).
    pub f4: f64,
    /// Derivative of F5/lambda^3 (1).
    pub f5: f64,
    /// Derivative of F6/lambda (1).
    pub f6: f64,
}

impl EndSlopes {
    /// Returns the derivatives of these end functions, which belong to a beam of this slenderness.
    pub fn of(ends: &EndFunctions, slenderness: &Slenderness) -> Self {
        if slenderness.is_euler() {
            euler(ends)
        } else {
            slopes(ends.lambda, slenderness)
        }
    }
}

/// Bishop's functions are each other's derivatives: F1' = F6, F3' = F4' = F5, F5' = -2 F1 and
/// F6' = F3 + F4; the powers of lambda follow by the quotient rule.
fn euler(ends: &EndFunctions) -> EndSlopes {
    let lambda = ends.lambda;
    let square = lambda * lambda;
    EndSlopes {
        f1: (ends.f6 - 2.0 * ends.f1) / lambda,
        f3: (ends.f5 - 4.0 * ends.f3) / lambda,
        f4: square * lambda * ends.f5,
        f5: (-2.0 * ends.f1 - 3.0 * ends.f5) / lambda,
        f6: (square * square * ends.f3 + ends.f4 - ends.f6) / lambda,
    }
}

// End functions of a beam with shear deformation and rotary inertia, exact for a uniform beam.
//
// In units of the length, with b^2 = lambda^4, r^2 and s^2 from [`Slenderness`], displacement W
// and rotation T of the cross-section, shear force V = (W' - T)/s^2 and moment M = T':
//
// ```text
// V' + b^2 W = 0,   M' + V + b^2 r^2 T = 0.
// ```
//
// Solutions e^{px} have p = +-i beta, +-alpha with
// p^4 + b^2 (r^2 + s^2) p^2 - b^2 (1 - b^2 r^2 s^2) = 0. Two solutions leave one end free:
// `ma cos + mb cosh` and `beta sin + alpha sinh`, where ma = alpha^2 + s^2 b^2 and
// mb = beta^2 - s^2 b^2, whose product is b^2. The determinants of two of (W, T, V, M) at the
// other end are the end functions; each becomes Bishop's for r = s = 0. Above the second
// spectrum's onset b^2 r^2 s^2 = 1, alpha^2 is negative, and cosh alpha, sinh alpha / alpha
// turn into cos and sin; everything below depends on alpha^2 alone and stays real.

/// The wave numbers and the amplitudes that go with them.
struct Waves {
    /// b^2 = lambda^4.
    b2: f64,
    /// r^2 + s^2.
    both: f64,
    /// beta^2 - alpha^2 = b^2 (r^2 + s^2).
    difference: f64,
    /// beta^2 + alpha^2.
    sum: f64,
    alpha2: f64,
    beta2: f64,
    /// alpha^2 beta^2 / b^2 = 1 - b^2 r^2 s^2.
    below_onset: f64,
    /// alpha^2 + s^2 b^2.
    ma: f64,
    /// beta^2 - s^2 b^2.
    mb: f64,
}

impl Waves {
    fn new(lambda: f64, slenderness: &Slenderness) -> Self {
        let (r2, s2) = (slenderness.rotary, slenderness.shear);
        let b2 = lambda.powi(4);
        let both = r2 + s2;
        let difference = b2 * both;
        let sum = ((b2 * (r2 - s2)).powi(2) + 4.0 * b2).sqrt();
        let below_onset = 1.0 - b2 * r2 * s2;
        let beta2 = 0.5 * (difference + sum);
        // Shear outweighs rotary inertia in every real beam, so that this sum does not cancel.
        let ma = 0.5 * (b2 * (s2 - r2) + sum);
        Self {
            b2,
            both,
            difference,
            sum,
            // From the product of the roots: their difference would cancel.
            alpha2: b2 * below_onset / beta2,
            beta2,
            below_onset,
            ma,
            mb: b2 / ma,
        }
    }

    fn functions(&self) -> WaveFunctions {
        let beta = self.beta2.sqrt();
        let (sine, cosine) = beta.sin_cos();
        let alpha = self.alpha2.abs().sqrt();
        let (one, cosh, sinh) = if self.alpha2 < 0.0 {
            (1.0, alpha.cos(), alpha.sin() / alpha)
        } else if alpha < 1e-8 {
            // sinh x / x = 1 + x^2/6 is 1 to the last digit.
            (1.0, 1.0, 1.0)
        } else {
            let decay = (-alpha).exp();
            // 1 - e^{-2 alpha} without cancellation.
            let sinh = -0.5 * (-2.0 * alpha).exp_m1();
            (decay, 0.5 * (1.0 + decay * decay), sinh / alpha)
        };
        WaveFunctions {
            one,
            cosine,
            sine: sine / beta,
            cosh,
            sinh,
        }
    }

    /// (ma^2 alpha^2 - mb^2 beta^2) / b^4, written so that the leading terms do not cancel.
    fn free_coefficient(&self, s2: f64) -> f64 {
        let spread = self.both * self.difference;
        -self.both * (spread + 3.0 * self.below_onset)
            + 2.0 * s2 * (spread + 2.0 * self.below_onset)
            - s2 * s2 * self.difference
    }

    /// (mb beta^2 + ma alpha^2) / b^2, likewise.
    fn coupling_coefficient(&self, s2: f64) -> f64 {
        self.both * self.difference + 2.0 * self.below_onset - s2 * self.difference
    }

    /// Natural frequencies of the pinned-pinned beam below this one: beta = n pi in the first
    /// spectrum; alpha = i n pi, n = 0 included, in the second.
    fn pinned_pinned_count(&self) -> usize {
        let first = (self.beta2.sqrt() / PI) as usize;
        if self.alpha2 < 0.0 {
            first + (self.alpha2.abs().sqrt() / PI) as usize + 1
        } else {
            first
        }
    }
}

/// The circular and the hyperbolic functions, the latter with `one` scaled by e^-alpha where alpha is real.
struct WaveFunctions {
    one: f64,
    /// cos beta.
    cosine: f64,
    /// sin beta / beta.
    sine: f64,
    /// cosh alpha.
    cosh: f64,
    /// sinh alpha / alpha.
    sinh: f64,
}

/// Products of the circular and the hyperbolic functions, all scaled alike.
struct Products {
    /// 1, scaled.
    one: f64,
    /// cos beta cosh alpha.
    cos_cosh: f64,
    /// (cos beta cosh alpha - 1) / b^2.
    cos_cosh_less_one: f64,
    /// (sin beta / beta) (sinh alpha / alpha).
    sin_sinh: f64,
    /// cos beta sinh alpha / alpha.
    cos_sinh: f64,
    /// sin beta / beta cosh alpha.
    sin_cosh: f64,
    /// (alpha cos sinh ma - beta sin cosh mb) / b^4.
    pinned: f64,
}

impl Products {
    fn of(w: &Waves, f: &WaveFunctions) -> Self {
        let (cos_sinh, sin_cosh) = (f.cosine * f.sinh, f.sine * f.cosh);
        Self {
            one: f.one,
            cos_cosh: f.cosine * f.cosh,
            cos_cosh_less_one: (f.cosine * f.cosh - f.one) / w.b2,
            sin_sinh: f.sine * f.sinh,
            cos_sinh,
            sin_cosh,
            pinned: (w.ma * w.alpha2 * cos_sinh - w.mb * w.beta2 * sin_cosh) / (w.b2 * w.b2),
        }
    }
}

/// At frequencies where the products can be formed directly.
pub(super) fn closed_form(lambda: f64, slenderness: &Slenderness) -> EndFunctions {
    let waves = Waves::new(lambda, slenderness);
    let products = Products::of(&waves, &waves.functions());
    assemble(lambda, slenderness, &waves, &products)
}

/// At low frequency: series in z = (alpha + i beta)^2 = -d + 2 i alpha beta, from
/// cosh(alpha + i beta) = cos cosh + i sin sinh = sum z^k/(2k)! and
/// sinh(alpha + i beta) = (alpha + i beta) sum z^k/(2k+1)!.
/// With z^k = p + 2 i alpha beta q, both p and q are real and depend on alpha^2 beta^2 alone.
pub(super) fn series(lambda: f64, slenderness: &Slenderness) -> EndFunctions {
    // |z| <= 2 for slender beams below lambda = 1; 2^14/28! is far below the last digit.
    const TERMS: u32 = 14;
    let waves = Waves::new(lambda, slenderness);
    let d = waves.difference;
    let y2 = 4.0 * waves.b2 * waves.below_onset;
    let (mut p, mut q) = (1.0, 0.0);
    let (mut even, mut odd) = (1.0, 1.0);
    let (mut less_one, mut u) = (0.0, 1.0);
    let (mut sin_sinh, mut v) = (0.0, 0.0);
    for k in 1..=TERMS {
        // p of this k over b^2, so that the sum for cos cosh - 1 starts at its leading term.
        let reduced = -p * waves.both - 4.0 * waves.below_onset * q;
        (p, q) = (-p * d - y2 * q, p - q * d);
        even /= f64::from(2 * k * (2 * k - 1));
        odd /= f64::from(2 * k * (2 * k + 1));
        less_one += reduced * even;
        sin_sinh += 2.0 * q * even;
        u += p * odd;
        v += 2.0 * q * odd;
    }
    let scale = (-waves.alpha2.max(0.0).sqrt()).exp();
    let products = Products {
        one: scale,
        cos_cosh: scale * (1.0 + waves.b2 * less_one),
        cos_cosh_less_one: scale * less_one,
        sin_sinh: scale * sin_sinh,
        cos_sinh: scale * (u - waves.beta2 * v),
        sin_cosh: scale * (u + waves.alpha2 * v),
        // ma alpha^2 - mb beta^2 = -(alpha^2 + beta^2) b^2 r^2 leaves no cancellation.
        pinned: -scale * waves.sum * (slenderness.rotary * u + waves.below_onset * v) / waves.b2,
    };
    assemble(lambda, slenderness, &waves, &products)
}

/// The determinants, divided by 2 b^2 and by the powers of lambda that [`EndFunctions`] states.
fn assemble(lambda: f64, slenderness: &Slenderness, w: &Waves, p: &Products) -> EndFunctions {
    let (r2, s2) = (slenderness.rotary, slenderness.shear);
    EndFunctions {
        lambda,
        // W with V: [ (ma - mb)(1 - cos cosh) + (mb beta^2 + ma alpha^2) sin sinh ] / (2 b^2).
        f1: 0.5
            * ((r2 - s2) * w.b2 * p.cos_cosh_less_one + w.coupling_coefficient(s2) * p.sin_sinh),
        // V with M: cos cosh - 1 + (ma^2 alpha^2 - mb^2 beta^2) sin sinh / (2 b^2).
        f3: p.cos_cosh_less_one + 0.5 * w.free_coefficient(s2) * p.sin_sinh,
        // W with T: 1 + (ma/mb + mb/ma) cos cosh / 2 + (alpha^2 - beta^2) sin sinh / 2.
        f4: p.one + 0.5 * (w.ma / w.mb + w.mb / w.ma) * p.cos_cosh
            - 0.5 * w.difference * p.sin_sinh,
        // W with M: (ma + mb)(ma alpha^2 cos sinh - mb beta^2 sin cosh) / (2 b^2).
        f5: 0.5 * w.sum * p.pinned,
        // T with V: (ma + mb)(mb cos sinh + ma sin cosh) / 2.
        f6: 0.5 * w.sum / w.b2 * (w.mb * p.cos_sinh + w.ma * p.sin_cosh),
        pinned_pinned_count: w.pinned_pinned_count(),
    }
}

/// Derivatives of the wave numbers and amplitudes with lambda.
struct WaveSlopes {
    b2: f64,
    difference: f64,
    sum: f64,
    below_onset: f64,
    alpha2: f64,
    beta2: f64,
    ma: f64,
    mb: f64,
}

impl WaveSlopes {
    fn new(lambda: f64, slenderness: &Slenderness, w: &Waves) -> Self {
        let (r2, s2) = (slenderness.rotary, slenderness.shear);
        let b2 = 4.0 * lambda.powi(3);
        let difference = b2 * w.both;
        // From sum^2 = b^4 (r^2 - s^2)^2 + 4 b^2.
        let sum = (w.b2 * (r2 - s2).powi(2) + 2.0) * b2 / w.sum;
        let ma = 0.5 * (b2 * (s2 - r2) + sum);
        Self {
            b2,
            difference,
            sum,
            below_onset: -b2 * r2 * s2,
            alpha2: 0.5 * (sum - difference),
            beta2: 0.5 * (difference + sum),
            ma,
            mb: (b2 - w.mb * ma) / w.ma,
        }
    }
}

/// Derivatives of the end functions with lambda, scaled as [`closed_form`] scales the functions.
pub(super) fn slopes(lambda: f64, slenderness: &Slenderness) -> EndSlopes {
    let w = Waves::new(lambda, slenderness);
    let dw = WaveSlopes::new(lambda, slenderness, &w);
    let s2 = slenderness.shear;
    let (p, dp) = products_and_slopes(&w, &dw);
    let free = w.both * dw.difference;
    let free = -w.both * (free + 3.0 * dw.below_onset) + 2.0 * s2 * (free + 2.0 * dw.below_onset)
        - s2 * s2 * dw.difference;
    let coupling = w.both * dw.difference + 2.0 * dw.below_onset - s2 * dw.difference;
    let ratio = w.ma / w.mb;
    let ratio_slope = (dw.ma - ratio * dw.mb) / w.mb;
    let turned = w.mb * p.cos_sinh + w.ma * p.sin_cosh;
    let turned_slope =
        dw.mb * p.cos_sinh + w.mb * dp.cos_sinh + dw.ma * p.sin_cosh + w.ma * dp.sin_cosh;
    EndSlopes {
        f1: 0.5
            * ((slenderness.rotary - s2)
                * (dw.b2 * p.cos_cosh_less_one + w.b2 * dp.cos_cosh_less_one)
                + coupling * p.sin_sinh
                + w.coupling_coefficient(s2) * dp.sin_sinh),
        f3: dp.cos_cosh_less_one + 0.5 * (free * p.sin_sinh + w.free_coefficient(s2) * dp.sin_sinh),
        f4: 0.5 * (ratio_slope * (1.0 - ratio.powi(-2)) * p.cos_cosh)
            + 0.5 * (ratio + 1.0 / ratio) * dp.cos_cosh
            - 0.5 * (dw.difference * p.sin_sinh + w.difference * dp.sin_sinh),
        f5: 0.5 * (dw.sum * p.pinned + w.sum * dp.pinned),
        f6: 0.5 / w.b2 * ((dw.sum - w.sum * dw.b2 / w.b2) * turned + w.sum * turned_slope),
    }
}

/// The products of [`closed_form`] and their derivatives.
fn products_and_slopes(w: &Waves, dw: &WaveSlopes) -> (Products, Products) {
    let functions = w.functions();
    let values = Products::of(w, &functions);
    let WaveFunctions {
        one,
        cosine,
        sine,
        cosh,
        sinh,
    } = functions;
    // d(cos b) = -(sin b / b) d(b^2)/2 and d(sin b / b) = (cos b - sin b / b) d(b^2)/(2 b^2).
    let cosine_slope = -0.5 * sine * dw.beta2;
    let sine_slope = 0.5 * (cosine - sine) / w.beta2 * dw.beta2;
    let cosh_slope = 0.5 * sinh * dw.alpha2;
    let sinh_slope = dw.alpha2
        * match w.alpha2.abs() < 1e-6 {
            true => one / 6.0,
            false => 0.5 * (cosh - sinh) / w.alpha2,
        };
    let cos_cosh = cosine_slope * cosh + cosine * cosh_slope;
    let cos_sinh = cosine_slope * sinh + cosine * sinh_slope;
    let sin_cosh = sine_slope * cosh + sine * cosh_slope;
    let b4 = w.b2 * w.b2;
    let pinned = (dw.ma * w.alpha2 + w.ma * dw.alpha2) * values.cos_sinh
        + w.ma * w.alpha2 * cos_sinh
        - (dw.mb * w.beta2 + w.mb * dw.beta2) * values.sin_cosh
        - w.mb * w.beta2 * sin_cosh;
    let slopes = Products {
        one: 0.0,
        cos_cosh,
        cos_cosh_less_one: (cos_cosh - values.cos_cosh_less_one * dw.b2) / w.b2,
        sin_sinh: sine_slope * sinh + sine * sinh_slope,
        cos_sinh,
        sin_cosh,
        pinned: pinned / b4 - 2.0 * values.pinned * dw.b2 / w.b2,
    };
    (values, slopes)
}
