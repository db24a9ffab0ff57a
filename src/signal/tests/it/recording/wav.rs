//! WAV files byte by byte. The samples are primes, so that swapped channels or bytes cannot cancel.

use std::path::Path;

use tapjoint_signal::recording::{
    Channel, Format, ReadSettings, Recording, RecordingWarning, WavFormat, encode_wav, write_wav,
};

use super::{assert_message, file, open, open_error, read_all};

/// Three channels, four frames.
const PRIMES: [i64; 12] = [2, -3, 5, -7, 11, -13, 17, -19, 23, -29, 31, -37];
const CHANNELS: u16 = 3;

/// Parts of a WAV file.
#[derive(Clone)]
pub struct Parts {
    pub tag: u16,
    pub channels: u16,
    pub bits: u16,
    /// Bytes of one sample.
    pub container: u16,
    /// Valid bits: an extensible header is written.
    pub valid: Option<u16>,
    pub data: Vec<u8>,
    /// Chunks between "fmt " and "data".
    pub between: Vec<u8>,
    /// Data size in the header, if not the true one.
    pub size: Option<u32>,
}

impl Parts {
    pub fn new(tag: u16, bits: u16, data: Vec<u8>) -> Self {
        Self {
            tag,
            channels: CHANNELS,
            bits,
            container: bits.div_ceil(8),
            valid: None,
            data,
            between: Vec::new(),
            size: None,
        }
    }

    fn format_chunk(&self) -> Vec<u8> {
        let block = self.channels * self.container;
        let mut chunk = Vec::new();
        chunk.extend(self.valid.map_or(self.tag, |_| 0xfffe).to_le_bytes());
        chunk.extend(self.channels.to_le_bytes());
        chunk.extend(12_800_u32.to_le_bytes());
        chunk.extend((12_800 * u32::from(block)).to_le_bytes());
        chunk.extend(block.to_le_bytes());
        chunk.extend(self.bits.to_le_bytes());
        if let Some(valid) = self.valid {
            chunk.extend(22_u16.to_le_bytes());
            chunk.extend(valid.to_le_bytes());
            chunk.extend(0_u32.to_le_bytes());
            chunk.extend(self.tag.to_le_bytes());
            chunk.extend(b"\x00\x00\x00\x00\x10\x00\x80\x00\x00\xaa\x00\x38\x9b\x71");
        }
        chunk
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut chunks = chunk(b"fmt ", &self.format_chunk());
        chunks.extend(&self.between);
        chunks.extend(b"data");
        let size = self.size.unwrap_or(self.data.len() as u32);
        chunks.extend(size.to_le_bytes());
        chunks.extend(&self.data);
        let mut bytes = b"RIFF".to_vec();
        bytes.extend((4 + chunks.len() as u32).to_le_bytes());
        bytes.extend(b"WAVE");
        bytes.extend(chunks);
        bytes
    }
}

/// A chunk without a pad byte.
fn chunk(name: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let mut chunk = name.to_vec();
    chunk.extend((content.len() as u32).to_le_bytes());
    chunk.extend(content);
    chunk
}

/// The primes as little-endian integers of so many bytes, shifted left.
fn integers(bytes: usize, shift: u32) -> Vec<u8> {
    let sample = |prime: &i64| (prime << shift).to_le_bytes()[..bytes].to_vec();
    PRIMES.iter().flat_map(sample).collect()
}

fn pcm16() -> Parts {
    Parts::new(1, 16, integers(2, 0))
}

/// Channels of the primes in units of `1/full_scale`.
fn expected(full_scale: f64) -> Vec<Vec<f64>> {
    let channel = |at: usize| {
        let samples = PRIMES.iter().skip(at).step_by(usize::from(CHANNELS));
        samples.map(|prime| *prime as f64 / full_scale).collect()
    };
    (0..usize::from(CHANNELS)).map(channel).collect()
}

