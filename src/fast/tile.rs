//! Steps 4 and 5, fast, for one tile of the image: rows of points go through rings of sums, and every group of
//! eight pixels takes its windows' sums from them.

use std::ops::{Range, RangeInclusive};

use super::arithmetic::{Floats, dot};
use super::lanes::LANES;
use super::planes::{Frame, MARGIN, Planes};
use super::run::{Noted, RUN};
use super::sink::Sink;
use crate::Error;
use crate::cloud::Points;
use crate::methods::{Estimate, estimate};
use crate::options::{BorderPolicy, Options};
use crate::orientation::turn_to_viewpoint;
use crate::simd::{GROUP, Groups, Simd};
use crate::window::Image;

/// What a method finds for some pixels side by side: normals of unit length, not yet turned, and curvatures.
pub(crate) struct Found<S: Simd> {
    pub normal: [Floats<S>; 3],
    pub curvature: Floats<S>,
    /// The lanes whose sums are too near to the rounding of the rings: the plain form decides.
    pub doubtful: u32,
}

impl<S: Simd> Found<S> {
    /// Takes the normals and curvatures of some lanes of another.
    #[inline(always)]
    pub fn take(&mut self, lanes: u32, other: &Self) {
        // SAFETY: there is a group, so there is the instruction set.
        unsafe {
            let mask = S::mask(lanes);
            for c in 0..3 {
                self.normal[c].0 = S::select(mask, other.normal[c].0, self.normal[c].0);
            }
            self.curvature.0 = S::select(mask, other.curvature.0, self.curvature.0);
        }
    }
}

/// A method's sums over windows, from rings of integral rows. Each method says what it keeps a ring of.
pub(crate) trait Sums {
    /// The sums of as many windows as there are lanes.
    type OfLanes<S: Simd>: Copy;
    /// The sums of one window.
    type Of1;
    /// What the normals of a run of pixels are made from.
    type OfRun: Noted;

    /// Bytes a column of a ring's row takes.
    const COLUMN: usize;

    /// Whether the method gives a curvature.
    const CURVATURE: bool;

    /// Whether sums go wrong where a coordinate is beyond the limit: the camera is the origin where that will do.
    const LIMITED: bool;

    /// Whether pairs of groups are summed as such: not where a group's sums fill the registers.
    const PAIRS: bool;

    /// Makes room for frames that are no larger, and windows of up to `side`.
    fn reserve(&mut self, frame: &Frame, side: usize) -> Result<(), Error>;

    /// Forgets the rows pushed before. `side` bounds the windows, `limit` the depths, and where the method is
    /// [`Sums::LIMITED`] all coordinates, counted from the origin.
    fn start(&mut self, frame: &Frame, limit: f32, side: usize, origin: [f32; 3]);

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

    /// The sums of the windows of `side` x `side` around the pixels from `x` on, one in each lane, of the row aimed
    /// at. The windows, and the pixels around them, lie inside the image and hold finite points only.
    ///
    /// # Safety
    /// As [`Sums::push`]; the rings hold the rows and columns of the windows.
    unsafe fn of_pixels<S: Simd>(
        &self,
        frame: &Frame,
        planes: &Planes,
        x: usize,
        side: usize,
    ) -> Self::OfLanes<S>;

    /// `mask ? yes : no`
    ///
    /// # Safety
    /// As [`Sums::push`].
    unsafe fn select<S: Simd>(
        lanes: u32,
        yes: Self::OfLanes<S>,
        no: Self::OfLanes<S>,
    ) -> Self::OfLanes<S>;

    /// The sums of one window that crosses the border of the image and is mirrored there; none if this method
    /// leaves such windows to the plain form.
    fn of_mirrored(
        &self,
        frame: &Frame,
        planes: &Planes,
        image: &Image,
        pixel: (usize, usize),
        side: usize,
    ) -> Option<Self::Of1>;

    /// Sums to put lanes into.
    ///
    /// # Safety
    /// As [`Sums::push`].
    unsafe fn none<S: Simd>() -> Self::OfLanes<S>;

    /// Replaces one lane.
    ///
    /// # Safety
    /// As [`Sums::push`].
    unsafe fn put<S: Simd>(sums: &mut Self::OfLanes<S>, lane: usize, one: Self::Of1);

