//! COVARIANCE_MATRIX: the paper's CM (Eq. 16-25): the eigenvector of the smallest eigenvalue of the window's
//! covariance matrix, and as curvature that eigenvalue over the matrix's trace.

use super::{Estimate, finite_point, start};
use crate::cloud::Points;
use crate::eigen::{Scatter, Symmetric3, eigen};
use crate::window::Image;

/// The plain form: the matrix about the window's mean, in two passes.
///
/// No normal if the window has no finite point, or only one place: then the curvature is 0, as in PCL.
pub(crate) fn estimate(
    points: &Points,
    image: &Image,
    (x, y): (usize, usize),
    (width, height): (usize, usize),
) -> Estimate {
    let window = (start(x, width), start(y, height));
    let rects = image.rects(window, (width, height));
    let pixels = || rects.clone().flat_map(|(rect, _)| rect.pixels());
    Scatter::of(|| pixels().filter_map(|pixel| finite_point(points, pixel)))
        .map_or(Estimate::NONE, |scatter| from_covariance(&scatter.matrix))
}

/// The estimate from a (scaled) covariance matrix.
fn from_covariance(covariance: &Symmetric3) -> Estimate {
    let trace = covariance.trace();
    if trace == 0.0 {
        return Estimate { normal: [f32::NAN; 3], curvature: 0.0 };
    }
    let (values, vector) = eigen(covariance);
    Estimate { normal: vector.map(|c| c as f32), curvature: (values[0] / trace) as f32 }
}
