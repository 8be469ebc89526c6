//! One frame: its pictures, labels, files and rows.

use super::clean::clean;
use super::coco::Annotation;
use super::files::{write_npy, write_png};
use super::frame::{FrameRow, ImageRow};
use super::lamps::LampRow;
use super::obstacles::{self, ObstacleRow};
use super::{DataSet, ExposedFrame, LabelKind};
use crate::record::observer_error::{Result, failed};
use crate::session::Source;
use crate::track::Place;
use crate::twin::physics::BodyOwner;
use crate::twin::render::labels::{Labels, Projection};
use crate::twin::render::{Job, RawImage, View, upper_bits};
use image::GrayImage;
use rayon::prelude::*;
use serde_json::json;

/// Frames of a camera are numbered within this: a day of a thousand a second has fewer.
const FRAMES: i64 = 1_000_000_000;
/// Annotations of a frame are numbered within this.
const INSTANCES: i64 = 65_536;

/// What is kept of a frame until the camera's next one is there, for the flow.
pub(super) struct LastFrame {
    /// Place of its row among those of `frames.parquet`.
    row: usize,
    exposed: ExposedFrame,
    labels: Labels,
}

/// Pictures that the data set's own renderer draws of a view.
#[derive(Default)]
struct Pictures {
    raw: Option<RawImage>,
    clean: Option<GrayImage>,
}

/// A frame of one camera, and what its labels are made from.
struct Frame<'a> {
    id: i64,
    exposed: &'a ExposedFrame,
    sight: Projection<'a>,
    labels: Option<Labels>,
}

impl Frame<'_> {
    /// Rows and columns.
    fn size(&self) -> [usize; 2] {
        let camera = &self.sight.view.camera.intrinsics;
        [camera.height_px, camera.width_px].map(|n| n as usize)
    }
}

type Write<'a> = Box<dyn Fn() -> Result + Sync + 'a>;

