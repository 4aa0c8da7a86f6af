//! Which even window each pixel takes: the one that is worth most to it, that which leaves the smallest error in the
//! slope of a plane through its points. Noise of variance v in n points leaves 12 v / (n L^2) in a window of side L;
//! points that do not lie in the window's plane, or a pixel that does not, bend it by some share of their deviation over
//! L; and where the surface itself bends, the slope changes by that from pixel to pixel. And beside a crease, the one on
//! the pixel's side. But where windows are as large as they may be, what makes them differ is chance: there each pixel
//! takes its own block's.
//!
//! Blocks are seldom on more than two surfaces, so two of a block's pixels choose for all: the middle one, and the one
//! to which the window of the middle one is worth least.

use std::ops::{Add, Mul};

use super::blocks::{BLOCK, Blocks, MIDDLE, lines_around};
use super::cloud::Cloud;
use super::even_windows::{Asked, EvenWindow};
use super::marks::Marks;
use super::planes::{JITTER, inverse_depth};
use crate::options::Options;
use crate::rect::Rect;
use crate::vector::dot;

/// What the part of a window's variance that is not noise counts, and the squared distance of the points next to the pixel
/// from the window's plane where it is more than `NEAR_NOISE` variances of their mean.
pub(crate) const MISFIT: f32 = 3.0;
pub(crate) const NEAR_NOISE: f32 = 4.0;
/// How many pixels beyond its window's edge a plane may be taken for a pixel's: outlines are ragged.
pub(crate) const REACH: f32 = 4.0;
/// Planes whose inverse depths at the middle of either's window differ by more than these many variances of the noise
/// are two surfaces. The one beyond a crease is not taken if the pixel lies on this side of it, unless this side's
/// costs `CREASE_COST` times as much.
pub(crate) const CREASE_NOISE: f32 = 16.0;
pub(crate) const CREASE_COST: f32 = 20.0;
/// Windows whose costs differ by a smaller share than this one lacks are worth the same: which is the better one, on
/// surfaces that are alike to both sides, is rounding. The first one is taken.
pub(crate) const ALIKE: f32 = 0.999;
/// A pixel and those next to it.
pub(crate) const NEXT: f32 = 9.0;
/// An edge that noise hides makes windows across it less even than those beside it: no edge is near where a window's variance is
/// at most this share of what the others' may be of. With more, small steps come out as ramps; with less, what windows differ in
/// is mistaken for an edge.
const NO_EDGE: f32 = 0.9;

impl EvenWindow {
    /// What one of a mean square deviation that is not noise costs.
    fn per_misfit(&self) -> f32 {
        let side = 2.0 * self.radius + 1.0;
        MISFIT / (side * side)
    }
}

/// The choice of a pixel that takes no window.
pub(crate) const NO_WINDOW: u32 = u32::MAX;

/// Those of the places around a block, 0 before it, 1 its own, 2 behind it. Of windows that are worth the same, the one
/// at the middle of an edge is nearer.
const PLACES: [(usize, usize); 8] =
    [(0, 1), (2, 1), (1, 0), (1, 2), (0, 0), (2, 0), (0, 2), (2, 2)];

/// Those at the radius of a level. The small windows, which serve narrow surfaces, are at the middles of edges only.
pub(crate) fn places_at(level: u8) -> &'static [(usize, usize)] {
    if level < 2 { &PLACES } else { &PLACES[..4] }
}

/// The even windows, to choose from.
pub(crate) struct EvenWindows<'a> {
    pub cloud: &'a Cloud,
    pub asked: &'a Asked<'a>,
    pub options: &'a Options,
    /// The pixels that may take one: they have points.
    pub concerned: &'a Marks,
    /// From how many radii at most the windows come that a block's pixels can take, starting with the largest and halving
    /// it, block by block; 0 for a block that takes none.
    pub levels: &'a [u8],
    /// Block by block.
    pub windows: &'a [EvenWindow],
}

