//! `metrotwin import` and what it writes, read by `check`, `export` and `locate`.

use crate::program::{content, folder, printed, program, refuses, says, succeeds};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Output;

/// A line of 800 m with a siding on its left, as raw JSON of OpenStreetMap: the siding leaves at 200 m on a radius of
/// some 300 m, runs 5 m beside the line, and comes back at 600 m.
fn siding() -> String {
    let mut nodes = String::new();
    let mut add = |id: u32, x_m: f64, y_m: f64| {
        // Metres of a degree at this latitude.
        let (lat, lon) = (48.2 + y_m / 111_200.0, 15.6 + x_m / 74_330.0);
        write!(
            nodes,
            "{{\"type\":\"node\",\"id\":{id},\"lat\":{lat:.9},\"lon\":{lon:.9}}},"
        )
        .unwrap();
    };
    for k in 0..=40 {
        add(k, 20.0 * f64::from(k), 0.0);
    }
    // Two arcs of opposite hands, each of 38.6 m, from the line and to 5 m beside it.
    let radius_m = 300.0;
    let half_m = 38.6;
    let away = |m: f64| match m {
        m if m < half_m => m * m / (2.0 * radius_m),
        m if m < 2.0 * half_m => 5.0 - (2.0 * half_m - m).powi(2) / (2.0 * radius_m),
        _ => 5.0,
    };
    for k in 1..40 {
        let m = 10.0 * f64::from(k);
        add(100 + k, 200.0 + m, away(m).min(away(400.0 - m)));
    }
    let line: Vec<String> = (0..=40).map(|k| k.to_string()).collect();
    let siding: Vec<String> = (1..40).map(|k| (100 + k).to_string()).collect();
    let ways = format!(
        "{{\"type\":\"way\",\"id\":1,\"nodes\":[{}],\"tags\":{{\"railway\":\"rail\"}}}},\
         {{\"type\":\"way\",\"id\":2,\"nodes\":[10,{},30],\"tags\":{{\"railway\":\"rail\",\"maxspeed\":\"40\"}}}}",
        line.join(","),
        siding.join(",")
    );
    format!("{{\"elements\":[{nodes}{ways}]}}")
}

const RAILML: &str = r#"<railml version="2.2" xmlns="http://www.railml.org/schemas/2013"><infrastructure><tracks>
 <track id="a"><trackTopology>
  <trackBegin id="ab" pos="0"><geoCoord coord="50.9 4.48" epsgCode="4326"/><openEnd id="o1"/></trackBegin>
  <trackEnd id="ae" pos="281.4"><geoCoord coord="50.9 4.484" epsgCode="4326"/><openEnd id="o2"/></trackEnd>
 </trackTopology></track>
</tracks></infrastructure></railml>"#;

const ALIGNMENT: &str = "\
chainage_m;element;radius_m;turn;cant_mm;grade_permille
12000,0;straight;;;;-3,0
12150,0;clothoid;;;;
12200,0;arc;500,0;right;60;
12400,0;clothoid;;;;
12450,0;straight;;;;2,0
12700,0;end;;;;
";

fn import(folder: &Path, format: &str, file: &str, text: &str, more: &[&str]) -> Output {
    fs::write(folder.join(file), text).unwrap();
    let out = folder.join("out.toml").display().to_string();
    let file = folder.join(file).display().to_string();
    let args = ["import", format, &file, "--out", &out];
    program(args.iter().chain(more)).output().unwrap()
}

fn checked(folder: &Path) -> String {
    let check = program(["check", &folder.join("out.toml").display().to_string()])
        .output()
        .unwrap();
    succeeds(&check);
    printed(&check)
}

