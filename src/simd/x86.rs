//! Eight lanes on x86-64: two SSE2 registers, or one of AVX2.

// Every block calls intrinsics of the instruction set that the trait's contract promises.
#![allow(clippy::undocumented_unsafe_blocks)]

use std::arch::x86_64::*;

use super::twice::Twice;
use super::{Along, GROUP, Groups, Simd, load_points_by_fours};

/// What every x86-64 has.
#[derive(Clone, Copy)]
pub(crate) struct Sse2;

/// AVX2 and FMA, on processors that have them.
#[derive(Clone, Copy)]
pub(crate) struct Avx2;

#[inline(always)]
unsafe fn load_integers(from: *const i32) -> __m128i {
    unsafe { _mm_loadu_si128(from.cast()) }
}

#[inline(always)]
unsafe fn store_integers(to: *mut i32, value: __m128i) {
    unsafe { _mm_storeu_si128(to.cast(), value) };
}

/// Stores the first two lanes.
#[inline(always)]
unsafe fn store_two(to: *mut f32, lanes: __m128) {
    unsafe { _mm_storel_epi64(to.cast(), _mm_castps_si128(lanes)) };
}

/// Stores four lanes, `step` bytes apart.
#[inline(always)]
unsafe fn store_apart(to: *mut f32, step: usize, lanes: __m128) {
    unsafe {
        _mm_store_ss(to, lanes);
        _mm_store_ss(to.byte_add(step), _mm_shuffle_ps::<0b01>(lanes, lanes));
        _mm_store_ss(to.byte_add(2 * step), _mm_shuffle_ps::<0b10>(lanes, lanes));
        _mm_store_ss(to.byte_add(3 * step), _mm_shuffle_ps::<0b11>(lanes, lanes));
    }
}

/// Four lanes of [`Simd::store_points`].
#[inline(always)]
unsafe fn store_four_points(
    [x, y, z, fourth]: [__m128; 4],
    place: usize,
    first: *mut f32,
    step: usize,
) {
    unsafe {
        let (low, high) = (_mm_unpacklo_ps(x, y), _mm_unpackhi_ps(x, y));
        store_two(first, low);
        store_two(first.byte_add(step), _mm_movehl_ps(low, low));
        store_two(first.byte_add(2 * step), high);
        store_two(first.byte_add(3 * step), _mm_movehl_ps(high, high));
        store_apart(first.add(2), step, z);
        if place > 0 {
            store_apart(first.add(place), step, fourth);
        }
    }
}

impl Simd for Sse2 {
    const LANES: usize = GROUP;
    type F = [__m128; 2];
    type I = [__m128i; 2];
    type D = [__m128d; 4];

    calls! {
        load_points(first: *const f32, step: usize) -> [Self::F; 3] = load_points_by_fours::<Self>;
    }

    memory! {
        f32, F, [0 1] of 4, splat = _mm_set1_ps, load = _mm_loadu_ps, store = _mm_storeu_ps;
        i32, I, [0 1] of 4, splat_i = _mm_set1_epi32, load_i = load_integers, store_i = store_integers;
        f64, D, [0 1 2 3] of 2, splat_d = _mm_set1_pd, load_d = _mm_loadu_pd, store_d = _mm_storeu_pd;
    }

