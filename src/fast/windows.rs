//! Steps 1 to 3, fast: depth changes and the forward chamfer pass in one sweep down the rows, the backward pass and
//! the sides of the windows in one sweep up. The plain forms are in `depth_change`, `distance`, `smoothing_area`.

use super::lanes::{LANES, LaneOrder, Lanes};
use crate::cloud::Points;
use crate::distance::{DIAGONAL, STRAIGHT, far};
use crate::options::Options;
use crate::simd::Simd;
use crate::smoothing_area::{LARGEST, SMALLEST};

/// Rows of a map in lane order, each between two elements that hold the neighbouring segments' ends. After the
/// upward sweep the rows hold the sides of windows instead, pixel by pixel.
pub(crate) struct WindowRows<'a> {
    order: LaneOrder,
    rows: &'a mut [Lanes],
}

/// What the sweeps need beside the map: a few rows.
#[derive(Debug, Default)]
pub(crate) struct Sweep {
    z: Vec<Lanes>,
    z_below: Vec<Lanes>,
    /// Masks: where the pixel has a right neighbour, and where there is a depth change to the right neighbour, to
    /// the one below, and from the one above.
    tested: Vec<Lanes>,
    right: Vec<Lanes>,
    below: Vec<Lanes>,
    above: Vec<Lanes>,
    sides: Vec<Lanes>,
}

impl Sweep {
    fn resize(&mut self, order: LaneOrder) {
        let segment = order.segment;
        let Sweep { z, z_below, tested, right, below, above, sides } = self;
        for rows in [z, z_below, tested, right, below, above, sides] {
            rows.clear();
            rows.resize(segment + 1, Lanes::ZERO);
        }
        for x in 0..order.width - 1 {
            let (k, l) = order.place(x);
            self.tested[k].0[l] = f32::from_bits(!0);
        }
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        let Sweep { z, z_below, tested, right, below, above, sides } = self;
        let rows = [z, z_below, tested, right, below, above, sides];
        rows.iter().map(|row| row.capacity() * size_of::<Lanes>()).sum()
    }
}

/// Elements of a row of the map.
pub(crate) fn row_length(width: usize) -> usize {
    LaneOrder::new(width).segment + 2
}

/// Reads a row's depths in lane order; the last element holds the following segments' first pixels.
#[inline(always)]
fn read_z(points: &Points, order: LaneOrder, y: usize, z: &mut [Lanes]) {
    let (row, stride) = points.z_row(y);
    // SAFETY: row y is inside the cloud, so it has a depth at every x below the width.
    unsafe { order.read(row, stride, z) };
    let first = z[0];
    z[order.segment] =
        Lanes(std::array::from_fn(|l| if l + 1 < LANES { first.0[l + 1] } else { 0.0 }));
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

    /// Depth changes and the forward pass over the image's rows `first..first + count`, downwards. Returns the largest
    /// magnitude of a finite depth in them.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn sweep_down<S: Simd>(
        &mut self,
        points: &Points,
        options: &Options,
        (first, count): (usize, usize),
        sweep: &mut Sweep,
    ) -> f32 {
        let order = self.order;
        sweep.resize(order);
        let mut largest = 0.0_f32;
        let far = far(points.width(), points.height());
        if first > 0 {
            read_z(points, order, first - 1, &mut sweep.z);
            read_z(points, order, first, &mut sweep.z_below);
            // SAFETY: as the caller's.
            unsafe { sweep.test_below::<S>(options.max_depth_change_factor) };
            std::mem::swap(&mut sweep.below, &mut sweep.above);
            std::mem::swap(&mut sweep.z, &mut sweep.z_below);
        } else {
            read_z(points, order, 0, &mut sweep.z);
        }
        for index in 0..count {
            let y = first + index;
            if y + 1 < points.height() {
                read_z(points, order, y + 1, &mut sweep.z_below);
                // SAFETY: as the caller's.
                unsafe { sweep.test_below::<S>(options.max_depth_change_factor) };
                // SAFETY: as the caller's.
                unsafe { sweep.test_right::<S>(options.max_depth_change_factor) };
            } else {
                sweep.below.fill(Lanes::ZERO);
                sweep.right.fill(Lanes::ZERO);
            }
            // SAFETY: as the caller's.
            largest = largest.max(unsafe { sweep.largest_z::<S>() });
            // SAFETY: as the caller's.
            unsafe { sweep.start_distances::<S>(far, &mut self.row(index)[1..]) };
            if index > 0 {
                let (above, row) = self.two_rows(index - 1);
                // SAFETY: as the caller's.
                unsafe { forward::<S>(order, above, row) };
            }
            close_ends(self.row(index), far);
            std::mem::swap(&mut sweep.below, &mut sweep.above);
            std::mem::swap(&mut sweep.z, &mut sweep.z_below);
        }
        largest
    }

    /// The backward pass upwards over the swept rows, `first` being the image's row of the first; then the rows
    /// hold the sides of their windows.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn sweep_up<S: Simd>(
        &mut self,
        points: &Points,
        options: &Options,
        (first, count): (usize, usize),
        sweep: &mut Sweep,
    ) {
        let order = self.order;
        let far = far(points.width(), points.height());
        for index in (0..count).rev() {
            if index + 1 < count {
                let (row, below) = self.two_rows(index);
                // SAFETY: as the caller's.
                unsafe { backward::<S>(order, row, below, far) };
                close_ends(row, far);
                // SAFETY: as the caller's.
                unsafe { sweep.sides::<S>(points, options, first + index + 1, order, below) };
            }
        }
        // SAFETY: as the caller's.
        unsafe { sweep.sides::<S>(points, options, first, order, self.row(0)) };
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

/// Where `z` and its `neighbour` are a depth change apart: `depth_change::is_depth_change`.
#[inline(always)]
unsafe fn test<S: Simd>(z: S::F, neighbour: S::F, factor: f32) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let slope = S::mul(S::splat(factor), S::add(S::abs(z), S::splat(1.0)));
        let threshold = S::mul(slope, S::splat(2.0));
        let apart = S::lt(threshold, S::abs(S::sub(z, neighbour)));
        let finite = S::and(S::finite(z), S::finite(neighbour));
        S::or(apart, S::and_not(finite, S::splat(f32::from_bits(!0))))
    }
}

