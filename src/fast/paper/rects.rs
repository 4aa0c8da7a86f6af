//! Where in a tile's rings windows lie (Eq. 3).

use std::hint::black_box;

use super::integrals::{Aimed, Rings};
use crate::fast::arithmetic::{Doubles, Floats, between};
use crate::fast::planes::MARGIN;
use crate::simd::{GROUP, Groups};

/// The rows of the windows of a radius around a row's pixels, inside the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows {
    radius: usize,
    /// How many of them are not summed over at both ends.
    edge: usize,
    first: usize,
    /// From the first to the last.
    span: usize,
    /// Where in the ring of sums the row above those that are summed over starts, and where the last of them does.
    above: usize,
    below: usize,
    /// Where in the ring of points the first, the middle and the last of them start.
    ends: [usize; 3],
}

impl Rows {
    /// Those of a radius around the row aimed at.
    #[inline(always)]
    pub fn new<const N: usize>(rings: &Rings<N>, radius: usize, edge: usize) -> Self {
        let &Rings { height, aimed: Aimed { y, .. }, .. } = rings;
        let (first, last) = (y.saturating_sub(radius), (y + radius).min(height - 1));
        Rows {
            radius,
            edge,
            first,
            span: last - first,
            above: rings.start_near((first + edge).wrapping_sub(1)),
            below: rings.start_near(last.wrapping_sub(edge)),
            ends: [first, (first + last) / 2, last].map(|y| 4 * rings.start_near(y)),
        }
    }

