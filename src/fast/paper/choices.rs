//! Which even window each pixel takes, fast, for one row of blocks: the plain form is in `paper::even_windows`. The
//! windows at one place of eight blocks are gathered together, and weighed for a pixel of each at a time.

use super::rects::STEPS;
use crate::fast::arithmetic::Floats;
use crate::fast::tile::Bits;
use crate::paper::{
    BLOCK, Blocks, CREASE_COST, CREASE_NOISE, Cloud, EXACT_SHARE, EvenWindow, EvenWindows, JITTER,
    MISFIT, NEAR, NEAR_NOISE, PLACES, REACH, inverse_depth,
};
use crate::simd::{GROUP, Groups};

/// Finds the choices of the pixels of a row of blocks, which are none so far.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(super) unsafe fn row<S: Groups>(even: &EvenWindows, row: usize, choices: &mut [Option<u32>]) {
    let neighbours = Neighbours::new(even.cloud, row);
    // SAFETY: as the caller's.
    let least_noise = unsafe { Floats::<S>::splat(even.asked.least_noise) };
    let [noise, there, exact] = [least_noise; 3];
    let mut found = Found { candidates: Vec::new(), number: 0, least_noise, noise, there, exact };
    let across = even.asked.blocks.across;
    for first in (0..across).step_by(GROUP) {
        let group = Group { even, row, first, count: (across - first).min(GROUP) };
        // SAFETY: as the caller's.
        unsafe {
            group.candidates(&mut found);
            if found.number > 0 {
                found.weigh();
                for (y, choices) in choices.chunks_mut(even.cloud.width).enumerate() {
                    for x in 0..BLOCK {
                        group.choose(&mut found, &neighbours, [x, y], choices);
                    }
                }
            }
        }
    }
}

/// Eight blocks of a row, of which `count` are inside the image.
struct Group<'a> {
    even: &'a EvenWindows<'a>,
    row: usize,
    /// The first block's column.
    first: usize,
    count: usize,
}

/// Columns or rows of blocks, one for each of eight.
struct Lines<S: Groups> {
    /// The number of the first block in the row, or that of the column.
    first: [usize; GROUP],
    /// The ways in pixels to the eight's own.
    to_own: Floats<S>,
}

/// Windows that the pixels of eight blocks may take, one each.
struct Candidates<S: Groups> {
    /// The blocks whose windows they are.
    places: [u32; GROUP],
    /// The mask of the blocks that may take theirs.
    may_take: S::F,
    /// The ways from the windows' pixels to the eight blocks' first.
    to_first: [Floats<S>; 2],
    radius: Floats<S>,
    planes: Inclined<S>,
    unevenness: Floats<S>,
    per_noise: Floats<S>,
    per_bend: Floats<S>,
    /// What the windows cost any pixel, once the noise is known; infinite for those that may not take theirs.
    even: Floats<S>,
    /// How far the sensor's noise along rows and columns moves points off the plane.
    jitter: Floats<S>,
    /// What the windows cost a pixel of each block; infinite where they end short of it and of its surface.
    cost: Floats<S>,
}

/// Planes by their inverse depths at the eight blocks' first pixels, and their changes per pixel to the right and down.
#[derive(Clone, Copy)]
struct Inclined<S: Groups> {
    at_first: Floats<S>,
    slope: [Floats<S>; 2],
}

impl<S: Groups> Inclined<S> {
    /// The inverse depths so far from the blocks' first pixels.
    #[inline(always)]
    fn at(&self, [x, y]: [Floats<S>; 2]) -> Floats<S> {
        self.at_first + self.slope[0] * x + self.slope[1] * y
    }

    /// How far the inverse depths are above the others'.
    #[inline(always)]
    fn minus(&self, other: &Inclined<S>) -> Inclined<S> {
        let [across, down] = self.slope;
        let slope = [across - other.slope[0], down - other.slope[1]];
        Inclined { at_first: self.at_first - other.at_first, slope }
    }

