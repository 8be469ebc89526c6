//! Studies from end to end, by the program: the same rows for any number of workers, for shards, and
//! for a study that was killed; replays; and what is said of wrong input.

use crate::program::{PROGRAM, folder, metrotwin, printed, refuses, run, says, succeeds};
use metrotwin::study::{MANIFEST, Row, Study, read_rows};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

const SMALL: &str = "tests/studies/small.toml";

fn study(out: &Path, more: &str) -> Output {
    study_of(Path::new(SMALL), out, more)
}

fn study_of(file: &Path, out: &Path, more: &str) -> Output {
    run(&study_line(file, out, more))
}

fn study_line(file: &Path, out: &Path, more: &str) -> String {
    let [file, out] = [file, out].map(Path::display);
    format!("study run {file} --renderer cpu --out {out} {more}")
}

/// A copy of the small study below a folder, at the same depth, with something changed.
fn changed(base: &Path, from: &str, to: &str) -> PathBuf {
    let text = fs::read_to_string(SMALL).unwrap();
    assert!(text.contains(from));
    let (folder, tunnels) = (base.join("tests/studies"), base.join("tunnels"));
    fs::create_dir_all(&folder).unwrap();
    fs::create_dir_all(&tunnels).unwrap();
    let line = "chengdu_line1.toml";
    fs::copy(Path::new("tunnels").join(line), tunnels.join(line)).unwrap();
    fs::copy("tests/studies/steps.csv", folder.join("steps.csv")).unwrap();
    let path = folder.join("small.toml");
    fs::write(&path, text.replace(from, to)).unwrap();
    path
}

fn same(a: &Path, b: &Path) {
    let [a, b] = [a, b].map(Path::display);
    succeeds(&run(&format!("study compare {a} {b} --same")));
}

/// Order of workers that reaches a row, a shard that draws otherwise, rows lost or doubled by a kill, a
/// replay that is another run.
#[test]
fn rows_are_the_same_however_they_came() {
    let base = folder("however");
    let one = base.join("one");
    succeeds(&study(&one, "--jobs 1"));
    let rows = read_rows(&one).unwrap();
    assert_eq!(rows.len(), 12);
    assert!(rows.iter().all(|row| row.reason.is_none()), "{:?}", rows[0]);
    assert!(
        rows.iter().any(|row| row.rejected > 0),
        "the conditions turn nothing down"
    );

    let two = base.join("two");
    succeeds(&study(&two, "--jobs 2"));
    same(&one, &two);

    let shards = base.join("shards");
    for k in 1..=4 {
        let folder = shards.join(format!("shard-{k}-of-4"));
        succeeds(&study(&folder, &format!("--shard {k}/4")));
    }
    succeeds(&run(&format!("study merge {}", shards.display())));
    same(&one, &shards);

    let killed = base.join("killed");
    for _ in 0..3 {
        let line = study_line(Path::new(SMALL), &killed, "--resume");
        let mut child = metrotwin(&line)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let before = read_rows(&killed).map_or(0, |rows| rows.len());
        // Until it has done something new, or is done.
        while read_rows(&killed).map_or(0, |rows| rows.len()) < before + 2 {
            if child.try_wait().unwrap().is_some() {
                break;
            }
            sleep(Duration::from_millis(5));
        }
        child.kill().unwrap(); // SIGKILL
        child.wait().unwrap();
    }
    assert!(read_rows(&killed).unwrap().len() >= 2);
    succeeds(&study(&killed, "--resume"));
    same(&one, &killed);

    let one_text = one.display();
    let replay = run(&format!(
        "run --from-study {one_text} --index 5 --renderer cpu"
    ));
    succeeds(&replay);
    says(&replay, "equal to its row in the study");
    assert!(one.join("run-000005/recording.rrd").exists());
    fs::remove_dir_all(base).ok();
}

/// A study that stops when a figure is known well enough does so after the same run, however many
/// workers there are and however far ahead of it they have come.
#[test]
fn a_study_stops_at_the_same_run() {
    let base = folder("stops");
    let stop = "duration_s = 0.2\n[study.stop.when]\nof = \"run_m\"\nhalf_width = 0.2\n";
    let file = changed(&base, "duration_s = 1.5", stop);
    let study_with = |jobs: &str| {
        let out = base.join(jobs);
        succeeds(&study_of(&file, &out, &format!("--runs 100 --jobs {jobs}")));
        out
    };
    let (one, three) = (study_with("1"), study_with("3"));
    same(&one, &three);
    let rows = Study::open(&one).unwrap().rows().unwrap();
    assert!(
        (30..200).contains(&rows.len()) && rows.len().is_multiple_of(10),
        "{} rows",
        rows.len()
    );
    assert!(read_rows(&three).unwrap().len() >= rows.len());
    fs::remove_dir_all(base).ok();
}

