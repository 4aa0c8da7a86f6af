//! What the two gradient methods have in common: coordinates as integers, and normals from two gradients.
//!
//! The integers are multiples of a power of two: their sums are exact whatever wraps around between, as long as the
//! differences fit, and the limit on the coordinates sees to that.

use super::arithmetic::{Floats, cross, dot};
use super::tile::Found;
use crate::simd::Simd;

/// How coordinates become integers.
#[derive(Debug, Default)]
pub(crate) struct Scale {
    origin: [f32; 3],
    scale: f32,
    /// What rounding to integers moves the sums over a window of side 1 by at most, over [`DOUBT`].
    doubt: f32,
}

/// A normal is doubtful where rounding to integers could turn it by more than this, or where floats could: (sine of the
/// angle between the tangents) < 1e-3.
const DOUBT: f32 = 1.5e-4;
const DOUBT_SINE: f32 = 1e-6;

impl Scale {
    /// For windows of up to `side`, sums of up to `strips` times as many coordinates, none of which is farther than
    /// `limit` from the origin.
    pub fn new(strips: usize, limit: f32, side: usize, origin: [f32; 3]) -> Self {
        // strips side limit scale < 2^31, and a power of two: one exactly as large will not do.
        let mut bits = 31.0 - (f64::from(limit) * (strips * side) as f64).log2();
        // Equal coordinates, as of a sensor with depth steps, are all rounded alike.
        let mut doubt = 0.5 * strips as f32 / DOUBT;
        if origin != [0.0; 3] {
            // The way from there is rounded to a float first: for limit scale < 2^25 that at most doubles the error.
            bits = bits.min(25.0 - f64::from(limit).log2());
            doubt *= 2.0;
        }
        Scale { origin, scale: (bits.ceil() - 1.0).clamp(-120.0, 120.0).exp2() as f32, doubt }
    }

    /// Coordinates `c`, as integers.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn integers<S: Simd>(&self, c: usize, coordinates: S::F) -> S::I {
        // SAFETY: as the caller's.
        unsafe {
            let from_origin = S::sub(coordinates, S::splat(self.origin[c]));
            S::round_i(S::mul(from_origin, S::splat(self.scale)))
        }
    }

    /// The normals to sums of horizontal and of vertical gradients, over windows of these sides.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn normals<S: Simd>(
        &self,
        h: [Floats<S>; 3],
        v: [Floats<S>; 3],
        sides: S::F,
    ) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe {
            let n = cross(v, h);
            let (n2, h2, v2) = (dot(n, n), dot(h, h), dot(v, v));
            let doubt = Floats(sides) * Floats::splat(self.doubt);
            let rounding = doubt * doubt * (h2 + v2);
            let sine = h2 * v2 * Floats::splat(DOUBT_SINE);
            let scale = Floats::splat(1.0) / n2.sqrt();
            Found {
                normal: [n[0] * scale, n[1] * scale, n[2] * scale],
                curvature: Floats::splat(f32::NAN),
                doubtful: !rounding.max(sine).lt(n2),
            }
        }
    }
}
