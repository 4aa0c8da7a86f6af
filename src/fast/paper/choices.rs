//! Which even window each pixel takes, fast, for one row of the image: the plain form is in `paper::even_windows`. The
//! windows at one place of eight pixels are gathered and weighed together.

use super::rects::STEPS;
use crate::fast::arithmetic::Floats;
use crate::fast::tile::Bits;
use crate::paper::{
    Cloud, EvenWindow, EvenWindows, JITTER, MISFIT, NEAR, NEAR_NOISE, REACH, inverse_depth,
};
use crate::simd::{GROUP, Simd};

/// Columns and rows of the places around a pixel, 0 before it, 1 its own, 2 behind it, in the plain form's order.
const PLACES: [(usize, usize); 8] =
    [(0, 1), (2, 1), (1, 0), (1, 2), (0, 0), (2, 0), (0, 2), (2, 2)];

/// Finds the choices of row `y`.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(super) unsafe fn row<S: Simd>(even: &EvenWindows, y: usize, choices: &mut [Option<usize>]) {
    let neighbours = Neighbours::new(even.cloud, y);
    // SAFETY: as the caller's.
    let noise = unsafe { Floats::<S>::splat(0.0) };
    let mut found = Found { candidates: Vec::new(), number: 0, noise };
    for x in (0..choices.len()).step_by(GROUP) {
        let choices = &mut choices[x..];
        let count = choices.len().min(GROUP);
        let group = Group { even, x, y, count };
        // SAFETY: as the caller's.
        unsafe {
            group.candidates(&mut found);
            if found.number > 0 {
                let near = neighbours.near(&group);
                group.choose(&found, &near, &mut choices[..count]);
            }
        }
    }
}

/// Eight pixels of a row, of which the first `count` are inside the image.
struct Group<'a> {
    even: &'a EvenWindows<'a>,
    x: usize,
    y: usize,
    count: usize,
}

/// Windows that eight pixels may take, one each.
struct Candidates<S: Simd> {
    /// The pixels whose windows they are.
    places: [usize; GROUP],
    /// Which of the eight may take theirs.
    lanes: u32,
    to_pixel: [Floats<S>; 2],
    /// How many pixels the windows end short of the eight.
    short: Floats<S>,
    inverse_depth: Floats<S>,
    slope: [Floats<S>; 2],
    unevenness: Floats<S>,
    per_noise: Floats<S>,
    per_bend: Floats<S>,
}

/// Of the points next to each of eight pixels, as the plain form has them.
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
        let [short, inverse_depth, unevenness, per_noise, per_bend] = [zero; 5];
        let (places, lanes, to_pixel, slope) = ([0; GROUP], 0, [zero; 2], [zero; 2]);
        Candidates {
            places,
            lanes,
            to_pixel,
            short,
            inverse_depth,
            slope,
            unevenness,
            per_noise,
            per_bend,
        }
    }
}

/// The windows that eight pixels may take.
struct Found<S: Simd> {
    /// Only so many mean something.
    candidates: Vec<Candidates<S>>,
    number: usize,
    /// The least among them.
    noise: Floats<S>,
}

impl<S: Simd> Found<S> {
    /// Adds the windows at places from which `to_pixel` leads to the pixels of these `lanes`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the places are inside the image.
    #[inline(always)]
    unsafe fn add(
        &mut self,
        windows: &[EvenWindow],
        places: [usize; GROUP],
        to_pixel: [Floats<S>; 2],
        lanes: u32,
    ) {
        const { assert!(size_of::<EvenWindow>() == 8 * size_of::<f32>()) };
        debug_assert!(places.iter().all(|place| *place < windows.len()));
        let windows = windows.as_ptr().cast::<f32>();
        if self.number == self.candidates.len() {
            // SAFETY: as the caller's.
            self.candidates.push(unsafe { Candidates::none() });
        }
        let to = &mut self.candidates[self.number];
        self.number += 1;
        // SAFETY: as the caller's; a window is eight floats.
        unsafe {
            let (mut front, mut back) = ([S::splat(0.0); 4], [S::splat(0.0); 4]);
            for i in 0..4 {
                let (low, high) = (windows.add(8 * places[i]), windows.add(8 * places[i + 4]));
                front[i] = S::load_halves(low, high);
                back[i] = S::load_halves(low.add(4), high.add(4));
            }
            let [radius, inverse_depth, across, down] = S::transpose_halves(front);
            let [unevenness, noise, per_noise, per_bend] = S::transpose_halves(back);
            let zero = Floats::splat(0.0);
            let radius = Floats(radius);
            let distance = to_pixel[0].abs().max(to_pixel[1].abs());
            let near = distance.lt(radius + Floats::splat(REACH + 1.0));
            to.places = places;
            to.lanes = lanes & zero.lt(radius) & near;
            to.to_pixel = to_pixel;
            to.short = (distance - radius).max(zero);
            to.inverse_depth = Floats(inverse_depth);
            to.slope = [Floats(across), Floats(down)];
            to.unevenness = Floats(unevenness);
            to.per_noise = Floats(per_noise);
            to.per_bend = Floats(per_bend);
            let less = S::min(noise, self.noise.0);
            self.noise.0 = S::select(S::mask(to.lanes), less, self.noise.0);
        }
    }
}