impl DataSet<'_> {
    /// Writes down a frame of all cameras that it is wanted of.
    pub(super) fn take(&mut self, exposed: &ExposedFrame, images: &[&GrayImage]) -> Result {
        let wanted = |k: &usize| {
            let camera = &self.cameras[*k];
            camera.wanted && camera.source == exposed.source
        };
        let cameras: Vec<usize> = (0..self.cameras.len()).filter(wanted).collect();
        let views = cameras.iter().map(|k| self.cameras[*k].view);
        let pictures = self.render(&exposed.job, &views.collect::<Vec<_>>())?;
        for (k, pictures) in cameras.into_iter().zip(pictures) {
            let view = self.cameras[k].view;
            if let (Some(image), true) = (images.get(view), view < exposed.job.views.len()) {
                self.take_view(k, exposed, image, &pictures)?;
            }
        }
        Ok(())
    }

    /// Raw and clean pictures of some views.
    fn render(&mut self, job: &Job, views: &[usize]) -> Result<Vec<Pictures>> {
        let [raw, clear] = [LabelKind::Raw, LabelKind::Clean].map(|kind| self.plan.has(kind));
        let mut all: Vec<View> = Vec::new();
        for view in views.iter().filter_map(|k| job.views.get(*k)) {
            all.extend(raw.then(|| view.clone()));
            all.extend(clear.then(|| clean(view, self.period_s)));
        }
        if all.is_empty() {
            return Ok(views.iter().map(|_| Pictures::default()).collect());
        }
        let spare: Vec<u32> = all.iter().map(|view| view.sensor.spare_bits()).collect();
        let job = Job {
            views: all,
            ..job.clone()
        };
        let broken = || failed("drawing a picture for the data set");
        self.renderer.submit(&job).map_err(broken())?;
        let images = self.renderer.collect_raw().map_err(broken())?;
        let mut images = images.into_iter().zip(spare);
        let mut next = |wanted: bool| wanted.then(|| images.next()).flatten();
        let of_view = |_: &usize| Pictures {
            raw: next(raw).map(|(image, _)| image),
            clean: next(clear).map(|(image, spare)| upper_bits(&image, spare)),
        };
        Ok(views.iter().map(of_view).collect())
    }

    fn take_view(
        &mut self,
        k: usize,
        exposed: &ExposedFrame,
        image: &GrayImage,
        pictures: &Pictures,
    ) -> Result {
        let camera = &self.cameras[k];
        let job = &exposed.job;
        let sight = Projection::new(&job.views[camera.view], job.time);
        let needs_rays = self.plan.needs_rays();
        let frame = Frame {
            id: FRAMES * k as i64 + i64::from(exposed.number),
            exposed,
            labels: needs_rays.then(|| self.labeller.look(job, &sight)),
            sight,
        };
        let left = matches!(exposed.source, Source::Rig(_)).then(|| &job.views[0]);
        let name = (frame.id, camera.name.as_str(), exposed.number);
        let (scenario, train) = (&self.scenario.file, exposed.train.as_ref());
        let mut row = FrameRow::new(name, scenario, &frame.sight, left, train);
        self.write_flow(k, &frame)?;
        self.name_pictures(&frame, &mut row, pictures)?;
        self.write_pictures(&frame, &row, image, pictures)?;
        self.push_tables(k, &frame)?;
        self.images.push(json!({
            "id": row.frame_id,
            "file_name": row.image,
            "width": row.width_px,
            "height": row.height_px,
            "camera": row.camera,
        }));
        self.frames.push(row);
        self.cameras[k].written += 1;
        let labels = frame.labels.filter(|_| self.plan.has(LabelKind::Flow));
        self.cameras[k].last = labels.map(|labels| LastFrame {
            row: self.frames.len() - 1,
            exposed: exposed.clone(),
            labels,
        });
        Ok(())
    }

    /// The flow from the camera's last frame to this one.
    fn write_flow(&mut self, k: usize, frame: &Frame<'_>) -> Result {
        let (Some(last), Some(labels)) = (self.cameras[k].last.take(), &frame.labels) else {
            return Ok(());
        };
        if last.labels.depth_m.len() != labels.depth_m.len() {
            return Ok(());
        }
        let (before, now) = (&last.exposed, frame.exposed);
        let sight = Projection::new(&before.job.views[self.cameras[k].view], before.job.time);
        let goes_on = successors(&before.owners, &now.owners);
        let flow = self.labeller.flow(
            (&before.job, &sight, &last.labels),
            (&now.job, &frame.sight),
            |body| goes_on[usize::from(body)],
        );
        let [height, width] = frame.size();
        let file = self.frames[last.row].file("flow", "npy");
        self.announce([file.clone()])?;
        let numbers = flow.into_iter().flatten();
        write_npy(&self.out.join(&file), &[height, width, 2], numbers)?;
        let row = &mut self.frames[last.row];
        (row.flow, row.flow_to) = (Some(file), Some(frame.id));
        Ok(())
    }

    /// Image, raw, clean, depth and mask, each where it is wanted: the row gets their names, and they
    /// are listed.
    fn name_pictures(
        &mut self,
        frame: &Frame<'_>,
        row: &mut FrameRow,
        pictures: &Pictures,
    ) -> Result {
        let labels = |kind| frame.labels.as_ref().filter(|_| self.plan.has(kind));
        let (depth, mask) = (labels(LabelKind::Depth), labels(LabelKind::Mask));
        row.image = row.file("images", "png");
        row.raw = pictures.raw.as_ref().map(|_| row.file("raw", "png"));
        row.clean = pictures.clean.as_ref().map(|_| row.file("clean", "png"));
        row.depth = depth.map(|_| row.file("depth", "npy"));
        row.mask = mask.map(|_| row.file("mask", "png"));
        let others = [&row.raw, &row.clean, &row.depth, &row.mask];
        let names = others.into_iter().flatten().chain([&row.image]).cloned();
        self.announce(names.collect::<Vec<_>>())
    }

    /// Writes what has been named.
    fn write_pictures(
        &self,
        frame: &Frame<'_>,
        row: &FrameRow,
        image: &GrayImage,
        pictures: &Pictures,
    ) -> Result {
        let named = |name: &Option<String>| frame.labels.as_ref().filter(|_| name.is_some());
        let (depth, mask) = (named(&row.depth), named(&row.mask));
        let out = &self.out;
        let at = |file: &Option<String>| out.join(file.as_deref().unwrap_or_default());
        let mut writes: Vec<Write<'_>> = vec![Box::new(|| write_png(&out.join(&row.image), image))];
        if let Some(raw) = &pictures.raw {
            writes.push(Box::new(|| write_png(&at(&row.raw), raw)));
        }
        if let Some(clean) = &pictures.clean {
            writes.push(Box::new(|| write_png(&at(&row.clean), clean)));
        }
        if let Some(labels) = depth {
            writes.push(Box::new(|| {
                let depth_m = labels.depth_m.iter().map(|d| *d as f32);
                write_npy(&at(&row.depth), &frame.size(), depth_m)
            }));
        }
        if let Some(labels) = mask {
            writes.push(Box::new(|| {
                let picture = obstacles::picture(&frame.exposed.owners, &frame.sight, labels);
                write_png(&at(&row.mask), &picture)
            }));
        }
        writes.par_iter().try_for_each(|write| write())
    }

    fn push_tables(&mut self, k: usize, frame: &Frame<'_>) -> Result {
        let tables = &mut self.tables;
        let (frame_id, sight, job) = (frame.id, &frame.sight, &frame.exposed.job);
        if let Some(table) = &mut tables.rows {
            ImageRow::all(frame_id, sight).try_for_each(|row| table.push(&row))?;
        }
        if let Some(table) = &mut tables.lamps {
            let sites: Vec<_> = self.scenario.tunnel.lamps().collect();
            let rows = LampRow::all(frame_id, job, sight, &self.labeller, &sites);
            rows.iter().try_for_each(|row| table.push(row))?;
        }
        let (Some(table), Some(labels)) = (&mut tables.obstacles, &frame.labels) else {
            return Ok(());
        };
        let train = frame.exposed.train.as_ref().map(|train| Place {
            track: train.track,
            s_m: train.chainage_m,
        });
        let near = self.cameras[k].place.or(train).unwrap_or_default();
        let tracks = &self.scenario.tunnel.network.tracks;
        let line = (&tracks[usize::from(near.track.0)].alignment, near.s_m);
        for instance in obstacles::instances(job, &frame.exposed.owners, sight, labels) {
            let Some(row) = ObstacleRow::new(frame_id, job, sight, line, &instance) else {
                continue;
            };
            table.push(&row)?;
            if let Some([left, top, right, bottom]) = instance.mask.bounds() {
                self.annotations.push(Annotation {
                    id: INSTANCES * frame_id + i64::from(instance.id),
                    image_id: frame_id,
                    category_id: instance.category + 1,
                    bbox: [left, top, right - left, bottom - top],
                    area: instance.mask.area(),
                    iscrowd: 0,
                    name: row.name,
                    instance_id: instance.id,
                    visible_share: row.visible_share,
                    segmentation: instance.mask,
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
