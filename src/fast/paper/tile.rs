//! Steps 4 and 5 of the paper, fast, for one tile of the image: rows of points go through a ring of integral rows, and
//! every pixel takes its window's sum from it.

use std::ops::Range;

use super::integrals::{Aimed, Rings, WEIGHT};
use super::layers::{Layer, Waiting, with_fraction};
use super::methods::Sums;
use super::rects::{Pixels, Rects, Rows};
use crate::cloud::Points;
use crate::fast::arithmetic::{Doubles, Floats};
use crate::fast::estimates::Estimates;
use crate::fast::lanes::{Bits, LANES, all};
use crate::fast::one_point::of_one_point;
use crate::fast::run::{Noted, OfRun, RUN};
use crate::fast::sink::Sink;
use crate::fast::tile::from_middle;
use crate::fast::tiling::reached;
use crate::methods::Estimate;
use crate::options::Options;
use crate::orientation::turn_to_viewpoint;
use crate::paper::{Cleaned, Marks, marks_from, plain_estimate};
use crate::rect::Rect;
use crate::simd::{GROUP, Groups};

/// A rectangle of the image whose normals are computed together.
pub(crate) struct Tile<'a> {
    pub points: &'a Points<'a>,
    pub options: &'a Options,
    pub columns: Range<usize>,
    pub rows: Range<usize>,
    /// How far a window reaches from its pixel at most.
    pub largest: usize,
    /// A row's depths, and the radii of its windows, if it has normals: 0 for none. Both can be read up to a whole group.
    pub row: &'a (dyn Fn(usize) -> (&'a [f32], &'a [f32]) + Sync),
    pub written: Written<'a>,
}

