//! What moves in the 3-D view: train, cameras, obstacles, and where the stack takes them to be.

use super::observer_error::{Result, failed};
use super::palette::{self, ui};
use super::scene::{HEAD, RecordedScene, turn};
use super::stream::RowStream;
use super::{images, path_of, slug};
use crate::bus::{DetectedObstacle, LedReport, Method, RigCalibration, SimTime, TrainId};
use crate::session::TrainOpening;
use crate::track::TrackPoint;
use crate::twin::geometry::{Body, Hull, Shape};
use crate::twin::physics::TrainState;
use nalgebra::{Isometry3, Point3, Vector3};
use re_sdk_types::archetypes::{
    Boxes3D, Capsules3D, Cylinders3D, Ellipsoids3D, LineStrips3D, Mesh3D, Points3D, Transform3D,
};
use re_sdk_types::components::{Color, FillMode, RotationQuat};
use rerun::AsComponents;
use std::collections::BTreeSet;
use std::rc::Rc;

const SIGHT: &str = "world/estimate/sight";

/// Poses of one entity that wait to be sent.
struct Poses {
    path: String,
    times_ns: Vec<i64>,
    places: Vec<[f32; 3]>,
    turns: Vec<RotationQuat>,
}

impl Poses {
    fn of(path: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            times_ns: Vec::new(),
            places: Vec::new(),
            turns: Vec::new(),
        }
    }

    fn push(&mut self, scene: &RecordedScene, time: SimTime, pose: &Isometry3<f64>) {
        self.times_ns.push(time.nanos());
        self.places.push(scene.place(pose));
        self.turns.push(turn(pose));
    }

    fn flush(&mut self, stream: &RowStream) -> Result {
        if self.times_ns.is_empty() {
            return Ok(());
        }
        let columns = Transform3D::update_fields()
            .with_many_translation(self.places.drain(..))
            .with_many_quaternion(self.turns.drain(..))
            .columns_of_unit_batches()
            .map_err(failed(self.path.as_str()))?;
        stream.columns(&self.path, &self.times_ns, columns)?;
        self.times_ns.clear();
        Ok(())
    }
}

/// The moving part of the 3-D view.
pub(super) struct Moving {
    stream: RowStream,
    id: TrainId,
    scene: Rc<RecordedScene>,
    /// Both eyes, where there is a rig.
    rig: Option<(RigCalibration, [Poses; 2])>,
    /// The head, then the cars of the first train; empty where there is neither train nor rig.
    train: Vec<Poses>,
    left: Option<Isometry3<f64>>,
    /// Paths of what may be none, and is there.
    shown: BTreeSet<String>,
    /// Methods whose masts are drawn.
    masts: Vec<Method>,
}

impl Moving {
    /// Draws a train, and makes ready for its motion.
    pub(super) fn open(
        stream: RowStream,
        scene: Rc<RecordedScene>,
        train: Option<&TrainOpening>,
    ) -> Result<Self> {
        let id = train.map(|train| train.id).unwrap_or_default();
        let half = train.map_or(Vector3::zeros(), |train| train.car_half_extents_m);
        let half = half.map(|x| x as f32);
        // The cars of other trains than the first are among the bodies.
        let is_first = id == TrainId::default();
        let cars = train.map_or(0, |train| if is_first { train.cars } else { 0 });
        let has_head = train.is_some_and(|train| train.cars > 0 || train.rig.is_some());
        let rig = train.and_then(|train| train.rig);
        for car in 0..cars {
            let body = Boxes3D::from_half_sizes([[half.x, half.y, half.z]])
                .with_colors([palette::TRAIN])
                .with_fill_mode(FillMode::TransparentFillMajorWireframe);
            stream.log_static(&car_path(car), &body)?;
        }
        let eyes = [images::LEFT, images::RIGHT].map(|eye| path_of(id, eye));
        if let Some(rig) = rig {
            for (eye, camera) in eyes.iter().zip([rig.left, rig.right]) {
                stream.log_static(eye, &images::pinhole(&camera.intrinsics, 1.2))?;
            }
        }
        let mut train = Vec::new();
        if has_head {
            let head = path_of(id, HEAD);
            // On the head itself: the viewer's eye can follow only what has a shape of its own,
            // and keeps a distance that fits its size.
            let (mast, tip) = mast(8.4, "true", palette::TRUTH);
            stream.log_static(&head, &[&mast as &dyn AsComponents, &tip])?;
            train.push(Poses::of(head));
            train.extend((0..cars).map(|car| Poses::of(car_path(car))));
        }
        Ok(Self {
            stream,
            id,
            scene,
            rig: rig.map(|rig| (rig, eyes.map(Poses::of))),
            train,
            left: None,
            shown: BTreeSet::new(),
            masts: Vec::new(),
        })
    }

