//! Sums of first and second moments, for COVARIANCE_MATRIX: the paper's nine integral images (Eq. 16-25), in f64 and
//! about a point of the tile.

use super::arithmetic::{Doubles, Floats, dot};
use super::buffer::Buffer;
use super::by_side::{self, BySide};
use super::lanes::LANES;
use super::planes::{Corners, Frame, MARGIN, Planes, sum_between};
use super::run::{Noted, OfRun, RUN};
use super::tile::{Bits, Found, Pair, Sums, Tile};
use crate::Error;
use crate::cloud::Points;
use crate::memory::{bytes, make_room};
use crate::paper::ROUNDING;
use crate::simd::{GROUP, Groups, Simd};
use crate::window::Image;

/// x, y, z, xx, xy, xz, yy, yz, zz
const CHANNELS: usize = 9;

/// The ring of integral rows: nine planes a row.
#[derive(Debug, Default)]
pub(crate) struct Moments {
    integrals: Buffer<f64>,
    /// The row pushed last, less the origin.
    centered: Buffer<f64>,
    origin: [f32; 3],
    /// The place of the row pushed last; before the first the one after the ring, which is zero.
    pushed: usize,
    /// What the sums' rounding errors stay below.
    error: f64,
    /// By the side of a window: its corners and its share.
    places: Vec<(Corners, f64)>,
}

/// The moments of windows, and one over their numbers of points.
pub(crate) struct WindowMoments<T> {
    pub sums: [T; CHANNELS],
    pub share: T,
}

impl<T: Copy> Clone for WindowMoments<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T: Copy> Copy for WindowMoments<T> {}

impl WindowMoments<f64> {
    /// Of so many points.
    fn of(sums: [f64; CHANNELS], count: f64) -> Self {
        WindowMoments { sums, share: 1.0 / count }
    }
}

/// The sums of points' moments about the first of them, and the number of points.
#[cold]
pub(crate) fn sum_of_moments(points: impl Iterator<Item = [f64; 3]>) -> ([f64; CHANNELS], f64) {
    let (mut sums, mut count) = ([0.0; CHANNELS], 0.0);
    let mut origin = None;
    for point in points {
        let origin = origin.get_or_insert(point);
        let [x, y, z] = [0, 1, 2].map(|c| point[c] - origin[c]);
        let of_point = [x, y, z, x * x, x * y, x * z, y * y, y * z, z * z];
        for (sum, value) in sums.iter_mut().zip(of_point) {
            *sum += value;
        }
        count += 1.0;
    }
    (sums, count)
}

/// Newton steps for the eigenvalue: one is usual, a few more where two eigenvalues are near.
const STEPS: usize = 8;

/// cos(2/3 acos(x)) from 0 to 1, within 2e-7: a polynomial, the highest power first.
const COSINES: [f32; 7] =
    [-0.0021035, 0.0105018, -0.0263997, 0.0514748, -0.1108055, 0.5773319, 0.5000002];

/// The step from which on one more changes the normal by less than 1e-6.
const CONVERGED: f32 = 1e-3;

/// A normal is doubtful if the error of the sums could turn it by more than 3e-5.
const DOUBT_SUMS: f64 = 3e4;

/// The least product of the smallest eigenvalue's distances from the others (of a matrix of trace 1): the rounding of
/// the determinant, some 1e-16, over its square turns the normal.
const DOUBT_PLANE: f32 = 1e-5;

impl Sums for Moments {
    type OfRun = Matrices;

    const COLUMN: usize = CHANNELS * size_of::<f64>();
    const CURVATURE: bool = true;
    const LIMITED: bool = false;

    fn reserve(&mut self, frame: &Frame, side: usize) -> Result<(), Error> {
        frame.reserve_ring(CHANNELS, &mut self.integrals)?;
        self.centered.grow(3 * frame.stride)?;
        make_room(&mut self.places, side + 1)
    }

    fn start(&mut self, frame: &Frame, _limit: f32, _side: usize, origin: [f32; 3]) {
        self.pushed = frame.start_ring(CHANNELS, &mut self.integrals);
        self.origin = origin;
    }

    fn size(&self) -> usize {
        self.integrals.size() + self.centered.size() + bytes(&self.places)
    }

