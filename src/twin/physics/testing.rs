//! What tests of the physics share.

use crate::bus::TrainId;
use crate::track::{Alignment, Grade, PlanElement, Track, Tunnel};
use nalgebra::Point3;
use std::sync::Arc;

/// The first train.
pub(super) const TRAIN: TrainId = TrainId(0);

/// A line of one slope without walls, 5 m over zero.
pub(super) fn line(elements: &[PlanElement], slope: f64) -> Arc<Tunnel> {
    let grade = Grade {
        from_m: 0.0,
        slope,
        radius_m: 0.0,
    };
    let alignment = Alignment::new(Point3::new(1000.0, 2000.0, 5.0), 0.4, elements, &[grade]);
    Arc::new(Tunnel::of_one(Track::bare("test", alignment)))
}