    /// Keeps the train's pose for the next flush.
    pub(super) fn train(&mut self, truth: &TrainState, world_from_left: Option<&Isometry3<f64>>) {
        let head_and_cars =
            std::iter::once(&truth.world_from_vehicle).chain(&truth.world_from_cars);
        for (poses, pose) in self.train.iter_mut().zip(head_and_cars) {
            poses.push(&self.scene, truth.time, pose);
        }
        if let (Some(left), Some((rig, eyes))) = (world_from_left, &mut self.rig) {
            let right = left * rig.left_from_right;
            for (poses, pose) in eyes.iter_mut().zip([*left, right]) {
                poses.push(&self.scene, truth.time, &pose);
            }
        }
        self.left = world_from_left.copied();
    }

    /// Sends the poses kept.
    pub(super) fn flush(&mut self) -> Result {
        let eyes = self.rig.iter_mut().flat_map(|(_, eyes)| eyes);
        self.train
            .iter_mut()
            .chain(eyes)
            .try_for_each(|poses| poses.flush(&self.stream))
    }

    /// Logs things of which there may be none: an empty row takes the last ones away, once.
    fn log(&mut self, path: &str, any: bool, things: &dyn AsComponents) -> Result {
        let were_there = self.shown.remove(path);
        if any {
            self.shown.insert(path.to_owned());
        }
        if any || were_there {
            self.stream.log(path, things)?;
        }
        Ok(())
    }

    /// Shows the blades of switches.
    pub(super) fn blades(&mut self, time: SimTime, bodies: &[Body]) -> Result {
        self.stream.at(time);
        self.boxes("world/blades", bodies)
    }

    fn boxes(&mut self, path: &str, bodies: &[Body]) -> Result {
        let s = Solids::of(&self.scene, bodies, |shape| matches!(shape, Shape::Box(_)));
        let any = !s.sizes.is_empty();
        let boxes = Boxes3D::from_centers_and_half_sizes(s.places, s.sizes)
            .with_quaternions(s.turns)
            .with_colors(s.colours)
            .with_fill_mode(FillMode::Solid);
        self.log(path, any, &boxes)
    }

    /// Shows obstacles, workers and whatever else is solid.
    pub(super) fn bodies(&mut self, time: SimTime, bodies: &[Body]) -> Result {
        self.stream.at(time);
        let scene = self.scene.clone();
        let hulls = Hulls::of(&scene, bodies);
        let (path, any) = ("world/bodies/hulls", !hulls.triangles.is_empty());
        self.log(path, any, &hulls.mesh())?;

        let solids = |is_kind: fn(&Shape) -> bool| Solids::of(&scene, bodies, is_kind);
        self.boxes("world/bodies/boxes", bodies)?;

        let s = solids(|shape| matches!(shape, Shape::Cylinder(..)));
        let (any, [radii, lengths]) = (!s.sizes.is_empty(), s.radii_and_lengths());
        let cylinders = Cylinders3D::from_lengths_and_radii(lengths, radii)
            .with_centers(s.places)
            .with_quaternions(s.turns)
            .with_colors(s.colours)
            .with_fill_mode(FillMode::Solid);
        self.log("world/bodies/cylinders", any, &cylinders)?;

        let s = solids(|shape| matches!(shape, Shape::Sphere(_)));
        let any = !s.sizes.is_empty();
        let spheres = Ellipsoids3D::from_centers_and_half_sizes(s.places, s.sizes)
            .with_colors(s.colours)
            .with_fill_mode(FillMode::Solid);
        self.log("world/bodies/spheres", any, &spheres)?;

        let s = solids(|shape| matches!(shape, Shape::Capsule(..)));
        let (any, [radii, lengths]) = (!s.sizes.is_empty(), s.radii_and_lengths());
        let capsules = Capsules3D::from_lengths_and_radii(lengths, radii)
            .with_translations(s.places)
            .with_quaternions(s.turns)
            .with_colors(s.colours)
            .with_fill_mode(FillMode::Solid);
        self.log("world/bodies/capsules", any, &capsules)
    }

    /// Marks where the stack takes the train to be, and the lamp that it looked at.
    pub(super) fn fixes(&mut self, report: &LedReport) -> Result {
        for fix in &report.fixes {
            self.stream.at_frame(fix.time, report.number);
            let (name, colour) = palette::method(fix.method);
            let height_m = match fix.method {
                Method::Stereo => 10.8,
                Method::Mono => 12.0,
            };
            let path = path_of(self.id, &format!("world/estimate/{name}"));
            let place = Transform3D::from_translation(self.scene.local(&fix.position));
            self.stream.log(&path, &place)?;
            // Drawn with the first fix: before it, there is nothing to show.
            if !self.masts.contains(&fix.method) {
                self.masts.push(fix.method);
                let (mast, tip) = mast(height_m, name, colour);
                let mast = [&mast as &dyn AsComponents, &tip];
                self.stream.log(&format!("{path}/mast"), &mast)?;
            }
        }
        let seen = report.fixes.first().and_then(|fix| {
            let lamp = self.scene.lamp(fix.uid)?;
            let eye = self.scene.place(&self.left?);
            Some((fix, [eye, self.scene.local(lamp)]))
        });
        let label = seen.map(|(fix, _)| format!("lamp {}", fix.uid));
        let colour = seen.map(|(fix, _)| palette::identity(fix.identity));
        let sight = LineStrips3D::new(seen.map(|(_, line)| line))
            .with_radii([ui(1.5)])
            .with_colors(colour)
            .with_labels(label);
        self.stream.at_frame(report.time, report.number);
        self.log(&path_of(self.id, SIGHT), seen.is_some(), &sight)
    }

