//! Finding and opening a graphics adapter.

use crate::twin::render::{Backend, RenderError};
use std::ops::Range;
use std::sync::{Arc, Mutex};

/// The opened adapter.
pub struct Gpu {
    /// Makes buffers, textures and pipelines.
    pub device: wgpu::Device,
    /// Takes work.
    pub queue: wgpu::Queue,
    /// What it is.
    pub backend: Backend,
    software: bool,
    failure: Arc<Mutex<Option<String>>>,
}

/// All adapters of this machine, the preferred one first.
pub fn adapters() -> Vec<Backend> {
    found().iter().map(|a| describe(&a.get_info())).collect()
}

/// Sizes of the driver's blocks of memory: what is larger, such as a painting on its way, has one of its own
/// and gives it back.
const BLOCK_BYTES: Range<u64> = 1 << 20..4 << 20;

/// Passes can be timed.
const CLOCK: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY;

impl Gpu {
    /// Whether passes can be timed.
    pub fn has_clock(&self) -> bool {
        self.device.features().contains(CLOCK)
    }

    /// Whether the processor does its work.
    pub fn is_software(&self) -> bool {
        self.software
    }

    /// Opens the preferred adapter.
    pub fn open() -> Result<Self, RenderError> {
        let adapter = found().into_iter().next().ok_or_else(|| {
            RenderError::NoAdapter(
                "install a Vulkan driver; on a machine without graphics hardware, on Debian or \
                 Ubuntu: apt-get install mesa-vulkan-drivers"
                    .into(),
            )
        })?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("metrotwin"),
            required_features: adapter.features() & CLOCK,
            memory_hints: wgpu::MemoryHints::Manual {
                suballocated_device_memory_block_size: BLOCK_BYTES,
            },
            ..Default::default()
        }))
        .map_err(|e| RenderError::Device(e.to_string()))?;
        let failure = Arc::new(Mutex::new(None));
        let noted = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            let mut first = noted.lock().unwrap_or_else(|e| e.into_inner());
            first.get_or_insert(e.to_string());
        }));
        Ok(Self {
            device,
            queue,
            backend: describe(&adapter.get_info()),
            software: adapter.get_info().device_type == wgpu::DeviceType::Cpu,
            failure,
        })
    }

    /// Returns when work is done.
    pub fn wait_for(&self, submission: wgpu::SubmissionIndex) -> Result<(), RenderError> {
        let wait = wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: None,
        };
        (self.device.poll(wait)).map_err(|e| RenderError::Device(e.to_string()))?;
        self.check()
    }

    /// The first error that the adapter has reported, if any.
    pub fn check(&self) -> Result<(), RenderError> {
        let failure = self.failure.lock().unwrap_or_else(|e| e.into_inner());
        match failure.as_ref() {
            Some(text) => Err(RenderError::Device(text.clone())),
            None => Ok(()),
        }
    }
}

/// Hardware before software.
fn found() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    all.sort_by_key(|a| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Cpu => 3,
        wgpu::DeviceType::Other => 4,
    });
    all
}

fn describe(info: &wgpu::AdapterInfo) -> Backend {
    Backend {
        backend: info.backend.to_string(),
        adapter: info.name.clone(),
    }
}