    calls! { of 2:
        add(a: Self::F, b: Self::F) -> Self::F = _mm_add_ps;
        sub(a: Self::F, b: Self::F) -> Self::F = _mm_sub_ps;
        mul(a: Self::F, b: Self::F) -> Self::F = _mm_mul_ps;
        div(a: Self::F, b: Self::F) -> Self::F = _mm_div_ps;
        sqrt(a: Self::F) -> Self::F = _mm_sqrt_ps;
        min(a: Self::F, b: Self::F) -> Self::F = _mm_min_ps;
        max(a: Self::F, b: Self::F) -> Self::F = _mm_max_ps;
        lt(a: Self::F, b: Self::F) -> Self::F = _mm_cmplt_ps;
        le(a: Self::F, b: Self::F) -> Self::F = _mm_cmple_ps;
        eq(a: Self::F, b: Self::F) -> Self::F = _mm_cmpeq_ps;
        and(a: Self::F, b: Self::F) -> Self::F = _mm_and_ps;
        or(a: Self::F, b: Self::F) -> Self::F = _mm_or_ps;
        xor(a: Self::F, b: Self::F) -> Self::F = _mm_xor_ps;
        and_not(mask: Self::F, a: Self::F) -> Self::F = _mm_andnot_ps;
        add_i(a: Self::I, b: Self::I) -> Self::I = _mm_add_epi32;
        sub_i(a: Self::I, b: Self::I) -> Self::I = _mm_sub_epi32;
        round_i(a: Self::F) -> Self::I = _mm_cvtps_epi32;
        truncate_i(a: Self::F) -> Self::I = _mm_cvttps_epi32;
        float_i(a: Self::I) -> Self::F = _mm_cvtepi32_ps;
    }

    calls! { of 4:
        add_d(a: Self::D, b: Self::D) -> Self::D = _mm_add_pd;
        sub_d(a: Self::D, b: Self::D) -> Self::D = _mm_sub_pd;
        mul_d(a: Self::D, b: Self::D) -> Self::D = _mm_mul_pd;
        div_d(a: Self::D, b: Self::D) -> Self::D = _mm_div_pd;
        sqrt_d(a: Self::D) -> Self::D = _mm_sqrt_pd;
        max_d(a: Self::D, b: Self::D) -> Self::D = _mm_max_pd;
    }

    #[inline(always)]
    unsafe fn next_lane(a: Self::F, before: Self::F) -> Self::F {
        #[inline(always)]
        unsafe fn half(a: __m128, before: __m128) -> __m128 {
            unsafe { _mm_shuffle_ps::<0x98>(_mm_shuffle_ps::<0x0f>(before, a), a) }
        }
        unsafe { [half(a[0], before[1]), half(a[1], a[0])] }
    }
    #[inline(always)]
    unsafe fn previous_lane(a: Self::F, after: Self::F) -> Self::F {
        #[inline(always)]
        unsafe fn half(a: __m128, after: __m128) -> __m128 {
            unsafe { _mm_shuffle_ps::<0x89>(a, _mm_shuffle_ps::<0x0f>(a, after)) }
        }
        unsafe { [half(a[0], a[1]), half(a[1], after[0])] }
    }
    #[inline(always)]
    unsafe fn bits(mask: Self::F) -> u32 {
        unsafe { (_mm_movemask_ps(mask[0]) | _mm_movemask_ps(mask[1]) << 4) as u32 }
    }

    #[inline(always)]
    unsafe fn select_bits_i(lanes: u32, yes: Self::I, no: Self::I) -> Self::I {
        unsafe {
            let mask = Self::mask(lanes);
            let mask = [_mm_castps_si128(mask[0]), _mm_castps_si128(mask[1])];
            each!(2 _mm_or_si128, each!(2 _mm_and_si128, mask, yes), each!(2 _mm_andnot_si128, mask, no))
        }
    }

