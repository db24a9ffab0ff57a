//! Tests of the test description: what a `test.toml` means.

use proptest::prelude::*;
use tapjoint::description::*;

/// A valid description with every table; tests change single lines of it.
const FULL: &str = r#"
name = "Cantilever, one-bolt clamp"

[beam]
length = "423 mm"
width = 0.05
thickness = "0.5 cm"
modulus = "207 GPa"
density = "7.85 g/cm3"
poisson = 0.29
tolerance = { length = 0.001, modulus = "2 %" }

[joint]
kind = "cantilever"
model = "3p"
kt = "1.4 MN/m"
kr = "rigid"
beam = "euler"

[hammer]
channel = 1
scale = 500.0

[[sensor]]
name = "A"
channel = 2
sensitivity = "-100 mV/g"
position = 0.338
mass = "24 g"

[[sensor]]
name = "mic"
channel = "sound level"
kind = "sound"

[[recording]]
file = "low.wav"
tap = "40 mm"
band = [0, "0.2 kHz"]
block = 2048
at = { A = 0.20 }
sample_rate = "5.12 kHz"
torque = "12 N m"
temperature = "293.15 K"
date = 2024-05-17

[[recording]]
file = "frf.txt"
form = "mobility"
sensor = "A"
date = "a Friday"

[analysis]
window = "exponential"
fit_modes = 4
weights = "relative"
sensor_mass = false
fit = ["ktr", "modulus"]
"#;

