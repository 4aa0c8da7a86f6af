//! Which even window each pixel takes, fast, for rows of blocks: the plain form is in `paper::choices`. As many of the
//! blocks concerned as there are lanes form a group: the windows at one place of each are gathered together, and weighed
//! for a pixel of each at a time.

use std::iter::repeat_n;

use super::windows::least_depth_change;
use crate::Error;
use crate::fast::arithmetic::Floats;
use crate::fast::lanes::{LANES, Lanes};
use crate::fast::tile::Bits;
use crate::fast::windows::threshold;
use crate::memory::{make_room, refill};
use crate::options::{Options, Semantics};
use crate::paper::{
    ALIKE, BLOCK, Blocks, CREASE_COST, CREASE_NOISE, Cloud, EXACT_SHARE, EvenWindow, EvenWindows,
    JITTER, MIDDLE, MISFIT, NEAR, NEAR_NOISE, PLACES, REACH, inverse_depth,
};
use crate::simd::{Along, Groups, Simd};

/// Finds the choices of the pixels of some rows of blocks, which are none so far.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(super) unsafe fn rows<S: Groups>(
    even: &EvenWindows,
    rows: &mut dyn Iterator<Item = (usize, &mut [Option<u32>])>,
) -> Result<(), Error> {
    let Blocks { across, .. } = even.asked.blocks;
    let mut concerned = Vec::new();
    let mut neighbours = Neighbours::default();
    // SAFETY: as the caller's.
    let noise = unsafe { Floats::<S::Widest>::splat(0.0) };
    let mut found = Found { candidates: Vec::new(), number: 0, noise, exact: noise.0 };
    let lanes = S::Widest::LANES;
    for (row, choices) in rows {
        let levels = &even.asked.levels[row * across..][..across];
        make_room(&mut concerned, across)?;
        concerned.extend((0..across).filter(|block| levels[*block] > 0));
        neighbours.read(even, row, &concerned)?;
        for (number, blocks) in concerned.chunks(lanes).enumerate() {
            let group = Group { even, row, first: number * lanes, blocks };
            // SAFETY: as the caller's.
            unsafe {
                group.candidates(&mut found)?;
                found.weigh(even.asked.least_noise);
                for (y, choices) in choices.chunks_mut(even.cloud.width).enumerate() {
                    for x in 0..BLOCK {
                        group.choose(&mut found, &neighbours, [x, y], choices);
                    }
                }
            }
        }
    }
    Ok(())
}

/// Blocks of a row whose pixels can take windows, as many as there are lanes, or the last ones.
struct Group<'a> {
    even: &'a EvenWindows<'a>,
    row: usize,
    /// The number of the first among the row's.
    first: usize,
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

/// Windows that the pixels of a group may take, one each.
struct Candidates<S: Simd> {
    /// The blocks whose windows they are.
    places: [u32; LANES],
    /// Their fields.
    windows: [Floats<S>; FIELDS],
    /// The mask of the blocks that may take theirs.
    may_take: S::F,
    /// Where the windows' middles are, from the blocks' middle pixels.
    middles: [Floats<S>; 2],
    radius: Floats<S>,
    planes: Inclined<S>,
    per_bend: Floats<S>,
    /// What the windows cost any pixel; infinite for those that may not take theirs.
    even: Floats<S>,
    /// How far the sensor's noise along rows and columns moves points off the plane.
    jitter: Floats<S>,
    /// What the windows cost a pixel of each block; infinite where they end short of it and of its surface.
    cost: Floats<S>,
}

/// The fields of an [`EvenWindow`].
const FIELDS: usize = size_of::<EvenWindow>() / size_of::<f32>();

/// Planes by their inverse depths at the blocks' middle pixels, and their changes per pixel to the right and down.
#[derive(Clone, Copy)]
struct Inclined<S: Simd> {
    at_middle: Floats<S>,
    slope: [Floats<S>; 2],
}

impl<S: Simd> Inclined<S> {
    /// The inverse depths so far from the blocks' middle pixels.
    #[inline(always)]
    fn at(&self, [x, y]: [Floats<S>; 2]) -> Floats<S> {
        self.at_middle + self.slope[0] * x + self.slope[1] * y
    }

