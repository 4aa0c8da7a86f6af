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

/// Normals that vary more than this in a window, in square radians, ask for a second look.
const STRONG_VARIATION: f64 = 0.01;
/// How far around a pixel its own surface must lie on the plane of its window, in pixels.
const NEAR: usize = 1;
/// What the squared deviation of the points next to the pixel counts in a window's score.
const NEAR_WEIGHT: f64 = 9.0;
/// A window whose score is below (this alpha)^2 is a plane already.
const EVEN: f64 = 0.05;
/// What another window's score must be below, as a share of the own window's.
const WORTH: f64 = 0.8;
/// What a smaller window's score must be below, as a share of the larger one's.
const SHRINK: f64 = 0.6;
/// How many sizes are tried.
const SIZES: usize = 2;

/// The linear function of the position that fits the inverse depths in a rectangle best.
struct Fit {
    center: [f64; 2],
    slope: [f64; 2],
    offset: f64,
    /// The mean square deviation.
    unevenness: f64,
}

impl Fit {
    fn of(cloud: &Cloud, rect: &Rect) -> Option<Fit> {
        let center =
            [(rect.x.start + rect.x.end) as f64 / 2.0, (rect.y.start + rect.y.end) as f64 / 2.0];
        let mut s = [0.0f64; 10];
        for (x, y) in rect.pixels() {
            let r = 1.0 / f64::from(cloud.depths[cloud.index(x, y)]);
            if !r.is_finite() {
                continue;
            }
            let (x, y) = (x as f64 - center[0], y as f64 - center[1]);
            for (s, v) in s.iter_mut().zip([1.0, x, y, x * x, x * y, y * y, r, x * r, y * r, r * r])
            {
                *s += v;
            }
        }
        let n = s[0];
        if n < 6.0 {
            return None;
        }
        let (mx, my, mr) = (s[1] / n, s[2] / n, s[6] / n);
        let (xx, xy, yy) = (s[3] - n * mx * mx, s[4] - n * mx * my, s[5] - n * my * my);
        let (xr, yr, rr) = (s[7] - n * mx * mr, s[8] - n * my * mr, s[9] - n * mr * mr);
        let det = xx * yy - xy * xy;
        if det <= 1e-9 * xx * yy {
            return None;
        }
        let (a, b) = ((xr * yy - yr * xy) / det, (yr * xx - xr * xy) / det);
        Some(Fit {
            center,
            slope: [a, b],
            offset: mr - a * mx - b * my,
            unevenness: (rr - a * xr - b * yr).max(0.0) / (n - 3.0),
        })
    }

    fn mean_deviation(&self, cloud: &Cloud, rect: &Rect) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for (x, y) in rect.pixels() {
            let r = 1.0 / f64::from(cloud.depths[cloud.index(x, y)]);
            if r.is_finite() {
                sum += r
                    - self.offset
                    - self.slope[0] * (x as f64 - self.center[0])
                    - self.slope[1] * (y as f64 - self.center[1]);
                n += 1.0;
            }
        }
        if n == 0.0 { 0.0 } else { sum / n }
    }
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
    if normals.variation(rect) <= STRONG_VARIATION {
        return None;
    }
    let size = (cloud.width, cloud.height);
    let near = Rect::around(pixel, NEAR, size);
    let near = if changes.none_in(&near) { near } else { Rect::around(pixel, 0, size) };
    let score = |rect: &Rect| {
        let fit = Fit::of(cloud, rect);
        fit.map_or(f64::INFINITY, |fit| {
            fit.unevenness + NEAR_WEIGHT * fit.mean_deviation(cloud, &near).powi(2)
        })
    };
    let own = score(rect);
    if own <= (EVEN * alpha).powi(2) {
        return None;
    }
    let mut best = (own * WORTH, None);
    let mut side = Some(rect.side());
    for _ in 0..SIZES {
        let Some(tried) = side else { break };
        for rect in windows(pixel, tried, cloud.width, cloud.height) {
            let found = if changes.none_in(&rect) { score(&rect) } else { f64::INFINITY };
            if found < best.0 {
                best = (found, Some(rect));
            }
        }
        best.0 *= SHRINK;
        side = smaller(tried);
    }
    best.1
}
