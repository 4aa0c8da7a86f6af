//! The last resort of a pixel whose surface has no window: the plane through the points around it.

use super::cloud::Cloud;
use super::methods::plane_of;
use crate::methods::Estimate;
use crate::rect::{Rect, are_in_line};

/// How far around: fewer points are mostly noise.
const REACH: usize = 3;

/// The plane through the points around a pixel whose `difference` in depth to the pixel's, at such a `distance`, is that of
/// points on the same surface; none if these are all on one line of the image.
pub(crate) fn plane_around(
    cloud: &Cloud,
    (x, y): (usize, usize),
    is_same_surface: impl Fn(f32, usize) -> bool,
) -> Option<Estimate> {
    // In the paper's semantics nothing is on one surface with a point at depth 0.
    if !is_same_surface(0.0, 1) {
        return None;
    }
    let depth = cloud.depths[cloud.index(x, y)];
    let around = Rect::around((x, y), REACH, (cloud.width, cloud.height));
    let (mut pixels, mut count) = ([(x, y); (2 * REACH + 1).pow(2)], 0);
    for row in around.y {
        let at = cloud.index(around.x.start, row)..cloud.index(around.x.end, row);
        for (other, column) in cloud.depths[at].iter().zip(around.x.clone()) {
            let distance = x.abs_diff(column).max(y.abs_diff(row));
            if !other.is_nan() && is_same_surface(other - depth, distance.max(1)) {
                pixels[count] = (column, row);
                count += 1;
            }
        }
    }
    let pixels = &pixels[..count];
    let points = || pixels.iter().map(|(x, y)| cloud.points[cloud.index(*x, *y)]);
    // As where a sensor writes zeros for "no return".
    if are_in_line(pixels.iter().copied()) || points().all(|point| Some(point) == points().next()) {
        return None;
    }
    plane_of(|| points().map(|point| point.map(f64::from)))
}
