//! Stiffening by the width: against a plate, in the limits, and by both routes of the theory.

use super::plate;
use super::shared::{MESH, frequencies, strip};
use tapjoint_beam::interface::{InterfaceModes, JointedBody, LAST_STEP};
use tapjoint_beam::specimen::{Hinge, LapLayout, Mesh, PointMass, Specimen};
use tapjoint_beam::{
    Assembly, Beam, BeamTheory, JointStiffness, WidthStiffening, natural_frequencies, natural_modes,
};

fn jointed(beam: &Beam, assembly: Assembly, joint: &JointStiffness) -> Specimen {
    let (theory, layout) = (BeamTheory::Timoshenko, LapLayout::default());
    let springs = (assembly != Assembly::Free).then(|| joint.in_si(beam));
    Specimen::jointed(theory, beam, assembly, &layout, springs)
}

#[test]
fn val_corrections_are_those_of_a_plate() {
    for &(support, width, poisson, kx, ky, exact) in plate::CORRECTIONS {
        // As thin as this it has neither shear nor rotary inertia.
        let beam = Beam {
            length: 1.0,
            width,
            thickness: 1e-3 * width,
            poisson,
            ..strip()
        };
        let (assembly, joint) = match support {
            "free" => (Assembly::Free, JointStiffness::FREE),
            "clamp" => (Assembly::Cantilever, JointStiffness::RIGID),
            _ => (Assembly::Cantilever, JointStiffness::two_parameter(kx, ky)),
        };
        let euler = natural_frequencies(BeamTheory::Euler, &beam, assembly, &joint, 6).unwrap();
        let specimen = jointed(&beam, assembly, &joint);
        let mut found = frequencies(&specimen, 6, MESH);
        if support == "clamp" {
            let more = specimen.clamp_differences(6, MESH).unwrap();
            for (frequency, more) in found.iter_mut().zip(more) {
                *frequency *= 1.0 + more;
            }
        }
        for (mode, exact) in exact.iter().enumerate() {
            let correction = found[mode] / euler[mode] - 1.0;
            // What scripts/plate_width.py allows.
            let allowed = (0.05 * exact.abs()).max(5e-5);
            assert!(
                (correction - exact).abs() < allowed,
                "{support} {width} {poisson} {kx} {ky}, mode {}: {correction} against {exact}",
                mode + 1
            );
        }
    }
}

/// Joints of both assemblies, from soft to rigid.
fn joints() -> Vec<(Assembly, JointStiffness)> {
    let two = JointStiffness::two_parameter;
    let infinite = f64::INFINITY;
    let mut joints = Vec::new();
    for (kx, ky) in [
        (1e3, 10.0),
        (1e5, 100.0),
        (20.0, 0.5),
        (infinite, infinite),
        (infinite, 3.0),
        (1e4, infinite),
    ] {
        joints.push((Assembly::Cantilever, two(kx, ky)));
        joints.push((Assembly::Lap, two(kx, ky)));
    }
    for kz in [300.0, -200.0] {
        let joint = JointStiffness::three_parameter(1e3, 10.0, kz);
        joints.push((Assembly::Cantilever, joint));
    }
    joints
}

fn compliances(joint: &JointStiffness) -> [f64; 3] {
    [1.0 / joint.kx, 1.0 / joint.ky, joint.cross_compliance]
}

fn body_of(specimen: &Specimen) -> JointedBody {
    let modes = InterfaceModes::new(specimen, 157, 7).unwrap();
    JointedBody::Elements(Box::new(modes))
}

#[test]
fn prop_frequency_equation_and_specimen_agree() {
    for (assembly, joint) in joints() {
        for with_mass in [false, true] {
            let mut specimen = jointed(&strip(), assembly, &joint);
            if with_mass {
                specimen.masses.push(PointMass::new(0.2, 0.02));
            }
            let exact = frequencies(&specimen, 7, MESH);
            let body = body_of(&specimen);
            for (mode, exact) in (1..).zip(&exact) {
                let guess = 3.0 * mode as f64;
                let root = body.root(compliances(&joint), mode, guess, LAST_STEP);
                let found = strip().frequency_of(root.lambda);
                // What elements of either mesh leave in the seventh mode.
                assert!(
                    (found / exact - 1.0).abs() < 1e-6,
                    "{assembly:?} {joint:?}, mode {mode}: {found} against {exact}"
                );
            }
        }
    }
}

#[test]
fn prop_slopes_with_the_joint_are_those_of_small_steps() {
    let specimen = jointed(&strip(), Assembly::Cantilever, &JointStiffness::FREE);
    let body = body_of(&specimen);
    for at in [[1e-3, 0.1, 0.0], [1e-5, 0.01, 0.0], [1e-4, 0.05, 1e-3]] {
        for mode in 1..=7 {
            let guess = 3.0 * mode as f64;
            let root = body.root(at, mode, guess, LAST_STEP);
            for (index, by) in root.by_compliance.iter().enumerate() {
                let step = 1e-4 * if index == 2 { 1e-3 } else { at[index] };
                let [below, above] = [-step, step].map(|step| {
                    let mut there = at;
                    there[index] += step;
                    body.root(there, mode, root.lambda, 1e-13).lambda
                });
                let slope = 0.5 * (above - below) / step;
                // The square of the step, and rounding of 1e-14 over it.
                let allowed = 1e-5 * by.abs() + 1e-12 * root.lambda / step;
                assert!(
                    (slope - by).abs() < allowed,
                    "{at:?}, mode {mode}, compliance {index}: {by} against {slope}"
                );
            }
        }
    }
}

