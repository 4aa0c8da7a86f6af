//! Sums of half windows of z, for AVERAGE_DEPTH_CHANGE: the paper's one integral image.
//!
//! It is of integers or of f64, as `depth` says. Half windows of one point are read from the points: exactly.

use super::arithmetic::{Floats, between};
use super::buffer::Buffer;
use super::by_side;
use super::depth::DepthSum;
use super::estimates::Found;
use super::pair::Pair;
use super::planes::{Frame, MARGIN, Planes};
use super::run::{Lane, OfRun};
use super::tile::{Sums, Tile};
use crate::Error;
use crate::memory::{bytes, make_room};
use crate::rect::Rect;
use crate::simd::{Groups, Simd};
use crate::vector::{cross, dot};
use crate::window::Image;

/// The ring of integral rows of z.
#[derive(Debug, Default)]
pub(crate) struct HalfWindows<T> {
    integrals: Buffer<T>,
    /// The place of the row pushed last; before the first the one after the ring, which is zero.
    pushed: usize,
    /// What depths are multiplied by.
    scale: f32,
    /// Whether that is so of the rows that were pushed before, too.
    is_same_scale: bool,
    /// [`DOUBT_ROUNDING`] times the square of what the sums' rounding errors stay below.
    doubt: f32,
    /// By half of the side of a window.
    places: Vec<Places>,
    /// In the ring of points, the row aimed at, between the rows above and below.
    rows: [usize; 3],
    /// In the ring of integrals, the row above the one aimed at, and that one.
    middle: [usize; 2],
}

/// Horizontal and vertical tangent.
pub(super) type Tangents<T> = [[T; 3]; 2];

/// A normal is doubtful where floats could turn it by more than 1e-4: (sine of the angle between the tangents) < 1e-3.
const DOUBT_SINE: f32 = 1e-6;
/// Or where the sums' rounding could.
const DOUBT_ROUNDING: f64 = 1e8;

/// Where the rows that a window is made from begin, in the rings.
#[derive(Debug)]
struct Places {
    /// Of integrals, which end before a half window and with it: for those to the left and right.
    beside: [usize; 2],
    /// Of integrals, before the half window above, and with the one below.
    outer: [usize; 2],
    /// Of points, those of the vertical tangent's ends.
    ends: [usize; 2],
    /// One over the points in a half window, and over the scale of sums.
    share: f32,
}

impl Places {
    fn of(frame: &Frame, y: usize, half: usize, scale: f32) -> Self {
        let share = 1.0 / ((half * half) as f32 * scale);
        let (half, quarter) = (half as isize, (half / 2) as isize);
        let row = |planes: usize, row: isize| frame.start(planes, y.wrapping_add_signed(row));
        Places {
            beside: [row(1, -quarter - 1), row(1, half - quarter - 1)],
            outer: [row(1, -half - 1), row(1, half)],
            ends: [row(3, -quarter), row(3, quarter)],
            share,
        }
    }
}

/// The sum between two columns, counted from the pixel that the integral rows above and below are given from.
///
/// # Safety
/// The processor has the instruction set of `S`, and the lanes at the corners are inside the ring.
#[inline(always)]
unsafe fn sum_between<S: Simd, T: Lane>(
    [above, below]: [*const T; 2],
    [left, right]: [isize; 2],
) -> T::Of<S> {
    // SAFETY: as the caller's.
    unsafe {
        let corners = [above, below].map(|row| [left, right].map(|at| row.wrapping_offset(at)));
        between(corners, |corner| T::load::<S>(corner))
    }
}

impl<T: DepthSum> HalfWindows<T> {
    /// With depths multiplied so.
    pub fn scaled(&mut self, scale: f32) -> &mut Self {
        self.is_same_scale = scale == self.scale;
        self.scale = scale;
        self
    }

    /// The sum over pixels inside the image.
    #[inline]
    fn sum(&self, frame: &Frame, rect: &Rect) -> T {
        let along = |end_row: usize| {
            if end_row == 0 {
                return T::default();
            }
            let row = frame.start(1, end_row - 1);
            let to = |x: usize| self.integrals[row + frame.column(x) - 1];
            to(rect.x.end).minus(to(rect.x.start))
        };
        along(rect.y.end).minus(along(rect.y.start))
    }

