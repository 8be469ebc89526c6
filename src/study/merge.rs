//! Shards put together.

use super::journal::{self, JOURNAL, Journal};
use super::{
    Manifest, Result, Row, Shard, Status, Study, StudyError, copy_inputs, table, write_whole,
};
use crate::scenario::sampling::Inputs;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Makes one study of all shards below a folder, in that folder, and gives its rows. Nothing is written
/// unless every shard is there, whole, and of the same study.
pub fn merge(folder: &Path) -> Result<Vec<Row>> {
    let shards = shards(folder)?;
    let Some((first_path, first)) = shards.first() else {
        return wrong(format!("{} has no folder shard-I-of-N", folder.display()));
    };
    let mut found = BTreeMap::new();
    let mut rows = Vec::new();
    for (path, manifest) in &shards {
        let runs = (first.runs != manifest.runs).then(|| "its number of runs differs".to_owned());
        if let Some(what) = first.difference(manifest).or(runs) {
            let (a, b) = (first_path.display(), path.display());
            return wrong(format!("{a} and {b} are not of one study: {what}"));
        }
        let Some(shard) = manifest.shard else {
            return wrong(format!("{} is a whole study, not a shard", path.display()));
        };
        let of_shard = journal::read_of(path, manifest)?;
        check_whole(path, shard, manifest.runs, &of_shard)?;
        found.insert(shard.number, shard.of);
        rows.extend(of_shard);
    }
    let of = found.values().next().copied().unwrap_or(0);
    if found.values().any(|n| *n != of) {
        let folder = folder.display();
        return wrong(format!("{folder} holds shards of different numbers"));
    }
    let missing: Vec<String> = (1..=of)
        .filter(|k| !found.contains_key(k))
        .map(|k| format!("{k}/{of}"))
        .collect();
    if !missing.is_empty() {
        return wrong(format!(
            "{}: shards {} are missing; run them with --shard",
            folder.display(),
            missing.join(", ")
        ));
    }
    // The folder is locked, so that no study runs there meanwhile.
    let (_journal, kept, there) = Journal::open(folder)?;
    if let Some(what) = kept.as_ref().and_then(|kept| kept.difference(first)) {
        let path = folder.to_owned();
        return Err(StudyError::Other { path, what });
    }
    // Rows that the folder itself holds count too, such as those of runs that crashed in a shard and were
    // tried again after an earlier merge; and it may have gone on to more runs.
    rows.extend(there);
    let runs = kept.map_or(0, |kept| kept.runs).max(first.runs);
    let merged = Manifest {
        shard: None,
        runs,
        ..first.clone()
    };
    write(folder, first_path, &merged, rows)
}

fn wrong<T>(what: String) -> Result<T> {
    Err(StudyError::Unusable(what))
}

/// Folders of shards, with their manifests.
fn shards(folder: &Path) -> Result<Vec<(PathBuf, Manifest)>> {
    let failed = |e| StudyError::file(folder, e);
    let mut shards = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned());
        let Some(name) = name.filter(|n| n.starts_with("shard-")) else {
            continue;
        };
        let manifest = Manifest::read(&path)?;
        let manifest = manifest.ok_or_else(|| StudyError::NoStudy(path.clone()))?;
        // A copy kept under another name is no shard.
        if manifest.shard.is_some_and(|shard| shard.folder() == name) {
            shards.push((path, manifest));
        }
    }
    shards.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(shards)
}

fn check_whole(path: &Path, shard: Shard, runs: u64, rows: &[Row]) -> Result {
    let wanted = (0..runs).filter(|k| shard.holds(*k)).count();
    if rows.len() < wanted {
        return wrong(format!(
            "{} has {} of {wanted} rows; finish it with --shard {shard} --resume",
            path.display(),
            rows.len()
        ));
    }
    Ok(())
}

fn write(folder: &Path, shard: &Path, manifest: &Manifest, mut rows: Vec<Row>) -> Result<Vec<Row>> {
    // The first of a run's rows is kept: the last that was made, and one that crashed gives way to any other.
    rows.reverse();
    rows.sort_by_key(|row| (row.index, row.status == Status::Crashed));
    rows.dedup_by_key(|row| row.index);
    let template = Study::open(shard)?.template;
    let failed = |e| StudyError::file(folder, e);
    let inputs = Inputs::of(&template).map_err(failed)?;
    copy_inputs(folder, &inputs)?;
    // Before the rows: a folder that holds rows belongs to a study.
    manifest.write(folder)?;
    let mut text = Vec::new();
    for row in &rows {
        serde_json::to_writer(&mut text, row).map_err(|e| failed(e.into()))?;
        text.push(b'\n');
    }
    write_whole(&folder.join(JOURNAL), &text)?;
    table::write(folder, &template, &rows)?;
    Ok(rows)
}
