//! Which instruction set computes.

use std::ffi::CStr;
use std::sync::OnceLock;

/// An instruction set that the normals can be computed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Isa {
    /// No fast path: the plain code that specifies every result.
    Scalar,
}

impl Isa {
    /// The name, as the environment variable `IINE_ISA` takes it.
    pub fn name(self) -> &'static str {
        self.c_name().to_str().unwrap_or_default()
    }

    pub(crate) const fn c_name(self) -> &'static CStr {
        match self {
            Isa::Scalar => c"scalar",
        }
    }

    /// The one in use, chosen at the first call.
    pub fn active() -> Isa {
        static ACTIVE: OnceLock<Isa> = OnceLock::new();
        *ACTIVE.get_or_init(|| Isa::Scalar)
    }
}
