//! The second pass: windows are moved off the places where the normals of the first pass vary strongly.
//!
//! There the pixel takes the window, with the pixel in the middle of its side or in its corner, whose points lie
//! best in one plane. A plane's inverse depth is a linear function of the position in the image, whatever the
//! camera's focal length, and in inverse depth the sensor's smallest depth change is alpha everywhere (Eq. 4).

use super::cloud::Cloud;
use super::depth_change::SummedChanges;
use super::one_sided::{smaller, windows};
use super::rect::Rect;
use super::summed_area::SummedArea;
use crate::methods::Estimate;

/// Sums of the first pass' normals.
pub(crate) struct SummedNormals {
    sums: SummedArea<f64, 4>,
}

impl SummedNormals {
    pub fn new(estimates: &[Estimate], width: usize, height: usize) -> Self {
        let value = |at: usize| {
            let normal = estimates[at].normal.map(f64::from);
            let [x, y, z] = normal;
            if x.is_nan() { [0.0; 4] } else { [x, y, z, 1.0] }
        };
        SummedNormals { sums: SummedArea::new(width, height, value) }
    }

    /// How much the normals in a rectangle vary: 1 - |mean|^2, for small angles their variance in square radians;
    /// from 0 to 1, and 1 if there are none.
    pub fn variation(&self, rect: &Rect) -> f64 {
        let [x, y, z, count] = self.sums.sum(rect);
        if count == 0.0 { 1.0 } else { 1.0 - (x * x + y * y + z * z) / (count * count) }
    }
}

pub(crate) fn env(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

/// The mean square deviation of the inverse depths in a rectangle from a linear function of the position;
/// infinite if there are too few to tell.
fn unevenness(cloud: &Cloud, rect: &Rect) -> f64 {
    let (cx, cy) =
        ((rect.x.start + rect.x.end) as f64 / 2.0, (rect.y.start + rect.y.end) as f64 / 2.0);
    let mut s = [0.0f64; 10];
    for (x, y) in rect.pixels() {
        let depth = cloud.depths[cloud.index(x, y)];
        let r = 1.0 / f64::from(depth);
        if !r.is_finite() {
            continue;
        }
        let (x, y) = (x as f64 - cx, y as f64 - cy);
        for (s, v) in s.iter_mut().zip([1.0, x, y, x * x, x * y, y * y, r, x * r, y * r, r * r]) {
            *s += v;
        }
    }
    let n = s[0];
    if n < 6.0 {
        return f64::INFINITY;
    }
    let (mx, my, mr) = (s[1] / n, s[2] / n, s[6] / n);
    let (xx, xy, yy) = (s[3] - n * mx * mx, s[4] - n * mx * my, s[5] - n * my * my);
    let (xr, yr, rr) = (s[7] - n * mx * mr, s[8] - n * my * mr, s[9] - n * mr * mr);
    let det = xx * yy - xy * xy;
    if det <= 1e-9 * xx * yy {
        return f64::INFINITY;
    }
    let (a, b) = ((xr * yy - yr * xy) / det, (yr * xx - xr * xy) / det);
    (rr - a * xr - b * yr).max(0.0) / (n - 3.0)
}

/// The window to use instead of `rect`; none if that is to be kept.
pub(crate) fn window(
    cloud: &Cloud,
    normals: &SummedNormals,
    changes: &SummedChanges,
    pixel: (usize, usize),
    rect: &Rect,
    alpha: f64,
) -> Option<Rect> {
    if normals.variation(rect) <= env("STRONG", 0.01) {
        return None;
    }
    let own = unevenness(cloud, rect);
    let floor = (env("KAPPA", 0.05) * alpha).powi(2);
    if own <= floor {
        return None;
    }
    let mut best = (own * env("WORTH", 0.8), None);
    let mut side = Some(rect.x.len().max(rect.y.len()));
    for _ in 0..env("SIZES", 2.0) as usize {
        let Some(tried) = side else { break };
        for rect in windows(pixel, tried, cloud.width, cloud.height) {
            if !changes.none_in(&rect) {
                continue;
            }
            let found = unevenness(cloud, &rect);
            if found < best.0 {
                best = (found, Some(rect));
            }
        }
        best.0 *= env("SHRINK", 0.6);
        side = smaller(tried);
    }
    best.1
}
