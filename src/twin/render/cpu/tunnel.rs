//! A ray down the tunnel.
//!
//! The tunnel is a chain of slabs between the vertical planes across the line at its stations,
//! one a metre and where a cross-section ends. Inside a slab the surface is ruled from station to station, so in the slab's own
//! axes (x along the chord, y left, z up less the slope) it is a prism over the outline. A ray is
//! followed from slab to slab; in each it is a straight line in the plane across.
//!
//! Calling the slab a prism leaves out two things: the cosine of half the turn between stations
//! (1.4e-6 of the lateral distance at a radius of 300 m), and the difference of slope times chord
//! between inner and outer side (0.15 mm at 30 permille and that radius). Where two cross-sections
//! meet, the step between them is not drawn and stays dark.

use super::outline::Outline;
use crate::track::{Material, Tunnel};
use crate::twin::render::surface::RING_M;
use nalgebra::{Point3, Vector2, Vector3};

/// The swept tunnel with its rails, ready for rays.
#[derive(Clone, Debug)]
pub struct TunnelCaster {
    stations: Vec<Station>,
    slabs: Vec<Slab>,
    outlines: Vec<Outline>,
}

#[derive(Clone, Debug)]
struct Station {
    s_m: f64,
    origin: Point3<f64>,
    /// Up the line in plan: the normal of the station's plane.
    forward: Vector2<f64>,
}

#[derive(Clone, Debug)]
struct Slab {
    chord: Vector2<f64>,
    left: Vector2<f64>,
    /// Rise over run from station to station.
    slope: f64,
    outline: Option<usize>,
}

/// Where a ray met the tunnel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strike {
    /// Along the ray, in lengths of its direction.
    pub t: f64,
    pub(super) slab: u32,
    edge: u16,
}

/// The surface at a strike.
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
    /// Along the outline from its first point.
    pub q_m: f64,
    /// What it is made of.
    pub material: Material,
    /// Which of the tunnel's section ranges it belongs to.
    pub range: usize,
    /// How s and q grow with the position, per metre.
    pub(super) gradients: [Vector3<f64>; 2],
}

impl SurfacePoint {
    /// Up the line.
    pub(super) fn along(&self) -> Vector3<f64> {
        self.gradients[0]
    }
}

/// A slab begins this much early, so that rounding opens no crack between two of them.
const OVERLAP_M: f64 = 0.05;

fn plan(v: Vector3<f64>) -> Vector2<f64> {
    v.xy()
}

impl TunnelCaster {
    /// Sweeps the cross-sections of a tunnel along its line.
    pub fn new(tunnel: &Tunnel) -> Self {
        let stations: Vec<_> = station_chainages(tunnel)
            .into_iter()
            .map(|s_m| {
                let frame = tunnel.alignment.at(s_m);
                let (sin, cos) = frame.heading_rad.sin_cos();
                Station {
                    s_m,
                    origin: frame.origin,
                    forward: Vector2::new(cos, sin),
                }
            })
            .collect();
        let slabs = stations
            .windows(2)
            .map(|pair| {
                let mid = 0.5 * (pair[0].s_m + pair[1].s_m);
                let step = pair[1].origin - pair[0].origin;
                let length = plan(step).norm();
                let chord = plan(step) / length;
                Slab {
                    chord,
                    left: Vector2::new(-chord.y, chord.x),
                    slope: step.z / length,
                    outline: tunnel
                        .sections
                        .iter()
                        .position(|r| r.from_m <= mid && mid < r.to_m),
                }
            })
            .collect();
        Self {
            stations,
            slabs,
            outlines: tunnel
                .sections
                .iter()
                .map(|r| Outline::new(&r.section))
                .collect(),
        }
    }

    /// Whether the surface at a strike lies level and may mirror: bed, or top of a rail.
    pub(super) fn is_level(&self, strike: &Strike) -> bool {
        let outline = self.slabs[strike.slab as usize].outline;
        outline.is_some_and(|range| {
            let edge = &self.outlines[range].edges[strike.edge as usize];
            edge.normal.y > 0.5 && matches!(edge.material, Material::Bed | Material::Rail)
        })
    }

    /// How many slabs there are.
    pub(super) fn slabs(&self) -> usize {
        self.slabs.len()
    }

    /// Where a slab begins.
    pub(super) fn chainage_m(&self, slab: usize) -> f64 {
        self.stations[slab].s_m
    }

    /// A ball around a slab's surface.
    pub(super) fn slab_ball(&self, slab: usize) -> (Point3<f64>, f64) {
        let [near, far] = [0, 1].map(|k| self.stations[slab + k].origin);
        let (up_m, radius_m) = self.slabs[slab]
            .outline
            .map_or((0.0, 0.0), |i| self.outlines[i].disc());
        let middle = nalgebra::center(&near, &far) + Vector3::z() * up_m;
        (middle, radius_m + (far - near).norm())
    }

    /// The slab that a place is in: from a slab close by, or else by search for the nearest
    /// station.
    pub fn slab_of(&self, p: &Point3<f64>, near: Option<usize>) -> usize {
        let mut k = near
            .unwrap_or_else(|| self.nearest(p))
            .min(self.slabs.len() - 1);
        for _ in 0..self.slabs.len() {
            if k > 0 && self.ahead_of(k, p) < 0.0 {
                k -= 1;
            } else if k + 1 < self.slabs.len() && self.ahead_of(k + 1, p) >= 0.0 {
                k += 1;
            } else {
                break;
            }
        }
        k
    }

    fn nearest(&self, p: &Point3<f64>) -> usize {
        let away = |k: &usize| (p - self.stations[*k].origin).norm_squared();
        (0..self.stations.len())
            .min_by(|a, b| away(a).total_cmp(&away(b)))
            .unwrap_or(0)
    }

