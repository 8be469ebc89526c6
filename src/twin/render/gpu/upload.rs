//! Buffers on the adapter.

use super::adapter::Gpu;

impl Gpu {
    /// Of these items, with room for at least so many, which may not be 0. Takes effect before
    /// anything submitted later.
    pub fn upload<T: bytemuck::Pod>(
        &self,
        usage: wgpu::BufferUsages,
        items: &[T],
        room: usize,
    ) -> wgpu::Buffer {
        let size = items.len().max(room) * size_of::<T>();
        let usage = usage | wgpu::BufferUsages::COPY_DST;
        let buffer = empty_buffer(&self.device, size as u64, usage);
        (self.queue).write_buffer(&buffer, 0, bytemuck::cast_slice(items));
        buffer
    }

    /// Of a list for a shader to read.
    pub fn storage<T: bytemuck::Pod>(&self, items: &[T]) -> wgpu::Buffer {
        self.upload(wgpu::BufferUsages::STORAGE, items, 1)
    }
}

/// Empty.
pub fn empty_buffer(device: &wgpu::Device, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage,
        mapped_at_creation: false,
    })
}
