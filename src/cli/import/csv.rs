//! `metrotwin import csv`: tables of an office.

use super::super::check::read_as;
use super::super::fault::Failure;
use super::super::map::refused;
use super::super::print;
use super::super::result_file::{refuse_taken, write_whole};
use super::told::file_name;
use super::value::{heading, place};
use super::{name_of, refuse_ending};
use crate::settings::ReadLimit;
use crate::track::geodesy::Geodetic;
use crate::track::import::{TableImport, TableOptions};
use std::path::PathBuf;

pub(super) const AFTER_CSV: &str = "\
FILE has a row for each element of the alignment, in order, and one for the end of the line:

  chainage_m;element;radius_m;turn;cant_mm;grade_permille
  12000,0;straight;;;;-3,0
  12150,0;clothoid;;;;
  12200,0;arc;500,0;right;60;
  12400,0;clothoid;;;;
  12450,0;straight;;;;2,0
  12700,0;end;;;;

chainage_m         where the element begins, as the office states it
radius_m           of an arc; empty, 0 or inf: straight
turn               left or right, looking up the line; without this column a negative radius turns right
element            straight, arc or clothoid; without this column what has a radius is an arc. A clothoid runs from the
                   curvature before to that after it
length_m           of the element; needed in the last row, if that is not the end of the line
cant_mm            of an arc; or cant_m, in metres
grade_permille     from here on, rising positive; empty: as before; or grade_percent, or grade_ratio (1:40, or -1:40 where
                   the line falls)
vertical_radius_m  of the curve that leads into the grade; default 3000

Columns may stand in any order, with `,`, `;` or tabs between them; with `;` or tabs numbers may have a decimal comma.
A table of lamps has the columns chainage_m, number (or uid, as 1-023), and, if there are any, lateral_m (left of the
track positive), height_m, aim_yaw_deg, power_w. The line lies in a circular tunnel, or with --open all of it in the open;
other sections, balises, stations and so on are added to the written file by hand.

Examples:
  metrotwin import csv alignment.csv --out out/line.toml
  metrotwin import csv alignment.csv --lamps lamps.csv --line-number 1 --datum 30.657,104.066 --heading-deg 90 \\
    --out out/line.toml";

#[derive(clap::Args)]
pub(super) struct CsvArgs {
    /// Table of the alignment
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Tunnel file to be written
    #[arg(long, value_name = "TUNNEL")]
    out: PathBuf,
    /// Write over a file that is there
    #[arg(long)]
    force: bool,
    /// Table of lamps
    #[arg(long, value_name = "LAMPS")]
    lamps: Option<PathBuf>,
    /// First part of the lamps' UIDs
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(0..=15))]
    line_number: u8,
    /// Where the line begins on the earth, degrees
    #[arg(long, value_name = "LAT,LON", value_parser = place, allow_hyphen_values = true)]
    datum: Option<Geodetic>,
    /// Its direction there, degrees from east towards north
    #[arg(long, value_name = "H", default_value_t = 0.0, value_parser = heading, allow_hyphen_values = true)]
    heading_deg: f64,
    /// The line lies in the open, not in a tunnel
    #[arg(long)]
    open: bool,
}

pub(super) fn csv(args: &CsvArgs) -> Result<(), Failure> {
    refuse_ending(&args.out)?;
    refuse_taken(&args.out, "--out", args.force)?;
    let alignment = read_as(&args.file, ReadLimit::CSV)?;
    let lamps = args
        .lamps
        .as_ref()
        .map(|path| read_as(path, ReadLimit::CSV));
    let lamps = lamps.transpose()?;
    let options = TableOptions {
        name: name_of(&args.out),
        line_number: args.line_number,
        datum: args.datum,
        heading_deg: args.heading_deg,
        is_open: args.open,
    };
    let import = TableImport::read(&alignment, lamps.as_deref(), &options).map_err(|fault| {
        let path = match &args.lamps {
            Some(lamps) if fault.is_of_lamps => lamps,
            _ => &args.file,
        };
        refused(
            path,
            &fault,
            "see `metrotwin import csv --help` for the columns",
        )
    })?;
    let names = [Some(&args.file), args.lamps.as_ref()]
        .into_iter()
        .flatten();
    let names: Vec<String> = names.map(|path| file_name(path)).collect();
    let comment = format!("By `metrotwin import csv` from {}.", names.join(" and "));
    let text = import.file.to_text(&[comment]).map_err(Failure::run)?;
    write_whole(&args.out, &text)?;
    for header in &import.unknown {
        eprintln!("left out: column `{header}`: it means nothing here");
    }
    print(&format!(
        "{}: {:.3} m, {} elements, {} grades, {} lamps; {}",
        args.out.display(),
        import.length_m,
        import.file.plan.len(),
        import.file.grades.len(),
        import.file.lamp.len(),
        match args.open {
            true => "in the open",
            false => "in a tunnel (--open: in the open)",
        }
    ))
}
