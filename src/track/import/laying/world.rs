//! The origin of the world in the middle of a map.

use super::joining::Joined;
use super::plans::rounded;
use crate::track::geodesy::Datum;
use crate::track::import::ImportedMap;
use nalgebra::{Point2, Point3};

/// The world with its origin in the middle of the map's tracks.
pub(super) fn centred(map: &ImportedMap, datum: &Datum) -> Datum {
    let all = map
        .network
        .elements
        .iter()
        .flat_map(|element| element.points().map(|(p, _)| *p));
    let (low, high) = all.fold(
        (
            Point2::new(f64::MAX, f64::MAX),
            Point2::new(f64::MIN, f64::MIN),
        ),
        |(low, high), p| (low.inf(&p), high.sup(&p)),
    );
    let middle = nalgebra::center(&low, &high);
    let mut place = datum.geodetic(&Point3::new(middle.x, middle.y, 0.0));
    // As it is written.
    place.latitude_deg = rounded(place.latitude_deg, 6);
    place.longitude_deg = rounded(place.longitude_deg, 6);
    Datum { place, ..*datum }
}

/// Moves all points from one world into another.
pub(super) fn move_to(joined: &mut Joined, from: &Datum, to: &Datum) {
    let moved = |p: &Point2<f64>| to.world(&from.geodetic(&Point3::new(p.x, p.y, 0.0))).xy();
    let tracks = joined.tracks.iter_mut();
    for point in tracks.flat_map(|track| &mut track.points) {
        *point = moved(point);
    }
    for (_, at) in &mut joined.crossings {
        *at = moved(at);
    }
}
