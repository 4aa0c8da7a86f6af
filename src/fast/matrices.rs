//! From the moments of windows to normals: their covariance matrices (Eq. 16), the smallest eigenvalues and their
//! eigenvectors.

use super::arithmetic::{Doubles, Floats};
use super::estimates::Found;
use super::lanes::{Bits, LANES, all};
use super::run::{Noted, OfRun, RUN};
use crate::eigen::{Scatter, Symmetric3, eigen};
use crate::methods::Estimate;
use crate::paper::ROUNDING;
use crate::simd::{GROUP, Groups, Simd};
use crate::vector::dot;

/// x, y, z, xx, xy, xz, yy, yz, zz
pub(super) const CHANNELS: usize = 9;

/// Of a pixel: all moments but z, side by side, as a window's sums of them are four reads then, wherever it lies:
/// xx, xy, xz, yy, yz, zz, x, y.
pub(super) type Most = [f64; GROUP];

/// Moments of a group's windows, lane by lane.
#[repr(C, align(64))]
#[derive(Default)]
pub(super) struct Lanewise {
    pub most: [Most; GROUP],
    pub z: [f64; GROUP],
    pub share: [f64; GROUP],
}

impl Lanewise {
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn load<S: Groups>(&self) -> WindowMoments<S> {
        // SAFETY: as the caller's; there are whole groups.
        unsafe {
            let mut rows = [S::splat_d(0.0); GROUP];
            for lane in 0..GROUP {
                rows[lane] = S::load_d(self.most[lane].as_ptr());
            }
            let [xx, xy, xz, yy, yz, zz, x, y] = S::transpose_d(rows).map(Doubles);
            let z = Doubles(S::load_d(self.z.as_ptr()));
            let share = Doubles(S::load_d(self.share.as_ptr()));
            WindowMoments { sums: [x, y, z, xx, xy, xz, yy, yz, zz], share }
        }
    }
}

/// The moments of windows, and one over their numbers of points.
pub(crate) struct WindowMoments<S: Simd> {
    pub sums: [Doubles<S>; CHANNELS],
    pub share: Doubles<S>,
}

/// Newton steps for the eigenvalue: one is usual, a few more where two eigenvalues are near.
const STEPS: usize = 8;

/// cos(2/3 acos(x)) from 0 to 1, within 2e-7: a polynomial, the highest power first.
const COSINES: [f32; 7] =
    [-0.0021035, 0.0105018, -0.0263997, 0.0514748, -0.1108055, 0.5773319, 0.5000002];

/// The step from which on one more changes the normal by less than 1e-6.
const CONVERGED: f32 = 1e-3;

/// A normal is doubtful if the error of the sums could turn it by more than 3e-5.
const DOUBT_SUMS: f64 = 3e4;

/// In doubles, the least distance between the two smaller eigenvalues (of a matrix of trace 1), so that rounding turns a
/// normal by less than 1e-5: in sums over hundreds of points it is about four times [`ROUNDING`].
const LEAST_GAP: f64 = 1e5 * 4.0 * ROUNDING;

/// Where the sums' rounding errors ask for a larger distance than this, it is not worth looking for.
const GAP: f64 = 1e-6;

/// The least product of the smallest eigenvalue's distances from the others (of a matrix of trace 1): the rounding of
/// the determinant, some 1e-16, over its square turns the normal.
const DOUBT_PLANE: f32 = 1e-5;

/// The covariance matrices of a run's windows (Eq. 16), over their traces, and the smallest eigenvalues.
#[derive(Default)]
pub(crate) struct Matrices {
    /// Those of a pair of groups: the second one's sums do not wait for what becomes of the first one's.
    pub windows: [Lanewise; LANES / GROUP],
    /// xx, xy, xz, yy, yz, zz
    elements: OfRun<f64, 6>,
    trace: OfRun<f32, 1>,
    /// c0, c1 and c2 of the characteristic polynomial, value^3 - c2 value^2 + c1 value - c0.
    polynomial: OfRun<f64, 3>,
    /// What is near its least root; that, the slope there, and the lanes of pairs of groups that are not sure of them.
    near: OfRun<f32, 1>,
    value: OfRun<f64, 1>,
    slope: OfRun<f32, 1>,
    unsettled: [u32; RUN / LANES],
}

impl Noted for Matrices {
    /// The smallest eigenvalues: the least roots in closed form, made precise by Newton steps.
    #[inline(always)]
    unsafe fn solve<S: Groups>(&mut self, at: usize, lanes: &[u32]) {
        let pairs = || (at..).step_by(LANES).zip(lanes).filter(|(_, lanes)| **lanes != 0);
        for (at, _) in pairs() {
            // SAFETY: as the caller's.
            unsafe {
                let [c0, c1, c2] = self.polynomial.load::<S::Pair>(at);
                let near = least_root([c0.narrow(), c1.narrow(), c2.narrow()]);
                self.near.store::<S::Pair>(at, [near]);
            }
        }
        for (at, lanes) in pairs() {
            // SAFETY: as the caller's.
            self.unsettled[at / LANES] = unsafe { self.newton_steps::<S::Pair>(at, *lanes) };
        }
    }

