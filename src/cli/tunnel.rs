//! What a tunnel file says, in a few lines.

use crate::settings::{LONGEST_KEY, shortened};
use crate::track::network::{Beyond, Crossing, Network, Switch, SwitchLeg, TrackEnd};
use crate::track::{Direction, Side, Track, TrackId, Tunnel};

/// Of a tunnel with one track, its length, radii, grades, sections, lamps, devices; of a network, that of each
/// track.
pub(super) fn report(tunnel: &Tunnel) -> String {
    let Network {
        tracks,
        switches,
        crossings,
        ..
    } = &tunnel.network;
    let head = format!("tunnel `{}`, line {}", tunnel.name, tunnel.line_number);
    if let [track] = &tracks[..] {
        let (length, lines) = of_track(track);
        return indented(&[vec![format!("{head}: {length}")], lines].concat());
    }
    let length_m: f64 = tracks.iter().map(|t| t.alignment.length_m()).sum();
    let (tracks_count, switches_count) = (tracks.len(), switches.len());
    let crossings_count = match crossings.len() {
        0 => String::new(),
        1 => ", 1 crossing".to_owned(),
        count => format!(", {count} crossings"),
    };
    let mut lines = vec![format!(
        "{head}: {tracks_count} tracks, {length_m:.1} m, {switches_count} switches{crossings_count}"
    )];
    let ends = (0..tracks.len()).map(|k| ends(&tunnel.network, TrackId(k as u16)));
    let of_tracks = tracks.iter().zip(ends);
    lines.extend(of_tracks.map(|(track, ends)| of_one_of_many(track, &ends)));
    lines.extend(switches.iter().map(|s| of_switch(&tunnel.network, s)));
    lines.extend(crossings.iter().map(|c| of_crossing(&tunnel.network, c)));
    indented(&lines)
}

/// What is before the begin of a track and beyond its end, as `from` and `to` name it.
fn ends(network: &Network, track: TrackId) -> String {
    let ends = [Direction::Down, Direction::Up].map(|way| TrackEnd { track, way });
    ends.map(|end| beyond(network, end)).join(" -> ")
}

fn beyond(network: &Network, end: TrackEnd) -> String {
    let (name, part) = match network.beyond(end) {
        Beyond::Track(next) => {
            let part = match next.way {
                Direction::Down => "begin",
                Direction::Up => "end",
            };
            (&network.tracks[usize::from(next.track.0)].name, part)
        }
        Beyond::Facing(switch) => (&network.switches[switch].name, "toe"),
        Beyond::Trailing(switch, SwitchLeg::Through) => (&network.switches[switch].name, "through"),
        Beyond::Trailing(switch, SwitchLeg::Diverging) => {
            (&network.switches[switch].name, "diverging")
        }
        Beyond::Buffer => return "buffer".to_owned(),
        Beyond::Open => return "open end".to_owned(),
    };
    format!("{}.{part}", shortened(name, LONGEST_KEY))
}

/// A track in one line.
fn of_one_of_many(track: &Track, ends: &str) -> String {
    let (length, _) = of_track(track);
    let name = shortened(&track.name, LONGEST_KEY);
    let counts = [
        (track.lamps.len(), "lamps"),
        (track.wayside.len(), "wayside devices"),
        (track.balises.len(), "balises"),
    ];
    let counts = counts.iter().filter(|(count, _)| *count > 0);
    let counts = counts.map(|(count, what)| format!(", {count} {what}"));
    let stations = track.stations.iter();
    let stations = stations.map(|s| place(track, &s.name, s.chainage_m));
    let stations = stations.map(|station| format!(", {station}"));
    let stated = stated(track)
        .into_iter()
        .map(|stated| format!(", {stated}"));
    let rest: String = stated.chain(counts).chain(stations).collect();
    format!("track `{name}`: {length}, {ends}{rest}")
}

/// A switch in one line.
fn of_switch(network: &Network, switch: &Switch) -> String {
    let hand = match network.hand(switch) {
        Side::Left => "left",
        Side::Right => "right",
    };
    let metres = |m: Option<f64>| m.map_or("nowhere".to_owned(), |m| format!("{m:.1} m"));
    format!(
        "switch `{}`: to the {hand}, {:.0} km/h; behind the toe the frog at {}, clear from {}",
        shortened(&switch.name, LONGEST_KEY),
        3.6 * switch.diverging_mps,
        metres(network.frog_m(switch)),
        metres(network.clear_from_m(switch)),
    )
}

/// A crossing in one line.
fn of_crossing(network: &Network, crossing: &Crossing) -> String {
    let sides = [0, 1].map(|side| {
        let place = crossing.places[side];
        let zone = crossing.zone(side);
        let stated = network.stated_chainage(place);
        let stated = stated.map(|stated| format!(" ({stated})"));
        let name = &network.tracks[usize::from(place.track.0)].name;
        format!(
            "track `{}` at {:.1} m{} (not clear from {:.1} to {:.1} m)",
            shortened(name, LONGEST_KEY),
            place.s_m,
            stated.unwrap_or_default(),
            zone.from_m,
            zone.to_m,
        )
    });
    format!(
        "crossing `{}`: {}, {:.1} deg, 1 in {:.1}",
        shortened(&crossing.name, LONGEST_KEY),
        sides.join(" and "),
        crossing.angle_rad.to_degrees(),
        1.0 / crossing.angle_rad.tan(),
    )
}

