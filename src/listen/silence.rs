//! A hammer's channel from which nothing comes while the structure rings.

/// Rises of the responses after which a hammer that shows nothing is doubted. 3: the first ones may be knocks while the sensors
/// are moved.
const RISES: usize = 3;

/// Watches for a hammer whose samples do not change. It counts only samples that are all equal: noise is a sign of life.
#[derive(Debug, Clone, Default)]
pub(crate) struct Silence {
    /// Channels that have moved since the last rise of the responses.
    moved: Vec<bool>,
    /// Rises of the responses since the hammer moved.
    rises: usize,
}

impl Silence {
    /// Takes the swings (highest less lowest value) of all channels in the next step.
    pub(crate) fn takes(&mut self, swings: &[f64]) {
        self.moved.resize(swings.len(), false);
        for (moved, swing) in self.moved.iter_mut().zip(swings) {
            *moved |= *swing > 0.0;
        }
    }

    /// Takes a rise of the responses. Returns true once, if the hammer has shown nothing for several of them.
    pub(crate) fn rises_without(&mut self, hammer: usize) -> bool {
        let has_moved = self.moved.get(hammer) != Some(&false);
        self.moved.fill(false);
        self.rises = if has_moved { 0 } else { self.rises + 1 };
        self.rises == RISES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recover_a_hammer_that_shows_nothing_is_named_once() {
        let mut silence = Silence::default();
        silence.takes(&[0.0, 1.0]);
        let named = [0; 5].map(|_| silence.rises_without(0));
        assert_eq!(named, [false, false, true, false, false]);
    }

    #[test]
    fn limit_noise_is_a_sign_of_life() {
        let mut silence = Silence::default();
        silence.takes(&[1e-9, 9.0]);
        silence.takes(&[0.0, 9.0]);
        assert!(!silence.rises_without(0));
        // The hammer's cable breaks.
        assert_eq!(
            [0; 3].map(|_| silence.rises_without(0)),
            [false, false, true]
        );
    }
}
