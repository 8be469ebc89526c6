//! Tunnel files.