/// Length and radii, and all else.
fn of_track(track: &Track) -> (String, Vec<String>) {
    let length_m = track.alignment.length_m();
    let mut tightest = 0.0f64;
    let (mut lowest, mut steepest) = (f64::INFINITY, f64::NEG_INFINITY);
    for s in 0..=length_m as u32 {
        let frame = track.alignment.at(f64::from(s));
        tightest = tightest.max(frame.curvature_per_m.abs());
        lowest = lowest.min(frame.slope * 1e3);
        steepest = steepest.max(frame.slope * 1e3);
    }
    let plan = match tightest < 1e-9 {
        true => "straight".to_owned(),
        false => format!("tightest radius {:.0} m", 1.0 / tightest),
    };
    let devices = track.wayside.iter().map(|d| {
        let at = place(track, &d.name, d.chainage_m);
        format!("{at}, writes to balise {}", d.balise)
    });
    let balises = track.balises.iter();
    let balises = balises.map(|b| place(track, &b.name, b.chainage_m));
    let stations = track.stations.iter();
    let stations = stations.map(|s| place(track, &s.name, s.chainage_m));
    let rest = [
        format!("grades from {lowest:.1} to {steepest:.1} permille"),
        format!("{} stretches of cross-section", track.sections.len()),
        lamps(track),
        named("wayside devices", devices.collect()),
        named("balises", balises.collect()),
        named("stations", stations.collect()),
    ];
    let lines = stated(track).into_iter().chain(rest).collect();
    (format!("{length_m:.1} m, {plan}"), lines)
}

/// Where something is, with what the track states there.
fn place(track: &Track, name: &str, chainage_m: f64) -> String {
    let stated = track.stated_chainage.as_ref();
    let stated = stated.map(|stated| format!(" ({})", stated.text(chainage_m, 3)));
    let stated = stated.unwrap_or_default();
    format!("{} at {chainage_m} m{stated}", shortened(name, LONGEST_KEY))
}

/// What a track states at its ends, and its chainage equations.
fn stated(track: &Track) -> Option<String> {
    let stated = track.stated_chainage.as_ref()?;
    let [begin, end] = [0.0, track.alignment.length_m()].map(|s_m| stated.text(s_m, 3));
    let jumps = stated.equations().map(|jump| {
        let [back, ahead] = [jump.back_m, jump.ahead_m].map(|m| stated.number(m, 3));
        let (chain, by_m) = match jump.longer_m > 0.0 {
            true => ("long", jump.longer_m),
            false => ("short", -jump.longer_m),
        };
        let at_m = jump.at_m;
        format!(", {back} = {ahead} at {at_m} m (a {chain} chain of {by_m:.3} m)")
    });
    let jumps: String = jumps.collect();
    Some(format!("chainage from {begin} to {end}{jumps}"))
}

/// Of a long list the first.
fn named(what: &str, list: Vec<String>) -> String {
    let shown = list.get(..MOST_LISTED).unwrap_or(&list);
    let more = match list.len() - shown.len() {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    match list.len() {
        0 => format!("no {what}"),
        _ => format!("{what}: {}{more}", shown.join("; ")),
    }
}

const MOST_LISTED: usize = 20;

fn lamps(track: &Track) -> String {
    match (track.lamps.first(), track.lamps.last()) {
        (Some(first), Some(last)) => {
            let gaps = track
                .lamps
                .windows(2)
                .map(|w| w[1].chainage_m - w[0].chainage_m);
            let widest = gaps.fold(0.0, f64::max);
            format!(
                "{} lamps from {} to {} m, at most {widest:.1} m apart; chips of {:.1} us, {:?} code",
                track.lamps.len(),
                first.chainage_m,
                last.chainage_m,
                first.chip_s * 1e6,
                first.code,
            )
        }
        _ => "no lamps".to_owned(),
    }
}

pub(super) fn indented(lines: &[String]) -> String {
    lines.iter().map(|line| format!("  {line}\n")).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// Provokes: an end of a track that is told as that of another one, or as another kind of end.
    #[test]
    fn tracks_say_what_is_at_their_ends() {
        let text = include_str!("../../tunnels/terminus.toml");
        let said = report(&Tunnel::from_toml(text).unwrap());
        for (track, ends) in [
            ("u1", "open end -> W1.toe"),
            ("u2", "W1.through -> W4.through"),
            ("siding", "W7.through -> buffer"),
        ] {
            let begin = format!("track `{track}`: ");
            let line = said.lines().find(|line| line.contains(&begin)).unwrap();
            assert!(line.contains(&format!(", {ends}")), "{line}");
        }
    }

    /// Provokes: a crossing that is left out, or told of with the wrong track, place or angle.
    #[test]
    fn crossings_are_listed() {
        let text = include_str!("../../tests/tunnels/scissors.toml");
        let said = report(&Tunnel::from_toml(text).unwrap());
        assert!(
            said.contains("8 tracks") && said.contains("4 switches, 1 crossing\n"),
            "{said}"
        );
        let line = said
            .lines()
            .find(|line| line.contains("crossing `X`"))
            .unwrap();
        assert!(line.contains("track `A` at 33.7 m (A1+033.7)"), "{line}");
        assert!(line.contains("and track `B` at 33.7 m (not"), "{line}");
        // Twice 1 in 9.
        assert!(line.ends_with("12.7 deg, 1 in 4.4"), "{line}");
    }
}
