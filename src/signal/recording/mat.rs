//! MATLAB files of level 5 (`save -v6`, `-v7`, scipy's `savemat`): variables by name, as time series or as functions.
//!
//! A file is a header of 128 bytes and data elements: a type, a size and bytes in the order that the header states.
//! `miMATRIX` holds a variable, `miCOMPRESSED` one such element behind zlib. No size is believed without comparing it
//! with what is there. Source: MathWorks, MAT-File Format (version 5), 2020.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;
use num_complex::Complex64;

use super::csv::Column;
use super::error::{RecordingError, RecordingWarning, check_channel_count, unreadable};
use super::function_text::{FunctionTable, all_within_coherence};
use super::health::first_unusable;
use super::resample::resample;
use super::responses::{FrequencyResponse, FrequencyResponses, time_series};
use super::text::{Printed, check_even};
use super::{Format, ReadSettings, Recording};

/// Bytes of the file's header.
const HEADER: usize = 128;

/// Bytes to which each byte of a file may expand. Measured numbers give 1 to 4; more is a file made to fill memory.
const MOST_EXPANSION: usize = 32;

/// Bytes that any file may expand to.
const LEAST_ROOM: usize = 1 << 16;

/// Longest name of a variable, with those of the structures around it (bytes). MATLAB allows 63 for each.
const MOST_NAME: usize = 256;

/// Structures within structures that are followed.
const MOST_DEPTH: usize = 4;

/// Variables that a message lists.
const LISTED: usize = 16;

/// What a variable of a file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum VariableRole {
    /// Frequency response functions, complex, lines by functions.
    Frf,
    /// Spectra, real magnitudes or dB, lines by spectra.
    Spectrum,
    /// Coherence of the functions.
    Coherence,
    /// Frequency of each line (Hz).
    Frequency,
    /// Samples, times by channels.
    Samples,
    /// Time of each sample (s).
    Time,
    /// Sample rate (Hz).
    Rate,
    /// Samples from which the functions were transformed.
    Points,
}

