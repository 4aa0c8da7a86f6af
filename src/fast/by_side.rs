//! Windows of one size for all pixels of a group at once, as many times as a group has sizes: for AVERAGE_DEPTH_CHANGE.

use super::arithmetic::Floats;
use super::depth::DepthSum;
use super::half_windows::{HalfWindows, Tangents};
use super::lanes::all;
use super::pair::{Pair, contains};
use super::planes::Planes;
use super::run::OfRun;
use super::tile::Tile;
use crate::simd::{GROUP, Groups, Simd};

/// [`Sums::note`](super::tile::Sums::note)
///
/// # Safety
/// As there.
#[inline(always)]
pub(crate) unsafe fn note<S: Groups, T: DepthSum>(
    sums: &HalfWindows<T>,
    tile: &Tile,
    planes: &Planes,
    pair: &Pair,
    run: &mut OfRun<f32, 6>,
    at: usize,
) -> u32 {
    // SAFETY: as the caller's; the frame holds the largest side around every pixel of the tile.
    unsafe {
        if let Some(side) = pair.one_side::<S>(pair.windows) {
            let both = sums.of_pixels::<S::Pair>(planes, pair.x, side);
            note_lanes::<S::Pair>(both, run, at);
            return 0;
        }
        let [first, second] = [Group::<S>::new(pair, 0), Group::new(pair, GROUP)];
        let (of8, plain) = first.sum_up(sums, tile, planes);
        note_lanes::<S>(of8, run, at);
        let (of8, more_plain) = second.sum_up(sums, tile, planes);
        note_lanes::<S>(of8, run, at + GROUP);
        plain | more_plain << GROUP
    }
}

/// Eight pixels of a row and their windows.
struct Group<'a, S: Groups> {
    /// The first pixel.
    x: usize,
    y: usize,
    /// The row's sides of windows, and those that the eight pixels' sums are of.
    row: &'a [f32],
    sides: S::F,
    /// The lanes that have a window.
    windows: u32,
    /// Whether windows of any of the tile's sides are inside the image here.
    inner: bool,
}

impl<'a, S: Groups> Group<'a, S> {
    /// The group of a pair that begins with `lane`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the row is readable up to a whole pair.
    #[inline(always)]
    unsafe fn new(pair: &Pair<'a>, lane: usize) -> Self {
        let (x, y, row) = (pair.x + lane, pair.y, pair.row);
        let windows = pair.windows >> lane & all(GROUP);
        // SAFETY: as the caller's.
        unsafe {
            // A window of an odd side has the sums of the next smaller one's.
            let sides = S::load(row.as_ptr().add(x));
            let halves = S::truncate(S::mul(sides, S::splat(0.5)));
            let sides = S::add(halves, halves);
            let inner = pair.is_inner(lane, GROUP);
            Group { x, y, row, sides, windows, inner }
        }
    }

