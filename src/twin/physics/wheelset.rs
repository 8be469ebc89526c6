//! A wheelset on its rails: carried by the rail's give, centred by its treads, held by its
//! flanges, driven and braked by creep.
//!
//! ```text
//! normal   Q = Q0 - k z - c z'       each wheel, never negative   z over the loaded rail
//! flanges  Y = -K (|y| - play)       y from the middle of the rails, beyond the play, which the
//!                                    gauge widens
//! creep    (Fx, Fy) = law of the slip of the treads over the rails, by Polach
//! yaw      M = -2 f11 b^2 / v (w_z + conicity y w / b)            b half the contacts' distance,
//!                                    f11 less by the share that Polach's law leaves of it
//! ```
//!
//! k is that of a beam on elastic support, 2 sqrt(2) (E I)^(1/4) u^(3/4): 100 MN/m for a 60 kg rail
//! (E I = 6.4 MN m^2) on fasteners of 40 kN/mm every 0.6 m. The wheelset bounces on it at some
//! 50 Hz: the P2 force of Jenkins et al. (1974).
//!
//! Off the middle, coned treads roll on different radii: the wheels slip against each other until
//! the wheelset has turned towards the middle. With the lateral slip of a wheelset that is not at
//! right angles to the rails this gives steering in curves, Klingel's motion with its wavelength
//! 2 pi sqrt(r b / conicity), and hunting (Wickens, "Fundamentals of Rail Vehicle Dynamics", 2003,
//! chapters 2 and 3; no spin creep and no gravitational stiffness). What curves take from the run is
//! the work of this slip.
//!
//! Creep forces are stiff: at walking pace a slip dies within microseconds. They are therefore
//! evaluated with the slip that they leave at the end of the step (linearly implicit: the secant
//! of the law, the slip's own dynamics), which is stable at any speed and exact where it is steady.

use super::adhesion::{KALKER_ACROSS_N, KALKER_ALONG_N};
use super::deviation::Deviation;
use super::energy::Ledger;
use super::route_track::{RouteTrack, rail_axes};
use super::slide_protection::{EffortShare, ReferenceSpeed};
use super::suspension::{Axes, BodyState, Wrench};
use super::vehicle::{FLANGE_STIFFNESS_N_M, GRAVITY_MPS2, HALF_CONTACT_M, Vehicle};
use rapier3d_f64::math::Vector;

/// Equivalent conicity of moderately worn treads, by UIC 519.
const CONICITY: f64 = 0.1;
/// Of a flange to its rail, either way, on 1435 mm.
const FLANGE_PLAY_M: f64 = 0.007;
/// Of a rail's head (60 kg), and of a flange.
const RAIL_HEAD_M: f64 = 0.073;
const FLANGE_HEIGHT_M: f64 = 0.028;
/// Creepage is slip over speed, and at standstill over this.
const LEAST_SPEED_MPS: f64 = 0.01;
/// Discs and pads of one wheelset give by this before they slip, at the wheel's tread.
const BRAKE_STIFFNESS_N_M: f64 = 2.5e6;
const BRAKE_DAMPING_N_S_M: f64 = 5e4;

/// What a wheelset and its rails do to each other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelForces {
    /// Normal force of the left and right wheel.
    pub normal_n: [f64; 2],
    /// Of the rails on the wheelset, to the left.
    pub lateral_n: f64,
    /// Of the rails on the wheelset, forward.
    pub along_n: f64,
    /// Speed of the axle less that of the treads: positive where the wheel slides.
    pub slip_mps: f64,
}

/// A wheelset.
#[derive(Clone, Default)]
pub(super) struct Wheelset {
    pub forces: WheelForces,
    /// What its treads have rolled off since the start.
    pub rolled_m: f64,
    /// Chainage of the axle.
    pub s_m: f64,
    /// Roll of the rails by cant, where that is, and how it changes.
    roll_rad: f64,
    roll_at_m: f64,
    roll_rad_per_m: f64,
    /// Elastic slip of its brake.
    brake_slip_m: f64,
    /// Speed of its treads, by how fast the axle turns.
    pub tread_mps: f64,
    /// What slide and slip protection lets through.
    effort_share: EffortShare,
    /// How far its middle is left of the rails' middle, and its lower wheel over its rail.
    off_m: f64,
    over_m: f64,
    pub extremes: WheelExtremes,
}

