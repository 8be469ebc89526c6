//! Stretches of lines, one after the other: what a train runs on whose way leads over several tracks.

use super::{Alignment, LinearChange, PlanPiece};

impl Alignment {
    /// The line between two of its chainages, the first of which becomes 0. It stays where it is in the
    /// world, and runs on straight beyond both ends. Chainages beyond the line's ends count as those.
    ///
    /// ```
    /// use metrotwin::track::{Alignment, PlanElement};
    /// use nalgebra::Point3;
    ///
    /// let line = Alignment::new(Point3::origin(), 0.0, &[PlanElement::arc(500.0, 0.002, 0.1)], &[]);
    /// let middle = line.stretch(100.0, 300.0);
    /// assert!((middle.length_m() - 200.0).abs() < 1e-12);
    /// assert!((middle.at(50.0).origin - line.at(150.0).origin).norm() < 1e-12);
    /// ```
    #[must_use]
    pub fn stretch(&self, from_m: f64, to_m: f64) -> Self {
        let from_m = from_m.clamp(0.0, self.length_m);
        let to_m = to_m.clamp(from_m, self.length_m);
        let lead = |piece: &PlanPiece, at_m: f64| {
            let ds = at_m - piece.s0;
            let cant = LinearChange::constant(piece.cant.at(ds));
            let mut straight = piece.next(ds, LinearChange::constant(0.0), cant);
            straight.s0 = at_m - from_m;
            straight
        };
        let first = self.plan.partition_point(|p| p.s0 <= from_m).max(1) - 1;
        let mut plan = vec![lead(&self.plan[first], from_m)];
        let mut last = first;
        for (k, piece) in self.plan.iter().enumerate().skip(first) {
            if piece.s0 >= to_m {
                break;
            }
            plan.push(piece.from(from_m));
            last = k;
        }
        plan.push(lead(&self.plan[last], to_m));
        let first = self.profile.partition_point(|p| p.s0 <= from_m).max(1) - 1;
        let profile = self.profile[first..].iter();
        let profile = profile.enumerate().filter(|(k, p)| *k == 0 || p.s0 < to_m);
        Self {
            plan,
            profile: profile.map(|(_, p)| p.shifted(-from_m)).collect(),
            length_m: to_m - from_m,
        }
    }

    /// This line and then another one, which stays where it is in the world: so it must begin where this one
    /// ends.
    #[must_use]
    pub fn then(mut self, next: &Self) -> Self {
        let length_m = self.length_m;
        // The lead-out of this line, and the lead-in of the next.
        self.plan.pop();
        let pieces = next.plan[1..].iter();
        self.plan
            .extend(pieces.map(|piece| piece.shifted(length_m)));
        self.profile.retain(|p| p.s0 < length_m);
        let first = next.profile.partition_point(|p| p.s0 <= 0.0).max(1) - 1;
        self.profile
            .push(next.profile[first].begun_at(0.0).shifted(length_m));
        let others = next.profile[first + 1..].iter();
        self.profile.extend(others.map(|p| p.shifted(length_m)));
        self.length_m += next.length_m;
        self
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::super::tests::winding;

    /// Provokes: a stretch that is elsewhere, leans or climbs otherwise than the line it is of, cut at a joint
    /// of elements, within one, or at the line's ends; an end that does not run on straight.
    #[test]
    fn a_stretch_is_the_line_between_its_ends() {
        let line = winding();
        let all_m = line.length_m();
        for (from_m, to_m) in [
            (0.0, all_m),
            (120.0, 380.0),
            (33.3, 701.7),
            (400.0, 400.5),
            (880.0, all_m),
        ] {
            let stretch = line.stretch(from_m, to_m);
            assert!((stretch.length_m() - (to_m - from_m)).abs() < 1e-12);
            for k in 0..=100 {
                let s_m = (to_m - from_m) * f64::from(k) / 100.0;
                let inside = s_m.clamp(1e-9, to_m - from_m - 1e-9);
                let (found, right) = (stretch.at(inside), line.at(from_m + inside));
                assert!(
                    (found.origin - right.origin).norm() < 1e-10,
                    "{from_m} {s_m}"
                );
                assert!((found.heading_rad - right.heading_rad).abs() < 1e-12);
                assert!((found.slope - right.slope).abs() < 1e-12);
                assert!((found.curvature_per_m - right.curvature_per_m).abs() < 1e-12);
                assert!((found.roll_rad - right.roll_rad).abs() < 1e-10);
            }
            for beyond_m in [-20.0, to_m - from_m + 20.0] {
                assert!(stretch.at(beyond_m).curvature_per_m.abs() < 1e-15);
            }
        }
    }

    /// Provokes: a step at a joint, chainages that are off behind it, a profile that begins at the wrong height.
    #[test]
    fn stretches_after_each_other_are_the_line_again() {
        let line = winding();
        let cuts = [0.0, 60.0, 120.0, 250.0, 251.0, 600.0, line.length_m()];
        let mut parts = cuts.windows(2).map(|cut| line.stretch(cut[0], cut[1]));
        let first = parts.next().unwrap();
        let again = parts.fold(first, |line, next| line.then(&next));
        assert!((again.length_m() - line.length_m()).abs() < 1e-10);
        for k in 0..=2000 {
            let s_m = line.length_m() * f64::from(k) / 2000.0;
            let (found, right) = (again.at(s_m), line.at(s_m));
            assert!((found.origin - right.origin).norm() < 1e-9, "{s_m}");
            assert!((found.heading_rad - right.heading_rad).abs() < 1e-12);
            assert!((found.slope - right.slope).abs() < 1e-9, "{s_m}");
        }
        let there_and_back = again.reversed().stretch(10.0, 800.0).reversed();
        let place = there_and_back.at(100.0).origin;
        let same = line.at(line.length_m() - 800.0 + 100.0).origin;
        assert!((place - same).norm() < 1e-9);
    }
}