    /// Notes windows of some lanes of a pair of groups, which is `at` in its run, from their points, without the rings'
    /// rounding; returns whether: else they are left to the plain form. What was noted of the pair before is lost.
    /// `windows` gives a lane's pixel and side.
    ///
    /// # Safety
    /// As [`Sums::push`].
    unsafe fn afresh<S: Groups>(
        _points: &Points,
        _image: &Image,
        _windows: impl Fn(usize) -> ((usize, usize), usize),
        _lanes: u32,
        _run: &mut Self::OfRun,
        _at: usize,
    ) -> bool {
        false
    }

    /// Notes what the normals of the pixels from `at` on in a run are made from.
    ///
    /// # Safety
    /// As [`Sums::push`].
    unsafe fn note<S: Simd>(sums: Self::OfLanes<S>, run: &mut Self::OfRun, at: usize);

    /// The estimates of the pixels from `at` on in a run, which are solved; `sides` are those of their windows. Whether
    /// their sums are from [`Sums::afresh`], `fresh` tells.
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
    /// No finite depth's magnitude is larger.
    pub deepest: f32,
    pub whole_points: bool,
}

/// A point farther from the camera's axis than the sums allow.
struct BeyondLimit;

impl Tile<'_> {
    /// Computes the tile's normals. `sides` gives a row's sides of windows, readable up to a whole group. There is room
    /// for the tile's frame.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the sink's pixels of this tile are written by no one else.
    #[inline(always)]
    pub unsafe fn compute<'r, S: Groups, M: Sums>(
        &self,
        frame: &mut Frame,
        planes: &mut Planes,
        sums: &mut M,
        sides: &impl Fn(usize) -> &'r [f32],
        sink: &Sink,
    ) {
        // SAFETY: as the caller's.
        let side = unsafe { self.largest_side::<S>(sides) };
        if side == 0 {
            for y in self.rows.clone() {
                for x in self.columns.clone().step_by(GROUP) {
                    // SAFETY: as the caller's.
                    unsafe { sink.write_none(x, y, (self.columns.end - x).min(GROUP)) };
                }
            }
            return;
        }
        let size = (self.image.width, self.image.height);
        *frame = Frame::around(&self.columns, &self.rows, side, size);
        let origin = self.origin(sides);
        // Seldom is a point farther from the camera's axis than the deepest one from the camera.
        let (first, mut limit) =
            if M::LIMITED { ([0.0; 3], self.deepest) } else { (origin, f32::INFINITY) };
        sums.start(frame, self.deepest, side, first);
        loop {
            // SAFETY: as the caller's.
            let done =
                unsafe { self.rows::<S, M>(frame, planes, sums, sides, sink, side, origin, limit) };
            let Err(BeyondLimit) = done else { break };
            // SAFETY: as the caller's.
            let extent = unsafe { self.extent::<S>(frame, planes, origin) };
            if extent.is_finite() {
                sums.start(frame, extent, side, origin);
            } else {
                // Floats do not hold the way from there.
                sums.start(frame, f32::MAX, side, [0.0; 3]);
            }
            limit = f32::INFINITY;
        }
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
        origin: [f32; 3],
    ) -> f32 {
        // As bits, which are in the order of positive floats.
        let mut largest = 0;
        for y in frame.rows.clone() {
            // SAFETY: as the caller's.
            unsafe { planes.push::<S::Widest>(self.points, frame, y, self.whole_points, origin) };
            for (plane, origin) in planes.rows(frame, y).into_iter().zip(origin) {
                let row = &plane[MARGIN..MARGIN + frame.columns.len()];
                let bits = row.iter().map(|at| (at - origin).abs().to_bits());
                largest = bits.fold(largest, u32::max);
            }
        }
        f32::from_bits(largest)
    }

    /// Computes all rows, with the origin in place of missing points; what was written before x or y of a point was
    /// beyond the limit must be written again.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    unsafe fn rows<'r, S: Groups, M: Sums>(
        &self,
        frame: &Frame,
        planes: &mut Planes,
        sums: &mut M,
        sides: &impl Fn(usize) -> &'r [f32],
        sink: &Sink,
        side: usize,
        origin: [f32; 3],
        limit: f32,
    ) -> Result<(), BeyondLimit> {
        let mut run = Run::default();
        let after = side.div_ceil(2);
        let mut next = frame.rows.start;
        let mut hidden = false;
        for y in self.rows.clone() {
            while next < (y + after + 1).min(self.image.height) {
                // SAFETY: as the caller's.
                let news = unsafe {
                    planes.push::<S::Widest>(self.points, frame, next, self.whole_points, origin)
                };
                if news.largest > limit {
                    return Err(BeyondLimit);
                }
                hidden |= news.hidden;
                // SAFETY: as the caller's.
                unsafe { sums.push::<S>(frame, planes, next) };
                next += 1;
            }
            sums.aim(frame, y, side);
            let inner = self.inner(side, y);
            // SAFETY: as the caller's.
            unsafe {
                self.row::<S, M>(frame, planes, sums, sides, sink, &mut run, y, &inner, hidden);
            }
        }
        Ok(())
    }

    /// The largest side of a window in the tile that fits the image.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn largest_side<'r, S: Groups>(&self, sides: &impl Fn(usize) -> &'r [f32]) -> usize {
        // SAFETY: as the caller's; a row of sides is readable up to a whole group, and other pixels' sides do no harm.
        unsafe {
            let mut largest = S::splat(0.0);
            for y in self.rows.clone() {
                let row = sides(y).as_ptr();
                let inside = self.columns.end - self.columns.len() % GROUP;
                for x in (self.columns.start..inside).step_by(GROUP) {
                    largest = S::max(largest, S::load(row.add(x)));
                }
                for x in inside..self.columns.end {
                    largest = S::max(largest, S::splat(*row.add(x)));
                }
            }
            let mut lanes = [0.0; GROUP];
            S::store(lanes.as_mut_ptr(), largest);
            let largest = lanes.into_iter().fold(0.0, f32::max) as usize;
            largest.min(self.image.width.min(self.image.height))
        }
    }

    /// A finite point near the tile's middle: sums about it lose less.
    fn origin<'r>(&self, sides: &impl Fn(usize) -> &'r [f32]) -> [f32; 3] {
        let [(left, right), (above, below)] = [&self.columns, &self.rows].map(halves);
        for y in below.chain(above.rev()) {
            let has_window = |x: &usize| sides(y)[*x] > 0.0;
            if let Some(x) = right.clone().chain(left.clone().rev()).find(has_window) {
                return self.points.at(x, y).map(|c| if c.is_finite() { c } else { 0.0 });
            }
        }
        [0.0; 3]
    }

    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    unsafe fn row<'r, S: Groups, M: Sums>(
        &self,
        frame: &Frame,
        planes: &Planes,
        sums: &M,
        sides: &impl Fn(usize) -> &'r [f32],
        sink: &Sink,
        run: &mut Run<M>,
        y: usize,
        inner: &Range<usize>,
        hidden: bool,
    ) {
        let row = sides(y);
        for start in self.columns.clone().step_by(RUN) {
            run.length = 0;
            for x in (start..self.columns.end.min(start + RUN)).step_by(LANES) {
                // SAFETY: as the caller's; a row of sides is readable up to a whole pair of groups.
                unsafe {
                    let pair = [
                        Group::<S>::new(self, row, x, y, inner),
                        Group::new(self, row, x + GROUP, y, inner),
                    ];
                    let windows = pair[0].windows | pair[1].windows << GROUP;
                    if windows == 0 {
                        sink.write_none(x, y, (self.columns.end - x).min(LANES));
                        continue;
                    }
                    let at = run.length * LANES;
                    let plain = if hidden {
                        windows
                    } else {
                        self.pair::<S, M>(frame, planes, sums, sides, &pair, &mut run.sums, at)
                    };
                    run.places[run.length] = (x, windows);
                    run.lanes[run.length] = windows & !plain;
                    run.length += 1;
                }
            }
            // SAFETY: as the caller's.
            unsafe { self.finish::<S, M>(frame, planes, sums, row, sink, run, y) };
        }
    }

    /// Writes the normals of a run in row `y`.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    unsafe fn finish<S: Groups, M: Sums>(
        &self,
        frame: &Frame,
        planes: &Planes,
        sums: &M,
        row: &[f32],
        sink: &Sink,
        run: &mut Run<M>,
        y: usize,
    ) {
        let planes_row = planes.rows(frame, y);
        let Run { sums: of_run, places, lanes, length } = run;
        // SAFETY: as the caller's; the rows are readable up to a whole pair of groups.
        unsafe {
            of_run.solve::<S>(0, &lanes[..*length]);
            for number in 0..*length {
                let (x, mut windows) = places[number];
                let at = number * LANES;
                let sides = S::Pair::load(row.as_ptr().add(x));
                let mut found = sums.estimate::<S::Pair>(of_run, at, sides, false);
                let (mut doubtful, mut of_one_point) = (found.doubtful & lanes[number], 0);
                if doubtful != 0 {
                    of_one_point = self.of_one_point(frame, planes, row, (x, y), doubtful);
                    (windows, doubtful) = (windows & !of_one_point, doubtful & !of_one_point);
                }
                let mut plain = windows & !lanes[number] | doubtful;
                if doubtful != 0 {
                    let window = |lane: usize| ((x + lane, y), row[x + lane] as usize);
                    let (points, image) = (self.points, self.image);
                    if M::afresh::<S>(points, image, window, doubtful, of_run, at) {
                        of_run.solve::<S>(at, &[doubtful]);
                        let fresh = sums.estimate::<S::Pair>(of_run, at, sides, true);
                        found.take(doubtful, &fresh);
                        plain &= !doubtful | fresh.doubtful;
                    }
                }
                let column = frame.column(x);
                let point = [
                    Floats::load(planes_row[0].as_ptr().add(column)),
                    Floats::load(planes_row[1].as_ptr().add(column)),
                    Floats::load(planes_row[2].as_ptr().add(column)),
                ];
                let viewpoint = self.options.viewpoint;
                let mut estimates = Estimates::of(found, point, viewpoint, windows & !plain);
                let curvature = if M::CURVATURE { 0.0 } else { f32::NAN };
                for lane in Bits(of_one_point) {
                    estimates.put(lane, Estimate { curvature, ..Estimate::NONE });
                }
                if plain != 0 {
                    self.plain_lanes(&mut estimates, row, (x, y), plain);
                }
                let count = (self.columns.end - x).min(LANES);
                sink.write(x, y, count, &estimates, M::CURVATURE);
            }
        }
    }

    /// The lanes, of some of those that begin with pixel `(x, y)`, whose windows, and the pixels around them, hold the
    /// same point again and again, as a sensor's zeros for "no return" are. They have no normal, and curvature 0.
    #[cold]
    fn of_one_point(
        &self,
        frame: &Frame,
        planes: &Planes,
        row: &[f32],
        (x, y): (usize, usize),
        lanes: u32,
    ) -> u32 {
        let Image { width, height, .. } = *self.image;
        let are_alike = |lanes: RangeInclusive<usize>, side: usize| {
            let (before, after) = (side / 2 + 1, side.div_ceil(2) + 1);
            let (first, last) = (x + lanes.start(), x + lanes.end());
            let columns = first.saturating_sub(before)..(last + after).min(width);
            let columns = frame.column(columns.start)..frame.column(columns.end);
            let own = planes.rows(frame, y).map(|plane| plane[frame.column(first)].to_bits());
            (y.saturating_sub(before)..(y + after).min(height)).all(|y| {
                let planes = planes.rows(frame, y).map(|plane| &plane[columns.clone()]);
                let differ = |c: usize| planes[c].iter().map(move |at| at.to_bits() ^ own[c]);
                (0..3).flat_map(differ).fold(0, |any, bits| any | bits) == 0
            })
        };
        let side = |lane: usize| row[x + lane] as usize;
        let (first, last) = (lanes.trailing_zeros(), u32::BITS - 1 - lanes.leading_zeros());
        let largest = Bits(lanes).map(side).max().unwrap_or(0);
        if are_alike(first as usize..=last as usize, largest) {
            return lanes;
        }
        let alone = Bits(lanes).filter(|lane| are_alike(*lane..=*lane, side(*lane)));
        alone.fold(0, |alike, lane| alike | 1 << lane)
    }

    /// The normals of some lanes of those that begin with pixel `(x, y)`, by the plain form.
    #[cold]
    fn plain_lanes(
        &self,
        estimates: &mut Estimates<LANES>,
        row: &[f32],
        (x, y): (usize, usize),
        lanes: u32,
    ) {
        for lane in Bits(lanes) {
            let pixel = (x + lane, y);
            let side = row[pixel.0] as usize;
            let found = estimate(self.options.method, self.points, self.image, pixel, side);
            let point = self.points.at(pixel.0, pixel.1);
            let normal = turn_to_viewpoint(found.normal, point, self.options.viewpoint);
            estimates.put(lane, Estimate { normal, ..found });
        }
    }

    /// Notes the sums of the windows of two groups side by side, the first of which is `at` in its run; returns the
    /// lanes whose windows are left to the plain form.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    unsafe fn pair<'r, S: Groups, M: Sums>(
        &self,
        frame: &Frame,
        planes: &Planes,
        sums: &M,
        sides: &impl Fn(usize) -> &'r [f32],
        groups: &[Group<S>; 2],
        run: &mut M::OfRun,
        at: usize,
    ) -> u32 {
        let [first, second] = groups;
        // SAFETY: as the caller's; the frame holds the largest side around every pixel of the tile.
        unsafe {
            if let (Some(side), Some(other)) = (first.one_side(), second.one_side())
                && side == other
            {
                if M::PAIRS {
                    let both = sums.of_pixels::<S::Pair>(frame, planes, first.x, side);
                    M::note::<S::Pair>(both, run, at);
                } else {
                    M::note::<S>(sums.of_pixels::<S>(frame, planes, first.x, side), run, at);
                    let second = sums.of_pixels::<S>(frame, planes, second.x, side);
                    M::note::<S>(second, run, at + GROUP);
                }
                return 0;
            }
            let first = self.group::<S, M>(frame, planes, sums, sides, first);
            M::note::<S>(first.0, run, at);
            let second = self.group::<S, M>(frame, planes, sums, sides, second);
            M::note::<S>(second.0, run, at + GROUP);
            first.1 | second.1 << GROUP
        }
    }

    /// The sums of a group's windows, and the lanes whose windows are left to the plain form.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn group<'r, S: Groups, M: Sums>(
        &self,
        frame: &Frame,
        planes: &Planes,
        sums: &M,
        sides: &impl Fn(usize) -> &'r [f32],
        group: &Group<S>,
    ) -> (M::OfLanes<S>, u32) {
        let (mut plain, mut todo) = (0, group.windows);
        // SAFETY: as the caller's; the frame holds the largest side around every pixel of the tile.
        unsafe {
            if todo == 0 {
                return (M::none::<S>(), 0);
            }
            let (same, side) = group.next_windows(todo);
            todo &= !same;
            let mut of8 = if self.is_inside(group, same, side) {
                sums.of_pixels::<S>(frame, planes, group.x, side)
            } else {
                let mut of8 = M::none::<S>();
                plain |= self
                    .put_crossing::<S, M>(frame, planes, sums, sides, group, same, side, &mut of8);
                of8
            };
            while todo != 0 {
                let (same, side) = group.next_windows(todo);
                todo &= !same;
                if self.is_inside(group, same, side) {
                    let these = sums.of_pixels::<S>(frame, planes, group.x, side);
                    of8 = M::select::<S>(same, these, of8);
                } else {
                    plain |= self.put_crossing::<S, M>(
                        frame, planes, sums, sides, group, same, side, &mut of8,
                    );
                }
            }
            (of8, plain)
        }
    }

    /// The columns of row `y` around whose pixels windows of up to `side`, and the pixels around them, are inside the
    /// image.
    #[inline(always)]
    fn inner(&self, side: usize, y: usize) -> Range<usize> {
        let Image { width, height, .. } = *self.image;
        // AVERAGE_DEPTH_CHANGE reaches one pixel further than the window.
        let (half, rest) = (side / 2, side / 2 + 1);
        if y > half && y + rest < height { half + 1..width.saturating_sub(rest) } else { 0..0 }
    }

    /// Whether the windows of some lanes, and the pixels around them, are inside the image.
    #[inline(always)]
    fn is_inside<S: Groups>(&self, group: &Group<S>, lanes: u32, side: usize) -> bool {
        if group.inner {
            return true;
        }
        let first = lanes.trailing_zeros() as usize;
        let last = (u32::BITS - 1 - lanes.leading_zeros()) as usize;
        contains(&self.inner(side, group.y), group.x + first..=group.x + last)
    }

    /// Puts the sums of windows that cross the border of the image; returns the lanes left to the plain form.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    unsafe fn put_crossing<'r, S: Groups, M: Sums>(
        &self,
        frame: &Frame,
        planes: &Planes,
        sums: &M,
        sides: &impl Fn(usize) -> &'r [f32],
        group: &Group<S>,
        lanes: u32,
        side: usize,
        of8: &mut M::OfLanes<S>,
    ) -> u32 {
        let pixel = (group.x, group.y);
        let ones = self.crossing(frame, planes, sums, sides, pixel, lanes, side);
        let mut plain = lanes;
        for (lane, one) in ones.into_iter().enumerate() {
            if let Some(one) = one {
                // SAFETY: as the caller's.
                unsafe { M::put::<S>(of8, lane, one) };
                plain &= !(1 << lane);
            }
        }
        plain
    }

    /// The sums of windows that cross the border of the image, but of those that are left to the plain form. `pixel`
    /// is the group's first one.
    // No instructions of `S` in here: they would not be inlined into a function of its own.
    #[cold]
    #[allow(clippy::too_many_arguments)]
    fn crossing<'r, M: Sums>(
        &self,
        frame: &Frame,
        planes: &Planes,
        sums: &M,
        sides: &impl Fn(usize) -> &'r [f32],
        pixel: (usize, usize),
        lanes: u32,
        side: usize,
    ) -> [Option<M::Of1>; GROUP] {
        std::array::from_fn(|lane| {
            let pixel = (pixel.0 + lane, pixel.1);
            if lanes >> lane & 1 == 0 || !self.has_only_finite(pixel, side, sides) {
                return None;
            }
            sums.of_mirrored(frame, planes, self.image, pixel, side)
        })
    }

    /// Whether a mirrored window certainly holds finite points only.
    ///
    /// Distances are too large in the image's outermost rows and columns, where only one of the passes works;
    /// there, the next pixel inwards must have as large a window.
    fn has_only_finite<'r>(
        &self,
        (x, y): (usize, usize),
        side: usize,
        sides: &impl Fn(usize) -> &'r [f32],
    ) -> bool {
        let Image { width, height, border_policy } = *self.image;
        if border_policy != BorderPolicy::Mirror || side > width.min(height) {
            return false;
        }
        let inner = (x.clamp(1, width - 2), y.clamp(1, height - 2));
        inner == (x, y) || sides(inner.1)[inner.0] as usize >= side
    }
}

