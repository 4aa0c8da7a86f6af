//! Step 1: the depth change indication map (the paper's C, Eq. 6-7), as changes between pixels.
//!
//! The paper marks the pixel before a change; kept apart here is whether the change lies to its right or below it,
//! so that a window may end at the marked pixel.
//!
//! The paper is silent on missing points. Here the pixel after a gap is compared with the last finite one before
//! it, `gap` pixels away, with `gap` times the threshold: what a surface may change in so many steps. (A
//! structured light sensor's shadow, as wide as the disparity it hides, is always found so.) Such a change lies at
//! the end of the gap.

use super::cloud::Cloud;
use super::rect::Rect;
use super::summed_area::SummedArea;

/// Where there are depth changes, row by row.
pub(crate) struct DepthChanges {
    width: usize,
    height: usize,
    /// Between a pixel and its right neighbour.
    right: Vec<bool>,
    /// Between a pixel and its lower neighbour.
    below: Vec<bool>,
}

impl DepthChanges {
    /// The changes of a cloud: `is_change(depth, difference, gap)` says whether a difference in depth to the
    /// neighbour `gap` pixels to the right or below is one.
    pub fn find(cloud: &Cloud, is_change: impl Fn(f32, f32, usize) -> bool) -> Self {
        let (width, height) = (cloud.width, cloud.height);
        let mut right = vec![false; width * height];
        let mut below = vec![false; width * height];
        // Along a row or column: the last finite depth, and where it was.
        let scan = |map: &mut [bool], first: usize, step: usize, count: usize| {
            let mut last: Option<(usize, f32)> = None;
            for i in 0..count {
                let depth = cloud.depths[first + i * step];
                if depth.is_nan() {
                    continue;
                }
                if let Some((from, before)) = last
                    && is_change(before, depth - before, i - from)
                {
                    map[first + (i - 1) * step] = true;
                }
                last = Some((i, depth));
            }
        };
        for y in 0..height {
            scan(&mut right, y * width, 1, width);
        }
        for x in 0..width {
            scan(&mut below, x, width, height);
        }
        DepthChanges { width, height, right, below }
    }

    /// The paper's C.
    pub fn map(&self) -> Vec<bool> {
        self.right.iter().zip(&self.below).map(|(right, below)| *right || *below).collect()
    }

    /// The same, ready to be asked about rectangles.
    pub fn summed(&self) -> SummedChanges {
        let sum =
            |map: &[bool]| SummedArea::new(self.width, self.height, |at| [u32::from(map[at])]);
        SummedChanges { right: sum(&self.right), below: sum(&self.below) }
    }
}

/// Answers in constant time whether there is a depth change inside a rectangle.
pub(crate) struct SummedChanges {
    right: SummedArea<u32, 1>,
    below: SummedArea<u32, 1>,
}

impl SummedChanges {
    /// Whether no two neighbours in the rectangle are a depth change apart.
    pub fn none_in(&self, rect: &Rect) -> bool {
        let Rect { x, y } = rect.clone();
        let pairs_right = Rect { x: x.start..x.end.saturating_sub(1).max(x.start), y: y.clone() };
        let pairs_below = Rect { x, y: y.start..y.end.saturating_sub(1).max(y.start) };
        self.right.sum(&pairs_right) == [0] && self.below.sum(&pairs_below) == [0]
    }
}
