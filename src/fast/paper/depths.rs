//! The depths of a row of points, missing ones NaN.

use crate::cloud::Points;
use crate::fast::lanes::{LANES, Lanes};
use crate::options::{Depth, Options};
use crate::simd::Along;

/// Elements of a row of depths: the width, and a pair of groups of NaN or more behind it.
pub(crate) fn row_length(width: usize) -> usize {
    width.next_multiple_of(LANES) + LANES
}

/// Fills a row of depths; returns the least and the largest of their magnitudes.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(crate) unsafe fn read<S: Along>(
    points: &Points,
    options: &Options,
    y: usize,
    whole_points: bool,
    depths: &mut [f32],
) -> [f32; 2] {
    let width = points.width();
    let range = options.paper.depth == Depth::Range;
    let depths = &mut depths[..row_length(width)];
    let points = points.row(y, 0..width, whole_points);
    // SAFETY: as the caller's; all lanes lie inside the depths.
    unsafe {
        let none = S::splat(f32::NAN);
        let zero = S::splat(0.0);
        let (mut nearest, mut deepest) = (S::splat(f32::INFINITY), zero);
        for x in (0..width).step_by(S::LANES) {
            let [px, py, pz] = points.lanes::<S>(x);
            let mut there = S::and(S::and(S::finite(px), S::finite(py)), S::finite(pz));
            if options.zero_is_missing {
                let origin = S::and(S::and(S::eq(px, zero), S::eq(py, zero)), S::eq(pz, zero));
                there = S::and_not(origin, there);
            }
            let depth = if range {
                S::sqrt(S::add(S::add(S::mul(px, px), S::mul(py, py)), S::mul(pz, pz)))
            } else {
                pz
            };
            S::store(depths.as_mut_ptr().add(x), S::select(there, depth, none));
            let magnitude = S::abs(depth);
            nearest = S::min(S::select(there, magnitude, nearest), nearest);
            deepest = S::max(S::and(there, magnitude), deepest);
        }
        depths[width..].fill(f32::NAN);
        let mut lanes = [Lanes([f32::INFINITY; LANES]), Lanes::ZERO];
        for (to, lane) in lanes.iter_mut().zip([nearest, deepest]) {
            S::store(to.0.as_mut_ptr(), lane);
        }
        [lanes[0].least(), lanes[1].largest()]
    }
}
