//! Lamps that are out, dim, or flicker with the mains.

use super::check_times;
use crate::bus::SimTime;
use crate::settings::{Checker, settings};
use crate::track::Tunnel;
use crate::track::waveform::Ripple;
use crate::twin::lights::{LampChange, LampLight};
use crate::twin::random::Stream;

settings! {
    /// A fault of some lamps. Which: those that have one of the numbers, stand in the stretch, and
    /// are in the share drawn from these; where none of the three is given, all.
    pub struct LampFaultSettings {
        /// Numbers of the lamps (the second part of their UID). Default: any.
        numbers: Option<Vec<u16>>;
        /// Only of the track of this name. Default: of all tracks.
        track: Option<String>;
        /// Only from this chainage on, m. Default: from the line's beginning.
        from_m: Option<f64>, in -1e6..=1e6;
        /// Only up to this chainage, m. Default: to the line's end.
        to_m: Option<f64>, in -1e6..=1e6;
        /// This share of them, 0 to 1, drawn from the seed: of n lamps, the whole number nearest to
        /// share x n. Default 1: all.
        #[serde(default = "crate::settings::one::<f64>")]
        share: f64, in 0.0..=1.0;
        /// What is wrong with them.
        fault: LampFaultKind, nested;
        /// Since when, s. Default 0.
        #[serde(default)]
        from_s: f64, in 0.0..=86_400.0;
        /// Until when, s. Default: to the end.
        to_s: Option<f64>, in 0.0..=1e6;
    }
    also check_stretches
}

settings! {
    /// What may be wrong with a lamp.
    #[derive(Copy)]
    #[serde(tag = "kind", rename_all = "snake_case")]
    pub enum LampFaultKind {
        /// It is out.
        Dead,
        /// It has aged, or is dirty.
        Dim {
            /// Its light as a share of a good lamp's, 0 to 1.
            level: f64, in 0.0..=1.0;
        },
        /// Its driver lets the mains through: its light swells and sinks by a sine.
        Flicker {
            /// By this share of the mean, 0 to 1.
            #[serde(default = "half")]
            depth: f64, in 0.0..=1.0;
            /// So often a second, Hz: twice the mains frequency.
            #[serde(default = "twice_the_mains")]
            frequency_hz: f64, in 1.0..=2000.0;
            /// Phase at time 0, deg. Default: one of its own for each lamp, drawn from the seed, as
            /// lamps hang on three phases and long cables.
            phase_deg: Option<f64>, in -360.0..=360.0;
        },
    }
}

fn half() -> f64 {
    0.5
}

fn twice_the_mains() -> f64 {
    100.0
}

impl LampFaultSettings {
    fn check_stretches(&self, check: &mut Checker<'_>) {
        check_times(self.from_s, self.to_s, check);
        let from_m = self.from_m.unwrap_or(-1e6);
        check.within("to_m", self.to_m, from_m..=1e6);
    }

    /// A fault that strikes nothing is a slip of the pen.
    pub(super) fn check_in(&self, tunnel: &Tunnel, check: &mut Checker<'_>, at: &str) {
        let Some(first) = tunnel.lamps().next() else {
            check.problem(
                at,
                format!("tunnel `{}` has no lamps", tunnel.name),
                "take this out, or choose a tunnel with lamps",
            );
            return;
        };
        let has = |number: u16| tunnel.lamps().any(|l| l.uid.lamp == number);
        let missing = (self.numbers.iter().flatten()).find(|number| !has(**number));
        if let Some(number) = missing {
            let last = tunnel.lamps().last().unwrap_or(first);
            check.problem(
                &format!("{at}.numbers"),
                format!("tunnel `{}` has no lamp {number}", tunnel.name),
                format!("its lamps are {} to {}", first.uid.lamp, last.uid.lamp),
            );
        } else if self.candidates(tunnel).next().is_none() {
            check.problem(
                &format!("{at}.from_m"),
                "there is no such lamp in the stretch",
                "widen it, or take it out",
            );
        }
    }

