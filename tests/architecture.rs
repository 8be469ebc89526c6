//! The names that docs/architecture.md gives are names of the code.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;

/// What stands in backticks, in order.
fn quoted(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
}

/// Whether a file, or any file below a folder, has a text.
fn has(path: &Path, text: &str) -> bool {
    if path.is_dir() {
        return fs::read_dir(path)
            .unwrap()
            .any(|entry| has(&entry.unwrap().path(), text));
    }
    fs::read_to_string(path).is_ok_and(|source| source.contains(text))
}

/// A file that has moved, a function or a type that is called otherwise: each "`Type::function` in
/// `file`" must be found there, and all other paths and types somewhere in the sources.
#[test]
fn the_architecture_page_gives_names_that_exist() {
    let page = fs::read_to_string("docs/architecture.md").unwrap();
    let mut checked = 0;
    for line in page.lines() {
        let names: Vec<&str> = quoted(line).collect();
        for (k, name) in names.iter().enumerate() {
            if name.contains('/') {
                assert!(Path::new(name).exists(), "no file {name}");
            } else if let Some((owner, function)) = name.split_once("::") {
                let file = names[k..].iter().find(|n| n.starts_with("src/")).unwrap();
                for text in [format!("{owner} "), format!("fn {function}(")] {
                    let generic = text.replace(' ', "<");
                    let file = Path::new(file);
                    assert!(
                        has(file, &text) || has(file, &generic),
                        "{name} in {file:?}"
                    );
                }
            } else if name.starts_with(char::is_uppercase) && !name.contains('_') {
                let declared = ["struct", "enum", "trait"].map(|kind| format!("{kind} {name}"));
                let found = declared.iter().any(|text| has(Path::new("src"), text));
                assert!(found, "no type {name}");
            } else {
                continue;
            }
            checked += 1;
        }
    }
    assert!(checked > 40, "{checked}");
}

/// What would run on a train, and its tests, know nothing of the world: a test behind a feature would slip past a
/// build without it.
#[test]
fn the_stack_and_below_do_not_name_the_rooms_above() {
    for room in ["settings", "track", "bus", "stack"] {
        for above in ["twin", "scenario", "session", "record", "study", "cli"] {
            for root in ["crate", "metrotwin"] {
                let named = format!("use {root}::{above}::");
                assert!(
                    !has(&Path::new("src").join(room), &named),
                    "src/{room}: {named}"
                );
            }
        }
    }
    assert!(has(Path::new("src/twin"), "use crate::twin::"));
}
