//! The laboratory of a virtual test: its options, and its description for the terminal.

use super::arguments::words;
use crate::quantity::{Dimension, parse_quantity};
use crate::simulate::{AntiAlias, Damping, Laboratory, MOST_RATE, Tip};
use anyhow::bail;
use clap::builder::{RangedU64ValueParser, TypedValueParser};
use clap::{Args, ValueEnum};

/// Returns the parts of the laboratory with their values, `off` for a part that is left out.
pub(super) fn laboratory_lines(laboratory: &Laboratory) -> Vec<(&'static str, String)> {
    let Laboratory {
        hammer,
        sensors,
        recorder,
        specimen,
    } = laboratory;
    let good_sensors = "times 0.003 m/s2, 2e-6 m/s, 1e-7 m, 0.005 N (rms)";
    let filter = match recorder.anti_alias {
        AntiAlias::On => "flat to rate/2.56".to_owned(),
        AntiAlias::Off => "off".to_owned(),
    };
    let hum = format!("of full scale at {} Hz", recorder.mains);
    let damping = match &specimen.damping {
        Damping::Modal(ratios) => {
            let ratios: Vec<String> = ratios
                .iter()
                .map(|ratio| format!("{:.3}", 100.0 * ratio))
                .collect();
            format!("{} % (the last for all beyond)", ratios.join(", "))
        }
        Damping::Rayleigh { mass, stiffness } => {
            format!("{mass} 1/s of mass, {stiffness} s of stiffness")
        }
    };
    vec![
        ("hammer", format!("{} N at level 1", hammer.peak_force)),
        ("scatter of level", percent(hammer.level_scatter)),
        ("scatter of length", percent(hammer.length_scatter)),
        ("scatter of place", or_off(1e3 * hammer.place_scatter, "mm")),
        ("double hits", percent(hammer.double_hits)),
        ("weak hits", percent(hammer.weak_hits)),
        ("lead", format!("{} s", hammer.lead)),
        ("noise", or_off(sensors.noise, good_sensors)),
        ("sensitivities", percent(sensors.sensitivity_error)),
        ("AC coupling", or_off(sensors.ac_coupling, "Hz")),
        ("mounting", or_off(sensors.mounting_resonance, "Hz")),
        ("anti-alias filter", filter),
        ("bits", recorder.bits.to_string()),
        ("mains hum", small_or_off(recorder.hum, &hum)),
        ("drift", small_or_off(recorder.drift, "of full scale")),
        ("offset", small_or_off(recorder.offset, "of full scale")),
        (
            "clock",
            match recorder.clock_error {
                0.0 => "off".to_owned(),
                error => format!("{error:+e}"),
            },
        ),
        ("damping", damping),
    ]
}

fn percent(value: f64) -> String {
    or_off(100.0 * value, "%")
}

fn or_off(value: f64, unit: &str) -> String {
    match value {
        0.0 => "off".to_owned(),
        value => format!("{value} {unit}"),
    }
}

/// Writes a small value with an exponent.
fn small_or_off(value: f64, unit: &str) -> String {
    match value {
        0.0 => "off".to_owned(),
        value => format!("{value:e} {unit}"),
    }
}