    #[inline(always)]
    unsafe fn afresh<S: Groups, P: Iterator<Item = [f64; 3]>>(
        &mut self,
        at: usize,
        lanes: u32,
        points: impl Fn(usize) -> P,
    ) -> bool {
        let (mut matrices, mut shares) = ([[0.0; LANES]; 6], [0.0; LANES]);
        for lane in Bits(lanes) {
            if let Some(Scatter { matrix, count, .. }) = Scatter::of(|| points(lane)) {
                let Symmetric3 { xx, xy, xz, yy, yz, zz } = matrix;
                for (to, value) in matrices.iter_mut().zip([xx, xy, xz, yy, yz, zz]) {
                    to[lane] = value;
                }
                shares[lane] = 1.0 / count;
            }
        }
        for group in (0..LANES).step_by(GROUP) {
            // SAFETY: as the caller's; the arrays hold whole groups.
            unsafe {
                let load = |from: &[f64; LANES]| Doubles(S::load_d(from.as_ptr().add(group)));
                // About the mean, to which the points' ways add up to nothing.
                let mut sums = [Doubles::splat(0.0); CHANNELS];
                for (to, from) in sums[3..].iter_mut().zip(&matrices) {
                    *to = load(from);
                }
                self.note::<S>(&WindowMoments { sums, share: load(&shares) }, at + group);
            }
        }
        // SAFETY: as the caller's.
        unsafe { self.solve::<S>(at, &[lanes]) };
        true
    }

    /// In doubles, from the matrix; none if rounding leaves it doubtful.
    #[cold]
    fn precisely(&self, at: usize, error: f64) -> Option<Estimate> {
        // The matrix is over its trace, which may be rounding alone.
        let [trace] = self.trace.of_one(at);
        let asked = DOUBT_SUMS * error / f64::from(trace);
        let is_worth_it = trace > 0.0 && asked < GAP;
        if !is_worth_it {
            return None;
        }
        let [xx, xy, xz, yy, yz, zz] = self.elements.of_one(at);
        let (values, vector) = eigen(&Symmetric3 { xx, xy, xz, yy, yz, zz });
        let curvature = (values[0] / (xx + yy + zz)) as f32;
        (LEAST_GAP.max(asked) < values[1] - values[0])
            .then(|| Estimate { normal: vector.map(|c| c as f32), curvature })
    }
}

impl Matrices {
    /// Notes the windows of some lanes of the pair of groups that is `at`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the pixels are in the run.
    #[inline(always)]
    pub unsafe fn note_windows<S: Groups>(&mut self, lanes: u32, at: usize) {
        for group in 0..LANES / GROUP {
            let first = group * GROUP;
            if lanes >> first & all(GROUP) != 0 {
                // SAFETY: as the caller's.
                unsafe { self.note(&self.windows[group].load::<S>(), at + first) };
            }
        }
    }

    /// The matrices of windows with these moments, for the pixels from `at` on, and their polynomials.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the pixels are in the run.
    #[inline(always)]
    pub unsafe fn note<S: Simd>(&mut self, moments: &WindowMoments<S>, at: usize) {
        // SAFETY: as the caller's.
        unsafe {
            let [x, y, z, xx, xy, xz, yy, yz, zz] = moments.sums;
            let (mx, my, mz) = (x * moments.share, y * moments.share, z * moments.share);
            let (xx, xy, xz) = (xx.minus(x, mx), xy.minus(x, my), xz.minus(x, mz));
            let (yy, yz, zz) = (yy.minus(y, my), yz.minus(y, mz), zz.minus(z, mz));
            // A trace next to 1: floats divide in a quarter of the time.
            let trace = (xx + yy + zz).narrow();
            let scale = (Floats::splat(1.0) / trace).widen();
            let (xx, xy, xz) = (xx * scale, xy * scale, xz * scale);
            let (yy, yz, zz) = (yy * scale, yz * scale, zz * scale);
            let [a_xx, a_xy, a_xz, a_yy, _, a_zz] = adjugate([xx, xy, xz, yy, yz, zz]);
            let c2 = xx + yy + zz;
            let c1 = a_xx + a_yy + a_zz;
            let c0 = (xx * a_xx).plus(xy, a_xy).plus(xz, a_xz);
            self.elements.store::<S>(at, [xx, xy, xz, yy, yz, zz]);
            self.trace.store::<S>(at, [trace]);
            self.polynomial.store::<S>(at, [c0, c1, c2]);
        }
    }

