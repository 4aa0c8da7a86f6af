//! Windows on one side of a depth change, for the pixels that the smoothing area map leaves with a small one or none.
//!
//! Such a pixel stands in the middle of its window's edge or in its corner, so that the window lies on the pixel's
//! own surface. Where the outline of a surface is too ragged even for that, the pixel takes the normal of a pixel
//! nearby, if it lies in its plane; and where there is none, the plane through the points around it.

use super::Window;
use super::candidates::{Candidates, Choice};
use super::cloud::{CleanPoints, Cloud};
use super::methods::plane_of;
use super::rect::Rect;
use crate::methods::Estimate;

/// The side of the smallest window that is tried.
const SMALLEST_SIDE: usize = 3;

/// The sides to try, from the one that the pixel would have far from any depth change.
fn sides(wanted: usize) -> impl Iterator<Item = usize> + Clone {
    let smaller = |side: &usize| {
        let next = (side * 7 / 10) | 1;
        (*side > SMALLEST_SIDE).then(|| next.min(side - 2).max(SMALLEST_SIDE))
    };
    std::iter::successors(Some(wanted.max(SMALLEST_SIDE)), smaller)
}

/// Every pixel's window and plane after this stage; none where there is no window.
pub(crate) struct OneSided {
    pub choices: Vec<Option<Choice>>,
    /// Whether the pixel's window is one of this stage.
    pub moved: Vec<bool>,
}

impl OneSided {
    /// The best windows of the pixels whose own is smaller than they want.
    pub fn new(cloud: &Cloud, candidates: &Candidates, windows: &[Window]) -> Self {
        let mut found = Vec::new();
        let mut stage = OneSided {
            choices: Vec::with_capacity(windows.len()),
            moved: Vec::with_capacity(windows.len()),
        };
        for (at, Window { rect, wanted_side }) in windows.iter().enumerate() {
            let pixel = (at % cloud.width, at / cloud.width);
            let own = rect.as_ref().filter(|rect| rect.side() >= *wanted_side);
            let moved = own.is_none() && !cloud.is_missing(at);
            stage.moved.push(moved);
            stage.choices.push(match own {
                Some(rect) => {
                    candidates.planes.plane(rect).map(|plane| Choice::of_noise(rect, plane))
                }
                None if moved => candidates.best(pixel, sides(*wanted_side), &mut found),
                None => None,
            });
        }
        stage
    }

    /// Whether a pixel's window is so small that a neighbour's may serve it better.
    pub fn is_poor(&self, at: usize, wanted_side: usize) -> bool {
        let side = self.choices[at].as_ref().map_or(0, |choice| choice.rect.side());
        self.moved[at] && 2 * side <= wanted_side
    }

    /// The estimate of the best pixel nearby, or of the pixel itself, in whose plane the pixel's point lies within
    /// `tolerance` of its inverse depth; none if there is none.
    pub fn adopted(
        &self,
        cloud: &Cloud,
        candidates: &Candidates,
        estimates: &[Estimate],
        (x, y): (usize, usize),
        tolerance: f64,
    ) -> Option<Estimate> {
        let inverse_depth = 1.0 / f64::from(cloud.depths[cloud.index(x, y)]);
        let mut best: Option<(f64, bool, usize)> = None;
        for (nx, ny) in Rect::around((x, y), REACH, candidates.size).pixels() {
            let other = cloud.index(nx, ny);
            let Some(Choice { rect, plane, cost }) = &self.choices[other] else { continue };
            if estimates[other].normal[0].is_nan() {
                continue;
            }
            let length = rect.side() as f64;
            let noise = cost * plane.points * length * length / 12.0;
            let noise = noise.min(plane.unevenness).max(candidates.least_noise());
            let distance = inverse_depth - plane.at([x as f64, y as f64]);
            let astray = (distance * distance - noise).max(0.0);
            let far = (x.abs_diff(nx).pow(2) + y.abs_diff(ny).pow(2)) as f64;
            let cost = cost * (1.0 + far) + ASTRAY * astray / (length * length);
            let lies_in = distance.abs() <= tolerance + JITTER * plane.steepness();
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, lies_in, other));
            }
        }
        best.filter(|(_, lies_in, _)| *lies_in).map(|(.., other)| estimates[other])
    }
}

/// How far away, in pixels along a row or column, a pixel looks for a normal that it can take over.
const REACH: usize = 3;
/// What the squared distance of a point from the plane counts, where it is more than noise.
const ASTRAY: f64 = 9.0;
/// The sensor's noise along rows and columns, in pixels: it moves a point off a steep plane.
const JITTER: f64 = 4.0;

/// The plane through the points around a pixel that `is_same_surface(depth, difference, distance)` lets through:
/// within 1 px, or 2 px if those are on one line.
pub(crate) fn plane_around(
    cloud: &Cloud,
    (x, y): (usize, usize),
    is_same_surface: impl Fn(f32, f32, usize) -> bool,
) -> Option<Estimate> {
    let depth = cloud.depths[cloud.index(x, y)];
    (1..=2).find_map(|reach| {
        let points = Rect::around((x, y), reach, (cloud.width, cloud.height));
        let is_same = |&(nx, ny): &(usize, usize)| {
            let other = cloud.depths[cloud.index(nx, ny)];
            let distance = x.abs_diff(nx).max(y.abs_diff(ny));
            !other.is_nan() && is_same_surface(depth, other - depth, distance)
        };
        plane_of(|| points.pixels().filter(is_same).map(|(nx, ny)| cloud.at(nx, ny).map(f64::from)))
    })
}
