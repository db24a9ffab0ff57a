//! Decks for finite-element programs: what stands in them predicts what stands at their head.

use std::path::Path;
use tapjoint::description::TestDescription;
use tapjoint::identify::consistent::{JointedStructure, LapLayout};
use tapjoint::pipeline::{
    Analysis, IdentifySettings, frequencies_of, jointed_structure, run_test, structure_details,
    tested_structure,
};
use tapjoint::report::deck::{
    Deck, LONGEST_REPORT, MOST_FREQUENCIES, deck_of, render_nastran, source_in_report, source_of,
};
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::PointMass;
use tapjoint::structure::{Assembly, Beam, BeamTheory, JointStiffness};

const LAP: &str = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9
    density = 7850\ntolerance = { length = \"2 mm\" }\n[beam.right]\nthickness = 0.007
    density = 2700\nmodulus = 70e9\n[joint]\nkind = \"lap\"\nposition = 0.17
    overlap = { length = 0.04, mass = 0.05 }\n[[sensor]]\nname = \"A\"\nchannel = 2
    position = 0.4\nmass = \"24 g\"\n[analysis]\nfit = [\"kt\", \"kr\", \"modulus\"]\n";

const BEAM: &str = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9
    density = 7850\n";

fn described(text: &str, frequencies: &[f64]) -> TestDescription {
    let list: Vec<String> = frequencies.iter().map(f64::to_string).collect();
    let list = list.join(",");
    let text = format!("{text}[measured]\nscatter = \"0.01 %\"\nfrequencies = [{list}]\n");
    TestDescription::parse(&text, "test.toml").unwrap()
}

fn analysed(test: &TestDescription) -> Analysis {
    run_test(
        test,
        (Path::new("."), "test.toml"),
        &IdentifySettings::default(),
    )
    .unwrap()
}

/// The structure that a deck of a lap joint says, put together again from its numbers alone.
fn rebuilt(deck: &Deck) -> (JointedStructure, JointStiffness) {
    let [left, right] = [0, 1].map(|piece| deck.pieces[piece]);
    let place = deck.nodes[left.last];
    assert_eq!(deck.nodes[right.first], place);
    let beam = Beam {
        length: deck.nodes[right.last],
        ..left.beam
    };
    let mut structure = JointedStructure::new(deck.theory, beam, Assembly::Lap);
    structure.lap = LapLayout {
        position: Some(place),
        right: Some(right.beam),
        overlap: None,
    };
    let masses = deck.masses.iter().map(|own| PointMass {
        position: deck.nodes[own.node],
        mass: own.mass,
        inertia: 0.0,
    });
    structure.masses = masses.collect();
    let (joint, units) = (deck.joint.unwrap(), StiffnessUnits::of(&beam));
    let joint =
        JointStiffness::two_parameter(joint.translation / units.kt, joint.rotation / units.kr);
    (structure, joint)
}

#[test]
fn recover_an_uneven_lap_joint_of_another_beam_from_its_deck() {
    let test = described(LAP, &[1.0]);
    let nominal = tested_structure(&test);
    let details = structure_details(&test, &nominal.beam);
    // A beam that is 1.5 mm longer and 8 % softer than described.
    let beam = Beam {
        length: 0.4245,
        modulus: 190e9,
        ..nominal.beam
    };
    let truth = jointed_structure(&nominal, &details).with_beam(&beam);
    let units = StiffnessUnits::of(&beam);
    let joint = JointStiffness::two_parameter(5.0e5 / units.kt, 900.0 / units.kr);
    let frequencies = frequencies_of(&truth, &joint, 6).unwrap();
    let test = described(LAP, &frequencies);
    let source = source_of(&test, &analysed(&test)).unwrap();
    let deck = deck_of("lap", &source).unwrap();
    let (structure, joint) = rebuilt(&deck);
    let own = frequencies_of(&structure, &joint, 6).unwrap();
    // What the head says without the stiffening by the width.
    let stiffened = deck.frequencies.iter().zip(&deck.stiffening);
    let heads: Vec<f64> = stiffened.map(|(head, more)| head * (1.0 + more)).collect();
    assert!(
        deck.stiffening
            .iter()
            .all(|more| (0.0..0.02).contains(more))
    );
    for ((own, head), measured) in own.iter().zip(&heads).zip(&frequencies) {
        // Elements for one mode more or less: 1e-6 of a frequency. The described places and section of
        // the right half instead of the scaled ones are 1e-3.
        assert!((own / head - 1.0).abs() < 1e-5, "{own} for {head}");
        // The length is told from the modulus only by where the sensor sits; the model may miss 5e-4.
        assert!((own / measured - 1.0).abs() < 5e-4, "{own} for {measured}");
    }
}

#[test]
fn recover_the_closed_form_where_least_squares_has_too_few_modes() {
    let text = "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9
        density = 7850\n[joint]\nkind = \"cantilever\"\nbeam = \"euler\"\n[[sensor]]\nname = \"A\"
        channel = 2\nposition = 0.4\nmass = \"24 g\"\n[analysis]\nfit = [\"kt\", \"kr\", \"modulus\", \"density\"]\n";
    let beam = tested_structure(&described(text, &[1.0])).beam;
    let plain = JointedStructure::new(BeamTheory::Euler, beam, Assembly::Cantilever);
    let truth = JointStiffness::two_parameter(900.0, 12.0);
    let frequencies = frequencies_of(&plain, &truth, 3).unwrap();
    let test = described(text, &frequencies);
    let analysis = analysed(&test);
    let found = analysis.identification.as_ref().unwrap();
    assert!(found.consistent.is_none() && found.estimate.is_some());
    let deck = deck_of("pairs", &source_of(&test, &analysis).unwrap()).unwrap();
    let (joint, units) = (deck.joint.unwrap(), StiffnessUnits::of(&beam));
    // Exact frequencies give exact stiffnesses, up to rounding that the regression magnifies.
    assert!((joint.translation / units.kt / truth.kx - 1.0).abs() < 1e-6);
    assert!((joint.rotation / units.kr / truth.ky - 1.0).abs() < 1e-6);
    // Estimated without the sensor, it has taken its mass in; a deck with both would have it twice.
    assert!(deck.masses.is_empty());
    for (head, measured) in deck.frequencies.iter().zip(&frequencies) {
        assert!((head / measured - 1.0).abs() < 1e-6);
    }
}

#[test]
fn regress_a_nastran_deck_chooses_the_set_that_holds_a_rigid_joint() {
    let held = |joint: &str| {
        let text = format!("{BEAM}[joint]\nkind = \"cantilever\"\n{joint}");
        let test = described(&text, &[17.8, 121.7, 355.4]);
        let source = source_of(&test, &analysed(&test)).unwrap();
        let deck = render_nastran(&deck_of("rigid", &source).unwrap());
        // A constraint set that the case control, above the bulk data, does not name has no effect.
        let (control, bulk) = deck.split_once("BEGIN BULK").unwrap();
        let sets = bulk.lines().filter(|line| line.starts_with("SPC1,1,"));
        (control.contains("SPC = 1\n"), sets.count())
    };
    assert_eq!(held("kt = \"rigid\"\n"), (true, 1));
    assert_eq!(held("kt = \"rigid\"\nkr = \"rigid\"\n"), (true, 2));
    assert_eq!(held(""), (false, 0));
}

#[test]
fn regress_reports_with_values_that_no_report_has_are_refused() {
    let test = described(
        &format!("{BEAM}[joint]\nkind = \"cantilever\"\n"),
        &[17.0, 118.0],
    );
    let joint = "\"kt\": {\"value\": 1.4e6}, \"kr\": {\"value\": 320}";
    let many = format!("[{}]", vec!["{}"; MOST_FREQUENCIES + 1].join(","));
    let cases = [
        ("nothing".to_owned(), "is no report"),
        ("5".to_owned(), "is no report"),
        ("{}".to_owned(), "has no estimate of the joint"),
        (
            "{\"estimate\": {\"kt\": {\"value\": -1}}}".to_owned(),
            "`estimate.kt.value` is -1; allowed: a number from 0 on",
        ),
        (
            format!("{{\"estimate\": {{{joint}, \"ktr\": {{\"value\": 0.0}}}}}}"),
            "`estimate.ktr.value` is 0.0; allowed: a number but 0",
        ),
        (
            format!("{{\"estimate\": {{{joint}, \"beam\": {{\"length\": \"long\"}}}}}}"),
            "`estimate.beam.length` is \"long\"; allowed: a hundredth to a hundred times what the description says",
        ),
        (
            format!("{{\"estimate\": {{{joint}}}, \"prediction\": {many}}}"),
            "`prediction` is a list of 41; allowed: up to 40 modes",
        ),
        (
            format!("{{\"estimate\": {{{joint}, \"beam\": {{\"length\": 1e-200}}}}}}"),
            "`estimate.beam.length` is 1e-200; allowed: a hundredth to a hundred times",
        ),
    ];
    for (text, words) in cases {
        let error = source_in_report(&text, "report.json", &test).unwrap_err();
        assert!(error.to_string().contains(words), "{text}: {error}");
    }
    let long = " ".repeat(LONGEST_REPORT as usize + 1);
    let error = source_in_report(&long, "report.json", &test).unwrap_err();
    assert!(error.to_string().contains("has more than 64 MB"), "{error}");
    let sound = format!("{{\"estimate\": {{{joint}}}, \"prediction\": [{{}}, {{}}]}}");
    let source = source_in_report(&sound, "report.json", &test).unwrap();
    assert_eq!(source.frequencies.len(), 2);
    assert_eq!(source.origin, "from report.json");
}
