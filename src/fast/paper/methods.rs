//! Step 4 of the paper, fast: what each method sums, and eight normals from eight windows' sums. The plain forms are
//! in `paper::methods`.

use super::integrals::{Channels, Counted};
use super::rects::Rects;
use crate::fast::arithmetic::{Doubles, Floats, cross, dot};
use crate::fast::lanes::transpose4;
use crate::fast::moments::{WindowMoments, plane};
use crate::fast::tile::Found;
use crate::paper::{CleanPoints, Rect};
use crate::simd::{GROUP, Simd};

/// A method's sums and normals.
pub(crate) trait Sums<const N: usize>: Channels<N> {
    /// What eight windows' normals are made from.
    type Numbers: Default;

    /// Whether the method gives a curvature.
    const CURVATURE: bool;

    /// Whether the window's outermost rows and columns are not summed over.
    const INNER: bool;

    /// Whether the ends of the window's middle row and column are wanted.
    const ENDS: bool;

    /// Takes the sum of one window; `points` and `ends` are there if wanted.
    fn take(
        numbers: &mut Self::Numbers,
        lane: usize,
        sum: [f64; N],
        rects: &Rects,
        points: &[Counted],
    );

    /// What the rounding errors of sums stay below, where the points have been summed to `total` over `count` pixels
    /// and no coordinate is above `largest`.
    fn error(total: [f64; N], count: usize, largest: f32) -> f64;

    /// The normals; only of these `lanes` there are numbers, of the `fresh` ones from [`Sums::afresh`].
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    unsafe fn normals<S: Simd>(
        numbers: &Self::Numbers,
        rects: &Rects,
        error: f64,
        lanes: u32,
        fresh: u32,
    ) -> Found<S>;

    /// Takes one window's sums from its points, without the rings' rounding; false if that is left to the plain form.
    fn afresh(
        _numbers: &mut Self::Numbers,
        _lane: usize,
        _points: &impl CleanPoints,
        _rect: &Rect,
    ) -> bool {
        false
    }
}

/// A few units in the last place of a double.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// CM: moments about a point of the tile.
pub(crate) struct CovarianceMatrix {
    pub origin: [f32; 3],
}

/// First moments and the number of points, second moments.
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

impl Sums<MOMENTS> for CovarianceMatrix {
    type Numbers = [[f64; GROUP]; MOMENTS];
    const CURVATURE: bool = true;
    const INNER: bool = false;
    const ENDS: bool = false;

    #[inline(always)]
    fn take(
        numbers: &mut Self::Numbers,
        lane: usize,
        sum: [f64; MOMENTS],
        _: &Rects,
        _: &[Counted],
    ) {
        for i in 0..MOMENTS {
            numbers[i][lane] = sum[i];
        }
    }

    fn error(total: [f64; MOMENTS], _: usize, _: f32) -> f64 {
        ROUNDING * (total[4] + total[7] + total[9])
    }

    #[inline(always)]
    unsafe fn normals<S: Simd>(
        numbers: &Self::Numbers,
        _: &Rects,
        error: f64,
        lanes: u32,
        fresh: u32,
    ) -> Found<S> {
        // SAFETY: as the caller's; each number is there for a whole group.
        unsafe {
            let mut sums = [Doubles::<S>::splat(0.0); 9];
            for (c, i) in [0, 1, 2, 4, 5, 6, 7, 8, 9].into_iter().enumerate() {
                sums[c] = Doubles(S::load_d(numbers[i].as_ptr()));
            }
            let count = Doubles(S::load_d(numbers[3].as_ptr()));
            plane(&WindowMoments { sums, count }, error, lanes, fresh)
        }
    }

    #[cold]
    fn afresh(
        numbers: &mut Self::Numbers,
        lane: usize,
        points: &impl CleanPoints,
        rect: &Rect,
    ) -> bool {
        let WindowMoments { sums, count } = WindowMoments::of(points.finite(rect));
        let [x, y, z, xx, xy, xz, yy, yz, zz] = sums;
        let moments = [x, y, z, count, xx, xy, xz, yy, yz, zz];
        Self::take(numbers, lane, moments, &Rects::default(), &[]);
        true
    }
}

/// The differences between a pixel's neighbours and whether both are there: x, y, z, count. Exact: what cancels in
/// the sums leaves nothing.
#[inline(always)]
fn difference([before, after]: [&Counted; 2]) -> [f64; 4] {
    let both = f64::from(before[3] * after[3]);
    let mut difference = [both; 4];
    for c in 0..3 {
        difference[c] = (f64::from(after[c]) - f64::from(before[c])) * both;
    }
    difference
}

/// What the error of sums of differences stays below.
fn error_of_differences(count: usize, largest: f32) -> f64 {
    2.0 * ROUNDING * f64::from(largest) * count as f64
}

/// Four numbers of eight windows, window by window.
type Fours = [[f32; 4]; GROUP];

/// The same number by number.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(crate) unsafe fn by_number<S: Simd>(fours: &Fours) -> [Floats<S>; 4] {
    let mut lanes = [[0.0; GROUP]; 4];
    // SAFETY: as the caller's; four windows' numbers are four times four floats.
    unsafe {
        let from = fours.as_ptr().cast::<f32>();
        transpose4(from, 4, lanes.as_mut_ptr().cast(), GROUP);
        transpose4(from.add(16), 4, lanes.as_mut_ptr().cast::<f32>().add(4), GROUP);
        let load = |i: usize| Floats(S::load(lanes[i].as_ptr()));
        [load(0), load(1), load(2), load(3)]
    }
}

