//! Even windows, fast, for one tile of the image: the plain form is in `paper::even_windows`. Planes come from integral
//! images of the moments of positions and inverse depths, eight pixels at a time.

use std::ops::Range;

use super::integrals::{Rings, reached};
use super::layers::{Layer, with_fraction};
use super::methods::{CovarianceMatrix, MOMENTS};
use super::rects::{Pixels, Rects, range};
use crate::fast::Parts;
use crate::fast::arithmetic::{Doubles, Floats};
use crate::fast::tile::Bits;
use crate::paper::{
    Asked, BLOCK, CHANCE, Cloud, EvenWindow, JAGGED, JAGGED_POINTS, JAGGED_RADIUS, MIDDLE, Plane,
    ROUNDING, even_window, inverse_depth, middle,
};
use crate::simd::{GROUP, Groups};

/// A window is doubtful if rounding could change its variance, or the least that is told from none, by more than this
/// share.
const DOUBT: f64 = 0.25;

/// How many of a tile's points tell what inverse depths are usual, and the share of them that may be farther off than
/// others hold.
const SAMPLES: usize = 64;
const UNUSUAL: usize = 16;

/// Points so many times as near as usual ones are hidden: windows that hold some are doubtful.
const SPAN: f32 = 64.0;

/// A rectangle of the image whose blocks' even windows are found together.
pub(super) struct EvenTile<'a> {
    pub cloud: &'a Cloud,
    pub asked: &'a Asked<'a>,
    /// Block by block.
    pub needed: &'a [bool],
    pub columns: Range<usize>,
    pub rows: Range<usize>,
    /// The largest radius of a window.
    pub largest: usize,
}

/// Eight windows and their planes.
#[derive(Clone, Copy)]
struct Fits<S: Groups> {
    /// 0 for no window.
    radii: Doubles<S>,
    /// Of the planes at the pixels.
    inverse_depth: Doubles<S>,
    slope: [Doubles<S>; 2],
    points: Doubles<S>,
    unevenness: Doubles<S>,
    /// The variance that the unevenness may be of.
    noise: Doubles<S>,
}

impl<S: Groups> Fits<S> {
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn none() -> Self {
        // SAFETY: as the caller's.
        let zero = unsafe { Doubles::splat(0.0) };
        let [radii, inverse_depth, points, unevenness, noise] = [zero; 5];
        Fits { radii, inverse_depth, slope: [zero; 2], points, unevenness, noise }
    }

    /// Takes the lanes of another.
    #[inline(always)]
    fn take(&mut self, lanes: u32, other: &Self) {
        let Fits { radii, inverse_depth, slope: [across, down], points, unevenness, noise } = self;
        let to = [radii, inverse_depth, across, down, points, unevenness, noise];
        let [across, down] = other.slope;
        let Fits { radii, inverse_depth, points, unevenness, noise, .. } = *other;
        let from = [radii, inverse_depth, across, down, points, unevenness, noise];
        for (to, from) in to.into_iter().zip(from) {
            // SAFETY: there is a group, so there is the instruction set.
            to.0 = unsafe { S::select_bits_d(lanes, from.0, to.0) };
        }
    }

    /// Writes the windows of as many lanes as there is room for.
    #[inline(always)]
    fn write(&self, windows: &mut [EvenWindow]) {
        let Fits { radii, inverse_depth, slope: [across, down], points, unevenness, noise } = *self;
        let mut fields = [[0.0; GROUP]; 7];
        let values = [radii, inverse_depth, across, down, points, unevenness, noise];
        for (field, value) in fields.iter_mut().zip(values) {
            // SAFETY: there is a group, so there is the instruction set.
            unsafe { S::store(field.as_mut_ptr(), value.narrow().0) };
        }
        for (lane, window) in windows.iter_mut().enumerate() {
            let [radius, inverse_depth, across, down, points, unevenness, noise] =
                fields.each_ref().map(|field| field[lane]);
            *window = EvenWindow::default();
            if radius > 0.0 {
                let slope = [across, down];
                let worth = EvenWindow::worth(radius as u32, points);
                *window = EvenWindow { inverse_depth, slope, unevenness, noise, ..worth };
            }
        }
    }
}