    /// Shows where a wayside device takes obstacles to be. The time must have been set.
    pub(super) fn obstacles(&mut self, device: &str, obstacles: &[DetectedObstacle]) -> Result {
        let (mut places, mut sizes, mut turns) = (Vec::new(), Vec::new(), Vec::new());
        for o in obstacles {
            let alignment = self.scene.beside(device);
            let frame = alignment.at(0.5 * (o.from_chainage_m + o.to_chainage_m));
            let foot = TrackPoint {
                s_m: frame.s_m,
                l_m: o.lateral_m,
                h_m: 0.0,
            };
            let centre = alignment.world_from_track(foot);
            let centre = Point3::new(centre.x, centre.y, o.position.z + 0.5 * o.height_m);
            let length_m = (o.to_chainage_m - o.from_chainage_m).abs();
            places.push(self.scene.local(&centre));
            sizes.push([length_m, o.width_m, o.height_m].map(|x| (0.5 * x) as f32));
            turns.push(turn(&frame.world_from_line()));
        }
        let boxes = Boxes3D::from_centers_and_half_sizes(places, sizes)
            .with_quaternions(turns)
            .with_colors(obstacles.iter().map(|o| palette::danger(o.danger)))
            .with_labels(obstacles.iter().map(images::danger_label));
        let path = format!("world/estimate/obstacles/{}", slug(device));
        self.log(&path, !obstacles.is_empty(), &boxes)
    }
}

fn car_path(car: usize) -> String {
    format!("world/train/car_{}", car + 1)
}

/// A mast over the vehicle frame's origin with its name on top: estimates stand in the train,
/// where a point would be hidden.
fn mast(height_m: f32, name: &str, colour: Color) -> (LineStrips3D, Points3D) {
    let top = [0.0, 0.0, height_m];
    let mast = LineStrips3D::new([[[0.0; 3], top]])
        .with_radii([ui(1.5)])
        .with_colors([colour]);
    let tip = Points3D::new([top])
        .with_radii([0.12])
        .with_colors([colour])
        .with_labels([name]);
    (mast, tip)
}

/// Bodies of one kind of shape.
#[derive(Default)]
struct Solids {
    places: Vec<[f32; 3]>,
    turns: Vec<RotationQuat>,
    /// Half extents, or radius and length.
    sizes: Vec<[f32; 3]>,
    colours: Vec<Color>,
}

impl Solids {
    fn of(scene: &RecordedScene, bodies: &[Body], is_kind: fn(&Shape) -> bool) -> Self {
        let mut solids = Self::default();
        for body in bodies.iter().filter(|body| is_kind(&body.shape)) {
            let (size, shift_m) = match &body.shape {
                Shape::Cylinder(radius, half) => (Vector3::new(*radius, 2.0 * half, 0.0), 0.0),
                // rerun's capsule starts at its origin, ours is centred on it.
                Shape::Capsule(radius, half) => (Vector3::new(*radius, 2.0 * half, 0.0), -half),
                shape => (shape.half_extents_m(), 0.0),
            };
            let place = body.world_from_body * Point3::new(0.0, 0.0, shift_m);
            solids.places.push(scene.local(&place));
            solids.turns.push(turn(&body.world_from_body));
            solids.sizes.push(size.map(|x| x as f32).into());
            let shines = body.luminance_cd_m2 > 0.0;
            let colours = [palette::BODY, palette::LAMP];
            solids.colours.push(colours[usize::from(shines)]);
        }
        solids
    }

    fn radii_and_lengths(&self) -> [Vec<f32>; 2] {
        [0, 1].map(|k| self.sizes.iter().map(|size| size[k]).collect())
    }
}

/// All bodies with corners, as one mesh of flat triangles.
#[derive(Default)]
struct Hulls {
    corners: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Hulls {
    fn of(scene: &RecordedScene, bodies: &[Body]) -> Self {
        let mut hulls = Self::default();
        for body in bodies {
            if let Shape::Hull(hull) = &body.shape {
                hulls.push(scene, body, hull);
            }
        }
        hulls
    }

    fn push(&mut self, scene: &RecordedScene, body: &Body, hull: &Hull) {
        for face in hull.faces() {
            let first = self.corners.len() as u32;
            let normal = body.world_from_body * face.normal;
            for k in &face.corners {
                let corner = body.world_from_body * hull.corners()[*k];
                self.corners.push(scene.local(&corner));
                self.normals.push(normal.map(|x| x as f32).into());
            }
            let fan = 2..face.corners.len() as u32;
            self.triangles
                .extend(fan.map(|k| [first, first + k - 1, first + k]));
        }
    }

    fn mesh(self) -> Mesh3D {
        Mesh3D::new(self.corners)
            .with_vertex_normals(self.normals)
            .with_triangle_indices(self.triangles)
            .with_albedo_factor(palette::BODY.0)
    }
}