/// A range's first and second half.
fn halves(range: &Range<usize>) -> (Range<usize>, Range<usize>) {
    let middle = range.start + range.len() / 2;
    (range.start..middle, middle..range.end)
}

/// Whether a range has all of another, which is not empty.
#[inline(always)]
fn contains(range: &Range<usize>, other: RangeInclusive<usize>) -> bool {
    range.start <= *other.start() && *other.end() < range.end
}

/// Pixels of a row, without pairs of groups that have no window. Their normals are found step by step, each step for
/// all of them: what one pixel's step waits for does not hold up the others'.
struct Run<M: Sums> {
    sums: M::OfRun,
    /// Where the pairs begin, and the lanes that have a window.
    places: [(usize, u32); RUN / LANES],
    /// The lanes that are not left to the plain form.
    lanes: [u32; RUN / LANES],
    /// In pairs.
    length: usize,
}

impl<M: Sums> Default for Run<M> {
    fn default() -> Self {
        let (places, lanes) = ([(0, 0); RUN / LANES], [0; RUN / LANES]);
        Run { sums: M::OfRun::default(), places, lanes, length: 0 }
    }
}

/// Eight pixels of a row and their windows.
struct Group<'a, S: Groups> {
    /// The first pixel.
    x: usize,
    y: usize,
    /// The row's sides of windows, and the eight pixels'.
    row: &'a [f32],
    sides: S::F,
    /// The lanes that have a window.
    windows: u32,
    /// Whether windows of any of the tile's sides are inside the image here.
    inner: bool,
}