/// What a wheelset has been through since the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelExtremes {
    /// Least normal force of a wheel.
    pub least_normal_n: f64,
    /// Most that it slipped or slid.
    pub most_slip_mps: f64,
    /// Most that the rails pressed it aside, either way.
    pub most_lateral_n: f64,
}

impl Default for WheelExtremes {
    fn default() -> Self {
        Self {
            least_normal_n: f64::INFINITY,
            most_slip_mps: 0.0,
            most_lateral_n: 0.0,
        }
    }
}

impl WheelExtremes {
    /// Of both.
    pub fn and(self, other: Self) -> Self {
        Self {
            least_normal_n: self.least_normal_n.min(other.least_normal_n),
            most_slip_mps: self.most_slip_mps.max(other.most_slip_mps),
            most_lateral_n: self.most_lateral_n.max(other.most_lateral_n),
        }
    }
}

/// The rails under a wheelset.
struct RailPose {
    /// Middle of the rails at their top, as they really lie.
    origin: Vector,
    /// Along the designed track, across and up from the real one.
    axes: Axes,
    deviation: Deviation,
    /// Speed of the axle along the track.
    speed_mps: f64,
}

/// Traction and brake demanded of a wheelset, at the tread.
#[derive(Clone, Copy)]
pub(super) struct Drive {
    pub traction_n: f64,
    pub brake_n: f64,
    /// What slide and slip protection takes for the train's speed.
    pub reference: ReferenceSpeed,
}

impl Wheelset {
    pub(super) fn new(s_m: f64, roll_rad: f64, speed_mps: f64) -> Self {
        Self {
            s_m,
            roll_rad,
            roll_at_m: s_m,
            tread_mps: speed_mps,
            effort_share: EffortShare::new(speed_mps),
            ..Self::default()
        }
    }

    /// Adds what the rails, traction and brake do, to what acts on the wheelset already. Returns
    /// the torque of traction and brake, whose reaction is on the bogie.
    pub(super) fn apply(
        &mut self,
        vehicle: &Vehicle,
        track: &RouteTrack,
        drive: Drive,
        (state, wrench): (&BodyState, &mut Wrench),
        ledger: &mut Ledger,
        dt_s: f64,
    ) -> Vector {
        let rails = self.follow(track, state, dt_s);
        self.carry(vehicle, track, &rails, (state, wrench), ledger);
        let axle = state.rotation * Vector::Y;
        let spin = state.angular.dot(axle);
        let tread_mps = spin * vehicle.wheel_radius_m;
        self.tread_mps = tread_mps;
        self.rolled_m += tread_mps * dt_s;
        let (traction, brake) = self.effort(drive, dt_s);
        ledger.traction_w += traction * tread_mps;
        ledger.brake_w -= brake * tread_mps;
        let torque = axle * ((traction + brake) * vehicle.wheel_radius_m);
        wrench.torque += torque;
        self.creep(vehicle, track, &rails, (state, wrench), ledger, dt_s);
        self.extremes = self.extremes.and(WheelExtremes {
            least_normal_n: self.forces.normal_n[0].min(self.forces.normal_n[1]),
            most_slip_mps: self.forces.slip_mps.abs(),
            most_lateral_n: self.forces.lateral_n.abs(),
        });
        torque
    }

    /// It is where the rails no longer hold it: beside them, or both flanges over them.
    pub(super) fn derailed(&self) -> bool {
        self.off_m.abs() > RAIL_HEAD_M || self.over_m > FLANGE_HEIGHT_M
    }

    /// Share of brake and traction that slide and slip protection lets through.
    pub(super) fn effort_share(&self) -> f64 {
        self.effort_share.share()
    }

    /// Slide and slip protection holds effort back.
    pub(super) fn protection_acts(&self) -> bool {
        self.effort_share.acts()
    }

