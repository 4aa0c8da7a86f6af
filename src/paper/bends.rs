//! Where the surface is round: it bends all around as it does beside no crease.

use std::iter::repeat_n;

use super::blocks::{Blocks, lines_around};
use super::cloud::Cloud;
use super::summed_area::SummedArea;
use crate::Error;
use crate::memory::{bytes, refill};
use crate::methods::is_length;
use crate::rect::Rect;
use crate::threads::Workers;
use crate::vector::{cross, difference, dot};

/// How much the surface bends around each block.
#[derive(Debug, Default)]
pub(crate) struct Bends {
    /// The integral image of the blocks' points: x, y, z, and how many there are.
    points: SummedArea<4>,
    /// NaN where it is not known.
    bends: Vec<f32>,
    /// Whether it does so as at the places around.
    alike: Vec<bool>,
}

/// The sum of some points, and their number.
type Sum = [f64; 4];

impl Bends {
    /// Finds them for a cloud, the blocks of which are summed, in windows of as many blocks to each side as `reach` says; 0
    /// where that is not to be known. `alpha` is the sensor's.
    pub fn find(
        &mut self,
        cloud: &Cloud,
        alpha: f32,
        blocks: &Blocks,
        reach: impl Fn(usize) -> usize + Sync,
        workers: &Workers,
    ) -> Result<(), Error> {
        let Bends { points, bends, alike } = self;
        let farthest = FARTHEST / alpha;
        points.sum_up(blocks.across, blocks.down, workers, |(column, row)| {
            let sum @ [x, y, z, count] = cloud.sums[row * blocks.across + column];
            let is_near = |value: f32| value.abs() <= farthest * count;
            if is_near(x) && is_near(y) && is_near(z) { sum.map(f64::from) } else { [0.0; 4] }
        })?;
        refill(bends, repeat_n(f32::NAN, blocks.count()))?;
        workers.each(bends.chunks_mut(blocks.across).enumerate(), |(row, bends)| {
            for (column, to) in bends.iter_mut().enumerate() {
                match reach(row * blocks.across + column) {
                    0 => (),
                    reach => *to = bend(points, blocks, (column, row), reach) as f32,
                }
            }
        });
        let bends = &*bends;
        refill(alike, repeat_n(false, blocks.count()))?;
        workers.each(alike.chunks_mut(blocks.across).enumerate(), |(row, alike)| {
            for (column, alike) in alike.iter_mut().enumerate() {
                *alike = are_alike(bends, blocks, (column, row));
            }
        });
        Ok(())
    }

    /// Whether the surface is round at a block: it bends there as at the places around, or does so at blocks next to it.
    pub fn is_round(&self, blocks: &Blocks, (column, row): (usize, usize)) -> bool {
        let is_alike = |x: usize, y: usize| self.alike[y * blocks.across + x];
        let next_to_it = || {
            let rows = lines_around(row, 1, blocks.down).into_iter();
            let columns = lines_around(column, 1, blocks.across);
            rows.flat_map(|y| columns.map(|x| is_alike(x, y))).filter(|is_alike| *is_alike).count()
        };
        let is_unknown = self.bends[row * blocks.across + column].is_nan();
        is_alike(column, row) || next_to_it() + usize::from(is_unknown) >= ALIKE_BLOCKS
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        self.points.size() + bytes(&self.bends) + bytes(&self.alike)
    }
}

