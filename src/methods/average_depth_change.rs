//! AVERAGE_DEPTH_CHANGE: the paper's SDC (Eq. 9-15) as PCL computes it: mean depths of four half windows for the
//! tangents' z, single points for their x and y.

use super::{Estimate, normal_of_tangents, start};
use crate::cloud::Points;
use crate::window::Image;

/// The plain form.
///
/// As PCL, the upper point is read one column to the left and the lower one one column to the right of the
/// pixel, a quarter of the window's height away, where one row further was meant. No normal if a half window has
/// no finite z.
pub(crate) fn estimate(
    points: &Points,
    image: &Image,
    (x, y): (usize, usize),
    (width, height): (usize, usize),
) -> Estimate {
    let half = (width / 2, height / 2);
    let (quarter_x, quarter_y) = ((width / 4) as isize, (height / 4) as isize);
    let (left, top) = (start(x, width), start(y, height));
    let (x, y) = (x as isize, y as isize);
    let mean_z = |start| {
        let (mut sum, mut count) = (0.0, 0_i32);
        for rect in image.rects(start, half) {
            for (x, y) in rect.pixels() {
                let z = points.z(x, y);
                if z.is_finite() {
                    sum += f64::from(rect.sign) * f64::from(z);
                    count += rect.sign;
                }
            }
        }
        // Counts are unsigned in PCL: one below zero is a very large one.
        (count != 0).then(|| sum / f64::from(count as u32))
    };
    let means = [
        mean_z((left, y - quarter_y)),
        mean_z((x + 1, y - quarter_y)),
        mean_z((x - quarter_x, top)),
        mean_z((x - quarter_x, y + 1)),
    ];
    let [Some(left_z), Some(right_z), Some(up_z), Some(down_z)] = means else {
        return Estimate::NONE;
    };
    let single = |(x, y)| {
        let (x, y) = image.pixel(x, y);
        points.at(x, y).map(f64::from)
    };
    let left = single((x - quarter_x - 1, y));
    let right = single((x + quarter_x + 1, y));
    let up = single((x - 1, y - quarter_y));
    let down = single((x + 1, y + quarter_y));
    let horizontal = [right[0] - left[0], right[1] - left[1], right_z - left_z];
    let vertical = [down[0] - up[0], down[1] - up[1], down_z - up_z];
    // In PCL's order, which differs from the other methods': it decides the sign where the surface is seen
    // exactly edge-on and the viewpoint does not.
    normal_of_tangents(horizontal, vertical)
}