    #[inline(always)]
    unsafe fn push<S: Groups>(&mut self, frame: &Frame, planes: &Planes, y: usize) {
        let place = frame.place(y);
        let groups = frame.steps::<S>();
        let (stride, plane) = (frame.stride, 3 * frame.stride);
        assert!(MARGIN + groups * GROUP <= stride && plane <= self.centered.len());
        assert!(frame.start_of(CHANNELS, frame.ring + 1) <= self.integrals.len());
        let from = planes.rows(frame, y);
        let centered = self.centered.as_mut_ptr();
        let above = self.integrals.as_ptr().wrapping_add(frame.start_of(CHANNELS, self.pushed));
        let row = self.integrals.as_mut_ptr().wrapping_add(frame.start_of(CHANNELS, place));
        // SAFETY: as the caller's; the groups lie inside the planes and rows, whose lengths were just checked.
        unsafe {
            for c in 0..3 {
                let origin = Floats::<S>::splat(self.origin[c]).widen();
                for group in 0..groups {
                    let at = MARGIN + group * GROUP;
                    let coordinate = Floats::<S>::load(from[c].as_ptr().add(at)).widen();
                    S::store_d(centered.add(c * stride + at), (coordinate - origin).0);
                }
            }
            let [x, y, z] = [0, 1, 2].map(|c| centered.wrapping_add(c * stride).cast_const());
            let planes = |first: usize| [0, 1, 2].map(|c| (first + c) * stride);
            integrate::<S, 1>([[x], [y], [z]], above, row, planes(0), groups);
            integrate::<S, 2>([[x, x], [x, y], [x, z]], above, row, planes(3), groups);
            integrate::<S, 2>([[y, y], [y, z], [z, z]], above, row, planes(6), groups);
        }
        self.pushed = place;
        let end = frame.start_of(CHANNELS, place) + MARGIN + groups * GROUP - 1;
        let square = |c: usize| self.integrals[end + c * stride];
        self.error = ROUNDING * (square(3) + square(6) + square(8));
    }

    fn aim(&mut self, frame: &Frame, y: usize, side: usize) {
        let place = |side: usize| {
            let before = -((side / 2) as isize) - 1;
            let ends = [before, before + side as isize];
            (frame.corners(CHANNELS, y, ends, ends), 1.0 / (side * side) as f64)
        };
        self.places.clear();
        self.places.extend((0..=side).map(place));
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
    unsafe fn afresh<S: Groups>(
        points: &Points,
        image: &Image,
        windows: impl Fn(usize) -> ((usize, usize), usize),
        lanes: u32,
        run: &mut Matrices,
        at: usize,
    ) -> bool {
        let sum_up = |lane: usize| {
            let ((x, y), side) = windows(lane);
            let half = (side / 2) as isize;
            let window = (x as isize - half, y as isize - half);
            let pixels = image.rects(window, (side, side)).flat_map(|rect| rect.pixels());
            sum_of_moments(pixels.map(|(x, y)| points.at(x, y).map(f64::from)))
        };
        // SAFETY: as the caller's.
        unsafe { run.note_afresh::<S>(at, lanes, sum_up) };
        true
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(
        &self,
        run: &Matrices,
        at: usize,
        _sides: S::F,
        fresh: bool,
    ) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { run.normals(at, if fresh { 0.0 } else { self.error }) }
    }
}

impl BySide for Moments {
    type OfLanes<S: Simd> = WindowMoments<Doubles<S>>;
    type Of1 = WindowMoments<f64>;

    const PAIRS: bool = false;

    #[inline(always)]
    unsafe fn of_pixels<S: Simd>(
        &self,
        frame: &Frame,
        _planes: &Planes,
        x: usize,
        side: usize,
    ) -> Self::OfLanes<S> {
        let (corners, share) = &self.places[side];
        let x = frame.column(x);
        // SAFETY: as the caller's: rows and columns are held, and so are the groups from these columns on.
        unsafe {
            let mut sums = [Doubles::splat(0.0); CHANNELS];
            for c in 0..CHANNELS {
                let plane = self.integrals.as_ptr().add(x + c * frame.stride);
                sums[c] = sum_between(plane, corners);
            }
            WindowMoments { sums, share: Doubles::splat(*share) }
        }
    }

