//! The commented `test.toml` for a new test.

use tapjoint_signal::recording::MOST_FILES;

use super::{Assembly, FunctionForm, ResponseForm, SENSOR_KINDS, SensorKind};

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
# poisson = 0.3                # Poisson's ratio, default 0.3; enters shear and stiffening by the width
# tolerance = { length = "1 mm", modulus = "2 %" }   # standard uncertainties; "exact": none. Default: modulus 1 %, density 0.5 %,
#   thickness 0.5 % or 0.02 mm, width 0.2 % or 0.05 mm, length 0.1 % or 0.5 mm (the larger), poisson 0.02, masses on the beam 2 %
# position_tolerance = "1 mm"   # standard uncertainty of positions on the beam, default: 1 mm
# mass = "830 g"                # the bare bar on a balance, good to 0.1 % or 0.5 g; density is then optional
"#;

const CANTILEVER: &str = r#"# bar_length = "450 mm"         # the whole bar as weighed and tested free, a clamped part included; default: length
# free_test = "free.toml"        # the test of the same bar free at both ends, a description with kind = "free"; default: none
#   free_frequencies = [102.1, 281.5] and free_std = 0.02 instead, both in Hz: modes 1, 2, ... of the free bar

[joint]
kind = "cantilever"            # "cantilever": held at one end | "lap": two halves joined | "free": no joint
model = "2p"                   # "2p" (default): translation and rotation | "3p": and their coupling
# kt = 1.4e6                   # N/m, default: fitted. A stated value, or "rigid", is compared instead of fitted
# kr = 320                     # N m/rad, default: fitted
#   ktr = 2e4, N/rad, only with model = "3p", default: fitted; negative where elasticity reaches into the support
# beam = "timoshenko"          # "timoshenko" (default): with shear, rotary inertia and stiffening by the width | "euler": bending only
"#;

const LAP: &str = r#"
#   [beam.right] holds width, thickness, modulus, density, poisson of the right half where they
#   differ from the left one's, default: the same.

[joint]
kind = "lap"                   # "cantilever": held at one end | "lap": two halves joined | "free": no joint
# model = "2p"                 # translation and rotation, the only model of a lap joint
# kt = 1.4e6                   # N/m, default: fitted. A stated value, or "rigid", is compared instead of fitted
# kr = 320                     # N m/rad, default: fitted
# beam = "timoshenko"          # "timoshenko" (default): with shear, rotary inertia and stiffening by the width | "euler": bending only
# position = 0.2115            # m, default: the middle
# overlap = { length = "40 mm", mass = "50 g" }   # the overlapping piece with its bolts, default: none
"#;

const FREE: &str = r#"
[joint]
kind = "free"                  # "cantilever": held at one end | "lap": two halves joined | "free": no joint
# beam = "timoshenko"          # "timoshenko" (default): with shear, rotary inertia and stiffening by the width | "euler": bending only
"#;

/// The line that begins the table of a recording.
const RECORDING: &str = "[[recording]]                  # once for each file; the same file may be read in several bands";

const INSTRUMENTS: &str = r#"
[hammer]                       # remove this table for a test without an instrumented hammer
channel = 1                    # 1-based, not counting a time column; or the name of a CSV column
# scale = 1.0                  # N per unit of the file, default: 1, or the unit in the CSV header; integer WAV: full scale = 1
#   sensitivity = "2.25 mV/N" instead of scale for files in volts
# instrument = "make, type, serial number"   # for the sheet

[[sensor]]                     # once for each sensor
name = "A"
channel = 2                    # default: the CSV column with the sensor's name
# scale = 1.0                  # m/s2 per unit of the file (m/s, m, Pa by kind), default as above; negative: mounted the other way
#   sensitivity = "100 mV/g" instead of scale for files in volts
position = 0.338               # m
# mass = "24 g"                # kg, from the data sheet, default: not known
# instrument = "make, type, serial number"   # for the sheet
# kind = "acceleration"        # "acceleration" (default) | "velocity" | "displacement" | "sound"

