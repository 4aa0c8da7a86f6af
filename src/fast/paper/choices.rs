//! Which even window each pixel takes, fast, for rows of blocks: the plain form is in `paper::choices`. As many of the
//! blocks concerned as there are lanes form a group: the windows at one place of each are gathered together, and weighed
//! for a pixel of each at a time.

use std::iter::repeat_n;
use std::mem::MaybeUninit;

use super::depth_changes::least_depth_change;
use crate::Error;
use crate::cache::Level;
use crate::fast::arithmetic::Floats;
use crate::fast::lanes::{LANES, Lanes};
use crate::fast::tile::all;
use crate::memory::{bytes, make_room, refill, resize};
use crate::options::Options;
use crate::paper::{
    ALIKE, BLOCK, Blocks, CREASE_COST, CREASE_NOISE, Cloud, EvenWindow, EvenWindows, JITTER,
    MIDDLE, MISFIT, NEAR_NOISE, NEXT, NO_WINDOW, REACH, inverse_depth, inverse_depth_along,
    marks_from, places_at,
};
use crate::simd::{Along, Groups, Simd, load_by_fours};
use crate::vector::difference;

/// Finds the choices of the pixels of some rows of blocks; there is room.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(super) unsafe fn rows<S: Groups>(
    even: &EvenWindows,
    rows: &mut dyn Iterator<Item = (usize, &mut [u32])>,
    scratch: &mut Scratch,
) {
    let Blocks { across, .. } = even.asked.blocks;
    let Scratch { concerned, rows: image_rows, candidates } = scratch;
    for (row, choices) in rows {
        choices.fill(NO_WINDOW);
        let levels = &even.levels[row * across..][..across];
        concerned.clear();
        for column in (0..across).filter(|column| levels[*column] > 0) {
            if even.is_far_from_edges((column, row)) {
                take_own(even, (column, row), choices);
            } else {
                concerned.push(column);
            }
        }
        if concerned.is_empty() {
            continue;
        }
        // SAFETY: as the caller's.
        unsafe { image_rows.read::<S::Widest>(even, row) };
        for blocks in concerned.chunks(S::Widest::LANES) {
            let group = Group { even, row, blocks };
            group.prefetch();
            // SAFETY: as the caller's.
            unsafe {
                let mut found = Found::<S::Widest>::none(candidates);
                group.candidates(&mut found);
                found.weigh(even.asked.noise.least);
                group.choose(&mut found, image_rows, choices);
            }
        }
    }
}

/// Writes the choices of the block in a column and row, which is whole, for those of its row: its own window for all pixels that
/// may take one.
fn take_own(even: &EvenWindows, (column, row): (usize, usize), choices: &mut [u32]) {
    let own = (row * even.asked.blocks.across + column) as u32;
    let x = column * BLOCK;
    for (y, choices) in (row * BLOCK..).zip(choices.chunks_mut(even.cloud.width)) {
        let marks = marks_from(even.concerned.row(y), x);
        for (at, to) in choices[x..x + BLOCK].iter_mut().enumerate() {
            *to = if marks >> at & 1 != 0 { own } else { NO_WINDOW };
        }
    }
}

/// What one worker needs, kept from frame to frame.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    /// The columns of a row's blocks whose pixels choose.
    concerned: Vec<usize>,
    rows: Rows,
    candidates: Vec<Candidates>,
}

impl Scratch {
    /// Makes room for images of this width and windows up to the radius `limit`.
    pub fn reserve(&mut self, width: usize, limit: u32) -> Result<(), Error> {
        make_room(&mut self.concerned, width.div_ceil(BLOCK))?;
        // A block's own and those around it, for as many radii as the largest can be halved to.
        let levels = 0..=limit.ilog2() as u8;
        let most = 1 + levels.map(|level| places_at(level).len()).sum::<usize>();
        resize(&mut self.candidates, most, Candidates::NONE)?;
        self.rows.resize(width)
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        bytes(&self.concerned) + self.rows.size() + bytes(&self.candidates)
    }
}

