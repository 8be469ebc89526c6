//! Faults of tunnel files with several tracks.

use super::*;
use crate::track::network::{Joint, MOST_KINK_RAD};
use crate::track::{Direction, Place, TrackId};

const TERMINUS: &str = include_str!("../../../tunnels/terminus.toml");

fn problems(text: &str) -> Vec<Problem> {
    match Tunnel::from_toml(text) {
        Err(FileError::Problems(problems)) => problems,
        Err(other) => panic!("{other}"),
        Ok(_) => Vec::new(),
    }
}

/// Number of a track by its name.
fn named(tunnel: &Tunnel, name: &str) -> TrackId {
    let mut names = tunnel.network.tracks.iter().map(|track| &*track.name);
    TrackId(names.position(|n| n == name).unwrap() as u16)
}

/// Provokes: ends that do not meet, lengths that close at another place than the geometry of two arcs and a
/// straight between tracks 5 m apart has it, a depot at the wrong height.
#[test]
fn val_the_terminus_closes() {
    let tunnel = Tunnel::from_toml(TERMINUS).unwrap();
    let network = &tunnel.network;
    assert_eq!((network.tracks.len(), network.switches.len()), (22, 12));
    for end in network.ends() {
        for next in network.next(end) {
            let [out, back] = [end, next].map(|end| network.leaving(end).unwrap());
            let joint = Joint::of(&out, &back);
            assert!(joint.gap_m.norm() < 1e-9, "{end}: {}", joint.gap_m.norm());
            assert!(joint.kink_rad() < MOST_KINK_RAD, "{end}");
        }
    }
    // Two arcs of 22.13 m and 200 m radius, and as much straight as makes 5 m to the side.
    let turn = 22.13 / 200.0_f64;
    let aside_m = 2.0 * 200.0 * (1.0 - turn.cos());
    let straight_m = (5.0 - aside_m) / turn.sin();
    for name in ["A", "B", "C", "D"] {
        let length_m = network.alignment(named(&tunnel, name)).unwrap().length_m();
        assert!(
            (length_m - (2.0 * 22.13 + straight_m)).abs() < 1e-3,
            "{name} {length_m}"
        );
    }
    let through_m = 2.0 * 200.0 * turn.sin() + straight_m * turn.cos();
    let u2_m = network.alignment(named(&tunnel, "u2")).unwrap().length_m();
    assert!((u2_m - (2.0 * through_m + 20.0)).abs() < 1e-3, "{u2_m}");
    for name in ["depot 1", "depot 5"] {
        let line = network.alignment(named(&tunnel, name)).unwrap();
        assert!(line.at(line.length_m()).origin.z.abs() < 1e-3, "{name}");
    }
}

/// Provokes: a way through the terminus that is longer, or none.
#[test]
fn ways_through_the_terminus() {
    let tunnel = Tunnel::from_toml(TERMINUS).unwrap();
    let network = &tunnel.network;
    let place = |name, s_m| Place {
        track: named(&tunnel, name),
        s_m,
    };
    let names = |from: (Place, Direction), to| {
        let route = network.shortest(from, to)?;
        let names = route.legs().iter();
        Some(
            names
                .map(|leg| &*network.tracks[usize::from(leg.track.0)].name)
                .collect::<Vec<_>>(),
        )
    };
    let up = (place("u1", 100.0), Direction::Up);
    let siding = names(up, place("siding", 170.0)).unwrap();
    assert_eq!(siding, ["u1", "A", "d2", "d3", "d4", "siding"]);
    let from_depot = (place("depot 3", 200.0), Direction::Down);
    let down = names(from_depot, place("d1", 50.0)).unwrap();
    let way = [
        "depot 3", "ladder 2", "ladder 1", "lead", "D", "d4", "d3", "d2", "d1",
    ];
    assert_eq!(down, way);
    assert_eq!(names(up, place("u1", 50.0)), None);
}

