//! The tables of Ingole & Chatterjee, digits as printed in `tables/`.

// A test that unwraps fails as it should; the lint spares only the test functions themselves.
#![allow(clippy::unwrap_used)]

use tapjoint::identify::{
    ModeLambda, PairsEstimate, PairsModel, estimate_pairs, single_mode_stiffness,
};
use tapjoint::report::{Screen, render_reproduction};
use tapjoint::structure::{
    Assembly, Beam, BeamTheory, JointStiffness, natural_frequencies, natural_lambdas,
    natural_lambdas_of_any_joint,
};
use tapjoint::study::publication::{Agreement, Printed, Reproduction, Table, reproduce};

/// A printed table as (header, rows of text).
fn read(text: &'static str) -> (Vec<&'static str>, Vec<Vec<&'static str>>) {
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    (lines.next().unwrap(), lines.collect())
}

/// One row's printed lambda1 to lambda5.
fn lambdas(header: &[&str], row: &[&'static str]) -> Vec<Printed> {
    let first = header.iter().position(|name| *name == "lambda1").unwrap();
    row[first..first + 5]
        .iter()
        .map(|text| Printed::parse(text).unwrap())
        .collect()
}

fn number(header: &[&str], row: &[&'static str], name: &str) -> f64 {
    let place = header.iter().position(|column| *column == name).unwrap();
    row[place].parse().unwrap()
}

fn estimate(model: PairsModel, lambdas: &[Printed]) -> PairsEstimate {
    let values: Vec<f64> = lambdas.iter().map(|lambda| lambda.value).collect();
    estimate_pairs(model, &ModeLambda::numbered(&values)).unwrap()
}

/// Asserts forward lambdas within one unit in the last printed digit. A number printed with a
/// zero at its end may have been padded to the width of its column, so that its last digit is the
/// one before.
fn assert_forward(assembly: Assembly, joint: &JointStiffness, printed: &[Printed]) {
    let ours = natural_lambdas(assembly, joint, printed.len()).unwrap();
    for (printed, ours) in printed.iter().zip(ours) {
        let unit = if assembly == Assembly::Lap && printed.text.ends_with('0') {
            10.0 * printed.unit
        } else {
            printed.unit
        };
        // The millionth is for the binary fractions that stand for the printed ones.
        let off = (ours - printed.value).abs() / unit;
        assert!(
            off <= 1.0 + 1e-6,
            "{joint:?}: {ours} against {}",
            printed.text
        );
    }
}

#[test]
fn val_table_1a_forward_and_three_parameter_estimates() {
    let (header, rows) = read(include_str!("tables/table1a.csv"));
    assert_eq!(rows.len(), 3);
    for row in &rows {
        let value = |name: &str| number(&header, row, name);
        let joint = JointStiffness::two_parameter(value("kx"), value("ky"));
        let printed = lambdas(&header, row);
        assert_forward(Assembly::Cantilever, &joint, &printed);

        let found = estimate(PairsModel::ThreeParameter, &printed[..4]);
        for (name, found) in [("kx_3p", found.kx), ("ky_3p", found.ky)] {
            // Four modes as printed give the printed estimates to 0.01 %.
            let off = found.unwrap() / value(name) - 1.0;
            assert!(off.abs() < 1e-4, "{joint:?} {name}: {found:?}");
        }
        if joint.kx > 100.0 {
            let place = header.iter().position(|name| *name == "kz_3p").unwrap();
            let printed = Printed::parse(row[place]).unwrap();
            let off = (found.kz.unwrap() - printed.value).abs();
            assert!(
                off <= printed.unit,
                "{joint:?}: {:?} {}",
                found.kz,
                printed.text
            );
        }
    }
}

#[test]
fn val_table_1b_forward_and_its_misprinted_row() {
    let (header, rows) = read(include_str!("tables/table1b.csv"));
    assert_eq!(rows.len(), 4);
    for (index, row) in rows.iter().enumerate() {
        let value = |name: &str| number(&header, row, name);
        let (kx, ky, kz) = (value("kx"), value("ky"), value("kz"));
        let joint = JointStiffness::three_parameter(kx, ky, kz);
        let printed = lambdas(&header, row);
        if index != 2 {
            assert_forward(Assembly::Cantilever, &joint, &printed);
            continue;
        }
        // The third row: what its joint gives instead, and that modes 4 and 5 do agree.
        let ours = natural_lambdas(Assembly::Cantilever, &joint, 5).unwrap();
        for (ours, expected) in ours.iter().zip([1.8679, 4.5755, 7.2838, 9.5658, 12.1462]) {
            assert!(
                (ours - expected).abs() < 0.6e-4,
                "{ours} against {expected}"
            );
        }
        let wrong = printed.iter().zip(&ours);
        let wrong = wrong.filter(|(printed, ours)| (*ours - printed.value).abs() > 3e-4);
        assert_eq!(wrong.count(), 3);
    }
}

#[test]
fn val_table_7_from_table_4() {
    let (header, rows) = read(include_str!("tables/table4.csv"));
    let frequencies = rows.iter().map(|row| number(&header, row, "measured_hz"));
    let lambdas: Vec<f64> = frequencies.map(|f| (0.151_888 * f).sqrt()).collect();
    let modes = ModeLambda::numbered(&lambdas[..4]);
    let found = estimate_pairs(PairsModel::ThreeParameter, &modes).unwrap();
    let pairs = [
        (found.kx, 1928.972),
        (found.ky, 4.6964),
        (found.kz, 876.731),
    ];
    for (found, printed) in pairs {
        // 0.05 %: lambda^2/f is known to six digits, and Kz amplifies them hundredfold.
        assert!(
            (found.unwrap() / printed - 1.0).abs() < 5e-4,
            "{found:?} against {printed}"
        );
    }
    // The regression implies 1.91e-4 for ab - c^2 where its own estimates give 1.09e-4.
    let closure = found.closure.unwrap();
    assert!((closure - (1.91 / 1.09 - 1.0)).abs() < 0.01, "{closure}");
    let two = estimate_pairs(PairsModel::TwoParameter, &modes).unwrap();
    let (kx, ky) = (two.kx.unwrap(), two.ky.unwrap());
    // Worked out independently: 970.5 and 1.251.
    assert!(
        (kx - 970.5).abs() < 0.1 && (ky - 1.251).abs() < 5e-4,
        "{kx} {ky}"
    );
}

/// What `reproduce` remarks on table 5: no lambda of mode 1 gives both of its stiffnesses.
#[test]
fn regress_no_first_lambda_gives_both_stiffnesses_of_table_5() {
    let (kx, ky) = (969.8064, 1.2723);
    let printed = [4.2335, 7.1398, 9.7724];
    let estimate = |first: f64, others: [f64; 3]| {
        let modes = ModeLambda::numbered(&[first, others[0], others[1], others[2]]);
        let found = estimate_pairs(PairsModel::TwoParameter, &modes).unwrap();
        (found.kx.unwrap(), found.ky.unwrap())
    };
    // The lambda that gives one of them, to seven digits, and what it makes of the other. Ky grows 64 times as fast as lambda.
    let (found_kx, found_ky) = estimate(1.606_622, printed);
    assert!((found_kx / kx - 1.0).abs() < 1e-4 && (found_ky - 1.241).abs() < 5e-4);
    let (found_kx, found_ky) = estimate(1.607_254, printed);
    assert!((found_ky / ky - 1.0).abs() < 1e-4 && (found_kx - 972.4).abs() < 0.1);
    // From 1.55 to 1.66, 0.001 % apart: one of both is always off by 0.2 %, 20 times what a step moves.
    for step in 0..11_000 {
        let (found_kx, found_ky) = estimate(1.55 + 1e-5 * f64::from(step), printed);
        let off = [found_kx / kx - 1.0, found_ky / ky - 1.0].map(f64::abs);
        assert!(off[0].max(off[1]) > 2e-3, "{step}: {off:?}");
    }
    // Nor with the others at any end of their last digits: where Ky is as printed, Kx is not.
    let half = 5e-5;
    for pattern in 0..8 {
        let others = [0, 1, 2].map(|index| {
            let sign = if pattern >> index & 1 == 1 { 1.0 } else { -1.0 };
            printed[index] + sign * half
        });
        // Ky rises with lambda.
        let (mut low, mut high) = (1.60, 1.62);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match estimate(middle, others).1 < ky {
                true => low = middle,
                false => high = middle,
            }
        }
        let (found_kx, found_ky) = estimate(low, others);
        assert!((found_ky - ky).abs() < 1e-9);
        assert!((972.2..972.7).contains(&found_kx), "{found_kx}");
    }
}

#[test]
fn val_estimated_joints_put_back_into_the_exact_equation() {
    let beam = Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    };
    let three = JointStiffness::three_parameter(1928.972, 4.6964, 876.731);
    let cases = [
        // Worked out independently, to the digits shown.
        (three, vec![17.02, 118.50, 340.78, 657.67, 1038.24]),
        // Tables 6 and 8 as printed; of table 8 the modes that agree.
        (
            JointStiffness::two_parameter(969.8064, 1.2723),
            vec![11.276, 106.03, 315.44, 599.07, 941.52],
        ),
        (
            JointStiffness::two_parameter(1928.972, 4.6964),
            vec![16.96, 117.56, 337.7, 652.77, 1037.30],
        ),
    ];
    for (joint, printed) in cases {
        let exact = natural_lambdas(Assembly::Cantilever, &joint, 5).unwrap();
        assert_eq!(exact, natural_lambdas_of_any_joint(&joint, 5).unwrap());
        for (lambda, printed) in exact.iter().zip(printed) {
            let found = beam.frequency_of(*lambda);
            // One in the last of five digits.
            assert!(
                (found / printed - 1.0).abs() < 5e-5,
                "{joint:?}: {found} {printed}"
            );
        }
    }
}