/// A budget of time: no run is begun after it, all that were begun are kept, and `--resume` has the
/// same budget again.
#[test]
fn a_study_stops_in_time() {
    let base = folder("in_time");
    let file = changed(&base, "[study]", "[study.stop]\nafter_s = 0.5\n\n[study]");
    let out = base.join("out");
    let runs = |more: &str| {
        succeeds(&study_of(&file, &out, &format!("--runs 5000 {more}")));
        read_rows(&out).unwrap().len()
    };
    let first = runs("");
    assert!((1..10_000).contains(&first), "{first}");
    let second = runs("--resume");
    assert!((first + 1..10_000).contains(&second), "{first}, {second}");
    fs::remove_dir_all(base).ok();
}

/// A run that hangs: it is given up as a row that says so, the rest goes on, and the next `--resume`
/// tries it again.
#[test]
fn a_run_that_takes_too_long_is_given_up() {
    let base = folder("hung");
    let (out, whole) = (base.join("out"), base.join("whole"));
    // No run of 1500 steps and a start of the process is that short.
    succeeds(&study(&out, "--runs 1 --run-limit-s 0.001"));
    let rows = read_rows(&out).unwrap();
    assert_eq!(rows.len(), 2);
    for row in &rows {
        assert_eq!(row.status, metrotwin::study::Status::Crashed);
        let reason = row.reason.as_ref().unwrap();
        assert!(reason.contains("no word from it for 0.001 s"), "{reason}");
    }
    succeeds(&study(&out, "--runs 1 --resume"));
    succeeds(&study(&whole, "--runs 1"));
    same(&out, &whole);
    fs::remove_dir_all(base).ok();
}

/// A study goes on to more runs, and its first ones stay what they were.
#[test]
fn a_study_can_be_extended() {
    let base = folder("extended");
    succeeds(&study(&base, "--runs 2"));
    let few = read_rows(&base).unwrap();
    succeeds(&study(&base, "--runs 3 --resume"));
    let more = read_rows(&base).unwrap();
    assert_eq!((few.len(), more.len()), (4, 6));
    assert!(few.iter().zip(&more).all(|(a, b)| a == b));
    fs::remove_dir_all(base).ok();
}

/// What is wrong is said before anything is begun, and nothing that is there is lost.
#[test]
fn wrong_studies_are_refused() {
    let base = folder("refused");
    let done = base.join("done");
    succeeds(&study(&done, "--runs 1"));
    let journal = fs::read(done.join("rows.jsonl")).unwrap();
    let refused = |output: Output, what: &str| {
        refuses(&output, what);
        assert_eq!(fs::read(done.join("rows.jsonl")).unwrap(), journal);
    };
    refused(study(&done, "--runs 1"), "--resume");
    refused(
        study(&done, "--shard 1/2 --resume"),
        "the whole of it, not shard 1/2",
    );

    let other = changed(&base.join("other"), "median = 60.0", "median = 61.0");
    refused(
        study_of(&other, &done, "--resume"),
        "small.toml has changed",
    );
    for (name, from, to, what) in [
        (
            "name",
            "slipped =",
            "collision =",
            "is a column of every study",
        ),
        (
            "nothing",
            "speed_kmh < 75 || cars < 4",
            "speed_kmh < 5",
            "of 10000 draws none",
        ),
        (
            "order",
            "min = 30.0, max = 80.0",
            "min = 80.0, max = 30.0",
            "not below",
        ),
        ("key", "train.cars", "train.carz", "carz"),
        (
            "kind",
            "integer = { min = 2, max = 5 }",
            "uniform = { min = 2.0, max = 5.0 }",
            "train.cars",
        ),
        (
            "table",
            "column = \"step_s\"",
            "column = \"steps\"",
            "its columns are",
        ),
        (
            "matrix",
            "[0.7, 1.0]]",
            "[0.6, 1.0]]",
            "matrix of correlations",
        ),
        ("event", "most_slip_mps >", "most_slip >", "most_slip"),
        (
            "twice",
            "keys = [\"step_s\"]",
            "keys = [\"train.cars\"]",
            "set by `cars` too",
        ),
        (
            "seed",
            "keys = [\"step_s\"]",
            "keys = [\"seed\"]",
            "follows from the study's",
        ),
        (
            "stop",
            "[study]",
            "[study.stop.when]\nof = \"wall_s\"\nhalf_width = 1.0\n[study]",
            "`wall_s` is no event",
        ),
        ("condition", "speed_kmh < 75", "speed_kmh <", "no condition"),
    ] {
        let out = base.join("never");
        let file = changed(&base.join(name), from, to);
        refused(study_of(&file, &out, "--resume"), what);
        assert!(!out.exists(), "{name} was begun");
    }
    fs::remove_dir_all(base).ok();
}

