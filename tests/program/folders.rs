//! What a command finds in a folder: files of others stay, results are what they were made as, and what is
//! read has an end.

use crate::program::{content, folder, program, refuses, run, says, succeeds};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output};

const STUDY: &str = "tests/studies/small.toml";

fn study(out: &Path, more: &str) -> Output {
    let out = out.display();
    run(&format!(
        "study run {STUDY} --renderer cpu --runs 1 --out {out} {more}"
    ))
}

/// A run of a moment without pictures.
fn short_run(out: &Path) -> Output {
    let out = out.display();
    run(&format!(
        "run scenarios/low_adhesion.toml --set duration_s=0.1 --out {out}"
    ))
}

fn frames(out: &Path, more: &str) -> Output {
    let out = out.display();
    run(&format!(
        "frames scenarios/static_bench.toml --renderer cpu --labels none --limit 1 --out {out} {more}"
    ))
}

/// Fails where a result is written over a file that no command of its kind has written.
#[test]
fn files_of_others_are_not_written_over() {
    let base = folder("others");
    let of_study = [
        "report.html",
        "study.json",
        "rows.jsonl",
        "rows.parquet",
        "study.lock",
        "rows.parquet.part",
        "inputs/tunnels/chengdu_line1.toml",
    ];
    let of_run = ["summary.json", "recording.rrd", "files.txt"];
    let of_study = of_study.map(|name| (name, "study"));
    let of_run = of_run.map(|name| (name, "run"));
    for (k, (name, command)) in of_study.into_iter().chain(of_run).enumerate() {
        let out = base.join(k.to_string());
        let path = out.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, "mine").unwrap();
        let output = match command {
            "study" => study(&out, ""),
            _ => short_run(&out),
        };
        refuses(&output, name);
        says(
            &output,
            "is there already, and this command has not written it",
        );
        assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
        // Inputs are held against the folder when it is locked.
        assert!(
            content(&out).len() == 1 || name.starts_with("inputs/"),
            "{name}"
        );
    }
}

/// Fails where a folder cannot be written again, or another file in it is lost by that.
#[test]
fn results_are_written_again_beside_files_of_others() {
    let out = folder("again");
    fs::write(out.join("notes.txt"), "mine").unwrap();
    succeeds(&short_run(&out));
    succeeds(&short_run(&out));
    assert_eq!(fs::read_to_string(out.join("notes.txt")).unwrap(), "mine");
    let out = folder("again_study");
    fs::write(out.join("notes.txt"), "mine").unwrap();
    succeeds(&study(&out, ""));
    succeeds(&study(&out, "--resume"));
    succeeds(&run(&format!("study report {}", out.display())));
    assert_eq!(fs::read_to_string(out.join("notes.txt")).unwrap(), "mine");
}

/// Fails where files are written outside the folder through a link in it.
#[test]
fn links_in_a_folder_are_not_followed() {
    let base = folder("links");
    let theirs = base.join("theirs");
    fs::create_dir_all(&theirs).unwrap();
    for (k, name) in ["images", "inputs"].into_iter().enumerate() {
        let out = base.join(k.to_string());
        fs::create_dir(&out).unwrap();
        symlink(&theirs, out.join(name)).unwrap();
        refuses(&frames(&out, "--force"), name);
    }
    let out = base.join("study");
    fs::create_dir(&out).unwrap();
    symlink(&theirs, out.join("inputs")).unwrap();
    refuses(&study(&out, ""), "inputs");
    assert!(content(&theirs).is_empty());

    let out = base.join("resumed");
    succeeds(&study(&out, ""));
    let file = base.join("file");
    for name in ["rows.jsonl", "study.lock"] {
        let path = out.join(name);
        let kept = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        fs::write(&file, "no line break").unwrap();
        symlink(&file, &path).unwrap();
        refuses(&study(&out, "--resume"), name);
        assert_eq!(fs::read_to_string(&file).unwrap(), "no line break");
        fs::remove_file(&path).unwrap();
        fs::write(&path, kept).unwrap();
    }
    succeeds(&study(&out, "--resume"));
}

