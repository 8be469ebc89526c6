//! `metrotwin export`: what other programs read.

use super::check::read;
use super::fault::Failure;
use super::file_kind::FileKind;
use super::print;
use super::result_file::{refuse_taken, write_whole};
use crate::track::geodesy::Datum;
use crate::track::network::{Crossing, Network, TrackEnd};
use crate::track::{Alignment, Direction, Track, TrackPoint, Tunnel};
use nalgebra::Point3;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Points of a line are no farther apart, and so close that a chord is so far off a curve at most.
const STEP_M: f64 = 5.0;
const CHORD_ERROR_M: f64 = 0.04;

const AFTER: &str = "\
Tracks are line strings with their name as `id`; each joint, and each leg of a switch, is a relation between two of
them (netelementA, netelementB, positionOnA, positionOnB, navigability), as `metrotwin locate --network` reads them.

Examples:
  metrotwin export geojson tunnels/chengdu_line1.toml > chengdu_line1.geojson
  metrotwin export geojson tunnels/terminus.toml --out out/terminus.geojson";

/// Write a tunnel in a format of others
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct ExportArgs {
    #[command(subcommand)]
    format: ExportFormat,
}

#[derive(clap::Subcommand)]
enum ExportFormat {
    /// GeoJSON (RFC 7946): tracks, switches, crossings, lamps, devices, balises, base stations and stations, for maps
    Geojson {
        /// Tunnel file with a [datum]
        #[arg(value_name = "TUNNEL")]
        tunnel: PathBuf,
        /// Write to this file instead of standard output
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Write over a file that is there
        #[arg(long, requires = "out")]
        force: bool,
    },
}

pub(super) fn export(args: &ExportArgs) -> Result<(), Failure> {
    let ExportFormat::Geojson {
        tunnel: path,
        out,
        force,
    } = &args.format;
    if let Some(out) = out {
        refuse_taken(out, "--out", *force)?;
    }
    let text = read(path)?;
    FileKind::refuse_other_than_tunnel(path, &text)?;
    let tunnel = Tunnel::from_toml(&text).map_err(|e| Failure::file(path, &text, e))?;
    let datum = tunnel.datum.ok_or_else(|| {
        Failure::input(
            format!("{} does not say where on the earth it is", path.display()),
            "add a table [datum] with latitude_deg and longitude_deg of the world's origin",
        )
    })?;
    let collection = json!({
        "type": "FeatureCollection",
        "features": features(&tunnel, &datum),
    });
    let text = serde_json::to_string(&collection).map_err(Failure::run)?;
    match out {
        Some(out) => write_whole(out, &text),
        None => print(&text),
    }
}

/// What stands on the map: of every track its centreline first; then the switches and crossings.
fn features(tunnel: &Tunnel, datum: &Datum) -> Vec<Value> {
    let network = &tunnel.network;
    let tracks = network.tracks.iter();
    let of_tracks = tracks.flat_map(|track| of_track(track, datum));
    let switches = network.switches.iter().filter_map(|switch| {
        let toe = network.leaving(switch.toe)?;
        let track = network.track(switch.toe.track)?;
        let mut properties = json!({ "kind": "switch", "name": switch.name });
        add_stated(&mut properties, track, [("stated_chainage", toe.s_m)]);
        Some(feature("Point", position(datum, &toe.origin), properties))
    });
    let crossings = network.crossings.iter();
    let crossings = crossings.filter_map(|crossing| of_crossing(network, crossing, datum));
    let relations = relations(network).into_iter();
    let relations = relations.filter_map(|ends| of_relation(network, ends, datum));
    of_tracks
        .chain(switches)
        .chain(crossings)
        .chain(relations)
        .collect()
}

