//! From the file as written to a [`Track`]: every number checked, every problem collected.

mod chainage;
mod crossings;
mod devices;
mod findings;
mod joints;
mod lamps;
mod line;

mod neighbours;
mod places;
mod placing;
mod sections;
mod switches;
mod whole;

pub(super) use neighbours::in_the_way;

use super::file::{DatumEntry, TrackEntry, TunnelFile};
use super::gauge::Gauge;
use super::network::Network;
use super::section::OutlinePoint;
use super::{Alignment, Track, TrackId, Tunnel};
use crate::settings::{Checker, FileError, Problem, Settings, read_settings};
use std::sync::Arc;

/// Chainages closer than this are the same place.
const SAME_M: f64 = 1e-6;

impl Tunnel {
    /// Reads and checks the text of a tunnel file. [`locate`](crate::settings::locate) finds the
    /// keys of the problems in the text again.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        let mut problems = Vec::new();
        let file = read_settings(text).map_err(of_tunnel)?;
        match check(&file, &mut problems) {
            Some(tunnel) if problems.is_empty() => Ok(tunnel),
            _ => Err(FileError::Problems(problems)),
        }
    }
}

/// Whose `name` is missing, which tracks and switches have too.
fn of_tunnel(mut error: FileError) -> FileError {
    if let FileError::Problems(problems) | FileError::FirstProblems(problems) = &mut error {
        let missing = (problems.iter_mut()).find(|p| p.key == "name" && p.is_missing());
        if let Some(problem) = missing {
            let remedy = "give the tunnel one at the top of the file, before the first table: `name = \"a line\"`";
            *problem = Problem::new("name", "that of the tunnel is missing", remedy);
        }
    }
    error
}

/// None where it is not known where its tracks are, which is a problem.
pub(super) fn check(file: &TunnelFile, problems: &mut Vec<Problem>) -> Option<Tunnel> {
    file.check("", problems);
    let check = &mut Checker::new("", problems);
    let entries = file.tracks();
    let joints = joints::joints(file, &entries, check)?;
    let lines = places::lines(file, &entries, &joints, check)?;
    let tracks = entries.iter().zip(lines).enumerate();
    let tracks = tracks.map(|(k, (entry, line))| {
        let check = &mut check.below(&key_of(file, k));
        Arc::new(track(file, entry, line, check))
    });
    let tracks: Vec<Arc<Track>> = tracks.collect();
    let named = tracks.clone();
    let mut network = Network::new(tracks, joints.switches, joints.ends).unwrap_or_else(|error| {
        // What is wrong has been said in full, where the file says it.
        if check.is_right("") {
            check.problem("track", error.to_string(), "join the tracks in another way");
        }
        Network::unjoined(named)
    });
    // Where tracks are not where they should be, all else follows from that.
    if check.is_right("") {
        switches::check_switches(&network, check);
        let crossings = crossings::crossings(&file.crossings, &network, file.slack_m(), check);
        network = network.with_crossings(crossings);
        // What is said of a crossing that is not as it should be says also why trains would touch there.
        if check.is_right("crossings") {
            let key = |track: TrackId| key_of(file, track.0.into());
            neighbours::check_neighbours(&network, file.slack_m(), key, check);
        }
        whole::check_names(&network, check);
        whole::check_reach(&network, check);
    }
    Some(Tunnel {
        name: file.name.clone(),
        datum: file.datum.as_ref().map(DatumEntry::datum),
        line_number: file.line_number,
        network,
    })
}

/// Key of a track in the file; none for the only one, whose keys are the file's.
fn key_of(file: &TunnelFile, track: usize) -> String {
    match file.track.is_empty() {
        true => String::new(),
        false => format!("track[{track}]"),
    }
}

