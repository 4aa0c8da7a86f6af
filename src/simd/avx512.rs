//! AVX-512: eight floats as with AVX2, eight doubles in one register, and pairs of groups in one or two.

// Every block calls intrinsics of the instruction set that the trait's contract promises.
#![allow(clippy::undocumented_unsafe_blocks)]

use std::arch::x86_64::*;

use super::twice::Twice;
use super::x86::Avx2;
use super::{Along, GROUP, Groups, Simd, load_points_by_fours};

/// AVX-512 (F, VL, DQ, BW) and FMA, on processors that have them.
#[derive(Clone, Copy)]
pub(crate) struct Avx512;

/// Two of its groups: sixteen floats in one register.
#[derive(Clone, Copy)]
pub(crate) struct Avx512Pair;

/// What a pair's doubles are.
type TwoGroups = Twice<Avx512>;

impl Simd for Avx512 {
    const LANES: usize = GROUP;
    type F = __m256;
    type I = __m256i;
    type D = __m512d;

    calls! {
        splat(value: f32) -> Self::F = Avx2::splat;
        load(from: *const f32) -> Self::F = Avx2::load;
        store(to: *mut f32, value: Self::F) = Avx2::store;
        add(a: Self::F, b: Self::F) -> Self::F = Avx2::add;
        sub(a: Self::F, b: Self::F) -> Self::F = Avx2::sub;
        mul(a: Self::F, b: Self::F) -> Self::F = Avx2::mul;
        div(a: Self::F, b: Self::F) -> Self::F = Avx2::div;
        mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F = Avx2::mul_add;
        neg_mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F = Avx2::neg_mul_add;
        sqrt(a: Self::F) -> Self::F = Avx2::sqrt;
        min(a: Self::F, b: Self::F) -> Self::F = Avx2::min;
        max(a: Self::F, b: Self::F) -> Self::F = Avx2::max;
        lt(a: Self::F, b: Self::F) -> Self::F = Avx2::lt;
        le(a: Self::F, b: Self::F) -> Self::F = Avx2::le;
        eq(a: Self::F, b: Self::F) -> Self::F = Avx2::eq;
        and(a: Self::F, b: Self::F) -> Self::F = Avx2::and;
        or(a: Self::F, b: Self::F) -> Self::F = Avx2::or;
        xor(a: Self::F, b: Self::F) -> Self::F = Avx2::xor;
        and_not(mask: Self::F, a: Self::F) -> Self::F = Avx2::and_not;
        select(mask: Self::F, yes: Self::F, no: Self::F) -> Self::F = Avx2::select;
        next_lane(a: Self::F, before: Self::F) -> Self::F = Avx2::next_lane;
        previous_lane(a: Self::F, after: Self::F) -> Self::F = Avx2::previous_lane;
        bits(mask: Self::F) -> u32 = Avx2::bits;

        load_i(from: *const i32) -> Self::I = Avx2::load_i;
        store_i(to: *mut i32, value: Self::I) = Avx2::store_i;
        splat_i(value: i32) -> Self::I = Avx2::splat_i;
        add_i(a: Self::I, b: Self::I) -> Self::I = Avx2::add_i;
        sub_i(a: Self::I, b: Self::I) -> Self::I = Avx2::sub_i;
        round_i(a: Self::F) -> Self::I = Avx2::round_i;
        truncate_i(a: Self::F) -> Self::I = Avx2::truncate_i;
        float_i(a: Self::I) -> Self::F = Avx2::float_i;
        load_points(first: *const f32, step: usize) -> [Self::F; 3] = Avx2::load_points;
        store_points(fields: [Self::F; 4], place: usize, first: *mut f32, step: usize) = Avx2::store_points;

        splat_d(value: f64) -> Self::D = _mm512_set1_pd;
        load_d(from: *const f64) -> Self::D = _mm512_loadu_pd;
        store_d(to: *mut f64, value: Self::D) = _mm512_storeu_pd;
        add_d(a: Self::D, b: Self::D) -> Self::D = _mm512_add_pd;
        sub_d(a: Self::D, b: Self::D) -> Self::D = _mm512_sub_pd;
        mul_d(a: Self::D, b: Self::D) -> Self::D = _mm512_mul_pd;
        div_d(a: Self::D, b: Self::D) -> Self::D = _mm512_div_pd;
        mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D = _mm512_fmadd_pd;
        neg_mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D = _mm512_fnmadd_pd;
        sqrt_d(a: Self::D) -> Self::D = _mm512_sqrt_pd;
        max_d(a: Self::D, b: Self::D) -> Self::D = _mm512_max_pd;
        widen(a: Self::F) -> Self::D = _mm512_cvtps_pd;
        narrow(a: Self::D) -> Self::F = _mm512_cvtpd_ps;
    }