    /// The rails under the axle, a step on.
    fn follow(&mut self, track: &RouteTrack, state: &BodyState, dt_s: f64) -> RailPose {
        // Predicted to some micrometres; the rest is a step along the tangent.
        let guess = self.s_m + state.velocity.length() * dt_s;
        let frame = track.alignment().at(guess);
        let (origin, designed) = rail_axes(&frame);
        let along = (state.position - origin).dot(designed.x);
        let s_m = guess + along / (1.0 + frame.slope * frame.slope).sqrt();
        let (run_m, turn) = (guess - self.roll_at_m, frame.roll_rad - self.roll_rad);
        // Standing, the change of cant stays.
        if run_m.abs() > 1e-7 {
            self.roll_rad_per_m = turn / run_m;
        }
        (self.s_m, self.roll_at_m, self.roll_rad) = (s_m, guess, frame.roll_rad);
        let d = track.deviation_at(s_m);
        // The angle is some mrad at most: to 1e-12.
        let half = 0.5 * d.roll_rad * d.roll_rad;
        let (sin, cos) = (d.roll_rad * (1.0 - half / 3.0), 1.0 - half);
        RailPose {
            origin: origin + designed.x * along + designed.y * d.left_m + designed.z * d.up_m,
            axes: Axes {
                x: designed.x,
                y: designed.y * cos + designed.z * sin,
                z: designed.z * cos - designed.y * sin,
            },
            deviation: d,
            speed_mps: state.velocity.dot(designed.x),
        }
    }

    /// Normal forces, and those of the flanges.
    fn carry(
        &mut self,
        vehicle: &Vehicle,
        track: &RouteTrack,
        rails: &RailPose,
        (state, wrench): (&BodyState, &mut Wrench),
        ledger: &mut Ledger,
    ) {
        let Axes { x, y, z } = rails.axes;
        let (d, speed) = (&rails.deviation, rails.speed_mps);
        let roll_per_m = self.roll_rad_per_m + d.roll_rad_per_m;
        let axle = state.rotation * Vector::Y;
        let foot = state.position - z * vehicle.wheel_radius_m;
        let load_n = vehicle.wheel_load_n();
        for (k, side) in [HALF_CONTACT_M, -HALF_CONTACT_M].into_iter().enumerate() {
            let wheel = foot + axle * side;
            let over_m = (wheel - rails.origin).dot(z);
            let rise_per_m = d.up_per_m + (wheel - rails.origin).dot(y) * roll_per_m;
            // Of the wheel's body without its own turning, which is along the rail.
            let velocity = state.velocity + state.angular.cross(axle * side);
            let rate = velocity.dot(z) - speed * rise_per_m;
            let damper = track.support.1 * rate;
            let normal = (load_n - track.support.0 * over_m - damper).max(0.0);
            self.forces.normal_n[k] = normal;
            self.over_m = if k == 0 {
                over_m
            } else {
                self.over_m.min(over_m)
            };
            if normal > 0.0 {
                ledger.springs_j += (0.5 * track.support.0 * over_m - load_n) * over_m;
                ledger.dampers_w += damper * rate;
            }
            // At right angles to the way of the contact, so that the rails do no work, and through
            // the axle.
            let push = (z - x * rise_per_m) * normal;
            wrench.add_at(state, push, state.position + axle * side);
        }
        let off_m = (foot - rails.origin).dot(y);
        let play = (FLANGE_PLAY_M + 0.5 * d.gauge_m).max(0.0);
        let past = off_m - off_m.clamp(-play, play);
        let lateral = -FLANGE_STIFFNESS_N_M * past;
        ledger.springs_j += 0.5 * FLANGE_STIFFNESS_N_M * past * past;
        self.forces.lateral_n = lateral;
        self.off_m = off_m;
        // At rail level, but no torque about the axle: a flange does not drive the wheel.
        let tilt = x - axle * axle.dot(x);
        // The rail that is touched runs aside as the track does, and as the gauge widens.
        let aside_per_m = d.left_per_m + 0.5 * d.gauge_per_m * past.signum();
        wrench.force += (y - x * aside_per_m) * lateral;
        wrench.torque += tilt * (vehicle.wheel_radius_m * lateral);
    }

    /// Forces of traction and brake at the tread, through slide and slip protection.
    fn effort(&mut self, drive: Drive, dt_s: f64) -> (f64, f64) {
        let tread_mps = self.tread_mps;
        let share = (self.effort_share).update(tread_mps, &drive.reference, dt_s);
        let most_n = share * drive.brake_n;
        // Friction with elastic slip (Dahl): the same law brakes a running wheel and holds a
        // standing one.
        let most_slip = most_n / BRAKE_STIFFNESS_N_M;
        self.brake_slip_m = (self.brake_slip_m + tread_mps * dt_s).clamp(-most_slip, most_slip);
        let brake = BRAKE_STIFFNESS_N_M * self.brake_slip_m + BRAKE_DAMPING_N_S_M * tread_mps;
        (share * drive.traction_n, -brake.clamp(-most_n, most_n))
    }

