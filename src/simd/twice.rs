//! Sixteen pixels as two groups of eight: twice as many operations that do not wait for one another.

use super::{GROUP, Simd};

/// Two groups of `S`. Masks of lanes have 16 bits, the first group's in the lower half.
#[derive(Clone, Copy)]
pub(crate) struct Twice<S>(std::marker::PhantomData<S>);

macro_rules! both {
    ($($name:ident($($operand:ident: $type:ident),*) -> $result:ident;)*) => {
        $(#[inline(always)]
        unsafe fn $name($($operand: Self::$type),*) -> Self::$result {
            // SAFETY: as the caller's.
            unsafe { [S::$name($($operand[0]),*), S::$name($($operand[1]),*)] }
        })*
    };
}

impl<S: Simd> Simd for Twice<S> {
    const LANES: usize = 2 * S::LANES;
    type F = [S::F; 2];
    type I = [S::I; 2];
    type D = [S::D; 2];

    both! {
        add(a: F, b: F) -> F;
        sub(a: F, b: F) -> F;
        mul(a: F, b: F) -> F;
        div(a: F, b: F) -> F;
        mul_add(a: F, b: F, c: F) -> F;
        neg_mul_add(a: F, b: F, c: F) -> F;
        sqrt(a: F) -> F;
        min(a: F, b: F) -> F;
        max(a: F, b: F) -> F;
        lt(a: F, b: F) -> F;
        le(a: F, b: F) -> F;
        eq(a: F, b: F) -> F;
        and(a: F, b: F) -> F;
        or(a: F, b: F) -> F;
        xor(a: F, b: F) -> F;
        and_not(mask: F, a: F) -> F;
        select(mask: F, yes: F, no: F) -> F;
        add_i(a: I, b: I) -> I;
        sub_i(a: I, b: I) -> I;
        round_i(a: F) -> I;
        truncate_i(a: F) -> I;
        float_i(a: I) -> F;
        add_d(a: D, b: D) -> D;
        sub_d(a: D, b: D) -> D;
        mul_d(a: D, b: D) -> D;
        div_d(a: D, b: D) -> D;
        mul_add_d(a: D, b: D, c: D) -> D;
        neg_mul_add_d(a: D, b: D, c: D) -> D;
        sqrt_d(a: D) -> D;
        max_d(a: D, b: D) -> D;
        widen(a: F) -> D;
        narrow(a: D) -> F;
    }

    memory! {
        f32, F, [0 1] of GROUP, splat = S::splat, load = S::load, store = S::store;
        i32, I, [0 1] of GROUP, splat_i = S::splat_i, load_i = S::load_i, store_i = S::store_i;
        f64, D, [0 1] of GROUP, splat_d = S::splat_d, load_d = S::load_d, store_d = S::store_d;
    }

    #[inline(always)]
    unsafe fn load_points(first: *const f32, step: usize) -> [Self::F; 3] {
        // SAFETY: as the caller's.
        unsafe {
            let [x0, y0, z0] = S::load_points(first, step);
            let [x1, y1, z1] = S::load_points(first.byte_add(S::LANES * step), step);
            [[x0, x1], [y0, y1], [z0, z1]]
        }
    }
    #[inline(always)]
    unsafe fn store_points(fields: [Self::F; 4], place: usize, first: *mut f32, step: usize) {
        // SAFETY: as the caller's.
        unsafe {
            let [[x0, x1], [y0, y1], [z0, z1], [fourth0, fourth1]] = fields;
            S::store_points([x0, y0, z0, fourth0], place, first, step);
            let second = first.byte_add(S::LANES * step);
            S::store_points([x1, y1, z1, fourth1], place, second, step);
        }
    }
    #[inline(always)]
    unsafe fn mask(bits: u32) -> Self::F {
        // SAFETY: as the caller's.
        unsafe { [S::mask(bits), S::mask(bits >> GROUP)] }
    }
    #[inline(always)]
    unsafe fn next_lane(a: Self::F, before: Self::F) -> Self::F {
        // SAFETY: as the caller's.
        unsafe { [S::next_lane(a[0], before[1]), S::next_lane(a[1], a[0])] }
    }
    #[inline(always)]
    unsafe fn previous_lane(a: Self::F, after: Self::F) -> Self::F {
        // SAFETY: as the caller's.
        unsafe { [S::previous_lane(a[0], a[1]), S::previous_lane(a[1], after[0])] }
    }
    #[inline(always)]
    unsafe fn bits(mask: Self::F) -> u32 {
        // SAFETY: as the caller's.
        unsafe { S::bits(mask[0]) | S::bits(mask[1]) << GROUP }
    }
    #[inline(always)]
    unsafe fn bits_lt_d(a: Self::D, b: Self::D) -> u32 {
        // SAFETY: as the caller's.
        unsafe { S::bits_lt_d(a[0], b[0]) | S::bits_lt_d(a[1], b[1]) << GROUP }
    }
    #[inline(always)]
    unsafe fn select_bits_i(lanes: u32, yes: Self::I, no: Self::I) -> Self::I {
        let upper = lanes >> GROUP;
        // SAFETY: as the caller's.
        unsafe { [S::select_bits_i(lanes, yes[0], no[0]), S::select_bits_i(upper, yes[1], no[1])] }
    }
    #[inline(always)]
    unsafe fn select_bits_d(lanes: u32, yes: Self::D, no: Self::D) -> Self::D {
        let upper = lanes >> GROUP;
        // SAFETY: as the caller's.
        unsafe { [S::select_bits_d(lanes, yes[0], no[0]), S::select_bits_d(upper, yes[1], no[1])] }
    }
}
