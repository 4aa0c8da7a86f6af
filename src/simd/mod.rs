//! Eight pixels at a time on every instruction set, or sixteen as pairs of eight.
//!
//! Algorithms are written once, over [`Simd`], in `#[inline(always)]` functions; only the outermost function of a
//! path is compiled for its instruction set. No operation reorders, and products are fused with sums only where that is
//! asked for: so all paths that fuse give the same bits, and so do all that cannot.

// Without a baseline of its own an architecture uses no registers, and with one only tests use the portable path.
#[allow(unused_macros)]
#[macro_use]
mod registers;

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;
#[allow(dead_code)]
pub(crate) mod portable;
#[cfg(test)]
mod tests;
mod twice;
#[cfg(target_arch = "x86_64")]
pub(crate) mod x86;

/// What every processor of the architecture has.
#[cfg(target_arch = "aarch64")]
pub(crate) use neon::Neon as Baseline;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub(crate) use portable::Portable as Baseline;
#[cfg(target_arch = "x86_64")]
pub(crate) use x86::Sse2 as Baseline;

/// Pixels in a group.
pub(crate) const GROUP: usize = 8;

/// Some lanes of floats, integers or doubles and what can be done with them: groups of eight, or pairs of groups.
/// Masks are floats whose bits are all ones or all zeros.
///
/// # Safety
/// The methods may only be called where the processor has the implementor's instruction set: within a function
/// that `fast::paths` dispatched to. Loads and stores are of all lanes, at any address aligned to one element.
pub(crate) trait Simd: Copy {
    const LANES: usize;
    /// So many f32.
    type F: Copy;
    /// So many i32.
    type I: Copy;
    /// So many f64.
    type D: Copy;

