//! Signals that ask a command to end, a kill in the middle of a run, and a second command in the same folder.

use crate::program::{PROGRAM, REPOSITORY, folder, metrotwin, printed, refuses, run};
use crate::recordings::{messages, recorded_s};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// Until a file is there, for a minute at most.
fn wait_for(path: &Path) {
    wait_for_bytes(path, 0);
}

/// Until a file holds so much.
fn wait_for_bytes(path: &Path, least: u64) {
    let came = (0..1200).any(|_| {
        sleep(Duration::from_millis(50));
        fs::metadata(path).is_ok_and(|about| about.len() >= least)
    });
    assert!(came, "no {} of {least} bytes", path.display());
}

fn send(signal: &str, child: &Child) {
    // The shell's own: not every machine has the program.
    let line = format!("kill {signal} {}", child.id());
    let sent = Command::new("sh").args(["-c", &line]).status();
    assert!(sent.unwrap().success());
}

/// A run without pictures.
fn run_of(duration_s: u32, out: &Path) -> String {
    let out = out.display();
    format!(
        "run scenarios/low_adhesion.toml --set duration_s={duration_s} \
         --set stop_after_standstill_s={duration_s} --set train.stop_at_m=300 --out {out}"
    )
}

fn long_run(out: &Path) -> String {
    run_of(80_000, out)
}

/// In the background of a script signals are ignored, and would stay so.
fn spawn_with_signals(line: &str) -> Child {
    let mut command = Command::new("env");
    command.args(["--default-signal", PROGRAM]);
    command.args(line.split_whitespace());
    let piped = command.stdout(Stdio::piped()).stderr(Stdio::piped());
    piped.current_dir(REPOSITORY).spawn().unwrap()
}

/// Fails where a kill takes more of a recording than its last second.
#[test]
fn a_killed_run_leaves_its_recording() {
    let out = folder("recording");
    let mut command = metrotwin(&run_of(100, &out));
    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let mut lines = lines.map_while(Result::ok);
    assert!(lines.any(|line| line.contains("30 % of the run")));
    child.kill().unwrap();
    child.wait().unwrap();
    let kept_s = recorded_s(&out.join("recording.rrd.part"));
    assert!((29.0..100.0).contains(&kept_s), "{kept_s} s");
}

/// Fails where a second run into a folder removes what the first one writes.
#[test]
fn two_runs_do_not_share_a_folder() {
    let out = folder("two");
    let child = spawn_with_signals(&long_run(&out));
    let part = out.join("recording.rrd.part");
    wait_for(&part);
    for more in ["", "--no-recording"] {
        let second = run(&format!("{} {more}", run_of(1, &out)));
        refuses(&second, "another process is writing");
        assert!(part.exists());
    }
    send("-TERM", &child);
    let output = child.wait_with_output().unwrap();
    assert!(printed(&output).contains("the run was broken off"));
    assert!(messages(&out.join("recording.rrd")) > 10);
}

/// Fails where a study that waits for a run in flight cannot be ended but by a kill.
#[test]
fn a_second_term_ends_a_command_at_once() {
    let base = folder("second_term");
    let text = fs::read_to_string("tests/studies/small.toml").unwrap();
    let text = text
        .replace("duration_s = 1.5", "duration_s = 80000.0")
        .replace("../..", REPOSITORY)
        .replace(
            "steps.csv",
            &format!("{REPOSITORY}/tests/studies/steps.csv"),
        );
    let (study, out) = (base.join("long.toml"), base.join("out"));
    fs::write(&study, text).unwrap();
    let [study, folder] = [&study, &out].map(|path| path.display());
    let line = format!("study run {study} --renderer cpu --jobs 1 --out {folder}");
    let mut child = spawn_with_signals(&line);
    wait_for(&out.join("worker-1.log"));
    send("-TERM", &child);
    send("-TERM", &child);
    sleep(Duration::from_millis(1500));
    assert!(child.try_wait().unwrap().is_none(), "it waits for no run");
    send("-TERM", &child);
    let ended = (0..100).any(|_| {
        sleep(Duration::from_millis(50));
        child.try_wait().unwrap().is_some()
    });
    child.kill().ok();
    assert!(ended);
}

