//! What one view needs on the adapter: its constants and the poses of its rows, all relative to
//! the camera's place in mid-frame so that f32 suffices.

use super::layout::{self, MAX_HEADLIGHTS, Pose};
use super::rectangle::Rectangle;
use crate::bus::{Intrinsics, SimTime};
use crate::twin::geometry::Body;
use crate::twin::lights::Headlight;
use crate::twin::render::pixel_map::Dark;
use crate::twin::render::scene::{Job, View};
use nalgebra::{Isometry3, Point2, Point3, Vector3};

/// Poses in the table lie this close in time, far closer than any motion of a train bends.
const POSE_STEP_S: f64 = 50e-6;
const MAX_POSES: f64 = 1024.0;
/// A place may be seen by another row than in mid-frame, up to this share of the picture's size away.
pub const BESIDE: f64 = 0.1;
/// Places at which a border of the picture is probed.
const BORDER_PLACES: usize = 17;
/// Cameras that stand still may tremble.
const LEAST_WAY_M: f64 = 0.1;
/// Surfaces nearer than this are not blurred as far as they should be.
const NEAREST_M: f64 = 1.0;
/// A circle of confusion smaller than this is that of a sharp picture.
const SHARP_PX: f64 = 1.0;
/// Nothing is blurred by what is farther away.
const MOST_REACH_PX: f64 = 24.0;

/// Inside unit normals, in the camera's frame, of four planes through its centre that hold a part of the
/// picture between them.
pub type Window = [Vector3<f64>; 4];

/// A view with its reference point.
pub struct Framed<'a> {
    /// What was asked for.
    pub view: &'a View,
    /// `world_from_camera` in mid-frame.
    pub middle: Isometry3<f64>,
    /// Around the picture.
    borders: Window,
    /// How far the camera gets in half a frame, and how far it turns.
    way_m: f64,
    turned_rad: f64,
}

impl<'a> Framed<'a> {
    /// Finds the reference point.
    pub fn new(view: &'a View) -> Self {
        let rows = f64::from(view.camera.intrinsics.height_px);
        let shutter = &view.camera.shutter;
        let middle = (view.motion).pose_at(shutter.row_mid(view.start, 0.5 * rows));
        let ends = [0.0, shutter.frame_span_s(view.camera.intrinsics.height_px)]
            .map(|s| view.motion.pose_at(view.start.plus(s)));
        let ways = ends.map(|end| (end.translation.vector - middle.translation.vector).norm());
        let turns = ends.map(|end| end.rotation.angle_to(&middle.rotation));
        let lens = &view.camera.intrinsics;
        Self {
            view,
            middle,
            borders: borders(lens, &Rectangle::whole([lens.width_px, lens.height_px])),
            way_m: ways.into_iter().fold(LEAST_WAY_M, f64::max),
            turned_rad: turns.into_iter().fold(0.0, f64::max),
        }
    }

