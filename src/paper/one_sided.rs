//! Windows on one side of a depth change, for the pixels that the smoothing area map leaves with a small one or none.
//!
//! Such a pixel stands in the middle of its window's edge or in its corner, so that the window lies on the pixel's
//! own surface. Where the outline of a surface is too ragged even for that, the pixel takes the normal of a pixel
//! nearby, if it lies in its tangent plane; and where there is none, the plane through the points around it.

use super::cloud::{CleanPoints, Cloud};
use super::depth_change::SummedChanges;
use super::methods::plane_of;
use super::rect::Rect;
use super::summed_area::SummedArea;
use crate::methods::Estimate;

/// Where in its window a pixel stands: in the middle, at the middle of an edge, in a corner.
const PLACES: [(i8, i8); 9] =
    [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];

/// The side of the smallest window that is tried.
const SMALLEST_SIDE: usize = 3;

/// The next smaller side to try.
pub(crate) fn smaller(side: usize) -> Option<usize> {
    (side > SMALLEST_SIDE).then(|| ((side * 3 / 4) | 1).max(SMALLEST_SIDE))
}

/// The nine windows of a side that have the pixel in one of its places; at the border of the image they are moved
/// inside.
pub(crate) fn windows(
    (x, y): (usize, usize),
    side: usize,
    width: usize,
    height: usize,
) -> impl Iterator<Item = Rect> {
    let range = move |at: usize, place: i8, size: usize| {
        let side = side.min(size);
        let start = match place {
            0 => at.saturating_sub(side / 2),
            1 => at,
            _ => (at + 1).saturating_sub(side),
        };
        let start = start.min(size - side);
        start..start + side
    };
    PLACES.into_iter().map(move |(px, py)| Rect { x: range(x, px, width), y: range(y, py, height) })
}

/// The largest window without a depth change that has the pixel in one of the nine places, `side` pixels or less on
/// a side; of those, the one with the most finite points.
pub(crate) fn window(
    cloud: &Cloud,
    changes: &SummedChanges,
    finite: &SummedArea<u32, 1>,
    pixel: (usize, usize),
    side: usize,
) -> Option<Rect> {
    let mut side = Some(side.max(SMALLEST_SIDE));
    while let Some(tried) = side {
        let mut best: Option<(u32, Rect)> = None;
        for rect in windows(pixel, tried, cloud.width, cloud.height) {
            let [points] = finite.sum(&rect);
            if best.as_ref().is_none_or(|(most, _)| points > *most) && changes.none_in(&rect) {
                best = Some((points, rect));
            }
        }
        if let Some((_, rect)) = best {
            return Some(rect);
        }
        side = smaller(tried);
    }
    None
}

/// How far away, in pixels along a row or column, a pixel looks for a normal that it can take over.
const REACH: usize = 3;

/// The normal of the nearest pixel that is `good` and in whose tangent plane the pixel's point lies, within
/// `tolerance`; of equally near ones the one whose plane is nearest.
pub(crate) fn adopted(
    cloud: &Cloud,
    estimates: &[Estimate],
    good: impl Fn(usize) -> bool,
    (x, y): (usize, usize),
    tolerance: f64,
) -> Option<Estimate> {
    let point = cloud.at(x, y).map(f64::from);
    let mut best: Option<(usize, f64, Estimate)> = None;
    for (nx, ny) in around((x, y), REACH, cloud).pixels() {
        let at = cloud.index(nx, ny);
        if !good(at) {
            continue;
        }
        let (other, normal) = (cloud.points[at].map(f64::from), estimates[at].normal);
        let offset: f64 = (0..3).map(|i| f64::from(normal[i]) * (point[i] - other[i])).sum();
        let far = x.abs_diff(nx).pow(2) + y.abs_diff(ny).pow(2);
        let nearer = best.as_ref().is_none_or(|(best_far, best_offset, _)| {
            (far, offset.abs()) < (*best_far, *best_offset)
        });
        if offset.abs() <= tolerance && nearer {
            best = Some((far, offset.abs(), estimates[at]));
        }
    }
    best.map(|(_, _, estimate)| estimate)
}

/// The plane through the points around a pixel that `is_same_surface(depth, difference, distance)` lets through:
/// within 1 px, or 2 px if those are on one line.
pub(crate) fn plane_around(
    cloud: &Cloud,
    (x, y): (usize, usize),
    is_same_surface: impl Fn(f32, f32, usize) -> bool,
) -> Option<Estimate> {
    let depth = cloud.depths[cloud.index(x, y)];
    (1..=2).find_map(|reach| {
        let points = around((x, y), reach, cloud).pixels().collect::<Vec<_>>();
        let same = points.into_iter().filter(|&(nx, ny)| {
            let other = cloud.depths[cloud.index(nx, ny)];
            let distance = x.abs_diff(nx).max(y.abs_diff(ny));
            !other.is_nan() && is_same_surface(depth, other - depth, distance)
        });
        plane_of(same.map(|(nx, ny)| cloud.at(nx, ny).map(f64::from))).map(|plane| plane.0)
    })
}

fn around((x, y): (usize, usize), reach: usize, cloud: &Cloud) -> Rect {
    let clip = |at: usize, size: usize| at.saturating_sub(reach)..(at + reach + 1).min(size);
    Rect { x: clip(x, cloud.width), y: clip(y, cloud.height) }
}
