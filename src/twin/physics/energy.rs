//! The energy book of a train: what traction and gravity put in, where it went, what is left.

use schemars::JsonSchema;
use serde::Serialize;

/// Energy and power of one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Ledger {
    /// Held by springs.
    pub springs_j: f64,
    /// Taken by dampers.
    pub dampers_w: f64,
    /// Taken by creep of wheels on rails.
    pub creep_w: f64,
    /// Given by traction.
    pub traction_w: f64,
    /// Taken by brakes.
    pub brake_w: f64,
    /// Taken by running resistance.
    pub resistance_w: f64,
}

/// Energy of the train since the start, J. What was there at the start and came in by traction is
/// still there, or was lost: [`Self::gap_j`] says by how much this fails. Hits are not in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct EnergyBook {
    /// Put in by traction, at the wheels' treads.
    pub traction_j: f64,
    /// Taken by the brakes.
    pub brake_j: f64,
    /// Taken by running resistance: air and bearings.
    pub resistance_j: f64,
    /// Taken by dampers of suspension, couplers and track.
    pub dampers_j: f64,
    /// Taken by creep of wheels on rails: in curves, and where they slip or slide.
    pub creep_j: f64,
    /// Kinetic energy now.
    pub kinetic_j: f64,
    /// Potential energy now, against the start.
    pub potential_j: f64,
    /// Kinetic energy at the start.
    pub start_kinetic_j: f64,
}

impl EnergyBook {
    /// Enters a step.
    pub(super) fn enter(&mut self, now: &Ledger, dt_s: f64) {
        self.traction_j += now.traction_w * dt_s;
        self.brake_j += now.brake_w * dt_s;
        self.resistance_j += now.resistance_w * dt_s;
        self.dampers_j += now.dampers_w * dt_s;
        self.creep_j += now.creep_w * dt_s;
    }

    /// All that was lost.
    pub fn lost_j(&self) -> f64 {
        self.brake_j + self.resistance_j + self.dampers_j + self.creep_j
    }

    /// What came in and is neither there nor known to be lost.
    pub fn gap_j(&self) -> f64 {
        let gained = self.kinetic_j - self.start_kinetic_j + self.potential_j;
        self.traction_j - self.lost_j() - gained
    }

    /// [`Self::gap_j`] as a share of all that was turned over.
    pub fn gap_share(&self) -> f64 {
        self.gap_j().abs()
            / (self.start_kinetic_j + self.traction_j + self.potential_j.abs()).max(1.0)
    }
}
