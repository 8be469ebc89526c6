//! `metrotwin locate`: the positioning stack on recorded data.

mod output;
mod recorded;
mod speed_of_fixes;

use super::check::{read, read_as};
use super::fault::Failure;
use super::file_kind::FileKind;
use super::print;
use crate::bus::SimTime;
use crate::settings::ReadLimit;
use crate::stack::occupancy::{Occupancy, OccupancySettings};
use crate::track::Tunnel;
use crate::track::geodesy::Datum;
use crate::track::import::OsmImport;
use crate::track::plan::PlanNetwork;
use output::{Located, Report};
use recorded::{RecordedFix, RecordedFixes};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Fixes that are all farther from the network are of somewhere else.
const FAR_M: f64 = 5000.0;

const AFTER: &str = "\
NETWORK is a tunnel file with a [datum], GeoJSON of track elements (LineString with `id`) and relations
(netelementA, netelementB, positionOnA, positionOnB, navigability), or raw JSON of OpenStreetMap with its nodes.
FIXES is a table with the columns timestamp (seconds, or ISO 8601), latitude, longitude, and, if there are any,
sigma_north_m, sigma_east_m, covariance_m2, position_type, solution_status. Without sigmas these come by the kind
of solution. SPEEDS has timestamp and speed_mps, forwards positive. Without it, speed comes from the fixes.

Written to DIR: tracks.csv (a row a fix: most probable element, its probability, place, way), tracks.geojson (the
same for a map), summary.json.

Examples:
  metrotwin locate --network network.geojson --gnss run.csv --out out/run
  metrotwin locate --network tunnels/terminus.toml --gnss run.csv --speed wheel.csv --out out/run";

/// Say on which track a train was, from recorded fixes of a satellite receiver
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct LocateArgs {
    /// Map: a tunnel file or GeoJSON
    #[arg(long, value_name = "NETWORK")]
    network: PathBuf,
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
    let (network, datum) = network(&args.network)?;
    let network = Arc::new(network);
    let text = read_as(&args.gnss, ReadLimit::RECORDED)?;
    let recorded = RecordedFixes::read(&text, &datum).map_err(|e| table(&args.gnss, &e))?;
    refuse_elsewhere(&network, &recorded, args)?;
    let mut settings = OccupancySettings::default();
    let speeds = match &args.speed {
        Some(path) => recorded::read_speeds(&read_as(path, ReadLimit::RECORDED)?, recorded.start_s)
            .map_err(|e| table(path, &e))?,
        None => {
            settings.speed_sigma_mps = speed_of_fixes::SIGMA_MPS;
            speed_of_fixes::speeds(&recorded.fixes)
        }
    };
    let located = run(&network, settings, &recorded, &speeds);
    let report = Report {
        network: &network,
        datum: &datum,
        recorded: &recorded,
        located: &located,
        measured_speed: args.speed.is_some(),
    };
    report.write(&args.out).map_err(Failure::run)?;
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

fn network(path: &Path) -> Result<(PlanNetwork, Datum), Failure> {
    let is_json = path
        .extension()
        .is_some_and(|ending| ending.to_string_lossy().ends_with("json"));
    let text = match is_json {
        true => read_as(path, ReadLimit::GEOJSON)?,
        false => read(path)?,
    };
    let no_datum = || {
        Failure::input(
            format!("{} does not say where on the earth it is", path.display()),
            "add a table [datum] with latitude_deg and longitude_deg of the world's origin",
        )
    };
    let refused = |error: &dyn std::fmt::Display| {
        Failure::input(
            format!("{} cannot be used: {error}", path.display()),
            "see `metrotwin locate --help` for what a network in JSON holds",
        )
    };
    let network = match is_json {
        true if is_osm(&text) => {
            OsmImport::from_json(&text)
                .map_err(|e| refused(&e))?
                .network
        }
        true => PlanNetwork::from_geojson(&text).map_err(|e| refused(&e))?,
        false if matches!(FileKind::of(&text), FileKind::Tunnel) => {
            let tunnel = Tunnel::from_toml(&text).map_err(|e| Failure::file(path, &text, e))?;
            PlanNetwork::of_network(&tunnel.network, tunnel.datum)
        }
        false => {
            return Err(Failure::input(
                format!("{} is neither a tunnel file nor GeoJSON", path.display()),
                "see `metrotwin locate --help`",
            ));
        }
    };
    let datum = network.datum.ok_or_else(no_datum)?;
    Ok((network, datum))
}

/// Whether a JSON text is raw data of OpenStreetMap rather than GeoJSON.
fn is_osm(text: &str) -> bool {
    let key = |key: &str| text.find(key).unwrap_or(usize::MAX);
    key("\"elements\"") < key("\"features\"")
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

fn table(path: &Path, error: &recorded::TableError) -> Failure {
    Failure::input(
        format!("{} cannot be used: {error}", path.display()),
        "see `metrotwin locate --help` for the columns",
    )
}
