//! The commented `test.toml` for a new test.

use super::Assembly;

const HEAD: &str = r#"# Test description for tapjoint. Replace the values by those of your test, then: tapjoint run test.toml
#
# A bare number is in SI units. A text may have a unit: "423 mm", "207 GPa", "24 g", "2 %".
# Positions are measured along the beam, in m, from @ORIGIN@.
# Lines such as `# key = value` show the default of a key, or an example of it.

name = "@NAME@"                # default: the name of this file; the report goes to <name>-report

[beam]                         # @BEAM@
length = 0.423                 # m
width = 0.05                   # m
thickness = 0.005              # m, in the direction of vibration
modulus = "207 GPa"            # Young's modulus, Pa
density = 7850                 # kg/m3
# poisson = 0.3                # Poisson's ratio, default 0.3; enters shear deformation only
# tolerance = { length = "1 mm", width = "0.1 mm", thickness = "0.05 mm", modulus = "2 %", density = "1 %" }   # standard uncertainties, default: none stated
"#;

const CANTILEVER: &str = r#"
[joint]
kind = "cantilever"            # "cantilever": held at one end | "lap": two halves joined | "free": no joint
model = "2p"                   # "2p" (default): translation and rotation | "3p": and their coupling
# kt = 1.4e6                   # N/m, default: fitted. A stated value, or "rigid", is compared instead of fitted
# kr = 320                     # N m/rad, default: fitted
#   ktr = 2e4, N/rad, only with model = "3p", default: fitted; negative where elasticity reaches into the support
# beam = "timoshenko"          # "timoshenko" (default): with shear and rotary inertia | "euler": bending only
"#;

const LAP: &str = r#"
#   [beam.right] holds width, thickness, modulus, density, poisson of the right half where they
#   differ from the left one's, default: the same.

[joint]
kind = "lap"                   # "cantilever": held at one end | "lap": two halves joined | "free": no joint
# model = "2p"                 # translation and rotation, the only model of a lap joint
# kt = 1.4e6                   # N/m, default: fitted. A stated value, or "rigid", is compared instead of fitted
# kr = 320                     # N m/rad, default: fitted
# beam = "timoshenko"          # "timoshenko" (default): with shear and rotary inertia | "euler": bending only
# position = 0.2115            # m, default: the middle
# overlap = { length = "40 mm", mass = "50 g" }   # the overlapping piece with its bolts, default: none
"#;

const FREE: &str = r#"
[joint]
kind = "free"                  # "cantilever": held at one end | "lap": two halves joined | "free": no joint
# beam = "timoshenko"          # "timoshenko" (default): with shear and rotary inertia | "euler": bending only
"#;

/// The line that begins the table of a recording.
const RECORDING: &str = "[[recording]]                  # once for each file; the same file may be read in several bands";

const INSTRUMENTS: &str = r#"
[hammer]                       # remove this table for a test without an instrumented hammer
channel = 1                    # 1-based, not counting a time column; or the name of a CSV column
# scale = 1.0                  # N per unit of the file, default: 1, or the unit in the CSV header; integer WAV: full scale = 1
#   sensitivity = "2.25 mV/N" instead of scale for files in volts

[[sensor]]                     # once for each sensor
name = "A"
channel = 2                    # default: the CSV column with the sensor's name
# scale = 1.0                  # m/s2 per unit of the file (m/s, m, Pa by kind), default as above; negative: mounted the other way
#   sensitivity = "100 mV/g" instead of scale for files in volts
position = 0.338               # m
# mass = "24 g"                # kg, from the data sheet, default: not known
# kind = "acceleration"        # "acceleration" (default) | "velocity" | "displacement" | "sound"

[[recording]]                  # once for each file; the same file may be read in several bands
file = "taps.wav"              # WAV, CSV or UFF58, seen from the folder of this file
#   files = ["1.wav", "2.wav"] instead of file: one set-up in several files, a tap each or repeats
# tap = 0.04                   # m, where the hammer strikes, default: not known
# level = 1                    # force of the taps relative to the other recordings, only for `tapjoint simulate`, default: 1
# band = [0, 200]              # Hz, zoom band, default: 0 to sample rate/2.56
# block = 2048                 # samples, block/2.56 lines are shown; default: what fits the shortest tap
# at = { A = 0.20 }            # m, sensors moved for this recording, default: none
# mass = [{ position = 0.423, mass = "15 g" }]   # known masses fastened for this recording, default: none
# sample_rate = 5120           # Hz, for a CSV file without a time column, default: from the file
# overload = "keep"            # use taps that drove a channel to its limit, from where their decays are whole; default: "reject"
# torque = 12                  # N m, carried to the outputs, default: none
# temperature = 21             # degrees Celsius, carried to the outputs, default: none
# date = 2024-05-17            # carried to the outputs, default: none
#   form = "accelerance" | "mobility" | "receptance" and sensor = "A" where the file holds a frequency response function

