//! The even windows that blocks' pixels may take, fast: as many blocks as there are lanes form a group, and of each there is
//! a window at a time. The plain form is in `paper::choices`.

use super::block_pixels::{Near, Pixels};
use crate::fast::arithmetic::Floats;
use crate::fast::lanes::{LANES, Lanes};
use crate::paper::{
    ALIKE, CREASE_COST, CREASE_NOISE, EvenWindow, JITTER, MISFIT, REACH, inverse_depth_along,
};
use crate::simd::{Along, Simd, load_by_fours};
use crate::vector::difference;

/// Columns or rows of blocks, one for each block of a group.
pub(super) struct Lines<S: Simd> {
    /// The number of the first block in the row, or that of the column.
    pub first: [usize; LANES],
    /// The ways in pixels from the blocks' own.
    pub from_own: Floats<S>,
}

/// Windows that the pixels of a group may take, one for each block, in memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// The blocks whose windows they are.
    places: [u32; LANES],
    /// The mask of the blocks that may take theirs.
    may_take: Lanes,
    /// As [`EvenWindow`] has them.
    unevenness: Lanes,
    per_noise: Lanes,
    /// As [`Windows::store`] has them.
    windows: [Lanes; WINDOW_FIELDS],
    /// What they cost a pixel of each block.
    cost: Lanes,
}

impl Candidate {
    pub const NONE: Self = Candidate {
        places: [0; LANES],
        may_take: Lanes::ZERO,
        unevenness: Lanes::ZERO,
        per_noise: Lanes::ZERO,
        windows: [Lanes::ZERO; WINDOW_FIELDS],
        cost: Lanes::ZERO,
    };
}

/// Windows, one for each block of a group.
#[derive(Clone, Copy)]
pub(super) struct Windows<S: Simd> {
    /// Where their middles are, from the blocks' middle pixels.
    middle: [Floats<S>; 2],
    radius: Floats<S>,
    /// The planes q P = 1.
    q: [Floats<S>; 3],
    /// The rays of their mean points.
    ray: [Floats<S>; 3],
    per_misfit: Floats<S>,
    bend2: Floats<S>,
    /// What they cost any pixel; infinite for those that may not take theirs.
    even: Floats<S>,
    /// How far the sensor's noise along rows and columns moves points off the plane.
    jitter: Floats<S>,
}

const WINDOW_FIELDS: usize = 13;

impl<S: Simd> Windows<S> {
    /// Of no block.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn none() -> Self {
        // SAFETY: as the caller's.
        let (zero, per_misfit, even) =
            unsafe { (Floats::splat(0.0), Floats::splat(1.0), Floats::splat(f32::INFINITY)) };
        let (middle, q, ray) = ([zero; 2], [zero; 3], [zero; 3]);
        let [radius, bend2, jitter] = [zero; 3];
        Windows { middle, radius, q, ray, per_misfit, bend2, even, jitter }
    }

    /// All fields, side by side.
    #[inline(always)]
    fn fields(&self) -> [Floats<S>; WINDOW_FIELDS] {
        let &Windows { middle: [dx, dy], radius, q, ray, per_misfit, bend2, even, jitter } = self;
        let ([a, b, c], [x, y, z]) = (q, ray);
        [dx, dy, radius, a, b, c, x, y, z, per_misfit, bend2, even, jitter]
    }

    /// Those of which these are the fields.
    #[inline(always)]
    fn of(fields: [Floats<S>; WINDOW_FIELDS]) -> Self {
        let [dx, dy, radius, a, b, c, x, y, z, per_misfit, bend2, even, jitter] = fields;
        let (middle, q, ray) = ([dx, dy], [a, b, c], [x, y, z]);
        Windows { middle, radius, q, ray, per_misfit, bend2, even, jitter }
    }

    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn store(&self, to: &mut [Lanes; WINDOW_FIELDS]) {
        let fields = self.fields();
        for i in 0..WINDOW_FIELDS {
            // SAFETY: as the caller's; the array holds so many lanes.
            unsafe { S::store(to[i].0.as_mut_ptr(), fields[i].0) };
        }
    }

    /// Those that [`Windows::store`] stored.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn load(from: &[Lanes; WINDOW_FIELDS]) -> Self {
        // SAFETY: as the caller's.
        let mut fields = [unsafe { Floats::splat(0.0) }; WINDOW_FIELDS];
        for i in 0..WINDOW_FIELDS {
            // SAFETY: as the caller's.
            fields[i].0 = unsafe { from[i].load::<S>() };
        }
        Windows::of(fields)
    }

    /// Takes the others of a mask.
    #[inline(always)]
    fn take(&mut self, mask: S::F, other: &Self) {
        let (mut fields, others) = (self.fields(), other.fields());
        for i in 0..WINDOW_FIELDS {
            fields[i].take(mask, others[i]);
        }
        *self = Windows::of(fields);
    }

    /// What the windows cost a pixel of each block; infinite where they end short of it and of its surface.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn cost(&self, pixels: &Pixels<S>) -> Floats<S> {
        let &Windows { middle: [dx, dy], radius, q, per_misfit, bend2, even, jitter, .. } = self;
        let Near { inverse_depth, noise } = pixels.near;
        // SAFETY: as the caller's.
        unsafe {
            let (zero, one) = (Floats::splat(0.0), Floats::splat(1.0));
            let plane = inverse_depth_along(q, pixels.ray);
            let astray = inverse_depth - plane;
            let astray = (astray * astray - noise).max(zero);
            let [x, y] = pixels.at;
            let (dx, dy) = (x - dx, y - dy);
            let short = (dx.abs().max(dy.abs()) - radius).max(zero);
            let even = even + bend2 * (dx * dx + dy * dy);
            let cost = (even + astray * per_misfit) * (one + short * short);
            let off = (pixels.inverse_depth - plane).abs();
            let lies_in = S::le(off.0, (pixels.tolerance + jitter).0);
            let is_beyond = S::and_not(lies_in, S::lt(zero.0, short.0));
            Floats(S::select(is_beyond, S::splat(f32::INFINITY), cost.0))
        }
    }
}

