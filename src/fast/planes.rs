//! A tile's points as three planes of floats, a ring of rows: what the methods' sums are made from.

use std::ops::Range;

use super::arithmetic::Floats;
use super::buffer::{Buffer, Number};
use super::incomplete::Incomplete;
use super::lanes::LANES;
use crate::Error;
use crate::cloud::Points;
use crate::simd::{Along, GROUP, Simd};

/// Columns before and after a row's own, so that groups and the pixels next to them need no special case.
pub(crate) const MARGIN: usize = GROUP;

/// Where the rows and columns of a tile lie in its rings.
#[derive(Debug, Default)]
pub(crate) struct Frame {
    /// The image's columns that are held; the first is a multiple of the group.
    pub columns: Range<usize>,
    /// Elements from a row to the next.
    pub stride: usize,
    /// Rows in a ring, a power of two.
    pub ring: usize,
    /// The image's rows that are pushed through the rings.
    pub rows: Range<usize>,
}

impl Frame {
    /// For windows of up to `side`, or of the image's height if that is less: no more of their rows are held.
    fn new(columns: Range<usize>, rows: Range<usize>, side: usize) -> Self {
        let stride = (columns.len() + 2 * MARGIN).next_multiple_of(LANES) + MARGIN;
        Frame { columns, stride, ring: Self::ring(side), rows }
    }

    /// Rows in a ring for windows of up to `side`, with those above and below.
    pub fn ring(side: usize) -> usize {
        (side + 2).next_power_of_two()
    }

    /// The largest side that needs no larger ring than this one.
    pub fn most_of_ring(side: usize) -> usize {
        Self::ring(side) - 2
    }

    /// What windows of up to `side` around a tile's pixels reach, and the pixels around them.
    pub fn around(
        columns: &Range<usize>,
        rows: &Range<usize>,
        side: usize,
        (width, height): (usize, usize),
    ) -> Self {
        let (before, after) = window_reach(side);
        let left = columns.start.saturating_sub(before) / GROUP * GROUP;
        let right = (columns.end + after + 1).min(width);
        let top = rows.start.saturating_sub(before);
        let bottom = (rows.end + after).min(height);
        Frame::new(left..right, top..bottom, side.min(height))
    }

    /// As large as any that [`Frame::around`] gives for tiles of so many columns.
    pub fn largest(columns: usize, side: usize, (width, height): (usize, usize)) -> Self {
        Frame::new(0..(GROUP + columns + side + 2).min(width), 0..0, side.min(height))
    }

    /// Whether the rings hold this frame's first rows, in the same places, after the rows of another one, `above`.
    pub fn goes_on(&self, above: &Frame) -> bool {
        (&self.columns, self.stride, self.ring) == (&above.columns, above.stride, above.ring)
            && above.rows.start <= self.rows.start
            && (self.rows.start..=self.rows.end).contains(&above.rows.end)
    }

    /// Steps of so many lanes that go over the columns and a group behind them.
    pub fn steps<S: Simd>(&self) -> usize {
        (self.columns.len().next_multiple_of(GROUP) + GROUP).div_ceil(S::LANES)
    }

    /// The ring's row in which row `y` is held while it is.
    #[inline(always)]
    pub fn place(&self, y: usize) -> usize {
        y & (self.ring - 1)
    }

    /// Where row `y` starts in a ring of so many planes, which are a stride apart.
    #[inline(always)]
    pub fn start(&self, planes: usize, y: usize) -> usize {
        self.start_of(planes, self.place(y))
    }

    /// Where the row at a place of the ring starts.
    #[inline(always)]
    pub fn start_of(&self, planes: usize, place: usize) -> usize {
        place * planes * self.stride
    }

    /// Makes room for a ring of one plane, and for a row after it.
    pub fn reserve_ring<T: Number>(&self, ring: &mut Buffer<T>) -> Result<(), Error> {
        ring.grow(self.start_of(1, self.ring + 1))
    }

    /// Makes the row after a ring of one plane one of zeros, and returns its place: it is what is above the first
    /// row that will be pushed.
    pub fn start_ring<T: Number + Default>(&self, ring: &mut Buffer<T>) -> usize {
        let zeros = self.start_of(1, self.ring)..self.start_of(1, self.ring + 1);
        ring[zeros].fill(T::default());
        self.ring
    }

