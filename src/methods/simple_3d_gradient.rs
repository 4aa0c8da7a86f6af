//! SIMPLE_3D_GRADIENT: the cross product of the differences of one-pixel-wide strips at the window's edges.

use super::{Estimate, is_finite, normal_of_tangents, start};
use crate::cloud::Points;
use crate::vector::difference;
use crate::window::Image;

/// The plain form: right strip minus left strip, lower strip minus upper strip.
///
/// As PCL, points with a non-finite coordinate are missing from their strips, and the right and lower strips lie
/// half a side from the pixel (for even sides just outside the window).
pub(crate) fn estimate(
    points: &Points,
    image: &Image,
    (x, y): (usize, usize),
    (width, height): (usize, usize),
) -> Estimate {
    let (left, top) = (start(x, width), start(y, height));
    let (right, bottom) = (x as isize + (width / 2) as isize, y as isize + (height / 2) as isize);
    let strip = |start, size| {
        let mut sum = [0.0; 3];
        for (rect, _) in image.rects(start, size) {
            for (x, y) in rect.pixels() {
                let point = points.at(x, y);
                if is_finite(point) {
                    for i in 0..3 {
                        sum[i] += f64::from(point[i]);
                    }
                }
            }
        }
        sum
    };
    let horizontal = difference(strip((right, top), (1, height)), strip((left, top), (1, height)));
    let vertical = difference(strip((left, bottom), (width, 1)), strip((left, top), (width, 1)));
    normal_of_tangents(vertical, horizontal)
}
