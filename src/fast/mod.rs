//! The fast form of the whole method: the same steps as the plain form, over lanes, rows and tiles.
//!
//! First the windows of the whole image (`windows`), then tile by tile, and if need be layer by layer (`layers`), the
//! points (`planes`), the method's rings of sums (`strip_pairs`, `strips`, `moments`, `half_windows`) and, run by run
//! (`run`), the normals (`tile`). Tiles and layers are fixed by the frame and the options, so that results do not depend
//! on the number of threads.

mod arithmetic;
mod buffer;
mod by_side;
mod depth;
mod gradients;
mod half_windows;
mod lanes;
mod layers;
mod moments;
pub(crate) mod paper;
mod paths;
mod planes;
mod run;
mod sink;
mod strip_pairs;
mod strips;
mod tile;
mod windows;

use std::ops::{Range, RangeInclusive};
use std::sync::{Mutex, MutexGuard, PoisonError};

use buffer::Buffer;
use depth::scale_to_integers;
use half_windows::HalfWindows;
use lanes::{LANES, Lanes};
use layers::{Layer, layers};
use moments::Moments;
use paths::Task;
use planes::{Frame, Planes};
use sink::Sink;
use strip_pairs::StripPairs;
use strips::Strips;
use tile::{Sums, Tile};
use windows::{Sweep, WindowRows, row_length, sides};

use crate::Error;
use crate::cloud::{Normals, Points};
use crate::isa::Isa;
use crate::memory::{bytes, make_room};
use crate::options::{Method, Options};
use crate::simd::{GROUP, Groups};
use crate::smoothing_area::depth_smoothing;
use crate::threads::Workers;
use crate::window::Image;

/// Columns and rows of the images that are not left to the plain form. Floats hold them.
pub(crate) const SIZES: RangeInclusive<usize> = 3..=1 << 24;

/// Rows of a tile: those around it that its windows reach are read again for the next one.
const TILE_ROWS: usize = 128;

/// Bytes of a tile's rings, to stay near the second-level cache without narrow tiles, the columns around which are
/// summed again. Found, as the rows, by trying half and twice as much with windows of 5 to 50 pixels.
const TILE_BYTES: usize = 1 << 20;

/// How much deeper than the frame before a frame may be for its rows to be swept only once.
const DEEPER: f32 = 1.25;

/// Scratch memory and threads, reused from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    workers: Workers,
    rows: Buffer<Lanes>,
    each: Vec<Mutex<WorkerScratch>>,
    listed: Vec<(u32, u32)>,
    chunks: Vec<Chunk>,
    /// How far the sweeps of the frame before reached around their rows.
    last_reach: usize,
    paper: paper::Scratch,
}

/// What one worker needs.
#[derive(Debug, Default)]
struct WorkerScratch {
    sweep: Sweep,
    /// Of the tile: here it leaves its loops the registers.
    frame: Frame,
    planes: Planes,
    moments: Moments,
    strip_pairs: StripPairs,
    strips: Strips,
    /// One of the two is in use, if any.
    half_windows: HalfWindows<f64>,
    integer_half_windows: HalfWindows<i32>,
    paper: paper::WorkerScratch,
}

impl Scratch {
    /// So many workers, as far as there can be, and scratch memory for each.
    pub fn prepare(&mut self, threads: usize) -> Result<(), Error> {
        self.workers.prepare(threads)?;
        self.each.resize_with(self.workers.count().max(self.each.len()), Mutex::default);
        Ok(())
    }

    /// The workers, as many as were last asked for.
    pub fn workers(&self) -> &Workers {
        &self.workers
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        let each = self.each.iter().map(|scratch| lock(scratch).size()).sum::<usize>();
        self.rows.size() + bytes(&self.listed) + bytes(&self.chunks) + self.paper.size() + each
    }
}

impl WorkerScratch {
    /// Makes room for a job's tiles with frames that are no larger, and windows of up to `side`.
    fn reserve(&mut self, job: &Job, frame: &Frame, side: usize) -> Result<(), Error> {
        self.planes.reserve(frame)?;
        match job.options.method {
            Method::CovarianceMatrix => self.moments.reserve(frame, side),
            Method::Average3DGradient => self.strip_pairs.reserve(frame, side),
            Method::AverageDepthChange if job.scale.is_some() => {
                self.integer_half_windows.reserve(frame, side)
            }
            Method::AverageDepthChange => self.half_windows.reserve(frame, side),
            Method::Simple3DGradient => self.strips.reserve(frame, side),
        }
    }