    /// Where in the ring of points the middle row (`line` 0) or column of a window starts and ends, whose pixel is at this
    /// place, and how far apart that is.
    #[inline(always)]
    fn line(&self, place: usize, line: usize) -> ([usize; 2], usize) {
        let &Rows { radius, span, ends: [first, middle, last], .. } = self;
        if line == 0 {
            ([middle + place - radius, middle + place + radius], 2 * radius)
        } else {
            ([first + place, last + place], span)
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

/// Eight pixels' windows: columns are places in the rows of the rings, rows are the image's.
pub(crate) enum Rects<S: Groups> {
    /// All of a radius, and inside the image's columns, of pixels side by side, the first of which is at this place.
    Alike { rows: Rows, place: usize },
    /// The first and the last columns and rows of each.
    Each { columns: [Floats<S>; 2], rows: [Floats<S>; 2] },
}

/// Pixel numbers in a group.
const STEPS: [f32; GROUP] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl<S: Groups> Rects<S> {
    /// The windows of these radii, as [`Rect::around`](crate::rect::Rect::around) has them, of the row that the rings are aimed at; those
    /// of other `lanes` mean nothing, but have such radii too. `rows` are those of the last windows that were alike; without,
    /// none are taken for alike.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`. Columns of the image are below 2^24.
    #[inline(always)]
    pub unsafe fn new<const N: usize>(
        rings: &Rings<N>,
        pixels: &Pixels,
        radii: Floats<S>,
        lanes: u32,
        rows: Option<&mut Rows>,
    ) -> Self {
        let &Pixels { x, width, .. } = pixels;
        // SAFETY: as the caller's; floats hold columns exactly.
        unsafe {
            if let Some(rows) = rows {
                let mut each = [0.0; GROUP];
                S::store(each.as_mut_ptr(), radii.0);
                let first = each[lanes.trailing_zeros() as usize % GROUP];
                let radius = first.to_int_unchecked::<i32>() as usize;
                let differ = !S::bits(S::eq(radii.0, S::splat(first)));
                if lanes & differ == 0 && x >= radius && x + GROUP + radius <= width {
                    if rows.radius != radius {
                        *rows = Rows::new(rings, radius, rows.edge);
                    }
                    return Rects::Alike { rows: *rows, place: rings.place(x) };
                }
            }
            let &Rings { height, aimed: Aimed { y, .. }, .. } = rings;
            let (columns, rows) = (pixels.columns(), Floats::whole(y));
            let [left, right] = range(columns, radii, width);
            let [top, bottom] = range(rows, radii, height);
            let shift = Floats::whole(MARGIN) - Floats::whole(rings.left());
            let one = Floats::splat(1.0);
            Rects::Each { columns: [left + shift, right + shift - one], rows: [top, bottom - one] }
        }
    }

    /// The sums over the windows (Eq. 3, not divided), channel by channel; over those without their outermost columns and
    /// rows if `edge` is 1.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the windows are of these rings.
    #[inline(always)]
    pub unsafe fn sums<const N: usize>(&self, rings: &Rings<N>, edge: usize) -> [Doubles<S>; N] {
        match *self {
            Rects::Alike { rows: Rows { radius, above, below, .. }, place } => {
                let columns = [place + edge - radius - 1, place + radius - edge];
                let corners = [above, below].map(|row| columns.map(|column| row + column));
                let of_lane =
                    |lane: usize| corners.map(|row| row.map(|corner| 8 * (corner + lane)));
                // SAFETY: as the caller's.
                unsafe { sums_between::<S, N, true>(rings, of_lane) }
            }
            Rects::Each { columns: [left, right], rows: [top, bottom] } => {
                // SAFETY: as the caller's.
                unsafe {
                    let edge = Floats::whole(edge);
                    let before = edge - Floats::splat(1.0);
                    let [left, right] = [left + before, right - edge];
                    let above = rings.starts_near(top + before);
                    let below = rings.starts_near(bottom - edge);
                    let eight = Floats::splat(8.0);
                    let places = [
                        [indices(eight * (above + left)), indices(eight * (above + right))],
                        [indices(eight * (below + left)), indices(eight * (below + right))],
                    ];
                    let places = one_by_one(&places);
                    let of_lane = |lane: usize| {
                        let [[a, b], [c, d]] = places;
                        [[a[lane] as usize, b[lane] as usize], [c[lane] as usize, d[lane] as usize]]
                    };
                    sums_between::<S, N, false>(rings, of_lane)
                }
            }
        }
    }

    /// The differences in x and y between the points at both ends of eight windows' middle rows (`line` 0) or columns, NaN
    /// where one is missing, and how far apart these are.
    ///
    /// # Safety
    /// As [`Rects::sums`].
    #[inline(always)]
    pub unsafe fn ends(&self, rings: &Rings<4>, line: usize) -> [Floats<S>; 3] {
        let (points, plane) = (rings.points(), rings.stride);
        // SAFETY: as the caller's.
        unsafe {
            match *self {
                Rects::Alike { rows, place } => {
                    let (ends, span) = rows.line(place, line);
                    let [from, to] = ends.map(|end| points.wrapping_add(end));
                    let dx = Floats::load(to) - Floats::load(from);
                    let [from, to] = [from, to].map(|end| end.wrapping_add(plane));
                    let dy = Floats::load(to) - Floats::load(from);
                    [dx, dy, Floats::whole(span)]
                }
                Rects::Each { columns, rows } => {
                    let (columns, rows) = if line == 0 {
                        (columns, [middle(rows); 2])
                    } else {
                        ([middle(columns); 2], rows)
                    };
                    let mut ends = [[0; GROUP]; 2];
                    for end in 0..2 {
                        let row = Floats::splat(4.0) * rings.starts_near(rows[end]);
                        // Floats do not hold the place.
                        let place = S::add_i(S::truncate_i(row.0), S::truncate_i(columns[end].0));
                        S::store_i(ends[end].as_mut_ptr(), place);
                    }
                    let ends = one_by_one(&ends);
                    let mut fields = [[0.0; GROUP]; 2];
                    for lane in 0..GROUP {
                        let end = |end: usize| points.wrapping_add(ends[end][lane] as usize);
                        let (from, to) = (end(0), end(1));
                        fields[0][lane] = *to - *from;
                        fields[1][lane] = *to.wrapping_add(plane) - *from.wrapping_add(plane);
                    }
                    let span = columns[1] - columns[0] + rows[1] - rows[0];
                    [Floats::load(fields[0].as_ptr()), Floats::load(fields[1].as_ptr()), span]
                }
            }
        }
    }

    /// The windows, to be looked at one by one.
    ///
    /// # Safety
    /// As [`Rects::sums`].
    #[inline(always)]
    pub unsafe fn each(&self) -> Each {
        // SAFETY: as the caller's.
        unsafe {
            let (columns, rows) = match *self {
                Rects::Alike { rows: Rows { radius, first, span, .. }, place } => {
                    let steps = Floats::load(STEPS.as_ptr());
                    let [left, right] =
                        [Floats::whole(place - radius), Floats::whole(place + radius)];
                    (
                        [left + steps, right + steps],
                        [Floats::whole(first), Floats::whole(first + span)],
                    )
                }
                Rects::Each { columns, rows } => (columns, rows),
            };
            let [left, right] = columns;
            let [top, bottom] = rows;
            Each { columns: [indices(left), indices(right)], rows: [indices(top), indices(bottom)] }
        }
    }
}

/// The first and last columns, as places, and rows of eight windows.
pub(crate) struct Each {
    columns: [Indices; 2],
    rows: [Indices; 2],
}

impl Each {
    /// Where the outermost points of a window's middle row (`line` 0) or column are that are there, and how far apart that
    /// is; none if there are not two.
    #[inline(always)]
    pub fn outermost<const N: usize>(
        &self,
        rings: &Rings<N>,
        line: usize,
        lane: usize,
    ) -> Option<([usize; 2], usize)> {
        let of_lane = |ends: &[Indices; 2]| [ends[0][lane] as usize, ends[1][lane] as usize];
        let (columns, rows) = (of_lane(&self.columns), of_lane(&self.rows));
        let middle = |[first, last]: [usize; 2]| (first + last) / 2;
        let (ends, [first, last]) = if line == 0 {
            let y = middle(rows);
            let found = rings.presence.of_row(y, columns)?;
            (found.map(|x| rings.place_of_point(x, y)), found)
        } else {
            let x = middle(columns);
            let found = rings.presence.of_column(x, rows)?;
            (found.map(|y| rings.place_of_point(x, y)), found)
        };
        (first < last).then_some((ends, last - first))
    }
}

/// The one in the middle between whole numbers, or before the middle.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn middle<S: Groups>([first, last]: [Floats<S>; 2]) -> Floats<S> {
    // SAFETY: as the caller's.
    unsafe { first + Floats(S::truncate(((last - first) * Floats::splat(0.5)).0)) }
}

/// Whole numbers, as indices.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn indices<S: Groups>(places: Floats<S>) -> Indices {
    let mut indices = [0; GROUP];
    // SAFETY: as the caller's.
    unsafe { S::store_i(indices.as_mut_ptr(), S::truncate_i(places.0)) };
    indices
}

/// Has indices loaded one by one: to take them out of vectors takes longer.
#[inline(always)]
fn one_by_one<T>(indices: &T) -> &T {
    black_box(indices)
}

/// A window's corners, above and below, left and right: where their eight channels are.
type Corners = [[usize; 2]; 2];
/// These corners' rows and ends.
const ENDS: [[[usize; 2]; 2]; 2] = [[[0, 0], [0, 1]], [[1, 0], [1, 1]]];

/// The sums between the corners of eight windows, which are of pixels side by side and `ALIKE`, or not.
///
/// # Safety
/// The processor has the instruction set of `S`; the rings have such elements.
#[inline(always)]
unsafe fn sums_between<S: Groups, const N: usize, const ALIKE: bool>(
    rings: &Rings<N>,
    corners: impl Fn(usize) -> Corners,
) -> [Doubles<S>; N] {
    let [eights, fours, pairs] = rings.sums();
    let four = |lane: usize| {
        corners(lane).map(|row| row.map(|corner| fours.wrapping_byte_add(4 * corner)))
    };
    let pair = |lane: usize| {
        corners(lane).map(|row| row.map(|corner| pairs.wrapping_byte_add(2 * corner)))
    };
    // SAFETY: as the caller's.
    unsafe {
        let zero = S::splat_d(0.0);
        let mut channels = [Doubles(zero); N];
        if Rings::<N>::HAS_EIGHT {
            let mut windows = [zero; GROUP];
            for lane in 0..GROUP {
                let load = |corner| Doubles::<S>(S::load_d(eights.wrapping_add(corner)));
                windows[lane] = between(corners(lane), load).0;
            }
            let eight = S::transpose_d(windows);
            for i in 0..8 {
                channels[i] = Doubles(eight[i]);
            }
        }
        if Rings::<N>::HAS_FOUR {
            let mut windows = [zero; 4];
            if ALIKE {
                for i in 0..4 {
                    windows[i] = between(four(2 * i), |corner| Doubles::<S>(S::load_d(corner))).0;
                }
                let [a, b, c, d] = windows;
                let ([a, b], [c, d]) = (S::join_halves_d(a, c), S::join_halves_d(b, d));
                windows = [a, b, c, d];
            } else {
                for lane in 0..4 {
                    let two = [four(lane), four(4 + lane)];
                    let load = |[row, end]: [usize; 2]| {
                        Doubles::<S>(S::load_fours_d(|window| two[window][row][end]))
                    };
                    windows[lane] = between(ENDS, load).0;
                }
            }
            let four = S::transpose_fours_d(windows);
            for i in 0..4 {
                channels[N - 4 + i] = Doubles(four[i]);
            }
        }
        if Rings::<N>::HAS_PAIR {
            let mut windows = [zero; 2];
            for half in 0..2 {
                let first = 4 * half;
                windows[half] = if ALIKE {
                    between(pair(first), |corner| Doubles::<S>(S::load_d(corner))).0
                } else {
                    let four = [pair(first), pair(first + 1), pair(first + 2), pair(first + 3)];
                    let load = |[row, end]: [usize; 2]| {
                        Doubles::<S>(S::load_pairs_d(|window| four[window][row][end]))
                    };
                    between(ENDS, load).0
                };
            }
            let [first, second] = S::unpair_d(windows[0], windows[1]);
            [channels[N - 2], channels[N - 1]] = [Doubles(first), Doubles(second)];
        }
        channels
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
            let steps = Floats::<S>::load(STEPS.as_ptr()) * Floats::whole(self.step);
            let columns = steps + Floats::whole(self.x);
            columns.min(Floats::whole(self.width - 1))
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
        [start, end.min(Floats::whole(count))]
    }
}
