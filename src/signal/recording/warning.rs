//! Doubts about a recording or about frequency responses that do not keep them from being used.

use std::fmt;

/// A channel, as a warning names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelLabel {
    /// 1-based number.
    pub number: usize,
    /// Name, where the file gives one.
    pub name: Option<String>,
}

impl fmt::Display for ChannelLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.name {
            Some(name) => write!(f, "channel {} (\"{name}\")", self.number),
            None => write!(f, "channel {}", self.number),
        }
    }
}

/// A doubt about a recording: what happened, why it might be, what helps.
///
/// [`code`](Self::code) is short and stable, for reports; `Display` is the sentence.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingWarning {
    /// The file ends before the header says.
    #[error(
        "the file is truncated: {present} of the promised {promised} samples per channel are there; the recorder or a copy was probably interrupted; what is there is used"
    )]
    Truncated {
        /// Samples per channel in the file.
        present: u64,
        /// Samples per channel by the header.
        promised: u64,
    },
    /// The header does not say how long the file is.
    #[error(
        "the header gives no valid length (data size {size}); the recorder probably stopped without closing the file; read to the end of the file, {present} samples per channel"
    )]
    UnknownLength {
        /// Size by the header (bytes).
        size: u64,
        /// Samples per channel in the file.
        present: u64,
    },
    /// Integers that sit at the wrong end of their container.
    #[error(
        "{bits}-bit samples sit at the low end of their {container}-bit containers, not at the high end as the format demands; full scale is taken as {bits} bits; check the levels"
    )]
    RightAligned {
        /// Valid bits.
        bits: u16,
        /// Bits of a container.
        container: u16,
    },
    /// Samples at the end of the number range.
    #[error(
        "{channel}: {count} samples at full scale, the first at {time:.6} s; the input was probably overloaded; lower the gain or tap more softly"
    )]
    FullScale {
        /// The channel.
        channel: ChannelLabel,
        /// Number of samples.
        count: u64,
        /// The first one (s).
        time: f64,
    },
    /// Crests that are cut off.
    #[error(
        "{channel}: {count} flat tops at its extreme level, the first at {time:.6} s ({len} equal samples at {level}); an amplifier or sensor was probably overloaded; lower the gain or tap more softly"
    )]
    FlatTops {
        /// The channel.
        channel: ChannelLabel,
        /// Number of runs.
        count: u64,
        /// Start of the first one (s).
        time: f64,
        /// Samples of the first one.
        len: u64,
        /// Level of the first one (the channel's unit).
        level: f64,
    },
    /// Runs of repeated samples.
    #[error(
        "{channel}: {count} runs of repeated samples inside the moving signal, {samples} samples in all, the first at {time:.6} s ({len} samples of {level}); the recorder probably lost data; leave these taps out or record again"
    )]
    Dropped {
        /// The channel.
        channel: ChannelLabel,
        /// Number of runs.
        count: u64,
        /// Samples in all of them.
        samples: u64,
        /// Start of the first one (s).
        time: f64,
        /// Samples of the first one.
        len: u64,
        /// Repeated value of the first one (the channel's unit).
        level: f64,
    },
    /// A channel that never moves.
    #[error(
        "{channel}: every sample is {level}; probably nothing was connected; check the cable and the channel numbers"
    )]
    Constant {
        /// The channel.
        channel: ChannelLabel,
        /// The value (the channel's unit).
        level: f64,
    },
    /// A mean far from zero.
    #[error(
        "{channel}: mean {mean:.4e} where the peak is {peak:.4e}; the sensor's supply or the amplifier's zero probably shifts it; couple it AC, or ignore this where the mean is removed"
    )]
    Offset {
        /// The channel.
        channel: ChannelLabel,
        /// The mean (the channel's unit).
        mean: f64,
        /// Largest magnitude (the channel's unit).
        peak: f64,
    },
    /// A scale was given for a column whose header has a unit.
    #[error(
        "{channel}: the scale {scale} is used and the unit \"{unit}\" of the header is not; drop one of them if they say the same"
    )]
    ScaleOverUnit {
        /// The channel.
        channel: ChannelLabel,
        /// The scale (SI units per unit of the file).
        scale: f64,
        /// The unit as the header has it.
        unit: String,
    },
    /// A unit that is not known.
    #[error(
        "{channel}: the unit \"{unit}\" of the header is not known; the numbers are taken as they stand; give a scale"
    )]
    UnknownUnit {
        /// The channel.
        channel: ChannelLabel,
        /// The unit as the header has it.
        unit: String,
    },
    /// A sample rate was given for a file that has its own.
    #[error(
        "the sample rate given ({given} Hz) differs from the file's own ({used} Hz), which is used; drop the one given or correct the file"
    )]
    SampleRateIgnored {
        /// The rate given (Hz).
        given: f64,
        /// The file's own (Hz).
        used: f64,
    },
    /// A universal file that ends within a header.
    #[error(
        "the file ends within the header of dataset {dataset}, which is left out; a copy was probably interrupted; export or copy it again"
    )]
    HeaderCut {
        /// The dataset, 1-based.
        dataset: usize,
    },
    /// A time series that was not sampled with the others of its file.
    #[error(
        "dataset {dataset} ({name}) is left out: {reason}; channels of a recording are sampled together, and their numbers count those kept; export it to a file of its own if it is needed"
    )]
    DatasetLeftOut {
        /// The dataset, 1-based.
        dataset: usize,
        /// Its place and description.
        name: String,
        /// Difference to the others.
        reason: String,
    },
    /// Two channels at one place.
    #[error(
        "{channel} has the same place and quantity ({place}) as {earlier}; the file probably holds several runs, which are not simultaneous; use channels of one run"
    )]
    RepeatedPlace {
        /// The later channel.
        channel: ChannelLabel,
        /// The earlier one.
        earlier: ChannelLabel,
        /// The place as the file has it.
        place: String,
    },
    /// A label and a unit system that contradict each other.
    #[error(
        "{channel}: the label says \"{unit}\" (times {used} to SI), the file's unit system means times {by_system}; the label is used; check the level, or give a scale"
    )]
    UnitsDisagree {
        /// The channel.
        channel: ChannelLabel,
        /// The unit as the label has it.
        unit: String,
        /// Factor by the label.
        used: f64,
        /// Factor by the unit system.
        by_system: f64,
    },
    /// A rate taken as the whole number next to it.
    #[error(
        "the time column's mean step gives {mean:.4} Hz; its steps scatter enough for {used} Hz, which is used; the time was probably summed or printed with few digits"
    )]
    RateRounded {
        /// From first and last time (Hz).
        mean: f64,
        /// The whole number used (Hz).
        used: f64,
    },
}

