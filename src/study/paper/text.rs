//! The tables as text for a terminal of 80 columns.

use super::{Reproduction, Row, Table, Verdict};

const WIDTH: usize = 80;

/// All tables, each with its remarks, and a count of the verdicts.
pub fn render(reproduction: &Reproduction) -> String {
    let mut text = String::from(
        "The tables of Ingole & Chatterjee beside our numbers\n\n\
         reproduces: yes = equal within the row's tolerance (one unit in the last\n\
         printed digit, unless the rounding of the input is known to leave more);\n\
         rounding = different, but not beyond what that rounding does; NO (n) = see\n\
         remark n; given = measured or chosen, nothing to compute.\n",
    );
    for table in &reproduction.tables {
        text.push('\n');
        text.push_str(&render_table(table));
    }
    let count = |verdict| reproduction.count(verdict);
    text.push_str(&format!(
        "\n{} rows reproduce, {} within the rounding of their input, {} do not,\n{} are given.\n",
        count(Verdict::Reproduces),
        count(Verdict::WithinRounding),
        count(Verdict::DoesNotReproduce),
        count(Verdict::Given),
    ));
    text
}

fn render_table(table: &Table) -> String {
    let mut text = format!("Table {}: {}\n", table.number, table.title);
    text.push_str(&line(&["", "printed", "ours", "diff %", "reproduces"]));
    let mut remarks: Vec<&str> = Vec::new();
    for row in &table.rows {
        let number = row.remark.map(|remark| {
            let known = remarks.iter().position(|known| *known == remark);
            known.unwrap_or_else(|| {
                remarks.push(remark);
                remarks.len() - 1
            }) + 1
        });
        text.push_str(&render_row(row, number));
    }
    for (index, remark) in remarks.iter().enumerate() {
        text.push_str(&wrapped(&format!("({})", index + 1), remark));
    }
    text
}

fn render_row(row: &Row, remark: Option<usize>) -> String {
    let ours = row
        .ours
        .map_or(String::new(), |ours| row.printed.format_like(ours));
    let difference =
        row.difference_percent()
            .map_or(String::new(), |percent| match percent.abs() {
                large if large >= 1000.0 => "> 1000".to_owned(),
                large if large >= 10.0 => format!("{percent:+.1}"),
                _ => format!("{percent:+.3}"),
            });
    let verdict = match row.verdict {
        Verdict::Reproduces => "yes",
        Verdict::WithinRounding => "rounding",
        Verdict::DoesNotReproduce => "NO",
        Verdict::Given => "given",
    };
    let verdict = match remark {
        Some(number) => format!("{verdict} ({number})"),
        None => verdict.to_owned(),
    };
    line(&[&row.label, &row.printed.text, &ours, &difference, &verdict])
}

fn line([label, printed, ours, difference, verdict]: &[&str; 5]) -> String {
    let line = format!("{label:<37}{printed:>10} {ours:>10} {difference:>8} {verdict}");
    format!("{}\n", line.trim_end())
}

/// A remark after its number, broken between words.
fn wrapped(number: &str, remark: &str) -> String {
    let mut text = String::new();
    let mut line = number.to_owned();
    for word in remark.split_whitespace() {
        if line.len() + 1 + word.len() > WIDTH {
            text.push_str(&line);
            text.push('\n');
            line = " ".repeat(number.len());
        }
        line.push(' ');
        line.push_str(word);
    }
    text.push_str(&line);
    text.push('\n');
    text
}
