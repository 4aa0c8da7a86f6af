//! Planes through the points of a rectangle.
//!
//! A plane's inverse depth is a linear function of the position in the image, whatever the camera's focal length,
//! and in inverse depth the sensor's smallest depth change is alpha everywhere (Eq. 4).

use super::cloud::Cloud;
use super::rect::Rect;
use crate::eigen::{Scatter, Symmetric3};

/// The sensor's noise along rows and columns, in pixels: it moves points off steep planes by that many times the slope.
pub(crate) const JITTER: f32 = 4.0;

/// The linear function of the position that fits the inverse depths in a rectangle best.
#[derive(Clone, Copy)]
pub(crate) struct Plane {
    center: [f64; 2],
    offset: f64,
    /// Per pixel to the right and down.
    pub slope: [f64; 2],
    pub points: f64,
    /// The mean square deviation.
    pub unevenness: f64,
}

impl Plane {
    /// The fewest points that tell how well a plane fits.
    pub(crate) const FEWEST: f64 = 6.0;
    /// Points are on one line of the image if the determinant of their positions' scatter is at most this share of
    /// the product of its diagonal: rounding.
    pub(crate) const LINE: f64 = 1e-6;

    /// None if there are too few finite points to tell how well the plane fits, or if they are on one line of the
    /// image.
    pub fn of(cloud: &Cloud, rect: &Rect) -> Option<Plane> {
        let place = |(x, y): (usize, usize)| {
            [x as f64, y as f64, f64::from(inverse_depth(cloud.depths[cloud.index(x, y)]))]
        };
        let points = || rect.pixels().map(place).filter(|point| !point[2].is_nan());
        let Scatter { matrix, mean, count: n } = Scatter::of(points)?;
        if n < Self::FEWEST {
            return None;
        }
        let Symmetric3 { xx, xy, xz: xr, yy, yz: yr, zz: rr } = matrix;
        let determinant = xx * yy - xy * xy;
        if determinant <= Self::LINE * xx * yy {
            return None;
        }
        let slope = [(xr * yy - yr * xy) / determinant, (yr * xx - xr * xy) / determinant];
        let unevenness = (rr - slope[0] * xr - slope[1] * yr).max(0.0) / (n - 3.0);
        Some(Plane { center: [mean[0], mean[1]], offset: mean[2], slope, points: n, unevenness })
    }

    /// The inverse depth at a position.
    pub fn at(&self, [x, y]: [f64; 2]) -> f64 {
        self.offset + self.slope[0] * (x - self.center[0]) + self.slope[1] * (y - self.center[1])
    }

    /// How much the inverse depth changes from pixel to pixel along the steepest direction, squared.
    pub fn steepness_squared(&self) -> f64 {
        let [x, y] = self.slope;
        x * x + y * y
    }
}

/// NaN at a missing point, and at depth 0.
pub(crate) fn inverse_depth(depth: f32) -> f32 {
    let inverse = 1.0 / depth;
    if inverse.is_finite() { inverse } else { f32::NAN }
}
