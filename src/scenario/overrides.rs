//! `--set key=value`: changes to a scenario from the command line.

use crate::settings::key_below;
use std::fmt;
use std::str::FromStr;
use toml::{Table, Value};

/// One change: a dotted key as in the file, and the value in TOML.
///
/// ```
/// use metrotwin::scenario::Override;
/// let mut document = "[train]\ncruise_speed_kmh = 60.0".parse::<toml::Table>()?;
/// "train.cruise_speed_kmh=80".parse::<Override>()?.apply(&mut document)?;
/// assert_eq!(document["train"]["cruise_speed_kmh"].as_integer(), Some(80));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// Dotted key: `train.cruise_speed_kmh`, `obstacles[0].mass_kg`.
    pub key: String,
    /// What it is set to.
    pub value: Value,
}

/// Why an override cannot be applied.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OverrideError {
    /// No `=`, or nothing before it.
    #[error("`{0}` is not of the form key=value; give for instance `train.cruise_speed_kmh=80`")]
    Form(String),
    /// A list has no such entry.
    #[error("`{key}`: {}", no_entry(list, *len, *index))]
    NoEntry {
        /// The whole key.
        key: String,
        /// The list.
        list: String,
        /// Its length.
        len: usize,
        /// The index asked for.
        index: usize,
    },
    /// The key leads through something that has no keys.
    #[error(
        "`{key}`: `{part}` is {kind}, which has no keys of its own{}",
        hint(kind, part)
    )]
    NotATable {
        /// The whole key.
        key: String,
        /// The part that is no table.
        part: String,
        /// What it is.
        kind: &'static str,
    },
}

fn no_entry(list: &str, len: usize, index: usize) -> String {
    match len {
        0 => format!(
            "the file has no entry in `{list}`, and --set changes entries but adds none; add \
             [[{list}]] to the file, or set the whole list: {list}=[{{ ... }}]"
        ),
        _ => format!(
            "the file has {len} entries in `{list}`, so there is no [{index}]; count from 0"
        ),
    }
}

/// A list has entries, and they have keys.
fn hint(kind: &str, part: &str) -> String {
    if kind == "a list" {
        format!("; say which entry, counted from 0: `{part}[0]`")
    } else {
        String::new()
    }
}

impl FromStr for Override {
    type Err = OverrideError;

    /// A value that is not TOML is taken as a string, so quotes may be left out.
    fn from_str(text: &str) -> Result<Self, OverrideError> {
        let form = || OverrideError::Form(text.to_owned());
        let (key, value) = text.split_once('=').ok_or_else(form)?;
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() || steps(key).is_none() {
            return Err(form());
        }
        let parsed = format!("value = {value}").parse::<Table>().ok();
        let value = parsed
            .filter(|table| table.len() == 1)
            .and_then(|mut table| table.remove("value"))
            .unwrap_or_else(|| Value::String(value.to_owned()));
        Ok(Self {
            key: key.to_owned(),
            value,
        })
    }
}

impl Override {
    /// As `key=value`, which reads as the same change.
    pub fn assignment(&self) -> String {
        format!("{}={}", self.key, self.value)
    }
}

impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "--set {}", self.assignment())
    }
}

enum Step {
    Key(String),
    Index(usize),
}

/// `a.b[2].c` in steps; `None` where a bracket or a name is wrong.
fn steps(key: &str) -> Option<Vec<Step>> {
    let mut steps = Vec::new();
    for part in key.split('.') {
        let mut pieces = part.split('[');
        let name = pieces.next().filter(|name| !name.is_empty())?;
        steps.push(Step::Key(name.to_owned()));
        for piece in pieces {
            steps.push(Step::Index(piece.strip_suffix(']')?.parse().ok()?));
        }
    }
    Some(steps)
}

/// What a document has under a dotted key.
pub(super) fn lookup<'a>(document: &'a Table, key: &str) -> Option<&'a Value> {
    let mut steps = steps(key)?.into_iter();
    let Step::Key(first) = steps.next()? else {
        return None;
    };
    steps.try_fold(document.get(&first)?, |place, step| match step {
        Step::Key(name) => place.get(name),
        Step::Index(index) => place.get(index),
    })
}

