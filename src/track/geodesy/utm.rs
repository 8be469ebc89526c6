//! Universal transverse Mercator: the plane in zones six degrees wide in which maps state eastings and northings.
//!
//! Its scale on the meridian is 0.9996, eastings there are 500 km; southern zones count northings from 10 000 km south
//! of the equator (J. Snyder, Map projections: a working manual, 1987). ETRS89's ellipsoid (GRS 80) differs from that
//! of WGS 84 by 0.1 mm, its datum by the drift of the plate since 1989, under a metre: both are left out.

use super::{Geodetic, TransverseMercator, WGS_84};
use nalgebra::Point2;

/// Scale on the meridian.
const SCALE: f64 = 0.9996;
/// Easting of the meridian, metres.
const MERIDIAN_EASTING_M: f64 = 500_000.0;
/// Northing of the equator in southern zones, metres.
const SOUTHERN_EQUATOR_M: f64 = 10_000_000.0;

/// A zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UtmZone {
    /// From 1, which begins 180 degrees west.
    number: u8,
    is_south: bool,
}

impl UtmZone {
    /// By its number, 1 to 60, and hemisphere; none for other numbers.
    pub fn new(number: u8, is_south: bool) -> Option<Self> {
        (1..=60)
            .contains(&number)
            .then_some(Self { number, is_south })
    }

    fn projection(self) -> TransverseMercator {
        TransverseMercator {
            ellipsoid: WGS_84,
            longitude_deg: 6.0 * f64::from(self.number) - 183.0,
        }
    }

    fn equator_m(self) -> f64 {
        if self.is_south {
            SOUTHERN_EQUATOR_M
        } else {
            0.0
        }
    }

    /// Easting and northing of a place, metres.
    pub fn plane(self, place: &Geodetic) -> Point2<f64> {
        let plane = self.projection().plane(place) * SCALE;
        Point2::new(plane.x + MERIDIAN_EASTING_M, plane.y + self.equator_m())
    }

    /// Latitude and longitude of an easting and northing, metres.
    pub fn geodetic(self, plane: &Point2<f64>, height_m: f64) -> Geodetic {
        let from = Point2::new(plane.x - MERIDIAN_EASTING_M, plane.y - self.equator_m());
        self.projection().geodetic(&(from / SCALE), height_m)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::geodesy::Ellipsoid;

    fn place(latitude_deg: f64, longitude_deg: f64) -> Geodetic {
        Geodetic {
            latitude_deg,
            longitude_deg,
            height_m: 0.0,
        }
    }

    /// Snyder 1987, page 269: 40 30 N, 73 30 W on Clarke's ellipsoid of 1866, meridian 75 W, scale 0.9996.
    #[test]
    fn val_snyders_example() {
        let third_flattening = |e2: f64| {
            let root = (1.0 - e2).sqrt();
            (1.0 - root) / (1.0 + root)
        };
        let projection = TransverseMercator {
            ellipsoid: Ellipsoid {
                a_m: 6_378_206.4,
                n: third_flattening(0.006_768_66),
            },
            longitude_deg: -75.0,
        };
        let plane = projection.plane(&place(40.5, -73.5)) * SCALE;
        assert!((plane.x - 127_106.5).abs() < 0.1, "{plane}");
        assert!((plane.y - 4_484_124.4).abs() < 0.1, "{plane}");
    }

    /// What PROJ 9.5.1 gives for EPSG:32632, both ways, and for EPSG:32733 south of the equator.
    #[test]
    fn val_what_another_program_gives() {
        let zone = UtmZone::new(32, false).unwrap();
        let plane = zone.plane(&place(51.2, 7.5));
        assert!((plane - Point2::new(395_201.310_382, 5_673_135.240_772)).norm() < 1e-5);
        let found = zone.geodetic(&Point2::new(340_000.0, 5_710_000.0), 0.0);
        assert!((found.latitude_deg - 51.518_429_592_742).abs() < 1e-10);
        assert!((found.longitude_deg - 6.693_877_486_511).abs() < 1e-10);
        let south = UtmZone::new(33, true).unwrap();
        let plane = south.plane(&place(-33.92, 18.42));
        assert!((plane - Point2::new(816_196.711_796, 6_241_444.314_438)).norm() < 1e-5);
    }

    /// Fails where a hemisphere or a zone's meridian is wrong.
    #[test]
    fn there_and_back_in_every_zone() {
        assert!(UtmZone::new(0, false).is_none() && UtmZone::new(61, true).is_none());
        for number in 1..=60 {
            for latitude_deg in [-79.0, -33.0, 0.5, 48.0, 83.0] {
                let zone = UtmZone::new(number, latitude_deg < 0.0).unwrap();
                let meridian_deg = f64::from(number) * 6.0 - 183.0;
                let at = place(latitude_deg, meridian_deg);
                let plane = zone.plane(&at);
                assert!((plane.x - 500_000.0).abs() < 1e-6 && plane.y > 0.0);
                let east = place(latitude_deg, meridian_deg + 2.9);
                let again = zone.geodetic(&zone.plane(&east), 0.0);
                assert!((again.latitude_deg - latitude_deg).abs() < 1e-11);
                assert!((again.longitude_deg - east.longitude_deg).abs() < 1e-11);
            }
        }
    }
}