    #[inline(always)]
    unsafe fn mask(bits: u32) -> Self::F {
        unsafe { _mm256_castsi256_ps(_mm256_movm_epi32(bits as u8)) }
    }
    #[inline(always)]
    unsafe fn select_bits_i(lanes: u32, yes: Self::I, no: Self::I) -> Self::I {
        unsafe { _mm256_mask_blend_epi32(lanes as u8, no, yes) }
    }
    #[inline(always)]
    unsafe fn bits_lt_d(a: Self::D, b: Self::D) -> u32 {
        unsafe { u32::from(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b)) }
    }
    #[inline(always)]
    unsafe fn select_bits_d(lanes: u32, yes: Self::D, no: Self::D) -> Self::D {
        unsafe { _mm512_mask_blend_pd(lanes as u8, no, yes) }
    }
}

impl Along for Avx512 {
    calls! {
        load_fours(place: impl Fn(usize) -> *const f32) -> Self::F = Avx2::load_fours;
        store_fours(value: Self::F, place: impl Fn(usize) -> *mut f32) = Avx2::store_fours;
        transpose_fours(rows: [Self::F; 4]) -> [Self::F; 4] = Avx2::transpose_fours;
        prefix_sum_i(a: Self::I) -> Self::I = Avx2::prefix_sum_i;
        last_i(a: Self::I) -> Self::I = Avx2::last_i;
        store_by_lanes(rows: [Self::I; 8], to: *mut i32) = Avx2::store_by_lanes;
    }
}

impl Groups for Avx512 {
    type Pair = Avx512Pair;
    type Widest = Self::Pair;

