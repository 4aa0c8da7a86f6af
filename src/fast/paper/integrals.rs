//! Rings of the rows that a tile's windows need: points, and integral images (Eq. 1-3) of `N` channels.

use std::ops::Range;

use super::layers::Layer;
use crate::Error;
use crate::cloud::Points;
use crate::fast::buffer::Buffer;
use crate::fast::lanes::transpose4;
use crate::paper::{BLOCK, inverse_depth};
use crate::simd::{GROUP, Groups};

/// x, y, z, and the weight: 1, or next to nothing for a hidden point (`layers`); zeros for a missing one.
pub(crate) type Counted = [f32; 4];

/// What is summed: `N` channels of a pixel.
pub(crate) trait Channels<const N: usize> {
    /// The channels of a pixel, from its point and those to the left, to the right, above and below.
    fn of(&self, own: &Counted, row: [&Counted; 2], column: [&Counted; 2]) -> [f64; N];
}

/// Both rings, over a tile's columns.
#[derive(Debug, Default)]
pub(crate) struct Rings<const N: usize> {
    /// Element i of a row is the sum over the columns before the i-th.
    sums: Buffer<[f64; N]>,
    /// Element i + 1 of a row is the point of the i-th column; the first and those after the last are missing points.
    points: Buffer<Counted>,
    columns: Range<usize>,
    /// Rows in a ring.
    pub rows: usize,
    /// The largest magnitude of a coordinate read so far.
    pub largest: f32,
    pub layer: Layer,
    /// The least magnitude of depth of the points hidden so far.
    pub nearest_hidden: f32,
}

/// The columns or rows, of so many, that windows of those in `range` reach at a distance from their pixels at most.
pub(crate) fn reached(range: &Range<usize>, reach: usize, count: usize) -> Range<usize> {
    range.start.saturating_sub(reach)..(range.end + reach).min(count)
}

/// Rows of the rings for windows that reach a distance from their pixels, in an image of this height: theirs, and
/// those above and below.
pub(crate) fn rows_of_rings(reach: usize, height: usize) -> usize {
    (2 * reach + 3).min(height + 2)
}

/// Elements of rings of so many columns and rows.
pub(crate) fn elements_of_rings(columns: usize, rows: usize) -> usize {
    rows * stride(columns)
}

/// Elements from a row of rings of so many columns to the next.
#[inline(always)]
fn stride(columns: usize) -> usize {
    columns.next_multiple_of(GROUP) + 2
}

impl<const N: usize> Rings<N> {
    /// Bytes that a column takes in a row.
    pub const COLUMN: usize = size_of::<[f64; N]>() + size_of::<Counted>();

    /// Bytes held.
    pub fn size(&self) -> usize {
        self.sums.size() + self.points.size()
    }

    /// Makes room for so many elements.
    pub fn reserve(&mut self, elements: usize) -> Result<(), Error> {
        self.points.grow(elements + BLOCK * GROUP)?;
        self.sums.grow(elements)
    }

    /// Starts over at row `top` of a layer's points, with rings of so many rows; there is room.
    pub fn start(&mut self, columns: Range<usize>, top: usize, rows: usize, layer: &Layer) {
        (self.columns, self.largest, self.rows) = (columns, 0.0, rows);
        (self.layer, self.nearest_hidden) = (*layer, f32::INFINITY);
        let length = self.rows * self.stride();
        self.points[..length].fill([0.0; 4]);
        let above = self.row(top + self.rows - 1);
        self.sums[above].fill([0.0; N]);
    }

    /// Elements from a row to the next.
    #[inline(always)]
    pub fn stride(&self) -> usize {
        stride(self.columns.len())
    }

    /// The first column.
    #[inline(always)]
    pub fn left(&self) -> usize {
        self.columns.start
    }

    #[inline(always)]
    fn row(&self, y: usize) -> Range<usize> {
        let start = y % self.rows * self.stride();
        start..start + self.stride()
    }

    /// The points, and the sums.
    #[inline(always)]
    pub fn parts(&self) -> (&[Counted], &[[f64; N]]) {
        let length = self.rows * self.stride();
        (&self.points[..length], &self.sums[..length])
    }

    /// The points of row `y` from column `x` on, room for `BLOCK` groups; those behind the last column mean nothing.
    #[inline(always)]
    pub fn points_from(&self, x: usize, y: usize) -> &[Counted; BLOCK * GROUP] {
        let first = self.row(y).start + x - self.columns.start + 1;
        self.points[first..].first_chunk().expect("room behind the last row")
    }