fn parse(text: &str) -> TestDescription {
    TestDescription::parse(text, "test.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// The smallest valid description of a kind of structure, with more lines appended.
fn minimal(kind: &str, more: &str) -> String {
    format!(
        "[joint]\nkind = \"{kind}\"\n{more}\n[beam]\nlength = 0.6\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n"
    )
}

/// Unit conversions round twice: a few units in the last place.
fn assert_near(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() <= 1e-14 * expected.abs(),
        "{what}: found {found}, expected {expected}"
    );
}

#[test]
fn regress_a_full_description_is_read_in_si_units() {
    let test = parse(FULL);
    assert_eq!(test.name, "Cantilever, one-bolt clamp");
    assert_near(test.beam.length, 0.423, "length");
    assert_near(test.beam.thickness, 0.005, "thickness");
    assert_near(test.beam.modulus, 207e9, "modulus");
    assert_near(test.beam.density, 7850.0, "density");
    assert_eq!(test.beam.poisson, Some(0.29));
    let tolerance = test.beam.tolerance;
    assert_eq!(tolerance.length.std, 0.001);
    assert!(tolerance.length.stated);
    assert_near(tolerance.modulus.std, 4.14e9, "2 % of the modulus");
    assert!(!tolerance.density.stated);
    assert_near(
        tolerance.density.std,
        39.25,
        "0.5 % of the density, assumed",
    );
    assert_eq!(test.joint.kind, Assembly::Cantilever);
    assert_eq!(test.joint.model, JointModel::ThreeParameter);
    assert_eq!(test.joint.kt, Some(1.4e6));
    assert_eq!(test.joint.kr, Some(f64::INFINITY));
    assert_eq!(test.joint.beam, BeamTheory::Euler);
    let hammer = test.hammer.clone().unwrap();
    assert_eq!(
        (hammer.channel, hammer.scale),
        (ChannelRef::Number(1), Some(Scale::PerUnit(500.0)))
    );
    assert!(test.warnings.is_empty(), "{:?}", test.warnings);
    assert!(test.check_has_data("test.toml").is_ok());
}

#[test]
fn regress_sensors_recordings_and_analysis_of_the_full_description() {
    let test = parse(FULL);
    let [accelerometer, microphone] = test.sensors.as_slice() else {
        panic!("two sensors expected, found {:?}", test.sensors);
    };
    // 100 mV for 9.80665 m/s2, mounted the other way: -98.0665 m/s2 for one volt.
    let Some(Scale::PerVolt(scale)) = accelerometer.scale else {
        panic!("a sensitivity is per volt: {:?}", accelerometer.scale);
    };
    assert_near(scale, -98.0665, "scale from a sensitivity");
    assert_near(accelerometer.mass.unwrap(), 0.024, "mass");
    assert_eq!(accelerometer.kind, SensorKind::Acceleration);
    assert_eq!(microphone.channel, ChannelRef::Name("sound level".into()));
    assert_eq!((microphone.position, microphone.scale), (None, None));
    let [low, frf] = test.recordings.as_slice() else {
        panic!("two recordings expected, found {:?}", test.recordings);
    };
    assert_eq!(low.file.to_str(), Some("low.wav"));
    assert_eq!(FULL.lines().nth(low.line - 1), Some("file = \"low.wav\""));
    assert_near(low.tap.unwrap(), 0.04, "tap");
    assert_eq!(low.band, Some((0.0, 200.0)));
    assert_eq!((low.block, low.sample_rate), (Some(2048), Some(5120.0)));
    assert_eq!(low.at.get("A"), Some(&0.20));
    assert_eq!(low.torque, Some(12.0));
    // 293.15 K less 273.15 K loses digits to cancellation.
    assert!(
        (low.temperature.unwrap() - 20.0).abs() < 1e-12,
        "{:?}",
        low.temperature
    );
    assert_eq!(low.date.as_deref(), Some("2024-05-17"));
    assert_eq!(
        (frf.form, frf.sensor.as_deref()),
        (
            Some(FunctionForm::Response(ResponseForm::Mobility)),
            Some("A")
        )
    );
    assert_eq!(frf.date.as_deref(), Some("a Friday"));
    assert_eq!(test.analysis.window, Some(WindowKind::Exponential));
    assert_eq!(test.analysis.fit_modes, Some(4));
    assert_eq!(test.analysis.weights, Some(Weights::Relative));
    assert!(!test.analysis.sensor_mass);
    assert_eq!(
        test.analysis.fit,
        Some(vec![FitParameter::Ktr, FitParameter::Modulus])
    );
}

#[test]
fn regress_defaults_of_a_minimal_description() {
    let test = parse(&minimal("cantilever", ""));
    assert_eq!(test.name, "test", "the name comes from the file's name");
    assert_eq!(test.joint.model, JointModel::TwoParameter);
    assert_eq!(test.joint.beam, BeamTheory::Timoshenko);
    assert_eq!(
        (test.joint.kt, test.joint.kr, test.joint.ktr),
        (None, None, None)
    );
    assert_eq!((test.hammer, test.beam.poisson), (None, None));
    let assumed = test.beam.tolerance.assumed(&test.beam);
    let words: Vec<String> = assumed
        .iter()
        .map(|(name, std)| format!("{name} {std}"))
        .collect();
    let expected = "modulus 1 %, density 0.5 %, thickness 0.025 mm, width 0.1 mm, length 0.6 mm, poisson 0.02, masses 2 %, \
                    positions 1 mm";
    assert_eq!(words.join(", "), expected);
    let analysis = test.analysis;
    assert_eq!(
        (analysis.window, analysis.fit_modes, analysis.weights),
        (None, None, None)
    );
    assert!(analysis.sensor_mass && analysis.fit.is_none());
}

#[test]
fn regress_a_sensor_without_channel_is_the_column_of_its_name() {
    let test = parse(&(minimal("free", "") + "[[sensor]]\nname = \"tip\"\nposition = 0.6\n"));
    assert_eq!(test.sensors[0].channel, ChannelRef::Name("tip".into()));
}

#[test]
fn regress_lap_joint_with_position_overlap_and_right_half() {
    let joint = "position = \"250 mm\"\noverlap = { length = \"40 mm\", mass = 0.05 }\n";
    let text = minimal("lap", joint) + "[beam.right]\nthickness = \"6 mm\"\nmodulus = 70e9\n";
    let joint = parse(&text).joint;
    assert_eq!(joint.position, Some(0.25));
    assert_eq!(
        joint.overlap,
        Some(LapOverlap {
            length: 0.04,
            mass: 0.05
        })
    );
    let right = joint.right.unwrap();
    assert_near(
        right.thickness.unwrap(),
        0.006,
        "thickness of the right half",
    );
    assert_eq!(
        (right.modulus, right.width, right.density),
        (Some(70e9), None, None)
    );
}

#[test]
fn regress_measured_frequencies_with_gaps_and_bounds() {
    let base = minimal("cantilever", "");
    let measured = parse(&format!(
        "{base}[measured]\nfrequencies = [17, \"0.118 kHz\"]\nhalf_line = 0.125\n"
    ))
    .measured
    .unwrap();
    assert_eq!(measured.frequencies, [17.0, 118.0]);
    assert_eq!(measured.modes, [1, 2], "default modes");
    assert_eq!(
        measured.half_line,
        Some(vec![0.125, 0.125]),
        "one number for all"
    );
    let text = "[measured]\nfrequencies = [17, 335.5]\nmodes = [1, 3]\nstd = [0.1, 0.2]\nscatter = \"0.3 %\"\n";
    let measured = parse(&format!("{base}{text}")).measured.unwrap();
    assert_eq!(measured.modes, [1, 3]);
    assert_eq!(measured.std, Some(vec![0.1, 0.2]));
    assert_near(measured.scatter.unwrap(), 0.003, "scatter");
    assert_eq!(measured.half_line, None);
}

#[test]
fn regress_a_free_beam_may_say_that_it_has_no_model() {
    assert!(
        parse(&minimal("free", "model = \"none\""))
            .warnings
            .is_empty()
    );
    let idle = parse(&minimal("free", "model = \"2p\""));
    assert_eq!(idle.warnings.len(), 1, "{:?}", idle.warnings);
}

#[test]
fn regress_byte_order_mark_and_windows_line_ends_are_no_obstacle() {
    let text = format!("\u{feff}{}", FULL.replace('\n', "\r\n"));
    assert_eq!(parse(&text), parse(FULL));
}

#[test]
fn regress_forgotten_units_are_asked_about() {
    // Each line replaces the sound one; the question is what the reader needs to see.
    let cases = [
        ("length = \"423 mm\"", "length = 423", "did you mean mm?"),
        (
            "thickness = \"0.5 cm\"",
            "thickness = 5",
            "did you mean mm?",
        ),
        (
            "modulus = \"207 GPa\"",
            "modulus = 207e3",
            "did you mean GPa?",
        ),
        (
            "density = \"7.85 g/cm3\"",
            "density = 15",
            "did you mean g/cm3?",
        ),
        ("modulus = \"2 %\"", "modulus = 2", "did you mean percent?"),
        ("width = 0.05", "width = 50", "did you mean mm?"),
    ];
    // A sensor of 24 g is too heavy for the lightest of these beams.
    let full = FULL.replacen("mass = \"24 g\"", "", 1);
    for (sound, odd, question) in cases {
        let text = full.replacen(sound, odd, 1);
        assert_ne!(text, full, "{sound} is not in the full description");
        let warnings = parse(&text).warnings;
        let line = text[..text.find(odd).unwrap()].lines().count().max(1);
        let found = warnings.iter().any(|warning| {
            let shown = warning.to_string();
            shown.contains(question) && (warning.line == line || warning.line == line + 1)
        });
        assert!(
            found,
            "{odd}: {warnings:?}, expected \"{question}\" near line {line}"
        );
    }
}

#[test]
fn regress_a_mass_that_every_recording_places_has_a_place() {
    let beam = "[beam]\nlength = \"423 mm\"\nwidth = \"40 mm\"\nthickness = \"4 mm\"\n\
                modulus = \"200 GPa\"\ndensity = 7850\n[joint]\nkind = \"cantilever\"\n\
                [[sensor]]\nname = \"A\"\nchannel = 2\nmass = \"24 g\"\n";
    let warnings = |recordings: &str| {
        let text = format!("{beam}{recordings}");
        let test = TestDescription::parse(&text, "test.toml").unwrap();
        let texts = test.warnings.iter().map(ToString::to_string);
        texts
            .filter(|text| text.contains("has no `position`"))
            .count()
    };
    let placed = "[[recording]]\nfile = \"a.wav\"\nat = { A = 0.2 }\n";
    assert_eq!(warnings(placed), 0);
    let open = "[[recording]]\nfile = \"b.wav\"\n";
    assert_eq!(warnings(open), 1);
    assert_eq!(warnings(&format!("{placed}{open}")), 1);
    assert_eq!(warnings(""), 1);
}

#[test]
fn regress_templates_parse_without_warnings() {
    for kind in [Assembly::Cantilever, Assembly::Lap, Assembly::Free] {
        let test = parse(&template(kind));
        let text = template(kind);
        let placeholder = text
            .split('@')
            .skip(1)
            .find(|word| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_uppercase()));
        assert_eq!(placeholder, None, "{kind:?}");
        assert_eq!(test.joint.kind, kind);
        assert!(test.warnings.is_empty(), "{kind:?}: {:?}", test.warnings);
        assert!(
            test.check_has_data("test.toml").is_ok(),
            "{kind:?} has nothing to analyse"
        );
        let longest = template(kind)
            .lines()
            .map(|line| line.chars().count())
            .max()
            .unwrap();
        assert!(longest <= 170, "{kind:?}: a line of {longest} characters");
    }
}

