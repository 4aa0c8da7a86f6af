//! Step 5 of the paper, fast, for one tile of the image: rows of points go through a ring of integral rows, and
//! every pixel takes its window's sum from it.

use std::ops::Range;

use super::integrals::Integrals;
use super::methods::Sums;
use crate::cloud::Points;
use crate::fast::arithmetic::Floats;
use crate::fast::sink::Sink;
use crate::fast::tile::{Bits, Octet};
use crate::methods::Estimate;
use crate::options::Options;
use crate::orientation::turn_to_viewpoint;
use crate::paper::{CleanPoints, Cleaned, plain_estimate, window};
use crate::simd::{GROUP, Simd};

/// A rectangle of the image whose normals are computed together.
pub(crate) struct Tile<'a, F> {
    pub points: &'a Points<'a>,
    pub options: &'a Options,
    pub columns: Range<usize>,
    pub rows: Range<usize>,
    /// The largest radius in the frame.
    pub largest: usize,
    /// A row's depths and the radii of its windows.
    pub row: F,
}

impl<'a, F: Fn(usize) -> (&'a [f32], &'a [f32])> Tile<'a, F> {
    /// # Safety
    /// The processor has the instruction set of `S`; no one else writes the tile's pixels.
    #[inline(always)]
    pub unsafe fn compute<S: Simd, M: Sums<N, K>, const N: usize, const K: usize>(
        &self,
        method: &M,
        integrals: &mut Integrals<N>,
        sink: &Sink,
    ) {
        let (width, height) = (self.points.width(), self.points.height());
        let reach = self.largest;
        let columns =
            self.columns.start.saturating_sub(reach)..(self.columns.end + reach).min(width);
        let (top, bottom) =
            (self.rows.start.saturating_sub(reach), (self.rows.end + reach).min(height));
        let count = columns.len() * (bottom - top);
        integrals.start(columns, top, 2 * reach + 1);
        integrals.read(self.points, (self.row)(top).0, top);
        let mut next = top;
        for y in self.rows.clone() {
            while next < (y + reach + 1).min(bottom) {
                if next + 1 < height {
                    integrals.read(self.points, (self.row)(next + 1).0, next + 1);
                } else {
                    integrals.read_none(next + 1);
                }
                integrals.push(method, next);
                next += 1;
            }
            let error = method.error(integrals.total(next - 1), count, integrals.largest());
            // SAFETY: as the caller's.
            unsafe { self.row::<S, M, N, K>(integrals, method, sink, y, error) };
        }
    }

    /// A point of the tile: sums about it lose less.
    pub fn origin(&self) -> [f32; 3] {
        for y in self.rows.clone() {
            let depths = &(self.row)(y).0[self.columns.clone()];
            if let Some(at) = depths.iter().position(|depth| !depth.is_nan()) {
                return self.points.at(self.columns.start + at, y);
            }
        }
        [0.0; 3]
    }

    /// # Safety
    /// As [`Tile::compute`].
    #[inline(always)]
    unsafe fn row<S: Simd, M: Sums<N, K>, const N: usize, const K: usize>(
        &self,
        integrals: &Integrals<N>,
        method: &M,
        sink: &Sink,
        y: usize,
        error: f64,
    ) {
        let (width, height) = (self.points.width(), self.points.height());
        let points = Cleaned { points: self.points, zero_is_missing: self.options.zero_is_missing };
        let radii = (self.row)(y).1;
        for x in self.columns.clone().step_by(GROUP) {
            let count = (self.columns.end - x).min(GROUP);
            // SAFETY: as the caller's; a row of radii is readable up to a whole group.
            unsafe {
                let row = S::load(radii.as_ptr().add(x));
                let windows = S::bits(S::lt(S::splat(0.0), row)) & ((1 << count) - 1);
                if windows == 0 {
                    sink.write_none(x, y, count);
                    continue;
                }
                let mut numbers = [[0.0; GROUP]; K];
                let mut here = [[0.0; GROUP]; 3];
                let mut plain = 0;
                for lane in Bits(windows) {
                    let radius = radii[x + lane].to_int_unchecked::<i32>() as usize;
                    let rect = window((x + lane, y), radius, width, height);
                    let summed = M::summed(&rect);
                    let sum = integrals.sum(summed.x, summed.y);
                    let point = self.points.at_unchecked(x + lane, y);
                    for c in 0..3 {
                        here[c][lane] = point[c];
                    }
                    match method.numbers(sum, &rect, &points) {
                        Some(of_window) => {
                            for i in 0..K {
                                numbers[i][lane] = of_window[i];
                            }
                        }
                        None => plain |= 1 << lane,
                    }
                }
                let found = M::normals::<S>(&numbers, error, windows & !plain);
                let plain = (plain | found.doubtful) & windows;
                let here = [
                    Floats(S::load(here[0].as_ptr())),
                    Floats(S::load(here[1].as_ptr())),
                    Floats(S::load(here[2].as_ptr())),
                ];
                let sure = windows & !plain;
                let viewpoint = self.options.viewpoint;
                let mut normals =
                    Octet::of::<S>(found.normal, found.curvature, here, viewpoint, sure);
                for lane in Bits(plain) {
                    let radius = radii[x + lane] as usize;
                    normals.put(lane, self.plain(&points, (x + lane, y), radius));
                }
                sink.write(x, y, count, &normals, M::CURVATURE);
            }
        }
    }

    /// The plain form of one pixel.
    #[cold]
    fn plain(&self, points: &Cleaned, (x, y): (usize, usize), radius: usize) -> Estimate {
        let rect = window((x, y), radius, self.points.width(), self.points.height());
        let found = plain_estimate(self.options.method, points, &rect);
        let normal = turn_to_viewpoint(found.normal, points.at(x, y), self.options.viewpoint);
        Estimate { normal, ..found }
    }
}
