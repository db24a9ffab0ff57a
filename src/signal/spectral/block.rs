//! Block sizes that transform fast.

/// The largest even number 2^a 3^b 5^c not above `most`, or `None` below 2.
///
/// A block of that form transforms several times faster than one with a large prime factor, and at
/// most a few percent of the signal is given away.
pub fn largest_smooth_block(most: usize) -> Option<usize> {
    (2..=most).rev().find(|&n| n % 2 == 0 && is_smooth(n))
}

/// The smallest number 2^a 3^b 5^c not below `least` (1 for 0).
pub fn smallest_smooth_block(least: usize) -> usize {
    (least.max(1)..).find(|&n| is_smooth(n)).unwrap_or(least)
}

fn is_smooth(mut n: usize) -> bool {
    for factor in [2, 3, 5] {
        while n.is_multiple_of(factor) {
            n /= factor;
        }
    }
    n == 1
}
