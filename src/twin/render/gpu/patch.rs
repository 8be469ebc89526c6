//! What is known of the pieces of a chunk before it is drawn.

use super::tiles::SurfaceCell;

/// A piece of a tunnel's surface.
#[derive(Clone, Debug)]
pub struct Patch {
    pub cell: SurfaceCell,
    /// More luminance than any of it has by the lamps.
    pub peak_cd_m2: f32,
    /// The most luminance that a lux makes there, cd/m^2.
    pub reflected_per_lx: f32,
    /// Whether it mirrors.
    pub glossy: bool,
}
