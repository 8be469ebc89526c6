//! Photometry: what light lamps and headlights throw on a surface, in double precision.
//!
//! A lamp is a disc whose intensity falls as I = I0 cos(a)^m with the angle a from its normal
//! (the generalised Lambert source of optical wireless: Gfeller and Bapst, Proc. IEEE 67(11), 1979;
//! m = 1 is a Lambert disc). Its flux is the
//! integral over the hemisphere, 2 pi I0 / (m + 1). Its luminance is the intensity over the
//! disc's apparent area, so it falls as cos(a)^(m - 1).
//!
//! A surface far from the disc compared with its radius gets E = I cos(a_in) / d^2. A lamp is off
//! half of the time (Manchester code), far too fast for
//! an eye, so its light in the mean over time is what is stored; what a row's exposure sees of the
//! blinking comes on top ([`LampField::flickering_lx`]).
//!
//! # Shadows
//!
//! A body between a light and a surface hides part of the light's disc. The surface loses the same
//! share of its illuminance:
//!
//! ```text
//! E = E0 (1 - hidden / 16)
//! ```
//!
//! where E0 is the illuminance without bodies and `hidden` counts those of 16 places on the disc,
//! spread evenly over its area ([`disc_places`]), to which a straight line from the surface is cut
//! by a body. So an edge throws a penumbra as wide as the disc seen through it, in 16 steps. Lines
//! start [`OFFSET_M`] off the surface. A body carries a headlight ([`Headlight::is_carried_by`]) or
//! hides it. Only bodies hide light, the tunnel and the rails do not.
//!
//! # Air
//!
//! Mist and dust ([`Air`]) take light away over a distance d as e^(-k d), on its way to a surface
//! and from there to the eye, and add what they scatter towards it (Koschmieder, "Theorie der
//! horizontalen Sichtweite", Beitraege zur Physik der freien Atmosphaere 12, 1924):
//!
//! ```text
//! L = L0 e^(-k d) + A (1 - e^(-k d))
//! ```
//!
//! The airlight A is that of air evenly lit by what reaches a point about the camera, scattered
//! alike in all directions: A = w E_s / (4 pi), w the share scattered, E_s the light that passes a
//! point from all sides, see [`LampField::airlight_cd_m2`]. Headlights' own beams in the mist, and
//! the halo of lamps through it, are left out.

use super::scene::{Air, Body, Headlight, LampLight};
use crate::track::waveform::{LightCurve, Ripple, Waveform};
use crate::track::{LampSite, TrackPoint, Tunnel};
use nalgebra::{Point3, Vector3};
use std::f64::consts::{PI, TAU};
use std::ops::Deref;

/// Lamps farther than this from a surface do not light it.
pub const LAMP_REACH_M: f64 = 30.0;

/// Radius of a headlight's luminous disc.
pub const HEADLIGHT_RADIUS_M: f64 = 0.09;
/// What is nearer to a headlight than this carries it.
const MOUNT_M: f64 = 0.3;
/// Lines to lights start this far off their surface, along its normal.
pub const OFFSET_M: f64 = 1e-3;
/// Airlight is the mean along the line to this distance before and behind the camera, a few
/// lamps.
pub const AIRLIGHT_REACH_M: f64 = 20.0;

/// 16 places on a disc, each for a sixteenth of its area.
pub fn disc_places(centre: &Point3<f64>, axis: &Vector3<f64>, radius_m: f64) -> [Point3<f64>; 16] {
    let mut places = [*centre; 16];
    for (place, point) in places
        .iter_mut()
        .zip(disc_points(centre, axis, radius_m, 16))
    {
        *place = point;
    }
    places
}

