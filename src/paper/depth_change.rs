//! Step 1: the depth change indication map (the paper's C, Eq. 6-7), as changes between pixels.
//!
//! The paper marks the pixel before a change; kept apart here is whether the change lies to its right or below it,
//! so that a window may end at the marked pixel.
//!
//! The paper is silent on missing points. Here the pixel after a gap is compared with the last finite one before
//! it, `gap` pixels away, with `gap` times the threshold: what a surface may change in so many steps. (A
//! structured light sensor's shadow, as wide as the disparity it hides, is always found so.) Such a change lies at
//! the end of the gap.

use std::iter::repeat_n;
use std::ops::Range;

use super::blocks::{BLOCK, Blocks};
use super::cloud::Cloud;
use super::is_depth_change;
use super::marks::{Marks, WORD, around, bits, columns, mark};
use super::planes::{JITTER, Plane, inverse_depth};
use crate::Error;
use crate::memory::{bytes, refill, table};
use crate::options::Options;
use crate::rect::Rect;
use crate::threads::Workers;

/// More than any window's radius. (Signed: of such numbers every processor takes the lesser eight at a time.)
const LARGEST_CLEAN: i16 = i16::MAX / 2;

/// Sixteen-bit numbers of a row that are looked at together.
const NUMBERS: usize = 8;

/// Where there are depth changes, row by row; kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct DepthChanges {
    /// Between a pixel and its right neighbour.
    right: Marks,
    /// Between a pixel and its lower neighbour.
    below: Marks,
    /// The pixels that have a change among those next to them.
    spoilt: Marks,
    /// In the blocks' middle rows, every pixel's steps along its column to the next one of these, with room beside the rows.
    steps: Vec<i16>,
    clean_radii: Vec<i16>,
}

/// How far from depth changes pixels are.
#[derive(Clone, Copy)]
pub(crate) struct Clean<'a> {
    /// Pixel by pixel, whether there is a change among those next to it.
    pub spoilt: &'a Marks,
    /// Block by block the largest radius around the middle pixel of a window in which no two neighbours are a depth change
    /// apart; `LARGEST_CLEAN` where it is no less than what was asked for.
    pub radii: &'a [i16],
}

impl DepthChanges {
    /// Bytes held.
    pub fn size(&self) -> usize {
        let DepthChanges { right, below, spoilt, steps, clean_radii } = self;
        let marks = [right, below, spoilt].map(Marks::size).into_iter().sum::<usize>();
        marks + bytes(steps) + bytes(clean_radii)
    }

    /// Becomes the changes of a cloud. `between` is [`between`], or does the same.
    pub fn find(
        &mut self,
        cloud: &Cloud,
        options: &Options,
        workers: &Workers,
        between: impl Fn([&[f32]; 2], [&mut [u64]; 2]) + Sync,
    ) -> Result<(), Error> {
        let &Cloud { width, height, ref depths, .. } = cloud;
        // No pixel is known to be spoilt so far: there is room for what is behind gaps.
        let DepthChanges { right, below, spoilt: behind_gaps, .. } = self;
        for marks in [&mut *right, below, behind_gaps] {
            marks.clear((width, height))?;
        }
        let rows = right.rows().zip(below.rows()).zip(behind_gaps.rows()).enumerate();
        workers.each(rows, |(y, ((right, below), behind_gaps))| {
            let (row, next) = (y * width, (y + 1) * width);
            // To the pixels behind them in their row, axis 0, and in their columns.
            let behind = [row + 1..next, next..(next + width).min(depths.len())];
            for (axis, (changes, behind)) in [right, below].into_iter().zip(behind).enumerate() {
                behind_gaps.fill(0);
                let before = &depths[row..][..behind.len()];
                between([before, &depths[behind.clone()]], [changes, behind_gaps]);
                for x in columns(behind_gaps) {
                    let at = behind.start + x;
                    let is_change = cloud.gap(at, axis).is_some_and(|gap| {
                        let before = depths[at - gap * [1, width][axis]];
                        is_depth_change(before, depths[at] - before, gap, options)
                    });
                    mark(changes, x, is_change.into());
                }
            }
        });
        Ok(())
    }

