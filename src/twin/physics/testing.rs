//! What tests of the physics share.

use crate::bus::TrainId;
use crate::track::{Alignment, Grade, PlanElement, Track};
use nalgebra::Point3;
use std::sync::Arc;

/// The first train.
pub(super) const TRAIN: TrainId = TrainId(0);

/// A line of one slope without walls, 5 m over zero.
pub(super) fn line(elements: &[PlanElement], slope: f64) -> Arc<Track> {
    let grade = Grade {
        from_m: 0.0,
        slope,
        radius_m: 0.0,
    };
    Arc::new(Track {
        name: "test".to_owned(),
        alignment: Alignment::new(Point3::new(1000.0, 2000.0, 5.0), 0.4, elements, &[grade]),
        sections: Vec::new(),
        lamps: Vec::new(),
        wayside: Vec::new(),
        balises: Vec::new(),
        base_stations: Vec::new(),
        stations: Vec::new(),
        ambient_lx: 0.0,
    })
}
