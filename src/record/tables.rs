//! Tables for other programs.

use super::stream::{failed, part_name};
use crate::bus::{Identity, Method, TrainId};
use crate::session::{Event, Observer, ObserverError, Opening};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

const HEADER: &str = "time_s,method,uid,identity,chainage_m,true_chainage_m,error_m,sigma_m,\
                      lamp_x_m,lamp_y_m,lamp_z_m";

/// One row a position fix, as comma-separated values: when, by which method, on which lamp, the
/// chainage with its sigma, the true one, their difference, and the lamp in the left camera's
/// frame (x right, y down, z forward). Written as `<path>.part`, and named in [`Observer::close`].
pub struct FixTable {
    path: PathBuf,
    rows: Option<BufWriter<File>>,
}

impl FixTable {
    /// Into a file.
    pub fn to_file(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            rows: None,
        }
    }
}

const WHAT: &str = "writing the table of fixes";

impl Observer for FixTable {
    fn open(&mut self, _: &Opening<'_>) -> Result<(), ObserverError> {
        if let Some(folder) = self.path.parent() {
            fs::create_dir_all(folder).map_err(failed("making the folder of the table"))?;
        }
        let mut rows = BufWriter::new(File::create(part_name(&self.path)).map_err(failed(WHAT))?);
        writeln!(rows, "{HEADER}").map_err(failed(WHAT))?;
        self.rows = Some(rows);
        Ok(())
    }

    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        let (Some(rows), Event::Pair(TrainId(0), _, report, true_chainages_m)) =
            (&mut self.rows, event)
        else {
            return Ok(());
        };
        for (fix, true_m) in report.fixes.iter().zip(*true_chainages_m) {
            let lamp = fix.lamp_in_camera;
            writeln!(
                rows,
                "{:.9},{},{},{},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6}",
                fix.time.secs(),
                method_name(fix.method),
                fix.uid,
                identity_name(fix.identity),
                fix.chainage_m,
                true_m,
                fix.chainage_m - true_m,
                fix.sigma_m,
                lamp.x,
                lamp.y,
                lamp.z,
            )
            .map_err(failed(WHAT))?;
        }
        Ok(())
    }

    fn close(&mut self) -> Result<(), ObserverError> {
        let Some(mut rows) = self.rows.take() else {
            return Ok(());
        };
        rows.flush().map_err(failed(WHAT))?;
        fs::rename(part_name(&self.path), &self.path).map_err(failed(WHAT))
    }
}

fn method_name(method: Method) -> &'static str {
    match method {
        Method::Paper => "paper",
        Method::Mono => "mono",
    }
}

fn identity_name(identity: Identity) -> &'static str {
    match identity {
        Identity::Decoded => "decoded",
        Identity::Joined => "joined",
        Identity::Followed => "followed",
        Identity::Predicted => "predicted",
    }
}