    #[inline(always)]
    unsafe fn bits_lt_d(a: Self::D, b: Self::D) -> u32 {
        let mut bits = 0;
        for (i, (a, b)) in a.into_iter().zip(b).enumerate() {
            bits |= (unsafe { _mm_movemask_pd(_mm_cmplt_pd(a, b)) } as u32) << (2 * i);
        }
        bits
    }
    #[inline(always)]
    unsafe fn select_bits_d(lanes: u32, yes: Self::D, no: Self::D) -> Self::D {
        unsafe {
            let mask = Self::mask(lanes);
            let mask = [
                _mm_castps_pd(_mm_unpacklo_ps(mask[0], mask[0])),
                _mm_castps_pd(_mm_unpackhi_ps(mask[0], mask[0])),
                _mm_castps_pd(_mm_unpacklo_ps(mask[1], mask[1])),
                _mm_castps_pd(_mm_unpackhi_ps(mask[1], mask[1])),
            ];
            each!(4 _mm_or_pd, each!(4 _mm_and_pd, mask, yes), each!(4 _mm_andnot_pd, mask, no))
        }
    }
    #[inline(always)]
    unsafe fn widen(a: Self::F) -> Self::D {
        unsafe {
            [
                _mm_cvtps_pd(a[0]),
                _mm_cvtps_pd(_mm_movehl_ps(a[0], a[0])),
                _mm_cvtps_pd(a[1]),
                _mm_cvtps_pd(_mm_movehl_ps(a[1], a[1])),
            ]
        }
    }
    #[inline(always)]
    unsafe fn narrow(a: Self::D) -> Self::F {
        unsafe {
            [
                _mm_movelh_ps(_mm_cvtpd_ps(a[0]), _mm_cvtpd_ps(a[1])),
                _mm_movelh_ps(_mm_cvtpd_ps(a[2]), _mm_cvtpd_ps(a[3])),
            ]
        }
    }
    #[inline(always)]
    unsafe fn store_points(fields: [Self::F; 4], place: usize, first: *mut f32, step: usize) {
        unsafe {
            let [[x0, x1], [y0, y1], [z0, z1], [fourth0, fourth1]] = fields;
            let (low, high) = ([x0, y0, z0, fourth0], [x1, y1, z1, fourth1]);
            store_four_points(low, place, first, step);
            store_four_points(high, place, first.byte_add(4 * step), step);
        }
    }
}

impl Along for Sse2 {
    #[inline(always)]
    unsafe fn load_fours(place: impl Fn(usize) -> *const f32) -> Self::F {
        unsafe { [_mm_loadu_ps(place(0)), _mm_loadu_ps(place(1))] }
    }
    #[inline(always)]
    unsafe fn store_fours(value: Self::F, place: impl Fn(usize) -> *mut f32) {
        for (half, four) in value.into_iter().enumerate() {
            unsafe { _mm_storeu_ps(place(half), four) };
        }
    }
    #[inline(always)]
    unsafe fn transpose_fours(rows: [Self::F; 4]) -> [Self::F; 4] {
        let [mut a, mut b, mut c, mut d] = rows;
        for half in 0..2 {
            unsafe { _MM_TRANSPOSE4_PS(&mut a[half], &mut b[half], &mut c[half], &mut d[half]) };
        }
        [a, b, c, d]
    }
    #[inline(always)]
    unsafe fn prefix_sum_i(a: Self::I) -> Self::I {
        #[inline(always)]
        unsafe fn half(mut a: __m128i) -> __m128i {
            unsafe {
                a = _mm_add_epi32(a, _mm_slli_si128::<4>(a));
                _mm_add_epi32(a, _mm_slli_si128::<8>(a))
            }
        }
        unsafe {
            let (low, high) = (half(a[0]), half(a[1]));
            [low, _mm_add_epi32(high, _mm_shuffle_epi32::<0xff>(low))]
        }
    }
    #[inline(always)]
    unsafe fn last_i(a: Self::I) -> Self::I {
        unsafe { [_mm_shuffle_epi32::<0xff>(a[1]); 2] }
    }
    #[inline(always)]
    unsafe fn store_by_lanes(rows: [Self::I; 8], to: *mut i32) {
        for half in 0..2 {
            for four in 0..2 {
                unsafe {
                    let row = |i: usize| rows[4 * four + i][half];
                    let (mut a, mut b) = (_mm_castsi128_ps(row(0)), _mm_castsi128_ps(row(1)));
                    let (mut c, mut d) = (_mm_castsi128_ps(row(2)), _mm_castsi128_ps(row(3)));
                    _MM_TRANSPOSE4_PS(&mut a, &mut b, &mut c, &mut d);
                    for (lane, row) in [a, b, c, d].into_iter().enumerate() {
                        _mm_storeu_ps(to.add(8 * (4 * half + lane) + 4 * four).cast(), row);
                    }
                }
            }
        }
    }
}

