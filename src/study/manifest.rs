//! The manifest `study.json`: SHA-256 of every input and of the program, and the renderer, that the rows of a
//! folder were made with.

use super::{Result, Row, Shard, StudyError, not_read, write_whole};
use crate::scenario::Override;
use crate::scenario::sampling::{Inputs, MOST_RUNS, Template, read_input, sha256};
use crate::session::RendererChoice;
use crate::settings::{ReadLimit, read_bytes};
use crate::twin::render::{Backend, gpu};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Name of the file in a study's folder.
pub const MANIFEST: &str = "study.json";
/// Folder for copies of all inputs.
pub const INPUTS: &str = "inputs";

/// Everything that a row depends on. A study goes on only while all of it is the same.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the program.
    pub metrotwin: String,
    /// SHA-256 of the program: another build may be another program.
    pub program: String,
    /// The study's file, below [`INPUTS`].
    pub study: PathBuf,
    /// SHA-256 of every input file, by its path below [`INPUTS`].
    pub inputs: BTreeMap<String, String>,
    /// What `--set` changed in the study's file, as `key=value`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
    /// Number of runs, all shards together.
    pub runs: u64,
    /// What draws.
    pub renderer: Backend,
    /// The part of the study that this folder holds; all of it where there is none.
    pub shard: Option<Shard>,
}

