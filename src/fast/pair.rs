//! Two groups of pixels of a row, side by side, and their windows.

use std::ops::{Range, RangeInclusive};

use super::lanes::{LANES, all};
use super::tile::Tile;
use crate::simd::{GROUP, Groups, Simd};

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
    pub(super) unsafe fn new<S: Groups>(
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

/// Whether a range has all of another, which is not empty.
#[inline(always)]
pub(crate) fn contains(range: &Range<usize>, other: RangeInclusive<usize>) -> bool {
    range.start <= *other.start() && *other.end() < range.end
}
