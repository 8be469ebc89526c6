//! Reflectance of the tunnel's surface as a pixel sees it.

use crate::track::Material;
use crate::twin::geometry::SurfacePoint;
use crate::twin::render::constants::MIN_SINE;
use crate::twin::render::paint::Paintings;
use nalgebra::Vector3;

/// Mean albedo in a pixel whose ray hit at `at`; `aside` is by how much the ray changes over
/// the pixel's width and over its height. Rays are as long as they had to be to hit with
/// `t` of their length.
pub(super) fn albedo(
    paintings: &Paintings,
    at: &SurfacePoint,
    ray: &Vector3<f64>,
    t: f64,
    aside: [Vector3<f64>; 2],
) -> f64 {
    let painting = &paintings.all[paintings.of_range[at.range]];
    let begin_m = match at.material {
        Material::Rail => painting.rail_q_m(),
        _ => 0.0,
    };
    let across = aside.map(|step| footprint(at, ray, t, &step));
    painting.mean_over([at.s_m, begin_m + at.q_m], across)
}

/// By how much (s, q) changes where the ray turns by `step`: the point runs along the facet's
/// plane, which a pixel sees at [`MIN_SINE`] or steeper.
fn footprint(at: &SurfacePoint, ray: &Vector3<f64>, t: f64, step: &Vector3<f64>) -> [f64; 2] {
    let towards = at.normal.dot(ray);
    let least = MIN_SINE * ray.norm();
    let slope = at.normal.dot(step) / towards.abs().max(least).copysign(towards);
    let moved = (step - ray * slope) * t;
    at.gradients.map(|g| g.dot(&moved))
}
