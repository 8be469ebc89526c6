//! One run's sample: from an index to values, and from values to a scenario.

use super::condition::ConditionError;
use super::copula;
use super::plan::RunNumber;
use super::settings::{CaseSettings, Distribution, VariableSettings};
use super::template::{Template, table_coordinate};
use crate::scenario::build::overridden;
use crate::scenario::overrides::lookup;
use crate::scenario::{Override, Scenario, ScenarioError, ScenarioFile};
use crate::twin::random::Stream;
use std::collections::BTreeMap;
use toml::{Table, Value};

/// How often a draw is tried again before its conditions are taken to be impossible.
const MOST_ATTEMPTS: u32 = 10_000;

/// The values of one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScenarioSample {
    /// The run.
    pub index: u64,
    /// Seed of its scenario.
    pub seed: u64,
    /// Value of every variable, in the order of names.
    pub values: Vec<(String, Value)>,
    /// Draws that did not meet the conditions, before this one.
    pub rejected: u32,
    /// Logarithm of the run's weight: 0 but with importance sampling.
    pub ln_weight: f64,
}

/// Why a run has no sample.
#[derive(Debug, thiserror::Error)]
pub enum SampleError {
    /// No draw meets the conditions.
    #[error(
        "run {index}: of {attempts} draws none meets the conditions; `{text}` turned down {refused} of \
         them"
    )]
    Rejected {
        /// The run.
        index: u64,
        /// Draws tried.
        attempts: u32,
        /// The condition that turned down most.
        text: String,
        /// How many.
        refused: u32,
    },
    /// A condition that cannot be worked out.
    #[error("study.require: {0}")]
    Condition(#[from] ConditionError),
    /// The study has fewer runs.
    #[error("there is no run {index}: the study has {runs}, counted from 0")]
    NoRun {
        /// The run asked for.
        index: u64,
        /// How many there are.
        runs: u64,
    },
    /// A key that cannot be set.
    #[error("run {0}: {1}")]
    Key(u64, String),
}

impl Template {
    /// Draws run `index`, which depends on the study's seed and the index alone.
    ///
    /// Runs go through the combinations of swept values in turn, the first variable changing
    /// slowest; every combination gets points of the plan, and noise, of its own.
    pub fn sample(&self, index: u64) -> Result<ScenarioSample, SampleError> {
        let runs = self.runs();
        if index >= runs {
            return Err(SampleError::NoRun { index, runs });
        }
        let run = RunNumber {
            index,
            cell: index % self.cells(),
            repeat: index / self.cells(),
        };
        let swept = self.swept_values(run.cell);
        let mut refused = vec![0u32; self.conditions.len()];
        for attempt in 0..MOST_ATTEMPTS {
            let sample = self.attempt(run, attempt, &swept);
            match self.unmet_condition(&sample)? {
                None => return Ok(sample),
                Some(k) => refused[k] += 1,
            }
        }
        let texts = self.conditions.iter().map(|c| c.text().to_owned());
        let worst = texts.zip(refused).max_by_key(|(_, refused)| *refused);
        let (text, refused) = worst.unwrap_or_default();
        Err(SampleError::Rejected {
            index,
            attempts: MOST_ATTEMPTS,
            text,
            refused,
        })
    }

    fn swept_values(&self, cell: u64) -> BTreeMap<&str, Value> {
        let mut left = cell;
        let places = self.swept.iter().rev().map(|(name, values)| {
            let place = (left % values.len() as u64) as usize;
            left /= values.len() as u64;
            (name.as_str(), values[place].clone())
        });
        places.collect()
    }

    fn attempt(
        &self,
        run: RunNumber,
        attempt: u32,
        swept: &BTreeMap<&str, Value>,
    ) -> ScenarioSample {
        let mut point = self.plan.point(run, attempt);
        for (places, lower) in &self.groups {
            let mut of_group: Vec<f64> = places.iter().map(|k| point[*k]).collect();
            copula::correlate(lower, &mut of_group);
            for (k, u) in places.iter().zip(of_group) {
                point[*k] = u;
            }
        }
        let at = |name: &str| {
            self.coordinates
                .iter()
                .position(|c| c == name)
                .map(|k| point[k])
        };
        let mut ln_weight = 0.0;
        let mut values = Vec::with_capacity(self.settings.variables.len());
        for (name, variable) in &self.settings.variables {
            let value = match (&variable.from, &variable.propose) {
                (Distribution::Table { file, column }, _) => {
                    at(&table_coordinate(file)).and_then(|u| self.tables.value(file, column, u))
                }
                (from, Some(propose)) => {
                    let value = at(name).and_then(|u| propose.quantile(u));
                    let x = value.as_ref().and_then(Value::as_float).unwrap_or(f64::NAN);
                    ln_weight += from.ln_density(x) - propose.ln_density(x);
                    value
                }
                (from, None) if from.is_swept() => swept.get(name.as_str()).cloned(),
                (from, None) => at(name).and_then(|u| from.quantile(u)),
            };
            values.extend(value.map(|v| (name.clone(), v)));
        }
        // Files have no infinite numbers; this one's weight is 0 too.
        let ln_weight = if ln_weight.is_finite() {
            ln_weight
        } else {
            f64::MIN
        };
        // 53 bits: every reader of JSON keeps them.
        let [low, high, ..] =
            Stream::new(self.settings.seed, run.index, "scenario seed").words(0, 0);
        let seed = (u64::from(high) << 32 | u64::from(low)) >> 11;
        ScenarioSample {
            index: run.index,
            seed,
            values,
            rejected: attempt,
            ln_weight,
        }
    }

