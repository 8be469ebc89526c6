//! What a ray finds where it meets the tunnel of a track.

use super::track_caster::{Surface, TrackCaster, TrackHit};
use crate::track::Material;
use nalgebra::{Point3, Vector3};

/// The surface at a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// In the world.
    pub position: Point3<f64>,
    /// Unit normal of the facet, towards free space.
    pub normal: Vector3<f64>,
    /// Chainage.
    pub s_m: f64,
    /// Left of the centreline.
    pub l_m: f64,
    /// Where its paint is on the painting: along the line and along the outline from its first point.
    pub painted_m: [f64; 2],
    /// What it is made of.
    pub material: Material,
    /// Which track it belongs to.
    pub track: usize,
    /// Which of that track's section ranges.
    pub range: usize,
    /// The one whose paint it bears.
    pub painted_range: usize,
    /// How the place of its paint grows with the position, per metre.
    pub gradients: [Vector3<f64>; 2],
}

impl SurfacePoint {
    /// Up the line, for a surface along it.
    pub fn along(&self) -> Vector3<f64> {
        self.gradients[0]
    }
}

impl TrackCaster {
    /// The surface where the ray o + t d hit.
    pub(super) fn surface_at(
        &self,
        o: &Point3<f64>,
        d: &Vector3<f64>,
        hit: &TrackHit,
    ) -> SurfacePoint {
        let edge = match hit.on {
            Surface::EndWall(number) => return self.end_wall_surface(o, d, hit, number),
            Surface::Edge(edge) => usize::from(edge),
        };
        let k = hit.segment as usize;
        let segment = &self.segments[k];
        let (o_across, d_across) = self.across(k, o, d);
        let position = o + d * hit.t;
        let lh = o_across + d_across * hit.t;
        let (near_m, far_m) = (self.stations[k].s_m, self.stations[k + 1].s_m);
        let (past, before) = (
            self.ahead_of(k, &position),
            -self.ahead_of(k + 1, &position),
        );
        let s_m = near_m + (far_m - near_m) * past / (past + before);
        let range = segment.section.unwrap_or(0);
        let edge = &self.sections[range].edges[edge];
        // Across the edge and across the ruling, which climbs with the slope.
        let (n, along) = (edge.normal, -edge.normal.y * segment.slope);
        let level = segment.left * n.x + segment.chord * along;
        // How metres along the edge grow with the position: the transpose of what
        // [`Self::across`] does to directions.
        let climb = segment.slope * edge.along.y;
        let up_edge = segment.left * edge.along.x - segment.chord * climb;
        SurfacePoint {
            position,
            normal: Vector3::new(level.x, level.y, n.y).normalize(),
            s_m,
            l_m: lh.x,
            painted_m: [s_m, edge.q_m + edge.along.dot(&(lh - edge.start))],
            material: edge.material,
            track: 0,
            range,
            painted_range: range,
            gradients: [
                Vector3::new(segment.chord.x, segment.chord.y, 0.0)
                    * ((far_m - near_m) / (past + before)),
                Vector3::new(up_edge.x, up_edge.y, edge.along.y),
            ],
        }
    }
    fn end_wall_surface(
        &self,
        o: &Point3<f64>,
        d: &Vector3<f64>,
        hit: &TrackHit,
        number: u16,
    ) -> SurfacePoint {
        let (station, wall) = &self.end_walls[usize::from(number)];
        let plane = self.plane(*station);
        let position = o + d * hit.t;
        let (l_m, h_m) = plane.across(&position);
        SurfacePoint {
            position,
            normal: wall.normal(&plane.forward),
            s_m: wall.s_m,
            l_m,
            painted_m: wall.paint.place_m(wall.s_m, l_m, h_m),
            material: Material::Lining,
            track: 0,
            range: wall.range,
            painted_range: wall.paint.of_range,
            gradients: [plane.left(), Vector3::z() * wall.paint.rise],
        }
    }
}