    /// How far the inverse depths are above the others'.
    #[inline(always)]
    fn minus(&self, other: &Inclined<S>) -> Inclined<S> {
        let [across, down] = self.slope;
        let slope = [across - other.slope[0], down - other.slope[1]];
        Inclined { at_middle: self.at_middle - other.at_middle, slope }
    }

    /// Takes the others of a mask.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn replace(&mut self, mask: S::F, other: &Inclined<S>) {
        // SAFETY: as the caller's.
        unsafe {
            self.at_middle.0 = S::select(mask, other.at_middle.0, self.at_middle.0);
            for (own, other) in self.slope.iter_mut().zip(other.slope) {
                own.0 = S::select(mask, other.0, own.0);
            }
        }
    }
}

/// Of the points next to a pixel of each block, as the plain form has them.
struct Near<S: Simd> {
    inverse_depth: Floats<S>,
    offset: [Floats<S>; 2],
    points: Floats<S>,
    /// The pixels' own inverse depths.
    own: Floats<S>,
}

impl<S: Simd> Candidates<S> {
    /// # Safety
    /// The processor has the instruction set of `S`.
    unsafe fn none() -> Self {
        // SAFETY: as the caller's.
        let zero = unsafe { Floats::splat(0.0) };
        Candidates {
            places: [0; LANES],
            windows: [zero; FIELDS],
            may_take: zero.0,
            middles: [zero; 2],
            radius: zero,
            planes: Inclined { at_middle: zero, slope: [zero; 2] },
            per_bend: zero,
            even: zero,
            jitter: zero,
            cost: zero,
        }
    }
}

/// The windows that the pixels of a group may take.
struct Found<S: Simd> {
    /// Only so many mean something.
    candidates: Vec<Candidates<S>>,
    number: usize,
    /// The least among them.
    noise: Floats<S>,
    /// The mask of the blocks whose windows say that depths are exact.
    exact: S::F,
}

impl<S: Along> Found<S> {
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
    ) -> Result<(), Error> {
        const { assert!(FIELDS == 8) };
        let place = |lane: usize| columns.first[lane] + rows.first[lane];
        debug_assert!((0..S::LANES).all(|lane| place(lane) < windows.len()));
        let windows = windows.as_ptr();
        if self.number == self.candidates.len() {
            self.candidates.try_reserve(1)?;
            // SAFETY: as the caller's.
            self.candidates.push(unsafe { Candidates::none() });
        }
        let to = &mut self.candidates[self.number];
        self.number += 1;
        for lane in 0..S::LANES {
            to.places[lane] = place(lane) as u32;
        }
        to.may_take = may_take;
        to.middles = [columns.from_own, rows.from_own];
        for first in [0, 4] {
            // SAFETY: as the caller's; a window is eight floats.
            unsafe {
                let mut fields = [S::splat(0.0); 4];
                for i in 0..4 {
                    let at = |four: usize| windows.add(to.places[i + 4 * four] as usize);
                    fields[i] = S::load_fours(|four| at(four).cast::<f32>().add(first));
                }
                let fields = S::transpose_fours(fields);
                for i in 0..4 {
                    to.windows[first + i] = Floats(fields[i]);
                }
            }
        }
        Ok(())
    }

    /// Finds what the windows cost any pixel: all have been added.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn weigh(&mut self, least_noise: f32) {
        // SAFETY: as the caller's.
        unsafe {
            let (zero, one) = (Floats::<S>::splat(0.0), S::splat(1.0));
            let least_noise = Floats::<S>::splat(least_noise);
            let (mut least, mut there, mut exact) = (Floats::splat(f32::INFINITY), zero, zero);
            for to in &mut self.candidates[..self.number] {
                let [radius, inverse_depth, across, down, _, noise, _, per_bend] = to.windows;
                let [dx, dy] = to.middles;
                let is_near =
                    S::lt(dx.abs().max(dy.abs()).0, (radius + Floats::splat(REACH + 1.0)).0);
                to.may_take = S::and(to.may_take, S::and(is_near, S::lt(zero.0, radius.0)));
                to.radius = radius;
                let at_middle = inverse_depth - across * dx - down * dy;
                to.planes = Inclined { at_middle, slope: [across, down] };
                let steepness_squared = across * across + down * down;
                to.jitter = Floats::splat(JITTER) * steepness_squared.sqrt();
                to.per_bend = per_bend;
                least.0 = S::select(to.may_take, S::min(noise.0, least.0), least.0);
                let is_exact = S::and(
                    S::lt(noise.0, least_noise.0),
                    S::lt(least_noise.0, steepness_squared.0),
                );
                let one = S::and(to.may_take, one);
                there = there + Floats(one);
                exact = exact + Floats(S::and(is_exact, one));
            }
            self.exact = S::lt((Floats::splat(EXACT_SHARE) * there).0, exact.0);
            self.noise = least.max(least_noise);
            for to in &mut self.candidates[..self.number] {
                let [_, _, _, _, unevenness, _, per_noise, _] = to.windows;
                let misfit = (unevenness - self.noise).max(zero);
                let even = self.noise * per_noise + Floats::splat(MISFIT) * misfit * to.per_bend;
                to.even = Floats(S::select(to.may_take, even.0, S::splat(f32::INFINITY)));
            }
        }
    }
}

