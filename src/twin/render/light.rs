//! Photometry shared by both renderers: what a lamp or headlight sends to a point of a surface.
