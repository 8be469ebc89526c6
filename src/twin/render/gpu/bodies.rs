//! The bodies of a job on the adapter.

use super::adapter::Gpu;
use super::mesh::{Fineness, Mesh};
use super::view::Framed;
use crate::twin::render::lit_scene::{BODIES_TRACK, LitScene};
use crate::twin::render::scene::Job;
use std::ops::Range;

/// The triangles of all bodies of a job.
pub struct BodyMeshes {
    /// Corners.
    pub vertices: wgpu::Buffer,
    /// Triangles.
    pub indices: wgpu::Buffer,
    /// Range of indices of each body; empty for those that no view may see.
    pub ranges: Vec<Range<u32>>,
}

impl BodyMeshes {
    /// Of a job.
    pub fn new(gpu: &Gpu, job: &Job, scene: &LitScene) -> Self {
        let mut mesh = Mesh::default();
        let mut ranges = Vec::new();
        let views = job.views.iter().filter(|_| !job.bodies.is_empty());
        let views: Vec<_> = views.map(Framed::new).collect();
        for body in &job.bodies {
            let first = mesh.indices.len() as u32;
            if !views
                .iter()
                .any(|framed| framed.may_see_body(body, job.time))
            {
                ranges.push(first..first);
                continue;
            }
            let fineness = Fineness::of(body, &job.views);
            let place = body.world_from_body.translation.vector.into();
            mesh.add_body(
                body,
                &scene.lamps,
                scene.surroundings_on(BODIES_TRACK, &place),
                fineness,
            );
            ranges.push(first..mesh.indices.len() as u32);
        }
        Self {
            vertices: gpu.upload(wgpu::BufferUsages::VERTEX, &mesh.vertices, 1),
            indices: gpu.upload(wgpu::BufferUsages::INDEX, &mesh.indices, 1),
            ranges,
        }
    }
}
