//! A car as a linear system of seven bodies with six coordinates each, from the numbers of its
//! vehicle file.
//!
//! Coordinates of body b are 6 b + (x, y, z, roll, pitch, yaw): small motions against the car that
//! runs at constant speed on straight, level track. An element between point p of one body and
//! point q of another stretches by d = u_p - u_q, u = t + r x p, and gives d^T k d / 2 to the
//! potential. Its static load P gives the second-order part of -P d_z too, that is
//!
//! ```text
//! -P [ w(r_a, p) - w(r_b, q) - (r_e x d)_z ]    w(r, p) = (r_z (r_x p_x + r_y p_y) - (r_x^2 + r_y^2) p_z) / 2
//! ```
//!
//! with r_e the turn of the element's axes: of the bogie for the primary suspension, the mean of
//! car and bogie for the secondary. These are the moments of the weight in roll and pitch.
//!
//! A wheel stands on the rail's give. Its treads creep by Kalker's linear law times the share of the
//! slope that Polach's law leaves, on the slips of a wheelset that rolls with w = v / r, is off the
//! middle by y and yawed by psi (Wickens 2003): across y' + r roll' - v psi, in yaw
//! psi' + w (roll + conicity y / b). So the stiffness is not symmetric.

use super::*;
use nalgebra::{Complex, DMatrix, DVector, Vector3, vector};

pub(super) const G_MPS2: f64 = 9.806_65;
const BODIES: usize = 7;
const HALF_CONTACT_M: f64 = 0.75;
/// Kalker's coefficients of a wheel, N, and the treads' conicity: see `adhesion.rs` and
/// `wheelset.rs`, which give their sources.
const KALKER_N: [f64; 2] = [8.24e6, 7.34e6];
const CONICITY: f64 = 0.1;

pub(super) const CAR: usize = 0;
pub(super) const BOGIES: [usize; 2] = [1, 2];
pub(super) const WHEELSETS: [usize; 4] = [3, 4, 5, 6];
pub(super) const Y: usize = 1;
pub(super) const Z: usize = 2;
pub(super) const ROLL: usize = 3;
pub(super) const PITCH: usize = 4;

/// Coordinate of a body.
pub(super) fn dof(body: usize, axis: usize) -> usize {
    6 * body + axis
}

/// What is under the car.
#[derive(Clone, Copy)]
pub(super) struct Under {
    /// Of a rail under a wheel, N/m and N s/m.
    pub support: (f64, f64),
    pub speed_mps: f64,
    /// Slope of Polach's law at the origin over Kalker's; dry: (kA + kS) / 2 = 0.7.
    pub creep_share: f64,
    /// What weights press with; in a curve it is more than g.
    pub weight_mps2: f64,
    /// Lateral hold of flanges at rail level, N/m.
    pub flange_n_m: f64,
}

impl Under {
    pub(super) fn dry(speed_mps: f64) -> Self {
        Self {
            support: (100e6, 60e3),
            speed_mps,
            creep_share: 0.7,
            weight_mps2: G_MPS2,
            flange_n_m: 0.0,
        }
    }
}

/// M q'' + C q' + K q = f over some of the coordinates.
#[derive(Clone)]
pub(super) struct LinearModel {
    pub dofs: Vec<usize>,
    pub mass: DMatrix<f64>,
    pub damping: DMatrix<f64>,
    pub stiffness: DMatrix<f64>,
}

/// One natural motion, q = Re(shape exp(value t)).
#[derive(Clone)]
pub(super) struct Mode {
    pub value: Complex<f64>,
    pub shape: DVector<Complex<f64>>,
}

impl Mode {
    pub(super) fn hertz(&self) -> f64 {
        self.value.im / std::f64::consts::TAU
    }

    /// Share of critical damping.
    pub(super) fn damping(&self) -> f64 {
        -self.value.re / self.value.norm()
    }
}

/// A point of a body, by its place from the centre of gravity.
type Place = (usize, Vector3<f64>);

/// Rows of the map from coordinates to the displacement of a point.
fn displacement((body, at): Place) -> [DVector<f64>; 3] {
    let mut rows = std::array::from_fn(|_| DVector::zeros(6 * BODIES));
    let turned = at.cross_matrix() * -1.0;
    for (k, row) in rows.iter_mut().enumerate() {
        row[dof(body, k)] = 1.0;
        for axis in 0..3 {
            row[dof(body, 3 + axis)] = turned[(k, axis)];
        }
    }
    rows
}

fn unit(body: usize, axis: usize) -> DVector<f64> {
    let mut row = DVector::zeros(6 * BODIES);
    row[dof(body, axis)] = 1.0;
    row
}

