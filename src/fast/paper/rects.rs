//! Where in a tile's rings eight windows lie (Eq. 3).

use super::integrals::Counted;
use crate::fast::arithmetic::Doubles;
use crate::simd::{GROUP, Groups};

type Indices = [i32; GROUP];

/// The rings that the indices are for, and the pixels.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    /// Width and height of the image.
    pub image: [usize; 2],
    /// The first pixel of the eight, and how many columns they are apart.
    pub x: usize,
    pub y: usize,
    pub step: usize,
    /// The rings' first column, their elements from a row to the next, and their rows.
    pub left: usize,
    pub stride: usize,
    pub rows: usize,
}

/// Indices of the elements that eight windows need.
#[derive(Default)]
pub(crate) struct Rects {
    /// Of the sums up to the windows' upper left, upper right, lower left and lower right corners: of their first
    /// channels.
    pub corners: [Indices; 4],
    /// Of the points at both ends of the middle row, and of the middle column.
    pub ends: [[Indices; 2]; 2],
    /// How many pixels these are apart.
    pub spans: [[f32; GROUP]; 2],
    /// The rings' elements from a row to the next, and their rows.
    stride: usize,
    rows: usize,
}

/// Pixel numbers in a group.
pub(crate) const STEPS: [f32; GROUP] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl Rects {
    /// Where eight windows lie, as `paper::smoothing_area::window` has them, in rings of sums of `N` channels.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`. Elements' indices are below 2^24.
    #[inline(always)]
    pub unsafe fn new<S: Groups, const N: usize>(
        place: &Place,
        radii: S::F,
        inner: bool,
        ends: bool,
    ) -> Self {
        const { assert!(N.is_multiple_of(4)) };
        let mut rects = Rects { stride: place.stride, rows: place.rows, ..Rects::default() };
        // SAFETY: as the caller's; floats hold indices exactly.
        unsafe {
            let (zero, one) = (S::splat(0.0), S::splat(1.0));
            let steps = S::mul(S::load(STEPS.as_ptr()), S::splat(place.step as f32));
            let at = S::add(steps, S::splat((place.x - place.left) as f32));
            // Pixels behind the last column stand for that.
            let at = S::min(at, S::splat((place.image[0] - 1 - place.left) as f32));
            let x = range::<S>(at, radii, -(place.left as f32), place.image[0] as f32);
            let y = range::<S>(zero, radii, -(place.y as f32), place.image[1] as f32);
            let edge = if inner { one } else { zero };
            let (left, right) = (S::add(x[0], edge), S::sub(x[1], edge));
            let above = row_start::<S>(place, S::sub(S::add(y[0], edge), one));
            let last = row_start::<S>(place, S::sub(S::sub(y[1], edge), one));
            let corners = [(above, left), (above, right), (last, left), (last, right)];
            for (to, (row, column)) in rects.corners.iter_mut().zip(corners) {
                // Times N: not every instruction set has a product of integers.
                let element = S::truncate_i(S::add(row, column));
                let twice = S::add_i(element, element);
                let four = S::add_i(twice, twice);
                let mut channel = four;
                for _ in 1..N / 4 {
                    channel = S::add_i(channel, four);
                }
                S::store_i(to.as_mut_ptr(), channel);
            }
            if ends {
                // The element of a column's point is the next one.
                let column = S::add(middle::<S>(place, x), one);
                let row = row_start::<S>(place, middle::<S>(place, y));
                let last = row_start::<S>(place, S::sub(y[1], one));
                store::<S>(&mut rects.ends[0][0], S::add(row, S::add(x[0], one)));
                store::<S>(&mut rects.ends[0][1], S::add(row, x[1]));
                store::<S>(&mut rects.ends[1][0], S::add(row_start::<S>(place, y[0]), column));
                store::<S>(&mut rects.ends[1][1], S::add(last, column));
                S::store(rects.spans[0].as_mut_ptr(), S::sub(S::sub(x[1], x[0]), one));
                S::store(rects.spans[1].as_mut_ptr(), S::sub(S::sub(y[1], y[0]), one));
            }
        }
        rects
    }

    /// The sums over the eight windows (Eq. 3, not divided), channel by channel.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the corners lie in `sums`.
    #[inline(always)]
    pub unsafe fn sums<S: Groups, const N: usize>(&self, sums: &[[f64; N]]) -> [Doubles<S>; N] {
        const { assert!(N.is_multiple_of(4)) };
        debug_assert!(self.corners.iter().flatten().all(|at| (*at as usize) < N * sums.len()));
        let sums = sums.as_ptr().cast::<f64>();
        // SAFETY: as the caller's; an element has fours of channels.
        unsafe {
            let mut channels = [Doubles::splat(0.0); N];
            let [a, b, c, d] = &self.corners;
            let eights = N / GROUP * GROUP;
            for first in (0..eights).step_by(GROUP) {
                let mut windows = [S::splat_d(0.0); GROUP];
                for lane in 0..GROUP {
                    let at = |corner: &Indices| S::load_d(sums.add(corner[lane] as usize + first));
                    windows[lane] = S::sub_d(S::sub_d(at(d), at(c)), S::sub_d(at(b), at(a)));
                }
                let eight = S::transpose_d(windows);
                for i in 0..GROUP {
                    channels[first + i] = Doubles(eight[i]);
                }
            }
            for first in (eights..N).step_by(4) {
                let at = |corner: &Indices, lane: usize| {
                    let four = |i: usize| sums.add(corner[lane + 4 * i] as usize + first);
                    Doubles::<S>(S::load_fours_d(four))
                };
                let mut windows = [S::splat_d(0.0); 4];
                for i in 0..4 {
                    windows[i] = ((at(d, i) - at(c, i)) - (at(b, i) - at(a, i))).0;
                }
                let fours = S::transpose_fours_d(windows);
                for i in 0..4 {
                    channels[first + i] = Doubles(fours[i]);
                }
            }
            channels
        }
    }

    /// Of a window's middle row (`line` 0) or column the outermost points that are there, and how far apart these are; none
    /// if there are not two.
    pub fn outermost(
        &self,
        line: usize,
        lane: usize,
        points: &[Counted],
    ) -> Option<([Counted; 2], f32)> {
        let (step, count) = ([1, self.stride][line], self.spans[line][lane] as usize + 1);
        let length = self.stride * self.rows;
        let ends = self.ends[line];
        let (mut a, mut b) = (ends[0][lane] as usize, ends[1][lane] as usize);
        let (mut first, mut last) = (0, count - 1);
        while points[a][3] == 0.0 && first < last {
            (a, first) = (a + step, first + 1);
            a -= if a >= length { length } else { 0 };
        }
        while points[b][3] == 0.0 && first < last {
            (b, last) = (if b < step { b + length } else { b } - step, last - 1);
        }
        (first < last).then(|| ([points[a], points[b]], (last - first) as f32))
    }
}

