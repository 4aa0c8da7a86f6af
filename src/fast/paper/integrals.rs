//! Rings of the rows that a tile's windows need: points, and integral images (Eq. 1-3) of `N` channels.

use std::ops::Range;

use super::layers::Layer;
use super::presence::{Presence, Size};
use crate::Error;
use crate::cloud::Points;
use crate::fast::arithmetic::{Doubles, Floats};
use crate::fast::buffer::Buffer;
use crate::fast::lanes::LANES;
use crate::fast::moments::push_eight;
use crate::fast::planes::MARGIN;
use crate::simd::{Along, GROUP, Groups};

/// x, y, z, and the weight: 1, or next to nothing for a hidden point (`layers`); 0 for a missing one, whose coordinates are
/// NaN.
pub(crate) type Counted = [f32; 4];

/// Number of the weights' plane.
pub(crate) const WEIGHT: usize = 3;

/// What is summed: `N` channels of a pixel.
pub(crate) trait Channels<const N: usize> {
    /// The channels of eight pixels.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    unsafe fn of<S: Groups>(&self, points: &Around) -> [Doubles<S>; N];
}

/// Both rings, over a tile's columns; in a row, a margin comes before them.
#[derive(Debug, Default)]
pub(crate) struct Rings<const N: usize> {
    /// Of the columns up to this one and the rows up to this one: eight channels, which are a line of the cache, and four
    /// or two that are left.
    eights: Buffer<[f64; 8]>,
    fours: Buffer<[f64; 4]>,
    pairs: Buffer<[f64; 2]>,
    /// Row by row four planes: the points' fields.
    points: Buffer<f32>,
    columns: Range<usize>,
    /// Rows of the image.
    pub height: usize,
    /// Elements from a row of sums to the next, and from a field of a row's points to the next.
    pub stride: usize,
    /// Rows in the ring of sums, and in that of points.
    rows: usize,
    rows_of_points: usize,
    pub aimed: Aimed,
    /// Which points there are, of the rows that were noted.
    pub presence: Presence,
    /// The largest magnitude of a coordinate read so far.
    pub largest: f32,
    pub layer: Layer,
    /// The least magnitude of depth of the points hidden so far.
    pub nearest_hidden: f32,
}

/// The row whose pixels' windows are asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Aimed {
    pub y: usize,
    /// The last row down to this one that is the first in the rings.
    first: usize,
}

/// Rows of the rings for windows that reach a distance from their pixels, in an image of this height: theirs, and
/// those above and below.
pub(crate) fn rows_of_rings(reach: usize, height: usize) -> usize {
    (2 * reach + 3).min(height + 2)
}

/// Words that tell which points are there in rings of so many columns and rows.
pub(crate) fn presence_of_rings(columns: usize, rows: usize) -> usize {
    Size::new(stride(columns), rows).room()
}

/// Elements of rings of so many columns and rows.
pub(crate) fn elements_of_rings(columns: usize, rows: usize) -> usize {
    rows * stride(columns)
}

/// Elements from a row of rings of so many columns to the next.
#[inline(always)]
fn stride(columns: usize) -> usize {
    columns.next_multiple_of(LANES) + 2 * MARGIN
}

impl<const N: usize> Rings<N> {
    /// Bytes that a column takes in a row.
    pub const COLUMN: usize = size_of::<[f64; N]>() + size_of::<Counted>();

    /// Whether there are eight channels, and four or two more or alone.
    pub(super) const HAS_EIGHT: bool = {
        assert!(N.is_multiple_of(2) && N < 16 && N % 8 < 6);
        N >= 8
    };
    pub(super) const HAS_FOUR: bool = N % 8 == 4;
    pub(super) const HAS_PAIR: bool = N % 8 == 2;

    /// Bytes held.
    pub fn size(&self) -> usize {
        let sums = self.eights.size() + self.fours.size() + self.pairs.size();
        sums + self.points.size() + self.presence.size()
    }

    /// Makes room for so many elements.
    pub fn reserve(&mut self, elements: usize) -> Result<(), Error> {
        self.points.grow(size_of::<Counted>() / size_of::<f32>() * elements)?;
        self.eights.grow(usize::from(Self::HAS_EIGHT) * elements)?;
        self.fours.grow(usize::from(Self::HAS_FOUR) * elements)?;
        self.pairs.grow(usize::from(Self::HAS_PAIR) * elements)
    }

