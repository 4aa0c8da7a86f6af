//! The second pass: normals near depth changes and near creases, from even windows.

use std::iter::{once, repeat_n};

use super::blocks::{BLOCK, Blocks, MIDDLE};
use super::choices::{EvenWindows, NO_WINDOW};
use super::cloud::Cloud;
use super::creases::SummedNormals;
use super::depth_change::DepthChanges;
use super::even_windows::{Asked, EvenWindow};
use super::rect::Rect;
use super::{
    find_depth_changes, is_depth_change, rect_around, smoothing_area, surroundings, window,
};
use crate::Error;
use crate::memory::{bytes, refill};
use crate::methods::Estimate;
use crate::options::{Method, Options, Semantics};
use crate::orientation::turn_to_viewpoint;
use crate::threads::Workers;

/// How windows and their estimates are computed: by the plain forms, or fast. Estimates are normals, turned to the
/// viewpoint, and curvatures.
pub(crate) trait Engine {
    /// The threads.
    fn workers(&self) -> &Workers;

    /// Every pixel's window, 0 for none, as a radius, or in PCL's semantics as a side; and its estimate.
    fn windows(&mut self, sizes: &mut Vec<u32>, estimates: &mut Vec<[f32; 4]>)
    -> Result<(), Error>;

    /// The even windows of the needed blocks.
    fn even_windows(
        &mut self,
        cloud: &Cloud,
        asked: &Asked,
        needed: &[bool],
        windows: &mut Vec<EvenWindow>,
    ) -> Result<(), Error>;

    /// The block whose window each pixel takes, or [`NO_WINDOW`].
    fn choices(&mut self, even: &EvenWindows, choices: &mut Vec<u32>) -> Result<(), Error>;

    /// The estimates of windows around blocks' middle pixels, for the blocks that have one, by their radii.
    fn of_blocks(
        &mut self,
        blocks: &Blocks,
        radii: &[u32],
        estimates: &mut Vec<[f32; 4]>,
    ) -> Result<(), Error>;
}

/// The tables of the image, kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct SecondPass {
    /// The first pass' windows and estimates.
    sizes: Vec<u32>,
    estimates: Vec<[f32; 4]>,
    normals: SummedNormals,
    /// The pixels that another window may serve better than their own.
    concerned: Vec<bool>,
    /// As [`Asked`] has them.
    wanted: Vec<u32>,
    levels: Vec<u8>,
    depth_changes: DepthChanges,
    needed: Vec<bool>,
    windows: Vec<EvenWindow>,
    choices: Vec<u32>,
    /// The radii of the windows that some pixel takes, and their estimates.
    taken: Vec<u32>,
    second: Vec<[f32; 4]>,
}

/// As often as a radius can be halved.
const EVERY_LEVEL: u8 = u32::BITS as u8;

/// A crease does not bound the windows next to it as a depth change does: of the sizes that are tried, these many.
const CREASE_LEVELS: u8 = 2;

impl SecondPass {
    /// Bytes held.
    pub fn size(&self) -> usize {
        bytes(&self.sizes)
            + bytes(&self.estimates)
            + self.normals.size()
            + bytes(&self.concerned)
            + bytes(&self.wanted)
            + bytes(&self.levels)
            + self.depth_changes.size()
            + bytes(&self.needed)
            + bytes(&self.windows)
            + bytes(&self.choices)
            + bytes(&self.taken)
            + bytes(&self.second)
    }

    /// Makes what [`SecondPass::estimate`] gives those of other points.
    pub fn compute(
        &mut self,
        cloud: &Cloud,
        options: &Options,
        engine: &mut impl Engine,
    ) -> Result<(), Error> {
        engine.windows(&mut self.sizes, &mut self.estimates)?;
        if !asks(options) {
            return refill(&mut self.choices, repeat_n(NO_WINDOW, self.estimates.len()));
        }
        let blocks = Blocks::of(cloud.width, cloud.height);
        self.concern(cloud, &blocks, options, engine.workers())?;
        let SecondPass {
            concerned,
            wanted,
            levels,
            depth_changes,
            needed,
            windows,
            choices,
            taken,
            second,
            ..
        } = self;
        find_depth_changes(depth_changes, cloud, options, engine.workers())?;
        depth_changes.drop_explained(cloud, engine.workers());
        let clean = depth_changes.clean_radii(cloud.width, cloud.height)?;
        let least_noise = Asked::least_noise(options.paper.alpha);
        let limit = options.paper.largest_radius;
        let asked = Asked { blocks, concerned, wanted, levels, clean, limit, least_noise };
        asked.needed(needed)?;
        engine.even_windows(cloud, &asked, needed, windows)?;
        let even = EvenWindows { cloud, asked: &asked, options, windows };
        engine.choices(&even, choices)?;
        refill(taken, repeat_n(0, blocks.count()))?;
        // Marked first, as many pixels take the same.
        for block in choices.iter().filter(|choice| **choice != NO_WINDOW) {
            taken[*block as usize] = 1;
        }
        for (block, radius) in taken.iter_mut().enumerate().filter(|(_, taken)| **taken > 0) {
            *radius = even.radius(block);
        }
        engine.of_blocks(&blocks, taken, second)
    }

