//! The world: physics, renderer, sensors. Uses the track and the bus, never the stack.

pub mod comms;
pub mod physics;
pub mod random;
pub mod render;
pub mod sensors;
pub mod survey;
