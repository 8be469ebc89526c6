//! How motion within a row's exposure is drawn.
//!
//! *Along the line.* A camera on a train moves along tunnel and rails, which are the same all along but for
//! their paint. So the paint of a pixel is the mean over the way that passes it, by a sample a texel.
//!
//! *Any other way*, as of bodies, of a camera that shakes, and of edges across the line, pictures are drawn
//! at several instants. An edge of contrast c that moves by s pixels within the exposure is a ramp of that
//! width; n instants make n steps of it, c / n high. They are off from it by up to c / 2n over s pixels: a
//! sum of squares of s c^2 / 12 n^2 an edge. So n grows with the root of s for the same error, that of an
//! edge drawn sharp that moves by [`SHARP_PX`].

use super::chunks::Chunk;
use super::rectangle::Rectangle;
use super::tiles::{Eyes, TileBounds};
use super::view::Framed;
use crate::bus::SimTime;
use crate::twin::geometry::Body;
use nalgebra::{Isometry3, Point3, Vector3};
use std::sync::Arc;

/// What moves by less than this within the exposure may be drawn sharp.
const SHARP_PX: f64 = 0.5;
/// Square of the contrast of a body's edge, over that of an edge on the tunnel.
const BODY_CONTRAST_SQUARED: f64 = 2.0;
/// Most instants.
const MAX_INSTANTS: f64 = 64.0;
/// Light of the tunnel's lamps is even over this way.
const EVEN_M: f64 = 0.25;
/// No surface is taken to be nearer to a camera than this.
const NEAREST_M: f64 = 0.3;
/// Places between the probes of near chunks may move by this many times as much as the probes.
const BETWEEN_PROBES: f64 = 1.25;
/// Only chunks nearer than this are probed; by the camera's travel farther ones move less in the picture.
const PROBED_M: f64 = 15.0;
/// What moves by less than this in a whole exposure stands still.
const STILL_PX: f64 = 0.05;

/// Motion in a picture while its middle row is exposed.
pub struct Smear<'a> {
    framed: &'a Framed<'a>,
    time: SimTime,
    open: Isometry3<f64>,
    close: Isometry3<f64>,
}

impl<'a> Smear<'a> {
    /// Of a view whose bodies are given at `time`.
    pub fn of(framed: &'a Framed<'a>, time: SimTime) -> Self {
        let (view, shutter) = (framed.view, &framed.view.camera.shutter);
        let rows = view.camera.intrinsics.height_px;
        let middle = shutter.row_open(view.start, 0.5 * f64::from(rows));
        Self {
            framed,
            time,
            open: view.motion.pose_at(middle),
            close: view.motion.pose_at(middle.plus(shutter.exposure_s)),
        }
    }

    /// How far the camera goes along a chunk.
    pub fn along_m(&self, chunk: &Chunk) -> f64 {
        self.travel().dot(&chunk.along)
    }

    /// How many instants of a row's exposure show all motion in it but that along the line, and the part of
    /// the picture that they are needed in.
    pub fn instants(&self, bodies: &[Body], chunks: &[Arc<Chunk>]) -> (u32, Rectangle) {
        let same = |chunk: &Chunk| match chunk.crossed {
            true => Vector3::zeros(),
            false => chunk.along * self.along_m(chunk),
        };
        let tunnel = count(self.tunnel_px(chunks, same));
        let tunnel = tunnel.max(count_of(self.travel().norm() / EVEN_M));
        let bodies_px = bodies.iter().map(|body| self.body_px(body));
        let all = tunnel.max(count(BODY_CONTRAST_SQUARED * bodies_px.fold(0.0, f64::max)));
        let part = match (all, tunnel) {
            (1, _) => Rectangle::default(),
            (_, 1) => self.around(bodies),
            _ => self.framed.whole(),
        };
        (all, part)
    }

    /// How many instants show what the tunnel mirrors, which does not move along with it.
    pub fn mirrored_instants(&self, chunks: &[Arc<Chunk>]) -> u32 {
        count(self.tunnel_px(chunks, |_| Vector3::zeros()))
    }

    /// By how much the tunnel moves in the picture, but for a way along which a chunk is the same.
    fn tunnel_px(&self, chunks: &[Arc<Chunk>], same: impl Fn(&Chunk) -> Vector3<f64>) -> f64 {
        if self.most_px() < SHARP_PX {
            return 0.0;
        }
        let reference = self.framed.reference();
        let near = chunks
            .iter()
            .filter(|c| (c.origin - reference).norm() < PROBED_M);
        let flow_px = near.flat_map(|chunk| {
            let way = same(chunk);
            let probes = chunk.probes.iter();
            probes.filter_map(move |probe| self.flow_px(&probe.at, way))
        });
        // Turning moves what is far away as much, also where none of the probes is in the picture.
        (BETWEEN_PROBES * flow_px.fold(0.0, f64::max)).max(self.turned_px())
    }

    /// The part of the picture that shows bodies which move in it.
    fn around(&self, bodies: &[Body]) -> Rectangle {
        let eyes = Eyes::exposed(self.framed, self.time);
        let moving = bodies.iter().filter(|body| self.body_px(body) > STILL_PX);
        let parts = moving.map(|body| TileBounds::of_outline(self.framed, &eyes, body));
        let parts = parts.map(|bounds| bounds.rectangle(self.framed.size_px()));
        let seen = parts.filter(|part| !part.is_empty());
        seen.reduce(|a, b| a.around(&b)).unwrap_or_default()
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

    /// By how much a place that goes some way moves in the picture, if it is there.
    fn flow_px(&self, place: &Point3<f64>, way: Vector3<f64>) -> Option<f64> {
        let lens = &self.framed.view.camera.intrinsics;
        let seen = |pose: &Isometry3<f64>, place: &Point3<f64>| {
            let place = pose.inverse_transform_point(place);
            (place.z > NEAREST_M).then(|| lens.project(&place))?
        };
        let (from, to) = (seen(&self.open, place)?, seen(&self.close, &(place + way))?);
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

/// Instants that show a motion by so many pixels.
fn count(moved_px: f64) -> u32 {
    count_of((moved_px / SHARP_PX).sqrt())
}

fn count_of(parts: f64) -> u32 {
    parts.ceil().clamp(1.0, MAX_INSTANTS) as u32
}
