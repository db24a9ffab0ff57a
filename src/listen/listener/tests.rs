//! The listener on recordings that grow while it listens.

use super::*;
use std::f64::consts::{PI, TAU};
use std::path::Path;
use tapjoint_analysis::BareSettings;
use tapjoint_description::ChannelRef;
use tapjoint_signal::recording::{Channel, PcmLayout, ReadSettings, SampleForm};

const RATE: f64 = 5120.0;

fn bare(hammer: usize) -> BareSettings {
    BareSettings {
        hammer: Some(ChannelRef::Number(hammer)),
        ..BareSettings::default()
    }
}

fn settings() -> ListenSettings {
    ListenSettings {
        name: "taps.wav".to_owned(),
        record: 1.0,
        headers: None,
        earlier: Vec::new(),
    }
}

/// A hammer pulse at each time (s) with its peak, and the decay of 118 Hz that it wakes.
fn samples(seconds: f64, hits: &[(f64, f64)]) -> Vec<[f64; 2]> {
    let mut state = 7_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        1e-4 * (f64::from(state) / f64::from(u32::MAX) - 0.5)
    };
    let mut samples = Vec::new();
    for n in 0..(seconds * RATE) as usize {
        let mut frame = [noise(), noise()];
        for &(time, peak) in hits {
            let since = n as f64 / RATE - time;
            if (0.0..2e-3).contains(&since) {
                frame[0] += peak * (PI * since / 2e-3).sin().powi(2);
            }
            if since > 0.0 {
                frame[1] += peak * (-4.0 * since).exp() * (TAU * 118.0 * since).sin();
            }
        }
        samples.push(frame);
    }
    samples
}

/// Writes a file in pieces of so many frames, and listens after each. Returns the news with the seconds at which they
/// came; those of the end come last.
#[expect(clippy::disallowed_methods, reason = "the test is the recorder")]
fn heard(samples: &[[f64; 2]], path: &Path, piece: usize) -> Vec<(f64, News)> {
    let layout = PcmLayout::new(RATE as u32, 2, SampleForm::F64).unwrap();
    let bare = bare(1);
    let mut bytes = layout.wav_head(0);
    let mut listener = None;
    let mut all = Vec::new();
    for some in samples.chunks(piece) {
        for value in some.iter().flatten() {
            SampleForm::F64.write(*value, &mut bytes);
        }
        std::fs::write(path, &bytes).unwrap();
        let listener = listener.get_or_insert_with(|| {
            let growing = GrowingRecording::open(path).unwrap();
            Listener::new(growing, RecordingPlan::Bare(&bare), settings())
        });
        while let Some(news) = listener.step().unwrap() {
            let now = listener.seconds();
            all.extend(news.into_iter().map(|one| (now, one)));
        }
    }
    let news = listener.as_mut().unwrap().finish().unwrap();
    all.extend(news.into_iter().map(|one| (f64::INFINITY, one)));
    let listener = listener.unwrap();
    // The decisions after the last sample are those of the whole chain on the file.
    let opened = Recording::open(path, &ReadSettings::default()).unwrap();
    let whole = taps_so_far(
        opened,
        &RecordingPlan::Bare(&bare),
        &TapsByHand::default(),
        false,
        &mut TapMemo::default(),
    )
    .unwrap();
    let whole = whole.taps.taps.iter();
    let whole: Vec<Reported> = whole.map(Reported::from).collect();
    assert_eq!(listener.reported, whole);
    all
}

fn rejection(news: &News) -> Option<&Rejection> {
    match news {
        News::Tap(tap) | News::Revised(tap) => tap.rejection.as_ref(),
        _ => None,
    }
}

#[test]
fn prop_a_verdict_comes_when_the_record_has_ended_whatever_the_pieces() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("taps.wav");
    // The third comes before the record of the second has ended. The fourth is a double hit.
    let hits = [(0.8, 1.0), (3.0, 1.1), (3.7, 0.9), (6.0, 1.0), (6.05, 0.4)];
    let samples = samples(8.0, &hits);
    let all = heard(&samples, &path, 137);
    let reported: Vec<(f64, f64)> = all
        .iter()
        .map(|(now, news)| match news {
            News::Tap(tap) => (*now, tap.time),
            other => panic!("{other}"),
        })
        .collect();
    for ((now, time), (hit, ended)) in
        reported
            .iter()
            .zip([(0.8, 1.8), (3.0, 3.7), (3.7, 4.7), (6.0, 7.0)])
    {
        assert!((time - hit).abs() < 2e-3, "{time} for {hit}");
        // A step for the alarm, and one for the look.
        assert!(
            (ended..ended + 2.0 * STEP + 1e-9).contains(now),
            "{now} for {ended}"
        );
    }
    assert_eq!(reported.len(), 4);
    assert!(matches!(
        rejection(&all[3].1),
        Some(Rejection::DoubleHit { .. })
    ));
    // The same news, whatever came at once.
    for piece in [1000, 41_000] {
        assert_eq!(heard(&samples, &path, piece), all, "pieces of {piece}");
    }
}

