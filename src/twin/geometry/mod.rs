//! What is solid, and where rays meet it: bodies ([`Solid`]) and the tunnel with its rails
//! ([`TunnelCaster`]). Physics, sensors and renderers share it.

mod body;
mod hull;
mod section;
mod solid;
mod track_caster;
mod tunnel;

pub use body::{Body, Shape};
pub use hull::{Face, Hull};
pub use solid::Solid;
pub use track_caster::{STATION_STEP_M, SurfacePoint};
pub use tunnel::{RayStart, TunnelCaster, TunnelHit};
