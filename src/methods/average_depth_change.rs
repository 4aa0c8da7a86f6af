//! AVERAGE_DEPTH_CHANGE: the paper's SDC (Eq. 9-15) as PCL computes it: mean depths of four half windows for the
//! tangents' z, single points for their x and y.

use super::{Estimate, is_length, normal_along, normal_of_tangents, start};
use crate::cloud::Points;
use crate::vector::{cross, dot};
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
        for (rect, sign) in image.rects(start, half) {
            for (x, y) in rect.pixels() {
                let z = points.z(x, y);
                if z.is_finite() {
                    sum += f64::from(sign) * f64::from(z);
                    count += sign;
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
    if half == (1, 1) {
        single_precision_normal(horizontal.map(|c| c as f32), vertical.map(|c| c as f32))
    } else {
        normal_of_tangents(horizontal, vertical)
    }
}

/// The normal of the smallest windows, rounded as PCL rounds it.
///
/// With half windows of one pixel both tangents have the same x and y, and all that is left of the cross product is
/// the difference of two nearly equal products. Its direction is that of f32's rounding in up to one normal of a
/// thousand, which is kept, as the half windows' depths are in f32 exactly what PCL has.
fn single_precision_normal(a: [f32; 3], b: [f32; 3]) -> Estimate {
    let n = cross(a, b);
    let squared_length = dot(n, n);
    if !is_length(squared_length.into()) {
        return Estimate::NONE;
    }
    if squared_length < f32::MIN_POSITIVE / f32::EPSILON {
        // Squares that small have few digits.
        return normal_along(n.map(f64::from));
    }
    let scale = 1.0 / squared_length.sqrt();
    Estimate { normal: n.map(|c| c * scale), curvature: f32::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::BorderPolicy;

    #[test]
    fn the_smallest_normals_have_unit_length() {
        for exponent in -24..=0 {
            let size = 10_f32.powi(exponent);
            let found = single_precision_normal([size, 0.0, 0.3 * size], [size, 0.0, 0.7 * size]);
            let length = found.normal.map(f64::from).map(|c| c * c).iter().sum::<f64>().sqrt();
            let is_one = (length - 1.0).abs() < 1e-6;
            // PCL's floats say that there is none where their squares are 0.
            assert!(is_one || exponent < -11 && length.is_nan(), "1e{exponent}: {length}");
        }
    }

    /// The right half window of a pixel of the last column takes away that column's depths, and of the others there is one:
    /// to PCL their mean is next to 0.
    #[test]
    fn a_count_below_zero_is_a_very_large_one() {
        let image = Image { width: 10, height: 6, border_policy: BorderPolicy::Mirror };
        let mut points: Vec<_> = (0..60).map(|i| [(i % 10) as f32, (i / 10) as f32, 1.0]).collect();
        for at in [26, 27, 28, 36, 37] {
            points[at][2] = f32::NAN;
        }
        let view = Points::interleaved(points.as_flattened(), 10, 6, 3, 0).unwrap();
        let [x, _, z] = estimate(&view, &image, (9, 3), (6, 4)).normal;
        // Along the row depth falls from 1 to next to 0, over the way in x between the two single points.
        let (left, right) = (points[37][0], points[38][0]);
        assert!((x.abs() - z.abs() / (right - left)).abs() < 1e-6, "{x} {z}");
    }
}
