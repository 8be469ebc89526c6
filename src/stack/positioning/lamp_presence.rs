//! Which lamps do not shine, found as the train runs past them, for the maintenance.
//!
//! The train knows where it is, so it knows which lamps an eye must have in its picture. One that
//! was due in several pairs, well inside the picture and near, and was seen in none of them, is
//! dark. It says nothing of lamps while the position is unknown or the eye has a fault. It assumes
//! that nothing hides the map's lamps: one behind a train on the next track, or behind a wall's end, is told dark.

use crate::bus::Intrinsics;
use crate::track::Track;
use crate::track::uid::Uid;
use nalgebra::{Isometry3, Point2, Point3};

/// A lamp is due nearer than this to the eye: there it covers a thousand pixels.
const NEAR_M: f64 = 8.0;
/// And so far inside the picture, which is more than a lamp's radius and the position's error take.
const INSIDE_PX: f64 = 120.0;
/// A spot so near to where a lamp is due is that lamp.
const SAME_PX: f64 = 100.0;
/// Pairs in which a lamp must have been due to be called dark.
const LEAST_PAIRS: u32 = 4;

/// A lamp that is due in an eye's sight, or was until now.
#[derive(Clone, Copy, Debug)]
struct DueLamp {
    lamp: usize,
    pairs: u32,
    seen: bool,
}

/// Holds the lamps that are seen against those of the map.
#[derive(Debug, Default)]
pub struct LampPresence {
    due: Vec<DueLamp>,
}

impl LampPresence {
    /// An eye at `world_from_eye`, as the train takes itself to be, has seen lamps at `spots`. Gives
    /// the lamps that have gone out of its sight without ever having been seen.
    pub fn check(
        &mut self,
        map: &Track,
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
            let seen = spots.clone().any(|spot| (spot - pixel).norm() < SAME_PX);
            let known = self.due.iter().position(|known| known.lamp == lamp);
            let k = known.unwrap_or_else(|| {
                self.due.push(DueLamp {
                    lamp,
                    pairs: 0,
                    seen: false,
                });
                self.due.len() - 1
            });
            self.due[k].pairs += 1;
            self.due[k].seen |= seen;
        }
        let mut dark = Vec::new();
        self.due.retain(|call| {
            let site = &map.lamps[call.lamp];
            let passing =
                (site.centre - eye).norm() < 2.0 * NEAR_M && is_ahead(world_from_eye, site);
            if !passing && call.pairs >= LEAST_PAIRS && !call.seen {
                dark.push(site.uid);
            }
            passing
        });
        dark
    }

    /// Forgets who is passing: what was due cannot be told any more.
    pub fn forget(&mut self) {
        self.due.clear();
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