#[test]
fn val_a_long_record_is_read_to_its_end() {
    let rate = 1000.0;
    let samples: Vec<f64> = (0..30_000)
        .map(|n| (-0.1 * f64::from(n) / rate).exp() * (TAU * 118.0 * f64::from(n) / rate).sin())
        .collect();
    let channel = Channel {
        samples: [vec![0.0; 2000], samples].concat(),
        ..Channel::default()
    };
    let recording = Recording::from_samples("taps", rate, vec![channel]).unwrap();
    let plan = RecordingPlan::Bare(&BareSettings::default());
    let mut memo = TapMemo::default();
    let found = taps_so_far(recording, &plan, &TapsByHand::default(), false, &mut memo).unwrap();
    let decay = remaining(&found, &found.taps.taps[0])
        .unwrap()
        .expect("it rings");
    // From the middle of the first to that of the last half second. 16 ms of the first lie before the trigger: 1.6 %.
    let wanted = (-0.1_f64 * 29.5).exp();
    assert!((decay / wanted - 1.0).abs() < 0.02, "{decay} for {wanted}");
}

#[test]
fn regress_a_small_event_just_before_a_tap_delays_no_verdict() {
    let folder = tempfile::tempdir().unwrap();
    // The hammer moves a little, and the alarm is silent when it strikes.
    let hits = [(0.86, 0.01), (1.0, 1.0), (4.86, 0.01), (5.0, 1.1)];
    let all = heard(&samples(8.0, &hits), &folder.path().join("taps.wav"), 300);
    let words: Vec<String> = all.iter().map(|(_, news)| news.to_string()).collect();
    for (time, ended) in [(1.0, 2.0), (5.0, 6.0)] {
        let first = all.iter().find(|(_, news)| match news {
            News::Tap(tap) => (tap.time - time).abs() < REACH,
            _ => false,
        });
        let (now, _) = first.unwrap_or_else(|| panic!("{words:?}"));
        assert!(
            (ended - 2.0 * STEP..ended + 2.0 * STEP).contains(now),
            "{now}: {words:?}"
        );
    }
}

#[test]
fn prop_a_decision_that_later_taps_change_is_reported_again() {
    let folder = tempfile::tempdir().unwrap();
    // Two soft hits, and then the real ones.
    let hits = [(0.8, 0.05), (3.0, 1.0), (5.0, 1.1), (7.0, 0.9)];
    let all = heard(&samples(9.0, &hits), &folder.path().join("taps.wav"), 500);
    let words: Vec<String> = all.iter().map(|(_, news)| news.to_string()).collect();
    let revised = all
        .iter()
        .find(|(_, news)| matches!(news, News::Revised(_)));
    let (now, news) = revised.unwrap_or_else(|| panic!("{words:?}"));
    assert!(
        matches!(rejection(news), Some(Rejection::TooWeak { .. })),
        "{news}"
    );
    assert!(*now < 9.0, "{words:?}");
    assert!(words[0].starts_with("tap at 0.80 s accepted"), "{words:?}");
}

#[test]
fn limit_silence_gives_no_news_and_a_wrong_channel_is_named_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("taps.wav");
    assert_eq!(heard(&samples(3.0, &[]), &path, 400), []);
    let bare = bare(3);
    let growing = GrowingRecording::open(&path).unwrap();
    let mut listener = Listener::new(growing, RecordingPlan::Bare(&bare), settings());
    let problem = listener.step().unwrap_err().to_string();
    assert_eq!(
        problem,
        "--hammer: taps.wav: no channel 3; there are: 1, 2; name one of these"
    );
}

