//! The paper's windows and methods, fast: depths (`depths`), the radii of the windows of the whole image (`windows`, in
//! `chunks` of rows), then tile by tile, and if need be layer by layer (`layers`), integral images of the method's
//! channels (`integrals`, `methods`), which points are there (`presence`), the windows' sums (`rects`) and the normals
//! (`tile`). For the second pass (`engine`), its depth changes (`depth_changes`), even windows (`even_windows`), which
//! of them each pixel takes (`choices`, of `candidates` for `block_pixels`), and their normals written to the pixels
//! (`chosen`).

mod block_pixels;
mod candidates;
mod choices;
mod chosen;
mod chunks;
mod depth_changes;
mod depths;
mod engine;
mod even_windows;
mod integrals;
mod layers;
mod methods;
mod presence;
mod rects;
mod tile;
mod windows;

use std::iter::repeat_with;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

pub(crate) use engine::FastEngine;

use chosen::ChosenRow;
use chunks::{Chunk, place, share_out};
use depths::{OneRow, PointRows, room_for_columns, row_length};
use even_windows::{Even, EvenTile};
use integrals::{Rings, elements_of_rings, presence_of_rings, rows_of_rings};
use layers::{Layer, Waiting};
use methods::{CovarianceMatrix, Gradients, MOMENTS, SmoothedDepthChanges, Sums};
use tile::{Tile, Written};
use windows::{Rows, Sweep, reach};

use super::buffer::Buffer;
use super::paths::{self, Task};
use super::sink::Sink;
use super::tiling::{Tiling, part, reached};
use super::windows::Sides;
use super::{Job, lock};
use crate::Error;
use crate::cloud::{Normals, Points};
use crate::memory::{bytes, resize};
use crate::options::{DistanceMetric, Method, Options, PaperOptions};
use crate::output::Output;
use crate::paper::{BLOCK, Blocks, Cloud, Marks, NO_WINDOW, PaperMaps, SecondPass, WORD, word_of};
use crate::simd::{GROUP, Groups};

/// Floats hold the indices of a tile's rings, of four of the largest radii and what those reach, and less than a hundred more.
const _: () = {
    let radius = PaperOptions::MOST_RADIUS as usize;
    assert!((6 * radius + 100) * (2 * radius + 3) < 1 << 24);
};

/// Rows of a tile: windows reach farther than PCL's, and more rows around it are summed again for the next one.
const TILE_ROWS: usize = 256;

/// There is room for windows of this radius from the first frame on, if they are asked for. (Those of larger ones may take
/// hundreds of megabytes.)
const ROOMY_RADIUS: usize = 64;

/// Bytes of a tile's rings, found by trying: with less, more of the pixels around narrow tiles are summed twice; with more,
/// rings leave a second-level cache of 2 MiB, and CM takes a tenth more time there. (Where that cache is smaller but the
/// third level is fast, twice as much is a few percent better.)
const RING_BYTES: usize = 3 << 19;

/// Rows of the whole image: depths, and the radii of windows.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    depths: Buffer<f32>,
    /// Row by row the least and the largest of their magnitudes.
    ranges: Vec<[f32; 2]>,
    /// 0 for none; for the second pass in PCL's semantics, the windows' sides.
    pub radii: Buffer<f32>,
    /// The largest of them.
    largest: usize,
    chunks: Vec<Chunk>,
    /// The pixels that the second pass leaves to their own windows.
    pub left: Marks,
}

impl Scratch {
    /// The rows of depths of a cloud's points, to be read.
    fn rows(
        &mut self,
        points: &Points,
    ) -> Result<impl Iterator<Item = (&mut [f32], &mut [f32; 2])> + Send, Error> {
        let Scratch { depths, ranges, .. } = self;
        let (length, height) = (row_length(points.width()), points.height());
        depths.grow(length * height)?;
        resize(ranges, height, [0.0; 2])?;
        Ok(depths[..length * height].chunks_mut(length).zip(ranges))
    }