/// The windows that the pixels of a group may take.
pub(super) struct Candidates<'a, S: Simd> {
    /// Only so many mean something.
    candidates: &'a mut [Candidate],
    number: usize,
    /// The least variance among the windows.
    pub noise: Floats<S>,
}

impl<'a, S: Along> Candidates<'a, S> {
    /// None; there is room for so many.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn none(candidates: &'a mut [Candidate]) -> Self {
        // SAFETY: as the caller's.
        let noise = unsafe { Floats::splat(f32::INFINITY) };
        Candidates { candidates, number: 0, noise }
    }

    /// Adds the windows of the blocks in these columns and rows, for the blocks of a mask.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the columns and rows are inside the image.
    #[inline(always)]
    pub unsafe fn add(
        &mut self,
        windows: &[EvenWindow],
        columns: &Lines<S>,
        rows: &Lines<S>,
        may_take: S::F,
    ) {
        let place = |lane: usize| columns.first[lane] + rows.first[lane];
        let windows = windows.as_ptr();
        let to = &mut self.candidates[self.number];
        for lane in 0..S::LANES {
            to.places[lane] = place(lane) as u32;
        }
        // SAFETY: as the caller's; a window is twelve floats, and arrays hold so many lanes.
        unsafe {
            let window = |lane: usize| windows.add(to.places[lane] as usize).cast::<f32>();
            let [radius, a, b, c] = load_by_fours::<S>(window);
            let [x, y, z, steepness] = load_by_fours::<S>(|lane| window(lane).add(4));
            let [unevenness, noise, per_noise, bend2] =
                load_by_fours::<S>(|lane| window(lane).add(8));
            let (radius, steepness) = (Floats(radius), Floats(steepness));
            let q = [Floats(a), Floats(b), Floats(c)];
            let ray = [Floats(x), Floats(y), Floats(z)];
            let (zero, one) = (S::splat(0.0), S::splat(1.0));
            let middle @ [dx, dy] = [columns.from_own, rows.from_own];
            let is_near = S::lt(dx.abs().max(dy.abs()).0, (radius + Floats::splat(REACH + 1.0)).0);
            let may_take = S::and(may_take, S::and(is_near, S::lt(zero, radius.0)));
            if S::bits(may_take) == 0 {
                return;
            }
            self.number += 1;
            let jitter = Floats::splat(JITTER) * steepness;
            let side = radius + radius + Floats(one);
            let per_misfit = Floats::splat(MISFIT) / (side * side);
            let (bend2, even) = (Floats(bend2), Floats(zero));
            Windows { middle, radius, q, ray, per_misfit, bend2, even, jitter }
                .store(&mut to.windows);
            S::store(to.may_take.0.as_mut_ptr(), may_take);
            S::store(to.unevenness.0.as_mut_ptr(), unevenness);
            S::store(to.per_noise.0.as_mut_ptr(), per_noise);
            self.noise.0 = S::select(may_take, S::min(noise, self.noise.0), self.noise.0);
        }
    }

    /// The blocks whose windows have these numbers, or any where there is none, as the bits of floats.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn places(&self, numbers: Floats<S>) -> S::F {
        let (mut of_lanes, mut places) = ([0; LANES], Lanes::ZERO);
        // SAFETY: as the caller's; the arrays hold so many lanes.
        unsafe {
            S::store_i(of_lanes.as_mut_ptr(), S::truncate_i(numbers.0));
            for lane in 0..S::LANES {
                if let Some(windows) = self.candidates.get(of_lanes[lane] as usize) {
                    places.0[lane] = f32::from_bits(windows.places[lane]);
                }
            }
            places.load::<S>()
        }
    }

    /// Finds what the windows cost any pixel, where a variance of `least_noise` is told from none: all have been added.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn weigh(&mut self, least_noise: f32) {
        // SAFETY: as the caller's.
        self.noise = self.noise.max(unsafe { Floats::splat(least_noise) });
        for to in &mut self.candidates[..self.number] {
            // SAFETY: as the caller's.
            unsafe {
                let unevenness = Floats::<S>(to.unevenness.load::<S>());
                let per_noise = Floats(to.per_noise.load::<S>());
                let mut windows = Windows::load(&to.windows);
                let misfit = (unevenness - self.noise).max(Floats::splat(0.0));
                let even = self.noise * per_noise + misfit * windows.per_misfit;
                let may_take = to.may_take.load::<S>();
                windows.even.0 = S::select(may_take, even.0, S::splat(f32::INFINITY));
                windows.store(&mut to.windows);
            }
        }
    }

    /// The numbers of the windows that are worth most to a pixel of each block, -1 for none, and the windows.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn best(&mut self, pixels: &Pixels<S>) -> (Floats<S>, Windows<S>) {
        let noise = self.noise;
        let found = &mut self.candidates[..self.number];
        // SAFETY: as the caller's.
        unsafe {
            let alike = Floats::splat(ALIKE);
            let mut least = Floats::<S>::splat(f32::INFINITY);
            let mut best = Floats::splat(-1.0);
            let mut windows = Windows::none();
            for (number, candidates) in found.iter_mut().enumerate() {
                let these = Windows::load(&candidates.windows);
                let cost = these.cost(pixels);
                S::store(candidates.cost.0.as_mut_ptr(), cost.0);
                let better = S::lt(cost.0, least.0);
                // Mostly none is.
                if S::bits(better) != 0 {
                    least.take(better, alike * cost);
                    best.take(better, Floats::splat(number as f32));
                    windows.take(better, &these);
                }
            }
            // By chance the pixel may be nearer to the plane beyond a crease.
            least = Floats::splat(CREASE_COST) * least;
            let first = windows;
            for (number, candidates) in found.iter().enumerate() {
                let these = Windows::load(&candidates.windows);
                let cost = Floats(candidates.cost.load::<S>());
                let is_better = S::lt(cost.0, least.0);
                let crease = Crease::between(&these, &first, noise);
                let [on_first_side, _] = crease.sides(pixels.ray);
                let better = S::and(is_better, on_first_side);
                // Mostly none is.
                if S::bits(better) != 0 {
                    least.take(better, alike * cost);
                    best.take(better, Floats::splat(number as f32));
                    windows.take(better, &these);
                }
            }
            (best, windows)
        }
    }
}

