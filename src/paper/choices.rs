//! Which even window each pixel takes: the one that is worth most to it, that which leaves the smallest error in the
//! slope of a plane through its points. Noise of variance v in n points leaves 12 v / (n L^2) in a window of side L;
//! points that do not lie in the window's plane, or a pixel that does not, bend it by some share of their deviation over
//! L. And beside a crease, the one on the pixel's side.

use super::blocks::{BLOCK, MIDDLE};
use super::cloud::Cloud;
use super::even_windows::{Asked, EvenWindow};
use super::planes::{JITTER, inverse_depth};
use super::rect::Rect;
use crate::options::Options;

/// What the part of a window's variance that is not noise counts.
pub(crate) const MISFIT: f32 = 3.0;
/// What the squared distance of the points next to the pixel from the window's plane counts, where it is more than
/// `NEAR_NOISE` variances of their mean.
pub(crate) const NEAR: f32 = 9.0;
pub(crate) const NEAR_NOISE: f32 = 4.0;
/// How many pixels beyond its window's edge a plane may be taken for a pixel's: outlines are ragged.
pub(crate) const REACH: f32 = 4.0;
/// Planes whose inverse depths at the middle of either's window differ by more than these many variances of the noise
/// are two surfaces. The one beyond a crease is not taken if the pixel lies on this side of it, unless this side's
/// costs `CREASE_COST` times as much.
pub(crate) const CREASE_NOISE: f32 = 16.0;
pub(crate) const CREASE_COST: f32 = 10.0;
/// Windows whose costs differ by a smaller share than this one lacks are worth the same: which is the better one, on
/// surfaces that are alike to both sides, is rounding. The first one is taken.
pub(crate) const ALIKE: f32 = 0.999;
/// Depths are exact if more than this share of the windows that a pixel can take says so.
pub(crate) const EXACT_SHARE: f32 = 0.25;

impl EvenWindow {
    /// Whether its depths are without noise. Those that a sensor rounds look so where all are alike, so only a window
    /// in which they change tells.
    fn is_exact(&self, least_noise: f32) -> bool {
        let [across, down] = self.slope;
        self.noise < least_noise && across * across + down * down > least_noise
    }
}

/// The even windows that are needed, to choose from.
pub(crate) struct EvenWindows<'a> {
    pub cloud: &'a Cloud,
    pub asked: &'a Asked<'a>,
    pub options: &'a Options,
    /// Block by block.
    pub windows: &'a [EvenWindow],
}

