//! The description that the user of a virtual test believes: what was planted left out, the joint to
//! be fitted, files and channels as they were written.

use toml::{Table, Value};

use super::plan::VirtualTest;
use tapjoint_description::{Scale, TestDescription};

/// What stands at the head of the description.
const HEAD: &str = "# Recordings of a virtual test, made by `tapjoint simulate`.\n\n";

/// The description's text with recordings as written; the joint's stiffnesses left out, so that they
/// are fitted. `text` is the description that was simulated.
///
/// # Errors
/// A text that is no TOML; it was read before.
pub fn believed_description(
    text: &str,
    test: &TestDescription,
    simulated: &VirtualTest,
) -> Result<String, toml::de::Error> {
    let mut table: Table = text.parse()?;
    // What is planted the user does not know.
    table.remove("effect");
    if let Some(Value::Table(joint)) = table.get_mut("joint") {
        for key in ["kt", "kr", "ktr"] {
            joint.remove(key);
        }
    }
    let mut scales = simulated.scales.iter().zip(1i64..);
    if test.hammer.is_some()
        && let Some(Value::Table(hammer)) = table.get_mut("hammer")
    {
        describe_channel(hammer, scales.next());
    }
    for sensor in tables(&mut table, "sensor") {
        describe_channel(sensor, scales.next());
    }
    for (recording, described) in tables(&mut table, "recording").zip(&test.recordings) {
        let file = super::plan::wav_name(described);
        if let (Some(band), false) = (band_above(simulated, &file), recording.contains_key("band"))
        {
            recording.insert("band".into(), Value::Array(band.map(Value::Float).to_vec()));
        }
        recording.insert("file".into(), file.into());
        recording.remove("sample_rate");
        recording.remove("level");
    }
    Ok(format!("{HEAD}{table}"))
}

/// A band (Hz) that begins above the suspension of a structure that hangs, whose motions on it are no
/// modes of the beam.
fn band_above(simulated: &VirtualTest, file: &str) -> Option<[f64; 2]> {
    let mut recordings = simulated.recordings.iter();
    let recording = recordings.find(|recording| recording.file == file)?;
    // The suspension as the user chose it: what cables add to it belongs to what is planted.
    let [up, rock] = simulated.suspension?;
    let highest = up.max(rock);
    let reach = f64::from(recording.take.sample_rate) / 2.56;
    // Five times the suspension's frequency, in whole hertz: it is 4 % of a resonance there.
    Some([(5.0 * highest).ceil(), reach])
}

fn tables<'t>(table: &'t mut Table, key: &str) -> impl Iterator<Item = &'t mut Table> {
    let entries = table.get_mut(key).and_then(Value::as_array_mut);
    entries
        .into_iter()
        .flatten()
        .filter_map(Value::as_table_mut)
}

fn describe_channel(table: &mut Table, channel: Option<(&Scale, i64)>) {
    let Some((scale, number)) = channel else {
        return;
    };
    table.insert("channel".into(), number.into());
    if let (Scale::PerUnit(scale), false) = (scale, table.contains_key("sensitivity")) {
        table.insert("scale".into(), (*scale).into());
    }
}