/// Fails where Slurm, a container or a closed terminal ends a run as a kill does; where a signal that is
/// sent twice cuts its end off.
#[test]
fn term_and_hup_end_a_run_as_ctrl_c_does() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        let out = folder(&format!("signal{signal}"));
        let child = spawn_with_signals(&long_run(&out));
        wait_for(&out.join("recording.rrd.part"));
        send(signal, &child);
        if signal != "-INT" {
            send(signal, &child);
        }
        let output = child.wait_with_output().unwrap();
        assert_eq!(
            output.status.code(),
            Some(1),
            "{signal}: {}",
            printed(&output)
        );
        assert!(
            printed(&output).contains("the run was broken off"),
            "{signal}"
        );
        let summary = fs::read_to_string(out.join("summary.json")).unwrap();
        assert!(summary.contains("interrupted"), "{signal}: {summary}");
        assert!(messages(&out.join("recording.rrd")) > 10, "{signal}");
        assert!(!out.join("recording.rrd.part").exists(), "{signal}");
        fs::remove_dir_all(out).ok();
    }
}

/// Fails where a signal cuts a data set or a study off in a file: what was taken is whole, and the rows of a
/// study are kept.
#[test]
fn term_and_hup_end_sets_and_studies_in_order() {
    let base = folder("sets");
    for signal in ["-TERM", "-HUP"] {
        let out = base.join(format!("set{signal}"));
        let line = format!(
            "frames scenarios/line_run.toml --renderer cpu --cameras left --set rig.width_px=160 \
             --set rig.height_px=90 --set rig.pixel_um=30 --out {}",
            out.display()
        );
        let child = spawn_with_signals(&line);
        wait_for(&out.join("images/left/000003.png"));
        send(signal, &child);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", printed(&output));
        let meta = fs::read(out.join("meta.json")).unwrap();
        let meta: serde_json::Value = serde_json::from_slice(&meta).unwrap();
        let pictures = fs::read_dir(out.join("images/left")).unwrap();
        let pictures: Vec<_> = pictures.map(|entry| entry.unwrap().path()).collect();
        assert!(pictures.iter().all(|path| image::open(path).is_ok()));
        assert_eq!(meta["cameras"][0]["frames"], pictures.len());
        assert_eq!(meta["finished"], true);
        let study = base.join(format!("study{signal}"));
        let line = format!(
            "study run tests/studies/small.toml --renderer cpu --jobs 1 --runs 400 --out {}",
            study.display()
        );
        let child = spawn_with_signals(&line);
        let journal = study.join("rows.jsonl");
        wait_for_bytes(&journal, 1);
        send(signal, &child);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", printed(&output));
        assert!(printed(&output).contains("--resume goes on"));
        let lines = fs::read_to_string(&journal).unwrap();
        assert!(lines.ends_with('\n'));
        let rows = metrotwin::study::read_rows(&study).unwrap();
        assert_eq!(rows.len(), lines.lines().count());
    }
    fs::remove_dir_all(base).ok();
}

/// Fails where a run under `nohup` ends with the terminal.
#[test]
fn a_signal_that_is_ignored_from_outside_stays_ignored() {
    let out = folder("nohup");
    let line = long_run(&out);
    let script = format!("trap '' HUP; exec '{PROGRAM}' {line}");
    let mut command = Command::new("sh");
    command
        .args(["-c", &script])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    wait_for(&out.join("recording.rrd.part"));
    send("-HUP", &child);
    sleep(Duration::from_secs(2));
    assert!(child.try_wait().unwrap().is_none(), "it has ended");
    send("-TERM", &child);
    let output = child.wait_with_output().unwrap();
    assert!(printed(&output).contains("the run was broken off"));
    fs::remove_dir_all(out).ok();
}