    #[inline(always)]
    unsafe fn select<S: Simd>(
        lanes: u32,
        yes: Self::OfLanes<S>,
        no: Self::OfLanes<S>,
    ) -> Self::OfLanes<S> {
        let mut moments = no;
        // SAFETY: as the caller's.
        unsafe {
            for c in 0..CHANNELS {
                let sum = S::select_bits_d(lanes, yes.sums[c].0, no.sums[c].0);
                moments.sums[c] = Doubles(sum);
            }
            moments.share = Doubles(S::select_bits_d(lanes, yes.share.0, no.share.0));
        }
        moments
    }

    #[inline(always)]
    unsafe fn none<S: Simd>() -> Self::OfLanes<S> {
        // SAFETY: as the caller's.
        let zero = unsafe { Doubles::splat(0.0) };
        WindowMoments { sums: [zero; CHANNELS], share: zero }
    }

    fn of_mirrored(
        &self,
        frame: &Frame,
        _planes: &Planes,
        image: &Image,
        (x, y): (usize, usize),
        side: usize,
    ) -> Option<Self::Of1> {
        let half = (side / 2) as isize;
        let (mut sums, mut count) = ([0.0; CHANNELS], 0.0);
        for rect in image.rects((x as isize - half, y as isize - half), (side, side)) {
            if rect.x.is_empty() || rect.y.is_empty() {
                continue;
            }
            count += (rect.x.len() * rect.y.len()) as f64;
            for (c, sum) in sums.iter_mut().enumerate() {
                let segment = |end_row: usize| {
                    if end_row == 0 {
                        return 0.0;
                    }
                    let row = frame.start(CHANNELS, end_row - 1) + c * frame.stride;
                    self.integrals[row + frame.column(rect.x.end) - 1]
                        - self.integrals[row + frame.column(rect.x.start) - 1]
                };
                *sum += segment(rect.y.end) - segment(rect.y.start);
            }
        }
        Some(WindowMoments::of(sums, count))
    }

    #[inline(always)]
    unsafe fn put<S: Simd>(moments: &mut Self::OfLanes<S>, lane: usize, one: Self::Of1) {
        // SAFETY: as the caller's.
        unsafe {
            for (to, one) in moments.sums.iter_mut().zip(one.sums) {
                *to = Doubles(S::select_bits_d(1 << lane, S::splat_d(one), to.0));
            }
            let share = S::splat_d(one.share);
            moments.share = Doubles(S::select_bits_d(1 << lane, share, moments.share.0));
        }
    }

    #[inline(always)]
    unsafe fn note_lanes<S: Simd>(
        moments: WindowMoments<Doubles<S>>,
        run: &mut Matrices,
        at: usize,
    ) {
        // SAFETY: as the caller's.
        unsafe { run.note(&moments, at) }
    }
}

/// The covariance matrices of a run's windows (Eq. 25), over their traces, and the smallest eigenvalues.
#[derive(Default)]
pub(crate) struct Matrices {
    /// xx, xy, xz, yy, yz, zz
    elements: OfRun<f64, 6>,
    trace: OfRun<f32, 1>,
    /// c0, c1 and c2 of the characteristic polynomial, value^3 - c2 value^2 + c1 value - c0.
    polynomial: OfRun<f64, 3>,
    /// What is near its least root; that, the slope there, and the lanes of pairs of groups that are not sure of them.
    near: OfRun<f32, 1>,
    value: OfRun<f64, 1>,
    slope: OfRun<f32, 1>,
    unsettled: [u32; RUN / LANES],
}

impl Noted for Matrices {
    /// The smallest eigenvalues: the least roots in closed form, made precise by Newton steps.
    #[inline(always)]
    unsafe fn solve<S: Groups>(&mut self, at: usize, lanes: &[u32]) {
        let pairs = || (at..).step_by(LANES).zip(lanes).filter(|(_, lanes)| **lanes != 0);
        for (at, _) in pairs() {
            // SAFETY: as the caller's.
            unsafe {
                let [c0, c1, c2] = self.polynomial.load::<S::Pair>(at);
                let near = least_root([c0.narrow(), c1.narrow(), c2.narrow()]);
                self.near.store::<S::Pair>(at, [near]);
            }
        }
        for (at, lanes) in pairs() {
            // SAFETY: as the caller's.
            self.unsettled[at / LANES] = unsafe { self.newton_steps::<S::Pair>(at, *lanes) };
        }
    }
}

impl Matrices {
    /// The matrices of windows with these moments, for the pixels from `at` on, and their polynomials.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the pixels are in the run.
    #[inline(always)]
    pub unsafe fn note<S: Simd>(&mut self, moments: &WindowMoments<Doubles<S>>, at: usize) {
        // SAFETY: as the caller's.
        unsafe {
            let [x, y, z, xx, xy, xz, yy, yz, zz] = moments.sums;
            let (mx, my, mz) = (x * moments.share, y * moments.share, z * moments.share);
            let (xx, xy, xz) = (xx - x * mx, xy - x * my, xz - x * mz);
            let (yy, yz, zz) = (yy - y * my, yz - y * mz, zz - z * mz);
            // A trace next to 1: floats divide in a quarter of the time.
            let trace = (xx + yy + zz).narrow();
            let scale = (Floats::splat(1.0) / trace).widen();
            let (xx, xy, xz) = (xx * scale, xy * scale, xz * scale);
            let (yy, yz, zz) = (yy * scale, yz * scale, zz * scale);
            let (minor_x, minor_y, minor_z) =
                (yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy);
            let c2 = xx + yy + zz;
            let c1 = minor_x + minor_y + minor_z;
            let c0 = xx * minor_x + xy * (xz * yz - xy * zz) + xz * (xy * yz - xz * yy);
            self.elements.store::<S>(at, [xx, xy, xz, yy, yz, zz]);
            self.trace.store::<S>(at, [trace]);
            self.polynomial.store::<S>(at, [c0, c1, c2]);
        }
    }