    /// Rows for the sizes of the windows of a cloud's pixels, to be filled and put back, and the elements from one row to the next.
    pub fn take_sizes(&mut self, points: &Points) -> Result<(Buffer<f32>, usize), Error> {
        let Scratch { radii, chunks, .. } = self;
        let (length, height) = (row_length(points.width()), points.height());
        share_out(height, 1, height, chunks)?;
        radii.grow(length * height)?;
        Ok((std::mem::take(radii), length))
    }

    /// In PCL's semantics, the sides of the windows of a cloud's pixels.
    pub fn sides(&self, width: usize) -> Sides<'_> {
        Sides { rows: &self.radii, length: row_length(width), first: 0 }
    }

    /// The least and the largest magnitude of the depths of these rows.
    pub fn depths_of(&self, rows: Range<usize>) -> [f32; 2] {
        self.ranges[rows].iter().fold([f32::INFINITY, 0.0], |[nearest, deepest], row| {
            [row[0].min(nearest), row[1].max(deepest)]
        })
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        let Scratch { depths, ranges, radii, chunks, left, .. } = self;
        depths.size() + bytes(ranges) + radii.size() + bytes(chunks) + left.size()
    }
}

/// What one worker needs.
#[derive(Debug, Default)]
pub(crate) struct WorkerScratch {
    sweep: Sweep,
    moments: Rings<MOMENTS>,
    gradients: Rings<8>,
    depth_changes: Rings<4>,
    waiting: Waiting,
    choices: choices::Scratch,
    columns: Buffer<f32>,
}

impl WorkerScratch {
    /// Bytes held.
    pub fn size(&self) -> usize {
        self.sweep.size()
            + self.moments.size()
            + self.gradients.size()
            + self.depth_changes.size()
            + self.waiting.size()
            + self.choices.size()
            + self.columns.size()
    }
}

/// The normals of a job.
pub(crate) fn compute(
    job: &Job,
    output: Output,
    scratch: &mut super::Scratch,
) -> Result<(), Error> {
    job.depths(scratch)?;
    job.radii(scratch)?;
    job.tiles(scratch, output, false)
}

/// Finds the pixels that take no even window but have one of their own.
pub(crate) fn find_left(
    job: &Job,
    choices: &[u32],
    scratch: &mut super::Scratch,
) -> Result<(), Error> {
    let (width, height) = (job.points.width(), job.points.height());
    let mut left = std::mem::take(&mut scratch.paper.left);
    left.clear((width, height))?;
    let rows = left.rows().zip(choices.chunks(width)).enumerate();
    scratch.workers.each(rows, |(y, (left, choices))| {
        let sizes = job.sizes(scratch, y).chunks(WORD);
        for (left, (choices, sizes)) in left.iter_mut().zip(choices.chunks(WORD).zip(sizes)) {
            // Mostly all take one.
            if choices.contains(&NO_WINDOW) {
                let pixels = choices.iter().zip(sizes);
                *left = word_of(pixels.map(|(choice, size)| *choice == NO_WINDOW && *size > 0.0));
            }
        }
    });
    scratch.paper.left = left;
    Ok(())
}

/// As [`compute`], of the pixels that [`find_left`] has found, in the windows that [`Job::radii`] has; the others are not
/// written.
pub(crate) fn compute_left(
    job: &Job,
    output: Output,
    scratch: &mut super::Scratch,
) -> Result<(), Error> {
    job.tiles(scratch, output, true)
}

/// Writes the normals of the pixels that take even windows, and none for those that have no window; if their points are given,
/// those of pixels left; and with one-sided windows those of pixels that have none then, from the points around them.
pub(crate) fn write_chosen(
    job: &Job,
    second_pass: &SecondPass,
    cloud: &Cloud,
    normals: &Normals,
    of_left: Option<&Points>,
    scratch: &super::Scratch,
) {
    let options = job.options;
    scratch.workers.for_each(cloud.height, |_, y| {
        let sizes = job.sizes(scratch, y);
        let row = ChosenRow { cloud, options, second_pass, normals, y, sizes, of_left };
        // SAFETY: the processor has the instruction set, and every row falls to one thread.
        unsafe { paths::run(job.isa, row) };
    });
}

