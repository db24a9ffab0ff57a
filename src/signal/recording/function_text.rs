//! Functions of frequency as text: columns of a frequency and of values, below whatever the analyser writes about them.
//!
//! The values are real and imaginary part, magnitude and phase, or magnitudes alone. The headings tell which; the
//! numbers tell decibels and degrees. What remains open is an error that asks for `values`, or a warning.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use num_complex::Complex64;
use tapjoint_numerics::stats::median;

use super::csv::{CsvSource, joined_brackets, split_texts};
use super::error::{RecordingError, RecordingWarning};
use super::responses::{FrequencyResponse, FrequencyResponses, ValueColumns, time_series};
use super::text::{Printed, Separator, check_even, shown};
use super::uff::Point;
use super::units::{ResponseForm, response_unit};
use super::{ReadSettings, read_head};

/// Bytes of header that are looked at.
const HEADER_BYTES: usize = 1 << 16;

/// Levels beyond this (dB) are damage: magnitudes from 1e-100 to 1e100 lie within.
const MOST_DECIBELS: f64 = 2000.0;

/// Opens text by an analyser.
pub(super) fn open_text(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<FrequencyResponses, RecordingError> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let source = CsvSource::open(path, &file, None, |block| {
        columns.resize(block.len(), Vec::new());
        for (column, part) in columns.iter_mut().zip(block) {
            column.extend_from_slice(part);
        }
    })?;
    if source.layout.time.is_some() {
        return Err(time_series(&file, "a time series (it has a time column)"));
    }
    // Cells of the lines above the first row, the last line first.
    let length = usize::try_from(source.layout.start).unwrap_or(HEADER_BYTES);
    let bytes = read_head(path, &file, length.min(HEADER_BYTES))?;
    let (separator, count) = (source.layout.separator, columns.len());
    let lines = bytes.rsplit(|byte| *byte == source.layout.line_end);
    let header = lines.map(|line| {
        let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line);
        let cells = split_texts(line, separator);
        // "force (N)" falls into two under blanks.
        let joined = joined_brackets(cells.clone());
        match separator {
            Separator::Blanks if cells.len() != count && joined.len() == count => joined,
            _ => cells,
        }
    });
    let first_line = source.layout.lines_before + 1;
    let rows = columns.first().map_or(0, Vec::len) as u64;
    let mut columns = columns.into_iter();
    let table = FunctionTable {
        frequencies: columns.next().unwrap_or_default(),
        columns: columns.collect(),
        header: header.collect(),
        // Empty lines are not counted.
        lines: (first_line..first_line + rows).collect(),
        file,
    };
    table.read(settings)
}

/// Columns of numbers over a frequency, and the text above them.
pub(super) struct FunctionTable {
    pub file: String,
    /// The frequency column, in its own unit.
    pub frequencies: Vec<f64>,
    /// The other columns.
    pub columns: Vec<Vec<f64>>,
    /// Cells of the lines above, the last line first. A line of headings has one cell for each column, the
    /// frequency's included.
    pub header: Vec<Vec<String>>,
    /// Line of each row in the file (1-based).
    pub lines: Vec<u64>,
}

/// Meaning of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Real,
    Imaginary,
    Magnitude,
    Phase,
    Coherence,
    Unnamed,
}

impl Role {
    /// By the heading, in any case of letters.
    fn of(heading: &str) -> Self {
        let lower = heading.trim().to_lowercase();
        // The first word: "re" of "Re (m/s2)/N", "im" of "Im/N".
        let word = lower.split(|c: char| !c.is_alphabetic()).next();
        let word = word.unwrap_or_default();
        let holds = |words: &[&str]| words.iter().any(|word| lower.contains(word));
        if word.starts_with("coh") || word.starts_with("gamma") || holds(&["coherence"]) {
            Self::Coherence
        } else if matches!(word, "arg" | "angle" | "deg" | "degrees") || holds(&["phase"]) {
            Self::Phase
        } else if word == "im" || holds(&["imag"]) {
            Self::Imaginary
        } else if word == "re" || holds(&["real"]) {
            Self::Real
        } else if matches!(word, "mag" | "amp" | "abs" | "db" | "level" | "gain")
            || holds(&[
                "magnitude",
                "amplitude",
                "fft",
                "spectr",
                "psd",
                "(db",
                "[db",
                " db",
            ])
        {
            Self::Magnitude
        } else {
            Self::Unnamed
        }
    }
}

