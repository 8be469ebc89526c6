//! Cross-sections swept along the alignment into triangles.
