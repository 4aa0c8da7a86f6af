//! Steps 1 to 3 of the paper, fast: depth changes and the distances to them along the columns in one sweep down the
//! rows, exact distances and radii in one sweep up. The plain forms are in `paper::depth_change`, `paper::distance`
//! and `paper::smoothing_area`.
//!
//! A distance matters up to the largest radius times the square root of 2 only, so that the nearest column's change
//! is looked for that far, and no farther than the group of pixels needs.

use std::ops::Range;

use super::depths::row_length;
use crate::Error;
use crate::fast::arithmetic::Floats;
use crate::fast::buffer::Buffer;
use crate::fast::lanes::{Bits, LANES, Lanes};
use crate::options::PaperOptions;
use crate::paper::smoothing_area;
use crate::simd::Simd;

/// More than any distance that matters; its square still fits a float exactly enough to stay the larger.
const FAR: f32 = 1e6;

/// Columns that are looked at together, or passed over if none of them has a change that is near enough.
const AT_ONCE: usize = 8;

/// How far, in pixels, a depth change can be that decides a window.
pub(crate) fn reach(options: &PaperOptions) -> usize {
    (f64::from(options.largest_radius + 1) * std::f64::consts::SQRT_2) as usize + 2
}

/// Columns before and after a row's own, at least as many as are looked at.
fn margin(options: &PaperOptions) -> usize {
    (reach(options) + AT_ONCE).next_multiple_of(LANES)
}

/// What a sweep needs beside its map.
#[derive(Debug, Default)]
pub(crate) struct Sweep {
    /// By column: the last depth, and how many rows above the next one it is.
    last: Buffer<f32>,
    gap: Buffer<f32>,
    /// The row that is swept down: masks of the depth changes to the right.
    right: Buffer<f32>,
    /// The row done last, above on the way down and below on the way up: distances along the columns.
    below: Buffer<f32>,
    /// Squares of them, with room before and after; and the least of each and the next ones, `AT_ONCE` in all.
    squares: Buffer<f32>,
    least: Buffer<f32>,
    /// The square of every distance along a row, from 1 on, in all lanes.
    along: Buffer<Lanes>,
}

/// The rows that are swept: the depths of the whole image, and their own rows of the map.
pub(crate) struct Rows<'a> {
    pub width: usize,
    pub swept: Range<usize>,
    /// Those whose radii are asked for: the others may lack depth changes behind the ends.
    pub own: Range<usize>,
    pub depths: &'a [f32],
    pub map: &'a mut [f32],
}

impl Rows<'_> {
    #[inline(always)]
    fn depths(&self, y: usize) -> &[f32] {
        let length = row_length(self.width);
        &self.depths[y * length..(y + 1) * length]
    }

    #[inline(always)]
    fn map(&mut self, y: usize) -> &mut [f32] {
        let length = row_length(self.width);
        let start = (y - self.swept.start) * length;
        &mut self.map[start..start + length]
    }

    fn image_rows(&self) -> usize {
        self.depths.len() / row_length(self.width)
    }
}

impl Sweep {
    /// Bytes held.
    pub fn size(&self) -> usize {
        let Sweep { last, gap, right, below, squares, least, along } = self;
        let rows = [last, gap, right, below, squares, least];
        rows.map(Buffer::size).into_iter().sum::<usize>() + along.size()
    }

    /// Makes room for rows of so many pixels.
    pub fn reserve(&mut self, width: usize, options: &PaperOptions) -> Result<(), Error> {
        let (length, margin) = (row_length(width), margin(options));
        self.along.grow(margin)?;
        for buffer in [&mut self.last, &mut self.gap, &mut self.right, &mut self.below] {
            buffer.grow(length)?;
        }
        self.squares.grow(length + 2 * margin)?;
        self.least.grow(length + 2 * margin)
    }