    /// Takes the others of a mask.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn replace(&mut self, mask: S::F, other: &Inclined<S>) {
        // SAFETY: as the caller's.
        unsafe {
            self.at_first.0 = S::select(mask, other.at_first.0, self.at_first.0);
            for (own, other) in self.slope.iter_mut().zip(other.slope) {
                own.0 = S::select(mask, other.0, own.0);
            }
        }
    }
}

/// Of the points next to each of eight pixels, as the plain form has them.
struct Near<S: Groups> {
    inverse_depth: Floats<S>,
    offset: [Floats<S>; 2],
    points: Floats<S>,
    /// The pixels' own inverse depths.
    own: Floats<S>,
}

impl<S: Groups> Candidates<S> {
    /// # Safety
    /// The processor has the instruction set of `S`.
    unsafe fn none() -> Self {
        // SAFETY: as the caller's.
        let zero = unsafe { Floats::splat(0.0) };
        let [radius, unevenness, per_noise, per_bend, even, jitter, cost] = [zero; 7];
        let (places, may_take) = ([0; GROUP], zero.0);
        let (to_first, planes) = ([zero; 2], Inclined { at_first: zero, slope: [zero; 2] });
        Candidates {
            places,
            may_take,
            to_first,
            radius,
            planes,
            unevenness,
            per_noise,
            per_bend,
            even,
            jitter,
            cost,
        }
    }
}

/// The windows that the pixels of eight blocks may take.
struct Found<S: Groups> {
    /// Only so many mean something.
    candidates: Vec<Candidates<S>>,
    number: usize,
    /// The least noise that is told from none, and the least among them.
    least_noise: Floats<S>,
    noise: Floats<S>,
    /// How many windows there are for each block, and how many of exact depths.
    there: Floats<S>,
    exact: Floats<S>,
}

impl<S: Groups> Found<S> {
    /// Adds the windows of the blocks in these columns and rows, for the eight blocks of a mask.
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
        const { assert!(size_of::<EvenWindow>() == 8 * size_of::<f32>()) };
        let place = |lane: usize| columns.first[lane] + rows.first[lane];
        debug_assert!((0..GROUP).all(|lane| place(lane) < windows.len()));
        let windows = windows.as_ptr();
        if self.number == self.candidates.len() {
            // SAFETY: as the caller's.
            self.candidates.push(unsafe { Candidates::none() });
        }
        let to = &mut self.candidates[self.number];
        self.number += 1;
        for lane in 0..GROUP {
            to.places[lane] = place(lane) as u32;
        }
        // SAFETY: as the caller's; a window is eight floats.
        unsafe {
            let (mut front, mut back) = ([S::splat(0.0); 4], [S::splat(0.0); 4]);
            for i in 0..4 {
                let at = |lane: usize| windows.add(place(lane)).cast::<f32>();
                let (low, high) = (at(i), at(i + 4));
                front[i] = S::load_halves(low, high);
                back[i] = S::load_halves(low.add(4), high.add(4));
            }
            let [radius, inverse_depth, across, down] = S::transpose_halves(front);
            let [unevenness, noise, per_noise, per_bend] = S::transpose_halves(back);
            let (across, down) = (Floats(across), Floats(down));
            let [dx, dy] = [columns.to_own, rows.to_own];
            let reach = Floats::<S>(radius) + Floats::splat(REACH + 1.0);
            let is_near = S::lt(dx.abs().max(dy.abs()).0, reach.0);
            let is_there = S::lt(S::splat(0.0), radius);
            to.may_take = S::and(may_take, S::and(is_near, is_there));
            to.to_first = [dx, dy];
            to.radius = Floats(radius);
            let at_first = Floats(inverse_depth) + across * dx + down * dy;
            to.planes = Inclined { at_first, slope: [across, down] };
            let steepness_squared = across * across + down * down;
            to.jitter = Floats::splat(JITTER) * steepness_squared.sqrt();
            to.unevenness = Floats(unevenness);
            to.per_noise = Floats(per_noise);
            to.per_bend = Floats(per_bend);
            let less = S::min(noise, self.noise.0);
            self.noise.0 = S::select(to.may_take, less, self.noise.0);
            let is_exact = S::and(
                S::lt(noise, self.least_noise.0),
                S::lt(self.least_noise.0, steepness_squared.0),
            );
            let one = S::and(to.may_take, S::splat(1.0));
            self.there = self.there + Floats(one);
            self.exact = self.exact + Floats(S::and(is_exact, one));
        }
    }

    /// Finds what the windows cost any pixel: all have been added.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn weigh(&mut self) {
        // SAFETY: as the caller's.
        unsafe {
            self.noise = self.noise.max(self.least_noise);
            for candidates in &mut self.candidates[..self.number] {
                let misfit = (candidates.unevenness - self.noise).max(Floats::splat(0.0));
                let even = self.noise * candidates.per_noise
                    + Floats::splat(MISFIT) * misfit * candidates.per_bend;
                let never = S::splat(f32::INFINITY);
                candidates.even = Floats(S::select(candidates.may_take, even.0, never));
            }
        }
    }

    /// The mask of the blocks whose windows say that depths are exact.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn are_exact(&self) -> S::F {
        // SAFETY: as the caller's.
        unsafe { S::lt((Floats::splat(EXACT_SHARE) * self.there).0, self.exact.0) }
    }
}

