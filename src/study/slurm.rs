//! A study as a Slurm job array: a task a shard, and a job that merges them when all have ended well.
//! Slurm does the scheduling; here are only two scripts, which can be read before they are handed in.

use super::{Result, StudyError, announce, write_whole};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder of the scripts, below the study's.
const FOLDER: &str = "slurm";
/// Of one task of the array, and of the job that merges.
const SCRIPTS: [&str; 2] = ["array.sh", "merge.sh"];
const NO_SBATCH: &str = "sbatch is not there: install Slurm's client (on Debian: slurm-client), or run \
                         the shards yourself with --shard and merge them";

/// What to hand in.
#[derive(Clone, Debug)]
pub struct Submission {
    /// Name of the study, for the queue.
    pub name: String,
    /// The program, as the machines that run it see it.
    pub program: PathBuf,
    /// The study's file.
    pub study: PathBuf,
    /// Its folder, on a file system that all machines share.
    pub folder: PathBuf,
    /// Tasks of the array.
    pub shards: u64,
    /// Cores of each.
    pub cores: u64,
    /// More arguments for `study run`.
    pub arguments: Vec<String>,
    /// More arguments for `sbatch`: partition, account, time limit.
    pub sbatch: Vec<String>,
}

/// Jobs that were handed in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submitted {
    /// The array.
    pub array: String,
    /// The job that merges.
    pub merge: String,
}

impl Submission {
    /// Whether scripts can be made of it: what they name is read by the shell and by Slurm, each by rules
    /// of its own, and is refused where these give any character another meaning.
    pub fn check(&self) -> Result {
        let paths = [&self.program, &self.study, &self.folder].map(|path| path.to_str());
        let arguments = self.arguments.iter().map(|a| Some(a.as_str()));
        let mut all = [Some(self.name.as_str())]
            .into_iter()
            .chain(paths)
            .chain(arguments);
        let is_wrong = |c: char| c.is_control() || "'\"`%\\\u{fffd}".contains(c);
        let has_wrong = |text: &Option<&str>| text.is_none_or(|text| text.contains(is_wrong));
        match all.find(has_wrong) {
            None => Ok(()),
            Some(text) => Err(StudyError::Unusable(format!(
                "{:?} cannot stand in a script for Slurm: give names and paths without quotes, `%`, \
                 backslashes and control characters",
                text.unwrap_or("a path that is not UTF-8")
            ))),
        }
    }

    /// Script of one task of the array.
    fn array_script(&self) -> String {
        let Self { shards, cores, .. } = self;
        let arguments: Vec<String> = self.arguments.iter().map(|a| quoted(a)).collect();
        format!(
            "{}#SBATCH --array=1-{shards}\n#SBATCH --cpus-per-task={cores}\n\
             shard=$SLURM_ARRAY_TASK_ID\n\
             exec {} study run {} --shard \"$shard/{shards}\" --jobs {cores} --resume \\\n    \
             --out {}/\"shard-$shard-of-{shards}\" {}\n",
            self.head("%A_%a"),
            quoted(&self.program.display().to_string()),
            quoted(&self.study.display().to_string()),
            quoted(&self.folder.display().to_string()),
            arguments.join(" ")
        )
    }

    /// Script of the job that merges.
    fn merge_script(&self) -> String {
        format!(
            "{}exec {} study merge {}\n",
            self.head("merge_%j"),
            quoted(&self.program.display().to_string()),
            quoted(&self.folder.display().to_string())
        )
    }

    fn head(&self, log: &str) -> String {
        let folder = self.scripts().display().to_string();
        format!(
            "#!/bin/bash\n#SBATCH --job-name={}\n#SBATCH --output=\"{folder}/{log}.log\"\n",
            self.name
        )
    }

    /// Where scripts and logs go.
    pub fn scripts(&self) -> PathBuf {
        self.folder.join(FOLDER)
    }

