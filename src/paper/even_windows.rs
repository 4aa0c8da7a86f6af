//! Even windows: around every block's first pixel the largest window whose points lie in one plane as well as chance
//! allows.
//!
//! A pixel beside a depth change or a crease is in the middle of no large window that lies on one surface, but it is
//! at the edge or in the corner of some, which are the even windows of blocks nearby. It takes the normal of the one
//! that is worth most to it: of that which leaves the smallest error in the slope of a plane through its points.
//! Noise of variance v in n points leaves 12 v / (n L^2) in a window of side L; points that do not lie in the
//! window's plane, or a pixel that does not, bend it by some share of their deviation over L.

use super::blocks::{BLOCK, Blocks};
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
/// Planes whose inverse depths at the middle of either's window differ by more than these many variances of the noise
/// are two surfaces. The one beyond a crease is not taken if the pixel lies on this side of it, unless this side's costs
/// `CREASE_COST` times as much.
pub(crate) const CREASE_NOISE: f32 = 16.0;
pub(crate) const CREASE_COST: f32 = 10.0;
/// Depths are exact if more than this share of the windows that a pixel can take says so.
pub(crate) const EXACT_SHARE: f32 = 0.25;
/// How many pixels beyond its window's edge a plane may be taken for a pixel's: outlines are ragged.
pub(crate) const REACH: f32 = 3.0;

/// A block's even window, and what it is worth.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)] // Eight floats, which the fast form reads as such.
pub(crate) struct EvenWindow {
    /// A whole number; 0 for no window.
    pub radius: f32,
    /// The plane's inverse depth at the window's pixel, and its change per pixel to the right and down.
    pub inverse_depth: f32,
    pub slope: [f32; 2],
    /// The mean square deviation from the plane, and the variance that it may be of.
    pub unevenness: f32,
    pub noise: f32,
    /// What one of noise and one of bend count.
    pub per_noise: f32,
    pub per_bend: f32,
}

/// What windows are asked for.
pub(crate) struct Asked<'a> {
    pub blocks: Blocks,
    /// The radius that the depth asks for, block by block, at most `limit`; 0 where all points are missing.
    pub wanted: &'a [u32],
    /// From how many radii the windows come that a block's pixels can take, starting with the largest and halving it,
    /// block by block; 0 for a block that takes none.
    pub levels: &'a [u8],
    /// The largest radius of a window without a depth change, pixel by pixel.
    pub clean: &'a [u32],
    /// The largest radius of all.
    pub limit: u32,
    /// The smallest variance that is told from none.
    pub least_noise: f32,
}

impl Asked<'_> {
    /// The largest radius that a block's window may have: twice the wanted one, since whether a pixel is on one side
    /// of a crease or on the other is told from less noise then.
    pub fn largest(&self, block: usize) -> u32 {
        (2 * self.wanted[block]).min(self.limit)
    }

    /// The radii of the windows around the block that its pixels can take.
    fn radii(&self, block: usize) -> impl Iterator<Item = u32> + use<> {
        let (largest, levels) = (self.largest(block), u32::from(self.levels[block]));
        (0..levels).map(move |level| largest >> level).take_while(|radius| *radius > 0)
    }

    /// Calls `visit` with the blocks whose windows a block's pixels can take: itself, and those one radius away along
    /// the rows, the columns and both.
    fn for_each_place(&self, block: usize, mut visit: impl FnMut(usize)) {
        let Blocks { across, down, .. } = self.blocks;
        let (x, y) = (block % across, block / across);
        visit(block);
        for radius in self.radii(block) {
            let columns = places(x, radius as usize, across);
            let rows = places(y, radius as usize, down).map(|row| row * across);
            for (column, row) in PLACES {
                visit(rows[row] + columns[column]);
            }
        }
    }

    /// Whether some pixel can take a block's window, block by block.
    pub fn needed(&self) -> Vec<bool> {
        let mut needed = vec![false; self.blocks.count()];
        for block in (0..needed.len()).filter(|block| self.levels[*block] > 0) {
            self.for_each_place(block, |place| needed[place] = true);
        }
        needed
    }

    /// The variance told from none where the sensor's smallest depth change is `alpha`.
    pub fn least_noise(alpha: f32) -> f32 {
        (EVEN * alpha).powi(2)
    }
}

/// The columns or rows of blocks, of so many, at the places of windows of a radius: before block `at`, its own, behind.
fn places(at: usize, radius: usize, count: usize) -> [usize; 3] {
    let distance = radius.div_ceil(BLOCK);
    [at.saturating_sub(distance), at, (at + distance).min(count - 1)]
}

