//! AVERAGE_3D_GRADIENT: the cross product of the window's summed central differences.

use super::{Estimate, is_finite, normal_of_tangents, start};
use crate::cloud::Points;
use crate::rect::Rect;
use crate::vector::{difference, sum};
use crate::window::Image;

/// The plain form: sums P(x+1, y) - P(x-1, y) and P(x, y+1) - P(x, y-1) over the window.
///
/// As PCL, differences that need a non-finite point are left out, and those of the image's outermost rows and
/// columns are zero; no normal if nothing is left.
pub(crate) fn estimate(
    points: &Points,
    image: &Image,
    (x, y): (usize, usize),
    (width, height): (usize, usize),
) -> Estimate {
    let (mut horizontal, mut vertical) = ([0.0; 3], [0.0; 3]);
    for (rect, _) in image.rects((start(x, width), start(y, height)), (width, height)) {
        for (x, y) in image.inside_frame(&rect).pixels() {
            add(&mut horizontal, points.at(x + 1, y), points.at(x - 1, y));
            add(&mut vertical, points.at(x, y + 1), points.at(x, y - 1));
        }
    }
    normal_of_tangents(vertical, horizontal)
}

/// The same of a window that, with the pixels around it, holds finite points only: over a row or column the differences
/// telescope to those between its ends.
pub(crate) fn estimate_of_finite(
    points: &Points,
    image: &Image,
    (x, y): (usize, usize),
    side: usize,
) -> Estimate {
    let (mut horizontal, mut vertical) = ([0.0; 3], [0.0; 3]);
    for (rect, _) in image.rects((start(x, side), start(y, side)), (side, side)) {
        let Rect { x: columns, y: rows } = image.inside_frame(&rect);
        if columns.is_empty() || rows.is_empty() {
            continue;
        }
        for ahead in [0, 1] {
            for y in rows.clone() {
                let ends = [columns.end, columns.start].map(|x| points.at(x - ahead, y));
                add(&mut horizontal, ends[0], ends[1]);
            }
            for x in columns.clone() {
                let ends = [rows.end, rows.start].map(|y| points.at(x, y - ahead));
                add(&mut vertical, ends[0], ends[1]);
            }
        }
    }
    normal_of_tangents(vertical, horizontal)
}

/// Adds the difference between two points to a sum, if both are there.
fn add(to: &mut [f64; 3], ahead: [f32; 3], behind: [f32; 3]) {
    if is_finite(ahead) && is_finite(behind) {
        *to = sum(*to, difference(ahead.map(f64::from), behind.map(f64::from)));
    }
}