    /// Indices of the lamps of which the share is drawn.
    fn candidates<'a>(&'a self, tunnel: &'a Tunnel) -> impl Iterator<Item = usize> + 'a {
        let tracks = tunnel.network.tracks.iter();
        let lamps = tracks.flat_map(|track| track.lamps.iter().map(|lamp| (&track.name, lamp)));
        lamps.enumerate().filter_map(|(k, (track, lamp))| {
            let listed = (self.numbers.as_ref()).is_none_or(|list| list.contains(&lamp.uid.lamp));
            let after = self.from_m.is_none_or(|m| lamp.chainage_m >= m);
            let before = self.to_m.is_none_or(|m| lamp.chainage_m <= m);
            let here = self.track.as_ref().is_none_or(|name| name == track);
            (listed && here && after && before).then_some(k)
        })
    }

    /// Indices of the lamps that it strikes; `fault` is its place among the scenario's.
    ///
    /// Each lamp draws a number, and those with the lowest are struck: so a share is met as nearly
    /// as whole lamps can, and whoever raises it adds lamps to those that were struck before.
    pub fn chosen(&self, fault: usize, tunnel: &Tunnel, seed: u64) -> impl Iterator<Item = usize> {
        let uids: Vec<_> = tunnel.lamps().map(|lamp| lamp.uid).collect();
        let draw = |k: usize| {
            let uid = uids[k];
            Stream::new(seed, 0, &format!("lamp fault/{fault}/{uid}")).uniform(0)
        };
        let mut drawn: Vec<_> = self.candidates(tunnel).map(|k| (draw(k), k)).collect();
        drawn.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let count = (self.share * drawn.len() as f64).round() as usize;
        drawn.into_iter().take(count).map(|(_, k)| k)
    }

    fn acts_at(&self, time: SimTime) -> bool {
        let (from, to) = self.span();
        time >= from && to.is_none_or(|to| time < to)
    }

    fn span(&self) -> (SimTime, Option<SimTime>) {
        let to = self.to_s.map(SimTime::from_secs);
        (SimTime::from_secs(self.from_s), to)
    }
}

/// Gives the lamps of a tunnel, in its order, their faults: as they are at time 0, and how each
/// changes later. Faults of one lamp add up: levels multiply, and of ripples the deepest is seen.
pub fn age(lamps: &mut [LampLight], faults: &[LampFaultSettings], tunnel: &Tunnel, seed: u64) {
    let mut struck: Vec<Vec<usize>> = vec![Vec::new(); lamps.len()];
    for (fault, settings) in faults.iter().enumerate() {
        for k in settings.chosen(fault, tunnel, seed) {
            if let Some(of_lamp) = struck.get_mut(k) {
                of_lamp.push(fault);
            }
        }
    }
    for ((lamp, site), of_lamp) in lamps.iter_mut().zip(tunnel.lamps()).zip(struck) {
        let phase = Stream::new(seed, 0, &format!("mains/{}", site.uid)).uniform(0);
        let state_at = |time: SimTime| {
            let acting = (of_lamp.iter().map(|f| &faults[*f])).filter(|f| f.acts_at(time));
            acting.fold((1.0, Ripple::default()), |state, f| {
                with(state, f.fault, std::f64::consts::TAU * phase)
            })
        };
        (lamp.level, lamp.ripple) = state_at(SimTime::ZERO);
        let spans = of_lamp.iter().map(|f| faults[*f].span());
        let mut times: Vec<_> = spans
            .flat_map(|(from, to)| [Some(from), to])
            .flatten()
            .collect();
        times.sort_unstable();
        times.dedup();
        let later = times.into_iter().filter(|time| *time > SimTime::ZERO);
        lamp.changes = later
            .map(|at| {
                let (level, ripple) = state_at(at);
                LampChange { at, level, ripple }
            })
            .collect();
    }
}

