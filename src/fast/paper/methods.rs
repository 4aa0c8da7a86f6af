//! Step 4 of the paper, fast: what each method sums, and eight normals from eight windows' sums. The plain forms are
//! in `paper::methods`.

use super::integrals::{Channels, Counted};
use crate::fast::arithmetic::{Doubles, Floats, cross, dot};
use crate::fast::moments::{WindowMoments, plane};
use crate::fast::tile::Found;
use crate::paper::{CleanPoints, Rect};
use crate::simd::{GROUP, Simd};

/// A method's sums and normals, `N` channels and `M` numbers per window that its normal is made from.
pub(crate) trait Sums<const N: usize, const M: usize>: Channels<N> {
    /// Whether the method gives a curvature.
    const CURVATURE: bool;

    /// What is summed over of a window.
    fn summed(rect: &Rect) -> Rect;

    /// The numbers; none if that is left to the plain form.
    fn numbers(&self, sum: [f64; N], rect: &Rect, points: &impl CleanPoints) -> Option<[f64; M]>;

    /// What the rounding errors of sums stay below, where the points have been summed to `total` over `count` pixels
    /// and no coordinate is above `largest`.
    fn error(&self, total: [f64; N], count: usize, largest: f32) -> f64;

    /// The normals.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    unsafe fn normals<S: Simd>(numbers: &[[f64; GROUP]; M], error: f64, lanes: u32) -> Found<S>;
}

/// A few units in the last place of a double.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// CM: moments about a point of the tile.
pub(crate) struct CovarianceMatrix {
    pub origin: [f32; 3],
}

/// Number of points, first and second moments.
pub(crate) const MOMENTS: usize = 10;

impl Channels<MOMENTS> for CovarianceMatrix {
    #[inline(always)]
    fn of(&self, own: &Counted, _: [&Counted; 2], _: [&Counted; 2]) -> [f64; MOMENTS] {
        let count = f64::from(own[3]);
        let mut p = [0.0; 3];
        for c in 0..3 {
            p[c] = (f64::from(own[c]) - f64::from(self.origin[c])) * count;
        }
        let [x, y, z] = p;
        [x, y, z, count, x * x, x * y, x * z, y * y, y * z, z * z]
    }
}

impl Sums<MOMENTS, MOMENTS> for CovarianceMatrix {
    const CURVATURE: bool = true;

    #[inline(always)]
    fn summed(rect: &Rect) -> Rect {
        rect.clone()
    }

    #[inline(always)]
    fn numbers(
        &self,
        sum: [f64; MOMENTS],
        _: &Rect,
        _: &impl CleanPoints,
    ) -> Option<[f64; MOMENTS]> {
        Some(sum)
    }

    fn error(&self, total: [f64; MOMENTS], _: usize, _: f32) -> f64 {
        ROUNDING * (total[4] + total[7] + total[9])
    }

    #[inline(always)]
    unsafe fn normals<S: Simd>(
        numbers: &[[f64; GROUP]; MOMENTS],
        error: f64,
        lanes: u32,
    ) -> Found<S> {
        // SAFETY: as the caller's; each number is there for a whole group.
        unsafe {
            let number = |i: usize| Doubles::<S>(S::load_d(numbers[i].as_ptr()));
            let count = number(3);
            let first = [number(0), number(1), number(2)];
            let second = [number(4), number(5), number(6), number(7), number(8), number(9)];
            let [x, y, z] = first;
            let [xx, xy, xz, yy, yz, zz] = second;
            plane(&WindowMoments { sums: [x, y, z, xx, xy, xz, yy, yz, zz], count }, error, lanes)
        }
    }
}

/// The differences between a pixel's neighbours and whether both are there: x, y, z, count.
#[inline(always)]
fn difference([before, after]: [&Counted; 2]) -> [f32; 4] {
    let both = before[3] * after[3];
    let mut difference = [both; 4];
    for c in 0..3 {
        difference[c] = (after[c] - before[c]) * both;
    }
    difference
}

/// The 3-D gradients.
pub(crate) struct Gradients;

impl Channels<8> for Gradients {
    #[inline(always)]
    fn of(&self, _: &Counted, row: [&Counted; 2], column: [&Counted; 2]) -> [f64; 8] {
        let ([a, b, c, d], [e, f, g, h]) = (difference(row), difference(column));
        [a, b, c, d, e, f, g, h].map(f64::from)
    }
}

