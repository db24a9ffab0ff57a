//! Up to which mode the recordings of a test agree on what they show.

use tapjoint_identify::observation::{Configuration, Observations};

/// The highest mode that is shown by at least half of the recordings that could show it, whose band reaches to it: by
/// what one among many shows, a stray peak at the end of its band perhaps, nothing is tested. 0 without any.
pub(super) fn highest_mode(observations: &Observations) -> usize {
    let all = &observations.configurations;
    let modes = all.iter().flat_map(|one| &one.modes);
    let shown = modes.filter(|mode| {
        let reaching = |one: &Configuration| one.reaches(mode.frequency);
        let showing = |one: &Configuration| one.mode(mode.mode).is_some();
        let could = recordings(all, |one| reaching(one) || showing(one));
        2 * recordings(all, showing) >= could
    });
    shown.map(|mode| mode.mode).max().unwrap_or(0)
}

/// Of how many recordings one configuration at least is such: levels of one recording count once, frequencies read
/// elsewhere for themselves.
pub(super) fn recordings(all: &[Configuration], is_such: impl Fn(&Configuration) -> bool) -> usize {
    let such: Vec<&Configuration> = all.iter().filter(|one| is_such(one)).collect();
    let elsewhere = such.iter().filter(|one| one.recording.is_none()).count();
    let mut own: Vec<usize> = such.iter().filter_map(|one| one.recording).collect();
    own.sort_unstable();
    own.dedup();
    own.len() + elsewhere
}

/// The observations without modes above this one.
pub(super) fn up_to(highest: usize, observations: &Observations) -> Observations {
    let mut kept = observations.clone();
    for one in &mut kept.configurations {
        one.modes.retain(|mode| mode.mode <= highest);
    }
    kept
}
