//! Planes through the points of a rectangle.
//!
//! The plane q P = 1 has, where a ray is a point over its depth, the inverse depth q ray: a linear function of the ray,
//! whatever the camera is. In inverse depth the sensor's smallest depth change is alpha everywhere (Eq. 4), so that is what
//! deviations are measured in. The sum of (1 - q P)^2, which the plane makes least, weighs them by the depths' squares,
//! which are much the same in a window; and it is made from the moments that CM sums up (Eq. 16-25).

use super::cloud::Cloud;
use crate::eigen::{Scatter, Symmetric3, eigen};
use crate::methods::Estimate;
use crate::rect::Rect;
use crate::vector::dot;

/// The sensor's noise along rows and columns, in pixels: it moves points off steep planes by that many times the slope.
pub(crate) const JITTER: f32 = 4.0;

/// The plane that fits the points in a rectangle best.
#[derive(Clone, Copy)]
pub(crate) struct Plane {
    pub q: [f64; 3],
    /// The ray of the points' mean, and its inverse depth.
    pub ray: [f64; 3],
    pub inverse_depth: f64,
    pub points: f64,
    /// The mean square deviation of inverse depths; infinite where the points are not on one surface.
    pub unevenness: f64,
    /// How much the inverse depth changes from pixel to pixel along the steepest direction, squared; 0 there.
    pub steepness_squared: f64,
    pub covariance: Symmetric3,
}

impl Plane {
    /// The fewest points that tell how well a plane fits.
    pub(crate) const FEWEST: f64 = 6.0;
    /// Seen from the camera, points are on one line if the determinant of their covariance matrix is at most this share of
    /// the square of half its trace: rounding.
    pub(crate) const LINE: f64 = 1e-6;
    /// The largest variance along the line of sight, as a share of the mean's square, with which depths are much the same:
    /// else points are not on one surface.
    pub(crate) const DEEP: f64 = 0.25;
    /// The mean of a window's middle is off its plane by chance: so many variances of it are not the surface's bend.
    pub(crate) const BEND_NOISE: f64 = 4.0;
    /// The most that the smallest of three eigenvalues can be of their sum.
    pub(crate) const MOST_CURVATURE: f64 = 1.0 / 3.0;

    /// None if there are too few finite points to tell how well the plane fits, or if they are on one line of the image.
    pub fn of(cloud: &Cloud, rect: &Rect) -> Option<Plane> {
        let scatter = Scatter::of(|| cloud.finite(rect.clone()))?;
        let (m, n) = (scatter.mean, scatter.count);
        if n < Self::FEWEST {
            return None;
        }
        let covariance = scatter.covariance();
        let adjugate = covariance.adjugate();
        let [across, along] = [&adjugate, &covariance].map(|matrix| matrix.times(m));
        let (spread, length2, along) = (dot(m, across), dot(m, m), dot(m, along));
        // Times the square of the length.
        let half_trace = (covariance.trace() * length2 - along) / 2.0;
        let is_deep = Self::DEEP * length2 * length2 < along;
        if !is_deep && spread * length2 <= Self::LINE * half_trace * half_trace {
            return None;
        }
        let Symmetric3 { xx, xy, xz, .. } = covariance;
        let determinant = xx * adjugate.xx + xy * adjugate.xy + xz * adjugate.xz;
        let determinant = determinant.max(0.0);
        // C q = m (1 - q m), which makes the sum least, is solved by:
        let q = across.map(|value| value / (spread + determinant));
        let deviation2 = determinant / (spread + determinant) * n / (n - 3.0);
        // Of the inverse depth, by the rays across them.
        let (depth, slope2) = if cloud.has_range {
            (length2.sqrt(), dot(q, q) - dot(q, m).powi(2) / length2)
        } else {
            (m[2], q[0] * q[0] + q[1] * q[1])
        };
        let depth2 = depth * depth;
        // Between the rays of neighbours, from how far those of n pixels spread.
        let angle2 = 12.0 / (n - 1.0) * (spread / (depth2 * depth2 * depth2)).sqrt();
        Some(Plane {
            q,
            ray: m.map(|mean| mean / depth),
            inverse_depth: 1.0 / depth,
            points: n,
            unevenness: if is_deep { f64::INFINITY } else { deviation2 / depth2 },
            steepness_squared: if is_deep { 0.0 } else { slope2 * angle2 },
            covariance,
        })
    }

