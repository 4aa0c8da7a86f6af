//! Where the surface's normals vary strongly, but not because it is round: near edges without a depth change.

use std::iter::repeat_n;

use super::blocks::{BLOCK, Blocks, MIDDLE, lines_around};
use super::cloud::Cloud;
use super::summed_area::SummedArea;
use crate::Error;
use crate::memory::{bytes, refill};
use crate::methods::is_length;
use crate::rect::Rect;
use crate::threads::Workers;
use crate::vector::{cross, difference, dot, sum};

/// Integral images of normals, one for each block.
#[derive(Debug, Default)]
pub(crate) struct SummedNormals {
    normals: SummedArea<4>,
    /// Of the blocks' points, which they can be made from: x, y, z, and how many there are.
    points: SummedArea<4>,
    /// How much the surface bends around each block; NaN where that is not known.
    bends: Vec<f32>,
}

/// The sum of some points, and their number.
type Sum = [f64; 4];

impl SummedNormals {
    /// Sums the points of a cloud, the blocks of which are summed. `alpha` is the sensor's.
    pub fn sum_points(
        &mut self,
        cloud: &Cloud,
        alpha: f32,
        blocks: &Blocks,
        workers: &Workers,
    ) -> Result<(), Error> {
        let farthest = FARTHEST / alpha;
        self.points.sum_up(blocks.across, blocks.down, workers, |(column, row)| {
            let sum @ [x, y, z, count] = cloud.sums[row * blocks.across + column];
            let is_near = |value: f32| value.abs() <= farthest * count;
            if is_near(x) && is_near(y) && is_near(z) { sum.map(f64::from) } else { [0.0; 4] }
        })
    }

    /// Sums the normals of blocks; NaN where there is none.
    pub fn sum(
        &mut self,
        estimates: &[[f32; 4]],
        blocks: &Blocks,
        workers: &Workers,
    ) -> Result<(), Error> {
        self.normals.sum_up(blocks.across, blocks.down, workers, |(column, row)| {
            let [x, y, z, _] = estimates[row * blocks.across + column];
            if x.is_nan() { [0.0; 4] } else { [x, y, z, 1.0].map(f64::from) }
        })
    }

    /// Sums those across the mean 3-D gradients of the points that were summed, in windows of these radii around blocks; 0
    /// for none.
    pub fn sum_gradients(
        &mut self,
        cloud: &Cloud,
        blocks: &Blocks,
        radius: impl Fn((usize, usize)) -> u32 + Sync,
        workers: &Workers,
    ) -> Result<(), Error> {
        let points = &self.points;
        self.normals.sum_up(blocks.across, blocks.down, workers, |block| {
            let halves = match radius(block) {
                0 => return [0.0; 4],
                radius if radius <= MIDDLE as u32 => halves_of_block(cloud, blocks, block),
                radius => halves_around(points, blocks, block, radius),
            };
            normal(halves).map_or([0.0; 4], |[x, y, z]| [x, y, z, 1.0])
        })
    }

    /// Finds how much the surface bends around each block, in windows of as many blocks to each side as `reach` says; 0
    /// where that is not known. Points and normals have been summed.
    pub fn find_bends(
        &mut self,
        blocks: &Blocks,
        reach: impl Fn(usize) -> usize + Sync,
        workers: &Workers,
    ) -> Result<(), Error> {
        let SummedNormals { normals, points, bends } = self;
        refill(bends, repeat_n(f32::NAN, blocks.count()))?;
        workers.each(bends.chunks_mut(blocks.across).enumerate(), |(row, bends)| {
            for (column, to) in bends.iter_mut().enumerate() {
                match reach(row * blocks.across + column) {
                    0 => (),
                    reach => *to = bend(normals, points, blocks, (column, row), reach) as f32,
                }
            }
        });
        Ok(())
    }

    /// Whether the surface bends around a block as it does at the places around: it is round there. Beside a crease
    /// it does not.
    pub fn bend_alike(&self, blocks: &Blocks, (column, row): (usize, usize)) -> bool {
        let bend = |x: usize, y: usize| self.bends[y * blocks.across + x];
        let least = ALIKE_BENDS * bend(column, row);
        if least.is_nan() {
            return false;
        }
        let mut known = 0;
        for distance in BENDS_APART {
            for y in lines_around(row, distance, blocks.down) {
                for x in lines_around(column, distance, blocks.across) {
                    let bend = bend(x, y);
                    // Both may be below 0.
                    if least * bend <= least * least {
                        return false;
                    }
                    known += u32::from(!bend.is_nan());
                }
            }
        }
        known >= FEWEST_BENDS
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        self.points.size() + self.normals.size() + bytes(&self.bends)
    }

