//! Light of the sky where tracks lie in the open.
//!
//! Sky and ground are even: under a sky of luminance L level ground has E = pi L. A surface whose upward part
//! of the normal is n sees (1 + n) / 2 of the sky, and of the ground, which reflects a share r of E, the rest:
//!
//! E(n) = E ((1 + n) + r (1 - n)) / 2
//!
//! This is the overcast day of the CIE without its gradient towards the zenith. Walls beside the track hide
//! nothing of the sky. What comes into a tunnel is in [`portal`](super::portal).

use super::corridor::Corridor;
use super::portal::Portal;
use crate::track::{Material, Track};
use crate::twin::geometry::TunnelEnd;
use crate::twin::reflectance::mean_albedo;
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Buffer stops and the like stand so far beyond the end of a track.
const BEYOND_M: f64 = 20.0;
/// What is so far beside the bed of a stretch, and between these heights over its top of rail, is in the open there.
const ASIDE_M: f64 = 5.0;
const HEIGHTS_M: RangeInclusive<f64> = -2.0..=20.0;

/// Daylight on a network of tracks.
#[derive(Clone, Debug, Default)]
pub struct Daylight {
    /// On level ground.
    level_lx: f64,
    /// The stretches in the open.
    open: Vec<Corridor>,
    /// Portals of all tunnels.
    portals: Vec<Portal>,
}

/// Light from all sides about a place: on a surface whose upward part of the normal is n, `mean_lx` + n `upward_lx`.
#[derive(Clone, Copy, Debug, Default)]
pub struct AmbientLight {
    /// In the mean over all directions that a surface may face.
    pub mean_lx: f64,
    pub upward_lx: f64,
}

/// Where ambient light comes from.
#[derive(Clone, Copy, Debug)]
pub enum Surroundings<'a> {
    /// By day.
    Open(&'a Daylight),
    /// A tunnel with light of its own, into which that of the day comes through portals, or the open at night.
    Tunnel {
        ambient_lx: f64,
        daylight: Option<&'a Daylight>,
    },
}

impl Surroundings<'_> {
    /// Ambient light at a place; that through portals is what falls on a surface with this normal.
    pub fn ambient(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> AmbientLight {
        match self {
            Self::Open(daylight) => daylight.outside(),
            Self::Tunnel {
                ambient_lx,
                daylight,
            } => {
                let portals_lx = daylight.map_or(0.0, |d| d.through_portals_lx(p, normal));
                AmbientLight {
                    mean_lx: ambient_lx + portals_lx,
                    upward_lx: 0.0,
                }
            }
        }
    }

    /// On a surface.
    pub fn on_surface_lx(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        self.ambient(p, normal).on_surface_lx(normal)
    }
}

impl AmbientLight {
    /// On a surface with a normal.
    pub fn on_surface_lx(&self, normal: &Vector3<f64>) -> f64 {
        self.mean_lx + normal.z * self.upward_lx
    }
}

impl Daylight {
    /// Of tracks, with what is beyond the begin and the end of each; none at night, or where all of them lie in
    /// tunnels.
    pub fn of(tracks: &[Arc<Track>], ends: &[[TunnelEnd; 2]]) -> Option<Self> {
        let level_lx = tracks.iter().map(|t| t.daylight_lx).fold(0.0, f64::max);
        let tracks = || tracks.iter().zip(ends);
        let open: Vec<_> = tracks()
            .flat_map(|(track, ends)| open_stretches(track, *ends))
            .collect();
        (level_lx > 0.0 && !open.is_empty()).then(|| Self {
            level_lx,
            open,
            portals: tracks()
                .flat_map(|(track, ends)| Portal::all_of(track, *ends))
                .collect(),
        })
    }

    /// Luminance of the sky.
    pub fn sky_cd_m2(&self) -> f64 {
        self.level_lx / PI
    }

    /// Luminance of the ground far away.
    pub fn ground_cd_m2(&self) -> f64 {
        mean_albedo(Material::Bed) * self.level_lx / PI
    }

    /// Luminance of what is seen in a direction where no surface is.
    pub fn beyond_cd_m2(&self, direction: &Vector3<f64>) -> f64 {
        match direction.z > 0.0 {
            true => self.sky_cd_m2(),
            false => self.ground_cd_m2(),
        }
    }

    /// In the open.
    pub fn outside(&self) -> AmbientLight {
        let ground = mean_albedo(Material::Bed);
        AmbientLight {
            mean_lx: 0.5 * self.level_lx * (1.0 + ground),
            upward_lx: 0.5 * self.level_lx * (1.0 - ground),
        }
    }

    /// On a surface in a tunnel, through its portals.
    pub fn through_portals_lx(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let portals = self.portals.iter();
        let outside_cd_m2 = 0.5 * (self.sky_cd_m2() + self.ground_cd_m2());
        portals
            .map(|portal| portal.lux_per_cd_m2(p, normal) * outside_cd_m2)
            .sum()
    }

    /// The middle of what lies in the open.
    pub fn middle(&self) -> Point3<f64> {
        let points = self.open.iter().flat_map(Corridor::points);
        let corners = points.fold(None, |corners, p| {
            let (low, high) = corners.unwrap_or((*p, *p));
            Some((p.inf(&low), p.sup(&high)))
        });
        corners.map_or_else(Point3::origin, |(low, high)| nalgebra::center(&low, &high))
    }

