//! Whether decisions are wrong as often as they say.

/// Upper ends of classes of the probability that a decision is said to be wrong with.
const SAID_WRONG: [f64; 6] = [1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1.0];

/// Decisions that were said to be wrong with about the same probability.
#[derive(Clone, Copy, Debug, Default)]
struct Said {
    decisions: usize,
    /// Sum of the probabilities: so many of them should be wrong.
    expected_wrong: f64,
    wrong: usize,
}

impl Said {
    /// Probability that of as many as this are said to be wrong at least so many are (Poisson's, which is wider than
    /// that of independent decisions).
    fn at_least(&self) -> f64 {
        let terms = (0..self.wrong).scan((-self.expected_wrong).exp(), |term, k| {
            let now = *term;
            *term *= self.expected_wrong / (k + 1) as f64;
            Some(now)
        });
        1.0 - terms.sum::<f64>()
    }
}

/// Counts of the first decisions of each class on each track: decisions on one track are no independent trials, but at
/// whichever time one stops, as many are wrong as are said to be.
#[derive(Debug, Default)]
pub struct Calibration {
    classes: [Said; SAID_WRONG.len()],
    /// The track that the train is on, and the classes counted there.
    track: Option<(usize, [bool; SAID_WRONG.len()])>,
}

impl Calibration {
    /// A run begins: what was said on another one is no decision of it.
    pub fn begin_run(&mut self) {
        self.track = None;
    }

    /// Takes a decision that was made on a track.
    pub fn add(&mut self, track: usize, said_wrong: f64, right: bool) {
        if self.track.is_none_or(|(last, _)| last != track) {
            self.track = Some((track, Default::default()));
        }
        let class = SAID_WRONG.partition_point(|most| *most < said_wrong);
        let Some((_, counted)) = &mut self.track else {
            return;
        };
        if !std::mem::replace(&mut counted[class], true) {
            let said = &mut self.classes[class];
            said.decisions += 1;
            said.expected_wrong += said_wrong;
            said.wrong += usize::from(!right);
        }
    }

    pub fn extend(&mut self, other: &Self) {
        for (sum, said) in self.classes.iter_mut().zip(other.classes) {
            sum.decisions += said.decisions;
            sum.expected_wrong += said.expected_wrong;
            sum.wrong += said.wrong;
        }
    }

    /// The least probability of a class that so many or more of its decisions are wrong.
    pub fn least_probability(&self) -> f64 {
        self.classes.iter().map(Said::at_least).fold(1.0, f64::min)
    }

    pub fn print(&self, title: &str) {
        println!("\n{title}\nsaid wrong up to   decisions   expected wrong   wrong");
        for (most, said) in SAID_WRONG.iter().zip(&self.classes) {
            let Said {
                decisions,
                expected_wrong,
                wrong,
            } = said;
            println!("{most:16.0e} {decisions:11} {expected_wrong:16.3} {wrong:7}");
        }
    }
}

/// Fails where too many wrong ones pass.
#[test]
fn too_many_wrong_ones_are_seen() {
    for (wrong, passes) in [(0, true), (1, true), (6, false)] {
        let mut of = Calibration::default();
        for track in 0..100 {
            of.add(track, 5e-3, track >= wrong);
            of.add(track, 5e-3, false);
        }
        let probability = of.least_probability();
        assert_eq!(probability > 1e-3, passes, "{wrong}: {probability}");
    }
}
