//! The fast form of the whole method: the same steps as the plain form, over lanes, rows and tiles.
//!
//! First the windows of a slice of the image's rows (`windows`: `depth_changes`, `distance`, `smoothing_area`), then tile
//! by tile, and if need be layer by layer (`layers`), the points (`planes`, `incomplete`), the method's rings of sums
//! (`strip_pairs`, `strips`, `moments`, `half_windows`) and, run by run (`run`), the normals (`matrices`, `gradients`;
//! `tile`, `row`, `pair`, `one_point`, `estimates`). Slices are made of whole strips; strips, tiles and layers are fixed by
//! the frame and the options, so that results do not depend on the number of threads. Rings of integers go on from one
//! strip to the next where a thread makes both: their sums are the same to the bit.

mod arithmetic;
mod buffer;
mod by_side;
mod depth;
mod depth_changes;
mod distance;
mod estimates;
mod gradients;
mod half_windows;
mod incomplete;
mod lanes;
mod layers;
mod matrices;
mod moments;
mod one_point;
mod pair;
pub(crate) mod paper;
mod paths;
mod planes;
mod row;
mod run;
mod sink;
mod smoothing_area;
mod strip_pairs;
mod strips;
mod tile;
mod tiling;
mod windows;

use std::ops::{Range, RangeInclusive};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use depth::{scale_to_integers, spacing};
use half_windows::HalfWindows;
use lanes::LANES;
use layers::layers;
use moments::Moments;
use paths::Task;
use planes::{Frame, Planes};
use sink::Sink;
use strip_pairs::StripPairs;
use strips::Strips;
use tile::{Sums, Tile};
use tiling::{Tiling, part, reached};
use windows::{Sides, Windows, reach};

use crate::Error;
use crate::cloud::Points;
use crate::isa::Isa;
use crate::memory::bytes;
use crate::options::{Method, Options};
use crate::output::Output;
use crate::paper::Marks;
use crate::simd::{GROUP, Groups};
use crate::threads::Workers;
use crate::window::Image;

/// Columns and rows of the images that are not left to the plain form. Floats hold them.
pub(crate) const SIZES: RangeInclusive<usize> = 3..=1 << 24;

/// Rows of a strip, and of its tiles: as many as `STRIP_PIXELS` are, between the two. With fewer, more of the rows around
/// it, which its windows reach, are read again; with more, points have left the cache between the sweeps and the tiles.
const STRIP_ROWS: usize = 160;
const LEAST_STRIP_ROWS: usize = 96;
const STRIP_PIXELS: usize = 1 << 18;

/// A slice has so many times as many rows as its windows reach, at least: the sweep up starts that far below it.
const SLICE_REACHES: usize = 4;

/// Bytes of a tile's rings, to stay near the second-level cache. Found, as the rows, by trying less and more with windows
/// of 5 to 80 pixels.
const TILE_BYTES: usize = 3 << 19;

/// A tile is so many times as wide as its windows reach, at least, as the columns around it are summed again; but a row of
/// its rings has no more bytes than these. Such rings come from the third level, row by row, as the hardware sees.
const TILE_REACHES: usize = 20;
const ROW_BYTES: usize = 56 << 10;

/// Scratch memory and threads, reused from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    workers: Workers,
    each: Vec<Mutex<WorkerScratch>>,
    listed: Vec<(u32, u32)>,
    /// How far the windows of the frame before reached.
    last_reach: usize,
    paper: paper::Scratch,
}

/// What one worker needs.
#[derive(Debug, Default)]
struct WorkerScratch {
    windows: Windows,
    sums: TileScratch,
    paper: paper::WorkerScratch,
}

/// What a tile needs.
#[derive(Debug, Default)]
struct TileScratch {
    planes: Planes,
    moments: Moments,
    strip_pairs: StripPairs,
    strips: Strips,
    /// One of the two is in use, if any.
    half_windows: HalfWindows<f64>,
    integer_half_windows: HalfWindows<i32>,
}

