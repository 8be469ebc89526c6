//! What hostile and mistaken input comes to: bounded answers that say what to do.

#![allow(clippy::disallowed_methods, reason = "an answer must come in time")]

use crate::program::{PROGRAM, REPOSITORY, folder, program};
use metrotwin::cli::check_text;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const SCENARIO: &str = "name = \"x\"\ntunnel = \"tunnels/chengdu_line1.toml\"\nduration_s = 0.2\n\
    [train]\nstart_chainage_m = 150.0\n";

fn metrotwin(args: &[&str]) -> Output {
    let mut command = program(args);
    let output = command.env_remove("XDG_RUNTIME_DIR").output();
    output.expect("the program starts")
}

/// With no more than 1.5 GB of address space, where that can be had.
fn with_little_memory(args: &[&str]) -> Output {
    if !cfg!(target_os = "linux") {
        return metrotwin(args);
    }
    let mut command = Command::new("sh");
    let script = "ulimit -v 1500000 && exec \"$0\" \"$@\"";
    command.args(["-c", script, PROGRAM]).args(args);
    let output = command
        .env("NO_COLOR", "1")
        .current_dir(REPOSITORY)
        .output();
    output.expect("the program starts")
}

/// A file is refused with exit code 2 and each of `words`; what is printed.
fn refused(args: &[&str], words: &[&str]) -> String {
    refused_by(&metrotwin(args), args, words)
}

fn refused_by(output: &Output, args: &[&str], words: &[&str]) -> String {
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{args:?} said: {said}");
    for word in words {
        assert!(said.contains(word), "{args:?}: no `{word}` in: {said}");
    }
    said
}

/// What `check` says of a text beside the repository's own files.
fn said_of(text: &str) -> Result<String, String> {
    check_text(&Path::new(REPOSITORY).join("text.toml"), text)
}

fn file(name: &str, text: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli_input");
    fs::create_dir_all(&folder).expect("a folder can be made");
    let path = folder.join(name);
    fs::write(&path, text).expect("a file can be written");
    path
}

/// Provokes: a panic of the report where a problem stands beyond column 65,535.
#[test]
fn a_problem_far_to_the_right_is_shown() {
    let far = format!("{SCENARIO}{}cars = 99\n", " ".repeat(70_000));
    let said = said_of(&far).expect_err("there are too many cars");
    assert!(
        said.contains("train.cars") && said.contains("70008"),
        "{said}"
    );
    let long = format!("{SCENARIO}cars = [{}]\n", "1, ".repeat(100_000));
    let said = said_of(&long).expect_err("cars are no list");
    assert!(said.len() < 3000, "{}", said.len());
    let broken = format!("{SCENARIO}x = [{}] ]\n", "1,".repeat(50_000));
    assert!(said_of(&broken).expect_err("not TOML").len() < 3000);
}

/// Provokes: an answer whose length or time grows with the number of problems times the size.
#[test]
fn thousands_of_problems_are_told_in_a_few_lines() {
    let start = Instant::now();
    let unknown = (0..2000).map(|k| format!("[[obstacles]]\nbad_{k} = 3\n"));
    let said = said_of(&format!("{SCENARIO}{}", unknown.collect::<String>()));
    let said = said.expect_err("the keys are unknown");
    assert!(said.len() < 20_000 && said.contains("not shown"), "{said}");
    let heavy = (0..2000).map(|k| format!("[[obstacles]]\nname = \"o{k}\"\nmass_kg = -3.0\n"));
    let said = said_of(&format!("{SCENARIO}{}", heavy.collect::<String>()));
    let said = said.expect_err("the masses are negative");
    assert!(
        said.len() < 20_000 && said.contains("more problems are not shown"),
        "{said}"
    );
    assert!(start.elapsed() < Duration::from_secs(20));
}

/// Provokes: memory taken, or time, before a number is held against its range.
#[test]
fn numbers_are_checked_before_they_are_used() {
    let start = Instant::now();
    for (key, value) in [
        ("bench.points", "2147483647"),
        ("rig.exposure_us", "1e12"),
        ("rig.pairs_per_s", "1e-10"),
        ("radio.latency_ms", "1e13"),
    ] {
        let shipped = match key {
            "bench.points" => "scenarios/static_bench.toml",
            _ => "scenarios/line_run.toml",
        };
        let change = format!("{key}={value}");
        let args = ["check", shipped, "--set", &change];
        let output = with_little_memory(&args);
        refused_by(&output, &args, &[key, "out of range", "give"]);
    }
    assert!(start.elapsed() < Duration::from_secs(20));
}

