//! Writing recordings as WAV files, through hound, and frequency response functions as universal files.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::error::RecordingError;
use super::health::{check_finite, check_rate, check_samples};
use super::responses::{FrequencyResponse, FrequencyResponses, not_finite};
use super::uff::{
    ACCELERATION, DISPLACEMENT, EXCITATION_FORCE, FREQUENCY, FunctionType, HEADER_LINES, NodalMode,
    Node, Point, UNKNOWN, VELOCITY,
};
use super::units::ResponseForm;

/// Number format of a WAV file that is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WavFormat {
    /// 16-bit integer.
    Pcm16,
    /// 24-bit integer, what most recorders of today write.
    Pcm24,
    /// 32-bit float: no limit at full scale.
    Float32,
}

impl WavFormat {
    fn bits(self) -> u16 {
        match self {
            Self::Pcm16 => 16,
            Self::Pcm24 => 24,
            Self::Float32 => 32,
        }
    }
}

/// Extent and coding of a WAV file to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WavLayout {
    /// Sample rate (Hz).
    pub sample_rate: u32,
    /// Channels.
    pub channels: usize,
    /// Most samples per channel.
    pub frames: u64,
    /// Number format.
    pub format: WavFormat,
}

impl WavLayout {
    /// The layout of channels of equal length, which are checked.
    fn of_channels(
        name: &str,
        sample_rate: u32,
        channels: &[Vec<f64>],
        format: WavFormat,
    ) -> Result<Self, RecordingError> {
        check_rate(name, f64::from(sample_rate))?;
        let slices = channels.iter().map(Vec::as_slice);
        let frames = check_samples(name, f64::from(sample_rate), slices)?;
        Ok(Self {
            sample_rate,
            channels: channels.len(),
            frames: frames as u64,
            format,
        })
    }

    /// Returns the size of all samples (bytes).
    pub fn bytes(&self) -> u64 {
        self.frames
            .saturating_mul(self.channels as u64)
            .saturating_mul(u64::from(self.format.bits() / 8))
    }

    /// Checks that a WAV file can hold so much. `name` stands for the file in errors.
    ///
    /// # Errors
    /// More than the format can hold.
    pub fn check_size(&self, name: &str) -> Result<(), RecordingError> {
        let (bytes, frames) = (self.bytes(), self.frames);
        // 128 bytes are more than the header takes.
        if self.channels > usize::from(u16::MAX) || bytes > u64::from(u32::MAX) - 128 {
            let problem = format!(
                "{} channels of {frames} samples at {} bits do not fit into a WAV file; allowed: 1 to 65535 channels and less than 4 GiB; write less",
                self.channels,
                self.format.bits()
            );
            return Err(RecordingError::new(name, problem));
        }
        Ok(())
    }
}

/// Writes channels of equal length as a WAV file and returns how many samples were clipped.
///
/// Samples are in file units: full scale of the integer formats is 1, values beyond it are clipped
/// and counted. The file appears under its name only when it is complete. `sample_rate` in Hz.
///
/// # Errors
/// Channels of unequal length, samples that are not finite, more than the format can hold, a
/// sample rate of 0, a folder that cannot be written.
pub fn write_wav(
    path: &Path,
    sample_rate: u32,
    channels: &[Vec<f64>],
    format: WavFormat,
) -> Result<u64, RecordingError> {
    let name = path.display().to_string();
    let layout = WavLayout::of_channels(&name, sample_rate, channels, format)?;
    let mut stream = WavStream::create(path, layout)?;
    stream.encoder.write_all(channels)?;
    stream.finish()
}

/// Like [`write_wav`], to any writer; `name` stands for the file in errors.
///
/// # Errors
/// Those of [`write_wav`].
pub fn encode_wav<W: Write + Seek>(
    name: &str,
    mut writer: W,
    sample_rate: u32,
    channels: &[Vec<f64>],
    format: WavFormat,
) -> Result<u64, RecordingError> {
    let layout = WavLayout::of_channels(name, sample_rate, channels, format)?;
    let mut encoder = WavEncoder::new(name, &mut writer, layout)?;
    encoder.write_all(channels)?;
    let (data_bytes, clipped) = encoder.finish()?;
    pad_to_even(&mut writer, data_bytes)
        .and_then(|()| writer.flush())
        .map_err(|error| unwritable(name, error))?;
    Ok(clipped)
}