/// Shards that are missing, half done, or of another study.
#[test]
fn shards_that_are_no_whole_are_not_merged() {
    let base = folder("shards");
    let shard = |k: u32, more: &str| {
        let folder = base.join(format!("shard-{k}-of-2"));
        succeeds(&study(&folder, &format!("--shard {k}/2 {more}")));
        folder
    };
    let merge = |what: &str| {
        let output = run(&format!("study merge {}", base.display()));
        refuses(&output, what);
        assert!(!base.join(MANIFEST).exists());
    };
    merge("no folder shard-I-of-N");
    shard(1, "--runs 2");
    merge("shards 2/2 are missing");
    let second = shard(2, "--runs 3");
    merge("its number of runs differs");
    fs::remove_dir_all(&second).unwrap();
    let second = shard(2, "--runs 2");
    let rows = fs::read_to_string(second.join("rows.jsonl")).unwrap();
    let first = rows.lines().next().unwrap();
    fs::write(second.join("rows.jsonl"), format!("{first}\n")).unwrap();
    merge("1 of 2 rows");
    let manifest = fs::read_to_string(second.join(MANIFEST)).unwrap();
    let of_another = manifest.replacen("\": \"", "\": \"0", 1);
    assert_ne!(of_another, manifest);
    fs::write(second.join(MANIFEST), of_another).unwrap();
    merge("are not of one study");
    fs::remove_dir_all(base).ok();
}

/// Shards of a study that was merged, tried again where runs had crashed, and merged once more: what
/// counts is kept; and a copy of a shard under another name is none.
#[test]
fn a_merge_keeps_what_counts() {
    let base = folder("merge");
    let whole = base.join("whole");
    succeeds(&study(&whole, "--runs 1"));
    let all = base.join("all");
    for (k, limit_s) in [("1/2", "3600"), ("2/2", "0.001")] {
        let out = all.join(format!("shard-{}", k.replace('/', "-of-")));
        let more = format!("--runs 1 --shard {k} --run-limit-s {limit_s}");
        succeeds(&study(&out, &more));
    }
    let merge = || succeeds(&run(&format!("study merge {}", all.display())));
    merge();
    assert!(!read_rows(&all).unwrap().iter().all(Row::is_complete));
    succeeds(&study(&all, "--runs 1 --resume"));
    let (shard, copy) = (all.join("shard-1-of-2"), all.join("shard-1-of-2.bak"));
    fs::create_dir(&copy).unwrap();
    for file in [MANIFEST, "rows.jsonl"] {
        fs::copy(shard.join(file), copy.join(file)).unwrap();
    }
    merge();
    same(&all, &whole);
    fs::remove_dir_all(base).ok();
}

/// A merge that ended between its files, here for want of a table: the next one goes on.
#[test]
fn a_merge_that_was_cut_off_does_not_block_the_next() {
    let base = folder("cut_off");
    for k in 1..=2 {
        let out = base.join(format!("shard-{k}-of-2"));
        succeeds(&study(&out, &format!("--runs 1 --shard {k}/2")));
    }
    let merge = || run(&format!("study merge {}", base.display()));
    succeeds(&merge());
    // As before the first one, but for the list of files.
    for name in [MANIFEST, "rows.jsonl", "rows.parquet"] {
        fs::remove_file(base.join(name)).unwrap();
    }
    let in_the_way = base.join("rows.parquet.part");
    fs::create_dir(&in_the_way).unwrap();
    assert!(!merge().status.success());
    assert!(base.join("rows.jsonl").exists());
    fs::remove_dir(&in_the_way).unwrap();
    succeeds(&merge());
    assert_eq!(read_rows(&base).unwrap().len(), 2);
    fs::remove_dir_all(base).ok();
}