    /// Whether the camera is in one place for all rows.
    pub fn rests(&self) -> bool {
        let poses = &self.view.motion.poses;
        poses.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Width and height of the picture.
    pub fn size_px(&self) -> [u32; 2] {
        let lens = &self.view.camera.intrinsics;
        [lens.width_px, lens.height_px]
    }

    /// All of the picture.
    pub fn whole(&self) -> Rectangle {
        Rectangle::whole(self.size_px())
    }

    /// The point that offsets count from.
    pub fn reference(&self) -> Point3<f64> {
        Point3::from(self.middle.translation.vector)
    }

    /// Steps of the table of poses, and how long each is.
    fn pose_steps(&self) -> (f64, f64) {
        let (camera, motion) = (&self.view.camera, &self.view.motion);
        let span_s = (camera.shutter.frame_span_s(camera.intrinsics.height_px)).max(1e-9);
        let steps = if motion.poses.len() > 1 {
            (span_s / POSE_STEP_S).ceil().clamp(1.0, MAX_POSES)
        } else {
            1.0
        };
        (steps, span_s / steps)
    }

    /// The table of poses.
    pub fn poses(&self) -> Vec<Pose> {
        let (steps, step_s) = self.pose_steps();
        let (view, reference) = (self.view, self.reference().coords);
        let pose = |k: u32| view.motion.pose_at(view.start.plus(f64::from(k) * step_s));
        (0..=steps as u32)
            .map(|k| relative_pose(&pose(k), &reference))
            .collect()
    }

    /// The view's constants, but for those of air and mirrors.
    pub fn constants(&self, job: &Job) -> layout::ViewConstants {
        let (camera, sensor) = (&self.view.camera, &self.view.sensor);
        let (lens, shutter) = (&camera.intrinsics, &camera.shutter);
        let (steps, step_s) = self.pose_steps();
        let (bent, reach) = (lens.distortion.coefficients(), lens.distortion.reach());
        let dark = Dark::new(self.view);
        layout::ViewConstants {
            focal_px: [lens.fx_px as f32, lens.fy_px as f32],
            centre_px: [lens.cx_px as f32, lens.cy_px as f32],
            size_px: [lens.width_px as f32, lens.height_px as f32],
            pose_per_row: (shutter.row_step_s() / step_s) as f32,
            pose_middle: ((shutter.delay_s(0.0) + 0.5 * shutter.exposure_s) / step_s) as f32,
            time_first_s: self.view.start.since(job.time) as f32,
            pose_step_s: step_s as f32,
            pose_last: steps as f32,
            electrons_per_cd_m2: self.view.electrons_per_cd_m2() as f32,
            black_dn: sensor.black_dn() as f32,
            dn_per_e: sensor.cell_dn_per_e().map(|k| k as f32),
            white_dn: f32::from(sensor.white_dn()),
            read_noise_e: sensor.read_noise_e as f32,
            full_well_e: sensor.full_well_e as f32,
            blooming: sensor.blooming as f32,
            dark_e: dark.base_e as f32,
            level_step_e: dark.step_e as f32,
            hot_step_e: dark.hot_step_e as f32,
            noise: u32::from(sensor.noise),
            key: self.view.noise.stream.key,
            frame: self.view.noise.frame,
            radial: [bent.k1, bent.k2, bent.k3, reach.powi(2)].map(|x| x as f32),
            tangential: [bent.p1, bent.p2].map(|x| x as f32),
            confusion_px_m: (self.view.pupil_m() * lens.fx_px) as f32,
            focus_per_m: self.view.lens.focus_m.map_or(0.0, |m| 1.0 / m) as f32,
            reach_px: self.defocus_reach_px(),
            halo_px: self.view.lens.halo_px as f32,
            saturation_e: self.view.saturation_e() as f32,
            headlights: self.headlights(&job.headlights),
            ..layout::ViewConstants::default()
        }
    }

    fn to(&self, light: &Headlight) -> Vector3<f64> {
        light.place() - self.reference()
    }

    /// The headlights that light the view.
    pub fn nearest<'h>(&self, headlights: &'h [Headlight]) -> Vec<&'h Headlight> {
        let mut nearest: Vec<&Headlight> = headlights.iter().collect();
        nearest.sort_by(|a, b| f64::total_cmp(&self.to(a).norm(), &self.to(b).norm()));
        nearest.truncate(MAX_HEADLIGHTS);
        nearest
    }

    fn headlights(&self, headlights: &[Headlight]) -> [layout::ViewHeadlight; MAX_HEADLIGHTS] {
        let mut slots = [layout::ViewHeadlight::default(); MAX_HEADLIGHTS];
        for (slot, light) in slots.iter_mut().zip(self.nearest(headlights)) {
            *slot = layout::ViewHeadlight {
                position_m: single(&self.to(light)),
                intensity_cd: light.intensity_cd as f32,
                axis: single(&light.axis()),
                exponent: light.exponent as f32,
            };
        }
        slots
    }

    /// Whether any row may see a ball.
    pub fn may_see(&self, centre: &Point3<f64>, radius_m: f64) -> bool {
        let c = self.middle.inverse_transform_point(centre).coords;
        let reach_m = radius_m + self.slack_m(&c);
        c.z > -reach_m && self.borders.iter().all(|n| n.dot(&c) > -reach_m)
    }

    /// Whether any row may see a body that is where it is at a time.
    pub fn may_see_body(&self, body: &Body, time: SimTime) -> bool {
        let centre = Point3::from(body.world_from_body.translation.vector);
        let rows = self.view.camera.intrinsics.height_px;
        let shutter = &self.view.camera.shutter;
        let end = self.view.start.plus(shutter.frame_span_s(rows));
        let longest_s = [self.view.start, end].map(|at| at.since(time).abs());
        let way_m = body.velocity_mps.norm() * longest_s[0].max(longest_s[1]);
        self.may_see(&centre, body.shape.half_extents_m().norm() + way_m)
    }

    /// Whether any row may see what lies between some places.
    pub fn may_see_between(&self, places: [Point3<f64>; 8]) -> bool {
        self.may_see_in(&self.borders, places)
    }

    /// The window of a part of the picture.
    pub fn window(&self, part: &Rectangle) -> Window {
        borders(&self.view.camera.intrinsics, part)
    }

    /// Whether any row may see in a window what lies between some places.
    pub fn may_see_in(&self, window: &Window, places: [Point3<f64>; 8]) -> bool {
        let places = places.map(|p| self.middle.inverse_transform_point(&p).coords);
        let inside = |n: &Vector3<f64>| places.iter().any(|c| n.dot(c) > -self.slack_m(c));
        inside(&Vector3::z()) && window.iter().all(inside)
    }

    /// How far a place in the camera's frame in mid-frame may be from where another row has it.
    fn slack_m(&self, c: &Vector3<f64>) -> f64 {
        self.way_m + self.turned_rad * c.norm()
    }

    /// Row of a place in mid-frame, where it is in the picture or so near to it that another row may see
    /// it.
    pub fn row_of(&self, place: &Point3<f64>) -> Option<f64> {
        let lens = &self.view.camera.intrinsics;
        let size = [lens.width_px, lens.height_px].map(f64::from);
        let seen = self.middle.inverse_transform_point(place);
        let pixel = (seen.z > 0.1).then(|| lens.project(&seen))?;
        let near = |p: &Point2<f64>| {
            (0..2).all(|k| (-BESIDE * size[k]..(1.0 + BESIDE) * size[k]).contains(&p[k]))
        };
        pixel.filter(near).map(|p| p.y)
    }

    /// How far around a pixel light comes from that is out of focus; 0 where nothing is.
    pub fn defocus_reach_px(&self) -> i32 {
        let [near_px, far_px] = [NEAREST_M, f64::INFINITY].map(|m| self.view.confusion_px(m));
        let widest_px = near_px.max(far_px);
        if widest_px < SHARP_PX {
            return 0;
        }
        (0.5 * widest_px + 1.0).ceil().min(MOST_REACH_PX) as i32
    }
}