    /// As [`Matrices::note`], of some lanes of a pair of groups; `sum_up` gives the moments of a lane's window, and
    /// the number of its points.
    ///
    /// # Safety
    /// As [`Matrices::note`].
    #[inline(always)]
    pub unsafe fn note_afresh<S: Groups>(
        &mut self,
        at: usize,
        lanes: u32,
        sum_up: impl Fn(usize) -> ([f64; CHANNELS], f64),
    ) {
        let (mut sums, mut shares) = ([[0.0; LANES]; CHANNELS], [0.0; LANES]);
        for lane in Bits(lanes) {
            let (moments, count) = sum_up(lane);
            for c in 0..CHANNELS {
                sums[c][lane] = moments[c];
            }
            shares[lane] = 1.0 / count;
        }
        for group in (0..LANES).step_by(GROUP) {
            // SAFETY: as the caller's; the arrays hold whole groups.
            unsafe {
                let share = Doubles(S::load_d(shares.as_ptr().add(group)));
                let mut of8 = [share; CHANNELS];
                for c in 0..CHANNELS {
                    of8[c] = Doubles(S::load_d(sums[c].as_ptr().add(group)));
                }
                self.note::<S>(&WindowMoments { sums: of8, share }, at + group);
            }
        }
    }

    /// From what is near the least roots to these; returns the lanes whose steps have not ended.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn newton_steps<S: Simd>(&mut self, at: usize, lanes: u32) -> u32 {
        // SAFETY: as the caller's.
        unsafe {
            let [c0, c1, c2] = self.polynomial.load::<S>(at);
            let [near] = self.near.load::<S>(at);
            let mut value = near.widen();
            let twice = c2 + c2;
            let (three, converged) = (Doubles::splat(3.0), Floats::splat(CONVERGED));
            let (mut slope, mut unsettled) = (Floats::splat(0.0), lanes);
            for _ in 0..STEPS {
                slope = ((three * value - twice) * value + c1).narrow();
                // The steps grow small: floats tell how far they go.
                let off = (((value - c2) * value + c1) * value - c0).narrow();
                value = value - (off / slope).widen();
                unsettled = !off.abs().lt(converged * slope * slope.abs()) & lanes;
                if unsettled == 0 {
                    break;
                }
            }
            self.value.store::<S>(at, [value.max(Doubles::splat(0.0))]);
            self.slope.store::<S>(at, [slope]);
            unsettled
        }
    }

