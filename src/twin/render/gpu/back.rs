//! What is on its way back of a view.

use super::signal_back::SignalBack;
use super::target::ReadBack;
use crate::twin::render::{Image, RenderError};
use image::Primitive;

/// Where a view's picture comes back.
pub enum Back {
    /// As the adapter has developed it.
    Image(ReadBack),
    /// As a signal, to be developed here.
    Signal(Box<SignalBack>),
}

impl Back {
    /// Asks for access as soon as the adapter is done. Whether that went well shows in `image`.
    pub fn request(&self) {
        match self {
            Self::Image(back) => back.request(),
            Self::Signal(back) => back.request(),
        }
    }

    /// How much comes back.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Image(back) => back.bytes(),
            Self::Signal(back) => back.bytes,
        }
    }

    /// The image, each digital number converted to a pixel, once the adapter is done. Frees the buffer.
    pub fn image<T: Primitive + Send>(
        &self,
        convert: impl Fn(u32) -> T + Copy + Sync,
    ) -> Result<Image<T>, RenderError> {
        match self {
            Self::Image(back) => back.image(convert),
            Self::Signal(back) => back.image(convert),
        }
    }
}
