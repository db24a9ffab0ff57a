//! temp
use std::ops::Range;
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("x")]
#[allow(missing_docs)]
pub struct RecordingError;
#[allow(missing_docs)]
#[derive(Debug, Clone)]
pub struct Recording {
    rate: f64,
    data: Vec<Vec<f64>>,
}
#[allow(missing_docs)]
pub struct Block {
    pub start: u64,
    pub samples: Vec<Vec<f64>>,
}
#[allow(missing_docs)]
pub struct W;
impl W {
    #[allow(missing_docs)]
    pub fn code(&self) -> &'static str {
        ""
    }
}
impl std::fmt::Display for W {
    fn fmt(&self, _: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Ok(())
    }
}
#[allow(missing_docs)]
impl Recording {
    pub fn from_samples(_n: &str, rate: f64, data: Vec<Vec<f64>>) -> Self {
        Recording { rate, data }
    }
    pub fn sample_rate(&self) -> f64 {
        self.rate
    }
    pub fn frames(&self) -> u64 {
        self.data[0].len() as u64
    }
    pub fn name(&self) -> &str {
        "x"
    }
    pub fn warnings(&self) -> Vec<W> {
        vec![]
    }
    pub fn mean(&self, c: usize) -> f64 {
        self.data[c].iter().sum::<f64>() / self.data[c].len() as f64
    }
    pub fn clipping_level(&self, _c: usize) -> Option<f64> {
        None
    }
    pub fn read(&self, c: usize, r: Range<u64>) -> Result<Vec<f64>, RecordingError> {
        let n = self.data[c].len();
        Ok(self.data[c][(r.start as usize).min(n)..(r.end as usize).min(n)].to_vec())
    }
    pub fn read_channels(
        &self,
        c: &[usize],
        r: Range<u64>,
    ) -> Result<Vec<Vec<f64>>, RecordingError> {
        c.iter().map(|&c| self.read(c, r.clone())).collect()
    }
    pub fn blocks(
        &self,
        c: &[usize],
        b: usize,
    ) -> impl Iterator<Item = Result<Block, RecordingError>> {
        let c = c.to_vec();
        let n = self.data[0].len();
        (0..n.div_ceil(b)).map(move |i| {
            Ok(Block {
                start: (i * b) as u64,
                samples: c
                    .iter()
                    .map(|&c| self.data[c][i * b..((i + 1) * b).min(n)].to_vec())
                    .collect(),
            })
        })
    }
}