/// A WAV file that is written sample by sample, so that nothing is kept that grows with its length. It appears under
/// its name when it is finished.
pub struct WavStream {
    path: PathBuf,
    aside: tempfile::NamedTempFile,
    encoder: WavEncoder<BufWriter<File>>,
}

impl WavStream {
    /// Begins a file.
    ///
    /// # Errors
    /// More than the format can hold, a sample rate of 0, a folder that cannot be written.
    pub fn create(path: &Path, layout: WavLayout) -> Result<Self, RecordingError> {
        let name = path.display().to_string();
        check_rate(&name, f64::from(layout.sample_rate))?;
        layout.check_size(&name)?;
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let aside = tempfile::NamedTempFile::new_in(folder);
        let aside = aside.map_err(|error| unwritable(&name, error))?;
        let file = aside.reopen().map_err(|error| unwritable(&name, error))?;
        Ok(Self {
            path: path.to_owned(),
            aside,
            encoder: WavEncoder::new(&name, BufWriter::new(file), layout)?,
        })
    }

    /// Writes one sample of every channel, in file units: full scale of the integer formats is 1,
    /// values beyond it are clipped and counted.
    ///
    /// # Errors
    /// Not one number for each channel, numbers that are not finite, more samples than announced, a
    /// disk that is full.
    pub fn write(&mut self, frame: &[f64]) -> Result<(), RecordingError> {
        self.encoder.write(frame)
    }

    /// Completes the file, puts it in its place, and returns how many samples were clipped.
    ///
    /// # Errors
    /// No samples; the disk refuses.
    pub fn finish(mut self) -> Result<u64, RecordingError> {
        let name = self.encoder.name.clone();
        let (data_bytes, clipped) = self.encoder.finish()?;
        let file = self.aside.as_file_mut();
        pad_to_even(file, data_bytes)
            .and_then(|()| file.flush())
            .and_then(|()| allow_others_to_read(file))
            .map_err(|error| unwritable(&name, error))?;
        let moved = self.aside.persist(&self.path);
        moved.map_err(|error| unwritable(&name, error.error))?;
        Ok(clipped)
    }
}

/// Encodes frames, checks them and counts those that are clipped.
struct WavEncoder<W: Write + Seek> {
    name: String,
    layout: WavLayout,
    wav: hound::WavWriter<W>,
    written: u64,
    clipped: u64,
}

impl<W: Write + Seek> WavEncoder<W> {
    fn new(name: &str, writer: W, layout: WavLayout) -> Result<Self, RecordingError> {
        layout.check_size(name)?;
        let spec = hound::WavSpec {
            channels: layout.channels as u16,
            sample_rate: layout.sample_rate,
            bits_per_sample: layout.format.bits(),
            sample_format: match layout.format {
                WavFormat::Float32 => hound::SampleFormat::Float,
                WavFormat::Pcm16 | WavFormat::Pcm24 => hound::SampleFormat::Int,
            },
        };
        let wav = hound::WavWriter::new(writer, spec);
        Ok(Self {
            name: name.to_owned(),
            layout,
            wav: wav.map_err(|error| unwritable(name, error))?,
            written: 0,
            clipped: 0,
        })
    }

    /// Writes channels of equal length.
    fn write_all(&mut self, channels: &[Vec<f64>]) -> Result<(), RecordingError> {
        let mut frame = Vec::with_capacity(channels.len());
        for index in 0..channels.first().map_or(0, Vec::len) {
            frame.clear();
            frame.extend(channels.iter().filter_map(|channel| channel.get(index)));
            self.write(&frame)?;
        }
        Ok(())
    }

    fn write(&mut self, frame: &[f64]) -> Result<(), RecordingError> {
        if frame.len() != self.layout.channels {
            let problem = format!(
                "a frame has {} values for {} channels; give one value for each channel",
                frame.len(),
                self.layout.channels
            );
            return Err(RecordingError::new(&self.name, problem));
        }
        let rate = f64::from(self.layout.sample_rate);
        let full_scale = 2_f64.powi(i32::from(self.layout.format.bits()) - 1);
        for (channel, value) in frame.iter().enumerate() {
            let sample = std::slice::from_ref(value);
            check_finite(&self.name, rate, channel, self.written, sample)?;
            let written = if self.layout.format == WavFormat::Float32 {
                self.wav.write_sample(*value as f32)
            } else {
                let wanted = (value * full_scale).round();
                let stored = wanted.clamp(-full_scale, full_scale - 1.0);
                self.clipped += u64::from(stored != wanted);
                self.wav.write_sample(stored as i32)
            };
            written.map_err(|error| unwritable(&self.name, error))?;
        }
        self.written += 1;
        let frames = self.written;
        let layout = WavLayout {
            frames,
            ..self.layout
        };
        layout.check_size(&self.name)
    }

