//! Cross-sections and rails swept along the alignment into triangles, in world coordinates.
//!
//! Rings stand at whole multiples of the step, at the window's ends and where sections change,
//! so windows that join share their rings. Where one section follows another of a different
//! shape, a portal face closes the gap between the two outlines.
//!
//! A chord of length d across an arc of radius R is d^2 / 8R away from it: 0.36 mm for rings 1 m
//! apart on 350 m.

use super::Tunnel;
use super::alignment::TrackFrame;
use super::gauge::{RAIL_CENTRE_M, RAIL_FOOT_M, RAIL_WIDTH_M};
use super::section::{CrossSection, Edge, Material, OutlinePoint};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

/// Distance of rings for pictures.
pub const RING_M: f64 = 1.0;
/// Edges of one material that meet at less than this angle are shaded as one curved surface.
const SMOOTH_RAD: f64 = 0.35;
/// All section builders leave this point (l, h) inside and see their whole outline from it.
const HUB: (f64, f64) = (0.0, 2.0);

/// Triangles with what a renderer needs at each vertex. All lists but `triangles` are as long as
/// each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// World.
    pub positions: Vec<Point3<f64>>,
    /// Unit normals into the tunnel, world.
    pub normals: Vec<Vector3<f64>>,
    /// What the surface is made of.
    pub materials: Vec<Material>,
    /// Chainage.
    pub s_m: Vec<f64>,
    /// Along the outline from its first point.
    pub q_m: Vec<f64>,
    /// Left of the centreline.
    pub l_m: Vec<f64>,
    /// Above top of rail.
    pub h_m: Vec<f64>,
    /// Vertices of each triangle, counter-clockwise as seen from inside the tunnel.
    pub triangles: Vec<[u32; 3]>,
}

/// Sweeps everything between two chainages, with rings at multiples of `step_m`. Beyond the ends
/// of the line its first and last sections go on. Empty where the window is empty, not finite, or
/// would take more than a million rings.
///
/// ```
/// use metrotwin::track::{Tunnel, sweep};
///
/// let tunnel = Tunnel::from_toml("name = 'short'\n[[plan]]\nkind = 'straight'\nlength_m = 20.0")?;
/// let mesh = sweep(&tunnel, 0.0, 20.0, 1.0);
/// assert_eq!(mesh.positions.len(), mesh.normals.len());
/// # Ok::<(), metrotwin::track::TunnelError>(())
/// ```
pub fn sweep(tunnel: &Tunnel, from_m: f64, to_m: f64, step_m: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let sensible = from_m < to_m && step_m > 0.0 && (to_m - from_m) / step_m < 1e6;
    if !sensible {
        return mesh;
    }
    let last = tunnel.sections.len().saturating_sub(1);
    for (k, range) in tunnel.sections.iter().enumerate() {
        let begin = if k == 0 {
            from_m
        } else {
            range.from_m.max(from_m)
        };
        let end = if k == last {
            to_m
        } else {
            range.to_m.min(to_m)
        };
        if begin >= end {
            continue;
        }
        let frames: Vec<TrackFrame> = rings(begin, end, step_m)
            .map(|s| tunnel.alignment.at(s))
            .collect();
        let edges: Vec<Edge> = range.section.edges().collect();
        mesh.strips(&frames, &shaded(&edges, range.section.closed), |p, _| *p);
        for centre_m in [RAIL_CENTRE_M, -RAIL_CENTRE_M] {
            mesh.strips(&frames, &shaded(&rail(centre_m), false), canted);
        }
        if let Some(next) = tunnel.sections.get(k + 1)
            && range.to_m <= to_m
        {
            mesh.portal(
                &tunnel.alignment.at(range.to_m),
                &range.section,
                &next.section,
            );
        }
    }
    mesh
}

/// Chainages of rings: both ends and the multiples of the step between.
fn rings(from_m: f64, to_m: f64, step_m: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (
        (from_m / step_m).ceil() as i64,
        (to_m / step_m).floor() as i64,
    );
    // A multiple that rounding sets next to an end would make a ring of no length.
    let inner = (first..=last)
        .map(move |k| k as f64 * step_m)
        .filter(move |s| *s > from_m + 1e-6 && *s < to_m - 1e-6);
    std::iter::once(from_m)
        .chain(inner)
        .chain(std::iter::once(to_m))
}

