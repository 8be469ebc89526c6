//! What varies from run to run, as written under `[study]`.

use crate::scenario::MOST_SEED;
use crate::settings::{Checker, is_within, settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

settings! {
    /// What varies from run to run, how often, and what is asked of it. `metrotwin run` ignores it
    /// and runs the scenario as it stands.
    pub struct StudySettings {
        /// All draws follow from it, and each run's own seed. Studies with the same seed meet the
        /// same chances, run by run, and can be compared in pairs.
        seed: u64 = 1, in 0.0..=MOST_SEED;
        /// Number of runs; of a study that sweeps, for each combination of the swept values.
        runs: u32 = 100, in 1.0..=1e7;
        /// Which points the draws take.
        plan: PlanSettings = PlanSettings::default();
        /// What is drawn, by a name of your own: it becomes a column of the results. Default:
        /// nothing but the seed.
        variables: BTreeMap<String, VariableSettings> = BTreeMap::new(), nested;
        /// Variables that go together. Default: all are independent.
        correlated: Vec<CorrelationSettings> = Vec::new();
        /// Conditions that a draw must meet, or it is drawn again: `"gap_m > 2.0 * size_m"`. They
        /// name variables, or keys of the scenario in braces: `"{train.cruise_speed_kmh} <
        /// limit_kmh"`. Default: none.
        require: Vec<String> = Vec::new();
        /// What counts as an event, by a name of your own: a condition on columns of the results,
        /// such as `"collision"` or `"paper_error_max_m > 0.25"`. Its rate is reported. Default:
        /// none.
        events: BTreeMap<String, String> = BTreeMap::new();
        /// When to stop before all runs are done. Default: never.
        stop: StopSettings = StopSettings::default(), nested;
    }
    also check_together
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

settings! {
    /// Something that is drawn.
    pub struct VariableSettings {
        /// Keys of the scenario that it sets, dotted, as `--set` has them:
        /// `train.cruise_speed_kmh`, `obstacles[0].body.size_m[2]`. Several get the same value.
        /// Default: none, it only stands in conditions.
        #[serde(default)]
        keys: Vec<String>;
        /// Its distribution: `{ uniform = { min = 20.0, max = 80.0 } }`.
        from: Distribution, nested;
        /// What the keys get is `offset + scale * value`: a distance ahead of a device at chainage
        /// 1530 m has scale -1 and offset 1530. Default 1.
        #[serde(default = "crate::settings::one::<f64>")]
        scale: f64, in -1e12..=1e12;
        /// See `scale`. Default 0.
        #[serde(default)]
        offset: f64, in -1e12..=1e12;
        /// Importance sampling: draw from here in place of `from`, and weigh every run by the ratio
        /// of both densities, so that figures stay those of `from` while rare events become
        /// frequent. Default: none.
        propose: Option<Distribution>, nested;
        /// What it is, for the report. Default: its name.
        #[serde(default)]
        label: String;
    }
    also check_together
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
    /// Named cases, swept: each sets keys of its own, to values of their own. The variable has no `keys`
    /// then; its value is the case's name.
    Cases(Vec<CaseSettings>),
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

/// One of the cases of a variable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CaseSettings {
    /// What the results call it.
    pub name: String,
    /// What it changes of the scenario, by dotted keys: `{ "radio.loss" = 1.0 }`. Default: nothing.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub set: BTreeMap<String, toml::Value>,
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

settings! {
    /// When to stop before all runs are done.
    pub struct StopSettings {
        /// After so much time, s: no run is begun then. Default: never.
        after_s: Option<f64> = None, in 1e-3..=1e9;
        /// When a figure is known well enough. Looked at after every 10 runs in the order of their
        /// indexes, so that it is the same for any number of workers. Default: never.
        when: Option<PrecisionSettings> = None, nested;
    }
}

settings! {
    /// A figure that is known well enough.
    pub struct PrecisionSettings {
        /// An event, whose rate is meant, or a column of the results, whose mean is meant.
        of: String;
        /// Half the width of its 95 % interval, in the unit of the column.
        half_width: f64, in 1e-300..=1e300;
    }
}

impl Distribution {
    /// In one line, for reports: as a file has it, but of cases their names only.
    pub fn in_a_line(&self) -> String {
        match self {
            Self::Cases(cases) => {
                let names: Vec<&str> = cases.iter().map(|case| case.name.as_str()).collect();
                format!("{} cases: {}", names.len(), names.join("; "))
            }
            other => as_written(other),
        }
    }
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
    fn check_together(&self, check: &mut Checker<'_>) {
        if let PlanSettings::LatinHypercube { points } = self.plan {
            check.within("plan.latin_hypercube.points", points, 2.0..=1e7);
        }
        for name in self.variables.keys() {
            check_name(&format!("variables.{name}"), name, check);
        }
        for name in self.events.keys() {
            let key = format!("events.{name}");
            check_name(&key, name, check);
            if self.variables.contains_key(name) {
                check.problem(
                    &key,
                    "is the name of a variable too",
                    "give the event a name of its own: both are columns of the results",
                );
            }
        }
        self.check_keys(check);
        self.check_groups(check);
    }

    /// A key that two variables set would be what the last of them says.
    fn check_keys(&self, check: &mut Checker<'_>) {
        let mut keys: Vec<(&str, &String)> = Vec::new();
        for (name, variable) in &self.variables {
            keys.extend(variable.all_keys().into_iter().map(|key| (key, name)));
        }
        // Each key is followed by those below it.
        keys.sort_by(|(a, _), (b, _)| ranks(a).cmp(ranks(b)));
        let mut above: Option<(&str, &String)> = None;
        for (key, name) in keys {
            let why = match above.filter(|(above, _)| is_within(key, above)) {
                Some((_, other)) => format!("`{key}` is set by `{other}` too"),
                None if is_within(key, "study") => format!("`{key}` is no key of a scenario"),
                None if key == "seed" => "`seed` follows from the study's".to_owned(),
                None => {
                    above = Some((key, name));
                    continue;
                }
            };
            check.problem(
                &format!("variables.{name}.keys"),
                why,
                "let each variable set keys of its own",
            );
        }
    }

    fn check_groups(&self, check: &mut Checker<'_>) {
        let mut seen = BTreeSet::new();
        for (k, group) in self.correlated.iter().enumerate() {
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
                check.problem(
                    &format!("correlated[{k}].variables"),
                    format!("`{name}` {why}"),
                    "correlate independent drawn variables, each in one group",
                );
            }
            let count = group.variables.len();
            if super::copula::lower(&group.matrix, count).is_none() {
                check.problem(
                    &format!("correlated[{k}].matrix"),
                    format!("is no matrix of correlations of {count} variables"),
                    "give a symmetric, positive definite matrix with 1 on its diagonal",
                );
            }
        }
    }
}

/// The letters of a dotted key in an order in which nothing lies between a key and those below it.
fn ranks(key: &str) -> impl Iterator<Item = (bool, u8)> {
    key.bytes().map(|b| (!matches!(b, b'.' | b'['), b))
}

fn is_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|c| c.is_ascii_lowercase())
        && letters.all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && name.len() > 1
}

