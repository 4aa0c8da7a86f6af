//! Steps 4 and 5, fast, for one tile of the image: rows of points go through rings of sums, every pair of groups of eight
//! pixels takes its windows' sums from them, and normals are made run by run.

use std::mem;
use std::ops::{Range, RangeInclusive};

use super::arithmetic::Floats;
use super::estimates::{Estimates, Found};
use super::lanes::{Bits, LANES, all};
use super::layers::Layer;
use super::one_point::of_one_point;
use super::planes::{Frame, MARGIN, Planes, window_reach};
use super::run::{Noted, RUN};
use super::sink::Sink;
use super::windows::Sides;
use crate::Error;
use crate::cloud::Points;
use crate::depth_change::is_depth_change;
use crate::methods::{Estimate, start};
use crate::options::Options;
use crate::paper::Marks;
use crate::plain::of_own_window;
use crate::rect::Rect;
use crate::simd::{GROUP, Groups, Simd};
use crate::window::Image;

/// A method's sums over windows, from rings of integral rows. Each method says what it keeps a ring of.
pub(crate) trait Sums {
    /// What the normals of a run of pixels are made from.
    type OfRun: Noted;

    /// Bytes a column of a ring's row takes.
    const COLUMN: usize;

    /// Whether the method gives a curvature.
    const CURVATURE: bool;

    /// Whether sums go wrong where a coordinate is beyond the limit: the camera is the origin where that will do.
    const LIMITED: bool;

    /// Whether windows' sums are the same to the bit wherever the rings were started, as those of integers are.
    const EXACT: bool;

    /// Makes room for frames that are no larger, and windows of up to `side`.
    fn reserve(&mut self, frame: &Frame, side: usize) -> Result<(), Error>;

    /// Forgets the rows pushed before. `side` bounds the windows, `limit` the depths, and where the method is
    /// [`Sums::LIMITED`] all coordinates, counted from the origin.
    fn start(&mut self, frame: &Frame, limit: f32, side: usize, origin: [f32; 3]);

    /// Whether sums that are [`Sums::EXACT`] were last started as [`Sums::start`] would start them with these.
    fn goes_on(&self, _limit: f32, _side: usize, _origin: [f32; 3]) -> bool {
        false
    }

    /// The largest magnitude of x or y that sums are right with, as they were started.
    fn limit(&self) -> f32 {
        f32::INFINITY
    }

    /// Bytes held.
    fn size(&self) -> usize;

    /// Adds row `y` of the planes; rows come in order.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    unsafe fn push<S: Groups>(&mut self, frame: &Frame, planes: &Planes, y: usize);

    /// Finds where in the rings the corners of windows of up to `side` around the pixels of row `y` are: groups ask
    /// for the same ones again and again.
    fn aim(&mut self, frame: &Frame, y: usize, side: usize);

    /// Notes the sums of the windows of a pair of groups of the row aimed at, which is `at` in its run; returns the
    /// lanes whose windows are left to the plain form.
    ///
    /// # Safety
    /// As [`Sums::push`]; the rings hold the rows and columns of the windows.
    unsafe fn note<S: Groups>(
        &self,
        tile: &Tile,
        frame: &Frame,
        planes: &Planes,
        pair: &Pair,
        run: &mut Self::OfRun,
        at: usize,
    ) -> u32;

    /// The estimate of a pixel that is doubtful, where its run has none; none if it is left to the plain form. `window` is the
    /// pixel and the side of its window.
    fn precisely(&self, _tile: &Tile, _window: ((usize, usize), usize)) -> Option<Estimate> {
        None
    }

    /// The estimates of the pixels from `at` on in a run, which are solved; `sides` are those of their windows. Whether
    /// their sums are from [`Noted::afresh`], `fresh` tells.
    ///
    /// # Safety
    /// As [`Sums::push`].
    unsafe fn estimate<S: Simd>(
        &self,
        run: &Self::OfRun,
        at: usize,
        sides: S::F,
        fresh: bool,
    ) -> Found<S>;
}

