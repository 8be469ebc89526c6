//! The tracks and the trains on a map of the earth, for tunnels with a datum; with track occupancy also the last fix,
//! its error ellipse and pedal curve, and every track that a train may be on.

use super::observer_error::Result;
use super::palette;
use super::stream::RowStream;
use crate::bus::{GnssFix, OccupancyReport, SimTime, TrainId};
use crate::track::geodesy::Datum;
use crate::track::{Track, TrackId, Tunnel};
use crate::twin::physics::TrainState;
use nalgebra::{Point3, Vector2};
use re_sdk_types::archetypes::{GeoLineStrings, GeoPoints};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Where everything on the map is in the recording. Radii below zero are pixels, so that lines and dots are seen from
/// any height.
pub(super) const ROOT: &str = "map";
/// From point to point of a track.
const STEP_M: f64 = 10.0;
/// From one place of a train to the next.
const EVERY_S: f64 = 0.5;
/// Ellipse and pedal curve are drawn at so many standard deviations.
const SIGMAS: f64 = 3.0;
/// Points of a closed curve.
const POINTS: u32 = 48;
/// Tracks that are less probable are not shown.
const LEAST_SHOWN: f64 = 1e-6;

/// The map of a recording.
pub(super) struct Map {
    stream: RowStream,
    datum: Datum,
    tracks: Vec<Arc<Track>>,
    /// When each train is shown next.
    due: BTreeMap<TrainId, SimTime>,
}

impl Map {
    /// Draws the tracks; none without a datum.
    pub(super) fn open(stream: &RowStream, tunnel: &Tunnel) -> Result<Option<Self>> {
        let Some(datum) = tunnel.datum else {
            return Ok(None);
        };
        let tracks = tunnel.network.tracks.clone();
        let lines = tracks.iter().map(|track| line(track, &datum));
        let lines = GeoLineStrings::from_lat_lon(lines.collect::<Vec<_>>())
            .with_radii([-1.5])
            .with_colors([palette::RAIL]);
        stream.log_static(&format!("{ROOT}/tracks"), &lines)?;
        Ok(Some(Self {
            stream: stream.clone(),
            datum,
            tracks,
            due: BTreeMap::new(),
        }))
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

    /// Shows a fix with its error ellipse and the pedal curve of that: the standard deviation in every direction.
    pub(super) fn fix(&self, train: TrainId, fix: &GnssFix) -> Result {
        self.stream.at(fix.time);
        let Some(root) = fix.covariance_m2.cholesky() else {
            return Ok(());
        };
        let around = |of: &dyn Fn(Vector2<f64>) -> Vector2<f64>| {
            let points = (0..=POINTS).map(|k| {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(POINTS)).sin_cos();
                self.beside(fix, &(SIGMAS * of(Vector2::new(cos, sin))))
            });
            points.collect::<Vec<_>>()
        };
        let ellipse = around(&|u| root.l() * u);
        let pedal = around(&|u| u * u.dot(&(fix.covariance_m2 * u)).sqrt());
        let curves = GeoLineStrings::from_lat_lon([ellipse, pedal])
            .with_radii([-1.5])
            .with_colors([palette::GNSS, palette::TRUTH]);
        let path = format!("{ROOT}/train_{}/fix", train.0);
        self.stream.log(&format!("{path}/curves"), &curves)?;
        let place = (fix.place.latitude_deg, fix.place.longitude_deg);
        let place = GeoPoints::from_lat_lon([place])
            .with_radii([-3.0])
            .with_colors([palette::GNSS]);
        self.stream.log(&path, &place)
    }

    /// Shows where a train may be, the larger and greener the more probable.
    pub(super) fn occupancy(&self, train: TrainId, report: &OccupancyReport) -> Result {
        self.stream.at(report.time);
        let shown = report.tracks.iter();
        let shown = shown.filter(|track| track.probability > LEAST_SHOWN);
        let places = shown.filter_map(|track| {
            let at = self.on_track(track.track, track.s_m)?;
            Some((at, track.probability))
        });
        let (places, probabilities): (Vec<_>, Vec<f64>) = places.unzip();
        let radii = probabilities.iter().map(|p| -(3.0 + 5.0 * *p) as f32);
        let colours = probabilities.iter().map(|p| palette::probability(*p));
        let points = GeoPoints::from_lat_lon(places)
            .with_radii(radii)
            .with_colors(colours);
        let path = format!("{ROOT}/train_{}/may_be_on", train.0);
        self.stream.log(&path, &points)
    }

    fn on_track(&self, track: TrackId, s_m: f64) -> Option<(f64, f64)> {
        let track = self.tracks.get(usize::from(track.0))?;
        Some(place(&self.datum, &track.alignment.at(s_m).origin))
    }

    /// So far to the east and north of a fix.
    fn beside(&self, fix: &GnssFix, off_m: &Vector2<f64>) -> (f64, f64) {
        let flat = Datum {
            heading_deg: 0.0,
            ..self.datum
        };
        let at = flat.world(&fix.place) + off_m.push(0.0);
        place(&flat, &at)
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