#[test]
fn prop_every_coding_is_read_exactly() {
    let unsigned: Vec<u8> = PRIMES.iter().map(|p| (p + 128) as u8).collect();
    let floats: Vec<u8> = PRIMES
        .iter()
        .flat_map(|p| (*p as f32).to_le_bytes())
        .collect();
    let doubles: Vec<u8> = PRIMES
        .iter()
        .flat_map(|p| (*p as f64).to_le_bytes())
        .collect();
    let extensible = |mut parts: Parts, valid: u16| {
        parts.valid = Some(valid);
        parts
    };
    let wide = |mut parts: Parts, container: u16| {
        parts.container = container;
        parts
    };
    let cases: Vec<(&str, Parts, f64, Format)> = vec![
        (
            "8 bit",
            Parts::new(1, 8, unsigned),
            128.0,
            Format::WavInteger { bits: 8 },
        ),
        ("16 bit", pcm16(), 32768.0, Format::WavInteger { bits: 16 }),
        (
            "24 bit",
            Parts::new(1, 24, integers(3, 0)),
            8_388_608.0,
            Format::WavInteger { bits: 24 },
        ),
        (
            "32 bit",
            Parts::new(1, 32, integers(4, 0)),
            2_147_483_648.0,
            Format::WavInteger { bits: 32 },
        ),
        (
            "24 bit extensible",
            extensible(Parts::new(1, 24, integers(3, 0)), 24),
            8_388_608.0,
            Format::WavInteger { bits: 24 },
        ),
        (
            "24 in 32 bit extensible",
            extensible(Parts::new(1, 32, integers(4, 8)), 24),
            8_388_608.0,
            Format::WavInteger { bits: 24 },
        ),
        (
            "24 in 32 bit plain",
            wide(Parts::new(1, 24, integers(4, 8)), 4),
            8_388_608.0,
            Format::WavInteger { bits: 24 },
        ),
        (
            "20 in 24 bit",
            Parts::new(1, 20, integers(3, 4)),
            524_288.0,
            Format::WavInteger { bits: 20 },
        ),
        (
            "extensible with 0 valid bits",
            extensible(Parts::new(1, 16, integers(2, 0)), 0),
            32768.0,
            Format::WavInteger { bits: 16 },
        ),
        (
            "32-bit float",
            Parts::new(3, 32, floats.clone()),
            1.0,
            Format::WavFloat { bits: 32 },
        ),
        (
            "32-bit float extensible",
            extensible(Parts::new(3, 32, floats), 32),
            1.0,
            Format::WavFloat { bits: 32 },
        ),
        (
            "64-bit float",
            Parts::new(3, 64, doubles.clone()),
            1.0,
            Format::WavFloat { bits: 64 },
        ),
        (
            "64-bit float extensible",
            extensible(Parts::new(3, 64, doubles), 64),
            1.0,
            Format::WavFloat { bits: 64 },
        ),
    ];
    for (name, parts, full_scale, format) in cases {
        let bytes = parts.bytes();
        // Powers of two divide exactly, so equality is exact.
        assert_eq!(read_all(&bytes, name), expected(full_scale), "{name}");
        let (_file, recording) = open(&bytes);
        let recording = recording.unwrap();
        assert_eq!(recording.format(), format, "{name}");
        assert_eq!(recording.sample_rate(), 12_800.0, "{name}");
        assert_eq!(recording.frames(), 4, "{name}");
        let doubts: Vec<_> = recording.warnings();
        let doubts: Vec<_> = doubts.iter().filter(|w| w.code() != "offset").collect();
        assert!(doubts.is_empty(), "{name}: {doubts:?}");
    }
}

/// Returns `true` where a warning of this code contains `words`.
fn has(warnings: &[RecordingWarning], code: &str, words: &str) -> bool {
    let mut all = warnings.iter();
    all.any(|warning| warning.code() == code && warning.to_string().contains(words))
}

#[test]
fn prop_integers_at_the_low_end_of_their_container_are_read_with_a_warning() {
    let mut parts = Parts::new(1, 32, integers(4, 0));
    parts.valid = Some(24);
    assert_eq!(
        read_all(parts.bytes(), "right-aligned"),
        expected(8_388_608.0)
    );
    let (_file, recording) = open(parts.bytes());
    let warnings = recording.unwrap().warnings();
    let expected = "24-bit samples sit at the low end of their 32-bit containers";
    assert!(has(&warnings, "right-aligned", expected), "{warnings:?}");
}

