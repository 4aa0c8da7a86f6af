//! Steps 1 to 3, fast: depth changes and the forward chamfer pass in one sweep down the rows, the backward pass and
//! the sides of the windows in one sweep up. The plain forms are in `depth_change`, `distance`, `smoothing_area`.
//!
//! A depth change farther away than the largest window decides none. So windows are found slice by slice: the sweep down
//! goes on that far below the slice's rows, and the sweep up starts from there. What the sweeps read and write is still
//! in the cache when the slice's normals are made.

use std::ops::Range;

use super::arithmetic::Floats;
use super::buffer::Buffer;
use super::lanes::{LANES, LaneOrder, Lanes};
use crate::Error;
use crate::cloud::Points;
use crate::distance::{DIAGONAL, STRAIGHT, far};
use crate::memory::{bytes, resize};
use crate::options::Options;
use crate::simd::{Groups, Simd};
use crate::smoothing_area::{LARGEST, SMALLEST, depth_smoothing};

/// The windows of a slice of the image's rows, and what the sweep down keeps for the next slice.
#[derive(Debug, Default)]
pub(crate) struct Windows {
    sweep: Sweep,
    map: Buffer<Lanes>,
    /// The rows below the slice as they were swept down.
    held: Buffer<Lanes>,
    /// Of the image's rows that were swept.
    swept: Vec<Swept>,
    /// The image's row that the sweep down started with, that of the map's first row, and the next to sweep down.
    start: usize,
    first: usize,
    down: usize,
    /// The row after the slice; none before the first.
    after: Option<usize>,
}

/// What the sweeps found in a row, or in several.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Swept {
    /// The least and the largest finite depth; infinity and -infinity if there is none.
    depths: [f32; 2],
    /// The largest side of a window.
    pub side: f32,
}

impl Swept {
    const NOTHING: Self = Swept { depths: [f32::INFINITY, f32::NEG_INFINITY], side: 0.0 };

    fn and(self, other: Self) -> Self {
        let ([least, largest], [other_least, other_largest]) = (self.depths, other.depths);
        let depths = [least.min(other_least), largest.max(other_largest)];
        Swept { depths, side: self.side.max(other.side) }
    }

    /// That of some rows together.
    fn of(rows: &[Self]) -> Self {
        rows.iter().fold(Self::NOTHING, |all, row| all.and(*row))
    }

    /// The largest magnitude of a finite depth.
    pub fn deepest(&self) -> f32 {
        let [least, largest] = self.depths;
        largest.max(-least).max(0.0)
    }

    /// No finite depth's magnitude is smaller.
    pub fn nearest(&self) -> f32 {
        let [least, largest] = self.depths;
        least.max(-largest).max(0.0)
    }
}

/// How much farther than windows are expected to reach distances are exact. If windows reach farther, as 80 m more of depth
/// make them, the sweep down starts anew.
const EXACT_BEYOND: usize = 8;

/// How far a window, or a depth change that decides one, can be from its pixel, where no depth is above `deepest`.
pub(crate) fn reach(points: &Points, options: &Options, deepest: f32) -> usize {
    let smoothing = depth_smoothing(deepest, options);
    (smoothing as usize).saturating_add(2).min(points.width() + points.height())
}

impl Windows {
    /// Makes room for slices of so many rows, as far as depth adds nothing to what windows reach, before the first one.
    /// Costs least if they reach no farther than `expected`.
    pub fn start(
        &mut self,
        points: &Points,
        options: &Options,
        rows: usize,
        expected: usize,
    ) -> Result<(), Error> {
        let (length, height) = (row_length(points.width()), points.height());
        let reach = reach(points, options, 0.0);
        self.sweep.reserve(points.width())?;
        self.map.grow((rows + 2 * reach).min(height) * length)?;
        self.held.grow(reach.min(height) * length)?;
        resize(&mut self.swept, height, Swept::NOTHING)?;
        self.after = None;
        self.sweep.exact = expected + EXACT_BEYOND;
        Ok(())
    }