    /// Starts over at row `top` of a layer's points, in an image of this height, for windows that reach so far from their
    /// pixels; there is room. Points are held of all rows of the windows, or, without their `ends`, from the pixels' own on.
    pub fn start(
        &mut self,
        columns: Range<usize>,
        top: usize,
        (reach, height): (usize, usize),
        ends: bool,
        layer: &Layer,
    ) {
        (self.stride, self.columns, self.height) = (stride(columns.len()), columns, height);
        self.rows = rows_of_rings(reach, height);
        self.rows_of_points = if ends { self.rows } else { self.rows.min(reach + 3) };
        (self.layer, self.nearest_hidden, self.largest) = (*layer, f32::INFINITY, 0.0);
        let length = 4 * self.rows_of_points * self.stride;
        self.points[..length].fill(0.0);
        let above = self.start_above(top);
        self.clear(above..above + self.stride);
        if ends {
            self.presence.start(Size::new(self.stride, self.rows));
        }
    }

    /// Has sums of nothing.
    #[inline(always)]
    fn clear(&mut self, elements: Range<usize>) {
        if Self::HAS_EIGHT {
            self.eights[elements.clone()].fill([0.0; 8]);
        }
        if Self::HAS_FOUR {
            self.fours[elements.clone()].fill([0.0; 4]);
        }
        if Self::HAS_PAIR {
            self.pairs[elements].fill([0.0; 2]);
        }
    }

    /// Where a column is in a row.
    #[inline(always)]
    pub fn place(&self, x: usize) -> usize {
        x - self.columns.start + MARGIN
    }

    /// The first column.
    #[inline(always)]
    pub fn left(&self) -> usize {
        self.columns.start
    }

    /// Where row `y` starts in the ring of sums.
    #[inline(always)]
    fn start_of(&self, y: usize) -> usize {
        y % self.rows * self.stride
    }

    /// Where the row above row `y` starts.
    #[inline(always)]
    fn start_above(&self, y: usize) -> usize {
        self.start_of(y + self.rows - 1)
    }

    /// Row `y`'s plane of a field of the points.
    #[inline(always)]
    fn plane(&self, y: usize, field: usize) -> Range<usize> {
        let plane = self.start_of_points(y) + field * self.stride;
        plane..plane + self.stride
    }

    /// Where row `y` starts in the ring of points.
    #[inline(always)]
    fn start_of_points(&self, y: usize) -> usize {
        y % self.rows_of_points * 4 * self.stride
    }

    /// The first fields of a row's points; the others are a stride apart.
    #[inline(always)]
    fn fields(&self, y: usize) -> *const f32 {
        self.points[self.start_of_points(y)..][..4 * self.stride].as_ptr()
    }

    /// The sums of eight channels, of four, and of two.
    #[inline(always)]
    pub fn sums(&self) -> [*const f64; 3] {
        [self.eights.as_ptr().cast(), self.fours.as_ptr().cast(), self.pairs.as_ptr().cast()]
    }

    /// The points' fields: row by row four planes.
    #[inline(always)]
    pub fn points(&self) -> *const f32 {
        self.points.as_ptr()
    }

    /// Where the point's fields start that is at this place of row `y`; all rows of windows are held.
    #[inline(always)]
    pub fn place_of_point(&self, place: usize, y: usize) -> usize {
        4 * self.start_near(y) + place
    }

    /// A field of the point there.
    #[inline(always)]
    pub fn field(&self, point: usize, field: usize) -> f32 {
        self.points[point + field * self.stride]
    }

    /// The points of row `y` and those next to them.
    #[inline(always)]
    pub fn around(&self, y: usize) -> Around {
        Around {
            own: self.fields(y),
            above: self.fields(y + self.rows_of_points - 1),
            below: self.fields(y + 1),
            plane: self.stride,
        }
    }

    /// Aims at the windows around the pixels of row `y`.
    pub fn aim(&mut self, y: usize) {
        self.aimed = Aimed { y, first: y - y % self.rows };
    }

    /// [`Rings::start_of`] without a division, for rows that windows around the row aimed at reach; the one above the first
    /// wraps around.
    #[inline(always)]
    pub fn start_near(&self, y: usize) -> usize {
        let row = y.wrapping_sub(self.aimed.first) as isize;
        let rows = self.rows as isize;
        let turn = if row < 0 {
            rows
        } else if row < rows {
            0
        } else {
            -rows
        };
        (row + turn) as usize * self.stride
    }

