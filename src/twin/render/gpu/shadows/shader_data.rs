//! Tiles, lights and bodies as the shader takes them.

use super::casts::Light;
use super::tiles::TILE_PX;
use crate::twin::geometry::{Body, Shape};
use crate::twin::render::disc::disc_places;
use crate::twin::render::gpu::layout::{Blocker, Corner, Slab, Source, Tile};
use crate::twin::render::gpu::view::{Framed, single};
use crate::twin::render::scene::Job;
use nalgebra::{Point3, Vector3};

/// Wider than any scene: a tube that holds everything.
const WIDE_M: f32 = 1e6;

/// A tile's place.
pub fn tile(framed: &Framed<'_>, job: &Job, column: u32, row: u32) -> Tile {
    let (view, reference) = (framed.view, framed.reference());
    let (lens, shutter) = (&view.camera.intrinsics, &view.camera.shutter);
    let side = |k: u32, size: u32| [k, k + 1].map(|k| f64::from((k * TILE_PX).min(size)) - 0.5);
    let (us, vs) = (side(column, lens.width_px), side(row, lens.height_px));
    let corner = |u: f64, v: f64| {
        let at = shutter.row_mid(view.start, v);
        let eye = view.motion.pose_at(at);
        Corner {
            origin_m: single(&(eye.translation.vector - reference.coords)),
            time_s: at.since(job.time) as f32,
            ray: single(&(eye.rotation * lens.ray(u, v))),
            unused: 0.0,
        }
    };
    Tile {
        low_px: [us[0], vs[0]].map(|x| x as f32),
        high_px: [us[1], vs[1]].map(|x| x as f32),
        corners: [
            corner(us[0], vs[0]),
            corner(us[1], vs[0]),
            corner(us[0], vs[1]),
            corner(us[1], vs[1]),
        ],
        ..Tile::default()
    }
}

/// A light.
pub fn source(light: &Light<'_>, reference: &Point3<f64>) -> Source {
    // The first place on the disc tells which way the others are counted from.
    let first = disc_places(&light.centre, &light.axis, light.radius_m)[0] - light.centre;
    let aside = first * 32f64.sqrt();
    Source {
        position_m: single(&(light.centre - reference)),
        intensity_cd: light.intensity_cd as f32,
        axis: single(&light.axis),
        exponent: light.exponent as f32,
        aside_m: single(&aside),
        reach_m: light.reach_m as f32,
        up_m: single(&aside.cross(&light.axis)),
        unused: 0.0,
    }
}

/// A body, whose pairs of planes it appends.
pub fn blocker(body: &Body, reference: &Point3<f64>, slabs: &mut Vec<Slab>) -> Blocker {
    let first_slab = slabs.len() as u32;
    let out = |v: Vector3<f64>| body.world_from_body.rotation * v;
    let mut slab = |normal: Vector3<f64>, low_m: f64, high_m: f64| {
        slabs.push(Slab {
            normal: single(&out(normal)),
            low_m: low_m as f32,
            high_m: high_m as f32,
            unused: [0.0; 3],
        });
    };
    let (radius_m, axis) = match &body.shape {
        Shape::Sphere(radius) => (*radius as f32, Vector3::zeros()),
        Shape::Capsule(radius, half) => (*radius as f32, Vector3::z() * *half),
        Shape::Cylinder(radius, half) => {
            slab(Vector3::z(), -half, *half);
            (*radius as f32, Vector3::z())
        }
        Shape::Box(half) => {
            for (axis, half) in [Vector3::x(), Vector3::y(), Vector3::z()]
                .into_iter()
                .zip(half.iter())
            {
                slab(axis, -half, *half);
            }
            (WIDE_M, Vector3::zeros())
        }
        Shape::Hull(hull) => {
            for face in hull.faces() {
                slab(face.normal, -f64::from(WIDE_M), face.offset_m);
            }
            (WIDE_M, Vector3::zeros())
        }
    };
    Blocker {
        centre_m: single(&(body.world_from_body.translation.vector - reference.coords)),
        radius_m,
        velocity_mps: single(&body.velocity_mps),
        first_slab,
        axis: single(&out(axis)),
        end_slab: slabs.len() as u32,
    }
}