#[test]
fn prop_odd_chunks_are_skipped_with_and_without_their_pad_byte() {
    for (name, pad) in [("padded", &b"\0"[..]), ("unpadded", b"")] {
        let mut parts = pcm16();
        parts.between = chunk(b"LIST", b"odd");
        parts.between.extend(pad);
        assert_eq!(read_all(parts.bytes(), name), expected(32768.0), "{name}");
    }
}

#[test]
fn prop_chunks_before_and_behind_are_no_samples() {
    let mut bytes = pcm16().bytes();
    bytes.extend(chunk(b"LIST", b"INFOsoftware"));
    assert_eq!(read_all(&bytes, "LIST behind"), expected(32768.0));
}

/// RF64 and BW64: the sizes are in "ds64", the 32-bit ones are 0xFFFFFFFF.
fn rf64(magic: &[u8; 4], size: u64) -> Vec<u8> {
    let parts = pcm16();
    let mut bytes = magic.to_vec();
    bytes.extend(u32::MAX.to_le_bytes());
    bytes.extend(b"WAVE");
    let mut sizes = Vec::new();
    sizes.extend(200_u64.to_le_bytes());
    sizes.extend(size.to_le_bytes());
    sizes.extend(4_u64.to_le_bytes());
    sizes.extend(0_u32.to_le_bytes());
    bytes.extend(chunk(b"ds64", &sizes));
    bytes.extend(chunk(b"fmt ", &parts.format_chunk()));
    bytes.extend(b"data");
    bytes.extend(u32::MAX.to_le_bytes());
    bytes.extend(&parts.data);
    // Behind the samples: read only by a reader that misses the 64-bit size.
    bytes.extend(chunk(b"LIST", b"abcd"));
    bytes
}

#[test]
fn prop_sixty_four_bit_sizes_are_read() {
    for magic in [b"RF64", b"BW64"] {
        let bytes = rf64(magic, 24);
        assert_eq!(read_all(&bytes, "RF64"), expected(32768.0));
        let (_file, recording) = open(&bytes);
        assert_eq!(recording.unwrap().frames(), 4);
    }
}

#[test]
fn prop_a_size_left_open_by_a_crash_is_read_to_the_end_with_a_warning() {
    for size in [0, u32::MAX] {
        let mut parts = pcm16();
        parts.size = Some(size);
        // Half a frame at the end: what was being written when the recorder stopped.
        parts.data.extend(b"\x01\x02\x03");
        assert_eq!(read_all(parts.bytes(), "crashed"), expected(32768.0));
        let (_file, recording) = open(parts.bytes());
        let warnings = recording.unwrap().warnings();
        let expected = format!("(data size {size}); the recorder probably stopped");
        assert!(has(&warnings, "unknown-length", &expected), "{warnings:?}");
        let expected = "read to the end of the file, 4 samples per channel";
        assert!(has(&warnings, "unknown-length", expected), "{warnings:?}");
    }
}

#[test]
fn limit_a_truncated_file_is_read_as_far_as_it_goes_with_a_warning() {
    let bytes = pcm16().bytes();
    // Two bytes of the third frame are left.
    let cut = &bytes[..bytes.len() - 10];
    let whole = expected(32768.0);
    let first_two: Vec<Vec<f64>> = whole.iter().map(|c| c[..2].to_vec()).collect();
    assert_eq!(read_all(cut, "truncated"), first_two);
    let (_file, recording) = open(cut);
    let warnings = recording.unwrap().warnings();
    let expected = "the file is truncated: 2 of the promised 4 samples per channel";
    assert!(has(&warnings, "truncated", expected), "{warnings:?}");
}

#[test]
fn limit_a_promise_of_terabytes_costs_nothing() {
    let bytes = rf64(b"RF64", 1 << 45);
    let (_file, recording) = open(&bytes);
    let recording = recording.unwrap();
    // The chunk behind is 12 bytes and reads as two frames more: the promised size would hold them.
    assert_eq!(recording.frames(), 6);
    assert_eq!(recording.warnings()[0].code(), "truncated");
}