/// Those of the places around a block, 0 before it, 1 its own, 2 behind it. Of windows that are worth the same, the one
/// at the middle of an edge is nearer.
pub(crate) const PLACES: [(usize, usize); 8] =
    [(0, 1), (2, 1), (1, 0), (1, 2), (0, 0), (2, 0), (0, 2), (2, 2)];

/// The even windows of the needed blocks: the plain form.
pub(crate) fn even_windows<'a>(
    cloud: &'a Cloud,
    asked: &'a Asked,
    needed: &'a [bool],
) -> impl Iterator<Item = EvenWindow> + 'a {
    let window = move |(block, needed): (_, &bool)| {
        needed.then(|| even_window(cloud, asked, block)).flatten().unwrap_or_default()
    };
    needed.iter().enumerate().map(window)
}

fn even_window(cloud: &Cloud, asked: &Asked, block: usize) -> Option<EvenWindow> {
    let pixel = asked.blocks.first(block);
    let (wanted, clean) = (asked.wanted[block], asked.clean[cloud.index(pixel.0, pixel.1)]);
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
        let mut radius = asked.largest(block).min(clean);
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
    pub fn choices(&self) -> impl Iterator<Item = Option<u32>> {
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
        let way = |from: (usize, usize), to: (usize, usize)| {
            [to.0 as f32 - from.0 as f32, to.1 as f32 - from.1 as f32]
        };
        let distance = |[dx, dy]: [f32; 2]| dx.abs().max(dy.abs());
        let block = blocks.block(own);
        let first = blocks.first(block);
        let (mut noise, mut exact) = (f32::INFINITY, 0.0);
        let mut found = Vec::new();
        self.asked.for_each_place(block, |place| {
            let window = &self.windows[place];
            let distance = distance(way(blocks.first(place), first));
            if window.radius > 0.0 && distance <= window.radius + REACH {
                noise = noise.min(window.noise);
                exact += f32::from(window.is_exact(self.asked.least_noise));
                found.push(place);
            }
        });

        let noise = noise.max(self.asked.least_noise);
        let pixel = (own % cloud.width, own / cloud.width);
        let near = self.near(pixel, exact > EXACT_SHARE * found.len() as f32);
        let [x, y] = way(first, pixel);
        let (point, tolerance) = (inverse_depth(cloud.depths[own]), self.tolerance(own));
        let candidate = |place: usize| {
            let window = &self.windows[place];
            let [dx, dy] = way(blocks.first(place), first);
            let [across, down] = window.slope;
            let at_first = window.inverse_depth + across * dx + down * dy;
            let misfit = (window.unevenness - noise).max(0.0);
            let even = noise * window.per_noise + MISFIT * misfit * window.per_bend;
            let per_astray = NEAR * window.per_bend;
            let jitter = JITTER * (across * across + down * down).sqrt();

            let plane = Inclined { at_first, slope: window.slope };
            let at_near = plane.at([x + near.offset[0], y + near.offset[1]]);
            let astray = near.inverse_depth - at_near;
            let astray = (astray * astray - NEAR_NOISE * noise / near.points).max(0.0);
            let short = (distance([dx + x, dy + y]) - window.radius).max(0.0);
            let cost = (even + astray * per_astray) * (1.0 + short * short);
            let lies_in = || (point - plane.at([x, y])).abs() < tolerance + jitter;
            let middle = [-dx, -dy];
            (short == 0.0 || lies_in()).then_some(Candidate { place, plane, middle, cost })
        };
        let candidates: Vec<Candidate> = found.into_iter().filter_map(candidate).collect();
        let mut best: Option<&Candidate> = None;
        for candidate in &candidates {
            if candidate.cost < best.map_or(f32::INFINITY, |best| best.cost) {
                best = Some(candidate);
            }
        }
        // By chance the pixel may be nearer to the plane beyond a crease.
        let mut chosen = best?;
        let mut least = CREASE_COST * chosen.cost;
        for candidate in &candidates {
            if candidate.cost < least && candidate.is_this_side([x, y], best?, CREASE_NOISE * noise)
            {
                (chosen, least) = (candidate, candidate.cost);
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

/// A window that a pixel can take, and what it costs. Places are in pixels from the first of the pixel's block.
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

/// A plane by its inverse depth at the first pixel of a block, and its change per pixel to the right and down.
struct Inclined {
    at_first: f32,
    slope: [f32; 2],
}

impl Inclined {
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        self.at_first + self.slope[0] * x + self.slope[1] * y
    }

    /// How far its inverse depths are above another's.
    fn minus(&self, other: &Inclined) -> Inclined {
        let slope = std::array::from_fn(|i| self.slope[i] - other.slope[i]);
        Inclined { at_first: self.at_first - other.at_first, slope }
    }
}

/// The mean inverse depth of points next to a pixel, their number, and the mean of their places from there.
struct Near {
    inverse_depth: f32,
    offset: [f32; 2],
    points: f32,
}
