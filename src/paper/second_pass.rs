//! The second pass: normals near depth changes and near creases, from even windows.

use std::iter::repeat_n;
use std::ops::Range;

use super::blocks::{BLOCK, Blocks, MIDDLE};
use super::choices::{EvenWindows, NO_WINDOW};
use super::cloud::Cloud;
use super::creases::{BEND_REACH, SummedNormals};
use super::depth_change::DepthChanges;
use super::even_windows::{Asked, EvenWindow};
use super::marks::{Marks, WORD, word_of};
use super::{is_depth_change, of_radius, rect_around, smoothing_area, surroundings, window};
use crate::Error;
use crate::cloud::Points;
use crate::memory::{bytes, refill, resize};
use crate::methods::Estimate;
use crate::options::{Method, Options, Semantics};
use crate::orientation::turn_to_viewpoint;
use crate::rect::Rect;
use crate::threads::Workers;

/// How windows and their estimates are computed: by the plain forms, or fast. Estimates are normals, turned to the
/// viewpoint, and curvatures.
pub(crate) trait Engine {
    /// The threads.
    fn workers(&self) -> &Workers;

    /// The size of every pixel's own window, as [`Windows`] has them.
    fn sizes(&mut self, sizes: &mut Vec<f32>) -> Result<(), Error>;

    /// The depth changes of a cloud.
    fn find_depth_changes(&self, changes: &mut DepthChanges, cloud: &Cloud) -> Result<(), Error>;

    /// The even windows of all blocks; with their estimates if the method is CM. It may write the estimates of the pixels
    /// that are not `concerned` along with them.
    fn even_windows(
        &mut self,
        cloud: &Cloud,
        asked: &Asked,
        concerned: &Marks,
        found: &mut Windows,
    ) -> Result<(), Error>;

    /// The block whose window each pixel takes, or [`NO_WINDOW`].
    fn choices(&mut self, even: &EvenWindows, choices: &mut [u32]);

    /// The estimates of windows around blocks' middle pixels, for the blocks that have one, by their radii.
    fn of_blocks(
        &mut self,
        blocks: &Blocks,
        radii: &[u32],
        estimates: &mut Vec<[f32; 4]>,
    ) -> Result<(), Error>;
}

/// The windows, and what they give.
#[derive(Debug, Default)]
pub(crate) struct Windows {
    /// Of the pixels' own, whole numbers: 0 for none, as a radius, or in PCL's semantics as a side.
    pub sizes: Vec<f32>,
    /// Block by block.
    pub even: Vec<EvenWindow>,
    pub of_even: Vec<[f32; 4]>,
}

impl Windows {
    /// Bytes held.
    fn size(&self) -> usize {
        let Windows { sizes, even, of_even } = self;
        bytes(sizes) + bytes(even) + bytes(of_even)
    }
}

/// The tables of the image, kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct SecondPass {
    depth_changes: DepthChanges,
    /// As [`Asked`] has them.
    wanted: Vec<u32>,
    windows: Windows,
    normals: SummedNormals,
    /// As [`EvenWindows`] has them.
    concerned: Marks,
    levels: Vec<u8>,
    choices: Vec<u32>,
    /// Those of windows around the blocks' middle pixels whose estimates are asked for, 0 for none.
    radii: Vec<u32>,
}

/// As often as a radius can be halved.
const EVERY_LEVEL: u8 = u32::BITS as u8;

/// A crease does not bound the windows next to it as a depth change does: of the sizes that are tried, these many.
const CREASE_LEVELS: u8 = 3;

impl SecondPass {
    /// Bytes held.
    pub fn size(&self) -> usize {
        self.depth_changes.size()
            + bytes(&self.wanted)
            + self.windows.size()
            + self.normals.size()
            + self.concerned.size()
            + bytes(&self.levels)
            + bytes(&self.choices)
            + bytes(&self.radii)
    }