/// A whole file, heard up to its end.
#[expect(clippy::disallowed_methods, reason = "the test is the recorder")]
fn listened<'a>(
    samples: &[[f64; 2]],
    path: &Path,
    bare: &'a BareSettings,
) -> (Listener<'a>, Vec<News>) {
    let layout = PcmLayout::new(RATE as u32, 2, SampleForm::F64).unwrap();
    let mut bytes = layout.wav_head(16 * samples.len() as u32);
    for value in samples.iter().flatten() {
        SampleForm::F64.write(*value, &mut bytes);
    }
    std::fs::write(path, &bytes).unwrap();
    let growing = GrowingRecording::open(path).unwrap();
    let mut listener = Listener::new(growing, RecordingPlan::Bare(bare), settings());
    let mut all = Vec::new();
    while let Some(news) = listener.step().unwrap() {
        all.extend(news);
    }
    (listener, all)
}

#[test]
fn prop_decisions_by_hand_change_their_own_tap_and_can_be_taken_back() {
    let folder = tempfile::tempdir().unwrap();
    let hits = [(0.8, 1.0), (3.0, 1.1), (5.5, 1.0), (5.55, 0.4), (8.0, 0.9)];
    let bare = bare(1);
    let (mut listener, _) = listened(
        &samples(11.0, &hits),
        &folder.path().join("taps.wav"),
        &bare,
    );
    let counts = |listener: &Listener<'_>| -> Vec<bool> {
        let reported = listener.reported.iter();
        reported.map(|tap| tap.rejection.is_none()).collect()
    };
    let by_rules = counts(&listener);
    assert_eq!(by_rules, [true, true, false, true]);
    // Nothing is there.
    assert_eq!(listener.decide(7.0, false).unwrap(), None);
    assert_eq!(listener.undo().unwrap(), None);
    let news = listener.decide(3.02, false).unwrap().unwrap();
    let words: Vec<String> = news.iter().map(ToString::to_string).collect();
    assert_eq!(words, ["tap at 3.00 s is now REJECTED: rejected by hand"]);
    assert_eq!(counts(&listener), [true, false, false, true]);
    listener.decide(5.5, true).unwrap();
    assert_eq!(counts(&listener), [true, false, true, true]);
    let by_hand = listener.by_hand();
    let near = |times: &[f64], wanted: f64| times.len() == 1 && (times[0] - wanted).abs() < 2e-3;
    assert!(
        near(&by_hand.accept, 5.5) && near(&by_hand.reject, 3.0),
        "{by_hand:?}"
    );
    // The same again is no decision. What the rules say anyhow is one: later taps may change what they say.
    assert_eq!(listener.decide(5.5, true).unwrap(), Some(Vec::new()));
    listener.decide(8.0, true).unwrap();
    assert_eq!(listener.by_hand().accept.len(), 2);
    // Back to the first decision and before it.
    for wanted in [
        [true, false, true, true],
        [true, false, false, true],
        [true, true, false, true],
    ] {
        assert!(listener.undo().unwrap().is_some());
        assert_eq!(counts(&listener), wanted);
    }
    assert_eq!(listener.undo().unwrap(), None);
    assert_eq!(*listener.by_hand(), TapsByHand::default());
    assert_eq!(counts(&listener), by_rules);
    // The last look keeps what was decided.
    listener.decide(0.8, false).unwrap();
    listener.finish().unwrap();
    assert_eq!(counts(&listener), [false, true, false, true]);
}

#[test]
fn prop_what_is_settled_stands_if_the_recording_ends_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("taps.wav");
    let bare = bare(1);
    // The third comes early: the record of the second would be too short at the end. The fourth is a double hit. The last two
    // come within the time to a verdict.
    let hits = [
        (0.8, 1.0),
        (3.0, 1.1),
        (4.3, 1.0),
        (6.5, 1.0),
        (6.55, 0.4),
        (9.0, 0.9),
        (9.6, 1.0),
    ];
    let (listener, _) = listened(&samples(13.0, &hits), &path, &bare);
    drop(listener);
    let growing = GrowingRecording::open(&path).unwrap();
    let mut listener = Listener::new(growing, RecordingPlan::Bare(&bare), settings());
    let (mut waits, mut looks) = (Vec::new(), 0);
    while listener.step().unwrap().is_some() {
        let settled = listener.settled();
        if settled.missing > 0.0 {
            waits.push(settled.missing);
            assert_eq!(settled.frames, None);
        }
        let Some(frames) = settled.frames.filter(|_| listener.taps() > 0) else {
            continue;
        };
        looks += 1;
        let read = ReadSettings {
            frames: Some(frames),
            ..ReadSettings::default()
        };
        let ended = Recording::open(&path, &read).unwrap();
        assert_eq!(ended.frames(), frames);
        let found = taps_so_far(
            ended,
            &RecordingPlan::Bare(&bare),
            &TapsByHand::default(),
            false,
            &mut TapMemo::default(),
        );
        let taps = found.unwrap().taps.taps;
        let accepted = taps.iter().filter(|tap| tap.accepted());
        let times: Vec<f64> = accepted.map(|tap| tap.time).collect();
        let now = listener.seconds();
        assert_eq!(times, listener.counting(), "{settled:?}, {now:.2} s");
    }
    assert!(looks > 100, "{looks}");
    // From its verdict after 1 s to four fifths of the shortest record before it, of 1.3 to 2.2 s.
    assert!(!waits.is_empty());
    assert!(
        waits.iter().all(|missing| (0.0..0.8).contains(missing)),
        "{waits:?}"
    );
}