    /// Finds the sides of the windows of a slice. Costs least if it follows the one before.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn find<S: Groups>(
        &mut self,
        points: &Points,
        options: &Options,
        slice: Range<usize>,
    ) -> Result<(), Error> {
        let (length, height) = (row_length(points.width()), points.height());
        if self.after == Some(slice.start) {
            let held = (self.down - slice.start) * length;
            self.map[..held].copy_from_slice(&self.held[..held]);
            self.first = slice.start;
        } else {
            self.restart(slice.start.saturating_sub(reach(points, options, 0.0)));
        }
        let mut end = slice.end;
        loop {
            if self.down < end {
                self.map.grow((end - self.first) * length)?;
                let mut rows = WindowRows::new(points.width(), self.first, &mut self.map);
                let (down, swept) = (self.down..end, &mut self.swept);
                // SAFETY: as the caller's.
                unsafe { rows.sweep_down::<S>(points, options, down, &mut self.sweep, swept) };
                self.down = end;
            }
            let reach = reach(points, options, self.swept(slice.clone()).deepest());
            end = (slice.end + reach).min(height);
            let start = slice.start.saturating_sub(reach);
            if start < self.start || reach > self.sweep.exact {
                self.sweep.exact = self.sweep.exact.max(reach + EXACT_BEYOND);
                self.restart(start.min(self.start));
            } else if end <= self.down {
                break;
            }
        }
        let below = (slice.end - self.first) * length..(self.down - self.first) * length;
        self.held.grow(below.len())?;
        self.held[..below.len()].copy_from_slice(&self.map[below]);
        self.after = Some(slice.end);
        let mut rows = WindowRows::new(points.width(), self.first, &mut self.map);
        let (up, swept) = (slice.start..self.down, &mut self.swept);
        // SAFETY: as the caller's.
        unsafe { rows.sweep_up::<S>(points, options, up, slice.end, &mut self.sweep, swept) };
        Ok(())
    }

    /// Starts the sweep down anew with this row.
    fn restart(&mut self, row: usize) {
        (self.start, self.first, self.down) = (row, row, row);
    }

    /// What was found in these rows: depths in the slice's and those that its windows reach, windows in the slice's.
    pub fn swept(&self, rows: Range<usize>) -> Swept {
        Swept::of(&self.swept[rows])
    }

    /// The sides of the slice's windows.
    pub fn sides(&self, width: usize) -> Sides<'_> {
        Sides { rows: floats(&self.map), length: LANES * row_length(width), first: self.first }
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        self.sweep.size() + self.map.size() + self.held.size() + bytes(&self.swept)
    }
}

/// The sides of the windows of a slice's pixels, 0 for none.
#[derive(Clone, Copy)]
pub(crate) struct Sides<'a> {
    pub rows: &'a [f32],
    /// From a row to the next: the width rounded up to a multiple of 16, at least.
    pub length: usize,
    /// The image's row that is the first of these.
    pub first: usize,
}

impl<'a> Sides<'a> {
    /// Those of the image's row `y`, and more that means nothing.
    #[inline(always)]
    pub fn row(&self, y: usize) -> &'a [f32] {
        &self.rows[(y - self.first) * self.length..][..self.length]
    }
}

/// Rows of a map in lane order, each between two elements that hold the neighbouring segments' ends. After the
/// upward sweep the rows hold the sides of windows instead, pixel by pixel.
struct WindowRows<'a> {
    order: LaneOrder,
    /// The image's row that is the first of these.
    first: usize,
    rows: &'a mut [Lanes],
}

/// What the sweeps need beside the map.
#[derive(Debug, Default)]
struct Sweep {
    /// A ring of two rows of depths in lane order, each with an element more for the following segments' first pixels.
    z: Buffer<Lanes>,
    /// Masks: where the pixel's neighbours are tested, and where there is a depth change from the one above.
    tested: Buffer<Lanes>,
    above: Buffer<Lanes>,
    sides: Buffer<Lanes>,
    /// Distances below this are those of the plain form; others are not below it.
    exact: usize,
}

impl Sweep {
    /// Makes room for rows of so many pixels.
    fn reserve(&mut self, width: usize) -> Result<(), Error> {
        let length = LaneOrder::new(width).segment + 1;
        self.z.grow(2 * length)?;
        for row in [&mut self.tested, &mut self.above, &mut self.sides] {
            row.grow(length)?;
        }
        Ok(())
    }

    fn start(&mut self, order: LaneOrder) {
        self.above.fill(Lanes::ZERO);
        self.tested.fill(Lanes::ZERO);
        for x in 0..order.width - 1 {
            let (k, l) = order.place(x);
            self.tested[k].0[l] = f32::from_bits(!0);
        }
    }