    /// Finds which even windows the pixels of other points take, and their estimates.
    pub fn compute(
        &mut self,
        cloud: &Cloud,
        options: &Options,
        engine: &mut impl Engine,
    ) -> Result<(), Error> {
        let SecondPass {
            depth_changes, wanted, windows, normals, concerned, levels, radii, ..
        } = self;
        engine.sizes(&mut windows.sizes)?;
        if !options.has_second_pass() {
            return refill(&mut self.choices, repeat_n(NO_WINDOW, cloud.depths.len()));
        }
        engine.find_depth_changes(depth_changes, cloud)?;
        // Where surfaces are so steep, SDC's own small windows are nearer to the truth than larger ones.
        if options.method != Method::AverageDepthChange {
            depth_changes.drop_explained(cloud, engine.workers());
        }
        let size = (cloud.width, cloud.height);
        let limit = options.paper.largest_radius;
        // Windows of whole blocks reach somewhat farther than small ones.
        let farthest = limit.max((BEND_REACH * BLOCK + MIDDLE) as u32);
        let clean = depth_changes.clean(size, farthest, engine.workers())?;
        let blocks = Blocks::of(cloud.width, cloud.height);
        find_wanted(wanted, cloud, &blocks, options, engine.workers())?;
        let least_noise = Asked::least_noise(options.paper.alpha);
        let asked = Asked { blocks, wanted, clean, limit, least_noise };
        if options.crease_windows {
            let radius = |block| sample_radius(&windows.sizes, cloud, &blocks, block, options);
            normals.sum_points(cloud, options.paper.alpha, &blocks, engine.workers())?;
            if options.is_cm_of_paper() {
                // They vary as much as CM's normals do, and need none of its sums. The other methods' own normals, and those
                // of PCL's windows, tell more.
                normals.sum_gradients(cloud, &blocks, radius, engine.workers())?;
            } else {
                refill(radii, (0..blocks.count()).map(|block| radius(blocks.place(block))))?;
                engine.of_blocks(&blocks, radii, &mut windows.of_even)?;
                normals.sum(&windows.of_even, &blocks, engine.workers())?;
            }
            normals.find_bends(&blocks, |block| asked.clean_blocks(block), engine.workers())?;
        }
        concerned.clear(size)?;
        refill(levels, repeat_n(0, blocks.count()))?;
        let concern = Concern { cloud, options, asked: &asked, sizes: &windows.sizes, normals };
        concern.find(concerned, levels, engine.workers());
        resize(&mut self.choices, cloud.depths.len(), NO_WINDOW)?;
        engine.even_windows(cloud, &asked, concerned, windows)?;
        // From here on CM needs no more memory: something may have been written.
        let of_even = &mut windows.of_even;
        let windows = &windows.even;
        let even = EvenWindows { cloud, asked: &asked, options, concerned, levels, windows };
        engine.choices(&even, &mut self.choices);
        if options.method != Method::CovarianceMatrix {
            refill(radii, repeat_n(0, blocks.count()))?;
            // Marked first, as many pixels take the same.
            for block in self.choices.iter().filter(|choice| **choice != NO_WINDOW) {
                radii[*block as usize] = 1;
            }
            for (block, radius) in radii.iter_mut().enumerate().filter(|(_, taken)| **taken > 0) {
                *radius = even.radius(block);
            }
            engine.of_blocks(&blocks, radii, of_even)?;
        }
        // A window may have no normal: but for rare ones, those that no pixel takes.
        let has_none = |block: usize| of_even[block][0].is_nan();
        if (0..blocks.count()).any(|block| even.radius(block) > 0 && has_none(block)) {
            let choices = self.choices.iter_mut().filter(|choice| **choice != NO_WINDOW);
            for choice in choices.filter(|choice| has_none(**choice as usize)) {
                *choice = NO_WINDOW;
            }
        }
        Ok(())
    }

    /// The sizes of the pixels' own windows, as [`Windows`] has them.
    pub fn sizes(&self) -> &[f32] {
        &self.windows.sizes
    }

    /// The blocks whose even windows the pixels take, or [`NO_WINDOW`]: then what counts is the own one.
    pub fn choices(&self) -> &[u32] {
        &self.choices
    }

    /// The pixels that could take an even window.
    pub fn concerned(&self) -> &Marks {
        &self.concerned
    }

    /// The estimates of the even windows that pixels take, turned to the viewpoint from the blocks' middle pixels.
    pub fn of_even(&self) -> &[[f32; 4]] {
        &self.windows.of_even
    }

    /// The estimate of a pixel, turned to the viewpoint, that takes an even window.
    pub fn chosen(&self, cloud: &Cloud, options: &Options, at: usize) -> Option<Estimate> {
        let choice = Some(self.choices[at]).filter(|choice| *choice != NO_WINDOW)?;
        let found = self.windows.of_even[choice as usize].into();
        Some(turn_to_viewpoint(found, cloud.points[at], options.viewpoint))
    }

    /// The estimate, in the paper's semantics, of a pixel that could take an even window but takes none.
    pub fn left(&self, points: &Points, options: &Options, at: usize) -> Option<Estimate> {
        let pixel = (at % points.width(), at / points.width());
        let is_left = self.concerned.has(pixel) && self.choices[at] == NO_WINDOW;
        is_left.then(|| of_radius(points, options, pixel, self.windows.sizes[at] as u32))
    }