/// Whether and where the planes of two windows of each block meet between the middles of both.
pub(super) struct Crease<S: Simd> {
    /// The difference of both planes' q.
    gap: [Floats<S>; 3],
    /// How far the first plane is above the second one in the middle of the first window.
    here: Floats<S>,
    /// The mask of the blocks that have one.
    there: S::F,
}

impl<S: Simd> Crease<S> {
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn between(first: &Windows<S>, second: &Windows<S>, noise: Floats<S>) -> Self {
        let gap = difference(first.q, second.q);
        let here = inverse_depth_along(gap, first.ray);
        let there = inverse_depth_along(gap, second.ray);
        // SAFETY: as the caller's.
        unsafe {
            let least_gap = Floats::<S>(S::min(here.abs().0, there.abs().0));
            let least = Floats::splat(CREASE_NOISE) * noise;
            let are_two = S::lt(least.0, (least_gap * least_gap).0);
            let meet = S::lt((here * there).0, S::splat(0.0));
            Crease { gap, here, there: S::and(are_two, meet) }
        }
    }

    /// The masks of the blocks that have a crease and a ray on the first window's side of it, where the same plane is in
    /// front as in the middle of that window, and on the second one's.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn sides(&self, ray: [Floats<S>; 3]) -> [S::F; 2] {
        // SAFETY: as the caller's.
        unsafe {
            let (side, zero) = (self.here * inverse_depth_along(self.gap, ray), S::splat(0.0));
            [S::and(self.there, S::lt(zero, side.0)), S::and(self.there, S::lt(side.0, zero))]
        }
    }
}
