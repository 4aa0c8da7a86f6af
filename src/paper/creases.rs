//! Where the first pass' normals vary strongly: near edges without a depth change.

use super::rect::Rect;
use super::summed_area::SummedArea;

/// Integral images of the first pass' normals.
#[derive(Debug, Default)]
pub(crate) struct SummedNormals {
    sums: SummedArea<4>,
}

impl SummedNormals {
    /// Sums other normals.
    pub fn sum(&mut self, estimates: &[[f32; 4]], width: usize, height: usize) {
        self.sums.sum_up(width, height, |at: usize| {
            let [x, y, z, _] = estimates[at].map(f64::from);
            if x.is_nan() { [0.0; 4] } else { [x, y, z, 1.0] }
        });
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        self.sums.size()
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
