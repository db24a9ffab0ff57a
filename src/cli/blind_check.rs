//! `tapjoint blind-check`: the success rate of the diagnosis on tests with an unknown effect.

use super::Outcome;
use super::input::{TestFile, read_test};
use super::output::failed;
use super::overwrite::{CHECKSUMS, Expanded};
use super::publication::{OutputFolder, files_made_in};
use super::terminal::Terminal;
use anyhow::{Context, bail};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use tapjoint::description::TestDescription;
use tapjoint::gap::{Diagnosis, GapSettings};
use tapjoint::pipeline::{IdentifySettings, diagnose_test, run_test};
use tapjoint::recording::{WavFormat, encode_wav};
use tapjoint::report::blind_check::{render_blind_check, score_json};
use tapjoint::study::blind_check::{
    Answer, Campaign, Case, Conduct, DrawnTest, Extent, RecordedTest, Truth, TruthFile, commitment,
    parse_truths, render_rows, rows, score,
};

/// Measure how often the diagnosis is right, on virtual tests.
///
/// The diagnosis does not know the effect of a test. Each test has five recordings: two sensors, three tap positions, one moved sensor, two levels. The
/// SHA-256 of the true effects is printed before the diagnosis begins. The diagnosis gets recordings and
/// descriptions only. With --folder, existing tests are diagnosed and scored. With --compare, `tapjoint compare` is measured
/// instead, on pairs of tests whose change is withheld.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint blind-check --cases 100 --seed 7\n  tapjoint blind-check --folder tests --truth truth.json\n  tapjoint blind-check --compare --cases 40 --seed 7"
)]
pub(super) struct BlindCheckArguments {
    /// Compare pairs of tests instead of diagnosing tests. Each pair has one recording before and one after a change.
    /// Nothing changes in a quarter of the pairs. The others are dealt out evenly: joint, lost mass, added mass, crack, length,
    /// modulus, moved sensor, axial load, two changes, a change outside of the causes. The descriptions are wrong by their
    /// tolerances and, in four of five pairs, by one effect that both tests share. From test to test the natural frequencies scatter, by 0.01 to
    /// 0.4 %; half of the comparisons, at random, are told how much
    #[arg(long, conflicts_with_all = ["one_recording", "drift"])]
    pub(super) compare: bool,
    /// Number of virtual tests, or of pairs. Of 19 tests, 10 have one effect, 5 none, 2 two effects, and 2 an effect
    /// outside the catalogue
    #[arg(
        long,
        value_name = "N",
        default_value_t = 190,
        value_parser = RangedU64ValueParser::<usize>::new().range(1..=1_000_000),
        conflicts_with = "folder"
    )]
    pub(super) cases: usize,
    /// Use one recording with one sensor and five modes instead of five recordings
    #[arg(long, conflicts_with = "folder")]
    one_recording: bool,
    /// Ratio of the responses' rms to the rms of their noise (dB)
    #[arg(
        long,
        value_name = "DB",
        default_value_t = 60.0,
        conflicts_with = "folder"
    )]
    noise: f64,
    /// Largest standard deviation of the joint's relative drift between recordings
    #[arg(
        long,
        value_name = "S",
        default_value_t = 0.01,
        conflicts_with = "folder"
    )]
    drift: f64,
    /// Folder of existing tests, each a folder with test.toml and recordings. With --compare, each is a folder of a pair, with
    /// before/test.toml and after/test.toml
    #[arg(long, value_name = "DIR", requires = "truth")]
    pub(super) folder: Option<PathBuf>,
    /// True effects of the existing tests, as --keep writes them. JSON list of {"name", "effects", "params"},
    /// with "detectable" and "refutable" (true or false) if known. "within_tolerance": true marks a common factor on
    /// all frequencies that the description's tolerances cover, and that is no effect then. Parameters of two effects stand in
    /// braces: {"sensor-mass": {"mass": 0.008}, "length": {"relative": 0.01}}. With --compare a list of {"name", "changes":
    /// [{"cause", "item", "parameters"}]}, with "visible" (true or false) if known. "repeatability" (1, such as 0.001) is told
    /// to the comparison
    #[arg(long, value_name = "FILE", requires = "folder")]
    pub(super) truth: Option<PathBuf>,
    /// Keep the drawn tests in this folder, with recordings, descriptions and truth.json. The folder must
    /// be new or hold tests that were kept earlier
    #[arg(long, value_name = "DIR", conflicts_with = "folder")]
    pub(super) keep: Option<PathBuf>,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "blind-check")]
    pub(super) out: PathBuf,
}

