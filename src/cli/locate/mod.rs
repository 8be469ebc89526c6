//! `metrotwin locate`: the positioning stack on recorded data.

mod output;
mod recorded;
mod speed_of_fixes;

use super::check::read_as;
use super::fault::Failure;
use super::folder::{prepare, unusable};
use super::map::read_network;
use super::print;
use crate::bus::SimTime;
use crate::files::Listing;
use crate::settings::ReadLimit;
use crate::stack::occupancy::{Occupancy, OccupancySettings};
use crate::track::import::{Crs, SheetError};
use crate::track::plan::PlanNetwork;
use output::{Located, Report};
use recorded::{RecordedFix, RecordedFixes, RecordedSpeeds};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Fixes that are all farther from the network are of somewhere else.
const FAR_M: f64 = 5000.0;

/// Whose files are listed.
const COMMAND: &str = "metrotwin locate";

const AFTER: &str = "\
NETWORK is a tunnel file with a [datum], GeoJSON of track elements (LineString with `id`) and relations
(netelementA, netelementB, positionOnA, positionOnB, navigability), OpenStreetMap (raw JSON with its nodes, or XML), or
railML with coordinates.
FIXES is a table with the columns timestamp (seconds, or ISO 8601), latitude, longitude, and, if there are any,
sigma_north_m, sigma_east_m, covariance_m2, position_type, solution_status. Without sigmas these come by the kind
of solution. SPEEDS has timestamp and speed_mps, forwards positive. Without it, speed comes from the fixes.
Columns may stand in any order, with `,`, `;` or tabs between them as between the headers; with `;` or tabs numbers may
have a decimal comma.

Written to DIR: tracks.csv (a row a fix: most probable element, its probability, place, way), tracks.geojson (the
same for a map), summary.json, and files.txt, the list of these files. The next run into the folder replaces them; files
that the list does not name are never removed or written over.

Examples:
  metrotwin locate --network network.geojson --gnss run.csv --out out/run
  metrotwin locate --network tunnels/terminus.toml --gnss run.csv --speed wheel.csv --out out/run";

/// Say on which track a train was, from recorded fixes of a satellite receiver
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct LocateArgs {
    /// Map: a tunnel file, GeoJSON, OpenStreetMap or railML
    #[arg(long, value_name = "NETWORK")]
    network: PathBuf,
    /// System of a railML file's coordinates, if the file names none: EPSG:4326, EPSG:25832 (UTM zone 32) and so on
    #[arg(long, value_name = "EPSG:N")]
    crs: Option<Crs>,
    /// Recorded fixes
    #[arg(long, value_name = "FIXES")]
    gnss: PathBuf,
    /// Recorded speeds
    #[arg(long, value_name = "SPEEDS")]
    speed: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR", default_value = "out/locate")]
    out: PathBuf,
}

pub(super) fn locate(args: &LocateArgs) -> Result<(), Failure> {
    let (network, datum) = read_network(&args.network, args.crs)?;
    let network = Arc::new(network);
    let text = read_as(&args.gnss, ReadLimit::RECORDED)?;
    let recorded = RecordedFixes::read(&text, &datum).map_err(|e| table(&args.gnss, &e))?;
    refuse_elsewhere(&network, &recorded, args)?;
    let mut settings = OccupancySettings::default();
    let speeds = match &args.speed {
        Some(path) => RecordedSpeeds::read(&read_as(path, ReadLimit::RECORDED)?, recorded.start_s)
            .map_err(|e| table(path, &e))?,
        None => {
            settings.speed_sigma_mps = speed_of_fixes::SIGMA_MPS;
            RecordedSpeeds {
                speeds: speed_of_fixes::speeds(&recorded.fixes),
                has_decimal_commas: false,
            }
        }
    };
    prepare(&args.out)?;
    // Open until the end: no other command writes into the folder meanwhile.
    let names = output::FILES.map(str::to_owned).to_vec();
    let listing = Listing::claim(&args.out, COMMAND, names).map_err(|e| unusable(&args.out, &e))?;
    let located = run(&network, settings, &recorded, &speeds.speeds);
    let report = Report {
        network: &network,
        datum: &datum,
        recorded: &recorded,
        located: &located,
        speeds_in_time: args
            .speed
            .as_ref()
            .map(|_| in_time(&speeds.speeds, &recorded)),
        decimal_commas: decimal_commas(args, &recorded, &speeds),
    };
    let written = report.write(&args.out).and_then(|()| listing.close());
    written.map_err(|e| Failure::run(anyhow::Error::new(e).context("cannot write the results")))?;
    print(&report.text(&args.out))
}

/// Every fix in turn, with the speeds before it.
#[allow(clippy::disallowed_methods, reason = "what a fix costs")]
fn run(
    network: &Arc<PlanNetwork>,
    settings: OccupancySettings,
    recorded: &RecordedFixes,
    speeds: &[(SimTime, f64)],
) -> Vec<Located> {
    let mut occupancy = Occupancy::new(Arc::clone(network), settings);
    let mut speeds = speeds.iter().peekable();
    let mut located = Vec::with_capacity(recorded.fixes.len());
    for RecordedFix { fix, .. } in &recorded.fixes {
        let begun = Instant::now();
        while let Some((time, speed_mps)) = speeds.next_if(|(time, _)| *time <= fix.time) {
            occupancy.on_speed(*time, *speed_mps);
        }
        occupancy.on_fix(fix);
        located.push(Located {
            decision: occupancy.decision(),
            alive: occupancy.alive(),
            cost_us: begun.elapsed().as_secs_f64() * 1e6,
        });
    }
    located
}

/// The tables in which numbers have a decimal comma.
fn decimal_commas<'a>(
    args: &'a LocateArgs,
    fixes: &RecordedFixes,
    speeds: &RecordedSpeeds,
) -> Vec<&'a Path> {
    let of_fixes = fixes.has_decimal_commas.then_some(args.gnss.as_path());
    let of_speeds = args.speed.as_deref().filter(|_| speeds.has_decimal_commas);
    of_fixes.into_iter().chain(of_speeds).collect()
}

/// Speeds between the first fix and the last.
fn in_time(speeds: &[(SimTime, f64)], recorded: &RecordedFixes) -> usize {
    let last = recorded.fixes.last().map_or(SimTime::ZERO, |r| r.fix.time);
    let times = speeds.iter().map(|(time, _)| *time);
    times
        .filter(|time| (SimTime::ZERO..=last).contains(time))
        .count()
}

/// Fixes that are nowhere near the network: most often latitude and longitude are swapped.
fn refuse_elsewhere(
    network: &PlanNetwork,
    recorded: &RecordedFixes,
    args: &LocateArgs,
) -> Result<(), Failure> {
    let near = recorded
        .fixes
        .iter()
        .any(|r| !network.near(&r.fix.place, FAR_M).is_empty());
    if near {
        return Ok(());
    }
    Err(Failure::input(
        format!(
            "no fix of {} is within {} km of {}",
            args.gnss.display(),
            FAR_M / 1000.0,
            args.network.display()
        ),
        "are latitude and longitude swapped in one of them, or is one of another place?",
    ))
}

fn table(path: &Path, error: &SheetError) -> Failure {
    Failure::input(
        format!("{} cannot be used: {error}", path.display()),
        "see `metrotwin locate --help` for the columns",
    )
}
