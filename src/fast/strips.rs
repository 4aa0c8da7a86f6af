//! Sums of strips, for the two gradient methods.
//!
//! Over a whole window the sum of P(x+1) - P(x-1) telescopes to the window's last two columns (and the one after)
//! minus its first (and the one before); so two prefix sums, down the columns and along the rows, give both gradients.
//! Coordinates are integers here, multiples of a power of two: their sums are exact whatever wraps around between,
//! as long as the differences fit, and the limit on the coordinates sees to that.

use super::arithmetic::{Floats, cross, dot};
use super::buffer::Buffer;
use super::planes::{Corners, Frame, MARGIN, Planes};
use super::run::OfRun;
use super::tile::{Found, Sums};
use crate::Error;
use crate::memory::{bytes, make_room};
use crate::simd::{Along, Groups, Simd};
use crate::window::Image;

/// The rings of AVERAGE_3D_GRADIENT (`SIMPLE` false), whose strips are pairs of columns and of rows, or of
/// SIMPLE_3D_GRADIENT, whose strips are single ones.
#[derive(Debug, Default)]
pub(crate) struct Strips<const SIMPLE: bool> {
    /// Per row, 3 planes each: sums down the columns, and along the rows.
    columns: Buffer<i32>,
    rows: Buffer<i32>,
    /// The row pushed last and the one before it, as integers.
    last: Buffer<i32>,
    above: Buffer<i32>,
    origin: [f32; 3],
    scale: f32,
    /// Of [`DOUBT_ROUNDING`].
    doubt: f32,
    /// The place of the row pushed last; before the first the one after the ring, which is zero.
    pushed: usize,
    /// By the side of a window: its places.
    places: Vec<Places>,
}

/// In the ring of columns and in that of rows.
type Places = [Corners; 2];

/// Horizontal and vertical gradient.
type Gradients<T> = [[T; 3]; 2];

/// Rounding to integers moves a sum of 4 `side` coordinates by about sqrt(side). A normal is doubtful where that could
/// turn it by more than 1e-4, or where floats could: (sine of the angle between the tangents) < 1e-3.
const DOUBT_ROUNDING: f32 = 4e8;
const DOUBT_SINE: f32 = 1e-6;

impl<const SIMPLE: bool> Strips<SIMPLE> {
    /// Adds row `y` of the planes.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn push_row<S: Along>(&mut self, frame: &Frame, planes: &Planes, y: usize) {
        std::mem::swap(&mut self.last, &mut self.above);
        let steps = frame.steps::<S>();
        for c in 0..3 {
            let start = c * frame.stride;
            let own = frame.start(3, y) + start;
            let above = frame.start_of(3, self.pushed) + start;
            let from = planes.row(frame, c, y).as_ptr();
            let last = &mut self.last[start..start + frame.stride];
            let pair = &self.above[start..start + frame.stride];
            let rows = &mut self.rows[own..own + frame.stride];
            assert!(
                MARGIN + steps * S::LANES <= frame.stride
                    && own.max(above) + frame.stride <= self.columns.len()
            );
            // SAFETY: as the caller's; all lanes lie inside the rows, whose lengths were just checked.
            unsafe {
                let (origin, scale) = (S::splat(self.origin[c]), S::splat(self.scale));
                let mut carry = S::splat_i(0);
                for step in 0..steps {
                    let at = MARGIN + step * S::LANES;
                    let point = S::sub(S::load(from.add(at)), origin);
                    let point = S::round_i(S::mul(point, scale));
                    S::store_i(last.as_mut_ptr().add(at), point);
                    let strip = if SIMPLE {
                        point
                    } else {
                        S::add_i(point, S::load_i(pair.as_ptr().add(at)))
                    };
                    let sum = S::running_sum_i(strip, &mut carry);
                    S::store_i(rows.as_mut_ptr().add(at), sum);
                }
                let columns = self.columns.as_mut_ptr();
                for step in 0..steps {
                    let at = MARGIN + step * S::LANES;
                    let mut strip = S::load_i(last.as_ptr().add(at));
                    if !SIMPLE {
                        strip = S::add_i(strip, S::load_i(last.as_ptr().add(at - 1)));
                    }
                    strip = S::add_i(strip, S::load_i(columns.add(above + at)));
                    S::store_i(columns.add(own + at), strip);
                }
            }
        }
        self.pushed = frame.place(y);
    }

    /// The sum between two columns' strips over the window's rows, and between two rows' strips over its columns: the
    /// prefix sums end before the window and with it.
    fn places(frame: &Frame, y: usize, side: usize) -> Places {
        let (half, side) = ((side / 2) as isize, side as isize);
        let far = if SIMPLE { half } else { side - half };
        let (strips, sums) = ([-half, far], [-half - 1, side - half - 1]);
        [frame.corners(3, y, sums, strips), frame.corners(3, y, strips, sums)]
    }
}

