//! COVARIANCE_MATRIX: the paper's CM (Eq. 16-25): the eigenvector of the smallest eigenvalue of the window's
//! covariance matrix, and as curvature that eigenvalue over the matrix's trace.

use super::{Estimate, is_finite, start};
use crate::cloud::Points;
use crate::eigen::{Symmetric3, eigen, smallest_eigenpair};
use crate::window::Image;

/// The plain form: the matrix about the window's mean, in two passes.
///
/// No normal if the window has no finite point, or only one place: then the curvature is 0, as in PCL.
pub(crate) fn estimate(
    points: &Points,
    image: &Image,
    pixel: (usize, usize),
    size: (usize, usize),
) -> Estimate {
    scatter(points, image, pixel, size).map_or(Estimate::NONE, |found| from_covariance(&found.0))
}

/// The eigenvalues of the window's covariance matrix, ascending; none if the window has no finite point.
pub(crate) fn eigenvalues(
    points: &Points,
    image: &Image,
    pixel: (usize, usize),
    size: (usize, usize),
) -> Option<[f64; 3]> {
    let (scatter, count) = scatter(points, image, pixel, size)?;
    Some(eigen(&scatter).0.map(|value| value / count))
}

/// The covariance matrix times the number of finite points, and that number.
fn scatter(
    points: &Points,
    image: &Image,
    (x, y): (usize, usize),
    (width, height): (usize, usize),
) -> Option<(Symmetric3, f64)> {
    let window = (start(x, width), start(y, height));
    let rects = image.rects(window, (width, height));
    let pixels = || rects.clone().flat_map(|rect| rect.pixels());
    let finite = |(x, y)| Some(points.at(x, y)).filter(|point| is_finite(*point));
    Symmetric3::scatter(|| pixels().filter_map(finite).map(|point| point.map(f64::from)))
}

/// The estimate from a (scaled) covariance matrix.
fn from_covariance(covariance: &Symmetric3) -> Estimate {
    let trace = covariance.trace();
    if trace == 0.0 {
        return Estimate { normal: [f32::NAN; 3], curvature: 0.0 };
    }
    let (value, vector) = smallest_eigenpair(covariance);
    Estimate { normal: vector.map(|c| c as f32), curvature: (value / trace) as f32 }
}
