//! Tunnel and rails cut into chunks along the line, lit by the lamps, each meshed once.

use super::layout::{STAIN_NONE, STAIN_SOME, Vertex};
use super::mesh::Mesh;
use crate::track::{
    CrossSection, Edge, OutlinePoint, RAIL_OFFSET_M, SectionRange, TrackPoint, Tunnel, rail_outline,
};
use crate::twin::random::pcg4d;
use crate::twin::render::light::LampField;
use crate::twin::render::surface;
use crate::twin::render::surface::STAIN_CELL_M;
use nalgebra::{Point3, Vector2, Vector3};

/// Length of a chunk: a whole number of rings, joints, sleepers and stain cells, so that every
/// pattern starts afresh at a chunk's origin and chainage stays exact in f32.
pub const CHUNK_M: f64 = 15.0;

/// A cell of the mesh is halved until it is smaller than this share of its distance from the
/// nearest lamp: light falls with a power of that distance, and is interpolated over the cell.
const CELL_PER_LAMP_DISTANCE: f64 = 0.25;
/// No cell is smaller, however near its lamp.
const FINEST_CELL_M: f64 = 0.06;

/// How finely a chunk is meshed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// Every ring halved: where the rolling shutter bends what is straight.
    Near,
    /// Ring by ring.
    Middle,
    /// Stations far apart and no stains: no pixel resolves them from there.
    Far,
}

impl Detail {
    fn step_m(self) -> f64 {
        match self {
            Self::Near => 0.5 * surface::RING_M,
            Self::Middle => surface::RING_M,
            Self::Far => 5.0 * surface::RING_M,
        }
    }
}

/// Which mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ChunkKey {
    /// Covers chainage from `index * CHUNK_M` over `CHUNK_M`.
    pub index: i64,
    /// How fine.
    pub detail: Detail,
}

impl ChunkKey {
    /// Chainage of its origin.
    pub fn start_m(self) -> f64 {
        self.index as f64 * CHUNK_M
    }
}

/// A strip along the line between two corners of an outline.
struct Facet {
    ends: [OutlinePoint; 2],
    q_m: [f64; 2],
    albedo: f64,
    material: u32,
    pulse: u32,
}

impl Facet {
    /// Row of stain cells that it lies in.
    fn stain_row(&self) -> f64 {
        (0.5 * (self.q_m[0] + self.q_m[1]) / STAIN_CELL_M).floor()
    }

    /// Stains at the corners of the stain cells `column` and the next.
    fn stains(&self, column: f64) -> [u16; 8] {
        let row = self.stain_row();
        let corner = |i: u32, j: u32| {
            let at = [column + f64::from(i), row + f64::from(j)].map(|x| x as i64 as u32);
            (pcg4d([at[0], at[1], self.material, 0])[0] >> 16) as u16
        };
        let [a, b] = [0, 1].map(|j| [0, 1, 2].map(|i| corner(i, j)));
        [a[0], a[1], a[2], b[0], b[1], b[2], STAIN_SOME, 0]
    }
}

/// Origin and mesh of a chunk; empty where there is no tunnel.
pub fn chunk_mesh(tunnel: &Tunnel, lamps: &LampField, key: ChunkKey) -> (Point3<f64>, Mesh) {
    let (from_m, to_m) = (key.start_m(), key.start_m() + CHUNK_M);
    let origin = tunnel.alignment.at(from_m).origin;
    let near = lamps_near(tunnel, lamps, key);
    let mut mesh = Mesh::default();
    for range in &tunnel.sections {
        let stations = stations(range, from_m, to_m, key.detail.step_m());
        if stations.len() < 2 {
            continue;
        }
        for facet in facets_of(range, &near) {
            add_strip(
                &mut mesh, tunnel, lamps, &near, &facet, &stations, key, &origin,
            );
        }
    }
    (origin, mesh)
}

