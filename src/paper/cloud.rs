//! The organized cloud with its depths; every way of being missing has become NaN.

use super::blocks::{BLOCK, Blocks};
use super::planes::inverse_depth;
use crate::Error;
use crate::cloud::Points;
use crate::memory::{bytes, resize};
use crate::methods::is_finite;
use crate::options::{Depth, Options, Semantics};
use crate::rect::Rect;
use crate::vector::sum;

/// An organized cloud, row by row. A missing point has NaN coordinates and NaN depth.
#[derive(Debug, Default)]
pub(crate) struct Cloud {
    pub width: usize,
    pub height: usize,
    /// Whether depths are distances from the origin, not z.
    pub has_range: bool,
    /// With some behind the last one: whole blocks of them are read, and four floats of each.
    pub points: Vec<[f32; 3]>,
    pub depths: Vec<f32>,
    /// Block by block the sums of its points' coordinates, and their number; none where nothing is made from them.
    pub sums: Vec<[f32; 4]>,
}

impl Cloud {
    pub fn new(points: &Points, options: &Options) -> Result<Self, Error> {
        let mut cloud = Cloud::default();
        cloud.read(points, options)?;
        Ok(cloud)
    }

    /// Becomes another cloud.
    pub fn read(&mut self, points: &Points, options: &Options) -> Result<(), Error> {
        self.resize(points, options)?;
        let (width, has_range) = (self.width, self.has_range);
        let cleaned = Cleaned::new(points, options);
        let depth =
            |[x, y, z]: [f32; 3]| if has_range { (x * x + y * y + z * z).sqrt() } else { z };
        let rows = self.points.chunks_mut(width).zip(self.depths.chunks_mut(width)).enumerate();
        for (y, (points, depths)) in rows {
            for (x, (to, of_to)) in points.iter_mut().zip(depths).enumerate() {
                *to = cleaned.at(x, y);
                *of_to = depth(*to);
            }
        }
        let blocks = Blocks::of(self.width, self.height);
        for block in 0..self.sums.len() {
            self.sums[block] = self.sum_of_block(blocks.place(block));
        }
        Ok(())
    }

    /// As [`Cloud::sums`] has it: first down the columns, then along the row.
    fn sum_of_block(&self, (column, row): (usize, usize)) -> [f32; 4] {
        let mut columns = [[0.0; 4]; BLOCK];
        for y in (row * BLOCK..self.height).take(BLOCK) {
            for (x, sums) in (column * BLOCK..self.width).zip(&mut columns) {
                let at = self.index(x, y);
                if !self.is_missing(at) {
                    let [x, y, z] = self.points[at];
                    *sums = sum(*sums, [x, y, z, 1.0]);
                }
            }
        }
        columns.into_iter().reduce(sum).expect("columns")
    }

    /// Takes the size of a cloud.
    pub fn resize(&mut self, points: &Points, options: &Options) -> Result<(), Error> {
        (self.width, self.height) = (points.width(), points.height());
        let is_paper = options.semantics == Semantics::Paper;
        self.has_range = is_paper && options.paper.depth == Depth::Range;
        resize(&mut self.points, self.width * self.height + BLOCK - 1, [f32::NAN; 3])?;
        resize(&mut self.depths, self.width * self.height, f32::NAN)?;
        let blocks = Blocks::of(self.width, self.height).count();
        let summed = if options.has_second_pass() { blocks } else { 0 };
        resize(&mut self.sums, summed, [0.0; 4])
    }

    /// A view of the points.
    pub fn view(&self) -> Points<'_> {
        let Cloud { points, width, height, .. } = self;
        Points::interleaved(points.as_flattened(), *width, *height, 3, 0)
            .expect("a packed copy of a valid cloud")
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        bytes(&self.points) + bytes(&self.depths) + bytes(&self.sums)
    }

    pub fn index(&self, x: usize, y: usize) -> usize {
        y * self.width + x
    }

    pub fn is_missing(&self, at: usize) -> bool {
        self.depths[at].is_nan()
    }

    /// A pixel's point over its depth.
    pub fn ray(&self, at: usize) -> [f32; 3] {
        let inverse = inverse_depth(self.depths[at]);
        let [x, y, z] = self.points[at].map(|coordinate| coordinate * inverse);
        [x, y, if self.has_range { z } else { 1.0 }]
    }

    /// The finite points of a rectangle, in double precision.
    pub fn finite(&self, rect: Rect) -> impl Iterator<Item = [f64; 3]> {
        let Rect { x: columns, y: rows } = rect;
        let rows = rows.map(move |y| &self.points[y * self.width..][columns.clone()]);
        rows.flatten().filter(|point| !point[2].is_nan()).map(|point| point.map(f64::from))
    }

    /// How many pixels before this one in its row, axis 0, or in its column the last finite one is.
    pub fn gap(&self, at: usize, axis: usize) -> Option<usize> {
        let [before, step] = [[at % self.width, 1], [at / self.width, self.width]][axis];
        (1..=before).find(|gap| !self.is_missing(at - gap * step))
    }
}

/// The user's points, looked at when they are asked for; a missing one is NaN.
pub(crate) struct Cleaned<'a> {
    points: &'a Points<'a>,
    zero_is_missing: bool,
}

impl<'a> Cleaned<'a> {
    pub fn new(points: &'a Points, options: &Options) -> Self {
        Cleaned { points, zero_is_missing: options.zero_is_missing }
    }

    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> [f32; 3] {
        let point = self.points.at(x, y);
        let missing = !is_finite(point) || self.zero_is_missing && point == [0.0; 3];
        if missing { [f32::NAN; 3] } else { point }
    }

    /// As [`Cloud::finite`].
    pub fn finite(&self, rect: Rect) -> impl Iterator<Item = [f64; 3]> {
        rect.pixels()
            .map(|(x, y)| self.at(x, y))
            .filter(|point| !point[2].is_nan())
            .map(|point| point.map(f64::from))
    }
}
