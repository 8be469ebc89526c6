//! What tests of the physics share.

use crate::bus::TrainId;
use crate::track::{Alignment, Grade, PlanElement, Tunnel};
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
    Arc::new(Tunnel {
        name: "test".to_owned(),
        datum: None,
        alignment: Alignment::new(Point3::new(1000.0, 2000.0, 5.0), 0.4, elements, &[grade]),
        sections: Vec::new(),
        lamps: Vec::new(),
        wayside: Vec::new(),
        balises: Vec::new(),
        base_stations: Vec::new(),
        line_number: 1,
        stations: Vec::new(),
        ambient_lx: 0.0,
    })
}
