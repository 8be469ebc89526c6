//! What reaches a radar in a frame: echoes of bodies, of their mirror images and of the tunnel, and other radars.

use super::converter::counts_of;
use super::ghosts::{Image, Mirror, images};
use super::interference::{Interferer, Sweeps};
use super::link::{Link, air_loss_db_m, noise_w, ratio, watts};
use super::scatterers::{BodyEchoes, Centre, OwnedBody, RadarSight, SeenBody, clutter};
use super::settings::TrueRadar;
use super::signal::{Moving, RadarEcho};
use super::{MountedRadar, RadarSettings};
use crate::bus::{SimTime, TrainEnd, TrainId};
use crate::twin::air::Air;
use crate::twin::geometry::{Body, RayStart, TunnelCaster};
use crate::twin::physics::{BodyOwner, World};
use crate::twin::random::Stream;
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::BTreeMap;

/// Echoes weaker than this against the noise of a whole frame are left out, dB.
const FAINT_DB: f64 = -10.0;
/// So many of the strongest centres of a body are mirrored.
const MIRRORED: usize = 8;
/// Another train's radar is looked for so far before it: it sits in its own body's surface.
const BEFORE_M: f64 = 0.1;

/// Where a radar is in a frame.
#[derive(Clone, Copy)]
struct Pose {
    world_from_radar: Isometry3<f64>,
    velocity_mps: Vector3<f64>,
    angular_rad_s: Vector3<f64>,
}

/// What reaches a radar.
pub struct Received {
    /// Echoes.
    pub echoes: Vec<RadarEcho>,
    /// Radars that it hears.
    pub interferers: Vec<Interferer>,
}

/// Another train's radar.
struct OtherRadar {
    mounted: MountedRadar,
    built: TrueRadar,
    phases: Stream,
}

/// All that a radar may meet.
pub struct RadarScene {
    train: TrainId,
    end: TrainEnd,
    settings: RadarSettings,
    built: TrueRadar,
    link: Link,
    /// Power of an echo that is too faint, W.
    faint_w: f64,
    bodies: BodyEchoes,
    clutter: Stream,
    road: Stream,
    others: Vec<OtherRadar>,
    caster: TunnelCaster,
    near: Option<RayStart>,
}

impl RadarScene {
    /// Of a radar among those of other trains, in tunnels and their air.
    pub fn new(
        mounted: &MountedRadar,
        built: TrueRadar,
        others: &[MountedRadar],
        (caster, air): (TunnelCaster, &Air),
    ) -> Self {
        let (figures, settings) = (&built.figures, &mounted.settings);
        let wave = figures.waveform;
        let noise = noise_w(wave.sample_rate_hz, figures.noise_figure_db);
        let stream = |what: &str| Stream::new(mounted.seed, mounted.end as u64, what);
        let others = others.iter().filter(|other| other.train != mounted.train);
        Self {
            train: mounted.train,
            end: mounted.end,
            link: Link {
                sent_w: watts(figures.power_dbm),
                wave_m: wave.wave_m(),
                loss_db_m: air_loss_db_m(air, wave.start_hz),
            },
            faint_w: noise * ratio(FAINT_DB) / figures.frame_samples().max(1) as f64,
            bodies: BodyEchoes::new(&settings.bodies, wave.wave_m(), stream("radar bodies")),
            clutter: stream("radar clutter"),
            road: stream("radar road"),
            others: others
                .map(|other| OtherRadar {
                    mounted: other.clone(),
                    built: other.settings.built(other.end, other.seed),
                    phases: stream(&format!("radar of {}", other.train)),
                })
                .collect(),
            settings: settings.clone(),
            built,
            caster,
            near: None,
        }
    }

    /// The radar as it really is.
    pub fn built(&self) -> &TrueRadar {
        &self.built
    }

    /// What reaches the radar in a frame that began at a time of the recent past; none without its train.
    pub fn received(&mut self, world: &World, frame: u32, start: SimTime) -> Option<Received> {
        let mount = &self.built.figures.vehicle_from_radar;
        let pose = pose(world, (self.train, self.end), mount, start)?;
        let radar = Point3::from(pose.world_from_radar.translation.vector);
        let (mut bodies, labels) = world.owned_bodies(Some(self.train));
        let before_s = start.since(world.time());
        for body in &mut bodies {
            body.world_from_body.translation.vector += body.velocity_mps * before_s;
        }
        let owners: Vec<BodyOwner> = labels.iter().map(|label| label.owner).collect();
        let seen = bodies
            .iter()
            .zip(&owners)
            .map(|(body, &owner)| OwnedBody { body, owner });
        let sight = RadarSight::new(&self.caster, seen, (radar, self.near));
        let centres = self.body_centres(world, (&bodies, &owners), &radar, frame);
        let direct = self.heard(centres, &pose, |c| sight.sees(&c.place, of_person(c)));
        let mut echoes: Vec<RadarEcho> = direct.iter().map(|(_, echo)| *echo).collect();
        echoes.extend(self.mirrored(world, &direct, &pose, &sight));
        let around = self.heard(self.clutter(world, &radar), &pose, |c| {
            sight.sees(&c.place, None)
        });
        echoes.extend(around.into_iter().map(|(_, echo)| echo));
        let interferers = self.interferers(world, &pose, &sight, start);
        self.near = Some(sight.begin());
        Some(Received {
            echoes,
            interferers,
        })
    }