    unsafe fn splat(value: f32) -> Self::F;
    unsafe fn load(from: *const f32) -> Self::F;
    unsafe fn store(to: *mut f32, value: Self::F);
    unsafe fn add(a: Self::F, b: Self::F) -> Self::F;
    unsafe fn sub(a: Self::F, b: Self::F) -> Self::F;
    unsafe fn mul(a: Self::F, b: Self::F) -> Self::F;
    unsafe fn div(a: Self::F, b: Self::F) -> Self::F;
    /// `a * b + c`, rounded once where the instruction set can, else twice.
    #[inline(always)]
    unsafe fn mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        // SAFETY: as the caller's.
        unsafe { Self::add(Self::mul(a, b), c) }
    }
    /// `c - a * b`, likewise.
    #[inline(always)]
    unsafe fn neg_mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        // SAFETY: as the caller's.
        unsafe { Self::sub(c, Self::mul(a, b)) }
    }
    unsafe fn sqrt(a: Self::F) -> Self::F;
    /// `a < b ? a : b`
    unsafe fn min(a: Self::F, b: Self::F) -> Self::F;
    /// `a > b ? a : b`
    unsafe fn max(a: Self::F, b: Self::F) -> Self::F;
    /// The mask `a < b`, false where one is NaN.
    unsafe fn lt(a: Self::F, b: Self::F) -> Self::F;
    /// The mask `a <= b`, false where one is NaN.
    unsafe fn le(a: Self::F, b: Self::F) -> Self::F;
    /// The mask `a == b`.
    unsafe fn eq(a: Self::F, b: Self::F) -> Self::F;
    unsafe fn and(a: Self::F, b: Self::F) -> Self::F;
    unsafe fn or(a: Self::F, b: Self::F) -> Self::F;
    unsafe fn xor(a: Self::F, b: Self::F) -> Self::F;
    /// `!mask & a`
    unsafe fn and_not(mask: Self::F, a: Self::F) -> Self::F;
    /// Every lane takes the value of the one before, the first that of the last one of `before`.
    unsafe fn next_lane(a: Self::F, before: Self::F) -> Self::F;
    /// Every lane takes the value of the one after, the last that of the first one of `after`.
    unsafe fn previous_lane(a: Self::F, after: Self::F) -> Self::F;
    /// Bit l is lane l of a mask.
    unsafe fn bits(mask: Self::F) -> u32;

    unsafe fn load_i(from: *const i32) -> Self::I;
    unsafe fn store_i(to: *mut i32, value: Self::I);
    unsafe fn splat_i(value: i32) -> Self::I;
    unsafe fn add_i(a: Self::I, b: Self::I) -> Self::I;
    unsafe fn sub_i(a: Self::I, b: Self::I) -> Self::I;
    /// `lanes` bit l ? yes : no
    unsafe fn select_bits_i(lanes: u32, yes: Self::I, no: Self::I) -> Self::I;
    /// Nearest integers, ties to even; the value must fit.
    unsafe fn round_i(a: Self::F) -> Self::I;
    /// Integers towards zero; of what does not fit, NaN too, any number.
    unsafe fn truncate_i(a: Self::F) -> Self::I;
    unsafe fn float_i(a: Self::I) -> Self::F;

    unsafe fn splat_d(value: f64) -> Self::D;
    unsafe fn load_d(from: *const f64) -> Self::D;
    unsafe fn store_d(to: *mut f64, value: Self::D);
    unsafe fn add_d(a: Self::D, b: Self::D) -> Self::D;
    unsafe fn sub_d(a: Self::D, b: Self::D) -> Self::D;
    unsafe fn mul_d(a: Self::D, b: Self::D) -> Self::D;
    unsafe fn div_d(a: Self::D, b: Self::D) -> Self::D;
    /// As [`Simd::mul_add`].
    #[inline(always)]
    unsafe fn mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D {
        // SAFETY: as the caller's.
        unsafe { Self::add_d(Self::mul_d(a, b), c) }
    }
    /// As [`Simd::neg_mul_add`].
    #[inline(always)]
    unsafe fn neg_mul_add_d(a: Self::D, b: Self::D, c: Self::D) -> Self::D {
        // SAFETY: as the caller's.
        unsafe { Self::sub_d(c, Self::mul_d(a, b)) }
    }
    unsafe fn sqrt_d(a: Self::D) -> Self::D;
    unsafe fn max_d(a: Self::D, b: Self::D) -> Self::D;
    /// Bit l is `a < b` in lane l.
    unsafe fn bits_lt_d(a: Self::D, b: Self::D) -> u32;
    /// `lanes` bit l ? yes : no
    unsafe fn select_bits_d(lanes: u32, yes: Self::D, no: Self::D) -> Self::D;
    /// f32 to f64.
    unsafe fn widen(a: Self::F) -> Self::D;
    /// f64 to f32.
    unsafe fn narrow(a: Self::D) -> Self::F;

    /// The first, second and third of each four floats, `step` bytes from one lane's to the next one's.
    unsafe fn load_points(first: *const f32, step: usize) -> [Self::F; 3];
    /// Stores the first three fields of every lane side by side, `step` bytes after those of the lane before, and the
    /// fourth `place` floats after the first, 3 to 7, or not at all if that is 0. Nothing else is written.
    unsafe fn store_points(fields: [Self::F; 4], place: usize, first: *mut f32, step: usize);

    /// `mask ? yes : no`
    #[inline(always)]
    unsafe fn select(mask: Self::F, yes: Self::F, no: Self::F) -> Self::F {
        // SAFETY: as the caller's.
        unsafe { Self::or(Self::and(mask, yes), Self::and_not(mask, no)) }
    }

    #[inline(always)]
    unsafe fn abs(a: Self::F) -> Self::F {
        // SAFETY: as the caller's.
        unsafe { Self::and_not(Self::splat(-0.0), a) }
    }

    /// The mask of finite lanes.
    #[inline(always)]
    unsafe fn finite(a: Self::F) -> Self::F {
        // SAFETY: as the caller's.
        unsafe { Self::lt(Self::abs(a), Self::splat(f32::INFINITY)) }
    }

    /// Whole numbers towards zero; of what is none of i32, NaN too, any number.
    #[inline(always)]
    unsafe fn truncate(a: Self::F) -> Self::F {
        // SAFETY: as the caller's.
        unsafe { Self::float_i(Self::truncate_i(a)) }
    }

    /// The mask whose lane l is bit l.
    #[inline(always)]
    unsafe fn mask(bits: u32) -> Self::F {
        const { assert!(Self::LANES == GROUP) };
        // SAFETY: as the caller's; a load of a whole group.
        unsafe { Self::load(MASKS[(bits & 0xff) as usize].0.as_ptr()) }
    }
}

