//! The second pass: normals near depth changes and near creases, from even windows.

use std::iter::repeat_n;
use std::ops::Range;

use super::bends::{BEND_REACH, Bends};
use super::blocks::{BLOCK, Blocks, MIDDLE};
use super::choices::{EvenWindows, NO_WINDOW};
use super::cloud::Cloud;
use super::depth_change::DepthChanges;
use super::even_windows::{Asked, EvenWindow};
use super::marks::{Marks, WORD, from, word_of};
use super::noise::{FARTHEST, Noise};
use super::{is_depth_change, smoothing_area, surroundings};
use crate::Error;
use crate::cloud::Points;
use crate::memory::{bytes, refill, resize};
use crate::methods::Estimate;
use crate::options::{Method, Options, Semantics};
use crate::orientation::turn_to_viewpoint;
use crate::plain::of_own_window;
use crate::threads::Workers;

/// How windows and their estimates are computed: by the plain forms, or fast. Estimates are normals, not turned, and
/// curvatures.
pub(crate) trait Engine: Sync {
    /// The threads.
    fn workers(&self) -> &Workers;

    /// Finds the sizes of all pixels' own windows.
    fn find_sizes(&mut self) -> Result<(), Error>;

    /// Those that were found of a row's pixels: whole numbers, 0 for none, as a radius, or in PCL's semantics as a side.
    fn sizes(&self, y: usize) -> &[f32];

    /// The depth changes of a cloud.
    fn find_depth_changes(&self, changes: &mut DepthChanges, cloud: &Cloud) -> Result<(), Error>;

    /// The even windows of all blocks, and their estimates. It may write those of the pixels that are not `concerned` along
    /// with them.
    fn even_windows(
        &mut self,
        cloud: &Cloud,
        asked: &Asked,
        concerned: &Marks,
        found: &mut Windows,
    ) -> Result<(), Error>;

    /// The block whose window each pixel takes, or [`NO_WINDOW`].
    fn choices(&mut self, even: &EvenWindows, choices: &mut [u32]);
}

/// The even windows, block by block, and what they give.
#[derive(Debug, Default)]
pub(crate) struct Windows {
    pub even: Vec<EvenWindow>,
    pub of_even: Vec<[f32; 4]>,
}

impl Windows {
    /// Bytes held.
    fn size(&self) -> usize {
        let Windows { even, of_even } = self;
        bytes(even) + bytes(of_even)
    }
}

/// The tables of the image, kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct SecondPass {
    depth_changes: DepthChanges,
    /// As [`Asked`] has them.
    wanted: Vec<u32>,
    windows: Windows,
    bends: Bends,
    /// As [`EvenWindows`] has them.
    concerned: Marks,
    levels: Vec<u8>,
    choices: Vec<u32>,
}

/// As often as a radius can be halved.
const EVERY_LEVEL: u8 = u32::BITS as u8;

/// On a round surface a window beside a pixel is worth more than its own only where that is less than this share of what the
/// depth asks for.
const SMALL_ON_ROUND: f32 = 1.0 / 3.0;

/// A crease does not bound the windows next to it as a depth change does: of the sizes that are tried, these many.
const CREASE_LEVELS: u8 = 3;

impl SecondPass {
    /// Bytes held.
    pub fn size(&self) -> usize {
        self.depth_changes.size()
            + bytes(&self.wanted)
            + self.windows.size()
            + self.bends.size()
            + self.concerned.size()
            + bytes(&self.levels)
            + bytes(&self.choices)
    }