impl Groups for Sse2 {
    type Pair = Twice<Self>;
    type Widest = Self;

    doubles_by_twos! { _mm_loadu_pd, _mm_storeu_pd, _mm_unpacklo_pd, _mm_unpackhi_pd }

    #[inline(always)]
    unsafe fn prefix_sum_d(a: Self::D) -> Self::D {
        /// Four lanes: each gets the one before, then the one two before.
        #[inline(always)]
        unsafe fn half(low: __m128d, high: __m128d) -> [__m128d; 2] {
            unsafe {
                let zero = _mm_setzero_pd();
                let low_1 = _mm_add_pd(low, _mm_unpacklo_pd(zero, low));
                let high_1 = _mm_add_pd(high, _mm_shuffle_pd::<0b01>(low, high));
                [low_1, _mm_add_pd(high_1, low_1)]
            }
        }
        unsafe {
            let ([low, low_last], [high, high_last]) = (half(a[0], a[1]), half(a[2], a[3]));
            let total = _mm_unpackhi_pd(low_last, low_last);
            [low, low_last, _mm_add_pd(high, total), _mm_add_pd(high_last, total)]
        }
    }
    #[inline(always)]
    unsafe fn last_d(a: Self::D) -> Self::D {
        unsafe { [_mm_unpackhi_pd(a[3], a[3]); 4] }
    }
}

impl Simd for Avx2 {
    const LANES: usize = GROUP;
    type F = __m256;
    type I = __m256i;
    type D = [__m256d; 2];

    calls! {
        splat(value: f32) -> Self::F = _mm256_set1_ps;
        load(from: *const f32) -> Self::F = _mm256_loadu_ps;
        store(to: *mut f32, value: Self::F) = _mm256_storeu_ps;
        add(a: Self::F, b: Self::F) -> Self::F = _mm256_add_ps;
        sub(a: Self::F, b: Self::F) -> Self::F = _mm256_sub_ps;
        mul(a: Self::F, b: Self::F) -> Self::F = _mm256_mul_ps;
        div(a: Self::F, b: Self::F) -> Self::F = _mm256_div_ps;
        mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F = _mm256_fmadd_ps;
        neg_mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F = _mm256_fnmadd_ps;
        sqrt(a: Self::F) -> Self::F = _mm256_sqrt_ps;
        min(a: Self::F, b: Self::F) -> Self::F = _mm256_min_ps;
        max(a: Self::F, b: Self::F) -> Self::F = _mm256_max_ps;
        lt(a: Self::F, b: Self::F) -> Self::F = _mm256_cmp_ps::<_CMP_LT_OQ>;
        le(a: Self::F, b: Self::F) -> Self::F = _mm256_cmp_ps::<_CMP_LE_OQ>;
        eq(a: Self::F, b: Self::F) -> Self::F = _mm256_cmp_ps::<_CMP_EQ_OQ>;
        and(a: Self::F, b: Self::F) -> Self::F = _mm256_and_ps;
        or(a: Self::F, b: Self::F) -> Self::F = _mm256_or_ps;
        xor(a: Self::F, b: Self::F) -> Self::F = _mm256_xor_ps;
        and_not(mask: Self::F, a: Self::F) -> Self::F = _mm256_andnot_ps;
        splat_i(value: i32) -> Self::I = _mm256_set1_epi32;
        add_i(a: Self::I, b: Self::I) -> Self::I = _mm256_add_epi32;
        sub_i(a: Self::I, b: Self::I) -> Self::I = _mm256_sub_epi32;
        round_i(a: Self::F) -> Self::I = _mm256_cvtps_epi32;
        truncate_i(a: Self::F) -> Self::I = _mm256_cvttps_epi32;
        float_i(a: Self::I) -> Self::F = _mm256_cvtepi32_ps;
        load_points(first: *const f32, step: usize) -> [Self::F; 3] = load_points_by_fours::<Self>;
    }

