//! The one place where panics stop and pointers from C become references.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::status::IINE_OK;
use crate::Error;

/// Runs the body of an exported function: no panic leaves it, and its outcome becomes a status.
pub(super) fn guard(body: impl FnOnce() -> Result<(), Error>) -> i32 {
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => IINE_OK,
        Ok(Err(error)) => error as i32,
        Err(_) => Error::Internal as i32,
    }
}

/// # Safety
/// `pointer` is NULL or valid for reads for `'a`, and nobody writes to it meanwhile.
pub(super) unsafe fn reference<'a, T>(pointer: *const T) -> Result<&'a T, Error> {
    check(pointer)?;
    // SAFETY: promised by the caller; NULL and misaligned pointers were refused.
    Ok(unsafe { &*pointer })
}

/// # Safety
/// `pointer` is NULL or valid for reads and writes for `'a`, and nobody else uses it meanwhile.
pub(super) unsafe fn reference_mut<'a, T>(pointer: *mut T) -> Result<&'a mut T, Error> {
    check(pointer)?;
    // SAFETY: promised by the caller; NULL and misaligned pointers were refused.
    Ok(unsafe { &mut *pointer })
}

/// # Safety
/// `pointer` is NULL or valid for one write.
pub(super) unsafe fn write<T>(pointer: *mut T, value: T) -> Result<(), Error> {
    check(pointer)?;
    // SAFETY: promised by the caller; NULL and misaligned pointers were refused.
    unsafe { pointer.write(value) };
    Ok(())
}

/// Refuses NULL, and a pointer that is not aligned to its type.
pub(super) fn check<T>(pointer: *const T) -> Result<(), Error> {
    if pointer.is_null() {
        return Err(Error::NullPointer);
    }
    if pointer.is_aligned() { Ok(()) } else { Err(Error::Misaligned) }
}

/// Reads a struct whose first field is its size in the caller's version of the header; fields that the caller
/// does not know of read as zero.
///
/// # Safety
/// `pointer` is NULL, or points to a `usize` followed by as many bytes as that number, itself included, says.
pub(super) unsafe fn read_sized<T: Copy>(pointer: *const T, sizes: &[usize]) -> Result<T, Error> {
    check(pointer)?;
    // SAFETY: the struct starts with its size, and the pointer is neither NULL nor misaligned.
    let size = unsafe { pointer.cast::<usize>().read() };
    if !sizes.contains(&size) {
        return Err(Error::StructSize);
    }
    let mut value = std::mem::MaybeUninit::<T>::zeroed();
    // SAFETY: `size` bytes are readable as the caller promises, and not more than `T` has as `sizes` says; all
    // structs read here consist of integers and pointers, for which zero bits are a value.
    unsafe {
        std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), value.as_mut_ptr().cast::<u8>(), size);
        Ok(value.assume_init())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_become_statuses() {
        assert_eq!(guard(|| Ok(())), IINE_OK);
        assert_eq!(guard(|| Err(Error::Overlap)), Error::Overlap as i32);
        assert_eq!(guard(|| panic!("on purpose")), Error::Internal as i32);
    }
}
