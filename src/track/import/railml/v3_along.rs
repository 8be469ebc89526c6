//! What railML 3.x states along net elements.

use super::RailMlError;
use super::draft::{Draft, DraftTrack};
use super::stated::{LEAST_RADIUS_M, MOST_GRADE_PERMILLE, place_m};
use super::v3_reading::NetReading;
use super::xml::Item;
use crate::track::Direction;
use crate::track::import::{MapBalise, MapSignal, MapSpeed, MapStep};
use std::collections::{BTreeMap, BTreeSet};

/// Steps in which a transition's curvature changes.
const TRANSITION_STEPS: u32 = 8;
/// A buffer stop or an open end is at the end of its element if it is no farther from it, metres.
const END_M: f64 = 1.0;
/// A curve follows on another to within this, metres.
const FOLLOWS_M: f64 = 0.5;

/// A stretch of an element on which something lies.
struct Reach {
    track: usize,
    from_m: f64,
    to_m: f64,
    /// It runs against the element.
    is_back: bool,
}

/// A curve along a track.
struct CurveReach {
    from_m: f64,
    to_m: f64,
    /// None on a transition.
    curvature_per_m: Option<f64>,
}

/// Reads everything that is taken over into the tracks.
pub(super) fn read<'a>(
    root: Item<'a>,
    functional: Item<'a>,
    draft: &mut Draft<'a>,
    reading: &mut NetReading<'a>,
) -> Result<(), RailMlError> {
    let basic = basic_profiles(root);
    let mut curves: BTreeMap<usize, Vec<CurveReach>> = BTreeMap::new();
    for item in functional.children().flat_map(|group| group.children()) {
        match item.name() {
            "track" => name(item, draft, reading)?,
            "speedSection" => {
                let profiles: Vec<&str> = item
                    .named("validForSpeedProfile")
                    .filter_map(|p| p.attribute("ref"))
                    .collect();
                match profiles.is_empty() || profiles.iter().any(|profile| basic.contains(profile))
                {
                    true => speed(item, draft, reading)?,
                    false => reading
                        .fates
                        .leave(item, "for a profile of speeds that is not the basic one"),
                }
            }
            "gradientCurve" => grade(item, draft, reading)?,
            "horizontalCurve" => curve(item, &mut curves, draft, reading)?,
            "overCrossing" if item.attribute("constructionType") == Some("tunnel") => {
                let reaches = reaches(item, draft, reading)?;
                for reach in &reaches {
                    if let Some(track) = draft.tracks.get_mut(reach.track) {
                        track.along.tunnels_m.push([reach.from_m, reach.to_m]);
                    }
                }
                took(item, reaches.is_empty(), reading);
            }
            "signalIS" => spot(item, draft, reading, |track, at_m, way| {
                let name = item.label();
                let signal = way.map(|way| MapSignal {
                    name,
                    along_m: at_m,
                    way,
                });
                let is_taken = signal.is_some();
                track.along.signals.extend(signal);
                is_taken
            })?,
            "baliseGroup" | "balise" => spot(item, draft, reading, |track, at_m, _| {
                track.along.balises.push(MapBalise {
                    name: item.label(),
                    along_m: at_m,
                });
                true
            })?,
            "bufferStop" | "border" => spot(item, draft, reading, |track, at_m, _| {
                let is_end = [at_m < END_M, at_m > track.length_m - END_M];
                let is_buffer = item.name() == "bufferStop";
                for (buffer, is_end) in track.along.buffers.iter_mut().zip(is_end) {
                    *buffer |= is_buffer && is_end;
                }
                let ends = is_buffer || item.attribute("isOpenEnd") == Some("true");
                ends && is_end.contains(&true)
            })?,
            "switchIS" | "crossing" | "trainDetectionElement" => {
                spot(item, draft, reading, |_, _, _| false)?;
            }
            _ => {}
        }
    }
    for (number, curves) in curves {
        if let Some(track) = draft.tracks.get_mut(number) {
            track.along.curvatures_per_m = steps(curves, track.length_m);
        }
    }
    Ok(())
}

fn basic_profiles<'a>(root: Item<'a>) -> BTreeSet<&'a str> {
    let profiles = root.all().filter(|item| item.name() == "speedProfile");
    let basic =
        profiles.filter(|item| matches!(item.attribute("isBasicSpeedProfile"), Some("true" | "1")));
    basic.filter_map(|item| item.attribute("id")).collect()
}

fn took<'a>(item: Item<'a>, is_nowhere: bool, reading: &mut NetReading<'a>) {
    match is_nowhere {
        true => reading.fates.leave(item, "lies on no single element"),
        false => reading.fates.take(item),
    }
}

