//! How the train ran: distance, ride, wheel loads, slip, energy.

use super::summary::TrainFigures;
use crate::bus::TrainId;
use crate::twin::physics::{TrainState, World};
use nalgebra::Vector3;

/// Sums over a run.
#[derive(Default)]
pub struct Ride {
    first_m: Option<f64>,
    last_m: f64,
    standing: bool,
    samples: u32,
    squares: Vector3<f64>,
}

impl Ride {
    /// Enters the truth at one time.
    pub fn on_motion(&mut self, train: &TrainState) {
        self.first_m.get_or_insert(train.run_m);
        self.last_m = train.run_m;
        self.standing = train.standing;
        let accel = train.floor_accel_mps2;
        self.squares += accel.component_mul(&accel);
        self.samples += 1;
    }

    /// The figures; `None` without a train.
    pub fn finish(&self, id: TrainId, world: &World, derailed: bool) -> Option<TrainFigures> {
        let (energy, first_m) = (world.energy(id)?, self.first_m?);
        let rms = (self.squares / f64::from(self.samples)).map(f64::sqrt);
        let worst = world.wheel_extremes(id)?;
        Some(TrainFigures {
            run_m: self.last_m - first_m,
            stop_error_m: (world.stop_m(id))
                .filter(|_| self.standing)
                .map(|mark_m| self.last_m - mark_m),
            derailed,
            floor_accel_rms_mps2: rms.into(),
            least_wheel_load_share: worst.least_normal_n / world.wheel_load_n(id)?,
            most_slip_mps: worst.most_slip_mps,
            most_lateral_n: worst.most_lateral_n,
            energy,
            energy_gap_share: energy.gap_share(),
        })
    }
}
