//! Which instruction set computes.

use std::ffi::CStr;
use std::sync::OnceLock;

/// An instruction set that normals can be computed with. Those that fuse a product with a sum ([`Isa::Avx2`],
/// [`Isa::Avx512`], [`Isa::Neon`]) give the same bits, and so do those that cannot ([`Isa::Portable`], [`Isa::Sse2`]).
/// [`Isa::Scalar`] is the plain code that specifies the results, and slow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Isa {
    /// The specification: walks over every window.
    Scalar,
    /// The fast path without any instruction set, on processors that have none of the others.
    Portable,
    /// SSE2, on every x86-64.
    Sse2,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 (F, VL, DQ, BW), and FMA.
    Avx512,
    /// NEON, on every 64-bit Arm.
    Neon,
}

/// That of [`Baseline`](crate::simd::Baseline).
const BASELINE: Isa = if cfg!(target_arch = "x86_64") {
    Isa::Sse2
} else if cfg!(target_arch = "aarch64") {
    Isa::Neon
} else {
    Isa::Portable
};

impl Isa {
    /// Every instruction set, the best last.
    pub const ALL: [Isa; 6] =
        [Isa::Scalar, Isa::Portable, Isa::Sse2, Isa::Avx2, Isa::Avx512, Isa::Neon];

    /// The name, as the environment variable `IINE_ISA` takes it.
    pub fn name(self) -> &'static str {
        self.c_name().to_str().unwrap_or_default()
    }

    pub(crate) const fn c_name(self) -> &'static CStr {
        match self {
            Isa::Scalar => c"scalar",
            Isa::Portable => c"portable",
            Isa::Sse2 => c"sse2",
            Isa::Avx2 => c"avx2",
            Isa::Avx512 => c"avx512",
            Isa::Neon => c"neon",
        }
    }

    /// Whether this processor has it.
    pub fn is_available(self) -> bool {
        match self {
            Isa::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => {
                is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
            }
            _ => self == BASELINE,
        }
    }

    /// The one in use, chosen at the first call: the best that the processor has, or the one that the environment
    /// variable `IINE_ISA` names, if the processor has it.
    pub fn active() -> Isa {
        static ACTIVE: OnceLock<Isa> = OnceLock::new();
        *ACTIVE.get_or_init(|| {
            let available = Isa::ALL.into_iter().filter(|isa| isa.is_available());
            let best = available.clone().next_back().unwrap_or(Isa::Scalar);
            let asked = std::env::var("IINE_ISA").ok();
            available.into_iter().find(|isa| Some(isa.name()) == asked.as_deref()).unwrap_or(best)
        })
    }
}
