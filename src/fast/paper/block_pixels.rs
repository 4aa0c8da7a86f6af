//! The pixels of blocks that choose among even windows, fast: one of each block of a group at a time. The plain form is in
//! `paper::choices`.

use std::iter::repeat_n;
use std::mem::MaybeUninit;

use super::depth_changes::least_depth_change;
use crate::Error;
use crate::fast::arithmetic::Floats;
use crate::fast::lanes::{LANES, all};
use crate::memory::{bytes, refill};
use crate::options::Options;
use crate::paper::{
    BLOCK, Cloud, EvenWindows, MIDDLE, NEAR_NOISE, NEXT, inverse_depth, marks_from,
};
use crate::simd::{Along, Simd, load_by_fours};

/// A pixel of each block of a group.
#[derive(Clone, Copy)]
pub(super) struct Pixels<S: Simd> {
    /// Its number in the block.
    pub number: Floats<S>,
    /// Where it is, from the block's middle pixel.
    pub at: [Floats<S>; 2],
    /// The mask of those that take a window.
    pub there: Floats<S>,
    pub ray: [Floats<S>; 3],
    pub inverse_depth: Floats<S>,
    pub tolerance: Floats<S>,
    pub near: Near<S>,
}

/// Of the points next to a pixel of each block, as the plain form has them.
#[derive(Clone, Copy)]
pub(super) struct Near<S: Simd> {
    pub inverse_depth: Floats<S>,
    pub noise: Floats<S>,
}

impl<S: Simd> Pixels<S> {
    /// Takes the others of a mask.
    #[inline(always)]
    pub fn take(&mut self, mask: S::F, other: &Self) {
        for axis in 0..2 {
            self.at[axis].take(mask, other.at[axis]);
        }
        for i in 0..3 {
            self.ray[i].take(mask, other.ray[i]);
        }
        self.number.take(mask, other.number);
        self.there.take(mask, other.there);
        self.inverse_depth.take(mask, other.inverse_depth);
        self.tolerance.take(mask, other.tolerance);
        self.near.inverse_depth.take(mask, other.near.inverse_depth);
        self.near.noise.take(mask, other.near.noise);
    }
}

/// `EvenWindows::tolerance`
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn tolerance<S: Simd>(depth: S::F, options: &Options) -> Floats<S> {
    // SAFETY: as the caller's.
    unsafe {
        let least = least_depth_change::<S>(depth, options);
        Floats(least) / Floats(S::mul(depth, depth)) * Floats::splat(0.5)
    }
}

/// Rows of a block's pixels and those around it.
const AROUND: usize = BLOCK + 2;

/// The rows of the image around a row of blocks. In each there is a column before the image's, and room behind it for what
/// is read of the last block.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// Columns of the image, and elements of a row.
    width: usize,
    length: usize,
    /// `AROUND` rows; NaN outside the image.
    inverse_depths: Vec<f32>,
    /// `BLOCK` rows: the means of the pixels and those next to them, or NaN for pixels that count alone.
    means: Vec<f32>,
    /// `BLOCK` rows; NaN for the pixels that are not concerned.
    depths: Vec<f32>,
    /// A row: the sums over three rows of a column.
    columns: Vec<f32>,
}

impl Rows {
    /// Bytes held.
    pub fn size(&self) -> usize {
        let Rows { inverse_depths, means, depths, columns, .. } = self;
        [inverse_depths, means, depths, columns].map(bytes).iter().sum()
    }

    /// Has room for rows of an image of this width.
    pub fn resize(&mut self, width: usize) -> Result<(), Error> {
        if self.width == width {
            return Ok(());
        }
        // None, should there not be enough memory.
        self.width = 0;
        let length = (1 + width).next_multiple_of(LANES) + LANES;
        let Rows { inverse_depths, means, depths, columns, .. } = self;
        for (rows, count) in
            [(inverse_depths, AROUND), (means, BLOCK), (depths, BLOCK), (columns, 1)]
        {
            refill(rows, repeat_n(f32::NAN, count * length))?;
        }
        (self.width, self.length) = (width, length);
        Ok(())
    }

