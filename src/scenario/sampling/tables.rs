//! Tables of measured values that variables are drawn from.

use super::settings::{Distribution, StudySettings};
use crate::settings::{Problem, ReadLimit, read_bytes};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Value;

/// Headers, each with its cells.
type Columns = Vec<(String, Vec<Value>)>;

/// All tables of a study, by the name that the study has for the file.
#[derive(Clone, Debug, Default)]
pub struct Tables {
    tables: BTreeMap<String, Columns>,
}

impl Tables {
    /// Reads those that variables name; relative paths count from `folder`.
    pub fn read(settings: &StudySettings, folder: &Path, problems: &mut Vec<Problem>) -> Self {
        let mut tables: BTreeMap<String, Columns> = BTreeMap::new();
        for (name, variable) in &settings.variables {
            let Distribution::Table { file, column } = &variable.from else {
                continue;
            };
            let key = format!("study.variables.{name}.from");
            if !tables.contains_key(file) {
                match read(&folder.join(file)) {
                    Ok(table) => _ = tables.insert(file.clone(), table),
                    Err(what) => {
                        let remedy =
                            "give a CSV file with a line of headers and rows of equal length";
                        problems.push(Problem::new(key.clone(), what, remedy));
                        continue;
                    }
                }
            }
            let headers: Vec<&str> = tables[file].iter().map(|(h, _)| h.as_str()).collect();
            if !headers.contains(&column.as_str()) {
                problems.push(Problem::new(
                    key,
                    format!("{file} has no column `{column}`"),
                    format!("its columns are {}", headers.join(", ")),
                ));
            }
        }
        Self { tables }
    }

    /// Paths of all.
    pub fn files(&self) -> Vec<PathBuf> {
        self.tables.keys().map(PathBuf::from).collect()
    }

    /// All values of a column.
    pub fn values(&self, file: &str, column: &str) -> &[Value] {
        let columns = self.tables.get(file).into_iter().flatten();
        let mut cells = columns.filter(|(header, _)| header == column);
        cells.next().map_or(&[], |(_, cells)| cells)
    }

    /// The value of a column in the row that a share `u` of all rows lies before.
    pub fn value(&self, file: &str, column: &str, u: f64) -> Option<Value> {
        let cells = self.values(file, column);
        let row = (u * cells.len() as f64) as usize;
        cells.get(row).or(cells.last()).cloned()
    }
}

/// A table of measured values has fewer.
const MOST_COLUMNS: usize = 1000;

fn read(path: &Path) -> Result<Columns, String> {
    let failed = |e: csv::Error| format!("{}: {e}", path.display());
    let text = read_bytes(path, ReadLimit::CSV)
        .map_err(|error| format!("cannot read {}: {error}", path.display()))?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_slice());
    let headers = reader.headers().map_err(failed)?;
    if headers.len() > MOST_COLUMNS {
        let count = headers.len();
        return Err(format!(
            "{} has {count} columns, more than {MOST_COLUMNS}",
            path.display()
        ));
    }
    let headers = headers.iter();
    let mut columns: Columns = headers.map(|h| (h.to_owned(), Vec::new())).collect();
    for record in reader.records() {
        for ((_, cells), cell) in columns.iter_mut().zip(&record.map_err(failed)?) {
            cells.push(value(cell));
        }
    }
    if columns.iter().all(|(_, cells)| cells.is_empty()) {
        return Err(format!("{} has no rows", path.display()));
    }
    Ok(columns)
}

/// A number where it is one.
fn value(cell: &str) -> Value {
    if let Ok(x) = cell.parse() {
        Value::Integer(x)
    } else if let Ok(x) = cell.parse() {
        Value::Float(x)
    } else {
        Value::String(cell.to_owned())
    }
}
