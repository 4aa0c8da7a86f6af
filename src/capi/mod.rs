//! The C boundary and nothing else: it checks what C may get wrong, and calls the safe core.
//!
//! The header `include/iine/iine.h` is generated from these files; a test regenerates and compares it.

mod boundary;
mod estimator;
mod options;
mod status;
mod types;
mod version;
