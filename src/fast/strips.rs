//! Sums of strips, for SIMPLE_3D_GRADIENT.
//!
//! Its gradients are the differences between a window's outermost columns and between its outermost rows: two prefix
//! sums, down the columns and along the rows, give both. They are held side by side, as for AVERAGE_3D_GRADIENT, each
//! counted from where both have the same corners if the window's side is even.

use super::buffer::Buffer;
use super::estimates::Found;
use super::gradients::{
    Both, Gradients, HORIZONTAL, LeftCorners, PIXEL, Scale, VERTICAL, place, sum_between,
};
use super::pair::Pair;
use super::planes::{Frame, MARGIN, Planes};
use super::tile::{Sums, Tile};
use crate::Error;
use crate::memory::{bytes, make_room};
use crate::methods::start;
use crate::simd::{Along, GROUP, Groups, Simd};
use crate::window::Image;

/// The ring of prefix sums.
#[derive(Debug, Default)]
pub(crate) struct Strips {
    /// Of a pixel (x, y): the sum of column x down to row y, and that of row y + 1 up to column x - 1.
    ring: Buffer<Both<i32>>,
    /// Three planes of one row: the sums of columns down to the row pushed last.
    columns: Buffer<i32>,
    scale: Scale,
    /// By the side of a window, in bytes, which addresses are made of at once: its left corners above, the same for both
    /// gradients, and below, for the horizontal and for the vertical one.
    places: Vec<[usize; 3]>,
}

impl Strips {
    /// Adds row `y` of the planes, which completes the sums of the row above.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn push_row<S: Along>(&mut self, planes: &Planes, y: usize) {
        let frame = &planes.frame;
        let steps = frame.steps::<S>();
        assert!(MARGIN + steps * S::LANES <= frame.stride);
        let columns = self.columns[..3 * frame.stride].as_mut_ptr();
        let points = planes.rows(y).map(<[f32]>::as_ptr);
        let done = frame.start(1, y.wrapping_sub(1));
        let ring = self.ring[done..done + frame.stride].as_mut_ptr().cast::<i32>();
        // SAFETY: as the caller's; all lanes lie inside the rows, whose lengths were just checked.
        unsafe {
            let zero = S::splat_i(0);
            let mut carries = [zero; 3];
            for step in 0..steps {
                let step = MARGIN + step * S::LANES;
                let mut both = [zero; GROUP];
                for c in 0..3 {
                    let at = c * frame.stride + step;
                    let point = self.scale.integers::<S>(c, S::load(points[c].add(step)));
                    let along = S::running_sum_i(point, &mut carries[c]);
                    both[VERTICAL + c] = S::sub_i(along, point);
                    both[c] = S::load_i(columns.add(at));
                    S::store_i(columns.add(at), S::add_i(both[c], point));
                }
                S::store_by_lanes(both, ring.add(GROUP * step));
            }
        }
    }

    /// The gradients of a window that crosses the border of the image.
    fn of_clipped(
        &self,
        frame: &Frame,
        image: &Image,
        (x, y): (usize, usize),
        side: usize,
    ) -> Both<f32> {
        let [left, top] = [x, y].map(|at| start(at, side));
        let [right, bottom] = [x, y].map(|at| (at + side / 2) as isize);
        let above =
            |x: usize, y: usize| self.ring[frame.start(1, y.wrapping_sub(1)) + frame.column(x)];
        let down = |x: usize, y: usize| {
            if y == image.height {
                // A row is in the ring once the one below it is pushed.
                return [0, 1, 2].map(|c| self.columns[c * frame.stride + frame.column(x)]);
            }
            let [column @ .., _, _, _, _, _] = above(x, y);
            column
        };
        let along = |x: usize, y: usize| {
            let [_, _, _, _, row @ .., _] = above(x, y);
            row
        };
        let horizontal = [(right, top), (left, top)].map(|strip| {
            let rect = image.rects(strip, (1, side)).next()?.0;
            Some(([down(rect.x.start, rect.y.end), down(rect.x.start, rect.y.start)], rect.area()))
        });
        let vertical = [(left, bottom), (left, top)].map(|strip| {
            let rect = image.rects(strip, (side, 1)).next()?.0;
            Some((
                [along(rect.x.end, rect.y.start), along(rect.x.start, rect.y.start)],
                rect.area(),
            ))
        });
        let [[hx, hy, hz], [vx, vy, vz]] = [horizontal, vertical].map(|strips| {
            // Of strips beyond the border nothing is left.
            let [ahead, behind] = strips.map(|strip| {
                let ([end, start], area) = strip.unwrap_or_default();
                ([0, 1, 2].map(|c| end[c].wrapping_sub(start[c])), area as isize)
            });
            let points = ahead.1 - behind.1;
            [0, 1, 2].map(|c| self.scale.sum(c, ahead.0[c].wrapping_sub(behind.0[c]), points))
        });
        [hx, hy, hz, 0.0, vx, vy, vz, 0.0]
    }
}