    /// Creep along, across and in yaw; all that acts else is in the wrench already.
    fn creep(
        &mut self,
        vehicle: &Vehicle,
        track: &RouteTrack,
        rails: &RailPose,
        (state, wrench): (&BodyState, &mut Wrench),
        ledger: &mut Ledger,
        dt_s: f64,
    ) {
        let Axes { x, y, z } = rails.axes;
        let (mass, r) = (&vehicle.wheelset, vehicle.wheel_radius_m);
        let foot = state.position - z * r;
        let creep_mps = state.velocity_at(foot);
        let (along_mps, across_mps) = (creep_mps.dot(x), creep_mps.dot(y));
        // The wheels of a wheelset that turns, or runs on different radii, slip against each other.
        let cone = CONICITY * self.off_m / HALF_CONTACT_M;
        let yaw_rate = state.angular.dot(z) + cone * state.angular.dot(y);

        let per_mps = 1.0 / rails.speed_mps.abs().max(LEAST_SPEED_MPS);
        let load_n = self.forces.normal_n[0] + self.forces.normal_n[1];
        let (f_along, f_across) = (KALKER_ALONG_N * along_mps, KALKER_ACROSS_N * across_mps);
        let f_yaw = KALKER_ALONG_N * HALF_CONTACT_M * yaw_rate;
        let linear = f_along * f_along + f_across * f_across + f_yaw * f_yaw;
        let linear = 2.0 * per_mps * linear.sqrt();
        let total_mps = (along_mps * along_mps + across_mps * across_mps).sqrt();
        let share = track.adhesion_at(self.s_m).share(linear, load_n, total_mps);
        let along_c = 2.0 * KALKER_ALONG_N * per_mps * share;
        let across_c = 2.0 * KALKER_ACROSS_N * per_mps * share;
        let yaw_c = along_c * HALF_CONTACT_M * HALF_CONTACT_M;

        // creep' = free + gain F, by all that acts else, the axle's mass and its inertia.
        let pull = wrench.force / mass.kg - Vector::Z * GRAVITY_MPS2;
        let inverse = |inertia_kg_m2: f64| 1.0 / mass.kg + r * r / inertia_kg_m2;
        let along = Creepage {
            now: along_mps,
            free: pull.dot(x) - r * wrench.torque.dot(y) / mass.kg_m2.y,
            gain: inverse(mass.kg_m2.y),
        };
        let across = Creepage {
            now: across_mps,
            free: pull.dot(y) + r * wrench.torque.dot(x) / mass.kg_m2.x,
            gain: inverse(mass.kg_m2.x),
        };
        let yaw = Creepage {
            now: yaw_rate,
            free: wrench.torque.dot(z) / mass.kg_m2.z,
            gain: 1.0 / mass.kg_m2.z,
        };
        let forces = [(along, along_c), (across, across_c), (yaw, yaw_c)].map(|(creep, c)| {
            let force = creep.force(c, dt_s);
            ledger.creep_w -= force * creep.middle(force, dt_s);
            force
        });
        let [along_n, across_n, yaw_n_m] = forces;
        wrench.add_at(state, x * along_n + y * across_n, foot);
        wrench.torque += (z + y * cone) * yaw_n_m;
        self.forces.along_n = along_n;
        self.forces.lateral_n += across_n;
        self.forces.slip_mps = along_mps;
    }
}

/// A speed of creep now, how it changes by itself, and by a unit of force.
#[derive(Clone, Copy)]
struct Creepage {
    now: f64,
    free: f64,
    gain: f64,
}

impl Creepage {
    /// Force of the damping `c` for the creep that it leaves at the end of the step.
    fn force(self, c: f64, dt_s: f64) -> f64 {
        -c * (self.now + dt_s * self.free) / (1.0 + dt_s * c * self.gain)
    }

    /// The creep in the middle of the step.
    fn middle(self, force: f64, dt_s: f64) -> f64 {
        self.now + 0.5 * dt_s * (self.free + self.gain * force)
    }
}