impl Group<'_> {
    /// Finds the windows that the blocks' pixels may take.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn candidates<S: Along>(&self, found: &mut Found<S>) -> Result<(), Error> {
        let &Group { even, row, blocks, .. } = self;
        let Blocks { across, down, .. } = even.asked.blocks;
        let &Cloud { width, height, .. } = even.cloud;
        let (mut levels, mut radii) = (Lanes::ZERO, Lanes::ZERO);
        // Lanes without a block stand for the first one, and take nothing.
        let mut column = Lanes([blocks[0] as f32; LANES]);
        for (lane, block) in blocks.iter().enumerate() {
            let own = row * across + block;
            levels.0[lane] = f32::from(even.asked.levels[own]);
            radii.0[lane] = even.asked.largest(own) as f32;
            column.0[lane] = *block as f32;
        }
        found.number = 0;
        // SAFETY: as the caller's; all places are inside the image.
        unsafe {
            let zero = Floats::<S>::splat(0.0);
            let levels = levels.load::<S>();
            let mut radii = Floats::<S>(radii.load::<S>());
            let mut level = 0.0;
            let takes_any = S::lt(zero.0, levels);
            let column = Floats::<S>(column.load::<S>());
            let row = Floats::<S>::splat(row as f32);
            let columns = Axis { pixels: width, blocks: across, number: 1 };
            let rows = Axis { pixels: height, blocks: down, number: across };
            let own = [columns.lines::<S>(column, column), rows.lines(row, row)];
            found.add(even.windows, &own[0], &own[1], takes_any)?;
            loop {
                let may_take = S::and(S::lt(zero.0, radii.0), S::lt(S::splat(level), levels));
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
                for (column, row) in PLACES {
                    found.add(even.windows, across[column], down[row], may_take)?;
                }
                radii = Floats(S::truncate((radii * Floats::splat(0.5)).0));
                level += 1.0;
            }
        }
        Ok(())
    }

    /// Of the windows `found`, those that are worth most to the blocks' pixels in this column and row of theirs, for
    /// the choices of that row.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn choose<S: Simd>(
        &self,
        found: &mut Found<S>,
        neighbours: &Neighbours,
        [column, row]: [usize; 2],
        choices: &mut [Option<u32>],
    ) {
        let x = |lane: usize| self.blocks[lane] * BLOCK + column;
        // SAFETY: as the caller's.
        unsafe {
            let (depth, clean) = neighbours.own::<S>(self.first, [column, row]);
            let there = S::bits(S::eq(depth, depth));
            let tolerance = tolerance::<S>(depth, self.even.options);
            let noisy = S::and_not(found.exact, S::lt(S::splat(0.0), clean));
            let near = neighbours.near::<S>(self.first, [column, row], noisy);
            let (zero, one) = (Floats::splat(0.0), Floats::splat(1.0));
            let [column, row] = [column, row].map(|at| Floats::splat(at as f32 - MIDDLE as f32));
            let near_noise = Floats::splat(NEAR_NOISE) * found.noise / near.points;
            let at_near = [column + near.offset[0], row + near.offset[1]];
            let crease_noise = Floats::splat(CREASE_NOISE) * found.noise;
            let alike = Floats::splat(ALIKE);
            let mut least = Floats::<S>::splat(f32::INFINITY);
            let mut best = S::splat(-1.0);
            let mut planes = Inclined { at_middle: zero, slope: [zero; 2] };
            let mut middle = [zero; 2];
            let found = &mut found.candidates[..found.number];
            for (number, candidates) in found.iter_mut().enumerate() {
                let astray = near.inverse_depth - candidates.planes.at(at_near);
                let astray = (astray * astray - near_noise).max(zero);
                let per_astray = Floats::splat(NEAR) * candidates.per_bend;
                let [dx, dy] = candidates.middles;
                let distance = (column - dx).abs().max((row - dy).abs());
                let short = (distance - candidates.radius).max(zero);
                let cost = (candidates.even + astray * per_astray) * (one + short * short);
                let off = (near.own - candidates.planes.at([column, row])).abs();
                let lies_in = S::lt(off.0, (tolerance + candidates.jitter).0);
                let is_beyond = S::and_not(lies_in, S::lt(zero.0, short.0));
                candidates.cost.0 = S::select(is_beyond, S::splat(f32::INFINITY), cost.0);
                let better = S::lt(candidates.cost.0, least.0);
                least.0 = S::select(better, (alike * cost).0, least.0);
                best = S::select(better, S::splat(number as f32), best);
                planes.replace(better, &candidates.planes);
                middle[0].0 = S::select(better, dx.0, middle[0].0);
                middle[1].0 = S::select(better, dy.0, middle[1].0);
            }
            // By chance the pixel may be nearer to the plane beyond a crease.
            least = Floats::splat(CREASE_COST) * least;
            for (number, candidates) in found.iter().enumerate() {
                let is_better = S::lt(candidates.cost.0, least.0);
                let gap = candidates.planes.minus(&planes);
                let (here, there) = (gap.at(candidates.middles), gap.at(middle));
                let least_gap = Floats::<S>(S::min(here.abs().0, there.abs().0));
                let are_two = S::lt(crease_noise.0, (least_gap * least_gap).0);
                let is_crease = S::and(are_two, S::lt((here * there).0, zero.0));
                let is_this_side = S::lt(zero.0, (here * gap.at([column, row])).0);
                let better = S::and(is_better, S::and(is_crease, is_this_side));
                least.0 = S::select(better, (alike * candidates.cost).0, least.0);
                best = S::select(better, S::splat(number as f32), best);
            }
            let mut numbers = [0; LANES];
            S::store_i(numbers.as_mut_ptr(), S::truncate_i(best));
            for lane in Bits(there) {
                let best = found.get(numbers[lane] as usize);
                choices[x(lane)] = best.map(|candidates| candidates.places[lane]);
            }
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
            Floats(S::min(middle(at).0, S::splat((self.pixels - 1) as f32))) - middle(own)
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
            let last = S::splat((self.blocks - 1) as f32);
            let before = Floats(S::max((own - distance).0, S::splat(0.0)));
            let behind = Floats(S::min((own + distance).0, last));
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
        let least = match options.semantics {
            Semantics::Paper => least_depth_change::<S>(depth, &options.paper),
            Semantics::Pcl => threshold::<S>(depth, S::splat(options.max_depth_change_factor)),
        };
        Floats(least) / Floats(S::mul(depth, depth)) * Floats::splat(0.5)
    }
}

