//! `tapjoint blind-check`: the success rate of the diagnosis on tests with an unknown effect.

use super::Outcome;
use super::blind_tests::{AGAIN, Listed, rename_recordings, renamed, write_test};
use super::input::{TestFile, read_test};
use super::overwrite::{CHECKSUMS, Expanded};
use super::publication::{OutputFolder, files_made_in};
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::description::TestDescription;
use crate::gap::{Diagnosis, GapSettings};
use crate::pipeline::{IdentifySettings, Stage, Work, diagnose_test, run_test};
use crate::report::blind_check::{render_blind_check, score_json};
use crate::study::blind_check::{
    Answer, Campaign, Case, Conduct, DrawnTest, Extent, RecordedTest, Truth, TruthFile, commitment,
    parse_truths, render_rows, rows, score,
};
use anyhow::{Context, bail};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

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
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
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
    let work = Work::begin(terminal.watch(), Stage::Study);
    let (cases, conduct) = match (&arguments.folder, &arguments.truth) {
        (Some(folder), Some(truth)) => elsewhere(folder, truth, &terminal)?,
        _ => drawn(
            &arguments.campaign(seed)?,
            arguments.keep.as_deref(),
            &terminal,
        )?,
    };
    drop(work);
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
    let work = Work::begin(terminal.watch(), Stage::Files);
    for file in render_blind_check(&cases, &scores, &conduct)? {
        output.add(&file.name, &file.bytes)?;
    }
    let folder = output.publish()?;
    drop(work);
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
    let sealed = crate::report::blind_check::truths_json(&truths)?;
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
    let names: Vec<&str> = truths.iter().map(|truth| truth.name.as_str()).collect();
    let listed = Listed {
        truth,
        what: "test",
        names: &names,
        descriptions: &["test.toml"],
    };
    listed.check(folder, terminal)?;
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
