//! The second pass: windows are moved off the places where the normals of the first pass vary strongly.

use super::candidates::{Candidates, Choice};
use super::planes::Plane;
use super::rect::Rect;
use super::summed_area::SummedArea;
use crate::methods::Estimate;

/// Integral images of the first pass' normals.
pub(crate) struct SummedNormals {
    sums: SummedArea<f64, 4>,
}

impl SummedNormals {
    pub fn new(estimates: &[Estimate], width: usize, height: usize) -> Self {
        let value = |at: usize| {
            let [x, y, z] = estimates[at].normal.map(f64::from);
            if x.is_nan() { [0.0; 4] } else { [x, y, z, 1.0] }
        };
        SummedNormals { sums: SummedArea::new(width, height, value) }
    }

    /// How much the normals in a rectangle vary: 1 - |mean|^2, for small angles their variance in square radians;
    /// from 0 to 1, and 1 if there are none.
    fn variation(&self, rect: &Rect) -> f64 {
        let [x, y, z, count] = self.sums.sum(rect);
        if count == 0.0 { 1.0 } else { 1.0 - (x * x + y * y + z * z) / (count * count) }
    }

    /// Whether the normals in a rectangle vary strongly.
    pub fn vary_in(&self, rect: &Rect) -> bool {
        self.variation(rect) > STRONG_VARIATION
    }
}

/// In square radians: normals about 6 degrees from their mean.
const STRONG_VARIATION: f64 = 0.01;

/// The best window for a pixel that wants one of a side, near a crease. There are twice as large ones among the
/// candidates: whether the pixel is on one side of a crease or on the other is told from less noise, and a window
/// that lies on one plane need not be small.
pub(crate) fn window(
    candidates: &Candidates,
    pixel: (usize, usize),
    wanted_side: usize,
    largest_side: usize,
    found: &mut Vec<(Rect, Plane)>,
) -> Option<Choice> {
    let large = (2 * wanted_side + 1).min(largest_side).max(wanted_side);
    candidates.best(pixel, [large, wanted_side].into_iter(), found)
}
