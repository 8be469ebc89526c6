//! The program as a user meets it: wrong input is named with file, key and remedy, ends with
//! exit code 2, and leaves nothing behind.

use crate::program::{REPOSITORY, folder, program};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

fn metrotwin(args: &[&str]) -> Output {
    program(args).output().expect("the program starts")
}

/// A right scenario on the test bench, in which `from` is replaced by `to`.
fn scenario(folder: &Path, from: &str, to: &str) -> PathBuf {
    let tunnel = Path::new(REPOSITORY).join("tunnels/test_bench.toml");
    let text = format!(
        "name = \"wrong\"\n\
         tunnel = '{}'\n\
         duration_s = 0.2\n\
         [train]\n\
         start_chainage_m = 150.0\n\
         cruise_speed_kmh = 30.0\n\
         [rig]\n\
         yaw_deg = 39.0\n\
         exposure_us = 30.0\n",
        tunnel.display()
    );
    assert!(text.contains(from), "the scenario has no `{from}`");
    let file = folder.join("wrong.toml");
    fs::write(&file, text.replace(from, to)).expect("the scenario can be written");
    file
}

/// A shipped tunnel in which the first `from` is replaced by `to`, and a scenario on it.
fn on_tunnel(folder: &Path, shipped: &str, from: &str, to: &str) -> (PathBuf, PathBuf) {
    let path = Path::new(REPOSITORY).join("tunnels").join(shipped);
    let text = fs::read_to_string(path).expect("the shipped tunnel can be read");
    assert!(text.contains(from), "{shipped} has no `{from}`");
    let tunnel = folder.join("tunnel.toml");
    fs::write(&tunnel, text.replacen(from, to, 1)).expect("the tunnel can be written");
    let file = folder.join("on_tunnel.toml");
    let text = "name = \"on_tunnel\"\ntunnel = \"tunnel.toml\"\nduration_s = 0.2\n[train]\n";
    fs::write(&file, text).expect("the scenario can be written");
    (tunnel, file)
}

/// `run` and `check` both refuse the scenario, and say each of `words`; nothing is written.
fn refused(folder: &Path, file: &Path, words: &[&str]) {
    let file = file.to_str().expect("the path is UTF-8");
    let out = folder.join("out");
    let out_text = out.to_str().expect("the path is UTF-8");
    for args in [vec!["run", file, "--out", out_text], vec!["check", file]] {
        let output = metrotwin(&args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?} said: {said}");
        for word in words {
            assert!(
                said.contains(word),
                "{args:?} does not say `{word}`, but: {said}"
            );
        }
        assert!(output.stdout.is_empty(), "{args:?} printed a result");
    }
    assert!(!out.exists(), "the folder of results was touched");
}

