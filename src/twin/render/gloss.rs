//! Light that polished and wet surfaces mirror: lamps and headlights in rail heads and in a wet bed.
//!
//! A surface of many small mirrors that lean this way and that (Cook and Torrance, ACM Transactions on
//! Graphics 1(1), 1982) shows a small source of intensity I at a distance d the luminance
//!
//! ```text
//! L = I / d^2  F D G / (4 cos_out)
//! ```
//!
//! with F what a mirror reflects at the angle between source and eye (Schlick, Computer Graphics Forum
//! 13(3), 1994), D how many mirrors lean so that source and eye see each other, and G how many of them
//! are not behind others. Slopes are normal (Beckmann), of one width along the track and another
//! across: wheels roll a rail head smooth lengthwise. G is Smith's for that, in the rational form of
//! Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007.
//!
//! A lamp is a disc. Seen from the surface under the angle rho (radius over distance) it asks for
//! slopes that scatter by rho / 4 in the plane of source and eye and by rho / (4 cos_in) across; that
//! widens D, and keeps what the whole reflection adds up to. So the mirror image of a lamp is a
//! soft spot of the right place, light and size, not a disc with a rim; a film much smoother than those
//! here would show the rim.
//!
//! # What it does not do
//!
//! Only lamps and headlights are mirrored; walls, trains and sky are not. Bodies do not hide what is
//! mirrored. The film is even, without puddles.

use super::light_source::LightSource;
use crate::track::Material;
use crate::twin::air::Air;
use nalgebra::{Matrix2, Point3, Vector2, Vector3};
use std::f64::consts::PI;

/// Lamps farther than this from a surface are not mirrored in it.
pub const MIRROR_REACH_M: f64 = 60.0;
/// A surface that is level but for this cosine counts as the head of a rail.
const HEAD_COSINE: f64 = 0.8;

/// How a surface mirrors. Root 2 times the standard deviation of slopes is its roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// Share of light reflected head on.
    pub head_on: f64,
    /// Roughness along the track.
    pub along: f64,
    /// Roughness across.
    pub across: f64,
}

/// A rail head as wheels leave it: iron's reflectance; widths of slopes assumed, across more than its
/// crown of 300 mm has over the width of the running band.
const RAIL: Gloss = Gloss {
    head_on: 0.55,
    along: 0.05,
    across: 0.2,
};
/// Water on concrete (refractive index 1.33), a film that follows the rough ground in part.
const WATER: Gloss = Gloss {
    head_on: 0.02,
    along: 0.07,
    across: 0.07,
};

impl Gloss {
    /// Of a surface with a unit normal; none for what is dull.
    pub fn of(material: Material, wet: bool, normal: &Vector3<f64>) -> Option<Self> {
        match material {
            Material::Rail if normal.z > HEAD_COSINE => Some(RAIL),
            Material::Bed if wet && normal.z > HEAD_COSINE => Some(WATER),
            _ => None,
        }
    }

    /// Luminance that a surface mirrors of a source to an eye.
    pub fn luminance_cd_m2(
        &self,
        facing: &Facing,
        to_eye: &Vector3<f64>,
        source: &MirroredLight,
    ) -> f64 {
        let distance_m = source.away.norm();
        if distance_m <= 1e-3 {
            return 0.0;
        }
        let (to_source, to_eye) = (source.away / distance_m, to_eye.normalize());
        let (into, out) = (facing.normal.dot(&to_source), facing.normal.dot(&to_eye));
        if into <= 0.0 || out <= 0.0 {
            return 0.0;
        }
        let half = to_source + to_eye;
        let up = facing.normal.dot(&half);
        let slope = Vector2::new(facing.along.dot(&half), facing.across().dot(&half)) / up;
        let cos2 = 1.0 / (1.0 + slope.norm_squared());
        let widths = self.widths(facing, &to_source, into, source.radius_m / distance_m);
        let Some(inverse) = widths.try_inverse() else {
            return 0.0;
        };
        let spread = (-slope.dot(&(inverse * slope))).exp();
        let leaning = spread / (PI * widths.determinant().sqrt() * cos2 * cos2);
        let open = self.unhidden(facing, &to_source, into) * self.unhidden(facing, &to_eye, out);
        let mirrored = self.mirrored(to_eye.dot(&half) / half.norm());
        source.intensity_cd / distance_m.powi(2) * mirrored * leaning * open / (4.0 * out)
    }