fn way(text: Option<&str>) -> Option<Direction> {
    match text {
        Some("normal") => Some(Direction::Up),
        Some("reverse") => Some(Direction::Down),
        _ => None,
    }
}

/// Stretches of single elements on which something lies.
fn reaches<'a>(
    item: Item<'a>,
    draft: &Draft<'a>,
    reading: &NetReading<'a>,
) -> Result<Vec<Reach>, RailMlError> {
    let mut reaches = Vec::new();
    let locations = item
        .named("linearLocation")
        .flat_map(|location| location.named("associatedNetElement"));
    for part in locations {
        let Some(number) = reading.number(part)? else {
            continue;
        };
        let length_m = draft.tracks.get(number).map_or(0.0, |track| track.length_m);
        let place = |metres: &str, share: &str, usual: f64| {
            let at_m = part.value(metres)?;
            let at_m = at_m.or(part.value(share)?.map(|share| share * length_m));
            place_m(part, length_m, at_m.unwrap_or(usual))
        };
        let begin_m = place("posBegin", "intrinsicCoordBegin", 0.0)?;
        let end_m = place("posEnd", "intrinsicCoordEnd", length_m)?;
        let is_back =
            end_m < begin_m || matches!(part.attribute("keepsOrientation"), Some("false" | "0"));
        reaches.push(Reach {
            track: number,
            from_m: begin_m.min(end_m),
            to_m: begin_m.max(end_m),
            is_back,
        });
    }
    Ok(reaches)
}

/// Something at a place of an element, and its coordinates: on the track, but for signals, which are beside it.
fn spot<'a>(
    item: Item<'a>,
    draft: &mut Draft<'a>,
    reading: &mut NetReading<'a>,
    mut put: impl FnMut(&mut DraftTrack<'a>, f64, Option<Direction>) -> bool,
) -> Result<(), RailMlError> {
    let mut is_taken = false;
    for location in item.named("spotLocation") {
        let Some(number) = reading.number(location)? else {
            continue;
        };
        let Some(track) = draft.tracks.get_mut(number) else {
            continue;
        };
        let share = location.value("intrinsicCoord")?;
        let at_m = location
            .value("pos")?
            .or(share.map(|share| share * track.length_m));
        let at_m = at_m.ok_or_else(|| location.fault("has neither `pos` nor `intrinsicCoord`"))?;
        let at_m = place_m(location, track.length_m, at_m)?;
        is_taken |= put(track, at_m, way(location.attribute("applicationDirection")));
        for point in location.named("geometricCoordinate") {
            let known = reading.known(item, point, (at_m, 1))?;
            match item.name() {
                "signalIS" => track.beside.extend(known),
                _ => track.places.extend(known),
            }
        }
    }
    if is_taken {
        reading.fates.take(item);
    } else if item.name() == "signalIS" {
        reading.fates.leave(item, "no `spotLocation` on a single element says for which trains it is: `applicationDirection` \"normal\" or \"reverse\" would");
    }
    Ok(())
}

/// Elements have the name of their first track, and its direction.
fn name<'a>(
    item: Item<'a>,
    draft: &mut Draft<'a>,
    reading: &mut NetReading<'a>,
) -> Result<(), RailMlError> {
    let reaches = reaches(item, draft, reading)?;
    for reach in &reaches {
        let Some(track) = draft.tracks.get_mut(reach.track) else {
            continue;
        };
        track.along.name.get_or_insert_with(|| item.label());
        let main = way(item.attribute("mainDirection"));
        let main = main.map(|way| if reach.is_back { way.reversed() } else { way });
        track.along.one_way = track.along.one_way.or(main);
    }
    took(item, reaches.is_empty(), reading);
    Ok(())
}

/// A speed begins at either end of its stretch, by direction. What is permitted after it, where no other begins, is not
/// stated: it goes on.
fn speed<'a>(
    item: Item<'a>,
    draft: &mut Draft<'a>,
    reading: &mut NetReading<'a>,
) -> Result<(), RailMlError> {
    let kmh = item.speed_kmh("maxSpeed")?;
    let kmh = kmh.ok_or_else(|| item.fault("has no `maxSpeed`: a number of km/h is needed"))?;
    let location = item.child("linearLocation");
    let valid = location.and_then(|location| way(location.attribute("applicationDirection")));
    let reaches = reaches(item, draft, reading)?;
    for reach in &reaches {
        let Some(track) = draft.tracks.get_mut(reach.track) else {
            continue;
        };
        let valid = valid.map(|way| if reach.is_back { way.reversed() } else { way });
        let ways = [(Direction::Up, reach.from_m), (Direction::Down, reach.to_m)];
        for (way, from_m) in ways
            .into_iter()
            .filter(|(way, _)| valid.is_none_or(|valid| valid == *way))
        {
            track.along.speeds.push(MapSpeed {
                from_m,
                kmh,
                way: Some(way),
            });
        }
    }
    took(item, reaches.is_empty(), reading);
    Ok(())
}

