//! The organized cloud with its depths; every way of being missing has become NaN.

use super::rect::Rect;
use crate::cloud::Points;
use crate::methods::is_finite;
use crate::options::{Depth, Options, Semantics};

/// An organized cloud, row by row. A missing point has NaN coordinates and NaN depth.
pub(crate) struct Cloud {
    pub width: usize,
    pub height: usize,
    pub points: Vec<[f32; 3]>,
    pub depths: Vec<f32>,
}

impl Cloud {
    pub fn new(points: &Points, options: &Options) -> Self {
        let (width, height) = (points.width(), points.height());
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let points: Vec<[f32; 3]> = pixels
            .map(|(x, y)| {
                let point = points.at(x, y);
                let missing = !is_finite(point) || options.zero_is_missing && point == [0.0; 3];
                if missing { [f32::NAN; 3] } else { point }
            })
            .collect();
        let range = options.semantics == Semantics::Paper && options.paper.depth == Depth::Range;
        let depth = |&[x, y, z]: &[f32; 3]| if range { (x * x + y * y + z * z).sqrt() } else { z };
        let depths = points.iter().map(depth).collect();
        Cloud { width, height, points, depths }
    }

    pub fn index(&self, x: usize, y: usize) -> usize {
        y * self.width + x
    }

    pub fn at(&self, x: usize, y: usize) -> [f32; 3] {
        self.points[self.index(x, y)]
    }

    pub fn is_missing(&self, at: usize) -> bool {
        self.depths[at].is_nan()
    }

    /// The finite points of a rectangle, in double precision.
    pub fn finite(&self, rect: &Rect) -> impl Iterator<Item = [f64; 3]> {
        rect.pixels()
            .map(|(x, y)| self.at(x, y))
            .filter(|point| !point[2].is_nan())
            .map(|point| point.map(f64::from))
    }
}