    #[inline(always)]
    unsafe fn load_fours_d(place: impl Fn(usize) -> *const f64) -> Self::D {
        unsafe {
            let low = _mm512_castpd256_pd512(_mm256_loadu_pd(place(0)));
            _mm512_insertf64x4::<1>(low, _mm256_loadu_pd(place(1)))
        }
    }
    #[inline(always)]
    unsafe fn store_fours_d(value: Self::D, place: impl Fn(usize) -> *mut f64) {
        unsafe {
            _mm256_storeu_pd(place(0), _mm512_castpd512_pd256(value));
            _mm256_storeu_pd(place(1), _mm512_extractf64x4_pd::<1>(value));
        }
    }
    #[inline(always)]
    unsafe fn transpose_fours_d([a, b, c, d]: [Self::D; 4]) -> [Self::D; 4] {
        unsafe {
            let (ab_even, cd_even) = (_mm512_unpacklo_pd(a, b), _mm512_unpacklo_pd(c, d));
            let (ab_odd, cd_odd) = (_mm512_unpackhi_pd(a, b), _mm512_unpackhi_pd(c, d));
            // Lanes 0 and 1, or 2 and 3, of both halves of two registers.
            let low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
            let high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
            [
                _mm512_permutex2var_pd(ab_even, low, cd_even),
                _mm512_permutex2var_pd(ab_odd, low, cd_odd),
                _mm512_permutex2var_pd(ab_even, high, cd_even),
                _mm512_permutex2var_pd(ab_odd, high, cd_odd),
            ]
        }
    }
    #[inline(always)]
    unsafe fn join_halves_d(a: Self::D, b: Self::D) -> [Self::D; 2] {
        unsafe { [_mm512_shuffle_f64x2::<0x44>(a, b), _mm512_shuffle_f64x2::<0xee>(a, b)] }
    }
    #[inline(always)]
    unsafe fn load_pairs_d(place: impl Fn(usize) -> *const f64) -> Self::D {
        unsafe {
            let low = _mm256_loadu2_m128d(place(1), place(0));
            let high = _mm256_loadu2_m128d(place(3), place(2));
            _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low), high)
        }
    }
    #[inline(always)]
    unsafe fn pair_d(a: Self::D, b: Self::D) -> [Self::D; 2] {
        unsafe {
            let first = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
            let last = _mm512_setr_epi64(4, 12, 5, 13, 6, 14, 7, 15);
            [_mm512_permutex2var_pd(a, first, b), _mm512_permutex2var_pd(a, last, b)]
        }
    }
    #[inline(always)]
    unsafe fn unpair_d(first: Self::D, last: Self::D) -> [Self::D; 2] {
        unsafe {
            let even = _mm512_setr_epi64(0, 2, 4, 6, 8, 10, 12, 14);
            let odd = _mm512_setr_epi64(1, 3, 5, 7, 9, 11, 13, 15);
            [_mm512_permutex2var_pd(first, even, last), _mm512_permutex2var_pd(first, odd, last)]
        }
    }
    // Not by fours: operations of three operands, as theirs, hold up stores of whole registers on Zen 5.
    #[inline(always)]
    unsafe fn transpose_d([a, b, c, d, e, f, g, h]: [Self::D; 8]) -> [Self::D; 8] {
        unsafe {
            let (ab, cd) = (pairs_of_lanes(a, b), pairs_of_lanes(c, d));
            let (ef, gh) = (pairs_of_lanes(e, f), pairs_of_lanes(g, h));
            let mut lanes = [a; 8];
            for odd in 0..2 {
                let (abcd, efgh) = (alternate(ab[odd], cd[odd]), alternate(ef[odd], gh[odd]));
                for second in 0..2 {
                    let lane = 2 * second + odd;
                    [lanes[lane], lanes[lane + 4]] = alternate(abcd[second], efgh[second]);
                }
            }
            lanes
        }
    }
    #[inline(always)]
    unsafe fn prefix_sum_d(a: Self::D) -> Self::D {
        unsafe {
            // Among lanes 0 to 3 and 4 to 7 each gets the one before, then the one two before.
            let a = _mm512_add_pd(a, _mm512_maskz_permutex_pd::<0b10_01_00_00>(0b1110_1110, a));
            let a = _mm512_add_pd(a, _mm512_maskz_permutex_pd::<0b01_00_00_00>(0b1100_1100, a));
            let low = _mm512_maskz_permutexvar_pd(0b1111_0000, _mm512_set1_epi64(3), a);
            _mm512_add_pd(a, low)
        }
    }
    #[inline(always)]
    unsafe fn last_d(a: Self::D) -> Self::D {
        unsafe { _mm512_permutexvar_pd(_mm512_set1_epi64(7), a) }
    }
}

/// The even lanes of both, in pairs, and the odd ones.
#[inline(always)]
unsafe fn pairs_of_lanes(a: __m512d, b: __m512d) -> [__m512d; 2] {
    unsafe { [_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b)] }
}

/// Of four pairs of lanes each, the first and third of both, and the second and fourth.
#[inline(always)]
unsafe fn alternate(a: __m512d, b: __m512d) -> [__m512d; 2] {
    unsafe { [_mm512_shuffle_f64x2::<0x88>(a, b), _mm512_shuffle_f64x2::<0xdd>(a, b)] }
}

impl Simd for Avx512Pair {
    const LANES: usize = 2 * GROUP;
    type F = __m512;
    type I = __m512i;
    type D = [__m512d; 2];

