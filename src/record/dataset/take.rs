//! One frame: its pictures, labels, files and rows.

use super::clean::clean;
use super::coco::Annotation;
use super::files::{write_npy, write_png};
use super::frame::{self, Name, Paths, text};
use super::{DataSet, Part, Shot, lamps, obstacles};
use crate::record::stream::failed;
use crate::session::ObserverError;
use crate::twin::physics::BodyOwner;
use crate::twin::render::labels::{Labels, Projection};
use crate::twin::render::{Job, RawImage, View, upper_bits};
use image::GrayImage;
use rayon::prelude::*;
use serde_json::json;
use std::path::Path;
use std::sync::Arc;

/// Frames of a camera are numbered within this.
const FRAMES: i64 = 1_000_000;
/// Annotations of a frame are numbered within this.
const INSTANCES: i64 = 65_536;

/// What is kept of a frame until the camera's next one is there, for the flow.
pub(super) struct Taken {
    /// Its row in `frames.parquet`.
    row: usize,
    view: usize,
    job: Arc<Job>,
    owners: Arc<[(BodyOwner, String)]>,
    labels: Labels,
    paths: Paths,
}

/// Pictures that the data set's own renderer draws of a view.
#[derive(Default)]
struct Drawn {
    raw: Option<RawImage>,
    clean: Option<GrayImage>,
}

type Write<'a> = Box<dyn Fn() -> Result<(), ObserverError> + Sync + 'a>;

