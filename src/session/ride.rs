//! How the train ran: distance, ride, wheel loads, slip, energy.

use super::OWN_TRAIN;
use super::summary::TrainFigures;
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
        self.first_m.get_or_insert(train.chainage_m);
        self.last_m = train.chainage_m;
        self.standing = train.standing;
        let accel = train.floor_accel_mps2;
        self.squares += accel.component_mul(&accel);
        self.samples += 1;
    }

    /// The figures; `None` without a train.
    pub fn finish(
        &self,
        world: &World,
        stop_at_m: Option<f64>,
        derailed: bool,
    ) -> Option<TrainFigures> {
        let (energy, first_m) = (world.energy(OWN_TRAIN)?, self.first_m?);
        let rms = (self.squares / f64::from(self.samples)).map(f64::sqrt);
        let worst = world.wheel_extremes(OWN_TRAIN)?;
        Some(TrainFigures {
            run_m: self.last_m - first_m,
            stop_error_m: stop_at_m.filter(|_| self.standing).map(|s| self.last_m - s),
            derailed,
            floor_accel_rms_mps2: rms.into(),
            least_wheel_load_share: worst.least_normal_n / world.wheel_load_n(OWN_TRAIN)?,
            most_slip_mps: worst.most_slip_mps,
            energy,
            energy_gap_share: energy.gap_share(),
        })
    }
}