    fn size(&self) -> usize {
        self.sweep.size()
            + self.planes.size()
            + self.moments.size()
            + self.strip_pairs.size()
            + self.strips.size()
            + self.half_windows.size()
            + self.integer_half_windows.size()
            + self.paper.size()
    }
}

fn lock(scratch: &Mutex<WorkerScratch>) -> MutexGuard<'_, WorkerScratch> {
    scratch.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Image rows that are swept together, with the rows around them whose depth changes reach them.
#[derive(Clone, Debug)]
struct Chunk {
    own: Range<usize>,
    swept: Range<usize>,
    /// Where the swept rows start among the rows of the map.
    start: usize,
}

impl Chunk {
    /// Which of the map's rows an own row of the chunk is.
    fn place(&self, y: usize) -> usize {
        self.start + y - self.swept.start
    }
}

/// The sides of all pixels' windows, 0 for none.
#[derive(Clone, Copy)]
struct Sides<'a> {
    /// The rows that the chunks' sweeps have filled.
    rows: &'a [Lanes],
    width: usize,
    chunks: &'a [Chunk],
}

impl<'a> Sides<'a> {
    /// Those of row `y`, readable up to a whole pair of groups.
    fn row(&self, y: usize) -> &'a [f32] {
        let chunk = &self.chunks[y / self.chunks[0].own.len()];
        sides(self.rows, self.width, chunk.place(y))
    }
}

/// Reads a map's whole numbers, row by row; `row` gives those of one of the map's rows.
fn read_map<'r>(
    chunks: &[Chunk],
    (width, height): (usize, usize),
    found: &mut Vec<u32>,
    row: impl Fn(usize) -> &'r [f32],
) -> Result<(), Error> {
    make_room(found, width * height)?;
    for place in chunks.iter().flat_map(|chunk| chunk.own.clone().map(|y| chunk.place(y))) {
        found.extend(row(place)[..width].iter().map(|number| *number as u32));
    }
    Ok(())
}

/// What the sweeps found.
struct Swept {
    /// The least and the largest finite depth; infinity and -infinity if there is none.
    depths: [f32; 2],
    /// A bound on the windows' sides.
    side: f32,
}

impl Swept {
    /// The largest magnitude of a finite depth.
    fn deepest(&self) -> f32 {
        let [least, largest] = self.depths;
        largest.max(-least).max(0.0)
    }

    /// No finite depth's magnitude is smaller.
    fn nearest(&self) -> f32 {
        let [least, largest] = self.depths;
        least.max(-largest).max(0.0)
    }
}

/// One computation.
struct Job<'a> {
    isa: Isa,
    points: &'a Points<'a>,
    options: &'a Options,
    image: Image,
    whole_points: bool,
    /// What depths are multiplied by to become integers, where these are fine enough for [`HalfWindows`].
    scale: Option<f32>,
}

/// The normals of the pixels that `indices` list, or of all.
pub(crate) fn compute(
    isa: Isa,
    points: &Points,
    options: &Options,
    indices: Option<&[i32]>,
    normals: &Normals,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    scratch.prepare(options.threads)?;
    let (width, height) = (points.width(), points.height());
    let Scratch { workers, rows, each, listed, chunks, last_reach, .. } = scratch;
    let count = workers.count();

    let image = Image { width, height, border_policy: options.border_policy };
    let whole_points = points.has_whole_points(normals);
    let mut job = Job { isa, points, options, image, whole_points, scale: None };

    for scratch in &each[..count] {
        lock(scratch).sweep.reserve(width)?;
    }
    let length = row_length(width);
    let mut reach = job.reach(0.0).max(*last_reach);
    let (found, swept) = loop {
        share_out(height, count, reach, chunks);
        let swept = chunks.last().map_or(0, |chunk| chunk.start + chunk.swept.len());
        rows.grow(swept * length)?;
        let found = job.sweep(workers, each, chunks, &mut rows[..swept * length]);
        if chunks.len() == 1 || job.reach(found.deepest()) <= reach {
            break (found, swept);
        }
        // Depths reach farther than in the frame before.
        reach = job.reach(DEEPER * found.deepest());
    };
    let deepest = found.deepest();
    *last_reach = reach.min(job.reach(DEEPER * deepest));

    let reach = job.reach(deepest);
    let rows = &rows[..swept * length];
    let sides = Sides { rows, width, chunks };
    let sink = Sink::new(normals, indices, width, listed)?;
    let side = (found.side as usize).min(width.min(height));
    if options.method == Method::AverageDepthChange {
        job.scale = scale_to_integers(points, options, deepest, side);
    }
    let frame = Frame::largest(job.columns(reach), side, width);
    for scratch in &each[..count] {
        lock(scratch).reserve(&job, &frame, side)?;
    }
    let (layers, count) = layers([found.nearest(), deepest], job.range(), side, options);
    job.tiles(workers, each, reach, &layers[..count], sides, &sink);
    Ok(())
}

