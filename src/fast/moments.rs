//! Sums of first and second moments, for COVARIANCE_MATRIX: the paper's nine integral images (Eq. 16-25), in f64 and
//! about a point of the tile.

use super::arithmetic::{Doubles, Floats, between};
use super::buffer::Buffer;
use super::lanes::LANES;
use super::planes::{Frame, MARGIN, Planes};
use super::run::{Noted, OfRun, RUN};
use super::tile::{Bits, Found, Pair, Sums, Tile, all};
use crate::Error;
use crate::eigen::{Scatter, Symmetric3, eigen};
use crate::memory::{bytes, make_room};
use crate::methods::Estimate;
use crate::paper::ROUNDING;
use crate::simd::{GROUP, Groups, Simd};
use crate::vector::dot;
use crate::window::Image;

/// x, y, z, xx, xy, xz, yy, yz, zz
const CHANNELS: usize = 9;

/// Of a pixel: all moments but z, side by side, as a window's sums of them are four reads then, wherever it lies:
/// xx, xy, xz, yy, yz, zz, x, y.
type Most = [f64; GROUP];

/// The rings of integral rows.
#[derive(Debug, Default)]
pub(crate) struct Moments {
    most: Buffer<Most>,
    z: Buffer<f64>,
    origin: [f32; 3],
    /// The place of the row pushed last; before the first the one after the ring, which is zero.
    pushed: usize,
    /// What the sums' rounding errors stay below.
    error: f64,
    /// By the side of a window.
    places: Vec<Corners>,
}

/// What a window is the sum of, above and below, left and right: in numbers of the ring of most moments, which are as many
/// bytes of the other one, so that both are addresses at once. Before a pixel's column is added, places may be wrapped
/// around zero. A window of no side has no sum.
type Corners = [[usize; 2]; 2];

/// The sums of most moments of the window of a pixel.
///
/// # Safety
/// As [`Sums::note`].
#[inline(always)]
unsafe fn most_between<S: Groups>(pixel: *const f64, corners: Corners) -> S::D {
    // SAFETY: as the caller's.
    between(corners, |corner| Doubles::<S>(unsafe { S::load_d(pixel.wrapping_add(corner)) })).0
}

/// Moments of a group's windows, lane by lane.
#[repr(C, align(64))]
#[derive(Default)]
struct Lanewise {
    most: [Most; GROUP],
    z: [f64; GROUP],
    share: [f64; GROUP],
}

/// The moments of windows, and one over their numbers of points.
pub(crate) struct WindowMoments<S: Simd> {
    pub sums: [Doubles<S>; CHANNELS],
    pub share: Doubles<S>,
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

/// In doubles, the least distance between the two smaller eigenvalues (of a matrix of trace 1), so that rounding turns a
/// normal by less than 1e-5: in sums over hundreds of points it is about four times [`ROUNDING`].
const LEAST_GAP: f64 = 1e5 * 4.0 * ROUNDING;

/// The least product of the smallest eigenvalue's distances from the others (of a matrix of trace 1): the rounding of
/// the determinant, some 1e-16, over its square turns the normal.
const DOUBT_PLANE: f32 = 1e-5;

impl Moments {
    /// Finds the moments of a group's windows, all of this side; `x` is its first pixel.
    ///
    /// # Safety
    /// As [`Sums::note`].
    #[inline(always)]
    unsafe fn of_side<S: Groups>(&self, frame: &Frame, x: usize, side: usize, to: &mut Lanewise) {
        let [most, z] = self.at(frame.column(x));
        let corners = self.places[side];
        // SAFETY: as the caller's: rows and columns are held, and so is the group from this column on.
        unsafe {
            for lane in 0..GROUP {
                let most = most_between::<S>(most.wrapping_add(GROUP * lane), corners);
                S::store_d(to.most[lane].as_mut_ptr(), most);
            }
            let z = |corner| Doubles::<S>(S::load_d(z.wrapping_byte_add(corner)));
            S::store_d(to.z.as_mut_ptr(), between(corners, z).0);
        }
    }

