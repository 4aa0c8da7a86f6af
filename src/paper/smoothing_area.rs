//! Step 3: the smoothing area map (the paper's B and R, Eq. 4, 5 and 8): the radius of every pixel's window.

use crate::options::PaperOptions;

/// The smallest depth change at a depth: f_DC (Eq. 4).
pub(crate) fn smallest_depth_change(depth: f32, options: &PaperOptions) -> f32 {
    options.alpha * depth * depth
}

/// Whether depths that differ by `difference` between pixels `gap` apart are a depth change apart (Eq. 6-7).
pub(crate) fn is_depth_change(
    depth: f32,
    difference: f32,
    gap: usize,
    options: &PaperOptions,
) -> bool {
    difference.abs() >= least_depth_change(depth, options) * gap as f32
}

/// The least difference between neighbours that is a depth change: t_DC.
pub(crate) fn least_depth_change(depth: f32, options: &PaperOptions) -> f32 {
    options.gamma * smallest_depth_change(depth, options)
}

/// The radius that the depth asks for, in pixels: B (Eq. 5), within the limits; NaN at a missing point.
pub(crate) fn depth_radius(depth: f32, options: &PaperOptions) -> f32 {
    let radius = options.beta * smallest_depth_change(depth, options);
    radius.clamp(options.least_depth_radius as f32, options.largest_radius as f32)
}

/// The radius of the smoothing area, in pixels: R (Eq. 8); 0 where it is too small for a window.
pub(crate) fn smoothing_radius(depth_radius: f32, distance: f32, options: &PaperOptions) -> f32 {
    let radius = depth_radius.min(distance / std::f32::consts::SQRT_2);
    if radius >= options.smallest_radius as f32 { radius } else { 0.0 }
}