impl Sweep {
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn test_below<S: Simd>(&mut self, factor: f32) {
        let length = self.below.len();
        let (z, z_below) = (&self.z[..length], &self.z_below[..length]);
        let (tested, below) = (&self.tested[..length], &mut self.below[..length]);
        for k in 0..length {
            // SAFETY: as the caller's.
            unsafe {
                let (z, z_below) = (z[k].load::<S>(), z_below[k].load::<S>());
                let tested = tested[k].load::<S>();
                below[k].store::<S>([
                    S::and(test::<S>(z[0], z_below[0], factor), tested[0]),
                    S::and(test::<S>(z[1], z_below[1], factor), tested[1]),
                ]);
            }
        }
    }

    /// # Safety
    /// As [`Sweep::test_below`].
    #[inline(always)]
    unsafe fn test_right<S: Simd>(&mut self, factor: f32) {
        let length = self.right.len();
        let (z, tested, right) =
            (&self.z[..length], &self.tested[..length], &mut self.right[..length]);
        for k in 0..length - 1 {
            // SAFETY: as the caller's.
            unsafe {
                let (z, z_right) = (z[k].load::<S>(), z[k + 1].load::<S>());
                let tested = tested[k].load::<S>();
                right[k].store::<S>([
                    S::and(test::<S>(z[0], z_right[0], factor), tested[0]),
                    S::and(test::<S>(z[1], z_right[1], factor), tested[1]),
                ]);
            }
        }
    }

    /// The largest magnitude of a finite depth in the row.
    ///
    /// # Safety
    /// As [`Sweep::test_below`].
    #[inline(always)]
    unsafe fn largest_z<S: Simd>(&self) -> f32 {
        let mut lanes = Lanes::ZERO;
        // SAFETY: as the caller's.
        unsafe {
            let mut largest = lanes.load::<S>();
            for z in &self.z {
                let z = z.load::<S>();
                for g in 0..2 {
                    largest[g] = S::max(S::and(S::finite(z[g]), S::abs(z[g])), largest[g]);
                }
            }
            lanes.store::<S>(largest);
        }
        lanes.0.into_iter().fold(0.0, f32::max)
    }

    /// Distance 0 at depth changes, `far` elsewhere.
    ///
    /// # Safety
    /// As [`Sweep::test_below`].
    #[inline(always)]
    unsafe fn start_distances<S: Simd>(&self, far: f32, row: &mut [Lanes]) {
        let segment = self.right.len() - 1;
        let (right, below, above) =
            (&self.right[..segment], &self.below[..segment], &self.above[..segment]);
        let row = &mut row[..segment];
        // SAFETY: as the caller's.
        unsafe {
            let far = S::splat(far);
            let mut left = right[segment - 1].next_lane(0.0).load::<S>();
            for k in 0..segment {
                let (own, below, above) =
                    (right[k].load::<S>(), below[k].load::<S>(), above[k].load::<S>());
                let change = |g: usize| S::or(S::or(own[g], left[g]), S::or(below[g], above[g]));
                row[k].store::<S>([S::and_not(change(0), far), S::and_not(change(1), far)]);
                left = own;
            }
        }
    }