/// Names of the results.
const RESULTS: [&str; 8] = [
    "score.json",
    "cases.csv",
    "truth.json",
    "confusion.png",
    "confusion.svg",
    "reliability.png",
    "reliability.svg",
    CHECKSUMS,
];

/// Pictures that a check of comparisons does not have.
pub(super) const RELIABILITY: [&str; 2] = ["reliability.png", "reliability.svg"];

impl BlindCheckArguments {
    /// Returns the results, and every file in an earlier folder of kept tests.
    pub(super) fn expanded(&self) -> Vec<Expanded> {
        let results = RESULTS.iter();
        let results = results.filter(|name| !(self.compare && RELIABILITY.contains(name)));
        let results = results.map(|name| self.out.join(name)).collect();
        let kept = self.keep.iter().flat_map(|folder| files_made_in(folder));
        let kept = kept.chain(self.keep.iter().map(|folder| folder.join("truth.json")));
        let kept = kept.collect::<BTreeSet<_>>().into_iter().collect();
        vec![("out", results), ("keep", kept)]
    }

    fn campaign(&self, seed: u64) -> anyhow::Result<Campaign> {
        if !(self.drift >= 0.0 && self.drift <= 0.2) {
            bail!(
                "--drift {}: give a relative value from 0 to 0.2",
                self.drift
            );
        }
        let noise_db = self.noise_db()?;
        // The proportions of 300, 150, 60 and 60.
        let [nulls, outside, pairs] = [5, 2, 2].map(|part| (self.cases * part + 9) / 19);
        Ok(Campaign {
            singles: self.cases.saturating_sub(nulls + outside + pairs),
            nulls,
            outside,
            pairs,
            extent: if self.one_recording {
                Extent::OneRecording
            } else {
                Extent::FiveRecordings
            },
            noise_db,
            drift: self.drift,
            seed,
        })
    }

    /// Returns the noise below the responses (dB).
    ///
    /// # Errors
    /// It is out of range.
    pub(super) fn noise_db(&self) -> anyhow::Result<f64> {
        if !(self.noise >= 0.0 && self.noise <= 200.0) {
            bail!("--noise {}: give decibels from 0 to 200", self.noise);
        }
        Ok(self.noise)
    }
}

pub(super) fn run(
    arguments: &BlindCheckArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let output = OutputFolder::prepare(&arguments.out, terminal.files())?;
    let (cases, conduct) = match (&arguments.folder, &arguments.truth) {
        (Some(folder), Some(truth)) => elsewhere(folder, truth, &terminal)?,
        _ => drawn(
            &arguments.campaign(seed)?,
            arguments.keep.as_deref(),
            &terminal,
        )?,
    };
    let scores = score(&cases);
    let conduct = conduct.mutated(&cases, seed);
    terminal.say(&render_rows(&rows(&scores, conduct.extent)))?;
    let [shuffled, always_scale] = [conduct.shuffled, conduct.always_scale]
        .map(|share| share.map_or("-".to_owned(), |p| format!("{:.0} %", 100.0 * p)));
    terminal.say(&format!(
        "\nFirst group right by answers dealt out to other tests: {shuffled}; by always\n\
         answering one common factor: {always_scale}. Files renamed: {}.",
        match conduct.renamed {
            0 => "in no test".to_owned(),
            tests => format!("same answers ({tests} tests)"),
        }
    ))?;
    for file in render_blind_check(&cases, &scores, &conduct)? {
        output.add(&file.name, &file.bytes)?;
    }
    let folder = output.publish()?;
    terminal.say(&format!("Results: {}", folder.display()))?;
    terminal.write_json(&score_json(&scores, &conduct))?;
    Ok(Outcome::Answered)
}

