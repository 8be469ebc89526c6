//! At how many instants of a row's exposure a view is drawn, and where they differ.
//!
//! An edge of contrast c that moves by s pixels within the exposure is a ramp of that width; n instants
//! make n steps of it, c / n high. They are off from it by up to c / 2n over s pixels: a sum of squares
//! of s c^2 / 12 n^2 an edge. So n grows with the root of s for the same error, that of an edge drawn
//! sharp that moves by [`SHARP_PX`].

use super::chunks::Chunk;
use super::rectangle::Rectangle;
use super::view::Framed;
use crate::bus::SimTime;
use crate::twin::geometry::{Body, Solid};
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use std::sync::Arc;

/// What moves by less than this within the exposure may be drawn sharp.
const SHARP_PX: f64 = 0.5;
/// Most instants.
const MAX_INSTANTS: f64 = 64.0;
/// No surface is taken to be nearer to a camera than this.
const NEAREST_M: f64 = 0.3;
/// So much farther than the probes of near chunks something between them may move.
const BETWEEN_PROBES: f64 = 1.25;
/// Chunks farther from a camera than this move less in its picture than near ones do.
const PROBED_M: f64 = 15.0;
/// What moves by less than this in a whole exposure stands still.
const STILL_PX: f64 = 0.05;

/// Motion in a picture while its middle row is exposed.
pub struct Smear<'a> {
    framed: &'a Framed<'a>,
    open: Isometry3<f64>,
    close: Isometry3<f64>,
    /// From the bodies' time to the frame's start and to its end.
    bodies_s: [f64; 2],
}

impl<'a> Smear<'a> {
    /// Of a view whose bodies are given at `time`.
    pub fn of(framed: &'a Framed<'a>, time: SimTime) -> Self {
        let (view, shutter) = (framed.view, &framed.view.camera.shutter);
        let rows = view.camera.intrinsics.height_px;
        let middle = shutter.row_open(view.start, 0.5 * f64::from(rows));
        let start_s = view.start.since(time);
        Self {
            framed,
            open: view.motion.pose_at(middle),
            close: view.motion.pose_at(middle.plus(shutter.exposure_s)),
            bodies_s: [start_s, start_s + shutter.frame_span_s(rows)],
        }
    }

    /// How many instants of a row's exposure show all motion in it.
    pub fn instants(&self, bodies: &[Body], chunks: &[Arc<Chunk>]) -> u32 {
        let most_px = if self.most_px() < SHARP_PX {
            0.0
        } else {
            let reference = self.framed.reference();
            let near = chunks
                .iter()
                .filter(|c| (c.origin - reference).norm() < PROBED_M);
            let probes = near.flat_map(|chunk| &chunk.probes);
            let flow_px = probes.filter_map(|probe| self.flow_px(&probe.at));
            BETWEEN_PROBES * flow_px.fold(0.0, f64::max)
        };
        let bodies_px = bodies.iter().map(|body| self.body_px(body));
        let most_px = bodies_px.fold(most_px, f64::max);
        (most_px / SHARP_PX).sqrt().ceil().clamp(1.0, MAX_INSTANTS) as u32
    }

    /// Where anything moves within the exposure: all over the picture of a camera that does, else
    /// where bodies do.
    pub fn moving(&self, bodies: &[Body]) -> Rectangle {
        let lens = &self.framed.view.camera.intrinsics;
        let size_px = [lens.width_px, lens.height_px];
        let whole = Rectangle::whole(size_px);
        // A lens that bends lines lets edges bulge beyond their ends.
        if self.most_px() > STILL_PX || !lens.distortion.is_none() {
            return whole;
        }
        let (mut low, mut high) = (Point2::from([f64::MAX; 2]), Point2::from([f64::MIN; 2]));
        for body in bodies.iter().filter(|body| self.body_px(body) > STILL_PX) {
            for after_s in self.bodies_s {
                for corner in Solid::at(body, after_s).corners() {
                    let corner = self.open.inverse_transform_point(&corner);
                    if corner.z < NEAREST_M {
                        return whole;
                    }
                    if let Some(pixel) = lens.project(&corner) {
                        (low, high) = (low.inf(&pixel), high.sup(&pixel));
                    }
                }
            }
        }
        Rectangle::between(low, high, size_px)
    }

    fn exposure_s(&self) -> f64 {
        self.framed.view.camera.shutter.exposure_s
    }

    fn travel(&self) -> Vector3<f64> {
        self.close.translation.vector - self.open.translation.vector
    }

    fn turned_px(&self) -> f64 {
        let f_px = self.framed.view.camera.intrinsics.fx_px;
        f_px * self.open.rotation.angle_to(&self.close.rotation)
    }

    /// What stands still and is farther away than [`NEAREST_M`] moves by no more than this.
    fn most_px(&self) -> f64 {
        let f_px = self.framed.view.camera.intrinsics.fx_px;
        self.turned_px() + f_px * self.travel().norm() / NEAREST_M
    }

    /// By how much a place that stands still moves, if it is in the picture.
    fn flow_px(&self, place: &Point3<f64>) -> Option<f64> {
        let lens = &self.framed.view.camera.intrinsics;
        let seen = |pose: &Isometry3<f64>| {
            let place = pose.inverse_transform_point(place);
            (place.z > NEAREST_M).then(|| lens.project(&place))?
        };
        let (from, to) = (seen(&self.open)?, seen(&self.close)?);
        (lens.contains(&from) || lens.contains(&to)).then(|| (to - from).norm())
    }

    /// By how much the near side of a body moves at most, if it may be in the picture.
    fn body_px(&self, body: &Body) -> f64 {
        let half = body.shape.half_extents_m();
        let centre = Point3::from(body.world_from_body.translation.vector);
        if !self.framed.may_see(&centre, half.norm()) {
            return 0.0;
        }
        let eye = body
            .world_from_body
            .inverse_transform_point(&self.framed.reference());
        let outside = (eye.coords.abs() - half).sup(&Vector3::zeros());
        let moved = body.velocity_mps * self.exposure_s() - self.travel();
        let f_px = self.framed.view.camera.intrinsics.fx_px;
        self.turned_px() + f_px * moved.norm() / outside.norm().max(NEAREST_M)
    }
}
