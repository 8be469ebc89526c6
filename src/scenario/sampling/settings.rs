//! What varies from run to run, as written under `[study]`.

use crate::scenario::overrides::is_within;
use crate::track::Problem;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// What varies from run to run, how often, and what is asked of it. `metrotwin run` ignores it and
/// runs the scenario as it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StudySettings {
    /// All draws follow from it, and each run's own seed. Studies with the same seed meet the same
    /// chances, run by run, and can be compared in pairs. Default 1.
    pub seed: u64,
    /// Number of runs; of a study that sweeps, for each combination of the swept values. Default 100.
    pub runs: u32,
    /// Which points the draws take. Default `random`.
    pub plan: PlanSettings,
    /// What is drawn, by a name of your own: it becomes a column of the results. Default: nothing
    /// but the seed.
    pub variables: BTreeMap<String, VariableSettings>,
    /// Variables that go together. Default: all are independent.
    pub correlated: Vec<CorrelationSettings>,
    /// Conditions that a draw must meet, or it is drawn again: `"gap_m > 2.0 * size_m"`. They name
    /// variables, or keys of the scenario in braces: `"{train.cruise_speed_kmh} < limit_kmh"`.
    /// Default: none.
    pub require: Vec<String>,
    /// What counts as an event, by a name of your own: a condition on columns of the results, such
    /// as `"collision"` or `"paper_error_max_m > 0.25"`. Its rate is reported. Default: none.
    pub events: BTreeMap<String, String>,
    /// When to stop before all runs are done. Default: never.
    pub stop: StopSettings,
}

impl Default for StudySettings {
    fn default() -> Self {
        Self {
            seed: 1,
            runs: 100,
            plan: PlanSettings::default(),
            variables: BTreeMap::new(),
            correlated: Vec::new(),
            require: Vec::new(),
            events: BTreeMap::new(),
            stop: StopSettings::default(),
        }
    }
}

/// Which points of the unit cube the draws take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PlanSettings {
    /// Independent ones.
    #[default]
    Random,
    /// Latin hypercubes (McKay, Beckman, Conover 1979), one after the other: in each, every
    /// variable takes each of `points` equal slices of its distribution once.
    LatinHypercube {
        /// Points of one hypercube: the number of runs, or a part of it.
        points: u32,
    },
    /// Sobol's sequence (directions of Joe and Kuo 2008), scrambled as Owen has it by the seed. It
    /// is even for numbers of runs that are powers of two.
    Sobol,
}

/// Something that is drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VariableSettings {
    /// Keys of the scenario that it sets, dotted, as `--set` has them: `train.cruise_speed_kmh`,
    /// `obstacles[0].body.size_m[2]`. Several get the same value. Default: none, it only stands
    /// in conditions.
    #[serde(default)]
    pub keys: Vec<String>,
    /// Its distribution: `{ uniform = { min = 20.0, max = 80.0 } }`.
    pub from: Distribution,
    /// What the keys get is `offset + scale * value`: a distance ahead of a device at chainage 1530 m
    /// has scale -1 and offset 1530. Default 1.
    #[serde(default = "one")]
    pub scale: f64,
    /// See `scale`. Default 0.
    #[serde(default)]
    pub offset: f64,
    /// Importance sampling: draw from here in place of `from`, and weigh every run by the ratio of both
    /// densities, so that figures stay those of `from` while rare events become frequent. Default:
    /// none.
    #[serde(default)]
    pub propose: Option<Distribution>,
    /// What it is, for the report. Default: its name.
    #[serde(default)]
    pub label: String,
}

fn one() -> f64 {
    1.0
}

