//! Even windows: around every pixel the largest window whose points lie in one plane as well as chance allows.
//!
//! A pixel beside a depth change or a crease is in the middle of no large window that lies on one surface, but it is
//! at the edge or in the corner of some, which are the even windows of pixels nearby. It takes the normal of the one
//! that is worth most to it: of that which leaves the smallest error in the slope of a plane through its points.
//! Noise of variance v in n points leaves 12 v / (n L^2) in a window of side L; points that do not lie in the
//! window's plane, or a pixel that does not, bend it by some share of their deviation over L.

use super::cloud::Cloud;
use super::planes::{JITTER, Plane, inverse_depth};
use super::rect::Rect;
use crate::options::Options;

/// Inverse depths that deviate less than this many alpha from a plane are as good as in it.
const EVEN: f32 = 0.02;
/// Small samples have, by chance, variances below the noise's. A window is even if its variance is at most this many
/// standard deviations of a sample's variance above that of the window of half its radius; and the noise's variance is
/// taken to be as far above the least one of all windows that a pixel can take.
pub(crate) const CHANCE: f32 = 3.0;
/// What the part of a window's variance that is not noise counts.
pub(crate) const MISFIT: f32 = 3.0;
/// What the squared distance of the points next to the pixel from the window's plane counts, where it is more than
/// `NEAR_NOISE` variances of their mean.
pub(crate) const NEAR: f32 = 9.0;
pub(crate) const NEAR_NOISE: f32 = 4.0;
/// On steep surfaces the sensor's noise along the rows and columns looks like depth changes. A window with some is
/// still on one surface if its points deviate from the plane by less than the plane changes in this many pixels:
/// across a true change it would be side / 6 pixels, so the window must have at least `JAGGED_RADIUS` and
/// `JAGGED_POINTS` of its points.
pub(crate) const JAGGED: f64 = 1.4;
pub(crate) const JAGGED_RADIUS: u32 = 2;
pub(crate) const JAGGED_POINTS: f64 = 0.8;
/// How many pixels beyond its window's edge a plane may be taken for a pixel's: outlines are ragged.
pub(crate) const REACH: f32 = 3.0;

/// A pixel's even window, and what it is worth.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)] // Eight floats, which the fast form reads as such.
pub(crate) struct EvenWindow {
    /// A whole number; 0 for no window.
    pub radius: f32,
    /// The plane's inverse depth at the pixel, and its change per pixel to the right and down.
    pub inverse_depth: f32,
    pub slope: [f32; 2],
    /// The mean square deviation from the plane, and the variance that it may be of.
    pub unevenness: f32,
    pub noise: f32,
    /// What one of noise and one of bend count.
    pub per_noise: f32,
    pub per_bend: f32,
}

/// What windows are asked for, row by row.
pub(crate) struct Asked<'a> {
    /// The radius that the depth asks for, at most `limit`; 0 at a missing point.
    pub wanted: &'a [u32],
    /// From how many radii the windows come that the pixel can take, starting with the largest and halving it; 0 for a
    /// pixel that takes none.
    pub levels: &'a [u8],
    /// The largest radius of a window without a depth change.
    pub clean: &'a [u32],
    /// The largest radius of all.
    pub limit: u32,
    /// The smallest variance that is told from none.
    pub least_noise: f32,
}

impl Asked<'_> {
    /// The largest radius that a pixel's window may have: twice the wanted one, since whether a pixel is on one side
    /// of a crease or on the other is told from less noise then.
    pub fn largest(&self, at: usize) -> u32 {
        (2 * self.wanted[at]).min(self.limit)
    }

    /// The radii of the windows around the pixel that it can take.
    pub fn radii(&self, at: usize) -> impl Iterator<Item = u32> + use<> {
        let (largest, levels) = (self.largest(at), u32::from(self.levels[at]));
        (0..levels).map(move |level| largest >> level).take_while(|radius| *radius > 0)
    }

    /// Whether some pixel can take a pixel's window, row by row.
    pub fn needed(&self, width: usize, height: usize) -> Vec<bool> {
        let mut needed = vec![false; width * height];
        for at in (0..width * height).filter(|at| self.levels[*at] > 0) {
            let pixel = (at % width, at / width);
            for_each_place(pixel, (width, height), self.radii(at), |dx, dy| {
                needed[at.wrapping_add_signed(dy * width as isize + dx)] = true;
            });
        }
        needed
    }

    /// The variance told from none where the sensor's smallest depth change is `alpha`.
    pub fn least_noise(alpha: f32) -> f32 {
        (EVEN * alpha).powi(2)
    }
}