fn grade<'a>(
    item: Item<'a>,
    draft: &mut Draft<'a>,
    reading: &mut NetReading<'a>,
) -> Result<(), RailMlError> {
    let Some(permille) = item.value("gradient")? else {
        reading.fates.leave(item, "its `gradient` changes along it");
        return Ok(());
    };
    if permille.abs() > MOST_GRADE_PERMILLE {
        return Err(item.fault(format!(
            "`gradient` is {permille}: at most {MOST_GRADE_PERMILLE} permille is on a railway"
        )));
    }
    let reaches = reaches(item, draft, reading)?;
    for reach in &reaches {
        let Some(track) = draft.tracks.get_mut(reach.track) else {
            continue;
        };
        track.along.grades_permille.push(MapStep {
            from_m: reach.from_m,
            value: if reach.is_back { -permille } else { permille },
        });
    }
    took(item, reaches.is_empty(), reading);
    Ok(())
}

/// A positive radius turns to the right; 0 is straight.
fn curve<'a>(
    item: Item<'a>,
    curves: &mut BTreeMap<usize, Vec<CurveReach>>,
    draft: &mut Draft<'a>,
    reading: &mut NetReading<'a>,
) -> Result<(), RailMlError> {
    let curvature = match (item.attribute("curveType"), item.value("radius")?) {
        (Some("straight"), _) => Some(0.0),
        (Some("arc") | None, Some(radius_m)) if radius_m.abs() >= LEAST_RADIUS_M => {
            Some(-1.0 / radius_m)
        }
        (Some("arc") | None, Some(0.0)) => Some(0.0),
        (Some("arc") | None, radius_m) => {
            return Err(item.fault(format!(
                "`radius` is {}: 0 (straight) or at least {LEAST_RADIUS_M} m is needed",
                radius_m.map_or("missing".to_owned(), |radius_m| radius_m.to_string())
            )));
        }
        (Some("mixed"), _) => {
            reading
                .fates
                .leave(item, "a mixed curve does not say how it turns");
            return Ok(());
        }
        _ => None,
    };
    let reaches = reaches(item, draft, reading)?;
    for reach in &reaches {
        let along = |per_m: f64| if reach.is_back { -per_m } else { per_m };
        curves.entry(reach.track).or_default().push(CurveReach {
            from_m: reach.from_m,
            to_m: reach.to_m,
            curvature_per_m: curvature.map(along),
        });
        if let Some(track) = draft.tracks.get_mut(reach.track) {
            track.curves.push(item);
        }
    }
    took(item, reaches.is_empty(), reading);
    Ok(())
}

/// Steps of curvature: transitions lead from the curve before them to the one after, and where no curve is stated the
/// track is straight.
fn steps(mut curves: Vec<CurveReach>, length_m: f64) -> Vec<MapStep> {
    curves.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    let mut steps: Vec<MapStep> = Vec::new();
    let mut add = |from_m, value| steps.push(MapStep { from_m, value });
    let (mut reached_m, mut reached_per_m) = (0.0, 0.0);
    for (k, curve) in curves.iter().enumerate() {
        let CurveReach { from_m, to_m, .. } = *curve;
        if from_m - reached_m > FOLLOWS_M {
            add(reached_m, 0.0);
            reached_per_m = 0.0;
        }
        let next = curves
            .get(k + 1)
            .filter(|next| (next.from_m - to_m).abs() <= FOLLOWS_M);
        match curve.curvature_per_m {
            Some(per_m) => {
                add(from_m, per_m);
                reached_per_m = per_m;
            }
            None => {
                let end_per_m = next.and_then(|next| next.curvature_per_m).unwrap_or(0.0);
                for step in 0..TRANSITION_STEPS {
                    let part = f64::from(step) / f64::from(TRANSITION_STEPS);
                    let middle = part + 0.5 / f64::from(TRANSITION_STEPS);
                    add(
                        from_m + part * (to_m - from_m),
                        reached_per_m + middle * (end_per_m - reached_per_m),
                    );
                }
                reached_per_m = end_per_m;
            }
        }
        reached_m = to_m;
    }
    if length_m - reached_m > FOLLOWS_M {
        add(reached_m, 0.0);
    }
    steps
}
