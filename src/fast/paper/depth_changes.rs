//! The depth changes of a row, fast: the plain form is in `paper::depth_change`.

use super::windows::is_change;
use crate::fast::windows::threshold;
use crate::options::{Options, Semantics};
use crate::paper::{between as plain_between, is_depth_change, mark};
use crate::simd::Simd;

/// [`between`](plain_between), of all pixels, as the semantics tell changes.
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
            let [depth, next] = [before, behind].map(|row| S::load(row.as_ptr().add(x)));
            let change = match options.semantics {
                Semantics::Paper => is_change::<S>(depth, next, S::splat(1.0), &options.paper),
                Semantics::Pcl => {
                    let least = threshold::<S>(depth, S::splat(options.max_depth_change_factor));
                    S::lt(least, S::abs(S::sub(next, depth)))
                }
            };
            let [there, there_next] = [depth, next].map(|depth| S::bits(S::eq(depth, depth)));
            mark(changes, x, S::bits(change).into());
            mark(behind_gaps, x, (there_next & !there).into());
        }
    }
    plain_between([before, behind], [changes, behind_gaps], whole, |depth, difference, gap| {
        is_depth_change(depth, difference, gap, options)
    });
}