#[test]
fn limit_what_cannot_be_read_says_why() {
    let mut a_law = Parts::new(6, 8, vec![0; 12]);
    assert_message(
        &open_error(a_law.bytes()),
        "tested.dat: ",
        &["A-law", "0x0006", "8 bits", "PCM or float"],
    );
    a_law.tag = 2;
    assert_message(
        &open_error(a_law.bytes()),
        "tested.dat: ",
        &["ADPCM", "0x0002"],
    );
    a_law.valid = Some(8);
    assert_message(&open_error(a_law.bytes()), "tested.dat: ", &["ADPCM"]);
    let mut none = pcm16();
    none.channels = 0;
    assert_message(&open_error(none.bytes()), "tested.dat: ", &["channels 0"]);
    let mut many = pcm16();
    many.channels = 5000;
    many.data = vec![0; 10_000];
    assert_message(&open_error(many.bytes()), "tested.dat: ", &["5000", "4096"]);
    let mut half = pcm16();
    half.container = 1;
    assert_message(
        &open_error(half.bytes()),
        "tested.dat: ",
        &["bytes per frame 3"],
    );
    let mut empty = pcm16();
    empty.data.clear();
    assert_message(&open_error(empty.bytes()), "tested.dat: ", &["no samples"]);
    let mut closed = empty.bytes();
    closed.extend(chunk(b"LIST", b"INFO"));
    assert_message(&open_error(&closed), "tested.dat: ", &["no samples"]);
    let header = pcm16().bytes();
    assert_message(
        &open_error(&header[..30]),
        "tested.dat: ",
        &["bytes in the \"fmt \" chunk 10"],
    );
    assert_message(
        &open_error(&header[..14]),
        "tested.dat: ",
        &["no \"fmt \" chunk"],
    );
    assert_message(
        &open_error(&header[..36]),
        "tested.dat: ",
        &["no \"data\" chunk"],
    );
    assert_message(&open_error(b""), "tested.dat: ", &["empty", "0 bytes"]);
}

#[test]
fn limit_a_sample_that_is_no_number_is_named() {
    let mut data: Vec<u8> = PRIMES
        .iter()
        .flat_map(|p| (*p as f32).to_le_bytes())
        .collect();
    // Frame 2, channel 2: sample 7 of the file.
    data[28..32].copy_from_slice(&f32::NAN.to_le_bytes());
    let message = open_error(Parts::new(3, 32, data).bytes());
    assert_message(
        &message,
        "tested.dat: channel 2, sample 2 ",
        &["NaN", "finite"],
    );
}

#[test]
fn limit_other_formats_are_named() {
    let cases: [(&str, &[u8]); 6] = [
        ("HDF5", b"\x89HDF\r\n\x1a\n\0\0\0\0"),
        ("MATLAB 7.3", b"MATLAB 7.3 MAT-file, Platform: PCWIN64"),
        ("MP3", b"ID3\x04\0\0\0\0\0\0"),
        ("W64", b"riff\x2e\x91\xcf\x11\xa5\xd6\x28\xdb"),
        ("Excel", b"PK\x03\x04\x14\0\x06\0"),
        ("RIFF file without WAVE", b"RIFF\x10\0\0\0AVI LIST"),
    ];
    for (name, bytes) in cases {
        let message = open_error(bytes);
        assert_message(
            &message,
            "tested.dat: ",
            &[
                name,
                "not read by this version",
                "export as WAV, CSV or UFF58",
            ],
        );
    }
    let message = open_error(b"\x01\x02\x03\x04");
    assert_message(&message, "tested.dat: neither", &["01 02 03 04"]);
}

#[test]
fn limit_a_missing_file_is_named() {
    let error = Recording::open(Path::new("nowhere/tap.wav"), &ReadSettings::default())
        .expect_err("there is no such file");
    assert_message(
        &error.to_string(),
        "nowhere/tap.wav: cannot be read",
        &["check the path"],
    );
}