impl VariableRole {
    /// Words of descriptions and options.
    pub const WORDS: [(&'static str, VariableRole); 8] = [
        ("frf", VariableRole::Frf),
        ("spectrum", VariableRole::Spectrum),
        ("coherence", VariableRole::Coherence),
        ("frequency", VariableRole::Frequency),
        ("samples", VariableRole::Samples),
        ("time", VariableRole::Time),
        ("rate", VariableRole::Rate),
        ("points", VariableRole::Points),
    ];
}

/// Names of variables by what they are for.
pub type Variables = BTreeMap<VariableRole, Vec<String>>;

/// Opens a file as a recording.
pub(super) fn open_mat(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let content = MatFile::open(path, file)?;
    let wanted = &settings.variables;
    if wanted.contains_key(&VariableRole::Frf) || wanted.contains_key(&VariableRole::Spectrum) {
        return Err(RecordingError::Functions {
            place: content.file,
            found: "its variables are named as frf or spectrum".to_owned(),
        });
    }
    let samples = content.matrices(wanted, VariableRole::Samples)?;
    let length = samples.iter().map(|one| one.rows.max(one.columns)).max();
    let length = length.unwrap_or(0);
    let mut columns = Vec::new();
    for one in &samples {
        let (real, imaginary) = one.along(length, &content.file)?;
        if imaginary.is_some() {
            return Err(content.error(format!(
                "variable \"{}\" is complex; allowed: real samples; name it as frf if it is a function",
                one.name
            )));
        }
        let several = real.len() > 1;
        for (number, values) in (1..).zip(real) {
            let name = match several {
                true => format!("{} {number}", one.name),
                false => one.name.clone(),
            };
            columns.push((Column::new(&name, ""), values));
        }
    }
    check_channel_count(&content.file, columns.len())?;
    let mut warnings = Vec::new();
    if let [time] = content.matrices_if(wanted, VariableRole::Time)?.as_slice() {
        let mut times = time.vector(&content.file)?;
        times
            .iter_mut()
            .for_each(|time| *time *= settings.time_unit.unwrap_or(1.0));
        if times.len() != length {
            return Err(content.error(format!(
                "variable \"{}\" has {} times, the samples are {length}; allowed: equally many",
                time.name,
                times.len()
            )));
        }
        let check = check_even(&times, 1.., Printed::Exact, true).map_err(|uneven| {
            content.error(format!(
                "uneven sampling: \"{}\", element {}: {}{}; allowed: 2 % of the step; export without gaps",
                time.name,
                uneven.line,
                uneven.words(1.0, "s", "element"),
                uneven.lost_rows()
            ))
        })?;
        if let Some(deviation) = check.uneven() {
            let (headers, samples): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
            let even = resample(&times, &samples, deviation);
            warnings.push(even.warning());
            let columns = headers.into_iter().zip(even.samples).collect();
            return Recording::in_memory(
                content.file,
                Format::Mat,
                even.sample_rate,
                columns,
                warnings,
            );
        }
        let Some((_, rate)) = check.sample_rate(1.0) else {
            return Err(RecordingError::no_samples(&content.file));
        };
        warnings.extend(settings.ignored_rate(rate));
        return Recording::in_memory(content.file, Format::Mat, rate, columns, warnings);
    }
    let rate = match content.matrices_if(wanted, VariableRole::Rate)?.as_slice() {
        [rate] => {
            let rate = rate.scalar(&content.file)?;
            warnings.extend(settings.ignored_rate(rate));
            rate
        }
        _ => settings.sample_rate.ok_or_else(|| {
            content.error("the samples have no time; name `time` or `rate` among the variables, or give sample_rate in Hz")
        })?,
    };
    Recording::in_memory(content.file, Format::Mat, rate, columns, warnings)
}

/// Opens a file as functions of frequency.
pub(super) fn open_functions(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<FrequencyResponses, RecordingError> {
    let content = MatFile::open(path, file)?;
    let wanted = &settings.variables;
    if wanted.contains_key(&VariableRole::Samples) {
        return Err(time_series(
            &content.file,
            "read as a time series, as its variables are named",
        ));
    }
    let is_spectrum = wanted.contains_key(&VariableRole::Spectrum);
    let role = if is_spectrum {
        VariableRole::Spectrum
    } else {
        VariableRole::Frf
    };
    let matrices = content.matrices(wanted, role)?;
    let frequencies = match content
        .matrices_if(wanted, VariableRole::Frequency)?
        .as_slice()
    {
        [one] => Some((one.name.clone(), one.vector(&content.file)?)),
        _ => None,
    };
    let longest = matrices.iter().map(|one| one.rows.max(one.columns)).max();
    let lines = match &frequencies {
        Some((_, values)) => values.len(),
        None => longest.unwrap_or(0),
    };
    if lines < 2 {
        return Err(content.error("the functions have fewer than 2 lines; name a longer variable"));
    }
    let mut warnings = Vec::new();
    let (first_frequency, spacing) = match &frequencies {
        Some((name, values)) => content.even_lines(name, values)?,
        None => (0.0, content.spacing(settings, lines, &mut warnings)?),
    };
    let (mut names, mut real, mut imaginary) = (Vec::new(), Vec::new(), Vec::new());
    for one in &matrices {
        let (own_real, own_imaginary) = one.along(lines, &content.file)?;
        if !is_spectrum && own_imaginary.is_none() {
            return Err(content.error(format!(
                "variable \"{}\" is real: it has no phase; name it as spectrum, or name a complex one as frf",
                one.name
            )));
        }
        for number in 1..=own_real.len() {
            names.push(match own_real.len() {
                1 => one.name.clone(),
                _ => format!("{} {number}", one.name),
            });
        }
        real.extend(own_real);
        imaginary.extend(own_imaginary.unwrap_or_default());
    }
    check_channel_count(&content.file, names.len())?;
    if is_spectrum {
        // Real values go the way of text: levels in dB are told apart from magnitudes there.
        let mut headings = vec!["Frequency".to_owned()];
        headings.extend(names.iter().map(|name| format!("{name} magnitude")));
        let table = FunctionTable {
            file: content.file,
            frequencies: (0..lines)
                .map(|line| first_frequency + spacing * line as f64)
                .collect(),
            columns: real,
            header: vec![headings],
            lines: (1..=lines as u64).collect(),
        };
        let mut read = table.read(settings)?;
        read.warnings.append(&mut warnings);
        return Ok(read);
    }
    let coherences = content.matrices_if(wanted, VariableRole::Coherence)?;
    let mut coherence = Vec::new();
    for one in &coherences {
        coherence.extend(one.along(lines, &content.file)?.0);
    }
    if coherence.iter().any(|values| !all_within_coherence(values)) {
        let message =
            "the coherence is left out: its values are not all between 0 and 1".to_owned();
        warnings.push(RecordingWarning::new("coherence-left-out", message));
        coherence.clear();
    }
    let mut responses = Vec::with_capacity(names.len());
    for (at, ((name, re), im)) in names.into_iter().zip(real).zip(imaginary).enumerate() {
        responses.push(FrequencyResponse {
            name,
            values: re
                .into_iter()
                .zip(im)
                .map(|(re, im)| Complex64::new(re, im))
                .collect(),
            coherence: coherence.get(at).cloned(),
            ..FrequencyResponse::default()
        });
    }
    Ok(FrequencyResponses {
        file: content.file,
        first_frequency,
        spacing,
        lines,
        has_phase: true,
        responses,
        warnings,
    })
}

/// A file and its variables.
#[derive(Debug)]
struct MatFile {
    file: String,
    variables: Vec<Variable>,
}

/// A variable; a field of a structure is called `structure.field`.
#[derive(Debug)]
struct Variable {
    name: String,
    sizes: Vec<usize>,
    class: &'static str,
    /// Real and imaginary parts, column by column; `None` of what holds no numbers.
    values: Option<(Vec<f64>, Option<Vec<f64>>)>,
}

impl fmt::Display for Variable {
    /// Writes "yspec (4501 x 1, complex double)".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sizes: Vec<String> = self.sizes.iter().map(usize::to_string).collect();
        let complex = match &self.values {
            Some((_, Some(_))) => "complex ",
            _ => "",
        };
        write!(
            f,
            "{} ({}, {complex}{})",
            self.name,
            sizes.join(" x "),
            self.class
        )
    }
}

/// A variable of numbers in two dimensions.
struct Matrix<'a> {
    name: String,
    rows: usize,
    columns: usize,
    real: &'a [f64],
    imaginary: Option<&'a [f64]>,
}