/// What a tile is computed from.
pub(crate) struct Tile<'a> {
    pub points: &'a Points<'a>,
    pub options: &'a Options,
    pub image: &'a Image,
    /// The pixels to compute; the first column is a multiple of the group.
    pub columns: Range<usize>,
    pub rows: Range<usize>,
    /// Those that the tile's pixels are in.
    pub layers: &'a [Layer],
    pub sides: Sides<'a>,
    /// The pixels whose normals are written; none where all are.
    pub left: Option<&'a Marks>,
}

/// How the rows of a layer of a tile are gone through.
struct Pass<'a> {
    layer: &'a Layer,
    /// A point of the layer, which stands in place of missing ones.
    origin: [f32; 3],
    /// The largest magnitude of x or y that the sums allow.
    limit: f32,
    /// The first row to push: those of the frame above it are held.
    next: usize,
}

/// A point farther from the camera's axis than the sums allow.
struct BeyondLimit;

impl Tile<'_> {
    /// Computes the tile's normals. There is room for its frame.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the sink's pixels of this tile are written by no one else.
    #[inline(always)]
    pub unsafe fn compute<S: Groups, M: Sums>(
        &self,
        frame: &mut Frame,
        planes: &mut Planes,
        sums: &mut M,
        sink: &Sink,
    ) {
        if self.layers.len() > 1 && self.left.is_none() {
            // SAFETY: as the caller's. One layer of several writes its own pixels only.
            unsafe { self.write_none::<S>(sink) };
        }
        let size = (self.image.width, self.image.height);
        // What the rings hold, if sums can go on from there.
        let above = mem::take(frame);
        let can_go_on = M::EXACT && self.layers.len() == 1;
        for layer in self.layers {
            let Some(origin) = self.origin(layer) else {
                if layer.is_all() && self.left.is_none() {
                    // SAFETY: as the caller's.
                    unsafe { self.write_none::<S>(sink) };
                }
                continue;
            };
            let side = layer.side;
            *frame = Frame::around(&self.columns, &self.rows, side, size);
            // Seldom is a point farther from the camera's axis than the deepest one from the camera.
            let first = if M::LIMITED { [0.0; 3] } else { origin };
            let goes_on = can_go_on && frame.goes_on(&above);
            let goes_on = goes_on && sums.goes_on(layer.deepest, side, first);
            if !goes_on {
                sums.start(frame, layer.deepest, side, first);
            }
            let mut next = if goes_on { above.rows.end } else { frame.rows.start };
            let mut limit = sums.limit();
            loop {
                let pass = Pass { layer, origin, limit, next };
                // SAFETY: as the caller's.
                let done = unsafe { self.rows::<S, M>(frame, planes, sums, sink, pass) };
                let Err(BeyondLimit) = done else { break };
                // SAFETY: as the caller's.
                let extent = unsafe { self.extent::<S>(frame, planes, layer, origin) };
                if extent.is_finite() {
                    sums.start(frame, extent, side, origin);
                } else {
                    // Floats do not hold the way from there.
                    sums.start(frame, f32::MAX, side, [0.0; 3]);
                }
                (limit, next) = (f32::INFINITY, frame.rows.start);
            }
        }
        if !can_go_on {
            *frame = Frame::default();
        }
    }

    /// Writes NaN to all of the tile's pixels.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn write_none<S: Groups>(&self, sink: &Sink) {
        for y in self.rows.clone() {
            for x in self.columns.clone().step_by(LANES) {
                let written = all((self.columns.end - x).min(LANES));
                // SAFETY: as the caller's.
                unsafe { self.write::<S>(sink, (x, y), written, &Estimates::NONE) };
            }
        }
    }

    /// Writes these `lanes` of the estimates of pixels from `(x, y)` on.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn write<S: Groups>(
        &self,
        sink: &Sink,
        pixel: (usize, usize),
        lanes: u32,
        estimates: &Estimates,
    ) {
        // SAFETY: as the caller's.
        unsafe { sink.write::<S::Pair>(pixel, lanes, estimates, &self.columns) };
    }

    /// The largest magnitude of a coordinate in the frame, counted from the origin.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn extent<S: Groups>(
        &self,
        frame: &Frame,
        planes: &mut Planes,
        layer: &Layer,
        origin: [f32; 3],
    ) -> f32 {
        let (points, held) = (self.points, layer.held);
        // As bits, which are in the order of positive floats.
        let mut largest = 0;
        for y in frame.rows.clone() {
            // SAFETY: as the caller's.
            unsafe { planes.push::<S::Widest>(points, frame, y, held, origin) };
            for (plane, origin) in planes.rows(frame, y).into_iter().zip(origin) {
                let row = &plane[MARGIN..MARGIN + frame.columns.len()];
                let bits = row.iter().map(|at| (at - origin).abs().to_bits());
                largest = bits.fold(largest, u32::max);
            }
        }
        f32::from_bits(largest)
    }

    /// Computes all rows; what was written before x or y of a point was beyond the limit must be written again.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn rows<S: Groups, M: Sums>(
        &self,
        frame: &Frame,
        planes: &mut Planes,
        sums: &mut M,
        sink: &Sink,
        pass: Pass,
    ) -> Result<(), BeyondLimit> {
        let Pass { layer, origin, limit, mut next } = pass;
        let &Layer { held, side, .. } = layer;
        let mut run = Run::default();
        let (before, after) = window_reach(side);
        if next == frame.rows.start {
            planes.incomplete.start();
        }
        for y in self.rows.clone() {
            while next < (y + after + 1).min(self.image.height) {
                // SAFETY: as the caller's.
                let largest =
                    unsafe { planes.push::<S::Widest>(self.points, frame, next, held, origin) };
                if largest > limit {
                    return Err(BeyondLimit);
                }
                // SAFETY: as the caller's.
                unsafe { sums.push::<S>(frame, planes, next) };
                next += 1;
            }
            sums.aim(frame, y, side);
            let incomplete = planes.incomplete.aim(frame, y, before);
            let inner = self.inner(side, y);
            let row = Row { tile: self, layer, y, frame, planes, sums, sink };
            // SAFETY: as the caller's.
            unsafe { row.compute::<S>(&mut run, &inner, incomplete) };
        }
        Ok(())
    }

    /// A finite point of a layer near the tile's middle, if the layer has a window: sums about it lose less.
    fn origin(&self, layer: &Layer) -> Option<[f32; 3]> {
        if layer.side == 0 {
            return None;
        }
        for y in from_middle(&self.rows) {
            let sides = self.sides.row(y);
            for x in from_middle(&self.columns) {
                if sides[x] > 0.0 && layer.has(self.points.z(x, y)) {
                    let point = self.points.at(x, y);
                    return Some(point.map(|c| if c.is_finite() { c } else { 0.0 }));
                }
            }
        }
        None
    }

    /// Those of some lanes from pixel `(x, y)` on that are a layer's, and are left if only some are.
    #[cold]
    fn of_layer(&self, layer: &Layer, (x, y): (usize, usize), lanes: u32) -> u32 {
        Bits(lanes).which(|lane| {
            let x = x + lane;
            self.left.is_none_or(|left| left.has((x, y))) && layer.has(self.points.z(x, y))
        })
    }

    /// What a pixel's window and the pixels around it cover.
    fn around(&self, ((x, y), side): ((usize, usize), usize)) -> Rect {
        let Image { width, height, .. } = *self.image;
        let (before, after) = window_reach(side);
        let reached =
            |at: usize, size: usize| at.saturating_sub(before)..(at + after + 1).min(size);
        Rect { x: reached(x, width), y: reached(y, height) }
    }

    /// The points of a pixel's window, all of which are finite.
    fn points_in(
        &self,
        (pixel, side): ((usize, usize), usize),
    ) -> impl Iterator<Item = [f64; 3]> + use<'_> {
        let window = (start(pixel.0, side), start(pixel.1, side));
        let pixels = self.image.rects(window, (side, side)).flat_map(|(rect, _)| rect.pixels());
        pixels.map(|(x, y)| self.points.at(x, y).map(f64::from))
    }

    /// The normals of some lanes of those that begin with pixel `(x, y)`, by the plain form.
    #[cold]
    fn plain_lanes(&self, estimates: &mut Estimates, (x, y): (usize, usize), lanes: u32) {
        for lane in Bits(lanes) {
            let pixel = (x + lane, y);
            let side = self.sides.row(y)[pixel.0];
            estimates.put(lane, of_own_window(self.points, self.options, pixel, side));
        }
    }

    /// The columns of row `y` around whose pixels windows of up to `side`, and the pixels around them, are inside the
    /// image.
    #[inline(always)]
    pub fn inner(&self, side: usize, y: usize) -> Range<usize> {
        let Image { width, height, .. } = *self.image;
        // AVERAGE_DEPTH_CHANGE reaches one pixel further than the window.
        let (half, rest) = (side / 2, side / 2 + 1);
        if y > half && y + rest < height { half + 1..width.saturating_sub(rest) } else { 0..0 }
    }

    /// The lanes of a pair whose windows, and the pixels around them, are inside the image.
    #[inline(always)]
    pub fn inside(&self, pair: &Pair) -> u32 {
        if pair.is_inner(0, LANES) { pair.windows } else { self.inside_at_border(pair) }
    }

    #[cold]
    fn inside_at_border(&self, pair: &Pair) -> u32 {
        Bits(pair.windows).which(|lane| {
            let x = pair.x + lane;
            self.inner(pair.row[x] as usize, pair.y).contains(&x)
        })
    }

    /// Whether a window that crosses the border of the image, and the pixels around it, certainly hold finite points
    /// without a depth change only.
    ///
    /// Distances are too large in the image's outermost rows and columns, where only one of the passes works;
    /// there, the next pixel inwards must be as far from any depth change. The last pixel of all is in no depth change map.
    pub fn has_only_finite(&self, (x, y): (usize, usize), side: usize) -> bool {
        let Image { width, height, .. } = *self.image;
        let inner = (x.clamp(1, width - 2), y.clamp(1, height - 2));
        let reach = side / 2 + 1;
        let reaches_last = width - 1 <= x + reach && height - 1 <= y + reach;
        // No side is larger than the distance; what is so many rows and columns from the next pixel is 1.4 times as far.
        let far = side.min((14 * (reach + 1)).div_ceil(10));
        (inner == (x, y) || self.sides.row(inner.1)[inner.0] as usize >= far)
            && !(reaches_last && self.is_last_apart())
    }

    /// Whether there is a depth change between the image's last pixel and one next to it.
    fn is_last_apart(&self) -> bool {
        let (x, y) = (self.image.width - 1, self.image.height - 1);
        let last = self.points.z(x, y);
        [(x - 1, y), (x, y - 1)].into_iter().any(|(x, y)| {
            is_depth_change(self.points.z(x, y), last, self.options.max_depth_change_factor)
        })
    }
}