/// A distribution. `min` and `max` are in the unit of the key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Distribution {
    /// Every value from `min` to `max` alike.
    Uniform {
        /// Least value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// Every factor alike: its logarithm is uniform.
    LogUniform {
        /// Least value, over 0.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// The normal distribution; with `min` or `max`, what of it lies between them.
    Normal {
        /// Of the whole curve.
        mean: f64,
        /// Of the whole curve.
        sigma: f64,
        /// Cut off below. Default: not.
        min: Option<f64>,
        /// Cut off above. Default: not.
        max: Option<f64>,
    },
    /// Its logarithm is normal; with `min` or `max`, what of it lies between them.
    LogNormal {
        /// Half of the values lie below, over 0.
        median: f64,
        /// Standard deviation of the natural logarithm: 0.1 is about a tenth.
        sigma_ln: f64,
        /// Cut off below. Default: not.
        min: Option<f64>,
        /// Cut off above. Default: not.
        max: Option<f64>,
    },
    /// Grows in a straight line from `min` to `mode`, and falls to `max`.
    Triangular {
        /// Least value.
        min: f64,
        /// Likeliest value.
        mode: f64,
        /// Largest value.
        max: f64,
    },
    /// Every whole number from `min` to `max` alike.
    Integer {
        /// Least value.
        min: i64,
        /// Largest value.
        max: i64,
    },
    /// One of a list: numbers, texts, flags, or whole tables of keys.
    Choice {
        /// The list.
        #[schemars(with = "Vec<serde_json::Value>")]
        values: Vec<toml::Value>,
        /// How likely each is, in any unit. Default: all alike.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        weights: Vec<f64>,
    },
    /// A row of a table of measured values, every row alike. Variables of one file take the same row.
    Table {
        /// A CSV file with a line of headers; a relative path counts from this file's folder.
        file: String,
        /// Which column.
        column: String,
    },
    /// Not drawn but swept: every value is run with every value of the other swept variables.
    Sweep {
        /// The values.
        #[schemars(with = "Vec<serde_json::Value>")]
        values: Vec<toml::Value>,
    },
    /// Swept in equal steps.
    Grid {
        /// First value.
        min: f64,
        /// Last value.
        max: f64,
        /// Number of values, both ends counted.
        count: u32,
    },
}

/// Variables that go together: their normal scores have these correlations (a Gaussian copula), and
/// each keeps its own distribution.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CorrelationSettings {
    /// Names of the variables.
    pub variables: Vec<String>,
    /// Correlation of each with each, -1 to 1, row by row; 1 on the diagonal.
    pub matrix: Vec<Vec<f64>>,
}

/// When to stop before all runs are done.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StopSettings {
    /// After so much time, s: no run is begun then. Default: never.
    pub after_s: Option<f64>,
    /// When a figure is known well enough. Looked at after every 10 runs in the order of their
    /// indexes, so that it is the same for any number of workers. Default: never.
    pub when: Option<PrecisionSettings>,
}

/// A figure that is known well enough.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrecisionSettings {
    /// An event, whose rate is meant, or a column of the results, whose mean is meant.
    pub of: String,
    /// Half the width of its 95 % interval, in the unit of the column.
    pub half_width: f64,
}

/// A part of the settings in one line, as a file has it.
pub fn as_written(part: &impl Serialize) -> String {
    let mut text = String::new();
    match part.serialize(toml::ser::ValueSerializer::new(&mut text)) {
        Ok(_) => text.trim_matches('"').to_owned(),
        Err(error) => error.to_string(),
    }
}

