//! Kills at drawn moments, of every command that writes files: nothing is lost but what was in flight,
//! what has its name is whole, files of others stay, and the next same command comes to what an
//! undisturbed one comes to. Signals that ask a command to end.
//!
//! `METROTWIN_KILLS` is the number of kills of all commands together, 10 without it.
#![cfg(all(feature = "twin", unix))]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and prints what it counted"
)]

use metrotwin::study::{Row, read_rows};
use rerun::external::re_log_encoding::DecoderApp;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const STUDY: &str = "tests/studies/small.toml";
/// Commands that are killed.
const COMMANDS: usize = 5;
/// What the user keeps in the folder, and no command has written.
const FOREIGN: [&str; 2] = ["notes.txt", "images/holiday.jpg"];
/// Small pictures of a train and a device, without the worker.
const SMALL: &str = "--set workers=[] --set duration_s=0.65 --set rig.pairs_per_s=10 \
    --set rig.width_px=320 --set rig.height_px=180 --set rig.pixel_um=15 --set rig.line_time_us=88.8 \
    --set wayside[0].camera.width_px=480 --set wayside[0].camera.height_px=270 \
    --set wayside[0].camera.pixel_um=15 --set wayside[0].camera.line_time_us=59.2 \
    --set train.start_chainage_m=700 --renderer cpu";

/// Numbers from 0 to 1, the same ones in every run (SplitMix64).
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }
}

/// A folder of a test, empty.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("kills")
        .join(name);
    fs::remove_dir_all(&path).ok();
    fs::create_dir_all(&path).unwrap();
    path
}

/// The program with arguments that have no spaces.
fn metrotwin(line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_metrotwin"));
    command.args(line.split_whitespace());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn printed(output: &Output) -> String {
    let streams = [&output.stdout, &output.stderr];
    streams
        .map(|s| String::from_utf8_lossy(s).into_owned())
        .concat()
}

fn succeeds(line: &str) {
    let output = metrotwin(line).output().unwrap();
    assert!(output.status.success(), "{line}: {}", printed(&output));
}

#[allow(
    clippy::disallowed_methods,
    reason = "how long a command takes, so that kills fall into it"
)]
fn now() -> Instant {
    Instant::now()
}

/// Every file below a folder with its content.
fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn add(folder: &Path, root: &Path, all: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                add(&path, root, all);
            } else {
                let name = path
                    .strip_prefix(root)
                    .unwrap()
                    .to_string_lossy()
                    .into_owned();
                all.insert(name, fs::read(path).unwrap());
            }
        }
    }
    let mut all = BTreeMap::new();
    add(folder, folder, &mut all);
    all
}

/// A command whose results lie in one folder.
struct Killed {
    name: &'static str,
    /// The command, for a folder.
    line: fn(&Path) -> String,
    /// What the folder holds before the first command.
    prepare: Box<dyn Fn(&Path)>,
    /// What a kill must leave as it was; the count must not fall.
    kept: fn(&Path) -> usize,
    /// Whether all is done, so that the same command would refuse to do it again.
    is_done: fn(&Path) -> bool,
    /// Files whose content depends on the wall clock or on the order of threads.
    varies: fn(&str) -> bool,
    /// What must be the same in spite of that.
    same: fn(&Path, &Path),
}