/// The three visible faces of a rail, normals outward.
fn rail(centre_m: f64) -> Vec<Edge> {
    let (left, right) = (centre_m + 0.5 * RAIL_WIDTH_M, centre_m - 0.5 * RAIL_WIDTH_M);
    let corners = [
        OutlinePoint::new(left, RAIL_FOOT_M),
        OutlinePoint::new(left, 0.0),
        OutlinePoint::new(right, 0.0),
        OutlinePoint::new(right, RAIL_FOOT_M),
    ];
    corners
        .windows(2)
        .map(|w| Edge {
            a: w[0],
            b: w[1],
            material: Material::Rail,
        })
        .collect()
}

/// Heads of rails follow the cant, their feet stay on the bed.
fn canted(p: &OutlinePoint, frame: &TrackFrame) -> OutlinePoint {
    if p.h_m > 0.5 * RAIL_FOOT_M {
        OutlinePoint::new(p.l_m, p.h_m + p.l_m * frame.roll_rad.sin())
    } else {
        *p
    }
}

/// An edge with the normals (l, h) at its ends and where it starts along the outline.
struct Shaded {
    edge: Edge,
    normals: [(f64, f64); 2],
    q_m: f64,
}

fn shaded(edges: &[Edge], closed: bool) -> Vec<Shaded> {
    let n = edges.len();
    let mut q_m = 0.0;
    (0..n)
        .map(|k| {
            let edge = edges[k];
            let own = edge.normal();
            let towards = |other: Option<&Edge>| match other {
                Some(o) if o.material == edge.material => smooth(own, o.normal()),
                _ => own,
            };
            let before = if k > 0 || closed {
                edges.get((k + n - 1) % n)
            } else {
                None
            };
            let after = if k + 1 < n || closed {
                edges.get((k + 1) % n)
            } else {
                None
            };
            let shaded = Shaded {
                edge,
                normals: [towards(before), towards(after)],
                q_m,
            };
            q_m += edge.length_m();
            shaded
        })
        .collect()
}

/// The mean of two normals, or the first where they differ too much for one surface.
fn smooth(own: (f64, f64), other: (f64, f64)) -> (f64, f64) {
    if own.0 * other.0 + own.1 * other.1 < SMOOTH_RAD.cos() {
        return own;
    }
    let (l, h) = (own.0 + other.0, own.1 + other.1);
    let length = l.hypot(h);
    (l / length, h / length)
}

impl Mesh {
    /// One strip of quads along the frames for every edge.
    fn strips(
        &mut self,
        frames: &[TrackFrame],
        edges: &[Shaded],
        place: impl Fn(&OutlinePoint, &TrackFrame) -> OutlinePoint,
    ) {
        for shaded in edges {
            let base = self.positions.len() as u32;
            let Shaded { edge, normals, q_m } = shaded;
            for frame in frames {
                let ends = [
                    (edge.a, normals[0], *q_m),
                    (edge.b, normals[1], q_m + edge.length_m()),
                ];
                for (p, normal, q_m) in ends {
                    let at = place(&p, frame);
                    self.vertex(
                        frame,
                        at,
                        surface_normal(frame, at, normal),
                        edge.material,
                        q_m,
                    );
                }
            }
            for k in 1..frames.len() as u32 {
                let (a0, a1) = (base + 2 * (k - 1), base + 2 * k);
                self.triangles.push([a0, a0 + 1, a1 + 1]);
                self.triangles.push([a0, a1 + 1, a1]);
            }
        }
    }

    fn vertex(
        &mut self,
        frame: &TrackFrame,
        p: OutlinePoint,
        normal: Vector3<f64>,
        material: Material,
        q_m: f64,
    ) {
        self.positions.push(frame.world_from_section(p.l_m, p.h_m));
        self.normals.push(normal);
        self.materials.push(material);
        self.s_m.push(frame.s_m);
        self.q_m.push(q_m);
        self.l_m.push(p.l_m);
        self.h_m.push(p.h_m);
    }

