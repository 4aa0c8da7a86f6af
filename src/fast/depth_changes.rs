//! Step 1, fast: depth changes, row by row in lane order. The plain form is in `depth_change`.

use std::ops::Range;

use super::arithmetic::Floats;
use super::buffer::Buffer;
use super::lanes::{LANES, LaneOrder, Lanes};
use crate::Error;
use crate::cloud::Points;
use crate::distance::far;
use crate::simd::{Groups, Simd};

/// The rows of depths that changes are between, from row to row.
#[derive(Debug, Default)]
pub(super) struct DepthRows {
    /// A ring of two rows of depths in lane order, each with an element more for the following segments' first pixels.
    z: Buffer<Lanes>,
    /// Masks: where the pixel's neighbours are tested, and where there is a depth change from the one above.
    tested: Buffer<Lanes>,
    above: Buffer<Lanes>,
}

impl DepthRows {
    /// Makes room for rows of so many pixels.
    pub fn reserve(&mut self, width: usize) -> Result<(), Error> {
        let length = LaneOrder::new(width).segment + 1;
        self.z.grow(2 * length)?;
        self.tested.grow(length)?;
        self.above.grow(length)
    }

    /// Starts with a row that none is above.
    pub fn start(&mut self, width: usize) {
        let order = LaneOrder::new(width);
        self.above.fill(Lanes::ZERO);
        self.tested.fill(Lanes::ZERO);
        for x in 0..width - 1 {
            let (k, l) = order.place(x);
            self.tested[k].0[l] = f32::from_bits(!0);
        }
    }

    /// Tests no neighbours from now on.
    pub fn stop(&mut self) {
        self.tested.fill(Lanes::ZERO);
    }

    /// Where row `y` of the depths lies in `z`.
    fn place(order: LaneOrder, y: usize) -> Range<usize> {
        let length = order.segment + 1;
        let start = y % 2 * length;
        start..start + length
    }

    /// The depths of row `y`, which is one of the two read last.
    pub fn row(&self, order: LaneOrder, y: usize) -> &[Lanes] {
        &self.z[Self::place(order, y)]
    }

    /// Reads a row's depths.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn read<S: Groups>(&mut self, points: &Points, y: usize) {
        let order = LaneOrder::new(points.width());
        let z = &mut self.z[Self::place(order, y)];
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

    /// Depth changes of row `y`, from its depths and those of the next row: distance 0 at depth changes, `far`
    /// elsewhere. Keeps the changes to the row below for the next row. Asks for the points that come next. Returns the
    /// least and the largest finite depth.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`, which has sixteen lanes.
    #[inline(always)]
    pub unsafe fn find_changes<S: Simd>(
        &mut self,
        points: &Points,
        y: usize,
        factor: f32,
        row: &mut [Lanes],
    ) -> [f32; 2] {
        let order = LaneOrder::new(points.width());
        let segment = order.segment;
        let (own, next) = (Self::place(order, y), Self::place(order, y + 1));
        let (z, below) = (&self.z[own], &self.z[next]);
        let (tested, above) = (&self.tested[..segment], &mut self.above[..segment]);
        let row = &mut row[..segment];
        // SAFETY: as the caller's.
        unsafe {
            let far = S::splat(far(points.width(), points.height()));
            let factor = S::splat(factor);
            let mut range = [S::splat(f32::INFINITY), S::splat(f32::NEG_INFINITY)];
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

    /// Bytes held.
    pub fn size(&self) -> usize {
        let DepthRows { z, tested, above } = self;
        [z, tested, above].map(Buffer::size).into_iter().sum()
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

/// `depth_change::is_depth_change`, where it is `tested`; depths that are not finite are NaN.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn change<S: Simd>(z: S::F, neighbour: S::F, threshold: S::F, tested: S::F) -> S::F {
    // SAFETY: as the caller's.
    unsafe { S::and_not(S::le(S::abs(S::sub(z, neighbour)), threshold), tested) }
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