/// Draws tests, seals their true effects, records and diagnoses them.
fn drawn(
    campaign: &Campaign,
    keep: Option<&Path>,
    terminal: &Terminal,
) -> anyhow::Result<(Vec<Case>, Conduct)> {
    let kept = keep.map(|name| OutputFolder::prepare_own(name, terminal.files()));
    let kept = kept.transpose()?;
    let tests = (0..campaign.len())
        .into_par_iter()
        .map(|index| campaign.draw(index))
        .collect::<Result<Vec<_>, _>>()?;
    // The detection limits are part of the truth, and take a while.
    let done = AtomicUsize::new(0);
    let truths = tests
        .par_iter()
        .map(|test| {
            let truth = test.with_limits();
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            terminal.count("tests drawn", done, tests.len());
            truth
        })
        .collect::<Result<Vec<Truth>, _>>()?;
    let sealed = tapjoint::report::blind_check::truths_json(&truths)?;
    let commitment = commitment(&sealed);
    terminal.seal(&format!(
        "{} tests drawn; SHA-256 of truth.json: {commitment}",
        tests.len()
    ))?;
    let done = AtomicUsize::new(0);
    let diagnosed = tests
        .par_iter()
        .zip(&truths)
        .map(|(test, truth)| {
            let recorded = test.record()?;
            let name = &test.truth.name;
            let case = match kept.as_ref().zip(keep) {
                Some((kept, shown)) => {
                    diagnose_recorded(&recorded, truth, &kept.place_of(name), &shown.join(name))?
                }
                None => diagnose_in_passing(&recorded, truth)?,
            };
            terminal.count(
                "tests diagnosed",
                done.fetch_add(1, Ordering::Relaxed) + 1,
                tests.len(),
            );
            Ok(case)
        })
        .collect::<anyhow::Result<Vec<Case>>>()?;
    let conduct = Conduct {
        extent: Some(campaign.extent),
        commitment: Some(commitment),
        renamed: check_names(&tests, &diagnosed)?,
        ..Conduct::default()
    };
    if let Some(kept) = kept {
        kept.add("truth.json", sealed.as_bytes())?;
        kept.publish()?;
    }
    Ok((diagnosed, conduct))
}

/// Number of tests that are diagnosed again under other names.
pub(super) const AGAIN: usize = 3;

/// Diagnoses the first tests again under other names: the answers must not change. Returns their number.
fn check_names(tests: &[DrawnTest], cases: &[Case]) -> anyhow::Result<usize> {
    for (test, (_, answer)) in tests.iter().zip(cases).take(AGAIN) {
        let mut recorded = test.record()?;
        rename_recordings(&mut recorded, test.seed, &test.truth.name);
        let (_, again) = diagnose_in_passing(&recorded, &test.truth)?;
        if again != *answer {
            bail!(
                "the answer to {} depends on the names of its files",
                test.truth.name
            );
        }
    }
    Ok(tests.len().min(AGAIN))
}

/// Gives a test and its recordings other names; `name` is that of the test.
pub(super) fn rename_recordings(recorded: &mut RecordedTest, seed: u64, name: &str) {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let mut numbers: Vec<usize> = (10..10 + recorded.recordings.len()).collect();
    numbers.shuffle(&mut random);
    for (recording, number) in recorded.recordings.iter_mut().zip(numbers) {
        let name = format!("{:08x}{number}.wav", random.next_u32());
        recorded.description = recorded.description.replace(&recording.file, &name);
        recording.file = name;
    }
    recorded.description = recorded.description.replace(name, "another");
}

fn diagnose_in_passing(recorded: &RecordedTest, truth: &Truth) -> anyhow::Result<Case> {
    let folder = tempfile::tempdir().context("no temporary folder can be made")?;
    diagnose_recorded(recorded, truth, folder.path(), folder.path())
}

/// Writes a test into a folder of its own, and diagnoses it from there. Errors name the folder `shown`.
fn diagnose_recorded(
    recorded: &RecordedTest,
    truth: &Truth,
    folder: &Path,
    shown: &Path,
) -> anyhow::Result<Case> {
    write_test(recorded, folder, shown)?;
    let test = TestDescription::parse(&recorded.description, "test.toml")?;
    Ok(case_of(&test, folder, truth))
}

/// Writes a test into a folder; `shown` is its name in messages.
pub(super) fn write_test(
    recorded: &RecordedTest,
    folder: &Path,
    shown: &Path,
) -> anyhow::Result<()> {
    fs::create_dir_all(folder).map_err(|cause| failed(shown, &cause))?;
    write_file(folder, shown, "test.toml", recorded.description.as_bytes())?;
    for recording in &recorded.recordings {
        let mut bytes = Vec::new();
        encode_wav(
            &recording.file,
            Cursor::new(&mut bytes),
            recording.sample_rate,
            &recording.channels,
            WavFormat::Pcm24,
        )?;
        write_file(folder, shown, &recording.file, &bytes)?;
    }
    Ok(())
}

/// Writes a file of a test; `shown` is its folder in messages.
fn write_file(folder: &Path, shown: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    fs::write(folder.join(name), bytes).map_err(|cause| failed(&shown.join(name), &cause))
}

