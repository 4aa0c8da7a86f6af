//! Step 4 of the paper, fast: what each method sums, and eight normals from eight windows' sums. The plain forms are
//! in `paper::methods`.

use super::integrals::{Around, Channels, Rings, WEIGHT};
use super::rects::Rects;
use crate::fast::arithmetic::{Doubles, Floats};
use crate::fast::estimates::Found;
use crate::fast::lanes::Bits;
use crate::fast::matrices::{Matrices, WindowMoments};
use crate::fast::run::{Noted, OfRun};
use crate::paper::ROUNDING;
use crate::simd::{GROUP, Groups, Simd};
use crate::vector::{cross, dot};

/// A method's sums and normals.
pub(crate) trait Sums<const N: usize>: Channels<N> {
    /// What the normals of a run of pixels are made from.
    type OfRun: Noted;

    /// How many of the window's rows and columns are not summed over, at each side.
    const EDGE: usize;

    /// Whether the ends of the window's middle row and column are wanted.
    const ENDS: bool;

    /// Whether points on one line of the image, which give no normal, may seem to give one.
    const LINES: bool;

    /// What the rounding errors of sums stay below, where the points have been summed to `total` over `count` pixels
    /// and no coordinate is above `largest`.
    fn error(total: [f64; N], count: usize, largest: f32) -> f64;

    /// Of eight windows' sums, those of weights.
    fn weights<S: Simd>(sums: &[Doubles<S>; N]) -> [Doubles<S>; 2];

    /// Notes what the normals of eight pixels, `at` in their run, are made from: the sums over their windows. Only
    /// these `lanes` mean something.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the windows are of these rings.
    unsafe fn note<S: Groups>(
        sums: &[Doubles<S>; N],
        rects: &Rects<S>,
        rings: &Rings<N>,
        lanes: u32,
        run: &mut Self::OfRun,
        at: usize,
    );

    /// The normals of the pixels from `at` on in a run, which are solved.
    ///
    /// # Safety
    /// As [`Sums::note`].
    unsafe fn estimate<S: Simd>(run: &Self::OfRun, at: usize, error: f64) -> Found<S>;
}

/// CM: moments about a point of the tile.
pub(crate) struct CovarianceMatrix {
    origin: [f64; 3],
}

impl CovarianceMatrix {
    pub fn about([x, y, z]: [f32; 3]) -> Self {
        CovarianceMatrix { origin: [x.into(), y.into(), z.into()] }
    }
}

/// x, y, z, the number of points, xx, yy, zz, xy; yz, zx: eight and two, as sums are read.
pub(crate) const MOMENTS: usize = 10;

impl Channels<MOMENTS> for CovarianceMatrix {
    #[inline(always)]
    unsafe fn of<S: Groups>(&self, points: &Around) -> [Doubles<S>; MOMENTS] {
        // SAFETY: as the caller's.
        unsafe {
            let weight = points.own::<S>(WEIGHT);
            let there = S::lt(S::splat(0.0), weight.0);
            let count = weight.widen();
            let mut about = [count; 3];
            for c in 0..3 {
                let coordinate = Floats::<S>(S::and(there, points.own::<S>(c).0)).widen();
                about[c] = (coordinate - Doubles::splat(self.origin[c])) * count;
            }
            let [x, y, z] = about;
            [x, y, z, count, x * x, y * y, z * z, x * y, y * z, z * x]
        }
    }
}

impl Sums<MOMENTS> for CovarianceMatrix {
    type OfRun = Matrices;

    const EDGE: usize = 0;
    const ENDS: bool = false;
    const LINES: bool = true;

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
        _: &Rects<S>,
        _: &Rings<MOMENTS>,
        _: u32,
        run: &mut Matrices,
        at: usize,
    ) {
        let [x, y, z, count, xx, yy, zz, xy, yz, xz] = *sums;
        let sums = [x, y, z, xx, xy, xz, yy, yz, zz];
        // SAFETY: as the caller's.
        unsafe {
            let share = Doubles::splat(1.0) / count;
            run.note(&WindowMoments { sums, share }, at);
        }
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(run: &Matrices, at: usize, error: f64) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { run.normals(at, error) }
    }
}

/// What points before and after pixels weigh together, and the differences between these fields of them: exact, so that
/// what cancels in the sums leaves nothing.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn differences<S: Groups, const N: usize>(
    pairs: [[Floats<S>; 2]; N],
    weights: [Floats<S>; 2],
) -> ([Doubles<S>; N], Doubles<S>) {
    // SAFETY: as the caller's.
    unsafe {
        let weight = weights[0] * weights[1];
        let both = S::lt(S::splat(0.0), weight.0);
        let weight = weight.widen();
        let mut differences = [weight; N];
        for (to, pair) in differences.iter_mut().zip(pairs) {
            let [before, after] = pair;
            let (before, after) = (S::and(both, before.0), S::and(both, after.0));
            *to = (Floats(after).widen() - Floats(before).widen()) * weight;
        }
        (differences, weight)
    }
}

/// What the error of sums of differences stays below.
fn error_of_differences(count: usize, largest: f32) -> f64 {
    2.0 * ROUNDING * f64::from(largest) * count as f64
}

/// The 3-D gradients.
pub(crate) struct Gradients;

impl Channels<8> for Gradients {
    #[inline(always)]
    unsafe fn of<S: Groups>(&self, points: &Around) -> [Doubles<S>; 8] {
        // SAFETY: as the caller's.
        unsafe {
            let row = [points.beside::<S>(0), points.beside(1), points.beside(2)];
            let column = [points.over::<S>(0), points.over(1), points.over(2)];
            let ([a, b, c], d) = differences(row, points.beside(WEIGHT));
            let ([e, f, g], h) = differences(column, points.over(WEIGHT));
            [a, b, c, d, e, f, g, h]
        }
    }
}

