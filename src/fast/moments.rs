//! Sums of first and second moments, for COVARIANCE_MATRIX: the paper's nine integral images (Eq. 16-25), in f64 and
//! about a point of the tile.

use super::arithmetic::{Doubles, Floats, dot};
use super::planes::{Frame, MARGIN, Planes, grow};
use super::tile::{Found, Sums};
use crate::simd::{GROUP, Simd};
use crate::window::Image;

/// x, y, z, xx, xy, xz, yy, yz, zz
const CHANNELS: usize = 9;

/// The ring of integral rows: nine planes a row.
#[derive(Debug, Default)]
pub(crate) struct Moments {
    integrals: Vec<f64>,
    origin: [f32; 3],
    /// The place of the row pushed last.
    last: Option<usize>,
    /// What the sums' rounding errors stay below.
    error: f64,
}

/// The moments of windows, and their numbers of points.
pub(crate) struct WindowMoments<T> {
    sums: [T; CHANNELS],
    count: T,
}

impl<T: Copy> Clone for WindowMoments<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T: Copy> Copy for WindowMoments<T> {}

/// One unit in the last place of a double, and how many of it the path to a sum may gather.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Newton steps for the eigenvalue: one or two are usual, a few more where two eigenvalues are near.
const STEPS: usize = 8;

/// The step from which on one more changes the normal by less than 1e-6.
const CONVERGED: f64 = 1e-3;

/// A normal is doubtful if the error of the sums could turn it by more than 1e-5.
const DOUBT_SUMS: f64 = 1e5;

/// The least product of the eigenvalues' distances (of a matrix of trace 1) for a plane in doubles.
const DOUBT_PLANE: f64 = 1e-9;

impl Moments {
    #[inline(always)]
    fn plane(frame: &Frame, c: usize, place: usize) -> usize {
        (place * CHANNELS + c) * frame.stride
    }
}

impl Sums for Moments {
    type Of8<S: Simd> = WindowMoments<Doubles<S>>;
    type Of1 = WindowMoments<f64>;

    const COLUMN: usize = CHANNELS * size_of::<f64>();

    fn start(&mut self, frame: &Frame, _limit: f32, _side: usize, origin: [f32; 3]) {
        grow(&mut self.integrals, CHANNELS * frame.ring * frame.stride);
        self.origin = origin;
        self.last = None;
    }

    fn size(&self) -> usize {
        self.integrals.capacity() * size_of::<f64>()
    }

    #[inline(always)]
    unsafe fn push<S: Simd>(&mut self, frame: &Frame, planes: &Planes, y: usize) {
        let place = frame.place(y);
        let groups = frame.groups() + 1;
        assert!(MARGIN + groups * GROUP <= frame.stride);
        assert!(Self::plane(frame, CHANNELS, place) <= self.integrals.len());
        let from = [0, 1, 2].map(|c| planes.row(frame, c, y).as_ptr());
        let integrals = self.integrals.as_mut_ptr();
        // SAFETY: as the caller's; the groups lie inside the planes of the ring, as was just checked.
        unsafe {
            let [origin_x, origin_y, origin_z] = self.origin;
            let origin = [
                Floats::<S>::splat(origin_x).widen(),
                Floats::splat(origin_y).widen(),
                Floats::splat(origin_z).widen(),
            ];
            let mut carry = [S::splat_d(0.0); CHANNELS];
            for c in 0..CHANNELS {
                *integrals.add(Self::plane(frame, c, place) + MARGIN - 1) = 0.0;
            }
            for group in 0..groups {
                let at = MARGIN + group * GROUP;
                let x = Floats(S::load(from[0].add(at))).widen() - origin[0];
                let y = Floats(S::load(from[1].add(at))).widen() - origin[1];
                let z = Floats(S::load(from[2].add(at))).widen() - origin[2];
                let moments = [x, y, z, x * x, x * y, x * z, y * y, y * z, z * z];
                for c in 0..CHANNELS {
                    let along = S::add_d(S::prefix_sum_d(moments[c].0), carry[c]);
                    carry[c] = S::last_d(along);
                    let sum = match self.last {
                        Some(last) => {
                            let above = integrals.add(Self::plane(frame, c, last) + at);
                            S::add_d(along, S::load_d(above))
                        }
                        None => along,
                    };
                    S::store_d(integrals.add(Self::plane(frame, c, place) + at), sum);
                }
            }
        }
        self.last = Some(place);
        let end = MARGIN + groups * GROUP - 1;
        let square = |c| self.integrals[Self::plane(frame, c, place) + end];
        self.error = ROUNDING * (square(3) + square(6) + square(8));
    }

