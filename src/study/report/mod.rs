//! A study on one page: figures with intervals, plots, worst runs with the command that replays each,
//! failures. The page needs nothing but itself; the plots lie beside it as SVG too.

mod axis;
mod figures;
mod page;
mod plot;

use super::{Digest, Result, Row, Study, StudyError, announce, write_whole};
use plot::Plot;
use std::fs;
use std::io;
use std::path::PathBuf;

/// Name of the page in a study's folder.
pub const REPORT: &str = "report.html";
/// Folder of the plots.
pub const PLOTS: &str = "plots";

/// Writes the page of a study's rows and its plots into the study's folder; gives the page's path.
pub fn report(study: &Study, digest: &Digest, rows: &[Row]) -> Result<PathBuf> {
    let plots = figures::all(&study.template, digest, rows);
    let file = |plot: &Plot| format!("{PLOTS}/{}.svg", plot.name);
    let names = plots.iter().map(file).chain([REPORT.to_owned()]);
    announce(&study.folder, names)?;
    let beside = study.folder.join(PLOTS);
    fs::create_dir_all(&beside).map_err(|e| StudyError::file(&beside, e))?;
    for plot in &plots {
        write_whole(&study.folder.join(file(plot)), plot.svg.as_bytes())?;
    }
    let path = study.folder.join(REPORT);
    let html = page::page(study, digest, &plots, rows);
    let html = html.map_err(|e| StudyError::file(&path, io::Error::other(e)))?;
    write_whole(&path, html.as_bytes())?;
    Ok(path)
}
