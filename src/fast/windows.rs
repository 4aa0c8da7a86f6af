//! Steps 1 to 3, fast: depth changes (`depth_changes`) and the forward chamfer pass (`distance`) in one sweep down the rows,
//! the backward pass and the sides of the windows (`smoothing_area`) in one sweep up.
//!
//! A depth change farther away than the largest window decides none. So windows are found slice by slice: the sweep down
//! goes on that far below the slice's rows, and the sweep up starts from there. What the sweeps read and write is still
//! in the cache when the slice's normals are made.

use std::ops::Range;

use super::buffer::Buffer;
use super::depth_changes::DepthRows;
use super::distance::{backward, close_ends, forward};
use super::lanes::{LANES, LaneOrder, Lanes};
use super::smoothing_area::{Smoothing, ignore, one_smoothing, sides};
use crate::Error;
use crate::cloud::Points;
use crate::distance::far;
use crate::memory::{bytes, resize};
use crate::options::Options;
use crate::simd::Groups;
use crate::smoothing_area::depth_smoothing;

/// The windows of a slice of the image's rows, and what the sweep down keeps for the next slice.
#[derive(Debug, Default)]
pub(crate) struct Windows {
    sweep: Sweep,
    map: Buffer<Lanes>,
    /// The rows below the slice as they were swept down.
    held: Buffer<Lanes>,
    /// Of the image's rows that were swept.
    swept: Vec<Swept>,
    /// The image's row that the sweep down started with, that of the map's first row, and the next to sweep down.
    start: usize,
    first: usize,
    down: usize,
    /// The row after the slice; none before the first.
    after: Option<usize>,
}

/// What the sweeps found in a row, or in several.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Swept {
    /// The least and the largest finite depth; infinity and -infinity if there is none.
    depths: [f32; 2],
    /// The largest side of a window.
    pub side: f32,
}

impl Swept {
    const NOTHING: Self = Swept { depths: [f32::INFINITY, f32::NEG_INFINITY], side: 0.0 };

    fn and(self, other: Self) -> Self {
        let ([least, largest], [other_least, other_largest]) = (self.depths, other.depths);
        let depths = [least.min(other_least), largest.max(other_largest)];
        Swept { depths, side: self.side.max(other.side) }
    }

    /// That of some rows together.
    fn of(rows: &[Self]) -> Self {
        rows.iter().fold(Self::NOTHING, |all, row| all.and(*row))
    }

    /// The largest magnitude of a finite depth.
    pub fn deepest(&self) -> f32 {
        let [least, largest] = self.depths;
        largest.max(-least).max(0.0)
    }

    /// No finite depth's magnitude is smaller.
    pub fn nearest(&self) -> f32 {
        let [least, largest] = self.depths;
        least.max(-largest).max(0.0)
    }
}

/// How much farther than windows are expected to reach distances are exact. If windows reach farther, as 80 m more of depth
/// make them, the sweep down starts anew.
const EXACT_BEYOND: usize = 8;

/// How far a window, or a depth change that decides one, can be from its pixel, where no depth is above `deepest`.
pub(crate) fn reach(points: &Points, options: &Options, deepest: f32) -> usize {
    let smoothing = depth_smoothing(deepest, options);
    (smoothing as usize).saturating_add(2).min(points.width() + points.height())
}

impl Windows {
    /// Makes room for slices of so many rows, as far as depth adds nothing to what windows reach, before the first one.
    /// Costs least if they reach no farther than `expected`.
    pub fn start(
        &mut self,
        points: &Points,
        options: &Options,
        rows: usize,
        expected: usize,
    ) -> Result<(), Error> {
        let (length, height) = (row_length(points.width()), points.height());
        let reach = reach(points, options, 0.0);
        self.sweep.depths.reserve(points.width())?;
        self.sweep.sides.grow(LaneOrder::new(points.width()).segment)?;
        self.map.grow((rows + 2 * reach).min(height) * length)?;
        self.held.grow(reach.min(height) * length)?;
        resize(&mut self.swept, height, Swept::NOTHING)?;
        self.after = None;
        self.sweep.exact = expected + EXACT_BEYOND;
        Ok(())
    }

