//! Study folders that were torn, mixed up or edited by hand: every reader gives an answer or says what is
//! wrong, quickly and in little memory.

use crate::fuzz::{Draw, cases, check_memory, execute, mutate, mutated_text};
use metrotwin::study::{Digest, MANIFEST, Study, StudyError, compare, merge, report};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const JOURNAL: &str = "rows.jsonl";
/// Executions without a word from the environment.
const FEW: u64 = 1500;

/// A study of six rows, whole and in two shards.
struct Folders {
    base: PathBuf,
}

impl Folders {
    fn new(name: &str) -> Self {
        let base = std::env::temp_dir().join(format!("metrotwin-{}-{name}", std::process::id()));
        fs::remove_dir_all(&base).ok();
        for (folder, shard) in [
            ("whole", None),
            ("parts/shard-1-of-2", Some("1/2")),
            ("parts/shard-2-of-2", Some("2/2")),
        ] {
            let mut study = Command::new(env!("CARGO_BIN_EXE_metrotwin"));
            study.args([
                "study",
                "run",
                "tests/studies/small.toml",
                "--runs",
                "3",
                "--renderer",
                "cpu",
            ]);
            study.arg("--out").arg(base.join(folder));
            study.args(shard.iter().flat_map(|shard| ["--shard", shard]));
            let output = study.output().unwrap();
            assert!(
                output.status.success(),
                "{}",
                String::from_utf8_lossy(&output.stderr)
            );
        }
        Self { base }
    }

    fn path(&self, folder: &str) -> PathBuf {
        self.base.join(folder)
    }
}

impl Drop for Folders {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.base).ok();
    }
}

/// A file with something changed: a line of a journal or the manifest by structure, any of them as text.
fn changed(draw: &mut Draw, text: &[u8]) -> Vec<u8> {
    if draw.one_in(3) {
        return mutated_text(draw, text);
    }
    let text = String::from_utf8_lossy(text);
    let mut lines: Vec<String> = match serde_json::from_str::<toml::Value>(&text) {
        Ok(_) => vec![text.into_owned()],
        Err(_) => text.lines().map(str::to_owned).collect(),
    };
    for _ in 0..=draw.below(3) {
        let at = draw.below(lines.len());
        // Nothing that JSON has and TOML has not: `null` becomes a text.
        let line = lines[at]
            .replace(":null", ":\"null\"")
            .replace(": null", ": \"null\"");
        if let Ok(mut value) = serde_json::from_str(&line) {
            mutate(draw, &mut value);
            lines[at] = serde_json::to_string(&value)
                .unwrap()
                .replace("\"null\"", "null");
        }
        let other = draw.below(lines.len());
        match draw.below(8) {
            0 => lines.swap(at, other),
            1 => lines.push(lines[at].clone()),
            _ => {}
        }
    }
    (lines.join("\n") + "\n").into_bytes()
}

/// All that is asked of a folder. The page with its plots is the dearest, and is asked for seldom.
fn read(folder: &Path, other: &Path, with_page: bool) -> Result<usize, StudyError> {
    let study = Study::open(folder)?;
    let rows = study.rows()?;
    let digest = Digest::of(&study.template, &rows);
    if with_page {
        report(&study, &digest, &rows)?;
        compare(folder, other)?;
    }
    Ok(digest.runs)
}

/// A panic, an endless loop, memory by a number that somebody wrote, or an error that says nothing.
#[test]
fn no_study_folder_breaks_a_reader() {
    let folders = Folders::new("fuzzed");
    let (whole, parts) = (folders.path("whole"), folders.path("parts"));
    let shard = parts.join("shard-1-of-2");
    let (mut accepted, mut refused) = (0, 0);
    for case in cases(FEW) {
        let draw = &mut Draw::of(case);
        let merged = draw.one_in(20);
        let folder = if merged { &shard } else { &whole };
        let file = if draw.one_in(3) { MANIFEST } else { JOURNAL };
        let path = folder.join(file);
        let before = fs::read(&path).unwrap();
        fs::write(&path, changed(draw, &before)).unwrap();
        let with_page = draw.one_in(40);
        let answer = execute(case, file, || match merged {
            true => merge(&parts).map(|rows| rows.len()),
            false => read(&whole, &whole, with_page),
        });
        match answer {
            Ok(_) => accepted += 1,
            Err(error) => {
                let text = error.to_string();
                assert!(
                    text.len() > 20 && text.len() < 20_000,
                    "case {case}: {text}"
                );
                refused += 1;
            }
        }
        fs::write(&path, before).unwrap();
        for made in [MANIFEST, JOURNAL] {
            fs::remove_file(parts.join(made)).ok();
        }
        if case % 100 == 0 {
            check_memory();
        }
    }
    check_memory();
    eprintln!("{accepted} accepted, {refused} refused");
}

/// What somebody who edits a manifest may write: each is refused with the file, the key and what to do.
#[test]
fn edited_manifests_are_refused_by_key() {
    let folders = Folders::new("edited");
    let shard = folders.path("parts/shard-1-of-2");
    let path = shard.join(MANIFEST);
    let text = fs::read_to_string(&path).unwrap();
    let study = "\"study\": \"tests/studies/small.toml\"";
    for (from, to, key) in [
        ("\"number\": 1", "\"number\": 0", "`shard` is 0 of 2"),
        ("\"of\": 2", "\"of\": 0", "`shard` is 1 of 0"),
        (
            "\"of\": 2",
            "\"of\": 1000000000000",
            "`shard` is 1 of 1000000000000",
        ),
        ("\"runs\": 6", "\"runs\": 0", "`runs` is 0"),
        ("\"runs\": 6", "\"runs\": 18446744073709551615", "`runs` is"),
        (
            study,
            "\"study\": \"/etc/passwd\"",
            "`study` is `/etc/passwd`",
        ),
        (
            study,
            "\"study\": \"../../other.toml\"",
            "`study` is `../../other.toml`",
        ),
        (study, "\"study\": \"\"", "`study` is ``"),
        (
            "\"tests/studies/steps.csv\"",
            "\"../steps.csv\"",
            "`inputs` names `../steps.csv`",
        ),
    ] {
        assert!(text.contains(from), "no {from} in {text}");
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
        for answer in [
            merge(&folders.path("parts")).map(|_| ()),
            Study::open(&shard).map(|_| ()),
        ] {
            let error = answer.unwrap_err().to_string();
            for said in [key, MANIFEST, "put the file back"] {
                assert!(error.contains(said), "no {said} in: {error}");
            }
        }
    }
    fs::write(&path, text.replacen("\"runs\": 6", "\"runs\": 7", 1)).unwrap();
    let error = Study::open(&shard).unwrap_err().to_string();
    assert!(
        error.contains("no multiple of the 2 combinations"),
        "{error}"
    );
}