/// Diagnoses a test. A test that cannot be analysed has no answer, which is counted separately.
fn case_of(test: &TestDescription, folder: &Path, truth: &Truth) -> Case {
    let answer = diagnosis_of(test, folder).map_or_else(|_| Answer::default(), |d| Answer::of(&d));
    (truth.clone(), answer)
}

fn diagnosis_of(test: &TestDescription, folder: &Path) -> anyhow::Result<Diagnosis> {
    let settings = IdentifySettings::unperturbed();
    let analysis = run_test(test, (folder, "test.toml"), &settings)?;
    Ok(diagnose_test(test, &analysis, &GapSettings::default())?)
}

/// Diagnoses existing tests: those that both the folder and the truth file have.
fn elsewhere(
    folder: &Path,
    truth: &Path,
    terminal: &Terminal,
) -> anyhow::Result<(Vec<Case>, Conduct)> {
    let name = truth.display();
    let text = fs::read_to_string(truth).with_context(|| format!("{name}: cannot be read"))?;
    let TruthFile { truths, doubts } = parse_truths(&text).with_context(|| name.to_string())?;
    for doubt in doubts {
        terminal.warn(&format!("{name}: {doubt}"));
    }
    if truths.is_empty() {
        bail!("{name}: holds no test");
    }
    for truth in &truths {
        let path = folder.join(&truth.name).join("test.toml");
        if !path.is_file() {
            bail!(
                "{}: is missing, but {name} names the test \"{}\"; each test is a folder of that \
                 name with a test.toml",
                path.display(),
                truth.name
            );
        }
    }
    let names: Vec<&str> = truths.iter().map(|truth| truth.name.as_str()).collect();
    for unlisted in unlisted(folder, &names, "test.toml") {
        terminal.warn(&format!(
            "{}: {name} does not name this test, so it is left out",
            folder.join(unlisted).display()
        ));
    }
    let done = AtomicUsize::new(0);
    // Warnings of the descriptions appear in the order of the file.
    let read: Vec<anyhow::Result<TestFile>> = truths
        .iter()
        .map(|truth| read_test(&folder.join(&truth.name).join("test.toml"), terminal))
        .collect();
    let answers: Vec<anyhow::Result<Answer>> = read
        .into_par_iter()
        .map(|file| {
            let answer = file.and_then(|file| {
                file.check_recordings()?;
                Ok(Answer::of(&diagnosis_of(&file.test, &file.folder)?))
            });
            terminal.count(
                "tests diagnosed",
                done.fetch_add(1, Ordering::Relaxed) + 1,
                truths.len(),
            );
            answer
        })
        .collect();
    // An error in one test does not stop the others.
    let cases = truths.into_iter().zip(answers).map(|(truth, answer)| {
        let answer = answer.unwrap_or_else(|error| {
            terminal.warn(&format!(
                "the test \"{}\" could not be diagnosed, and counts as not diagnosed: {error:#}",
                truth.name
            ));
            Answer::default()
        });
        (truth, answer)
    });
    let cases: Vec<Case> = cases.collect();
    let conduct = Conduct {
        renamed: check_names_elsewhere(folder, &cases, terminal)?,
        ..Conduct::default()
    };
    Ok((cases, conduct))
}

/// Returns the folders with a description of this name that the truths do not name, in order.
pub(super) fn unlisted(folder: &Path, listed: &[&str], description: &str) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter(|entry| entry.path().join(description).is_file())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| !listed.contains(&name.as_str()))
        .collect();
    names.sort();
    names
}

/// Diagnoses the first existing tests again, with their recordings under other names. Tests whose names
/// cannot be exchanged are skipped. Returns the number of diagnosed tests.
fn check_names_elsewhere(
    folder: &Path,
    cases: &[Case],
    terminal: &Terminal,
) -> anyhow::Result<usize> {
    let mut again = 0;
    for (truth, answer) in cases {
        if again == AGAIN {
            break;
        }
        let place = folder.join(&truth.name);
        let copy = renamed(&place).unwrap_or_else(|error| {
            terminal.warn(&format!("{}: not renamed: {error:#}", place.display()));
            None
        });
        let Some(copy) = copy else {
            continue;
        };
        let text = fs::read_to_string(copy.path().join("test.toml"))?;
        let test = TestDescription::parse(&text, "test.toml")?;
        if case_of(&test, copy.path(), truth).1 != *answer {
            bail!(
                "the answer to {} depends on the names of its files",
                truth.name
            );
        }
        again += 1;
    }
    Ok(again)
}

