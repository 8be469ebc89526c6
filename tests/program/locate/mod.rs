//! `metrotwin locate` on fixes of made and of recorded runs.

mod recorded;
mod recorded_maps;
mod variants;

use crate::program::{content, folder, printed, program, refuses, says, succeeds};
use metrotwin::track::{TrackPoint, Tunnel};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Output;

const TERMINUS: &str = "tunnels/terminus.toml";

/// Runs `locate` on a table of fixes.
fn locate(network: &str, gnss: &Path, out: &Path) -> Output {
    let paths = [gnss, out].map(|path| path.display().to_string());
    let [gnss, out] = &paths;
    let args = ["locate", "--network", network, "--gnss", gnss, "--out", out];
    program(args).output().unwrap()
}

/// Fixes of a train that runs 7 m/s along tracks of the terminus, each from a chainage to another, to the decimetre.
fn fixes(runs: &[(&str, f64, f64)]) -> String {
    let text = include_str!("../../../tunnels/terminus.toml");
    let tunnel = Tunnel::from_toml(text).unwrap();
    let datum = tunnel.datum.unwrap();
    let mut table = String::from("timestamp,latitude,longitude,sigma_north_m,sigma_east_m\n");
    let mut second = 0.0;
    for (name, from_m, to_m) in runs {
        let line = tunnel
            .network
            .alignment(tunnel.network.named(name).unwrap())
            .unwrap();
        for k in 0..((to_m - from_m).abs() / 3.5) as u32 {
            let s_m = from_m + 3.5 * f64::from(k) * (to_m - from_m).signum();
            let at = line.world_from_track(TrackPoint {
                s_m,
                l_m: 0.0,
                h_m: 0.0,
            });
            let place = datum.geodetic(&at);
            let (latitude, longitude) = (place.latitude_deg, place.longitude_deg);
            writeln!(table, "{second:.1},{latitude:.8},{longitude:.8},0.1,0.1").unwrap();
            second += 0.5;
        }
    }
    table
}

/// Provokes: a train that is put onto the wrong track of a depot's fan, and files that are not there.
#[test]
fn a_train_is_located_in_the_depot() {
    let out = folder("located");
    fs::create_dir_all(&out).unwrap();
    let gnss = out.join("fixes.csv");
    fs::write(
        &gnss,
        fixes(&[("lead", 500.0, 700.0), ("depot 1", 0.0, 60.0)]),
    )
    .unwrap();
    let results = out.join("results");
    succeeds(&locate(TERMINUS, &gnss, &results));
    let table = fs::read_to_string(results.join("tracks.csv")).unwrap();
    let last: Vec<&str> = table.lines().last().unwrap().split(',').collect();
    assert_eq!(
        (last[3], last[5], last[6]),
        ("depot 1", "true", "up"),
        "{table}"
    );
    let summary = fs::read_to_string(results.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["visits"][0]["element"], "lead");
    let map = fs::read_to_string(results.join("tracks.geojson")).unwrap();
    let map: serde_json::Value = serde_json::from_str(&map).unwrap();
    assert_eq!(
        map["features"].as_array().unwrap().len(),
        table.lines().count() - 1
    );
}

/// Fails where a table with decimal commas is located otherwise than the same with points, or it is not said.
#[test]
fn a_table_with_decimal_commas_is_taken() {
    let out = folder("decimal_commas");
    let points = fixes(&[("lead", 500.0, 600.0)]);
    let commas = points.replace(',', ";").replace('.', ",");
    let located = [("points", points), ("commas", commas)].map(|(name, table)| {
        let gnss = out.join(name).with_extension("csv");
        fs::write(&gnss, table).unwrap();
        let run = locate(TERMINUS, &gnss, &out.join(name));
        succeeds(&run);
        let is_said = printed(&run).contains("commas.csv were taken for decimal commas");
        assert_eq!(is_said, name == "commas", "{}", printed(&run));
        fs::read_to_string(out.join(name).join("tracks.csv")).unwrap()
    });
    assert_eq!(located[0], located[1]);
}

/// Fails where a file of the results is not listed, a file of others is written over, or results cannot be written
/// again.
#[test]
fn results_are_listed_and_no_file_of_others_is_lost() {
    let out = folder("listed");
    let gnss = out.join("fixes.csv");
    fs::write(&gnss, fixes(&[("lead", 500.0, 550.0)])).unwrap();
    let results = out.join("results");
    for name in ["tracks.csv", "summary.json", "files.txt"] {
        fs::create_dir(&results).unwrap();
        fs::write(results.join(name), "mine").unwrap();
        let run = locate(TERMINUS, &gnss, &results);
        refuses(
            &run,
            "is there already, and this command has not written it",
        );
        says(&run, name);
        let left = content(&results);
        assert!(left.len() == 1 && left[name] == b"mine", "{left:?}");
        fs::remove_dir_all(&results).unwrap();
    }
    fs::create_dir(&results).unwrap();
    fs::write(results.join("notes.txt"), "mine").unwrap();
    for _ in 0..2 {
        succeeds(&locate(TERMINUS, &gnss, &results));
        let written = content(&results);
        let list = String::from_utf8(written["files.txt"].clone()).unwrap();
        let mut listed: Vec<&str> = list
            .lines()
            .skip(1)
            .chain(["files.txt", "notes.txt"])
            .collect();
        listed.sort_unstable();
        assert!(written.keys().eq(listed), "{list}");
        assert_eq!(written["notes.txt"], b"mine");
    }
}

/// Provokes: wrong input that is taken, or refused without its line and a remedy.
#[test]
fn wrong_recordings_are_refused() {
    let out = folder("not_located");
    fs::create_dir_all(&out).unwrap();
    let [gnss, network] = ["fixes.csv", "network.geojson"].map(|name| out.join(name));
    let said = |network: &str, table: &str| {
        fs::write(&gnss, table).unwrap();
        let run = locate(network, &gnss, &out.join("results"));
        assert_eq!(run.status.code(), Some(2), "{run:?}");
        assert!(!out.join("results").exists());
        printed(&run)
    };
    let right = fixes(&[("u1", 0.0, 50.0)]);
    let swapped = right.replacen("latitude,longitude", "longitude,latitude", 1);
    assert!(
        said(TERMINUS, &swapped).contains("not on any railway"),
        "{}",
        said(TERMINUS, &swapped)
    );
    let far = "time,latitude,longitude\n0,50.9,4.5\n";
    assert!(
        said(TERMINUS, far).contains("swapped"),
        "{}",
        said(TERMINUS, far)
    );
    let cut = "time,latitude,longitude\n0,30.55\n";
    assert!(
        said(TERMINUS, cut).contains("line 2"),
        "{}",
        said(TERMINUS, cut)
    );
    assert!(said("tunnels/test_bench.toml", &right).contains("[datum]"));
    fs::write(&network, "{ \"features\": [").unwrap();
    let broken = said(&network.display().to_string(), &right);
    assert!(broken.contains("line 1"), "{broken}");
}