    /// The estimate of a pixel that has a point but no normal, as `has_normal` says if no even window gave one: that of the
    /// plane through the points around it.
    pub fn estimate_around(
        &self,
        cloud: &Cloud,
        options: &Options,
        at: usize,
        has_normal: impl FnOnce() -> bool,
    ) -> Option<Estimate> {
        if self.choices[at] != NO_WINDOW || cloud.is_missing(at) || has_normal() {
            return None;
        }
        let pixel = (at % cloud.width, at / cloud.width);
        let depth = cloud.depths[at];
        let same = |difference, distance| {
            // PCL's threshold is wide near the camera: over some pixels it would reach across many a step.
            let is_small = options.semantics == Semantics::Pcl
                && !is_depth_change(depth, difference, 1, options);
            is_small
                || !smoothing_area::is_depth_change(depth, difference, distance, &options.paper)
        };
        let found = surroundings::plane_around(cloud, pixel, same)?;
        let has_curvature = options.method == Method::CovarianceMatrix;
        let curvature = if has_curvature { found.curvature } else { f32::NAN };
        let found = Estimate { curvature, ..found };
        Some(turn_to_viewpoint(found, cloud.points[at], options.viewpoint))
    }
}

/// Which pixels another window may serve better than their own.
struct Concern<'a> {
    cloud: &'a Cloud,
    options: &'a Options,
    asked: &'a Asked<'a>,
    /// As [`Windows`] has them.
    sizes: &'a [f32],
    normals: &'a SummedNormals,
}

impl Concern<'_> {
    /// Marks them, and the levels of their blocks.
    fn find(&self, concerned: &mut Marks, levels: &mut [u8], workers: &Workers) {
        let (words, across) = (concerned.stride(), self.asked.blocks.across);
        let bands = concerned.bands(BLOCK).zip(levels.chunks_mut(across));
        workers.each(bands.enumerate(), |(row, (concerned, levels))| {
            for (word, levels) in levels.chunks_mut(WORD / BLOCK).enumerate() {
                let mut of_lines = [0; BLOCK];
                self.find_in_word((word, row), &mut of_lines, levels);
                let lines = concerned.chunks_mut(words);
                lines.zip(of_lines).for_each(|(line, marks)| line[word] = marks);
            }
        });
    }

    /// As [`Concern::find`], for the blocks whose lines are a word of marks, in a row of blocks. `concerned` are those words;
    /// none is marked so far.
    fn find_in_word(
        &self,
        (word, row): (usize, usize),
        concerned: &mut [u64; BLOCK],
        levels: &mut [u8],
    ) {
        let &Concern { cloud, options, sizes, .. } = self;
        let columns = word * WORD..cloud.width.min((word + 1) * WORD);
        let lines = row * BLOCK..cloud.height.min((row + 1) * BLOCK);
        let pixels = |y: usize| y * cloud.width + columns.start..y * cloud.width + columns.end;
        if options.one_sided_windows {
            for (concerned, y) in concerned.iter_mut().zip(lines.clone()) {
                *concerned = self.with_small_windows(pixels(y));
            }
        }
        let is_one_sided = concerned.iter().fold(0, |any, line| any | line);
        let mut beside_creases = 0;
        for (block, level) in levels.iter_mut().enumerate() {
            let of_block = ((1 << BLOCK) - 1) << (block * BLOCK);
            *level = if is_one_sided & of_block != 0 { EVERY_LEVEL } else { 0 };
            let column = columns.start / BLOCK + block;
            if options.crease_windows && self.is_beside_crease((column, row)) {
                beside_creases |= of_block;
                *level = CREASE_LEVELS.max(*level);
            }
        }
        if beside_creases != 0 {
            for (concerned, y) in concerned.iter_mut().zip(lines) {
                let have_windows = word_of(sizes[pixels(y)].iter().map(|size| *size > 0.0));
                *concerned |= beside_creases & have_windows;
            }
        }
    }

    /// The marks of the pixels whose windows are smaller than their depths ask for.
    fn with_small_windows(&self, pixels: Range<usize>) -> u64 {
        let &Concern { cloud, sizes, .. } = self;
        // The loop's own: it is vectorized.
        let options = self.options.clone();
        let found = cloud.depths[pixels.clone()].iter().zip(&sizes[pixels]);
        // Sizes are whole numbers.
        word_of(found.map(|(depth, size)| size + 1.0 <= wanted_size(*depth, &options)))
    }

    /// Whether normals vary strongly around a block whose surface is not round.
    fn is_beside_crease(&self, block: (usize, usize)) -> bool {
        self.normals_vary(block) && !self.normals.bend_alike(&self.asked.blocks, block)
    }

    /// Whether normals vary where the window of a block's middle pixel is, or else of its first one that has a window.
    fn normals_vary(&self, block: (usize, usize)) -> bool {
        let &Concern { cloud, options, asked: &Asked { blocks, .. }, sizes, normals } = self;
        let (mut x, mut y) = blocks.middle_of(block);
        let mut size = sizes[cloud.index(x, y)];
        if size == 0.0 {
            let has_window = |at: &usize| sizes[*at] > 0.0;
            let Some(at) = blocks.pixels(block).into_iter().find(has_window) else { return false };
            (x, y, size) = (at % cloud.width, at / cloud.width, sizes[at]);
        }
        normals.vary_in(&windows_of_block(cloud, options, (x, y), size))
    }
}