    /// The paper's C.
    pub fn map(&self, (width, height): (usize, usize)) -> Result<Vec<bool>, Error> {
        let pixel = |at: usize| (at % width, at / width);
        let is_change = |at: usize| self.right.has(pixel(at)) || self.below.has(pixel(at));
        table((0..width * height).map(is_change))
    }

    /// Drops the changes that the slope of the surface on both sides explains: on a steep surface neighbours are as far
    /// apart as across an edge.
    pub fn drop_explained(&mut self, cloud: &Cloud, workers: &Workers) {
        /// How far the surface is looked at along and across a change, in pixels.
        const ALONG: usize = 5;
        const ACROSS: usize = 2;
        let &Cloud { width, height, .. } = cloud;
        let inverse = |at: usize| inverse_depth(cloud.depths[at]);
        // `at` is the last pixel before the change.
        let is_explained = |axis: usize, at: usize| {
            let pixel = [at % width, at / width];
            // The pixel is the i-th of its row or column, which is the j-th; `step` leads to the next one.
            let (i, j) = (pixel[axis], pixel[1 - axis]);
            let [step, length, lines] = [[1, width, height], [width, height, width]][axis];
            let next = at + step;
            let Some(gap) = cloud.gap(next, axis) else { return false };
            let last = next - gap * step;
            let jump = (inverse(next) - inverse(last)).abs();
            // Of a pixel at depth 0 no slope is known.
            if jump.is_nan() {
                return false;
            }
            let rect = |along: Range<usize>| {
                let across = j.saturating_sub(ACROSS)..(j + ACROSS + 1).min(lines);
                let (x, y) = if axis == 0 { (along, across) } else { (across, along) };
                Rect { x, y }
            };
            let (before, after) = (i + 2 - gap, i + 1);
            let before = rect(before.saturating_sub(ALONG)..before);
            let after = rect(after..(after + ALONG).min(length));
            let is_steep = |rect: Rect| {
                let change = slope(cloud, &rect, axis)? * gap as f64;
                Some(f64::from(jump) <= f64::from(JITTER) * change.abs())
            };
            let mut sides = [before, after].into_iter().filter_map(is_steep);
            sides.next() == Some(true) && sides.all(|is_steep| is_steep)
        };
        for (axis, changes) in [&mut self.right, &mut self.below].into_iter().enumerate() {
            workers.each(changes.rows().enumerate(), |(y, row)| {
                for (word, first) in row.iter_mut().zip((y * width..).step_by(WORD)) {
                    let explained = bits(*word).filter(|x| is_explained(axis, first + x));
                    *word &= !explained.fold(0, |all, x| all | 1 << x);
                }
            });
        }
    }

