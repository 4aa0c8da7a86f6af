//! Eight lanes without any instruction set: what processors without a path of their own use.

use super::twice::Twice;
use super::{Along, GROUP, Groups, Simd, load_points_by_fours, store_points_by_lanes};

#[derive(Clone, Copy)]
pub(crate) struct Portable;

type F = [f32; GROUP];
type I = [i32; GROUP];
type D = [f64; GROUP];

#[inline(always)]
fn zip<A: Copy, B: Copy, C>(a: [A; GROUP], b: [B; GROUP], f: impl Fn(A, B) -> C) -> [C; GROUP] {
    // Written out, as `each!`.
    let f = |lane: usize| f(a[lane], b[lane]);
    [f(0), f(1), f(2), f(3), f(4), f(5), f(6), f(7)]
}

#[inline(always)]
fn select<T: Copy>(lanes: u32, yes: [T; GROUP], no: [T; GROUP]) -> [T; GROUP] {
    let mut selected = no;
    for lane in 0..GROUP {
        if lanes >> lane & 1 != 0 {
            selected[lane] = yes[lane];
        }
    }
    selected
}

#[inline(always)]
fn bitwise(a: F, b: F, f: impl Fn(u32, u32) -> u32) -> F {
    zip(a, b, |a: f32, b: f32| f32::from_bits(f(a.to_bits(), b.to_bits())))
}

#[inline(always)]
fn mask(a: F, b: F, f: impl Fn(f32, f32) -> bool) -> F {
    zip(a, b, |a, b| f32::from_bits(if f(a, b) { !0 } else { 0 }))
}

#[inline(always)]
fn prefix_sum<T: Copy>(mut a: [T; GROUP], add: impl Fn(T, T) -> T) -> [T; GROUP] {
    // In the order of the vector paths, so that sums of doubles round alike.
    for step in [1, 2, 4] {
        for l in (step..GROUP).rev() {
            let within = match step {
                4 => 3,
                _ if l / 4 == (l - step) / 4 => l - step,
                _ => continue,
            };
            a[l] = add(a[l], a[within]);
        }
    }
    a
}

/// # Safety
/// The places are valid for reads of four.
#[inline(always)]
unsafe fn load_fours<T: Copy>(place: impl Fn(usize) -> *const T) -> [T; GROUP] {
    // SAFETY: promised by the caller.
    std::array::from_fn(|lane| unsafe { place(lane / 4).add(lane % 4).read() })
}

#[inline(always)]
unsafe fn store_fours<T: Copy>(value: [T; GROUP], place: impl Fn(usize) -> *mut T) {
    let (fours, _) = value.as_chunks::<4>();
    for (half, four) in fours.iter().enumerate() {
        // SAFETY: promised by the caller.
        unsafe { place(half).cast::<[T; 4]>().write_unaligned(*four) };
    }
}

#[inline(always)]
fn transpose_fours<T: Copy>(rows: [[T; GROUP]; 4]) -> [[T; GROUP]; 4] {
    let mut columns = rows;
    for (i, column) in columns.iter_mut().enumerate() {
        for (l, lane) in column.iter_mut().enumerate() {
            *lane = rows[l % 4][l / 4 * 4 + i];
        }
    }
    columns
}

impl Simd for Portable {
    const LANES: usize = GROUP;
    type F = F;
    type I = I;
    type D = D;

