//! What acts on the train's bodies in a step: suspension, rails, couplers, resistance, traction and brakes.

use super::super::driver::Effort;
use super::super::energy::Ledger;
use super::super::placement::BODIES;
use super::super::route_track::RouteTrack;
use super::super::suspension::{Axes, Wrench, coupler, primary, secondary};
use super::super::vehicle::AXLES;
use super::super::wheelset::{Drive, Wheelset};
use super::Consist;
use rapier3d_f64::math::Vector;
use rapier3d_f64::prelude::PhysicsWorld;

/// Slower than this, resistance fades, so that it does not push a standing train.
const FADE_MPS: f64 = 0.1;

impl Consist {
    /// Puts the forces of this step on the bodies.
    pub(in super::super) fn apply_forces(
        &mut self,
        world: &mut PhysicsWorld,
        track: &RouteTrack,
        effort: Effort,
        dt_s: f64,
    ) {
        self.previous = self.states[0];
        self.wrenches.fill(Wrench::default());
        self.ledger = Ledger::default();
        let davis_mps2 = self.davis_mps2(track);
        self.update_reference(effort, dt_s);
        let drive = self.drive(effort);
        for k in 0..self.settings.cars as usize {
            self.car_forces(k, track, drive, dt_s);
            self.resist(k, davis_mps2);
        }
        self.coupler_forces();
        self.book.enter(&self.ledger, dt_s);
        for (handle, wrench) in self.handles.iter().zip(&self.wrenches) {
            if let Some(body) = world.bodies.get_mut(*handle) {
                body.reset_forces(false);
                body.reset_torques(false);
                body.add_force(wrench.force, true);
                body.add_torque(wrench.torque, true);
            }
        }
    }

    /// What slide and slip protection takes for the train's speed, a step on.
    fn update_reference(&mut self, effort: Effort, dt_s: f64) {
        let shares = self.wheelsets.iter().map(Wheelset::effort_share);
        let mean_share = shares.sum::<f64>() / self.wheelsets.len() as f64;
        let treads_mps = self.wheelsets.iter().map(|w| w.tread_mps);
        (self.reference).update(treads_mps, effort, mean_share, dt_s);
    }

    /// What is demanded of every wheelset.
    fn drive(&self, effort: Effort) -> Drive {
        let share_kg = 0.25 * self.vehicle.effective_kg();
        Drive {
            traction_n: effort.traction_mps2 * share_kg,
            brake_n: effort.brake_mps2 * share_kg,
            reference: self.reference,
        }
    }

    /// Suspension, rails, traction and brakes of car `k`.
    fn car_forces(&mut self, k: usize, track: &RouteTrack, drive: Drive, dt_s: f64) {
        let v = &self.vehicle;
        let ledger = &mut self.ledger;
        let bodies = BODIES * k..BODIES * (k + 1);
        let states = &self.states[bodies.clone()];
        let [car, rest @ ..] = &mut self.wrenches[bodies] else {
            return;
        };
        let (bogies, wheels) = rest.split_at_mut(2);
        for (b, end) in [1.0, -1.0].into_iter().enumerate() {
            let bogie = (&states[1 + b], &mut bogies[b]);
            let at_m = end * v.semi_bogie_distance_m;
            let travel_m = secondary(v, at_m, (&states[0], car), bogie, ledger);
            if k == 0 && b == 0 {
                self.secondary_travel_m = travel_m;
            }
            let axes = Axes::of(states[1 + b].rotation);
            for (w, end) in [(2 * b, 1.0), (2 * b + 1, -1.0)] {
                let (state, wrench) = (&states[3 + w], &mut wheels[w]);
                let at_m = end * v.semi_wheelbase_m;
                let bogie = (&states[1 + b], &axes, &mut bogies[b]);
                let travel_m = primary(v, at_m, bogie, (state, wrench), ledger);
                if k == 0 && w == 0 {
                    self.primary_travel_m = travel_m;
                }
                let wheelset = &mut self.wheelsets[AXLES * k + w];
                let torque = wheelset.apply(v, track, drive, (state, wrench), ledger, dt_s);
                bogies[b].torque -= torque;
            }
        }
    }

    /// Running resistance on the bogies of car `k`, at axle height.
    fn resist(&mut self, k: usize, davis_mps2: f64) {
        let v = &self.vehicle;
        for at in [BODIES * k + 1, BODIES * k + 2] {
            let state = &self.states[at];
            let x = state.rotation * Vector::X;
            let speed = state.velocity.dot(x);
            let fade = (speed / FADE_MPS).clamp(-1.0, 1.0);
            let force = -0.5 * davis_mps2 * v.effective_kg() * fade;
            let axle = Vector::new(0.0, 0.0, v.wheel_radius_m - v.bogie_cg_m);
            self.wrenches[at].add_at(state, x * force, state.point(axle));
            self.ledger.resistance_w -= force * speed;
        }
    }

    fn coupler_forces(&mut self) {
        let ends = (self.vehicle.coupler_m(-1.0), self.vehicle.coupler_m(1.0));
        for (k, pull) in self.couplers_n.iter_mut().enumerate() {
            let (leading, following) = (BODIES * k, BODIES * (k + 1));
            let (before, after) = self.wrenches.split_at_mut(following);
            *pull = coupler(
                &self.vehicle.coupler,
                ends,
                (&self.states[leading], &mut before[leading]),
                (&self.states[following], &mut after[0]),
                &mut self.ledger,
            );
        }
    }
}