/// Kills the command at drawn moments, each time in a folder of its own and sometimes twice, until the
/// command has had its share of all kills. Gives the number of kills that hit it before its end.
fn kill_at_drawn_moments(case: &Killed) {
    let all = std::env::var("METROTWIN_KILLS").map_or(10, |n| n.parse::<usize>().unwrap());
    let base = folder(case.name);
    let whole = base.join("whole");
    fs::create_dir_all(&whole).unwrap();
    (case.prepare)(&whole);
    let begin = now();
    succeeds(&(case.line)(&whole));
    let lasts_s = begin.elapsed().as_secs_f64();
    let whole_files = content(&whole);

    let mut draws = Draws(case.name.len() as u64);
    let (mut kills, mut hits) = (0, 0);
    while kills < all.div_ceil(COMMANDS) {
        let out = base.join("killed");
        fs::remove_dir_all(&out).ok();
        fs::create_dir_all(&out).unwrap();
        (case.prepare)(&out);
        let mut kept = 0;
        loop {
            let moment = Duration::from_secs_f64(1.05 * lasts_s * draws.next());
            let mut child = metrotwin(&(case.line)(&out)).spawn().unwrap();
            sleep(moment);
            hits += usize::from(child.try_wait().unwrap().is_none());
            child.kill().unwrap();
            child.wait().unwrap();
            kills += 1;
            let now = (case.kept)(&out);
            assert!(
                now >= kept,
                "{}: {now} of {kept} are left at {moment:?}",
                case.name
            );
            kept = now;
            what_is_there_is_whole(case, &out, &whole_files);
            if (case.is_done)(&out) || draws.next() < 0.6 {
                break;
            }
        }
        // Into a folder of others no command begins to write.
        let has_begun = content(&out).keys().any(|name| !name.contains("probe"));
        for name in FOREIGN.iter().filter(|_| has_begun) {
            let path = out.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, name).unwrap();
        }
        if !(case.is_done)(&out) {
            succeeds(&(case.line)(&out));
        }
        let mut files = content(&out);
        for name in FOREIGN.iter().filter(|_| has_begun) {
            assert_eq!(files.remove(*name).unwrap(), name.as_bytes());
        }
        let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&files), names(&whole_files), "{}", case.name);
        what_is_there_is_whole(case, &out, &whole_files);
        (case.same)(&out, &whole);
    }
    println!(
        "{}: {kills} kills, {hits} of them before its end ({lasts_s:.2} s)",
        case.name
    );
    fs::remove_dir_all(base).ok();
}

/// Every file under its own name is that of the undisturbed command.
fn what_is_there_is_whole(case: &Killed, out: &Path, whole: &BTreeMap<String, Vec<u8>>) {
    for (name, bytes) in content(out) {
        let is_at_work =
            name.ends_with(".part") || name.ends_with(".log") || name.contains("probe");
        if is_at_work || FOREIGN.contains(&&*name) || (case.varies)(&name) {
            continue;
        }
        let expected = whole
            .get(&name)
            .unwrap_or_else(|| panic!("{name} is stray"));
        assert!(bytes == *expected, "{}: {name} differs", case.name);
    }
}

fn same_study(a: &Path, b: &Path) {
    succeeds(&format!(
        "study compare {} {} --same",
        a.display(),
        b.display()
    ));
}

/// A study that loses rows, or whose folder blocks the next `--resume`.
#[test]
fn study_run() {
    kill_at_drawn_moments(&Killed {
        name: "study",
        line: |out| {
            let out = out.display();
            format!("study run {STUDY} --runs 3 --renderer cpu --jobs 2 --resume --out {out}")
        },
        prepare: Box::new(|_| ()),
        kept: |out| read_rows(out).map_or(0, |rows| rows.len()),
        is_done: |_| false,
        varies: |name| !name.starts_with("inputs/"),
        same: same_study,
    });
}

/// A merge that is ended between two of its files, and blocks all others.
#[test]
fn study_merge() {
    let shards = folder("shards");
    for k in 1..=2 {
        let out = shards.join(format!("shard-{k}-of-2"));
        let out = out.display();
        succeeds(&format!(
            "study run {STUDY} --renderer cpu --shard {k}/2 --out {out}"
        ));
    }
    let files = content(&shards);
    kill_at_drawn_moments(&Killed {
        name: "merge",
        line: |out| format!("study merge {}", out.display()),
        prepare: Box::new(move |out| {
            for (name, bytes) in &files {
                let path = out.join(name);
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                fs::write(path, bytes).unwrap();
            }
        }),
        kept: |out| {
            read_rows(out).map_or(0, |rows| {
                rows.iter().filter(|r| Row::is_complete(r)).count()
            })
        },
        is_done: |_| false,
        varies: |name| name == "rows.jsonl" || name == "report.html",
        same: same_study,
    });
    fs::remove_dir_all(shards).ok();
}

/// A data set with stray files, or whose folder must be cleared by hand.
#[test]
fn frames() {
    fn is_done(out: &Path) -> bool {
        let meta = fs::read(out.join("meta.json")).unwrap_or_default();
        let meta = serde_json::from_slice::<serde_json::Value>(&meta).unwrap_or_default();
        meta["finished"] == true
    }
    kill_at_drawn_moments(&Killed {
        name: "frames",
        line: |out| {
            let out = out.display();
            format!("frames scenarios/forgotten_toolbox.toml {SMALL} --out {out} --limit 3")
        },
        prepare: Box::new(|_| ()),
        kept: |out| content(out).keys().filter(|n| n.ends_with(".png")).count(),
        is_done,
        varies: |name| name == "meta.json" || name == "files.txt",
        same: |a, b| {
            for name in ["meta.json", "files.txt"] {
                assert_eq!(
                    fs::read(a.join(name)).unwrap(),
                    fs::read(b.join(name)).unwrap()
                );
            }
        },
    });
}