impl Override {
    /// Sets the value, with the tables that lead to it where the document does not have them yet.
    pub fn apply(&self, document: &mut Table) -> Result<(), OverrideError> {
        let mut root = Value::Table(std::mem::take(document));
        let result = self.set(&mut root);
        if let Value::Table(table) = root {
            *document = table;
        }
        result
    }

    fn set(&self, root: &mut Value) -> Result<(), OverrideError> {
        let mut place = root;
        let mut path = String::new();
        let mut is_new = false;
        for step in steps(&self.key).unwrap_or_default() {
            let kind = match place.type_str() {
                "array" => "a list",
                "integer" => "an integer",
                "table" => "a table",
                "string" => "a text",
                "float" => "a number",
                "boolean" => "a flag",
                _ => "a date",
            };
            let no_table = |path: &str| OverrideError::NotATable {
                key: self.key.clone(),
                part: path.to_owned(),
                kind,
            };
            place = match step {
                Step::Key(name) => {
                    let table = place.as_table_mut().ok_or_else(|| no_table(&path))?;
                    path = key_below(&path, &name);
                    is_new = !table.contains_key(&name);
                    table
                        .entry(name)
                        .or_insert_with(|| Value::Table(Table::new()))
                }
                Step::Index(index) if is_new => {
                    return Err(OverrideError::NoEntry {
                        key: self.key.clone(),
                        list: path,
                        len: 0,
                        index,
                    });
                }
                Step::Index(index) => {
                    let list = place.as_array_mut().ok_or_else(|| no_table(&path))?;
                    let len = list.len();
                    let entry = list.get_mut(index).ok_or_else(|| OverrideError::NoEntry {
                        key: self.key.clone(),
                        list: path.clone(),
                        len,
                        index,
                    })?;
                    path = format!("{path}[{index}]");
                    entry
                }
            };
        }
        *place = self.value.clone();
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    const FILE: &str = "duration_s = 60.0\n[train]\ncars = 6\n[[obstacles]]\nmass_kg = 1.0\n";

    fn applied(text: &str) -> Result<Table, OverrideError> {
        let mut document: Table = FILE.parse().unwrap();
        text.parse::<Override>()?.apply(&mut document)?;
        Ok(document)
    }

    /// Wrong nesting, values read as strings, lists treated as tables, lost neighbours.
    #[test]
    fn values_land_where_the_key_says() {
        let d = applied("obstacles[0].mass_kg = 2.5").unwrap();
        assert_eq!(d["obstacles"][0]["mass_kg"].as_float(), Some(2.5));
        assert_eq!(d["train"]["cars"].as_integer(), Some(6));
        let d = applied("rig.sensor.noise=false").unwrap();
        assert_eq!(d["rig"]["sensor"]["noise"].as_bool(), Some(false));
        let d = applied("track.irregularity.class=german_high").unwrap();
        let class = d["track"]["irregularity"]["class"].as_str();
        assert_eq!(class, Some("german_high"));
        // A value cannot smuggle in a second key.
        let d = applied("name=1\nseed = 4").unwrap();
        assert_eq!(d["name"].as_str(), Some("1\nseed = 4"));
    }

    /// Each kind of wrong override has its own message.
    #[test]
    fn wrong_overrides_say_why() {
        let message = |text| applied(text).unwrap_err().to_string();
        assert!(message("duration_s").contains("key=value"));
        assert!(message("=3").contains("key=value"));
        assert!(message("a..b=3").contains("key=value"));
        assert!(message("obstacles[1].mass_kg=1").contains("1 entries"));
        assert!(message("duration_s.x=1").contains("`duration_s` is a number"));
        assert!(message("obstacles.mass_kg=1").contains("is a list, which has no keys of its own; say which entry, counted from 0: `obstacles[0]`"));
        let empty = message("workers[0].mass_kg=1");
        assert!(empty.contains("no entry in `workers`") && empty.contains("[[workers]]"));
        assert!(message("train[0]=1").contains("`train` is a table"));
    }
}