/// Provokes: a fault that passes, or is told of another key.
#[test]
fn every_fault_of_a_network_is_reported_with_its_key() {
    let cases: [(&str, &str, &str, &str); 18] = [
        (
            "to = \"W1.toe\"",
            "to = \"W9.toe\"",
            "track[0].to",
            "there is no `W9.toe`",
        ),
        (
            "from = \"W8.toe\"\n",
            "",
            "switches[7].name",
            "the switch dangles",
        ),
        (
            "from = \"W3.through\"",
            "from = \"W3.diverging\"",
            "track[11].from",
            "has this part already",
        ),
        (
            "from = \"W2.toe\"\nto = \"W3.toe\"",
            "from = \"u1.end\"\nto = \"W3.toe\"",
            "track[6].from",
            "joined to something else",
        ),
        (
            "name = \"u2\"",
            "name = \"u1\"",
            "track[1].name",
            "is the name of `track[0]` too",
        ),
        (
            "name = \"u2\"",
            "name = \"u.2\"",
            "track[1].name",
            "has a dot",
        ),
        (
            "plan = [{ kind = \"straight\", length_m = 154.0, closes = true }]\nsections = [{ kind = \"rectangular\", from_m = 0.0, left_m = 7.4, right_m = 2.9 }]\nlamps = { from_m = 5.0, to_m = 145.0, lateral_m = 7.1, first_number = 50 }",
            "plan = [{ kind = \"straight\", length_m = 154.0 }]\nsections = [{ kind = \"rectangular\", from_m = 0.0, left_m = 7.4, right_m = 2.9 }]",
            "track[6].from",
            "m ahead",
        ),
        (
            "turn = \"right\" },\n    { kind = \"straight\", length_m = 23.0",
            "turn = \"left\" },\n    { kind = \"straight\", length_m = 23.0",
            "track[6].to",
            "kink at `d2.end`",
        ),
        (
            "name = \"depot 1\"",
            "name = \"depot 1\"
grades = [{ from_m = 0.0, grade_permille = 10.0 }]",
            "track[4].to",
            "10.000 permille in the profile",
        ),
        (
            "name = \"W1\"",
            "name = \"W1\"\ndiverging_kmh = 60.0",
            "switches[0].diverging_kmh",
            "permit at most 41 km/h",
        ),
        (
            "left_m = 15.9",
            "left_m = 13.0",
            "track[5]",
            "a wall of the section of track `u1`",
        ),
        (
            "left_m = 15.9",
            "left_m = 2.9",
            "track[5]",
            "has room for it: that of `u1` reaches 2.90 m to its left",
        ),
        (
            "    { kind = \"shared\", from_m = 300.0 },",
            "    { kind = \"circular\", from_m = 300.0 },",
            "track[5]",
            "has walls of its own",
        ),
        (
            "lamps = { from_m = 10.0, to_m = 160.0, spacing_m = 6.0, lateral_m = 2.2, first_number = 600 }",
            "lamps = { from_m = 170.0, to_m = 172.0, lateral_m = 5.0, first_number = 600 }",
            "track[2]",
            "a lamp or device stands in the structure gauge of track `d3`",
        ),
        (
            "first_number = 50 }",
            "first_number = 40 }",
            "track[1].lamps.first_number",
            "2-40 is there on track `u1` too",
        ),
        (
            "name = \"B-d3\"",
            "name = \"B-u1\"",
            "track[7].balises[0].name",
            "is there on track `u1` too",
        ),
        (
            "start = { up_m = -14.0 }\n",
            "",
            "track[1].plan[0].closes",
            "no joint decides this length",
        ),
        (
            "name = \"terminus\"",
            "name = \"terminus\"\nplan = [{ kind = \"straight\", length_m = 1.0 }]",
            "plan",
            "beside `[[track]]`",
        ),
    ];
    let mut wrongly_told = Vec::new();
    for (right, wrong, key, said) in cases {
        assert!(TERMINUS.contains(right), "{right}");
        let found = problems(&TERMINUS.replacen(right, wrong, 1));
        let told = |p: &&Problem| p.key == key && p.to_string().contains(said);
        if !found.iter().any(|p| told(&p)) {
            wrongly_told.push((wrong, found));
        }
    }
    assert!(wrongly_told.is_empty(), "{wrongly_told:#?}");
}