/// Fails where an edited folder gives other results without a word.
#[test]
fn an_edited_study_is_told() {
    let out = folder("edited");
    succeeds(&study(&out, ""));
    let path = out.display();
    let all = [
        format!("study report {path}"),
        format!("study compare {path} {path} --same"),
        format!("run --from-study {path} --index 0"),
    ];
    let told = |name: &str, what: &str| {
        for line in &all {
            let output = run(line);
            refuses(&output, what);
            says(&output, name);
        }
        let output = study(&out, "--resume");
        refuses(&output, what);
        says(&output, name);
    };
    for (name, from, to) in [
        ("inputs/tests/studies/small.toml", "seed = 11", "seed = 12"),
        ("inputs/tests/studies/steps.csv", "\n", "\n "),
    ] {
        let input = out.join(name);
        let text = fs::read_to_string(&input).unwrap();
        fs::write(&input, text.replacen(from, to, 1)).unwrap();
        told(name, "is not what the study was run with");
        fs::write(&input, text).unwrap();
    }
    let journal = out.join("rows.jsonl");
    let rows = fs::read_to_string(&journal).unwrap();
    let first = rows.lines().next().unwrap();
    // Rows come in the order in which they end.
    let far = first.replacen("\"index\":", "\"index\":100000000000", 1);
    assert_ne!(first, far);
    fs::write(&journal, format!("{rows}{far}\n")).unwrap();
    told("rows.jsonl", "is none of the study's 2");
    fs::write(&journal, format!("{rows}{first}\n")).unwrap();
    told("rows.jsonl", "is there twice");
    fs::write(&journal, &rows).unwrap();
    all.iter().for_each(|line| succeeds(&run(line)));
}

/// Fails where a pipe or a device in a folder is waited for or read without end.
#[test]
fn pipes_and_devices_are_not_read() {
    let base = folder("pipes");
    let out = base.join("study");
    succeeds(&study(&out, ""));
    for name in ["study.json", "rows.jsonl"] {
        let path = out.join(name);
        let kept = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        make_pipe(&path);
        let report = || run(&format!("study report {}", out.display()));
        refuses(&report(), name);
        refuses(&study(&out, "--resume"), name);
        fs::remove_file(&path).unwrap();
        symlink("/dev/zero", &path).unwrap();
        refuses(&report(), "no regular file");
        fs::remove_file(&path).unwrap();
        fs::write(&path, kept).unwrap();
    }
    let set = base.join("set");
    fs::create_dir(&set).unwrap();
    make_pipe(&set.join("meta.json"));
    refuses(&frames(&set, ""), "--force");
    let drawn = base.join("drawn");
    let generate = || run(&format!("generate {STUDY} -n 1 --out {}", drawn.display()));
    succeeds(&generate());
    fs::remove_file(drawn.join("index.csv")).unwrap();
    let scenario = drawn.join("small_000000.toml");
    fs::remove_file(&scenario).unwrap();
    make_pipe(&scenario);
    refuses(&generate(), "small_000000.toml");
}

fn make_pipe(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status();
    assert!(made.unwrap().success());
}

/// Fails where an edited scenario, or an edited input of it, is drawn anew when the table is missing.
#[test]
fn edited_scenarios_are_kept() {
    let out = folder("drawn");
    let generate = |more: &[&str]| {
        let mut command = program(["generate", STUDY, "-n", "2", "--out"]);
        command.arg(&out).args(more).output().unwrap()
    };
    succeeds(&generate(&[]));
    fs::remove_file(out.join("index.csv")).unwrap();
    for name in ["small_000001.toml", "inputs/tunnels/chengdu_line1.toml"] {
        let path = out.join(name);
        let drawn = fs::read_to_string(&path).unwrap();
        let edited = format!("{drawn}# mine\n");
        fs::write(&path, &edited).unwrap();
        refuses(&generate(&[]), name);
        assert_eq!(fs::read_to_string(&path).unwrap(), edited);
        fs::write(&path, drawn).unwrap();
    }
    fs::write(out.join("small_000001.toml"), "name = \"mine\"").unwrap();
    succeeds(&generate(&["--force"]));
}
