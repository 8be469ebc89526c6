//! Tables of measured values that variables are drawn from.

use super::settings::{Distribution, StudySettings};
use crate::settings::Problem;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Value;

/// All tables of a study, by the name that the study has for the file.
#[derive(Clone, Debug, Default)]
pub struct Tables {
    tables: BTreeMap<String, Columns>,
}

#[derive(Clone, Debug)]
struct Columns {
    headers: Vec<String>,
    rows: Vec<Vec<Value>>,
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
            if let Some(table) = tables.get(file)
                && !table.headers.contains(column)
            {
                problems.push(Problem::new(
                    key,
                    format!("{file} has no column `{column}`"),
                    format!("its columns are {}", table.headers.join(", ")),
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
    pub fn values(&self, file: &str, column: &str) -> Vec<&Value> {
        let of = |table: &'_ Columns| table.headers.iter().position(|h| h == column);
        let found = self.tables.get(file).and_then(|t| Some((t, of(t)?)));
        let cells = found
            .into_iter()
            .flat_map(|(t, k)| t.rows.iter().map(move |row| row.get(k)));
        cells.flatten().collect()
    }

    /// The value of a column in the row that a share `u` of all rows lies before.
    pub fn value(&self, file: &str, column: &str, u: f64) -> Option<Value> {
        let table = self.tables.get(file)?;
        let row = ((u * table.rows.len() as f64) as usize).min(table.rows.len() - 1);
        let column = table.headers.iter().position(|h| h == column)?;
        table.rows[row].get(column).cloned()
    }
}

fn read(path: &Path) -> Result<Columns, String> {
    let failed = |e: csv::Error| format!("{}: {e}", path.display());
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(failed)?;
    let headers = reader.headers().map_err(failed)?.iter().map(str::to_owned);
    let headers = headers.collect();
    let row = |record: csv::StringRecord| record.iter().map(value).collect();
    let rows = reader.records().map(|r| r.map(row));
    let rows: Vec<_> = rows.collect::<Result<_, _>>().map_err(failed)?;
    if rows.is_empty() {
        return Err(format!("{} has no rows", path.display()));
    }
    Ok(Columns { headers, rows })
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