    /// Index of column `x` in a row; `x` may be up to the margin before the columns.
    #[inline(always)]
    pub fn column(&self, x: usize) -> usize {
        x.wrapping_add(MARGIN).wrapping_sub(self.columns.start)
    }
}

/// How far windows of a side, and the pixels around them, reach from their pixels: to the left and upwards, and to the
/// right and downwards.
#[inline(always)]
pub(crate) fn window_reach(side: usize) -> (usize, usize) {
    (side / 2 + 1, side.div_ceil(2))
}

/// The ring of x, y and z rows. In place of points that miss a coordinate, and of those behind a row's last, stands the
/// filler of [`Planes::push`]: sums along rows and columns hold it, but no window does.
#[derive(Debug, Default)]
pub(crate) struct Planes {
    /// Where rows lie here, and in the rings of what is made from them.
    pub frame: Frame,
    data: Buffer<f32>,
    /// Of the points that were read.
    pub incomplete: Incomplete,
}

impl Planes {
    /// Makes room for frames that are no larger.
    pub fn reserve(&mut self, frame: &Frame) -> Result<(), Error> {
        self.data.grow(frame.start_of(3, frame.ring))?;
        self.incomplete.reserve(frame)
    }

    pub fn size(&self) -> usize {
        self.data.size() + self.incomplete.size()
    }

    /// The ring, for groups here and there, each of which a slice would check.
    #[inline(always)]
    pub fn as_ptr(&self) -> *const f32 {
        self.data.as_ptr()
    }

    /// Row `y`'s plane of coordinate `c`.
    #[inline(always)]
    pub fn row(&self, c: usize, y: usize) -> &[f32] {
        let start = self.frame.start(3, y) + c * self.frame.stride;
        &self.data[start..start + self.frame.stride]
    }

    /// Row `y`'s planes.
    #[inline(always)]
    pub fn rows(&self, y: usize) -> [&[f32]; 3] {
        [self.row(0, y), self.row(1, y), self.row(2, y)]
    }

    /// Reads row `y` of the points, with `filler` for missing ones and those whose depths' magnitudes are not between
    /// these. Returns the largest magnitude of x or y of a point that is held, or of the filler.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn push<S: Along>(
        &mut self,
        points: &Points,
        y: usize,
        held: [f32; 2],
        filler: [f32; 3],
    ) -> f32 {
        let Planes { frame, data, .. } = self;
        let start = frame.start(3, y);
        let row = &mut data[start..start + 3 * frame.stride];
        assert!(MARGIN + frame.steps::<S>() * S::LANES <= frame.stride);
        let points_of_row = points.row(y, frame.columns.clone());
        let xs = row[MARGIN..].as_mut_ptr();
        // SAFETY: as the caller's; all lanes, and a group behind the columns, lie inside the planes.
        unsafe {
            let (ys, zs) = (xs.add(frame.stride), xs.add(2 * frame.stride));
            let (near, far) = (S::splat(held[0]), S::splat(held[1]));
            let mut incomplete = S::splat(0.0);
            let mut largest = S::splat(0.0);
            for step in 0..frame.steps::<S>() {
                let at = step * S::LANES;
                let [x, y, z] = points_of_row.lanes::<S>(at);
                let held_z = S::and(S::lt(near, S::abs(z)), S::lt(S::abs(z), far));
                let is_held = S::and(held_z, S::and(S::finite(x), S::finite(y)));
                incomplete = S::or(incomplete, S::and_not(is_held, held_z));
                let x = S::select(is_held, x, S::splat(filler[0]));
                let y = S::select(is_held, y, S::splat(filler[1]));
                let z = S::select(is_held, z, S::splat(filler[2]));
                largest = S::max(largest, S::max(S::abs(x), S::abs(y)));
                S::store(xs.add(at), x);
                S::store(ys.add(at), y);
                S::store(zs.add(at), z);
            }
            if S::bits(incomplete) != 0 {
                self.incomplete.note(points, frame, y, held);
            }
            Floats::<S>(largest).largest()
        }
    }
}
