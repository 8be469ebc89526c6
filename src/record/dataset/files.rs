//! Files of a data set.

use crate::record::whole_files::{Result, broken, finish, gone, part_name, write_whole};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{EncodableLayout, ImageBuffer, Luma, PixelWithColorType};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::ops::Deref;
use std::path::Path;

/// Files that a data set has, besides [`FOLDERS`].
pub const FILES: [&str; 8] = [
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
pub const FOLDERS: [&str; 6] = ["images", "raw", "clean", "depth", "mask", "flow"];

/// Whether a folder holds anything at all.
pub fn is_empty(folder: &Path) -> io::Result<bool> {
    match fs::read_dir(folder) {
        Ok(mut entries) => Ok(entries.next().is_none()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(true),
        Err(error) => Err(error),
    }
}

/// Takes away what a data set has written into a folder, and nothing else.
pub fn clear(folder: &Path) -> io::Result<()> {
    for name in FILES {
        let path = folder.join(name);
        gone(fs::remove_file(part_name(&path)))?;
        gone(fs::remove_file(path))?;
    }
    for name in FOLDERS {
        gone(fs::remove_dir_all(folder.join(name)))?;
    }
    Ok(())
}

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
        let mut file = BufWriter::with_capacity(1 << 18, File::create(part_name(path))?);
        file.write_all(b"\x93NUMPY\x01\x00")?;
        file.write_all(&(header.len() as u16).to_le_bytes())?;
        file.write_all(header.as_bytes())?;
        for number in numbers {
            file.write_all(&number.to_le_bytes())?;
        }
        file.flush()
    };
    write().map_err(broken(path))?;
    finish(path)
}