impl LeftCorners for [usize; 3] {
    #[inline(always)]
    unsafe fn gradients<S: Simd>(self, pixel: *const Both<i32>, side: usize) -> S::I {
        // SAFETY: as the caller's.
        unsafe {
            if side.is_multiple_of(2) {
                let [above, below, _] = self;
                return sum_between::<S>(pixel, [above, below], side);
            }
            self.gradients_of_one::<S>(pixel, side)
        }
    }

    #[inline(always)]
    unsafe fn gradients_of_one<S: Simd>(self, pixel: *const Both<i32>, side: usize) -> S::I {
        let [above, horizontal, vertical] = self;
        // SAFETY: as the caller's.
        unsafe {
            let both = sum_between::<S>(pixel, [above, horizontal], side & !1);
            S::select_bits_i(HORIZONTAL, both, sum_between::<S>(pixel, [above, vertical], side))
        }
    }
}

impl Sums for Strips {
    type OfRun = Gradients;

    const COLUMN: usize = PIXEL;
    const CURVATURE: bool = false;
    const LIMITED: bool = true;
    const EXACT: bool = true;

    fn reserve(&mut self, frame: &Frame, side: usize) -> Result<(), Error> {
        self.ring.grow(frame.start_of(1, frame.ring))?;
        self.columns.grow(3 * frame.stride)?;
        make_room(&mut self.places, side + 1)
    }

    fn start(&mut self, _frame: &Frame, limit: f32, side: usize, origin: [f32; 3]) {
        self.columns.fill(0);
        self.scale = Scale::new(2, limit, side, origin);
    }

    fn goes_on(&self, limit: f32, side: usize, origin: [f32; 3]) -> bool {
        self.scale == Scale::new(2, limit, side, origin)
    }

    fn limit(&self) -> f32 {
        self.scale.limit
    }

    fn size(&self) -> usize {
        self.ring.size() + self.columns.size() + bytes(&self.places)
    }

    #[inline(always)]
    unsafe fn push<S: Groups>(&mut self, planes: &Planes, y: usize) {
        // SAFETY: as the caller's.
        unsafe { self.push_row::<S::Widest>(planes, y) };
    }

    fn aim(&mut self, frame: &Frame, y: usize, side: usize) {
        // Columns end before the window and with it; rows are kept one row higher.
        let places = |side: usize| {
            let half = (side / 2) as isize;
            [-half - 1, side as isize - half - 1, half - 1].map(|row| place(frame, y, [row, -half]))
        };
        self.places.clear();
        self.places.extend((0..=side).map(places));
    }

    #[inline(always)]
    unsafe fn note<S: Groups>(
        &self,
        tile: &Tile,
        Planes { frame, .. }: &Planes,
        pair: &Pair,
        run: &mut Gradients,
        at: usize,
    ) -> u32 {
        let inside = tile.inside(pair);
        if inside != 0 {
            // SAFETY: as the caller's.
            unsafe { run.note::<S, _>(&self.ring, &self.places, frame, pair, inside, at) };
        }
        let crossing = pair.windows & !inside;
        let gradients =
            |pixel: (usize, usize), side: usize| self.of_clipped(frame, tile.image, pixel, side);
        if crossing == 0 { 0 } else { run.note_crossing(tile, pair, crossing, at, gradients) }
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(
        &self,
        run: &Gradients,
        at: usize,
        sides: S::F,
        _error: f64,
    ) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { run.normals(&self.scale, at, sides) }
    }
}
