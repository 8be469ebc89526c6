//! Obstacles, workers and trains in a picture: which pixels are whose, boxes in the image and in
//! space, what is hidden.

use super::coco::Mask;
use crate::record::parquet::table_rows;
use crate::track::{Alignment, Gauge};
use crate::twin::geometry::Body;
use crate::twin::physics::{BodyLabel, BodyOwner};
use crate::twin::render::Job;
use crate::twin::render::constants::SIGHT_M;
use crate::twin::render::labels::{Labels, Projection, Surface, Whole, whole};
use image::{ImageBuffer, Luma};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;

table_rows! {
    /// A row of `obstacles.parquet`.
    struct ObstacleRow {
        /// the frame, as in frames.parquet
        frame_id: i64, "";
        /// who it is, the same in all frames; the value of its pixels in mask/
        instance_id: u32, "";
        /// as in the scenario
        name: String, "";
        /// obstacle, cable, worker or train (one car)
        kind: &'static str, "";
        /// pixels that show it
        visible_px: u32, "px";
        /// first column of the visible pixels; null where none
        left_px: Option<usize>, "px";
        /// first row
        top_px: Option<usize>, "px";
        /// last column + 1
        right_px: Option<usize>, "px";
        /// last row + 1
        bottom_px: Option<usize>, "px";
        /// the same of the whole thing, as if nothing hid it and the image had no frame; null where
        /// it reaches beside the camera
        whole_left_px: Option<f64>, "px";
        /// first row
        whole_top_px: Option<f64>, "px";
        /// last column + 1
        whole_right_px: Option<f64>, "px";
        /// last row + 1
        whole_bottom_px: Option<f64>, "px";
        /// pixels of the whole
        whole_px: Option<f64>, "px";
        /// of its pixels in the frame, those that nothing hides
        visible_share: Option<f64>, "";
        /// share of the whole that is out of the frame
        truncation: Option<f64>, "";
        /// centre of the box in the camera's axes (right, down, forward), in the middle of the
        /// frame
        camera_x_m: f64, "m";
        /// down
        camera_y_m: f64, "m";
        /// forward: its depth
        camera_z_m: f64, "m";
        /// centre of the box in the world (east, north, up), in the middle of the frame
        x_m: f64, "m";
        /// north
        y_m: f64, "m";
        /// up
        z_m: f64, "m";
        /// attitude of the box, world_from_box: of a single solid its own axes, of others (workers,
        /// cables) along the line, left, up
        qx: f64, "";
        /// the quaternion's y
        qy: f64, "";
        /// its z
        qz: f64, "";
        /// its real part
        qw: f64, "";
        /// of the box along its x
        length_m: f64, "m";
        /// along its y
        width_m: f64, "m";
        /// along its z
        height_m: f64, "m";
        /// of the box's centre
        chainage_m: f64, "m";
        /// left of the centreline
        lateral_m: f64, "m";
        /// above top of rail
        above_rail_m: f64, "m";
        /// of its fastest part
        speed_mps: f64, "m/s";
        /// whether any of it is inside the structure gauge; null for trains
        in_gauge: Option<bool>, "";
        /// from the camera to the box's centre
        distance_m: f64, "m";
    }
}

/// All bodies of one owner.
pub(super) struct Instance<'a> {
    pub id: u32,
    pub name: &'a str,
    /// Index into the categories of COCO.
    pub category: usize,
    owner: BodyOwner,
    bodies: Vec<usize>,
    pub mask: Mask,
}

/// Numbers of instances: what is loose counts from 1, the others from here.
const CABLES: usize = 20_001;
const WORKERS: usize = 30_001;
const LOADS: usize = 40_001;
const TRAINS: usize = 50_001;
/// Most cars of a train.
const CARS: usize = 100;

/// The owner's number in masks and tables, and its category; none for a part of the track.
fn identity(owner: BodyOwner) -> Option<(u32, usize)> {
    let (id, category) = match owner {
        BodyOwner::Obstacle(k) => (1 + k, 0),
        BodyOwner::Cable(k) => (CABLES + k, 1),
        BodyOwner::Worker(k) => (WORKERS + k, 2),
        BodyOwner::Load(k) => (LOADS + k, 0),
        BodyOwner::Car(train, car) => (TRAINS + CARS * train.index() + car, 3),
        BodyOwner::Blade(_) => return None,
    };
    Some((id.min(usize::from(u16::MAX)) as u32, category))
}

