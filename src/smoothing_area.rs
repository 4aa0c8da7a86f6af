//! Step 3: the smoothing area map (the paper's R, Eq. 8): the side of every pixel's window.

use crate::options::Options;

/// A pixel has a window if its smoothing area is above this, as in PCL.
pub(crate) const SMALLEST: f32 = 2.0;

/// The largest side a window can have: every whole number up to it is a float.
pub(crate) const LARGEST: f32 = 16_777_216.0;

/// How far a pixel at depth `z` may be smoothed: the paper's B (Eq. 5), as PCL defines it.
#[inline(always)]
pub(crate) fn depth_smoothing(z: f32, options: &Options) -> f32 {
    if options.depth_dependent_smoothing {
        options.normal_smoothing_size + z / 10.0
    } else {
        options.normal_smoothing_size
    }
}

/// The side of the window of a pixel at `z`, `distance` from the nearest depth change; 0 for no window.
#[inline(always)]
pub(crate) fn window_side(distance: f32, z: f32, options: &Options) -> u32 {
    let smallest = distance.min(depth_smoothing(z, options));
    if smallest > SMALLEST && z.is_finite() { smallest.min(LARGEST) as u32 } else { 0 }
}