    #[inline(always)]
    unsafe fn of_group<S: Simd>(
        &self,
        frame: &Frame,
        _planes: &Planes,
        x: usize,
        y: usize,
        side: usize,
    ) -> Self::Of8<S> {
        let half = side / 2;
        let left = frame.column(x.wrapping_sub(half + 1));
        let right = left + side;
        let (top, bottom) = (frame.place(y - half - 1), frame.place(y - half + side - 1));
        let integrals = self.integrals.as_ptr();
        // SAFETY: as the caller's: rows and columns are held, and so are the groups from these columns on.
        unsafe {
            let mut sums = [Doubles::splat(0.0); CHANNELS];
            for c in 0..CHANNELS {
                let top = integrals.add(Self::plane(frame, c, top));
                let bottom = integrals.add(Self::plane(frame, c, bottom));
                let lower =
                    Doubles(S::load_d(bottom.add(right))) - Doubles(S::load_d(bottom.add(left)));
                let upper = Doubles(S::load_d(top.add(right))) - Doubles(S::load_d(top.add(left)));
                sums[c] = lower - upper;
            }
            WindowMoments { sums, count: Doubles::splat((side * side) as f64) }
        }
    }

    #[inline(always)]
    unsafe fn select<S: Simd>(lanes: u32, yes: Self::Of8<S>, no: Self::Of8<S>) -> Self::Of8<S> {
        let mut moments = no;
        // SAFETY: as the caller's.
        unsafe {
            for c in 0..CHANNELS {
                let sum = S::select_bits_d(lanes, yes.sums[c].0, no.sums[c].0);
                moments.sums[c] = Doubles(sum);
            }
            moments.count = Doubles(S::select_bits_d(lanes, yes.count.0, no.count.0));
        }
        moments
    }

    #[inline(always)]
    unsafe fn none<S: Simd>() -> Self::Of8<S> {
        // SAFETY: as the caller's.
        let zero = unsafe { Doubles::splat(0.0) };
        WindowMoments { sums: [zero; CHANNELS], count: zero }
    }

    fn of_mirrored(
        &self,
        frame: &Frame,
        _planes: &Planes,
        image: &Image,
        (x, y): (usize, usize),
        side: usize,
    ) -> Option<Self::Of1> {
        let half = (side / 2) as isize;
        let mut moments = WindowMoments { sums: [0.0; CHANNELS], count: 0.0 };
        for rect in image.rects((x as isize - half, y as isize - half), (side, side)) {
            if rect.x.is_empty() || rect.y.is_empty() {
                continue;
            }
            moments.count += (rect.x.len() * rect.y.len()) as f64;
            for (c, sum) in moments.sums.iter_mut().enumerate() {
                let segment = |end_row: usize| {
                    if end_row == 0 {
                        return 0.0;
                    }
                    let row = Self::plane(frame, c, frame.place(end_row - 1));
                    self.integrals[row + frame.column(rect.x.end) - 1]
                        - self.integrals[row + frame.column(rect.x.start) - 1]
                };
                *sum += segment(rect.y.end) - segment(rect.y.start);
            }
        }
        Some(moments)
    }

    #[inline(always)]
    unsafe fn put<S: Simd>(moments: &mut Self::Of8<S>, lane: usize, one: Self::Of1) {
        // SAFETY: as the caller's.
        unsafe {
            for (to, one) in moments.sums.iter_mut().zip(one.sums) {
                *to = Doubles(S::select_bits_d(1 << lane, S::splat_d(one), to.0));
            }
            let count = S::splat_d(one.count);
            moments.count = Doubles(S::select_bits_d(1 << lane, count, moments.count.0));
        }
    }