    /// Replaces a row's distances by the sides of its windows, pixel by pixel.
    ///
    /// # Safety
    /// As [`Sweep::test_below`].
    #[inline(always)]
    unsafe fn sides<S: Simd>(
        &mut self,
        points: &Points,
        options: &Options,
        y: usize,
        order: LaneOrder,
        row: &mut [Lanes],
    ) {
        let segment = order.segment;
        if options.depth_dependent_smoothing {
            read_z(points, order, y, &mut self.z);
        }
        let (distances, z, sides) =
            (&row[1..=segment], &self.z[..segment], &mut self.sides[..segment]);
        // SAFETY: as the caller's; the sides fit i32.
        unsafe {
            let size = S::splat(options.normal_smoothing_size);
            let ten = S::splat(10.0);
            let side = |distance, smoothing| {
                let smallest = S::min(distance, smoothing);
                let whole = S::truncate(S::min(smallest, S::splat(LARGEST)));
                S::and(S::lt(S::splat(SMALLEST), smallest), whole)
            };
            for k in 0..segment {
                let distances = distances[k].load::<S>();
                let z = z[k].load::<S>();
                let smoothing = |g: usize| {
                    if options.depth_dependent_smoothing {
                        S::add(size, S::div(z[g], ten))
                    } else {
                        size
                    }
                };
                sides[k].store::<S>([
                    side(distances[0], smoothing(0)),
                    side(distances[1], smoothing(1)),
                ]);
            }
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
unsafe fn nearest<S: Simd>(own: &Lanes, over: &[Lanes; 3]) -> [S::F; 2] {
    // SAFETY: as the caller's.
    unsafe {
        let (straight, diagonal) = (S::splat(STRAIGHT), S::splat(DIAGONAL));
        let own = own.load::<S>();
        let [a, b, c] = [over[0].load::<S>(), over[1].load::<S>(), over[2].load::<S>()];
        let least = |g: usize| {
            let diagonals = S::min(S::add(a[g], diagonal), S::add(c[g], diagonal));
            S::min(S::min(own[g], S::add(b[g], straight)), diagonals)
        };
        [least(0), least(1)]
    }
}

/// An element's neighbours in the next row over.
#[inline(always)]
fn three(over: &[Lanes], at: usize) -> &[Lanes; 3] {
    over[at - 1..at + 2].first_chunk().expect("three elements")
}

/// The step along the row.
#[inline(always)]
unsafe fn along<S: Simd>(nearest: [S::F; 2], before: [S::F; 2]) -> [S::F; 2] {
    // SAFETY: as the caller's.
    unsafe {
        let straight = S::splat(STRAIGHT);
        [
            S::min(nearest[0], S::add(before[0], straight)),
            S::min(nearest[1], S::add(before[1], straight)),
        ]
    }
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
    for lane in 1..LANES {
        carry(row[segment].0[lane - 1], row[1..=segment].iter_mut(), lane);
    }
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
        let mut right = [S::splat(far); 2];
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
    for lane in (0..last_lane).rev() {
        carry(row[1].0[lane + 1], row[1..=segment].iter_mut().rev(), lane);
    }
    // Column 0's lower left neighbour is the last column of this row.
    wrap(order, row, 0, order.width - 1);
}

/// Goes on with the step along the row from the end of one segment through the next, as far as it is nearer.
#[inline(always)]
fn carry<'a>(end: f32, segment: impl Iterator<Item = &'a mut Lanes>, lane: usize) {
    let mut value = end + STRAIGHT;
    for element in segment {
        if value >= element.0[lane] {
            break;
        }
        element.0[lane] = value;
        value += STRAIGHT;
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
                    normal_smoothing_size: 9.5,
                    border_policy: crate::BorderPolicy::Mirror,
                    depth_dependent_smoothing: seed % 2 == 0,
                    ..Options::default()
                };
                let changes = depth_change_map(&points, options.max_depth_change_factor);
                let distances = distance_map(&changes, width, height);

                let mut rows = vec![Lanes::ZERO; row_length(width) * height];
                let mut windows = WindowRows::new(width, &mut rows);
                let mut sweep = Sweep::default();
                // SAFETY: the portable path runs everywhere.
                unsafe {
                    windows.sweep_down::<Portable>(&points, &options, (0, height), &mut sweep);
                    windows.sweep_up::<Portable>(&points, &options, (0, height), &mut sweep);
                }
                for y in 0..height {
                    for x in 0..width {
                        let expected =
                            window_side(distances[y * width + x], points.z(x, y), &options);
                        assert_eq!(
                            sides(&rows, width, y)[x],
                            expected as f32,
                            "{width}x{height} {x},{y}"
                        );
                    }
                }
            }
        }
    }
}