/// Places on a disc, each for the same share of its area: on a spiral of the golden angle (after
/// Vogel, "A better way to construct the sunflower head", Mathematical Biosciences 44, 1979).
pub fn disc_points(
    centre: &Point3<f64>,
    axis: &Vector3<f64>,
    radius_m: f64,
    count: usize,
) -> impl Iterator<Item = Point3<f64>> {
    let golden_rad = PI * (3.0 - 5f64.sqrt());
    let aside = axis.cross(&Vector3::z());
    let aside = aside.try_normalize(1e-6).unwrap_or_else(Vector3::x);
    let (centre, up) = (*centre, aside.cross(axis));
    (0..count).map(move |k| {
        let (sin, cos) = (k as f64 * golden_rad).sin_cos();
        let r = radius_m * ((k as f64 + 0.5) / count as f64).sqrt();
        centre + (aside * cos + up * sin) * r
    })
}

/// Rise and fall time of a lamp's light, from 10 to 90 %: that of an LED driver that switches a
/// lamp of some ten watts by a transistor; the phosphor's own is a seventh of it or so.
const EDGE_S: f64 = 1e-6;

/// Exponent m for which the intensity has fallen to half at half the full beam angle.
pub fn exponent_of_beam(full_beam_rad: f64) -> f64 {
    0.5f64.ln() / (0.5 * full_beam_rad).cos().ln()
}

impl LampLight {
    /// The lamp of a survey, blinking its name with a period that starts at `phase_s`.
    pub fn from_site(site: &LampSite, phase_s: f64) -> Self {
        let exponent = exponent_of_beam(site.beam_deg.to_radians());
        let flux_lm = site.power_w * site.efficacy_lm_per_w;
        let radius_m = 0.5 * site.diameter_m;
        Self {
            centre: site.centre,
            facing: site.facing,
            radius_m,
            luminance_cd_m2: flux_lm * (exponent + 1.0) / (TAU * PI * radius_m * radius_m),
            exponent,
            waveform: Waveform {
                rise_s: EDGE_S,
                fall_s: EDGE_S,
                ..Waveform::sharp(site.uid.frame(site.code), site.chip_s, phase_s)
            },
            level: 1.0,
            ripple: Ripple::default(),
            changes: Vec::new(),
        }
    }

    /// Its light in time. Times [`Self::level`] it is the light of a good lamp that stays on.
    pub fn curve(&self) -> LightCurve {
        LightCurve::new(&self.waveform, self.ripple)
    }

    /// Intensity along the normal of a good lamp while on.
    pub fn axial_intensity_cd(&self) -> f64 {
        self.luminance_cd_m2 * PI * self.radius_m * self.radius_m
    }
}

/// A lamp with its light in time worked out once: that takes longer than any use of it.
#[derive(Clone, Debug)]
pub struct Shining {
    lamp: LampLight,
    curve: LightCurve,
    duty: f64,
}

impl Deref for Shining {
    type Target = LampLight;

    fn deref(&self) -> &LampLight {
        &self.lamp
    }
}

impl Shining {
    /// Of a lamp.
    pub fn new(lamp: LampLight) -> Self {
        let curve = lamp.curve();
        Self {
            duty: lamp.level * curve.long_mean(),
            curve,
            lamp,
        }
    }

    /// Its light in the mean over time, as a share of that of a good lamp that stays on.
    pub fn duty(&self) -> f64 {
        self.duty
    }

    /// Its light in the mean from `open_s` to `close_s`, as such a share.
    pub fn share(&self, open_s: f64, close_s: f64) -> f64 {
        self.level * self.curve.mean(open_s, close_s)
    }

    /// Mean illuminance of a surface at `p` with unit normal `n`, lux; 0 out of reach.
    pub fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        let d = p - self.centre;
        if d.norm_squared() > LAMP_REACH_M * LAMP_REACH_M {
            return 0.0;
        }
        self.duty
            * point_source_lx(
                self.axial_intensity_cd(),
                self.exponent,
                &self.facing,
                &d,
                n,
            )
    }
}

impl Headlight {
    /// Where it is.
    pub fn place(&self) -> Point3<f64> {
        Point3::from(self.world_from_light.translation.vector)
    }

    /// Where it shines brightest, a unit vector.
    pub fn axis(&self) -> Vector3<f64> {
        self.world_from_light.rotation * Vector3::x()
    }