impl EvenWindows<'_> {
    /// The radius of a block's window; 0 for none.
    pub fn radius(&self, block: usize) -> u32 {
        self.windows[block].radius as u32
    }

    /// Whether a block's window is whole, as large as it may be, as those next to it are, and reaches beyond the block, and those
    /// one radius away that are as large are no more even: no edge is near.
    pub fn is_far_from_edges(&self, (column, row): (usize, usize)) -> bool {
        let EvenWindows { cloud, asked, windows, .. } = self;
        let blocks = &asked.blocks;
        let block = row * blocks.across + column;
        let is_full = |block: usize| {
            let radius = self.radius(block);
            radius > 0 && radius >= asked.largest(block)
        };
        let own = &windows[block];
        let radius = own.radius as usize;
        let is_inside = || {
            let (x, y) = blocks.middle_of((column, row));
            radius <= x && x + radius < cloud.width && radius <= y && y + radius < cloud.height
        };
        let around = |distance: usize| {
            let [left, _, right] = lines_around(column, distance, blocks.across);
            let [above, _, below] = lines_around(row, distance, blocks.down);
            [(left, row), (right, row), (column, above), (column, below)]
                .map(|(column, row)| row * blocks.across + column)
        };
        let is_no_more_even = |block: usize| {
            let EvenWindow { radius, noise, .. } = windows[block];
            radius < own.radius || own.unevenness <= NO_EDGE * noise.max(asked.noise.least)
        };
        radius >= BLOCK
            && is_full(block)
            && is_inside()
            && around(1).into_iter().all(is_full)
            && around(radius.div_ceil(BLOCK)).into_iter().all(is_no_more_even)
    }

    /// Calls `visit` with the blocks whose windows a block's pixels can take: itself, and those one radius away along
    /// the rows, the columns and both.
    fn for_each_place(&self, block: usize, mut visit: impl FnMut(usize)) {
        let blocks @ Blocks { across, down, .. } = self.asked.blocks;
        let (x, y) = blocks.place(block);
        visit(block);
        let largest = self.asked.largest(block);
        // Smaller ones have the same places.
        let half = |radius: &u32| (*radius > BLOCK as u32).then_some(radius / 2);
        let radii = std::iter::successors((largest > 0).then_some(largest), half);
        for (level, radius) in (0..self.levels[block]).zip(radii) {
            let distance = (radius as usize).div_ceil(BLOCK);
            let columns = lines_around(x, distance, across);
            let rows = lines_around(y, distance, down).map(|row| row * across);
            for (column, row) in places_at(level) {
                visit(rows[*row] + columns[*column]);
            }
        }
    }

    /// The block whose window each pixel takes, or [`NO_WINDOW`]: the plain form.
    pub fn choose(&self, choices: &mut [u32]) {
        choices.fill(NO_WINDOW);
        let levels = self.levels.iter().enumerate();
        for (block, _) in levels.filter(|(_, level)| **level > 0) {
            let place = self.asked.blocks.place(block);
            let pixels = self.pixels_that_take(place);
            if self.is_far_from_edges(place) {
                pixels.for_each(|(x, y)| choices[self.cloud.index(x, y)] = block as u32);
            } else {
                Candidates::of(self, block).choose(pixels, choices);
            }
        }
    }

    /// A block's pixels that may take a window.
    fn pixels_that_take(
        &self,
        (column, row): (usize, usize),
    ) -> impl Iterator<Item = (usize, usize)> {
        let EvenWindows { cloud, concerned, .. } = self;
        let lines = |line: usize, end: usize| line * BLOCK..((line + 1) * BLOCK).min(end);
        let inside = Rect { x: lines(column, cloud.width), y: lines(row, cloud.height) };
        inside.pixels().filter(|pixel| concerned.has(*pixel))
    }

    /// How far from a plane a pixel's point may lie to be on that surface, in inverse depth: half a depth change.
    pub fn tolerance(&self, at: usize) -> f32 {
        let depth = self.cloud.depths[at];
        super::least_depth_change(depth, self.options) / (depth * depth) / 2.0
    }
}

/// The windows that a block's pixels can take: its own and those at the places around it.
struct Candidates<'a> {
    even: &'a EvenWindows<'a>,
    /// The block's middle, inside the image or not.
    middle: [usize; 2],
    windows: Vec<Candidate>,
    /// The least variance among them.
    noise: f32,
}

