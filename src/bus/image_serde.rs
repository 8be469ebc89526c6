//! Grey images as width, height and pixels.

use image::GrayImage;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Serialize, Deserialize)]
struct Pixels {
    width: u32,
    height: u32,
    grey: Vec<u8>,
}

impl Pixels {
    fn of(image: &GrayImage) -> Self {
        Self {
            width: image.width(),
            height: image.height(),
            grey: image.as_raw().clone(),
        }
    }

    fn image<E: Error>(self) -> Result<GrayImage, E> {
        let Self {
            width,
            height,
            grey,
        } = self;
        let size = grey.len();
        let fits = width as usize * height as usize == size;
        let image = GrayImage::from_raw(width, height, grey).filter(|_| fits);
        image.ok_or_else(|| E::custom(format!("{size} pixels are no {width} x {height} image")))
    }
}

pub(super) fn serialize<S: Serializer>(image: &GrayImage, to: S) -> Result<S::Ok, S::Error> {
    Pixels::of(image).serialize(to)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<GrayImage, D::Error> {
    Pixels::deserialize(from)?.image()
}

/// The same where there may be none.
pub(super) mod optional {
    use super::{Deserialize, Deserializer, GrayImage, Pixels, Serialize, Serializer};

    pub fn serialize<S: Serializer>(image: &Option<GrayImage>, to: S) -> Result<S::Ok, S::Error> {
        image.as_ref().map(Pixels::of).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<GrayImage>, D::Error> {
        Option::<Pixels>::deserialize(from)?
            .map(Pixels::image)
            .transpose()
    }
}
