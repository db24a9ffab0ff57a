//! By how much each frequency is higher in a rigid clamp than on springs spread over the width.
//!
//! ```text
//! cargo run --example clamp_difference -- LENGTH WIDTH THICKNESS POISSON KX KY MODES
//! ```
//!
//! Lengths are in m, stiffnesses non-dimensional. One relative difference a line. `scripts/plate_width.py` compares
//! them with a plate.

use tapjoint::structure::specimen::{LapLayout, Mesh, Specimen};
use tapjoint::structure::{Assembly, Beam, BeamTheory, JointStiffness};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<f64> = std::env::args()
        .skip(1)
        .map(|argument| argument.parse())
        .collect::<Result<_, _>>()?;
    let [length, width, thickness, poisson, kx, ky, modes] = arguments[..] else {
        return Err("give LENGTH WIDTH THICKNESS POISSON KX KY MODES".into());
    };
    let beam = Beam {
        length,
        width,
        thickness,
        modulus: 207e9,
        density: 7850.0,
        poisson,
    };
    let joint = JointStiffness::two_parameter(kx, ky).in_si(&beam);
    let (theory, layout) = (BeamTheory::Timoshenko, LapLayout::default());
    let specimen = Specimen::jointed(theory, &beam, Assembly::Cantilever, &layout, Some(joint));
    for difference in specimen.clamp_differences(modes as usize, Mesh::SIMULATION)? {
        println!("{difference:e}");
    }
    Ok(())
}
