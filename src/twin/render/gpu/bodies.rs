//! The bodies of a job on the adapter.

use super::adapter::Gpu;
use super::mesh::{Fineness, Mesh};
use super::upload::Upload;
use crate::twin::render::lamp_field::LampField;
use crate::twin::render::scene::Job;
use std::ops::Range;

/// The triangles of all bodies of a job.
pub struct BodyBuffers {
    /// Corners.
    pub vertices: Upload,
    /// Triangles.
    pub indices: Upload,
    /// Range of indices of each body.
    pub ranges: Vec<Range<u32>>,
    /// Where they are made, used again for every job.
    mesh: Mesh,
}

impl BodyBuffers {
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            vertices: Upload::new(gpu, wgpu::BufferUsages::VERTEX, 1 << 16),
            indices: Upload::new(gpu, wgpu::BufferUsages::INDEX, 1 << 16),
            ranges: Vec::new(),
            mesh: Mesh::default(),
        }
    }

    /// Takes the bodies of the next job.
    pub fn write(&mut self, gpu: &Gpu, job: &Job, lamps: &LampField, ambient_lx: f64) {
        let mesh = &mut self.mesh;
        mesh.vertices.clear();
        mesh.indices.clear();
        self.ranges.clear();
        for body in &job.bodies {
            let first = mesh.indices.len() as u32;
            let fineness = Fineness::of(body, &job.views);
            mesh.add_body(body, lamps, ambient_lx, fineness);
            self.ranges.push(first..mesh.indices.len() as u32);
        }
        self.vertices.write(gpu, &mesh.vertices);
        self.indices.write(gpu, &mesh.indices);
    }
}