    /// The first condition that a draw does not meet.
    fn unmet_condition(&self, sample: &ScenarioSample) -> Result<Option<usize>, SampleError> {
        let mut document = None;
        for (k, condition) in self.conditions.iter().enumerate() {
            let names_keys = condition.names().any(|name| sample.number(name).is_none());
            if names_keys && document.is_none() {
                document = Some(self.document(sample)?);
            }
            let value_of = |name: &str| {
                let key = || number(lookup(document.as_ref()?, name)?);
                sample.number(name).or_else(key).map(Some).ok_or(())
            };
            if condition.holds(value_of)? != Some(true) {
                return Ok(Some(k));
            }
        }
        Ok(None)
    }

    /// The scenario's keys with their defaults, as drawn.
    fn document(&self, sample: &ScenarioSample) -> Result<Table, SampleError> {
        let key = |e: &dyn std::fmt::Display| SampleError::Key(sample.index, e.to_string());
        let mut document = Table::try_from(&self.file).map_err(|e| key(&e))?;
        for change in self.overrides(sample) {
            change.apply(&mut document).map_err(|e| key(&e))?;
        }
        Ok(document)
    }

    /// What is set from the command line, and what a draw changes in the file, its seed among it.
    pub fn overrides(&self, sample: &ScenarioSample) -> Vec<Override> {
        let of = |(name, value): &(String, Value)| {
            let variable = self.settings.variables.get(name);
            variable.map(|v| v.overrides(value)).unwrap_or_default()
        };
        let seed = Override {
            key: "seed".into(),
            value: Value::Integer(sample.seed as i64),
        };
        let drawn = sample.values.iter().flat_map(of);
        let set = self.set.iter().cloned();
        set.chain([seed]).chain(drawn).collect()
    }

    /// The scenario of a draw, checked.
    pub fn scenario(&self, sample: &ScenarioSample) -> Result<Scenario, ScenarioError> {
        Scenario::from_text(&self.path, &self.text, &self.overrides(sample))
    }

    /// The file of a draw.
    pub fn concrete(&self, sample: &ScenarioSample) -> Result<ScenarioFile, ScenarioError> {
        let mut file = overridden(&self.path, &self.text, &self.overrides(sample))?;
        file.study = None;
        Ok(file)
    }
}

impl ScenarioSample {
    /// A variable's value, where it is a number or a flag.
    pub fn number(&self, name: &str) -> Option<f64> {
        let (_, value) = self.values.iter().find(|(n, _)| n == name)?;
        number(value)
    }
}

impl VariableSettings {
    /// Whether its keys get other numbers than it has.
    pub fn is_rescaled(&self) -> bool {
        self.scale.to_bits() != 1f64.to_bits() || self.offset.abs() > 0.0
    }

    /// What a value of it changes in the scenario.
    pub(super) fn overrides(&self, value: &Value) -> Vec<Override> {
        if let Distribution::Cases(cases) = &self.from {
            let case = cases.iter().find(|c| value.as_str() == Some(&c.name));
            return case.map(CaseSettings::overrides).unwrap_or_default();
        }
        let value = match number(value) {
            Some(x) if self.is_rescaled() => Value::Float(self.offset + self.scale * x),
            _ => value.clone(),
        };
        let of = |key: &String| Override {
            key: key.clone(),
            value: value.clone(),
        };
        self.keys.iter().map(of).collect()
    }
}

impl CaseSettings {
    /// What it changes in the scenario.
    pub(super) fn overrides(&self) -> Vec<Override> {
        let of = |(key, value): (&String, &Value)| Override {
            key: key.clone(),
            value: value.clone(),
        };
        self.set.iter().map(of).collect()
    }
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(x) => Some(*x as f64),
        Value::Float(x) => Some(*x),
        Value::Boolean(x) => Some(f64::from(*x)),
        _ => None,
    }
}