impl RecordingWarning {
    /// Short name of the kind of doubt, for reports.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Truncated { .. } => "truncated",
            Self::UnknownLength { .. } => "unknown-length",
            Self::RightAligned { .. } => "right-aligned",
            Self::FullScale { .. } => "full-scale",
            Self::FlatTops { .. } => "flat-tops",
            Self::Dropped { .. } => "dropped-samples",
            Self::Constant { .. } => "constant-channel",
            Self::Offset { .. } => "offset",
            Self::ScaleOverUnit { .. } => "scale-over-unit",
            Self::UnknownUnit { .. } => "unknown-unit",
            Self::SampleRateIgnored { .. } => "sample-rate-ignored",
            Self::RateRounded { .. } => "rate-rounded",
            Self::HeaderCut { .. } => "header-cut",
            Self::DatasetLeftOut { .. } => "dataset-left-out",
            Self::RepeatedPlace { .. } => "repeated-place",
            Self::UnitsDisagree { .. } => "units-disagree",
        }
    }
}

/// A doubt about frequency response functions that does not keep them from being used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ResponseWarning {
    /// A dataset that is not among the responses.
    #[error(
        "dataset {dataset} ({name}) is left out: {reason}; export it to a file of its own if it is needed"
    )]
    LeftOut {
        /// The dataset, 1-based.
        dataset: usize,
        /// Its place and description.
        name: String,
        /// Reason.
        reason: String,
    },
    /// The file ends before the header says.
    #[error(
        "the file is truncated: {present} of the promised {promised} lines are there; an export or a copy was probably interrupted; what is there is used"
    )]
    Truncated {
        /// Lines in the file.
        present: u64,
        /// Lines by the header.
        promised: u64,
    },
    /// A universal file that ends within a header.
    #[error(
        "the file ends within the header of dataset {dataset}, which is left out; a copy was probably interrupted; export or copy it again"
    )]
    HeaderCut {
        /// The dataset, 1-based.
        dataset: usize,
    },
    /// A unit that is not known.
    #[error(
        "{name}: the unit \"{unit}\" is not known; the numbers are taken as they stand, in SI units; check the level"
    )]
    UnknownUnit {
        /// The response.
        name: String,
        /// The unit as written.
        unit: String,
    },
    /// Axis types and unit that contradict each other.
    #[error(
        "{name}: the types of its axes make it {by_axes}, its unit \"{unit}\" makes it {by_unit}; it is taken as {by_axes}; say which it is with `form`"
    )]
    FormsDisagree {
        /// The response.
        name: String,
        /// The unit as written.
        unit: String,
        /// Form by the axes' types.
        by_axes: &'static str,
        /// Form by the unit.
        by_unit: &'static str,
    },
}

impl ResponseWarning {
    /// Short name of the kind of doubt, for reports.
    pub fn code(&self) -> &'static str {
        match self {
            Self::LeftOut { .. } => "dataset-left-out",
            Self::Truncated { .. } => "truncated",
            Self::HeaderCut { .. } => "header-cut",
            Self::UnknownUnit { .. } => "unknown-unit",
            Self::FormsDisagree { .. } => "forms-disagree",
        }
    }
}
