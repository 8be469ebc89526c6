//! Kills at drawn moments, of every command that writes files: nothing is lost but what was in flight,
//! what has its name is whole, files of others stay, and the next same command comes to what an
//! undisturbed one comes to.
//!
//! `METROTWIN_KILLS` is the number of kills of all commands together, 10 without it.

use crate::fuzz::Draw;
use crate::program::{content, folder, metrotwin, run, succeeds};
use crate::recordings::messages;
use metrotwin::study::{Row, read_rows};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Stdio;
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

#[allow(
    clippy::disallowed_methods,
    reason = "how long a command takes, so that kills fall into it"
)]
fn now() -> Instant {
    Instant::now()
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

/// Kills the command at drawn moments, each time in a folder of its own and sometimes twice, until it has
/// been hit before its end as often as is its share of all kills. Most kills must hit.
fn kill_at_drawn_moments(case: &Killed) {
    let all = std::env::var("METROTWIN_KILLS").map_or(10, |n| n.parse::<usize>().unwrap());
    let base = folder(&format!("of_{}", case.name));
    let whole = base.join("whole");
    fs::create_dir_all(&whole).unwrap();
    (case.prepare)(&whole);
    let begin = now();
    succeeds(&run(&(case.line)(&whole)));
    let lasts_s = begin.elapsed().as_secs_f64();
    let whole_files = content(&whole);

    let seed = (case.name.bytes()).fold(0, |seed: u64, byte| seed * 31 + u64::from(byte));
    let mut draw = Draw::of(seed);
    let wanted = all.div_ceil(COMMANDS);
    let (mut kills, mut hits) = (0, 0);
    while hits < wanted {
        let out = base.join("killed");
        fs::remove_dir_all(&out).ok();
        fs::create_dir_all(&out).unwrap();
        (case.prepare)(&out);
        let mut kept = 0;
        loop {
            let moment = Duration::from_secs_f64(lasts_s * draw.share());
            let mut command = metrotwin(&(case.line)(&out));
            let mut child = (command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()).unwrap();
            sleep(moment);
            let is_hit = child.try_wait().unwrap().is_none();
            hits += usize::from(is_hit);
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
            if !is_hit || (case.is_done)(&out) || draw.share() < 0.6 {
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
            succeeds(&run(&(case.line)(&out)));
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
    let what = format!(
        "{}: {kills} kills, {hits} of them before its end ({lasts_s:.2} s)",
        case.name
    );
    println!("{what}");
    assert!(kills <= 2 * wanted + 4, "{what}");
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
    let [a, b] = [a, b].map(Path::display);
    succeeds(&run(&format!("study compare {a} {b} --same")));
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
    let shards = folder("killed_shards");
    for k in 1..=2 {
        let out = shards.join(format!("shard-{k}-of-2"));
        let out = out.display();
        succeeds(&run(&format!(
            "study run {STUDY} --renderer cpu --shard {k}/2 --out {out}"
        )));
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
        varies: |name| ["rows.jsonl", "report.html", "files.txt"].contains(&name),
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

/// A run whose recording cannot be read after a kill, or whose next one is hindered by it.
#[test]
fn single_run() {
    kill_at_drawn_moments(&Killed {
        name: "run",
        line: |out| {
            let out = out.display();
            format!("run scenarios/forgotten_toolbox.toml {SMALL} --out {out}")
        },
        prepare: Box::new(|_| ()),
        // The next run begins a recording of its own.
        kept: |out| {
            messages(&out.join("recording.rrd.part"));
            0
        },
        is_done: |_| false,
        varies: |name| ["recording.rrd", "summary.json", "files.txt"].contains(&name),
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