/// Blocks of a row whose pixels can take windows, as many as there are lanes, or the last ones.
struct Group<'a> {
    even: &'a EvenWindows<'a>,
    row: usize,
    /// Their columns.
    blocks: &'a [usize],
}

/// Columns or rows of blocks, one for each block of a group.
struct Lines<S: Simd> {
    /// The number of the first block in the row, or that of the column.
    first: [usize; LANES],
    /// The ways in pixels from the blocks' own.
    from_own: Floats<S>,
}

/// Windows that the pixels of a group may take, one for each block, in memory.
#[derive(Clone, Copy, Debug)]
struct Candidates {
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

impl Candidates {
    const NONE: Self = Candidates {
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
struct Windows<S: Simd> {
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

/// A pixel of each block of a group.
#[derive(Clone, Copy)]
struct Pixels<S: Simd> {
    /// Its number in the block.
    number: Floats<S>,
    /// Where it is, from the block's middle pixel.
    at: [Floats<S>; 2],
    /// The mask of those that take a window.
    there: Floats<S>,
    ray: [Floats<S>; 3],
    inverse_depth: Floats<S>,
    tolerance: Floats<S>,
    near: Near<S>,
}

/// Of the points next to a pixel of each block, as the plain form has them.
#[derive(Clone, Copy)]
struct Near<S: Simd> {
    inverse_depth: Floats<S>,
    noise: Floats<S>,
}

impl<S: Simd> Windows<S> {
    /// Of no block.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn none() -> Self {
        // SAFETY: as the caller's.
        let [zero, per_misfit, even] =
            unsafe { [0.0, 1.0, f32::INFINITY].map(|value| Floats::splat(value)) };
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
    unsafe fn cost(&self, pixels: &Pixels<S>) -> Floats<S> {
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

impl<S: Simd> Pixels<S> {
    /// Takes the others of a mask.
    #[inline(always)]
    fn take(&mut self, mask: S::F, other: &Self) {
        for axis in 0..2 {
            self.at[axis].take(mask, other.at[axis]);
        }
        for i in 0..3 {
            self.ray[i].take(mask, other.ray[i]);
        }
        self.number.take(mask, other.number);
        self.there.take(mask, other.there);
        self.inverse_depth.take(mask, other.inverse_depth);
        self.tolerance.take(mask, other.tolerance);
        self.near.inverse_depth.take(mask, other.near.inverse_depth);
        self.near.noise.take(mask, other.near.noise);
    }
}

/// The windows that the pixels of a group may take.
struct Found<'a, S: Simd> {
    /// Only so many mean something.
    candidates: &'a mut [Candidates],
    number: usize,
    /// The least variance among the windows.
    noise: Floats<S>,
}

impl<'a, S: Along> Found<'a, S> {
    /// None; there is room for so many.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn none(candidates: &'a mut [Candidates]) -> Self {
        // SAFETY: as the caller's.
        let noise = unsafe { Floats::splat(f32::INFINITY) };
        Found { candidates, number: 0, noise }
    }

    /// Adds the windows of the blocks in these columns and rows, for the blocks of a mask.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the columns and rows are inside the image.
    #[inline(always)]
    unsafe fn add(
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
    unsafe fn places(&self, numbers: Floats<S>) -> S::F {
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
    unsafe fn weigh(&mut self, least_noise: f32) {
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
    unsafe fn best(&mut self, pixels: &Pixels<S>) -> (Floats<S>, Windows<S>) {
        let noise = self.noise;
        let found = &mut self.candidates[..self.number];
        // SAFETY: as the caller's.
        unsafe {
            let alike = Floats::splat(ALIKE);
            let mut least = Floats::<S>::splat(f32::INFINITY);
            let mut best = S::splat(-1.0);
            let mut windows = Windows::none();
            for (number, candidates) in found.iter_mut().enumerate() {
                let these = Windows::load(&candidates.windows);
                let cost = these.cost(pixels);
                S::store(candidates.cost.0.as_mut_ptr(), cost.0);
                let better = S::lt(cost.0, least.0);
                // Mostly none is.
                if S::bits(better) != 0 {
                    least.0 = S::select(better, (alike * cost).0, least.0);
                    best = S::select(better, S::splat(number as f32), best);
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
                    least.0 = S::select(better, (alike * cost).0, least.0);
                    best = S::select(better, S::splat(number as f32), best);
                    windows.take(better, &these);
                }
            }
            (Floats(best), windows)
        }
    }
}

impl Group<'_> {
    /// Asks for the cache lines in which the blocks' lines of points start, long before they are read: neighbours have all.
    #[inline(always)]
    fn prefetch(&self) {
        let &Group { even, row, blocks } = self;
        let &Cloud { width, height, .. } = even.cloud;
        for y in row * BLOCK..(row * BLOCK + BLOCK).min(height) {
            for block in blocks {
                let first = even.cloud.points[y * width + block * BLOCK].as_ptr();
                Level::Second.read(first, BLOCK, size_of::<[f32; 3]>());
            }
        }
    }

    /// Finds the windows that the blocks' pixels may take.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn candidates<S: Along>(&self, found: &mut Found<'_, S>) {
        let &Group { even, row, blocks } = self;
        let Blocks { across, down, .. } = even.asked.blocks;
        let &Cloud { width, height, .. } = even.cloud;
        let (mut levels, mut radii) = (Lanes::ZERO, Lanes::ZERO);
        // Lanes without a block stand for the first one, and take nothing.
        let mut column = Lanes([blocks[0] as f32; LANES]);
        for (lane, block) in blocks.iter().enumerate() {
            let own = row * across + block;
            levels.0[lane] = f32::from(even.levels[own]);
            radii.0[lane] = even.asked.largest(own) as f32;
            column.0[lane] = *block as f32;
        }
        // SAFETY: as the caller's; all places are inside the image.
        unsafe {
            let zero = Floats::<S>::splat(0.0);
            let levels = levels.load::<S>();
            let mut radii = Floats::<S>(radii.load::<S>());
            let mut level = 0;
            let takes_any = S::lt(zero.0, levels);
            let column = Floats::<S>(column.load::<S>());
            let row = Floats::<S>::splat(row as f32);
            let columns = Axis { pixels: width, blocks: across, number: 1 };
            let rows = Axis { pixels: height, blocks: down, number: across };
            let own = [columns.lines::<S>(column, column), rows.lines(row, row)];
            found.add(even.windows, &own[0], &own[1], takes_any);
            loop {
                let may_take =
                    S::and(S::lt(zero.0, radii.0), S::lt(S::splat(level.into()), levels));
                if S::bits(may_take) == 0 {
                    break;
                }
                // Rounded up.
                let distance =
                    (radii + Floats::splat(BLOCK as f32 - 1.0)) / Floats::splat(BLOCK as f32);
                let distance = Floats(S::truncate(distance.0));
                let [left, right] = columns.around(column, distance);
                let [above, below] = rows.around(row, distance);
                let across = [&left, &own[0], &right];
                let down = [&above, &own[1], &below];
                for (column, row) in places_at(level) {
                    found.add(even.windows, across[*column], down[*row], may_take);
                }
                let has_smaller = S::lt(S::splat(BLOCK as f32), radii.0);
                let half = S::truncate((radii * Floats::splat(0.5)).0);
                radii = Floats(S::and(has_smaller, half));
                level += 1;
            }
        }
    }

    /// Of the windows `found`, those that the blocks' pixels take, for the choices of their rows.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn choose<S: Along>(&self, found: &mut Found<'_, S>, rows: &Rows, choices: &mut [u32]) {
        let width = self.even.cloud.width;
        // SAFETY: as the caller's.
        unsafe {
            let mut columns = [0; LANES];
            for lane in 0..self.blocks.len() {
                columns[lane] = self.blocks[lane] * BLOCK;
            }
            let blocks = (&columns, self.blocks.len());
            let mut pixels = MaybeUninit::uninit();
            let pixels = rows.pixels(self.even, self.row, blocks, found.noise, &mut pixels);
            let mut first = pixels[MIDDLE * BLOCK + MIDDLE];
            for other in pixels {
                let takes = S::and_not(first.there.0, other.there.0);
                // Mostly none does.
                if S::bits(takes) != 0 {
                    first.take(takes, other);
                }
            }
            let (first_best, first_windows) = found.best(&first);
            let mut first_costs = [found.noise; BLOCK * BLOCK];
            for number in 0..BLOCK * BLOCK {
                first_costs[number] = first_windows.cost(&pixels[number]);
            }
            let (mut second, mut largest) = (first, S::splat(-1.0));
            for (other, cost) in pixels.iter().zip(first_costs) {
                let is_first = S::eq(other.number.0, first.number.0);
                let cost = Floats::<S>(S::and_not(is_first, cost.0));
                let alike = cost * Floats::splat(ALIKE);
                let worse = S::and(other.there.0, S::lt(largest, alike.0));
                second.take(worse, other);
                largest = S::select(worse, cost.0, largest);
            }
            let (second_best, second_windows) = found.best(&second);
            let crease = Crease::between(&first_windows, &second_windows, found.noise);
            let first_places = found.places(first_best);
            let second_places = found.places(second_best);
            let none = S::splat(f32::from_bits(NO_WINDOW));
            let mut taken = [none; BLOCK * BLOCK];
            for ((number, own), first_cost) in pixels.iter().enumerate().zip(first_costs) {
                let second_cost = second_windows.cost(own);
                let (alike, times) = (Floats::splat(ALIKE), Floats::splat(ALIKE * CREASE_COST));
                let is_better = S::lt(second_cost.0, (alike * first_cost).0);
                let [on_first, on_second] = crease.sides(own.ray);
                let to_first = S::and(on_first, S::lt(first_cost.0, (times * second_cost).0));
                let to_second = S::and(on_second, S::lt(second_cost.0, (times * first_cost).0));
                let takes_second = S::or(S::and_not(to_first, is_better), to_second);
                let takes_second = S::and_not(S::eq(own.number.0, first.number.0), takes_second);
                let takes_second = S::or(takes_second, S::eq(own.number.0, second.number.0));
                let cost = S::select(takes_second, second_cost.0, first_cost.0);
                let takes_some = S::and(own.there.0, S::lt(cost, S::splat(f32::INFINITY)));
                let place = S::select(takes_second, second_places, first_places);
                taken[number] = S::select(takes_some, place, none);
            }
            for (line, choices) in choices.chunks_mut(width).enumerate() {
                let mut of_blocks = [Lanes::ZERO; BLOCK];
                let columns_of_line = std::array::from_fn(|column| taken[line * BLOCK + column]);
                for (to, fours) in of_blocks.iter_mut().zip(S::transpose_fours(columns_of_line)) {
                    S::store(to.0.as_mut_ptr(), fours);
                }
                for lane in 0..self.blocks.len() {
                    // Four of the first lane, then of the fourth next to it; between them those of the lanes between.
                    let four = &of_blocks[lane % 4].0[lane / 4 * 4..][..BLOCK];
                    let four: [u32; BLOCK] = std::array::from_fn(|at| four[at].to_bits());
                    let to = &mut choices[columns[lane]..];
                    // The last block may be cut.
                    match to.first_chunk_mut() {
                        Some(to) => *to = four,
                        None => to.copy_from_slice(&four[..to.len()]),
                    }
                }
            }
        }
    }
}

/// Whether and where the planes of two windows of each block meet between the middles of both.
struct Crease<S: Simd> {
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
    unsafe fn between(first: &Windows<S>, second: &Windows<S>, noise: Floats<S>) -> Self {
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
    unsafe fn sides(&self, ray: [Floats<S>; 3]) -> [S::F; 2] {
        // SAFETY: as the caller's.
        unsafe {
            let (side, zero) = (self.here * inverse_depth_along(self.gap, ray), S::splat(0.0));
            [S::and(self.there, S::lt(zero, side.0)), S::and(self.there, S::lt(side.0, zero))]
        }
    }
}

/// The columns or the rows of the image.
struct Axis {
    pixels: usize,
    blocks: usize,
    /// From a block to the next.
    number: usize,
}

impl Axis {
    /// The lines `at` of blocks, for blocks in their `own`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn lines<S: Simd>(&self, own: Floats<S>, at: Floats<S>) -> Lines<S> {
        let mut first = [0; LANES];
        // SAFETY: as the caller's.
        let from_own = unsafe {
            S::store_i(first.as_mut_ptr(), S::truncate_i(at.0));
            let middle =
                |line: Floats<S>| line * Floats::splat(BLOCK as f32) + Floats::splat(MIDDLE as f32);
            middle(at).min(Floats::splat((self.pixels - 1) as f32)) - middle(own)
        };
        Lines { first: first.map(|line| line as usize * self.number), from_own }
    }

    /// The lines at distances before and behind the blocks' own.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn around<S: Simd>(&self, own: Floats<S>, distance: Floats<S>) -> [Lines<S>; 2] {
        // SAFETY: as the caller's.
        unsafe {
            let last = Floats::splat((self.blocks - 1) as f32);
            let before = (own - distance).max(Floats::splat(0.0));
            let behind = (own + distance).min(last);
            [self.lines(own, before), self.lines(own, behind)]
        }
    }
}

/// `EvenWindows::tolerance`
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn tolerance<S: Simd>(depth: S::F, options: &Options) -> Floats<S> {
    // SAFETY: as the caller's.
    unsafe {
        let least = least_depth_change::<S>(depth, options);
        Floats(least) / Floats(S::mul(depth, depth)) * Floats::splat(0.5)
    }
}

/// Rows of a block's pixels and those around it.
const AROUND: usize = BLOCK + 2;

/// The rows of the image around a row of blocks. In each there is a column before the image's, and room behind it for what
/// is read of the last block.
#[derive(Debug, Default)]
struct Rows {
    /// Columns of the image, and elements of a row.
    width: usize,
    length: usize,
    /// `AROUND` rows; NaN outside the image.
    inverse_depths: Vec<f32>,
    /// `BLOCK` rows: the means of the pixels and those next to them, or NaN for pixels that count alone.
    means: Vec<f32>,
    /// `BLOCK` rows; NaN for the pixels that are not concerned.
    depths: Vec<f32>,
    /// A row: the sums over three rows of a column.
    columns: Vec<f32>,
}

impl Rows {
    /// Bytes held.
    fn size(&self) -> usize {
        let Rows { inverse_depths, means, depths, columns, .. } = self;
        [inverse_depths, means, depths, columns].map(bytes).iter().sum()
    }

    /// Has room for rows of an image of this width.
    fn resize(&mut self, width: usize) -> Result<(), Error> {
        if self.width == width {
            return Ok(());
        }
        // None, should there not be enough memory.
        self.width = 0;
        let length = (1 + width).next_multiple_of(LANES) + LANES;
        let Rows { inverse_depths, means, depths, columns, .. } = self;
        for (rows, count) in
            [(inverse_depths, AROUND), (means, BLOCK), (depths, BLOCK), (columns, 1)]
        {
            refill(rows, repeat_n(f32::NAN, count * length))?;
        }
        (self.width, self.length) = (width, length);
        Ok(())
    }

    /// Becomes those around another row of blocks; there is room.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn read<S: Along>(&mut self, even: &EvenWindows, row: usize) {
        let &EvenWindows { cloud, asked, concerned, .. } = even;
        let &Cloud { width, height, .. } = cloud;
        let length = self.length;
        for line in 0..AROUND {
            let y = (row * BLOCK + line).wrapping_sub(1);
            let inverse_depths = &mut self.inverse_depths[line * length..][..length];
            if y < height {
                let depths = &cloud.depths[y * width..][..width];
                // SAFETY: as the caller's.
                unsafe { invert::<S>(depths, &mut inverse_depths[1..]) };
            } else {
                inverse_depths.fill(f32::NAN);
            }
        }
        for line in 0..BLOCK {
            let y = row * BLOCK + line;
            if y >= height {
                self.depths[line * length..][..length].fill(f32::NAN);
                continue;
            }
            let depths = &cloud.depths[y * width..][..width];
            // SAFETY: as the caller's.
            unsafe {
                keep::<S>(depths, concerned.row(y), &mut self.depths[line * length + 1..]);
                self.find_means::<S>(line, asked.clean.spoilt.row(y));
            }
        }
    }

    /// Finds the means around the pixels of a line of the blocks, which are spoilt or not.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn find_means<S: Along>(&mut self, line: usize, spoilt: &[u64]) {
        let Rows { width, length, inverse_depths, columns, means, .. } = self;
        let rows = [line, line + 1, line + 2].map(|row| &inverse_depths[row * *length..]);
        // SAFETY: as the caller's; rows have room for whole groups.
        unsafe {
            for at in (0..*length).step_by(S::LANES) {
                let [above, own, below] =
                    [rows[0], rows[1], rows[2]].map(|row| row[at..][..S::LANES].as_ptr());
                let sum = S::add(S::add(S::load(above), S::load(own)), S::load(below));
                S::store(columns[at..][..S::LANES].as_mut_ptr(), sum);
            }
            let means = &mut means[line * *length + 1..];
            for x in (0..*width).step_by(S::LANES) {
                let is_spoilt = S::mask(marks_from(spoilt, x) as u32 & all(S::LANES));
                let [left, own, right] =
                    [x, x + 1, x + 2].map(|column| columns[column..][..S::LANES].as_ptr());
                let sum = S::add(S::add(S::load(left), S::load(own)), S::load(right));
                let mean = S::select(is_spoilt, S::splat(f32::NAN), S::div(sum, S::splat(NEXT)));
                S::store(means[x..][..S::LANES].as_mut_ptr(), mean);
            }
        }
    }

