//! Depth changes as the semantics tell them, fast: the plain forms are in `paper` and `paper::depth_change`.

use super::windows;
use crate::fast::depth_changes::threshold;
use crate::options::{Options, Semantics};
use crate::paper::{between as plain_between, mark};
use crate::simd::Simd;

/// [`between`](plain_between), of all pixels.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(super) unsafe fn between<S: Simd>(
    [before, behind]: [&[f32]; 2],
    options: &Options,
    [changes, behind_gaps]: [&mut [u64]; 2],
) {
    let before = &before[..behind.len()];
    let whole = behind.len() / S::LANES * S::LANES;
    for x in (0..whole).step_by(S::LANES) {
        // SAFETY: as the caller's; there are so many depths.
        unsafe {
            let depth = S::load(before.as_ptr().add(x));
            let next = S::load(behind.as_ptr().add(x));
            let least = least_depth_change::<S>(depth, options);
            let difference = S::abs(S::sub(next, depth));
            let change = match options.semantics {
                Semantics::Paper => S::le(least, difference),
                Semantics::Pcl => S::lt(least, difference),
            };
            let is_behind_gap = S::and_not(S::eq(depth, depth), S::eq(next, next));
            mark(changes, x, S::bits(change).into());
            mark(behind_gaps, x, S::bits(is_behind_gap).into());
        }
    }
    plain_between([before, behind], [changes, behind_gaps], options, whole);
}

/// `paper::least_depth_change`
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(super) unsafe fn least_depth_change<S: Simd>(depth: S::F, options: &Options) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        match options.semantics {
            Semantics::Paper => windows::least_depth_change::<S>(depth, &options.paper),
            Semantics::Pcl => threshold::<S>(depth, S::splat(options.max_depth_change_factor)),
        }
    }
}
