#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
use super::*;
use crate::track::Side;

fn bored() -> CrossSection {
    CrossSection::circular(3.0, 2.26, Some(Side::Left))
}

#[test]
fn dump() {
    let t = std::time::Instant::now();
    let p = Painting::of(&bored());
    println!("{:?} {} {}", t.elapsed(), p.width, p.height);
    let platform = crate::track::PlatformShape {
        side: Side::Right,
        edge_m: 1.5,
        height_m: 1.05,
    };
    let station = CrossSection::rectangular(2.9, 6.0, 4.6, Some(platform), None);
    for (name, section) in [("bored", bored()), ("station", station)] {
        let p = Painting::of(&section);
        let (w, h) = (15 * 64, p.height);
        let img = image::GrayImage::from_fn(w, h, |x, y| {
            let a = f64::from(p.levels[0][(y * p.width + x) as usize]) / 255.0;
            image::Luma([(255.0 * a.powf(1.0 / 2.2)) as u8])
        });
        img.save(format!("/work/scratch/walls_{name}.png")).unwrap();
    }
}
