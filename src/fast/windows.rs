//! Steps 1 to 3, fast: depth changes and the forward chamfer pass in one sweep down the rows, the backward pass and
//! the sides of the windows in one sweep up. The plain forms are in `depth_change`, `distance`, `smoothing_area`.

use std::ops::Range;

use super::buffer::Buffer;
use super::lanes::{LANES, LaneOrder, Lanes};
use crate::Error;
use crate::cloud::Points;
use crate::distance::{DIAGONAL, STRAIGHT, far};
use crate::options::Options;
use crate::simd::Simd;
use crate::smoothing_area::{LARGEST, SMALLEST, depth_smoothing};

/// Rows of a map in lane order, each between two elements that hold the neighbouring segments' ends. After the
/// upward sweep the rows hold the sides of windows instead, pixel by pixel.
pub(crate) struct WindowRows<'a> {
    order: LaneOrder,
    rows: &'a mut [Lanes],
}

/// What the sweeps need beside the map.
#[derive(Debug, Default)]
pub(crate) struct Sweep {
    /// A ring of two rows of depths in lane order, each with an element more for the following segments' first pixels.
    z: Buffer<Lanes>,
    /// Masks: where the pixel has a right neighbour, and where there is a depth change from the one above.
    tested: Buffer<Lanes>,
    above: Buffer<Lanes>,
    sides: Buffer<Lanes>,
}

impl Sweep {
    /// Makes room for rows of so many pixels.
    pub fn reserve(&mut self, width: usize) -> Result<(), Error> {
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
    #[inline(always)]
    fn read_z(&mut self, points: &Points, order: LaneOrder, y: usize) {
        let place = Self::z_place(order, y);
        let z = &mut self.z[place];
        let (row, stride) = points.z_row(y);
        // SAFETY: row y is inside the cloud, so it has a depth at every x below the width.
        unsafe { order.read(row, stride, z) };
        z[order.segment] = z[0].previous_lane(0.0);
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        let Sweep { z, tested, above, sides, .. } = self;
        [z, tested, above, sides].map(Buffer::size).into_iter().sum()
    }
}

/// Elements of a row of the map.
pub(crate) fn row_length(width: usize) -> usize {
    LaneOrder::new(width).segment + 2
}

impl<'a> WindowRows<'a> {
    /// `rows` holds `row_length` elements for each of the rows that will be swept.
    pub fn new(width: usize, rows: &'a mut [Lanes]) -> Self {
        WindowRows { order: LaneOrder::new(width), rows }
    }

    #[inline(always)]
    fn row(&mut self, index: usize) -> &mut [Lanes] {
        let length = self.order.segment + 2;
        &mut self.rows[index * length..(index + 1) * length]
    }

    /// Rows `index` and `index + 1`.
    #[inline(always)]
    fn two_rows(&mut self, index: usize) -> (&mut [Lanes], &mut [Lanes]) {
        let length = self.order.segment + 2;
        self.rows[index * length..(index + 2) * length].split_at_mut(length)
    }

    /// Depth changes and the forward pass over the image's rows `first..first + count`, downwards. Returns the least
    /// and the largest finite depth in them, infinity and -infinity if there is none. There is room for the rows.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`, which has sixteen lanes.
    #[inline(always)]
    pub unsafe fn sweep_down<S: Simd>(
        &mut self,
        points: &Points,
        options: &Options,
        (first, count): (usize, usize),
        sweep: &mut Sweep,
    ) -> [f32; 2] {
        let order = self.order;
        let before = first.saturating_sub(1);
        sweep.start(order);
        let factor = options.max_depth_change_factor;
        let far = far(points.width(), points.height());
        sweep.read_z(points, order, before);
        let mut depths = [Lanes([f32::INFINITY; LANES]), Lanes([f32::NEG_INFINITY; LANES])];
        for y in before..first + count {
            let last = y + 1 == points.height();
            if !last {
                sweep.read_z(points, order, y + 1);
            }
            // The row before the first is only tested against the first.
            let index = (y + 1).saturating_sub(first + 1);
            let row = &mut self.row(index)[1..];
            // SAFETY: as the caller's.
            unsafe {
                if last {
                    sweep.start_last_row::<S>(order, y, far, row, &mut depths);
                } else {
                    sweep.start_row::<S>(points, order, y, factor, row, &mut depths);
                }
                if y > first {
                    let (above, row) = self.two_rows(index - 1);
                    forward::<S>(order, above, row);
                }
            }
            close_ends(self.row(index), far);
        }
        let [least, largest] = depths;
        [
            least.0.into_iter().fold(f32::INFINITY, f32::min),
            largest.0.into_iter().fold(f32::NEG_INFINITY, f32::max),
        ]
    }