#[test]
fn val_table_3_is_a_longer_beam() {
    let (header, rows) = read(include_str!("tables/table3.csv"));
    let beam = Beam {
        length: 0.5,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    };
    let free = JointStiffness::FREE;
    let ours = natural_frequencies(BeamTheory::Euler, &beam, Assembly::Free, &free, 4).unwrap();
    for (row, ours) in rows.iter().zip(ours) {
        let printed = number(&header, row, "fem_hz");
        // Modes 1 and 2 to the digits; 3 and 4 are printed 1 Hz too high, 0.18 % at most.
        assert!(
            (ours / printed - 1.0).abs() < 2e-3,
            "{ours} against {printed}"
        );
    }
}

#[test]
fn val_table_10_forward_and_estimates() {
    let (header, rows) = read(include_str!("tables/table10.csv"));
    // Estimates from five modes, worked out independently from the same digits.
    let expected = [(1002.41, 100.37), (500.30, 50.11), (50.05, 20.04)];
    for (row, (kx, ky)) in rows.iter().zip(expected) {
        let value = |name: &str| number(&header, row, name);
        let joint = JointStiffness::two_parameter(value("kx"), value("ky"));
        let printed = lambdas(&header, row);
        assert_forward(Assembly::Lap, &joint, &printed);
        let found = estimate(PairsModel::Lap, &printed);
        let (found_kx, found_ky) = (found.kx.unwrap(), found.ky.unwrap());
        assert!((found_kx - kx).abs() < 0.0051, "{found_kx} against {kx}");
        assert!((found_ky - ky).abs() < 0.0051, "{found_ky} against {ky}");
    }
}

