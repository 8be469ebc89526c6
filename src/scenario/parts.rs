//! The files that a scenario names, all read before any is complained of.

use super::file::ScenarioFile;
use super::{Scenario, ScenarioError};
use crate::settings::{FileError, Problem, ReadLimit, key_below, read_text};
use crate::track::Tunnel;
use crate::twin::physics::VehicleFile;
use std::path::Path;

/// What reading the files that a scenario names comes to.
#[derive(Default)]
pub(super) struct Parts {
    /// Of the scenario itself.
    pub(super) problems: Vec<Problem>,
    /// The others.
    pub(super) wrong_files: Vec<ScenarioError>,
}

impl Parts {
    /// Reads the vehicle files that trains name; a name without `.toml` is one of the program's own.
    pub(super) fn read_vehicles(&mut self, file: &mut ScenarioFile, folder: &Path) {
        let keys = 0..file.trains().count();
        let keys: Vec<String> = keys
            .map(|k| key_below(&file.train_key(k), "vehicle"))
            .collect();
        let trains = file.train.iter_mut().chain(&mut file.other_trains);
        for (key, train) in keys.into_iter().zip(trains) {
            if Path::new(&train.vehicle).extension().is_some() {
                let path = folder.join(&train.vehicle);
                train.vehicle_file = self.read(&key, &path, "vehicle", parse_vehicle);
            }
        }
    }

    pub(super) fn read_tunnel(&mut self, name: &str, folder: &Path) -> Option<Tunnel> {
        self.read("tunnel", &folder.join(name), "tunnel", parse_tunnel)
    }

    /// A file of a kind that the scenario names under a key.
    fn read<T>(
        &mut self,
        key: &str,
        path: &Path,
        kind: &str,
        parse: impl Fn(&Path, &str) -> Result<T, ScenarioError>,
    ) -> Option<T> {
        let parsed = match read_text(path, ReadLimit::TOML) {
            Ok(text) => parse(path, &text),
            Err(error) => {
                self.problems.push(unreadable(key, path, kind, &error));
                return None;
            }
        };
        match parsed {
            Ok(part) => Some(part),
            Err(error) => {
                // It keeps what follows from the wrong file from being told of the key too.
                self.problems.push(Problem::new(key, WRONG_FILE, ""));
                self.wrong_files.push(error);
                None
            }
        }
    }
}

/// Stands under a key whose file is wrong, which is told with that file.
const WRONG_FILE: &str = "names a file that cannot be used";

/// A scenario, or all that is wrong: first with its own file.
pub(super) fn all_errors(
    own: Result<Scenario, ScenarioError>,
    wrong_files: Vec<ScenarioError>,
) -> Result<Scenario, ScenarioError> {
    let mut own = match own {
        Ok(scenario) => return Ok(scenario),
        Err(own) => own,
    };
    let is_of_its_own = match &mut own {
        ScenarioError::File {
            source: FileError::Problems(problems),
            ..
        } => {
            problems.retain(|problem| problem.what != WRONG_FILE);
            !problems.is_empty()
        }
        _ => true,
    };
    let mut errors: Vec<_> = wrong_files;
    if is_of_its_own {
        errors.insert(0, own);
    }
    match errors.len() {
        1 => Err(errors.remove(0)),
        _ => Err(ScenarioError::Files(errors)),
    }
}

fn unreadable(key: &str, path: &Path, kind: &str, error: &std::io::Error) -> Problem {
    Problem::new(
        key,
        format!("cannot read {}: {error}", path.display()),
        format!("give the path of a {kind} file, counted from the scenario's folder"),
    )
}

/// Reads and checks a vehicle file's text; `path` is for the messages.
pub(crate) fn parse_vehicle(path: &Path, text: &str) -> Result<VehicleFile, ScenarioError> {
    VehicleFile::from_toml(text).map_err(|source| ScenarioError::file(path, text, source))
}

/// Reads and checks a tunnel's text; `path` is for the messages.
fn parse_tunnel(path: &Path, text: &str) -> Result<Tunnel, ScenarioError> {
    Tunnel::from_toml(text).map_err(|source| ScenarioError::file(path, text, source))
}

/// Reads a file's text.
pub(crate) fn read(path: &Path) -> Result<String, ScenarioError> {
    read_text(path, ReadLimit::TOML).map_err(|source| {
        let file = path.to_owned();
        ScenarioError::file(path, "", FileError::Read { path: file, source })
    })
}