    /// Completes the header. Returns the bytes of all samples, and how many samples were clipped.
    fn finish(self) -> Result<(u64, u64), RecordingError> {
        if self.written == 0 {
            return Err(RecordingError::no_samples(&self.name));
        }
        self.wav
            .finalize()
            .map_err(|error| unwritable(&self.name, error))?;
        let sample_bytes = u64::from(self.layout.format.bits() / 8);
        let bytes = self.written * self.layout.channels as u64 * sample_bytes;
        Ok((bytes, self.clipped))
    }
}

/// Adds the pad byte of an odd chunk: chunks have even length, and the byte counts for the whole only.
fn pad_to_even(writer: &mut (impl Write + Seek), data_bytes: u64) -> io::Result<()> {
    if data_bytes.is_multiple_of(2) {
        return Ok(());
    }
    let end = writer.seek(SeekFrom::End(0))?;
    writer.write_all(&[0])?;
    // The size of all chunks stands at byte 4 and leaves out the first 8 bytes.
    let size = u32::try_from(end + 1 - 8).unwrap_or(u32::MAX);
    writer.seek(SeekFrom::Start(4))?;
    writer.write_all(&size.to_le_bytes())?;
    writer.seek(SeekFrom::End(0))?;
    Ok(())
}

/// Temporary files are private to their owner; a recording is an ordinary file.
#[cfg(unix)]
fn allow_others_to_read(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn allow_others_to_read(_file: &File) -> io::Result<()> {
    Ok(())
}

fn unwritable(name: &str, error: impl Into<hound::Error>) -> RecordingError {
    RecordingError::Unwritable {
        file: name.to_owned(),
        source: match error.into() {
            hound::Error::IoError(source) => source,
            other => io::Error::other(other),
        },
    }
}

/// Coding of the datasets that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UffFormat {
    /// Dataset 58: text with thirteen digits.
    Ascii,
    /// Dataset 58b: IEEE double precision, little endian; every bit is kept.
    Binary,
}

/// Factors to SI are 1: dataset 164 for SI units.
const SI_UNITS: &str = "    -1\n   164\n         1SI: Meter (newton)           2\n  \
     1.00000000000000000D+00  1.00000000000000000D+00  1.00000000000000000D+00\n  \
     2.73149999999999977D+02\n    -1\n";

/// Ordinate data types of record 7 of a dataset 58, and of record 6 of a dataset 55.
const REAL_SINGLE: u32 = 2;
const REAL_DOUBLE: u32 = 4;
const COMPLEX_DOUBLE: u32 = 6;
/// Numbers of byte order and number format in the first line of dataset 58b.
const LITTLE_ENDIAN: u32 = 1;
const IEEE_754: u32 = 2;
/// Characters of an identification line, of a point's name, and of an axis' label or unit.
const ID_LINE: usize = 80;
const POINT_NAME: usize = 10;
const LABEL: usize = 20;
/// Double-precision values in a line of dataset 58.
const VALUES_IN_LINE: usize = 4;