    /// Finds which even windows the pixels of other points take, and their estimates.
    pub fn compute(
        &mut self,
        cloud: &Cloud,
        options: &Options,
        engine: &mut impl Engine,
    ) -> Result<(), Error> {
        let SecondPass { depth_changes, wanted, windows, bends, concerned, levels, .. } = self;
        engine.find_sizes()?;
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
        // Windows of whole blocks, and those that tell the noise, reach somewhat farther than small ones.
        let farthest = limit.max((BEND_REACH * BLOCK + MIDDLE).max(FARTHEST) as u32);
        let clean = depth_changes.clean(size, farthest, engine.workers())?;
        let blocks = Blocks::of(cloud.width, cloud.height);
        find_wanted(wanted, cloud, &blocks, options, engine.workers())?;
        let has_curvature = options.method == Method::CovarianceMatrix;
        let noise = Noise::of(cloud, &blocks, &clean, options.paper.alpha);
        let asked = Asked { blocks, wanted, clean, limit, noise, has_curvature };
        // PCL's AVERAGE_DEPTH_CHANGE is farther off on round surfaces than windows beside the pixel are.
        let is_off =
            options.semantics == Semantics::Pcl && options.method == Method::AverageDepthChange;
        let reach = |block| if is_off { 0 } else { asked.clean_blocks(block) };
        bends.find(cloud, options.paper.alpha, &blocks, reach, engine.workers())?;
        concerned.clear(size)?;
        refill(levels, repeat_n(0, blocks.count()))?;
        let sizes = &|y: usize| engine.sizes(y);
        let concern = Concern { cloud, options, asked: &asked, sizes, bends };
        concern.find(concerned, levels, engine.workers());
        resize(&mut self.choices, cloud.depths.len(), NO_WINDOW)?;
        engine.even_windows(cloud, &asked, concerned, windows)?;
        // From here on CM needs no more memory: something may have been written.
        let Windows { even: windows, of_even, .. } = windows;
        let even = EvenWindows { cloud, asked: &asked, options, concerned, levels, windows };
        engine.choices(&even, &mut self.choices);
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

    /// The blocks whose even windows the pixels take, or [`NO_WINDOW`]: then what counts is the own one.
    pub fn choices(&self) -> &[u32] {
        &self.choices
    }

    /// The estimates of the even windows, block by block.
    pub fn of_even(&self) -> &[[f32; 4]] {
        &self.windows.of_even
    }

    /// The estimate of a pixel, turned to the viewpoint, if it takes an even window, or none as it has no window at all: its own
    /// is of this size.
    pub fn chosen(
        &self,
        cloud: &Cloud,
        options: &Options,
        at: usize,
        size: f32,
    ) -> Option<Estimate> {
        let choice = self.choices[at];
        if choice == NO_WINDOW {
            return (size == 0.0).then_some(Estimate::NONE);
        }
        let found = self.windows.of_even[choice as usize].into();
        Some(turn_to_viewpoint(found, cloud.points[at], options.viewpoint))
    }

    /// The estimate of a pixel that takes no even window, but could: from its own, which is of this size.
    pub fn left(
        &self,
        points: &Points,
        options: &Options,
        pixel: (usize, usize),
        size: f32,
    ) -> Option<Estimate> {
        let may_be_chosen = self.may_be_chosen(options, pixel) & 1 != 0;
        may_be_chosen.then(|| of_own_window(points, options, pixel, size))
    }

    /// The marks, from a pixel to the end of the word, of those that could take an even window: with CM in the paper's semantics
    /// the others are written along with the even windows.
    #[inline(always)]
    pub fn may_be_chosen(&self, options: &Options, (x, y): (usize, usize)) -> u64 {
        if options.is_cm_of_paper() { from(self.concerned.row(y), x) } else { u64::MAX }
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
    /// As [`Engine::sizes`].
    sizes: &'a (dyn Fn(usize) -> &'a [f32] + Sync),
    bends: &'a Bends,
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
        let &Concern { cloud, options, asked, bends, .. } = self;
        let columns = word * WORD..cloud.width.min((word + 1) * WORD);
        let mut lines = [const { (0, 0..0) }; BLOCK];
        for (line, y) in lines.iter_mut().zip(row * BLOCK..cloud.height) {
            *line = (y, columns.clone());
        }
        let any = |of_lines: &[u64; BLOCK]| of_lines.iter().fold(0, |any, marks| any | marks);
        let mut small = 0;
        if options.one_sided_windows {
            *concerned = lines.clone().map(|line| self.with_windows_below(1.0, line));
            small = any(concerned);
        }
        if options.crease_windows {
            for (concerned, line) in concerned.iter_mut().zip(lines.clone()) {
                *concerned |= self.with_windows(line);
            }
        }
        let (some, mut round) = (any(concerned), 0);
        for (block, level) in levels.iter_mut().enumerate() {
            let of_block = ((1 << BLOCK) - 1) << (block * BLOCK);
            let place = (columns.start / BLOCK + block, row);
            if some & of_block != 0 {
                *level = if small & of_block != 0 { EVERY_LEVEL } else { CREASE_LEVELS };
                round |= if bends.is_round(&asked.blocks, place) { of_block } else { 0 };
            }
        }
        if round != 0 {
            for (concerned, line) in concerned.iter_mut().zip(lines) {
                *concerned &= !round | self.with_windows_below(SMALL_ON_ROUND, line);
            }
        }
    }

    /// The marks of the pixels of a row, in these columns, that have a window.
    fn with_windows(&self, (y, columns): (usize, Range<usize>)) -> u64 {
        word_of((self.sizes)(y)[columns].iter().map(|size| *size > 0.0))
    }

    /// Those whose windows are smaller than this share of what their depths ask for.
    fn with_windows_below(&self, share: f32, (y, columns): (usize, Range<usize>)) -> u64 {
        let &Concern { cloud, sizes, .. } = self;
        let depths = &cloud.depths[y * cloud.width..][columns.clone()];
        // The loop's own: it is vectorized.
        let options = self.options.clone();
        let found = depths.iter().zip(&sizes(y)[columns]);
        // Sizes are whole numbers.
        word_of(found.map(|(depth, size)| size + 1.0 <= share * wanted_size(*depth, &options)))
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

/// The size that the window of a pixel of this depth has far from any depth change, as [`Engine::sizes`] has it but
/// for a fraction.
fn wanted_size(depth: f32, options: &Options) -> f32 {
    match options.semantics {
        Semantics::Paper => smoothing_area::depth_radius(depth, &options.paper),
        Semantics::Pcl => crate::smoothing_area::window_side(f32::INFINITY, depth, options) as f32,
    }
}

/// The radius of a window of a size as [`Engine::sizes`] has it, at most the largest of all.
fn radius_of_size(size: f32, options: &Options) -> u32 {
    let radius = match options.semantics {
        Semantics::Paper => size as u32,
        Semantics::Pcl => size as u32 / 2,
    };
    radius.min(options.paper.largest_radius)
}