impl Group<'_> {
    /// Finds the windows that the pixels may take.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn candidates<S: Simd>(&self, found: &mut Found<S>) {
        let &Group { even, x, y, count } = self;
        let &Cloud { width, height, .. } = even.cloud;
        let first = y * width + x;
        let levels = &even.asked.levels[first..first + count];
        let mut lanes = 0;
        for (lane, levels) in levels.iter().enumerate() {
            lanes |= u32::from(*levels > 0) << lane;
        }
        found.number = 0;
        if lanes == 0 {
            return;
        }
        // Lanes outside the image stand for the last pixel of the row.
        let mut columns = [0; GROUP];
        let mut radii = [0; GROUP];
        for (lane, column) in columns.iter_mut().enumerate() {
            *column = (x + lane).min(width - 1);
        }
        for lane in Bits(lanes) {
            radii[lane] = even.asked.largest(first + lane) as usize;
        }
        let places = columns.map(|column| y * width + column);
        // SAFETY: as the caller's; all places are inside the image.
        unsafe {
            let zero = Floats::splat(0.0);
            found.noise = Floats::splat(f32::INFINITY);
            found.add(even.windows, places, [zero; 2], lanes);
            let row = Floats::<S>::splat(y as f32);
            let last = Floats::<S>::splat((width - 1) as f32);
            let column = Floats::<S>(S::load(STEPS.as_ptr())) + Floats::splat(x as f32);
            let column = Floats(S::min(column.0, last.0));
            for level in 0.. {
                let mut active = 0;
                for lane in Bits(lanes) {
                    let there = radii[lane] > 0 && levels[lane] > level;
                    active |= u32::from(there) << lane;
                }
                if active == 0 {
                    break;
                }
                let mut at_columns = [columns; 3];
                let mut at_rows = [[y * width; GROUP]; 3];
                let mut lengths = [0.0; GROUP];
                for lane in 0..GROUP {
                    let (left, right) = around(columns[lane], radii[lane], width);
                    let (up, down) = around(y, radii[lane], height);
                    (at_columns[0][lane], at_columns[2][lane]) = (left, right);
                    (at_rows[0][lane], at_rows[2][lane]) = (up * width, down * width);
                    lengths[lane] = radii[lane] as f32;
                }
                let lengths = Floats(S::load(lengths.as_ptr()));
                let to_columns = ways(column, lengths, width);
                let to_rows = ways(row, lengths, height);
                for (column, row) in PLACES {
                    let mut places = [0; GROUP];
                    for lane in 0..GROUP {
                        places[lane] = at_rows[row][lane] + at_columns[column][lane];
                    }
                    let to_pixel = [to_columns[column], to_rows[row]];
                    found.add(even.windows, places, to_pixel, active);
                }
                for radius in &mut radii {
                    *radius /= 2;
                }
            }
        }
    }

    /// Of the windows `found`, those that are worth most to the pixels.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn choose<S: Simd>(
        &self,
        found: &Found<S>,
        near: &Near<S>,
        choices: &mut [Option<usize>],
    ) {
        let first = self.y * self.even.cloud.width + self.x;
        let mut tolerances = [0.0; GROUP];
        for (lane, tolerance) in tolerances[..self.count].iter_mut().enumerate() {
            *tolerance = self.even.tolerance(first + lane);
        }
        // SAFETY: as the caller's.
        unsafe {
            let (zero, one) = (Floats::splat(0.0), Floats::splat(1.0));
            let tolerance = Floats(S::load(tolerances.as_ptr()));
            let noise = found.noise.max(Floats::splat(self.even.asked.least_noise));
            let near_noise = Floats::splat(NEAR_NOISE) * noise / near.points;
            let mut least = Floats::splat(f32::INFINITY);
            let mut best = S::splat(-1.0);
            let found = &found.candidates[..found.number];
            for (number, candidates) in found.iter().enumerate() {
                let [dx, dy] = candidates.to_pixel;
                let [across, down] = candidates.slope;
                let far = one + candidates.short * candidates.short;
                let at_near = candidates.inverse_depth
                    + across * (dx + near.offset[0])
                    + down * (dy + near.offset[1]);
                let astray = near.inverse_depth - at_near;
                let astray = (astray * astray - near_noise).max(zero);
                let misfit = (candidates.unevenness - noise).max(zero);
                let bend = Floats::splat(MISFIT) * misfit + Floats::splat(NEAR) * astray;
                let cost = (noise * candidates.per_noise + bend * candidates.per_bend) * far;
                let at_pixel = candidates.inverse_depth + across * dx + down * dy;
                let steepness = (across * across + down * down).sqrt();
                let limit = tolerance + Floats::splat(JITTER) * steepness;
                let lies_in = (near.own - at_pixel).abs().lt(limit);
                let can_take = candidates.lanes & (lies_in | !zero.lt(candidates.short));
                let better = S::mask(cost.lt(least) & can_take);
                least.0 = S::select(better, cost.0, least.0);
                best = S::select(better, S::splat(number as f32), best);
            }
            let mut numbers = [0; GROUP];
            S::store_i(numbers.as_mut_ptr(), S::truncate_i(best));
            for ((lane, number), choice) in numbers.into_iter().enumerate().zip(choices) {
                *choice = found.get(number as usize).map(|candidates| candidates.places[lane]);
            }
        }
    }
}