/// What is within sight, with the pixels of each.
pub(super) fn instances<'a>(
    job: &Job,
    owners: &'a [(BodyOwner, String)],
    sight: &Projection<'_>,
    labels: &Labels,
) -> Vec<Instance<'a>> {
    let eye = sight.pose(0.0).translation.vector;
    let near = |body: &Body| {
        let away_m = (body.world_from_body.translation.vector - eye).norm();
        away_m - body.shape.half_extents_m().norm() < SIGHT_M
    };
    let mut groups: BTreeMap<BodyOwner, (&str, Vec<usize>)> = BTreeMap::new();
    for (k, (body, (owner, name))) in job.bodies.iter().zip(owners).enumerate() {
        if near(body) {
            groups.entry(*owner).or_insert((name, Vec::new())).1.push(k);
        }
    }
    let camera = &sight.view.camera.intrinsics;
    let size = [camera.height_px as usize, camera.width_px as usize];
    let columns = columns_of_bodies(labels, size[1], job.bodies.len());
    let make = |(owner, (name, bodies)): (BodyOwner, (&'a str, Vec<usize>))| {
        let own = bodies.iter().filter_map(|k| columns[*k]);
        let [begin, end] = own
            .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
            .unwrap_or_default();
        let mask = Mask::of(size, begin..end, |u, v| {
            let surface = labels.surface[v * size[1] + u];
            matches!(surface, Surface::Body(k) if bodies.contains(&usize::from(k)))
        });
        let (id, category) = identity(owner)?;
        Some(Instance {
            id,
            name,
            category,
            owner,
            bodies,
            mask,
        })
    };
    groups.into_iter().filter_map(make).collect()
}

/// First column in which each body shows, and one after the last.
fn columns_of_bodies(labels: &Labels, width: usize, bodies: usize) -> Vec<Option<[usize; 2]>> {
    let mut columns = vec![None; bodies];
    for (k, surface) in labels.surface.iter().enumerate() {
        if let Surface::Body(body) = surface {
            let u = k % width;
            let [begin, end] = columns[usize::from(*body)].get_or_insert([u, u + 1]);
            (*begin, *end) = ((*begin).min(u), (*end).max(u + 1));
        }
    }
    columns
}

/// The picture of numbers.
pub(super) fn picture(
    owners: &[(BodyOwner, String)],
    sight: &Projection<'_>,
    labels: &Labels,
) -> ImageBuffer<Luma<u16>, Vec<u16>> {
    let camera = &sight.view.camera.intrinsics;
    let id = |owner: BodyOwner| identity(owner).map_or(0, |(id, _)| id as u16);
    let ids: Vec<u16> = owners.iter().map(|(owner, _)| id(*owner)).collect();
    let mut image = ImageBuffer::new(camera.width_px, camera.height_px);
    for (pixel, surface) in image.iter_mut().zip(&labels.surface) {
        if let Surface::Body(k) = surface {
            *pixel = ids[usize::from(*k)];
        }
    }
    image
}