    /// The first of the lanes `todo` and those with sums over windows of the same side; and that side.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn next_windows(&self, todo: u32) -> (u32, usize) {
        let side = self.row[self.x + todo.trailing_zeros() as usize];
        // SAFETY: as the caller's; sides are whole numbers that fit i32.
        unsafe {
            let side = side.to_int_unchecked::<i32>() & !1;
            let same = S::bits(S::eq(self.sides, S::splat(side as f32))) & todo;
            (same, side as usize)
        }
    }

    /// The sums of the windows, and the lanes whose windows are left to the plain form.
    ///
    /// # Safety
    /// As [`note`].
    #[inline(always)]
    unsafe fn sum_up<T: DepthSum>(
        &self,
        sums: &HalfWindows<T>,
        tile: &Tile,
        planes: &Planes,
    ) -> (Tangents<Floats<S>>, u32) {
        let (mut plain, mut todo) = (0, self.windows);
        // SAFETY: as the caller's.
        unsafe {
            if todo == 0 {
                return (none(), 0);
            }
            let (same, side) = self.next_windows(todo);
            todo &= !same;
            let mut of8 = if self.is_inside(tile, same, side) {
                sums.of_pixels::<S>(planes, self.x, side)
            } else {
                let mut of8 = none();
                plain |= self.put_crossing(sums, tile, planes, same, side, &mut of8);
                of8
            };
            while todo != 0 {
                let (same, side) = self.next_windows(todo);
                todo &= !same;
                if self.is_inside(tile, same, side) {
                    let these = sums.of_pixels::<S>(planes, self.x, side);
                    take(&mut of8, same, these);
                } else {
                    plain |= self.put_crossing(sums, tile, planes, same, side, &mut of8);
                }
            }
            (of8, plain)
        }
    }

    /// Whether the windows of some lanes, and the pixels around them, are inside the image.
    #[inline(always)]
    fn is_inside(&self, tile: &Tile, lanes: u32, side: usize) -> bool {
        if self.inner {
            return true;
        }
        let first = lanes.trailing_zeros() as usize;
        let last = (u32::BITS - 1 - lanes.leading_zeros()) as usize;
        contains(&tile.inner(side, self.y), self.x + first..=self.x + last)
    }

    /// Puts the sums of windows that cross the border of the image; returns the lanes left to the plain form.
    ///
    /// # Safety
    /// As [`note`].
    #[inline(always)]
    unsafe fn put_crossing<T: DepthSum>(
        &self,
        sums: &HalfWindows<T>,
        tile: &Tile,
        planes: &Planes,
        lanes: u32,
        side: usize,
        of8: &mut Tangents<Floats<S>>,
    ) -> u32 {
        let ones = self.crossing(sums, tile, planes, lanes, side);
        let mut plain = lanes;
        for (lane, one) in ones.into_iter().enumerate() {
            if let Some(one) = one {
                let [[hx, hy, hz], [vx, vy, vz]] = one;
                // SAFETY: as the caller's.
                unsafe {
                    let h = [Floats::splat(hx), Floats::splat(hy), Floats::splat(hz)];
                    let v = [Floats::splat(vx), Floats::splat(vy), Floats::splat(vz)];
                    take(of8, 1 << lane, [h, v]);
                }
                plain &= !(1 << lane);
            }
        }
        plain
    }

    /// The sums of windows that cross the border of the image, but of those that are left to the plain form.
    // No instructions of `S` in here: they would not be inlined into a function of its own.
    #[cold]
    fn crossing<T: DepthSum>(
        &self,
        sums: &HalfWindows<T>,
        tile: &Tile,
        planes: &Planes,
        lanes: u32,
        side: usize,
    ) -> [Option<Tangents<f32>>; GROUP] {
        std::array::from_fn(|lane| {
            let pixel = (self.x + lane, self.y);
            // By the window's own side: whether it fits the image depends on that.
            if lanes >> lane & 1 == 0 || !tile.has_only_finite(pixel, self.row[pixel.0] as usize) {
                return None;
            }
            sums.of_mirrored(planes, tile.image, pixel, side)
        })
    }
}

/// No pixel's.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn none<S: Simd>() -> Tangents<Floats<S>> {
    // SAFETY: as the caller's.
    [[unsafe { Floats::splat(0.0) }; 3]; 2]
}

/// Takes others in some lanes.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn take<S: Simd>(
    tangents: &mut Tangents<Floats<S>>,
    lanes: u32,
    others: Tangents<Floats<S>>,
) {
    // SAFETY: as the caller's.
    let mask = unsafe { S::mask(lanes) };
    for g in 0..2 {
        for c in 0..3 {
            tangents[g][c].take(mask, others[g][c]);
        }
    }
}

/// Notes what the normals of the pixels from `at` on in a run are made from.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn note_lanes<S: Simd>(tangents: Tangents<Floats<S>>, run: &mut OfRun<f32, 6>, at: usize) {
    let [[a, b, c], [d, e, f]] = tangents;
    // SAFETY: as the caller's.
    unsafe { run.store::<S>(at, [a, b, c, d, e, f]) }
}