/// A long 24-bit file, of several read blocks.
fn long_file() -> (super::TestFile, Vec<Vec<f64>>) {
    // Primes as strides, so that no two samples or channels agree by accident.
    let channel = |stride: i64| {
        let sample = |at: i64| (at * stride % 16_000_057 - 8_000_009) as f64 / 8_388_608.0;
        (0..150_000).map(sample).collect()
    };
    let channels: Vec<Vec<f64>> = [7919, 104_729, 1_299_709].map(channel).to_vec();
    let file = file("long.wav", b"");
    let clipped =
        write_wav(&file.path, 51_200, &channels, WavFormat::Pcm24).expect("a written file");
    assert_eq!(clipped, 0);
    (file, channels)
}

#[test]
fn prop_a_range_is_a_slice_of_all() {
    let (file, channels) = long_file();
    let recording = Recording::open(&file.path, &ReadSettings::default()).unwrap();
    assert_eq!(recording.frames(), 150_000);
    let frames = 150_000_usize;
    for (start, end) in [
        (0, 1),
        (1, 2),
        (58_253, 58_255),
        (99_991, 149_999),
        (0, frames),
    ] {
        let read = recording.read(1, start as u64..end as u64).unwrap();
        assert_eq!(read, channels[1][start..end], "{start}..{end}");
        let order = recording
            .read_channels(&[2, 0], start as u64..end as u64)
            .unwrap();
        assert_eq!(order[0], channels[2][start..end], "{start}..{end}");
        assert_eq!(order[1], channels[0][start..end], "{start}..{end}");
    }
    // Cut to the recording, turned round, beyond it.
    assert_eq!(recording.read(0, 149_998..u64::MAX).unwrap().len(), 2);
    #[allow(clippy::reversed_empty_ranges)]
    let reversed = recording.read(0, 5..2).unwrap();
    assert!(reversed.is_empty());
    assert!(recording.read(0, 200_000..300_000).unwrap().is_empty());
}

#[test]
fn prop_blocks_join_to_the_whole() {
    let (file, channels) = long_file();
    let recording = Recording::open(&file.path, &ReadSettings::default()).unwrap();
    for block in [997, 65_536, 1_000_000] {
        let mut joined = vec![Vec::<f64>::new(); 2];
        for part in recording.blocks(&[2, 1], block) {
            let part = part.unwrap();
            assert_eq!(part.start, joined[0].len() as u64, "block of {block}");
            joined[0].extend(&part.samples[0]);
            joined[1].extend(&part.samples[1]);
        }
        assert_eq!(joined[0], channels[2], "block of {block}");
        assert_eq!(joined[1], channels[1], "block of {block}");
    }
}

#[test]
fn limit_a_file_that_shrank_is_an_error_and_no_panic() {
    // Longer than what is kept in memory.
    let file = file("shrunk.wav", b"");
    write_wav(
        &file.path,
        51_200,
        &[vec![0.5; 1_100_000]],
        WavFormat::Pcm24,
    )
    .unwrap();
    let recording = Recording::open(&file.path, &ReadSettings::default()).unwrap();
    let shortened = std::fs::OpenOptions::new()
        .write(true)
        .open(&file.path)
        .unwrap();
    shortened.set_len(90_000).unwrap();
    let error = recording
        .read(0, 0..150_000)
        .map(drop)
        .expect_err("samples are gone");
    assert!(error.to_string().contains("ended before sample"), "{error}");
    let mut blocks = recording.blocks(&[0], 1000);
    assert_eq!(blocks.by_ref().filter(Result::is_err).count(), 1);
}

#[test]
fn prop_what_is_written_is_read() {
    let channels: Vec<Vec<f64>> = vec![vec![0.5, -1.0, 0.25], vec![-0.125, 0.0, 0.75]];
    for (format, bits) in [(WavFormat::Pcm16, 16), (WavFormat::Pcm24, 24)] {
        let file = file("written.wav", b"");
        assert_eq!(write_wav(&file.path, 48_000, &channels, format).unwrap(), 0);
        let recording = Recording::open(&file.path, &ReadSettings::default()).unwrap();
        assert_eq!(recording.format(), Format::WavInteger { bits });
        // The samples are exact in both formats.
        assert_eq!(
            recording.read_channels(&[0, 1], 0..9).unwrap(),
            channels,
            "{format:?}"
        );
    }
    let file = file("float.wav", b"");
    let beyond = vec![vec![1234.5, -0.5]];
    assert_eq!(
        write_wav(&file.path, 48_000, &beyond, WavFormat::Float32).unwrap(),
        0
    );
    let recording = Recording::open(&file.path, &ReadSettings::default()).unwrap();
    assert_eq!(recording.read_channels(&[0], 0..9).unwrap(), beyond);
}

