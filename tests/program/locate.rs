//! `metrotwin locate` on recorded fixes.

use crate::program::{folder, printed, program, succeeds};
use metrotwin::track::import::OsmImport;
use metrotwin::track::plan::ElementEnd;
use metrotwin::track::{Direction, TrackPoint, Tunnel};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;

/// Fixes of a train that runs 7 m/s along tracks of the terminus, each from a chainage to another, to the decimetre.
fn fixes(runs: &[(&str, f64, f64)]) -> String {
    let text = include_str!("../../tunnels/terminus.toml");
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
    let [gnss, results] = [gnss, out.join("results")].map(|path| path.display().to_string());
    let run = program([
        "locate",
        "--network",
        "tunnels/terminus.toml",
        "--gnss",
        &gnss,
        "--out",
        &results,
    ])
    .output()
    .unwrap();
    succeeds(&run);
    let table = fs::read_to_string(format!("{results}/tracks.csv")).unwrap();
    let last: Vec<&str> = table.lines().last().unwrap().split(',').collect();
    assert_eq!(
        (last[3], last[5], last[6]),
        ("depot 1", "true", "up"),
        "{table}"
    );
    let summary = fs::read_to_string(format!("{results}/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["visits"][0]["element"], "lead");
    let map = fs::read_to_string(format!("{results}/tracks.geojson")).unwrap();
    let map: serde_json::Value = serde_json::from_str(&map).unwrap();
    assert_eq!(
        map["features"].as_array().unwrap().len(),
        table.lines().count() - 1
    );
}

/// Provokes: wrong input that is taken, or refused without its line and a remedy.
#[test]
fn wrong_recordings_are_refused() {
    let out = folder("not_located");
    fs::create_dir_all(&out).unwrap();
    let [gnss, network] = ["fixes.csv", "network.geojson"].map(|name| out.join(name));
    let said = |network: &str, table: &str| {
        fs::write(&gnss, table).unwrap();
        let gnss = gnss.display().to_string();
        let results = out.join("results").display().to_string();
        let run = program([
            "locate",
            "--network",
            network,
            "--gnss",
            &gnss,
            "--out",
            &results,
        ])
        .output()
        .unwrap();
        assert_eq!(run.status.code(), Some(2), "{run:?}");
        assert!(!out.join("results").exists());
        printed(&run)
    };
    let right = fixes(&[("u1", 0.0, 50.0)]);
    let terminus = "tunnels/terminus.toml";
    let swapped = right.replacen("latitude,longitude", "longitude,latitude", 1);
    assert!(
        said(terminus, &swapped).contains("not on any railway"),
        "{}",
        said(terminus, &swapped)
    );
    let far = "time,latitude,longitude\n0,50.9,4.5\n";
    assert!(
        said(terminus, far).contains("swapped"),
        "{}",
        said(terminus, far)
    );
    let cut = "time,latitude,longitude\n0,30.55\n";
    assert!(
        said(terminus, cut).contains("line 2"),
        "{}",
        said(terminus, cut)
    );
    assert!(said("tunnels/test_bench.toml", &right).contains("[datum]"));
    fs::write(&network, "{ \"features\": [").unwrap();
    let broken = said(&network.display().to_string(), &right);
    assert!(broken.contains("line 1"), "{broken}");
}

/// The folder with recorded runs and maps of others, which cannot be distributed.
fn recorded() -> std::path::PathBuf {
    let folder = std::env::var_os("METROTWIN_RECORDED");
    folder
        .expect("METROTWIN_RECORDED names a folder with maps/ and occupancy/")
        .into()
}

/// Every junction of a map of a region is something, and no train turns at one.
#[test]
#[ignore = "needs METROTWIN_RECORDED, a folder with maps/*_osm.json that may not be distributed; \
    track::import::junction and track::import::osm test the same on drawn junctions and a small map"]
fn recorded_maps_are_read() {
    for entry in fs::read_dir(recorded().join("maps")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.ends_with("_osm.json") {
            continue;
        }
        let import = OsmImport::from_json(&fs::read_to_string(&path).unwrap(), None).unwrap();
        println!(
            "{name}: {:.1} km, {} ways, {} elements, {:?}, unclear {:?}, left out {:?}, cut {}",
            import.length_m / 1000.0,
            import.ways,
            import.map.network.elements.len(),
            import.junctions,
            import.unclear,
            import.left_out,
            import.cut.len()
        );
        let network = &import.map.network;
        for element in 0..network.elements.len() {
            for way in [Direction::Up, Direction::Down] {
                let end = ElementEnd { element, way };
                let leaves = |end: ElementEnd, reach_m: f64| {
                    let element = &network.elements[end.element];
                    let m = match end.way {
                        Direction::Up => element.length_m() - reach_m.min(element.length_m()),
                        Direction::Down => reach_m.min(element.length_m()),
                    };
                    element.at(m).0
                };
                for next in network.onward(end) {
                    let at = leaves(end, 0.0);
                    let before = at - leaves(end, 15.0);
                    let after = leaves(next.opposite(), 15.0) - at;
                    let turn = before.angle(&after).to_degrees();
                    assert!(
                        turn <= 90.5,
                        "{name}: element {element} turns by {turn} degrees"
                    );
                }
            }
        }
    }
}

/// What is known of a recorded run: from a second to another it was on one of some elements.
type KnownRun = Vec<(f64, f64, Vec<String>)>;

/// Known elements by run, of a table run, from_s, to_s, element; elements that cannot be told apart by hand are
/// joined by `|`.
fn known_runs(path: &std::path::Path) -> BTreeMap<String, KnownRun> {
    let mut known: BTreeMap<String, KnownRun> = BTreeMap::new();
    let text = fs::read_to_string(path).unwrap_or_default();
    for row in text.lines().skip(1) {
        let columns: Vec<&str> = row.split(',').collect();
        let seconds = |k: usize| columns[k].parse::<f64>().unwrap();
        let elements = columns[3].split('|').map(str::to_owned).collect();
        let run = known.entry(columns[0].to_owned()).or_default();
        run.push((seconds(1), seconds(2), elements));
    }
    known
}

/// Fixes of each class of a table of tracks: wrong confident, wrong fairly confident, wrong undecided, right
/// undecided, fairly confident, confident; and those without a decision.
fn classes(tracks: &str, known: &KnownRun) -> [usize; 7] {
    let mut classes = [0; 7];
    for row in tracks.lines().skip(1) {
        let columns: Vec<&str> = row.split(',').collect();
        let second: f64 = columns[0].parse().unwrap();
        // Between two rows, either.
        let mut at = known
            .iter()
            .filter(|(from_s, to_s, _)| (from_s - 0.45..to_s + 0.45).contains(&second));
        let right = at.any(|(_, _, elements)| elements.iter().any(|e| e == columns[3]));
        let sure = match (columns[5], columns[4].parse::<f64>()) {
            (_, Err(_)) => {
                classes[6] += 1;
                continue;
            }
            ("true", _) => 2,
            (_, Ok(probability)) => usize::from(probability > 0.9),
        };
        classes[if right { 3 + sure } else { 2 - sure }] += 1;
    }
    classes
}

/// No decision on a recorded run is both certain and wrong. What was really run comes from `occupancy/truth.csv`;
/// runs that it does not hold are only located.
#[test]
#[ignore = "needs METROTWIN_RECORDED, a folder with occupancy/network_*.geojson, log_RUN_*.csv and truth.csv that may \
    not be distributed; stack::occupancy and sessions::occupancy test the same on made fixes"]
fn recorded_runs_are_never_wrong_with_certainty() {
    let folder = recorded().join("occupancy");
    let files = || fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap());
    let begins = |name: &'static str| {
        let mut paths: Vec<_> = files()
            .filter(|file| file.file_name().to_string_lossy().starts_with(name))
            .map(|file| file.path())
            .collect();
        paths.sort();
        paths
    };
    let network = begins("network").remove(0).display().to_string();
    let known = known_runs(&folder.join("truth.csv"));
    let out = self::folder("recorded_runs");
    println!("run       wc    wf    wu    cu    cf    cc  none  us a fix: p50, p99");
    for gnss in begins("log_")
        .iter()
        .filter(|path| path.extension().is_some_and(|e| e == "csv"))
    {
        let name = gnss.file_stem().unwrap().to_string_lossy().into_owned();
        let run = name.split('_').nth(1).unwrap();
        let [gnss, results] = [gnss.clone(), out.join(run)].map(|path| path.display().to_string());
        let located = program([
            "locate",
            "--network",
            &network,
            "--gnss",
            &gnss,
            "--out",
            &results,
        ]);
        succeeds(&{ located }.output().unwrap());
        let summary = fs::read_to_string(format!("{results}/summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
        let Some(known) = known.get(run) else {
            println!("{run}: nothing known, {}", summary["identified"]);
            continue;
        };
        let tracks = fs::read_to_string(format!("{results}/tracks.csv")).unwrap();
        let classes = classes(&tracks, known);
        let counts = classes.map(|count| format!("{count:5}")).join(" ");
        let cost = &summary["us_per_fix"];
        println!(
            "{run:6} {counts} {:.0} {:.0}",
            cost["p50"].as_f64().unwrap(),
            cost["p99"].as_f64().unwrap()
        );
        assert_eq!(classes[0], 0, "{run}: wrong with certainty");
    }
}
