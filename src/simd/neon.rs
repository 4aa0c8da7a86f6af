//! Eight lanes on 64-bit Arm: two registers of floats or integers, four of doubles.

// Every block calls intrinsics of the instruction set that the trait's contract promises.
#![allow(clippy::undocumented_unsafe_blocks)]

use std::arch::aarch64::*;

use super::twice::Twice;
use super::{Along, GROUP, Groups, Simd, load_points_by_fours, store_points_by_lanes};

/// What every 64-bit Arm has.
#[derive(Clone, Copy)]
pub(crate) struct Neon;

/// `each!` for the bits of floats.
macro_rules! bitwise {
    ($op:path, $a:expr, $b:expr) => {{
        let a = each!(2 vreinterpretq_u32_f32, $a);
        let b = each!(2 vreinterpretq_u32_f32, $b);
        each!(2 vreinterpretq_f32_u32, each!(2 $op, a, b))
    }};
}

/// Intrinsics that take the sum first, as methods that take it last.
macro_rules! sum_last {
    ($($name:ident($type:ty) = $op:path;)*) => {
        $(#[inline(always)]
        unsafe fn $name(a: $type, b: $type, c: $type) -> $type {
            unsafe { $op(c, a, b) }
        })*
    };
}

sum_last! {
    mul_add_32(float32x4_t) = vfmaq_f32;
    neg_mul_add_32(float32x4_t) = vfmsq_f32;
    mul_add_64(float64x2_t) = vfmaq_f64;
    neg_mul_add_64(float64x2_t) = vfmsq_f64;
}

/// The masks of lanes 0 to 3 and of lanes 4 to 7.
#[inline(always)]
unsafe fn lane_masks(lanes: u32) -> [uint32x4_t; 2] {
    unsafe { each!(2 vreinterpretq_u32_f32, Neon::mask(lanes)) }
}

impl Simd for Neon {
    const LANES: usize = GROUP;
    type F = [float32x4_t; 2];
    type I = [int32x4_t; 2];
    type D = [float64x2_t; 4];

    calls! {
        load_points(first: *const f32, step: usize) -> [Self::F; 3] = load_points_by_fours::<Self>;
        store_points(fields: [Self::F; 4], place: usize, first: *mut f32, step: usize) = store_points_by_lanes::<Self>;
    }

    memory! {
        f32, F, [0 1] of 4, splat = vdupq_n_f32, load = vld1q_f32, store = vst1q_f32;
        i32, I, [0 1] of 4, splat_i = vdupq_n_s32, load_i = vld1q_s32, store_i = vst1q_s32;
        f64, D, [0 1 2 3] of 2, splat_d = vdupq_n_f64, load_d = vld1q_f64, store_d = vst1q_f64;
    }

    calls! { of 2:
        add(a: Self::F, b: Self::F) -> Self::F = vaddq_f32;
        sub(a: Self::F, b: Self::F) -> Self::F = vsubq_f32;
        mul(a: Self::F, b: Self::F) -> Self::F = vmulq_f32;
        div(a: Self::F, b: Self::F) -> Self::F = vdivq_f32;
        mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F = mul_add_32;
        neg_mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F = neg_mul_add_32;
        sqrt(a: Self::F) -> Self::F = vsqrtq_f32;
        add_i(a: Self::I, b: Self::I) -> Self::I = vaddq_s32;
        sub_i(a: Self::I, b: Self::I) -> Self::I = vsubq_s32;
        round_i(a: Self::F) -> Self::I = vcvtnq_s32_f32;
        truncate_i(a: Self::F) -> Self::I = vcvtq_s32_f32;
        float_i(a: Self::I) -> Self::F = vcvtq_f32_s32;
    }

    calls! { of 4:
        add_d(a: Self::D, b: Self::D) -> Self::D = vaddq_f64;
        sub_d(a: Self::D, b: Self::D) -> Self::D = vsubq_f64;
        mul_d(a: Self::D, b: Self::D) -> Self::D = vmulq_f64;
        div_d(a: Self::D, b: Self::D) -> Self::D = vdivq_f64;
        mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D = mul_add_64;
        neg_mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D = neg_mul_add_64;
        sqrt_d(a: Self::D) -> Self::D = vsqrtq_f64;
    }

