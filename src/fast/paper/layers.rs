//! Layers of depth, for tiles whose depths are orders of magnitude apart, as outdoors or where a far plane stands for "no
//! return": what sums that hold the farthest points are rounded to would be too coarse for the nearest windows.
//!
//! A layer holds the points up to some depth. The deeper ones are hidden in it: they weigh so little that a fraction in
//! the weight of a window's points tells whether it has some. Its pixel waits for the next layer then, up to the last one,
//! which holds all points. (Depth alone tells too little: a far pixel left of or above a near one is no depth change to
//! Eq. 6, so that a window may hold both.)

use super::integrals::Counted;
use crate::Error;
use crate::fast::arithmetic::Doubles;
use crate::fast::lanes::LANES;
use crate::fast::run::RUN;
use crate::memory::{bytes, make_room};
use crate::simd::Simd;

/// What is nearer than this share of the deepest point's depth is in one layer.
const NEAREST: f32 = 1e-6;

/// What a hidden point weighs. A difference of points weighs the product of their weights.
const HIDDEN: f32 = 1.0 / 16384.0;

/// The largest radius of windows whose points weigh less than one together if all are hidden.
const LARGEST: usize = 63;

/// The points of a tile up to a depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    /// The largest magnitude of depth of a point that is not hidden.
    pub deepest: f32,
    /// Where sums are about, and where hidden points stand, which leaves nothing of them.
    pub origin: [f32; 3],
    pub is_first: bool,
}

/// All points.
impl Default for Layer {
    fn default() -> Self {
        Layer { deepest: f32::INFINITY, origin: [0.0; 3], is_first: true }
    }
}

impl Layer {
    /// The first layer of a tile with windows of up to this radius: of the points, the nearest of which is so deep, up to
    /// those `span` times as deep; none is deeper than `deepest`.
    pub fn first(depths: [f32; 2], span: f32, radius: usize) -> Layer {
        let first = Layer { is_first: true, ..Layer::next(depths, span) };
        if radius > LARGEST { Layer::default() } else { first }
    }

    /// As [`Layer::first`], of points that were hidden before.
    pub fn next([nearest, deepest]: [f32; 2], span: f32) -> Layer {
        let end = span * nearest.max(NEAREST * deepest);
        let deepest = if end < deepest { end } else { f32::INFINITY };
        Layer { deepest, is_first: false, ..Layer::default() }
    }

    /// What stands for a hidden point.
    pub fn hidden(&self) -> Counted {
        let [x, y, z] = self.origin;
        [x, y, z, HIDDEN]
    }

    /// Whether it may hide points.
    #[inline(always)]
    pub fn hides_some(&self) -> bool {
        self.deepest < f32::INFINITY
    }

    /// Whether it is one of several.
    pub fn is_partial(&self) -> bool {
        self.hides_some() || !self.is_first
    }
}

/// The lanes in which points, or differences, weigh no whole number together: some are hidden.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(crate) unsafe fn with_fraction<S: Simd>(weights: Doubles<S>) -> u32 {
    // SAFETY: as the caller's.
    unsafe {
        // Doubles this large have no fractions.
        let large = Doubles::splat(4_503_599_627_370_496.0);
        let whole = (weights + large) - large;
        whole.lt(weights) | weights.lt(whole)
    }
}

/// The pixels of a tile that wait for a layer with all points of their windows.
#[derive(Debug, Default)]
pub(crate) struct Waiting {
    /// Run by run, row by row: the lanes of each pair of groups.
    runs: Vec<[u32; RUN / LANES]>,
    across: usize,
}

impl Waiting {
    /// Bytes held.
    pub fn size(&self) -> usize {
        bytes(&self.runs)
    }

    /// Makes room for so many columns and rows.
    pub fn reserve(&mut self, columns: usize, rows: usize) -> Result<(), Error> {
        make_room(&mut self.runs, columns.div_ceil(RUN) * rows)
    }

    /// Has no pixel of so many columns and rows wait; there is room.
    pub fn start(&mut self, columns: usize, rows: usize) {
        self.across = columns.div_ceil(RUN);
        self.runs.clear();
        self.runs.resize(self.across * rows, Default::default());
    }

    /// Those of the run in a row that starts with this column.
    pub fn run(&mut self, column: usize, row: usize) -> &mut [u32; RUN / LANES] {
        &mut self.runs[row * self.across + column / RUN]
    }

    /// Whether there is any.
    pub fn is_any(&self) -> bool {
        self.runs.as_flattened().iter().any(|lanes| *lanes != 0)
    }
}
