//! Even windows: around every pixel the largest window whose points lie in one plane as well as chance allows.
//!
//! A pixel beside a depth change or a crease is in the middle of no large window that lies on one surface, but it is
//! at the edge or in the corner of some, which are the even windows of pixels nearby. It takes the normal of the one
//! that is worth most to it: of that which leaves the smallest error in the slope of a plane through its points.
//! Noise of variance v in n points leaves 12 v / (n L^2) in a window of side L; points that do not lie in the
//! window's plane, or a pixel that does not, bend it by some share of their deviation over L.

use super::cloud::Cloud;
use super::planes::{InverseDepths, Plane};
use super::rect::Rect;

/// Inverse depths that deviate less than this many alpha from a plane are as good as in it.
const EVEN: f64 = 0.02;
/// Small samples have, by chance, variances below the noise's. A window is even if its variance is at most this many
/// standard deviations of a sample's variance above that of the window of half its radius; and the noise's variance is
/// taken to be as far above the least one of all windows that a pixel can take.
const CHANCE: f64 = 3.0;
/// What the part of a window's variance that is not noise counts.
const MISFIT: f64 = 3.0;
/// What the squared distance of the points next to the pixel from the window's plane counts, where it is more than
/// `NEAR_NOISE` variances of their mean.
const NEAR: f64 = 9.0;
const NEAR_NOISE: f64 = 4.0;
/// On steep surfaces the sensor's noise along the rows and columns looks like depth changes. A window with some is
/// still on one surface if its points deviate from the plane by less than the plane changes in this many pixels:
/// across a true change it would be side / 6 pixels, so the window must have at least `JAGGED_RADIUS` and
/// `JAGGED_POINTS` of its points.
const JAGGED: f64 = 1.4;
const JAGGED_RADIUS: usize = 2;
const JAGGED_POINTS: f64 = 0.8;
/// How many pixels beyond its window's edge a plane may be taken for a pixel's: outlines are ragged.
const REACH: usize = 3;
/// The sensor's noise along rows and columns, in pixels: it moves a point off a steep plane.
const JITTER: f64 = 4.0;

/// From a pixel to the middles of the windows that have it at the middle of an edge or in a corner, in radii.
const PLACES: [(isize, isize); 8] =
    [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];

/// Every pixel's even window.
pub(crate) struct EvenWindows<'a> {
    cloud: &'a Cloud,
    inverse: &'a InverseDepths,
    clean: &'a [u32],
    /// Row by row; 0 for none.
    radii: Vec<u32>,
    /// Row by row; of any value where there is no window.
    planes: Vec<Plane>,
    /// The smallest variance that is told from none.
    least_noise: f64,
}

/// The largest radius that an even window may have, where the depth asks for another one: twice that, since whether
/// a pixel is on one side of a crease or on the other is told from less noise then.
pub(crate) fn largest_radius(wanted: usize, limit: usize) -> usize {
    (2 * wanted).min(limit).max(wanted)
}

