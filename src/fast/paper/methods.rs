//! Step 4 of the paper, fast: what each method sums, and eight normals from eight windows' sums. The plain forms are
//! in `paper::methods`.

use super::integrals::{Channels, Counted};
use super::rects::Rects;
use crate::fast::arithmetic::{Doubles, Floats, cross, dot};
use crate::fast::moments::{Matrices, WindowMoments, sum_of_moments};
use crate::fast::run::{Noted, OfRun};
use crate::fast::tile::{Bits, Found};
use crate::paper::{CleanPoints, ROUNDING, Rect};
use crate::simd::{GROUP, Groups, Simd, load_by_fours};

/// A method's sums and normals.
pub(crate) trait Sums<const N: usize>: Channels<N> {
    /// What the normals of a run of pixels are made from.
    type OfRun: Noted;

    /// Whether the window's outermost rows and columns are not summed over.
    const INNER: bool;

    /// Whether the ends of the window's middle row and column are wanted.
    const ENDS: bool;

    /// What the rounding errors of sums stay below, where the points have been summed to `total` over `count` pixels
    /// and no coordinate is above `largest`.
    fn error(total: [f64; N], count: usize, largest: f32) -> f64;

    /// Of eight windows' sums, those of weights.
    fn weights<S: Simd>(sums: &[Doubles<S>; N]) -> [Doubles<S>; 2];

    /// Notes what the normals of eight pixels, `at` in their run, are made from: the sums over their windows. Only
    /// these `lanes` mean something.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the rectangles are of a ring that has these points.
    unsafe fn note<S: Groups>(
        sums: &[Doubles<S>; N],
        rects: &Rects,
        points: &[Counted],
        lanes: u32,
        run: &mut Self::OfRun,
        at: usize,
    );

    /// Notes windows of some lanes of a pair of groups, which is `at` in its run, from their points, without the rings'
    /// rounding; returns whether: else they are left to the plain form. What was noted of the pair before is lost.
    ///
    /// # Safety
    /// As [`Sums::note`].
    unsafe fn afresh<S: Groups>(
        _points: &impl CleanPoints,
        _rect: impl Fn(usize) -> Rect,
        _lanes: u32,
        _run: &mut Self::OfRun,
        _at: usize,
    ) -> bool {
        false
    }

    /// The normals of the pixels from `at` on in a run, which are solved.
    ///
    /// # Safety
    /// As [`Sums::note`].
    unsafe fn estimate<S: Simd>(run: &Self::OfRun, at: usize, error: f64) -> Found<S>;
}

/// CM: moments about a point of the tile.
pub(crate) struct CovarianceMatrix {
    /// x, y, z, 0.
    pub origin: [f64; 4],
}

impl CovarianceMatrix {
    pub fn about([x, y, z]: [f32; 3]) -> Self {
        CovarianceMatrix { origin: [x.into(), y.into(), z.into(), 0.0] }
    }
}

/// x, y, z, the number of points; xx, yy, zz, it again; xy, yz, zx, it again: fours, as sums are read.
pub(crate) const MOMENTS: usize = 12;

impl Channels<MOMENTS> for CovarianceMatrix {
    #[inline(always)]
    fn of(&self, own: &Counted, _: [&Counted; 2], _: [&Counted; 2]) -> [f64; MOMENTS] {
        // In fours, the point's count like a coordinate whose origin is 0.
        let there = f64::from(own[3]);
        let mut p = [0.0; 4];
        for c in 0..4 {
            p[c] = (f64::from(own[c]) - self.origin[c]) * there;
        }
        let next = [p[1], p[2], p[0], p[3]];
        let mut moments = [0.0; MOMENTS];
        for c in 0..4 {
            moments[c] = p[c];
            moments[4 + c] = p[c] * p[c];
            moments[8 + c] = p[c] * next[c];
        }
        moments
    }
}

impl Sums<MOMENTS> for CovarianceMatrix {
    type OfRun = Matrices;

    const INNER: bool = false;
    const ENDS: bool = false;

    fn error(total: [f64; MOMENTS], _: usize, _: f32) -> f64 {
        ROUNDING * (total[4] + total[5] + total[6])
    }

    #[inline(always)]
    fn weights<S: Simd>(sums: &[Doubles<S>; MOMENTS]) -> [Doubles<S>; 2] {
        [sums[3], sums[3]]
    }

    #[inline(always)]
    unsafe fn note<S: Groups>(
        sums: &[Doubles<S>; MOMENTS],
        _: &Rects,
        _: &[Counted],
        _: u32,
        run: &mut Matrices,
        at: usize,
    ) {
        let [x, y, z, count, xx, yy, zz, _, xy, yz, xz, _] = *sums;
        let sums = [x, y, z, xx, xy, xz, yy, yz, zz];
        // SAFETY: as the caller's.
        unsafe {
            let share = Doubles::splat(1.0) / count;
            run.note(&WindowMoments { sums, share }, at);
        }
    }