    /// Becomes those around another row of blocks; there is room.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn read<S: Along>(&mut self, even: &EvenWindows, row: usize) {
        let &EvenWindows { cloud, asked, concerned, .. } = even;
        let &Cloud { width, height, .. } = cloud;
        let length = self.length;
        for line in 0..AROUND {
            let y = (row * BLOCK + line).wrapping_sub(1);
            let inverse_depths = &mut self.inverse_depths[line * length..][..length];
            if y < height {
                let depths = &cloud.depths[y * width..][..width];
                // SAFETY: as the caller's.
                unsafe { invert::<S>(depths, &mut inverse_depths[1..]) };
            } else {
                inverse_depths.fill(f32::NAN);
            }
        }
        for line in 0..BLOCK {
            let y = row * BLOCK + line;
            if y >= height {
                self.depths[line * length..][..length].fill(f32::NAN);
                continue;
            }
            let depths = &cloud.depths[y * width..][..width];
            // SAFETY: as the caller's.
            unsafe {
                keep::<S>(depths, concerned.row(y), &mut self.depths[line * length + 1..]);
                self.find_means::<S>(line, asked.clean.spoilt.row(y));
            }
        }
    }

    /// Finds the means around the pixels of a line of the blocks, which are spoilt or not.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn find_means<S: Along>(&mut self, line: usize, spoilt: &[u64]) {
        let Rows { width, length, inverse_depths, columns, means, .. } = self;
        let rows = [line, line + 1, line + 2].map(|row| &inverse_depths[row * *length..]);
        // SAFETY: as the caller's; rows have room for whole groups.
        unsafe {
            for at in (0..*length).step_by(S::LANES) {
                let [above, own, below] =
                    [rows[0], rows[1], rows[2]].map(|row| row[at..][..S::LANES].as_ptr());
                let sum = S::add(S::add(S::load(above), S::load(own)), S::load(below));
                S::store(columns[at..][..S::LANES].as_mut_ptr(), sum);
            }
            let means = &mut means[line * *length + 1..];
            for x in (0..*width).step_by(S::LANES) {
                let is_spoilt = S::mask(marks_from(spoilt, x) as u32 & all(S::LANES));
                let [left, own, right] =
                    [x, x + 1, x + 2].map(|column| columns[column..][..S::LANES].as_ptr());
                let sum = S::add(S::add(S::load(left), S::load(own)), S::load(right));
                let mean = S::select(is_spoilt, S::splat(f32::NAN), S::div(sum, S::splat(NEXT)));
                S::store(means[x..][..S::LANES].as_mut_ptr(), mean);
            }
        }
    }

    /// The pixels of so many blocks, at most one for each lane, whose first columns are these, in a `row` of blocks: lanes
    /// without one take no window. Depths have this `noise`. They are written in place, as there are kilobytes.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn pixels<'p, S: Along>(
        &self,
        even: &EvenWindows,
        row: usize,
        (columns, blocks): (&[usize; LANES], usize),
        noise: Floats<S>,
        pixels: &'p mut MaybeUninit<[Pixels<S>; BLOCK * BLOCK]>,
    ) -> &'p [Pixels<S>; BLOCK * BLOCK] {
        let &EvenWindows { cloud, options, .. } = even;
        let (width, height) = (cloud.width, cloud.height);
        assert!(columns.iter().all(|column| *column < width) && width + BLOCK < self.length);
        // SAFETY: as the caller's; there are so many elements and points from every column on, and all pixels are written.
        unsafe {
            let there = S::mask((1 << blocks) - 1);
            let none = S::splat(f32::NAN);
            // Without noise each counts alone.
            let counts_alone = S::mask(if even.asked.noise.is_none { all(S::LANES) } else { 0 });
            let noise = match even.asked.noise.of_exact() {
                Some(noise) => Floats::splat(noise),
                None => noise,
            };
            let noise = Floats::splat(NEAR_NOISE) * noise;
            let of_mean = noise * Floats::splat(even.asked.noise_share());
            let to = pixels.as_mut_ptr().cast::<Pixels<S>>();
            for line in 0..BLOCK {
                let depths = self.four::<S>(&self.depths, line, columns);
                let inverse_depths = self.four::<S>(&self.inverse_depths, line + 1, columns);
                let means = self.four::<S>(&self.means, line, columns);
                // Rows below the image are none's.
                let y = (row * BLOCK + line).min(height - 1);
                let points = &cloud.points[y * width..][..width + BLOCK - 1];
                let points = four_points::<S>(points, columns);
                for column in 0..BLOCK {
                    let depth = S::select(there, depths[column], none);
                    let (inverse_depth, mean) = (Floats(inverse_depths[column]), means[column]);
                    let has_mean = S::and_not(counts_alone, S::eq(mean, mean));
                    let near = Near {
                        inverse_depth: Floats(S::select(has_mean, mean, inverse_depth.0)),
                        noise: Floats(S::select(has_mean, of_mean.0, noise.0)),
                    };
                    let [x, y, z] = points[column];
                    let z = if cloud.has_range { z * inverse_depth } else { Floats::splat(1.0) };
                    let number = line * BLOCK + column;
                    let [dx, dy] = [column, line].map(|line| line as f32 - MIDDLE as f32);
                    to.add(number).write(Pixels {
                        number: Floats::splat(number as f32),
                        at: [Floats::splat(dx), Floats::splat(dy)],
                        there: Floats(S::eq(depth, depth)),
                        ray: [x * inverse_depth, y * inverse_depth, z],
                        inverse_depth,
                        tolerance: tolerance::<S>(depth, options),
                        near,
                    });
                }
            }
            pixels.assume_init_ref()
        }
    }

    /// The columns of a block's line of some of the rows, for each lane the block that starts with one of these.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the rows have so many elements from every column on.
    #[inline(always)]
    unsafe fn four<S: Along>(
        &self,
        rows: &[f32],
        line: usize,
        columns: &[usize; LANES],
    ) -> [S::F; BLOCK] {
        let row = rows[line * self.length..][..self.length].as_ptr();
        // SAFETY: as the caller's.
        unsafe { load_by_fours::<S>(|lane| row.add(1 + columns[lane])) }
    }
}