    /// Where row `y` of the depths lies in `z`.
    fn z_place(order: LaneOrder, y: usize) -> Range<usize> {
        let length = order.segment + 1;
        let start = y % 2 * length;
        start..start + length
    }

    /// Reads a row's depths.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn read_z<S: Groups>(&mut self, points: &Points, order: LaneOrder, y: usize) {
        let place = Self::z_place(order, y);
        let z = &mut self.z[place];
        let (row, stride) = points.z_row(y);
        let whole = points.row(y, 0..order.width).whole();
        // SAFETY: as the caller's; row y is inside the cloud, so it has a depth at every x below the width, and as many of
        // its points are whole.
        unsafe {
            order.read::<S::Widest>(row, stride, whole, z);
            let first = z[0].load::<S::Pair>();
            let following = <S::Pair>::previous_lane(first, <S::Pair>::splat(0.0));
            z[order.segment].store::<S::Pair>(following);
        }
    }

    /// Bytes held.
    fn size(&self) -> usize {
        let Sweep { z, tested, above, sides, .. } = self;
        [z, tested, above, sides].map(Buffer::size).into_iter().sum()
    }
}

/// Elements of a row of the map.
fn row_length(width: usize) -> usize {
    LaneOrder::new(width).segment + 2
}

impl<'a> WindowRows<'a> {
    fn new(width: usize, first: usize, rows: &'a mut [Lanes]) -> Self {
        WindowRows { order: LaneOrder::new(width), first, rows }
    }

    /// The image's row `y`.
    #[inline(always)]
    fn row(&mut self, y: usize) -> &mut [Lanes] {
        let length = row_length(self.order.width);
        &mut self.rows[(y - self.first) * length..][..length]
    }

    /// Rows `y` and `y + 1`.
    #[inline(always)]
    fn two_rows(&mut self, y: usize) -> (&mut [Lanes], &mut [Lanes]) {
        let length = row_length(self.order.width);
        self.rows[(y - self.first) * length..][..2 * length].split_at_mut(length)
    }

    /// Depth changes and the forward pass over these of the image's rows, downwards; notes the depths in each. Those
    /// before, if there are some here, have been swept down by the same `sweep`.
    ///
    /// # Safety
    /// As [`Windows::find`].
    #[inline(always)]
    unsafe fn sweep_down<S: Groups>(
        &mut self,
        points: &Points,
        options: &Options,
        rows: Range<usize>,
        sweep: &mut Sweep,
        swept: &mut [Swept],
    ) {
        let order = self.order;
        let mut before = rows.start;
        if rows.start == self.first {
            sweep.start(order);
            // This row is only tested against the first.
            before = before.saturating_sub(1);
        }
        let factor = options.max_depth_change_factor;
        // Nothing is farther apart than a NaN tells, nor than infinity.
        let factor = if factor.is_nan() { f32::INFINITY } else { factor };
        let far = far(points.width(), points.height());
        // SAFETY: as the caller's.
        unsafe { sweep.read_z::<S>(points, order, before) };
        for y in before..rows.end {
            if y + 1 < points.height() {
                // SAFETY: as the caller's.
                unsafe { sweep.read_z::<S>(points, order, y + 1) };
            } else {
                // Of the last row no neighbours are tested; the row above was tested against it.
                sweep.tested.fill(Lanes::ZERO);
            }
            let row = &mut self.row(y.max(rows.start))[1..];
            // SAFETY: as the caller's.
            let depths = unsafe { sweep.start_row::<S::Pair>(points, order, y, factor, row) };
            swept[y] = Swept { depths, side: 0.0 };
            if y > self.first {
                let (above, row) = self.two_rows(y - 1);
                // SAFETY: as the caller's.
                unsafe { forward::<S::Pair>(order, above, row, sweep.exact as f32) };
            }
            // SAFETY: as the caller's.
            unsafe { close_ends::<S::Pair>(self.row(y.max(rows.start)), far) };
        }
    }

