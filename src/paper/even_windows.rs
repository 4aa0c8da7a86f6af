//! Even windows: around every pixel the largest window whose points lie in one plane as well as chance allows.
//!
//! A pixel beside a depth change or a crease is in the middle of no large window that lies on one surface, but it is
//! at the edge or in the corner of some, which are the even windows of pixels nearby. It takes the normal of the one
//! that is worth most to it: of that which leaves the smallest error in the slope of a plane through its points.
//! Noise of variance v in n points leaves 12 v / (n L^2) in a window of side L; points that do not lie in the
//! window's plane, or a pixel that does not, bend it by some share of their deviation over L.

use super::cloud::Cloud;
use super::planes::InverseDepths;
use super::rect::Rect;

/// Inverse depths that deviate less than this many alpha from a plane are as good as in it.
const EVEN: f32 = 0.02;
/// Small samples have, by chance, variances below the noise's. A window is even if its variance is at most this many
/// standard deviations of a sample's variance above that of the window of half its radius; and the noise's variance is
/// taken to be as far above the least one of all windows that a pixel can take.
const CHANCE: f64 = 3.0;
/// What the part of a window's variance that is not noise counts.
const MISFIT: f32 = 3.0;
/// What the squared distance of the points next to the pixel from the window's plane counts, where it is more than
/// `NEAR_NOISE` variances of their mean.
const NEAR: f32 = 9.0;
const NEAR_NOISE: f32 = 4.0;
/// On steep surfaces the sensor's noise along the rows and columns looks like depth changes. A window with some is
/// still on one surface if its points deviate from the plane by less than the plane changes in this many pixels:
/// across a true change it would be side / 6 pixels, so the window must have at least `JAGGED_RADIUS` and
/// `JAGGED_POINTS` of its points.
const JAGGED: f64 = 1.4;
const JAGGED_RADIUS: usize = 2;
const JAGGED_POINTS: f64 = 0.8;
/// How many pixels beyond its window's edge a plane may be taken for a pixel's: outlines are ragged.
const REACH: u32 = 3;
/// The sensor's noise along rows and columns, in pixels: it moves a point off a steep plane.
const JITTER: f32 = 4.0;

/// A pixel's even window, and what it is worth.
#[derive(Clone, Copy, Default)]
struct EvenWindow {
    /// 0 for no window.
    radius: u32,
    /// The plane's inverse depth at the pixel, and its change per pixel to the right and down.
    inverse_depth: f32,
    slope: [f32; 2],
    /// The mean square deviation from the plane, and the variance that it may be of.
    unevenness: f32,
    noise: f32,
    /// What one of noise and one of bend count.
    per_noise: f32,
    per_bend: f32,
}