    /// From what is near the least roots to these; returns the lanes whose steps have not ended.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn newton_steps<S: Simd>(&mut self, at: usize, lanes: u32) -> u32 {
        // SAFETY: as the caller's.
        unsafe {
            let [c0, c1, c2] = self.polynomial.load::<S>(at);
            let [near] = self.near.load::<S>(at);
            let mut value = near.widen();
            let twice = c2 + c2;
            let (three, converged) = (Doubles::splat(3.0), Floats::splat(CONVERGED));
            let (mut slope, mut unsettled) = (Floats::splat(0.0), lanes);
            for _ in 0..STEPS {
                slope = c1.minus(twice.minus(three, value), value).narrow();
                // The steps grow small: floats tell how far they go.
                let off = c0.minus(c1.plus(value - c2, value), value).narrow();
                value = value + (off / slope).widen();
                unsettled = !off.abs().lt(converged * slope * slope.abs()) & lanes;
                if unsettled == 0 {
                    break;
                }
            }
            self.value.store::<S>(at, [value.max(Doubles::splat(0.0))]);
            self.slope.store::<S>(at, [slope]);
            unsettled
        }
    }

    /// The eigenvectors of the smallest eigenvalues for the pixels from `at` on, which are solved: a column of the
    /// adjugate. The rounding errors of the moments stay below `error`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn normals<S: Simd>(&self, at: usize, error: f64) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe {
            let [xx, xy, xz, yy, yz, zz] = self.elements.load::<S>(at);
            let [value] = self.value.load::<S>(at);
            let ([slope], [trace]) = (self.slope.load::<S>(at), self.trace.load::<S>(at));
            // The adjugate of the matrix less the eigenvalue: each column is along the eigenvector.
            let (xx, yy, zz) = (xx - value, yy - value, zz - value);
            let [a_xx, a_xy, a_xz, a_yy, a_yz, a_zz] = adjugate([xx, xy, xz, yy, yz, zz]);
            let (a_xx, a_yy, a_zz) = (a_xx.narrow(), a_yy.narrow(), a_zz.narrow());
            let (a_xy, a_xz, a_yz) = (a_xy.narrow(), a_xz.narrow(), a_yz.narrow());
            // The column with the longest diagonal element.
            let columns = [[a_xx, a_xy, a_xz], [a_xy, a_yy, a_yz], [a_xz, a_yz, a_zz]];
            let best_xy = a_xx.max(a_yy);
            let (is_y, is_z) = (S::lt(a_xx.0, a_yy.0), S::lt(best_xy.0, a_zz.0));
            let mut n = [Floats::splat(0.0); 3];
            for c in 0..3 {
                let of_xy = S::select(is_y, columns[1][c].0, columns[0][c].0);
                n[c] = Floats(S::select(is_z, columns[2][c].0, of_xy));
            }
            let scale = Floats::splat(1.0) / dot(n, n).sqrt();
            let value = value.narrow();
            let least = Floats::splat((DOUBT_SUMS * error) as f32);
            // Where the points lie on a line, the steps may end at the largest eigenvalue instead.
            let is_smallest = value.lt(Floats::splat(1.0 / 3.0));
            // Rounding alone may give any slope, but no trace.
            let sums = least.lt(slope * trace) & least.lt(trace);
            let sure = Floats::splat(DOUBT_PLANE).lt(slope) & sums & is_smallest;
            // Of the pair's groups, these pixels'.
            let unsettled = self.unsettled[at / LANES] >> (at % LANES);
            Found {
                normal: [n[0] * scale, n[1] * scale, n[2] * scale],
                curvature: value,
                doubtful: !sure | unsettled,
            }
        }
    }
}

/// [`Symmetric3::adjugate`], its upper triangle.
#[inline(always)]
pub(crate) fn adjugate<S: Simd>([xx, xy, xz, yy, yz, zz]: [Doubles<S>; 6]) -> [Doubles<S>; 6] {
    [
        minor(yy, zz, yz, yz),
        minor(xz, yz, xy, zz),
        minor(xy, yz, xz, yy),
        minor(xx, zz, xz, xz),
        minor(xy, xz, xx, yz),
        minor(xx, yy, xy, xy),
    ]
}

/// `a * b - c * d`
#[inline(always)]
fn minor<S: Simd>(a: Doubles<S>, b: Doubles<S>, c: Doubles<S>, d: Doubles<S>) -> Doubles<S> {
    (a * b).minus(c, d)
}

/// The least root of value^3 - c2 value^2 + c1 value - c0, whose roots are real, by Viete's formula.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn least_root<S: Simd>([c0, c1, c2]: [Floats<S>; 3]) -> Floats<S> {
    // SAFETY: as the caller's.
    unsafe {
        let splat = |value| Floats::<S>::splat(value);
        let square = (c2 * c2).minus(splat(3.0), c1).max(splat(0.0));
        let radius = square.sqrt();
        let cube = square * radius;
        let q = (splat(13.5) * c0).plus((c2 * c2).minus(splat(4.5), c1), c2);
        // The angle a of the formula has the cosine q / cube; this is the sine of its half.
        let sine = (splat(0.5) * (cube - q) / cube).max(splat(0.0)).sqrt();
        let [first, others @ ..] = COSINES;
        let cosine = others.into_iter().fold(splat(first), |sum, c| splat(c).plus(sum, sine));
        c2.minus(splat(2.0) * radius, cosine) * splat(1.0 / 3.0)
    }
}