/// The end of a study ends its workers, whatever they are at: this one was asked for a run of minutes.
#[cfg(target_os = "linux")]
#[test]
fn no_worker_outlives_its_study() {
    let base = folder("orphans");
    let file = changed(&base, "duration_s = 1.5", "duration_s = 4000.0");
    let out = base.join("out");
    let line = study_line(&file, &out, "--jobs 1");
    let mut child = metrotwin(&line).stderr(Stdio::null()).spawn().unwrap();
    let out = out.display().to_string();
    let workers = || -> Vec<PathBuf> {
        let all = fs::read_dir("/proc")
            .unwrap()
            .filter_map(|e| Some(e.ok()?.path()));
        all.filter(|p| {
            let line = fs::read(p.join("cmdline")).unwrap_or_default();
            let line = String::from_utf8_lossy(&line);
            line.contains("worker") && line.contains(&out)
        })
        .collect()
    };
    let wait = |wanted: bool| {
        (0..600).any(|_| {
            sleep(Duration::from_millis(50));
            workers().is_empty() != wanted
        })
    };
    assert!(wait(true), "no worker was begun");
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(wait(false), "a worker goes on by itself");
    fs::remove_dir_all(base).ok();
}

/// A disk that is full: the study stops with a clear word, and goes on when there is room.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_loses_nothing() {
    let base = folder("full");
    let out = base.join("out");
    // No file over 4 KiB: so full is the disk for the journal.
    let line = study_line(Path::new(SMALL), &out, "--jobs 1 --resume");
    let line = format!("trap '' XFSZ; ulimit -f 4; exec '{PROGRAM}' {line}");
    // The copies of the inputs are larger: they are there already.
    succeeds(&study(&out, "--runs 1"));
    let output = Command::new("bash").args(["-c", &line]).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", printed(&output));
    says(&output, "make room and give --resume");
    let kept = read_rows(&out).unwrap().len();
    assert!((2..12).contains(&kept), "{kept} rows");
    succeeds(&study(&out, "--resume"));
    let whole = base.join("whole");
    succeeds(&study(&whole, ""));
    same(&out, &whole);
    fs::remove_dir_all(base).ok();
}

/// The same file for ever, complete, and fit to be run.
#[test]
fn generated_scenarios_stand_by_themselves() {
    let base = folder("generate");
    let generate = |out: &Path, n: u32| {
        let out = out.display();
        succeeds(&run(&format!("generate {SMALL} -n {n} --out {out}")));
    };
    let (few, many) = (base.join("few"), base.join("many"));
    generate(&few, 3);
    generate(&many, 8);
    for k in 0..3 {
        let name = format!("small_{k:06}.toml");
        let [a, b] = [&few, &many].map(|f| fs::read_to_string(f.join(&name)).unwrap());
        assert_eq!(a, b);
        // Defaults stand there too, with what they mean.
        assert!(a.contains("pairs_per_s") || a.contains("latency_ms"), "{a}");
        assert!(
            a.contains("# From the last row of a frame to the result, ms."),
            "{a}"
        );
        succeeds(&run(&format!("check {}", few.join(&name).display())));
    }
    let index = fs::read_to_string(many.join("index.csv")).unwrap();
    assert_eq!(index.lines().count(), 9);
    assert!(
        index.starts_with("index,file,seed,rejected,weight,cars,gap_m,rail,speed_kmh,step_s\n")
    );
    fs::remove_dir_all(base).ok();
}

/// Scenarios of an earlier, larger draw that stay, or files of others that do not.
#[test]
fn scenarios_drawn_again_leave_no_stale_ones() {
    let out = folder("stale");
    fs::write(out.join("mine.toml"), "kept").unwrap();
    let generate = |more: &str| run(&format!("generate {SMALL} --out {} {more}", out.display()));
    let drawn = || {
        let all = fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name());
        let all = all.map(|name| name.into_string().unwrap());
        all.filter(|name| name.starts_with("small_")).count()
    };
    succeeds(&generate("-n 9"));
    refuses(&generate("-n 2"), "--force");
    assert_eq!(drawn(), 9);
    // As of an interrupted draw: only the same one goes on with it.
    fs::remove_file(out.join("index.csv")).unwrap();
    refuses(
        &generate("-n 9 --seed 5"),
        "small_000000.toml of another draw",
    );
    refuses(&generate("-n 2"), "small_000002.toml of another draw");
    succeeds(&generate("-n 9"));
    succeeds(&generate("-n 2 --force"));
    assert_eq!(drawn(), 2);
    assert_eq!(fs::read_to_string(out.join("mine.toml")).unwrap(), "kept");
    // A file of this name that `generate` has not written.
    fs::write(out.join("small_000002.toml"), "kept").unwrap();
    refuses(&generate("-n 9 --force"), "small_000002.toml");
    assert_eq!(
        fs::read_to_string(out.join("small_000002.toml")).unwrap(),
        "kept"
    );
    fs::remove_dir_all(out).ok();
}