    calls! {
        splat(value: f32) -> Self::F = _mm512_set1_ps;
        load(from: *const f32) -> Self::F = _mm512_loadu_ps;
        store(to: *mut f32, value: Self::F) = _mm512_storeu_ps;
        add(a: Self::F, b: Self::F) -> Self::F = _mm512_add_ps;
        sub(a: Self::F, b: Self::F) -> Self::F = _mm512_sub_ps;
        mul(a: Self::F, b: Self::F) -> Self::F = _mm512_mul_ps;
        div(a: Self::F, b: Self::F) -> Self::F = _mm512_div_ps;
        mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F = _mm512_fmadd_ps;
        neg_mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F = _mm512_fnmadd_ps;
        sqrt(a: Self::F) -> Self::F = _mm512_sqrt_ps;
        min(a: Self::F, b: Self::F) -> Self::F = _mm512_min_ps;
        max(a: Self::F, b: Self::F) -> Self::F = _mm512_max_ps;
        and(a: Self::F, b: Self::F) -> Self::F = _mm512_and_ps;
        or(a: Self::F, b: Self::F) -> Self::F = _mm512_or_ps;
        xor(a: Self::F, b: Self::F) -> Self::F = _mm512_xor_ps;
        and_not(mask: Self::F, a: Self::F) -> Self::F = _mm512_andnot_ps;

        splat_i(value: i32) -> Self::I = _mm512_set1_epi32;
        add_i(a: Self::I, b: Self::I) -> Self::I = _mm512_add_epi32;
        sub_i(a: Self::I, b: Self::I) -> Self::I = _mm512_sub_epi32;
        round_i(a: Self::F) -> Self::I = _mm512_cvtps_epi32;
        truncate_i(a: Self::F) -> Self::I = _mm512_cvttps_epi32;
        float_i(a: Self::I) -> Self::F = _mm512_cvtepi32_ps;

        splat_d(value: f64) -> Self::D = TwoGroups::splat_d;
        load_d(from: *const f64) -> Self::D = TwoGroups::load_d;
        store_d(to: *mut f64, value: Self::D) = TwoGroups::store_d;
        add_d(a: Self::D, b: Self::D) -> Self::D = TwoGroups::add_d;
        sub_d(a: Self::D, b: Self::D) -> Self::D = TwoGroups::sub_d;
        mul_d(a: Self::D, b: Self::D) -> Self::D = TwoGroups::mul_d;
        div_d(a: Self::D, b: Self::D) -> Self::D = TwoGroups::div_d;
        mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D = TwoGroups::mul_add_d;
        neg_mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D = TwoGroups::neg_mul_add_d;
        sqrt_d(a: Self::D) -> Self::D = TwoGroups::sqrt_d;
        max_d(a: Self::D, b: Self::D) -> Self::D = TwoGroups::max_d;
        bits_lt_d(a: Self::D, b: Self::D) -> u32 = TwoGroups::bits_lt_d;
        select_bits_d(lanes: u32, yes: Self::D, no: Self::D) -> Self::D = TwoGroups::select_bits_d;
    }

