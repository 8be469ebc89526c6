//! The tracks and the trains on a map of the earth, for tunnels with a datum.

use super::palette;
use super::stream::RowStream;
use super::whole_files::Result;
use crate::bus::{SimTime, TrainId};
use crate::track::geodesy::Datum;
use crate::track::{Track, Tunnel};
use crate::twin::physics::TrainState;
use nalgebra::Point3;
use re_sdk_types::archetypes::{GeoLineStrings, GeoPoints};
use std::collections::BTreeMap;

/// Where everything on the map is in the recording. Radii below zero are pixels, so that lines and dots are seen from
/// any height.
pub(super) const ROOT: &str = "map";
/// From point to point of a track.
const STEP_M: f64 = 10.0;
/// From one place of a train to the next.
const EVERY_S: f64 = 0.5;

/// The map of a recording.
pub(super) struct Map {
    stream: RowStream,
    datum: Datum,
    /// When each train is shown next.
    due: BTreeMap<TrainId, SimTime>,
}

impl Map {
    /// Draws the tracks; none without a datum.
    pub(super) fn open(stream: &RowStream, tunnel: &Tunnel) -> Result<Option<Self>> {
        let Some(datum) = tunnel.datum else {
            return Ok(None);
        };
        let tracks = tunnel.network.tracks.iter();
        let lines = tracks.map(|track| line(track, &datum));
        let lines = GeoLineStrings::from_lat_lon(lines.collect::<Vec<_>>())
            .with_radii([-1.5])
            .with_colors([palette::RAIL]);
        stream.log_static(&format!("{ROOT}/tracks"), &lines)?;
        let (stream, due) = (stream.clone(), BTreeMap::new());
        Ok(Some(Self { stream, datum, due }))
    }

    /// Shows a train, if it is due.
    pub(super) fn train(&mut self, train: TrainId, truth: &TrainState) -> Result {
        let due = self.due.entry(train).or_insert(truth.time);
        if truth.time < *due {
            return Ok(());
        }
        *due = truth.time.plus(EVERY_S);
        self.stream.at(truth.time);
        let head = truth.world_from_vehicle.translation.vector.into();
        let head = GeoPoints::from_lat_lon([place(&self.datum, &head)])
            .with_radii([-6.0])
            .with_colors([palette::TRAIN]);
        self.stream.log(&format!("{ROOT}/train_{}", train.0), &head)
    }
}

/// Latitude and longitude of points along a track.
fn line(track: &Track, datum: &Datum) -> Vec<(f64, f64)> {
    let length_m = track.alignment.length_m();
    let steps = (length_m / STEP_M).ceil().max(1.0);
    let at = |k: u32| track.alignment.at(length_m * f64::from(k) / steps).origin;
    (0..=steps as u32).map(|k| place(datum, &at(k))).collect()
}

fn place(datum: &Datum, world: &Point3<f64>) -> (f64, f64) {
    let place = datum.geodetic(world);
    (place.latitude_deg, place.longitude_deg)
}