/// The columns or rows, of so many, that a window reaches.
#[inline(always)]
fn around(at: usize, radius: usize, count: usize) -> (usize, usize) {
    (at.saturating_sub(radius), (at + radius).min(count - 1))
}

/// The ways back from the first column or row, of so many, that windows reach around `at`, from `at` itself and from the
/// last.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
unsafe fn ways<S: Simd>(at: Floats<S>, radii: Floats<S>, count: usize) -> [Floats<S>; 3] {
    // SAFETY: as the caller's.
    unsafe {
        let zero = Floats::splat(0.0);
        let rest = Floats::splat((count - 1) as f32) - at;
        [Floats(S::min(radii.0, at.0)), zero, zero - Floats(S::min(radii.0, rest.0))]
    }
}

/// The inverse depths of a row and those above and below.
struct Neighbours {
    /// Element i + 1 of a row is the i-th column's; NaN outside the image.
    inverse_depths: [Vec<f32>; 3],
}

impl Neighbours {
    fn new(cloud: &Cloud, y: usize) -> Self {
        let length = cloud.width.next_multiple_of(GROUP) + 2;
        let mut inverse_depths = [const { Vec::new() }; 3];
        for (row, inverse_depths) in (y..y + 3).zip(&mut inverse_depths) {
            *inverse_depths = vec![f32::NAN; length];
            if (1..=cloud.height).contains(&row) {
                let depths = &cloud.depths[(row - 1) * cloud.width..row * cloud.width];
                for (to, depth) in inverse_depths[1..].iter_mut().zip(depths) {
                    *to = inverse_depth(*depth);
                }
            }
        }
        Neighbours { inverse_depths }
    }

    /// # Safety
    /// The processor has the instruction set of `S`; the group is of this row.
    #[inline(always)]
    unsafe fn near<S: Simd>(&self, group: &Group) -> Near<S> {
        let first = group.y * group.even.cloud.width + group.x;
        let mut clean = 0;
        for (lane, radius) in group.even.asked.clean[first..first + group.count].iter().enumerate()
        {
            clean |= u32::from(*radius > 0) << lane;
        }
        // SAFETY: as the caller's; rows hold whole groups, and an element before and behind.
        unsafe {
            let zero = Floats::<S>::splat(0.0);
            let (mut sum, mut offset, mut points) = (zero, [zero; 2], zero);
            let mut own = zero;
            for (row, dy) in self.inverse_depths.iter().zip([-1.0, 0.0, 1.0]) {
                for (column, dx) in (group.x..group.x + 3).zip([-1.0, 0.0, 1.0]) {
                    let inverse = S::load(row.as_ptr().add(column));
                    let mut there = S::eq(inverse, inverse);
                    if dx == 0.0 && dy == 0.0 {
                        own = Floats(inverse);
                    } else {
                        there = S::and(there, S::mask(clean));
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
