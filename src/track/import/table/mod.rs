//! A line from tables: its alignment, element by element, and its lamps.
//!
//! A row of the alignment is an element, by the chainage where it begins; the last one says where the line ends. Chainages
//! are as the office states them: the first one is that of the track's begin.

mod line;
mod sheet;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;

pub use sheet::SheetError;
#[cfg(feature = "cli")]
pub(crate) use sheet::SheetRow;
pub(crate) use sheet::{Sheet, SheetColumn};

use crate::track::check::check;
use crate::track::file::{
    DatumEntry, Increment, SectionEntry, SectionShape, StartEntry, StatedChainageEntry, TunnelFile,
};
use crate::track::geodesy::Geodetic;
use line::{SAME_M, TableLine};

/// Columns of the table of the alignment.
const ALIGNMENT: [SheetColumn; 11] = [
    SheetColumn::needed("chainage_m", &["chainage", "station", "station_m"]),
    SheetColumn::needed("radius_m", &["radius", "r"]),
    SheetColumn::optional("turn", &["hand", "direction"]),
    SheetColumn::optional("element", &["type", "kind"]),
    SheetColumn::optional("length_m", &["length", "l"]),
    SheetColumn::optional("cant_mm", &["cant"]),
    SheetColumn::optional("cant_m", &[]),
    SheetColumn::optional("grade_permille", &["grade", "gradient_permille"]),
    SheetColumn::optional("grade_percent", &["gradient_percent"]),
    SheetColumn::optional("grade_ratio", &["gradient_ratio"]),
    SheetColumn::optional("vertical_radius_m", &["vertical_radius"]),
];

/// Columns of the table of lamps.
const LAMPS: [SheetColumn; 6] = [
    SheetColumn::needed("chainage_m", &["chainage", "station", "station_m"]),
    SheetColumn::needed("number", &["uid", "lamp"]),
    SheetColumn::optional("lateral_m", &["lateral"]),
    SheetColumn::optional("height_m", &["height"]),
    SheetColumn::optional("aim_yaw_deg", &[]),
    SheetColumn::optional("power_w", &["power"]),
];

/// Where a line of a table lies, and what it is called.
#[derive(Clone, Debug)]
pub struct TableOptions {
    /// Name of the tunnel file.
    pub name: String,
    /// First part of the lamps' UIDs.
    pub line_number: u8,
    /// Where it begins, if that is known.
    pub datum: Option<Geodetic>,
    /// Its direction there, degrees from east towards north.
    pub heading_deg: f64,
    /// It lies in the open, not in a circular tunnel.
    pub is_open: bool,
}

/// A line of tables.
#[derive(Clone, Debug)]
pub struct TableImport {
    /// The file.
    pub file: TunnelFile,
    /// Its length, metres.
    pub length_m: f64,
    /// Headers that mean nothing here.
    pub unknown: Vec<String>,
}

impl TableImport {
    /// Reads the texts of the alignment and, if there are any, of the lamps.
    pub fn read(
        alignment: &str,
        lamps: Option<&str>,
        options: &TableOptions,
    ) -> Result<Self, TableFault> {
        let of_alignment = |error| TableFault {
            is_of_lamps: false,
            error,
        };
        let of_lamps = |error| TableFault {
            is_of_lamps: true,
            error,
        };
        let sheet = Sheet::read(alignment, &ALIGNMENT).map_err(of_alignment)?;
        let line = TableLine::of(&sheet).map_err(of_alignment)?;
        let mut file = TunnelFile::empty(&options.name);
        file.line_number = options.line_number;
        file.start = Some(StartEntry {
            heading_deg: options.heading_deg,
            ..StartEntry::default()
        });
        file.datum = options.datum.map(|place| DatumEntry {
            latitude_deg: place.latitude_deg,
            longitude_deg: place.longitude_deg,
            height_m: place.height_m,
            heading_deg: 0.0,
        });
        if line.begin_m.abs() > SAME_M {
            file.stated_chainage = Some(StatedChainageEntry {
                prefix: String::new(),
                start_m: line.begin_m,
                increment: Increment::Increasing,
                equations: Vec::new(),
            });
        }
        if options.is_open {
            file.sections = vec![SectionEntry {
                from_m: 0.0,
                to_m: None,
                shape: SectionShape::Open { width_m: None },
            }];
        }
        file.plan = line.plan.iter().map(|(_, entry)| entry.clone()).collect();
        file.grades = line.grades.iter().map(|(_, entry)| entry.clone()).collect();
        let mut unknown = sheet.unknown;
        let mut lamp_lines = Vec::new();
        if let Some(lamps) = lamps {
            let sheet = Sheet::read(lamps, &LAMPS).map_err(of_lamps)?;
            let found = line.lamps(&sheet, options.line_number).map_err(of_lamps)?;
            lamp_lines = found.iter().map(|(line, _)| *line).collect();
            file.lamp = found.into_iter().map(|(_, lamp)| lamp).collect();
            unknown.extend(sheet.unknown);
        }
        let mut problems = Vec::new();
        check(&file, &mut problems);
        match problems.first() {
            None => Ok(Self {
                length_m: line.length_m,
                file,
                unknown,
            }),
            Some(problem) => Err(line.fault(problem, &lamp_lines)),
        }
    }
}

/// What is wrong, and in which table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{error}")]
pub struct TableFault {
    /// In the table of lamps, not in that of the alignment.
    pub is_of_lamps: bool,
    /// What.
    pub error: SheetError,
}