/// Returns true for a heading that holds this word.
fn has_word(heading: &str, word: &str) -> bool {
    let mut words = heading.split(|c: char| !c.is_alphanumeric());
    words.any(|own| own == word)
}

/// Returns true for a heading that means a function of frequency.
pub(super) fn is_function_heading(heading: &str) -> bool {
    let role = Role::of(heading);
    let lower = heading.to_lowercase();
    matches!(role, Role::Magnitude | Role::Phase | Role::Coherence)
        && [
            "fft",
            "spectr",
            "psd",
            "frf",
            "coherence",
            "phase",
            "magnitude",
        ]
        .iter()
        .any(|word| lower.contains(word))
}

/// Columns of one function.
#[derive(Debug, Clone, Copy)]
enum Arrangement {
    Parts {
        real: usize,
        imaginary: usize,
    },
    Polar {
        magnitude: usize,
        phase: Option<usize>,
    },
}

impl FunctionTable {
    /// An error at the first row, which says what is allowed.
    fn wrong(&self, problem: &str) -> RecordingError {
        let line = self.lines.first().copied().unwrap_or(1);
        let problem = format!(
            "{problem}; allowed: a frequency (Hz) and then real and imaginary part, or magnitude and phase, or magnitudes alone, with headings that say so, and a coherence; or state values = \"complex\", \"magnitude-phase\" or \"dB-degrees\" (--values)"
        );
        RecordingError::at_line(&self.file, line, problem)
    }

    /// Turns the columns into functions.
    pub(super) fn read(
        self,
        settings: &ReadSettings,
    ) -> Result<FrequencyResponses, RecordingError> {
        if self.frequencies.is_empty() {
            return Err(RecordingError::no_samples(&self.file));
        }
        let roles = self.roles();
        let arrangements = self.arrange(&roles, settings.values)?;
        let (first_frequency, spacing) = self.even_lines()?;
        let (factor, unit) = units_in(&self.header);
        let scale = unit.as_ref().map_or(1.0, |(_, scale, _)| *scale);
        let (reference, response) = self.points();
        let mut warnings = Vec::new();
        let coherences = self.coherences(&roles, arrangements.len(), &mut warnings);
        let mut coherences = coherences.into_iter();
        let mut has_phase = true;
        let mut responses = Vec::with_capacity(arrangements.len());
        for arrangement in &arrangements {
            let mut values = match *arrangement {
                Arrangement::Parts { real, imaginary } => {
                    let parts = self.columns[real].iter().zip(&self.columns[imaginary]);
                    parts.map(|(re, im)| Complex64::new(*re, *im)).collect()
                }
                Arrangement::Polar { magnitude, phase } => {
                    has_phase &= phase.is_some();
                    self.polar(magnitude, phase, settings.values, &mut warnings)?
                }
            };
            values.iter_mut().for_each(|value| *value *= scale);
            responses.push(FrequencyResponse {
                name: self.name_of(arrangement, arrangements.len(), (&response, &reference)),
                response: response.clone(),
                reference: reference.clone(),
                form: unit.as_ref().map(|(.., form)| *form),
                unit: unit.as_ref().map(|(written, ..)| written.clone()),
                values,
                coherence: coherences.next(),
            });
        }
        Ok(FrequencyResponses {
            first_frequency: first_frequency * factor,
            spacing: spacing * factor,
            lines: self.frequencies.len(),
            has_phase,
            responses,
            warnings,
            file: self.file,
        })
    }

    /// The heading of a value column: that of the lowest line with a cell for each column and a known role.
    fn headings(&self) -> Option<&[String]> {
        let count = self.columns.len() + 1;
        let mut lines = self.header.iter();
        let found = lines.find(|cells| {
            let roles = cells.iter().skip(1).map(|cell| Role::of(cell));
            cells.len() >= count && roles.take(count - 1).any(|role| role != Role::Unnamed)
        });
        found.map(|cells| &cells[1..count])
    }

    fn roles(&self) -> Vec<Role> {
        match self.headings() {
            Some(cells) => cells.iter().map(|cell| Role::of(cell)).collect(),
            None => vec![Role::Unnamed; self.columns.len()],
        }
    }

