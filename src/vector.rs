//! Sums, differences and products of vectors of numbers, or of lanes of them.

use std::ops::{Add, Mul, Sub};

#[inline(always)]
pub(crate) fn sum<T: Copy + Add<Output = T>, const N: usize>(mut a: [T; N], b: [T; N]) -> [T; N] {
    for i in 0..N {
        a[i] = a[i] + b[i];
    }
    a
}

#[inline(always)]
pub(crate) fn difference<T: Copy + Sub<Output = T>, const N: usize>(
    mut a: [T; N],
    b: [T; N],
) -> [T; N] {
    for i in 0..N {
        a[i] = a[i] - b[i];
    }
    a
}

#[inline(always)]
pub(crate) fn cross<T: Copy + Mul<Output = T> + Sub<Output = T>>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(crate) fn dot<T: Copy + Mul<Output = T> + Add<Output = T>>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
