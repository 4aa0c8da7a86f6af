//! Layers of depth, for images whose depths are orders of magnitude apart, as where a far plane stands for "no return":
//! what sums that hold the farthest points are rounded to would be too coarse for the nearest windows.
//!
//! A layer's sums leave out the points of other layers, as missing ones. No window holds a depth change, so the depth
//! change threshold bounds how far the depths of its points are from that of its pixel.

use crate::options::Options;
use crate::smoothing_area::depth_smoothing;

/// Pixels by the magnitudes of their depths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    /// More than the first, and no more than the second: of the pixels themselves.
    own: [f32; 2],
    /// More than the first, and less than the second: of all points of their windows.
    pub held: [f32; 2],
    /// No point that is held is deeper, and no window larger.
    pub deepest: f32,
    pub side: usize,
}

/// How many times as deep as its nearest pixels a layer's farthest ones are, if it is not the nearest one. The depth
/// change threshold grows as depth and 1 do, and so do layers.
const SPAN: f32 = 16.0;

/// Layers of an image at most; the nearest one has all that is left.
const MOST: usize = 8;

impl Layer {
    /// All pixels of an image without deeper points and larger windows.
    fn all(deepest: f32, side: usize) -> Self {
        let every = [-1.0, f32::INFINITY];
        Layer { own: every, held: every, deepest, side }
    }

    pub fn is_all(&self) -> bool {
        self.own[1] == f32::INFINITY
    }

    /// Whether a pixel of this depth is one of the layer's.
    pub fn has(&self, depth: f32) -> bool {
        self.own[0] < depth.abs() && depth.abs() <= self.own[1]
    }
}

/// The layers of an image whose depths' magnitudes are from `nearest` to `deepest`, and how many there are, the farthest
/// first: one alone if the farthest points are no more than `span` times as deep as the nearest. No window is larger
/// than `side`.
pub(crate) fn layers(
    [nearest, deepest]: [f32; 2],
    span: f32,
    side: usize,
    options: &Options,
) -> ([Layer; MOST], usize) {
    let one = ([Layer::all(deepest, side); MOST], 1);
    let (nearest, mut end) = (nearest + 1.0, deepest + 1.0);
    if end <= span * nearest {
        return one;
    }
    // From pixel to pixel, depth and 1 grow by this at most.
    let step = 1.0 / (1.0 - 2.0 * options.max_depth_change_factor).max(0.0);
    let (mut layers, mut count) = (one.0, 0);
    while end > 0.0 {
        let is_last = count + 1 == MOST || end <= SPAN * nearest;
        let start = if is_last { 0.0 } else { end / SPAN };
        let side = side.min(depth_smoothing(end, options) as usize);
        // So many steps lead from a pixel to any point of its window, or next to that; and a little for rounding.
        let growth = 1.01 * step.powi(side as i32 + 4);
        let held = [start / growth - 1.0, growth * end];
        let own = [start - 1.0, if count == 0 { f32::MAX } else { end - 1.0 }];
        layers[count] = Layer { own, held, deepest: deepest.min(held[1]), side };
        count += 1;
        end = start;
    }
    // Where depth changes are that large, the nearest windows may hold the farthest points.
    if layers[count - 1].deepest == deepest {
        return one;
    }
    (layers, count)
}
