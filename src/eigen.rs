//! The eigenvector of the smallest eigenvalue of a symmetric 3x3 matrix.

use crate::vector::{difference, sum};

/// A symmetric 3x3 matrix: its upper triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Symmetric3 {
    pub xx: f64,
    pub xy: f64,
    pub xz: f64,
    pub yy: f64,
    pub yz: f64,
    pub zz: f64,
}

impl Symmetric3 {
    /// Adds `v v^T`.
    pub fn add_outer(&mut self, v: [f64; 3]) {
        self.xx += v[0] * v[0];
        self.xy += v[0] * v[1];
        self.xz += v[0] * v[2];
        self.yy += v[1] * v[1];
        self.yz += v[1] * v[2];
        self.zz += v[2] * v[2];
    }

    pub fn trace(&self) -> f64 {
        self.xx + self.yy + self.zz
    }

    /// The matrix times a vector.
    pub fn times(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let &Symmetric3 { xx, xy, xz, yy, yz, zz } = self;
        [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
    }

    /// The matrix that times this one is its determinant.
    pub fn adjugate(&self) -> Self {
        let &Symmetric3 { xx, xy, xz, yy, yz, zz } = self;
        Symmetric3 {
            xx: yy * zz - yz * yz,
            xy: xz * yz - xy * zz,
            xz: xy * yz - xz * yy,
            yy: xx * zz - xz * xz,
            yz: xy * xz - xx * yz,
            zz: xx * yy - xy * xy,
        }
    }
}

/// Points' covariance matrix times their number, about their mean.
pub(crate) struct Scatter {
    pub matrix: Symmetric3,
    pub mean: [f64; 3],
    pub count: f64,
}

impl Scatter {
    /// In two passes over the points. None without points.
    pub fn of<I: Iterator<Item = [f64; 3]>>(points: impl Fn() -> I) -> Option<Self> {
        let (mut total, mut count) = ([0.0; 3], 0.0);
        points().for_each(|point| (total, count) = (sum(total, point), count + 1.0));
        if count == 0.0 {
            return None;
        }
        let mean = total.map(|total| total / count);
        let mut matrix = Symmetric3::default();
        points().for_each(|point| matrix.add_outer(difference(point, mean)));
        Some(Scatter { matrix, mean, count })
    }

    /// The covariance matrix.
    pub fn covariance(&self) -> Symmetric3 {
        let Symmetric3 { xx, xy, xz, yy, yz, zz } = self.matrix;
        let [xx, xy, xz, yy, yz, zz] = [xx, xy, xz, yy, yz, zz].map(|sum| sum / self.count);
        Symmetric3 { xx, xy, xz, yy, yz, zz }
    }

    /// The eigenvalues of the covariance matrix, ascending.
    pub fn eigenvalues(&self) -> [f64; 3] {
        eigen(&self.matrix).0.map(|value| value / self.count)
    }
}

/// The eigenvalues of a positive semidefinite matrix, ascending, and the unit eigenvector of the first.
///
/// Cyclic Jacobi rotations: slow, and right to the last bits whatever the eigenvalues are.
pub(crate) fn eigen(m: &Symmetric3) -> ([f64; 3], [f64; 3]) {
    /// Elements beside the diagonal that turn no eigenvector and change no value by as much as rounding does.
    const NEGLIGIBLE: f64 = 1e-3 * f64::EPSILON;
    let mut a = [[m.xx, m.xy, m.xz], [m.xy, m.yy, m.yz], [m.xz, m.yz, m.zz]];
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const SWEEPS: usize = 12; // convergence is quadratic: 4 or 5 are enough
    for _ in 0..SWEEPS {
        let mut is_diagonal = true;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() <= NEGLIGIBLE * (a[p][p] * a[q][q]).abs().sqrt() {
                continue;
            }
            is_diagonal = false;
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
            }
            for row in &mut v {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
        }
        if is_diagonal {
            break;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    let smallest = order[0];
    (order.map(|i| a[i][i].max(0.0)), [v[0][smallest], v[1][smallest], v[2][smallest]])
}