    /// The backward pass upwards over the swept rows, `first` being the image's row of the first; then the rows
    /// hold the sides of their windows, none of which is larger than what is returned. `depths` are the least and the
    /// largest finite depth.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`, which has sixteen lanes.
    #[inline(always)]
    pub unsafe fn sweep_up<S: Simd>(
        &mut self,
        points: &Points,
        options: &Options,
        (first, count): (usize, usize),
        depths: [f32; 2],
        sweep: &mut Sweep,
    ) -> f32 {
        let order = self.order;
        let far = far(points.width(), points.height());
        let smoothing = one_smoothing(depths, options);
        let mut largest = Lanes::ZERO;
        for index in (0..count).rev() {
            if index + 1 < count {
                let (row, below) = self.two_rows(index);
                // SAFETY: as the caller's.
                unsafe { backward::<S>(order, row, below, far) };
                close_ends(row, far);
                let y = first + index + 1;
                // SAFETY: as the caller's.
                unsafe {
                    sweep.sides::<S>(points, options, smoothing, y, order, below, &mut largest)
                };
            }
        }
        let row = self.row(0);
        // SAFETY: as the caller's.
        unsafe { sweep.sides::<S>(points, options, smoothing, first, order, row, &mut largest) };
        largest.0.into_iter().fold(0.0, f32::max)
    }
}

/// The sides of the windows of a row, after [`WindowRows::sweep_up`], and more that means nothing: the width rounded
/// up to a multiple of 16, at least.
pub(crate) fn sides(rows: &[Lanes], width: usize, index: usize) -> &[f32] {
    let length = row_length(width);
    floats(&rows[index * length..(index + 1) * length])
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
    /// elsewhere. Keeps the changes to the row below for the next row, and the least and largest finite depths. Asks
    /// for the points two rows below.
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
        depths: &mut [Lanes; 2],
    ) {
        let segment = order.segment;
        let (own, next) = (Self::z_place(order, y), Self::z_place(order, y + 1));
        let (z, below) = (&self.z[own], &self.z[next]);
        let (tested, above) = (&self.tested[..segment], &mut self.above[..segment]);
        let row = &mut row[..segment];
        // SAFETY: as the caller's.
        unsafe {
            let far = S::splat(far(points.width(), points.height()));
            let factor = S::splat(factor);
            let mut range = depths.map(|depth| depth.load::<S>());
            let end = z[segment - 1].load::<S>();
            let end_right = z[segment].load::<S>();
            let bound = threshold::<S>(end, factor);
            let change = is_change::<S>(end, S::finite(end), end_right, bound);
            let mut ends = Lanes::ZERO;
            ends.store::<S>(S::and(change, tested[segment - 1].load::<S>()));
            let mut left = ends.next_lane(0.0).load::<S>();
            let mut own = z[0].load::<S>();
            for k in 0..segment {
                points.prefetch(y + 2, k * LANES, LANES);
                let right = z[k + 1].load::<S>();
                let (lower, upper) = (below[k].load::<S>(), above[k].load::<S>());
                let tested = tested[k].load::<S>();
                let finite = S::finite(own);
                range = widened::<S>(range, own, finite);
                let bound = threshold::<S>(own, factor);
                let to_right = S::and(is_change::<S>(own, finite, right, bound), tested);
                let to_lower = S::and(is_change::<S>(own, finite, lower, bound), tested);
                let change = S::or(S::or(to_right, left), S::or(to_lower, upper));
                row[k].store::<S>(S::and_not(change, far));
                above[k].store::<S>(to_lower);
                left = to_right;
                own = right;
            }
            depths[0].store::<S>(range[0]);
            depths[1].store::<S>(range[1]);
        }
    }

    /// The image's last row: only the row above was tested against it.
    ///
    /// # Safety
    /// As [`Sweep::start_row`].
    #[inline(always)]
    unsafe fn start_last_row<S: Simd>(
        &self,
        order: LaneOrder,
        y: usize,
        far: f32,
        row: &mut [Lanes],
        depths: &mut [Lanes; 2],
    ) {
        let z = &self.z[Self::z_place(order, y)];
        // SAFETY: as the caller's.
        unsafe {
            let mut range = depths.map(|depth| depth.load::<S>());
            for k in 0..order.segment {
                let (above, own) = (self.above[k].load::<S>(), z[k].load::<S>());
                row[k].store::<S>(S::and_not(above, S::splat(far)));
                range = widened::<S>(range, own, S::finite(own));
            }
            depths[0].store::<S>(range[0]);
            depths[1].store::<S>(range[1]);
        }
    }

