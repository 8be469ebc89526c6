//! The files that a study is made of, kept together so that any of its runs can be made again.

use super::Template;
use crate::scenario::ScenarioFile;
use crate::settings::{ReadLimit, read_bytes};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// A study's own file and all that it reads, below the folder that holds them all: so copies of
/// them find each other as the originals do.
#[derive(Clone, Debug)]
pub struct Inputs {
    root: PathBuf,
    /// The study's own file, below the root.
    pub study: PathBuf,
    /// All files, below the root, or absolute.
    pub files: Vec<PathBuf>,
}

impl Inputs {
    /// Of a study. Files that are named by absolute paths are not copied, but hashed.
    pub fn of(template: &Template) -> io::Result<Self> {
        Self::of_files(&template.path, template.files())
    }

    /// Of a scenario in a file.
    pub fn of_scenario(path: &Path, file: &ScenarioFile) -> io::Result<Self> {
        let mut file = file.clone();
        let names = file.files_mut();
        Self::of_files(path, names.into_iter().map(|name| PathBuf::from(&*name)))
    }

    fn of_files(path: &Path, files: impl IntoIterator<Item = PathBuf>) -> io::Result<Self> {
        let path = std::path::absolute(path)?;
        // Where the folder is a link, `..` is that of what it points to.
        let folder = fs::canonicalize(path.parent().unwrap_or(Path::new("/")))?;
        let study = folder.join(path.file_name().unwrap_or_default());
        let (absolute, relative): (Vec<_>, Vec<_>) =
            files.into_iter().partition(|f| f.is_absolute());
        let mut files: Vec<_> = relative.iter().map(|f| plain(&folder.join(f))).collect();
        files.push(study.clone());
        let root = files.iter().fold(folder, |root, file| common(&root, file));
        let below = |file: &PathBuf| file.strip_prefix(&root).unwrap_or(file).to_owned();
        let mut below_root: Vec<_> = files.iter().map(below).collect();
        below_root.extend(absolute);
        below_root.sort();
        below_root.dedup();
        Ok(Self {
            study: below(&study),
            files: below_root,
            root,
        })
    }

    /// Hash of each file, as `sha256sum` prints it, by its path below the root.
    pub fn hashes(&self) -> io::Result<BTreeMap<String, String>> {
        let hash = |file: &PathBuf| {
            let bytes = read_input(&self.root.join(file))?;
            Ok((file.to_string_lossy().into_owned(), sha256(&bytes)))
        };
        self.files.iter().map(hash).collect()
    }

    /// Paths of the copies that [`Self::copy_to`] makes below a folder.
    pub fn copies(&self, folder: &Path) -> impl Iterator<Item = PathBuf> {
        let relative = self.files.iter().filter(|file| file.is_relative());
        relative.map(move |file| folder.join(file))
    }

    /// Copies all files below a folder, each by `write`.
    pub fn copy_to(
        &self,
        folder: &Path,
        write: impl Fn(&Path, &[u8]) -> io::Result<()>,
    ) -> io::Result<()> {
        for copy in self.contents(folder) {
            let (to, bytes) = copy?;
            if let Some(parent) = to.parent() {
                fs::create_dir_all(parent)?;
            }
            write(&to, &bytes)?;
        }
        Ok(())
    }

    /// The paths of [`Self::copies`], each with what the copy holds.
    pub fn contents(&self, folder: &Path) -> impl Iterator<Item = io::Result<(PathBuf, Vec<u8>)>> {
        let relative = self.files.iter().filter(|file| file.is_relative());
        relative.map(move |file| Ok((folder.join(file), read_input(&self.root.join(file))?)))
    }

    /// Lets a scenario name the copies below a folder; absolute paths stay.
    pub fn rename(&self, file: &mut ScenarioFile, folder: &Path) {
        for name in file.files_mut() {
            if let Some(place) = self.place_of(name) {
                *name = folder.join(place).to_string_lossy().into_owned();
            }
        }
    }

    /// Where a file that the study's scenario names lies below the root; `None` of absolute paths.
    fn place_of(&self, name: &str) -> Option<PathBuf> {
        if Path::new(name).is_absolute() {
            return None;
        }
        let folder = self.study.parent().unwrap_or(Path::new(""));
        Some(plain(&folder.join(name)))
    }
}

/// Reads a file that a study is made of.
pub(crate) fn read_input(path: &Path) -> io::Result<Vec<u8>> {
    let kinds = [ReadLimit::TOML, ReadLimit::CSV, ReadLimit::OBJ];
    let ending = path.extension().unwrap_or_default();
    let kind = kinds
        .into_iter()
        .find(|k| ending.eq_ignore_ascii_case(k.ending));
    read_bytes(path, kind.unwrap_or(ReadLimit::TOML))
}

/// Hash of bytes, in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => _ = plain.pop(),
            other => plain.push(other),
        }
    }
    plain
}

/// The folder that holds both.
fn common(folder: &Path, file: &Path) -> PathBuf {
    let parts = folder.components().zip(file.components());
    parts.take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::settings::read_toml;
    use std::os::unix::fs::symlink;

    /// Fails where the tunnel beside a link to the scenario's folder is taken for that of the scenario.
    #[test]
    fn files_are_those_that_the_scenario_reads() {
        let base = std::env::temp_dir().join(format!("metrotwin-inputs-{}", std::process::id()));
        for (file, text) in [
            ("shared/scenarios/x.toml", ""),
            ("shared/tunnels/t.toml", "read"),
            ("own/tunnels/t.toml", "not read"),
        ] {
            let path = base.join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        symlink(base.join("shared/scenarios"), base.join("own/scenarios")).unwrap();
        let file = read_toml("name = 'x'\ntunnel = '../tunnels/t.toml'").unwrap();
        let path = base.join("own/scenarios/x.toml");
        let hashes = Inputs::of_scenario(&path, &file).unwrap().hashes().unwrap();
        assert_eq!(hashes["tunnels/t.toml"], sha256(b"read"));
        fs::remove_dir_all(&base).unwrap();
    }
}