    /// Illuminance of a surface at `p` with unit normal `n`, lux.
    pub fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        let d = p - self.place();
        point_source_lx(self.intensity_cd, self.exponent, &self.axis(), &d, n)
    }

    /// Whether a body, taken as the box around it, has the headlight in it or next to it. It moves
    /// with the light and is behind it, so it never shades it.
    pub fn is_carried_by(&self, body: &Body) -> bool {
        let place = body
            .world_from_body
            .inverse_transform_point(&self.place())
            .coords;
        let outside = (place.abs() - body.shape.half_extents_m()).sup(&Vector3::zeros());
        outside.norm() < MOUNT_M
    }
}

/// Illuminance by a point source of intensity `i0` cos^m about `axis`; `d` leads from it to the
/// surface.
fn point_source_lx(
    i0: f64,
    exponent: f64,
    axis: &Vector3<f64>,
    d: &Vector3<f64>,
    n: &Vector3<f64>,
) -> f64 {
    let (out, into) = (axis.dot(d), -n.dot(d));
    if out <= 0.0 || into <= 0.0 {
        return 0.0;
    }
    // A surface never comes nearer than a hand's breadth to a source in a sane scene; the bound
    // only keeps the quotient finite.
    let d2 = d.norm_squared().max(1e-4);
    let distance = d2.sqrt();
    i0 * (out / distance).powf(exponent) * into / (d2 * distance)
}

/// The lamps of a scene, found by place: cells of a plan grid list the lamps that reach them.
#[derive(Clone, Debug)]
pub struct LampField {
    lamps: Vec<Shining>,
    air: Air,
    /// Cell and lamp, sorted, so that the lamps of a cell are one run.
    reach: Vec<((i32, i32), u32)>,
}

const CELL_M: f64 = 10.0;

fn cell(x_m: f64) -> i32 {
    (x_m / CELL_M).floor() as i32
}

impl LampField {
    /// Sorts the lamps into cells.
    pub fn new(lamps: &[LampLight]) -> Self {
        let mut reach = Vec::new();
        for (k, lamp) in lamps.iter().enumerate() {
            let c = lamp.centre;
            for i in cell(c.x - LAMP_REACH_M)..=cell(c.x + LAMP_REACH_M) {
                for j in cell(c.y - LAMP_REACH_M)..=cell(c.y + LAMP_REACH_M) {
                    reach.push(((i, j), k as u32));
                }
            }
        }
        reach.sort_unstable();
        Self {
            lamps: lamps.iter().cloned().map(Shining::new).collect(),
            air: Air::default(),
            reach,
        }
    }

    /// The same lamps in air that is not clear.
    #[must_use]
    pub fn in_air(mut self, air: Air) -> Self {
        self.air = air;
        self
    }

    /// All lamps, in the order given.
    pub fn lamps(&self) -> &[Shining] {
        &self.lamps
    }

    /// Those that may reach a place, in the order given.
    pub fn near(&self, p: &Point3<f64>) -> impl Iterator<Item = &Shining> {
        self.indices_near(p).map(|k| &self.lamps[k])
    }

    fn indices_near(&self, p: &Point3<f64>) -> impl Iterator<Item = usize> {
        let at = (cell(p.x), cell(p.y));
        let first = self.reach.partition_point(|(c, _)| *c < at);
        self.reach[first..]
            .iter()
            .take_while(move |(c, _)| *c == at)
            .map(|(_, k)| *k as usize)
    }

    /// What the blinking of lamps adds to their mean illuminance of a surface in an exposure, lux;
    /// `flicker` is the light of each lamp in it over its mean, less 1.
    pub fn flickering_lx(&self, p: &Point3<f64>, n: &Vector3<f64>, flicker: &[f64]) -> f64 {
        self.indices_near(p)
            .filter(|k| flicker[*k] != 0.0)
            .map(|k| {
                let lamp = &self.lamps[k];
                let clear = self.air.transmission((p - lamp.centre).norm());
                flicker[k] * clear * lamp.irradiance_lx(p, n)
            })
            .sum()
    }