impl<'a> EvenWindows<'a> {
    /// The windows of pixels whose depth asks for the radius `wanted`, 0 for a missing point; windows up to the
    /// radius `clean` have no depth change. None of a radius above `limit` unless it is wanted.
    pub fn new(
        cloud: &'a Cloud,
        inverse: &'a InverseDepths,
        clean: &'a [u32],
        wanted: impl Fn(usize) -> usize,
        limit: usize,
        alpha: f32,
    ) -> Self {
        let size = (cloud.width, cloud.height);
        let least_noise = (EVEN * f64::from(alpha)).powi(2);
        let of_pixel = |at: usize| {
            let pixel = (at % cloud.width, at / cloud.width);
            let plane = |radius: usize| inverse.plane(&Rect::around(pixel, radius, size));
            let (wanted, clean) = (wanted(at), clean[at] as usize);
            let jagged = |radius: usize| {
                let is_jagged = |plane: &Plane| {
                    let points = Rect::around(pixel, radius, size).area() as f64;
                    plane.unevenness <= (JAGGED * plane.steepness()).powi(2)
                        && plane.points >= JAGGED_POINTS * points
                };
                Some((radius, plane(radius).filter(is_jagged)?))
            };
            let smaller = |radius: &usize| Some(radius * 7 / 10);
            let radii = std::iter::successors(Some(wanted), smaller)
                .take_while(|radius| *radius > clean && *radius >= JAGGED_RADIUS);
            if let Some(window) = radii.into_iter().find_map(jagged) {
                return Some(window);
            }
            let mut radius = largest_radius(wanted, limit).min(clean);
            let mut found = plane(radius)?;
            while radius > 1
                && let Some(half) = plane(radius / 2)
                && found.unevenness > half.noise(CHANCE).max(least_noise)
            {
                (radius, found) = (radius / 2, half);
            }
            Some((radius, found))
        };
        let windows = (0..size.0 * size.1).map(|at| {
            let (radius, plane) = of_pixel(at).unwrap_or_default();
            (radius as u32, plane)
        });
        let (radii, planes) = windows.unzip();
        EvenWindows { cloud, inverse, clean, radii, planes, least_noise }
    }

    /// The radius of a pixel's window; 0 for none.
    pub fn radius(&self, at: usize) -> u32 {
        self.radii[at]
    }

    /// The pixel whose window is worth most to `pixel`, among itself and those at the places of windows of these
    /// radii; none if there is none. Windows that end short of the pixel are taken if its point, or in inverse depth
    /// one within `tolerance` of it, lies in their plane. `found` is scratch memory.
    pub fn best(
        &self,
        (x, y): (usize, usize),
        radii: impl Iterator<Item = usize>,
        tolerance: f64,
        found: &mut Vec<usize>,
    ) -> Option<usize> {
        let cloud = self.cloud;
        let distance =
            |other: usize| x.abs_diff(other % cloud.width).max(y.abs_diff(other / cloud.width));
        let own = cloud.index(x, y);
        let at =
            |from: usize, step: isize, size: usize| from.saturating_add_signed(step).min(size - 1);
        let around = radii.flat_map(|radius| {
            PLACES.into_iter().map(move |(px, py)| (px * radius as isize, py * radius as isize))
        });
        let around =
            around.map(|(dx, dy)| cloud.index(at(x, dx, cloud.width), at(y, dy, cloud.height)));
        found.clear();
        found.extend(std::iter::once(own).chain(around).filter(|&other| {
            let radius = self.radii[other] as usize;
            radius > 0 && distance(other) <= radius + REACH
        }));

        let noise = found.iter().map(|&other| self.planes[other].noise(CHANCE));
        let noise = noise.fold(f64::INFINITY, f64::min).max(self.least_noise);
        let size = (cloud.width, cloud.height);
        let near =
            self.inverse.mean(&Rect::around((x, y), self.clean[own].min(1) as usize, size))?;
        let point = 1.0 / f64::from(cloud.depths[own]);
        let mut best: Option<(f64, usize)> = None;
        for &other in found.iter() {
            let plane = &self.planes[other];
            let radius = self.radii[other] as usize;
            let length = (2 * radius + 1) as f64;
            let astray = near.inverse_depth - plane.at(near.position);
            let astray = (astray * astray - NEAR_NOISE * noise / near.points).max(0.0);
            let misfit = (plane.unevenness - noise).max(0.0);
            let bend = MISFIT * misfit + NEAR * astray;
            let mut cost = (12.0 * noise / plane.points + bend) / (length * length);
            let short = distance(other).saturating_sub(radius);
            if short > 0 {
                cost *= (1 + short * short) as f64;
                let off = point - plane.at([x as f64, y as f64]);
                if off.abs() > tolerance + JITTER * plane.steepness() {
                    continue;
                }
            }
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, other));
            }
        }
        best.map(|(_, other)| other)
    }
}
