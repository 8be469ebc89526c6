//! Tables for other programs.

use super::observer_error::{Result, broken, make_folder_of};
use crate::bus::TrainId;
use crate::files::PartFile;
use crate::session::{Event, Observer, Opening};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Columns of `fixes.csv`; `metrotwin run --help` says what they are.
pub(crate) const FIX_COLUMNS: &str = "time_s,method,uid,identity,chainage_m,true_chainage_m,error_m,sigma_m,\
                      lamp_x_m,lamp_y_m,lamp_z_m,track";

/// One row a position fix of one train, as comma-separated values: when, by which method, on which lamp, the
/// chainage with its sigma, the true one, their difference, the lamp in the left camera's
/// frame (x right, y down, z forward), and the track's name. Written as `<path>.part`, and named in [`Observer::close`].
pub struct FixTable {
    train: TrainId,
    path: PathBuf,
    rows: Option<BufWriter<PartFile>>,
    /// Names of the tracks.
    tracks: Vec<String>,
}

impl FixTable {
    /// Of a train, into a folder.
    pub fn to_folder(folder: &Path, train: TrainId) -> Self {
        Self {
            train,
            path: folder.join(Self::file_name(train)),
            rows: None,
            tracks: Vec::new(),
        }
    }

    /// `fixes.csv` for the first train, `fixes_train_k.csv` for train `k`.
    pub fn file_name(train: TrainId) -> String {
        match train.index() {
            0 => "fixes.csv".to_owned(),
            k => format!("fixes_train_{k}.csv"),
        }
    }
}

impl Observer for FixTable {
    fn open(&mut self, opening: &Opening<'_>) -> Result {
        make_folder_of(&self.path)?;
        let file = PartFile::create(&self.path).map_err(broken(&self.path))?;
        let mut rows = BufWriter::new(file);
        writeln!(rows, "{FIX_COLUMNS}").map_err(broken(&self.path))?;
        self.rows = Some(rows);
        let tracks = opening.tunnel.network.tracks.iter();
        self.tracks = tracks.map(|track| track.name.clone()).collect();
        Ok(())
    }

    fn observe(&mut self, event: &Event<'_>) -> Result {
        let Event::Pair {
            train,
            report,
            true_chainages_m,
            ..
        } = event
        else {
            return Ok(());
        };
        let Some(rows) = self.rows.as_mut().filter(|_| *train == self.train) else {
            return Ok(());
        };
        for (fix, true_m) in report.fixes.iter().zip(*true_chainages_m) {
            let lamp = fix.lamp_in_camera;
            writeln!(
                rows,
                "{:.9},{},{},{},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{}",
                fix.time.secs(),
                fix.method,
                fix.uid,
                fix.identity,
                fix.chainage_m,
                true_m,
                fix.chainage_m - true_m,
                fix.sigma_m,
                lamp.x,
                lamp.y,
                lamp.z,
                self.tracks
                    .get(usize::from(fix.track.0))
                    .map_or("", String::as_str),
            )
            .map_err(broken(&self.path))?;
        }
        // What has been found is kept when the process is killed.
        rows.flush().map_err(broken(&self.path))
    }

    fn close(&mut self) -> Result {
        let Some(rows) = self.rows.take() else {
            return Ok(());
        };
        let part = rows.into_inner().map_err(|e| e.into_error());
        part.and_then(PartFile::finish).map_err(broken(&self.path))
    }
}
