//! Even windows, fast, for one tile of the image, eight blocks at a time: the plain form is in `paper::even_windows`. Their
//! planes come from CM's integral images, as CM's normals of the pixels' own windows do.

use super::integrals::Rings;
use super::layers::{Layer, Waiting, with_fraction};
use super::methods::{CovarianceMatrix, MOMENTS};
use super::rects::{Pixels, Rects, range};
use super::tile::{Run, Tile};
use crate::eigen::Symmetric3;
use crate::fast::Parts;
use crate::fast::arithmetic::{Doubles, Floats};
use crate::fast::lanes::{Bits, all};
use crate::fast::matrices::adjugate;
use crate::fast::sink::Sink;
use crate::paper::{
    Asked, BLOCK, CHANCE, Cloud, EvenWindow, JAGGED, JAGGED_LINES, JAGGED_POINTS, JAGGED_RADIUS,
    MIDDLE, Noise, Plane, RELIEF, RELIEF_RADIUS, ROUNDING, TAKEN, estimate_in_space, estimate_of,
    even_window,
};
use crate::simd::{GROUP, Groups};
use crate::vector::dot;

/// A window is doubtful if rounding could change its variance, or the least that is told from none, by more than this
/// share.
const DOUBT: f64 = 0.02;

/// And if the sums' rounding errors could turn its plane by more than about 1e-5.
const DOUBT_TURN: f64 = 4e5;

/// The radius of a window that waits for a layer with all its points.
const WAITS: f32 = -1.0;

/// The even windows of an image.
pub(super) struct Even<'a> {
    pub cloud: &'a Cloud,
    pub asked: &'a Asked<'a>,
    /// Block by block.
    pub windows: Parts<EvenWindow>,
    pub estimates: Parts<[f32; 4]>,
}

/// A rectangle of the image whose blocks' even windows are found together, and the normals of the pixels that may take none.
pub(super) struct EvenTile<'a> {
    pub even: &'a Even<'a>,
    pub tile: Tile<'a>,
    /// For the pixels' normals, if they are asked for.
    pub sink: Option<&'a Sink<'a>>,
}

/// Eight blocks of a row.
struct Eight {
    /// Their middles, inside the image or not.
    pixels: Pixels,
    /// The first one's number.
    block: usize,
    /// Those whose windows are to be found.
    asked: u32,
    /// What the sums' rounding errors stay below.
    error: f64,
}

/// The planes through the points of eight windows.
#[derive(Clone, Copy)]
struct Fits<S: Groups> {
    points: Doubles<S>,
    q: [Doubles<S>; 3],
    ray: [Doubles<S>; 3],
    inverse_depth: Doubles<S>,
    unevenness: Doubles<S>,
    steepness_squared: Doubles<S>,
    /// The covariance matrix, its upper triangle.
    covariance: [Doubles<S>; 6],
    /// The lanes that have one, those in which rounding may have had a say in that or turned the plane, and those that hold
    /// hidden points.
    there: u32,
    doubtful: u32,
    turned: u32,
    hidden: u32,
}

