//! Same seed, same bytes: images, words of the stack, figures. Provokes: noise or threads that
//! depend on order, wall time that leaks into results, seeds that are not used.

use metrotwin::scenario::Scenario;
use metrotwin::session::{
    Event, Observer, ObserverError, RendererChoice, RunOptions, Summary, run,
};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

/// Hashes every image and everything said of it.
#[derive(Default)]
struct Digest {
    hasher: DefaultHasher,
    images: usize,
}

impl Observer for Digest {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        match event {
            Event::Pair {
                pair,
                report,
                true_chainages_m: truths_m,
                ..
            } => {
                pair.left.image.as_raw().hash(&mut self.hasher);
                pair.right.image.as_raw().hash(&mut self.hasher);
                format!("{report:?}{truths_m:?}").hash(&mut self.hasher);
                self.images += 2;
            }
            Event::Wayside { frame, report, .. } => {
                frame.image.as_raw().hash(&mut self.hasher);
                let time = frame.start;
                format!("{time:?}{:?}{:?}", report.blobs, report.obstacles).hash(&mut self.hasher);
                self.images += 1;
            }
            // Wall time.
            Event::Cost { .. } => {}
            other => format!("{other:?}").hash(&mut self.hasher),
        }
        Ok(())
    }
}

/// Most of a second of the toolbox's place, with a box that falls instead of the worker.
fn digest(seed: u64, renderer: RendererChoice) -> (u64, usize, serde_json::Value) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/forgotten_toolbox.toml");
    let overrides = [
        format!("seed={seed}"),
        "duration_s=0.8".to_owned(),
        "workers=[]".to_owned(),
        "obstacles=[{name='box', body={shape='box', size_m=[0.5, 0.3, 0.3]}, mass_kg=10, \
         chainage_m=1500, height_m=0.3, appears_s=0.1}]"
            .to_owned(),
        "rig.pairs_per_s=12".to_owned(),
    ];
    let overrides: Vec<_> = overrides.iter().map(|o| o.parse().unwrap()).collect();
    let scenario = Scenario::load(&path, &overrides).unwrap();
    let options = RunOptions {
        renderer,
        ..RunOptions::default()
    };
    let mut digest = Digest::default();
    let summary = run(&scenario, &options, &mut [&mut digest]).unwrap();
    (
        digest.hasher.finish(),
        digest.images,
        without_wall_times(&summary),
    )
}

fn without_wall_times(summary: &Summary) -> serde_json::Value {
    fn strip(value: &mut serde_json::Value) {
        if let Some(object) = value.as_object_mut() {
            for key in [
                "wall_s",
                "real_time_factor",
                "us_per_step",
                "ms_per_frame",
                "wall_shares_s",
            ] {
                object.remove(key);
            }
            object.values_mut().for_each(strip);
        }
    }
    let mut value = serde_json::to_value(summary).unwrap();
    strip(&mut value);
    value
}

fn same_seed_same_bytes(renderer: RendererChoice) {
    let (first, images, summary) = digest(7, renderer);
    assert!(images >= 20, "only {images} images were compared");
    let (second, _, again) = digest(7, renderer);
    assert_eq!(first, second, "two runs with one seed differ");
    assert_eq!(summary, again);
    let (other, ..) = digest(8, renderer);
    assert_ne!(first, other, "the seed changes nothing");
}

#[test]
fn same_seed_same_bytes_on_the_graphics_adapter() {
    same_seed_same_bytes(RendererChoice::Gpu);
}

#[test]
fn same_seed_same_bytes_on_the_plain_renderer() {
    same_seed_same_bytes(RendererChoice::Cpu);
}