/// Returns a copy of a test with its recordings under other names.
///
/// `None` if it has no recordings, one lies in another folder, or the description names one in a form that
/// cannot be exchanged.
pub(super) fn renamed(folder: &Path) -> anyhow::Result<Option<tempfile::TempDir>> {
    let Ok(text) = fs::read_to_string(folder.join("test.toml")) else {
        return Ok(None);
    };
    let Ok(test) = TestDescription::parse(&text, "test.toml") else {
        return Ok(None);
    };
    // The new names are in another order than the files.
    let mut names = BTreeMap::new();
    let mut files: Vec<&PathBuf> = Vec::new();
    for recording in &test.recordings {
        files.extend(recording.files());
    }
    for (number, path) in files.into_iter().rev().enumerate() {
        let ending = path.extension().unwrap_or_default();
        let (Some(file), Some(ending)) = (path.to_str(), ending.to_str()) else {
            return Ok(None);
        };
        if !folder.join(file).is_file() || path.components().count() > 1 {
            return Ok(None);
        }
        names.insert(file.to_owned(), format!("renamed-{number:04}.{ending}"));
    }
    let Some(text) = exchanged(&text, &test, &names).filter(|_| !names.is_empty()) else {
        return Ok(None);
    };
    let copy = tempfile::tempdir().context("no temporary folder can be made")?;
    for (file, name) in &names {
        fs::copy(folder.join(file), copy.path().join(name))?;
    }
    fs::write(copy.path().join("test.toml"), text)?;
    Ok(Some(copy))
}

/// Returns the description with the new names, in double or single quotation marks. `None` if it still names an
/// old file, which it spells in another way.
fn exchanged(
    text: &str,
    test: &TestDescription,
    names: &BTreeMap<String, String>,
) -> Option<String> {
    let mut text = text.to_owned();
    for (file, name) in names {
        for mark in ['"', '\''] {
            text = text.replace(
                &format!("{mark}{file}{mark}"),
                &format!("{mark}{name}{mark}"),
            );
        }
    }
    let after = TestDescription::parse(&text, "test.toml").ok()?;
    let [before, after] =
        [test, &after].map(|test| test.recordings.iter().flat_map(|one| one.files()));
    let all = before.zip(after).all(|(before, after)| {
        let name = before.to_str().and_then(|file| names.get(file));
        name.is_some_and(|name| after == Path::new(name))
    });
    all.then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with a description that ends so, and with these recordings.
    fn folder(ending: &str, files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let beam = "[beam]\nlength = \"423 mm\"\nwidth = \"40 mm\"\nthickness = \"4 mm\"\n\
                    modulus = \"200 GPa\"\ndensity = 7850\n[joint]\nkind = \"cantilever\"\n";
        fs::write(folder.path().join("test.toml"), format!("{beam}{ending}")).unwrap();
        for file in files {
            fs::write(folder.path().join(file), file).unwrap();
        }
        folder
    }

    #[test]
    fn regress_files_are_renamed_however_they_are_quoted_and_however_many() {
        let names: Vec<String> = (0..102).map(|k| format!("r{k}.wav")).collect();
        let quoted = |(k, name): (usize, &String)| {
            let mark = ["\"", "'"][k % 2];
            format!("[[recording]]\nfile = {mark}{name}{mark}\n")
        };
        let text: String = names.iter().enumerate().map(quoted).collect();
        let files: Vec<&str> = names.iter().map(String::as_str).collect();
        let copy = renamed(folder(&text, &files).path()).unwrap().unwrap();
        let text = fs::read_to_string(copy.path().join("test.toml")).unwrap();
        let test = TestDescription::parse(&text, "test.toml").unwrap();
        assert_eq!(test.recordings.len(), 102);
        for (recording, file) in test.recordings.iter().zip(files) {
            let content = fs::read_to_string(copy.path().join(&recording.file));
            assert_eq!(content.unwrap(), file);
            assert!(recording.file.to_str().unwrap().starts_with("renamed-"));
        }
    }

    #[test]
    fn regress_a_test_without_recordings_and_one_that_is_no_text_are_not_renamed() {
        let measured = folder("[measured]\nfrequencies = [17, 118]\n", &[]);
        assert!(renamed(measured.path()).unwrap().is_none());
        // A name that TOML spells with an escape.
        let escaped = folder("[[recording]]\nfile = \"\\u0061.wav\"\n", &["a.wav"]);
        assert!(renamed(escaped.path()).unwrap().is_none());
        fs::write(measured.path().join("test.toml"), [0xff, 0xfe]).unwrap();
        assert!(renamed(measured.path()).unwrap().is_none());
    }
}