#[test]
fn prop_clipped_samples_are_counted_and_stay_at_full_scale() {
    let file = file("clipped.wav", b"");
    let channels = vec![vec![1.0, 0.999, -1.0, -1.5, 2.0]];
    // 1.0 is one step above the largest 16-bit integer.
    assert_eq!(
        write_wav(&file.path, 1000, &channels, WavFormat::Pcm16).unwrap(),
        3
    );
    let recording = Recording::open(&file.path, &ReadSettings::default()).unwrap();
    let top = 32767.0 / 32768.0;
    let read = recording.read(0, 0..5).unwrap();
    assert_eq!((read[0], read[2], read[3], read[4]), (top, -1.0, -1.0, top));
}

#[test]
fn prop_odd_data_is_padded_to_even_length() {
    let mut cursor = std::io::Cursor::new(Vec::new());
    let samples = vec![vec![0.5, 0.25, 0.125]];
    encode_wav("memory", &mut cursor, 1000, &samples, WavFormat::Pcm24).unwrap();
    let bytes = cursor.into_inner();
    assert_eq!(bytes.len() % 2, 0, "{} bytes", bytes.len());
    let size = u32::from_le_bytes(bytes[4..8].try_into().unwrap());
    assert_eq!(size as usize, bytes.len() - 8);
    assert_eq!(read_all(&bytes, "padded"), samples);
}

#[test]
fn limit_what_cannot_be_written_says_why() {
    let file = file("bad.wav", b"kept");
    let write = |channels: &[Vec<f64>], rate: u32| {
        write_wav(&file.path, rate, channels, WavFormat::Pcm16)
            .expect_err("cannot be written")
            .to_string()
    };
    assert!(write(&[], 1000).contains("no samples"));
    assert!(write(&[vec![0.0], vec![0.0, 0.0]], 1000).contains("channel 2 has 2 samples"));
    assert!(write(&[vec![f64::NAN]], 1000).contains("NaN"));
    assert!(write(&[vec![0.0]], 0).contains("sample rate 0"));
    let kept = std::fs::read(&file.path).unwrap();
    assert_eq!(kept, b"kept", "a failed write must leave the old file");
    let nowhere = file.path.join("below-a-file.wav");
    let error = write_wav(&nowhere, 1000, &[vec![0.0]], WavFormat::Pcm16)
        .expect_err("the folder is a file")
        .to_string();
    assert!(error.contains("cannot be written"), "{error}");
}

#[test]
fn prop_memory_is_checked_like_a_file() {
    let channel = |samples: &[f64]| Channel {
        name: Some("force".to_owned()),
        unit: Some("N".to_owned()),
        samples: samples.to_vec(),
    };
    let refuse = |rate: f64, channels: Vec<Channel>| {
        Recording::from_samples("virtual", rate, channels)
            .expect_err("must be refused")
            .to_string()
    };
    assert!(refuse(0.0, vec![channel(&[1.0])]).starts_with("virtual: sample rate 0"));
    assert!(refuse(f64::NAN, vec![channel(&[1.0])]).contains("NaN"));
    assert!(refuse(10.0, vec![]).contains("no samples"));
    assert!(refuse(10.0, vec![channel(&[])]).contains("no samples"));
    assert!(refuse(10.0, vec![channel(&[1.0]), channel(&[])]).contains("channel 2 has 0"));
    let message = refuse(10.0, vec![channel(&[1.0, f64::INFINITY])]);
    assert!(message.contains("sample 1 (0.1 s) is inf"), "{message}");

    let channels = vec![channel(&[2.0, 3.0, 5.0]), channel(&[7.0, 11.0, 13.0])];
    let recording = Recording::from_samples("virtual", 10.0, channels).unwrap();
    assert_eq!(recording.duration(), 0.3);
    assert_eq!(recording.read(1, 1..9).unwrap(), [11.0, 13.0]);
    let blocks: Vec<_> = recording.blocks(&[1], 2).map(Result::unwrap).collect();
    assert_eq!(blocks.len(), 2);
    assert_eq!(blocks[1].start, 2);
    assert_eq!(blocks[1].samples, vec![vec![13.0]]);
}

