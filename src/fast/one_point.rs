//! Windows that hold one point again and again, as a sensor may write it for "no return". They have no normal, but their
//! sums do not tell.

use std::ops::Range;

use super::lanes::Bits;
use crate::cloud::Points;
use crate::rect::Rect;
use crate::simd::Along;

/// The lanes, of some, around whose pixels there is no other point. `around` gives a lane's pixel, which has a point, and
/// the rectangle that counts.
///
/// # Safety
/// The processor has the instruction set of `S`; the rectangles are inside the image.
#[inline(always)]
pub(crate) unsafe fn of_one_point<S: Along>(
    points: &Points,
    lanes: u32,
    around: impl Fn(usize) -> ((usize, usize), Rect),
) -> u32 {
    let hull = |a: Range<usize>, b: Range<usize>| a.start.min(b.start)..a.end.max(b.end);
    let (first, all) = around(lanes.trailing_zeros() as usize);
    let all = Bits(lanes).fold(all, |all, lane| {
        let Rect { x, y } = around(lane).1;
        Rect { x: hull(all.x, x), y: hull(all.y, y) }
    });
    // SAFETY: as the caller's.
    if unsafe { holds_only::<S>(points, &all, first) } {
        return lanes;
    }
    let mut found = 0;
    // Not by a closure, which might be compiled without the instruction set.
    for lane in Bits(lanes) {
        let (pixel, rect) = around(lane);
        // SAFETY: as the caller's.
        if unsafe { holds_only::<S>(points, &rect, pixel) } {
            found |= 1 << lane;
        }
    }
    found
}

/// Whether a rectangle holds the pixel's point only, and some that are NaN.
///
/// # Safety
/// As [`of_one_point`].
#[inline(always)]
unsafe fn holds_only<S: Along>(points: &Points, rect: &Rect, pixel: (usize, usize)) -> bool {
    let point = points.at(pixel.0, pixel.1);
    for y in rect.y.clone() {
        let row = points.row(y, rect.x.clone());
        // SAFETY: as the caller's.
        unsafe {
            let [x, y, z] = [S::splat(point[0]), S::splat(point[1]), S::splat(point[2])];
            let mut others = S::splat(0.0);
            for at in row.starts::<S>() {
                let [px, py, pz] = row.lanes::<S>(at);
                let there = S::and(S::and(S::eq(px, px), S::eq(py, py)), S::eq(pz, pz));
                let alike = S::and(S::and(S::eq(px, x), S::eq(py, y)), S::eq(pz, z));
                others = S::or(others, S::and_not(alike, there));
            }
            if S::bits(others) != 0 {
                return false;
            }
        }
    }
    true
}
