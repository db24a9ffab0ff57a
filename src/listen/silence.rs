//! Channels from which nothing comes while the structure rings.

/// Rises of the responses before the first tap after which a hammer that shows nothing is doubted. 3: the first ones may be
/// knocks while the sensors are moved.
const RISES: usize = 3;

/// Watches for channels whose samples no longer change. It counts only samples that are all equal: noise is a sign of life.
#[derive(Debug, Clone, Default)]
pub(crate) struct Silence {
    /// Largest swing of each channel since the last alarm.
    since: Vec<f64>,
    /// Channels that were reported, until they live again.
    reported: Vec<bool>,
    /// Rises of the responses since the hammer showed something.
    rises: usize,
}

impl Silence {
    /// Takes the swings (highest less lowest value) of all channels in the next step.
    pub(crate) fn takes(&mut self, swings: &[f64]) {
        self.since.resize(swings.len(), 0.0);
        self.reported.resize(swings.len(), false);
        for (channel, swing) in swings.iter().enumerate() {
            self.since[channel] = self.since[channel].max(*swing);
            if *swing > 0.0 {
                self.reported[channel] = false;
            }
        }
    }

    /// Begins with a tap.
    pub(crate) fn begin(&mut self) {
        self.since.fill(0.0);
    }

    /// Returns the responses that stood still since the last tap began, each once.
    pub(crate) fn still(&mut self, responses: &[usize]) -> Vec<usize> {
        let mut still = Vec::new();
        for &channel in responses {
            if self.since.get(channel) == Some(&0.0) && !self.reported[channel] {
                self.reported[channel] = true;
                still.push(channel);
            }
        }
        still
    }

    /// Takes a rise of the responses. Returns true once, if the hammer has shown nothing for several of them.
    pub(crate) fn rises_without(&mut self, hammer: usize) -> bool {
        if self.since.get(hammer) != Some(&0.0) {
            self.rises = 0;
            return false;
        }
        self.rises += 1;
        self.rises == RISES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recover_a_channel_that_dies_is_named_once() {
        let mut silence = Silence::default();
        silence.takes(&[1.0, 1.0, 0.5]);
        silence.begin();
        silence.takes(&[9.0, 4.0, 0.0]);
        silence.takes(&[0.0, 3.0, 0.0]);
        assert_eq!(silence.still(&[1, 2]), [2]);
        assert_eq!(silence.still(&[1, 2]), [0_usize; 0]);
        // It lives again, and dies again.
        silence.takes(&[0.0, 1.0, 0.1]);
        silence.begin();
        silence.takes(&[9.0, 4.0, 0.0]);
        assert_eq!(silence.still(&[1, 2]), [2]);
    }

    #[test]
    fn limit_noise_is_a_sign_of_life() {
        let mut silence = Silence::default();
        silence.begin();
        silence.takes(&[9.0, 1e-9]);
        assert_eq!(silence.still(&[1]), [0_usize; 0]);
        assert!(!silence.rises_without(0));
    }
}
