//! Images of a recording as JPEG and PNG, encoded by a thread of its own while the run goes on.
//!
//! They come back in the order in which they went in, each after a fixed number of others has gone in, so
//! what a recording holds does not depend on how fast the thread is.

use super::observer_error::{Result, failed};
use crate::bus::SimTime;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, GrayImage, ImageEncoder as _};
use jpeg_encoder::{ColorType, Encoder};
use re_sdk_types::archetypes::EncodedImage;
use re_sdk_types::components::MediaType;
use std::collections::VecDeque;
use std::error::Error;
use std::io;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

/// Images that wait while the thread works, at most: each takes memory.
const MOST_WAITING: usize = 4;

/// Where an image belongs in a recording.
pub(super) struct ImageRow {
    pub(super) path: String,
    pub(super) start: SimTime,
    pub(super) number: u32,
}

/// How an image is written.
#[derive(Clone, Copy)]
pub(super) enum Format {
    Jpeg {
        quality: u8,
        /// Greys are multiplied by this first.
        gain: Option<f64>,
    },
    Png,
}

type Encoded = std::result::Result<EncodedImage, Box<dyn Error + Send + Sync>>;

/// The thread, and what it has been given.
#[derive(Default)]
pub(super) struct ImageEncoder {
    thread: Option<EncoderThread>,
    waiting: VecDeque<ImageRow>,
    /// Images to copy the next ones into.
    free: Vec<GrayImage>,
}

struct EncoderThread {
    /// It ends when this is dropped.
    images: Sender<(GrayImage, Format)>,
    encoded: Receiver<(GrayImage, Encoded)>,
}

impl ImageEncoder {
    /// Takes an image; gives the oldest one, encoded, once too many wait.
    pub(super) fn add(
        &mut self,
        row: ImageRow,
        image: &GrayImage,
        format: Format,
    ) -> Result<Option<(ImageRow, EncodedImage)>> {
        if self.thread.is_none() {
            self.thread = Some(EncoderThread::start().map_err(failed(&row.path))?);
        }
        let mut copy = self.free.pop().unwrap_or_default();
        copy.clone_from(image);
        // A thread that has ended is found out when its work is asked for.
        if let Some(thread) = &self.thread {
            thread.images.send((copy, format)).ok();
        }
        self.waiting.push_back(row);
        let too_many = self.waiting.len() > MOST_WAITING;
        if too_many { self.next() } else { Ok(None) }
    }

    /// The oldest image, encoded, if any waits.
    pub(super) fn next(&mut self) -> Result<Option<(ImageRow, EncodedImage)>> {
        let Some((thread, row)) = self.thread.as_ref().zip(self.waiting.pop_front()) else {
            return Ok(None);
        };
        let (image, encoded) = thread.encoded.recv().map_err(failed(&row.path))?;
        self.free.push(image);
        let encoded = encoded.map_err(failed(&row.path))?;
        Ok(Some((row, encoded)))
    }
}

impl EncoderThread {
    fn start() -> io::Result<Self> {
        let (images, given) = channel::<(GrayImage, Format)>();
        let (done, encoded) = channel();
        let work = move || {
            for (mut image, format) in given {
                let file = encode(&mut image, format);
                if done.send((image, file)).is_err() {
                    return;
                }
            }
        };
        thread::Builder::new().name("images".into()).spawn(work)?;
        Ok(Self { images, encoded })
    }
}

fn encode(image: &mut GrayImage, format: Format) -> Encoded {
    match format {
        Format::Jpeg { quality, gain } => {
            if let Some(gain) = gain {
                brighten(image, gain);
            }
            jpeg(image, quality)
        }
        Format::Png => png(image),
    }
}

fn jpeg(image: &GrayImage, quality: u8) -> Encoded {
    let (width, height) = (image.width().try_into()?, image.height().try_into()?);
    let mut bytes = Vec::with_capacity(image.len() / 4);
    Encoder::new(&mut bytes, quality).encode(image.as_raw(), width, height, ColorType::Luma)?;
    Ok(EncodedImage::new(bytes).with_media_type(MediaType::jpeg()))
}

fn png(image: &GrayImage) -> Encoded {
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::NoFilter)
        .write_image(image, image.width(), image.height(), ExtendedColorType::L8)?;
    Ok(EncodedImage::new(bytes).with_media_type(MediaType::png()))
}

fn brighten(image: &mut GrayImage, gain: f64) {
    let brighter: [u8; 256] = std::array::from_fn(|grey| (grey as f64 * gain).min(255.0) as u8);
    for grey in image.iter_mut() {
        *grey = brighter[usize::from(*grey)];
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use image::Luma;

    fn row(number: u32) -> ImageRow {
        ImageRow {
            path: "camera/image".into(),
            start: SimTime::ZERO,
            number,
        }
    }

    /// Files in another order, lost ones, a gain or a format that is another image's.
    #[test]
    fn files_come_back_in_order_and_hold_their_image() {
        let mut files = ImageEncoder::default();
        let mut found = Vec::new();
        for number in 0..20 {
            // The first takes longest.
            let side = 400 - 20 * number;
            let image = GrayImage::from_pixel(side, side, Luma([5 * number as u8]));
            let format = match number % 2 {
                0 => Format::Png,
                _ => Format::Jpeg {
                    quality: 90,
                    gain: Some(2.0),
                },
            };
            let done = files.add(row(number), &image, format).unwrap();
            assert_eq!(done.is_some(), number as usize >= MOST_WAITING);
            found.extend(done);
        }
        while let Some(done) = files.next().unwrap() {
            found.push(done);
        }
        assert_eq!(found.len(), 20);
        for (number, (row, file)) in (0..).zip(found) {
            assert_eq!(row.number, number);
            let blobs = file.blob.unwrap().array.to_data();
            let bytes = blobs.child_data()[0].buffers()[0].to_vec();
            let image = image::load_from_memory(&bytes).unwrap().into_luma8();
            assert_eq!(image.width(), 400 - 20 * number);
            let grey = 5 * number * if number % 2 == 0 { 1 } else { 2 };
            assert!(image.get_pixel(3, 3)[0].abs_diff(grey as u8) <= 1);
        }
    }
}