/// Settings of a virtual test. The defaults are those of a good laboratory; the command prints them.
#[derive(Debug, Args)]
#[command(next_help_heading = "Laboratory")]
pub(super) struct LaboratoryArguments {
    /// Leave out all disturbances: noise, scatter, errors, and all filters but the anti-alias filter. The
    /// other options still apply
    #[arg(long)]
    ideal: bool,
    /// Leave out parts of the laboratory
    #[arg(long, value_enum, value_delimiter = ',', value_name = "PART,...")]
    without: Vec<Part>,
    /// Number of taps in each recording; default: 5
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=100_000))]
    taps: Option<usize>,
    /// Length of each recording (s); default: long enough for the taps to ring down
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Sample rate (Hz), 100 to 204800; default: the lowest usual rate that covers the band
    #[arg(long, value_name = "HZ", value_parser = sample_rate)]
    rate: Option<u32>,
    /// Bits of a sample, 32 = floating point; default: 24
    #[arg(long, value_name = "N", value_parser = ["16", "24", "32"])]
    bits: Option<String>,
    /// Tip of the hammer; default: the softest that excites the band
    #[arg(long, value_parser = tip())]
    tip: Option<Tip>,
    /// Peak force of a tap (N), multiplied by each recording's `level`; default: 20
    #[arg(long, value_name = "N", value_parser = within(Dimension::Force, 1e-6, 1e6))]
    level: Option<f64>,
    /// Noise of sensors and hammer relative to that of good ones; default: 1
    #[arg(long, value_name = "X", value_parser = within(Dimension::Ratio, 0.0, 1e9))]
    noise: Option<f64>,
    /// Share of the taps that strike twice; default: 0
    #[arg(long, value_name = "SHARE", value_parser = within(Dimension::Ratio, 0.0, 1.0))]
    double_hits: Option<f64>,
    /// Share of the taps that are far too weak; default: 0
    #[arg(long, value_name = "SHARE", value_parser = within(Dimension::Ratio, 0.0, 1.0))]
    weak_hits: Option<f64>,
    /// Quiet time before the first tap (s); default: 0.5
    #[arg(long, value_name = "S", value_parser = seconds)]
    lead: Option<f64>,
    /// Relative error of the recorder's clock, positive = frequencies are read too high; default: 5e-6
    #[arg(long, value_name = "X", value_parser = within(Dimension::Ratio, -0.5, 0.5), allow_negative_numbers = true)]
    clock_error: Option<f64>,
    /// Resonance frequency of a mounted accelerometer (Hz), up to 100000, 0 = none; default: 18000
    #[arg(long, value_name = "HZ", value_parser = within(Dimension::Frequency, 0.0, 1e5))]
    mounting: Option<f64>,
    /// Mains frequency (Hz); default: 50
    #[arg(long, value_name = "HZ", value_parser = within(Dimension::Frequency, 0.0, 1e5))]
    mains: Option<f64>,
    /// Damping ratio of each mode. The last one applies to all higher modes; default:
    /// 0.4%,0.3%,0.25%,0.2%
    #[arg(long, value_name = "Z,...", value_delimiter = ',', value_parser = within(Dimension::Ratio, 0.0, 1.0), conflicts_with = "rayleigh")]
    damping: Vec<f64>,
    /// Damping proportional to mass (1/s) and stiffness (s), instead of --damping
    #[arg(long, value_name = "MASS,STIFFNESS", value_delimiter = ',', value_parser = within(Dimension::Ratio, 0.0, 1e6))]
    rayleigh: Vec<f64>,
}

/// Parts of the laboratory that can be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Noise of sensors and hammer
    Noise,
    /// Mains hum
    Hum,
    /// Slow drift of the zero
    Drift,
    /// Offset of the zero
    Offset,
    /// Anti-alias filter
    AntiAlias,
    /// High-pass of AC-coupled inputs
    AcCoupling,
    /// Resonance of the mounted accelerometers
    Mounting,
    /// Errors of the sensitivities
    SensitivityError,
    /// Error of the clock
    ClockError,
    /// Scatter of level, length and place of the taps
    Scatter,
    /// Rigid-body motion of a free or lap-jointed beam on its suspension
    Suspension,
}

fn tip() -> impl TypedValueParser<Value = Tip> {
    let tips = [
        ("steel", Tip::Steel),
        ("nylon", Tip::Nylon),
        ("rubber", Tip::Rubber),
    ];
    words(
        tips,
        ["0.3 ms, to 3.3 kHz", "1.4 ms, to 1 kHz", "5 ms, to 290 Hz"],
    )
}