    /// The backward pass over these of the image's rows, upwards; then those before `end` hold the sides of their
    /// windows, the largest of which is noted of each row.
    ///
    /// # Safety
    /// As [`Windows::find`].
    #[inline(always)]
    unsafe fn sweep_up<S: Groups>(
        &mut self,
        points: &Points,
        options: &Options,
        rows: Range<usize>,
        end: usize,
        sweep: &mut Sweep,
        swept: &mut [Swept],
    ) {
        let order = self.order;
        let far = far(points.width(), points.height());
        let slice = Swept::of(&swept[rows.start..end]);
        let smoothing = one_smoothing(slice.depths, options);
        for y in rows.clone().rev() {
            if y > rows.start {
                let (row, below) = self.two_rows(y - 1);
                // SAFETY: as the caller's.
                unsafe {
                    backward::<S::Pair>(order, row, below, far, sweep.exact as f32);
                    close_ends::<S::Pair>(row, far);
                }
            }
            if y < end {
                let row = self.row(y);
                // SAFETY: as the caller's.
                swept[y].side = unsafe {
                    if smoothing.is_none() {
                        sweep.read_z::<S>(points, order, y);
                    }
                    sweep.sides::<S>(points, options, smoothing, y, order, row)
                };
            }
        }
    }
}

fn floats(row: &[Lanes]) -> &[f32] {
    // SAFETY: Lanes are arrays of floats without padding.
    unsafe { std::slice::from_raw_parts(row.as_ptr().cast(), row.len() * LANES) }
}

fn floats_mut(row: &mut [Lanes]) -> &mut [f32] {
    // SAFETY: Lanes are arrays of floats without padding, and any float is valid in them.
    unsafe { std::slice::from_raw_parts_mut(row.as_mut_ptr().cast(), row.len() * LANES) }
}

impl Sweep {
    /// Depth changes of row `y`, from its depths and those of the next row: distance 0 at depth changes, `far`
    /// elsewhere. Keeps the changes to the row below for the next row. Asks for the points that come next. Returns the
    /// least and the largest finite depth.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`, which has sixteen lanes.
    #[inline(always)]
    unsafe fn start_row<S: Simd>(
        &mut self,
        points: &Points,
        order: LaneOrder,
        y: usize,
        factor: f32,
        row: &mut [Lanes],
    ) -> [f32; 2] {
        let segment = order.segment;
        let (own, next) = (Self::z_place(order, y), Self::z_place(order, y + 1));
        let (z, below) = (&self.z[own], &self.z[next]);
        let (tested, above) = (&self.tested[..segment], &mut self.above[..segment]);
        let row = &mut row[..segment];
        // SAFETY: as the caller's.
        unsafe {
            let far = S::splat(far(points.width(), points.height()));
            let factor = S::splat(factor);
            let mut range = Swept::NOTHING.depths.map(|depth| S::splat(depth));
            let end = z[segment - 1].load::<S>();
            let end_right = z[segment].load::<S>();
            let bound = threshold::<S>(end, factor);
            let ends = change::<S>(end, end_right, bound, tested[segment - 1].load::<S>());
            let mut left = S::next_lane(ends, S::splat(0.0));
            let mut own = z[0].load::<S>();
            for k in 0..segment {
                points.prefetch_below(y, k * LANES, LANES);
                let right = z[k + 1].load::<S>();
                let (lower, upper) = (below[k].load::<S>(), above[k].load::<S>());
                let tested = tested[k].load::<S>();
                range = widened::<S>(range, own);
                let bound = threshold::<S>(own, factor);
                let to_right = change::<S>(own, right, bound, tested);
                let to_lower = change::<S>(own, lower, bound, tested);
                let change = S::or(S::or(to_right, left), S::or(to_lower, upper));
                row[k].store::<S>(S::and_not(change, far));
                above[k].store::<S>(to_lower);
                left = to_right;
                own = right;
            }
            let [least, largest] = range;
            [Floats::<S>(least).least(), Floats::<S>(largest).largest()]
        }
    }