    /// Decides which columns belong to which function.
    fn arrange(
        &self,
        roles: &[Role],
        stated: Option<ValueColumns>,
    ) -> Result<Vec<Arrangement>, RecordingError> {
        let of = |role: Role| (0..roles.len()).filter(move |at| roles[*at] == role);
        let values: Vec<usize> = (0..roles.len())
            .filter(|at| roles[*at] != Role::Coherence)
            .collect();
        let polar = |magnitude, phase| Arrangement::Polar { magnitude, phase };
        match (stated, values.as_slice()) {
            (Some(ValueColumns::Complex), [real, imaginary]) => {
                let (real, imaginary) = (*real, *imaginary);
                return Ok(vec![Arrangement::Parts { real, imaginary }]);
            }
            (Some(ValueColumns::Complex), other) => {
                let problem = format!(
                    "there are {} columns of values where real and imaginary part are two",
                    other.len()
                );
                return Err(self.wrong(&problem));
            }
            (Some(_), [magnitude]) => return Ok(vec![polar(*magnitude, None)]),
            (Some(_), [magnitude, phase]) if of(Role::Magnitude).count() < 2 => {
                return Ok(vec![polar(*magnitude, Some(*phase))]);
            }
            _ => {}
        }
        let [reals, imaginaries] =
            [Role::Real, Role::Imaginary].map(|role| of(role).collect::<Vec<_>>());
        let apart = "the headings do not say which columns belong together";
        if !reals.is_empty() || !imaginaries.is_empty() {
            // Magnitude and phase beside them say the same again.
            if reals.len() != imaginaries.len() || of(Role::Unnamed).next().is_some() {
                return Err(self.wrong(apart));
            }
            let pairs = reals.into_iter().zip(imaginaries);
            let parts = pairs.map(|(real, imaginary)| Arrangement::Parts { real, imaginary });
            return Ok(parts.collect());
        }
        let mut magnitudes: Vec<usize> = of(Role::Magnitude).collect();
        let phases: Vec<usize> = of(Role::Phase).collect();
        let unnamed: Vec<usize> = of(Role::Unnamed).collect();
        if magnitudes.is_empty() && unnamed.len() == 1 {
            // One value beside a frequency, a phase or a coherence is the magnitude.
            magnitudes.clone_from(&unnamed);
        } else if !magnitudes.is_empty() && !unnamed.is_empty() {
            return Err(self.wrong(apart));
        }
        match (magnitudes.as_slice(), phases.as_slice(), unnamed.as_slice()) {
            ([magnitude], [phase], _) => Ok(vec![polar(*magnitude, Some(*phase))]),
            ([_, ..], [], _) => Ok(magnitudes.iter().map(|at| polar(*at, None)).collect()),
            ([_, ..], [_, ..], _) if magnitudes.len() == phases.len() => {
                let pairs = magnitudes.iter().zip(&phases);
                Ok(pairs.map(|(at, phase)| polar(*at, Some(*phase))).collect())
            }
            ([], [], [real, imaginary]) => {
                self.check_parts(*real, *imaginary)?;
                Ok(vec![Arrangement::Parts {
                    real: *real,
                    imaginary: *imaginary,
                }])
            }
            _ if self.headings().is_none() => {
                let count = self.columns.len() + 1;
                Err(self.wrong(&format!(
                    "there are {count} columns and no heading says what they are"
                )))
            }
            _ => Err(self.wrong(apart)),
        }
    }

    /// Refuses to take columns without headings for real and imaginary part where they look like magnitude and phase.
    fn check_parts(&self, real: usize, imaginary: usize) -> Result<(), RecordingError> {
        let mut sizes: Vec<f64> = self.columns[imaginary].iter().map(|x| x.abs()).collect();
        let middle = median(&mut sizes);
        let largest = sizes.iter().fold(0.0, |most: f64, x| most.max(*x));
        // A phase reaches a quarter to half a turn, and most lines lie far from 0. An imaginary part has peaks: most
        // lines lie far below the largest. The hundredth is for printed digits.
        let is_phase = [180.0, PI]
            .into_iter()
            .any(|half| (0.47 * half..1.01 * half).contains(&largest) && middle > 0.25 * largest);
        match is_phase {
            false => Ok(()),
            true => Err(self.wrong(&format!(
                "columns {} and {} have no headings and look like magnitude and phase: the numbers of the second are angles within half a turn",
                real + 2,
                imaginary + 2
            ))),
        }
    }

