//! AVERAGE_3D_GRADIENT: the cross product of the window's summed central differences.

use super::{Estimate, is_finite, normal_of_tangents, start};
use crate::cloud::Points;
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
    let mut horizontal = Gradient::default();
    let mut vertical = Gradient::default();
    for (rect, _) in image.rects((start(x, width), start(y, height)), (width, height)) {
        let inside = image.inside_frame(&rect);
        let frame = rect.area() - inside.area();
        horizontal.count += frame;
        vertical.count += frame;
        for (x, y) in inside.pixels() {
            horizontal.add(points.at(x + 1, y), points.at(x - 1, y));
            vertical.add(points.at(x, y + 1), points.at(x, y - 1));
        }
    }
    if horizontal.count == 0 || vertical.count == 0 {
        return Estimate::NONE;
    }
    normal_of_tangents(vertical.sum, horizontal.sum)
}

/// The same of a window that, with the pixels around it, lies inside the image and holds finite points only: over a row or
/// column the differences telescope to those between its ends.
pub(crate) fn estimate_of_finite(points: &Points, (x, y): (usize, usize), side: usize) -> Estimate {
    let (left, top) = (x - side / 2, y - side / 2);
    let (right, bottom) = (left + side, top + side);
    let (mut horizontal, mut vertical) = (Gradient::default(), Gradient::default());
    for ahead in [0, 1] {
        for y in top..bottom {
            horizontal.add(points.at(right - ahead, y), points.at(left - ahead, y));
        }
        for x in left..right {
            vertical.add(points.at(x, bottom - ahead), points.at(x, top - ahead));
        }
    }
    normal_of_tangents(vertical.sum, horizontal.sum)
}

/// A sum of differences and how many there are.
#[derive(Default)]
struct Gradient {
    sum: [f64; 3],
    count: usize,
}

impl Gradient {
    fn add(&mut self, ahead: [f32; 3], behind: [f32; 3]) {
        if is_finite(ahead) && is_finite(behind) {
            for i in 0..3 {
                self.sum[i] += f64::from(ahead[i]) - f64::from(behind[i]);
            }
            self.count += 1;
        }
    }
}
