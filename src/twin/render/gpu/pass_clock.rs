//! How long the passes of a job take, by the adapter's own clock.

use super::adapter::Gpu;
use super::upload::empty_buffer;

/// Passes of a job that are timed; more are not.
const MOST_PASSES: u32 = 512;
/// A stamp, bytes.
const STAMP: u64 = size_of::<u64>() as u64;

/// When a pass of a job began and ended, milliseconds after the job's first pass began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassTime {
    /// Which pass.
    pub name: &'static str,
    /// Its begin.
    pub begin_ms: f64,
    /// Its end.
    pub end_ms: f64,
}

impl PassTime {
    /// How long it took.
    pub fn ms(&self) -> f64 {
        self.end_ms - self.begin_ms
    }
}

/// Stamps the passes of one job after the other.
pub struct PassClock {
    stamps: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    back: wgpu::Buffer,
    tick_ms: f64,
    names: Vec<&'static str>,
}

impl PassClock {
    /// On an adapter that has such a clock.
    pub fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let size = 2 * u64::from(MOST_PASSES) * STAMP;
        let (resolve, map) = (
            wgpu::BufferUsages::QUERY_RESOLVE,
            wgpu::BufferUsages::MAP_READ,
        );
        Self {
            stamps: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MOST_PASSES,
            }),
            resolved: empty_buffer(device, size, resolve | wgpu::BufferUsages::COPY_SRC),
            back: empty_buffer(device, size, map | wgpu::BufferUsages::COPY_DST),
            tick_ms: 1e-6 * f64::from(gpu.queue.get_timestamp_period()),
            names: Vec::new(),
        }
    }

    /// The stamps of the next pass; `None` where there are too many.
    pub fn stamps(&mut self, name: &'static str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let k = u32::try_from(self.names.len()).ok()?;
        (k < MOST_PASSES).then(|| {
            self.names.push(name);
            wgpu::RenderPassTimestampWrites {
                query_set: &self.stamps,
                beginning_of_pass_write_index: Some(2 * k),
                end_of_pass_write_index: Some(2 * k + 1),
            }
        })
    }

    /// Sends the stamps of all passes back.
    pub fn send_back(&self, encoder: &mut wgpu::CommandEncoder) {
        let count = 2 * self.names.len() as u32;
        encoder.resolve_query_set(&self.stamps, 0..count, &self.resolved, 0);
        let size = u64::from(count) * STAMP;
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.back, 0, size);
    }

    /// Asks for access as soon as they are there.
    pub fn request(&self) {
        self.back.map_async(wgpu::MapMode::Read, .., |_| {});
    }

    /// The times, once the adapter is done; the next job may begin.
    pub fn take(&mut self) -> Vec<PassTime> {
        let Ok(bytes) = self.back.get_mapped_range(..) else {
            return Vec::new();
        };
        let (stamps, _) = bytes.as_chunks::<{ STAMP as usize }>();
        let ticks: Vec<u64> = stamps
            .iter()
            .map(|stamp| u64::from_le_bytes(*stamp))
            .collect();
        drop(bytes);
        self.back.unmap();
        let first = ticks.first().copied().unwrap_or_default();
        let ms = |tick: u64| tick.saturating_sub(first) as f64 * self.tick_ms;
        let passes = self.names.drain(..).zip(ticks.chunks_exact(2));
        let times = passes.map(|(name, pair)| PassTime {
            name,
            begin_ms: ms(pair[0]),
            end_ms: ms(pair[1]),
        });
        times.collect()
    }
}
