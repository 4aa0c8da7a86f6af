//! Where in a tile's rings windows lie (Eq. 3).

use super::integrals::{Counted, MARGIN, Rings, WEIGHT};
use crate::Error;
use crate::fast::arithmetic::{Doubles, Floats};
use crate::memory::make_room;
use crate::simd::{GROUP, Groups};

/// The rows of the windows of a radius around a row's pixels, inside the image.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    first: usize,
    last: usize,
    /// Where in the ring of sums the row above the first of them starts, and where the last does; or of those inside them.
    above: usize,
    below: usize,
    /// Where in the ring of points the first, the middle and the last of them start.
    ends: [usize; 3],
}

impl Rows {
    /// Makes room for windows of up to a radius.
    pub fn reserve(rows: &mut Vec<Rows>, radius: usize) -> Result<(), Error> {
        make_room(rows, radius + 1)
    }

    /// Those of a radius around row `y` of an image of this height; `edge` of them are not summed over at both ends.
    pub fn new<const N: usize>(
        rings: &Rings<N>,
        y: usize,
        radius: usize,
        edge: usize,
        height: usize,
    ) -> Self {
        let (first, last) = (y.saturating_sub(radius), (y + radius).min(height - 1));
        Rows {
            first,
            last,
            above: rings.start_above(first + edge),
            below: rings.start_above(last + 1 - edge),
            ends: [first, (first + last) / 2, last].map(|y| 4 * rings.start_of(y)),
        }
    }
}

type Indices = [i32; GROUP];

/// Eight pixels of a row, some columns apart.
#[derive(Clone, Copy)]
pub(crate) struct Pixels {
    /// The first one's column.
    pub x: usize,
    /// From one to the next.
    pub step: usize,
    /// Columns of the image.
    pub width: usize,
}

/// The columns of eight pixels' windows: places in the rows of the rings.
pub(crate) enum Rects {
    /// All of a radius, and inside the image, of pixels side by side, the first of which is at this place.
    Alike { radius: usize, place: usize },
    /// The first and the last columns of each.
    Each { radii: Indices, first: Indices, last: Indices },
}