impl<'a> Candidates<'a> {
    fn of(even: &'a EvenWindows, block: usize) -> Self {
        let &EvenWindows { asked, .. } = even;
        let blocks = &asked.blocks;
        let (column, row) = blocks.place(block);
        let middle = [column, row].map(|line| line * BLOCK + MIDDLE);
        let (windows, noise) = (Vec::new(), f32::INFINITY);
        let mut found = Candidates { even, middle, windows, noise };
        even.for_each_place(block, |place| {
            let window = even.windows[place];
            let middle = found.way(blocks.middle(place));
            if window.radius > 0.0 && length(middle) <= window.radius + REACH {
                found.noise = window.noise.min(found.noise);
                found.windows.push(Candidate { place, window, middle, cost: f32::INFINITY });
            }
        });
        found.noise = found.noise.max(asked.noise.least);
        for Candidate { window, cost, .. } in &mut found.windows {
            let misfit = (window.unevenness - found.noise).max(0.0);
            *cost = found.noise * window.per_noise + misfit * window.per_misfit();
        }
        found
    }

    /// The way to a pixel from the block's middle.
    fn way(&self, (x, y): (usize, usize)) -> [f32; 2] {
        [x as f32 - self.middle[0] as f32, y as f32 - self.middle[1] as f32]
    }

    /// Writes what these pixels of the block take.
    fn choose(&self, pixels: impl Iterator<Item = (usize, usize)>, choices: &mut [u32]) {
        let pixels: Vec<Pixel> = pixels.map(|pixel| self.pixel(pixel)).collect();
        let is_middle = |pixel: &&Pixel| pixel.way == [0.0; 2];
        let Some(first) = pixels.iter().find(is_middle).or(pixels.first()) else { return };
        let best_of_first = self.best(first);
        let (mut second, mut largest) = (first, -1.0);
        for pixel in &pixels {
            let cost = if pixel.at == first.at { 0.0 } else { self.cost(best_of_first, pixel) };
            if ALIKE * cost > largest {
                (second, largest) = (pixel, cost);
            }
        }
        let best_of_second = self.best(second);
        for pixel in &pixels {
            let best = if pixel.at == second.at {
                best_of_second
            } else if pixel.at == first.at {
                best_of_first
            } else {
                self.better(best_of_first, best_of_second, pixel)
            };
            choices[pixel.at] = best.map_or(NO_WINDOW, |best| best.place as u32);
        }
    }