    /// Its normal, not turned, and as curvature what the points vary across it, as a share of how they vary; that is not below
    /// the smallest eigenvalue's, and no more than the most that this can be.
    pub fn estimate(&self) -> Estimate {
        let share = 1.0 / dot(self.q, self.q).sqrt();
        let normal = self.q.map(|q| q * share);
        let across = dot(normal, self.covariance.times(normal));
        let curvature = (across / self.covariance.trace()).clamp(0.0, Self::MOST_CURVATURE) as f32;
        Estimate { normal: normal.map(|c| c as f32), curvature }
    }

    /// How much the slope of the surface changes from pixel to pixel, squared, as far as it is not chance: told from how far
    /// the mean of the window's middle is off this plane. The square of the window's side is by `sides2` more than that of
    /// its middle; `area` pixels have the same noise.
    pub fn bend2(&self, middle: &Plane, sides2: f64, least_noise: f64, area: f64) -> f64 {
        let off = dot(self.q, middle.ray) - middle.inverse_depth;
        let share = area * (1.0 / middle.points - 1.0 / self.points);
        let noise = self.unevenness.max(least_noise) * share;
        let off2 = (off * off - Self::BEND_NOISE * noise.max(0.0)).max(0.0);
        // The mean of a parabola over a side is above its top by a 24th of the bend times the side's square.
        let bend = 24.0 / sides2;
        off2 * bend * bend
    }
}

/// As [`Plane::estimate`], but of the plane to which points of this covariance matrix are nearest in space: where they are
/// astray along the rows and columns, not along their rays alone, that is nearer to the truth.
pub(crate) fn estimate_in_space(covariance: &Symmetric3) -> Estimate {
    let (values, normal) = eigen(covariance);
    let curvature = (values[0] / covariance.trace()) as f32;
    Estimate { normal: normal.map(|c| c as f32), curvature }
}

/// NaN at a missing point, and at depth 0.
pub(crate) fn inverse_depth(depth: f32) -> f32 {
    let inverse = 1.0 / depth;
    if inverse.is_finite() { inverse } else { f32::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Points;
    use crate::options::{Options, Semantics};

    #[test]
    fn bends_are_told_from_noise() {
        let (width, height, middle) = (41, 31, (20, 15));
        let options = Options { semantics: Semantics::Paper, ..Options::default() };
        for (bend, noise, told) in [
            (0.0, 1e-3, 0.0),
            (2e-4, 0.0, 2e-4),
            (-2e-4, 0.0, 2e-4),
            (2e-4, 1e-4, 2e-4),
            (2e-5, 1e-2, 0.0),
        ] {
            let point = |at: usize| {
                let [x, y] = [(at % width) as f32 - 20.0, (at / width) as f32 - 15.0];
                let noise = if at.is_multiple_of(2) { noise } else { -noise };
                let z = 1.0 / (0.5 + 0.002 * x - 0.001 * y + bend / 2.0 * x * x + noise);
                [x / 500.0 * z, y / 500.0 * z, z]
            };
            let points: Vec<_> = (0..width * height).flat_map(point).collect();
            let points = Points::interleaved(&points, width, height, 3, 0).unwrap();
            let cloud = Cloud::new(&points, &options).unwrap();
            let plane = |radius: usize| {
                Plane::of(&cloud, &Rect::around(middle, radius, (width, height))).unwrap()
            };
            let found = plane(10).bend2(&plane(5), 441.0 - 121.0, 1e-12, 1.0).sqrt();
            assert!((found - told).abs() <= 0.1 * told, "bend {bend}, noise {noise}: {found}");
        }
    }
}