impl<S: Groups> Fits<S> {
    /// None.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn none() -> Self {
        // SAFETY: as the caller's.
        let [one, unevenness] = unsafe { [Doubles::splat(1.0), Doubles::splat(f64::INFINITY)] };
        let (there, doubtful, turned, hidden) = (0, 0, 0, 0);
        Fits {
            points: one,
            q: [one; 3],
            ray: [one; 3],
            inverse_depth: one,
            unevenness,
            steepness_squared: one,
            covariance: [one; 6],
            there,
            doubtful,
            turned,
            hidden,
        }
    }

    /// Takes the planes of others in some lanes.
    #[inline(always)]
    fn take(&mut self, lanes: u32, others: &Self) {
        self.points.take_lanes(lanes, others.points);
        for i in 0..3 {
            self.q[i].take_lanes(lanes, others.q[i]);
            self.ray[i].take_lanes(lanes, others.ray[i]);
        }
        self.inverse_depth.take_lanes(lanes, others.inverse_depth);
        self.unevenness.take_lanes(lanes, others.unevenness);
        self.steepness_squared.take_lanes(lanes, others.steepness_squared);
        for i in 0..6 {
            self.covariance[i].take_lanes(lanes, others.covariance[i]);
        }
        self.turned = self.turned & !lanes | others.turned & lanes;
    }

    /// The variance that the unevenness may be of, where planes take as much as so many points have.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn noise(&self, of_image: &Noise, taken: Floats<S>) -> Doubles<S> {
        // SAFETY: as the caller's.
        unsafe {
            if of_image.is_none {
                return Doubles::splat(0.0);
            }
            let points = self.points.narrow();
            let (told, left) = (points - Floats::splat(3.0), points - taken);
            let deviation = (Floats::splat(2.0 * of_image.area) / left).sqrt();
            let chance = Floats::splat(1.0) + Floats::splat(CHANCE) * deviation;
            self.unevenness * (told / left * chance).widen()
        }
    }

    /// The same where others have twice the radii.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn noise_of_half(&self, of_image: &Noise) -> Doubles<S> {
        // SAFETY: as the caller's.
        unsafe {
            let most = Floats::splat(TAKEN) * self.points.narrow();
            let taken = Floats::splat(3.0 * of_image.area).min(most);
            self.noise(of_image, taken.max(Floats::splat(3.0)))
        }
    }

    /// The lanes in which these windows, of a quarter of the others' radii, are more even than chance allows: there is relief.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn are_finer(&self, others: &Self, least: Doubles<S>, of_image: &Noise) -> u32 {
        // SAFETY: as the caller's.
        unsafe {
            let taken = Floats::splat(3.0 * of_image.area);
            let noise = self.noise(of_image, taken).max(least);
            self.there & taken.lt(self.points.narrow()) & !others.unevenness.lt(noise)
        }
    }

    /// [`Plane::bend2`]
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn bend2(
        &self,
        middle: &Self,
        sides2: Floats<S>,
        least_noise: Doubles<S>,
        area: f32,
    ) -> Floats<S> {
        // SAFETY: as the caller's.
        unsafe {
            let off = dot(self.q, middle.ray) - middle.inverse_depth;
            let one = Doubles::splat(1.0);
            let share = Doubles::splat(area.into()) * (one / middle.points - one / self.points);
            let noise = self.unevenness.max(least_noise) * share;
            let (zero, most) = (Doubles::splat(0.0), Doubles::splat(Plane::BEND_NOISE));
            let off2 = (off * off - most * noise.max(zero)).max(zero);
            let bend = Doubles::splat(24.0) / sides2.widen();
            (off2 * bend * bend).narrow()
        }
    }

    /// Writes their estimates: those in space in the lanes of `jagged` windows.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn write_estimates(
        &self,
        jagged: u32,
        has_curvature: bool,
        asked: u32,
        estimates: &mut [[f32; 4]],
    ) {
        let mut found = [[0.0; 4]; GROUP];
        // SAFETY: as the caller's; an estimate is four floats.
        unsafe {
            // As `Plane::estimate` has it.
            let share = Doubles::splat(1.0) / dot(self.q, self.q).sqrt();
            let normal = [self.q[0] * share, self.q[1] * share, self.q[2] * share];
            let [xx, .., yy, _, zz] = self.covariance;
            let curvature = dot(normal, times(self.covariance, normal)) / (xx + yy + zz);
            let most = Floats::splat(Plane::MOST_CURVATURE as f32);
            let curvature = Floats::splat(0.0).max(curvature.narrow()).min(most);
            let [x, y, z] = [normal[0].narrow(), normal[1].narrow(), normal[2].narrow()];
            let (fields, to) = ([x.0, y.0, z.0, curvature.0], found.as_mut_ptr().cast());
            S::store_points(fields, 3, to, size_of::<[f32; 4]>());
            if jagged != 0 {
                let mut matrices = [[0.0; GROUP]; 6];
                for (to, from) in matrices.iter_mut().zip(self.covariance) {
                    S::store_d(to.as_mut_ptr(), from.0);
                }
                for lane in Bits(jagged) {
                    let [xx, xy, xz, yy, yz, zz] = matrices.each_ref().map(|field| field[lane]);
                    found[lane] = estimate_in_space(&Symmetric3 { xx, xy, xz, yy, yz, zz }).into();
                }
            }
        }
        for lane in Bits(asked) {
            let [x, y, z, curvature] = found[lane];
            estimates[lane] = [x, y, z, if has_curvature { curvature } else { f32::NAN }];
        }
    }
}