    #[inline(always)]
    unsafe fn mask(bits: u32) -> Self::F {
        unsafe { _mm512_castsi512_ps(_mm512_movm_epi32(bits as u16)) }
    }
    #[inline(always)]
    unsafe fn next_lane(a: Self::F, before: Self::F) -> Self::F {
        unsafe {
            let (a, before) = (_mm512_castps_si512(a), _mm512_castps_si512(before));
            _mm512_castsi512_ps(_mm512_alignr_epi32::<15>(a, before))
        }
    }
    #[inline(always)]
    unsafe fn previous_lane(a: Self::F, after: Self::F) -> Self::F {
        unsafe {
            let (a, after) = (_mm512_castps_si512(a), _mm512_castps_si512(after));
            _mm512_castsi512_ps(_mm512_alignr_epi32::<1>(after, a))
        }
    }
    #[inline(always)]
    unsafe fn bits(mask: Self::F) -> u32 {
        unsafe { u32::from(_mm512_movepi32_mask(_mm512_castps_si512(mask))) }
    }
    #[inline(always)]
    unsafe fn lt(a: Self::F, b: Self::F) -> Self::F {
        unsafe { Self::mask(u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b))) }
    }
    #[inline(always)]
    unsafe fn le(a: Self::F, b: Self::F) -> Self::F {
        unsafe { Self::mask(u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b))) }
    }
    #[inline(always)]
    unsafe fn eq(a: Self::F, b: Self::F) -> Self::F {
        unsafe { Self::mask(u32::from(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(a, b))) }
    }
    #[inline(always)]
    unsafe fn select(mask: Self::F, yes: Self::F, no: Self::F) -> Self::F {
        unsafe { _mm512_mask_blend_ps(Self::bits(mask) as u16, no, yes) }
    }

    #[inline(always)]
    unsafe fn load_i(from: *const i32) -> Self::I {
        unsafe { _mm512_loadu_si512(from.cast()) }
    }
    #[inline(always)]
    unsafe fn store_i(to: *mut i32, value: Self::I) {
        unsafe { _mm512_storeu_si512(to.cast(), value) }
    }
    #[inline(always)]
    unsafe fn select_bits_i(lanes: u32, yes: Self::I, no: Self::I) -> Self::I {
        unsafe { _mm512_mask_blend_epi32(lanes as u16, no, yes) }
    }

    #[inline(always)]
    unsafe fn widen(a: Self::F) -> Self::D {
        unsafe {
            let (low, high) = (_mm512_castps512_ps256(a), _mm512_extractf32x8_ps::<1>(a));
            [_mm512_cvtps_pd(low), _mm512_cvtps_pd(high)]
        }
    }
    #[inline(always)]
    unsafe fn narrow(a: Self::D) -> Self::F {
        unsafe {
            let low = _mm512_castps256_ps512(Avx512::narrow(a[0]));
            _mm512_insertf32x8::<1>(low, Avx512::narrow(a[1]))
        }
    }

    #[inline(always)]
    unsafe fn load_points(first: *const f32, step: usize) -> [Self::F; 3] {
        unsafe {
            if step != size_of::<[f32; 4]>() {
                return load_points_by_fours::<Self>(first, step);
            }
            let (a, b) = (_mm512_loadu_ps(first), _mm512_loadu_ps(first.add(16)));
            let (c, d) = (_mm512_loadu_ps(first.add(32)), _mm512_loadu_ps(first.add(48)));
            // Of eight points: x and y, or z.
            let xy = _mm512_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29);
            let z = _mm512_setr_epi32(2, 6, 10, 14, 18, 22, 26, 30, 0, 0, 0, 0, 0, 0, 0, 0);
            let (xy_ab, xy_cd) =
                (_mm512_permutex2var_ps(a, xy, b), _mm512_permutex2var_ps(c, xy, d));
            let (z_ab, z_cd) = (_mm512_permutex2var_ps(a, z, b), _mm512_permutex2var_ps(c, z, d));
            [
                _mm512_shuffle_f32x4::<0x44>(xy_ab, xy_cd),
                _mm512_shuffle_f32x4::<0xee>(xy_ab, xy_cd),
                _mm512_shuffle_f32x4::<0x44>(z_ab, z_cd),
            ]
        }
    }
    #[inline(always)]
    unsafe fn store_points(fields: [Self::F; 4], place: usize, first: *mut f32, step: usize) {
        unsafe {
            if step != size_of::<[f32; 8]>() {
                let mut pairs = [[_mm256_setzero_ps(); 2]; 4];
                for c in 0..4 {
                    let high = _mm512_extractf32x8_ps::<1>(fields[c]);
                    pairs[c] = [_mm512_castps512_ps256(fields[c]), high];
                }
                return TwoGroups::store_points(pairs, place, first, step);
            }
            let [x, y, z, fourth] = fields;
            // Of lanes 0 and 1 of each four, and of lanes 2 and 3: x and y, z and the fourth.
            let xy = [_mm512_unpacklo_ps(x, y), _mm512_unpackhi_ps(x, y)];
            let rest = [_mm512_unpacklo_ps(z, fourth), _mm512_unpackhi_ps(z, fourth)];
            // Two lanes' eight floats: what lies behind the third is the fourth, wherever it belongs.
            let mut two =
                _mm512_setr_epi32(0, 1, 16, 17, 17, 17, 17, 17, 2, 3, 18, 19, 19, 19, 19, 19);
            let written = 0b111 | 1 << place;
            for four in 0..4 {
                for half in 0..2 {
                    let points = _mm512_permutex2var_ps(xy[half], two, rest[half]);
                    let to = first.add((4 * four + 2 * half) * 8);
                    _mm512_mask_storeu_ps(to, written | written << 8, points);
                }
                two = _mm512_add_epi32(two, _mm512_set1_epi32(4));
            }
        }
    }
}