impl StudySettings {
    /// Appends what is wrong with the settings by themselves.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let runs = f64::from(self.runs);
        Problem::unless_within(problems, format!("{at}.runs"), runs, 1.0..=1e7, "runs");
        if let PlanSettings::LatinHypercube { points } = self.plan {
            let key = format!("{at}.plan.latin_hypercube.points");
            Problem::unless_within(problems, key, f64::from(points), 2.0..=1e7, "points");
        }
        for (name, variable) in &self.variables {
            let key = format!("{at}.variables.{name}");
            if !is_name(name) {
                problems.push(bad_name(key.clone(), name));
            }
            variable.check(&key, problems);
        }
        for name in self.events.keys().filter(|name| !is_name(name)) {
            problems.push(bad_name(format!("{at}.events.{name}"), name));
        }
        for name in (self.events.keys()).filter(|name| self.variables.contains_key(*name)) {
            problems.push(Problem::new(
                format!("{at}.events.{name}"),
                "is the name of a variable too",
                "give the event a name of its own: both are columns of the results",
            ));
        }
        self.check_keys(at, problems);
        self.check_groups(at, problems);
        self.stop.check(&format!("{at}.stop"), problems);
    }

    /// A key that two variables set would be what the last of them says.
    fn check_keys(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut seen: Vec<(&str, &str)> = Vec::new();
        for (name, variable) in &self.variables {
            for key in &variable.keys {
                let clash = seen
                    .iter()
                    .find(|(_, other)| is_within(key, other) || is_within(other, key));
                let why = match clash {
                    Some((other, _)) => format!("`{key}` is set by `{other}` too"),
                    None if is_within(key, "study") => format!("`{key}` is no key of a scenario"),
                    None if key == "seed" => "`seed` follows from the study's".to_owned(),
                    None => {
                        seen.push((name, key));
                        continue;
                    }
                };
                problems.push(Problem::new(
                    format!("{at}.variables.{name}.keys"),
                    why,
                    "let each variable set keys of its own",
                ));
            }
        }
    }

    fn check_groups(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut seen = BTreeSet::new();
        for (k, group) in self.correlated.iter().enumerate() {
            let key = format!("{at}.correlated[{k}]");
            for name in &group.variables {
                let variable = self.variables.get(name);
                let why = match variable {
                    None => "is no variable of this study",
                    Some(v) if v.from.is_swept() => "is swept, not drawn",
                    Some(v) if matches!(v.from, Distribution::Table { .. }) => {
                        "comes from a table, whose rows hold its correlations"
                    }
                    Some(v) if v.propose.is_some() => "has a `propose` of its own",
                    Some(_) if !seen.insert(name) => "stands in two groups, or twice in one",
                    Some(_) => continue,
                };
                problems.push(Problem::new(
                    format!("{key}.variables"),
                    format!("`{name}` {why}"),
                    "correlate independent drawn variables, each in one group",
                ));
            }
            if super::copula::lower(&group.matrix, group.variables.len()).is_none() {
                problems.push(Problem::new(
                    format!("{key}.matrix"),
                    format!(
                        "is no matrix of correlations of {} variables",
                        group.variables.len()
                    ),
                    "give a symmetric, positive definite matrix with 1 on its diagonal",
                ));
            }
        }
    }
}

fn is_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|c| c.is_ascii_lowercase())
        && letters.all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && name.len() > 1
}

fn bad_name(key: String, name: &str) -> Problem {
    Problem::new(
        key,
        format!("`{name}` cannot be a column's name"),
        "use at least two small letters, digits and `_`, beginning with a letter",
    )
}

impl VariableSettings {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        self.from.check(&format!("{at}.from"), problems);
        for (name, value) in [("scale", self.scale), ("offset", self.offset)] {
            let key = format!("{at}.{name}");
            Problem::unless_within(problems, key, value, -1e12..=1e12, "");
        }
        if self.is_rescaled() && !self.from.is_of_numbers() {
            problems.push(Problem::new(
                format!("{at}.scale"),
                "acts on numbers, and these values are none",
                "leave `scale` and `offset` out",
            ));
        }
        if let Some(propose) = &self.propose {
            let key = format!("{at}.propose");
            propose.check(&key, problems);
            if !(self.from.has_density() && propose.has_density()) {
                problems.push(Problem::new(
                    key,
                    "can only stand for a distribution with a density, and be one",
                    "use uniform, log_uniform, normal, log_normal or triangular for both",
                ));
            } else if !propose.covers(&self.from) {
                problems.push(Problem::new(
                    key,
                    "does not reach all values that `from` has",
                    "widen it: what it never proposes would be missing from every figure",
                ));
            } else if !propose.bounds_weights_of(&self.from) {
                problems.push(Problem::new(
                    key,
                    "falls off so fast that the weights have no variance, and no figure an error",
                    "give it at least 0.71 of the sigma of `from`, and no corners where `from` has some",
                ));
            }
        }
    }
}

impl StopSettings {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        if let Some(after_s) = self.after_s {
            let key = format!("{at}.after_s");
            Problem::unless_within(problems, key, after_s, 1e-3..=1e9, "s");
        }
        if let Some(when) = &self.when {
            let key = format!("{at}.when.half_width");
            Problem::unless_within(problems, key, when.half_width, 1e-300..=1e300, "");
        }
    }
}
