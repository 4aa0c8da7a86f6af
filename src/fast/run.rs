//! What the normals of a run of pixels are made from, in memory between one step and the next.
//!
//! A normal is a chain of operations each of which waits for the one before. A processor looks ahead a few hundred
//! operations only: it works at several pixels' chains at a time if each step is made for all of them before the next.

use std::ops::{Add, Sub};

use super::arithmetic::{Doubles, Floats, Integers};
use super::lanes::LANES;
use crate::methods::Estimate;
use crate::simd::{Groups, Simd};

/// Pixels in a run at most: more than a processor works at, and little enough for its first-level cache.
pub(crate) const RUN: usize = 4 * LANES;

/// So many numbers for each pixel of a run.
#[repr(C, align(64))]
pub(crate) struct OfRun<T, const N: usize>([[T; RUN]; N]);

impl<T: Lane, const N: usize> Default for OfRun<T, N> {
    fn default() -> Self {
        OfRun([[T::default(); RUN]; N])
    }
}

/// Numbers that lanes hold.
pub(crate) trait Lane: Copy + Default {
    /// As many as there are lanes.
    type Of<S: Simd>: Copy + Add<Output = Self::Of<S>> + Sub<Output = Self::Of<S>>;

    /// # Safety
    /// The processor has the instruction set of `S`; there are so many numbers.
    unsafe fn load<S: Simd>(from: *const Self) -> Self::Of<S>;

    /// # Safety
    /// As [`Lane::load`].
    unsafe fn store<S: Simd>(to: *mut Self, value: Self::Of<S>);
}

impl Lane for f32 {
    type Of<S: Simd> = Floats<S>;

    #[inline(always)]
    unsafe fn load<S: Simd>(from: *const f32) -> Floats<S> {
        // SAFETY: as the caller's.
        unsafe { Floats::load(from) }
    }

    #[inline(always)]
    unsafe fn store<S: Simd>(to: *mut f32, value: Floats<S>) {
        // SAFETY: as the caller's.
        unsafe { S::store(to, value.0) };
    }
}

impl Lane for f64 {
    type Of<S: Simd> = Doubles<S>;

    #[inline(always)]
    unsafe fn load<S: Simd>(from: *const f64) -> Doubles<S> {
        // SAFETY: as the caller's.
        Doubles(unsafe { S::load_d(from) })
    }

    #[inline(always)]
    unsafe fn store<S: Simd>(to: *mut f64, value: Doubles<S>) {
        // SAFETY: as the caller's.
        unsafe { S::store_d(to, value.0) };
    }
}

impl Lane for i32 {
    type Of<S: Simd> = Integers<S>;

    #[inline(always)]
    unsafe fn load<S: Simd>(from: *const i32) -> Integers<S> {
        // SAFETY: as the caller's.
        Integers(unsafe { S::load_i(from) })
    }

    #[inline(always)]
    unsafe fn store<S: Simd>(to: *mut i32, value: Integers<S>) {
        // SAFETY: as the caller's.
        unsafe { S::store_i(to, value.0) };
    }
}

impl<T: Lane, const N: usize> OfRun<T, N> {
    /// Those of the pixel that is `at` in the run.
    pub fn of_one(&self, at: usize) -> [T; N] {
        std::array::from_fn(|c| self.0[c][at])
    }

    /// Those of the pixels from `at` on.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn load<S: Simd>(&self, at: usize) -> [T::Of<S>; N] {
        assert!(at + S::LANES <= RUN);
        // SAFETY: as the caller's; the pixels are in the run, as was just checked.
        unsafe {
            let mut values = [T::load::<S>(self.0[0].as_ptr().add(at)); N];
            for c in 1..N {
                values[c] = T::load::<S>(self.0[c].as_ptr().add(at));
            }
            values
        }
    }

    /// As [`OfRun::load`].
    #[inline(always)]
    pub unsafe fn store<S: Simd>(&mut self, at: usize, values: [T::Of<S>; N]) {
        assert!(at + S::LANES <= RUN);
        // SAFETY: as the caller's; the pixels are in the run, as was just checked.
        unsafe {
            for c in 0..N {
                T::store::<S>(self.0[c].as_mut_ptr().add(at), values[c]);
            }
        }
    }
}

/// What a method notes of a run's windows.
pub(crate) trait Noted: Default {
    /// Takes the steps towards the normals that need these notes only, for the pairs of groups from `at` on. Of each pair
    /// `lanes` have been noted; the others hold anything.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn solve<S: Groups>(&mut self, _at: usize, _lanes: &[u32]) {}

    /// Notes and solves windows of some lanes of the pair of groups from `at` on anew, without the rings' rounding; returns
    /// whether: else they are left to the plain form. What was noted of the pair before is lost. `points` gives those of a
    /// lane's window.
    ///
    /// # Safety
    /// As [`Noted::solve`].
    #[inline(always)]
    unsafe fn afresh<S: Groups, P: Iterator<Item = [f64; 3]>>(
        &mut self,
        _at: usize,
        _lanes: u32,
        _points: impl Fn(usize) -> P,
    ) -> bool {
        false
    }

    /// The estimate of the pixel that is `at`, from sums whose rounding errors stay below `error`: 0 where they are those of
    /// [`Noted::afresh`]; none if it is doubtful even so.
    fn precisely(&self, _at: usize, _error: f64) -> Option<Estimate> {
        None
    }
}

impl<T: Lane, const N: usize> Noted for OfRun<T, N> {}
