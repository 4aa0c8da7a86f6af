//! The depths of a row of points, and these themselves, missing ones NaN.

use crate::cloud::{PointRow, Points};
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
        let (mut nearest, mut deepest) = (S::splat(f32::INFINITY), S::splat(0.0));
        for x in points.starts::<S>() {
            let [px, py, pz] = points.lanes::<S>(x);
            let there = there::<S>([px, py, pz], options);
            let depth = depth::<S>([px, py, pz], range);
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

/// Reads a row of points and their depths, distances from the origin where `range` says so.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(crate) unsafe fn read_points<S: Along>(
    row: &PointRow,
    options: &Options,
    range: bool,
    to: &mut [[f32; 3]],
    depths: &mut [f32],
) {
    let width = to.len();
    let depths = &mut depths[..width];
    for x in (0..width).step_by(S::LANES) {
        // SAFETY: as the caller's; all of the lanes, or as many as there is room for, are stored.
        unsafe {
            let point = row.lanes::<S>(x);
            let (none, there) = (S::splat(f32::NAN), there::<S>(point, options));
            let depth = S::select(there, depth::<S>(point, range), none);
            let mut fields = [depth; 4];
            for c in 0..3 {
                fields[c] = S::select(there, point[c], none);
            }
            if x + S::LANES <= width {
                S::store_points(fields, 0, to[x..].as_mut_ptr().cast(), size_of::<[f32; 3]>());
                S::store(depths[x..].as_mut_ptr(), depth);
            } else {
                let mut last = [[0.0; LANES]; 4];
                for (last, field) in last.iter_mut().zip(fields) {
                    S::store(last.as_mut_ptr(), field);
                }
                let [xs, ys, zs, of_last] = last;
                for (lane, (to, depth)) in to[x..].iter_mut().zip(&mut depths[x..]).enumerate() {
                    (*to, *depth) = ([xs[lane], ys[lane], zs[lane]], of_last[lane]);
                }
            }
        }
    }
}

/// The mask of the points that are not missing.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn there<S: Along>([x, y, z]: [S::F; 3], options: &Options) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let there = S::and(S::and(S::finite(x), S::finite(y)), S::finite(z));
        if !options.zero_is_missing {
            return there;
        }
        let zero = S::splat(0.0);
        S::and_not(S::and(S::and(S::eq(x, zero), S::eq(y, zero)), S::eq(z, zero)), there)
    }
}

/// The distances from the origin, or z.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn depth<S: Along>([x, y, z]: [S::F; 3], range: bool) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        if range { S::sqrt(S::add(S::add(S::mul(x, x), S::mul(y, y)), S::mul(z, z))) } else { z }
    }
}
