//! What goes to the adapter anew for every view.

use super::adapter::Gpu;
use super::texture::Texture;
use std::mem::size_of;

/// A list, and the buffer on the adapter that it is sent to, which grows with it.
pub struct Upload<T> {
    /// As they are made for the view at hand.
    pub items: Vec<T>,
    /// As they were sent last.
    pub buffer: wgpu::Buffer,
}

impl<T: bytemuck::Pod> Upload<T> {
    /// With room for so many items, which may not be 0.
    pub fn new(gpu: &Gpu, usage: wgpu::BufferUsages, room: usize) -> Self {
        let usage = usage | wgpu::BufferUsages::COPY_DST;
        Self {
            items: Vec::new(),
            buffer: buffer(&gpu.device, (room * size_of::<T>()) as u64, usage),
        }
    }

    /// For a shader to read.
    pub fn storage(gpu: &Gpu) -> Self {
        Self::new(gpu, wgpu::BufferUsages::STORAGE, 1)
    }

    /// Takes effect before anything submitted later, and after anything submitted before.
    pub fn send(&mut self, gpu: &Gpu) {
        let bytes: &[u8] = bytemuck::cast_slice(&self.items);
        if bytes.is_empty() {
            return;
        }
        let size = bytes.len() as u64;
        if size > self.buffer.size() {
            self.buffer = buffer(&gpu.device, size.next_power_of_two(), self.buffer.usage());
        }
        gpu.queue.write_buffer(&self.buffer, 0, bytes);
    }

    /// Sends a list.
    pub fn send_all(&mut self, gpu: &Gpu, items: Vec<T>) {
        self.items = items;
        self.send(gpu);
    }

    /// All of it, once for each.
    pub fn instances(&self) -> std::ops::Range<u32> {
        0..self.items.len() as u32
    }

    /// For a shader to read.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        self.buffer.as_entire_binding()
    }
}

/// Empty.
pub fn buffer(device: &wgpu::Device, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// Rows of numbers that grow in number. A texture, since software adapters read it for many pixels at
/// once, but a buffer one pixel after the other.
pub struct NumberTable {
    /// As they are made for the view at hand.
    pub numbers: Vec<f32>,
    texture: Texture,
}

impl NumberTable {
    /// Of one number.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            numbers: Vec::new(),
            texture: number_texture(gpu, (1, 1)),
        }
    }

    /// Sends rows of `width` numbers each; when, as with [`Upload::send`].
    pub fn send(&mut self, gpu: &Gpu, width: u32) {
        let height = self.numbers.len() as u32 / width.max(1);
        if height == 0 {
            return;
        }
        let (columns, rows) = self.texture.size();
        if columns < width || rows < height {
            let size = (columns.max(width), rows.max(height.next_power_of_two()));
            self.texture = number_texture(gpu, size);
        }
        self.texture.write(gpu, &self.numbers, width);
    }

    /// For a shader to read.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        self.texture.binding()
    }
}

fn number_texture(gpu: &Gpu, size: (u32, u32)) -> Texture {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    Texture::new(&gpu.device, size, wgpu::TextureFormat::R32Float, usage)
}
