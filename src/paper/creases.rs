//! Where the first pass' normals vary strongly: near edges without a depth change.

use super::blocks::{BLOCK, Blocks};
use super::rect::Rect;
use super::summed_area::SummedArea;
use crate::Error;
use crate::threads::Workers;

/// Integral images of normals, one for each block.
#[derive(Debug, Default)]
pub(crate) struct SummedNormals {
    sums: SummedArea<4>,
}

impl SummedNormals {
    /// Sums others; NaN where there is none.
    pub fn sum(
        &mut self,
        estimates: &[[f32; 4]],
        blocks: &Blocks,
        workers: &Workers,
    ) -> Result<(), Error> {
        self.sums.sum_up(blocks.across, blocks.down, workers, |(column, row)| {
            let [x, y, z, _] = estimates[row * blocks.across + column];
            if x.is_nan() { [0.0; 4] } else { [x, y, z, 1.0].map(f64::from) }
        })
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        self.sums.size()
    }

    /// How much the normals of the blocks in a rectangle vary: 1 - |mean|^2, for small angles their variance in square
    /// radians; from 0 to 1, and 1 if there are none.
    fn variation(&self, blocks: &Rect) -> f64 {
        let [x, y, z, count] = self.sums.sum(blocks);
        if count == 0.0 { 1.0 } else { 1.0 - (x * x + y * y + z * z) / (count * count) }
    }

    /// Whether the normals of the blocks that a rectangle of pixels touches vary strongly.
    pub fn vary_in(&self, pixels: &Rect) -> bool {
        let [x, y] =
            [&pixels.x, &pixels.y].map(|range| range.start / BLOCK..range.end.div_ceil(BLOCK));
        self.variation(&Rect { x, y }) > STRONG_VARIATION
    }
}

/// In square radians: normals about 5.4 degrees from their mean.
const STRONG_VARIATION: f64 = 0.009;
