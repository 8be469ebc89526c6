//! `metrotwin check` on files that nobody wrote: shipped ones with changes by structure and by text.
//!
//! No panic, no answer over 2 s, no memory over 500 MB. `METROTWIN_FUZZ` is the number of files, for
//! instance 1000000; `METROTWIN_FUZZ_CASE` is one of them again.

use crate::fuzz::{Draw, cases, check_memory, execute};
use metrotwin::cli::check_text;
use metrotwin::scenario::{Scenario, ScenarioFile};
use metrotwin::session::{self, RendererChoice, RunOptions};
use metrotwin::settings::{FileError, Problem, Settings, read_settings};
use metrotwin::track::Tunnel;
use metrotwin::twin::physics::VehicleFile;
use std::fs;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Files where the number is not given: some seconds.
const FEW: u64 = 3000;
/// One of so many is checked with all files that it names, and its answer printed.
const WHOLE_EVERY: u64 = 25;
/// One of so many is run, if it is right.
const RUN_EVERY: u64 = 50;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Scenario,
    Tunnel,
    Vehicle,
}

/// A shipped file.
struct Shipped {
    path: PathBuf,
    text: String,
    table: Table,
    kind: Kind,
}

fn shipped() -> Vec<Shipped> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [
        ("scenarios", Kind::Scenario),
        ("scenarios/studies", Kind::Scenario),
        ("scenarios/vehicles", Kind::Vehicle),
        ("tunnels", Kind::Tunnel),
    ];
    let mut files = Vec::new();
    for (folder, kind) in folders {
        let entries = fs::read_dir(root.join(folder)).unwrap();
        let paths = entries.map(|entry| entry.unwrap().path());
        for path in paths.filter(|path| path.extension().is_some_and(|e| e == "toml")) {
            let text = fs::read_to_string(&path).unwrap();
            let table = text.parse().unwrap();
            files.push(Shipped {
                path,
                text,
                table,
                kind,
            });
        }
    }
    files.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(files.len() >= 15);
    files
}

const NUMBERS: [&str; 22] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "7",
    "255",
    "256",
    "65535",
    "65536",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "1e-300",
    "1e-10",
    "1e10",
    "1e13",
    "1e300",
    "-1e300",
    "nan",
    "inf",
    "-inf",
];

/// Any value, mostly a hostile one.
fn odd_value(draw: &mut Draw) -> Value {
    match draw.below(8) {
        0 => Value::String(String::new()),
        1 => Value::String("\u{1b}[2J \u{202e}\0".to_owned()),
        2 => Value::String("x".repeat(1 << draw.below(17))),
        3 => Value::Boolean(draw.below(2) == 0),
        4 => Value::Array(vec![Value::Integer(1); draw.below(5)]),
        5 => Value::Table(Table::new()),
        6 => (0..1 + draw.below(100)).fold(Value::Integer(1), |value, _| Value::Array(vec![value])),
        _ => {
            let text = format!("v = {}", draw.pick(&NUMBERS));
            text.parse::<Table>().unwrap().remove("v").unwrap()
        }
    }
}

/// Changes something in a table or below it.
fn change_table(table: &mut Table, donor: &Table, draw: &mut Draw) {
    let keys: Vec<String> = table.keys().cloned().collect();
    if keys.is_empty() {
        table.insert("odd".to_owned(), odd_value(draw));
        return;
    }
    let key = draw.pick(&keys).clone();
    let is_deep = matches!(table[&key], Value::Table(_) | Value::Array(_));
    if is_deep && draw.below(4) > 0 {
        change_value(&mut table[&key], donor, draw);
        return;
    }
    match draw.below(7) {
        0 => _ = table.remove(&key),
        1 => {
            let value = table[&key].clone();
            table.insert(format!("{key}_x"), value);
        }
        2 => {
            let value = table.remove(&key).unwrap();
            let other = draw.pick(&keys).clone();
            table.insert(other, value);
        }
        3 => {
            let donors: Vec<_> = donor.iter().collect();
            let (key, value) = *draw.pick(&donors);
            table.insert(key.clone(), value.clone());
        }
        _ => _ = table.insert(key, odd_value(draw)),
    }
}

fn change_value(value: &mut Value, donor: &Table, draw: &mut Draw) {
    match value {
        Value::Table(table) => change_table(table, donor, draw),
        Value::Array(list) if !list.is_empty() => {
            let place = draw.below(list.len());
            match draw.below(6) {
                0 => _ = list.remove(place),
                1 => {
                    let copy = list[place].clone();
                    let times = 1 << draw.below(9);
                    list.extend(std::iter::repeat_n(copy, times));
                }
                2 => list[place] = odd_value(draw),
                _ => change_value(&mut list[place], donor, draw),
            }
        }
        other => *other = odd_value(draw),
    }
}

