//! FLAC files. Those in `tests/data` were written by flac 1.4.2 (`flac -8 --force-raw-format`) from samples that integer
//! recursions give, so that every sample is known.

use super::{assert_message, open, open_error, read_all};
use crate::written::file;
use proptest::prelude::*;
use tapjoint_signal::recording::{Format, ReadSettings, Recording};

/// Three channels of 24 bits at 5120 Hz in frames of 576 samples.
const THREE: &[u8] = include_bytes!("../../data/taps.flac");
/// Two channels of 16 bits at 48 kHz, stored as sums and differences.
const STEREO: &[u8] = include_bytes!("../../data/stereo.flac");

/// A tone by the recursion x'' = 32000/2^14 x' - x, from these two values on.
fn tone(mut last: i64, mut next: i64, count: usize) -> Vec<i64> {
    let mut samples = Vec::new();
    for _ in 0..count {
        samples.push(next);
        (last, next) = (next, ((32_000 * next) >> 14) - last);
    }
    samples
}

/// Samples where full scale is 1.
fn of_full_scale(samples: impl IntoIterator<Item = i64>, bits: i32) -> Vec<f64> {
    let full = 2f64.powi(bits - 1);
    samples.into_iter().map(|x| x as f64 / full).collect()
}

/// The samples of [`THREE`]: a tone, a decay, and noise after silence.
fn three() -> Vec<Vec<f64>> {
    let tone = tone(4_000_000, 3_990_000, 3000);
    let decay: Vec<i64> = (tone.iter().enumerate())
        .map(|(n, x)| x >> (n / 250))
        .collect();
    let mut state = 1_u32;
    let noise: Vec<i64> = (0..3000)
        .map(|n| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            if n < 1000 {
                0
            } else {
                i64::from(state >> 8) - 0x80_0000
            }
        })
        .collect();
    [tone, decay, noise]
        .map(|samples| of_full_scale(samples, 24))
        .into()
}

#[test]
fn val_samples_of_the_reference_encoder() {
    assert_eq!(read_all(THREE, "three channels"), three());
    let one: Vec<i64> = tone(12_000, 11_900, 2000)
        .into_iter()
        .enumerate()
        .map(|(n, x)| x >> (n / 300))
        .collect();
    let other = one
        .iter()
        .enumerate()
        .map(|(n, x)| x - (n % 7) as i64)
        .collect();
    let expected: Vec<Vec<f64>> = [one, other].map(|x: Vec<i64>| of_full_scale(x, 16)).into();
    assert_eq!(read_all(STEREO, "two channels"), expected);
}

#[test]
fn prop_reading_may_begin_anywhere() {
    let (_file, recording) = open(THREE);
    let recording = recording.unwrap();
    assert_eq!(recording.format(), Format::Flac { bits: 24 });
    assert_eq!(recording.format().to_string(), "FLAC, 24-bit integer");
    assert_eq!(
        (recording.sample_rate(), recording.frames()),
        (5120.0, 3000)
    );
    assert_eq!(recording.quantum(0), 2f64.powi(-23));
    assert!(
        recording.warnings().is_empty(),
        "{:?}",
        recording.warnings()
    );
    let all = three();
    for range in [0..1, 575..577, 576..600, 1000..2500, 2999..9000, 3000..3001] {
        let read = recording.read_channels(&[2, 0], range.clone()).unwrap();
        let places = range.start as usize..(range.end as usize).min(3000);
        assert_eq!(
            read,
            [&all[2][places.clone()], &all[0][places]],
            "{range:?}"
        );
    }
    let blocks: Vec<f64> = (recording.blocks(&[1], 700))
        .flat_map(|block| block.unwrap().samples.concat())
        .collect();
    assert_eq!(blocks, all[1]);
}

