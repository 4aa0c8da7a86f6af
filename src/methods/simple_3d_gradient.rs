//! SIMPLE_3D_GRADIENT: the cross product of the differences of one-pixel-wide strips at the window's edges.

use super::{Estimate, finite_point, normal_of_tangents, start};
use crate::cloud::Points;
use crate::vector::{difference, sum};
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
        let pixels = image.rects(start, size).flat_map(|(rect, _)| rect.pixels());
        pixels.filter_map(|pixel| finite_point(points, pixel)).fold([0.0; 3], sum)
    };
    let horizontal = difference(strip((right, top), (1, height)), strip((left, top), (1, height)));
    let vertical = difference(strip((left, bottom), (width, 1)), strip((left, top), (width, 1)));
    normal_of_tangents(vertical, horizontal)
}