    /// The pixels of so many blocks, at most one for each lane, whose first columns are these, in a `row` of blocks: lanes
    /// without one take no window. Depths have this `noise`. They are written in place, as there are kilobytes.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn pixels<'p, S: Along>(
        &self,
        even: &EvenWindows,
        row: usize,
        (columns, blocks): (&[usize; LANES], usize),
        noise: Floats<S>,
        pixels: &'p mut MaybeUninit<[Pixels<S>; BLOCK * BLOCK]>,
    ) -> &'p [Pixels<S>; BLOCK * BLOCK] {
        let &EvenWindows { cloud, options, .. } = even;
        let (width, height) = (cloud.width, cloud.height);
        assert!(columns.iter().all(|column| *column < width) && width + BLOCK < self.length);
        // SAFETY: as the caller's; there are so many elements and points from every column on, and all pixels are written.
        unsafe {
            let there = S::mask((1 << blocks) - 1);
            let none = S::splat(f32::NAN);
            // Without noise each counts alone.
            let counts_alone = S::mask(if even.asked.noise.is_none { all(S::LANES) } else { 0 });
            let noise = match even.asked.noise.of_exact() {
                Some(noise) => Floats::splat(noise),
                None => noise,
            };
            let noise = Floats::splat(NEAR_NOISE) * noise;
            let of_mean = noise * Floats::splat(even.asked.noise_share());
            let to = pixels.as_mut_ptr().cast::<Pixels<S>>();
            for line in 0..BLOCK {
                let depths = self.four::<S>(&self.depths, line, columns);
                let inverse_depths = self.four::<S>(&self.inverse_depths, line + 1, columns);
                let means = self.four::<S>(&self.means, line, columns);
                // Rows below the image are none's.
                let y = (row * BLOCK + line).min(height - 1);
                let points = &cloud.points[y * width..][..width + BLOCK - 1];
                let points = four_points::<S>(points, columns);
                for column in 0..BLOCK {
                    let depth = S::select(there, depths[column], none);
                    let (inverse_depth, mean) = (Floats(inverse_depths[column]), means[column]);
                    let has_mean = S::and_not(counts_alone, S::eq(mean, mean));
                    let near = Near {
                        inverse_depth: Floats(S::select(has_mean, mean, inverse_depth.0)),
                        noise: Floats(S::select(has_mean, of_mean.0, noise.0)),
                    };
                    let [x, y, z] = points[column];
                    let z = if cloud.has_range { z * inverse_depth } else { Floats::splat(1.0) };
                    let number = line * BLOCK + column;
                    let [dx, dy] = [column, line].map(|line| line as f32 - MIDDLE as f32);
                    to.add(number).write(Pixels {
                        number: Floats::splat(number as f32),
                        at: [Floats::splat(dx), Floats::splat(dy)],
                        there: Floats(S::eq(depth, depth)),
                        ray: [x * inverse_depth, y * inverse_depth, z],
                        inverse_depth,
                        tolerance: tolerance::<S>(depth, options),
                        near,
                    });
                }
            }
            pixels.assume_init_ref()
        }
    }

    /// The columns of a block's line of some of the rows, for each lane the block that starts with one of these.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the rows have so many elements from every column on.
    #[inline(always)]
    unsafe fn four<S: Along>(
        &self,
        rows: &[f32],
        line: usize,
        columns: &[usize; LANES],
    ) -> [S::F; BLOCK] {
        let row = rows[line * self.length..][..self.length].as_ptr();
        // SAFETY: as the caller's.
        unsafe { load_by_fours::<S>(|lane| row.add(1 + columns[lane])) }
    }
}

