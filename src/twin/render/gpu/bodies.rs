//! The bodies of a job on the adapter.

use super::adapter::Gpu;
use super::layout::Vertex;
use super::mesh::{Fineness, Mesh};
use super::upload::Upload;
use crate::twin::render::lamp_field::LampField;
use crate::twin::render::scene::Job;
use std::ops::Range;

/// The triangles of all bodies of a job.
pub struct BodyBuffers {
    /// Corners.
    pub vertices: Upload<Vertex>,
    /// Triangles.
    pub indices: Upload<u32>,
    /// Range of indices of each body.
    pub ranges: Vec<Range<u32>>,
}

impl BodyBuffers {
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            vertices: Upload::new(gpu, wgpu::BufferUsages::VERTEX, 1 << 12),
            indices: Upload::new(gpu, wgpu::BufferUsages::INDEX, 1 << 12),
            ranges: Vec::new(),
        }
    }

    /// Takes the bodies of the next job.
    pub fn write(&mut self, gpu: &Gpu, job: &Job, lamps: &LampField, ambient_lx: f64) {
        let mut mesh = Mesh::default();
        self.ranges.clear();
        for body in &job.bodies {
            let first = mesh.indices.len() as u32;
            let fineness = Fineness::of(body, &job.views);
            mesh.add_body(body, lamps, ambient_lx, fineness);
            self.ranges.push(first..mesh.indices.len() as u32);
        }
        self.vertices.send_all(gpu, mesh.vertices);
        self.indices.send_all(gpu, mesh.indices);
    }
}