/// A row of a layer of a tile, that the sums are aimed at.
struct Row<'a, M: Sums> {
    tile: &'a Tile<'a>,
    layer: &'a Layer,
    y: usize,
    frame: &'a Frame,
    planes: &'a Planes,
    sums: &'a M,
    sink: &'a Sink<'a>,
}

impl<M: Sums> Row<'_, M> {
    /// Computes the row that the sums are aimed at. Whether windows may hold incomplete points, `incomplete` tells.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn compute<S: Groups>(&self, run: &mut Run<M>, inner: &Range<usize>, incomplete: bool) {
        let &Row { tile, layer, y, frame, planes, sums, sink } = self;
        let row = tile.sides.row(y);
        for start in tile.columns.clone().step_by(RUN) {
            run.length = 0;
            for x in (start..tile.columns.end.min(start + RUN)).step_by(LANES) {
                // SAFETY: as the caller's; a row of sides is readable up to a whole pair of groups.
                unsafe {
                    let mut pair = Pair::new::<S>(tile, row, x, y, inner);
                    let mut written = all((tile.columns.end - x).min(LANES));
                    if !layer.is_all() || tile.left.is_some() {
                        pair.windows = tile.of_layer(layer, (x, y), pair.windows);
                        written = pair.windows;
                    }
                    let windows = pair.windows;
                    let mut plain = 0;
                    if incomplete {
                        plain = planes.incomplete.in_windows(frame, &pair);
                        pair.windows &= !plain;
                    }
                    if windows == 0 {
                        tile.write::<S>(sink, (x, y), written, &Estimates::NONE);
                        continue;
                    }
                    let at = run.length * LANES;
                    if pair.windows != 0 {
                        plain |= sums.note::<S>(tile, frame, planes, &pair, &mut run.sums, at);
                    }
                    run.places[run.length] = (x, windows, written);
                    run.lanes[run.length] = windows & !plain;
                    run.length += 1;
                }
            }
            // SAFETY: as the caller's.
            unsafe { self.finish::<S>(run) };
        }
    }

    /// Writes the normals of a run.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn finish<S: Groups>(&self, run: &mut Run<M>) {
        let &Row { tile, y, sums, sink, .. } = self;
        let (row, points) = (tile.sides.row(y), self.planes.rows(self.frame, y));
        let (mut rest, mut any_rest) = ([0; RUN / LANES], 0);
        // SAFETY: as the caller's; the rows are readable up to a whole pair of groups.
        unsafe {
            run.sums.solve::<S>(0, &run.lanes[..run.length]);
            for number in 0..run.length {
                let (x, windows, written) = run.places[number];
                let sides = S::Pair::load(row.as_ptr().add(x));
                let found = sums.estimate::<S::Pair>(&run.sums, number * LANES, sides, false);
                rest[number] = windows & !(run.lanes[number] & !found.doubtful);
                any_rest |= rest[number];
                let normals = self.turned::<S>(found, x, windows, points);
                tile.write::<S>(sink, (x, y), written, &normals);
            }
            if any_rest == 0 {
                return;
            }
            for number in 0..run.length {
                if rest[number] != 0 {
                    self.settle::<S>(run, number, rest[number]);
                }
            }
        }
    }

    /// Writes the normals of a pair of a run, of the lanes `rest`, that are doubtful or left to the plain form: apart, as
    /// what is held in registers for it would cost all others 1 to 5 %.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn settle<S: Groups>(&self, run: &mut Run<M>, number: usize, rest: u32) {
        let &Row { tile, y, sums, sink, .. } = self;
        let Run { sums: of_run, places, lanes, .. } = run;
        let ((x, ..), lanes, at) = (places[number], lanes[number], number * LANES);
        let row = tile.sides.row(y);
        let window = |lane: usize| ((x + lane, y), row[x + lane] as usize);
        // SAFETY: as the caller's.
        unsafe {
            let sides = S::Pair::load(row.as_ptr().add(x));
            let mut found = sums.estimate::<S::Pair>(of_run, at, sides, false);
            let (mut doubtful, mut of_one) = (rest & lanes, 0);
            if doubtful != 0 {
                let around = |lane: usize| (window(lane).0, tile.around(window(lane)));
                of_one = of_one_point::<S::Widest>(tile.points, doubtful, around);
                doubtful &= !of_one;
            }
            if doubtful != 0 {
                let points = |lane: usize| tile.points_in(window(lane));
                if of_run.afresh::<S, _>(at, doubtful, points) {
                    let fresh = sums.estimate::<S::Pair>(of_run, at, sides, true);
                    doubtful = found.take_certain(doubtful, &fresh);
                }
                doubtful = found.take_precise(doubtful, |lane| {
                    let precise = of_run.precisely(at + lane);
                    precise.or_else(|| sums.precisely(tile, window(lane)))
                });
            }
            let plain = rest & !lanes | doubtful;
            let points = self.planes.rows(self.frame, y);
            let mut normals = self.turned::<S>(found, x, rest & !of_one & !plain, points);
            let curvature = if M::CURVATURE { 0.0 } else { f32::NAN };
            for lane in Bits(of_one) {
                normals.put(lane, Estimate { curvature, ..Estimate::NONE });
            }
            if plain != 0 {
                tile.plain_lanes(&mut normals, (x, y), plain);
            }
            tile.write::<S>(sink, (x, y), rest, &normals);
        }
    }

    /// What was found for these lanes of a pair, turned to the viewpoint; `points` are the row's.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn turned<S: Groups>(
        &self,
        found: Found<S::Pair>,
        x: usize,
        lanes: u32,
        [xs, ys, zs]: [&[f32]; 3],
    ) -> Estimates {
        let column = self.frame.column(x);
        // SAFETY: as the caller's; the rows are readable up to a whole pair of groups.
        unsafe {
            let point = [
                Floats::load(xs.as_ptr().add(column)),
                Floats::load(ys.as_ptr().add(column)),
                Floats::load(zs.as_ptr().add(column)),
            ];
            Estimates::of(found, point, self.tile.options.viewpoint, lanes)
        }
    }
}

