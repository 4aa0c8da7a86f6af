//! Sixteen pixels side by side, masks of them, and rows in *lane order*.
//!
//! A row of `width` pixels is cut into 16 segments of equal length; element k of the row in lane order holds pixel
//! k of every segment. So the serial chain along a row that a distance transform needs runs in 16 lanes at once,
//! and the pixel's neighbours in the rows above and below lie at elements k - 1, k, k + 1.

use super::buffer::Number;
use crate::simd::{Along, GROUP, Simd};

pub(crate) const LANES: usize = 2 * GROUP;

/// One float of each of sixteen pixels.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Lanes(pub [f32; LANES]);

// SAFETY: an array of floats, aligned like a line.
unsafe impl Number for Lanes {}

impl Lanes {
    pub const ZERO: Lanes = Lanes([0.0; LANES]);

    /// The least lane; none is NaN.
    #[inline(always)]
    pub fn least(self) -> f32 {
        self.best(|a, b| if a < b { a } else { b })
    }

    /// The largest lane; none is NaN.
    #[inline(always)]
    pub fn largest(self) -> f32 {
        self.best(|a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn best(self, better: impl Fn(f32, f32) -> f32) -> f32 {
        // By halves, which are vectors.
        let of_8: [f32; 8] = std::array::from_fn(|l| better(self.0[l], self.0[l + 8]));
        let of_4: [f32; 4] = std::array::from_fn(|l| better(of_8[l], of_8[l + 4]));
        better(better(of_4[0], of_4[2]), better(of_4[1], of_4[3]))
    }

    /// As many of the first as `S` has lanes.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn load<S: Simd>(&self) -> S::F {
        const { assert!(S::LANES <= LANES) };
        // SAFETY: as the caller's; there are that many.
        unsafe { S::load(self.0.as_ptr()) }
    }

    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn store<S: Simd>(&mut self, value: S::F) {
        const { assert!(S::LANES == LANES) };
        // SAFETY: as the caller's; all of it is stored.
        unsafe { S::store(self.0.as_mut_ptr(), value) };
    }
}

/// How a row of pixels lies in lane order.
#[derive(Clone, Copy)]
pub(crate) struct LaneOrder {
    pub width: usize,
    /// Pixels in a segment, so elements in a row.
    pub segment: usize,
}

impl LaneOrder {
    pub fn new(width: usize) -> Self {
        LaneOrder { width, segment: width.div_ceil(LANES) }
    }

    /// Element and lane of a pixel.
    #[inline(always)]
    pub fn place(&self, x: usize) -> (usize, usize) {
        (x % self.segment, x / self.segment)
    }

    /// Reads a row of points' depths, `stride` bytes apart, into lane order, NaN for those that are not finite, and zeros past
    /// the row's end. The first `whole` points have x and y before z and four bytes behind it, which can be read.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; `row` is valid for `width` reads, and for those of whole points.
    #[inline(always)]
    pub unsafe fn read<S: Along>(
        &self,
        row: *const f32,
        stride: usize,
        whole: usize,
        to: &mut [Lanes],
    ) {
        const POINT: usize = 4;
        let whole = if stride == POINT * size_of::<f32>() { whole } else { 0 };
        let points = S::LANES / POINT;
        let to = to[..self.segment].as_mut_ptr().cast::<f32>();
        let lane_stride = self.segment * stride;
        for lane in (0..LANES).step_by(4) {
            // Elements that all four lanes have.
            let all_have =
                |count: usize| count.saturating_sub((lane + 3) * self.segment).min(self.segment);
            let (whole, together) = (all_have(whole) / points * points, all_have(self.width));
            let mut from = row.wrapping_byte_add(lane * lane_stride);
            for element in (0..whole).step_by(points) {
                // SAFETY: as the caller's; the points are whole.
                unsafe {
                    let first = from.sub(2);
                    let at = |lane: usize| first.byte_add(lane * lane_stride);
                    let four = [S::load(first), S::load(at(1)), S::load(at(2)), S::load(at(3))];
                    let [_, _, z, _] = S::transpose_fours(four);
                    let finite_or_nan = S::add(z, S::sub(z, z));
                    let to = |point: usize| to.add((element + point) * LANES + lane);
                    S::store_fours(finite_or_nan, to);
                }
                from = from.wrapping_byte_add(points * stride);
            }
            for element in whole..together {
                // SAFETY: the pixels' columns are below the width; element < segment = length of `to`.
                unsafe {
                    let to = to.add(element * LANES + lane).cast::<[f32; 4]>();
                    let of_lane = |l: usize| finite_or_nan(from.byte_add(l * lane_stride).read());
                    to.write([0, 1, 2, 3].map(of_lane));
                }
                from = from.wrapping_byte_add(stride);
            }
            for lane in lane..lane + 4 {
                let start = lane * self.segment;
                let inside = self.segment.min(self.width.saturating_sub(start));
                for element in together..self.segment {
                    // SAFETY: start + element < width where it is read, and element < segment = length of `to`.
                    unsafe {
                        let value = if element < inside {
                            finite_or_nan(row.byte_add((start + element) * stride).read())
                        } else {
                            0.0
                        };
                        to.add(element * LANES + lane).write(value);
                    }
                }
            }
        }
    }

    /// Writes elements in lane order as a row of floats. `row` has room for all lanes, also those past the width.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn write<S: Along>(&self, from: &[Lanes], row: &mut [f32]) {
        let segment = self.segment;
        let (from, row) = (&from[..segment], &mut row[..segment * LANES]);
        let whole = segment / 4 * 4;
        for element in (0..whole).step_by(4) {
            for lane in (0..LANES).step_by(S::LANES) {
                // SAFETY: as the caller's; 4 elements lie inside `from`, and 4 floats of all segments inside `row`.
                unsafe {
                    let load = |i: usize| S::load(from[element + i].0.as_ptr().add(lane));
                    let of_lanes = S::transpose_fours([load(0), load(1), load(2), load(3)]);
                    let to = row.as_mut_ptr().add(lane * segment + element);
                    for i in 0..4 {
                        S::store_fours(of_lanes[i], |four| to.add((4 * four + i) * segment));
                    }
                }
            }
        }
        for element in whole..segment {
            for lane in 0..LANES {
                row[lane * segment + element] = from[element].0[lane];
            }
        }
    }
}

/// A number, or NaN if it is not finite.
#[inline(always)]
fn finite_or_nan(z: f32) -> f32 {
    if z.is_finite() { z } else { f32::NAN }
}

/// The mask of the first `count` lanes.
#[inline(always)]
pub(crate) fn all(count: usize) -> u32 {
    (1 << count) - 1
}

/// The set bits of a mask, lowest first.
pub(crate) struct Bits(pub u32);

impl Bits {
    /// The mask of those of which this is so.
    pub fn which(self, is_so: impl Fn(usize) -> bool) -> u32 {
        self.filter(|lane| is_so(*lane)).fold(0, |lanes, lane| lanes | 1 << lane)
    }
}

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let first = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (first < 32).then_some(first)
    }
}