impl Group<'_> {
    /// Finds the windows that the blocks' pixels may take.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn candidates<S: Groups>(&self, found: &mut Found<S>) {
        let &Group { even, row, first, count } = self;
        let Blocks { across, down, .. } = even.asked.blocks;
        let own = row * across + first;
        let (mut levels, mut radii) = ([0.0; GROUP], [0.0; GROUP]);
        for lane in 0..count {
            let level = even.asked.levels[own + lane];
            levels[lane] = f32::from(level);
            if level > 0 {
                radii[lane] = even.asked.largest(own + lane) as f32;
            }
        }
        found.number = 0;
        // SAFETY: as the caller's; all places are inside the image.
        unsafe {
            let zero = Floats::<S>::splat(0.0);
            found.noise = Floats::splat(f32::INFINITY);
            (found.there, found.exact) = (zero, zero);
            let levels = S::load(levels.as_ptr());
            let mut radii = Floats::<S>::load(radii.as_ptr());
            let mut level = 0.0;
            let takes_any = S::lt(zero.0, levels);
            if S::bits(takes_any) == 0 {
                return;
            }
            // Lanes outside the image stand for the last block of the row.
            let last = Floats::<S>::splat((across - 1) as f32);
            let column = Floats::<S>::load(STEPS.as_ptr()) + Floats::splat(first as f32);
            let column = Floats::<S>(S::min(column.0, last.0));
            let row = Floats::<S>::splat(row as f32);
            let own = [lines::<S>(column, column, 1), lines(row, row, across)];
            found.add(even.windows, &own[0], &own[1], takes_any);
            loop {
                let may_take = S::and(S::lt(zero.0, radii.0), S::lt(S::splat(level), levels));
                if S::bits(may_take) == 0 {
                    break;
                }
                // Rounded up.
                let distance =
                    (radii + Floats::splat(BLOCK as f32 - 1.0)) / Floats::splat(BLOCK as f32);
                let distance = Floats(S::truncate(distance.0));
                let [left, right] = around(column, distance, across, 1);
                let [above, below] = around(row, distance, down, across);
                let columns = [&left, &own[0], &right];
                let rows = [&above, &own[1], &below];
                for (column, row) in PLACES {
                    found.add(even.windows, columns[column], rows[row], may_take);
                }
                radii = Floats(S::truncate((radii * Floats::splat(0.5)).0));
                level += 1.0;
            }
        }
    }

    /// Of the windows `found`, those that are worth most to the blocks' pixels in this column and row of theirs, for
    /// the choices of that row.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn choose<S: Groups>(
        &self,
        found: &mut Found<S>,
        neighbours: &Neighbours,
        [column, row]: [usize; 2],
        choices: &mut [Option<u32>],
    ) {
        let cloud = self.even.cloud;
        let x = self.first * BLOCK + column;
        let pixels = (self.row * BLOCK + row) * cloud.width + x;
        let mut tolerances = [0.0; GROUP];
        let (mut there, mut clean) = (0, 0);
        for lane in (0..self.count).take_while(|lane| x + lane * BLOCK < cloud.width) {
            let pixel = pixels + lane * BLOCK;
            there |= u32::from(!cloud.is_missing(pixel)) << lane;
            clean |= u32::from(self.even.asked.clean[pixel] > 0) << lane;
            tolerances[lane] = self.even.tolerance(pixel);
        }
        // SAFETY: as the caller's.
        unsafe {
            let noisy = clean & !S::bits(found.are_exact());
            let near = neighbours.near::<S>(self.first, [column, row], noisy);
            let (zero, one) = (Floats::splat(0.0), Floats::splat(1.0));
            let [column, row] = [column, row].map(|at| Floats::splat(at as f32));
            let tolerance = Floats::load(tolerances.as_ptr());
            let near_noise = Floats::splat(NEAR_NOISE) * found.noise / near.points;
            let at_near = [column + near.offset[0], row + near.offset[1]];
            let crease_noise = Floats::splat(CREASE_NOISE) * found.noise;
            let mut least = Floats::<S>::splat(f32::INFINITY);
            let mut best = S::splat(-1.0);
            let mut planes = Inclined { at_first: zero, slope: [zero; 2] };
            let mut middle = [zero; 2];
            let found = &mut found.candidates[..found.number];
            for (number, candidates) in found.iter_mut().enumerate() {
                let astray = near.inverse_depth - candidates.planes.at(at_near);
                let astray = (astray * astray - near_noise).max(zero);
                let per_astray = Floats::splat(NEAR) * candidates.per_bend;
                let [dx, dy] = candidates.to_first;
                let distance = (dx + column).abs().max((dy + row).abs());
                let short = (distance - candidates.radius).max(zero);
                let cost = (candidates.even + astray * per_astray) * (one + short * short);
                let off = (near.own - candidates.planes.at([column, row])).abs();
                let lies_in = S::lt(off.0, (tolerance + candidates.jitter).0);
                let is_beyond = S::and_not(lies_in, S::lt(zero.0, short.0));
                candidates.cost.0 = S::select(is_beyond, S::splat(f32::INFINITY), cost.0);
                let better = S::lt(candidates.cost.0, least.0);
                least.0 = S::select(better, cost.0, least.0);
                best = S::select(better, S::splat(number as f32), best);
                planes.replace(better, &candidates.planes);
                middle[0].0 = S::select(better, (zero - dx).0, middle[0].0);
                middle[1].0 = S::select(better, (zero - dy).0, middle[1].0);
            }
            // By chance the pixel may be nearer to the plane beyond a crease.
            least = Floats::splat(CREASE_COST) * least;
            for (number, candidates) in found.iter().enumerate() {
                let is_better = S::lt(candidates.cost.0, least.0);
                let gap = candidates.planes.minus(&planes);
                let [dx, dy] = candidates.to_first;
                let (here, there) = (gap.at([zero - dx, zero - dy]), gap.at(middle));
                let least_gap = Floats::<S>(S::min(here.abs().0, there.abs().0));
                let are_two = S::lt(crease_noise.0, (least_gap * least_gap).0);
                let is_crease = S::and(are_two, S::lt((here * there).0, zero.0));
                let is_this_side = S::lt(zero.0, (here * gap.at([column, row])).0);
                let better = S::and(is_better, S::and(is_crease, is_this_side));
                least.0 = S::select(better, candidates.cost.0, least.0);
                best = S::select(better, S::splat(number as f32), best);
            }
            let mut numbers = [0; GROUP];
            S::store_i(numbers.as_mut_ptr(), S::truncate_i(best));
            for lane in Bits(there) {
                let best = found.get(numbers[lane] as usize);
                choices[x + lane * BLOCK] = best.map(|candidates| candidates.places[lane]);
            }
        }
    }
}

