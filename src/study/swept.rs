//! What the rows of a study come to for each value of a variable that it sweeps.
//!
//! All runs with a value count together, whatever the other variables are. Figures that are lists stand here too: the
//! numbers of all these runs, each of which counts for one; their intervals are by runs.

use super::digest::{is_shown, varies};
use super::{EventDigest, FigureDigest, MEASURES, Measure, Row};
use crate::record::parquet::Kind;
use crate::scenario::sampling::Template;
use serde::Serialize;

/// Events and figures by the values of a variable.
#[derive(Clone, Debug, Serialize)]
pub struct SweptDigest {
    /// The variable.
    pub variable: String,
    /// Events, in the order of their names.
    pub events: Vec<ByValue<EventDigest>>,
    /// Figures that vary, in the order of columns.
    pub figures: Vec<ByValue<FigureDigest>>,
}

/// An event or a figure by value.
#[derive(Clone, Debug, Serialize)]
pub struct ByValue<T> {
    /// Its name.
    pub name: String,
    /// For each value that there are runs of, in the order of the sweep.
    pub values: Vec<ValueDigest<T>>,
}

/// A value of the variable, and what its runs come to.
#[derive(Clone, Debug, Serialize)]
pub struct ValueDigest<T> {
    /// The value.
    pub value: String,
    /// The event or figure in the runs that have it.
    pub digest: T,
}

/// The runs with one value.
struct Group<'a> {
    value: String,
    rows: Vec<&'a Row>,
}

impl SweptDigest {
    /// One for each swept variable, in the order of their names.
    pub fn all(template: &Template, rows: &[&Row]) -> Vec<Self> {
        let variables = template.settings.variables.iter();
        let swept = variables.filter(|(_, variable)| variable.from.is_swept());
        let of = swept.map(|(name, variable)| {
            let values = variable.from.swept().into_iter();
            let groups: Vec<_> = values.map(|value| Group::of(name, &value, rows)).collect();
            Self::of(template, name, &groups)
        });
        of.collect()
    }

    fn of(template: &Template, variable: &str, groups: &[Group<'_>]) -> Self {
        let events = template.events.iter().map(|(name, condition)| ByValue {
            name: name.clone(),
            values: of_values(groups, |rows| {
                EventDigest::of(template, name, condition, rows)
            }),
        });
        let all: Vec<&Row> = groups.iter().flat_map(|g| g.rows.iter().copied()).collect();
        let is_listed = |m: &&Measure| is_shown(m) || m.kind == Kind::Reals;
        let measures = MEASURES.iter().filter(is_listed);
        let figures = measures.filter(|m| varies(m, &all)).map(|m| ByValue {
            name: m.name.to_owned(),
            values: of_values(groups, |rows| FigureDigest::over(template, m, rows)),
        });
        Self {
            variable: variable.to_owned(),
            events: events.collect(),
            figures: figures.collect(),
        }
    }
}

impl<'a> Group<'a> {
    fn of(variable: &str, value: &toml::Value, rows: &[&'a Row]) -> Self {
        let json = serde_json::to_value(value).unwrap_or_default();
        let rows = rows.iter().copied();
        Self {
            rows: rows
                .filter(|row| row.values.get(variable) == Some(&json))
                .collect(),
            value: match value {
                toml::Value::String(text) => text.clone(),
                other => other.to_string(),
            },
        }
    }
}

fn of_values<T>(groups: &[Group<'_>], of: impl Fn(&[&Row]) -> T) -> Vec<ValueDigest<T>> {
    let seen = groups.iter().filter(|group| !group.rows.is_empty());
    let values = seen.map(|group| ValueDigest {
        value: group.value.clone(),
        digest: of(&group.rows),
    });
    values.collect()
}