/// Encodes frequency response functions and their coherences as a universal file: units (dataset 164), then
/// for each response a dataset 58 or 58b of function type 4 and, where there is a coherence, one of
/// function type 6. Complex and real double precision, evenly spaced.
///
/// The header has room for seven digits of first frequency and spacing.
///
/// # Errors
/// Values that are not finite; responses or coherences whose length is not the number of lines.
pub fn encode_frequency_responses_uff(
    responses: &FrequencyResponses,
    format: UffFormat,
) -> Result<Vec<u8>, RecordingError> {
    let mut bytes = SI_UNITS.as_bytes().to_vec();
    for (number, response) in (1..).zip(&responses.responses) {
        let parts = response
            .values
            .iter()
            .flat_map(|value| [value.re, value.im]);
        let values: Vec<f64> = parts.collect();
        check_values(responses, number, 2, &values)?;
        // Values are in SI units where the form is known; else the unit is the file's.
        let force = axis(EXCITATION_FORCE, "Force", "N");
        let axes = match response.form {
            Some(ResponseForm::Accelerance) => axis(ACCELERATION, "Acceleration", "m/s2") + &force,
            Some(ResponseForm::Mobility) => axis(VELOCITY, "Velocity", "m/s") + &force,
            Some(ResponseForm::Receptance) => axis(DISPLACEMENT, "Displacement", "m") + &force,
            None => {
                let unit = response.unit.as_deref().unwrap_or("NONE");
                axis(UNKNOWN, "Response", unit) + &axis(UNKNOWN, "NONE", "NONE")
            }
        };
        let records = header(
            responses,
            response,
            FunctionType::FREQUENCY_RESPONSE,
            COMPLEX_DOUBLE,
            axes,
        );
        write_dataset(&mut bytes, &records, &values, format);
        if let Some(coherence) = &response.coherence {
            check_values(responses, number, 1, coherence)?;
            let axes = axis(UNKNOWN, "Coherence", "NONE") + &axis(UNKNOWN, "NONE", "NONE");
            let records = header(
                responses,
                response,
                FunctionType::COHERENCE,
                REAL_DOUBLE,
                axes,
            );
            write_dataset(&mut bytes, &records, coherence, format);
        }
    }
    Ok(bytes)
}

/// Encodes the places of nodes as a universal file: units (dataset 164), and the nodes (dataset 15) where there are any.
pub fn encode_nodes_uff(nodes: &BTreeMap<i64, Node>) -> Vec<u8> {
    let mut text = SI_UNITS.to_owned();
    if !nodes.is_empty() {
        text.push_str("    -1\n    15\n");
    }
    // Format(4I10,1P3E13.5): number, coordinate systems of place and displacements, colour, X, Y, Z.
    for (number, node) in nodes {
        let place = node.place.map(short);
        let (own, of_displacements) = (node.system, node.displacement_system);
        let _ = writeln!(
            text,
            "{number:10}{own:10}{of_displacements:10}{:10}{}",
            1,
            place.concat()
        );
    }
    if !nodes.is_empty() {
        text.push_str("    -1\n");
    }
    text.into_bytes()
}

/// Encodes mode shapes with their numbers as datasets 55: normal modes, displacements along X, Y and Z, real single
/// precision. Imaginary parts are left out. `name` is that of the test.
///
/// # Errors
/// Values that are not finite.
pub fn encode_mode_shapes_uff(
    name: &str,
    modes: &[(i64, NodalMode)],
) -> Result<Vec<u8>, RecordingError> {
    let mut text = String::new();
    for (number, mode) in modes {
        let frequency = (mode.frequency, mode.damping.unwrap_or(0.0));
        let values = mode.shape.values().flatten().map(|value| value.re);
        let damaged = [frequency.0, frequency.1].into_iter().chain(values);
        if let Some(value) = damaged.into_iter().find(|value| !value.is_finite()) {
            let problem = format!("mode {number} holds {value}; allowed: finite numbers");
            return Err(RecordingError::new(name, problem));
        }
        let _ = writeln!(text, "    -1\n    55\n{}", field(name, ID_LINE));
        let _ = writeln!(text, "Mode {number}\nNONE\nNONE\nNONE");
        // Structural, normal mode, translations, displacement, real, three values of each node.
        let kind = [1, 2, 2, DISPLACEMENT, REAL_SINGLE, 3].map(|field| format!("{field:10}"));
        let _ = writeln!(text, "{}", kind.concat());
        // Two whole numbers and four others follow: load case and mode; frequency, modal mass, viscous and hysteretic damping.
        let _ = writeln!(text, "{:10}{:10}{:10}{number:10}", 2, 4, 1);
        let reals = [frequency.0, 0.0, frequency.1, 0.0];
        let _ = writeln!(text, "{}", reals.map(short).concat());
        for (node, value) in &mode.shape {
            let value = value.map(|part| short(part.re));
            let _ = writeln!(text, "{node:10}\n{}", value.concat());
        }
        text.push_str("    -1\n");
    }
    Ok(text.into_bytes())
}