/// The even windows of all pixels.
pub(crate) struct EvenWindows<'a> {
    cloud: &'a Cloud,
    clean: &'a [u32],
    /// Row by row.
    windows: Vec<EvenWindow>,
    /// The smallest variance that is told from none.
    least_noise: f32,
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
        inverse: &InverseDepths,
        clean: &'a [u32],
        wanted: impl Fn(usize) -> usize,
        limit: usize,
        alpha: f32,
    ) -> Self {
        let size = (cloud.width, cloud.height);
        let least_noise = (EVEN * alpha).powi(2);
        let of_pixel = |pixel: (usize, usize)| {
            let at = cloud.index(pixel.0, pixel.1);
            let plane = |radius: usize| inverse.plane(&Rect::around(pixel, radius, size));
            let (wanted, clean) = (wanted(at), clean[at] as usize);
            let jagged = |radius: usize| {
                let plane = plane(radius)?;
                let points = Rect::around(pixel, radius, size).area() as f64;
                let is_jagged = plane.unevenness <= (JAGGED * plane.steepness()).powi(2)
                    && plane.points >= JAGGED_POINTS * points;
                is_jagged.then_some((radius, plane))
            };
            let radii = std::iter::successors(Some(wanted), |radius| Some(radius * 7 / 10));
            let mut radii = radii.take_while(|radius| *radius > clean && *radius >= JAGGED_RADIUS);
            let (radius, plane) = radii.find_map(jagged).or_else(|| {
                let mut radius = largest_radius(wanted, limit).min(clean);
                let mut found = plane(radius)?;
                while radius > 1
                    && let Some(half) = plane(radius / 2)
                    && found.unevenness > half.noise(CHANCE).max(f64::from(least_noise))
                {
                    (radius, found) = (radius / 2, half);
                }
                Some((radius, found))
            })?;
            let [x, y] = [pixel.0, pixel.1].map(|at| at as f64);
            let per_bend = 1.0 / ((2 * radius + 1) as f64).powi(2);
            Some(EvenWindow {
                radius: radius as u32,
                inverse_depth: plane.at([x, y]) as f32,
                slope: plane.slope.map(|slope| slope as f32),
                unevenness: plane.unevenness as f32,
                noise: plane.noise(CHANCE) as f32,
                per_noise: (12.0 / plane.points * per_bend) as f32,
                per_bend: per_bend as f32,
            })
        };
        let pixels = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y)));
        let windows = pixels.map(|pixel| of_pixel(pixel).unwrap_or_default()).collect();
        EvenWindows { cloud, clean, windows, least_noise }
    }

    /// The radius of a pixel's window; 0 for none.
    pub fn radius(&self, at: usize) -> u32 {
        self.windows[at].radius
    }

    /// The pixel whose window is worth most to `pixel`, among itself and those at the places of windows of these
    /// radii; none if there is none. Windows that end short of the pixel are taken if its point, or in inverse depth
    /// one within `tolerance` of it, lies in their plane. `found` is scratch memory.
    pub fn best(
        &self,
        pixel: (usize, usize),
        radii: impl Iterator<Item = usize>,
        tolerance: f32,
        found: &mut Vec<Candidate>,
    ) -> Option<usize> {
        let cloud = self.cloud;
        let mut noise = f32::INFINITY;
        found.clear();
        let mut add = |at: usize, dx: isize, dy: isize| {
            let window = &self.windows[at];
            let distance = dx.unsigned_abs().max(dy.unsigned_abs()) as u32;
            if window.radius > 0 && distance <= window.radius + REACH {
                noise = noise.min(window.noise);
                let short = distance.saturating_sub(window.radius);
                found.push(Candidate { at, to_pixel: [-dx as f32, -dy as f32], short });
            }
        };
        let own = cloud.index(pixel.0, pixel.1);
        add(own, 0, 0);
        let step = |from: usize, step: isize, size: usize| {
            from.saturating_add_signed(step).min(size - 1) as isize - from as isize
        };
        for radius in radii {
            let radius = radius as isize;
            let [left, right] = [-radius, radius].map(|by| step(pixel.0, by, cloud.width));
            let [up, down] = [-radius, radius].map(|by| step(pixel.1, by, cloud.height));
            // Of windows that are worth the same, the one at the middle of an edge is nearer.
            let edges = [(left, 0), (right, 0), (0, up), (0, down)];
            let corners = [(left, up), (right, up), (left, down), (right, down)];
            for (dx, dy) in edges.into_iter().chain(corners) {
                add(own.wrapping_add_signed(dy * cloud.width as isize + dx), dx, dy);
            }
        }

        let noise = noise.max(self.least_noise);
        let near = self.near(pixel);
        let point = 1.0 / cloud.depths[own];
        let mut best: Option<(f32, usize)> = None;
        for &Candidate { at, to_pixel: [dx, dy], short } in found.iter() {
            let window = &self.windows[at];
            let least = best.map_or(f32::INFINITY, |(least, _)| least);
            let far = (1 + short * short) as f32;
            if noise * window.per_noise * far >= least {
                continue;
            }
            let at_pixel = |x: f32, y: f32| {
                window.inverse_depth + window.slope[0] * (dx + x) + window.slope[1] * (dy + y)
            };
            let astray = near.inverse_depth - at_pixel(near.offset[0], near.offset[1]);
            let astray = (astray * astray - NEAR_NOISE * noise / near.points).max(0.0);
            let misfit = (window.unevenness - noise).max(0.0);
            let bend = MISFIT * misfit + NEAR * astray;
            let cost = (noise * window.per_noise + bend * window.per_bend) * far;
            let steepness = || window.slope[0].hypot(window.slope[1]);
            let lies_in = || (point - at_pixel(0.0, 0.0)).abs() <= tolerance + JITTER * steepness();
            if cost < least && (short == 0 || lies_in()) {
                best = Some((cost, at));
            }
        }
        best.map(|(_, at)| at)
    }

    /// The mean of the pixel and those next to it, but of the pixel alone if there is a depth change among them.
    fn near(&self, (x, y): (usize, usize)) -> Near {
        let cloud = self.cloud;
        let reach = self.clean[cloud.index(x, y)].min(1) as usize;
        let (mut sums, mut points) = ([0.0; 3], 0.0);
        for (column, row) in Rect::around((x, y), reach, (cloud.width, cloud.height)).pixels() {
            let depth = cloud.depths[cloud.index(column, row)];
            if !depth.is_nan() {
                let offset = [column as f32 - x as f32, row as f32 - y as f32];
                for (sum, value) in sums.iter_mut().zip([1.0 / depth, offset[0], offset[1]]) {
                    *sum += value;
                }
                points += 1.0;
            }
        }
        let [inverse_depth, dx, dy] = sums.map(|sum| sum / points);
        Near { inverse_depth, offset: [dx, dy], points }
    }
}

/// A window that a pixel can take: that of the pixel `at`, from which `to_pixel` leads to this one.
pub(crate) struct Candidate {
    at: usize,
    to_pixel: [f32; 2],
    /// How many pixels the window ends short of this one.
    short: u32,
}

/// The mean inverse depth of points next to a pixel, their number, and the mean of their places from there.
struct Near {
    inverse_depth: f32,
    offset: [f32; 2],
    points: f32,
}
