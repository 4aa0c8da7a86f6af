//! Status numbers and their text.

use std::ffi::c_char;

use crate::Error;

// The header's numbers are the core's.
const _: () = assert!(
    IINE_ERROR_NULL_POINTER == Error::NullPointer as i32
        && IINE_ERROR_STRUCT_SIZE == Error::StructSize as i32
        && IINE_ERROR_SIZE == Error::Size as i32
        && IINE_ERROR_STRIDE == Error::Stride as i32
        && IINE_ERROR_MISALIGNED == Error::Misaligned as i32
        && IINE_ERROR_OVERLAP == Error::Overlap as i32
        && IINE_ERROR_OPTION_VALUE == Error::OptionValue as i32
        && IINE_ERROR_UNSUPPORTED == Error::Unsupported as i32
        && IINE_ERROR_INDEX == Error::Index as i32
        && IINE_ERROR_OUT_OF_MEMORY == Error::OutOfMemory as i32
        && IINE_ERROR_THREADS == Error::Threads as i32
        && IINE_ERROR_INTERNAL == Error::Internal as i32
);

/// Success.
pub const IINE_OK: i32 = 0;
/// A required pointer is NULL.
pub const IINE_ERROR_NULL_POINTER: i32 = 1;
/// A struct's `struct_size` is not one that this library's version or an earlier one defines.
pub const IINE_ERROR_STRUCT_SIZE: i32 = 2;
/// A width or height is zero, their product or a count above INT32_MAX, or the buffer does not fit the address space.
pub const IINE_ERROR_SIZE: i32 = 3;
/// A stride is not a multiple of 4 bytes, or too small for what it steps over.
pub const IINE_ERROR_STRIDE: i32 = 4;
/// A pointer is not aligned to its type.
pub const IINE_ERROR_MISALIGNED: i32 = 5;
/// Output bytes overlap input bytes or other output bytes, or lie among them with other strides, so that they may:
/// `docs/c-api.md` says which are told apart.
pub const IINE_ERROR_OVERLAP: i32 = 6;
/// An option's value is outside its range, or an enum's number is unknown.
pub const IINE_ERROR_OPTION_VALUE: i32 = 7;
/// Options or maps that do not go together: the functions say which.
pub const IINE_ERROR_UNSUPPORTED: i32 = 8;
/// An index is negative or not below width x height.
pub const IINE_ERROR_INDEX: i32 = 9;
/// Memory could not be allocated. Normals are not written then, or NaN everywhere where depths in the middle of a frame
/// turn out to need more memory than there is.
pub const IINE_ERROR_OUT_OF_MEMORY: i32 = 10;
/// The worker threads asked for could not be started.
pub const IINE_ERROR_THREADS: i32 = 11;
/// A defect of this library was caught at its boundary, possibly after something was written.
pub const IINE_ERROR_INTERNAL: i32 = 12;

/// The text of a status: static, never NULL, for any number.
#[unsafe(no_mangle)]
pub extern "C" fn iine_status_string(status: i32) -> *const c_char {
    let text = match Error::ALL.iter().find(|error| **error as i32 == status) {
        Some(error) => error.c_message(),
        None if status == IINE_OK => c"ok",
        None => c"unknown status",
    };
    text.as_ptr()
}