/// The 3-D gradients.
pub(crate) struct Gradients;

impl Channels<8> for Gradients {
    #[inline(always)]
    fn of(&self, _: &Counted, row: [&Counted; 2], column: [&Counted; 2]) -> [f64; 8] {
        let ([a, b, c, d], [e, f, g, h]) = (difference(row), difference(column));
        [a, b, c, d, e, f, g, h]
    }
}

impl Sums<8> for Gradients {
    /// Horizontal and vertical gradients.
    type Numbers = [Fours; 2];
    const CURVATURE: bool = false;
    const INNER: bool = true;
    const ENDS: bool = false;

    #[inline(always)]
    fn take(numbers: &mut [Fours; 2], lane: usize, sum: [f64; 8], _: &Rects, _: &[Counted]) {
        for i in 0..4 {
            numbers[0][lane][i] = sum[i] as f32;
            numbers[1][lane][i] = sum[i + 4] as f32;
        }
    }

    fn error(_: [f64; 8], count: usize, largest: f32) -> f64 {
        error_of_differences(count, largest)
    }

    #[inline(always)]
    unsafe fn normals<S: Simd>(
        numbers: &[Fours; 2],
        _: &Rects,
        error: f64,
        _: u32,
        _: u32,
    ) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe {
            let [hx, hy, hz, _] = by_number::<S>(&numbers[0]);
            let [vx, vy, vz, _] = by_number::<S>(&numbers[1]);
            across([hx, hy, hz], [vx, vy, vz], error)
        }
    }
}

/// SDC: of the gradients' channels z and the counts.
pub(crate) struct SmoothedDepthChanges;

impl Channels<4> for SmoothedDepthChanges {
    #[inline(always)]
    fn of(&self, _: &Counted, [left, right]: [&Counted; 2], [up, down]: [&Counted; 2]) -> [f64; 4] {
        let row = f64::from(left[3] * right[3]);
        let column = f64::from(up[3] * down[3]);
        let difference = |before: f32, after: f32| f64::from(after) - f64::from(before);
        [difference(left[2], right[2]) * row, row, difference(up[2], down[2]) * column, column]
    }
}

impl Sums<4> for SmoothedDepthChanges {
    /// Depth changes and their counts, the differences of the ends of the middle row, and of the middle column with,
    /// instead of z, how far the ends are apart.
    type Numbers = [Fours; 3];
    const CURVATURE: bool = false;
    const INNER: bool = true;
    const ENDS: bool = true;

    #[inline(always)]
    fn take(
        numbers: &mut [Fours; 3],
        lane: usize,
        sum: [f64; 4],
        rects: &Rects,
        points: &[Counted],
    ) {
        for i in 0..4 {
            numbers[0][lane][i] = sum[i] as f32;
        }
        for (line, to) in (0..2).zip(&mut numbers[1..]) {
            let [from, end] = &rects.ends[line];
            let (a, b) = (&points[from[lane] as usize], &points[end[lane] as usize]);
            let both = a[3] * b[3];
            to[lane] = [b[0] - a[0], b[1] - a[1], rects.spans[line][lane], both];
            if both == 0.0 {
                to[lane] = rects.outermost(line, lane, points);
            }
        }
    }

    fn error(_: [f64; 4], count: usize, largest: f32) -> f64 {
        error_of_differences(count, largest)
    }

    #[inline(always)]
    unsafe fn normals<S: Simd>(
        numbers: &[Fours; 3],
        _: &Rects,
        error: f64,
        _: u32,
        _: u32,
    ) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe {
            let [h, h_count, v, v_count] = by_number::<S>(&numbers[0]);
            let [hx, hy, h_span, _] = by_number::<S>(&numbers[1]);
            let [vx, vy, v_span, _] = by_number::<S>(&numbers[2]);
            // Times twice the number of depth changes, which are over two pixels each.
            let (h_count, v_count) = (h_count + h_count, v_count + v_count);
            across(
                [hx * h_count, hy * h_count, h * h_span],
                [vx * v_count, vy * v_count, v * v_span],
                error,
            )
        }
    }
}

/// A normal is doubtful where errors of the sums could turn it by more than 1e-5.
const DOUBT_SUMS: f64 = 1e5;

/// And where floats could turn it by more than 1e-5: (sine of the angle between the tangents)^2 < 1e-4.
const DOUBT_SINE: f32 = 1e-4;

/// And where their squares come near the smallest floats.
const DOUBT_TINY: f32 = 1e-30;

/// The directions across horizontal and vertical tangents.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn across<S: Simd>(h: [Floats<S>; 3], v: [Floats<S>; 3], error: f64) -> Found<S> {
    // SAFETY: as the caller's.
    unsafe {
        let n = cross(v, h);
        let (n2, h2, v2) = (dot(n, n), dot(h, h), dot(v, v));
        let error = (error * DOUBT_SUMS) as f32;
        let rounding = Floats::splat(2.0 * error * error) * (h2 + v2);
        let sine = h2 * v2 * Floats::splat(DOUBT_SINE);
        let scale = Floats::splat(1.0) / n2.sqrt();
        Found {
            normal: [n[0] * scale, n[1] * scale, n[2] * scale],
            curvature: Floats::splat(f32::NAN),
            doubtful: !rounding.max(sine).max(Floats::splat(DOUBT_TINY)).lt(n2),
        }
    }
}
