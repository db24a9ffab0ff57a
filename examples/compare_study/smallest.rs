//! The smallest change of a joint that is seen, over the repeatability.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tapjoint::compare::{MeasuredMode, Pair, Settings, StiffnessChange, Test, compare};
use tapjoint::structure::specimen::{Body, Mesh};
use tapjoint::study::change_check::{ChangeClass, structure};

const REPEATABILITIES: [f64; 5] = [2e-4, 5e-4, 1e-3, 2e-3, 4e-3];
const MODES: usize = 5;

/// Falls of Kt and Kr (%) that are seen in one comparison; infinite where none is.
fn seen(seed: u64, number: u64, repeatability: f64) -> Option<[f64; 2]> {
    let mut draw = ChaCha8Rng::seed_from_u64(seed);
    draw.set_stream((3 << 50) + number);
    let (described, items) = structure(&mut draw, ChangeClass::Joint)?;
    if matches!(described.body, Body::Joined(_)) {
        return None;
    }
    let solved = described.modes(MODES, Mesh { elements: 60 }).ok()?;
    let modes = solved.frequencies()[..MODES].iter().enumerate();
    let test = Test {
        modes: modes
            .map(|(index, frequency)| {
                MeasuredMode::of_frequency(index + 1, *frequency, 0.05 * repeatability * frequency)
            })
            .collect(),
        structure: described,
        items,
        knows_joint: [false; 2],
        common_std: 0.01,
        unnumbered: Vec::new(),
    };
    let pair = Pair {
        before: vec![test.clone()],
        after: vec![test],
    };
    let settings = Settings {
        repeatability: Some(repeatability),
    };
    let joint = compare(&[pair], &settings).ok()?.joint?;
    let fall = |change: &Option<StiffnessChange>| {
        let fall = change.as_ref().and_then(|one| one.seen_from_percent[1]);
        fall.map_or(f64::INFINITY, f64::abs)
    };
    Some([fall(&joint.kt), fall(&joint.kr)])
}

/// Prints the falls of Kt and Kr that are seen nine times of ten, on this many drawn cantilevers.
pub fn print_smallest(structures: usize, seed: u64) {
    println!(
        "falls of Kt and Kr (%) that are seen nine times of ten: lower quartile, median, upper quartile"
    );
    for repeatability in REPEATABILITIES {
        let all: Vec<[f64; 2]> = (0..2 * structures as u64)
            .into_par_iter()
            .filter_map(|number| seen(seed, number, repeatability))
            .collect();
        let mut line = format!("{:.2} %, {} cantilevers:", 100.0 * repeatability, all.len());
        for (direction, name) in ["Kt", "Kr"].into_iter().enumerate() {
            let mut falls: Vec<f64> = all.iter().map(|one| one[direction]).collect();
            falls.sort_by(f64::total_cmp);
            let at = |share: f64| falls[(share * falls.len() as f64) as usize];
            line.push_str(&format!(
                "  {name} {:.2} {:.2} {:.2}",
                at(0.25),
                at(0.5),
                at(0.75)
            ));
        }
        println!("{line}");
    }
}
