//! The world: physics, renderer, sensors, radio. Uses the track and the bus, never the stack.
//!
//! What is true is known here and in the session only. What is there is described by shapes and the
//! rays that meet them ([`geometry`]), [`lights`], [`air`] and [`reflectance`]. A step of the world
//! moves the train and all that lies about ([`physics`]); cameras look along poses that it remembers,
//! row by row ([`render`]); sensors turn its motion into counts and samples with their errors
//! ([`sensors`]); messages take their time ([`links`]); lamps and cameras fail ([`faults`]); and what
//! the stack believes of the line is not quite the line ([`survey`]). Everything random comes from
//! counter-based streams ([`random`]), so nothing depends on order or threads. What is left out is
//! said in each of these.

pub mod air;
pub mod blades;
pub mod faults;
pub mod geometry;
pub mod lamps;
pub mod lights;
pub mod links;
pub mod physics;
pub mod random;
pub mod reflectance;
pub mod render;
pub mod sensors;
pub mod survey;