    /// Replaces a row's distances by the sides of its windows, pixel by pixel; none is larger than what is returned.
    /// `smoothing` as [`one_smoothing`] says; if there is none, the row's depths have been read.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn sides<S: Groups>(
        &mut self,
        points: &Points,
        options: &Options,
        smoothing: Option<f32>,
        y: usize,
        order: LaneOrder,
        row: &mut [Lanes],
    ) -> f32 {
        let segment = order.segment;
        let z = &self.z[Self::z_place(order, y)];
        let (distances, sides) = (&row[1..=segment], &mut self.sides[..segment]);
        // SAFETY: as the caller's.
        let largest = unsafe {
            let mut so_far = S::Pair::splat(0.0);
            if let Some(smoothing) = smoothing {
                let smoothing = S::Pair::splat(smoothing);
                for k in 0..segment {
                    let side = side::<S::Pair>(distances[k].load::<S::Pair>(), smoothing);
                    so_far = S::Pair::max(side, so_far);
                    sides[k].store::<S::Pair>(side);
                }
            } else {
                let (size, ten) =
                    (S::Pair::splat(options.normal_smoothing_size), S::Pair::splat(10.0));
                for k in 0..segment {
                    points.prefetch(y.wrapping_sub(1), k * LANES, LANES);
                    let smoothing = S::Pair::add(size, S::Pair::div(z[k].load::<S::Pair>(), ten));
                    let side = side::<S::Pair>(distances[k].load::<S::Pair>(), smoothing);
                    so_far = S::Pair::max(side, so_far);
                    sides[k].store::<S::Pair>(side);
                }
            }
            Floats::<S::Pair>(so_far).largest()
        };
        let row = floats_mut(row);
        // SAFETY: as the caller's.
        unsafe { order.write::<S::Widest>(&self.sides, row) };
        // The one pixel whose own depth nobody tests.
        if y + 1 == points.height() && !points.z(order.width - 1, y).is_finite() {
            row[order.width - 1] = 0.0;
        }
        let border = options.ignored_border().min(order.width);
        if y < border || y + border >= points.height() {
            row[..order.width].fill(0.0);
        }
        row[..border].fill(0.0);
        row[order.width - border..order.width].fill(0.0);
        largest
    }
}

/// `smoothing_area::window_side`, with nothing ignored.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn side<S: Simd>(distance: S::F, smoothing: S::F) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let smallest = S::min(distance, smoothing);
        let whole = S::truncate(S::min(smallest, S::splat(LARGEST)));
        S::and(S::lt(S::splat(SMALLEST), smallest), whole)
    }
}

/// What every pixel may be smoothed as far as, if depths from the least to the largest make no difference: only the
/// whole part counts, and whether it is enough for a window.
fn one_smoothing([least, largest]: [f32; 2], options: &Options) -> Option<f32> {
    let [first, last] = [least, largest].map(|z| depth_smoothing(z, options));
    let alike = |a: f32, b: f32| a.trunc() == b.trunc() && (a > SMALLEST) == (b > SMALLEST);
    (least > largest || alike(first, last)).then_some(first)
}

/// The range of depths with another one, if it is not NaN.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn widened<S: Simd>([least, largest]: [S::F; 2], z: S::F) -> [S::F; 2] {
    // SAFETY: as the caller's. A NaN is neither smaller nor larger.
    unsafe { [S::min(z, least), S::max(z, largest)] }
}

/// `depth_change::threshold`
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(super) unsafe fn threshold<S: Simd>(z: S::F, factor: S::F) -> S::F {
    // SAFETY: as the caller's.
    unsafe { S::mul(S::mul(factor, S::add(S::abs(z), S::splat(1.0))), S::splat(2.0)) }
}

/// `depth_change::is_depth_change`, where it is `tested`; depths that are not finite are NaN.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn change<S: Simd>(z: S::F, neighbour: S::F, threshold: S::F, tested: S::F) -> S::F {
    // SAFETY: as the caller's.
    unsafe { S::and_not(S::le(S::abs(S::sub(z, neighbour)), threshold), tested) }
}

/// Fills a row's first and last element with the neighbouring segments' ends.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn close_ends<S: Simd>(row: &mut [Lanes], far: f32) {
    let last = row.len() - 1;
    // SAFETY: as the caller's.
    unsafe {
        let far = S::splat(far);
        let (begin, end) = (row[1].load::<S>(), row[last - 1].load::<S>());
        row[0].store::<S>(S::next_lane(end, far));
        row[last].store::<S>(S::previous_lane(begin, far));
    }
}

/// The least of what an element's three neighbours in the next row over give, and its own value.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn nearest<S: Simd>(own: &Lanes, over: &[Lanes; 3]) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let (straight, diagonal) = (S::splat(STRAIGHT), S::splat(DIAGONAL));
        let [a, b, c] = [over[0].load::<S>(), over[1].load::<S>(), over[2].load::<S>()];
        let diagonals = S::min(S::add(a, diagonal), S::add(c, diagonal));
        S::min(S::min(own.load::<S>(), S::add(b, straight)), diagonals)
    }
}