    /// Fills the map's own rows with the windows' radii, whole numbers of pixels, 0 for none. Returns the largest. There is
    /// room for the rows.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn radii<S: Simd>(&mut self, rows: &mut Rows, options: &PaperOptions) -> f32 {
        const { assert!(S::LANES == LANES) };
        let margin = margin(options);
        for (to, distance) in self.along[..margin].iter_mut().zip(1..) {
            *to = Lanes([(distance * distance) as f32; LANES]);
        }
        // SAFETY: as the caller's.
        unsafe {
            self.down::<S>(rows, options);
            self.up::<S>(rows, options)
        }
    }

    /// Depth changes, and the distances to those above in the same column.
    ///
    /// # Safety
    /// As [`Sweep::radii`].
    #[inline(always)]
    unsafe fn down<S: Simd>(&mut self, rows: &mut Rows, options: &PaperOptions) {
        let length = row_length(rows.width);
        let Range { start: first, end } = rows.swept;
        self.look_up(rows);
        // SAFETY: as the caller's; all rows and buffers have the length of a row of depths.
        unsafe {
            self.changes_to_right::<S>(rows.depths(first), options);
            self.below[..length].fill(FAR);
            for y in first..end {
                let is_last = y + 1 == rows.image_rows();
                for x in (0..length - LANES).step_by(LANES) {
                    let mut change = S::load(self.right.as_ptr().add(x));
                    if !is_last {
                        let last = S::load(self.last.as_ptr().add(x));
                        let gap = S::load(self.gap.as_ptr().add(x));
                        let depth = S::load(rows.depths(y + 1).as_ptr().add(x));
                        change = S::or(change, is_change::<S>(last, depth, gap, options));
                        let there = S::eq(depth, depth);
                        S::store(self.last.as_mut_ptr().add(x), S::select(there, depth, last));
                        let one = S::splat(1.0);
                        let gap = S::add(S::and_not(there, gap), one);
                        S::store(self.gap.as_mut_ptr().add(x), gap);
                    }
                    // `below` holds the row above here.
                    let above = S::load(self.below.as_ptr().add(x));
                    let distance = S::and_not(change, S::add(above, S::splat(1.0)));
                    S::store(self.below.as_mut_ptr().add(x), distance);
                    S::store(rows.map(y).as_mut_ptr().add(x), distance);
                }
                if y + 1 < end {
                    self.changes_to_right::<S>(rows.depths(y + 1), options);
                }
            }
        }
    }

    /// The last depths at or above the first row.
    fn look_up(&mut self, rows: &Rows) {
        let first = rows.swept.start;
        for x in 0..row_length(rows.width) {
            let above = (0..=first).rev().find(|y| !rows.depths(*y)[x].is_nan());
            self.last[x] = above.map_or(f32::NAN, |y| rows.depths(y)[x]);
            self.gap[x] = above.map_or(1, |y| first - y + 1) as f32;
        }
    }

    /// Masks where the depth to the right is a depth change away; behind a gap, at its last pixel.
    ///
    /// # Safety
    /// As [`Sweep::radii`].
    #[inline(always)]
    unsafe fn changes_to_right<S: Simd>(&mut self, depths: &[f32], options: &PaperOptions) {
        let right = &mut self.right[..depths.len()];
        let mut before = 0;
        // SAFETY: as the caller's; a row of depths has a pair of groups behind its last ones.
        unsafe {
            for x in (0..depths.len() - LANES).step_by(LANES) {
                let depth = S::load(depths.as_ptr().add(x));
                let next = S::load(depths.as_ptr().add(x + 1));
                let change = is_change::<S>(depth, next, S::splat(1.0), options);
                S::store(right.as_mut_ptr().add(x), change);
                let there = S::bits(S::eq(depth, depth));
                let behind_gap = there & !(there << 1 | before);
                before = there >> (LANES - 1);
                for lane in Bits(behind_gap) {
                    mark_gap(depths, x + lane, options, right);
                }
            }
        }
    }

    /// Distances to changes above and below, then the nearest of all columns' changes, then radii.
    ///
    /// # Safety
    /// As [`Sweep::radii`].
    #[inline(always)]
    unsafe fn up<S: Simd>(&mut self, rows: &mut Rows, options: &PaperOptions) -> f32 {
        let (length, margin) = (row_length(rows.width), margin(options));
        let inside = length - LANES;
        let Sweep { below, squares, least, along, .. } = self;
        let (below, along) = (&mut below[..length], &along[..margin]);
        let squares = &mut squares[..length + 2 * margin];
        let least = &mut least[..length + 2 * margin];
        below.fill(FAR);
        // Beside a row no depth changes lie, nor behind its end: there are no depths.
        squares.fill(FAR * FAR);
        least.fill(FAR * FAR);
        // SAFETY: as the caller's; the margins are as wide as the search is.
        unsafe {
            let mut largest = S::splat(0.0);
            for y in rows.swept.clone().rev() {
                let map = rows.map(y).as_mut_ptr();
                for x in (0..inside).step_by(LANES) {
                    let below = below.as_mut_ptr().add(x);
                    let from_below = S::add(S::load(below), S::splat(1.0));
                    let distance = S::min(S::load(map.add(x)), from_below);
                    S::store(below, distance);
                    let square = S::mul(distance, distance);
                    S::store(squares.as_mut_ptr().add(margin + x), square);
                }
                if !rows.own.contains(&y) {
                    continue;
                }
                least_of_next::<S>(squares, least);
                let depths = rows.depths(y).as_ptr();
                for x in (0..inside).step_by(LANES) {
                    let depth = S::load(depths.add(x));
                    let columns = [&*squares, &*least].map(|row| row.as_ptr().add(margin + x));
                    let radius = radius::<S>(depth, columns, along, options);
                    largest = S::max(radius, largest);
                    S::store(map.add(x), radius);
                }
            }
            Floats::<S>(largest).largest()
        }
    }
}

