//! What can be wrong with a request.

use std::fmt;

/// Why a request was refused. Nothing has been written when one of these is returned (but see [`Error::OutOfMemory`]
/// and [`Error::Internal`]).
///
/// The discriminants are the status numbers of the C API; they are never reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum Error {
    /// A required pointer is NULL.
    NullPointer = 1,
    /// A struct's `struct_size` field is not one that this or an earlier version defines.
    StructSize = 2,
    /// A width or height is zero, their product above `i32::MAX`, or the buffer they describe does not fit the address space
    /// or the slice given; or the sizes of points, normals or maps differ.
    Size = 3,
    /// A stride is not a multiple of 4 bytes, or too small for what it steps over.
    Stride = 4,
    /// A pointer is not aligned to its type.
    Misaligned = 5,
    /// Output bytes overlap input bytes or other output bytes, or lie among them with other strides, so that they may.
    Overlap = 6,
    /// An option's value is outside its range, or an enum's number is unknown.
    OptionValue = 7,
    /// Options or maps that do not go together: `Simple3DGradient` with `Mirror` or with the paper's semantics, depth
    /// radii without the paper's semantics, eigenvalues without `CovarianceMatrix`.
    Unsupported = 8,
    /// An index is negative or not below width x height.
    Index = 9,
    /// Memory could not be allocated; where some bytes are missing to start threads or hand them work, or for the second pass
    /// over less than three columns or rows, the process may be aborted instead. Nothing is written then, or NaN everywhere
    /// where depths in the middle of a frame turn out to need more memory than there is.
    OutOfMemory = 10,
    /// The worker threads asked for could not be started.
    Threads = 11,
    /// A defect of this library was caught at its boundary, possibly after something was written; please report it.
    Internal = 12,
}

impl Error {
    /// Every error, in the order of the numbers.
    pub const ALL: [Error; 12] = [
        Error::NullPointer,
        Error::StructSize,
        Error::Size,
        Error::Stride,
        Error::Misaligned,
        Error::Overlap,
        Error::OptionValue,
        Error::Unsupported,
        Error::Index,
        Error::OutOfMemory,
        Error::Threads,
        Error::Internal,
    ];

    /// The message, NUL-terminated for C.
    pub(crate) const fn c_message(self) -> &'static std::ffi::CStr {
        match self {
            Error::NullPointer => c"a required pointer is NULL",
            Error::StructSize => c"struct_size is not a known size of the struct",
            Error::Size => {
                c"width, height or count is zero or too large, or not that of the buffers"
            }
            Error::Stride => c"a stride is not a multiple of 4 bytes or is too small",
            Error::Misaligned => c"a pointer is not aligned to its type",
            Error::Overlap => c"output bytes overlap input bytes or other output bytes",
            Error::OptionValue => c"an option's value is outside its range",
            Error::Unsupported => c"options or maps that do not go together",
            Error::Index => c"an index is outside the cloud",
            Error::OutOfMemory => c"out of memory",
            Error::Threads => c"the worker threads could not be started",
            Error::Internal => c"internal error (a defect of this library)",
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.c_message().to_str().unwrap_or("error"))
    }
}

impl std::error::Error for Error {}