impl Scratch {
    /// So many workers, as far as there can be, and scratch memory for each.
    pub fn prepare(&mut self, threads: usize) -> Result<(), Error> {
        self.workers.prepare(threads)?;
        let more = self.workers.count().saturating_sub(self.each.len());
        self.each.try_reserve_exact(more)?;
        self.each.extend((0..more).map(|_| Mutex::default()));
        Ok(())
    }

    /// The workers, as many as were last asked for.
    pub fn workers(&self) -> &Workers {
        &self.workers
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        let each = self.each.iter().map(|scratch| lock(scratch).size()).sum::<usize>();
        bytes(&self.listed) + self.paper.size() + each
    }
}

impl WorkerScratch {
    fn size(&self) -> usize {
        self.windows.size() + self.sums.size() + self.paper.size()
    }
}

impl TileScratch {
    /// Makes room for tiles of a job with so many columns and windows of up to `side`; of depths, in f64 or integers.
    fn reserve(
        &mut self,
        job: &PclJob,
        is_integer: bool,
        columns: usize,
        side: usize,
    ) -> Result<(), Error> {
        let &PclJob { job: Job { options, .. }, ref image, .. } = job;
        let frame = &Frame::largest(columns, side, (image.width, image.height));
        self.planes.reserve(frame)?;
        match options.method {
            Method::CovarianceMatrix => self.moments.reserve(frame, side),
            Method::Average3DGradient => self.strip_pairs.reserve(frame, side),
            Method::AverageDepthChange if is_integer => {
                self.integer_half_windows.reserve(frame, side)
            }
            Method::AverageDepthChange => self.half_windows.reserve(frame, side),
            Method::Simple3DGradient => self.strips.reserve(frame, side),
        }
    }

    fn size(&self) -> usize {
        self.planes.size()
            + self.moments.size()
            + self.strip_pairs.size()
            + self.strips.size()
            + self.half_windows.size()
            + self.integer_half_windows.size()
    }
}

fn lock(scratch: &Mutex<WorkerScratch>) -> MutexGuard<'_, WorkerScratch> {
    scratch.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One computation.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub isa: Isa,
    pub points: &'a Points<'a>,
    pub options: &'a Options,
}

/// One in PCL's semantics.
struct PclJob<'a> {
    job: Job<'a>,
    image: Image,
    /// How far points are apart, for [`scale_to_integers`].
    spacing: f32,
    /// Strips of the image.
    strips: usize,
}

/// The normals of a job.
pub(crate) fn compute(job: &Job, output: Output, scratch: &mut Scratch) -> Result<(), Error> {
    compute_slices(job, Some(output), |_, _| (), scratch)
}

/// As [`compute`], of the pixels that the second pass leaves to their own windows, the sides of which [`sides`] has found; if
/// these are not few, of all. The job's depths have been read.
pub(crate) fn compute_left(job: &Job, output: Output, scratch: &mut Scratch) -> Result<(), Error> {
    let size @ (width, height) = (job.points.width(), job.points.height());
    let Scratch { workers, each, listed, paper, .. } = scratch;
    let (left, sides) = (&paper.left, paper.sides(width));
    let row = |y: usize| sides.row(y);
    let Some(cells) = Tiling::cells(size, left, row, |side| side as usize / 2 + 1) else {
        return compute(job, output, scratch);
    };
    let job = PclJob::new(*job);
    let sink = Sink::new(output, width, listed)?;
    let done = workers.try_share(cells.tiles(), |worker, tiles| {
        let sums = &mut lock(&each[worker]).sums;
        sums.planes.frame = Frame::default();
        for ((columns, rows), side) in tiles.filter_map(|tile| part(tile, left, row)) {
            let side = side as usize;
            let reach = side + 2;
            let depths = paper.depths_of(reached(&rows, reach, height));
            let strip = Strip { columns, rows, side, reach, depths };
            job.strip(strip, (sides, Some(left)), sums, &sink)?;
        }
        Ok(())
    });
    if done.is_err() {
        output.write_none();
    }
    done
}

