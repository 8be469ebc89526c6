//! Rows as a table in Parquet.

use super::{MEASURES, Row, StudyError, measure};
use crate::record::parquet::{Column, Kind, Table, Value, column};
use crate::scenario::draw::{Condition, ConditionError, Template, VariableSettings};
use serde_json::Value as Json;
use std::path::Path;

/// Name of the file in a study's folder.
pub const TABLE: &str = "rows.parquet";

/// Events of a study, parsed, by name.
pub fn events(template: &Template) -> Result<Vec<(String, Condition)>, ConditionError> {
    let known =
        |name: &str| template.settings.variables.contains_key(name) || measure(name).is_some();
    let events = template.settings.events.iter();
    let parse = |(name, text): (&String, &String)| {
        let condition = Condition::parse(text)?;
        let unknown = condition.names().find(|n| !known(n)).map(str::to_owned);
        match unknown {
            Some(unknown) => Err(ConditionError::Unknown(text.clone(), unknown)),
            None => Ok((name.clone(), condition)),
        }
    };
    events.map(parse).collect()
}

/// Columns that every table has, before what is drawn.
const OWN: [&str; 6] = ["index", "seed", "status", "reason", "rejected", "weight"];

/// Whether events can be told, and no name stands for two columns.
pub fn check_names(template: &Template) -> Result<(), StudyError> {
    events(template)?;
    let settings = &template.settings;
    let taken = |name: &&String| OWN.contains(&name.as_str()) || measure(name).is_some();
    let mut names = settings.variables.keys().chain(settings.events.keys());
    match names.find(taken) {
        None => Ok(()),
        Some(name) => Err(StudyError::Name(
            format!("study: `{name}`"),
            "is a column of every study; give the variable or event a name of its own".into(),
        )),
    }
}

impl Row {
    /// Whether an event happened in this run; `None` where it lacks a figure for it.
    pub fn happened(&self, event: &Condition) -> Option<bool> {
        event.holds(|name| Ok(self.number(name))).ok().flatten()
    }
}

/// Writes all rows, in order.
pub fn write(folder: &Path, template: &Template, rows: &[Row]) -> Result<(), StudyError> {
    let events = events(template)?;
    let mut columns = vec![
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
    let variables = template.settings.variables.iter().map(|(name, variable)| {
        let keys = variable.keys.join(", ");
        let unit = unit_of(name, variable);
        let meaning = format!("drawn: {}", if keys.is_empty() { name } else { &keys });
        Column {
            name: name.clone().into(),
            kind: kind(rows.iter().filter_map(|r| r.values.get(name))),
            unit: unit.into(),
            meaning: meaning.into(),
        }
    });
    columns.extend(variables);
    let named = events.iter().map(|(name, condition)| Column {
        name: name.clone().into(),
        kind: Kind::Flag,
        unit: "1".into(),
        meaning: format!("event: {}", condition.text()).into(),
    });
    columns.extend(named);
    let measures = MEASURES
        .iter()
        .map(|m| column(m.name, m.kind, m.unit, m.meaning));
    let own = OWN.len();
    let drawn = own + template.settings.variables.len();
    columns.extend(measures);

    let mut table = Table::create(folder.join(TABLE), &columns)?;
    for row in rows {
        let mut cells = vec![
            (row.index as i64).into(),
            (row.seed as i64).into(),
            row.status.name().into(),
            row.reason.clone().into(),
            row.rejected.into(),
            row.ln_weight.exp().into(),
        ];
        let variables = columns[own..drawn].iter();
        cells.extend(variables.map(|c| cell(c.kind, row.values.get(&*c.name))));
        cells.extend(events.iter().map(|(_, event)| row.happened(event).into()));
        cells.extend(
            MEASURES
                .iter()
                .map(|m| cell(m.kind, row.figures.get(m.name))),
        );
        table.push(cells)?;
    }
    table.close()?;
    Ok(())
}

/// The kind that holds all values.
fn kind<'a>(values: impl Iterator<Item = &'a Json> + Clone) -> Kind {
    let all = |is: fn(&Json) -> bool| values.clone().all(is);
    if values.clone().next().is_none() {
        Kind::Real
    } else if all(Json::is_i64) {
        Kind::Int
    } else if all(Json::is_number) {
        Kind::Real
    } else if all(Json::is_boolean) {
        Kind::Flag
    } else {
        Kind::Text
    }
}

fn cell(kind: Kind, value: Option<&Json>) -> Value {
    let Some(value) = value else {
        return Value::Null;
    };
    match kind {
        Kind::Int => value.as_i64().into(),
        Kind::Real => value.as_f64().into(),
        Kind::Flag => value.as_bool().into(),
        Kind::Text => value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned)
            .into(),
        Kind::Reals => {
            let list = value.as_array();
            list.map(|l| l.iter().filter_map(Json::as_f64).collect::<Vec<_>>())
                .into()
        }
    }
}

/// The unit of a variable: what its own name ends on tells, or the key that it sets as it is drawn. One
/// that is rescaled to a key with a unit has another, which nobody said.
pub fn unit_of(name: &str, variable: &VariableSettings) -> &'static str {
    let of_key = variable.keys.first().and_then(|key| unit_in(key));
    match (unit_in(name), of_key) {
        (Some(unit), _) => unit,
        (None, Some(_)) if variable.scale.to_bits() != 1f64.to_bits() => "",
        (None, of_key) => of_key.unwrap_or("1"),
    }
}

/// The unit that the end of a key tells.
fn unit_in(key: &str) -> Option<&'static str> {
    let last = key.rsplit('.').next().unwrap_or(key);
    let last = last.split('[').next().unwrap_or(last);
    let found = UNITS.iter().find(|(end, _)| last.ends_with(end));
    found.map(|(_, unit)| *unit)
}

/// Longer ends first.
const UNITS: &[(&str, &str)] = &[
    ("_ms_per_s", "ms/s"),
    ("_e_per_s", "e/s"),
    ("_per_s", "1/s"),
    ("_kg_per_m", "kg/m"),
    ("_c_per_m", "degC/m"),
    ("_per_m", "1/m"),
    ("_mn_m", "MN m"),
    ("_rad_s", "rad/s"),
    ("_deg_s", "deg/s"),
    ("_mps3", "m/s^3"),
    ("_mps2", "m/s^2"),
    ("_mps", "m/s"),
    ("_kmh", "km/h"),
    ("_permille", "permille"),
    ("_deg", "deg"),
    ("_rad", "rad"),
    ("_grey", "grey"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_db", "dB"),
    ("_px", "px"),
    ("_um", "um"),
    ("_mm", "mm"),
    ("_us", "us"),
    ("_ms", "ms"),
    ("_mg", "mg"),
    ("_cd", "cd"),
    ("_lx", "lx"),
    ("_kn", "kN"),
    ("_kw", "kW"),
    ("_c", "degC"),
    ("_m", "m"),
    ("_s", "s"),
    ("_n", "N"),
    ("_e", "e"),
];