    /// Replaces a row's distances by the sides of its windows, pixel by pixel, and keeps the `largest`. `smoothing` as
    /// [`one_smoothing`] says.
    ///
    /// # Safety
    /// As [`Sweep::start_row`].
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    unsafe fn sides<S: Simd>(
        &mut self,
        points: &Points,
        options: &Options,
        smoothing: Option<f32>,
        y: usize,
        order: LaneOrder,
        row: &mut [Lanes],
        largest: &mut Lanes,
    ) {
        let segment = order.segment;
        if smoothing.is_none() {
            self.read_z(points, order, y);
        }
        let z = &self.z[Self::z_place(order, y)];
        let (distances, sides) = (&row[1..=segment], &mut self.sides[..segment]);
        // SAFETY: as the caller's; the sides fit i32.
        unsafe {
            let side = |distance, smoothing| {
                let smallest = S::min(distance, smoothing);
                let whole = S::truncate(S::min(smallest, S::splat(LARGEST)));
                S::and(S::lt(S::splat(SMALLEST), smallest), whole)
            };
            let mut so_far = largest.load::<S>();
            if let Some(smoothing) = smoothing {
                let smoothing = S::splat(smoothing);
                for k in 0..segment {
                    let side = side(distances[k].load::<S>(), smoothing);
                    so_far = S::max(side, so_far);
                    sides[k].store::<S>(side);
                }
            } else {
                let (size, ten) = (S::splat(options.normal_smoothing_size), S::splat(10.0));
                for k in 0..segment {
                    points.prefetch(y.wrapping_sub(1), k * LANES, LANES);
                    let smoothing = S::add(size, S::div(z[k].load::<S>(), ten));
                    let side = side(distances[k].load::<S>(), smoothing);
                    so_far = S::max(side, so_far);
                    sides[k].store::<S>(side);
                }
            }
            largest.store::<S>(so_far);
        }
        let row = floats_mut(row);
        order.write(&self.sides, row);
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
    }
}

/// What every pixel may be smoothed as far as, if depths from the least to the largest make no difference: only the
/// whole part counts, and whether it is enough for a window.
fn one_smoothing([least, largest]: [f32; 2], options: &Options) -> Option<f32> {
    let [first, last] = [least, largest].map(|z| depth_smoothing(z, options));
    let alike = |a: f32, b: f32| a.trunc() == b.trunc() && (a > SMALLEST) == (b > SMALLEST);
    (least > largest || alike(first, last)).then_some(first)
}

/// The range of depths with another one, if it is finite.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn widened<S: Simd>([least, largest]: [S::F; 2], z: S::F, finite: S::F) -> [S::F; 2] {
    // SAFETY: as the caller's.
    unsafe {
        // A NaN is neither smaller nor larger.
        let z = S::or(S::and_not(finite, S::splat(f32::NAN)), z);
        [S::min(z, least), S::max(z, largest)]
    }
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

/// `depth_change::is_depth_change`, where `finite` says whether `z` is.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn is_change<S: Simd>(z: S::F, finite: S::F, neighbour: S::F, threshold: S::F) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let apart = S::lt(threshold, S::abs(S::sub(z, neighbour)));
        let finite = S::and(finite, S::finite(neighbour));
        S::or(apart, S::and_not(finite, S::splat(f32::from_bits(!0))))
    }
}

/// Fills a row's first and last element with the neighbouring segments' ends.
#[inline(always)]
fn close_ends(row: &mut [Lanes], far: f32) {
    let last = row.len() - 1;
    let (begin, end) = (row[1], row[last - 1]);
    row[0] = end.next_lane(far);
    row[last] = begin.previous_lane(far);
}

/// The least of what an element's three neighbours in the next row over give, and its own value.
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

/// The step along the row.
#[inline(always)]
unsafe fn along<S: Simd>(nearest: S::F, before: S::F) -> S::F {
    // SAFETY: as the caller's.
    unsafe { S::min(nearest, S::add(before, S::splat(STRAIGHT))) }
}

/// The forward pass over one row; `above` is done.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn forward<S: Simd>(order: LaneOrder, above: &[Lanes], row: &mut [Lanes]) {
    let segment = order.segment;
    let (above, row) = (&above[..segment + 2], &mut row[..segment + 2]);
    let first = row[1].0[0];
    // SAFETY: as the caller's.
    unsafe {
        let start = nearest::<S>(&row[1], three(above, 1));
        row[1].store::<S>(start);
        row[1].0[0] = first; // column 0 stays
        let mut left = row[1].load::<S>();
        for at in 2..=segment {
            left = along::<S>(nearest::<S>(&row[at], three(above, at)), left);
            row[at].store::<S>(left);
        }
    }
    // SAFETY: as the caller's.
    unsafe { carry::<S>(row, 1..=segment, |row| row[segment].next_lane(f32::INFINITY)) };
    // The last column's upper right neighbour is column 0 of this row.
    wrap(order, row, order.width - 1, 0);
}

