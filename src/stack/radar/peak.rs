//! Echoes from cells that were detected: the highest among their neighbours, and where between cells they are highest.
//!
//! A detection that has most power of all neighbours by range, speed and beam begins a search for the highest place
//! between cells, along each axis in turn, by the spectrum's values about it ([`super::interpolation`]). Further heights
//! on the way along an axis are second echoes close by, and are searched likewise. What is no higher than a side lobe of
//! a stronger echo, or at the same place, is left out.

use super::angle::{Direction, DirectionFinder, Speeds, turn};
use super::interpolation::{Axis, BINS, Profile, dot};
use super::range_doppler::{RangeDoppler, Shape};
use super::settings::RadarTrackingSettings;
use super::window::{Weights, Window};
use rustfft::num_complex::Complex32;

/// So often each axis is searched in turn: after the first, the others are off by less than a tenth of a cell.
const TURNS: usize = 2;

/// A cell that was detected.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Its beam.
    pub beam: usize,
    /// Bin of range.
    pub range: usize,
    /// Bin of speed.
    pub speed: usize,
    /// Its power, counts^2.
    pub power: f32,
}

/// An echo, between cells.
#[derive(Clone, Copy, Debug)]
pub struct EchoPeak {
    /// Bins of range.
    pub range_bins: f64,
    /// Bins of speed, away positive.
    pub speed_bins: f64,
    /// Its direction.
    pub direction: Direction,
    /// In the cell's place and weights, counts^2.
    pub power: f64,
}

/// What side lobes an echo has, and their null.
#[derive(Clone, Copy, Debug)]
struct Lobe {
    null: f64,
    side_db: f64,
}

/// Finds echoes; its buffers are made once.
pub struct PeakFinder {
    range: Axis,
    speed: Axis,
    finder: DirectionFinder,
    lobes: [Lobe; 3],
    most: usize,
    margin_db: f64,
    /// Of all channels, by range, then speed, about a cell.
    around: Vec<[Profile; BINS]>,
    values: Vec<Complex32>,
    speeds: Speeds,
    found: Vec<EchoPeak>,
}

impl PeakFinder {
    /// For a radar's transforms and weights.
    pub fn new(
        radar: &RangeDoppler,
        [range, speed]: &[Weights; 2],
        settings: &RadarTrackingSettings,
    ) -> Self {
        let shape = &radar.shape;
        let lobe = |weights: &Weights| Lobe {
            null: weights.null_bins,
            side_db: weights.side_lobe_db,
        };
        let beam = Lobe {
            null: 1.0,
            side_db: 13.3,
        };
        Self {
            range: Axis::new(shape.samples, settings.range_window == Window::Rectangular),
            speed: Axis::new(shape.loops, settings.speed_window == Window::Rectangular),
            finder: DirectionFinder::new(&radar.array),
            lobes: [lobe(range), lobe(speed), beam],
            most: settings.most_detections as usize,
            margin_db: settings.side_lobe_margin_db,
            around: vec![[[Complex32::default(); BINS]; BINS]; shape.channels()],
            values: vec![Complex32::default(); shape.channels()],
            speeds: Speeds {
                own_mps: [0.0; 2],
                bin_mps: 0.0,
                most_mps: 0.0,
            },
            found: Vec::new(),
        }
    }

    /// Echoes of the cells that were detected, the strongest first; none has less power than `least`. Cells that are not
    /// highest among their neighbours are taken out of `cells`.
    pub fn find(
        &mut self,
        radar: &RangeDoppler,
        cells: &mut Vec<Cell>,
        least: f64,
        speeds: Speeds,
    ) -> &[EchoPeak] {
        self.speeds = speeds;
        cells.retain(|cell| is_highest(radar, cell));
        cells.sort_unstable_by(|a, b| {
            let place = |cell: &Cell| (cell.beam, cell.range, cell.speed);
            (b.power.total_cmp(&a.power)).then(place(a).cmp(&place(b)))
        });
        cells.truncate(self.most);
        self.found.clear();
        for cell in cells.iter() {
            self.search(radar, cell);
        }
        self.found.retain(|echo| echo.power >= least);
        // The same echo may be found from two cells, with the same power.
        self.found.sort_unstable_by(|a, b| {
            let by_range = || a.range_bins.total_cmp(&b.range_bins);
            let by_speed = || a.speed_bins.total_cmp(&b.speed_bins);
            let by_power = b.power.total_cmp(&a.power);
            by_power.then_with(by_range).then_with(by_speed)
        });
        self.leave_out(radar);
        self.found.truncate(self.most);
        &self.found
    }

