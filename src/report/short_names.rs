//! Names of files: shortened so that no two of them look alike, and as parts of other names.

use std::collections::BTreeSet;

/// Stands for what is left out.
const LEFT_OUT: char = '\u{2026}';
/// Shortest a name becomes (characters).
const SHORTEST: usize = 4;

/// Returns names in ways that take less and less room.
///
/// First they are as given, then without the folder and the ending that all share. Next they lack the words
/// that all begin and end with, and at last their middles. A way in which two names would be the same is left
/// out.
pub fn ways(names: &[String]) -> Vec<Vec<String>> {
    let without_folder = without_shared(names, |name| {
        name.split_at(name.rfind(['/', '\\']).map_or(0, |at| at + 1))
    });
    let plain = without_shared(&without_folder, |name| {
        let place = name.rfind('.').filter(|place| *place > 0);
        let (plain, ending) = name.split_at(place.unwrap_or(name.len()));
        (ending, plain)
    });
    let cores = cores(&plain);
    let longest = cores.iter().map(|core| core.chars().count()).max();
    let shorter = (SHORTEST..longest.unwrap_or(0)).rev();
    let middles = shorter.map(|width| cores.iter().map(|core| middle_out(core, width)).collect());
    let mut ways = vec![names.to_vec(), plain.clone(), cores.clone()];
    ways.extend(middles);
    ways.retain(|way| way.iter().collect::<BTreeSet<_>>().len() == names.len());
    ways
}

/// Returns files by the ends of their paths, each as long as it takes to tell it from the others: names for titles.
pub fn ends_of_paths(files: &[&str]) -> Vec<String> {
    let mut ends = Vec::new();
    for file in files {
        let separators = file.rmatch_indices(['/', '\\']);
        let own = separators.map(|(place, _)| &file[place + 1..]);
        let mut own = own.filter(|end| !end.is_empty());
        let apart = own.find(|end| {
            files.iter().all(|other| {
                // No other path is this, or ends in a folder's separator and this.
                let before = other.strip_suffix(end).filter(|_| other != file);
                before.is_none_or(|before| !before.is_empty() && !before.ends_with(['/', '\\']))
            })
        });
        ends.push(apart.unwrap_or(*file).to_owned());
    }
    ends
}

/// Returns the names without the part that all share: names are split into that part and the rest.
fn without_shared(names: &[String], split: impl Fn(&str) -> (&str, &str)) -> Vec<String> {
    let parts: Vec<(&str, &str)> = names.iter().map(|name| split(name)).collect();
    match parts.iter().all(|(shared, _)| *shared == parts[0].0) {
        true => parts.iter().map(|(_, rest)| (*rest).to_owned()).collect(),
        false => names.to_vec(),
    }
}

/// Returns the names without the words that all of them begin and end with.
fn cores(names: &[String]) -> Vec<String> {
    let letters: Vec<Vec<char>> = names.iter().map(|name| name.chars().collect()).collect();
    if letters.len() < 2 {
        return names.to_vec();
    }
    let least = letters.iter().map(Vec::len).min().unwrap_or(0);
    let mut begin = shared(&letters, least);
    while begin > 0 && letters.iter().any(|name| inside_word(name, begin)) {
        begin -= 1;
    }
    let mut backwards = letters.clone();
    for name in &mut backwards {
        name.reverse();
    }
    let mut end = shared(&backwards, least - begin);
    while end > 0 && backwards.iter().any(|name| inside_word(name, end)) {
        end -= 1;
    }
    // A letter or two at either side is no more than what would stand for it.
    let (begin, end) = (
        if begin > 1 { begin } else { 0 },
        if end > 1 { end } else { 0 },
    );
    if letters.iter().any(|name| name.len() == begin + end) {
        return names.to_vec();
    }
    let mut cores = Vec::new();
    for name in &letters {
        let mut core = String::new();
        core.extend((begin > 0).then_some(LEFT_OUT));
        core.extend(&name[begin..name.len() - end]);
        core.extend((end > 0).then_some(LEFT_OUT));
        cores.push(core);
    }
    cores
}

/// Returns how many letters all names begin with, `most` of them looked at.
fn shared(names: &[Vec<char>], most: usize) -> usize {
    let mut places = 0..most;
    let differs = places.find(|at| names.iter().any(|name| name[*at] != names[0][*at]));
    differs.unwrap_or(most)
}

/// True where a name would be cut inside a word or a number there.
fn inside_word(name: &[char], at: usize) -> bool {
    match name.get(at.wrapping_sub(1)).zip(name.get(at)) {
        Some((before, after)) => {
            before.is_alphabetic() && after.is_alphabetic()
                || before.is_numeric() && after.is_numeric()
        }
        None => false,
    }
}

/// A name of at most `width` characters: its middle gives way.
fn middle_out(name: &str, width: usize) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= width {
        return name.to_owned();
    }
    // The words that all share are left out already, and the end differs most: "\u{2026}00001" and not "\u{2026}0\u{2026}1".
    if letters.first() == Some(&LEFT_OUT) && letters.last() != Some(&LEFT_OUT) {
        let end = letters.iter().skip(letters.len() + 1 - width.max(1));
        return std::iter::once(&LEFT_OUT).chain(end).collect();
    }
    let kept = width.saturating_sub(1);
    let (head, tail) = (kept - kept / 2, kept / 2);
    let first = letters.iter().take(head);
    let last = letters.iter().skip(letters.len() - tail);
    first.chain(&[LEFT_OUT]).chain(last).collect()
}