/// Real and imaginary parts, each a list of channels.
type Channels = (Vec<Vec<f64>>, Option<Vec<Vec<f64>>>);

impl Matrix<'_> {
    /// Returns the channels, each of `length` values: the columns, or the rows where these are as long.
    fn along(&self, length: usize, file: &str) -> Result<Channels, RecordingError> {
        let by_rows = self.rows != length && self.columns == length;
        if !by_rows && self.rows != length {
            let problem = format!(
                "variable \"{}\" is {} x {}, and neither is {length}; allowed: one dimension as long as the other variables",
                self.name, self.rows, self.columns
            );
            return Err(RecordingError::new(file, problem));
        }
        let channels = if by_rows { self.rows } else { self.columns };
        let split = |values: &[f64]| -> Vec<Vec<f64>> {
            let channel = |number: usize| match by_rows {
                true => values
                    .iter()
                    .skip(number)
                    .step_by(channels)
                    .copied()
                    .collect(),
                false => values[number * length..][..length].to_vec(),
            };
            (0..channels).map(channel).collect()
        };
        Ok((split(self.real), self.imaginary.map(split)))
    }

    /// The values of a real vector.
    fn vector(&self, file: &str) -> Result<Vec<f64>, RecordingError> {
        if self.imaginary.is_none() && self.rows.min(self.columns) == 1 {
            return Ok(self.real.to_vec());
        }
        let problem = format!(
            "variable \"{}\" is {} x {}; allowed: a real vector",
            self.name, self.rows, self.columns
        );
        Err(RecordingError::new(file, problem))
    }

    /// The value of a real scalar above 0.
    fn scalar(&self, file: &str) -> Result<f64, RecordingError> {
        match (self.real, self.imaginary) {
            ([value], None) if *value > 0.0 => Ok(*value),
            _ => {
                let problem = format!(
                    "variable \"{}\" is {} x {}; allowed: one real number above 0",
                    self.name, self.rows, self.columns
                );
                Err(RecordingError::new(file, problem))
            }
        }
    }
}