/// An element's neighbours in the next row over.
#[inline(always)]
fn three(over: &[Lanes], at: usize) -> &[Lanes; 3] {
    over[at - 1..at + 2].first_chunk().expect("three elements")
}

/// What the next row over and the step along the row give these elements, one after the other, from the value `before` the
/// first.
///
/// Two at a time, as each waits for the one before: two steps are one of twice the length, to the bit. Distances are 0 or at
/// least 1, where a step is rounded only if the sum has fewer bits behind the point: of two steps, once at most.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn along<S: Simd>(
    row: &mut [Lanes],
    over: &[Lanes],
    mut elements: impl Iterator<Item = usize>,
    mut before: S::F,
) {
    // SAFETY: as the caller's.
    unsafe {
        let (step, steps) = (S::splat(STRAIGHT), S::splat(2.0 * STRAIGHT));
        while let Some(at) = elements.next() {
            let first = nearest::<S>(&row[at], three(over, at));
            let value = S::min(first, S::add(before, step));
            row[at].store::<S>(value);
            let Some(at) = elements.next() else { return };
            let second = nearest::<S>(&row[at], three(over, at));
            before = S::min(S::min(second, S::add(first, step)), S::add(before, steps));
            row[at].store::<S>(before);
        }
    }
}

/// The forward pass over one row; `above` is done.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn forward<S: Simd>(order: LaneOrder, above: &[Lanes], row: &mut [Lanes], exact: f32) {
    let segment = order.segment;
    let (above, row) = (&above[..segment + 2], &mut row[..segment + 2]);
    let first = row[1].0[0];
    // SAFETY: as the caller's.
    unsafe {
        let start = nearest::<S>(&row[1], three(above, 1));
        row[1].store::<S>(start);
        row[1].0[0] = first; // column 0 stays
        let start = row[1].load::<S>();
        along::<S>(row, above, 2..=segment, start);
    }
    let ends = |row: &[Lanes]| {
        // SAFETY: as the caller's.
        unsafe { S::next_lane(row[segment].load::<S>(), S::splat(f32::INFINITY)) }
    };
    // SAFETY: as the caller's.
    unsafe { carry::<S>(row, 1..=segment, ends, exact) };
    // The last column's upper right neighbour is column 0 of this row.
    wrap(order, row, order.width - 1, 0);
}

/// The backward pass over one row; `below` is done.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn backward<S: Simd>(
    order: LaneOrder,
    row: &mut [Lanes],
    below: &[Lanes],
    far: f32,
    exact: f32,
) {
    let segment = order.segment;
    let (below, row) = (&below[..segment + 2], &mut row[..segment + 2]);
    let (last_element, last_lane) = order.place(order.width - 1);
    let last = row[last_element + 1].0[last_lane];
    // SAFETY: as the caller's.
    unsafe {
        along::<S>(row, below, (last_element + 1..=segment).rev(), S::splat(far));
        row[last_element + 1].0[last_lane] = last; // the last column stays
        let start = row[last_element + 1].load::<S>();
        along::<S>(row, below, (1..=last_element).rev(), start);
    }
    let ends = |row: &[Lanes]| {
        // SAFETY: as the caller's.
        unsafe {
            let infinity = S::splat(f32::INFINITY);
            let ends = S::previous_lane(row[1].load::<S>(), infinity);
            S::select(S::mask((1 << last_lane) - 1), ends, infinity)
        }
    };
    // SAFETY: as the caller's.
    unsafe { carry::<S>(row, (1..=segment).rev(), ends, exact) };
    // Column 0's lower left neighbour is the last column of this row.
    wrap(order, row, 0, order.width - 1);
}

/// Goes on with the step along the row from the ends of segments, each of which is in the lane of the next one, through
/// these, as far as it is nearer and below `exact`.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn carry<S: Simd>(
    row: &mut [Lanes],
    segment: impl Iterator<Item = usize> + Clone,
    ends: impl Fn(&[Lanes]) -> S::F,
    exact: f32,
) {
    // SAFETY: as the caller's.
    unsafe {
        let exact = S::splat(exact);
        loop {
            let mut value = ends(row);
            for at in segment.clone() {
                value = S::add(value, S::splat(STRAIGHT));
                let own = row[at].load::<S>();
                if S::bits(S::lt(value, S::min(own, exact))) == 0 {
                    return;
                }
                // Where it is no nearer here, it is not further along either: neighbours' distances differ by a step at most.
                row[at].store::<S>(S::min(value, own));
            }
            // Some segment's own end is nearer now.
        }
    }
}

