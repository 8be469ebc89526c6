//! Chainages of tracks with long and short chains, counted up and down, against what they are built from.

use super::*;
use crate::track::Tunnel;
use crate::track::file::ChainageEquationEntry;

const LENGTH_M: f64 = 1000.0;

/// Jumps along the direction of counting at 300 and at 640.25 m; negative ones are long chains.
const JUMPS_M: [[f64; 2]; 6] = [
    [-14.7, 0.0],
    [25.0, 0.0],
    [-14.7, 25.0],
    [25.0, -14.7],
    // What the second region states, the first and the third state too.
    [-280.0, -300.5],
    [-400.0, 900.0],
];

/// With a jump of 0 there is no equation.
fn entry(increment: Increment, start_m: f64, jumps_m: [f64; 2]) -> StatedChainageEntry {
    let sign = match increment {
        Increment::Increasing => 1.0,
        Increment::Decreasing => -1.0,
    };
    let mut sum_m = 0.0;
    let equations = [300.0, 640.25].into_iter().zip(jumps_m);
    let equations = equations.filter(|(_, jump_m)| *jump_m != 0.0);
    let equations = equations.map(|(chainage_m, jump_m)| {
        sum_m += jump_m;
        ChainageEquationEntry {
            chainage_m,
            back_m: None,
            ahead_m: start_m + sign * (chainage_m + sum_m),
        }
    });
    StatedChainageEntry {
        prefix: "DK".into(),
        start_m,
        increment,
        equations: equations.collect(),
    }
}

/// Tracks that count up and down, from before and behind where the line counts from, with each pair of jumps.
fn tracks() -> impl Iterator<Item = StatedChainage> {
    let ways = [Increment::Increasing, Increment::Decreasing];
    ways.into_iter().flat_map(|increment| {
        [12_340.0, -250.125].into_iter().flat_map(move |start_m| {
            let tracks = [[0.0, 0.0]].into_iter().chain(JUMPS_M);
            tracks.map(move |jumps_m| {
                StatedChainage::of(&entry(increment, start_m, jumps_m), LENGTH_M)
            })
        })
    })
}

/// Places all along a track, to the millimetre, with its ends and the equations.
fn places_m() -> impl Iterator<Item = f64> {
    let even = (0..=400).map(|k| f64::from(k) * 2.5);
    even.chain([0.001, 299.999, 300.001, 640.249, 640.25, 640.251, 999.999])
}

/// Provokes: an inverse that loses a place, or finds one where something else is stated.
#[test]
fn a_stated_chainage_is_found_where_it_is_stated() {
    let mut several = 0;
    for track in tracks() {
        for s_m in places_m() {
            let places = track.places_m(track.stated_m(s_m));
            assert!(
                places.iter().any(|p| (p - s_m).abs() < 1e-6),
                "{s_m}: {places:?}"
            );
            several += usize::from(places.len() > 1);
            for place in places {
                let region = track.region_at(place);
                // At a jump it may be what is stated up to there.
                let stated = [region, region.saturating_sub(1)];
                let off_m = stated.map(|k| track.regions[k].stated_m(place) - track.stated_m(s_m));
                assert!(off_m.iter().any(|m| m.abs() < 1e-6), "{s_m}: {off_m:?}");
            }
        }
    }
    assert!(several > 1000, "{several}");
}

/// Provokes: rounding over a kilometre, a sign or a region that is lost, a text that is read as another place.
#[test]
fn a_text_leads_back_to_its_place() {
    let mut with_region = 0;
    for track in tracks() {
        let bare = StatedChainage {
            prefix: String::new(),
            ..track.clone()
        };
        for s_m in places_m() {
            for track in [&track, &bare] {
                let text = track.text(s_m, 3);
                let place = track.place(&text).unwrap();
                assert!((place - s_m).abs() < 1e-6, "{text}: {s_m}, {place}");
                with_region += usize::from(text.contains('R'));
            }
        }
    }
    assert!(with_region > 2000, "{with_region}");
}

