use super::*;
use crate::settings::{Problem, did_you_mean, locate};
use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Root {
    name: String,
    #[serde(default)]
    lamps: Lamps,
    #[serde(default)]
    obstacles: Vec<Obstacle>,
    #[serde(default)]
    renderer: Renderer,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Lamps {
    spacing_m: f64,
    chip_us: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Obstacle {
    mass_kg: f64,
    #[serde(default)]
    shape: Option<Shape>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum Shape {
    Sphere { radius_m: f64 },
    Box { size_m: [f64; 3] },
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Renderer {
    #[default]
    Auto,
    Cpu,
}

fn problems(text: &str) -> Vec<Problem> {
    match read_toml::<Root>(text) {
        Err(FileError::Problems(problems) | FileError::FirstProblems(problems)) => problems,
        other => panic!("{other:?}"),
    }
}

/// Provokes: stopping at the first fault, a wrong path, a suggestion that does not help.
#[test]
fn all_faults_are_listed_at_once() {
    let text = r#"
        name = "x"
        colour = 3
        renderer = "cpuu"

        [lamps]
        spacing_mm = 10.0
        chip_us = "45"

        [[obstacles]]
        mass_kg = 1.0

        [[obstacles]]
        mass_g = 1.0
        mass_kg = 2.0
        shape = { kind = "sphere", radius_m = 1.0, radios_m = 1.0 }
    "#;
    let found = problems(text);
    let listed = |key: &str, part: &str| {
        assert!(
            found
                .iter()
                .any(|p| p.key == key && p.to_string().contains(part)),
            "{key}, {part}: {found:#?}"
        );
    };
    listed("colour", "keys that may stand here: name");
    listed("renderer", "did you mean `cpu`?");
    listed("lamps.spacing_mm", "did you mean `spacing_m`?");
    listed("lamps.chip_us", "give a number");
    listed("obstacles[1].mass_g", "did you mean `mass_kg`?");
    listed("obstacles[1].shape.radios_m", "did you mean `radius_m`?");
    assert_eq!(found.len(), 6, "{found:#?}");
}

/// Provokes: a missing key listed without its path, or listed again because its wrong value was
/// taken out.
#[test]
fn missing_keys_have_their_path() {
    let found = problems("name = 'x'\n[[obstacles]]\nmass_kg = 1\n[[obstacles]]\n");
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].key, "obstacles[1].mass_kg");
    let found = problems("name = 3\n");
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].key, "name");
    assert_eq!(problems("")[0].key, "name");
}

#[test]
fn broken_text_is_told_with_its_place() {
    match read_toml::<Root>("name = 'x'\nlamps = [1,\n") {
        Err(FileError::Syntax { span, .. }) => assert!(span.unwrap().start >= 19),
        other => panic!("{other:?}"),
    }
}

/// Provokes: spans of the wrong entry of an array, or of nothing where a key is missing.
#[test]
fn keys_are_found_in_the_text() {
    let text = "name = 'x'\n[lamps]\nspacing_m = 10.0\n[[obstacles]]\nmass_kg = 1.5\n[[obstacles]]\nmass_kg = 2.5\n";
    let at = |key: &str| &text[locate(text, key).unwrap()];
    assert_eq!(at("lamps.spacing_m"), "10.0");
    assert_eq!(at("obstacles[1].mass_kg"), "2.5");
    assert_eq!(at("lamps.chip_us"), "lamps");
    assert!(at("obstacles[0].shape").starts_with("[[obstacles]]"));
    assert_eq!(at("lamps (lamp 7)"), at("nothing"));
    assert!(locate("a = [", "a").is_none());
}

#[test]
fn suggestions_are_near_or_none() {
    let known = ["spacing_m", "height_m", "power_w"].map(str::to_owned);
    assert_eq!(did_you_mean("spacing_mm", &known), Some("spacing_m"));
    assert_eq!(did_you_mean("spacing", &known), Some("spacing_m"));
    assert_eq!(did_you_mean("power_kw", &known), Some("power_w"));
    assert_eq!(did_you_mean("hieght_m", &known), Some("height_m"));
    assert_eq!(did_you_mean("colour", &known), None);
}

