//! Files that are broken, or made to break a reader.

use super::joints_apart_m;
use super::{v2::STATION, v3::FORK};
use crate::track::import::railml::{RailMlOptions, read_railml};

/// A linear congruential generator (D. Knuth, The art of computer programming, volume 2, 3.3.4).
struct Draw(u64);

impl Draw {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % count.max(1)
    }
}

fn mutated(draw: &mut Draw, text: &str) -> String {
    let mut text = text.to_owned();
    for _ in 0..=draw.below(3) {
        let chars: Vec<(usize, char)> = text.char_indices().collect();
        let at = chars[draw.below(chars.len())].0;
        let numbers: Vec<(usize, usize)> = text
            .match_indices("=\"")
            .map(|(at, _)| {
                (
                    at + 2,
                    text[at + 2..]
                        .find('"')
                        .map_or(text.len(), |to| at + 2 + to),
                )
            })
            .collect();
        let value = numbers
            .get(draw.below(numbers.len()))
            .copied()
            .unwrap_or((0, 0));
        match draw.below(5) {
            0 => text.truncate(at),
            1 => text.insert(at, ['<', '>', '"', '0', '\u{e9}', '/'][draw.below(6)]),
            2 => drop(text.remove(at)),
            3 => {
                let odd = [
                    "nan", "-1", "1e300", "0", "inf", "", "1e-300", "a", "stem", "main", "300",
                    "left",
                ];
                text.replace_range(value.0..value.1, odd[draw.below(odd.len())]);
            }
            _ => {
                let other = numbers
                    .get(draw.below(numbers.len()))
                    .copied()
                    .unwrap_or((0, 0));
                let other = text[other.0..other.1].to_owned();
                text.replace_range(value.0..value.1, &other);
            }
        }
        if text.is_empty() {
            break;
        }
    }
    text
}

/// No file panics; an error says something; what is read has a graph as large as its tracks.
#[test]
fn mutated_files_never_panic() {
    let (mut accepted, mut refused) = (0, 0);
    for seed in 0..6000 {
        let draw = &mut Draw(seed);
        draw.below(2);
        let text = mutated(draw, if seed % 2 == 0 { STATION } else { FORK });
        match read_railml(&text, &RailMlOptions::default()) {
            Ok(map) => {
                accepted += 1;
                assert_eq!(map.along.len(), map.network.elements.len());
                let lengths = map
                    .network
                    .elements
                    .iter()
                    .map(|element| element.length_m());
                assert!(
                    lengths
                        .clone()
                        .all(|length_m| length_m > 0.0 && length_m < 1e10),
                    "{text}"
                );
                assert!(
                    map.plan_is_laid_out && joints_apart_m(&map) < 1e-6,
                    "{text}"
                );
            }
            Err(error) => {
                let said = error.to_string();
                assert!((20..2000).contains(&said.len()), "{said}");
                refused += 1;
            }
        }
    }
    assert!(accepted > 500 && refused > 500, "{accepted} {refused}");
    for at in 0..STATION.len() {
        assert!(
            STATION.get(..at).is_none_or(|text| at + 3 > STATION.len()
                || read_railml(text, &RailMlOptions::default()).is_err())
        );
    }
}