/// Finds the least of each and the next ones, [`AT_ONCE`] in all; the last ones of a row are not given.
///
/// # Safety
/// The processor has the instruction set of `S`; both have whole groups of lanes.
#[inline(always)]
unsafe fn least_of_next<S: Simd>(values: &[f32], least: &mut [f32]) {
    const { assert!(AT_ONCE == 8) };
    let from = values.as_ptr();
    let to = least[..values.len()].as_mut_ptr();
    // SAFETY: as the caller's; the lanes, and those next to them, are inside.
    unsafe {
        for x in (0..values.len() - LANES).step_by(LANES) {
            S::store(to.add(x), S::min(S::load(from.add(x)), S::load(from.add(x + 1))));
        }
        for next in [2, 4] {
            for x in (0..values.len() - LANES).step_by(LANES) {
                let at = to.add(x);
                S::store(at, S::min(S::load(at), S::load(at.add(next))));
            }
        }
    }
}

/// Compares the pixel behind a gap with the one before it, and marks the gap's last pixel if they are a depth change
/// apart.
#[cold]
fn mark_gap(depths: &[f32], at: usize, options: &PaperOptions, right: &mut [f32]) {
    if let Some(from) = depths[..at].iter().rposition(|depth| !depth.is_nan()) {
        let difference = depths[at] - depths[from];
        let gap = at - from;
        if smoothing_area::is_depth_change(depths[from], difference, gap, options) {
            right[at - 1] = f32::from_bits(!0);
        }
    }
}

/// `paper::smoothing_area::smallest_depth_change`
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn smallest_depth_change<S: Simd>(depth: S::F, options: &PaperOptions) -> S::F {
    // SAFETY: as the caller's.
    unsafe { S::mul(S::mul(S::splat(options.alpha), depth), depth) }
}

/// `paper::smoothing_area::least_depth_change`
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(super) unsafe fn least_depth_change<S: Simd>(depth: S::F, options: &PaperOptions) -> S::F {
    // SAFETY: as the caller's.
    unsafe { S::mul(S::splat(options.gamma), smallest_depth_change::<S>(depth, options)) }
}

/// The mask of `paper::smoothing_area::is_depth_change`; false where a depth is NaN.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn is_change<S: Simd>(
    depth: S::F,
    neighbour: S::F,
    gap: S::F,
    options: &PaperOptions,
) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let least = least_depth_change::<S>(depth, options);
        let (least, difference) = (S::mul(least, gap), S::abs(S::sub(neighbour, depth)));
        S::le(least, difference)
    }
}

/// `paper::smoothing_area::smoothing_radius`, whole pixels, of sixteen pixels; `squares` are the squared distances to
/// the changes of their own columns, and `nearby` the least of [`AT_ONCE`] of them from there on, as far to both sides
/// as matters.
///
/// # Safety
/// The processor has the instruction set of `S`; both are readable for the [`margin`] to both sides of them.
#[inline(always)]
unsafe fn radius<S: Simd>(
    depth: S::F,
    [squares, nearby]: [*const f32; 2],
    along: &[Lanes],
    options: &PaperOptions,
) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let wanted = S::mul(S::splat(options.beta), smallest_depth_change::<S>(depth, options));
        let least = S::splat(options.least_depth_radius as f32);
        // A missing depth gives the least radius here.
        let wanted = S::min(S::max(wanted, least), S::splat(options.largest_radius as f32));
        let there = S::eq(depth, depth);
        // Changes farther than this do not matter.
        let more = S::add(wanted, S::splat(1.0));
        let enough = S::and(there, S::mul(S::mul(more, more), S::splat(2.0)));

        let mut nearest = S::load(squares);
        for (passed, along) in (0..).step_by(AT_ONCE).zip(along.chunks_exact(AT_ONCE)) {
            let (matters, first) = (S::min(nearest, enough), along[0].load::<S>());
            if S::bits(S::lt(first, matters)) == 0 {
                break;
            }
            let left = S::load(nearby.sub(passed + AT_ONCE));
            let right = S::load(nearby.add(passed + 1));
            if S::bits(S::lt(S::add(S::min(left, right), first), matters)) == 0 {
                continue;
            }
            for (column, along) in (passed + 1..).zip(along) {
                let (left, right) = (S::load(squares.sub(column)), S::load(squares.add(column)));
                nearest = S::min(nearest, S::add(S::min(left, right), along.load::<S>()));
            }
        }
        let distance = S::sqrt(nearest);
        let radius = S::min(wanted, S::div(distance, S::splat(std::f32::consts::SQRT_2)));
        let too_small = S::lt(radius, S::splat(options.smallest_radius as f32));
        S::and(S::and_not(too_small, there), S::truncate(radius))
    }
}
