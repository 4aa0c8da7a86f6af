//! The depths of a row of points, and these themselves, missing ones NaN.

use crate::cloud::{PointRow, Points};
use crate::fast::arithmetic::Floats;
use crate::fast::lanes::{LANES, Lanes};
use crate::fast::paths::Task;
use crate::options::{Depth, Options};
use crate::paper::BLOCK;
use crate::simd::{Along, Groups, load_by_fours};

/// Elements of a row of depths: the width, and a pair of groups of NaN or more behind it.
pub(crate) fn row_length(width: usize) -> usize {
    width.next_multiple_of(LANES) + LANES
}

/// Fills a row of depths; returns the least and the largest of their magnitudes.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(crate) unsafe fn read<S: Along>(
    points: &Points,
    options: &Options,
    y: usize,
    depths: &mut [f32],
) -> [f32; 2] {
    let width = points.width();
    let has_range = options.paper.depth == Depth::Range;
    let depths = &mut depths[..row_length(width)];
    let points = points.row(y, 0..width);
    // SAFETY: as the caller's; all lanes lie inside the depths.
    unsafe {
        for x in points.starts::<S>() {
            let point = points.lanes::<S>(x);
            let (none, there) = (S::splat(f32::NAN), there::<S>(point, options));
            let depth = S::select(there, depth::<S>(point, has_range), none);
            S::store(depths.as_mut_ptr().add(x), depth);
        }
        depths[width..].fill(f32::NAN);
        magnitudes::<S>(depths)
    }
}

/// The least and the largest magnitude in a row of depths.
///
/// # Safety
/// The processor has the instruction set of `S`; the row has whole pairs of groups.
#[inline(always)]
unsafe fn magnitudes<S: Along>(depths: &[f32]) -> [f32; 2] {
    // SAFETY: as the caller's.
    unsafe {
        let (mut nearest, mut deepest) = (S::splat(f32::INFINITY), S::splat(0.0));
        for depths in depths.chunks_exact(S::LANES) {
            let depth = S::load(depths.as_ptr());
            let (there, magnitude) = (S::eq(depth, depth), S::abs(depth));
            nearest = S::min(S::select(there, magnitude, nearest), nearest);
            deepest = S::max(S::and(there, magnitude), deepest);
        }
        [Floats::<S>(nearest).least(), Floats::<S>(deepest).largest()]
    }
}

/// Where a row of points is read from and to.
pub(crate) struct OneRow<'a> {
    pub from: PointRow<'a>,
    pub points: &'a mut [[f32; 3]],
    pub depths: &'a mut [f32],
    /// What [`read`] fills and what it returns, if that is asked for.
    pub padded: Option<(&'a mut [f32], &'a mut [f32; 2])>,
}

/// Rows of points, `BLOCK` or those that are left, where they are read from and to.
pub(crate) struct PointRows<'a> {
    pub rows: &'a mut dyn Iterator<Item = OneRow<'a>>,
    /// As [`Cloud::sums`](crate::paper::Cloud::sums), or none.
    pub sums: &'a mut [[f32; 4]],
    /// Room for sums down the columns, as [`room_for_columns`] says.
    pub columns: &'a mut [f32],
    pub options: &'a Options,
    /// Whether depths are distances from the origin.
    pub has_range: bool,
}

/// What [`PointRows::columns`] holds for blocks of this number.
pub(crate) fn room_for_columns(across: usize) -> usize {
    4 * BLOCK * across.next_multiple_of(LANES)
}

/// Reads points and their depths, and sums the blocks if that is asked for.
impl Task for PointRows<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Groups>(self) {
        // SAFETY: as the caller's.
        unsafe { self.read::<S::Widest>() };
    }
}