/// Makes a cloud that of the job's points, as [`Cloud::read`]. If it is to have a second pass, the job's depths are read too.
pub(crate) fn read_cloud(
    job: &Job,
    cloud: &mut Cloud,
    scratch: &mut super::Scratch,
) -> Result<(), Error> {
    let &Job { isa, points, options } = job;
    cloud.resize(points, options)?;
    let super::Scratch { workers, each, paper, .. } = scratch;
    let &mut Cloud { width, height, has_range, .. } = cloud;
    let mut padded = if options.has_second_pass() { Some(paper.rows(points)?) } else { None };
    let across = Blocks::of(width, height).across;
    for scratch in &each[..workers.count()] {
        lock(scratch).paper.columns.grow(room_for_columns(across))?;
    }
    let rows = cloud.points.chunks_mut(BLOCK * width);
    let rows = rows.zip(cloud.depths.chunks_mut(BLOCK * width));
    let sums = cloud.sums.chunks_mut(across).chain(repeat_with(Default::default));
    // As many rows at a time as a block has.
    let padded = std::iter::from_fn(|| {
        Some(std::array::from_fn::<_, BLOCK, _>(|_| padded.as_mut().and_then(Iterator::next)))
    });
    let rows = rows.zip(sums).zip(padded).enumerate();
    workers.share(rows, |worker, rows| {
        let columns = &mut lock(&each[worker]).paper.columns;
        for (row, (((to, depths), sums), padded)) in rows {
            let rows = to.chunks_mut(width).zip(depths.chunks_mut(width)).zip(padded).enumerate();
            let mut rows = rows.map(|(line, ((to, depths), padded))| {
                let from = points.row(row * BLOCK + line, 0..width);
                OneRow { from, points: to, depths, padded }
            });
            let rows = PointRows { rows: &mut rows, sums, columns, options, has_range };
            // SAFETY: the processor has the instruction set.
            unsafe { paths::run(isa, rows) };
        }
    });
    Ok(())
}

/// Tiles for windows that reach so far from their pixels, in rings of so many bytes a column and row.
fn tiling(width: usize, height: usize, reach: usize, column: usize) -> Tiling {
    let ring = rows_of_rings(reach, height);
    let columns = (RING_BYTES / (column * ring)).max(4 * reach);
    let across = width.div_ceil(columns.next_multiple_of(GROUP));
    let columns = width.div_ceil(across).next_multiple_of(BLOCK * GROUP);
    let down = height.div_ceil(TILE_ROWS);
    let rows = height.div_ceil(down).next_multiple_of(BLOCK);
    Tiling::new((width, height), (columns, rows))
}

/// The room that there is to be for rings, of which `size` tells it by columns and rows: those of tiles for windows that reach
/// so far, or less, or farther up to `limit`.
fn room(
    (width, height): (usize, usize),
    reach: usize,
    column: usize,
    limit: u32,
    size: impl Fn(usize, usize) -> usize,
) -> usize {
    let of_reach = |reach: usize| {
        let columns = tiling(width, height, reach, column).columns + 2 * reach;
        size(columns.min(width), rows_of_rings(reach, height))
    };
    let most = reach.max(ROOMY_RADIUS.min(limit as usize));
    (0..=most).map(of_reach).max().expect("a radius")
}

