//! A drawn scenario as a file by itself: complete, every key with its value, and every key with what
//! it means.

use super::{Inputs, ScenarioSample, Template};
use crate::scenario::{ScenarioError, ScenarioFile};
use crate::settings::{Problem, key_below};
use serde_json::Value as Json;
use std::fmt::Write;
use std::path::Path;
use toml::{Table, Value};

/// Width of comment lines.
const WIDTH: usize = 96;

impl Template {
    /// The text of a draw's scenario file, which names the copies of its inputs below a folder.
    pub fn text_of(
        &self,
        sample: &ScenarioSample,
        inputs: &Inputs,
        folder: &Path,
    ) -> Result<String, ScenarioError> {
        let mut file = self.concrete(sample)?;
        inputs.rename(&mut file, folder);
        let name = format!("{}_{:06}", file.name, sample.index);
        let head = self.heading(sample, &name);
        file.name = name;
        let text = complete(&file).map_err(|error| {
            let what = format!("cannot be written as a file: {error}");
            self.wrong(Problem::new("", what, "change what is drawn"))
        })?;
        Ok(head + &text)
    }

    fn heading(&self, sample: &ScenarioSample, name: &str) -> String {
        let study = &self.file.name;
        let mut text = format!(
            "# {name}: run {} of the study {study}, seed {}, drawn by metrotwin {}.\n",
            sample.index,
            self.settings.seed,
            env!("CARGO_PKG_VERSION")
        );
        for (variable, value) in &sample.values {
            let keys = self
                .settings
                .variables
                .get(variable)
                .map(|v| v.keys.join(", "));
            let keys = keys.filter(|k| !k.is_empty()).map(|k| format!("  ->  {k}"));
            text += &format!("#   {variable} = {value}{}\n", keys.unwrap_or_default());
        }
        if sample.rejected > 0 {
            text += &format!(
                "# {} draws before did not meet the conditions.\n",
                sample.rejected
            );
        }
        text + "# Every key stands here, with what it means.\n\n"
    }
}

/// The text of a file with all its keys, their values and their documentation.
pub fn complete(file: &ScenarioFile) -> Result<String, toml::ser::Error> {
    let document = Table::try_from(file)?;
    let writer = Writer {
        schema: schemars::schema_for!(ScenarioFile).to_value(),
    };
    let mut text = String::new();
    writer.table(&mut text, &document, &writer.schema, "");
    Ok(text)
}

struct Writer {
    schema: Json,
}

impl Writer {
    /// A table's own keys first, then the tables below it, in TOML's order.
    fn table(&self, text: &mut String, table: &Table, schema: &Json, path: &str) {
        let (below, own): (Vec<_>, Vec<_>) = table.iter().partition(|(_, v)| is_section(v));
        for (key, value) in own {
            self.comment(text, self.property(schema, key));
            _ = writeln!(text, "{} = {}", quoted(key), value);
        }
        for (key, value) in below {
            let property = self.property(schema, key);
            let path = key_below(path, &quoted(key));
            let [open, close] = match value.is_array() {
                true => ["[[", "]]"],
                false => ["[", "]"],
            };
            let entries = value
                .as_array()
                .map_or(std::slice::from_ref(value), |list| list);
            for (k, entry) in entries.iter().enumerate() {
                text.push('\n');
                if k == 0 {
                    self.comment(text, property);
                }
                _ = writeln!(text, "{open}{path}{close}");
                let of_entry = property.map_or(&Json::Null, |p| p.get("items").unwrap_or(p));
                if let Some(table) = entry.as_table() {
                    self.table(text, table, self.resolved(of_entry), &path);
                }
            }
        }
    }

    /// What the schema says of a key.
    fn property<'a>(&'a self, schema: &'a Json, key: &str) -> Option<&'a Json> {
        schema.get("properties")?.get(key)
    }

    /// A schema with its reference followed; of an optional part, the part.
    fn resolved<'a>(&'a self, schema: &'a Json) -> &'a Json {
        let any = schema.get("anyOf").and_then(|a| a.get(0)).unwrap_or(schema);
        let name = any.get("$ref").and_then(Json::as_str);
        let name = name.and_then(|r| r.strip_prefix("#/$defs/"));
        let found = name.and_then(|name| self.schema.get("$defs")?.get(name));
        found.unwrap_or(any)
    }

    fn comment(&self, text: &mut String, property: Option<&Json>) {
        let meaning = property.and_then(|p| p.get("description")?.as_str());
        for line in meaning.iter().flat_map(|s| wrapped(s)) {
            _ = writeln!(text, "# {line}");
        }
    }
}

/// Whether a value is written as a section of its own: tables that hold keys, and lists of such. What
/// is one of several kinds (a table with a single key, or a tag) stays on its line.
fn is_section(value: &Value) -> bool {
    match value {
        Value::Table(table) => table.len() > 1 || table.is_empty(),
        Value::Array(list) => !list.is_empty() && list.iter().all(|v| v.is_table()),
        _ => false,
    }
}

fn quoted(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.chars().all(bare) {
        key.to_owned()
    } else {
        Value::String(key.to_owned()).to_string()
    }
}

fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().map_or(0, |l| l.chars().count());
        if line > 0 && line + word.chars().count() + 3 > WIDTH {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}
