//! What the normals of a run of pixels are made from, in memory between one step and the next.
//!
//! A normal is a chain of operations each of which waits for the one before. A processor looks ahead a few hundred
//! operations only: it works at several pixels' chains at a time if each step is made for all of them before the next.

use super::arithmetic::{Doubles, Floats};
use super::lanes::LANES;
use crate::simd::Simd;

/// Pixels in a run at most: more than a processor works at, and little enough for its first-level cache.
pub(crate) const RUN: usize = 4 * LANES;

/// So many numbers for each pixel of a run.
#[repr(C, align(64))]
pub(crate) struct OfRun<T, const N: usize>([[T; RUN]; N]);

impl<T: Copy + Default, const N: usize> Default for OfRun<T, N> {
    fn default() -> Self {
        OfRun([[T::default(); RUN]; N])
    }
}

macro_rules! numbers {
    ($($type:ident, $lanes:ty, $value:ident => $inner:expr, $from:ident => $wrap:expr, $splat:expr, $load:ident, $store:ident;)*) => {
        $(impl<const N: usize> OfRun<$type, N> {
            /// Those of the pixels from `at` on.
            ///
            /// # Safety
            /// The processor has the instruction set of `S`.
            #[inline(always)]
            pub unsafe fn load<S: Simd>(&self, at: usize) -> [$lanes; N] {
                assert!(at + S::LANES <= RUN);
                // SAFETY: as the caller's; the pixels are in the run, as was just checked.
                unsafe {
                    let mut values = [$splat; N];
                    for c in 0..N {
                        let $from = S::$load(self.0[c].as_ptr().add(at));
                        values[c] = $wrap;
                    }
                    values
                }
            }

            /// As [`OfRun::load`].
            #[inline(always)]
            pub unsafe fn store<S: Simd>(&mut self, at: usize, values: [$lanes; N]) {
                assert!(at + S::LANES <= RUN);
                // SAFETY: as the caller's; the pixels are in the run, as was just checked.
                unsafe {
                    for c in 0..N {
                        let $value = values[c];
                        S::$store(self.0[c].as_mut_ptr().add(at), $inner);
                    }
                }
            }
        })*
    };
}

numbers! {
    f32, Floats<S>, value => value.0, lanes => Floats(lanes), Floats::splat(0.0), load, store;
    f64, Doubles<S>, value => value.0, lanes => Doubles(lanes), Doubles::splat(0.0), load_d, store_d;
    i32, S::I, value => value, lanes => lanes, S::splat_i(0), load_i, store_i;
}