#[test]
fn limit_broken_files_say_what_is_wrong() {
    let changed = |at: usize, byte: u8| {
        let mut bytes = THREE.to_vec();
        bytes[at] = byte;
        bytes
    };
    let middle = THREE.len() / 2;
    // The header ends within, claims another block first or 32 bits; a frame's checksum is wrong; its rate is 0.
    let mut no_rate = THREE.to_vec();
    no_rate[18..20].fill(0);
    no_rate[20] &= 0x0f;
    let cases: [(Vec<u8>, &[&str]); 6] = [
        (THREE[..20].to_vec(), &["within its metadata", "flac -t"]),
        (changed(4, 4), &["do not begin with the stream's"]),
        (changed(21, THREE[21] | 0x80), &["bits a sample", "convert"]),
        (
            changed(middle, !THREE[middle]),
            &["frame at byte", "damaged"],
        ),
        (no_rate, &["sample rate 0 Hz", "allowed"]),
        (THREE[..110].to_vec(), &["holds no samples"]),
    ];
    for (bytes, parts) in cases {
        assert_message(&open_error(bytes), "tested.dat: ", parts);
    }
}

#[test]
fn regress_a_truncated_file_is_read_as_far_as_it_goes() {
    let (_file, recording) = open(&THREE[..THREE.len() - 100]);
    let recording = recording.unwrap();
    assert_eq!(recording.frames(), 5 * 576);
    let text = recording.warnings()[0].to_string();
    assert!(text.contains("2880 of the promised 3000"), "{text}");
    let samples = recording.read(0, 0..u64::MAX).unwrap();
    assert_eq!(samples, three()[0][..2880]);
}

/// [`THREE`] with so many samples promised; 0 says that the writer did not know.
fn promising(samples: u32) -> Vec<u8> {
    let mut bytes = THREE.to_vec();
    bytes[21] &= 0xf0;
    bytes[22..26].copy_from_slice(&samples.to_be_bytes());
    bytes
}

/// Where a frame of [`THREE`] begins: a sync code, two bytes of its form, and its number.
fn frame_at(number: u8) -> usize {
    let mut places = THREE.windows(5);
    let place = places.position(|bytes| bytes[..2] == [0xff, 0xf8] && bytes[4] == number);
    place.expect("a frame")
}

#[test]
fn regress_a_cut_file_of_unknown_length_says_so() {
    let whole = promising(0);
    let (_file, recording) = open(&whole);
    assert!(recording.unwrap().warnings().is_empty());
    let (_file, recording) = open(&whole[..whole.len() - 100]);
    let recording = recording.unwrap();
    assert_eq!(recording.frames(), 5 * 576);
    let text = recording.warnings()[0].to_string();
    assert!(text.contains("ends within a frame, after 2880"), "{text}");
}

#[test]
fn regress_more_samples_than_promised_are_all_read() {
    let (_file, recording) = open(promising(576));
    let recording = recording.unwrap();
    assert_eq!(recording.read(0, 0..u64::MAX).unwrap(), three()[0]);
    let text = recording.warnings()[0].to_string();
    assert!(
        text.contains("promises 576 samples per channel, and 3000"),
        "{text}"
    );
    // A tag after the last promised sample is no frame.
    let tagged = [THREE, b"TAG and text"].concat();
    let (_file, recording) = open(&tagged);
    assert!(recording.unwrap().warnings().is_empty());
}

#[test]
fn regress_a_missing_frame_is_an_error_that_names_the_place() {
    for promised in [0, 3000] {
        let mut bytes = promising(promised);
        bytes.drain(frame_at(2)..frame_at(3));
        let parts = ["frames are missing", "from sample 1152"];
        assert_message(&open_error(bytes), "tested.dat: ", &parts);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn prop_changed_bytes_never_panic(
        changes in prop::collection::vec((0..THREE.len().max(STEREO.len()), any::<u8>()), 1..6),
        end in 0..THREE.len(),
        is_stereo: bool,
    ) {
        let mut bytes = if is_stereo { STEREO } else { THREE }.to_vec();
        for (at, byte) in changes {
            let at = at % bytes.len();
            bytes[at] = byte;
        }
        if end % 3 == 0 {
            bytes.truncate(end);
        }
        let file = file("changed.flac", &bytes);
        if let Ok(recording) = Recording::open(&file.path, &ReadSettings::default()) {
            let samples = recording.read(0, 0..u64::MAX).unwrap();
            prop_assert_eq!(samples.len() as u64, recording.frames());
        }
    }
}