/// A lens that bends lines bows the borders.
fn borders(lens: &Intrinsics, part: &Rectangle) -> Window {
    let near = part.at.map(|n| f64::from(n) - 0.5);
    let far = part.ends().map(|n| f64::from(n) - 0.5);
    let along = |k: usize| {
        let share = |i: usize| i as f64 / (BORDER_PLACES - 1) as f64;
        std::array::from_fn(|i| near[k] + (far[k] - near[k]) * share(i))
    };
    let (us, vs): ([f64; BORDER_PLACES], [f64; BORDER_PLACES]) = (along(0), along(1));
    let column = |u: f64| vs.map(|v| lens.ray(u, v).x);
    let row = |v: f64| us.map(|u| lens.ray(u, v).y);
    let least = |x: [f64; BORDER_PLACES]| x.into_iter().fold(f64::INFINITY, f64::min);
    let most = |x: [f64; BORDER_PLACES]| x.into_iter().fold(f64::NEG_INFINITY, f64::max);
    [
        Vector3::new(1.0, 0.0, -least(column(near[0]))),
        Vector3::new(-1.0, 0.0, most(column(far[0]))),
        Vector3::new(0.0, 1.0, -least(row(near[1]))),
        Vector3::new(0.0, -1.0, most(row(far[1]))),
    ]
    .map(|n| n.normalize())
}

