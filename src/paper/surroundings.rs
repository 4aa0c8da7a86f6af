//! The last resort of a pixel whose surface has no window: the plane through the points around it.

use super::cloud::{CleanPoints, Cloud};
use super::methods::plane_of;
use super::rect::Rect;
use crate::methods::Estimate;

/// How far around: fewer points are mostly noise.
const REACH: usize = 3;

/// The plane through the points around a pixel that `is_same_surface(depth, difference, distance)` lets through.
pub(crate) fn plane_around(
    cloud: &Cloud,
    (x, y): (usize, usize),
    is_same_surface: impl Fn(f32, f32, usize) -> bool,
) -> Option<Estimate> {
    let depth = cloud.depths[cloud.index(x, y)];
    let around = Rect::around((x, y), REACH, (cloud.width, cloud.height));
    let is_same = |&(nx, ny): &(usize, usize)| {
        let other = cloud.depths[cloud.index(nx, ny)];
        let distance = x.abs_diff(nx).max(y.abs_diff(ny));
        !other.is_nan() && is_same_surface(depth, other - depth, distance)
    };
    plane_of(|| around.pixels().filter(is_same).map(|(nx, ny)| cloud.at(nx, ny).map(f64::from)))
}
