//! Obstacles, workers and trains in a picture: which pixels are whose, boxes in the image and in
//! space, what is hidden.

use super::coco::Mask;
use crate::record::parquet::Kind::{Flag, Int, Real, Text};
use crate::record::parquet::{Column, Value, column};
use crate::track::{Alignment, Gauge};
use crate::twin::geometry::Body;
use crate::twin::physics::{BodyLabel, BodyOwner};
use crate::twin::render::Job;
use crate::twin::render::constants::SIGHT_M;
use crate::twin::render::labels::{Labels, Projection, Surface, Whole, whole};
use image::{ImageBuffer, Luma};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;

pub(super) const COLUMNS: [Column; 35] = [
    column("frame_id", Int, "", "the frame, as in frames.parquet"),
    column(
        "instance_id",
        Int,
        "",
        "who it is, the same in all frames; the value of its pixels in mask/",
    ),
    column("name", Text, "", "as in the scenario"),
    column(
        "kind",
        Text,
        "",
        "obstacle, cable, worker or train (one car)",
    ),
    column("visible_px", Int, "px", "pixels that show it"),
    column(
        "left_px",
        Int,
        "px",
        "first column of the visible pixels; null where none",
    ),
    column("top_px", Int, "px", "first row"),
    column("right_px", Int, "px", "last column + 1"),
    column("bottom_px", Int, "px", "last row + 1"),
    column(
        "whole_left_px",
        Real,
        "px",
        "the same of the whole thing, as if nothing hid it and the image had no frame; null where it reaches beside the camera",
    ),
    column("whole_top_px", Real, "px", "first row"),
    column("whole_right_px", Real, "px", "last column + 1"),
    column("whole_bottom_px", Real, "px", "last row + 1"),
    column("whole_px", Real, "px", "pixels of the whole"),
    column(
        "visible_share",
        Real,
        "",
        "of its pixels in the frame, those that nothing hides",
    ),
    column(
        "truncation",
        Real,
        "",
        "share of the whole that is out of the frame",
    ),
    column(
        "camera_x_m",
        Real,
        "m",
        "centre of the box in the camera's axes (right, down, forward), in the middle of the frame",
    ),
    column("camera_y_m", Real, "m", "down"),
    column("camera_z_m", Real, "m", "forward: its depth"),
    column(
        "x_m",
        Real,
        "m",
        "centre of the box in the world (east, north, up), in the middle of the frame",
    ),
    column("y_m", Real, "m", "north"),
    column("z_m", Real, "m", "up"),
    column(
        "qx",
        Real,
        "",
        "attitude of the box, world_from_box: of a single solid its own axes, of others (workers, cables) along the line, left, up",
    ),
    column("qy", Real, "", "the quaternion's y"),
    column("qz", Real, "", "its z"),
    column("qw", Real, "", "its real part"),
    column("length_m", Real, "m", "of the box along its x"),
    column("width_m", Real, "m", "along its y"),
    column("height_m", Real, "m", "along its z"),
    column("chainage_m", Real, "m", "of the box's centre"),
    column("lateral_m", Real, "m", "left of the centreline"),
    column("above_rail_m", Real, "m", "above top of rail"),
    column("speed_mps", Real, "m/s", "of its fastest part"),
    column(
        "in_gauge",
        Flag,
        "",
        "whether any of it is inside the structure gauge; null for trains",
    ),
    column(
        "distance_m",
        Real,
        "m",
        "from the camera to the box's centre",
    ),
];

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

/// The owner's number in masks and tables, and its category.
fn identity(owner: BodyOwner) -> (u32, usize) {
    let (id, category) = match owner {
        BodyOwner::Obstacle(k) => (1 + k, 0),
        BodyOwner::Cable(k) => (CABLES + k, 1),
        BodyOwner::Worker(k) => (WORKERS + k, 2),
        BodyOwner::Load(k) => (LOADS + k, 0),
        BodyOwner::Car(train, car) => (TRAINS + CARS * train.index() + car, 3),
    };
    (id.min(usize::from(u16::MAX)) as u32, category)
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
        let (id, category) = identity(owner);
        Instance {
            id,
            name,
            category,
            owner,
            bodies,
            mask,
        }
    };
    groups.into_iter().map(make).collect()
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
    let ids: Vec<u16> = owners.iter().map(|(o, _)| identity(*o).0 as u16).collect();
    let mut image = ImageBuffer::new(camera.width_px, camera.height_px);
    for (pixel, surface) in image.iter_mut().zip(&labels.surface) {
        if let Surface::Body(k) = surface {
            *pixel = ids[usize::from(*k)];
        }
    }
    image
}

/// A row, and the share of the instance in the frame that nothing hides.
pub(super) struct Sighting {
    pub row: Vec<Value>,
    pub visible_share: Option<f64>,
}

/// An instance's row, where any of it is in the frame.
pub(super) fn row(
    frame_id: i64,
    job: &Job,
    sight: &Projection<'_>,
    line: (&Alignment, f64),
    instance: &Instance<'_>,
) -> Option<Sighting> {
    let bodies: Vec<&Body> = instance.bodies.iter().map(|k| &job.bodies[*k]).collect();
    let extent = whole(&bodies, sight);
    let visible = instance.mask.area();
    if visible == 0 && extent.is_none_or(|w| w.in_frame < 1.0) {
        return None;
    }
    let bounds = instance.mask.bounds();
    let bound = |k: usize| Value::from(bounds.map(|b| b[k] as i64));
    let of_whole = |get: fn(&Whole) -> f64| Value::from(extent.as_ref().map(get));
    let space = Space::of(&bodies, sight, line);
    let (centre, attitude) = (space.pose.translation.vector, space.pose.rotation.coords);
    let speeds = bodies.iter().map(|b| b.velocity_mps.norm());
    let visible_share = visible_share(visible, extent.as_ref());
    let row = vec![
        frame_id.into(),
        instance.id.into(),
        instance.name.into(),
        super::coco::CATEGORIES[instance.category].into(),
        visible.into(),
        bound(0),
        bound(1),
        bound(2),
        bound(3),
        of_whole(|w| w.low.x),
        of_whole(|w| w.low.y),
        of_whole(|w| w.high.x + 1.0),
        of_whole(|w| w.high.y + 1.0),
        of_whole(|w| w.pixels),
        visible_share.into(),
        of_whole(|w| 1.0 - w.in_frame / w.pixels),
        space.in_camera.x.into(),
        space.in_camera.y.into(),
        space.in_camera.z.into(),
        centre.x.into(),
        centre.y.into(),
        centre.z.into(),
        attitude.x.into(),
        attitude.y.into(),
        attitude.z.into(),
        attitude.w.into(),
        space.size_m.x.into(),
        space.size_m.y.into(),
        space.size_m.z.into(),
        space.on_line[0].into(),
        space.on_line[1].into(),
        space.on_line[2].into(),
        speeds.fold(0.0, f64::max).into(),
        (!matches!(instance.owner, BodyOwner::Car(..)))
            .then_some(space.in_gauge)
            .into(),
        space.in_camera.coords.norm().into(),
    ];
    Some(Sighting { row, visible_share })
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