impl<'a, S: Groups> Group<'a, S> {
    /// # Safety
    /// The processor has the instruction set of `S`; the row is readable from `x` up to a whole group.
    #[inline(always)]
    unsafe fn new(tile: &Tile, row: &'a [f32], x: usize, y: usize, inner: &Range<usize>) -> Self {
        let count = tile.columns.end.saturating_sub(x).min(GROUP);
        // SAFETY: as the caller's.
        unsafe {
            let sides = S::load(row.as_ptr().add(x));
            let windows = S::bits(S::lt(S::splat(0.0), sides)) & ((1 << count) - 1);
            let inner = contains(inner, x..=x + GROUP - 1);
            Group { x, y, row, sides, windows, inner }
        }
    }

    /// The side of all its windows, if they have the same and are inside the image.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn one_side(&self) -> Option<usize> {
        if self.windows == 0 || !self.inner {
            return None;
        }
        // SAFETY: as the caller's.
        let (same, side) = unsafe { self.next_windows(self.windows) };
        (same == self.windows).then_some(side)
    }

    /// The first of the lanes `todo` and those with windows of the same side; and that side.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn next_windows(&self, todo: u32) -> (u32, usize) {
        let side = self.row[self.x + todo.trailing_zeros() as usize];
        // SAFETY: as the caller's; sides are whole numbers that fit i32.
        unsafe {
            let same = S::bits(S::eq(self.sides, S::splat(side))) & todo;
            (same, side.to_int_unchecked::<i32>() as usize)
        }
    }
}