    /// Mean illuminance by all lamps of a surface at `p` with unit normal `n`, lux.
    pub fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        self.near(p)
            .map(|lamp| {
                let lux = lamp.irradiance_lx(p, n);
                // Most lamps about a place turn their back on it.
                if lux > 0.0 {
                    lux * self.air.transmission((p - lamp.centre).norm())
                } else {
                    0.0
                }
            })
            .sum()
    }

    /// Mean light of all lamps that passes a place from any side, lux: the sum of I / d^2.
    fn scalar_lx(&self, p: &Point3<f64>) -> f64 {
        self.near(p)
            .map(|lamp| {
                let d = p - lamp.centre;
                // A surface that faces the lamp gets all of it.
                d.try_normalize(1e-3).map_or(0.0, |to| {
                    lamp.irradiance_lx(p, &-to) * self.air.transmission(d.norm())
                })
            })
            .sum()
    }

    /// Luminance of endless lit air about a chainage: the mean, over places a metre apart along
    /// the line to [`AIRLIGHT_REACH_M`] on both sides and 2 m above top of rail, of what it
    /// scatters. Ambient light of E lux on every surface is a luminance of E / pi from all sides,
    /// so 4 E pass any place.
    pub fn airlight_cd_m2(&self, tunnel: &Tunnel, s_m: f64) -> f64 {
        if self.air.is_clear() {
            return 0.0;
        }
        let places = AIRLIGHT_REACH_M as i32;
        let lamps_lx: f64 = (-places..=places)
            .map(|k| {
                let place = TrackPoint {
                    s_m: s_m + f64::from(k),
                    l_m: 0.0,
                    h_m: 2.0,
                };
                self.scalar_lx(&tunnel.alignment.world_from_track(place))
            })
            .sum();
        let mean_lx = lamps_lx / f64::from(2 * places + 1) + 4.0 * tunnel.ambient_lx;
        self.air.scattered_share * mean_lx / (4.0 * PI)
    }
}

