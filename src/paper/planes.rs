//! Planes through the points of a rectangle, in constant time.
//!
//! A plane's inverse depth is a linear function of the position in the image, whatever the camera's focal length,
//! and in inverse depth the sensor's smallest depth change is alpha everywhere (Eq. 4).

use std::num::Wrapping;

use super::cloud::Cloud;
use super::rect::Rect;
use super::summed_area::SummedArea;

/// Integral images of the finite points' positions and inverse depths.
pub(crate) struct InverseDepths {
    /// 1, x, y, x^2, x y, y^2. Sums that wrap around are right again once a rectangle's small ones are taken.
    positions: SummedArea<Wrapping<u32>, 6>,
    /// r, x r, y r, r^2 of the inverse depth r.
    depths: SummedArea<f64, 4>,
}

/// The linear function of the position that fits the inverse depths in a rectangle best.
#[derive(Clone, Copy, Default)]
pub(crate) struct Plane {
    center: [f64; 2],
    offset: f64,
    /// Per pixel to the right and down.
    pub slope: [f64; 2],
    pub points: f64,
    /// The mean square deviation.
    pub unevenness: f64,
}

impl InverseDepths {
    pub fn new(cloud: &Cloud) -> Self {
        let (width, height) = (cloud.width, cloud.height);
        let inverse = |at: usize| {
            let r = 1.0 / f64::from(cloud.depths[at]);
            r.is_finite().then_some(r)
        };
        let place = |at: usize| (at % width, at / width);
        let positions = |at: usize| {
            let (x, y) = place(at);
            let (x, y) = (x as u32, y as u32);
            let known = u32::from(inverse(at).is_some());
            [known, x, y, x * x, x * y, y * y].map(|value| Wrapping(value * known))
        };
        let depths = |at: usize| {
            let ((x, y), r) = (place(at), inverse(at).unwrap_or(0.0));
            [r, x as f64 * r, y as f64 * r, r * r]
        };
        InverseDepths {
            positions: SummedArea::new(width, height, positions),
            depths: SummedArea::new(width, height, depths),
        }
    }

    /// The moments of the positions from the rectangle's first pixel: 1, x, y, x^2, x y, y^2.
    fn moments(&self, rect: &Rect) -> [f64; 6] {
        let [n, x, y, xx, xy, yy] = self.positions.sum(rect);
        let (x0, y0) = (Wrapping(rect.x.start as u32), Wrapping(rect.y.start as u32));
        let two = Wrapping(2);
        [
            n,
            x - x0 * n,
            y - y0 * n,
            xx - two * x0 * x + x0 * x0 * n,
            xy - x0 * y - y0 * x + x0 * y0 * n,
            yy - two * y0 * y + y0 * y0 * n,
        ]
        .map(|sum| f64::from(sum.0))
    }

    /// None if there are too few points to tell how well the plane fits, or if they are on one line of the image.
    pub fn plane(&self, rect: &Rect) -> Option<Plane> {
        const FEWEST: f64 = 6.0;
        let [n, x, y, xx, xy, yy] = self.moments(rect);
        if n < FEWEST {
            return None;
        }
        let [r, xr, yr, rr] = self.depths.sum(rect);
        let (xr, yr) = (xr - rect.x.start as f64 * r, yr - rect.y.start as f64 * r);
        let (mx, my, mr) = (x / n, y / n, r / n);
        let (xx, xy, yy) = (xx - x * mx, xy - x * my, yy - y * my);
        let (xr, yr, rr) = (xr - x * mr, yr - y * mr, rr - r * mr);
        let determinant = xx * yy - xy * xy;
        // The sums are whole numbers: on a line the determinant is 0 but for the rounding of the means.
        if determinant <= 1e-6 * xx * yy {
            return None;
        }
        let slope = [(xr * yy - yr * xy) / determinant, (yr * xx - xr * xy) / determinant];
        Some(Plane {
            center: [rect.x.start as f64 + mx, rect.y.start as f64 + my],
            offset: mr,
            slope,
            points: n,
            unevenness: (rr - slope[0] * xr - slope[1] * yr).max(0.0) / (n - 3.0),
        })
    }
}

impl Plane {
    /// The inverse depth at a position.
    pub fn at(&self, [x, y]: [f64; 2]) -> f64 {
        self.offset + self.slope[0] * (x - self.center[0]) + self.slope[1] * (y - self.center[1])
    }

    /// The variance of a noise whose samples of as many points have, `deviations` standard deviations below their
    /// mean, this plane's.
    pub fn noise(&self, deviations: f64) -> f64 {
        self.unevenness * (1.0 + deviations * (2.0 / (self.points - 3.0)).sqrt())
    }

    /// How much the inverse depth changes from pixel to pixel along the steepest direction.
    pub fn steepness(&self) -> f64 {
        let [x, y] = self.slope;
        (x * x + y * y).sqrt()
    }
}