    #[inline(always)]
    unsafe fn afresh<S: Groups>(
        points: &impl CleanPoints,
        rect: impl Fn(usize) -> Rect,
        lanes: u32,
        run: &mut Matrices,
        at: usize,
    ) -> bool {
        let sum_up = |lane: usize| sum_of_moments(points.finite(&rect(lane)));
        // SAFETY: as the caller's.
        unsafe { run.note_afresh::<S>(at, lanes, sum_up) };
        true
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(run: &Matrices, at: usize, error: f64) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { run.normals(at, error) }
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

/// The coordinates of eight points of `points`, and which of them are there.
///
/// # Safety
/// The processor has the instruction set of `S`; all of `places` are inside.
#[inline(always)]
pub(crate) unsafe fn gather<S: Groups>(
    points: &[Counted],
    places: &[i32; GROUP],
) -> [Floats<S>; 4] {
    debug_assert!(places.iter().all(|at| (*at as usize) < points.len()));
    let points = points.as_ptr();
    // SAFETY: as the caller's; a point is four floats.
    unsafe {
        let place = |lane: usize| points.add(places[lane] as usize).cast();
        let [x, y, z, count] = load_by_fours::<S>(place);
        [Floats(x), Floats(y), Floats(z), Floats(count)]
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
    type OfRun = Tangents;

    const INNER: bool = true;
    const ENDS: bool = false;

    fn error(_: [f64; 8], count: usize, largest: f32) -> f64 {
        error_of_differences(count, largest)
    }

    #[inline(always)]
    fn weights<S: Simd>(sums: &[Doubles<S>; 8]) -> [Doubles<S>; 2] {
        [sums[3], sums[7]]
    }

    #[inline(always)]
    unsafe fn note<S: Groups>(
        sums: &[Doubles<S>; 8],
        _: &Rects,
        _: &[Counted],
        _: u32,
        run: &mut Tangents,
        at: usize,
    ) {
        let [hx, hy, hz, _, vx, vy, vz, _] = *sums;
        let horizontal = [hx.narrow(), hy.narrow(), hz.narrow()];
        let vertical = [vx.narrow(), vy.narrow(), vz.narrow()];
        // SAFETY: as the caller's.
        unsafe { run.note(horizontal, vertical, at) }
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(run: &Tangents, at: usize, error: f64) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { run.across(at, error) }
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
    type OfRun = Tangents;

    const INNER: bool = true;
    const ENDS: bool = true;

    fn error(_: [f64; 4], count: usize, largest: f32) -> f64 {
        error_of_differences(count, largest)
    }

    #[inline(always)]
    fn weights<S: Simd>(sums: &[Doubles<S>; 4]) -> [Doubles<S>; 2] {
        [sums[1], sums[3]]
    }

    #[inline(always)]
    unsafe fn note<S: Groups>(
        sums: &[Doubles<S>; 4],
        rects: &Rects,
        points: &[Counted],
        lanes: u32,
        run: &mut Tangents,
        at: usize,
    ) {
        let [h, h_count, v, v_count] = *sums;
        // SAFETY: as the caller's.
        unsafe {
            let [hx, hy, h_span] = outermost::<S>(rects, 0, points, lanes);
            let [vx, vy, v_span] = outermost::<S>(rects, 1, points, lanes);
            // Times twice the number of depth changes, which are over two pixels each.
            let (h_count, v_count) = (h_count.narrow(), v_count.narrow());
            let (h_count, v_count) = (h_count + h_count, v_count + v_count);
            let horizontal = [hx * h_count, hy * h_count, h.narrow() * h_span];
            let vertical = [vx * v_count, vy * v_count, v.narrow() * v_span];
            run.note(horizontal, vertical, at);
        }
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(run: &Tangents, at: usize, error: f64) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { run.across(at, error) }
    }
}

/// The differences in x and y between the outermost points of eight windows' middle rows (`line` 0) or columns, and
/// how far apart these are.
///
/// # Safety
/// As [`Sums::normals`].
#[inline(always)]
unsafe fn outermost<S: Groups>(
    rects: &Rects,
    line: usize,
    points: &[Counted],
    lanes: u32,
) -> [Floats<S>; 3] {
    // SAFETY: as the caller's.
    unsafe {
        let [first, last] = &rects.ends[line];
        let (a, b) = (gather::<S>(points, first), gather::<S>(points, last));
        let span = Floats::load(rects.spans[line].as_ptr());
        let found = [b[0] - a[0], b[1] - a[1], span];
        let missing = (a[3] * b[3]).lt(Floats::splat(1.0)) & lanes;
        if missing == 0 {
            return found;
        }
        let mut fields = [[0.0; GROUP]; 3];
        for c in 0..3 {
            S::store(fields[c].as_mut_ptr(), found[c].0);
        }
        for lane in Bits(missing) {
            let one = rects.outermost(line, lane, points);
            let [dx, dy, span] =
                one.map_or([0.0; 3], |([a, b], span)| [b[0] - a[0], b[1] - a[1], span]);
            (fields[0][lane], fields[1][lane], fields[2][lane]) = (dx, dy, span);
        }
        let load = |c: usize| Floats::load(fields[c].as_ptr());
        [load(0), load(1), load(2)]
    }
}

/// A normal is doubtful where errors of the sums could turn it by more than 1e-5.
const DOUBT_SUMS: f64 = 1e5;

/// And where floats could turn it by more than 1e-5: (sine of the angle between the tangents)^2 < 1e-4.
const DOUBT_SINE: f32 = 1e-4;

/// And where their squares come near the smallest floats.
const DOUBT_TINY: f32 = 1e-30;

/// Horizontal and vertical tangents of a run's pixels.
#[derive(Default)]
pub(crate) struct Tangents([OfRun<f32, 3>; 2]);

impl Noted for Tangents {}

impl Tangents {
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn note<S: Simd>(&mut self, h: [Floats<S>; 3], v: [Floats<S>; 3], at: usize) {
        let Tangents([horizontal, vertical]) = self;
        // SAFETY: as the caller's.
        unsafe {
            horizontal.store::<S>(at, h);
            vertical.store::<S>(at, v);
        }
    }

    /// The directions across them. `error` is what those of the sums stay below.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn across<S: Simd>(&self, at: usize, error: f64) -> Found<S> {
        let Tangents([horizontal, vertical]) = self;
        // SAFETY: as the caller's.
        unsafe {
            let (h, v) = (horizontal.load::<S>(at), vertical.load::<S>(at));
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
}