    /// The tangents of the windows of `side` x `side` around the pixels from `x` on, one in each lane, of the row aimed at. The
    /// windows, and the pixels around them, lie inside the image and hold finite points only.
    ///
    /// # Safety
    /// As [`Sums::note`].
    #[inline(always)]
    pub unsafe fn of_pixels<S: Simd>(
        &self,
        planes: &Planes,
        x: usize,
        side: usize,
    ) -> Tangents<Floats<S>> {
        let frame = &planes.frame;
        let (half, quarter) = (side / 2, side / 4);
        let Places { beside, outer, ends, share } = &self.places[half];
        let x = frame.column(x);
        // SAFETY: as the caller's: rows and columns are held, and so are the lanes from these columns on.
        unsafe {
            let points = planes.as_ptr().wrapping_add(x);
            let plane = |c: usize, row: usize| points.wrapping_add(row + c * frame.stride);
            let point = |at: *const f32| Floats::<S>::load(at);
            let [above, own, below] = self.rows;
            let mut tangents = if half == 1 {
                let own = plane(2, own);
                let across = point(own.wrapping_add(1)) - point(own.wrapping_sub(1));
                let along = point(plane(2, below)) - point(plane(2, above));
                [[across; 3], [along; 3]]
            } else {
                let ring = self.integrals.as_ptr().wrapping_add(x);
                let rows = |rows: [usize; 2]| rows.map(|row| ring.wrapping_add(row));
                let (beside, [above, own], [first, last]) =
                    (rows(*beside), rows(self.middle), rows(*outer));
                let (half, quarter) = (half as isize, quarter as isize);
                let (before, with) = (-quarter - 1, half - quarter - 1);
                let left = sum_between::<S, T>(beside, [-half - 1, -1]);
                let right = sum_between::<S, T>(beside, [0, half]);
                let up = sum_between::<S, T>([first, above], [before, with]);
                let down = sum_between::<S, T>([own, last], [before, with]);
                let (across, along) = (right - left, down - up);
                let share = Floats::<S>::splat(*share);
                [[T::floats::<S>(across) * share; 3], [T::floats::<S>(along) * share; 3]]
            };
            for c in 0..2 {
                let own = plane(c, own);
                let (left, right) = (own.wrapping_sub(quarter + 1), own.wrapping_add(quarter + 1));
                let [up, down] = ends.map(|row| plane(c, row));
                tangents[0][c] = point(right) - point(left);
                tangents[1][c] = point(down.wrapping_add(1)) - point(up.wrapping_sub(1));
            }
            tangents
        }
    }

    /// Those of a window that crosses the border of the image and is mirrored there; none if it is left to the plain form.
    pub fn of_mirrored(
        &self,
        planes: &Planes,
        image: &Image,
        (x, y): (usize, usize),
        side: usize,
    ) -> Option<Tangents<f32>> {
        let frame = &planes.frame;
        let (half, quarter) = (side / 2, (side / 4) as isize);
        if half == 1 {
            return None; // floats decide there
        }
        let scale = f64::from(self.scale);
        let own = T::of_one(planes.row(2, y)[frame.column(x)] * self.scale);
        let (x, y) = (x as isize, y as isize);
        let mean = |start: (isize, isize)| {
            let (mut sum, mut count) = (T::default(), 0_i32);
            for (rect, sign) in image.rects(start, (half, half)) {
                let of_rect = self.sum(frame, &rect);
                sum = if sign > 0 { sum.plus(of_rect) } else { sum.minus(of_rect) };
                count += sign * rect.area() as i32;
            }
            (count > 0).then(|| sum.about(own, count) / (scale * f64::from(count)))
        };
        let left = mean((x - half as isize, y - quarter))?;
        let right = mean((x + 1, y - quarter))?;
        let up = mean((x - quarter, y - half as isize))?;
        let down = mean((x - quarter, y + 1))?;
        let point = |x, y| {
            let (x, y) = image.pixel(x, y);
            [0, 1].map(|c| planes.row(c, y)[frame.column(x)])
        };
        let difference = |a: [f32; 2], b: [f32; 2], z| [a[0] - b[0], a[1] - b[1], z];
        let horizontal = [point(x + quarter + 1, y), point(x - quarter - 1, y)];
        let vertical = [point(x + 1, y + quarter), point(x - 1, y - quarter)];
        Some([
            difference(horizontal[0], horizontal[1], (right - left) as f32),
            difference(vertical[0], vertical[1], (down - up) as f32),
        ])
    }
}

impl<T: DepthSum> Sums for HalfWindows<T> {
    type OfRun = OfRun<f32, 6>;

    const COLUMN: usize = size_of::<T>();
    const CURVATURE: bool = false;
    const LIMITED: bool = false;
    const EXACT: bool = T::EXACT;

    fn reserve(&mut self, frame: &Frame, side: usize) -> Result<(), Error> {
        frame.reserve_ring(&mut self.integrals)?;
        make_room(&mut self.places, side / 2 + 1)
    }

