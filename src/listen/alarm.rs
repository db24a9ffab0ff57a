//! Sudden rises of a signal, by its swing in short steps.

/// Steps before the rise that are compared. 4 of 50 ms: two taps are 0.2 s apart at least.
const COMPARED: usize = 4;

/// Watches for taps. The next look finds a tap that it misses. A false alarm costs a look.
#[derive(Debug, Clone)]
pub(crate) struct Alarm {
    /// Least factor by which a swing rises.
    rise: f64,
    /// Swings of the last steps, the newest last, of each channel.
    recent: Vec<Vec<f64>>,
    /// Steps for which it stays silent: what rises so soon belongs to the same tap.
    silent: usize,
}

impl Alarm {
    /// Begins. A swing has to rise by this factor at least.
    pub(crate) fn new(rise: f64) -> Self {
        Self {
            rise,
            recent: Vec::new(),
            silent: 0,
        }
    }

    /// Takes the swings (highest less lowest value) of the watched channels in the next step. Returns true if one of them
    /// rises.
    pub(crate) fn hears(&mut self, swings: &[f64]) -> bool {
        self.recent.resize(swings.len(), Vec::new());
        let mut rises = false;
        for (recent, swing) in self.recent.iter_mut().zip(swings) {
            let before = recent.iter().copied().fold(0.0, f64::max);
            rises |= !recent.is_empty() && *swing > self.rise * before;
            recent.push(*swing);
            if recent.len() > COMPARED {
                recent.remove(0);
            }
        }
        if self.silent > 0 {
            self.silent -= 1;
            return false;
        }
        if rises {
            self.silent = COMPARED - 1;
        }
        rises
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alarms(swings: &[f64]) -> Vec<usize> {
        let mut alarm = Alarm::new(1.5);
        let heard = swings.iter().map(|swing| alarm.hears(&[*swing]));
        let heard: Vec<bool> = heard.collect();
        (0..swings.len()).filter(|step| heard[*step]).collect()
    }

    #[test]
    fn limit_noise_and_decay_raise_no_alarm() {
        assert_eq!(alarms(&[1.0, 1.1, 0.9, 1.2, 1.0, 1.3]), [0_usize; 0]);
        assert_eq!(alarms(&[9.0, 8.0, 7.5, 6.0, 5.5, 4.0]), [0_usize; 0]);
        // Digital silence.
        assert_eq!(alarms(&[0.0; 8]), [0_usize; 0]);
    }

    #[test]
    fn prop_a_tap_is_one_alarm_wherever_its_step_begins() {
        // The pulse lies in two steps.
        assert_eq!(alarms(&[1.0, 1.0, 4.0, 20.0, 9.0, 7.0, 5.0, 4.0]), [2]);
        // A second tap while the first one rings.
        let twice = [1.0, 20.0, 15.0, 12.0, 9.0, 7.0, 25.0, 20.0];
        assert_eq!(alarms(&twice), [1, 6]);
        // Any of several channels.
        let mut alarm = Alarm::new(1.5);
        assert!(!alarm.hears(&[1.0, 1.0]));
        assert!(alarm.hears(&[1.0, 2.0]));
    }
}