/// The sides of all pixels' windows, row by row, 0 for none, and their normals.
pub(crate) fn compute_with_sides(
    isa: Isa,
    points: &Points,
    options: &Options,
    normals: &Normals,
    found: &mut Vec<u32>,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    compute(isa, points, options, None, normals, scratch)?;
    let size @ (width, _) = (points.width(), points.height());
    read_map(&scratch.chunks, size, found, |place| sides(&scratch.rows, width, place))
}

/// The rows shared out to `count` sweeps. A depth change more than `reach` away decides no window, so each sweep can
/// start and end that far around its own rows.
fn share_out(height: usize, count: usize, reach: usize, chunks: &mut Vec<Chunk>) {
    let per_chunk = height.div_ceil(count);
    let per_chunk = if per_chunk < 2 * reach { height } else { per_chunk };
    let mut start = 0;
    let first_rows = (0..height).step_by(per_chunk);
    chunks.clear();
    chunks.extend(first_rows.map(|first| {
        let own = first..(first + per_chunk).min(height);
        let swept = own.start.saturating_sub(reach)..(own.end + reach).min(height);
        start += swept.len();
        Chunk { own, start: start - swept.len(), swept }
    }));
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

impl Job<'_> {
    /// How far a window, or a depth change that decides one, can be from its pixel, where no depth is above `deepest`.
    fn reach(&self, deepest: f32) -> usize {
        let smoothing = depth_smoothing(deepest, self.options);
        (smoothing as usize).saturating_add(2).min(self.image.width + self.image.height)
    }

    // Not inlined, as the next one: profiles and the test of instruction counts tell the two by name.
    /// Steps 1 to 3: fills the rows with sides of windows.
    #[inline(never)]
    fn sweep(
        &self,
        workers: &Workers,
        each: &[Mutex<WorkerScratch>],
        chunks: &[Chunk],
        rows: &mut [Lanes],
    ) -> Swept {
        let length = row_length(self.image.width);
        let rows = Parts(rows.as_mut_ptr());
        let all = Mutex::new(Swept { depths: [f32::INFINITY, f32::NEG_INFINITY], side: 0.0 });
        workers.for_each(chunks.len(), |worker, item| {
            let chunk = &chunks[item];
            let places = chunk.start * length..(chunk.start + chunk.swept.len()) * length;
            // SAFETY: chunks have rows of their own.
            let rows = unsafe { rows.part(places) };
            let sweep = &mut lock(&each[worker]).sweep;
            let task = SweepTask { job: self, chunk, rows, sweep };
            // SAFETY: the processor has the instruction set of the job.
            let swept = unsafe { paths::run(self.isa, task) };
            let mut all = all.lock().unwrap_or_else(PoisonError::into_inner);
            let ([least, largest], [other_least, other_largest]) = (all.depths, swept.depths);
            all.depths = [least.min(other_least), largest.max(other_largest)];
            all.side = all.side.max(swept.side);
        });
        all.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Steps 4 and 5, all tiles.
    #[inline(never)]
    fn tiles(
        &self,
        workers: &Workers,
        each: &[Mutex<WorkerScratch>],
        reach: usize,
        layers: &[Layer],
        sides: Sides,
        sink: &Sink,
    ) {
        let Image { width, height, .. } = self.image;
        let columns = self.columns(reach);
        let across = width.div_ceil(columns);
        let down = height.div_ceil(TILE_ROWS);
        let rows = height.div_ceil(down);
        workers.for_each(across * down, |worker, item| {
            let (row, column) = (item / across * rows, item % across * columns);
            let tile = Tile {
                points: self.points,
                options: self.options,
                image: &self.image,
                columns: column..(column + columns).min(width),
                rows: row..(row + rows).min(height),
                layers,
                whole_points: self.whole_points,
                sides,
            };
            let scratch = &mut lock(&each[worker]);
            let task = TileTask { job: self, tile: &tile, scratch, sink };
            // SAFETY: the processor has the instruction set of the job, and tiles do not share pixels.
            unsafe { paths::run(self.isa, task) };
        });
    }

    /// How many times as deep as the nearest points others may be for the method's sums to be fine enough for both:
    /// found by trying, as more layers take more time.
    fn range(&self) -> f32 {
        match self.options.method {
            Method::AverageDepthChange if self.scale.is_some() => f32::INFINITY,
            Method::AverageDepthChange => 4096.0,
            Method::CovarianceMatrix | Method::Average3DGradient | Method::Simple3DGradient => 24.0,
        }
    }

    /// Columns of a tile, if windows reach so far from their pixels.
    fn columns(&self, reach: usize) -> usize {
        let column = 3 * size_of::<f32>()
            + match self.options.method {
                Method::CovarianceMatrix => Moments::COLUMN,
                Method::Average3DGradient => StripPairs::COLUMN,
                Method::AverageDepthChange if self.scale.is_some() => HalfWindows::<i32>::COLUMN,
                Method::AverageDepthChange => HalfWindows::<f64>::COLUMN,
                Method::Simple3DGradient => Strips::COLUMN,
            };
        let bytes = column * Frame::ring(reach);
        let columns = (TILE_BYTES / bytes).max(2 * reach).next_multiple_of(LANES);
        // Tiles of like widths.
        let across = self.image.width.div_ceil(columns);
        self.image.width.div_ceil(across).next_multiple_of(GROUP)
    }
}

/// The sweeps over one chunk of rows, into the map's rows of the chunk.
struct SweepTask<'a> {
    job: &'a Job<'a>,
    chunk: &'a Chunk,
    rows: &'a mut [Lanes],
    sweep: &'a mut Sweep,
}