// The stages are not inlined: profiles and the test of instruction counts tell them by name.
impl Job<'_> {
    /// All rows of depths.
    #[inline(never)]
    pub fn depths(&self, scratch: &mut super::Scratch) -> Result<(), Error> {
        let &Job { points, options, .. } = self;
        scratch.prepare(options.threads)?;
        let super::Scratch { workers, paper, .. } = scratch;
        workers.each(paper.rows(points)?.enumerate(), |(y, (depths, range))| {
            let task = DepthsTask { points, options, y, depths };
            // SAFETY: the processor has the instruction set.
            *range = unsafe { paths::run(self.isa, task) };
        });
        Ok(())
    }

    /// The radii of all windows, in the chunks' rows.
    #[inline(never)]
    fn radii(&self, scratch: &mut super::Scratch) -> Result<(), Error> {
        let &Job { points, options, .. } = self;
        let super::Scratch { workers, each, paper, .. } = scratch;
        let Scratch { depths, radii, largest: of_all, chunks, .. } = paper;
        let (width, height) = (points.width(), points.height());
        let (count, length) = (workers.count(), row_length(width));
        let reach = if count > 1 { reach(&options.paper) } else { height };
        share_out(height, count, reach, chunks)?;
        let swept = chunks.last().map_or(0, |chunk| chunk.start + chunk.swept.len());
        radii.grow(swept * length)?;
        let depths = &depths[..length * height];
        let radii = &mut radii[..swept * length];
        if options.paper.distance_metric == DistanceMetric::Chamfer {
            *of_all = self.plain_radii(chunks, radii)?;
            return Ok(());
        }
        for scratch in &each[..count] {
            lock(scratch).paper.sweep.reserve(width, &options.paper)?;
        }
        let largest = AtomicU32::new(0);
        let mut rest = radii;
        let parts = chunks.iter().map(|chunk| {
            let map = rest.split_off_mut(..chunk.swept.len() * length);
            (chunk, map.expect("a row for each that is swept"))
        });
        workers.share(parts, |worker, parts| {
            let sweep = &mut lock(&each[worker]).paper.sweep;
            for (Chunk { swept, own, .. }, map) in parts {
                let rows = Rows { width, swept: swept.clone(), own: own.clone(), depths, map };
                let task = SweepTask { rows, options, sweep };
                // SAFETY: the processor has the instruction set.
                let radius = unsafe { paths::run(self.isa, task) };
                largest.fetch_max(radius as u32, Ordering::Relaxed);
            }
        });
        *of_all = largest.into_inner() as usize;
        Ok(())
    }

    /// The radii in the chunks' rows by the plain form; returns the largest.
    fn plain_radii(&self, chunks: &[Chunk], radii: &mut [f32]) -> Result<usize, Error> {
        let maps = PaperMaps::new(self.points, self.options)?;
        let (width, length) = (self.points.width(), row_length(self.points.width()));
        let mut largest = 0.0_f32;
        for Chunk { swept, start, .. } in chunks {
            for (y, row) in swept.clone().zip(radii[start * length..].chunks_mut(length)) {
                let exact = &maps.smoothing_radii[y * width..][..width];
                for (radius, exact) in row.iter_mut().zip(exact) {
                    *radius = exact.trunc();
                    largest = largest.max(*radius);
                }
            }
        }
        Ok(largest as usize)
    }

    /// The sizes of the windows of a row's pixels, as [`Engine::sizes`](crate::paper::Engine::sizes).
    pub fn sizes<'s>(&self, scratch: &'s super::Scratch, y: usize) -> &'s [f32] {
        &self.row(&scratch.paper, y).1[..self.points.width()]
    }

    /// A row's depths, and the radii of its windows.
    fn row<'s>(&self, scratch: &'s Scratch, y: usize) -> (&'s [f32], &'s [f32]) {
        let length = row_length(self.points.width());
        let Scratch { depths, radii, chunks, .. } = scratch;
        let place = place(chunks, y);
        (&depths[y * length..][..length], &radii[place * length..][..length])
    }

    /// The normals, tile by tile, of all pixels, or of those only that are left.
    #[inline(never)]
    fn tiles(
        &self,
        scratch: &mut super::Scratch,
        output: Output,
        only_left: bool,
    ) -> Result<(), Error> {
        let &Job { points, options, .. } = self;
        let super::Scratch { workers, each, listed, paper, .. } = scratch;
        let (width, height, largest) = (points.width(), points.height(), paper.largest);
        let left = only_left.then_some(&paper.left);
        let sink = Sink::new(output, width, listed)?;
        let row = &|y: usize| self.row(paper, y);
        let column = column(options.method);
        let tiling = tiling(width, height, largest, column);
        let limit = options.paper.largest_radius;
        let room = |size: fn(_, _) -> usize| room((width, height), largest, column, limit, size);
        let rings = room(elements_of_rings);
        for scratch in &each[..workers.count()] {
            let WorkerScratch { moments, gradients, depth_changes, waiting, .. } =
                &mut lock(scratch).paper;
            waiting.reserve(width, tiling.rows)?;
            match options.method {
                Method::CovarianceMatrix => moments.reserve(rings)?,
                Method::AverageDepthChange => {
                    depth_changes.reserve(rings)?;
                    depth_changes.presence.reserve(room(presence_of_rings))?;
                }
                Method::Average3DGradient | Method::Simple3DGradient => gradients.reserve(rings)?,
            }
        }
        let radii = |y: usize| row(y).1;
        let cells = left.and_then(|left| {
            Some((left, Tiling::cells((width, height), left, radii, |radius| radius as usize)?))
        });
        let count = cells.as_ref().map_or(tiling.count(), |(_, cells)| cells.count());
        let written = left.map_or(Written::All, Written::Only);
        workers.for_each(count, |worker, item| {
            let place = match &cells {
                Some((left, cells)) => part(cells.tile(item), left, radii),
                None => Some((tiling.tile(item), largest as f32)),
            };
            let Some(((columns, rows), largest)) = place else { return };
            let largest = largest as usize;
            let tile = Tile { points, options, columns, rows, largest, row, written };
            let scratch = &mut lock(&each[worker]).paper;
            let (tile, sink) = (&tile, &sink);
            let WorkerScratch { moments, gradients, depth_changes, waiting, .. } = scratch;
            each_layer(tile, paper, |layer| match options.method {
                Method::CovarianceMatrix => {
                    let method = CovarianceMatrix::about(layer.origin);
                    self.layer(method, tile, layer, moments, waiting, sink)
                }
                Method::AverageDepthChange => {
                    self.layer(SmoothedDepthChanges, tile, layer, depth_changes, waiting, sink)
                }
                Method::Average3DGradient | Method::Simple3DGradient => {
                    self.layer(Gradients, tile, layer, gradients, waiting, sink)
                }
            });
        });
        Ok(())
    }

    /// A layer of one tile, as [`Tile::compute`].
    fn layer<M: Sums<N>, const N: usize>(
        &self,
        method: M,
        tile: &Tile,
        layer: &Layer,
        rings: &mut Rings<N>,
        waiting: &mut Waiting,
        sink: &Sink,
    ) -> Option<f32> {
        // SAFETY: the processor has the instruction set, and tiles do not share pixels.
        unsafe {
            if layer.is_partial() {
                let task = TileTask::<_, N, true> { method, tile, layer, rings, waiting, sink };
                paths::run(self.isa, task)
            } else {
                let task = TileTask::<_, N, false> { method, tile, layer, rings, waiting, sink };
                paths::run(self.isa, task)
            }
        }
    }

    /// The even windows and their estimates, and if they are asked for pixels' `own` normals by CM, but those of the marked
    /// ones, tile by tile; the even windows' radii are not above `largest`. The depths have been read, and the pixels' own
    /// windows are those that [`Job::radii`] has found.
    #[inline(never)]
    fn even_tiles(
        &self,
        scratch: &mut super::Scratch,
        even: &Even,
        own: Option<(Output, &Marks)>,
        largest: usize,
    ) -> Result<(), Error> {
        let &Job { points, options, .. } = self;
        let super::Scratch { workers, each, listed, paper, .. } = scratch;
        let written = own.map_or(Written::All, |(_, concerned)| Written::AllBut(concerned));
        let largest = if own.is_some() { largest.max(paper.largest) } else { largest };
        let (width, height) = (points.width(), points.height());
        let sink = own.map(|(output, _)| Sink::new(output, width, listed)).transpose()?;
        let length = row_length(width);
        let row = &|y: usize| match sink {
            Some(_) => self.row(paper, y),
            None => (&paper.depths[y * length..][..length], &[][..]),
        };
        let column = Rings::<MOMENTS>::COLUMN;
        let tiling = tiling(width, height, largest, column);
        let limit = options.paper.largest_radius;
        let room = room((width, height), largest, column, limit, elements_of_rings);
        for scratch in &each[..workers.count()] {
            let WorkerScratch { moments, waiting, .. } = &mut lock(scratch).paper;
            waiting.reserve(width, tiling.rows)?;
            moments.reserve(room)?;
        }
        workers.for_each(tiling.count(), |worker, item| {
            let (columns, rows) = tiling.tile(item);
            let tile = Tile { points, options, columns, rows, largest, row, written };
            let tile = EvenTile { even, tile, sink: sink.as_ref() };
            let WorkerScratch { moments: rings, waiting, .. } = &mut lock(&each[worker]).paper;
            each_layer(&tile.tile, paper, |layer| {
                let tile = &tile;
                // SAFETY: the processor has the instruction set, and tiles do not share pixels.
                unsafe { paths::run(self.isa, EvenTask { tile, layer, rings, waiting }) }
            });
        });
        Ok(())
    }
}