    /// How far from the changes the pixels of an image are, where windows have radii up to `limit`.
    pub fn clean(
        &mut self,
        (width, height): (usize, usize),
        limit: u32,
        workers: &Workers,
    ) -> Result<Clean<'_>, Error> {
        let DepthChanges { right, below, spoilt, steps, clean_radii } = self;
        spoilt.clear((width, height))?;
        // Both pixels of a change, and those next to them along it.
        workers.each(spoilt.rows().enumerate(), |(y, spoilt)| {
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for (word, spoilt) in spoilt.iter_mut().enumerate() {
                    let [own, next, _] = around(right.row(y), word);
                    *spoilt |= own | next;
                }
            }
            for y in y.saturating_sub(1)..=y {
                for (word, spoilt) in spoilt.iter_mut().enumerate() {
                    let [own, next, previous] = around(below.row(y), word);
                    *spoilt |= own | next | previous;
                }
            }
        });
        // The chessboard distance to the blocks' middles: along the columns to all pixels in their rows, then along these.
        let blocks = Blocks::of(width, height);
        let middle = |row: usize| blocks.middle_of((0, row)).1;
        let reach = (limit as usize).min(width.max(height)).min(LARGEST_CLEAN as usize);
        let beside = reach.min(width);
        let stride = beside + width + beside + NUMBERS;
        refill(steps, repeat_n(LARGEST_CLEAN, blocks.down * stride))?;
        let spoilt = &*spoilt;
        workers.each(steps.chunks_mut(stride).enumerate(), |(row, steps)| {
            find_steps(spoilt, (width, height), middle(row), &mut steps[beside..]);
        });
        for row in 1..blocks.down {
            let (above, below) = steps.split_at_mut(row * stride);
            step_from(below, &above[(row - 1) * stride..], middle(row) - middle(row - 1));
        }
        for row in (1..blocks.down).rev() {
            let (above, below) = steps.split_at_mut(row * stride);
            let above = &mut above[(row - 1) * stride..];
            step_from(above, below, middle(row) - middle(row - 1));
        }
        refill(clean_radii, repeat_n(0, blocks.count()))?;
        let rows = clean_radii.chunks_mut(blocks.across).zip(steps.chunks(stride)).enumerate();
        workers.each(rows, |(row, (radii, steps))| {
            for (column, radius) in radii.iter_mut().enumerate() {
                let (x, _) = blocks.middle_of((column, row));
                let steps = least_steps_along(&steps[x..], beside);
                *radius = if steps < reach as i16 { steps } else { LARGEST_CLEAN };
            }
        });
        Ok(Clean { spoilt, radii: clean_radii })
    }
}

/// Finds the steps from row `y` to the marks nearby: of as many rows as can be nearer to it than to another middle.
fn find_steps(marks: &Marks, (width, height): (usize, usize), y: usize, steps: &mut [i16]) {
    for (word, first) in (0..width.div_ceil(WORD)).zip((0..).step_by(WORD)) {
        let mut found = 0;
        for away in 0..BLOCK {
            let rows = [y.checked_sub(away), Some(y + away).filter(|y| *y < height)];
            let near = rows.into_iter().flatten().fold(0, |all, y| all | marks.row(y)[word]);
            // Marks may go on behind the last column.
            let new = bits(near & !found).map(|x| first + x).take_while(|x| *x < width);
            new.for_each(|x| steps[x] = away as i16);
            found |= near;
        }
    }
}

/// Takes the steps to a row which is so far away and those from there on, where these are fewer.
fn step_from(row: &mut [i16], next: &[i16], away: usize) {
    for (to, from) in row.iter_mut().zip(next) {
        *to = (*to).min(from + away as i16);
    }
}

/// The chessboard distance of the pixel that is `beside` behind the first, by the steps along the columns of those up to so
/// far around it; more than any window's radius if there is none.
fn least_steps_along(steps: &[i16], beside: usize) -> i16 {
    // What is farther away along the row than along the own column does not matter.
    let reach = beside.min(steps[beside] as usize);
    let mut along = std::array::from_fn::<_, NUMBERS, _>(|i| i as i16 - reach as i16);
    let mut least = [LARGEST_CLEAN; NUMBERS];
    let steps = steps[beside - reach..].chunks_exact(NUMBERS);
    for steps in steps.take((2 * reach + 1).div_ceil(NUMBERS)) {
        for i in 0..NUMBERS {
            least[i] = least[i].min(steps[i].max(along[i].abs()));
            along[i] += NUMBERS as i16;
        }
    }
    least.into_iter().fold(LARGEST_CLEAN, i16::min)
}