    /// Finds the sides of the windows of a slice. Costs least if it follows the one before.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn find<S: Groups>(
        &mut self,
        points: &Points,
        options: &Options,
        slice: Range<usize>,
    ) -> Result<(), Error> {
        let (length, height) = (row_length(points.width()), points.height());
        if self.after == Some(slice.start) {
            let held = (self.down - slice.start) * length;
            self.map[..held].copy_from_slice(&self.held[..held]);
            self.first = slice.start;
        } else {
            self.restart(slice.start.saturating_sub(reach(points, options, 0.0)));
        }
        let mut end = slice.end;
        loop {
            if self.down < end {
                self.map.grow((end - self.first) * length)?;
                let mut rows = WindowRows::new(points.width(), self.first, &mut self.map);
                let (down, swept) = (self.down..end, &mut self.swept);
                // SAFETY: as the caller's.
                unsafe { rows.sweep_down::<S>(points, options, down, &mut self.sweep, swept) };
                self.down = end;
            }
            let reach = reach(points, options, self.swept(slice.clone()).deepest());
            end = (slice.end + reach).min(height);
            let start = slice.start.saturating_sub(reach);
            if start < self.start || reach > self.sweep.exact {
                self.sweep.exact = self.sweep.exact.max(reach + EXACT_BEYOND);
                self.restart(start.min(self.start));
            } else if end <= self.down {
                break;
            }
        }
        let below = (slice.end - self.first) * length..(self.down - self.first) * length;
        self.held.grow(below.len())?;
        self.held[..below.len()].copy_from_slice(&self.map[below]);
        self.after = Some(slice.end);
        let mut rows = WindowRows::new(points.width(), self.first, &mut self.map);
        let (up, swept) = (slice.start..self.down, &mut self.swept);
        // SAFETY: as the caller's.
        unsafe { rows.sweep_up::<S>(points, options, up, slice.end, &mut self.sweep, swept) };
        Ok(())
    }

    /// Starts the sweep down anew with this row.
    fn restart(&mut self, row: usize) {
        (self.start, self.first, self.down) = (row, row, row);
    }

    /// What was found in these rows: depths in the slice's and those that its windows reach, windows in the slice's.
    pub fn swept(&self, rows: Range<usize>) -> Swept {
        Swept::of(&self.swept[rows])
    }

    /// The sides of the slice's windows.
    pub fn sides(&self, width: usize) -> Sides<'_> {
        Sides { rows: floats(&self.map), length: LANES * row_length(width), first: self.first }
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        let Sweep { depths, sides, .. } = &self.sweep;
        let rows = self.map.size() + self.held.size() + bytes(&self.swept);
        depths.size() + sides.size() + rows
    }
}

/// The sides of the windows of a slice's pixels, 0 for none.
#[derive(Clone, Copy)]
pub(crate) struct Sides<'a> {
    pub rows: &'a [f32],
    /// From a row to the next: the width rounded up to a multiple of 16, at least.
    pub length: usize,
    /// The image's row that is the first of these.
    pub first: usize,
}

impl<'a> Sides<'a> {
    /// Those of the image's row `y`, and more that means nothing.
    #[inline(always)]
    pub fn row(&self, y: usize) -> &'a [f32] {
        &self.rows[(y - self.first) * self.length..][..self.length]
    }
}

/// Rows of a map in lane order, each between two elements that hold the neighbouring segments' ends. After the
/// upward sweep the rows hold the sides of windows instead, pixel by pixel.
struct WindowRows<'a> {
    order: LaneOrder,
    /// The image's row that is the first of these.
    first: usize,
    rows: &'a mut [Lanes],
}

/// What the sweeps need beside the map.
#[derive(Debug, Default)]
struct Sweep {
    depths: DepthRows,
    /// A row's, in lane order.
    sides: Buffer<Lanes>,
    /// Distances below this are those of the plain form; others are not below it.
    exact: usize,
}

/// Elements of a row of the map.
fn row_length(width: usize) -> usize {
    LaneOrder::new(width).segment + 2
}