    /// The values of a magnitude and a phase.
    fn polar(
        &self,
        magnitude: usize,
        phase: Option<usize>,
        stated: Option<ValueColumns>,
        warnings: &mut Vec<RecordingWarning>,
    ) -> Result<Vec<Complex64>, RecordingError> {
        let levels = &self.columns[magnitude];
        let heading = |column: usize| {
            let cells = self.headings().map(|cells| cells[column].to_lowercase());
            // Units may stand in a line of their own.
            let below = self.header.iter().find_map(|cells| {
                let cell = cells.get(column + 1)?.to_lowercase();
                let unit = cell.trim_matches(['(', ')', '[', ']', ' ']);
                ["db", "deg", "rad", "\u{b0}"]
                    .contains(&unit)
                    .then(|| unit.to_owned())
            });
            [cells.unwrap_or_default(), below.unwrap_or_default()].join(" ")
        };
        let negative = levels.iter().position(|level| *level < 0.0);
        let in_decibels = match stated {
            Some(ValueColumns::DecibelDegrees) => true,
            Some(_) => match negative {
                None => false,
                Some(at) => {
                    let problem = format!(
                        "column {} holds {}; allowed: magnitudes from 0 up, because values = \"magnitude-phase\" is stated; state \"dB-degrees\" where these are levels in dB",
                        magnitude + 2,
                        levels[at]
                    );
                    return Err(RecordingError::at_line(&self.file, self.lines[at], problem));
                }
            },
            None if has_word(&heading(magnitude), "db") => true,
            None => {
                let message = match negative {
                    Some(_) => None,
                    None => Some(format!(
                        "column {} is taken as linear magnitudes: its heading has no dB and no value is negative; state values = \"dB-degrees\" if these are levels in dB",
                        magnitude + 2
                    )),
                };
                warnings.extend(message.map(|text| RecordingWarning::new("values-assumed", text)));
                negative.is_some()
            }
        };
        if in_decibels && let Some(at) = levels.iter().position(|level| level.abs() > MOST_DECIBELS)
        {
            let problem = format!(
                "column {} holds {} dB; allowed: -{MOST_DECIBELS} to {MOST_DECIBELS} dB; export it again",
                magnitude + 2,
                levels[at]
            );
            return Err(RecordingError::at_line(&self.file, self.lines[at], problem));
        }
        // A power is the square of the magnitude; in dB both are one number.
        let marks = ["psd", "power", "autospect", "/hz"];
        let is_power = !in_decibels && marks.iter().any(|mark| heading(magnitude).contains(mark));
        let to_radians = phase.map_or(0.0, |column| {
            let heading = heading(column);
            let largest = self.columns[column]
                .iter()
                .fold(0.0, |most: f64, x| most.max(x.abs()));
            let in_degrees = match stated {
                Some(ValueColumns::DecibelDegrees) => true,
                _ if heading.contains("deg") || heading.contains('\u{b0}') => true,
                _ if heading.contains("rad") => false,
                // Beyond half a turn in radians; the hundredth is for printed digits.
                _ => {
                    if (PI + 0.01..2.0 * TAU).contains(&largest) {
                        let message = format!(
                            "column {} is taken as a phase in degrees: its heading has no unit; write (rad) into it if these are radians beyond half a turn",
                            column + 2
                        );
                        warnings.push(RecordingWarning::new("values-assumed", message));
                    }
                    largest > PI + 0.01
                }
            };
            if in_degrees { TAU / 360.0 } else { 1.0 }
        });
        let phases = phase.map(|column| self.columns[column].as_slice());
        let values = levels.iter().enumerate().map(|(at, level)| {
            let size = match in_decibels {
                true => 10_f64.powf(level / 20.0),
                false if is_power => level.sqrt(),
                false => *level,
            };
            let phase = phases.map_or(0.0, |phases| phases[at]);
            Complex64::from_polar(size, phase * to_radians)
        });
        Ok(values.collect())
    }

