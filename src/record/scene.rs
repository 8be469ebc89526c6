//! What stands still in the 3-D view: tunnel, rails, lamps, balises, wayside cameras.

use super::images::{WaysidePaths, pinhole};
use super::observer_error::Result;
use super::palette::{self, ui};
use super::stream::RowStream;
use crate::scenario::RecordSettings;
use crate::session::Opening;
use crate::track::network::Network;
use crate::track::uid::Uid;
use crate::track::{Alignment, RAIL_OFFSET_M, SectionRange, Track, Tunnel};
use nalgebra::{Isometry3, Point3, Vector3};
use re_sdk_types::archetypes::{
    Boxes3D, LineStrips3D, Mesh3D, Points3D, Transform3D, ViewCoordinates,
};
use re_sdk_types::components::{Color, FillMode, MeshFaceRendering, RotationQuat};
use re_sdk_types::datatypes::Quaternion;
use rerun::AsComponents;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The vehicle frame of the leading car.
pub(super) const HEAD: &str = "world/train/head";

/// A tunnel drawn from more rings than this costs more than it shows.
const MAX_RINGS: f64 = 2000.0;

/// UIDs of more lamps than this would cover the picture.
const MAX_LAMP_LABELS: usize = 12;

/// The recording's own coordinates: the world's, from a point in the middle of the line, so that
/// single precision is good to a millimetre up to 10 km away.
pub(super) struct RecordedScene {
    origin: Vector3<f64>,
    network: Network,
    lamps: BTreeMap<Uid, Point3<f64>>,
}

impl RecordedScene {
    /// Of a tunnel.
    pub(super) fn new(tunnel: &Tunnel) -> Self {
        let first = &tunnel.first_track().alignment;
        let middle = first.at(first.length_m() / 2.0).origin;
        Self {
            origin: middle.coords.map(f64::round),
            network: tunnel.network.clone(),
            lamps: tunnel.lamps().map(|l| (l.uid, l.centre)).collect(),
        }
    }

    /// The line that a wayside device stands beside.
    pub(super) fn beside(&self, device: &str) -> &Alignment {
        let has = |track: &&Arc<Track>| track.wayside.iter().any(|site| site.name == device);
        let track = self.network.tracks.iter().find(has);
        &track.unwrap_or(&self.network.tracks[0]).alignment
    }

    /// Where a lamp was surveyed.
    pub(super) fn lamp(&self, uid: Uid) -> Option<&Point3<f64>> {
        self.lamps.get(&uid)
    }

    /// World to recording.
    pub(super) fn local(&self, p: &Point3<f64>) -> [f32; 3] {
        let d = p.coords - self.origin;
        [d.x as f32, d.y as f32, d.z as f32]
    }

    /// As [`Self::local`], of where a pose is.
    pub(super) fn place(&self, pose: &Isometry3<f64>) -> [f32; 3] {
        self.local(&pose.translation.vector.into())
    }

    /// A pose as a transform of the recording.
    pub(super) fn transform(&self, pose: &Isometry3<f64>) -> Transform3D {
        Transform3D::from_translation(self.place(pose)).with_quaternion(turn(pose))
    }

    /// Logs all that stands still.
    pub(super) fn log(
        &self,
        stream: &RowStream,
        opening: &Opening<'_>,
        settings: &RecordSettings,
    ) -> Result {
        stream.log_static("world", &ViewCoordinates::RIGHT_HAND_Z_UP())?;
        self.log_tunnel(stream, opening.tunnel, settings.ring_step_m)?;
        self.log_lamps_and_balises(stream, opening.tunnel)?;
        for device in opening.wayside {
            let paths = WaysidePaths::new(&device.name);
            let pose = self.transform(&device.world_from_camera);
            let pinhole = pinhole(&device.camera.intrinsics, 2.5);
            stream.log_static(&paths.camera, &[&pose as &dyn AsComponents, &pinhole])?;
            let place = self.place(&device.world_from_camera);
            let point = Points3D::new([place])
                .with_radii([0.15])
                .with_colors([palette::CAMERA])
                .with_labels([device.name.as_str()]);
            stream.log_static(&paths.device, &point)?;
        }
        Ok(())
    }