/// Blocks of a row, and the pixels around them, pixel by pixel of a block: so many of each, block by block; NaN outside
/// the image.
#[derive(Default)]
struct Neighbours {
    blocks: usize,
    /// Of the blocks' own pixels.
    depths: Vec<f32>,
    clean: Vec<f32>,
    /// Of those around them too.
    inverse_depths: Vec<f32>,
    /// A row of the image, with a column before it, and room behind it for the last block.
    inverse: Vec<f32>,
}

/// Rows and columns of a block's pixels and those around it.
const AROUND: usize = BLOCK + 2;

impl Neighbours {
    /// Becomes those of other blocks.
    fn read(&mut self, even: &EvenWindows, row: usize, blocks: &[usize]) -> Result<(), Error> {
        let &EvenWindows { cloud, asked, .. } = even;
        let Neighbours { blocks: length, depths, clean, inverse_depths, inverse } = self;
        *length = blocks.len().next_multiple_of(LANES);
        for of_own in [&mut *depths, &mut *clean] {
            refill(of_own, repeat_n(f32::NAN, BLOCK * BLOCK * *length))?;
        }
        refill(inverse_depths, repeat_n(f32::NAN, AROUND * AROUND * *length))?;
        refill(inverse, repeat_n(f32::NAN, cloud.width + AROUND))?;
        for line in 0..AROUND {
            let y = (row * BLOCK + line).wrapping_sub(1);
            if y >= cloud.height {
                continue;
            }
            let pixels = y * cloud.width..(y + 1) * cloud.width;
            let (row_depths, row_clean) = (&cloud.depths[pixels.clone()], &asked.clean[pixels]);
            for (to, depth) in inverse[1..].iter_mut().zip(row_depths) {
                *to = inverse_depth(*depth);
            }
            for column in 0..AROUND {
                let to = &mut inverse_depths[(line * AROUND + column) * *length..];
                for (to, block) in to.iter_mut().zip(blocks) {
                    *to = inverse[block * BLOCK + column];
                }
            }
            if !(1..=BLOCK).contains(&line) {
                continue;
            }
            for column in 0..BLOCK {
                let to = ((line - 1) * BLOCK + column) * *length;
                let of_own = depths[to..].iter_mut().zip(&mut clean[to..]);
                for ((depth, clean), block) in of_own.zip(blocks) {
                    let x = block * BLOCK + column;
                    if x < cloud.width {
                        (*depth, *clean) = (row_depths[x], row_clean[x] as f32);
                    }
                }
            }
        }
        Ok(())
    }