    /// Finds the pixels that another window may serve better than their own.
    fn concern(
        &mut self,
        cloud: &Cloud,
        blocks: &Blocks,
        options: &Options,
        workers: &Workers,
    ) -> Result<(), Error> {
        let SecondPass { estimates, sizes, wanted, concerned, levels, normals, .. } = self;
        if options.crease_windows {
            normals.sum(estimates, blocks, workers)?;
        }
        refill(concerned, repeat_n(false, sizes.len()))?;
        refill(wanted, repeat_n(0, blocks.count()))?;
        refill(levels, repeat_n(0, blocks.count()))?;
        let (estimates, sizes, normals) = (&*estimates, &*sizes, &*normals);
        // The window and the level of a block; marks its pixels, of which `concerned` starts with number `first`.
        let concern = |pixels: [usize; BLOCK * BLOCK], first: usize, concerned: &mut [bool]| {
            let has_window = |at: usize| sizes[at] > 0 && !cloud.is_missing(at);
            let middle = pixels[MIDDLE * BLOCK + MIDDLE];
            let with_window = || once(middle).chain(pixels).find(|at| has_window(*at));
            let normals_vary =
                |at: usize| normals.vary_in(&window_of_size(cloud, options, at, sizes[at]));
            let is_near_crease = options.crease_windows && with_window().is_some_and(normals_vary);
            let (mut largest, mut level) = (0, 0);
            for at in pixels {
                let size = wanted_size(cloud, options, at);
                largest = size.max(largest);
                let has_none = || estimates[at][0].is_nan() && !cloud.is_missing(at);
                if options.one_sided_windows && (sizes[at] < size || has_none()) {
                    concerned[at - first] = true;
                    level = EVERY_LEVEL;
                } else if is_near_crease && has_window(at) {
                    concerned[at - first] = true;
                    level = CREASE_LEVELS.max(level);
                }
            }
            (radius_of_size(largest, options).min(options.paper.largest_radius), level)
        };
        let rows = concerned.chunks_mut(BLOCK * cloud.width).enumerate();
        let of_blocks = wanted.chunks_mut(blocks.across).zip(levels.chunks_mut(blocks.across));
        workers.each(rows.zip(of_blocks), |((row, concerned), (wanted, levels))| {
            for (column, (wanted, level)) in wanted.iter_mut().zip(levels).enumerate() {
                let pixels = blocks.pixels((column, row));
                (*wanted, *level) = concern(pixels, row * BLOCK * cloud.width, concerned);
            }
        });
        Ok(())
    }

    /// The estimate of a pixel, turned to the viewpoint: near depth changes and near creases from even windows, as the
    /// options ask.
    pub fn estimate(&self, cloud: &Cloud, options: &Options, at: usize) -> Estimate {
        let found: Estimate = (*self.found(at)).into();
        if found.normal[0].is_nan() {
            return self.estimate_around(cloud, options, at);
        }
        // What the first pass found is turned already.
        let normal = turn_to_viewpoint(found.normal, cloud.points[at], options.viewpoint);
        Estimate { normal, ..found }
    }

    /// What the window that a pixel takes gave, or without one the first pass.
    #[inline(always)]
    pub fn found(&self, at: usize) -> &[f32; 4] {
        let choice = self.choices[at];
        if choice == NO_WINDOW { &self.estimates[at] } else { &self.second[choice as usize] }
    }

    /// The estimate of a pixel whose window has no normal.
    fn estimate_around(&self, cloud: &Cloud, options: &Options, at: usize) -> Estimate {
        let first = self.estimates[at];
        if !first[0].is_nan() || !options.one_sided_windows || cloud.is_missing(at) {
            return first.into();
        }
        let pixel = (at % cloud.width, at / cloud.width);
        let same = |depth: f32, difference: f32, distance: usize| {
            !is_depth_change(depth, difference, distance.max(1), options)
        };
        let Some(found) = surroundings::plane_around(cloud, pixel, same) else {
            return first.into();
        };
        let normal = turn_to_viewpoint(found.normal, cloud.points[at], options.viewpoint);
        let has_curvature = options.method == Method::CovarianceMatrix;
        Estimate { normal, curvature: if has_curvature { found.curvature } else { f32::NAN } }
    }
}

/// Whether the options ask for a second pass.
fn asks(options: &Options) -> bool {
    options.one_sided_windows || options.crease_windows
}

/// The size that the window of a pixel has far from any depth change, as [`Engine::windows`] gives them; 0 at a
/// missing point.
fn wanted_size(cloud: &Cloud, options: &Options, at: usize) -> u32 {
    match options.semantics {
        Semantics::Paper => smoothing_area::depth_radius(cloud.depths[at], &options.paper) as u32,
        Semantics::Pcl => {
            crate::smoothing_area::window_side(f32::INFINITY, cloud.points[at][2], options)
        }
    }
}

/// The radius of a window of a size as [`Engine::windows`] gives them.
fn radius_of_size(size: u32, options: &Options) -> u32 {
    match options.semantics {
        Semantics::Paper => size,
        Semantics::Pcl => size / 2,
    }
}

/// The window of a size as [`Engine::windows`] gives them, without what lies outside the image.
fn window_of_size(cloud: &Cloud, options: &Options, at: usize, size: u32) -> Rect {
    let (width, height) = (cloud.width, cloud.height);
    let (pixel, size) = ((at % width, at / width), size as usize);
    match options.semantics {
        Semantics::Paper => window(pixel, size, width, height),
        Semantics::Pcl => rect_around(pixel, (size, size), (width, height)),
    }
}