#[test]
fn val_table_12_follows_mode_by_mode_from_another_factor() {
    let lambdas = [72.0, 197.25].map(|f: f64| (0.288 * f).sqrt());
    let single = single_mode_stiffness(&ModeLambda::numbered(&lambdas)).unwrap();
    let (ky, kx) = (single[0].ky.unwrap(), single[1].kx.unwrap());
    // Worked out independently: 15.44 and 824.5.
    assert!(
        (ky - 15.44).abs() < 0.005 && (kx - 824.5).abs() < 0.05,
        "{ky} {kx}"
    );
}

fn table<'a>(reproduction: &'a Reproduction, number: &str) -> &'a Table {
    reproduction.table(number).unwrap()
}

#[test]
fn val_reproduction_covers_every_table_and_explains_what_differs() {
    let reproduction = reproduce().unwrap();
    let numbers: Vec<&str> = reproduction
        .tables
        .iter()
        .map(|table| table.number)
        .collect();
    let expected = [
        "1a", "1b", "2", "3", "4", "5", "6", "7", "8", "9a", "9b", "10a", "10b", "11", "12", "13",
        "14",
    ];
    assert_eq!(numbers, expected);
    for table in &reproduction.tables {
        for row in &table.rows {
            let explained = row.verdict != Agreement::DoesNotReproduce || row.remark.is_some();
            assert!(explained, "table {}: {row:?}", table.number);
            assert!(
                row.ours.is_none_or(f64::is_finite),
                "table {}: {row:?}",
                table.number
            );
        }
    }
    for number in ["6", "7", "10a", "11"] {
        for row in &table(&reproduction, number).rows {
            assert_eq!(
                row.verdict,
                Agreement::Reproduces,
                "table {number}: {row:?}"
            );
        }
    }
    let misprints = table(&reproduction, "1b").rows.iter();
    let misprints = misprints
        .filter(|row| row.label.contains("lambda") && row.verdict == Agreement::DoesNotReproduce);
    assert_eq!(misprints.count(), 3);
}