/// Has a tile computed layer by layer, of which `compute` returns how deep the nearest point is that pixels wait for.
/// Of its depths, the farthest in a layer is [`span`] times as deep as the nearest.
fn each_layer(tile: &Tile, scratch: &Scratch, mut compute: impl FnMut(&Layer) -> Option<f32>) {
    let span = span(tile.options.method);
    let depths = scratch.depths_of(reached(&tile.rows, tile.largest, tile.points.height()));
    let mut next = Some(Layer::first(depths, span, tile.largest));
    while let Some(mut layer) = next {
        layer.origin = tile.origin(&layer);
        next = compute(&layer).map(|nearest| Layer::next([nearest, depths[1]], span));
    }
}

/// Bytes that a column takes in a row of a method's rings.
fn column(method: Method) -> usize {
    match method {
        Method::CovarianceMatrix => Rings::<MOMENTS>::COLUMN,
        Method::AverageDepthChange => Rings::<4>::COLUMN,
        Method::Average3DGradient | Method::Simple3DGradient => Rings::<8>::COLUMN,
    }
}

/// How many times as deep as the nearest points others may be for a method's sums to be fine enough for both: found by
/// trying, as more layers take more time.
fn span(method: Method) -> f32 {
    match method {
        Method::CovarianceMatrix => 16.0,
        Method::Average3DGradient | Method::Simple3DGradient => 256.0,
        Method::AverageDepthChange => 4096.0,
    }
}

