//! Operators for groups and pairs of groups, so that formulas read as formulas.
//!
//! Values exist only where the processor has the instruction set of `S`: they are made from groups of `S`, in functions
//! whose callers promise it.

use std::ops::{Add, Div, Mul, Sub};

use super::lanes::{LANES, Lanes};
use crate::simd::Simd;

/// As many f32 as there are lanes.
pub(crate) struct Floats<S: Simd>(pub S::F);

/// As many f64 as there are lanes.
pub(crate) struct Doubles<S: Simd>(pub S::D);

/// As many i32 as there are lanes; sums wrap around.
pub(crate) struct Integers<S: Simd>(pub S::I);

macro_rules! operators {
    ($type:ident, $($trait:ident, $method:ident, $function:ident;)*) => {
        impl<S: Simd> Clone for $type<S> {
            #[inline(always)]
            fn clone(&self) -> Self {
                *self
            }
        }
        impl<S: Simd> Copy for $type<S> {}
        $(impl<S: Simd> $trait for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: there is a group, so there is the instruction set.
                $type(unsafe { S::$function(self.0, other.0) })
            }
        })*
    };
}

operators!(Floats, Add, add, add; Sub, sub, sub; Mul, mul, mul; Div, div, div;);
operators!(Doubles, Add, add, add_d; Sub, sub, sub_d; Mul, mul, mul_d; Div, div, div_d;);
operators!(Integers, Add, add, add_i; Sub, sub, sub_i;);

macro_rules! products {
    ($($type:ident, $mul_add:ident, $neg_mul_add:ident;)*) => {
        $(impl<S: Simd> $type<S> {
            /// `self + a * b`, rounded once where the instruction set can.
            #[inline(always)]
            pub fn plus(self, a: Self, b: Self) -> Self {
                // SAFETY: there is a group, so there is the instruction set.
                $type(unsafe { S::$mul_add(a.0, b.0, self.0) })
            }

            /// `self - a * b`, likewise.
            #[inline(always)]
            pub fn minus(self, a: Self, b: Self) -> Self {
                // SAFETY: there is a group, so there is the instruction set.
                $type(unsafe { S::$neg_mul_add(a.0, b.0, self.0) })
            }
        })*
    };
}

products! {
    Floats, mul_add, neg_mul_add;
    Doubles, mul_add_d, neg_mul_add_d;
}

/// What lies between a window's corners, above and below, each left and right, where integral rows hold what `at` says.
#[inline(always)]
pub(crate) fn between<C, T: Sub<Output = T>>(corners: [[C; 2]; 2], at: impl Fn(C) -> T) -> T {
    let [[above_left, above_right], [below_left, below_right]] = corners;
    (at(below_right) - at(below_left)) - (at(above_right) - at(above_left))
}

impl<S: Simd> Floats<S> {
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn splat(value: f32) -> Self {
        // SAFETY: as the caller's.
        Floats(unsafe { S::splat(value) })
    }

    /// The least lane; none is NaN.
    #[inline(always)]
    pub fn least(self) -> f32 {
        self.lanes(f32::INFINITY).least()
    }

    /// The largest lane; none is NaN.
    #[inline(always)]
    pub fn largest(self) -> f32 {
        self.lanes(f32::NEG_INFINITY).largest()
    }

    /// The lanes, and `rest` in place of those that `S` does not have.
    #[inline(always)]
    fn lanes(self, rest: f32) -> Lanes {
        const { assert!(S::LANES <= LANES) };
        let mut lanes = Lanes([rest; LANES]);
        // SAFETY: there is a group, so there is the instruction set; its lanes fit.
        unsafe { S::store(lanes.0.as_mut_ptr(), self.0) };
        lanes
    }

    /// A whole number up to 2^24: floats hold it.
    ///
    /// # Safety
    /// As [`Floats::splat`].
    #[inline(always)]
    pub unsafe fn whole(value: usize) -> Self {
        // One instruction, unlike from other integers. SAFETY: as the caller's.
        unsafe { Self::splat(value as i32 as f32) }
    }

    /// # Safety
    /// The processor has the instruction set of `S`; there are so many floats.
    #[inline(always)]
    pub unsafe fn load(from: *const f32) -> Self {
        // SAFETY: as the caller's.
        Floats(unsafe { S::load(from) })
    }

    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        // SAFETY: there is a group, so there is the instruction set.
        Floats(unsafe { S::min(self.0, other.0) })
    }

    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        // SAFETY: there is a group, so there is the instruction set.
        Floats(unsafe { S::max(self.0, other.0) })
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        // SAFETY: there is a group, so there is the instruction set.
        Floats(unsafe { S::abs(self.0) })
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        // SAFETY: there is a group, so there is the instruction set.
        Floats(unsafe { S::sqrt(self.0) })
    }

    /// Takes another's lanes of a mask.
    #[inline(always)]
    pub fn take(&mut self, mask: S::F, other: Self) {
        // SAFETY: there is a group, so there is the instruction set.
        self.0 = unsafe { S::select(mask, other.0, self.0) };
    }

    /// Takes another's of some lanes.
    #[inline(always)]
    pub fn take_lanes(&mut self, lanes: u32, other: Self) {
        // SAFETY: there is a group, so there is the instruction set.
        self.take(unsafe { S::mask(lanes) }, other);
    }

    /// Bit l is `self < other` in lane l.
    #[inline(always)]
    pub fn lt(self, other: Self) -> u32 {
        // SAFETY: there is a group, so there is the instruction set.
        unsafe { S::bits(S::lt(self.0, other.0)) }
    }

    #[inline(always)]
    pub fn widen(self) -> Doubles<S> {
        // SAFETY: there is a group, so there is the instruction set.
        Doubles(unsafe { S::widen(self.0) })
    }
}

impl<S: Simd> Doubles<S> {
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn splat(value: f64) -> Self {
        // SAFETY: as the caller's.
        Doubles(unsafe { S::splat_d(value) })
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        // SAFETY: there is a group, so there is the instruction set.
        Doubles(unsafe { S::sqrt_d(self.0) })
    }

    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        // SAFETY: there is a group, so there is the instruction set.
        Doubles(unsafe { S::max_d(self.0, other.0) })
    }

    /// Takes another's of some lanes.
    #[inline(always)]
    pub fn take_lanes(&mut self, lanes: u32, other: Self) {
        // SAFETY: there is a group, so there is the instruction set.
        self.0 = unsafe { S::select_bits_d(lanes, other.0, self.0) };
    }

    /// Bit l is `self < other` in lane l.
    #[inline(always)]
    pub fn lt(self, other: Self) -> u32 {
        // SAFETY: there is a group, so there is the instruction set.
        unsafe { S::bits_lt_d(self.0, other.0) }
    }

    #[inline(always)]
    pub fn narrow(self) -> Floats<S> {
        // SAFETY: there is a group, so there is the instruction set.
        Floats(unsafe { S::narrow(self.0) })
    }
}

impl<S: Simd> Integers<S> {
    #[inline(always)]
    pub fn float(self) -> Floats<S> {
        // SAFETY: there is a group, so there is the instruction set.
        Floats(unsafe { S::float_i(self.0) })
    }
}
