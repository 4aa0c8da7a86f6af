//! What the two gradient methods have in common: coordinates as integers, both gradients side by side, and normals from
//! them.
//!
//! The integers are multiples of a power of two: their sums are exact whatever wraps around between, as long as the
//! differences fit, and the limit on the coordinates sees to that.

use super::arithmetic::{Floats, Integers, between};
use super::estimates::Found;
use super::lanes::{Bits, LANES};
use super::pair::Pair;
use super::planes::Frame;
use super::run::{Noted, RUN};
use super::tile::Tile;
use crate::simd::{GROUP, Groups, Simd};
use crate::vector::{cross, dot};

/// x, y and z and nothing of something horizontal; and of something vertical. All of a pixel's are read at once, whatever
/// the windows of its neighbours.
pub(crate) type Both<T> = [T; GROUP];

/// Bytes from a pixel to the next.
pub(crate) const PIXEL: usize = size_of::<Both<i32>>();

/// Where the second of both begins, and the lanes of the first, of as many pixels as there are.
pub(crate) const VERTICAL: usize = 4;
pub(crate) const HORIZONTAL: u32 = 0x0f0f_0f0f;

/// Where in a ring of both a pixel is that is so many rows and columns from one of row `y`, from that one's column on: in
/// bytes, which addresses are made of at once.
pub(crate) fn place(frame: &Frame, y: usize, [row, column]: [isize; 2]) -> usize {
    let pixel = frame.start(1, y.wrapping_add_signed(row)).wrapping_add_signed(column);
    pixel.wrapping_mul(PIXEL)
}

/// The left corners of windows of a side, as [`place`] has them.
pub(crate) trait LeftCorners: Copy {
    /// Both gradients of one window or of several, as [`sum_between`].
    ///
    /// # Safety
    /// As there.
    unsafe fn gradients<S: Simd>(self, pixel: *const Both<i32>, side: usize) -> S::I;

    /// The same where the next window may have any other side: without a branch that nobody could predict.
    ///
    /// # Safety
    /// As [`sum_between`].
    #[inline(always)]
    unsafe fn gradients_of_one<S: Simd>(self, pixel: *const Both<i32>, side: usize) -> S::I {
        // SAFETY: as the caller's.
        unsafe { self.gradients::<S>(pixel, side) }
    }
}

/// What lies between left corners above and below, in bytes, and so many columns to the right: of one window or, in more
/// lanes than a group has, of several side by side. `pixel` is that of the first, in row 0 of the ring.
///
/// # Safety
/// The processor has the instruction set of `S`; the ring holds the corners.
#[inline(always)]
pub(crate) unsafe fn sum_between<S: Simd>(
    pixel: *const Both<i32>,
    [above, below]: [usize; 2],
    columns: usize,
) -> S::I {
    // SAFETY: as the caller's.
    unsafe {
        let at = |corner: usize| Integers::<S>(S::load_i(pixel.wrapping_byte_add(corner).cast()));
        between([above, below].map(|left| [left, left.wrapping_add(PIXEL * columns)]), at).0
    }
}

/// The gradients of a run's pixels.
#[repr(C, align(64))]
pub(crate) struct Gradients([Both<f32>; RUN]);

impl Default for Gradients {
    fn default() -> Self {
        Gradients([[0.0; GROUP]; RUN])
    }
}

impl Noted for Gradients {}

impl Gradients {
    /// Notes the windows of a pair's `lanes`, which are inside the image, `at` in the run; the others' gradients mean nothing.
    /// `places` are by the side of a window.
    ///
    /// # Safety
    /// As [`Sums::note`](super::tile::Sums::note); there are places for the windows' sides.
    #[inline(always)]
    pub unsafe fn note<S: Groups, L: LeftCorners>(
        &mut self,
        ring: &[Both<i32>],
        places: &[L],
        frame: &Frame,
        pair: &Pair,
        lanes: u32,
        at: usize,
    ) {
        let to = self.0[at..at + LANES].as_mut_ptr().cast::<f32>();
        let pixels = ring.as_ptr().wrapping_add(frame.column(pair.x));
        // SAFETY: as the caller's: rows and columns are held.
        unsafe {
            if let Some(side) = pair.one_side::<S>(lanes) {
                let left = *places.get_unchecked(side);
                for lane in (0..LANES).step_by(S::Widest::LANES / GROUP) {
                    let both = left.gradients::<S::Widest>(pixels.wrapping_add(lane), side);
                    S::Widest::store(to.add(GROUP * lane), S::Widest::float_i(both));
                }
                return;
            }
            for first in (0..LANES).step_by(GROUP) {
                let sides = pair.sides::<S>(first, lanes >> first);
                for (lane, side) in (first..).zip(sides) {
                    let side = side as usize;
                    let left = *places.get_unchecked(side);
                    let both = left.gradients_of_one::<S>(pixels.wrapping_add(lane), side);
                    S::store(to.add(GROUP * lane), S::float_i(both));
                }
            }
        }
    }

