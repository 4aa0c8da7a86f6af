//! Sums of pairs of strips, for AVERAGE_3D_GRADIENT.
//!
//! Over a whole window the sum of P(x+1) - P(x-1) telescopes to the window's last column and the one after, minus its
//! first and the one before; so two prefix sums, down the columns and along the rows, give both gradients. The two are
//! held side by side, each counted from where both have the same corners: a pixel's gradients are four reads,
//! whatever the windows of its neighbours.

use super::buffer::Buffer;
use super::estimates::Found;
use super::gradients::{Both, Gradients, LeftCorners, PIXEL, Scale, VERTICAL, place, sum_between};
use super::pair::Pair;
use super::planes::{Frame, MARGIN, Planes};
use super::tile::{Sums, Tile};
use crate::Error;
use crate::memory::{bytes, make_room};
use crate::methods::{Estimate, average_3d_gradient, start};
use crate::simd::{Along, GROUP, Groups, Simd};
use crate::window::Image;

/// The ring of prefix sums.
#[derive(Debug, Default)]
pub(crate) struct StripPairs {
    /// Of a pixel (x, y): the sum of columns x - 1 and x down to row y; and that of rows y and y + 1 up to column x - 1.
    ring: Buffer<Both<i32>>,
    /// Three planes of one row: the sums down to the row pushed last, that row, and the one before it.
    columns: Buffer<i32>,
    last: Buffer<i32>,
    above: Buffer<i32>,
    scale: Scale,
    /// By the side of a window: its left corners above and below, in bytes, which addresses are made of at once. A
    /// window of no side is of no sum.
    places: Vec<[usize; 2]>,
}

impl StripPairs {
    /// Adds row `y` of the planes, which completes the sums of the row above.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn push_row<S: Along>(&mut self, planes: &Planes, y: usize) {
        let frame = &planes.frame;
        std::mem::swap(&mut self.last, &mut self.above);
        let steps = frame.steps::<S>();
        assert!(MARGIN + steps * S::LANES <= frame.stride);
        let length = 3 * frame.stride;
        let columns = self.columns[..length].as_mut_ptr();
        let (last, above) = (self.last[..length].as_mut_ptr(), self.above[..length].as_ptr());
        let done = frame.start(1, y.wrapping_sub(1));
        let ring = self.ring[done..done + frame.stride].as_mut_ptr().cast::<i32>();
        // SAFETY: as the caller's; all lanes lie inside the rows, whose lengths were just checked.
        unsafe {
            for c in 0..3 {
                let from = planes.row(c, y).as_ptr();
                for step in 0..steps {
                    let at = MARGIN + step * S::LANES;
                    let point = self.scale.integers::<S>(c, S::load(from.add(at)));
                    S::store_i(last.add(c * frame.stride + at), point);
                }
            }
            let zero = S::splat_i(0);
            let mut carries = [zero; 3];
            for step in 0..steps {
                let step = MARGIN + step * S::LANES;
                let mut both = [zero; GROUP];
                for c in 0..3 {
                    let at = c * frame.stride + step;
                    let point = S::load_i(last.add(at));
                    let rows = S::add_i(point, S::load_i(above.add(at)));
                    let along = S::running_sum_i(rows, &mut carries[c]);
                    both[VERTICAL + c] = S::sub_i(along, rows);
                    both[c] = S::load_i(columns.add(at));
                    let strip = S::add_i(point, S::load_i(last.add(at - 1)));
                    S::store_i(columns.add(at), S::add_i(both[c], strip));
                }
                S::store_by_lanes(both, ring.add(GROUP * step));
            }
        }
    }

    /// The gradients of a window that crosses the border of the image.
    fn of_mirrored(
        &self,
        frame: &Frame,
        image: &Image,
        (x, y): (usize, usize),
        side: usize,
    ) -> Both<f32> {
        // Those of each rectangle fit, those of all might not.
        let mut sums = [0_i64; GROUP];
        for (rect, _) in image.rects((start(x, side), start(y, side)), (side, side)) {
            let inside = image.inside_frame(&rect);
            if inside.x.is_empty() || inside.y.is_empty() {
                continue;
            }
            let at = |y: usize, x: usize| &self.ring[frame.start(1, y - 1) + frame.column(x)];
            let row = |y: usize| (at(y, inside.x.start), at(y, inside.x.end));
            let ((a, b), (c, d)) = (row(inside.y.start), row(inside.y.end));
            for i in 0..GROUP {
                let between = d[i].wrapping_sub(c[i]).wrapping_sub(b[i].wrapping_sub(a[i]));
                sums[i] += i64::from(between);
            }
        }
        sums.map(|sum| sum as f32)
    }
}

impl LeftCorners for [usize; 2] {
    #[inline(always)]
    unsafe fn gradients<S: Simd>(self, pixel: *const Both<i32>, side: usize) -> S::I {
        // SAFETY: as the caller's.
        unsafe { sum_between::<S>(pixel, self, side) }
    }
}

impl Sums for StripPairs {
    type OfRun = Gradients;

    const COLUMN: usize = PIXEL;
    const CURVATURE: bool = false;
    const LIMITED: bool = true;
    const EXACT: bool = true;

    fn reserve(&mut self, frame: &Frame, side: usize) -> Result<(), Error> {
        self.ring.grow(frame.start_of(1, frame.ring))?;
        for row in [&mut self.columns, &mut self.last, &mut self.above] {
            row.grow(3 * frame.stride)?;
        }
        make_room(&mut self.places, side + 1)
    }

    fn start(&mut self, _frame: &Frame, limit: f32, side: usize, origin: [f32; 3]) {
        self.columns.fill(0);
        self.last.fill(0); // it is what is above the first row
        self.scale = Scale::new(4, limit, side, origin);
    }

    fn goes_on(&self, limit: f32, side: usize, origin: [f32; 3]) -> bool {
        self.scale == Scale::new(4, limit, side, origin)
    }

    fn limit(&self) -> f32 {
        self.scale.limit
    }

    fn size(&self) -> usize {
        let StripPairs { ring, columns, last, above, places, .. } = self;
        let rows = [columns, last, above].map(Buffer::size).into_iter().sum::<usize>();
        ring.size() + rows + bytes(places)
    }

    #[inline(always)]
    unsafe fn push<S: Groups>(&mut self, planes: &Planes, y: usize) {
        // SAFETY: as the caller's.
        unsafe { self.push_row::<S::Widest>(planes, y) };
    }

    fn aim(&mut self, frame: &Frame, y: usize, side: usize) {
        let places = |side: usize| {
            let half = (side / 2) as isize;
            [-half - 1, side as isize - half - 1].map(|row| place(frame, y, [row, -half]))
        };
        self.places.clear();
        self.places.push([place(frame, y, [0, 0]); 2]);
        self.places.extend((1..=side).map(places));
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
            |pixel: (usize, usize), side: usize| self.of_mirrored(frame, tile.image, pixel, side);
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

    #[cold]
    fn precisely(&self, tile: &Tile, (pixel, side): ((usize, usize), usize)) -> Option<Estimate> {
        Some(average_3d_gradient::estimate_of_finite(tile.points, tile.image, pixel, side))
    }
}