#[test]
fn limit_nothing_is_missing_in_the_next_file() {
    let folder = tempfile::tempdir().unwrap();
    let bare = bare(1);
    let second = folder.path().join("taps-2.wav");
    listened(&samples(1.0, &[]), &second, &bare);
    let hits = [(0.8, 1.0), (3.0, 1.1)];
    let (mut listener, _) = listened(&samples(4.2, &hits), &folder.path().join("taps.wav"), &bare);
    let settled = listener.settled();
    // Four fifths of 2.2 s, less the 1.2 s that are there; the steps may hold 50 ms less.
    assert!((0.5..0.62).contains(&settled.missing), "{settled:?}");
    let next = GrowingRecording::open(&second).unwrap();
    listener.go_on_in(next).unwrap();
    let settled = listener.settled();
    assert_eq!(settled.missing, 0.0, "{settled:?}");
    assert!(settled.frames.is_some());
}

#[test]
fn recover_channels_from_which_nothing_comes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("taps.wav");
    let bare = bare(1);
    let whole = samples(9.0, &[(0.8, 1.0), (3.0, 1.1), (5.5, 1.0)]);
    let doubts = |samples: &[[f64; 2]]| {
        let (_, news) = listened(samples, &path, &bare);
        let doubts = news.into_iter().filter_map(|news| match news {
            News::Doubt(text) => Some(text),
            _ => None,
        });
        doubts.collect::<Vec<_>>()
    };
    assert_eq!(doubts(&whole), [""; 0]);
    // The sensor falls off after the first tap.
    let mut dead = whole.clone();
    for frame in &mut dead[(2.5 * RATE) as usize..] {
        frame[1] = 0.05;
    }
    let (_, news) = listened(&dead, &path, &bare);
    let dead = news.iter().filter_map(rejection);
    let is_dead = |why: &Rejection| matches!(why, Rejection::Stopped { channel: 2 });
    assert!(
        dead.clone().count() >= 2 && dead.clone().all(is_dead),
        "{news:?}"
    );
    // The hammer's cable is loose from the first.
    let mut mute = whole;
    for frame in &mut mute {
        frame[0] = 0.0;
    }
    let found = doubts(&mute);
    let told = "hammer (channel 1): no sample changes while the structure answers, last at 5.";
    assert!(found.iter().any(|text| text.starts_with(told)), "{found:?}");
}

#[test]
fn recover_what_is_wrong_before_the_first_tap_that_counts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("taps.wav");
    let doubts = |samples: &[[f64; 2]], hammer: usize| {
        let (_, news) = listened(samples, &path, &bare(hammer));
        let doubts = news.into_iter().filter_map(|news| match news {
            News::Doubt(text) => Some(text),
            _ => None,
        });
        doubts.collect::<Vec<_>>()
    };
    // Nothing but noise.
    let told = "no tap in the first 20 s on the hammer's channel (number 1). If you have tapped, check the cables, the gain \
                and the numbers of the channels.";
    assert_eq!(doubts(&samples(25.0, &[]), 1), [told]);
    assert_eq!(doubts(&samples(19.0, &[]), 1), [""; 0]);
    // Hammer and sensor are exchanged.
    let told = "most taps are rejected. Channel 1 has the short pulses of a hammer. If it is the hammer, say --hammer 1, or correct \
                the hammer's `channel` in the description";
    let hits = [(0.8, 1.0), (3.0, 1.1), (5.5, 1.0), (8.0, 1.0)];
    assert_eq!(doubts(&samples(10.0, &hits), 2), [told]);
    // Both channels ring: two sensors, and no hammer.
    let mut mixed = samples(10.0, &hits);
    for frame in &mut mixed {
        frame[0] = frame[1] + 0.1 * frame[0];
    }
    let told = "most taps are rejected. Check the number of channels, the sample format and the hammer's channel";
    assert_eq!(doubts(&mixed, 1), [told]);
}