[[recording]]                  # once for each file; the same file may be read in several bands
file = "taps.wav"              # WAV, FLAC, CSV, UFF58, LabVIEW .lvm or MATLAB .mat, seen from the folder of this file
#   files = ["1.wav", "2.wav"] instead of file: one set-up in several files, a tap each or repeats
#   length = "200 mm" where the clamp of a cantilever was moved for this recording: its free length; positions count from the clamp
# tap = 0.04                   # m, where the hammer strikes, default: not known
# level = 1                    # force of the taps relative to the other recordings, only for `tapjoint simulate`, default: 1
# band = [0, 200]              # Hz, zoom band, default: 0 to sample rate/2.56
# block = 2048                 # samples, block/2.56 lines are shown; default: what fits the shortest tap
# at = { A = 0.20 }            # m, sensors moved for this recording, default: none
# mass = [{ position = 0.423, mass = "15 g" }]   # known masses fastened for this recording, default: none
# sample_rate = 5120           # Hz, for a CSV file without a time column, default: from the file
# overload = "keep"            # "reject" (default) taps that drove a channel to its limit | "keep" the decay after the last clipped sample
# reject_taps = [4.905]        # s, taps to leave out, at the times of the table of taps, default: none
# accept_taps = [12.31]        # s, rejected taps to use all the same, default: none
# torque = 12                  # N m, carried to the outputs, default: none
# temperature = 21             # degrees Celsius, carried to the outputs, default: none
# date = 2024-05-17            # carried to the outputs, default: none
# poles = [16.55, 116.8]       # Hz, the modes chosen by hand in this recording, default: those of [analysis]
# time_unit = "ms"             # "s" (default) | "ms" | "us" | "ns", for a CSV file whose time has no unit
#   form = "accelerance" | "mobility" | "receptance" and sensor = "A" where the file holds a frequency response function,
#   form = "spectrum" where it holds magnitudes without a phase: frequencies and half-power damping
#   values = "complex" | "magnitude-phase" | "dB-degrees" where the columns of a function do not say so
#   variables = { samples = "data", rate = "fs" } or { frf = "H", frequency = "f" } of a MATLAB file

#   Or, instead of all [[recording]] tables, natural frequencies that were measured elsewhere:
# [measured]
# frequencies = [17, 118, 335.625, 628.75, 994.5]   # Hz, ascending
#                              # instead of frequencies: file = "modes.unv", a universal file with datasets 55, numbered by the model;
#                              # its shapes count with first_node = { number = 1, position = "30 mm" }, the node nearest to @ORIGIN@
# modes = [1, 2, 3, 4, 5]      # default 1..n; gaps allowed
# half_line = 0.125            # Hz, half the line spacing, one number or a list; or std = ..., one standard deviation in Hz
# scatter = "0.3 %"            # repeatability, default: none; std^2 = half_line^2/3 + (scatter f)^2

[analysis]
# window = "exponential"       # "rectangular" | "hann" | "exponential"; default: rectangular where the tap rings down to 1 % in the block, else exponential
# reading = "fit"              # how frequencies are read: "fit" (default) | "interpolated" | "line", the paper's way
# select = "consistent"        # taps whose response departs from that of the others are rejected; default: "all"; needs [hammer] and four taps
# fit_modes = 4                # number of modes that enter the estimate, from the first, default: all
# poles = [16.55, 116.8]       # Hz, the modes chosen by hand, default: found by the program; the stabilisation diagram of report.html writes this line
# weights = "measured"         # "measured" (default where uncertainties are known) | "relative": equal relative weights
# sensor_mass = true           # the sensors' masses enter the model, default: true
"#;

const SHEET: &str = r#"
[sheet]                        # texts for the sheet of `run --sheet`, all of them optional
# number = "2024-017"
# date = 2024-05-17
# operator = "name"
# specimen = "what was tested, serial number"
# laboratory = "name"
# remarks = "anything else"
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
        Assembly::Cantilever => "[16.625, 115.375, 324, 603.25, 954.625]",
        Assembly::Lap => "[97.625, 387.875, 660.25, 1115.625, 1714.625]",
        Assembly::Free => "[147.5, 407.25, 799.625, 1323.5, 1978.75]",
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

/// What a file of the test holds.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundRecording {
    /// The file, as a description would name it.
    pub file: String,
    /// What was found in it.
    pub content: FoundContent,
}

/// What was found in a file.
#[derive(Debug, Clone, PartialEq)]
pub enum FoundContent {
    /// A time series.
    Series {
        /// All channels, in the order of the file.
        channels: Vec<FoundChannel>,
        /// The hammer's channel (0-based), and what shows it.
        hammer: Option<(usize, &'static str)>,
        /// Samples per second (Hz).
        sample_rate: f64,
        /// Number of taps.
        taps: usize,
    },
    /// Functions of frequency.
    Functions {
        /// Their form; `None` where the file does not say.
        form: Option<FunctionForm>,
        /// First and last line (Hz).
        band: (f64, f64),
        /// Number of functions.
        count: usize,
    },
    /// Reason why it was not read.
    Unread(String),
}

/// A channel of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundChannel {
    /// Its name, where the file gives one.
    pub name: Option<String>,
    /// Its unit, where the file gives one.
    pub unit: Option<String>,
    /// What it senses, by its unit.
    pub kind: Option<SensorKind>,
}