#[test]
fn val_table_9_changes_lambdas_where_it_says_frequencies() {
    let reproduction = reproduce().unwrap();
    let verdicts = |number: &str, what: &str| {
        let rows = table(&reproduction, number).rows.iter();
        let rows = rows.filter(|row| row.label.contains(what) && !row.label.starts_with("Kz"));
        let equal = rows
            .clone()
            .filter(|row| row.verdict == Agreement::Reproduces);
        (equal.count(), rows.count())
    };
    // Kx and Ky of both signs: the frequencies give one, the printed lambdas all but one.
    assert_eq!(verdicts("9a", ", f "), (1, 4));
    assert_eq!(verdicts("9b", ", f "), (0, 4));
    assert_eq!(verdicts("9a", ", lambda "), (4, 4));
    assert_eq!(verdicts("9b", ", lambda "), (3, 4));
}

#[test]
fn val_reproduction_fits_a_terminal_of_80_columns() {
    let text = render_reproduction(&reproduce().unwrap(), Screen::default());
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    for number in ["Table 1a", "Table 8", "Table 14"] {
        assert!(text.contains(number), "{number}");
    }
    assert!(text.contains("NO (1)"));
}

#[test]
fn limit_printed_numbers_know_their_last_digit() {
    let cases = [
        ("1.8066", 1.8066, 1e-4),
        ("-8.11e5", -8.11e5, 1e3),
        ("1000", 1000.0, 1.0),
        ("100.270", 100.27, 1e-3),
    ];
    for (text, value, unit) in cases {
        let printed = Printed::parse(text).unwrap();
        assert_eq!(printed.value, value, "{text}");
        // Powers of ten are not exact binary fractions.
        assert!(
            (printed.unit / unit - 1.0).abs() < 1e-12,
            "{text}: {}",
            printed.unit
        );
    }
    for text in ["", "abc", "1.5e", "1e2.5"] {
        let error = Printed::parse(text).unwrap_err();
        assert!(
            error.to_string().contains("not a number"),
            "{text}: {error}"
        );
    }
}