impl<const SIMPLE: bool> Sums for Strips<SIMPLE> {
    type OfLanes<S: Simd> = Gradients<S::I>;
    type Of1 = Gradients<i32>;
    type OfRun = OfRun<i32, 6>;

    const COLUMN: usize = 6 * size_of::<i32>();
    const CURVATURE: bool = false;
    const LIMITED: bool = true;
    const PAIRS: bool = true;

    fn reserve(&mut self, frame: &Frame, side: usize) -> Result<(), Error> {
        frame.reserve_ring(3, &mut self.columns)?;
        self.rows.grow(frame.start_of(3, frame.ring))?;
        for row in [&mut self.last, &mut self.above] {
            row.grow(3 * frame.stride)?;
        }
        make_room(&mut self.places, side + 1)
    }

    fn start(&mut self, frame: &Frame, limit: f32, side: usize, origin: [f32; 3]) {
        self.pushed = frame.start_ring(3, &mut self.columns);
        self.last.fill(0); // it is what is above the first row
        self.origin = origin;
        // 4 side limit scale < 2^31, and a power of two.
        let mut bits = 29.0 - (f64::from(limit) * side as f64).log2();
        self.doubt = DOUBT_ROUNDING;
        if origin != [0.0; 3] {
            // The way from there is rounded to a float first: for limit scale < 2^25 that at most doubles the error.
            bits = bits.min(25.0 - f64::from(limit).log2());
            self.doubt *= 4.0;
        }
        self.scale = bits.floor().clamp(-120.0, 120.0).exp2() as f32;
    }

    fn size(&self) -> usize {
        let Strips { columns, rows, last, above, places, .. } = self;
        let integers = [columns, rows, last, above].map(Buffer::size).into_iter().sum::<usize>();
        integers + bytes(places)
    }

    #[inline(always)]
    unsafe fn push<S: Groups>(&mut self, frame: &Frame, planes: &Planes, y: usize) {
        // SAFETY: as the caller's.
        unsafe { self.push_row::<S::Widest>(frame, planes, y) };
    }

    fn aim(&mut self, frame: &Frame, y: usize, side: usize) {
        self.places.clear();
        self.places.extend((0..=side).map(|side| Self::places(frame, y, side)));
    }

    #[inline(always)]
    unsafe fn of_pixels<S: Simd>(
        &self,
        frame: &Frame,
        _planes: &Planes,
        x: usize,
        side: usize,
    ) -> Self::OfLanes<S> {
        let [columns, rows] = &self.places[side];
        let x = frame.column(x);
        // SAFETY: as the caller's: rows and columns are held, and so are the groups from these columns on.
        unsafe {
            let mut sums = Self::none::<S>();
            for c in 0..3 {
                let x = x + c * frame.stride;
                sums[0][c] = difference::<S>(self.columns.as_ptr().add(x), columns);
                sums[1][c] = difference::<S>(self.rows.as_ptr().add(x), rows);
            }
            sums
        }
    }