/// One row of depths.
struct DepthsTask<'a> {
    points: &'a Points<'a>,
    options: &'a Options,
    y: usize,
    depths: &'a mut [f32],
}

impl Task for DepthsTask<'_> {
    type Output = [f32; 2];

    #[inline(always)]
    unsafe fn run<S: Groups>(self) -> [f32; 2] {
        let DepthsTask { points, options, y, depths } = self;
        // SAFETY: as the caller's.
        unsafe { depths::read::<S::Widest>(points, options, y, depths) }
    }
}

/// The windows of some rows; gives the largest radius.
struct SweepTask<'a> {
    rows: Rows<'a>,
    options: &'a Options,
    sweep: &'a mut Sweep,
}

impl Task for SweepTask<'_> {
    type Output = f32;

    #[inline(always)]
    unsafe fn run<S: Groups>(mut self) -> f32 {
        // SAFETY: as the caller's.
        unsafe { self.sweep.radii::<S::Pair>(&mut self.rows, &self.options.paper) }
    }
}

/// A layer of one tile; no one else writes its pixels. Gives how deep the nearest point is that pixels wait for. `PARTIAL`
/// tells whether the layer is one of several: apart, as it would cost other tiles some percents.
struct TileTask<'a, 't, M, const N: usize, const PARTIAL: bool> {
    method: M,
    tile: &'t Tile<'a>,
    layer: &'t Layer,
    rings: &'t mut Rings<N>,
    waiting: &'t mut Waiting,
    sink: &'t Sink<'t>,
}

