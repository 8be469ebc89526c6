//! A tunnel file as text that people read: tables of tracks and switches, and one line for each element, grade, section
//! and lamp. What has its default is left out.

use super::TunnelFile;
use std::fmt::Write as _;
use toml::{Table, Value};

/// Keys in the order in which they are written; others follow in theirs.
const ORDER: [&str; 27] = [
    "name",
    "kind",
    "line_number",
    "ambient_lx",
    "daylight_lx",
    "plan_sigma_m",
    "datum",
    "latitude_deg",
    "longitude_deg",
    "height_m",
    "switches",
    "crossings",
    "track",
    "start",
    "from",
    "to",
    "from_m",
    "to_m",
    "chainage_m",
    "length_m",
    "radius_m",
    "turn",
    "cant_mm",
    "grade_permille",
    "plan",
    "grades",
    "sections",
];

/// Tables that stand under a heading of their own.
const HEADED: [&str; 4] = ["datum", "switches", "crossings", "track"];

impl TunnelFile {
    /// As text, after lines of comment.
    pub fn to_text(&self, comment: &[String]) -> Result<String, toml::ser::Error> {
        let table = Table::try_from(self)?;
        let mut text = String::new();
        for line in comment {
            let _ = writeln!(text, "{}", format!("# {line}").trim_end());
        }
        if !comment.is_empty() {
            text.push('\n');
        }
        put(&mut text, &table, |key| !HEADED.contains(&key));
        for key in HEADED {
            match table.get(key) {
                Some(Value::Table(table)) => {
                    let _ = writeln!(text, "\n[{key}]");
                    put(&mut text, table, |_| true);
                }
                Some(Value::Array(tables)) => {
                    for table in tables.iter().filter_map(Value::as_table) {
                        let _ = writeln!(text, "\n[[{key}]]");
                        put(&mut text, table, |_| true);
                    }
                }
                _ => {}
            }
        }
        Ok(text)
    }
}

/// Keys of a table, in order.
fn entries(table: &Table) -> Vec<(&str, &Value)> {
    let place = |key: &str| {
        ORDER
            .iter()
            .position(|other| *other == key)
            .unwrap_or(ORDER.len())
    };
    let mut entries: Vec<_> = table
        .iter()
        .map(|(key, value)| (key.as_str(), value))
        .collect();
    entries.retain(|(key, value)| !is_default(key, value));
    entries.sort_by_key(|(key, _)| place(key));
    entries
}

/// What a reader of the file takes for granted.
fn is_default(key: &str, value: &Value) -> bool {
    match value {
        Value::Array(list) => list.is_empty(),
        Value::Boolean(is) => key == "closes" && !is,
        Value::Float(number) => {
            let zero =
                ["cant_mm", "up_m", "heading_deg", "height_m", "plan_sigma_m"].contains(&key);
            (zero && number.abs() < f64::MIN_POSITIVE)
                || (key == "throw_s" && (number - 4.0).abs() < f64::EPSILON)
        }
        _ => false,
    }
}

fn put(text: &mut String, table: &Table, wanted: impl Fn(&str) -> bool) {
    for (key, value) in entries(table).into_iter().filter(|(key, _)| wanted(key)) {
        let lines = match value {
            Value::Array(list) => list.iter().all(Value::is_table) && list.len() > 1,
            _ => false,
        };
        match value {
            Value::Array(list) if lines => {
                let _ = writeln!(text, "{key} = [");
                for item in list {
                    let _ = writeln!(text, "    {},", inline(item));
                }
                let _ = writeln!(text, "]");
            }
            value => {
                let _ = writeln!(text, "{key} = {}", inline(value));
            }
        }
    }
}

fn inline(value: &Value) -> String {
    match value {
        Value::Table(table) => {
            let entries = entries(table).into_iter();
            let entries: Vec<String> = entries
                .map(|(key, value)| format!("{key} = {}", inline(value)))
                .collect();
            format!("{{ {} }}", entries.join(", "))
        }
        Value::Array(list) => {
            let items: Vec<String> = list.iter().map(inline).collect();
            format!("[{}]", items.join(", "))
        }
        value => value.to_string(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::settings::read_settings;

    /// Provokes: keys that are lost or put under the wrong heading, names that break the text.
    #[test]
    fn a_file_is_the_same_when_read_again() {
        for text in [
            include_str!("../../../tunnels/terminus.toml"),
            include_str!("../../../tunnels/chengdu_line1.toml"),
            include_str!("../../../tests/tunnels/scissors.toml"),
        ] {
            let mut file: TunnelFile = read_settings(text).unwrap();
            file.name = "a \"name\"\nof two lines = [".to_owned();
            let written = file.to_text(&["Of a test.".to_owned()]).unwrap();
            let again: TunnelFile = read_settings(&written).unwrap();
            assert_eq!(again, file, "{written}");
            assert!(written.starts_with("# Of a test.\n"));
        }
    }
}