/// Provokes: one slip of the pen that is told as several, which follow from it.
#[test]
fn one_wrong_word_is_one_problem() {
    for (right, wrong, key) in [
        ("to = \"W4.through\"", "to = \"W4.trough\"", "track[1].to"),
        ("from = \"W8.toe\"\n", "", "switches[7].name"),
        ("name = \"W2\"", "name = \"W1\"", "switches[1].name"),
        (
            "from = \"W3.through\"",
            "from = \"W3.diverging\"",
            "track[11].from",
        ),
    ] {
        assert!(TERMINUS.contains(right), "{right}");
        let found = problems(&TERMINUS.replacen(right, wrong, 1));
        let keys: Vec<&str> = found.iter().map(|p| &*p.key).collect();
        assert_eq!(keys, [key], "{wrong}: {found:#?}");
    }
    let no_such = JUNCTION.replacen("from = \"W1.diverging\"", "from = \"W2.diverging\"", 1);
    let found = problems(&no_such);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!(found[0].remedy, "did you mean `W1.diverging`?");
    let found = problems(&JUNCTION.replacen("start = { up_m = -14.0 }", "", 1));
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(found[0].key == "track[0].from" && found[0].what.contains("nothing says where"));
}

/// A switch to the left with legs of 300 and 82 m.
const JUNCTION: &str = r#"
    name = "junction"
    switches = [{ name = "W1" }]
    [[track]]
    name = "up"
    start = { up_m = -14.0 }
    to = "W1.toe"
    plan = [{ kind = "straight", length_m = 460.0 }]
    [[track]]
    name = "on"
    from = "W1.through"
    plan = [{ kind = "straight", length_m = 300.0 }]
    sections = [{ kind = "rectangular", from_m = 0.0, left_m = 10.0 }]
    [[track]]
    name = "aside"
    from = "W1.diverging"
    plan = [{ kind = "arc", length_m = 22.13, radius_m = 200.0, turn = "left" }, { kind = "straight", length_m = 60.0 }]
    sections = [{ kind = "shared", from_m = 0.0 }]
"#;

/// Provokes: a `start` too many that is told as a gap or a length somewhere else, or one that fits and is refused.
#[test]
fn a_track_with_two_places_is_told() {
    let with = |start: &str| {
        let from = "from = \"W1.through\"";
        let found = problems(&JUNCTION.replacen(from, &format!("{from}\nstart = {start}"), 1));
        found.into_iter().map(|p| (p.key, p.remedy))
    };
    for start in ["{}", "{ up_m = -14.0 }"] {
        let [(key, remedy)] = &with(start).collect::<Vec<_>>()[..] else {
            panic!("{start}: {:?}", with(start).collect::<Vec<_>>());
        };
        assert!(key == "track[1].start" && remedy.contains("take `start` out"));
    }
    assert_eq!(with("{ east_m = 460.0, up_m = -14.0 }").count(), 0);
    let found = problems(&TERMINUS.replacen(
        "to = \"W4.through\"\n",
        "to = \"W4.through\"\nstart = {}\n",
        1,
    ));
    let keys: Vec<&str> = found.iter().map(|p| &*p.key).collect();
    assert_eq!(keys, ["track[1].start"], "{found:#?}");
}

/// Provokes: a section too narrow for two tracks that does not say how wide it is, or a width that will not do.
#[test]
fn narrow_sections_say_how_wide_they_must_be() {
    let wide = |left_m: &str| problems(&JUNCTION.replacen("10.0", left_m, 1));
    let found = wide("7.4");
    let said = found.iter().find(|p| p.key == "track[2]").unwrap();
    assert!(
        said.what
            .contains("that of `on` reaches 7.40 m to its left")
    );
    let (_, needs) = said.what.split_once("at least ").unwrap();
    let needs = needs.trim_end_matches(" m to hold both");
    assert!(wide(needs).is_empty(), "{said}: {:#?}", wide(needs));
}

