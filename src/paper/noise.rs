//! Whether neighbouring pixels have the same noise: a sensor's matching windows and filters make it so.

use super::blocks::Blocks;
use super::cloud::Cloud;
use super::depth_change::Clean;
use super::planes::Plane;
use crate::rect::Rect;

/// Windows are looked at in so many columns and rows of the image; so many at least must tell.
const SAMPLES: usize = 10;
const FEWEST: usize = 16;

/// Their radii: small enough for noise that few neighbours share, twice as large or more, and again.
const RADII: [usize; 3] = [2, 5, 10];

/// Of the variance in the middle window, noise of its own in every pixel leaves more than this share in the small one, in half
/// of all windows; and a surface that is round and without noise, less than that.
const OWN: f64 = 0.75;
const ROUND: f64 = 0.08;

/// How many pixels have the same noise: n points tell of a plane as much as that many times fewer with noise of their own.
/// 1 if each pixel has its own.
///
/// A plane follows what is alike in `area` pixels: of the variance in n points it takes the share 3 `area` / n, or as that
/// grows leaves exp(-3 `area` / n). Small windows tell best whether there is such an area, as surfaces are plane there, and
/// larger ones how large it is.
pub(crate) fn noise_area(cloud: &Cloud, blocks: &Blocks, clean: &Clean, least_noise: f32) -> f32 {
    let line = |number: usize, count: usize| (2 * number + 1) * count / (2 * SAMPLES);
    let [_, _, largest] = RADII;
    let (mut told, mut count) = ([[0.0; 2]; SAMPLES * SAMPLES], 0);
    for sample in 0..told.len() {
        let column = line(sample % SAMPLES, blocks.across);
        let row = line(sample / SAMPLES, blocks.down);
        if clean.radii[row * blocks.across + column] as usize >= largest
            && let Some(shares) = shares(cloud, blocks.middle_of((column, row)), least_noise)
        {
            told[count] = shares;
            count += 1;
        }
    }
    let told = &mut told[..count];
    let mut median = |which: usize| {
        told.sort_unstable_by(|a, b| a[which].total_cmp(&b[which]));
        told[count / 2][which]
    };
    if count < FEWEST || median(0) > OWN {
        return 1.0;
    }
    let [_, middle, large] = RADII.map(|radius| ((2 * radius + 1) * (2 * radius + 1)) as f64);
    let area = -median(1).ln() / (3.0 / middle - 3.0 / large);
    // Where it is larger than windows are, they do not tell by how much.
    area.max(1.0).min(large) as f32
}

/// Of the variance in the window of the middle radius around a pixel, the share in the small one; and of that in the large one,
/// the share in the middle one. None if windows are not whole, or without noise.
fn shares(cloud: &Cloud, pixel: (usize, usize), least_noise: f32) -> Option<[f64; 2]> {
    let variance = |radius: usize| {
        let rect = Rect::around(pixel, radius, (cloud.width, cloud.height));
        let is_whole = |plane: &Plane| plane.points == ((2 * radius + 1).pow(2)) as f64;
        Plane::of(cloud, &rect).filter(is_whole).map(|plane| plane.unevenness)
    };
    let [small, middle, large] = RADII.map(variance);
    let (small, middle, large) = (small?, middle?, large?);
    let has_noise = f64::from(least_noise) < middle && ROUND * middle < small;
    has_noise.then_some([small / middle, middle / large])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Points;
    use crate::options::Options;
    use crate::paper::DepthChanges;
    use crate::threads::Workers;

    /// The noise area of a surface with inverse depths of 0.5 and so much noise, a mean over `side` x `side` pixels, on top of
    /// a parabola.
    fn area(side: usize, noise: f32, bend: f32) -> f32 {
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
            let z = 1.0 / (0.5 + noise * mean / side as f32 + bend * (u * u + v * v));
            [u / 525.0 * z, v / 525.0 * z, z]
        };
        let points: Vec<_> = (0..width * height).flat_map(point).collect();
        let points = Points::interleaved(&points, width, height, 3, 0).unwrap();
        let options = Options { crease_windows: true, ..Options::default() };
        let cloud = Cloud::new(&points, &options).unwrap();
        let (mut changes, workers) = (DepthChanges::default(), Workers::default());
        crate::paper::find_depth_changes(&mut changes, &cloud, &options, &workers).unwrap();
        let clean = changes.clean((width, height), 20, &workers).unwrap();
        noise_area(&cloud, &Blocks::of(width, height), &clean, 1e-9)
    }

    #[test]
    fn only_noise_that_neighbours_share_has_an_area() {
        for bend in [0.0, 1e-7, -1e-6] {
            assert_eq!(area(1, 2e-3, bend), 1.0, "{bend}");
            assert_eq!(area(5, 0.0, bend), 1.0, "{bend}");
            let areas = [3, 5, 7].map(|side| area(side, 2e-3, bend));
            println!("{bend}: {areas:?}");
            for (side, area) in [3, 5, 7].into_iter().zip(areas) {
                // As means over windows change gradually, a plane follows somewhat less of them.
                let share = area / (side * side) as f32;
                assert!((0.4..1.2).contains(&share), "{bend}, {side}: {area}");
            }
        }
    }
}