/// The step around the row's end: pixel `x` may be reached diagonally from pixel `from`.
#[inline(always)]
fn wrap(order: LaneOrder, row: &mut [Lanes], x: usize, from: usize) {
    let ((k, l), (from_k, from_l)) = (order.place(x), order.place(from));
    row[k + 1].0[l] = row[k + 1].0[l].min(row[from_k + 1].0[from_l] + DIAGONAL);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::depth_change::depth_change_map;
    use crate::distance::distance_map;
    use crate::simd::portable::Portable;
    use crate::smoothing_area::window_side;

    /// Depths with steps and holes, three in so many `pixels`, and with extremes five, the same for the same seed.
    fn depths(
        (width, height): (usize, usize),
        pixels: u32,
        has_extremes: bool,
        seed: u32,
    ) -> Vec<f32> {
        let mut state = seed.wrapping_mul(2_654_435_761) | 1;
        let mut random = move || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state
        };
        (0..width * height)
            .map(|_| match random() % pixels {
                0 => f32::NAN,
                1 => 3.0,
                2 => f32::INFINITY,
                3 if has_extremes => f32::MAX,
                4 if has_extremes => f32::MIN,
                _ => 1.0,
            })
            .collect()
    }

    #[test]
    fn two_steps_along_the_row_are_one() {
        for bits in (1.0_f32.to_bits()..LARGEST.to_bits()).step_by(101) {
            let distance = f32::from_bits(bits);
            assert_eq!(distance + STRAIGHT + STRAIGHT, distance + 2.0 * STRAIGHT);
        }
    }

    #[test]
    fn the_sweeps_equal_the_plain_maps() {
        for width in (3..70).chain([640, 1024]) {
            let cases = [
                (3, 1, 97, 0.02),
                (4, 2, 97, 0.02),
                (23, 3, 97, 0.02),
                (50, 4, 97, 0.02),
                (40, 5, 2003, 0.02),
                // With extremes: thresholds that overflow, or are no numbers.
                (23, 7, 97, 0.6),
                (23, 9, 97, f32::INFINITY),
                (23, 11, 97, f32::NAN),
                (23, 13, 97, -1.0),
            ];
            for (height, seed, pixels, factor) in cases {
                let of_width = seed * 1000 + width as u32;
                let z = depths((width, height), pixels, seed > 5, of_width);
                let points = Points::planes([&z, &z, &z], width, height, 0).unwrap();
                let options = Options {
                    // With the fourth, depths decide.
                    normal_smoothing_size: if seed == 4 { 9.8 } else { 9.5 },
                    border_policy: crate::BorderPolicy::Mirror,
                    depth_dependent_smoothing: seed % 2 == 0,
                    max_depth_change_factor: factor,
                    ..Options::default()
                };
                let changes = depth_change_map(&points, options.max_depth_change_factor).unwrap();
                let distances = distance_map(&changes, width, height).unwrap();

                // Slices in their order, and one that another follows.
                let cuts = [0, height / 3, height / 2, height];
                let in_order = cuts.windows(2).map(|cut| cut[0]..cut[1]);
                let in_order = in_order.filter(|slice| !slice.is_empty());
                let slices = in_order.chain([height / 2..height, 0..height / 2]);
                let mut windows = Windows::default();
                let expected = if seed == 3 { 0 } else { 12 };
                windows.start(&points, &options, 1, expected).unwrap();
                for slice in slices {
                    // SAFETY: the portable path runs everywhere.
                    unsafe { windows.find::<Portable>(&points, &options, slice.clone()) }.unwrap();
                    let sides = windows.sides(width);
                    for y in slice {
                        let mut largest = 0;
                        for x in 0..width {
                            let expected =
                                window_side(distances[y * width + x], points.z(x, y), &options);
                            let what = format!("{width}x{height} {x},{y}");
                            assert_eq!(sides.row(y)[x], expected as f32, "{what}");
                            largest = largest.max(expected);
                        }
                        assert!(largest as f32 <= windows.swept(y..y + 1).side);
                    }
                }
            }
        }
    }
}