/// The even windows of the needed pixels, row by row: the plain form.
pub(crate) fn even_windows<'a>(
    cloud: &'a Cloud,
    asked: &'a Asked,
    needed: &'a [bool],
) -> impl Iterator<Item = EvenWindow> + 'a {
    let pixels = (0..cloud.height).flat_map(move |y| (0..cloud.width).map(move |x| (x, y)));
    let window = move |(pixel, needed): (_, &bool)| {
        needed.then(|| even_window(cloud, asked, pixel)).flatten().unwrap_or_default()
    };
    pixels.zip(needed).map(window)
}

fn even_window(cloud: &Cloud, asked: &Asked, pixel: (usize, usize)) -> Option<EvenWindow> {
    let at = cloud.index(pixel.0, pixel.1);
    let (wanted, clean) = (asked.wanted[at], asked.clean[at]);
    let rect = |radius: u32| Rect::around(pixel, radius as usize, (cloud.width, cloud.height));
    let plane = |radius: u32| Plane::of(cloud, &rect(radius));
    let jagged = |radius: u32| {
        let plane = plane(radius)?;
        let is_jagged = plane.unevenness <= JAGGED * JAGGED * plane.steepness_squared()
            && plane.points >= JAGGED_POINTS * rect(radius).area() as f64;
        is_jagged.then_some((radius, plane))
    };
    let radii = std::iter::successors(Some(wanted), |radius| Some(radius * 7 / 10));
    let mut radii = radii.take_while(|radius| *radius > clean && *radius >= JAGGED_RADIUS);
    let noise = |plane: &Plane| {
        let chance = (2.0 / (plane.points as f32 - 3.0)).sqrt();
        plane.unevenness * f64::from(1.0 + CHANCE * chance)
    };
    let (radius, plane) = radii.find_map(jagged).or_else(|| {
        let mut radius = asked.largest(at).min(clean);
        let mut found = plane(radius)?;
        while radius > 1
            && let Some(half) = plane(radius / 2)
            && found.unevenness > noise(&half).max(f64::from(asked.least_noise))
        {
            (radius, found) = (radius / 2, half);
        }
        Some((radius, found))
    })?;
    let [x, y] = [pixel.0, pixel.1].map(|at| at as f64);
    Some(EvenWindow {
        inverse_depth: plane.at([x, y]) as f32,
        slope: plane.slope.map(|slope| slope as f32),
        unevenness: plane.unevenness as f32,
        noise: noise(&plane) as f32,
        ..EvenWindow::worth(radius, plane.points as f32)
    })
}

impl EvenWindow {
    /// A window of a radius with so many points.
    pub fn worth(radius: u32, points: f32) -> Self {
        let radius = radius as f32;
        let side = 2.0 * radius + 1.0;
        let per_bend = 1.0 / (side * side);
        EvenWindow { radius, per_noise: 12.0 / points * per_bend, per_bend, ..Self::default() }
    }
}

/// The even windows that are needed, to choose from.
pub(crate) struct EvenWindows<'a> {
    pub cloud: &'a Cloud,
    pub asked: &'a Asked<'a>,
    pub options: &'a Options,
    /// Row by row.
    pub windows: &'a [EvenWindow],
}