/// Provokes: the walls of a long line kept once for each of its wayside cameras.
#[test]
fn a_long_line_with_many_cameras_is_checked_in_little_memory() {
    let tunnel = fs::read_to_string(Path::new(REPOSITORY).join("tunnels/test_bench.toml"));
    let mut tunnel = tunnel.expect("it is shipped").replace("300.0", "1000000.0");
    let mut devices = String::new();
    for k in 0..30 {
        let chainage_m = 1000.0 + 100.0 * f64::from(k);
        tunnel += &format!(
            "[[balises]]\nname = \"B{k}\"\nchainage_m = 500.0\n[[wayside]]\nname = \"W{k}\"\n\
             chainage_m = {chainage_m}\nlateral_m = -2.5\nheight_m = 3.0\nyaw_deg = 175.0\n\
             pitch_deg = -6.0\nbalise = \"B{k}\"\n"
        );
        devices += &format!("[[wayside]]\ndevice = \"W{k}\"\n");
    }
    file("long_tunnel.toml", &tunnel);
    let scenario = SCENARIO.replace("tunnels/chengdu_line1.toml", "long_tunnel.toml");
    let things = "[[obstacles]]\nchainage_m = 960.0\nappears_s = 0.1\n";
    let path = file("long.toml", &format!("{scenario}{things}{devices}"));
    let start = Instant::now();
    let output = with_little_memory(&["check", path.to_str().expect("the path is UTF-8")]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{output:?}");
    assert!(said.contains("learns its reference image"), "{said}");
    assert!(start.elapsed() < Duration::from_secs(20));
}

/// Provokes: a scenario that is right, and then cannot begin, or never ends.
#[test]
fn what_could_not_be_run_is_refused() {
    let drift = [
        "rig.clock.drift_ppm=1000.0",
        "duration_s=86400",
        "rig.pairs_per_s=1",
    ];
    let drift = drift.iter().flat_map(|change| ["--set", change]);
    let args: Vec<&str> = ["check", "scenarios/line_run.toml"]
        .into_iter()
        .chain(drift)
        .collect();
    refused(&args, &["duration_s", "poses are kept for 60 s"]);
    let bench = [
        "bench.points=1000",
        "bench.step_m=0.0",
        "bench.fixes_per_point=100000",
    ];
    let bench = bench.iter().flat_map(|change| ["--set", change]);
    let args: Vec<&str> = ["check", "scenarios/static_bench.toml"]
        .into_iter()
        .chain(bench)
        .collect();
    refused(&args, &["bench.fixes_per_point", "86400 s"]);
}

/// Provokes: a device or a pipe that is read, the first line of any file in a message.
#[test]
fn other_files_are_neither_read_nor_shown() {
    let secret = file("secret", "root:$6$hash:1::\nk = 1\n");
    let name = secret.to_str().expect("the path is UTF-8");
    let hidden = |said: String| assert!(!said.contains("$6$") && !said.contains("hash"), "{said}");
    hidden(refused(&["check", name], &[".toml"]));
    let tunnel = SCENARIO.replace("tunnels/chengdu_line1.toml", name);
    hidden(said_of(&tunnel).expect_err("it is no tunnel"));
    let table = format!(
        "{SCENARIO}[study.variables.speed]\nkeys = [\"train.cruise_speed_kmh\"]\n\
         from = {{ table = {{ file = \"{name}\", column = \"v\" }} }}\n"
    );
    let said = said_of(&table).expect_err("it is no CSV file");
    assert!(
        said.contains(".csv") && said.contains("study.variables.speed"),
        "{said}"
    );
    hidden(said);
    let mesh =
        format!("{SCENARIO}[[obstacles]]\nbody = {{ shape = \"mesh\", file = \"{name}\" }}\n");
    hidden(said_of(&mesh).expect_err("it is no mesh"));
    if cfg!(unix) {
        refused(&["check", "/dev/zero"], &["no regular file"]);
        for text in [
            tunnel.replace(name, "/dev/zero"),
            table.replace(name, "/dev/zero"),
            mesh.replace(name, "/dev/zero"),
        ] {
            let said = said_of(&text).expect_err("it is a device");
            assert!(said.contains("no regular"), "{said}");
        }
    }
}

/// Provokes: problems of the vehicle, the scenario and the tunnel told one after the other, and those
/// of values only when all keys are right.
#[test]
fn all_files_and_stages_are_told_at_once() {
    let shipped =
        |path: &str| fs::read_to_string(Path::new(REPOSITORY).join(path)).expect("it is there");
    let vehicle = shipped("scenarios/vehicles/metro_b1_empty.toml")
        .replacen("slack_m = 0.0", "", 1)
        .replacen("cg_m = 1.8", "cg_m = \"x\"", 1)
        .replacen("length_m = 19.67", "length_m = 1967.0", 1);
    let tunnel = shipped("tunnels/chengdu_line1.toml")
        .replacen("kind = \"arc\"", "kind = 7", 1)
        .replacen("radius_m = 350.0", "", 1)
        .replacen("spacing_m = 10.0", "spacing_m = -10.0", 1);
    let (vehicle, tunnel) = (file("v.toml", &vehicle), file("t.toml", &tunnel));
    let scenario = "name = \"x\"\ntunnel = \"t.toml\"\n[train]\nvehicle = \"v.toml\"\ncars = 99\n";
    let scenario = file("s.toml", scenario);
    let name = |path: &Path| path.to_str().expect("the path is UTF-8").to_owned();
    let of_vehicle = ["coupler.slack_m", "body.cg_m", "body.length_m"];
    let of_tunnel = [
        "plan[2].kind",
        "straight, clothoid, arc",
        "plan[10].radius_m",
        "lamps.spacing_m",
    ];
    refused(&["check", &name(&vehicle)], &of_vehicle);
    refused(&["check", &name(&tunnel)], &of_tunnel);
    let all = [&of_vehicle[..], &of_tunnel, &["train.cars"]].concat();
    refused(&["check", &name(&scenario)], &all);
}

/// Each mistake is named, with what to do.
#[test]
fn mistakes_of_the_command_line_are_named() {
    refused(
        &["run", "tunnels/test_bench.toml"],
        &["is a tunnel", "a scenario that names it"],
    );
    let car = "scenarios/vehicles/manchester.toml";
    refused(&["frames", car, "--out", "never"], &["is a vehicle"]);
    refused(
        &["study", "run", "tunnels/test_bench.toml"],
        &["is a tunnel"],
    );
    let run = "scenarios/line_run.toml";
    refused(&["run", run, "--index", "3"], &["--index", "--from-study"]);
    refused(
        &["run", run, "--connect", "127.0.0.1:9"],
        &["no viewer answers", "127.0.0.1:9"],
    );
    let empty = ["check", run, "--set", "obstacles[0].mass_kg=1"];
    refused(&empty, &["no entry in `obstacles`", "[[obstacles]]"]);
    refused(
        &["check", "tunnels/test_bench.toml", "--set", "seed=3"],
        &["changes scenarios"],
    );
}

/// Provokes: seeds that no file can hold, more scenarios than a folder can.
#[test]
fn numbers_of_the_command_line_are_bounded() {
    let run = "scenarios/line_run.toml";
    let most = "9223372036854775808";
    refused(&["run", run, "--seed", most], &["--seed"]);
    let seed = format!("seed={}", i64::MAX);
    refused(&["check", run, "--set", &seed], &["seed", "out of range"]);
    let study = "scenarios/studies/led_accuracy.toml";
    let generate = ["generate", study, "--out", "never", "-n"];
    refused(&[&generate[..], &["100001"]].concat(), &["100000"]);
    let seeded = [&generate[..], &["1", "--seed", most]].concat();
    refused(&seeded, &["--seed"]);
}

/// Provokes: the whole file read for each of very many cases, keys held one by one against all others, or
/// the scenario read for each cell of a table.
#[test]
fn large_studies_are_checked_in_bounded_time() {
    let start = Instant::now();
    let study = "[study.variables.many]\n";
    let cases = (0..4000).map(|k| {
        let pad = "x".repeat(200);
        format!("{{ name = \"{k}\", set = {{ description = \"{pad}\" }} }},\n")
    });
    let cases: String = cases.collect();
    let said = said_of(&format!(
        "{SCENARIO}{study}from = {{ cases = [{cases}] }}\n"
    ));
    let said = said.expect_err("there are too many");
    assert!(said.contains("4000 keys, too many"), "{said}");

    let keys: String = (0..100_000).map(|k| format!("\"k{k}\",")).collect();
    let from = "from = { uniform = { min = 1.0, max = 2.0 } }";
    let said = said_of(&format!("{SCENARIO}{study}keys = [{keys}]\n{from}\n"));
    let said = said.expect_err("there are too many");
    assert!(said.contains("100000 keys, too many"), "{said}");

    let cells: String = (0..100_000).map(|k| format!("{}\n", 20 + k % 60)).collect();
    file("speeds.csv", &format!("speed_kmh\n{cells}"));
    let text = SCENARIO.replace("tunnels/", &format!("{REPOSITORY}/tunnels/"));
    let table = format!(
        "{text}{study}keys = [\"train.cruise_speed_kmh\"]\n\
         from = {{ table = {{ file = \"speeds.csv\", column = \"speed_kmh\" }} }}\n"
    );
    let path = file("table.toml", &table);
    let out = path.with_file_name("drawn");
    fs::remove_dir_all(&out).ok();
    let args = ["generate", &path.to_string_lossy(), "-n", "1", "--out"];
    let made = metrotwin(&[&args[..], &[&out.to_string_lossy()]].concat());
    assert!(made.status.success(), "{made:?}");
    assert!(start.elapsed() < Duration::from_secs(20));
}

/// Provokes: an event that names nothing, told without its file, its place, or what was meant.
#[test]
fn a_wrong_event_is_told_with_its_place() {
    let path = Path::new(REPOSITORY).join("scenarios/studies/protection.toml");
    let text = fs::read_to_string(&path).expect("it is there");
    let wrong = text.replacen("hit = \"collision\"", "hit = \"collison\"", 1);
    let said = check_text(&path, &wrong).expect_err("there is no such figure");
    for word in [
        "protection.toml",
        "study.events.hit",
        "did you mean `collision`?",
    ] {
        assert!(said.contains(word), "no `{word}` in: {said}");
    }
}

/// Provokes: names of tunnels that are empty, and a device without a name in a scenario.
#[test]
fn empty_names_are_refused() {
    let path = Path::new(REPOSITORY).join("tunnels/chengdu_line1.toml");
    let text = fs::read_to_string(&path).expect("it is there");
    let wrong = text
        .replacen("name = \"W1530\"", "name = \"\"", 1)
        .replacen("balise = \"B1110\"", "balise = \"\"", 1);
    let said = check_text(&path, &wrong).expect_err("names are empty");
    assert!(
        said.contains("wayside[0].name") && said.contains("wayside[0].balise"),
        "{said}"
    );
    let said = said_of(&format!("{SCENARIO}[[wayside]]\ndevice = \"\"\n"));
    let said = said.expect_err("the device has no name");
    assert!(
        said.contains("no wayside device ``") && said.contains("W1530"),
        "{said}"
    );
}

/// Provokes: a switch that will lead a train off its route, without a word about it.
#[test]
fn switches_against_a_train_are_noted() {
    let said = |more: &str| {
        let args =
            format!("check scenarios/terminus_meet.toml --set interlocking.automatic=false {more}");
        let output = metrotwin(&args.split_whitespace().collect::<Vec<_>>());
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
            + &String::from_utf8_lossy(&output.stderr)
    };
    let against = |said: &str| said.contains("switch `W5` leads to its through leg");
    assert!(against(&said("")), "{}", said(""));
    let set = r#"--set interlocking.positions=[{switch="W5",leg="diverging"}]"#;
    assert!(!against(&said(set)), "{}", said(set));
    let automatic = said("--set interlocking.automatic=true");
    assert!(!automatic.contains("switch `W"), "{automatic}");
}

/// Provokes: a train that crawls, or a rig that sees nothing, without a word about it.
#[test]
fn what_may_surprise_is_noted() {
    let slow = said_of(SCENARIO).expect("it is right");
    assert!(
        slow.contains("25 km/h") && slow.contains("initial_chainage_m"),
        "{slow}"
    );
    let known = format!("{SCENARIO}[stack.protection]\ninitial_chainage_m = 150.0\n");
    let known = said_of(&known).expect("it is right");
    assert!(!known.contains("note"), "{known}");
    let blind = SCENARIO.replace("150.0", "2992.0") + "stop_at_m = 2995.0\n[rig]\n";
    let blind = said_of(&blind).expect("it is right");
    assert!(
        blind.contains("no lamp stands on the way of the train"),
        "{blind}"
    );
    let wrong = format!("{SCENARIO}[stack.protection]\ninitial_chainage_m = 550.0\n");
    let wrong = said_of(&wrong).expect("it is right");
    assert!(
        wrong.contains("of the train is 550 m, and its head starts at 150 m: 400.00 m off"),
        "{wrong}"
    );
    let near = SCENARIO.replace(
        "[train]",
        "[stack.protection]\ninitial_chainage_m = 160.0\n[train]",
    );
    let near = said_of(&near).expect("it is right");
    assert!(!near.contains("note"), "{near}");
    let box_at = |chainage_m: f64, more: &str| {
        let things = format!("[[obstacles]]\nchainage_m = {chainage_m}\n{more}\n");
        let devices = "[[wayside]]\ndevice = \"W1530\"\n";
        said_of(&format!("{SCENARIO}{things}{devices}")).expect("it is right")
    };
    let inside = |said: &str| said.contains("in or under the train, which stands there");
    assert!(inside(&box_at(145.0, "")));
    assert!(!inside(&box_at(160.0, "")));
    assert!(!inside(&box_at(145.0, "lateral_m = 1.7")));
    assert!(!inside(&box_at(
        145.0,
        "height_m = 4.0\nheld_until_s = 0.1"
    )));
    let moving = SCENARIO.to_owned() + "start_speed_kmh = 20.0\n";
    let moving = moving + "[[obstacles]]\nchainage_m = 145.0\nappears_s = 0.1\n";
    assert!(!inside(&said_of(&moving).expect("it is right")));
    // The device looks down the line.
    let unseen =
        |said: &str| said.contains("no wayside camera (W1530) has the middle of `box` at ");
    let learnt = |said: &str| said.contains("learns its reference image");
    for (chainage_m, is_seen) in [(1505.0, true), (1600.0, false)] {
        let said = box_at(chainage_m, "appears_s = 0.1");
        assert_eq!(
            (learnt(&said), unseen(&said)),
            (is_seen, !is_seen),
            "{said}"
        );
    }
    let rolls = box_at(1600.0, "appears_s = 0.1\nvelocity_mps = [-5.0, 0.0, 0.0]");
    assert!(!unseen(&rolls), "{rolls}");
    let out = folder("noted").display().to_string();
    let run = format!("run scenarios/low_adhesion.toml --set duration_s=0.05 --out {out}");
    let run = metrotwin(&run.split_whitespace().collect::<Vec<_>>());
    assert!(run.status.success(), "{run:?}");
    let run = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(run.contains("note: ") && run.contains("25 km/h"), "{run}");
    let args = "check scenarios/line_run.toml --set train.direction=\"down\" --set \
        train.start_chainage_m=2875 --set train.stop_at_m=195 --set rig.side=\"right\" --set rig.yaw_deg=141";
    let back = metrotwin(&args.split_whitespace().collect::<Vec<_>>());
    let back = String::from_utf8_lossy(&back.stdout).into_owned();
    assert!(
        back.contains("behind its end of the train") && !back.contains(" -"),
        "{back}"
    );
}

/// Provokes: a graphics driver that complains of a desktop.
#[test]
fn the_driver_says_nothing_of_a_desktop() {
    let out = folder("quiet");
    let out = out.to_str().expect("the path is UTF-8");
    let run = "run scenarios/line_run.toml --set duration_s=0.01 --no-recording --out";
    let args: Vec<&str> = run.split_whitespace().chain([out]).collect();
    let output = metrotwin(&args);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(!said.contains("XDG_RUNTIME_DIR"), "{said}");
    #[cfg(target_os = "linux")]
    {
        // Not every driver complains: the variable is there for those that would.
        let line = format!(
            "run scenarios/low_adhesion.toml --set duration_s=80000 --set \
             stop_after_standstill_s=80000 --no-recording --out {out}"
        );
        let mut command = program(line.split_whitespace());
        let mut child = (command.env_remove("XDG_RUNTIME_DIR").stderr(Stdio::null()))
            .stdout(Stdio::null())
            .spawn()
            .expect("the program starts");
        let environment = format!("/proc/{}/environ", child.id());
        let is_set = (0..200).any(|_| {
            let bytes = fs::read(&environment).unwrap_or_default();
            let is_set = String::from_utf8_lossy(&bytes).contains("XDG_RUNTIME_DIR=");
            if !is_set {
                std::thread::sleep(Duration::from_millis(50));
            }
            is_set
        });
        child.kill().ok();
        child.wait().expect("it has been killed");
        assert!(is_set, "no XDG_RUNTIME_DIR in {environment}");
    }
}

/// Fails where nothing says that a receiver gives no fix, or one that comes out of a tunnel is said to give none.
#[test]
fn a_receiver_in_a_tunnel_is_noted() {
    for (scenario, is_hidden) in [
        ("scenarios/line_run.toml --set gnss={}", true),
        ("scenarios/depot_fan.toml", false),
        ("scenarios/parallel_tracks.toml", false),
    ] {
        let line = format!("check {scenario}");
        let checked = metrotwin(&line.split_whitespace().collect::<Vec<_>>());
        let said = String::from_utf8_lossy(&checked.stdout).into_owned();
        assert!(checked.status.success(), "{checked:?}");
        assert_eq!(
            said.contains("never sees the sky"),
            is_hidden,
            "{scenario}: {said}"
        );
    }
}
