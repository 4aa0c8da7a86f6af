//! Step 5: normals are turned towards the viewpoint.

use crate::methods::Estimate;
use crate::vector::{difference, dot};

/// The estimate, its normal turned so that (viewpoint - point) . normal is not negative; in f32, as PCL's
/// `flipNormalTowardsViewpoint`.
#[inline(always)]
pub(crate) fn turn_to_viewpoint(
    Estimate { normal, curvature }: Estimate,
    point: [f32; 3],
    viewpoint: [f32; 3],
) -> Estimate {
    let sign = if dot(difference(viewpoint, point), normal) < 0.0 { -1.0 } else { 1.0 };
    Estimate { normal: normal.map(|c| c * sign), curvature }
}