/// What is found for eight blocks.
struct Found<S: Groups> {
    best: Fits<S>,
    /// The windows' radii, 0 for none, and how they bend.
    radii: Floats<S>,
    bend2: Floats<S>,
    /// The lanes of jagged windows, those in which rounding may have had a say, and those that wait for another layer.
    jagged: u32,
    doubtful: u32,
    hidden: u32,
}

impl<S: Groups> Found<S> {
    /// Writes the windows of the lanes that are there, and none for the others that are asked for.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn write_windows(
        &self,
        (there, asked): (u32, u32),
        noise: &Noise,
        windows: &mut [EvenWindow],
    ) {
        let &Found { best, radii, bend2, .. } = self;
        let ([a, b, c], [x, y, z]) = (best.q, best.ray);
        let mut found = [EvenWindow::default(); GROUP];
        // SAFETY: as the caller's; a window is twelve floats.
        unsafe {
            // As `even_window` has it.
            let (one, points) = (Floats::splat(1.0), best.points.narrow());
            let side = Floats::splat(2.0) * radii + one;
            let per_noise = Floats::splat(12.0 * noise.area) / points / (side * side);
            let steepness = best.steepness_squared.narrow().sqrt();
            let fours = [
                [radii, a.narrow(), b.narrow(), c.narrow()],
                [x.narrow(), y.narrow(), z.narrow(), steepness],
                [
                    best.unevenness.narrow(),
                    best.noise(noise, Floats::splat(3.0)).narrow(),
                    per_noise,
                    bend2,
                ],
            ];
            let (to, there) = (found.as_mut_ptr().cast::<f32>(), S::mask(there));
            for (fields, place) in fours.into_iter().zip((0..).step_by(4)) {
                let mut of_windows = [there; 4];
                for i in 0..4 {
                    of_windows[i] = S::and(there, fields[i].0);
                }
                S::store_points(of_windows, 3, to.add(place), size_of::<EvenWindow>());
            }
        }
        for lane in Bits(asked) {
            windows[lane] = found[lane];
        }
    }
}

