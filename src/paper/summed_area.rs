//! Integral images (Eq. 1-3) of `N` channels.

use std::ops::{Add, Sub};

use super::rect::Rect;

/// Sums over every rectangle from the image's first pixel, with a row and a column of zeros before it.
pub(crate) struct SummedArea<T, const N: usize> {
    stride: usize,
    sums: Vec<[T; N]>,
}

impl<T: Copy + Default + Add<Output = T> + Sub<Output = T>, const N: usize> SummedArea<T, N> {
    /// The integral image of what `value` gives for every pixel number.
    pub fn new(width: usize, height: usize, value: impl Fn(usize) -> [T; N]) -> Self {
        let stride = width + 1;
        let mut sums = vec![[T::default(); N]; stride * (height + 1)];
        for y in 0..height {
            let mut row = [T::default(); N];
            for x in 0..width {
                let value = value(y * width + x);
                for i in 0..N {
                    row[i] = row[i] + value[i];
                    sums[(y + 1) * stride + x + 1][i] = sums[y * stride + x + 1][i] + row[i];
                }
            }
        }
        SummedArea { stride, sums }
    }

    /// The sum over a rectangle (Eq. 3, not divided).
    pub fn sum(&self, rect: &Rect) -> [T; N] {
        let at = |x, y| &self.sums[y * self.stride + x];
        let (a, b) = (at(rect.x.start, rect.y.start), at(rect.x.end, rect.y.start));
        let (c, d) = (at(rect.x.start, rect.y.end), at(rect.x.end, rect.y.end));
        // In this order unsigned sums never fall below zero.
        std::array::from_fn(|i| (d[i] - b[i]) - (c[i] - a[i]))
    }
}
