//! Tiles, lights and bodies as the shader takes them.

use super::occluder::{Occluder, WIDE_M};
use crate::twin::geometry::{Body, Shape};
use crate::twin::render::disc::{DISC_PLACES, disc_points};
use crate::twin::render::gpu::layout::{Blocker, Corner, ShadowSource, Slab, Tile};
use crate::twin::render::gpu::tiles::TILE_PX;
use crate::twin::render::gpu::view::{Framed, single};
use crate::twin::render::light_source::LightSource;
use crate::twin::render::scene::Job;
use nalgebra::{Point3, Vector3};

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
            ..Corner::default()
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
pub fn source(light: &LightSource<'_>, reference: &Point3<f64>) -> ShadowSource {
    // The first place on the disc tells which way the others are counted from.
    let mut places = disc_points(&light.centre, &light.axis, light.radius_m, DISC_PLACES);
    let aside = (places.next().unwrap_or(light.centre) - light.centre) * 32f64.sqrt();
    ShadowSource {
        position_m: single(&(light.centre - reference)),
        intensity_cd: light.intensity_cd as f32,
        axis: single(&light.axis),
        exponent: light.exponent as f32,
        aside_m: single(&aside),
        reach_m: light.reach_m as f32,
        up_m: single(&aside.cross(&light.axis)),
        ..ShadowSource::default()
    }
}

/// A body, whose pairs of planes it appends.
pub fn blocker(
    body: &Body,
    occluder: &Occluder,
    reference: &Point3<f64>,
    slabs: &mut Vec<Slab>,
) -> Blocker {
    let first_slab = slabs.len() as u32;
    slabs.extend(occluder.slabs.iter().map(|(normal, low_m, high_m)| Slab {
        normal: single(normal),
        low_m: *low_m as f32,
        high_m: *high_m as f32,
        ..Slab::default()
    }));
    // What is between slabs alone is in a tube that holds everything.
    let (radius_m, axis) = match &body.shape {
        Shape::Sphere(radius) => (*radius, Vector3::zeros()),
        Shape::Capsule(radius, half) => (*radius, Vector3::z() * *half),
        Shape::Cylinder(radius, _) => (*radius, Vector3::z()),
        Shape::Box(_) | Shape::Hull(_) => (WIDE_M, Vector3::zeros()),
    };
    Blocker {
        centre_m: single(&(body.world_from_body.translation.vector - reference.coords)),
        radius_m: radius_m as f32,
        velocity_mps: single(&body.velocity_mps),
        first_slab,
        axis: single(&(body.world_from_body.rotation * axis)),
        end_slab: slabs.len() as u32,
    }
}