/// Where lamps are that a chunk may need finer cells for.
fn lamps_near(tunnel: &Tunnel, lamps: &LampField, key: ChunkKey) -> Vec<TrackPoint> {
    let middle_m = key.start_m() + 0.5 * CHUNK_M;
    let middle = tunnel.alignment.at(middle_m).origin;
    lamps
        .near(&middle)
        .map(|lamp| tunnel.alignment.track_from_world(&lamp.centre, middle_m))
        .collect()
}

/// Halves the interval `[from, to]` until every piece `fits`; puts the ends of the pieces into
/// `cuts`, all but the first. Cuts of coarser pieces are among those of finer ones.
fn halve(from: f64, to: f64, fits: &impl Fn(f64, f64) -> bool, cuts: &mut Vec<f64>) {
    if fits(from, to) {
        cuts.push(to);
        return;
    }
    let middle = 0.5 * (from + to);
    halve(from, middle, fits, cuts);
    halve(middle, to, fits, cuts);
}

/// Whether light varies little over a cell this long, this far from a lamp.
fn is_fine(cell_m: f64, away_m: f64) -> bool {
    cell_m <= CELL_PER_LAMP_DISTANCE * away_m || cell_m < 2.0 * FINEST_CELL_M
}

/// The stations, with more of them where the line through `at` passes lamps. What shares the line
/// shares its stations, so that no gap opens between strips of different fineness.
fn finer_stations(stations: &[f64], at: OutlinePoint, near: &[TrackPoint]) -> Vec<f64> {
    let mut finer = vec![stations[0]];
    for pair in stations.windows(2) {
        let fits = |from_m: f64, to_m: f64| {
            near.iter().all(|lamp| {
                let along_m = (from_m - lamp.s_m).max(lamp.s_m - to_m).max(0.0);
                let across_m = (at.l_m - lamp.l_m).hypot(at.h_m - lamp.h_m);
                is_fine(to_m - from_m, along_m.hypot(across_m))
            })
        };
        halve(pair[0], pair[1], &fits, &mut finer);
    }
    finer
}

/// Ends of the range inside the chunk, and all multiples of `step_m` between them.
fn stations(range: &SectionRange, from_m: f64, to_m: f64, step_m: f64) -> Vec<f64> {
    let (from, to) = (from_m.max(range.from_m), to_m.min(range.to_m));
    if to <= from {
        return Vec::new();
    }
    let first = (from / step_m).floor() as i64 + 1;
    let last = (to / step_m).ceil() as i64;
    let inside = (first..last).map(|k| k as f64 * step_m);
    std::iter::once(from).chain(inside).chain([to]).collect()
}

fn facets_of(range: &SectionRange, near: &[TrackPoint]) -> Vec<Facet> {
    let mut facets = Vec::new();
    add_outline(&mut facets, &range.section, near);
    for centre_m in [RAIL_OFFSET_M, -RAIL_OFFSET_M] {
        add_outline(&mut facets, &rail_outline(centre_m), near);
    }
    facets
}

fn add_outline(facets: &mut Vec<Facet>, section: &CrossSection, near: &[TrackPoint]) {
    let mut q_m = 0.0;
    for edge in section.edges() {
        if edge.length_m() > 0.0 {
            cut_edge(facets, &edge, q_m, near);
        }
        q_m += edge.length_m();
    }
}