/// Whether the surface bends around a block as it does at the places around. Beside a crease it does not.
fn are_alike(bends: &[f32], blocks: &Blocks, (column, row): (usize, usize)) -> bool {
    let bend = |x: usize, y: usize| bends[y * blocks.across + x];
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

/// How many blocks to each side windows reach at most by which bends are told: faces between creases may be small.
pub(crate) const BEND_REACH: usize = 2;
/// And how many blocks away they are compared with a block's own: windows there are beside a crease that the block is on.
const BENDS_APART: [usize; 2] = [3, 2];

/// Bends are alike that are on the same side and at least this share of the block's own, of which noise and the way a surface
/// is seen leave no more; and that is told from so many places at least, the own one counted twice.
const ALIKE_BENDS: f32 = 0.15;
const FEWEST_BENDS: u32 = 6;

/// Noise hides it at some blocks, and depth changes nearby do: where the surface bends alike at so many of the eight around; one
/// less if the block's own bend is not known.
const ALIKE_BLOCKS: usize = 4;

/// Blocks so far away that a depth's smallest change, alpha d^2 (Eq. 4), is this many times the depth are left out: they are
/// markers for "no return", beside which sums would lose all others.
const FARTHEST: f32 = 1000.0;

/// How far the mean point of a window's middle part is from that of the window, along the normal, as a share of how much
/// larger the window is: half the mean curvature, or so. NaN if there is none.
#[inline(always)]
fn bend(points: &SummedArea<4>, blocks: &Blocks, block: (usize, usize), reach: usize) -> f64 {
    let around =
        |reach: usize| points.sum(&Rect::around(block, reach, (blocks.across, blocks.down)));
    let (halves, nine) = halves(points, blocks, block);
    let [middle, window] =
        if reach == 1 { [around(0), nine] } else { [around(reach / 2), around(reach)] };
    // Numbers of points are exact.
    let Some((normal, length2)) = normal(halves).filter(|_| middle[3] > 0.0) else {
        return f64::NAN;
    };
    let out = dot(normal, way(window, middle));
    let side2 = |reach: usize| ((2 * reach + 1) * (2 * reach + 1)) as f64;
    let sides2 = side2(reach) - side2(reach / 2);
    out / (middle[3] * window[3] * length2.sqrt() * sides2)
}

/// The sums of a block and the eight around it, in halves: left and right of its column, above and below its row; and all
/// nine. At the edges of the image it stands for those beyond.
#[inline(always)]
fn halves(
    points: &SummedArea<4>,
    blocks: &Blocks,
    (column, row): (usize, usize),
) -> ([[Sum; 2]; 2], Sum) {
    // Where the lines before and behind start and end.
    let lines = |at: usize, count: usize| {
        [at.saturating_sub(1), at.max(1), (at + 1).min(count - 1), (at + 2).min(count)]
    };
    let [x0, x1, x2, x3] = lines(column, blocks.across);
    let [top, above, below, bottom] = lines(row, blocks.down).map(|row| points.row(row));
    let columns = |x: usize| difference(bottom[x], top[x]);
    let rows = |row: &[Sum]| difference(row[x3], row[x0]);
    let (first, last) = (rows(top), rows(bottom));
    let halves = [
        [difference(columns(x1), columns(x0)), difference(columns(x3), columns(x2))],
        [difference(rows(above), first), difference(last, rows(below))],
    ];
    (halves, difference(last, first))
}

/// Across the ways from the mean of the left half to that of the right one, and from above to below: the mean 3-D gradients.
/// And the square of its length.
#[inline(always)]
fn normal(halves: [[Sum; 2]; 2]) -> Option<([f64; 3], f64)> {
    // Of a half without points rounding may be left.
    if halves.as_flattened().iter().any(|[_, _, _, count]| *count == 0.0) {
        return None;
    }
    let [u, v] = halves.map(|[before, behind]| way(before, behind));
    let normal = cross(v, u);
    let length2 = dot(normal, normal);
    is_length(length2).then_some((normal, length2))
}

/// The way from the mean of some points to that of others, times the numbers of both: means would take divisions.
#[inline(always)]
fn way([a, b, c, from]: Sum, [d, e, f, to]: Sum) -> [f64; 3] {
    [d * from - a * to, e * from - b * to, f * from - c * to]
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
    fn round_surfaces_bend_alike_and_creases_do_not() {
        let alpha = Options::default().paper.alpha;
        for marker in [f32::NAN, 1e7, 1e20, f32::MAX] {
            for (round, creased) in [(0.8, 0.0), (-0.8, 0.0), (0.0, 0.5), (0.0, -0.5)] {
                let bend = |way: f32| round * way * way + creased * way.abs();
                let cloud = cloud(marker, |x| 2.0 + 0.3 * x + bend(x - 0.45));
                let blocks = Blocks::of(cloud.width, cloud.height);
                let mut bends = Bends::default();
                let mut find = |reach: usize| {
                    bends.find(&cloud, alpha, &blocks, |_| reach, &Workers::default()).unwrap();
                    [9, 10, 11, 12, 13].map(|column| bends.is_round(&blocks, (column, 7)))
                };
                for reach in [1, 2] {
                    let expected = [round != 0.0; 5];
                    assert_eq!(find(reach), expected, "{marker} {round} {creased}: {reach}");
                }
                assert_eq!(find(0), [false; 5]);
            }
        }
    }

    #[test]
    fn a_half_without_points_gives_no_normal() {
        let below = [[0.0, 0.0, 2.0, 1.0], [0.0, 1.0, 2.0, 1.0]];
        let there = [[0.0, 0.0, 2.0, 1.0], [1.0, 0.0, 2.0, 1.0]];
        assert_eq!(normal([there, below]), Some(([0.0, 0.0, -1.0], 1.0)));
        let rounding = [[1e-9, 2e-9, 3e-9, 0.0], there[1]];
        assert_eq!(normal([rounding, below]), None);
    }
}