/// Returns file names without folder and ending, safe as part of a name, each different.
pub(super) fn stems<'a>(files: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for file in files {
        let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
        let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
        let stem = match stem {
            "" => "recording".to_owned(),
            _ => stem.replace(
                |c: char| !c.is_alphanumeric() && !matches!(c, '-' | '_'),
                "-",
            ),
        };
        let mut unique = stem.clone();
        let mut number = 2;
        while stems.contains(&unique) {
            unique = format!("{stem}-{number}");
            number += 1;
        }
        stems.push(unique);
    }
    stems
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::btree_set;
    use proptest::prelude::*;

    fn shortest_that_fit(names: &[&str], width: usize) -> Vec<String> {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let fits = |way: &Vec<String>| way.iter().all(|name| name.chars().count() <= width);
        ways(&names).into_iter().find(fits).unwrap_or_default()
    }

    #[test]
    fn val_names_lose_first_what_they_share() {
        let cases: [(&[&str], usize, &[&str]); 9] = [
            (&["a.wav", "b.wav"], 8, &["a.wav", "b.wav"]),
            (&["first.wav", "moved.wav"], 8, &["first", "moved"]),
            (&["low.wav", "low.csv"], 5, &["…wav", "…csv"]),
            (&["run-1.wav", "run-1-b.wav"], 7, &["run-1", "run-1-b"]),
            (&["day/first.wav", "day/low.wav"], 9, &["first", "low"]),
            (
                &["beam-visit-11.wav", "beam-visit-12.wav"],
                8,
                &["…11", "…12"],
            ),
            (
                &["2026-03-14_north_steel.wav", "2026-03-14_south_steel.wav"],
                8,
                &["…north…", "…south…"],
            ),
            (&["Hxysv00001.txt", "Hxysv00005.txt"], 4, &["…001", "…005"]),
            (
                &["measurement_before_noon.wav", "another.wav"],
                8,
                &["meas…oon", "another"],
            ),
        ];
        for (names, width, expected) in cases {
            assert_eq!(shortest_that_fit(names, width), expected, "{names:?}");
        }
    }

    #[test]
    fn val_titles_name_files_by_the_shortest_ends_that_differ() {
        let cases: [(&[&str], &[&str]); 5] = [
            (&["low.wav", "high.wav"], &["low.wav", "high.wav"]),
            (&["/beams/visit/low.wav"], &["low.wav"]),
            (
                &[
                    "/data/monday/low.wav",
                    "/data/tuesday/low.wav",
                    "/data/monday/high.wav",
                ],
                &["monday/low.wav", "tuesday/low.wav", "high.wav"],
            ),
            (&["low.wav", "soft/low.wav"], &["low.wav", "soft/low.wav"]),
            (
                &["C:\\a\\low.wav", "C:\\a\\below.wav"],
                &["low.wav", "below.wav"],
            ),
        ];
        for (files, expected) in cases {
            assert_eq!(ends_of_paths(files), expected, "{files:?}");
        }
    }

    #[test]
    fn regress_a_way_in_which_two_names_look_alike_is_not_offered() {
        // Head and tail are the same.
        let names = ["abcdefgh-x-stuvwxyz", "abcdefgh-y-stuvwxyz", "abc", ""].map(str::to_owned);
        for way in ways(&names) {
            let apart: BTreeSet<&String> = way.iter().collect();
            assert_eq!(apart.len(), names.len(), "{way:?}");
        }
        assert_eq!(
            ways(&[]),
            Vec::<Vec<String>>::from([vec![], vec![], vec![]])
        );
    }

    proptest! {
        #[test]
        fn prop_no_two_names_ever_look_alike_and_numbers_stay(
            numbers in btree_set(1..100u32, 2..6),
            head in "[a-z]{2,12}(_[a-z]{1,8})?",
            tail in "[a-z]{2,12}(_[a-z]{1,8})?",
        ) {
            let name = |number: &u32| format!("{head}-{number}-{tail}.wav");
            let names: Vec<String> = numbers.iter().map(name).collect();
            let ways = ways(&names);
            prop_assert_eq!(&ways[0], &names);
            for way in &ways {
                let apart: BTreeSet<&String> = way.iter().collect();
                prop_assert_eq!(apart.len(), names.len());
            }
            // Two digits between what stands for the words that all share.
            let width = |way: &Vec<String>| way.iter().map(|name| name.chars().count()).max();
            let least = ways.iter().filter_map(width).min();
            prop_assert!(least <= Some(4), "{:?}", ways);
            let short = ways.iter().find(|way| width(way) <= Some(4)).into_iter().flatten();
            for (short, number) in short.zip(&numbers) {
                prop_assert!(short.contains(&number.to_string()), "{} of {}", short, number);
            }
        }

        #[test]
        fn prop_whatever_the_names_the_first_way_is_themselves(
            names in btree_set(".{0,12}", 0..5),
        ) {
            let names: Vec<String> = names.into_iter().collect();
            let ways = ways(&names);
            prop_assert_eq!(&ways[0], &names);
            // Middles go last, so that later ways are never longer.
            let width = |way: &Vec<String>| way.iter().map(|name| name.chars().count()).max();
            let widths: Vec<_> = ways.iter().skip(3).map(width).collect();
            prop_assert!(widths.is_sorted_by(|a, b| a >= b), "{:?}", ways);
        }
    }
}