/// To f32.
pub fn single(v: &Vector3<f64>) -> [f32; 3] {
    v.map(|x| x as f32).into()
}

fn relative_pose(world_from_camera: &Isometry3<f64>, reference: &Vector3<f64>) -> Pose {
    let r = world_from_camera.rotation.inverse().to_rotation_matrix();
    let t = r * (reference - world_from_camera.translation.vector);
    let row = |k: usize| [r[(k, 0)], r[(k, 1)], r[(k, 2)], t[k]].map(|x| x as f32);
    Pose {
        x: row(0),
        y: row(1),
        z: row(2),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::print_stdout, reason = "a test prints its figures")]
    use super::super::detail::{ChunkKey, Detail};
    use super::super::tunnel::chunk_mesh;
    use super::*;
    use crate::bus::{Distortion, lenses};
    use crate::track::TrackPoint;
    use crate::twin::render::lit_scene::LitScene;
    use crate::twin::render::sample;

    /// Provokes sides of the tunnel that are left out though some row of some camera sees them: every
    /// corner of every triangle, by the lens, from where the camera is in five rows of a frame at
    /// 160 km/h.
    #[test]
    fn nothing_that_is_seen_is_left_out() {
        let scene = LitScene::new(sample::scene());
        let track = &scene.tracks[0];
        let meshes = [8, 9, 10, 11, 12, 30, 80, 81, 82, 100].map(|index| {
            let key = ChunkKey {
                track: 0,
                index,
                detail: Detail::Close,
                bend: None,
                dark: [false; 2],
            };
            chunk_mesh(&scene, key)
        });
        let (mut seen, mut left_out) = (0, 0);
        for (k, s_m) in [50.0, 52.5, 404.0].into_iter().cycle().take(72).enumerate() {
            let turn = 15f64.to_radians() * k as f64;
            let mut view = sample::rig_view(track, s_m, 160.0 / 3.6);
            for (pose, step) in view.motion.poses.iter_mut().zip(-1..) {
                let at = TrackPoint {
                    s_m: s_m + 160.0 / 3.6 * 1e-3 * f64::from(step),
                    l_m: 1.08,
                    h_m: 1.75,
                };
                // Shaken by 17 degrees a second, as a bogie's ride on bad rails.
                let pitch = 0.5 * (7.0 * turn).sin() + 3e-4 * f64::from(step);
                *pose = sample::camera_pose(track, at, turn, pitch);
            }
            if k % 2 == 1 {
                view.camera.intrinsics.distortion = Distortion::new(lenses::EUROC[0]);
            }
            let framed = Framed::new(&view);
            let lens = &view.camera.intrinsics;
            let rows = f64::from(lens.height_px);
            let poses = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| {
                let mid = view.camera.shutter.row_mid(view.start, share * rows);
                view.motion.pose_at(mid)
            });
            for made in &meshes {
                for part in &made.parts {
                    let corners = part.indices.clone().map(|k| made.mesh.indices[k as usize]);
                    let in_picture = corners.into_iter().any(|k| {
                        let p = made.mesh.vertices[k as usize].position_m;
                        let p = made.origin + Vector3::from(p).cast::<f64>();
                        poses.iter().any(|pose| {
                            let c = pose.inverse_transform_point(&p);
                            let pixel = (c.z > 0.05).then(|| lens.project(&c)).flatten();
                            pixel.is_some_and(|q| {
                                let width = f64::from(lens.width_px);
                                (0.0..width).contains(&q.x) && (0.0..rows).contains(&q.y)
                            })
                        })
                    });
                    let around = part.around.map(|p| made.origin + p.cast());
                    let drawn = framed.may_see_between(around);
                    assert!(
                        drawn || !in_picture,
                        "camera {k} does not draw what it sees"
                    );
                    seen += usize::from(in_picture);
                    left_out += usize::from(!drawn);
                }
            }
        }
        println!("{seen} sides in the picture, {left_out} left out");
        assert!(seen > 300 && left_out > 300, "{seen} {left_out}");
    }
}
