//! The published tables beside our numbers, as text for a terminal.

use super::text_table::wrapped;
use tapjoint_study::publication::{Reproduction, Row, Table, Verdict};

/// Renders all tables, each with its remarks, and a count of the verdicts.
pub fn render_reproduction(reproduction: &Reproduction) -> String {
    let mut text = String::from(
        "The tables of Ingole & Chatterjee beside our numbers\n\n\
         reproduces: yes = equal within the row's tolerance (one unit in the last\n\
         printed digit, unless the rounding of the input is known to leave more);\n\
         rounding = different, but not beyond what that rounding does; NO (n) = see\n\
         remark n; given = measured or chosen, nothing to compute.\n",
    );
    for table in &reproduction.tables {
        text.push('\n');
        text.push_str(&table_text(table));
    }
    text.push_str(&format!(
        "\n{} rows reproduce, {} within the rounding of their input, {} do not,\n{} are given.\n",
        reproduction.count(Verdict::Reproduces),
        reproduction.count(Verdict::WithinRounding),
        reproduction.count(Verdict::DoesNotReproduce),
        reproduction.count(Verdict::Given),
    ));
    text
}

fn table_text(table: &Table) -> String {
    let mut text = format!("Table {}: {}\n", table.number, table.title);
    text.push_str(&line("", "printed", "ours", "diff %", "reproduces"));
    let mut remarks: Vec<&str> = Vec::new();
    for row in &table.rows {
        let mut verdict = match row.verdict {
            Verdict::Reproduces => "yes",
            Verdict::WithinRounding => "rounding",
            Verdict::DoesNotReproduce => "NO",
            Verdict::Given => "given",
        }
        .to_owned();
        if let Some(remark) = row.remark {
            let known = remarks.iter().position(|known| *known == remark);
            let place = known.unwrap_or(remarks.len());
            if known.is_none() {
                remarks.push(remark);
            }
            verdict = format!("{verdict} ({})", place + 1);
        }
        text.push_str(&row_text(row, &verdict));
    }
    for (index, remark) in remarks.iter().enumerate() {
        let number = format!("({})", index + 1);
        text.push_str(&wrapped(&format!("{number} {remark}"), number.len() + 1));
    }
    text
}

fn row_text(row: &Row, verdict: &str) -> String {
    let ours = row.ours.map(|ours| row.printed.format_like(ours));
    let difference = match row.difference_percent() {
        None => String::new(),
        Some(percent) if percent.abs() >= 1000.0 => "> 1000".to_owned(),
        Some(percent) if percent.abs() >= 10.0 => format!("{percent:+.1}"),
        Some(percent) => format!("{percent:+.3}"),
    };
    let ours = ours.unwrap_or_default();
    line(&row.label, &row.printed.text, &ours, &difference, verdict)
}

fn line(label: &str, printed: &str, ours: &str, difference: &str, verdict: &str) -> String {
    let line = format!("{label:<37}{printed:>10} {ours:>10} {difference:>8} {verdict}");
    format!("{}\n", line.trim_end())
}