/// Each of these would take minutes or gigabytes if anything were quadratic or followed a number.
#[test]
fn large_files_take_seconds() {
    let many = 10_000;
    let deep = format!("<railml version=\"2.2\">{}", "<a>".repeat(many));
    assert!(read_railml(&deep, &RailMlOptions::default()).is_err());
    let deep = format!(
        "<railml version=\"2.2\">{}{}</railml>",
        "<a b=\"\">".repeat(many),
        "</a>".repeat(many)
    );
    assert!(read_railml(&deep, &RailMlOptions::default()).is_err());
    let attributes: String = (0..many).map(|k| format!(" a{k}=\"\"")).collect();
    let wide = format!("<railml version=\"2.2\"><b{attributes}/></railml>");
    assert!(read_railml(&wide, &RailMlOptions::default()).is_err());
    // Legs from one track, each from a place of its own, and all from one.
    let tracks = |main: &str,
                  connection: &dyn Fn(usize) -> String,
                  legs: &dyn Fn(usize) -> String|
     -> String {
        let legs: String = (0..many).map(legs).collect();
        let main: String = main.to_owned() + &(0..many).map(connection).collect::<String>();
        format!(
            "<railml version=\"2.2\"><infrastructure><tracks>{main}</connections></trackTopology></track>{legs}</tracks></infrastructure></railml>"
        )
    };
    let main =
        "<track id=\"m\"><trackTopology><trackBegin/><trackEnd pos=\"900000\"/><connections>";
    let switch = |k: usize| {
        format!(
            "<switch id=\"s{k}\" pos=\"{}\"><connection id=\"c{k}\" ref=\"d{k}\" orientation=\"outgoing\" course=\"left\"/></switch>",
            10 + k * 40
        )
    };
    let here = |k: usize| {
        format!(
            "<switch id=\"s{k}\" pos=\"10\"><connection id=\"c{k}\" ref=\"d{k}\" orientation=\"outgoing\" course=\"left\"/></switch>"
        )
    };
    let leg = |k: usize| {
        format!(
            "<track id=\"t{k}\"><trackTopology><trackBegin><connection id=\"d{k}\" ref=\"c{k}\"/></trackBegin><trackEnd pos=\"500\"/></trackTopology></track>"
        )
    };
    for text in [tracks(main, &switch, &leg), tracks(main, &here, &leg)] {
        let map = read_railml(&text, &RailMlOptions::default()).unwrap();
        assert_eq!(map.switches.len(), many);
        assert!(map.report.left_out.len() < 1000);
    }
    // Everything at once along one track, with coordinates.
    let place = |k: usize| {
        format!(
            "<geoCoord coord=\"{} 6000000\" epsgCode=\"25832\"/>",
            500_000.0 + 10.0 * k as f64 * 0.9996
        )
    };
    let switches: String = (0..many).map(|k| format!(
        "<switch id=\"s{k}\" pos=\"{}\">{}<connection id=\"c{k}\" ref=\"d{k}\" orientation=\"outgoing\" course=\"left\"/></switch>", 10 * k + 10, place(k + 1)
    )).collect();
    let along: String = (0..many).map(|k| format!(
        "<balise id=\"b{k}\" pos=\"{}\">{}</balise><radiusChange id=\"r{k}\" pos=\"{}\" radius=\"{}\"/><signal id=\"n{k}\" pos=\"{}\" dir=\"up\">{}</signal><tunnel id=\"u{k}\" pos=\"{}\" length=\"20\"/>",
        10 * k, place(k), 10 * k + 3, 100_000 + k, 10 * k, place(k), 10 * k
    )).collect();
    let text = format!(
        "<railml version=\"2.2\"><infrastructure><tracks><track id=\"m\"><trackTopology><trackBegin/><trackEnd pos=\"{}\"/><connections>{switches}</connections></trackTopology>\
        <trackElements><all>{along}</all></trackElements></track>{}</tracks></infrastructure></railml>",
        10 * many + 100,
        (0..many).map(leg).collect::<String>()
    );
    let map = read_railml(&text, &RailMlOptions::default()).unwrap();
    assert_eq!((map.switches.len(), map.plan_checks.len()), (many, many));
    // 900 km by kilometres of coordinates, with a radius every metre.
    let radii: String = (0..many)
        .map(|k| {
            format!(
                "<radiusChange id=\"r{k}\" pos=\"{k}\" radius=\"{}\"/>",
                300 + k % 7
            )
        })
        .collect();
    let placed = format!(
        "<railml version=\"2.2\"><infrastructure><tracks><track id=\"m\"><trackTopology><trackBegin><geoCoord coord=\"48 15\" epsgCode=\"4326\"/></trackBegin>\
        <trackEnd pos=\"900000\"><geoCoord coord=\"49 16\" epsgCode=\"4326\"/></trackEnd></trackTopology><trackElements><r>{radii}</r></trackElements></track></tracks></infrastructure></railml>"
    );
    let _ = read_railml(&placed, &RailMlOptions::default());
}
