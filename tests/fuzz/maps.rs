//! Maps of others, and fixes on them, with drawn mistakes.

use crate::fuzz::{Draw, cases, check_memory, execute, mutate, mutated_text};
use metrotwin::bus::SimTime;
use metrotwin::stack::occupancy::{Fix, Method, Occupancy, OccupancySettings};
use metrotwin::track::import::OsmImport;
use metrotwin::track::plan::PlanNetwork;
use nalgebra::{Matrix2, Point2};

/// Executions where nothing else is asked for.
const FEW: u64 = 4000;

const GEOJSON: &str = r#"{ "type": "FeatureCollection", "features": [
    { "type": "Feature", "properties": { "id": "a" }, "geometry": { "type": "LineString",
        "coordinates": [[4.48, 50.9], [4.481, 50.9], [4.482, 50.9002]] } },
    { "type": "Feature", "properties": { "id": "b" }, "geometry": { "type": "LineString",
        "coordinates": [[4.482, 50.9002], [4.484, 50.9004]] } },
    { "type": "Feature", "properties": { "id": "c" }, "geometry": { "type": "LineString",
        "coordinates": [[4.482, 50.9002], [4.484, 50.9007]] } },
    { "type": "Feature", "properties": { "id": "ab", "netelementA": "a", "netelementB": "b",
        "positionOnA": 1, "positionOnB": 0, "navigability": "both" } },
    { "type": "Feature", "properties": { "id": "ac", "netelementA": "a", "netelementB": "c",
        "positionOnA": 1, "positionOnB": 0, "navigability": "both" } }
] }"#;

const OSM: &str = r#"{ "elements": [
    { "type": "node", "id": 1, "lat": 50.9, "lon": 4.48 }, { "type": "node", "id": 2, "lat": 50.9, "lon": 4.482 },
    { "type": "node", "id": 3, "lat": 50.9, "lon": 4.484 }, { "type": "node", "id": 4, "lat": 50.9002, "lon": 4.484 },
    { "type": "node", "id": 5, "lat": 50.9006, "lon": 4.481, "tags": { "railway": "switch" } },
    { "type": "way", "id": 10, "nodes": [1, 2, 3], "tags": { "railway": "rail" } },
    { "type": "way", "id": 11, "nodes": [2, 4], "tags": { "railway": "rail" } },
    { "type": "way", "id": 12, "nodes": [5, 2], "tags": { "railway": "subway", "service": "siding" } }
] }"#;

/// A text with something changed, by structure or without regard to it.
fn changed(draw: &mut Draw, text: &str) -> String {
    let value = serde_json::from_str::<toml::Value>(text);
    match value.ok().filter(|_| !draw.one_in(3)) {
        Some(mut value) => {
            for _ in 0..=draw.below(3) {
                mutate(draw, &mut value);
            }
            serde_json::to_string(&value).unwrap()
        }
        None => String::from_utf8_lossy(&mutated_text(draw, text.as_bytes())).into_owned(),
    }
}

/// Runs the filter over a network with fixes that may be anything.
fn locate(draw: &mut Draw, network: PlanNetwork) {
    let methods = [Method::Fused, Method::Pedal, Method::Perpendicular];
    let settings = OccupancySettings {
        method: *draw.pick(&methods),
        ..OccupancySettings::default()
    };
    let odd = [0.0, -1.0, 1e-300, 1e300, f64::NAN, f64::INFINITY, 20.0];
    let mut number = |usual: f64| {
        if draw.one_in(8) {
            *draw.pick(&odd)
        } else {
            usual
        }
    };
    let mut occupancy = Occupancy::new(network.into(), settings);
    for k in 0..30 {
        let second = number(f64::from(k));
        let time = SimTime::from_secs(if second.abs() < 1e9 { second } else { 0.0 });
        occupancy.on_speed(time, number(12.0));
        occupancy.on_yaw_rate(time, number(0.01));
        occupancy.on_fix(&Fix {
            time,
            place: Point2::new(number(12.0 * f64::from(k)), number(1.0)),
            covariance_m2: Matrix2::new(number(1.0), number(0.2), number(0.2), number(1.0)),
        });
        let decision = occupancy.decision();
        let sum: f64 = decision.tracks.iter().map(|track| track.probability).sum();
        assert!(
            decision.tracks.is_empty() || (sum - 1.0).abs() < 1e-6,
            "{decision:?}"
        );
    }
}

/// A panic, an endless search, memory by a number that somebody wrote, an error that says nothing, or probabilities
/// that are none.
#[test]
fn no_map_breaks_a_reader() {
    let (mut accepted, mut refused) = (0, 0);
    for case in cases(FEW) {
        let draw = &mut Draw::of(case);
        let is_osm = draw.one_in(2);
        let text = changed(draw, if is_osm { OSM } else { GEOJSON });
        let answer = execute(case, "a map", || match is_osm {
            true => OsmImport::from_json(&text)
                .map(|import| import.network)
                .map_err(|e| e.to_string()),
            false => PlanNetwork::from_geojson(&text).map_err(|e| e.to_string()),
        });
        match answer {
            Ok(network) => {
                accepted += 1;
                execute(case, "fixes", || locate(draw, network));
            }
            Err(said) => {
                assert!(
                    said.len() > 20 && said.len() < 20_000,
                    "case {case}: {said}"
                );
                refused += 1;
            }
        }
        if case % 100 == 0 {
            check_memory();
        }
    }
    println!("{accepted} accepted, {refused} refused");
    assert!(accepted > 0 && refused > 0);
}
