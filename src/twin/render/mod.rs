//! From the world to 8-bit images: a wgpu renderer, and a plain one beside it as oracle and
//! fall-back. Both draw the same [`Scene`] through the same [`View`].

mod cache;
pub mod constants;
mod corridor;
pub mod cpu;
mod daylight;
pub mod develop;
pub mod disc;
pub mod gaussian;
mod glare;
mod glass;
pub mod gloss;
pub mod gpu;
mod image_bounds;
pub mod labels;
pub mod lamp_field;
mod light_source;
mod lit_scene;
pub mod paint;
pub mod photometry;
pub mod pixel_map;
mod portal;
mod rounding;
#[cfg(test)]
#[path = "../../../tests/common/sample.rs"]
pub mod sample;
mod scene;
pub mod sensor;

pub use scene::{CameraMotion, Job, NoiseKey, Scene, View};
pub use sensor::{BLUR_PX, LensSettings, Pattern, SensorSettings, upper_bits};

use image::{GrayImage, ImageBuffer, Luma};
use schemars::JsonSchema;

/// Digital numbers as the converter gives them, black level included: linear, at the full depth of
/// [`SensorSettings::bits`], in the low bits. A colour sensor's is the mosaic.
pub type RawImage = ImageBuffer<Luma<u16>, Vec<u16>>;

/// Digital numbers, or what is kept of them.
type Image<T> = ImageBuffer<Luma<T>, Vec<T>>;

/// Which renderer drew, for the summary.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, JsonSchema)]
pub struct Backend {
    /// `vulkan`, `metal`, `dx12` or `cpu`.
    pub backend: String,
    /// Name of the adapter.
    pub adapter: String,
}

/// Why a picture could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// No adapter at all.
    #[error("no graphics adapter found: {0}")]
    NoAdapter(String),
    /// The adapter gave up.
    #[error("the graphics adapter failed: {0}")]
    Device(String),
    /// `collect` without `submit`.
    #[error("no picture was asked for")]
    NothingSubmitted,
}

/// A renderer holds the scene and draws jobs, one in flight while the caller does other work.
pub trait Renderer: Send {
    /// What draws.
    fn backend(&self) -> Backend;
    /// Takes another scene, as a new renderer of it would, but keeps what is dear and hangs on no scene:
    /// the adapter and its compiled shaders. Jobs in flight are forgotten.
    fn set_scene(&mut self, scene: Scene);
    /// Starts to draw all views of a job.
    fn submit(&mut self, job: &Job) -> Result<(), RenderError>;
    /// Waits for the oldest submitted job; one image a view, in order.
    fn collect(&mut self) -> Result<Vec<GrayImage>, RenderError>;
    /// The same with all bits of the converter, of which `collect` gives the upper eight.
    fn collect_raw(&mut self) -> Result<Vec<RawImage>, RenderError>;
}
