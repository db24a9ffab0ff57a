//! Sections that differ from the rest of the beam, and sprung masses.

use super::shared::{MESH, assert_close, frequencies, strip};
use std::f64::consts::PI;
use tapjoint_beam::specimen::{
    BeamModes, BeamSection, Hinge, LapLayout, Mesh, PointMass, Resonator, Specimen,
};
use tapjoint_beam::{Assembly, Beam, BeamTheory, JointStiffness, StructureError};

fn jointed(theory: BeamTheory, beam: &Beam, assembly: Assembly, kx: f64, ky: f64) -> Specimen {
    // Springs of the strip, whatever the beam.
    let joint = JointStiffness::two_parameter(kx, ky).in_si(&strip());
    let joint = (assembly != Assembly::Free).then_some(joint);
    Specimen::jointed(theory, beam, assembly, &LapLayout::default(), joint)
}

fn clamped() -> Specimen {
    let rigid = f64::INFINITY;
    jointed(
        BeamTheory::Euler,
        &strip(),
        Assembly::Cantilever,
        rigid,
        rigid,
    )
}

/// All assemblies, each with either theory.
fn all_kinds() -> Vec<(BeamTheory, Assembly)> {
    let assemblies = [Assembly::Cantilever, Assembly::Lap, Assembly::Free];
    let theories = [BeamTheory::Euler, BeamTheory::Timoshenko];
    let kinds = theories
        .iter()
        .flat_map(|theory| assemblies.map(|one| (*theory, one)));
    kinds.collect()
}

// ---------------------------------------------------------------------------------------------
// Sections

#[test]
fn limit_a_section_over_all_the_beam_is_another_beam() {
    let other = Beam {
        modulus: 1.3 * strip().modulus,
        density: 0.8 * strip().density,
        ..strip()
    };
    for (theory, assembly) in all_kinds() {
        let mut changed = jointed(theory, &strip(), assembly, 1400.0, 1.2);
        changed.sections.push(BeamSection {
            start: 0.0,
            end: strip().length,
            stiffness: 1.3,
            mass: 0.8,
        });
        let mut plain = jointed(theory, &other, assembly, 1400.0, 1.2);
        for specimen in [&mut changed, &mut plain] {
            specimen.masses.push(PointMass::new(0.3141, 0.02));
            specimen.hinges.push(Hinge {
                position: 0.1234,
                compliance: 2e-5,
            });
        }
        // Both have other units, so that rounding differs: 1e-15 of the highest eigenvalue, 1e9 times the first one.
        let case = format!("{theory:?} {assembly:?}");
        assert_close(
            &frequencies(&changed, 6, MESH),
            &frequencies(&plain, 6, MESH),
            1e-7,
            &case,
        );
    }
}

#[test]
fn limit_sections_that_meet_are_one() {
    let section = |start: f64, end: f64| BeamSection {
        start,
        end,
        stiffness: 1.2,
        mass: 1.1,
    };
    let specimen = jointed(
        BeamTheory::Timoshenko,
        &strip(),
        Assembly::Cantilever,
        1400.0,
        1.2,
    );
    let mut one = specimen.clone();
    one.sections.push(section(0.1, 0.3));
    let mut two = specimen;
    two.sections
        .extend([section(0.1, 0.2017), section(0.2017, 0.3)]);
    let (one, two) = (frequencies(&one, 6, MESH), frequencies(&two, 6, MESH));
    // The same matrices but for the last digit.
    assert_close(&two, &one, 1e-9, "cut in two");
}

#[test]
fn prop_frequencies_are_continuous_where_a_border_crosses_a_node() {
    let at_border = |end: f64| {
        let mut specimen = clamped();
        specimen.sections.push(BeamSection {
            start: 0.05,
            end,
            stiffness: 1.5,
            mass: 1.4,
        });
        frequencies(&specimen, 5, MESH)
    };
    let node = 0.423 * 80.0 / 200.0;
    let step = 1e-6;
    let (before, at, after) = (
        at_border(node - step),
        at_border(node),
        at_border(node + step),
    );
    for mode in 0..5 {
        let slopes = [
            (at[mode] - before[mode]) / step,
            (after[mode] - at[mode]) / step,
        ];
        // Either slope is at most about (stiffness - 1) f/L: a jump at the node would be the step's inverse.
        assert!(
            slopes
                .iter()
                .all(|slope| slope.abs() < 5.0 * at[mode] / 0.423),
            "mode {}: {slopes:?}",
            mode + 1
        );
    }
}

