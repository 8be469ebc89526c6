//! Where the world's east, north and up are on the earth.
//!
//! The plane is a transverse Mercator projection whose central meridian runs through the datum's point, where
//! its scale is 1: 10 km to the side a metre is 1.2 um too long. Heights are over the ellipsoid.
//!
//! ```
//! use metrotwin::track::geodesy::{Datum, Geodetic};
//! use nalgebra::Point3;
//!
//! let chengdu = Datum {
//!     place: Geodetic { latitude_deg: 30.66, longitude_deg: 104.06, height_m: 480.0 },
//!     heading_deg: 0.0,
//! };
//! let station = chengdu.geodetic(&Point3::new(1200.0, -800.0, -18.0));
//! assert!((station.height_m - 462.0).abs() < 1e-9 && station.longitude_deg > 104.06);
//! assert!((chengdu.world(&station) - Point3::new(1200.0, -800.0, -18.0)).norm() < 1e-6);
//! ```
//!
//! Theory: Krueger's series to the fourth power of the third flattening (L. Krueger 1912; C. Karney,
//! "Transverse Mercator with an accuracy of a few nanometers", J. Geodesy 85, 2011), what is left out is below
//! a micrometre within 3000 km of the meridian.

mod utm;

pub use utm::UtmZone;

use nalgebra::{Point2, Point3, Rotation2};
use serde::{Deserialize, Serialize};

/// An ellipsoid of revolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Larger half axis, metres.
    pub a_m: f64,
    /// Third flattening, (a - b) / (a + b).
    pub n: f64,
}

/// That of WGS 84: a = 6 378 137 m, 1 / f = 298.257 223 563.
pub const WGS_84: Ellipsoid = Ellipsoid {
    a_m: 6_378_137.0,
    n: 1.0 / (2.0 * 298.257_223_563 - 1.0),
};

/// A place on the earth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geodetic {
    /// North of the equator, degrees.
    pub latitude_deg: f64,
    /// East of Greenwich, degrees.
    pub longitude_deg: f64,
    /// Over the ellipsoid, metres.
    pub height_m: f64,
}

/// Where the world's origin is on the earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Datum {
    /// The origin, on WGS 84.
    pub place: Geodetic,
    /// Direction of the world's x axis, degrees from east towards north.
    pub heading_deg: f64,
}

/// A transverse Mercator projection, with scale 1 on its meridian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransverseMercator {
    /// Of the earth.
    pub ellipsoid: Ellipsoid,
    /// The central meridian, degrees east.
    pub longitude_deg: f64,
}

impl Ellipsoid {
    fn eccentricity(&self) -> f64 {
        2.0 * self.n.sqrt() / (1.0 + self.n)
    }

    /// Radius of the circle with a meridian's length.
    fn rectifying_radius_m(&self) -> f64 {
        let n2 = self.n * self.n;
        self.a_m / (1.0 + self.n) * (1.0 + n2 / 4.0 + n2 * n2 / 64.0)
    }

    /// Tangent of the conformal latitude of one with this tangent.
    fn conformal(&self, tan: f64) -> f64 {
        let e = self.eccentricity();
        let secant = tan.hypot(1.0);
        let sigma = (e * (e * tan / secant).atanh()).sinh();
        tan * sigma.hypot(1.0) - sigma * secant
    }

    /// Tangent of the latitude whose conformal latitude has this one, by Newton's method.
    fn latitude(&self, conformal: f64) -> f64 {
        let left = 1.0 - self.eccentricity().powi(2);
        let mut tan = conformal / left;
        for _ in 0..8 {
            let found = self.conformal(tan);
            let slope = left * tan.hypot(1.0) * found.hypot(1.0) / (1.0 + left * tan * tan);
            let step = (conformal - found) / slope;
            tan += step;
            if step.abs() <= 1e-15 * tan.abs().max(1.0) {
                break;
            }
        }
        tan
    }
}

