//! Sums of strips, for SIMPLE_3D_GRADIENT.
//!
//! Its gradients are the differences between a window's outermost columns and between its outermost rows: two prefix
//! sums, down the columns and along the rows, give both.

use std::convert::Infallible;

use super::arithmetic::Integers;
use super::buffer::Buffer;
use super::by_side::{self, BySide};
use super::gradients::Scale;
use super::planes::{Corners, Frame, MARGIN, Planes, sum_between};
use super::run::OfRun;
use super::tile::{Found, Pair, Sums, Tile};
use crate::Error;
use crate::memory::{bytes, make_room};
use crate::simd::{Along, Groups, Simd};
use crate::window::Image;

/// The rings of prefix sums.
#[derive(Debug, Default)]
pub(crate) struct Strips {
    /// Per row, 3 planes each: sums down the columns, and along the rows.
    columns: Buffer<i32>,
    rows: Buffer<i32>,
    scale: Scale,
    /// The place of the row pushed last; before the first the one after the ring, which is zero.
    pushed: usize,
    /// By the side of a window: its places.
    places: Vec<Places>,
}

/// In the ring of columns and in that of rows.
type Places = [Corners; 2];

/// Horizontal and vertical gradient.
type Gradients<T> = [[T; 3]; 2];

impl Strips {
    /// Adds row `y` of the planes.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn push_row<S: Along>(&mut self, frame: &Frame, planes: &Planes, y: usize) {
        let steps = frame.steps::<S>();
        for c in 0..3 {
            let start = c * frame.stride;
            let own = frame.start(3, y) + start;
            let above = frame.start_of(3, self.pushed) + start;
            let from = planes.row(frame, c, y).as_ptr();
            let rows = &mut self.rows[own..own + frame.stride];
            assert!(
                MARGIN + steps * S::LANES <= frame.stride
                    && own.max(above) + frame.stride <= self.columns.len()
            );
            // SAFETY: as the caller's; all lanes lie inside the rows, whose lengths were just checked.
            unsafe {
                let columns = self.columns.as_mut_ptr();
                let mut carry = S::splat_i(0);
                for step in 0..steps {
                    let at = MARGIN + step * S::LANES;
                    let point = self.scale.integers::<S>(c, S::load(from.add(at)));
                    let sum = S::running_sum_i(point, &mut carry);
                    S::store_i(rows.as_mut_ptr().add(at), sum);
                    let column = S::add_i(point, S::load_i(columns.add(above + at)));
                    S::store_i(columns.add(own + at), column);
                }
            }
        }
        self.pushed = frame.place(y);
    }

    /// The difference between two columns over the window's rows, and between two rows over its columns: the prefix
    /// sums end before the window and with it.
    fn places(frame: &Frame, y: usize, side: usize) -> Places {
        let (half, side) = ((side / 2) as isize, side as isize);
        let (strips, sums) = ([-half, half], [-half - 1, side - half - 1]);
        [frame.corners(3, y, sums, strips), frame.corners(3, y, strips, sums)]
    }
}

impl Sums for Strips {
    type OfRun = OfRun<i32, 6>;

    const COLUMN: usize = 6 * size_of::<i32>();
    const CURVATURE: bool = false;
    const LIMITED: bool = true;

    fn reserve(&mut self, frame: &Frame, side: usize) -> Result<(), Error> {
        frame.reserve_ring(3, &mut self.columns)?;
        self.rows.grow(frame.start_of(3, frame.ring))?;
        make_room(&mut self.places, side + 1)
    }

    fn start(&mut self, frame: &Frame, limit: f32, side: usize, origin: [f32; 3]) {
        self.pushed = frame.start_ring(3, &mut self.columns);
        self.scale = Scale::new(2, limit, side, origin);
    }

    fn size(&self) -> usize {
        self.columns.size() + self.rows.size() + bytes(&self.places)
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
    unsafe fn note<S: Groups>(
        &self,
        tile: &Tile,
        frame: &Frame,
        planes: &Planes,
        pair: &Pair,
        run: &mut Self::OfRun,
        at: usize,
    ) -> u32 {
        // SAFETY: as the caller's.
        unsafe { by_side::note::<S, Self>(self, tile, frame, planes, pair, run, at) }
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
            let h = [hx.float(), hy.float(), hz.float()];
            let v = [vx.float(), vy.float(), vz.float()];
            self.scale.normals(h, v, sides)
        }
    }
}

impl BySide for Strips {
    type OfLanes<S: Simd> = Gradients<Integers<S>>;
    type Of1 = Infallible;

    const EVEN: bool = false;

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
                sums[0][c] = sum_between(self.columns.as_ptr().add(x), columns);
                sums[1][c] = sum_between(self.rows.as_ptr().add(x), rows);
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
                let lane = unsafe { S::select_i(lanes, yes[g][c].0, no[g][c].0) };
                sums[g][c] = Integers(lane);
            }
        }
        sums
    }

    #[inline(always)]
    unsafe fn none<S: Simd>() -> Self::OfLanes<S> {
        // SAFETY: as the caller's.
        [[Integers(unsafe { S::splat_i(0) }); 3]; 2]
    }

    fn of_mirrored(
        &self,
        _frame: &Frame,
        _planes: &Planes,
        _image: &Image,
        _pixel: (usize, usize),
        _side: usize,
    ) -> Option<Infallible> {
        None // the method has no mirrored windows
    }

    #[inline(always)]
    unsafe fn put<S: Simd>(_sums: &mut Self::OfLanes<S>, _lane: usize, one: Infallible) {
        match one {}
    }

    #[inline(always)]
    unsafe fn note_lanes<S: Simd>(
        sums: Gradients<Integers<S>>,
        run: &mut OfRun<i32, 6>,
        at: usize,
    ) {
        let [[a, b, c], [d, e, f]] = sums;
        // SAFETY: as the caller's.
        unsafe { run.store::<S>(at, [a, b, c, d, e, f]) }
    }
}
