//! Step 2, fast: PCL's chamfer passes, row by row in lane order. The plain form is in `distance`.
//!
//! A row has two elements more, which hold the neighbouring segments' ends.

use super::lanes::{LaneOrder, Lanes};
use crate::distance::{DIAGONAL, STRAIGHT};
use crate::simd::Simd;

/// Fills a row's first and last element with the neighbouring segments' ends.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(super) unsafe fn close_ends<S: Simd>(row: &mut [Lanes], far: f32) {
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
pub(super) unsafe fn forward<S: Simd>(
    order: LaneOrder,
    above: &[Lanes],
    row: &mut [Lanes],
    exact: f32,
) {
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
pub(super) unsafe fn backward<S: Simd>(
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
    use crate::smoothing_area::LARGEST;

    #[test]
    fn two_steps_along_the_row_are_one() {
        for bits in (1.0_f32.to_bits()..LARGEST.to_bits()).step_by(101) {
            let distance = f32::from_bits(bits);
            assert_eq!(distance + STRAIGHT + STRAIGHT, distance + 2.0 * STRAIGHT);
        }
    }
}