/// Adds what the energy a b gives to the stiffness.
fn add_product(matrix: &mut DMatrix<f64>, scale: f64, a: &DVector<f64>, b: &DVector<f64>) {
    *matrix += (a * b.transpose() + b * a.transpose()) * scale;
}

/// The second-order rise of a point by its body's turn, times `scale`.
fn add_rise(matrix: &mut DMatrix<f64>, scale: f64, (body, at): Place) {
    let [roll, pitch, yaw] = [3, 4, 5].map(|axis| unit(body, axis));
    add_product(matrix, 0.5 * scale * at.x, &yaw, &roll);
    add_product(matrix, 0.5 * scale * at.y, &yaw, &pitch);
    for turn in [&roll, &pitch] {
        add_product(matrix, -0.5 * scale * at.z, turn, turn);
    }
}

impl LinearModel {
    /// All 42 coordinates.
    pub(super) fn new(file: &VehicleFile, under: Under) -> Self {
        let mut car = Self {
            dofs: (0..6 * BODIES).collect(),
            mass: DMatrix::zeros(6 * BODIES, 6 * BODIES),
            damping: DMatrix::zeros(6 * BODIES, 6 * BODIES),
            stiffness: DMatrix::zeros(6 * BODIES, 6 * BODIES),
        };
        car.masses(file, under);
        let (g, w) = (&file.bogie, &file.wheelset);
        for (bogie, end) in BOGIES.into_iter().zip([1.0, -1.0]) {
            car.secondary(file, bogie, 0.5 * end * g.distance_m, under.weight_mps2);
            for (k, end) in [1.0, -1.0].into_iter().enumerate() {
                let wheelset = WHEELSETS[2 * (bogie - 1) + k];
                let place = (bogie, wheelset, 0.5 * end * g.wheelbase_m);
                car.primary(file, place, under.weight_mps2);
                car.rails(wheelset, w.radius_m, under);
            }
        }
        car
    }

    fn masses(&mut self, file: &VehicleFile, under: Under) {
        let (b, g, w) = (&file.body, &file.bogie, &file.wheelset);
        let total = b.mass_kg + 2.0 * g.mass_kg + 4.0 * w.mass_kg;
        let rotating = 0.25 * w.rotating_mass_share * total * w.radius_m.powi(2);
        let mut wheels = w.inertia_kg_m2;
        wheels[1] = wheels[1].max(rotating);
        for body in 0..BODIES {
            let (kg, inertia) = match body {
                CAR => (b.mass_kg, b.inertia_kg_m2),
                1 | 2 => (g.mass_kg, g.inertia_kg_m2),
                _ => (w.mass_kg, wheels),
            };
            for (axis, kg_m2) in inertia.into_iter().enumerate() {
                self.mass[(dof(body, axis), dof(body, axis))] = kg;
                self.mass[(dof(body, 3 + axis), dof(body, 3 + axis))] = kg_m2;
            }
        }
        // A turning wheelset is a gyroscope.
        let spin = wheels[1] * under.speed_mps / w.radius_m;
        for body in WHEELSETS {
            self.damping[(dof(body, 3), dof(body, 5))] -= spin;
            self.damping[(dof(body, 5), dof(body, 3))] += spin;
        }
    }

    /// An element along x, y and z, and its static load.
    fn element(
        &mut self,
        (a, b): (Place, Place),
        (stiffness, damping): ([f64; 3], [f64; 3]),
        load_n: f64,
        axes_of: &[usize],
    ) {
        let (upper, lower) = (displacement(a), displacement(b));
        let stretch: [DVector<f64>; 3] = std::array::from_fn(|k| &upper[k] - &lower[k]);
        for k in 0..3 {
            add_product(
                &mut self.stiffness,
                0.5 * stiffness[k],
                &stretch[k],
                &stretch[k],
            );
            add_product(
                &mut self.damping,
                0.5 * damping[k],
                &stretch[k],
                &stretch[k],
            );
        }
        add_rise(&mut self.stiffness, -load_n, a);
        add_rise(&mut self.stiffness, load_n, b);
        for &body in axes_of {
            let share = load_n / axes_of.len() as f64;
            add_product(&mut self.stiffness, share, &unit(body, 3), &stretch[1]);
            add_product(&mut self.stiffness, -share, &unit(body, 4), &stretch[0]);
        }
    }

