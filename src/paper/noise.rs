//! Whether depths have noise, and neighbouring pixels the same: a sensor's matching windows and filters make it so.

use super::blocks::Blocks;
use super::cloud::Cloud;
use super::depth_change::Clean;
use super::planes::{Plane, inverse_depth};
use crate::rect::Rect;

/// Inverse depths that deviate less than this many alpha from a plane are as good as in it.
const EVEN: f32 = 0.02;

/// Windows are looked at in so many columns and rows of the image; so many at least must tell.
const SAMPLES: usize = 10;
const FEWEST: usize = 16;

/// Their radii: small enough for noise that few neighbours share, and twice as large or more.
const SMALL: [usize; 2] = [2, 5];
const LARGE: [usize; 2] = [5, FARTHEST];
pub(crate) const FARTHEST: usize = 10;

/// Of the variance in the larger one of two windows, noise of its own in every pixel leaves more than this share in the smaller
/// one, in half of all places; and a surface that is round and without noise, less than that.
const OWN: f64 = 0.75;
const ROUND: f64 = 0.08;

/// And in the differences between neighbours more than this share of those between pixels `LAG` apart, however the surface
/// bends: along the rows or down the columns, as relief is seldom across both.
const OWN_DIFFERENCES: f64 = 0.9;
const LAG: usize = 3;

const MEDIAN: Places = Places { part: 2, radius: FARTHEST, are_scattered: false };

/// Depths are exact if in more than an eighth of all places the points of a small window lie in a plane, but for less than this
/// share of the variance that is told from none. Noise that many pixels share, or that was made smooth by a filter or filled
/// in between fewer pixels, leaves more.
const EXACT: f32 = 0.01;
const EXACT_RADIUS: usize = 3;
const EIGHTH: Places = Places { part: 8, radius: EXACT_RADIUS, are_scattered: true };

/// What an image's depths tell of their noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// Whether there is none, as in a simulator's depths: whatever is uneven is relief.
    pub is_none: bool,
    /// The smallest variance of inverse depths that is told from none.
    pub least: f32,
    /// How many pixels have the same noise: n points tell of a plane as much as that many times fewer with noise of their own.
    /// 1 if each pixel has its own.
    pub area: f32,
}

impl Noise {
    /// Where the sensor's smallest depth change is `alpha`.
    pub fn of(cloud: &Cloud, blocks: &Blocks, clean: &Clean, alpha: f32) -> Noise {
        let least = (EVEN * alpha).powi(2);
        if are_exact(cloud, blocks, clean, least) {
            return Noise { is_none: true, least, area: 1.0 };
        }
        Noise { is_none: false, least, area: area(cloud, blocks, clean, least) }
    }

    /// The variance of a pixel's inverse depth about its window's plane, if it is not that of the windows but there is no noise.
    pub fn of_exact(&self) -> Option<f32> {
        self.is_none.then_some(EXACT * self.least)
    }
}

/// Whether depths are without noise.
fn are_exact(cloud: &Cloud, blocks: &Blocks, clean: &Clean, least_noise: f32) -> bool {
    let unevenness = |pixel| {
        let rect = Rect::around(pixel, EXACT_RADIUS, (cloud.width, cloud.height));
        let plane = Plane::of(cloud, &rect)?;
        // Depths that a sensor rounds are alike here and there.
        (plane.steepness_squared > least_noise.into()).then_some(plane.unevenness)
    };
    EIGHTH
        .quantile(blocks, clean, unevenness)
        .is_some_and(|unevenness| unevenness < f64::from(EXACT * least_noise))
}

/// How many pixels have the same noise, if there is some.
///
/// A plane follows what is alike in `area` pixels: of the variance in n points it takes the share 3 `area` / n, or as that
/// grows leaves exp(-3 `area` / n). Small windows and differences tell best whether there is such an area, as surfaces are
/// plane there, and larger windows how large it is.
fn area(cloud: &Cloud, blocks: &Blocks, clean: &Clean, least_noise: f32) -> f32 {
    let of_windows = |radii: [usize; 2]| {
        MEDIAN.quantile(blocks, clean, |pixel| share(cloud, pixel, radii, least_noise.into()))
    };
    let of_differences = || {
        MEDIAN.quantile(blocks, clean, |pixel| {
            let [along, down] = [0, 1].map(|axis| {
                let [near, far] = [1, LAG].map(|lag| differences(cloud, pixel, axis, lag));
                near / far
            });
            (!along.is_nan() && !down.is_nan()).then(|| along.max(down))
        })
    };
    let is_shared = of_windows(SMALL).is_some_and(|share| share <= OWN)
        && of_differences().is_some_and(|share| share <= OWN_DIFFERENCES);
    let Some(share) = is_shared.then(|| of_windows(LARGE)).flatten() else { return 1.0 };
    let [middle, large] = LARGE.map(|radius| points(radius) as f64);
    let area = -share.ln() / (3.0 / middle - 3.0 / large);
    // Where it is larger than windows are, they do not tell by how much.
    area.max(1.0).min(large) as f32
}