    /// From a cell to the highest place near it, and to others beside it.
    fn search(&mut self, radar: &RangeDoppler, cell: &Cell) {
        self.gather(radar, cell);
        let u = radar.array.u(cell.beam);
        let start = Place {
            range: 0.0,
            speed: 0.0,
            direction: Direction { u, fold: 0 },
        };
        let main = self.climb(radar, cell, start, From::Cell);
        let others = self.beside(radar, cell, &main);
        self.keep(radar, cell, &main.place);
        for other in others.into_iter().flatten() {
            let second = self.climb(radar, cell, other, From::Between);
            self.keep(radar, cell, &second.place);
        }
    }

    fn keep(&mut self, radar: &RangeDoppler, cell: &Cell, place: &Place) {
        let Shape { samples, loops, .. } = radar.shape;
        let signed = radar.shape.signed(cell.speed) + place.speed;
        let half = 0.5 * loops as f64;
        let power = self.power(radar, cell, place);
        self.found.push(EchoPeak {
            range_bins: (cell.range as f64 + place.range).rem_euclid(samples as f64),
            speed_bins: (signed + half).rem_euclid(2.0 * half) - half,
            direction: place.direction,
            power,
        });
    }

    /// Takes the cells about one out of the spectrum.
    fn gather(&mut self, radar: &RangeDoppler, cell: &Cell) {
        for (channel, block) in self.around.iter_mut().enumerate() {
            for (i, line) in block.iter_mut().enumerate() {
                let range = self.range.bin(cell.range, i);
                for (j, value) in line.iter_mut().enumerate() {
                    *value = radar.value(channel, range, self.speed.bin(cell.speed, j));
                }
            }
        }
    }

    /// Searches along each axis in turn: from a cell half a bin and more away, from a place between cells less.
    fn climb(&mut self, radar: &RangeDoppler, cell: &Cell, start: Place, from: From) -> Climbed {
        let mut climbed = self.turn(radar, cell, start, from);
        for _ in 1..TURNS {
            climbed = self.turn(radar, cell, climbed.place, From::Between);
        }
        climbed
    }

    /// Along range, then speed, then in direction.
    fn turn(&mut self, radar: &RangeDoppler, cell: &Cell, start: Place, from: From) -> Climbed {
        let within = match from {
            From::Cell => 0.75,
            From::Between => 0.3,
        };
        let mut place = start;
        let block = self.form(radar, cell, &place);
        let kernel = self.speed.kernel(place.speed);
        let by_range = block.map(|line| dot(&line, &kernel));
        place.range = self.range.highest(&by_range, place.range, within);
        let range_kernel = self.range.kernel(place.range);
        let by_speed = summed(&block, &range_kernel);
        place.speed = self.speed.highest(&by_speed, place.speed, within);
        self.contract(&range_kernel, &self.speed.kernel(place.speed));
        place.direction = self.direction(radar, cell, &place, from);
        Climbed {
            place,
            by_range,
            by_speed,
        }
    }

    /// Of the values of all channels: any from a cell, else near the one that is known.
    fn direction(
        &mut self,
        radar: &RangeDoppler,
        cell: &Cell,
        place: &Place,
        from: From,
    ) -> Direction {
        let speed_bins = radar.shape.signed(cell.speed) + place.speed;
        let array = (&radar.shape, &radar.array);
        let Direction { u, fold } = place.direction;
        match from {
            From::Cell => {
                let folds = self.speeds.folds(&radar.shape, speed_bins, u);
                (self.finder).find(array, &self.values, speed_bins, folds, None)
            }
            From::Between => {
                let folds = std::iter::once(fold);
                (self.finder).find(array, &self.values, speed_bins, folds, Some(u))
            }
        }
    }

    /// Other heights on the axes through a place.
    fn beside(
        &mut self,
        radar: &RangeDoppler,
        cell: &Cell,
        climbed: &Climbed,
    ) -> [Option<Place>; 3] {
        let place = climbed.place;
        let range = self.range.other_height(&climbed.by_range, place.range);
        let speed = self.speed.other_height(&climbed.by_speed, place.speed);
        let speed_bins = radar.shape.signed(cell.speed) + place.speed;
        let array = (&radar.shape, &radar.array);
        let found = place.direction;
        let direction = (self.finder).other(array, &self.values, speed_bins, found);
        [
            range.map(|range| Place { range, ..place }),
            speed.map(|speed| Place { speed, ..place }),
            direction.map(|direction| Place { direction, ..place }),
        ]
    }

    /// Cells in the beam of a place, by range, then speed.
    fn form(&self, radar: &RangeDoppler, cell: &Cell, place: &Place) -> [Profile; BINS] {
        let mut formed = [[Complex32::default(); BINS]; BINS];
        let speed_bins = radar.shape.signed(cell.speed) + place.speed;
        for (channel, block) in self.around.iter().enumerate() {
            let weight = radar.array.weight(channel, place.direction.u)
                * turn(&radar.shape, channel, speed_bins, place.direction.fold);
            for (out, line) in formed.iter_mut().zip(block) {
                for (sum, value) in out.iter_mut().zip(line) {
                    *sum += value * weight;
                }
            }
        }
        formed
    }

