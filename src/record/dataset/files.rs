//! Files of a data set.

use crate::files::{PartFile, write_whole};
use crate::record::observer_error::{Result, broken};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{EncodableLayout, ImageBuffer, Luma, PixelWithColorType};
use std::io::{self, BufWriter, Write};
use std::ops::Deref;
use std::path::Path;

/// Files that a data set may have, besides those in [`FOLDERS`] and the copies of its inputs.
pub(super) const FILES: [&str; 8] = [
    "frames.parquet",
    "rows.parquet",
    "lamps.parquet",
    "obstacles.parquet",
    "coco.json",
    "meta.json",
    "scenario.toml",
    "README.md",
];

/// Folders with a file for each frame.
pub(super) const FOLDERS: [&str; 6] = ["images", "raw", "clean", "depth", "mask", "flow"];

/// A picture of 8 or 16 bits as PNG, without loss.
pub(super) fn write_png<T, C>(path: &Path, image: &ImageBuffer<Luma<T>, C>) -> Result
where
    Luma<T>: PixelWithColorType<Subpixel = T>,
    T: image::Primitive,
    [T]: EncodableLayout,
    C: Deref<Target = [T]>,
{
    let mut bytes = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    image.write_with_encoder(encoder).map_err(broken(path))?;
    write_whole(path, &bytes).map_err(broken(path))
}

/// Numbers as numpy reads them: little-endian, rows first.
/// <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>
pub(super) fn write_npy(
    path: &Path,
    shape: &[usize],
    numbers: impl Iterator<Item = f32>,
) -> Result {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let shape = shape.join(", ");
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}");
    // Magic, version and length take ten bytes; all of it is a multiple of 64.
    let spaces = 63 - (10 + header.len()) % 64;
    header += &" ".repeat(spaces);
    header.push('\n');
    let write = || -> io::Result<()> {
        let mut file = BufWriter::with_capacity(1 << 18, PartFile::create(path)?);
        file.write_all(b"\x93NUMPY\x01\x00")?;
        file.write_all(&(header.len() as u16).to_le_bytes())?;
        file.write_all(header.as_bytes())?;
        for number in numbers {
            file.write_all(&number.to_le_bytes())?;
        }
        file.into_inner().map_err(|e| e.into_error())?.finish()
    };
    write().map_err(broken(path))
}