/// The set bits of a mask, lowest first.
pub(crate) struct Bits(pub u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let first = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (first < 32).then_some(first)
    }
}

/// Normals and curvatures of pixels side by side.
#[repr(C, align(64))]
pub(crate) struct Estimates<const N: usize> {
    pub normal: [[f32; N]; 3],
    pub curvature: [f32; N],
}

impl<const N: usize> Estimates<N> {
    pub const NONE: Self = Estimates { normal: [[f32::NAN; N]; 3], curvature: [f32::NAN; N] };

    #[inline(always)]
    pub fn put(&mut self, lane: usize, estimate: Estimate) {
        for (to, from) in self.normal.iter_mut().zip(estimate.normal) {
            to[lane] = from;
        }
        self.curvature[lane] = estimate.curvature;
    }

    /// What was found for `lanes`, turned to the viewpoint: `orientation::turn_to_viewpoint`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn of<S: Simd>(
        Found { normal, curvature, .. }: Found<S>,
        point: [Floats<S>; 3],
        viewpoint: [f32; 3],
        lanes: u32,
    ) -> Self {
        const { assert!(S::LANES == N) };
        // SAFETY: as the caller's; the arrays hold so many lanes each.
        unsafe {
            let [x, y, z] = viewpoint;
            let viewpoint = [Floats::<S>::splat(x), Floats::splat(y), Floats::splat(z)];
            let [x, y, z] = point;
            let to_viewpoint = [viewpoint[0] - x, viewpoint[1] - y, viewpoint[2] - z];
            let cosine = dot(to_viewpoint, normal);
            let flip = S::and(S::lt(cosine.0, S::splat(0.0)), S::splat(-0.0));
            let mask = S::mask(lanes);
            let none = S::splat(f32::NAN);
            let mut estimates = std::mem::MaybeUninit::<Self>::uninit();
            let to = estimates.as_mut_ptr().cast::<f32>();
            for c in 0..3 {
                let normal = S::select(mask, S::xor(normal[c].0, flip), none);
                S::store(to.add(c * N), normal);
            }
            S::store(to.add(3 * N), S::select(mask, curvature.0, none));
            estimates.assume_init()
        }
    }
}

const _: () = assert!(MARGIN >= GROUP);