/// Scenarios that are half written, or stay from an interrupted command.
#[test]
fn generate() {
    kill_at_drawn_moments(&Killed {
        name: "generate",
        line: |out| format!("generate {STUDY} -n 40 --out {}", out.display()),
        prepare: Box::new(|_| ()),
        kept: |out| content(out).keys().filter(|n| n.ends_with(".toml")).count(),
        is_done: |out| out.join("index.csv").exists(),
        varies: |name| name == "files.txt",
        same: |a, b| {
            let list = |folder: &Path| fs::read(folder.join("files.txt")).unwrap();
            assert_eq!(list(a), list(b));
        },
    });
}

/// Messages that a recording, or what is left of it, holds.
fn messages(path: &Path) -> usize {
    let file = File::open(path).map(BufReader::new);
    file.map_or(0, |file| {
        DecoderApp::decode_lazy(file).filter(Result::is_ok).count()
    })
}

/// A run whose recording cannot be read after a kill, or whose next one is hindered by it.
#[test]
fn run() {
    kill_at_drawn_moments(&Killed {
        name: "run",
        line: |out| {
            let out = out.display();
            format!("run scenarios/forgotten_toolbox.toml {SMALL} --out {out}")
        },
        prepare: Box::new(|_| ()),
        kept: |_| 0,
        is_done: |_| false,
        varies: |name| name == "recording.rrd" || name == "summary.json",
        same: |a, b| {
            let count = |folder: &Path| messages(&folder.join("recording.rrd"));
            assert_eq!(count(a), count(b));
            let mut summaries = [a, b].map(|folder| {
                let text = fs::read(folder.join("summary.json")).unwrap();
                serde_json::from_slice::<serde_json::Value>(&text).unwrap()
            });
            summaries.iter_mut().for_each(strip_wall_times);
            assert_eq!(summaries[0], summaries[1]);
        },
    });
}

fn strip_wall_times(summary: &mut serde_json::Value) {
    let keys = [
        "wall_s",
        "real_time_factor",
        "wall",
        "ms_per_frame",
        "us_per_step",
    ];
    if let Some(object) = summary.as_object_mut() {
        object.retain(|key, _| !keys.contains(&key.as_str()) && !key.contains("wall"));
        object.values_mut().for_each(strip_wall_times);
    }
}

/// Until a file is there.
fn wait_for(path: &Path) {
    let came = (0..1200).any(|_| {
        sleep(Duration::from_millis(50));
        path.exists()
    });
    assert!(came, "no {}", path.display());
}

fn send(signal: &str, child: &Child) {
    // The shell's own: not every machine has the program.
    let line = format!("kill {signal} {}", child.id());
    let sent = Command::new("sh").args(["-c", &line]).status();
    assert!(sent.unwrap().success());
}

/// A run of hours, without pictures.
fn long_run(out: &Path) -> String {
    let out = out.display();
    let long =
        "--set duration_s=80000 --set stop_after_standstill_s=80000 --set train.stop_at_m=300";
    format!("run scenarios/low_adhesion.toml {long} --out {out}")
}

/// Fails where Slurm, a container or a closed terminal ends a run as a kill does; where a signal that is
/// sent twice cuts its end off.
#[cfg(target_os = "linux")]
#[test]
fn term_and_hup_end_a_run_as_ctrl_c_does() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        let out = folder(&format!("signal{signal}"));
        // In the background of a script signals are ignored, and would stay so.
        let mut command = Command::new("env");
        command
            .args(["--default-signal", env!("CARGO_BIN_EXE_metrotwin")])
            .args(long_run(&out).split_whitespace())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let child = command.spawn().unwrap();
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

/// Fails where a run under `nohup` ends with the terminal.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_that_is_ignored_from_outside_stays_ignored() {
    let out = folder("nohup");
    let line = long_run(&out);
    let program = env!("CARGO_BIN_EXE_metrotwin");
    let script = format!("trap '' HUP; exec '{program}' {line}");
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