/// Whether a path leads below the folder that it is joined to.
fn is_below(path: &Path) -> bool {
    let mut parts = path.components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// What draws the images on this machine, by a choice.
pub fn renderer(choice: RendererChoice) -> Result<Backend> {
    let plain = || Backend {
        backend: "cpu".into(),
        adapter: "plain renderer".into(),
    };
    let adapter = || gpu::adapters().into_iter().next();
    match choice {
        RendererChoice::Cpu => Ok(plain()),
        RendererChoice::Gpu => adapter().ok_or(StudyError::NoAdapter),
        RendererChoice::Auto => Ok(adapter().unwrap_or_else(plain)),
    }
}

fn program_hash() -> std::io::Result<String> {
    Ok(sha256(&fs::read(std::env::current_exe()?)?))
}

impl Manifest {
    /// Of a study about to be run here.
    pub fn of(
        template: &Template,
        inputs: &Inputs,
        renderer: &Backend,
        shard: Option<Shard>,
    ) -> Result<Self> {
        let unreadable = |source| StudyError::file(&template.path, source);
        Ok(Self {
            metrotwin: env!("CARGO_PKG_VERSION").into(),
            program: program_hash().map_err(StudyError::Worker)?,
            study: inputs.study.clone(),
            inputs: inputs.hashes().map_err(unreadable)?,
            set: template.set.iter().map(Override::assignment).collect(),
            runs: template.runs(),
            renderer: renderer.clone(),
            shard,
        })
    }

    /// Reads that of a folder; `None` where there is none.
    pub fn read(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(MANIFEST);
        let text = match read_bytes(&path, ReadLimit::JSON) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            other => other.map_err(|source| not_read(&path, source))?,
        };
        let manifest: Result<Self, String> =
            serde_json::from_slice(&text).map_err(|e| e.to_string());
        let manifest = manifest.and_then(Self::checked);
        manifest
            .map(Some)
            .map_err(|what| StudyError::Manifest { path, what })
    }

    /// What no `study run` writes is refused: the file was edited by hand.
    fn checked(self) -> Result<Self, String> {
        if !is_below(&self.study) {
            let study = self.study.display();
            return Err(format!(
                "`study` is `{study}`, not a path below {INPUTS} without `..`"
            ));
        }
        let is_input = |file: &&String| {
            let file = Path::new(file);
            file.is_absolute() || is_below(file)
        };
        if let Some(file) = self.inputs.keys().find(|file| !is_input(file)) {
            return Err(format!(
                "`inputs` names `{file}`, which is neither absolute nor a path below {INPUTS} without `..`"
            ));
        }
        self.overrides()?;
        if !(1..=MOST_RUNS).contains(&self.runs) {
            let runs = self.runs;
            return Err(format!("`runs` is {runs}, not from 1 to {MOST_RUNS}"));
        }
        Ok(self)
    }

    /// What `--set` changed; fails where that cannot be read.
    pub fn overrides(&self) -> Result<Vec<Override>, String> {
        let set = self.set.iter().map(|text| text.parse::<Override>());
        let set: Result<_, _> = set.collect();
        set.map_err(|error| format!("`set`: {error}"))
    }

    /// Writes it into a folder, whole or not at all.
    pub fn write(&self, folder: &Path) -> Result {
        let path = folder.join(MANIFEST);
        let text = serde_json::to_string_pretty(self);
        let text = text.map_err(|e| StudyError::file(&path, e.into()))? + "\n";
        write_whole(&path, text.as_bytes())
    }

    /// An input that is named by an absolute path, so that the folder has no copy, and that has changed.
    pub fn changed_outside(&self) -> Option<PathBuf> {
        self.changed(None)
    }

    /// Whether the copies of the inputs in a folder are what its rows were made with.
    pub fn check_copies(&self, folder: &Path) -> Result {
        let copy = self.changed(Some(&folder.join(INPUTS)));
        copy.map_or(Ok(()), |copy| Err(StudyError::Changed(copy)))
    }

    /// The first whose content is another, or that is gone: of the inputs that are named by absolute
    /// paths, or of the copies below a folder.
    fn changed(&self, copies: Option<&Path>) -> Option<PathBuf> {
        let is_same =
            |path: &Path, hash: &str| read_input(path).is_ok_and(|bytes| sha256(&bytes) == hash);
        let is_wanted = |file: &str| Path::new(file).is_relative() == copies.is_some();
        let inputs = self.inputs.iter().filter(|(file, _)| is_wanted(file));
        let folder = copies.unwrap_or(Path::new(""));
        let mut inputs = inputs.map(|(file, hash)| (folder.join(file), hash));
        let changed = inputs.find(|(path, hash)| !is_same(path, hash));
        changed.map(|(path, _)| path)
    }

    /// Whether a row can be of this study, or of this part of it.
    pub fn check_row(&self, row: &Row) -> Result<(), String> {
        let (index, runs) = (row.index, self.runs);
        if index >= runs {
            return Err(format!("run {index} is none of the study's {runs}"));
        }
        match self.shard.filter(|shard| !shard.holds(index)) {
            Some(shard) => Err(format!("run {index} is not of shard {shard}")),
            None => Ok(()),
        }
    }

    /// What differs between two of them, in words; shard and number of runs aside: a study may go on
    /// to more runs.
    pub fn difference(&self, now: &Self) -> Option<String> {
        let changed = |what: &str, a: &dyn fmt::Display, b: &dyn fmt::Display| {
            Some(format!("{what}: {a} then, {b} now"))
        };
        if self.study != now.study {
            return changed("file", &self.study.display(), &now.study.display());
        }
        for (file, hash) in &self.inputs {
            match now.inputs.get(file) {
                None => return Some(format!("{file} is no input any more")),
                Some(other) if other != hash => return Some(format!("{file} has changed")),
                Some(_) => {}
            }
        }
        if let Some(file) = now.inputs.keys().find(|f| !self.inputs.contains_key(*f)) {
            return Some(format!("{file} is a new input"));
        }
        if self.set != now.set {
            let all = |set: &[String]| match set {
                [] => "none".to_owned(),
                set => set.join(" "),
            };
            return changed("--set", &all(&self.set), &all(&now.set));
        }
        if self.metrotwin != now.metrotwin {
            return changed("version of metrotwin", &self.metrotwin, &now.metrotwin);
        }
        if self.program != now.program {
            return Some("the program is of another build".into());
        }
        if self.renderer != now.renderer {
            return changed("--renderer", &self.renderer.adapter, &now.renderer.adapter);
        }
        None
    }
}