    /// Squares of the widths of slopes, as a matrix in the surface, with what the source's size adds.
    fn widths(&self, facing: &Facing, to: &Vector3<f64>, into: f64, rho: f64) -> Matrix2<f64> {
        let level = Vector2::new(facing.along.dot(to), facing.across().dot(to));
        let towards = level.try_normalize(1e-9).unwrap_or_else(Vector2::x);
        let aside = Vector2::new(-towards.y, towards.x);
        let [a, b] = [self.along, self.across].map(|width| width * width);
        Matrix2::new(a, 0.0, 0.0, b)
            + towards * towards.transpose() * (rho * rho / 8.0)
            + aside * aside.transpose() * ((rho / into).powi(2) / 8.0)
    }

    /// Share of the mirrors that are not behind others from a direction.
    fn unhidden(&self, facing: &Facing, to: &Vector3<f64>, cos: f64) -> f64 {
        let (along, across) = (facing.along.dot(to), facing.across().dot(to));
        let width = (self.along * along).hypot(self.across * across);
        let a = cos / width.max(1e-9);
        if a >= 1.6 {
            1.0
        } else {
            a * (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a))
        }
    }

    /// Share that a mirror reflects at an angle.
    fn mirrored(&self, cos: f64) -> f64 {
        self.head_on + (1.0 - self.head_on) * (1.0 - cos).clamp(0.0, 1.0).powi(5)
    }
}

/// How a surface lies: unit vectors, at right angles.
#[derive(Clone, Copy, Debug)]
pub struct Facing {
    /// On the lit side.
    pub normal: Vector3<f64>,
    /// Up the track.
    pub along: Vector3<f64>,
}

impl Facing {
    /// Of a normal and a direction near to that of the track.
    pub fn new(normal: Vector3<f64>, along: &Vector3<f64>) -> Self {
        let along = along - normal * normal.dot(along);
        Self {
            normal,
            along: along.try_normalize(1e-9).unwrap_or_else(Vector3::x),
        }
    }

    fn across(&self) -> Vector3<f64> {
        self.normal.cross(&self.along)
    }
}

/// What is mirrored, from a place of the surface.
#[derive(Clone, Copy, Debug)]
pub struct MirroredLight {
    /// From the place to the source.
    pub away: Vector3<f64>,
    /// Towards the place, what the air takes on the way taken off.
    pub intensity_cd: f64,
    /// Radius of its disc.
    pub radius_m: f64,
}

impl MirroredLight {
    /// A light of some intensity along its axis, from a place.
    pub fn of(source: &LightSource<'_>, axial_cd: f64, air: &Air, place: &Point3<f64>) -> Self {
        let away = source.centre - place;
        let distance_m = away.norm();
        let cos = (-source.axis.dot(&away) / distance_m.max(1e-9)).max(0.0);
        let towards_cd = axial_cd * cos.powf(source.exponent);
        Self {
            away,
            intensity_cd: towards_cd * air.transmission(distance_m),
            radius_m: source.radius_m,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::print_stdout, reason = "a test prints its figures")]
    use super::*;
    use crate::twin::render::disc::disc_points;

    const LEVEL: fn() -> Facing = || Facing::new(Vector3::z(), &Vector3::x());