impl MatFile {
    fn error(&self, problem: impl Into<String>) -> RecordingError {
        RecordingError::new(&self.file, problem)
    }

    /// Returns the variables of a role, of which there is at least one.
    fn matrices(
        &self,
        wanted: &Variables,
        role: VariableRole,
    ) -> Result<Vec<Matrix<'_>>, RecordingError> {
        let found = self.matrices_if(wanted, role)?;
        match found.is_empty() {
            true => Err(self.error(format!(
                "a MATLAB file with {}; say which of them is what: {}",
                self.listed(),
                self.proposal()
            ))),
            false => Ok(found),
        }
    }

    /// Returns the variables of a role; none where none is named.
    fn matrices_if(
        &self,
        wanted: &Variables,
        role: VariableRole,
    ) -> Result<Vec<Matrix<'_>>, RecordingError> {
        let names = wanted.get(&role).map_or(&[][..], Vec::as_slice);
        names.iter().map(|name| self.matrix(name)).collect()
    }

    fn matrix(&self, name: &str) -> Result<Matrix<'_>, RecordingError> {
        let Some(found) = self.variables.iter().find(|one| one.name == name) else {
            let nearest = self
                .variables
                .iter()
                .map(|one| (strsim::jaro_winkler(&one.name, name), one));
            let nearest = nearest
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .filter(|(near, _)| *near > 0.7);
            let meant = nearest.map_or(String::new(), |(_, one)| {
                format!("; did you mean \"{}\"?", one.name)
            });
            return Err(self.error(format!(
                "no variable \"{name}\"{meant}; there are {}",
                self.listed()
            )));
        };
        let (Some((real, imaginary)), [rows, columns]) = (&found.values, found.sizes.as_slice())
        else {
            return Err(self.error(format!(
                "variable {found} cannot be used; allowed: matrices of numbers"
            )));
        };
        let sums = real
            .iter()
            .copied()
            .chain(imaginary.iter().flatten().copied());
        if let Some(at) = first_unusable(sums) {
            let at = at % real.len().max(1);
            return Err(self.error(format!(
                "variable \"{name}\", element {} is no usable number; allowed: finite numbers of magnitude up to 1e100",
                at + 1
            )));
        }
        Ok(Matrix {
            name: name.to_owned(),
            rows: *rows,
            columns: *columns,
            real,
            imaginary: imaginary.as_deref(),
        })
    }

    /// "yspec (4501 x 1, complex double), freq (1 x 1, double)", for messages.
    fn listed(&self) -> String {
        let mut shown: Vec<String> = self
            .variables
            .iter()
            .take(LISTED)
            .map(ToString::to_string)
            .collect();
        if self.variables.len() > LISTED {
            shown.push(format!("... {} in all", self.variables.len()));
        }
        match shown.is_empty() {
            true => "no variable".to_owned(),
            false => shown.join(", "),
        }
    }

    /// What to write, by shapes and names.
    fn proposal(&self) -> String {
        let vectors = self.variables.iter().filter(|one| one.values.is_some());
        let largest = vectors.max_by_key(|one| one.sizes.iter().product::<usize>());
        let is_scalar =
            |one: &&Variable| one.values.is_some() && one.sizes.iter().all(|size| *size == 1);
        let named = |words: &[&str]| {
            let mut scalars = self.variables.iter().filter(is_scalar);
            let found = scalars.find(|one| {
                let name = one.name.to_lowercase();
                words
                    .iter()
                    .any(|word| name == *word || name.ends_with(&format!(".{word}")))
            });
            found.map(|one| one.name.clone())
        };
        let mut parts = Vec::new();
        if let Some(one) = largest {
            let is_complex = matches!(&one.values, Some((_, Some(_))));
            let role = if is_complex { "frf" } else { "samples" };
            parts.push((role, one.name.clone()));
        }
        let rate = named(&[
            "fs",
            "rate",
            "freq",
            "srate",
            "sample_rate",
            "samplerate",
            "sr",
        ]);
        parts.extend(rate.map(|name| ("rate", name)));
        let points = named(&["npts", "nfft", "points", "n"]);
        parts.extend(points.map(|name| ("points", name)));
        let roles: Vec<&str> = VariableRole::WORDS.iter().map(|(word, _)| *word).collect();
        let options = parts
            .iter()
            .map(|(role, name)| format!("--variable {role}={name}"));
        let keys = parts
            .iter()
            .map(|(role, name)| format!("{role} = \"{name}\""));
        format!(
            "perhaps `{}`, in a test description `variables = {{ {} }}`; roles: {}",
            options.collect::<Vec<_>>().join(" "),
            keys.collect::<Vec<_>>().join(", "),
            roles.join(", ")
        )
    }

    /// First frequency and spacing of a vector of frequencies (Hz).
    fn even_lines(&self, name: &str, values: &[f64]) -> Result<(f64, f64), RecordingError> {
        if let Err(uneven) = check_even(values, 1.., Printed::Exact, false) {
            return Err(self.error(format!(
                "uneven lines: \"{name}\", element {}: {}; allowed: 0.1 % of the step",
                uneven.line,
                uneven.words(1.0, "Hz", "element")
            )));
        }
        let spacing = (values[values.len() - 1] - values[0]) / (values.len() - 1) as f64;
        Ok((values[0], spacing))
    }

    /// Spacing of lines from 0 Hz on (Hz), by the sample rate and the number of samples transformed.
    fn spacing(
        &self,
        settings: &ReadSettings,
        lines: usize,
        warnings: &mut Vec<RecordingWarning>,
    ) -> Result<f64, RecordingError> {
        let wanted = &settings.variables;
        let rate = match self.matrices_if(wanted, VariableRole::Rate)?.as_slice() {
            [rate] => rate.scalar(&self.file)?,
            _ => settings.sample_rate.ok_or_else(|| {
                self.error("the functions have no frequencies; name `frequency` or `rate` among the variables")
            })?,
        };
        let even = 2.0 * (lines as f64 - 1.0);
        let points = match self.matrices_if(wanted, VariableRole::Points)?.as_slice() {
            [points] => points.scalar(&self.file)?,
            _ => {
                let message = format!(
                    "the {lines} lines are taken to reach from 0 Hz to half the rate, {} Hz, those of {even} samples; name `points` or `frequency` if they do not",
                    0.5 * rate
                );
                warnings.push(RecordingWarning::new("lines-assumed", message));
                even
            }
        };
        // Lines beyond half of the samples are the mirror image.
        if points < even - 0.5 {
            return Err(self.error(format!(
                "{lines} lines of {points} samples reach beyond half the rate; allowed: up to {} lines; leave the mirrored half out, or correct `points`",
                (0.5 * points).floor() + 1.0
            )));
        }
        Ok(rate / points)
    }

    /// Reads all variables.
    fn open(path: &Path, file: String) -> Result<Self, RecordingError> {
        let mut bytes = Vec::new();
        let read = File::open(path).and_then(|mut opened| opened.read_to_end(&mut bytes));
        read.map_err(|error| unreadable(&file, error))?;
        let big = match bytes.get(126..HEADER) {
            Some(b"MI") => true,
            Some(b"IM") => false,
            _ => {
                let problem = "byte 127: the header of a MATLAB file is cut or has no mark of the byte order (MI or IM); save it again with -v7";
                return Err(RecordingError::new(&file, problem));
            }
        };
        let mut room = LEAST_ROOM.saturating_add(bytes.len().saturating_mul(MOST_EXPANSION));
        let mut variables = Vec::new();
        let mut rest = Elements {
            bytes: &bytes,
            at: HEADER,
            big,
            file: &file,
        };
        while let Some(element) = rest.next_element()? {
            if element.kind != COMPRESSED {
                rest.inside(element)
                    .variable("", 0, &mut variables, element.kind)?;
                continue;
            }
            let mut expanded = Vec::new();
            let limit = room as u64 + 1;
            let read = ZlibDecoder::new(element.bytes)
                .take(limit)
                .read_to_end(&mut expanded);
            if let Err(cause) = read {
                return Err(rest.error(
                    element.at,
                    &format!("the compressed variable is damaged ({cause})"),
                ));
            }
            if expanded.len() > room {
                let problem = format!(
                    "the compressed variables expand to more than {MOST_EXPANSION} times the file; save it again with -v6, without compression"
                );
                return Err(rest.error(element.at, &problem));
            }
            room -= expanded.len();
            let mut inner = Elements {
                bytes: &expanded,
                at: 0,
                big,
                file: &file,
            };
            if let Some(matrix) = inner.next_element()? {
                inner
                    .inside(matrix)
                    .variable("", 0, &mut variables, matrix.kind)?;
            }
        }
        Ok(Self { file, variables })
    }
}