    /// The window that is worth more to a pixel, and beside a crease, the one on its side; none that it cannot take.
    fn better<'w>(
        &self,
        first: Option<&'w Candidate>,
        second: Option<&'w Candidate>,
        pixel: &Pixel,
    ) -> Option<&'w Candidate> {
        let costs = [first, second].map(|window| self.cost(window, pixel));
        let (mut better, mut other) = ((first, costs[0]), (second, costs[1]));
        if costs[1] < ALIKE * costs[0] {
            (better, other) = (other, better);
        }
        let (window, cost) = better;
        if let (Some(window), (Some(beyond), cost_beyond)) = (window, other)
            && cost_beyond < ALIKE * CREASE_COST * cost
            && self.is_side_of(beyond, window, pixel)
        {
            return Some(beyond);
        }
        window.filter(|_| cost.is_finite())
    }

    /// The window that is worth most to a pixel, if there is one that it can take.
    fn best(&self, pixel: &Pixel) -> Option<&Candidate> {
        let costs = self.windows.iter().map(|window| (window, self.cost(Some(window), pixel)));
        let (mut best, mut least) = (None, f32::INFINITY);
        for (window, cost) in costs.clone() {
            if cost < least {
                (best, least) = (Some(window), ALIKE * cost);
            }
        }
        // By chance the pixel may be nearer to the plane beyond a crease.
        let mut chosen = best?;
        least *= CREASE_COST;
        for (window, cost) in costs {
            if cost < least && self.is_side_of(window, best?, pixel) {
                (chosen, least) = (window, ALIKE * cost);
            }
        }
        Some(chosen)
    }

    /// What a window costs a pixel; infinite for none. One that ends short of the pixel can be taken if its point, or
    /// in inverse depth one within the tolerance of it, lies in the window's plane.
    fn cost(&self, window: Option<&Candidate>, pixel: &Pixel) -> f32 {
        let Some(Candidate { window, middle: [dx, dy], cost: even, .. }) = window else {
            return f32::INFINITY;
        };
        let [x, y] = pixel.way;
        let plane = inverse_depth_along(window.q, pixel.ray);
        let astray = pixel.near.inverse_depth - plane;
        let astray = (astray * astray - pixel.near.noise).max(0.0);
        let (dx, dy) = (x - dx, y - dy);
        let short = (length([dx, dy]) - window.radius).max(0.0);
        let even = even + window.bend2 * (dx * dx + dy * dy);
        let cost = (even + astray * window.per_misfit()) * (1.0 + short * short);
        let lies_in =
            || (pixel.inverse_depth - plane).abs() <= pixel.tolerance + JITTER * window.steepness;
        if short == 0.0 || lies_in() { cost } else { f32::INFINITY }
    }

    /// Whether there is a crease between a window and another, and the pixel on the window's side of it: there the
    /// same plane is in front as in the middle of this window, and behind in that of the other.
    fn is_side_of(&self, window: &Candidate, other: &Candidate, pixel: &Pixel) -> bool {
        let (window, other) = (&window.window, &other.window);
        let gap = std::array::from_fn(|i| window.q[i] - other.q[i]);
        let [here, there, at_pixel] =
            [window.ray, other.ray, pixel.ray].map(|ray| inverse_depth_along(gap, ray));
        let least_gap = here.abs().min(there.abs());
        least_gap * least_gap > CREASE_NOISE * self.noise
            && here * there < 0.0
            && here * at_pixel > 0.0
    }

    fn pixel(&self, (x, y): (usize, usize)) -> Pixel {
        let at = self.even.cloud.index(x, y);
        Pixel {
            at,
            way: self.way((x, y)),
            ray: self.even.cloud.ray(at),
            inverse_depth: inverse_depth(self.even.cloud.depths[at]),
            tolerance: self.even.tolerance(at),
            near: self.near((x, y)),
        }
    }

    /// The mean of the pixel and those next to it, but of the pixel alone if one of them is missing, if there is a depth
    /// change among them, or if depths are exact.
    fn near(&self, (x, y): (usize, usize)) -> Near {
        let EvenWindows { cloud, asked, .. } = self.even;
        let inverse = |x: usize, y: usize| inverse_depth(cloud.depths[cloud.index(x, y)]);
        let rect = Rect::around((x, y), 1, (cloud.width, cloud.height));
        let of_column = |x: usize| rect.y.clone().map(|y| inverse(x, y)).sum::<f32>();
        let mean = rect.x.clone().map(of_column).sum::<f32>() / NEXT;
        let is_clean = !asked.clean.spoilt.has((x, y));
        let is_whole = rect.area() as f32 == NEXT && !mean.is_nan();
        let noise = NEAR_NOISE * asked.noise.of_exact().unwrap_or(self.noise);
        if is_whole && is_clean && !asked.noise.is_none {
            Near { inverse_depth: mean, noise: noise * asked.noise_share() }
        } else {
            Near { inverse_depth: inverse(x, y), noise }
        }
    }
}

/// How far a way leads along the rows or the columns, whichever is more.
fn length([dx, dy]: [f32; 2]) -> f32 {
    dx.abs().max(dy.abs())
}

/// The inverse depth along a ray of the plane q P = 1, or how far a plane's is above another's, of which q is the difference.
#[inline(always)]
pub(crate) fn inverse_depth_along<T: Copy + Mul<Output = T> + Add<Output = T>>(
    q: [T; 3],
    ray: [T; 3],
) -> T {
    dot(q, ray)
}

/// A window that a block's pixels can take.
struct Candidate {
    /// Its own block.
    place: usize,
    window: EvenWindow,
    /// In pixels from the block's middle.
    middle: [f32; 2],
    /// What it costs any pixel.
    cost: f32,
}

/// A pixel that takes a window.
struct Pixel {
    at: usize,
    /// Where it is from the block's middle.
    way: [f32; 2],
    ray: [f32; 3],
    inverse_depth: f32,
    tolerance: f32,
    near: Near,
}

/// The mean of points next to a pixel, and the squared distance from it that noise explains.
struct Near {
    inverse_depth: f32,
    noise: f32,
}