    fn primary(&mut self, file: &VehicleFile, at: (usize, usize, f64), weight_mps2: f64) {
        let (bogie, wheelset, along_m) = at;
        let (p, g) = (&file.primary, &file.bogie);
        let load_n = 0.25 * weight_mps2 * (0.5 * file.body.mass_kg + g.mass_kg);
        for side in [0.5 * p.base_m, -0.5 * p.base_m] {
            let upper = vector![along_m, side, file.wheelset.radius_m - g.cg_m];
            let ends = ((bogie, upper), (wheelset, vector![0.0, side, 0.0]));
            let law = (
                p.stiffness_mn_m.map(|k| 1e6 * k),
                p.damping_kn_s_m.map(|c| 1e3 * c),
            );
            self.element(ends, law, load_n, &[bogie]);
        }
    }

    fn secondary(&mut self, file: &VehicleFile, bogie: usize, along_m: f64, weight_mps2: f64) {
        let (s, b, g) = (&file.secondary, &file.body, &file.bogie);
        let ends = |side: f64, height_m: f64| {
            let upper = vector![along_m, side, height_m - b.cg_m];
            ((CAR, upper), (bogie, vector![0.0, side, height_m - g.cg_m]))
        };
        let law = (
            s.stiffness_mn_m.map(|k| 1e6 * k),
            s.damping_kn_s_m.map(|c| 1e3 * c),
        );
        let load_n = 0.25 * weight_mps2 * b.mass_kg;
        for side in [0.5 * s.base_m, -0.5 * s.base_m] {
            self.element(ends(side, s.height_m), law, load_n, &[CAR, bogie]);
        }
        let rod = (
            [1e6 * s.traction_rod_mn_m, 0.0, 0.0],
            [1e3 * s.traction_rod_kn_s_m, 0.0, 0.0],
        );
        self.element(ends(0.0, g.cg_m), rod, 0.0, &[CAR]);
        let roll = unit(CAR, ROLL) - unit(bogie, ROLL);
        add_product(
            &mut self.stiffness,
            0.5e6 * s.roll_bar_mn_m_rad,
            &roll,
            &roll,
        );
    }

    fn rails(&mut self, wheelset: usize, radius_m: f64, under: Under) {
        for side in [HALF_CONTACT_M, -HALF_CONTACT_M] {
            let wheel = unit(wheelset, Z) + unit(wheelset, ROLL) * side;
            add_product(&mut self.stiffness, 0.5 * under.support.0, &wheel, &wheel);
            add_product(&mut self.damping, 0.5 * under.support.1, &wheel, &wheel);
        }
        let creep = KALKER_N.map(|c| 2.0 * c * under.creep_share / under.speed_mps.max(0.01));
        let [along, across, _] = displacement((wheelset, vector![0.0, 0.0, -radius_m]));
        let yaw = unit(wheelset, 5);
        let yaw_c = creep[0] * HALF_CONTACT_M * HALF_CONTACT_M;
        add_product(&mut self.damping, 0.5 * creep[0], &along, &along);
        add_product(&mut self.damping, 0.5 * yaw_c, &yaw, &yaw);
        add_product(&mut self.damping, 0.5 * creep[1], &across, &across);
        let spin = under.speed_mps / radius_m;
        let cone = unit(wheelset, ROLL) + unit(wheelset, Y) * (CONICITY / HALF_CONTACT_M);
        self.stiffness -= &across * yaw.transpose() * (creep[1] * under.speed_mps);
        self.stiffness += &yaw * cone.transpose() * (yaw_c * spin);
        add_product(
            &mut self.stiffness,
            0.5 * under.flange_n_m,
            &across,
            &across,
        );
    }

    /// The same with all other coordinates held.
    pub(super) fn only(&self, dofs: &[usize]) -> Self {
        let at: Vec<usize> = dofs.iter().map(|d| self.place(*d)).collect();
        let part = |m: &DMatrix<f64>| m.select_rows(&at).select_columns(&at);
        Self {
            dofs: dofs.to_vec(),
            mass: part(&self.mass),
            damping: part(&self.damping),
            stiffness: part(&self.stiffness),
        }
    }

    /// Motions that leave the plane of symmetry: y, roll, yaw. By symmetry they are apart from
    /// the others.
    pub(super) fn lateral(&self) -> Self {
        self.of_axes(&[1, 3, 5])
    }

    /// Motions in the plane of symmetry: x, z, pitch.
    pub(super) fn vertical(&self) -> Self {
        self.of_axes(&[0, 2, 4])
    }

    fn of_axes(&self, axes: &[usize]) -> Self {
        let all = self.dofs.iter().copied();
        self.only(&all.filter(|d| axes.contains(&(d % 6))).collect::<Vec<_>>())
    }