/// The sides of all pixels' windows, 0 for none, in place of the paper's radii.
fn sides(job: &Job, scratch: &mut Scratch) -> Result<(), Error> {
    let width = job.points.width();
    let (mut found, length) = scratch.paper.take_sizes(job.points)?;
    let rows = Parts(found.as_mut_ptr());
    let read = |of_slice: Range<usize>, sides: Sides| {
        for y in of_slice {
            // SAFETY: the row is in the image, and of one slice.
            let to = unsafe { rows.part(y * length..y * length + width) };
            to.copy_from_slice(&sides.row(y)[..width]);
        }
    };
    compute_slices(job, None, read, scratch)?;
    scratch.paper.radii = found;
    Ok(())
}

/// As [`compute`], if there is an output; gives every slice's rows and the sides of their windows to `read`.
fn compute_slices(
    job: &Job,
    output: Option<Output>,
    read: impl Fn(Range<usize>, Sides) + Sync,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    let &Job { points, options, .. } = job;
    scratch.prepare(options.threads)?;
    let Scratch { workers, each, listed, last_reach, .. } = scratch;
    let (width, height) = (points.width(), points.height());
    let least_reach = reach(points, options, 0.0);
    let expected = least_reach.max(*last_reach);
    let job = PclJob::new(*job);
    let strips = job.strips;
    let per_slice = (SLICE_REACHES * expected).div_ceil(height / strips).min(strips);
    // Nothing is written if there is no memory for what is known already.
    let columns = job.columns(true, least_reach);
    let side = Frame::most_of_ring(least_reach - 2).min(width + height);
    for scratch in &each[..workers.count()] {
        let WorkerScratch { windows, sums, .. } = &mut *lock(scratch);
        windows.start(points, options, job.row(per_slice), expected)?;
        sums.planes.frame = Frame::default();
        // Without an output too: after the second pass there may be one, or with the next frame.
        sums.reserve(&job, true, columns, side)?;
    }
    let sink = output.map(|output| Sink::new(output, width, listed));
    let sink = sink.transpose()?;
    let reach = AtomicUsize::new(0);
    let chunks = chunks(strips, per_slice, workers.count());
    let done = workers.try_share(chunks, |worker, chunks| {
        let WorkerScratch { windows, sums, .. } = &mut *lock(&each[worker]);
        for chunk in chunks {
            for first in chunk.clone().step_by(per_slice) {
                let slice = first..(first + per_slice).min(chunk.end);
                let rows = job.row(slice.start)..job.row(slice.end);
                job.sweep(windows, rows.clone())?;
                read(rows, windows.sides(width));
                let Some(sink) = &sink else { continue };
                for strip in slice {
                    let rows = job.row(strip)..job.row(strip + 1);
                    reach.fetch_max(job.tiles(windows, sums, rows, sink)?, Ordering::Relaxed);
                }
            }
        }
        Ok(())
    });
    if let Some(output) = output {
        *last_reach = reach.into_inner();
        if done.is_err() {
            output.write_none();
        }
    }
    done
}

/// How many strips an image has: two threads have as many each.
fn strips(width: usize, height: usize) -> usize {
    let strips = height.div_ceil((STRIP_PIXELS / width).clamp(LEAST_STRIP_ROWS, STRIP_ROWS));
    if strips > 1 { strips.next_multiple_of(2) } else { strips }
}

/// The strips of an image in chunks for the workers: ever fewer at a time, so that all end at the same time; as many for
/// each where a slice is that large.
fn chunks(strips: usize, per_slice: usize, workers: usize) -> impl Iterator<Item = Range<usize>> {
    let share = strips.div_ceil(workers);
    let mut left = 0..strips;
    std::iter::from_fn(move || {
        let some = left.len().div_ceil(2 * workers);
        let count = if workers == 1 || per_slice >= share { share } else { some };
        let chunk = left.start..(left.start + count).min(strips);
        left.start = chunk.end;
        (!chunk.is_empty()).then_some(chunk)
    })
}