#[test]
fn val_tapers_by_the_differential_equation() {
    // omega L^2 (rho A/E I)^1/2 of (t^3 w'')'' = lambda^4 t w with t from 1 at the clamp to the ratio at the free end, by
    // Runge and Kutta's method in 1000 steps.
    let published = [
        (
            0.5,
            [3.823_784_85, 18.317_260_9, 47.264_827_0, 90.450_477_7],
        ),
        (1.5, [3.366_930_49, 25.273_235_9, 74.501_767_2, 147.778_475]),
    ];
    for (ratio, expected) in published {
        let mut errors = Vec::new();
        for elements in [100, 200] {
            let mut specimen = clamped();
            specimen.sections = BeamSection::taper(strip().length, 1.0, ratio, elements);
            let unit = strip().unit_frequency();
            let found = frequencies(&specimen, 4, Mesh { elements });
            let found: Vec<f64> = found.iter().map(|one| one / unit).collect();
            // Steps of 1/100 leave a quarter of the square of a half wave's share in steps: 1e-4 in the fourth mode.
            assert_close(
                &found,
                &expected,
                1e-4,
                &format!("ratio {ratio}, {elements}"),
            );
            errors.push((found[3] / expected[3] - 1.0).abs());
        }
        // Of second order in the length of the steps.
        assert!(errors[1] < 0.3 * errors[0], "ratio {ratio}: {errors:?}");
    }
}

#[test]
fn val_wedge_of_kirchhoff() {
    // Kirchhoff 1879, as Timoshenko ("Vibration Problems in Engineering") prints it: 5.315; the other two by the power
    // series of (s^3 w'')'' = lambda^4 s w.
    let mut specimen = clamped();
    specimen.sections = BeamSection::taper(strip().length, 1.0, 0.0, 200);
    let unit = strip().unit_frequency();
    let found: Vec<f64> = frequencies(&specimen, 3, MESH)
        .iter()
        .map(|one| one / unit)
        .collect();
    // The last step, which should end in nothing, is as thick as a four hundredth of the root: the free end moves most, and
    // the error of some steps there falls with the first power of their length.
    assert_close(&found, &[5.315_10, 15.207_17, 30.019_81], 1e-3, "wedge");
}

#[test]
fn limit_a_section_beyond_the_beam_is_refused() {
    let mut specimen = clamped();
    specimen.sections.push(BeamSection {
        start: 0.2,
        end: 0.43,
        stiffness: 1.1,
        mass: 1.0,
    });
    assert!(matches!(
        specimen.check(),
        Err(StructureError::OffBeam { .. })
    ));
    specimen.sections[0].end = 0.2;
    let error = specimen.check().unwrap_err().to_string();
    assert!(error.starts_with("end of a section is 0.2"), "{error}");
    specimen.sections[0].end = 0.3;
    specimen.sections[0].stiffness = 0.0;
    let error = specimen.check().unwrap_err().to_string();
    assert!(error.starts_with("stiffness of a section is 0"), "{error}");
}

// ---------------------------------------------------------------------------------------------
// Resonators

fn resonator(position: f64, mass: f64, frequency: f64) -> Resonator {
    Resonator {
        position,
        mass,
        frequency,
    }
}

#[test]
fn limit_a_stiff_resonator_is_a_mass() {
    for (theory, assembly) in all_kinds() {
        let mut specimen = jointed(theory, &strip(), assembly, 1400.0, 1.2);
        // At a node of the mesh: between nodes a mass bends its element a little, and a spring does not.
        let position = 0.423 * 130.0 / 200.0;
        let mass = 0.03 * strip().mass();
        let mut heavy = specimen.clone();
        heavy.masses.push(PointMass::new(position, mass));
        let expected = frequencies(&heavy, 6, MESH);
        specimen
            .resonators
            .push(resonator(position, mass, 1e3 * expected[5]));
        let found = frequencies(&specimen, 6, MESH);
        // The mass grows by (f/f_r)^2 = 1e-6, of which a frequency feels 3 %. Rounding is 1e-16 of the resonator's own
        // eigenvalue, 1e11 times the first one's: beside it the soft first mode keeps five digits.
        assert_close(
            &found[1..],
            &expected[1..],
            1e-6,
            &format!("{theory:?} {assembly:?}"),
        );
        assert_close(
            &found[..1],
            &expected[..1],
            1e-5,
            &format!("{theory:?} {assembly:?}"),
        );
    }
}

#[test]
fn limit_a_soft_resonator_is_nothing() {
    for (theory, assembly) in all_kinds() {
        let plain = jointed(theory, &strip(), assembly, 1400.0, 1.2);
        let expected = frequencies(&plain, 6, MESH);
        let mut specimen = plain;
        specimen
            .resonators
            .push(resonator(0.3, 0.01 * strip().mass(), 0.01 * expected[0]));
        let found = specimen.beam_modes(6, MESH).unwrap();
        assert_eq!(found.resonators.len(), 1, "{theory:?} {assembly:?}");
        let found: Vec<f64> = found
            .numbers
            .iter()
            .map(|mode| found.modes.frequencies()[*mode])
            .collect();
        // Its spring alone acts: m (f_r/f)^2 = 1e-6 of the beam's mass.
        assert_close(&found, &expected, 1e-5, &format!("{theory:?} {assembly:?}"));
    }
}