    /// The eigenvector of the smallest eigenvalue: the least root of the characteristic polynomial by one step of
    /// Laguerre's method from 0 and Newton steps, then a column of the adjugate.
    #[inline(always)]
    unsafe fn estimate<S: Simd>(
        &self,
        _frame: &Frame,
        moments: &Self::Of8<S>,
        _sides: S::F,
        lanes: u32,
    ) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe {
            let one = Doubles::<S>::splat(1.0);
            let [x, y, z, xx, xy, xz, yy, yz, zz] = moments.sums;
            let share = one / moments.count;
            let (mx, my, mz) = (x * share, y * share, z * share);
            let (xx, xy, xz) = (xx - x * mx, xy - x * my, xz - x * mz);
            let (yy, yz, zz) = (yy - y * my, yz - y * mz, zz - z * mz);
            // Trace 1.
            let trace = xx + yy + zz;
            let scale = one / trace;
            let (xx, xy, xz) = (xx * scale, xy * scale, xz * scale);
            let (yy, yz, zz) = (yy * scale, yz * scale, zz * scale);

            // value^3 - value^2 + c1 value - c0 = 0
            let (minor_x, minor_y, minor_z) =
                (yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy);
            let c1 = minor_x + minor_y + minor_z;
            let c0 = xx * minor_x + xy * (xz * yz - xy * zz) + xz * (xy * yz - xz * yy);
            let mut value = {
                let (c0, c1) = (c0.narrow(), c1.narrow());
                let square = Floats::splat(4.0) * c1 * c1 - Floats::splat(12.0) * c0;
                let root = square.max(Floats::splat(0.0)).sqrt();
                (Floats::splat(3.0) * c0 / (c1 + root)).widen()
            };
            let (two, three) = (one + one, one + one + one);
            let (zero, converged) = (Doubles::splat(0.0), Doubles::splat(CONVERGED));
            let (mut slope, mut unsettled) = (zero, lanes);
            for _ in 0..STEPS {
                slope = (three * value - two) * value + c1;
                let step = (((value - one) * value + c1) * value - c0) / slope;
                value = value - step;
                unsettled = !step.max(zero - step).lt(converged * slope) & lanes;
                if unsettled == 0 {
                    break;
                }
            }
            let value = value.max(zero);

            // The adjugate of the matrix less the eigenvalue: each column is along the eigenvector.
            let (xx, yy, zz) = (xx - value, yy - value, zz - value);
            let (a_xx, a_yy, a_zz) = (yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy);
            let (a_xy, a_xz, a_yz) = (xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz);
            // The column with the longest diagonal element, scaled by it.
            let best_xy = a_xx.max(a_yy);
            let scale = one / best_xy.max(a_zz);
            let columns = [[a_xx, a_xy, a_xz], [a_xy, a_yy, a_yz], [a_xz, a_yz, a_zz]];
            let mut n = [Floats::splat(0.0); 3];
            for c in 0..3 {
                let of_xy = a_xx.select_lt(a_yy, columns[1][c], columns[0][c]);
                n[c] = (best_xy.select_lt(a_zz, columns[2][c], of_xy) * scale).narrow();
            }
            let scale = Floats::splat(1.0) / dot(n, n).sqrt();
            let least = Doubles::splat(DOUBT_SUMS * self.error);
            // Where the points lie on a line, the steps may end at the largest eigenvalue instead.
            let is_smallest = value.lt(Doubles::splat(1.0 / 3.0));
            let sure =
                Doubles::splat(DOUBT_PLANE).lt(slope) & least.lt(slope * trace) & is_smallest;
            Found {
                normal: [n[0] * scale, n[1] * scale, n[2] * scale],
                curvature: value.narrow(),
                doubtful: !sure | unsettled,
            }
        }
    }
}