/// Blocks whose depths are looked at together.
const TOGETHER: usize = 8;

/// The radii that the depths ask for, block by block: the largest of a block's pixels.
fn find_wanted(
    wanted: &mut Vec<u32>,
    cloud: &Cloud,
    blocks: &Blocks,
    options: &Options,
    workers: &Workers,
) -> Result<(), Error> {
    refill(wanted, repeat_n(0, blocks.count()))?;
    let is_paper = options.semantics == Semantics::Paper;
    let rows = cloud.depths.chunks(BLOCK * cloud.width);
    workers.each(wanted.chunks_mut(blocks.across).zip(rows), |(wanted, rows)| {
        for (wanted, first) in wanted.chunks_mut(TOGETHER).zip((0..).step_by(TOGETHER * BLOCK)) {
            // Where the depth asks for most, in each column.
            let mut most = [f32::NEG_INFINITY; TOGETHER * BLOCK];
            for row in rows.chunks(cloud.width) {
                for (most, depth) in most.iter_mut().zip(&row[first..]) {
                    let depth = if is_paper { depth.abs() } else { *depth };
                    *most = if depth > *most { depth } else { *most };
                }
            }
            for (wanted, columns) in wanted.iter_mut().zip(most.chunks(BLOCK)) {
                let most = columns.iter().fold(f32::NEG_INFINITY, |most, depth| most.max(*depth));
                if most > f32::NEG_INFINITY {
                    *wanted = radius_of_size(wanted_size(most, options), options);
                }
            }
        }
    });
    Ok(())
}

/// The radius of the window with which the normal of a block is looked at: the smallest one that its middle pixel or a
/// corner has, the least there is where the middle has no window, and at most half the largest, as normals of fine relief are
/// alike in larger ones; 0 where it has no point.
fn sample_radius(
    sizes: &[f32],
    cloud: &Cloud,
    blocks: &Blocks,
    block: (usize, usize),
    options: &Options,
) -> u32 {
    let pixels = blocks.pixels(block);
    let middle = pixels[MIDDLE * BLOCK + MIDDLE];
    if cloud.is_missing(middle) {
        return 0;
    }
    let mut size = sizes[middle];
    for corner in [0, BLOCK - 1, BLOCK * (BLOCK - 1), BLOCK * BLOCK - 1] {
        let other = sizes[pixels[corner]];
        size = if other > 0.0 && other < size { other } else { size };
    }
    radius_of_size(size, options).min(options.paper.largest_radius / 2).max(1)
}

/// The size that the window of a pixel of this depth has far from any depth change, as [`Windows`] has them but for
/// a fraction.
fn wanted_size(depth: f32, options: &Options) -> f32 {
    match options.semantics {
        Semantics::Paper => smoothing_area::depth_radius(depth, &options.paper),
        Semantics::Pcl => crate::smoothing_area::window_side(f32::INFINITY, depth, options) as f32,
    }
}

/// The radius of a window of a size as [`Windows`] has them, at most the largest of all.
fn radius_of_size(size: f32, options: &Options) -> u32 {
    let radius = match options.semantics {
        Semantics::Paper => size as u32,
        Semantics::Pcl => size as u32 / 2,
    };
    radius.min(options.paper.largest_radius)
}

/// What the windows of the pixels next to one, as many as are in a block, cover of the image, if they have its size, as
/// [`Windows`] has them.
fn windows_of_block(cloud: &Cloud, options: &Options, pixel: (usize, usize), size: f32) -> Rect {
    let (width, height, size) = (cloud.width, cloud.height, size as usize);
    match options.semantics {
        Semantics::Paper => window(pixel, size + MIDDLE, width, height),
        Semantics::Pcl => {
            let side = size + 2 * MIDDLE;
            rect_around(pixel, (side, side), (width, height))
        }
    }
}