impl Sums<8, 6> for Gradients {
    const CURVATURE: bool = false;

    #[inline(always)]
    fn summed(rect: &Rect) -> Rect {
        rect.inner()
    }

    #[inline(always)]
    fn numbers(&self, sum: [f64; 8], _: &Rect, _: &impl CleanPoints) -> Option<[f64; 6]> {
        let [a, b, c, _, e, f, g, _] = sum;
        Some([a, b, c, e, f, g])
    }

    fn error(&self, _: [f64; 8], count: usize, largest: f32) -> f64 {
        ROUNDING * 2.0 * f64::from(largest) * count as f64
    }

    #[inline(always)]
    unsafe fn normals<S: Simd>(numbers: &[[f64; GROUP]; 6], error: f64, _: u32) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { across(numbers, error) }
    }
}

/// SDC: of the gradients' channels z and the counts.
pub(crate) struct SmoothedDepthChanges;

impl Channels<4> for SmoothedDepthChanges {
    #[inline(always)]
    fn of(&self, _: &Counted, row: [&Counted; 2], column: [&Counted; 2]) -> [f64; 4] {
        let depth_change = |[before, after]: [&Counted; 2]| {
            let both = before[3] * after[3];
            ((after[2] - before[2]) * both, both)
        };
        let ((a, b), (c, d)) = (depth_change(row), depth_change(column));
        [a, b, c, d].map(f64::from)
    }
}

impl Sums<4, 6> for SmoothedDepthChanges {
    const CURVATURE: bool = false;

    #[inline(always)]
    fn summed(rect: &Rect) -> Rect {
        rect.inner()
    }

    /// The tangents times twice the number of differences.
    #[inline(always)]
    fn numbers(&self, sum: [f64; 4], rect: &Rect, points: &impl CleanPoints) -> Option<[f64; 6]> {
        let (column, row) = rect.middle();
        let tangent = |from: [f32; 3], to: [f32; 3], length: usize, sum: f64, count: f64| {
            let difference = |c: usize| (f64::from(to[c]) - f64::from(from[c])) * (2.0 * count);
            [difference(0), difference(1), sum * length as f64]
        };
        let (left, right) = (points.at(rect.x.start, row), points.at(rect.x.end - 1, row));
        let (upper, lower) = (points.at(column, rect.y.start), points.at(column, rect.y.end - 1));
        if (left[2] + right[2] + upper[2] + lower[2]).is_nan() {
            return None;
        }
        let [a, b, c] = tangent(left, right, rect.x.len() - 1, sum[0], sum[1]);
        let [d, e, f] = tangent(upper, lower, rect.y.len() - 1, sum[2], sum[3]);
        Some([a, b, c, d, e, f])
    }

    fn error(&self, _: [f64; 4], count: usize, largest: f32) -> f64 {
        ROUNDING * 2.0 * f64::from(largest) * count as f64
    }

    #[inline(always)]
    unsafe fn normals<S: Simd>(numbers: &[[f64; GROUP]; 6], error: f64, _: u32) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { across(numbers, error) }
    }
}

/// A normal is doubtful where errors of the sums could turn it by more than 1e-5.
const DOUBT_SUMS: f64 = 1e5;

/// And where floats could turn it by more than 1e-5: (sine of the angle between the tangents)^2 < 1e-4.
const DOUBT_SINE: f32 = 1e-4;

/// The directions across horizontal and vertical tangents.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn across<S: Simd>(numbers: &[[f64; GROUP]; 6], error: f64) -> Found<S> {
    // SAFETY: as the caller's; each number is there for a whole group.
    unsafe {
        let number = |i: usize| Doubles::<S>(S::load_d(numbers[i].as_ptr())).narrow();
        let (h, v) = ([number(0), number(1), number(2)], [number(3), number(4), number(5)]);
        let n = cross(v, h);
        let (n2, h2, v2) = (dot(n, n), dot(h, h), dot(v, v));
        let error = (error * DOUBT_SUMS) as f32;
        let rounding = Floats::splat(2.0 * error * error) * (h2 + v2);
        let sine = h2 * v2 * Floats::splat(DOUBT_SINE);
        let scale = Floats::splat(1.0) / n2.sqrt();
        Found {
            normal: [n[0] * scale, n[1] * scale, n[2] * scale],
            curvature: Floats::splat(f32::NAN),
            doubtful: !rounding.max(sine).lt(n2),
        }
    }
}