    /// [`Rings::start_near`] by lanes.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn starts_near<S: Groups>(&self, y: Floats<S>) -> Floats<S> {
        // SAFETY: as the caller's; floats hold places in rings exactly.
        unsafe {
            let (rows, zero) = (Floats::<S>::whole(self.rows), Floats::<S>::splat(0.0));
            let row = y - Floats::whole(self.aimed.first);
            let row = row + Floats(S::and(S::lt(row.0, zero.0), rows.0));
            let row = row - Floats(S::and_not(S::lt(row.0, rows.0), rows.0));
            row * Floats::whole(self.stride)
        }
    }

    /// Reads row `y` of the points, of which `depths` says which are missing.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn read<S: Along>(&mut self, points: &Points, depths: &[f32], y: usize) {
        let stride = self.stride;
        let start = self.start_of_points(y);
        let length = self.columns.len().next_multiple_of(LANES);
        assert!(self.columns.start + length <= depths.len());
        let points = points.row(y, self.columns.clone());
        let to = self.points[start..][..4 * stride].as_mut_ptr();
        // SAFETY: as the caller's; the depths and the row have room for whole pairs of groups.
        unsafe {
            let to = to.add(MARGIN);
            let none = S::splat(f32::NAN);
            let mut largest = S::splat(self.largest);
            for x in points.starts::<S>() {
                let depths = S::load(depths.as_ptr().add(self.columns.start + x));
                let deeper = S::lt(S::splat(self.layer.deepest), S::abs(depths));
                let there = S::and_not(deeper, S::eq(depths, depths));
                let point = points.lanes::<S>(x);
                for c in 0..3 {
                    let field = S::select(there, point[c], none);
                    largest = S::max(S::abs(field), largest);
                    S::store(to.add(c * stride + x), field);
                }
                S::store(to.add(WEIGHT * stride + x), S::and(there, S::splat(1.0)));
            }
            self.largest = Floats::<S>(largest).largest();
        }
        // No points are behind the last column.
        let weights = self.plane(y, WEIGHT);
        self.points[weights][MARGIN + self.columns.len()..].fill(0.0);
        if self.layer.hides_some() {
            self.hide(y, depths);
        }
    }

    /// Hides the points of row `y` whose depths, by column, are not in the layer.
    #[cold]
    fn hide(&mut self, y: usize, depths: &[f32]) {
        let hidden = self.layer.hidden();
        let planes: [_; 4] = std::array::from_fn(|field| self.plane(y, field).start);
        for x in self.columns.clone() {
            let depth = depths[x].abs();
            if depth > self.layer.deepest {
                for (plane, value) in planes.iter().zip(hidden) {
                    self.points[plane + MARGIN + x - self.columns.start] = value;
                }
                self.nearest_hidden = self.nearest_hidden.min(depth);
            }
        }
    }

    /// Notes which points of row `y` are there.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn note_presence<S: Along>(&mut self, y: usize) {
        let weights = &self.points[self.plane(y, WEIGHT)];
        // SAFETY: as the caller's.
        unsafe { self.presence.push::<S>(weights, y) };
    }

    /// Has no points in row `y`: it is outside the image.
    pub fn read_none(&mut self, y: usize) {
        let weights = self.plane(y, WEIGHT);
        self.points[weights].fill(0.0);
    }

    /// Sums row `y`; the rows around it have been read.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn push<S: Groups>(&mut self, channels: &impl Channels<N>, y: usize) {
        let points = self.around(y);
        let (above, own) = (self.start_above(y), self.start_of(y));
        let length = self.columns.len().next_multiple_of(GROUP);
        self.clear(own + MARGIN - 1..own + MARGIN);
        let elements = self.rows * self.stride;
        let eights = self.eights[..usize::from(Self::HAS_EIGHT) * elements].as_mut_ptr();
        let fours = self.fours[..usize::from(Self::HAS_FOUR) * elements].as_mut_ptr();
        let pairs = self.pairs[..usize::from(Self::HAS_PAIR) * elements].as_mut_ptr();
        // SAFETY: as the caller's; groups, and the pixels next to them, lie inside the rows of the rings.
        unsafe {
            let zero = S::splat_d(0.0);
            let (mut of_eight, mut of_four, mut of_pair) = (zero, zero, [zero; 2]);
            for x in (MARGIN..MARGIN + length).step_by(GROUP) {
                let values = channels.of::<S>(&points.at(x));
                if Self::HAS_EIGHT {
                    let mut eight = [zero; 8];
                    for i in 0..8 {
                        eight[i] = values[i].0;
                    }
                    let rows = [eights.add(above + x).cast(), eights.add(own + x).cast()];
                    push_eight::<S>(eight, rows, &mut of_eight);
                }
                if Self::HAS_FOUR {
                    let mut four = [zero; 4];
                    for i in 0..4 {
                        four[i] = values[N - 4 + i].0;
                    }
                    let rows = [fours.add(above + x).cast(), fours.add(own + x).cast()];
                    push_four::<S>(four, rows, &mut of_four);
                }
                if Self::HAS_PAIR {
                    let pair = [values[N - 2].0, values[N - 1].0];
                    let rows = [pairs.add(above + x).cast(), pairs.add(own + x).cast()];
                    push_pair::<S>(pair, rows, &mut of_pair);
                }
            }
        }
    }

    /// The sum over all that was pushed so far, `y` being the last row.
    pub fn total(&self, y: usize) -> [f64; N] {
        let last = self.start_of(y) + MARGIN + self.columns.len() - 1;
        let mut total = [0.0; N];
        let (eight, rest) = total.split_at_mut(N / 8 * 8);
        if Self::HAS_EIGHT {
            eight.copy_from_slice(&self.eights[last]);
        }
        if Self::HAS_FOUR {
            rest.copy_from_slice(&self.fours[last]);
        }
        if Self::HAS_PAIR {
            rest.copy_from_slice(&self.pairs[last]);
        }
        total
    }
}

