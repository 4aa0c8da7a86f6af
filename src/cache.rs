//! Cache lines that are asked for before they are needed: the hardware does not see them coming where rows are read in
//! pieces, and stores to normals, so far apart, would wait for their lines one by one. On x86-64 alone.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{_MM_HINT_ET0, _MM_HINT_T0, _MM_HINT_T1, _mm_prefetch};

/// Bytes of a cache line.
pub(crate) const LINE: usize = 64;

/// The level of the cache that lines are asked for to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    /// Those that will be written as the core's own.
    First,
    /// More lines can be on their way there at a time, and what asks for one more waits.
    Second,
}

impl Level {
    /// The level that this processor is faster with: the second for AMD's before Zen 5, which alone have SSE4a but not
    /// AVX-VNNI.
    pub fn best() -> Level {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("sse4a") && !is_x86_feature_detected!("avxvnni") {
            return Level::Second;
        }
        Level::First
    }

    /// Asks for the lines of so many points, which are `step` bytes apart: of points larger than a line, for those that
    /// they start in.
    #[inline(always)]
    pub fn read(self, first: *const f32, count: usize, step: usize) {
        #[cfg(target_arch = "x86_64")]
        match self {
            Level::First => read::<_MM_HINT_T0>(first, count, step),
            Level::Second => read::<_MM_HINT_T1>(first, count, step),
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = (first, count, step);
    }

    /// Asks for the lines of so many normals, which will be written and are `step` bytes apart: a line for every two,
    /// as `pcl::Normal` has them, or if they are larger, for every one.
    #[inline(always)]
    pub fn write(self, first: *const f32, count: usize, step: usize) {
        #[cfg(target_arch = "x86_64")]
        match self {
            Level::First => write::<_MM_HINT_ET0>(first, count, step),
            Level::Second => write::<_MM_HINT_T1>(first, count, step),
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = (first, count, step);
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn read<const HINT: i32>(first: *const f32, count: usize, step: usize) {
    if step == LINE / 4 {
        // As below, but without a loop where the count is known.
        (0..count.div_ceil(4)).for_each(|line| ask::<HINT>(first, line * LINE));
    } else {
        let mut at = 0;
        while at < count * step {
            ask::<HINT>(first, at);
            at += LINE.max(step);
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn write<const HINT: i32>(first: *const f32, count: usize, step: usize) {
    (0..count).step_by(2).for_each(|normal| ask::<HINT>(first, normal.wrapping_mul(step)));
    if step > LINE / 2 {
        (1..count).step_by(2).for_each(|normal| ask::<HINT>(first, normal.wrapping_mul(step)));
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn ask<const HINT: i32>(first: *const f32, bytes: usize) {
    // SAFETY: a prefetch reads and writes nothing, whatever the address.
    unsafe { _mm_prefetch::<HINT>(first.wrapping_byte_add(bytes).cast()) }
}