/// The measured block of a template, as (start, end) of its lines.
fn measured_block(lines: &[&str]) -> (usize, usize) {
    let start = lines
        .iter()
        .position(|line| line.starts_with("# [measured]"))
        .expect("a template shows [measured]");
    let length = lines[start..]
        .iter()
        .position(|line| line.is_empty())
        .expect("a blank line ends the block");
    (start, start + length)
}

#[test]
fn prop_every_commented_key_of_a_template_parses_when_activated() {
    for kind in [Assembly::Cantilever, Assembly::Lap, Assembly::Free] {
        let text = template(kind);
        let lines: Vec<&str> = text.lines().collect();
        let (from, to) = measured_block(&lines);
        let mut activated = 0;
        for at in (0..lines.len()).filter(|at| !(from..to).contains(at)) {
            let Some(key) = lines[at].strip_prefix("# ").filter(|rest| {
                rest.split_once(" = ")
                    .is_some_and(|(key, _)| key.chars().all(|c| c.is_alphanumeric() || c == '_'))
            }) else {
                continue;
            };
            let mut changed = lines.clone();
            changed[at] = key;
            let test = parse(&changed.join("\n"));
            assert!(
                test.warnings.is_empty(),
                "{kind:?}, {key}: {:?}",
                test.warnings
            );
            activated += 1;
        }
        // Beam, joint, hammer, sensor, recording and analysis have this many optional keys at least.
        assert!(
            activated >= 18,
            "{kind:?}: only {activated} keys were tried"
        );
    }
}

