//! What a wayside device has in view: the truth that its reports are scored against.

use super::image_box::ImageBox;
use crate::bus::{SimTime, TrainId, WaysideCalibration};
use crate::scenario::{Scenario, WaysidePost};
use crate::track::{BED_M, TrackId, TrackPoint};
use crate::twin::geometry::{RayStart, TunnelCaster};
use crate::twin::physics::{WorkerTruth, World};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use std::sync::Arc;

/// How far a walking man's limbs reach from his middle.
const STRIDE_REACH_M: f64 = 0.4;

/// Something in the tunnel that a wayside device may rightly report.
#[derive(Clone, Debug, PartialEq)]
pub struct Presence {
    /// Name in the scenario.
    pub name: String,
    /// Largest dimension.
    pub size_m: f64,
    /// Chainage of its centre.
    pub chainage_m: f64,
    /// Its centre, left of the centreline.
    pub lateral_m: f64,
    /// Half its extent along the line.
    pub half_length_m: f64,
    /// Half its extent across.
    pub half_width_m: f64,
    /// Where it is in the picture; of a train, each car that is. What stands before it is not looked at.
    pub image_boxes: Vec<ImageBox>,
    /// Since when it lies still, on its own, where the device has it in view.
    pub lies_in_view_since: Option<SimTime>,
    /// It is scored as an obstacle (a worker or a train is not).
    pub obstacle: bool,
}

/// What a device can have in view: where it really hangs and looks, and the walls around it.
pub struct FieldOfView {
    device: WaysideCalibration,
    walls: Arc<TunnelCaster>,
    ray_start: RayStart,
}

impl FieldOfView {
    /// Of a device between walls.
    fn new(walls: Arc<TunnelCaster>, post: &WaysidePost) -> Self {
        let device = &post.actual;
        Self {
            ray_start: walls.ray_start(&device.world_from_camera.translation.vector.into(), None),
            device: device.clone(),
            walls,
        }
    }

    /// Of all devices of a scenario, in its order.
    pub fn of_all(scenario: &Scenario) -> Vec<Self> {
        if scenario.wayside.is_empty() {
            return Vec::new();
        }
        let walls = Arc::new(TunnelCaster::new(&scenario.tunnel.network.tracks));
        let posts = scenario.wayside.iter();
        posts.map(|post| Self::new(walls.clone(), post)).collect()
    }

    /// Whether a place is in the picture and not behind a wall. How far the detector looks, how small the
    /// thing is there, and what moves in between, does not matter.
    pub fn has_in_view(&self, place: &Point3<f64>) -> bool {
        let camera = &self.device.camera.intrinsics;
        let pose = &self.device.world_from_camera;
        let pixel = camera.project(&pose.inverse_transform_point(place));
        let eye = Point3::from(pose.translation.vector);
        let sight = place - eye;
        pixel.is_some_and(|p| camera.contains(&p))
            && self.walls.cast(self.ray_start, &eye, &sight, 1.0).is_none()
    }

    fn image_box(
        &self,
        world_from_box: &Isometry3<f64>,
        half_m: &Vector3<f64>,
    ) -> Option<ImageBox> {
        let camera_from_box = self.device.world_from_camera.inv_mul(world_from_box);
        ImageBox::of_box(&self.device.camera.intrinsics, &camera_from_box, half_m)
    }

    /// Everything that the device may rightly report.
    pub fn present(&self, world: &World) -> Vec<Presence> {
        let obstacles = world.obstacles().map(|o| {
            let pose = &o.world_from_body;
            let centre = pose.translation.vector.into();
            let place = [o.chainage_m, o.lateral_m];
            let [chainage_m, lateral_m] = self.as_watched(world, o.track, place, &centre);
            Presence {
                name: o.name.to_owned(),
                size_m: o.size_m.max(),
                chainage_m,
                lateral_m,
                half_length_m: o.half_extents_m.x,
                half_width_m: o.half_extents_m.y,
                image_boxes: self
                    .image_box(pose, &(0.5 * o.size_m))
                    .into_iter()
                    .collect(),
                lies_in_view_since: (o.resting_since)
                    .filter(|_| self.has_in_view(&pose.translation.vector.into())),
                obstacle: true,
            }
        });
        let workers = world.workers().map(|w| {
            let feet = TrackPoint {
                s_m: w.chainage_m,
                l_m: w.lateral_m,
                h_m: BED_M,
            };
            let feet = world.network().world_from_track(w.track, feet);
            let place = [w.chainage_m, w.lateral_m];
            let [chainage_m, lateral_m] =
                feet.map_or(place, |feet| self.as_watched(world, w.track, place, &feet));
            Presence {
                name: w.name.to_owned(),
                size_m: w.stature_m,
                chainage_m,
                lateral_m,
                half_length_m: STRIDE_REACH_M,
                half_width_m: STRIDE_REACH_M,
                image_boxes: self.worker_box(&w, world).into_iter().collect(),
                lies_in_view_since: None,
                obstacle: false,
            }
        });
        let trains = world.train_ids().filter_map(|id| self.train(world, id));
        obstacles.chain(workers).chain(trains).collect()
    }

    /// A place (chainage, left of the centreline) of a track as the track has it that the device watches.
    fn as_watched(
        &self,
        world: &World,
        track: TrackId,
        place: [f64; 2],
        at: &Point3<f64>,
    ) -> [f64; 2] {
        if track == self.device.track {
            return place;
        }
        let line = world.network().alignment(self.device.track);
        line.map_or(place, |line| {
            let point = line.track_from_world(at, self.device.chainage_m);
            [point.s_m, point.l_m]
        })
    }

    fn worker_box(&self, worker: &WorkerTruth<'_>, world: &World) -> Option<ImageBox> {
        let line = world.network().alignment(worker.track)?;
        let half_m = Vector3::new(STRIDE_REACH_M, STRIDE_REACH_M, 0.5 * worker.stature_m);
        let world_from_line = line.at(worker.chainage_m).world_from_line();
        let middle = Translation3::new(0.0, worker.lateral_m, BED_M + half_m.z);
        self.image_box(&(world_from_line * middle), &half_m)
    }

    fn train(&self, world: &World, id: TrainId) -> Option<Presence> {
        let (state, length_m) = (world.train(id)?, world.train_length_m(id)?);
        let half_m = world.car_half_extents_m(id)?;
        let middle_m = state.run_m - 0.5 * length_m;
        let (middle, _) = world.route(id)?.place(middle_m);
        let at = world.along_route(id)?.alignment.at(middle_m).origin;
        let [chainage_m, lateral_m] = self.as_watched(world, middle.track, [middle.s_m, 0.0], &at);
        let cars = state.world_from_cars.iter();
        Some(Presence {
            name: "train".into(),
            size_m: length_m,
            chainage_m,
            lateral_m,
            half_length_m: 0.5 * length_m,
            half_width_m: half_m.y,
            image_boxes: cars
                .filter_map(|car| self.image_box(car, &half_m))
                .collect(),
            lies_in_view_since: None,
            obstacle: false,
        })
    }
}

#[cfg(test)]
mod tests;