    /// Writes both scripts, and gives their paths.
    pub fn write(&self) -> Result<[PathBuf; 2]> {
        self.check()?;
        let folder = self.scripts();
        fs::create_dir_all(&folder).map_err(|e| StudyError::file(&folder, e))?;
        announce(&self.folder, SCRIPTS.map(|name| format!("{FOLDER}/{name}")))?;
        let write = |name: &str, text: String| {
            let path = folder.join(name);
            write_whole(&path, text.as_bytes()).map(|()| path)
        };
        Ok([
            write(SCRIPTS[0], self.array_script())?,
            write(SCRIPTS[1], self.merge_script())?,
        ])
    }

    /// Hands both in; `wait` comes back when the merge has ended.
    pub fn submit(&self, wait: bool) -> Result<Submitted> {
        let [array, merge] = self.write()?;
        let array = self.sbatch(&array, &[])?;
        let after = format!("--dependency=afterok:{array}");
        // If a shard fails, the merge would wait for ever.
        let mut options = vec![after.as_str(), "--kill-on-invalid-dep=yes"];
        options.extend(wait.then_some("--wait"));
        let merge = self.sbatch(&merge, &options)?;
        Ok(Submitted { array, merge })
    }

    fn sbatch(&self, script: &Path, options: &[&str]) -> Result<String> {
        let output = Command::new("sbatch")
            .arg("--parsable")
            .args(options)
            .args(&self.sbatch)
            .arg(script)
            .output();
        let output = output.map_err(|e| {
            StudyError::Unusable(match e.kind() {
                io::ErrorKind::NotFound => NO_SBATCH.to_owned(),
                _ => format!("sbatch: {e}"),
            })
        })?;
        let stdout = String::from_utf8_lossy(&output.stdout);
        if !output.status.success() {
            let why = String::from_utf8_lossy(&output.stderr);
            let why = format!("{} {}", why.trim(), stdout.trim());
            return Err(StudyError::Unusable(format!(
                "sbatch {}: {why}",
                script.display()
            )));
        }
        // `id` or `id;cluster`.
        Ok(stdout
            .trim()
            .split(';')
            .next()
            .unwrap_or_default()
            .to_owned())
    }
}

/// For the shell: what [`Submission::check`] lets pass has no quotes.
fn quoted(text: &str) -> String {
    format!("'{text}'")
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn submission() -> Submission {
        Submission {
            name: "speeds".into(),
            program: "/opt/a b/metrotwin".into(),
            study: "/data/speeds $HOME.toml".into(),
            folder: "/data/out".into(),
            shards: 4,
            cores: 2,
            arguments: vec!["--renderer".into(), "cpu".into()],
            sbatch: Vec::new(),
        }
    }

    /// A line break that begins a command of its own, a quote that ends a path, a `%` that Slurm fills
    /// in.
    #[test]
    fn what_means_something_to_shell_or_slurm_is_refused() {
        assert!(submission().check().is_ok());
        for wrong in [
            "a\ntouch x #",
            "o'clock",
            "\"a\"",
            "`a`",
            "50%",
            "a\\b",
            "a\u{7f}",
        ] {
            let folder = Submission {
                folder: wrong.into(),
                ..submission()
            };
            let study = Submission {
                study: wrong.into(),
                ..submission()
            };
            let program = Submission {
                program: wrong.into(),
                ..submission()
            };
            let name = Submission {
                name: wrong.into(),
                ..submission()
            };
            let arguments = Submission {
                arguments: vec![wrong.into()],
                ..submission()
            };
            for submission in [folder, study, program, name, arguments] {
                let error = submission.write().unwrap_err().to_string();
                assert!(
                    error.contains("cannot stand in a script"),
                    "{wrong:?}: {error}"
                );
            }
        }
    }

    /// Paths that the shell would cut up.
    #[test]
    fn scripts_quote_what_they_name() {
        let submission = submission();
        let script = submission.array_script();
        assert!(script.starts_with("#!/bin/bash\n"), "{script}");
        assert!(script.contains("#SBATCH --array=1-4\n"), "{script}");
        assert!(
            script.contains("'/opt/a b/metrotwin' study run '/data/speeds $HOME.toml'"),
            "{script}"
        );
        assert!(
            script.contains("'/data/out'/\"shard-$shard-of-4\" '--renderer' 'cpu'"),
            "{script}"
        );
        assert!(
            submission
                .merge_script()
                .ends_with("study merge '/data/out'\n")
        );
    }
}
