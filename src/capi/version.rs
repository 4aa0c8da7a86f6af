//! Version, and the instruction set in use.

use std::ffi::c_char;

/// The version of this header: major part.
pub const IINE_VERSION_MAJOR: u32 = 0;
/// The version of this header: minor part.
pub const IINE_VERSION_MINOR: u32 = 1;
/// The version of this header: patch part.
pub const IINE_VERSION_PATCH: u32 = 0;

const NUMBER: u32 = IINE_VERSION_MAJOR * 10_000 + IINE_VERSION_MINOR * 100 + IINE_VERSION_PATCH;

/// The version of the library in use, as `IINE_VERSION_NUMBER`: major * 10000 + minor * 100 + patch.
#[unsafe(no_mangle)]
pub extern "C" fn iine_version_number() -> u32 {
    NUMBER
}

/// The version of the library in use, as text: "major.minor.patch"; static.
#[unsafe(no_mangle)]
pub extern "C" fn iine_version_string() -> *const c_char {
    const TEXT: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    TEXT.as_ptr().cast()
}

/// The name of the instruction set in use: "avx512", "avx2", "sse2", "neon", "portable" or "scalar"; static.
///
/// The best one that the processor has is chosen at the first use. The environment variable `IINE_ISA`, read at
/// the first use, forces it down to one of these names; any other, and what the processor lacks, is ignored.
#[unsafe(no_mangle)]
pub extern "C" fn iine_isa_name() -> *const c_char {
    crate::Isa::active().c_name().as_ptr()
}