/// Lanes that pixels of a row side by side are in, and what goes along the row.
///
/// # Safety
/// As [`Simd`].
pub(crate) trait Along: Simd {
    /// Four lanes from the first place, four from the next, and so on.
    unsafe fn load_fours(place: impl Fn(usize) -> *const f32) -> Self::F;
    /// Stores four lanes to the first place, four to the next, and so on.
    unsafe fn store_fours(value: Self::F, place: impl Fn(usize) -> *mut f32);
    /// Lane i of row j becomes lane j of row i, among each four lanes.
    unsafe fn transpose_fours(rows: [Self::F; 4]) -> [Self::F; 4];

    /// Lane l of row i becomes number 8 l + i from `to` on.
    unsafe fn store_by_lanes(rows: [Self::I; 8], to: *mut i32);

    /// Lane l becomes the sum of lanes 0 to l.
    unsafe fn prefix_sum_i(a: Self::I) -> Self::I;
    /// Every lane takes the value of the last one.
    unsafe fn last_i(a: Self::I) -> Self::I;

    /// The prefix sums, going on from `carry`, which becomes the last one: it waits for one addition only, not for
    /// the prefix sums.
    #[inline(always)]
    unsafe fn running_sum_i(a: Self::I, carry: &mut Self::I) -> Self::I {
        // SAFETY: as the caller's.
        unsafe {
            let sum = Self::prefix_sum_i(a);
            let running = Self::add_i(sum, *carry);
            *carry = Self::add_i(Self::last_i(sum), *carry);
            running
        }
    }
}

/// Four floats for each lane from its place on: the first ones, the second ones and so on.
///
/// # Safety
/// As [`Simd`].
#[inline(always)]
pub(crate) unsafe fn load_by_fours<S: Along>(place: impl Fn(usize) -> *const f32) -> [S::F; 4] {
    // SAFETY: as the caller's.
    unsafe {
        S::transpose_fours([
            S::load_fours(|four| place(4 * four)),
            S::load_fours(|four| place(4 * four + 1)),
            S::load_fours(|four| place(4 * four + 2)),
            S::load_fours(|four| place(4 * four + 3)),
        ])
    }
}

/// [`Simd::load_points`]
///
/// # Safety
/// As [`Simd`].
#[inline(always)]
unsafe fn load_points_by_fours<S: Along>(first: *const f32, step: usize) -> [S::F; 3] {
    // SAFETY: as the caller's.
    unsafe {
        let [x, y, z, _] = load_by_fours::<S>(|lane| first.byte_add(lane * step));
        [x, y, z]
    }
}

/// [`Simd::store_points`]
///
/// # Safety
/// As [`Simd`].
#[inline(always)]
unsafe fn store_points_by_lanes<S: Simd>(
    fields: [S::F; 4],
    place: usize,
    first: *mut f32,
    step: usize,
) {
    const { assert!(S::LANES == GROUP) };
    let mut lanes = [[0.0; GROUP]; 4];
    // SAFETY: as the caller's; the arrays hold so many lanes.
    unsafe {
        for (to, field) in lanes.iter_mut().zip(fields) {
            S::store(to.as_mut_ptr(), field);
        }
        let [x, y, z, fourth] = lanes;
        for lane in 0..GROUP {
            let to = first.byte_add(lane * step);
            to.cast::<[f32; 3]>().write([x[lane], y[lane], z[lane]]);
            if place > 0 {
                to.add(place).write(fourth[lane]);
            }
        }
    }
}

