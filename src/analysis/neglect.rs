//! What the estimates leave out of the described test.

use super::identification::EstimateMethod;
use super::model::TestedStructure;
use super::warning::Warning;
use tapjoint_beam::BeamTheory;
use tapjoint_description::{FitParameter, SensorKind, TestDescription, Weights};

/// What estimate and prediction leave out. The pair regression stands beside the consistent
/// estimate in every report, so that its limits are always told.
pub(super) fn of_neglect(
    test: &TestDescription,
    structure: &TestedStructure,
    method: EstimateMethod,
) -> Vec<Warning> {
    let consistent = method == EstimateMethod::Consistent;
    let mut warnings = Vec::new();
    warnings.extend(of_masses(test, structure, method));
    warnings.extend(of_fastened(test, structure, method));
    if structure.regression.is_some() {
        let texts = of_regression(test, structure, method);
        warnings.extend(texts.into_iter().map(by_pairs));
    }
    if consistent {
        warnings.extend(of_fit(test, structure).into_iter().map(by_estimate));
    } else {
        warnings.extend(of_unused_settings(test).map(by_pairs));
    }
    warnings
}

/// What only the pair regression leaves out.
fn by_pairs(text: String) -> Warning {
    Warning::Neglected {
        text,
        of_pairs: true,
    }
}

/// What the estimate leaves out, or takes otherwise than may have been meant.
fn by_estimate(text: String) -> Warning {
    Warning::Neglected {
        text,
        of_pairs: false,
    }
}

/// What the pair regression cannot take into account.
fn of_regression(
    test: &TestDescription,
    structure: &TestedStructure,
    method: EstimateMethod,
) -> Vec<String> {
    let consistent = method == EstimateMethod::Consistent;
    let choose = |with: &str, without: &str| if consistent { with } else { without }.to_owned();
    let mut texts = Vec::new();
    if structure.theory == BeamTheory::Timoshenko {
        texts.push(choose(
            "the pair regression takes an Euler beam (no shear, no rotary inertia); the consistent \
             estimate and the prediction include both",
            "the pair regression takes an Euler beam (no shear, no rotary inertia); the prediction \
             includes both, so that its errors show what that neglects",
        ));
    }
    if structure.known.any() {
        texts.push(choose(
            "the pair regression cannot hold a stiffness at its known value and estimates all of \
             them; the consistent estimate and the prediction use the known ones",
            "the pair regression cannot hold a stiffness at its known value: it estimates all of \
             them, and the prediction uses the known ones",
        ));
    }
    let joint = &test.joint;
    if joint.overlap.is_some() || joint.right.is_some() || off_centre(test) {
        texts.push(choose(
            "the pair regression takes two equal halves joined in the middle; the consistent estimate \
             and the prediction take overlap, position and the right half's own properties into account",
            "the lap joint's model takes two equal halves joined in the middle: overlap, position and \
             different properties of the right half are left out",
        ));
    }
    texts
}

/// What the pair regression alone makes no use of.
fn of_unused_settings(test: &TestDescription) -> Option<String> {
    let analysis = &test.analysis;
    (analysis.fit.is_some() || analysis.weights.is_some()).then(|| {
        "`fit` and `weights` belong to the consistent estimate: the pair regression estimates all \
         stiffnesses of its model and weighs all pairs alike"
            .to_owned()
    })
}

/// What `fit` leaves to be rigid, and weights that cannot be had.
fn of_fit(test: &TestDescription, structure: &TestedStructure) -> Vec<String> {
    let mut texts = Vec::new();
    if let Some(fit) = test
        .analysis
        .fit
        .as_ref()
        .filter(|_| structure.regression.is_some())
    {
        let known = &structure.known;
        let springs = [
            (FitParameter::Kt, known.kx, "kt"),
            (FitParameter::Kr, known.ky, "kr"),
        ];
        for (parameter, known, name) in springs {
            if known.is_none() && !fit.contains(&parameter) {
                texts.push(format!(
                    "{name} is neither in `fit` nor stated in [joint], so the consistent estimate takes \
                     it as rigid; state its value, or list it in `fit`"
                ));
            }
        }
    }
    let unknown = test.measured.as_ref().is_some_and(|measured| {
        measured.std.is_none() && measured.half_line.is_none() && measured.scatter.is_none()
    });
    if test.analysis.weights == Some(Weights::Measured) && unknown {
        texts.push(
            "weights = \"measured\" needs uncertainties and there are none: equal relative weights \
             were taken, without intervals; state half_line, std or scatter in [measured]"
                .to_owned(),
        );
    }
    texts
}

