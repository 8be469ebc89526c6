//! A scenario file with a `[study]`, ready to be drawn from.

use super::condition::{Condition, ConditionError};
use super::copula;
use super::plan::{MOST_SOBOL, SamplingPlan};
use super::settings::{CaseSettings, Distribution, PlanSettings, StudySettings, VariableSettings};
use super::tables::Tables;
use crate::scenario::build::overridden;
use crate::scenario::parts::read;
use crate::scenario::{Override, Scenario, ScenarioError, ScenarioFile};
use crate::settings::{FileError, Problem, is_within, read_settings};
use nalgebra::DMatrix;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use toml::Value;

/// More runs than any study can be waited for.
pub const MOST_RUNS: u64 = 10_000_000;

/// A study's scenario, checked, of which any run can be drawn.
#[derive(Clone, Debug)]
pub struct Template {
    /// The file.
    pub path: PathBuf,
    pub(super) text: String,
    /// Changes from the command line, made before anything is drawn.
    pub set: Vec<Override>,
    /// As it stands with these changes, nothing drawn.
    pub file: ScenarioFile,
    /// What varies.
    pub settings: StudySettings,
    pub(super) plan: SamplingPlan,
    /// Names of the plan's coordinates: a variable, or a table's file.
    pub(super) coordinates: Vec<String>,
    pub(super) swept: Vec<(String, Vec<Value>)>,
    pub(super) groups: Vec<(Vec<usize>, DMatrix<f64>)>,
    pub(super) tables: Tables,
    pub(super) conditions: Vec<Condition>,
    /// What counts as an event, by name.
    pub events: BTreeMap<String, Condition>,
}

impl Template {
    /// Reads and checks a file, and the scenario that it is as it stands.
    pub fn load(path: &Path) -> Result<Self, ScenarioError> {
        Self::from_text(path, read(path)?, &[])
    }

    /// As [`Self::load`], of a text already read, with some of its keys set anew; `path` is where relative paths count
    /// from.
    pub fn from_text(path: &Path, text: String, set: &[Override]) -> Result<Self, ScenarioError> {
        let wrong = |source| ScenarioError::file(path, &text, source);
        let own = Scenario::from_text(path, &text, set).err();
        let file: ScenarioFile = match read_settings(&text) {
            Ok(_) if !set.is_empty() => match overridden(path, &text, set) {
                Ok(file) => file,
                Err(error) => return Err(own.unwrap_or(error)),
            },
            Ok(file) => file,
            Err(source) => return Err(own.unwrap_or_else(|| wrong(source))),
        };
        let settings = file.study.clone().ok_or_else(|| {
            wrong(FileError::Problems(vec![Problem::new(
                "study",
                "is missing: nothing is said to vary",
                "add a table [study]; scenarios/studies has examples",
            )]))
        });
        // What else is wrong with a study is found by drawing from it.
        let settings = match own {
            Some(ref own) if settings.is_ok() && !own.is_at("study") => settings?,
            Some(own) => return Err(own),
            None => settings?,
        };
        let mut problems = Vec::new();
        let folder = path.parent().unwrap_or(Path::new(""));
        let tables = Tables::read(&settings, folder, &mut problems);
        let conditions = conditions(&settings, &mut problems);
        let events = events(&settings, &mut problems);
        check_keys(path, (&text, set), &settings, &tables, &mut problems);
        let coordinates = coordinates(&settings);
        check_size(&settings, coordinates.len(), &mut problems);
        if let Some(error) = ScenarioError::joined(own, path, &text, problems) {
            return Err(error);
        }
        refuse_drawn(path, set, &settings)?;
        let swept = settings.variables.iter().filter(|(_, v)| v.from.is_swept());
        Ok(Self {
            path: path.to_owned(),
            set: set.to_vec(),
            groups: groups(&settings, &coordinates),
            swept: swept
                .map(|(name, v)| (name.clone(), v.from.swept()))
                .collect(),
            plan: SamplingPlan::new(settings.plan, settings.seed, coordinates.clone()),
            coordinates,
            tables,
            conditions,
            events,
            file,
            settings,
            text,
        })
    }

    /// What is wrong with the file, found by whoever knows the figures of a run.
    pub fn wrong(&self, problem: Problem) -> ScenarioError {
        ScenarioError::file(&self.path, &self.text, FileError::Problems(vec![problem]))
    }

    /// Bytes of the file.
    pub fn text_len(&self) -> usize {
        self.text.len()
    }