    #[inline(always)]
    unsafe fn min(a: Self::F, b: Self::F) -> Self::F {
        // Unlike Arm's own, `b` where one is NaN; so the other two.
        unsafe { each!(2 vbslq_f32, each!(2 vcltq_f32, a, b), a, b) }
    }
    #[inline(always)]
    unsafe fn max(a: Self::F, b: Self::F) -> Self::F {
        unsafe { each!(2 vbslq_f32, each!(2 vcgtq_f32, a, b), a, b) }
    }
    #[inline(always)]
    unsafe fn lt(a: Self::F, b: Self::F) -> Self::F {
        unsafe { each!(2 vreinterpretq_f32_u32, each!(2 vcltq_f32, a, b)) }
    }
    #[inline(always)]
    unsafe fn le(a: Self::F, b: Self::F) -> Self::F {
        unsafe { each!(2 vreinterpretq_f32_u32, each!(2 vcleq_f32, a, b)) }
    }
    #[inline(always)]
    unsafe fn eq(a: Self::F, b: Self::F) -> Self::F {
        unsafe { each!(2 vreinterpretq_f32_u32, each!(2 vceqq_f32, a, b)) }
    }
    #[inline(always)]
    unsafe fn and(a: Self::F, b: Self::F) -> Self::F {
        unsafe { bitwise!(vandq_u32, a, b) }
    }
    #[inline(always)]
    unsafe fn or(a: Self::F, b: Self::F) -> Self::F {
        unsafe { bitwise!(vorrq_u32, a, b) }
    }
    #[inline(always)]
    unsafe fn xor(a: Self::F, b: Self::F) -> Self::F {
        unsafe { bitwise!(veorq_u32, a, b) }
    }
    #[inline(always)]
    unsafe fn and_not(mask: Self::F, a: Self::F) -> Self::F {
        unsafe { bitwise!(vbicq_u32, a, mask) }
    }
    #[inline(always)]
    unsafe fn next_lane(a: Self::F, before: Self::F) -> Self::F {
        unsafe { [vextq_f32::<3>(before[1], a[0]), vextq_f32::<3>(a[0], a[1])] }
    }
    #[inline(always)]
    unsafe fn previous_lane(a: Self::F, after: Self::F) -> Self::F {
        unsafe { [vextq_f32::<1>(a[0], a[1]), vextq_f32::<1>(a[1], after[0])] }
    }
    #[inline(always)]
    unsafe fn bits(mask: Self::F) -> u32 {
        const PLACES: [[u32; 4]; 2] = [[1, 2, 4, 8], [16, 32, 64, 128]];
        unsafe {
            // The highest bit of a lane decides, as on other instruction sets.
            let [low, high] = each!(2 vreinterpretq_u32_f32, mask);
            let spread =
                |lanes| vreinterpretq_u32_s32(vshrq_n_s32::<31>(vreinterpretq_s32_u32(lanes)));
            let low = vandq_u32(spread(low), vld1q_u32(PLACES[0].as_ptr()));
            let high = vandq_u32(spread(high), vld1q_u32(PLACES[1].as_ptr()));
            vaddvq_u32(vorrq_u32(low, high))
        }
    }

    #[inline(always)]
    unsafe fn select_bits_i(lanes: u32, yes: Self::I, no: Self::I) -> Self::I {
        unsafe { each!(2 vbslq_s32, lane_masks(lanes), yes, no) }
    }

    #[inline(always)]
    unsafe fn max_d(a: Self::D, b: Self::D) -> Self::D {
        unsafe { each!(4 vbslq_f64, each!(4 vcgtq_f64, a, b), a, b) }
    }
    #[inline(always)]
    unsafe fn bits_lt_d(a: Self::D, b: Self::D) -> u32 {
        unsafe {
            let mask = |i: usize| vcltq_f64(a[i], b[i]);
            let narrow = |i: usize| {
                vreinterpretq_f32_u32(vcombine_u32(vmovn_u64(mask(i)), vmovn_u64(mask(i + 1))))
            };
            Self::bits([narrow(0), narrow(2)])
        }
    }
    #[inline(always)]
    unsafe fn select_bits_d(lanes: u32, yes: Self::D, no: Self::D) -> Self::D {
        unsafe {
            let [low, high] = lane_masks(lanes);
            let mask = [
                vreinterpretq_u64_u32(vzip1q_u32(low, low)),
                vreinterpretq_u64_u32(vzip2q_u32(low, low)),
                vreinterpretq_u64_u32(vzip1q_u32(high, high)),
                vreinterpretq_u64_u32(vzip2q_u32(high, high)),
            ];
            each!(4 vbslq_f64, mask, yes, no)
        }
    }
    #[inline(always)]
    unsafe fn widen(a: Self::F) -> Self::D {
        unsafe {
            [
                vcvt_f64_f32(vget_low_f32(a[0])),
                vcvt_high_f64_f32(a[0]),
                vcvt_f64_f32(vget_low_f32(a[1])),
                vcvt_high_f64_f32(a[1]),
            ]
        }
    }
    #[inline(always)]
    unsafe fn narrow(a: Self::D) -> Self::F {
        unsafe {
            [
                vcvt_high_f32_f64(vcvt_f32_f64(a[0]), a[1]),
                vcvt_high_f32_f64(vcvt_f32_f64(a[2]), a[3]),
            ]
        }
    }
}