/// Lends every item of a slice to one worker at a time.
struct Parts<T>(*mut T);

// SAFETY: each part is used by one thread only, as the caller of `part` promises.
unsafe impl<T: Send> Sync for Parts<T> {}

impl<T> Parts<T> {
    /// # Safety
    /// The range is inside the slice, and no other part of it is in use.
    #[allow(clippy::mut_from_ref)]
    unsafe fn part(&self, range: Range<usize>) -> &mut [T] {
        // SAFETY: promised by the caller.
        unsafe { std::slice::from_raw_parts_mut(self.0.add(range.start), range.len()) }
    }
}

/// Rows of the image, or some columns of them, that are computed together.
struct Strip {
    columns: Range<usize>,
    rows: Range<usize>,
    /// The largest of their windows, and how far these may reach from their pixels.
    side: usize,
    reach: usize,
    /// The least and the largest magnitude of depth of what is in reach.
    depths: [f32; 2],
}

impl<'a> PclJob<'a> {
    fn new(job: Job<'a>) -> Self {
        let Job { points, options, .. } = job;
        let image = Image::of(points, options);
        let is_depth = options.method == Method::AverageDepthChange;
        let spacing = if is_depth { spacing(points) } else { 0.0 };
        let strips = strips(image.width, image.height);
        PclJob { job, image, spacing, strips }
    }

    /// Where a strip starts: strips are of like heights.
    fn row(&self, strip: usize) -> usize {
        let (rows, rest) = (self.image.height / self.strips, self.image.height % self.strips);
        strip * rows + strip.min(rest)
    }

    // Not inlined, as the next one: profiles and the test of instruction counts tell the two by name.
    /// Steps 1 to 3: the windows of a slice.
    #[inline(never)]
    fn sweep(&self, windows: &mut Windows, slice: Range<usize>) -> Result<(), Error> {
        // SAFETY: the processor has the instruction set of the job.
        unsafe { paths::run(self.job.isa, SweepTask { job: self.job, windows, slice }) }
    }

    /// Steps 4 and 5: the tiles of a strip, the windows of which were found. Returns how far they reach.
    #[inline(never)]
    fn tiles(
        &self,
        windows: &Windows,
        scratch: &mut TileScratch,
        rows: Range<usize>,
        sink: &Sink,
    ) -> Result<usize, Error> {
        let &PclJob { job: Job { points, options, .. }, ref image, .. } = self;
        let &Image { width, height, .. } = image;
        let own = windows.swept(rows.clone());
        let reach = reach(points, options, own.deepest());
        let around = windows.swept(reached(&rows, reach, height));
        let depths = [around.nearest(), around.deepest()];
        let strip = Strip { columns: 0..width, rows, side: own.side as usize, reach, depths };
        self.strip(strip, (windows.sides(width), None), scratch, sink)?;
        Ok(reach)
    }