impl EvenTile<'_> {
    /// Writes the windows to those of the image's blocks.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; no one else writes the tile's blocks.
    #[inline(always)]
    pub unsafe fn compute<S: Groups>(
        &self,
        rings: &mut Rings<MOMENTS>,
        windows: &Parts<EvenWindow>,
    ) {
        let reach = self.largest;
        let &Cloud { width, height, ref depths, .. } = self.cloud;
        let columns = reached(&self.columns, reach, width);
        let Range { start: top, end: bottom } = reached(&self.rows, reach, height);
        let [usual, near] = self.usual_inverse_depths();
        let [x, y] = [columns.start + columns.end, top + bottom].map(|ends| (ends / 2) as f32);
        let origin = [x, y, usual];
        let moments = CovarianceMatrix::about(origin);
        let layer = Layer::of_positions(origin, SPAN * near, reach);
        rings.start(columns, top, (reach, height), false, &layer);
        let mut next = top;
        for y in self.rows.clone().step_by(BLOCK) {
            let row = middle(y, BLOCK, height);
            while next < (row + reach + 1).min(bottom) {
                rings.read_positions(&depths[next * width..], next);
                // SAFETY: as the caller's.
                unsafe { rings.push::<S>(&moments, next) };
                next += 1;
            }
            rings.aim(row, height);
            let total = rings.total(next - 1);
            for x in self.columns.clone().step_by(GROUP * BLOCK) {
                let block = self.asked.blocks.block(y * width + x);
                let blocks = block..block + (self.columns.end - x).div_ceil(BLOCK).min(GROUP);
                // SAFETY: as the caller's.
                unsafe {
                    let pixel = (x + MIDDLE, row);
                    let (found, doubtful) =
                        self.eight::<S>(rings, &moments, &total, pixel, blocks.clone());
                    let windows = windows.part(blocks.clone());
                    found.write(windows);
                    for lane in Bits(doubtful) {
                        let window = even_window(self.cloud, self.asked, blocks.start + lane);
                        windows[lane] = window.unwrap_or_default();
                    }
                }
            }
        }
    }

    /// An inverse depth in the middle of those of some of the tile's points, about which sums lose little; and the magnitude
    /// of one that few are beyond, infinite if there is none.
    fn usual_inverse_depths(&self) -> [f32; 2] {
        let EvenTile { cloud, columns, rows, .. } = self;
        let sample = |number: usize| {
            // All over the tile: no two in a row or in a column.
            let place = |range: &Range<usize>, at: usize| range.start + at * range.len() / SAMPLES;
            let [x, y] = [place(columns, number * 37 % SAMPLES), place(rows, number)];
            inverse_depth(cloud.depths[cloud.index(x, y)])
        };
        let mut samples: [f32; SAMPLES] = std::array::from_fn(sample);
        samples.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
        // NaN is last.
        let there = samples.partition_point(|sample| !sample.is_nan());
        match there.checked_sub(1) {
            None => [0.0, f32::INFINITY],
            Some(last) => [samples[there / 2], samples[last - there / UNUSUAL].abs()],
        }
    }

    /// The windows of at most eight `blocks`, of which `pixel` is the first one's middle, inside the image or not; and
    /// the lanes in which rounding may have had a say, where points have been summed to `total`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the rings hold what the windows need.
    #[inline(always)]
    unsafe fn eight<S: Groups>(
        &self,
        rings: &Rings<MOMENTS>,
        moments: &CovarianceMatrix,
        total: &[f64; MOMENTS],
        pixel: (usize, usize),
        blocks: Range<usize>,
    ) -> (Fits<S>, u32) {
        let &Cloud { width, .. } = self.cloud;
        let clean_radii = &self.asked.clean[pixel.1 * width..][..width];
        let [mut wanted, mut clean, mut largest] = [[0.0; GROUP]; 3];
        for (lane, block) in blocks.enumerate() {
            if self.needed[block] {
                wanted[lane] = self.asked.wanted[block] as f32;
                clean[lane] = clean_radii[(pixel.0 + lane * BLOCK).min(width - 1)].into();
                largest[lane] = (self.asked.largest(block) as f32).min(clean[lane]);
            }
        }
        // SAFETY: as the caller's.
        unsafe {
            let (wanted, clean) = (Floats::load(wanted.as_ptr()), Floats::load(clean.as_ptr()));
            let mut found = Fits::<S>::none();
            // On steep surfaces, windows with depth changes.
            let smallest = Floats::splat(JAGGED_RADIUS as f32 - 1.0);
            let mut radii = wanted;
            let mut todo = clean.lt(radii) & smallest.lt(radii);
            let (mut done, mut doubtful) = (0, 0);
            while todo != 0 {
                let (fits, there) = self.fits(rings, moments, pixel, radii, todo);
                doubtful |= there & self.doubtful(rings, total, &fits);
                let jagged = there & self.jagged(&fits, pixel, radii);
                found.take(jagged, &fits);
                done |= jagged;
                radii.0 = S::truncate((radii * Floats::splat(7.0) / Floats::splat(10.0)).0);
                todo &= !jagged & clean.lt(radii) & smallest.lt(radii);
            }
            // Windows without, and smaller ones while those are much more even.
            radii = Floats::load(largest.as_ptr());
            todo = Floats::splat(0.0).lt(radii) & !done;
            let least = Doubles::splat(f64::from(self.asked.least_noise));
            let mut is_first = true;
            while todo != 0 {
                let (fits, there) = self.fits(rings, moments, pixel, radii, todo);
                todo = there;
                doubtful |= there & self.doubtful(rings, total, &fits);
                if !is_first {
                    todo &= fits.noise.max(least).lt(found.unevenness);
                }
                found.take(todo, &fits);
                todo &= Floats::splat(1.0).lt(radii);
                radii.0 = S::truncate((radii * Floats::splat(0.5)).0);
                is_first = false;
            }
            (found, doubtful)
        }
    }

    /// The lanes whose planes are not those of all points, or that rounding may have a say in, where points have been
    /// summed to `total`. Sums of positions are whole numbers, and exact.
    ///
    /// # Safety
    /// As [`EvenTile::eight`]'s.
    #[inline(always)]
    unsafe fn doubtful<S: Groups>(
        &self,
        rings: &Rings<MOMENTS>,
        total: &[f64; MOMENTS],
        fits: &Fits<S>,
    ) -> u32 {
        let [xx, yy, rr] = [total[4], total[5], total[6]];
        let [a, b] = fits.slope;
        // SAFETY: as the caller's.
        unsafe {
            let splat = |value| Doubles::<S>::splat(value);
            // More than (|r| + |a x| + |b y|)^2.
            let summed = splat(3.0) * (splat(rr) + a * a * splat(xx) + b * b * splat(yy));
            let least = splat(self.asked.least_noise.into()).max(fits.unevenness);
            let allowed = splat(DOUBT) * least * (fits.points - splat(3.0));
            let hides_some = rings.nearest_hidden < f32::INFINITY;
            let hidden = if hides_some { with_fraction(fits.points) } else { 0 };
            hidden | !(splat(ROUNDING) * summed).lt(allowed)
        }
    }

    /// Planes through the points of eight windows, and the lanes that have one.
    ///
    /// # Safety
    /// As [`EvenTile::eight`]'s.
    #[inline(always)]
    unsafe fn fits<S: Groups>(
        &self,
        rings: &Rings<MOMENTS>,
        moments: &CovarianceMatrix,
        (x, y): (usize, usize),
        radii: Floats<S>,
        lanes: u32,
    ) -> (Fits<S>, u32) {
        let pixels = Pixels { x, step: BLOCK, width: self.cloud.width };
        // SAFETY: as the caller's.
        unsafe {
            let rects = Rects::new(rings, &pixels, radii, lanes, None);
            let [sx, sy, sr, n, xx, yy, rr, xy, yr, xr] = rects.sums(rings, 0);
            let share = Doubles::splat(1.0) / n;
            let (mx, my, mr) = (sx * share, sy * share, sr * share);
            let (xx, xy, yy) = (xx - sx * mx, xy - sx * my, yy - sy * my);
            let (xr, yr, rr) = (xr - sx * mr, yr - sy * mr, rr - sr * mr);
            let determinant = xx * yy - xy * xy;
            let there = Doubles::splat(Plane::FEWEST - 0.5).lt(n)
                & (Doubles::splat(Plane::LINE) * xx * yy).lt(determinant)
                & lanes;
            let scale = Doubles::splat(1.0) / determinant;
            let slope = [(xr * yy - yr * xy) * scale, (yr * xx - xr * xy) * scale];
            let deviation = rr - slope[0] * xr - slope[1] * yr;
            let unevenness = deviation.max(Doubles::splat(0.0)) / (n - Doubles::splat(3.0));
            let chance = Floats::splat(2.0) / (n.narrow() - Floats::splat(3.0));
            let chance = Floats::splat(1.0) + Floats::splat(CHANCE) * chance.sqrt();
            let noise = unevenness * chance.widen();
            // The pixels' own positions.
            let column = pixels.columns().widen();
            let [origin_x, origin_y, origin_r] = moments.origin.map(|o| Doubles::splat(o));
            let across = column - origin_x - mx;
            let down = Doubles::splat(y as f64) - origin_y - my;
            let inverse_depth = origin_r + mr + slope[0] * across + slope[1] * down;
            (
                Fits { radii: radii.widen(), inverse_depth, slope, points: n, unevenness, noise },
                there,
            )
        }
    }

    /// The lanes whose points are in their plane but for the sensor's noise along rows and columns.
    ///
    /// # Safety
    /// As [`EvenTile::eight`]'s.
    #[inline(always)]
    unsafe fn jagged<S: Groups>(
        &self,
        fits: &Fits<S>,
        (x, y): (usize, usize),
        radii: Floats<S>,
    ) -> u32 {
        let [a, b] = fits.slope;
        // SAFETY: as the caller's.
        unsafe {
            let &Cloud { width, height, .. } = self.cloud;
            let columns = Pixels { x, step: BLOCK, width }.columns();
            let area = side(columns, radii, width) * side(Floats::splat(y as f32), radii, height);
            let steep = Doubles::splat(JAGGED * JAGGED) * (a * a + b * b);
            let fewest = Doubles::splat(JAGGED_POINTS) * area.widen();
            let least = Doubles::splat(self.asked.least_noise.into());
            !steep.lt(fits.unevenness) & !steep.lt(least) & !fits.points.lt(fewest)
        }
    }
}

/// How many columns or rows, of so many, windows around `at` have.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn side<S: Groups>(at: Floats<S>, radii: Floats<S>, count: usize) -> Floats<S> {
    // SAFETY: as the caller's.
    let [start, end] = unsafe { range(at, radii, count) };
    end - start
}