impl EvenWindows<'_> {
    /// The radius of a pixel's window; 0 for none.
    pub fn radius(&self, at: usize) -> u32 {
        self.windows[at].radius as u32
    }

    /// The pixel whose window each pixel takes, if there is one: the plain form.
    pub fn choices(&self) -> impl Iterator<Item = Option<usize>> {
        let choice = |at: usize| (self.asked.levels[at] > 0).then(|| self.best(at)).flatten();
        (0..self.windows.len()).map(choice)
    }

    /// The pixel whose window is worth most to a pixel, among itself and those at the places of the windows that it
    /// can take; none if there is none. Windows that end short of the pixel are taken if its point, or in inverse depth
    /// one within the tolerance of it, lies in their plane.
    fn best(&self, own: usize) -> Option<usize> {
        let cloud = self.cloud;
        let pixel = (own % cloud.width, own / cloud.width);
        let mut noise = f32::INFINITY;
        let mut found = Vec::new();
        for_each_place(pixel, (cloud.width, cloud.height), self.asked.radii(own), |dx, dy| {
            let at = own.wrapping_add_signed(dy * cloud.width as isize + dx);
            let window = &self.windows[at];
            let distance = dx.unsigned_abs().max(dy.unsigned_abs()) as f32;
            if window.radius > 0.0 && distance <= window.radius + REACH {
                noise = noise.min(window.noise);
                let short = (distance - window.radius).max(0.0);
                found.push(Candidate { at, to_pixel: [-dx as f32, -dy as f32], short });
            }
        });

        let noise = noise.max(self.asked.least_noise);
        let near = self.near(pixel);
        let (point, tolerance) = (inverse_depth(cloud.depths[own]), self.tolerance(own));
        let mut best: Option<(f32, usize)> = None;
        for Candidate { at, to_pixel: [dx, dy], short } in found {
            let window = &self.windows[at];
            let least = best.map_or(f32::INFINITY, |(least, _)| least);
            let far = 1.0 + short * short;
            let at_pixel = |x: f32, y: f32| {
                window.inverse_depth + window.slope[0] * (dx + x) + window.slope[1] * (dy + y)
            };
            let astray = near.inverse_depth - at_pixel(near.offset[0], near.offset[1]);
            let astray = (astray * astray - NEAR_NOISE * noise / near.points).max(0.0);
            let misfit = (window.unevenness - noise).max(0.0);
            let bend = MISFIT * misfit + NEAR * astray;
            let cost = (noise * window.per_noise + bend * window.per_bend) * far;
            let [across, down] = window.slope;
            let steepness = || (across * across + down * down).sqrt();
            let lies_in = || (point - at_pixel(0.0, 0.0)).abs() < tolerance + JITTER * steepness();
            if cost < least && (short == 0.0 || lies_in()) {
                best = Some((cost, at));
            }
        }
        best.map(|(_, at)| at)
    }

    /// How far from a plane a pixel's point may lie to be on that surface, in inverse depth: half a depth change.
    pub fn tolerance(&self, at: usize) -> f32 {
        let depth = self.cloud.depths[at];
        super::least_depth_change(depth, self.options) / (depth * depth) / 2.0
    }

    /// The mean of the pixel and those next to it, but of the pixel alone if there is a depth change among them.
    fn near(&self, (x, y): (usize, usize)) -> Near {
        let cloud = self.cloud;
        let reach = self.asked.clean[cloud.index(x, y)].min(1) as usize;
        let (mut sums, mut points) = ([0.0; 3], 0.0);
        for (column, row) in Rect::around((x, y), reach, (cloud.width, cloud.height)).pixels() {
            let inverse = inverse_depth(cloud.depths[cloud.index(column, row)]);
            if !inverse.is_nan() {
                let offset = [column as f32 - x as f32, row as f32 - y as f32];
                for (sum, value) in sums.iter_mut().zip([inverse, offset[0], offset[1]]) {
                    *sum += value;
                }
                points += 1.0;
            }
        }
        let [inverse_depth, dx, dy] = sums.map(|sum| sum / points);
        Near { inverse_depth, offset: [dx, dy], points }
    }
}

/// Calls `visit` with the ways in columns and rows from a pixel to those whose windows it can take: itself, and those at
/// the places of windows of these radii.
fn for_each_place(
    (x, y): (usize, usize),
    (width, height): (usize, usize),
    radii: impl Iterator<Item = u32>,
    mut visit: impl FnMut(isize, isize),
) {
    let step = |from: usize, step: isize, size: usize| {
        from.saturating_add_signed(step).min(size - 1) as isize - from as isize
    };
    visit(0, 0);
    for radius in radii {
        let radius = radius as isize;
        let (left, right) = (step(x, -radius, width), step(x, radius, width));
        let (up, down) = (step(y, -radius, height), step(y, radius, height));
        // Of windows that are worth the same, the one at the middle of an edge is nearer.
        let edges = [(left, 0), (right, 0), (0, up), (0, down)];
        let corners = [(left, up), (right, up), (left, down), (right, down)];
        for places in [edges, corners] {
            for (dx, dy) in places {
                visit(dx, dy);
            }
        }
    }
}

/// A window that a pixel can take: that of the pixel `at`, from which `to_pixel` leads to this one.
struct Candidate {
    at: usize,
    to_pixel: [f32; 2],
    /// How many pixels the window ends short of this one.
    short: f32,
}

/// The mean inverse depth of points next to a pixel, their number, and the mean of their places from there.
struct Near {
    inverse_depth: f32,
    offset: [f32; 2],
    points: f32,
}
