//! Which even window each pixel takes, fast, for rows of blocks: the plain form is in `paper::choices`. As many of the
//! blocks concerned as there are lanes form a group: the windows at one place of each are gathered together, and weighed
//! for a pixel of each at a time.

use std::mem::MaybeUninit;

use super::block_pixels::{Pixels, Rows};
use super::candidates::{Candidate, Candidates, Crease, Lines};
use crate::Error;
use crate::cache::Level;
use crate::fast::arithmetic::Floats;
use crate::fast::lanes::{LANES, Lanes};
use crate::memory::{bytes, make_room, resize};
use crate::paper::{
    ALIKE, BLOCK, Blocks, CREASE_COST, Cloud, EvenWindows, MIDDLE, NO_WINDOW, marks_from, places_at,
};
use crate::simd::{Along, Groups, Simd};

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
                let mut found = Candidates::<S::Widest>::none(candidates);
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
    candidates: Vec<Candidate>,
}

impl Scratch {
    /// Makes room for images of this width and windows up to the radius `limit`.
    pub fn reserve(&mut self, width: usize, limit: u32) -> Result<(), Error> {
        make_room(&mut self.concerned, width.div_ceil(BLOCK))?;
        // A block's own and those around it, for as many radii as the largest can be halved to.
        let levels = 0..=limit.ilog2() as u8;
        let most = 1 + levels.map(|level| places_at(level).len()).sum::<usize>();
        resize(&mut self.candidates, most, Candidate::NONE)?;
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
    unsafe fn candidates<S: Along>(&self, found: &mut Candidates<'_, S>) {
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
    unsafe fn choose<S: Along>(
        &self,
        found: &mut Candidates<'_, S>,
        rows: &Rows,
        choices: &mut [u32],
    ) {
        // SAFETY: as the caller's.
        unsafe {
            let mut columns = [0; LANES];
            for lane in 0..self.blocks.len() {
                columns[lane] = self.blocks[lane] * BLOCK;
            }
            let blocks = (&columns, self.blocks.len());
            let mut pixels = MaybeUninit::uninit();
            let pixels = rows.pixels(self.even, self.row, blocks, found.noise, &mut pixels);
            let first = first_of(pixels);
            let (first_best, first_windows) = found.best(&first);
            let mut first_costs = [found.noise; BLOCK * BLOCK];
            for number in 0..BLOCK * BLOCK {
                first_costs[number] = first_windows.cost(&pixels[number]);
            }
            let second = worst_served(pixels, &first, &first_costs);
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
            self.put::<S>(&taken, choices);
        }
    }

    /// Puts the choices of the blocks' pixels where they belong in their rows.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn put<S: Along>(&self, taken: &[S::F; BLOCK * BLOCK], choices: &mut [u32]) {
        // SAFETY: as the caller's.
        unsafe {
            for (line, choices) in choices.chunks_mut(self.even.cloud.width).enumerate() {
                let mut of_blocks = [Lanes::ZERO; BLOCK];
                let columns_of_line = std::array::from_fn(|column| taken[line * BLOCK + column]);
                for (to, fours) in of_blocks.iter_mut().zip(S::transpose_fours(columns_of_line)) {
                    S::store(to.0.as_mut_ptr(), fours);
                }
                for (lane, block) in self.blocks.iter().enumerate() {
                    // Four of the first lane, then of the fourth next to it; between them those of the lanes between.
                    let four = &of_blocks[lane % 4].0[lane / 4 * 4..][..BLOCK];
                    let four: [u32; BLOCK] = std::array::from_fn(|at| four[at].to_bits());
                    let to = &mut choices[block * BLOCK..];
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

/// The middle pixel of each block, or the first there is.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn first_of<S: Simd>(pixels: &[Pixels<S>; BLOCK * BLOCK]) -> Pixels<S> {
    let mut first = pixels[MIDDLE * BLOCK + MIDDLE];
    for other in pixels {
        // SAFETY: as the caller's.
        unsafe {
            let takes = S::and_not(first.there.0, other.there.0);
            // Mostly none does.
            if S::bits(takes) != 0 {
                first.take(takes, other);
            }
        }
    }
    first
}

/// The pixel of each block to which its window is worth least, by what that costs each; the first one, if to none.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn worst_served<S: Simd>(
    pixels: &[Pixels<S>; BLOCK * BLOCK],
    first: &Pixels<S>,
    costs: &[Floats<S>; BLOCK * BLOCK],
) -> Pixels<S> {
    // SAFETY: as the caller's.
    unsafe {
        let (mut worst, mut largest) = (*first, S::splat(-1.0));
        for (other, cost) in pixels.iter().zip(costs) {
            let is_first = S::eq(other.number.0, first.number.0);
            let cost = Floats::<S>(S::and_not(is_first, cost.0));
            let alike = cost * Floats::splat(ALIKE);
            let worse = S::and(other.there.0, S::lt(largest, alike.0));
            worst.take(worse, other);
            largest = S::select(worse, cost.0, largest);
        }
        worst
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