/// The places that are asked: those around which no depth change is as near as `radius`. They share rows and columns or, as
/// stairs are alike along these, are scattered, each in its own. All but a `part`-th of those that tell something tell as much as
/// the quantile, or more.
struct Places {
    part: usize,
    radius: usize,
    are_scattered: bool,
}

impl Places {
    /// The quantile; none if few tell something.
    fn quantile(
        &self,
        blocks: &Blocks,
        clean: &Clean,
        tell: impl Fn((usize, usize)) -> Option<f64>,
    ) -> Option<f64> {
        let (mut told, mut count) = ([0.0; SAMPLES * SAMPLES], 0);
        let line = |number: usize, halves: usize, lines: usize| {
            (2 * SAMPLES * number + halves) * lines / (2 * SAMPLES * SAMPLES)
        };
        for sample in 0..told.len() {
            let (x, y) = (sample % SAMPLES, sample / SAMPLES);
            // Hammersley's points: a number, and the same with its digits in reverse.
            let own = [2 * y + 1, 2 * x + 1];
            let [dx, dy] = if self.are_scattered { own } else { [SAMPLES; 2] };
            let (column, row) = (line(x, dx, blocks.across), line(y, dy, blocks.down));
            if clean.radii[row * blocks.across + column] as usize >= self.radius
                && let Some(value) = tell(blocks.middle_of((column, row)))
            {
                told[count] = value;
                count += 1;
            }
        }
        let told = &mut told[..count];
        told.sort_unstable_by(f64::total_cmp);
        (count >= FEWEST).then(|| told[count / self.part])
    }
}

/// The share of the variance in the window of the larger radius around a pixel that is left in that of the smaller one; none if
/// a point is missing, or if there is no noise.
fn share(cloud: &Cloud, pixel: (usize, usize), radii: [usize; 2], least_noise: f64) -> Option<f64> {
    let size = (cloud.width, cloud.height);
    let [small, large] = radii.map(|radius| Plane::of(cloud, &Rect::around(pixel, radius, size)));
    let (small, large) = (small?, large?);
    let is_whole = large.points == points(radii[1]) as f64;
    let share = small.unevenness / large.unevenness;
    (is_whole && least_noise < large.unevenness && ROUND < share).then_some(share)
}

/// How many points a window of this radius has.
fn points(radius: usize) -> usize {
    (2 * radius + 1).pow(2)
}