/// Cuts an edge into facets: where it leaves a row of stain cells, where the marks on it end, and
/// where it passes lamps.
fn cut_edge(facets: &mut Vec<Facet>, edge: &Edge, q_m: f64, near: &[TrackPoint]) {
    let (Edge { a, b, material }, length_m) = (*edge, edge.length_m());
    let look = surface::look(material);
    let lines = (q_m / STAIN_CELL_M).floor() as i64 + 1..;
    let mut cuts: Vec<f64> = lines
        .map(|k| (k as f64 * STAIN_CELL_M - q_m) / length_m)
        .take_while(|t| *t < 1.0)
        .collect();
    cuts.extend([0.0, 1.0]);
    if let Some(pulse) = look.pulse {
        let ends = [pulse.half_width_m, -pulse.half_width_m];
        cuts.extend(
            ends.map(|end| (end - a.l_m) / (b.l_m - a.l_m))
                .into_iter()
                .filter(|t| *t > 0.0 && *t < 1.0),
        );
    }
    cuts.sort_by(f64::total_cmp);
    let at = |t: f64| OutlinePoint {
        l_m: a.l_m + t * (b.l_m - a.l_m),
        h_m: a.h_m + t * (b.h_m - a.h_m),
    };
    let fits = |from: f64, to: f64| {
        let ends = [at(from), at(to)];
        near.iter()
            .all(|lamp| is_fine((to - from) * length_m, across_m(ends, lamp)))
    };
    let mut finer = vec![0.0];
    for pair in cuts.windows(2) {
        halve(pair[0], pair[1], &fits, &mut finer);
    }
    for pair in finer.windows(2) {
        let ends = [at(pair[0]), at(pair[1])];
        let middle_m = 0.5 * (ends[0].l_m + ends[1].l_m);
        let pulse = look
            .pulse
            .filter(|p| middle_m.abs() < p.half_width_m)
            .and_then(|p| surface::PULSES.iter().position(|q| *q == p))
            .map_or(0, |k| k as u32 + 1);
        facets.push(Facet {
            ends,
            q_m: [q_m + pair[0] * length_m, q_m + pair[1] * length_m],
            albedo: look.albedo,
            material: look.id,
            pulse,
        });
    }
}

/// Distance of a lamp from the straight between two points of an outline.
fn across_m([a, b]: [OutlinePoint; 2], lamp: &TrackPoint) -> f64 {
    let edge = Vector2::new(b.l_m - a.l_m, b.h_m - a.h_m);
    let to_lamp = Vector2::new(lamp.l_m - a.l_m, lamp.h_m - a.h_m);
    let share = (edge.dot(&to_lamp) / edge.norm_squared().max(1e-12)).clamp(0.0, 1.0);
    (to_lamp - edge * share).norm()
}

#[allow(clippy::too_many_arguments, reason = "what a strip is made of")]
fn add_strip(
    mesh: &mut Mesh,
    tunnel: &Tunnel,
    lamps: &LampField,
    near: &[TrackPoint],
    facet: &Facet,
    stations: &[f64],
    key: ChunkKey,
    origin: &Point3<f64>,
) {
    let from_m = key.start_m();
    let first = mesh.vertices.len() as u32;
    let sides = facet.ends.map(|end| {
        if key.detail == Detail::Far {
            stations.to_vec()
        } else {
            finer_stations(stations, end, near)
        }
    });
    for ((end, q_m), side) in facet.ends.iter().zip(facet.q_m).zip(&sides) {
        for &s_m in side {
            let normal = facet_normal(tunnel, facet, s_m);
            let column = (s_m / STAIN_CELL_M).floor();
            let stains = if key.detail == Detail::Far {
                [STAIN_NONE; 8]
            } else {
                facet.stains(column)
            };
            let p = ruled(tunnel, s_m, *end, key.detail);
            mesh.vertices.push(Vertex {
                position_m: (p - origin).map(|x| x as f32).into(),
                irradiance_lx: (lamps.irradiance_lx(&p, &normal) + tunnel.ambient_lx) as f32,
                normal: normal.map(|x| x as f32).into(),
                albedo: facet.albedo as f32,
                pattern_m: [(s_m - from_m) as f32, q_m as f32],
                luminance_cd_m2: 0.0,
                pulse: facet.pulse,
                stain_cell: [
                    (column - from_m / STAIN_CELL_M) as f32,
                    facet.stain_row() as f32,
                ],
                stains,
            });
        }
    }
    mesh.add_ribbon(first, [&sides[0], &sides[1]]);
}