const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;

/// Numbers of the classes of arrays, and their names; those between hold numbers.
const CLASSES: [&str; 19] = [
    "nothing",
    "cell",
    "structure",
    "object",
    "text",
    "sparse",
    "double",
    "single",
    "int8",
    "uint8",
    "int16",
    "uint16",
    "int32",
    "uint32",
    "int64",
    "uint64",
    "function",
    "opaque",
    "object",
];

/// A data element.
#[derive(Debug, Clone, Copy)]
struct Element<'a> {
    kind: u32,
    bytes: &'a [u8],
    /// Place of its tag in the bytes at hand.
    at: usize,
}

/// Elements that follow each other.
#[derive(Debug, Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    at: usize,
    big: bool,
    file: &'a str,
}

impl<'a> Elements<'a> {
    fn error(&self, at: usize, problem: &str) -> RecordingError {
        RecordingError::new(
            self.file,
            format!("byte {}: {problem}; copy or save the file again", at + 1),
        )
    }

    /// The elements within an element.
    fn inside(&self, element: Element<'a>) -> Elements<'a> {
        Elements {
            bytes: element.bytes,
            at: 0,
            ..*self
        }
    }

    fn word(&self, at: usize) -> Option<u32> {
        let bytes = self.bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if self.big {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        })
    }

