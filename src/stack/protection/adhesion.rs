//! What the wheels tell of the rails: whether they slide, and what the brake is then held to reach.
//!
//! The slide and slip protection of a wheelset acts where the wheel no longer turns as the train runs.
//! From then on the rails count as slippery until the train has run [`SLIPPERY_FOR_M`] without it: the
//! emergency brake is held to reach `low_adhesion_mps2` only, and while the wheels slide the true
//! speed may be above what they say by k times `slide_error`.

use super::ProtectionSettings;
use crate::stack::odometry::Odometry;

/// Leaf film lies in stretches of some hundred metres, with gaps.
const SLIPPERY_FOR_M: f64 = 500.0;

/// What may be expected of brake and odometer on the rails as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grip {
    /// The wheelset of the odometer slides or slips now.
    pub slides: bool,
    /// Guaranteed rate of the emergency brake on level track.
    pub emergency_mps2: f64,
    /// The train may be faster than the odometer says by so much.
    pub speed_error_mps: f64,
}

/// Remembers where wheels slid.
#[derive(Clone, Debug, Default)]
pub(super) struct Adhesion {
    /// Distance run when a wheel slid last.
    slid_at_m: Option<f64>,
}

impl Adhesion {
    /// What holds now. Called every cycle.
    pub fn update(&mut self, odometry: &Odometry, run_m: f64, s: &ProtectionSettings) -> Grip {
        let slides = odometry.slides();
        if slides {
            self.slid_at_m = Some(run_m);
        }
        let slippery = (self.slid_at_m).is_some_and(|at_m| (run_m - at_m).abs() < SLIPPERY_FOR_M);
        let mut grip = Grip {
            slides,
            emergency_mps2: s.emergency_mps2,
            speed_error_mps: s.speed_error_kmh / 3.6,
        };
        if slippery {
            grip.emergency_mps2 = s.emergency_mps2.min(s.low_adhesion_mps2);
        }
        if slides {
            let speed_mps = odometry.mean_speed_mps().unwrap_or(0.0);
            grip.speed_error_mps += s.position_sigmas * s.slide_error * speed_mps;
        }
        grip
    }
}
