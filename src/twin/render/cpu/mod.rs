//! The plain renderer.