    /// Finds the moments of the windows of some lanes of a pair, of the group that begins with lane `first`.
    ///
    /// # Safety
    /// As [`Sums::note`].
    #[inline(always)]
    unsafe fn of_lanes<S: Groups>(
        &self,
        frame: &Frame,
        pair: &Pair,
        first: usize,
        lanes: u32,
        to: &mut Lanewise,
    ) {
        let [most, z] = self.at(frame.column(pair.x + first));
        let places = self.places.as_ptr();
        // SAFETY: as the caller's: no window of the row aimed at is larger, and rows and columns are held.
        unsafe {
            let sides = pair.sides::<S>(first, lanes);
            // In registers: a load would wait for what is stored lane by lane.
            let mut of_z = [0.0; GROUP];
            for lane in 0..GROUP {
                let corners = *places.add(sides[lane] as usize);
                let most = most_between::<S>(most.wrapping_add(GROUP * lane), corners);
                S::store_d(to.most[lane].as_mut_ptr(), most);
                let z = z.wrapping_add(lane);
                of_z[lane] = between(corners, |corner| *z.wrapping_byte_add(corner));
            }
            S::store_d(to.z.as_mut_ptr(), S::load_d(of_z.as_ptr()));
        }
    }

    /// Where both rings have a column, in the row that corners are counted from.
    #[inline(always)]
    fn at(&self, column: usize) -> [*const f64; 2] {
        [self.most.as_ptr().wrapping_add(column).cast(), self.z.as_ptr().wrapping_add(column)]
    }

    /// Puts the moments of windows that cross the border of the image, of some lanes of a pair's group that begins with
    /// lane `first`; returns those that are left to the plain form.
    #[cold]
    fn put_crossing(
        &self,
        tile: &Tile,
        frame: &Frame,
        pair: &Pair,
        first: usize,
        lanes: u32,
        moments: &mut Lanewise,
    ) -> u32 {
        let mut plain = 0;
        for lane in Bits(lanes) {
            let (pixel, side) = pair.window(first + lane);
            if tile.has_only_finite(pixel, side) {
                let of_lane = (&mut moments.most[lane], &mut moments.z[lane]);
                let points = self.sum_mirrored(frame, tile.image, pixel, side, of_lane);
                moments.share[lane] = 1.0 / points;
            } else {
                plain |= 1 << lane;
            }
        }
        plain
    }

    /// The moments of a window that is mirrored at the border; returns how many points it has.
    fn sum_mirrored(
        &self,
        frame: &Frame,
        image: &Image,
        (x, y): (usize, usize),
        side: usize,
        (most, z): (&mut Most, &mut f64),
    ) -> f64 {
        let half = (side / 2) as isize;
        (*most, *z) = ([0.0; GROUP], 0.0);
        let mut count = 0;
        for (rect, _) in image.rects((x as isize - half, y as isize - half), (side, side)) {
            count += rect.area();
            for (sign, end_row) in [(1.0, rect.y.end), (-1.0, rect.y.start)] {
                if end_row == 0 {
                    continue;
                }
                let row = frame.start(1, end_row - 1);
                let [left, right] = [rect.x.start, rect.x.end].map(|x| row + frame.column(x) - 1);
                for c in 0..GROUP {
                    most[c] += sign * (self.most[right][c] - self.most[left][c]);
                }
                *z += sign * (self.z[right] - self.z[left]);
            }
        }
        count as f64
    }
}

impl Lanewise {
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn load<S: Groups>(&self) -> WindowMoments<S> {
        // SAFETY: as the caller's; there are whole groups.
        unsafe {
            let mut rows = [S::splat_d(0.0); GROUP];
            for lane in 0..GROUP {
                rows[lane] = S::load_d(self.most[lane].as_ptr());
            }
            let [xx, xy, xz, yy, yz, zz, x, y] = S::transpose_d(rows).map(Doubles);
            let [z, share] = [&self.z, &self.share].map(|from| Doubles(S::load_d(from.as_ptr())));
            WindowMoments { sums: [x, y, z, xx, xy, xz, yy, yz, zz], share }
        }
    }
}

/// Adds eight pixels' channels, eight, to their row's sums and those of the row above; `carry` is the sum along the row.
///
/// # Safety
/// The processor has the instruction set of `S`; the rows, above and own, have so many pixels.
#[inline(always)]
pub(crate) unsafe fn push_eight<S: Groups>(
    values: [S::D; 8],
    [above, own]: [*mut f64; 2],
    carry: &mut S::D,
) {
    // SAFETY: as the caller's.
    unsafe {
        let pixels = S::transpose_d(values);
        for lane in 0..GROUP {
            *carry = S::add_d(*carry, pixels[lane]);
            let sum = S::add_d(*carry, S::load_d(above.add(8 * lane)));
            S::store_d(own.add(8 * lane), sum);
        }
    }
}

impl Sums for Moments {
    type OfRun = Matrices;

