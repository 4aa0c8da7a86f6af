//! Sums of first and second moments, for COVARIANCE_MATRIX: the paper's nine integral images (Eq. 16-25), in f64 and
//! about a point of the tile.

use super::arithmetic::{Doubles, between};
use super::buffer::Buffer;
use super::estimates::Found;
use super::lanes::{Bits, LANES, all};
use super::matrices::{CHANNELS, Lanewise, Matrices, Most};
use super::pair::Pair;
use super::planes::{Frame, MARGIN, Planes};
use super::tile::{Sums, Tile};
use crate::Error;
use crate::memory::{bytes, make_room};
use crate::paper::ROUNDING;
use crate::simd::{GROUP, Groups, Simd};
use crate::window::Image;

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
    unsafe fn push<S: Groups>(&mut self, planes: &Planes, y: usize) {
        let frame = &planes.frame;
        let place = frame.place(y);
        let groups = frame.steps::<S>();
        assert!(MARGIN + groups * GROUP <= frame.stride);
        let rows = frame.start_of(1, frame.ring + 1);
        let (most, z) = (self.most[..rows].as_mut_ptr(), self.z[..rows].as_mut_ptr());
        let (above, own) = (frame.start_of(1, self.pushed), frame.start_of(1, place));
        let planes = planes.rows(y);
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
        Planes { frame, .. }: &Planes,
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

    fn error(&self) -> f64 {
        self.error
    }

    #[inline(always)]
    unsafe fn estimate<S: Simd>(
        &self,
        run: &Matrices,
        at: usize,
        _sides: S::F,
        error: f64,
    ) -> Found<S> {
        // SAFETY: as the caller's.
        unsafe { run.normals(at, error) }
    }
}
