//! Which lamps do not shine: a roll call as the train runs past, for the maintenance.
//!
//! The train knows where it is, so it knows which lamps an eye must have in its picture. One that
//! was due in several pairs, well inside the picture and near, and answered in none of them, is
//! dark. It says nothing of lamps while the position is unknown or the eye has a fault.

use crate::bus::Intrinsics;
use crate::track::Tunnel;
use crate::track::uid::Uid;
use nalgebra::{Isometry3, Point2, Point3};

/// A lamp is due nearer than this to the eye: there it covers a thousand pixels.
const NEAR_M: f64 = 8.0;
/// And so far inside the picture, which is more than a lamp's radius and the position's error take.
const INSIDE_PX: f64 = 120.0;
/// A spot so near to where a lamp is due is its answer.
const ANSWER_PX: f64 = 100.0;
/// Pairs in which a lamp must have been due to be called dark.
const CALLS: u32 = 4;

/// A lamp that is passing by.
#[derive(Clone, Copy, Debug)]
struct Call {
    lamp: usize,
    calls: u32,
    answered: bool,
}

/// Calls the lamps of the map.
#[derive(Debug, Default)]
pub struct RollCall {
    passing: Vec<Call>,
}

impl RollCall {
    /// An eye at `world_from_eye`, as the train takes itself to be, has seen lamps at `spots`. Gives
    /// the lamps that have gone out of its sight without ever having been seen.
    pub fn call(
        &mut self,
        map: &Tunnel,
        lens: &Intrinsics,
        world_from_eye: &Isometry3<f64>,
        spots: impl Iterator<Item = Point2<f64>> + Clone,
    ) -> Vec<Uid> {
        let due = |lamp: &Point3<f64>| {
            let seen = world_from_eye.inverse_transform_point(lamp);
            let pixel = lens
                .project(&seen)
                .filter(|_| seen.coords.norm() < NEAR_M)?;
            let (w, h) = (f64::from(lens.width_px), f64::from(lens.height_px));
            let inside = (INSIDE_PX..w - INSIDE_PX).contains(&pixel.x)
                && (INSIDE_PX..h - INSIDE_PX).contains(&pixel.y);
            inside.then_some(pixel)
        };
        let eye = Point3::from(world_from_eye.translation.vector);
        for (lamp, site) in map.lamps.iter().enumerate() {
            // Cheap, and true of all but one or two of them.
            if (site.centre - eye).norm_squared() > NEAR_M * NEAR_M {
                continue;
            }
            let Some(pixel) = due(&site.centre) else {
                continue;
            };
            let answered = spots.clone().any(|spot| (spot - pixel).norm() < ANSWER_PX);
            let known = self.passing.iter().position(|call| call.lamp == lamp);
            let k = known.unwrap_or_else(|| {
                self.passing.push(Call {
                    lamp,
                    calls: 0,
                    answered: false,
                });
                self.passing.len() - 1
            });
            self.passing[k].calls += 1;
            self.passing[k].answered |= answered;
        }
        let mut dark = Vec::new();
        self.passing.retain(|call| {
            let site = &map.lamps[call.lamp];
            let passing =
                (site.centre - eye).norm() < 2.0 * NEAR_M && is_ahead(world_from_eye, site);
            if !passing && call.calls >= CALLS && !call.answered {
                dark.push(site.uid);
            }
            passing
        });
        dark
    }

    /// Forgets who is passing: what was due cannot be told any more.
    pub fn forget(&mut self) {
        self.passing.clear();
    }
}

/// Whether a lamp may still come, or come back, into the picture.
fn is_ahead(world_from_eye: &Isometry3<f64>, site: &crate::track::LampSite) -> bool {
    world_from_eye.inverse_transform_point(&site.centre).z > 0.3
        && site
            .facing
            .dot(&(Point3::from(world_from_eye.translation.vector) - site.centre))
            > 0.0
}