/// Provokes: a file that does not pass its checks, switches or lengths that are lost, a map that is read as another one.
#[test]
fn a_map_of_openstreetmap_is_a_tunnel() {
    let folder = folder("imported_osm");
    let report = folder.join("report.json").display().to_string();
    let run = import(
        &folder,
        "osm",
        "map.json",
        &siding(),
        &["--report", &report],
    );
    succeeds(&run);
    says(&run, "4 tracks, 1.200 km, 2 switches, 0 crossings");
    says(&run, "in tunnel: 0.000 km of the tracks, 0 of the switches");
    says(
        &run,
        "latitude 48.20000 to 48.20004, longitude 15.60000 to 15.61076 degrees",
    );
    let said = checked(&folder);
    assert!(said.contains("to the left, 40 km/h"), "{said}");
    let text = fs::read_to_string(folder.join("out.toml")).unwrap();
    assert!(text.contains("Open Database License"), "{text}");
    let report: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(report).unwrap()).unwrap();
    let left_out = report["left_out"].as_array().unwrap();
    assert!(
        left_out.len() == 1 && left_out[0]["what"] == "1 speeds",
        "{report}"
    );
    for track in report["tracks"].as_array().unwrap() {
        assert!(track["most_m"].as_f64().unwrap() < 0.75, "{track}");
    }
    // It is read again as GeoJSON, on the same place of the earth.
    let [map, tunnel] =
        ["out.geojson", "out.toml"].map(|name| folder.join(name).display().to_string());
    succeeds(
        &program(["export", "geojson", &tunnel, "--out", &map])
            .output()
            .unwrap(),
    );
    let gnss = folder.join("fixes.csv");
    let fixes: String = (0..60)
        .map(|k| {
            format!(
                "{k},48.2,{:.9},0.5,0.5\n",
                15.6 + 5.0 * f64::from(k) / 74_330.0
            )
        })
        .collect();
    fs::write(
        &gnss,
        format!("timestamp,latitude,longitude,sigma_north_m,sigma_east_m\n{fixes}"),
    )
    .unwrap();
    let gnss = gnss.display().to_string();
    let json = folder.join("map.json").display().to_string();
    for network in [&map, &tunnel, &json] {
        let out = folder.join("located").display().to_string();
        let args = [
            "locate",
            "--network",
            network,
            "--gnss",
            &gnss,
            "--out",
            &out,
        ];
        let run = program(args).output().unwrap();
        succeeds(&run);
        says(&run, "60 fixes on 4 elements");
    }
    // A part of it.
    let run = import(
        &folder,
        "osm",
        "map.json",
        &siding(),
        &["--around", "48.2,15.6", "--radius-m", "150", "--force"],
    );
    succeeds(&run);
    says(&run, "1 tracks, 0.140 km, 0 switches");
}

/// Fails where what the map has in tunnels is counted as in the open, or the other way round.
#[test]
fn what_lies_in_tunnels_is_counted() {
    let folder = folder("imported_tunnels");
    let report = folder.join("report.json").display().to_string();
    // Both legs at the first switch begin in the open; the line before it is cut off and in a tunnel.
    let first: Vec<String> = (0..=10).map(|k| k.to_string()).collect();
    let nodes = format!("\"nodes\":[{},", first.join(","));
    let cut = format!(
        "\"nodes\":[{}],\"tags\":{{\"railway\":\"rail\",\"tunnel\":\"yes\"}}}},\
         {{\"type\":\"way\",\"id\":3,\"nodes\":[10,",
        first.join(",")
    );
    let map = siding();
    assert!(map.contains(&nodes));
    let run = import(
        &folder,
        "osm",
        "map.json",
        &map.replacen(&nodes, &cut, 1),
        &["--report", &report],
    );
    succeeds(&run);
    says(&run, "1.200 km, 2 switches");
    says(&run, "in tunnel: 0.200 km of the tracks, 1 of the switches");
    let report: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(report).unwrap()).unwrap();
    assert_eq!(report["in_tunnel"]["switches"], 1);
    checked(&folder);
}

#[test]
fn tables_are_a_tunnel() {
    let folder = folder("imported_csv");
    let lamps = folder.join("lamps.csv");
    fs::write(&lamps, "chainage_m,uid\n12010,1-001\n12020,1-002\n").unwrap();
    let lamps = lamps.display().to_string();
    let more = [
        "--lamps",
        &lamps,
        "--datum",
        "30.657,104.066",
        "--heading-deg",
        "90",
    ];
    let run = import(&folder, "csv", "line.csv", ALIGNMENT, &more);
    succeeds(&run);
    says(
        &run,
        "700.000 m, 5 elements, 2 grades, 2 lamps; in a tunnel",
    );
    let said = checked(&folder);
    assert!(
        said.contains("km 12.000") && said.contains("tightest radius 500 m"),
        "{said}"
    );
    let run = import(
        &folder,
        "csv",
        "line.csv",
        ALIGNMENT,
        &["--open", "--force"],
    );
    succeeds(&run);
    says(&run, "0 lamps; in the open");
    let written = fs::read_to_string(folder.join("out.toml")).unwrap();
    assert!(written.contains("\"open\""), "{written}");
    checked(&folder);
}

#[test]
fn railml_is_a_tunnel() {
    let folder = folder("imported_railml");
    let run = import(&folder, "railml", "line.railml", RAILML, &[]);
    succeeds(&run);
    says(&run, "1 tracks, 0.281 km");
    checked(&folder);
}