#   Or, instead of all [[recording]] tables, natural frequencies that were measured elsewhere:
# [measured]
# frequencies = [17, 118, 335.625, 628.75, 994.5]   # Hz, ascending
# modes = [1, 2, 3, 4, 5]      # default 1..n; gaps allowed
# half_line = 0.125            # Hz, half the line spacing, one number or a list; or std = ..., one standard deviation in Hz
# scatter = "0.3 %"            # repeatability, default: none; std^2 = half_line^2/3 + (scatter f)^2

[analysis]
# window = "exponential"       # "rectangular" | "hann" | "exponential"; default: rectangular where the tap rings down to 1 % in the block, else exponential
# reading = "fit"              # how frequencies are read: "fit" (default) | "interpolated" | "line", the paper's way
# fit_modes = 4                # number of modes that enter the estimate, from the first, default: all
# weights = "measured"         # "measured" (default where uncertainties are known) | "relative": equal relative weights
# sensor_mass = true           # the sensors' masses enter the model, default: true
"#;

const FIT_JOINT: &str = "# fit = [\"kt\", \"kr\"]           # estimated quantities, default: the joint's stiffnesses; also \"modulus\", \"density\", and \"ktr\" with model = \"3p\"\n";
const FIT_LAP: &str = "# fit = [\"kt\", \"kr\"]           # estimated quantities, default: the joint's stiffnesses; also \"modulus\", \"density\"\n";
const FIT_FREE: &str =
    "# fit = [\"modulus\"]            # estimated quantities, default: modulus; also \"density\"\n";

/// Comment of a template on its example frequencies.
const STAND_IN: &str = "#   Example frequencies, so that this file runs unchanged. Fill in [[recording]] above and remove this\n\
                        #   table, or write here the natural frequencies that were measured elsewhere:";

/// Returns a template that runs unchanged: it holds example frequencies, and the table of the recordings is
/// commented out.
pub fn runnable_template(kind: Assembly) -> String {
    let frequencies = match kind {
        Assembly::Cantilever => "[16.625, 115.25, 323.125, 601.125, 949.25]",
        Assembly::Lap => "[97.5, 387.125, 657.75, 1110.25, 1698.625]",
        Assembly::Free => "[147.375, 406, 794.75, 1311.5, 1954.5]",
    };
    let text = template(kind);
    let mut recording = false;
    let lines = text.lines().map(|line| {
        recording = (recording || line == RECORDING) && !line.is_empty();
        match line {
            "" => String::new(),
            _ if recording && !line.starts_with('#') => format!("# {line}"),
            _ if line.starts_with("#   Or, instead") => STAND_IN.to_owned(),
            _ if line.starts_with("# [measured]") => "[measured]".to_owned(),
            _ if line.starts_with("# frequencies = ") => {
                format!("frequencies = {frequencies}   # Hz, ascending")
            }
            _ if line.starts_with("# half_line = ") => line.replacen("# ", "", 1),
            _ => line.to_owned(),
        }
    });
    lines.map(|line| line + "\n").collect()
}

/// Returns a template with a table for each of these recordings.
pub fn template_of(kind: Assembly, files: &[String]) -> String {
    let tables: Vec<String> = files
        .iter()
        .map(|file| format!("{RECORDING}\nfile = {}\n", toml::Value::from(file.as_str())))
        .collect();
    let text = template(kind);
    let Some((head, rest)) = text.split_once(RECORDING) else {
        return text;
    };
    // The first file replaces the example, whose comments stay. The others follow it.
    let rest = rest.split_once('\n').map_or("", |(_, rest)| rest);
    let rest = rest.split_once('\n').map_or("", |(_, rest)| rest);
    let [first, others @ ..] = tables.as_slice() else {
        return text.clone();
    };
    let (comments, tail) = rest.split_once("\n\n").unwrap_or((rest, ""));
    let others: String = others.iter().map(|table| format!("\n{table}")).collect();
    format!("{head}{first}{comments}\n{others}\n{tail}")
}

/// Returns a commented test description: every key with its default and unit. It is valid unchanged; its
/// values are examples.
pub fn template(kind: Assembly) -> String {
    let (name, origin, beam, joint, fit) = match kind {
        Assembly::Cantilever => (
            "Cantilever",
            "the joint",
            "the part that is free to vibrate",
            CANTILEVER,
            FIT_JOINT,
        ),
        Assembly::Lap => (
            "Lap joint",
            "the left end",
            "both halves together, length = total",
            LAP,
            FIT_LAP,
        ),
        Assembly::Free => (
            "Free beam",
            "the left end",
            "the whole beam",
            FREE,
            FIT_FREE,
        ),
    };
    let head = HEAD
        .replace("@NAME@", name)
        .replace("@ORIGIN@", origin)
        .replace("@BEAM@", beam);
    [head.as_str(), joint, INSTRUMENTS, fit].concat()
}