    /// Reads the next element; `None` at the end.
    fn next_element(&mut self) -> Result<Option<Element<'a>>, RecordingError> {
        let at = self.at;
        if at >= self.bytes.len() {
            return Ok(None);
        }
        let cut = || self.error(at, "the file ends within an element");
        let first = self.word(at).ok_or_else(cut)?;
        // The small format has size and type in one word, and at most four bytes.
        let (kind, size, start) = match first >> 16 {
            0 => (first, self.word(at + 4).ok_or_else(cut)? as usize, at + 8),
            small => (first & 0xFFFF, small as usize, at + 4),
        };
        if start == at + 4 && size > 4 {
            return Err(self.error(
                at,
                &format!("a small element of {size} bytes; allowed: at most 4"),
            ));
        }
        let end = start
            .checked_add(size)
            .filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| {
            self.error(
                at,
                &format!("an element of {size} bytes reaches beyond the end of the file"),
            )
        })?;
        self.at = match (start == at + 4, kind) {
            (true, _) => at + 8,
            (_, COMPRESSED) => end,
            // Elements begin at multiples of eight.
            _ => end.next_multiple_of(8),
        };
        Ok(Some(Element {
            kind,
            bytes: &self.bytes[start..end],
            at,
        }))
    }

    /// Reads the next element, which must be there.
    fn needed(&mut self, what: &str) -> Result<Element<'a>, RecordingError> {
        let at = self.at;
        self.next_element()?
            .ok_or_else(|| self.error(at, &format!("{what} of a variable is missing")))
    }

    /// Reads the variable in these elements of a matrix. Elements of another `kind` hold none.
    fn variable(
        mut self,
        prefix: &str,
        depth: usize,
        into: &mut Vec<Variable>,
        kind: u32,
    ) -> Result<(), RecordingError> {
        // An empty matrix stands for a field without a value.
        if kind != MATRIX || self.bytes.is_empty() {
            return Ok(());
        }
        let flags = self.needed("the class")?;
        let word = self.inside(flags).word(0).unwrap_or(0);
        let class = CLASSES
            .get((word & 0xFF) as usize)
            .copied()
            .unwrap_or("unknown");
        if class == "opaque" || class == "unknown" {
            return Ok(());
        }
        let sizes = self.needed("the size")?;
        let sizes: Vec<usize> = self
            .numbers(sizes)?
            .into_iter()
            .map(|size| size.max(0.0) as usize)
            .collect();
        let name = self.needed("the name")?;
        let own: String = name
            .bytes
            .iter()
            .map(|byte| char::from(*byte))
            .filter(|c| !c.is_control())
            .collect();
        let name = [prefix, &own].concat();
        if name.len() > MOST_NAME {
            return Err(self.error(
                0,
                &format!(
                    "a name of {} bytes; allowed: at most {MOST_NAME}",
                    name.len()
                ),
            ));
        }
        if class == "structure" && sizes.iter().all(|size| *size == 1) && depth < MOST_DEPTH {
            return self.fields(&name, depth, into);
        }
        let mut values = None;
        if (6..16).contains(&(word & 0xFF)) {
            let count = sizes
                .iter()
                .try_fold(1_usize, |product, size| product.checked_mul(*size));
            let mut parts = Vec::new();
            for _ in 0..=usize::from(word & 0x0800 != 0) {
                let part = self.needed("the numbers")?;
                let numbers = self.numbers(part)?;
                if Some(numbers.len()) != count {
                    let problem = format!(
                        "variable \"{name}\" has {} numbers where its size promises {}",
                        numbers.len(),
                        count.map_or("too many".to_owned(), |count| count.to_string())
                    );
                    return Err(self.error(part.at, &problem));
                }
                parts.push(numbers);
            }
            let mut parts = parts.into_iter();
            values = parts.next().map(|real| (real, parts.next()));
        }
        into.push(Variable {
            name,
            sizes,
            class,
            values,
        });
        Ok(())
    }

    /// Reads the fields of a structure.
    fn fields(
        mut self,
        name: &str,
        depth: usize,
        into: &mut Vec<Variable>,
    ) -> Result<(), RecordingError> {
        let length = self.needed("the length of the fields' names")?;
        let length = self
            .numbers(length)?
            .first()
            .map_or(0.0, |length| length.max(0.0)) as usize;
        let names = self.needed("the fields' names")?;
        for field in names.bytes.chunks(length.max(1)) {
            let end = field
                .iter()
                .position(|byte| *byte == 0)
                .unwrap_or(field.len());
            let field: String = field[..end].iter().map(|byte| char::from(*byte)).collect();
            let element = self.needed("a field")?;
            self.inside(element).variable(
                &format!("{name}.{field}"),
                depth + 1,
                into,
                element.kind,
            )?;
        }
        Ok(())
    }

    /// Reads the numbers of an element.
    fn numbers(&self, element: Element<'_>) -> Result<Vec<f64>, RecordingError> {
        let size = match element.kind {
            1 | 2 => 1,
            3 | 4 => 2,
            5..=7 => 4,
            9 | 12 | 13 => 8,
            kind => {
                let problem = format!(
                    "numbers of type {kind}; allowed: integers of 8 to 64 bits, single, double"
                );
                return Err(self.error(element.at, &problem));
            }
        };
        if !element.bytes.len().is_multiple_of(size) {
            return Err(self.error(
                element.at,
                &format!(
                    "{} bytes are no whole number of {size}",
                    element.bytes.len()
                ),
            ));
        }
        let mut numbers = Vec::with_capacity(element.bytes.len() / size);
        for chunk in element.bytes.chunks_exact(size) {
            let mut bytes = [0; 8];
            // In the order of little endian.
            bytes[..size].copy_from_slice(chunk);
            if self.big {
                bytes[..size].reverse();
            }
            let word = u64::from_le_bytes(bytes);
            numbers.push(match element.kind {
                1 => f64::from(word as u8 as i8),
                2 => f64::from(word as u8),
                3 => f64::from(word as u16 as i16),
                4 => f64::from(word as u16),
                5 => f64::from(word as u32 as i32),
                6 => f64::from(word as u32),
                7 => f64::from(f32::from_bits(word as u32)),
                9 => f64::from_bits(word),
                12 => word as i64 as f64,
                _ => word as f64,
            });
        }
        Ok(numbers)
    }
}