/// Provokes: wrong input that is taken, refused without its place and a remedy, or that leaves something behind.
#[test]
fn wrong_maps_are_refused() {
    let folder = folder("not_imported");
    let refused = |format: &str, file: &str, text: &str, more: &[&str], told: &str| {
        let run = import(&folder, format, file, text, more);
        refuses(&run, told);
        let left: Vec<String> = content(&folder)
            .into_keys()
            .filter(|name| name.contains("out"))
            .collect();
        assert!(left.is_empty(), "{left:?}");
    };
    let map = siding();
    refused(
        "osm",
        "map.json",
        &map.replacen("48.2", "148.2", 1),
        &[],
        "not on any railway",
    );
    refused(
        "osm",
        "map.json",
        &map.replace("\"rail\"", "\"abandoned\""),
        &[],
        "no way with `railway`",
    );
    refused("osm", "map.json", &map[..map.len() - 2], &[], "line 1");
    refused(
        "osm",
        "map.osm",
        "<osm><node id='1' lat='x' lon='2'/></osm>",
        &[],
        "line 1: `lat` of this `node`",
    );
    refused(
        "osm",
        "map.json",
        &map,
        &["--around", "15.6,48.2", "--radius-m", "100"],
        "swapped",
    );
    refused(
        "osm",
        "map.json",
        &map,
        &["--around", "48.2", "--radius-m", "100"],
        "latitude and longitude",
    );
    refused("osm", "map.txt", &map, &[], "does not end");
    let without = RAILML.replace(" epsgCode=\"4326\"", "");
    refused("railml", "line.railml", &without, &[], "line 3");
    refused("railml", "line.railml", &without, &[], "--crs");
    refused(
        "railml",
        "line.railml",
        "<railml version=\"2.2\"><infrastructure/></railml>",
        &[],
        "no tracks",
    );
    refused(
        "csv",
        "line.csv",
        &ALIGNMENT.replace("500,0;", "5oo;"),
        &[],
        "line 4, column `radius_m`",
    );
    refused(
        "csv",
        "line.csv",
        &ALIGNMENT.replace("radius_m", "R"),
        &["--datum", "104.066,30.657"],
        "latitude and longitude",
    );
    for (out, told) in [
        ("out/none.txt", "none.txt is no name of a tunnel file"),
        ("out/none.toml", "none.json"),
    ] {
        let run = program(["import", "osm", "none.json", "--out", out])
            .output()
            .unwrap();
        refuses(&run, told);
    }
}

/// Fails where a file that was there is lost without `--force`, is not replaced with it, or one of two files is written
/// though the other cannot be.
#[test]
fn files_that_are_there_are_kept() {
    let folder = folder("kept");
    let [out, report, map] =
        ["out.toml", "report.json", "out.geojson"].map(|name| folder.join(name));
    let [csv, railml] = [
        ("csv", "line.csv", ALIGNMENT),
        ("railml", "line.railml", RAILML),
    ];
    let text = |path: &Path| fs::read_to_string(path).unwrap();
    let refused = |run: &Output, path: &Path| {
        refuses(run, &format!("{} is there already", path.display()));
        says(run, "--force");
        assert_eq!(text(path), "mine");
    };

    fs::write(&out, "mine").unwrap();
    for (format, file, content) in [csv, railml] {
        refused(&import(&folder, format, file, content, &[]), &out);
    }
    fs::write(&report, "mine").unwrap();
    fs::remove_file(&out).unwrap();
    let option = ["--report", &report.display().to_string()].map(str::to_owned);
    let import_both = |more: &[&str]| {
        let more: Vec<&str> = option
            .iter()
            .map(String::as_str)
            .chain(more.iter().copied())
            .collect();
        import(&folder, railml.0, railml.1, railml.2, &more)
    };
    refused(&import_both(&[]), &report);
    assert!(!out.exists());
    succeeds(&import_both(&["--force"]));
    assert!(text(&report).contains("counts") && text(&out).contains("datum"));

    let export = |more: &[&str]| {
        let [tunnel, map] = [&out, &map].map(|path| path.display().to_string());
        let args = ["export", "geojson", &tunnel, "--out", &map];
        program(args.iter().chain(more)).output().unwrap()
    };
    fs::write(&map, "mine").unwrap();
    refused(&export(&[]), &map);
    succeeds(&export(&["--force"]));
    assert!(text(&map).contains("FeatureCollection"));
    // One name for two files, and a folder.
    let same = ["--report", &out.display().to_string(), "--force"].map(str::to_owned);
    let same: Vec<&str> = same.iter().map(String::as_str).collect();
    refuses(
        &import(&folder, railml.0, railml.1, railml.2, &same),
        "give them two names",
    );
    fs::remove_file(&out).unwrap();
    fs::create_dir(&out).unwrap();
    refuses(
        &import(&folder, csv.0, csv.1, csv.2, &["--force"]),
        "is a folder",
    );
}