    const COLUMN: usize = CHANNELS * size_of::<f64>();
    const CURVATURE: bool = true;
    const LIMITED: bool = false;
    const EXACT: bool = false;

    fn reserve(&mut self, frame: &Frame, side: usize) -> Result<(), Error> {
        frame.reserve_ring(&mut self.most)?;
        frame.reserve_ring(&mut self.z)?;
        make_room(&mut self.places, side + 1)
    }

    fn start(&mut self, frame: &Frame, _limit: f32, _side: usize, origin: [f32; 3]) {
        frame.start_ring(&mut self.most);
        self.pushed = frame.start_ring(&mut self.z);
        self.origin = origin;
    }

    fn size(&self) -> usize {
        self.most.size() + self.z.size() + bytes(&self.places)
    }

    #[inline(always)]
    unsafe fn push<S: Groups>(&mut self, frame: &Frame, planes: &Planes, y: usize) {
        let place = frame.place(y);
        let groups = frame.steps::<S>();
        assert!(MARGIN + groups * GROUP <= frame.stride);
        let rows = frame.start_of(1, frame.ring + 1);
        let (most, z) = (self.most[..rows].as_mut_ptr(), self.z[..rows].as_mut_ptr());
        let (above, own) = (frame.start_of(1, self.pushed), frame.start_of(1, place));
        let planes = planes.rows(frame, y);
        // SAFETY: as the caller's; the groups lie inside the planes and the rings' rows, as was just checked.
        unsafe {
            most.add(own + MARGIN - 1).write([0.0; GROUP]);
            z.add(own + MARGIN - 1).write(0.0);
            let mut most_carry = S::splat_d(0.0);
            let mut z_carry = S::splat_d(0.0);
            for group in 0..groups {
                let at = MARGIN + group * GROUP;
                let mut point = [S::splat_d(0.0); 3];
                for c in 0..3 {
                    let origin = S::widen(S::splat(self.origin[c]));
                    point[c] = S::sub_d(S::widen(S::load(planes[c].as_ptr().add(at))), origin);
                }
                let [px, py, pz] = point;
                let of_points = [
                    S::mul_d(px, px),
                    S::mul_d(px, py),
                    S::mul_d(px, pz),
                    S::mul_d(py, py),
                    S::mul_d(py, pz),
                    S::mul_d(pz, pz),
                    px,
                    py,
                ];
                let rows = [most.add(above + at), most.add(own + at)].map(|row| row.cast());
                push_eight::<S>(of_points, rows, &mut most_carry);
                let along = S::running_sum_d(pz, &mut z_carry);
                S::store_d(z.add(own + at), S::add_d(along, S::load_d(z.add(above + at))));
            }
        }
        self.pushed = place;
        let [xx, _, _, yy, _, zz, ..] = self.most[own + MARGIN + groups * GROUP - 1];
        self.error = ROUNDING * (xx + yy + zz);
    }

    fn aim(&mut self, frame: &Frame, y: usize, side: usize) {
        let place = |side: usize| {
            let before = -((side / 2) as isize) - 1;
            let ends = [before, before + side as isize];
            ends.map(|row| {
                let row = frame.start(1, y.wrapping_add_signed(row));
                ends.map(|column| row.wrapping_add_signed(column).wrapping_mul(GROUP))
            })
        };
        self.places.clear();
        self.places.extend((0..=side).map(place));
    }

