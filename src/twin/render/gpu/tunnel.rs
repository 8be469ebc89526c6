//! Tunnel and rails cut into chunks along the line, lit by the lamps, each meshed once.

use super::detail::{CHUNK_M, ChunkKey, Cutting, Detail, finer_stations, stations};
use super::facets::{Facet, FacetSide, facets_of};
use super::layout::Vertex;
use super::mesh::Mesh;
use super::surface::{Patch, SurfaceCell};
use crate::track::{CrossSection, Material, OutlinePoint, Track, TrackPoint};
use crate::twin::geometry::STATION_STEP_M;
use crate::twin::reflectance::mean_albedo;
use crate::twin::render::gloss::Gloss;
use crate::twin::render::lamp_field::LampField;
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::paint::Painting;
use crate::twin::render::photometry::BlinkingLamp;
use nalgebra::{Point3, Rotation3, Vector3};
use std::f64::consts::PI;
use std::ops::Range;

/// Length of a patch, where its ends are stations.
const PATCH_M: f64 = 0.5;
/// What is so near to a station is on it.
const NEAR_STATION_M: f64 = 1e-3;

/// A chunk as meshed.
#[derive(Clone, Debug)]
pub struct ChunkMesh {
    /// Its place in the world.
    pub origin: Point3<f64>,
    /// Its triangles.
    pub mesh: Mesh,
    /// The lamp whose blinking shows on its walls.
    pub lamp: Option<usize>,
    /// For every cross-section in it one a [`FacetSide`], and its end walls.
    pub parts: Vec<ChunkSide>,
}

/// The triangles of one side of one cross-section in a chunk, or of an end wall.
#[derive(Clone, Debug)]
pub struct ChunkSide {
    /// The corners of a box around them, from the chunk's origin.
    pub around: [Vector3<f32>; 8],
    /// Which of the scene's paintings.
    pub painting: usize,
    /// Its indices in the mesh.
    pub indices: Range<u32>,
    /// More luminance by lamps than any of it has, cd/m^2.
    pub peak_cd_m2: f32,
    /// All of it in pieces.
    pub patches: Vec<Patch>,
    /// Indices of the triangles among them that mirror, once more.
    pub glossy: Range<u32>,
}

/// What all surfaces of a chunk share.
pub(super) struct Site<'a> {
    pub scene: &'a LitScene,
    pub track: &'a Track,
    lamp: Option<&'a BlinkingLamp>,
    pub cutting: Cutting<'a>,
    pub origin: Point3<f64>,
}

/// Origin and mesh of a chunk; empty where there is no tunnel.
pub fn chunk_mesh(scene: &LitScene, key: ChunkKey) -> ChunkMesh {
    let (track, field) = (&scene.tracks[key.track], &scene.lamps);
    let (from_m, to_m) = (key.start_m(), key.start_m() + CHUNK_M);
    let middle_m = from_m + 0.5 * CHUNK_M;
    let middle = track.alignment.at(middle_m).origin;
    let lamp = strongest(field, &middle);
    let near: Vec<_> = (field.near(&middle))
        .map(|lamp| track.alignment.track_from_world(&lamp.centre, middle_m))
        .collect();
    let site = Site {
        scene,
        track,
        lamp: lamp.map(|k| &field.lamps()[k]),
        cutting: Cutting { key, lamps: &near },
        origin: track.alignment.at(from_m).origin,
    };
    let mut mesh = Mesh::default();
    let mut parts = Vec::new();
    for (section, range) in track.sections.iter().enumerate() {
        let stations = stations(range, from_m, to_m, key.detail.step_m());
        if stations.len() < 2 {
            continue;
        }
        let number = scene.paintings.of_range(key.track, section);
        let painting = number.and_then(|k| scene.paintings.all.get(k));
        let rail_q_m = painting.map_or(0.0, Painting::rail_q_m);
        let facets = facets_of(range, rail_q_m, site.cutting);
        for side in FacetSide::ALL {
            let first = mesh.indices.len();
            let mut patches = Vec::new();
            for facet in facets.iter().filter(|f| FacetSide::of(f, range) == side) {
                let vertices = mesh.vertices.len();
                site.add_strip(&mut mesh, (facet, &range.section), &stations);
                let brightest = painting.map_or(1.0, |p| p.most_albedo(facet.q_m)) as f32;
                let vertices = &mesh.vertices[vertices..];
                site.add_patches(&mut patches, (facet, brightest), &stations, vertices);
            }
            parts.extend(site.side_of(&mut mesh, first, number.unwrap_or(0), patches));
        }
    }
    site.add_end_walls(&mut mesh, &mut parts);
    site.add_darkness(&mut mesh, &mut parts);
    ChunkMesh {
        origin: site.origin,
        mesh,
        lamp,
        parts,
    }
}