/// A range from its middle on, and then what is before it, backwards.
pub(crate) fn from_middle(range: &Range<usize>) -> impl Iterator<Item = usize> + use<> {
    let middle = range.start.midpoint(range.end);
    (middle..range.end).chain((range.start..middle).rev())
}

/// Whether a range has all of another, which is not empty.
#[inline(always)]
pub(crate) fn contains(range: &Range<usize>, other: RangeInclusive<usize>) -> bool {
    range.start <= *other.start() && *other.end() < range.end
}

/// Pixels of a row, without pairs of groups that have no window. Their normals are found step by step, each step for
/// all of them: what one pixel's step waits for does not hold up the others'.
struct Run<M: Sums> {
    sums: M::OfRun,
    /// Where the pairs begin, the lanes that have a window, and those that are written.
    places: [(usize, u32, u32); RUN / LANES],
    /// The lanes that are not left to the plain form.
    lanes: [u32; RUN / LANES],
    /// In pairs.
    length: usize,
}

impl<M: Sums> Default for Run<M> {
    fn default() -> Self {
        let (places, lanes) = ([(0, 0, 0); RUN / LANES], [0; RUN / LANES]);
        Run { sums: M::OfRun::default(), places, lanes, length: 0 }
    }
}

/// Two groups of pixels of a row, side by side, and their windows.
pub(crate) struct Pair<'a> {
    /// The first pixel.
    pub x: usize,
    pub y: usize,
    /// The sides of the row's windows.
    pub row: &'a [f32],
    /// The lanes that have a window.
    pub windows: u32,
    /// The columns where windows of any of the tile's sides are inside the image.
    inner: &'a Range<usize>,
}