impl EvenWindows<'_> {
    /// The radius of a block's window; 0 for none.
    pub fn radius(&self, block: usize) -> u32 {
        self.windows[block].radius as u32
    }

    /// The block whose window each pixel takes, if there is one: the plain form.
    pub fn choices(&self) -> impl ExactSizeIterator<Item = Option<u32>> {
        let can_take = |pixel: usize| {
            self.asked.levels[self.asked.blocks.block(pixel)] > 0 && !self.cloud.is_missing(pixel)
        };
        let choice = move |pixel: usize| can_take(pixel).then(|| self.best(pixel)).flatten();
        (0..self.cloud.depths.len()).map(choice)
    }

    /// The block whose window is worth most to a pixel, among its own and those at the places of the windows that it
    /// can take; none if there is none. Windows that end short of the pixel are taken if its point, or in inverse depth
    /// one within the tolerance of it, lies in their plane.
    fn best(&self, own: usize) -> Option<u32> {
        let cloud = self.cloud;
        let blocks = &self.asked.blocks;
        let distance = |[dx, dy]: [f32; 2]| dx.abs().max(dy.abs());
        let block = blocks.block(own);
        let [column, row] = [block % blocks.across, block / blocks.across];
        let way = |(x, y): (usize, usize)| {
            let from = |at: usize, line: usize| at as f32 - (line * BLOCK + MIDDLE) as f32;
            [from(x, column), from(y, row)]
        };
        let (mut noise, mut exact) = (f32::INFINITY, 0.0);
        let mut found = Vec::new();
        self.asked.for_each_place(block, |place| {
            let window = &self.windows[place];
            let distance = distance(way(blocks.middle(place)));
            if window.radius > 0.0 && distance <= window.radius + REACH {
                noise = noise.min(window.noise);
                exact += f32::from(window.is_exact(self.asked.least_noise));
                found.push(place);
            }
        });

        let noise = noise.max(self.asked.least_noise);
        let pixel = (own % cloud.width, own / cloud.width);
        let near = self.near(pixel, exact > EXACT_SHARE * found.len() as f32);
        let [x, y] = way(pixel);
        let (point, tolerance) = (inverse_depth(cloud.depths[own]), self.tolerance(own));
        let candidate = |place: usize| {
            let window = &self.windows[place];
            let middle = way(blocks.middle(place));
            let [dx, dy] = middle;
            let [across, down] = window.slope;
            let at_middle = window.inverse_depth - across * dx - down * dy;
            let misfit = (window.unevenness - noise).max(0.0);
            let even = noise * window.per_noise + MISFIT * misfit * window.per_bend;
            let per_astray = NEAR * window.per_bend;
            let jitter = JITTER * (across * across + down * down).sqrt();

            let plane = Inclined { at_middle, slope: window.slope };
            let at_near = plane.at([x + near.offset[0], y + near.offset[1]]);
            let astray = near.inverse_depth - at_near;
            let astray = (astray * astray - NEAR_NOISE * noise / near.points).max(0.0);
            let short = (distance([x - dx, y - dy]) - window.radius).max(0.0);
            let cost = (even + astray * per_astray) * (1.0 + short * short);
            let lies_in = || (point - plane.at([x, y])).abs() < tolerance + jitter;
            (short == 0.0 || lies_in()).then_some(Candidate { place, plane, middle, cost })
        };
        let candidates: Vec<Candidate> = found.into_iter().filter_map(candidate).collect();
        let (mut best, mut least) = (None, f32::INFINITY);
        for candidate in &candidates {
            if candidate.cost < least {
                (best, least) = (Some(candidate), ALIKE * candidate.cost);
            }
        }
        // By chance the pixel may be nearer to the plane beyond a crease.
        let mut chosen = best?;
        least *= CREASE_COST;
        for candidate in &candidates {
            if candidate.cost < least && candidate.is_this_side([x, y], best?, CREASE_NOISE * noise)
            {
                (chosen, least) = (candidate, ALIKE * candidate.cost);
            }
        }
        Some(chosen.place as u32)
    }

    /// How far from a plane a pixel's point may lie to be on that surface, in inverse depth: half a depth change.
    pub fn tolerance(&self, at: usize) -> f32 {
        let depth = self.cloud.depths[at];
        super::least_depth_change(depth, self.options) / (depth * depth) / 2.0
    }

    /// The mean of the pixel and those next to it, but of the pixel alone if there is a depth change among them or
    /// depths are exact.
    fn near(&self, (x, y): (usize, usize), is_exact: bool) -> Near {
        let cloud = self.cloud;
        let is_clean = self.asked.clean[cloud.index(x, y)] > 0;
        let reach = usize::from(is_clean && !is_exact);
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

/// A window that a pixel can take, and what it costs. Places are in pixels from the middle of the pixel's block.
struct Candidate {
    place: usize,
    plane: Inclined,
    middle: [f32; 2],
    cost: f32,
}

impl Candidate {
    /// Whether there is a crease between this window and another, and the pixel on this one's side of it: there the
    /// same plane is in front as in the middle of this window, and behind in that of the other. `least` is the least
    /// squared distance between the planes of two surfaces.
    fn is_this_side(&self, pixel: [f32; 2], other: &Candidate, least: f32) -> bool {
        let gap = self.plane.minus(&other.plane);
        let (here, there) = (gap.at(self.middle), gap.at(other.middle));
        let least_gap = here.abs().min(there.abs());
        least_gap * least_gap > least && here * there < 0.0 && here * gap.at(pixel) > 0.0
    }
}

/// A plane by its inverse depth at the middle pixel of a block, and its change per pixel to the right and down.
struct Inclined {
    at_middle: f32,
    slope: [f32; 2],
}

impl Inclined {
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        self.at_middle + self.slope[0] * x + self.slope[1] * y
    }

    /// How far its inverse depths are above another's.
    fn minus(&self, other: &Inclined) -> Inclined {
        let slope = std::array::from_fn(|i| self.slope[i] - other.slope[i]);
        Inclined { at_middle: self.at_middle - other.at_middle, slope }
    }
}

/// The mean inverse depth of points next to a pixel, their number, and the mean of their places from there.
struct Near {
    inverse_depth: f32,
    offset: [f32; 2],
    points: f32,
}