impl<M: Sums<N>, const N: usize, const PARTIAL: bool> Task for TileTask<'_, '_, M, N, PARTIAL> {
    type Output = Option<f32>;

    #[inline(always)]
    unsafe fn run<S: Groups>(self) -> Option<f32> {
        let TileTask { method, tile, layer, rings, waiting, sink } = self;
        // SAFETY: as the caller's.
        unsafe { tile.compute::<S, M, N, PARTIAL>(&method, rings, layer, waiting, sink) }
    }
}

/// A layer of the even windows of one tile, as [`TileTask`].
struct EvenTask<'a, 't> {
    tile: &'t EvenTile<'a>,
    layer: &'t Layer,
    rings: &'t mut Rings<MOMENTS>,
    waiting: &'t mut Waiting,
}

impl Task for EvenTask<'_, '_> {
    type Output = Option<f32>;

    #[inline(always)]
    unsafe fn run<S: Groups>(self) -> Option<f32> {
        let EvenTask { tile, layer, rings, waiting } = self;
        // SAFETY: as the caller's.
        unsafe { tile.compute::<S>(rings, layer, waiting) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::Isa;
    use crate::options::Semantics;

    #[test]
    fn clouds_are_read_as_in_the_plain_form() {
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            for (width, height) in [(1, 1), (3, 2), (4, 4), (17, 9), (66, 5), (160, 30)] {
                let value = |i: usize| match i * 7919 % 101 {
                    0 => f32::NAN,
                    value => value as f32 / 7.0 - 3.0,
                };
                let values: Vec<_> = (0..4 * width * height).map(value).collect();
                let points = Points::interleaved(&values, width, height, 4, 0).unwrap();
                let mut options = Options::default();
                let mut scratch = super::super::Scratch::default();
                scratch.prepare(1).unwrap();
                let mut elsewhere = [0.0; 3];
                let normals = Normals::interleaved(&mut elsewhere, 1, 1, 3, 0, None).unwrap();
                for (points, summed) in [
                    (points, true),
                    (points.beside(&normals), false),
                    (points.beside(&normals), true),
                ] {
                    options.semantics = Semantics::Paper;
                    options.method = Method::CovarianceMatrix;
                    options.crease_windows = summed;
                    let job = Job { isa, points: &points, options: &options };
                    let mut found = Cloud::default();
                    read_cloud(&job, &mut found, &mut scratch).unwrap();
                    let expected = Cloud::new(&points, &options).unwrap();
                    assert_eq!(expected.sums.is_empty(), !summed);
                    let bits = |cloud: &Cloud| {
                        let Cloud { points, depths, sums, .. } = cloud;
                        let all = [points.as_flattened(), depths, sums.as_flattened()].concat();
                        all.into_iter().map(f32::to_bits).collect::<Vec<_>>()
                    };
                    assert_eq!(bits(&found), bits(&expected), "{isa:?} {width} x {height}");
                    if summed {
                        let depths = |scratch: &super::super::Scratch| {
                            let Scratch { depths, ranges, .. } = &scratch.paper;
                            let all =
                                [&depths[..row_length(width) * height], ranges.as_flattened()];
                            all.concat().into_iter().map(f32::to_bits).collect::<Vec<_>>()
                        };
                        let along = depths(&scratch);
                        job.depths(&mut scratch).unwrap();
                        assert_eq!(along, depths(&scratch), "{isa:?} {width} x {height}");
                        scratch.paper = Scratch::default();
                    }
                }
            }
        }
    }
}
