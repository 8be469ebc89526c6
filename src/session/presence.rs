//! What a wayside device has in view: the truth that its reports are scored against.

use crate::bus::{SimTime, WaysideCalibration};
use crate::scenario::{Scenario, WaysidePost};
use crate::track::BED_M;
use crate::twin::geometry::TunnelCaster;
use crate::twin::physics::World;
use nalgebra::Point3;

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
    /// Its lowest point over the bed, as high as it was while the frame was taken: what falls was
    /// higher when its row was read.
    pub foot_m: f64,
    /// Since when it lies still, on its own, where the device has it in view.
    pub lies_in_view_since: Option<SimTime>,
    /// It is scored as an obstacle (a worker or a train is not).
    pub obstacle: bool,
}

/// What a device can have in view: where it really hangs and looks, and the walls around it.
pub struct FieldOfView {
    device: WaysideCalibration,
    /// From the opening of a frame's first row to the closing of its last, at the longest.
    span_s: f64,
    reach_m: f64,
    walls: TunnelCaster,
    segment: usize,
}

impl FieldOfView {
    /// Of a device of a scenario.
    pub fn new(scenario: &Scenario, post: &WaysidePost) -> Self {
        let device = &post.actual;
        let walls = TunnelCaster::new(&scenario.tunnel);
        Self {
            segment: walls.segment_of(&device.world_from_camera.translation.vector.into(), None),
            device: device.clone(),
            span_s: post.camera.longest_span_s(),
            reach_m: scenario.file.stack.wayside.reach_m,
            walls,
        }
    }

    /// Whether a place is in the picture, within the detector's reach along the line, and not
    /// behind a wall. What moves in between does not matter.
    fn has_in_view(&self, place: &Point3<f64>, chainage_m: f64) -> bool {
        let camera = &self.device.camera.intrinsics;
        let pose = &self.device.world_from_camera;
        let pixel = camera.project(&pose.inverse_transform_point(place));
        let in_picture = pixel.is_some_and(|p| camera.contains(&p));
        let eye = Point3::from(pose.translation.vector);
        let sight = place - eye;
        in_picture
            && (chainage_m - self.device.chainage_m).abs() <= self.reach_m
            && self.walls.cast(self.segment, &eye, &sight, 1.0).is_none()
    }

    /// Everything that the device may rightly report.
    pub fn present(&self, world: &World) -> Vec<Presence> {
        let obstacles = world.obstacles().map(|o| Presence {
            name: o.name.to_owned(),
            size_m: o.size_m.max(),
            chainage_m: o.chainage_m,
            lateral_m: o.lateral_m,
            half_length_m: o.half_extents_m.x,
            half_width_m: o.half_extents_m.y,
            foot_m: o.height_m - o.half_extents_m.z - BED_M
                + (-o.velocity_mps.z * self.span_s).max(0.0),
            lies_in_view_since: o.resting_since.filter(|_| {
                self.has_in_view(&o.world_from_body.translation.vector.into(), o.chainage_m)
            }),
            obstacle: true,
        });
        let workers = world.workers().map(|w| Presence {
            name: w.name.to_owned(),
            size_m: w.stature_m,
            chainage_m: w.chainage_m,
            lateral_m: w.lateral_m,
            half_length_m: STRIDE_REACH_M,
            half_width_m: STRIDE_REACH_M,
            foot_m: 0.0,
            lies_in_view_since: None,
            obstacle: false,
        });
        let trains = world.train_ids().filter_map(|id| {
            let (state, length_m) = (world.train(id)?, world.train_length_m(id)?);
            let to_middle_m = 0.5 * length_m * state.direction.sign();
            Some(Presence {
                name: "train".into(),
                size_m: length_m,
                chainage_m: state.chainage_m - to_middle_m,
                lateral_m: 0.0,
                half_length_m: 0.5 * length_m,
                half_width_m: world.car_half_extents_m(id).unwrap_or_default().y,
                foot_m: 0.0,
                lies_in_view_since: None,
                obstacle: false,
            })
        });
        obstacles.chain(workers).chain(trains).collect()
    }
}

#[cfg(test)]
mod tests;