/// Groups of eight lanes, and what is done with them alone.
///
/// # Safety
/// As [`Simd`].
pub(crate) trait Groups: Along {
    /// Two groups side by side, the first one's lanes first: in wider registers, if there are any, else [`Twice`] as
    /// many operations that do not wait for one another.
    ///
    /// [`Twice`]: twice::Twice
    type Pair: Simd;
    /// As many lanes as a register of floats has, but no fewer than a group.
    type Widest: Along;

    /// As [`Along::load_fours`].
    unsafe fn load_fours_d(place: impl Fn(usize) -> *const f64) -> Self::D;
    /// Stores the first four lanes to the first place, and the last four to the next one.
    unsafe fn store_fours_d(value: Self::D, place: impl Fn(usize) -> *mut f64);
    /// As [`Along::transpose_fours`].
    unsafe fn transpose_fours_d(rows: [Self::D; 4]) -> [Self::D; 4];

    /// The lower halves of both, and the upper halves.
    unsafe fn join_halves_d(a: Self::D, b: Self::D) -> [Self::D; 2];

    /// Two lanes from each of four places.
    unsafe fn load_pairs_d(place: impl Fn(usize) -> *const f64) -> Self::D;
    /// Pairs of the lanes of both: the first four, and the last four.
    unsafe fn pair_d(a: Self::D, b: Self::D) -> [Self::D; 2];
    /// Undoes [`Groups::pair_d`].
    unsafe fn unpair_d(first: Self::D, last: Self::D) -> [Self::D; 2];

    /// Lane i of row j becomes lane j of row i.
    #[inline(always)]
    unsafe fn transpose_d([a, b, c, d, e, f, g, h]: [Self::D; 8]) -> [Self::D; 8] {
        // SAFETY: as the caller's.
        unsafe {
            let first = Self::transpose_fours_d([a, b, c, d]);
            let second = Self::transpose_fours_d([e, f, g, h]);
            let [a, e] = Self::join_halves_d(first[0], second[0]);
            let [b, f] = Self::join_halves_d(first[1], second[1]);
            let [c, g] = Self::join_halves_d(first[2], second[2]);
            let [d, h] = Self::join_halves_d(first[3], second[3]);
            [a, b, c, d, e, f, g, h]
        }
    }

    /// As [`Along::prefix_sum_i`].
    unsafe fn prefix_sum_d(a: Self::D) -> Self::D;
    /// As [`Along::last_i`].
    unsafe fn last_d(a: Self::D) -> Self::D;

    /// As [`Along::running_sum_i`].
    #[inline(always)]
    unsafe fn running_sum_d(a: Self::D, carry: &mut Self::D) -> Self::D {
        // SAFETY: as the caller's.
        unsafe {
            let sum = Self::prefix_sum_d(a);
            let running = Self::add_d(sum, *carry);
            *carry = Self::add_d(Self::last_d(sum), *carry);
            running
        }
    }
}

#[repr(C, align(32))]
struct LaneMask([f32; GROUP]);

/// The mask of every set of lanes.
static MASKS: [LaneMask; 1 << GROUP] = {
    let mut masks = [const { LaneMask([0.0; GROUP]) }; 1 << GROUP];
    let mut bits = 0;
    while bits < 1 << GROUP {
        let mut lane = 0;
        while lane < GROUP {
            masks[bits].0[lane] = f32::from_bits(if bits >> lane & 1 != 0 { !0 } else { 0 });
            lane += 1;
        }
        bits += 1;
    }
    masks
};
