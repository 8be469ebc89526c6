//! A study as a Slurm job array: a task a shard, and a job that merges them when all have ended well.
//! Slurm does the scheduling; here are only two scripts, which can be read before they are handed in.

use super::{Result, StudyError, write_whole};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

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
    /// Script of one task of the array.
    pub fn array_script(&self) -> String {
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
    pub fn merge_script(&self) -> String {
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
        self.folder.join("slurm")
    }

    /// Writes both scripts, and gives their paths.
    pub fn write(&self) -> Result<[PathBuf; 2]> {
        let folder = self.scripts();
        fs::create_dir_all(&folder).map_err(|e| StudyError::file(&folder, e))?;
        let write = |name: &str, text: String| {
            let path = folder.join(name);
            write_whole(&path, text.as_bytes()).map(|()| path)
        };
        Ok([
            write("array.sh", self.array_script())?,
            write("merge.sh", self.merge_script())?,
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

/// For the shell.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Paths that the shell would cut up.
    #[test]
    fn scripts_quote_what_they_name() {
        let submission = Submission {
            name: "speeds".into(),
            program: "/opt/a b/metrotwin".into(),
            study: "/data/o'clock.toml".into(),
            folder: "/data/out".into(),
            shards: 4,
            cores: 2,
            arguments: vec!["--renderer".into(), "cpu".into()],
            sbatch: Vec::new(),
        };
        let script = submission.array_script();
        assert!(script.starts_with("#!/bin/bash\n"), "{script}");
        assert!(script.contains("#SBATCH --array=1-4\n"), "{script}");
        assert!(
            script.contains("'/opt/a b/metrotwin' study run '/data/o'\\''clock.toml'"),
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