/// What the cases below replace must be right before.
#[test]
fn the_scenario_of_these_tests_is_right() {
    let folder = folder("right");
    let file = scenario(&folder, "0.2", "0.2");
    let output = metrotwin(&["check", file.to_str().expect("the path is UTF-8")]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
}

#[test]
fn unknown_key() {
    let folder = folder("unknown_key");
    let file = scenario(&folder, "cruise_speed_kmh", "cruse_speed_kmh");
    let words = [
        "wrong.toml:6",
        "train.cruse_speed_kmh",
        "did you mean `cruise_speed_kmh`",
    ];
    refused(&folder, &file, &words);
}

#[test]
fn wrong_unit() {
    let folder = folder("wrong_unit");
    let file = scenario(&folder, "exposure_us = 30.0", "exposure_ms = 0.03");
    let words = [
        "wrong.toml:9",
        "rig.exposure_ms",
        "did you mean `exposure_us`",
    ];
    refused(&folder, &file, &words);
}

/// Several wrong values are shown at once, each with its own place.
#[test]
fn all_problems_at_once() {
    let folder = folder("all_problems");
    let file = scenario(
        &folder,
        "exposure_us = 30.0",
        "exposure_us = 50_000.0\npixel_um = -1.0",
    );
    let exposure = "rig.exposure_us: an exposure of 50000 us is longer than the frame";
    let words = [
        exposure,
        "expose for at most 17372 us",
        "rig.pixel_um",
        "give 0.1 to 1000 um",
    ];
    refused(&folder, &file, &words);
}

#[test]
fn more_rows_than_a_frame_has_time_for() {
    let folder = folder("rows");
    let file = scenario(&folder, "exposure_us = 30.0", "line_time_us = 50.0");
    let words = [
        "rig.height_px",
        "720 rows of 50 us",
        "read at most 667 rows",
    ];
    refused(&folder, &file, &words);
}

#[test]
fn missing_file() {
    let folder = folder("missing_file");
    let words = ["cannot read", "nowhere.toml", "check the path"];
    refused(&folder, &folder.join("nowhere.toml"), &words);
}

#[test]
fn missing_tunnel() {
    let folder = folder("missing_tunnel");
    let file = scenario(&folder, "test_bench.toml", "test_bunch.toml");
    let words = [
        "wrong.toml:2",
        "tunnel: cannot read",
        "test_bunch.toml",
        "give the path",
    ];
    refused(&folder, &file, &words);
}

#[test]
fn not_toml() {
    let folder = folder("not_toml");
    let file = scenario(&folder, "[rig]", "[rig");
    refused(&folder, &file, &["wrong.toml:7", "not TOML"]);
}

#[test]
fn lamp_inside_the_rock() {
    let folder = folder("lamp_in_rock");
    let (from, to) = ("lateral_m = 2.70", "lateral_m = 4.70");
    let (tunnel, file) = on_tunnel(&folder, "test_bench.toml", from, to);
    let words = ["tunnel.toml:", "lateral_m", "4.7", "help:"];
    refused(&folder, &file, &words);
    let output = metrotwin(&["check", tunnel.to_str().expect("the path is UTF-8")]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

/// Fails where a chainage of a plan is found elsewhere, or one that names no place is taken.
#[test]
fn chainages_of_plans_are_found() {
    let check = |chainage: &str| {
        let args = ["check", "tunnels/terminus.toml", "--chainage", chainage];
        let output = program(args).current_dir(REPOSITORY).output();
        let output = output.expect("the program starts");
        let said = [&output.stdout[..], &output.stderr[..]].concat();
        (
            output.status.code(),
            String::from_utf8_lossy(&said).into_owned(),
        )
    };
    for (chainage, code, words) in [
        (
            "YDK12+150.5",
            0,
            "YDK12+150.5 is 150.500 m from the begin of track `u1`",
        ),
        (
            "ZDK12+489.9 R2",
            0,
            "is 490.188 m from the begin of track `d1`",
        ),
        (
            "ZDK12+489.9",
            0,
            "write one of `ZDK12+489.900 R1`, `ZDK12+489.900 R2`",
        ),
        (
            "YDK12+470",
            2,
            "is not stated on this track; the nearest: `YDK12+460.000`",
        ),
        (
            "km twelve",
            2,
            "is no chainage; write it like `YDK12+000.000`",
        ),
        ("ydk12+150.5", 0, "150.500 m from the begin of track `u1`"),
        ("", 2, "--chainage of tunnels/terminus.toml is empty"),
    ] {
        let (exit, said) = check(chainage);
        assert_eq!(exit, Some(code), "{said}");
        assert!(said.contains(words), "{chainage} said: {said}");
        assert!(!said.contains("tightest radius"), "{chainage} said: {said}");
    }
    let folder = folder("chainage");
    let (from, to) = ("ahead_m = 12489.712", "ahead_m = 12490.0");
    let (_, file) = on_tunnel(&folder, "terminus.toml", from, to);
    let words = [
        "stated_chainage.equations[0].ahead_m",
        "nothing jumps",
        "help:",
    ];
    refused(&folder, &file, &words);
}

/// Fails where a wrong track is told by its number alone, or what is no tunnel by each of its keys.
#[test]
fn tracks_have_names_and_other_files_are_no_tunnels() {
    let folder = folder("names");
    let (from, to) = ("to = \"W4.through\"", "to = \"W4.trough\"");
    let (_, file) = on_tunnel(&folder, "terminus.toml", from, to);
    refused(&folder, &file, &["track[1].to (`u2`)", "W4.through"]);
    for (file, words) in [
        (
            "scenarios/line_run.toml",
            ["is a scenario, not a tunnel", "chengdu_line1.toml"],
        ),
        (
            "scenarios/vehicles/metro_b1_empty.toml",
            ["is a vehicle, not a tunnel", "give a tunnel file"],
        ),
    ] {
        let output = metrotwin(&["export", "geojson", file]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{file} said: {said}");
        assert!(
            words.iter().all(|w| said.contains(w)),
            "{file} said: {said}"
        );
        assert!(!said.contains("there is no key"), "{file} said: {said}");
    }
}

#[test]
fn negative_radius() {
    let folder = folder("negative_radius");
    let (from, to) = ("radius_m = 500.0", "radius_m = -500.0");
    let (_, file) = on_tunnel(&folder, "chengdu_line1.toml", from, to);
    let words = ["tunnel.toml:", "plan[2].radius_m", "-500", "help:"];
    refused(&folder, &file, &words);
}

#[test]
fn rig_that_never_sees_a_lamp() {
    let folder = folder("blind_rig");
    let file = scenario(&folder, "yaw_deg = 39.0", "yaw_deg = -120.0");
    let words = [
        "wrong.toml:8",
        "rig.yaw_deg",
        "hardly ever sees a whole lamp",
        "yaw_deg = 39",
    ];
    refused(&folder, &file, &words);
}

#[test]
fn train_that_begins_outside() {
    let folder = folder("outside");
    let file = scenario(&folder, "150.0", "100.0");
    let words = [
        "train.start_chainage_m",
        "begins outside",
        "start at 118.0 m",
    ];
    refused(&folder, &file, &words);
}

/// A load put down when its bearer is not there would never appear.
#[test]
fn obstacle_on_the_bench() {
    let folder = folder("obstacle_on_the_bench");
    let bench = "[bench]\nfirst_m = 189.75\n[[obstacles]]\nchainage_m = 195.0\n";
    let train = "[train]\nstart_chainage_m = 150.0\ncruise_speed_kmh = 30.0\n";
    let file = scenario(&folder, train, bench);
    refused(
        &folder,
        &file,
        &["obstacles", "bench test", "[[obstacles]]"],
    );
}

#[test]
fn load_put_down_by_nobody() {
    let folder = folder("nobody");
    let worker = "exposure_us = 30.0\n\
        [[workers]]\n\
        path = [{ time_s = 0.0, chainage_m = 160.0, lateral_m = 0.0 },\n\
                { time_s = 0.1, chainage_m = 160.1, lateral_m = 0.0 }]\n\
        puts_down_s = 0.15\n\
        [workers.carries]\n";
    let file = scenario(&folder, "exposure_us = 30.0\n", worker);
    let words = [
        "wrong.toml:13",
        "workers[0].puts_down_s",
        "from 0 to 0.1 s, not at 0.15 s",
        "give 0 to 0.1 s",
    ];
    refused(&folder, &file, &words);
}

/// The file is right, so the message must not point into it.
#[test]
fn wrong_override() {
    let folder = folder("wrong_override");
    let file = scenario(&folder, "0.2", "0.2");
    let file = file.to_str().expect("the path is UTF-8");
    let out = folder.join("out");
    let out_text = out.to_str().expect("the path is UTF-8");
    for (change, words) in [
        (
            "train.cars=0",
            ["train.cars: 0 cars", "(--set train.cars=0)", "give 1 to 8"],
        ),
        (
            "train.crs=9",
            [
                "right by itself, but not with --set",
                "train.crs",
                "did you mean `cars`",
            ],
        ),
        (
            "obstacles[0].mass_kg=1",
            ["--set", "no entry in `obstacles`", "[[obstacles]]"],
        ),
        ("train.cars", ["key=value", "train.cars", "--set"]),
    ] {
        let output = metrotwin(&["run", file, "--out", out_text, "--set", change]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{change} said: {said}");
        for word in words {
            assert!(
                said.contains(word),
                "{change} does not say `{word}`, but: {said}"
            );
        }
        assert!(
            !said.contains("wrong.toml:"),
            "{change} is blamed on the file: {said}"
        );
    }
    assert!(!out.exists(), "the folder of results was touched");
}

/// A file stands where a folder should: that stops the superuser too.
#[test]
fn unwritable_out_folder() {
    let folder = folder("unwritable");
    let file = scenario(&folder, "0.2", "0.2");
    let obstacle = folder.join("obstacle");
    fs::write(&obstacle, "kept").expect("a file can be written");
    let out = obstacle.join("results");
    let output = metrotwin(&[
        "run",
        file.to_str().expect("the path is UTF-8"),
        "--out",
        out.to_str().expect("the path is UTF-8"),
    ]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "said: {said}");
    for word in ["cannot write into", "results", "--out"] {
        assert!(said.contains(word), "does not say `{word}`, but: {said}");
    }
    assert_eq!(fs::read_to_string(&obstacle).ok().as_deref(), Some("kept"));
}

/// The shortest run there is: every result is whole, `--json` prints the summary and nothing
/// else, and no temporary file is left.
#[test]
fn a_run_writes_whole_files() {
    let folder = folder("run");
    let out = folder.join("results");
    let run = |more: &[&str]| {
        let mut args = vec!["run", "scenarios/static_bench.toml", "--json"];
        args.extend(["--out", out.to_str().expect("the path is UTF-8")]);
        args.extend(["--set", "bench.points=1"]);
        args.extend(["--set", "bench.fixes_per_point=2"]);
        args.extend(["--seed", "7", "--renderer", "cpu"]);
        args.extend(more);
        let output = metrotwin(&args);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let printed: serde_json::Value =
            serde_json::from_slice(&output.stdout).expect("standard output is JSON");
        let kept = fs::read(out.join("summary.json")).expect("there is a summary");
        let kept: serde_json::Value = serde_json::from_slice(&kept).expect("the summary is JSON");
        assert_eq!(printed, kept);
        let mut files: Vec<String> = fs::read_dir(&out)
            .expect("there is a folder")
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .collect();
        files.sort();
        (printed, files)
    };
    let (printed, files) = run(&[]);
    assert_eq!(printed["scenario"], "static_bench");
    assert_eq!(printed["seed"], 7);
    assert!(printed["stereo_frames"].as_u64() >= Some(2));
    assert_eq!(printed["renderer"]["backend"], "cpu");
    assert_eq!(
        files,
        ["files.txt", "fixes.csv", "recording.rrd", "summary.json"]
    );
    // The recording of the run before does not belong to this one's summary.
    let (_, files) = run(&["--no-recording"]);
    assert_eq!(files, ["files.txt", "fixes.csv", "summary.json"]);
}

/// Every shipped file is right, and the report has the figures that a user plans with.
#[test]
fn shipped_files_are_right() {
    let output = metrotwin(&[
        "check",
        "scenarios/static_bench.toml",
        "scenarios/line_run.toml",
        "scenarios/forgotten_toolbox.toml",
        "tunnels/test_bench.toml",
        "tunnels/chengdu_line1.toml",
    ]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    for word in [
        "about 200 pairs",
        "seen whole by both eyes",
        "299 lamps",
        "radius 350 m",
        "W1530",
    ] {
        assert!(
            said.contains(word),
            "the report does not say `{word}`: {said}"
        );
    }
}