/// The lamp that throws most light at a place, whatever the surface there.
fn strongest(field: &LampField, p: &Point3<f64>) -> Option<usize> {
    let towards = |lamp: &BlinkingLamp| (lamp.centre - p).try_normalize(1e-9);
    let light = |lamp: &BlinkingLamp| towards(lamp).map_or(0.0, |n| lamp.irradiance_lx(p, &n));
    let lamps = field.lamps().iter().enumerate();
    lamps
        .map(|(k, lamp)| (k, light(lamp)))
        .filter(|(_, lux)| *lux > 0.0)
        .max_by(|a, b| f64::total_cmp(&a.1, &b.1))
        .map(|(k, _)| k)
}

/// Corners of the upright box along the line that holds the triangles from index `first` on.
fn box_around(mesh: &Mesh, first: usize, heading_rad: f64) -> [Vector3<f32>; 8] {
    let to_line = Rotation3::from_axis_angle(&Vector3::z_axis(), -heading_rad as f32);
    let corners = mesh.indices[first..].iter();
    let corners = corners.map(|k| to_line * Vector3::from(mesh.vertices[*k as usize].position_m));
    let (low, high) = corners.fold(
        (Vector3::repeat(f32::MAX), Vector3::repeat(f32::MIN)),
        |(low, high), p| (low.inf(&p), high.sup(&p)),
    );
    std::array::from_fn(|k| {
        let side = |axis: usize| if k >> axis & 1 == 0 { low } else { high }[axis];
        to_line.inverse() * Vector3::new(side(0), side(1), side(2))
    })
}