    /// With another seed or number of runs.
    pub fn with(mut self, seed: Option<u64>, runs: Option<u32>) -> Self {
        self.settings.seed = seed.unwrap_or(self.settings.seed);
        self.settings.runs = runs.unwrap_or(self.settings.runs);
        let StudySettings { plan, seed, .. } = self.settings;
        self.plan = SamplingPlan::new(plan, seed, self.coordinates.clone());
        self
    }

    /// Whether runs carry weights: a variable is drawn from elsewhere than its distribution.
    pub fn is_weighted(&self) -> bool {
        let mut variables = self.settings.variables.values();
        variables.any(|v| v.propose.is_some())
    }

    /// Combinations of swept values: 1 without any.
    pub fn cells(&self) -> u64 {
        self.swept
            .iter()
            .map(|(_, values)| values.len() as u64)
            .fold(1, u64::saturating_mul)
    }

    /// Number of runs: that of the settings for each combination of swept values.
    pub fn runs(&self) -> u64 {
        self.cells().saturating_mul(u64::from(self.settings.runs))
    }

    /// Files that are read beside the study itself, for any draw.
    pub fn files(&self) -> Vec<PathBuf> {
        let mut files = self.tables.files();
        let mut add = |mut file: ScenarioFile| {
            files.extend(file.files_mut().into_iter().map(|f| PathBuf::from(&*f)));
        };
        add(self.file.clone());
        for variable in self.settings.variables.values() {
            let mut listed = self.listed_changes(variable);
            listed.retain(|changes| changes.iter().any(|c| may_name_file(&c.value)));
            for changes in listed {
                let changes = [self.set.clone(), changes].concat();
                if let Ok(file) = overridden(&self.path, &self.text, &changes) {
                    add(file);
                }
            }
        }
        files.sort();
        files.dedup();
        files
    }

    /// What each of the values that a variable lists changes in the file; of equal values once. Others have
    /// numbers only.
    fn listed_changes(&self, variable: &VariableSettings) -> Vec<Vec<Override>> {
        let values = match &variable.from {
            Distribution::Cases(cases) => {
                return cases.iter().map(CaseSettings::overrides).collect();
            }
            Distribution::Choice { values, .. } | Distribution::Sweep { values } => values,
            Distribution::Table { file, column } => self.tables.values(file, column),
            _ => return Vec::new(),
        };
        let mut seen = BTreeSet::new();
        let texts = values.iter().filter(|value| may_name_file(value));
        let texts = texts.filter(|value| seen.insert(value.to_string()));
        texts.map(|value| variable.overrides(value)).collect()
    }
}

fn may_name_file(value: &Value) -> bool {
    matches!(value, Value::String(_) | Value::Array(_) | Value::Table(_))
}

/// Variables that are drawn, one by one or by the rows of a table.
fn coordinates(settings: &StudySettings) -> Vec<String> {
    let drawn = settings
        .variables
        .iter()
        .filter(|(_, v)| !v.from.is_swept());
    let mut names: Vec<_> = drawn
        .map(|(name, v)| match &v.from {
            Distribution::Table { file, .. } => table_coordinate(file),
            _ => name.clone(),
        })
        .collect();
    names.sort();
    names.dedup();
    names
}

pub(super) fn table_coordinate(file: &str) -> String {
    format!("table {file}")
}

fn conditions(settings: &StudySettings, problems: &mut Vec<Problem>) -> Vec<Condition> {
    let remedy = "compare numbers, as in `gap_m > 2.0 * size_m && speed_kmh < 80`";
    let parsed = settings.require.iter().enumerate();
    parsed
        .filter_map(|(k, text)| parse(text, format!("study.require[{k}]"), remedy, problems))
        .collect()
}

fn events(settings: &StudySettings, problems: &mut Vec<Problem>) -> BTreeMap<String, Condition> {
    let remedy = "`metrotwin study figures` lists what may be named, and the signs";
    let mut events = BTreeMap::new();
    for (name, text) in &settings.events {
        let condition = parse(text, format!("study.events.{name}"), remedy, problems);
        events.extend(condition.map(|condition| (name.clone(), condition)));
    }
    events
}

fn parse(text: &str, key: String, remedy: &str, problems: &mut Vec<Problem>) -> Option<Condition> {
    let wrong = |e: ConditionError| problems.push(Problem::new(key, e.to_string(), remedy));
    Condition::parse(text).map_err(wrong).ok()
}