/// Changes a text without regard to what it means.
fn change_text(text: &str, donor: &str, draw: &mut Draw) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..1 + draw.below(4) {
        let at = draw.below(bytes.len() + 1);
        let end = (at + draw.below(40)).min(bytes.len());
        match draw.below(7) {
            0 => _ = bytes.drain(at..end),
            1 => bytes.insert(at, draw.word() as u8),
            2 => {
                let from = draw.below(donor.len());
                let to = (from + draw.below(200)).min(donor.len());
                _ = bytes.splice(at..end, donor.as_bytes()[from..to].iter().copied());
            }
            3 => {
                let byte = *draw.pick(b"[({\"'= \n-9.");
                _ = bytes.splice(at..at, std::iter::repeat_n(byte, 1 << draw.below(17)));
            }
            4 => {
                let copy = bytes[at..end].to_vec();
                _ = bytes.splice(at..at, copy);
            }
            5 => bytes.truncate(at),
            _ => change_number(&mut bytes, at, draw),
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Puts another number in place of the first one after a place.
fn change_number(bytes: &mut Vec<u8>, at: usize, draw: &mut Draw) {
    let rest = &bytes[at..];
    let Some(start) = rest.iter().position(u8::is_ascii_digit) else {
        return;
    };
    let is_part = |byte: &u8| byte.is_ascii_digit() || b"._eE".contains(byte);
    let length = rest[start..].iter().position(|b| !is_part(b));
    let (start, length) = (at + start, length.unwrap_or(rest.len() - start));
    _ = bytes.splice(start..start + length, draw.pick(&NUMBERS).bytes());
}

/// A file with some changes.
fn mutant(files: &[Shipped], case: u64) -> (&Shipped, String) {
    let mut draw = Draw::of(case);
    let (file, donor) = (draw.pick(files), draw.pick(files));
    if draw.below(2) == 0 {
        return (file, change_text(&file.text, &donor.text, &mut draw));
    }
    let mut table = file.table.clone();
    for _ in 0..1 + draw.below(3) {
        change_table(&mut table, &donor.table, &mut draw);
    }
    let text = toml::to_string(&table).unwrap_or_default();
    (file, text)
}

/// Reads and checks a text by itself; whether it is right.
fn parsed(kind: Kind, text: &str) -> bool {
    let checked = match kind {
        Kind::Tunnel => Tunnel::from_toml(text).map(|_| ()),
        Kind::Vehicle => VehicleFile::from_toml(text).map(|_| ()),
        Kind::Scenario => read_settings::<ScenarioFile>(text).and_then(|file| {
            let mut problems = Vec::new();
            file.check("", &mut problems);
            match problems.is_empty() {
                true => Ok(()),
                false => Err(FileError::Problems(problems)),
            }
        }),
    };
    if let Err(FileError::Problems(problems) | FileError::FirstProblems(problems)) = &checked {
        assert!(problems.len() <= 1000 && problems.iter().all(is_bounded));
    }
    checked.is_ok()
}

fn is_bounded(problem: &Problem) -> bool {
    problem.to_string().chars().count() < 2500
}

/// Runs a scenario for 50 ms without images.
fn short_run(path: &Path, text: &str) {
    let Ok(mut scenario) = Scenario::from_text(path, text, &[]) else {
        return;
    };
    scenario.file.duration_s = 0.05;
    scenario.file.bench = None;
    scenario.wayside.clear();
    for onboard in &mut scenario.onboard {
        onboard.rig = None;
    }
    let options = RunOptions {
        renderer: RendererChoice::Cpu,
        ..RunOptions::default()
    };
    // A run may fail; what it may not do is panic or take for ever.
    _ = session::run(&scenario, &options, &mut []);
}

/// Provokes: a panic, an answer that takes for ever, a message or memory without bounds, by any file.
#[test]
fn any_file_is_answered() {
    let files = shipped();
    let all = cases(FEW);
    let count = all.end - all.start;
    let (mut right, mut whole, mut runs) = (0, 0, 0);
    for case in all {
        let (file, text) = mutant(&files, case);
        let name = file.path.display().to_string();
        let is_right = execute(case, &name, || parsed(file.kind, &text));
        right += u64::from(is_right);
        if case % WHOLE_EVERY == 0 {
            whole += 1;
            let said = execute(case, &name, || check_text(&file.path, &text));
            let length = said.unwrap_or_else(|error| error).len();
            assert!(length < 200_000, "case {case}");
        }
        if is_right && file.kind == Kind::Scenario && case % RUN_EVERY == 0 {
            runs += 1;
            execute(case, &name, || short_run(&file.path, &text));
        }
        if case % 1000 == 0 {
            check_memory();
        }
    }
    check_memory();
    println!("{count} files: {right} right, {whole} checked whole, {runs} run");
    assert!(count < FEW || right > count / 100, "{right} right");
}