impl ObstacleRow {
    /// Of an instance of which any is in the frame.
    pub fn new(
        frame_id: i64,
        job: &Job,
        sight: &Projection<'_>,
        line: (&Alignment, f64),
        instance: &Instance<'_>,
    ) -> Option<Self> {
        let bodies: Vec<&Body> = instance.bodies.iter().map(|k| &job.bodies[*k]).collect();
        let extent = whole(&bodies, sight);
        let visible_px = instance.mask.area();
        if visible_px == 0 && extent.is_none_or(|w| w.in_frame < 1.0) {
            return None;
        }
        let edge = |k: usize| instance.mask.bounds().map(|b| b[k]);
        let of_whole = |get: fn(&Whole) -> f64| extent.as_ref().map(get);
        let space = Space::of(&bodies, sight, line);
        let centre = space.pose.translation.vector;
        let [qx, qy, qz, qw] = space.pose.rotation.coords.into();
        let [chainage_m, lateral_m, above_rail_m] = space.on_line;
        let speeds = bodies.iter().map(|b| b.velocity_mps.norm());
        let is_car = matches!(instance.owner, BodyOwner::Car(..));
        Some(Self {
            frame_id,
            instance_id: instance.id,
            name: instance.name.to_owned(),
            kind: super::coco::CATEGORIES[instance.category],
            visible_px,
            left_px: edge(0),
            top_px: edge(1),
            right_px: edge(2),
            bottom_px: edge(3),
            whole_left_px: of_whole(|w| w.low.x),
            whole_top_px: of_whole(|w| w.low.y),
            whole_right_px: of_whole(|w| w.high.x + 1.0),
            whole_bottom_px: of_whole(|w| w.high.y + 1.0),
            whole_px: of_whole(|w| w.pixels),
            visible_share: visible_share(visible_px, extent.as_ref()),
            truncation: of_whole(|w| 1.0 - w.in_frame / w.pixels),
            camera_x_m: space.in_camera.x,
            camera_y_m: space.in_camera.y,
            camera_z_m: space.in_camera.z,
            x_m: centre.x,
            y_m: centre.y,
            z_m: centre.z,
            qx,
            qy,
            qz,
            qw,
            length_m: space.size_m.x,
            width_m: space.size_m.y,
            height_m: space.size_m.z,
            chainage_m,
            lateral_m,
            above_rail_m,
            speed_mps: speeds.fold(0.0, f64::max),
            in_gauge: (!is_car).then_some(space.in_gauge),
            distance_m: space.in_camera.coords.norm(),
        })
    }
}

/// Of the pixels in the frame, those that show it.
fn visible_share(visible: u32, extent: Option<&Whole>) -> Option<f64> {
    let in_frame = extent?.in_frame;
    (in_frame > 0.0).then(|| (f64::from(visible) / in_frame).min(1.0))
}

/// Bodies in space, in the middle of a frame.
struct Space {
    pose: Isometry3<f64>,
    size_m: Vector3<f64>,
    in_camera: Point3<f64>,
    /// Chainage, left of the centreline, above top of rail.
    on_line: [f64; 3],
    in_gauge: bool,
}

impl Space {
    fn of(bodies: &[&Body], sight: &Projection<'_>, (line, near_m): (&Alignment, f64)) -> Self {
        let mid = 0.5 * (f64::from(sight.view.camera.intrinsics.height_px) - 1.0);
        let after_s = sight.after_s(mid);
        let first = bodies.first().map_or(Point3::origin(), |b| {
            b.world_from_body.translation.vector.into()
        });
        let near_m = line.track_from_world(&first, near_m).s_m;
        let along = line.at(near_m).world_from_line().rotation;
        let axes = match bodies {
            [single] => single.world_from_body.rotation,
            _ => along,
        };
        let (pose, size_m) = bounds(bodies, after_s, &axes);
        let centre = Point3::from(pose.translation.vector);
        let place = line.track_from_world(&centre, near_m);
        let half = 0.5 * bounds(bodies, after_s, &along).1;
        let gauge = Gauge::b1(line.at(place.s_m).curvature_per_m);
        Self {
            pose,
            size_m,
            in_camera: sight.pose(mid).inverse_transform_point(&centre),
            on_line: [place.s_m, place.l_m, place.h_m],
            in_gauge: gauge.fouled_by([place.l_m, place.h_m], [half.y, half.z]),
        }
    }
}

/// The box with these axes around bodies.
fn bounds(
    bodies: &[&Body],
    after_s: f64,
    axes: &UnitQuaternion<f64>,
) -> (Isometry3<f64>, Vector3<f64>) {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = -low;
    for body in bodies {
        let centre = body.world_from_body.translation.vector + body.velocity_mps * after_s;
        let centre = axes.inverse() * centre;
        for axis in 0..3 {
            let towards = axes * Vector3::ith(axis, 1.0);
            let own = body.world_from_body.rotation.inverse() * towards;
            high[axis] = high[axis].max(centre[axis] + body.shape.reach_m(&own));
            low[axis] = low[axis].min(centre[axis] - body.shape.reach_m(&-own));
        }
    }
    let centre = axes * (0.5 * (low + high));
    (
        Isometry3::from_parts(Translation3::from(centre), *axes),
        high - low,
    )
}

/// Owners with names of their own, to be kept.
pub(super) fn kept(owners: &[BodyLabel<'_>]) -> Vec<(BodyOwner, String)> {
    owners
        .iter()
        .map(|b| (b.owner, b.name.to_owned()))
        .collect()
}
