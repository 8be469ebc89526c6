//! Walls across the line as meshes: each a part of the chunk on its side.

use super::detail::{CHUNK_M, halve};
use super::layout::Vertex;
use super::mesh::Mesh;
use super::surface::{Patch, SurfaceCell};
use super::tunnel::{ChunkSide, Site};
use crate::track::{Direction, Material, TrackPoint};
use crate::twin::geometry::{EndWall, Trapezoid, difference, free_space};
use crate::twin::render::paint::Painting;

/// A chunk's own cross-section is looked up so far from its ends.
const INSIDE_M: f64 = 1e-3;

impl Site<'_> {
    /// Adds the end walls that are seen from within the chunk.
    pub(super) fn add_end_walls(&self, mesh: &mut Mesh, parts: &mut Vec<ChunkSide>) {
        let key = self.cutting.key;
        let (from_m, to_m) = (key.start_m(), key.start_m() + CHUNK_M);
        let within = |wall: &&EndWall| match wall.seen_looking {
            Direction::Up => from_m < wall.s_m && wall.s_m <= to_m,
            Direction::Down => from_m <= wall.s_m && wall.s_m < to_m,
        };
        for wall in self.scene.end_walls[key.track].iter().filter(within) {
            let (first, mut patches) = (mesh.indices.len(), Vec::new());
            let painting = self
                .scene
                .paintings
                .of_range(key.track, wall.paint.of_range);
            for piece in &wall.pieces {
                self.add_piece(mesh, &mut patches, (wall, piece), painting.unwrap_or(0));
            }
            parts.extend(self.side_of(mesh, first, painting.unwrap_or(0), patches));
        }
    }

    /// Adds dark walls across a tunnel where what is beyond the chunk is dark, so that no sky is seen there.
    pub(super) fn add_darkness(&self, mesh: &mut Mesh, parts: &mut Vec<ChunkSide>) {
        let key = self.cutting.key;
        let length_m = self.track.alignment.length_m();
        let ends_m = [key.start_m(), (key.start_m() + CHUNK_M).min(length_m)];
        let dark = ends_m.into_iter().zip(key.dark).filter(|(_, dark)| *dark);
        for (s_m, _) in dark {
            let middle_m = 0.5 * (ends_m[0] + ends_m[1]);
            let within_m = s_m + (middle_m - s_m).clamp(-INSIDE_M, INSIDE_M);
            let Some(section) = self.track.section_at(within_m).filter(|s| s.closed) else {
                continue;
            };
            let (frame, first) = (self.track.alignment.at(s_m), mesh.indices.len());
            for piece in difference(&free_space(section, 0.0), &[]) {
                let corner = mesh.vertices.len() as u32;
                for (row, h_m) in piece.h_m.into_iter().enumerate() {
                    for l_m in [piece.right_m[row], piece.left_m[row]] {
                        let p = frame.world_from_section(l_m, h_m) - self.origin;
                        mesh.vertices.push(Vertex {
                            position_m: p.map(|x| x as f32).into(),
                            ..Vertex::default()
                        });
                    }
                }
                mesh.add_quads(corner, 2, 2);
            }
            parts.extend(self.side_of(mesh, first, 0, Vec::new()));
        }
    }

    fn add_piece(
        &self,
        mesh: &mut Mesh,
        patches: &mut Vec<Patch>,
        (wall, piece): (&EndWall, &Trapezoid),
        painting: usize,
    ) {
        let frame = self.track.alignment.at(wall.s_m);
        let normal = wall.normal(&frame.ahead().xy().normalize());
        let section = &self.track.sections[wall.range].section;
        let [low_m, high_m] = piece.h_m;
        let [right_m, left_m] = [
            piece.right_m[0].min(piece.right_m[1]),
            piece.left_m[0].max(piece.left_m[1]),
        ];
        let rows = self.cuts(wall.s_m, [low_m, high_m], |lamp| lamp.h_m);
        let columns = self.cuts(wall.s_m, [right_m, left_m], |lamp| lamp.l_m);
        let first = mesh.vertices.len();
        for up in &rows {
            let between = |side: [f64; 2]| side[0] + up * (side[1] - side[0]);
            let (right_m, left_m) = (between(piece.right_m), between(piece.left_m));
            for aside in &columns {
                let (l_m, h_m) = (
                    right_m + aside * (left_m - right_m),
                    low_m + up * (high_m - low_m),
                );
                let p = frame.world_from_section(l_m, h_m);
                let place = wall.paint.place_m(wall.s_m, l_m, h_m);
                let vertex = self.lit_vertex((p, normal), Material::Lining, place, section);
                mesh.vertices.push(vertex);
            }
        }
        mesh.add_quads(first as u32, rows.len() as u32, columns.len() as u32);
        let q_m = piece.h_m.map(|h_m| wall.paint.place_m(0.0, 0.0, h_m)[1]);
        let painting = self.scene.paintings.all.get(painting);
        let brightest = painting.map_or(1.0, |p: &Painting| p.most_albedo(q_m)) as f32;
        let middle = frame.world_from_section(0.5 * (right_m + left_m), 0.5 * (low_m + high_m));
        let half = [
            frame.left() * (0.5 * (left_m - right_m)),
            nalgebra::Vector3::z() * (0.5 * (high_m - low_m)),
        ];
        let cell = SurfaceCell::still(middle, half, Some(normal));
        patches.push(self.patch(cell, brightest, mesh.vertices[first..].iter()));
    }

    /// Where an end wall is cut one way, from 0 to 1: `of` says where lamps are that way.
    fn cuts(
        &self,
        s_m: f64,
        [from_m, to_m]: [f64; 2],
        of: impl Fn(&TrackPoint) -> f64,
    ) -> Vec<f64> {
        let at = |share: f64| from_m + share * (to_m - from_m);
        let fits = |from: f64, to: f64| {
            let (from_m, to_m) = (at(from), at(to));
            let aside_m = |lamp: &TrackPoint| (from_m - of(lamp)).max(of(lamp) - to_m).max(0.0);
            (self.cutting).suffices(to_m - from_m, [s_m, s_m], aside_m)
        };
        let mut cuts = vec![0.0];
        halve(0.0, 1.0, &fits, &mut cuts);
        cuts
    }
}