/// Which pixels' normals are written, none for those that have no window.
#[derive(Clone, Copy)]
pub(crate) enum Written<'a> {
    All,
    AllBut(&'a Marks),
    Only(&'a Marks),
}

impl Tile<'_> {
    /// The normals of the pixels whose windows a layer holds, of those that wait for it. Returns how deep the nearest point
    /// is that others wait for, if there are some.
    ///
    /// `PARTIAL` tells whether it is one of several.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; no one else writes the tile's pixels.
    #[inline(always)]
    pub unsafe fn compute<S: Groups, M: Sums<N>, const N: usize, const PARTIAL: bool>(
        &self,
        method: &M,
        rings: &mut Rings<N>,
        layer: &Layer,
        waiting: &mut Waiting,
        sink: &Sink,
    ) -> Option<f32> {
        // SAFETY: as the caller's.
        let mut next = unsafe { self.start::<S, M, N>(rings, layer) };
        self.start_waiting(layer, waiting);
        let mut run = Run::default();
        for y in self.rows.clone() {
            // SAFETY: as the caller's.
            unsafe {
                let error = self.advance::<S, M, N>(method, rings, &mut next, y);
                self.row::<S, M, N, PARTIAL>(rings, waiting, sink, &mut run, error);
            }
        }
        (layer.hides_some() && waiting.is_any()).then_some(rings.nearest_hidden)
    }

    /// Starts the rings over for a layer; returns the first row to be summed.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    pub unsafe fn start<S: Groups, M: Sums<N>, const N: usize>(
        &self,
        rings: &mut Rings<N>,
        layer: &Layer,
    ) -> usize {
        let (width, height) = (self.points.width(), self.points.height());
        let columns = reached(&self.columns, self.largest, width);
        let top = reached(&self.rows, self.largest, height).start;
        rings.start(columns, top, (self.largest, height), M::ENDS, layer);
        // SAFETY: as the caller's.
        unsafe { self.read::<S, M, N>(rings, top) };
        top
    }

    /// Has no pixel wait, if the layer is the first.
    #[inline(always)]
    pub fn start_waiting(&self, layer: &Layer, waiting: &mut Waiting) {
        if layer.is_first {
            waiting.start(self.columns.len(), self.rows.len());
        }
    }

    /// Sums the rows from `next` on that windows of row `y` reach, and aims at that row; returns what the sums' rounding
    /// errors stay below.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    pub unsafe fn advance<S: Groups, M: Sums<N>, const N: usize>(
        &self,
        method: &M,
        rings: &mut Rings<N>,
        next: &mut usize,
        y: usize,
    ) -> f64 {
        let (width, height) = (self.points.width(), self.points.height());
        let columns = reached(&self.columns, self.largest, width);
        let Range { start: top, end: bottom } = reached(&self.rows, self.largest, height);
        while *next < (y + self.largest + 1).min(bottom) {
            // SAFETY: as the caller's.
            unsafe {
                if *next + 1 < height {
                    self.read::<S, M, N>(rings, *next + 1);
                } else {
                    rings.read_none(*next + 1);
                }
                rings.push::<S>(method, *next);
            }
            *next += 1;
        }
        rings.aim(y);
        M::error(rings.total(*next - 1), columns.len() * (bottom - top), rings.largest)
    }

    /// Reads row `y` of the points.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn read<S: Groups, M: Sums<N>, const N: usize>(&self, rings: &mut Rings<N>, y: usize) {
        // SAFETY: as the caller's.
        unsafe {
            rings.read::<S::Widest>(self.points, (self.row)(y).0, y);
            if M::ENDS {
                rings.note_presence::<S::Widest>(y);
            }
        }
    }

    /// A point of a layer, near the middle: sums about it lose less.
    pub fn origin(&self, layer: &Layer) -> [f32; 3] {
        for y in from_middle(&self.rows) {
            let depths = (self.row)(y).0;
            let is_in = |x: &usize| depths[*x].abs() <= layer.deepest;
            if let Some(x) = from_middle(&self.columns).find(is_in) {
                return self.points.at(x, y);
            }
        }
        [0.0; 3]
    }

    /// The normals of the pixels of a row, which the rings are aimed at, as [`Tile::compute`].
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    pub unsafe fn row<S: Groups, M: Sums<N>, const N: usize, const PARTIAL: bool>(
        &self,
        rings: &Rings<N>,
        waiting: &mut Waiting,
        sink: &Sink,
        run: &mut Run<M::OfRun>,
        error: f64,
    ) {
        let width = self.points.width();
        let &Rings { layer, aimed: Aimed { y, .. }, .. } = rings;
        let radii = (self.row)(y).1;
        let (marks, inverted) = match self.written {
            Written::All => (None, 0),
            Written::AllBut(marks) => (Some(marks.row(y)), 0),
            Written::Only(marks) => (Some(marks.row(y)), u32::MAX),
        };
        let left_out = |x| marks.map_or(0, |row| marks_from(row, x) as u32 ^ inverted);
        let points = rings.around(y);
        let mut rows = Rows::new(rings, 0, M::EDGE);
        for start in self.columns.clone().step_by(RUN) {
            run.start = start;
            [run.lanes, run.left_out, run.few] = [[0; RUN / LANES]; 3];
            let own = [start - self.columns.start, y - self.rows.start];
            let is_later = PARTIAL && !layer.is_first;
            let asked =
                if is_later { *waiting.run(own[0], own[1]) } else { [u32::MAX; RUN / LANES] };
            let mut hidden = [0; RUN / LANES];
            let end = self.columns.end.min(start + RUN);
            for (group, x) in (start..end).step_by(GROUP).enumerate() {
                let at = group * GROUP;
                let count = (end - x).min(GROUP);
                let pixels = Pixels { x, step: 1, width };
                // SAFETY: as the caller's; the rings hold what the windows of the tile's pixels need.
                unsafe {
                    let eight = S::load(radii[x..].as_ptr());
                    let (pair, shift) = (at / LANES, at % LANES);
                    let out = left_out(x) & all(GROUP);
                    run.left_out[pair] |= out << shift;
                    let windows = S::bits(S::lt(S::splat(0.0), eight))
                        & (asked[pair] >> shift)
                        & all(count)
                        & !out;
                    if windows == 0 {
                        continue;
                    }
                    run.lanes[pair] |= windows << shift;
                    // Behind the last column radii mean nothing.
                    let eight = S::and(S::mask(windows), eight);
                    S::store(run.radii[at..][..GROUP].as_mut_ptr(), eight);
                    let rects = Rects::new(rings, &pixels, Floats(eight), windows, Some(&mut rows));
                    let sums = rects.sums(rings, M::EDGE);
                    let here = points.at(rings.place(x));
                    if PARTIAL && layer.hides_some() {
                        let lanes = with_hidden::<S, M, N>(&sums, &rects, rings, windows)
                            | here.own::<S>(WEIGHT).lt(Floats::splat(1.0));
                        hidden[pair] |= (windows & lanes) << shift;
                        run.lanes[pair] &= !(lanes << shift);
                    }
                    if M::LINES {
                        // As many as are in one row or column of a window, or fewer.
                        let [points, _] = M::weights(&sums);
                        let two = Floats::splat(2.0);
                        let few = windows & points.narrow().lt(two * Floats(eight) + two);
                        // Mostly none has.
                        if few != 0 {
                            run.few[pair] |= few << shift;
                        }
                    }
                    M::note::<S>(&sums, &rects, rings, windows, &mut run.sums, at);
                    run.points.store::<S>(at, [here.own(0), here.own(1), here.own(2)]);
                }
            }
            if PARTIAL {
                *waiting.run(own[0], own[1]) = hidden;
            }
            // SAFETY: as the caller's.
            unsafe { self.finish::<S, M, N>(sink, run, y, error, is_later) };
        }
    }

    /// Writes the normals of a run in row `y`; in a later layer, only those of the pixels that waited for it.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn finish<S: Groups, M: Sums<N>, const N: usize>(
        &self,
        sink: &Sink,
        run: &mut Run<M::OfRun>,
        y: usize,
        error: f64,
        is_later: bool,
    ) {
        let end = self.columns.end.min(run.start + RUN);
        let (mut rest, mut any_rest) = ([0; RUN / LANES], 0);
        // SAFETY: as the caller's.
        unsafe {
            run.sums.solve::<S>(0, &run.lanes);
            for (pair, x) in (run.start..end).step_by(LANES).enumerate() {
                let (at, windows) = (pair * LANES, run.lanes[pair]);
                let count = (end - x).min(LANES);
                let written = if is_later { windows } else { all(count) & !run.left_out[pair] };
                if windows == 0 {
                    sink.write::<S::Pair>((x, y), written, &Estimates::NONE, &self.columns);
                    continue;
                }
                let found = M::estimate::<S::Pair>(&run.sums, at, error);
                rest[pair] = (found.doubtful | run.few[pair]) & windows;
                any_rest |= rest[pair];
                let here = run.points.load::<S::Pair>(at);
                let normals = Estimates::of(found, here, self.options.viewpoint, windows);
                sink.write::<S::Pair>((x, y), written, &normals, &self.columns);
            }
            if any_rest == 0 {
                return;
            }
            for pair in 0..RUN / LANES {
                if rest[pair] != 0 {
                    self.settle::<S, M, N>(sink, run, y, pair, rest[pair], error);
                }
            }
        }
    }

    /// Writes those normals of a pair of a run, of these lanes, that are doubtful: apart, as in PCL's semantics.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn settle<S: Groups, M: Sums<N>, const N: usize>(
        &self,
        sink: &Sink,
        run: &mut Run<M::OfRun>,
        y: usize,
        pair: usize,
        doubtful: u32,
        error: f64,
    ) {
        let at = pair * LANES;
        let size = (self.points.width(), self.points.height());
        let cleaned = Cleaned::new(self.points, self.options);
        let Run { start, radii, sums, points, few, .. } = run;
        let x = *start + at;
        let pixel = |lane: usize| (x + lane, y);
        let rect = |lane: usize| Rect::around(pixel(lane), radii[at + lane] as usize, size);
        // SAFETY: as the caller's.
        unsafe {
            let around = |lane: usize| (pixel(lane), rect(lane));
            let windows = doubtful & !of_one_point::<S::Widest>(self.points, doubtful, around);
            let mut found = M::estimate::<S::Pair>(sums, at, error);
            let few = windows & few[pair];
            let precisely = |lane: usize| sums.precisely(at + lane, error);
            let mut plain = found.take_precise(windows & !few, precisely);
            if plain != 0 {
                let points = |lane: usize| cleaned.finite(rect(lane));
                if sums.afresh::<S, _>(at, plain, points) {
                    plain = found.take_certain(plain, &M::estimate::<S::Pair>(sums, at, 0.0));
                }
                plain = found.take_precise(plain, |lane| sums.precisely(at + lane, 0.0));
            }
            plain |= few;
            let here = points.load::<S::Pair>(at);
            let mut normals = Estimates::of(found, here, self.options.viewpoint, windows & !plain);
            for lane in Bits(plain) {
                normals.put(lane, self.plain(&cleaned, pixel(lane), &rect(lane)));
            }
            sink.write::<S::Pair>((x, y), doubtful, &normals, &self.columns);
        }
    }

    /// The plain form of one pixel.
    #[cold]
    fn plain(&self, points: &Cleaned, (x, y): (usize, usize), rect: &Rect) -> Estimate {
        let found = plain_estimate(self.options.method, points, rect);
        turn_to_viewpoint(found, points.at(x, y), self.options.viewpoint)
    }
}