impl Site<'_> {
    /// The triangles of a mesh from index `first` on, those that mirror once more behind them; nothing where
    /// there are none.
    pub(super) fn side_of(
        &self,
        mesh: &mut Mesh,
        first: usize,
        painting: usize,
        patches: Vec<Patch>,
    ) -> Option<ChunkSide> {
        let middle_m = self.cutting.key.start_m() + 0.5 * CHUNK_M;
        let (triangles, _) = mesh.indices.get(first..)?.as_chunks::<3>();
        if triangles.is_empty() {
            return None;
        }
        let mirrors = |k: u32| mesh.vertices[k as usize].gloss[0] > 0.0;
        let glossy = triangles.iter().filter(|t| t.iter().all(|k| mirrors(*k)));
        let glossy: Vec<u32> = glossy.flatten().copied().collect();
        let around = box_around(mesh, first, self.track.alignment.at(middle_m).heading_rad);
        let border = mesh.indices.len() as u32;
        mesh.indices.extend(glossy);
        Some(ChunkSide {
            around,
            painting,
            indices: first as u32..border,
            peak_cd_m2: patches
                .iter()
                .fold(0.0, |peak, patch| patch.peak_cd_m2.max(peak)),
            patches,
            glossy: border..mesh.indices.len() as u32,
        })
    }

    fn add_strip(
        &self,
        mesh: &mut Mesh,
        (facet, section): (&Facet, &CrossSection),
        stations: &[f64],
    ) {
        let first = mesh.vertices.len() as u32;
        let sides = facet
            .ends
            .map(|end| finer_stations(stations, end, self.cutting));
        for ((end, q_m), side) in facet.ends.iter().zip(facet.q_m).zip(&sides) {
            for &s_m in side {
                mesh.vertices
                    .push(self.vertex((facet, section), *end, q_m, s_m));
            }
        }
        mesh.add_ribbon(first, [&sides[0], &sides[1]]);
    }

    /// The patches of a strip with these vertices, from station to station; nothing on it has more albedo
    /// than `brightest`.
    fn add_patches(
        &self,
        patches: &mut Vec<Patch>,
        (facet, brightest): (&Facet, f32),
        stations: &[f64],
        vertices: &[Vertex],
    ) {
        let detail = self.cutting.key.detail;
        let start_m = self.cutting.key.start_m();
        let mut from_m = stations[0];
        let last_m = stations[stations.len() - 1];
        for to_m in &stations[1..] {
            if to_m - from_m < PATCH_M - NEAR_STATION_M && *to_m < last_m {
                continue;
            }
            let at = |s_m, end| ruled(self.track, s_m, facet.ends[end], detail).coords;
            let [a, b] = [0, 1].map(|end| at(from_m, end));
            let [c, d] = [0, 1].map(|end| at(*to_m, end));
            let half = [0.25 * (c + d - a - b), 0.25 * (b + d - a - c)];
            let normal = facet_normal(self.track, facet, 0.5 * (from_m + to_m));
            let stretch_m = from_m - NEAR_STATION_M..=to_m + NEAR_STATION_M;
            let inside = |v: &&Vertex| stretch_m.contains(&(start_m + f64::from(v.place_m[0])));
            let corners = vertices.iter().filter(inside);
            let cell = SurfaceCell::still((0.25 * (a + b + c + d)).into(), half, Some(normal));
            patches.push(self.patch(cell, brightest, corners));
            from_m = *to_m;
        }
    }

    /// A cell with these vertices among others, of which nothing has more albedo than `brightest`.
    pub(super) fn patch<'v>(
        &self,
        cell: SurfaceCell,
        brightest: f32,
        vertices: impl Iterator<Item = &'v Vertex> + Clone,
    ) -> Patch {
        // Without a lamp nothing blinks.
        let on_per_mean = self.lamp.map_or(1.0, |lamp| 1.0 / lamp.duty().max(1e-9)) as f32;
        let reflected_per_lx = |v: &Vertex| v.paint * brightest / PI as f32;
        let peak_cd_m2 = |v: &Vertex| {
            let [steady, blinking] = v.light_lx;
            reflected_per_lx(v) * (steady + on_per_mean * blinking)
        };
        let most = |of: &dyn Fn(&Vertex) -> f32| vertices.clone().map(of).fold(0.0, f32::max);
        Patch {
            cell,
            peak_cd_m2: most(&peak_cd_m2),
            reflected_per_lx: most(&reflected_per_lx),
            glossy: most(&|v| v.gloss[0]) > 0.0,
        }
    }

    fn vertex(
        &self,
        (facet, section): (&Facet, &CrossSection),
        end: OutlinePoint,
        q_m: f64,
        s_m: f64,
    ) -> Vertex {
        let normal = facet_normal(self.track, facet, s_m);
        let p = ruled(self.track, s_m, end, self.cutting.key.detail);
        self.lit_vertex((p, normal), facet.material, [s_m, q_m], section)
    }

    /// A corner of a surface, painted as the painting is at a place.
    pub(super) fn lit_vertex(
        &self,
        (p, normal): (Point3<f64>, Vector3<f64>),
        material: Material,
        [s_m, q_m]: [f64; 2],
        section: &CrossSection,
    ) -> Vertex {
        let blinking = self
            .lamp
            .map_or(0.0, |lamp| lamp.irradiance_lx(&p, &normal));
        let place = (self.cutting.key.track, section);
        let surroundings = self.scene.surroundings_in(place, &p);
        let all =
            self.scene.lamps.irradiance_lx(&p, &normal) + surroundings.on_surface_lx(&p, &normal);
        // What begins or ends with the chunk does so for all of it.
        let start_m = self.cutting.key.start_m();
        let inside_m = s_m - start_m;
        let number = self.cutting.key.track;
        let within_m = start_m + inside_m.clamp(1e-3, CHUNK_M - 1e-3);
        let gloss = Gloss::of(material, self.scene.wet.at(number, within_m), &normal);
        let paint = (self.scene.wet).albedo_factor(material, number, within_m);
        Vertex {
            position_m: (p - self.origin).map(|x| x as f32).into(),
            normal: normal.map(|x| x as f32).into(),
            light_lx: [(all - blinking).max(0.0) as f32, blinking as f32],
            place_m: [inside_m as f32, q_m as f32],
            paint: paint as f32,
            albedo: (paint * mean_albedo(material)) as f32,
            luminance_cd_m2: 0.0,
            gloss: gloss.map_or([0.0; 3], |g| {
                [g.head_on, g.along, g.across].map(|x| x as f32)
            }),
        }
    }
}