impl<'a> WindowRows<'a> {
    fn new(width: usize, first: usize, rows: &'a mut [Lanes]) -> Self {
        WindowRows { order: LaneOrder::new(width), first, rows }
    }

    /// The image's row `y`.
    #[inline(always)]
    fn row(&mut self, y: usize) -> &mut [Lanes] {
        let length = row_length(self.order.width);
        &mut self.rows[(y - self.first) * length..][..length]
    }

    /// Rows `y` and `y + 1`.
    #[inline(always)]
    fn two_rows(&mut self, y: usize) -> (&mut [Lanes], &mut [Lanes]) {
        let length = row_length(self.order.width);
        self.rows[(y - self.first) * length..][..2 * length].split_at_mut(length)
    }

    /// Depth changes and the forward pass over these of the image's rows, downwards; notes the depths in each. Those
    /// before, if there are some here, have been swept down by the same `sweep`.
    ///
    /// # Safety
    /// As [`Windows::find`].
    #[inline(always)]
    unsafe fn sweep_down<S: Groups>(
        &mut self,
        points: &Points,
        options: &Options,
        rows: Range<usize>,
        sweep: &mut Sweep,
        swept: &mut [Swept],
    ) {
        let order = self.order;
        let mut before = rows.start;
        if rows.start == self.first {
            sweep.depths.start(order.width);
            // This row is only tested against the first.
            before = before.saturating_sub(1);
        }
        let factor = options.max_depth_change_factor;
        // Nothing is farther apart than a NaN tells, nor than infinity.
        let factor = if factor.is_nan() { f32::INFINITY } else { factor };
        let far = far(points.width(), points.height());
        // SAFETY: as the caller's.
        unsafe { sweep.depths.read::<S>(points, before) };
        for y in before..rows.end {
            if y + 1 < points.height() {
                // SAFETY: as the caller's.
                unsafe { sweep.depths.read::<S>(points, y + 1) };
            } else {
                // Of the last row no neighbours are tested; the row above was tested against it.
                sweep.depths.stop();
            }
            let row = &mut self.row(y.max(rows.start))[1..];
            // SAFETY: as the caller's.
            let depths = unsafe { sweep.depths.find_changes::<S::Pair>(points, y, factor, row) };
            swept[y] = Swept { depths, side: 0.0 };
            if y > self.first {
                let (above, row) = self.two_rows(y - 1);
                // SAFETY: as the caller's.
                unsafe { forward::<S::Pair>(order, above, row, sweep.exact as f32) };
            }
            // SAFETY: as the caller's.
            unsafe { close_ends::<S::Pair>(self.row(y.max(rows.start)), far) };
        }
    }

    /// The backward pass over these of the image's rows, upwards; then those before `end` hold the sides of their
    /// windows, the largest of which is noted of each row.
    ///
    /// # Safety
    /// As [`Windows::find`].
    #[inline(always)]
    unsafe fn sweep_up<S: Groups>(
        &mut self,
        points: &Points,
        options: &Options,
        rows: Range<usize>,
        end: usize,
        sweep: &mut Sweep,
        swept: &mut [Swept],
    ) {
        let order = self.order;
        let far = far(points.width(), points.height());
        let slice = Swept::of(&swept[rows.start..end]);
        let smoothing = one_smoothing(slice.depths, options);
        for y in rows.clone().rev() {
            if y > rows.start {
                let (row, below) = self.two_rows(y - 1);
                // SAFETY: as the caller's.
                unsafe {
                    backward::<S::Pair>(order, row, below, far, sweep.exact as f32);
                    close_ends::<S::Pair>(row, far);
                }
            }
            if y < end {
                let row = self.row(y);
                let distances = &row[1..=order.segment];
                // SAFETY: as the caller's.
                unsafe {
                    let smoothing = if let Some(smoothing) = smoothing {
                        Smoothing::Alike(smoothing)
                    } else {
                        sweep.depths.read::<S>(points, y);
                        Smoothing::ByDepth(sweep.depths.row(order, y))
                    };
                    let to = &mut sweep.sides;
                    swept[y].side = sides::<S::Pair>(points, options, y, smoothing, distances, to);
                    order.write::<S::Widest>(&sweep.sides, floats_mut(row));
                }
                ignore(points, options, y, floats_mut(row));
            }
        }
    }
}