    /// The face between the outlines of two sections, in the plane where they meet. Both are
    /// seen whole from the hub, so between two neighbouring corners (by angle) each is straight
    /// and the face is a quadrilateral there.
    fn portal(&mut self, frame: &TrackFrame, before: &CrossSection, after: &CrossSection) {
        if !(before.closed && after.closed) || before == after {
            return;
        }
        let forward = frame.ahead();
        for (a0, a1) in wedges(before, after) {
            // Just inside the wedge, so that a wall along a ray is met on the right side.
            let (a0, a1) = (a0 + 1e-9, a1 - 1e-9);
            let corners = |section| Some((seen(section, a0)?, seen(section, a1)?));
            let (Some(b), Some(c)) = (corners(before), corners(after)) else {
                continue;
            };
            let excess = reach(c.0) + reach(c.1) - reach(b.0) - reach(b.1);
            if excess.abs() < 1e-6 {
                continue;
            }
            // The face looks into the wider section.
            let (inner, outer, normal) = if excess > 0.0 {
                (b, c, forward)
            } else {
                (c, b, -forward)
            };
            let base = self.positions.len() as u32;
            for p in [inner.0, outer.0, outer.1, inner.1] {
                self.vertex(frame, p, normal, Material::Lining, p.l_m - inner.0.l_m);
            }
            // Angles count from l to h, clockwise when looked at up the line.
            let turned = if excess > 0.0 {
                [0, 1, 2, 3]
            } else {
                [3, 2, 1, 0]
            };
            let [p, q, r, s] = turned.map(|k| base + k);
            self.triangles.push([p, q, r]);
            self.triangles.push([p, r, s]);
        }
    }
}

/// Where the ray from the hub at an angle (from l to h) meets an outline.
fn seen(section: &CrossSection, angle: f64) -> Option<OutlinePoint> {
    let (sin, cos) = angle.sin_cos();
    let r = section.ray(HUB, (cos, sin))?;
    Some(OutlinePoint::new(HUB.0 + r * cos, HUB.1 + r * sin))
}

/// Distance from the hub.
fn reach(p: OutlinePoint) -> f64 {
    (p.l_m - HUB.0).hypot(p.h_m - HUB.1)
}

/// Angles around the hub between which both outlines are straight and do not cross.
fn wedges(before: &CrossSection, after: &CrossSection) -> Vec<(f64, f64)> {
    let mut angles: Vec<f64> = before
        .points
        .iter()
        .chain(&after.points)
        .map(|p| (p.h_m - HUB.1).atan2(p.l_m - HUB.0))
        .collect();
    angles.sort_by(f64::total_cmp);
    angles.dedup_by(|a, b| (*a - *b).abs() < 1e-8);
    let around = angles.first().map(|a| a + TAU);
    let next = angles.iter().skip(1).copied().chain(around);
    let mut wedges = Vec::with_capacity(2 * angles.len());
    for (from, to) in angles.iter().copied().zip(next) {
        match crossing(before, after, from + 1e-9, to - 1e-9) {
            Some(at) => wedges.extend([(from, at), (at, to)]),
            None => wedges.push((from, to)),
        }
    }
    wedges
}

/// The angle at which two outlines cross, by bisection; `None` where one is outside at both ends.
fn crossing(before: &CrossSection, after: &CrossSection, from: f64, to: f64) -> Option<f64> {
    let excess = |a: f64| Some(reach(seen(after, a)?) - reach(seen(before, a)?));
    let (at_from, at_to) = (excess(from)?, excess(to)?);
    if at_from * at_to >= 0.0 {
        return None;
    }
    let (mut low, mut high) = (from, to);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if excess(middle)? * at_from > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}

