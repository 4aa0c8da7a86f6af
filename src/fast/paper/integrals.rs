//! Rings of the rows that a tile's windows need: points, and integral images (Eq. 1-3) of `N` channels.

use std::ops::Range;

use crate::cloud::Points;
use crate::fast::planes::grow;
use crate::simd::{GROUP, Simd};

/// x, y, z, and 1; zeros for a missing point.
pub(crate) type Counted = [f32; 4];

/// What is summed: `N` channels of a pixel.
pub(crate) trait Channels<const N: usize> {
    /// The channels of a pixel, from its point and those to the left, to the right, above and below.
    fn of(&self, own: &Counted, row: [&Counted; 2], column: [&Counted; 2]) -> [f64; N];
}

/// Both rings, over a tile's columns.
#[derive(Debug)]
pub(crate) struct Rings<const N: usize> {
    /// Element i of a row is the sum over the columns before the i-th.
    sums: Vec<[f64; N]>,
    /// Element i + 1 of a row is the point of the i-th column; the first and the last are missing points.
    points: Vec<Counted>,
    columns: Range<usize>,
    /// Rows in a ring.
    pub rows: usize,
    /// The largest coordinate read so far.
    largest: Counted,
}

impl<const N: usize> Default for Rings<N> {
    fn default() -> Self {
        let (sums, points) = (Vec::new(), Vec::new());
        Rings { sums, points, columns: 0..0, rows: 0, largest: [0.0; 4] }
    }
}

/// Rows of the rings for windows of a radius: theirs, and those above and below.
pub(crate) fn rows_of_rings(radius: usize) -> usize {
    2 * radius + 3
}

impl<const N: usize> Rings<N> {
    /// Bytes that a column takes in a row.
    pub const COLUMN: usize = size_of::<[f64; N]>() + size_of::<Counted>();

    /// Bytes held.
    pub fn size(&self) -> usize {
        self.sums.capacity() * size_of::<[f64; N]>() + self.points.capacity() * size_of::<Counted>()
    }

    /// Starts over at row `top`, with windows of up to `radius`.
    pub fn start(&mut self, columns: Range<usize>, top: usize, radius: usize) {
        (self.columns, self.largest) = (columns, [0.0; 4]);
        self.rows = rows_of_rings(radius);
        let length = self.rows * self.stride();
        grow(&mut self.points, length + GROUP);
        self.points[..length].fill([0.0; 4]);
        if self.sums.len() < length {
            self.sums.resize(length, [0.0; N]);
        }
        let above = self.row(top + self.rows - 1);
        self.sums[above].fill([0.0; N]);
    }

    /// Elements from a row to the next.
    #[inline(always)]
    pub fn stride(&self) -> usize {
        self.columns.len() + 2
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

    /// The eight points of row `y` from column `x` on; those behind the last column mean nothing.
    #[inline(always)]
    pub fn eight(&self, x: usize, y: usize) -> &[Counted; GROUP] {
        let first = self.row(y).start + x - self.columns.start + 1;
        self.points[first..].first_chunk().expect("a group of room behind the last row")
    }

    /// Reads row `y` of the points, of which `depths` says which are missing. `whole_points` as
    /// [`Points::has_whole_points`] says.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn read<S: Simd>(
        &mut self,
        points: &Points,
        depths: &[f32],
        y: usize,
        whole_points: bool,
    ) {
        let row = self.row(y);
        let to = &mut self.points[row.start + 1..row.end - 1];
        let Range { start, end } = self.columns;
        assert!(y < points.height() && start < end && end <= points.width());
        assert!(end.next_multiple_of(GROUP) <= depths.len());
        let mut largest = self.largest;
        for x in (start..end).step_by(GROUP) {
            let count = (end - x).min(GROUP);
            let to = &mut to[x - start..x - start + count];
            let mut there = [0.0_f32; GROUP];
            // SAFETY: as the caller's; the pixels are inside the cloud, and the depths readable in whole groups.
            unsafe {
                let depths = S::load(depths.as_ptr().add(x));
                S::store(there.as_mut_ptr(), S::eq(depths, depths));
                if whole_points && count == GROUP && x + count < end {
                    for i in 0..GROUP {
                        let point = points.whole_at_unchecked(x + i, y);
                        put(&mut to[i], there[i], point, &mut largest);
                    }
                } else {
                    for i in 0..count {
                        let [x, y, z] = points.at_unchecked(x + i, y);
                        put(&mut to[i], there[i], [x, y, z, 0.0], &mut largest);
                    }
                }
            }
        }
        self.largest = largest;
    }

    /// Has no points in row `y`: it is outside the image.
    pub fn read_none(&mut self, y: usize) {
        let row = self.row(y);
        self.points[row].fill([0.0; 4]);
    }

    /// The largest magnitude of a coordinate read so far.
    pub fn largest(&self) -> f32 {
        self.largest[0].max(self.largest[1]).max(self.largest[2])
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
        self.sums[self.row(y).end - 2]
    }
}

/// Puts a point, or zeros where the mask says that it is missing, and keeps the largest magnitudes.
#[inline(always)]
fn put(to: &mut Counted, there: f32, point: [f32; 4], largest: &mut Counted) {
    let point = [point[0], point[1], point[2], 1.0];
    for c in 0..4 {
        to[c] = f32::from_bits(point[c].to_bits() & there.to_bits());
    }
    for c in 0..4 {
        let size = to[c].abs();
        largest[c] = if largest[c] < size { size } else { largest[c] };
    }
}