    #[inline(always)]
    unsafe fn select<S: Simd>(
        lanes: u32,
        yes: Self::OfLanes<S>,
        no: Self::OfLanes<S>,
    ) -> Self::OfLanes<S> {
        let mut sums = no;
        for g in 0..2 {
            for c in 0..3 {
                // SAFETY: as the caller's.
                sums[g][c] = unsafe { S::select_i(lanes, yes[g][c], no[g][c]) };
            }
        }
        sums
    }

    #[inline(always)]
    unsafe fn none<S: Simd>() -> Self::OfLanes<S> {
        // SAFETY: as the caller's.
        [[unsafe { S::splat_i(0) }; 3]; 2]
    }

    fn of_mirrored(
        &self,
        frame: &Frame,
        _planes: &Planes,
        image: &Image,
        (x, y): (usize, usize),
        side: usize,
    ) -> Option<Self::Of1> {
        if SIMPLE {
            return None; // never mirrored
        }
        let half = (side / 2) as isize;
        let mut sums = [[0_i32; 3]; 2];
        for rect in image.rects((x as isize - half, y as isize - half), (side, side)) {
            let inside = rect.inside_frame(image);
            if inside.x.is_empty() || inside.y.is_empty() {
                continue;
            }
            let (x0, x1) = (inside.x.start, inside.x.end);
            let (y0, y1) = (inside.y.start, inside.y.end);
            for c in 0..3 {
                let column =
                    |y, x| self.columns[frame.start(3, y) + c * frame.stride + frame.column(x)];
                let row = |y, x| self.rows[frame.start(3, y) + c * frame.stride + frame.column(x)];
                let strip = |x| column(y1 - 1, x).wrapping_sub(column(y0 - 1, x));
                let segment = |y| row(y, x1 - 1).wrapping_sub(row(y, x0 - 1));
                sums[0][c] = sums[0][c].wrapping_add(strip(x1).wrapping_sub(strip(x0)));
                sums[1][c] = sums[1][c].wrapping_add(segment(y1).wrapping_sub(segment(y0)));
            }
        }
        Some(sums)
    }

    #[inline(always)]
    unsafe fn put<S: Simd>(sums: &mut Self::OfLanes<S>, lane: usize, one: Self::Of1) {
        for g in 0..2 {
            for c in 0..3 {
                // SAFETY: as the caller's.
                sums[g][c] = unsafe { S::select_i(1 << lane, S::splat_i(one[g][c]), sums[g][c]) };
            }
        }
    }

    #[inline(always)]
    unsafe fn note<S: Simd>(sums: Gradients<S::I>, run: &mut OfRun<i32, 6>, at: usize) {
        let [[a, b, c], [d, e, f]] = sums;
        // SAFETY: as the caller's.
        unsafe { run.store::<S>(at, [a, b, c, d, e, f]) }
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(
        &self,
        run: &OfRun<i32, 6>,
        at: usize,
        sides: S::F,
        _fresh: bool,
    ) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe {
            let [hx, hy, hz, vx, vy, vz] = run.load::<S>(at);
            let [h, v] = [float::<S>([hx, hy, hz]), float::<S>([vx, vy, vz])];
            let n = cross(v, h);
            let (n2, h2, v2) = (dot(n, n), dot(h, h), dot(v, v));
            let rounding = Floats(sides) * Floats::splat(self.doubt) * (h2 + v2);
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

/// The difference between the right and left of what is below and above, in a ring.
///
/// # Safety
/// The processor has the instruction set of `S`, and the groups at these corners are inside the ring.
#[inline(always)]
unsafe fn difference<S: Simd>(ring: *const i32, corners: &Corners) -> S::I {
    // SAFETY: as the caller's.
    unsafe {
        let at = |corner: usize| S::load_i(ring.wrapping_add(corners[corner]));
        S::sub_i(S::sub_i(at(3), at(2)), S::sub_i(at(1), at(0)))
    }
}

/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn float<S: Simd>(v: [S::I; 3]) -> [Floats<S>; 3] {
    // SAFETY: as the caller's.
    unsafe { [Floats(S::float_i(v[0])), Floats(S::float_i(v[1])), Floats(S::float_i(v[2]))] }
}
