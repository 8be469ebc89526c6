//! Sky, and ground far away, where a track lies in the open by day: two half spheres around the tracks.

use super::detail::{ChunkKey, Detail};
use super::layout::Vertex;
use super::mesh::Mesh;
use super::surface::{Patch, SurfaceCell};
use super::tunnel::{ChunkMesh, ChunkSide};
use crate::twin::render::daylight::Daylight;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// So far from the middle of the tracks that it is the same from wherever a camera is on them.
const RADIUS_M: f64 = 2e5;
/// Cells around the horizon, as fine as a bent lens needs.
const AROUND: u32 = 144;
/// Where cells end above the horizon and under it, shares of a right angle.
const HEIGHTS: [f64; 7] = [0.0, 0.03, 0.1, 0.25, 0.5, 0.75, 1.0];

/// Not that of any chunk: nothing of the sky is looked up by it.
pub const KEY: ChunkKey = ChunkKey {
    track: 0,
    index: 0,
    detail: Detail::Far,
    bend: None,
    dark: [false; 2],
};

/// The mesh of both.
pub fn sky_mesh(daylight: &Daylight) -> ChunkMesh {
    let mut mesh = Mesh::default();
    let halves = [(1.0, daylight.sky_cd_m2()), (-1.0, daylight.ground_cd_m2())];
    let parts = halves.map(|(up, luminance_cd_m2)| half_sphere(&mut mesh, up, luminance_cd_m2));
    ChunkMesh {
        origin: daylight.middle(),
        mesh,
        lamp: None,
        parts: parts.into(),
    }
}

fn half_sphere(mesh: &mut Mesh, up: f64, luminance_cd_m2: f64) -> ChunkSide {
    let at = |height: f64, turn: u32| {
        let (z, level) = (FRAC_PI_2 * height).sin_cos();
        let (y, x) = (TAU * f64::from(turn % AROUND) / f64::from(AROUND)).sin_cos();
        Vector3::new(level * x, level * y, up * z) * RADIUS_M
    };
    let (corner, first) = (mesh.vertices.len() as u32, mesh.indices.len() as u32);
    for height in HEIGHTS {
        mesh.vertices.extend((0..=AROUND).map(|turn| Vertex {
            position_m: at(height, turn).map(|x| x as f32).into(),
            luminance_cd_m2: luminance_cd_m2 as f32,
            ..Vertex::default()
        }));
    }
    mesh.add_quads(corner, HEIGHTS.len() as u32, AROUND + 1);
    let heights = HEIGHTS.windows(2);
    let cells = heights.flat_map(|pair| (0..AROUND).map(move |turn| ([pair[0], pair[1]], turn)));
    let patches = cells.map(|([low, high], turn)| {
        let [a, b] = [at(low, turn), at(low, turn + 1)];
        let [c, d] = [at(high, turn), at(high, turn + 1)];
        let half = [0.25 * (b + d - a - c), 0.25 * (c + d - a - b)];
        Patch {
            cell: SurfaceCell::still((0.25 * (a + b + c + d)).into(), half, None),
            peak_cd_m2: luminance_cd_m2 as f32,
            reflected_per_lx: 0.0,
            glossy: false,
        }
    });
    let last = mesh.indices.len() as u32;
    ChunkSide {
        around: std::array::from_fn(|k| {
            let side = |axis: usize| {
                let far = if k >> axis & 1 == 0 { -1.0 } else { 1.0 };
                (RADIUS_M * far) as f32
            };
            Vector3::new(side(0), side(1), side(2))
        }),
        painting: 0,
        indices: first..last,
        peak_cd_m2: luminance_cd_m2 as f32,
        patches: patches.collect(),
        glossy: last..last,
    }
}