    /// The depths and the clean radii of the pixels in a column and row of the blocks from the `first` on.
    ///
    /// # Safety
    /// As [`Neighbours::near`].
    #[inline(always)]
    unsafe fn own<S: Simd>(&self, first: usize, [column, row]: [usize; 2]) -> (S::F, S::F) {
        let at = (row * BLOCK + column) * self.blocks + first;
        // SAFETY: as the caller's; blocks are whole groups.
        unsafe { (S::load(self.depths[at..].as_ptr()), S::load(self.clean[at..].as_ptr())) }
    }

    /// Of the points next to those in a column and row of the blocks from the `first` on; around pixels not in the mask
    /// `noisy`, of these alone.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the first is one of the blocks, and starts a group.
    #[inline(always)]
    unsafe fn near<S: Simd>(
        &self,
        first: usize,
        [column, row]: [usize; 2],
        noisy: S::F,
    ) -> Near<S> {
        // SAFETY: as the caller's; blocks are whole groups.
        unsafe {
            let zero = Floats::<S>::splat(0.0);
            let (mut sum, mut offset, mut points) = (zero, [zero; 2], zero);
            let mut own = zero;
            for (line, dy) in (row..row + 3).zip([-1.0, 0.0, 1.0]) {
                for (column, dx) in (column..column + 3).zip([-1.0, 0.0, 1.0]) {
                    let at = (line * AROUND + column) * self.blocks + first;
                    let inverse = S::load(self.inverse_depths[at..].as_ptr());
                    let mut there = S::eq(inverse, inverse);
                    if dx == 0.0 && dy == 0.0 {
                        own = Floats(inverse);
                    } else {
                        there = S::and(there, noisy);
                    }
                    sum = sum + Floats(S::and(there, inverse));
                    offset[0] = offset[0] + Floats(S::and(there, S::splat(dx)));
                    offset[1] = offset[1] + Floats(S::and(there, S::splat(dy)));
                    points = points + Floats(S::and(there, S::splat(1.0)));
                }
            }
            let offset = [offset[0] / points, offset[1] / points];
            Near { inverse_depth: sum / points, offset, points, own }
        }
    }
}