/// Pixel numbers in a group.
pub(crate) const STEPS: [f32; GROUP] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl Rects {
    /// The windows of these radii, as `paper::smoothing_area::window` has them, of the row that the rings are aimed at; those
    /// of other `lanes` mean nothing, but have such radii too.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`. Columns of the image are below 2^24.
    #[inline(always)]
    pub unsafe fn new<S: Groups, const N: usize>(
        rings: &Rings<N>,
        pixels: &Pixels,
        radii: Floats<S>,
        lanes: u32,
    ) -> Self {
        let &Pixels { x, step, width } = pixels;
        let mut each = [0; GROUP];
        // SAFETY: as the caller's; floats hold columns exactly.
        unsafe {
            let splat = |value: usize| Floats::<S>::splat(value as f32);
            S::store_i(each.as_mut_ptr(), S::truncate_i(radii.0));
            let radius = each[lanes.trailing_zeros() as usize % GROUP] as usize;
            let differ = !S::bits(S::eq(radii.0, splat(radius).0));
            if step == 1 && lanes & differ == 0 && x >= radius && x + GROUP + radius <= width {
                return Rects::Alike { radius, place: rings.place(x) };
            }
            let [start, end] = range(pixels.columns(), radii, width);
            let shift = Floats::splat(MARGIN as f32) - splat(rings.left());
            let places = |columns: Floats<S>| {
                let mut places = [0; GROUP];
                S::store_i(places.as_mut_ptr(), S::truncate_i((columns + shift).0));
                places
            };
            Rects::Each { radii: each, first: places(start), last: places(end - splat(1)) }
        }
    }

    /// The sums over the windows (Eq. 3, not divided), channel by channel; over those without their outermost columns if
    /// `edge` is 1.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the windows are of these rings.
    #[inline(always)]
    pub unsafe fn sums<S: Groups, const N: usize>(
        &self,
        rings: &Rings<N>,
        edge: usize,
    ) -> [Doubles<S>; N] {
        match self {
            &Rects::Alike { radius, place } => {
                let &Rows { above, below, .. } = rings.rows_of(radius);
                let columns = [place + edge - radius - 1, place + radius - edge];
                let corners = [above, below].map(|row| columns.map(|column| row + column));
                let of_lane = |lane: usize| corners.map(|row| row.map(|corner| corner + lane));
                // SAFETY: as the caller's.
                unsafe { sums_between(rings, of_lane) }
            }
            Rects::Each { radii, first, last } => {
                let of_lane = |lane: usize| {
                    let &Rows { above, below, .. } = rings.rows_of(radii[lane] as usize);
                    let columns = [first[lane] as usize + edge - 1, last[lane] as usize - edge];
                    [above, below].map(|row| columns.map(|column| row + column))
                };
                // SAFETY: as the caller's.
                unsafe { sums_between(rings, of_lane) }
            }
        }
    }

    /// The differences in x and y between the points at both ends of eight windows' middle rows (`line` 0) or columns, NaN
    /// where one is missing, and how far apart these are.
    ///
    /// # Safety
    /// As [`Rects::sums`].
    #[inline(always)]
    pub unsafe fn ends<S: Groups, const N: usize>(
        &self,
        rings: &Rings<N>,
        line: usize,
    ) -> [Floats<S>; 3] {
        let (points, plane) = (rings.points().as_ptr(), rings.stride());
        match self {
            &Rects::Alike { radius, place } => {
                let rows = rings.rows_of(radius);
                let [top, middle, bottom] = rows.ends;
                let [from, to, span] = if line == 0 {
                    [middle + place - radius, middle + place + radius, 2 * radius]
                } else {
                    [top + place, bottom + place, rows.last - rows.first]
                };
                let at = |end: usize, field: usize| points.wrapping_add(end + field * plane);
                // SAFETY: as the caller's.
                unsafe {
                    let dx = Floats::<S>::load(at(to, 0)) - Floats::load(at(from, 0));
                    let dy = Floats::<S>::load(at(to, 1)) - Floats::load(at(from, 1));
                    [dx, dy, Floats::splat(span as f32)]
                }
            }
            Rects::Each { radii, first, last } => {
                let mut fields = [[0.0; GROUP]; 3];
                for lane in 0..GROUP {
                    let (first, last) = (first[lane] as usize, last[lane] as usize);
                    let rows = rings.rows_of(radii[lane] as usize);
                    let [top, middle, bottom] = rows.ends;
                    let column = (first + last) / 2;
                    let [from, to, span] = if line == 0 {
                        [middle + first, middle + last, last - first]
                    } else {
                        [top + column, bottom + column, rows.last - rows.first]
                    };
                    for field in 0..2 {
                        // SAFETY: as the caller's.
                        let at = |end: usize| unsafe { *points.wrapping_add(end + field * plane) };
                        fields[field][lane] = at(to) - at(from);
                    }
                    fields[2][lane] = span as f32;
                }
                // SAFETY: as the caller's; there are so many.
                unsafe {
                    let load = |field: usize| Floats::load(fields[field].as_ptr());
                    [load(0), load(1), load(2)]
                }
            }
        }
    }

    /// Of a window's middle row (`line` 0) or column the outermost points that are there, and how far apart these are; none
    /// if there are not two.
    pub fn outermost<const N: usize>(
        &self,
        rings: &Rings<N>,
        line: usize,
        lane: usize,
    ) -> Option<([Counted; 2], f32)> {
        let (radius, left, right) = match self {
            Rects::Alike { radius, place } => {
                (*radius, place + lane - radius, place + lane + radius)
            }
            Rects::Each { radii, first, last } => {
                (radii[lane] as usize, first[lane] as usize, last[lane] as usize)
            }
        };
        let Rows { first, last, ends: [top, middle, bottom], .. } = rings.rows_of(radius);
        let (mut a, mut b, step, mut span) = if line == 0 {
            (middle + left, middle + right, 1, right - left)
        } else {
            let column = (left + right) / 2;
            (top + column, bottom + column, rings.row_of_points(), last - first)
        };
        let (points, length) = (rings.points(), rings.points().len());
        let is_missing = |at: usize| points[at + WEIGHT * rings.stride()] == 0.0;
        while is_missing(a) && span > 0 {
            (a, span) = (a + step, span - 1);
            a -= if a >= length { length } else { 0 };
        }
        while is_missing(b) && span > 0 {
            (b, span) = (if b < step { b + length } else { b } - step, span - 1);
        }
        let point = |at: usize| std::array::from_fn(|field| points[at + field * rings.stride()]);
        (span > 0).then(|| ([point(a), point(b)], span as f32))
    }
}