    memory! {
        f64, D, [0 1] of 4, splat_d = _mm256_set1_pd, load_d = _mm256_loadu_pd, store_d = _mm256_storeu_pd;
    }

    calls! { of 2:
        add_d(a: Self::D, b: Self::D) -> Self::D = _mm256_add_pd;
        sub_d(a: Self::D, b: Self::D) -> Self::D = _mm256_sub_pd;
        mul_d(a: Self::D, b: Self::D) -> Self::D = _mm256_mul_pd;
        div_d(a: Self::D, b: Self::D) -> Self::D = _mm256_div_pd;
        mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D = _mm256_fmadd_pd;
        neg_mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D = _mm256_fnmadd_pd;
        sqrt_d(a: Self::D) -> Self::D = _mm256_sqrt_pd;
        max_d(a: Self::D, b: Self::D) -> Self::D = _mm256_max_pd;
    }

    #[inline(always)]
    unsafe fn next_lane(a: Self::F, before: Self::F) -> Self::F {
        unsafe {
            let halves = _mm256_castps_si256(_mm256_permute2f128_ps::<0x21>(before, a));
            _mm256_castsi256_ps(_mm256_alignr_epi8::<12>(_mm256_castps_si256(a), halves))
        }
    }
    #[inline(always)]
    unsafe fn previous_lane(a: Self::F, after: Self::F) -> Self::F {
        unsafe {
            let halves = _mm256_castps_si256(_mm256_permute2f128_ps::<0x21>(a, after));
            _mm256_castsi256_ps(_mm256_alignr_epi8::<4>(halves, _mm256_castps_si256(a)))
        }
    }
    #[inline(always)]
    unsafe fn bits(mask: Self::F) -> u32 {
        unsafe { _mm256_movemask_ps(mask) as u32 }
    }

    #[inline(always)]
    unsafe fn select(mask: Self::F, yes: Self::F, no: Self::F) -> Self::F {
        // Of bytes: what blends floats may become a masked store, which takes long on some processors.
        unsafe {
            let (mask, yes, no) =
                (_mm256_castps_si256(mask), _mm256_castps_si256(yes), _mm256_castps_si256(no));
            _mm256_castsi256_ps(_mm256_blendv_epi8(no, yes, mask))
        }
    }

    #[inline(always)]
    unsafe fn load_i(from: *const i32) -> Self::I {
        unsafe { _mm256_loadu_si256(from.cast()) }
    }
    #[inline(always)]
    unsafe fn store_i(to: *mut i32, value: Self::I) {
        unsafe { _mm256_storeu_si256(to.cast(), value) }
    }
    #[inline(always)]
    unsafe fn select_bits_i(lanes: u32, yes: Self::I, no: Self::I) -> Self::I {
        unsafe { _mm256_blendv_epi8(no, yes, _mm256_castps_si256(Self::mask(lanes))) }
    }