impl<'a> Pair<'a> {
    /// # Safety
    /// The processor has the instruction set of `S`; the row is readable from `x` up to a whole pair.
    #[inline(always)]
    unsafe fn new<S: Groups>(
        tile: &Tile,
        row: &'a [f32],
        x: usize,
        y: usize,
        inner: &'a Range<usize>,
    ) -> Self {
        let count = (tile.columns.end - x).min(LANES);
        // SAFETY: as the caller's.
        let sides = unsafe { S::Pair::load(row.as_ptr().add(x)) };
        // SAFETY: as the caller's.
        let windows = unsafe { S::Pair::bits(S::Pair::lt(S::Pair::splat(0.0), sides)) };
        Pair { x, y, row, windows: windows & all(count), inner }
    }

    /// A lane's pixel and the side of its window.
    pub fn window(&self, lane: usize) -> ((usize, usize), usize) {
        let x = self.x + lane;
        ((x, self.y), self.row[x] as usize)
    }

    /// The side of the windows of `lanes`, if they have the same and windows of any of the tile's sides are inside the image
    /// here.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn one_side<S: Groups>(&self, lanes: u32) -> Option<usize> {
        let side = self.row[self.x + lanes.trailing_zeros() as usize];
        // SAFETY: as the caller's; sides are whole numbers that fit i32.
        unsafe {
            let sides = S::Pair::load(self.row.as_ptr().add(self.x));
            let same = S::Pair::bits(S::Pair::eq(sides, S::Pair::splat(side)));
            let have_one = lanes & !same == 0 && self.is_inner(0, LANES);
            have_one.then(|| side.to_int_unchecked::<i32>() as usize)
        }
    }

    /// The sides of the windows of `lanes`, of the group that begins with lane `first`; 0 in the others.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn sides<S: Groups>(&self, first: usize, lanes: u32) -> [i32; GROUP] {
        let mut sides = [0; GROUP];
        // SAFETY: as the caller's; sides are whole numbers that fit i32.
        unsafe {
            let row = S::load(self.row.as_ptr().add(self.x + first));
            S::store_i(sides.as_mut_ptr(), S::truncate_i(S::and(S::mask(lanes), row)));
        }
        sides
    }

    /// Whether windows of any of the tile's sides are inside the image for so many pixels from a lane on.
    #[inline(always)]
    pub fn is_inner(&self, lane: usize, count: usize) -> bool {
        contains(self.inner, self.x + lane..=self.x + lane + count - 1)
    }
}
