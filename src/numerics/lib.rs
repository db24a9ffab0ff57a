//! Numbers: quantities read with their units, statistics and the least-squares solver that several stages share.

pub mod cholesky;
pub mod least_squares;
pub mod quantity;
pub mod stats;

/// Modified Bessel function I0, by its power series: converges for every argument of a Kaiser window.
pub fn bessel_i0(x: f64) -> f64 {
    let quarter = x * x / 4.0;
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > sum * 1e-17 {
        term *= quarter / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}