/// A number of six digits in a field of thirteen, Format(E13.5).
fn short(value: f64) -> String {
    format!("{:>13}", exponential(value, 5))
}

/// Checks the values of a response (1-based) with `width` numbers a line.
fn check_values(
    responses: &FrequencyResponses,
    response: usize,
    width: usize,
    values: &[f64],
) -> Result<(), RecordingError> {
    let (file, lines) = (&responses.file, responses.lines);
    if values.len() != lines.saturating_mul(width) {
        let found = values.len() / width;
        let problem = format!(
            "response {response} has {found} values, the lines are {lines}; give equal numbers"
        );
        return Err(RecordingError::new(file, problem));
    }
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => Err(not_finite(file, response, at / width, values[at])),
    }
}

/// The eleven header records, `ordinate_axes` being records 9 and 10.
fn header(
    responses: &FrequencyResponses,
    response: &FrequencyResponse,
    function_type: FunctionType,
    data_type: u32,
    ordinate_axes: String,
) -> String {
    let mut text = field(&response.name, ID_LINE) + "\nNONE\nNONE\nNONE\nNONE\n";
    let _ = writeln!(
        text,
        "{:5}{:10}{:5}{:10}{}{}",
        function_type.0,
        0,
        0,
        0,
        point(&response.response),
        point(&response.reference)
    );
    let _ = writeln!(
        text,
        "{data_type:10}{:10}{:10}{:>13}{:>13}{:>13}",
        responses.lines,
        1,
        exponential(responses.first_frequency, 6),
        exponential(responses.spacing, 6),
        exponential(0.0, 6)
    );
    text + &axis(FREQUENCY, "Frequency", "Hz") + &ordinate_axes + &axis(UNKNOWN, "NONE", "NONE")
}

/// Records 8 to 11: Format(I10,3I5,2(1X,20A1)).
fn axis(quantity: u32, label: &str, unit: &str) -> String {
    format!(
        "{quantity:10}{:5}{:5}{:5} {:<20} {:<20}\n",
        0,
        0,
        0,
        field(label, LABEL),
        field(unit, LABEL)
    )
}

/// Half of record 6: 1X,10A1,I10,I4.
fn point(point: &Point) -> String {
    let name = point.name.as_deref().unwrap_or("NONE");
    format!(
        " {:<10}{:>10}{:>4}",
        field(name, POINT_NAME),
        point.node,
        point.direction
    )
}

/// Text cut to its field, without what would break the line; "NONE" where nothing is left.
fn field(text: &str, width: usize) -> String {
    let kept: String = text
        .replace(char::is_control, " ")
        .chars()
        .take(width)
        .collect();
    match kept.trim() {
        "" => "NONE".to_owned(),
        _ => kept,
    }
}

/// A number as Fortran's E format prints it: two digits of exponent at least.
fn exponential(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$E}");
    let Some((mantissa, exponent)) = text.split_once('E') else {
        return text;
    };
    let (sign, digits) = match exponent.strip_prefix('-') {
        Some(digits) => ('-', digits),
        None => ('+', exponent),
    };
    format!("{mantissa}E{sign}{digits:0>2}")
}

fn write_dataset(into: &mut Vec<u8>, header: &str, values: &[f64], format: UffFormat) {
    match format {
        UffFormat::Ascii => {
            into.extend_from_slice(b"    -1\n    58\n");
            into.extend_from_slice(header.as_bytes());
            for row in values.chunks(VALUES_IN_LINE) {
                let row: String = row
                    .iter()
                    .map(|x| format!("{:>20}", exponential(*x, 12)))
                    .collect();
                into.extend_from_slice(row.as_bytes());
                into.push(b'\n');
            }
        }
        UffFormat::Binary => {
            let bytes = size_of_val(values);
            let line = format!(
                "    -1\n    58b{:6}{:6}{:12}{bytes:12}{:6}{:6}{:12}{:12}\n",
                LITTLE_ENDIAN, IEEE_754, HEADER_LINES, 0, 0, 0, 0
            );
            into.extend_from_slice(line.as_bytes());
            into.extend_from_slice(header.as_bytes());
            into.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
    }
    // Behind binary data the mark follows at once, as readers expect that count bytes.
    into.extend_from_slice(b"    -1\n");
}