impl Task for SweepTask<'_> {
    type Output = Swept;

    #[inline(always)]
    unsafe fn run<S: Groups>(self) -> Swept {
        let SweepTask { job, chunk, rows, sweep } = self;
        let mut windows = WindowRows::new(job.image.width, rows);
        let swept = (chunk.swept.start, chunk.swept.len());
        // SAFETY: as the caller's.
        unsafe {
            let depths = windows.sweep_down::<S::Pair>(job.points, job.options, swept, sweep);
            let side = windows.sweep_up::<S::Pair>(job.points, job.options, swept, depths, sweep);
            Swept { depths, side }
        }
    }
}

/// One tile, with the sums of its method; no one else writes the tile's pixels.
struct TileTask<'a> {
    job: &'a Job<'a>,
    tile: &'a Tile<'a>,
    scratch: &'a mut WorkerScratch,
    sink: &'a Sink<'a>,
}

impl Task for TileTask<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Groups>(self) {
        let TileTask { job, tile, scratch, sink } = self;
        let WorkerScratch { frame, planes, moments, strip_pairs, strips, .. } = scratch;
        let WorkerScratch { half_windows, integer_half_windows, .. } = scratch;
        // SAFETY: as the caller's.
        unsafe {
            match tile.options.method {
                Method::CovarianceMatrix => tile.compute::<S, _>(frame, planes, moments, sink),
                Method::Average3DGradient => tile.compute::<S, _>(frame, planes, strip_pairs, sink),
                Method::AverageDepthChange => match job.scale {
                    Some(scale) => {
                        let sums = integer_half_windows.scaled(scale);
                        tile.compute::<S, _>(frame, planes, sums, sink);
                    }
                    None => tile.compute::<S, _>(frame, planes, half_windows.scaled(1.0), sink),
                },
                Method::Simple3DGradient => tile.compute::<S, _>(frame, planes, strips, sink),
            }
        }
    }
}
