//! One run of a study, as a row of its results.

use super::measures::{Fixes, MEASURES};
use super::scale::count_censored;
use crate::scenario::sampling::{SampleError, ScenarioSample};
use crate::session::{End, Summary};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fmt;

/// How a run came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// To its end, or to where the train left the rails.
    Complete,
    /// It began and failed: its figures are those up to there.
    Failed,
    /// Nothing could be drawn, or what was drawn is no scenario that can be run.
    Invalid,
    /// The worker died, or was ended at the limit of a run; `--resume` tries it again.
    Crashed,
}

/// A run's inputs and figures. Names of values are those of the study's variables, names of figures
/// those of [`MEASURES`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Which run.
    pub index: u64,
    /// Seed of its scenario.
    pub seed: u64,
    /// How it came out.
    pub status: Status,
    /// Why, where it is not complete or ended early.
    pub reason: Option<String>,
    /// Draws before this one that did not meet the conditions.
    pub rejected: u32,
    /// Natural logarithm of its weight; 0 without importance sampling.
    pub ln_weight: f64,
    /// What was drawn.
    pub values: Map<String, Value>,
    /// What came out: numbers, flags, lists of numbers; those that the run has not are left out.
    pub figures: Map<String, Value>,
}

impl Row {
    /// Whether its figures count. Those of a run that failed are of a part of it: what it had not come
    /// to yet, it lacks.
    pub fn is_complete(&self) -> bool {
        self.status == Status::Complete
    }

    /// Of a run for which nothing could be drawn.
    pub fn not_sampled(index: u64, error: &SampleError) -> Self {
        let sample = ScenarioSample {
            index,
            ..ScenarioSample::default()
        };
        Self::without_figures(&sample, Status::Invalid, error.to_string())
    }

    /// Of a run that has no figures.
    pub fn without_figures(sample: &ScenarioSample, status: Status, reason: String) -> Self {
        let json = |value: &toml::Value| serde_json::to_value(value).unwrap_or(Value::Null);
        let values = sample
            .values
            .iter()
            .map(|(name, v)| (name.clone(), json(v)));
        Self {
            index: sample.index,
            seed: sample.seed,
            status,
            reason: Some(reason),
            rejected: sample.rejected,
            ln_weight: sample.ln_weight,
            values: values.collect(),
            figures: Map::new(),
        }
    }

    /// Of a run that has come to an end.
    pub fn of(sample: &ScenarioSample, summary: &Summary, fixes: &Fixes) -> Self {
        let (status, reason) = match &summary.end {
            End::Complete => (Status::Complete, None),
            End::Interrupted => (Status::Failed, Some("broken off".to_owned())),
            End::Failed(why) if summary.train.as_ref().is_some_and(|t| t.derailed) => {
                (Status::Complete, Some(why.clone()))
            }
            End::Failed(why) => (Status::Failed, Some(why.clone())),
        };
        let figures = MEASURES.iter().filter_map(|m| {
            let value = (m.of)(summary, fixes);
            (!value.is_null()).then(|| (m.name.to_owned(), value))
        });
        Self {
            reason,
            figures: figures.collect(),
            ..Self::without_figures(sample, status, String::new())
        }
    }

    /// A variable or a figure as a number: flags are 0 and 1, and what is censored, infinite.
    pub fn number(&self, name: &str) -> Option<f64> {
        match self.values.get(name).or_else(|| self.figures.get(name)) {
            Some(value) => value.as_f64().or_else(|| value.as_bool().map(f64::from)),
            None => (self.censored(name) > 0).then_some(f64::INFINITY),
        }
    }

    /// A list of numbers, infinite those that are censored.
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        let list = self.figures.get(name).and_then(Value::as_array);
        let finite = list.into_iter().flatten().filter_map(Value::as_f64);
        let censored = std::iter::repeat_n(f64::INFINITY, self.censored(name));
        finite.chain(censored).collect()
    }

    /// How many values of a figure are censored.
    fn censored(&self, name: &str) -> usize {
        let count = count_censored(name).and_then(|count| self.figures.get(count)?.as_u64());
        count.unwrap_or(0) as usize
    }

    /// The first thing in which two rows of one run differ; wall times may.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let differ = |what: &str, a: &dyn fmt::Debug, b: &dyn fmt::Debug| {
            Some(format!("{what}: {a:?} and {b:?}"))
        };
        if self.status != other.status {
            return differ("status", &self.status, &other.status);
        }
        if self.reason != other.reason {
            return differ("reason", &self.reason, &other.reason);
        }
        let drawn = |row: &Self| (row.index, row.seed, row.rejected, row.ln_weight.to_bits());
        if drawn(self) != drawn(other) || self.values != other.values {
            return differ("drawn", &self.values, &other.values);
        }
        let compared = MEASURES.iter().filter(|m| !m.is_wall_time());
        let differs = |name: &&str| self.figures.get(*name) != other.figures.get(*name);
        let name = compared.map(|m| m.name).find(differs)?;
        let text = |row: &Self| {
            row.figures
                .get(name)
                .map_or("nothing".into(), Value::to_string)
        };
        Some(format!("{name}: {} and {}", text(self), text(other)))
    }
}