    /// Whether a place is in the open.
    pub fn reaches(&self, p: &Point3<f64>) -> bool {
        self.open.iter().any(|stretch| stretch.holds(p))
    }
}

/// What is about each open section, and a little more of it where nothing is beyond.
fn open_stretches(track: &Track, ends: [TunnelEnd; 2]) -> impl Iterator<Item = Corridor> + '_ {
    let open = track
        .sections
        .iter()
        .filter(|range| range.section.is_open());
    let [begin, end] = ends.map(|end| end == TunnelEnd::Nothing);
    let end_m = track.alignment.length_m();
    open.map(move |range| {
        let beyond_m = |at_end: bool| if at_end { BEYOND_M } else { 0.0 };
        let from_m = range.from_m - beyond_m(begin && range.from_m <= 0.0);
        let to_m = range.to_m + beyond_m(end && range.to_m >= end_m);
        let [right_m, left_m] = range.section.lateral_m();
        let lateral_m = right_m - ASIDE_M..=left_m + ASIDE_M;
        Corridor::along(track, [from_m, to_m], lateral_m, HEIGHTS_M)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::{Alignment, CrossSection, PlanElement, SectionRange};

    fn daylight() -> Option<Daylight> {
        let plan = [PlanElement::straight(200.0)];
        let mut track = Track::bare("yard", Alignment::new(Point3::origin(), 0.0, &plan, &[]));
        let range = |from_m, to_m, section| SectionRange {
            from_m,
            to_m,
            missing_rail: None,
            section,
        };
        track.sections = vec![
            range(
                0.0,
                80.0,
                CrossSection::rectangular(2.9, 2.9, 4.6, None, None),
            ),
            range(80.0, 200.0, CrossSection::open(20.0)),
        ];
        track.daylight_lx = 5000.0;
        Daylight::of(&[Arc::new(track)], &[[TunnelEnd::Tunnel; 2]])
    }

    /// Against the integral over the hemisphere that a surface faces, by sums over small parts of it.
    #[test]
    fn light_on_a_surface_is_that_of_sky_and_ground() {
        let daylight = daylight().unwrap_or_default();
        for tilt in [0.0_f64, 0.4, 1.1, 0.5 * PI, 2.3, PI] {
            let normal = Vector3::new(tilt.sin(), 0.0, tilt.cos());
            let (steps, mut sum) = (400, 0.0);
            for i in 0..steps {
                let z: f64 = -1.0 + (2.0 * f64::from(i) + 1.0) / f64::from(steps);
                for j in 0..steps {
                    let turn = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(steps);
                    let level = (1.0 - z * z).sqrt();
                    let way = Vector3::new(level * turn.cos(), level * turn.sin(), z);
                    sum += daylight.beyond_cd_m2(&way) * way.dot(&normal).max(0.0);
                }
            }
            let expected = sum * 4.0 * PI / f64::from(steps * steps);
            let lux = daylight.outside().on_surface_lx(&normal);
            assert!(
                (lux / expected - 1.0).abs() < 1e-3,
                "{tilt}: {lux} {expected}"
            );
        }
        let level_lx = daylight.outside().on_surface_lx(&Vector3::z());
        assert!((level_lx - 5000.0).abs() < 1e-9);
    }

    /// Fails where daylight goes into a tunnel, or ends before the open does.
    #[test]
    fn daylight_is_in_the_open_only() {
        let daylight = daylight().unwrap_or_default();
        for (x, y, z, open) in [
            (79.0, 0.0, 1.0, false),
            (81.0, 0.0, 1.0, true),
            (199.0, 19.0, 3.0, true),
            (150.0, 26.0, 1.0, false),
            (201.0, 0.0, 1.0, false),
            (150.0, 150.0, 1.0, false),
            (150.0, 0.0, -15.0, false),
        ] {
            assert_eq!(daylight.reaches(&Point3::new(x, y, z)), open, "{x} {y} {z}");
        }
    }

    /// Fails where a bend leaves gaps between the straight pieces of its outside.
    #[test]
    fn a_bend_is_in_the_open_on_both_sides() {
        let plan = [PlanElement::arc(200.0, 1.0 / 300.0, 0.0)];
        let mut track = Track::bare("bend", Alignment::new(Point3::origin(), 0.0, &plan, &[]));
        track.sections.push(SectionRange {
            from_m: 0.0,
            to_m: 200.0,
            missing_rail: None,
            section: CrossSection::open(25.0),
        });
        track.daylight_lx = 5000.0;
        let track = Arc::new(track);
        let daylight = Daylight::of(std::slice::from_ref(&track), &[[TunnelEnd::Tunnel; 2]])
            .unwrap_or_default();
        // A place at the very begin may be before the plane across its first piece.
        for k in 0..2000 {
            let frame = track.alignment.at(1.0 + 0.099 * f64::from(k));
            for l_m in [-25.0, -5.0, 0.0, 5.0, 25.0] {
                let place = frame.world_from_section(l_m, 1.0);
                assert!(daylight.reaches(&place), "{l_m} {:?}", frame.s_m);
            }
        }
    }
}