    fn start(&mut self, frame: &Frame, limit: f32, _side: usize, _origin: [f32; 3]) {
        self.pushed = frame.start_ring(&mut self.integrals);
        let error = T::error(self.scale, limit, frame.columns.len() * frame.rows.len());
        self.doubt = (DOUBT_ROUNDING * error * error) as f32;
    }

    fn goes_on(&self, _limit: f32, _side: usize, _origin: [f32; 3]) -> bool {
        self.is_same_scale
    }

    fn size(&self) -> usize {
        self.integrals.size() + bytes(&self.places)
    }

    #[inline(always)]
    unsafe fn push<S: Groups>(&mut self, planes: &Planes, y: usize) {
        let frame = &planes.frame;
        let place = frame.place(y);
        let (steps, lanes) = (frame.steps::<T::Pushed<S>>(), <T::Pushed<S> as Simd>::LANES);
        assert!(MARGIN + steps * lanes <= frame.stride);
        assert!(frame.start_of(1, frame.ring + 1) <= self.integrals.len());
        let z = planes.row(2, y).as_ptr();
        let integrals = self.integrals.as_mut_ptr();
        // SAFETY: as the caller's; the lanes lie inside the row of the ring, as was just checked.
        unsafe {
            let above = integrals.add(frame.start_of(1, self.pushed));
            let row = integrals.add(frame.start_of(1, place));
            *row.add(MARGIN - 1) = T::default();
            let scale = Floats::splat(self.scale);
            let mut carry = T::of::<T::Pushed<S>>(Floats::splat(0.0));
            for step in 0..steps {
                let at = MARGIN + step * lanes;
                let depths = T::of::<T::Pushed<S>>(Floats::load(z.add(at)) * scale);
                let along = T::running_sum::<S>(depths, &mut carry);
                let sums = along + T::load::<T::Pushed<S>>(above.add(at));
                T::store::<T::Pushed<S>>(row.add(at), sums);
            }
        }
        self.pushed = place;
    }

    fn aim(&mut self, frame: &Frame, y: usize, side: usize) {
        let scale = self.scale;
        self.places.clear();
        self.places.extend((0..=side / 2).map(|half| Places::of(frame, y, half, scale)));
        self.rows = [y.wrapping_sub(1), y, y + 1].map(|row| frame.start(3, row));
        self.middle = [y.wrapping_sub(1), y].map(|row| frame.start(1, row));
    }

    #[inline(always)]
    unsafe fn note<S: Groups>(
        &self,
        tile: &Tile,
        planes: &Planes,
        pair: &Pair,
        run: &mut Self::OfRun,
        at: usize,
    ) -> u32 {
        // SAFETY: as the caller's.
        unsafe { by_side::note::<S, T>(self, tile, planes, pair, run, at) }
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(
        &self,
        run: &OfRun<f32, 6>,
        at: usize,
        sides: S::F,
        _error: f64,
    ) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe {
            let [hx, hy, hz, vx, vy, vz] = run.load::<S>(at);
            let (h, v) = ([hx, hy, hz], [vx, vy, vz]);
            let n = cross(h, v);
            let n2 = dot(n, n);
            let (h2, v2) = (dot(h, h), dot(v, v));
            let sine = h2 * v2 * Floats::splat(DOUBT_SINE);
            let doubt = Floats::splat(self.doubt);
            let half = Floats::<S>(S::truncate(S::mul(sides, S::splat(0.5))));
            let points = half * half;
            // Rounding moves the tangents along z, and so the normal by the other tangent's length across z.
            let across_z = (hx * hx + hy * hy) + (vx * vx + vy * vy);
            let exact = (doubt * across_z).lt(n2 * T::reduction(points));
            // Below this, squares of floats lose digits.
            let least = Floats::splat(f32::MIN_POSITIVE / f32::EPSILON);
            let mut sure = exact & sine.max(least).lt(n2);
            // In windows of 3 both tangents join the same two points: floats decide the direction, as in PCL.
            let smallest = Floats::<S>(sides).lt(Floats::splat(4.0));
            if smallest != 0 {
                // And where they say that the tangents are parallel, there is no normal: n / |n| is NaN then.
                let zero = Floats::splat(0.0);
                let parallel = !(zero.lt(n[0].abs().max(n[1].abs()).max(n[2].abs())));
                let is_long = least.lt(n2) & n2.lt(Floats::splat(f32::INFINITY));
                sure |= smallest & (is_long | parallel & least.lt(h2) & least.lt(v2));
            }
            let scale = Floats::splat(1.0) / n2.sqrt();
            Found {
                normal: [n[0] * scale, n[1] * scale, n[2] * scale],
                curvature: Floats::splat(f32::NAN),
                doubtful: !sure,
            }
        }
    }
}