    fn body_centres(
        &self,
        world: &World,
        (bodies, owners): (&[Body], &[BodyOwner]),
        radar: &Point3<f64>,
        frame: u32,
    ) -> Vec<Centre> {
        let mut parts: BTreeMap<BodyOwner, usize> = BTreeMap::new();
        for owner in owners {
            *parts.entry(*owner).or_default() += 1;
        }
        let mut met: BTreeMap<BodyOwner, usize> = BTreeMap::new();
        let mut centres = Vec::new();
        for (body, &owner) in bodies.iter().zip(owners) {
            let part = met.entry(owner).or_default();
            let seen = SeenBody {
                body,
                owner,
                part: [*part, parts.get(&owner).copied().unwrap_or(1)],
                material: world.material(owner),
            };
            *part += 1;
            centres.extend(self.bodies.centres(&seen, radar, frame));
        }
        centres
    }

    fn clutter(&self, world: &World, radar: &Point3<f64>) -> Vec<Centre> {
        let (Some(track), Some(head_m)) = (world.along_route(self.train), world.run_m(self.train))
        else {
            return Vec::new();
        };
        let near_m = match self.end {
            TrainEnd::Front => head_m,
            TrainEnd::Rear => head_m - world.train_length_m(self.train).unwrap_or(0.0),
        };
        let run_m = track.alignment.track_from_world(radar, near_m).s_m;
        let way = (run_m, self.end == TrainEnd::Front);
        clutter(track, way, radar, &self.settings.clutter, self.clutter)
    }

    /// Centres that are strong enough and seen, with their echoes.
    fn heard(
        &self,
        centres: Vec<Centre>,
        pose: &Pose,
        is_seen: impl Fn(&Centre) -> bool,
    ) -> Vec<(Centre, RadarEcho)> {
        let echo = |centre: Centre| {
            let way = pose.moving(&centre.place, &centre.velocity_mps);
            let echo = self.echo(&centre, [way, way], 0)?;
            is_seen(&centre).then_some((centre, echo))
        };
        centres.into_iter().filter_map(echo).collect()
    }

    /// The echo of a centre by a way out and a way back, after some bounces; none that is too faint.
    fn echo(&self, centre: &Centre, [out, back]: [Moving; 2], bounces: u32) -> Option<RadarEcho> {
        let gains = [
            self.built.transmit.gain(&out.place_m.coords),
            self.built.receive.gain(&back.place_m.coords),
        ];
        let ways_m = [out, back].map(|way| way.place_m.coords.norm());
        let lost = ratio(-self.settings.wall_loss_db * f64::from(bounces));
        let power_w = self.link.echo_w(centre.section_m2, gains, ways_m) * lost;
        (power_w > self.faint_w).then(|| RadarEcho {
            out,
            back,
            amplitude: counts_of(&self.built.figures, power_w),
            phase_rad: centre.phase_rad,
        })
    }

    /// Echoes over walls of the strongest centres of each body.
    fn mirrored(
        &self,
        world: &World,
        direct: &[(Centre, RadarEcho)],
        pose: &Pose,
        sight: &RadarSight<'_>,
    ) -> Vec<RadarEcho> {
        let mut by_owner: BTreeMap<BodyOwner, Vec<&(Centre, RadarEcho)>> = BTreeMap::new();
        for one in direct {
            if let Some(owner) = one.0.owner {
                by_owner.entry(owner).or_default().push(one);
            }
        }
        let mut echoes = Vec::new();
        for mut of_body in by_owner.into_values() {
            of_body.sort_by(|a, b| b.1.amplitude.total_cmp(&a.1.amplitude));
            let mirrors = self.mirrors(world, &sight.radar(), &of_body[0].0.place);
            for (centre, echo) in of_body.into_iter().take(MIRRORED) {
                for image in images(centre, &mirrors, sight) {
                    echoes.extend(self.over_wall(centre, echo.out, &image, pose));
                }
            }
        }
        echoes
    }

    /// Over a wall on the way out, on the way back, and on both.
    fn over_wall(
        &self,
        centre: &Centre,
        direct: Moving,
        image: &Image,
        pose: &Pose,
    ) -> impl Iterator<Item = RadarEcho> {
        let over = pose.moving(&image.place, &image.velocity_mps);
        let ways = [([over, direct], 1), ([direct, over], 1), ([over, over], 2)];
        ways.map(|(ways, bounces)| self.echo(centre, ways, bounces))
            .into_iter()
            .flatten()
    }