impl Sums<8> for Gradients {
    type OfRun = OfRun<f32, 6>;

    const EDGE: usize = 1;
    const ENDS: bool = false;
    const LINES: bool = false;

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
        _: &Rects<S>,
        _: &Rings<8>,
        _: u32,
        run: &mut OfRun<f32, 6>,
        at: usize,
    ) {
        let [hx, hy, hz, _, vx, vy, vz, _] = *sums;
        let (hx, hy, hz) = (hx.narrow(), hy.narrow(), hz.narrow());
        let (vx, vy, vz) = (vx.narrow(), vy.narrow(), vz.narrow());
        // SAFETY: as the caller's.
        unsafe { run.store::<S>(at, [hx, hy, hz, vx, vy, vz]) }
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(run: &OfRun<f32, 6>, at: usize, error: f64) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { across(run, at, error) }
    }
}

/// SDC: of the gradients' channels z and the counts.
pub(crate) struct SmoothedDepthChanges;

impl Channels<4> for SmoothedDepthChanges {
    #[inline(always)]
    unsafe fn of<S: Groups>(&self, points: &Around) -> [Doubles<S>; 4] {
        // SAFETY: as the caller's.
        unsafe {
            let ([h], row) = differences([points.beside::<S>(2)], points.beside(WEIGHT));
            let ([v], column) = differences([points.over::<S>(2)], points.over(WEIGHT));
            [h, row, v, column]
        }
    }
}

impl Sums<4> for SmoothedDepthChanges {
    type OfRun = OfRun<f32, 6>;

    const EDGE: usize = 1;
    const ENDS: bool = true;
    const LINES: bool = false;

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
        rects: &Rects<S>,
        rings: &Rings<4>,
        lanes: u32,
        run: &mut OfRun<f32, 6>,
        at: usize,
    ) {
        let [h, h_count, v, v_count] = *sums;
        // SAFETY: as the caller's.
        unsafe {
            let [hx, hy, h_span] = outermost(rects, rings, 0, lanes);
            let [vx, vy, v_span] = outermost(rects, rings, 1, lanes);
            // Times twice the number of depth changes, which are over two pixels each: the sums' errors are those of z.
            let (h_count, v_count) = (h_count.narrow(), v_count.narrow());
            let (h_times, v_times) = ((h_count + h_count) / h_span, (v_count + v_count) / v_span);
            let (hx, hy, hz) = (hx * h_times, hy * h_times, h.narrow());
            let (vx, vy, vz) = (vx * v_times, vy * v_times, v.narrow());
            run.store::<S>(at, [hx, hy, hz, vx, vy, vz]);
        }
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(run: &OfRun<f32, 6>, at: usize, error: f64) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { across(run, at, error) }
    }
}

/// The differences in x and y between the outermost points of eight windows' middle rows (`line` 0) or columns, and
/// how far apart these are; NaN where there are not two.
///
/// # Safety
/// As [`Sums::note`].
#[inline(always)]
unsafe fn outermost<S: Groups>(
    rects: &Rects<S>,
    rings: &Rings<4>,
    line: usize,
    lanes: u32,
) -> [Floats<S>; 3] {
    // SAFETY: as the caller's.
    unsafe {
        let found = rects.ends(rings, line);
        let missing = lanes & !S::bits(S::eq(found[0].0, found[0].0));
        if missing == 0 {
            return found;
        }
        let mut fields = [[0.0; GROUP]; 3];
        for c in 0..3 {
            S::store(fields[c].as_mut_ptr(), found[c].0);
        }
        let each = rects.each();
        for lane in Bits(missing) {
            let one = each.outermost(rings, line, lane);
            for c in 0..2 {
                let difference = |a: usize, b: usize| rings.field(b, c) - rings.field(a, c);
                fields[c][lane] = one.map_or(f32::NAN, |([a, b], _)| difference(a, b));
            }
            fields[2][lane] = one.map_or(f32::NAN, |(_, span)| span as f32);
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

/// The directions across the horizontal and vertical tangents of a run's pixels from `at` on, which are NaN where there is
/// none, and certainly no normal. `error` is what those of the sums stay below.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn across<S: Simd>(run: &OfRun<f32, 6>, at: usize, error: f64) -> Found<S> {
    // SAFETY: as the caller's.
    unsafe {
        let [hx, hy, hz, vx, vy, vz] = run.load::<S>(at);
        let (h, v) = ([hx, hy, hz], [vx, vy, vz]);
        let n = cross(v, h);
        let (n2, h2, v2) = (dot(n, n), dot(h, h), dot(v, v));
        let error = (error * DOUBT_SUMS) as f32;
        let rounding = Floats::splat(2.0 * error * error) * (h2 + v2);
        let sine = h2 * v2 * Floats::splat(DOUBT_SINE);
        let scale = Floats::splat(1.0) / n2.sqrt();
        let sure = rounding.max(sine).max(Floats::splat(DOUBT_TINY)).lt(n2);
        let both = S::and(S::eq(h[0].0, h[0].0), S::eq(v[0].0, v[0].0));
        let none = Floats::splat(f32::NAN);
        let mut normal = [none; 3];
        for c in 0..3 {
            normal[c].take(both, n[c] * scale);
        }
        Found { normal, curvature: none, doubtful: S::bits(both) & !sure }
    }
}