/// The sensors' masses. A microphone loads nothing.
fn of_masses(
    test: &TestDescription,
    structure: &TestedStructure,
    method: EstimateMethod,
) -> Option<Warning> {
    let loading = || {
        test.sensors
            .iter()
            .filter(|sensor| sensor.kind != SensorKind::Sound)
    };
    let mass: f64 = loading().filter_map(|sensor| sensor.mass).sum();
    if mass <= 0.0 {
        return None;
    }
    let size = format!(
        "the mass of the sensors, {} g or {:.1} % of the beam,",
        grams(mass),
        100.0 * mass / structure.beam.mass()
    );
    let lowers = "it lowers the measured frequencies and thereby what is estimated from them";
    let included = method == EstimateMethod::Consistent && test.analysis.sensor_mass;
    let unplaced = loading().any(|sensor| sensor.mass.is_some() && test.place_of(sensor).is_none());
    match (included, unplaced, structure.regression) {
        (true, true, _) => Some(by_estimate(format!(
            "{size} is in the consistent estimate and the prediction only as far as the sensors' positions are known; state them"
        ))),
        (true, false, None) => Some(by_estimate(format!(
            "{size} is in the prediction and the consistent estimate; the closed form beside it neglects it"
        ))),
        (true, false, Some(_)) => Some(by_pairs(format!(
            "{size} is in the prediction and the consistent estimate; the pair regression neglects it"
        ))),
        (false, ..) => Some(by_estimate(format!(
            "{size} is in neither the estimate nor the prediction; {lowers}"
        ))),
    }
}

/// What is fastened in the reference configuration.
fn of_fastened(
    test: &TestDescription,
    structure: &TestedStructure,
    method: EstimateMethod,
) -> Option<Warning> {
    let first = test.recordings.first()?;
    let mass: f64 = first.masses.iter().map(|fastened| fastened.mass).sum();
    if mass <= 0.0 {
        return None;
    }
    let size = format!(
        "what is fastened to the beam in {}, {} g or {:.1} % of the beam,",
        first.file.display(),
        grams(mass),
        100.0 * mass / structure.beam.mass()
    );
    let included = "is in the prediction and the consistent estimate;";
    Some(match (method, structure.regression) {
        (EstimateMethod::Consistent, None) => by_estimate(format!(
            "{size} {included} the closed form beside it neglects it"
        )),
        (EstimateMethod::Consistent, Some(_)) => by_pairs(format!(
            "{size} {included} the pair regression beside it neglects it"
        )),
        (EstimateMethod::Pairs, _) => by_estimate(format!(
            "{size} is in neither the estimate nor the prediction; begin the description with a recording of the beam without it"
        )),
    })
}

/// A mass (kg) in grams with four significant digits, and no zeros that nobody stated.
fn grams(mass: f64) -> f64 {
    let grams = 1e3 * mass;
    format!("{grams:.3e}").parse().unwrap_or(grams)
}

/// Whether a lap joint sits off the middle by more than a thousandth of the length.
fn off_centre(test: &TestDescription) -> bool {
    let middle = 0.5 * test.beam.length;
    test.joint
        .position
        .is_some_and(|position| (position - middle).abs() > 1e-3 * test.beam.length)
}

#[cfg(test)]
mod tests {
    use super::grams;

    #[test]
    fn val_masses_have_four_digits_and_none_that_nobody_stated() {
        let cases = [
            (0.015, "15"),
            (0.0042, "4.2"),
            (0.012_345_6, "12.35"),
            (1.25, "1250"),
            (1e-6, "0.001"),
        ];
        for (mass, words) in cases {
            assert_eq!(grams(mass).to_string(), words);
        }
    }
}