impl TransverseMercator {
    /// East of the meridian and north of the equator, metres.
    pub fn plane(&self, place: &Geodetic) -> Point2<f64> {
        let east = (place.longitude_deg - self.longitude_deg).to_radians();
        let t = (self.ellipsoid).conformal(place.latitude_deg.to_radians().tan());
        let xi = t.atan2(east.cos());
        let eta = (east.sin() / t.hypot(1.0)).atanh();
        let [eta, xi] = added([eta, xi], forward(self.ellipsoid.n));
        Point2::new(eta, xi) * self.ellipsoid.rectifying_radius_m()
    }

    /// Latitude and longitude of a point of the plane, at a height.
    pub fn geodetic(&self, plane: &Point2<f64>, height_m: f64) -> Geodetic {
        let scaled = plane / self.ellipsoid.rectifying_radius_m();
        let [eta, xi] = added([scaled.x, scaled.y], backward(self.ellipsoid.n));
        let across = eta.sinh();
        let conformal = xi.sin() / across.hypot(xi.cos());
        Geodetic {
            latitude_deg: self.ellipsoid.latitude(conformal).atan().to_degrees(),
            longitude_deg: self.longitude_deg + across.atan2(xi.cos()).to_degrees(),
            height_m,
        }
    }
}

/// Adds a series of Krueger's: sum of c[j] sin(2 j (xi + i eta)).
fn added([eta, xi]: [f64; 2], series: [f64; 4]) -> [f64; 2] {
    let mut sums = [eta, xi];
    for (j, c) in (1..).zip(series) {
        let twice = 2.0 * f64::from(j);
        let (sin, cos) = (twice * xi).sin_cos();
        sums[0] += c * cos * (twice * eta).sinh();
        sums[1] += c * sin * (twice * eta).cosh();
    }
    sums
}

/// From the sphere to the plane.
fn forward(n: f64) -> [f64; 4] {
    [
        n * (1.0 / 2.0 + n * (-2.0 / 3.0 + n * (5.0 / 16.0 + n * 41.0 / 180.0))),
        n * n * (13.0 / 48.0 + n * (-3.0 / 5.0 + n * 557.0 / 1440.0)),
        n.powi(3) * (61.0 / 240.0 - n * 103.0 / 140.0),
        n.powi(4) * 49561.0 / 161_280.0,
    ]
}

/// And back.
fn backward(n: f64) -> [f64; 4] {
    [
        -n * (1.0 / 2.0 + n * (-2.0 / 3.0 + n * (37.0 / 96.0 - n / 360.0))),
        -n * n * (1.0 / 48.0 + n * (1.0 / 15.0 - n * 437.0 / 1440.0)),
        -n.powi(3) * (17.0 / 480.0 - n * 37.0 / 840.0),
        -n.powi(4) * 4397.0 / 161_280.0,
    ]
}

impl Datum {
    fn projection(&self) -> TransverseMercator {
        TransverseMercator {
            ellipsoid: WGS_84,
            longitude_deg: self.place.longitude_deg,
        }
    }

    fn plane_from_world(&self) -> Rotation2<f64> {
        Rotation2::new(self.heading_deg.to_radians())
    }

    /// The world's point as a place on the earth.
    pub fn geodetic(&self, world: &Point3<f64>) -> Geodetic {
        let projection = self.projection();
        let plane = projection.plane(&self.place) + self.plane_from_world() * world.xy().coords;
        projection.geodetic(&plane, self.place.height_m + world.z)
    }

