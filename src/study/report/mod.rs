//! A study on one page: figures with intervals, plots, worst runs with the command that replays each,
//! failures. The page needs nothing but itself; the plots lie beside it as SVG too.

mod axis;
mod figures;
mod page;
mod plot;

use super::worker::template_of;
use super::{Digest, Row, StudyError, journal, stop::Precision, write_whole};
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
    let beside = folder.join(PLOTS);
    fs::create_dir_all(&beside).map_err(|e| StudyError::file(&beside, e))?;
    for plot in &plots {
        let path = beside.join(format!("{}.svg", plot.name));
        write_whole(&path, plot.svg.as_bytes())?;
    }
    let html = page::page(folder, &manifest, &template, &digest, &plots, &rows);
    let path = folder.join(REPORT);
    write_whole(&path, html.as_bytes())?;
    Ok((path, digest))
}
