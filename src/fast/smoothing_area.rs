//! Step 3, fast: the sides of a row's windows. The plain form is in `smoothing_area`.

use super::arithmetic::Floats;
use super::lanes::{LANES, Lanes};
use crate::cloud::Points;
use crate::options::Options;
use crate::simd::Simd;
use crate::smoothing_area::{LARGEST, SMALLEST, depth_smoothing};

/// How far pixels may be smoothed.
#[derive(Clone, Copy)]
pub(super) enum Smoothing<'a> {
    /// All of them.
    Alike(f32),
    /// Those of a row, by their depths.
    ByDepth(&'a [Lanes]),
}

/// The sides of the windows of row `y`, from its distances to depth changes, with nothing ignored; none is larger than what
/// is returned.
///
/// # Safety
/// The processor has the instruction set of `S`, which has sixteen lanes.
#[inline(always)]
pub(super) unsafe fn sides<S: Simd>(
    points: &Points,
    options: &Options,
    y: usize,
    smoothing: Smoothing,
    distances: &[Lanes],
    sides: &mut [Lanes],
) -> f32 {
    let segment = distances.len();
    let sides = &mut sides[..segment];
    // SAFETY: as the caller's.
    unsafe {
        let mut so_far = S::splat(0.0);
        match smoothing {
            Smoothing::Alike(smoothing) => {
                let smoothing = S::splat(smoothing);
                for k in 0..segment {
                    let side = side::<S>(distances[k].load::<S>(), smoothing);
                    so_far = S::max(side, so_far);
                    sides[k].store::<S>(side);
                }
            }
            Smoothing::ByDepth(z) => {
                let z = &z[..segment];
                let (size, ten) = (S::splat(options.normal_smoothing_size), S::splat(10.0));
                for k in 0..segment {
                    points.prefetch(y.wrapping_sub(1), k * LANES, LANES);
                    let smoothing = S::add(size, S::div(z[k].load::<S>(), ten));
                    let side = side::<S>(distances[k].load::<S>(), smoothing);
                    so_far = S::max(side, so_far);
                    sides[k].store::<S>(side);
                }
            }
        }
        Floats::<S>(so_far).largest()
    }
}

/// `smoothing_area::window_side`.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn side<S: Simd>(distance: S::F, smoothing: S::F) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let smallest = S::min(distance, smoothing);
        let whole = S::truncate(S::min(smallest, S::splat(LARGEST)));
        S::and(S::lt(S::splat(SMALLEST), smallest), whole)
    }
}

/// How far every pixel may be smoothed, if depths from the least to the largest make no difference: only the whole part
/// counts, and whether it is enough for a window.
pub(super) fn one_smoothing([least, largest]: [f32; 2], options: &Options) -> Option<f32> {
    let [first, last] = [least, largest].map(|z| depth_smoothing(z, options));
    let alike = |a: f32, b: f32| a.trunc() == b.trunc() && (a > SMALLEST) == (b > SMALLEST);
    (least > largest || alike(first, last)).then_some(first)
}

/// Has no windows for the pixels of row `y` that are ignored: the border's, and the last one if it has no depth, which
/// is not tested.
#[inline(always)]
pub(super) fn ignore(points: &Points, options: &Options, y: usize, sides: &mut [f32]) {
    let (width, height) = (points.width(), points.height());
    if y + 1 == height && !points.z(width - 1, y).is_finite() {
        sides[width - 1] = 0.0;
    }
    let border = options.ignored_border().min(width);
    if y < border || y + border >= height {
        sides[..width].fill(0.0);
    }
    sides[..border].fill(0.0);
    sides[width - border..width].fill(0.0);
}
