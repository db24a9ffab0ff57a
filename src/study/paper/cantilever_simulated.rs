//! Table 1: the cantilever, simulated.

use super::printed::{Printed, PrintedTable};
use super::{PaperError, Row, Table, Verdict, estimate_from_printed, joint_label};
use tapjoint_beam::{Assembly, JointStiffness, natural_lambdas};
use tapjoint_identify::PairsModel;

const TABLE_1A: &str = include_str!("../../../tests/validation/tables/table1a.csv");
const TABLE_1B: &str = include_str!("../../../tests/validation/tables/table1b.csv");

/// The paper fits the first four modes.
const FIT_MODES: usize = 4;

/// What the rounding of printed lambdas leaves of a three-parameter estimate, when the same modes
/// and the same equations are used (relative).
const ESTIMATE_TOLERANCE: f64 = 1e-4;

const MISPRINT_1B: &str = "Modes 1 to 3 of this row are misprinted: the row's own joint gives \
    1.8679 4.5755 7.2838. A joint between those of rows 2 and 4 must lie between them.";
const OWN_LAMBDAS: &str = "From our lambdas, rounded alike, in the place of the misprinted ones.";
const WRONG_MODEL: &str = "Two parameters fitted to a three-parameter joint: no joint fits, so the \
    answer depends on how the pair equations are scaled and on the number of modes. No scaling \
    tried gives all four rows.";
const NO_COUPLING: &str = "The coupling is too weak for four decimals of lambda: 1/Kz cannot be \
    told from zero, and its reciprocal may be anything.";

pub(super) fn tables() -> Result<Vec<Table>, PaperError> {
    Ok(vec![table_1a()?, table_1b()?])
}

fn forward(
    label: &str,
    printed: Vec<Printed>,
    joint: &JointStiffness,
) -> Result<Vec<Row>, PaperError> {
    let ours = natural_lambdas(Assembly::Cantilever, joint, printed.len())?;
    let rows = printed.into_iter().zip(ours).enumerate();
    Ok(rows
        .map(|(index, (printed, ours))| {
            Row::to_last_digit(format!("{label}: lambda {}", index + 1), printed, ours)
        })
        .collect())
}

/// Rows for Kx and Ky (and Kz) estimated from printed lambdas.
fn estimated(
    table: &PrintedTable,
    row: usize,
    model: PairsModel,
    lambdas: &[Printed],
) -> Result<Vec<Row>, PaperError> {
    let (estimate, spans) = estimate_from_printed(model, lambdas)?;
    let (suffix, words) = match model {
        PairsModel::ThreeParameter => ("3p", "3 parameters"),
        _ => ("2p", "2 parameters"),
    };
    let mut rows = Vec::new();
    let direct = [("kx", estimate.kx, spans.kx), ("ky", estimate.ky, spans.ky)];
    for (name, ours, span) in direct {
        let printed = table.number(row, &format!("{name}_{suffix}"))?;
        let tolerance = match model {
            PairsModel::ThreeParameter => ESTIMATE_TOLERANCE * printed.value,
            _ => printed.unit,
        };
        let label = format!("  {} by {words}", name.replace('k', "K"));
        let row = Row::within(label, printed, ours.unwrap_or(f64::NAN), tolerance);
        rows.push(row.or_within(span));
    }
    if model == PairsModel::ThreeParameter {
        let printed = table.number(row, "kz_3p")?;
        let ours = estimate.kz.unwrap_or(f64::INFINITY);
        let row = Row::to_last_digit(format!("  Kz by {words}"), printed, ours);
        rows.push(
            row.or_reciprocal_within(spans.cross_compliance)
                .or_because(NO_COUPLING),
        );
    }
    Ok(rows)
}

fn table_1a() -> Result<Table, PaperError> {
    let table = PrintedTable::new(TABLE_1A);
    let mut rows = Vec::new();
    for row in 0..table.len() {
        let (kx, ky) = (table.number(row, "kx")?, table.number(row, "ky")?);
        let joint = JointStiffness::two_parameter(kx.value, ky.value);
        let lambdas = table.lambdas(row)?;
        rows.extend(forward(&joint_label(&kx, &ky), lambdas.clone(), &joint)?);
        let used = &lambdas[..FIT_MODES.min(lambdas.len())];
        rows.extend(estimated(&table, row, PairsModel::TwoParameter, used)?);
        rows.extend(estimated(&table, row, PairsModel::ThreeParameter, used)?);
    }
    Ok(Table {
        number: "1a",
        title: "two-parameter joint, simulated: lambda and estimates from four modes",
        rows,
    })
}

fn table_1b() -> Result<Table, PaperError> {
    let table = PrintedTable::new(TABLE_1B);
    let mut rows = Vec::new();
    for row in 0..table.len() {
        let (kx, ky) = (table.number(row, "kx")?, table.number(row, "ky")?);
        let kz = table.number(row, "kz")?;
        let joint = JointStiffness::three_parameter(kx.value, ky.value, kz.value);
        let printed = table.lambdas(row)?;
        let label = format!("{}, Kz {}", joint_label(&kx, &ky), kz.text);
        let lambdas = forward(&label, printed, &joint)?;
        let used = usable(&lambdas)?;
        let misprinted = lambdas
            .iter()
            .any(|row| row.verdict == Verdict::DoesNotReproduce);
        rows.extend(lambdas.into_iter().map(|row| row.or_because(MISPRINT_1B)));
        let two = estimated(&table, row, PairsModel::TwoParameter, &used)?;
        let two = two.into_iter().map(|row| row.or_because(WRONG_MODEL));
        let three = estimated(&table, row, PairsModel::ThreeParameter, &used)?;
        rows.extend(two.chain(three).map(|row| match misprinted {
            true => row.noting(OWN_LAMBDAS),
            false => row,
        }));
    }
    Ok(Table {
        number: "1b",
        title: "three-parameter joint, simulated: lambda and estimates from four modes",
        rows,
    })
}

/// The printed lambdas of the fitted modes; for a misprinted one ours, rounded alike.
fn usable(rows: &[Row]) -> Result<Vec<Printed>, PaperError> {
    let lambda = |row: &Row| match (row.verdict, row.ours) {
        (Verdict::DoesNotReproduce, Some(ours)) => Printed::parse(&format!("{ours:.4}")),
        _ => Ok(row.printed.clone()),
    };
    rows.iter().take(FIT_MODES).map(lambda).collect()
}
