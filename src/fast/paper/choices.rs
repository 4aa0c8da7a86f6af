//! Which even window each pixel takes, fast, for one row of the image: the plain form is in `paper::even_windows`. The
//! windows at one place of eight pixels are gathered and weighed together.

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
    let mut found = Vec::new();
    for x in (0..choices.len()).step_by(GROUP) {
        let choices = &mut choices[x..];
        let count = choices.len().min(GROUP);
        let group = Group { even, x, y, count };
        // SAFETY: as the caller's.
        unsafe {
            let Some(noise) = group.candidates::<S>(&mut found) else { continue };
            let near = neighbours.near::<S>(&group);
            group.choose(&found, noise, &near, &mut choices[..count]);
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
    noise: Floats<S>,
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

impl Group<'_> {
    /// Puts the windows that the pixels may take into `found`, and returns the least noise among them; none if no
    /// pixel takes another window.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    unsafe fn candidates<S: Simd>(&self, found: &mut Vec<Candidates<S>>) -> Option<Floats<S>> {
        let &Group { even, x, y, count } = self;
        let &Cloud { width, height, .. } = even.cloud;
        let first = y * width + x;
        let levels = &even.asked.levels[first..first + count];
        let mut lanes = 0;
        for (lane, levels) in levels.iter().enumerate() {
            lanes |= u32::from(*levels > 0) << lane;
        }
        if lanes == 0 {
            return None;
        }
        found.clear();
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
            let mut noise = Floats::splat(f32::INFINITY);
            let mut add = |candidates: Candidates<S>| {
                let less = S::min(candidates.noise.0, noise.0);
                noise.0 = S::select(S::mask(candidates.lanes), less, noise.0);
                found.push(candidates);
            };
            add(self.gather(places, [zero; 2], lanes));
            for level in 0.. {
                let mut active = 0;
                for lane in Bits(lanes) {
                    let there = radii[lane] > 0 && levels[lane] > level;
                    active |= u32::from(there) << lane;
                }
                if active == 0 {
                    break;
                }
                let (mut at_columns, mut to_columns) = ([columns; 3], [[0.0; GROUP]; 3]);
                let (mut at_rows, mut to_rows) = ([[y * width; GROUP]; 3], [[0.0; GROUP]; 3]);
                for lane in 0..GROUP {
                    let (column, radius) = (columns[lane], radii[lane]);
                    let (left, right) = around(column, radius, width);
                    let (up, down) = around(y, radius, height);
                    (at_columns[0][lane], at_columns[2][lane]) = (left, right);
                    (at_rows[0][lane], at_rows[2][lane]) = (up * width, down * width);
                    to_columns[0][lane] = (column - left) as f32;
                    to_columns[2][lane] = -((right - column) as f32);
                    to_rows[0][lane] = (y - up) as f32;
                    to_rows[2][lane] = -((down - y) as f32);
                }
                for (column, row) in PLACES {
                    let mut places = [0; GROUP];
                    for lane in 0..GROUP {
                        places[lane] = at_rows[row][lane] + at_columns[column][lane];
                    }
                    let dx = Floats(S::load(to_columns[column].as_ptr()));
                    let dy = Floats(S::load(to_rows[row].as_ptr()));
                    add(self.gather(places, [dx, dy], active));
                }
                for radius in &mut radii {
                    *radius /= 2;
                }
            }
            Some(noise)
        }
    }

    /// The windows at places from which `to_pixel` leads to the pixels of these `lanes`.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the places are inside the image.
    #[inline(always)]
    unsafe fn gather<S: Simd>(
        &self,
        places: [usize; GROUP],
        to_pixel: [Floats<S>; 2],
        lanes: u32,
    ) -> Candidates<S> {
        const { assert!(size_of::<EvenWindow>() == 8 * size_of::<f32>()) };
        let windows = self.even.windows.as_ptr().cast::<f32>();
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
            Candidates {
                places,
                lanes: lanes & zero.lt(radius) & near,
                to_pixel,
                short: (distance - radius).max(zero),
                inverse_depth: Floats(inverse_depth),
                slope: [Floats(across), Floats(down)],
                unevenness: Floats(unevenness),
                noise: Floats(noise),
                per_noise: Floats(per_noise),
                per_bend: Floats(per_bend),
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
        found: &[Candidates<S>],
        noise: Floats<S>,
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
            let noise = noise.max(Floats::splat(self.even.asked.least_noise));
            let near_noise = Floats::splat(NEAR_NOISE) * noise / near.points;
            let mut least = Floats::splat(f32::INFINITY);
            for candidates in found {
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
                let mut best = cost.lt(least) & candidates.lanes;
                let short = zero.lt(candidates.short);
                if best & short != 0 {
                    let at_pixel = candidates.inverse_depth + across * dx + down * dy;
                    let steepness = (across * across + down * down).sqrt();
                    let limit = tolerance + Floats::splat(JITTER) * steepness;
                    best &= !short | (near.own - at_pixel).abs().lt(limit);
                }
                least.0 = S::select(S::mask(best), cost.0, least.0);
                for lane in Bits(best) {
                    choices[lane] = Some(candidates.places[lane]);
                }
            }
        }
    }
}

/// The columns or rows, of so many, that a window reaches.
#[inline(always)]
fn around(at: usize, radius: usize, count: usize) -> (usize, usize) {
    (at.saturating_sub(radius), (at + radius).min(count - 1))
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