    /// Reads row `y` of the points, of which `depths` says which are missing. `whole_points` as
    /// [`Points::has_whole_points`] says.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn read<S: Groups>(
        &mut self,
        points: &Points,
        depths: &[f32],
        y: usize,
        whole_points: bool,
    ) {
        let row = self.row(y);
        let count = self.columns.len();
        let length = count.next_multiple_of(GROUP);
        assert!(self.columns.start + length <= depths.len());
        let points = points.row(y, self.columns.clone(), whole_points);
        let to = &mut self.points[row][1..];
        // SAFETY: as the caller's; the depths and the row have room for whole groups.
        unsafe {
            let mut largest = S::splat(self.largest);
            for x in (0..length).step_by(GROUP) {
                let depths = S::load(depths.as_ptr().add(self.columns.start + x));
                let deeper = S::lt(S::splat(self.layer.deepest), S::abs(depths));
                let there = S::and_not(deeper, S::eq(depths, depths));
                let point = points.lanes::<S>(x);
                let mut fields = [[0.0; GROUP]; 4];
                for c in 0..3 {
                    let field = S::and(there, point[c]);
                    largest = S::max(S::abs(field), largest);
                    S::store(fields[c].as_mut_ptr(), field);
                }
                S::store(fields[3].as_mut_ptr(), S::and(there, S::splat(1.0)));
                let (from, to) = (fields.as_ptr().cast::<f32>(), to[x..x + GROUP].as_mut_ptr());
                transpose4(from, GROUP, to.cast(), 4);
                transpose4(from.add(4), GROUP, to.add(4).cast(), 4);
            }
            let mut lanes = [0.0; GROUP];
            S::store(lanes.as_mut_ptr(), largest);
            self.largest = lanes.into_iter().fold(0.0, f32::max);
        }
        to[count..].fill([0.0; 4]);
        if self.layer.hides_some() {
            self.hide(depths, y);
        }
    }

    /// Hides the points of row `y` that are not in the layer.
    #[cold]
    fn hide(&mut self, depths: &[f32], y: usize) {
        let row = self.row(y);
        let depths = &depths[self.columns.clone()];
        for (to, depth) in self.points[row][1..].iter_mut().zip(depths) {
            if depth.abs() > self.layer.deepest {
                *to = self.layer.hidden();
                self.nearest_hidden = self.nearest_hidden.min(depth.abs());
            }
        }
    }

    /// Reads row `y`, of which `depths` are the image's, as points: column, row and inverse depth.
    pub fn read_positions(&mut self, depths: &[f32], y: usize) {
        let row = self.row(y);
        let depths = &depths[self.columns.clone()];
        let (to, rest) = self.points[row][1..].split_at_mut(depths.len());
        for ((x, depth), to) in self.columns.clone().zip(depths).zip(to) {
            let inverse = inverse_depth(*depth);
            *to = if inverse.is_nan() {
                [0.0; 4]
            } else if inverse.abs() > self.layer.deepest {
                self.nearest_hidden = self.nearest_hidden.min(inverse.abs());
                self.layer.hidden()
            } else {
                [x as f32, y as f32, inverse, 1.0]
            };
        }
        rest.fill([0.0; 4]);
    }

    /// Has no points in row `y`: it is outside the image.
    pub fn read_none(&mut self, y: usize) {
        let row = self.row(y);
        self.points[row].fill([0.0; 4]);
    }

    /// Sums row `y`; the rows around it have been read.
    #[inline(always)]
    pub fn push(&mut self, channels: &impl Channels<N>, y: usize) {
        let count = self.columns.len();
        let (above, own, below) = (self.row(y + self.rows - 1), self.row(y), self.row(y + 1));
        let row = &self.points[own.clone()];
        let (left, center, right) = (&row[..count], &row[1..=count], &row[2..count + 2]);
        let up = &self.points[above.clone()][1..=count];
        let down = &self.points[below][1..=count];
        let Ok([above, sums]) = self.sums.get_disjoint_mut([above, own]) else { return };
        let (above, sums) = (&above[1..=count], &mut sums[..=count]);
        sums[0] = [0.0; N];
        let sums = &mut sums[1..];
        let mut along = [0.0; N];
        for x in 0..count {
            let value = channels.of(&center[x], [&left[x], &right[x]], [&up[x], &down[x]]);
            for c in 0..N {
                along[c] += value[c];
                sums[x][c] = above[x][c] + along[c];
            }
        }
    }

    /// The sum over all that was pushed so far, `y` being the last row.
    pub fn total(&self, y: usize) -> [f64; N] {
        self.sums[self.row(y).start + self.columns.len()]
    }
}
