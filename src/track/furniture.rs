//! What is fixed to the tunnel: lamps, wayside devices, balises, base stations, stopping places.

use super::uid::{LineCode, Uid};
use crate::settings::settings;
use nalgebra::{Point3, Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// No line is longer: chainages stay exact to a nanometre.
pub(super) const LONGEST_M: f64 = 1e6;

/// A lamp as surveyed.
#[derive(Clone, Debug, PartialEq)]
pub struct LampSite {
    /// Its name on the air.
    pub uid: Uid,
    /// Chainage.
    pub chainage_m: f64,
    /// Left of the centreline.
    pub lateral_m: f64,
    /// Above top of rail.
    pub height_m: f64,
    /// Centre of its disc in the world.
    pub centre: Point3<f64>,
    /// Where its disc faces, in the world.
    pub facing: Unit<Vector3<f64>>,
    /// Diameter of the luminous disc.
    pub diameter_m: f64,
    /// Electrical power; light output is this times the efficacy.
    pub power_w: f64,
    /// Luminous efficacy.
    pub efficacy_lm_per_w: f64,
    /// Full angle at which the intensity has fallen to half.
    pub beam_deg: f64,
    /// Duration of a chip of its code.
    pub chip_s: f64,
    /// Its code.
    pub code: LineCode,
}

settings! {
    /// A wayside device.
    pub struct WaysideSite {
        /// Name.
        name: String;
        /// Chainage, metres.
        chainage_m: f64;
        /// Left of the centreline, metres.
        lateral_m: f64;
        /// Above top of rail, metres.
        height_m: f64;
        /// Turn of its axis from up the line, to the left, degrees (180 looks down the line).
        yaw_deg: f64, in -360.0..=360.0;
        /// Tilt of its axis, up positive, degrees.
        pitch_deg: f64, in -90.0..=90.0;
        /// Name of the balise that gets its messages.
        balise: String;
    }
}

/// A balise between the rails.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Balise {
    /// Name.
    pub name: String,
    /// Chainage, metres.
    pub chainage_m: f64,
}

settings! {
    /// A radio base station and the stretch that it covers.
    pub struct BaseStation {
        /// Name.
        name: String;
        /// Chainage, metres.
        chainage_m: f64;
        /// Reach up and down the line, metres.
        reach_m: f64, in 1.0..=LONGEST_M;
    }
}

/// A place where trains stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StoppingPlace {
    /// Name.
    pub name: String,
    /// Where the head of a train stops, metres.
    pub chainage_m: f64,
}
