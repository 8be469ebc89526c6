//! Rise and fall: straight grades joined by parabolas, as railways are set out.

/// A grade that begins at a chainage, led in by a vertical curve centred on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grade {
    /// Where the tangents of the grades meet.
    pub from_m: f64,
    /// Rise over run.
    pub slope: f64,
    /// Radius of the vertical curve there (0 for none). Its ends are `radius_m` times half the
    /// change of slope away.
    pub radius_m: f64,
}

/// A stretch of the profile: a parabola from `s0` to where the next begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parabola {
    pub s0: f64,
    z0: f64,
    slope0: f64,
    /// Change of slope a metre.
    bend_per_m: f64,
}

impl Parabola {
    /// Height and slope.
    pub fn at(&self, s_m: f64) -> (f64, f64) {
        let d = s_m - self.s0;
        (
            self.z0 + d * (self.slope0 + 0.5 * self.bend_per_m * d),
            self.slope0 + self.bend_per_m * d,
        )
    }

    /// The same with more chainage.
    pub fn shifted(&self, more_m: f64) -> Self {
        Self {
            s0: self.s0 + more_m,
            ..*self
        }
    }

    /// The same, known by its height and slope at another chainage.
    pub fn begun_at(&self, s_m: f64) -> Self {
        let (z0, slope0) = self.at(s_m);
        Self {
            s0: s_m,
            z0,
            slope0,
            ..*self
        }
    }

    /// The stretch from here to `end_m` of a line of `length_m`, as met from its other end.
    pub fn reversed(&self, end_m: f64, length_m: f64) -> Self {
        let (z0, slope) = self.at(end_m);
        Self {
            s0: length_m - end_m,
            z0,
            slope0: -slope,
            bend_per_m: self.bend_per_m,
        }
    }
}

/// Grades and the parabolas between them as one chain. Every vertical curve adds its bend where
/// it begins and takes it away where it ends, so curves that overlap add up.
pub(super) fn profile(start_z: f64, grades: &[Grade]) -> Vec<Parabola> {
    // Chainage, change of slope at once, change of bend.
    let mut changes: Vec<(f64, f64, f64)> = Vec::with_capacity(2 * grades.len());
    for pair in grades.windows(2) {
        let (from_m, change) = (pair[1].from_m, pair[1].slope - pair[0].slope);
        let half_m = 0.5 * pair[1].radius_m * change.abs();
        if half_m > 0.0 {
            let bend = change / (2.0 * half_m);
            changes.push((from_m - half_m, 0.0, bend));
            changes.push((from_m + half_m, 0.0, -bend));
        } else {
            changes.push((from_m, change, 0.0));
        }
    }
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut last = Parabola {
        s0: 0.0,
        z0: start_z,
        slope0: grades.first().map_or(0.0, |g| g.slope),
        bend_per_m: 0.0,
    };
    let mut pieces = vec![last];
    for (s0, kink, bend) in changes {
        let (z0, slope) = last.at(s0);
        last = Parabola {
            s0,
            z0,
            slope0: slope + kink,
            bend_per_m: last.bend_per_m + bend,
        };
        pieces.push(last);
    }
    pieces
}