/// Returns a template with what was found in these files: hammer, sensors and recordings. Everything else stays an
/// example.
pub fn template_of(kind: Assembly, files: &[FoundRecording]) -> String {
    let text = template(kind);
    let (Some((head, _)), Some((instruments, recording))) =
        (text.split_once("\n[hammer]"), text.split_once(RECORDING))
    else {
        return text;
    };
    let (comments, tail) = recording.split_once("\n\n").unwrap_or((recording, ""));
    // The first line below the header is the example's file.
    let comments: Vec<&str> = comments.lines().skip(2).collect();
    let series = files.iter().find_map(|found| match &found.content {
        FoundContent::Series {
            channels, hammer, ..
        } => Some((channels.as_slice(), *hammer)),
        _ => None,
    });
    let has_functions = files
        .iter()
        .any(|found| matches!(found.content, FoundContent::Functions { .. }));
    let instruments = match series {
        Some((channels, hammer)) => instruments_found(channels, hammer),
        None if has_functions => SENSOR_OF_FUNCTIONS.to_owned(),
        None => format!(
            "[hammer]{}",
            &instruments[head.len() + "\n[hammer]".len()..]
        ),
    };
    // Functions are of the first sensor.
    let names = instruments.split("[[sensor]]\nname = ").nth(1);
    let sensor = names
        .and_then(|text| text.lines().next())
        .unwrap_or("\"A\"");
    let mut tables = String::new();
    for (at, found) in files.iter().enumerate() {
        tables.push_str(&recording_found(found, sensor));
        // The comments on all other keys stand once.
        if at == 0 {
            let others = comments
                .iter()
                .filter(|line| !tables.contains(key_of(line)));
            let others: String = others.map(|line| format!("{line}\n")).collect();
            tables.push_str(&others);
        }
        tables.push('\n');
    }
    tables += &one_set_up(files);
    let head = head.replacen("[beam]", &format!("{EXAMPLES}\n[beam]"), 1);
    format!("{head}\n{instruments}{tables}{tail}")
}

/// Returns one commented table for all files together, where each holds one tap and all may be of one set-up. Then their
/// names differ in digits alone, and they have the same channels and rate.
fn one_set_up(files: &[FoundRecording]) -> String {
    let alike = |one: &FoundRecording, other: &FoundRecording| {
        let (
            FoundContent::Series {
                channels,
                sample_rate,
                taps,
                ..
            },
            FoundContent::Series {
                channels: theirs,
                sample_rate: rate,
                ..
            },
        ) = (&one.content, &other.content)
        else {
            return false;
        };
        let [name, their_name] = [one, other].map(|found| {
            let letters = found.file.chars().filter(|c| !c.is_ascii_digit());
            letters.collect::<String>()
        });
        *taps == 1 && sample_rate == rate && channels == theirs && name == their_name
    };
    let several = 2..=MOST_FILES;
    if !several.contains(&files.len()) || !files.iter().all(|file| alike(file, &files[0])) {
        return String::new();
    }
    let names = files.iter().map(|found| found.file.as_str().into());
    let names = toml::Value::Array(names.collect());
    format!(
        "#   The files hold one tap each. If all are of one set-up, write this instead of the tables above:\n# [[recording]]\n# files = {names}\n\n"
    )
}

/// Returns the beginning of a commented line up to its equals sign; what no other line holds where it has none.
fn key_of(line: &str) -> &str {
    let key = line
        .strip_prefix("# ")
        .and_then(|rest| rest.split_once(" = "));
    key.map_or("\u{0}", |_| {
        &line[2..line.find(" = ").map_or(line.len(), |end| end + 3)]
    })
}

/// Line above the beam, of which no recording says anything.
const EXAMPLES: &str = "# EXAMPLES: the files do not say what the beam is. Replace every value of this table and of [joint].";

/// Sensor of functions in files.
const SENSOR_OF_FUNCTIONS: &str = r#"[[sensor]]                     # the sensor of the functions; once for each
name = "A"
# position = 0.338             # m, not known from the files: give it
# mass = "24 g"                # kg, from the data sheet, default: not known

"#;