/// The columns or rows `at`, which lie `number` blocks apart, on the way to those of the eight blocks.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn lines<S: Groups>(own: Floats<S>, at: Floats<S>, number: usize) -> Lines<S> {
    let mut first = [0; GROUP];
    // SAFETY: as the caller's.
    let to_own = unsafe {
        S::store_i(first.as_mut_ptr(), S::truncate_i(at.0));
        (own - at) * Floats::splat(BLOCK as f32)
    };
    Lines { first: first.map(|line| line as usize * number), to_own }
}

/// The columns or rows, of so many, at distances before and behind the eight blocks' own.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn around<S: Groups>(
    own: Floats<S>,
    distance: Floats<S>,
    count: usize,
    number: usize,
) -> [Lines<S>; 2] {
    // SAFETY: as the caller's.
    unsafe {
        let before = Floats(S::max((own - distance).0, S::splat(0.0)));
        let behind = Floats(S::min((own + distance).0, S::splat((count - 1) as f32)));
        [lines(own, before, number), lines(own, behind, number)]
    }
}

/// The inverse depths of a row of blocks, and of the pixels' rows above and below.
struct Neighbours {
    /// Row by row, for every column of blocks: element i + 1 is the i-th block's; NaN outside the image.
    inverse_depths: [[Vec<f32>; BLOCK]; BLOCK + 2],
}