    /// The eigenvectors of the smallest eigenvalues for the pixels from `at` on, which are solved: a column of the
    /// adjugate. The rounding errors of the moments stay below `error`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn normals<S: Simd>(&self, at: usize, error: f64) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe {
            let [xx, xy, xz, yy, yz, zz] = self.elements.load::<S>(at);
            let [value] = self.value.load::<S>(at);
            let ([slope], [trace]) = (self.slope.load::<S>(at), self.trace.load::<S>(at));
            // The adjugate of the matrix less the eigenvalue: each column is along the eigenvector.
            let (xx, yy, zz) = (xx - value, yy - value, zz - value);
            let (a_xx, a_yy, a_zz) = (yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy);
            let (a_xy, a_xz, a_yz) = (xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz);
            let (a_xx, a_yy, a_zz) = (a_xx.narrow(), a_yy.narrow(), a_zz.narrow());
            let (a_xy, a_xz, a_yz) = (a_xy.narrow(), a_xz.narrow(), a_yz.narrow());
            // The column with the longest diagonal element.
            let columns = [[a_xx, a_xy, a_xz], [a_xy, a_yy, a_yz], [a_xz, a_yz, a_zz]];
            let best_xy = a_xx.max(a_yy);
            let (is_y, is_z) = (S::lt(a_xx.0, a_yy.0), S::lt(best_xy.0, a_zz.0));
            let mut n = [Floats::splat(0.0); 3];
            for c in 0..3 {
                let of_xy = S::select(is_y, columns[1][c].0, columns[0][c].0);
                n[c] = Floats(S::select(is_z, columns[2][c].0, of_xy));
            }
            let scale = Floats::splat(1.0) / dot(n, n).sqrt();
            let value = value.narrow();
            let least = Floats::splat((DOUBT_SUMS * error) as f32);
            // Where the points lie on a line, the steps may end at the largest eigenvalue instead.
            let is_smallest = value.lt(Floats::splat(1.0 / 3.0));
            // Rounding alone may give any slope, but no trace.
            let sums = least.lt(slope * trace) & least.lt(trace);
            let sure = Floats::splat(DOUBT_PLANE).lt(slope) & sums & is_smallest;
            // Of the pair's groups, these pixels'.
            let unsettled = self.unsettled[at / LANES] >> (at % LANES);
            Found {
                normal: [n[0] * scale, n[1] * scale, n[2] * scale],
                curvature: value,
                doubtful: !sure | unsettled,
            }
        }
    }
}

/// The least root of value^3 - c2 value^2 + c1 value - c0, whose roots are real, by Viete's formula.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn least_root<S: Simd>([c0, c1, c2]: [Floats<S>; 3]) -> Floats<S> {
    // SAFETY: as the caller's.
    unsafe {
        let splat = |value| Floats::<S>::splat(value);
        let square = (c2 * c2 - splat(3.0) * c1).max(splat(0.0));
        let radius = square.sqrt();
        let cube = square * radius;
        let q = (c2 * c2 - splat(4.5) * c1) * c2 + splat(13.5) * c0;
        // The angle a of the formula has the cosine q / cube; this is the sine of its half.
        let sine = (splat(0.5) * (cube - q) / cube).max(splat(0.0)).sqrt();
        let [first, others @ ..] = COSINES;
        let cosine = others.into_iter().fold(splat(first), |sum, c| sum * sine + splat(c));
        (c2 - splat(2.0) * radius * cosine) * splat(1.0 / 3.0)
    }
}

/// Three planes of an integral row (Eq. 2) of the products of `FACTORS` rows each: sums along three rows at a time,
/// as each addition waits for the one before.
///
/// # Safety
/// The processor has the instruction set of `S`; the groups are inside the rows, and in the planes after the margin.
#[inline(always)]
unsafe fn integrate<S: Groups, const FACTORS: usize>(
    factors: [[*const f64; FACTORS]; 3],
    above: *const f64,
    row: *mut f64,
    planes: [usize; 3],
    groups: usize,
) {
    // SAFETY: as the caller's.
    unsafe {
        for plane in planes {
            row.add(plane + MARGIN - 1).write(0.0);
        }
        let mut carries = [S::splat_d(0.0); 3];
        for group in 0..groups {
            let at = MARGIN + group * GROUP;
            for c in 0..3 {
                let mut product = S::load_d(factors[c][0].add(at));
                if FACTORS == 2 {
                    product = S::mul_d(product, S::load_d(factors[c][1].add(at)));
                }
                let along = S::running_sum_d(product, &mut carries[c]);
                let sum = S::add_d(along, S::load_d(above.add(planes[c] + at)));
                S::store_d(row.add(planes[c] + at), sum);
            }
        }
    }
}
