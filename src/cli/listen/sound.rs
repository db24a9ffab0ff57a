//! Samples of a sound device.

use crate::recording::{PcmLayout, SampleForm};
use anyhow::{Context, anyhow, bail};
use cpal::traits::{DeviceTrait, HostTrait, StreamTrait};
use cpal::{BufferSize, Device, SampleFormat, StreamConfig, SupportedStreamConfigRange};
use std::io::{self, Read};
use std::sync::mpsc::{Receiver, TrySendError, sync_channel};

/// Pieces of sound that wait for the disk. 1000: several seconds of any device.
const MOST_WAITING: usize = 1000;
/// Forms of samples, the best first: those of whole numbers are those of the converter.
const FORMS: [(SampleFormat, SampleForm); 3] = [
    (SampleFormat::I32, SampleForm::S32),
    (SampleFormat::F32, SampleForm::F32),
    (SampleFormat::I16, SampleForm::S16),
];

/// A device that is to be opened.
#[derive(Debug, Clone)]
pub(super) struct SoundDevice {
    /// "default", or a part of the name of the device.
    pub(super) name: String,
    /// Sample rate (Hz); `None` = that of the device.
    pub(super) rate: Option<u32>,
    /// Channels; `None` = those of the device.
    pub(super) channels: Option<u16>,
}

/// What a device gives, as a stream of bytes.
pub(super) struct Sound {
    /// Dropping it ends the sound.
    _stream: cpal::Stream,
    pieces: Receiver<Vec<u8>>,
    piece: Vec<u8>,
    /// Of these bytes so many were given.
    given: usize,
}

impl SoundDevice {
    /// Opens the device. `doubt` is told what it loses on the way.
    ///
    /// # Errors
    /// There is no such device, or it does not give what is asked for.
    pub(super) fn open(
        &self,
        doubt: impl Fn(String) + Clone + Send + 'static,
    ) -> anyhow::Result<(PcmLayout, Sound)> {
        let device = self.found()?;
        let (config, format, form) = self.config(&device)?;
        let layout = PcmLayout::new(config.sample_rate, config.channels, form)?;
        let (sender, pieces) = sync_channel(MOST_WAITING);
        let doubt_device = doubt.clone();
        let mut has_lost = false;
        let stream = device.build_input_stream_raw(
            config,
            format,
            move |data, _| {
                let sent = sender.try_send(data.bytes().to_vec());
                if matches!(sent, Err(TrySendError::Full(_))) && !has_lost {
                    has_lost = true;
                    doubt("the disk is too slow: samples of the sound device are lost".to_owned());
                }
            },
            move |cause| doubt_device(format!("sound device: {cause}")),
            None,
        );
        let stream = stream.map_err(|cause| anyhow!("--sound {}: {cause}", self.name))?;
        let playing = stream.play();
        playing.map_err(|cause| anyhow!("--sound {}: {cause}", self.name))?;
        let sound = Sound {
            _stream: stream,
            pieces,
            piece: Vec::new(),
            given: 0,
        };
        Ok((layout, sound))
    }

    /// Returns the device of this name.
    fn found(&self) -> anyhow::Result<Device> {
        let host = cpal::default_host();
        if self.name == "default" {
            let device = host.default_input_device();
            return device
                .context("--sound default: this machine has no sound device for recording");
        }
        let devices = host.input_devices();
        let devices = devices.map_err(|cause| anyhow!("--sound {}: {cause}", self.name))?;
        let mut names = Vec::new();
        for device in devices {
            let Ok(id) = device.id() else {
                continue;
            };
            let known = device.description().map(|own| own.name().to_owned());
            let name = format!("{id} ({})", known.unwrap_or_default());
            if name.contains(&self.name) {
                return Ok(device);
            }
            names.push(name);
        }
        bail!(
            "--sound {}: no device for recording has this in its name; there are: default, {}",
            self.name,
            names.join(", ")
        )
    }

    /// Returns the best form in which the device gives what is asked for.
    fn config(&self, device: &Device) -> anyhow::Result<(StreamConfig, SampleFormat, SampleForm)> {
        let usual = device.default_input_config();
        let usual = usual.map_err(|cause| anyhow!("--sound {}: {cause}", self.name))?;
        let rate = self.rate.unwrap_or(usual.sample_rate());
        let channels = self.channels.unwrap_or(usual.channels());
        let given = device.supported_input_configs();
        let given = given.map_err(|cause| anyhow!("--sound {}: {cause}", self.name))?;
        let given: Vec<SupportedStreamConfigRange> = given.collect();
        for (format, form) in FORMS {
            let mut fitting = given.iter().filter(|one| {
                let rates = one.min_sample_rate()..=one.max_sample_rate();
                one.channels() == channels && rates.contains(&rate) && one.sample_format() == format
            });
            if fitting.next().is_some() {
                let config = StreamConfig {
                    channels,
                    sample_rate: rate,
                    buffer_size: BufferSize::Default,
                };
                return Ok((config, format, form));
            }
        }
        let mut offers: Vec<String> = given.iter().map(offer).collect();
        offers.dedup();
        bail!(
            "--sound {}: does not give {channels} channels at {rate} Hz; it gives {}; set --channels and --rate",
            self.name,
            offers.join(", ")
        )
    }
}

/// "2 channels at 8000 to 48000 Hz".
fn offer(range: &SupportedStreamConfigRange) -> String {
    let (low, high) = (range.min_sample_rate(), range.max_sample_rate());
    format!("{} channels at {low} to {high} Hz", range.channels())
}

impl Read for Sound {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.given == self.piece.len() {
            // A device that is gone ends the stream.
            (self.given, self.piece) = (0, self.pieces.recv().unwrap_or_default());
        }
        let count = into.len().min(self.piece.len() - self.given);
        into[..count].copy_from_slice(&self.piece[self.given..self.given + count]);
        self.given += count;
        Ok(count)
    }
}
