//! Integral images (Eq. 1-3) of `N` channels, the rows that a tile's windows need: a ring of them.

use std::ops::Range;

use crate::cloud::Points;
use crate::fast::planes::grow;

/// x, y, z, and 1; zeros for a missing point.
pub(crate) type Counted = [f32; 4];

/// What is summed: `N` channels of a pixel.
pub(crate) trait Channels<const N: usize> {
    /// The channels of a pixel, from its point and those to the left, to the right, above and below.
    fn of(&self, own: &Counted, row: [&Counted; 2], column: [&Counted; 2]) -> [f64; N];
}

/// The ring of integral rows over a tile's columns.
#[derive(Debug)]
pub(crate) struct Integrals<const N: usize> {
    sums: Vec<[f64; N]>,
    /// A ring of three rows of points, each between two missing ones.
    points: Vec<Counted>,
    columns: Range<usize>,
    /// The largest coordinate read so far.
    largest: Counted,
    /// Rows in the ring, less one.
    mask: usize,
}

impl<const N: usize> Default for Integrals<N> {
    fn default() -> Self {
        Integrals {
            sums: Vec::new(),
            points: Vec::new(),
            columns: 0..0,
            largest: [0.0; 4],
            mask: 0,
        }
    }
}

/// Rows of points held: those that a pixel's channels need.
const HELD: usize = 3;

impl<const N: usize> Integrals<N> {
    /// Bytes held.
    pub fn size(&self) -> usize {
        self.sums.capacity() * size_of::<[f64; N]>() + self.points.capacity() * size_of::<Counted>()
    }

    /// Starts over at row `top`, with windows of up to `rows` rows.
    pub fn start(&mut self, columns: Range<usize>, top: usize, rows: usize) {
        // One row more than the windows': the one above them.
        let ring = (rows + 1).next_power_of_two();
        let (length, held) = (columns.len() + 1, columns.len() + 2);
        grow(&mut self.points, HELD * held);
        self.points.fill([0.0; 4]);
        if self.sums.len() < ring * length {
            self.sums.resize(ring * length, [0.0; N]);
        }
        (self.columns, self.largest, self.mask) = (columns, [0.0; 4], ring - 1);
        let above = self.row(top.wrapping_sub(1));
        self.sums[above].fill([0.0; N]);
    }

    /// Where row `y`'s sums lie.
    #[inline(always)]
    fn row(&self, y: usize) -> Range<usize> {
        let length = self.columns.len() + 1;
        let start = (y & self.mask) * length;
        start..start + length
    }

    /// Where row `y`'s points lie, without the missing ones around them.
    #[inline(always)]
    fn held(&self, y: usize) -> Range<usize> {
        let start = (y % HELD) * (self.columns.len() + 2) + 1;
        start..start + self.columns.len()
    }

    /// Reads row `y` of the points, of which `depths` says which are missing.
    #[inline(always)]
    pub fn read(&mut self, points: &Points, depths: &[f32], y: usize) {
        let held = self.held(y);
        let depths = &depths[self.columns.clone()];
        for ((to, depth), x) in self.points[held].iter_mut().zip(depths).zip(self.columns.clone()) {
            let [px, py, pz] = points.at(x, y);
            let there = if depth.is_nan() { 0 } else { !0 };
            let point = [px, py, pz, 1.0];
            for c in 0..4 {
                to[c] = f32::from_bits(point[c].to_bits() & there);
                self.largest[c] = self.largest[c].max(to[c].abs());
            }
        }
    }

    /// The largest magnitude of a coordinate read so far.
    pub fn largest(&self) -> f32 {
        self.largest[0].max(self.largest[1]).max(self.largest[2])
    }

    /// Forgets the points of a row: there is none, or none is needed.
    pub fn read_none(&mut self, y: usize) {
        let held = self.held(y);
        self.points[held].fill([0.0; 4]);
    }

    /// Adds row `y`; the rows around it have been read.
    #[inline(always)]
    pub fn push(&mut self, channels: &impl Channels<N>, y: usize) {
        let count = self.columns.len();
        let (above, own) = (self.row(y.wrapping_sub(1)), self.row(y));
        let row = self.held(y);
        let row = &self.points[row.start - 1..=row.end];
        let (left, center, right) = (&row[..count], &row[1..=count], &row[2..count + 2]);
        let up = &self.points[self.held(y + HELD - 1)][..count];
        let down = &self.points[self.held(y + 1)][..count];
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

    /// The sum over a rectangle, in four reads (Eq. 3).
    #[inline(always)]
    pub fn sum(&self, x: Range<usize>, y: Range<usize>) -> [f64; N] {
        let length = self.columns.len() + 1;
        let above = (y.start.wrapping_sub(1) & self.mask) * length;
        let last = (y.end.wrapping_sub(1) & self.mask) * length;
        let (left, right) = (x.start - self.columns.start, x.end - self.columns.start);
        let (a, b) = (&self.sums[above + left], &self.sums[above + right]);
        let (c, d) = (&self.sums[last + left], &self.sums[last + right]);
        let mut sum = [0.0; N];
        for i in 0..N {
            sum[i] = (d[i] - c[i]) - (b[i] - a[i]);
        }
        sum
    }

    /// The sum over all that was pushed so far, `y` being the last row.
    pub fn total(&self, y: usize) -> [f64; N] {
        self.sums[self.row(y).end - 1]
    }
}
