//! The outermost functions, each compiled for its instruction set.

use crate::isa::Isa;
use crate::simd::{Baseline, Groups};
#[cfg(target_arch = "x86_64")]
use crate::simd::{avx512::Avx512, x86::Avx2};

/// Work that is compiled for every instruction set; `run` is `#[inline(always)]`.
pub(super) trait Task {
    type Output;

    /// # Safety
    /// The processor has the instruction set of `S`, and what the task asks for.
    unsafe fn run<S: Groups>(self) -> Self::Output;
}

macro_rules! path {
    ($name:ident, $groups:ty $(, $feature:literal)?) => {
        /// # Safety
        /// The processor has this instruction set, and what the task asks for.
        $(#[target_feature(enable = $feature)])?
        unsafe fn $name<T: Task>(task: T) -> T::Output {
            // SAFETY: as the caller's.
            unsafe { task.run::<$groups>() }
        }
    };
}

path!(baseline, Baseline);
#[cfg(target_arch = "x86_64")]
path!(avx2, Avx2, "avx2,fma");
#[cfg(target_arch = "x86_64")]
path!(avx512, Avx512, "avx2,fma,avx512f,avx512vl,avx512dq,avx512bw");

/// # Safety
/// The processor has the instruction set, and what the task asks for.
pub(super) unsafe fn run<T: Task>(isa: Isa, task: T) -> T::Output {
    // SAFETY: as the caller's.
    unsafe {
        match isa {
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => avx512(task),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => avx2(task),
            _ => baseline(task),
        }
    }
}