    /// Returns the columns of the coherence in the order of the functions; none where they are not usable.
    fn coherences(
        &self,
        roles: &[Role],
        functions: usize,
        warnings: &mut Vec<RecordingWarning>,
    ) -> Vec<Vec<f64>> {
        let columns = roles.iter().zip(&self.columns);
        let found = columns.filter(|(role, _)| **role == Role::Coherence);
        let mut found: Vec<Vec<f64>> = found.map(|(_, values)| values.clone()).collect();
        let are_usable =
            found.len() == functions && found.iter().all(|one| all_within_coherence(one));
        if !found.is_empty() && !are_usable {
            let message = "the coherence is left out: it has not one column for each function, or a value is not between 0 and 1; export it again if it is needed";
            warnings.push(RecordingWarning::new(
                "coherence-left-out",
                message.to_owned(),
            ));
            found.clear();
        }
        found
    }

    /// Reads reference and response from a line such as "Ref Chan:Resp Chan", "1+Z:3+Z".
    fn points(&self) -> (Point, Point) {
        let points = self.header.iter().find(|cells| {
            let first = cells.first().map(|cell| cell.to_lowercase());
            first.is_some_and(|cell| cell.starts_with("ref") && cell.contains("resp"))
        });
        let points = points.and_then(|cells| cells.get(1)?.split_once(':'));
        let (reference, response) = points.unwrap_or_default();
        let [reference, response] = [reference, response].map(|name| Point {
            name: Some(name.trim().to_owned()).filter(|name| !name.is_empty()),
            ..Point::default()
        });
        (reference, response)
    }

    /// Name of a function: its points, else the heading where there are several, else "response".
    fn name_of(&self, arrangement: &Arrangement, count: usize, points: (&Point, &Point)) -> String {
        let (response, reference) = points;
        if response.name.is_some() || reference.name.is_some() {
            return format!("{response} / {reference}");
        }
        let (Arrangement::Parts { real: first, .. }
        | Arrangement::Polar {
            magnitude: first, ..
        }) = arrangement;
        match self.headings().filter(|_| count > 1) {
            Some(cells) => shown(cells[*first].as_bytes()),
            None => "response".to_owned(),
        }
    }

    /// Returns first frequency and spacing (the column's unit).
    fn even_lines(&self) -> Result<(f64, f64), RecordingError> {
        let lines = self.lines.iter().copied();
        let uneven = check_even(&self.frequencies, lines, Printed::Shortest, false).err();
        if let Some(uneven) = uneven {
            let problem = format!(
                "uneven lines: {}; allowed: 0.1 % of the step, or what rounding of the printed frequency explains; export evenly spaced lines",
                uneven.words(1.0, "Hz", "line")
            );
            return Err(RecordingError::at_line(&self.file, uneven.line, problem));
        }
        match self.frequencies.as_slice() {
            [first, .., last] => {
                let steps = (self.frequencies.len() - 1) as f64;
                Ok((*first, (last - first) / steps))
            }
            _ => Err(self.wrong("there is a single line, which has no spacing")),
        }
    }
}

/// Returns true where all values lie between 0 and 1, but for what printing with six digits adds, and more.
pub(super) fn all_within_coherence(values: &[f64]) -> bool {
    values.iter().all(|value| (-1e-3..=1.001).contains(value))
}

/// Returns the factor from the frequency column's unit to Hz, and the unit of the values: as written, its factor, its
/// form.
fn units_in(header: &[Vec<String>]) -> (f64, Option<(String, f64, ResponseForm)>) {
    let mut first_cells = header.iter().filter_map(|cells| cells.first());
    let factor = first_cells.find_map(|cell| {
        let cell = cell.to_lowercase();
        let cell = cell.trim_end_matches([')', ']']);
        match cell.rsplit(['(', '[', ' ']).next() {
            Some("hz") => Some(1.0),
            Some("khz") => Some(1e3),
            // 2 pi rad are one cycle.
            Some("rad/s") => Some(0.5 / PI),
            _ => None,
        }
    });
    // The cell nearest above the numbers that is a unit, or that has one in its last brackets.
    let unit = header.iter().flatten().find_map(|cell| {
        let inner = cell.split_once(['(', '[']).map(|(_, rest)| rest);
        let inner = inner.and_then(|rest| rest.strip_suffix([')', ']']));
        [Some(cell.as_str()), inner].into_iter().find_map(|text| {
            let text = text?.trim();
            let (factor, form) = response_unit(text)?;
            Some((text.to_owned(), factor, form))
        })
    });
    (factor.unwrap_or(1.0), unit)
}