/// The lanes of eight windows, of some, that hold hidden points.
///
/// # Safety
/// As [`Sums::note`].
#[inline(always)]
unsafe fn with_hidden<S: Groups, M: Sums<N>, const N: usize>(
    sums: &[Doubles<S>; N],
    rects: &Rects<S>,
    rings: &Rings<N>,
    lanes: u32,
) -> u32 {
    let [a, b] = M::weights(sums);
    // SAFETY: as the caller's.
    let mut hidden = unsafe { with_fraction(a) | with_fraction(b) };
    // A missing point beside one at the end of a middle row or column leaves no difference with it.
    if M::ENDS {
        // SAFETY: as the caller's.
        let each = unsafe { rects.each() };
        hidden |= Bits(lanes & !hidden).which(|lane| {
            let ends = [0, 1].map(|line| each.outermost(rings, line, lane));
            ends.iter()
                .flatten()
                .any(|(ends, _)| ends.iter().any(|end| rings.field(*end, WEIGHT) < 1.0))
        });
    }
    hidden
}

/// Pixels of a row whose normals are found step by step, each step for all of them.
pub(super) struct Run<T> {
    /// The first one's column.
    start: usize,
    radii: [f32; RUN],
    sums: T,
    points: OfRun<f32, 3>,
    /// The lanes of each pair of groups that have a window, and those that are left out.
    lanes: [u32; RUN / LANES],
    left_out: [u32; RUN / LANES],
    /// Those whose points may be on one line of the image.
    few: [u32; RUN / LANES],
}

impl<T: Default> Default for Run<T> {
    fn default() -> Self {
        let (sums, points) = (T::default(), OfRun::default());
        let none = [0; RUN / LANES];
        Run { start: 0, radii: [0.0; RUN], sums, points, lanes: none, left_out: none, few: none }
    }
}