/// A track with what stands along it.
fn track(
    file: &TunnelFile,
    entry: &TrackEntry,
    alignment: Alignment,
    check: &mut Checker<'_>,
) -> Track {
    let sections = sections::sections(&entry.sections, alignment.length_m(), check);
    let stated_chainage = chainage::stated(entry, alignment.length_m(), check);
    let mut track = Track {
        name: entry.name.clone(),
        alignment,
        stated_chainage,
        sections,
        lamps: Vec::new(),
        wayside: entry.wayside.clone(),
        balises: entry.balises.clone(),
        base_stations: entry.base_stations.clone(),
        stations: entry.stations.clone(),
        ambient_lx: entry.ambient_lx.unwrap_or(file.ambient_lx),
        daylight_lx: file.daylight_lx,
    };
    track.lamps = lamps::place(entry, file.line_number, &track, check);
    devices::check_wayside(&track, check);
    devices::check_named(&track, check);
    track
}

/// Whether a chainage is on the line; a problem if not.
fn on_line(key: &str, s_m: f64, track: &Track, check: &mut Checker<'_>) -> bool {
    let length_m = track.alignment.length_m();
    let on = (-SAME_M..=length_m + SAME_M).contains(&s_m);
    if !on {
        check.problem(
            key,
            format!("{s_m} m is outside of the line"),
            format!("give 0 to {length_m} m"),
        );
    }
    on
}