    /// Whether the normals of the blocks that a rectangle of pixels touches vary strongly, or there are none. How much they
    /// vary is 1 - |mean|^2: for small angles their variance in square radians. (Rounding, beside points that are orders of
    /// magnitude farther, may make them vary too: then more windows than need be are looked at again.)
    pub fn vary_in(&self, pixels: &Rect) -> bool {
        let [x, y] =
            [&pixels.x, &pixels.y].map(|range| range.start / BLOCK..range.end.div_ceil(BLOCK));
        let [x, y, z, count] = self.normals.sum(&Rect { x, y });
        x * x + y * y + z * z <= (1.0 - STRONG_VARIATION) * (count * count)
    }
}

/// In square radians: normals about 5.3 degrees from their mean.
const STRONG_VARIATION: f64 = 0.0085;

/// How many blocks to each side windows reach at most by which bends are told: faces between creases may be small.
pub(crate) const BEND_REACH: usize = 2;
/// And how many blocks away they are compared with a block's own: windows there are beside a crease that the block is on.
const BENDS_APART: [usize; 2] = [3, 2];

/// Bends are alike that are on the same side and at least this share of the block's own, of which noise and the way a surface
/// is seen leave no more; and that is told from so many places at least, the own one counted twice.
const ALIKE_BENDS: f32 = 0.2;
const FEWEST_BENDS: u32 = 6;

/// Blocks so far away that a depth's smallest change, alpha d^2 (Eq. 4), is this many times the depth are left out: they are
/// markers for "no return", beside which sums would lose all others.
const FARTHEST: f32 = 1000.0;

/// How far the mean point of a window's middle part is from that of the window, along the block's normal, as a share of
/// how much larger the window is: half the mean curvature, or so. NaN if there is none.
fn bend(
    normals: &SummedArea<4>,
    points: &SummedArea<4>,
    blocks: &Blocks,
    block: (usize, usize),
    reach: usize,
) -> f64 {
    let around = |reach: usize| Rect::around(block, reach, (blocks.across, blocks.down));
    let [nx, ny, nz, there] = normals.sum(&around(0));
    let [middle, window] = [reach / 2, reach].map(|reach| points.sum(&around(reach)));
    // Numbers of points are exact.
    if there == 0.0 || middle[3] == 0.0 {
        return f64::NAN;
    }
    let mean = |[x, y, z, count]: Sum| {
        let share = 1.0 / count;
        [x * share, y * share, z * share]
    };
    let out = dot([nx, ny, nz], difference(mean(middle), mean(window)));
    let side2 = |reach: usize| ((2 * reach + 1) * (2 * reach + 1)) as f64;
    out / (side2(reach) - side2(reach / 2))
}

/// The halves of a block: left and right, above and below.
fn halves_of_block(cloud: &Cloud, blocks: &Blocks, block: (usize, usize)) -> [[Sum; 2]; 2] {
    let mut halves = [[[0.0; 4]; 2]; 2];
    for (number, at) in blocks.pixels(block).into_iter().enumerate() {
        if !cloud.is_missing(at) {
            let [px, py, pz] = cloud.points[at].map(f64::from);
            let half = [number % BLOCK, number / BLOCK].map(|line| line / MIDDLE);
            for axis in 0..2 {
                let to = &mut halves[axis][half[axis]];
                *to = sum(*to, [px, py, pz, 1.0]);
            }
        }
    }
    halves
}

/// The halves of the window of blocks around a block that is about as large as that of a radius, without the block's own
/// column or row. At the edges of the image the block stands for those beyond.
fn halves_around(
    points: &SummedArea<4>,
    blocks: &Blocks,
    (column, row): (usize, usize),
    radius: u32,
) -> [[Sum; 2]; 2] {
    let reach = ((radius as usize + 1) / BLOCK).max(1);
    // Where the halves before and behind start and end.
    let halves = |at: usize, count: usize| {
        let (first, last) = (at.saturating_sub(reach), (at + reach).min(count - 1));
        [first, at.max(1), (at + 1).min(last), last + 1]
    };
    let [x0, x1, x2, x3] = halves(column, blocks.across);
    let [top, above, below, bottom] = halves(row, blocks.down).map(|row| points.row(row));
    let columns = |x: usize| difference(bottom[x], top[x]);
    let rows = |row: &[Sum]| difference(row[x3], row[x0]);
    [
        [difference(columns(x1), columns(x0)), difference(columns(x3), columns(x2))],
        [difference(rows(above), rows(top)), difference(rows(bottom), rows(below))],
    ]
}

