//! Systems in which maps state coordinates.
//!
//! Read: WGS 84 by latitude and longitude, and the zones of UTM on WGS 84 and on ETRS89.

use crate::track::geodesy::{Geodetic, UtmZone};
use nalgebra::Point2;
use std::fmt;
use std::str::FromStr;

/// Projections stretch without bound near the poles.
const MOST_LATITUDE_DEG: f64 = 85.0;
/// A zone of UTM is used this far to either side, metres.
const EASTINGS_M: [f64; 2] = [100_000.0, 900_000.0];
/// From the equator to the pole, and 10 000 km more in southern zones, metres.
const MOST_NORTHING_M: f64 = 10_000_000.0;

/// A system of coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crs {
    /// Latitude and longitude on WGS 84, degrees: EPSG:4326.
    Wgs84,
    /// Easting and northing in a zone of UTM, metres: EPSG:32601 to 32660 and 32701 to 32760 on WGS 84, EPSG:25801 to
    /// 25860 on ETRS89.
    Utm(UtmZone),
}

/// A system that is not read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the coordinate system \"{0}\" is not read: EPSG:4326 (WGS 84), EPSG:32601 to 32660, 32701 to 32760 (UTM on WGS 84) and EPSG:25801 to 25860 (UTM on ETRS89) are; convert the map's coordinates to one of these"
)]
pub struct UnknownCrs(String);

impl FromStr for Crs {
    type Err = UnknownCrs;

    /// By its EPSG code, alone or at the end of a name or address: `EPSG:25832`, `urn:ogc:def:crs:EPSG::25832`.
    fn from_str(text: &str) -> Result<Self, UnknownCrs> {
        let unknown = || UnknownCrs(text.chars().take(80).collect());
        let text = text.trim();
        let from = text.rfind(|c: char| !c.is_ascii_digit());
        let digits = from.map_or(text, |at| text.get(at + 1..).unwrap_or_default());
        let is_named = digits.len() == text.len() || text.to_ascii_uppercase().contains("EPSG");
        let code: u32 = digits.parse().map_err(|_| unknown())?;
        let zone = |base: u32, is_south| {
            let number = u8::try_from(code - base).ok();
            number.and_then(|number| UtmZone::new(number, is_south))
        };
        let zone = match code {
            4326 if is_named => return Ok(Self::Wgs84),
            32601..=32660 => zone(32600, false),
            32701..=32760 => zone(32700, true),
            25801..=25860 => zone(25800, false),
            _ => None,
        };
        zone.filter(|_| is_named).map(Self::Utm).ok_or_else(unknown)
    }
}

impl fmt::Display for Crs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Wgs84 => "WGS 84 (latitude, longitude)",
            Self::Utm(_) => "UTM (easting, northing)",
        })
    }
}

impl Crs {
    /// A place by the two coordinates in the system's own order: latitude and longitude, or easting and northing. The
    /// error says what is wrong and what would be right.
    pub fn geodetic(&self, coordinates: [f64; 2]) -> Result<Geodetic, String> {
        let [first, second] = coordinates;
        self.place(coordinates).ok_or_else(|| {
            let swapped = match self.place([second, first]) {
                Some(_) => "; the other way round they would be: are they swapped?",
                None => "; is the system another one?",
            };
            format!("({first}, {second}) is on no railway in {self}{swapped}")
        })
    }

    fn place(&self, [first, second]: [f64; 2]) -> Option<Geodetic> {
        match self {
            Self::Wgs84 => {
                let is_there = first.abs() <= MOST_LATITUDE_DEG && second.abs() <= 180.0;
                is_there.then_some(Geodetic {
                    latitude_deg: first,
                    longitude_deg: second,
                    height_m: 0.0,
                })
            }
            Self::Utm(zone) => {
                let is_there = (EASTINGS_M[0]..=EASTINGS_M[1]).contains(&first)
                    && (0.0..=MOST_NORTHING_M).contains(&second);
                let place = is_there.then(|| zone.geodetic(&Point2::new(first, second), 0.0))?;
                (place.latitude_deg.abs() <= MOST_LATITUDE_DEG).then_some(place)
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn systems_are_known_by_their_code() {
        let zone = |number, is_south| Crs::Utm(UtmZone::new(number, is_south).unwrap());
        for (text, crs) in [
            ("4326", Crs::Wgs84),
            (" EPSG:4326 ", Crs::Wgs84),
            ("urn:ogc:def:crs:EPSG::25832", zone(32, false)),
            (
                "http://www.opengis.net/def/crs/EPSG/0/32733",
                zone(33, true),
            ),
            ("epsg:32601", zone(1, false)),
        ] {
            assert_eq!(text.parse(), Ok(crs), "{text}");
        }
        for text in [
            "",
            "EPSG:",
            "31467",
            "EPSG:25861",
            "EPSG:32600",
            "EPSG:3857",
            "DB_REF 4326",
            "\u{e9}4326x",
            "EPSG:99999999999999999999",
        ] {
            let error = text.parse::<Crs>().unwrap_err().to_string();
            assert!(error.contains("EPSG:25801"), "{text}: {error}");
        }
    }

    #[test]
    fn coordinates_are_in_the_systems_order() {
        let oslo = Crs::Wgs84.geodetic([59.911, 10.754]).unwrap();
        let utm: Crs = "EPSG:32632".parse().unwrap();
        let Crs::Utm(zone) = utm else { unreachable!() };
        let plane = zone.plane(&oslo);
        let again = utm.geodetic([plane.x, plane.y]).unwrap();
        assert!((again.latitude_deg - oslo.latitude_deg).abs() < 1e-10);
        let swapped = utm.geodetic([plane.y, plane.x]).unwrap_err();
        assert!(swapped.contains("swapped"), "{swapped}");
        let swapped = Crs::Wgs84.geodetic([104.06, 30.66]).unwrap_err();
        assert!(swapped.contains("swapped"), "{swapped}");
        for wrong in [
            [0.0, 0.0],
            [f64::NAN, 1e6],
            [5e5, f64::INFINITY],
            [1e300, 1e300],
        ] {
            assert!(utm.geodetic(wrong).unwrap_err().contains("system"));
        }
    }
}