/// A normal (l, h) of the outline as a normal of the swept surface: turned until it is
/// perpendicular to the line that a point of the outline draws.
fn surface_normal(frame: &TrackFrame, p: OutlinePoint, normal: (f64, f64)) -> Vector3<f64> {
    let run = (1.0 - frame.curvature_per_m * p.l_m).max(1e-3);
    let ahead = -normal.1 * frame.slope / run;
    let n = frame.left() * normal.0 + Vector3::z() * normal.1 + frame.ahead() * ahead;
    n.normalize()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::TrackPoint;

    fn chengdu() -> Tunnel {
        Tunnel::from_toml(include_str!("../../tunnels/chengdu_line1.toml")).unwrap()
    }

    fn corners(mesh: &Mesh, t: &[u32; 3]) -> [Point3<f64>; 3] {
        t.map(|i| mesh.positions[i as usize])
    }

    /// Provokes: wrong winding, normals into the rock, normals not of the surface (slope and
    /// curve left out), indices out of range.
    #[test]
    fn triangles_face_the_way_their_normals_point() {
        let mesh = sweep(&chengdu(), 0.0, 3000.0, 7.0);
        assert!(mesh.triangles.len() > 10_000);
        for t in &mesh.triangles {
            let [a, b, c] = corners(&mesh, t);
            let face = (b - a).cross(&(c - a));
            if face.norm() < 1e-6 {
                continue;
            }
            for i in t {
                let n = mesh.normals[*i as usize];
                assert!((n.norm() - 1.0).abs() < 1e-12);
                // Smooth shading turns normals by half a facet at most.
                let turned = face.normalize().dot(&n);
                let k = *i as usize;
                assert!(
                    turned > 0.98,
                    "{turned} {:?} at {}",
                    mesh.materials[k],
                    mesh.s_m[k]
                );
            }
        }
    }

    /// Provokes: positions that do not belong to their (s, l, h).
    #[test]
    fn vertices_stand_where_the_line_says() {
        let tunnel = chengdu();
        let mesh = sweep(&tunnel, 1700.0, 2500.0, 10.0);
        for k in 0..mesh.positions.len() {
            let p = tunnel.alignment.world_from_track(TrackPoint {
                s_m: mesh.s_m[k],
                l_m: mesh.l_m[k],
                h_m: mesh.h_m[k],
            });
            assert!((p - mesh.positions[k]).norm() < 1e-9);
        }
    }

    /// Area of a straight circular tunnel is its outline times its length; a hole or a double
    /// face changes it.
    #[test]
    fn val_area_of_a_straight_tube() {
        let text = "name = 't'\n[[plan]]\nkind = 'straight'\nlength_m = 40.0";
        let tunnel = Tunnel::from_toml(text).unwrap();
        let mesh = sweep(&tunnel, 5.0, 35.5, 1.0);
        let area: f64 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = corners(&mesh, t);
                0.5 * (b - a).cross(&(c - a)).norm()
            })
            .sum();
        let outline: f64 = tunnel.sections[0]
            .section
            .edges()
            .map(|e| e.length_m())
            .sum();
        let rails = 2.0 * (RAIL_WIDTH_M - 2.0 * RAIL_FOOT_M);
        assert!((area - (outline + rails) * 30.5).abs() < 1e-9);
    }

    /// The portal's area is the difference of what the sections enclose and do not share.
    #[test]
    fn portals_close_the_gap_between_sections() {
        let tunnel = chengdu();
        let window = sweep(&tunnel, 59.0, 61.0, 1.0);
        let faces = window.triangles.iter().filter(|t| {
            t.iter()
                .all(|i| (window.s_m[*i as usize] - 60.0).abs() < 1e-9)
        });
        let (mut up, mut down) = (0.0, 0.0);
        for t in faces {
            let [a, b, c] = corners(&window, t);
            let face = (b - a).cross(&(c - a)) * 0.5;
            let along = face.dot(&tunnel.alignment.at(60.0).ahead());
            if along > 0.0 {
                up += along
            } else {
                down -= along
            }
        }
        // Sampled on a grid of 1 cm.
        let (circle, station) = (&tunnel.sections[0].section, &tunnel.sections[1].section);
        let (mut only_station, mut only_circle) = (0.0, 0.0);
        for i in -700..400 {
            for k in -50..600 {
                let (l, h) = (0.01 * f64::from(i) + 0.005, 0.01 * f64::from(k) + 0.005);
                match (circle.contains(l, h), station.contains(l, h)) {
                    (false, true) => only_station += 1e-4,
                    (true, false) => only_circle += 1e-4,
                    _ => {}
                }
            }
        }
        assert!((up - only_station).abs() < 0.02, "{up} {only_station}");
        assert!((down - only_circle).abs() < 0.02, "{down} {only_circle}");
    }

    /// Provokes: panics and endless rings on windows that make no sense.
    #[test]
    fn senseless_windows_are_empty() {
        let tunnel = chengdu();
        for (a, b, step) in [
            (10.0, 10.0, 1.0),
            (20.0, 10.0, 1.0),
            (0.0, 10.0, 0.0),
            (0.0, f64::NAN, 1.0),
            (f64::NEG_INFINITY, 0.0, 1.0),
            (0.0, 1e3, 1e-9),
        ] {
            assert!(sweep(&tunnel, a, b, step).triangles.is_empty());
        }
    }

    /// Provokes: rails that ignore the cant: on the 350 m curve to the right the left rail is
    /// 115 mm (over 1500 mm) higher.
    #[test]
    fn rails_carry_the_cant() {
        let mesh = sweep(&chengdu(), 1900.0, 1901.0, 1.0);
        let top = |left: bool| {
            (0..mesh.positions.len())
                .filter(|k| mesh.materials[*k] == Material::Rail && (mesh.l_m[*k] > 0.0) == left)
                .map(|k| (mesh.h_m[k], mesh.l_m[k]))
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap()
        };
        let ((high, l), (low, _)) = (top(true), top(false));
        assert!((high - l * 0.115 / 1.5).abs() < 1e-9 && low < 0.0);
    }
}