    #[inline(always)]
    unsafe fn bits_lt_d(a: Self::D, b: Self::D) -> u32 {
        unsafe {
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(a[0], b[0]));
            let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(a[1], b[1]));
            (low | high << 4) as u32
        }
    }
    #[inline(always)]
    unsafe fn select_bits_d(lanes: u32, yes: Self::D, no: Self::D) -> Self::D {
        unsafe {
            let mask = _mm256_castps_si256(Self::mask(lanes));
            let low = _mm256_cvtepi32_epi64(_mm256_castsi256_si128(mask));
            let high = _mm256_cvtepi32_epi64(_mm256_extracti128_si256::<1>(mask));
            let mask = [_mm256_castsi256_pd(low), _mm256_castsi256_pd(high)];
            let no = each!(2 _mm256_andnot_pd, mask, no);
            each!(2 _mm256_or_pd, each!(2 _mm256_and_pd, mask, yes), no)
        }
    }
    #[inline(always)]
    unsafe fn widen(a: Self::F) -> Self::D {
        unsafe {
            [
                _mm256_cvtps_pd(_mm256_castps256_ps128(a)),
                _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(a)),
            ]
        }
    }
    #[inline(always)]
    unsafe fn narrow(a: Self::D) -> Self::F {
        unsafe { _mm256_set_m128(_mm256_cvtpd_ps(a[1]), _mm256_cvtpd_ps(a[0])) }
    }
    #[inline(always)]
    unsafe fn store_points(fields: [Self::F; 4], place: usize, first: *mut f32, step: usize) {
        unsafe {
            let mut halves = [[_mm_setzero_ps(); 4]; 2];
            for c in 0..4 {
                halves[0][c] = _mm256_castps256_ps128(fields[c]);
                halves[1][c] = _mm256_extractf128_ps::<1>(fields[c]);
            }
            let [low, high] = halves;
            store_four_points(low, place, first, step);
            store_four_points(high, place, first.byte_add(4 * step), step);
        }
    }
}

impl Along for Avx2 {
    #[inline(always)]
    unsafe fn load_fours(place: impl Fn(usize) -> *const f32) -> Self::F {
        unsafe { _mm256_loadu2_m128(place(1), place(0)) }
    }
    #[inline(always)]
    unsafe fn store_fours(value: Self::F, place: impl Fn(usize) -> *mut f32) {
        unsafe { _mm256_storeu2_m128(place(1), place(0), value) };
    }
    #[inline(always)]
    unsafe fn transpose_fours([a, b, c, d]: [Self::F; 4]) -> [Self::F; 4] {
        unsafe {
            let (ab_low, cd_low) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
            let (ab_high, cd_high) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
            [
                _mm256_shuffle_ps::<0x44>(ab_low, cd_low),
                _mm256_shuffle_ps::<0xee>(ab_low, cd_low),
                _mm256_shuffle_ps::<0x44>(ab_high, cd_high),
                _mm256_shuffle_ps::<0xee>(ab_high, cd_high),
            ]
        }
    }
    #[inline(always)]
    unsafe fn prefix_sum_i(a: Self::I) -> Self::I {
        unsafe {
            let a = _mm256_add_epi32(a, _mm256_slli_si256::<4>(a));
            let a = _mm256_add_epi32(a, _mm256_slli_si256::<8>(a));
            // The low half's total, for the high half.
            let totals = _mm256_shuffle_epi32::<0xff>(a);
            _mm256_add_epi32(a, _mm256_permute2x128_si256::<0x08>(totals, totals))
        }
    }
    #[inline(always)]
    unsafe fn last_i(a: Self::I) -> Self::I {
        unsafe { _mm256_permutevar8x32_epi32(a, _mm256_set1_epi32(7)) }
    }
    #[inline(always)]
    unsafe fn store_by_lanes([a, b, c, d, e, f, g, h]: [Self::I; 8], to: *mut i32) {
        unsafe {
            let cast = |a| _mm256_castsi256_ps(a);
            let first = Self::transpose_fours([cast(a), cast(b), cast(c), cast(d)]);
            let second = Self::transpose_fours([cast(e), cast(f), cast(g), cast(h)]);
            for i in 0..4 {
                let low = _mm256_permute2f128_ps::<0x20>(first[i], second[i]);
                let high = _mm256_permute2f128_ps::<0x31>(first[i], second[i]);
                _mm256_storeu_ps(to.add(8 * i).cast(), low);
                _mm256_storeu_ps(to.add(8 * (4 + i)).cast(), high);
            }
        }
    }
}

impl Groups for Avx2 {
    type Pair = Twice<Self>;
    type Widest = Self;

