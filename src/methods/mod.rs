//! Step 4: a normal from the points in a pixel's window. One file per method; this is their list.
//!
//! Each file gives the method plainly, walking over the window: the specification, to which the sums that integral images
//! give in constant time (`crate::fast`) are held.

pub(crate) mod average_3d_gradient;
pub(crate) mod average_depth_change;
pub(crate) mod covariance_matrix;
pub(crate) mod simple_3d_gradient;

use crate::cloud::Points;
use crate::options::Method;
use crate::vector::{cross, dot};
use crate::window::Image;

/// What a method finds: a normal that still may point away from the viewpoint, and a curvature.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    /// Unit length, or NaN if the window's points span no plane.
    pub normal: [f32; 3],
    /// NaN for methods that give none.
    pub curvature: f32,
}

impl Estimate {
    pub const NONE: Estimate = Estimate { normal: [f32::NAN; 3], curvature: f32::NAN };
}

impl From<[f32; 4]> for Estimate {
    fn from([x, y, z, curvature]: [f32; 4]) -> Self {
        Estimate { normal: [x, y, z], curvature }
    }
}

impl From<Estimate> for [f32; 4] {
    fn from(Estimate { normal: [x, y, z], curvature }: Estimate) -> Self {
        [x, y, z, curvature]
    }
}

/// The estimate of pixel `(x, y)` from a window of any `size` (width, height), by walking over the window.
pub(crate) fn estimate_window(
    method: Method,
    points: &Points,
    image: &Image,
    pixel: (usize, usize),
    size: (usize, usize),
) -> Estimate {
    match method {
        Method::CovarianceMatrix => covariance_matrix::estimate(points, image, pixel, size),
        Method::Average3DGradient => average_3d_gradient::estimate(points, image, pixel, size),
        Method::AverageDepthChange => average_depth_change::estimate(points, image, pixel, size),
        Method::Simple3DGradient => simple_3d_gradient::estimate(points, image, pixel, size),
    }
}

/// The first column or row of a window of `side` around a pixel: even sides reach one pixel less to the far side.
#[inline(always)]
pub(crate) fn start(center: usize, side: usize) -> isize {
    center as isize - (side / 2) as isize
}

#[inline(always)]
pub(crate) fn is_finite(point: [f32; 3]) -> bool {
    let [x, y, z] = point.map(f32::is_finite);
    x & y & z
}

/// A pixel's point in double precision, if it is finite.
pub(crate) fn finite_point(points: &Points, (x, y): (usize, usize)) -> Option<[f64; 3]> {
    let point = points.at(x, y);
    is_finite(point).then(|| point.map(f64::from))
}

/// Whether a vector of such a length, or square of one, has a direction.
pub(crate) fn is_length(length: f64) -> bool {
    0.0 < length && length < f64::INFINITY
}

/// The unit vector along the cross product of two tangents; none if they are parallel or not finite.
#[inline(always)]
pub(crate) fn normal_of_tangents(first: [f64; 3], second: [f64; 3]) -> Estimate {
    normal_along(cross(first, second))
}

/// The unit vector of a direction; none if this has no length.
#[inline(always)]
fn normal_along(direction: [f64; 3]) -> Estimate {
    let squared_length = dot(direction, direction);
    if !is_length(squared_length) {
        return Estimate::NONE;
    }
    let length = squared_length.sqrt();
    Estimate { normal: direction.map(|c| (c / length) as f32), curvature: f32::NAN }
}
