//! A study's folder, opened once for all that is asked of it.

use super::stop::Precision;
use super::{INPUTS, MANIFEST, Manifest, Result, Row, StudyError, journal};
use crate::scenario::read;
use crate::scenario::sampling::Template;
use std::path::{Path, PathBuf};

/// The study that a folder holds, from the copies of its inputs.
#[derive(Clone, Debug)]
pub struct Study {
    /// Where it lies.
    pub folder: PathBuf,
    /// What its rows were made with.
    pub manifest: Manifest,
    /// What its runs are drawn from.
    pub template: Template,
}

impl Study {
    /// Opens a folder that `study run` or `study merge` has written.
    pub fn open(folder: &Path) -> Result<Self> {
        let manifest =
            Manifest::read(folder)?.ok_or_else(|| StudyError::NoStudy(folder.to_owned()))?;
        manifest.check_copies(folder)?;
        let path = folder.join(INPUTS).join(&manifest.study);
        let set = manifest.overrides().map_err(|what| StudyError::Manifest {
            path: folder.join(MANIFEST),
            what,
        })?;
        let mut template = Template::from_text(&path, read(&path)?, &set)?;
        template.settings.runs = runs_of_cell(folder, &manifest, &template)?;
        Ok(Self {
            folder: folder.to_owned(),
            manifest,
            template,
        })
    }

    /// All rows, in order.
    pub fn all_rows(&self) -> Result<Vec<Row>> {
        journal::read_of(&self.folder, &self.manifest)
    }

    /// The rows that count, in order.
    pub fn rows(&self) -> Result<Vec<Row>> {
        let mut rows = self.all_rows()?;
        if let Some(precision) = Precision::of(&self.template)? {
            precision.truncate(&mut rows);
        }
        Ok(rows)
    }
}

/// The number of runs for each combination of swept values.
fn runs_of_cell(folder: &Path, manifest: &Manifest, template: &Template) -> Result<u32> {
    let (runs, cells) = (manifest.runs, template.cells());
    let of_cell = runs.checked_div(cells).and_then(|n| u32::try_from(n).ok());
    let of_cell = of_cell.filter(|_| runs.is_multiple_of(cells));
    of_cell.ok_or_else(|| StudyError::Manifest {
        path: folder.join(MANIFEST),
        what: format!("`runs` is {runs}, no multiple of the {cells} combinations that are swept"),
    })
}
