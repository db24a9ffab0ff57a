//! `tapjoint blind-check --compare`: the success rate of `tapjoint compare` on pairs of tests with a withheld change.

use super::Outcome;
use super::blind_check::{BlindCheckArguments, RELIABILITY};
use super::blind_tests::{AGAIN, Listed, rename_recordings, renamed, write_test};
use super::input::{TestFile, read_test};
use super::publication::OutputFolder;
use super::simulate::SIDES;
use super::terminal::Terminal;
use crate::compare::{Pair, Settings, Test, compare};
use crate::description::TestDescription;
use crate::pipeline::{IdentifySettings, Stage, Work, compared_items, compared_test};
use crate::report::change_check::{pair_score_json, render_change_check};
use crate::study::blind_check::{RecordedTest, commitment, render_rows};
use crate::study::change_check::{
    DrawnPair, PairAnswer, PairCampaign, PairCase, PairConduct, PairTruth, PairTruthFile,
    pair_rows, pair_truths_json, parse_pair_truths, score_pairs,
};
use anyhow::{Context, anyhow, bail};
use rayon::prelude::*;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

pub(super) fn run(
    arguments: &BlindCheckArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let output = OutputFolder::prepare(&arguments.out, terminal.files())?;
    let work = Work::begin(terminal.watch(), Stage::Study);
    let (cases, conduct) = match (&arguments.folder, &arguments.truth) {
        (Some(folder), Some(truth)) => elsewhere(folder, truth, &terminal)?,
        _ => {
            let campaign = PairCampaign {
                pairs: arguments.cases,
                noise_db: arguments.noise_db()?,
                seed,
            };
            drawn(&campaign, arguments.keep.as_deref(), &terminal)?
        }
    };
    drop(work);
    let scores = score_pairs(&cases);
    let conduct = conduct.mutated(&cases, seed);
    terminal.say(&render_rows(&pair_rows(&scores)))?;
    let shuffled = conduct
        .shuffled
        .map_or("-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
    terminal.say(&format!(
        "\nFirst cause right by answers dealt out to other pairs: {shuffled}. Files renamed: {}.",
        match conduct.renamed {
            0 => "in no pair".to_owned(),
            1 => "same answer (1 pair)".to_owned(),
            pairs => format!("same answers ({pairs} pairs)"),
        }
    ))?;
    let work = Work::begin(terminal.watch(), Stage::Files);
    for file in render_change_check(&cases, &scores, &conduct)? {
        output.add(&file.name, &file.bytes)?;
    }
    // A check of the diagnosis may have used the folder.
    let stale = RELIABILITY.map(str::to_owned).to_vec();
    let (folder, left) = output.publish_without(stale)?;
    drop(work);
    terminal.say(&format!("Results: {}", folder.display()))?;
    terminal.write_json(&pair_score_json(&scores, &conduct))?;
    left.map_or(Ok(Outcome::Answered), Err)
}

/// Draws pairs, seals what changed, records and compares them.
fn drawn(
    campaign: &PairCampaign,
    keep: Option<&Path>,
    terminal: &Terminal,
) -> anyhow::Result<(Vec<PairCase>, PairConduct)> {
    let kept = keep.map(|name| OutputFolder::prepare_own(name, terminal.files()));
    let kept = kept.transpose()?;
    let done = AtomicUsize::new(0);
    let pairs = (0..campaign.pairs)
        .into_par_iter()
        .map(|index| {
            let pair = campaign.draw(index);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            terminal.count("pairs drawn", done, campaign.pairs);
            pair
        })
        .collect::<Result<Vec<DrawnPair>, _>>()?;
    let truths: Vec<PairTruth> = pairs.iter().map(|pair| pair.truth.clone()).collect();
    let sealed = pair_truths_json(&truths)?;
    let commitment = commitment(&sealed);
    terminal.seal(&format!(
        "{} {} drawn; SHA-256 of truth.json: {commitment}",
        pairs.len(),
        if pairs.len() == 1 { "pair" } else { "pairs" }
    ))?;
    let done = AtomicUsize::new(0);
    let cases = pairs
        .par_iter()
        .map(|pair| {
            let recorded = pair.record()?;
            let truth = &pair.truth;
            let answer = match kept.as_ref().zip(keep) {
                Some((kept, shown)) => {
                    let (place, shown) = (kept.place_of(&truth.name), shown.join(&truth.name));
                    compare_recorded(&recorded, truth.repeatability, &place, &shown)?
                }
                None => compare_in_passing(&recorded, truth.repeatability)?,
            };
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            terminal.count("pairs compared", done, pairs.len());
            Ok((truth.clone(), answer))
        })
        .collect::<anyhow::Result<Vec<PairCase>>>()?;
    let conduct = PairConduct {
        commitment: Some(commitment),
        renamed: check_names(&pairs, &cases)?,
        ..PairConduct::default()
    };
    if let Some(kept) = kept {
        kept.add("truth.json", sealed.as_bytes())?;
        kept.publish()?;
    }
    Ok((cases, conduct))
}

/// Compares the first pairs again under other names: the answers must not change. Returns their number.
fn check_names(pairs: &[DrawnPair], cases: &[PairCase]) -> anyhow::Result<usize> {
    let answered = pairs.iter().zip(cases);
    // An answer with a reason names the files.
    let answered = answered.filter(|(_, (_, answer))| answer.found().is_some());
    let mut again = 0;
    for (pair, (truth, answer)) in answered.take(AGAIN) {
        let mut recorded = pair.record()?;
        for test in &mut recorded {
            rename_recordings(test, again as u64, &truth.name);
        }
        if compare_in_passing(&recorded, truth.repeatability)? != *answer {
            bail!(
                "the answer to {} depends on the names of its files",
                truth.name
            );
        }
        again += 1;
    }
    Ok(again)
}

fn compare_in_passing(
    recorded: &[RecordedTest; 2],
    repeatability: Option<f64>,
) -> anyhow::Result<PairAnswer> {
    let folder = tempfile::tempdir().context("no temporary folder can be made")?;
    compare_recorded(recorded, repeatability, folder.path(), folder.path())
}

/// Writes both tests into a folder of their own, and compares them from there. Errors name the folder `shown`.
fn compare_recorded(
    recorded: &[RecordedTest; 2],
    repeatability: Option<f64>,
    folder: &Path,
    shown: &Path,
) -> anyhow::Result<PairAnswer> {
    let mut files = Vec::new();
    for (test, side) in recorded.iter().zip(SIDES) {
        let own = folder.join(side);
        write_test(test, &own, &shown.join(side))?;
        files.push(TestFile {
            test: TestDescription::parse(&test.description, "test.toml")?,
            name: "test.toml".to_owned(),
            folder: own,
        });
    }
    Ok(answer_of(&files[0], &files[1], repeatability))
}

/// Compares two tests. A pair that cannot be compared has no answer, which is counted separately.
fn answer_of(before: &TestFile, after: &TestFile, repeatability: Option<f64>) -> PairAnswer {
    let found = side_of(before).and_then(|before| {
        let pair = Pair {
            before: vec![before],
            after: vec![side_of(after)?],
        };
        Ok(compare(&[pair], &Settings { repeatability })?)
    });
    match found {
        Ok(found) => PairAnswer::Compared(Box::new(found)),
        Err(error) => {
            // A temporary folder has another name each time.
            let mut reason = format!("{error:#}");
            for file in [before, after] {
                let folder = format!("{}{}", file.folder.display(), std::path::MAIN_SEPARATOR);
                reason = reason.replace(&folder, "");
            }
            PairAnswer::None(reason)
        }
    }
}

/// Analyses a test as one side of a comparison.
fn side_of(file: &TestFile) -> anyhow::Result<Test> {
    file.test.check_has_data(&file.name)?;
    file.check_recordings()?;
    let analysis = file.analyse(&IdentifySettings::unperturbed(), &())?;
    compared_test(&file.test, &analysis)
        .ok_or_else(|| anyhow!("{}: describes no structure", file.name))
}

/// Compares existing pairs: those that both the folder and the truth file have.
fn elsewhere(
    folder: &Path,
    truth: &Path,
    terminal: &Terminal,
) -> anyhow::Result<(Vec<PairCase>, PairConduct)> {
    let name = truth.display();
    let text = fs::read_to_string(truth).with_context(|| format!("{name}: cannot be read"))?;
    let PairTruthFile { truths, doubts } =
        parse_pair_truths(&text).with_context(|| name.to_string())?;
    for doubt in doubts {
        terminal.warn(&format!("{name}: {doubt}"));
    }
    if truths.is_empty() {
        bail!("{name}: holds no pair of tests");
    }
    let names: Vec<&str> = truths.iter().map(|truth| truth.name.as_str()).collect();
    let listed = Listed {
        truth,
        what: "pair",
        names: &names,
        descriptions: &["before/test.toml", "after/test.toml"],
    };
    listed.check(folder, terminal)?;
    // Warnings of the descriptions appear in the order of the file.
    let mut read = Vec::with_capacity(truths.len());
    for truth in &truths {
        let place = folder.join(&truth.name);
        let files = SIDES.map(|side| read_test(&place.join(side).join("test.toml"), terminal));
        for item in truth
            .changes
            .iter()
            .filter_map(|change| change.item.as_ref())
        {
            let Ok(before) = &files[0] else {
                continue;
            };
            let items = compared_items(&before.test);
            if items.iter().all(|own| own.name != *item) {
                terminal.warn(&format!(
                    "{name}: \"{}\": before/test.toml describes no \"{item}\" that weighs in the reference recording, so that \
                     no answer has the right item",
                    truth.name
                ));
            }
        }
        read.push(files);
    }
    let done = AtomicUsize::new(0);
    let answers: Vec<PairAnswer> = read
        .into_par_iter()
        .zip(&truths)
        .map(|(files, truth)| {
            let answer = match files {
                [Ok(before), Ok(after)] => answer_of(&before, &after, truth.repeatability),
                [Err(error), _] | [_, Err(error)] => PairAnswer::None(format!("{error:#}")),
            };
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            terminal.count("pairs compared", done, truths.len());
            answer
        })
        .collect();
    // An error in one pair does not stop the others.
    let cases: Vec<PairCase> = truths.into_iter().zip(answers).collect();
    for (truth, answer) in &cases {
        if let PairAnswer::None(reason) = answer {
            terminal.warn(&format!(
                "the pair \"{}\" could not be compared, and counts as not answered: {reason}",
                truth.name
            ));
        }
    }
    let conduct = PairConduct {
        renamed: check_names_elsewhere(folder, &cases, terminal)?,
        ..PairConduct::default()
    };
    Ok((cases, conduct))
}

/// Compares the first existing pairs again, with their recordings under other names. Pairs whose names cannot be exchanged are
/// skipped. Returns the number of compared pairs.
fn check_names_elsewhere(
    folder: &Path,
    cases: &[PairCase],
    terminal: &Terminal,
) -> anyhow::Result<usize> {
    let mut again = 0;
    for (truth, answer) in cases {
        if again == AGAIN {
            break;
        }
        // An answer with a reason names the files.
        if answer.found().is_none() {
            continue;
        }
        let copies = SIDES.map(|side| {
            let place = folder.join(&truth.name).join(side);
            renamed(&place).unwrap_or_else(|error| {
                terminal.warn(&format!("{}: not renamed: {error:#}", place.display()));
                None
            })
        });
        let [Some(before), Some(after)] = copies else {
            continue;
        };
        let mut files = Vec::new();
        for copy in [&before, &after] {
            let text = fs::read_to_string(copy.path().join("test.toml"))?;
            files.push(TestFile {
                test: TestDescription::parse(&text, "test.toml")?,
                name: "test.toml".to_owned(),
                folder: copy.path().to_owned(),
            });
        }
        if answer_of(&files[0], &files[1], truth.repeatability) != *answer {
            bail!(
                "the answer to {} depends on the names of its files",
                truth.name
            );
        }
        again += 1;
    }
    Ok(again)
}
