//! What is solid, and where rays meet it: bodies ([`Solid`]) and the tunnel with its rails
//! ([`TunnelCaster`]). Physics, sensors and renderers share it.

mod body;
mod borders;
mod end_wall;
mod free_space;
mod hull;
mod section;
mod solid;
mod track_caster;
mod track_surface;
mod tunnel;

pub use body::{Body, Shape};
pub use borders::TunnelEnd;
pub use end_wall::EndWall;
pub use free_space::{Trapezoid, difference, free_space};
pub use hull::{Face, Hull};
pub use section::surface_of;
pub use solid::Solid;
pub use track_caster::STATION_STEP_M;
pub use track_surface::SurfacePoint;
pub use tunnel::{RayStart, Sight, TunnelCaster, TunnelHit};