    /// The walls halfway to a place.
    fn mirrors(&self, world: &World, radar: &Point3<f64>, place: &Point3<f64>) -> Vec<Mirror> {
        let Some(track) = world.along_route(self.train) else {
            return Vec::new();
        };
        let near_m = world.run_m(self.train).unwrap_or(0.0);
        let between = nalgebra::center(radar, place);
        let s_m = track.alignment.track_from_world(&between, near_m).s_m;
        let section = track.section_at(s_m);
        section.map_or_else(Vec::new, |s| {
            Mirror::of_outline(&track.alignment.at(s_m), s.edges())
        })
    }

    fn interferers(
        &self,
        world: &World,
        pose: &Pose,
        sight: &RadarSight<'_>,
        start: SimTime,
    ) -> Vec<Interferer> {
        let mut heard = Vec::new();
        if let Some(road) = &self.settings.road {
            let place = Point3::from(road.place_m);
            if sight.sees(&place, None) {
                let from = (pose.moving(&place, &Vector3::zeros()), road.power_dbm);
                let sweeps = Sweeps {
                    first_s: -start.secs(),
                    ..road.sweeps()
                };
                heard.push(self.straight(from, sweeps, self.road));
            }
        }
        let others = self.others.iter();
        heard.extend(others.flat_map(|other| self.of_other(world, other, pose, sight, start)));
        heard
    }

    fn straight(&self, from: (Moving, f64), sweeps: Sweeps, phases: Stream) -> Interferer {
        let air = (self.link.loss_db_m, phases);
        Interferer::straight(&self.built.figures, &self.built.receive, from, sweeps, air)
    }

    /// What is heard of another train's radar: those of its frames that meet ours.
    fn of_other(
        &self,
        world: &World,
        other: &OtherRadar,
        pose: &Pose,
        sight: &RadarSight<'_>,
        start: SimTime,
    ) -> Vec<Interferer> {
        let (mounted, built) = (&other.mounted, &other.built);
        let mount = built.figures.vehicle_from_radar;
        let Some(theirs) = pose_of(world, mounted, &mount, start) else {
            return Vec::new();
        };
        let place = theirs.world_from_radar * Point3::new(BEFORE_M, 0.0, 0.0);
        if !sight.sees(&place, None) {
            return Vec::new();
        }
        let towards = theirs
            .world_from_radar
            .inverse_transform_point(&sight.radar());
        let gain_db = 10.0 * built.transmit.gain(&towards.coords).log10();
        let from = (
            pose.moving(&place, &theirs.velocity_mps),
            built.figures.power_dbm + gain_db,
        );
        let clock = mounted.settings.clock;
        let latest = (clock.local(start).secs() * mounted.settings.frames_per_s).floor();
        let begins = [0.0, 1.0].map(|k| {
            let local = SimTime::from_secs(((latest + k) / mounted.settings.frames_per_s).max(0.0));
            clock.time_of(local).since(start)
        });
        let (ours_s, theirs_s) = (self.settings.frame_s(), mounted.settings.frame_s());
        let meets = begins
            .into_iter()
            .filter(|begin_s| *begin_s < ours_s && begin_s + theirs_s > 0.0);
        let sweeps = meets.map(|begin_s| {
            Sweeps::of_frame(
                &built.figures.waveform,
                built.figures.transmitters_m.len(),
                begin_s,
            )
        });
        sweeps
            .map(|sweeps| self.straight(from, sweeps, other.phases))
            .collect()
    }
}

fn of_person(centre: &Centre) -> Option<BodyOwner> {
    centre
        .owner
        .filter(|owner| matches!(owner, BodyOwner::Worker(_)))
}

fn pose_of(
    world: &World,
    radar: &MountedRadar,
    mount: &Isometry3<f64>,
    time: SimTime,
) -> Option<Pose> {
    pose(world, (radar.train, radar.end), mount, time)
}

/// Where a radar is at a time of the recent past, and how it moves.
fn pose(
    world: &World,
    (train, end): (TrainId, TrainEnd),
    vehicle_from_radar: &Isometry3<f64>,
    time: SimTime,
) -> Option<Pose> {
    let motion = world.vehicle_motion(train, end)?;
    let world_from_vehicle = world.vehicle_at(train, end, time)?;
    Some(Pose {
        world_from_radar: world_from_vehicle * vehicle_from_radar,
        velocity_mps: motion.velocity_at(&vehicle_from_radar.translation.vector),
        angular_rad_s: motion.angular_rad_s,
    })
}

impl Pose {
    /// A place of the world with its velocity, as the radar has it.
    fn moving(&self, place: &Point3<f64>, velocity_mps: &Vector3<f64>) -> Moving {
        let arm = place.coords - self.world_from_radar.translation.vector;
        let relative = velocity_mps - self.velocity_mps - self.angular_rad_s.cross(&arm);
        Moving {
            place_m: self.world_from_radar.inverse_transform_point(place),
            velocity_mps: self.world_from_radar.inverse_transform_vector(&relative),
        }
    }
}