    #[inline(always)]
    unsafe fn splat(value: f32) -> F {
        [value; GROUP]
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> F {
        // SAFETY: promised by the caller.
        unsafe { from.cast::<F>().read_unaligned() }
    }
    #[inline(always)]
    unsafe fn store(to: *mut f32, value: F) {
        // SAFETY: promised by the caller.
        unsafe { to.cast::<F>().write_unaligned(value) }
    }
    #[inline(always)]
    unsafe fn add(a: F, b: F) -> F {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    unsafe fn sub(a: F, b: F) -> F {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    unsafe fn mul(a: F, b: F) -> F {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    unsafe fn div(a: F, b: F) -> F {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    unsafe fn sqrt(a: F) -> F {
        zip(a, a, |a, _| a.sqrt())
    }
    #[inline(always)]
    unsafe fn min(a: F, b: F) -> F {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    unsafe fn max(a: F, b: F) -> F {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    unsafe fn lt(a: F, b: F) -> F {
        mask(a, b, |a, b| a < b)
    }
    #[inline(always)]
    unsafe fn le(a: F, b: F) -> F {
        mask(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    unsafe fn eq(a: F, b: F) -> F {
        mask(a, b, |a, b| a == b)
    }
    #[inline(always)]
    unsafe fn and(a: F, b: F) -> F {
        bitwise(a, b, |a, b| a & b)
    }
    #[inline(always)]
    unsafe fn or(a: F, b: F) -> F {
        bitwise(a, b, |a, b| a | b)
    }
    #[inline(always)]
    unsafe fn xor(a: F, b: F) -> F {
        bitwise(a, b, |a, b| a ^ b)
    }
    #[inline(always)]
    unsafe fn and_not(mask: F, a: F) -> F {
        bitwise(mask, a, |mask, a| !mask & a)
    }
    #[inline(always)]
    unsafe fn next_lane(a: F, before: F) -> F {
        std::array::from_fn(|l| if l == 0 { before[GROUP - 1] } else { a[l - 1] })
    }
    #[inline(always)]
    unsafe fn previous_lane(a: F, after: F) -> F {
        std::array::from_fn(|l| if l == GROUP - 1 { after[0] } else { a[l + 1] })
    }
    #[inline(always)]
    unsafe fn bits(mask: F) -> u32 {
        (0..GROUP).fold(0, |bits, l| bits | (mask[l].to_bits() >> 31) << l)
    }

    #[inline(always)]
    unsafe fn load_i(from: *const i32) -> I {
        // SAFETY: promised by the caller.
        unsafe { from.cast::<I>().read_unaligned() }
    }
    #[inline(always)]
    unsafe fn store_i(to: *mut i32, value: I) {
        // SAFETY: promised by the caller.
        unsafe { to.cast::<I>().write_unaligned(value) }
    }
    #[inline(always)]
    unsafe fn splat_i(value: i32) -> I {
        [value; GROUP]
    }
    #[inline(always)]
    unsafe fn add_i(a: I, b: I) -> I {
        zip(a, b, i32::wrapping_add)
    }
    #[inline(always)]
    unsafe fn sub_i(a: I, b: I) -> I {
        zip(a, b, i32::wrapping_sub)
    }
    #[inline(always)]
    unsafe fn select_bits_i(lanes: u32, yes: I, no: I) -> I {
        select(lanes, yes, no)
    }
    #[inline(always)]
    unsafe fn round_i(a: F) -> I {
        zip(a, a, |a, _| a.round_ties_even() as i32)
    }
    #[inline(always)]
    unsafe fn truncate_i(a: F) -> I {
        zip(a, a, |a, _| a as i32)
    }
    #[inline(always)]
    unsafe fn float_i(a: I) -> F {
        zip(a, a, |a, _| a as f32)
    }

    #[inline(always)]
    unsafe fn splat_d(value: f64) -> D {
        [value; GROUP]
    }
    #[inline(always)]
    unsafe fn load_d(from: *const f64) -> D {
        // SAFETY: promised by the caller.
        unsafe { from.cast::<D>().read_unaligned() }
    }
    #[inline(always)]
    unsafe fn store_d(to: *mut f64, value: D) {
        // SAFETY: promised by the caller.
        unsafe { to.cast::<D>().write_unaligned(value) }
    }
    #[inline(always)]
    unsafe fn add_d(a: D, b: D) -> D {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    unsafe fn sub_d(a: D, b: D) -> D {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    unsafe fn mul_d(a: D, b: D) -> D {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    unsafe fn div_d(a: D, b: D) -> D {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    unsafe fn sqrt_d(a: D) -> D {
        zip(a, a, |a, _| a.sqrt())
    }
    #[inline(always)]
    unsafe fn max_d(a: D, b: D) -> D {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    unsafe fn bits_lt_d(a: D, b: D) -> u32 {
        (0..GROUP).fold(0, |bits, l| bits | u32::from(a[l] < b[l]) << l)
    }
    #[inline(always)]
    unsafe fn select_bits_d(lanes: u32, yes: D, no: D) -> D {
        select(lanes, yes, no)
    }
    #[inline(always)]
    unsafe fn widen(a: F) -> D {
        zip(a, a, |a, _| f64::from(a))
    }
    #[inline(always)]
    unsafe fn narrow(a: D) -> F {
        zip(a, a, |a, _| a as f32)
    }
    #[inline(always)]
    unsafe fn load_points(first: *const f32, step: usize) -> [F; 3] {
        // SAFETY: as the caller's.
        unsafe { load_points_by_fours::<Self>(first, step) }
    }
    #[inline(always)]
    unsafe fn store_points(fields: [F; 4], place: usize, first: *mut f32, step: usize) {
        // SAFETY: as the caller's.
        unsafe { store_points_by_lanes::<Self>(fields, place, first, step) }
    }
}

impl Along for Portable {
    #[inline(always)]
    unsafe fn load_fours(place: impl Fn(usize) -> *const f32) -> F {
        // SAFETY: promised by the caller.
        unsafe { load_fours(place) }
    }
    #[inline(always)]
    unsafe fn store_fours(value: F, place: impl Fn(usize) -> *mut f32) {
        // SAFETY: promised by the caller.
        unsafe { store_fours(value, place) };
    }
    #[inline(always)]
    unsafe fn transpose_fours(rows: [F; 4]) -> [F; 4] {
        transpose_fours(rows)
    }
    #[inline(always)]
    unsafe fn prefix_sum_i(a: I) -> I {
        prefix_sum(a, i32::wrapping_add)
    }
    #[inline(always)]
    unsafe fn last_i(a: I) -> I {
        [a[GROUP - 1]; GROUP]
    }
    #[inline(always)]
    unsafe fn store_by_lanes(rows: [I; 8], to: *mut i32) {
        for lane in 0..GROUP {
            // SAFETY: promised by the caller.
            unsafe { to.add(8 * lane).cast::<I>().write_unaligned(rows.map(|row| row[lane])) };
        }
    }
}

impl Groups for Portable {
    type Pair = Twice<Self>;
    type Widest = Self;

    #[inline(always)]
    unsafe fn load_fours_d(place: impl Fn(usize) -> *const f64) -> D {
        // SAFETY: promised by the caller.
        unsafe { load_fours(place) }
    }
    #[inline(always)]
    unsafe fn store_fours_d(value: D, place: impl Fn(usize) -> *mut f64) {
        // SAFETY: promised by the caller.
        unsafe { store_fours(value, place) };
    }
    #[inline(always)]
    unsafe fn transpose_fours_d(rows: [D; 4]) -> [D; 4] {
        transpose_fours(rows)
    }
    #[inline(always)]
    unsafe fn join_halves_d(a: D, b: D) -> [D; 2] {
        let half = |first: usize| std::array::from_fn(|l| [a, b][l / 4][first + l % 4]);
        [half(0), half(4)]
    }
    #[inline(always)]
    unsafe fn load_pairs_d(place: impl Fn(usize) -> *const f64) -> D {
        // SAFETY: promised by the caller.
        std::array::from_fn(|l| unsafe { place(l / 2).add(l % 2).read() })
    }
    #[inline(always)]
    unsafe fn pair_d(a: D, b: D) -> [D; 2] {
        let half = |first: usize| std::array::from_fn(|l| [a, b][l % 2][first + l / 2]);
        [half(0), half(4)]
    }
    #[inline(always)]
    unsafe fn unpair_d(first: D, last: D) -> [D; 2] {
        let lanes = |of: usize| std::array::from_fn(|l| [first, last][l / 4][l % 4 * 2 + of]);
        [lanes(0), lanes(1)]
    }
    #[inline(always)]
    unsafe fn prefix_sum_d(a: D) -> D {
        prefix_sum(a, |a, b| a + b)
    }
    #[inline(always)]
    unsafe fn last_d(a: D) -> D {
        [a[GROUP - 1]; GROUP]
    }
}
