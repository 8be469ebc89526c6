//! Which places a radar sees: neither tunnel nor bodies in between. What is hidden gives nothing; waves do not bend here.

use crate::twin::geometry::{Body, RayStart, Solid, TunnelCaster};
use crate::twin::physics::BodyOwner;
use nalgebra::{Point3, Vector3};

/// A place counts as reached so far before it, metres: centres lie on surfaces.
const NEAR_M: f64 = 0.05;
/// Walls are met as far from where a plane has them as an outline's chords lie off its arcs, and more where the line curves.
const WALL_M: f64 = 0.1;

/// A body with its owner, at the time of a frame.
pub struct OwnedBody<'a> {
    /// The body.
    pub body: &'a Body,
    /// What it belongs to.
    pub owner: BodyOwner,
}

/// What is between places.
pub struct RadarSight<'a> {
    caster: &'a TunnelCaster,
    bodies: Vec<(OwnedBody<'a>, f64)>,
    radar: Point3<f64>,
    begin: RayStart,
}

impl<'a> RadarSight<'a> {
    /// From a radar at a place, among bodies.
    pub fn new(
        caster: &'a TunnelCaster,
        bodies: impl IntoIterator<Item = OwnedBody<'a>>,
        (radar, near): (Point3<f64>, Option<RayStart>),
    ) -> Self {
        let with_size = |seen: OwnedBody<'a>| {
            let size_m = seen.body.shape.half_extents_m().norm();
            (seen, size_m)
        };
        Self {
            begin: caster.ray_start(&radar, near),
            bodies: bodies.into_iter().map(with_size).collect(),
            caster,
            radar,
        }
    }

    /// Where rays from the radar begin.
    pub fn begin(&self) -> RayStart {
        self.begin
    }

    /// The radar's place.
    pub fn radar(&self) -> Point3<f64> {
        self.radar
    }

    /// Whether the radar sees a place; the bodies of an owner are no hindrance.
    pub fn sees(&self, place: &Point3<f64>, without: Option<BodyOwner>) -> bool {
        self.is_free((&self.radar, self.begin), place, without)
    }

    /// Whether two places see each other.
    pub fn is_between_free(
        &self,
        from: &Point3<f64>,
        to: &Point3<f64>,
        without: Option<BodyOwner>,
    ) -> bool {
        let begin = self.caster.ray_start(from, Some(self.begin));
        self.is_free((from, begin), to, without)
    }

    fn is_free(
        &self,
        (from, begin): (&Point3<f64>, RayStart),
        to: &Point3<f64>,
        without: Option<BodyOwner>,
    ) -> bool {
        let way = to - from;
        let length_m = way.norm();
        if length_m < NEAR_M {
            return true;
        }
        let direction = way / length_m;
        let reach_m = length_m - NEAR_M;
        !self.is_body_before(from, &direction, reach_m, without)
            && self.caster.cast(begin, from, &direction, reach_m).is_none()
    }

    fn is_body_before(
        &self,
        from: &Point3<f64>,
        direction: &Vector3<f64>,
        reach_m: f64,
        without: Option<BodyOwner>,
    ) -> bool {
        let mut others = self
            .bodies
            .iter()
            .filter(|(seen, _)| Some(seen.owner) != without);
        others.any(|(seen, size_m)| {
            let away = seen.body.world_from_body.translation.vector - from.coords;
            let along = away.dot(direction).clamp(0.0, reach_m);
            (away - direction * along).norm() <= *size_m
                && Solid::at(seen.body, 0.0)
                    .cast(from, direction)
                    .is_some_and(|(t, _)| t < reach_m)
        })
    }

    /// Whether the first thing that the radar meets towards a place is the tunnel's surface there.
    pub fn meets_wall_at(&self, place: &Point3<f64>) -> bool {
        let way = place - self.radar;
        let length_m = way.norm();
        let Some(direction) = way.try_normalize(NEAR_M) else {
            return false;
        };
        let hit = self
            .caster
            .cast(self.begin, &self.radar, &direction, length_m + 10.0);
        let Some(hit) = hit else {
            return false;
        };
        let surface = self.caster.surface_at(&self.radar, &direction, &hit);
        let off_m = surface.normal.dot(&(surface.position - place)).abs();
        off_m < WALL_M
            && (hit.t - length_m).abs() < 10.0
            && !self.is_body_before(&self.radar, &direction, length_m - NEAR_M, None)
    }
}