impl Along for Neon {
    #[inline(always)]
    unsafe fn load_fours(place: impl Fn(usize) -> *const f32) -> Self::F {
        unsafe { [vld1q_f32(place(0)), vld1q_f32(place(1))] }
    }
    #[inline(always)]
    unsafe fn store_fours(value: Self::F, place: impl Fn(usize) -> *mut f32) {
        for (half, four) in value.into_iter().enumerate() {
            unsafe { vst1q_f32(place(half), four) };
        }
    }
    #[inline(always)]
    unsafe fn transpose_fours(rows: [Self::F; 4]) -> [Self::F; 4] {
        let [a, b, c, d] = rows;
        let mut columns = rows;
        for half in 0..2 {
            unsafe {
                let even = |a: float32x4_t, b: float32x4_t| vreinterpretq_f64_f32(vtrn1q_f32(a, b));
                let odd = |a: float32x4_t, b: float32x4_t| vreinterpretq_f64_f32(vtrn2q_f32(a, b));
                let (ab_even, cd_even) = (even(a[half], b[half]), even(c[half], d[half]));
                let (ab_odd, cd_odd) = (odd(a[half], b[half]), odd(c[half], d[half]));
                columns[0][half] = vreinterpretq_f32_f64(vtrn1q_f64(ab_even, cd_even));
                columns[1][half] = vreinterpretq_f32_f64(vtrn1q_f64(ab_odd, cd_odd));
                columns[2][half] = vreinterpretq_f32_f64(vtrn2q_f64(ab_even, cd_even));
                columns[3][half] = vreinterpretq_f32_f64(vtrn2q_f64(ab_odd, cd_odd));
            }
        }
        columns
    }
    #[inline(always)]
    unsafe fn prefix_sum_i(a: Self::I) -> Self::I {
        #[inline(always)]
        unsafe fn half(a: int32x4_t) -> int32x4_t {
            unsafe {
                let zero = vdupq_n_s32(0);
                let a = vaddq_s32(a, vextq_s32::<3>(zero, a));
                vaddq_s32(a, vextq_s32::<2>(zero, a))
            }
        }
        unsafe {
            let (low, high) = (half(a[0]), half(a[1]));
            [low, vaddq_s32(high, vdupq_laneq_s32::<3>(low))]
        }
    }
    #[inline(always)]
    unsafe fn last_i(a: Self::I) -> Self::I {
        unsafe { [vdupq_laneq_s32::<3>(a[1]); 2] }
    }
    #[inline(always)]
    unsafe fn store_by_lanes(rows: [Self::I; 8], to: *mut i32) {
        unsafe {
            let [a, b, c, d, e, f, g, h] =
                rows.map(|row| [vreinterpretq_f32_s32(row[0]), vreinterpretq_f32_s32(row[1])]);
            let fours = [Self::transpose_fours([a, b, c, d]), Self::transpose_fours([e, f, g, h])];
            for half in 0..2 {
                for four in 0..2 {
                    for lane in 0..4 {
                        let to = to.add(8 * (4 * half + lane) + 4 * four);
                        vst1q_s32(to, vreinterpretq_s32_f32(fours[four][lane][half]));
                    }
                }
            }
        }
    }
}

impl Groups for Neon {
    type Pair = Twice<Self>;
    type Widest = Self;

    doubles_by_twos! { vld1q_f64, vst1q_f64, vtrn1q_f64, vtrn2q_f64 }

    #[inline(always)]
    unsafe fn prefix_sum_d(a: Self::D) -> Self::D {
        /// Four lanes: each gets the one before, then the one two before.
        #[inline(always)]
        unsafe fn half(low: float64x2_t, high: float64x2_t) -> [float64x2_t; 2] {
            unsafe {
                let low_1 = vaddq_f64(low, vextq_f64::<1>(vdupq_n_f64(0.0), low));
                let high_1 = vaddq_f64(high, vextq_f64::<1>(low, high));
                [low_1, vaddq_f64(high_1, low_1)]
            }
        }
        unsafe {
            let ([low, low_last], [high, high_last]) = (half(a[0], a[1]), half(a[2], a[3]));
            let total = vdupq_laneq_f64::<1>(low_last);
            [low, low_last, vaddq_f64(high, total), vaddq_f64(high_last, total)]
        }
    }
    #[inline(always)]
    unsafe fn last_d(a: Self::D) -> Self::D {
        unsafe { [vdupq_laneq_f64::<1>(a[3]); 4] }
    }
}