/// The backward pass over one row; `below` is done.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn backward<S: Simd>(order: LaneOrder, row: &mut [Lanes], below: &[Lanes], far: f32) {
    let segment = order.segment;
    let (below, row) = (&below[..segment + 2], &mut row[..segment + 2]);
    let (last_element, last_lane) = order.place(order.width - 1);
    let last = row[last_element + 1].0[last_lane];
    // SAFETY: as the caller's.
    unsafe {
        let mut right = S::splat(far);
        for at in (last_element + 1..=segment).rev() {
            right = along::<S>(nearest::<S>(&row[at], three(below, at)), right);
            row[at].store::<S>(right);
        }
        row[last_element + 1].0[last_lane] = last; // the last column stays
        right = row[last_element + 1].load::<S>();
        for at in (1..=last_element).rev() {
            right = along::<S>(nearest::<S>(&row[at], three(below, at)), right);
            row[at].store::<S>(right);
        }
    }
    let ends = |row: &[Lanes]| {
        let mut ends = row[1].previous_lane(f32::INFINITY);
        ends.0[last_lane..].fill(f32::INFINITY);
        ends
    };
    // SAFETY: as the caller's.
    unsafe { carry::<S>(row, (1..=segment).rev(), ends) };
    // Column 0's lower left neighbour is the last column of this row.
    wrap(order, row, 0, order.width - 1);
}

/// Goes on with the step along the row from the ends of segments, each of which is in the lane of the next one, through
/// these, as far as it is nearer.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn carry<S: Simd>(
    row: &mut [Lanes],
    segment: impl Iterator<Item = usize> + Clone,
    ends: impl Fn(&[Lanes]) -> Lanes,
) {
    // SAFETY: as the caller's.
    unsafe {
        loop {
            let mut value = ends(row).load::<S>();
            for at in segment.clone() {
                value = S::add(value, S::splat(STRAIGHT));
                let own = row[at].load::<S>();
                if S::bits(S::lt(value, own)) == 0 {
                    return;
                }
                // Where it is no nearer, it is not farther along either: neighbours are at most a step apart.
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
    use crate::simd::{portable::Portable, twice::Twice};
    use crate::smoothing_area::window_side;

    type S = Twice<Portable>;

    /// Depths with steps and holes, the same for the same seed.
    fn depths(width: usize, height: usize, seed: u32) -> Vec<f32> {
        let mut state = seed.wrapping_mul(2_654_435_761) | 1;
        let mut random = move || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state
        };
        (0..width * height)
            .map(|_| match random() % 97 {
                0 => f32::NAN,
                1 => 3.0,
                2 => f32::INFINITY,
                _ => 1.0,
            })
            .collect()
    }

    #[test]
    fn the_sweeps_equal_the_plain_maps() {
        for width in (3..70).chain([640, 1024]) {
            for (height, seed) in [(3, 1), (4, 2), (23, 3), (50, 4)] {
                let z = depths(width, height, seed * 1000 + width as u32);
                let points = Points::planes([&z, &z, &z], width, height, 0).unwrap();
                let options = Options {
                    // With the last, depths decide.
                    normal_smoothing_size: if seed == 4 { 9.8 } else { 9.5 },
                    border_policy: crate::BorderPolicy::Mirror,
                    depth_dependent_smoothing: seed % 2 == 0,
                    ..Options::default()
                };
                let changes = depth_change_map(&points, options.max_depth_change_factor).unwrap();
                let distances = distance_map(&changes, width, height).unwrap();

                let mut rows = vec![Lanes::ZERO; row_length(width) * height];
                let mut windows = WindowRows::new(width, &mut rows);
                let mut sweep = Sweep::default();
                sweep.reserve(width).unwrap();
                let swept = (0, height);
                // SAFETY: the portable path runs everywhere.
                let largest = unsafe {
                    let depths = windows.sweep_down::<S>(&points, &options, swept, &mut sweep);
                    windows.sweep_up::<S>(&points, &options, swept, depths, &mut sweep)
                };
                for y in 0..height {
                    for x in 0..width {
                        let expected =
                            window_side(distances[y * width + x], points.z(x, y), &options);
                        assert_eq!(
                            sides(&rows, width, y)[x],
                            expected as f32,
                            "{width}x{height} {x},{y}"
                        );
                        assert!(expected as f32 <= largest);
                    }
                }
            }
        }
    }
}