/// Returns `[hammer]` and `[[sensor]]` as found.
fn instruments_found(channels: &[FoundChannel], hammer: Option<(usize, &str)>) -> String {
    let mut text = String::new();
    match hammer {
        Some((channel, shown)) => {
            text += &format!(
                "[hammer]\nchannel = {}                    # {}, found {shown}\n",
                channel + 1,
                title(&channels[channel])
            );
            text += match channels[channel].unit.as_deref() {
                Some("N") => {
                    "# scale = 1.0                  # N per unit of the file; its unit is used\n\n"
                }
                Some("V") => {
                    "# sensitivity = \"2.25 mV/N\"    # the file is in volts: give it, or forces stay in volts\n\n"
                }
                _ => {
                    "# scale = 1.0                  # N per unit of the file: give it, or forces stay in its units\n\n"
                }
            };
        }
        None => {
            text += "# no hammer was found in the files; where there is one:\n# [hammer]\n# channel = 1\n\n"
        }
    }
    let mut names: Vec<String> = Vec::new();
    for (at, channel) in channels.iter().enumerate() {
        if Some(at) == hammer.map(|(channel, _)| channel) {
            continue;
        }
        let letter = char::from(b'A' + (names.len() % 26) as u8).to_string();
        let mut name = channel
            .name
            .clone()
            .filter(|name| !name.trim().is_empty())
            .unwrap_or(letter);
        if names.contains(&name) {
            name = format!("{name} {}", at + 1);
        }
        text += &format!(
            "[[sensor]]\nname = {}\nchannel = {}                    # {}\n",
            toml::Value::from(name.as_str()),
            at + 1,
            title(channel)
        );
        names.push(name);
        let kind = SENSOR_KINDS
            .iter()
            .find(|(_, kind)| Some(*kind) == channel.kind);
        match (kind, channel.unit.as_deref()) {
            (Some((word, _)), _) => text += &format!("kind = \"{word}\"          # by its unit\n"),
            (None, Some("V")) => {
                text += "# sensitivity = \"100 mV/g\"     # the file is in volts: give it\n"
            }
            _ => text += "# scale = 1.0                  # m/s2 per unit of the file: give it\n",
        }
        text += "# position = 0.338             # m, not known from the files: give it\n# mass = \"24 g\"                # kg, from the data sheet, default: not known\n\n";
    }
    text
}

/// A channel in words: "Force, N", without anything that would end a comment.
fn title(channel: &FoundChannel) -> String {
    let parts = [
        channel.name.as_deref().unwrap_or("without a name"),
        channel.unit.as_deref().unwrap_or("without a unit"),
    ];
    parts.join(", ").replace(char::is_control, " ")
}

/// Returns the table of a recording as found; `sensor` is the name of the functions' sensor as TOML has it.
fn recording_found(found: &FoundRecording, sensor: &str) -> String {
    let mut text = format!(
        "{RECORDING}\nfile = {}\n",
        toml::Value::from(found.file.as_str())
    );
    match &found.content {
        FoundContent::Series {
            channels,
            sample_rate,
            ..
        } => {
            text += &format!(
                "# band = [0, {}]             # Hz, zoom band; the file has {} channels at {sample_rate} Hz\n",
                (sample_rate / 2.56).round(),
                channels.len()
            );
        }
        FoundContent::Functions { form, band, count } => {
            text += &format!(
                "# band = [{}, {}]           # Hz, zoom band; all lines of the {count} function(s)\n",
                band.0, band.1
            );
            text += match form {
                Some(FunctionForm::Spectrum) => {
                    "form = \"spectrum\"              # magnitudes without a phase\n"
                }
                Some(FunctionForm::Response(ResponseForm::Accelerance)) => {
                    "form = \"accelerance\"\n"
                }
                Some(FunctionForm::Response(ResponseForm::Mobility)) => "form = \"mobility\"\n",
                Some(FunctionForm::Response(ResponseForm::Receptance)) => "form = \"receptance\"\n",
                None => {
                    "form = \"accelerance\"           # the file does not say: or \"mobility\", \"receptance\"\n"
                }
            };
            text += &format!("sensor = {sensor}\n");
        }
        FoundContent::Unread(problem) => {
            let problem = problem.replace(char::is_control, " ");
            text += &format!("# not read: {problem}\n");
        }
    }
    text
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
    [HEAD, joint, INSTRUMENTS, fit, SHEET]
        .concat()
        .replace("@NAME@", name)
        .replace("@ORIGIN@", origin)
        .replace("@BEAM@", beam)
}
