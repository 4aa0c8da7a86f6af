//! What AVERAGE_DEPTH_CHANGE sums depths up in: 32-bit integers, twice as many of which fit in a register, where they
//! are fine enough, and f64 else.

use super::arithmetic::{Doubles, Floats, Integers};
use super::buffer::Number;
use super::run::Lane;
use crate::cloud::Points;
use crate::depth_change::threshold;
use crate::options::Options;
use crate::paper::ROUNDING;
use crate::simd::{Along, Groups, Simd};
use crate::vector::{cross, difference, dot};

/// What depths are summed up in.
pub(crate) trait DepthSum: Lane + Number {
    /// [`Sums::EXACT`](super::tile::Sums::EXACT)
    const EXACT: bool;

    /// As many lanes as are added along a row at once.
    type Pushed<S: Groups>: Simd;

    /// What rounding moves a difference between two half windows' sums by at most: where depths are multiplied by
    /// `scale`, none is larger than `limit`, and the ring holds so many. Of integers, between their means.
    fn error(scale: f32, limit: f32, held: usize) -> f64;

    /// What the square of that is divided by for means over so many points.
    fn reduction<S: Simd>(points: Floats<S>) -> Floats<S>;

    /// From a depth that has been multiplied.
    fn of_one(depth: f32) -> Self;

    fn plus(self, other: Self) -> Self;

    fn minus(self, other: Self) -> Self;

    /// A sum of `count` depths, less `depth` as often.
    fn about(self, depth: Self, count: i32) -> f64;

    /// From depths that have been multiplied.
    fn of<S: Simd>(depths: Floats<S>) -> Self::Of<S>;

    /// The sums along the row, going on from `carry`, which becomes the last one.
    fn running_sum<S: Groups>(
        depths: Self::Of<Self::Pushed<S>>,
        carry: &mut Self::Of<Self::Pushed<S>>,
    ) -> Self::Of<Self::Pushed<S>>;

    fn floats<S: Simd>(sums: Self::Of<S>) -> Floats<S>;
}

impl DepthSum for f64 {
    const EXACT: bool = false;

    type Pushed<S: Groups> = S;

    fn error(_scale: f32, limit: f32, held: usize) -> f64 {
        2.0 * ROUNDING * f64::from(limit) * held as f64
    }

    #[inline(always)]
    fn reduction<S: Simd>(points: Floats<S>) -> Floats<S> {
        points * points
    }

    fn of_one(depth: f32) -> f64 {
        depth.into()
    }

    fn plus(self, other: f64) -> f64 {
        self + other
    }

    fn minus(self, other: f64) -> f64 {
        self - other
    }

    fn about(self, depth: f64, count: i32) -> f64 {
        self - depth * f64::from(count)
    }

    #[inline(always)]
    fn of<S: Simd>(depths: Floats<S>) -> Doubles<S> {
        depths.widen()
    }

    #[inline(always)]
    fn running_sum<S: Groups>(depths: Doubles<S>, carry: &mut Doubles<S>) -> Doubles<S> {
        // SAFETY: there is a group, so there is the instruction set.
        Doubles(unsafe { S::running_sum_d(depths.0, &mut carry.0) })
    }

    #[inline(always)]
    fn floats<S: Simd>(sums: Doubles<S>) -> Floats<S> {
        sums.narrow()
    }
}

impl DepthSum for i32 {
    const EXACT: bool = true;

    type Pushed<S: Groups> = S::Widest;

    fn error(scale: f32, _limit: f32, _held: usize) -> f64 {
        // Equal depths, as of a sensor with depth steps, are all rounded alike.
        1.0 / f64::from(scale)
    }

    #[inline(always)]
    fn reduction<S: Simd>(_points: Floats<S>) -> Floats<S> {
        // SAFETY: there is a group, so there is the instruction set.
        unsafe { Floats::splat(1.0) }
    }

    fn of_one(depth: f32) -> i32 {
        depth.round_ties_even() as i32
    }

    fn plus(self, other: i32) -> i32 {
        self.wrapping_add(other)
    }

