//! A study on one page: figures with intervals, plots, worst runs with the command that replays each,
//! failures. The page needs nothing but itself; the plots lie beside it as SVG too.

mod figures;
mod page;
mod plot;

use super::worker::template_of;
use super::{Digest, Row, StudyError, journal, stop::Precision};
use std::fs;
use std::path::{Path, PathBuf};

/// Name of the page in a study's folder.
pub const REPORT: &str = "report.html";
/// Folder of the plots.
pub const PLOTS: &str = "plots";

/// The rows of a study's folder that count, in order.
pub fn rows(folder: &Path) -> Result<Vec<Row>, StudyError> {
    let (_, template) = template_of(folder)?;
    let mut rows = journal::read(folder)?;
    if let Some(precision) = Precision::of(&template)? {
        precision.truncate(&mut rows);
    }
    Ok(rows)
}

/// Writes the page and its plots into a study's folder.
pub fn report(folder: &Path) -> Result<(PathBuf, Digest), StudyError> {
    let (manifest, template) = template_of(folder)?;
    let rows = rows(folder)?;
    let digest = Digest::of(&template, &rows)?;
    let plots = figures::all(&template, &digest, &rows);
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| StudyError::file(&path, source)
    };
    let beside = folder.join(PLOTS);
    fs::create_dir_all(&beside).map_err(failed(&beside))?;
    for plot in &plots {
        let path = beside.join(format!("{}.svg", plot.name));
        fs::write(&path, &plot.svg).map_err(failed(&path))?;
    }
    let html = page::page(folder, &manifest, &template, &digest, &plots, &rows);
    let (part, path) = (folder.join(format!("{REPORT}.part")), folder.join(REPORT));
    let written = fs::write(&part, html).and_then(|()| fs::rename(&part, &path));
    written.map_err(failed(&path))?;
    Ok((path, digest))
}