/// x, y and z of the points in the columns of a block's line, which is in a row that starts with these points, for each lane
/// the block that starts with one of these columns.
///
/// # Safety
/// The processor has the instruction set of `S`; there are so many points from every column on.
#[inline(always)]
unsafe fn four_points<S: Along>(
    points: &[[f32; 3]],
    columns: &[usize; LANES],
) -> [[Floats<S>; 3]; BLOCK] {
    let points = points.as_ptr().cast::<f32>();
    // SAFETY: as the caller's.
    unsafe {
        let first = |lane: usize| points.add(3 * columns[lane]);
        let [x0, y0, z0, x1] = load_by_fours::<S>(first);
        let [y1, z1, x2, y2] = load_by_fours::<S>(|lane| first(lane).add(4));
        let [z2, x3, y3, z3] = load_by_fours::<S>(|lane| first(lane).add(8));
        [
            [Floats(x0), Floats(y0), Floats(z0)],
            [Floats(x1), Floats(y1), Floats(z1)],
            [Floats(x2), Floats(y2), Floats(z2)],
            [Floats(x3), Floats(y3), Floats(z3)],
        ]
    }
}

/// The depths of a row that are marked, for as many elements from the first one on; NaN for the others.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn keep<S: Simd>(depths: &[f32], marks: &[u64], to: &mut [f32]) {
    let whole = depths.len() / S::LANES * S::LANES;
    for x in (0..whole).step_by(S::LANES) {
        // SAFETY: as the caller's; so many elements are there.
        unsafe {
            let kept = S::mask(marks_from(marks, x) as u32 & all(S::LANES));
            let depths = S::load(depths[x..][..S::LANES].as_ptr());
            let to = to[x..][..S::LANES].as_mut_ptr();
            S::store(to, S::select(kept, depths, S::splat(f32::NAN)));
        }
    }
    for x in whole..depths.len() {
        to[x] = if marks_from(marks, x) & 1 != 0 { depths[x] } else { f32::NAN };
    }
}

/// One over the depths of a row, for as many elements from the first one on; NaN for a missing point.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn invert<S: Simd>(depths: &[f32], to: &mut [f32]) {
    let whole = depths.len() / S::LANES * S::LANES;
    for x in (0..whole).step_by(S::LANES) {
        // SAFETY: as the caller's; so many elements are there.
        unsafe {
            let inverse = S::div(S::splat(1.0), S::load(depths[x..][..S::LANES].as_ptr()));
            let inverse = S::select(S::finite(inverse), inverse, S::splat(f32::NAN));
            S::store(to[x..][..S::LANES].as_mut_ptr(), inverse);
        }
    }
    for x in whole..depths.len() {
        to[x] = inverse_depth(depths[x]);
    }
}