    #[inline(always)]
    unsafe fn load_fours_d(place: impl Fn(usize) -> *const f64) -> Self::D {
        unsafe { [_mm256_loadu_pd(place(0)), _mm256_loadu_pd(place(1))] }
    }
    #[inline(always)]
    unsafe fn store_fours_d(value: Self::D, place: impl Fn(usize) -> *mut f64) {
        for (half, four) in value.into_iter().enumerate() {
            unsafe { _mm256_storeu_pd(place(half), four) };
        }
    }
    #[inline(always)]
    unsafe fn transpose_fours_d(rows: [Self::D; 4]) -> [Self::D; 4] {
        let [a, b, c, d] = rows;
        let mut columns = rows;
        for half in 0..2 {
            unsafe {
                let ab_even = _mm256_unpacklo_pd(a[half], b[half]);
                let cd_even = _mm256_unpacklo_pd(c[half], d[half]);
                let ab_odd = _mm256_unpackhi_pd(a[half], b[half]);
                let cd_odd = _mm256_unpackhi_pd(c[half], d[half]);
                columns[0][half] = _mm256_permute2f128_pd::<0x20>(ab_even, cd_even);
                columns[1][half] = _mm256_permute2f128_pd::<0x20>(ab_odd, cd_odd);
                columns[2][half] = _mm256_permute2f128_pd::<0x31>(ab_even, cd_even);
                columns[3][half] = _mm256_permute2f128_pd::<0x31>(ab_odd, cd_odd);
            }
        }
        columns
    }
    #[inline(always)]
    unsafe fn join_halves_d(a: Self::D, b: Self::D) -> [Self::D; 2] {
        [[a[0], b[0]], [a[1], b[1]]]
    }
    #[inline(always)]
    unsafe fn load_pairs_d(place: impl Fn(usize) -> *const f64) -> Self::D {
        unsafe {
            [_mm256_loadu2_m128d(place(1), place(0)), _mm256_loadu2_m128d(place(3), place(2))]
        }
    }
    #[inline(always)]
    unsafe fn pair_d(a: Self::D, b: Self::D) -> [Self::D; 2] {
        let mut pairs = [a, b];
        for half in 0..2 {
            unsafe {
                let even = _mm256_unpacklo_pd(a[half], b[half]);
                let odd = _mm256_unpackhi_pd(a[half], b[half]);
                pairs[half][0] = _mm256_permute2f128_pd::<0x20>(even, odd);
                pairs[half][1] = _mm256_permute2f128_pd::<0x31>(even, odd);
            }
        }
        pairs
    }
    #[inline(always)]
    unsafe fn unpair_d(first: Self::D, last: Self::D) -> [Self::D; 2] {
        let mut lanes = [first, last];
        for (half, [low, high]) in [first, last].into_iter().enumerate() {
            unsafe {
                let even = _mm256_permute2f128_pd::<0x20>(low, high);
                let odd = _mm256_permute2f128_pd::<0x31>(low, high);
                lanes[0][half] = _mm256_unpacklo_pd(even, odd);
                lanes[1][half] = _mm256_unpackhi_pd(even, odd);
            }
        }
        lanes
    }
    #[inline(always)]
    unsafe fn prefix_sum_d(a: Self::D) -> Self::D {
        /// Four lanes: each gets the one before, then the one two before.
        #[inline(always)]
        unsafe fn half(a: __m256d) -> __m256d {
            unsafe {
                let low_half_up = _mm256_permute2f128_pd::<0x08>(a, a);
                let a = _mm256_add_pd(a, _mm256_shuffle_pd::<0b0100>(low_half_up, a));
                _mm256_add_pd(a, _mm256_permute2f128_pd::<0x08>(a, a))
            }
        }
        unsafe {
            let low = half(a[0]);
            [low, _mm256_add_pd(half(a[1]), _mm256_permute4x64_pd::<0xff>(low))]
        }
    }
    #[inline(always)]
    unsafe fn last_d(a: Self::D) -> Self::D {
        unsafe { [_mm256_permute4x64_pd::<0xff>(a[1]); 2] }
    }
}
