//! What goes to the adapter anew for every view.

use super::adapter::Gpu;
use super::target::texture;

/// A buffer that grows with what is written to it.
pub struct Upload {
    pub(super) buffer: wgpu::Buffer,
    /// So many items were written last.
    pub(super) count: u32,
    usage: wgpu::BufferUsages,
}

impl Upload {
    /// Of at least one item's size, which may not be 0.
    pub fn new(gpu: &Gpu, usage: wgpu::BufferUsages, size: usize) -> Self {
        let usage = usage | wgpu::BufferUsages::COPY_DST;
        Self {
            buffer: allocate(gpu, usage, size as u64),
            count: 0,
            usage,
        }
    }

    /// Takes effect before anything submitted later, and after anything submitted before.
    pub fn write<T: bytemuck::Pod>(&mut self, gpu: &Gpu, items: &[T]) {
        self.count = items.len() as u32;
        let bytes: &[u8] = bytemuck::cast_slice(items);
        if bytes.is_empty() {
            return;
        }
        if (bytes.len() as u64) > self.buffer.size() {
            self.buffer = allocate(gpu, self.usage, (bytes.len() as u64).next_power_of_two());
        }
        gpu.queue.write_buffer(&self.buffer, 0, bytes);
    }

    /// All of it.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        self.buffer.as_entire_binding()
    }
}

fn allocate(gpu: &Gpu, usage: wgpu::BufferUsages, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// Rows of numbers that grow in number. A texture, since software adapters read it for many pixels at
/// once, but a buffer one pixel after the other.
pub struct Table {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl Table {
    /// Of one number.
    pub fn new(gpu: &Gpu) -> Self {
        Self::sized(gpu, (1, 1))
    }

    fn sized(gpu: &Gpu, size: (u32, u32)) -> Self {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = texture(&gpu.device, size, wgpu::TextureFormat::R32Float, usage);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { texture, view }
    }

    /// Takes rows of `width` numbers each; when, as with [`Upload::write`].
    pub fn write(&mut self, gpu: &Gpu, numbers: &[f32], width: u32) {
        let height = numbers.len() as u32 / width.max(1);
        if height == 0 {
            return;
        }
        let has = (self.texture.width(), self.texture.height());
        if has.0 < width || has.1 < height {
            *self = Self::sized(
                gpu,
                (has.0.max(width), has.1.max(height.next_power_of_two())),
            );
        }
        gpu.queue.write_texture(
            self.texture.as_image_copy(),
            bytemuck::cast_slice(numbers),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * width),
                rows_per_image: None,
            },
            wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
        );
    }

    /// All of it.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::TextureView(&self.view)
    }
}