/// Provokes: an example of a tunnel file in README that a reader copies, and that is not right.
#[test]
fn examples_of_readme_are_right() {
    let readme = include_str!("../../../README.md");
    let blocks = readme.split("```toml\n").skip(1);
    let blocks = blocks.map(|block| block.split("```").next().unwrap());
    let (mut tunnels, mut keys) = (0, 0);
    for block in blocks {
        // Keys of a track, to which the rest is added.
        let rest = "name = 'x'\nplan = [{ kind = 'straight', length_m = 1000.0 }]\n";
        let text = match block {
            _ if block.contains("[[track]]") => {
                tunnels += 1;
                block.to_owned()
            }
            _ if block.starts_with("stated_chainage") => {
                keys += 1;
                format!("{rest}{block}")
            }
            _ => continue,
        };
        let found = problems(&text);
        assert!(found.is_empty(), "{block}: {found:#?}");
    }
    assert_eq!((tunnels, keys), (1, 1));
}

/// Provokes: a track that touches another one, runs through the rock of its tunnel, or that no train comes to.
#[test]
fn tracks_beside_each_other_have_room() {
    let with = |keys: &str| {
        let track = "plan = [{ kind = \"straight\", length_m = 200.0 }]";
        problems(&format!(
            "{TERMINUS}\n[[track]]\nname = \"x\"\n{track}\n{keys}"
        ))
    };
    assert!(with("start = { north_m = -7.0, up_m = -14.0 }").is_empty());
    for (keys, key, said) in [
        (
            "start = { north_m = -5.0, up_m = -14.0 }",
            "track[0]",
            "overlap",
        ),
        (
            "start = { north_m = -2.5, up_m = -14.0 }",
            "track[0]",
            "trains on both would touch",
        ),
        (
            "start = { north_m = -7.0, up_m = -14.0 }\nfrom = \"buffer\"\nto = \"buffer\"",
            "track[22].name",
            "no train can get there",
        ),
        (
            "from = \"buffer\"",
            "track[22].from",
            "nothing says where this track is",
        ),
    ] {
        let found = with(keys);
        let told = |p: &Problem| p.key == key && p.to_string().contains(said);
        assert!(found.iter().any(told), "{keys}: {found:#?}");
    }
}

/// Provokes: lengths to be solved for that no joint decides, and a solution that is taken though there are others.
#[test]
fn lengths_that_nothing_decides_are_told() {
    let right = "{ kind = \"straight\", length_m = 13.9727 }";
    let both = "{ kind = \"straight\", length_m = 13.9727, closes = true }";
    assert!(TERMINUS.contains(right));
    let found = problems(&TERMINUS.replacen(right, both, 1));
    for key in ["track[5].plan[4].closes", "track[10].plan[1].closes"] {
        assert!(found.iter().any(|p| p.key == key), "{found:#?}");
    }
}

/// Provokes: a panic, a hang, or lengths without end where numbers are odd.
#[test]
fn no_number_of_a_network_makes_it_panic() {
    for (at, m) in TERMINUS.match_indices(" = ").step_by(3) {
        let rest = &TERMINUS[at + m.len()..];
        let end = rest.find([',', ' ', '\n']).unwrap_or(rest.len());
        if rest[..end].parse::<f64>().is_err() {
            continue;
        }
        for odd in ["nan", "-inf", "-1.0", "0.0", "1e300", "65535"] {
            let text = format!("{}{odd}{}", &TERMINUS[..at + m.len()], &rest[end..]);
            if let Ok(tunnel) = Tunnel::from_toml(&text) {
                for track in &tunnel.network.tracks {
                    assert!(track.alignment.at(1.0).origin.x.is_finite());
                }
            }
        }
    }
}