    #[inline(always)]
    unsafe fn note<S: Groups>(
        &self,
        tile: &Tile,
        frame: &Frame,
        _planes: &Planes,
        pair: &Pair,
        run: &mut Matrices,
        at: usize,
    ) -> u32 {
        let all_inside = tile.inside(pair);
        // SAFETY: as the caller's.
        let one_side = unsafe { pair.one_side::<S>(pair.windows) };
        let mut plain = 0;
        for group in 0..LANES / GROUP {
            let (first, to) = (group * GROUP, &mut run.windows[group]);
            let [lanes, inside] =
                [pair.windows, all_inside].map(|lanes| lanes >> first & all(GROUP));
            if lanes == 0 {
                continue;
            }
            // SAFETY: as the caller's.
            unsafe {
                // No table of shares, which mixed lanes would read one by one.
                let sides = S::widen(S::load(pair.row.as_ptr().add(pair.x + first)));
                let share = S::div_d(S::splat_d(1.0), S::mul_d(sides, sides));
                S::store_d(to.share.as_mut_ptr(), share);
                if let Some(side) = one_side {
                    self.of_side::<S>(frame, pair.x + first, side, to);
                    continue;
                }
                self.of_lanes::<S>(frame, pair, first, inside, to);
            }
            let crossing = lanes & !inside;
            if crossing != 0 {
                plain |= self.put_crossing(tile, frame, pair, first, crossing, to) << first;
            }
        }
        // SAFETY: as the caller's.
        unsafe { run.note_windows::<S>(pair.windows, at) };
        plain
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

/// The covariance matrices of a run's windows (Eq. 16), over their traces, and the smallest eigenvalues.
#[derive(Default)]
pub(crate) struct Matrices {
    /// Those of a pair of groups: the second one's sums do not wait for what becomes of the first one's.
    windows: [Lanewise; LANES / GROUP],
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

    #[inline(always)]
    unsafe fn afresh<S: Groups, P: Iterator<Item = [f64; 3]>>(
        &mut self,
        at: usize,
        lanes: u32,
        points: impl Fn(usize) -> P,
    ) -> bool {
        let (mut matrices, mut shares) = ([[0.0; LANES]; 6], [0.0; LANES]);
        for lane in Bits(lanes) {
            if let Some(Scatter { matrix, count, .. }) = Scatter::of(|| points(lane)) {
                let Symmetric3 { xx, xy, xz, yy, yz, zz } = matrix;
                for (to, value) in matrices.iter_mut().zip([xx, xy, xz, yy, yz, zz]) {
                    to[lane] = value;
                }
                shares[lane] = 1.0 / count;
            }
        }
        for group in (0..LANES).step_by(GROUP) {
            // SAFETY: as the caller's; the arrays hold whole groups.
            unsafe {
                let load = |from: &[f64; LANES]| Doubles(S::load_d(from.as_ptr().add(group)));
                // About the mean, to which the points' ways add up to nothing.
                let mut sums = [Doubles::splat(0.0); CHANNELS];
                for (to, from) in sums[3..].iter_mut().zip(&matrices) {
                    *to = load(from);
                }
                self.note::<S>(&WindowMoments { sums, share: load(&shares) }, at + group);
            }
        }
        // SAFETY: as the caller's.
        unsafe { self.solve::<S>(at, &[lanes]) };
        true
    }

    /// In doubles, from the matrix afresh; none if rounding leaves it doubtful.
    #[cold]
    fn precisely(&self, at: usize) -> Option<Estimate> {
        let [xx, xy, xz, yy, yz, zz] = self.elements.of_one(at);
        let (values, vector) = eigen(&Symmetric3 { xx, xy, xz, yy, yz, zz });
        // The matrix is over its trace, which may be rounding alone.
        let [trace] = self.trace.of_one(at);
        let curvature = (values[0] / (xx + yy + zz)) as f32;
        (trace > 0.0 && LEAST_GAP < values[1] - values[0])
            .then(|| Estimate { normal: vector.map(|c| c as f32), curvature })
    }
}

impl Matrices {
    /// Notes the windows of some lanes of the pair of groups that is `at`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the pixels are in the run.
    #[inline(always)]
    unsafe fn note_windows<S: Groups>(&mut self, lanes: u32, at: usize) {
        for group in 0..LANES / GROUP {
            let first = group * GROUP;
            if lanes >> first & all(GROUP) != 0 {
                // SAFETY: as the caller's.
                unsafe { self.note(&self.windows[group].load::<S>(), at + first) };
            }
        }
    }

    /// The matrices of windows with these moments, for the pixels from `at` on, and their polynomials.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the pixels are in the run.
    #[inline(always)]
    pub unsafe fn note<S: Simd>(&mut self, moments: &WindowMoments<S>, at: usize) {
        // SAFETY: as the caller's.
        unsafe {
            let [x, y, z, xx, xy, xz, yy, yz, zz] = moments.sums;
            let (mx, my, mz) = (x * moments.share, y * moments.share, z * moments.share);
            let (xx, xy, xz) = (xx.minus(x, mx), xy.minus(x, my), xz.minus(x, mz));
            let (yy, yz, zz) = (yy.minus(y, my), yz.minus(y, mz), zz.minus(z, mz));
            // A trace next to 1: floats divide in a quarter of the time.
            let trace = (xx + yy + zz).narrow();
            let scale = (Floats::splat(1.0) / trace).widen();
            let (xx, xy, xz) = (xx * scale, xy * scale, xz * scale);
            let (yy, yz, zz) = (yy * scale, yz * scale, zz * scale);
            let [a_xx, a_xy, a_xz, a_yy, _, a_zz] = adjugate([xx, xy, xz, yy, yz, zz]);
            let c2 = xx + yy + zz;
            let c1 = a_xx + a_yy + a_zz;
            let c0 = (xx * a_xx).plus(xy, a_xy).plus(xz, a_xz);
            self.elements.store::<S>(at, [xx, xy, xz, yy, yz, zz]);
            self.trace.store::<S>(at, [trace]);
            self.polynomial.store::<S>(at, [c0, c1, c2]);
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
                slope = c1.minus(twice.minus(three, value), value).narrow();
                // The steps grow small: floats tell how far they go.
                let off = c0.minus(c1.plus(value - c2, value), value).narrow();
                value = value + (off / slope).widen();
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
            let [a_xx, a_xy, a_xz, a_yy, a_yz, a_zz] = adjugate([xx, xy, xz, yy, yz, zz]);
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

/// [`Symmetric3::adjugate`], its upper triangle.
#[inline(always)]
pub(crate) fn adjugate<S: Simd>([xx, xy, xz, yy, yz, zz]: [Doubles<S>; 6]) -> [Doubles<S>; 6] {
    [
        minor(yy, zz, yz, yz),
        minor(xz, yz, xy, zz),
        minor(xy, yz, xz, yy),
        minor(xx, zz, xz, xz),
        minor(xy, xz, xx, yz),
        minor(xx, yy, xy, xy),
    ]
}

/// `a * b - c * d`
#[inline(always)]
fn minor<S: Simd>(a: Doubles<S>, b: Doubles<S>, c: Doubles<S>, d: Doubles<S>) -> Doubles<S> {
    (a * b).minus(c, d)
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
        let square = (c2 * c2).minus(splat(3.0), c1).max(splat(0.0));
        let radius = square.sqrt();
        let cube = square * radius;
        let q = (splat(13.5) * c0).plus((c2 * c2).minus(splat(4.5), c1), c2);
        // The angle a of the formula has the cosine q / cube; this is the sine of its half.
        let sine = (splat(0.5) * (cube - q) / cube).max(splat(0.0)).sqrt();
        let [first, others @ ..] = COSINES;
        let cosine = others.into_iter().fold(splat(first), |sum, c| splat(c).plus(sum, sine));
        c2.minus(splat(2.0) * radius, cosine) * splat(1.0 / 3.0)
    }
}
