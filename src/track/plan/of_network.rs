//! A network of tracks in plan.

use super::{ElementEnd, PlanNetwork, TrackElement};
use crate::track::geodesy::Datum;
use crate::track::network::Network;
use nalgebra::Point2;

/// From point to point of a curve: a chord is under 5 mm off one of 100 m.
const STEP_M: f64 = 2.0;

impl PlanNetwork {
    /// Tracks as elements, by the same numbers.
    pub fn of_network(network: &Network, datum: Option<Datum>) -> Self {
        let elements = network.tracks.iter().map(|track| {
            let line = &track.alignment;
            let steps = (line.length_m() / STEP_M).ceil().max(1.0);
            let at = |k: u32| line.at(line.length_m() * f64::from(k) / steps).origin.xy();
            let points: Vec<Point2<f64>> = (0..=steps as u32).map(at).collect();
            let along_m = (0..=steps as u32).map(|k| line.length_m() * f64::from(k) / steps);
            TrackElement {
                id: track.name.clone(),
                along_m: along_m.collect(),
                points,
            }
        });
        let ends = network
            .ends()
            .flat_map(|end| network.next(end).map(move |next| (end, next)));
        let joints = ends.map(|(a, b)| {
            [a, b].map(|end| ElementEnd {
                element: usize::from(end.track.0),
                way: end.way,
            })
        });
        let joints: Vec<_> = joints.map(|[a, b]| (a, b)).collect();
        Self::new(datum, elements.collect(), &joints)
    }
}