/// As [`push_eight`], of four channels; `carry` is the sum along the row twice.
///
/// # Safety
/// As [`push_eight`].
#[inline(always)]
unsafe fn push_four<S: Groups>(values: [S::D; 4], [above, own]: [*mut f64; 2], carry: &mut S::D) {
    // SAFETY: as the caller's.
    unsafe {
        // Side by side the first four pixels and the last four, which go on from there.
        let mut along = S::transpose_fours_d(values);
        for i in 1..4 {
            along[i] = S::add_d(along[i - 1], along[i]);
        }
        let [start, _] = S::join_halves_d(S::splat_d(0.0), along[3]);
        let start = S::add_d(start, *carry);
        for i in 0..4 {
            let at = |half: usize| 4 * (i + 4 * half);
            along[i] = S::add_d(along[i], start);
            let sum = S::add_d(along[i], S::load_fours_d(|half| above.add(at(half))));
            S::store_fours_d(sum, |half| own.add(at(half)));
        }
        [_, *carry] = S::join_halves_d(along[3], along[3]);
    }
}

/// As [`push_eight`], of two channels; `carries` are their sums along the row.
///
/// # Safety
/// As [`push_eight`].
#[inline(always)]
unsafe fn push_pair<S: Groups>(
    values: [S::D; 2],
    [above, own]: [*mut f64; 2],
    carries: &mut [S::D; 2],
) {
    // SAFETY: as the caller's.
    unsafe {
        let first = S::running_sum_d(values[0], &mut carries[0]);
        let second = S::running_sum_d(values[1], &mut carries[1]);
        let along = S::pair_d(first, second);
        for half in 0..2 {
            let at = 8 * half;
            S::store_d(own.add(at), S::add_d(along[half], S::load_d(above.add(at))));
        }
    }
}

/// The fields of a row's points and of those next to them.
#[derive(Clone, Copy)]
pub(crate) struct Around {
    own: *const f32,
    above: *const f32,
    below: *const f32,
    /// From a field to the next.
    plane: usize,
}

impl Around {
    /// Those from a place of the row on.
    #[inline(always)]
    pub fn at(&self, place: usize) -> Around {
        Around {
            own: self.own.wrapping_add(place),
            above: self.above.wrapping_add(place),
            below: self.below.wrapping_add(place),
            plane: self.plane,
        }
    }

    /// A field of eight points.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn own<S: Groups>(&self, field: usize) -> Floats<S> {
        // SAFETY: as the caller's.
        unsafe { Floats::load(self.own.wrapping_add(field * self.plane)) }
    }

    /// A field of the points to the left and to the right.
    ///
    /// # Safety
    /// As [`Around::own`].
    #[inline(always)]
    pub unsafe fn beside<S: Groups>(&self, field: usize) -> [Floats<S>; 2] {
        let own = self.own.wrapping_add(field * self.plane);
        // SAFETY: as the caller's; the rows have margins.
        unsafe { [Floats::load(own.wrapping_sub(1)), Floats::load(own.wrapping_add(1))] }
    }

    /// A field of the points above and below.
    ///
    /// # Safety
    /// As [`Around::own`].
    #[inline(always)]
    pub unsafe fn over<S: Groups>(&self, field: usize) -> [Floats<S>; 2] {
        let rows = [self.above, self.below].map(|row| row.wrapping_add(field * self.plane));
        // SAFETY: as the caller's; the rows have so many.
        unsafe { [Floats::load(rows[0]), Floats::load(rows[1])] }
    }
}