    fn log_tunnel(&self, stream: &RowStream, tunnel: &Tunnel, ring_step_m: f64) -> Result {
        let tracks = &tunnel.network.tracks;
        let length_m: f64 = tracks.iter().map(|t| t.alignment.length_m()).sum();
        let step_m = ring_step_m.max(length_m / MAX_RINGS);
        let mut mesh = Sweep::default();
        for track in tracks {
            for range in &track.sections {
                mesh.sweep(self, &track.alignment, range, step_m);
            }
        }
        stream.log_static("world/tunnel", &mesh.finish())?;

        let rails = tracks.iter().flat_map(|track| {
            let line = &track.alignment;
            [RAIL_OFFSET_M, -RAIL_OFFSET_M].map(|centre_m| {
                let strip = rings(0.0, line.length_m(), step_m).map(|s_m| {
                    let rail = Point3::new(0.0, centre_m, 0.0);
                    self.local(&(line.at(s_m).world_from_rails() * rail))
                });
                strip.collect::<Vec<_>>()
            })
        });
        let rails = LineStrips3D::new(rails)
            .with_radii([0.04])
            .with_colors([palette::RAIL]);
        stream.log_static("world/rails", &rails)
    }

    fn log_lamps_and_balises(&self, stream: &RowStream, tunnel: &Tunnel) -> Result {
        let lamps: Vec<_> = tunnel.lamps().collect();
        if !lamps.is_empty() {
            let points = Points3D::new(lamps.iter().map(|l| self.local(&l.centre)))
                .with_radii([ui(3.0)])
                .with_colors([palette::LAMP])
                .with_labels(lamps.iter().map(|l| l.uid.to_string()))
                .with_show_labels(lamps.len() <= MAX_LAMP_LABELS);
            stream.log_static("world/lamps", &points)?;
        }
        let tracks = tunnel.network.tracks.iter();
        let balises = tracks.flat_map(|track| track.balises.iter().map(move |b| (track, b)));
        let balises: Vec<_> = balises.collect();
        if !balises.is_empty() {
            let poses = balises.iter().map(|(track, balise)| {
                let frame = track.alignment.at(balise.chainage_m).world_from_rails();
                (self.place(&frame), turn(&frame))
            });
            let (places, turns): (Vec<_>, Vec<_>) = poses.unzip();
            // A Eurobalise is some 0.5 m by 0.4 m and lies between the rails.
            let boxes = Boxes3D::from_centers_and_half_sizes(places, [[0.25, 0.2, 0.04]])
                .with_quaternions(turns)
                .with_colors([palette::BALISE])
                .with_fill_mode(FillMode::Solid)
                .with_labels(balises.iter().map(|(_, b)| b.name.as_str()))
                .with_show_labels(balises.len() <= MAX_LAMP_LABELS);
            stream.log_static("world/balises", &boxes)?;
        }
        Ok(())
    }

    /// Where the viewer's eye starts and what it looks at: from outside through the wall, which
    /// shows its inner side only, at the head, else at the first wayside camera's field,
    /// else at the middle of the line.
    pub(super) fn eye(
        &self,
        camera: Option<&Isometry3<f64>>,
        head: Option<&Isometry3<f64>>,
    ) -> ([f32; 3], [f32; 3]) {
        let (frame, eye, target) = match (head, camera) {
            (Some(head), _) => (*head, [-9.0, -13.0, 9.0], [8.0, 0.0, 1.5]),
            (None, Some(camera)) => (*camera, [-6.0, -6.0, -8.0], [0.0, 2.0, 20.0]),
            (None, None) => {
                let line = &self.network.tracks[0].alignment;
                let middle = line.at(line.length_m() / 2.0);
                (
                    middle.world_from_line(),
                    [-20.0, -20.0, 12.0],
                    [0.0, 0.0, 1.5],
                )
            }
        };
        [eye, target]
            .map(|p| self.local(&(frame * Point3::from(p))))
            .into()
    }
}

/// Rotation of a pose.
pub(super) fn turn(pose: &Isometry3<f64>) -> RotationQuat {
    let q = pose.rotation.coords;
    RotationQuat(Quaternion([q.x as f32, q.y as f32, q.z as f32, q.w as f32]))
}

