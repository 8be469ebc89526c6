//! The program as tests start it, what it says, and folders for what it writes.

#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "no test uses all of it, and a test fails by panicking"
)]

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub const REPOSITORY: &str = env!("CARGO_MANIFEST_DIR");
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_metrotwin");

/// A folder of a test, empty.
pub fn folder(test: &str) -> PathBuf {
    let of_all = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME"));
    let folder = of_all.join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The program with arguments.
pub fn program(args: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Command {
    let mut command = Command::new(PROGRAM);
    command.args(args).current_dir(REPOSITORY);
    command.env("NO_COLOR", "1");
    command
}

/// The program with arguments that have no spaces.
pub fn metrotwin(line: &str) -> Command {
    program(line.split_whitespace())
}

/// What it comes to.
pub fn run(line: &str) -> Output {
    metrotwin(line).output().unwrap()
}

/// All that a command said.
pub fn printed(output: &Output) -> String {
    let streams = [&output.stdout, &output.stderr];
    let texts = streams.map(|s| String::from_utf8_lossy(s).into_owned());
    texts.join("\n")
}

pub fn succeeds(output: &Output) {
    assert!(output.status.success(), "{}", printed(output));
}

pub fn says(output: &Output, what: &str) {
    let printed = printed(output);
    assert!(printed.contains(what), "no `{what}` in: {printed}");
}

/// Wrong input, of which it says `what`.
pub fn refuses(output: &Output, what: &str) {
    assert_eq!(output.status.code(), Some(2), "{}", printed(output));
    says(output, what);
}

/// Every file below a folder with its content.
pub fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn add(folder: &Path, root: &Path, all: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                add(&path, root, all);
            } else {
                let name = path.strip_prefix(root).unwrap().to_string_lossy();
                all.insert(name.into_owned(), fs::read(&path).unwrap());
            }
        }
    }
    let mut all = BTreeMap::new();
    add(folder, folder, &mut all);
    all
}