#[test]
fn limit_a_section_without_poissons_ratio_does_not_curl() {
    // The elements curl with any ratio but 0; with one that is next to nothing they still have all motions across the width.
    for (assembly, joint) in joints() {
        if joint.cross_compliance != 0.0 && assembly == Assembly::Lap {
            continue;
        }
        let beam = Beam {
            poisson: 0.0,
            ..strip()
        };
        let slenderness = beam.slenderness(BeamTheory::Timoshenko);
        let exact = natural_modes(assembly, &joint, &slenderness, 6).unwrap();
        for poisson in [0.0, 1e-9] {
            let specimen = jointed(&Beam { poisson, ..beam }, assembly, &joint);
            assert_eq!(specimen.is_stiffened(), poisson > 0.0);
            for (exact, found) in exact.iter().zip(frequencies(&specimen, 6, MESH)) {
                let exact = beam.frequency_of(exact.lambda);
                // What elements leave in the sixth mode.
                let off = (found / exact - 1.0).abs();
                assert!(
                    off < 1e-6,
                    "{assembly:?} {joint:?} {poisson}: {found} against {exact}"
                );
            }
            let more = specimen.clamp_differences(6, MESH).unwrap();
            // nu^2, and what rounding leaves of two solutions.
            assert!(more.iter().all(|more| more.abs() < 1e-8), "{more:?}");
        }
    }
}

#[test]
fn limit_nothing_is_left_of_a_narrow_or_incompressible_section() {
    let cases = [(Assembly::Free, JointStiffness::FREE)];
    for (assembly, joint) in cases.into_iter().chain(joints()) {
        if joint.cross_compliance != 0.0 && assembly == Assembly::Lap {
            continue;
        }
        for (poisson, width) in [(1e-5, 0.05), (0.3, 2e-4)] {
            let beam = Beam {
                poisson,
                width,
                ..strip()
            };
            let slenderness = beam.slenderness(BeamTheory::Timoshenko);
            let exact = natural_modes(assembly, &joint, &slenderness, 7).unwrap();
            let found =
                natural_frequencies(BeamTheory::Timoshenko, &beam, assembly, &joint, 7).unwrap();
            for (exact, found) in exact.iter().zip(found) {
                let exact = beam.frequency_of(exact.lambda);
                // nu^2 = 1e-10, (b/L)^2 = 2e-7 times 0.01; elements leave 1e-7. At a rigid joint the first order in the
                // width is left: an end that cannot curl seems shorter by about 0.3 nu^2 b.
                let mut allowed = 1e-6;
                if joint.kx.is_infinite() {
                    allowed += 0.8 * poisson.powi(2) * width / beam.length;
                }
                let off = (found / exact - 1.0).abs();
                assert!(
                    off < allowed,
                    "{assembly:?} {joint:?} {poisson} {width}: {found} against {exact}"
                );
            }
        }
    }
}

#[test]
fn limit_short_waves_bend_a_plane_strip() {
    // Where the section cannot follow at all, E I/(1 - nu^2) would be an upper bound; mu keeps the model below it.
    let beam = Beam {
        width: 0.4,
        thickness: 1e-4,
        ..strip()
    };
    let free = JointStiffness::FREE;
    let euler = natural_frequencies(BeamTheory::Euler, &beam, Assembly::Free, &free, 30).unwrap();
    let found = natural_frequencies(BeamTheory::Timoshenko, &beam, Assembly::Free, &free, 30);
    let ratio = found.unwrap()[29] / euler[29];
    assert!(
        ratio > 1.03 && ratio < (1.0 - 0.09f64).powf(-0.5),
        "{ratio}"
    );
}

#[test]
fn prop_the_correction_is_smooth_in_width_and_poisson() {
    let joint = JointStiffness::two_parameter(1e3, 10.0);
    let of = |width: f64, poisson: f64| {
        let beam = Beam {
            width,
            poisson,
            thickness: 1e-5,
            ..strip()
        };
        frequencies(&jointed(&beam, Assembly::Cantilever, &joint), 6, MESH)
    };
    let at = of(0.05, 0.3);
    for (by_width, by_poisson) in [(1e-4, 0.0), (0.0, 1e-3)] {
        let [below, above] =
            [-1.0, 1.0].map(|sign| of(0.05 + sign * by_width, 0.3 + sign * by_poisson));
        let [far_below, far_above] =
            [-2.0, 2.0].map(|sign| of(0.05 + sign * by_width, 0.3 + sign * by_poisson));
        for mode in 0..6 {
            let near = above[mode] - below[mode];
            let far = 0.5 * (far_above[mode] - far_below[mode]);
            // The correction grows, and by the same over one and two small steps up to the square of the step.
            assert!(near > 0.0, "mode {}", mode + 1);
            let allowed = 1e-3 * near + 1e-9 * at[mode];
            assert!(
                (near - far).abs() < allowed,
                "mode {}: {near} {far}",
                mode + 1
            );
        }
    }
}

