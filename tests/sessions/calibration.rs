//! Whether decisions are wrong as often as they say.

/// Upper ends of classes of the probability that a decision is said to be wrong with.
const SAID_WRONG: [f64; 6] = [1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1.0];

/// So near to a joint a decision for the element beyond it is wrong about the place, not about the track.
pub const AT_JOINT_M: f64 = 15.0;

/// Where a train really is.
#[derive(Clone, Copy)]
pub struct TruePlace {
    pub element: usize,
    /// To the nearer end of the element.
    pub from_end_m: f64,
}

impl TruePlace {
    pub fn new(element: usize, along_m: f64, length_m: f64) -> Self {
        Self {
            element,
            from_end_m: along_m.min(length_m - along_m),
        }
    }

    pub fn is_at_joint(&self) -> bool {
        self.from_end_m < AT_JOINT_M
    }
}

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
        let expected = self.expected_wrong;
        let mut log_term = -expected;
        let mut below = 0.0;
        for k in 0..self.wrong {
            below += log_term.exp();
            log_term += expected.ln() - ((k + 1) as f64).ln();
        }
        1.0 - below
    }
}

/// Counts of the first decisions of each class of each stay on an element, but near joints: decisions of one stay are no
/// independent trials, but at whichever time one stops, as many are wrong as are said to be. A stay is by where the
/// train really is: whatever is named meanwhile, and however often that changes, counts once a class. A stay by what is
/// named would begin anew with each change of mind, and count one error of a map or a receiver again and again.
#[derive(Debug, Default)]
pub struct Calibration {
    classes: [Said; SAID_WRONG.len()],
    /// The element that the train is on, and the classes counted there.
    stay: Option<(usize, [bool; SAID_WRONG.len()])>,
}

impl Calibration {
    /// A run begins: what was said on another one is no decision of it.
    pub fn begin_run(&mut self) {
        self.stay = None;
    }

    /// Takes a decision that was made at a place, said to be wrong with a probability.
    pub fn add(&mut self, truth: TruePlace, said_wrong: f64, right: bool) {
        let element = truth.element;
        if self.stay.is_none_or(|(last, _)| last != element) {
            self.stay = Some((element, Default::default()));
        }
        if truth.is_at_joint() {
            return;
        }
        let class = SAID_WRONG.partition_point(|most| *most < said_wrong);
        let Some((_, counted)) = &mut self.stay else {
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
        for element in 0..100 {
            let truth = TruePlace::new(element, 50.0, 100.0);
            of.add(truth, 5e-3, element >= wrong);
            of.add(truth, 5e-3, false);
        }
        let probability = of.least_probability();
        assert_eq!(probability > 1e-3, passes, "{wrong}: {probability}");
    }
}

/// Fails where many that are expected wrong hide many more.
#[test]
fn many_wrong_ones_are_seen() {
    for (wrong, is_seen) in [(900, false), (1050, false), (2000, true)] {
        let said = Said {
            decisions: 4000,
            expected_wrong: 1000.0,
            wrong,
        };
        assert_eq!(
            said.at_least() < 1e-3,
            is_seen,
            "{wrong}: {}",
            said.at_least()
        );
    }
}

/// Fails where decisions near a joint count, or a second one of a class in a stay, or none of the next stay.
#[test]
fn a_stay_counts_once_a_class() {
    let mut of = Calibration::default();
    let at = |element, along_m| TruePlace::new(element, along_m, 100.0);
    for (truth, said_wrong, decisions) in [
        (at(1, 14.0), 5e-3, 0),
        (at(1, 16.0), 5e-3, 1),
        (at(1, 50.0), 6e-3, 1),
        (at(1, 60.0), 0.05, 2),
        (at(1, 90.0), 0.5, 2),
        (at(2, 5.0), 5e-3, 2),
        (at(2, 50.0), 5e-3, 3),
        (at(1, 50.0), 5e-3, 4),
    ] {
        of.add(truth, said_wrong, false);
        let sum: usize = of.classes.iter().map(|said| said.decisions).sum();
        assert_eq!(sum, decisions, "{} {said_wrong}", truth.element);
    }
}