    /// Values of all channels at a place, by the weights of bins about it.
    fn contract(&mut self, range: &Profile, speed: &Profile) {
        for (value, block) in self.values.iter_mut().zip(&self.around) {
            let lines = block.iter().zip(range);
            *value = lines.map(|(line, weight)| dot(line, speed) * weight).sum();
        }
    }

    fn power(&mut self, radar: &RangeDoppler, cell: &Cell, place: &Place) -> f64 {
        let range = self.range.amplitude(place.range);
        self.contract(&range, &self.speed.amplitude(place.speed));
        let speed_bins = radar.shape.signed(cell.speed) + place.speed;
        let Direction { u, fold } = place.direction;
        let values = self.values.iter().enumerate();
        let turned = values.map(|(channel, value)| {
            value * radar.array.weight(channel, u) * turn(&radar.shape, channel, speed_bins, fold)
        });
        f64::from(turned.sum::<Complex32>().norm_sqr())
    }

    /// Leaves out what a stronger echo explains. Echoes are in order of power.
    fn leave_out(&mut self, radar: &RangeDoppler) {
        let mut kept = 0;
        for k in 0..self.found.len() {
            let echo = self.found[k];
            let stronger = &self.found[..kept];
            let is_explained = stronger.iter().any(|strong| {
                let off = apart(radar, strong, &echo);
                let beyond = off
                    .iter()
                    .zip(&self.lobes)
                    .filter(|(off, lobe)| **off > lobe.null);
                let below_db: f64 = beyond.map(|(_, lobe)| lobe.side_db).sum();
                let weaker_db = 10.0 * (strong.power / echo.power).log10();
                off.iter().all(|off| *off < 0.5)
                    || (below_db > 0.0 && weaker_db > below_db - self.margin_db)
            });
            if !is_explained {
                self.found[kept] = echo;
                kept += 1;
            }
        }
        self.found.truncate(kept);
    }
}

/// About a cell: bins from it, and a direction.
#[derive(Clone, Copy, Debug)]
struct Place {
    range: f64,
    speed: f64,
    direction: Direction,
}

/// Where a search begins.
#[derive(Clone, Copy, Debug, PartialEq)]
enum From {
    Cell,
    Between,
}

/// Where it ended, and the values along the axes of range and of speed there.
struct Climbed {
    place: Place,
    by_range: Profile,
    by_speed: Profile,
}

/// Values by speed of cells by range, then speed, with weights of ranges.
fn summed(block: &[Profile; BINS], weights: &Profile) -> Profile {
    let mut sums = [Complex32::default(); BINS];
    for (line, weight) in block.iter().zip(weights) {
        for (sum, value) in sums.iter_mut().zip(line) {
            *sum += value * weight;
        }
    }
    sums
}

/// Bins of range and speed and beams between two echoes.
fn apart(radar: &RangeDoppler, a: &EchoPeak, b: &EchoPeak) -> [f64; 3] {
    let around = |off: f64, bins: f64| off.abs().min(bins - off.abs());
    let array = &radar.array;
    let beams = (a.direction.u - b.direction.u) / array.step;
    [
        around(a.range_bins - b.range_bins, radar.shape.samples as f64),
        around(a.speed_bins - b.speed_bins, radar.shape.loops as f64),
        if array.is_circular {
            around(beams, array.beams as f64)
        } else {
            beams.abs()
        },
    ]
}

/// No neighbour has more power; of equal ones the first is highest.
fn is_highest(radar: &RangeDoppler, cell: &Cell) -> bool {
    let Shape { samples, loops, .. } = radar.shape;
    let own = cell.range * loops + cell.speed;
    let ranges = cell.range.saturating_sub(1)..(cell.range + 2).min(samples);
    let speeds = [0, 1, loops - 1].map(|step| (cell.speed + step) % loops);
    let beams = [
        Some(cell.beam),
        before(radar, cell.beam),
        after(radar, cell.beam),
    ];
    beams.into_iter().flatten().all(|beam| {
        let powers = radar.beam_powers(beam);
        ranges.clone().all(|range| {
            speeds.iter().all(|speed| {
                let other = range * loops + speed;
                let power = powers[other];
                power < cell.power || (power <= cell.power && (cell.beam, own) <= (beam, other))
            })
        })
    })
}

fn before(radar: &RangeDoppler, beam: usize) -> Option<usize> {
    let array = &radar.array;
    beam.checked_sub(1)
        .or(array.is_circular.then(|| array.beams - 1))
}

fn after(radar: &RangeDoppler, beam: usize) -> Option<usize> {
    let array = &radar.array;
    let next = beam + 1;
    if next < array.beams {
        Some(next)
    } else {
        array.is_circular.then_some(0)
    }
}
