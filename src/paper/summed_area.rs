//! Integral images (Eq. 1-3) of `N` channels.

use crate::Error;
use crate::memory::{bytes, resize};
use crate::rect::Rect;
use crate::threads::Workers;
use crate::vector::sum;

/// What rounding on the path to a sum may gather, in units of the largest sum on it.
pub(crate) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Sums over every rectangle from the image's first pixel, with a row and a column of zeros before it.
#[derive(Debug, Default)]
pub(crate) struct SummedArea<const N: usize> {
    stride: usize,
    sums: Vec<[f64; N]>,
}

impl<const N: usize> SummedArea<N> {
    /// Becomes the integral image of what `value` gives for every column and row.
    pub fn sum_up(
        &mut self,
        width: usize,
        height: usize,
        workers: &Workers,
        value: impl Fn((usize, usize)) -> [f64; N] + Sync,
    ) -> Result<(), Error> {
        let stride = width + 1;
        self.stride = stride;
        resize(&mut self.sums, stride * (height + 1), [0.0; N])?;
        self.sums[..stride].fill([0.0; N]);
        workers.each(self.sums[stride..].chunks_mut(stride).enumerate(), |(y, row)| {
            let mut along = [0.0; N];
            row[0] = along;
            for (x, to) in row[1..].iter_mut().enumerate() {
                along = sum(along, value((x, y)));
                *to = along;
            }
        });
        for y in 1..=height {
            let (above, row) = self.sums[(y - 1) * stride..].split_at_mut(stride);
            for (to, above) in row.iter_mut().zip(above) {
                *to = sum(*to, *above);
            }
        }
        Ok(())
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        bytes(&self.sums)
    }

    /// The sums over the rectangles that end before row `y`, by the column that they end before.
    #[inline(always)]
    pub fn row(&self, y: usize) -> &[[f64; N]] {
        &self.sums[y * self.stride..][..self.stride]
    }

    /// The sum over a rectangle (Eq. 3, not divided).
    #[inline(always)]
    pub fn sum(&self, rect: &Rect) -> [f64; N] {
        let at = |x, y| &self.sums[y * self.stride + x];
        let (a, b) = (at(rect.x.start, rect.y.start), at(rect.x.end, rect.y.start));
        let (c, d) = (at(rect.x.start, rect.y.end), at(rect.x.end, rect.y.end));
        std::array::from_fn(|i| (d[i] - b[i]) - (c[i] - a[i]))
    }
}