#[test]
fn val_sprung_mass_at_the_end_of_a_clamped_beam() {
    // 1 + cos cosh = mu lambda (sin cosh - cos sinh) with the mass mu/(1 - (f/f_r)^2) that a sprung mass is to the beam.
    let beam = strip();
    for (mu, share) in [(0.02, 0.4), (0.1, 1.7), (0.5, 8.0)] {
        let mut specimen = clamped();
        let first = frequencies(&specimen, 1, MESH)[0];
        let own = share * first;
        specimen
            .resonators
            .push(resonator(beam.length, mu * beam.mass(), own));
        for frequency in frequencies(&specimen, 5, MESH) {
            // The sign of the residual changes within 1e-7 of the frequency.
            let residuals = [1.0 - 1e-7, 1.0 + 1e-7].map(|factor| {
                let x = beam.lambda_of(factor * frequency);
                let detuning = 1.0 - (factor * frequency / own).powi(2);
                let left = 1.0 / x.cosh() + x.cos();
                detuning * left - mu * x * (x.sin() - x.cos() * x.tanh())
            });
            assert!(
                residuals[0] * residuals[1] < 0.0,
                "mu {mu}, f_r/f_1 {share}, {frequency} Hz: {residuals:?}"
            );
        }
    }
}

/// Frequencies of the beam's own modes.
fn beams_own(found: &BeamModes) -> Vec<f64> {
    let own = found.numbers.iter();
    own.map(|mode| found.modes.frequencies()[*mode]).collect()
}

#[test]
fn prop_the_mode_of_a_resonator_is_not_counted() {
    for (theory, assembly) in all_kinds() {
        let plain = jointed(theory, &strip(), assembly, 1400.0, 1.2);
        let expected = frequencies(&plain, 6, MESH);
        for own in [0.5, 1.1, 3.0, 17.0, 60.0, 200.0, 2000.0] {
            let own = own * expected[0];
            let mut specimen = plain.clone();
            specimen
                .resonators
                .push(resonator(0.37, 0.005 * strip().mass(), own));
            let found = specimen.beam_modes(6, MESH).unwrap();
            let case = format!("{theory:?} {assembly:?} {own} Hz");
            // A two-hundredth of the mass moves a frequency by a few percent where it meets the resonator's, and by
            // 0.25 % phi^2 = 1 % elsewhere.
            assert_close(&beams_own(&found), &expected, 0.08, &case);
            assert_eq!(
                found.resonators.len(),
                usize::from(own < 1.01 * expected[5]),
                "{case}"
            );
        }
    }
}

#[test]
fn prop_modes_with_resonators_have_unit_modal_mass_by_their_joint() {
    // d(omega^2)/dk = psi^2 for unit modal mass, with psi the joint's motion.
    let specimen = |kr: f64| {
        let mut specimen = jointed(
            BeamTheory::Timoshenko,
            &strip(),
            Assembly::Cantilever,
            1400.0,
            1.2,
        );
        specimen.sections = BeamSection::taper(strip().length, 1.1, 0.9, 30);
        specimen.resonators.push(resonator(0.2, 0.02, 150.0));
        specimen.resonators.push(resonator(0.31, 0.01, 400.0));
        if let Some(joint) = &mut specimen.joint {
            joint.kr *= kr;
        }
        specimen
    };
    let modes = specimen(1.0).modes(8, MESH).unwrap();
    let kr = specimen(1.0).joint_stiffnesses()[1];
    let moved = modes.perturbed(&specimen(1.0 + 1e-4)).unwrap().unwrap();
    let fresh = frequencies(&specimen(1.0 + 1e-4), 8, MESH);
    // One step of Rayleigh quotient iteration is as good as a new solution.
    assert_close(moved.frequencies(), &fresh, 1e-9, "perturbed");
    for mode in 0..8 {
        let square = |frequency: f64| (2.0 * PI * frequency).powi(2);
        let slope =
            (square(moved.frequencies()[mode]) - square(modes.frequencies()[mode])) / (1e-4 * kr);
        let expected = modes.joint_motion(mode)[1].powi(2);
        // The step's own curvature: 1e-4 of the slope, and rounding of modes that hardly feel the spring.
        let error = (slope - expected).abs();
        assert!(
            error < 1e-3 * expected + 1e-9 * square(modes.frequencies()[mode]) / (1e-4 * kr),
            "mode {}: {slope} for {expected}",
            mode + 1
        );
    }
}

#[test]
fn limit_two_resonators_on_one_element_are_refused() {
    let mut specimen = clamped();
    specimen.resonators.push(resonator(0.2, 0.01, 100.0));
    specimen.resonators.push(resonator(0.2001, 0.01, 100.0));
    let error = specimen.modes(3, Mesh::DIAGNOSIS).unwrap_err().to_string();
    assert!(
        error.contains("two resonators stand on one element"),
        "{error}"
    );
    specimen.resonators[1].frequency = 0.0;
    let error = specimen.check().unwrap_err().to_string();
    assert!(
        error.starts_with("frequency of a resonator is 0"),
        "{error}"
    );
}