    /// A place on the earth as a point of the world.
    pub fn world(&self, place: &Geodetic) -> Point3<f64> {
        let projection = self.projection();
        let away = projection.plane(place) - projection.plane(&self.place);
        let world = self.plane_from_world().inverse() * away;
        Point3::new(world.x, world.y, place.height_m - self.place.height_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(whole: f64, minutes: f64, seconds: f64) -> f64 {
        whole + minutes / 60.0 + seconds / 3600.0
    }

    fn airy_1830() -> Ellipsoid {
        let (a, b) = (6_377_563.396, 6_356_256.909);
        Ellipsoid {
            a_m: a,
            n: (a - b) / (a + b),
        }
    }

    /// The worked example of Ordnance Survey, A guide to coordinate systems in Great Britain, annex C: the
    /// national grid is transverse Mercator on Airy's ellipsoid about 49 N 2 W, scaled by 0.9996012717.
    #[test]
    fn val_national_grid_of_great_britain() {
        let projection = TransverseMercator {
            ellipsoid: airy_1830(),
            longitude_deg: -2.0,
        };
        let origin = Geodetic {
            latitude_deg: 49.0,
            longitude_deg: -2.0,
            height_m: 0.0,
        };
        let caister = Geodetic {
            latitude_deg: degrees(52.0, 39.0, 27.2531),
            longitude_deg: degrees(1.0, 43.0, 4.5177),
            height_m: 0.0,
        };
        let scale = 0.999_601_271_7;
        let away = (projection.plane(&caister) - projection.plane(&origin)) * scale;
        let (east_m, north_m) = (400_000.0 + away.x, -100_000.0 + away.y);
        assert!((east_m - 651_409.903).abs() < 1e-3, "{east_m}");
        assert!((north_m - 313_177.270).abs() < 1e-3, "{north_m}");
    }

    /// The published length of a quarter of a meridian of WGS 84.
    #[test]
    fn val_quarter_of_a_meridian() {
        let quarter_m = WGS_84.rectifying_radius_m() * std::f64::consts::FRAC_PI_2;
        assert!((quarter_m - 10_001_965.729).abs() < 1e-3, "{quarter_m}");
    }

    /// Provokes: a series that is not the other's inverse, a latitude that does not converge, at any latitude
    /// and up to 20 degrees from the meridian.
    #[test]
    fn there_and_back() {
        for latitude in -89..=89 {
            for east in -20..=20 {
                let projection = TransverseMercator {
                    ellipsoid: WGS_84,
                    longitude_deg: 104.0,
                };
                let place = Geodetic {
                    latitude_deg: f64::from(latitude) + 0.123,
                    longitude_deg: 104.0 + f64::from(east),
                    height_m: 7.0,
                };
                let plane = projection.plane(&place);
                let again = projection.plane(&projection.geodetic(&plane, 7.0));
                assert!((again - plane).norm() < 1e-6, "{place:?} {plane} {again}");
            }
        }
    }

    /// Provokes: a world that is turned the wrong way, or whose metres are not the earth's: along the meridian
    /// and the parallel, by the radii of curvature there.
    #[test]
    fn a_metre_is_a_metre_in_the_worlds_direction() {
        let datum = |heading_deg| Datum {
            place: Geodetic {
                latitude_deg: 48.2,
                longitude_deg: 15.6,
                height_m: 300.0,
            },
            heading_deg,
        };
        let e2 = WGS_84.eccentricity().powi(2);
        let (sin, cos) = 48.2f64.to_radians().sin_cos();
        let w = (1.0 - e2 * sin * sin).sqrt();
        let north_m = WGS_84.a_m * (1.0 - e2) / w.powi(3) * 1f64.to_radians();
        let east_m = WGS_84.a_m / w * cos * 1f64.to_radians();
        for (world, heading_deg, by) in [
            (Point3::new(10.0, 0.0, 0.0), 0.0, [0.0, 10.0 / east_m]),
            (Point3::new(0.0, 10.0, 0.0), 0.0, [10.0 / north_m, 0.0]),
            (Point3::new(10.0, 0.0, 0.0), 90.0, [10.0 / north_m, 0.0]),
            (Point3::new(0.0, 10.0, 0.0), 90.0, [0.0, -10.0 / east_m]),
        ] {
            let datum = datum(heading_deg);
            let found = datum.geodetic(&world);
            // The meridian bends by 1e-5 m within 10 m.
            assert!((found.latitude_deg - datum.place.latitude_deg - by[0]).abs() * north_m < 2e-5);
            assert!(
                (found.longitude_deg - datum.place.longitude_deg - by[1]).abs() * east_m < 2e-5
            );
        }
        let far = Point3::new(4000.0, -7000.0, 25.0);
        let datum = datum(33.0);
        assert!((datum.world(&datum.geodetic(&far)) - far).norm() < 1e-6);
    }
}