/// x, y and z of the points in the columns of a block's line, which is in a row that starts with these points, for each lane
/// the block that starts with one of these columns.
///
/// # Safety
/// The processor has the instruction set of `S`; there are so many points from every column on.
#[inline(always)]
unsafe fn four_points<S: Along>(
    points: &[[f32; 3]],
    columns: &[usize; LANES],
) -> [[Floats<S>; 3]; BLOCK] {
    let points = points.as_ptr().cast::<f32>();
    // SAFETY: as the caller's.
    unsafe {
        let first = |lane: usize| points.add(3 * columns[lane]);
        let [x0, y0, z0, x1] = load_by_fours::<S>(first);
        let [y1, z1, x2, y2] = load_by_fours::<S>(|lane| first(lane).add(4));
        let [z2, x3, y3, z3] = load_by_fours::<S>(|lane| first(lane).add(8));
        [
            [Floats(x0), Floats(y0), Floats(z0)],
            [Floats(x1), Floats(y1), Floats(z1)],
            [Floats(x2), Floats(y2), Floats(z2)],
            [Floats(x3), Floats(y3), Floats(z3)],
        ]
    }
}

/// The depths of a row that are marked, for as many elements from the first one on; NaN for the others.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn keep<S: Simd>(depths: &[f32], marks: &[u64], to: &mut [f32]) {
    let whole = depths.len() / S::LANES * S::LANES;
    for x in (0..whole).step_by(S::LANES) {
        // SAFETY: as the caller's; so many elements are there.
        unsafe {
            let kept = S::mask(marks_from(marks, x) as u32 & all(S::LANES));
            let depths = S::load(depths[x..][..S::LANES].as_ptr());
            let to = to[x..][..S::LANES].as_mut_ptr();
            S::store(to, S::select(kept, depths, S::splat(f32::NAN)));
        }
    }
    for x in whole..depths.len() {
        to[x] = if marks_from(marks, x) & 1 != 0 { depths[x] } else { f32::NAN };
    }
}

/// One over the depths of a row, for as many elements from the first one on; NaN for a missing point.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn invert<S: Simd>(depths: &[f32], to: &mut [f32]) {
    let whole = depths.len() / S::LANES * S::LANES;
    for x in (0..whole).step_by(S::LANES) {
        // SAFETY: as the caller's; so many elements are there.
        unsafe {
            let inverse = S::div(S::splat(1.0), S::load(depths[x..][..S::LANES].as_ptr()));
            let inverse = S::select(S::finite(inverse), inverse, S::splat(f32::NAN));
            S::store(to[x..][..S::LANES].as_mut_ptr(), inverse);
        }
    }
    for x in whole..depths.len() {
        to[x] = inverse_depth(depths[x]);
    }
}