/// Provokes: a long chain taken for a short one where chainages fall, or a jump put elsewhere.
#[test]
fn jumps_say_by_how_much_the_track_is_longer() {
    for increment in [Increment::Increasing, Increment::Decreasing] {
        for jumps_m in JUMPS_M {
            let track = StatedChainage::of(&entry(increment, 12_340.0, jumps_m), LENGTH_M);
            let longer_m: Vec<f64> = track.equations().map(|jump| jump.longer_m).collect();
            let is_m = jumps_m.into_iter().filter(|m| *m != 0.0);
            assert!(is_m.zip(&longer_m).all(|(is_m, m)| (is_m + m).abs() < 1e-9));
            for jump in track.equations() {
                assert!((track.stated_m(jump.at_m) - jump.ahead_m).abs() < 1e-9);
                assert!((track.stated_m(jump.at_m - 1e-7) - jump.back_m).abs() < 1e-6);
            }
            let counted_m = (track.stated_m(LENGTH_M) - track.stated_m(0.0)).abs();
            let sum_m: f64 = longer_m.iter().sum();
            assert!((counted_m + sum_m - LENGTH_M).abs() < 1e-9);
        }
    }
}

/// Provokes: another number stated at the same place because trains run the other way.
#[test]
fn a_place_keeps_what_it_states_when_the_track_is_reversed() {
    for track in tracks() {
        let reversed = track.reversed(LENGTH_M);
        let mut there: Vec<ChainageEquation> = reversed.equations().collect();
        there.reverse();
        assert_eq!(there.len(), track.equations().count());
        for (jump, there) in track.equations().zip(there) {
            assert!((there.at_m + jump.at_m - LENGTH_M).abs() < 1e-9);
            assert!((there.back_m - jump.ahead_m).abs() < 1e-9);
            assert!((there.longer_m - jump.longer_m).abs() < 1e-9);
        }
        let at_jump = |s_m: f64| track.equations().any(|jump| (jump.at_m - s_m).abs() < 1e-9);
        for s_m in places_m().filter(|s_m| !at_jump(*s_m)) {
            let there_m = reversed.stated_m(LENGTH_M - s_m);
            assert!((there_m - track.stated_m(s_m)).abs() < 1e-9, "{s_m}");
        }
    }
}

fn realigned() -> StatedChainage {
    // DK12+640 = DK12+625.3, then DK12+965.55 = DK12+990.55.
    StatedChainage::of(
        &entry(Increment::Increasing, 12_340.0, [-14.7, 25.0]),
        LENGTH_M,
    )
}

#[test]
fn texts_are_as_on_plans() {
    let track = realigned();
    assert_eq!(track.text(0.0, 3), "DK12+340.000");
    assert_eq!(track.text(0.0, 0), "DK12+340");
    assert_eq!(track.text(299.0, 3), "DK12+639.000 R1");
    assert_eq!(track.text(300.0, 3), "DK12+625.300 R2");
    assert_eq!(track.text(699.4501, 1), "DK13+049.8");
    let to_kilometre_m = 640.25 + (13_000.0 - 12_990.55) - 0.0004;
    assert_eq!(track.text(to_kilometre_m, 3), "DK13+000.000");
    let falling = StatedChainage::of(&entry(Increment::Decreasing, 100.5, [0.0, 0.0]), LENGTH_M);
    assert_eq!(falling.text(113.0, 3), "DK-0+012.500");
    assert_eq!(falling.text(100.5, 3), "DK0+000.000");
    let bare = StatedChainage {
        prefix: String::new(),
        ..track
    };
    assert_eq!(bare.text(0.0, 0), "km 12.340");
    assert_eq!(bare.text(0.25, 2), "km 12.34025");
}

/// All ways to write a place that people use.
#[test]
fn texts_are_read_as_people_write_them() {
    let track = realigned();
    for text in [
        "DK12+350",
        " DK12+350.000 ",
        "DK 12+350.0",
        "12+350",
        "km 12.350",
        "km12+350",
        "DK12+350 R1",
        "dk12+350",
        "Km 12.350",
        "dk12+350 r1",
    ] {
        assert!((track.place(text).unwrap() - 10.0).abs() < 1e-9, "{text}");
    }
    assert!((track.place("DK12+630 R1").unwrap() - 290.0).abs() < 1e-9);
    assert!((track.place("DK12+630 R2").unwrap() - 304.7).abs() < 1e-9);
}