/// A script of which a part of a path would be run, or filled in by Slurm.
#[test]
fn submit_refuses_what_a_script_would_read_otherwise() {
    let base = folder("submit");
    for name in ["a\ntouch x #", "a'b", "50%"] {
        let out = base.join(name);
        let mut command = metrotwin(&format!("study submit {SMALL} --shards 2 --dry-run --out"));
        refuses(
            &command.arg(&out).output().unwrap(),
            "cannot stand in a script",
        );
        assert!(!out.exists());
    }
    fs::remove_dir_all(base).ok();
}

/// Fails where `--set` gives other rows than the same value in the file, a study goes on with other values than it began
/// with, a replay or a merge forgets them, or a draw takes them back.
#[test]
fn a_study_may_set_values_for_all_runs() {
    let base = folder("set");
    let set = "--set duration_s=0.5 --set name=shorter";
    let out = base.join("set");
    succeeds(&study(&out, &format!("--runs 1 {set}")));
    let file = changed(&base, "duration_s = 1.5", "duration_s = 0.5");
    let edited = base.join("edited");
    succeeds(&study_of(&file, &edited, "--runs 1"));
    same(&out, &edited);
    let whole = base.join("whole");
    succeeds(&study(&whole, "--runs 1"));
    let [a, b] = [&out, &whole].map(|path| path.display().to_string());
    assert!(
        !run(&format!("study compare {a} {b} --same"))
            .status
            .success()
    );

    let rows = fs::read_to_string(out.join("rows.jsonl")).unwrap();
    for (more, told) in [
        ("", "--set: duration_s=0.5 name=\"shorter\" then, none now"),
        (
            "--set duration_s=0.6 --set name=shorter",
            "--set: duration_s=0.5",
        ),
    ] {
        refuses(&study(&out, &format!("--runs 2 --resume {more}")), told);
    }
    assert_eq!(fs::read_to_string(out.join("rows.jsonl")).unwrap(), rows);
    succeeds(&study(&out, &format!("--runs 2 --resume {set}")));
    assert_eq!(read_rows(&out).unwrap().len(), 4);
    let replay = run(&format!(
        "run --from-study {a} --index 1 --no-recording --renderer cpu"
    ));
    succeeds(&replay);
    says(&replay, "equal to its row in the study");
    says(&replay, "shorter: 0.5 s simulated");

    let shards = base.join("shards");
    for k in 1..=2 {
        let folder = shards.join(format!("shard-{k}-of-2"));
        succeeds(&study(&folder, &format!("--runs 2 --shard {k}/2 {set}")));
    }
    succeeds(&run(&format!("study merge {}", shards.display())));
    same(&out, &shards);

    let none = base.join("none");
    for (more, told) in [
        (
            "--set train.cars=3",
            "train.cars: is drawn by the study's variable `cars`",
        ),
        ("--set train={cars=3}", "is drawn by the study's variable"),
        ("--set seed=3", "seed: is drawn for each run"),
        ("--set duration=3", "duration"),
        ("--set duration_s=-3", "duration_s"),
    ] {
        refuses(&study(&none, more), told);
        assert!(!none.exists(), "{more}");
    }
    fs::remove_dir_all(base).ok();
}

/// Weights that are not those of the densities: an event of probability 1e-5, from 1500 runs.
/// P(N(0, 2) > 6.0316) = 1.0000e-5; a run in the proposal hits half of the time, and the estimate's own
/// sigma is 4 % (checked below by its interval); the bound of 30 % is the one that users were promised.
#[test]
fn val_a_rare_event_is_estimated() {
    use metrotwin::scenario::sampling::Template;
    use metrotwin::study::Digest;
    let base = folder("rare");
    let file = Path::new("tests/studies/rare.toml");
    succeeds(&study_of(file, &base, ""));
    let template = Template::load(file).unwrap();
    let digest = Digest::of(&template, &read_rows(&base).unwrap());
    let found = digest.events[0].weighted.unwrap();
    let (truth, rate) = (1.0e-5, found.rate.unwrap());
    assert!((rate.value / truth - 1.0).abs() < 0.3, "{found:?}");
    assert!((rate.low..=rate.high).contains(&truth), "{found:?}");
    assert!(rate.high - rate.low < 0.6 * truth, "{found:?}");
    // Of 1500 plain runs, 0.015 would have hit.
    assert!(
        found.events > 500 && found.effective_events > 100.0,
        "{found:?}"
    );
    fs::remove_dir_all(base).ok();
}