impl PointRows<'_> {
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn read<S: Along>(self) {
        let PointRows { rows, sums, columns, options, has_range } = self;
        let columns = &mut columns[..room_for_columns(sums.len())];
        let plane = columns.len() / 4;
        columns.fill(0.0);
        for OneRow { from, points, depths, padded } in rows {
            // SAFETY: as the caller's.
            unsafe { read_points::<S>(&from, options, has_range, points, depths, columns) };
            if let Some((padded, range)) = padded {
                padded[..depths.len()].copy_from_slice(depths);
                padded[depths.len()..].fill(f32::NAN);
                // SAFETY: as the caller's.
                *range = unsafe { magnitudes::<S>(padded) };
            }
        }
        let columns = columns.as_ptr();
        for (group, sums) in sums.chunks_mut(S::LANES).enumerate() {
            let mut fields = [Lanes::ZERO; 4];
            for field in 0..4 {
                // SAFETY: as the caller's; planes have room for whole groups of blocks.
                unsafe {
                    let first = columns.add(field * plane + group * S::LANES * BLOCK);
                    let [a, b, c, d] = load_by_fours::<S>(|lane| first.add(lane * BLOCK));
                    let sum = S::add(S::add(S::add(a, b), c), d);
                    S::store(fields[field].0.as_mut_ptr(), sum);
                }
            }
            for (lane, sum) in sums.iter_mut().enumerate() {
                *sum = fields.each_ref().map(|field| field.0[lane]);
            }
        }
    }
}

/// Reads a row of points and their depths, and adds them to the sums of four fields' columns, if there are some.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn read_points<S: Along>(
    row: &PointRow,
    options: &Options,
    has_range: bool,
    to: &mut [[f32; 3]],
    depths: &mut [f32],
    columns: &mut [f32],
) {
    let width = to.len();
    let depths = &mut depths[..width];
    let plane = columns.len() / 4;
    let are_summed = plane > 0;
    assert!(!are_summed || width.next_multiple_of(S::LANES) <= plane);
    let columns = columns.as_mut_ptr();
    for x in (0..width).step_by(S::LANES) {
        // SAFETY: as the caller's; all of the lanes, or as many as there is room for, are stored.
        unsafe {
            let point = row.lanes::<S>(x);
            let (none, there) = (S::splat(f32::NAN), there::<S>(point, options));
            let depth = S::select(there, depth::<S>(point, has_range), none);
            let mut fields = [depth; 4];
            if are_summed {
                let [px, py, pz] = point;
                for (field, value) in [px, py, pz, S::splat(1.0)].into_iter().enumerate() {
                    let sum = columns.add(field * plane + x);
                    S::store(sum, S::add(S::load(sum), S::and(there, value)));
                }
            }
            for c in 0..3 {
                fields[c] = S::select(there, point[c], none);
            }
            if x + S::LANES <= width {
                S::store_points(fields, 0, to[x..].as_mut_ptr().cast(), size_of::<[f32; 3]>());
                S::store(depths[x..].as_mut_ptr(), depth);
            } else {
                let mut last = [[0.0; LANES]; 4];
                for (last, field) in last.iter_mut().zip(fields) {
                    S::store(last.as_mut_ptr(), field);
                }
                let [xs, ys, zs, of_last] = last;
                for (lane, (to, depth)) in to[x..].iter_mut().zip(&mut depths[x..]).enumerate() {
                    (*to, *depth) = ([xs[lane], ys[lane], zs[lane]], of_last[lane]);
                }
            }
        }
    }
}

/// The mask of the points that are not missing.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn there<S: Along>([x, y, z]: [S::F; 3], options: &Options) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let there = S::and(S::and(S::finite(x), S::finite(y)), S::finite(z));
        if !options.zero_is_missing {
            return there;
        }
        let zero = S::splat(0.0);
        S::and_not(S::and(S::and(S::eq(x, zero), S::eq(y, zero)), S::eq(z, zero)), there)
    }
}

/// The distances from the origin, or z.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn depth<S: Along>([x, y, z]: [S::F; 3], has_range: bool) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        if has_range {
            S::sqrt(S::add(S::add(S::mul(x, x), S::mul(y, y)), S::mul(z, z)))
        } else {
            z
        }
    }
}