impl EvenTile<'_> {
    /// The windows of the blocks whose points a layer holds, of those that wait for it, and the normals that are asked for,
    /// as [`Tile::compute`].
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; no one else writes the tile's blocks and pixels.
    #[inline(always)]
    pub unsafe fn compute<S: Groups>(
        &self,
        rings: &mut Rings<MOMENTS>,
        layer: &Layer,
        waiting: &mut Waiting,
    ) -> Option<f32> {
        let EvenTile { even, tile, sink, .. } = self;
        let method = CovarianceMatrix::about(layer.origin);
        // SAFETY: as the caller's.
        let mut next = unsafe { tile.start::<S, CovarianceMatrix, MOMENTS>(rings, layer) };
        if sink.is_some() {
            tile.start_waiting(layer, waiting);
        }
        let mut run = Run::default();
        let mut some_wait = false;
        for y in tile.rows.clone() {
            let has_middles = y == even.asked.blocks.middle_of((0, y / BLOCK)).1;
            if sink.is_none() && !has_middles {
                continue;
            }
            // SAFETY: as the caller's.
            unsafe {
                let error = tile.advance::<S, _, MOMENTS>(&method, rings, &mut next, y);
                if let Some(sink) = sink {
                    tile.row::<S, CovarianceMatrix, MOMENTS, true>(
                        rings, waiting, sink, &mut run, error,
                    );
                }
                if has_middles {
                    some_wait |= self.row::<S>(rings, error);
                }
            }
        }
        some_wait |= sink.is_some() && waiting.is_any();
        (layer.hides_some() && some_wait).then_some(rings.nearest_hidden)
    }

    /// The windows of the blocks in the row aimed at, that of their middles; returns whether some wait for another layer.
    ///
    /// # Safety
    /// As [`EvenTile::compute`]; the rings hold what the windows need.
    #[inline(always)]
    unsafe fn row<S: Groups>(&self, rings: &Rings<MOMENTS>, error: f64) -> bool {
        let &Even { cloud, asked, .. } = self.even;
        let (width, columns) = (cloud.width, &self.tile.columns);
        let is_later = !rings.layer.is_first;
        let mut some_wait = false;
        for x in columns.clone().step_by(GROUP * BLOCK) {
            let block = asked.blocks.block(rings.aimed.y * width + x);
            let blocks = block..block + (columns.end - x).div_ceil(BLOCK).min(GROUP);
            let pixels = Pixels { x: x + MIDDLE, step: BLOCK, width };
            // SAFETY: as the caller's.
            unsafe {
                let windows = self.even.windows.part(blocks.clone());
                let mut asked = all(windows.len());
                if is_later {
                    asked = Bits(asked).which(|lane| windows[lane].radius == WAITS);
                }
                if asked != 0 {
                    let estimates = self.even.estimates.part(blocks);
                    let eight = Eight { pixels, block, asked, error };
                    some_wait |= self.eight::<S>(rings, &eight, windows, estimates);
                }
            }
        }
        some_wait
    }

    /// Finds the windows of eight blocks, and their estimates; returns whether some wait for another layer.
    ///
    /// # Safety
    /// As [`EvenTile::row`].
    #[inline(always)]
    unsafe fn eight<S: Groups>(
        &self,
        rings: &Rings<MOMENTS>,
        eight: &Eight,
        windows: &mut [EvenWindow],
        estimates: &mut [[f32; 4]],
    ) -> bool {
        let Even { cloud, asked: of_image, .. } = self.even;
        let &Eight { block, asked, .. } = eight;
        // SAFETY: as the caller's.
        unsafe {
            let found = self.find::<S>(rings, eight, windows.len());
            let Found { best, jagged, doubtful, hidden, .. } = found;
            for lane in Bits(asked & hidden) {
                windows[lane].radius = WAITS;
            }
            let (there, asked) = (Floats::splat(0.0).lt(found.radii), asked & !hidden);
            found.write_windows((there, asked), &of_image.noise, windows);
            best.write_estimates(jagged & asked, of_image.has_curvature, asked, estimates);
            // What rounding could decide is left to the plain form.
            for lane in Bits(asked & doubtful) {
                (windows[lane], estimates[lane]) = even_window(cloud, of_image, block + lane);
            }
            for lane in Bits(asked & there & best.turned & !doubtful) {
                let (radius, is_jagged) = (windows[lane].radius as u32, jagged >> lane & 1 != 0);
                estimates[lane] = estimate_of(cloud, of_image, block + lane, radius, is_jagged);
            }
            hidden != 0
        }
    }

    /// The windows of so many of eight blocks.
    ///
    /// # Safety
    /// As [`EvenTile::row`].
    #[inline(always)]
    unsafe fn find<S: Groups>(
        &self,
        rings: &Rings<MOMENTS>,
        eight: &Eight,
        blocks: usize,
    ) -> Found<S> {
        let of_image = self.even.asked;
        let &Eight { pixels, block, asked, .. } = eight;
        let y = rings.aimed.y;
        let hides_some = rings.layer.hides_some();
        let [mut wanted, mut clean] = [[0.0; GROUP]; 2];
        let of_blocks = block..block + blocks;
        for (to, from) in wanted.iter_mut().zip(&of_image.wanted[of_blocks.clone()]) {
            *to = *from as f32;
        }
        for (to, from) in clean.iter_mut().zip(&of_image.clean.radii[of_blocks]) {
            *to = f32::from(*from);
        }
        // SAFETY: as the caller's.
        unsafe {
            let [wanted, clean] =
                [Floats::<S>::load(wanted.as_ptr()), Floats::load(clean.as_ptr())];
            // As `Asked::largest` has it.
            let limit = Floats::<S>::splat(of_image.limit as f32);
            let largest = (wanted + wanted).min(limit.min(clean));
            let largest = Floats(S::and(S::mask(asked), largest.0));
            let (zero, one) = (Floats::<S>::splat(0.0), Floats::<S>::splat(1.0));
            let least = Doubles::splat(f64::from(of_image.noise.least));
            let area = of_image.noise.area;
            let smallest = Floats::splat(JAGGED_RADIUS as f32 - 1.0);
            // On steep surfaces, windows with depth changes; then, or else, windows without, and smaller ones while those
            // are much more even.
            let mut jagged = asked & clean.lt(wanted) & smallest.lt(wanted);
            let mut even = zero.lt(largest) & !jagged;
            let mut radii = largest;
            radii.take_lanes(jagged, wanted);
            let (mut found, mut bend2) = (zero, zero);
            let mut best = Fits::<S>::none();
            let (mut jagged_found, mut doubtful, mut hidden) = (0, 0, 0);
            // Windows that are even but rough are compared with those of a quarter of their radii.
            let (rough, mut compared) = (Doubles::splat(RELIEF) * least, 0);
            // Where noise is shared by as many pixels as such a window has, it tells nothing.
            let small = Floats::splat((RELIEF_RADIUS as f32).max((3.0 * area).sqrt()) - 1.0);
            loop {
                let todo = jagged | even;
                if todo == 0 {
                    break;
                }
                let rects = Rects::new(rings, &pixels, radii, todo, None);
                let sums = rects.sums(rings, 0);
                let fits = self.fits(rings.layer.origin, &sums, eight.error);
                doubtful |= fits.doubtful & todo;
                if hides_some {
                    hidden |= fits.hidden & todo;
                }
                let is_jagged = jagged & fits.there & self.jagged(&fits, &pixels, radii, y);
                let mut is_enough =
                    best.unevenness.lt(fits.noise_of_half(&of_image.noise).max(least));
                // Mostly none is.
                if compared != 0 {
                    let in_relief = compared & fits.are_finer(&best, least, &of_image.noise);
                    is_enough = is_enough & !compared | compared & !in_relief;
                    bend2.take_lanes(in_relief, zero);
                }
                let is_better = even & fits.there & !is_enough;
                let bends = even & fits.there & is_enough & !compared;
                if bends != 0 {
                    let (side, of_half) = (found + found + one, radii + radii + one);
                    let sides2 = side * side - of_half * of_half;
                    bend2.take_lanes(bends, best.bend2(&fits, sides2, least, area));
                }
                found.take_lanes(is_jagged | is_better, radii);
                best.take(is_jagged | is_better, &fits);
                jagged_found |= is_jagged;
                let seven_tenths = radii * Floats::splat(7.0) / Floats::splat(10.0);
                let next = Floats(S::truncate(seven_tenths.0));
                let half = Floats(S::truncate((radii * Floats::splat(0.5)).0));
                compared = bends & small.lt(radii) & rough.lt(best.unevenness);
                even = is_better & one.lt(radii) | compared;
                let tried = jagged & !is_jagged;
                jagged = tried & clean.lt(next) & smallest.lt(next);
                let starts = tried & !jagged & zero.lt(largest);
                radii.take_lanes(even, half);
                radii.take_lanes(jagged, next);
                radii.take_lanes(starts, largest);
                even |= starts;
            }
            Found { best, radii: found, bend2, jagged: jagged_found, doubtful, hidden }
        }
    }

    /// Planes through the points of eight windows, as [`Plane::of`], from their sums about `origin`, the errors of which stay
    /// below `error`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn fits<S: Groups>(
        &self,
        origin: [f32; 3],
        sums: &[Doubles<S>; MOMENTS],
        error: f64,
    ) -> Fits<S> {
        let [sx, sy, sz, n, xx, yy, zz, xy, yz, xz] = *sums;
        // SAFETY: as the caller's.
        unsafe {
            let share = Doubles::splat(1.0) / n;
            let (x, y, z) = (sx * share, sy * share, sz * share);
            let (xx, yy) = ((xx * share).minus(x, x), (yy * share).minus(y, y));
            let (zz, xy) = ((zz * share).minus(z, z), (xy * share).minus(x, y));
            let (yz, xz) = ((yz * share).minus(y, z), (xz * share).minus(x, z));
            let mut m = [x, y, z];
            for c in 0..3 {
                m[c] = m[c] + Doubles::splat(origin[c].into());
            }
            let adjugate @ [axx, axy, axz, ..] = adjugate([xx, xy, xz, yy, yz, zz]);
            let across = times(adjugate, m);
            let along = times([xx, xy, xz, yy, yz, zz], m);
            let (spread, length2, along) = (dot(m, across), dot(m, m), dot(m, along));
            let trace = xx + yy + zz;
            let half_trace = (trace * length2 - along) * Doubles::splat(0.5);
            let (seen, line) =
                (spread * length2, Doubles::splat(Plane::LINE) * half_trace * half_trace);
            let enough = Doubles::splat(Plane::FEWEST - 0.5).lt(n);
            let determinant = (xx * axx).plus(xy, axy).plus(xz, axz).max(Doubles::splat(0.0));
            let scale = Doubles::splat(1.0) / (spread + determinant);
            let q = [across[0] * scale, across[1] * scale, across[2] * scale];
            let (q2, below) = (dot(q, q), n - Doubles::splat(3.0));
            let deviation2 = determinant * scale * n / below;
            let (depth, slope2) = if self.even.cloud.has_range {
                let along = dot(q, m);
                (length2.sqrt(), q2 - along * along / length2)
            } else {
                (m[2], q[0] * q[0] + q[1] * q[1])
            };
            let depth2 = depth * depth;
            let spread2 = spread / (depth2 * depth2 * depth2);
            let angle2 = Doubles::splat(12.0) / (n - Doubles::splat(1.0)) * spread2.sqrt();
            let mut unevenness = deviation2 / depth2;
            // What the errors do to the sum of (1 - q P)^2, and to what tells lines and depths.
            let least = Doubles::splat(self.even.asked.noise.least.into());
            // The determinant loses where points are far apart along a line.
            let of_determinant = Doubles::splat(ROUNDING) * trace * trace * trace * scale * n;
            let of_deviation = Doubles::splat(2.0 * error) * q2 + of_determinant;
            let scale = below * depth2;
            let allowed = Doubles::splat(DOUBT) * least.max(unevenness) * scale;
            // Far below what is told from none, it makes no difference.
            let largest = unevenness * scale + of_deviation;
            let is_none = (Doubles::splat(4.0) * largest).lt(least * scale);
            let of_trace = Doubles::splat(8.0 * error) * share * length2;
            // The adjugate loses where points are far apart along the line of sight.
            let of_adjugate = trace * length2;
            let of_adjugate = Doubles::splat(ROUNDING) * of_adjugate * of_adjugate;
            let of_seen = of_trace * half_trace.max(of_trace) + of_adjugate;
            let enough_seen = Doubles::splat(8.0) * of_seen;
            let deep = Doubles::splat(Plane::DEEP) * length2 * length2;
            let is_deep = deep.lt(along);
            let mut steepness_squared = slope2 * angle2;
            unevenness.take_lanes(is_deep, Doubles::splat(f64::INFINITY));
            steepness_squared.take_lanes(is_deep, Doubles::splat(0.0));
            let rounded = !((along + of_trace).lt(deep) | (deep + of_trace).lt(along))
                | !is_deep & !is_none & !of_deviation.lt(allowed)
                | !is_deep & !((seen + of_seen).lt(line) | (line + enough_seen).lt(seen));
            let turns = Doubles::splat(DOUBT_TURN * error) * share * half_trace;
            let inverse_depth = Doubles::splat(1.0) / depth;
            Fits {
                points: n,
                q,
                ray: [m[0] * inverse_depth, m[1] * inverse_depth, m[2] * inverse_depth],
                inverse_depth,
                unevenness,
                steepness_squared,
                covariance: [xx, xy, xz, yy, yz, zz],
                there: enough & (is_deep | line.lt(seen)),
                doubtful: enough & rounded,
                turned: !turns.lt(spread),
                hidden: with_fraction(n),
            }
        }
    }

    /// The lanes whose points are in their plane but for the sensor's noise along rows and columns.
    ///
    /// # Safety
    /// As [`EvenTile::row`].
    #[inline(always)]
    unsafe fn jagged<S: Groups>(
        &self,
        fits: &Fits<S>,
        pixels: &Pixels,
        radii: Floats<S>,
        y: usize,
    ) -> u32 {
        // SAFETY: as the caller's.
        unsafe {
            let &Cloud { width, height, .. } = self.even.cloud;
            let row = Floats::splat(y as f32);
            let (across, down) = (side(pixels.columns(), radii, width), side(row, radii, height));
            let most = Doubles::splat(JAGGED);
            let lines = Doubles::splat(JAGGED_LINES) * across.max(down).widen();
            let mut jagged = fits.points / lines;
            jagged.take_lanes(most.lt(jagged), most);
            let steep = jagged * jagged * fits.steepness_squared;
            let fewest = Doubles::splat(JAGGED_POINTS) * (across * down).widen();
            let least = Doubles::splat(self.even.asked.noise.least.into());
            !steep.lt(fits.unevenness) & !steep.lt(least) & !fits.points.lt(fewest)
        }
    }
}

/// A symmetric matrix, its upper triangle, times a vector.
#[inline(always)]
fn times<S: Groups>(
    [xx, xy, xz, yy, yz, zz]: [Doubles<S>; 6],
    [x, y, z]: [Doubles<S>; 3],
) -> [Doubles<S>; 3] {
    [
        (xx * x).plus(xy, y).plus(xz, z),
        (xy * x).plus(yy, y).plus(yz, z),
        (xz * x).plus(yz, y).plus(zz, z),
    ]
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