    /// The tiles of a strip, of all its pixels or of those that are marked, whose windows have these sides.
    fn strip(
        &self,
        strip: Strip,
        (sides, left): (Sides, Option<&Marks>),
        scratch: &mut TileScratch,
        sink: &Sink,
    ) -> Result<(), Error> {
        let Job { points, options, .. } = self.job;
        let Strip { columns: Range { start, end }, rows, side, reach, depths } = strip;
        let is_depth = options.method == Method::AverageDepthChange;
        let scale = || scale_to_integers(self.spacing, options, depths[1], side);
        let scale = is_depth.then(scale).flatten();
        let columns = self.columns(scale.is_some(), reach);
        let columns = columns.min((end - start).next_multiple_of(GROUP));
        scratch.reserve(self, scale.is_some(), columns, side)?;
        let (layers, count) = layers(depths, self.span(scale.is_some()), side, options);
        for column in (start..end).step_by(columns) {
            let tile = &Tile {
                points,
                options,
                image: &self.image,
                columns: column..(column + columns).min(end),
                rows: rows.clone(),
                layers: &layers[..count],
                sides,
                left,
            };
            let TileScratch { planes, moments, strip_pairs, strips, .. } = scratch;
            let TileScratch { half_windows, integer_half_windows, .. } = scratch;
            match (options.method, scale) {
                (Method::CovarianceMatrix, _) => self.tile(tile, planes, moments, sink),
                (Method::Average3DGradient, _) => self.tile(tile, planes, strip_pairs, sink),
                (Method::AverageDepthChange, Some(scale)) => {
                    self.tile(tile, planes, integer_half_windows.scaled(scale), sink);
                }
                (Method::AverageDepthChange, None) => {
                    self.tile(tile, planes, half_windows.scaled(1.0), sink);
                }
                (Method::Simple3DGradient, _) => self.tile(tile, planes, strips, sink),
            }
        }
        Ok(())
    }

    /// The normals of one tile.
    fn tile<M: Sums>(&self, tile: &Tile, planes: &mut Planes, sums: &mut M, sink: &Sink) {
        // SAFETY: the processor has the instruction set of the job, and tiles do not share pixels.
        unsafe { paths::run(self.job.isa, TileTask { tile, planes, sums, sink }) };
    }

    /// How many times as deep as the nearest points others may be for the method's sums, of integers or not, to be fine
    /// enough for both: found by trying, as more layers take more time.
    fn span(&self, is_integer: bool) -> f32 {
        match self.job.options.method {
            Method::AverageDepthChange if is_integer => f32::INFINITY,
            Method::AverageDepthChange => 4096.0,
            Method::CovarianceMatrix | Method::Average3DGradient | Method::Simple3DGradient => 24.0,
        }
    }

    /// Columns of a tile, if windows reach so far from their pixels.
    fn columns(&self, is_integer: bool, reach: usize) -> usize {
        let column = 3 * size_of::<f32>()
            + match self.job.options.method {
                Method::CovarianceMatrix => Moments::COLUMN,
                Method::Average3DGradient => StripPairs::COLUMN,
                Method::AverageDepthChange if is_integer => HalfWindows::<i32>::COLUMN,
                Method::AverageDepthChange => HalfWindows::<f64>::COLUMN,
                Method::Simple3DGradient => Strips::COLUMN,
            };
        let least = (TILE_REACHES * reach).min(ROW_BYTES / column).max(2 * reach);
        let columns = TILE_BYTES / (column * Frame::ring(reach));
        let columns = columns.max(least).next_multiple_of(LANES);
        // Tiles of like widths.
        let across = self.image.width.div_ceil(columns);
        self.image.width.div_ceil(across).next_multiple_of(GROUP)
    }
}

/// The sweeps of one slice.
struct SweepTask<'a> {
    job: Job<'a>,
    windows: &'a mut Windows,
    slice: Range<usize>,
}

impl Task for SweepTask<'_> {
    type Output = Result<(), Error>;

    #[inline(always)]
    unsafe fn run<S: Groups>(self) -> Result<(), Error> {
        let SweepTask { job, windows, slice } = self;
        // SAFETY: as the caller's.
        unsafe { windows.find::<S>(job.points, job.options, slice) }
    }
}

/// One tile, with the sums of its method; no one else writes the tile's pixels.
struct TileTask<'a, M> {
    tile: &'a Tile<'a>,
    planes: &'a mut Planes,
    sums: &'a mut M,
    sink: &'a Sink<'a>,
}

impl<M: Sums> Task for TileTask<'_, M> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Groups>(self) {
        let TileTask { tile, planes, sums, sink } = self;
        // SAFETY: as the caller's.
        unsafe { tile.compute::<S, M>(planes, sums, sink) };
    }
}