impl DataSet<'_> {
    /// Writes down a frame of all cameras that it is wanted of.
    pub(super) fn take(&mut self, shot: &Shot, images: &[&GrayImage]) -> Result<(), ObserverError> {
        let wanted = |k: &usize| {
            let camera = &self.cameras[*k];
            camera.wanted && camera.source == shot.source
        };
        let cameras: Vec<usize> = (0..self.cameras.len()).filter(wanted).collect();
        let views = cameras.iter().map(|k| self.cameras[*k].view);
        let drawn = self.draw(&shot.job, &views.collect::<Vec<_>>())?;
        for (k, drawn) in cameras.into_iter().zip(drawn) {
            let view = self.cameras[k].view;
            if let (Some(image), true) = (images.get(view), view < shot.job.views.len()) {
                self.take_view(k, shot, image, &drawn)?;
            }
        }
        Ok(())
    }

    /// Raw and clean pictures of some views.
    fn draw(&mut self, job: &Job, views: &[usize]) -> Result<Vec<Drawn>, ObserverError> {
        let mut all: Vec<View> = Vec::new();
        for view in views.iter().filter_map(|k| job.views.get(*k)) {
            if self.plan.has(Part::Raw) {
                all.push(view.clone());
            }
            if self.plan.has(Part::Clean) {
                all.push(clean(view, self.period_s));
            }
        }
        if all.is_empty() {
            return Ok(views.iter().map(|_| Drawn::default()).collect());
        }
        let spare: Vec<u32> = all.iter().map(|view| view.sensor.spare_bits()).collect();
        let job = Job {
            views: all,
            raw: true,
            ..job.clone()
        };
        let broken = || failed("drawing a picture for the data set");
        self.renderer.submit(&job).map_err(broken())?;
        let drawn = self.renderer.collect_raw().map_err(broken())?;
        let mut drawn = drawn.into_iter().zip(spare);
        let of_view = |_: &usize| Drawn {
            raw: (self.plan.has(Part::Raw))
                .then(|| drawn.next())
                .flatten()
                .map(|(raw, _)| raw),
            clean: (self.plan.has(Part::Clean))
                .then(|| drawn.next())
                .flatten()
                .map(|(raw, spare)| upper_bits(&raw, spare)),
        };
        Ok(views.iter().map(of_view).collect())
    }

    fn take_view(
        &mut self,
        k: usize,
        shot: &Shot,
        image: &GrayImage,
        drawn: &Drawn,
    ) -> Result<(), ObserverError> {
        let camera = &self.cameras[k];
        let (name, index) = (camera.name.clone(), camera.view);
        let frame_id = FRAMES * k as i64 + i64::from(shot.number);
        let paths = Paths::new(&name, shot.number);
        let view = &shot.job.views[index];
        let sight = Projection::new(view, shot.job.time);
        let rays = self.plan.needs_rays();
        let labels = rays.then(|| self.labeller.look(&shot.job, &sight));
        if let Some(labels) = labels.as_ref().filter(|_| self.plan.has(Part::Flow)) {
            self.write_flow(k, (shot, &sight), labels.depth_m.len(), frame_id)?;
        }
        let files = self.write_pictures(&paths, &sight, shot, image, drawn, labels.as_ref())?;
        self.push_tables(frame_id, k, shot, &sight, labels.as_ref())?;

        let left = matches!(shot.source, super::Source::Rig(_)).then(|| &shot.job.views[0]);
        let camera = &view.camera.intrinsics;
        self.images.push(json!({
            "id": frame_id,
            "file_name": files[0],
            "width": camera.width_px,
            "height": camera.height_px,
            "camera": name,
        }));
        let about = &self.about;
        let row = Name {
            frame_id,
            scenario: &about.scenario,
            seed: about.seed,
            camera: &name,
            number: shot.number,
            files,
        };
        let row = frame::row(row, &sight, left, shot.train.as_ref());
        self.frames.push(row);
        self.cameras[k].written += 1;
        self.cameras[k].last = labels
            .filter(|_| self.plan.has(Part::Flow))
            .map(|labels| Taken {
                row: self.frames.len() - 1,
                view: index,
                job: shot.job.clone(),
                owners: shot.owners.clone(),
                labels,
                paths,
            });
        Ok(())
    }

    /// The flow from the camera's last frame to this one.
    fn write_flow(
        &mut self,
        k: usize,
        (shot, next): (&Shot, &Projection<'_>),
        size: usize,
        to: i64,
    ) -> Result<(), ObserverError> {
        let last = self.cameras[k].last.take();
        let Some(last) = last.filter(|last| last.labels.depth_m.len() == size) else {
            return Ok(());
        };
        let sight = Projection::new(&last.job.views[last.view], last.job.time);
        let goes_on = successors(&last.owners, &shot.owners);
        let flow = self.labeller.flow(
            (&last.job, &sight, &last.labels),
            (&shot.job, next),
            |body| goes_on[usize::from(body)],
        );
        let camera = &next.view.camera.intrinsics;
        let shape = [camera.height_px as usize, camera.width_px as usize, 2];
        let file = last.paths.file("flow", "npy");
        write_npy(&self.out.join(&file), &shape, flow.into_iter().flatten())?;
        frame::set_flow(&mut self.frames[last.row], text(&file), to);
        Ok(())
    }

    /// Image, raw, clean, depth and mask, each where it is wanted.
    fn write_pictures(
        &self,
        paths: &Paths,
        sight: &Projection<'_>,
        shot: &Shot,
        image: &GrayImage,
        drawn: &Drawn,
        labels: Option<&Labels>,
    ) -> Result<[Option<String>; 5], ObserverError> {
        let at = |folder: &str, extension: &str| paths.file(folder, extension);
        let out = &self.out;
        let full = |file: &Path| out.join(file);
        let [image_at, raw_at, clean_at, mask_at] =
            ["images", "raw", "clean", "mask"].map(|folder| at(folder, "png"));
        let depth_at = at("depth", "npy");
        let camera = &sight.view.camera.intrinsics;
        let shape = [camera.height_px as usize, camera.width_px as usize];
        let depth = labels.filter(|_| self.plan.has(Part::Depth));
        let mask = labels.filter(|_| self.plan.has(Part::Mask));
        let mut writes: Vec<Write<'_>> = vec![Box::new(|| write_png(&full(&image_at), image))];
        if let Some(raw) = &drawn.raw {
            writes.push(Box::new(|| write_png(&full(&raw_at), raw)));
        }
        if let Some(clean) = &drawn.clean {
            writes.push(Box::new(|| write_png(&full(&clean_at), clean)));
        }
        if let Some(labels) = depth {
            writes.push(Box::new(|| {
                let depth_m = labels.depth_m.iter().map(|d| *d as f32);
                write_npy(&full(&depth_at), &shape, depth_m)
            }));
        }
        if let Some(labels) = mask {
            writes.push(Box::new(|| {
                let picture = obstacles::picture(&shot.owners, sight, labels);
                write_png(&full(&mask_at), &picture)
            }));
        }
        writes.par_iter().try_for_each(|write| write())?;
        Ok([
            Some(text(&image_at)),
            drawn.raw.as_ref().map(|_| text(&raw_at)),
            drawn.clean.as_ref().map(|_| text(&clean_at)),
            depth.map(|_| text(&depth_at)),
            mask.map(|_| text(&mask_at)),
        ])
    }

    fn push_tables(
        &mut self,
        frame_id: i64,
        k: usize,
        shot: &Shot,
        sight: &Projection<'_>,
        labels: Option<&Labels>,
    ) -> Result<(), ObserverError> {
        let Some(tables) = &mut self.tables else {
            return Ok(());
        };
        let job = &shot.job;
        if let Some(table) = &mut tables.rows {
            frame::rows(frame_id, sight).try_for_each(|row| table.push(row))?;
        }
        if let Some(table) = &mut tables.lamps {
            let sites = &self.tunnel.lamps;
            let rows = lamps::rows(frame_id, job, sight, &self.labeller, sites);
            rows.into_iter().try_for_each(|row| table.push(row))?;
        }
        let (Some(table), Some(labels)) = (&mut tables.obstacles, labels) else {
            return Ok(());
        };
        let line = &self.tunnel.alignment;
        let train_m = shot.train.as_ref().map(|train| train.chainage_m);
        let near_m = self.cameras[k].chainage_m.or(train_m).unwrap_or(0.0);
        for instance in obstacles::instances(job, &shot.owners, sight, labels) {
            let Some(seen) = obstacles::row(frame_id, job, sight, (line, near_m), &instance) else {
                continue;
            };
            table.push(seen.row)?;
            if instance.mask.area() > 0 {
                self.annotations.push(Annotation {
                    id: INSTANCES * frame_id + i64::from(instance.id),
                    image_id: frame_id,
                    category: instance.category,
                    visible_share: seen.visible_share,
                    name: instance.name.to_owned(),
                    instance: instance.id,
                    mask: instance.mask,
                });
            }
        }
        Ok(())
    }
}

/// For each body the one of the later job that it has become: the same part of the same owner.
fn successors(now: &[(BodyOwner, String)], then: &[(BodyOwner, String)]) -> Vec<Option<usize>> {
    let part = |list: &[(BodyOwner, String)], k: usize| {
        list[..k]
            .iter()
            .filter(|(owner, _)| *owner == list[k].0)
            .count()
    };
    let same = |k: usize| {
        let later = then
            .iter()
            .enumerate()
            .filter(|(_, (owner, _))| *owner == now[k].0);
        later.map(|(j, _)| j).nth(part(now, k))
    };
    (0..now.len()).map(same).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails where a limb becomes another one, or a thing that has gone goes on.
    #[test]
    fn parts_go_on_with_their_owner() {
        let list = |owners: &[BodyOwner]| -> Vec<_> {
            owners.iter().map(|o| (*o, String::new())).collect()
        };
        let (thing, worker) = (BodyOwner::Obstacle, BodyOwner::Worker(0));
        let now = list(&[thing(0), thing(1), worker, worker]);
        let then = list(&[thing(1), thing(2), worker, worker]);
        assert_eq!(successors(&now, &then), [None, Some(0), Some(2), Some(3)]);
    }
}