    /// Notes the windows of a pair's `lanes`, which cross the border of the image, `at` in the run; `gradients` are those of
    /// a pixel and the side of its window. Returns the lanes whose windows are left to the plain form.
    #[cold]
    pub fn note_crossing(
        &mut self,
        tile: &Tile,
        pair: &Pair,
        lanes: u32,
        at: usize,
        gradients: impl Fn((usize, usize), usize) -> Both<f32>,
    ) -> u32 {
        let mut plain = 0;
        for lane in Bits(lanes) {
            let (pixel, side) = pair.window(lane);
            if tile.has_only_finite(pixel, side) {
                self.0[at + lane] = gradients(pixel, side);
            } else {
                plain |= 1 << lane;
            }
        }
        plain
    }

    /// The normals of the pixels from `at` on, with windows of these sides.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn normals<S: Simd>(&self, scale: &Scale, at: usize, sides: S::F) -> Found<S> {
        let from = self.0[at..at + S::LANES].as_ptr().cast::<f32>();
        // SAFETY: as the caller's; so many pixels' gradients are there.
        unsafe {
            let [hx, hy, hz] = S::load_points(from, PIXEL);
            let [vx, vy, vz] = S::load_points(from.add(VERTICAL), PIXEL);
            let (h, v) =
                ([Floats(hx), Floats(hy), Floats(hz)], [Floats(vx), Floats(vy), Floats(vz)]);
            scale.normals(h, v, sides)
        }
    }
}

/// How coordinates become integers.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Scale {
    origin: [f32; 3],
    scale: f32,
    /// What rounding to integers moves the sums over a window of side 1 by at most, over [`DOUBT`].
    doubt: f32,
    /// The largest magnitude of a coordinate, counted from the origin, that sums hold.
    pub limit: f32,
}

/// A normal is doubtful where rounding to integers could turn it by more than this, if one coordinate of each gradient were
/// as far off as it can be (all three, at worst, turn it by the root of six times as much; where windows are mirrored at the
/// image's border, twice that), or where floats could: (sine of the angle between the tangents) < 1e-3.
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
        let mut scale = (bits.ceil() - 1.0).clamp(-120.0, 120.0).exp2();
        // Each is rounded by up to one half.
        if (f64::from(limit) * scale + 0.5) * (strips * side) as f64 >= 31_f64.exp2() {
            scale *= 0.5;
        }
        let most = ((31_f64.exp2() / (strips * side) as f64 - 0.5) / scale) as f32;
        Scale { origin, scale: scale as f32, doubt, limit: most.next_down().max(limit) }
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

    /// The sum of coordinates `c` themselves, scaled, of `count` points more than are taken away, from that of integers.
    pub fn sum(&self, c: usize, integers: i32, count: isize) -> f32 {
        let of_origin = f64::from(self.origin[c]) * f64::from(self.scale);
        (f64::from(integers) + count as f64 * of_origin) as f32
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_rounded_integers_fit() {
        for strips in [2, 4] {
            for side in 1..300 {
                let limit = ((2048.0 / (strips * side) as f64) as f32).next_down();
                let scale = Scale::new(strips, limit, side, [0.0; 3]).scale;
                let most = f64::from(limit * scale).round_ties_even() * (strips * side) as f64;
                assert!(most < 31_f64.exp2(), "{strips} strips of side {side}");
                assert!(most > 29_f64.exp2(), "{strips} strips of side {side}: digits to spare");
            }
        }
    }
}