/// Ends of tracks between which trains run, each two once.
fn relations(network: &Network) -> Vec<[TrackEnd; 2]> {
    let pairs = network
        .ends()
        .flat_map(|end| network.next(end).map(move |next| [end, next]));
    let mut pairs: Vec<[TrackEnd; 2]> = pairs.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

fn of_relation(network: &Network, ends: [TrackEnd; 2], datum: &Datum) -> Option<Value> {
    let at = network.leaving(ends[0])?;
    let [a, b] = ends.map(|end| network.track(end.track).map(|track| &*track.name));
    let [on_a, on_b] = ends.map(|end| u8::from(end.way == Direction::Up));
    let properties = json!({
        "kind": "relation",
        "id": format!("{} {on_a} - {} {on_b}", a?, b?),
        "netelementA": a,
        "netelementB": b,
        "positionOnA": on_a,
        "positionOnB": on_b,
        "navigability": "both",
    });
    Some(feature("Point", position(datum, &at.origin), properties))
}

/// From point to point of a line.
fn step_m(line: &Alignment) -> f64 {
    let places = (0..=line.length_m() as u32).map(f64::from);
    let bends = places.map(|s_m| line.at(s_m).curvature_per_m.abs());
    let tightest_per_m = bends.fold(0.0, f64::max);
    STEP_M.min((8.0 * CHORD_ERROR_M / tightest_per_m.max(1e-12)).sqrt())
}

fn of_crossing(network: &Network, crossing: &Crossing, datum: &Datum) -> Option<Value> {
    let places = crossing.places;
    let at = network.alignment(places[0].track)?.at(places[0].s_m);
    let names = places.map(|place| network.track(place.track).map(|track| &*track.name));
    let mut properties = json!({
        "kind": "crossing",
        "name": crossing.name,
        "tracks": names,
        "chainages_m": places.map(|place| place.s_m),
        "angle_deg": crossing.angle_rad.to_degrees(),
    });
    let stated = places.map(|place| {
        let stated = network.track(place.track)?.stated_chainage.as_ref()?;
        Some(stated.text(place.s_m, 3))
    });
    if stated.iter().any(Option::is_some) {
        properties["stated_chainages"] = json!(stated);
    }
    Some(feature("Point", position(datum, &at.origin), properties))
}

fn feature(shape: &str, coordinates: Value, properties: Value) -> Value {
    json!({
        "type": "Feature",
        "geometry": { "type": shape, "coordinates": coordinates },
        "properties": properties,
    })
}

/// Chainages as the track states them, if it does, to the millimetre.
fn add_stated<const N: usize>(properties: &mut Value, track: &Track, places: [(&str, f64); N]) {
    if let Some(stated) = &track.stated_chainage {
        for (key, s_m) in places {
            properties[key] = json!(stated.text(s_m, 3));
        }
    }
}

fn position(datum: &Datum, world: &Point3<f64>) -> Value {
    let place = datum.geodetic(world);
    json!([place.longitude_deg, place.latitude_deg, place.height_m])
}

fn of_track(track: &Track, datum: &Datum) -> Vec<Value> {
    let line = &track.alignment;
    let steps = (line.length_m() / step_m(line)).ceil().max(1.0);
    let chainages = (0..=steps as u32).map(|k| line.length_m() * f64::from(k) / steps);
    let course = chainages.map(|s_m| position(datum, &line.at(s_m).origin));
    let course: Vec<_> = course.collect();
    let mut properties = json!({ "kind": "track", "id": track.name, "name": track.name, "length_m": line.length_m() });
    let ends = [("stated_begin", 0.0), ("stated_end", line.length_m())];
    add_stated(&mut properties, track, ends);
    let course = feature("LineString", json!(course), properties);
    let point = |kind: &str, name: &str, [s_m, l_m, h_m]: [f64; 3]| {
        let world = line.world_from_track(TrackPoint { s_m, l_m, h_m });
        let mut properties =
            json!({ "kind": kind, "name": name, "track": track.name, "chainage_m": s_m });
        add_stated(&mut properties, track, [("stated_chainage", s_m)]);
        feature("Point", position(datum, &world), properties)
    };
    let lamps = track.lamps.iter().map(|lamp| {
        let at = [lamp.chainage_m, lamp.lateral_m, lamp.height_m];
        point("lamp", &lamp.uid.to_string(), at)
    });
    let wayside = (track.wayside.iter()).map(|site| {
        let at = [site.chainage_m, site.lateral_m, site.height_m];
        point("wayside", &site.name, at)
    });
    let on_line = |kind, name, s_m| point(kind, name, [s_m, 0.0, 0.0]);
    let balises = (track.balises.iter()).map(|b| on_line("balise", &b.name, b.chainage_m));
    let bases = track.base_stations.iter();
    let bases = bases.map(|b| on_line("base_station", &b.name, b.chainage_m));
    let stations = (track.stations.iter()).map(|s| on_line("station", &s.name, s.chainage_m));
    let points = lamps
        .chain(wayside)
        .chain(balises)
        .chain(bases)
        .chain(stations);
    std::iter::once(course).chain(points).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::plan::{ElementEnd, PlanNetwork};

    /// Provokes: latitude and longitude in the wrong order, things left out, a line whose length on the earth
    /// is not that of the tunnel.
    #[test]
    fn a_tunnel_lies_where_its_datum_says() {
        let text = include_str!("../../tunnels/chengdu_line1.toml");
        let tunnel = Tunnel::from_toml(text).unwrap();
        let datum = tunnel.datum.unwrap();
        let features = features(&tunnel, &datum);
        let of = |kind: &str| {
            let of_kind = features.iter().filter(|f| f["properties"]["kind"] == kind);
            of_kind.count()
        };
        assert_eq!(of("track"), 1);
        let track = tunnel.first_track();
        assert_eq!(of("lamp"), track.lamps.len());
        assert_eq!(of("balise"), track.balises.len());
        assert_eq!(
            of("wayside") + of("station"),
            track.wayside.len() + track.stations.len()
        );
        let line = features[0]["geometry"]["coordinates"].as_array().unwrap();
        let degrees: Vec<[f64; 2]> = line
            .iter()
            .map(|p| [0, 1].map(|k| p[k].as_f64().unwrap()))
            .collect();
        // On a sphere with the earth's mean curvature at this latitude, to a part in a thousand.
        let radius_m = 6_367_000.0;
        let length_m: f64 = degrees
            .windows(2)
            .map(|pair| {
                let [east, north] = [0, 1].map(|k| (pair[1][k] - pair[0][k]).to_radians());
                radius_m * (east * pair[0][1].to_radians().cos()).hypot(north)
            })
            .sum();
        assert!((length_m / 3000.0 - 1.0).abs() < 3e-3, "{length_m}");
        assert!((degrees[0][0] - 104.066).abs() < 1e-6 && (degrees[0][1] - 30.657).abs() < 1e-6);
    }

    /// Provokes: tracks or joints that are lost, joined at the wrong end, or elsewhere on the earth.
    #[test]
    fn a_network_is_the_same_when_read_again() {
        for text in [
            include_str!("../../tunnels/terminus.toml"),
            include_str!("../../tests/tunnels/scissors.toml"),
        ] {
            let tunnel = Tunnel::from_toml(text).unwrap();
            let datum = tunnel.datum.unwrap();
            let features = features(&tunnel, &datum);
            let collection = json!({ "type": "FeatureCollection", "features": features });
            let again = PlanNetwork::from_geojson(&collection.to_string()).unwrap();
            let plan = PlanNetwork::of_network(&tunnel.network, tunnel.datum);
            assert_eq!(again.elements.len(), plan.elements.len());
            for (k, (a, b)) in plan.elements.iter().zip(&again.elements).enumerate() {
                assert_eq!(a.id, b.id);
                assert!((a.length_m() - b.length_m()).abs() < 0.1);
                for way in [Direction::Down, Direction::Up] {
                    let end = ElementEnd { element: k, way };
                    let sorted = |network: &PlanNetwork| {
                        let mut onward = network.onward(end).to_vec();
                        onward.sort_unstable();
                        onward
                    };
                    assert_eq!(sorted(&plan), sorted(&again), "{}", a.id);
                }
                for share in [0.0, 0.3, 0.5, 1.0] {
                    let [p, q] = [a, b].map(|e| e.at(share * e.length_m()).0);
                    let place = again.datum.unwrap().geodetic(&Point3::new(q.x, q.y, 0.0));
                    let q = datum.world(&place).xy();
                    assert!((p - q).norm() < 0.1, "{}: {}", a.id, (p - q).norm());
                }
            }
        }
    }

    /// Provokes: a chainage of another track, or one that no plan states, for instance on either side of a jump.
    #[test]
    fn places_have_the_chainages_that_plans_state() {
        let text = include_str!("../../tunnels/terminus.toml");
        let tunnel = Tunnel::from_toml(text).unwrap();
        let features = features(&tunnel, &tunnel.datum.unwrap());
        let stated = |name: &str, key: &str| {
            let of_name = |f: &&Value| f["properties"]["name"] == name;
            let feature = features.iter().find(of_name).unwrap();
            feature["properties"][key].as_str().map(str::to_owned)
        };
        let is = |name, key, text: Option<&str>| assert_eq!(stated(name, key).as_deref(), text);
        is("d1", "stated_begin", Some("ZDK12+000.000"));
        is("d1", "stated_end", Some("ZDK12+527.155"));
        is("2-468", "stated_chainage", Some("ZDK12+390.000"));
        is("V-hall", "stated_chainage", Some("YDK12+452.000"));
        is("W1", "stated_chainage", Some("YDK12+460.000"));
        // Of a track that states none.
        is("W3", "stated_chainage", None);
        is("B-u2", "stated_chainage", None);
    }

    /// Provokes: a crossing that is not on the map, or beside one of its tracks.
    #[test]
    fn crossings_lie_on_both_tracks() {
        let text = include_str!("../../tests/tunnels/scissors.toml");
        let tunnel = Tunnel::from_toml(text).unwrap();
        let datum = tunnel.datum.unwrap();
        let features = features(&tunnel, &datum);
        let mut crossings = features
            .iter()
            .filter(|f| f["properties"]["kind"] == "crossing");
        let crossing = crossings.next().unwrap();
        assert!(crossings.next().is_none());
        let properties = &crossing["properties"];
        assert_eq!(properties["tracks"], json!(["A", "B"]));
        assert_eq!(properties["stated_chainages"], json!(["A1+033.694", null]));
        for k in [0, 1] {
            let name = properties["tracks"][k].as_str().unwrap();
            let s_m = properties["chainages_m"][k].as_f64().unwrap();
            let line = tunnel
                .network
                .alignment(tunnel.network.named(name).unwrap())
                .unwrap();
            let there = position(&datum, &line.at(s_m).origin);
            for axis in [0, 1] {
                let [a, b] = [&there, &crossing["geometry"]["coordinates"]]
                    .map(|p| p[axis].as_f64().unwrap());
                assert!((a - b).abs() < 1e-10, "{name}");
            }
        }
    }
}