/// A problem where any of some points (l, h) lies in the rock or where the train runs.
fn free_standing(
    key: &str,
    track: &Track,
    s_m: f64,
    points: &[OutlinePoint],
    check: &mut Checker<'_>,
) {
    let Some(section) = track.section_at(s_m) else {
        return;
    };
    let gauge = Gauge::b1(track.alignment.at(s_m).curvature_per_m);
    if let Some(p) = points.iter().find(|p| !section.contains(p.l_m, p.h_m)) {
        check.problem(
            key,
            format!(
                "at chainage {s_m} m its point l = {:.3} m, h = {:.3} m is inside the rock, {:.3} m \
                 behind the wall",
                p.l_m,
                p.h_m,
                section.distance_m(p.l_m, p.h_m)
            ),
            "move it into the tunnel: smaller `lateral_m`, or another `height_m`",
        );
    } else if let Some(p) = points.iter().find(|p| gauge.contains(p.l_m, p.h_m)) {
        check.problem(
            key,
            format!(
                "at chainage {s_m} m its point l = {:.3} m, h = {:.3} m is inside the structure gauge",
                p.l_m, p.h_m
            ),
            "move it towards the wall: larger `lateral_m`",
        );
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
mod crossing_tests;

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
mod network_tests;

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::TrackPoint;
    use std::sync::Arc;

    const CHENGDU: &str = include_str!("../../../tunnels/chengdu_line1.toml");
    const BENCH: &str = include_str!("../../../tunnels/test_bench.toml");

    fn track(text: &str) -> Arc<Track> {
        Tunnel::from_toml(text).unwrap().first_track().clone()
    }

    fn problems(text: &str) -> Vec<Problem> {
        match Tunnel::from_toml(text) {
            Err(FileError::Problems(problems)) => problems,
            Err(other) => panic!("{other}"),
            Ok(_) => Vec::new(),
        }
    }

    /// Distances of the paper's rig: its camera hangs 1.7 m aside of the lamps and 1.5 m below.
    #[test]
    fn val_shipped_tunnels_have_the_figures_of_the_paper() {
        let line = track(CHENGDU);
        assert_eq!(line.lamps.len(), 299);
        assert!((line.alignment.length_m() - 3000.0).abs() < 1e-12);
        for pair in line.lamps.windows(2) {
            assert!((pair[1].chainage_m - pair[0].chainage_m - 10.0).abs() < 1e-9);
            assert_eq!(pair[1].uid.lamp, pair[0].uid.lamp + 1);
        }
        for device in &line.wayside {
            let ahead_m = device.chainage_m - line.balise(&device.balise).unwrap().chainage_m;
            assert!((300.0..=500.0).contains(&ahead_m));
        }
        let bench = track(BENCH);
        assert!((bench.lamps[2].chainage_m - 200.0).abs() < 1e-9);
        for lamp in line.lamps.iter().chain(&bench.lamps) {
            let camera = (lamp.lateral_m - 1.7, lamp.height_m - 1.5);
            assert!(camera.0.abs() < 1.4 && (1.1..3.8).contains(&camera.1));
            assert!((lamp.power_w - 21.0).abs() < 1e-12 && (lamp.beam_deg - 60.0).abs() < 1e-12);
        }
    }

    /// Provokes: a lamp that faces the wall, or trains that go away from it.
    #[test]
    fn lamps_face_the_trains_that_come() {
        let line = track(CHENGDU);
        for lamp in &line.lamps {
            let back = TrackPoint {
                s_m: lamp.chainage_m - 5.0,
                l_m: 1.0,
                h_m: 1.7,
            };
            let to_camera = line.alignment.world_from_track(back) - lamp.centre;
            assert!(lamp.facing.dot(&to_camera.normalize()) > 30f64.to_radians().cos());
            let at = line
                .alignment
                .track_from_world(&lamp.centre, lamp.chainage_m);
            assert!((at.s_m - lamp.chainage_m).abs() < 1e-9);
            assert!((at.l_m - 2.70).abs() < 1e-9 && (at.h_m - 3.20).abs() < 1e-9);
        }
    }

    /// Clothoids take their ends from their neighbours, and cant goes with curvature.
    #[test]
    fn clothoids_join_their_neighbours() {
        let line = &track(CHENGDU).alignment;
        let middle = line.at(430.0);
        assert!((middle.curvature_per_m - 0.5 / 500.0).abs() < 1e-12);
        assert!((middle.roll_rad + (0.05f64 / 1.5).asin()).abs() < 1e-12);
        assert!((line.at(1900.0).curvature_per_m + 1.0 / 350.0).abs() < 1e-15);
    }

    /// Provokes: a checker that stops at the first fault, or that passes one of them.
    #[test]
    fn every_fault_is_reported_with_its_key() {
        let cases: [(&str, &str, &str); 16] = [
            ("spacing_m = 10.0", "spacing_mm = 10.0", "lamps.spacing_mm"),
            ("radius_m = 500.0", "radius_m = -500.0", "plan[2].radius_m"),
            (
                "from_m = 60.0",
                "from_m = 60.0\nto_m = 200.0",
                "sections[2].from_m",
            ),
            ("lateral_m = 2.70", "lateral_m = 2.95", "lamps"),
            ("lateral_m = 2.70", "lateral_m = 1.20", "lamps"),
            ("spacing_m = 10.0", "spacing_m = 2.0", "lamps.spacing_m"),
            (
                "balise = \"B1110\"",
                "balise = \"B1111\"",
                "wayside[0].balise",
            ),
            (
                "chainage_m = 2000.0",
                "chainage_m = 3200.0",
                "balises[2].chainage_m",
            ),
            (
                "grade_permille = 28.0",
                "grade_permille = 72.0",
                "grades[4].grade_permille",
            ),
            (
                "vertical_radius_m = 3000.0",
                "vertical_radius_m = 90000.0",
                "grades[2].from_m",
            ),
            ("cant_mm = 100.0", "cant_mm = 180.0", "plan[2].cant_mm"),
            ("line_number = 1", "line_number = 16", "line_number"),
            ("name = \"B2600\"", "name = \"B2000\"", "balises[3].name"),
            (
                "first_number = 1",
                "first_number = \"x\"",
                "lamps.first_number",
            ),
            ("turn = \"left\"", "turn = \"lefd\"", "plan[2].turn"),
            (
                "platform = \"right\"",
                "radius_m = 3.0",
                "sections[1].radius_m",
            ),
        ];
        for (right, wrong, key) in cases {
            assert!(CHENGDU.contains(right), "{right}");
            let text = CHENGDU.replacen(right, wrong, 1);
            let found = problems(&text);
            assert!(found.iter().any(|p| p.key == key), "{wrong}: {found:?}");
        }
    }

    /// Provokes: faults of different tables that hide each other.
    #[test]
    fn faults_are_collected() {
        let text = CHENGDU
            .replacen("radius_m = 500.0", "radius_m = -500.0", 1)
            .replacen("grade_permille = 28.0", "grade_permille = 72.0", 1)
            .replacen("lateral_m = 2.70", "lateral_m = 2.95", 1)
            .replacen("balise = \"B1110\"", "balise = \"B1111\"", 1);
        let found = problems(&text);
        assert_eq!(found.len(), 4, "{found:#?}");
        for p in &found {
            assert!(crate::settings::locate(&text, &p.key).is_some());
        }
        assert!(found.iter().any(|p| p.remedy == "did you mean \"B1110\"?"));
    }

    /// Provokes: a missing name of the tunnel that is taken for that of a switch.
    #[test]
    fn the_tunnel_needs_a_name_at_the_top() {
        let found = problems("[[switches]]\nname = 'W1'\n");
        assert_eq!(found.len(), 1, "{found:#?}");
        let said = found[0].to_string();
        assert!(said.contains("that of the tunnel") && said.contains("before the first table"));
    }

    /// Provokes: a key by a wrong name that is told twice, or without the right one.
    #[test]
    fn wrong_units_of_lengths_are_told_once() {
        let text = CHENGDU.replacen("length_m", "length_km", 1);
        let found = problems(&text);
        assert_eq!(found.len(), 1, "{found:#?}");
        assert_eq!(found[0].key, "plan[0].length_km");
        assert_eq!(found[0].remedy, "did you mean `length_m`?");
    }

    #[test]
    fn single_lamps_are_checked_too() {
        let more = |lamp: &str| problems(&format!("{CHENGDU}\n[[lamp]]\n{lamp}"));
        let found = more("number = 7\nchainage_m = 1234.0");
        assert_eq!(found[0].key, "lamp[0].number");
        let found = more("number = 1024\nchainage_m = 4321.0");
        assert_eq!(found.len(), 2);
        assert_eq!(
            more("number = 500\nchainage_m = 1234.0\nlateral_m = -0.5")[0].key,
            "lamp[0]"
        );
        assert!(more("number = 500\nchainage_m = 1234.0\nlateral_m = -2.6").is_empty());
    }

    /// Provokes: a panic, a hang or a huge allocation by any number of a file.
    #[test]
    fn no_number_makes_it_panic() {
        for text in [CHENGDU, BENCH] {
            for (at, _) in text.match_indices(" = ").map(|(at, m)| (at + m.len(), m)) {
                let rest = &text[at..];
                let end = rest.find(['\n', ' ']).unwrap_or(rest.len());
                if rest[..end].parse::<f64>().is_err() {
                    continue;
                }
                for odd in [
                    "nan", "inf", "-inf", "-1.0", "0.0", "1e300", "1e-300", "65535",
                ] {
                    let odd_text = format!("{}{odd}{}", &text[..at], &rest[end..]);
                    if let Ok(tunnel) = Tunnel::from_toml(&odd_text) {
                        let line = &tunnel.first_track().alignment;
                        assert!(line.at(0.5 * line.length_m()).origin.x.is_finite());
                    }
                }
            }
        }
    }

    /// Provokes: a mined section whose arch cannot be built, refused keys, and the defaults.
    #[test]
    fn every_kind_of_section_is_read() {
        let line = "name = 't'\n[[plan]]\nkind = 'straight'\nlength_m = 50.0\n";
        let with = |section: &str| format!("{line}[[sections]]\nfrom_m = 0.0\n{section}");
        for kind in ["circular", "horseshoe", "rectangular", "open"] {
            let track = track(&with(&format!("kind = '{kind}'")));
            let section = track.section_at(25.0).unwrap();
            assert_eq!(section.closed, kind != "open");
            assert!(section.contains(0.0, 3.0) && !section.contains(0.0, -1.0));
        }
        let key = |section: &str| problems(&with(section))[0].key.clone();
        assert_eq!(
            key("kind = 'horseshoe'\nspringing_m = 4.8"),
            "sections[0].springing_m"
        );
        assert_eq!(
            key("kind = 'open'\nwalkway = 'left'"),
            "sections[0].walkway"
        );
        assert_eq!(
            key("kind = 'rectangular'\nplatform_edge_m = 1.5"),
            "sections[0].platform_edge_m"
        );
        assert_eq!(
            key("kind = 'rectangular'\nplatform = 'left'\nwalkway = 'left'"),
            "sections[0].walkway"
        );
    }
}
