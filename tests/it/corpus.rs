//! The fuzz targets on their seeds, and on damaged ones: what `scripts/fuzz.sh` does for hours, in seconds.

#[allow(
    clippy::duplicate_mod,
    reason = "the fuzz workspace is built with other flags"
)]
#[path = "../../fuzz/src/lib.rs"]
mod targets;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::process::Command;

/// Damaged copies of each seed; those that an analysis takes are few, for it is slow.
const COPIES: usize = 200;
const COPIES_ANALYSED: usize = 20;

/// Cuts bytes off, changes some, repeats some, or puts numbers in that headers do not expect.
fn damaged(seed: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    const ODD: [&[u8]; 6] = [
        b"\xff\xff\xff\xff",
        b"\0\0\0\0",
        b"-1",
        b"1e308",
        b"nan",
        b"\n",
    ];
    let mut bytes = seed.to_vec();
    for _ in 0..random.random_range(1..4) {
        let at = random.random_range(0..bytes.len().max(1));
        let to = bytes.len().min(at + random.random_range(1..9));
        match random.random_range(0..4) {
            0 => bytes.truncate(at),
            1 => bytes[at..to]
                .iter_mut()
                .for_each(|byte| *byte = random.random()),
            2 => {
                let part = bytes[at..to].to_vec();
                bytes.splice(at..at, part);
            }
            _ => {
                let odd = ODD[random.random_range(0..ODD.len())];
                bytes.splice(at..to, odd.iter().copied());
            }
        }
    }
    bytes
}

/// Words that are printed where the test panics.
struct Shown(String);

impl Drop for Shown {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("{}", self.0);
        }
    }
}

#[test]
fn regress_seeds_of_the_fuzz_targets_whole_and_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds.py");
    let written = Command::new("python3")
        .arg(script)
        .arg(folder.path())
        .status();
    if written.is_err() {
        eprintln!("left out: there is no python3, which writes the seeds");
        return;
    }
    assert!(written.unwrap().success());
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for (target, _) in targets::TARGETS {
        let mut files: Vec<_> = std::fs::read_dir(folder.path().join(target))
            .unwrap()
            .collect();
        files.sort_by_key(|file| file.as_ref().unwrap().path());
        assert!(files.len() > 3, "{target}: {} seeds", files.len());
        let copies = match target {
            "identify" | "chain" => COPIES_ANALYSED,
            _ => COPIES,
        };
        for file in files {
            let path = file.unwrap().path();
            let seed = std::fs::read(&path).unwrap();
            let whole = Shown(path.display().to_string());
            targets::run(target, &seed);
            drop(whole);
            for copy in 0..copies {
                let bytes = damaged(&seed, &mut random);
                let _shown = Shown(format!("{}, copy {copy}: {bytes:?}", path.display()));
                targets::run(target, &bytes);
            }
        }
    }
}
#[test]
fn regress_faults_that_were_found_stay_repaired() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/found");
    let mut count = 0;
    for target in std::fs::read_dir(&folder).unwrap() {
        let target = target.unwrap();
        for file in std::fs::read_dir(target.path()).unwrap() {
            let path = file.unwrap().path();
            let shown = Shown(format!("found: {}", path.display()));
            targets::run(
                target.file_name().to_str().unwrap(),
                &std::fs::read(path).unwrap(),
            );
            drop(shown);
            count += 1;
        }
    }
    assert!(count > 0);
}
