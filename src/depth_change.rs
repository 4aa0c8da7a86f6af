//! Step 1: the depth change indication map (the paper's C, Eq. 6-7, with PCL's threshold and neighbours).

use std::iter::repeat_n;

use crate::Error;
use crate::cloud::Points;
use crate::memory::table;

/// Depth change threshold of a pixel at depth `z`: PCL's `max_depth_change_factor_ * (|z| + 1) * 2`, in f32.
#[inline(always)]
pub(crate) fn threshold(z: f32, factor: f32) -> f32 {
    factor * (z.abs() + 1.0) * 2.0
}

/// Whether there is a depth change between a pixel at depth `z` and its right or lower `neighbour`.
#[inline(always)]
pub(crate) fn is_depth_change(z: f32, neighbour: f32, factor: f32) -> bool {
    ((z - neighbour).abs() > threshold(z, factor)) | !z.is_finite() | !neighbour.is_finite()
}

/// The depth change indication map, row by row: true where the pixel is next to a depth change.
///
/// As PCL, the last row's and the last column's pixels are not tested against their own neighbours.
pub(crate) fn depth_change_map(points: &Points, factor: f32) -> Result<Vec<bool>, Error> {
    let (width, height) = (points.width(), points.height());
    let mut map = table(repeat_n(false, width * height))?;
    for y in 0..height - 1 {
        for x in 0..width - 1 {
            let z = points.z(x, y);
            for (nx, ny) in [(x + 1, y), (x, y + 1)] {
                if is_depth_change(z, points.z(nx, ny), factor) {
                    map[y * width + x] = true;
                    map[ny * width + nx] = true;
                }
            }
        }
    }
    Ok(map)
}