impl Along for Avx512Pair {
    #[inline(always)]
    unsafe fn load_fours(place: impl Fn(usize) -> *const f32) -> Self::F {
        unsafe {
            let fours = _mm512_castps128_ps512(_mm_loadu_ps(place(0)));
            let fours = _mm512_insertf32x4::<1>(fours, _mm_loadu_ps(place(1)));
            let fours = _mm512_insertf32x4::<2>(fours, _mm_loadu_ps(place(2)));
            _mm512_insertf32x4::<3>(fours, _mm_loadu_ps(place(3)))
        }
    }
    #[inline(always)]
    unsafe fn store_fours(value: Self::F, place: impl Fn(usize) -> *mut f32) {
        unsafe {
            _mm_storeu_ps(place(0), _mm512_castps512_ps128(value));
            _mm_storeu_ps(place(1), _mm512_extractf32x4_ps::<1>(value));
            _mm_storeu_ps(place(2), _mm512_extractf32x4_ps::<2>(value));
            _mm_storeu_ps(place(3), _mm512_extractf32x4_ps::<3>(value));
        }
    }
    #[inline(always)]
    unsafe fn transpose_fours([a, b, c, d]: [Self::F; 4]) -> [Self::F; 4] {
        unsafe {
            let (ab_low, cd_low) = (_mm512_unpacklo_ps(a, b), _mm512_unpacklo_ps(c, d));
            let (ab_high, cd_high) = (_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
            [
                _mm512_shuffle_ps::<0x44>(ab_low, cd_low),
                _mm512_shuffle_ps::<0xee>(ab_low, cd_low),
                _mm512_shuffle_ps::<0x44>(ab_high, cd_high),
                _mm512_shuffle_ps::<0xee>(ab_high, cd_high),
            ]
        }
    }
    #[inline(always)]
    unsafe fn store_by_lanes([a, b, c, d, e, f, g, h]: [Self::I; 8], to: *mut i32) {
        unsafe {
            let cast = |a| _mm512_castsi512_ps(a);
            let first = Self::transpose_fours([cast(a), cast(b), cast(c), cast(d)]);
            let second = Self::transpose_fours([cast(e), cast(f), cast(g), cast(h)]);
            // Lanes 0 to 3 and 4 to 7, or 8 to 11 and 12 to 15, of both.
            let low = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
            let high = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
            for i in 0..4 {
                let (first, second) =
                    (_mm512_castps_si512(first[i]), _mm512_castps_si512(second[i]));
                let fours = [
                    _mm512_permutex2var_epi64(first, low, second),
                    _mm512_permutex2var_epi64(first, high, second),
                ];
                for half in 0..2 {
                    let to = to.add(8 * (8 * half + i));
                    _mm256_storeu_si256(to.cast(), _mm512_castsi512_si256(fours[half]));
                    let upper = _mm512_extracti64x4_epi64::<1>(fours[half]);
                    _mm256_storeu_si256(to.add(8 * 4).cast(), upper);
                }
            }
        }
    }
    #[inline(always)]
    unsafe fn prefix_sum_i(a: Self::I) -> Self::I {
        unsafe {
            let zero = _mm512_setzero_si512();
            let a = _mm512_add_epi32(a, _mm512_alignr_epi32::<15>(a, zero));
            let a = _mm512_add_epi32(a, _mm512_alignr_epi32::<14>(a, zero));
            let a = _mm512_add_epi32(a, _mm512_alignr_epi32::<12>(a, zero));
            _mm512_add_epi32(a, _mm512_alignr_epi32::<8>(a, zero))
        }
    }
    #[inline(always)]
    unsafe fn last_i(a: Self::I) -> Self::I {
        unsafe { _mm512_permutexvar_epi32(_mm512_set1_epi32(15), a) }
    }
}