#[test]
fn regress_template_with_measured_instead_of_recordings() {
    let text = template(Assembly::Cantilever);
    let lines: Vec<&str> = text.lines().collect();
    let (from, to) = measured_block(&lines);
    let recording = lines
        .iter()
        .position(|line| line.starts_with("[[recording]]"))
        .unwrap();
    let mut changed = lines[..recording].to_vec();
    changed.extend(
        lines[from..to]
            .iter()
            .map(|line| line.strip_prefix("# ").unwrap()),
    );
    changed.extend(&lines[to..]);
    let measured = parse(&changed.join("\n")).measured.unwrap();
    assert_eq!(measured.frequencies, [17.0, 118.0, 335.625, 628.75, 994.5]);
    assert_eq!(measured.scatter, Some(0.003));
}

#[test]
fn regress_templates_name_every_key() {
    let keys = "name length width thickness modulus density poisson tolerance kind model kt kr ktr \
                beam position overlap channel scale sensitivity mass file files length tap band block at \
                sample_rate form sensor accept_taps reject_taps torque temperature date frequencies modes half_line std \
                scatter window reading fit_modes weights sensor_mass fit right poles sheet instrument number \
                operator specimen laboratory remarks";
    let all = template(Assembly::Cantilever) + &template(Assembly::Lap);
    for key in keys.split_whitespace() {
        let named = all
            .split(|c: char| !c.is_alphanumeric() && c != '_')
            .any(|word| word == key);
        assert!(named, "no template mentions `{key}`");
    }
}

#[test]
fn regress_channels_on_the_command_line() {
    assert_eq!("3".parse(), Ok(ChannelRef::Number(3)));
    assert_eq!("force".parse(), Ok(ChannelRef::Name("force".into())));
    assert_eq!("0".parse::<ChannelRef>(), Err(ChannelRefError::Zero));
    assert_eq!(" ".parse::<ChannelRef>(), Err(ChannelRefError::Empty));
}

proptest! {
    #![proptest_config(ProptestConfig {
        // Parsing takes microseconds, so that many cases are affordable; the seed is fixed so
        // that a failure comes back.
        cases: 2000,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20_241),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn prop_arbitrary_text_never_panics(text in any::<String>()) {
        if let Err(error) = TestDescription::parse(&text, "x.toml") {
            let place = format!("x.toml:{}: ", error.line);
            prop_assert!(error.to_string().starts_with(&place), "{}", error);
        }
    }

    /// Text made of pieces of the grammar reaches deeper than arbitrary characters do.
    #[test]
    fn prop_text_of_grammar_pieces_never_panics(pieces in prop::collection::vec(
        prop::sample::select(vec![
            "[beam]\n", "[joint]\n", "[[sensor]]\n", "[[recording]]\n", "[measured]\n", "[hammer]\n",
            "[analysis]\n", "length = ", "kind = ", "kt = ", "name = ", "channel = ", "at = ",
            "frequencies = ", "modes = ", "fit = ", "overlap = ", "1", "-1", "nan", "inf", "1e308",
            "9223372036854775807", "99999999999999999999", "\"423 mm\"", "\"lap\"", "\"free\"",
            "\"rigid\"", "[1, 2]", "[]", "[[", "{ A = 1 }", "{}", "true", "2024-01-01", "\n", ".",
            "\"", "é", "# ", "=",
        ]), 0..40)
    ) {
        let _ = TestDescription::parse(&pieces.concat(), "x.toml");
    }

    /// One valid file with a piece cut out, overwritten or doubled.
    #[test]
    fn prop_mutated_descriptions_never_panic(
        from in 0..FULL.len(), length in 0..60usize, insert in "[ -~\n]{0,8}", lap in any::<bool>()
    ) {
        let text = if lap { FULL.replace("\"cantilever\"", "\"lap\"") } else { FULL.to_owned() };
        let from = from.min(text.len());
        let end = (from + length).min(text.len());
        let mutated = format!("{}{insert}{}", &text[..from], &text[end..]);
        match TestDescription::parse(&mutated, "x.toml") {
            Ok(test) => prop_assert!(test.beam.length > 0.0 && test.beam.modulus.is_finite()),
            Err(error) => {
                let lines = mutated.split('\n').count();
                prop_assert!((1..=lines).contains(&error.line), "line {} of {lines}", error.line);
                prop_assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}