    /// Light mirrored to an eye, by the plain law for every point of the disc, without what the disc's
    /// size adds: 4,000 small sources.
    fn by_points(gloss: &Gloss, to_eye: &Vector3<f64>, source: &MirroredLight) -> f64 {
        let axis = source.away.normalize();
        disc_points(&source.away.into(), &axis, source.radius_m, 4000)
            .map(|place| {
                let point = MirroredLight {
                    away: place.coords,
                    intensity_cd: source.intensity_cd / 4000.0,
                    radius_m: 0.0,
                };
                gloss.luminance_cd_m2(&LEVEL(), to_eye, &point)
            })
            .sum()
    }

    /// Provokes a disc's size added with a wrong factor, or in the wrong direction: against the plain
    /// law summed over the disc, about the mirror's direction and beside it.
    #[test]
    fn a_disc_is_the_sum_of_its_points() {
        let mut worst: f64 = 0.0;
        for gloss in [RAIL, WATER] {
            for (angle, distance_m) in [(0.5f64, 3.0), (1.0, 4.0), (1.3, 8.0)] {
                let source = MirroredLight {
                    away: Vector3::new(angle.sin(), 0.0, angle.cos()) * distance_m,
                    intensity_cd: 1000.0,
                    radius_m: 0.125,
                };
                let at = |lean: f64, aside: f64| {
                    Vector3::new(-(angle + lean).sin(), aside, (angle + lean).cos())
                };
                let peak = by_points(&gloss, &at(0.0, 0.0), &source);
                for (lean, aside) in [
                    (0.0, 0.0),
                    (0.06, 0.0),
                    (-0.1, 0.0),
                    (0.0, 0.05),
                    (0.05, 0.1),
                ] {
                    let eye = at(lean, aside).normalize();
                    let exact = by_points(&gloss, &eye, &source);
                    let ours = gloss.luminance_cd_m2(&LEVEL(), &eye, &source);
                    worst = worst.max((ours - exact).abs() / peak);
                }
            }
        }
        println!("off by up to {:.2} % of the peak", 100.0 * worst);
        assert!(worst < 0.02, "{worst}");
    }

    /// Provokes a reflection that is too bright or elsewhere: the image of a disc in a smooth film, added
    /// up over all directions of the eye's picture, is the disc's light times what a mirror reflects,
    /// and lies where a mirror has it.
    #[test]
    fn a_smooth_film_mirrors_what_a_mirror_does() {
        // An eye 1.5 m above the film looks at a lamp 2 m above it, 7 m away.
        let (eye, lamp) = (Point3::new(0.0, 0.0, 1.5), Point3::new(7.0, 0.0, 2.0));
        let gloss = Gloss {
            head_on: 0.02,
            along: 0.03,
            across: 0.03,
        };
        let (radius_m, luminance) = (0.1, 5000.0);
        let intensity_cd = luminance * PI * radius_m * radius_m;
        let step_m = 0.01;
        let (mut light, mut sum, mut centre) = (0.0, 0.0, Vector3::zeros());
        for (i, j) in (100..650).flat_map(|i| (-150..=150).map(move |j| (i, j))) {
            let place = Point3::new(step_m * f64::from(i), step_m * f64::from(j), 0.0);
            let to_eye = eye - place;
            let source = MirroredLight {
                away: lamp - place,
                intensity_cd,
                radius_m,
            };
            let l = gloss.luminance_cd_m2(&LEVEL(), &to_eye, &source);
            let solid_angle = step_m * step_m * to_eye.z / to_eye.norm().powi(3);
            light += l * solid_angle;
            sum += l;
            centre += place.coords * l;
        }
        let path_m = (lamp - Point3::new(0.0, 0.0, -1.5)).norm();
        let cos = 3.5 / path_m;
        let expected = gloss.mirrored(cos) * intensity_cd / (path_m * path_m);
        println!("light {:.4} of a mirror's", light / expected);
        assert!(
            (light / expected - 1.0).abs() < 0.06,
            "{}",
            light / expected
        );
        let middle = centre / sum;
        println!("{:.3} m from where a mirror has it", middle.x - 3.0);
        assert!(
            (middle.x - 3.0).abs() < 0.12 && middle.y.abs() < 1e-9,
            "{middle}"
        );
    }
}
