//! The last resort of a pixel whose surface has no window: the plane through the points around it.

use super::cloud::Cloud;
use super::methods::plane_of;
use crate::methods::Estimate;
use crate::rect::Rect;

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
    let (mut points, mut count) = ([[0.0_f32; 3]; (2 * REACH + 1).pow(2)], 0);
    // To the first other pixel.
    let (mut first, mut are_in_line) = ([0; 2], true);
    for row in around.y {
        let at = cloud.index(around.x.start, row)..cloud.index(around.x.end, row);
        let line = cloud.depths[at.clone()].iter().zip(&cloud.points[at]);
        for ((other, point), column) in line.zip(around.x.clone()) {
            let distance = x.abs_diff(column).max(y.abs_diff(row));
            if !other.is_nan() && is_same_surface(other - depth, distance.max(1)) {
                points[count] = *point;
                count += 1;
                let way = [(column, x), (row, y)].map(|(to, from)| to as isize - from as isize);
                if first == [0; 2] {
                    first = way;
                }
                are_in_line &= first[0] * way[1] == first[1] * way[0];
            }
        }
    }
    let points = &points[..count];
    // As where a sensor writes zeros for "no return".
    if are_in_line || points.iter().all(|point| *point == points[0]) {
        return None;
    }
    plane_of(|| points.iter().map(|point| point.map(f64::from)))
}