#[test]
fn prop_a_hinge_does_not_jump_where_it_crosses_a_node() {
    let joint = JointStiffness::two_parameter(1e3, 10.0);
    let at = |position: f64| {
        let mut specimen = jointed(&strip(), Assembly::Cantilever, &joint);
        specimen.hinges.push(Hinge {
            position,
            compliance: 1e-4,
        });
        let modes = specimen.modes(6, Mesh { elements: 60 }).unwrap();
        modes.frequencies().to_vec()
    };
    let node = 0.423 * 20.0 / 60.0;
    for (before, after) in at(node - 1e-9).iter().zip(at(node + 1e-9)) {
        // The hinge's element has no second order of its own.
        assert!((before / after - 1.0).abs() < 1e-6, "{before} {after}");
    }
}

#[test]
fn prop_steps_find_the_modes_of_changed_specimens() {
    let joint = JointStiffness::two_parameter(1e3, 10.0);
    let specimen = jointed(&strip(), Assembly::Cantilever, &joint);
    let modes = specimen.modes(7, Mesh::DIAGNOSIS).unwrap();
    let mut other = specimen.clone();
    other.joint = Some(JointStiffness::two_parameter(1.001e3, 10.02).in_si(&strip()));
    let exact = other.modes(7, Mesh::DIAGNOSIS).unwrap();
    let stepped = modes.perturbed(&other).unwrap().unwrap();
    let quotients = modes.rayleigh_frequencies(&other).unwrap();
    let found = stepped.frequencies().iter().zip(quotients);
    for (exact, (stepped, quotient)) in exact.frequencies().iter().zip(found) {
        assert!((stepped / exact - 1.0).abs() < 1e-10, "{stepped} {exact}");
        // The square of a change of shape of some 1e-3.
        assert!((quotient / exact - 1.0).abs() < 1e-6, "{quotient} {exact}");
    }
}

#[test]
fn prop_springs_lie_between_a_free_and_a_clamped_end() {
    for (assembly, joint) in joints() {
        let nominal = jointed(&strip(), assembly, &joint);
        let free = Specimen {
            width_stiffening: WidthStiffening::FreeAtJoint,
            ..nominal.clone()
        };
        let more = nominal.clamp_differences(6, MESH).unwrap();
        let pairs = frequencies(&nominal, 6, MESH)
            .into_iter()
            .zip(frequencies(&free, 6, MESH));
        for ((own, free), more) in pairs.zip(more) {
            let case = format!("{assembly:?} {joint:?}: {own} {free} {more}");
            assert!(own >= free * (1.0 - 1e-9), "{case}");
            assert!((-1e-8..0.02).contains(&more), "{case}");
        }
    }
    // Euler's beam has no width.
    let springs = JointStiffness::two_parameter(1e3, 10.0).in_si(&strip());
    let (theory, layout) = (BeamTheory::Euler, LapLayout::default());
    let euler = Specimen::jointed(
        theory,
        &strip(),
        Assembly::Cantilever,
        &layout,
        Some(springs),
    );
    assert_eq!(
        euler.clamp_differences(2, Mesh::DIAGNOSIS),
        Ok(vec![0.0; 2])
    );
}

/// Where the bending moment varies slowly, the section curls against it by nu kappa: the middle line then moves by
/// nu kappa b^2/24 more than the mean over the width.
#[test]
fn val_the_middle_line_moves_by_the_curling_of_the_section() {
    let free = Specimen {
        width_stiffening: WidthStiffening::FreeAtJoint,
        ..jointed(
            &strip(),
            Assembly::Free,
            &JointStiffness::two_parameter(0.0, 0.0),
        )
    };
    let modes = free.modes(1, MESH).unwrap();
    let (beam, step) = (strip(), 1e-3 * strip().length);
    let middle = 0.5 * beam.length;
    let bend = (modes.slope(0, middle + step) - modes.slope(0, middle - step)) / (2.0 * step);
    let expected = beam.poisson * bend * beam.width.powi(2) / 24.0;
    let found = modes.middle_displacement(0, middle) - modes.displacement(0, middle);
    // The section follows the moment but for twist: (b/L)^2 of it, a few percent here.
    assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
    let euler = Specimen {
        width_stiffening: WidthStiffening::Ignored,
        ..free
    };
    let modes = euler.modes(1, MESH).unwrap();
    assert_eq!(
        modes.middle_displacement(0, middle),
        modes.displacement(0, middle)
    );
}