    /// A car whose springs know no x and whose weight does not lean, as textbooks have it.
    pub(super) fn textbook(file: &VehicleFile) -> Self {
        let mut file = file.clone();
        file.primary.stiffness_mn_m[0] = 0.0;
        file.primary.damping_kn_s_m[0] = 0.0;
        file.secondary.stiffness_mn_m[0] = 0.0;
        file.secondary.damping_kn_s_m[0] = 0.0;
        file.secondary.traction_rod_mn_m = 0.0;
        file.secondary.traction_rod_kn_s_m = 0.0;
        let under = Under {
            weight_mps2: 0.0,
            ..Under::dry(0.0)
        };
        Self::new(&file, under)
    }

    /// Its six coordinates on rigid rails: bounce and pitch of car and bogies.
    pub(super) fn six(file: &VehicleFile) -> Self {
        let dofs = [CAR, 1, 2].map(|b| [dof(b, Z), dof(b, PITCH)]);
        Self::textbook(file).only(&dofs.concat())
    }

    pub(super) fn undamped(mut self) -> Self {
        self.damping.fill(0.0);
        self
    }

    /// Where a coordinate is in the matrices.
    pub(super) fn place(&self, dof: usize) -> usize {
        self.dofs.iter().position(|d| *d == dof).unwrap()
    }

    /// K + s C + s^2 M.
    fn dynamic(&self, s: Complex<f64>) -> DMatrix<Complex<f64>> {
        let n = self.dofs.len();
        DMatrix::from_fn(n, n, |i, j| {
            s * (s * self.mass[(i, j)] + self.damping[(i, j)]) + self.stiffness[(i, j)]
        })
    }

    /// Steady answer to a force f exp(i omega t).
    pub(super) fn response(
        &self,
        omega: f64,
        force: &DVector<Complex<f64>>,
    ) -> DVector<Complex<f64>> {
        let matrix = self.dynamic(Complex::new(0.0, omega));
        matrix.lu().solve(force).unwrap()
    }

    /// All oscillations, slowest first.
    pub(super) fn modes(&self) -> Vec<Mode> {
        let n = self.dofs.len();
        let inverse = self.mass.clone().try_inverse().unwrap();
        // Time in units of 20 ms keeps the numbers of the matrix alike.
        let unit_s = 0.02;
        let mut a = DMatrix::zeros(2 * n, 2 * n);
        a.view_mut((0, n), (n, n)).fill_with_identity();
        let below = &inverse * &self.stiffness * -(unit_s * unit_s);
        a.view_mut((n, 0), (n, n)).copy_from(&below);
        let right = &inverse * &self.damping * -unit_s;
        a.view_mut((n, n), (n, n)).copy_from(&right);
        let values = a.complex_eigenvalues();
        let mut modes: Vec<Mode> = (values.iter())
            .map(|v| v / unit_s)
            .filter(|v| v.im > 0.05 * v.norm() && v.im > 0.5)
            .map(|value| Mode {
                value,
                shape: self.shape(value),
            })
            .collect();
        modes.sort_by(|a, b| a.value.im.total_cmp(&b.value.im));
        modes
    }

    /// By inverse iteration, the largest coordinate of a metre or radian being 1.
    fn shape(&self, value: Complex<f64>) -> DVector<Complex<f64>> {
        let near = self.dynamic(value * (1.0 + 1e-9)).lu();
        let n = self.dofs.len();
        let mut shape = DVector::from_fn(n, |k, _| Complex::new(1.0, 0.37 * k as f64));
        for _ in 0..3 {
            shape = near.solve(&shape).unwrap();
            shape /= Complex::from(shape.norm());
        }
        let largest = shape
            .iter()
            .copied()
            .max_by(|a, b| a.norm().total_cmp(&b.norm()));
        shape / largest.unwrap()
    }

    /// How much of a mode's motion is a pattern of coordinates, by the masses; 1 is all of it.
    pub(super) fn likeness(&self, mode: &Mode, pattern: &[(usize, f64)]) -> f64 {
        let mut t = DVector::zeros(self.dofs.len());
        for (dof, weight) in pattern {
            t[self.place(*dof)] = *weight;
        }
        let moved = &self.mass * &t;
        let both: Complex<f64> = mode.shape.iter().zip(&moved).map(|(s, m)| s * *m).sum();
        let own: f64 = (mode.shape.iter().enumerate())
            .map(|(k, s)| s.norm_sqr() * self.mass[(k, k)])
            .sum();
        both.norm_sqr() / (own * t.dot(&moved))
    }

    /// The mode that is most like a pattern.
    pub(super) fn mode_like(&self, pattern: &[(usize, f64)]) -> Mode {
        let modes = self.modes().into_iter();
        let like = |m: &Mode| self.likeness(m, pattern);
        modes.max_by(|a, b| like(a).total_cmp(&like(b))).unwrap()
    }
}