/// Provokes: a search that ends at a key that is missing, or at a kind that is none; what follows from
/// a wrong kind told as a problem of its own; a kind without the names that it may have.
#[test]
fn a_missing_key_hides_no_other() {
    let text = r#"
        colour = 3
        [lamps]
        chip_us = "45"
        [[obstacles]]
        shape = { kind = 7, radius_m = 1.0 }
        [[obstacles]]
        mass_kg = 1.0
        shape = { kind = "box", size_m = [1.0, 2.0] }
        [[obstacles]]
        mass_kg = true
    "#;
    let found = problems(text);
    let keys: Vec<_> = found.iter().map(|p| p.key.as_str()).collect();
    for key in [
        "name",
        "colour",
        "lamps.chip_us",
        "obstacles[0].mass_kg",
        "obstacles[0].shape.kind",
        "obstacles[2].mass_kg",
    ] {
        assert!(keys.contains(&key), "{key}: {found:#?}");
    }
    let kind = found.iter().find(|p| p.key.ends_with("kind")).unwrap();
    assert_eq!(kind.remedy, "give one of: sphere, box");
    assert!(keys.iter().any(|key| key.starts_with("obstacles[1].shape")));
    assert_eq!(found.len(), 7, "{found:#?}");
}

/// Provokes: words of the parser in place of those of a user.
#[test]
fn values_of_the_wrong_kind_are_told_in_plain_words() {
    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Kinds {
        count: u64,
        index: u8,
        large: u8,
        name: String,
        on: bool,
        list: Vec<f64>,
        three: [f64; 3],
        table: Option<Lamps>,
        level: f64,
    }
    let text = "count = -1\nindex = 1.5\nlarge = 256\nname = 3\non = 'yes'\nlist = 4\nthree = [1.0]\ntable = 5\n\
                level = [1]";
    let Err(FileError::Problems(found)) = read_toml::<Kinds>(text) else {
        panic!("nothing is wrong");
    };
    let said: Vec<String> = found.iter().map(Problem::to_string).collect();
    for sentence in [
        "count: is the whole number -1; give a whole number, 0 or more",
        "index: is the number 1.5; give a whole number, 0 or more",
        "large: is the whole number 256; give a smaller whole number",
        "name: is the whole number 3; give a text in quotes",
        "on: is the text \"yes\"; give true or false",
        "list: is the whole number 4; give a list, in [ ]",
        "three: has 1 elements; give a list of 3 elements",
        "table: is the whole number 5; give a table of keys, in { } or under a heading in [ ]",
        "level: is a list; give a number",
    ] {
        assert!(said.iter().any(|s| s == sentence), "{sentence}: {said:#?}");
    }
    assert_eq!(found.len(), 9, "{said:#?}");
    let rust = [
        "f64", "u64", "u8", "struct", "sequence", "invalid", "integer",
    ];
    let words = said.join("\n");
    assert!(rust.iter().all(|word| !words.contains(word)), "{words}");
}

/// Provokes: work that grows with the number of problems times the size, a value of any length in a
/// message.
#[test]
fn very_many_problems_take_bounded_work() {
    let bad = |k: usize| format!("[[obstacles]]\nbad{k} = \"{}\"\n", "x".repeat(80));
    let text = format!("name = 'x'\n{}", (0..8000).map(bad).collect::<String>());
    let Err(error @ FileError::FirstProblems(_)) = read_toml::<Root>(&text) else {
        panic!("all of them were sought");
    };
    assert!(error.to_string().ends_with("there may be more problems"));
    let text = format!(
        "name = 'x'\n{}",
        (0..8000).map(|k| format!("b{k} = 3\n")).collect::<String>()
    );
    let said = read_toml::<Root>(&text).unwrap_err().to_string();
    let last = said.lines().last().unwrap();
    assert!(
        last.starts_with("at least ") && last.ends_with(" more problems are not shown"),
        "{last}"
    );
    let long = format!("name = 'x'\nrenderer = '{}'", "y".repeat(1_000_000));
    assert!(problems(&long)[0].to_string().len() < 3000);
}