/// How much the inverse depth changes from pixel to pixel along the rows, axis 0, or the columns, in the plane that fits a
/// rectangle's points best; none if there are too few to tell, or if they are on one line of the image.
fn slope(cloud: &Cloud, rect: &Rect, axis: usize) -> Option<f64> {
    let [mut n, mut x, mut y, mut xx, mut xy, mut yy] = [0.0; 6];
    let [mut d, mut xd, mut yd] = [0.0; 3];
    for (row, place) in rect.y.clone().zip(0..) {
        let depths = &cloud.depths[row * cloud.width..][rect.x.clone()];
        let [mut row_n, mut row_x, mut row_d] = [0.0; 3];
        for (depth, place) in depths.iter().zip(0..) {
            let inverse = f64::from(inverse_depth(*depth));
            if !inverse.is_nan() {
                let px = f64::from(place);
                (row_n, row_x, row_d) = (row_n + 1.0, row_x + px, row_d + inverse);
                (xx, xd) = (xx + px * px, xd + px * inverse);
            }
        }
        let py = f64::from(place);
        (n, x, d) = (n + row_n, x + row_x, d + row_d);
        (y, xy, yy, yd) = (y + py * row_n, xy + py * row_x, yy + py * py * row_n, yd + py * row_d);
    }
    // About the mean, times n.
    let (xx, xy, yy) = (n * xx - x * x, n * xy - x * y, n * yy - y * y);
    let (xd, yd) = (n * xd - x * d, n * yd - y * d);
    let determinant = xx * yy - xy * xy;
    let slopes = [xd * yy - yd * xy, yd * xx - xd * xy];
    (n >= Plane::FEWEST && determinant > 0.0).then(|| slopes[axis] / determinant)
}

/// Marks the changes between depths and those behind them, and where there is a depth behind a missing one; from the pixels
/// of number `first` on.
#[inline(always)]
pub(crate) fn between(
    [before, behind]: [&[f32]; 2],
    [changes, behind_gaps]: [&mut [u64]; 2],
    options: &Options,
    first: usize,
) {
    for (x, (before, depth)) in before.iter().zip(behind).enumerate().skip(first) {
        mark(changes, x, is_depth_change(*before, depth - before, 1, options).into());
        mark(behind_gaps, x, (before.is_nan() && !depth.is_nan()).into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks a share of the pixels, none if `seed` is 0.
    fn marks(width: usize, height: usize, seed: usize) -> Marks {
        let mut marks = Marks::default();
        marks.clear((width, height)).unwrap();
        for (y, row) in marks.rows().enumerate() {
            let is_marked = |x: &usize| ((y * width + x) * 7919 + seed * 104_729) % 97 < seed % 3;
            (0..width).filter(is_marked).for_each(|x| mark(row, x, 1));
        }
        marks
    }

    #[test]
    fn clean_radii_are_chessboard_distances() {
        let sizes = [(1, 1), (1, 9), (9, 1), (7, 5), (3, 150), (31, 23), (64, 48), (131, 9)];
        for (seed, (width, height)) in sizes.into_iter().cycle().take(40).enumerate() {
            let (right, below) = (marks(width, height, seed), marks(width, height, seed + 2));
            let mut changes = DepthChanges { right, below, ..DepthChanges::default() };
            for limit in [1, 4, 20, 100] {
                let found = changes.clean((width, height), limit, &Workers::default()).unwrap();
                let Clean { spoilt, radii } = found;
                let all = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
                let spoilt: Vec<_> = all().map(|pixel| spoilt.has(pixel)).collect();
                let radii = radii.to_vec();
                let is_spoilt = |x: usize, y: usize| {
                    let mut changes_near = Rect::around((x, y), 1, (width, height)).pixels();
                    changes_near.any(|(cx, cy)| {
                        let DepthChanges { right, below, .. } = &changes;
                        right.has((cx, cy)) && cx <= x || below.has((cx, cy)) && cy <= y
                    })
                };
                for (x, y) in all() {
                    assert_eq!(spoilt[y * width + x], is_spoilt(x, y));
                }
                let blocks = Blocks::of(width, height);
                for (block, radius) in radii.iter().enumerate() {
                    let (x, y) = blocks.middle(block);
                    let spoilt = all().filter(|(x, y)| spoilt[y * width + x]);
                    let steps = spoilt.map(|(ox, oy)| x.abs_diff(ox).max(y.abs_diff(oy))).min();
                    let near = steps.filter(|steps| *steps < limit as usize);
                    assert_eq!(*radius, near.map_or(LARGEST_CLEAN, |steps| steps as i16));
                }
            }
        }
    }
}