/// A window's corners: above and below, left and right.
type Corners = [[usize; 2]; 2];

/// The sums between the corners of eight windows.
///
/// # Safety
/// The processor has the instruction set of `S`; the rings have such elements.
#[inline(always)]
unsafe fn sums_between<S: Groups, const N: usize>(
    rings: &Rings<N>,
    corners: impl Fn(usize) -> Corners,
) -> [Doubles<S>; N] {
    let (eights, fours) = rings.sums();
    // SAFETY: as the caller's.
    unsafe {
        let mut channels = [Doubles::splat(0.0); N];
        if Rings::<N>::HAS_EIGHT {
            let mut windows = [S::splat_d(0.0); GROUP];
            for lane in 0..GROUP {
                let [above, below] = corners(lane);
                let above = along_eight::<S>(eights, above);
                windows[lane] = S::sub_d(along_eight::<S>(eights, below), above);
            }
            let eight = S::transpose_d(windows);
            for i in 0..8 {
                channels[i] = Doubles(eight[i]);
            }
        }
        if Rings::<N>::HAS_FOUR {
            let mut windows = [S::splat_d(0.0); 4];
            for lane in 0..4 {
                let ([above, below], [next_above, next_below]) = (corners(lane), corners(4 + lane));
                let above = along_four::<S>(fours, [above, next_above]);
                windows[lane] = S::sub_d(along_four::<S>(fours, [below, next_below]), above);
            }
            let four = S::transpose_fours_d(windows);
            for i in 0..4 {
                channels[N - 4 + i] = Doubles(four[i]);
            }
        }
        channels
    }
}

/// The eight channels between two elements of a row.
///
/// # Safety
/// As [`sums_between`].
#[inline(always)]
unsafe fn along_eight<S: Groups>(eights: *const f64, [left, right]: [usize; 2]) -> S::D {
    // SAFETY: as the caller's.
    unsafe {
        let left = S::load_d(eights.wrapping_add(8 * left));
        S::sub_d(S::load_d(eights.wrapping_add(8 * right)), left)
    }
}

/// The four channels between two elements of a row, and between two of another.
///
/// # Safety
/// As [`sums_between`].
#[inline(always)]
unsafe fn along_four<S: Groups>(fours: *const f64, [first, second]: [[usize; 2]; 2]) -> S::D {
    // SAFETY: as the caller's.
    unsafe {
        let place = |half: usize, end: usize| fours.wrapping_add(4 * [first, second][half][end]);
        let left = S::load_fours_d(|half| place(half, 0));
        S::sub_d(S::load_fours_d(|half| place(half, 1)), left)
    }
}

impl Pixels {
    /// Their columns; the last one of the image stands for those behind it.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`. Columns of the image are below 2^24.
    #[inline(always)]
    pub unsafe fn columns<S: Groups>(&self) -> Floats<S> {
        // SAFETY: as the caller's; floats hold columns exactly.
        unsafe {
            let steps = Floats::<S>::load(STEPS.as_ptr()) * Floats::splat(self.step as f32);
            let columns = steps + Floats::splat(self.x as f32);
            Floats(S::min(columns.0, S::splat((self.width - 1) as f32)))
        }
    }
}

/// The columns or rows around `at`, of so many: the first, and that after the last.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(crate) unsafe fn range<S: Groups>(
    at: Floats<S>,
    radii: Floats<S>,
    count: usize,
) -> [Floats<S>; 2] {
    // SAFETY: as the caller's.
    unsafe {
        let end = at + radii + Floats::splat(1.0);
        let start = (at - radii).max(Floats::splat(0.0));
        [start, Floats(S::min(end.0, S::splat(count as f32)))]
    }
}