fn check_name(key: &str, name: &str, check: &mut Checker<'_>) {
    if !is_name(name) {
        check.problem(
            key,
            format!("`{name}` cannot be a column's name"),
            "use at least two small letters, digits and `_`, beginning with a letter",
        );
    }
}

impl VariableSettings {
    /// The keys that it sets, in any of its cases.
    fn all_keys(&self) -> Vec<&str> {
        let of_cases: BTreeSet<&str> = match &self.from {
            Distribution::Cases(cases) => {
                let keys = cases.iter().flat_map(|case| case.set.keys());
                keys.map(String::as_str).collect()
            }
            _ => BTreeSet::new(),
        };
        let own = self.keys.iter().map(String::as_str);
        own.chain(of_cases).collect()
    }

    fn check_together(&self, check: &mut Checker<'_>) {
        if !self.keys.is_empty() && matches!(self.from, Distribution::Cases(_)) {
            check.problem(
                "keys",
                "say nothing: each case sets keys of its own",
                "leave `keys` out",
            );
        }
        if self.is_rescaled() && !self.from.is_of_numbers() {
            check.problem(
                "scale",
                "acts on numbers, and these values are none",
                "leave `scale` and `offset` out",
            );
        }
        let Some(propose) = &self.propose else {
            return;
        };
        if !(self.from.has_density() && propose.has_density()) {
            check.problem(
                "propose",
                "can only stand for a distribution with a density, and be one",
                "use uniform, log_uniform, normal, log_normal or triangular for both",
            );
        } else if !propose.covers(&self.from) {
            check.problem(
                "propose",
                "does not reach all values that `from` has",
                "widen it: what it never proposes would be missing from every figure",
            );
        } else if !propose.bounds_weights_of(&self.from) {
            check.problem(
                "propose",
                "falls off so fast that the weights have no variance, and no figure an error",
                "give it at least 0.71 of the sigma of `from`, and no corners where `from` has some",
            );
        }
    }
}