impl Neighbours {
    fn new(cloud: &Cloud, row: usize) -> Self {
        let length = cloud.width.div_ceil(BLOCK).next_multiple_of(GROUP) + 2;
        let inverse_depths = std::array::from_fn(|line| {
            let mut columns = std::array::from_fn(|_| vec![f32::NAN; length]);
            let y = (row * BLOCK + line).wrapping_sub(1);
            if y < cloud.height {
                let depths = &cloud.depths[y * cloud.width..(y + 1) * cloud.width];
                for (x, depth) in depths.iter().enumerate() {
                    columns[x % BLOCK][x / BLOCK + 1] = inverse_depth(*depth);
                }
            }
            columns
        });
        Neighbours { inverse_depths }
    }

    /// Of the points next to those in a column and row of eight blocks from column `first` on; around pixels not in
    /// `noisy`, of these alone.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the blocks are inside the image but for those that make up eight.
    #[inline(always)]
    unsafe fn near<S: Groups>(
        &self,
        first: usize,
        [column, row]: [usize; 2],
        noisy: u32,
    ) -> Near<S> {
        // SAFETY: as the caller's; columns hold whole groups, and an element before and behind.
        unsafe {
            let zero = Floats::<S>::splat(0.0);
            let (mut sum, mut offset, mut points) = (zero, [zero; 2], zero);
            let mut own = zero;
            for (line, dy) in self.inverse_depths[row..row + 3].iter().zip([-1.0, 0.0, 1.0]) {
                for (way, dx) in [-1.0, 0.0, 1.0].into_iter().enumerate() {
                    // Counted from the block before.
                    let at = BLOCK + column + way - 1;
                    let column = &line[at % BLOCK];
                    let inverse = S::load(column.as_ptr().add(first + at / BLOCK));
                    let mut there = S::eq(inverse, inverse);
                    if dx == 0.0 && dy == 0.0 {
                        own = Floats(inverse);
                    } else {
                        there = S::and(there, S::mask(noisy));
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