/// Fails where a text that names no one place is taken, or the message does not say what would be right.
#[test]
fn what_is_wrong_with_a_text_is_said() {
    let track = realigned();
    for (text, message) in [
        (
            "DK12+630.0",
            "`DK12+630.0` is stated at several places; write one of `DK12+630.000 R1`, `DK12+630.000 R2`",
        ),
        // Left out by the short chain.
        (
            "DK12+970",
            "`DK12+970` is not stated on this track; the nearest: `DK12+965.550` and `DK12+990.550`",
        ),
        (
            "DK12+650 R1",
            "`DK12+650 R1` is not stated on this track; the nearest: `DK12+640.000 R1`",
        ),
        (
            "DK12+000",
            "`DK12+000` is not stated on this track; the nearest: `DK12+340.000`",
        ),
        (
            "DK12+350 R4",
            "`DK12+350 R4` names region R4; this track has 3, counted from R1 at its begin",
        ),
        (
            "ZDK12+350",
            "`ZDK12+350` begins with `ZDK`; on this track write it like `DK12+340.000`",
        ),
    ] {
        assert_eq!(track.place(text).unwrap_err().to_string(), message);
    }
    let unreadable = [
        "",
        "km",
        "DK",
        "12350",
        "DK12.350",
        "DK12+",
        "DK+350",
        "DK12+1350",
        "DK12+3e2",
        "km nan",
        "DK--12+350",
        "DK12+-350",
        "km 1.2.3",
        "DK12+350 R",
        "DK12+350 R1 R1",
        "DK12 350",
    ];
    for text in unreadable {
        let error = track.place(text).unwrap_err();
        assert!(
            matches!(error, ChainageError::Unreadable { .. }),
            "{text}: {error}"
        );
    }
}

/// Fails where something wrong in a file is taken, or is told of another key.
#[test]
fn faults_of_files_are_reported_with_their_keys() {
    let problems = |stated: &str| {
        let text = format!(
            "name = 't'\nstated_chainage = {{ {stated} }}\n[[plan]]\nkind = 'straight'\nlength_m = 1000.0\n"
        );
        match Tunnel::from_toml(&text) {
            Err(crate::settings::FileError::Problems(problems)) => problems,
            Err(error) => vec![crate::settings::Problem::new(
                "syntax",
                error.to_string(),
                "",
            )],
            Ok(_) => Vec::new(),
        }
    };
    let long = "{ chainage_m = 500.0, back_m = 12840.0, ahead_m = 12830.0 }";
    let at = |s_m: f64| format!("{{ chainage_m = {s_m}, ahead_m = 9000.0 }}");
    let right = format!("prefix = 'DK', start_m = 12340.0, equations = [{long}]");
    assert!(problems(&right).is_empty());
    for (stated, key) in [
        ("prefix = 'DK1', start_m = 0.0".to_owned(), "prefix"),
        ("prefix = 'km', start_m = 0.0".to_owned(), "prefix"),
        ("start_m = 2e6".to_owned(), "start_m"),
        (right.replace("500.0", "1000.0"), "equations[0].chainage_m"),
        (right.replace("500.0", "0.0"), "equations[0].chainage_m"),
        (right.replace("500.0", "nan"), "equations[0].chainage_m"),
        (
            format!("start_m = 0.0, equations = [{}, {}]", at(500.0), at(499.0)),
            "equations[1].chainage_m",
        ),
        (
            format!("start_m = 0.0, equations = [{}, {}]", at(500.0), at(500.0)),
            "equations[1].chainage_m",
        ),
        (right.replace("12840.0", "12840.1"), "equations[0].back_m"),
        (right.replace("12830.0", "12840.0"), "equations[0].ahead_m"),
    ] {
        let found = problems(&stated);
        let keys: Vec<&str> = found.iter().map(|p| p.key.as_str()).collect();
        assert_eq!(keys, [format!("stated_chainage.{key}")], "{stated}");
    }
}

/// The chainages of the two lines of the terminus agree where they lie side by side: behind the bends of the left one
/// a long chain takes back by how much it is longer.
#[test]
fn val_what_is_abreast_has_one_number() {
    let text = include_str!("../../../tunnels/terminus.toml");
    let tunnel = Tunnel::from_toml(text).unwrap();
    let named = |name| &tunnel.network.tracks[usize::from(tunnel.network.named(name).unwrap().0)];
    let (right, left) = (named("u1"), named("d1"));
    let [right_stated, left_stated] =
        [right, left].map(|track| track.stated_chainage.as_ref().unwrap());
    for (s_m, agree) in [
        (100.0, true),
        (300.0, true),
        (489.0, false),
        (490.0, true),
        (520.0, true),
    ] {
        let east_m = left.alignment.at(s_m).origin.x;
        let abreast_m = right_stated.stated_m(east_m);
        let off_m = (left_stated.stated_m(s_m) - abreast_m).abs();
        assert_eq!(off_m < 1e-3, agree, "{s_m} m: {off_m}");
    }
}