/// Correlated variables by their places among the coordinates, with what turns them.
fn groups(settings: &StudySettings, coordinates: &[String]) -> Vec<(Vec<usize>, DMatrix<f64>)> {
    let place = |name: &String| coordinates.iter().position(|c| c == name);
    let groups = settings.correlated.iter().filter_map(|group| {
        let places: Option<Vec<_>> = group.variables.iter().map(place).collect();
        let places = places?;
        let lower = copula::lower(&group.matrix, places.len())?;
        Some((places, lower))
    });
    groups.collect()
}

/// More variables than a plan serves, or more combinations than can be run.
fn check_size(settings: &StudySettings, coordinates: usize, problems: &mut Vec<Problem>) {
    if settings.plan == PlanSettings::Sobol && coordinates > MOST_SOBOL {
        problems.push(Problem::new(
            "study.plan",
            format!("{coordinates} variables are more than Sobol's sequence has here"),
            format!("draw at most {MOST_SOBOL}, or use latin_hypercube"),
        ));
    }
    let variables = settings.variables.values();
    let swept = variables.map(|v| v.from.swept().len().max(1) as u64);
    if swept.fold(1, u64::saturating_mul) > MOST_RUNS {
        problems.push(Problem::new(
            "study.variables",
            format!("the swept values have more than {MOST_RUNS} combinations"),
            "sweep fewer values",
        ));
    }
}

/// Fails where a run's draw would set anew what is set from the command line.
fn refuse_drawn(
    path: &Path,
    set: &[Override],
    settings: &StudySettings,
) -> Result<(), ScenarioError> {
    let mut problems = Vec::new();
    for change in set {
        let overlaps = |key: &str| is_within(key, &change.key) || is_within(&change.key, key);
        let drawn_by = settings.variables.iter().find(|(_, v)| {
            let cases = match &v.from {
                Distribution::Cases(cases) => cases.as_slice(),
                _ => &[],
            };
            let of_cases = cases.iter().flat_map(CaseSettings::overrides);
            v.keys.iter().any(|key| overlaps(key)) || of_cases.into_iter().any(|c| overlaps(&c.key))
        });
        let (what, remedy) = match drawn_by {
            Some((name, _)) => (
                format!("is drawn by the study's variable `{name}`"),
                format!("set another key, or the variable: study.variables.{name}.from={{ ... }}"),
            ),
            None if change.key == "seed" => (
                "is drawn for each run".to_owned(),
                "set study.seed".to_owned(),
            ),
            None => continue,
        };
        problems.push(Problem::new(change.key.clone(), what, remedy));
    }
    match problems.is_empty() {
        true => Ok(()),
        false => Err(ScenarioError::Overridden {
            path: path.to_owned(),
            overrides: set.to_vec(),
            source: FileError::Problems(problems),
        }),
    }
}

/// For each key that is set the whole file is read: so many bytes take some seconds.
const MOST_BYTES_SET: usize = 32 << 20;

/// Every key that a variable sets must be there, and take a value of its kind.
fn check_keys(
    path: &Path,
    (text, set): (&str, &[Override]),
    settings: &StudySettings,
    tables: &Tables,
    problems: &mut Vec<Problem>,
) {
    let variables = settings.variables.values();
    let keys: usize = variables
        .map(|variable| match &variable.from {
            Distribution::Cases(cases) => cases.iter().map(|case| case.set.len()).sum(),
            _ => variable.keys.len(),
        })
        .sum();
    if keys.saturating_mul(text.len()) > MOST_BYTES_SET {
        problems.push(Problem::new(
            "study.variables",
            format!(
                "they set {keys} keys, too many for a file of {} bytes",
                text.len()
            ),
            "set fewer keys, or whole tables by a `choice`",
        ));
        return;
    }
    for (name, variable) in &settings.variables {
        let tried = match &variable.from {
            Distribution::Table { file, column } => tables.value(file, column, 0.5),
            Distribution::Cases(_) => None,
            from => from
                .quantile(0.5)
                .or_else(|| from.swept().into_iter().next()),
        };
        let tried = tried.map(|value| variable.overrides(&value)).into_iter();
        let of_cases = match &variable.from {
            Distribution::Cases(cases) => cases.iter().map(CaseSettings::overrides).collect(),
            _ => Vec::new(),
        };
        for change in tried.chain(of_cases).flatten() {
            let changes = [set, std::slice::from_ref(&change)].concat();
            if let Err(error) = overridden(path, text, &changes) {
                let what = match error {
                    ScenarioError::Overridden { source, .. } => source.to_string(),
                    other => other.to_string(),
                };
                problems.push(Problem::new(
                    format!("study.variables.{name}.keys"),
                    format!("`{}` cannot be {}: {what}", change.key, change.value),
                    "give a key of the scenario, dotted, and values of its kind",
                ));
            }
        }
    }
}