impl LaboratoryArguments {
    /// Returns the laboratory with these options.
    pub(super) fn resolve(&self) -> anyhow::Result<Laboratory> {
        let mut laboratory = if self.ideal {
            Laboratory::ideal()
        } else {
            Laboratory::default()
        };
        for part in &self.without {
            part.leave_out(&mut laboratory);
        }
        self.set_hammer(&mut laboratory)?;
        laboratory.recorder.sample_rate = self.rate;
        if let Some(bits) = &self.bits {
            laboratory.recorder.bits = bits.parse()?;
        }
        set(&mut laboratory.recorder.clock_error, self.clock_error);
        set(&mut laboratory.recorder.mains, self.mains);
        set(&mut laboratory.sensors.noise, self.noise);
        set(&mut laboratory.sensors.mounting_resonance, self.mounting);
        if !self.damping.is_empty() {
            laboratory.specimen.damping = Damping::Modal(self.damping.clone());
        }
        match self.rayleigh[..] {
            [] => {}
            [_, stiffness] if stiffness > 1.0 => bail!(
                "--rayleigh: the stiffness part is {stiffness:?} s; give 0 to 1 s, such as 0.5,1e-6"
            ),
            [mass, stiffness] => {
                laboratory.specimen.damping = Damping::Rayleigh { mass, stiffness };
            }
            _ => bail!(
                "--rayleigh has {} numbers; give two, MASS (1/s) and STIFFNESS (s), such as 0.5,1e-6",
                self.rayleigh.len()
            ),
        }
        Ok(laboratory)
    }

    fn set_hammer(&self, laboratory: &mut Laboratory) -> anyhow::Result<()> {
        let hammer = &mut laboratory.hammer;
        set(&mut hammer.taps, self.taps);
        set(&mut hammer.lead, self.lead);
        set(&mut hammer.peak_force, self.level);
        set(&mut hammer.double_hits, self.double_hits);
        set(&mut hammer.weak_hits, self.weak_hits);
        hammer.tip = self.tip;
        if let Some(seconds) = self.seconds {
            let interval = (seconds - hammer.lead) / hammer.taps as f64;
            // A tap needs room for its pulse and some of what rings.
            if interval < 0.05 {
                bail!(
                    "--seconds {seconds} leaves {interval:.3} s for each of {} taps after {} s of lead; give at least {:.1} s, or fewer --taps",
                    hammer.taps,
                    hammer.lead,
                    hammer.lead + 0.05 * hammer.taps as f64
                );
            }
            hammer.interval = Some(interval);
        }
        Ok(())
    }
}

fn set<T>(value: &mut T, given: Option<T>) {
    if let Some(given) = given {
        *value = given;
    }
}

impl Part {
    fn leave_out(self, laboratory: &mut Laboratory) {
        let Laboratory {
            hammer,
            sensors,
            recorder,
            specimen,
        } = laboratory;
        match self {
            Self::Noise => sensors.noise = 0.0,
            Self::Hum => recorder.hum = 0.0,
            Self::Drift => recorder.drift = 0.0,
            Self::Offset => recorder.offset = 0.0,
            Self::AntiAlias => recorder.anti_alias = AntiAlias::Off,
            Self::AcCoupling => sensors.ac_coupling = 0.0,
            Self::Mounting => sensors.mounting_resonance = 0.0,
            Self::SensitivityError => sensors.sensitivity_error = 0.0,
            Self::ClockError => recorder.clock_error = 0.0,
            Self::Scatter => {
                hammer.level_scatter = 0.0;
                hammer.length_scatter = 0.0;
                hammer.place_scatter = 0.0;
            }
            Self::Suspension => specimen.suspension = None,
        }
    }
}

fn quantity(text: &str, dimension: Dimension) -> Result<f64, String> {
    parse_quantity(text, dimension).map_err(|error| error.to_string())
}

/// Returns the parser of a quantity between these limits (SI).
pub(super) fn within(
    dimension: Dimension,
    lowest: f64,
    highest: f64,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| {
        let value = quantity(text, dimension)?;
        match (lowest..=highest).contains(&value) {
            true => Ok(value),
            false => Err(format!("give a number from {lowest} to {highest}")),
        }
    }
}

/// Parses a time of at most a day.
fn seconds(text: &str) -> Result<f64, String> {
    match text.trim().trim_end_matches('s').trim().parse::<f64>() {
        Ok(value) if (0.0..=86_400.0).contains(&value) => Ok(value),
        _ => Err(format!(
            "\"{text}\" is no time; give seconds from 0 to 86400"
        )),
    }
}

fn sample_rate(text: &str) -> Result<u32, String> {
    let rate = quantity(text, Dimension::Rate)?;
    if rate.fract() == 0.0 && (100.0..=f64::from(MOST_RATE)).contains(&rate) {
        Ok(rate as u32)
    } else {
        Err(format!(
            "{rate} Hz is no sample rate of an analyser; give a whole number from 100 to {MOST_RATE}"
        ))
    }
}