#[test]
fn prop_a_given_rate_that_differs_is_ignored_with_a_warning() {
    let file = file("rate.wav", pcm16().bytes());
    let settings = |rate| ReadSettings {
        sample_rate: Some(rate),
        ..ReadSettings::default()
    };
    let recording = Recording::open(&file.path, &settings(5120.0)).unwrap();
    assert_eq!(recording.sample_rate(), 12_800.0);
    let expected = "given (5120 Hz) differs from the file's own (12800 Hz)";
    let warnings = recording.warnings();
    assert!(has(&warnings, "sample-rate-ignored", expected));
    let same = Recording::open(&file.path, &settings(12_800.0)).unwrap();
    let codes: Vec<_> = same.warnings().iter().map(RecordingWarning::code).collect();
    assert!(!codes.contains(&"sample-rate-ignored"), "{codes:?}");
    let error = Recording::open(&file.path, &settings(-1.0)).expect_err("no rate");
    assert!(error.to_string().contains("sample rate -1 Hz"), "{error}");
}

#[test]
fn prop_a_scale_multiplies_samples_and_health() {
    let (_file, recording) = open(pcm16().bytes());
    let recording = recording.unwrap();
    let before = recording.channels()[1].health.clone();
    let mut scaled = recording;
    scaled.set_scale(1, -65_536.0).unwrap();
    // Channel 2: -3, 11, -19, 31 over 32768, times -65536.
    assert_eq!(scaled.read(1, 0..9).unwrap(), [6.0, -22.0, 38.0, -62.0]);
    let block = scaled.blocks(&[1], 100).next().unwrap().unwrap();
    assert_eq!(block.samples[0], [6.0, -22.0, 38.0, -62.0]);
    let health = &scaled.channels()[1].health;
    assert_eq!(health.peak, 62.0);
    assert_eq!((health.minimum, health.maximum), (-62.0, 38.0));
    assert_eq!(health.mean, before.mean * -65_536.0);
    for bad in [0.0, f64::NAN, f64::INFINITY] {
        let error = scaled.set_scale(1, bad).expect_err("no scale");
        assert!(error.to_string().contains("channel 2: scale"), "{error}");
    }
    assert!(scaled.set_scale(3, 1.0).is_err());
    // Set again it replaces, and does not multiply.
    let mut again = scaled;
    again.set_scale(1, 32_768.0).unwrap();
    assert_eq!(again.read(1, 0..1).unwrap(), [-3.0]);
    assert_eq!(again.channels()[1].health.peak, 31.0);
}

#[test]
fn limit_unknown_channels_are_refused_with_what_exists() {
    let (_file, recording) = open(pcm16().bytes());
    let recording = recording.unwrap();
    assert_eq!(recording.channel_by_number(3).unwrap(), 2);
    assert_eq!(recording.channel_index("2").unwrap(), 1);
    for (number, text) in [(0, "no channel 0"), (4, "no channel 4")] {
        let error = recording
            .channel_by_number(number)
            .expect_err("unknown")
            .to_string();
        assert!(error.contains(text), "{error}");
        assert!(
            error.ends_with("there are: 1, 2, 3; name one of these"),
            "{error}"
        );
    }
    assert!(recording.read(3, 0..1).is_err());
    assert!(recording.read(usize::MAX, 0..1).is_err());
    let mut blocks = recording.blocks(&[7], 10);
    assert!(blocks.next().unwrap().is_err());
    assert!(blocks.next().is_none());
}
