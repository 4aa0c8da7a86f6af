//! Step 4: a normal from the points in a rectangle. Plain forms, walking over it; sums over finite points only.

use super::cloud::Cleaned;
use crate::eigen::{Scatter, eigen};
use crate::methods::{Estimate, normal_of_tangents};
use crate::options::Method;
use crate::rect::{Rect, are_in_line};
use crate::vector::{difference, sum};

/// The estimate of a method of the paper; of SIMPLE_3D_GRADIENT, which it does not have, by the 3-D gradient.
pub(crate) fn estimate(method: Method, cloud: &Cleaned, rect: &Rect) -> Estimate {
    match method {
        Method::AverageDepthChange => smoothed_depth_changes(cloud, rect),
        Method::Average3DGradient | Method::Simple3DGradient => gradients(cloud, rect),
        Method::CovarianceMatrix => covariance_matrix(cloud, rect).unwrap_or(Estimate::NONE),
    }
}

/// CM (Eq. 16-25). None if the points are on one line, in the image or in space.
fn covariance_matrix(cloud: &Cleaned, rect: &Rect) -> Option<Estimate> {
    if are_in_line(pixels_there(cloud, rect)) {
        return None;
    }
    plane_of(|| cloud.finite(rect.clone()))
}

/// The eigenvector of the smallest eigenvalue of the points' covariance matrix, and that eigenvalue over the trace as
/// curvature. None if the points are on one line.
pub(crate) fn plane_of<I: Iterator<Item = [f64; 3]>>(points: impl Fn() -> I) -> Option<Estimate> {
    let Scatter { matrix, count, .. } = Scatter::of(points)?;
    if count < 3.0 {
        return None;
    }
    let (values, vector) = eigen(&matrix);
    let trace = matrix.trace();
    // Rounding keeps points on a line from a middle eigenvalue of exactly 0.
    const LINE: f64 = 1e-12;
    if values[1] <= LINE * trace {
        return None;
    }
    Some(Estimate { normal: vector.map(|c| c as f32), curvature: (values[0] / trace) as f32 })
}

/// The 3-D gradient method: the cross product of the mean central differences of the points.
fn gradients(cloud: &Cleaned, rect: &Rect) -> Estimate {
    let horizontal = mean_difference(cloud, rect, (1, 0));
    let vertical = mean_difference(cloud, rect, (0, 1));
    vertical.zip(horizontal).map_or(Estimate::NONE, |(v, h)| normal_of_tangents(v, h))
}

/// SDC (Eq. 9-15): tangents whose x and y are differences of the outermost points of the middle row or column, and
/// whose z is the mean central difference of the depths.
///
/// In a whole window of radius r the difference of the means over radius r - 1 around (m + 1, n) and (m - 1, n) in
/// Eq. 12 is the mean of z(m + 1, n) - z(m - 1, n) over radius r - 1 around (m, n); said so, it stays right where
/// points are missing. As printed, x and y span 2r pixels where z spans 2, which tilts every normal but a frontal
/// one; here z is extended to the pixels that x and y span.
fn smoothed_depth_changes(cloud: &Cleaned, rect: &Rect) -> Estimate {
    let (column, row) = rect.middle();
    let horizontal = tangent(cloud, rect, &Rect { y: row..row + 1, ..rect.clone() }, (1, 0));
    let vertical = tangent(cloud, rect, &Rect { x: column..column + 1, ..rect.clone() }, (0, 1));
    vertical.zip(horizontal).map_or(Estimate::NONE, |(v, h)| normal_of_tangents(v, h))
}

/// The tangent along a line of a rectangle: x and y from its outermost points, z from the mean difference across two pixels.
fn tangent(cloud: &Cleaned, rect: &Rect, line: &Rect, step: (usize, usize)) -> Option<[f64; 3]> {
    let mut there = pixels_there(cloud, line);
    let (from, to) = (there.next()?, there.last()?);
    let length = to.0 - from.0 + to.1 - from.1;
    let slope = mean_difference(cloud, rect, step)?[2] / 2.0;
    let [from, to] = [from, to].map(|(x, y)| cloud.at(x, y).map(f64::from));
    let [x, y, _] = difference(to, from);
    Some([x, y, slope * length as f64])
}

/// The mean of P(m + step) - P(m - step) over the pixels m inside the rectangle's outermost rows and columns, where
/// both points are finite; none if there is no such pair.
fn mean_difference(cloud: &Cleaned, rect: &Rect, (dx, dy): (usize, usize)) -> Option<[f64; 3]> {
    let (mut total, mut count) = ([0.0; 3], 0.0);
    for (x, y) in rect.inner().pixels() {
        let (ahead, behind) = (cloud.at(x + dx, y + dy), cloud.at(x - dx, y - dy));
        if ahead[2].is_nan() || behind[2].is_nan() {
            continue;
        }
        total = sum(total, difference(ahead.map(f64::from), behind.map(f64::from)));
        count += 1.0;
    }
    (count > 0.0).then(|| total.map(|total| total / count))
}

/// The pixels of a rectangle that have a point.
fn pixels_there<'a>(cloud: &'a Cleaned, rect: &Rect) -> impl Iterator<Item = (usize, usize)> + 'a {
    rect.pixels().filter(|(x, y)| !cloud.at(*x, *y)[2].is_nan())
}
