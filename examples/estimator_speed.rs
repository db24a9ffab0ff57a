//! Times the consistent estimate and prints its answers, for a comparison with other programs
//! (`scripts/compare_estimator.py`): `cargo run --release --example estimator_speed [estimates]`.
//!
//! Each line "estimate" holds five noisy frequencies (Hz) of one strip on one joint, and Kx, Ky,
//! coupling and the misfit found.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::error::Error;
use std::time::Instant;
use tapjoint::identify::MeasuredMode;
use tapjoint::identify::consistent::{
    ConsistentEstimator, ConsistentSettings, JointedStructure, Neighbourhood,
};
use tapjoint::structure::{Assembly, Beam, BeamTheory, JointStiffness, natural_frequencies};

const NOISE: f64 = 1e-3;
const REPETITIONS: usize = 100_000;

/// Results with the median and the shortest time of one (s): what else the machine does interrupts few
/// of them.
fn timed<T>(noisy: &[Vec<f64>], run: impl Fn(&[f64]) -> T) -> (Vec<T>, (f64, f64)) {
    let once = |frequencies: &Vec<f64>| {
        let start = Instant::now();
        let result = run(frequencies);
        (result, start.elapsed().as_secs_f64())
    };
    let (results, mut times): (Vec<T>, Vec<f64>) = noisy.iter().map(once).unzip();
    times.sort_by(f64::total_cmp);
    let shortest = times.first().copied().unwrap_or(f64::NAN);
    let median = times.get(times.len() / 2).copied().unwrap_or(f64::NAN);
    (results, (median, shortest))
}

fn main() -> Result<(), Box<dyn Error>> {
    let count: usize = std::env::args()
        .nth(1)
        .map_or(Ok(200), |text| text.parse())?;
    let beam = Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    };
    let joint = JointStiffness::three_parameter(1386.0, 4.715, 993.0);
    let assembly = Assembly::Cantilever;
    let exact = natural_frequencies(BeamTheory::Euler, &beam, assembly, &joint, 5)?;
    let modes = |frequencies: &[f64]| -> Vec<MeasuredMode> {
        let numbered = frequencies.iter().zip(&exact).enumerate();
        numbered
            .map(|(index, (&frequency, exact))| MeasuredMode {
                mode: index + 1,
                frequency,
                std: Some(NOISE * exact),
            })
            .collect()
    };
    let structure = JointedStructure::new(BeamTheory::Euler, beam, assembly);
    let settings = ConsistentSettings::three_parameter();
    let estimator = ConsistentEstimator::new(&structure, &modes(&exact), &settings)?;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let noisy: Vec<Vec<f64>> = (0..count)
        .map(|_| {
            let disturb = |f: &f64| {
                let normal: f64 = StandardNormal.sample(&mut random);
                f * (1.0 + NOISE * normal)
            };
            exact.iter().map(disturb).collect()
        })
        .collect();
    let (fits, fit) = timed(&noisy, |f| estimator.fit_frequencies(f));
    println!("fit {} {}", fit.0, fit.1);
    let truth = Neighbourhood::at(&[estimator.fit().point]);
    let (_, start) = timed(&noisy, |f| estimator.refit(f, &truth));
    println!("start {} {}", start.0, start.1);
    let (full, time) = timed(&noisy, |frequencies| {
        ConsistentEstimator::new(&structure, &modes(frequencies), &settings)?.estimate()
    });
    full.into_iter().collect::<Result<Vec<_>, _>>()?;
    println!("full {} {}", time.0, time.1);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()?;
        let start = Instant::now();
        let found = pool.install(|| {
            let near = estimator.neighbourhood();
            estimator.monte_carlo(&near, &[], REPETITIONS, 1)
        })?;
        let kx = found.kx.ok_or("no repetition has an estimate")?;
        println!(
            "monte-carlo {threads} {:.3} {} {:?} {:?}",
            start.elapsed().as_secs_f64(),
            found.samples - found.failed,
            kx.low,
            kx.high
        );
    }
    for (frequencies, fit) in noisy.iter().zip(&fits) {
        let joint = fit.joint();
        let numbers: Vec<String> = frequencies.iter().map(f64::to_string).collect();
        let (kx, ky, coupling) = (joint.kx, joint.ky, joint.coupling());
        println!(
            "estimate {} {kx} {ky} {coupling} {}",
            numbers.join(" "),
            fit.misfit
        );
    }
    Ok(())
}
