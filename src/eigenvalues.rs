//! The eigenvalues of the covariance matrices (Eq. 16) of all pixels' windows, from integral images (Eq. 1-3) of bands
//! of rows.

use std::ops::Range;

use crate::Error;
use crate::cloud::Points;
use crate::eigen::{Scatter, Symmetric3, eigen};
use crate::methods::finite_point;
use crate::paper::{ROUNDING, SummedArea};
use crate::rect::Rect;
use crate::threads::Workers;
use crate::vector::{difference, sum};

/// Rows of a band at least: those that its windows reach around it are summed with it.
const BAND_ROWS: usize = 64;

/// Rounding errors of sums that change a value by more than this many times itself, or more than this share of the
/// values' sum, show.
const RELATIVE: f64 = 1e-7;
const OF_TRACE: f64 = 1e-11;

/// The eigenvalues of the finite points in every pixel's window, ascending, row by row. `window` gives the rectangles
/// that make it up, which reach so many rows from the pixel at most; NaN for a pixel without window, or without a
/// finite point in it.
pub(crate) fn eigenvalue_map<W: Iterator<Item = Rect> + Clone>(
    points: &Points,
    reach: usize,
    window: impl Fn(usize, usize) -> Option<W>,
) -> Result<Vec<[f32; 3]>, Error> {
    let (width, height) = (points.width(), points.height());
    let mut map = Vec::new();
    map.try_reserve(width * height)?;
    let mut band = Band::default();
    for first in (0..height).step_by(BAND_ROWS.max(reach)) {
        let own = first..(first + BAND_ROWS.max(reach)).min(height);
        band.sum(points, first.saturating_sub(reach)..(own.end + reach).min(height))?;
        for y in own {
            map.extend((0..width).map(|x| {
                let values = window(x, y).and_then(|window| band.eigenvalues(points, window));
                values.map_or([f32::NAN; 3], |values| values.map(|value| value as f32))
            }));
        }
    }
    Ok(map)
}

/// Sums over some rows.
#[derive(Default)]
struct Band {
    top: usize,
    /// Number of finite points; x, y, z; xx, xy, xz, yy, yz, zz.
    sums: SummedArea<10>,
    /// What the rounding errors of sums stay below.
    error: f64,
}

impl Band {
    fn sum(&mut self, points: &Points, rows: Range<usize>) -> Result<(), Error> {
        let width = points.width();
        let whole = Rect { x: 0..width, y: rows.clone() };
        // Sums about a point of the band lose less.
        let origin =
            whole.pixels().find_map(|pixel| finite_point(points, pixel)).unwrap_or_default();
        self.top = rows.start;
        self.sums.sum_up(width, rows.len(), &Workers::default(), |(x, y)| {
            finite_point(points, (x, y + rows.start)).map_or([0.0; 10], |point| {
                let [x, y, z] = difference(point, origin);
                [1.0, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z]
            })
        })?;
        let [.., xx, _, _, yy, _, zz] = self.sums.sum(&Rect { x: 0..width, y: 0..rows.len() });
        self.error = ROUNDING * (xx + yy + zz);
        Ok(())
    }

    /// The eigenvalues of the points in a window.
    fn eigenvalues(
        &self,
        points: &Points,
        window: impl Iterator<Item = Rect> + Clone,
    ) -> Option<[f64; 3]> {
        let mut sums = [0.0; 10];
        for Rect { x, y } in window.clone() {
            let rect = Rect { x, y: y.start - self.top..y.end - self.top };
            sums = sum(sums, self.sums.sum(&rect));
        }
        let [count, x, y, z, xx, xy, xz, yy, yz, zz] = sums;
        if count == 0.0 {
            return None;
        }
        let matrix = Symmetric3 {
            xx: xx - x * x / count,
            xy: xy - x * y / count,
            xz: xz - x * z / count,
            yy: yy - y * y / count,
            yz: yz - y * z / count,
            zz: zz - z * z / count,
        };
        let (values, _) = eigen(&matrix);
        if self.error <= RELATIVE * values[0] + OF_TRACE * matrix.trace() {
            return Some(values.map(|value| value / count));
        }
        let pixels = || window.clone().flat_map(|rect| rect.pixels());
        let finite = || pixels().filter_map(|pixel| finite_point(points, pixel));
        Some(Scatter::of(finite)?.eigenvalues())
    }
}