/// A point of the surface, which runs straight from ring to ring.
fn ruled(track: &Track, s_m: f64, end: OutlinePoint, detail: Detail) -> Point3<f64> {
    let at = |s_m: f64| {
        track.alignment.world_from_track(TrackPoint {
            s_m,
            l_m: end.l_m,
            h_m: end.h_m,
        })
    };
    let ring = s_m / STATION_STEP_M;
    let share = ring - ring.floor();
    if detail >= Detail::Middle || share <= 0.0 {
        return at(s_m);
    }
    let [a, b] = [ring.floor(), ring.ceil()].map(|k| at(k * STATION_STEP_M));
    a + (b - a) * share
}

/// Normal of a facet on the side of the tunnel's inside.
fn facet_normal(track: &Track, facet: &Facet, s_m: f64) -> Vector3<f64> {
    let frame = track.alignment.at(s_m);
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

    fn chunk(scene: &LitScene, index: i64, detail: Detail) -> ChunkMesh {
        let key = ChunkKey {
            track: 0,
            index,
            detail,
            bend: None,
            dark: [false; 2],
        };
        chunk_mesh(scene, key)
    }

    /// Provokes facets that face the rock: every normal of the lining points to the axis.
    #[test]
    fn lining_faces_inwards() {
        let ChunkMesh { origin, mesh, .. } =
            chunk(&LitScene::new(sample::scene()), 13, Detail::Near);
        let track = sample::track();
        let mut seen = 0;
        for v in mesh
            .vertices
            .iter()
            .filter(|v| (v.albedo - 0.3).abs() < 1e-6)
        {
            let p = origin + Vector3::from(v.position_m).cast::<f64>();
            let t = track.alignment.track_from_world(&p, 67.0);
            let axis = track.alignment.world_from_track(TrackPoint {
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
        let scene = LitScene::new(sample::scene());
        for detail in [Detail::Near, Detail::Close, Detail::Middle, Detail::Far] {
            let at_end = |index: i64, end_m: f64| {
                let ChunkMesh { origin, mesh, .. } = chunk(&scene, index, detail);
                let at = |v: &Vertex| origin + Vector3::from(v.position_m).cast::<f64>();
                let on_end = |v: &&Vertex| (f64::from(v.place_m[0]) - end_m).abs() < 1e-6;
                let points: Vec<_> = mesh.vertices.iter().filter(on_end).map(at).collect();
                points
            };
            let (before, after) = (at_end(60, CHUNK_M), at_end(61, 0.0));
            assert!(before.len() > 60);
            assert_eq!(before.len(), after.len());
            for (last, first) in before.iter().zip(&after) {
                assert!((last - first).norm() < 1e-5, "{last} {first}");
            }
        }
    }

    /// Provokes meshes beyond the ends of the tunnel, or none at its ends.
    #[test]
    fn chunks_end_with_the_tunnel() {
        let scene = LitScene::new(sample::scene());
        assert!(chunk(&scene, -1, Detail::Middle).mesh.vertices.is_empty());
        assert!(!chunk(&scene, 119, Detail::Middle).mesh.vertices.is_empty());
        assert!(chunk(&scene, 120, Detail::Middle).mesh.vertices.is_empty());
    }
}