/// Illuminance by all headlights of a surface at `p` with unit normal `n` through air, lux.
pub fn headlights_lx(
    headlights: &[Headlight],
    air: &Air,
    p: &Point3<f64>,
    n: &Vector3<f64>,
) -> f64 {
    headlights
        .iter()
        .map(|light| light.irradiance_lx(p, n) * air.transmission((p - light.place()).norm()))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::uid::Uid;
    use crate::twin::render::scene::Shape;
    use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion};

    fn lamp(centre: Point3<f64>, facing: Vector3<f64>) -> Shining {
        Shining::new(light(centre, facing))
    }

    fn light(centre: Point3<f64>, facing: Vector3<f64>) -> LampLight {
        LampLight::from_site(
            &LampSite {
                uid: Uid { line: 1, lamp: 7 },
                chainage_m: 0.0,
                lateral_m: 2.8,
                height_m: 3.2,
                centre,
                facing: Unit::new_normalize(facing),
                diameter_m: 0.25,
                power_w: 21.0,
                efficacy_lm_per_w: 100.0,
                beam_deg: 60.0,
                chip_s: 66.6e-6,
                code: crate::track::uid::LineCode::Manchester,
            },
            0.0,
        )
    }

    /// Fails where the factor of the flux or the exponent is wrong: light caught by a sphere of
    /// patches around the lamp is its flux.
    #[test]
    fn a_sphere_around_a_lamp_catches_its_mean_flux() {
        let lamp = lamp(Point3::new(4.0, 5.0, 6.0), Vector3::new(0.2, 1.0, -0.4));
        assert!((lamp.exponent - 4.818).abs() < 1e-3);
        let (radius, bands) = (7.0, 400);
        let side = lamp
            .facing
            .cross(&Vector3::z())
            .try_normalize(1e-9)
            .unwrap_or(Vector3::x());
        let other = lamp.facing.cross(&side);
        let mut flux = 0.0;
        for i in 0..bands {
            let cos = -1.0 + (f64::from(i) + 0.5) * 2.0 / f64::from(bands);
            let sin = (1.0f64 - cos * cos).sqrt();
            for j in 0..16 {
                let (b, a) = (TAU * f64::from(j) / 16.0).sin_cos();
                let out = lamp.facing.into_inner() * cos + (side * a + other * b) * sin;
                let patch = 2.0 * TAU * radius * radius / f64::from(bands * 16);
                flux += lamp.irradiance_lx(&(lamp.centre + out * radius), &-out) * patch;
            }
        }
        assert!((flux / (0.5 * 2100.0) - 1.0).abs() < 1e-4, "{flux}");
    }

    /// Fails where distance or incidence has the wrong power.
    #[test]
    fn light_falls_with_distance_squared_and_incidence() {
        let lamp = lamp(Point3::origin(), Vector3::x());
        let at = |d: f64, n: Vector3<f64>| lamp.irradiance_lx(&Point3::new(d, 0.0, 0.0), &n);
        let axial = 0.5 * lamp.axial_intensity_cd();
        assert!((at(3.0, -Vector3::x()) - axial / 9.0).abs() < 1e-9);
        assert!((at(6.0, -Vector3::x()) * 4.0 - at(3.0, -Vector3::x())).abs() < 1e-9);
        let slanted = Vector3::new(-0.5, 0.75f64.sqrt(), 0.0);
        assert!((at(3.0, slanted) - 0.5 * axial / 9.0).abs() < 1e-9);
        // Turned away, behind the lamp, out of reach: dark.
        assert!(at(3.0, Vector3::x()).abs() < 1e-300);
        assert!(at(-3.0, Vector3::x()).abs() < 1e-300);
        assert!(at(30.01, -Vector3::x()).abs() < 1e-300);
        let half = Point3::new(30f64.to_radians().cos(), 30f64.to_radians().sin(), 0.0);
        let inwards = -half.coords;
        assert!((lamp.irradiance_lx(&half, &inwards) - 0.5 * axial).abs() < 1e-9);
    }

    /// Fails where the grid loses a lamp: the same sum over all lamps.
    #[test]
    fn cells_hold_every_lamp_in_reach() {
        let lamps: Vec<_> = (0..40)
            .map(|k| {
                let s = 10.0 * f64::from(k) - 200.0;
                light(
                    Point3::new(s * 0.8, s * 0.6, 3.0),
                    Vector3::new(1.0, -2.0, 0.1),
                )
            })
            .collect();
        let field = LampField::new(&lamps);
        let lamps = field.lamps();
        let n = Vector3::new(0.0, 0.6, 0.8);
        for k in 0..500 {
            let s = f64::from(k) - 250.0;
            let p = Point3::new(s * 0.8 + 1.0, s * 0.6 - 2.5, 0.0);
            let all: f64 = lamps.iter().map(|l| l.irradiance_lx(&p, &n)).sum();
            assert!((field.irradiance_lx(&p, &n) - all).abs() < 1e-12);
            assert!(field.near(&p).count() <= 10);
        }
    }

    /// Fails where the places on a disc leave a part of it out: their mean and mean square
    /// distance are those of an even disc.
    #[test]
    fn places_are_even_over_the_disc() {
        let (centre, axis) = (Point3::new(3.0, -2.0, 7.0), Vector3::new(0.6, 0.0, -0.8));
        let places = disc_places(&centre, &axis, 0.5);
        let offs = places.map(|p| p - centre);
        let mean = offs.iter().sum::<Vector3<f64>>() / 16.0;
        let square = offs.iter().map(Vector3::norm_squared).sum::<f64>() / 16.0;
        assert!(mean.norm() < 0.03 && (square / 0.125 - 1.0).abs() < 1e-9);
        assert!(offs.iter().all(|o| o.dot(&axis).abs() < 1e-12));
        for k in 0..32 {
            // No half of it has more than one and a half places too many.
            let (sin, cos) = (TAU * f64::from(k) / 32.0).sin_cos();
            let half = Vector3::y() * sin + Vector3::new(0.8, 0.0, 0.6) * cos;
            let over = offs.iter().filter(|o| o.dot(&half) > 0.0).count();
            assert!((7..=9).contains(&over), "{over}");
        }
    }

    /// Fails where lamps shine through mist as through clear air, or twice dimmed.
    #[test]
    fn mist_dims_lamps_by_beer_and_lambert() {
        let lamps = [light(Point3::origin(), Vector3::x())];
        let air = Air::of_visibility(50.0);
        let (clear, misty) = (LampField::new(&lamps), LampField::new(&lamps).in_air(air));
        for d in [1.0f64, 7.0, 20.0] {
            let at =
                |field: &LampField| field.irradiance_lx(&Point3::new(d, 0.0, 0.0), &-Vector3::x());
            let expected = (-3.912_023 / 50.0 * d).exp();
            assert!((at(&misty) / at(&clear) - expected).abs() < 1e-6);
        }
    }

    /// Fails where the airlight of evenly lit mist is not that of its surroundings: where light
    /// of luminance L comes from all sides, air that absorbs nothing glows with L.
    #[test]
    fn evenly_lit_mist_is_as_bright_as_what_lights_it() {
        let mut tunnel = crate::twin::render::sample::tunnel();
        tunnel.ambient_lx = 12.0 * PI;
        let mut air = Air::of_visibility(80.0);
        let dark = LampField::new(&[]).in_air(air);
        assert!((dark.airlight_cd_m2(&tunnel, 100.0) - 12.0).abs() < 1e-9);
        air.scattered_share = 0.7;
        let dust = LampField::new(&[]).in_air(air);
        assert!((dust.airlight_cd_m2(&tunnel, 100.0) - 8.4).abs() < 1e-9);
        // Lamps add to it, clear air has none.
        let lit = LampField::new(&crate::twin::render::sample::scene().lamps);
        assert!(lit.airlight_cd_m2(&tunnel, 100.0).abs() < 1e-300);
        assert!(lit.in_air(air).airlight_cd_m2(&tunnel, 100.0) > 8.5);
    }

    /// Fails where a headlight shines along another axis than x, or blinks.
    #[test]
    fn a_headlight_shines_along_its_x_axis() {
        let light = Headlight {
            world_from_light: Isometry3::from_parts(
                Translation3::new(1.0, 0.0, 0.0),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5 * PI),
            ),
            intensity_cd: 900.0,
            exponent: 30.0,
        };
        let e = headlights_lx(
            &[light.clone(), light],
            &Air::default(),
            &Point3::new(1.0, 3.0, 0.0),
            &-Vector3::y(),
        );
        assert!((e - 200.0).abs() < 1e-9);
    }

    /// Fails where a train stands in its own light: the headlight is just inside of its front, or
    /// just before it, behind a lens. A board half a metre ahead is not part of the train.
    #[test]
    fn a_train_carries_its_headlights() {
        let light = Headlight {
            world_from_light: Isometry3::translation(100.0, 0.9, 1.0),
            intensity_cd: 900.0,
            exponent: 30.0,
        };
        let carries = |shape: Shape, x: f64, y: f64| {
            light.is_carried_by(&Body {
                shape,
                world_from_body: Isometry3::translation(x, y, 1.5),
                velocity_mps: Vector3::zeros(),
                albedo: 0.5,
                luminance_cd_m2: 0.0,
            })
        };
        let car = || Shape::Box(Vector3::new(10.0, 1.4, 1.4));
        assert!(carries(car(), 90.1, 0.0) && carries(car(), 89.9, 0.0));
        assert!(!carries(car(), 68.0, 0.0) && !carries(car(), 90.1, 2.8));
        assert!(carries(Shape::Sphere(0.3), 100.0, 0.9));
        assert!(!carries(
            Shape::Box(Vector3::new(0.01, 1.0, 1.0)),
            100.5,
            0.9
        ));
    }
}