fn floats(row: &[Lanes]) -> &[f32] {
    // SAFETY: Lanes are arrays of floats without padding.
    unsafe { std::slice::from_raw_parts(row.as_ptr().cast(), row.len() * LANES) }
}

fn floats_mut(row: &mut [Lanes]) -> &mut [f32] {
    // SAFETY: Lanes are arrays of floats without padding, and any float is valid in them.
    unsafe { std::slice::from_raw_parts_mut(row.as_mut_ptr().cast(), row.len() * LANES) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::depth_change::depth_change_map;
    use crate::distance::distance_map;
    use crate::simd::portable::Portable;
    use crate::smoothing_area::window_side;

    /// Depths with steps and holes, three in so many `pixels`, and with extremes five, the same for the same seed.
    fn depths(
        (width, height): (usize, usize),
        pixels: u32,
        has_extremes: bool,
        seed: u32,
    ) -> Vec<f32> {
        let mut state = seed.wrapping_mul(2_654_435_761) | 1;
        let mut random = move || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state
        };
        (0..width * height)
            .map(|_| match random() % pixels {
                0 => f32::NAN,
                1 => 3.0,
                2 => f32::INFINITY,
                3 if has_extremes => f32::MAX,
                4 if has_extremes => f32::MIN,
                _ => 1.0,
            })
            .collect()
    }

    #[test]
    fn the_sweeps_equal_the_plain_maps() {
        for width in (3..70).chain([640, 1024]) {
            let cases = [
                (3, 1, 97, 0.02),
                (4, 2, 97, 0.02),
                (23, 3, 97, 0.02),
                (50, 4, 97, 0.02),
                (40, 5, 2003, 0.02),
                // With extremes: thresholds that overflow, or are no numbers.
                (23, 7, 97, 0.6),
                (23, 9, 97, f32::INFINITY),
                (23, 11, 97, f32::NAN),
                (23, 13, 97, -1.0),
            ];
            for (height, seed, pixels, factor) in cases {
                let of_width = seed * 1000 + width as u32;
                let z = depths((width, height), pixels, seed > 5, of_width);
                let points = Points::planes([&z, &z, &z], width, height, 0).unwrap();
                let options = Options {
                    // With the fourth, depths decide.
                    normal_smoothing_size: if seed == 4 { 9.8 } else { 9.5 },
                    border_policy: crate::BorderPolicy::Mirror,
                    depth_dependent_smoothing: seed % 2 == 0,
                    max_depth_change_factor: factor,
                    ..Options::default()
                };
                let changes = depth_change_map(&points, options.max_depth_change_factor).unwrap();
                let distances = distance_map(&changes, width, height).unwrap();

                // Slices in their order, and one that another follows.
                let cuts = [0, height / 3, height / 2, height];
                let in_order = cuts.windows(2).map(|cut| cut[0]..cut[1]);
                let in_order = in_order.filter(|slice| !slice.is_empty());
                let slices = in_order.chain([height / 2..height, 0..height / 2]);
                let mut windows = Windows::default();
                let expected = if seed == 3 { 0 } else { 12 };
                windows.start(&points, &options, 1, expected).unwrap();
                for slice in slices {
                    // SAFETY: the portable path runs everywhere.
                    unsafe { windows.find::<Portable>(&points, &options, slice.clone()) }.unwrap();
                    let sides = windows.sides(width);
                    for y in slice {
                        let mut largest = 0;
                        for x in 0..width {
                            let expected =
                                window_side(distances[y * width + x], points.z(x, y), &options);
                            let what = format!("{width}x{height} {x},{y}");
                            assert_eq!(sides.row(y)[x], expected as f32, "{what}");
                            largest = largest.max(expected);
                        }
                        assert!(largest as f32 <= windows.swept(y..y + 1).side);
                    }
                }
            }
        }
    }
}