/// A lamp's level and ripple with one fault more.
fn with((level, ripple): (f64, Ripple), fault: LampFaultKind, own_rad: f64) -> (f64, Ripple) {
    match fault {
        LampFaultKind::Dead => (0.0, ripple),
        LampFaultKind::Dim { level: share } => (level * share, ripple),
        LampFaultKind::Flicker {
            depth,
            frequency_hz,
            phase_deg,
        } => {
            let own = Ripple {
                depth,
                frequency_hz,
                phase_rad: phase_deg.map_or(own_rad, f64::to_radians),
            };
            (level, if depth > ripple.depth { own } else { ripple })
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::settings::read_toml;
    use crate::twin::faults::FaultSettings;

    fn line() -> Tunnel {
        Tunnel::from_toml(include_str!("../../../tunnels/chengdu_line1.toml")).unwrap()
    }

    fn faults(text: &str) -> Vec<LampFaultSettings> {
        read_toml::<FaultSettings>(text).unwrap().lamps
    }

    fn lit(tunnel: &Tunnel, faults: &[LampFaultSettings], seed: u64) -> Vec<LampLight> {
        let new = |site| LampLight::from_site(site, 0.0);
        let mut lamps: Vec<_> = tunnel.lamps().map(new).collect();
        age(&mut lamps, faults, tunnel, seed);
        lamps
    }

    /// Fails where a share is missed by a lamp, drawn from another seed's stream, or where a larger
    /// share spares a lamp that a smaller one strikes.
    #[test]
    fn a_share_is_met_and_grows() {
        let tunnel = line();
        let n = tunnel.lamps().count() as f64;
        let dead = |share: f64, seed| {
            let text = format!("lamps = [{{ share = {share:?}, fault = {{ kind = 'dead' }} }}]");
            let lamps = lit(&tunnel, &faults(&text), seed);
            let dead = lamps.iter().map(|l| l.level.abs() < 1e-12);
            dead.collect::<Vec<_>>()
        };
        let mut before = vec![false; tunnel.lamps().count()];
        for share in [0.0, 0.055, 0.11, 0.22, 1.0] {
            let now = dead(share, 1);
            let count = now.iter().filter(|d| **d).count();
            assert!((count as f64 - share * n).abs() <= 0.5, "{share}: {count}");
            assert!(before.iter().zip(&now).all(|(before, now)| now | !before));
            before = now;
        }
        assert_ne!(dead(0.22, 1), dead(0.22, 2));
        // Neither in one run nor at even distances: of those out, 22 % have the next one out too.
        let out = dead(0.22, 1);
        let pairs = out.windows(2).filter(|w| w[0] && w[1]).count();
        assert!((5..26).contains(&pairs), "{pairs}");
    }

    /// Fails where lists and stretches are not both held to, or neighbours are struck.
    #[test]
    fn lists_and_stretches_choose() {
        let tunnel = line();
        let text = "[[lamps]]\nnumbers = [3, 40, 41]\nfrom_m = 300.0\nfault = { kind = 'dead' }\n\
                    [[lamps]]\nfrom_m = 100.0\nto_m = 130.0\nfault = { kind = 'dim', level = 0.4 }\n";
        for (site, lamp) in tunnel.lamps().zip(lit(&tunnel, &faults(text), 1)) {
            let expected = match (site.uid.lamp, site.chainage_m) {
                (40 | 41, _) => 0.0,
                (_, 100.0..=130.0) => 0.4,
                _ => 1.0,
            };
            assert!((lamp.level - expected).abs() < 1e-12, "{}", site.uid);
            assert!(lamp.changes.is_empty());
        }
    }

    /// Fails where a fault begins or ends at a wrong time, ends another one with it, or a ripple's
    /// phase is the same for all lamps.
    #[test]
    fn faults_come_and_go() {
        let tunnel = line();
        let text = "[[lamps]]\nnumbers = [7]\nfault = { kind = 'dim', level = 0.5 }\nfrom_s = 1.0\n\
                    [[lamps]]\nnumbers = [7]\nfault = { kind = 'dead' }\nfrom_s = 2.0\nto_s = 3.0\n\
                    [[lamps]]\nnumbers = [7, 8]\nfault = { kind = 'flicker' }\nto_s = 2.5\n";
        let lamps = lit(&tunnel, &faults(text), 1);
        let of = |number| {
            let mut lamps = tunnel.lamps();
            lamps.position(|l| l.uid.lamp == number).unwrap()
        };
        let (seven, eight) = (&lamps[of(7)], &lamps[of(8)]);
        let state = |s: f64| {
            let now = seven.at(SimTime::from_secs(s));
            (now.level, now.ripple.depth)
        };
        let said = [0.0, 1.0, 2.0, 2.4, 2.5, 3.0].map(state);
        let expected = [
            (1.0, 0.5),
            (0.5, 0.5),
            (0.0, 0.5),
            (0.0, 0.5),
            (0.0, 0.0),
            (0.5, 0.0),
        ];
        assert_eq!(said, expected);
        assert!((seven.ripple.frequency_hz - 100.0).abs() < 1e-12);
        assert!((seven.ripple.phase_rad - eight.ripple.phase_rad).abs() > 1e-3);
        assert_eq!(lamps, lit(&tunnel, &faults(text), 1));
    }
}