/// A point of the surface, which runs straight from ring to ring.
fn ruled(tunnel: &Tunnel, s_m: f64, end: OutlinePoint, detail: Detail) -> Point3<f64> {
    let at = |s_m: f64| {
        tunnel.alignment.world_from_track(TrackPoint {
            s_m,
            l_m: end.l_m,
            h_m: end.h_m,
        })
    };
    let ring = s_m / surface::RING_M;
    let share = ring - ring.floor();
    if detail == Detail::Far || share <= 0.0 {
        return at(s_m);
    }
    let [a, b] = [ring.floor(), ring.ceil()].map(|k| at(k * surface::RING_M));
    a + (b - a) * share
}

/// Normal of a facet on the side of the tunnel's inside.
fn facet_normal(tunnel: &Tunnel, facet: &Facet, s_m: f64) -> Vector3<f64> {
    let frame = tunnel.alignment.at(s_m);
    let (sin, cos) = frame.heading_rad.sin_cos();
    let along = Vector3::new(cos, sin, frame.slope);
    let [a, b] = facet.ends;
    let left_m = b.l_m - a.l_m;
    let across = Vector3::new(-left_m * sin, left_m * cos, b.h_m - a.h_m);
    // On the straight this is (h, -l) in track axes: to the left of an edge seen up the line.
    across.cross(&along).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::render::sample;

    fn chunk(index: i64, detail: Detail) -> (Point3<f64>, Mesh) {
        let scene = sample::scene();
        let lamps = LampField::new(&scene.lamps);
        chunk_mesh(&scene.tunnel, &lamps, ChunkKey { index, detail })
    }

    /// Provokes facets that face the rock: every normal of the lining points to the axis.
    #[test]
    fn lining_faces_inwards() {
        let (origin, mesh) = chunk(4, Detail::Near);
        let tunnel = sample::tunnel();
        let mut seen = 0;
        for v in mesh
            .vertices
            .iter()
            .filter(|v| (v.albedo - 0.3).abs() < 1e-6)
        {
            let p = origin + Vector3::from(v.position_m).cast::<f64>();
            let t = tunnel.alignment.track_from_world(&p, 67.0);
            let axis = tunnel.alignment.world_from_track(TrackPoint {
                l_m: 0.0,
                h_m: 1.7,
                ..t
            });
            assert!((axis - p).dot(&Vector3::from(v.normal).cast()) > 3.0);
            seen += 1;
        }
        assert!(seen > 1000);
    }

    /// Provokes gaps between chunks: the last ring of one is the first ring of the next.
    #[test]
    fn chunks_meet() {
        for detail in [Detail::Near, Detail::Middle, Detail::Far] {
            let at_end = |index: i64, end_m: f64| {
                let (origin, mesh) = chunk(index, detail);
                let at = |v: &Vertex| origin + Vector3::from(v.position_m).cast::<f64>();
                let on_end = |v: &&Vertex| (f64::from(v.pattern_m[0]) - end_m).abs() < 1e-6;
                let points: Vec<_> = mesh.vertices.iter().filter(on_end).map(at).collect();
                points
            };
            let (before, after) = (at_end(20, CHUNK_M), at_end(21, 0.0));
            assert!(before.len() > 100);
            assert_eq!(before.len(), after.len());
            for (last, first) in before.iter().zip(&after) {
                assert!((last - first).norm() < 1e-5, "{last} {first}");
            }
        }
    }

    /// Provokes meshes beyond the ends of the tunnel, or none at its ends.
    #[test]
    fn chunks_end_with_the_tunnel() {
        assert!(chunk(-1, Detail::Middle).1.vertices.is_empty());
        assert!(!chunk(39, Detail::Middle).1.vertices.is_empty());
        assert!(chunk(40, Detail::Middle).1.vertices.is_empty());
    }
}
