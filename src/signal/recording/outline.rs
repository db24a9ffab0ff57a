//! A coarse picture of a channel: lowest and highest values, piece by piece, in memory that has a bound.
//!
//! It is gathered while a file is read for the first time. Whoever looks for taps reads again only the pieces that may
//! hold one.

use std::ops::Range;

/// Length of a piece at first (samples).
const FIRST_LENGTH: usize = 64;
/// Most pieces (512 kB). An hour at 51.2 kHz has pieces of 160 ms.
const MOST_PIECES: usize = 1 << 15;

/// Most pieces of a coarse outline (16 kB): those of 200 files take 3 MB a channel.
const MOST_COARSE: usize = 1 << 10;

/// Lowest and highest of some values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
}

impl Extremes {
    /// Those of no value at all.
    pub const NONE: Extremes = Extremes {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };

    /// Those of some values, all of them finite.
    pub fn of(values: &[f64]) -> Self {
        // Eight lanes side by side: one comparison would wait for the last.
        let mut lows = [f64::INFINITY; 8];
        let mut highs = [f64::NEG_INFINITY; 8];
        let (lanes, rest) = values.as_chunks::<8>();
        for values in lanes {
            for (lane, value) in values.iter().enumerate() {
                lows[lane] = if *value < lows[lane] {
                    *value
                } else {
                    lows[lane]
                };
                highs[lane] = if *value > highs[lane] {
                    *value
                } else {
                    highs[lane]
                };
            }
        }
        Extremes {
            low: lows
                .iter()
                .chain(rest)
                .copied()
                .fold(f64::INFINITY, f64::min),
            high: highs
                .iter()
                .chain(rest)
                .copied()
                .fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// Those of both.
    pub fn with(self, other: Self) -> Self {
        Extremes {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Those of the values multiplied by `factor`.
    fn scaled(self, factor: f64) -> Self {
        let (low, high) = (self.low * factor, self.high * factor);
        Extremes {
            low: low.min(high),
            high: low.max(high),
        }
    }
}

/// Extremes of a channel in pieces of equal length, the last one shorter.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Length of a piece (samples).
    pub length: usize,
    /// The pieces, in order; empty where they are not known.
    pub pieces: Vec<Extremes>,
    /// Samples in the last piece.
    filled: usize,
}

impl Default for Outline {
    fn default() -> Self {
        Outline {
            length: FIRST_LENGTH,
            pieces: Vec::new(),
            filled: 0,
        }
    }
}

impl Outline {
    /// Adds the next samples. Where the pieces become too many, two neighbours make one.
    pub(super) fn add(&mut self, samples: &[f64]) {
        let mut rest = samples;
        while !rest.is_empty() {
            if self.pieces.is_empty() || self.filled == self.length {
                if self.pieces.len() == MOST_PIECES {
                    self.halve();
                }
                self.pieces.push(Extremes::NONE);
                self.filled = 0;
            }
            let (now, later) = rest.split_at(rest.len().min(self.length - self.filled));
            if let Some(last) = self.pieces.last_mut() {
                *last = last.with(Extremes::of(now));
            }
            self.filled += now.len();
            rest = later;
        }
    }

    /// Makes one piece of two neighbours.
    fn halve(&mut self) {
        let first = self.pieces.len().saturating_sub(1) / 2 * 2;
        let in_last: usize = self.pieces[first..].len().saturating_sub(1) * self.length;
        let pairs = self.pieces.chunks(2);
        let merged = pairs.map(|pair| pair.iter().fold(Extremes::NONE, |all, one| all.with(*one)));
        self.pieces = merged.collect();
        self.filled += in_last;
        self.length *= 2;
    }

    /// Returns the outline in fewer pieces, for a recording that is kept beside many others.
    pub(super) fn coarse(&self) -> Self {
        let mut coarse = self.clone();
        while coarse.pieces.len() > MOST_COARSE {
            coarse.halve();
        }
        coarse
    }

    /// The outline of the samples multiplied by `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let pieces = self.pieces.iter().map(|piece| piece.scaled(factor));
        Outline {
            pieces: pieces.collect(),
            ..*self
        }
    }

    /// Pieces (0-based) that hold any of these samples.
    pub fn pieces_of(&self, samples: Range<u64>) -> Range<usize> {
        let length = self.length as u64;
        let end = samples.end.div_ceil(length).min(self.pieces.len() as u64);
        (samples.start / length).min(end) as usize..end as usize
    }

    /// Samples of a piece (0-based); beyond the end of the recording for the last one.
    pub fn samples_of(&self, piece: usize) -> Range<u64> {
        let start = (piece * self.length) as u64;
        start..start + self.length as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_pieces_hold_the_extremes_of_their_samples() {
        let samples: Vec<f64> = (0..1000_u32)
            .map(|n| f64::from(n * 7919 % 1013) - 500.0)
            .collect();
        let mut outline = Outline::default();
        for block in samples.chunks(37) {
            outline.add(block);
        }
        assert_eq!(outline.pieces.len(), 1000_usize.div_ceil(FIRST_LENGTH));
        for (piece, samples) in outline.pieces.iter().zip(samples.chunks(FIRST_LENGTH)) {
            let low = samples.iter().copied().fold(f64::INFINITY, f64::min);
            let high = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert_eq!((piece.low, piece.high), (low, high));
        }
        let turned = outline.scaled(-2.0);
        assert_eq!(turned.pieces[0].high, -2.0 * outline.pieces[0].low);
    }

    #[test]
    fn prop_a_coarse_outline_is_that_of_longer_pieces_and_goes_on() {
        let samples: Vec<f64> = (0..90_000_u32)
            .map(|n| f64::from(n * 7919 % 1013) - 500.0)
            .collect();
        for count in [65_536, 65_537, 65_600, 65_663, 65_664, 66_000] {
            let mut outline = Outline::default();
            outline.add(&samples[..count]);
            let mut coarse = outline.coarse();
            assert!(coarse.pieces.len() <= MOST_COARSE, "{count}");
            coarse.add(&samples[count..]);
            for (piece, samples) in coarse.pieces.iter().zip(samples.chunks(coarse.length)) {
                assert_eq!(*piece, Extremes::of(samples), "{count}");
            }
            assert_eq!(coarse.pieces.len(), samples.len().div_ceil(coarse.length));
        }
    }

    #[test]
    fn limit_a_long_channel_has_a_bounded_outline() {
        let mut outline = Outline::default();
        let block = vec![0.0; FIRST_LENGTH];
        for _ in 0..MOST_PIECES {
            outline.add(&block);
        }
        assert_eq!(
            (outline.length, outline.pieces.len()),
            (FIRST_LENGTH, MOST_PIECES)
        );
        outline.add(&[3.0]);
        assert_eq!(outline.length, 2 * FIRST_LENGTH);
        assert_eq!(outline.pieces.len(), MOST_PIECES / 2 + 1);
        let last = MOST_PIECES / 2;
        assert_eq!(outline.pieces[last].high, 3.0);
        let sample = (MOST_PIECES * FIRST_LENGTH) as u64;
        assert_eq!(outline.pieces_of(sample..sample + 1), last..last + 1);
        assert_eq!(outline.samples_of(last).start, sample);
    }
}
