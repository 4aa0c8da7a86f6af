//! Steps 4 and 5, fast, for one row of a tile: every pair of groups of eight pixels takes its windows' sums from the rings,
//! and normals are made run by run.

use std::ops::Range;

use super::arithmetic::Floats;
use super::estimates::{Estimates, Found};
use super::lanes::{Bits, LANES, all};
use super::layers::Layer;
use super::one_point::of_one_point;
use super::pair::Pair;
use super::planes::Planes;
use super::run::{Noted, RUN};
use super::sink::Sink;
use super::tile::{Sums, Tile};
use crate::methods::Estimate;
use crate::simd::{Groups, Simd};

/// A row of a layer of a tile, that the sums are aimed at.
pub(super) struct Row<'a, M: Sums> {
    pub tile: &'a Tile<'a>,
    pub layer: &'a Layer,
    pub y: usize,
    pub planes: &'a Planes,
    pub sums: &'a M,
    pub sink: &'a Sink<'a>,
}

impl<M: Sums> Row<'_, M> {
    /// Computes the row that the sums are aimed at. Whether windows may hold incomplete points, `incomplete` tells.
    ///
    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    pub unsafe fn compute<S: Groups>(
        &self,
        run: &mut Run<M>,
        inner: &Range<usize>,
        incomplete: bool,
    ) {
        let &Row { tile, layer, y, planes, sums, sink } = self;
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
                        plain = planes.incomplete.in_windows(&planes.frame, &pair);
                        pair.windows &= !plain;
                    }
                    if windows == 0 {
                        tile.write::<S>(sink, (x, y), written, &Estimates::NONE);
                        continue;
                    }
                    let at = run.length * LANES;
                    if pair.windows != 0 {
                        plain |= sums.note::<S>(tile, planes, &pair, &mut run.sums, at);
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
        let (row, points) = (tile.sides.row(y), self.planes.rows(y));
        let (mut rest, mut any_rest) = ([0; RUN / LANES], 0);
        // SAFETY: as the caller's; the rows are readable up to a whole pair of groups.
        unsafe {
            run.sums.solve::<S>(0, &run.lanes[..run.length]);
            for number in 0..run.length {
                let (x, windows, written) = run.places[number];
                let sides = S::Pair::load(row.as_ptr().add(x));
                let found =
                    sums.estimate::<S::Pair>(&run.sums, number * LANES, sides, sums.error());
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
        let error = sums.error();
        // SAFETY: as the caller's.
        unsafe {
            let sides = S::Pair::load(row.as_ptr().add(x));
            let mut found = sums.estimate::<S::Pair>(of_run, at, sides, error);
            let (mut doubtful, mut of_one) = (rest & lanes, 0);
            if doubtful != 0 {
                let around = |lane: usize| (window(lane).0, tile.around(window(lane)));
                of_one = of_one_point::<S::Widest>(tile.points, doubtful, around);
                doubtful &= !of_one;
            }
            doubtful = found.take_precise(doubtful, |lane| of_run.precisely(at + lane, error));
            if doubtful != 0 {
                let points = |lane: usize| tile.points_in(window(lane));
                if of_run.afresh::<S, _>(at, doubtful, points) {
                    let fresh = sums.estimate::<S::Pair>(of_run, at, sides, 0.0);
                    doubtful = found.take_certain(doubtful, &fresh);
                }
                doubtful = found.take_precise(doubtful, |lane| {
                    let precise = of_run.precisely(at + lane, 0.0);
                    precise.or_else(|| sums.precisely(tile, window(lane)))
                });
            }
            let plain = rest & !lanes | doubtful;
            let points = self.planes.rows(y);
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
        let column = self.planes.frame.column(x);
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

/// Pixels of a row, without pairs of groups that have no window. Their normals are found step by step, each step for
/// all of them: what one pixel's step waits for does not hold up the others'.
pub(super) struct Run<M: Sums> {
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
