//! Rows as a table in Parquet.

use super::{MEASURES, Result, Row, Status, measure};
use crate::record::parquet::{Column, Kind, ParquetTable, column};
use crate::scenario::sampling::{Condition, Template, VariableSettings};
use crate::settings::{self, Problem, did_you_mean};
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::Path;

/// Name of the file in a study's folder.
pub const TABLE: &str = "rows.parquet";

/// Columns that every table has, before what is drawn.
const OWN: [Column; 6] = [
    column("index", Kind::Int, "1", "which run"),
    column("seed", Kind::Int, "1", "seed of its scenario"),
    column(
        "status",
        Kind::Text,
        "",
        "complete, failed, invalid or crashed",
    ),
    column("reason", Kind::Text, "", "why, where it is not complete"),
    column(
        "rejected",
        Kind::Int,
        "1",
        "draws before it that did not meet the conditions",
    ),
    column(
        "weight",
        Kind::Real,
        "1",
        "of importance sampling, 1 without",
    ),
];

/// [`OWN`] columns, and the others by name.
#[derive(Serialize)]
struct RowCells<'a> {
    index: u64,
    seed: u64,
    status: Status,
    reason: Option<&'a str>,
    rejected: u32,
    weight: f64,
    #[serde(flatten)]
    others: Map<String, Value>,
}

/// What a wrong name in a condition on results was meant to be.
pub fn meant(name: &str, template: &Template) -> String {
    let variables = template.settings.variables.keys().cloned();
    let figures = MEASURES.iter().map(|measure| measure.name.to_owned());
    let known = variables.chain(figures).filter(|known| known != name);
    let known: Vec<String> = known.collect();
    match did_you_mean(name, &known) {
        Some(similar) => format!("did you mean `{similar}`?"),
        None => "`metrotwin study figures` lists what may be named, and the signs".to_owned(),
    }
}

/// Whether events name what there is, and no name stands for two columns.
pub fn check_names(template: &Template) -> Result {
    let settings = &template.settings;
    let known = |name: &str| settings.variables.contains_key(name) || measure(name).is_some();
    for (event, condition) in &template.events {
        if let Some(name) = condition.names().find(|name| !known(name)) {
            let what = format!("`{name}` is no variable of this study, and no figure of a run");
            let key = format!("study.events.{event}");
            return Err(template
                .wrong(Problem::new(key, what, meant(name, template)))
                .into());
        }
    }
    let is_taken = |name: &str| OWN.iter().any(|c| c.name == name) || measure(name).is_some();
    let variables = settings.variables.keys().map(|name| ("variables", name));
    let events = settings.events.keys().map(|name| ("events", name));
    match variables.chain(events).find(|(_, name)| is_taken(name)) {
        None => Ok(()),
        Some((table, name)) => Err(template
            .wrong(Problem::new(
                format!("study.{table}.{name}"),
                format!("`{name}` is a column of every study"),
                "give it a name of its own",
            ))
            .into()),
    }
}

impl Row {
    /// Whether an event happened in this run; `None` where it lacks a figure for it.
    pub fn happened(&self, event: &Condition) -> Option<bool> {
        event.holds(|name| Ok(self.number(name))).ok().flatten()
    }

    /// The same for rates: `None` too of a run that is not complete, whose figures are those of a part
    /// of it.
    pub fn outcome(&self, event: &Condition) -> Option<bool> {
        self.happened(event).filter(|_| self.is_complete())
    }
}

/// Writes all rows, which are in order.
pub fn write<'a>(
    folder: &Path,
    template: &Template,
    rows: impl IntoIterator<Item = &'a Row>,
) -> Result {
    let rows: Vec<&Row> = rows.into_iter().collect();
    let variables = template.settings.variables.iter().map(|(name, variable)| {
        let keys = variable.keys.join(", ");
        let meaning = format!("drawn: {}", if keys.is_empty() { name } else { &keys });
        Column {
            name: name.clone().into(),
            kind: kind(rows.iter().filter_map(|r| r.values.get(name))),
            unit: unit_of(name, variable).into(),
            meaning: meaning.into(),
        }
    });
    let variables: Vec<_> = variables.collect();
    let events = template.events.iter().map(|(name, condition)| Column {
        name: name.clone().into(),
        kind: Kind::Flag,
        unit: "1".into(),
        meaning: format!("event: {}", condition.text()).into(),
    });
    let measures = MEASURES
        .iter()
        .map(|m| column(m.name, m.kind, m.unit, m.meaning));
    let columns = OWN.into_iter().chain(variables.iter().cloned());
    let columns: Vec<_> = columns.chain(events).chain(measures).collect();

    let mut table = ParquetTable::create(folder.join(TABLE), &columns)?;
    for row in rows {
        let mut others = row.figures.clone();
        for column in &variables {
            if let Some(value) = row.values.get(&*column.name) {
                others.insert(column.name.clone().into_owned(), cell(column.kind, value));
            }
        }
        for (name, event) in &template.events {
            others.insert(name.clone(), row.happened(event).into());
        }
        table.push(&RowCells {
            index: row.index,
            seed: row.seed,
            status: row.status,
            reason: row.reason.as_deref(),
            rejected: row.rejected,
            weight: row.ln_weight.exp(),
            others,
        })?;
    }
    table.close()?;
    Ok(())
}

/// The kind that holds all values.
fn kind<'a>(values: impl Iterator<Item = &'a Value> + Clone) -> Kind {
    let all = |is: fn(&Value) -> bool| values.clone().all(is);
    if values.clone().next().is_none() {
        Kind::Real
    } else if all(Value::is_i64) {
        Kind::Int
    } else if all(Value::is_number) {
        Kind::Real
    } else if all(Value::is_boolean) {
        Kind::Flag
    } else {
        Kind::Text
    }
}

/// Among texts, what is none stands as it would in a file.
fn cell(kind: Kind, value: &Value) -> Value {
    match value {
        Value::String(_) => value.clone(),
        _ if kind == Kind::Text => value.to_string().into(),
        _ => value.clone(),
    }
}

/// The unit of a variable: that of its own name's end, else that of the key that it sets. Where it is
/// rescaled to a key with a unit, its own unit is unknown.
pub fn unit_of(name: &str, variable: &VariableSettings) -> &'static str {
    let of_key = variable.keys.first().and_then(|key| unit_in(key));
    match (unit_in(name), of_key) {
        (Some(unit), _) => unit,
        (None, Some(_)) if variable.scale.to_bits() != 1f64.to_bits() => "",
        (None, of_key) => of_key.unwrap_or("1"),
    }
}

/// The unit by the end of a dotted key.
fn unit_in(key: &str) -> Option<&'static str> {
    let last = key.rsplit('.').next().unwrap_or(key);
    settings::unit_in(last.split('[').next().unwrap_or(last))
}
