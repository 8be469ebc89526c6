//! `metrotwin import`: tunnel files from maps and tables of others.

mod csv;
mod told;
mod value;

use super::fault::Failure;
use super::map::{read_map, read_osm, read_railml_map};
use super::print;
use super::result_file::{is_same_file, refuse_taken, write_whole};
use crate::track::geodesy::Geodetic;
use crate::track::import::railml::RailMlOptions;
use crate::track::import::{AroundPlace, Crs, ImportedMap, LayingOptions};
use csv::{AFTER_CSV, CsvArgs, csv};
use std::path::{Path, PathBuf};
use value::{metres, place, sigma};

const AFTER_OSM: &str = "\
FILE is raw JSON of the Overpass API (`out body` with the nodes), or OSM XML as the map's export gives it. To get all
tracks of an area as JSON, run this query on https://overpass-turbo.eu and export its raw data:

  [out:json]; way[railway~\"^(rail|subway|light_rail|tram|narrow_gauge)$\"](48.19,15.59,48.22,15.65); (._;>;); out body;

Taken over: tracks as straights, arcs and clothoids near the drawn points; switches, by the directions of their tracks;
crossings at one level; buffer stops; tunnels; permitted speeds on diverging legs. Not taken over, for tunnel files do
not have it: slips, speeds elsewhere, signals, heights. Every track lies level, also bridges: cut out a part of the map
where no line passes over another one.

Data are of OpenStreetMap's contributors, under the Open Database License (https://opendatacommons.org/licenses/odbl):
who publishes what is made of them must say so. The written file does in its first lines.

Examples:
  metrotwin import osm tracks.json --out out/town.toml
  metrotwin import osm city.osm --around 48.2085,15.6240 --radius-m 700 --out out/station.toml";

const AFTER_RAILML: &str = "\
Read are infrastructure and topology of railML 2.x and 3.x. Taken over: tracks, as curves near their coordinates;
gradients; switches with their names, crossings at one level, balises, tunnels, permitted speeds on diverging legs. Radii
are followed where a track has no points that say otherwise. Not taken over, for tunnel files do not have it: slips,
signals, speeds elsewhere.

Without coordinates where tracks lie is made up, from the graph and the lengths of its elements; where tracks would then
touch, switches and joints are left out. The last lines and --report say how many.

Examples:
  metrotwin import railml station.railml --out out/station.toml
  metrotwin import railml line.xml --crs EPSG:25832 --out out/line.toml --report out/line.json";

/// Write a tunnel file from a map or a table of others
#[derive(clap::Args)]
pub(super) struct ImportArgs {
    #[command(subcommand)]
    format: ImportFormat,
}

#[derive(clap::Subcommand)]
enum ImportFormat {
    /// OpenStreetMap: raw JSON or XML
    #[command(after_help = AFTER_OSM)]
    Osm(OsmArgs),
    /// Tables of an office: an alignment, and lamps
    #[command(after_help = AFTER_CSV)]
    Csv(CsvArgs),
    /// railML 2.x or 3.x
    #[command(after_help = AFTER_RAILML)]
    Railml(RailmlArgs),
}

/// What all formats have.
#[derive(clap::Args)]
struct Written {
    /// Tunnel file to be written
    #[arg(long, value_name = "TUNNEL")]
    out: PathBuf,
    /// Write all that was left out, and how near each track is to the map, as JSON
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write over files that are there
    #[arg(long)]
    force: bool,
}

impl Written {
    /// Refuses names that cannot be written to, before anything is read.
    fn refuse_unusable(&self) -> Result<(), Failure> {
        refuse_ending(&self.out)?;
        refuse_taken(&self.out, "--out", self.force)?;
        match &self.report {
            Some(report) if *report == self.out || is_same_file(report, &self.out) => {
                Err(Failure::input(
                    format!("{} is named by --out and by --report", self.out.display()),
                    "give them two names",
                ))
            }
            Some(report) => refuse_taken(report, "--report", self.force),
            None => Ok(()),
        }
    }
}

#[derive(clap::Args)]
struct OsmArgs {
    /// Raw JSON or XML of OpenStreetMap
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    written: Written,
    /// Only tracks around this place, degrees, with --radius-m
    #[arg(long, value_name = "LAT,LON", value_parser = place, requires = "radius_m", allow_hyphen_values = true)]
    around: Option<Geodetic>,
    /// How far around the place, metres
    #[arg(long, value_name = "R", requires = "around", value_parser = metres)]
    radius_m: Option<f64>,
    /// How far points of the map lie beside the tracks, metres (standard deviation)
    #[arg(long, value_name = "S", default_value_t = 0.3, value_parser = sigma)]
    sigma_m: f64,
}

#[derive(clap::Args)]
struct RailmlArgs {
    /// railML
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    written: Written,
    /// System of the coordinates, if the file names none: EPSG:4326, EPSG:25832 (UTM zone 32) and so on
    #[arg(long, value_name = "EPSG:N")]
    crs: Option<Crs>,
    /// How far coordinates lie beside the tracks, metres (standard deviation)
    #[arg(long, value_name = "S", default_value_t = 0.1, value_parser = sigma)]
    sigma_m: f64,
}

fn railml(args: &RailmlArgs) -> Result<(), Failure> {
    args.written.refuse_unusable()?;
    let text = read_map(&args.file)?;
    let map = read_railml_map(&args.file, &text, &RailMlOptions { crs: args.crs })?;
    let options = LayingOptions {
        name: name_of(&args.written.out),
        sigma_m: args.sigma_m,
        join: false,
    };
    lay(&args.file, &map, &options, &args.written, &[])
}

pub(super) fn import(args: &ImportArgs) -> Result<(), Failure> {
    match &args.format {
        ImportFormat::Csv(args) => csv(args),
        ImportFormat::Osm(args) => osm(args),
        ImportFormat::Railml(args) => railml(args),
    }
}

fn osm(args: &OsmArgs) -> Result<(), Failure> {
    args.written.refuse_unusable()?;
    let text = read_map(&args.file)?;
    let around = args.around.zip(args.radius_m);
    let around = around.map(|(place, radius_m)| AroundPlace { place, radius_m });
    let import = read_osm(&args.file, &text, around)?;
    let options = LayingOptions {
        name: name_of(&args.written.out),
        sigma_m: args.sigma_m,
        join: true,
    };
    let source = "Data: OpenStreetMap's contributors, Open Database License (ODbL) 1.0, https://www.openstreetmap.org/copyright";
    lay(&args.file, &import.map, &options, &args.written, &[source])
}

/// Lays a map and writes the file.
fn lay(
    path: &Path,
    map: &ImportedMap,
    options: &LayingOptions,
    to: &Written,
    source: &[&str],
) -> Result<(), Failure> {
    let laid = map.lay(options).map_err(|error| {
        Failure::input(
            format!("{} cannot be laid: {error}", path.display()),
            "see `metrotwin import --help` for what a map must have",
        )
    })?;
    let told = told::Told {
        path,
        map,
        laid: &laid,
    };
    let comment = told.comment(source);
    let text = laid.file.to_text(&comment).map_err(Failure::run)?;
    write_whole(&to.out, &text)?;
    if let Some(report) = &to.report {
        write_whole(report, &told.json().map_err(Failure::run)?)?;
    }
    for line in told.left_out() {
        eprintln!("{line}");
    }
    print(&told.table(&to.out))
}

/// Tunnel files are read by this ending alone.
fn refuse_ending(out: &Path) -> Result<(), Failure> {
    let is_toml = out
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    match is_toml {
        true => Ok(()),
        false => Err(Failure::input(
            format!("{} is no name of a tunnel file", out.display()),
            "let it end with .toml",
        )),
    }
}

fn name_of(out: &Path) -> String {
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    match stem.trim() {
        "" => "imported".to_owned(),
        name => name.to_owned(),
    }
}
