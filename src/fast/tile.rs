//! Steps 4 and 5, fast, for one tile of the image: rows of points go through rings of sums, from which the normals of a row
//! (`row`) are made.

use std::mem;
use std::ops::Range;

use super::estimates::{Estimates, Found};
use super::lanes::{Bits, LANES, all};
use super::layers::Layer;
use super::pair::Pair;
use super::planes::{Frame, MARGIN, Planes, window_reach};
use super::row::{Row, Run};
use super::run::Noted;
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
use crate::simd::{Groups, Simd};
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
    unsafe fn push<S: Groups>(&mut self, planes: &Planes, y: usize);

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
        planes: &Planes,
        pair: &Pair,
        run: &mut Self::OfRun,
        at: usize,
    ) -> u32;

    /// What the rounding errors of the rings' sums stay below, if [`Sums::estimate`] is to be told.
    fn error(&self) -> f64 {
        0.0
    }

    /// The estimate of a pixel that is doubtful, where its run has none; none if it is left to the plain form. `window` is the
    /// pixel and the side of its window.
    fn precisely(&self, _tile: &Tile, _window: ((usize, usize), usize)) -> Option<Estimate> {
        None
    }

    /// The estimates of the pixels from `at` on in a run, which are solved; `sides` are those of their windows. The
    /// rounding errors of their sums stay below `error`: [`Sums::error`], or 0 after [`Noted::afresh`].
    ///
    /// # Safety
    /// As [`Sums::push`].
    unsafe fn estimate<S: Simd>(
        &self,
        run: &Self::OfRun,
        at: usize,
        sides: S::F,
        error: f64,
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
        let above = mem::take(&mut planes.frame);
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
            planes.frame = Frame::around(&self.columns, &self.rows, side, size);
            // Seldom is a point farther from the camera's axis than the deepest one from the camera.
            let first = if M::LIMITED { [0.0; 3] } else { origin };
            let goes_on = can_go_on && planes.frame.goes_on(&above);
            let goes_on = goes_on && sums.goes_on(layer.deepest, side, first);
            if !goes_on {
                sums.start(&planes.frame, layer.deepest, side, first);
            }
            let mut next = if goes_on { above.rows.end } else { planes.frame.rows.start };
            let mut limit = sums.limit();
            loop {
                let pass = Pass { layer, origin, limit, next };
                // SAFETY: as the caller's.
                let done = unsafe { self.rows::<S, M>(planes, sums, sink, pass) };
                let Err(BeyondLimit) = done else { break };
                // SAFETY: as the caller's.
                let extent = unsafe { self.extent::<S>(planes, layer, origin) };
                if extent.is_finite() {
                    sums.start(&planes.frame, extent, side, origin);
                } else {
                    // Floats do not hold the way from there.
                    sums.start(&planes.frame, f32::MAX, side, [0.0; 3]);
                }
                (limit, next) = (f32::INFINITY, planes.frame.rows.start);
            }
        }
        if !can_go_on {
            planes.frame = Frame::default();
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
    pub unsafe fn write<S: Groups>(
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
        planes: &mut Planes,
        layer: &Layer,
        origin: [f32; 3],
    ) -> f32 {
        let (points, held) = (self.points, layer.held);
        // As bits, which are in the order of positive floats.
        let mut largest = 0;
        for y in planes.frame.rows.clone() {
            // SAFETY: as the caller's.
            unsafe { planes.push::<S::Widest>(points, y, held, origin) };
            for (plane, origin) in planes.rows(y).into_iter().zip(origin) {
                let row = &plane[MARGIN..MARGIN + planes.frame.columns.len()];
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
        planes: &mut Planes,
        sums: &mut M,
        sink: &Sink,
        pass: Pass,
    ) -> Result<(), BeyondLimit> {
        let Pass { layer, origin, limit, mut next } = pass;
        let &Layer { held, side, .. } = layer;
        let mut run = Run::default();
        let (before, after) = window_reach(side);
        if next == planes.frame.rows.start {
            planes.incomplete.start();
        }
        for y in self.rows.clone() {
            while next < (y + after + 1).min(self.image.height) {
                // SAFETY: as the caller's.
                let largest = unsafe { planes.push::<S::Widest>(self.points, next, held, origin) };
                if largest > limit {
                    return Err(BeyondLimit);
                }
                // SAFETY: as the caller's.
                unsafe { sums.push::<S>(planes, next) };
                next += 1;
            }
            sums.aim(&planes.frame, y, side);
            let incomplete = planes.incomplete.aim(&planes.frame, y, before);
            let inner = self.inner(side, y);
            let row = Row { tile: self, layer, y, planes, sums, sink };
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
    pub fn of_layer(&self, layer: &Layer, (x, y): (usize, usize), lanes: u32) -> u32 {
        Bits(lanes).which(|lane| {
            let x = x + lane;
            self.left.is_none_or(|left| left.has((x, y))) && layer.has(self.points.z(x, y))
        })
    }

    /// What a pixel's window and the pixels around it cover.
    pub fn around(&self, ((x, y), side): ((usize, usize), usize)) -> Rect {
        let Image { width, height, .. } = *self.image;
        let (before, after) = window_reach(side);
        let reached =
            |at: usize, size: usize| at.saturating_sub(before)..(at + after + 1).min(size);
        Rect { x: reached(x, width), y: reached(y, height) }
    }

    /// The points of a pixel's window, all of which are finite.
    pub fn points_in(
        &self,
        (pixel, side): ((usize, usize), usize),
    ) -> impl Iterator<Item = [f64; 3]> + use<'_> {
        let window = (start(pixel.0, side), start(pixel.1, side));
        let pixels = self.image.rects(window, (side, side)).flat_map(|(rect, _)| rect.pixels());
        pixels.map(|(x, y)| self.points.at(x, y).map(f64::from))
    }

    /// The normals of some lanes of those that begin with pixel `(x, y)`, by the plain form.
    #[cold]
    pub fn plain_lanes(&self, estimates: &mut Estimates, (x, y): (usize, usize), lanes: u32) {
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

/// A range from its middle on, and then what is before it, backwards.
pub(crate) fn from_middle(range: &Range<usize>) -> impl Iterator<Item = usize> + use<> {
    let middle = range.start.midpoint(range.end);
    (middle..range.end).chain((range.start..middle).rev())
}