/// The columns or rows around `at`, between `first` and `size` after that.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(crate) unsafe fn range<S: Groups>(at: S::F, radii: S::F, first: f32, size: f32) -> [S::F; 2] {
    // SAFETY: as the caller's.
    unsafe {
        let end = S::add(S::add(at, radii), S::splat(1.0));
        [S::max(S::sub(at, radii), S::splat(first)), S::min(end, S::splat(first + size))]
    }
}

/// Where rows, counted from the pixels' own, start in the rings.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn row_start<S: Groups>(place: &Place, row: S::F) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        let rows = S::splat(place.rows as f32);
        let at = S::add(S::splat((place.y % place.rows) as f32), row);
        let at = S::add(at, S::and(S::lt(at, S::splat(0.0)), rows));
        let at = S::sub(at, S::and_not(S::lt(at, rows), rows));
        S::mul(at, S::splat(place.stride as f32))
    }
}

/// `Rect::middle`
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn middle<S: Groups>(place: &Place, [start, end]: [S::F; 2]) -> S::F {
    // SAFETY: as the caller's.
    unsafe {
        // Rounded down, also below zero.
        let shift = S::splat(place.rows as f32);
        let twice = S::sub(S::add(start, end), S::splat(1.0));
        S::sub(S::truncate(S::add(S::mul(twice, S::splat(0.5)), shift)), shift)
    }
}

/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn store<S: Groups>(to: &mut Indices, value: S::F) {
    // SAFETY: as the caller's.
    unsafe { S::store_i(to.as_mut_ptr(), S::truncate_i(value)) };
}