/// Chainages from one to another at most `step_m` apart, both included.
fn rings(from_m: f64, to_m: f64, step_m: f64) -> impl Iterator<Item = f64> {
    let steps = ((to_m - from_m) / step_m).ceil().clamp(1.0, MAX_RINGS);
    (0..=steps as usize).map(move |k| from_m + (to_m - from_m) * k as f64 / steps)
}

/// Triangles of the tunnel's inner side. Flat faces: an edge of the outline has corners of its own.
#[derive(Default)]
struct Sweep {
    corners: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colours: Vec<Color>,
    triangles: Vec<[u32; 3]>,
}

impl Sweep {
    fn sweep(
        &mut self,
        scene: &RecordedScene,
        line: &Alignment,
        range: &SectionRange,
        step_m: f64,
    ) {
        for edge in range.section.edges() {
            let first = self.corners.len() as u32;
            for (ring, s_m) in rings(range.from_m, range.to_m, step_m).enumerate() {
                let frame = line.at(s_m);
                let (nl, nh) = edge.normal();
                let normal = (frame.left() * nl + Vector3::z() * nh).map(|x| x as f32);
                for p in [edge.a, edge.b] {
                    self.corners
                        .push(scene.local(&frame.world_from_section(p.l_m, p.h_m)));
                    self.normals.push(normal.into());
                    self.colours.push(palette::material(edge.material, ring));
                }
            }
            let last = self.corners.len() as u32;
            for a in (first..last - 2).step_by(2) {
                self.triangles.push([a, a + 1, a + 3]);
                self.triangles.push([a, a + 3, a + 2]);
            }
        }
    }

    fn finish(self) -> Mesh3D {
        Mesh3D::new(self.corners)
            .with_vertex_normals(self.normals)
            .with_vertex_colors(self.colours)
            .with_triangle_indices(self.triangles)
            .with_face_rendering(MeshFaceRendering::Front)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::tests::session::tunnel;
    use crate::track::TrackPoint;

    /// The viewer hides what it sees from behind. A flipped triangle would hide the far wall and
    /// show the near one; a normal that disagrees would light it from outside.
    #[test]
    fn the_tunnel_shows_its_inner_side() {
        let tunnel = tunnel();
        let scene = RecordedScene::new(&tunnel);
        let track = tunnel.first_track();
        let mut sweep = Sweep::default();
        sweep.sweep(&scene, &track.alignment, &track.sections[0], 5.0);
        // 120 stretches, two triangles each.
        let edges = track.sections[0].section.edges().count();
        assert_eq!(sweep.triangles.len(), edges * 120 * 2);
        let corner = |k: u32| Vector3::from(sweep.corners[k as usize]);
        for t in &sweep.triangles {
            let [a, b, c] = t.map(corner);
            let face = (b - a).cross(&(c - a)).normalize();
            let normal = Vector3::from(sweep.normals[t[0] as usize]);
            // Chords of 5 m in a curve of 400 m turn by 0.0125 rad, the grade adds 0.01.
            assert!(
                face.dot(&normal) > 0.999,
                "face {face:?}, normal {normal:?}"
            );
            let near_s_m = 200.0;
            let world = Point3::from(a.cast::<f64>() + scene.origin);
            let s_m = track.alignment.track_from_world(&world, near_s_m).s_m;
            let axis = TrackPoint {
                s_m,
                l_m: 0.0,
                h_m: 1.9,
            };
            let axis = scene.local(&track.alignment.world_from_track(axis));
            assert!(face.dot(&(Vector3::from(axis) - a)) > 0.0);
        }
    }

    /// Single precision far from the world's origin would shake lamps by centimetres.
    #[test]
    fn coordinates_are_good_to_a_millimetre() {
        let tunnel = tunnel();
        let scene = RecordedScene::new(&tunnel);
        let track = tunnel.first_track();
        for lamp in &track.lamps {
            let back = Vector3::from(scene.local(&lamp.centre)).cast::<f64>() + scene.origin;
            assert!((back - lamp.centre.coords).norm() < 1e-3);
        }
    }
}