/// Across the ways from the mean of the left half to that of the right one, and from above to below: the mean 3-D gradients.
fn normal(halves: [[Sum; 2]; 2]) -> Option<[f64; 3]> {
    // Of a half without points rounding may be left.
    if halves.as_flattened().iter().any(|[_, _, _, count]| *count == 0.0) {
        return None;
    }
    // As long as the numbers of points make them: means would take divisions.
    let [u, v] = halves.map(|[[a, b, c, before], [d, e, f, behind]]| {
        [d * before - a * behind, e * before - b * behind, f * before - c * behind]
    });
    let normal = cross(v, u);
    let length2 = dot(normal, normal);
    let scale = 1.0 / length2.sqrt();
    is_length(length2).then(|| normal.map(|n| n * scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Points;
    use crate::options::{Method, Options, Semantics};

    /// A cloud whose depths are a function of the column, with some points missing, and above on the right two at the depth
    /// `marker`.
    fn cloud(marker: f32, depth: impl Fn(f32) -> f32) -> Cloud {
        let (width, height) = (90, 61);
        let method = Method::CovarianceMatrix;
        let semantics = Semantics::Paper;
        let options = Options { semantics, method, crease_windows: true, ..Options::default() };
        let point = |at: usize| {
            let [x, y] = [at % width, at / width].map(|line| 0.01 * line as f32);
            match at {
                70 | 71 => [x, y, marker],
                _ if at % 11 == 3 => [f32::NAN; 3],
                _ => [x, y, depth(x)],
            }
        };
        let points: Vec<_> = (0..width * height).flat_map(point).collect();
        let points = Points::interleaved(&points, width, height, 3, 0).unwrap();
        Cloud::new(&points, &options).unwrap()
    }

    #[test]
    fn gradients_vary_at_creases_only() {
        let alpha = Options::default().paper.alpha;
        for marker in [f32::NAN, 1e7, 1e20, f32::MAX] {
            for (bend, varies) in [(0.0, false), (0.5, true)] {
                let cloud = cloud(marker, |x| 2.0 + 0.3 * x + bend * (x - 0.45).abs());
                let (blocks, workers) = (Blocks::of(cloud.width, cloud.height), Workers::default());
                let mut normals = SummedNormals::default();
                normals.sum_points(&cloud, alpha, &blocks, &workers).unwrap();
                for radius in [1, 2, 3, 7, 8, 20] {
                    normals.sum_gradients(&cloud, &blocks, |_| radius, &workers).unwrap();
                    let vary_in = |x| normals.vary_in(&Rect { x, y: 0..cloud.height });
                    assert_eq!(vary_in(25..65), varies, "marker {marker}, radius {radius}");
                    assert!(!vary_in(0..20), "marker {marker}, radius {radius}");
                }
            }
        }
    }

    #[test]
    fn round_surfaces_bend_alike_and_creases_do_not() {
        let alpha = Options::default().paper.alpha;
        for (round, creased) in [(0.8, 0.0), (-0.8, 0.0), (0.0, 0.5), (0.0, -0.5)] {
            let bend = |way: f32| round * way * way + creased * way.abs();
            let cloud = cloud(f32::NAN, |x| 2.0 + 0.3 * x + bend(x - 0.45));
            let (blocks, workers) = (Blocks::of(cloud.width, cloud.height), Workers::default());
            let mut normals = SummedNormals::default();
            normals.sum_points(&cloud, alpha, &blocks, &workers).unwrap();
            normals.sum_gradients(&cloud, &blocks, |_| 5, &workers).unwrap();
            for reach in [1, 2] {
                normals.find_bends(&blocks, |_| reach, &workers).unwrap();
                for column in 9..14 {
                    let alike = normals.bend_alike(&blocks, (column, 7));
                    assert_eq!(alike, round != 0.0, "{round} {creased}: {reach}, {column}");
                }
            }
            normals.find_bends(&blocks, |_| 0, &workers).unwrap();
            assert!(!normals.bend_alike(&blocks, (11, 7)));
        }
    }

    #[test]
    fn a_half_without_points_gives_no_normal() {
        let below = [[0.0, 0.0, 2.0, 1.0], [0.0, 1.0, 2.0, 1.0]];
        let there = [[0.0, 0.0, 2.0, 1.0], [1.0, 0.0, 2.0, 1.0]];
        assert_eq!(normal([there, below]), Some([0.0, 0.0, -1.0]));
        let rounding = [[1e-9, 2e-9, 3e-9, 0.0], there[1]];
        assert_eq!(normal([rounding, below]), None);
    }
}
