//! Memory that starts with a cache line, as a `Vec` of floats need not: aligned groups then lie in one line each, and
//! so do the fours of channels of the paper's sums.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use crate::Error;
use crate::cache::LINE;
use crate::memory::{bytes, resize};

#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line([u8; LINE]);

/// Numbers and arrays of them.
///
/// # Safety
/// All bytes zero are a value, there is no padding, and a line is aligned for it.
pub(crate) unsafe trait Number: Copy {}

// SAFETY: as all numbers.
unsafe impl Number for f32 {}
// SAFETY: as all numbers.
unsafe impl Number for f64 {}
// SAFETY: as all numbers.
unsafe impl Number for i32 {}
// SAFETY: as all numbers.
unsafe impl Number for u32 {}
// SAFETY: arrays have no padding.
unsafe impl<T: Number, const N: usize> Number for [T; N] {}

/// A slice that grows and is kept from frame to frame; zeros at first.
#[derive(Debug)]
pub(crate) struct Buffer<T> {
    lines: Vec<Line>,
    elements: PhantomData<T>,
}

impl<T> Default for Buffer<T> {
    fn default() -> Self {
        Buffer { lines: Vec::new(), elements: PhantomData }
    }
}

impl<T: Number> Buffer<T> {
    /// Makes room for so many elements without touching those there are.
    pub fn grow(&mut self, length: usize) -> Result<(), Error> {
        let bytes = length.checked_mul(size_of::<T>()).ok_or(Error::OutOfMemory)?;
        let lines = bytes.div_ceil(LINE).max(self.lines.len());
        resize(&mut self.lines, lines, Line([0; LINE]))
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        bytes(&self.lines)
    }
}

impl<T: Number> Deref for Buffer<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        let length = self.lines.len() * LINE / size_of::<T>();
        // SAFETY: the lines are aligned for numbers, hold so many, and all bytes were written.
        unsafe { std::slice::from_raw_parts(self.lines.as_ptr().cast(), length) }
    }
}

impl<T: Number> DerefMut for Buffer<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        let length = self.lines.len() * LINE / size_of::<T>();
        // SAFETY: as above; any bytes that numbers write are bytes.
        unsafe { std::slice::from_raw_parts_mut(self.lines.as_mut_ptr().cast(), length) }
    }
}