    fn minus(self, other: i32) -> i32 {
        self.wrapping_sub(other)
    }

    fn about(self, depth: i32, count: i32) -> f64 {
        self.wrapping_sub(depth.wrapping_mul(count)).into()
    }

    #[inline(always)]
    fn of<S: Simd>(depths: Floats<S>) -> Integers<S> {
        // SAFETY: there is a group, so there is the instruction set.
        Integers(unsafe { S::round_i(depths.0) })
    }

    #[inline(always)]
    fn running_sum<S: Groups>(
        depths: Integers<S::Widest>,
        carry: &mut Integers<S::Widest>,
    ) -> Integers<S::Widest> {
        // SAFETY: there is a group, so there is the instruction set.
        Integers(unsafe { S::Widest::running_sum_i(depths.0, &mut carry.0) })
    }

    #[inline(always)]
    fn floats<S: Simd>(sums: Integers<S>) -> Floats<S> {
        sums.float()
    }
}

/// How large a part of the spacing of points a step of integers may be: then few windows are doubtful.
const FINE: f32 = 1.6e-4;

/// The spacing is looked at in `SAMPLES - 1` rows and as many columns.
const SAMPLES: usize = 8;

/// What depths, of which none is larger than `deepest`, are multiplied by to become integers; none if these would not
/// be fine enough for points at this `spacing` and windows of up to `side`.
pub(crate) fn scale_to_integers(
    spacing: f32,
    options: &Options,
    deepest: f32,
    side: usize,
) -> Option<f32> {
    let half = side / 2;
    // From one point of a window to the next there is no depth change. It is a step more than half the side from a
    // half window to the other, and no more, in the mean, from the pixel to either.
    let change = threshold(deepest, options.max_depth_change_factor);
    let apart = f64::from(2.0 * deepest).min(f64::from(change) * (half + 1) as f64);
    // Sums may wrap around; points and differences must fit.
    let bits = 30.9 - ((half * half) as f64 * apart).log2();
    let bits = bits.min(30.0 - f64::from(deepest).log2());
    let scale = bits.floor().clamp(-120.0, 120.0).exp2() as f32;
    (1.0 < FINE * spacing * scale).then_some(scale)
}

/// How far neighbours in a row are apart, across the ray that sees them, along which a steep surface or depth steps move
/// points without telling their direction: the lower quartile of some here and there, so that a few that are far off do
/// no harm; 0 if there are none.
pub(crate) fn spacing(points: &Points) -> f32 {
    let places = |size: usize| (1..SAMPLES).map(move |i| i * size / SAMPLES);
    let pixels = places(points.height()).flat_map(|y| places(points.width()).map(move |x| (x, y)));
    let apart = pixels.map(|(x, y)| {
        let x = x.max(1);
        let (a, b) = (points.at(x - 1, y), points.at(x, y));
        let across = cross(a, difference(b, a));
        (dot(across, across) / dot(a, a)).sqrt()
    });
    let (mut sorted, mut count) = ([0.0; (SAMPLES - 1) * (SAMPLES - 1)], 0);
    for spacing in apart.filter(|spacing| 0.0 < *spacing && spacing.is_finite()) {
        sorted[count] = spacing;
        count += 1;
    }
    sorted[..count].sort_unstable_by(f32::total_cmp);
    sorted[count / 4]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spacing_is_across_the_rays_however_steep_the_surface_is() {
        const SIZE: usize = 64;
        let mut data = Vec::new();
        for y in 0..SIZE {
            for x in 0..SIZE {
                let z = 2.0 + 0.02 * x as f32;
                data.extend([(x as f32 - 32.0) * 1e-3 * z, (y as f32 - 32.0) * 1e-3 * z, z]);
            }
        }
        let points = Points::interleaved(&data, SIZE, SIZE, 3, 0).expect("a cloud");
        // A thousandth of the depth, here and there: 2.16 to 3.12 m.
        let spacing = spacing(&points);
        assert!((2.1e-3..2.7e-3).contains(&spacing), "{spacing}");
    }
}