/// The mean square of how far inverse depths are from the mean of those `lag` columns, axis 0, or rows before and behind,
/// around a pixel; not a number if a point is missing.
fn differences(cloud: &Cloud, pixel: (usize, usize), axis: usize, lag: usize) -> f64 {
    let Rect { x: columns, y: rows } = Rect::around(pixel, SMALL[1], (cloud.width, cloud.height));
    let inverse = |x: usize, y: usize| f64::from(inverse_depth(cloud.depths[cloud.index(x, y)]));
    let [dx, dy] = [[lag, 0], [0, lag]][axis];
    let (mut sum, mut count) = (0.0, 0.0);
    for y in rows.start + dy..rows.end.saturating_sub(dy) {
        for x in columns.start + dx..columns.end.saturating_sub(dx) {
            let beside = (inverse(x - dx, y - dy) + inverse(x + dx, y + dy)) / 2.0;
            sum += (inverse(x, y) - beside).powi(2);
            count += 1.0;
        }
    }
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Points;
    use crate::options::Options;
    use crate::paper::DepthChanges;
    use crate::threads::Workers;

    /// What is told of a surface with inverse depths of 0.5 and so much noise, a mean over `side` x `side` pixels, on top of
    /// what `shape` gives.
    fn noise_of(side: usize, noise: f32, shape: impl Fn([f32; 2]) -> f32) -> Noise {
        let (width, height) = (240, 180);
        let mut bits = 1_u32;
        let mut random = || {
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (bits >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let columns = width + side;
        let own: Vec<_> = (0..columns * (height + side)).map(|_| random()).collect();
        let point = |at: usize| {
            let (x, y) = (at % width, at / width);
            let rows = own[y * columns..].chunks(columns).take(side);
            let mean = rows.map(|row| row[x..x + side].iter().sum::<f32>()).sum::<f32>();
            let [u, v] = [(x, width), (y, height)].map(|(at, size)| at as f32 - size as f32 / 2.0);
            let z = 1.0 / (0.5 + noise * mean / side as f32 + shape([u, v]));
            [u / 525.0 * z, v / 525.0 * z, z]
        };
        let points: Vec<_> = (0..width * height).flat_map(point).collect();
        let points = Points::interleaved(&points, width, height, 3, 0).unwrap();
        let options = Options { crease_windows: true, ..Options::default() };
        let cloud = Cloud::new(&points, &options).unwrap();
        let (mut changes, workers) = (DepthChanges::default(), Workers::default());
        crate::paper::find_depth_changes(&mut changes, &cloud, &options, &workers).unwrap();
        let clean = changes.clean((width, height), 20, &workers).unwrap();
        let alpha = 1e-9_f32.sqrt() / EVEN;
        Noise::of(&cloud, &Blocks::of(width, height), &clean, alpha)
    }

    fn area(side: usize, noise: f32, shape: impl Fn([f32; 2]) -> f32) -> f32 {
        noise_of(side, noise, shape).area
    }

    #[test]
    fn only_noise_that_neighbours_share_has_an_area() {
        for bend in [0.0, 1e-7, -1e-6] {
            let parabola = |[u, v]: [f32; 2]| bend * (u * u + v * v);
            assert_eq!(area(1, 2e-3, parabola), 1.0, "{bend}");
            assert_eq!(area(5, 0.0, parabola), 1.0, "{bend}");
            let areas = [3, 5, 7].map(|side| area(side, 2e-3, parabola));
            println!("{bend}: {areas:?}");
            for (side, area) in [3, 5, 7].into_iter().zip(areas) {
                // As means over windows change gradually, a plane follows somewhat less of them.
                let share = area / (side * side) as f32;
                assert!((0.4..1.2).contains(&share), "{bend}, {side}: {area}");
            }
        }
    }

    #[test]
    fn relief_along_one_axis_is_no_noise() {
        for axis in [0, 1] {
            for (period, slope) in [(30.0, 3e-4), (20.0, 5e-4), (20.0, 1e-3)] {
                let folds =
                    |at: [f32; 2]| slope * (at[axis].rem_euclid(period) - period / 2.0).abs();
                let what = format!("axis {axis}, {period} px, {slope}");
                for noise in [0.0, 2e-3] {
                    assert_eq!(area(1, noise, folds), 1.0, "{what}, noise {noise}");
                }
                assert!(area(5, 2e-3, folds) > 10.0, "{what}");
            }
        }
    }

    #[test]
    fn depths_without_noise_are_exact() {
        for (period, slope) in [(30.0, 1e-3), (50.0, 5e-4), (50.0, 1e-3)] {
            for across in [0.0, 0.3, 1.0] {
                let folds = |[u, v]: [f32; 2]| {
                    slope * ((u + across * v).rem_euclid(period) - period / 2.0).abs()
                };
                let what = format!("{period} px, {slope}, {across}");
                assert!(noise_of(1, 0.0, folds).is_none, "{what}");
                for (side, noise) in [(1, 2e-4), (5, 2e-4), (7, 2e-3)] {
                    assert!(!noise_of(side, noise, folds).is_none, "{what}, {side}, {noise}");
                }
            }
        }
        let rounded = |[u, _]: [f32; 2]| (u / 4.0).floor() * 1e-3;
        let filled_in = |[u, v]: [f32; 2]| {
            let step = |at: f32| (at / 8.0).floor();
            let noise = |x: f32, y: f32| (x * 12.9898 + y * 78.233).sin() * 1e-3;
            let (x, y) = (step(u), step(v));
            let (s, t) = (u / 8.0 - x, v / 8.0 - y);
            let [above, below] =
                [y, y + 1.0].map(|y| (1.0 - s) * noise(x, y) + s * noise(x + 1.0, y));
            (1.0 - t) * above + t * below
        };
        assert!(!noise_of(1, 0.0, rounded).is_none && !noise_of(1, 0.0, filled_in).is_none);
    }
}