    /// Distance of a place up the line from the plane of a station.
    fn ahead_of(&self, station: usize, p: &Point3<f64>) -> f64 {
        let s = &self.stations[station];
        s.forward.dot(&plan(p - s.origin))
    }

    /// First surface that the ray o + t d meets for t up to `reach`; `slab` is that of o. Rays
    /// from outside the line's ends meet nothing.
    pub fn cast(
        &self,
        slab: usize,
        o: &Point3<f64>,
        d: &Vector3<f64>,
        reach: f64,
    ) -> Option<Strike> {
        if slab >= self.slabs.len()
            || self.ahead_of(slab, o) < -1e-6
            || self.ahead_of(slab + 1, o) > 1e-6
        {
            return None;
        }
        let (d2, overlap) = (plan(*d), OVERLAP_M / d.norm());
        let (mut k, mut entry) = (slab, 0.0f64);
        // Each station's plane is crossed once; the bound is for rays that are not numbers.
        for _ in 0..self.slabs.len() {
            let exit_down = exit(-self.ahead_of(k, o), -self.stations[k].forward.dot(&d2));
            let exit_up = exit(
                self.ahead_of(k + 1, o),
                self.stations[k + 1].forward.dot(&d2),
            );
            let leave = exit_up.min(exit_down);
            let (o_across, d_across) = self.across(k, o, d);
            let (from, to) = ((entry - overlap).max(0.0), leave.min(reach));
            if let Some(i) = self.slabs[k].outline
                && let Some((t, edge)) = self.outlines[i].first_hit(&o_across, &d_across, from, to)
            {
                return Some(Strike {
                    t,
                    slab: k as u32,
                    edge,
                });
            }
            if leave >= reach {
                return None;
            }
            let next = if exit_up < exit_down {
                k + 1
            } else {
                k.wrapping_sub(1)
            };
            let beyond = self.slabs.get(next)?;
            if beyond.outline != self.slabs[k].outline
                && let Some(i) = beyond.outline
                && !self.outlines[i].contains(&(o_across + d_across * leave))
            {
                return None;
            }
            (k, entry) = (next, leave);
        }
        None
    }

    /// A ray in the plane across a slab's chord.
    fn across(&self, k: usize, o: &Point3<f64>, d: &Vector3<f64>) -> (Vector2<f64>, Vector2<f64>) {
        let slab = &self.slabs[k];
        let v = o - self.stations[k].origin;
        let (v2, d2) = (plan(v), plan(*d));
        (
            Vector2::new(slab.left.dot(&v2), v.z - slab.slope * slab.chord.dot(&v2)),
            Vector2::new(slab.left.dot(&d2), d.z - slab.slope * slab.chord.dot(&d2)),
        )
    }

    /// The surface where the ray o + t d struck.
    pub fn surface_at(&self, o: &Point3<f64>, d: &Vector3<f64>, strike: &Strike) -> SurfacePoint {
        let k = strike.slab as usize;
        let slab = &self.slabs[k];
        let (o_across, d_across) = self.across(k, o, d);
        let position = o + d * strike.t;
        let lh = o_across + d_across * strike.t;
        let (near_m, far_m) = (self.stations[k].s_m, self.stations[k + 1].s_m);
        let (past, before) = (
            self.ahead_of(k, &position),
            -self.ahead_of(k + 1, &position),
        );
        let range = slab.outline.unwrap_or(0);
        let edge = &self.outlines[range].edges[strike.edge as usize];
        // Across the edge and across the ruling, which climbs with the slope.
        let (n, along) = (edge.normal, -edge.normal.y * slab.slope);
        let level = slab.left * n.x + slab.chord * along;
        SurfacePoint {
            position,
            normal: Vector3::new(level.x, level.y, n.y).normalize(),
            s_m: near_m + (far_m - near_m) * past / (past + before),
            l_m: lh.x,
            q_m: edge.q_m + edge.along.dot(&(lh - edge.start)),
            material: edge.material,
            range,
            gradients: [
                Vector3::new(slab.chord.x, slab.chord.y, 0.0)
                    * ((far_m - near_m) / (past + before)),
                Self::up_edge(slab, &edge.along),
            ],
        }
    }

    /// How metres along an edge grow with the position: the transpose of what
    /// [`Self::across`] does to directions.
    fn up_edge(slab: &Slab, along: &Vector2<f64>) -> Vector3<f64> {
        let level = slab.left * along.x - slab.chord * (slab.slope * along.y);
        Vector3::new(level.x, level.y, along.y)
    }
}

/// Multiples of the ring length, and the ends of cross-sections, which may lie between them.
fn station_chainages(tunnel: &Tunnel) -> Vec<f64> {
    let begin = tunnel.sections.first().map_or(0.0, |r| r.from_m);
    let end = tunnel.sections.last().map_or(0.0, |r| r.to_m);
    let (first, last) = (
        (begin / RING_M).ceil() as i64,
        (end / RING_M).floor() as i64,
    );
    let rings = (first..=last).map(|k| k as f64 * RING_M);
    let ends = tunnel.sections.iter().flat_map(|r| [r.from_m, r.to_m]);
    let mut all: Vec<f64> = rings.chain(ends).collect();
    all.sort_by(f64::total_cmp);
    all.dedup_by(|b, a| *b - *a < 1e-6);
    all
}

/// When a point `past` a plane and going past it at `speed` crossed or will cross it.
fn exit(past: f64, speed: f64) -> f64 {
    if speed > 0.0 {
        -past / speed
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests;
